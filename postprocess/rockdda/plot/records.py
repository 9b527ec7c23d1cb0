# SPDX-License-Identifier: MIT
"""A record of ground acceleration: its motion, its Arias intensity and its response spectrum."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arrays import AnyArray
from ..records import GRAVITY, Record, husid, response_spectrum, significant_duration
from ..text import plain_text
from ..units import Units
from .style import PALETTE, PAPER_WIDTH, nice_ticks, style


def record(
    motion: Record,
    *,
    damping: float = 0.05,
    periods: npt.ArrayLike | None = None,
    gravity: float = GRAVITY,
    units: str | Units | None = None,
    title: str | None = None,
) -> AnyArray:
    """Acceleration, velocity and displacement over time, growth of the Arias intensity, response spectrum.

    The band marks the time in which the Arias intensity grows from 5 to 95 %.
    """
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
