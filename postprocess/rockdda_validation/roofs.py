# SPDX-License-Identifier: MIT
"""Roofs of jointed layers between two rigid abutments, and when such a roof counts as stable."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from rockdda.errors import ConvergenceError, InputError
from rockdda.model import Model
from rockdda.results import Results
from rockdda.simulation import Simulation

if TYPE_CHECKING:
    from pathlib import Path

    from .case import Record

__all__ = [
    "Roof",
    "Verdict",
    "bisect",
    "compare_falls",
    "deepest_fall",
    "follow",
    "follow_files",
    "joint_positions",
    "judge",
    "mean_fall",
]

FloatArray = npt.NDArray[np.float64]
#: lengths of the abutment blocks beyond the opening: outwards, and above and below the layers
ABUTMENT = 1.0
OVERHANG = 0.5
GRAVITY = 9.81


@dataclass(frozen=True)
class Roof:
    """Layers of blocks over an opening; the lower side of the lowest layer is at y = 0, mid-span at x = 0.

    The abutments are two blocks with three fixed points each. The first, third, … layer has `blocks` blocks of the
    same width; the second, fourth, … has its joints over the middle of these (running bond), with half blocks at the
    abutments: one block more.
    """

    span: float  #: [m]
    thickness: float  #: of a layer [m]
    blocks: int  #: in the lowest layer
    layers: int = 1
    friction_angle: float = 45.0  #: of all joints [deg]
    density: float = 1900.0  #: [kg/m3]
    youngs_modulus: float = 7.84e9  #: [Pa]
    poisson_ratio: float = 0.17
    stress: float = 0.0  #: horizontal stress of the layers at the start, tension positive [Pa]
    stiffness: float = 1e9  #: of contacts, g0 [N/m]
    dt: float = 0.00025  #: g1 [s]
    displacement_ratio: float = 0.00025  #: g2
    origin: tuple[float, float] = (
        0.0,
        0.0,
    )  #: of the coordinates: shifts the model, which changes nothing but round-off
    bond: bool = True  #: False: joints go through all layers
    heavy_abutments: bool = True  #: False: without weight, so that nothing moves them
    preset: str = ""  #: 'peer': closing rule of Shi's programs
    k01: float = 1.0
    top: int = 0  #: blocks of the same width in the uppermost layer, if it is no part of the bond

    @property
    def height(self) -> float:
        return self.layers * self.thickness

    @property
    def spacing(self) -> float:
        """Of the joints in the lowest layer."""
        return self.span / self.blocks

    def joints(self, layer: int) -> FloatArray:
        """x of the vertical joints of a layer (from 0)."""
        if self.top and layer == self.layers - 1:
            return joint_positions(self.span, self.top, False)
        return joint_positions(self.span, self.blocks, self.bond and layer % 2 == 1)

    def model(self, points: Sequence[tuple[float, float]], name: str = "roof", **run: Any) -> Model:
        """The model, with measured points; `run`: options of the group `run`."""
        ox, oy = self.origin
        model = Model(name, e0=0.001, k01=self.k01, steps=10**8, displacement_ratio=self.displacement_ratio)
        model.dt_max, model.stiffness = self.dt, self.stiffness
        side, outer = self.span / 2, self.span / 2 + ABUTMENT
        low, high = oy - OVERHANG, oy + self.height + OVERHANG
        for sign in (-1, 1):
            inner, back, middle = ox + sign * side, ox + sign * outer, oy + self.height / 2
            model.add_polygon([(inner, low), (back, low), (back, high), (inner, high)])
            for point in ((inner, low), (inner, high), (back, middle)):
                model.add_fixed(point)
            model.add_material_line((inner + 0.4 * (back - inner), middle), (back, middle), material=2)
        for layer in range(self.layers + 1):
            y = oy + layer * self.thickness
            model.add_line((ox - side, y), (ox + side, y))
            for x in self.joints(layer) if layer < self.layers else ():
                model.add_line((ox + x, y), (ox + x, y + self.thickness))
        for stress, gravity in ((self.stress, GRAVITY), (0.0, GRAVITY if self.heavy_abutments else 0.0)):
            model.add_block_material(
                density=self.density,
                gravity=gravity,
                youngs_modulus=self.youngs_modulus,
                poisson_ratio=self.poisson_ratio,
                stress=(stress, 0.0, 0.0),
            )
        model.add_joint_material(friction_angle=self.friction_angle)
        for x, y in points:
            model.add_measured((ox + x, oy + y))
        model.options["run"] = dict(run)
        if self.preset:
            model.options["contact"] = {"preset": self.preset}
        return model


def joint_positions(span: float, blocks: int, half: bool) -> FloatArray:
    """x of the joints between `blocks` blocks of the same width; `half`: over the middle of these."""
    width = span / blocks
    if half:
        return np.asarray((np.arange(blocks) + 0.5) * width - span / 2, dtype=np.float64)
    return np.asarray(np.arange(1, blocks) * width - span / 2, dtype=np.float64)


def follow(record: Record, model: Model, name: str, until: float, sunk: float = math.inf) -> Results:
    """Run to a time, or until some vertex has sunk too far, or until no step converges: whichever is first."""
    folder = record.folder / name
    folder.mkdir(parents=True, exist_ok=True)
    model.options.setdefault("run", {})["t_end"] = until
    record.choose_formulation(model)
    model.write(folder, force=True)
    return follow_files(record, folder, name, sunk)


def follow_files(record: Record, folder: Path, name: str, sunk: float = math.inf) -> Results:
    """The same for a model in files, to the end that these give."""
    started = clock.monotonic()
    simulation = Simulation(folder, output=folder / f"{name}.h5", force=True, threads=1)
    try:
        while simulation.advance(100) and simulation.displacement[:, 1].min() > -sunk:
            pass
    except ConvergenceError:
        pass  # the results hold all steps before
    finally:
        simulation.close()
    record.runs += 1
    record.run_seconds += clock.monotonic() - started
    results = simulation.results()
    record.note(results)
    return results


@dataclass(frozen=True)
class Verdict:
    """Of a run of at least two seconds: is the roof stable, and why."""

    stable: bool
    reason: str
    deflection: float  #: largest of the last fifth
    drift: float  #: of the deflection in the last fifth, by its straight line
    swing: float  #: of the deflection in the last fifth, from smallest to largest


def judge(time: npt.ArrayLike, deflection: npt.ArrayLike, thickness: float, until: float) -> Verdict:
    """Is a roof stable, by its mid-span deflection (downwards) in the last fifth of a run?

    It is when the run came to its end, and in its last fifth the deflection stays below t/2 and has no trend, nor has
    its velocity. A trend is what a straight line through the values gains in that time: more than half of the swing
    of the values, and more than 1 % of t (over that time, for the velocity). A roof that bounces about its equilibrium
    has a large swing and a small gain; one that creeps or falls gains what it swings.
    """
    times, values = np.asarray(time, dtype=float), np.asarray(deflection, dtype=float)
    deepest = float(values.max(initial=0.0))
    if times[-1] < until * (1 - 1e-9):
        return Verdict(False, f"gone after {times[-1]:.2f} s", deepest, math.nan, math.nan)
    late = times >= 0.8 * until
    # equal steps, so that cut steps weigh no more than others
    grid = np.linspace(0.8 * until, until, 401)
    sag = np.interp(grid, times, values)
    velocity = np.gradient(sag, grid)
    length = grid[-1] - grid[0]
    drift = float(np.polyfit(grid, sag, 1)[0] * length)
    gain = float(np.polyfit(grid, velocity, 1)[0] * length)
    deepest, swing = float(values[late].max()), float(np.ptp(sag))
    if deepest >= thickness / 2:
        return Verdict(False, "more than t/2", deepest, drift, swing)
    if abs(drift) > max(0.01 * thickness, swing / 2):
        return Verdict(False, "still sinking" if drift > 0 else "still rising", deepest, drift, swing)
    if abs(gain) > max(0.01 * thickness / length, float(np.ptp(velocity)) / 2):
        return Verdict(False, "velocity has a trend", deepest, drift, swing)
    return Verdict(True, "stable", deepest, drift, swing)


def bisect(stable: Callable[[float], bool], low: float, high: float, width: float) -> tuple[float, float]:
    """Largest value known to be unstable and smallest known to be stable, `width` apart at most.

    `low` is unstable, `high` stable: the caller has looked.
    """
    if not low < high or width <= 0:
        raise InputError(f"bisection: expected low < high and a width > 0, found {low}, {high}, {width}")
    while high - low > width:
        middle = 0.5 * (low + high)
        if stable(middle):
            high = middle
        else:
            low = middle
    return low, high


def deepest_fall(results: Results) -> float:
    """Largest downward displacement of a corner at the last frame."""
    return float(-results.frames[-1].vertex_displacement[:, 1].min())


def mean_fall(results: Results) -> float:
    """Downward displacement of the centre of mass of the layers at the last frame, without abutments.

    While the abutments hold the layers up, and do not push them down, this is at most g t²/2.
    """
    layers = results.block_material == 1
    weight = results.block_area[layers]
    return float(-(results.frames[-1].displacement[layers, 1] * weight).sum() / weight.sum())


def compare_falls(record: Record, falls: Sequence[float], label: str, promised: bool = True) -> None:
    """Compare falls of centres of mass, over g t²/2, with the bound."""
    runs = f"{len(falls)} run{'s' * (len(falls) > 1)}"
    record.compare(
        f"excess of the fall of the centre of mass over free fall, largest of {runs} ({label})",
        max(0.0, max(falls) - 1),
        truth=0.0,
        truth_source="bound: g t²/2",
        scale=1.0,
        allowed=1e-6 if promised else None,  # constant acceleration is integrated exactly: only sums round
        explanation=f"the largest fall is {max(falls):.6f} of g t²/2"
        + (": a piston, all its blocks fall together" if max(falls) > 0.99 else ": none falls freely"),
    )
