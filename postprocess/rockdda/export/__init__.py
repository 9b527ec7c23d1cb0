# SPDX-License-Identifier: MIT
"""Results for other programs: VTK (ParaView, PyVista), tables as CSV, outlines as plain text or DXF."""

from __future__ import annotations

from .common import parse_frames
from .outlines import to_dxf, to_text
from .tables import to_csv
from .vtk import to_vtk

__all__ = ["parse_frames", "to_csv", "to_dxf", "to_text", "to_vtk"]
