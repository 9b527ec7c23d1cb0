# SPDX-License-Identifier: MIT
"""Shapes in well-known binary, as cells of GeoPackages hold them, to geometries of GeoJSON.

Counts are compared with the bytes that are left before anything is read: GEOS trusts them.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

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

    UnreadShapeError for curves and surfaces; ValueError for a damaged cell.
    """
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
            raise ValueError(f"it asks for {count} bytes at byte {self.at}, where {len(self.data) - self.at} are left")
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
