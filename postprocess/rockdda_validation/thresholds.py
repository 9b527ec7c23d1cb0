# SPDX-License-Identifier: MIT
"""From which value of a parameter on a model stands: looked for on a grid first, then by bisection."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rockdda.errors import InputError

__all__ = ["Threshold", "find_threshold"]

Predicate = Callable[[float], bool]


@dataclass(frozen=True)
class Threshold:
    """Result of a search; `trials` show why `bracket` may be missing: none stable, all stable, or not monotonic."""

    trials: tuple[tuple[float, bool], ...]  #: values of the grid, from those expected to fail on, and if they stand
    bracket: tuple[float, float] | None = None  #: last value that fails, first one that stands

    def words(self, unit: str, show: Callable[[float], str] = "{:g}".format) -> str:
        """Text of the report where there is no number."""
        if self.bracket:
            return f"between {show(self.bracket[0])} and {_with(show(self.bracket[1]), unit)}"
        first, last = (_with(show(self.trials[end][0]), unit) for end in (0, -1))
        if not any(stands for _, stands in self.trials):
            return f"none of the {len(self.trials)} values tried from {first} to {last} is stable"
        if all(stands for _, stands in self.trials):
            return f"stable from {first} on, the first of {len(self.trials)} values up to {last}"
        runs = [
            f"{'stable' if stands else 'unstable'} at {_with(', '.join(show(value) for value, _ in group), unit)}"
            for stands, group in ((key, list(items)) for key, items in itertools.groupby(self.trials, lambda t: t[1]))
        ]
        return f"not monotonic: {'; '.join(runs)}"


def find_threshold(
    stands: Predicate,
    values: Sequence[float],
    between: Callable[[float, float], float | None],
    necessary: Predicate | None = None,
) -> Threshold:
    """Where a model begins to stand.

    values: the grid, from values that are expected to fail to those that are expected to stand; all are tried, so that
    a second change does not go unseen. between: a value to try next between one that fails and one that stands, None
    when they are close enough. necessary: a cheaper condition without which nothing stands; the grid is tried with it,
    and `stands` itself only where the limit may be.
    """
    if len(values) < 2:
        raise InputError(f"a search needs two values at least, found {len(values)}")
    found = [(necessary or stands)(value) for value in values]
    if True not in found:
        return Threshold(tuple(zip(values, found, strict=True)))
    first = found.index(True)
    while necessary is not None and all(found[first:]) and first < len(values) and not stands(values[first]):
        found[first] = False
        first += 1
    trials = tuple(zip(values, found, strict=True))
    if first in (0, len(values)) or not all(found[first:]):
        return Threshold(trials)
    low, high = values[first - 1], values[first]
    while (middle := between(low, high)) is not None:
        if stands(middle):
            high = middle
        else:
            low = middle
    return Threshold(trials, (low, high))


def _with(number: str, unit: str) -> str:
    return f"{number}{unit}" if unit == "°" else f"{number} {unit}"
