# SPDX-License-Identifier: MIT
"""The options of a run, as the table of the compiled part describes them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from functools import cache, wraps
from inspect import Parameter, signature
from typing import Any, TypeVar

import numpy as np

from .errors import InputError, UnknownNameError
from .native import OPTIONS_SCHEMA, Session
from .text import PathLike, did_you_mean

C = TypeVar("C", bound=type)

__all__ = [
    "check_options", "group_problems", "group_row", "name_arguments", "name_hint", "names_that_add_up",
    "option_rows", "options_schema", "refuse_problems", "repeated_groups", "replace_files",
]  # fmt: skip


@cache
def _schema_text() -> str:
    return Session().text(OPTIONS_SCHEMA)


def options_schema() -> dict[str, Any]:
    """The JSON Schema of `Model.options`: groups, names, kinds, bounds, units and meanings."""
    schema: dict[str, Any] = json.loads(_schema_text())
    return schema


@cache
def _rows() -> dict[str, dict[str, dict[str, Any]]]:
    """Rows of the table by group and name."""
    return {group: definition["properties"] for group, definition in options_schema()["$defs"].items()}


def group_row(group: str) -> dict[str, Any]:
    """What the table says of a group; InputError for one that is not there."""
    groups: dict[str, dict[str, Any]] = options_schema()["$defs"]
    if group not in groups:
        raise InputError(f"there is no group &{group}{name_hint(group, groups)}")
    return groups[group]


def option_rows(group: str) -> dict[str, dict[str, Any]]:
    """Rows of the table for the options of a group, by name; InputError for a group that is not there."""
    rows: dict[str, dict[str, Any]] = group_row(group)["properties"]
    return rows


@cache
def names_that_add_up() -> frozenset[str]:
    """Names whose values add up when they are given several times in a group."""
    return frozenset(name for rows in _rows().values() for name, row in rows.items() if row.get("x-adds-up"))


@cache
def repeated_groups() -> frozenset[str]:
    """Groups that may be given any number of times."""
    return frozenset(group for group, row in options_schema()["$defs"].items() if row.get("x-list"))


def _groups(options: Mapping[str, Any]) -> Iterator[tuple[str, MutableMapping[str, Any]]]:
    """Each group of these options; a group may be one mapping or a list of them."""
    for group, value in options.items():
        for entries in value if isinstance(value, list | tuple) else [value]:
            if not isinstance(entries, MutableMapping):
                raise InputError(f"group {group}: expected a mapping of names to values, found {entries!r}")
            yield group, entries


def replace_files(options: Mapping[str, Any], folder: PathLike) -> None:
    """Make paths of files to be read absolute; they count from this folder."""
    for group, entries in _groups(options):
        for name, row in _rows().get(group, {}).items():
            if row.get("x-file") and name in entries:
                entries[name] = os.path.abspath(os.path.join(folder, entries[name]))  # noqa: PTH100, PTH118


def check_options(options: Mapping[str, Any]) -> None:
    """Refuse unknown groups and names, values of another kind, and values out of bounds.

    >>> check_options({"time": {"dt_mx": 1.0}})
    Traceback (most recent call last):
        ...
    rockdda.errors.InputError: options['time']['dt_mx']: unknown name; did you mean 'dt_max'?"""
    problems = []
    for group, entries in _groups(options):
        rows = _rows().get(group)
        if rows is None:
            problems.append(f"options[{group!r}]: unknown group{name_hint(group, options_schema()['$defs'])}")
            continue
        for name, value in entries.items():
            if problem := _value_problem(rows, name, value):
                problems.append(f"options[{group!r}][{name!r}]: {problem}")
    if problems:
        raise InputError("\n".join(problems))


def group_problems(group: str, entries: Mapping[str, Any]) -> list[str]:
    """What is wrong with the values of one group, with their names; nothing where all can be read."""
    rows = option_rows(group)
    found = ((name, _value_problem(rows, name, value)) for name, value in entries.items())
    return [f"{name}: {problem}" for name, problem in found if problem]


def _value_problem(rows: Mapping[str, Any], name: str, value: Any) -> str:
    """What is wrong with a name or its value; empty when nothing is."""
    if name not in rows:
        return f"unknown name{name_hint(name, rows)}"
    problem = _problem(rows[name], value)
    return f"{problem}, found {value!r}" if problem else ""


def refuse_problems(label: str, group: str, entries: Mapping[str, Any], more: Iterable[str] = ()) -> None:
    """InputError for what is wrong with the values of a group; UnknownNameError where it has not all the names."""
    problems = [*group_problems(group, entries), *more]
    if problems:
        unknown = any(name not in option_rows(group) for name in entries)
        raise (UnknownNameError if unknown else InputError)("\n".join(f"{label}: {problem}" for problem in problems))


def name_arguments(cls: C) -> C:
    """Let a class and its methods `add_…` and `subdivide` suggest the name for an argument that they do not have."""
    for name, method in list(vars(cls).items()):
        if not name.startswith(("__init__", "add_", "subdivide")):
            continue
        parameters = signature(method).parameters
        if any(parameter.kind is Parameter.VAR_KEYWORD for parameter in parameters.values()):
            continue
        label = cls.__name__ if name == "__init__" else name
        setattr(cls, name, _with_suggestions(method, label, [word for word in parameters if word != "self"]))
    return cls


def _with_suggestions(method: Any, label: str, names: list[str]) -> Any:
    @wraps(method)
    def call(*arguments: Any, **given: Any) -> Any:
        for word in given:
            if word not in names:
                rows = {name: row for group in _rows().values() for name, row in group.items() if name in names}
                hint = name_hint(word, {name: {} for name in names} | rows)
                raise UnknownNameError(f"{label}: unknown name {word!r}{hint}")
        return method(*arguments, **given)

    return call


def name_hint(word: str, known: Mapping[str, Any]) -> str:
    """'; did you mean …?' with the names that the word is another one for, or with the nearest name."""
    usual = [name for name, row in known.items() if word.lower() in row.get("x-other-words", "").split()]
    if usual:
        return f"; did you mean {' or '.join(map(repr, usual))}?"
    return did_you_mean(word, known)


def _problem(row: Mapping[str, Any], value: Any) -> str:
    """What is wrong with a value; empty when nothing is."""
    kind = row["type"]
    if kind == "boolean":
        return "" if isinstance(value, bool | np.bool_) else "expected True or False"
    if kind == "string":
        if not isinstance(value, str | os.PathLike):
            return "expected a text"
        allowed: list[str] = row.get("enum", [])
        fits = not allowed or str(value).lower() in allowed
        return "" if fits else f"expected one of {', '.join(map(repr, allowed))}"
    if "array" in kind:
        return _list_problem(row, value)
    if kind in (["integer", "string"], ["number", "string"]):
        if isinstance(value, str):
            return ""
        kind = kind[0]
    if kind == "integer" and (not _is_number(value) or int(value) != value):
        return "expected a whole number"
    return _bounds_problem(row, value) if _is_number(value) else "expected a number"


def _list_problem(row: Mapping[str, Any], value: Any) -> str:
    values = np.asarray(value, dtype=object).ravel().tolist()
    if not all(_is_number(item) for item in values):
        return "expected numbers"
    least, most = row.get("minItems", 0), row.get("maxItems")
    if most is not None and len(values) != most:
        return f"expected {most} numbers"
    if most is None and least > 1 and (not values or len(values) % least):
        return f"expected a multiple of {least} numbers"
    return next((problem for item in values if (problem := _bounds_problem(row, item))), "")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def _bounds_problem(row: Mapping[str, Any], value: float) -> str:
    tests = {
        "minimum": (lambda bound: value >= bound, "at least"),
        "exclusiveMinimum": (lambda bound: value > bound, "greater than"),
        "maximum": (lambda bound: value <= bound, "at most"),
        "exclusiveMaximum": (lambda bound: value < bound, "less than"),
    }
    broken = [f"{words} {row[key]:g}" for key, (holds, words) in tests.items() if key in row and not holds(row[key])]
    return "must be " + " and ".join(broken) if broken else ""
