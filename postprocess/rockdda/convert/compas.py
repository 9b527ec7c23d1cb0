# SPDX-License-Identifier: MIT
"""Blocks from JSON files of COMPAS: meshes, assemblies of blocks, polygons.

Each face of a flat mesh is a block; a mesh in space (a voussoir of an assembly) is the outline that it shows from the
side. Files of COMPAS 1 and 2 are read; the plane is x-y where the model is flat in z, else x-z.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from ..arrays import FloatArray
from ..errors import InputError
from ..text import read_text, shown
from .geometry import Geometry
from .report import MOST_LINES, Report, read_json

FLAT = 1e-9  # of the extent
LARGEST = 1e30
BETWEEN = ("edge", "edges", "edgedata", "interface", "interfaces", "interactions", "contacts")  # of blocks
OTHERS = ("Line", "Polyline", "Polyhedron", "Box", "Circle", "Ellipse", "Sphere", "Cylinder", "Cone", "Capsule",
          "Torus", "NurbsCurve", "NurbsSurface", "Brep", "Pointcloud", "VolMesh", "CellNetwork")  # fmt: skip


def is_compas(head: str) -> bool:
    """Does a JSON text name a type of COMPAS near its beginning?"""
    return "compas" in head and ("dtype" in head or "datatype" in head)


def read_compas(path: Path) -> tuple[Geometry, Report]:
    """The blocks of a JSON file of COMPAS, all of material 1; supports are fixed at two points inside."""
    text = read_text(path)
    report, geometry = Report(path, text), Geometry()
    meshes: list[Mesh] = []
    data = read_json(path, text, report)
    try:
        for mesh in _shapes(data, report, False, 0):
            meshes.append(mesh)
            if len(meshes) > MOST_LINES:
                raise InputError(f"has more than {MOST_LINES} meshes", path)
    except (RecursionError, KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError) as error:
        raise InputError(f"cannot be read as JSON of COMPAS: {type(error).__name__}: {shown(error)}", path) from error
    if not meshes:
        report.fail("there is no mesh, polygon or block of COMPAS in the file")
    axes = _plane([mesh.points for mesh in meshes])
    report.note(f"the plane of the model is {'xyz'[axes[0]]}-{'xyz'[axes[1]]}")
    for mesh in meshes:
        flat = mesh.points[:, axes]
        rings = [flat[face] for face in mesh.faces]
        thickness = np.ptp(mesh.points[:, 3 - sum(axes)])
        try:
            if len(rings) > 1 and thickness > FLAT * np.ptp(mesh.points, axis=0).max():
                blocks = [_silhouette(rings)]
                report.take("block in space, by its outline", "blocks in space, by their outlines")
            else:
                blocks = [[ring] for ring in rings]
                report.take("face", "faces", len(rings))
            places = [point for rings in blocks for point in _inside(rings)] if mesh.is_support else []
        except (ValueError, shapely.errors.ShapelyError) as error:
            x, y = flat[0]
            report.error(f"the mesh at {x:g}, {y:g} gives no block: {shown(error)}")
            continue
        geometry.blocks += [(1, 1, [[(float(x), float(y)) for x, y in ring] for ring in rings]) for rings in blocks]
        geometry.fixed += [(*place, *place) for place in places]
    supports = sum(mesh.is_support for mesh in meshes)
    if supports:
        report.note(f"{supports} of {len(meshes)} blocks are supports: each is fixed at two points inside")
    report.raise_errors()
    return geometry, report


@dataclass
class Mesh:
    """FloatArray (n, 3) and the faces on them."""

    points: FloatArray
    faces: list[list[int]]
    is_support: bool = False


def _shapes(data: Any, report: Report, is_support: bool, depth: int) -> Iterator[Mesh]:
    """All meshes and polygons within an object, but for those that are interfaces of blocks."""
    if depth > 50:
        raise ValueError("objects are nested more than 50 times")
    if isinstance(data, list):
        for entry in data:
            yield from _shapes(entry, report, is_support, depth + 1)
        return
    if not isinstance(data, dict):
        return
    inner = data.get("data", data.get("value"))
    kind = str(data.get("dtype", data.get("datatype", ""))).rsplit("/", 1)[-1].rsplit(".", 1)[-1]
    if kind in ("Interface", "Contact", "FrictionContact"):
        report.leave("interface of blocks", "interfaces of blocks")
        return
    is_support = _is_support(data, inner, is_support)
    if isinstance(inner, dict) and "face" in inner and "vertex" in inner:
        mesh = _mesh(inner)
        if mesh.faces:
            mesh.is_support = is_support
            yield mesh
        else:
            report.leave("mesh without faces", "meshes without faces")
    elif kind == "Polygon" and isinstance(inner, dict):
        rows = [(entry.get("data", entry) if isinstance(entry, dict) else entry) for entry in inner["points"]]
        points = [[float(x) for x in (*row, 0.0, 0.0)[:3]] for row in rows]
        if len(points) > 2:
            yield Mesh(_checked(np.array(points)), [list(range(len(points)))], is_support)
        else:
            report.leave("polygon of fewer than three points", "polygons of fewer than three points")
    elif kind in OTHERS:
        report.leave(f"{kind} (not read)", f"{kind} (not read): several")
    else:
        matrix = _matrix(data.get("transformation"))
        moved = 0
        for name, value in data.items():
            if name in BETWEEN:
                if count := _count_between(value):
                    report.leave("interface of blocks", "interfaces of blocks", count)
            elif isinstance(value, dict | list):
                # names of nodes are numbers; what a node is holds for its block only
                for mesh in _shapes(value, report, is_support, depth + 1):
                    mesh.points = _checked(mesh.points @ matrix[:3, :3].T + matrix[:3, 3])
                    moved += 1
                    yield mesh
        if not moved and not np.array_equal(matrix, np.eye(4)):
            # the members of a group stand elsewhere in the file
            raise ValueError("an object without a shape of its own has a transformation: store its members transformed")


def _matrix(transformation: Any) -> FloatArray:
    """The matrix (4, 4) of a transformation; the unit matrix of none."""
    if transformation is None:
        return np.eye(4)
    inner = transformation.get("data", transformation.get("value", transformation))
    matrix = np.array(inner["matrix"], dtype=float)
    if matrix.shape != (4, 4) or not np.array_equal(matrix[3], (0, 0, 0, 1)):
        raise ValueError("a transformation is no matrix of 4 × 4 numbers with the last row 0, 0, 0, 1")
    return _checked(matrix)


def _is_support(data: dict[str, Any], inner: Any, outer: bool) -> bool:
    """Is a node, or the mesh of one, marked as a support?"""
    for owner in (data, inner if isinstance(inner, dict) else {}):
        attributes = owner.get("attributes")
        for place in (owner, attributes if isinstance(attributes, dict) else {}):
            if "is_support" in place:
                return bool(place["is_support"])
    return outer


def _count_between(value: Any) -> int:
    """The number of interfaces on the edges of an assembly."""
    if isinstance(value, list):
        return sum(_count_between(entry) or 1 for entry in value)
    if isinstance(value, dict):
        if "dtype" in value or "datatype" in value:
            return 1
        return sum(_count_between(entry) for entry in value.values())
    return 0


def _mesh(inner: dict[str, Any]) -> Mesh:
    """The points and faces of a mesh."""
    keys = list(inner["vertex"])
    defaults = inner.get("default_vertex_attributes", inner.get("dva", {})) or {}
    points = [[float(inner["vertex"][k].get(a, defaults.get(a, 0.0))) for a in "xyz"] for k in keys]
    number = {str(key).strip("'"): i for i, key in enumerate(keys)}
    rows = inner["face"].values() if isinstance(inner["face"], dict) else inner["face"]
    faces = [[number[str(k).strip("'")] for k in face] for face in rows]
    return Mesh(_checked(np.array(points).reshape(-1, 3)), [face for face in faces if face])


def _checked(points: FloatArray) -> FloatArray:
    if not np.all(np.abs(points) < LARGEST):
        raise ValueError(f"there are coordinates that are infinite, no numbers, or beyond {LARGEST:g}")
    return points


def _plane(meshes: list[FloatArray]) -> list[int]:
    """The two axes of the plane: x-y for a model that is flat in z, or flatter there than in y; else x-z."""
    sizes = np.ptp(np.concatenate(meshes), axis=0)
    return [0, 1] if sizes[2] <= FLAT * sizes.max() or (sizes[2] < sizes[1] and sizes[2] < sizes[0]) else [0, 2]


def _silhouette(rings: list[FloatArray]) -> list[FloatArray]:
    """The outline of what faces cover together, and those of its holes."""
    extent = max(float(np.ptp(np.concatenate(rings), axis=0).max()), 1e-300)
    shapes = [shapely.Polygon(ring) for ring in rings if len(ring) > 2]
    shapes = [shape for shape in shapes if shape.area > 1e-12 * extent**2]
    whole = shapely.union_all(shapely.make_valid(shapes), grid_size=1e-10 * extent) if shapes else shapely.Polygon()
    parts = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon" and not part.is_empty]
    if len(parts) != 1:
        raise ValueError("it shows nothing from the side" if not parts else f"it shows {len(parts)} outlines")
    outline = shapely.simplify(parts[0], 1e-9 * extent)
    corners = np.concatenate(rings)
    tree = shapely.STRtree(shapely.points(corners))

    def drawn(ring: Any) -> FloatArray:
        """A ring whose corners are where the faces have them; the union moved them onto its grid."""
        moved = np.array(ring.coords)[:-1]
        which, nearest = tree.query_nearest(shapely.points(moved), max_distance=1e-9 * extent, all_matches=False)
        moved[which] = corners[nearest]
        return moved

    return [drawn(ring) for ring in (outline.exterior, *outline.interiors)]


def _inside(rings: list[FloatArray]) -> list[tuple[float, float]]:
    """Two points inside of a polygon, apart from each other."""
    polygon = shapely.Polygon(rings[0], rings[1:])
    middle = polygon.representative_point()
    west, _, east, _ = polygon.bounds
    across = shapely.LineString([(west, middle.y), (east, middle.y)]).intersection(polygon)
    part = next((p for p in shapely.get_parts(across) if p.geom_type == "LineString" and p.distance(middle) <= 0), None)
    if part is None:
        part = shapely.LineString([(middle.x, middle.y), (middle.x, middle.y)])
    return [(point.x, point.y) for point in (part.interpolate(share, normalized=True) for share in (0.25, 0.75))]
