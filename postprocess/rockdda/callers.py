# SPDX-License-Identifier: MIT
"""The place in the user's code that a warning names."""

from __future__ import annotations

import os
import sys


def stack_level() -> int:
    """The `stacklevel` at which `warnings.warn`, in the function that calls this, names code outside this package."""
    folder = os.path.dirname(__file__)  # noqa: PTH120
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(folder):
        frame = frame.f_back
        level += 1
    return level
