# SPDX-License-Identifier: MIT
"""Where the program `rockdda` is."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from pathlib import Path

from .errors import Problem, RockddaError

__all__ = ["errors_in", "find_program"]


def errors_in(answer: str) -> list[Problem]:
    """The errors in an answer of the program in JSON; none where it is none, as after a crash."""
    with contextlib.suppress(ValueError, AttributeError, KeyError, TypeError):
        return [
            Problem(str(one["message"]), one.get("file"), one.get("line"), one.get("column"))
            for one in json.loads(answer).get("messages", [])
            if one.get("severity") == "error"
        ]
    return []


def find_program() -> str:
    """The program `rockdda`: $ROCKDDA_PROGRAM, beside this Python, or on the PATH."""
    for candidate in (os.environ.get("ROCKDDA_PROGRAM"), str(Path(sys.executable).parent / "rockdda")):
        if candidate and Path(candidate).is_file():
            return candidate
    found = shutil.which("rockdda")
    if found is None:
        raise RockddaError("the program rockdda was not found on the PATH")
    return found
