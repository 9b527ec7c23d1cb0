# SPDX-License-Identifier: MIT
"""The limit of stability: two values of a parameter, at a given distance, one stable and one not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from rockdda.errors import RockddaError

__all__ = ["Bracket", "bracket", "power_of_ten"]


@dataclass(frozen=True)
class Bracket:
    """The model fails at `fails` and stands at `stands`."""

    fails: float
    stands: float

    @property
    def middle(self) -> float:
        return 0.5 * (self.fails + self.stands)

    @property
    def width(self) -> float:
        return abs(self.stands - self.fails)

    def __str__(self) -> str:
        digits = max(0, 1 - math.floor(math.log10(self.width)))
        low, high = sorted((self.fails, self.stands))
        return f"{low:.{digits}f} – {high:.{digits}f}"


def bracket(stands: Callable[[float], bool], fails_at: float, stands_at: float, width: float) -> Bracket:
    """Halve the interval between two values until it is no wider than `width`.

    Both ends are tried first: an interval that does not hold the limit is an error, not a result.
    """
    if stands(fails_at) or not stands(stands_at):
        raise RockddaError(f"no limit between {fails_at} (to fail) and {stands_at} (to stand)")
    while abs(stands_at - fails_at) > width:
        middle = 0.5 * (fails_at + stands_at)
        if stands(middle):
            stands_at = middle
        else:
            fails_at = middle
    return Bracket(fails_at, stands_at)


def power_of_ten(value: float) -> str:
    """2e9 as it is written by hand, for tables and names of files."""
    mantissa, exponent = f"{value:.0e}".split("e")
    return f"{mantissa}e{int(exponent)}"
