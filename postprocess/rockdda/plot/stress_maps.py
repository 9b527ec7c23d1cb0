# SPDX-License-Identifier: MIT
"""Pictures of smoothed fields: contour bands over the blocks, and trajectories of the principal stresses.

DDA has one value for each block. At a corner the mean of the blocks that touch there now counts, weighted by their
areas; between corners and centroids values are linear. Blocks that have come apart are not smoothed over the gap.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import FloatArray, IntArray
from ..errors import InputError
from ..frames import field_name
from ..results import Frame, Results
from ..rings import triangles
from ..units import Units
from .block_maps import MANY, add_blocks, add_colour_bar, add_rest, frame_axes, frame_map, outlines
from .style import COMPRESSION, TENSION, add_strokes, field_words, limits_of, style, without_splinters
from .water_levels import add_water_tables

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BANDS = 10
TOUCH = 0.02  #: of the size of a middle block: the gap across which blocks still touch
CELLS = 120  #: of the grid of trajectories along the longer side of the model
APART = 3.0  #: distance of neighbouring trajectories [cells]
STEP = 0.5  #: along a trajectory [cells]


def _distance_to_edges(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(n,) distances of points from the outline of a polygon."""
    along = np.roll(corners, -1, axis=0) - corners
    square = np.einsum("ij,ij->i", along, along)
    offset = points[:, None] - corners
    share = np.clip(np.einsum("pej,ej->pe", offset, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return np.hypot(*np.moveaxis(offset - share[..., None] * along, -1, 0)).min(axis=1)


def corner_values(frame: Frame, values: FloatArray) -> FloatArray:
    """(nv, …) at each corner the mean of the blocks that touch there, weighted by area; NaN at blocks that are gone."""
    results = frame.results
    corners, offset, area = frame.shown_vertices, results.vertex_offset, results.block_area
    near = TOUCH * float(np.median(np.sqrt(area[frame.active])))
    there = np.flatnonzero(np.isfinite(corners).all(axis=1))
    order = there[np.argsort(corners[there, 0], kind="stable")]
    x = corners[order, 0]
    total = np.zeros((len(corners), *values.shape[1:]))
    weight = np.zeros(len(corners))
    for block in np.flatnonzero(frame.active):
        own = slice(offset[block], offset[block + 1])
        outline = corners[own]
        low, high = outline.min(axis=0) - near, outline.max(axis=0) + near
        some = order[np.searchsorted(x, low[0]) : np.searchsorted(x, high[0])]
        some = some[(corners[some, 1] >= low[1]) & (corners[some, 1] <= high[1])]
        some = some[(some < own.start) | (some >= own.stop)]
        if len(some):
            some = some[_distance_to_edges(corners[some], outline) <= near]
        touching = np.concatenate([np.arange(own.start, own.stop), some])
        weight[touching] += area[block]
        total[touching] += area[block] * values[block]
    with np.errstate(invalid="ignore"):
        return total / np.where(weight > 0, weight, np.nan).reshape(-1, *[1] * (values.ndim - 1))


def _mesh(frame: Frame, values: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Points, values and triangles: fans around the centroids of convex blocks, ears of others."""
    results = frame.results
    corners, offset = frame.shown_vertices, results.vertex_offset
    points = np.concatenate([corners, frame.centroid])
    at = np.concatenate([corner_values(frame, values), values])
    parts = []
    for block in np.flatnonzero(frame.active):
        own = np.arange(offset[block], offset[block + 1])
        outline = corners[own]
        edge, after = np.roll(outline, -1, axis=0) - outline, np.roll(own, -1)
        turned = np.roll(edge, -1, axis=0)
        if (edge[:, 0] * turned[:, 1] - edge[:, 1] * turned[:, 0] >= -1e-9 * results.block_area[block]).all():
            parts.append(np.column_stack([own, after, np.full(len(own), len(corners) + block)]))
        else:
            parts.append(own[triangles(outline).reshape(-1, 3)])
    return points, at, np.concatenate(parts)


def contours(
    results: Results, field: str = "stress_y", frame: int = -1, *, axes: Axes | None = None,
    limits: tuple[float, float] | None = None, units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """Contour bands of a field over the blocks, smoothed at the corners where blocks touch; stresses need a scale
    of blocks much smaller than the model."""
    from matplotlib.patches import PathPatch
    from matplotlib.ticker import MaxNLocator
    from matplotlib.tri import Triangulation

    field = field_name(field)
    if field in ("material", "block"):
        raise InputError(f"the field {field!r} has no contours")
    now, units = results.frames[frame], Units.parse(units, results)
    values = now.field(field).astype(float)
    shown_values = without_splinters(values, results.block_area, now.active)
    low, high, colour_map = limits_of(field, shown_values, limits)
    levels = MaxNLocator(BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    points, at, mesh = _mesh(now, values)
    with style():
        axes = frame_axes(results, now, now.shown_vertices, axes, units, title)
        known = np.asarray(np.isfinite(points).all(axis=1))
        x, y = np.where(known[:, None], points, 0.0).T
        mesh_of_blocks = Triangulation(x, y, mesh)
        bands = axes.tricontourf(
            mesh_of_blocks, np.where(known, at, 0.0), levels=levels, cmap=colour_map, extend="both"
        )  # fmt: skip
        inside = PathPatch(_outline(now), transform=axes.transData, visible=False)
        axes.add_patch(inside)
        bands.set_clip_path(inside)
        edges = {"edgecolors": "#4A4A4A"} if results.n_blocks <= MANY else {}
        add_blocks(axes, now.shown_vertices, results.vertex_offset, facecolors="none", linewidths=0.25, **edges)
        add_colour_bar(axes, bands, units, *field_words(field))
        add_rest(axes, results, now, now.shown_vertices)
        add_water_tables(axes, results, now)
    return axes


def _outline(frame: Frame) -> Any:
    """All blocks that are there as one path."""
    offset, active = frame.results.vertex_offset, frame.active
    corners = np.diff(offset)
    return outlines(frame.shown_vertices[np.repeat(active, corners)], np.concatenate([[0], np.cumsum(corners[active])]))


# -- trajectories ----------------------------------------------------------------------------------------------------


class _Grid:
    """The stress on a regular grid over the blocks: at a node that of the block around it, smoothed over neighbours."""

    def __init__(self, frame: Frame) -> None:
        from matplotlib.path import Path

        corners, offset = frame.shown_vertices, frame.results.vertex_offset
        self.low = np.nanmin(frame.results.vertices, axis=0)
        extent = np.nanmax(frame.results.vertices, axis=0) - self.low
        self.cell = float(extent.max()) / CELLS
        shape = tuple(int(n) for n in np.ceil(extent / self.cell).astype(int) + 1)
        self.inside = np.zeros(shape, dtype=bool)
        stress = np.zeros((*shape, 3))
        for block in np.flatnonzero(frame.active):
            outline = corners[offset[block] : offset[block + 1]]
            first = np.maximum(np.ceil((outline.min(axis=0) - self.low) / self.cell).astype(int), 0)
            last = np.minimum(np.floor((outline.max(axis=0) - self.low) / self.cell).astype(int), np.array(shape) - 1)
            if (last < first).any():
                continue
            i, j = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)), indexing="ij")
            places = self.low + self.cell * np.column_stack([i.ravel(), j.ravel()])
            hit = Path(outline).contains_points(places)
            self.inside[i.ravel()[hit], j.ravel()[hit]] = True
            stress[i.ravel()[hit], j.ravel()[hit]] = frame.stress[block]
        size = float(np.median(np.sqrt(frame.results.block_area[frame.active]))) / self.cell
        self.stress = self._smooth(stress, max(1, round(0.5 * size)))

    def _smooth(self, stress: FloatArray, reach: int) -> FloatArray:
        """Means over squares of 2 reach + 1 nodes, twice, of those within blocks."""
        weight = self.inside.astype(float)
        total = stress * weight[..., None]
        for _ in range(2):
            for axis in (0, 1):
                total, weight = (_box(array, reach, axis) for array in (total, weight))
        return total / np.maximum(weight, 1e-300)[..., None]

    def at(self, place: FloatArray) -> FloatArray | None:
        """Stress at a place, linear between nodes; None outside of all blocks."""
        where = (place - self.low) / self.cell
        i, j = np.floor(where).astype(int)
        if not (0 <= i < self.inside.shape[0] - 1 and 0 <= j < self.inside.shape[1] - 1):
            return None
        if not self.inside[round(where[0]), round(where[1])]:
            return None
        u, v = where - (i, j)
        s = self.stress
        found: FloatArray = (1 - v) * ((1 - u) * s[i, j] + u * s[i + 1, j]) + v * (
            (1 - u) * s[i, j + 1] + u * s[i + 1, j + 1]
        )
        return found


def _box(array: FloatArray, reach: int, axis: int) -> FloatArray:
    """Sums over 2 reach + 1 neighbours along an axis."""
    padded = np.pad(array, [(reach + 1, reach) if i == axis else (0, 0) for i in range(array.ndim)])
    sums = np.cumsum(padded, axis=axis)
    n = array.shape[axis]
    return np.take(sums, range(2 * reach + 1, 2 * reach + 1 + n), axis) - np.take(sums, range(n), axis)


def _direction(stress: FloatArray, smallest: bool) -> tuple[FloatArray, float]:
    """Unit vector of the smallest (most compressive) or largest principal stress, and the stress."""
    sx, sy, txy = stress
    angle = 0.5 * np.arctan2(2 * txy, sx - sy) + (np.pi / 2 if smallest else 0.0)
    radius = np.hypot((sx - sy) / 2, txy)
    return np.array([np.cos(angle), np.sin(angle)]), (sx + sy) / 2 - radius * (1 if smallest else -1)


def _walk(grid: _Grid, start: FloatArray, smallest: bool, sign: float, taken: IntArray, number: int) -> list[Any]:
    """Places and stresses from a start on, to the rim of the blocks or near another trajectory; midpoint rule."""
    place, before, found = start, None, []
    for _ in range(int(4 * CELLS / STEP)):
        here = grid.at(place)
        if here is None:
            break
        cell = tuple(np.floor((place - grid.low) / (0.5 * APART * grid.cell)).astype(int))
        if taken[cell] not in (0, number):
            break
        taken[cell] = number
        along, stress = _direction(here, smallest)
        if before is None:
            before = sign * along
        along = along if along @ before >= 0 else -along
        found.append((place, stress))
        middle = grid.at(place + 0.5 * STEP * grid.cell * along)
        if middle is None:
            break
        half, _ = _direction(middle, smallest)
        before = half if half @ along >= 0 else -half
        place = place + STEP * grid.cell * before
    return found


def trajectories(
    results: Results, frame: int = -1, *, axes: Axes | None = None, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """Trajectories of the principal stresses, smoothed over neighbouring blocks: lines along the most compressive one
    and, thin, across it; compression and tension by colour."""
    from matplotlib.lines import Line2D

    now, units = results.frames[frame], Units.parse(units, results)
    grid = _Grid(now)
    middle = np.argsort(np.hypot(*(np.argwhere(grid.inside) - np.array(grid.inside.shape) / 2).T), kind="stable")
    seeds = grid.low + grid.cell * np.argwhere(grid.inside)[middle]
    with frame_map(results, now, axes, units, title) as axes:
        for smallest, width in ((False, 0.6), (True, 1.2)):
            taken = np.zeros(tuple(int(n / (0.5 * APART)) + 2 for n in grid.inside.shape), dtype=np.int64)
            for number, seed in enumerate(seeds, 1):
                cell = np.floor((seed - grid.low) / (0.5 * APART * grid.cell)).astype(int)
                around = taken[max(cell[0] - 1, 0) : cell[0] + 2, max(cell[1] - 1, 0) : cell[1] + 2]
                if around.any():
                    continue
                forth = _walk(grid, seed, smallest, 1.0, taken, number)
                back = _walk(grid, seed, smallest, -1.0, taken, number)
                path = back[:0:-1] + forth
                if len(path) < 2 * APART / STEP:
                    continue
                places = np.array([place for place, _ in path])
                tension = np.array([stress > 0 for _, stress in path])[1:]
                colours = np.where(tension, TENSION, COMPRESSION)
                strokes = np.stack([places[:-1], places[1:]], axis=1)
                add_strokes(axes, strokes, colors=colours, linewidths=width, capstyle="round", zorder=3)
        kinds = ((COMPRESSION, 1.2, "most compressive"), (COMPRESSION, 0.6, "across it"), (TENSION, 1.2, "tension"))
        handles = [Line2D([], [], color=colour, lw=width) for colour, width, _ in kinds]
        axes.legend(handles, [text for *_, text in kinds], loc="upper left", bbox_to_anchor=(1.01, 1))
    return axes
