# SPDX-License-Identifier: MIT
"""Frames for ParaView and PyVista: VTK XML files, written by VTK itself."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import InputError, OutputError, RockddaError
from ..frames import FIELDS
from ..joints import JOINT_FIELDS
from .common import Progress, chosen, write_file

if TYPE_CHECKING:
    from ..results import Frame, Results

__all__ = ["to_vtk"]

Arrays = dict[str, npt.NDArray[Any]]
BOUNDARY_KINDS = ("fixed", "roller", "moving", "traction", "viscous", "free_field")  # 1, 2, … in the files
INTEGERS = ("material", "block")  # fields that are numbers of things


def to_vtk(
    results: Results,
    path: str | os.PathLike[str],
    frames: Iterable[int] | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write frames for ParaView and PyVista; returns the path.

    `path` ending in .pvd: an index with the times, beside a folder with one .vtu file for each frame (all by default);
    a path without ending gets this one, and an existing folder takes such files under the name of the results.
    Ending in .vtu: one frame (the last by default). Polygons are blocks. Vertices have displacements; cells have every
    field, velocities as vectors, stresses as 3 × 3 tensors, and block numbers (from 1). Bolts are lines with their
    forces, joints lines with stresses, opening, slip and mobilised strength, edges of boundaries lines with the number
    of the boundary, its kind (1 fixed, 2 roller, 3 moving, 4 traction) and force, in further files for each frame
    (…_bolts.vtu, …_joints.vtu, …_boundaries.vtu), which the index holds, too. Blocks that are not there are left out;
    field data name the stage.
    """
    _check_vtk()
    path = Path(path)
    if path.is_dir():
        path = path / f"{results.path.stem}.pvd"
    elif not path.suffix:
        path = path.with_name(path.name + ".pvd")
    if path.suffix.lower() == ".vtu":
        (number,) = [results.n_frames - 1] if frames is None else chosen(results, frames)
        now = results.frames[number]
        for name, grid in _grids(results, now).items():
            _write_grid(path.with_name(f"{path.stem}{name}.vtu"), grid)
        return path
    if path.suffix.lower() != ".pvd":
        raise InputError(f"VTK files end in .pvd (all frames) or .vtu (one frame), not in {path.suffix!r}", path)
    numbers = chosen(results, frames)
    folder = path.with_suffix("")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror}") from error
    index = ElementTree.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    collection = ElementTree.SubElement(index, "Collection")
    for done, number in enumerate(numbers, start=1):
        now = results.frames[number]
        files = []
        for name, grid in _grids(results, now).items():
            files.append(folder / f"{path.stem}{name}_{number:05d}.vtu")
            _write_grid(files[-1], grid)
        for k, file in enumerate(files):
            part = {"part": str(k)} if len(files) > 1 else {}
            entry = {"timestep": repr(now.time), **part, "file": f"{folder.name}/{file.name}"}
            ElementTree.SubElement(collection, "DataSet", entry)
        if progress is not None:
            progress(done, len(numbers))
    ElementTree.indent(index)
    text = ElementTree.tostring(index, encoding="unicode", xml_declaration=True) + "\n"
    write_file(path, lambda stream: stream.write(text))
    return path


def _grids(results: Results, frame: Frame) -> dict[str, Any]:
    """The grids of a frame by what their file names have behind the stem: blocks, bolts, joints."""
    grids = {"": _blocks(frame)}
    if len(frame.bolt_ends):
        grids["_bolts"] = _bolts(frame)
    if frame.results.has_joints:
        grids["_joints"] = _joints(frame)
    if len(results.boundary_edges):
        grids["_boundaries"] = _boundaries(results, frame)
    return grids


def _check_vtk() -> None:
    """RockddaError where VTK is not installed. Only its parts without graphics are used, which need no display."""
    try:
        import vtkmodules.vtkIOXML  # noqa: F401
    except ImportError as error:
        raise RockddaError(f"files for ParaView need VTK: python -m pip install vtk ({error})") from error


def _blocks(frame: Frame) -> Any:
    """One frame as a grid of polygons."""
    from vtkmodules.vtkCommonDataModel import VTK_POLYGON

    results = frame.results
    tensor = np.zeros((results.n_blocks, 3, 3))
    tensor[:, 0, 0], tensor[:, 1, 1] = frame.stress[:, 0], frame.stress[:, 1]
    tensor[:, 0, 1] = tensor[:, 1, 0] = frame.stress[:, 2]
    cells: Arrays = {
        name: frame.field(name).astype(np.int32 if name in INTEGERS else np.float64, copy=False) for name in FIELDS
    }
    cells["velocity"] = _in_space(frame.velocity[:, :2])
    cells["stress_tensor"] = tensor.reshape(-1, 9)
    cells["area_at_start"] = results.block_area
    points: Arrays = {
        "displacement": _in_space(frame.vertex_displacement),
        "edge_joint": results.edge_joint.astype(np.int32),
    }
    vertices, offset, active = frame.vertices, results.vertex_offset, frame.active
    if not active.all():  # blocks that are not there are left out; the field `block` keeps their numbers
        corners = np.diff(offset)
        there = np.repeat(active, corners)
        cells = {name: values[active] for name, values in cells.items()}
        points = {name: values[there] for name, values in points.items()}
        vertices, offset = vertices[there], np.concatenate([[0], np.cumsum(corners[active])])
    return _grid(frame, vertices, offset, VTK_POLYGON, points, cells)


