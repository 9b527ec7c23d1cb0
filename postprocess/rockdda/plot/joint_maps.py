# SPDX-License-Identifier: MIT
"""Pictures of joints: values as colours along them, the line of thrust, stresses along a chosen line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, FloatArray, IntArray
from ..errors import InputError
from ..joints import JOINT_FIELDS, need_contacts
from ..results import Results
from ..units import Units
from .block_maps import _scale_bar, _short_factor, _with_unit, add_colour_bar, frame_map
from .style import (
    PALETTE,
    PAPER_WIDTH,
    STATES,
    add_strokes,
    limits_of,
    name_axis,
    new_panels,
    nice_ticks,
    style,
    without_splinters,
)

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

    Each point of a joint colours the length that it represents; points without length are dots. Where a joint is open,
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


THRUST = "#D55E00"
LOADED = 0.02  #: of the usual force of joints: less is not drawn
BESIDE = 0.2  #: of the size of a middle block: how far from a chosen line joints belong to it
PARALLEL = np.cos(np.radians(15.0))


def _resultants(results: Results, frame: int) -> tuple[IntArray, FloatArray, FloatArray]:
    """Blocks (n, 2) of each joint that bears, the force (n, 2) on the first one, and where it acts (n, 2)."""
    points = results.joint_columns(frame)
    joint = points["joint"]
    if not len(joint):
        return np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2)), np.zeros((0, 2))
    n = int(joint[-1]) + 1
    force, place = points.stack("force_x", "force_y"), points.stack("x", "y")
    total = np.column_stack([np.bincount(joint, force[:, i], n) for i in (0, 1)])
    size = np.hypot(*total.T)
    bearing = size > LOADED * float(np.percentile(size, 90)) if size.any() else np.zeros(n, dtype=bool)
    # parts of the force along the resultant weigh the places: the resultant crosses the joint there
    share = np.einsum("ij,ij->i", force, (total / np.where(size > 0, size, 1.0)[:, None])[joint])
    moments = np.column_stack([np.bincount(joint, share * place[:, i], n) for i in (0, 1)])
    where = moments / np.where(size > 0, size, 1.0)[:, None]
    first = np.searchsorted(joint, np.arange(n))
    pair = np.column_stack([points["first"], points["second"]])[first]
    return pair[bearing], total[bearing], where[bearing]


def thrust(
    results: Results, frame: int = -1, *, axes: Axes | None = None, size: float = 1.0, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """The line of thrust: dots where the force of each joint crosses it, joined through blocks between two joints.

    The width follows the force. In a block with another number of joints that bear, strokes along the forces end
    within it. `size` is a factor on the widths."""
    need_contacts(results)
    now, units = results.frames[frame], Units.parse(units, results)
    pair, force, where = _resultants(results, frame)
    if not len(pair):
        raise InputError("no joint bears in this frame", results.path)
    amount = np.hypot(*force.T)
    reference = float(np.percentile(amount, 95))
    width = size * np.clip(3.0 * amount / reference, 0.4, 3.6)
    of_block: dict[int, list[int]] = {}
    for row, blocks in enumerate(pair):
        for block in blocks:
            of_block.setdefault(int(block), []).append(row)
    strokes, widths = [], []
    for block, rows in of_block.items():
        if len(rows) == 2:
            strokes.append(where[rows])
            widths.append(float(width[rows].mean()))
            continue
        reach = 0.35 * float(np.sqrt(results.block_area[block]))
        for row in rows:
            along = force[row] / amount[row]
            inward = along if (now.centroid[block] - where[row]) @ along > 0 else -along
            strokes.append(np.array([where[row], where[row] + reach * inward]))
            widths.append(float(width[row]))
    with frame_map(results, now, axes, units, title) as axes:
        add_strokes(axes, strokes, colors=THRUST, linewidths=widths, capstyle="round", zorder=3)
        if len(where) < 400:
            axes.plot(
                *where.T, "o", color="white", markeredgecolor=THRUST, markersize=3.2, markeredgewidth=0.9, zorder=3.4
            )
        value = _short_factor(float(amount.max()))
        extent = float(np.ptp(np.array(axes.get_xlim())))
        _scale_bar(
            axes,
            0.06 * extent,
            _with_unit(value, units, "force"),
            size * float(np.clip(3 * value / reference, 0.4, 3.6)),
        )
    return axes


def joint_profile_data(results: Results, line: tuple[float, float, float, float], frame: int = -1) -> dict[str, Any]:
    """Points of joints along a line, in their order: `distance` from its first end, `x1` and `x2` (of the part of the
    joint), normal_stress, shear_stress, strength, opening, slip.

    A joint belongs to the line where it is no farther than a fifth of the size of a middle block and runs parallel
    within 15°."""
    need_contacts(results)
    start, end = np.array(line[:2]), np.array(line[2:])
    length = float(np.hypot(*(end - start)))
    if not length > 0:
        raise InputError("the line of a joint profile has no length")
    along = (end - start) / length
    points = results.joint_columns(frame)
    ends = points.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    direction = ends[:, 1] - ends[:, 0]
    span = np.hypot(*direction.T)
    offset = points.stack("x", "y") - start
    far = np.abs(offset @ np.array([-along[1], along[0]]))
    place = offset @ along
    near = BESIDE * float(np.median(np.sqrt(results.block_area)))
    chosen = (span > 0) & (far <= near) & (place >= -near) & (place <= length + near)
    chosen &= np.abs(direction @ along) >= PARALLEL * span
    if not chosen.any():
        raise InputError("no joint runs along this line (within a fifth of the size of a block, and 15°)")
    order = np.flatnonzero(chosen)[np.argsort(place[chosen], kind="stable")]
    both = np.sort((ends[order] - start) @ along, axis=1)
    shear, mobilised = (points[name][order] for name in ("shear_stress", "mobilised"))
    with np.errstate(divide="ignore", invalid="ignore"):
        strength = np.where(mobilised > 0, np.abs(shear) / mobilised, np.nan)
    found = {"distance": place[order], "x1": both[:, 0], "x2": both[:, 1], "shear_stress": shear, "strength": strength}
    return found | {name: points[name][order] for name in ("normal_stress", "opening", "slip")}


def joint_profile(
    results: Results, line: tuple[float, float, float, float] | None = None, frame: int = -1, *, axes: Any = None,
    units: str | Units | None = None, title: str | None = None,
) -> AnyArray:  # fmt: skip
    """Normal and shear stress with the strength, and slip, along joints on a line from x1 y1 to x2 y2; two axes."""
    if line is None:
        raise InputError("a joint profile needs the line along which it goes: x1, y1, x2, y2")
    now, units = results.frames[frame], Units.parse(units, results)
    data = joint_profile_data(results, line, frame)
    with style():
        panels = new_panels(axes, 3.9, (2, 1))
        gap = np.full(len(data["x1"]), np.nan)  # pieces of neighbouring joints are not joined
        place = np.column_stack([data["x1"], data["x2"], gap]).ravel()
        kinds = (
            (0, "normal_stress", "normal (tension positive)", {"color": PALETTE[1]}),
            (0, "shear_stress", "shear, size", {"color": PALETTE[2]}),
            (0, "strength", "shear strength", {"color": PALETTE[2], "ls": (0, (4, 1.5)), "lw": 0.8}),
            (1, "slip", "slip", {"color": PALETTE[3]}),
            (1, "opening", "opening", {"color": PALETTE[4]}),
        )
        for panel, name, text, how in kinds:
            values = np.abs(data[name]) if name == "shear_stress" else data[name]
            panels[panel].plot(place, np.repeat(values, 3), label=text, **how)
        name_axis(panels[0].yaxis, units, "stress", JOINT_FIELDS["normal_stress"].dimension)
        name_axis(panels[1].yaxis, units, "movement", "length")
        panels[1].set_xlim(0.0, float(np.hypot(line[2] - line[0], line[3] - line[1])))
        name_axis(panels[1].xaxis, units, "along the line", "length")
        for panel in panels:
            panel.axhline(0, color="#777777", lw=0.5, zorder=1)
            panel.grid(color="#E4E4E4", lw=0.5)
            nice_ticks(panel.yaxis)
            panel.legend(loc="upper left", bbox_to_anchor=(1.01, 1.03), handlelength=2.2)
        ends = "({:g}, {:g}) to ({:g}, {:g})".format(*line)
        when = f"t = {now.time:.4g} {units.time}".rstrip()
        panels[0].set_title(f"joints along {ends}, {when}" if title is None else title)
    return panels
