# SPDX-License-Identifier: MIT
"""Small vibrations about an equilibrium, exactly and as the time integration damps them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["block_mass", "damped", "modes", "steps_to_rest", "undamped"]

FloatArray = npt.NDArray[np.float64]


def block_mass(density: float, width: float, height: float) -> FloatArray:
    """(6, 6) mass matrix of a rectangle about its centroid, unknowns u0, v0, r0, εx, εy, γxy."""
    m, a, b = density * width * height, width**2 / 12, height**2 / 12
    mass = np.diag([m, m, m * (a + b), m * a, m * b, m * (a + b) / 4])
    mass[2, 5] = mass[5, 2] = m * (a - b) / 2
    return mass


def modes(stiffness: FloatArray, mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Circular frequencies, the smallest first, and shapes (columns) with shapesᵀ M shapes = 1."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    return np.sqrt(squares), inverse.T @ vectors


def damped(frequencies: FloatArray, parts: FloatArray, k01: float, steps: int, time_step: float) -> FloatArray:
    """Sum of modes after each step, from the theory of the time integration; `parts` are their parts at the start.

    Newmark with β = ½, γ = 1, on x'' = -ω² x: x1 = 2 (x0 + v0 Δt)/(2 + Ω²), v1 Δt = 2 (x1 - x0) - v0 Δt; the next step
    starts with k01 v1.
    """
    squares = (frequencies * time_step) ** 2
    x, v, out = parts.copy(), np.zeros_like(parts), np.empty(steps)
    for n in range(steps):
        following = 2 * (x + v) / (2 + squares)
        v = k01 * (2 * (following - x) - v)
        x = following
        out[n] = x.sum()
    return out


def undamped(frequencies: FloatArray, parts: FloatArray, times: FloatArray) -> FloatArray:
    """Sum of modes that start at rest, exactly."""
    return np.cos(np.outer(times, frequencies)) @ parts


def steps_to_rest(difference: FloatArray, limit: float) -> int:
    """Number of steps after which the difference from rest stays within `limit`."""
    outside = np.flatnonzero(np.abs(difference) > limit)
    return int(outside[-1]) + 2 if len(outside) else 1
