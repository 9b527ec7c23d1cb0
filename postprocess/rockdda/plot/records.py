# SPDX-License-Identifier: MIT
"""Records of ground acceleration with their spectra, and pull tests of bolts with the fit of their grout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arrays import AnyArray
from ..records import GRAVITY, Record, husid, response_spectrum, significant_duration
from ..text import plain_text
from ..units import Units
from .style import PALETTE, PAPER_WIDTH, new_axes, nice_ticks, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def record(
    motion: Record, *, damping: float = 0.05, periods: npt.ArrayLike | None = None, gravity: float = GRAVITY,
    units: str | Units | None = None, title: str | None = None,
) -> AnyArray:  # fmt: skip
    """Acceleration, velocity and displacement over time, growth of the Arias intensity, response spectrum.

    The band marks the time in which the Arias intensity grows from 5 to 95 %."""
    import matplotlib.pyplot as plt

    units = Units.parse(units)
    spectrum = response_spectrum(motion, periods, damping)
    with style():
        figure, axes = plt.subplots(
            5, 1, figsize=(PAPER_WIDTH, 8.2), layout="constrained", height_ratios=[3, 3, 3, 3, 4]
        )
        curves = (
            ("acceleration", motion.acceleration, "acceleration"),
            ("velocity", motion.velocity, "speed"),
            ("displacement", motion.displacement, "length"),
            ("Arias intensity", husid(motion, gravity), "speed"),
        )
        for axis, (label, values, dimension), colour in zip(axes[:4], curves, PALETTE[1:5], strict=True):
            if motion.peak > 0:
                axis.axvspan(*significant_duration(motion), color="#EEEEEE", linewidth=0)
            axis.plot(motion.time, values, color=colour, linewidth=0.9)
            axis.set_ylabel(units.label(label, dimension))
            axis.set_xlim(motion.time[0], motion.time[-1])
            axis.label_outer()
            nice_ticks(axis.yaxis, 4)
        axes[3].set_xlabel(units.label("time", "time"))
        axes[3].tick_params(labelbottom=True)
        axes[4].plot(spectrum.period, spectrum.acceleration, color=PALETTE[0])
        axes[4].set_xscale("log")
        axes[4].set_xlim(float(np.min(spectrum.period)), float(np.max(spectrum.period)))
        axes[4].set_ylim(bottom=0)
        axes[4].set_xlabel(units.label("period", "time"))
        axes[4].set_ylabel(units.label("pseudo-acceleration", "acceleration"))
        axes[4].set_title(f"response spectrum, {100 * damping:g} % damping")
        nice_ticks(axes[4].yaxis)
        figure.align_ylabels(axes)
        figure.suptitle(plain_text(motion.name) if title is None else title, x=0.01, ha="left", fontsize=9)
    return axes


def pull_test(fit: Any, *, axes: Axes | None = None, title: str | None = None) -> Axes:
    """Measured points, the fit, where the slip begins and the plateau; points that were left out are hollow.

    `fit` is a `BoltFit` of `analysis.pull_test`."""
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
