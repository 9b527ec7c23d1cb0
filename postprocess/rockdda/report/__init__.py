# SPDX-License-Identifier: MIT
"""One file that an engineer can hand in: the model, what happened, and checks, as a page (.html) or on A4 (.pdf)."""

from __future__ import annotations

from .page import Cover, report

__all__ = ["Cover", "report"]
