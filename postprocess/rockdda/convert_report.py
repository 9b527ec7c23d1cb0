# SPDX-License-Identifier: MIT
"""Problems found while a file is converted, shown as compilers show them."""

from __future__ import annotations

from pathlib import Path

from .errors import InputError, Problem

MOST_SHOWN = 50
LONGEST_LINE = 400


class Report:
    """Collects errors and warnings about one file; `raise_errors` ends the conversion when there are errors."""

    def __init__(self, path: Path | str, text: str = "") -> None:
        self.path = str(path)
        self.problems: list[Problem] = []
        self._lines = text.split("\n")

    def error(self, message: str, line: int | None = None, column: int | None = None) -> None:
        """Something that forbids the conversion."""
        self.problems.append(Problem(message, self.path, line, column))

    def warning(self, message: str, line: int | None = None, column: int | None = None) -> None:
        """Something that is left out or guessed."""
        self.problems.append(Problem(message, self.path, line, column, "warning"))

    def note(self, message: str) -> None:
        """Something worth knowing."""
        self.problems.append(Problem(message, self.path, severity="note"))

    @property
    def errors(self) -> list[Problem]:
        return [problem for problem in self.problems if problem.severity == "error"]

    def text(self, problem: Problem) -> str:
        """A problem with its source line and a mark under the place."""
        shown = str(problem)
        if problem.line is None or not 0 < problem.line <= len(self._lines):
            return shown
        source = self._lines[problem.line - 1].rstrip("\r").replace("\t", " ")
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
                parts.append(f"... and {len(errors) - MOST_SHOWN} more errors")
            raise InputError("\n".join(parts), problems=errors)


def read_text(path: Path) -> str:
    """The text of an input file; InputError when it cannot be read."""
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise InputError("no such file", path) from error
    except IsADirectoryError as error:
        raise InputError("is a folder, not a file", path) from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path) from error
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
