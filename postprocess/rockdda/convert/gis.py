# SPDX-License-Identifier: MIT
"""GeoPackages and Shapefiles to a geometry: their features are read as those of GeoJSON.

A GeoPackage is an SQLite file, which Python reads itself; Shapefiles take the package pyshp. Names of layers give kinds
as in DXF drawings (`joint_2`, `area`, …), and so do columns `kind` and `material`. The reference system of the file
gives the unit of lengths, and says where coordinates are longitudes and latitudes.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import mapping

from ..errors import InputError, need
from .dxf import SPEAKING, kind_of, parse_kind
from .geojson import Reader
from .geometry import Geometry
from .json_places import JsonPath
from .report import MOST_LINES, Report, check_size

UNIT = re.compile(r'\bUNIT\s*\[\s*"([^"]*)"\s*,\s*([-+.\deE]+)', re.I)


@dataclass
class Source:
    """Features of one layer, and what its reference system says."""

    name: str
    rows: list[tuple[Any, dict[str, Any]]]  # shapes and columns
    is_geographic: bool = False
    unit: float = 1.0  # metres


class _Features(Reader):
    """Reads features of a table; problems name the row."""

    def __init__(self, path: Path, default: str | None, report: Report) -> None:
        self.set_up(path, "", report, default)
        self.layer = ""

    def place(self, path: JsonPath) -> str:
        return f"row {path[0]} of layer {self.layer!r}: " if path else ""


def read_gis(
    path: Path, layers: dict[str, str] | None = None, default: str | None = None
) -> tuple[Geometry, Report, float, bool]:
    """Lines, regions and points of a GeoPackage or Shapefile, the length of its unit in metres, and whether its
    coordinates are longitudes and latitudes. `layers` maps names of layers to kinds, `default` is the kind of lines and
    polygons that have none."""
    check_size(path)
    report = Report(path)
    sources = _shapefile(path) if path.suffix.lower() == ".shp" else _geopackage(path, report)
    reader = _Features(path, default, report)
    asked = {name.lower(): kind for name, kind in (layers or {}).items()}
    for source in sources:
        reader.layer = source.name
        of_layer = _properties_of(source.name, asked)
        for number, (shape, columns) in enumerate(source.rows, start=1):
            if shape is None or shape.is_empty:
                report.leave("row without a shape", "rows without a shape")
                continue
            given = {name.lower(): value for name, value in columns.items() if value is not None and value != ""}
            flat = _as_json(mapping(shapely.force_2d(shape)))
            feature = {"type": "Feature", "geometry": flat, "properties": of_layer | given}
            reader.item(feature, (number,), {})
        reader.report_failures()
    reader.finish()
    for name in layers or {}:
        if name.lower() not in {source.name.lower() for source in sources}:
            there = ", ".join(source.name for source in sources) or "none"
            report.warning(f"there is no layer {name!r}; the layers are: {there}")
    systems = {(source.is_geographic, source.unit) for source in sources if source.rows}
    if len(systems) > 1:
        report.error("the layers have different reference systems: convert them one by one")
    geometry = reader.geometry
    if not report.errors and geometry.is_empty:
        report.error("no lines: there is no line or polygon")
    report.raise_errors()
    is_geographic, unit = next(iter(systems), (False, 1.0))
    if unit != 1.0:
        report.note(f"the reference system counts in units of {unit:.9g} m: lengths are converted to metres")
    return geometry, report, unit, is_geographic


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


def _as_json(value: Any) -> Any:
    """Tuples of coordinates as lists."""
    if isinstance(value, dict):
        return {name: _as_json(entry) for name, entry in value.items()}
    return [_as_json(entry) for entry in value] if isinstance(value, list | tuple) else value


def _system_of(text: str) -> tuple[bool, float]:
    """Does a reference system in well-known text count degrees, and the length of its unit in metres."""
    head = text.lstrip().upper()
    if head.startswith(("GEOGCS", "GEOGCRS", "GEODCRS")):
        return True, 1.0
    units = [float(value) for _, value in UNIT.findall(text)]  # the last one is that of the projection
    return False, units[-1] if head.startswith("PROJC") and len(units) > 1 and units[-1] > 0 else 1.0


def _geopackage(path: Path, report: Report) -> list[Source]:
    """All layers of features of a GeoPackage."""
    try:
        with sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True) as file:
            return list(_layers(file, path, report))
    except sqlite3.Error as error:
        raise InputError(f"is no GeoPackage, or is damaged: {error}", path) from error
    finally:
        if "file" in locals():
            file.close()


def _layers(file: sqlite3.Connection, path: Path, report: Report) -> Iterator[Source]:
    tables = file.execute(
        "select c.table_name, g.column_name, s.definition from gpkg_contents c "
        "join gpkg_geometry_columns g on g.table_name = c.table_name "
        "left join gpkg_spatial_ref_sys s on s.srs_id = g.srs_id where c.data_type = 'features' order by c.table_name"
    ).fetchall()
    for table, column, definition in tables:
        cursor = file.execute(f'select * from "{str(table).replace(chr(34), 2 * chr(34))}"')
        names = [entry[0] for entry in cursor.description]
        at = names.index(column)
        rows: list[tuple[Any, dict[str, Any]]] = []
        for row in cursor:
            if len(rows) >= MOST_LINES:
                raise InputError(f"has more than {MOST_LINES} features", path)
            columns = {name: value for k, (name, value) in enumerate(zip(names, row, strict=True)) if k != at}
            columns.pop("fid", None)
            rows.append((_shape(row[at], report), columns))
        yield Source(str(table), rows, *_system_of(str(definition or "")))


def _shape(blob: Any, report: Report) -> Any:
    """The shape in a cell of a GeoPackage: a header, then well-known binary."""
    if not isinstance(blob, bytes) or len(blob) < 8 or blob[:2] != b"GP":
        return None
    envelope = (blob[3] >> 1) & 7
    try:
        return shapely.from_wkb(blob[8 + (0, 32, 48, 48, 64)[envelope] :])
    except (shapely.errors.ShapelyError, IndexError):
        report.leave("shape of a kind that is not read", "shapes of a kind that is not read")
        return None


def _shapefile(path: Path) -> list[Source]:
    """The layer of a Shapefile."""
    from shapely.geometry import shape

    shapefile = need("shapefile", "gis", "reading Shapefiles")

    try:
        with shapefile.Reader(str(path)) as file:
            if len(file) > MOST_LINES:
                raise InputError(f"has more than {MOST_LINES} features", path)
            rows = [
                (shape(entry.shape.__geo_interface__) if entry.shape.points else None, entry.record.as_dict())
                for entry in file.iterShapeRecords()
            ]
    except InputError:
        raise
    except Exception as error:  # broken files end in errors of any kind in pyshp
        raise InputError(f"the Shapefile is broken, or parts of it are missing: {error}", path) from error
    beside = path.with_suffix(".prj")
    system = beside.read_text(encoding="utf-8", errors="replace") if beside.is_file() else ""
    return [Source(path.stem, rows, *_system_of(system))]
