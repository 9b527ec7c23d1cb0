# SPDX-License-Identifier: MIT
"""Check of the structure of an HDF5 file before it is read. Allowed are groups, each reached on one path, and in them
plain datasets and attributes of numbers and texts that lie in the file itself.

Everything else can lead out of the file (external storage, external links, virtual datasets), load foreign code
(filters), never end (groups that hold each other) or need memory without bound, and RockDDA writes none of it. The
program has the same rules and words (src/io/storage/file/hdf5_structure_shim.c).

HDF5 reads for ever in a heap of texts with an object of size 0, and nothing can interrupt it. So the heaps of all texts
are gone through before the library does. What is read here by hand: the superblock (version 0), object headers (version
1) for the attributes that are texts, and global heaps, as in the "HDF5 File Format Specification", version 3. RockDDA
writes nothing newer.
"""

from __future__ import annotations

import math
import struct
from typing import BinaryIO

import h5py

DEEPEST = 8  # groups in groups
MOST_ATTRIBUTES = 1000
MOST_VALUES = 1_000_000  # of an attribute
LARGEST_CHUNK = 1 << 26  # bytes
# Deflate packs at most 1032 bytes into one. What is stored is added up, which takes time in large files, only for a
# dataset of more bytes than SMALL, and than this multiple of the file.
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


# -- heaps of texts ---------------------------------------------------------------------------------------------------

ATTRIBUTE, CONTINUATION = 0x000C, 0x0010  # types of header messages
VARIABLE_LENGTH = 9  # class of a datatype
REFERENCE = struct.Struct("<IQI")  # to a text: length, address of the heap, number of the object
MOST_TEXTS = 1_000_000


def heap_problem(file: h5py.File, stream: BinaryIO, size: int) -> str:
    """The first error in the heaps of texts of an open file of the given size in bytes; '' without one.

    The structure of the file has been checked."""
    try:
        heaps: set[int] = set()
        head = _read(stream, 0, 40, size)
        if head[8] > 1 or head[13:15] != b"\x08\x08" or struct.unpack_from("<Q", head, 24 + 4 * (head[8] == 1))[0] != 0:
            raise _Problem("has a superblock of another version")
        _visit(h5py.h5g.open(file.id, b"/"), "/", stream, size, heaps)
        for heap in sorted(heaps - {0}):
            _check_heap(stream, heap, size)
    except _Problem as problem:
        return str(problem)
    return ""


def _read(stream: BinaryIO, place: int, n: int, size: int) -> bytes:
    if place + n > size:
        raise _Problem("ends before what it points at")
    stream.seek(place)
    data = stream.read(n)
    if len(data) < n:
        raise _Problem("ends before what it points at")
    return data


def _visit(
    item: h5py.h5g.GroupID | h5py.h5d.DatasetID, path: str, stream: BinaryIO, size: int, heaps: set[int]
) -> None:
    if h5py.h5a.get_num_attrs(item) > 0:
        _take_attributes(h5py.h5o.get_info(item).addr, path, stream, size, heaps)
    if isinstance(item, h5py.h5g.GroupID):
        for name in list(item):
            _visit(
                h5py.h5o.open(item, name), f"{path.rstrip('/')}/{name.decode('utf-8', 'replace')}", stream, size, heaps
            )
    else:
        kind = item.get_type()
        if isinstance(kind, h5py.h5t.TypeStringID) and kind.is_variable_str():
            place, count = item.get_offset(), item.get_space().get_simple_extent_npoints()
            if place is not None and count > 0:
                _take_references(_read(stream, place, REFERENCE.size * _few(count, path), size), heaps)
            elif item.get_create_plist().get_layout() != h5py.h5d.CONTIGUOUS:
                raise _Problem(f"{path.lstrip('/')} keeps its texts in another way than RockDDA")


def _few(count: int, path: str) -> int:
    if count > MOST_TEXTS:
        raise _Problem(f"{path.lstrip('/')} has too many texts")
    return count


def _take_references(data: bytes, heaps: set[int]) -> None:
    heaps.update(
        address for _, address, _ in REFERENCE.iter_unpack(data[: len(data) // REFERENCE.size * REFERENCE.size])
    )


def _take_attributes(address: int, path: str, stream: BinaryIO, size: int, heaps: set[int]) -> None:
    """Heaps of the texts among the attributes of an object."""
    version, _, messages, _, length = struct.unpack("<BBHII", _read(stream, address, 12, size))
    if version != 1:
        raise _Problem(f"{path} has an object header of another version")
    pieces, done = [(address + 16, length)], 0
    while done < len(pieces):
        place, length = pieces[done]
        done += 1
        if done > messages + 1:
            raise _Problem(f"{path} has a damaged object header")
        data, at = _read(stream, place, length, size), 0
        while at + 8 <= length:
            kind, n, flags = struct.unpack_from("<HHB", data, at)
            body = data[at + 8 : at + 8 + n]
            if kind == CONTINUATION and len(body) >= 16:
                pieces.append(struct.unpack_from("<QQ", body))
            elif kind == ATTRIBUTE:
                if flags & 2:
                    raise _Problem(f"{path} has shared attributes")
                _take_attribute(body, heaps)
            at += 8 + n


def _take_attribute(body: bytes, heaps: set[int]) -> None:
    if len(body) < 8:
        return
    version, _, name, kind, space = struct.unpack_from("<BBHHH", body)
    if version == 1:
        name, kind, space = ((n + 7) // 8 * 8 for n in (name, kind, space))
    start = 8 if version < 3 else 9
    if len(body) > start + name and body[start + name] & 15 == VARIABLE_LENGTH:
        _take_references(body[start + name + kind + space :], heaps)


def _check_heap(stream: BinaryIO, address: int, size: int) -> None:
    head = _read(stream, address, 16, size)
    length = struct.unpack_from("<Q", head, 8)[0]
    if head[:5] != b"GCOL\x01" or length < 4096:
        raise _Problem("has a damaged heap of texts")
    data, at = _read(stream, address, length, size), 16
    while at + 16 <= length:
        number, n = struct.unpack_from("<H6xQ", data, at)
        step = n if number == 0 else 16 + (n + 7) // 8 * 8
        if step < 16 or at + step > length:
            raise _Problem("has a damaged heap of texts")
        at += step
