# SPDX-License-Identifier: MIT
"""Outlines of blocks with islands: one polygon with bridges, as the program keeps them, or an outer ring and holes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from .arrays import FloatArray, IntArray

Point = tuple[float, float]


def after_on_block(offset: IntArray) -> IntArray:
    """(nv,) the vertex that follows each one on the outline of its block."""
    after = np.arange(1, offset[-1] + 1)
    after[offset[1:] - 1] = offset[:-1]
    return after


def signed_area(corners: FloatArray) -> float:
    """The area of a ring, positive where it runs counter-clockwise."""
    x, y = (corners - corners[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def rings_of(corners: FloatArray) -> list[IntArray]:
    """The simple rings of an outline that walks bridges to islands, as indices of corners: the outer one, then holes.

    The outline comes back to the same point at both ends of a bridge, and where an island touches it. The ring between
    two such visits is taken out; that of a bridge, there and back, has no area."""
    places = list(map(tuple, corners.tolist()))
    if len(set(places)) == len(places):
        return [np.arange(len(places))]
    rings: list[list[int]] = []
    path: list[int] = []
    at: dict[tuple[float, ...], int] = {}  # where the path visits a point
    for index in [*range(len(places)), 0]:
        place = places[index]
        if place in at and path:
            begin = at[place]
            ring, path = path[begin:], path[:begin]
            for gone in ring:
                at.pop(places[gone], None)
            if len(ring) > 2:
                rings.append(ring)
        at[place] = len(path)
        path.append(index)
    found = [np.array(ring) for ring in rings]
    return sorted(found, key=lambda ring: -signed_area(corners[ring]))


def split_outlines(vertices: FloatArray, offset: IntArray) -> list[list[IntArray]]:
    """The rings of all blocks, as indices of vertices."""
    pairs = itertools.pairwise(offset.tolist())
    return [[begin + ring for ring in rings_of(vertices[begin:end])] for begin, end in pairs]


def bridged(rings: Sequence[Sequence[Point]]) -> tuple[list[Point], list[bool]]:
    """One outline of a counter-clockwise outer ring and its clockwise holes, and which of its edges are bridges.

    Each hole is joined, from the one that reaches farthest to the right, at its rightmost corner to a corner of the
    outline that is seen from there (D. Eberly, Triangulation by ear clipping); without a bridge where they touch."""
    outline = list(rings[0])
    is_bridge = [False] * len(outline)
    for hole in sorted(rings[1:], key=lambda ring: -max(ring)[0]):
        touching = next((corner for corner in hole if corner in set(outline)), None)
        start = touching if touching is not None else max(hole)
        k = hole.index(start)
        turned = [*hole[k:], *hole[:k]]
        if touching is not None:
            at = outline.index(start)
            outline[at:at] = turned
            is_bridge[at:at] = [False] * len(turned)
            continue
        at = _seen(outline, start)
        outline[at + 1 : at + 1] = [*turned, start, outline[at]]
        edges = [*[False] * len(turned), True, is_bridge[at]]
        is_bridge[at] = True
        is_bridge[at + 1 : at + 1] = edges
    return outline, is_bridge


def _seen(outline: list[Point], point: Point) -> int:
    """Index of a corner of the outline around a point that a line from it to the right, or above it, reaches."""
    a = np.array(outline)
    b = np.roll(a, -1, axis=0)
    x, y = point
    # edges that run upwards have the inside on their left, the side of the point
    crossed = np.flatnonzero((a[:, 1] <= y) & (b[:, 1] > y) | (a[:, 1] < y) & (b[:, 1] >= y))
    width = b[crossed, 0] - a[crossed, 0]
    reached = a[crossed, 0] + (y - a[crossed, 1]) / (b[crossed, 1] - a[crossed, 1]) * width
    crossed, reached = crossed[reached >= x], reached[reached >= x]
    if not len(crossed):
        raise ValueError(f"the hole at {x:g}, {y:g} does not lie inside the outline")
    nearest = int(np.argmin(reached))
    edge, limit = int(crossed[nearest]), float(reached[nearest])
    following = (edge + 1) % len(outline)
    corner = edge if a[edge, 0] > b[edge, 0] else following
    triangle = np.array([point, (limit, y), outline[corner]])
    if triangle[2, 1] < y:
        triangle = triangle[[0, 2, 1]]
    inside = np.ones(len(a), dtype=bool)
    for p, q in itertools.pairwise([*triangle, triangle[0]]):
        inside &= (q[0] - p[0]) * (a[:, 1] - p[1]) - (q[1] - p[1]) * (a[:, 0] - p[0]) >= 0
    turn = _turns(a)
    candidates = [int(k) for k in np.flatnonzero(inside & (turn <= 0)) if outline[k] != outline[corner]]
    candidates.append(corner)
    best = min(candidates, key=lambda k: (_slope(point, outline[k]), math.dist(point, outline[k])))
    # of several visits to this corner, the one within whose angle the point lies
    visits = [k for k, place in enumerate(outline) if place == outline[best]]
    return next((k for k in visits if _opens_to(outline, k, point)), best)


def _slope(point: Point, corner: Point) -> float:
    return abs(math.atan2(corner[1] - point[1], corner[0] - point[0]))


def _turns(corners: FloatArray) -> FloatArray:
    """Positive where the outline turns left."""
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    turns: FloatArray = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return turns


def _opens_to(outline: list[Point], k: int, point: Point) -> bool:
    """Does the inside of a corner's angle hold the direction to a point?"""
    corner = outline[k]
    ahead, behind = outline[(k + 1) % len(outline)], outline[k - 1]
    angle = [math.atan2(p[1] - corner[1], p[0] - corner[0]) for p in (ahead, point, behind)]
    turn = [(value - angle[0]) % (2 * math.pi) for value in angle[1:]]
    return turn[0] <= turn[1] or turn[1] == 0


def triangles(corners: FloatArray) -> IntArray:
    """(n - 2, 3) indices of the triangles of an outline, with or without bridges, by clipping ears."""
    left = np.arange(len(corners))
    found: list[tuple[int, int, int]] = []
    k = 0
    refused = 0
    while len(left) > 3:
        n = len(left)
        before, here, after = left[k - 1], left[k % n], left[(k + 1) % n]
        if refused >= n or _is_ear(corners, left, before, here, after):
            found.append((int(before), int(here), int(after)))
            left = np.delete(left, k % n)
            k, refused = k % len(left), 0
        else:
            k, refused = (k + 1) % n, refused + 1
    found.append((int(left[0]), int(left[1]), int(left[2])))
    return np.array(found)


def _is_ear(corners: FloatArray, left: IntArray, before: int, here: int, after: int) -> bool:
    """Does the corner between two others stand out, with nothing of the outline in its triangle?"""
    a, b, c = corners[[before, here, after]]
    if (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) <= 0:
        return False
    points = corners[left]
    inside = np.ones(len(points), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (q[0] - p[0]) * (points[:, 1] - p[1]) - (q[1] - p[1]) * (points[:, 0] - p[0]) >= 0
        inside &= (points != p).any(axis=1)
    return not inside.any()
