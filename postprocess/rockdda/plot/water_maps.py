# SPDX-License-Identifier: MIT
"""Pictures of water: tables, and pressure diagrams along the edges that it wets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..results import Results
from ..units import Units
from .block_maps import add_plain_blocks, add_rest, frame_axes
from .style import add_strokes, style
from .water_levels import TABLE, Stretch, add_water_tables, wetted_stretches

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WATER = "#56B4E9"
HEADS = "#005F8F"


def water(
    results: Results, frame: int = -1, *, joints: Sequence[int] | None = None, heads: bool = False,
    axes: Axes | None = None, size: float = 1.0, units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """Water tables, and the pressure on wetted edges as bands: inside the blocks at joints, outside at free edges.

    `joints`: numbers of the joint materials whose joints alone have bands, on the block above them; otherwise all
    wetted edges have, at joints as wide as the blocks leave room. `heads` adds contours of the head of the water in the
    joints. `size` is a factor on the width of the bands."""
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    now, units = results.frames[frame], Units.parse(units, results)
    stretches = wetted_stretches(results, frame)
    if joints is not None:
        there = [one for one in stretches if not one.free and int(results.edge_joint[one.first]) in joints]
        stretches = [one for one in there if _is_above(one)]
        if not stretches:
            raise InputError(f"no water presses on joints of material {', '.join(map(str, joints))}", results.path)
    largest = max((float(one.pressure.max()) for one in stretches), default=0.0)
    widest = 0.08 * size * float(np.ptp(results.vertices, axis=0).max())
    room = widest if joints is not None else min(widest, 0.4 * size * float(np.median(np.sqrt(results.block_area))))
    bands, edges = [], []
    for one in stretches:
        along = one.at[-1] - one.at[0]
        outward = np.array([along[1], -along[0]]) / np.hypot(*along)
        tip = one.at + (widest if one.free else -room) * (one.pressure / largest)[:, None] * outward
        bands.append(np.concatenate([one.at, tip[::-1]]))
        edges.append(tip[one.pressure > 0])
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
        add_strokes(axes, edges, colors=TABLE, linewidths=0.6, zorder=2.6)
        if heads:
            _add_heads(axes, results, frame, units)
        add_water_tables(axes, results, now)
        add_rest(axes, results, now, now.shown_vertices)
        handles = [Line2D([], [], color=TABLE, lw=1.1, ls=(0, (6, 2))), Patch(facecolor=WATER, alpha=0.55)]
        most = units.text(largest, "stress") if units.length else f"{largest:.4g}"
        where = "" if joints is None else f" on joints {', '.join(map(str, joints))}"
        labels = ["water table", f"pressure{where}, largest {most}"]
        if heads:
            handles.append(Line2D([], [], color=HEADS, lw=0.8))
            labels.append("head")
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1))
    return axes


def _is_above(stretch: Stretch) -> bool:
    """Does the block of the stretch lie above its joint, or left of an upright one? Its inside is on the left."""
    x, y = stretch.at[-1] - stretch.at[0]
    return bool(x > 0 or (x == 0 and y > 0))


def _add_heads(axes: Axes, results: Results, frame: int, units: Units) -> None:
    """Contours of height plus pressure over unit weight, from all wetted joints, labelled; none across what is dry."""
    from matplotlib.patheffects import withStroke
    from matplotlib.ticker import MaxNLocator
    from matplotlib.tri import Triangulation

    wetted = [one for one in wetted_stretches(results, frame) if one.unit_weight > 0 and not one.free]
    if not wetted:
        return
    points = np.concatenate([one.at[one.pressure > 0] for one in wetted])
    head = np.concatenate([(one.at[:, 1] + one.pressure / one.unit_weight)[one.pressure > 0] for one in wetted])
    _, single = np.unique(np.round(points, 9), axis=0, return_index=True)
    points, head = points[single], head[single]
    if len(points) < 3 or np.ptp(head) <= 1e-6 * max(1e-300, float(np.abs(head).max())):
        return
    mesh = Triangulation(*points.T)
    corners = points[mesh.triangles]
    longest = np.hypot(*np.moveaxis(corners - np.roll(corners, 1, axis=1), -1, 0)).max(axis=1)
    mesh.set_mask(longest > 4.0 * float(np.median(np.sqrt(results.block_area))))
    lines = axes.tricontour(mesh, head, levels=MaxNLocator(7).tick_values(head.min(), head.max()), colors=HEADS,
                            linewidths=0.8, zorder=3)  # fmt: skip
    for level, segments in zip(lines.levels, lines.allsegs, strict=True):
        places = np.concatenate([np.zeros((0, 2)), *segments])
        if not len(places):
            continue
        place = places[np.argmax(places[:, 1])]  # contours are short: beside their upper end
        text = f"{level:g} {units.length}".strip()
        label = axes.annotate(text, place, (2, 1), textcoords="offset points", fontsize=6.5, color=HEADS, zorder=4)
        label.set_path_effects([withStroke(linewidth=2, foreground="white")])
