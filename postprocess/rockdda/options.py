# SPDX-License-Identifier: MIT
"""The options of a run, as the table of the compiled part describes them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, MutableMapping
from difflib import get_close_matches
from functools import cache
from typing import Any

import numpy as np

from .errors import InputError
from .native import OPTIONS_SCHEMA, Session

__all__ = [
    "check_options",
    "group_problems",
    "group_row",
    "names_that_add_up",
    "option_rows",
    "options_schema",
    "repeated_groups",
    "replace_files",
]


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
        raise InputError(f"there is no group &{group}{_hint(group, groups)}")
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


def replace_files(options: Mapping[str, Any], folder: str | os.PathLike[str]) -> None:
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
    rockdda.errors.InputError: options['time']['dt_mx']: unknown name; did you mean 'dt_max'?
    """
    problems = []
    for group, entries in _groups(options):
        rows = _rows().get(group)
        if rows is None:
            problems.append(f"options[{group!r}]: unknown group{_hint(group, _rows())}")
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
        return f"unknown name{_hint(name, rows)}"
    problem = _problem(rows[name], value)
    return f"{problem}, found {value!r}" if problem else ""


def _hint(word: str, known: Mapping[str, Any]) -> str:
    near = get_close_matches(word, known, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


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
    if kind == ["integer", "string"]:
        if isinstance(value, str):
            return ""
        kind = "integer"
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
