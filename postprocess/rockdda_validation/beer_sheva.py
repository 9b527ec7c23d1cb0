# SPDX-License-Identifier: MIT
"""The roof of the water reservoir at Tel Beer-Sheva (thesis, 6.6.2): what its cases share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from .case import Record, published
from .roofs import GRAVITY, Roof, Verdict, follow, judge
from .thresholds import find_threshold

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rockdda.results import Results

__all__ = [
    "BASE",
    "COUNTS",
    "CRITERION",
    "EARLY",
    "FREE_FALL",
    "MIDDLE",
    "NUMBERS",
    "TIGHT",
    "UNTIL",
    "VARIANTS",
    "Trials",
    "angle_axis",
    "compare_thresholds",
    "draw",
    "draw_histories",
    "draw_profiles",
    "draw_verdicts",
    "sag",
    "slug",
    "spacing_axis",
]

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
#: blocks of a layer, from the smallest spacing on
COUNTS = (32, 16, 11, 8, 6, 4, 2)
#: the criterion of `judge`
CRITERION = (
    "**Stable** is a roof whose mid-span, over the last fifth of a run of 2 s, sinks by less than t/2 while deflection "
    "and velocity have no trend: what a straight line through them gains in that time is at most half of their swing, "
    "or 1 % of t (per that time). A run ends at once, unstable, when a corner has sunk by t: no arch is left then."
)


def slug(name: str) -> str:
    """A variant's name in file names."""
    return name.replace("'", "").replace(",", "").replace(" ", "-")


def sag(results: Results, point: int = 0) -> tuple[FloatArray, FloatArray]:
    """Times, and deflections of a measured point, downwards."""
    return results["history/time"], -results["history/measured_displacement"][:, point, 1]


class Trials:
    """Verdicts of runs of two seconds, each of which is made once; pairs of time step and stiffness count from 0."""

    def __init__(
        self,
        record: Record,
        points: Sequence[tuple[float, float]] = ((MIDDLE, 0.0),),
        pairs: Sequence[tuple[float, float]] = NUMBERS,
    ) -> None:
        self.record = record
        self.pairs = pairs
        self.points = points  #: measured ones; the first one is judged
        self.verdicts: dict[tuple[str, int, float, int], Verdict] = {}
        self.results: dict[tuple[str, int, float, int], Results] = {}

    def verdict(self, start: str, roof: Roof, pair: int) -> Verdict:
        """Of one run of a roof; `start` names what it starts from."""
        key = (start, roof.blocks, roof.friction_angle, pair)
        if key not in self.verdicts:
            dt, stiffness = self.pairs[pair]
            model = replace(roof, dt=dt, stiffness=stiffness).model(self.points, save_every=10**6)
            name = f"judged-{slug(start)}-{roof.blocks}x{roof.layers}-{roof.friction_angle:g}-{pair}"
            self.results[key] = follow(self.record, model, name, UNTIL, sunk=roof.thickness)
            self.verdicts[key] = judge(*sag(self.results[key]), roof.thickness, UNTIL)
        return self.verdicts[key]

    def stands(self, start: str, roof: Roof) -> bool:
        """For all pairs; the first one that is not stable spares the others."""
        return all(self.verdict(start, roof, pair).stable for pair in range(len(self.pairs)))

    def words(self, pair: int) -> str:
        """Time step and contact stiffness."""
        dt, stiffness = self.pairs[pair]
        return f"{1e3 * dt:g} ms, {stiffness / 1e9:g} GN/m"

    def table(self) -> pd.DataFrame:
        """A row for each roof, a column for each pair."""
        roofs = sorted({key[:3] for key in self.verdicts}, key=lambda key: (list(VARIANTS).index(key[0]), *key[1:]))
        return pd.DataFrame(
            {"start": start, "S_j [m]": BASE.span / blocks, "φ [°]": angle}
            | {
                self.words(pair): self.verdicts[start, blocks, angle, pair].reason
                if (start, blocks, angle, pair) in self.verdicts
                else "not run"
                for pair in range(len(self.pairs))
            }
            for start, blocks, angle in roofs
        )


