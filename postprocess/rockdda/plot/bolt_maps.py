# SPDX-License-Identifier: MIT
"""Pictures of bolts: their axial force along them, and what has slipped, yielded or broken."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..units import Units
from .block_maps import add_fixed_points, add_plain_blocks, frame_axes
from .boundary_marks import add_boundaries
from .style import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results import Results

MARKS = {2: ("slips", "o"), 3: ("yields", "s"), 4: ("broken", "X")}


def bolts(
    results: Results,
    frame: int = -1,
    *,
    axes: Axes | None = None,
    size: float = 1.0,
    units: str | Units | None = None,
    title: str | None = None,
) -> Axes:
    """Axial force along the bolts as colour, per bolt, and marks at nodes that slip, yield or are broken.

    `size` is a factor on the width of the lines.
    """
    from matplotlib.collections import LineCollection

    now, units = results.frames[frame], Units.parse(units, results)
    parts, force = now.bolt_parts()
    if not len(parts):
        raise InputError(f"{results.path} has no bolts in this frame")
    factor, unit = units.multiple("force", float(np.abs(force).max()))
    with style():
        axes = frame_axes(results, now, now.shown_vertices, axes, units, title)
        add_plain_blocks(axes, results, now.shown_vertices)
        lines = LineCollection(list(parts), array=factor * force, cmap="viridis", linewidths=2.4 * size, zorder=3.5)
        # the colours begin or end at zero: equal forces differ by rounding alone
        low, high = factor * min(0.0, float(force.min())), factor * max(0.0, float(force.max()))
        lines.set_clim(low, high if high > low else 1.0)
        axes.add_collection(lines, autolim=False)
        axes.figure.colorbar(lines, ax=axes, label=f"axial force per bolt{f' [{unit}]' if unit else ''}", shrink=0.7)
        nodes = now.bolt_node_columns
        for state, (words, mark) in MARKS.items():
            chosen = nodes.rows(nodes["state"] == state)
            if chosen.n_rows:
                axes.plot(chosen["x"], chosen["y"], mark, color="black", markersize=3.5, zorder=4, label=words)
        add_fixed_points(axes, results)
        add_boundaries(axes, results, now.shown_vertices, now.time)
        if max(nodes["state"], default=0) > 1:
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return axes
