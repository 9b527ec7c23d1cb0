# SPDX-License-Identifier: MIT
"""A model built in Python: lines, points, bolts, materials and options."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .cutting import Blocks, cut
from .deck import (
    AnalysisDeck,
    BlockMaterial,
    Bolt,
    GeometryDeck,
    JointMaterial,
    Line,
    Place,
    Table,
    coordinates,
    line_rows,
    time_table,
    whole_number,
)
from .errors import InputError
from .groups import OptionGroups, as_list, plain_options
from .labelled import (
    OPTION_FIELDS,
    block_groups,
    is_labelled,
    joint_groups,
    labelled_text,
    point_groups,
    take_labelled,
    take_legacy,
)
from .namelist import format_groups, format_real
from .native import ANALYSIS_FILE, CONFIG_FILE, LABELLED_TEXT, Session
from .notebook import card, drawing_of_lines
from .options import check_options, name_arguments, refuse_problems
from .results import Results
from .simulation import Simulation, run
from .text import PathLike, did_you_mean
from .writing import write_files

__all__ = ["BlockMaterial", "JointMaterial", "Model"]

Point = Sequence[float] | FloatArray
_UNSET: Any = object()


@name_arguments
@dataclass(eq=False)
class Model(OptionGroups):
    """A model: geometry, materials, run control. `units` names those of all numbers.

    >>> import rockdda
    >>> model = rockdda.Model("block", e0=0.01, steps=10, dt_max=0.01)
    >>> model.add_polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    >>> model.add_block_material(density=2500, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25)
    1
    >>> model.add_joint_material(friction_angle=30)
    1
    >>> model.cut().areas
    array([1.])"""

    name: str = "model"  # of the files
    e0: float = 0.01  # minimum edge-node distance: closer nodes are one
    k01: float = _UNSET  # share of the velocity carried into the next step: 0 static … 1 dynamic; default 1
    steps: int = _UNSET  # default 100, of a labelled model none
    displacement_ratio: float = _UNSET  # g2, of a step over half the model's height; default 0.01, labelled automatic
    dt_max: float = _UNSET  # g1, largest time step; default 0.01, of a labelled model automatic
    stiffness: float = _UNSET  # g0 of contact springs; default 0 (automatic), of a labelled model automatic
    sor_factor: float = _UNSET  # default 1.4
    gravity: float | None = None  # acceleration in -y of all blocks; without it the materials have their weights
    #: defaults of labelled files: plane strain, cohesion that stays, and automatic numbers where none are given
    labelled: bool = False
    #: of all numbers: 'SI' (m, kg, s, N), 'kN' (m, t, s, kN), 'mm' (mm, t, s, N) or 'none', any consistent ones, which
    #: nothing checks; default 'SI' of a labelled model, else 'none'
    units: str | None = None
    #: options by group and name, as in an options file: {"run": {"t_end": 2.0}, "stage": [{…}, {…}]};
    #: rockdda.options.options_schema describes them
    options: dict[str, Any] = field(default_factory=dict)
    #: (m, 3) rows t ax ay: motion of the base, linear in between
    base_acceleration: npt.ArrayLike | None = None
    block_materials: list[BlockMaterial] = field(default_factory=list)
    joint_materials: list[JointMaterial] = field(default_factory=list)
    _lines: list[Line] = field(default_factory=list, repr=False)
    _material_lines: list[Line] = field(default_factory=list, repr=False)
    _bolts: list[Bolt] = field(default_factory=list, repr=False)
    _fixed: list[Place] = field(default_factory=list, repr=False)
    _loading: list[Place] = field(default_factory=list, repr=False)
    _measured: list[tuple[float, float]] = field(default_factory=list, repr=False)
    _holes: list[tuple[float, float]] = field(default_factory=list, repr=False)

    def __post_init__(self) -> None:
        defaults = {"k01": 1.0, "steps": 100, "displacement_ratio": 0.01, "dt_max": 0.01, "stiffness": 0.0}
        defaults["sor_factor"] = 1.4
        if self.units and not self.labelled and self.units != "none":
            raise InputError(f"units = {self.units!r} belong to a labelled model: Model(..., labelled=True)")
        for name, value in defaults.items():
            if getattr(self, name) is _UNSET:
                setattr(self, name, None if self.labelled else value)

    def __eq__(self, other: object) -> bool:
        """Do two models have the same name, and the same in all that their files hold?"""
        return self._content() == other._content() if isinstance(other, Model) else NotImplemented

    __hash__ = None  # type: ignore[assignment]  # it can be changed

    def _content(self) -> tuple[Any, ...]:
        """What the files of the model hold, to be compared."""
        tables = [[place.table.tolist() for place in some] for some in (self._fixed, self._loading)]
        motion = None if self.base_acceleration is None else time_table(self.base_acceleration).tolist()
        numbers = [getattr(self, name) for _, _, name in OPTION_FIELDS]
        materials = block_groups(self.block_materials), plain_options({"joint": joint_groups(self.joint_materials)})
        whole = (self.name, self.labelled, self.units, numbers, plain_options(self.options), motion)
        return (*whole, *materials, self._geometry_deck(), tables)

    def _repr_html_(self) -> str:
        """What a notebook shows: what the model has, and its lines."""
        groups = plain_options(self.options)
        regions = {str(region.get("name", "")).strip().lower() for region in groups.get("region", [])}
        stages = [str(stage.get("name", f"stage {i}")) for i, stage in enumerate(groups.get("stage", []), start=1)]
        names = [m.name or str(i) for i, m in enumerate(self.block_materials, start=1)]
        joints = [m.name or str(i) for i, m in enumerate(self.joint_materials, start=1)]
        bolts = len(self._bolts) + len(as_list(groups.get("bolt", [])))
        facts = [
            ("lines", len(self._lines)), ("block materials", ", ".join(names)), ("joint materials", ", ".join(joints)),
            ("regions", ", ".join(sorted(regions))),
            ("boundaries", ", ".join(str(group.get("kind", "")) for group in groups.get("boundary", []))),
            ("stages", " → ".join(stages)), ("bolts", bolts or ""),
            ("linings", len(as_list(groups.get("liner", []))) or ""), ("fixed", len(self._fixed) or ""),
            ("measured points", len(self._measured) or ""), ("steps", self.steps),
        ]  # fmt: skip
        return card(self.name, facts, drawing_of_lines(self.lines, [place.ends for place in self._fixed]))

    @classmethod
    def from_files(cls, geometry: PathLike, analysis: PathLike | None = None, config: PathLike | None = None) -> Model:
        """The model of some files, as `read` takes them. It equals the model whose `to_files` has written them."""
        return cls.read(geometry, analysis, config)

    @classmethod
    def read(cls, geometry: PathLike, analysis: PathLike | None = None, config: PathLike | None = None) -> Model:
        """Read a model: a labelled file, a folder, or a geometry file with its analysis file and, if there is one, its
        options file.

        Written and run, the model does the same as the files. A file of base motion that the options name stays
        where it is."""
        session = Session()
        session("read_files", geometry, analysis, config)
        reading = is_labelled(session)
        model = cls(Path(session.text(CONFIG_FILE if reading else ANALYSIS_FILE)).stem, labelled=reading)
        (take_labelled if reading else take_legacy)(model, session)
        return model

    # -- geometry ------------------------------------------------------------------------------------------------

    def add_line(self, start: Point, end: Point, *, joint: int | str = 1, boundary: bool = False) -> None:
        """A line (joint, boundary) with its joint material: number or name."""
        self._lines.append(Line(coordinates(start, end), _reference("joint", joint), boundary))

    def add_lines(self, lines: npt.ArrayLike, *, joint: npt.ArrayLike | str = 1, boundary: bool = False) -> None:
        """Many lines: (n, 4) rows x1 y1 x2 y2; joint: one joint material (number or name), or n numbers."""
        if isinstance(joint, str):
            self._lines += [Line(ends, joint, boundary) for ends, _ in line_rows(lines)]
            return
        self._lines += [Line(ends, number, boundary) for ends, number in line_rows(lines, joint)]

    def add_polygon(self, points: npt.ArrayLike, *, joint: int | str = 1, boundary: bool = True) -> None:
        """The closed outline through points, (n, 2)."""
        corners = np.asarray(points, dtype=float).reshape(-1, 2)
        self.add_lines(np.hstack([corners, np.roll(corners, -1, axis=0)]), joint=joint, boundary=boundary)

    def add_material_line(self, start: Point, end: Point, *, material: int | str) -> None:
        """Gives its block material (number or name) to every block that it crosses or lies in; the last line wins."""
        self._material_lines.append(Line(coordinates(start, end), _reference("material", material)))

    def add_bolt(
        self, start: Point, end: Point, *, stiffness: float | None = None, pretension: float = 0.0,
        strength: float = 0.0, name: str | None = None, kind: str | None = None, **options: Any,
    ) -> None:  # fmt: skip
        """A bolt from its head to its toe.

        With a `kind` ('grouted', 'end_anchored', 'yielding', 'friction') it acts along its length, and `options` are
        those of `&bolt`: `model.add_bolt((0, 0), (0, 3), kind="grouted", diameter=0.025, young=200e9, …)`. Without one
        it is a spring of a `stiffness`; strength 0 is unlimited. A spring without a name stands in the geometry."""
        if kind is not None and kind != "spring":
            if stiffness is not None or strength:
                raise InputError(
                    "stiffness and strength are those of a spring; a bolt of this kind has young, diameter"
                )
            ends = {"from": coordinates(start), "to": coordinates(end)}
            own = {"name": name, "kind": kind, "pretension": pretension or None}
            self.add_group("bolt", **{k: v for k, v in own.items() if v is not None}, **ends, **options)
            return
        refuse_problems("add_bolt", "bolt", options)
        if stiffness is None:
            raise InputError("give stiffness (a spring), or kind")
        if options:
            raise InputError(f"{', '.join(options)}: a spring has stiffness, pretension and strength; give kind")
        if name is not None:
            ends = {"from": coordinates(start), "to": coordinates(end)}
            values = {"stiffness": stiffness, "pretension": pretension, "yield_force": strength or None}
            self.add_group("bolt", name=name, **ends, **values)
            return
        self._bolts.append(Bolt(coordinates(start, end), float(stiffness), float(pretension), float(strength)))

    def add_bolts(
        self, along: npt.ArrayLike | None = None, *, kind: str, spacing: float, length: float,
        outline: str | None = None, name: str | None = None, **options: Any,
    ) -> None:  # fmt: skip
        """A pattern of bolts whose heads stand along a line, (n, 2), or around a region (`outline`).

        `options` are those of `&bolt`: angle, offset, diameter, young, spacing_out_of_plane and the others."""
        if (along is None) == (outline is None):
            raise InputError("give along or outline")
        place: dict[str, Any] = {"outline": outline}
        if along is not None:
            place = {"along": np.asarray(along, dtype=float).reshape(-1, 2).ravel().tolist()}
        own = {"name": name} if name is not None else {}
        self.add_group("bolt", **own, kind=kind, **place, spacing=spacing, length=length, **options)

    def add_fixed(self, start: Point, end: Point | None = None, *, table: Table = ()) -> None:
        """A fixed point, or a fixed line: points where it crosses edges and at its ends.

        table: (m, 3) rows t x y of prescribed displacements, linear in between."""
        self._fixed.append(Place(coordinates(start, start if end is None else end), time_table(table)))

    def add_loading(self, point: Point, *, table: Table) -> None:
        """A loading point; table: (m, 3) rows t fx fy of forces, linear in between."""
        self._loading.append(Place(coordinates(point), time_table(table)))

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
        return np.array([line.ends for line in sorted(self._lines, key=lambda line: not line.boundary)]).reshape(-1, 4)

    # -- materials -----------------------------------------------------------------------------------------------

    def add_block_material(
        self, *, density: float, youngs_modulus: float | None = None, poisson_ratio: float | None = None,
        gravity: float | None = None, weight: float | None = None, stress: tuple[float, float, float] = (0.0, 0.0, 0.0),
        stress_gradient: tuple[float, float, float] = (0.0, 0.0, 0.0),
        velocity: tuple[float, float, float] = (0.0, 0.0, 0.0), name: str = "", young: float | None = None,
        poisson: float | None = None, unit_weight: float | None = None,
    ) -> int:  # fmt: skip
        """A block material; returns its number. Give the weight per area, or gravity (weight = density * gravity).

        In a labelled model both may be left out: the weight is then density times the gravity of the model. young,
        poisson and unit_weight are the names that labelled files have for youngs_modulus, poisson_ratio and weight."""
        youngs_modulus = _one_of("block material", youngs_modulus=youngs_modulus, young=young)
        poisson_ratio = _one_of("block material", poisson_ratio=poisson_ratio, poisson=poisson)
        if unit_weight is not None:
            weight = _one_of("block material", weight=weight, unit_weight=unit_weight)
        if (gravity is not None and weight is not None) or (gravity is None and weight is None and not self.labelled):
            raise InputError("block material: give either gravity or weight")
        if weight is None:
            weight = math.nan if gravity is None else density * float(gravity)
        self.block_materials.append(
            BlockMaterial(density, weight, youngs_modulus, poisson_ratio, stress, stress_gradient, velocity, name)
        )
        return len(self.block_materials)

    def add_joint_material(
        self, *, friction_angle: float | None = None, cohesion: float = 0.0, tension: float = 0.0, name: str = "",
        friction: float | None = None, **values: Any,
    ) -> int:  # fmt: skip
        """A joint material; returns its number. values: others of &joint_material, such as normal_stiffness or law.

        friction is the name that labelled files have for friction_angle."""
        if values:  # the table of names is in the compiled part
            refuse_problems("joint material", "joint_material", values)
        friction_angle = _one_of("joint material", friction_angle=friction_angle, friction=friction)
        self.joint_materials.append(JointMaterial(friction_angle, cohesion, tension, name, values))
        return len(self.joint_materials)

    def _number(self, kind: str, reference: int | str) -> int:
        """The number of a material that is named or numbered."""
        if not isinstance(reference, str):
            return reference
        materials: Sequence[BlockMaterial | JointMaterial] = (
            self.joint_materials if kind == "joint" else self.block_materials
        )
        names = [material.name.strip().lower() for material in materials]
        if reference.strip().lower() in names:
            return 1 + names.index(reference.strip().lower())
        hint = did_you_mean(reference, (material.name for material in materials))
        raise InputError(f"there is no {kind} material {reference!r}{hint}")

    # -- files ---------------------------------------------------------------------------------------------------

    def _geometry_deck(self) -> GeometryDeck:
        return GeometryDeck(
            self.e0,
            boundary=[(line.ends, self._number("joint", line.number)) for line in self._lines if line.boundary],
            joints=[(line.ends, self._number("joint", line.number)) for line in self._lines if not line.boundary],
            material_lines=[(line.ends, self._number("block", line.number)) for line in self._material_lines],
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
        if self.labelled:
            raise InputError("a labelled model has no analysis file; to_files() writes its file")
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
        """The options file (.nml), of a labelled model its whole file; empty when there are no options."""
        groups = {name: value for name, value in self.options.items() if value}
        if self.base_acceleration is not None:
            *before, load = as_list(groups.get("load", {}))
            groups["load"] = [*before, {**load, "base_acceleration": f"{self.name}.csv"}]
        if self.labelled:
            return labelled_text(self._labelled_groups(groups))
        if self.gravity is not None:
            groups["load"] = [{"gravity": self.gravity}, *as_list(groups.get("load", []))]
        return format_groups(self._named_materials(groups))

    def _named_materials(self, groups: dict[str, Any]) -> dict[str, Any]:
        """Options with the names of materials, and what the analysis file does not hold of them."""
        blocks = [{"number": i, "name": m.name} for i, m in enumerate(self.block_materials, start=1) if m.name]
        joints = [
            {"number": i, **({"name": m.name} if m.name else {}), **m.values}
            for i, m in enumerate(self.joint_materials, start=1)
            if m.name or m.values
        ]
        named = {"block_material": blocks, "joint_material": joints}
        return {**groups, **{key: mine + as_list(groups.get(key, [])) for key, mine in named.items() if mine}}

    def _labelled_groups(self, groups: dict[str, Any]) -> dict[str, Any]:
        """The groups of a labelled file."""
        numbers: dict[str, dict[str, Any]] = {}
        for group, option, name in OPTION_FIELDS:
            if getattr(self, name) is not None:
                numbers.setdefault(group, {})[option] = getattr(self, name)
        for group, entries in numbers.items():
            first, *rest = as_list(groups.get(group, {})) or [{}]
            groups[group] = [{**entries, **first}, *rest] if rest else {**entries, **first}
        tables = [("fixed_point", "displacement", self._fixed_point_tables())]
        tables += [("loading_point", "force", [place.table for place in self._loading])]
        for group, name, rows in tables:
            if given := point_groups(name, rows):
                groups[group] = given + as_list(groups.get(group, []))
        groups["model"] = {"geometry": f"{self.name}.dc"} | ({"units": self.units} if self.units else {})
        groups["block_material"] = block_groups(self.block_materials) + as_list(groups.get("block_material", []))
        groups["joint_material"] = joint_groups(self.joint_materials) + as_list(groups.get("joint_material", []))
        return groups

    def _motion_text(self) -> str:
        rows = time_table(self.base_acceleration if self.base_acceleration is not None else ())
        return "\n".join(["t,ax,ay", *(",".join(format_real(x) for x in row) for row in rows.tolist())]) + "\n"

    def _fixed_point_tables(self) -> list[FloatArray]:
        """The table of each fixed point: points take that of their line."""
        if all(place.ends[:2] == place.ends[2:] for place in self._fixed):
            return [place.table for place in self._fixed]
        first = self._geometry_deck().first_fixed_line()
        return [self._fixed[line - first].table for line in self.cut().fixed_points.line]

    def to_files(self, folder: PathLike, *, force: bool = False) -> list[Path]:
        """Write the model as a labelled file: name.nml, which is run by itself, and its lines, name.dc.

        The run has the results of this model, bit for bit, and `Model.read` reads the file. Returns the paths. Files
        that are there are overwritten only with force=True."""
        check_options(self.options)
        text = self.options_text() if self.labelled else self._as_labelled()
        return self._write_files(folder, {f"{self.name}.dc": self.geometry_text(), f"{self.name}.nml": text}, force)

    def _as_labelled(self) -> str:
        """The labelled file of a model that is none."""
        session = Session()
        with ExitStack() as stack:
            names, texts = self.input_texts(stack)
            session("read_texts", *names, *texts)
            place = names[2].removesuffix(f"{self.name}.nml")
            text = session.text(LABELLED_TEXT).split("\n", 2)[2]
        return text.replace(place, "") if place else text

    def write(self, folder: PathLike, *, force: bool = False) -> list[Path]:
        """Write the model as legacy files: name.dc, name.df, and name.nml where there are options. A labelled model is
        written as by `to_files`.

        Returns the paths. Files that are there are overwritten only with force=True. Options that the program would not
        read are refused."""
        if self.labelled:
            return self.to_files(folder, force=force)
        check_options(self.options)
        texts = {f"{self.name}.dc": self.geometry_text(), f"{self.name}.df": self.analysis_text()}
        if options := self.options_text():
            texts[f"{self.name}.nml"] = options
        return self._write_files(folder, texts, force)

    def _write_files(self, folder: PathLike, texts: dict[str, str], force: bool) -> list[Path]:
        """Write files by name, and that of the base motion."""
        target = Path(folder)
        if self.base_acceleration is not None:
            texts[f"{self.name}.csv"] = self._motion_text()
        target.mkdir(parents=True, exist_ok=True)
        return write_files({target / name: text for name, text in texts.items()}, force, "force=True")

    def input_texts(self, stack: ExitStack) -> tuple[tuple[str, str, str], tuple[str, str, str]]:
        """Names and texts of the input files of a run; `stack` keeps the file of base motion until it has been read."""
        options = self.options_text()
        place = ""
        if self.base_acceleration is not None:
            place = stack.enter_context(tempfile.TemporaryDirectory()) + "/"
            (Path(place) / f"{self.name}.csv").write_text(self._motion_text())
        if self.labelled:
            return (f"{self.name}.dc", "", f"{place}{self.name}.nml"), (self.geometry_text(), "", options)
        names = (f"{self.name}.dc", f"{self.name}.df", f"{place}{self.name}.nml" if options else "")
        return names, (self.geometry_text(), self.analysis_text(), options)

    # -- use -----------------------------------------------------------------------------------------------------

    def cut(self, *, allow_open: bool = False) -> Blocks:
        """Cut the lines into blocks. allow_open: boundary lines that leave a gap or bound no block are a warning."""
        return cut(self, allow_open=allow_open)

    def run(self, **options: Any) -> Results:
        """Run the model; takes the arguments of `rockdda.run`. Default output: name.h5."""
        return run(self, **options)

    def simulate(self, **options: Any) -> Simulation:
        """The model as a simulation to be advanced; takes the arguments of `rockdda.Simulation`."""
        return Simulation(self, **options)


@contextmanager
def as_files(
    model: PathLike | Model, analysis: PathLike | None, config: PathLike | None
) -> Iterator[tuple[list[str], str]]:
    """Words of the program's command line for a model, and the folder of the files of one in memory, else ''."""
    if not isinstance(model, Model):
        files = [os.fspath(path) for path in (model, analysis) if path is not None]
        yield files + ([] if config is None else ["--config", os.fspath(config)]), ""
        return
    if analysis is not None or config is not None:
        raise InputError("a Model brings its own analysis and options")
    with tempfile.TemporaryDirectory(prefix="rockdda-") as folder:
        model.write(folder)
        yield [str(Path(folder) / f"{model.name}.nml") if model.labelled else folder], folder


def _reference(what: str, value: int | str) -> int | str:
    """Number or name of a material."""
    return value if isinstance(value, str) else whole_number(what, value)


def _one_of(what: str, **values: Any) -> Any:
    """The value of the one of two names that is given."""
    given = [value for value in values.values() if value is not None]
    if len(given) != 1:
        raise InputError(f"{what}: give {' or '.join(values)}" + (", not both" if given else ""))
    return given[0]