@dataclass(frozen=True)
class Axis:
    """A parameter that is varied to find the limit of stability of a roof."""

    quantity: str
    unit: str
    values: Sequence[float]  #: of the grid, from those expected to fail on
    change: Callable[[Roof, float], Roof]
    between: Callable[[float, float], float | None]
    shown: Callable[[float], float]  #: value in `unit`
    condition: Callable[[Roof], str]  #: what stays as it is


def angle_axis(angles: Sequence[float], width: float) -> Axis:
    """Friction angles, bisected to `width`."""
    return Axis(
        "friction angle",
        "°",
        angles,
        lambda roof, angle: replace(roof, friction_angle=angle),
        lambda low, high: None if high - low <= width else 0.5 * (low + high),
        lambda angle: angle,
        lambda roof: f"S_j = {roof.spacing:g} m",
    )


def spacing_axis() -> Axis:
    """Joint spacings, bisected to the next whole number of blocks."""
    return Axis(
        "joint spacing",
        "m",
        COUNTS,
        lambda roof, blocks: replace(roof, blocks=round(blocks)),
        lambda many, few: None if many - few <= 1 else (many + few) // 2,
        lambda blocks: BASE.span / blocks,
        lambda roof: f"φ = {roof.friction_angle:g}°",
    )


def compare_thresholds(
    record: Record,
    trials: Trials,
    roofs: dict[str, Roof],
    axis: Axis,
    published: float | None,
    reasons: dict[str, str],
    thrifty: bool = False,
    truths: dict[str, tuple[float, str]] | None = None,
) -> None:
    """From which value on roofs are stable: with the numbers of Table 6.5, the first pair, and with all pairs.

    thrifty: the other pairs run only for roofs that are stable with the first one, and only where the limit may be.
    truths: of roofs for which a limit is known, with its source.
    """
    for start, roof in roofs.items():
        first = partial(_stands, trials, start, roof, axis, True, True)
        every = partial(_stands, trials, start, roof, axis, False, thrifty)
        for pairs, found in (
            ("Table 6.5", find_threshold(first, axis.values, axis.between)),
            ("all four pairs", find_threshold(every, axis.values, axis.between, first if thrifty else None)),
        ):
            truth, source = (truths or {}).get(start, (None, ""))
            words = found.words(axis.unit, lambda value: f"{axis.shown(value):.3g}")
            record.compare(
                f"{axis.quantity} of stability, {axis.condition(roof)} ({start}; {pairs})",
                0.5 * sum(map(axis.shown, found.bracket)) if found.bracket else math.nan,
                axis.unit,
                truth=truth,
                truth_source=source,
                scale=None if truth is None else 1.0,
                published=published,
                published_source=SINGLE["source"] if roof.layers == 1 else PUBLISHED["layered"]["source"],
                explanation=f"{reasons[start]}; {words}",
                found=words,
            )


def _stands(trials: Trials, start: str, roof: Roof, axis: Axis, first: bool, thrifty: bool, value: float) -> bool:
    changed = axis.change(roof, value)
    if first:
        return trials.verdict(start, changed, 0).stable
    if not thrifty:  # all of them, for the table
        for pair in range(len(trials.pairs)):
            trials.verdict(start, changed, pair)
    return trials.stands(start, changed)


def draw_verdicts(
    record: Record,
    trials: Trials,
    roofs: dict[str, Roof],
    caption: str,
    columns: Sequence[str] = ("friction angle [°], S_j = 0.25 m", "joint spacing S_j [m], φ = 47°"),
) -> None:
    """All that was tried, a mark for each run: friction angles, joint spacings, or both."""
    import matplotlib.pyplot as plt

    pairs = range(len(trials.pairs))
    looks = {"stable": ("s", PALETTE[1]), "moves on": ("o", PALETTE[4]), "gone": ("x", PALETTE[2])}
    with record.style():
        figure, panels = plt.subplots(
            len(roofs),
            len(columns),
            figsize=(PAPER_WIDTH * (1.0 if len(columns) > 1 else 0.65), 1.15 * len(roofs) + 0.6),
            layout="constrained",
            sharex="col",
            squeeze=False,
        )
        for row, (start, roof) in zip(panels, roofs.items(), strict=True):
            for axes, label in zip(row, columns, strict=True):
                along_angles = label.startswith("friction")
                for look, (marker, colour) in looks.items():
                    points = [
                        (angle if along_angles else BASE.span / blocks, pair)
                        for (name, blocks, angle, pair), verdict in trials.verdicts.items()
                        if name == start
                        and (blocks == roof.blocks if along_angles else angle == roof.friction_angle)
                        and _look(verdict) == look
                    ]
                    axes.plot(
                        *zip(*points, strict=True) if points else ([], []), marker, color=colour, ms=4, label=look
                    )
                axes.set_ylim(len(pairs) - 0.4, -0.6)
                axes.set_yticks(pairs, [trials.words(pair) if axes is row[0] else "" for pair in pairs], fontsize=6)
                axes.grid(False)
                if not along_angles:
                    axes.set_xscale("log")
                    axes.set_xticks([0.25, 0.5, 1, 2, 4], labels=["0.25", "0.5", "1", "2", "4"])
                    axes.minorticks_off()
            row[0].set_title(start)
        for axes, label in zip(panels[-1], columns, strict=True):
            axes.set_xlabel(label)
        figure.legend(*panels[0, 0].get_legend_handles_labels(), fontsize=7, loc="outside upper center", ncols=3)
        record.figure(figure, "verdicts", caption)


