# SPDX-License-Identifier: MIT
"""What changes between contacts by length and at vertices: every model of inputs/, and legacy files.

    python benchmarks/formulations.py                        the models of inputs/, two minutes
    python benchmarks/formulations.py --legacy FOLDER        and circleslope, pushblock, fixedlines in FOLDER
    python benchmarks/formulations.py incline stack          these models only; the rows of the others are kept
    python benchmarks/formulations.py --bits                 the same bits for 1, 2, 4 threads and resumed at half?
    python benchmarks/formulations.py --table                write docs/notes/formulations.md from the rows, run nothing

Needs the package rockdda (PYTHONPATH=postprocess) for legacy files in DDAML. ROCKDDA_PROGRAM names the program, default
build/bin/rockdda. Rows go to benchmarks/results/formulations.csv, the table made of them to docs/notes/formulations.md.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = Path(os.environ.get("ROCKDDA_PROGRAM", ROOT / "build/bin/rockdda")).absolute()
RESULTS = ROOT / "benchmarks/results/formulations.csv"
PAGE = ROOT / "docs/notes/formulations.md"
COLUMNS = ("model", "what", "known", "variant", "status", "answer", "largest", "steps", "rounds", "cuts")
#: formulation and factor of g0
VARIANTS = {"vertex": ("vertex", 1.0), "length": ("length", 1.0), "twice g0": ("length", 2.0)}
Read = Callable[[h5py.File], float]


def along(point: int) -> Read:
    """How far a measured point has moved [m]."""
    return lambda r: float(np.hypot(*r["history/measured_displacement"][-1, point]))


def down(point: int) -> Read:
    """How far a measured point has sunk [mm]."""
    return lambda r: float(-1000 * r["history/measured_displacement"][-1, point, 1])


def crest(r: h5py.File) -> float:
    """How far the first measured point has moved in x [mm]."""
    return float(1000 * r["history/measured_displacement"][-1, 0, 0])


def turned(r: h5py.File) -> float:
    """Rotation at the first measured point [°]."""
    return float(np.degrees(r["history/measured_rotation"][-1, 0]))


def mean_slide(r: h5py.File) -> float:
    """Mean motion of the blocks that slide [m]."""
    area = r["model/block_area"][:]
    moved = np.hypot(*(r["frames/centroid"][-1] - r["frames/centroid"][0]).T)
    return float(moved[area < 50] @ area[area < 50] / area[area < 50].sum())


def farthest(r: h5py.File) -> float:
    """How far the block that has moved furthest has moved [m]."""
    return float(np.hypot(*(r["frames/centroid"][-1] - r["frames/centroid"][0]).T).max())


def moved(r: h5py.File) -> float:
    """How far the block that has moved furthest, of those that are there at the end, has moved [mm]."""
    distance = np.hypot(*(r["frames/centroid"][-1] - r["model/block_centroid"][:]).T)
    return float(1000 * distance[r["frames/active"][-1] > 0 if "frames/active" in r else slice(None)].max())


@dataclass(frozen=True)
class Answer:
    """The number that stands for a model."""

    what: str
    read: Read
    known: str = ""


ANSWERS = {
    "free_fall": Answer("path [m]", along(0), "4.8019"),
    "incline": Answer("slide of the lower block [m]", along(0), "0.9064"),
    "pushed_block": Answer("slide [m]", along(0), "0.4958"),
    "released_block": Answer("slide [m]", along(0), "1.3471"),
    "shaking_block": Answer("slide [m]", along(0), "0.3266"),
    "toppling_column": Answer("rotation after 1 s [°]", turned, "14.14"),
    "jointed_slope": Answer("mean slide [m]", mean_slide, "0.9064"),
    "stack": Answer("sinking of the third block [mm]", down(2)),
    "gravity_dam": Answer("crest, x [mm]", crest),
    "flat_arch": Answer("sag [mm]", down(0)),
    "six_block_beam": Answer("sag [mm]", down(0)),
    "bolted_beam": Answer("sag in the middle [mm]", down(2)),
    "cantilever": Answer("deflection of the tip [mm]", down(0), "2.391"),
    "island": Answer("sinking [mm]", down(0)),
    "tunnel": Answer("roof, down [mm]", down(0)),
    "crossed_joints": Answer("roof, down [mm]", down(0)),
    "layered_roof": Answer("sag of the lowest layer [mm]", down(0)),
}
#: labelled models, by their file: g0 is chosen for the formulation, or joints have a stiffness of their own
LABELLED = {
    "bedding_slab": Answer("block that moved furthest [mm]", moved),
    "sau_mau_ping/full": Answer("block that moved furthest [mm]", moved),
    "sau_mau_ping/dry": Answer("block that moved furthest [mm]", moved),
    "dam_on_joints": Answer("block that moved furthest [mm]", moved),
    "arch_on_centring": Answer("block that moved furthest [mm]", moved),
    "benched_slope": Answer("block that moved furthest [mm]", moved),
    "two_headings": Answer("block that moved furthest [mm]", moved),
}
#: files of a folder with legacy data; a DDAML geometry without analysis gets a template, and the steps named here
LEGACY = {
    "circleslope": (("circleslope.geo", "circleslope.ana"), 0, Answer("block that moved furthest [m]", farthest)),
    "pushblock": (
        ("ddaml/pushblock.geo", "ddaml/pushblock.ana"), 99, Answer("pushed block after 0.99 s [m]", farthest, "5.445"),
    ),
    **{
        f"fixedlines case{n}": (
            (f"ddaml/fixedlines/case{n}.geo",), 20, Answer("block that moved furthest [m]", farthest)
        )
        for n in range(1, 9)
    },
}  # fmt: skip


def prepare(name: str, legacy: Path | None, folder: Path) -> tuple[list[str], Answer, int]:
    """Copy a model into a folder: its files, what is read from its results, its number of steps (0: its own)."""
    if name in LEGACY:
        if legacy is None:
            raise SystemExit(f"{name}: --legacy FOLDER is missing")
        files, steps, answer = LEGACY[name]
        if not files[0].startswith("ddaml"):
            shutil.copy(legacy / files[0], folder / "model.dc")
            shutil.copy(legacy / files[1], folder / "model.df")
        else:
            os.environ["ROCKDDA_PROGRAM"] = str(PROGRAM)
            from rockdda.convert import convert

            convert([legacy / file for file in files], folder / "model", template=len(files) == 1)
    elif name in LABELLED:
        place, _, case = name.partition("/")
        for file in (ROOT / "inputs" / place).glob("*.dc"):
            shutil.copy(file, folder)
        shutil.copy(ROOT / "inputs" / place / f"{case or place}.nml", folder / "model.nml")
        return ["run.nml"], LABELLED[name], 0
    else:
        answer, steps = ANSWERS[name], 0
        for file in (ROOT / "inputs" / name).iterdir():
            if file.suffix in (".dc", ".df", ".nml"):
                shutil.copy(file, folder / f"model{file.suffix}")
            elif file.suffix == ".csv":
                shutil.copy(file, folder)
    return ["model.dc", "model.df"], answer, steps


def contact_stiffness(folder: Path, files: list[str]) -> float:
    """g0 of a model, as its log has it."""
    execute(folder, [*files, "--config", "run.nml", "--steps", "1"])
    found = re.search(r"contact stiffness \(g0\) += (\S+)", (folder / "out.log").read_text(encoding="utf-8"))
    assert found is not None
    return float(found[1])


def execute(folder: Path, arguments: list[str]) -> dict:
    """The JSON summary of a run, which writes out.h5."""
    command = [str(PROGRAM), "run", *arguments, "-o", "out.h5", "--force", "--quiet", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return json.loads(done.stdout)


def write_options(folder: Path, formulation: str, g0: float = 0.0) -> None:
    """Options of the model with this formulation and, not 0, g0."""
    options = folder / "model.nml"
    text = options.read_text(encoding="utf-8") if options.exists() else ""
    text = re.sub(r"&contact\s+formulation = '\w+'\s*/", "", text)
    stiffness = f", stiffness = {g0}" if g0 > 0 else ""
    (folder / "run.nml").write_text(f"{text}\n&contact formulation = '{formulation}'{stiffness} /\n", encoding="utf-8")


def measure(name: str, legacy: Path | None) -> list[dict[str, str]]:
    """A row for each variant of a model."""
    rows = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        files, answer, steps = prepare(name, legacy, folder)
        for variant, (formulation, factor) in VARIANTS.items():
            row = {"model": name, "what": answer.what, "known": answer.known, "variant": variant}
            rows.append(row)
            if name == "cantilever" and formulation == "vertex":
                row["status"] = "ties act by length only"
                continue
            if name in LABELLED and factor > 1:
                row["status"] = "chosen for the formulation"
                continue
            write_options(folder, formulation)
            if factor > 1:
                write_options(folder, formulation, factor * contact_stiffness(folder, files))
            options = [] if name in LABELLED else ["--config", "run.nml"]
            told = execute(folder, [*files, *options, *(["--steps", str(steps)] if steps else [])])
            row["status"] = told["status"]
            if told["status"] != "done":
                continue
            with h5py.File(folder / "out.h5") as results:
                corners = results["frames/vertices"]
                largest = np.hypot(*(corners[-1] - corners[0]).T).max()
                row |= {"answer": f"{answer.read(results):.6g}", "largest": f"{largest:.4g}"}
                row |= {"steps": str(told["steps"]), "cuts": str(sum(told["cuts"].values()))}
                row["rounds"] = str(int(results["history/open_close_iterations"][:].sum()))
    return rows


def stored() -> list[dict[str, str]]:
    """Rows of earlier runs."""
    if not RESULTS.exists():
        return []
    with RESULTS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def keep(name: str, rows: list[dict[str, str]]) -> None:
    """Put the rows of a model in place of its old ones."""
    order = [*ANSWERS, *LABELLED, *LEGACY]
    kept = [row for row in stored() if row["model"] != name] + rows
    with RESULTS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n", restval="")
        writer.writeheader()
        writer.writerows(sorted(kept, key=lambda row: order.index(row["model"])))


HEAD = """# Formulations compared

