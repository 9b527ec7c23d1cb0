# SPDX-License-Identifier: MIT
"""A surface of second degree through the factors of some runs, and how well it fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..arrays import FloatArray

#: Surfaces from the simplest to the one with most terms.
KINDS = ("linear", "quadratic", "quadratic with cross terms")
SPARE = 1.5  # runs for each term
BETTER = 0.9  # a surface of more terms must have less than this share of the error of the simpler one


@dataclass(frozen=True)
class Surrogate:
    """A polynomial of the standardised inputs, z = (x - mean)/standard deviation."""

    kind: str
    mean: FloatArray
    deviation: FloatArray
    coefficients: FloatArray
    spread: FloatArray  #: (k, k) so that its product with k normal numbers is an error of the coefficients over σ
    left_out: FloatArray  #: factor of each run by the surface through all others
    error: float  #: root mean square of what these miss
    explained: float  #: share of the variance of the factors that they give, Q²; below 1, may be negative
    freedom: int  #: runs less terms

    def terms(self, values: FloatArray) -> FloatArray:
        """Terms of the polynomial (n, k) at values (n, d)."""
        return _terms((values - self.mean) / self.deviation, self.kind)

    def __call__(self, values: FloatArray) -> FloatArray:
        """Factors at values (n, d)."""
        return self.terms(values) @ self.coefficients


def n_terms(kind: str, d: int) -> int:
    """Terms of a surface of d inputs."""
    return {"linear": d + 1, "quadratic": 2 * d + 1}.get(kind, (d + 1) * (d + 2) // 2)


def least_runs(d: int) -> int:
    """Runs that the simplest surface takes."""
    return int(np.ceil(SPARE * n_terms(KINDS[0], d)))


def fitting_kinds(runs: int, d: int) -> list[str]:
    """Surfaces for which there are enough runs."""
    return [kind for kind in KINDS if runs >= SPARE * n_terms(kind, d) and (d > 1 or kind != KINDS[2])]


def _terms(z: FloatArray, kind: str) -> FloatArray:
    columns = [np.ones(len(z)), *z.T]
    if kind != KINDS[0]:
        columns += [column**2 for column in z.T]
    if kind == KINDS[2]:
        columns += [z[:, i] * z[:, k] for i, k in combinations(range(z.shape[1]), 2)]
    return np.column_stack(columns)


def fit(values: FloatArray, factors: FloatArray, mean: FloatArray, deviation: FloatArray) -> Surrogate | None:
    """The surface with the least error at runs that are left out; of two that are as good the simpler one.

    None where there are too few runs."""
    kinds = fitting_kinds(*values.shape)
    found: Surrogate | None = None
    for kind in kinds:
        one = _fit(kind, values, factors, mean, deviation)
        if one is not None and (found is None or one.error < BETTER * found.error):
            found = one
    return found


def _fit(
    kind: str, values: FloatArray, factors: FloatArray, mean: FloatArray, deviation: FloatArray
) -> Surrogate | None:
    terms = _terms((values - mean) / deviation, kind)
    if np.linalg.matrix_rank(terms) < terms.shape[1]:
        return None
    q, r = np.linalg.qr(terms)
    coefficients = np.linalg.solve(r, q.T @ factors)
    leverage = np.minimum(np.sum(q**2, axis=1), 1 - 1e-9)
    missed = (factors - terms @ coefficients) / (1 - leverage)
    error = float(np.sqrt(np.mean(missed**2)))
    variance = float(np.var(factors))
    return Surrogate(
        kind, mean, deviation, coefficients, np.linalg.inv(r), factors - missed, error,
        1 - error**2 / variance if variance > 0 else 0.0, len(factors) - terms.shape[1],
    )  # fmt: skip


def drawn_coefficients(surrogate: Surrogate, noise: float, count: int, rng: np.random.Generator) -> FloatArray:
    """Coefficients (k, count) as they might be, by what the surface misses; the first term has the error of the
    surface as a whole, too. noise: least error of a factor."""
    sigma = max(surrogate.error, noise)
    k = len(surrogate.coefficients)
    scale = sigma * np.sqrt(surrogate.freedom / rng.chisquare(max(surrogate.freedom, 1), count))
    moved = surrogate.spread @ rng.standard_normal((k, count))
    moved[0] += rng.standard_normal(count)
    return surrogate.coefficients[:, None] + scale * moved


def mechanisms(kinds: Sequence[str]) -> dict[str, int]:
    """How many runs fail in each way, the most frequent first."""
    counts = {kind: list(kinds).count(kind) for kind in dict.fromkeys(kinds) if kind}
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
