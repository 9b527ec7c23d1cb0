# SPDX-License-Identifier: MIT
"""Pictures of water: tables, and pressure diagrams along the edges that it wets."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..units import Units
from .block_maps import add_bolts, add_fixed_points, add_plain_blocks, frame_axes
from .style import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results import Results

FloatArray = npt.NDArray[np.float64]
Pressure = Callable[[FloatArray], FloatArray]
WATER, TABLE = "#56B4E9", "#0072B2"
SHORE = 33  # places along a stretch between the kinks of the pressure


def water_table(results: Results, group: int, time: float) -> FloatArray | None:
    """Points (m, 2) of the table of a group at a time; None where the group has a pressure file."""
    points: FloatArray = results["model/water_table"][results["model/water_table_group"] == group]
    if not len(points):
        return None
    of_group = results["model/water_level_group"] == group
    rise = 0.0
    if of_group.any():
        rise = float(np.interp(time, results["model/water_level_time"][of_group],
                               results["model/water_level_rise"][of_group]))  # fmt: skip
    return points + np.array([0.0, rise])


def _pressure_of(results: Results, group: int, time: float) -> Pressure:
    """The pressure of a group at places (n, 2)."""
    table = water_table(results, group, time)
    if table is not None:
        weight = float(results["model/water_unit_weight"][group])
        return lambda at: weight * np.maximum(0.0, np.interp(at[:, 0], *table.T) - at[:, 1])
    from matplotlib.tri import LinearTriInterpolator, Triangulation

    of_group = results["model/water_points_group"] == group
    points = results["model/water_points"][of_group]
    field = LinearTriInterpolator(Triangulation(*points.T), results["model/water_pressure"][of_group])
    return lambda at: np.maximum(0.0, np.ma.filled(field(*at.T), 0.0))


def _acting(results: Results, frame: int) -> set[int]:
    """The groups that act in the stage of a frame."""
    names = [str(name).strip().lower() for name in results["model/water_names"]]
    everyone = set(range(len(names)))
    if "model/water_stage" not in results or "history/stage" not in results or not len(results["history/stage"]):
        return everyone
    chosen_in = [str(words).strip().lower() for words in results["model/water_stage"]]
    row = max(0, int(results["frames/step"][frame]) - 1)
    chosen = chosen_in[min(int(results["history/stage"][row]), len(chosen_in) - 1)]
    if not chosen:
        return everyone
    words = {word.strip() for word in chosen.split(",")}
    return {group for group in everyone if names[group] in words and words != {"none"}}


def pressure_diagrams(results: Results, frame: int = -1) -> list[tuple[FloatArray, FloatArray, bool]]:
    """Places (n, 2) along each wetted stretch of an edge, the pressure there, and whether the stretch is free.

    Places run counter-clockwise around the block, so that the outside is on their right.
    """
    if "model/water_edges" not in results:
        raise InputError(f"{results.name}: the model has no water (&water)")
    now = results.frames[frame]
    edges, ends = results["model/water_edges"], results["model/water_ends"]
    vertices = now.vertices
    shares: FloatArray = np.linspace(0.0, 1.0, SHORE)
    diagrams = []
    pressures = {group: _pressure_of(results, group, now.time) for group in np.unique(edges[:, 0])}
    tables = {group: water_table(results, group, now.time) for group in pressures}
    acting = _acting(results, frame)
    # where several groups wet a stretch the last one counts
    last = {
        (*edge[1:3], *end): row for row, (edge, end) in enumerate(zip(edges, ends, strict=True)) if edge[0] in acting
    }
    for row in sorted(last.values()):
        (group, first, second, joint), (low, high) = edges[row], ends[row]
        p, q = vertices[first], vertices[second]
        s = low + (high - low) * shares
        table = tables[group]
        if table is not None and abs(q[0] - p[0]) > 0:
            kinks = (table[:, 0] - p[0]) / (q[0] - p[0])
            s = np.union1d(s, kinks[(kinks > low) & (kinks < high)])
        at = p + s[:, None] * (q - p)
        value = pressures[group](at)
        if value.any():
            diagrams.append((at, value, joint == 0))
    return diagrams


def water(
    results: Results,
    frame: int = -1,
    *,
    axes: Axes | None = None,
    size: float = 1.0,
    units: str | Units | None = None,
    title: str | None = None,
) -> Axes:
    """Water tables, and the pressure on wetted edges as bands: inside the blocks at joints, outside at free edges.

    `size` is a factor on the width of the bands.
    """
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    now, units = results.frames[frame], Units.parse(units)
    diagrams = pressure_diagrams(results, frame)
    largest = max((float(value.max()) for _, value, _ in diagrams), default=0.0)
    widest = 0.08 * size * float(np.ptp(results.vertices, axis=0).max())
    bands, edges = [], []
    for at, value, free in diagrams:
        along = at[-1] - at[0]
        outward = np.array([along[1], -along[0]]) / np.hypot(*along)
        tip = at + (widest if free else -widest) * (value / largest)[:, None] * outward
        bands.append(np.concatenate([at, tip[::-1]]))
        edges.append(tip[value > 0])
    with style():
        axes = frame_axes(results, now, now.vertices, axes, units, title)
        if bands:
            low, high = np.concatenate(bands).min(axis=0), np.concatenate(bands).max(axis=0)
            (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
            axes.set_xlim(min(left, low[0]), max(right, high[0]))
            axes.set_ylim(min(bottom, low[1]), max(top, high[1]))
        add_plain_blocks(axes, results, now.vertices)
        axes.add_collection(PolyCollection(bands, facecolors=WATER, alpha=0.55, edgecolors="none", zorder=2.5),
                            autolim=False)  # fmt: skip
        axes.add_collection(LineCollection(edges, colors=TABLE, linewidths=0.6, zorder=2.6), autolim=False)
        left, right = axes.get_xlim()
        for group in sorted(_acting(results, frame)):
            table = water_table(results, group, now.time)
            if table is not None:
                x = np.concatenate([[left], table[:, 0], [right]])
                y = np.concatenate([table[:1, 1], table[:, 1], table[-1:, 1]])
                axes.plot(
                    x, y, color=TABLE, linestyle=(0, (6, 2)), linewidth=1.1, zorder=3.2, scalex=False, scaley=False
                )
        add_bolts(axes, now.bolt_ends)
        add_fixed_points(axes, results)
        handles = [Line2D([], [], color=TABLE, lw=1.1, ls=(0, (6, 2))), Patch(facecolor=WATER, alpha=0.55)]
        unit = units.of("stress")
        labels = ["water table", f"pressure, largest {largest:.4g}" + (f" {unit}" if units.length else "")]
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1))
    return axes
