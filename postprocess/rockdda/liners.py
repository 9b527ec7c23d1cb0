# SPDX-License-Identifier: MIT
"""Sections of linings: what they bear of axial force and moment together, and how much of it acts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["crack_limit", "cracked_limit", "plastic_limit", "share_of_strength", "sound_limit"]

FloatArray = npt.NDArray[np.float64]
SMALL = 1e-3  # of the largest axial force that a section bears: smaller forces do not break a cracked section


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


def share_of_strength(
    force: npt.ArrayLike, moment: npt.ArrayLike, is_cracked: npt.ArrayLike,
    thickness: npt.ArrayLike, compression: npt.ArrayLike, tension: npt.ArrayLike,
) -> FloatArray:  # fmt: skip
    """Share of the limit that axial force (tension positive) and moment use, if both grow alike; all of one shape.

    The limit of a sound section is the wider one of `sound_limit` and `cracked_limit`, that of a cracked one
    `cracked_limit`: above 1 it crushes. Infinite where a cracked section is pulled or its force lies beyond its edge
    (forces below a thousandth of the strength count as none); not a number where it has no strength.
    """
    n, m = -np.asarray(force, dtype=float), np.abs(np.asarray(moment, dtype=float))
    t, fc, ft = (np.asarray(value, dtype=float) for value in (thickness, compression, tension))
    with np.errstate(divide="ignore", invalid="ignore"):
        pulled, pressed = 6 * m / t**2 - n / t, 6 * m / t**2 + n / t  # stresses at both edges of a sound section
        depth = 3 * (0.5 * t - m / n)  # of the part of a cracked section that is pressed
        open_stress = np.where((n > 0) & (depth > 0), np.where(depth < t, 2 * n / depth, pressed), np.inf)
        cracked = np.where(np.isfinite(fc), open_stress / fc, np.nan)
        sound = np.fmax(np.where(np.isfinite(fc), pressed / fc, np.nan), np.where(np.isfinite(ft), pulled / ft, np.nan))
        share = np.where(np.asarray(is_cracked), cracked, np.fmin(sound, cracked))
        # without tensile strength it does not crack
        share = np.where(np.isfinite(ft) | np.asarray(is_cracked), share, sound)
        nothing = np.maximum(np.abs(n), m / t) <= SMALL * np.where(np.isfinite(fc), fc, ft) * t
    return np.where(nothing & np.isinf(share), 0.0, np.maximum(share, 0.0))
