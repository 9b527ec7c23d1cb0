# SPDX-License-Identifier: MIT
"""Parameter studies: many runs of one template, from a TOML file.

A study names a template (a folder whose text files hold ``{{…}}`` where parameters go), a grid or a list of parameters,
and the results to keep of each run. `docs/hpc.md` describes the file; `rockdda.study.runner` does the runs.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..text import PathLike, did_you_mean, has_controls, read_text, short, shown
from .formula import Value, evaluate, formatted, names_in

#: How one number is made of those of all steps.
TAKE: dict[str, Callable[[Any], Any]] = {
    "last": lambda x: x[-1], "first": lambda x: x[0], "min": np.min, "max": np.max, "mean": np.mean,
    "absmax": lambda x: np.max(np.abs(x)),
}  # fmt: skip
_TOP = ("title", "template", "output", "parameters", "constants", "cases", "run", "results", "cluster")
_FOR_TEMPLATE = ("parameters", "constants", "cases")
_RUN = ("command", "threads", "timeout", "options")
_COMMANDS = ("run", "fos")
_NAMES_FILES = ("-o", "--output", "-c", "--config", "--")  # options of `rockdda run` and `rockdda fos`
_RESULT = ("dataset", "at", "take", "unit")
_PLACEHOLDER = re.compile(r"\{\{([^{}]*)\}\}")
_MOST_CASES = 100_000
_MOST_NAMES = 200
_LONGEST_TITLE = 500
_MOST_THREADS = 100_000
_DEEPEST_KEY = 200  # dots in a key
_LARGEST_STUDY = 4_000_000  # bytes of the study file
_LARGEST_TEMPLATE = 256_000_000  # bytes of a file of the template


@dataclass(frozen=True)
class Quantity:
    """One number of a run: a dataset of its results, indices behind the step (or frame), and how to reduce over it."""

    name: str
    dataset: str
    at: tuple[int, ...] = ()
    take: str = "last"
    unit: str = ""


@dataclass(frozen=True)
class Case:
    """One run of a study."""

    number: int  #: from 1
    name: str  #: its folder
    values: Mapping[str, Value]


@dataclass(frozen=True)
class Study:
    """A study as its file describes it."""

    file: Path
    title: str
    template: Path
    output: Path
    parameters: tuple[str, ...]  #: those that vary, in the order of the file
    cases: tuple[Case, ...]
    quantities: tuple[Quantity, ...]
    command: str = "run"  #: of the program, for each case: "run" or "fos"
    threads: int = 1
    timeout: float | None = None
    options: tuple[str, ...] = ()
    cluster: Mapping[str, Any] = field(default_factory=dict)

    def files(self, case: Case) -> dict[str, bytes]:
        """The files of a case: those of the template with their placeholders filled in."""
        return {path.name: render(path, case.values) for path in template_files(self.template)}

    def digest(self, case: Case) -> str:
        """Changes when anything that the run depends on changes (the program's version aside)."""
        summary = hashlib.sha256()
        for name, data in self.files(case).items():
            summary.update(f"{name}\0{len(data)}\0".encode() + data)
        summary.update(json.dumps(self.options).encode())
        if self.command != "run":
            summary.update(self.command.encode())
        return summary.hexdigest()


def read_study(path: PathLike, output: PathLike | None = None) -> Study:
    """Read and check a study file; an InputError names the first problem and where it is.

    output: a folder to write to in the place of the one that the file names, which must lie in the folder of the file.
    """
    path = Path(path)
    text = read_text(path, _LARGEST_STUDY)
    runs = re.findall(r"[\w.\"' \t-]+", text)
    if any(len(re.findall(r"\.[ \t]*[\w\"']", run)) > _DEEPEST_KEY for run in runs):  # their cost is quadratic
        raise InputError("lists or tables are nested too deeply", path)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(problem))
        line, column = (int(place[1]), int(place[2])) if place else (None, None)
        raise InputError(short(str(problem).split(" (at ")[0], 200), path, line, column) from None
    except ValueError:  # Python refuses to read thousands of digits
        found = re.search(r"\d(?:_?\d){4299}", text)
        line = text.count("\n", 0, found.start()) + 1 if found else None
        raise InputError("a number has too many digits", path, line, None if line is None else 1) from None
    except RecursionError:
        raise InputError("lists or tables are nested too deeply", path) from None
    try:
        return _Reader(path, text, data).study(None if output is None else Path(output))
    except RecursionError:
        raise InputError("lists or tables are nested too deeply", path) from None


