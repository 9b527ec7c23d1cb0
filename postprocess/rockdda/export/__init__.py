# SPDX-License-Identifier: MIT
"""Results for other programs: VTK (ParaView, PyVista), CSV, plain text, DXF, xarray, GeoPandas."""

from __future__ import annotations

from .tables import parse_frames, to_csv, to_dxf, to_text
from .tables_of import to_geopandas, to_xarray
from .vtk import to_vtk, to_vtkhdf

__all__ = ["parse_frames", "to_csv", "to_dxf", "to_geopandas", "to_text", "to_vtk", "to_vtkhdf", "to_xarray"]
