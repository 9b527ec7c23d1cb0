# SPDX-License-Identifier: MIT
"""Check of the structure of an HDF5 file before it is read. Allowed are groups, each reached on one path, and in them
plain datasets and attributes of numbers and texts that lie in the file itself.

Everything else can lead out of the file (external storage, external links, virtual datasets), load foreign code
(filters), never end (groups that hold each other) or need memory without bound, and RockDDA writes none of it. The
program has the same rules and words (src/io/storage/file/hdf5_structure_shim.c).
"""

from __future__ import annotations

import math

import h5py

DEEPEST = 8  # groups in groups
MOST_ATTRIBUTES = 1000
MOST_VALUES = 1_000_000  # of an attribute
LARGEST_CHUNK = 1 << 26  # bytes
# Deflate packs at most 1032 bytes into one. What is stored is added up, which takes time in large files, only for a
# dataset of more bytes than SMALL, and than so many times the file.
BEST_COMPRESSION = 1032
SMALL = 1 << 26
USUAL_COMPRESSION = 16
FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
LINKS = {h5py.h5l.TYPE_SOFT: "is a soft link", h5py.h5l.TYPE_EXTERNAL: "is a link into another file"}


class _Problem(Exception):
    """An error, with its path in the file."""


def structure_problem(file: h5py.File, size: int) -> str:
    """The first error in the structure of an open file of the given size in bytes; '' without one."""
    try:
        _check_object(h5py.h5g.open(file.id, b"/"), "", 0, set(), size)
    except _Problem as problem:
        return str(problem)
    return ""


def _check_object(
    item: h5py.h5g.GroupID | h5py.h5d.DatasetID, path: str, depth: int, seen: set[int], size: int
) -> None:
    here = path or "/"
    info = h5py.h5o.get_info(item)
    if info.addr in seen:
        raise _Problem(f"{here} is another name of an object that is there already")
    seen.add(info.addr)
    _check_attributes(item, path)
    if isinstance(item, h5py.h5d.DatasetID):
        _check_dataset(item, here, size)
    elif isinstance(item, h5py.h5g.GroupID):
        if depth == DEEPEST:
            raise _Problem(f"{here} holds groups in too many levels")
        for name in list(item):
            below = f"{path}/{name.decode('utf-8', 'replace')}".lstrip("/")
            kind = item.links.get_info(name).type
            if kind != h5py.h5l.TYPE_HARD:
                raise _Problem(f"{below} {LINKS.get(kind, 'is a user-defined link')}")
            _check_object(h5py.h5o.open(item, name), below, depth + 1, seen, size)
    else:
        raise _Problem(f"{here} is neither a group nor a dataset")


def _check_attributes(item: h5py.h5g.GroupID | h5py.h5d.DatasetID, path: str) -> None:
    n = h5py.h5a.get_num_attrs(item)
    if n > MOST_ATTRIBUTES:
        raise _Problem(f"{path or '/'} has too many attributes")
    for i in range(n):
        attribute = h5py.h5a.open(item, index=i)
        where = f"{path or '/'}@{attribute.name.decode('utf-8', 'replace')}"
        _check_extent(attribute.get_space(), where)
        _check_type(attribute.get_type(), where)
        if math.prod(attribute.shape) > MOST_VALUES:
            raise _Problem(f"{where} has too many values")


def _check_extent(space: h5py.h5s.SpaceID, where: str) -> None:
    if space.get_simple_extent_type() == h5py.h5s.NULL:
        raise _Problem(f"{where} has no extent")


def _check_type(kind: h5py.h5t.TypeID, where: str) -> None:
    size = kind.get_size()
    if isinstance(kind, h5py.h5t.TypeStringID):
        good = kind.is_variable_str() or 0 < size <= MOST_VALUES
    else:
        good = isinstance(kind, (h5py.h5t.TypeIntegerID, h5py.h5t.TypeFloatID)) and 0 < size <= 8
    if not good:
        raise _Problem(f"{where} is neither of numbers nor of texts")


def _check_dataset(item: h5py.h5d.DatasetID, where: str, size: int) -> None:
    _check_extent(item.get_space(), where)
    creation = item.get_create_plist()
    layout = creation.get_layout()
    if creation.get_external_count() != 0:
        raise _Problem(f"{where} keeps its values in another file")
    if layout == h5py.h5d.VIRTUAL:
        raise _Problem(f"{where} is a virtual dataset")
    if layout not in (h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED):
        raise _Problem(f"{where} has an unknown layout")
    if any(creation.get_filter(i)[0] not in FILTERS for i in range(creation.get_nfilters())):
        raise _Problem(f"{where} is packed with an unknown filter")
    kind = item.get_type()
    _check_type(kind, where)
    if layout == h5py.h5d.CHUNKED and kind.get_size() * math.prod(creation.get_chunk()) > LARGEST_CHUNK:
        raise _Problem(f"{where} has too large chunks")
    total = kind.get_size() * math.prod(item.shape)
    if total <= SMALL or total <= USUAL_COMPRESSION * size:
        return
    stored = item.get_storage_size()
    if stored > size or total > BEST_COMPRESSION * stored:
        raise _Problem(f"{where} is larger than the file can hold")
