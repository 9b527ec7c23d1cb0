# SPDX-License-Identifier: MIT
"""Areas and openings: lines are clipped to the areas, and nothing stays in an opening.

The rock is the union of the areas without the openings (without areas: everything outside the openings). Its outline
becomes boundary lines with the joint materials of the areas and openings; edges between two areas stay. What the
outline encloses that is no rock gets a hole point.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiPolygon, Polygon

from ..arrays import AnyArray, FloatArray
from .geometry import Geometry, Ring, Segment
from .report import Report

Lines = list[tuple[Segment, int]]
NEAR = 0.01  # of the extent: areas that are nearer, or overlap by less, were probably drawn to meet
MOST_NAMED = 10  # of each kind


def apply_regions(geometry: Geometry, report: Report) -> None:
    """Turn areas and openings into boundary lines and hole points, and clip joints and boundary lines to the rock."""
    if not geometry.regions and not geometry.chains:
        return
    polygons = [(kind, material, polygon_of(kind, rings, report)) for kind, material, rings in geometry.regions]
    for kind, material in dict.fromkeys((kind, material) for kind, material, _ in geometry.chains):
        chains = [chain for k, m, chain in geometry.chains if (k, m) == (kind, material)]
        rings = close_chains(chains, geometry.e0, kind, report)
        polygons += [(kind, material, polygon_of(kind, [ring], report)) for ring in rings]
    report.raise_errors()
    areas = [polygon for kind, _, polygon in polygons if kind == "area"]
    openings = [polygon for kind, _, polygon in polygons if kind == "opening"]
    area = shapely.union_all(areas) if len(areas) > 1 else areas[0] if areas else None
    opening = shapely.union_all(openings) if len(openings) > 1 else openings[0] if openings else None
    rock = area
    if area is not None and opening is not None:
        rock = area.difference(opening)
    if len(areas) > 1:
        _warn_of_strips(areas, area, geometry.e0, NEAR * geometry.extent, report)
    if rock is not None and rock.is_empty:
        report.fail("the openings leave nothing of the areas")
    shortest = 1e-9 * geometry.extent
    for name in ("boundary", "joints"):
        before = getattr(geometry, name)
        after = _clip(before, rock, opening, shortest)
        setattr(geometry, name, after)
        if before and before != after:
            what = "boundary lines" if name == "boundary" else "lines"
            where = " and ".join(["the areas"] * bool(areas) + ["the openings"] * bool(openings))
            outside = _length(before) - _length(after)
            if outside > shortest:
                report.leave("", f"{outside:.6g} of the length of {what}, which lies outside", 0)
            report.note(f"{len(before)} {what} are clipped by {where}: {len(after)} are left")
    sources = [(polygon, material) for _, material, polygon in polygons]
    inner = _edges([(polygon, material) for kind, material, polygon in polygons if kind == "area"])
    outline = rock if rock is not None else opening
    assert outline is not None
    geometry.boundary += _with_materials(_rings_of(outline), sources, shortest)
    if len(areas) > 1:
        geometry.boundary += _clip(inner, rock, opening, shortest)
    holes = _holes(rock) if rock is not None else _parts(opening)
    geometry.holes += [(point.x, point.y) for point in (part.representative_point() for part in holes)]
    geometry.regions, geometry.chains = [], []


def _warn_of_strips(areas: list[Any], union: Any, least: float, most: float, report: Report) -> None:
    """Warn of pairs of areas with a gap or a strip in common of a width from `least` to `most`."""
    tree, polygons = shapely.STRtree(areas), np.array(areas, dtype=object)
    one, other = tree.query(areas, predicate="dwithin", distance=most)
    one, other = one[one < other], other[one < other]
    bridges = shapely.shortest_line(polygons[one], polygons[other])
    width, middles = shapely.length(bridges), shapely.line_interpolate_point(bridges, 0.5, normalized=True)
    common = shapely.intersection(polygons[one], polygons[other])
    shapely.prepare(union)
    gap = (width > least) & ~shapely.intersects(union, middles)
    wide, thin = (shapely.is_empty(shapely.buffer(common, -0.5 * limit)) for limit in (least, most))
    inside = shapely.point_on_surface(common)
    for what, found, places in (
        ("do not meet: there is a gap", gap, middles),
        ("overlap in a strip, whose both edges stay,", thin & ~wide, inside),
    ):
        numbers = np.flatnonzero(found).tolist()
        for k in numbers[:MOST_NAMED]:
            report.warning(f"areas {one[k] + 1} and {other[k] + 1} {what} near {places[k].x:g}, {places[k].y:g}")
        if len(numbers) > MOST_NAMED:
            report.warning(f"{len(numbers) - MOST_NAMED} more pairs of areas {what.rstrip(',')}")


def polygon_of(kind: str, rings: list[Ring], report: Report) -> Any:
    """A polygon of an outer ring and holes; an empty one after an error."""
    x, y = rings[0][0] if rings and rings[0] else (math.nan, math.nan)
    where = f"{'an' if kind[0] in 'aeiou' else 'a'} {kind} at {x:g}, {y:g}"
    if any(len(set(ring)) < 3 for ring in rings):
        report.error(f"{where} has fewer than three corners")
        return Polygon()
    polygon = Polygon(rings[0], rings[1:])
    if not polygon.is_valid:
        report.error(f"{where} is no simple polygon: {shapely.is_valid_reason(polygon)}")
    elif not polygon.area > 0:
        report.error(f"{where} has no area")
    else:
        return shapely.remove_repeated_points(polygon)
    return Polygon()


def close_chains(chains: list[Ring], tolerance: float, kind: str, report: Report) -> list[Ring]:
    """Put lines together to closed rings where their ends are nearer than a tolerance; errors for what stays open."""
    rings: list[Ring] = []
    pieces: list[Ring] = []
    for chain in chains:
        corners = [corner for corner, _ in itertools.groupby(chain)]
        if len(corners) > 1:
            closed = len(corners) > 3 and _distance(corners[0], corners[-1]) <= tolerance
            (rings if closed else pieces).append(corners)
    ends = np.array([end for piece in pieces for end in (piece[0], piece[-1])]).reshape(-1, 2)
    tree = shapely.STRtree(shapely.points(ends))
    used = [False] * len(pieces)
    for first in range(len(pieces)):
        if used[first]:
            continue
        used[first] = True
        ring = list(pieces[first])
        while not (len(ring) > 2 and _distance(ring[0], ring[-1]) <= tolerance):
            near = tree.query(shapely.Point(ring[-1]), predicate="dwithin", distance=tolerance)
            following = min(
                (int(end) for end in near if not used[end // 2]),
                key=lambda end: (_distance(ring[-1], tuple(ends[end])), end),
                default=None,
            )
            if following is None:
                x, y = ring[-1]
                report.error(f"the lines of kind {kind} do not close to polygons: there is an open end at {x:g}, {y:g}")
                break
            used[following // 2] = True
            piece = pieces[following // 2]
            ring += (piece if following % 2 == 0 else piece[::-1])[1:]
        else:
            rings.append(ring)
    return [[*ring[:-1], ring[0]] for ring in rings]


def _distance(a: Any, b: Any) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


def _length(lines: Lines) -> float:
    return sum(_distance(line[:2], line[2:]) for line, _ in lines)


def _edges(sources: list[tuple[Any, int]]) -> Lines:
    """The edges of polygons."""
    return [(edge, material) for polygon, material in sources for edge in _rings_of(polygon)]


def _parts(shape: Any) -> list[Any]:
    """The polygons of a shape."""
    return [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]


def _rings_of(shape: Any) -> list[Segment]:
    """The edges of all rings of a shape."""
    found: list[Segment] = []
    for part in _parts(shape):
        for ring in (part.exterior, *part.interiors):
            found += [(*a, *b) for a, b in itertools.pairwise(map(tuple, ring.coords)) if a != b]
    return found


def _holes(rock: Any) -> list[Any]:
    """Areas inside the outline of the rock that are no rock."""
    parts = _parts(rock)
    rings = [Polygon(ring) for part in parts for ring in part.interiors]
    islands: list[list[Any]] = [[] for _ in rings]
    for ring, part in shapely.STRtree(parts).query(np.array(rings, dtype=object), predicate="contains").T.tolist():
        islands[ring].append(parts[part])
    within = zip(rings, islands, strict=True)
    return [part for ring, inside in within for part in _parts(ring.difference(MultiPolygon(inside)))]


def _clip(lines: Lines, rock: Any, opening: Any, shortest: float) -> Lines:
    """The parts of lines in the rock, without those on its outline; what nothing cuts stays as it is."""
    if not lines:
        return []
    region = opening if rock is None else rock
    outline = shapely.STRtree(_segments(_rings_of(region)))
    number, pieces = _pieces(np.array([line for line, _ in lines], dtype=float), outline, shortest)
    middles = shapely.points((pieces[:, :2] + pieces[:, 2:]) / 2)
    shapely.prepare(region)
    left = shapely.contains(region, middles) == (rock is not None)
    left[outline.query(middles, predicate="dwithin", distance=shortest)[0]] = False
    kept = zip(number[left].tolist(), pieces[left].tolist(), strict=True)
    return [((x1, y1, x2, y2), lines[i][1]) for i, (x1, y1, x2, y2) in kept]


def _pieces(lines: FloatArray, outline: shapely.STRtree, shortest: float) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Lines, cut where an outline crosses them or has a corner on them: number of the line and ends of each piece."""
    line, edge = outline.query(_segments(lines), predicate="dwithin", distance=shortest)
    start, along = lines[:, :2], lines[:, 2:] - lines[:, :2]
    length = np.maximum(np.hypot(*along.T), np.finfo(float).tiny)
    ends = shapely.get_coordinates(outline.geometries[edge]).reshape(-1, 2, 2)
    step, side = along[line], ends[:, 1] - ends[:, 0]
    share = [np.zeros(len(lines)), np.ones(len(lines))]
    point, owner = [start, lines[:, 2:]], [np.arange(len(lines))] * 2
    for k in range(2):
        away = ends[:, k] - start[line]
        here = np.clip(np.einsum("ij,ij->i", away, step) / length[line] ** 2, 0, 1)
        on = np.hypot(*(away - here[:, None] * step).T) <= shortest
        share, point, owner = [*share, here[on]], [*point, ends[on, k]], [*owner, line[on]]
    with np.errstate(divide="ignore", invalid="ignore"):  # parallel edges do not cross: only their corners count
        here, there = (_cross(ends[:, 0] - start[line], other) / _cross(step, side) for other in (side, step))
    on = (here > 0) & (here < 1) & (there > 0) & (there < 1)
    share, point, owner = [*share, here[on]], [*point, (start[line] + here[:, None] * step)[on]], [*owner, line[on]]
    owners, points = np.concatenate(owner), np.concatenate(point)
    order = np.lexsort((np.concatenate(share), owners))
    owners, points = owners[order], points[order]
    pieces = np.hstack([points[:-1], points[1:]])
    good = (owners[:-1] == owners[1:]) & (np.hypot(*(points[1:] - points[:-1]).T) > shortest)
    return owners[:-1][good], pieces[good]


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _segments(lines: Any) -> AnyArray:
    """Lines of two points."""
    return np.asarray(shapely.linestrings(np.asarray(lines, dtype=float).reshape(-1, 2, 2)), dtype=object)


def _with_materials(edges: list[Segment], sources: list[tuple[Any, int]], shortest: float) -> Lines:
    """Edges with the material of the outline that they lie on; the first one where there are several."""
    materials = {material for _, material in sources}
    if len(materials) == 1:
        return [(edge, next(iter(materials))) for edge in edges]
    outlines = _edges(sources)
    tree = shapely.STRtree(_segments([edge for edge, _ in outlines]))
    middles = shapely.points([((x1 + x2) / 2, (y1 + y2) / 2) for x1, y1, x2, y2 in edges])
    number, nearest = tree.query_nearest(middles)
    first = {int(i): int(k) for i, k in sorted(zip(number, nearest, strict=True), reverse=True)}
    return [(edge, outlines[first[i]][1]) for i, edge in enumerate(edges) if _distance(edge[:2], edge[2:]) > shortest]
