# SPDX-License-Identifier: MIT
"""What notebooks show of models and results: a few facts and a drawing, as HTML that needs nothing else."""

from __future__ import annotations

import html
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .arrays import AnyArray, BoolArray, FloatArray
from .text import readable

WIDTH = 340.0  # pixels of a drawing
MOST = 5000  # shapes that are drawn
EDGE, FILL, FIXED = "#333333", "#dde3e8", "#000000"


def facts_table(facts: Iterable[tuple[str, Any]]) -> str:
    """Names and values as rows of a table; empty values are left out."""
    rows = (
        f'<tr><th style="text-align:left;padding:1px 12px 1px 0;font-weight:600">{html.escape(name)}</th>'
        f'<td style="text-align:left;padding:1px 0">{html.escape(readable(str(value)))}</td></tr>'
        for name, value in facts
        if value not in ("", None)
    )
    return f'<table style="border-collapse:collapse">{"".join(rows)}</table>'


def card(title: str, facts: Iterable[tuple[str, Any]], drawing: str = "") -> str:
    """A title, a table of facts and a drawing side by side."""
    left = f'<div style="font-weight:700;margin-bottom:4px">{html.escape(readable(title))}</div>{facts_table(facts)}'
    return f'<div style="display:flex;gap:24px;flex-wrap:wrap;align-items:flex-start"><div>{left}</div>{drawing}</div>'


def drawing_of_blocks(vertices: FloatArray, offset: AnyArray, active: BoolArray) -> str:
    """The blocks that are there as an SVG; nothing where they are too many to be seen."""
    if not 0 < active.sum() <= MOST:
        return ""
    shown = vertices[np.repeat(active, np.diff(offset))]
    place, size = _frame(shown)
    at = place(vertices)
    paths = [
        "M" + "L".join(f"{x:.1f},{y:.1f}" for x, y in at[offset[i] : offset[i + 1]].tolist()) + "Z"
        for i in np.flatnonzero(active)
    ]
    return _svg(f'<path d="{"".join(paths)}" fill="{FILL}" stroke="{EDGE}" stroke-width="0.6"/>', size)


def drawing_of_lines(lines: FloatArray, points: Sequence[tuple[float, ...]] = ()) -> str:
    """Lines (n, 4) x1 y1 x2 y2 as an SVG, and points as triangles."""
    if not 0 < len(lines) <= MOST:
        return ""
    marks = np.array([point[:2] for point in points], dtype=float).reshape(-1, 2)
    place, size = _frame(np.concatenate([lines.reshape(-1, 2), marks]))
    ends = place(lines.reshape(-1, 2)).reshape(-1, 4)
    path = "".join(f"M{x1:.1f},{y1:.1f}L{x2:.1f},{y2:.1f}" for x1, y1, x2, y2 in ends.tolist())
    drawn = f'<path d="{path}" fill="none" stroke="{EDGE}" stroke-width="0.8"/>'
    for x, y in place(marks).tolist():
        drawn += f'<path d="M{x:.1f},{y - 3:.1f}l-3,6h6Z" fill="#ffffff" stroke="{FIXED}" stroke-width="0.8"/>'
    return _svg(drawn, size)


def _frame(points: FloatArray) -> Any:
    """A function from lengths to pixels of a drawing of these points, and the size of the drawing."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = np.maximum(high - low, 1e-12 * max(float(np.abs(points).max()), 1e-300))
    scale = min((WIDTH - 12) / float(extent[0]), 260 / float(extent[1]))
    size = (float(extent[0]) * scale + 12, float(extent[1]) * scale + 12)
    return lambda at: np.column_stack([6 + (at[:, 0] - low[0]) * scale, 6 + (high[1] - at[:, 1]) * scale]), size


def _svg(content: str, size: tuple[float, float]) -> str:
    width, height = size
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.1f} {height:.1f}" style="background:#ffffff">{content}</svg>'
    )


def in_notebook() -> bool:
    """Does the code run in a notebook, which shows HTML and replaces it?"""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


class NotebookBar:
    """A bar of progress under the cell that runs, which needs no other package."""

    def __init__(self, title: str) -> None:
        from IPython.display import HTML, display  # a notebook has it

        self._html, self.title = HTML, title
        self._handle = display(HTML(self.text(0.0, "")), display_id=True)

    def text(self, fraction: float, where: str) -> str:
        """The bar."""
        bar = f'<progress value="{min(max(fraction, 0.0), 1.0):.4f}" max="1" style="width:240px"></progress>'
        return f"<div>{html.escape(readable(self.title))} {bar} {100 * fraction:.0f} % {html.escape(where)}</div>"

    def show(self, fraction: float, step: int, time: float) -> None:
        """Show how far the run has come."""
        self._handle.update(self._html(self.text(fraction, f"step {step}, time {time:g}")))
