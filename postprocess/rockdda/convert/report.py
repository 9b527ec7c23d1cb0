# SPDX-License-Identifier: MIT
"""Problems found while a file is converted, shown as compilers show them; files are read up to a size."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError, Problem
from ..text import short

MOST_SHOWN = 50
MOST_ERRORS = 1000  # then the conversion ends
MOST_WARNINGS = 1000  # further ones are counted
LONGEST_LINE = 400
LONGEST_MESSAGE = 500
MOST_PARTS = 1_000_000  # half of the lists and members of JSON, and lines that are counted
MOST_LINES = 500_000  # that drawings may give; they take 250 MB


class Report:
    """Collects errors and warnings about one file; `raise_errors` ends the conversion when there are errors.

    After 1000 errors it ends at once. Warnings beyond 1000 are counted only."""

    def __init__(self, path: Path | str, text: str = "") -> None:
        self.path = str(path)
        self.problems: list[Problem] = []
        self.errors: list[Problem] = []
        self._text = text
        self.taken: Counter[tuple[str, str]] = Counter()  # what the file has, in the singular and plural
        self.left: Counter[tuple[str, str]] = Counter()  # the parts that are not taken
        self._warnings = 0

    def error(self, message: str, line: int | None = None, column: int | None = None) -> None:
        """Add an error, which prevents the conversion."""
        problem = Problem(short(message, LONGEST_MESSAGE), self.path, line, column)
        self.problems.append(problem)
        self.errors.append(problem)
        if len(self.errors) >= MOST_ERRORS:
            self.raise_errors()

    def fail(self, message: str, line: int | None = None, column: int | None = None) -> NoReturn:
        """Raise InputError with an error and all those before it."""
        self.error(message, line, column)
        self.raise_errors()
        raise AssertionError

    def warning(self, message: str, line: int | None = None, column: int | None = None) -> None:
        """Add a warning about an entry that is left out or assumed."""
        self._warnings += 1
        if self._warnings <= MOST_WARNINGS:
            problem = Problem(short(message, LONGEST_MESSAGE), self.path, line, column, "warning")
            self.problems.append(problem)
        if self._warnings == MOST_WARNINGS:
            problem = Problem(f"warnings after the first {MOST_WARNINGS} are left out", self.path, severity="warning")
            self.problems.append(problem)

    def take(self, one: str, many: str, count: int = 1) -> None:
        """Count something of the file that is taken."""
        self.taken[one, many] += count

    def leave(self, one: str, many: str, count: int = 1) -> None:
        """Count something of the file that is not taken."""
        self.left[one, many] += count

    def note(self, message: str) -> None:
        """Add a note."""
        self.problems.append(Problem(short(message, LONGEST_MESSAGE), self.path, severity="note"))

    def text(self, problem: Problem) -> str:
        """A problem with its source line and a mark under the place."""
        shown = str(problem)
        if problem.line is None or not 0 < problem.line <= min(self._text.count("\n") + 1, MOST_PARTS):
            return shown
        begin = 0
        for _ in range(problem.line - 1):
            begin = self._text.index("\n", begin) + 1
        source = self._text[begin : begin + LONGEST_LINE + 2].split("\n")[0].rstrip("\r").replace("\t", " ")
        if len(source) > LONGEST_LINE:
            return shown
        mark = f"\n    {' ' * (problem.column - 1)}^" if problem.column is not None else ""
        return f"{shown}\n    {source}{mark}"

    def raise_errors(self) -> None:
        """Raise InputError with all errors, if there are any."""
        errors = self.errors
        if errors:
            parts = [self.text(problem) for problem in errors[:MOST_SHOWN]]
            if len(errors) > MOST_SHOWN:
                more = f"{len(errors) - MOST_SHOWN} more errors"
                parts.append(f"... and {more}" + (" at least" if len(errors) >= MOST_ERRORS else ""))
            raise InputError("\n".join(parts), problems=errors)


def read_json(path: Path, text: str, report: Report) -> Any:
    """What a text in JSON holds; InputError for a broken one, and where values need much more memory than it."""
    for letters, most, what in (("[{", 2, "lists and objects"), (":", 2, "members"), (",", 6, "values")):
        if sum(map(text.count, letters)) > most * MOST_PARTS:
            raise InputError(f"has more than {most * MOST_PARTS} {what}: JSON that large is not converted", path)
    try:
        # whole numbers of thousands of digits: Python refuses them, and none is a coordinate
        return json.loads(text, parse_int=lambda digits: int(digits) if len(digits) < 40 else float(digits))
    except json.JSONDecodeError as error:
        report.fail(f"the JSON is broken: {error.msg}", error.lineno, error.colno)
    except RecursionError:
        report.fail("the JSON is nested too deeply")
