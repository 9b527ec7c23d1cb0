# SPDX-License-Identifier: MIT
"""Texts from files and file names, made fit for messages, scripts, pictures and pages."""

from __future__ import annotations

import codecs
import csv
import io
import math
import os
import re
import unicodedata
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import InputError

if TYPE_CHECKING:
    import pandas

PathLike = str | os.PathLike[str]  # the name of a file or folder
LARGEST_FILE = 64_000_000  # bytes of an input file
LONGEST_SHOWN = 60
LONGEST_IN_PICTURE = 200  # letters of a text; the layout of thousands takes gigabytes
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?", re.ASCII)


def decoded(data: bytes) -> str:
    """The text of a file, or of its beginning, as the program reads it: UTF-8 or, with a mark, UTF-16, else Latin-1; a
    line feed at each end of a line; without Ctrl-Z at the end."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = data.decode("utf-16", "replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    whole = text.rstrip(" \t\n\0\x1a")
    return whole if "\x1a" in text[len(whole) :] else text


def read_bytes(path: Path, largest: int = LARGEST_FILE) -> bytes:
    """The content of an input file; InputError when it cannot be read, or is too large."""
    try:
        with path.open("rb") as stream:
            data = stream.read(largest + 1)
    except FileNotFoundError as error:
        raise InputError("no such file", path) from error
    except IsADirectoryError as error:
        raise InputError("is a folder, not a file", path) from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path) from error
    if len(data) > largest:
        raise InputError(f"has more than {largest // 1_000_000} MB: files that large are not read", path)
    return data


def read_text(path: Path, largest: int = LARGEST_FILE) -> str:
    """The text of an input file; InputError when it cannot be read."""
    return decoded(read_bytes(path, largest))


def input_numbers(text: str) -> list[float]:
    """The numbers of an analysis file that the program has read: of each line those before its first word."""
    numbers = []
    for line in re.split(r"\r\n?|\n", text):
        for word in re.findall(r"[^\s,]+", re.split("[#!]", line)[0]):
            if not NUMBER.fullmatch(word):
                break
            numbers.append(float(word.lower().replace("d", "e")))
    return numbers


def short(text: str, longest: int = LONGEST_SHOWN) -> str:
    """The text, or its beginning and three dots."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """'; did you mean …?' with the nearest of some words, in any case; '' where none is near."""
    words = {one.strip().lower(): one for one in known}
    near = get_close_matches(word.strip().lower(), words, n=1)
    return f"; did you mean {words[near[0]]!r}?" if near else ""


def has_controls(text: str) -> bool:
    """True with line breaks or other control characters (Unicode: Cc, Zl, Zp, lone surrogates)."""
    return not text.isprintable() and any(unicodedata.category(letter) in ("Cc", "Zl", "Zp", "Cs") for letter in text)


def shown(value: object, longest: int = LONGEST_SHOWN) -> str:
    """The value in a message, cut to a length."""
    try:
        return short(repr(value), longest)
    except ValueError:  # Python refuses to print thousands of digits
        return "a number of too many digits"


def readable(text: str) -> str:
    """Text whose undecoded bytes (lone surrogates, as Python keeps them in names and titles) are taken as Latin-1."""
    return (
        "".join(chr(ord(c) - 0xDC00) if "\udc80" <= c <= "\udcff" else c for c in text)
        .encode("utf-8", "replace")
        .decode("utf-8")
    )


def plain_text(text: str) -> str:
    """A readable text for matplotlib: control characters become blanks, and $ is a dollar, not mathematics."""
    text = short(text, LONGEST_IN_PICTURE)
    clean = "".join(" " if unicodedata.category(c) == "Cc" else c for c in readable(text))
    return clean.replace("$", r"\$")


def csv_text(table: Mapping[str, Any] | pandas.DataFrame) -> str:
    """Columns by name as CSV whose texts no spreadsheet takes for formulas and no terminal for commands.

    Numbers have as many digits as it takes to read back the same value; what is not there is empty."""
    import numpy as np

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_cell(str(name)) for name in table)
    columns = [np.asarray(values).tolist() for _, values in table.items()]
    writer.writerows(map(_cell, row) for row in zip(*columns, strict=True))
    return stream.getvalue()


def _cell(value: Any) -> Any:
    """A text with visible control characters; one that begins like a formula, and is no number, behind a quote."""
    if not isinstance(value, str):
        return "" if value is None or value != value else value
    text = "".join(c.encode("unicode_escape").decode() if has_controls(c) else c for c in value)
    try:
        float(text)
    except ValueError:
        first = unicodedata.normalize("NFKC", text.strip()[:1])  # wide signs count, too
        return f"'{text}" if first in ("=", "+", "-", "@") else text
    return text


def number(value: Any) -> str:
    """Four digits, or the text of what is no number."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Real):
        return f"{value + 0:.4g}" if math.isfinite(value) else "–"  # no minus before 0
    return ", ".join(number(item) for item in value) if isinstance(value, list | tuple) else str(value)
