#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Round holes excavated in intact rock of tied cells, against closed forms (T8, T9).

    python3 benchmarks/excavated_holes.py [--figure PICTURE]

The hole is one block; rings of cells around it grow with the distance up to 20 radii, where the rock is fixed. The
ground comes to rest under its stress, then the hole is excavated, in T9 in three shares. The program is that of
ROCKDDA_PROGRAM, else of the build tree. Needs numpy and h5py, the figure matplotlib.
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).resolve().parents[1]
FAR = 20.0  # outer radius over that of the hole: 0.4 % of the displacement of T9 is missing there
SIZES = (24, 40, 56, 80)  # cells around the hole
CELLS = 4  # of a ray, whose stresses are extended to the wall
SHARES = (0.4, 0.7, 1.0)

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """A hole and its ground."""

    radius: float
    young: float
    poisson: float
    stress: tuple[float, float]  # horizontal, vertical; tension positive
    shares: tuple[float, ...]


GROUND_REACTION = Case(5.0, 10e9, 0.25, (-10e6, -10e6), SHARES)
KIRSCH = Case(2.0, 12e9, 0.3, (-4e6, -10e6), (1.0,))


@dataclass(frozen=True)
class Result:
    """What came out: inward displacements of the springline and the crown by share, stresses of cells at the end."""

    cells: int
    springline: Floats
    crown: Floats
    unbalanced: Floats
    centroid: Floats  # (cells, 2), the hole left out
    stress: Floats  # (cells, 3)
    around: int

    def hoop(self, k: int) -> float:
        """Hoop stress of a cell."""
        t = math.atan2(self.centroid[k, 1], self.centroid[k, 0])
        s = self.stress[k]
        return float(s[0] * math.sin(t) ** 2 + s[1] * math.cos(t) ** 2 - 2 * s[2] * math.sin(t) * math.cos(t))

    def at_wall(self, k: int, radius: float, cells: int = CELLS) -> float:
        """Hoop stress at the wall on the ray through cell k of the first ring: the polynomial through the stresses of
        the nearest cells at their centroids."""
        ray = range(k, k + cells * self.around, self.around)
        depth = np.array([float(np.hypot(*self.centroid[j])) for j in ray]) - radius
        return float(np.polyfit(depth, [self.hoop(j) for j in ray], cells - 1)[-1])


def kirsch_hoop(case: Case, x: float, y: float) -> float:
    """Hoop stress beside a round hole."""
    q = case.radius**2 / (x * x + y * y)
    mean, half = 0.5 * (case.stress[0] + case.stress[1]), 0.5 * (case.stress[0] - case.stress[1])
    return mean * (1 + q) - half * (1 + 3 * q * q) * math.cos(2 * math.atan2(y, x))


def kirsch_wall(case: Case) -> tuple[float, float]:
    """Inward displacement of springline and crown by the excavation, plane strain."""
    mean, half = -0.5 * (case.stress[0] + case.stress[1]), -0.5 * (case.stress[0] - case.stress[1])
    factor = case.radius * (1 + case.poisson) / case.young
    return factor * (mean + half * (3 - 4 * case.poisson)), factor * (mean - half * (3 - 4 * case.poisson))


