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

__all__ = ["fit_recurrence", "numerical_decay", "numerical_frequency", "roots_of_step"]


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
