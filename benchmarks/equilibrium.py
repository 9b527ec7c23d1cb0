# SPDX-License-Identifier: MIT
"""Steps and time to equilibrium: steps of fixed length against steps that grow.

    python benchmarks/equilibrium.py                 all models, both formulations of contact; a few minutes
    python benchmarks/equilibrium.py roof slope      these models only

Prints the table of docs/notes/performance.md, "Statics". Both runs end when `unbalanced` is at most 1e-5; the fixed
step is g1 of the model (`max_growth = 1`). Time is processor time of one thread, the least of three runs: of the whole
program, and of the steps alone, for which that of a run without steps is taken off. The difference is the largest one
between the displacements of all vertices at rest, over the largest displacement.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import resource
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
TOLERANCE = 1e-5
MOST_STEPS = 20000


@dataclass(frozen=True)
class Case:
    """A model: geometry and analysis file, and options beside those of the study."""

    title: str
    geometry: str
    analysis: str
    options: str = ""


def shipped(name: str, title: str, options: str = "") -> Case:
    folder = ROOT / "inputs" / name
    return Case(title, (folder / f"{name}.dc").read_text(), (folder / f"{name}.df").read_text(), options)


def tunnel() -> Case:
    """The tunnel of `bench_steps` (10 m x 10 m, bedding and joints as there, another stream of random numbers), under
    its weight and a stress that increases with depth: s22 = s11 = -weight above, so that it stands."""
    generator = random.Random(7)
    width, height, floor = 40.0, 50.0, 11.0
    inner = (-19.0, 1.0, 19.0, 49.0)
    arch = [(5 * math.cos(math.pi * i / 16), floor + 5 + 5 * math.sin(math.pi * i / 16)) for i in range(17)]
    opening = [(-5.0, floor), (5.0, floor), *arch]
    outer = (-width / 2, 0.0, width / 2, height)
    lines = [(*opening[i], *opening[(i + 1) % len(opening)]) for i in range(len(opening))]
    boundary = box(outer)
    lines += box(inner)
    lines += [(x, y0, x, y1) for x in (inner[0], inner[2]) for y0, y1 in ((0.0, inner[1]), (inner[3], height))]
    y = inner[1]
    while (y := y + 1 + 0.5 * (generator.random() - 0.5)) <= inner[3] - 0.3:
        lines += outside((inner[0], y, inner[2], y), opening)
    trace, bridge, k, x = 25.0, 1.0, 0, inner[0]
    while (x := x + 1.5) <= inner[2] - 0.3:
        k += 1
        start = inner[1] - (0.5 * (trace + bridge) if k % 2 else 0.0)
        while start < inner[3]:
            lines += outside((x, max(start, inner[1]), x, min(start + trace, inner[3])), opening)
            start += trace + bridge
    fixed = [(s * 19.9, y) for s in (-1, 1) for y in (0.1, 25.0, 49.9)]
    fixed += [(x, y) for y in (0.5, 49.5) for x in (-18.5, 0.0, 18.5)]
    rows = [f"{n}" for n in ("0.01", f"{len(boundary) + len(lines)} {len(boundary)}", 0, 0, len(fixed), 0, 0, 1)]
    rows += [" ".join(f"{v:.9g}" for v in line) + " 1" for line in (*boundary, *lines)]
    rows += [f"{x} {y} {x} {y}" for x, y in fixed] + [f"0 {floor + 2}"]
    weight = 2500 * 9.81
    numbers = f"2500 {weight} 5e9 0.25 {-50 * weight} {-50 * weight} 0 {weight} {weight} 0 0 0 0\n35 0 0\n1.4\n"
    analysis = f"0 60 1 1 0.01 0.01 5e9\n{'0 ' * len(fixed)}\n{numbers}"
    bond = "&joint_material number = 1, cohesion = 5e5, tension = 2e5, brittle = .false. /"
    return Case("tunnel in bonded rock", "\n".join(rows) + "\n", analysis, bond)


def box(b: tuple[float, float, float, float]) -> list[tuple[float, ...]]:
    corners = [(b[0], b[1]), (b[2], b[1]), (b[2], b[3]), (b[0], b[3])]
    return [(*corners[i], *corners[(i + 1) % 4]) for i in range(4)]


def outside(line: tuple[float, ...], opening: list[tuple[float, float]]) -> list[tuple[float, ...]]:
    """The parts of a horizontal or vertical line outside a convex opening."""
    a, b = np.array(line[:2]), np.array(line[2:])
    first, last = 0.0, 1.0
    for i, corner in enumerate(opening):
        side = np.array(opening[(i + 1) % len(opening)]) - corner
        normal = np.array([-side[1], side[0]])  # to the inside
        at, rate = float(normal @ (a - corner)), float(normal @ (b - a))
        if rate > 0:
            first = max(first, -at / rate)
        elif rate < 0:
            last = min(last, -at / rate)
        elif at <= 0:
            return [line]
    if first >= last:
        return [line]
    parts = [(*a, *(a + first * (b - a)))] if first > 0 else []
    return parts + ([(*(a + last * (b - a)), *b)] if last < 1 else [])


CASES = {
    "roof": lambda: shipped("layered_roof", "layered roof", "&time max_open_close = 40 /"),
    "slope": lambda: shipped(
        "jointed_slope",
        "jointed slope held by friction",
        "&joint_material number = 1, friction = 35 /\n&joint_material number = 2, friction = 35 /\n"
        "&time max_open_close = 40 /",
    ),
    "tunnel": tunnel,
    "arch": lambda: shipped("flat_arch", "flat arch"),
}


def run(
    case: Case, formulation: str, growth: float, folder: Path
) -> tuple[int, int, tuple[float, float], np.ndarray, int]:
    """Steps, rounds, seconds of program and steps, displacements at rest, blocks."""
    (folder / "m.dc").write_text(case.geometry)
    (folder / "m.df").write_text(case.analysis)
    (folder / "m.nml").write_text(
        f"{case.options}\n&contact formulation = '{formulation}' /\n&time max_growth = {growth} /\n"
        f"&stage until = 'equilibrium', tolerance = {TOLERANCE}, max_steps = {MOST_STEPS} /\n"
        "&output contacts = .false. /\n&run save_every = 1000000 /\n"
    )
    program = os.environ.get("ROCKDDA_PROGRAM", os.fspath(ROOT / "build/bin/rockdda"))
    command = [
        program,
        "run",
        "m.dc",
        "m.df",
        "--config",
        "m.nml",
        "-o",
        "m.h5",
        "--threads",
        "1",
        "--force",
        "--quiet",
    ]
    without = least_time([*command, "--steps", "0"], folder)
    seconds = least_time(command, folder)
    with h5py.File(folder / "m.h5") as file:
        moved = file["frames/vertices"][-1] - file["model/vertices"][()]
        rounds = int(file["history/open_close_iterations"][()].sum())
        blocks, steps = len(file["model/block_area"]), len(file["history/step"])
    return steps, rounds, (seconds, seconds - without), moved, blocks


def least_time(command: list[str], folder: Path) -> float:
    """Processor time of a command [s], the least of three runs."""
    times = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode:
            raise SystemExit(f"{' '.join(command)}: {done.stderr}")
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", choices=[[], *CASES], help="models; all of them")
    chosen = parser.parse_args().cases or list(CASES)
    print("| model | contact | blocks | steps | rounds | program [s] | its steps [s] | difference of the places |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            case = CASES[name]()
            for formulation in ("length", "vertex"):
                fixed = run(case, formulation, 1, Path(folder))
                grown = run(case, formulation, 1000, Path(folder))
                off = np.abs(grown[3] - fixed[3]).max() / np.abs(fixed[3]).max()
                print(
                    f"| {case.title} | {formulation} | {fixed[4]} | {fixed[0]} → {grown[0]} | {fixed[1]} → {grown[1]} |"
                    f" {fixed[2][0]:.2f} → {grown[2][0]:.2f} | {fixed[2][1]:.2f} → {grown[2][1]:.2f} | {off:.1e} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
