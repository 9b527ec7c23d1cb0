# SPDX-License-Identifier: MIT
"""Consistency of the arrays of a results file: names, types and shapes of all tables, and the numbers by which
others are found: offsets of vertices and contacts, blocks of points. The rows of history and frames are checked when
they are read.

The program has the same rules and words (src/io/storage/results/results_info.f90).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from ..arrays import AnyArray
from .tables import SIZES, TABLES

STATES = 3  # values of a contact's state
LARGEST = 1e30  # size of a number; the square of one is a number, too
POINTS = ("fixed", "loading", "measured")
TEXTS = ("title", "program_version", "created", "exit_reason")


class _Problem(Exception):
    """An error, with its path in the file."""


def attributes_problem(attributes: dict[str, Any]) -> str:
    """The first error in the attributes of the file; '' without one."""
    for name in (*TEXTS, "complete"):
        value = attributes.get(name)
        if not isinstance(value, int if name == "complete" else str):
            return f"/@{name} " + ("is missing" if value is None else "has an unexpected shape")
    return ""


def results_problem(file: h5py.File) -> str:
    """The first error in the arrays; '' without one."""
    try:
        _check(file)
    except _Problem as problem:
        return str(problem)
    return ""


def rows_problem(path: str, rows: AnyArray, n_blocks: int) -> str:
    """The first error in rows read from a table; '' without one."""
    if rows.dtype.kind == "f" and not np.isfinite(rows).all():
        return f"{path} holds a number that is not finite"
    if rows.dtype.kind == "f" and (np.abs(rows) > LARGEST).any():
        return f"{path} holds a number above {LARGEST:g} in size"
    if path == "frames/contact_state" and not np.isin(rows, range(STATES)).all():
        return f"{path} holds an impossible number"
    if path == "frames/contact_length" and (rows < 0).any():
        return f"{path} holds an impossible number"
    if path == "frames/contact_blocks" and ((rows < 0) | (rows >= n_blocks)).any():
        return f"{path} holds an impossible number"
    return ""


def _table(file: h5py.File, path: str, sizes: Mapping[str, int] = SIZES) -> h5py.Dataset:
    """A table of any length, with numbers and rows as they must be."""
    item, (kind, row, *_) = file.get(path), TABLES[path]
    if not isinstance(item, h5py.Dataset):
        raise _Problem(f"{path} is missing")
    if len(item.shape or ()) != len(row) + 1 or item.shape[1:] != tuple(sizes[name] for name in row):
        raise _Problem(f"{path} has an unexpected shape")
    if item.dtype.kind not in ("iu" if kind == "i4" else "f"):
        raise _Problem(f"{path} cannot be read: it holds no {'integers' if kind == 'i4' else 'reals'}")
    return item


def _need(good: bool, path: str, what: str) -> None:
    if not good:
        raise _Problem(f"{path} {what}")


def _check_offsets(offsets: AnyArray, n: int, step: int, path: str) -> None:
    good = offsets[0] == 0 and offsets[-1] == n and (np.diff(offsets.astype(np.int64)) >= step).all()
    _need(bool(good), path, "holds an impossible number")


def _check(file: h5py.File) -> None:
    """All tables; those of parts of a model, and of newer versions, where the file has these."""
    sizes = dict(SIZES) | _check_model(file)
    has = {"": True, "stages": "history/unbalanced" in file, "joints": file.attrs.get("format_version") != 1}
    has |= {"bolts": _check_bolts(file, sizes), "nodes": False, "liners": False}
    for name, kind, step in (("nodes", "bolt", 1), ("liners", "liner", 0)):
        path = f"model/{kind}_first"
        if path in file and (has["bolts"] or kind == "liner"):
            first = _table(file, path)[()]
            n = int(first[-1]) if len(first) else 0
            _check_offsets(first, n, step, path)
            has[name], sizes["node" if kind == "bolt" else "liner_node"] = True, n
    if has["nodes"]:
        _need(sizes["spring"] <= sizes["node"], "model/bolt_first", "holds an impossible number")
    sizes["bolt_end"] = sizes.get("node", sizes.get("spring", 0))
    forces = file.get("history/boundary_force")
    sizes["boundary"] = forces.shape[1] if len(getattr(forces, "shape", None) or ()) == 3 else 0
    for path, table in TABLES.items():
        known = all(name in sizes for name in table.row)
        if table.kind != "-" and (has.get(table.needs) or (path in file and known)):
            _table(file, path, sizes)
    columns = file["history/energy"].attrs.get("columns")
    _need(np.shape(columns) == (sizes["energy_column"],), "history/energy@columns", "has an unexpected shape")
    if "model/boundary_edges" in file:
        for column, most in zip(file["model/boundary_edges"][()].T, (sizes["boundary"], sizes["vertex"]), strict=True):
            good = bool(((column >= 0) & (column < most)).all())
            _need(good, "model/boundary_edges", "holds an impossible number")
    offsets = file["frames/contact_offset"]
    _need(len(offsets) >= 1, "frames/contact_offset", "has an unexpected shape")
    values = offsets[()]
    # after a kill there may be fewer contacts than the last offsets say
    _check_offsets(values, values[-1], 0, "frames/contact_offset")


def _check_bolts(file: h5py.File, sizes: dict[str, int]) -> bool:
    """Does the file list its bolts? Older ones do not."""
    if "model/bolt_blocks" not in file:
        return False
    blocks = _table(file, "model/bolt_blocks")
    sizes["spring"] = len(blocks)
    for path in ("model/bolt_ends", "model/bolt_properties"):
        _need(len(_table(file, path)) == len(blocks), path, "has an unexpected shape")
    values = blocks[()]  # -1 is the fixed outside
    good = bool(((values >= -1) & (values < sizes["block"])).all())
    _need(good, "model/bolt_blocks", "holds an impossible number")
    return True


def _check_model(file: h5py.File) -> dict[str, int]:
    """Numbers of blocks, vertices and points."""
    nb, nv = len(_table(file, "model/block_area")), len(_table(file, "model/vertices"))
    _need(nb >= 1, "model/block_area", "has an unexpected shape")
    lengths = {"vertex_offset": nb + 1, "edge_joint": nv, "block_material": nb, "block_centroid": nb}
    for name, n in lengths.items():
        _need(len(_table(file, f"model/{name}")) == n, f"model/{name}", "has an unexpected shape")
    if "parent" in file["model"]:  # only where blocks were cut into cells
        _need(len(_table(file, "model/parent")) == nb, "model/parent", "has an unexpected shape")
        parent = file["model/parent"][()]
        _need(bool(((parent >= 0) & (parent < nb)).all()), "model/parent", "holds an impossible number")
    points = {kind: len(_table(file, f"model/{kind}_points")) for kind in POINTS}
    _check_offsets(file["model/vertex_offset"][()], nv, 3, "model/vertex_offset")
    _need(bool((file["model/edge_joint"][()] >= 0).all()), "model/edge_joint", "holds an impossible number")
    _need(bool((file["model/block_material"][()] >= 1).all()), "model/block_material", "holds an impossible number")
    for name in ("vertices", "block_area", "block_centroid", *(f"{kind}_points" for kind in POINTS)):
        values = file[f"model/{name}"][()]
        _need(bool(np.isfinite(values).all()), f"model/{name}", "holds a number that is not finite")
        _need(bool((np.abs(values) <= LARGEST).all()), f"model/{name}", f"holds a number above {LARGEST:g} in size")
    for kind, n in points.items():
        path = f"model/{kind}_points"
        blocks = np.asarray(file[path].attrs.get("block", -1))
        _need(blocks.shape == (n,) and blocks.dtype.kind == "i", f"{path}@block", "has an unexpected shape")
        _need(bool(((blocks >= 0) & (blocks < nb)).all()), f"{path}@block", "holds an impossible number")
    numbers = file["model/measured_points"].attrs.get("number")  # not in older files
    if numbers is not None:
        path, values = "model/measured_points@number", np.asarray(numbers)
        _need(values.shape == (points["measured"],) and values.dtype.kind == "i", path, "has an unexpected shape")
        _need(bool((np.diff(values.astype(np.int64), prepend=0) >= 1).all()), path, "holds an impossible number")
    return {"block": nb, "vertex": nv, **points}
