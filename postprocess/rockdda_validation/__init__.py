# SPDX-License-Identifier: MIT
"""Validation: cases that run models and compare them with closed forms, independent solutions and published values.

A case is a function in a module of `rockdda_validation.cases` whose module has a list `CASES`. It gets a `Record`, into
which it puts comparisons, figures, tables and words; `rockdda-post validate` runs cases and writes the report.
"""

from __future__ import annotations

from .case import Case, Comparison, Record, published
from .registry import all_cases

__all__ = ["Case", "Comparison", "Record", "all_cases", "published"]
