# SPDX-License-Identifier: MIT
"""Films of results as files (.mp4, .gif, .html), and the local viewer in the browser."""

from __future__ import annotations

from .recording import animate
from .server import serve, view
from .viewer import Viewer

__all__ = ["Viewer", "animate", "serve", "view"]
