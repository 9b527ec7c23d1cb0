# SPDX-License-Identifier: MIT
"""Parameter studies: many runs of one template, described in a TOML file (docs/hpc.md)."""

from __future__ import annotations

from .case import Outcome, pending, prepare_case, run_case
from .definition import Case, Quantity, Study, read_study, render
from .formula import evaluate
from .job_array import write_job_array
from .runner import collect, run_study

__all__ = [
    "Case", "Outcome", "Quantity", "Study", "collect", "evaluate", "pending", "prepare_case", "read_study", "render",
    "run_case", "run_study", "write_job_array",
]  # fmt: skip
