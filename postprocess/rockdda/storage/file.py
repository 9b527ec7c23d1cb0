# SPDX-License-Identifier: MIT
"""Opening HDF5 files that a run may still be writing, and checking their format."""

from __future__ import annotations

import contextlib
import os
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from ..arrays import AnyArray
from ..errors import InputError
from ..interrupts import HeldInterrupts
from ..text import readable
from .structure import heap_problem, structure_problem

FORMAT_VERSIONS = (1, 2)
# A file that is just being written to can be unreadable for a moment: try again for this number of seconds.
PATIENCE = 5.0
# File systems note the time of a change in steps of 1 to 10 ms.
CLOCK_STEP = 0.012

# Bytes of a growing table that are read at a time: some hundredths of a second.
PIECE = 1 << 23

T = TypeVar("T")
#: Device, number, length and time of change of a file.
_State = tuple[int, int, int, int]


class _Opened:
    """A file that is open for reading, without a lock, so that the run that writes it is not disturbed.

    HDF5 takes in the end of the file and the upper part of its indices once. When the file grows underneath, places
    behind that end cannot be read ("addr overflow"), and rows whose index has been split in the meantime read as
    zeros, without a word. So: nothing that was read while the file changed may be used. Files that are opened by name
    share what was taken in with all others of the process that are open under that name, older ones of the user too;
    opened as a stream a file is seen as it is now."""

    def __init__(self, path: Path) -> None:
        self.state = _state_of(path)
        while 0 <= clock.time() - self.state[3] / 1e9 < CLOCK_STEP:  # a second change would not show
            clock.sleep(CLOCK_STEP / 4)
            self.state = _state_of(path)
        self._stream = path.open("rb", buffering=0)
        try:
            self.file = h5py.File(self._stream, "r")
        except BaseException:
            self._stream.close()
            raise

    def check(self) -> None:
        """Refuse what RockDDA does not write, before anything is read: it can lead out of the file, or never end."""
        size = os.fstat(self._stream.fileno()).st_size
        problem = structure_problem(self.file, size) or heap_problem(self.file, self._stream, size)
        if problem:
            raise StructureError(problem)

    def close(self) -> None:
        # closing can fail when the file was changed underneath
        with contextlib.suppress(Exception):
            self.file.close()
        self._stream.close()


class StructureError(ValueError):
    """A file consists of more than plain data of its own."""


def _state_of(path: Path) -> _State:
    """State of a file that differs after it has been changed or replaced."""
    info = path.stat()
    return info.st_dev, info.st_ino, info.st_size, info.st_mtime_ns


def plain(value: Any) -> Any:
    """Texts as str, numbers of size one as Python numbers."""
    if isinstance(value, str):  # h5py hands bytes that are no UTF-8 on in a form that cannot be written
        return readable(value)
    if isinstance(value, bytes):
        return readable(value.decode("utf-8", "surrogateescape"))
    if isinstance(value, np.ndarray) and value.size == 1:
        return plain(value.item())
    if isinstance(value, np.generic):
        return plain(value.item())
    return value


def reason_of(error: BaseException) -> str:
    text = str(error.args[0] if isinstance(error, KeyError) and error.args else error)
    begin, end = text.find("("), text.rfind(")")  # h5py: "Unable to … (the reason)"
    return text[begin + 1 : end] if 0 <= begin < end and text.startswith("Unable") else text


def changed_lately(path: Path) -> bool:
    """Has the file been written within the last minute?"""
    try:
        return clock.time() - path.stat().st_mtime < 60
    except OSError:
        return False


def check_signature(path: Path) -> None:
    """InputError unless the path is an HDF5 file. A run first makes an empty file: wait a little for its content."""
    if not path.exists():
        raise InputError("no such file", path)
    if path.is_dir():
        raise InputError("is a folder, not a results file", path)
    deadline = clock.monotonic() + PATIENCE
    try:
        while True:
            with path.open("rb") as stream:
                head = stream.read(8)
            if head or clock.time() - path.stat().st_mtime > PATIENCE or clock.monotonic() > deadline:
                break
            clock.sleep(0.02)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path) from error
    if head != b"\x89HDF\r\n\x1a\n":
        raise InputError("is not a results file: it is no HDF5 file" + (" but empty" if not head else ""), path)


