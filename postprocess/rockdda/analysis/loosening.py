# SPDX-License-Identifier: MIT
"""Height of loosened rock above an opening, from the vertical displacements of points on one vertical line.

Two criteria of stable arching are looked at (section 7.1.3 of the thesis named in docs/theory.md):

*Equilibrium.* A point that is held oscillates about a constant displacement; one that is not keeps sinking. Over the
last part of the run (`window`, two thirds) a straight line is fitted to the displacement in time. Its rise or fall over
the window is the *drift*; the range of the remainder is the *oscillation*. A point is in equilibrium when the drift is
not larger than the oscillation. There is nothing to be chosen but the window, which must hold at least one period of
the oscillation: for a sine this ratio is at most 1 at one period, at any phase, and below with more. In a shorter
window an oscillation resembles a trend; run longer then.

*Homogeneous profile.* Rock that arches moves together. The *gradient* of two neighbouring points is the change of the
displacement at the end of the run over their distance; they move together when it is below `gradient_limit` (0.005:
the largest gradient of the profiles that it calls homogeneous, section 7.2.1).

The rock between two neighbouring points counts as loosened when the lower point is not in equilibrium or when the
gradient between them is not below the limit. The *loosening height* is the height of the upper point of the highest
such pair above the lowest point (the crown): the rock above it arches, the true height is at most as large. It is 0
when the crown itself is stable and infinite when the highest point is not in equilibrium.

A history shorter than the window, a share of the time that the run was to cover (`planned_time`), shows neither: it
is refused. That is so when steps were cut again and again and the run did its number of steps in little time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arrays import BoolArray, FloatArray
from ..errors import InputError
from ..fields import GRADIENT_LIMIT, WINDOW
from ..results import Results

__all__ = ["GRADIENT_LIMIT", "WINDOW", "Loosening", "height_label", "loosening", "loosening_of"]


_SAMPLES = 2001  # of the window: steps need not be equally long


@dataclass(frozen=True)
class Loosening:
    """The profile above an opening. Arrays go from the crown upwards."""

    heights: FloatArray  #: (n,) above the crown [length]
    displacement: FloatArray  #: (n,) vertical, at the end of the run, up positive [length]
    gradient: FloatArray  #: (n - 1,) of each point and the next one above; positive: the rock opens
    drift: FloatArray  #: (n,) of the fitted line over the window [length]
    oscillation: FloatArray  #: (n,) range of the remainder [length]
    equilibrium: BoolArray  #: (n,) first criterion
    homogeneous: BoolArray  #: (n - 1,) second criterion

    @property
    def height_by_equilibrium(self) -> float:
        """Loosening height by the first criterion alone."""
        moving = np.flatnonzero(~self.equilibrium)
        if not moving.size:
            return 0.0
        above = int(moving[-1]) + 1
        return float(self.heights[above]) if above < self.heights.size else math.inf

    @property
    def height_by_profile(self) -> float:
        """Loosening height by the second criterion alone."""
        apart = np.flatnonzero(~self.homogeneous)
        return float(self.heights[int(apart[-1]) + 1]) if apart.size else 0.0

    @property
    def height(self) -> float:
        """Loosening height [length]: both criteria hold above it."""
        return max(self.height_by_equilibrium, self.height_by_profile)

    def table(self) -> dict[str, list[Any]]:
        """Columns, a row a point; gradient and homogeneous are towards the next point above, None for the highest."""
        return {
            "heights": self.heights.tolist(),
            "displacement": self.displacement.tolist(),
            "gradient": [*self.gradient.tolist(), None],
            "equilibrium": self.equilibrium.tolist(),
            "homogeneous": [*self.homogeneous.tolist(), None],
        }


def loosening(
    time: npt.ArrayLike, displacement: npt.ArrayLike, heights: npt.ArrayLike, *, window: float = WINDOW,
    gradient_limit: float = GRADIENT_LIMIT, planned_time: float | None = None,
) -> Loosening:  # fmt: skip
    """The two criteria for `displacement` (steps, points), vertical and positive upwards, of points at `heights`.

    `window`: the share of the run, at its end, in which oscillations are looked at. `planned_time`: the time that the
    run was to cover; by default the last of `time`. A history shorter than the window of it is refused."""
    times = np.asarray(time, dtype=np.float64)
    moved = np.asarray(displacement, dtype=np.float64)
    levels = np.asarray(heights, dtype=np.float64)
    if times.ndim != 1 or moved.shape != (times.size, levels.size) or levels.ndim != 1:
        raise InputError(
            f"expected times (steps,), displacements (steps, points) and heights (points,), "
            f"found the shapes {times.shape}, {moved.shape}, {levels.shape}"
        )
    if levels.size < 2 or times.size < 3:
        raise InputError(f"at least 2 points and 3 steps are needed, found {levels.size} and {times.size}")
    if not (np.isfinite(times).all() and np.isfinite(moved).all() and np.isfinite(levels).all()):
        raise InputError("times, displacements and heights must be finite")
    if (np.diff(times) <= 0).any():
        raise InputError("times must increase")
    if not 0 < window <= 1:
        raise InputError(f"window: must be above 0 and at most 1, found {window}")
    if not gradient_limit > 0:
        raise InputError(f"gradient_limit: must be above 0, found {gradient_limit}")
    plan = float(times[-1]) if planned_time is None else float(planned_time)
    # the first row is the end of a step, which the history covers too
    covered = float(times[-1] - max(0.0, times[0] - np.diff(times).max()))
    if plan * window > covered * (1 + 1e-9):
        raise InputError(
            f"the history covers a time of {covered:g}, the window is {window:.3g} of the planned {plan:g}: "
            "too short to judge equilibrium; run longer (the log of the run says why its steps were short)"
        )
    order = np.argsort(levels, kind="stable")
    levels, moved = levels[order], moved[:, order]
    if (np.diff(levels) <= 0).any():
        raise InputError("two points have the same height")

    start = max(times[0], times[-1] * (1 - window))
    span = times[-1] - start
    share = np.linspace(-0.5, 0.5, _SAMPLES)  # of the window, about its middle
    looked_at = np.stack([np.interp(start + (share + 0.5) * span, times, column) for column in moved.T], axis=1)
    drift = share @ looked_at / (share @ share)
    rest = looked_at - share[:, None] * drift
    oscillation = rest.max(axis=0) - rest.min(axis=0)
    gradient = np.diff(moved[-1]) / np.diff(levels)
    return Loosening(
        heights=levels - levels[0], displacement=moved[-1], gradient=gradient, drift=drift, oscillation=oscillation,
        equilibrium=np.abs(drift) <= oscillation, homogeneous=np.abs(gradient) < gradient_limit,
    )  # fmt: skip


def loosening_of(results: Results, *, window: float = WINDOW, gradient_limit: float = GRADIENT_LIMIT) -> Loosening:
    """The same for the measured points of a run; they must lie on one vertical line, the lowest at the crown."""
    points = results.measured_points
    if len(points) < 2:
        raise InputError(f"at least 2 measured points are needed, found {len(points)}")
    apart = float(np.ptp(points[:, 0]))
    if apart > 1e-6 * float(np.ptp(points[:, 1])):
        raise InputError(f"the measured points must lie on one vertical line; their x differ by {apart:g}")
    planned = float(results.attributes.get("planned_time", 0.0))  # 0: how long the stages take is not known before
    return loosening(
        results["history/time"], results["history/measured_displacement"][:, :, 1], points[:, 1], window=window,
        gradient_limit=gradient_limit, planned_time=planned or None,
    )  # fmt: skip


def height_label(height: float, tunnel_height: float) -> str:
    """A loosening height over the height of the tunnel, as in the thesis's tables: 'Stable', '< 0.45', '> all'."""
    if height == 0:
        return "Stable"
    return f"< {height / tunnel_height:.3g}" if math.isfinite(height) else "> all"
