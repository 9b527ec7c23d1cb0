# SPDX-License-Identifier: MIT
"""Symbols of boundaries along their edges: hatches, rollers, dashpots, and arrows of tractions and velocities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, BoolArray, FloatArray
from ..results import Results
from .style import BOUNDARIES, add_strokes

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

SIZE = 0.012  # of a symbol over the larger extent of the model
#: How an edge is loaded or moved: not, along its inward or outward normal, along a vector.
NONE, INWARD, OUTWARD, ALONG = 0, 1, 2, 3


def edge_arrows(results: Results, time: float | None = None) -> FloatArray:
    """(n, 3) for each edge of `results.boundary_edges`: NONE, INWARD, OUTWARD or ALONG, and the vector of the last.

    Read from the input in the results. Tractions and velocities act as at a time, by the factor of their table: none
    where it is zero; without a time as they are given."""
    edges, kinds = results.boundary_edges, results.boundary_kinds
    arrows = np.zeros((len(edges), 3))
    for i, (kind, group) in enumerate(zip(kinds, _groups(results), strict=True)):
        of_boundary = edges[:, 0] == i
        if kind == "traction":
            arrows[of_boundary] = _traction(group, results, of_boundary)
        elif kind == "moving" and "velocity" in group:
            arrows[of_boundary] = (ALONG, *_unit(np.array(group["velocity"], dtype=float)))
        table = _table(group)
        if time is not None and table:
            sign = float(np.sign(np.interp(time, table[0::2], table[1::2])))
            arrows[of_boundary] = _signed(arrows[of_boundary], sign)
    return arrows


def boundary_tables(results: Results) -> list[list[float]]:
    """Of each boundary the table t, factor, … of its load or velocity; empty: none."""
    return [_table(group) for group in _groups(results)]


def _table(group: dict[str, Any]) -> list[float]:
    return [float(value) for value in group.get("table", [])]


def _groups(results: Results) -> list[dict[str, Any]]:
    """The groups &boundary of the input, one for each boundary; empty ones where the text does not show them."""
    given = results.input_groups.get("boundary", [])
    return given if len(given) == len(results.boundary_kinds) else [{} for _ in results.boundary_kinds]


def _signed(arrows: FloatArray, sign: float) -> FloatArray:
    """Arrows as they are, turned round, or none."""
    if sign > 0:
        return arrows
    if sign == 0:
        return np.zeros_like(arrows)
    turned = -arrows
    turned[:, 0] = np.array([NONE, OUTWARD, INWARD, ALONG])[arrows[:, 0].astype(int)]
    return turned


def _traction(group: dict[str, Any], results: Results, chosen: BoolArray) -> FloatArray:
    """(m, 3) arrows of the chosen edges of a loaded boundary."""
    ends = results.vertices[results.boundary_ends[chosen]]
    along = ends[:, 1] - ends[:, 0]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    if "traction" in group:
        vectors = np.broadcast_to(np.array(group["traction"], dtype=float), outward.shape)
    elif "stress" in group:
        s11, s22, s12 = (float(value) for value in group["stress"])
        vectors = outward @ np.array([[s11, s12], [s12, s22]])
    else:
        pressure = float(group.get("pressure", 1.0))
        return np.tile([INWARD if pressure > 0 else OUTWARD if pressure < 0 else NONE, 0.0, 0.0], (len(ends), 1))
    there = np.linalg.norm(vectors, axis=1, keepdims=True) > 0
    return np.where(there, np.column_stack([np.full(len(ends), ALONG), _unit(vectors)]), 0.0)


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)


def add_boundaries(axes: Axes, results: Results, shown: FloatArray, time: float | None = None) -> list[Artist]:
    """Add the edges of boundaries with their symbols outside of the blocks: hatches (fixed, moving), rollers, dashpots
    (viscous; before a line, the ground that moves: free field), arrows of tractions and, one for each boundary, of
    velocities, as they act at a time. Edges of blocks that are not there (NaN) have none."""
    ends, edges = results.boundary_ends, results.boundary_edges
    if not len(edges):
        return []
    size = SIZE * float(np.ptp(results.vertices, axis=0).max())
    arrows = edge_arrows(results, time)
    kinds = np.array(results.boundary_kinds)[edges[:, 0]]
    drawn: list[Artist] = []

    def add(lines: FloatArray, colour: str, width: float, order: float) -> None:
        options: dict[str, Any] = {"clip_on": False, "in_layout": False}
        drawn.append(add_strokes(axes, lines, colors=colour, linewidths=width, zorder=order, **options))

    for kind, colour in BOUNDARIES.items():
        here = (kinds == kind) & np.isfinite(shown[ends]).all(axis=(1, 2))
        if not here.any():
            continue
        lines, arrow = shown[ends[here]], arrows[here]
        add(lines, colour, 1.8, 3.8)
        foot, tangent, outward, owner = _feet(lines, size)
        if kind == "roller":
            drawn += axes.plot(*(foot + 0.6 * size * outward).T, "o", color=colour, markersize=2.6,
                               markerfacecolor="white", markeredgewidth=0.7, zorder=3.9, clip_on=False)  # fmt: skip
            continue
        if kind in ("fixed", "moving"):
            add(np.stack([foot, foot + size * (outward - tangent)], axis=1), colour, 0.8, 3.8)
        if kind in ("viscous", "free_field"):
            add(_dashpots(foot, tangent, outward, size), colour, 0.7, 3.8)
        if kind == "free_field":
            add(lines + 1.8 * size * _outward(lines)[:, None], colour, 1.2, 3.8)
        if kind == "traction":
            add(_arrows(foot, outward, arrow[owner], size), colour, 0.8, 3.8)
        if kind == "moving":
            middle = [int(np.flatnonzero(edges[here, 0][owner] == i)[0]) for i in np.unique(edges[here, 0])]
            middle = [m + int((edges[here, 0][owner] == edges[here, 0][owner[m]]).sum()) // 2 for m in middle]
            add(_arrows(foot[middle] + 1.5 * size * outward[middle], outward[middle], arrow[owner[middle]], 2 * size),
                colour, 1.4, 3.9)  # fmt: skip
    return drawn


def _outward(lines: FloatArray) -> FloatArray:
    """Outward normals of edges."""
    along = _unit(lines[:, 1] - lines[:, 0])
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def _dashpots(foot: FloatArray, tangent: FloatArray, outward: FloatArray, size: float) -> FloatArray:
    """Strokes of dashpots outside of an edge: rod and piston, the cylinder around it, and its rod."""

    def at(out: float, along: float) -> FloatArray:
        return foot + size * (out * outward + along * tangent)

    strokes = [((0, 0), (0.8, 0)), ((0.8, -0.3), (0.8, 0.3)), ((0.5, -0.5), (1.2, -0.5)), ((0.5, 0.5), (1.2, 0.5)),
               ((1.2, -0.5), (1.2, 0.5)), ((1.2, 0), (1.8, 0))]  # fmt: skip
    return np.concatenate([np.stack([at(*first), at(*second)], axis=1) for first, second in strokes])


def _feet(lines: FloatArray, size: float) -> tuple[FloatArray, FloatArray, FloatArray, AnyArray]:
    """Places along edges about 2.5 symbols apart, tangent and outward normal there, and the number of the edge."""
    along = lines[:, 1] - lines[:, 0]
    length = np.linalg.norm(along, axis=1)
    counts = np.maximum(1, np.round(length / (2.5 * size))).astype(int)
    share = np.concatenate([(np.arange(n) + 0.5) / n for n in counts])
    owner = np.repeat(np.arange(len(lines)), counts)
    tangent = (along / np.where(length > 0, length, 1.0)[:, None])[owner]
    outward = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    return lines[owner, 0] + share[:, None] * along[owner], tangent, outward, owner


def _arrows(foot: FloatArray, outward: FloatArray, arrow: FloatArray, size: float) -> FloatArray:
    """Strokes of arrows outside of an edge: into it, out of it, or beside it, with their heads."""
    mode = arrow[:, 0]
    foot, outward, arrow, mode = (values[mode != NONE] for values in (foot, outward, arrow, mode))
    direction = np.where((mode == ALONG)[:, None], arrow[:, 1:], outward * np.where(mode == INWARD, -1, 1)[:, None])
    push = np.einsum("ij,ij->i", direction, outward)[:, None]
    tail = np.where(push < -0.1, foot - 2 * size * direction, foot)
    tail = np.where(np.abs(push) <= 0.1, foot + 0.8 * size * outward - size * direction, tail)
    tip = tail + 2 * size * direction
    across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    head = [np.stack([tip, tip - 0.7 * size * direction + side * 0.35 * size * across], axis=1) for side in (-1, 1)]
    return np.concatenate([np.stack([tail, tip], axis=1), *head])
