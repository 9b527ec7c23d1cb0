# SPDX-License-Identifier: MIT
"""Blocks from JSON files of COMPAS: meshes, assemblies of blocks, polygons.

Each face of a flat mesh is a block; a mesh in space (a voussoir of an assembly) is the outline that it shows from the
side. Files of COMPAS 1 and 2 are read; the plane is x-y where the model is flat in z, else x-z.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..errors import InputError
from .geometry import Geometry
from .report import MOST_LINES, Report, read_text

Points = npt.NDArray[np.float64]
FLAT = 1e-9  # of the extent


def is_compas(head: str) -> bool:
    """Does a JSON text name a type of COMPAS near its beginning?"""
    return "compas" in head and ("dtype" in head or "datatype" in head)


def read_compas(path: Path) -> tuple[Geometry, Report]:
    """The blocks of a JSON file of COMPAS, all of material 1."""
    text = read_text(path)
    report, geometry = Report(path, text), Geometry()
    try:
        data = json.loads(text)
        meshes = [shape for _, shape in zip(range(MOST_LINES + 1), _shapes(data, 0), strict=False)]
    except json.JSONDecodeError as error:
        report.error(f"the JSON is broken: {error.msg}", error.lineno, error.colno)
        report.raise_errors()
        raise AssertionError from error
    except (RecursionError, KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
        raise InputError(f"cannot be read as JSON of COMPAS: {type(error).__name__}: {error}", path) from error
    if len(meshes) > MOST_LINES:
        raise InputError(f"has more than {MOST_LINES} meshes", path)
    if not meshes:
        report.error("there is no mesh, polygon or block of COMPAS in the file")
        report.raise_errors()
    axes = _plane([points for points, _ in meshes])
    report.note(f"the plane of the model is {'xyz'[axes[0]]}-{'xyz'[axes[1]]}")
    for points, faces in meshes:
        flat = points[:, axes]
        rings = [flat[face] for face in faces]
        thickness = np.ptp(points[:, 3 - sum(axes)])
        if len(rings) > 1 and thickness > FLAT * np.ptp(points, axis=0).max():
            rings = _silhouette(rings)
            report.take("block in space, by its outline", "blocks in space, by their outlines")
        else:
            report.take("face", "faces", len(rings))
        geometry.blocks += [(1, 1, [(float(x), float(y)) for x, y in ring]) for ring in rings]
    return geometry, report


def _shapes(data: Any, depth: int) -> Iterator[tuple[Points, list[list[int]]]]:
    """Points (n, 3) and faces of all meshes and polygons within an object."""
    if depth > 50:
        raise ValueError("objects are nested more than 50 times")
    if isinstance(data, list):
        for entry in data:
            yield from _shapes(entry, depth + 1)
        return
    if not isinstance(data, dict):
        return
    inner = data.get("data", data.get("value"))
    kind = str(data.get("dtype", data.get("datatype", ""))).rsplit("/", 1)[-1].rsplit(".", 1)[-1]
    if isinstance(inner, dict) and "face" in inner and "vertex" in inner:
        keys = list(inner["vertex"])
        defaults = inner.get("default_vertex_attributes", inner.get("dva", {})) or {}
        points = [[float(inner["vertex"][k].get(a, defaults.get(a, 0.0))) for a in "xyz"] for k in keys]
        number = {str(key).strip("'"): i for i, key in enumerate(keys)}
        faces = [[number[str(k).strip("'")] for k in face] for face in inner["face"].values()]
        yield _checked(np.array(points).reshape(-1, 3)), faces
    elif kind == "Polygon" and isinstance(inner, dict):
        rows = [(entry.get("data", entry) if isinstance(entry, dict) else entry) for entry in inner["points"]]
        points = [[float(x) for x in (*row, 0.0)[:3]] for row in rows]
        yield _checked(np.array(points).reshape(-1, 3)), [list(range(len(points)))]
    else:
        for value in data.values():
            if isinstance(value, dict | list):
                yield from _shapes(value, depth + 1)


def _checked(points: Points) -> Points:
    if not np.all(np.abs(points) < 1e30):
        raise ValueError("there are coordinates that are infinite, no numbers, or beyond 1e30")
    return points


def _plane(meshes: list[Points]) -> list[int]:
    """The two axes of the plane: x-y for a model that is flat in z, or flatter there than in y; else x-z."""
    sizes = np.ptp(np.concatenate(meshes), axis=0)
    return [0, 1] if sizes[2] <= FLAT * sizes.max() or (sizes[2] < sizes[1] and sizes[2] < sizes[0]) else [0, 2]


def _silhouette(rings: list[Points]) -> list[Points]:
    """The outline of what faces cover together."""
    extent = max(float(np.ptp(np.concatenate(rings), axis=0).max()), 1e-300)
    shapes = [shapely.Polygon(ring) for ring in rings if len(ring) > 2]
    shapes = [shape for shape in shapes if shape.area > 1e-12 * extent**2]
    whole = shapely.union_all(shapely.make_valid(shapes), grid_size=1e-10 * extent) if shapes else shapely.Polygon()
    parts = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon"]
    return [np.array(part.exterior.coords)[:-1] for part in shapely.simplify(parts, 1e-9 * extent)]
