# SPDX-License-Identifier: MIT
"""Units and origins of drawings and maps."""

from __future__ import annotations

import math
from typing import Any

from ..text import shown
from .geometry import Geometry, Point
from .report import Report

AXIS, FLATTENING = 6378137.0, 1 / 298.257223563  # of the ellipsoid WGS 84 [m]
LARGEST_SECTION = 5000.0  # a drawing without a unit that is larger is hardly in metres
SMALLEST_SECTION = 0.5  # [m]
FAR = 1000.0  # coordinates over extent: from here on, the origin is moved


def from_unit(value: float, unit: float) -> float:
    """value · unit; a unit such as 0.001 divides by 1000, which rounds better."""
    inverse = 1 / unit
    return (
        value / round(inverse)
        if inverse > 1.5 and math.isclose(inverse, round(inverse), rel_tol=1e-12)
        else value * unit
    )


#: Lengths of the units of $INSUNITS [m]: (name, length); 0 is none.
INSUNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 3: ("miles", 1609.344), 4: ("millimeters", 0.001),
    5: ("centimeters", 0.01), 6: ("meters", 1.0), 7: ("kilometers", 1000.0), 8: ("microinches", 2.54e-8),
    9: ("mils", 2.54e-5), 10: ("yards", 0.9144), 11: ("angstroms", 1e-10), 12: ("nanometers", 1e-9),
    13: ("microns", 1e-6), 14: ("decimeters", 0.1), 15: ("decameters", 10.0), 16: ("hectometers", 100.0),
    17: ("gigameters", 1e9), 18: ("astronomical units", 149_597_870_700.0), 19: ("light years", 9.4607304725808e15),
    20: ("parsecs", 3.0856775814913673e16), 21: ("US survey feet", 1200 / 3937), 22: ("US survey inches", 100 / 3937),
    23: ("US survey yards", 3600 / 3937), 24: ("US survey miles", 6_336_000 / 3937),
}  # fmt: skip


def metres_of(document: Any, extent: float, report: Report, stated: bool = True) -> float | None:
    """The length of a drawing's unit [m] by its $INSUNITS; None with a note, or an error, where it states none.

    `stated`: the file itself holds $INSUNITS; for one without, ezdxf assumes metres."""
    code = document.header.get("$INSUNITS", 0) if stated else 0
    advice = "state its unit: --scale 0.001 for millimetres, --scale 1 to keep the numbers"
    if code == 0:
        if extent > LARGEST_SECTION:
            report.fail(f"the drawing states no unit ($INSUNITS), and its larger extent is {extent:g}: {advice}")
        report.note("the drawing states no unit ($INSUNITS): its numbers are kept (--scale changes them)")
        return None
    if code not in INSUNITS:
        report.fail(f"the drawing states the unknown unit $INSUNITS = {shown(code)}: {advice}")
    name, metres = INSUNITS[code]
    if metres != 1.0:
        report.note(f"the drawing is in {name} ($INSUNITS): lengths are converted to metres, times {metres:g}")
        if extent * metres < SMALLEST_SECTION:
            text = f"with this unit its larger extent is {extent * metres:g} m"
            report.warning(f"{text}: if it was drawn in metres, --scale 1 keeps the numbers")
    return metres


def place(geometry: Geometry, unit: float, origin: Point) -> None:
    """Move `origin`, in the file's coordinates, to 0, 0, and convert lengths."""
    x, y = origin

    def change(point: Point) -> Point:
        return from_unit(point[0] - x, unit), from_unit(point[1] - y, unit)

    if unit != 1 or origin != (0.0, 0.0):
        geometry.move(change)


def move_to_local_origin(geometry: Geometry, report: Report) -> Point | None:
    """Move the origin beside lines that are far from it, and note this; returns the new origin, None if it stays.

    Areas and moments of blocks are sums of products of coordinates: far from the origin they lose digits."""
    ranges, extent = geometry.ranges, geometry.extent
    largest = max(abs(value) for limits in ranges for value in limits)
    if not 0 < extent * FAR < largest:
        return None
    step = 10.0 ** math.floor(math.log10(extent))
    origin = (math.floor(ranges[0][0] / step) * step, math.floor(ranges[1][0] / step) * step)
    place(geometry, 1.0, origin)
    text = f"the origin is moved to {origin[0]:.15g},{origin[1]:.15g}, since the lines are far from 0,0"
    report.note(f"{text}: --origin 0,0 keeps the coordinates")
    return origin


def middle_of(geometry: Geometry) -> Point:
    """The middle of the ranges."""
    (west, east), (south, north) = geometry.ranges
    return (west + east) / 2, (south + north) / 2


def to_metres(geometry: Geometry, middle: Point) -> None:
    """Longitudes and latitudes [degrees, WGS 84] to metres east and north of a point.

    Transverse Mercator about the meridian of that point (Krüger's series to the fourth power of n): angles are true,
    and lengths at the distance d from the meridian are too long by d²/2R², 1e-6 at 10 km."""
    n = FLATTENING / (2 - FLATTENING)
    eccentricity = 2 * math.sqrt(n) / (1 + n)
    radius = AXIS / (1 + n) * (1 + n**2 / 4 + n**4 / 64)
    series = (
        n / 2 - 2 * n**2 / 3 + 5 * n**3 / 16 + 41 * n**4 / 180,
        13 * n**2 / 48 - 3 * n**3 / 5 + 557 * n**4 / 1440,
        61 * n**3 / 240 - 103 * n**4 / 140,
        49561 * n**4 / 161280,
    )

    def mercator(point: Point) -> Point:
        longitude, sine = math.radians(point[0] - middle[0]), math.sin(math.radians(point[1]))
        t = math.sinh(math.atanh(sine) - eccentricity * math.atanh(eccentricity * sine))
        xi = math.atan2(t, math.cos(longitude))
        eta = math.atanh(math.sin(longitude) / math.hypot(1, t))
        x = eta + sum(a * math.cos(2 * j * xi) * math.sinh(2 * j * eta) for j, a in enumerate(series, start=1))
        y = xi + sum(a * math.sin(2 * j * xi) * math.cosh(2 * j * eta) for j, a in enumerate(series, start=1))
        return radius * x, radius * y

    north = mercator(middle)[1]

    def change(point: Point) -> Point:
        x, y = mercator(point)
        return x, y - north

    geometry.move(change)
