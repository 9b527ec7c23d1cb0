#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The tunnel of T8 in rock with three sets of joints, against the closed form of the equivalent continuum.

    python3 benchmarks/jointed_hole.py [--figure PICTURE]

Three sets of joints at 60 degrees to each other, of equal spacing s and stiffness kn, ks, make rock softer in all
directions alike: to the compliances of the rock (plane strain) they add 3/(2 s kn) for the mean stress and
3/(4 s) (1/kn + 1/ks) for the deviator. Kirsch's problem with these moduli, in a ring whose rim is fixed, is the truth
for joints that neither slip nor open. With friction alone joints around the hole do both. The program is that of
ROCKDDA_PROGRAM, else of the build tree.
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
Floats = npt.NDArray[np.float64]
RADIUS, RIM = 2.0, 12.0  # of the hole and of the model [m]
MEASURED = 2.06  # radius of the measured points: behind the splinters that lie on the wall
YOUNG, POISSON = 12e9, 0.3
STRESS = (-4e6, -10e6)  # horizontal, vertical
STIFFNESS = (20e9, 8e9)  # of a joint, normal and shear [Pa/m]
SPACINGS = (1.0, 0.5)
JOINTS = {
    "joints that hold": "friction = 35, cohesion = 1e9, tension = 1e9",
    "friction 35 deg": "friction = 35",
}


@dataclass(frozen=True)
class Result:
    """What came out of a run."""

    blocks: int
    steps: int
    share: Floats  # (n,) released
    way: Floats  # (n, 2) inward displacement of springline and crown
    outlines: list[Floats]  # of the blocks at the end, without the hole
    slipping: Floats  # (m, 2) points of contacts that slide at the end


def compliances(spacing: float | None) -> tuple[float, float]:
    """1/(2 G) and the strain of all directions by a unit mean stress, of rock with joints; None: without."""
    deviator = (1 + POISSON) / YOUNG
    mean = deviator * (1 - 2 * POISSON)
    if spacing is not None:
        deviator += 0.75 / spacing * (1 / STIFFNESS[0] + 1 / STIFFNESS[1])
        mean += 1.5 / (spacing * STIFFNESS[0])
    return deviator, mean


def closed_form(spacing: float | None) -> tuple[float, float]:
    """Inward displacement of springline and crown by the excavation, rim fixed.

    The stress at the wall is released, u = 0 at the rim: of the mean stress two terms, of the deviator the four terms
    of the second harmonic (Michell).
    """
    deviator, mean = compliances(spacing)
    g = 0.5 / deviator
    kappa = 1 + 4 * g * mean
    p = -0.5 * (STRESS[0] + STRESS[1])
    q = -0.5 * (STRESS[0] - STRESS[1])  # stress -p - q cos 2t radially
    # mean: 2 G u = (kappa - 1)/2 * A r - B/r, sigma_r = A + B/r^2
    matrix = np.array([[1.0, RADIUS**-2], [0.5 * (kappa - 1) * RIM, -1 / RIM]])
    a, b = np.linalg.solve(matrix, [p, 0.0])
    u0 = (0.5 * (kappa - 1) * a * MEASURED - b / MEASURED) / (2 * g)
    # second harmonic, phi = (a r^2 + b r^4 + c/r^2 + d) cos 2t
    r = RADIUS

    def stress(x: float) -> Floats:
        radial = [-2, 0, -6 / x**4, -4 / x**2]
        shear = [2, 6 * x**2, -6 / x**4, -2 / x**2]
        return np.array([radial, shear])

    def moved(x: float) -> Floats:
        radial = [-2 * x, (kappa - 3) * x**3, 2 / x**3, (kappa + 1) / x]
        hoop = [2 * x, (kappa + 3) * x**3, 2 / x**3, -(kappa - 1) / x]
        return np.array([radial, hoop]) / (2 * g)

    # released: the traction sigma_r = -(p + q cos 2t), tau = q sin 2t of the ground goes
    terms = np.linalg.solve(np.vstack([stress(r), moved(RIM)]), [q, -q, 0.0, 0.0])
    u2 = float(moved(MEASURED)[0] @ terms)
    return -(u0 + u2), -(u0 - u2)


def lines(spacing: float) -> list[tuple[float, float, float, float]]:
    """Traces of the three sets between hole and rim."""
    found = []
    for angle in (0.0, math.pi / 3, 2 * math.pi / 3):
        along = np.array([math.cos(angle), math.sin(angle)])
        normal = np.array([-along[1], along[0]])
        for k in range(-int(RIM / spacing) - 1, int(RIM / spacing) + 2):
            off = (k + 0.5) * spacing
            if abs(off) >= RIM:
                continue
            far = math.sqrt(RIM**2 - off**2) + 0.1
            near = math.sqrt(RADIUS**2 - off**2) if abs(off) < RADIUS else 0.0
            pieces = [(-far, -near), (near, far)] if near else [(-far, far)]
            for s, e in pieces:
                p, q = off * normal + s * along, off * normal + e * along
                found.append((*map(float, p), *map(float, q)))
    return found


def circle(radius: float, sides: int) -> list[tuple[float, float, float, float]]:
    corners = [(radius * math.cos(2 * math.pi * k / sides), radius * math.sin(2 * math.pi * k / sides))
               for k in range(sides + 1)]  # fmt: skip
    return [(*p, *q) for p, q in itertools.pairwise(corners)]


