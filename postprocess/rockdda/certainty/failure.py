# SPDX-License-Identifier: MIT
"""Probability of failure by a surface: from many points of it, its nearest failing point, what it depends on, and the
pairs of inputs that give a factor (back-analysis)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..errors import need
from .random_inputs import RandomInput, values_at
from .surrogate import Surrogate, drawn_coefficients

POINTS = 17  # 2^17 of the surface
SOME = 2**14  # of these, the first ones: for each surface as it might be
FEW = 500  # failing ones below which points are drawn round the most likely failure instead
DRAWS = 400  # surfaces as they might be
BINS = 64  # of an input, in which the mean of the factor is taken
FARTHEST = 8.0  # standard deviations of the nearest failing point that is looked for
CONFIDENCE = 0.95
ENDS = (0.5 * (1 - CONFIDENCE), 0.5 * (1 + CONFIDENCE))
NEAR = 0.01  # share of the distance of the most likely failure by which its surface is followed to and fro
SEED = 20_240_229  # of everything that is drawn here: answers are the same each time


@dataclass(frozen=True)
class Failure:
    """What the surface says of failure."""

    probability: float
    interval: tuple[float, float]  #: 95 %, by what the surface misses
    design_point: FloatArray | None  #: the most likely values at which the model fails; None: beyond 8 σ
    distance: float | None  #: of it from the middle, in standard deviations
    distance_interval: tuple[float, float] | None  #: 95 %


def index_of(probability: float) -> float:
    """The reliability index that belongs to a probability."""
    stats = need("scipy.stats", "reliability", "a reliability index")
    return float(-stats.norm.ppf(probability))


def wilson(failed: float, runs: int) -> tuple[float, float]:
    """The 95 % interval of a share that was counted (Wilson 1927)."""
    stats = need("scipy.stats", "reliability", "an interval")
    found = stats.binomtest(round(failed), runs).proportion_ci(CONFIDENCE, method="wilson")
    return float(found.low), float(found.high)


def failure_of(
    surrogate: Surrogate, inputs: Sequence[RandomInput], correlation: FloatArray, limit: float, noise: float
) -> Failure:
    """The probability that the factor is below a limit. noise: least error of a factor, of its search."""
    scores = _scores(len(inputs))
    point = most_likely(surrogate, inputs, correlation, limit)
    weights = np.ones(len(scores))
    values = values_at(scores, inputs, correlation)
    if point is not None and np.count_nonzero(surrogate(values) < limit) < FEW:
        # points round the most likely failure, each as heavy as it is there by chance over how often it is drawn
        weights = np.exp(-scores @ point - 0.5 * point @ point)
        values = values_at(scores + point, inputs, correlation)
    terms = surrogate.terms(values)
    probability = _share(terms @ surrogate.coefficients < limit, weights)
    some = drawn_coefficients(surrogate, noise, DRAWS, np.random.default_rng(SEED))
    terms, weights = terms[:SOME], weights[:SOME]
    shares = [_share(terms @ column < limit, weights) for column in some.T]
    low, high = np.quantile(shares, ENDS) + (probability - _share(terms @ surrogate.coefficients < limit, weights))
    interval = (min(max(float(low), 0.0), probability), max(min(float(high), 1.0), probability))
    if point is None:
        return Failure(probability, interval, None, None, None)
    distance = float(np.linalg.norm(point))
    along = np.outer([1 - NEAR, 1, 1 + NEAR], point)  # where other surfaces fail on the way to the most likely failure
    before, here, behind = surrogate.terms(values_at(along, inputs, correlation)) @ some - limit
    low, high = np.quantile(distance * (1 - 2 * NEAR * here / (behind - before)), ENDS)
    return Failure(
        probability, interval, values_at(point[None, :], inputs, correlation)[0], distance,
        (min(max(float(low), 0.0), distance), max(float(high), distance)),
    )  # fmt: skip


def _share(fails: BoolArray, weights: FloatArray) -> float:
    return float(min(np.sum(weights[fails]) / len(weights), 1.0))


def _scores(d: int) -> FloatArray:
    """Normal scores of points that fill the space evenly (Sobol's sequence, scrambled from one seed)."""
    stats, qmc = (need(name, "reliability", "a sample") for name in ("scipy.stats", "scipy.stats.qmc"))
    drawn = qmc.Sobol(d, scramble=True, seed=np.random.default_rng(SEED)).random_base2(POINTS)
    return np.asarray(stats.norm.ppf(np.clip(drawn, 1e-12, 1 - 1e-12)))


def points_of(inputs: Sequence[RandomInput], correlation: FloatArray) -> FloatArray:
    """Values (n, d) that fill the distributions evenly."""
    return values_at(_scores(len(inputs)), inputs, correlation)


def most_likely(
    surrogate: Callable[[FloatArray], FloatArray], inputs: Sequence[RandomInput], correlation: FloatArray, limit: float
) -> FloatArray | None:
    """The normal scores nearest to the middle at which the factor is the limit (the design point of FORM).

    Several directions are tried: those of the nearest points of either side among some thousand. None: beyond 8
    standard deviations."""
    optimize = need("scipy.optimize", "reliability", "a design point")

    def over(u: FloatArray) -> float:
        return float(surrogate(values_at(np.atleast_2d(u), inputs, correlation))[0] - limit)

    d = len(inputs)
    rng = np.random.default_rng(SEED)
    directions = rng.standard_normal((1000, d))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    middle = over(np.zeros(d)) >= 0
    radii = np.linspace(0.25, FARTHEST, 32)
    starts: list[FloatArray] = []
    for radius in radii:
        values = surrogate(values_at(radius * directions, inputs, correlation))
        crossed = np.flatnonzero((values >= limit) != middle)
        if len(crossed):
            starts = [radius * directions[i] for i in crossed[:5]]
            break
    found = []
    for start in starts:
        answer = optimize.minimize(
            lambda u: float(u @ u), start, jac=lambda u: 2 * u, method="SLSQP",
            constraints=[{"type": "eq", "fun": over}], options={"maxiter": 200, "ftol": 1e-12},
        )  # fmt: skip
        if abs(over(answer.x)) < 1e-6 * max(1.0, abs(limit)) and np.linalg.norm(answer.x) <= FARTHEST:
            found.append(np.asarray(answer.x))
    return min(found, key=lambda u: float(u @ u)) if found else None


def shares_of_variance(
    surrogate: Surrogate, inputs: Sequence[RandomInput], correlation: FloatArray
) -> dict[str, float]:
    """By how much the variance of the factor falls when one input is known, as shares that add up to 1."""
    shares = _shares(surrogate, inputs, correlation, surrogate.coefficients[:, None])[:, 0]
    return {one.name: float(share) for one, share in zip(inputs, shares, strict=True)}


def intervals_of_shares(
    surrogate: Surrogate, inputs: Sequence[RandomInput], correlation: FloatArray, noise: float
) -> dict[str, tuple[float, float]]:
    """95 % intervals of these shares, by the surfaces as they might be."""
    some = drawn_coefficients(surrogate, noise, DRAWS, np.random.default_rng(SEED))
    shares = _shares(surrogate, inputs, correlation, np.column_stack([surrogate.coefficients, some]))
    low, high = np.quantile(shares[:, 1:], ENDS, axis=1)
    ends = zip(inputs, np.minimum(low, shares[:, 0]), np.maximum(high, shares[:, 0]), strict=True)
    return {one.name: (float(first), float(last)) for one, first, last in ends}


def _shares(
    surrogate: Surrogate, inputs: Sequence[RandomInput], correlation: FloatArray, coefficients: FloatArray
) -> FloatArray:
    """Shares (inputs, n) for the surfaces with these coefficients (k, n)."""
    values = points_of(inputs, correlation)
    terms = surrogate.terms(values)
    fallen = []
    for column in values.T:
        order = np.argsort(column, kind="stable")
        means = np.array([terms[part].mean(axis=0) for part in np.array_split(order, BINS)])
        fallen.append(np.var(means @ coefficients, axis=0))
    total = np.sum(fallen, axis=0)
    return np.array(fallen) / np.where(total > 0, total, 1.0)


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
            "factor": self.factor, "names": list(self.names), "pairs": self.pairs.tolist(),
            "pairs_at_likely": self.pairs_at_likely.tolist(), "error": self.error, "most_likely": self.likely,
        }  # fmt: skip


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
