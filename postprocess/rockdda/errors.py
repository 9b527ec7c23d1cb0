# SPDX-License-Identifier: MIT
"""Exceptions of the package, and messages about input."""

from __future__ import annotations

import importlib
import os
import shlex
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

__all__ = [
    "ConvergenceError", "InputError", "InputWarning", "OutputError", "Problem", "RockddaError", "UnknownNameError",
]  # fmt: skip


@dataclass(frozen=True)
class Problem:
    """One message about input, as the program prints it.

    `line` and `column` count from 1; None where no place in the file is known. `file` is None for a model that was
    built in memory."""

    message: str
    file: str | None = None
    line: int | None = None
    column: int | None = None
    severity: str = "error"  # or "warning", "note"

    def __str__(self) -> str:
        place = "".join(f"{part}:" for part in (self.file, self.line, self.column) if part is not None)
        return f"{place} {self.severity}: {self.message}" if place else f"{self.severity}: {self.message}"


class RockddaError(Exception):
    """Base class of all errors of RockDDA; raised itself for an internal error."""


class InputError(RockddaError, ValueError):
    """Bad input: nothing was computed, nothing was overwritten.

    `file`, `line` and `column` are those of the first problem (None where unknown), `problems` holds all of them.
    The text of the exception shows each problem with its source line, as the program does."""

    def __init__(
        self, message: str, file: str | os.PathLike[str] | None = None, line: int | None = None,
        column: int | None = None, problems: Iterable[Problem] = (),
    ) -> None:  # fmt: skip
        self.problems: list[Problem] = list(problems)
        if not self.problems:
            self.problems = [Problem(message, os.fspath(file) if file is not None else None, line, column)]
            message = str(self.problems[0])
        super().__init__(message)
        first = self.problems[0]
        self.file: str | None = first.file
        self.line: int | None = first.line
        self.column: int | None = first.column


class UnknownNameError(InputError, TypeError):
    """An argument of a name that is not there: a TypeError too, as for any function."""


class InputWarning(UserWarning):
    """Input that is valid but probably a mistake."""


class ConvergenceError(RockddaError, RuntimeError):
    """The computation could not continue. `results` holds what was computed up to there (None if nothing was saved)."""

    def __init__(self, message: str, results: Any = None) -> None:
        super().__init__(message)
        self.results = results  # a `Results`, or None


class OutputError(RockddaError, OSError):
    """Output could not be written; what was written before is readable."""


#: Packages that each extra of pyproject.toml brings. RockDDA itself may come from a wheel or from its source.
EXTRAS = {
    "tables": "pandas", "vtk": "pyvista vtk", "films": "imageio-ffmpeg", "dxf": "ezdxf shapely",
    "gis": "geopandas pyshp shapely", "xarray": "xarray", "notebook": "ipywidgets", "records": "scipy",
    "reliability": "pandas scipy", "study": "distributed pandas", "cluster": "dask-jobqueue", "pdf": "weasyprint",
}  # fmt: skip


def how_to_install(extra: str) -> str:
    """The command that installs the packages of an extra for this Python."""
    return f"{shlex.quote(sys.executable or 'python3')} -m pip install {EXTRAS[extra]}"


def need(module: str, extra: str, purpose: str) -> ModuleType:
    """A module of a package that is installed on demand; ImportError that says how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = {"imageio_ffmpeg": "imageio-ffmpeg", "vtkmodules": "vtk", "shapefile": "pyshp"}.get(
            module, module.partition(".")[0]
        )
        message = f"{purpose} needs the package {package}: {how_to_install(extra)} ({error})"
        raise ImportError(message, name=package) from error


def stack_level() -> int:
    """The `stacklevel` at which `warnings.warn`, in the function that calls this, names code outside this package."""
    folder = os.path.dirname(__file__)  # noqa: PTH120
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(folder):
        frame = frame.f_back
        level += 1
    return level
