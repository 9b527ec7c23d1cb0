# SPDX-License-Identifier: MIT
"""Parameter studies: many runs of one template, from a TOML file.

A study names a template (a folder whose text files hold ``{{…}}`` where parameters go), a grid or a list of parameters,
and what to keep of each run. `docs/studies.md` describes the file; `rockdda.study_run` does the runs.
"""

from __future__ import annotations

import ast
import difflib
import hashlib
import itertools
import json
import math
import operator
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .errors import InputError

__all__ = ["Case", "Quantity", "Study", "evaluate", "read_study", "render"]

Value = int | float | str | bool

_TAKE = ("last", "first", "min", "max", "mean", "absmax")
_TOP = ("title", "template", "output", "parameters", "constants", "cases", "run", "results", "cluster")
_RUN = ("threads", "timeout", "options")
_RESULT = ("dataset", "at", "take", "unit")
_PLACEHOLDER = re.compile(r"\{\{(.*?)\}\}", re.DOTALL)
_MOST_CASES = 1_000_000


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
        return summary.hexdigest()


def read_study(path: str | os.PathLike[str]) -> Study:
    """Read and check a study file; an InputError names the first problem and where it is."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise InputError("no such file", path) from None
    except (OSError, UnicodeDecodeError) as problem:
        raise InputError(f"cannot be read: {problem}", path) from None
    except tomllib.TOMLDecodeError as problem:
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(problem))
        line, column = (int(place[1]), int(place[2])) if place else (None, None)
        raise InputError(str(problem).split(" (at ")[0], path, line, column) from None
    return _Reader(path, text, data).study()


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
                near = difflib.get_close_matches(key, names, 1)
                hint = f"; did you mean '{near[0]}'?" if near else ""
                raise self.fail(f"unknown name '{key}' in {where}{hint}", key)

    def study(self) -> Study:
        self.known(self.data, _TOP, "the study")
        run = self.table("run")
        self.known(run, _RUN, "[run]")
        template = self.data.get("template")
        if not isinstance(template, str):
            raise self.fail("template: expected the name of a folder", "template")
        folder = self.path.parent / template
        if not folder.is_dir():
            raise self.fail(f"template: no such folder: {folder}", "template")
        threads = run.get("threads", 1)
        if not isinstance(threads, int) or isinstance(threads, bool) or threads < 1:
            raise self.fail(f"threads: expected a whole number of at least 1, found {threads!r}", "threads")
        timeout = run.get("timeout")
        if timeout is not None and not (_is_number(timeout) and timeout > 0):
            raise self.fail(f"timeout: expected seconds above 0, found {timeout!r}", "timeout")
        options = run.get("options", [])
        if not isinstance(options, list) or not all(isinstance(option, str) for option in options):
            raise self.fail("options: expected a list of texts, such as ['--solver', 'pcg']", "options")
        output = self.data.get("output", self.path.stem)
        if not isinstance(output, str) or not output:
            raise self.fail("output: expected the name of a folder", "output")
        parameters, cases = self.cases()
        study = Study(
            file=self.path,
            title=str(self.data.get("title", self.path.stem)),
            template=folder,
            output=self.path.parent / output,
            parameters=parameters,
            cases=cases,
            quantities=tuple(self.quantities()),
            threads=threads,
            timeout=float(timeout) if timeout is not None else None,
            options=tuple(options),
            cluster=self.table("cluster"),
        )
        self.check_placeholders(study)
        return study

    def cases(self) -> tuple[tuple[str, ...], tuple[Case, ...]]:
        grid, constants = self.table("parameters"), self.table("constants")
        listed = self.data.get("cases", [])
        if not isinstance(listed, list) or not all(isinstance(case, dict) for case in listed):
            raise self.fail("cases: expected [[cases]] tables", "cases")
        for name, values in grid.items():
            if not isinstance(values, list) or not values or not all(_is_value(value) for value in values):
                raise self.fail(f"parameter '{name}': expected a list of numbers or texts, found {values!r}", name)
            if len(set(values)) < len(values):
                raise self.fail(f"parameter '{name}': a value is given twice", name)
        for name, value in constants.items():
            if not _is_value(value):
                raise self.fail(f"constant '{name}': expected a number or a text, found {value!r}", name)
        if math.prod(len(values) for values in grid.values()) + len(listed) > _MOST_CASES:
            raise self.fail(f"the grid has more than {_MOST_CASES} cases", "parameters")
        choices = [dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values())] if grid else []
        choices += listed
        if not choices:
            raise self.fail("no cases: give [parameters] with lists of values, or [[cases]]")
        names = tuple(dict.fromkeys(itertools.chain.from_iterable(choices)))
        cases = []
        for number, values in enumerate(choices, 1):
            missing = [name for name in names if name not in values and name not in constants]
            if missing:
                giver = next(k for k, other in enumerate(choices, 1) if missing[0] in other)
                raise self.fail(f"case {number} gives no value for '{missing[0]}', which case {giver} gives", "cases")
            for name, value in values.items():
                if not _is_value(value):
                    raise self.fail(f"case {number}, '{name}': expected a number or a text, found {value!r}", name)
            label = "_".join(f"{name}{values[name]}" for name in names if name in values)
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
                raise self.fail(f"result '{name}': at: expected whole numbers, found {at!r}", name)
            if take not in _TAKE:
                raise self.fail(f"result '{name}': take: must be one of {', '.join(_TAKE)}, found {take!r}", name)
            yield Quantity(name, entry["dataset"].strip("/"), tuple(at), take, str(entry.get("unit", "")))

    def check_placeholders(self, study: Study) -> None:
        used: set[str] = set()
        for path in template_files(study.template):
            for name in _names_in(path):
                used.add(name)
                if name not in study.cases[0].values:
                    near = difflib.get_close_matches(name, list(study.cases[0].values), 1)
                    hint = f"; did you mean '{near[0]}'?" if near else ""
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
    text = path.read_bytes().decode("utf-8", "surrogateescape")

    def replace(match: re.Match[str]) -> str:
        expression, _, form = match[1].partition(":")
        line = text.count("\n", 0, match.start()) + 1
        column = match.start() - text.rfind("\n", 0, match.start())
        try:
            value = evaluate(expression.strip(), values)
            return format(value, form.strip()) if form else _plain(value)
        except (ValueError, ArithmeticError, TypeError) as problem:
            raise InputError(f"placeholder {match[0]}: {problem}", path, line, column) from None

    return _PLACEHOLDER.sub(replace, text).encode("utf-8", "surrogateescape")


def _plain(value: Value) -> str:
    """Numbers as short as they read back; truth as Fortran writes it."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    return repr(value) if isinstance(value, float) else str(value)


