# SPDX-License-Identifier: MIT
"""Pictures of joints: stresses, opening, slip and mobilised strength as colours along them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..joints import JOINT_FIELDS, need_contacts
from ..results import Results
from ..units import Units
from .block_maps import add_colour_bar, frame_map
from .style import PAPER_WIDTH, STATES, add_strokes, limits_of, without_splinters

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OPEN = 0  # state of a contact
WIDTH = 2.4  # points; less where joints are short
RIM = "#6E6E6E"  # beneath the colours, of which zero is white in some scales


def joint_field_name(name: str) -> str:
    """The name, or an InputError for one that is none of JOINT_FIELDS."""
    if name not in JOINT_FIELDS:
        raise InputError(f"there is no field {name!r} of joints; the fields are: {', '.join(JOINT_FIELDS)}")
    return name


def joints(
    results: Results, field: str = "normal_stress", frame: int = -1, *, axes: Axes | None = None,
    limits: tuple[float, float] | None = None, size: float = 1.0, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """A field of JOINT_FIELDS as colours along the joints of a frame.

    Each point of a joint colours the length that it stands for; points without length are dots. Where a joint is open,
    or has no strength to be mobilised, it is a thin grey line, but for the field 'opening'. `limits` are the ends of
    the colour scale, `size` is a factor on widths."""
    from matplotlib.colors import Normalize
    from matplotlib.lines import Line2D

    joint_field_name(field)
    need_contacts(results)
    now, units = results.frames[frame], Units.parse(units, results)
    points = results.joint_columns(frame)
    values = points[field].astype(float)
    without = np.isnan(values) | ((points["state"] == OPEN) & (field != "opening"))
    if field == "mobilised" and not results.has_strength:
        raise InputError("the file holds no strength of joints: its version is older", results.path)
    span = points["length"][~without]
    usual = without_splinters(values[~without], span) if (span > 0).any() else values[~without]
    low, high, colour_map = _limits(field, usual, limits)
    ends = points.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    line = points["length"] > 0
    with frame_map(results, now, axes, units, title) as axes:
        width = size * _width(axes, results)
        for some, colour, share in ((without, STATES["open"], 0.4), (~without, RIM, 1.0)):
            wide = share * width + (min(0.5, 0.25 * width) if some is not without else 0.0)
            add_strokes(axes, ends[some & line], colors=colour, linewidths=wide, in_layout=False, zorder=3)
        # what is largest is drawn last
        order = np.flatnonzero(~without & line)
        order = order[np.argsort(np.abs(values[order]), kind="stable")]
        drawn = add_strokes(
            axes, ends[order], array=values[order], cmap=colour_map, norm=Normalize(low, high), linewidths=width,
            capstyle="butt", in_layout=False, zorder=3.2,
        )  # fmt: skip
        dots = ~without & ~line
        if dots.any():
            axes.scatter(
                points["x"][dots], points["y"][dots], c=values[dots], cmap=colour_map, vmin=low, vmax=high,
                s=(1.5 * width) ** 2, linewidths=0, zorder=3.3,
            )  # fmt: skip
        add_colour_bar(axes, drawn, units, JOINT_FIELDS[field].label, JOINT_FIELDS[field].dimension, values[~without])
        if (without & line).any():
            handle = Line2D([], [], color=STATES["open"], lw=0.4 * width)
            name = "open, or without strength" if field == "mobilised" else "open"
            axes.legend([handle], [name], loc="lower right", bbox_to_anchor=(0.95, 1.0), borderaxespad=0.1)
    return axes


def _width(axes: Axes, results: Results) -> float:
    """Width of lines [points]: a sixth of the size of the blocks, where that is less than WIDTH."""
    extent = float(np.ptp(np.array(axes.get_xlim())))
    per_length = 72.0 * (PAPER_WIDTH - 1.1) / extent
    return min(WIDTH, max(0.3, per_length / 6.0 * float(np.median(np.sqrt(results.block_area)))))


def _limits(field: str, values: FloatArray, given: tuple[float, float] | None) -> tuple[float, float, str]:
    """Ends of the colour scale and its colour map; a mobilised share counts from 0 to 1."""
    if not len(values):
        values = np.zeros(1)
    if field == "mobilised" and given is None:
        given = (0.0, 1.0)  # more is at points where a dashpot adds to friction: the tip of the bar says so
    return limits_of("stress" if field == "normal_stress" else field, values, given)
