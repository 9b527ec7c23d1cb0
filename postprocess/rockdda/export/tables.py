# SPDX-License-Identifier: MIT
"""Results as tables: CSV, plain text for old plotting scripts, DXF outlines; which frames are written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from ..columns import Columns
from ..convert.dxf import write_dxf
from ..errors import InputError
from ..joints import joint_points, need_contacts, summary_columns
from ..results import FIELDS, Frame, Results
from ..text import PathLike, csv_text
from ..units import Units, description, with_units
from ..writing import write_file

#: Called with the number of frames written and the number to write.
Progress = Callable[[int, int], None]


def chosen(results: Results, frames: Iterable[int] | None) -> list[int]:
    """Frame numbers from 0, all of them by default; negative ones count from the end."""
    return [results.frames[k].index for k in (range(results.n_frames) if frames is None else frames)]


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


def to_csv(
    results: Results, path: PathLike, what: str = "history", frames: Iterable[int] | None = None,
    progress: Progress | None = None,
) -> Path:  # fmt: skip
    """Write a table; returns the path.

    Headers have the units of the results where those are known, as in 'force_x [kN]'.

    `what` is 'history' (one row per step), 'boundaries' (per stage and boundary: its kind and its force at the end of
    the stage), 'blocks' (per frame and block: centroid, every field, index of the stage, 1 where the block is there),
    'vertices' (per frame and vertex), 'contacts' (per frame and contact), 'joints' (per frame and pair of blocks: see
    `rockdda.joints.joint_summary`), 'joint_points' (per frame and point of a joint: see `Results.joints`), 'bolts'
    (per frame and bolt: its ends, their blocks, its length and axial force; where bolts have nodes, per node: place,
    force per bolt and per metre, slip, state) or 'liner' (per frame and node of a lining: place, N, M, Q, state).

    Numbers have as many digits as it takes to read back the same value. Blocks, vertices, points and bolts count from
    1, as in the input files (block 0 of a bolt: the fixed outside); frame 0 is the start."""
    path = Path(path)
    units = Units.parse(None, results)
    if what == "history":
        return _write_columns(path, results.history_columns(), units)
    if what == "boundaries":
        return _write_columns(path, results.boundary_columns(), units)
    tables: dict[str, Callable[[Frame], dict[str, Any]]] = {
        "blocks": _block_rows, "vertices": _vertex_rows, "contacts": contact_rows,
        "joints": lambda frame: counted_from_1(summary_columns(joint_points(frame))),
        "joint_points": lambda frame: counted_from_1(joint_points(frame).without("edge")),
        "bolts": _bolt_rows, "liner": _liner_rows,
    }  # fmt: skip
    if what not in tables:
        raise InputError(f"there is no table {what!r}; the tables are: history, boundaries, {', '.join(tables)}")
    if what in ("contacts", "joints", "joint_points"):
        need_contacts(results)
    numbers = chosen(results, frames)

    def write(stream: TextIO) -> None:
        for k, number in enumerate(numbers):
            now = results.frames[number]
            columns = {"frame": now.index, "time": now.time} | tables[what](now)
            length = max((len(values) for values in columns.values() if isinstance(values, np.ndarray)), default=0)
            if k == 0:
                stream.write(",".join(with_units(columns, units)) + "\n")
            lists = [v.tolist() if isinstance(v, np.ndarray) else [v] * length for v in columns.values()]
            stream.writelines(",".join(map(_cell, row)) + "\n" for row in zip(*lists, strict=True))
            if progress is not None:
                progress(k + 1, len(numbers))

    write_file(path, write)
    return path


def _write_columns(path: Path, table: Columns, units: Units) -> Path:
    write_file(path, csv_text(dict(zip(with_units(table, units), table.values(), strict=True))))
    return path


def _cell(value: Any) -> str:
    return value if isinstance(value, str) else repr(value)


def _block_rows(frame: Frame) -> dict[str, Any]:
    fields = {name: frame.field(name) for name in FIELDS if name != "block"}
    places = {"block": frame.field("block"), "x": frame.centroid[:, 0], "y": frame.centroid[:, 1]}
    stage = np.full(frame.results.n_blocks, frame.stage)
    return places | fields | {"stage": stage, "active": frame.active.astype(int)}


def _vertex_rows(frame: Frame) -> dict[str, Any]:
    owner = np.repeat(np.arange(frame.results.n_blocks), np.diff(frame.results.vertex_offset))
    number = np.arange(len(owner)) - frame.results.vertex_offset[owner]
    return {"block": owner + 1, "vertex": number + 1, "x": frame.vertices[:, 0], "y": frame.vertices[:, 1]}


def contact_rows(frame: Frame) -> dict[str, Any]:
    contacts = frame.contacts
    columns: dict[str, Any] = {"first": contacts.blocks[:, 0] + 1, "second": contacts.blocks[:, 1] + 1}
    columns |= {"x": contacts.point[:, 0], "y": contacts.point[:, 1], "state": contacts.state}
    return columns | {"force_x": contacts.force[:, 0], "force_y": contacts.force[:, 1]}


def counted_from_1(table: Columns) -> dict[str, Any]:
    """The columns of a table whose joints and blocks count from 0."""
    counted = ("joint", "first", "second")
    return {name: values + (name in counted) for name, values in table.items()}


def _liner_rows(frame: Frame) -> dict[str, Any]:
    table = frame.liner_node_columns
    return table | {"liner": table["liner"] + 1}


def _bolt_rows(frame: Frame) -> dict[str, Any]:
    if frame.results.bolt_names:
        table = frame.bolt_node_columns
        spacing = frame.results.bolt_spacing[table["bolt"]]
        return table | {"bolt": table["bolt"] + 1, "force_per_metre": table["force"] / spacing}
    ends, blocks = frame.bolt_ends, frame.results.bolt_blocks + 1
    columns: dict[str, Any] = {"bolt": np.arange(1, len(ends) + 1), "first": blocks[:, 0], "second": blocks[:, 1]}
    columns |= {f"{axis}{end + 1}": ends[:, end, k] for end in (0, 1) for k, axis in enumerate("xy")}
    return columns | {"length": np.hypot(*(ends[:, 1] - ends[:, 0]).T), "force": frame.bolt_force}


def to_text(
    results: Results, path: PathLike, frames: Iterable[int] | None = None, progress: Progress | None = None
) -> Path:
    """Write the outlines as plain text for old plotting scripts; returns the path.

    Per frame a comment with number, step and time, then lines `block vertex x y`, counted from 1; the first vertex is
    repeated at the end of its block, and an empty line follows, so that gnuplot draws closed outlines. Blocks that are
    not there (excavated, or still to be placed) are left out."""
    path = Path(path)
    numbers = chosen(results, frames)

    def write(stream: TextIO) -> None:
        units = "" if results.units == "none" else f", units: {description(results.units)}"
        stream.write(f"# block vertex x y{units}\n")
        for k, number in enumerate(numbers):
            now = results.frames[number]
            stream.write(f"# frame {now.index} step {now.step} time {now.time!r}\n")
            for i, polygon in enumerate(now.polygons(), start=1):
                if not now.active[i - 1]:
                    continue
                rows = [(v, *corner) for v, corner in enumerate(polygon.tolist(), start=1)]
                stream.writelines(f"{i} {v} {x!r} {y!r}\n" for v, x, y in [*rows, rows[0]])
                stream.write("\n")
            stream.write("\n")
            if progress is not None:
                progress(k + 1, len(numbers))

    write_file(path, write)
    return path


def to_dxf(results: Results, path: PathLike, frame: int = -1) -> Path:
    """Write the outlines of a frame's blocks as a drawing; returns the path."""
    return write_dxf(results.frames[frame], Path(path))
