# SPDX-License-Identifier: MIT
"""RockDDA: discontinuous deformation analysis of block systems.

>>> import rockdda
>>> results = rockdda.open("slope.h5")  # doctest: +SKIP
>>> results.frames[-1].displacement.max()  # doctest: +SKIP
"""

from __future__ import annotations

from pathlib import Path as _Path
from types import ModuleType as _Module
from typing import Any as _Any

from . import _old_names
from . import results as _results
from .cutting import Blocks, cut
from .errors import ConvergenceError, InputError, InputWarning, OutputError, Problem, RockddaError
from .model import Model
from .networks import Network, lines
from .results import FIELDS, Contacts, Field, Frame, Results, open
from .simulation import Simulation, run
from .version import __version__

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


def _plot(results: Results, **options: _Any) -> _Any:
    from .plot import plot

    return plot(results, **options)


def _animate(results: Results, output: _Any, **options: _Any) -> _Path:
    from .film import animate

    return animate(results, output, **options)


def _to_vtk(results: Results, path: _Any, **options: _Any) -> _Path:
    from .export import to_vtk

    return to_vtk(results, path, **options)


def __getattr__(name: str) -> _Module:
    """A module under its former name."""
    if name in _old_names.OLD_NAMES:
        return _old_names.replacement(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


_results.OUTPUTS.update(plot=_plot, animate=_animate, to_vtk=_to_vtk)
_old_names.install()
