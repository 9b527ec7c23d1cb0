# SPDX-License-Identifier: MIT
"""Interface to the compiled extension `_rockdda`: memory, texts, and status codes as exceptions."""

from __future__ import annotations

import importlib
import os
import re
import warnings
import weakref
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from .arrays import AnyArray, FloatArray
from .errors import ConvergenceError, InputError, InputWarning, OutputError, Problem, RockddaError, stack_level
from .text import PathLike

__all__ = ["Session", "build_description"]

# status, as rockdda_base_error has it
INTERNAL, INPUT, COMPUTATION, STOPPED, OUTPUT = 1, 2, 3, 4, 5
SEVERITIES = {1: "note", 2: "warning", 3: "error"}
DIALECTS = {None: 0, "auto": 0, "dda_windows": 1, "peer": 1, "g0": 2}  # peer: the former name
# texts of a session
MESSAGES, FAILURE, RESULTS, LOG, REASON, TITLE, VERSION, BUILD, ENERGIES = range(1, 10)
MODEL_FILE, ANALYSIS_FILE, CONFIG_FILE, CONFIG_TEXT, SUMMARISED, OPTIONS_SCHEMA, LABELLED_TEXT = range(10, 17)
PLAIN_TABLE = 17
# as many messages as the program shows
MOST_SHOWN = 50
#: Names of the numbers that procedures give.
SIZES = {
    "sizes": "blocks vertices fixed loading measured bolts contacts step frames steps "
    "lines dropped_lines shortened_lines islands holes",
    "geometry_sizes": "lines boundary materials bolts fixed loading measured holes sets",
    "analysis_sizes": "blocks joints tables rows steps dialect",
}


def _extension() -> Any:
    """The extension, or an error that says how to get it."""
    try:
        return load()
    except ImportError as error:
        raise ImportError(
            "the compiled part of rockdda is missing or does not fit this Python; in the source folder `scripts/build` "
            "builds it for build/bin/rockdda-post, `pip install .` installs it (results can be read without it): "
            f"{error}"
        ) from error


def load() -> ModuleType:
    """Import the extension, which lies in the package or in the folder $ROCKDDA_EXTENSION of a build tree."""
    package = importlib.import_module(__package__)
    folder = os.environ.get("ROCKDDA_EXTENSION", "")
    if Path(folder).is_absolute() and folder not in package.__path__:
        package.__path__.append(folder)
    from . import _rockdda  # type: ignore[attr-defined]

    return _rockdda


def build_description() -> str:
    """Version, compiler, flags, options and libraries of the extension."""
    return Session().text(BUILD)


