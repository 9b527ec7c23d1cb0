# SPDX-License-Identifier: MIT
"""Pictures of bolts: their axial force along them, and what has slipped, yielded or broken."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..results import Results
from ..units import Units
from .block_maps import add_fixed_points, add_lines, add_plain_blocks, frame_axes
from .boundary_marks import add_boundaries
from .style import LINER, USE_MAP, add_strokes, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKS = {2: ("slips", "o"), 3: ("yields", "s"), 4: ("broken", "X")}


FIELDS = ("force", "use")


def bolts(
    results: Results, field: str = "force", frame: int = -1, *, axes: Axes | None = None, size: float = 1.0,
    units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """Axial force along the bolts as colour, per bolt, and marks at nodes that slip, yield or are broken.

    `field='use'` shows the largest share of a strength instead, of the steel or of its grout; bolts without a strength
    are grey. `size` is a factor on the width of the lines."""
    from matplotlib import colormaps

    now, units = results.frames[frame], Units.parse(units, results)
    if field not in FIELDS:
        raise InputError(f"bolts are coloured by {' or '.join(map(repr, FIELDS))}, not by {field!r}")
    pieces = now.bolt_pieces.rows(now.bolt_pieces["there"])
    parts, force = pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2), pieces["force"]
    if not len(parts):
        raise InputError(f"{results.path} has no bolts in this frame")
    factor, unit = units.of_bolt(bool(results.bolt_names), float(np.abs(force).max()))
    # the colours begin or end at zero: equal forces differ by rounding alone
    low, high = factor * min(0.0, float(force.min())), factor * max(0.0, float(force.max()))
    shown, label = factor * force, f"axial force per bolt{f' [{unit}]' if unit else ''}"
    if field == "use":
        shown, low, high, label = 100 * pieces["use"], 0.0, 100.0, "largest share of a strength [%]"
    with style():
        axes = frame_axes(results, now, now.shown_vertices, axes, units, title)
        add_plain_blocks(axes, results, now.shown_vertices)
        colours = colormaps["viridis" if field == "force" else USE_MAP].with_extremes(bad="#999999")
        add_lines(axes, now.moved_pieces("liner"), LINER, 2.2)
        lines = add_strokes(axes, parts, array=shown, cmap=colours, linewidths=2.4 * size, zorder=3.5)
        lines.set_clim(low, high if high > low else 1.0)
        axes.figure.colorbar(lines, ax=axes, label=label, shrink=0.7)
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
