# SPDX-License-Identifier: MIT
"""The roof of the water reservoir at Tel Beer-Sheva (thesis, 6.6.2): what its cases share."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .case import Record, published
from .roofs import GRAVITY, Roof, Verdict, follow, judge

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results import Results

__all__ = ["BASE", "EARLY", "FREE_FALL", "NUMBERS", "TIGHT", "UNTIL", "VARIANTS", "draw", "judged", "sag", "slug"]

FloatArray = npt.NDArray[np.float64]
PUBLISHED = published("chapter6")
ROCK, NUMERICS, SINGLE = PUBLISHED["rock"], PUBLISHED["numerics"], PUBLISHED["single"]
EARLY = SINGLE["time"]  #: after which the thesis gives deflections [s]
FREE_FALL = 0.5 * GRAVITY * EARLY**2
UNTIL = 2.0  #: of runs that are judged [s]
TIGHT = -10e3  #: horizontal stress of blocks that touch [Pa]
#: Table 6.5, S_j = 0.25 m, no stress at the start
BASE = Roof(
    SINGLE["span"],
    SINGLE["thickness"],
    32,
    friction_angle=ROCK["friction_angle"],
    density=ROCK["density"],
    youngs_modulus=ROCK["youngs_modulus"],
    poisson_ratio=ROCK["poisson_ratio"],
    stiffness=NUMERICS["stiffness"],
    dt=NUMERICS["dt"],
    displacement_ratio=NUMERICS["displacement_ratio"],
    k01=NUMERICS["k01"],
)
VARIANTS = {
    "no thrust": replace(BASE, heavy_abutments=False),
    "as described": BASE,
    "as described, Shi's rules": replace(BASE, preset="peer"),
    "10 kPa": replace(BASE, stress=TIGHT),
}
#: two time steps and two contact stiffnesses, the quickest first
NUMBERS = tuple((dt, g0) for dt in (BASE.dt, BASE.dt / 2) for g0 in (BASE.stiffness, 5 * BASE.stiffness))
#: beside the middle, so that the point lies in one block
MIDDLE = 0.02


def slug(name: str) -> str:
    """A variant's name in file names."""
    return name.replace("'", "").replace(",", "").replace(" ", "-")


def sag(results: Results, point: int = 0) -> tuple[FloatArray, FloatArray]:
    """Times, and deflections of a measured point, downwards."""
    return results["history/time"], -results["history/measured_displacement"][:, point, 1]


def judged(record: Record, roof: Roof, dt: float, stiffness: float) -> Verdict:
    """Verdict on mid-span of the lowest layer after two seconds."""
    model = replace(roof, dt=dt, stiffness=stiffness).model([(MIDDLE, 0.0)], save_every=10**6)
    numbers = f"{roof.friction_angle:g}-{-roof.stress / 1e3:g}-{1e3 * dt:g}-{stiffness / 1e9:g}"
    name = f"judged-{roof.blocks}x{roof.layers}-{numbers}{'-' * bool(roof.preset)}{roof.preset}"
    results = follow(record, model, name, UNTIL, sunk=roof.thickness)
    return judge(*sag(results), roof.thickness, UNTIL)


def draw(axes: Axes, results: Results, scale: float = 1.0) -> None:
    """The blocks at the end."""
    from matplotlib.collections import PolyCollection

    vertices = results.vertices + scale * results.frames[-1].vertex_displacement
    polygons = np.split(vertices, results.vertex_offset[1:-1])
    colours = ["0.8" if material == 2 else "#56B4E9" for material in results.block_material]
    axes.add_collection(PolyCollection(polygons, facecolors=colours, edgecolors="black", linewidths=0.4))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axes.set(xlim=(low[0] - 0.1, high[0] + 0.1), ylim=(low[1] - 0.1, high[1] + 0.1), aspect="equal")
    axes.axis("off")
