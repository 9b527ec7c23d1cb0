# SPDX-License-Identifier: MIT
"""Numbers that criteria of `rockdda.analysis` begin with."""

from __future__ import annotations

#: Of loosening: gradient of displacements below which rock moves together, and the share of the planned time at the end
#: of a run in which a point must be in equilibrium.
GRADIENT_LIMIT = 0.005
WINDOW = 2 / 3
