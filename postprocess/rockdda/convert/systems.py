# SPDX-License-Identifier: MIT
"""Reference systems of maps, as far as they concern lengths: their unit, degrees, web Mercator; and which differ."""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from ..text import shown
from .geometry import Point

TOKEN = re.compile(r'([A-Za-z_]\w*)\s*[\[(]|"((?:[^"]|"")*)"|([^\s\[\](),"]+)|([\])])')
PROJECTED = ("PROJCS", "PROJCRS", "PROJECTEDCRS", "DERIVEDPROJCRS")
GEOGRAPHIC = ("GEOGCS", "GEOGCRS", "GEODCRS", "GEODETICCRS", "GEOGRAPHICCRS")
LOCAL = ("LOCAL_CS", "ENGCRS", "ENGINEERINGCRS")
UNITS = ("UNIT", "LENGTHUNIT", "ANGLEUNIT")
WEB_NAMES = ("pseudo mercator", "auxiliary sphere", "web mercator", "google mercator", "spherical mercator")
WEB_CODES = (3857, 3785, 900913, 102100, 102113)
#: Projections of the whole earth, whose lengths are true on few lines only.
WORLD = ("mercator", "mercator 1sp", "mercator 2sp", "mercator variant a", "mercator variant b", "equirectangular",
         "plate carree", "equidistant cylindrical", "miller cylindrical", "cylindrical equal area", "robinson",
         "mollweide", "sinusoidal", "winkel tripel", "vandergrinten", "lambert cylindrical equal area")  # fmt: skip
SPHERE = 6378137.0  # radius of web Mercator [m]
DEEPEST = 50  # brackets within brackets
LARGEST_TEXT = 100_000


@dataclass(frozen=True)
class System:
    """What coordinates are: lengths in a unit [m], longitudes and latitudes [degrees], or web Mercator."""

    kind: str = "lengths"  # or degrees, web
    unit: float = 1.0
    problem: str = ""  # why lengths cannot be known
    name: str = ""  # none: a drawing without a system
    code: int = 0  # of EPSG, 0: not known
    numbers: tuple[float, ...] = ()  # of the ellipsoid and the projection

    def differs(self, other: System) -> bool:
        """True where the same coordinates are another place in the other system."""
        if (self.kind, self.unit, self.problem) != (other.kind, other.unit, other.problem):
            return True
        if not (self.name and other.name):
            return False
        return self.code != other.code if self.code and other.code else self.numbers != other.numbers


#: What to do with maps in several systems.
ADVICE = "bring them into one (ogr2ogr -t_srs, or save them anew from a GIS)"

WGS84 = System("degrees", name="EPSG:4326", code=4326, numbers=(6378137.0, 298.257224))


@dataclass
class _Node:
    name: str
    values: list[str] = field(default_factory=list)
    parts: list[_Node] = field(default_factory=list)

    def walk(self) -> Iterator[_Node]:
        """This node and all below, those of higher levels first."""
        level = [self]
        while level:
            yield from level
            level = [part for node in level for part in node.parts]

    def first(self, names: tuple[str, ...]) -> _Node | None:
        """The first node of these names."""
        return next((node for node in self.walk() if node.name in names), None)


def of_text(text: str) -> System | None:
    """A reference system in well-known text, of version 1 or 2; None for a text that is none."""
    root = _tree(text)
    if root is None:
        return None
    found = root.first(PROJECTED) or root.first(LOCAL)
    if found is not None:
        return _named(_of_lengths(found), found)
    found = root.first(GEOGRAPHIC)
    if found is None:
        known = root.first(("GEOCCS",))
        return System(problem="its coordinates are geocentric, not those of a map") if known else None
    if any(node.values[:1] == ["Cartesian"] for node in found.walk() if node.name == "CS"):
        return System(problem="its coordinates are geocentric, not those of a map")
    angle = _unit(found)
    if angle is not None and not math.isclose(angle[1], math.pi / 180, rel_tol=1e-6):
        return System(problem=f"it counts angles in {shown(angle[0])} of {angle[1]:g} rad, not in degrees")
    return _named(System("degrees"), found)


