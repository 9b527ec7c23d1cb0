# SPDX-License-Identifier: MIT
"""DXF drawings to lines, and blocks back to DXF.

The layer of a line defines its kind. Names with a fixed meaning (upper or lower case) are `boundary`, `joint_2`
(joint material 2), `boundary_2`, `material_3` (material lines), `area`, `opening`, `block_2` (closed outlines),
`fixed`, `loading`, `measured`, `hole`, `bolt` and `liner`; every other layer with lines gets a separate joint
material, in alphabetical order. `layers` overrides this by name, for example {"FAULTS": "joint:2", "TEXT": "skip"}.
"""

from __future__ import annotations

import importlib
import itertools
import logging
import math
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray
from ..errors import InputError, need
from ..text import read_bytes, short
from ..writing import complete_file
from .dxf_blocks import DRAWN, MOST_ENTITIES, Clip, Shown, drawn
from .geometry import KINDS, LARGEST_MATERIAL, POINT_KINDS, REGION_KINDS, STEEL_KINDS, Geometry, Point
from .placing import from_unit, metres_of
from .report import LONGEST_MESSAGE, MOST_LINES, Report

if TYPE_CHECKING:
    from ..results import Frame

FLAT = 1e-9  # of the extent
MOST_ROWS = 3_000_000  # of a drawing; with that many vertices it takes some 15 s and 450 MB
ENTITY = re.compile(rb"[\r\n][ \t]*0[ \t]*\r?[\r\n][ \t]*[A-Z]")  # group 0 and a name: no value is followed by a letter
FRAME = 16  # flag of a vertex of the control frame
SPEAKING = re.compile(
    r"(boundary|joint|material|area|opening|block(?:[_ ]material)?|fixed|load|loading|measured|hole|"
    r"bolt[ _-](?:grouted|end[ _-]anchored|yielding|friction)|bolt|liner|lining)"
    r"(?:s|[ _-]?(?:line|point)s?)?[ _:-]*(\d+)?$",
    re.I,
)


def parse_kind(text: str) -> tuple[str, int]:
    """'joint:2' as ('joint', 2); ValueError for anything that is no kind of line."""
    name, _, number = text.strip().lower().partition(":")
    name = "loading" if name == "load" else name
    if name not in KINDS or (number and not _is_material(number)):
        raise ValueError(
            f"{short(text)!r} is no kind of line: one of {', '.join(KINDS)}, with a material as in joint:2"
        )
    return name, int(number or 1)


def _is_material(digits: str) -> bool:
    return digits.isascii() and digits.isdigit() and len(digits) < 10 and 1 <= int(digits) <= LARGEST_MATERIAL


def kinds_of_layers(
    names: list[str], given: dict[str, str], default: str | None = None, known: dict[str, tuple[str, int]] | None = None
) -> dict[str, tuple[str, int]]:
    """Kind and material of the lines on each layer; `known` are those of other drawings, `default` is of all others."""
    kinds: dict[str, tuple[str, int]] = {}
    known = known or {}
    asked = {name.lower(): parse_kind(kind) for name, kind in given.items()}
    for name in names:
        match = SPEAKING.match(name)
        if name.lower() in asked:
            kinds[name] = asked[name.lower()]
        elif match and (match.group(2) is None or _is_material(match.group(2))):
            kinds[name] = (kind_of(match.group(1)), int(match.group(2) or 1))
        elif default is not None and default != "block":
            kinds[name] = (default, 1)
        elif name.lower() in known:
            kinds[name] = known[name.lower()]
    rest = default or "joint"
    outlines = ("block",) if rest == "block" else ("joint", "boundary", *REGION_KINDS)
    used = {material for kind, material in [*kinds.values(), *known.values()] if kind in outlines}
    free = (i for i in range(1, len(names) + len(used) + 2) if i not in used)
    for name in sorted(set(names) - set(kinds), key=str.lower):
        kinds[name] = (rest, next(free))
    return kinds


def kind_of(word: str) -> str:
    """The kind that the first word of a layer's name means."""
    word = word.lower()
    if word.startswith("bolt"):
        return re.sub("[ -]", "_", word)
    if word == "lining":
        return "liner"
    return "loading" if word == "load" else "block" if word.startswith("block") else word


