# SPDX-License-Identifier: MIT
"""Files that are either complete or not there."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO

from .errors import OutputError

__all__ = ["complete_file", "write_file"]


@contextlib.contextmanager
def complete_file(path: Path) -> Iterator[Path]:
    """A name to write to, with the ending of `path`.

    At the end of the block the file gets the name `path`; where an exception leaves the block, it is removed.
    OutputError if it cannot be written.
    """
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def write_file(path: Path, work: Callable[[TextIO], Any]) -> None:
    """Write a text file by `work`, complete or not at all."""
    with complete_file(path) as part, part.open("w", encoding="utf-8", newline="\n") as stream:
        work(stream)
