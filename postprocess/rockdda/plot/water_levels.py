# SPDX-License-Identifier: MIT
"""Water of a frame: tables, which groups act, and the pressure along the edges that it wets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..results import Frame, Results

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Pressure = Callable[[FloatArray], FloatArray]
TABLE = "#0072B2"
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


def acting_groups(results: Results, frame: int) -> set[int]:
    """The groups that act in the stage of a frame."""
    names = [str(name).strip().lower() for name in results["model/water_names"]]
    everyone = set(range(len(names)))
    if "model/water_stage" not in results or "history/stage" not in results or not len(results["history/stage"]):
        return everyone
    chosen_in = [str(words).strip().lower() for words in results["model/water_stage"]]
    # a trial of a search counts steps from the settled state, its history begins there
    row = int(np.searchsorted(results["history/step"], results["frames/step"][frame]))
    row = min(row, len(results["history/stage"]) - 1)
    chosen = chosen_in[min(int(results["history/stage"][row]), len(chosen_in) - 1)]
    if not chosen:
        return everyone
    words = {word.strip() for word in chosen.split(",")}
    return {group for group in everyone if names[group] in words and words != {"none"}}


@dataclass(frozen=True)
class Stretch:
    """A wetted stretch of an edge, counter-clockwise on its block, so that the outside is on its right."""

    first: int  # vertices at both ends of the edge
    second: int
    share: FloatArray  # (n,) places along the edge, from 0 to 1
    at: FloatArray  # (n, 2) these places
    pressure: FloatArray  # (n,)
    free: bool  # no other block faces it
    unit_weight: float  # of the water; 0 where a pressure file has none


def wetted_stretches(results: Results, frame: int = -1) -> list[Stretch]:
    """The stretches of edges of a frame on which water presses; InputError for a model without water."""
    if "model/water_edges" not in results:
        raise InputError(f"{results.name}: the model has no water (&water)")
    now = results.frames[frame]
    edges, ends = results["model/water_edges"], results["model/water_ends"]
    vertices = now.vertices
    shares: FloatArray = np.linspace(0.0, 1.0, SHORE)
    pressures = {group: _pressure_of(results, group, now.time) for group in np.unique(edges[:, 0])}
    tables = {group: water_table(results, group, now.time) for group in pressures}
    weights = results["model/water_unit_weight"]
    acting = acting_groups(results, frame)
    # where several groups wet a stretch the last one counts
    last = {
        (*edge[1:3], *end): row for row, (edge, end) in enumerate(zip(edges, ends, strict=True)) if edge[0] in acting
    }
    there = np.repeat(now.active, np.diff(results.vertex_offset))
    found = []
    for row in sorted(last.values()):
        (group, first, second, joint), (low, high) = edges[row], ends[row]
        if not there[first]:
            continue
        p, q = vertices[first], vertices[second]
        s = low + (high - low) * shares
        table = tables[group]
        if table is not None and abs(q[0] - p[0]) > 0:
            kinks = (table[:, 0] - p[0]) / (q[0] - p[0])
            s = np.union1d(s, kinks[(kinks > low) & (kinks < high)])
        at = p + s[:, None] * (q - p)
        value = pressures[group](at)
        if value.any():
            found.append(Stretch(int(first), int(second), s, at, value, bool(joint == 0), float(weights[group])))
    return found


def water_tables(results: Results, frame: Frame) -> list[FloatArray]:
    """Points (m, 2) of the tables that act in a frame; none in files without water."""
    if "model/water_names" not in results:
        return []
    tables = [water_table(results, group, frame.time) for group in sorted(acting_groups(results, frame.index))]
    return [table for table in tables if table is not None]


def add_water_tables(axes: Axes, results: Results, frame: Frame) -> list[Artist]:
    """Add the water tables that act in a frame as dashed lines, level beyond their ends, across the axes."""
    left, right = axes.get_xlim()
    drawn: list[Artist] = []
    for table in water_tables(results, frame):
        x = np.concatenate([[min(left, table[0, 0])], table[:, 0], [max(right, table[-1, 0])]])
        y = np.concatenate([table[:1, 1], table[:, 1], table[-1:, 1]])
        drawn += axes.plot(
            x, y, color=TABLE, linestyle=(0, (6, 2)), linewidth=1.1, zorder=3.2, scalex=False, scaley=False
        )
    return drawn