class _Reader:
    """Checks the tables of a study file; every fault is an InputError at its line."""

    def __init__(self, path: Path, text: str, data: dict[str, Any]) -> None:
        self.path, self.lines, self.data = path, text.splitlines(), data

    def fail(self, message: str, key: str | None = None) -> InputError:
        line = None
        if key is not None:
            pattern = re.compile(rf"^\s*(\[+\s*)?([\w.\"']+\.)?[\"']?{re.escape(key)}[\"']?\s*(\]+|=)")
            line = next((i for i, text in enumerate(self.lines, 1) if pattern.match(text)), None)
        return InputError(message, self.path, line, None if line is None else 1)

    def table(self, name: str) -> dict[str, Any]:
        found = self.data.get(name, {})
        if not isinstance(found, dict):
            raise self.fail(f"{name}: expected a table", name)
        return found

    def known(self, table: Mapping[str, Any], names: tuple[str, ...], where: str) -> None:
        for key in table:
            if key not in names:
                raise self.fail(f"unknown name '{key}' in {where}{did_you_mean(key, names)}", key)

    def study(self, output: Path | None) -> Study:
        self.known(self.data, _TOP, "the study")
        self.check_texts()
        run = self.table("run")
        self.known(run, _RUN, "[run]")
        template = self.data.get("template")
        if not isinstance(template, str):
            raise self.fail("template: expected the name of a folder", "template")
        folder = self.path.parent / template
        try:
            found = folder.is_dir()
        except OSError:  # a name that is too long
            found = False
        if not found:
            raise self.fail(f"template: no such folder: {short(str(folder), 200)}", "template")
        threads = run.get("threads", 1)
        if not isinstance(threads, int) or isinstance(threads, bool) or not 1 <= threads <= _MOST_THREADS:
            raise self.fail(
                f"threads: expected a whole number from 1 to {_MOST_THREADS}, found {shown(threads)}", "threads"
            )
        command = run.get("command", "run")
        if command not in _COMMANDS:
            raise self.fail(f"command: must be one of {', '.join(_COMMANDS)}, found {shown(command)}", "command")
        timeout = run.get("timeout")
        if timeout is not None and not (_is_number(timeout) and timeout > 0):
            raise self.fail(f"timeout: expected seconds above 0, found {shown(timeout)}", "timeout")
        options = run.get("options", [])
        if not isinstance(options, list) or not all(isinstance(option, str) for option in options):
            raise self.fail("options: expected a list of texts, such as ['--solver', 'pcg']", "options")
        for option in options:
            if option.partition("=")[0] in _NAMES_FILES:
                raise self.fail(
                    f"options: {shown(option)} names a file: the study itself names the files of its runs, and writes "
                    "in its output folder only",
                    "options",
                )
        parameters, cases = self.cases()
        study = Study(
            file=self.path,
            title=short(str(self.data.get("title", self.path.stem)), _LONGEST_TITLE),
            template=folder,
            output=self.output() if output is None else output,
            parameters=parameters,
            cases=cases,
            quantities=tuple(self.quantities()),
            command=command,
            threads=threads,
            timeout=float(timeout) if timeout is not None else None,
            options=tuple(options),
            cluster=self.table("cluster"),
        )
        self.check_placeholders(study)
        return study

    def output(self) -> Path:
        """The folder of everything that is written: one below that of the file, also where links lead."""
        name = self.data.get("output", self.path.stem)
        if not isinstance(name, str) or not name:
            raise self.fail("output: expected the name of a folder", "output")
        folder, here = self.path.parent / name, self.path.parent.resolve()
        try:
            found = folder.resolve()
        except (OSError, RuntimeError):  # links in a circle
            found = here
        if here not in found.parents:
            raise self.fail(
                f"output: expected a folder below that of the study file, found {shown(name)}"
                f"{'' if found == folder.absolute() else f', which is {found}'}; --output FOLDER writes elsewhere",
                "output",
            )
        return folder

    def check_texts(self) -> None:
        """No text may hold line breaks or other control characters: texts go into scripts, tables and logs.

        Values of parameters and constants go into the files of the template only, and may hold them."""

        def texts(value: Any) -> Iterator[str]:
            if isinstance(value, str):
                yield value
            elif isinstance(value, dict):
                for key, entry in value.items():
                    yield key
                    yield from texts(entry)
            elif isinstance(value, list):
                for entry in value:
                    yield from texts(entry)

        for key, value in self.data.items():
            entries: Iterable[tuple[str, Any]] = value.items() if isinstance(value, dict) else [(key, value)]
            for name, entry in entries:
                for text in (name, *(texts(entry) if key not in _FOR_TEMPLATE else ())):
                    if has_controls(text):
                        where = f"[{key}] {shown(name)}" if isinstance(value, dict) else key
                        message = f"{where}: line breaks and control characters are not allowed: {shown(text)}"
                        raise self.fail(message, name)

    def cases(self) -> tuple[tuple[str, ...], tuple[Case, ...]]:
        grid, constants = self.table("parameters"), self.table("constants")
        if len(grid) + len(constants) > _MOST_NAMES:
            raise self.fail(f"there are more than {_MOST_NAMES} parameters and constants", "parameters")
        listed = self.data.get("cases", [])
        if not isinstance(listed, list) or not all(isinstance(case, dict) for case in listed):
            raise self.fail("cases: expected [[cases]] tables", "cases")
        for name, values in grid.items():
            if not isinstance(values, list) or not values or not all(_is_value(value) for value in values):
                raise self.fail(f"parameter '{name}': expected a list of numbers or texts, found {shown(values)}", name)
            if len(set(values)) < len(values):
                raise self.fail(f"parameter '{name}': a value is given twice", name)
        for name, value in constants.items():
            if not _is_value(value):
                raise self.fail(f"constant '{name}': expected a number or a text, found {shown(value)}", name)
        if math.prod(len(values) for values in grid.values()) + len(listed) > _MOST_CASES:
            raise self.fail(f"the grid has more than {_MOST_CASES} cases", "parameters")
        choices = [dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values())] if grid else []
        choices += listed
        if not choices:
            raise self.fail("no cases: give [parameters] with lists of values, or [[cases]]")
        names = tuple(dict.fromkeys(itertools.chain.from_iterable(choices)))
        if len(names) > _MOST_NAMES:
            raise self.fail(f"the cases have more than {_MOST_NAMES} parameters", "cases")
        cases = []
        for number, values in enumerate(choices, 1):
            missing = [name for name in names if name not in values and name not in constants]
            if missing:
                giver = next(k for k, other in enumerate(choices, 1) if missing[0] in other)
                raise self.fail(f"case {number} gives no value for '{missing[0]}', which case {giver} gives", "cases")
            for name, value in values.items():
                if not _is_value(value):
                    raise self.fail(f"case {number}, '{name}': expected a number or a text, found {shown(value)}", name)
            label = "_".join(f"{name[:80]}{short(str(values[name]))}" for name in names if name in values)
            label = re.sub(r"[^\w.+-]", "-", label)[:80]
            cases.append(Case(number, f"{number:04d}_{label}", {**constants, **values}))
        return names, tuple(cases)

    def quantities(self) -> Iterator[Quantity]:
        for name, entry in self.table("results").items():
            if not isinstance(entry, dict) or not isinstance(entry.get("dataset"), str):
                raise self.fail(f"result '{name}': expected a table with 'dataset', such as 'history/energy'", name)
            self.known(entry, _RESULT, f"[results.{name}]")
            at, take = entry.get("at", []), entry.get("take", "last")
            if not isinstance(at, list) or not all(isinstance(i, int) for i in at):
                raise self.fail(f"result '{name}': at: expected whole numbers, found {shown(at)}", name)
            if not isinstance(take, str) or take not in TAKE:
                raise self.fail(f"result '{name}': take: must be one of {', '.join(TAKE)}, found {shown(take)}", name)
            yield Quantity(name, entry["dataset"].strip("/"), tuple(at), take, str(entry.get("unit", "")))

    def check_placeholders(self, study: Study) -> None:
        used: set[str] = set()
        for path in template_files(study.template):
            for name in _names_in(path):
                used.add(name)
                if name not in study.cases[0].values:
                    hint = did_you_mean(name, study.cases[0].values)
                    raise InputError(f"'{name}' is no parameter or constant of {study.file.name}{hint}", path)
        for name in study.parameters:
            if name not in used:
                raise self.fail(f"parameter '{name}' is used in no file of the template {study.template}", name)
        study.files(study.cases[0])  # placeholders that cannot be computed


