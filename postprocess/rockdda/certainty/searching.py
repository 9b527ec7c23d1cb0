# SPDX-License-Identifier: MIT
"""Searches of a critical factor as cases of a study: their options, and what became of each."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..critical import NAMES
from ..errors import InputError
from ..study import Study
from ..study.case import SEARCHED, read_status

#: What a model without a factor does at the value that counts.
STANDS, FAILS, UNKNOWN = "stands", "fails", "unknown"
WRONG_INPUT = 2  #: exit code of the program
#: Options of `rockdda fos` that a study may choose.
OPTIONS = ("search", "joints", "loads", "factors", "from", "to", "tolerance", "stage", "max-steps", "solver")


@dataclass(frozen=True)
class Found:
    """The end of a search."""

    case: int
    factor: float | None
    half_width: float  #: of the interval between the stable and the failing value
    mechanism: str  #: "sliding", "toppling", "fall", "mixed"; '' without a factor
    side: str  #: STANDS, FAILS or UNKNOWN at the value that counts; of a factor at or above it: STANDS
    message: str  #: why there is no factor
    exit_code: int = 0  #: of the program


def search_options(options: Mapping[str, Any]) -> list[str]:
    """Words of the command line; those that are None are left out."""
    words: list[str] = []
    for name, value in options.items():
        option = name.rstrip("_").replace("_", "-")
        if option not in OPTIONS:
            raise InputError(f"{name}: no option of a search; there are {', '.join(OPTIONS)}")
        if value is not None:
            words += [f"--{option}", _word(value)]
    return words


def _word(value: Any) -> str:
    """A value on the command line: names and factors with commas between them."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} = {_word(one)}" for name, one in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(_word, value))
    return repr(float(value)) if isinstance(value, float) else str(value)


def search_name(kind: str | None) -> str:
    """'factor of safety', 'critical tilt' …"""
    return NAMES.get(kind or "strength", f"{kind} factor")


def found_in(study: Study, folder: Path, case: int, limit: float = 1.0) -> Found:
    """What the search of a case has found. limit: below it the model counts as failing."""
    try:
        answer = json.loads((folder / SEARCHED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        answer = {}
    status = read_status(folder)
    unfinished = status.get("status") in ("waiting", "running", "stopped")
    if unfinished or status.get("digest") != study.digest(study.cases[case - 1]):
        return Found(case, None, 0.0, "", UNKNOWN, "not run yet")
    if "factor" in answer:  # also of a design that does not stand, which ends as a run that failed
        factor, low, high = (answer[name] for name in ("factor", "low", "high"))
        if factor is None:
            return Found(case, None, 0.0, "", STANDS, "stands with any strength that was tried")
        half = 0.5 * abs(float(high) - float(low)) if None not in (low, high) else 0.0
        kind = str(answer.get("mechanism", {}).get("kind", ""))
        return Found(case, float(factor), half, kind, FAILS if factor < limit else STANDS, "")
    message = str(status.get("message", "")) or "no answer"
    code = int(status.get("exit_code", 0))
    return Found(case, None, 0.0, "", _side(message, limit), message.removeprefix("rockdda: error: "), code)


def _side(message: str, limit: float) -> str:
    """What a search without a factor says of the value that counts, by its message.

    It stands at the upper end of the range, does not stand at the lower one, or slides off with any strength."""
    text = message.removeprefix("rockdda: error: ")
    words = text.split(",")[0].split()
    if text.startswith(("stable at ", "not stable at ")):
        try:
            value = float(words[-1])
        except ValueError:
            return UNKNOWN
        if text.startswith("stable"):
            return STANDS if value >= limit else UNKNOWN
        return FAILS if value <= limit else UNKNOWN
    moved = "does not fall" in text or "is not the one that was drawn" in text
    return FAILS if text.startswith("the model does not stand") and moved else UNKNOWN
