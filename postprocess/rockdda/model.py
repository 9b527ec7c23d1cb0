# SPDX-License-Identifier: MIT
"""A model built in Python: lines, points, bolts, materials and options."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .cutting import Blocks, cut
from .deck import AnalysisDeck, BlockMaterial, GeometryDeck, JointMaterial, coordinates, line_rows, whole_number
from .errors import InputError
from .namelist import format_groups, format_real, parse_groups
from .native import ANALYSIS_FILE, CONFIG_FILE, CONFIG_TEXT, DIALECTS, MODEL_FILE, Session
from .options import check_options, names_that_add_up, replace_files
from .results import Results
from .simulation import Simulation, run

__all__ = ["BlockMaterial", "JointMaterial", "Model"]

FloatArray = npt.NDArray[np.float64]
PathLike = str | os.PathLike[str]
Point = Sequence[float] | npt.NDArray[np.float64]
Table = npt.ArrayLike  # (m, 3) rows t x y


@dataclass
class _Line:
    ends: tuple[float, float, float, float]
    number: int  # joint or block material
    boundary: bool = False


@dataclass
class _Bolt:
    ends: tuple[float, float, float, float]
    stiffness: float
    pretension: float
    strength: float


@dataclass
class _Place:
    """A fixed line or a loading point with its values in time."""

    ends: tuple[float, ...]
    table: FloatArray


@dataclass
class Model:
    """A model: geometry, materials, run control. Any consistent set of units.

    >>> import rockdda
    >>> model = rockdda.Model("block", e0=0.01, steps=10, dt_max=0.01)
    >>> model.add_polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    >>> model.add_block_material(density=2500, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25)
    1
    >>> model.add_joint_material(friction_angle=30)
    1
    >>> model.cut().areas
    array([1.])
    """

    name: str = "model"  # of the files
    e0: float = 0.01  # minimum edge-node distance: closer nodes are one
    k01: float = 1.0  # share of the velocity carried into the next step: 0 static … 1 dynamic
    steps: int = 100
    displacement_ratio: float = 0.01  # g2, of a step over half the model's height
    dt_max: float = 0.01  # g1, largest time step
    stiffness: float = 0.0  # g0 of contact springs, 0 automatic
    sor_factor: float = 1.4
    #: options by group and name, as in an options file: {"run": {"t_end": 2.0}, "stage": [{…}, {…}]};
    #: rockdda.options.options_schema describes them
    options: dict[str, Any] = field(default_factory=dict)
    #: (m, 3) rows t ax ay: motion of the base, linear in between
    base_acceleration: npt.ArrayLike | None = None
    block_materials: list[BlockMaterial] = field(default_factory=list)
    joint_materials: list[JointMaterial] = field(default_factory=list)
    _lines: list[_Line] = field(default_factory=list, repr=False)
    _material_lines: list[_Line] = field(default_factory=list, repr=False)
    _bolts: list[_Bolt] = field(default_factory=list, repr=False)
    _fixed: list[_Place] = field(default_factory=list, repr=False)
    _loading: list[_Place] = field(default_factory=list, repr=False)
    _measured: list[tuple[float, float]] = field(default_factory=list, repr=False)
    _holes: list[tuple[float, float]] = field(default_factory=list, repr=False)

    @classmethod
    def read(cls, geometry: PathLike, analysis: PathLike | None = None, config: PathLike | None = None) -> Model:
        """Read a model: a folder, or a geometry file with its analysis file and, if there is one, its options file.

        Written and run, the model does the same as the files. A file of base motion that the options name stays
        where it is.
        """
        session = Session()
        session.read_files(geometry, analysis, config)
        files = (session.text(MODEL_FILE), session.text(ANALYSIS_FILE), session.text(CONFIG_FILE))
        if session.geometry_sizes()["lines"] == 0:
            raise InputError("is a block file; a model is made of lines", files[0])
        model = cls(Path(files[1]).stem)
        model._take_geometry(session)
        model._take_analysis(session)
        model.options = parse_groups(session.text(CONFIG_TEXT), names_that_add_up())
        replace_files(model.options, Path(files[2]).parent)
        if session.analysis_sizes()["dialect"] == DIALECTS["dda_windows"]:
            # defaults of this dialect
            time = model.options.setdefault("time", {})
            for group in [time] if isinstance(time, dict) else time[:1]:
                given = {name for some in ([time] if isinstance(time, dict) else time) for name in some}
                if "length_scale" not in given:
                    group["length_scale"] = "largest"
                if "dt_min" not in given:
                    group["dt_min"] = 0.01 * float(_last(time, "dt_max", model.dt_max))
        return model

    def _take_geometry(self, session: Session) -> None:
        """Take lines and points from the compiled session."""
        sizes = session.geometry_sizes()
        names = "lines materials bolts fixed loading measured holes"
        arrays = [array.tolist() for array in session.array("geometry", *(sizes[name] for name in names.split()))]
        e0, lines, joints, material_lines, materials, bolts, values, fixed, loading, measured, holes = arrays
        self.e0 = e0
        for i, (line, joint) in enumerate(zip(lines, joints, strict=True)):
            self.add_line(line[:2], line[2:], joint=joint, boundary=i < sizes["boundary"])
        for line, material in zip(material_lines, materials, strict=True):
            self.add_material_line(line[:2], line[2:], material=material)
        for bolt, (stiffness, pretension, strength) in zip(bolts, values, strict=True):
            self.add_bolt(bolt[:2], bolt[2:], stiffness=stiffness, pretension=pretension, strength=strength)
        for line in fixed:
            self.add_fixed(line[:2], line[2:])
        for point in loading:
            self.add_loading(point, table=())
        for point in measured:
            self.add_measured(point)
        for point in holes:
            self.add_hole(point)

    def _take_analysis(self, session: Session) -> None:
        """Take materials, run control and tables from the compiled session."""
        sizes = session.analysis_sizes()
        self.steps = sizes["steps"]
        names = "blocks joints tables rows"
        arrays = session.array("analysis", *(sizes[name] for name in names.split()))
        numbers, block_materials, joint_materials, table_sizes, rows = arrays
        self.k01, self.displacement_ratio, self.dt_max, self.stiffness, self.sor_factor = numbers.tolist()
        for m in block_materials.tolist():
            density, weight, youngs_modulus, poisson_ratio = m[:4]
            self.block_materials.append(
                BlockMaterial(density, weight, youngs_modulus, poisson_ratio, (*m[4:7],), (*m[7:10],), (*m[10:13],))
            )
        for m in joint_materials.tolist():
            self.joint_materials.append(JointMaterial(*m))
        tables = np.split(np.array(rows), np.cumsum(table_sizes)[:-1]) if sizes["tables"] else []
        if not tables:
            return
        position, _, line, _ = session.array("points", 1, session.sizes()["fixed"])
        for place, table in zip(self._loading, tables[len(line) :], strict=True):
            place.table = table
        if all(place.ends[:2] == place.ends[2:] for place in self._fixed):
            for place, table in zip(self._fixed, tables, strict=False):
                place.table = table
            return
        # points of one fixed line that move differently become fixed points of their own, and so do all points when
        # the lines of the file do not identify their fixed lines
        owners = np.unique(line)
        places: list[_Place] = []
        for i, owner in enumerate(owners):
            points = np.flatnonzero(line == owner)
            alike = all(np.array_equal(tables[k], tables[points[0]]) for k in points)
            if alike and len(owners) == len(self._fixed):
                places.append(_Place(self._fixed[i].ends, tables[points[0]]))
            else:
                places += [_Place((*position[k], *position[k]), tables[k]) for k in points]
        self._fixed = places

    # -- geometry ------------------------------------------------------------------------------------------------

    def add_line(self, start: Point, end: Point, *, joint: int = 1, boundary: bool = False) -> None:
        """A line (joint, boundary) with its joint material."""
        self._lines.append(_Line(coordinates(start, end), whole_number("joint", joint), boundary))

    def add_lines(self, lines: npt.ArrayLike, *, joint: npt.ArrayLike = 1, boundary: bool = False) -> None:
        """Many lines: (n, 4) rows x1 y1 x2 y2; joint: one joint material, or n of them."""
        self._lines += [_Line(ends, number, boundary) for ends, number in line_rows(lines, joint)]

    def add_polygon(self, points: npt.ArrayLike, *, joint: int = 1, boundary: bool = True) -> None:
        """The closed outline through points, (n, 2)."""
        corners = np.asarray(points, dtype=float).reshape(-1, 2)
        self.add_lines(np.hstack([corners, np.roll(corners, -1, axis=0)]), joint=joint, boundary=boundary)

    def add_material_line(self, start: Point, end: Point, *, material: int) -> None:
        """Gives its block material to every block that it crosses or lies in; the last line wins."""
        self._material_lines.append(_Line(coordinates(start, end), whole_number("material", material)))

    def add_bolt(
        self, start: Point, end: Point, *, stiffness: float, pretension: float = 0.0, strength: float = 0.0
    ) -> None:
        """A bolt; strength 0 is unlimited."""
        self._bolts.append(_Bolt(coordinates(start, end), float(stiffness), float(pretension), float(strength)))

    def add_fixed(self, start: Point, end: Point | None = None, *, table: Table = ()) -> None:
        """A fixed point, or a fixed line: points where it crosses edges and at its ends.

        table: (m, 3) rows t x y of prescribed displacements, linear in between.
        """
        self._fixed.append(_Place(coordinates(start, start if end is None else end), _table(table)))

    def add_loading(self, point: Point, *, table: Table) -> None:
        """A loading point; table: (m, 3) rows t fx fy of forces, linear in between."""
        self._loading.append(_Place(coordinates(point), _table(table)))

    def add_measured(self, point: Point) -> None:
        """A measured point: displacement, stress and rotation there are in the history."""
        x, y = coordinates(point)
        self._measured.append((x, y))

    def add_hole(self, point: Point) -> None:
        """The block around the point becomes an opening."""
        x, y = coordinates(point)
        self._holes.append((x, y))

    @property
    def lines(self) -> FloatArray:
        """(n, 4) lines x1 y1 x2 y2 in the order of the file: boundary lines come first."""
        return np.array([line.ends for line in self._ordered_lines()]).reshape(-1, 4)

    def _ordered_lines(self) -> list[_Line]:
        return sorted(self._lines, key=lambda line: not line.boundary)

    # -- materials -----------------------------------------------------------------------------------------------

    def add_block_material(
        self,
        *,
        density: float,
        youngs_modulus: float,
        poisson_ratio: float,
        gravity: float | None = None,
        weight: float | None = None,
        stress: tuple[float, float, float] = (0.0, 0.0, 0.0),
        stress_gradient: tuple[float, float, float] = (0.0, 0.0, 0.0),
        velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> int:
        """A block material; returns its number. Give the weight per area, or gravity (weight = density * gravity)."""
        if (gravity is None) == (weight is None):
            raise InputError("block material: give either gravity or weight")
        if weight is None:
            weight = density * float(gravity or 0.0)
        self.block_materials.append(
            BlockMaterial(density, weight, youngs_modulus, poisson_ratio, stress, stress_gradient, velocity)
        )
        return len(self.block_materials)

    def add_joint_material(self, *, friction_angle: float, cohesion: float = 0.0, tension: float = 0.0) -> int:
        """A joint material; returns its number."""
        self.joint_materials.append(JointMaterial(friction_angle, cohesion, tension))
        return len(self.joint_materials)

    # -- files ---------------------------------------------------------------------------------------------------

    def _geometry_deck(self) -> GeometryDeck:
        return GeometryDeck(
            self.e0,
            boundary=[(line.ends, line.number) for line in self._lines if line.boundary],
            joints=[(line.ends, line.number) for line in self._lines if not line.boundary],
            material_lines=[(line.ends, line.number) for line in self._material_lines],
            bolts=[(*bolt.ends, bolt.stiffness, bolt.pretension, bolt.strength) for bolt in self._bolts],
            fixed=[place.ends for place in self._fixed],
            loading=[place.ends for place in self._loading],
            measured=self._measured,
            holes=self._holes,
        )

    def geometry_text(self) -> str:
        """The geometry file (.dc)."""
        return self._geometry_deck().text()

    def analysis_text(self) -> str:
        """The analysis file (.df), in dialect g0. Fixed lines are cut first: each of their points needs its row."""
        return AnalysisDeck(
            self.k01,
            self.steps,
            self.displacement_ratio,
            self.dt_max,
            self.block_materials,
            self.joint_materials,
            stiffness=self.stiffness,
            fixed_tables=[table.tolist() for table in self._fixed_point_tables()],
            loading_tables=[place.table.tolist() for place in self._loading],
            sor_factor=self.sor_factor,
        ).text()

    def options_text(self) -> str:
        """The options file (.nml); empty when there are no options."""
        groups = {name: value for name, value in self.options.items() if value}
        if self.base_acceleration is not None:
            load = dict(groups.get("load", {}))
            load["base_acceleration"] = f"{self.name}.csv"
            groups["load"] = load
        return format_groups(groups)

    def _motion_text(self) -> str:
        rows = _table(self.base_acceleration if self.base_acceleration is not None else ())
        return "\n".join(["t,ax,ay", *(",".join(format_real(x) for x in row) for row in rows.tolist())]) + "\n"

    def _fixed_point_tables(self) -> list[FloatArray]:
        """The table of each fixed point: points take that of their line."""
        if all(place.ends[:2] == place.ends[2:] for place in self._fixed):
            return [place.table for place in self._fixed]
        first = self._geometry_deck().first_fixed_line()
        return [self._fixed[line - first].table for line in self.cut().fixed_points.line]

    def write(self, folder: PathLike, *, force: bool = False) -> list[Path]:
        """Write the model as files that the program reads: name.dc, name.df, and name.nml where there are options.

        Returns the paths. Files that are there are overwritten only with force=True. Options that the program would not
        read are refused.
        """
        check_options(self.options)
        target = Path(folder)
        texts = {f"{self.name}.dc": self.geometry_text(), f"{self.name}.df": self.analysis_text()}
        if options := self.options_text():
            texts[f"{self.name}.nml"] = options
        if self.base_acceleration is not None:
            texts[f"{self.name}.csv"] = self._motion_text()
        for name in texts:
            if (target / name).exists() and not force:
                raise InputError("the file exists; use force=True to overwrite it", target / name)
        target.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (target / name).write_text(text, encoding="utf-8")
        return [target / name for name in texts]

    def input_texts(self, stack: ExitStack) -> tuple[tuple[str, str, str], tuple[str, str, str]]:
        """Names and texts of the input files of a run; `stack` keeps the file of base motion until it has been read."""
        options = self.options_text()
        place = ""
        if self.base_acceleration is not None:
            place = stack.enter_context(tempfile.TemporaryDirectory()) + "/"
            (Path(place) / f"{self.name}.csv").write_text(self._motion_text())
        names = (f"{self.name}.dc", f"{self.name}.df", f"{place}{self.name}.nml" if options else "")
        return names, (self.geometry_text(), self.analysis_text(), options)

    # -- use -----------------------------------------------------------------------------------------------------

    def cut(self) -> Blocks:
        """Cut the lines into blocks."""
        return cut(self)

    def run(self, **options: Any) -> Results:
        """Run the model; takes the arguments of `rockdda.run`. Default output: name.h5."""
        return run(self, **options)

    def simulate(self, **options: Any) -> Simulation:
        """The model as a simulation to be advanced; takes the arguments of `rockdda.Simulation`."""
        return Simulation(self, **options)


def _last(groups: Any, name: str, default: Any) -> Any:
    """The value of a name in one or several groups."""
    for group in [groups] if isinstance(groups, Mapping) else groups:
        default = group.get(name, default)
    return default


def _table(rows: Table) -> FloatArray:
    table = np.asarray(rows, dtype=float)
    if table.size == 0:
        return np.zeros((0, 3))
    if table.ndim != 2 or table.shape[1] != 3:
        raise InputError(f"table: expected an array of shape (m, 3), rows t x y, found {table.shape}")
    return table