Every model of `inputs/` but its studies, and some files of earlier programs, with contacts at vertices
(`&contact formulation = 'vertex'`) and by length (`'length'`, the default), all other numbers as in the files. "Twice
g0" is by length too, with joints as stiff as a face with two contacts of g0 each
([why](../contact-numbers.md#stiffness-per-length)); labelled models choose g0 so themselves, or name the stiffness of
their joints. [When to use which](../coming-from.md#shis-dda-and-dda-for-windows). The table is
made by `benchmarks/formulations.py`.

- Sinking and sagging grow where joints are softer. A corner about which a block turns has the end of an interval, a
  sixth of its edge, in place of a spring of g0: arches, roofs and columns give way more with twice g0 too.
- Blocks that slide from rest get a little further, because friction acts in full only when the shear springs have
  stretched to it. With joints a hundred times as stiff they meet the closed form: `incline` and `jointed_slope` within
  2e-5, `shaking_block` within 1e-6.
- In `tunnel`, `crossed_joints` and `layered_roof` joints carry the initial stress from the start with both; roofs sag
  more by length, where joints are softer.
- Labelled models end in the same way with both, too. Those with the stiffness of a joint (`arch_on_centring`,
  `benched_slope`, `two_headings`) have it by length only; with `'vertex'` each contact has E.
- In `circleslope` slices catch on the facets of the circle with `'vertex'` and rest after some 1300 steps; by length
  they move on as on an arc, and rest after some 4000.
- With `preset = 'dda_windows'` the unlabelled models of `inputs` and 20 random piles have, over 100 steps, the bits of
  version 0.1.0 (`scripts/same_bits`), but `six_block_beam`, whose first step needs no shorter one any more. With
  `'vertex'` alone 13 of the piles differ, by 2e-9 to 7e-8 of the largest displacement where they begin to.
- No verdict of these models changes: what slides, slides, what stands, stands. Verdicts on rock whose weight comes at
  once may change. Of the six tunnels in the [tutorial](../tutorial.md#5-what-if) four come loose by length (g0 = 1e10),
  with joints as stiff at vertices (5e9) one: with the wider spacing a block slips out of the crown at every friction
  angle, which with `'vertex'` stays at 15° and 30° (by length is right: an arch of two blocks 1.8 m thick over 2.9 m
  needs tan φ = 4t/B = 2.5 at its sides); and with joints of 5° and the narrow spacing the highest beds part by more
  than the limit, though all points are held.
"""


def write_page() -> None:
    """Write docs/notes/formulations.md."""
    rows = stored()
    text = [HEAD]
    text += [
        "| model | what | known | vertex | length | twice g0 | largest displacement [mm] | steps | rounds | cuts |"
    ]
    text += ["|---|---|---|---|---|---|---|---|---|---|"]
    for name in dict.fromkeys(row["model"] for row in rows):
        own = {row["variant"]: row for row in rows if row["model"] == name}
        one = own["length"]
        cells = [name, one["what"], one["known"]]
        cells += [_number(own[variant]["answer"]) for variant in VARIANTS]
        cells.append(", ".join(_number(_times(own[v]["largest"], 1000), 3) for v in VARIANTS))
        cells += [", ".join(own[v][column] or "–" for v in VARIANTS) for column in ("steps", "rounds", "cuts")]
        text.append("| " + " | ".join(cells) + " |")
    text += ["", "Three numbers in a column are those with vertex, length, twice g0.", ""]
    PAGE.write_text("\n".join(text), encoding="utf-8")


def _times(value: str, factor: float) -> str:
    return str(float(value) * factor) if value else ""


def _number(value: str, digits: int = 4) -> str:
    return f"{float(value):.{digits}g}" if value else "–"


def same_bits(name: str, legacy: Path | None) -> list[str]:
    """What differs between runs by length: with 1, 2 and 4 threads, and resumed at half."""
    differences = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        files, _, steps = prepare(name, legacy, folder)
        write_options(folder, "length")
        options = [] if name in LABELLED else ["--config", "run.nml"]
        arguments = [*files, *options]
        if steps:
            arguments += ["--steps", str(steps)]
        total = execute(folder, [*arguments, "--threads", "1"])["steps"]
        (folder / "out.h5").replace(folder / "whole.h5")
        for threads in ("2", "4"):
            execute(folder, [*arguments, "--threads", threads])
            differences += [f"{threads} threads: {one}" for one in compare(folder / "whole.h5", folder / "out.h5")]
        half = max(1, total // 2)
        arguments = [*files, *options, "--steps", str(half), "--threads", "2"]
        execute(folder, arguments)
        command = [str(PROGRAM), "resume", "out.ckpt.h5", "--steps", str(total - half), "--threads", "1", "--quiet"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        differences += [f"resumed at step {half}: {one}" for one in compare(folder / "whole.h5", folder / "out.h5")]
    return differences


def compare(one: Path, other: Path) -> list[str]:
    """Datasets of histories and of the last frame that differ in a bit; texts of the input do not count."""
    found: list[str] = []
    with h5py.File(one) as a, h5py.File(other) as b:
        for name in a["history"]:
            if not np.array_equal(a["history"][name][:], b["history"][name][:], equal_nan=True):
                found.append(f"history/{name}")
        for name in ("vertices", "stress", "velocity"):
            if not np.array_equal(a["frames"][name][-1], b["frames"][name][-1]):
                found.append(f"frames/{name}")
    return found


def main() -> int:
    """Measure, compare bits, or write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", help="default: all")
    parser.add_argument("--legacy", type=Path, help="folder of legacy files")
    parser.add_argument("--bits", action="store_true", help="compare bits by length, write nothing")
    parser.add_argument("--table", action="store_true", help="write the page, run nothing")
    options = parser.parse_args()
    names = options.models or [*ANSWERS, *LABELLED, *(LEGACY if options.legacy else ())]
    if unknown := set(names) - {*ANSWERS, *LABELLED, *LEGACY}:
        parser.error(f"no model {', '.join(sorted(unknown))}")
    if options.bits:
        failed = 0
        for name in names:
            differences = same_bits(name, options.legacy)
            failed += bool(differences)
            print(f"{name}: {', '.join(differences) or 'same bits'}", flush=True)
        return min(failed, 1)
    for name in () if options.table else names:
        rows = measure(name, options.legacy)
        for row in rows:
            print(*row.values(), sep=" | ", flush=True)
        keep(name, rows)
    write_page()
    return 0


if __name__ == "__main__":
    sys.exit(main())
