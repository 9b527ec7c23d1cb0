# SPDX-License-Identifier: MIT
"""RockDDA: discontinuous deformation analysis of block systems.

>>> import rockdda
>>> results = rockdda.open("slope.h5")  # doctest: +SKIP
>>> results.frames[-1].displacement.max()  # doctest: +SKIP
"""

from __future__ import annotations

from .errors import ConvergenceError, InputError, OutputError, Problem, RockddaError
from .results import FIELDS, Contacts, Field, Frame, Results, open

__all__ = [
    "FIELDS",
    "Contacts",
    "ConvergenceError",
    "Field",
    "Frame",
    "InputError",
    "OutputError",
    "Problem",
    "Results",
    "RockddaError",
    "open",
]
