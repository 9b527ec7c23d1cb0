# SPDX-License-Identifier: MIT
"""Input files of other programs to RockDDA's own: DDAML of DDA for Windows, DXF drawings, GeoJSON lines."""

from __future__ import annotations

from .conversion import Conversion, convert
from .template import TEMPLATE_JOINT_STIFFNESS

__all__ = ["TEMPLATE_JOINT_STIFFNESS", "Conversion", "convert"]