def write(spacing: float, joint: str, folder: Path) -> None:
    rim, hole = circle(RIM, 96), circle(RADIUS, 48)
    traces = lines(spacing)
    points = [(MEASURED, 0), (0, MEASURED), (-MEASURED, 0), (0, -MEASURED)]
    rows = [f"{0.02 * spacing}", f"{len(rim) + len(hole) + len(traces)} {len(rim)}", *"000", "0", f"{len(points)}", "0"]
    rows += [" ".join(f"{v:.12g}" for v in line) + " 1" for line in (*rim, *hole, *traces)]
    rows += [f"{x} {y}" for x, y in points]
    (folder / "hole.dc").write_text("\n".join(rows) + "\n", encoding="ascii")
    edge = ", ".join(f"{line[0]:.12g},{line[1]:.12g}" for line in [*rim, rim[0]])
    options = [
        "&model geometry = 'hole.dc' /",
        f"&block_material number = 1, density = 2500, young = {YOUNG}, poisson = {POISSON} /",
        f"&joint_material number = 1, {joint}, normal_stiffness = {STIFFNESS[0]}, shear_stiffness = {STIFFNESS[1]} /",
        f"&in_situ stress = {STRESS[0]}, {STRESS[1]}, 0 /",
        f"&boundary along = {edge}, kind = 'fixed' /",
        f"&region name = 'hole', circle = 0,0, {RADIUS} /",
        "&stage name = 'ground', until = 'equilibrium', tolerance = 1e-4, reset_displacement = .true. /",
        "&stage name = 'hole', until = 'equilibrium', excavate = 'hole', reset_displacement = .true. /",
    ]
    (folder / "hole.nml").write_text("\n".join(options) + "\n", encoding="ascii")


def run(spacing: float, joint: str) -> Result:
    program = os.environ.get("ROCKDDA_PROGRAM", str(ROOT / "build/bin/rockdda"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(spacing, joint, folder)
        command = [program, "run", "hole.nml", "-o", "hole.h5", "--quiet"]
        done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True, timeout=3000)
        if done.returncode:
            raise SystemExit(done.stderr)
        with h5py.File(folder / "hole.h5") as file:
            stage = file["history/stage"][()]
            moved = file["history/measured_displacement"][()][stage == 1]
            inwards = 0.5 * np.c_[moved[:, 2, 0] - moved[:, 0, 0], moved[:, 3, 1] - moved[:, 1, 1]]
            offset = file["model/vertex_offset"][()]
            corners = file["frames/vertices"][-1]
            there = np.flatnonzero(file["frames/active"][-1])
            last = slice(*file["frames/contact_offset"][-2:])
            slides = file["frames/contact_point"][last][file["frames/contact_state"][last] == 1]
            return Result(
                len(offset) - 2,
                int((stage == 1).sum()),
                np.concatenate([[0.0], file["history/relaxation"][()][stage == 1]]),
                np.concatenate([np.zeros((1, 2)), inwards]),
                [corners[offset[i] : offset[i + 1]] for i in there],
                slides,
            )


def table(results: dict[tuple[float, str], Result]) -> str:
    side, top = closed_form(None)
    rows = ["| rock | blocks | steps | springline | crown |", "|---|---|---|---|---|"]
    rows.append(f"| without joints, closed form | | | {1e3 * side:.3f} mm | {1e3 * top:.3f} mm |")
    for spacing in SPACINGS:
        side, top = closed_form(spacing)
        rows.append(f"| joints every {spacing} m, closed form | | | {1e3 * side:.3f} mm | {1e3 * top:.3f} mm |")
        for name in JOINTS:
            r = results[spacing, name]
            parts = [
                f"{1e3 * u:.3f} mm ({100 * (u / v - 1):+.1f} %)" for u, v in zip(r.way[-1], (side, top), strict=True)
            ]
            rows.append(f"| {name} | {r.blocks} | {r.steps} | {parts[0]} | {parts[1]} |")
    return "\n".join(rows)


def draw(results: dict[tuple[float, str], Result], path: Path) -> None:
    """Closure by released share, and where joints slide around the hole."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    fine = SPACINGS[-1]
    for spacing, dashes, name in ((None, ":", "no joints, closed form"), (fine, "--", "joints that hold, closed form")):
        top = closed_form(spacing)[1]
        left.plot([0, 1e3 * top], [0, 1], dashes, color="k", label=name)
    for (name, colour), mark in zip((("joints that hold", "C0"), ("friction 35 deg", "C3")), "os", strict=True):
        r = results[fine, name]
        left.plot(1e3 * r.way[:, 1], r.share, mark + "-", color=colour, markerfacecolor="none", label=name)
    left.set(xlabel="crown, inwards [mm]", ylabel="released share", xlim=(0, None), ylim=(0, 1.05))
    left.set_title(f"Ground reaction, joints every {fine} m")
    left.legend(frameon=False, loc="lower right")
    r = results[fine, "friction 35 deg"]
    right.add_collection(PolyCollection(r.outlines, facecolor="0.93", edgecolor="0.55", linewidth=0.4))
    right.plot(*r.slipping.T, ".", color="C3", markersize=3)
    right.set(xlim=(-5, 5), ylim=(-5, 5), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    right.set_title("Joints that slide (friction 35 deg)")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=90)


def main() -> None:
    parser = argparse.ArgumentParser(description="A round tunnel in rock with three sets of joints.")
    parser.add_argument("--figure", type=Path, help="draw this picture")
    arguments = parser.parse_args()
    results = {(spacing, name): run(spacing, joint) for spacing in SPACINGS for name, joint in JOINTS.items()}
    print(table(results))
    if arguments.figure:
        draw(results, arguments.figure)


if __name__ == "__main__":
    main()
