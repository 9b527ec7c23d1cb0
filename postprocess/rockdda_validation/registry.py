# SPDX-License-Identifier: MIT
"""The list of all validation cases."""

from __future__ import annotations

import importlib
import pkgutil
import re

from rockdda.errors import RockddaError

from . import cases
from .case import Case

__all__ = ["all_cases"]


def all_cases() -> list[Case]:
    """All cases in the order of the report: chapters before what goes beyond them, then by identifier."""
    found: list[Case] = []
    for module in sorted(pkgutil.iter_modules(cases.__path__), key=lambda m: m.name):
        found += importlib.import_module(f"{cases.__name__}.{module.name}").CASES
    identifiers = [case.identifier for case in found]
    if len(set(identifiers)) < len(identifiers):
        raise RockddaError(f"validation cases have the same identifier: {sorted(identifiers)}")
    return sorted(found, key=lambda case: (not case.part.startswith("Chapter"), _natural(case.identifier)))


def _natural(text: str) -> list[tuple[int, str]]:
    """To sort by: numbers in a text by their size."""
    return [(int(piece), "") if piece.isdigit() else (-1, piece) for piece in re.split(r"(\d+)", text)]
