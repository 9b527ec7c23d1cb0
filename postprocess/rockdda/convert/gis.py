# SPDX-License-Identifier: MIT
"""GeoPackages and Shapefiles to a geometry: their features are read as those of GeoJSON.

A GeoPackage is an SQLite file, which Python reads itself; Shapefiles take the package pyshp. Names of layers give kinds
as in DXF drawings (`joint_2`, `area`, …), and so do columns `kind` and `material`. The reference system of the file
gives the unit of lengths, and says where coordinates are longitudes and latitudes. Shapes are well-known binary: counts
are compared with the bytes that are left before anything is read, since GEOS trusts them.
"""

from __future__ import annotations

import contextlib
import sqlite3
import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, need
from ..text import LARGEST_FILE, read_bytes, shown
from . import systems
from .dxf import SPEAKING, kind_of, parse_kind
from .geojson import JsonPath, Reader
from .geometry import Geometry
from .report import MOST_LINES, Report
from .systems import ADVICE, System

SHAPES = {1: "Point", 2: "LineString", 3: "Polygon", 4: "MultiPoint", 5: "MultiLineString", 6: "MultiPolygon",
          7: "GeometryCollection"}  # fmt: skip
OTHERS = {8: "CircularString", 9: "CompoundCurve", 10: "CurvePolygon", 11: "MultiCurve", 12: "MultiSurface",
          13: "Curve", 14: "Surface", 15: "PolyhedralSurface", 16: "TIN", 17: "Triangle"}  # fmt: skip
ENVELOPES = (0, 32, 48, 48, 64)  # bytes
DEEPEST = 50  # shapes within shapes


class UnreadShapeError(ValueError):
    """A shape of a kind that has no lines; its name is the message."""


def shape_of(cell: object) -> dict[str, Any] | None:
    """The shape in a cell of a GeoPackage: a header, then well-known binary; None without one.

    UnreadShapeError for curves and surfaces; ValueError for a damaged cell."""
    if cell is None or cell == b"":
        return None
    if not isinstance(cell, bytes) or len(cell) < 8 or cell[:2] != b"GP":
        raise ValueError("it does not begin with GP, as shapes of GeoPackages do")
    flags = cell[3]
    envelope = (flags >> 1) & 7
    if envelope >= len(ENVELOPES):
        raise ValueError(f"its envelope is of the unknown kind {envelope}")
    if flags & 32:
        raise UnreadShapeError("extended shape")
    reader = _Reader(cell, 8 + ENVELOPES[envelope])
    shape = reader.shape(0)
    return None if flags & 16 else shape


class _Reader:
    def __init__(self, data: bytes, at: int) -> None:
        self.data, self.at = data, at

    def _take(self, count: int) -> bytes:
        if count > len(self.data) - self.at:
            raise ValueError(f"it requests {count} bytes at byte {self.at}, where {len(self.data) - self.at} are left")
        self.at += count
        return self.data[self.at - count : self.at]

    def shape(self, depth: int) -> dict[str, Any]:
        """The shape at this place, as in GeoJSON; coordinates are x, y."""
        if depth > DEEPEST:
            raise ValueError(f"shapes are nested more than {DEEPEST} times")
        order = self._take(1)[0]
        if order > 1:
            raise ValueError(f"the order of its bytes is {order}, not 0 or 1")
        ends = "<" if order else ">"
        (code,) = struct.unpack(ends + "I", self._take(4))
        if code & 0x20000000:
            self._take(4)  # a reference system of its own
        dimensions = (code & 0x1FFFFFFF) // 1000
        columns = 2 + bool(code & 0x80000000 or dimensions in (1, 3)) + bool(code & 0x40000000 or dimensions in (2, 3))
        number = (code & 0x1FFFFFFF) % 1000
        if number in OTHERS:
            raise UnreadShapeError(OTHERS[number])
        if number not in SHAPES or dimensions > 3:
            raise ValueError(f"it is of the unknown kind {code}")
        name = SHAPES[number]
        if name == "Point":
            (point,) = self._points(ends, columns, 1)
            return {"type": name, "coordinates": [] if all(value != value for value in point) else point}
        count = self._count(ends, {"LineString": 8 * columns, "Polygon": 4}.get(name, 9))
        if name == "LineString":
            return {"type": name, "coordinates": self._points(ends, columns, count)}
        if name == "Polygon":
            rings = [self._points(ends, columns, self._count(ends, 8 * columns)) for _ in range(count)]
            return {"type": name, "coordinates": rings}
        parts = [self.shape(depth + 1) for _ in range(count)]
        if name == "GeometryCollection":
            return {"type": name, "geometries": parts}
        if any(part["type"] != name[5:] for part in parts):
            raise ValueError(f"a {name} has parts of other kinds")
        return {"type": name, "coordinates": [part["coordinates"] for part in parts]}

    def _count(self, ends: str, smallest: int) -> int:
        """A number of parts that have a smallest size each."""
        (count,) = struct.unpack(ends + "I", self._take(4))
        if count * smallest > len(self.data) - self.at:
            raise ValueError(
                f"it counts {count} parts at byte {self.at - 4}, where {len(self.data) - self.at} bytes are left"
            )
        return int(count)

    def _points(self, ends: str, columns: int, count: int) -> list[list[float]]:
        rows = np.frombuffer(self._take(8 * columns * count), dtype=ends + "f8").reshape(count, columns)
        found: list[list[float]] = rows[:, :2].tolist()
        return found


