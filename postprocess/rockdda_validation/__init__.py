# SPDX-License-Identifier: MIT
"""Validation: cases that run models and compare them with closed forms, independent solutions and published values.

A case is a function in a module of `rockdda_validation.cases` whose module has a list `CASES`. It gets a `Record`, into
which it puts comparisons, figures, tables and words; `rockdda-post validate` runs cases and writes the report.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .case import Case, Comparison, Record, published
    from .registry import all_cases

__all__ = ["Case", "Comparison", "Record", "all_cases", "published"]


def __getattr__(name: str) -> Any:
    """The names above, whose modules are loaded when they are used: the help of the command takes none of them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(".registry" if name == "all_cases" else ".case", __name__), name)