def _bolts(frame: Frame) -> Any:
    """The bolts of a frame as a grid of lines."""
    from vtkmodules.vtkCommonDataModel import VTK_LINE

    ends, at_start = (bolts.reshape(-1, 2) for bolts in (frame.bolt_ends, frame.results.bolt_ends))
    n = len(frame.bolt_ends)
    cells: Arrays = {
        "force": frame.bolt_force,
        "bolt": np.arange(1, n + 1, dtype=np.int32),
        "blocks": (frame.results.bolt_blocks + 1).astype(np.int32),
    }
    return _grid(frame, ends, 2 * np.arange(n + 1), VTK_LINE, {"displacement": _in_space(ends - at_start)}, cells)


def _joints(frame: Frame) -> Any:
    """The joints of a frame as a grid of lines, one for each of their points."""
    from vtkmodules.vtkCommonDataModel import VTK_LINE

    table = frame.results.joints(frame.index)
    ends = table[["x1", "y1", "x2", "y2"]].to_numpy(dtype=float).reshape(-1, 2)
    cells: Arrays = {name: table[name].to_numpy(dtype=float) for name in (*JOINT_FIELDS, "length")}
    cells |= {name: table[name].to_numpy().astype(np.int32) for name in ("state", "material")}
    cells["joint"] = (table["joint"].to_numpy() + 1).astype(np.int32)
    cells["blocks"] = (table[["first", "second"]].to_numpy() + 1).astype(np.int32)
    cells["force"] = _in_space(table[["force_x", "force_y"]].to_numpy(dtype=float))
    return _grid(frame, ends, 2 * np.arange(len(table) + 1), VTK_LINE, {}, cells)


def _boundaries(results: Results, frame: Frame) -> Any:
    """The edges of boundaries in a frame as a grid of lines, without those of blocks that are not there."""
    from vtkmodules.vtkCommonDataModel import VTK_LINE

    ends, number = results.boundary_ends, results.boundary_edges[:, 0]
    there = np.repeat(frame.active, np.diff(results.vertex_offset))[ends[:, 0]]
    ends, number = ends[there], number[there]
    kind = np.array([1 + BOUNDARY_KINDS.index(name) for name in results.boundary_kinds])
    row = int(np.searchsorted(results["history/step"], frame.step))
    force = results.boundary_force[row] if frame.step > 0 else np.zeros((len(kind), 2))
    cells: Arrays = {"boundary": (number + 1).astype(np.int32), "kind": kind[number].astype(np.int32)}
    cells["force_of_boundary"] = _in_space(force[number])
    return _grid(frame, frame.vertices[ends].reshape(-1, 2), 2 * np.arange(len(ends) + 1), VTK_LINE, {}, cells)


def _in_space(vectors: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Vectors in the plane with a third component, zero."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _grid(
    frame: Frame, vertices: npt.NDArray[Any], offset: npt.NDArray[Any], shape: int, points: Arrays, cells: Arrays
) -> Any:
    """An unstructured grid of cells of one shape; cell i owns the vertices [offset[i], offset[i+1]). Its field data are
    the time and the stage of the frame: index, from 0, and name."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    grid = vtkUnstructuredGrid()
    places = vtkPoints()
    places.SetData(numpy_to_vtk(_in_space(vertices), deep=True))
    grid.SetPoints(places)
    connectivity = np.arange(len(vertices), dtype=np.int64)
    cell_array = vtkCellArray()
    cell_array.SetData(
        numpy_to_vtkIdTypeArray(offset.astype(np.int64), deep=True), numpy_to_vtkIdTypeArray(connectivity, deep=True)
    )
    grid.SetCells(shape, cell_array)
    for data, arrays in ((grid.GetPointData(), points), (grid.GetCellData(), cells)):
        for name, values in arrays.items():
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            data.AddArray(array)
    for name, number in (("TimeValue", np.array([frame.time])), ("stage", np.array([frame.stage], dtype=np.int32))):
        array = numpy_to_vtk(number, deep=True)
        array.SetName(name)
        grid.GetFieldData().AddArray(array)
    stage = vtkStringArray()
    stage.SetName("stage_name")
    stage.InsertNextValue(frame.stage_name)
    grid.GetFieldData().AddArray(stage)
    return grid


def _write_grid(path: Path, grid: Any) -> None:
    """Write a .vtu file, compressed."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.SetCompressorTypeToZLib()
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise OutputError(f"{path}: VTK cannot write the file")
    text = writer.GetOutputString()
    write_file(path, lambda stream: stream.write(text))
