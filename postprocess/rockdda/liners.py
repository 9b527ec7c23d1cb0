# SPDX-License-Identifier: MIT
"""Sections of linings: what they bear of axial force and moment together."""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray


def sound_limit(thickness: float, compression: float, tension: float) -> tuple[FloatArray, FloatArray]:
    """Compression and largest moment of a section at its first crack or crushing; empty without strengths."""
    if not np.isfinite(compression * tension):
        return np.zeros(0), np.zeros(0)
    corner = 0.5 * (compression - tension) * thickness
    n = np.array([-tension * thickness, corner, compression * thickness])
    return n, np.array([0.0, (compression + tension) * thickness**2 / 12, 0.0])


def cracked_limit(thickness: float, compression: float, tension: float) -> tuple[FloatArray, FloatArray]:
    """The same of a section without tension, at its first crushing."""
    if not np.isfinite(compression):
        return np.zeros(0), np.zeros(0)
    depth = np.linspace(0, thickness, 41)
    n = 0.5 * compression * depth
    return np.append(n, compression * thickness), np.append(n * (0.5 * thickness - depth / 3), 0.0)


def crack_limit(thickness: float, compression: float, tension: float) -> tuple[FloatArray, FloatArray]:
    """Compression and moment at which a section cracks: elastic, and beyond the corner of `sound_limit` with a part at
    the compressive strength; empty without strengths."""
    if not np.isfinite(compression * tension):
        return np.zeros(0), np.zeros(0)
    elastic = np.linspace(thickness, 0.0, 41)  # depth of the elastic part, from -compression to tension
    crushed = thickness - elastic
    n = compression * crushed + 0.5 * (compression - tension) * elastic
    m = 0.5 * compression * crushed * elastic + elastic * (
        (compression + tension) * elastic / 12 - 0.25 * (compression - tension) * crushed
    )
    return np.insert(n, 0, -tension * thickness), np.insert(m, 0, 0.0)


def plastic_limit(thickness: float, compression: float) -> tuple[FloatArray, FloatArray]:
    """Compression and largest moment of a section without tension: all that is pressed at the strength."""
    if not np.isfinite(compression):
        return np.zeros(0), np.zeros(0)
    n = compression * np.linspace(0, thickness, 41)
    return n, 0.5 * n * (thickness - n / compression)
