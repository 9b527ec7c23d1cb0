#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the figure of docs/theory.md on time integration: scripts/draw_time_schemes.py [FOLDER] (docs/images).

The program runs a block on two bonded contacts, a mass on a spring, with both schemes and many steps; amplitude and
period are measured in its results and drawn over the steps of a period, with the curves of theory.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import matplotlib as mpl

mpl.use("svg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "postprocess"))
from rockdda_validation.integrator import fit_recurrence  # noqa: E402

PROGRAM = os.environ.get("ROCKDDA_PROGRAM", str(ROOT / "build" / "bin" / "rockdda"))
STIFFNESS, DENSITY = 1e6, 1000.0
OMEGA = np.sqrt(STIFFNESS / DENSITY)  # two contacts, 2 x 1 m of rock
GEOMETRY = """0.001
7 4
1
0
2
0
1
0
-1 -1 3 -1 1
3 -1 3 0 1
3 0 -1 0 1
-1 0 -1 -1 1
0 0 0 1 1
0 1 2 1 1
2 1 2 0 1
1 0.5 1 0.5 2
0 -0.5 0 -0.5
2 -0.5 2 -0.5
1 0.5
"""
MODEL = """&model geometry = 'block.dc' /
&block_material number = 1, density = 1000, young = 1e16, poisson = 0.25 /
&block_material number = 2, density = 1000, young = 1e16, poisson = 0.25, velocity = 0,-0.03,0 /
&joint_material number = 1, friction = 45, cohesion = 1e9, tension = 1e9 /
&load gravity = 0 /
&contact formulation = 'vertex', stiffness = 1e6, fixed_stiffness_factor = 1e8 /
&time dt_max = {dt!r}, integrator = '{scheme}', rho_infinity = {rho}, displacement_ratio = 0.5 /
&run steps = {steps}, save_every = 100000 /
"""
mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "rockdda", "font.size": 9, "font.family": "sans-serif"})


def motion(folder: Path, scheme: str, rho: float, dt: float, steps: int) -> np.ndarray:
    """Displacements of the block, from the start on."""
    (folder / "block.dc").write_text(GEOMETRY)
    (folder / "block.nml").write_text(MODEL.format(dt=float(dt), scheme=scheme, rho=rho, steps=steps))
    subprocess.run(
        [PROGRAM, "run", "block.nml", "--force", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL
    )
    with h5py.File(folder / "block.h5") as file:
        return np.concatenate([[0.0], file["history/measured_displacement"][:, 0, 1]])


def measure(scheme: str, rho: float, per_period: float) -> tuple[float, float]:
    """Amplitude that is left after a period, and relative error of the period."""
    dt = 2 * np.pi / OMEGA / per_period
    steps = int(max(60, 4 * per_period))
    with tempfile.TemporaryDirectory() as folder:
        x = motion(Path(folder), scheme, rho, dt, steps)
    root, _ = fit_recurrence(x[len(x) // 4 :])
    phase = abs(np.angle(root))
    return abs(root) ** (2 * np.pi / phase), OMEGA * dt / phase - 1


def theory(scheme: str, rho: float, per_period: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same by the roots of the recurrence."""
    if scheme == "shi":
        level, alpha_m, beta, gamma = 1.0, 0.0, 0.5, 1.0
    else:
        level, alpha_m = 1 / (1 + rho), (2 * rho - 1) / (1 + rho)
        gamma, beta = 1.5 - alpha_m - level, (2 - alpha_m - level) ** 2 / 4
    amplitude, error = [], []
    for w in 2 * np.pi / per_period:
        c = (1 - alpha_m) / beta
        solve = 1 / (c + level * w * w)
        d = solve * np.array([-w * w, c, c / 2 - 1])
        new = (d - np.array([0, 1, 0.5 - beta])) / beta
        step = np.array([np.array([1, 0, 0]) + d, np.array([0, 1, 1 - gamma]) + gamma * new, new])
        roots = np.linalg.eigvals(step)
        root = max((r for r in roots if r.imag > 0), key=abs)
        amplitude.append(abs(root) ** (2 * np.pi / np.angle(root)))
        error.append(w / np.angle(root) - 1)
    return np.array(amplitude), np.array(error)


def main(folder: Path) -> None:
    schemes = (("shi", 0.8, "Shi", "#D55E00"), ("generalized_alpha", 0.8, "generalised α, ρ∞ = 0.8", "#0072B2"),
               ("generalized_alpha", 0.5, "generalised α, ρ∞ = 0.5", "#009E73"))  # fmt: skip
    points = np.array([6.0, 8, 10, 14, 20, 30, 50, 100, 200])
    line = np.geomspace(5, 250, 80)
    figure, axes = plt.subplots(1, 2, figsize=(7.4, 3.1), layout="constrained")
    for scheme, rho, label, colour in schemes:
        measured = np.array([measure(scheme, rho, n) for n in points])
        for n, (amplitude, error) in zip(points, measured, strict=True):
            print(f"{label}: {n:5.0f} steps a period, amplitude {amplitude:.5f}, period {100 * error:+.3f} %")
        curves = theory(scheme, rho, line)
        axes[0].plot(1 / line, 1 - curves[0], color=colour, linewidth=1)
        axes[0].plot(1 / points, 1 - measured[:, 0], "o", color=colour, markersize=4, label=label)
        axes[1].plot(1 / line, curves[1], color=colour, linewidth=1)
        axes[1].plot(1 / points, measured[:, 1], "o", color=colour, markersize=4)
    for axis, title in zip(axes, ("loss of amplitude in a period", "error of the period"), strict=True):
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_title(title, loc="left", fontsize=9)
        axis.set_xlabel("Δt / T")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylim(1e-7, 1)
    axes[1].set_ylim(1e-5, 1)
    axes[0].legend(frameon=False, fontsize=8)
    figure.savefig(folder / "time_schemes.svg", metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images")
