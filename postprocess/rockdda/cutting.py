# SPDX-License-Identifier: MIT
"""Lines to blocks."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray, IntArray
from .deck import GeometryDeck, coordinates, line_rows
from .errors import Problem
from .native import Session
from .rings import after_on_block
from .text import PathLike

__all__ = ["Blocks", "Bolts", "CutReport", "Points", "cut"]


@dataclass(frozen=True)
class Points:
    """n points on blocks."""

    position: FloatArray  # (n, 2) [length]
    block: IntArray  # (n,) from 0
    line: IntArray  # (n,) line of the input file, from 1; 0 unknown
    number: IntArray  # (n,) of the point in the input, from 1; numbers of ignored points are missing

    def __len__(self) -> int:
        return len(self.block)


@dataclass(frozen=True)
class Bolts:
    """n bolts between points on blocks."""

    ends: FloatArray  # (n, 4) x1 y1 x2 y2 [length]
    block: IntArray  # (n, 2) of both ends, from 0; -1 the fixed outside
    stiffness: FloatArray  # (n,) [force/length]
    pretension: FloatArray  # (n,) [force]
    strength: FloatArray  # (n,) [force], 0 unlimited

    def __len__(self) -> int:
        return len(self.stiffness)


@dataclass(frozen=True)
class CutReport:
    """Counts and areas of the cutting."""

    lines: int
    dropped_lines: int  # nothing is left of them
    shortened_lines: int  # a free end was cut off
    islands: int
    holes: int
    block_area: float
    hole_area: float
    enclosed_area: float  # within the outer contours, computed on its own

    @property
    def area_difference(self) -> float:
        """Area of blocks and holes less the enclosed area: rounding."""
        return self.block_area + self.hole_area - self.enclosed_area


class Blocks:
    """Blocks as cut: polygons with materials, and the points and bolts on them. Arrays cannot be changed."""

    def __init__(self, session: Session, *, was_cut: bool) -> None:
        self._session = session
        sizes, facts = session.sizes(), session.facts()
        #: (nb+1,) block i owns the vertices [offset[i], offset[i+1])
        self.vertex_offset: IntArray
        #: (nv, 2) counter-clockwise block by block [length]
        self.vertices: FloatArray
        #: (nv,) joint material of the edge that starts at the vertex; 0: a bridge to an island
        self.edge_joint: IntArray
        #: (nb,) material number, from 1
        self.material: IntArray
        arrays: list[Any] = session.array("blocks", sizes["blocks"], sizes["vertices"])
        self.vertex_offset, self.vertices, self.edge_joint, self.material = arrays
        self.fixed_points = Points(*session.array("points", 1, sizes["fixed"]))
        self.loading_points = Points(*session.array("points", 2, sizes["loading"]))
        self.measured_points = Points(*session.array("points", 3, sizes["measured"]))
        ends, block, values = session.array("bolts", sizes["bolts"])
        self.bolts = Bolts(ends, block, *values.T)
        #: what cutting did; None for blocks from a block file
        self.report: CutReport | None = None
        if was_cut:
            names = ["lines", "dropped_lines", "shortened_lines", "islands", "holes"]
            areas = ["block_area", "hole_area", "enclosed_area"]
            self.report = CutReport(*(sizes[name] for name in names), *(facts[name] for name in areas))
        #: notes and warnings
        self.messages: list[Problem] = [problem for problem, _ in session.messages()]

    def __len__(self) -> int:
        return len(self.material)

    def __repr__(self) -> str:
        return f"<rockdda.Blocks: {self.n_blocks} blocks, {self.n_vertices} vertices>"

    @property
    def n_blocks(self) -> int:
        return len(self.material)

    @property
    def n_vertices(self) -> int:
        return len(self.vertices)

    def polygons(self) -> list[FloatArray]:
        """For each block an (m, 2) array of its vertices, counter-clockwise, not closed [length]."""
        return np.split(self.vertices, self.vertex_offset[1:-1]) if self.n_blocks else []

    @property
    def areas(self) -> FloatArray:
        """(nb,) [length²]"""
        return self._areas_and_centroids()[0]

    @property
    def centroids(self) -> FloatArray:
        """(nb, 2) [length]"""
        return self._areas_and_centroids()[1]

    def _areas_and_centroids(self) -> tuple[FloatArray, FloatArray]:
        if self.n_blocks == 0:
            return np.zeros(0), np.zeros((0, 2))
        first = self.vertex_offset[:-1]
        following = after_on_block(self.vertex_offset)
        # relative to a vertex of the block, so that places far from the origin lose no digits
        origin = np.repeat(self.vertices[first], np.diff(self.vertex_offset), axis=0)
        a, b = self.vertices - origin, self.vertices[following] - origin
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        area = np.add.reduceat(cross, first) / 2
        moment = np.add.reduceat((a + b) * cross[:, None], first, axis=0) / 6
        return area, self.vertices[first] + moment / area[:, None]

    def write(self, path: PathLike) -> None:
        """Write a block file (.blk), which reads back bit for bit."""
        self._session("write_blocks", path)


@runtime_checkable
class HasGeometry(Protocol):
    """A model in memory, such as `rockdda.Model`."""

    name: str

    def geometry_text(self) -> str:
        """The geometry file (.dc)."""


def cut(
    geometry: PathLike | HasGeometry | npt.ArrayLike, *, e0: float | None = None, joint: npt.ArrayLike = 1,
    holes: npt.ArrayLike = (), output: PathLike | None = None, allow_open: bool = False,
) -> Blocks:  # fmt: skip
    """Cut the plane into blocks.

    geometry: a geometry file (.dc, .geo), a block file (.blk, which is read), a `Model`, or an array of lines, (n, 4)
    with the rows x1 y1 x2 y2. For an array, e0 is the distance below which nodes are one (default: 1e-6 of the
    extent), joint the joint material of all lines or of each, holes an (m, 2) array of points in openings.
    output: also write the blocks to this file, as `rockdda cut` does. allow_open: boundary lines that leave a gap or
    bound no block are a warning.

    Raises InputError; warnings (dropped lines, …) become `InputWarning`."""
    session = Session()
    was_cut = True
    if isinstance(geometry, HasGeometry):
        session("cut_text", f"{geometry.name}.dc", geometry.geometry_text(), allow_open)
    elif isinstance(geometry, str | os.PathLike):
        session("cut_file", geometry, allow_open)
        was_cut = session.sizes()["lines"] > 0
    else:
        rows = line_rows(geometry, joint)
        if e0 is None:
            ends = np.array([line for line, _ in rows]).reshape(-1, 2)
            e0 = 1e-6 * float(np.ptp(ends, axis=0).max() if len(ends) else 1.0)
        points = [coordinates(point) for point in np.asarray(holes, dtype=float).reshape(-1, 2).tolist()]
        session("cut_text", "lines.dc", GeometryDeck(e0, joints=rows, holes=points).text(), False)
    session.warn()
    blocks = Blocks(session, was_cut=was_cut)
    if output is not None:
        blocks.write(output)
    return blocks
