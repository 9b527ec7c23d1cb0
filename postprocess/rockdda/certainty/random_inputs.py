# SPDX-License-Identifier: MIT
"""Numbers of a model that scatter: their places in its labelled file, their distributions, correlations and samples."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError, need
from ..groups import as_list
from ..options import group_problems, name_hint, option_rows, options_schema
from ..text import did_you_mean, shown
from .template import Groups, Placeholders

_INPUT = re.compile(
    r"(?P<tan>tan\s*\()?\s*(?P<name>[^=()]+)\.(?P<option>\w+)\s*(?:\[\s*(?P<index>\d+)\s*\])?\s*(?(tan)\))"
)
_LAW = re.compile(r"(?P<law>\w+)\s*\((?P<numbers>[^()]*)\)")
#: Distributions: their arguments.
LAWS = {
    "normal": ("mean, standard deviation", 2), "lognormal": ("mean, standard deviation", 2),
    "uniform": ("low, high", 2), "triangular": ("low, mode, high", 3),
}  # fmt: skip
SEVERAL = 2  # numbers of a row of a table in time


@dataclass(frozen=True)
class RandomInput:
    """A number of a labelled file with its distribution."""

    name: str  #: as given: 'bedding.friction', 'tan(bedding.friction)'
    group: str
    option: str
    entry: int  #: place of the group among those of its kind, from 0
    index: int | None  #: of one number of a list, from 1
    is_tangent: bool  #: the distribution is that of the tangent of an angle
    law: str
    numbers: tuple[float, ...]

    @property
    def parameter(self) -> str:
        """Its name in the study."""
        return re.sub(r"\W+", "_", self.name).strip("_") or "x"

    @property
    def distribution(self) -> Any:
        """The distribution, of scipy.stats."""
        stats = need("scipy.stats", "reliability", "a distribution")
        if self.law == "uniform":
            low, high = self.numbers
            return stats.uniform(low, high - low)
        if self.law == "triangular":
            low, mode, high = self.numbers
            return stats.triang((mode - low) / (high - low), low, high - low)
        mean, deviation, *bounds = self.numbers
        if self.law == "lognormal":
            spread = math.sqrt(math.log1p((deviation / mean) ** 2))
            return stats.lognorm(spread, scale=mean / math.sqrt(1 + (deviation / mean) ** 2))
        if bounds:
            low, high = bounds
            return stats.truncnorm((low - mean) / deviation, (high - mean) / deviation, mean, deviation)
        return stats.norm(mean, deviation)

    def value(self, drawn: float) -> float:
        """The value of the option."""
        return math.degrees(math.atan(drawn)) if self.is_tangent else drawn


def parse_inputs(given: str | Mapping[str, str], groups: Groups) -> list[RandomInput]:
    """Inputs of 'bedding.friction = normal(35, 5); water.level = uniform(-2, 2)', or of a mapping of such words."""
    if isinstance(given, str):
        parts = [part for part in re.split(r"[;\n]", given) if part.strip()]
        pairs = []
        for part in parts:
            name, equals, law = part.partition("=")
            if not equals:
                raise InputError(f"vary: expected NAME.OPTION = DISTRIBUTION, found {shown(part.strip())}")
            pairs.append((name.strip(), law.strip()))
    else:
        pairs = [(str(name).strip(), str(law).strip()) for name, law in given.items()]
    if not pairs:
        raise InputError("vary: nothing is to vary")
    found = [_input(name, law, groups) for name, law in pairs]
    for i, one in enumerate(found):
        for other in found[:i]:
            same = (one.group, one.entry, one.option) == (other.group, other.entry, other.option)
            if same and (one.index == other.index or None in (one.index, other.index)):
                raise InputError(f"vary: {one.name} and {other.name} are the same number")
            if one.parameter == other.parameter:
                raise InputError(f"vary: the names {one.name} and {other.name} are too much alike")
    return found


def _input(name: str, law: str, groups: Groups) -> RandomInput:
    place, what = _INPUT.fullmatch(name), _LAW.fullmatch(law)
    if place is None:
        raise InputError(f"vary: expected NAME.OPTION, such as bedding.friction, found {shown(name)}")
    if what is None or what["law"].lower() not in LAWS:
        known = ", ".join(f"{key}({words})" for key, (words, _) in LAWS.items())
        raise InputError(f"vary {name}: expected one of {known}; found {shown(law)}")
    numbers = _numbers(name, what["law"].lower(), what["numbers"])
    group, entry = _find(place["name"].strip(), place["option"].lower(), groups)
    index = None if place["index"] is None else int(place["index"])
    found = RandomInput(
        name, group, place["option"].lower(), entry, index, place["tan"] is not None, what["law"].lower(), numbers
    )
    _value_before(found, groups)
    return found


def _numbers(name: str, law: str, text: str) -> tuple[float, ...]:
    words, count = LAWS[law]
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    problem = ""
    if not all(map(math.isfinite, numbers)) or len(numbers) not in ((2, 4) if law == "normal" else (count,)):
        problem = f"expected {law}({words}{'[, low, high]' if law == 'normal' else ''})"
    elif law in ("uniform", "triangular"):
        if not (numbers[0] < numbers[-1] and all(numbers[0] <= number <= numbers[-1] for number in numbers)):
            problem = f"expected {words} in this order"
    elif not numbers[1] > 0 or (law == "lognormal" and not numbers[0] > 0):
        problem = f"expected {words}, above 0" if law == "lognormal" else "expected a standard deviation above 0"
    elif numbers[2:] and not numbers[2] < numbers[3]:
        problem = "expected low below high"
    if problem:
        raise InputError(f"vary {name}: {problem}, found {law}({text})")
    return numbers


def _find(name: str, option: str, groups: Groups) -> tuple[str, int]:
    """The group that a name means: by its `name` (or number), by its kind where there is one, or by both."""
    first, _, rest = name.partition(" ")
    kinds = options_schema()["$defs"]
    if rest and first.lower() in kinds:
        entries = groups.get(first.lower(), [])
        hits = [(first.lower(), i) for i, entry in enumerate(entries) if _is_called(entry, rest.strip())]
        if len(hits) != 1:
            raise InputError(f"vary: there {'is no' if not hits else 'are several'} &{first.lower()} {rest.strip()}")
        return _with_option(hits[0], option, name)
    called = [
        (group, i)
        for group, entries in groups.items()
        for i, entry in enumerate(entries)
        if group in kinds and str(entry.get("name", "")).strip().lower() == name.lower()
    ]
    hits = [(group, i) for group, i in called if option in option_rows(group)]
    if len(hits) > 1:
        hits = [(group, i) for group, i in hits if option in groups[group][i]] or hits
    if len(hits) > 1:
        several = ", ".join(f"{group} {name}.{option}" for group, _ in hits)
        raise InputError(f"vary: {name}.{option} may be one of {several}: name the group, too")
    if hits:
        return hits[0]
    if called:
        return _with_option(called[0], option, name)
    if name.lower() in kinds:
        entries = groups.setdefault(name.lower(), [{}])
        if len(entries) > 1:
            several = ", ".join(str(entry.get("name", entry.get("number", ""))) for entry in entries)
            raise InputError(f"vary: there are {len(entries)} groups &{name.lower()}: name one of them ({several})")
        return _with_option((name.lower(), 0), option, name)
    names = {str(entry["name"]) for entries in groups.values() for entry in entries if "name" in entry}
    hint = did_you_mean(name, sorted(names)) or (f"; names are {', '.join(sorted(names))}" if names else "")
    raise InputError(f"vary: no group of the model has the name {name!r}{hint}")


def _is_called(entry: Mapping[str, Any], name: str) -> bool:
    return name.lower() in (str(entry.get("name", "")).lower(), str(entry.get("number", "")))


def _with_option(hit: tuple[str, int], option: str, name: str) -> tuple[str, int]:
    rows = option_rows(hit[0])
    if option not in rows:
        raise InputError(f"vary {name}.{option}: &{hit[0]} has no {option!r}{name_hint(option, rows)}")
    return hit


def _value_before(one: RandomInput, groups: Groups) -> list[Any]:
    """The values of the option in the model, with None in the place of the number that varies."""
    row, entry = option_rows(one.group)[one.option], groups[one.group][one.entry]
    kind = as_list(row["type"])
    if "array" not in kind:
        if not {"number"} & set(kind):
            raise InputError(f"vary {one.name}: &{one.group} {one.option} is no number that can vary continuously")
        if one.index is not None:
            raise InputError(f"vary {one.name}: &{one.group} {one.option} is one number: leave out the index")
        return [None]
    values = list(as_list(entry.get(one.option, [])))
    if one.index is not None:
        if not 1 <= one.index <= len(values):
            raise InputError(f"vary {one.name}: &{one.group} {one.option} has {len(values)} numbers")
        values[one.index - 1] = None
        return values
    in_time = str(row.get("x-columns", "")).split(", ")[:1] == ["t"] and row.get("minItems") == SEVERAL
    if in_time and len(values) <= SEVERAL:
        return [values[0] if values else 0, None]  # a table of one row: a constant
    raise InputError(
        f"vary {one.name}: &{one.group} {one.option} is a list of {len(values)} numbers: name one, such as "
        f"{one.option}[{min(2, len(values) or 2)}]"
    )


def lay_out(inputs: Sequence[RandomInput], groups: Groups, marks: Placeholders) -> None:
    """Put placeholders into the places of the inputs."""
    for one in inputs:
        formula = f"degrees(atan({one.parameter}))" if one.is_tangent else one.parameter
        mark = marks.mark(formula)
        values = [mark if value is None else value for value in _value_before(one, groups)]
        groups[one.group][one.entry][one.option] = values[0] if len(values) == 1 else values


def correlation_of(given: str | Sequence[str], inputs: Sequence[RandomInput]) -> FloatArray:
    """The correlation matrix of 'a, b = -0.5; …', of the normal scores of the inputs."""
    matrix = np.eye(len(inputs))
    names = [one.name for one in inputs]
    for part in re.split(r"[;\n]", given) if isinstance(given, str) else given:
        if not part.strip():
            continue
        pair, equals, text = part.partition("=")
        words = [word.strip() for word in pair.split(",")]
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not equals or len(words) != 2 or not -1 < value < 1:
            raise InputError(f"correlate: expected 'a, b = -0.5' with a number between -1 and 1, found {shown(part)}")
        for word in words:
            if word not in names:
                raise InputError(f"correlate: {word!r} does not vary; what varies: {', '.join(names)}")
        i, k = map(names.index, words)
        if i == k:
            raise InputError(f"correlate: {words[0]} with itself")
        matrix[i, k] = matrix[k, i] = value
    if float(np.linalg.eigvalsh(matrix).min()) <= 1e-10:
        raise InputError("correlate: no inputs can be correlated like this (the matrix is not positive definite)")
    return matrix


def values_at(scores: FloatArray, inputs: Sequence[RandomInput], correlation: FloatArray) -> FloatArray:
    """Values of the inputs at independent normal scores (n, d)."""
    stats = need("scipy.stats", "reliability", "a distribution")
    related = scores @ np.linalg.cholesky(correlation).T
    columns = []
    for one, column in zip(inputs, related.T, strict=True):
        law = one.distribution
        if one.law == "normal" and len(one.numbers) == 2:
            columns.append(one.numbers[0] + one.numbers[1] * column)
        else:  # the upper tail from above, so that it keeps its digits
            columns.append(np.where(column > 0, law.isf(stats.norm.sf(column)), law.ppf(stats.norm.cdf(column))))
    return np.column_stack(columns)


def sample(
    inputs: Sequence[RandomInput], correlation: FloatArray, runs: int, seed: int, *, independent: bool = False
) -> FloatArray:
    """Values (runs, d) of six digits: a Latin hypercube, or draws that are independent of each other."""
    stats = need("scipy.stats", "reliability", "a sample")
    rng = np.random.default_rng(seed)
    if independent:
        scores = rng.standard_normal((runs, len(inputs)))
    else:
        qmc = need("scipy.stats.qmc", "reliability", "a Latin hypercube")
        # exchanges within columns, so that independent inputs are hardly correlated in a small sample
        hypercube = qmc.LatinHypercube(len(inputs), optimization="random-cd", seed=rng)
        scores = stats.norm.ppf(hypercube.random(runs))
    values = values_at(scores, inputs, correlation)
    return np.array([[float(f"{value:.6g}") for value in row] for row in values])


def check_values(inputs: Sequence[RandomInput], values: FloatArray) -> None:
    """InputError where a run would have a value out of bounds."""
    for row, numbers in enumerate(values, start=1):
        for one, number in zip(inputs, numbers, strict=True):
            kind = as_list(option_rows(one.group)[one.option]["type"])
            if "array" not in kind and (problems := group_problems(one.group, {one.option: one.value(float(number))})):
                raise InputError(
                    f"vary {one.name}: run {row} would have {problems[0]}; bound it: lognormal, uniform, or "
                    "normal(mean, standard deviation, low, high)"
                )
