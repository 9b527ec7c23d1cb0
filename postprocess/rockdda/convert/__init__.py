# SPDX-License-Identifier: MIT
"""Input files of other programs to RockDDA's own: DDAML of DDA for Windows, DXF drawings, GeoJSON lines."""

from __future__ import annotations

from .conversion import TEMPLATE_JOINT_STIFFNESS, Conversion, contact_numbers, convert

__all__ = ["TEMPLATE_JOINT_STIFFNESS", "Conversion", "contact_numbers", "convert"]