def check_format(path: Path, attributes: dict[str, Any]) -> None:
    """InputError for a file that is no RockDDA results file, or of an unknown version of the format."""
    found = attributes.get("format")
    if found is None:
        raise InputError("is an HDF5 file, but not one of RockDDA: it has no attribute 'format'", path)
    if found != "rockdda":
        raise InputError(f"is not a results file of RockDDA: its format is {found!r}, expected 'rockdda'", path)
    version = attributes.get("format_version")
    if version not in FORMAT_VERSIONS:
        known = f"{FORMAT_VERSIONS[0]} to {FORMAT_VERSIONS[-1]}"
        raise InputError(f"has format version {version}; this package reads versions {known}", path)


class NoSuchPath(Exception):
    """There is no array of that name."""


class GrowingFile:
    """A file that a run may be writing: each piece of work is done with the file as it was at one moment."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete = False  # the attribute of the file
        self._opened: _Opened | None = None
        self._state: _State | None = None  # when it was first used
        self._closed = False
        self._checked: tuple[int, int] | None = None  # device and number of the file whose structure was checked

    @property
    def inode(self) -> int:
        """Another one: another file has taken its place."""
        return self._state[1] if self._state is not None else 0

    def has_changed(self) -> bool:
        """Since it was first used, or last forgotten?"""
        return self._state is not None and self._state != _state_of(self.path)

    def forget(self) -> None:
        """Read the file afresh."""
        self._drop()
        self._state = None
        self._checked = None

    def close(self) -> None:
        """Give the file free. Using it afterwards is an error."""
        self._drop()
        self._closed = True

    def _drop(self) -> None:
        if self._opened is not None:
            with HeldInterrupts():
                self._opened.close()
                self._opened = None

    def use(self, work: Callable[[h5py.File], T]) -> T:
        """Do something with the open file; again, when a writer has changed it in the meantime."""
        if self._closed:
            raise ValueError(f"{self.path}: the results were closed")
        deadline = clock.monotonic() + PATIENCE
        while True:
            try:
                with HeldInterrupts():  # HDF5 calls Python to read the stream, and does not stand exceptions there
                    answer, state = self._do(work)
                changed = _state_of(self.path) != state
            except FileNotFoundError as error:
                raise InputError("no such file", self.path) from error
            except PermissionError as error:
                raise InputError("no permission to read the file", self.path) from error
            except (OSError, RuntimeError, ValueError, KeyError) as error:
                if isinstance(error, InputError):
                    raise
                self._drop()
                # a file that no run writes will not change
                settled = self.complete and self._state == _state_of(self.path)
                if settled or clock.monotonic() > deadline or not changed_lately(self.path):
                    what = "not as RockDDA writes it" if isinstance(error, StructureError) else "damaged"
                    raise InputError(f"the file is {what}: {reason_of(error)}", self.path) from error
                clock.sleep(0.02)
                continue
            if changed:
                self._drop()
                if clock.monotonic() > deadline:
                    raise InputError("a run writes to this file faster than it can be read; try again", self.path)
                continue
            if self._state is None:
                self._state = state
            if not self.complete or state != self._state:  # an open handle does not see what is written later
                self._drop()
            return answer

    def _do(self, work: Callable[[h5py.File], T]) -> tuple[T, _State]:
        """Do something with the file, open and checked, and say in which state the file was before."""
        if self._opened is not None and self._opened.state != _state_of(self.path):
            self._drop()
        if self._opened is None:
            self._opened = _Opened(self.path)
        state = self._opened.state
        if self._checked != state[:2]:
            self._opened.check()
            self._checked = state[:2]
        return work(self._opened.file), state

    def rows(self, path: str, start: int, stop: int, *rest: int) -> AnyArray:
        """Rows [start, stop) of an array, of each `[*rest]`. A file that may grow is read in pieces that take less time
        than it is left alone. Reals of 32 bits (`&output precision = 'single'`) come as 64 bits."""

        def read(file: h5py.File) -> tuple[AnyArray, int]:
            item = file.get(path)
            if not isinstance(item, h5py.Dataset):
                raise NoSuchPath(path)
            end = min(stop, item.shape[0])
            n = max(end - begin, 0)
            if not self.complete and item.chunks is not None:
                row_bytes = max(item.dtype.itemsize * item.size // max(item.shape[0], 1), 1)
                n = min(n, max(PIECE // (row_bytes * item.chunks[0]), 1) * item.chunks[0])
            rows = np.asarray(item[(slice(begin, begin + n), *rest)])
            return rows.astype(float, copy=False) if rows.dtype.kind == "f" else rows, end

        pieces = []
        begin = start
        while True:
            rows, end = self.use(read)
            pieces.append(rows)
            begin += len(rows)
            if begin >= end or len(rows) == 0:
                return pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
