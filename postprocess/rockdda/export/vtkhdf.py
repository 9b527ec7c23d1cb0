# SPDX-License-Identifier: MIT
"""All frames in one file for ParaView: VTKHDF with time steps, written with h5py alone.

Layout: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html (VTKHDF, version 2.0, temporal unstructured
grid). A *part* is the connectivity of the cells; frames with the same cells share one.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from ..arrays import AnyArray
from ..errors import InputError
from ..text import PathLike
from ..units import description
from ..writing import complete_file
from .common import Progress, chosen
from .grids import Grid, grids_of, in_space

if TYPE_CHECKING:
    from ..results import Frame, Results

ROWS = 4096  # of a chunk


def to_vtkhdf(
    results: Results, path: PathLike, frames: Iterable[int] | None = None, progress: Progress | None = None
) -> Path:
    """Write frames (all by default) as VTKHDF with time steps (for ParaView 5.12, VTK 9.3, or later); returns the path.

    The cells and values are those of `to_vtk`: blocks in this file; bolts, linings, joints and edges of boundaries,
    where there are any, in files beside it (…_bolts.vtkhdf, …_liners.vtkhdf, …_joints.vtkhdf, …). Field data: index of
    the stage; attribute of each file: the system of units.
    """
    path = Path(path)
    if path.suffix.lower() not in (".vtkhdf", ".hdf"):
        raise InputError(f"VTKHDF files end in .vtkhdf, not in {path.suffix!r}", path)
    numbers = chosen(results, frames)
    writers: dict[str, _Writer] = {}
    with contextlib.ExitStack() as files:
        for done, number in enumerate(numbers, start=1):
            now = results.frames[number]
            grids = grids_of(results, now)
            for name in dict.fromkeys([*grids, *writers]):
                if name not in writers:
                    part = files.enter_context(complete_file(path.with_name(f"{path.stem}{name}{path.suffix}")))
                    writers[name] = _Writer(files.enter_context(h5py.File(part, "w")), description(results.units))
                writers[name].add(now, grids[name])
            if progress is not None:
                progress(done, len(numbers))
        for writer in writers.values():
            writer.finish()
    return path


class _Writer:
    """Appends time steps to an empty file."""

    def __init__(self, file: h5py.File, units: str) -> None:
        file.attrs["units"] = units
        self.root = file.create_group("VTKHDF")
        self.root.attrs["Version"] = np.array([2, 0])
        self.root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        self.steps = self.root.create_group("Steps")
        self.count = 0
        self._offset: AnyArray | None = None  # of the last part
        self._last_ids = np.zeros(0, dtype=np.int64)
        self._parts = self._cells = self._ids = 0  # before the last part: parts, cells, ids

    def _append(self, name: str, rows: AnyArray) -> int:
        """Append rows to a dataset; returns how many it had."""
        if name not in self.root:
            self.root.create_dataset(
                name, shape=(0, *rows.shape[1:]), maxshape=(None, *rows.shape[1:]), dtype=rows.dtype,
                chunks=(ROWS if rows.size > 1 else 64, *rows.shape[1:]), compression="gzip", compression_opts=4,
            )  # fmt: skip
        table = self.root[name]
        before = int(table.shape[0])
        table.resize(before + len(rows), axis=0)
        table[before:] = rows
        return before

    def _note(self, name: str, value: float, kind: type = np.int64) -> None:
        self._append(f"Steps/{name}", np.array([value], dtype=kind))

    def add(self, frame: Frame, grid: Grid) -> None:
        """A time step."""
        ids = grid.ids
        is_same = self._offset is not None and np.array_equal(grid.offset, self._offset)
        if not is_same or not np.array_equal(ids, self._last_ids):
            self._append("NumberOfPoints", np.array([len(grid.vertices)]))
            self._append("NumberOfCells", np.array([len(grid.offset) - 1]))
            self._append("NumberOfConnectivityIds", np.array([len(ids)]))
            self._ids = self._append("Connectivity", ids)
            self._cells = self._append("Types", np.full(len(grid.offset) - 1, grid.shape, dtype=np.uint8))
            self._append("Offsets", grid.offset.astype(np.int64))
            self._offset, self._last_ids, self._parts = grid.offset.copy(), ids, self._parts + 1
        self._note("Values", frame.time, np.float64)
        self._note("PartOffsets", self._parts - 1)
        self._note("NumberOfParts", 1)
        self._note("PointOffsets", self._append("Points", in_space(grid.vertices)))
        self._append("Steps/CellOffsets", np.array([[self._cells]]))
        self._append("Steps/ConnectivityIdOffsets", np.array([[self._ids]]))
        for kind, values in (("PointData", grid.points), ("CellData", grid.cells)):
            for name, rows in values.items():
                self._note(f"{kind}Offsets/{name}", self._append(f"{kind}/{name}", np.ascontiguousarray(rows)))
        self._note("FieldDataOffsets/stage", self._append("FieldData/stage", np.array([frame.stage], dtype=np.int32)))
        self._append("Steps/FieldDataSizes/stage", np.array([[1, 1]]))
        self.count += 1

    def finish(self) -> None:
        """Note how many steps there are."""
        self.steps.attrs["NSteps"] = self.count
