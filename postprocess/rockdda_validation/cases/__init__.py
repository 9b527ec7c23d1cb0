# SPDX-License-Identifier: MIT
"""The cases, a module for each section. Each module has a list `CASES`."""
