# SPDX-License-Identifier: MIT
"""Pairs of inputs that give a factor: back-analysis of a failure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import FloatArray
from .failure import most_likely, shares_of_variance
from .random_inputs import RandomInput, values_at
from .surrogate import Surrogate

PLACES = 41  # of the first input, from its smallest to its largest value in the runs
FINE = 400  # of the second one


@dataclass(frozen=True)
class BackAnalysis:
    """The line of pairs of two inputs that give a factor."""

    factor: float
    names: tuple[str, str]
    pairs: FloatArray  #: (n, 2) where the others have their means
    pairs_at_likely: FloatArray  #: (n, 2) where they have their most likely values; none with two inputs
    error: float  #: of the factor along the line
    likely: dict[str, float]  #: of all inputs, the most likely values that give the factor

    def as_json(self) -> dict[str, Any]:
        """For an answer in JSON."""
        return {
            "factor": self.factor,
            "names": list(self.names),
            "pairs": self.pairs.tolist(),
            "pairs_at_likely": self.pairs_at_likely.tolist(),
            "error": self.error,
            "most_likely": self.likely,
        }


def back_analysis(
    surface: Surrogate, inputs: Sequence[RandomInput], correlation: FloatArray, values: FloatArray, factor: float
) -> BackAnalysis:
    """The line for the two inputs that matter most, within the values of the runs."""
    shares = shares_of_variance(surface, inputs, correlation)
    ranked = sorted(range(len(inputs)), key=lambda i: -shares[inputs[i].name])[:2]
    first, second = sorted(ranked)
    scores = most_likely(surface, inputs, correlation, factor)
    names, likely, moved = [one.name for one in inputs], {}, np.zeros((0, 2))
    if scores is not None:
        point = values_at(scores[None, :], inputs, correlation)[0]
        likely = dict(zip(names, point.tolist(), strict=True))
        if len(inputs) > 2:
            moved = line_of(surface, values, first, second, factor, point)
    pairs = line_of(surface, values, first, second, factor, surface.mean)
    return BackAnalysis(factor, (names[first], names[second]), pairs, moved, surface.error, likely)


def line_of(
    surface: Surrogate, values: FloatArray, first: int, second: int, factor: float, others: FloatArray
) -> FloatArray:
    """Pairs (n, 2) where the surface has the factor, within the range of the runs; the other inputs are fixed."""
    low, high = values.min(axis=0), values.max(axis=0)
    along, across = np.linspace(low[first], high[first], PLACES), np.linspace(low[second], high[second], FINE)
    pairs = []
    for place in along:
        points = np.tile(others, (FINE, 1))
        points[:, first], points[:, second] = place, across
        over = surface(points) - factor
        for k in np.flatnonzero(over[:-1] * over[1:] <= 0):
            step = over[k] - over[k + 1]
            share = over[k] / step if step else 0.0
            pairs.append((float(place), float(across[k] + share * (across[k + 1] - across[k]))))
    return np.array(pairs).reshape(-1, 2)
