# SPDX-License-Identifier: MIT
"""RockDDA: discontinuous deformation analysis of block systems.

>>> import rockdda
>>> results = rockdda.open("slope.h5")  # doctest: +SKIP
>>> results.frames[-1].displacement.max()  # doctest: +SKIP
"""

from __future__ import annotations

from .cutting import Blocks, cut
from .errors import ConvergenceError, InputError, InputWarning, OutputError, Problem, RockddaError
from .model import Model
from .networks import Network, lines
from .results import FIELDS, Contacts, Field, Frame, Results, open
from .running import Simulation, run

__all__ = [
    "FIELDS",
    "Blocks",
    "Contacts",
    "ConvergenceError",
    "Field",
    "Frame",
    "InputError",
    "InputWarning",
    "Model",
    "Network",
    "OutputError",
    "Problem",
    "Results",
    "RockddaError",
    "Simulation",
    "cut",
    "lines",
    "open",
    "run",
]
