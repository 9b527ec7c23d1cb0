#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Waves that meet a viscous boundary at an angle, in two dimensions.

    python benchmarks/oblique_waves.py [--angle 30] [--program build/bin/rockdda]

A beam of waves starts within a rectangle of tied cells of 1 m, by the velocity and the stress of each cell, and runs
down to the base; all four sides are viscous. The Fourier transform of the velocities in space parts what runs up from
what runs down, and waves of compression (along the wave vector) from waves of shear. Printed: amplitudes of both
reflected waves at the angle of the beam over that of the wave that came, and what the closed form says
(`rockdda_validation.cases.dynamics_waves.reflected`). The beam is 8 cells wide (standard deviation): what is scattered
at its edges and at the corners of the rectangle, some hundredths of it, is in the figures.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np
from rockdda_validation.cases.dynamics_waves import reflected

ROOT = Path(__file__).resolve().parents[1]
WIDTH, HEIGHT = 60, 40  # cells
HALF, SPREAD = 10.0, 8.0  # of the pulse along and across its way, m
DENSITY, POISSON, SPEED = 2000.0, 0.25, 100.0  # of the wave that comes, m/s
RATIO = math.sqrt((2 - 2 * POISSON) / (1 - 2 * POISSON))  # c_p/c_s
WAVE_NUMBERS = (0.30, 0.35, 0.40)  # 1/m: 16 to 21 cells in a wave
KINDS = ("compression", "shear")


def pulse(kind: str, angle: float) -> tuple[list[tuple[int, int]], np.ndarray, float]:
    """Cells that move, their rows vx, vy, sx, sy, txy, and Young's modulus."""
    shear = DENSITY * (SPEED / (RATIO if kind == "compression" else 1)) ** 2
    lame = 2 * shear * POISSON / (1 - 2 * POISSON)
    way = np.array([math.sin(angle), -math.cos(angle)])
    across = np.array([way[1], -way[0]])
    motion = way if kind == "compression" else across
    start = np.array([WIDTH / 2 - HEIGHT / 2 * math.tan(angle), HEIGHT / 2])
    cells, rows = [], []
    for i in range(WIDTH):
        for j in range(HEIGHT):
            place = np.array([i + 0.5, j + 0.5]) - start
            along, beside = place @ way, place @ across
            if abs(along) > HALF or abs(beside) > 3.2 * SPREAD:  # an options file holds 999 materials
                continue
            envelope = math.cos(math.pi * along / HALF / 2) ** 2 * math.exp(-((beside / SPREAD) ** 2) / 2)
            speed = 1e-3 * math.cos(2 * math.pi * along / HALF) * envelope
            if abs(speed) < 1e-8:
                continue
            strain = -speed / SPEED / 2 * (np.outer(way, motion) + np.outer(motion, way))
            stress = lame * np.trace(strain) * np.eye(2) + 2 * shear * strain
            cells.append((i, j))
            rows.append([*(speed * motion), stress[0, 0], stress[1, 1], stress[0, 1]])
    return cells, np.array(rows), 2 * shear * (1 + POISSON)


def write_model(folder: Path, kind: str, angle: float) -> None:
    """Each cell that moves has a material of its own."""
    cells, rows, young = pulse(kind, angle)
    sides = [(0, 0, WIDTH, 0), (WIDTH, 0, WIDTH, HEIGHT), (WIDTH, HEIGHT, 0, HEIGHT), (0, HEIGHT, 0, 0)]
    lines = sides + [(i, 0, i, HEIGHT) for i in range(1, WIDTH)] + [(0, j, WIDTH, j) for j in range(1, HEIGHT)]
    text = [f"# oblique wave\n0.001\n{len(lines)} 4\n{len(cells)}\n0\n0\n0\n0\n0"]
    text += ["{} {} {} {} 1".format(*line) for line in lines]
    text += [f"{i + 0.3} {j + 0.5} {i + 0.7} {j + 0.5} {n}" for n, (i, j) in enumerate(cells, 2)]
    (folder / "wave.dc").write_text("\n".join(text) + "\n")
    rock = f"density = {DENSITY}, young = {young!r}, poisson = {POISSON}"
    until = HEIGHT / math.cos(angle) / SPEED
    groups = ["&model geometry = 'wave.dc' /", "&joint_material number = 1, tie = .true. /", "&load gravity = 0 /"]
    groups += [f"&block_material number = 1, {rock} /"]
    for n, (vx, vy, *stress) in enumerate(rows.tolist(), 2):
        known = ", ".join(f"{value:.12g}" for value in stress)
        groups += [f"&block_material number = {n}, {rock}, velocity = {vx:.12g}, {vy:.12g}, 0, stress = {known} /"]
    groups += ["&boundary along = {},{}, {},{}, kind = 'viscous' /".format(*side) for side in sides]
    groups += [f"&time dt_max = {0.25 / SPEED}, displacement_ratio = 0.01 /"]
    groups += [
        f"&stage name = 'wave', kind = 'dynamic', duration = {until!r} /",
        f"&run save_every = {round(until * SPEED * 4 / 8)} /",
    ]
    (folder / "wave.nml").write_text("\n".join(groups) + "\n")


def parted(velocity: np.ndarray, places: np.ndarray, waves: np.ndarray) -> np.ndarray:
    """(n, 2) amplitudes along and across the wave vectors (n, 2)."""
    phase = np.exp(-1j * places @ waves.T)
    along = waves / np.linalg.norm(waves, axis=1)[:, None]
    both = velocity.T @ phase  # (2, n)
    return np.abs(
        np.column_stack([(both * along.T).sum(axis=0), (both * np.stack([-along[:, 1], along[:, 0]])).sum(axis=0)])
    )


def main() -> None:
    """Run both waves and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--angle", type=float, default=30.0, help="from the normal [degrees]")
    parser.add_argument("--program", type=Path, default=ROOT / "build" / "bin" / "rockdda")
    given = parser.parse_args()
    angle = math.radians(given.angle)
    for kind in KINDS:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_model(folder, kind, angle)
            subprocess.run(
                [given.program, "run", folder / "wave.nml", "-o", folder / "out.h5", "--quiet"], check=True,
                capture_output=True,
            )  # fmt: skip
            with h5py.File(folder / "out.h5") as file:
                places, velocity = file["frames/centroid"][0], file["frames/velocity"][:9, :, :2]
        k = np.array(WAVE_NUMBERS)
        level = k * math.sin(angle)
        came = parted(velocity[0], places, np.column_stack([level, -k * math.cos(angle)]))[:, KINDS.index(kind)]
        closed = reflected(kind, given.angle, POISSON)
        for other, expected in zip((kind, KINDS[1 - KINDS.index(kind)]), closed, strict=True):
            number = k if other == kind else k * (RATIO if kind == "compression" else 1 / RATIO)
            up = np.sqrt(number**2 - level**2)
            # of waves of equal frequency: lengths along y, by which the sums grow, go with the speeds along y
            scale = (k * math.cos(angle) / k**2) / (up / number**2)
            for frame in (7, 8):
                found = parted(velocity[frame], places, np.column_stack([level, up]))[:, KINDS.index(other)]
                share = found / came * scale
                print(
                    f"{kind:11} -> {other:11} after {frame}/8 of the way: {share.min():.3f} to {share.max():.3f}, "
                    f"closed form {expected:.3f}"
                )


if __name__ == "__main__":
    main()
