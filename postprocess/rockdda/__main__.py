# SPDX-License-Identifier: MIT
"""`python -m rockdda` is `rockdda-post`."""

from .cli.command import run

run()
