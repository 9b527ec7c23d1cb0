# SPDX-License-Identifier: MIT
"""Frames for ParaView and PyVista: VTK XML files, written by VTK itself."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, OutputError, RockddaError, how_to_install
from ..text import PathLike
from ..units import description
from ..writing import make_folder, write_file
from .common import Progress, chosen
from .grids import Grid, grids_of, in_space
from .vtkhdf import to_vtkhdf

if TYPE_CHECKING:
    from ..results import Frame, Results


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
    there are left out; field data name the stage and the system of units.
    """
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
            _write_grid(path.with_name(f"{path.stem}{name}.vtu"), _grid(now, grid))
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
            _write_grid(files[-1], _grid(now, grid))
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
    write_file(path, text)
