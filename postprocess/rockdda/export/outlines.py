# SPDX-License-Identifier: MIT
"""Outlines of blocks as plain text or as a DXF drawing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from ..convert.dxf import write_dxf
from ..text import PathLike
from ..units import description
from ..writing import write_file
from .common import Progress, chosen

if TYPE_CHECKING:
    from ..results import Results


def to_text(
    results: Results, path: PathLike, frames: Iterable[int] | None = None, progress: Progress | None = None
) -> Path:
    """Write the outlines as plain text for old plotting scripts; returns the path.

    Per frame a comment with number, step and time, then lines `block vertex x y`, counted from 1; the first vertex is
    repeated at the end of its block, and an empty line follows, so that gnuplot draws closed outlines. Blocks that are
    not there (excavated, or still to be placed) are left out.
    """
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
