# SPDX-License-Identifier: MIT
"""Direct shear of one joint by each law, drawn against its closed form.

    PYTHONPATH=postprocess python benchmarks/direct_shear.py [--output docs/images/direct_shear.png]

A stiff block, 1 m long, is pushed along a held base by a block that moves as prescribed. Constant normal load: a force
of 1 MN presses it down. Constant normal stiffness: a held roof without friction does, whose contacts act in series with
those of the joint. Prints the largest difference from the closed form, over the largest value of the curve, and ends
with 1 when one is above its bound.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt

mpl.use("Agg")

import matplotlib.pyplot as plt
from rockdda import Model, run

FloatArray = npt.NDArray[np.float64]

STIFFNESS = 1e9  # N/m of each of the two contacts of a face
NORMAL, SHEAR = 2 * STIFFNESS, 2 * STIFFNESS / 2.5  # of the joint
LOAD = 1e6  # N
TRAVEL = 0.02  # m
PRESS, STEPS = 20, 1600  # steps that press, then push
LENGTH, HEIGHT = 1.0, 0.1
BASE, BLOCK = 0, 1  # blocks are numbered from the bottom


@dataclass(frozen=True)
class Law:
    """A law as options have it, and its strength: shear force at normal force N [N] after slip s [m]."""

    title: str
    options: dict[str, Any]
    strength: Callable[[FloatArray, FloatArray], FloatArray]
    friction: float = 35.0
    cohesion: float = 0.0
    dilation: Callable[[FloatArray], FloatArray] = field(default=lambda s: 0 * s)


def tangent(degrees: float | FloatArray) -> Any:
    return np.tan(np.radians(degrees))


def weakening(s: FloatArray, peak: float, rest: float, length: float) -> FloatArray:
    return peak - (peak - rest) * np.minimum(s / length, 1)


def barton_bandis(n: FloatArray, jrc: float, jcs: float, base: float) -> FloatArray:
    angle = base + jrc * np.maximum(np.log10(jcs * LENGTH / np.maximum(n, 1.0)), 0)
    return n * tangent(np.minimum(angle, 70.0))


LAWS = (
    Law(
        "cohesion, brittle",
        {"law": "coulomb"},
        lambda n, s: n * tangent(35) + np.where(s > 0, 0, 5e5),
        cohesion=5e5,
    ),
    Law(
        "cohesion that does not break",
        {"law": "coulomb", "brittle": False},
        lambda n, s: n * tangent(35) + 5e5 + 0 * s,
        cohesion=5e5,
    ),
    Law(
        "residual",
        {"law": "residual", "residual_friction": 25, "residual_cohesion": 1e5, "slip_length": 0.01},
        lambda n, s: n * weakening(s, tangent(35), tangent(25), 0.01) + weakening(s, 5e5, 1e5, 0.01),
        cohesion=5e5,
    ),
    Law(
        "barton_bandis",
        {"law": "barton_bandis", "jrc": 10, "jcs": 100e6, "residual_friction": 30},
        lambda n, s: barton_bandis(n, 10, 100e6, 30) + 0 * s,
    ),
    Law(
        "dilation 6° to 10 mm",
        {"dilation": 6, "dilation_slip": 0.01},
        lambda n, s: n * tangent(35) + 0 * s,
        dilation=lambda s: tangent(6) * np.minimum(s, 0.01),
    ),
)


def shear_box(law: Law, stiff: bool) -> Model:
    """The block, the base, the pushing block, and with `stiff` the roof."""
    model = Model(
        "shear", e0=0.001, dt_max=1.0, stiffness=STIFFNESS, displacement_ratio=0.01, steps=PRESS + STEPS, k01=0.0
    )
    end = float(PRESS + STEPS)
    down = LOAD * (1 / NORMAL + 1 / NORMAL)
    push = [(0, 0, 0), (PRESS, 0, 0), (end, TRAVEL, 0)]
    press = [(0, 0, 0), (PRESS / 2, 0, -down), (end, 0, -down)]
    model.add_polygon([(-0.5, -0.3), (1.6, -0.3), (1.6, 0), (-0.5, 0)], joint=1)
    model.add_line((0, 0), (LENGTH, 0), joint=1, boundary=True)
    outline = [(LENGTH, 0), (LENGTH, HEIGHT), (0, HEIGHT), (0, 0)]
    for start, stop in itertools.pairwise(outline):
        model.add_line(start, stop, joint=2, boundary=True)
    model.add_polygon([(-0.3, 0.01), (0, 0.01), (0, 0.04), (-0.3, 0.04)], joint=2)
    for x in (-0.4, 1.5):
        model.add_fixed((x, -0.2))
    for x in (-0.25, -0.05):
        model.add_fixed((x, 0.025), table=push)
    if stiff:
        model.add_polygon([(-0.5, HEIGHT), (1.6, HEIGHT), (1.6, 0.4), (-0.5, 0.4)], joint=2)
        for x in (-0.4, 1.5):
            model.add_fixed((x, 0.3), table=press)
    else:
        model.add_loading((LENGTH / 2, HEIGHT / 2), table=[(0, 0, 0), (PRESS / 2, 0, -LOAD), (end, 0, -LOAD)])
    model.add_measured((LENGTH / 2, HEIGHT / 2))
    model.add_material_line((0.4, -0.1), (0.6, 0.35), material=1)
    model.add_block_material(density=2500.0, gravity=0.0, youngs_modulus=1e14, poisson_ratio=0.0)
    model.add_joint_material(friction_angle=law.friction, cohesion=law.cohesion)
    model.add_joint_material(friction_angle=0.0)
    model.options["joint_material"] = [{"number": 1, **law.options}]
    model.options["run"] = {"save_every": 4}
    # the bodies are held a million times stiffer than the joint
    model.options["contact"] = {"formulation": "vertex", "fixed_stiffness_factor": 1e6}
    return model


def measure(model: Model) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Shear displacement and rise of the block [m], and normal and shear force of the joint [N] in each frame."""
    with tempfile.TemporaryDirectory() as folder:
        results = run(model, output=Path(folder) / "shear.h5")
        rows = []
        for frame in list(results.frames)[1:]:
            blocks = np.sort(frame.contacts.blocks, axis=1)
            on_joint = (blocks[:, 0] == BASE) & (blocks[:, 1] == BLOCK)
            first = frame.contacts.blocks[on_joint, 0] == BLOCK
            force = np.where(first[:, None], 1, -1) * frame.contacts.force[on_joint]
            moved = results["history/measured_displacement"][frame.step - 1, 0]
            rows.append([*moved, force[:, 1].sum(), -force[:, 0].sum()])
        results.close()
    u, rise, n, t = np.array(rows).T
    return u, rise, n, t


