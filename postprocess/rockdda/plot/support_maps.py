# SPDX-License-Identifier: MIT
"""Pictures of support: forces of linings normal to them, the capacity of their sections, forces along bolts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..columns import Columns
from ..errors import InputError
from ..frames import BEAM_ENDS, Frame, both_sides
from ..results import Results
from ..units import Units
from .block_maps import add_fixed_points, add_lines, add_plain_blocks, frame_axes
from .block_maps import moment as moment_of
from .boundary_marks import add_boundaries
from .style import LINER, PAPER_WIDTH, USE_MAP, add_strokes, clip_to_window, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIELDS = {"N": "axial force", "M": "bending moment", "Q": "shear force"}
MARKS = {2: ("cracked", "o"), 3: ("crushed", "X")}
COLOURS = ("#2166ac", "#b2182b")
SHARE = 0.16  # of the extent of a lining, which the largest ordinate takes


def liner(
    results: Results, field: str | None = None, frame: int = -1, *, axes: Axes | None = None,
    units: str | Units | None = None, title: str | None = None,
) -> Any:  # fmt: skip
    """Forces along the linings, drawn normal to them: N (tension positive), M (positive where it pulls on the side of
    the opening, and drawn there), Q, in one panel each, or the one that `field` names. Per metre out of the plane."""
    import matplotlib.pyplot as plt

    now, units = results.frames[frame], Units.parse(units, results)
    if field is not None and field not in FIELDS:
        raise InputError(f"the forces of a lining are {', '.join(FIELDS)}, not {field!r}")
    _nodes(results, now)
    with style():
        if field is not None:
            return _draw(results, now, field, axes, units, title, axes is None)
        if axes is not None:
            raise InputError("three forces need axes of their own: name one of N, M, Q as field")
        size = np.ptp(results.vertices, axis=0)
        height = min(max(PAPER_WIDTH / 3 * size[1] / size[0], 1.2), 5) + 0.6
        _, panels = plt.subplots(1, 3, figsize=(1.5 * PAPER_WIDTH, 1.5 * height), layout="constrained")
        for panel, name in zip(panels, FIELDS, strict=True):
            _draw(results, now, name, panel, units, title if name == "N" else "")
        return panels


def capacity(
    results: Results, frame: int = -1, *, axes: Axes | None = None, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """Axial force (compression to the right) and moment at all nodes of the linings, by statics, and in the sections
    between them by which the program judges cracks (crosses); and the capacity of their sections: where the sound one
    cracks (dashed), where the cracked one, without tension, begins to crush (dotted), and what it bears at most, all
    that is pressed at the strength (solid)."""
    from .style import new_axes, title_of

    now, units = results.frames[frame], Units.parse(units, results)
    nodes, sections = _nodes(results, now), now.liner_sections
    there = now.liner_node_columns
    factor, unit = units.of_section("N", float(np.abs(nodes["N"]).max(initial=0.0)))
    moment, unit_m = units.of_section("M", float(np.abs(nodes["M"]).max(initial=0.0)))
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 0.7 * PAPER_WIDTH))
        for k, name in enumerate(results.liner_names):
            chosen = nodes.rows(nodes["liner"] == k)
            if not chosen.n_rows:
                continue
            colour = f"C{k}"
            axes.plot(
                -factor * both_sides(chosen, "N"), moment * both_sides(chosen, "M"), ".", color=colour, label=name,
                zorder=3,
            )  # fmt: skip
            own = sections[(there["liner"] == k) & (there["state"] > 0)].reshape(-1, 2).T
            if own.size:
                axes.plot(-factor * own[0], moment * own[1], "x", color=colour, markersize=3, markeredgewidth=0.6)
            thickness, compression, tension = results.liner_section[k][:3]
            for (n, m), line, words in (
                (crack_limit(thickness, compression, tension), "--", "cracks"),
                (cracked_limit(thickness, compression, tension), ":", "cracked: begins to crush"),
                (plastic_limit(thickness, compression), "-", "cracked: capacity"),
            ):
                if len(n):
                    n, m = factor * np.concatenate([n, n[::-1]]), moment * np.concatenate([m, -m[::-1]])
                    label = f"{name}: {words}" if len(results.liner_names) > 1 else words
                    axes.plot(n, m, line, color=colour, linewidth=0.9, label=label)
        axes.axhline(0, color="#999999", linewidth=0.5)
        axes.set_xlabel(_label("compression", unit))
        axes.set_ylabel(_label("moment", unit_m))
        parts = [title_of(results), moment_of(now, units)]
        axes.set_title(", ".join(part for part in parts if part) if title is None else title)
        axes.legend()
    return axes


def _nodes(results: Results, now: Frame) -> Columns:
    nodes = now.liner_node_columns
    nodes = nodes.rows(nodes["state"] > 0)
    if not nodes.n_rows:
        raise InputError(f"{results.path} has no linings in this frame")
    return nodes


def _mark(axes: Axes, nodes: Columns, marks: dict[int, tuple[str, str]]) -> None:
    for state, (words, mark) in marks.items():
        at = nodes.rows(nodes["state"] == state)
        if at.n_rows:
            axes.plot(at["x"], at["y"], mark, color="black", markersize=3.5, zorder=4, label=words)


def _label(words: str, unit: str) -> str:
    return f"{words} [{unit}]" if unit else words


def _draw(
    results: Results, now: Frame, name: str, axes: Axes | None, units: Units, title: str | None, whole: bool = True
) -> Axes:
    from matplotlib.collections import PolyCollection

    nodes = _nodes(results, now)
    largest = float(np.abs(both_sides(nodes, name)).max(initial=0.0))
    factor, unit = units.of_section(name, largest)
    axes = frame_axes(results, now, now.shown_vertices, axes, units, title)
    add_plain_blocks(axes, results, now.shown_vertices)
    for k in range(len(results.liner_names)):
        chosen = nodes.rows(nodes["liner"] == k)
        if not chosen.n_rows:
            continue
        place, closed = chosen.stack("x", "y"), results.liner_section[k][3] > 0
        value = np.stack([chosen[BEAM_ENDS[name][0]], np.roll(chosen[BEAM_ENDS[name][1]], -1)], axis=1)
        lines = np.stack([place, np.roll(place, -1, axis=0)], axis=1)
        if not closed:
            value, lines = value[:-1], lines[:-1]
        side = results.liner_section[k][4]
        extent = max(float(np.ptp(place, axis=0).max()), 1e-300)
        # a moment is drawn on the side on which it pulls
        ordinates = (SHARE * extent / largest if largest > 0 else 0.0) * side * value[:, :, None]
        corner = (chosen["N_before"] != chosen["N_behind"]) | (chosen["Q_before"] != chosen["Q_behind"])
        corner = np.stack([corner, np.roll(corner, -1)], axis=1)[: len(lines), :, None]
        ends = lines + ordinates * _normals(lines, corner, closed)
        quads = np.concatenate([lines, ends[:, ::-1]], axis=1)
        mean = value.mean(axis=1)
        axes.add_collection(
            PolyCollection(
                list(quads), facecolors=[COLOURS[int(v > 0)] for v in mean], alpha=0.45, linewidths=0, zorder=3
            ),
            autolim=False,
        )
        outline = np.concatenate([ends, np.where(corner, lines, ends)[:, 1:]], axis=1)
        axes.plot(*outline.reshape(-1, 2).T, color="black", linewidth=0.6, zorder=3.2)
        axes.plot(*lines.reshape(-1, 2).T, color="black", linewidth=1.6, zorder=3.4)
        _mark(axes, chosen, MARKS)
    values = factor * both_sides(nodes, name)
    words = _label(f"{FIELDS[name]} {name}", unit)
    axes.set_xlabel(f"{words}: {values.min():.4g} … {values.max():.4g}")
    add_fixed_points(axes, results)
    place = nodes.stack("x", "y")
    middle, half = 0.5 * (place.min(axis=0) + place.max(axis=0)), 0.85 * float(np.ptp(place, axis=0).max())
    if whole:
        clip_to_window(axes, (*(middle - half), *(middle + half)))
    if (nodes["state"] > 1).any():
        axes.legend(loc="upper right")
    return axes


def _normals(lines: FloatArray, corner: BoolArray, closed: bool) -> FloatArray:
    """(n, 2, 2) normals at both ends of beams one after the other: the mean of both at a node, but at a corner, where
    both sides have forces of their own."""
    along = lines[:, 1] - lines[:, 0]
    along /= np.hypot(*along.T)[:, None]
    beside = np.stack([np.roll(along, 1, axis=0), np.roll(along, -1, axis=0)], axis=1)
    if not closed:
        beside[0, 0], beside[-1, 1] = along[0], along[-1]
    mean = along[:, None] + np.where(corner, along[:, None], beside)
    mean /= np.hypot(mean[:, :, 0], mean[:, :, 1])[:, :, None]
    return np.stack([-mean[:, :, 1], mean[:, :, 0]], axis=2)


# -- what sections of linings bear of axial force and moment together -----------------------------------------------


def cracked_limit(thickness: float, compression: float, tension: float) -> tuple[FloatArray, FloatArray]:
    """Compression and largest moment of a section without tension, at its first crushing; empty without a strength."""
    if not np.isfinite(compression):
        return np.zeros(0), np.zeros(0)
    depth = np.linspace(0, thickness, 41)
    n = 0.5 * compression * depth
    return np.append(n, compression * thickness), np.append(n * (0.5 * thickness - depth / 3), 0.0)


def crack_limit(thickness: float, compression: float, tension: float) -> tuple[FloatArray, FloatArray]:
    """Compression and moment at which a section cracks: elastic, and where both strengths are reached with a part
    at the compressive one; empty without strengths."""
    if not np.isfinite(compression * tension):
        return np.zeros(0), np.zeros(0)
    elastic = np.linspace(thickness, 0.0, 41)  # depth of the elastic part, from -compression to tension
    crushed = thickness - elastic
    n = compression * crushed + 0.5 * (compression - tension) * elastic
    m = 0.5 * compression * crushed * elastic + elastic * (
        (compression + tension) * elastic / 12 - 0.25 * (compression - tension) * crushed
    )
    return np.insert(n, 0, -tension * thickness), np.insert(m, 0, 0.0)


def plastic_limit(thickness: float, compression: float) -> tuple[FloatArray, FloatArray]:
    """Compression and largest moment of a section without tension: all that is pressed at the strength."""
    if not np.isfinite(compression):
        return np.zeros(0), np.zeros(0)
    n = compression * np.linspace(0, thickness, 41)
    return n, 0.5 * n * (thickness - n / compression)


BOLT_MARKS = {2: ("slips", "o"), 3: ("yields", "s"), 4: ("broken", "X")}


BOLT_FIELDS = ("force", "use")


def bolts(
    results: Results, field: str = "force", frame: int = -1, *, axes: Axes | None = None, size: float = 1.0,
    units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """Axial force along the bolts as colour, per bolt, and marks at nodes that slip, yield or are broken.

    `field='use'` shows the largest share of a strength instead, of the steel or of its grout; bolts without a strength
    are grey. `size` is a factor on the width of the lines."""
    from matplotlib import colormaps

    now, units = results.frames[frame], Units.parse(units, results)
    if field not in BOLT_FIELDS:
        raise InputError(f"bolts are coloured by {' or '.join(map(repr, BOLT_FIELDS))}, not by {field!r}")
    pieces = now.bolt_pieces.rows(now.bolt_pieces["there"])
    parts, force = pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2), pieces["force"]
    if not len(parts):
        raise InputError(f"{results.path} has no bolts in this frame")
    factor, unit = units.of_bolt(bool(results.bolt_names), float(np.abs(force).max()))
    # the colours begin or end at zero: equal forces differ by rounding alone
    low, high = factor * min(0.0, float(force.min())), factor * max(0.0, float(force.max()))
    shown, label = factor * force, _label("axial force per bolt", unit)
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
        _mark(axes, nodes, BOLT_MARKS)
        add_fixed_points(axes, results)
        add_boundaries(axes, results, now.shown_vertices, now.time)
        if max(nodes["state"], default=0) > 1:
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return axes
