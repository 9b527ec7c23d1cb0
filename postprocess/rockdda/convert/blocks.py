# SPDX-License-Identifier: MIT
"""Polygons as blocks, without cutting: a block file (.blk)."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ..deck import number_text
from .geometry import Geometry, Point
from .report import Report


def check_blocks(geometry: Geometry, report: Report) -> None:
    """Make the polygons simple and counter-clockwise; errors for those that are none, warnings for what no block takes.

    Lines beside blocks are left out, and so are points outside of them.
    """
    blocks = []
    for material, joint, ring in geometry.blocks:
        corners = [corner for k, corner in enumerate(ring) if corner != ring[k - 1]]
        where = f"the block at {ring[0][0]:g}, {ring[0][1]:g}" if ring else "a block"
        polygon = shapely.Polygon(corners) if len(corners) > 2 else shapely.Polygon()
        if not polygon.is_valid:
            report.error(f"{where} is no simple polygon: {shapely.is_valid_reason(polygon)}")
        elif not polygon.area > 0:
            report.error(f"{where} has no area")
        else:
            blocks.append((material, joint, corners if polygon.exterior.is_ccw else corners[::-1]))
    geometry.blocks = blocks
    _leave_lines(geometry, report)
    report.raise_errors()
    tree = shapely.STRtree([shapely.Polygon(ring) for _, _, ring in blocks])
    for name in ("loading", "measured"):
        points = getattr(geometry, name)
        inside = [point for point in points if _block_at(tree, point)]
        if len(inside) < len(points):
            report.warning(f"{len(points) - len(inside)} {name} points lie in no block and are left out")
            report.leave(
                f"{name} point outside of blocks", f"{name} points outside of blocks", len(points) - len(inside)
            )
            setattr(geometry, name, inside)
    held = [place for place in geometry.fixed if _block_at(tree, place[:2])]
    if len(held) < len(geometry.fixed):
        report.warning(f"{len(geometry.fixed) - len(held)} fixed points lie in no block and are left out")
        report.leave("fixed point outside of blocks", "fixed points outside of blocks", len(geometry.fixed) - len(held))
        geometry.fixed = held


def _leave_lines(geometry: Geometry, report: Report) -> None:
    """Leave out what only cutting takes."""
    lines = [place for place in geometry.fixed if place[:2] != place[2:]]
    for one, many, count in (
        ("line", "lines", len(geometry.lines)),
        ("material line", "material lines", len(geometry.material_lines)),
        ("area or opening", "areas or openings", len(geometry.regions) + len(geometry.chains)),
        ("fixed line", "fixed lines (&boundary holds edges)", len(lines)),
        ("hole point", "hole points", len(geometry.holes)),
    ):
        if count:
            report.warning(
                f"{count} {one if count == 1 else many} beside the blocks: left out, since blocks are not cut"
            )
            report.leave(f"{one} beside blocks", f"{many} beside blocks", count)
    geometry.fixed = [place for place in geometry.fixed if place[:2] == place[2:]]
    geometry.boundary, geometry.joints, geometry.material_lines, geometry.holes = [], [], [], []
    geometry.regions, geometry.chains = [], []


def _block_at(tree: shapely.STRtree, point: Point) -> int:
    """Number of the block that holds a point, from 1; 0 for none. Of several on whose edges it lies the first."""
    found: Any = tree.query(shapely.Point(point), predicate="intersects")
    return int(np.min(found)) + 1 if len(found) else 0


def blocks_text(geometry: Geometry, title: str) -> str:
    """The block file."""
    tree = shapely.STRtree([shapely.Polygon(ring) for _, _, ring in geometry.blocks])

    def row(*values: float) -> str:
        return " ".join(number_text(value) for value in values)

    def points(places: list[Point]) -> list[str]:
        return [f"{row(*place)} {_block_at(tree, place)}" for place in places]

    values = geometry.bolt_values or (0.0, 0.0, 0.0)
    out = ["rockdda-blocks 1", f"# {title}", f"e0 {number_text(geometry.e0)}", f"blocks {len(geometry.blocks)}"]
    out += [f"vertices {sum(len(ring) for _, _, ring in geometry.blocks)}", f"fixed {len(geometry.fixed)}"]
    out += [f"loading {len(geometry.loading)}", f"measured {len(geometry.measured)}", f"bolts {len(geometry.bolts)}"]
    for number, (material, joint, ring) in enumerate(geometry.blocks, start=1):
        out += [f"block {number} {material} {len(ring)}", *(f"{row(*corner)} {joint}" for corner in ring)]
    out += ["fixed_points", *points([place[:2] for place in geometry.fixed])]
    out += ["loading_points", *points(geometry.loading), "measured_points", *points(geometry.measured), "bolt_list"]
    for x1, y1, x2, y2 in geometry.bolts:
        ends = f"{_block_at(tree, (x1, y1))} {_block_at(tree, (x2, y2))}"
        out.append(f"{row(x1, y1, x2, y2)} {ends} {row(*values)}")
    return "\n".join([*out, "end"]) + "\n"