def read_dxf(
    path: Path, layers: dict[str, str] | None = None, chord: float | None = None, *, scale: float | None = None,
    default: str | None = None, known: dict[str, tuple[str, int]] | None = None,
) -> tuple[Geometry, Report, float | None]:  # fmt: skip
    """The lines of a drawing's model space, in the drawing's unit, and the length of that unit.

    Curves become chords no farther from them than `chord`, by default 1/2000 of the drawing's larger extent. `scale` is
    the unit's length if it is given, else it follows from the drawing's $INSUNITS [m]; None where it states none.
    `known` are the layers of other drawings; those of this one are added."""
    report = Report(path)
    logged = _Logged(report)
    with logged:
        document = _read(path, report)
    try:
        with logged:
            entities = list(drawn(document, path, report))
    except (InputError, MemoryError):
        raise
    except Exception as error:  # broken drawings end in errors of any kind in ezdxf
        raise InputError(
            f"the DXF drawing is broken: {type(error).__name__}: {short(str(error), 200)}", path
        ) from error
    count = Counter(shown.layer for shown in entities)
    names = sorted(count)
    try:
        kinds = kinds_of_layers(names, layers or {}, default, known)
    except ValueError as error:
        raise InputError(str(error), path) from error
    if known is not None:
        known.update({name.lower(): kind for name, kind in kinds.items()})
    extent, axes = _plane(entities, report)
    stated = scale if scale is not None else metres_of(document, extent, report, b"$INSUNITS" in path.read_bytes())
    unit = 1.0 if stated is None else stated
    smallest = 1e-6 * extent
    if chord is not None:
        chord = from_unit(chord, 1 / unit)
        if chord < smallest:
            report.fail(
                f"chords are at most 1e-6 of the drawing's extent off, {smallest * unit:g}: not {chord * unit:g}"
            )
    geometry = Geometry()
    adding = _Adding(geometry, report, max(chord or extent / 2000, smallest), axes, smallest)
    for shown in entities:
        try:
            with logged:
                adding.add(shown, *kinds[shown.layer])
        except MemoryError:
            raise
        except Exception as error:  # of any kind in ezdxf
            place = f"{shown.entity.dxftype()} (handle {shown.entity.dxf.handle}) on layer {short(shown.layer)!r}"
            report.error(f"{place}: {error}")
        if len(geometry.boundary) + len(geometry.joints) + len(geometry.material_lines) > MOST_LINES:
            raise InputError(f"the drawing gives more than {MOST_LINES} lines", path)
    _check_finite(geometry, report)
    for name in names:
        kind, material = kinds[name]
        what = f"{kind} {material}" if kind in ("joint", "boundary", "material", "block") else kind
        report.note(f"layer {short(name)!r}: {count[name]} entities as {what}")
    for name in layers or {}:
        if name.lower() not in {found.lower() for found in names}:
            report.warning(f"there is nothing on a layer {name!r}; the layers are: {', '.join(names) or 'none'}")
    if geometry.is_empty:
        report.error(f"no lines: the model space has none of {', '.join(DRAWN)} on a layer of joints or boundaries")
    report.raise_errors()
    return geometry, report, stated


class _Logged(logging.Handler):
    """Makes warnings of the report, each text once, of what ezdxf logs within its `with`."""

    def __init__(self, report: Report) -> None:
        super().__init__(logging.WARNING)
        self._report = report
        self._texts: set[str] = set()

    def __enter__(self) -> None:
        logging.getLogger("ezdxf").addHandler(self)

    def __exit__(self, *_: object) -> None:
        logging.getLogger("ezdxf").removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        text = short(record.getMessage(), LONGEST_MESSAGE)
        if text not in self._texts:
            self._texts.add(text)
            self._report.warning(text)


