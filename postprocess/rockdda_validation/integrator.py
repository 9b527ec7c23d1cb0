# SPDX-License-Identifier: MIT
"""Decay and frequency of an oscillator under Newmark's integrator with β = 1/2, γ = 1, and their fit to a motion.

One step takes the displacement x and the velocity v of ẍ = -ω² x to x + d and 2 d/dt - v, where
(2/dt² + ω²) d = 2 v/dt - ω² x. With Ω = ω dt the matrix of a step has the trace (4 - Ω²)/(2 + Ω²) and the determinant
2/(2 + Ω²): amplitudes fall by (1 + Ω²/2)^(-1/2) a step as long as Ω < 4; beyond, both roots are real and negative.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
import numpy.typing as npt

__all__ = [
    "fit_recurrence", "fit_roots", "generalized_alpha_roots", "numerical_decay", "numerical_frequency", "roots_of_step",
]  # fmt: skip


def roots_of_step(omega_dt: float) -> tuple[complex, complex]:
    """Both roots of a step, the one of larger modulus (or positive phase) first."""
    square = omega_dt**2
    half = (4 - square) / (2 + square) / 2
    root = cmath.sqrt(half**2 - 2 / (2 + square))
    first, second = half + root, half - root
    return (first, second) if abs(first) >= abs(second) else (second, first)


def numerical_decay(omega_dt: float) -> float:
    """Factor of the amplitude in a step."""
    return abs(roots_of_step(omega_dt)[0])


def numerical_frequency(omega_dt: float) -> float:
    """Phase of a step over Ω: numerical over true frequency. Only for Ω < 4."""
    return abs(cmath.phase(roots_of_step(omega_dt)[0])) / omega_dt


def fit_recurrence(motion: npt.NDArray[np.float64]) -> tuple[complex, complex]:
    """Both roots of the recurrence x(n+1) = a x(n) + b x(n-1) that fits a motion best; the larger one first."""
    x = np.asarray(motion, dtype=float)
    (a, b), *_ = np.linalg.lstsq(np.column_stack([x[1:-1], x[:-2]]), x[2:], rcond=None)
    root = cmath.sqrt(a * a / 4 + b)
    first, second = a / 2 + root, a / 2 - root
    if math.isclose(abs(first), abs(second)):
        return (first, second) if first.imag >= 0 else (second, first)
    return (first, second) if abs(first) > abs(second) else (second, first)


def generalized_alpha_roots(omega_dt: float, rho: float) -> npt.NDArray[np.complex128]:
    """The three roots of a step of Chung and Hulbert's scheme (1993) on ẍ = -ω² x, the largest first.

    From its equations as published, for (x, v dt, a dt²): Newmark's updates with β and γ, and (1 - α_m) a1 + α_m a0 +
    ω² ((1 - α_f) x1 + α_f x0) = 0.
    """
    m, f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    beta, gamma, square = (1 - m + f) ** 2 / 4, 0.5 - m + f, omega_dt**2
    after = np.array([[1, 0, -beta], [0, 1, -gamma], [(1 - f) * square, 0, 1 - m]])
    before = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma], [-f * square, 0, -m]])
    roots = np.linalg.eigvals(np.linalg.solve(after, before)).astype(complex)
    return np.asarray(roots[np.argsort(-np.abs(roots))])


def fit_roots(motion: npt.NDArray[np.float64], order: int = 3) -> npt.NDArray[np.complex128]:
    """Roots of the recurrence of this order that fits a motion best, the largest first."""
    x = np.asarray(motion, dtype=float)
    n = len(x) - order
    rows = np.column_stack([x[order - 1 - k : order - 1 - k + n] for k in range(order)])
    scale = 1 / np.abs(rows).max(axis=1)  # a motion that dies away counts to its end
    factors, *_ = np.linalg.lstsq(rows * scale[:, None], x[order:] * scale)
    roots = np.roots([1.0, *-factors]).astype(complex)
    return np.asarray(roots[np.argsort(-np.abs(roots))])
