# SPDX-License-Identifier: MIT
"""Results for other programs: VTK (ParaView, PyVista), tables as CSV, outlines as plain text or DXF."""

from __future__ import annotations

import base64
import os
import struct
import zlib
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
import numpy.typing as npt

from ..errors import InputError, OutputError
from ..results import FIELDS

if TYPE_CHECKING:
    from ..results import Frame, Results

__all__ = ["to_csv", "to_dxf", "to_text", "to_vtk"]

Progress = Callable[[int, int], None]
LINE, POLYGON = 3, 7  # VTK's numbers
TYPES = {"f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}


def chosen(results: Results, frames: Iterable[int] | None) -> list[int]:
    """Frame numbers from 0, all of them by default; negative ones count from the end."""
    return [results.frames[k].index for k in (range(results.n_frames) if frames is None else frames)]


def to_vtk(
    results: Results,
    path: str | os.PathLike[str],
    frames: Iterable[int] | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write frames for ParaView and PyVista; returns the path.

    `path` ending in .pvd: an index with the times, beside a folder with one .vtu file for each frame (all by default);
    a path without ending gets this one, and an existing folder takes such files under the name of the results.
    Ending in .vtu: one frame (the last by default). Polygons are blocks; with the points go displacements, with the
    cells every field, stresses as 3 × 3 tensors, velocities and block numbers (from 1). Bolts are lines with their
    forces, in a second file for each frame (…_bolts.vtu), which the index holds, too.
    """
    path = Path(path)
    if path.is_dir():
        path = path / f"{results.path.stem}.pvd"
    elif not path.suffix:
        path = path.with_name(path.name + ".pvd")
    if path.suffix.lower() == ".vtu":
        (number,) = [results.n_frames - 1] if frames is None else chosen(results, frames)
        now = results.frames[number]
        _write(path, partial(_write_text, _vtu(now)))
        if len(now.bolt_ends):
            _write(path.with_name(f"{path.stem}_bolts.vtu"), partial(_write_text, _bolts_vtu(now)))
        return path
    if path.suffix.lower() != ".pvd":
        raise InputError(f"VTK files end in .pvd (all frames) or .vtu (one frame), not in {path.suffix!r}", path)
    numbers = chosen(results, frames)
    folder = path.with_suffix("")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror}") from error
    rows = []
    for done, number in enumerate(numbers, start=1):
        now = results.frames[number]
        part = folder / f"{path.stem}_{number:05d}.vtu"
        _write(part, partial(_write_text, _vtu(now)))
        parts = [part]
        if len(now.bolt_ends):
            parts.append(folder / f"{path.stem}_bolts_{number:05d}.vtu")
            _write(parts[1], partial(_write_text, _bolts_vtu(now)))
        for k, piece in enumerate(parts):
            place = f'part="{k}" ' if len(parts) > 1 else ""
            rows.append(f'    <DataSet timestep="{now.time!r}" {place}file="{folder.name}/{piece.name}"/>\n')
        if progress is not None:
            progress(done, len(numbers))
    head = (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n  <Collection>\n'
    )
    _write(path, lambda stream: stream.write(f"{head}{''.join(rows)}  </Collection>\n</VTKFile>\n"))
    return path


def _array(name: str, values: npt.NDArray[Any], kind: str, components: int = 1) -> str:
    """A DataArray element, compressed as VTK reads it: header of four numbers, then one zlib block, each in base64."""
    data = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    packed = zlib.compress(data)
    header = struct.pack("<4Q", 1, len(data), 0, len(packed)) if data else struct.pack("<Q", 0)
    content = base64.b64encode(header).decode() + (base64.b64encode(packed).decode() if data else "")
    shape = f' NumberOfComponents="{components}"' if components > 1 else ""
    return f'<DataArray type="{TYPES[kind]}" Name="{name}"{shape} format="binary">{content}</DataArray>\n'


def _vtu(frame: Frame) -> str:
    """One frame as an unstructured grid of polygons."""
    results = frame.results
    nb = results.n_blocks
    tensor = np.zeros((nb, 3, 3))
    tensor[:, 0, 0], tensor[:, 1, 1] = frame.stress[:, 0], frame.stress[:, 1]
    tensor[:, 0, 1] = tensor[:, 1, 0] = frame.stress[:, 2]
    cells = [
        _array(name, frame.field(name), "i4" if name in ("material", "block") else "f8")
        for name in FIELDS
        if name != "velocity"
    ]
    cells += [
        _array("velocity", _flat(frame.velocity[:, :2]), "f8", 3),
        _array("stress_tensor", tensor.reshape(nb, 9), "f8", 9),
        _array("area_at_start", results.block_area, "f8"),
    ]
    point_data = [
        _array("displacement", _flat(frame.vertex_displacement), "f8", 3),
        _array("edge_joint", results.edge_joint, "i4"),
    ]
    return _grid(frame.time, frame.vertices, results.vertex_offset[1:], POLYGON, point_data, cells)


def _bolts_vtu(frame: Frame) -> str:
    """The bolts of a frame as lines."""
    ends, blocks = frame.bolt_ends, frame.results.bolt_blocks + 1
    cells = [
        _array("force", frame.bolt_force, "f8"),
        _array("bolt", np.arange(1, len(ends) + 1), "i4"),
        _array("blocks", blocks, "i4", 2),
    ]
    points = ends.reshape(-1, 2)
    displacement = _array("displacement", _flat(points - frame.results.bolt_ends.reshape(-1, 2)), "f8", 3)
    return _grid(frame.time, points, 2 * np.arange(1, len(ends) + 1), LINE, [displacement], cells)


def _flat(vectors: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Vectors in the plane with a third component."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _grid(
    time: float, points: npt.NDArray[Any], offsets: npt.NDArray[Any], kind: int, point_data: list[str], cells: list[str]
) -> str:
    """An unstructured grid of cells of one kind; each has points of its own."""
    n_points, n_cells = len(points), len(offsets)
    return "".join(
        [
            '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
            'header_type="UInt64" compressor="vtkZLibDataCompressor">\n<UnstructuredGrid>\n',
            f'<FieldData>\n<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1">{time!r}</DataArray>\n',
            f'</FieldData>\n<Piece NumberOfPoints="{n_points}" NumberOfCells="{n_cells}">\n<Points>\n',
            _array("Points", _flat(points), "f8", 3),
            "</Points>\n<Cells>\n",
            _array("connectivity", np.arange(n_points), "i8"),
            _array("offsets", offsets, "i8"),
            _array("types", np.full(n_cells, kind), "u1"),
            "</Cells>\n<PointData>\n",
            *point_data,
            "</PointData>\n<CellData>\n",
            *cells,
            "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        ]
    )


def to_csv(
    results: Results,
    path: str | os.PathLike[str],
    what: str = "history",
    frames: Iterable[int] | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a table; returns the path. `what` is 'history' (one row per step), 'blocks' (per frame and block: centroid
    and every field), 'vertices' (per frame and vertex), 'contacts' (per frame and contact) or 'bolts' (per frame and
    bolt: its ends, their blocks, its length and axial force).

    Numbers have as many digits as it takes to read back the same value. Blocks, vertices, points and bolts count from
    1, as in the input files (block 0 of a bolt: the fixed outside); frame 0 is the start.
    """
    path = Path(path)
    if what == "history":
        _write(path, lambda stream: results.history().to_csv(stream, lineterminator="\n"))
        return path
    tables = {"blocks": _block_rows, "vertices": _vertex_rows, "contacts": _contact_rows, "bolts": _bolt_rows}
    if what not in tables:
        raise InputError(f"there is no table {what!r}; the tables are: history, {', '.join(tables)}")
    numbers = chosen(results, frames)

    def write(stream: TextIO) -> None:
        for k, number in enumerate(numbers):
            now = results.frames[number]
            columns = {"frame": now.index, "time": now.time} | tables[what](now)
            length = max((len(values) for values in columns.values() if isinstance(values, np.ndarray)), default=0)
            if k == 0:
                stream.write(",".join(columns) + "\n")
            lists = [v.tolist() if isinstance(v, np.ndarray) else [v] * length for v in columns.values()]
            stream.writelines(",".join(map(repr, row)) + "\n" for row in zip(*lists, strict=True))
            if progress is not None:
                progress(k + 1, len(numbers))

    _write(path, write)
    return path


def _block_rows(frame: Frame) -> dict[str, Any]:
    fields = {name: frame.field(name) for name in FIELDS if name != "block"}
    return {"block": frame.field("block"), "x": frame.centroid[:, 0], "y": frame.centroid[:, 1]} | fields


def _owner(frame: Frame) -> npt.NDArray[Any]:
    return np.repeat(np.arange(frame.results.n_blocks), np.diff(frame.results.vertex_offset))


def _vertex_rows(frame: Frame) -> dict[str, Any]:
    owner = _owner(frame)
    number = np.arange(len(owner)) - frame.results.vertex_offset[owner]
    return {"block": owner + 1, "vertex": number + 1, "x": frame.vertices[:, 0], "y": frame.vertices[:, 1]}


def _contact_rows(frame: Frame) -> dict[str, Any]:
    contacts = frame.contacts
    columns: dict[str, Any] = {"first": contacts.blocks[:, 0] + 1, "second": contacts.blocks[:, 1] + 1}
    columns |= {"x": contacts.point[:, 0], "y": contacts.point[:, 1], "state": contacts.state}
    return columns | {"force_x": contacts.force[:, 0], "force_y": contacts.force[:, 1]}


def _bolt_rows(frame: Frame) -> dict[str, Any]:
    ends, blocks = frame.bolt_ends, frame.results.bolt_blocks + 1
    columns: dict[str, Any] = {"bolt": np.arange(1, len(ends) + 1), "first": blocks[:, 0], "second": blocks[:, 1]}
    columns |= {f"{axis}{end + 1}": ends[:, end, k] for end in (0, 1) for k, axis in enumerate("xy")}
    return columns | {"length": np.hypot(*(ends[:, 1] - ends[:, 0]).T), "force": frame.bolt_force}


def to_text(
    results: Results,
    path: str | os.PathLike[str],
    frames: Iterable[int] | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write the outlines as plain text for old plotting scripts; returns the path.

    Per frame a comment with number, step and time, then lines `block vertex x y`, counted from 1; the first vertex is
    repeated at the end of its block, and an empty line follows, so that gnuplot draws closed outlines.
    """
    path = Path(path)
    numbers = chosen(results, frames)

    def write(stream: TextIO) -> None:
        stream.write("# block vertex x y\n")
        for k, number in enumerate(numbers):
            now = results.frames[number]
            stream.write(f"# frame {now.index} step {now.step} time {now.time!r}\n")
            for i, polygon in enumerate(now.polygons(), start=1):
                rows = [(v, *corner) for v, corner in enumerate(polygon.tolist(), start=1)]
                stream.writelines(f"{i} {v} {x!r} {y!r}\n" for v, x, y in [*rows, rows[0]])
                stream.write("\n")
            stream.write("\n")
            if progress is not None:
                progress(k + 1, len(numbers))

    _write(path, write)
    return path


def to_dxf(results: Results, path: str | os.PathLike[str], frame: int = -1) -> Path:
    """Write the outlines of a frame's blocks as a drawing; returns the path."""
    from ..convert.dxf import write_dxf

    return write_dxf(results.frames[frame], Path(path))


def parse_frames(text: str | None, count: int) -> Sequence[int] | None:
    """Frame numbers from '3', '-1', '0,5,10', '0:50:10' or '::5'; None for all."""
    if text is None or text in ("", "all", ":"):
        return None
    found: list[int] = []
    for part in text.split(","):
        numbers = part.split(":")
        try:
            if len(numbers) == 1:
                found.append(int(part))
            else:
                found += range(count)[slice(*(int(number) if number else None for number in numbers))]
        except ValueError:
            raise InputError(f"frames {text!r}: expected numbers and ranges, such as -1, 0,5,10 or 0:50:10") from None
    return found


def _write_text(text: str, stream: TextIO) -> None:
    stream.write(text)


def _write(path: Path, work: Callable[[TextIO], Any]) -> None:
    """Write a text file under another name, and rename it when it is complete."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("w", encoding="utf-8", newline="\n") as stream:
            work(stream)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror}") from error
