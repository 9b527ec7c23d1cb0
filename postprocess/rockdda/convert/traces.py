# SPDX-License-Identifier: MIT
"""Traces of fractures as text, as FracPaQ reads them: a trace in each line, x and y of its nodes one after the other.

Numbers stand between tabs, blanks, commas or semicolons; between tabs or semicolons a comma is a decimal sign.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..errors import InputError
from ..native import Session
from ..text import read_text, shown
from .geometry import Geometry
from .report import MOST_LINES, Report

LARGEST = 1e30  # as the program allows
WORD = re.compile(r"[^\s,;]+")
COMMENTS = ("#", "%", "!")


def looks_like_traces(head: str) -> bool:
    """Does a file begin with a line of an even count of four numbers or more, perhaps behind a line of words?"""
    rows = [row for row in head.split("\n") if row.strip() and not row.lstrip().startswith(COMMENTS)][:2]
    # commas between numbers, or as decimal signs
    return any(_is_trace(WORD.findall(row)) or _is_trace(WORD.findall(row.replace(",", "."))) for row in rows)


def _is_trace(words: list[str]) -> bool:
    return len(words) >= 4 and len(words) % 2 == 0 and all(_number(word) is not None for word in words)


def _number(word: str) -> float | None:
    try:
        value = float(word.lower().replace("d", "e")) if "_" not in word else math.nan
    except ValueError:
        return None
    return value if abs(value) < LARGEST else None


def read_traces(path: Path) -> tuple[Geometry, Report]:
    """The lines of a file of traces, all of joint material 1."""
    text = read_text(path)
    report, geometry = Report(path, text), Geometry()
    if "," in text:  # which may be a decimal sign
        text = Session().plain_table(path, least=4, multiple=2)
    first = True
    for number, row in enumerate(text.split("\n"), start=1):
        words = list(WORD.finditer(row))
        if not words or row.lstrip().startswith(COMMENTS):
            continue
        values = [_number(word.group()) for word in words]
        if first and values[0] is None:
            report.leave("line of words at the head", "lines of words at the head")
            first = False
            continue
        first = False
        wrong = next((word for word, value in zip(words, values, strict=True) if value is None), None)
        if wrong is not None:
            found = shown(wrong.group())
            report.error(f"expected a number below {LARGEST:g} in size, found {found}", number, wrong.start() + 1)
            continue
        if len(values) % 2:
            report.error(f"a trace takes pairs x y, found {len(values)} numbers", number, words[-1].start() + 1)
            continue
        numbers = [float(value) for value in values if value is not None]
        corners = list(zip(numbers[::2], numbers[1::2], strict=True))
        before = len(geometry.joints)
        geometry.add_corners("joint", 1, corners)
        if len(geometry.joints) == before:
            report.leave("trace of one point", "traces of one point")
            continue
        report.take("trace", "traces")
        if len(geometry.joints) > MOST_LINES:
            raise InputError(f"has more than {MOST_LINES} lines", path)
    if not report.errors and not geometry.joints:
        report.error("there is no trace: expected a trace x1 y1 x2 y2 ... in each line")
    report.raise_errors()
    return geometry, report
