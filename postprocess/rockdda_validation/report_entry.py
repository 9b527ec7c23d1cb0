# SPDX-License-Identifier: MIT
"""A case of the report: its record, and beside it the one with the other formulation of contacts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from . import report_words as words
from .case import Comparison
from .runner import comparisons_of

__all__ = ["Entry", "entries_of"]

#: whose text, tables and pictures a case has in the report, the first that there is
PREFERRED = ("vertex", "", "length")


@dataclass(frozen=True)
class Entry:
    """A record, its comparisons, and the record of the same case by length."""

    record: dict[str, Any]
    beside: dict[str, Any] | None = None

    @property
    def identifier(self) -> str:
        return str(self.record["identifier"])

    @property
    def formulation(self) -> str:
        return str(self.record.get("formulation") or "")

    @property
    def section(self) -> str:
        """The section of the thesis that its name begins with, if any."""
        found = re.match(r"\d+(\.\d+)+", self.identifier)
        return f"§{found[0]} " if found else ""

    @property
    def error(self) -> str:
        return str(self.record.get("error") or "")

    @cached_property
    def comparisons(self) -> list[Comparison]:
        return comparisons_of(self.record)

    @cached_property
    def others(self) -> list[Comparison]:
        """Of the record by length."""
        return comparisons_of(self.beside) if self.beside else []

    @property
    def promised(self) -> list[Comparison]:
        return [c for c in self.comparisons if c.agrees is not None]

    @property
    def apart(self) -> list[Comparison]:
        """Comparisons with a published value that is not met."""
        return [c for c in self.comparisons if words.notable(c, c.published_error, c.published)]

    @property
    def link(self) -> str:
        return f"[{self.identifier}](#{words.anchor(self.identifier)})"

    def pairs(self) -> Iterator[tuple[Comparison | None, Comparison | None]]:
        """Each comparison and the one by length of the same quantity; names of what is worst may differ."""
        left = {c.quantity: c for c in self.others}
        same = len(self.others) == len(self.comparisons)
        for number, c in enumerate(self.comparisons):
            other = left.pop(c.quantity, None)
            if other is None and same and _alike(c, self.others[number]):
                other = left.pop(self.others[number].quantity, None)
            yield c, other
        for other in left.values():
            yield None, other

    @staticmethod
    def verdict(record: dict[str, Any] | None) -> str:
        """Promises that a record keeps."""
        if record is None:
            return "–"
        if record.get("error"):
            return "**failed**"
        made = [c.agrees for c in comparisons_of(record) if c.agrees is not None]
        if not made:
            return "none made"
        text = f"{sum(made)} of {len(made)}"
        return text if all(made) else f"**{text}**"


def _alike(one: Comparison, other: Comparison) -> bool:
    """Do two quantities begin with the same words, up to the first comma or bracket?"""
    beginnings = [re.split(r"[,(:]", c.quantity)[0] for c in (one, other)]
    return beginnings[0] == beginnings[1] and one.unit == other.unit


def entries_of(records: Sequence[dict[str, Any]]) -> list[Entry]:
    """One entry a case, in the order of the records."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for record in records:
        found.setdefault(str(record["identifier"]), {})[str(record.get("formulation") or "")] = record
    entries = []
    for group in found.values():
        main = next(name for name in PREFERRED if name in group)
        entries.append(Entry(group[main], group.get("length") if main != "length" else None))
    return entries
