# SPDX-License-Identifier: MIT
"""Consistency of the arrays of a results file: names, types and shapes of all tables, and the numbers by which
others are found: offsets of vertices and contacts, blocks of points. The rows of history and frames are checked when
they are read.

The program has the same rules and words (src/io/storage/results/results_info.f90).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from ..arrays import AnyArray
from .tables import SIZES, TABLES

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
    least, _, most = (TABLES[path].values if path in TABLES else "").partition(":")
    if most or least.isdigit():
        high = n_blocks if most == "block" else int(most) if most else math.inf
        if ((rows < int(least)) | (rows >= high)).any():
            return f"{path} holds an impossible number"
    return ""


def _table(file: h5py.File, path: str, sizes: Mapping[str, int] = SIZES) -> h5py.Dataset:
    """A table of as many rows as are known, with numbers and rows as they must be."""
    item, table = file.get(path), TABLES[path]
    if not isinstance(item, h5py.Dataset):
        raise _Problem(f"{path} is missing")
    of, _, more = table.rows.partition("+")
    shape = item.shape or ()
    rows = (sizes[of] + int(more or 0),) if of in sizes else shape[:1]
    _need(shape != () and shape == (*rows, *(sizes[name] for name in table.row)), path, "has an unexpected shape")
    if item.dtype.kind not in ("iu" if table.kind == "i4" else "f"):
        raise _Problem(f"{path} cannot be read: it holds no {'integers' if table.kind == 'i4' else 'reals'}")
    return item


def _need(good: bool, path: str, what: str) -> None:
    if not good:
        raise _Problem(f"{path} {what}")


def _check_offsets(offsets: AnyArray, n: int, step: int, path: str) -> None:
    good = offsets[0] == 0 and offsets[-1] == n and (np.diff(offsets.astype(np.int64)) >= step).all()
    _need(bool(good), path, "holds an impossible number")


def _check(file: h5py.File) -> None:
    """All tables; those of parts of a model, and of newer versions, where the file has these."""
    sizes = dict(SIZES) | {"block": len(_table(file, "model/block_area"))}
    sizes["vertex"] = len(_table(file, "model/vertices"))
    _need(sizes["block"] >= 1, "model/block_area", "has an unexpected shape")
    sizes |= {kind: _check_points(file, kind, sizes["block"]) for kind in POINTS}
    has = {"-": True, "stages": "history/unbalanced" in file, "joints": file.attrs.get("format_version") != 1}
    has |= {"bolts": "model/bolt_blocks" in file, "nodes": False, "liners": False}  # older files do not list bolts
    if has["bolts"]:
        sizes["spring"] = len(_table(file, "model/bolt_blocks"))
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
            item = _table(file, path, sizes)
            if table.values and path.startswith("model/") and (problem := rows_problem(path, item[()], sizes["block"])):
                raise _Problem(problem)
    _check_offsets(file["model/vertex_offset"][()], sizes["vertex"], 3, "model/vertex_offset")
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


def _check_points(file: h5py.File, kind: str, n_blocks: int) -> int:
    """Number of the points of a kind."""
    path = f"model/{kind}_points"
    n = len(_table(file, path))
    blocks = np.asarray(file[path].attrs.get("block", -1))
    _need(blocks.shape == (n,) and blocks.dtype.kind == "i", f"{path}@block", "has an unexpected shape")
    _need(bool(((blocks >= 0) & (blocks < n_blocks)).all()), f"{path}@block", "holds an impossible number")
    numbers = file[path].attrs.get("number")  # of measured points, not in older files
    if numbers is not None:
        path, values = f"{path}@number", np.asarray(numbers)
        _need(values.shape == (n,) and values.dtype.kind == "i", path, "has an unexpected shape")
        _need(bool((np.diff(values.astype(np.int64), prepend=0) >= 1).all()), path, "holds an impossible number")
    return n
