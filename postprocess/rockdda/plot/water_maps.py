# SPDX-License-Identifier: MIT
"""Pictures of water: tables, and pressure diagrams along the edges that it wets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..units import Units
from .block_maps import add_bolts, add_fixed_points, add_plain_blocks, frame_axes
from .boundary_marks import add_boundaries
from .style import style
from .water_levels import TABLE, add_water_tables, pressure_diagrams

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results import Results

WATER = "#56B4E9"


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

    now, units = results.frames[frame], Units.parse(units, results)
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
        axes = frame_axes(results, now, now.shown_vertices, axes, units, title)
        if bands:
            low, high = np.concatenate(bands).min(axis=0), np.concatenate(bands).max(axis=0)
            (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
            axes.set_xlim(min(left, low[0]), max(right, high[0]))
            axes.set_ylim(min(bottom, low[1]), max(top, high[1]))
        add_plain_blocks(axes, results, now.shown_vertices)
        axes.add_collection(PolyCollection(bands, facecolors=WATER, alpha=0.55, edgecolors="none", zorder=2.5),
                            autolim=False)  # fmt: skip
        axes.add_collection(LineCollection(edges, colors=TABLE, linewidths=0.6, zorder=2.6), autolim=False)
        add_water_tables(axes, results, now)
        add_bolts(axes, now.bolt_parts()[0])
        add_fixed_points(axes, results)
        add_boundaries(axes, results, now.shown_vertices, now.time)
        handles = [Line2D([], [], color=TABLE, lw=1.1, ls=(0, (6, 2))), Patch(facecolor=WATER, alpha=0.55)]
        most = units.text(largest, "stress") if units.length else f"{largest:.4g}"
        labels = ["water table", f"pressure, largest {most}"]
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1))
    return axes
