# SPDX-License-Identifier: MIT
"""The command `rockdda-post`."""

from __future__ import annotations

from .command import app, main, run
from .common import BAD_INPUT, DIFFERENT, DONE, INTERNAL, NO_CONVERGENCE, NO_OUTPUT, STOPPED

__all__ = ["BAD_INPUT", "DIFFERENT", "DONE", "INTERNAL", "NO_CONVERGENCE", "NO_OUTPUT", "STOPPED", "app", "main", "run"]
