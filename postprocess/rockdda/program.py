# SPDX-License-Identifier: MIT
"""Where the program `rockdda` is."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from .errors import RockddaError

__all__ = ["find_program"]


def find_program() -> str:
    """The program `rockdda`: $ROCKDDA_PROGRAM, beside this Python, or on the PATH."""
    for candidate in (os.environ.get("ROCKDDA_PROGRAM"), str(Path(sys.executable).parent / "rockdda")):
        if candidate and Path(candidate).is_file():
            return candidate
    found = shutil.which("rockdda")
    if found is None:
        raise RockddaError("the program rockdda was not found on the PATH")
    return found
