# SPDX-License-Identifier: MIT
"""Parts of a model's drawing: lines, bolts, and places with values in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .errors import InputError

Table = npt.ArrayLike  # (m, 3) rows t x y


@dataclass
class Line:
    """A line of a geometry with its material."""

    ends: tuple[float, float, float, float]
    number: int | str  # joint or block material, or its name
    boundary: bool = False


@dataclass
class Bolt:
    """A bolt between two points."""

    ends: tuple[float, float, float, float]
    stiffness: float
    pretension: float
    strength: float


@dataclass
class Place:
    """A fixed line or a loading point with its values in time."""

    ends: tuple[float, ...]
    table: FloatArray


def time_table(rows: Table) -> FloatArray:
    """Values in time as an array (m, 3)."""
    table = np.asarray(rows, dtype=float)
    if table.size == 0:
        return np.zeros((0, 3))
    if table.ndim != 2 or table.shape[1] != 3:
        raise InputError(f"table: expected an array of shape (m, 3), rows t x y, found {table.shape}")
    return table
