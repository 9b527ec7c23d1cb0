# SPDX-License-Identifier: MIT
"""`python -m rockdda` is `rockdda-post`."""

from .cli import run

run()
