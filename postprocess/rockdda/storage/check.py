# SPDX-License-Identifier: MIT
"""Consistency of the arrays of a results file: names, types and shapes of all tables, and the numbers by which
others are found: offsets of vertices and contacts, blocks of points. The rows of history and frames are checked when
they are read.

The program has the same rules and words (src/io/storage/results/results_shape.f90).
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from ..arrays import AnyArray

# Columns of the energies, and values of a contact's state.
ENERGIES, STATES = 10, 3
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


def _table(file: h5py.File, path: str, kind: str, *row: int) -> h5py.Dataset:
    """A table of integers ('i4') or reals ('f8'), of any size, with rows of this shape."""
    item = file.get(path)
    if not isinstance(item, h5py.Dataset):
        raise _Problem(f"{path} is missing")
    if len(item.shape or ()) != len(row) + 1 or item.shape[1:] != row:
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
    nb, nv, points = _check_model(file)
    n_bolts = _check_bolts(file, nb)
    for name in ("step", "open_close_iterations", "attempts", "solver_iterations"):
        _table(file, f"history/{name}", "i4")
    for name in ("time", "dt", "max_displacement"):
        _table(file, f"history/{name}", "f8")
    _table(file, "history/contacts", "i4", 3)
    columns = _table(file, "history/energy", "f8", ENERGIES).attrs.get("columns")
    _need(np.shape(columns) == (ENERGIES,), "history/energy@columns", "has an unexpected shape")
    _table(file, "history/measured_displacement", "f8", points["measured"], 2)
    _table(file, "history/measured_stress", "f8", points["measured"], 3)
    _table(file, "history/measured_rotation", "f8", points["measured"])
    _table(file, "history/fixed_force", "f8", points["fixed"], 2)
    if "history/unbalanced" in file:  # not in older files
        _table(file, "history/unbalanced", "f8")
        _table(file, "history/stage", "i4")
        _table(file, "history/relaxation", "f8")
        _table(file, "frames/active", "i4", nb)
    if "history/time_error" in file:  # not in older files
        _table(file, "history/time_error", "f8")
    _check_boundaries(file, nv)
    _table(file, "frames/step", "i4")
    _table(file, "frames/time", "f8")
    for name, *row in (
        ("vertices", nv, 2),
        ("centroid", nb, 2),
        ("rotation", nb),
        ("stress", nb, 3),
        ("velocity", nb, 6),
    ):
        _table(file, f"frames/{name}", "f8", *row)
    if n_bolts is not None:
        _table(file, "frames/bolt_ends", "f8", n_bolts, 2, 2)
        _check_nodes(file, n_bolts)
    if "model/liner_first" in file:
        first = _table(file, "model/liner_first", "i4")[()]
        n = int(first[-1]) if len(first) else 0
        _check_offsets(first, n, 0, "model/liner_first")
        _table(file, "model/liner_section", "f8", 5)
        _table(file, "frames/liner_point", "f8", n, 2)
        _table(file, "frames/liner_force", "f8", n, 3)
        if "frames/liner_back" in file:
            _table(file, "frames/liner_back", "f8", n, 2)
        if "frames/liner_section" in file:
            _table(file, "frames/liner_section", "f8", n, 6)
        if "frames/liner_use" in file:
            _table(file, "frames/liner_use", "f8", n)
        _table(file, "frames/liner_state", "i4", n)
    _table(file, "frames/contact_point", "f8", 2)
    _table(file, "frames/contact_force", "f8", 2)
    _table(file, "frames/contact_state", "i4")
    _table(file, "frames/contact_blocks", "i4", 2)
    for name in ("opening", "slip", "length", "normal_stress", "shear_stress"):
        if file.attrs.get("format_version") != 1 or f"frames/contact_{name}" in file:
            _table(file, f"frames/contact_{name}", "f8")
    offsets = _table(file, "frames/contact_offset", "i4")
    _need(len(offsets) >= 1, "frames/contact_offset", "has an unexpected shape")
    values = offsets[()]
    # after a kill there may be fewer contacts than the last offsets say
    _check_offsets(values, values[-1], 0, "frames/contact_offset")


def _check_boundaries(file: h5py.File, nv: int) -> None:
    """Forces and edges; older files have no forces, and models without boundaries no edges."""
    n = 0
    if "history/boundary_force" in file:
        item = file["history/boundary_force"]
        if len(getattr(item, "shape", None) or ()) != 3:
            raise _Problem("history/boundary_force has an unexpected shape")
        n = item.shape[1]
        _table(file, "history/boundary_force", "f8", n, 2)
    if "model/boundary_edges" not in file:
        return
    edges = _table(file, "model/boundary_edges", "i4", 2)[()]
    for column, most in zip(edges.T, (n, nv), strict=True):
        good = bool(((column >= 0) & (column < most)).all())
        _need(good, "model/boundary_edges", "holds an impossible number")


def _check_bolts(file: h5py.File, nb: int) -> int | None:
    """Number of bolts; None for older files, which do not list them."""
    if "model/bolt_blocks" not in file:
        return None
    blocks = _table(file, "model/bolt_blocks", "i4", 2)
    n = len(blocks)
    for name, *row in (("bolt_ends", 2, 2), ("bolt_properties", 3)):
        _need(len(_table(file, f"model/{name}", "f8", *row)) == n, f"model/{name}", "has an unexpected shape")
    values = blocks[()]  # -1 is the fixed outside
    _need(bool(((values >= -1) & (values < nb)).all()), "model/bolt_blocks", "holds an impossible number")
    return n


def _check_nodes(file: h5py.File, n_springs: int) -> None:
    """Forces of bolts, and their nodes where they have any."""
    if "model/bolt_first" not in file:
        _table(file, "frames/bolt_force", "f8", n_springs)
        return
    first = _table(file, "model/bolt_first", "i4")[()]
    n = int(first[-1]) if len(first) else 0
    _check_offsets(first, n, 1, "model/bolt_first")
    _need(n_springs <= n, "model/bolt_first", "holds an impossible number")
    _table(file, "frames/bolt_force", "f8", n)
    _table(file, "frames/bolt_node", "f8", n, 2)
    _table(file, "frames/bolt_slip", "f8", n)
    _table(file, "frames/bolt_state", "i4", n)
    if "frames/bolt_use" in file:
        _table(file, "frames/bolt_use", "f8", n)


def _check_model(file: h5py.File) -> tuple[int, int, dict[str, int]]:
    """Numbers of blocks, vertices and points."""
    nb = len(_table(file, "model/block_area", "f8"))
    nv = len(_table(file, "model/vertices", "f8", 2))
    _need(nb >= 1, "model/block_area", "has an unexpected shape")
    for name, kind, n, row in (
        ("vertex_offset", "i4", nb + 1, ()),
        ("edge_joint", "i4", nv, ()),
        ("block_material", "i4", nb, ()),
        ("block_centroid", "f8", nb, (2,)),
    ):
        _need(len(_table(file, f"model/{name}", kind, *row)) == n, f"model/{name}", "has an unexpected shape")
    if "parent" in file["model"]:  # only where blocks were cut into cells
        _need(len(_table(file, "model/parent", "i4")) == nb, "model/parent", "has an unexpected shape")
        parent = file["model/parent"][()]
        _need(bool(((parent >= 0) & (parent < nb)).all()), "model/parent", "holds an impossible number")
    points = {kind: len(_table(file, f"model/{kind}_points", "f8", 2)) for kind in POINTS}
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
    return nb, nv, points
