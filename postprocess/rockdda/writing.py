# SPDX-License-Identifier: MIT
"""The one writer of files: each is either complete or not there, and none is written through a symbolic link."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TextIO

from .errors import InputError, OutputError


@contextlib.contextmanager
def written_to(path: Path, what: str = "written") -> Iterator[None]:
    """Errors of the system in a block as OutputError that names the file or folder."""
    try:
        yield
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{path}: cannot be {what}: {error.strerror or error}") from error


@contextlib.contextmanager
def complete_file(path: Path) -> Iterator[Path]:
    """A name to write to, with the ending of `path`, in a new folder beside it that nobody else can enter.

    At the end of the block the file is renamed to `path` (a link of this name is replaced, not followed); where an
    exception leaves the block, it is removed. OutputError if it cannot be written."""
    with written_to(path):
        if path.exists() and not (path.is_file() or path.is_char_device()):
            raise OutputError(f"{path}: cannot be written: it is no file")
        beside = None if path.is_char_device() else path.parent
        private = Path(tempfile.mkdtemp(prefix=f".{path.stem[:40]}.part-", dir=beside))
        try:
            part = private / path.name
            yield part
            if beside is None:  # /dev/null, or a terminal: there is nothing that could be overwritten
                path.write_bytes(part.read_bytes())
            else:
                part.replace(path)
        finally:
            shutil.rmtree(private, ignore_errors=True)


def write_file(path: Path, content: str | bytes | Callable[[TextIO], Any]) -> None:
    """Write a file, complete or not at all: its text, its bytes, or what a function writes to a stream of text."""
    with complete_file(path) as part:
        if isinstance(content, bytes):
            part.write_bytes(content)
            return
        with part.open("w", encoding="utf-8", newline="\n") as stream:
            if isinstance(content, str):
                stream.write(content)
            else:
                content(stream)


def write_files(texts: Mapping[Path, str], force: bool, how: str) -> list[Path]:
    """Write all files, or none when one exists and is not to be overwritten; how: by what it is."""
    for path in texts:
        if path.exists() and not force:
            raise InputError(f"the file exists; use {how} to overwrite it", path)
    for path, text in texts.items():
        write_file(path, text)
    return list(texts)


def make_folder(path: Path) -> None:
    """Make a folder for files with names of their own; a link of its name is refused, since it leads elsewhere."""
    with written_to(path, "made"):
        if path.is_symlink():
            raise OutputError(f"{path}: cannot be written: it is a symbolic link")
        path.mkdir(parents=True, exist_ok=True)