def of_name(name: str) -> System:
    """A reference system by name: EPSG:32633, urn:ogc:def:crs:OGC:1.3:CRS84 ..."""
    axes = re.search(r"CRS(84h?|83|27)$", name.strip(), re.I)
    if axes:
        name = "EPSG:" + {"84": "4326", "83": "4269", "27": "4267"}[axes[1][:2]]
    match = re.search(r"EPSG[:/]+(?:[\d.]*[:/]+)?(\d{1,6})$", name.strip(), re.I)
    code = int(match.group(1)) if match else 0
    if code in WEB_CODES:
        return System("web")
    if code == WGS84.code:
        return WGS84
    if code in (4258, 4269, 4267):
        ellipsoid = (6378206.4, 294.978698) if code == 4267 else (6378137.0, 298.257222)
        return System("degrees", name=f"EPSG:{code}", code=code, numbers=ellipsoid)
    if code // 100 in (326, 327) and 1 <= code % 100 <= 60:
        meridian, north = 6.0 * (code % 100) - 183, 1e7 if code // 100 == 327 else 0.0
        numbers = (*WGS84.numbers, *sorted(value for value in (0.9996, 5e5, meridian, north) if value))
        return System(name=f"EPSG:{code}", code=code, numbers=numbers)
    if code:
        try:
            pyproj = importlib.import_module("pyproj")
            found = of_text(pyproj.CRS.from_epsg(code).to_wkt())
        except ImportError:
            return System(problem="pip install pyproj, which has it")
        except Exception as error:  # of any kind in pyproj
            return System(problem=str(error))
        if found is not None:
            return replace(found, name=f"EPSG:{code}", code=code)
    return System(problem="it is not known")


def _tree(text: str) -> _Node | None:
    """The outermost node of well-known text; None where brackets do not fit."""
    top = _Node("")
    open_nodes = [top]
    for match in TOKEN.finditer(text[:LARGEST_TEXT]):
        name, quoted, word, close = match.groups()
        if name is not None:
            if len(open_nodes) > DEEPEST:
                return None
            node = _Node(name.upper())
            open_nodes[-1].parts.append(node)
            open_nodes.append(node)
        elif close is not None:
            if len(open_nodes) < 2:
                return None
            open_nodes.pop()
        else:
            open_nodes[-1].values.append(quoted if quoted is not None else word)
    return top if top.parts and len(open_nodes) == 1 else None


def _unit(node: _Node) -> tuple[str, float] | None:
    """Name and size of the unit of a system, else of its axes."""
    for owner in (node, *(part for part in node.parts if part.name in ("AXIS", "CS"))):
        for part in owner.parts:
            if part.name in UNITS and len(part.values) > 1:
                try:
                    return part.values[0], float(part.values[1])
                except ValueError:
                    return part.values[0], math.nan
    return None


def _named(system: System, node: _Node) -> System:
    """The system with the name, code and numbers that its node has."""
    codes = [part.values[1] for part in node.parts if part.name in ("AUTHORITY", "ID") and part.values[:1] == ["EPSG"]]
    ellipsoid = node.first(("SPHEROID", "ELLIPSOID"))
    texts = ellipsoid.values[1:3] if ellipsoid else []
    parameters = sorted(n for part in node.walk() if part.name == "PARAMETER" for n in _numbers(part.values[1:2]) if n)
    code = int(codes[0]) if codes and re.fullmatch(r"\d{1,6}", codes[0], re.ASCII) else 0
    return replace(system, name=" ".join(node.values[:1]), code=code, numbers=(*_numbers(texts), *parameters))


def _numbers(texts: list[str]) -> list[float]:
    """Numbers with as many digits as all writers of a system give."""
    try:
        return [float(f"{float(text):.9g}") for text in texts]
    except ValueError:
        return []


def _of_lengths(node: _Node) -> System:
    """A projected or local system."""
    methods = [part for owner in (node, *node.parts) for part in owner.parts if part.name in ("PROJECTION", "METHOD")]
    words = [_plain(value) for part in methods for value in part.values[:1]]
    names = [*words, *(_plain(value) for value in node.values[:1])]
    codes = [part.values for part in node.parts if part.name in ("AUTHORITY", "ID")]
    proj = [value for part in node.parts if part.name == "EXTENSION" for value in part.values]
    if (
        any(web in name for web in WEB_NAMES for name in names)
        or any(len(code) > 1 and code[1] in map(str, WEB_CODES) for code in codes)
        or any("+proj=merc" in value and "+b=6378137" in value for value in proj)
    ):
        return System("web")
    if any(word in WORLD for word in words):
        return System(problem=f"lengths are not true in its projection {shown(words[0])}")
    unit = _unit(node)
    if unit is None:
        return System()
    name, size = unit
    if name.lower() == "unknown" and not size > 0:
        return System(problem="the file has none")
    if not 1e-4 <= size <= 1e4:
        return System(problem=f"its unit {shown(name)} of {size:g} m is none of length")
    return System(unit=size)


def _plain(name: str) -> str:
    return " ".join(re.findall(r"[a-z0-9]+", name.lower()))


def degrees_of_web(point: Point) -> Point:
    """Longitude and latitude of a point in web Mercator."""
    x, y = point
    return math.degrees(x / SPHERE), math.degrees(math.atan(math.sinh(min(max(y / SPHERE, -700.0), 700.0))))