MOST_WORK = 3000  # units of 100,000 instructions of SQLite: some seconds


@dataclass
class Source:
    """Features of one layer, and what its reference system says; None where it has none."""

    name: str
    rows: list[tuple[Any, dict[str, Any]]]  # shapes as in GeoJSON, and columns
    system: System | None = None


class _Features(Reader):
    """Reads features of a table; problems name the row."""

    def __init__(self, path: Path, default: str | None, report: Report) -> None:
        self.set_up(path, "", report, default)
        self.layer = ""

    def place(self, path: JsonPath) -> str:
        return f"row {path[0]} of layer {shown(self.layer)}: " if path else ""


def read_gis(
    path: Path, layers: dict[str, str] | None = None, default: str | None = None
) -> tuple[Geometry, Report, System | None]:
    """Lines, regions and points of a GeoPackage or Shapefile, and its reference system.

    `layers` maps names of layers to kinds, `default` is the kind of lines and polygons that have none."""
    read_bytes(path)
    report = Report(path)
    sources = _shapefile(path, report) if path.suffix.lower() == ".shp" else _geopackage(path, report)
    reader = _Features(path, default, report)
    asked = {name.lower(): kind for name, kind in (layers or {}).items()}
    for source in sources:
        reader.layer = source.name
        of_layer = _properties_of(source.name, asked)
        for number, (shape, columns) in enumerate(source.rows, start=1):
            if shape is None:
                report.leave("row without a shape", "rows without a shape")
                continue
            given = {name.lower(): value for name, value in columns.items() if value is not None and value != ""}
            feature = {"type": "Feature", "geometry": shape, "properties": of_layer | given}
            reader.item(feature, (number,), {})
        reader.report_failures()
    reader.finish()
    for name in layers or {}:
        if name.lower() not in {source.name.lower() for source in sources}:
            there = ", ".join(source.name for source in sources) or "none"
            report.warning(f"there is no layer {name!r}; the layers are: {there}")
    found = [(source.name, source.system or System(name="none")) for source in sources if source.rows]
    for name, system in found:
        if system.differs(found[0][1]):
            first, other = found[0]
            report.error(
                f"the layers have different reference systems: {shown(first)} is in {shown(other.name)}, {shown(name)} "
                f"in {shown(system.name)}; {ADVICE}"
            )
            break
    geometry = reader.geometry
    if not report.errors and geometry.is_empty:
        report.error("no lines: there is no line or polygon")
    report.raise_errors()
    return geometry, report, next((source.system for source in sources if source.rows), None)


def _properties_of(layer: str, asked: dict[str, str]) -> dict[str, Any]:
    """Kind and material that the name of a layer, or an option, gives to all its features."""
    if layer.lower() in asked:
        try:
            kind, material = parse_kind(asked[layer.lower()])
        except ValueError as error:
            raise InputError(str(error)) from error
        return {"kind": kind, "material": material}
    match = SPEAKING.match(layer)
    if not match:
        return {}
    return {"kind": kind_of(match.group(1))} | ({"material": int(match.group(2))} if match.group(2) else {})


def _geopackage(path: Path, report: Report) -> list[Source]:
    """All layers of features of a GeoPackage; what its tables make SQLite do is bounded."""
    work = iter(range(MOST_WORK))
    address = f"{path.resolve().as_uri()}?mode=ro&immutable=1"
    try:
        with contextlib.closing(sqlite3.connect(address, uri=True)) as file:
            file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(path.stat().st_size, 1_000_000))
            file.text_factory = lambda text: text.decode("utf-8", "replace")
            file.execute("pragma trusted_schema = off")
            file.set_progress_handler(lambda: next(work, -1) < 0, 100_000)
            return list(_layers(file, path, report))
    except (sqlite3.Error, MemoryError, UnicodeDecodeError) as error:
        problem = f"is no GeoPackage, or is damaged: {error}"
        if isinstance(error, sqlite3.OperationalError) and "interrupted" in str(error):
            problem = "reading the GeoPackage takes too long: its tables are not what they should be"
        raise InputError(problem, path) from error


