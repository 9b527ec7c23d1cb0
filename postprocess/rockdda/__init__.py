# SPDX-License-Identifier: MIT
"""RockDDA: discontinuous deformation analysis of block systems.

Example:
    >>> import rockdda
    >>> results = rockdda.open("slope.h5")  # doctest: +SKIP
    >>> results.frames[-1].displacement.max()  # doctest: +SKIP

The import is quick: modules, and NumPy and h5py with them, are loaded when a name of them is first used.
"""

from __future__ import annotations

import importlib as _importlib
from pathlib import Path as _Path
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

from .outputs import OUTPUTS as _OUTPUTS

if _TYPE_CHECKING:
    from .certainty import Convergence, Reliability, convergence, reliability
    from .critical import CriticalFactor, factor_of_safety
    from .cutting import Blocks, cut
    from .errors import ConvergenceError, InputError, InputWarning, OutputError, Problem, RockddaError
    from .model import Model
    from .networks import Network, lines
    from .results import FIELDS, Contacts, Field, Frame, Results, Stage, open
    from .simulation import Simulation, run
    from .version import __version__

#: Module of each public name.
_HOMES = {
    "Convergence": "certainty", "Reliability": "certainty", "convergence": "certainty", "reliability": "certainty",
    "CriticalFactor": "critical", "factor_of_safety": "critical",
    "Blocks": "cutting", "cut": "cutting",
    "ConvergenceError": "errors", "InputError": "errors", "InputWarning": "errors", "OutputError": "errors",
    "Problem": "errors", "RockddaError": "errors",
    "Model": "model",
    "Network": "networks", "lines": "networks",
    "FIELDS": "results", "Contacts": "results", "Field": "results", "Frame": "results", "Results": "results",
    "Stage": "results", "open": "results",
    "Simulation": "simulation", "run": "simulation",
    "__version__": "version",
}  # fmt: skip
#: Modules that can be used as attributes without an import of their own.
_MODULES = frozenset(_HOMES.values()) | {
    "callers", "deck", "frames", "groups", "joints", "labelled", "materials", "namelist", "native", "options",
    "program", "stages", "start", "storage", "text",
}  # fmt: skip

__all__ = [
    "FIELDS",
    "Blocks",
    "Contacts",
    "Convergence",
    "ConvergenceError",
    "CriticalFactor",
    "Field",
    "Frame",
    "InputError",
    "InputWarning",
    "Model",
    "Network",
    "OutputError",
    "Problem",
    "Reliability",
    "Results",
    "RockddaError",
    "Simulation",
    "Stage",
    "__version__",
    "convergence",
    "cut",
    "factor_of_safety",
    "lines",
    "open",
    "reliability",
    "run",
]


def _plot(results: _Any, **options: _Any) -> _Any:
    from .plot import plot

    return plot(results, **options)


def _animate(results: _Any, output: _Any, **options: _Any) -> _Path:
    from .film import animate

    return animate(results, output, **options)


def _to_vtk(results: _Any, path: _Any, **options: _Any) -> _Path:
    from .export import to_vtk

    return to_vtk(results, path, **options)


def _slider(results: _Any, field: str, **options: _Any) -> _Any:
    from .plot import slider

    return slider(results, field, **options)


def _to_xarray(results: _Any, contacts: bool) -> _Any:
    from .export import to_xarray

    return to_xarray(results, contacts)


def _to_geopandas(results: _Any, what: str, frame: int, **options: _Any) -> _Any:
    from .export import to_geopandas

    return to_geopandas(results, what, frame, **options)


def _draw_search(found: _Any, kind: str, **options: _Any) -> _Any:
    from .plot import draw_search

    return draw_search(found, kind, **options)


def __getattr__(name: str) -> _Any:
    """A public name or a module, when it is first used."""
    if name in _HOMES:
        value = getattr(_importlib.import_module(f".{_HOMES[name]}", __name__), name)
        globals()[name] = value
        return value
    if name in _MODULES:
        return _importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})


_OUTPUTS.update(plot=_plot, animate=_animate, to_vtk=_to_vtk, search=_draw_search)
_OUTPUTS.update(slider=_slider, to_xarray=_to_xarray, to_geopandas=_to_geopandas)
