# SPDX-License-Identifier: MIT
"""What the changes of a number mean: its error by each number of the method, and by the stiffness of the joints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..units import Units
from .variants import METHOD, PROPERTY, Variant

#: Orders of convergence that an extrapolation may use; a larger one is taken as this one.
LEAST_ORDER, MOST_ORDER = 0.3, 2.0
#: The error of an extrapolated value, and of one that has no order, over what was measured.
SAFETY, NO_ORDER = 1.25, 2.0
#: Changes that grow with each refinement are taken to grow on, at most by this factor.
MOST_GROWTH = 4.0
#: Error over the value below which a cause is not named.
UNNAMED = 5e-4
#: Changes over the value below which there is no order: what equilibrium and rounding leave.
ROUNDING = 1e-6
#: Error over the value that an equilibrium leaves: its tolerance. A displacement of this share of the model's extent
#: changes arms of forces, and a factor, by no more.
EQUILIBRIUM = 1e-5
AS_WORD = "1e-5 of the model's extent"
WORDS = {
    "step": "the step", "corners": "the corners", "cells": "the cells", "elements": "the elements",
    "solver": "the solver", "search": "the search", PROPERTY: "the joint stiffness",
}  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """A number, how much it changes, and what that says."""

    name: str
    stage: str
    value: float | None  #: of the model as it is; None where there is none
    scale: float  #: what changes are shares of
    dimension: str
    changes: Mapping[str, float | None]  #: by each variant; None: it has no such number
    order: float | None = None  #: of convergence with the step
    extrapolated: float | None = None  #: value at a step of no length
    plus_minus: Mapping[str, float] = field(default_factory=dict)  #: by each kind of numbers; without those that failed
    missing: tuple[str, ...] = ()  #: kinds whose variants have no such number
    grows: bool = False  #: does the change grow as the step is refined?
    nothing: float = 0.0  #: errors that are no larger do not decide

    @property
    def title(self) -> str:
        """Its name and stage."""
        return f"{self.name}, {self.stage}" if self.stage else self.name

    @property
    def method(self) -> float:
        """Error by the numbers of the method together, and by what is left of an equilibrium."""
        errors = sum(error for kind, error in self.plus_minus.items() if kind != PROPERTY)
        return errors + EQUILIBRIUM * self.scale

    @property
    def joints(self) -> float:
        """Change by half and twice the stiffness of the joints."""
        return self.plus_minus.get(PROPERTY, 0.0)

    def share(self, error: float) -> float:
        """An error as a share of the number."""
        return error / self.scale if self.scale > 0 else (math.inf if error > 0 else 0.0)

    def deciding(self, error: float) -> float:
        """The same, none where the error does not decide."""
        return self.share(error) if error > self.nothing else 0.0

    def exceeds(self, limit: float) -> list[str]:
        """Kinds whose changes are larger than a share of the number, or that have no such number."""
        found = [kind for kind, error in self.plus_minus.items() if self.deciding(error) > limit]
        return [*found, *(kind for kind in self.missing if kind not in found)]

    def words(self, units: Units, chosen: bool = False, limit: float = 0.05) -> str:
        """The verdict: 'point 1 y, heading: -5.3 mm: ± 0.2 by the step, ± 1.6 by the joint stiffness (a property:
        measure it)'. chosen: the program has chosen that stiffness."""
        if self.value is None:
            return f"{self.title}: the model as it is has no such number"
        factor, unit = units.multiple(self.dimension, self.value) if self.dimension and units.length else (1.0, "")
        errors = [error for error in self.plus_minus.values() if self.share(error) >= UNNAMED]
        value = number_with_error(factor * self.value, [factor * error for error in errors])
        named = []
        for kind in (*METHOD, "search", PROPERTY):
            error = self.plus_minus.get(kind, 0.0)
            if self.share(error) >= UNNAMED:
                remark = ""
                if self.share(error) > limit and error <= self.nothing:
                    remark = f" (less than {AS_WORD}, nothing beside the factor)"
                elif kind == PROPERTY:
                    remark = f" (a property{', here chosen by the program' if chosen else ''}: measure it)"
                elif self.share(error) > limit:
                    remark = " (a number of the method: refine it)"
                    if kind == "step" and self.grows:
                        remark = " (a number of the method, whose refinement changes ever more: there is no answer yet)"
                named.append(f"± {rounded(factor * error)} by {WORDS[kind]}{remark}")
        quiet = [WORDS[kind] for kind in self.plus_minus if self.share(self.plus_minus[kind]) < UNNAMED]
        if quiet:
            named.append(f"less than {100 * UNNAMED:g} % by {listed(quiet)}")
        if self.missing:
            named.append(f"not known by {listed([WORDS[kind] for kind in self.missing])}, whose runs failed")
        return f"{self.title}: {f'{value} {unit}'.rstrip()}: {', '.join(named)}"


