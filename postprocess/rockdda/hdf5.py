# SPDX-License-Identifier: MIT
"""Opening HDF5 files that a run may still be writing, and seeing what they are."""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .errors import InputError

__all__ = ["PATIENCE", "changed_lately", "check_format", "check_signature", "open_hdf5", "plain", "reason_of"]

FORMAT_VERSION = 1
# A file that is just being written to can be unreadable for a moment: try again for so many seconds.
PATIENCE = 2.0


def open_hdf5(path: Path) -> h5py.File:
    """Open for reading without a lock, so that the run that writes the file is not disturbed."""
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        # this process has the file open already, with locks
        if "locking flag" not in str(error):
            raise
        return h5py.File(path, "r")


def plain(value: Any) -> Any:
    """Texts as str, numbers of size one as Python numbers."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "surrogateescape")
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
    """Is it a file, and HDF5? A run that begins makes an empty file first: then wait a little."""
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
    """Is it ours, and of a version that we know?"""
    found = attributes.get("format")
    if found is None:
        raise InputError("is an HDF5 file, but not one of RockDDA: it has no attribute 'format'", path)
    if found != "rockdda":
        raise InputError(f"is not a results file of RockDDA: its format is {found!r}, expected 'rockdda'", path)
    version = attributes.get("format_version")
    if version != FORMAT_VERSION:
        raise InputError(f"has format version {version}; this package reads version {FORMAT_VERSION}", path)
