# SPDX-License-Identifier: MIT
"""How sure a number is: convergence with the numbers of the method, and reliability for inputs that scatter."""

from __future__ import annotations

from .convergence_study import Convergence, convergence
from .reliability_study import Reliability, reliability

__all__ = ["Convergence", "Reliability", "convergence", "reliability"]