def _look(verdict: Verdict) -> str:
    return "stable" if verdict.stable else "gone" if verdict.reason.startswith("gone") else "moves on"


def draw_profiles(record: Record, columns: dict[str, dict[str, Results]], first: int, caption: str) -> None:
    """u, v, ω at the end, of measured points from `first` on, along x; a column for each start."""
    import matplotlib.pyplot as plt

    with record.style():
        figure, panels = plt.subplots(
            3, len(columns), figsize=(PAPER_WIDTH, 5.0), layout="constrained", sharex=True, squeeze=False
        )
        for column, (title, curves) in enumerate(columns.items()):
            for colour, (label, results) in zip(PALETTE[1:], curves.items(), strict=False):
                x = results.measured_points[first:, 0]
                moved = results["history/measured_displacement"][-1, first:]
                turned = results["history/measured_rotation"][-1, first:]
                for axes, values in zip(panels[:, column], (1e3 * moved[:, 0], moved[:, 1], turned), strict=True):
                    axes.plot(x, values, color=colour, label=label)
            panels[0, column].set_title(title)
            panels[2, column].set_xlabel("x [m]")
        for axes, label in zip(panels[:, 0], ("u [mm]", "v [m]", "ω [rad]"), strict=True):
            axes.set_ylabel(label)
        panels[0, 0].legend(fontsize=7)
        record.figure(figure, "profiles", caption)


def draw_histories(
    record: Record, columns: dict[str, dict[str, Results]], points: Sequence[str], caption: str, title: str = ""
) -> None:
    """Deflections of the first measured points over time: a row for each point, a column for each start."""
    import matplotlib.pyplot as plt

    with record.style():
        figure, panels = plt.subplots(
            len(points),
            len(columns),
            figsize=(PAPER_WIDTH, 0.95 * len(points) + 0.9),
            layout="constrained",
            sharex=True,
            sharey="col",
            squeeze=False,
        )
        for column, (start, curves) in enumerate(columns.items()):
            until = max(float(results["history/time"][-1]) for results in curves.values())
            high = max(float(sag(r, i)[1].max()) for r in curves.values() for i in range(len(points)))
            for i, axes in enumerate(panels[:, column]):
                for colour, (label, results) in zip(PALETTE[1:], curves.items(), strict=False):
                    axes.plot(*sag(results, i), color=colour, label=label, linewidth=0.9)
                time = np.linspace(0, until, 200)
                axes.plot(time, 0.5 * GRAVITY * time**2, "--", color="0.5", linewidth=0.8)
                axes.set_ylim(-0.05 * high, 1.08 * high)
            panels[0, column].set_title(start)
            panels[-1, column].set_xlabel("time [s]")
        for axes, point in zip(panels[:, -1], points, strict=True):
            # at the right: beside the axis of the left panels the longer names run into each other
            axes.text(1.04, 0.5, point, transform=axes.transAxes, fontsize=7.5, va="center")
        figure.supylabel("deflection [m]", fontsize=9)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(
            handles, labels, fontsize=7, loc="outside upper center", ncols=min(len(labels), 7), title=title or None
        )
        record.figure(figure, "histories", caption)


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