def _plane(entities: list[Shown], report: Report) -> tuple[float, tuple[int, int]]:
    """The larger extent of a drawing, from the corners and control points, and the two axes of its plane.

    It is x-y unless the drawing is flat in y (or x) and has heights."""
    from ezdxf import bbox

    sizes = np.zeros(3)
    try:
        splines = [shown.entity for shown in entities if shown.entity.dxftype() == "SPLINE"]
        others = (shown.entity for shown in entities if shown.entity.dxftype() != "SPLINE")
        box = bbox.extents(others, fast=True)
        for spline in splines:  # ezdxf goes beyond the ends of periodic ones
            box.extend(spline.control_points if spline.control_point_count() else spline.fit_points)
        if box.has_data:
            largest = max(abs(value) for corner in (box.extmin, box.extmax) for value in corner.xyz)
            sizes = np.array(box.size.xyz) if largest < 1e30 else np.full(3, math.nan)
    except Exception:  # of any kind in ezdxf
        sizes[0] = math.nan
    if not np.isfinite(sizes).all():
        report.fail("there are coordinates that are infinite, no numbers, or beyond 1e30")
    flat = sizes <= FLAT * sizes.max()
    axes: tuple[int, int] = (0, 1)
    if not flat[2] and (flat[0] or flat[1]):
        axes = (0, 2) if flat[1] else (1, 2)
        out = "xyz"[3 - sum(axes)]
        report.note(f"the plane of the model is {'xyz'[axes[0]]}-{'xyz'[axes[1]]}: the drawing is flat in {out}")
    elif not flat[2]:
        report.warning(f"the drawing is not flat: heights z, which differ by {sizes[2]:g}, are left out")
    return float(max(sizes[axis] for axis in axes)), axes


def _read(path: Path, report: Report) -> Any:
    """The drawing; a damaged one is repaired as far as ezdxf can, with a warning."""
    ezdxf = need("ezdxf", "dxf", "reading DXF drawings")
    recover = importlib.import_module("ezdxf.recover")
    _check_work(path)
    try:
        return ezdxf.readfile(path)
    except OSError as error:
        raise InputError(f"is no DXF drawing, or cannot be read: {error}", path) from error
    except Exception as error:  # broken drawings end in errors of any kind there
        first = f"{type(error).__name__}: {error}" if not isinstance(error, ezdxf.DXFError) else str(error)
        try:
            document, _ = recover.readfile(path)
        except Exception:
            raise InputError(f"the DXF drawing is broken: {short(first, 200)}", path) from error
        report.warning(f"the DXF drawing is broken ({short(first, 200)}) and was repaired: something may be missing")
        return document


def _check_work(path: Path) -> None:
    """InputError for a drawing that takes too long and too much memory to read, by what it holds."""
    data = read_bytes(path)
    if data.startswith(b"AutoCAD Binary DXF"):
        what, found, most = "bytes in its binary form", len(data), 32 * MOST_ENTITIES  # a point has 32
    elif (rows := data.count(b"\n") or data.count(b"\r")) > MOST_ROWS:
        what, found, most = "lines of text", rows, MOST_ROWS
    else:
        what, found, most = "entities", sum(1 for _ in ENTITY.finditer(data)), MOST_ENTITIES
    if found > most:
        text = f"the drawing has {found} {what}; at most {most} are converted"
        raise InputError(f"{text}: leave out layers that are not needed, or parts of the drawing", path)


def _check_finite(geometry: Geometry, report: Report) -> None:
    """No coordinate may be infinite or no number."""
    rows: list[Any] = [segment for segment, _ in geometry.lines + geometry.material_lines]
    rows += [
        *geometry.fixed, *geometry.bolts, *(bolt for bolt, _ in geometry.steel),
        *(corner for line in geometry.liners for corner in line), *geometry.loading, *geometry.measured,
        *geometry.holes,
    ]  # fmt: skip
    if not all(math.isfinite(value) for row in rows for value in row):
        report.error("there are coordinates that are infinite or no numbers")