def _names_in(path: Path) -> Iterator[str]:
    text = path.read_bytes().decode("utf-8", "surrogateescape")
    for match in _PLACEHOLDER.finditer(text):
        try:
            tree = ast.parse(match[1].partition(":")[0].strip(), mode="eval")
        except SyntaxError:
            line = text.count("\n", 0, match.start()) + 1
            raise InputError(f"placeholder {match[0]}: expected a parameter or a formula", path, line) from None
        called = {
            node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and node.id not in called and node.id not in _CONSTANTS:
                yield node.id


_CONSTANTS = {"pi": math.pi}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "atan": math.atan, "radians": math.radians,
    "degrees": math.degrees, "abs": abs, "min": min, "max": max, "round": round,
}  # fmt: skip
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip


def evaluate(expression: str, values: Mapping[str, Value]) -> Any:
    """A formula of parameters: numbers, + - * / // % **, parentheses, pi and a few functions; nothing else."""

    def visit(node: ast.AST) -> Any:
        match node:
            case ast.Expression(body=body):
                return visit(body)
            case ast.Constant(value=int() | float() as value):
                return value
            case ast.Name(id=name) if name in values:
                return values[name]
            case ast.Name(id=name) if name in _CONSTANTS:
                return _CONSTANTS[name]
            case ast.Name(id=name):
                raise ValueError(f"'{name}' is not known")
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -visit(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return visit(operand)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                a, b = visit(left), visit(right)
                if isinstance(a, str) or isinstance(b, str):
                    raise ValueError("texts cannot be computed with")
                if isinstance(op, ast.Pow) and abs(b) > 1000:
                    raise ValueError(f"the exponent {b} is too large")
                return _OPERATORS[type(op)](a, b)
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in _FUNCTIONS:
                return _FUNCTIONS[name](*map(visit, arguments))
        raise ValueError("expected a parameter or a formula")

    try:
        return visit(ast.parse(expression, mode="eval"))
    except SyntaxError:
        raise ValueError("expected a parameter or a formula") from None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_value(value: object) -> bool:
    return _is_number(value) or isinstance(value, str | bool)