def _layers(file: sqlite3.Connection, path: Path, report: Report) -> Iterator[Source]:
    tables = {
        str(name)
        for (name,) in file.execute(
            "select name from sqlite_master where type = 'table' and sql not like 'create virtual%'"
        )
    }
    for name in ("gpkg_contents", "gpkg_geometry_columns", "gpkg_spatial_ref_sys"):
        if name not in tables:
            raise InputError(f"is no GeoPackage: there is no table {name}", path)
    rows_left, room = MOST_LINES, LARGEST_FILE
    found = file.execute(
        "select c.table_name, g.column_name, g.srs_id, s.organization, s.organization_coordsys_id, s.definition "
        "from gpkg_contents c join gpkg_geometry_columns g on g.table_name = c.table_name "
        "left join gpkg_spatial_ref_sys s on s.srs_id = g.srs_id where c.data_type = 'features' "
        "order by c.table_name limit 1000"
    ).fetchall()
    for table, column, *system in found:
        if table not in tables:
            raise InputError(f"the layer {shown(table)} is a view, or missing: write it as a table of its own", path)
        cursor = file.execute(f'select * from "{table.replace(chr(34), 2 * chr(34))}"')
        names = [entry[0] for entry in cursor.description]
        if column not in names:
            raise InputError(
                f"the layer {shown(table)} has no column {shown(column)}, where its shapes should be", path
            )
        at = names.index(column)
        rows: list[tuple[Any, dict[str, Any]]] = []
        for row in cursor:
            rows_left -= 1
            room -= sum(len(value) for value in row if isinstance(value, str | bytes))
            if rows_left < 0:
                raise InputError(f"has more than {MOST_LINES} features", path)
            if room < 0:
                raise InputError("its cells hold more than the file: they are computed", path)
            columns = {name: value for k, (name, value) in enumerate(zip(names, row, strict=True)) if k != at}
            columns.pop("fid", None)
            rows.append((_shape(row[at], len(rows) + 1, str(table), report), columns))
        yield Source(str(table), rows, _system_of(*system))


def _shape(cell: Any, number: int, table: str, report: Report) -> Any:
    """The shape in a cell; None where there is none that is read."""
    try:
        return shape_of(cell)
    except UnreadShapeError as error:
        report.leave(f"{error} (not read) of layer {shown(table)}", f"{error}s (not read) of layer {shown(table)}")
    except ValueError as error:
        report.error(f"row {number} of layer {shown(table)}: the shape is damaged: {error}")
    return None


def _system_of(number: Any, organization: Any, code: Any, definition: Any) -> System | None:
    """The reference system of a table."""
    found = systems.of_text(str(definition or ""))
    if found is not None:
        return found
    # 0, too: what has none is said to be geographic, by the programs that write GeoPackages
    if number in (-1, 0, None) or str(organization).upper() != "EPSG":
        return None
    return systems.of_name(f"EPSG:{code}")


def _shapefile(path: Path, report: Report) -> list[Source]:
    """The layer of a Shapefile."""
    shapefile = need("shapefile", "gis", "reading Shapefiles")
    rows: list[tuple[Any, dict[str, Any]]] = []
    try:
        with warnings.catch_warnings(record=True) as told, shapefile.Reader(str(path)) as file:
            warnings.simplefilter("always")
            if len(file) > MOST_LINES:
                raise InputError(f"has more than {MOST_LINES} features", path)
            for entry in file.iterShapeRecords():
                rows.append((_shape_of_file(entry.shape, report), entry.record.as_dict()))
    except (InputError, MemoryError):
        raise
    except Exception as error:  # broken files end in errors of any kind in pyshp
        raise InputError(f"the Shapefile is broken, or parts of it are missing: {shown(error)}", path) from error
    for message in dict.fromkeys(str(warning.message) for warning in told):
        report.warning(message)
    beside = next((file for file in (path.with_suffix(".prj"), path.with_suffix(".PRJ")) if file.is_file()), None)
    if beside is None:
        return [Source(path.stem, rows)]
    with beside.open("rb") as stream:
        text = stream.read(systems.LARGEST_TEXT).decode("utf-8", "replace")
    system = systems.of_text(text)
    if system is None and text.strip():
        report.warning(f"{beside.name} names no reference system that can be read: lengths are taken in metres")
    return [Source(path.stem, rows, system)]


def _shape_of_file(shape: Any, report: Report) -> Any:
    """The shape of a record as in GeoJSON; None where there is none."""
    if not shape.points:
        return None
    if shape.shapeTypeName == "MULTIPATCH":
        report.leave("MULTIPATCH (not read)", "MULTIPATCHes (not read)")
        return None
    return _as_json(shape.__geo_interface__)


def _as_json(value: Any) -> Any:
    """Tuples of coordinates as lists."""
    if isinstance(value, dict):
        return {name: _as_json(entry) for name, entry in value.items()}
    return [_as_json(entry) for entry in value] if isinstance(value, list | tuple) else value
