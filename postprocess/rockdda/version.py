# SPDX-License-Identifier: MIT
"""The version of the installed package."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("rockdda")
except PackageNotFoundError:  # used from the source folder
    __version__ = "not installed"
