# SPDX-License-Identifier: MIT
"""The functions behind `Results.plot`, `.animate` and `.to_vtk`.

The package `rockdda` enters them when it is imported, so that the module of the results imports nothing of the packages
that draw and export.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

OUTPUTS: dict[str, Callable[..., Any]] = {}