def closed_form(law: Law, stiff: bool, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rise, normal and shear force at shear displacements: elastic up to the peak, then on the strength."""
    system = NORMAL / 2 if stiff else 0.0
    load = np.full_like(u, LOAD)
    peak = law.strength(load, 0 * u)[0] / SHEAR
    slip = np.maximum(u - peak, 0.0)
    opened = law.dilation(slip)
    normal = load + system * opened
    rise = opened - normal / NORMAL
    shear = np.where(u <= peak, SHEAR * u, law.strength(normal, slip))
    return rise, normal, shear


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", default="docs/images/direct_shear.png", type=Path)
    arguments = parser.parse_args()
    figure, axes = plt.subplots(2, 3, figsize=(12, 6.5), sharex=True, constrained_layout=True)
    colours = ["#1b6ca8", "#d1495b", "#2f8f4e", "#8d5a97", "#c8811a"]
    worst = 0.0
    for i, stiff in enumerate((False, True)):
        for law, colour in zip(LAWS, colours, strict=True):
            u, rise, n, t = measure(shear_box(law, stiff))
            keep = u > 1e-9
            exact = closed_form(law, stiff, np.linspace(0, u.max(), 801))
            there = closed_form(law, stiff, u[keep])
            fine = np.linspace(0, u.max(), 801)
            for k, (found, line, at) in enumerate(
                zip(
                    (t, n, rise + LOAD / NORMAL),
                    (exact[2], exact[1], exact[0] + LOAD / NORMAL),
                    (there[2], there[1], there[0] + LOAD / NORMAL),
                    strict=True,
                )
            ):
                scale = (1e-6, 1e-6, 1e3)[k]
                axes[i, k].plot(1e3 * fine, scale * line, color=colour, lw=1.2)
                axes[i, k].plot(
                    1e3 * u[keep][::12],
                    scale * found[keep][::12],
                    "o",
                    color=colour,
                    ms=3.5,
                    mfc="none",
                    label=law.title,
                )
                # the corner of a curve that jumps lies between two steps
                error = np.abs(found[keep] - at)
                jump = law.strength(n[keep], 0 * n[keep])[0] / SHEAR
                error = error[np.abs(u[keep] - jump) > 3 * 4 * TRAVEL / STEPS]
                size = max(np.abs(at).max(), 1e-4 if k == 2 else 0.0)
                worst = max(worst, error.max() / size)
                what = ("shear force", "normal force", "rise")[k]
                print(f"{'stiffness' if stiff else 'load':9s}  {law.title:30s} {what:13s} {error.max() / size:.1e}")
    names = ("constant normal load", "constant normal stiffness")
    for i, k in np.ndindex(2, 3):
        axes[i, k].grid(alpha=0.3)
        axes[i, k].set_ylabel(("shear force [MN]", "normal force [MN]", "opening by dilation [mm]")[k])
        if k == 0:
            axes[i, k].set_title(names[i], loc="left")
        if i == 1:
            axes[i, k].set_xlabel("shear displacement [mm]")
    axes[0, 1].set_ylim(0.9, 1.1)
    axes[0, 1].legend(fontsize=8, loc="upper right")
    figure.savefig(arguments.output, dpi=110)
    return int(not (worst < 0.01 and math.isfinite(worst)))


if __name__ == "__main__":
    raise SystemExit(main())
