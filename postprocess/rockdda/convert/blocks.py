# SPDX-License-Identifier: MIT
"""Polygons as blocks, without cutting: a block file (.blk)."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from ..deck import number_text
from ..rings import bridged
from .geometry import Geometry, Point, Ring
from .regions import close_chains, polygon_of
from .report import Report

FEW_DIGITS = 1e-5  # of the size of the smaller block: files may have six digits, as src/io/text/block_check.f90 says
MOST_NAMED = 10  # pairs of blocks that overlap


def check_blocks(geometry: Geometry, report: Report) -> None:
    """Make the polygons simple and counter-clockwise; errors for those that are none, warnings for what no block takes.

    Blocks within others, and openings in them, are holes of these. Lines beside blocks are left out, and so are points
    outside of them."""
    blocks = []
    for material, joint, rings in geometry.blocks:
        polygon = polygon_of("block", rings, report)
        if not polygon.is_empty:
            blocks.append((material, joint, polygon))
    openings = _openings(geometry, report)
    _leave_lines(geometry, report)
    report.raise_errors()
    polygons = _with_holes([polygon for _, _, polygon in blocks], openings, report)
    report.raise_errors()
    blocks = [(material, joint, polygon) for (material, joint, _), polygon in zip(blocks, polygons, strict=True)]
    geometry.blocks = [(material, joint, _rings(polygon)) for material, joint, polygon in blocks]
    tree = shapely.STRtree(polygons)
    _find_overlaps(tree, polygons, geometry.e0, report)
    for name in ("loading", "measured", "fixed"):
        points = getattr(geometry, name)
        inside = [point for point in points if _block_at(tree, point[:2])]
        if missing := len(points) - len(inside):
            report.warning(f"{missing} {name} points lie in no block and are left out")
            report.leave(f"{name} point outside of blocks", f"{name} points outside of blocks", missing)
            setattr(geometry, name, inside)


def _find_overlaps(tree: Any, polygons: list[Any], e0: float, report: Report) -> None:
    """Warn of blocks that have an area in common wider than e0, and than FEW_DIGITS, which no run takes."""
    one, other = tree.query(polygons)
    one, other = one[one < other], other[one < other]
    blocks = np.array(polygons, dtype=object)
    areas, boxes = shapely.area(blocks), shapely.bounds(blocks)
    width = np.maximum(e0, FEW_DIGITS * np.sqrt(np.minimum(areas[one], areas[other])))
    sides = np.minimum(boxes[one, 2:], boxes[other, 2:]) - np.maximum(boxes[one, :2], boxes[other, :2])
    wide = np.all(sides > width[:, None], axis=1)
    one, other, width = one[wide], other[wide], width[wide]
    common = shapely.intersection(blocks[one], blocks[other])
    deep = shapely.buffer(common, -0.5 * width)
    found = np.flatnonzero(~shapely.is_empty(deep)).tolist()
    for pair in found[:MOST_NAMED]:
        i, k, area, place = one[pair], other[pair], common[pair].area, deep[pair].representative_point()
        report.warning(f"blocks {i + 1} and {k + 1} overlap near {place.x:g}, {place.y:g}, by an area of {area:.3g}")
    if len(found) > MOST_NAMED:
        report.warning(f"{len(found) - MOST_NAMED} more pairs of blocks overlap")


def _openings(geometry: Geometry, report: Report) -> list[Any]:
    """The polygons of openings, which are taken out of the geometry."""
    chains = [chain for kind, _, chain in geometry.chains if kind == "opening"]
    rings = [rings for kind, _, rings in geometry.regions if kind == "opening"]
    rings += [[ring] for ring in close_chains(chains, geometry.e0, "opening", report)]
    geometry.chains = [entry for entry in geometry.chains if entry[0] != "opening"]
    geometry.regions = [entry for entry in geometry.regions if entry[0] != "opening"]
    polygons = [polygon_of("opening", entry, report) for entry in rings]
    return [polygon for polygon in polygons if not polygon.is_empty]


def _with_holes(polygons: list[Any], openings: list[Any], report: Report) -> list[Any]:
    """The polygons without the blocks that lie within them, and each opening taken out of the smallest one around."""
    found = np.array(polygons, dtype=object)
    if not len(found):
        return []
    areas = shapely.area(found)
    tree = shapely.STRtree(found)
    within = 0
    for outer, inner in tree.query(found, predicate="contains_properly").T.tolist():
        within += 1
        found[outer] = found[outer].difference(shapely.Polygon(polygons[inner].exterior))
    if within:
        report.note(f"blocks lie within others, which have holes there: {within}")
    shapely.prepare(found)
    for opening in openings:
        around = [
            int(k)
            for k in tree.query(opening, predicate="intersects")
            if areas[k] > opening.area * (1 + 1e-9) and shapely.contains(shapely.Polygon(polygons[k].exterior), opening)
        ]
        if around:
            smallest = min(around, key=lambda k: areas[k])
            found[smallest] = found[smallest].difference(opening)
        else:
            x, y = opening.exterior.coords[0]
            report.warning(f"the opening at {x:g}, {y:g} lies in no block and is left out")
            report.leave("opening outside of blocks", "openings outside of blocks")
    for before, after in zip(polygons, found, strict=True):
        if after.geom_type != "Polygon" or after.is_empty:
            x, y = before.exterior.coords[0]
            report.error(f"the block at {x:g}, {y:g} falls apart, or is filled, by what lies within it")
    return list(found)


def _rings(polygon: Any) -> list[Ring]:
    """The corners of a polygon, the outer ring counter-clockwise, holes clockwise."""
    turned = orient(polygon)
    return [[(x, y) for x, y in ring.coords[:-1]] for ring in (turned.exterior, *turned.interiors)]


def _leave_lines(geometry: Geometry, report: Report) -> None:
    """Leave out what only cutting takes."""
    lines = [place for place in geometry.fixed if place[:2] != place[2:]]
    for one, many, count in (
        ("line", "lines", len(geometry.lines)),
        ("material line", "material lines", len(geometry.material_lines)),
        ("area", "areas", len(geometry.regions) + len(geometry.chains)),
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
    tree = shapely.STRtree([shapely.Polygon(rings[0], rings[1:]) for _, _, rings in geometry.blocks])
    outlines = [(material, joint, *bridged(rings)) for material, joint, rings in geometry.blocks]

    def row(*values: float) -> str:
        return " ".join(number_text(value) for value in values)

    def points(places: list[Point]) -> list[str]:
        return [f"{row(*place)} {_block_at(tree, place)}" for place in places]

    values = geometry.bolt_values or (0.0, 0.0, 0.0)
    out = ["rockdda-blocks 1", f"# {title}", f"e0 {number_text(geometry.e0)}", f"blocks {len(geometry.blocks)}"]
    out += [f"vertices {sum(len(ring) for _, _, ring, _ in outlines)}", f"fixed {len(geometry.fixed)}"]
    out += [f"loading {len(geometry.loading)}", f"measured {len(geometry.measured)}", f"bolts {len(geometry.bolts)}"]
    for number, (material, joint, ring, is_bridge) in enumerate(outlines, start=1):
        out.append(f"block {number} {material} {len(ring)}")
        out += [f"{row(*corner)} {0 if bridge else joint}" for corner, bridge in zip(ring, is_bridge, strict=True)]
    out += ["fixed_points", *points([place[:2] for place in geometry.fixed])]
    out += ["loading_points", *points(geometry.loading), "measured_points", *points(geometry.measured), "bolt_list"]
    for x1, y1, x2, y2 in geometry.bolts:
        ends = f"{_block_at(tree, (x1, y1))} {_block_at(tree, (x2, y2))}"
        out.append(f"{row(x1, y1, x2, y2)} {ends} {row(*values)}")
    return "\n".join([*out, "end"]) + "\n"
