# SPDX-License-Identifier: MIT
"""What files for ParaView hold of a frame, as plain arrays: blocks, bolts, linings, joints, boundaries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import AnyArray, IntArray
from ..columns import Columns
from ..frames import FIELDS
from ..joints import JOINT_FIELDS, joint_points
from ..results import Frame, Results
from ..rings import triangles

Arrays = dict[str, AnyArray]
BOUNDARY_KINDS = ("fixed", "roller", "moving", "traction", "viscous", "free_field")  # 1, 2, … in the files
INTEGERS = ("material", "block")  # fields that are numbers of things
LINE, POLYGON = 3, 7  # cells of VTK


@dataclass(frozen=True)
class Grid:
    """Cells of one shape; cell i has the vertices connectivity[offset[i]:offset[i+1]], without it these themselves."""

    vertices: AnyArray  # (n, 2)
    offset: AnyArray
    shape: int  # number of the kind of cell in VTK
    points: Arrays  # values of vertices
    cells: Arrays  # and of cells
    connectivity: AnyArray | None = None

    @property
    def ids(self) -> IntArray:
        """The vertices of all cells, one cell after the other."""
        if self.connectivity is None:
            return np.arange(len(self.vertices), dtype=np.int64)
        return self.connectivity.astype(np.int64)


def grids_of(results: Results, frame: Frame) -> dict[str, Grid]:
    """The grids of a frame by what their file names have behind the stem: blocks, bolts, linings, joints."""
    grids = {"": _blocks(frame)}
    if frame.bolt_pieces.n_rows:
        grids["_bolts"] = _bolts(frame)
    if frame.liner_pieces.n_rows:
        grids["_liners"] = _liners(frame)
    if frame.results.has_joints:
        grids["_joints"] = _joints(frame)
    if len(results.boundary_edges):
        grids["_boundaries"] = _boundaries(results, frame)
    return grids


def _blocks(frame: Frame) -> Grid:
    """One frame as a grid of polygons. A block with holes is several triangles, since no cell of VTK has holes."""
    results = frame.results
    tensor = np.zeros((results.n_blocks, 3, 3))
    tensor[:, 0, 0], tensor[:, 1, 1] = frame.stress[:, 0], frame.stress[:, 1]
    tensor[:, 0, 1] = tensor[:, 1, 0] = frame.stress[:, 2]
    cells: Arrays = {
        name: frame.field(name).astype(np.int32 if name in INTEGERS else np.float64, copy=False) for name in FIELDS
    }
    cells["velocity"] = in_space(frame.velocity[:, :2])
    cells["stress_tensor"] = tensor.reshape(-1, 9)
    cells["area_at_start"] = results.block_area
    points: Arrays = {
        "displacement": in_space(frame.vertex_displacement),
        "edge_joint": results.edge_joint.astype(np.int32),
    }
    vertices, offset, active = frame.vertices, results.vertex_offset, frame.active
    holed = [i for i, rings in enumerate(results.rings) if len(rings) > 1]
    if not active.all():  # blocks that are not there are left out; the field `block` keeps their numbers
        corners = np.diff(offset)
        there = np.repeat(active, corners)
        cells = {name: values[active] for name, values in cells.items()}
        points = {name: values[there] for name, values in points.items()}
        vertices, offset = vertices[there], np.concatenate([[0], np.cumsum(corners[active])])
        holed = (np.cumsum(active) - 1)[[i for i in holed if active[i]]].tolist()
    if not holed:
        return Grid(vertices, offset, POLYGON, points, cells)
    pieces = [[ring] for ring in np.split(np.arange(len(vertices)), offset[1:-1])]
    at_start = results.vertices[np.repeat(active, np.diff(results.vertex_offset))]
    for i in holed:
        first = pieces[i][0][0]
        pieces[i] = [first + triangle for triangle in triangles(at_start[pieces[i][0]])]
    cells = {name: np.repeat(values, [len(parts) for parts in pieces], axis=0) for name, values in cells.items()}
    parts = [part for parts in pieces for part in parts]
    offset = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
    return Grid(vertices, offset, POLYGON, points, cells, np.concatenate(parts))


def _support(frame: Frame, what: str) -> tuple[Columns, AnyArray, dict[str, Any]]:
    """Which bolts or linings are there, where that stands among all pieces, and what a grid of lines takes."""
    all_now, at_start = (getattr(one, f"{what}_pieces") for one in (frame, frame.results.frames[0]))
    there = all_now["there"]
    ends, start = (one.stack("x1", "y1", "x2", "y2")[there].reshape(-1, 2) for one in (all_now, at_start))
    offset = 2 * np.arange(len(ends) // 2 + 1)
    moved = {"displacement": in_space(ends - start)}
    return all_now.rows(there), there, {"vertices": ends, "offset": offset, "points": moved}


def _bolts(frame: Frame) -> Grid:
    """The bolts of a frame as a grid of lines."""
    pieces, there, lines = _support(frame, "bolt")
    blocks = np.full((len(there), 2), -1)  # of parts between nodes none is known
    blocks[: len(frame.bolt_ends)] = frame.results.bolt_blocks + 1
    cells: Arrays = {name: pieces[name] for name in ("force", "use")}
    cells |= {"bolt": (pieces["bolt"] + 1).astype(np.int32), "blocks": blocks[there].astype(np.int32)}
    if frame.results.bolt_names:
        cells["force_per_metre"] = cells["force"] / frame.results.bolt_spacing[pieces["bolt"]]
    return Grid(shape=LINE, cells=cells, **lines)


def _liners(frame: Frame) -> Grid:
    """The linings of a frame as a grid of lines; N, M, Q are means of both ends, the share of the strength the
    larger one."""
    pieces, _, lines = _support(frame, "liner")
    cells: Arrays = {name: pieces[name] for name in ("N", "M", "Q", "use")}
    return Grid(shape=LINE, cells=cells | {"liner": (pieces["liner"] + 1).astype(np.int32)}, **lines)


def _joints(frame: Frame) -> Grid:
    """The joints of a frame as a grid of lines, one for each of their points."""
    table = joint_points(frame)
    ends = table.stack("x1", "y1", "x2", "y2").reshape(-1, 2)
    cells: Arrays = {name: table[name].astype(float) for name in (*JOINT_FIELDS, "length")}
    cells |= {name: table[name].astype(np.int32) for name in ("state", "material")}
    cells["joint"] = (table["joint"] + 1).astype(np.int32)
    cells["blocks"] = (table.stack("first", "second") + 1).astype(np.int32)
    cells["force"] = in_space(table.stack("force_x", "force_y"))
    return Grid(ends, 2 * np.arange(table.n_rows + 1), LINE, {}, cells)


def _boundaries(results: Results, frame: Frame) -> Grid:
    """The edges of boundaries in a frame as a grid of lines, without those of blocks that are not there."""
    ends, number = results.boundary_ends, results.boundary_edges[:, 0]
    there = np.repeat(frame.active, np.diff(results.vertex_offset))[ends[:, 0]]
    ends, number = ends[there], number[there]
    kind = np.array([1 + BOUNDARY_KINDS.index(name) for name in results.boundary_kinds])
    row = int(np.searchsorted(results["history/step"], frame.step))
    force = results.boundary_force[row] if frame.step > 0 else np.zeros((len(kind), 2))
    cells: Arrays = {"boundary": (number + 1).astype(np.int32), "kind": kind[number].astype(np.int32)}
    cells["force_of_boundary"] = in_space(force[number])
    return Grid(frame.vertices[ends].reshape(-1, 2), 2 * np.arange(len(ends) + 1), LINE, {}, cells)


def in_space(vectors: AnyArray) -> AnyArray:
    """Vectors in the plane with a third component, zero."""
    return np.column_stack([vectors, np.zeros(len(vectors))])
