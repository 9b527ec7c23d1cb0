# SPDX-License-Identifier: MIT
"""What searches of the critical factor cost: the table of docs/notes/critical-factor.md, "What a search costs".

    python benchmarks/critical_factor.py                  all models, some minutes
    python benchmarks/critical_factor.py slope demo       these models only
    python benchmarks/critical_factor.py --constants gap  factors with these constants halved and doubled

One core, `--jobs 1`: trials, steps and processor time (user) of the whole command. Random slope, wall, arch and
toppling slope are those of the validation, so that the package must be installed. With --constants the program is built
for each value; the sources are as they were afterwards.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import equilibrium

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = os.environ.get("ROCKDDA_PROGRAM", os.fspath(ROOT / "build/bin/rockdda"))


@dataclass(frozen=True)
class Search:
    """A model, written into a folder, and the options of its search."""

    title: str
    write: Callable[[Path], list[str]]  #: the arguments that name the model
    options: tuple[str, ...] = ()


def legacy(case: equilibrium.Case) -> Callable[[Path], list[str]]:
    """A geometry and an analysis file with options beside them."""

    def write(folder: Path) -> list[str]:
        (folder / "m.dc").write_text(case.geometry)
        (folder / "m.df").write_text(case.analysis)
        (folder / "m.nml").write_text(f"{case.options}\n&stage until = 'equilibrium' /\n")
        return ["m.dc", "m.df", "--config", "m.nml"]

    return write


def shipped(name: str) -> Callable[[Path], list[str]]:
    """A model of `inputs` as it is."""
    return lambda folder: [os.fspath(ROOT / "inputs" / name)]


def begun(kind: str) -> Callable[[Path], list[str]]:
    """What `rockdda new` writes."""

    def write(folder: Path) -> list[str]:
        subprocess.run([PROGRAM, "new", kind, "m", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        return ["m.nml"]

    return write


def validated(name: str) -> Callable[[Path], list[str]]:
    """A model of the validation."""

    def write(folder: Path) -> list[str]:
        from rockdda_validation.cases.factor_slopes import random_slope, required, toppling_slope
        from rockdda_validation.factor_models import FIRST_WALL, PIERCED_WALL, arch, wall

        models = {
            "random": random_slope,
            "large": lambda: random_slope(width=24.0, height=14.0, bedding=0.44, cross=0.52),
            "wall": lambda: wall("m", FIRST_WALL),
            "pierced": lambda: wall("m", PIERCED_WALL),
            "arch": lambda: arch(28),
            "toppling": lambda: toppling_slope(1.208 * required(0.0)),
        }
        model = models[name.removeprefix("dilating ")]()
        if name.startswith("dilating"):
            (joint,) = model.joint_materials
            model.options["joint_law"] = [{"material": 1, "dilation": joint.friction_angle}]
        model.write(folder)
        return [f"{model.name}.nml"]

    return write


PUSH = ("--search", "push")
SEARCHES = {
    "slope": Search("slope, friction 35°", legacy(equilibrium.CASES["slope"]())),
    "tunnel": Search("tunnel", shipped("tunnel")),
    "bonded": Search("tunnel in bonded rock", legacy(equilibrium.tunnel())),
    "demo": Search("slope of `rockdda new slope`", begun("slope")),
    "random": Search("random slope", validated("random")),
    "large": Search("slope, 961 random blocks", validated("large")),
    "wall": Search("dry-stone wall, push", validated("wall"), (*PUSH, "--tolerance", "0.002")),
    "pierced": Search("wall with an opening, push", validated("pierced"), (*PUSH, "--tolerance", "0.002")),
    "dilating": Search("the same, dilation", validated("dilating pierced"), (*PUSH, "--tolerance", "0.002")),
    "arch": Search("arch of 28 voussoirs, push", validated("arch"), (*PUSH, "--tolerance", "0.001")),
    "toppling": Search("toppling slope", validated("toppling"), ("--tolerance", "0.005")),
    "ec7": Search("Sau Mau Ping, half full", shipped("sau_mau_ping/half_full.nml"), ("--factors", "ec7")),
}


#: Constants of the search and their files in src.
CONSTANTS = {
    **dict.fromkeys(("apart", "loaded_apart", "mostly", "usual_share"), "stepping/stage/verdict"),
    **dict.fromkeys(("gap", "parts", "compared"), "run/search/factor_search"),
    **dict.fromkeys(("far", "steepest", "slow_trials", "hardly_shorter"), "run/search/factor_search/search_path"),
    "splinter": "run/search/factor_search/settled_run",
}


def find(search: Search, folder: Path) -> subprocess.CompletedProcess[str]:
    """Write a model and search its factor."""
    return subprocess.run(
        [PROGRAM, "fos", *search.write(folder), *search.options, "--jobs", "1", "--json"],
        cwd=folder, check=False, text=True, capture_output=True, env=os.environ | {"OMP_NUM_THREADS": "1"},
    )  # fmt: skip


def factors(models: list[str]) -> dict[str, str]:
    """Factors of the models by the program as it is built; warnings of splinters and of springs count."""
    found = {}
    warned = {"splinter": "splinter", "as springs of that stiffness": "springs"}
    subprocess.run(["cmake", "--build", "build", "--target", "rockdda_program"], cwd=ROOT, check=True, stdout=2)
    for name in models:
        with tempfile.TemporaryDirectory() as folder:
            outcome = find(SEARCHES[name], Path(folder))
        found[name] = str(json.loads(outcome.stdout).get("factor"))
        found[name] += "".join(f" ({word})" for text, word in warned.items() if text in outcome.stderr)
    return found


def vary(name: str, models: list[str], usual: dict[str, str]) -> str:
    """The row of a constant."""
    source = ROOT / "src" / f"{CONSTANTS[name]}.f90"
    text = source.read_text(encoding="utf-8")
    pattern = re.compile(rf"(parameter\b[^!\n]*:: (?:[^!\n]*, )?{name} = )([0-9.]+)")
    found = pattern.search(text)
    assert found
    cells = []
    try:
        for factor in (0.5, 2.0):
            # of a share just below 1 what it leaves
            value = float(found[2])
            other = value * factor if value < 0.9 or value >= 1 else 1 - (1 - value) * factor
            number = f"{other:.6g}" if "." in found[2] or other % 1 else str(round(other))
            source.write_text(pattern.sub(rf"\g<1>{number}", text, count=1), encoding="utf-8")
            changed = {model: value for model, value in factors(models).items() if value != usual[model]}
            cells.append(", ".join(f"{model} {value} for {usual[model]}" for model, value in changed.items()) or "none")
    finally:
        source.write_text(text, encoding="utf-8")
    return f"| `{name}` | {found[2]} | {cells[0]} | {cells[1]} |"


def measure(search: Search, folder: Path) -> str:
    """The row of a search."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    outcome = find(search, folder)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    found = json.loads(outcome.stdout)
    if outcome.returncode != 0:
        sys.exit(f"{search.title}: {found['messages']}")
    steps = [trial["steps"] for trial in found["trials"]]
    undecided = outcome.stderr.count("neither came to rest")
    return (
        f"| {search.title} | {found['factor']:.4g} | {found['high'] - found['low']:.2g} | {len(steps)} | {sum(steps)} "
        f"| {max(steps)} | {undecided} | {seconds:.1f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of searches of the critical factor.")
    parser.add_argument("models", nargs="*", choices=[*SEARCHES, []], metavar="MODEL", help=", ".join(SEARCHES))
    parser.add_argument("--constants", nargs="+", choices=list(CONSTANTS), metavar="NAME", help=", ".join(CONSTANTS))
    arguments = parser.parse_args()
    chosen = arguments.models or list(SEARCHES)
    if arguments.constants:
        print("| constant | value | halved | doubled |\n|---|---|---|---|")
        usual = factors(chosen)
        for name in arguments.constants:
            print(vary(name, chosen, usual), flush=True)
        subprocess.run(["cmake", "--build", "build", "--target", "rockdda_program"], cwd=ROOT, check=True, stdout=2)
        return
    print("| model | factor | bracket | trials | steps | longest trial | undecided | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    for name in chosen:
        with tempfile.TemporaryDirectory() as folder:
            print(measure(SEARCHES[name], Path(folder)), flush=True)


if __name__ == "__main__":
    main()
