# SPDX-License-Identifier: MIT
"""The input deck: materials, and the text of geometry files (.dc) and analysis files (.df).

The order of the numbers is that of docs/file-formats.md. Numbers are written with as many digits as it takes to read
back exactly the same value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .errors import InputError
from .namelist import format_real

__all__ = [
    "AnalysisDeck", "BlockMaterial", "GeometryDeck", "JointMaterial", "coordinates", "line_rows", "number_text",
    "whole_number",
]  # fmt: skip

Numbers = Sequence[float]
Segment = tuple[float, float, float, float]  # x1 y1 x2 y2
Table = npt.ArrayLike  # (m, 3) rows t x y
COUNTS_IN_A_ROW = 20  # numbers of table rows in one line of an analysis file


@dataclass
class BlockMaterial:
    """The 13 numbers of a block material, and its name. Weight acts in -y; stress is positive in tension.

    A weight of NaN means density times the gravity of the options: labelled files only."""

    density: float  # mass per area
    weight: float  # per area: density times g
    youngs_modulus: float
    poisson_ratio: float
    stress: tuple[float, float, float] = (0.0, 0.0, 0.0)  # s11 s22 s12 at the start
    stress_gradient: tuple[float, float, float] = (0.0, 0.0, 0.0)  # with y
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)  # vx vy vr at the start [rad per time]
    name: str = ""  # in labelled files and options


@dataclass
class JointMaterial:
    """The 3 numbers of a joint material, its name, and what options say of it."""

    friction_angle: float  # degrees, in [0, 90)
    cohesion: float = 0.0
    tension: float = 0.0  # tensile strength
    name: str = ""  # in labelled files and options
    #: further values of &joint_material by name, such as {"normal_stiffness": 5e9, "law": "residual"}
    values: dict[str, Any] = field(default_factory=dict)


def number_text(value: float) -> str:
    """The shortest text that reads back as the same number; InputError for one that is not finite."""
    text = format_real(value)
    return text[:-2] if text.endswith(".0") and text != "-0.0" else text


def _row(values: Iterable[float]) -> str:
    """One record."""
    return "  ".join(number_text(value) for value in values)


@dataclass
class GeometryDeck:
    """The numbers of a geometry file."""

    e0: float = 0.0
    boundary: list[tuple[Segment, int]] = field(default_factory=list)  # of the outline, with joint materials
    joints: list[tuple[Segment, int]] = field(default_factory=list)  # of the other lines
    material_lines: list[tuple[Segment, int]] = field(default_factory=list)  # with block materials
    bolts: list[Any] = field(default_factory=list)  # x1 y1 x2 y2, or these and stiffness, pretension, strength
    fixed: list[Any] = field(default_factory=list)  # both ends equal: a point
    loading: list[Any] = field(default_factory=list)
    measured: list[tuple[float, float]] = field(default_factory=list)
    holes: list[tuple[float, float]] = field(default_factory=list)

    def text(self, title: str = "") -> str:
        """The geometry file."""
        return "\n".join(self._rows(title)[0]) + "\n"

    def first_fixed_line(self) -> int:
        """Line of the file, from 1, that holds the first fixed line."""
        return self._rows("")[1]

    def _rows(self, title: str) -> tuple[list[str], int]:
        """Lines of the file, and the number of the first fixed line among them."""
        rows = [f"# {title}"] if title else []
        rows += [f"{number_text(self.e0)}   # smallest distance between a node and an edge (e0)"]
        rows += [f"{len(self.boundary) + len(self.joints)} {len(self.boundary)}   # lines, of which boundary lines"]
        counted: tuple[tuple[str, Sequence[Any]], ...] = (
            ("material lines", self.material_lines), ("bolts", self.bolts), ("fixed lines", self.fixed),
            ("loading points", self.loading), ("measured points", self.measured), ("hole points", self.holes),
        )  # fmt: skip
        rows += [f"{len(entries)}   # {name}" for name, entries in counted]
        for name, lines in (
            ("boundary lines: x1 y1 x2 y2 joint material", self.boundary),
            ("lines: x1 y1 x2 y2 joint material", self.joints),
            ("material lines: x1 y1 x2 y2 block material", self.material_lines),
        ):
            if lines:
                rows += [f"# {name}", *(f"{_row(ends)}  {material}" for ends, material in lines)]
        if self.bolts:
            values = " stiffness pretension strength" if len(self.bolts[0]) > 4 else ""
            rows += [f"# bolts: x1 y1 x2 y2{values}", *map(_row, self.bolts)]
        if self.fixed:
            rows += ["# fixed lines: x1 y1 x2 y2"]
        first_fixed = len(rows) + 1
        rows += map(_row, self.fixed)
        for name, points in (("loading", self.loading), ("measured", self.measured), ("hole", self.holes)):
            if points:
                rows += [f"# {name} points: x y", *map(_row, points)]
        return rows, first_fixed


@dataclass
class AnalysisDeck:
    """The numbers of an analysis file: in dialect g0 with a contact stiffness, without one that of DDA for Windows."""

    k01: float
    steps: int
    displacement_ratio: float  # g2
    dt_max: float  # g1
    block_materials: list[BlockMaterial] = field(default_factory=list)
    joint_materials: list[JointMaterial] = field(default_factory=list)
    stiffness: float | None = None  # g0, 0 automatic
    fixed_tables: list[Any] = field(default_factory=list)  # for each fixed point rows t x y
    loading_tables: list[Any] = field(default_factory=list)  # for each loading point rows t fx fy
    sor_factor: float | None = None  # written last, where given

    def text(self, title: str = "") -> str:
        """The analysis file."""
        rows = [f"# {title}"] if title else []
        rows += [f"{number_text(self.k01)}   # k01: 0 static to 1 dynamic"]
        rows += [f"{whole_number('steps', self.steps)}   # time steps"]
        rows += [f"{len(self.block_materials)}   # block materials", f"{len(self.joint_materials)}   # joint materials"]
        rows += [f"{number_text(self.displacement_ratio)}   # g2: largest displacement of a step over w0"]
        rows += [f"{number_text(self.dt_max)}   # g1: largest time step"]
        if self.stiffness is not None:
            rows += [f"{number_text(self.stiffness)}   # g0: stiffness of contact springs, 0 automatic"]
            rows += self._table_rows()
        for i, block in enumerate(self.block_materials, start=1):
            rows += [f"# block material {i}: density weight E nu / s11 s22 s12 / t11 t22 t12 / vx vy vr"]
            rows += [_row((block.density, block.weight, block.youngs_modulus, block.poisson_ratio))]
            rows += [_row(block.stress), _row(block.stress_gradient), _row(block.velocity)]
        rows += ["# joint materials: friction angle, cohesion, tensile strength"]
        rows += [_row((joint.friction_angle, joint.cohesion, joint.tension)) for joint in self.joint_materials]
        if self.sor_factor is not None:
            rows += [f"{number_text(self.sor_factor)}   # SOR factor"]
        return "\n".join(rows) + "\n"

    def _table_rows(self) -> list[str]:
        """Numbers of rows of all tables, then the rows."""
        counts = [str(len(table)) for table in (*self.fixed_tables, *self.loading_tables)]
        rows = ["# numbers of time-dependent values: fixed points, then loading points"] if counts else []
        rows += ["  ".join(counts[i : i + COUNTS_IN_A_ROW]) for i in range(0, len(counts), COUNTS_IN_A_ROW)]
        for what, tables in (
            ("fixed point {}: t x y", self.fixed_tables),
            ("loading point {}: t fx fy", self.loading_tables),
        ):
            for i, table in enumerate(tables, start=1):
                if len(table):
                    rows += [f"# {what.format(i)}", *map(_row, table)]
        return rows


def line_rows(lines: npt.ArrayLike, joint: npt.ArrayLike = 1) -> list[tuple[tuple[Any, ...], int]]:
    """Lines, (n, 4) rows x1 y1 x2 y2, with their joint material: one for all, or n of them."""
    rows = np.asarray(lines, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise InputError(f"lines: expected an array of shape (n, 4), found {rows.shape}")
    joints = np.broadcast_to(np.asarray(joint), len(rows))
    return [
        (coordinates(row[:2], row[2:]), whole_number("joint", number))
        for row, number in zip(rows.tolist(), joints.tolist(), strict=True)
    ]


def coordinates(*points: Numbers | FloatArray) -> tuple[Any, ...]:
    """Coordinates of points (x, y), in a row."""
    for point in points:
        if len(point) != 2:
            raise InputError(f"expected a point (x, y), found {point!r}")
    values = tuple(float(x) for point in points for x in point)
    if not all(math.isfinite(x) for x in values):
        raise InputError(f"expected finite coordinates, found {values}")
    return values


def whole_number(what: str, value: Any) -> int:
    """An integer; InputError for a number with a fraction."""
    if int(value) != value:
        raise InputError(f"{what}: expected a whole number, found {value!r}")
    return int(value)


# -- parts of a drawing: lines, bolts, and places with values in time --------------------------------------------------


@dataclass
class Line:
    """A line of a geometry with its material."""

    ends: tuple[float, float, float, float]
    number: int | str  # joint or block material, or its name
    boundary: bool = False


@dataclass
class Bolt:
    """A bolt between two points."""

    ends: tuple[float, float, float, float]
    stiffness: float
    pretension: float
    strength: float


@dataclass
class Place:
    """A fixed line or a loading point with its values in time."""

    ends: tuple[float, ...]
    table: FloatArray


def time_table(rows: Table) -> FloatArray:
    """Values in time as an array (m, 3)."""
    table = np.asarray(rows, dtype=float)
    if table.size == 0:
        return np.zeros((0, 3))
    if table.ndim != 2 or table.shape[1] != 3:
        raise InputError(f"table: expected an array of shape (m, 3), rows t x y, found {table.shape}")
    return table