def judge(
    name: str, stage: str, dimension: str, base: tuple[float, float] | None, values: Mapping[str, float | None],
    variants: Sequence[Variant], noise: float = 0.0, nothing: float = 0.0,
) -> Finding:  # fmt: skip
    """Judge a number.

    base: the number of the model as it is, and what changes are shares of. values: the number of each variant by its
    name. noise: half the interval in which a search has found it. nothing: errors that are no larger do not decide."""
    if base is None:
        missing = tuple(dict.fromkeys(variant.kind for variant in variants if variant.kind))
        return Finding(name, stage, None, 0.0, dimension, dict.fromkeys(values), missing=missing)
    value, scale = base
    changes = {key: None if found is None else found - value for key, found in values.items()}
    errors: dict[str, float] = {}
    failed: list[str] = []
    order = extrapolated = None
    grows = False
    for kind in dict.fromkeys(variant.kind for variant in variants if variant.kind):
        of_kind = [changes[variant.name] for variant in variants if variant.kind == kind]
        known = [change for change in of_kind if change is not None]
        if len(known) < len(of_kind):
            failed.append(kind)
        if not known:
            continue
        largest = max(map(abs, known))
        if kind == "step" and len(known) == 2 == len(of_kind):
            half, quarter = known
            floor = max(2 * noise, ROUNDING * scale)
            order = _order(half, quarter, floor)
            last = abs(quarter - half)
            grows = last > max(abs(half), floor)
            growth = min(last / abs(half), MOST_GROWTH) if half else MOST_GROWTH
            errors[kind] = max(NO_ORDER * max(largest, last), grows * (abs(quarter) + growth * last))
            if order is not None:
                extrapolated = value + quarter + (quarter - half) / (2 ** min(order, MOST_ORDER) - 1)
                errors[kind] = SAFETY * abs(extrapolated - value)
        elif kind in ("corners", "cells", "elements", "step"):
            # half the number changes the value by at least half of its error, where it converges in first order
            errors[kind] = NO_ORDER * largest
        else:
            errors[kind] = largest
    if noise:
        errors["search"] = noise
    return Finding(
        name, stage, value, scale, dimension, changes, order, extrapolated, errors, tuple(failed), grows, nothing
    )


def _order(half: float, quarter: float, noise: float) -> float | None:
    """The order of convergence with the step, where both changes go the same way and fall."""
    last = quarter - half
    if abs(half) <= noise or abs(last) <= noise or half * last <= 0:
        return None
    order = math.log2(half / last)
    return order if order >= LEAST_ORDER else None


def percent(share: float, digits: int = 2) -> str:
    """'2.3 %', or a power of ten of what is rare."""
    if 0 < share < 1e-5:
        return f"{share:.{digits - 2}e}"
    return f"{float(f'{100 * share:.{digits}g}'):g} %"


def rounded(error: float) -> str:
    """An error, rounded up, with two digits where they begin with 1 or 2, else one."""
    if not error > 0 or not math.isfinite(error):
        return f"{error:g}"
    digits = 1 if error / 10 ** math.floor(math.log10(error)) < 3 else 0
    place = math.floor(math.log10(error)) - digits
    return _plain(math.ceil(round(error / 10**place, 6)) * 10.0**place, place)


def two_digits(error: float) -> str:
    """An error with two digits, also where the second one is 0."""
    return f"{error:#.2g}".rstrip(".")


def number_with_error(value: float, errors: Sequence[float]) -> str:
    """A value with as many digits as its smallest error has, two to six; with three where it has none."""
    least = min((error for error in errors if error > 0), default=0.0)
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    first = math.floor(math.log10(abs(value)))
    place = min(max(math.floor(math.log10(least)), first - 5), first - 1) if least > 0 else first - 2
    return _plain(value, place)


def _plain(value: float, place: int) -> str:
    if place > -6 and abs(value) < 1e6:
        return f"{value:.{max(0, -place)}f}"
    return f"{value:.3g}"


def listed(words: Sequence[str]) -> str:
    """'a, b and c'."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