@dataclass
class _Adding:
    """Adds entities to a geometry; curves become chords no farther off than `chord`."""

    geometry: Geometry
    report: Report
    chord: float
    axes: tuple[int, int]  # of the plane
    smallest: float  # ends nearer than this meet

    def add(self, shown: Shown, kind: str, material: int) -> None:
        """Add what one entity draws."""
        entity, layer = shown.entity, shown.layer
        if kind == "skip":
            self.leave(entity, layer, "of kind skip")
            return
        if kind in POINT_KINDS or entity.dxftype() == "POINT":
            self._add_point(shown, kind)
            return
        corners = self.corners(entity)
        if not corners or all(corner == corners[0] for corner in corners):
            self.leave(entity, layer, "without length")
            return
        pieces = [corners]
        if shown.clips:
            closed = len(corners) > 3 and math.dist(corners[0], corners[-1]) <= self.smallest
            pieces = self._clipped(corners, shown.clips, closed and kind in (*REGION_KINDS, "block"))
        if not pieces:
            self.leave(entity, layer, "outside of a clipping path")
        for piece in pieces:
            self._add_corners(piece, entity, layer, kind, material)

    def _clipped(self, corners: list[Point], clips: tuple[Clip, ...], as_area: bool) -> list[list[Point]]:
        """The parts of a line, or of the area in it, that clipping paths leave."""
        shapely = need("shapely", "dxf", "clipping lines")
        shape = shapely.Polygon(corners) if as_area else shapely.LineString(corners)
        for clip in clips:
            window = shapely.Polygon([self._flat(corner) for corner in clip.corners])
            shape = shape.difference(window) if clip.keeps_outside else shape.intersection(window)
        wanted = "Polygon" if as_area else "LineString"
        parts = [part for part in shapely.get_parts(shape) if part.geom_type == wanted and not part.is_empty]
        if any(as_area and len(part.interiors) for part in parts):
            raise ValueError("its clipping path (XCLIP) leaves an outline with a hole: draw both as they are")
        return [[(x, y) for x, y in (part.exterior if as_area else part).coords] for part in parts]

    def _add_corners(self, corners: list[Point], entity: Any, layer: str, kind: str, material: int) -> None:
        geometry = self.geometry
        meets = len(corners) > 3 and math.dist(corners[0], corners[-1]) <= self.smallest
        if kind == "block":
            if meets:
                geometry.blocks.append((material, 1, [corners[:-1]]))
            else:
                self.leave(entity, layer, "of blocks", "open ")
            return
        if meets:
            corners[-1] = corners[0]
        if kind in REGION_KINDS:
            geometry.chains.append((kind, material, corners))
            return
        straight = kind == "bolt" or kind in STEEL_KINDS
        if straight and meets:
            self.leave(entity, layer, "of bolts", "closed ")
            return
        geometry.add_corners(kind, material, [corners[0], corners[-1]] if straight else corners)

    def leave(self, entity: Any, layer: str, why: str, how: str = "") -> None:
        """Count an entity that is not taken."""
        kind, place = entity.dxftype(), f"on layer {short(layer)!r} {why}"
        self.report.leave(f"{how}{kind} {place}", f"{how}{kind}s {place}")

    def _add_point(self, shown: Shown, kind: str) -> None:
        entity, layer = shown.entity, shown.layer
        dxf = entity.dxf
        if entity.dxftype() == "POINT":
            place = self._flat(dxf.location)
        elif entity.dxftype() == "CIRCLE":
            place = self._flat(entity.ocs().to_wcs(dxf.center))  # mirrored circles count in another system
        else:
            self.leave(entity, layer, "of points, which are POINTs or CIRCLEs")
            return
        for clip in shown.clips:
            shapely = need("shapely", "dxf", "clipping points")
            window = shapely.Polygon([self._flat(corner) for corner in clip.corners])
            if window.covers(shapely.Point(place)) == clip.keeps_outside:
                self.leave(entity, layer, "outside of a clipping path")
                return
        if not self.geometry.add_point(kind, place):
            self.leave(entity, layer, "of lines")

    def _flat(self, point: Any) -> Point:
        x, y = self.axes
        return float(point[x]), float(point[y])

    def corners(self, entity: Any) -> list[Point]:
        """The corners of a line, or of the chords of a curve; their ends lie on it."""
        kind = entity.dxftype()
        if kind == "LINE":
            points = [entity.dxf.start, entity.dxf.end]
        elif kind == "POLYLINE" and entity.is_3d_polyline:
            points = [vertex.dxf.location for vertex in _shown_vertices(entity)]
            points += points[:1] if entity.is_closed else []
        elif kind in ("LWPOLYLINE", "POLYLINE"):
            points = _bulged(entity, self.chord)
        elif kind == "SPLINE":
            points = _curve(entity, self.chord)
        else:
            points = list(entity.flattening(max(self.chord, 1e-12)))
        return [corner for corner, _ in itertools.groupby(self._flat(point) for point in points)]


def _shown_vertices(polyline: Any) -> list[Any]:
    """The vertices of a polyline without the control frame of a fitted one, which is not drawn."""
    return [vertex for vertex in polyline.vertices if not vertex.dxf.flags & FRAME]


