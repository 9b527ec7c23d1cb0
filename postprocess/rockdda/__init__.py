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
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

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
    "deck", "frames", "groups", "joints", "labelled", "materials", "namelist", "native", "options",
    "program", "stages", "start", "storage", "text",
}  # fmt: skip

__all__ = [
    "FIELDS", "Blocks", "Contacts", "Convergence", "ConvergenceError", "CriticalFactor", "Field", "Frame", "InputError",
    "InputWarning", "Model", "Network", "OutputError", "Problem", "Reliability", "Results", "RockddaError",
    "Simulation", "Stage", "__version__", "convergence", "cut", "factor_of_safety", "lines", "open", "reliability",
    "run",
]  # fmt: skip


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
