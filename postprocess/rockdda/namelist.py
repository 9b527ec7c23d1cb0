# SPDX-License-Identifier: MIT
"""Namelist files (options, joint statistics) from and to Python values."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Container, Mapping
from typing import Any

import numpy as np

from .errors import InputError

_TOKEN = re.compile(
    r"""\s+ | [!\#][^\n]*                  # blanks and comments
    | (?P<text>'(?:[^']|'')*'|"(?:[^"]|"")*")
    | [&$](?P<group>\w+) | (?P<end>/) | (?P<equals>=) | ,
    | (?P<word>[^\s,=/&$'"!\#]+)""",
    re.VERBOSE,
)


def format_real(value: float) -> str:
    """The shortest text that reads back exactly."""
    number = float(value)
    if not math.isfinite(number):
        raise InputError(f"expected a finite number, found {number}")
    return repr(number)


def short_real(value: float) -> str:
    """The shortest text that reads back exactly, as people write numbers: 2600, 0.25, 2e10."""
    text = format_real(value)
    if not text.endswith(".0") or text == "-0.0":
        return text
    digits = text[:-2].rstrip("0")
    zeros = len(text) - 2 - len(digits)
    return f"{digits}e{zeros}" if zeros > 4 else text[:-2]


def flat_values(value: Any) -> list[Any]:
    """All values of lists within lists, in a row; of what is no list, that value."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return [value]
    return [item for part in value for item in flat_values(part)]


def entry_texts(entries: Mapping[str, Any]) -> list[str]:
    """The values of a group as words: "name = value" with a comma behind all but the last; lists are several words."""
    words: list[str] = []
    for key, value in entries.items():
        items = flat_values(value)
        texts = [short_real(float(item)) if isinstance(item, float | np.floating) else _format(item) for item in items]
        words += [f"{key} = {texts[0]}", *texts[1:]] if texts else []
    return [word + "," for word in words[:-1]] + words[-1:]


def format_groups(groups: Mapping[str, Any]) -> str:
    """{"run": {"t_end": 2.0}, "stage": [{…}, {…}]} as namelist text; empty groups are left out."""
    parts = []
    for name, value in groups.items():
        for entries in [value] if isinstance(value, Mapping) or not isinstance(value, list | tuple) else value:
            if not isinstance(entries, Mapping):
                raise InputError(f"group {name}: expected a mapping of names to values, found {entries!r}")
            if entries:
                rows = [f"&{name}", *(f"   {key} = {_format(entry)}" for key, entry in entries.items()), "/"]
                parts.append("\n".join(rows) + "\n")
    return "".join(parts)


def _format(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return ".true." if value else ".false."
    if isinstance(value, str | os.PathLike):
        return "'" + os.fspath(value).replace("'", "''") + "'"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if isinstance(value, float | np.floating):
        return format_real(float(value))
    if isinstance(value, list | tuple | np.ndarray):
        return ", ".join(_format(item) for item in value)
    raise InputError(f"expected a number, text, or a list of them, found {value!r}")


def parse_groups(text: str, cumulative: Container[str] = ()) -> dict[str, Any]:
    """Namelist text that the program has accepted. A group that comes once is a dictionary, else a list of them.

    cumulative: names whose values add up when they are given several times in a group."""
    found: dict[str, list[dict[str, Any]]] = {}
    group: dict[str, list[Any]] = {}
    name = ""
    tokens = [match for match in _TOKEN.finditer(re.sub("\r\n?", "\n", text)) if match.lastgroup]
    for i, token in enumerate(tokens):
        following = tokens[i + 1].lastgroup if i + 1 < len(tokens) else None
        if token["group"] and token["group"].lower() != "end":
            group, name = {}, ""
            found.setdefault(token["group"].lower(), []).append(group)
        elif token["word"] and following == "equals":
            name = token["word"].lower()
            if name not in cumulative or name not in group:
                group[name] = []
        elif token["text"]:
            quote = token["text"][0]
            group[name].append(token["text"][1:-1].replace(2 * quote, quote))
        elif token["word"]:
            count, _, word = token["word"].rpartition("*")
            group[name] += [_value(word)] * int(count or 1)

    def single(values: list[Any]) -> Any:
        return values[0] if len(values) == 1 else values

    return {key: single([{n: single(v) for n, v in one.items()} for one in all_]) for key, all_ in found.items()}


def _value(word: str) -> Any:
    lower = word.lower()
    if re.fullmatch(r"\.?t(rue)?\.?", lower):
        return True
    if re.fullmatch(r"\.?f(a[l]se)?\.?", lower):
        return False
    try:
        return int(word)
    except ValueError:
        pass
    try:
        return float(lower.replace("d", "e"))
    except ValueError:
        return word


def as_list(groups: Any) -> list[Any]:
    """One or several groups as a list."""
    return list(groups) if isinstance(groups, list | tuple) else [groups]


def last_value(groups: Any, name: str, default: Any = None) -> Any:
    """The last value of a name in one or several groups; the default where none has it."""
    return next((group[name] for group in reversed(as_list(groups)) if name in group), default)


def groups_in(text: str) -> dict[str, list[dict[str, Any]]]:
    """The groups of a text, a list for each name; none in one that the program would not accept."""
    try:
        return {name: as_list(entries) for name, entries in parse_groups(text).items()}
    except (KeyError, ValueError):
        return {}