class Session:
    """A model and its run on the Fortran side; freed when it is no longer used."""

    def __init__(self) -> None:
        extension = _extension()
        self._api, self._values = extension.rockdda_python_api, extension.rockdda_python_values
        self.handle = int(self._api.create())
        self._told = 0  # messages
        self._end = weakref.finalize(self, self._api.destroy, self.handle)

    def free(self) -> None:
        """Give the memory back now."""
        self._end()

    # -- texts and failures --------------------------------------------------------------------------------------

    def text(self, which: int) -> str:
        """A text of the session."""
        size = self._api.text_size(self.handle, which)
        if size == 0:
            return ""
        codes = self._api.get_text(self.handle, size)
        return codes.astype(np.uint8).tobytes().decode("utf-8", "surrogateescape")

    def messages(self, which: int = MESSAGES) -> list[tuple[Problem, str]]:
        """All messages about the input, each with its text as the program prints it; SUMMARISED: one for many."""
        found = []
        for record in self.text(which).split("\x1e")[:-1]:
            severity, file, line, column, message, text, _ = record.split("\x1f")
            problem = Problem(
                message, file or None, int(line) or None, int(column) or None, SEVERITIES.get(int(severity), "error")
            )
            found.append((problem, text))
        return found

    def check(self, status: int) -> None:
        """Raise what the status says."""
        if status == 0:
            return
        failure = _in_python_words(self.text(FAILURE))
        if status == INPUT:
            found = [(problem, text) for problem, text in self.messages() if problem.severity == "error"]
            if failure:
                found += [(problem, str(problem)) for problem in _problems_of(failure)]
            lines = [text for _, text in found[:MOST_SHOWN]]
            if len(found) > MOST_SHOWN:
                lines.append(f"... and {len(found) - MOST_SHOWN} more")
            raise InputError("\n".join(lines), problems=[problem for problem, _ in found])
        if status == COMPUTATION:
            raise ConvergenceError(failure)
        if status == OUTPUT:
            raise OutputError(failure)
        raise RockddaError(f"internal error, please report it: {failure or f'status {status}'}")

    def warn(self) -> None:
        """Turn warnings that have come up since the last time into Python's."""
        messages = self.messages(SUMMARISED)
        fresh, self._told = messages[self._told :], len(messages)
        for problem, text in fresh:
            if problem.severity == "warning":
                warnings.warn(_in_python_words(text), InputWarning, stacklevel=stack_level())

    # -- what the session does -----------------------------------------------------------------------------------

    def request(
        self, *, output: PathLike | None = None, solver: str | None = None, dialect: str | None = None,
        threads: int | None = None, steps: int | None = None, save_every: int | None = None, t_end: float | None = None,
        max_wall: float | None = None, checkpoint_every: float | None = None, strict: bool = False,
        allow_open: bool = False, force: bool = False,
    ) -> None:  # fmt: skip
        """Set the options of the run that are not in the files."""
        if dialect not in DIALECTS:
            raise InputError(f"dialect: expected 'dda_windows' or 'g0', found {dialect!r}")
        for name, value, least in (("threads", threads, 1), ("steps", steps, 0), ("save_every", save_every, 1)):
            if value is not None and (int(value) != value or not least <= value < 2**31):
                raise InputError(f"{name}: expected a whole number from {least}, found {value!r}")
        for name, number in (("t_end", t_end), ("max_wall", max_wall), ("checkpoint_every", checkpoint_every)):
            if number is not None and not 0 < number < float("inf"):
                raise InputError(f"{name}: must be above 0, found {number!r}")
        if output is not None and not os.fspath(output):
            raise InputError("output: expected a file name, found nothing")
        counts = (-1 if count is None else int(count) for count in (threads, steps, save_every))
        times = (-1.0 if time is None else float(time) for time in (t_end, max_wall, checkpoint_every))
        self._api.request(
            self.handle, b"" if output is None else os.fsencode(output), (solver or "").encode(), DIALECTS[dialect],
            *counts, *times, int(strict), int(allow_open), int(force),
        )  # fmt: skip

    def __call__(self, operation: str, *arguments: Any) -> None:
        """Do what the extension has under this name, with texts, paths (None: none) and whole numbers or truth, in this
        order each; raises what its status says."""
        numbers, texts = [0], [b""]
        for one in arguments:
            if one is None or isinstance(one, str | bytes | os.PathLike):
                texts.append(b"" if one is None else os.fsencode(one))
            else:
                numbers.append(int(one))
        ends = np.cumsum([len(text) for text in texts])
        self.check(self._api.act(self.handle, operation, b"".join(texts), ends, numbers))

    def read_motion(self, path: PathLike, form: str, column: str, has_scale: bool) -> tuple[FloatArray, float]:
        """Times and values of a record as two rows, and the unit of the values [m/s²], 0 where the file names none."""
        self("read_motion", path, form, column, has_scale)
        n, unit = self._api.motion_sizes(self.handle)
        return np.array(self._values.motion(self.handle, n)), float(unit)

    def plain_table(self, path: PathLike, least: int, multiple: int) -> str:
        """The text of a table, with numbers between blanks or commas and points as decimal signs."""
        self("plain_table", path, least, multiple)
        return self.text(PLAIN_TABLE)

    def advance(self, steps: int, seconds: float) -> tuple[int, bool]:
        """Do steps without the interpreter's lock; (how many were done, is the run at its end)."""
        done, finished, status = self._api.advance(self.handle, min(steps, 2**31 - 1), seconds)
        self.check(status)
        return int(done), bool(finished)

    # -- what can be looked at -----------------------------------------------------------------------------------

    def sizes(self, what: str = "sizes") -> dict[str, int]:
        """Sizes and counters by name, or those of the geometry or the analysis ('geometry_sizes', …)."""
        found = getattr(self._values, what)(self.handle)
        return dict(zip(SIZES[what].split(), map(int, found), strict=True))

    def geometry(self) -> tuple[dict[str, int], list[Any]]:
        """Numbers of things in the geometry, and e0 with their arrays: lines, joint materials, material lines, block
        materials, bolts, their values, fixed lines, loading, measured and hole points."""
        sizes = self.sizes("geometry_sizes")
        names = ("lines", "materials", "bolts", "fixed", "loading", "measured", "holes")
        return sizes, self.array("geometry", *(sizes[name] for name in names))

    def facts(self) -> dict[str, float]:
        """Numbers by name; energies by their own names."""
        names = ["time", "dt", "fraction", "block_area", "hole_area", "enclosed_area"]
        names += self.text(ENERGIES).split()
        return dict(zip(names, (float(x) for x in self._values.facts(self.handle)), strict=True))

    def array(self, what: str, *arguments: int) -> list[AnyArray]:
        """Arrays of one of the procedures that give some; the first axis counts blocks, vertices, points, …"""
        found = getattr(self._values, what)(self.handle, *arguments)
        arrays = [np.asarray(array) for array in (found if isinstance(found, tuple) else (found,))]
        for i, array in enumerate(arrays):
            arrays[i] = array.T.astype(np.int64) if array.dtype.kind == "i" else array.T
            arrays[i].flags.writeable = False
        return arrays


#: Names of the options of a run that are not in its files.
REQUEST = tuple(signature(Session.request).parameters)[1:]


def _in_python_words(text: str) -> str:
    text = text.replace("use --force to overwrite it", "use force=True to overwrite it")
    text = text.replace("--allow-open runs all the same", "allow_open=True runs all the same")
    return text.replace("'rockdda check' lists all", "`messages` of the blocks lists all")


def _problems_of(failure: str) -> list[Problem]:
    """A failure that reads as one or several messages of a compiler."""
    problems: list[Problem] = []
    for line in failure.split("\n"):
        match = re.match(r"(?:(?P<file>[^:]+):(?:(?P<line>\d+):)?(?:(?P<column>\d+):)? )?error: (?P<text>.*)", line)
        if match:
            row, column = match["line"], match["column"]
            problems.append(
                Problem(match["text"], match["file"], int(row) if row else None, int(column) if column else None)
            )
        elif (parts := line.split(": ", 1))[1:] and os.path.exists(parts[0]):  # noqa: PTH110
            problems.append(Problem(parts[1], parts[0]))
        elif problems:  # the run can continue
            last = problems.pop()
            problems.append(Problem(f"{last.message}\n{line}", last.file, last.line, last.column))
        else:
            problems.append(Problem(line))
    return problems
