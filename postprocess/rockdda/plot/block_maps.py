# SPDX-License-Identifier: MIT
"""Pictures of the blocks of one frame: fields, principal stresses, contact forces, displacements."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, BoolArray, FloatArray
from ..columns import Columns
from ..frames import field_name
from ..joints import need_contacts
from ..materials import block_material_names
from ..results import Frame, Results
from ..text import plain_text
from ..units import Units
from .boundary_marks import add_boundaries
from .style import (
    BOLT,
    COMPRESSION,
    LINER,
    MATERIALS,
    SCALE,
    SEQUENTIAL,
    STATES,
    TENSION,
    add_strokes,
    field_words,
    limits_of,
    name_axis,
    new_axes,
    nice_ticks,
    set_limits,
    size_of,
    style,
    title_of,
    usual_view,
    without_splinters,
)
from .water_levels import add_water_tables

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection, LineCollection, PolyCollection

MANY = 20_000  # blocks from which on outlines are thinner than they can be printed, and left out of vector files
FLAT = 40  #: height of a picture with room for few numbers beside it [points]
LEAST_BAR = 60  #: height of a colour bar [points]
LEGEND = 56  #: height of a legend beside a picture [points]
LETTERS = 16  #: of a line of a label beside a colour bar
STATE_NAMES = ("open", "sliding", "locked")


def outlines(vertices: FloatArray, offset: AnyArray) -> Any:
    """All polygons as one matplotlib path: much faster than one for each."""
    from matplotlib.path import Path

    count = np.diff(offset)
    n = len(vertices) + len(count)
    points = np.empty((n, 2))
    codes = np.full(n, Path.LINETO, dtype=np.uint8)
    closing = offset[1:] + np.arange(len(count))
    starts = offset[:-1] + np.arange(len(count))
    keep = np.ones(n, dtype=bool)
    keep[closing] = False
    points[keep] = vertices
    points[closing] = vertices[offset[:-1]]
    codes[starts] = Path.MOVETO
    codes[closing] = Path.CLOSEPOLY
    return Path(points, codes)


def add_blocks(axes: Axes, vertices: FloatArray, offset: AnyArray, **options: Any) -> PolyCollection:
    """Add polygons to axes, one for each block."""
    from matplotlib.collections import PolyCollection

    many = len(offset) - 1 > MANY
    options.setdefault("edgecolors", "face" if many else "#333333")
    options.setdefault("linewidths", 0.1 if many else 0.5)
    options.setdefault("rasterized", many)
    corners = np.diff(offset)
    if len(corners) and np.all(corners == corners[0]):  # one array is faster than a list of arrays
        polygons: Any = vertices.reshape(len(corners), corners[0], 2)
    else:
        polygons = np.split(vertices, offset[1:-1])
    collection = PolyCollection(polygons, **options)
    collection.set_in_layout(False)  # it lies within the axes: its extent need not be found
    axes.add_collection(collection, autolim=False)
    return collection


def add_outline(axes: Axes, vertices: FloatArray, offset: AnyArray, **options: Any) -> None:
    """Add the outlines of all blocks as one artist, beneath the blocks: it shows where they have gone away."""
    from matplotlib.patches import PathPatch

    options = {"facecolor": "none", "edgecolor": "#7A7A7A", "linewidth": 0.5, "linestyle": (0, (4, 2))} | options
    options.setdefault("zorder", 0.5)
    if len(offset) - 1 > MANY:  # dashes take long, and cannot be seen
        options |= {"linestyle": "solid", "linewidth": 0.15, "rasterized": True}
    patch = PathPatch(outlines(vertices, offset), label="start", **options)
    patch.set_in_layout(False)
    axes.add_artist(patch)  # add_patch would compute its extent


def add_start(axes: Axes, results: Results, shown: FloatArray) -> None:
    """Add the outlines at the start of those blocks that have visibly moved."""
    offset = results.vertex_offset
    shift = np.hypot(*(shown - results.vertices).T)
    extent = np.ptp(results.vertices, axis=0)
    moved = np.maximum.reduceat(shift, offset[:-1]) > 0.002 * extent.max()  # not those that are drawn as gaps
    corners = np.diff(offset)
    of_moved = np.concatenate([[0], np.cumsum(corners[moved])])
    add_outline(axes, results.vertices[np.repeat(moved, corners)], of_moved)


def frame_axes(
    results: Results, frame: Frame, shown: FloatArray, axes: Axes | None, units: Units, title: str | None
) -> Axes:
    """Axes for a map of the blocks: equal scales, limits around start and frame, labels, title with the time."""
    from matplotlib.ticker import MaxNLocator

    low, high = usual_view(results.vertices, shown, results.vertex_offset, results.block_area)
    beyond = int(np.count_nonzero(_outside(shown, results.vertex_offset, low, high)))
    margin = 0.03 * float((high - low).max())
    width, height = high - low + 2 * margin
    _, axes = new_axes(axes, size_of(float(width), float(height)))
    set_limits(axes, low - margin, high + margin)
    axes.set_aspect("equal")
    name_map(axes, units)
    if _height(axes) < FLAT:
        axes.yaxis.set_major_locator(MaxNLocator(2))
    parts = [title_of(results), f"{moment(frame, units)}"]
    axes.set_title(", ".join(part for part in parts if part) if title is None else title)
    if beyond:
        text = f"{beyond} block{'s' if beyond > 1 else ''} beyond the picture"
        axes.annotate(text, (1, 0), (-3, 3), "axes fraction", "offset points", ha="right", fontsize=7, color="#555555")
    return axes


@contextmanager
def frame_map(
    results: Results, now: Frame, axes: Axes | None, units: Units, title: str | None,
    *, start: FloatArray | None = None, support: float = 1.0,
) -> Iterator[Axes]:  # fmt: skip
    """Axes with a frame's blocks in light grey (at other places `start`); what is drawn in the block comes between them
    and supports (displacements times a factor), fixed points and boundaries."""
    shown = now.shown_vertices
    with style():
        axes = frame_axes(results, now, shown, axes, units, title)
        add_plain_blocks(axes, results, shown if start is None else start)
        yield axes
        add_rest(axes, results, now, shown if start is None else start, support)


def add_rest(axes: Axes, results: Results, now: Frame, shown: FloatArray, scale: float = 1.0) -> None:
    """Add supports (with displacements times a factor), fixed points and boundaries."""
    add_lines(axes, now.moved_pieces("liner", scale), LINER, 2.2)
    add_lines(axes, now.moved_pieces("bolt", scale), BOLT)
    add_fixed_points(axes, results)
    add_boundaries(axes, results, shown, now.time)


def _outside(shown: FloatArray, offset: AnyArray, low: FloatArray, high: FloatArray) -> BoolArray:
    """(nb,) blocks of which nothing lies within limits."""
    with np.errstate(invalid="ignore"):
        right = np.minimum.reduceat(shown, offset[:-1], axis=0) > high
        left = np.maximum.reduceat(shown, offset[:-1], axis=0) < low
    return np.asarray((right | left).any(axis=1))


def name_map(axes: Axes, units: Units) -> None:
    """Labels of both axes of a map, whose limits are there, in one unit."""
    largest = max(abs(limit) for limit in (*axes.get_xlim(), *axes.get_ylim()))
    for axis, text in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        name_axis(axis, units, text, "length", largest)


def moment(frame: Frame, units: Units, digits: str = ".4g") -> str:
    """When a frame is: the name of its stage, where stages have names, and its time."""
    time = f"t = {frame.time:{digits}}" + (f" {units.time}" if units.time else "")
    return f"{plain_text(frame.stage_name)}, {time}" if frame.results.has_stages else time


def _moved(frame: Frame, scale: float) -> FloatArray:
    shown, start = frame.shown_vertices, frame.results.vertices
    return start + scale * (shown - start) if scale != 1 else shown


def add_fixed_points(axes: Axes, results: Results) -> None:
    """Add the fixed points as white triangles."""
    points = results.fixed_points
    if len(points):
        axes.plot(*points.T, "^", color="black", markersize=4, markerfacecolor="white", zorder=4, clip_on=False)


def add_bolts(axes: Axes, ends: FloatArray, *, label: str | None = None) -> None:
    """Add bolts, (n, 2, 2) places of their ends."""
    names = ("x1", "y1", "x2", "y2")
    add_lines(axes, Columns(zip(names, ends.reshape(-1, 4).T, strict=True)), BOLT, label=label)


def add_lines(
    axes: Axes, pieces: Columns, colour: str, width: float = 1.6, *, label: str | None = None
) -> list[LineCollection]:
    """Add pieces of lines and, beneath them, their white rim, to be seen on any colour; nothing without pieces."""
    if not pieces.n_rows:
        return []
    ends = pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    rim = {"colors": "white", "linewidths": width + 1.8, "zorder": 3.5, "capstyle": "projecting"}
    line = {"colors": colour, "linewidths": width, "zorder": 3.51, "capstyle": "round", "label": label or ""}
    return [add_strokes(axes, ends, in_layout=False, **options) for options in (rim, line)]


def add_colour_bar(
    axes: Axes, mappable: Collection, units: Units, text: str, dimension: str, values: AnyArray | None = None
) -> None:
    """Add a colour bar at the right of the axes, with a tip where some of the values lie beyond its end."""
    figure = axes.get_figure()
    assert figure is not None
    # as high as the picture, but not too low for its numbers
    share = max(1.0, LEAST_BAR / max(_height(axes), 1e-3))
    beside = axes.inset_axes((1.02, 0.5 - 0.5 * share, 0.022, share))
    bar = figure.colorbar(mappable, cax=beside, extend=_beyond(mappable, values))
    bar.outline.set_linewidth(0.4)  # type: ignore[operator]
    name_axis(bar.ax.yaxis, units, text, dimension)
    label = bar.ax.get_ylabel()
    if _length(label) > share * _height(axes):
        # of a flat model: along the bar it would be cut, or squeeze the picture
        bar.set_label(textwrap.fill(label, LETTERS), rotation=0, ha="left", va="center")
    nice_ticks(bar.ax.yaxis)


def _beyond(mappable: Collection, values: AnyArray | None) -> str:
    """At which ends of a colour scale there are values beyond it, as matplotlib names them."""
    low, high = mappable.get_clim()
    if values is None or not len(values) or low is None or high is None:
        return "neither"
    slack = 1e-9 * (high - low)
    below, above = bool(np.min(values) < low - slack), bool(np.max(values) > high + slack)
    return {(True, True): "both", (True, False): "min", (False, True): "max"}.get((below, above), "neither")


def _length(label: str) -> float:
    """Of a label of axes as it is set [points]."""
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(size=rcParams["axes.labelsize"])
    return float(TextPath((0, 0), label, prop=font).get_extents().width)


def _height(axes: Axes) -> float:
    """Of axes at equal scales, about, by their limits and place [points]."""
    figure = axes.get_figure()
    assert figure is not None
    place = axes.get_position()
    inches = figure.get_figure(root=True).get_size_inches()  # type: ignore[union-attr]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    by_width = inches[0] * place.width * abs(high - low) / max(abs(right - left), 1e-300)
    return float(72 * min(inches[1] * place.height, by_width))


def blocks(
    results: Results, field: str | None = "displacement", frame: int = -1, *, axes: Axes | None = None,
    scale: float = 1.0, outline: bool = True, limits: tuple[float, float] | None = None, colour_map: str | None = None,
    colour_bar: bool = True, units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """The blocks of a frame, coloured by a field (None: plain), with their outlines at the start.

    `scale` enlarges the displacements, `limits` are the ends of the colour scale (by default those of the values;
    symmetric, with white at zero, when both signs occur)."""
    now, units = results.frames[frame], Units.parse(units, results)
    field = None if field is None else field_name(field)
    shown = _moved(now, scale)
    with style():
        axes = frame_axes(results, now, shown, axes, units, title)
        offset = results.vertex_offset
        if field is None:
            add_blocks(axes, shown, offset, facecolors="#DDE3E8")
        elif field == "material":
            _material_blocks(axes, results, shown, colour_bar)
        else:
            values = now.field(field)
            shown_values = without_splinters(values, results.block_area, now.active)
            low, high, chosen = limits_of(field, shown_values, limits)
            drawn = add_blocks(axes, shown, offset, array=values, cmap=colour_map or chosen)
            drawn.set_clim(low, high)
            if colour_bar:
                add_colour_bar(axes, drawn, units, *field_words(field), values[now.active])
        if outline and now.index != 0:
            add_start(axes, results, shown)
        add_rest(axes, results, now, shown, scale)
        add_water_tables(axes, results, now)
        if scale != 1:
            axes.set_title(f"{axes.get_title(loc='left')}, displacements × {scale:g}")
    return axes


def _material_blocks(axes: Axes, results: Results, shown: FloatArray, legend: bool) -> None:
    from matplotlib.patches import Patch

    material = results.block_material
    colours = [MATERIALS[(m - 1) % len(MATERIALS)] for m in material]
    add_blocks(axes, shown, results.vertex_offset, facecolors=colours)
    if legend:
        found = [int(m) for m in np.unique(material)]
        handles = [Patch(facecolor=MATERIALS[(m - 1) % len(MATERIALS)], edgecolor="#333333", lw=0.5) for m in found]
        names = block_material_names(str(results["input/config"]))
        labels = [plain_text(names.get(m, "")) or f"block material {m}" for m in found]
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1))


def add_plain_blocks(axes: Axes, results: Results, shown: FloatArray) -> None:
    """Add the blocks in light grey, beneath what is drawn on them."""
    edges = {"edgecolors": "#A8A8A8"} if results.n_blocks <= MANY else {}
    add_blocks(axes, shown, results.vertex_offset, facecolors="#F0F1F2", **edges)


def stress_crosses(
    results: Results, frame: int = -1, *, axes: Axes | None = None, size: float = 1.0, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """Principal stresses at the centroids: directions and sizes as crosses, compression and tension by colour.

    `size` is a factor on their length; where blocks differ in size, the 95th percentile of the stresses fits a block of
    middle size."""
    from matplotlib.lines import Line2D

    now, units = results.frames[frame], Units.parse(units, results)
    principal, angle = (values[now.active] for values in now.principal_stress())
    sizes = np.abs(principal)
    reference = float(np.percentile(sizes.max(axis=1), 95)) or 1.0
    half = 0.45 * size * float(np.median(np.sqrt(results.block_area))) / reference
    turned = np.stack([angle, angle + np.pi / 2], axis=1)
    arm = (half * sizes)[..., None] * np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    centre = now.centroid[now.active, None, :]
    segments = np.stack([centre - arm, centre + arm], axis=2).reshape(-1, 2, 2)
    colours = np.where(principal.ravel() > 0, TENSION, COMPRESSION)
    order = np.argsort(principal.ravel() > 0, kind="stable")  # tension, the rarer, on top
    with frame_map(results, now, axes, units, title) as axes:
        many = results.n_blocks > MANY
        add_strokes(axes, segments[order], colors=colours[order], linewidths=0.9, zorder=3, rasterized=many)
        handles = [Line2D([], [], color=colour, lw=1.6) for colour in (COMPRESSION, TENSION)]
        axes.legend(handles, ["compression", "tension"], loc="upper left", bbox_to_anchor=(1.01, 1))
        value = _short_factor(reference)
        _scale_bar(axes, 2 * half * value, _with_unit(value, units, "stress"))
    return axes


def contact_forces(
    results: Results, frame: int = -1, *, axes: Axes | None = None, size: float = 1.0, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """Contact forces: strokes along the force through the contact, width and length by size, colour by state.

    Contacts that carry nothing are small dots. `size` is a factor on widths and lengths."""
    from matplotlib.lines import Line2D

    need_contacts(results)
    now, units = results.frames[frame], Units.parse(units, results)
    contacts = now.contacts
    force = np.hypot(*contacts.force.T) if len(contacts) else np.zeros(0)
    largest = float(force.max()) if len(force) and force.max() > 0 else 1.0
    reference = float(np.percentile(force[force > 0], 99)) if (force > 0).any() else 1.0
    extent = float(np.ptp(results.vertices, axis=0).max())
    longest = size * min(0.06 * extent, 0.8 * float(np.median(np.sqrt(results.block_area))))  # half of it
    carrying = force > 1e-9 * largest
    share = np.minimum(force / reference, 1.5)
    colours = np.array([STATES[name] for name in STATE_NAMES])[contacts.state]
    with frame_map(results, now, axes, units, title) as axes:
        if carrying.any():
            order = np.flatnonzero(carrying)[np.argsort(-force[carrying])]
            direction = contacts.force[order] / force[order, None]
            reach = longest * (0.1 + 0.9 * share[order, None])
            ends = np.stack([contacts.point[order] - reach * direction, contacts.point[order] + reach * direction], 1)
            widths = size * (0.3 + 1.9 * share[order])
            add_strokes(axes, ends, colors=colours[order], linewidths=widths, zorder=3, capstyle="round")
        idle = contacts.point[~carrying]
        if len(idle):
            axes.plot(idle[:, 0], idle[:, 1], ".", color=STATES["open"], markersize=2, zorder=3)
        counts = np.bincount(contacts.state, minlength=3)
        handles = [Line2D([], [], color=STATES[name], lw=2) for name in STATE_NAMES[1:]]
        handles.append(Line2D([], [], color=STATES["open"], marker=".", lw=0, markersize=4))
        labels = [f"{name} ({counts[STATE_NAMES.index(name)]})" for name in ("sliding", "locked", "open")]
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1))
        if carrying.any():
            value = _short_factor(reference)
            share_of = value / reference
            length, width = 2 * longest * (0.1 + 0.9 * share_of), size * (0.3 + 1.9 * share_of)
            _scale_bar(axes, length, _with_unit(value, units, "force"), width)
    return axes


def displacements(
    results: Results, frame: int = -1, *, axes: Axes | None = None, scale: float | None = None,
    units: str | Units | None = None, title: str | None = None, limits: tuple[float, float] | None = None,
) -> Axes:  # fmt: skip
    """Displacement of every centroid since the start, as arrows from where it was, coloured by size.

    `scale` is the factor on their length; by default 1, or so that the longest is a tenth of the model."""
    now, units = results.frames[frame], Units.parse(units, results)
    there = now.active
    start_of = np.where(np.isnan(now.shown_vertices), np.nan, results.vertices)  # vertices of blocks that are there
    vector = now.displacement[there]
    length = np.hypot(*vector.T)
    extent = float(np.ptp(results.vertices, axis=0).max())
    usual = without_splinters(length, results.block_area[there])
    largest = float(usual.max())
    if scale is None:
        scale = 1.0 if largest > 0.05 * extent or largest == 0 else _short_factor(0.1 * extent / largest)
    with frame_map(results, now, axes, units, title, start=start_of, support=0.0) as axes:
        start = results.block_centroid[there]
        arrows = axes.quiver(
            *start.T, *(scale * vector).T, length, angles="xy", scale_units="xy", scale=1,
            cmap=f"{SEQUENTIAL}_r", width=0.0028,             headwidth=4.5, headlength=5, headaxislength=4.5, zorder=3,
        )  # fmt: skip
        arrows.set_clim(*(limits or (0.0, largest or 1.0)))
        add_colour_bar(axes, arrows, units, *field_words("displacement"), length)
        if scale != 1:
            axes.set_title(f"{axes.get_title(loc='left')}, arrows × {scale:g}")
    return axes


def _with_unit(value: float, units: Units, dimension: str) -> str:
    """Two digits and the unit."""
    factor, unit = units.multiple(dimension, value)
    return f"{factor * value:.3g} {unit}" if units.multiples else f"{_short(value)} {unit}"


def _short(value: float) -> str:
    """Two digits."""
    from matplotlib.ticker import ScalarFormatter

    text = f"{value:.2g}"
    return f"${ScalarFormatter(useMathText=True).format_data(float(text))}$" if "e" in text else text


def _short_factor(value: float) -> float:
    """1, 2 or 5 times a power of ten, not above the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(max(f for f in (1, 2, 5) if f * power <= value * (1 + 1e-12)) * power)


def _scale_bar(axes: Axes, length: float, text: str, width: float = 0.9) -> None:
    """A stroke of a length in the axes' units beside the picture, with its value."""
    left, right = axes.get_xlim()
    start = right + 0.03 * (right - left)
    low, high = axes.get_ylim()
    # below the legend, also beside a flat picture
    place = min(low + 0.45 * (high - low), high - LEGEND * (high - low) / max(_height(axes), 1e-3))
    axes.plot(
        [start, start + length], [place, place], color="black", lw=width, clip_on=False, solid_capstyle="round",
        gid=SCALE,
    )  # fmt: skip
    axes.annotate(
        text, (start, place), xytext=(0, -4), textcoords="offset points", va="top", fontsize=8, annotation_clip=False,
        gid=SCALE,
    )  # fmt: skip
