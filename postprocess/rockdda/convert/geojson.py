# SPDX-License-Identifier: MIT
"""GeoJSON lines to a geometry.

LineStrings and Polygons (their rings) become lines, Points points. The property `kind` (joint, boundary, material,
area, opening, block, fixed, loading, measured, hole, bolt, liner) says what a feature is: without it lines are joints,
polygons areas and points measured points. The property `material` is its material, by default 1: also called
`block_material` for blocks and material lines, else `joint_material`. Other properties are not used; a note names them.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..text import read_text, short, shown
from . import systems
from .geometry import KINDS, LARGEST_MATERIAL, POINT_KINDS, REGION_KINDS, Geometry, Point, Ring
from .report import MOST_ERRORS, MOST_LINES, Report, read_json
from .systems import System

TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{},:]|[^\s\[\]{},:"]+')
JsonPath = tuple[str | int, ...]


def places_of(text: str, paths: Iterable[JsonPath]) -> dict[JsonPath, tuple[int, int]]:
    """Line and column, from 1, of the values at paths such as ('features', 3, 'geometry').

    One pass over the text, however many paths there are."""
    wanted: dict[Any, Any] = {}  # a tree of keys and indices; None holds the path that ends there
    for path in paths:
        node = wanted
        for part in path:
            node = node.setdefault(part, {})
        node[None] = path
    found: dict[JsonPath, tuple[int, int]] = {}
    left = len(set(paths))
    line, counted = 1, 0  # of the last place found
    stack: list[list[Any]] = []  # [is it a list, key or index, node of the tree]
    expect_key = False
    for match in TOKEN.finditer(text):
        if not left:
            break
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
            node = stack[-1][2].get(stack[-1][1], _NOTHING) if stack else wanted
            if None in node and node[None] not in found:
                line += text.count("\n", counted, match.start())
                counted = match.start()
                found[node[None]] = (line, counted - text.rfind("\n", 0, counted))
                left -= 1
            if token in "{[":
                stack.append([token == "[", 0 if token == "[" else None, node])
                expect_key = token == "{"
    return found


_NOTHING: dict[Any, Any] = {}


LARGEST = 1e30  # as the program allows
DEEPEST = 50  # collections within collections
MATERIALS = ("material", "joint_material", "block_material")
MOST_NAMED = 10  # properties that are not used


class Reader:
    """Reads one file into a geometry; `default` is the kind of lines and polygons that have none."""

    def __init__(self, path: Path, default: str | None = None) -> None:
        text = read_text(path)
        self.set_up(path, text, Report(path, text), default)

    def set_up(self, path: Path, text: str, report: Report, default: str | None) -> None:
        """Begin without features."""
        self.path, self.text, self.report = path, text, report
        self.geometry = Geometry()
        self.default = default
        self._failures: list[tuple[JsonPath, str]] = []
        self._positions = 0
        self._unused: Counter[str] = Counter()  # features that have a property
        self.system: System | None = None  # of the coordinates, where the file says it

    def fail(self, path: JsonPath, message: str) -> None:
        """Note an error; its place is found when all are known."""
        self._failures.append((path, message))
        if len(self._failures) >= MOST_ERRORS:
            self.report_failures()

    def report_failures(self) -> None:
        """Report the errors noted so far, with their places."""
        places = places_of(self.text, [path for path, _ in self._failures]) if self.text else {}
        for path, message in self._failures:
            line, column = places.get(path, (None, None))
            self.report.error(self.place(path) + message, line, column)
        self._failures = []

    def place(self, path: JsonPath) -> str:
        """Words before a message that say where it belongs; none where lines and columns do."""
        return ""

    def read(self) -> None:
        """Read the file; InputError with all errors."""
        data = read_json(self.path, self.text, self.report)
        self._read_system(data)
        self.item(data, (), {})
        self.finish()

    def _read_system(self, data: Any) -> None:
        """The member `crs` of a file, which GeoJSON had until 2016 and many programs write."""
        crs = data.get("crs") if isinstance(data, dict) else None
        if crs is None:
            return
        properties = crs.get("properties") if isinstance(crs, dict) else None
        name = properties.get("name") if isinstance(properties, dict) else None
        if isinstance(name, str):
            self.system = systems.of_name(name)
            if self.system.problem:
                self.system = System(problem=f"{shown(name)}: {self.system.problem}")
        else:
            self.fail(("crs",), f"crs: expected a name such as EPSG:32633, found {shown(crs)}")

    def finish(self) -> None:
        """Report what was found; InputError with all errors."""
        self.report_failures()
        self.report.raise_errors()
        self._note_unused()

    def _note_unused(self) -> None:
        """Name the properties that are not used, those of most features first."""
        if not self._unused:
            return
        named = [f"{shown(name)} ({count})" for name, count in self._unused.most_common(MOST_NAMED)]
        more = len(self._unused) - len(named)
        rest = f" and {more} more" if more else ""
        self.report.note(
            f"properties that are not used, with the number of their features: {', '.join(named)}{rest}; "
            f"used are: kind, {', '.join(MATERIALS)}"
        )

    def item(self, data: Any, path: JsonPath, properties: dict[str, Any]) -> None:
        """A collection, feature or geometry."""
        if len(path) > 2 * DEEPEST:
            self.fail(path, f"collections are nested more than {DEEPEST} times")
            return
        kind = data.get("type") if isinstance(data, dict) else None
        if kind == "FeatureCollection":
            for i, feature in enumerate(self._list(data, "features", path)):
                self.item(feature, (*path, "features", i), {})
        elif kind == "Feature":
            found = data.get("properties")
            if found is not None and not isinstance(found, dict):
                self.fail((*path, "properties"), f"properties: expected an object or null, found {shown(found)}")
            elif data.get("geometry") is None:
                self.report.leave("feature without a geometry", "features without a geometry")
            else:
                self._unused.update(name for name in found or {} if name not in ("kind", *MATERIALS))
                self.item(data["geometry"], (*path, "geometry"), found or {})
        elif kind == "GeometryCollection":
            for i, part in enumerate(self._list(data, "geometries", path)):
                self.item(part, (*path, "geometries", i), properties)
        elif isinstance(kind, str) and kind.removeprefix("Multi") in ("Point", "LineString", "Polygon"):
            here = (*path, "coordinates")
            coordinates = self._list(data, "coordinates", path)
            if isinstance(data.get("coordinates"), list) and not any(part != [] for part in coordinates):
                self.report.leave(f"{kind} without positions", f"{kind}s without positions")
            elif kind.startswith("Multi"):
                for i, part in enumerate(coordinates):
                    self.shape(kind[5:], part, (*here, i), properties, path)
            else:
                self.shape(kind, coordinates, here, properties, path)
        else:
            self.fail(path, f"expected a GeoJSON object, found {'type ' + shown(kind) if kind else 'something else'}")

    def _list(self, data: dict[str, Any], name: str, path: JsonPath) -> list[Any]:
        found = data.get(name)
        if not isinstance(found, list):
            self.fail(path, f"{data['type']} without a list {name!r}")
            return []
        return found

    def shape(self, shape: str, coordinates: Any, here: JsonPath, properties: dict[str, Any], owner: JsonPath) -> None:
        """Add a point, a line or the rings of a polygon."""
        if isinstance(coordinates, list) and not any(part != [] for part in coordinates):
            self.report.leave(f"{shape} without positions", f"{shape}s without positions")
            return
        lines = "joint" if self.default in (None, "block") else self.default
        default = {"Point": "measured", "LineString": lines, "Polygon": self.default or "area"}[shape]
        kind = properties.get("kind")
        kind = kind.lower() if isinstance(kind, str) else default if kind is None else shown(kind)
        if kind not in KINDS:
            self.fail(owner, f"unknown kind {short(kind)!r} of a {shape}; the kinds are: {', '.join(KINDS)}")
            return
        if kind == "skip":
            self.report.leave(f"{shape} of kind skip", f"{shape}s of kind skip")
            return
        names = ("block_material", "material") if kind in ("block", "material") else MATERIALS[:2]
        if kind in ("joint", "boundary", *REGION_KINDS) and properties.get("block_material") not in (None, 1, "1"):
            self.fail(
                owner,
                f"block_material of a {shape} of kind {kind}, whose material is that of joints: blocks get theirs from "
                "lines of kind material that cross them, polygons of kind block, or &region and &change of the run",
            )
            return
        given = next((properties[k] for k in names if k in properties), 1)
        material = _material(given)
        if material is None:
            message = f"material of a {shape}: expected a whole number from 1 to {LARGEST_MATERIAL}"
            self.fail(owner, f"{message}, found {shown(given)}")
            return
        self.report.take(f"{shape} as {kind}", f"{shape}s as {kind}")
        if shape == "Point":
            point = self.point(coordinates, here)
            if point and not self.geometry.add_point(kind, point):
                self.fail(owner, f"a Point cannot be of kind {kind!r}: that takes lines")
            return
        if kind in POINT_KINDS:
            self.fail(owner, f"a {shape} cannot be of kind {kind!r}: that takes Points")
            return
        if kind == "block":
            self._add_block(material, properties.get("joint_material", 1), shape, coordinates, here)
            return
        if kind in REGION_KINDS:
            self._add_region(kind, material, shape, coordinates, here)
            return
        rings = coordinates if shape == "Polygon" and isinstance(coordinates, list) else [coordinates]
        for i, ring in enumerate(rings):
            is_ring = shape == "Polygon"
            corners = self._corners(ring, (*here, i) if is_ring else here)
            self.geometry.add_corners(kind, material, [*corners, *corners[: int(is_ring)]])

    def _add_region(self, kind: str, material: int, shape: str, coordinates: Any, here: JsonPath) -> None:
        """An area or opening: a polygon with its holes, or lines that close to one."""
        if shape == "LineString":
            chain = self._corners(coordinates, here)
            self.geometry.chains.append((kind, material, chain))
            return
        if not isinstance(coordinates, list) or not coordinates:
            self.fail(here, "expected a list of rings")
        elif all(rings := [self._corners(ring, (*here, i)) for i, ring in enumerate(coordinates)]):
            self.geometry.regions.append((kind, material, rings))

    def _add_block(self, material: int, joint: Any, shape: str, coordinates: Any, here: JsonPath) -> None:
        """A polygon that is one block; its holes are those of the block."""
        joint_material = _material(joint)
        if joint_material is None:
            message = f"joint_material: expected a whole number from 1 to {LARGEST_MATERIAL}"
            self.fail(here, f"{message}, found {shown(joint)}")
        elif shape != "Polygon" or not isinstance(coordinates, list) or not coordinates:
            self.fail(here, f"a {shape} cannot be a block: that takes Polygons")
        elif all(rings := [self._corners(ring, (*here, i)) for i, ring in enumerate(coordinates)]):
            open_rings = [ring[:-1] if ring[0] == ring[-1] else ring for ring in rings]
            self.geometry.blocks.append((material, joint_material, open_rings))

    def _corners(self, ring: Any, here: JsonPath) -> Ring:
        """The positions of a line; [] after an error."""
        if not isinstance(ring, list) or len(ring) < 2:
            self.fail(here, "expected a list of at least two positions")
            return []
        self._positions += len(ring)
        if self._positions > MOST_LINES:
            raise InputError(f"has more than {MOST_LINES} positions", self.path)
        corners = [self.point(position, (*here, i)) for i, position in enumerate(ring)]
        return [corner for corner in corners if corner is not None] if all(corners) else []

    def point(self, position: Any, here: JsonPath) -> Point | None:
        """A position as x, y; None after an error."""
        if not isinstance(position, list) or len(position) < 2:
            self.fail(here, "expected a position [x, y]")
            return None
        for i, value in enumerate(position[:2]):
            if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST:
                self.fail((*here, i), f"expected a number below {LARGEST:g} in size, found {short(json.dumps(value))}")
                return None
        return float(position[0]), float(position[1])


def read_geojson(path: Path, default: str | None = None) -> tuple[Geometry, Report, System | None]:
    """The lines, regions and points of a GeoJSON file, and its reference system where it names one.

    `default` is the kind of what has none (but of points)."""
    reader = Reader(path, default)
    reader.read()
    geometry, report = reader.geometry, reader.report
    if geometry.is_empty:
        report.error("no lines: there is no LineString or Polygon")
    report.raise_errors()
    return geometry, report, reader.system


def _material(value: Any) -> int | None:
    """A number of a material, also as a text such as "1"; None for anything else."""
    if isinstance(value, str):
        value = int(value) if re.fullmatch(r"\s*\d{1,9}\s*", value, re.ASCII) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return int(value) if 1 <= value <= LARGEST_MATERIAL and not value % 1 else None


def looks_like_degrees(geometry: Geometry) -> bool:
    """True if all coordinates are in the ranges of longitude and latitude, the only ones RFC 7946 allows."""
    x, y = geometry.ranges
    return max(x[1] - x[0], y[1] - y[0]) < 1 and max(map(abs, x)) <= 180 and max(map(abs, y)) <= 90 and abs(x[0]) > 1
