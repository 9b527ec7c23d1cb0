# SPDX-License-Identifier: MIT
"""Joint statistics to lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arrays import FloatArray, IntArray
from .cutting import Blocks
from .errors import InputError, Problem
from .model import Model
from .namelist import format_groups
from .native import Session
from .text import PathLike

__all__ = ["JointSetReport", "Network", "lines"]


LARGEST_SEED = 2**31 - 2


@dataclass(frozen=True)
class JointSetReport:
    """Statistics of the drawn lines of one joint set. Means without any sample are NaN."""

    lines: int  # that cross the region
    traces: int  # pieces in the rock
    whole_traces: int  # of which nothing was cut off
    spacing: float  # mean distance of neighbouring lines [length]
    spacing_deviation: float
    trace: float  # mean length before cutting [length]
    trace_deviation: float
    bridge: float  # mean gap between traces of a line [length]
    bridge_deviation: float
    total_length: float  # of all pieces [length]


class Network:
    """Lines and points drawn from joint statistics: the content of a geometry file. Arrays cannot be changed."""

    def __init__(self, session: Session) -> None:
        self._session = session
        sizes, arrays = session.geometry()
        #: (n, 4) rows x1 y1 x2 y2; the boundary lines come first [length]
        self.lines: FloatArray
        #: (n,) joint material of each line, from 1
        self.joint: IntArray
        #: (m, 4) and (m,): material lines and their block materials
        self.material_lines: FloatArray
        self.block_material: IntArray
        #: (m, 4) fixed lines, points where both ends agree
        self.fixed: FloatArray
        #: (m, 2) points
        self.loading: FloatArray
        self.measured: FloatArray
        self.holes: FloatArray
        self.lines, self.joint, self.material_lines, self.block_material = arrays[1:5]
        self.fixed, self.loading, self.measured, self.holes = arrays[7:]
        self.n_boundary = sizes["boundary"]
        values, sets = session.array("network_facts", sizes["sets"])
        self.e0, self.rock_area = map(float, values)
        #: statistics of the drawn lines, set by set
        self.sets: list[JointSetReport] = [_report(row) for row in sets.tolist()]
        #: notes and warnings
        self.messages: list[Problem] = [problem for problem, _ in session.messages()]

    def __repr__(self) -> str:
        return f"<rockdda.Network: {len(self.lines)} lines, {len(self.sets)} joint sets>"

    def write(self, path: PathLike) -> None:
        """Write a geometry file (.dc)."""
        self._session("write_network", path)

    def model(self, name: str = "network", **options: Any) -> Model:
        """A model with this geometry; materials are still to be added. Options are those of `Model`."""
        model = Model(name, **{"e0": self.e0, **options})
        model.add_lines(self.lines[: self.n_boundary], joint=self.joint[: self.n_boundary], boundary=True)
        model.add_lines(self.lines[self.n_boundary :], joint=self.joint[self.n_boundary :])
        for row, material in zip(self.material_lines, self.block_material.tolist(), strict=True):
            model.add_material_line(row[:2], row[2:], material=material)
        for row in self.fixed:
            model.add_fixed(row[:2], row[2:] if (row[:2] != row[2:]).any() else None)
        if len(self.loading):
            raise InputError("loading points need their loads: add them to the model with add_loading")
        for point in self.measured:
            model.add_measured(point)
        for point in self.holes:
            model.add_hole(point)
        return model

    def cut(self) -> Blocks:
        """Cut into blocks."""
        return self.model().cut()


def lines(
    statistics: PathLike | Mapping[str, Any], *, seed: int | None = None, output: PathLike | None = None
) -> Network:
    """Draw the lines of joint sets from their statistics.

    statistics: a joint statistics file (.dl), or its groups: a mapping of names to entries, or to lists of entries
    for groups that are repeated. seed replaces that of the file; the same seed gives the same lines on every machine.
    output: also write a geometry file, as `rockdda lines` does.

    >>> import rockdda
    >>> network = rockdda.lines({
    ...     "boundary": {"window": [0, 0, 10, 6]},
    ...     "joint_set": [{"inclination": 0, "spacing": 1}, {"inclination": 90, "spacing": 2}],
    ... })
    >>> len(network.cut())
    30

    Raises InputError; warnings become `InputWarning`."""
    if seed is not None and not (isinstance(seed, int | np.integer) and 0 <= seed <= LARGEST_SEED):
        raise InputError(f"seed: expected a whole number from 0 to {LARGEST_SEED}, found {seed!r}")
    session = Session()
    number = -1 if seed is None else int(seed)
    if isinstance(statistics, Mapping):
        session("draw_text", "statistics", format_groups(statistics), number)
    else:
        session("draw_file", statistics, number)
    session.warn()
    network = Network(session)
    if output is not None:
        network.write(output)
    return network


def _report(row: list[float]) -> JointSetReport:
    lines, traces, whole, drawn, bridges = map(int, row[:5])
    enough = np.repeat([lines >= 2, drawn >= 1, bridges >= 1], 2)  # for means and deviations
    values: list[Any] = [lines, traces, whole, *np.where(enough, row[5:11], np.nan).tolist(), row[11]]
    return JointSetReport(*values)
