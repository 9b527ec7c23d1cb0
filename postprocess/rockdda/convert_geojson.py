# SPDX-License-Identifier: MIT
"""GeoJSON lines to a geometry.

LineStrings and Polygons (their rings) become lines, Points points. The property `kind` (joint, boundary, material,
fixed, loading, measured, hole, bolt) says what a feature is: without it lines are joints, polygons boundaries and
points measured points. The property `material` (or `joint_material`, `block_material`) is its material, 1 without it.
"""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from typing import Any

from .convert_dxf import KINDS, POINT_KINDS
from .convert_model import Geometry, Point
from .convert_report import Report, read_text

TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{},:]|[^\s\[\]{},:"]+')
LARGEST = 1e30  # as the program allows
Path_ = tuple[str | int, ...]


def place_of(text: str, path: Path_) -> tuple[int, int] | None:
    """Line and column of the value at a path such as ('features', 3, 'geometry')."""
    stack: list[list[Any]] = []  # [is_list, key or index]
    expect_key = False
    for match in TOKEN.finditer(text):
        token = match.group()
        if token in "}]":
            stack.pop()
            expect_key = False
        elif token == ",":
            if stack[-1][0]:
                stack[-1][1] += 1
            expect_key = not stack[-1][0]
        elif token == ":":
            expect_key = False
        elif expect_key:
            stack[-1][1] = json.loads(token)
        else:
            if tuple(level[1] for level in stack) == path:
                before = text[: match.start()]
                return before.count("\n") + 1, match.start() - (before.rfind("\n") + 1) + 1
            if token in "{[":
                stack.append([token == "[", 0 if token == "[" else None])
                expect_key = token == "{"
    return None


class Reader:
    """Reads one file into a geometry."""

    def __init__(self, path: Path) -> None:
        self.text = read_text(path)
        self.report = Report(path, self.text)
        self.geometry = Geometry()

    def fail(self, path: Path_, message: str) -> None:
        line, column = place_of(self.text, path) or (None, None)
        self.report.error(message, line, column)

    def read(self) -> None:
        try:
            data = json.loads(self.text)
        except json.JSONDecodeError as error:
            self.report.error(f"the JSON is broken: {error.msg}", error.lineno, error.colno)
            return
        except RecursionError:
            self.report.error("the JSON is nested too deeply")
            return
        self.item(data, (), {})

    def item(self, data: Any, path: Path_, properties: dict[str, Any]) -> None:
        """A collection, feature or geometry."""
        kind = data.get("type") if isinstance(data, dict) else None
        if kind == "FeatureCollection":
            for i, feature in enumerate(self._list(data, "features", path)):
                self.item(feature, (*path, "features", i), {})
        elif kind == "Feature":
            if data.get("geometry") is not None:
                self.item(data["geometry"], (*path, "geometry"), data.get("properties") or {})
        elif kind == "GeometryCollection":
            for i, part in enumerate(self._list(data, "geometries", path)):
                self.item(part, (*path, "geometries", i), properties)
        elif kind in ("Point", "LineString", "Polygon", "MultiPoint", "MultiLineString", "MultiPolygon"):
            here = (*path, "coordinates")
            coordinates = self._list(data, "coordinates", path)
            if kind.startswith("Multi"):
                for i, part in enumerate(coordinates):
                    self.shape(kind[5:], part, (*here, i), properties, path)
            else:
                self.shape(kind, coordinates, here, properties, path)
        else:
            self.fail(path, f"expected a GeoJSON object, found {'type ' + repr(kind) if kind else 'something else'}")

    def _list(self, data: dict[str, Any], name: str, path: Path_) -> list[Any]:
        found = data.get(name)
        if not isinstance(found, list):
            self.fail(path, f"{data['type']} without a list {name!r}")
            return []
        return found

    def shape(self, shape: str, coordinates: Any, here: Path_, properties: dict[str, Any], owner: Path_) -> None:
        """Add a point, a line or the rings of a polygon."""
        default = {"Point": "measured", "LineString": "joint", "Polygon": "boundary"}[shape]
        kind = str(properties.get("kind", default)).lower()
        if kind not in KINDS:
            self.fail(owner, f"unknown kind {kind!r} of a {shape}; the kinds are: {', '.join(KINDS)}")
            return
        if kind == "skip":
            return
        material = next((properties[k] for k in ("material", "joint_material", "block_material") if k in properties), 1)
        if isinstance(material, bool) or not isinstance(material, int | float) or material < 1 or material % 1:
            self.fail(owner, f"material of a {shape}: expected a whole number of at least 1, found {material!r}")
            return
        if shape == "Point":
            point = self.point(coordinates, here)
            if point:
                self._add_point(kind, point, owner)
            return
        if kind in POINT_KINDS:
            self.fail(owner, f"a {shape} cannot be of kind {kind!r}: that takes Points")
            return
        rings = coordinates if shape == "Polygon" and isinstance(coordinates, list) else [coordinates]
        for i, ring in enumerate(rings):
            self._add_lines(kind, int(material), ring, (*here, i) if shape == "Polygon" else here)

    def _add_point(self, kind: str, point: Point, owner: Path_) -> None:
        geometry = self.geometry
        if kind == "fixed":
            geometry.fixed.append((*point, *point))
        elif kind in POINT_KINDS:
            {"loading": geometry.loading, "measured": geometry.measured, "hole": geometry.holes}[kind].append(point)
        else:
            self.fail(owner, f"a Point cannot be of kind {kind!r}: that takes lines")

    def _add_lines(self, kind: str, material: int, ring: Any, here: Path_) -> None:
        if not isinstance(ring, list) or len(ring) < 2:
            self.fail(here, "expected a list of at least two positions")
            return
        corners = [self.point(position, (*here, i)) for i, position in enumerate(ring)]
        pairs = [(*a, *b) for a, b in itertools.pairwise(corners) if a and b and a != b]
        geometry = self.geometry
        if kind == "fixed":
            geometry.fixed += pairs
        elif kind == "bolt":
            geometry.bolts += pairs
        else:
            lines = {"joint": geometry.joints, "boundary": geometry.boundary, "material": geometry.material_lines}
            lines[kind] += [(pair, material) for pair in pairs]

    def point(self, position: Any, here: Path_) -> Point | None:
        """A position as x, y; None after an error."""
        if not isinstance(position, list) or len(position) < 2:
            self.fail(here, "expected a position [x, y]")
            return None
        for i, value in enumerate(position[:2]):
            if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST:
                self.fail((*here, i), f"expected a number, found {json.dumps(value)}")
                return None
        return float(position[0]), float(position[1])


def read_geojson(path: Path, e0: float | None = None) -> tuple[Geometry, Report]:
    """The lines and points of a GeoJSON file; `e0` is by default 1/10,000 of the larger extent."""
    reader = Reader(path)
    reader.read()
    geometry, report = reader.geometry, reader.report
    if not geometry.lines and not report.errors:
        report.error("no lines: there is no LineString or Polygon")
    report.raise_errors()
    geometry.e0 = e0 if e0 is not None else geometry.extent / 10_000
    x = geometry.lines[0][0][0]
    if geometry.extent < 1 and all(abs(s[0]) <= 180 and abs(s[1]) <= 90 for s, _ in geometry.lines) and abs(x) > 1:
        report.warning("the coordinates look like degrees of longitude and latitude: project them first")
    return geometry, report
