# SPDX-License-Identifier: MIT
"""The functions behind `Results.plot`, `.animate` and `.to_vtk`, whose packages are loaded when they are called: the
module of the results imports nothing that draws or exports."""

from importlib import import_module
from typing import Any

_HOMES = {"plot": "plot", "slider": "plot", "draw_search": "plot", "animate": "film"}
_HOMES |= dict.fromkeys(("to_vtk", "to_xarray", "to_geopandas"), "export")


def output(name: str, *given: Any, **options: Any) -> Any:
    """Call a function that draws or exports."""
    return getattr(import_module(f".{_HOMES[name]}", __package__), name)(*given, **options)
