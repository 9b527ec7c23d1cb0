# SPDX-License-Identifier: MIT
"""Frames for ParaView and PyVista: VTK XML files, written by VTK itself; VTKHDF with time steps, by h5py alone.

Layout of VTKHDF: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html (version 2.0, temporal
unstructured grid). A *part* is the connectivity of the cells; frames with the same cells share one.
"""

from __future__ import annotations

import contextlib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..arrays import AnyArray
from ..errors import InputError, OutputError, RockddaError, how_to_install
from ..results import Frame, Results
from ..text import PathLike
from ..units import description
from ..writing import complete_file, make_folder, write_file
from .grids import Grid, grids_of, in_space
from .tables import Progress, chosen

ROWS = 4096  # of a chunk


def to_vtkhdf(
    results: Results, path: PathLike, frames: Iterable[int] | None = None, progress: Progress | None = None
) -> Path:
    """Write frames (all by default) as VTKHDF with time steps (for ParaView 5.12, VTK 9.3, or later); returns the path.

    The cells and values are those of `to_vtk`: blocks in this file; bolts, linings, joints and edges of boundaries,
    where there are any, in files beside it (…_bolts.vtkhdf, …_liners.vtkhdf, …_joints.vtkhdf, …). Field data: index of
    the stage; attribute of each file: the system of units."""
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


def to_vtk(
    results: Results, path: PathLike, frames: Iterable[int] | None = None, progress: Progress | None = None
) -> Path:
    """Write frames for ParaView and PyVista; returns the path.

    `path` ending in .pvd: an index with the times, beside a folder with one .vtu file for each frame (all by
    default); a path without ending gets this one, and an existing folder takes such files under the name of the
    results. Ending in .vtkhdf: all frames in one file (`to_vtkhdf`). Ending in .vtu: one frame (the last by default).
    Polygons are blocks; a block with holes is several triangles with its number.
    Vertices have displacements; cells have every field, velocities as vectors, stresses as 3 × 3
    tensors, and block numbers (from 1). Bolts are lines with their forces, linings lines with N, M, Q and the share of
    their strength, joints lines with stresses, opening, slip and mobilised strength, edges of boundaries lines with the
    number of the boundary, its kind (1 fixed, 2 roller, 3 moving, 4 traction) and force, in further files for each
    frame (…_bolts.vtu, …_liners.vtu, …_joints.vtu, …_boundaries.vtu), which the index holds, too. Blocks that are not
    there are left out; field data name the stage and the system of units."""
    path = Path(path)
    if path.suffix.lower() in (".vtkhdf", ".hdf"):
        return to_vtkhdf(results, path, frames, progress)
    _check_vtk()
    if path.is_dir():
        path = path / f"{results.path.stem}.pvd"
    elif not path.suffix:
        path = path.with_name(path.name + ".pvd")
    if path.suffix.lower() == ".vtu":
        (number,) = [results.n_frames - 1] if frames is None else chosen(results, frames)
        now = results.frames[number]
        for name, grid in grids_of(results, now).items():
            _write_grid(path.with_name(f"{path.stem}{name}.vtu"), now, grid)
        return path
    if path.suffix.lower() != ".pvd":
        raise InputError(
            f"VTK files end in .pvd or .vtkhdf (all frames) or .vtu (one frame), not in {path.suffix!r}", path
        )
    numbers = chosen(results, frames)
    folder = path.with_suffix("")
    make_folder(folder)
    index = ElementTree.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    collection = ElementTree.SubElement(index, "Collection")
    for done, number in enumerate(numbers, start=1):
        now = results.frames[number]
        files = []
        for name, grid in grids_of(results, now).items():
            files.append(folder / f"{path.stem}{name}_{number:05d}.vtu")
            _write_grid(files[-1], now, grid)
        for k, file in enumerate(files):
            part = {"part": str(k)} if len(files) > 1 else {}
            entry = {"timestep": repr(now.time), **part, "file": f"{folder.name}/{file.name}"}
            ElementTree.SubElement(collection, "DataSet", entry)
        if progress is not None:
            progress(done, len(numbers))
    ElementTree.indent(index)
    text = ElementTree.tostring(index, encoding="unicode", xml_declaration=True) + "\n"
    write_file(path, text)
    return path


def _check_vtk() -> None:
    """RockddaError where VTK is not installed. Only its parts without graphics are used, which need no display."""
    try:
        import vtkmodules.vtkIOXML  # noqa: F401
    except ImportError as error:
        raise RockddaError(
            f"files .vtu and .pvd need VTK: {how_to_install('vtk')}, or write .vtkhdf ({error})"
        ) from error


def _grid(frame: Frame, found: Grid) -> Any:
    """An unstructured grid of VTK, whose field data are time and stage of the frame: index, from 0, and name."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    grid = vtkUnstructuredGrid()
    places = vtkPoints()
    places.SetData(numpy_to_vtk(in_space(found.vertices), deep=True))
    grid.SetPoints(places)
    cell_array = vtkCellArray()
    cell_array.SetData(
        numpy_to_vtkIdTypeArray(found.offset.astype(np.int64), deep=True), numpy_to_vtkIdTypeArray(found.ids, deep=True)
    )
    grid.SetCells(found.shape, cell_array)
    for data, arrays in ((grid.GetPointData(), found.points), (grid.GetCellData(), found.cells)):
        for name, values in arrays.items():
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            data.AddArray(array)
    for name, number in (("TimeValue", np.array([frame.time])), ("stage", np.array([frame.stage], dtype=np.int32))):
        array = numpy_to_vtk(number, deep=True)
        array.SetName(name)
        grid.GetFieldData().AddArray(array)
    for name, text in (("stage_name", frame.stage_name), ("units", description(frame.results.units))):
        word = vtkStringArray()
        word.SetName(name)
        word.InsertNextValue(text)
        grid.GetFieldData().AddArray(word)
    return grid


def _write_grid(path: Path, frame: Frame, found: Grid) -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(_grid(frame, found))
    writer.SetDataModeToBinary()
    writer.SetCompressorTypeToZLib()
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise OutputError(f"{path}: VTK cannot write the file")
    write_file(path, writer.GetOutputString())
