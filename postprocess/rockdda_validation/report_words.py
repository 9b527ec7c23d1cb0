# SPDX-License-Identifier: MIT
"""Words and numbers of the report of the validation: errors, units, tables in Markdown."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from .case import Comparison

#: Differences beyond this share are listed by themselves, whether something was promised or not.
NOTABLE = 0.05
MOST_WORDS = 38  # letters of a source of truth on the first page


def sources(comparisons: Sequence[Comparison]) -> str:
    """Sources of the truths, in brief."""
    names = list(
        dict.fromkeys(c.truth_source for c in comparisons if c.truth_source and "energy" not in c.truth_source)
    )
    if not names:
        return "–"
    text = "; ".join(names)
    return text if len(text) <= MOST_WORDS else text[:MOST_WORDS].rsplit(" ", 1)[0].rstrip(",;") + " …"


def near(comparisons: Sequence[Comparison]) -> str:
    """Number of published values that are met."""
    found = [c for c in comparisons if c.published_error is not None]
    near = sum(not notable(c, c.published_error, c.published) for c in found)
    return f"{near} of {len(found)}" if found else "–"


def largest(comparisons: Sequence[Comparison], name: str) -> Comparison | None:
    """The comparison with the largest error; relative errors go before absolute ones."""
    found = [c for c in comparisons if getattr(c, name) is not None]
    relative = [c for c in found if c.scale != 1]
    return max(relative or found, key=lambda c: abs(finite(getattr(c, name))), default=None)


def finite(error: float | None) -> float:
    return math.inf if error is None or math.isnan(error) else error


def notable(c: Comparison, error: float | None, reference: float | None) -> bool:
    """Does a difference get a line in the list? Absolute ones are when they are a large share of the reference."""
    if error is None:
        return False
    return abs(finite(error)) > NOTABLE * (abs(reference or 0.0) if c.scale == 1 else 1.0)


def unexplained(c: Comparison) -> bool:
    """Without words, or with words that only quote what was published."""
    return not c.explanation or c.explanation.startswith(("not explained", "published"))


def broken_mark(c: Comparison) -> str:
    return "**broken:** " if c.agrees is False else ""


def computed_number(c: Comparison) -> str:
    """The computed number, or the text in its place."""
    return c.found if c.found and math.isnan(c.computed) else number(c.computed, c.unit)


def number(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    if math.isnan(value):
        return "no number"
    return with_unit(f"{value:.5g}", unit)


def error_text(c: Comparison, error: float | None) -> str:
    """A relative error in percent (the very small ones as powers of ten), an absolute one with its unit."""
    if error is None:
        return "–"
    if not math.isfinite(error):
        if not math.isnan(error):
            return "unbounded"
        return "–" if c.found else "no number"  # or its place in the table has the words
    if error == 0:
        return "0"
    if c.scale == 1:  # of shares in percent a difference has percentage points
        return with_unit(f"{error:+.2g}", "points" if c.unit == "%" else c.unit)
    return percent(error, "+")


def is_within_promise(c: Comparison, name: str) -> bool:
    """An absolute error against the truth (of which shares say nothing) that is as small as promised."""
    return name == "truth" and c.scale == 1 and c.agrees is True


def difference_text(c: Comparison) -> str:
    """From the published value."""
    if c.bound and c.published_error == 0:
        return "within the bound"
    return error_text(c, c.published_error)


def promise_text(c: Comparison) -> str:
    if c.allowed is None:
        return "–"
    return "≤ " + (
        with_unit(f"{c.allowed:.2g}", "points" if c.unit == "%" else c.unit) if c.scale == 1 else percent(c.allowed)
    )


def percent(share: float, sign: str = "") -> str:
    if 0 < abs(share) < 1e-5:
        return f"{share:{sign}.1e}"
    if abs(share) >= 10:
        return with_unit(f"{100 * share:{sign}.0f}", "%")
    return with_unit(f"{100 * share:{sign}.3g}" if abs(share) >= 0.1 else f"{100 * share:{sign}.2g}", "%")


def with_unit(number: str, unit: str) -> str:
    """Number and unit stay on one line."""
    return number + ("" if unit in ("", "°") else "\u00a0") + unit


def counted(number: int, name: str) -> str:
    return f"{number:,}".replace(",", "\u00a0") + f" {name}{'' if number == 1 else 's'}"


def duration(seconds: float) -> str:
    if seconds < 10:
        return f"{seconds:.1f} s"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def anchor(identifier: str) -> str:
    return "case-" + re.sub(r"[^a-z0-9]+", "-", identifier.lower()).strip("-")


def cell(text: Any) -> str:
    """Words within a cell of a table."""
    return re.sub(r"[ \t\r\n]+", " ", str(text)).strip().replace("|", "\\|")


def alternative(caption: str) -> str:
    return re.sub(r"[\[\]*_`]", "", cell(caption))


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(cell(entry) or " " for entry in line) + " |" for line in lines]