def _bulged(polyline: Any, chord: float) -> list[Any]:
    """The corners of a polyline in the plane, and those of the chords of its arcs."""
    from ezdxf.math import ConstructionArc, bulge_to_arc

    if polyline.dxftype() == "LWPOLYLINE":
        rows = [(float(x), float(y), float(bulge)) for x, y, bulge in polyline.get_points("xyb")]
        height = float(polyline.dxf.elevation)
    else:
        places = [(vertex.dxf.location, float(vertex.dxf.get("bulge", 0))) for vertex in _shown_vertices(polyline)]
        rows = [(float(place.x), float(place.y), bulge) for place, bulge in places]
        height = float(polyline.dxf.elevation.z)
    if polyline.is_closed:
        rows += rows[:1]
    flat = [row[:2] for row in rows[:1]]
    for (x1, y1, bulge), (x2, y2, _) in itertools.pairwise(rows):
        a, b = (x1, y1), (x2, y2)
        if abs(bulge) * math.dist(a, b) / 2 > chord:  # the height of the arc
            center, start, end, radius = bulge_to_arc(a, b, bulge)
            arc = ConstructionArc(center, radius, math.degrees(start), math.degrees(end))
            inner = [(float(point.x), float(point.y)) for point in arc.flattening(chord)][1:-1]
            flat += inner if bulge > 0 else inner[::-1]
        flat.append(b)
    return list(polyline.ocs().points_to_wcs((x, y, height) for x, y in flat))


def _curve(spline: Any, chord: float) -> list[Any]:
    """Points on a spline, between the knots where it is defined (ezdxf goes beyond them where it is periodic)."""
    if spline.closed and not spline.control_point_count():
        raise ValueError("a closed spline has fit points only: give it control points, or draw it as a polyline")
    tool = spline.construction_tool()
    knots = np.asarray(tool.knots(), dtype=float)
    first, last = knots[tool.order - 1], knots[tool.count]
    points: list[Any] = [tool.point(first)]
    for begin, end in itertools.pairwise(np.unique(knots[(knots >= first) & (knots <= last)])):
        for power in range(2, 13):
            found = list(tool.points(np.linspace(begin, end, 2 ** (power + 1) + 1)))
            heights = (a.lerp(c).distance(b) for a, b, c in zip(found[:-2:2], found[1::2], found[2::2], strict=True))
            if max(heights) < chord:
                break
        points += found[2::2]
    return points


def write_dxf(frame: Frame, path: Path) -> Path:
    """The outlines of a frame's blocks as closed polylines on layers `block_material_N`, fixed points, bolts, linings.

    Holes are closed polylines on the layer `opening`."""
    ezdxf = need("ezdxf", "dxf", "writing DXF drawings")
    document = ezdxf.new("R2010")
    space = document.modelspace()
    results = frame.results
    # metres, millimetres, or none
    document.header["$INSUNITS"] = {"SI": 6, "kN": 6, "mm": 4}.get(results.units, 0)
    for material in np.unique(results.block_material):
        document.layers.add(f"block_material_{material}", color=int(material - 1) % 6 + 1)
    document.layers.add("fixed_points", color=1)
    rings, there = results.rings, frame.active.tolist()  # blocks that are excavated, or still to come, are left out
    if any(len(of_block) > 1 for of_block, active in zip(rings, there, strict=True) if active):
        document.layers.add("opening", color=8)
    for of_block, material, active in zip(rings, results.block_material, there, strict=True):
        for k, ring in enumerate(of_block if active else []):
            layer = f"block_material_{material}" if k == 0 else "opening"
            space.add_lwpolyline(frame.vertices[ring], close=True, dxfattribs={"layer": layer})
    points: AnyArray = results.fixed_points
    for x, y in points:
        space.add_point((x, y), dxfattribs={"layer": "fixed_points"})
    parts = frame.moved_pieces("bolt").stack("x1", "y1", "x2", "y2").tolist()
    if parts:
        document.layers.add("bolts", color=5)
    for x1, y1, x2, y2 in parts:
        space.add_line((x1, y1), (x2, y2), dxfattribs={"layer": "bolts"})
    nodes = frame.liner_node_columns
    for k, closed in enumerate(results.liner_section[:, 3] > 0):
        line = nodes.rows((nodes["liner"] == k) & (nodes["state"] > 0)).stack("x", "y")
        if len(line):
            space.add_lwpolyline(line, close=bool(closed), dxfattribs={"layer": "liner", "color": 6})
    with complete_file(path) as part:
        document.saveas(part)
    return path
