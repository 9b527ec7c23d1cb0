# SPDX-License-Identifier: MIT
"""Foreign input files to RockDDA's own: DDAML of DDA for Windows, drawings, maps, traces, polygons as blocks."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError, Problem, need
from ..native import Session
from ..text import PathLike, decoded, has_controls, shown
from ..writing import write_files
from . import ddaml, dxf, geojson
from .geometry import Analysis, Geometry
from .placing import middle_of, move_to_local_origin, place, to_metres
from .report import Report
from .systems import ADVICE, WGS84, System, degrees_of_web
from .template import supports_of, template_text

DRAWINGS = ("dxf", "geojson", "gis", "traces", "compas")


@dataclass
class Conversion:
    """Files written, and entries left out or assumed."""

    files: list[Path]
    messages: list[str] = field(default_factory=list)  # warnings and notes, as text with the source line
    problems: list[Problem] = field(default_factory=list)  # the same as data
    taken: list[str] = field(default_factory=list)  # the parts of the files in the model
    left: list[str] = field(default_factory=list)  # and what is not


def convert(
    inputs: PathLike | Iterable[PathLike], output: PathLike | None = None, *, layers: dict[str, str] | None = None,
    e0: float | None = None, chord: float | None = None, template: bool = False, force: bool = False,
    areas: PathLike | Iterable[PathLike] = (), scale: float | None = None, origin: tuple[float, float] | None = None,
    window: tuple[float, float, float, float] | None = None, blocks: bool = False, geographic: bool = False,
) -> Conversion:  # fmt: skip
    """Convert DDAML (geometry, analysis or both), or drawings and maps; returns the files written.

    Drawings and maps are DXF, GeoJSON, GeoPackages, Shapefiles, traces as text (FracPaQ) and JSON of COMPAS. The
    files are OUTPUT.dc (.blk for polygons that are blocks), .df and .nml; without `output` they get the name of the
    first input, in the current folder; a folder as `output` (an existing one, or with a final slash) takes them under
    that name. `layers` maps the layers of a drawing to kinds of lines (see `rockdda.convert.dxf`), `e0` is the
    edge-node distance and `chord` the largest distance of chords from curves. `template` also writes a labelled file
    with typical values for rock (m, kg, s, N) where the input has no analysis. Several drawings make one geometry; the
    polygons of the files `areas` clip its lines. `scale` is the length of the drawings' unit (by default that of a
    DXF drawing's $INSUNITS in metres, 1 for GeoJSON and traces); `origin` is the point of the drawings, in their
    coordinates, that becomes 0, 0. `window` (xmin, ymin, xmax, ymax, in these coordinates) is a further area. With
    `blocks` each polygon is a block, and nothing is cut. With `geographic` coordinates are longitudes and latitudes
    [degrees, WGS 84] and become metres. Raises InputError with all problems; nothing is written then. Existing files
    are replaced with `force` only."""
    paths = [Path(inputs)] if isinstance(inputs, str | os.PathLike) else [Path(path) for path in inputs]
    if not paths:
        raise InputError("nothing to convert")
    paths = [member for path in paths for member in (_members(path) if path.is_dir() else [path])]
    given = [areas] if isinstance(areas, str | os.PathLike) else list(areas)
    reading = _Reading(layers or {}, e0, chord, scale, origin, window, blocks, geographic)
    for path in paths:
        reading.read(path)
    for path in map(Path, given):
        reading.read(path, "area")
    geometry, analysis, reports = reading.finish()
    stem = _stem(paths[0], output)
    title = ", ".join(path.name for path in [*paths, *map(Path, given)])
    title = "".join("?" if has_controls(letter) else letter for letter in title) + reading.lengths + reading.moved
    if geometry is not None and not geometry.e0 > 0:
        raise InputError(f"the edge-node distance e0 must be positive, found {geometry.e0:g}", paths[0])
    counted = geometry
    if analysis is not None:
        if geometry is None and analysis.has_tables:
            counted = _neighbour(paths[0], reports[-1])
        _match_loads(counted, analysis, reports[-1])
    elif template and geometry is not None:
        reports[0].note("the labelled file has typical values for rock in m, kg, s, N: change them to yours")
    texts: dict[Path, str] = {}
    if geometry is not None:
        if geometry.bolts and geometry.bolt_values is None:
            reports[0].warning("the bolts have no stiffness: the program ignores them")
        for found, words in ((geometry.steel, "bolts with a kind"), (geometry.liners, "linings")):
            if found and not (template and analysis is None):
                reports[0].warning(f"{words} stand in the labelled file: --template writes it; they are left out")
        if geometry.blocks:
            from .blocks import blocks_text

            texts[stem.with_name(stem.name + ".blk")] = blocks_text(geometry, f"from {title}")
        else:
            texts[stem.with_name(stem.name + ".dc")] = geometry.text(f"from {title}")
        if template and analysis is None:
            ending = next(iter(texts)).suffix
            texts[stem.with_name(stem.name + ".nml")] = template_text(geometry, stem.name, ending, f"from {title}")
            _note_supports(geometry, reports[0])
    if analysis is not None:
        if counted is not None and analysis.has_tables:
            analysis.fixed_count = _count_fixed(counted)
        texts[stem.with_name(stem.name + ".df")] = analysis.text(f"from {title}")
        options = analysis.options_text()
        if options:
            texts[stem.with_name(stem.name + ".nml")] = options
    written = write_files(texts, force, "--force")
    problems = [(report, problem) for report in reports for problem in report.problems]
    return Conversion(
        written, [report.text(p) for report, p in problems], [p for _, p in problems],
        [] if geometry is None else geometry.summary(), [text for report in reports for text in _counted(report)],
    )  # fmt: skip


def _note_supports(geometry: Geometry, report: Report) -> None:
    """Say what holds the model in the labelled file."""
    supports = supports_of(geometry)
    if supports:
        told = "; ".join(f"{kind} along {places}" for kind, places in supports)
        free = "; the sides of the blocks are free" * bool(geometry.blocks)
        report.note(f"the labelled file holds the model by &boundary: {told}{free}")
    elif not geometry.fixed:
        report.note("the labelled file holds the model nowhere: there are no fixed points and no level base")


def _counted(report: Report) -> list[str]:
    """What a file has that was not taken."""
    return [
        f"{report.path}: " + (f"{n} {one if n == 1 else many}" if n else many) for (one, many), n in report.left.items()
    ]


@dataclass
class _Reading:
    """Reads the files of one model, one after the other."""

    layers: dict[str, str]
    e0: float | None
    chord: float | None
    scale: float | None
    origin: tuple[float, float] | None
    window: tuple[float, float, float, float] | None
    blocks: bool
    geographic: bool
    geometry: Geometry | None = None
    analysis: Analysis | None = None
    reports: list[Report] = field(default_factory=list)
    moved: str = ""  # to say where the origin is
    _middle: tuple[float, float] | None = None  # of the first map in degrees
    _system: System | None = None  # of the first map that names one
    _in_web: bool = False  # origin and window are given in web Mercator
    _bolts: tuple[float, float, float] | None = None
    _drawings: list[tuple[Path, float]] = field(default_factory=list)  # and the lengths of their units
    _lengths: set[str] = field(default_factory=set)  # what is known of them
    _unit_is_stated: bool = True  # by the last drawing
    _known: dict[str, tuple[str, int]] = field(default_factory=dict)  # layers of the drawings read so far

    def read(self, path: Path, default: str | None = None) -> None:
        """Read a file; `default` is the kind of lines in drawings that have none."""
        kind = _kind(path)
        if kind in DRAWINGS:
            self._add_drawing(path, kind, default or ("block" if self.blocks else None))
        elif default is not None:
            raise InputError("areas are polygons of a drawing or map", path)
        if kind in ("geometry", "both"):
            if self.geometry is not None:
                raise InputError("there is already a geometry: convert one model at a time", path)
            if self.scale is not None or self.origin is not None:
                raise InputError("scale and origin are those of drawings, DDAML has none", path)
            self.geometry, report = ddaml.read_geometry(path)
            self.geometry.e0 = self.e0 if self.e0 is not None else self.geometry.e0
            self.reports.append(report)
        if kind in ("analysis", "both"):
            if self.analysis is not None:
                raise InputError("there is already an analysis: convert one model at a time", path)
            self.analysis, self._bolts, report = ddaml.read_analysis(path)
            self.reports.append(report)

    def _add_drawing(self, path: Path, kind: str, default: str | None) -> None:
        if self.geometry is not None and not self._drawings:
            raise InputError("there is already a geometry in DDAML: drawings cannot be added to it", path)
        self._unit_is_stated = True
        found, report, system = self._read_drawing(path, kind, default)
        if system is not None and system.problem and self.scale is None and not self.geographic:
            report.fail(
                f"the reference system does not give lengths: {system.problem} (--scale 1 takes the numbers as metres)"
            )
        if system is not None and system.kind == "web" and self.scale is None:
            self._leave_web(found, report)
            system = WGS84
        is_geographic = self.geographic or (system is not None and system.kind == "degrees")
        if self._drawings and is_geographic != (self._middle is not None):
            raise InputError("longitudes and latitudes beside lengths: project one of them first", path)
        self._compare(system, path)
        unit = self.scale if self.scale is not None else 1.0 if system is None else system.unit
        if is_geographic:
            self._project(found, report)
        elif self.scale is None and system is None and geojson.looks_like_degrees(found):
            report.fail(
                "the coordinates seem to be degrees of longitude and latitude: --geographic projects them to metres "
                "(--scale 1 keeps the numbers)"
            )
        elif kind in ("gis", "geojson") and unit != 1.0 and self.scale is None:
            report.note(f"the reference system counts in units of {unit:.9g} m: lengths are converted to metres")
        if self.scale is not None:
            self._lengths.add(f"lengths of the drawing times {self.scale:.9g}")
        elif not is_geographic and (system is None or kind == "compas" or not self._unit_is_stated):
            self._lengths.add(f"lengths as in {path.name}, which states no unit")
        else:
            self._lengths.add("lengths in m")
        if self.origin is not None and any(other != unit for _, other in self._drawings):
            raise InputError("the drawings have different units: an origin needs drawings in one unit", path)
        place(found, unit, self.origin or (0.0, 0.0))
        self._drawings.append((path, unit))
        self.reports.append(report)
        if self.geometry is None:
            self.geometry = found
        else:
            self.geometry.add(found)

    def _compare(self, system: System | None, path: Path) -> None:
        """Refuse a map in another reference system than those before it; --scale takes numbers as they are."""
        if system is None or not system.name or self.scale is not None:
            return
        first = self._system or system
        if system.differs(first):
            raise InputError(
                f"is in the reference system {shown(system.name)}, the maps before in {shown(first.name)}: {ADVICE}",
                path,
            )
        self._system = first

    def _read_drawing(self, path: Path, kind: str, default: str | None) -> tuple[Geometry, Report, System | None]:
        """The lines of a drawing or map, and what its coordinates are, where it says that."""
        if kind == "dxf":
            found, report, unit = dxf.read_dxf(
                path, self.layers, self.chord, scale=self.scale, default=default, known=self._known
            )
            if unit is None:
                self._unit_is_stated = False
            return found, report, System(unit=1.0 if unit is None else unit)
        if kind == "gis":
            from .gis import read_gis

            return read_gis(path, self.layers, default)
        if kind == "traces":
            from .traces import read_traces

            return *read_traces(path), None
        if kind == "compas":
            need("shapely", "dxf", "reading meshes")
            from .compas import read_compas

            return *read_compas(path), System()
        return geojson.read_geojson(path, default)

    def _leave_web(self, found: Geometry, report: Report) -> None:
        """Web Mercator to longitudes and latitudes."""
        found.move(degrees_of_web)
        latitude = middle_of(found)[1]
        report.note(
            "the reference system is web Mercator, where lengths are 1/cos(latitude) too long: they are multiplied by "
            f"{math.cos(math.radians(latitude)):.4g}, at the latitude {latitude:.6g}"
        )
        if not self._in_web:
            self._in_web = True
            self.origin = None if self.origin is None else degrees_of_web(self.origin)

    def _project(self, found: Geometry, report: Report) -> None:
        """Longitudes and latitudes to metres about the middle of the first map."""
        (west, east), (south, north) = found.ranges
        if not (-360 <= west <= east <= 360 and -90 < south <= north < 90 and east - west < 10):
            report.fail(f"no longitudes and latitudes: x from {west:g} to {east:g}, y from {south:g} to {north:g}")
        if self._middle is None:
            self._middle = self.origin or middle_of(found)
            place = f"{self._middle[0]:.9g}, {self._middle[1]:.9g}"
            report.note(f"longitudes and latitudes become metres east and north of {place} (transverse Mercator there)")
            self.moved = f"; 0,0 is at longitude, latitude {place}"
        to_metres(found, self._middle)
        self.origin = (0.0, 0.0)

    @property
    def lengths(self) -> str:
        """What is known of the lengths, for the files that are written."""
        return "".join(f"; {text}" for text in sorted(self._lengths))

    def finish(self) -> tuple[Geometry | None, Analysis | None, list[Report]]:
        """Combine all inputs; clip lines to areas and openings."""
        geometry = self.geometry
        if geometry is not None and self._drawings:
            report = self.reports[0]
            if self.window is not None:
                x1, y1, x2, y2 = self.window
                frame = Geometry(regions=[("area", 1, [[(x1, y1), (x2, y1), (x2, y2), (x1, y2)]])])
                if self._in_web:
                    frame.move(degrees_of_web)
                if self._middle is not None:
                    to_metres(frame, self._middle)
                place(frame, self._drawings[0][1], self.origin or (0.0, 0.0))
                geometry.add(frame)
            if self.origin is None:
                moved = move_to_local_origin(geometry, report)
                self.moved = "" if moved is None else f"; the origin was at {moved[0]:.15g}, {moved[1]:.15g}"
            elif self._middle is None and any(self.origin) and self._drawings[0][1] == 1.0:
                self.moved = f"; the origin was at {self.origin[0]:.15g}, {self.origin[1]:.15g}"
            geometry.e0 = self.e0 if self.e0 is not None else geometry.extent / 10_000
            if geometry.blocks or geometry.regions or geometry.chains:
                need("shapely", "dxf", "clipping lines, and polygons as blocks,")
            if geometry.blocks:
                from .blocks import check_blocks

                check_blocks(geometry, report)
            elif geometry.regions or geometry.chains:
                from .regions import apply_regions

                apply_regions(geometry, report)
            if not geometry.lines and not geometry.blocks:
                report.fail("no lines are left")
        if geometry is not None and self._bolts is not None:
            geometry.bolt_values = self._bolts
        return geometry, self.analysis, self.reports


def _members(folder: Path) -> list[Path]:
    """The files of a folder that make one model, the geometry first."""
    found = {path: ddaml.is_ddaml(path) for path in sorted(folder.iterdir()) if path.is_file()}
    members = [path for kind in ("both", "geometry", "analysis") for path, is_kind in found.items() if is_kind == kind]
    if not members:
        raise InputError("a folder without DDAML files", folder)
    return members


def _neighbour(path: Path, report: Report) -> Geometry | None:
    """The geometry that stands beside an analysis file under the same name."""
    beside = path.with_suffix(".geo")
    if beside == path or ddaml.is_ddaml(beside) not in ("geometry", "both"):
        return None
    report.note(f"points are counted in {beside}")
    return ddaml.read_geometry(beside)[0]


def _kind(path: Path) -> str:
    """Kind of a file, by its content, then by its ending."""
    if not path.exists():
        raise InputError("no such file", path)
    found = ddaml.is_ddaml(path)
    if found:
        return found
    head = decoded(path.open("rb").read(65536)).lstrip()
    if path.suffix.lower() == ".dxf" or head.startswith("AutoCAD Binary DXF"):
        return "dxf"
    if path.suffix.lower() in (".gpkg", ".shp") or head.startswith("SQLite format 3"):
        return "gis"
    if head.startswith(("{", "[")):
        from .compas import is_compas

        if is_compas(head[:4096]):
            return "compas"
    if path.suffix.lower() in (".geojson", ".json") or head.startswith("{"):
        return "geojson"
    if head.startswith("<"):
        raise InputError("is XML, but not DDAML: it has neither 'Geometry' nor 'Analysis'", path)
    from .traces import looks_like_traces

    if looks_like_traces(head):
        return "traces"
    known = "DDAML, DXF, GeoJSON, GeoPackage, Shapefile, JSON of COMPAS, or traces x1 y1 x2 y2 ... in lines"
    raise InputError(f"is none of {known}; RockDDA's own files need no conversion", path)


def _stem(first: Path, output: PathLike | None) -> Path:
    """Path of the output without ending."""
    if output is None:
        return Path(first.stem)
    path = Path(output)
    if str(output).endswith(os.sep):
        path.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        return path / first.stem
    return path.with_suffix("") if path.suffix.lower() in (".dc", ".df", ".nml", ".blk") else path


def _match_loads(geometry: Geometry | None, analysis: Analysis, report: Report) -> None:
    """Every loading point has a table, every table a point."""
    if geometry is None:
        if analysis.has_tables:
            report.error(
                "load points have values, and the analysis file counts all points: name the geometry file, too"
            )
        report.raise_errors()
        return
    points, tables = len(geometry.loading), len(analysis.loading_tables)
    if tables > points:
        report.error(f"there are {tables} load points with values, but the geometry has {points} loading points")
    elif tables < points:
        report.warning(f"{points - tables} of {points} loading points have no values: they carry no load")
        analysis.loading_tables += [[] for _ in range(points - tables)]
    report.raise_errors()


def _count_fixed(geometry: Geometry) -> int:
    """Number of fixed points after cutting: lines become points where they cross blocks."""
    if all(segment[:2] == segment[2:] for segment in geometry.fixed):
        return len(geometry.fixed)
    session = Session()
    session("cut_text", "model.dc", geometry.text(), False)
    return session.sizes()["fixed"]