def template_files(folder: Path) -> list[Path]:
    """The files of a template, without those that begin with a dot, results and pictures."""
    other = {".h5", ".hdf5", ".log", ".png", ".pdf", ".svg", ".md"}
    return sorted(
        path for path in folder.iterdir() if path.is_file() and path.name[0] != "." and path.suffix.lower() not in other
    )


def render(path: Path, values: Mapping[str, Value]) -> bytes:
    """A template file with its placeholders replaced: ``{{phi}}``, ``{{span/2}}``, ``{{-depth:.3f}}``."""
    text = _template_text(path)

    def replace(match: re.Match[str]) -> str:
        expression, _, form = match[1].partition(":")
        try:
            value = evaluate(expression.strip(), values)
            return formatted(value, form.strip()) if form else _plain(value)
        except (ValueError, ArithmeticError, TypeError) as problem:
            raise _placeholder_error(path, text, match.start(), match[0], problem) from None

    return _PLACEHOLDER.sub(replace, text).encode("utf-8", "surrogateescape")


def _template_text(path: Path) -> str:
    size = path.stat().st_size
    if size > _LARGEST_TEMPLATE:
        raise InputError(f"has {size} bytes; a file of a template has at most {_LARGEST_TEMPLATE}", path)
    return path.read_bytes().decode("utf-8", "surrogateescape")


def _placeholder_error(path: Path, text: str, start: int, placeholder: str, problem: object) -> InputError:
    line, column = text.count("\n", 0, start) + 1, start - text.rfind("\n", 0, start)
    return InputError(f"placeholder {short(placeholder)}: {problem}", path, line, column)


def _plain(value: Value) -> str:
    """Numbers as short as they read back; truth as Fortran writes it."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    return repr(value) if isinstance(value, float) else str(value)


def _names_in(path: Path) -> Iterator[str]:
    text = _template_text(path)
    for match in _PLACEHOLDER.finditer(text):
        try:
            yield from names_in(match[1].partition(":")[0].strip())
        except ValueError as problem:
            raise _placeholder_error(path, text, match.start(), match[0], problem) from None
    begin = _PLACEHOLDER.sub(lambda match: " " * len(match[0]), text).find("{{")
    if begin >= 0:
        raise _placeholder_error(path, text, begin, "{{", "expected a formula without braces, and '}}' behind it")


def _is_number(value: object) -> bool:
    """A finite number; whole ones, too, are at most as large as a float can be."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) if isinstance(value, float) else value.bit_length() < 1024


def _is_value(value: object) -> bool:
    return _is_number(value) or isinstance(value, str | bool)
