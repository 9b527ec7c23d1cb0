# SPDX-License-Identifier: MIT
"""RockDDA: discontinuous deformation analysis of block systems.

>>> import rockdda
>>> results = rockdda.open("slope.h5")  # doctest: +SKIP
>>> results.frames[-1].displacement.max()  # doctest: +SKIP
"""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError as _NotInstalled
from importlib.metadata import version as _installed

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
    "__version__",
    "cut",
    "lines",
    "open",
    "run",
]

try:
    __version__ = _installed("rockdda")
except _NotInstalled:  # used from the source folder
    __version__ = "not installed"
