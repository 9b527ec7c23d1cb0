# SPDX-License-Identifier: MIT
"""Films of results as files (.mp4, .gif, .html), and the local viewer in the browser."""

from __future__ import annotations

from .recording import animate
from .viewer import Viewer, serve, view

__all__ = ["Viewer", "animate", "serve", "view"]
