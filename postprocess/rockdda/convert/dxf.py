# SPDX-License-Identifier: MIT
"""DXF drawings to lines, and blocks back to DXF.

The layer of a line defines its kind. Names with a fixed meaning (upper or lower case) are `boundary`, `joint_2`
(joint material 2), `boundary_2`, `material_3` (material lines), `area`, `opening`, `block_2` (closed outlines),
`fixed`, `loading`, `measured`, `hole` and `bolt`; every other layer with lines gets a separate joint material, in
alphabetical order. `layers` overrides this by name, for example {"FAULTS": "joint:2", "TEXT": "skip"}.
"""

from __future__ import annotations

import importlib
import itertools
import math
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError, need
from ..text import short
from ..writing import complete_file
from .dxf_blocks import DRAWN, drawn
from .geometry import KINDS, LARGEST_MATERIAL, POINT_KINDS, REGION_KINDS, Geometry, Point
from .placing import from_unit, metres_of
from .report import MOST_LINES, Report, check_size

if TYPE_CHECKING:
    from ..results import Frame

SPEAKING = re.compile(
    r"(boundary|joint|material|area|opening|block(?:[_ ]material)?|fixed|load|loading|measured|hole|bolt)"
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
        elif name in known:
            kinds[name] = known[name]
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
    return "loading" if word == "load" else "block" if word.startswith("block") else word


def read_dxf(
    path: Path,
    layers: dict[str, str] | None = None,
    chord: float | None = None,
    *,
    scale: float | None = None,
    default: str | None = None,
    known: dict[str, tuple[str, int]] | None = None,
) -> tuple[Geometry, Report, float]:
    """The lines of a drawing's model space, in the drawing's unit, and the length of that unit.

    Curves become chords no farther from them than `chord`, by default 1/2000 of the drawing's larger extent. `scale` is
    the unit's length if it is given, else it follows from the drawing's $INSUNITS [m]. `known` are the layers of other
    drawings; those of this one are added.
    """
    report = Report(path)
    document = _read(path, report)
    try:
        entities = list(drawn(document, path, report))
    except (InputError, MemoryError):
        raise
    except Exception as error:  # broken drawings end in errors of any kind in ezdxf
        raise InputError(
            f"the DXF drawing is broken: {type(error).__name__}: {short(str(error), 200)}", path
        ) from error
    count = Counter(entity.dxf.layer for entity in entities)
    names = sorted(count)
    try:
        kinds = kinds_of_layers(names, layers or {}, default, known)
    except ValueError as error:
        raise InputError(str(error), path) from error
    if known is not None:
        known.update(kinds)
    extent = _extent(entities, report)
    unit = scale if scale is not None else metres_of(document, extent, report, _states_unit(path))
    smallest = 1e-6 * extent
    if chord is not None:
        chord = from_unit(chord, 1 / unit)
        if chord < smallest:
            report.error(
                f"chords are at most 1e-6 of the drawing's extent off, {smallest * unit:g}: not {chord * unit:g}"
            )
            report.raise_errors()
    geometry = Geometry()
    for entity in entities:
        kind, material = kinds[entity.dxf.layer]
        try:
            _add(entity, kind, material, geometry, report, max(chord or extent / 2000, smallest))
        except MemoryError:
            raise
        except Exception as error:  # of any kind in ezdxf
            place = f"{entity.dxftype()} (handle {entity.dxf.handle}) on layer {short(entity.dxf.layer)!r}"
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
    return geometry, report, unit


def _extent(entities: list[Any], report: Report) -> float:
    """The larger extent of a drawing, from the corners and control points."""
    from ezdxf import bbox

    extent = 0.0
    try:
        box = bbox.extents(entities, fast=True)
        if box.has_data:
            extent = max(box.size.x, box.size.y)
            extent = max(extent, 0.0) if max(map(abs, (*box.extmin.vec2, *box.extmax.vec2))) < 1e30 else math.nan
    except Exception:  # of any kind in ezdxf
        extent = math.nan
    if not math.isfinite(extent):
        report.error("there are coordinates that are infinite, no numbers, or beyond 1e30")
        report.raise_errors()
    return extent


def _read(path: Path, report: Report) -> Any:
    """The drawing; a damaged one is repaired as far as ezdxf can, with a warning."""
    ezdxf = need("ezdxf", "dxf", "reading DXF drawings")
    recover = importlib.import_module("ezdxf.recover")
    check_size(path)
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
            raise InputError(f"the DXF drawing is broken: {short(first, 200)}", path) from error
        report.warning(f"the DXF drawing is broken ({short(first, 200)}) and was repaired: something may be missing")
        return document


def _states_unit(path: Path) -> bool:
    """Does the file hold $INSUNITS? The name is the same in text and binary drawings."""
    return b"$INSUNITS" in path.read_bytes()


def _check_finite(geometry: Geometry, report: Report) -> None:
    """No coordinate may be infinite or no number."""
    rows = [segment for segment, _ in geometry.lines + geometry.material_lines]
    rows += [*geometry.fixed, *geometry.bolts, *geometry.loading, *geometry.measured, *geometry.holes]  # type: ignore[list-item]
    if not all(math.isfinite(value) for row in rows for value in row):
        report.error("there are coordinates that are infinite or no numbers")


def _add(entity: Any, kind: str, material: int, geometry: Geometry, report: Report, chord: float) -> None:
    """Add what one entity draws."""
    if kind == "skip":
        report.leave(f"{entity.dxftype()} on a layer of kind skip", f"{entity.dxftype()}s on layers of kind skip")
        return
    if kind in POINT_KINDS or entity.dxftype() == "POINT":
        _add_point(entity, kind, geometry, report)
        return
    corners = _corners(entity, chord)
    if kind == "block":
        if len(corners) > 3 and corners[0] == corners[-1]:
            geometry.blocks.append((material, 1, corners[:-1]))
        else:
            report.leave(
                f"open {entity.dxftype()} on a layer of blocks", f"open {entity.dxftype()}s on layers of blocks"
            )
        return
    if kind in REGION_KINDS:
        geometry.chains.append((kind, material, corners))
        return
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
        center = entity.ocs().to_wcs(dxf.center)  # mirrored circles count in another system
        place = (float(center.x), float(center.y))
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
    """The outlines of a frame's blocks as closed polylines on layers `block_material_N`, fixed points and bolts."""
    ezdxf = need("ezdxf", "dxf", "writing DXF drawings")
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 0  # the unit of results is known to their user only
    space = document.modelspace()
    results = frame.results
    for material in np.unique(results.block_material):
        document.layers.add(f"block_material_{material}", color=int(material - 1) % 6 + 1)
    document.layers.add("fixed_points", color=1)
    there = frame.active.tolist()  # excavated blocks, and those still to be placed, are left out
    for polygon, material, active in zip(frame.polygons(), results.block_material, there, strict=True):
        if not active:
            continue
        space.add_lwpolyline(polygon, close=True, dxfattribs={"layer": f"block_material_{material}"})
    points: npt.NDArray[Any] = results.fixed_points
    for x, y in points:
        space.add_point((x, y), dxfattribs={"layer": "fixed_points"})
    if len(frame.bolt_ends):
        document.layers.add("bolts", color=5)
    for start, end in frame.bolt_ends.tolist():
        space.add_line(start, end, dxfattribs={"layer": "bolts"})
    with complete_file(path) as part:
        document.saveas(part)
    return path
