# SPDX-License-Identifier: MIT
"""A pull test of a bolt and the fit of its grout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..text import plain_text
from .style import PALETTE, PAPER_WIDTH, new_axes, nice_ticks, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def pull_test(fit: Any, *, axes: Axes | None = None, title: str | None = None) -> Axes:
    """Measured points, the fit, where the slip begins and the plateau; points that were left out are hollow.

    `fit` is a `BoltFit` of `analysis.pull_test`.
    """
    test = fit.test
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 3.6))
        used = fit.used
        moved = 1e3 * test.displacement
        shown = np.linspace(0.0, float(test.displacement.max()), 400)
        axes.axhspan(
            (fit.plateau - fit.length * fit.grout_strength_error) / 1e3,
            (fit.plateau + fit.length * fit.grout_strength_error) / 1e3,
            color="#E6EBF0",
            linewidth=0,
        )
        axes.axhline(fit.plateau / 1e3, color="#8899AA", linewidth=0.8, label=f"all slips, {fit.plateau / 1e3:.4g} kN")
        axes.plot(moved[used], test.force[used] / 1e3, "o", color=PALETTE[0], markersize=3, label="measured")
        if not used.all():
            axes.plot(
                moved[~used], test.force[~used] / 1e3, "o", markersize=3, markerfacecolor="none", color=PALETTE[0],
                label="left out",
            )  # fmt: skip
        axes.plot(1e3 * shown, fit.force_at(shown) / 1e3, color=PALETTE[1], linewidth=1.4, label="fit")
        onset, force = fit.onset
        axes.plot(
            1e3 * onset, force / 1e3, "D", color=PALETTE[1], markersize=5, label=f"slip begins, {force / 1e3:.4g} kN"
        )
        axes.set_xlabel("displacement of the head [mm]")
        axes.set_ylabel("force [kN]")
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
        nice_ticks(axes.xaxis)
        nice_ticks(axes.yaxis)
        axes.legend(loc="lower right")
        stiffness = f"grout stiffness {fit.grout_stiffness / 1e6:.4g} ± {fit.grout_stiffness_error / 1e6:.2g} MN/m²"
        strength = f"strength {fit.grout_strength / 1e3:.4g} ± {fit.grout_strength_error / 1e3:.2g} kN/m"
        axes.set_title(plain_text(title) if title is not None else f"{stiffness}, {strength}")
    return axes
