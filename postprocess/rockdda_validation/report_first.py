# SPDX-License-Identifier: MIT
"""The first page of the report: what is reproduced, what is explained, what is not explained."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from . import report_words as words
from .case import Comparison
from .report_entry import Entry

__all__ = ["first_page"]

#: cases that ask for a closing rule, and the quantities that answer
CLOSING_RULES = {
    "6.6.3-closing-family": "verdicts on the single layer",
    "6.6.3-opening-gap": ".*opening gap 2e-07",  # that of DDA for Windows
    "7.2.1-closing-family": "members of the family",
    "7.2-fifty-tunnels": "stable tunnels",
}
MOST_LETTERS = 170  # of a reason


def first_page(entries: Sequence[Entry]) -> list[str]:
    """A paragraph, a table of counts, and three lists."""
    failed = [entry for entry in entries if entry.error]
    lines = [_opening(entries), "", *_counts(entries), ""]
    lines += ["## Reproduced", "", *_reproduced(entries), ""]
    lines += ["## Explained", "", *_explained(entries), ""]
    lines += ["## Not explained", "", *_unexplained(entries), ""]
    lines += _closing_rules({entry.identifier: entry for entry in entries})
    if failed:
        lines += [f"**Not computed:** {', '.join(entry.link for entry in failed)}.", ""]
    return lines


def _opening(entries: Sequence[Entry]) -> str:
    return (
        f"{words.counted(len(entries), 'case')}. A *promise* is a stated bound on the error against the *truth* (a "
        "closed form or an independent solution without DDA) or, where there is none, on the difference from the "
        "published value. The thesis is Tsesarsky (2005). Nothing was tuned. Contacts are springs of g0 at vertices "
        "(*vertex*, as in the thesis) or a stiffness per length (*length*); a truth that counts springs at corners "
        "makes no promise by length."
    )


def _counts(entries: Sequence[Entry]) -> list[str]:
    """A row for each question, a column for each formulation."""
    columns = [[c for entry in entries for c in entry.comparisons]]
    head = ["", next((entry.formulation for entry in entries if entry.formulation), "") or "RockDDA"]
    if any(entry.beside for entry in entries):
        columns.append([c for entry in entries for c in entry.others])
        head.append("length")
    computed = [sum(not entry.error for entry in entries)]
    computed.append(sum(entry.beside is not None and not entry.beside.get("error") for entry in entries))
    rows = [["cases computed", *[str(number) for number in computed[: len(columns)]]]]
    for name, function in (
        ("promises kept", _kept),
        ("published values met within 5 %", words.near),
        ("published values that differ, not explained", _open),
    ):
        rows.append([name, *map(function, columns)])
    return words.table(head, rows)


def _kept(comparisons: Sequence[Comparison]) -> str:
    made = [c.agrees for c in comparisons if c.agrees is not None]
    return f"{sum(made)} of {len(made)}"


def _open(comparisons: Sequence[Comparison]) -> str:
    apart = [c for c in comparisons if words.notable(c, c.published_error, c.published)]
    return f"{sum(map(words.unexplained, apart))} of {len(apart)}"


def _reproduced(entries: Sequence[Entry]) -> list[str]:
    """Cases that keep all their promises, and published values that are met."""
    made = [entry for entry in entries if entry.promised]
    kept = [entry for entry in made if all(c.agrees for c in entry.promised)]
    which = "" if len(kept) == len(made) else f": {', '.join(entry.link for entry in kept) or 'none'}"
    lines = [f"- *Truth*: {len(kept)} of {words.counted(len(made), 'case')} that promise something keep all{which}."]
    met = []
    for entry in entries:
        found = [c for c in entry.comparisons if c.published_error is not None]
        if len(found) > len(entry.apart):
            met.append(f"{entry.link} {len(found) - len(entry.apart)} of {len(found)}")
    return [*lines, f"- *Published*, within {words.percent(words.NOTABLE)}: {', '.join(met) or 'none'}."]


def _explained(entries: Sequence[Entry]) -> list[str]:
    """A line for each case with differences that have a reason: that of the largest."""
    lines = []
    for entry in entries:
        some = [c for c in entry.apart if not words.unexplained(c)]
        if some:
            worst = max(some, key=lambda c: abs(words.finite(c.published_error)))
            lines.append(f"- {entry.link}, {len(some)} of {len(entry.apart)}: {_short(worst.explanation)}.")
    return lines or ["Nothing differs from a published value."]


def _unexplained(entries: Sequence[Entry]) -> list[str]:
    """The same for those without a reason, and broken promises."""
    lines = []
    for entry in entries:
        some = [c for c in entry.apart if words.unexplained(c)]
        broken = sum(c.agrees is False for c in entry.comparisons)
        if some:
            worst = max(some, key=lambda c: abs(words.finite(c.published_error)))
            lines.append(
                f"- {entry.link}, {len(some)} of {len(entry.apart)}: {worst.quantity}: {words.computed_number(worst)}, "
                f"published {words.number(worst.published, worst.unit)}."
            )
        if broken:
            lines.append(f"- {entry.link}: **{words.counted(broken, 'broken promise')}**, see the case.")
    return lines or ["Nothing: no published value differs without a note of why."]


def _closing_rules(entries: Mapping[str, Entry]) -> list[str]:
    """Does a closing rule give the verdicts of the thesis? A list where it was asked."""
    asked = [entries[name] for name in CLOSING_RULES if name in entries and entries[name].comparisons]
    if not asked:
        return []
    lines = ["## Is there a closing rule that gives the verdicts of the thesis?", ""]
    lines.append(
        "Between the closing rule of RockDDA and that of DDA for Windows lies a family: the penetration beyond which "
        "a contact closes, the gap beyond which it opens, joints closed or open at the start. "
        f"**{'None of the members computed does.' if _best_misses(asked) else 'One does, see the cases.'}**"
    )
    lines.append("")
    for entry in asked:
        found = "; ".join(
            f"{c.quantity} {c.found or words.computed_number(c)}, published {words.number(c.published, c.unit)}"
            for c in entry.comparisons
            if c.published is not None and re.match(CLOSING_RULES[entry.identifier], c.quantity)
        )
        lines.append(f"- {entry.link}, {words.counted(int(entry.record['runs']), 'run')}: {found}.")
    return [*lines, ""]


def _best_misses(asked: Sequence[Entry]) -> bool:
    """Does the best member of a family miss a published count?"""
    counts = [c for entry in asked for c in entry.comparisons if "family" in c.quantity and c.published is not None]
    return any(c.computed < (c.published or 0.0) for c in counts)


def _short(text: str) -> str:
    """The first words of a reason."""
    text = words.cell(text).rstrip(".")
    return text if len(text) <= MOST_LETTERS else text[:MOST_LETTERS].rsplit(" ", 1)[0].rstrip(",;:") + " …"