def write(case: Case, around: int, folder: Path) -> int:
    """Write hole.blk and hole.nml; returns the number of cells."""
    rings = round(math.log(FAR) / math.log(1 + 2 * math.pi / around))
    radii = [case.radius * FAR ** (i / rings) for i in range(rings + 1)]
    # a corner at the springline and at the crown
    turn = [2 * math.pi * k / around for k in range(around)]
    grid = [[(r * math.cos(t), r * math.sin(t)) for t in turn] for r in radii]
    blocks = [grid[0]]
    for inner, outer in itertools.pairwise(grid):
        for k in range(around):
            n = (k + 1) % around
            blocks.append([inner[k], outer[k], outer[n], inner[n]])
    quarters = [k * around // 4 for k in range(4)]
    text = ["rockdda-blocks 1", f"e0 {1e-3 * case.radius}", f"blocks {len(blocks)}"]
    text += [f"vertices {sum(map(len, blocks))}", "fixed 0", "loading 0", "measured 4", "bolts 0"]
    for number, corners in enumerate(blocks, start=1):
        text += [f"block {number} 1 {len(corners)}", *(f"{x!r} {y!r} 1" for x, y in corners)]
    text += ["fixed_points", "loading_points", "measured_points"]
    text += [f"{grid[0][k][0]!r} {grid[0][k][1]!r} {2 + k}" for k in quarters] + ["bolt_list", "end"]
    (folder / "hole.blk").write_text("\n".join(text) + "\n", encoding="ascii")
    rim = ", ".join(f"{x!r},{y!r}" for x, y in [*grid[-1], grid[-1][0]])
    options = [
        "&model geometry = 'hole.blk' /",
        f"&block_material number = 1, density = 2500, young = {case.young}, poisson = {case.poisson} /",
        "&joint_material number = 1, name = 'intact', friction = 40, tie = .true. /",
        f"&in_situ stress = {case.stress[0]}, {case.stress[1]}, 0 /",
        f"&boundary along = {rim}, kind = 'fixed' /",
        f"&region name = 'hole', circle = 0,0, {case.radius} /",
        "&stage name = 'ground', until = 'equilibrium' /",
    ]
    for i, share in enumerate(case.shares):
        excavate = "excavate = 'hole', " if i == 0 else ""
        options.append(f"&stage name = 'share {share}', until = 'equilibrium', {excavate}relax = {share} /")
    (folder / "hole.nml").write_text("\n".join(options) + "\n", encoding="ascii")
    return len(blocks) - 1


def run(case: Case, around: int) -> Result:
    """Compute a case."""
    program = os.environ.get("ROCKDDA_PROGRAM", str(ROOT / "build/bin/rockdda"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cells = write(case, around, folder)
        command = [program, "run", "hole.nml", "-o", "hole.h5", "--quiet"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=600)
        with h5py.File(folder / "hole.h5") as file:
            stage = file["history/stage"][:]
            ends = [np.flatnonzero(stage == k)[-1] for k in range(1, len(case.shares) + 1)]
            moved = file["history/measured_displacement"][:][ends]
            return Result(
                cells,
                0.5 * (moved[:, 2, 0] - moved[:, 0, 0]),
                0.5 * (moved[:, 3, 1] - moved[:, 1, 1]),
                file["history/unbalanced"][:][ends],
                file["frames/centroid"][0, 1:],
                file["frames/stress"][-1, 1:],
                around,
            )


def wall_stress(case: Case, result: Result, cells: int = CELLS) -> tuple[float, float]:
    """Extended hoop stress at the springline and at the crown [Pa]: mean of both rays beside each."""
    n = result.around
    side = 0.5 * sum(result.at_wall(k, case.radius, cells) for k in (0, n - 1))
    top = 0.5 * sum(result.at_wall(k, case.radius, cells) for k in (n // 4, n // 4 - 1))
    return side, top


def recovery(tunnel: list[Result]) -> str:
    """The stress at the wall by the number of cells that are extended."""
    head = [f"{n} cell{'s' * (n > 1)}" for n in range(1, CELLS + 1)]
    rows = ["| cells | " + " | ".join([f"springline, {h}" for h in head] + [f"crown, {h}" for h in head]) + " |"]
    rows.append("|---" * (2 * CELLS + 1) + "|")
    for r in tunnel:
        pairs = [wall_stress(KIRSCH, r, n) for n in range(1, CELLS + 1)]
        rows.append(f"| {r.cells} | " + " | ".join(f"{-p[i] / 1e6:.2f}" for i in (0, 1) for p in pairs) + " |")
    return "\n".join(rows)


def table(reaction: list[Result], tunnel: list[Result]) -> str:
    """Both tables of the page."""
    rows = ["| cells | " + " | ".join(f"λ = {share:g}" for share in SHARES) + " |", "|---" * (len(SHARES) + 1) + "|"]
    for r in reaction:
        pairs = zip(r.springline, SHARES, strict=True)
        parts = [f"{1e3 * u:.3f} mm ({100 * (u / 6.25e-3 / s - 1):+.1f} %)" for u, s in pairs]
        rows.append(f"| {r.cells} | " + " | ".join(parts) + " |")
    side, top = kirsch_wall(KIRSCH)
    rows += ["", "| cells | springline | crown | stress at the springline | at the crown |", "|---|---|---|---|---|"]
    rows.append(f"| Kirsch | {1e3 * side:.3f} mm | {1e3 * top:.3f} mm | 26 MPa | 2 MPa |")
    for r in tunnel:
        s, c = wall_stress(KIRSCH, r)
        rows.append(
            f"| {r.cells} | {1e3 * r.springline[-1]:.3f} mm ({100 * (r.springline[-1] / side - 1):+.1f} %) "
            f"| {1e3 * r.crown[-1]:.3f} mm ({100 * (r.crown[-1] / top - 1):+.1f} %) "
            f"| {-s / 1e6:.2f} MPa ({100 * (-s / 26e6 - 1):+.1f} %) "
            f"| {-c / 1e6:.2f} MPa ({100 * (-c / 2e6 - 1):+.1f} %) |"
        )
    return "\n".join(rows)


def draw(reaction: list[Result], tunnel: list[Result], path: Path) -> None:
    """Ground reaction, stress along both axes, and how errors fall with the size of the cells."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.5), layout="constrained")
    left.plot([0, 1], [0, 6.25], "k-", label="6.25 mm λ")
    for r, mark in zip(reaction, "os^d", strict=True):
        left.plot(SHARES, 1e3 * r.springline, mark, markerfacecolor="none", label=f"{r.cells} cells")
    left.set(xlabel="released share λ", ylabel="displacement of the wall [mm]", title="Hydrostatic stress")
    left.legend(frameon=False)
    finest = tunnel[-1]
    for k, name, colour in ((0, "springline", "C0"), (finest.around // 4, "crown", "C1")):
        column = range(k, finest.cells, finest.around)
        place = finest.centroid[column]
        radius = np.hypot(*place.T)
        middle.plot(radius, [-finest.hoop(j) / 1e6 for j in column], "o", color=colour, markersize=3.5, label=name)
        angle = math.atan2(place[0, 1], place[0, 0])
        line = np.linspace(2, 12, 200)
        exact = [-kirsch_hoop(KIRSCH, r * math.cos(angle), r * math.sin(angle)) / 1e6 for r in line]
        middle.plot(line, exact, "-", color=colour, linewidth=1)
    middle.set(xlim=(2, 12), xlabel="distance from the axis [m]", ylabel="hoop stress, compression [MPa]")
    middle.set_title(f"k0 = 0.4, {finest.cells} cells; lines: Kirsch")
    middle.legend(frameon=False)
    cells = [r.cells for r in tunnel]
    side, top = kirsch_wall(KIRSCH)
    right.plot(cells, [100 * abs(r.springline[-1] / side - 1) for r in tunnel], "o-", label="springline")
    right.plot(cells, [100 * abs(r.crown[-1] / top - 1) for r in tunnel], "s-", label="crown")
    stress = [100 * abs(-wall_stress(KIRSCH, r)[0] / 26e6 - 1) for r in tunnel]
    right.plot(cells, stress, "d-", label="stress at the springline")
    right.plot([r.cells for r in reaction], [100 * abs(r.springline[-1] / 6.25e-3 - 1) for r in reaction], "^--",
               label="hydrostatic")  # fmt: skip
    right.set(xlabel="cells", ylabel="error [%]", title="Errors", ylim=(0, None))
    right.legend(frameon=False)
    for axes in (left, middle, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Compute all and print or draw."""
    parser = argparse.ArgumentParser(description="Round holes excavated in tied cells, against closed forms.")
    parser.add_argument("--figure", type=Path, help="draw this picture")
    arguments = parser.parse_args()
    reaction = [run(GROUND_REACTION, n) for n in SIZES]
    tunnel = [run(KIRSCH, n) for n in SIZES]
    print(table(reaction, tunnel))
    print(f"\n{recovery(tunnel)}")
    if arguments.figure:
        draw(reaction, tunnel, arguments.figure)


if __name__ == "__main__":
    main()
