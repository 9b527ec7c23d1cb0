# SPDX-License-Identifier: MIT
"""Bolts and linings in films of pictures: where they are, coloured by how much of their strength they use."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..plot.block_maps import add_lines
from ..plot.style import BOLT, DIVERGING, LINER, USE_MAP
from ..units import Units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection

    from ..columns import Columns
    from ..frames import Frame
    from ..results import Results

LINER_FIELDS = ("use", "N", "M", "Q")


class Support:
    """The bolts and linings of a film, which move from frame to frame."""

    def __init__(self, results: Results, frames: list[int], units: Units, scale: float, liner: str) -> None:
        if liner not in LINER_FIELDS:
            raise InputError(f"linings are coloured by {', '.join(LINER_FIELDS)}, not by {liner!r}")
        self.scale, self.field, self.most = scale, liner, 0.0
        self.start, now = results.frames[0], [results.frames[index] for index in frames]
        #: scales of colours: map, lowest and highest value, label
        self.bars: list[tuple[str, float, float, str]] = []
        if liner != "use" and self.start.liner_pieces.n_rows:
            self.most = max(float(np.abs(one.moved_pieces("liner")[liner]).max(initial=0.0)) for one in now)
            factor, unit = units.of_section(liner, self.most)
            words = f"linings: {liner} [{unit}]" if unit else f"linings: {liner}"
            self.bars.append((DIVERGING, -factor * self.most, factor * self.most, words))
        coloured = {"bolts": "bolt"} | ({"linings": "liner"} if liner == "use" else {})
        used = [
            name
            for name, what in coloured.items()
            if any(np.isfinite(one.moved_pieces(what)["use"]).any() for one in now)
        ]
        if used:
            self.bars.append((USE_MAP, 0.0, 100.0, f"{', '.join(used)}: share of a strength [%]"))

    def add(self, axes: Axes) -> None:
        """Add them, and the scales of their colours."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        self.liners = add_lines(axes, self.start.liner_pieces, LINER, 2.4)
        for rim in self.liners[:1]:
            rim.set_color(LINER)  # zero is white
        self.bolts = add_lines(axes, self.start.bolt_pieces, BOLT)
        for colours, low, high, label in self.bars:
            mappable = ScalarMappable(Normalize(low, high if high > low else low + 1), colours)
            axes.figure.colorbar(mappable, ax=axes, label=label, shrink=0.6)

    def move(self, now: Frame) -> None:
        """Draw them as they are in a frame."""
        if self.bolts:
            _move(self.bolts, now.moved_pieces("bolt", self.scale), "use", BOLT, USE_MAP, (0.0, 1.0))
        if self.liners:
            shown = (USE_MAP, (0.0, 1.0)) if self.field == "use" else (DIVERGING, (-self.most, self.most))
            _move(self.liners, now.moved_pieces("liner", self.scale), self.field, LINER, *shown)


def _move(
    drawn: list[LineCollection], pieces: Columns, field: str, plain: str, colours: str, limits: tuple[float, float]
) -> None:
    """Pieces where they are, in the colours of a value where it is known."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgba

    for lines in drawn:
        lines.set_segments(list(pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)))
    low, high = limits
    share: Any = (pieces[field] - low) / (high - low if high > low else 1.0)
    found = ~np.isnan(share)
    shown: Any = np.where(found[:, None], colormaps[colours](np.clip(np.nan_to_num(share), 0, 1)), to_rgba(plain))
    drawn[-1].set_color(shown)
