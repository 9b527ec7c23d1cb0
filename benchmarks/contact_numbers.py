# SPDX-License-Identifier: MIT
"""Effect of g0, g1 and g2 on the answer of a model and on its cost.

    python benchmarks/contact_numbers.py                     all models, an hour on one core
    python benchmarks/contact_numbers.py arch stack          these models only; the rows of the others are kept
    python benchmarks/contact_numbers.py --tables            print those of docs/notes/contact-numbers.md, run nothing

The tutorial needs the package rockdda (PYTHONPATH=postprocess). Each of the three numbers is varied alone, the others
keep those of the base. Figures go to benchmarks/results/contact_numbers.csv. Time is processor time of one thread, and
depends on the machine; everything else does not.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import os
import re
import resource
import subprocess
import tempfile
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks/results/contact_numbers.csv"
G0 = (0.02, 0.1, 0.5, 1.0, 2.0, 10.0, 50.0, 500.0)  # over E
G1 = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)  # over that of the model
G2 = (1e-4, 5e-4, 2e-3, 1e-2, 5e-2)
BASE = (1.0, 1.0, 1e-2)
MOST_SECONDS = 180.0  # of a run, by the clock
COLUMNS = (
    *("model", "varied", "g0_over_E", "g1", "g2", "edge", "half_height", "status", "done", "answer", "force"),
    *("loose", "steps", "rounds", "cuts", "seconds"),
)


@dataclass(frozen=True)
class Study:
    """A model and the quantity that is evaluated from its results."""

    title: str
    answer: str  # what it is, with unit
    read: Callable[[h5py.File], float]
    youngs_modulus: float
    g1: float
    end: float  # time in dynamics; statics: number of steps
    static: bool
    network: str = ""  # statistics of joints; else the folder in inputs/
    g0: tuple[float, ...] = G0
    g1_over: tuple[float, ...] = G1
    g2: tuple[float, ...] = G2
    base: tuple[float, float, float] = BASE
    formulation: str = "vertex"  # with 'length', twice the g0 makes joints of mean length as stiff


def _moved(results: h5py.File) -> float:
    """Mean displacement of the blocks, weighted by area [mm]."""
    area = results["model/block_area"][:]
    centroids = results["frames/centroid"]
    moved = np.linalg.norm(centroids[-1] - centroids[0], axis=1)
    return float(1000 * (area @ moved) / area.sum())


def _measured(point: int) -> Callable[[h5py.File], float]:
    """Vertical displacement of a measured point [mm]."""
    return lambda results: float(1000 * results["history/measured_displacement"][-1, point, 1])


def _swing(results: h5py.File) -> float:
    """Mean vertical displacement of the first measured point over the last two thirds of the run [mm]."""
    time = results["history/time"][:]
    return float(1000 * results["history/measured_displacement"][:, 0, 1][time > time[-1] / 3].mean())


def _turned(results: h5py.File) -> float:
    """Rotation at the first measured point [°]."""
    return float(np.degrees(results["history/measured_rotation"][-1, 0]))


def _thrust(results: h5py.File) -> float:
    """Horizontal force of the supports in the left half of the model [kN]."""
    points = results["model/fixed_points"][:]
    left = points[:, 0] < points[:, 0].mean()
    return float(results["history/fixed_force"][-1, left, 0].sum() / 1000)


NETWORK = """&lines seed = 4 /
&boundary window = -4, -4, 4, 4, frame = 1 /
&joint_set inclination = 20, spacing = 0.7, randomness = 0.4, trace = 4, bridge = 0.5 /
&joint_set inclination = 75, spacing = 0.7, randomness = 0.4, trace = 4, bridge = 0.5 /
&joint_set inclination = 32, spacing = 3, randomness = 0.4, trace = 4, bridge = 1 /
"""
ROCK = """{k01}
{steps}
1 1
0.01
{g1}
{g0}
0 0 0 0 0 0 0 0 0 0 0 0
2500 24525 {modulus} 0.25
0 0 0 0 0 0
0 0 0
35 0 0
"""
MEAN = "mean displacement [mm]"
STUDIES = {
    "jointed_slope": Study("jointed slope, slides", MEAN, _moved, 5e9, 5e-3, 1.0, False),
    "toppling_column": Study("column, topples", "rotation [°]", _turned, 5e9, 1e-2, 1.0, False),
    "network": Study("random network, weight at once", MEAN, _moved, 5e9, 5e-3, 0.1, False, NETWORK),
    "network_static": Study("random network, static", MEAN, _moved, 5e9, 5e-3, 60, True, NETWORK),
    "stack": Study("stack, static", MEAN, _moved, 1e10, 1e-2, 60, True),
    "flat_arch": Study("flat arch of voussoirs, static", MEAN, _moved, 5e9, 1e-2, 100, True),
    "layered_roof": Study("layered roof under stress, static", MEAN, _moved, 5e9, 2e-2, 60, True),
    "tunnel": Study("tunnel under stress, static", "roof [mm]", _measured(0), 5e9, 2e-2, 40, True),
    "tutorial": Study(
        "tunnel of the tutorial, weight at once",
        "crown [mm]",
        _swing,
        2e10,
        5e-4,
        0.75,
        False,
        g0=(0.25, 0.5, 1.0, 10.0),
        g1_over=(0.5, 1.0, 2.0),
        g2=(5e-4, 2e-3, 1e-2),
        base=(0.5, 1.0, 5e-4),
        formulation="length",
    ),
}


def run(name: str, g0: float, g1: float, g2: float, program: Path) -> dict[str, Any]:
    """One run; g0 over E, g1 over that of the model."""
    study = STUDIES[name]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        if name == "tutorial":
            write_tutorial(place)
            subprocess.run([program, "lines", "rock.dl", "--quiet"], cwd=place, check=True, capture_output=True)
            files = [place / "rock.dc", place / "rock.df"]
        elif study.network:
            (place / "model.dl").write_text(study.network)
            subprocess.run([program, "lines", "model.dl", "--quiet"], cwd=place, check=True, capture_output=True)
            values = {"k01": 0 if study.static else 1, "steps": 60, "g1": study.g1, "g0": study.youngs_modulus}
            (place / "model.df").write_text(ROCK.format(modulus=study.youngs_modulus, **values))
            files = [place / "model.dc", place / "model.df"]
        else:
            files = [ROOT / "inputs" / name / f"{name}{suffix}" for suffix in (".dc", ".df")]
        steps, end = (f"steps = {study.end:.0f}", "") if study.static else ("steps = 100000", f"t_end = {study.end}")
        (place / "options.nml").write_text(
            f"&contact formulation = '{study.formulation}', stiffness = {g0 * study.youngs_modulus} /\n"
            f"&time dt_max = {g1 * study.g1}, displacement_ratio = {g2} /\n"
            f"&run {', '.join(filter(None, (steps, end)))}, save_every = 1000000 /\n&output contacts = .false. /\n"
        )
        command = [program, "run", *files, "--config", "options.nml", "-o", "out.h5", "--quiet", "--json"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [str(word) for word in (*command, "--threads", 1, "--max-wall", MOST_SECONDS)],
            cwd=place, capture_output=True, text=True, check=False, env=os.environ | {"OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        told = json.loads(done.stdout)
        with h5py.File(place / "out.h5") as results:
            return {
                "model": name,
                **{"g0_over_E": g0, "g1": g1 * study.g1, "g2": g2, "edge": _edge(results)},
                "half_height": 0.5 * float(np.ptp(results["model/vertices"][:, 1])),
                "status": told["status"],
                "done": told["steps" if study.static else "time"] / study.end,
                "answer": study.read(results) if told["steps"] else 0.0,
                "force": _thrust(results) if told["steps"] else 0.0,
                "loose": _loose(place / "out.h5") if name == "tutorial" else "",
                "steps": told["steps"],
                "rounds": _mean(results["history/open_close_iterations"][:]),
                "cuts": _mean(results["history/attempts"][:]) - 1,
                "seconds": after.ru_utime - before.ru_utime,
            }


def write_tutorial(folder: Path) -> None:
    """The two files of docs/tutorial.md."""
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    for name in ("rock.dl", "rock.df"):
        block = re.search(rf"`{name}`[^\n]*\n\n((?:    .*\n)+)", page)
        assert block is not None
        (folder / name).write_text(textwrap.dedent(block[1]), encoding="utf-8")


def _loose(path: Path) -> float:
    """Height of loosened rock by `rockdda-post loosening` [m]."""
    from rockdda import open
    from rockdda.analysis.loosening import loosening_of

    return loosening_of(open(path)).height


def _mean(values: Any) -> float:
    return float(values.mean()) if len(values) else float("nan")


def _edge(results: h5py.File) -> float:
    """Mean length of the edges of all blocks [m]."""
    vertices, offset = results["model/vertices"][:], results["model/vertex_offset"][:]
    outlines = [vertices[i:j] for i, j in itertools.pairwise(offset)]
    return float(np.mean(np.concatenate([np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1) for p in outlines])))


def measure(name: str, program: Path) -> list[dict[str, Any]]:
    """All runs of a model."""
    study = STUDIES[name]
    g0, g1, g2 = study.base
    runs = {("g0", (x, g1, g2)): None for x in study.g0}
    runs |= {("g1", (g0, x, g2)): None for x in study.g1_over}
    runs |= {("g2", (g0, g1, x)): None for x in study.g2}
    kept: dict[tuple[float, ...], dict[str, Any]] = {}
    rows = []
    for varied, numbers in runs:
        if numbers not in kept:
            kept[numbers] = run(name, *numbers, program)
        rows.append({"varied": varied, **kept[numbers]})
        print(*(f"{x:.4g}" if isinstance(x, float) else x for x in rows[-1].values()), flush=True)
    return rows


def read_results() -> list[dict[str, str]]:
    """Read the rows stored in the project."""
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_results(rows: list[dict[str, Any]]) -> None:
    """Store the rows; those of models that were not run stay."""
    made = {row["model"] for row in rows}
    kept = [row for row in read_results() if row["model"] not in made] if RESULTS.exists() else []
    order = list(STUDIES)
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for row in sorted(kept + rows, key=lambda row: order.index(row["model"])):
            writer.writerow({name: f"{x:.6g}" if isinstance(x, float) else x for name, x in row.items()})


def tables(rows: list[dict[str, str]]) -> str:
    """The tables of docs/notes/contact-numbers.md: answer over that of the base, then rounds over those of the base."""
    out = []
    for varied, column, name in (("g0", "g0_over_E", "g0/E"), ("g1", "g1", "g1 [s]"), ("g2", "g2", "g2")):
        out += [f"*{name} varied*", "", "| model | " + name + ": answer, cost |", "|---|---|"]
        for model, study in STUDIES.items():
            mine = [row for row in rows if row["model"] == model]
            base = next(row for row in mine if row["varied"] == "g0" and _is_base(row, study))
            cells = (_cell(row, column, base) for row in mine if row["varied"] == varied)
            what = f"{study.title}: {study.answer} {float(base['answer']):.3g}"
            out.append(f"| {what} | {'; '.join(cells)} |")
        out.append("")
    return "\n".join(out)


def _is_base(row: dict[str, str], study: Study) -> bool:
    return abs(float(row["g0_over_E"]) / study.base[0] - 1) < 1e-6


def _cell(row: dict[str, str], column: str, base: dict[str, str]) -> str:
    """One run: value: answer, cost."""
    value = f"**{float(row[column]):g}**: "
    if row["status"] != "done":
        return value + f"ends at {100 * float(row['done']):.2g} %"
    return value + f"{float(row['answer']) / float(base['answer']):.3g}, {_rounds(row) / _rounds(base):.2g}"


def _rounds(row: dict[str, str]) -> float:
    """Approximate number of open-close rounds of all attempts."""
    return float(row["steps"]) * float(row["rounds"]) * (1 + float(row["cuts"]))


def main() -> None:
    """Measure, or print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", help=", ".join(STUDIES))
    parser.add_argument("--program", type=Path, default=ROOT / "build/bin/rockdda")
    parser.add_argument("--tables", action="store_true", help="print the tables, run nothing")
    options = parser.parse_args()
    if options.tables:
        print(tables(read_results()))
        return
    for name in options.models or STUDIES:
        write_results(measure(name, options.program))


if __name__ == "__main__":
    main()
