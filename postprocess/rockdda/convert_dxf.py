# SPDX-License-Identifier: MIT
"""DXF drawings to lines, and blocks back to DXF.

Layers say what a line is. Names that speak for themselves (whatever their case) are `boundary`, `joint_2` (joint
material 2), `boundary_2`, `material_3` (material lines), `fixed`, `loading`, `measured`, `hole` and `bolt`; every
other layer with lines gets a joint material of its own, in alphabetical order. `layers` overrides this by name, for
example {"FAULTS": "joint:2", "TEXT": "skip"}.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .convert_model import Geometry, Point
from .convert_report import Report
from .errors import InputError, OutputError

if TYPE_CHECKING:
    from .results import Frame

KINDS = ("joint", "boundary", "material", "fixed", "loading", "measured", "hole", "bolt", "skip")
SPEAKING = re.compile(
    r"(boundary|joint|material|fixed|load|loading|measured|hole|bolt)(?:s|[ _-]?(?:line|point)s?)?[ _:-]*(\d+)?$", re.I
)
POINT_KINDS = ("loading", "measured", "hole")
DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")


def parse_kind(text: str) -> tuple[str, int]:
    """'joint:2' as ('joint', 2); ValueError for anything that is no kind of line."""
    name, _, number = text.strip().lower().partition(":")
    name = "loading" if name == "load" else name
    if name not in KINDS or (number and (not number.isdigit() or int(number) < 1)):
        raise ValueError(f"{text!r} is no kind of line: one of {', '.join(KINDS)}, with a material as in joint:2")
    return name, int(number or 1)


def kinds_of_layers(names: list[str], given: dict[str, str]) -> dict[str, tuple[str, int]]:
    """Kind and material of the lines on each layer."""
    kinds: dict[str, tuple[str, int]] = {}
    asked = {name.lower(): parse_kind(kind) for name, kind in given.items()}
    for name in names:
        match = SPEAKING.match(name)
        if name.lower() in asked:
            kinds[name] = asked[name.lower()]
        elif match:
            kind = match.group(1).lower()
            kinds[name] = ("loading" if kind == "load" else kind, int(match.group(2) or 1))
    used = {material for kind, material in kinds.values() if kind in ("joint", "boundary")}
    free = (i for i in range(1, len(names) + len(used) + 2) if i not in used)
    for name in sorted(set(names) - set(kinds), key=str.lower):
        kinds[name] = ("joint", next(free))
    return kinds


def read_dxf(
    path: Path, layers: dict[str, str] | None = None, e0: float | None = None, chord: float | None = None
) -> tuple[Geometry, Report]:
    """The lines of a drawing's model space; curves become chords no farther from them than `chord`.

    `chord` is by default 1/2000 and `e0` 1/10,000 of the drawing's larger extent.
    """
    from ezdxf import bbox

    report = Report(path)
    document = _read(path, report)
    entities = list(_drawn(document.modelspace(), report))
    names = sorted({entity.dxf.layer for entity in entities})
    try:
        kinds = kinds_of_layers(names, layers or {})
    except ValueError as error:
        raise InputError(str(error), path) from error
    for name in layers or {}:
        if name.lower() not in {known.lower() for known in names}:
            report.warning(f"there is nothing on a layer {name!r}; the layers are: {', '.join(names) or 'none'}")
    box = bbox.extents(entities)
    extent = max(box.size.x, box.size.y) if box.has_data else 0.0
    chord = chord if chord is not None else extent / 2000
    geometry = Geometry(e0=e0 if e0 is not None else extent / 10_000)
    for entity in entities:
        kind, material = kinds[entity.dxf.layer]
        try:
            _add(entity, kind, material, geometry, report, chord)
        except (ValueError, ZeroDivisionError, OverflowError, ArithmeticError) as error:
            report.error(f"{entity.dxftype()} (handle {entity.dxf.handle}) on layer {entity.dxf.layer!r}: {error}")
    _check_finite(geometry, report)
    for name in names:
        kind, material = kinds[name]
        count = sum(entity.dxf.layer == name for entity in entities)
        what = f"{kind} {material}" if kind in ("joint", "boundary", "material") else kind
        report.note(f"layer {name!r}: {count} entities as {what}")
    if not geometry.lines:
        report.error(f"no lines: the model space has none of {', '.join(DRAWN)} on a layer of joints or boundaries")
    report.raise_errors()
    return geometry, report


def _read(path: Path, report: Report) -> Any:
    """The drawing; a damaged one is repaired as far as ezdxf can, with a warning."""
    import ezdxf
    from ezdxf import recover

    try:
        return ezdxf.readfile(path)
    except FileNotFoundError as error:
        raise InputError("no such file", path) from error
    except OSError as error:
        raise InputError(f"is no DXF drawing, or cannot be read: {error}", path) from error
    except Exception as error:  # broken drawings end in errors of any kind there
        first = f"{type(error).__name__}: {error}" if not isinstance(error, ezdxf.DXFError) else str(error)
        try:
            document, _ = recover.readfile(path)
        except Exception:
            raise InputError(f"the DXF drawing is broken: {first}", path) from error
        report.warning(f"the DXF drawing is broken ({first}) and was repaired: something may be missing")
        return document


def _check_finite(geometry: Geometry, report: Report) -> None:
    """No coordinate may be infinite or no number."""
    rows = [segment for segment, _ in geometry.lines + geometry.material_lines]
    rows += [*geometry.fixed, *geometry.bolts, *geometry.loading, *geometry.measured, *geometry.holes]  # type: ignore[list-item]
    if not all(math.isfinite(value) for row in rows for value in row):
        report.error("there are coordinates that are infinite or no numbers")


def _drawn(space: Any, report: Report) -> Iterator[Any]:
    """All lines, curves and points, also those within block references; the rest is counted in warnings."""
    others: Counter[str] = Counter()

    def walk(entities: Any, depth: int) -> Iterator[Any]:
        for entity in entities:
            kind = entity.dxftype()
            if kind in (*DRAWN, "POINT"):
                yield entity
            elif kind == "INSERT" and depth < 16:
                yield from walk(entity.virtual_entities(), depth + 1)
            else:
                others[kind] += 1

    yield from walk(space, 0)
    for kind, count in sorted(others.items()):
        report.warning(f"{count} entities of type {kind} are ignored")


def _add(entity: Any, kind: str, material: int, geometry: Geometry, report: Report, chord: float) -> None:
    """Add what one entity draws."""
    if kind == "skip":
        return
    if kind in POINT_KINDS or entity.dxftype() == "POINT":
        _add_point(entity, kind, geometry, report)
        return
    corners = _corners(entity, chord)
    pairs = [(*a, *b) for a, b in itertools.pairwise(corners) if a != b]
    if kind == "fixed":
        geometry.fixed += pairs
    elif kind == "bolt":
        geometry.bolts.append((*corners[0], *corners[-1]))
    else:
        lines = {"joint": geometry.joints, "boundary": geometry.boundary, "material": geometry.material_lines}[kind]
        lines += [(pair, material) for pair in pairs]


def _add_point(entity: Any, kind: str, geometry: Geometry, report: Report) -> None:
    dxf = entity.dxf
    if entity.dxftype() == "POINT":
        place = (float(dxf.location.x), float(dxf.location.y))
    elif entity.dxftype() == "CIRCLE":
        place = (float(dxf.center.x), float(dxf.center.y))
    else:
        report.warning(f"a {entity.dxftype()} on layer {dxf.layer!r} is ignored: points are POINTs or CIRCLEs there")
        return
    into = {"loading": geometry.loading, "measured": geometry.measured, "hole": geometry.holes}.get(kind)
    if kind == "fixed":
        geometry.fixed.append((*place, *place))
    elif into is not None:
        into.append(place)
    else:
        report.warning(f"a POINT on layer {dxf.layer!r} is ignored: that layer is for lines")


def _corners(entity: Any, chord: float) -> list[Point]:
    """The corners of a line, or of the chords of a curve; their ends lie on it."""
    kind = entity.dxftype()
    if kind == "LINE":
        points = [entity.dxf.start, entity.dxf.end]
    elif kind in ("LWPOLYLINE", "POLYLINE"):
        points = []
        for part in entity.virtual_entities():  # lines, and arcs where it bulges
            corners = _corners(part, chord)
            points += corners if not points or points[-1] != corners[0] else corners[1:]
        return points
    else:
        points = list(entity.flattening(max(chord, 1e-12)))
    return [(float(point.x), float(point.y)) for point in points]


def write_dxf(frame: Frame, path: Path) -> Path:
    """The outlines of a frame's blocks as closed polylines on layers `block_material_N`, and the fixed points."""
    import ezdxf

    document = ezdxf.new("R2010")
    space = document.modelspace()
    results = frame.results
    for material in np.unique(results.block_material):
        document.layers.add(f"block_material_{material}", color=int(material - 1) % 6 + 1)
    document.layers.add("fixed_points", color=1)
    for polygon, material in zip(frame.polygons(), results.block_material, strict=True):
        space.add_lwpolyline(polygon, close=True, dxfattribs={"layer": f"block_material_{material}"})
    points: npt.NDArray[Any] = results.fixed_points
    for x, y in points:
        space.add_point((x, y), dxfattribs={"layer": "fixed_points"})
    try:
        document.saveas(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror}") from error
    return path
