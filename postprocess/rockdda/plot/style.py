# SPDX-License-Identifier: MIT
"""Style of pictures: sizes, colours, labels. The colours are distinct with any kind of colour vision."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray
from ..errors import InputError
from ..fields import FIELD_TEXTS
from ..frames import FIELDS
from ..results import Results
from ..text import plain_text
from ..units import Units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

# Okabe and Ito (2008): black, blue, vermilion, green, orange, sky blue, purple, yellow
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7", "#F0E442")
MATERIALS = ("#B8C4CE", "#E69F00", "#56B4E9", "#009E73", "#CC79A7", "#F0E442", "#0072B2", "#D55E00")
STATES = {"open": "#9A9A9A", "sliding": "#D55E00", "locked": "#0072B2"}
BOLT, LINER = "#B3006B", "#1A1A1A"
USE_MAP = "plasma"  # of shares of a strength, 0 to 1
BOUNDARIES = {
    "fixed": "#000000", "roller": "#000000", "moving": "#009E73", "traction": "#D55E00", "viscous": "#0072B2",
    "free_field": "#0072B2",
}  # fmt: skip
COMPRESSION, TENSION = "#0072B2", "#D55E00"
SCALE = "scale"  #: group of what shows the scale beside a map
PAPER_WIDTH = 6.3  # inches: the text width of an A4 page
SEQUENTIAL, DIVERGING = "viridis", "RdBu_r"
DIMENSIONS = {name: dimension for name, (_, _, dimension) in FIELD_TEXTS.items()}  # of fields, for their units
SYMBOLS = {"σx": r"$\sigma_x$", "σy": r"$\sigma_y$", "τxy": r"$\tau_{xy}$"}


@cache
def _settings() -> Any:
    import matplotlib as mpl

    return mpl.rc_params_from_file(Path(__file__).with_name("pictures.mplstyle"), use_default_template=False)


@contextmanager
def style() -> Iterator[None]:
    """matplotlib with the settings of this package."""
    import matplotlib as mpl

    interactive = mpl.is_interactive()
    try:
        with mpl.rc_context(_settings()):
            yield
            interactive = mpl.is_interactive()
    finally:
        mpl.interactive(interactive)  # notebooks turn this on when the first figure is made


def field_words(name: str) -> tuple[str, str]:
    """Text and dimension of a field for a colour bar or an axis."""
    text = FIELDS[name].label.split(" [")[0]
    return SYMBOLS.get(text, text), DIMENSIONS.get(name, "")


def name_axis(axis: Axis, units: Units, text: str, dimension: str, largest: float | None = None) -> None:
    """Label of an axis whose values and limits are there, with the unit in which its numbers are shown."""
    most = float(np.max(np.abs(axis.get_view_interval()))) if largest is None else largest
    factor, unit = units.multiple(dimension, most)
    axis.set_label_text(f"{text} [{unit}]" if unit else text)
    if factor != 1:
        _multiply_ticks(axis, factor)


def _multiply_ticks(axis: Axis, factor: float) -> None:
    """Numbers at the ticks times a power of ten, by which the unit of the label is smaller."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axis.set_minor_formatter(NullFormatter())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value * factor:.6g}".replace("-", "\N{MINUS SIGN}")))


def nice_ticks(axis: Axis, most: int = 5) -> None:
    """Few round ticks; a common power of ten is taken out where no unit does it."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator, ScalarFormatter

    if isinstance(axis.get_major_formatter(), FuncFormatter):
        axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))
        return
    formatter = ScalarFormatter(useMathText=True)
    formatter.set_powerlimits((-3, 4))
    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(formatter)
    axis.get_offset_text().set_fontsize(8)


def limits_of(name: str, values: AnyArray, given: tuple[float, float] | None) -> tuple[float, float, str]:
    """Smallest and largest value of a colour scale, and its colour map: with both signs, zero is white."""
    if not np.size(values):  # no block is there
        values = np.zeros(1)
    low, high = given if given is not None else (float(np.min(values)), float(np.max(values)))
    largest = max(abs(low), abs(high))
    if given is None and low < 0 < high and min(-low, high) > 0.02 * largest:
        return -largest, largest, DIVERGING
    if (
        high - low <= 1e-6 * largest
    ):  # one value, up to rounding and what is shown of it: a scale of some width around it
        margin = 0.5 * largest or 0.5
        low, high = low - margin, high + margin
    if low < 0 < high and math.isclose(-low, high):
        return low, high, DIVERGING
    if given is None and 0 < low < 0.1 * high:
        low = 0.0
    # values of small magnitude are dark, for positive and negative fields
    return low, high, SEQUENTIAL + ("_r" if name.startswith("stress") and high <= 0.02 * largest else "")


def usual_range(values: AnyArray, areas: AnyArray, active: AnyArray | None = None) -> tuple[float, float]:
    """The range of the values (frames, blocks) of a field without those of the outermost 2 % of the area.

    Otherwise one splinter that falls out of sight would take the whole colour scale. In each frame the blocks with
    the smallest and largest values are left out, on each side until they have 2 % of the area; the widest range of all
    frames counts. `active`: blocks that count in each frame, by default all."""
    values = np.atleast_2d(values).astype(float)
    there = np.ones(values.shape, dtype=bool) if active is None else np.atleast_2d(active)
    low, high = np.inf, -np.inf
    for every, of_frame in zip(values, there, strict=True):
        if not of_frame.any():
            continue
        row, weights = every[of_frame], areas[of_frame]
        order = np.argsort(row, kind="stable")
        share = np.cumsum(weights[order]) / weights.sum()
        first = int(np.searchsorted(share, 0.02, side="right"))
        last = int(np.searchsorted(share, 0.98, side="left"))
        low, high = min(low, float(row[order[first]])), max(high, float(row[order[min(last, len(row) - 1)]]))
    return low, high


def colour_range(whole: tuple[float, float], usual: tuple[float, float]) -> tuple[float, float]:
    """The usual range of a field, or the whole one where nothing but rounding is left of it: all else is at rest."""
    return usual if usual[1] - usual[0] > 1e-9 * (whole[1] - whole[0]) else whole


def without_splinters(values: AnyArray, areas: AnyArray, active: AnyArray | None = None) -> AnyArray:
    """The values (frames, blocks) for a colour scale.

    Within their usual range, where the rest would take more than half of the colours for a twenty-fifth of the area."""
    rows = np.atleast_2d(values).astype(float)
    there = rows if active is None else rows[np.atleast_2d(active)]
    if not np.size(there):
        return there
    whole = float(np.min(there)), float(np.max(there))
    low, high = colour_range(whole, usual_range(rows, areas, active))
    return np.clip(there, low, high) if whole[1] - whole[0] > 2 * (high - low) else there


def title_of(results: Results) -> str:
    """The title of a run, of which files without one have their name: with blanks, as a reader writes."""
    return plain_text(results.title).replace("_", " ")


def usual_view(start: AnyArray, shown: AnyArray, offset: AnyArray, areas: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Lower left and upper right of a map: all of the start, and of the frame all that does not take the picture.

    Blocks with the outermost 2 % of the area are out of sight where the rest takes less than half of the sides."""
    low, high = np.nanmin(start, axis=0), np.nanmax(start, axis=0)
    there = np.asarray(np.isfinite(np.add.reduceat(shown, offset[:-1], axis=0)).all(axis=1))
    if not there.any():
        return low, high
    known = np.where(np.isfinite(shown), shown, 0.0)
    for axis in (0, 1):
        least = np.minimum.reduceat(known[:, axis], offset[:-1])
        most = np.maximum.reduceat(known[:, axis], offset[:-1])
        whole = min(low[axis], least[there].min()), max(high[axis], most[there].max())
        usual = usual_range(least, areas, there)[0], usual_range(most, areas, there)[1]
        usual = min(low[axis], usual[0]), max(high[axis], usual[1])
        chosen = usual if whole[1] - whole[0] > 2 * (usual[1] - usual[0]) else whole
        low[axis], high[axis] = chosen
    return low, high


def window_axes(window: Sequence[float], axes: Axes | None = None) -> Axes:
    """Axes that show x0 y0 x1 y1, new ones or those that are given; maps keep limits that are set."""
    x0, y0, x1, y1 = map(float, window)
    if not (np.isfinite(window).all() and x0 < x1 and y0 < y1):
        raise InputError(f"window {x0:g},{y0:g},{x1:g},{y1:g}: expected x0,y0,x1,y1 with x0 < x1 and y0 < y1")
    with style():
        _, axes = new_axes(axes, size_of(x1 - x0, y1 - y0))
    axes.set(xlim=(x0, x1), ylim=(y0, y1))
    return axes


def set_limits(axes: Axes, low: AnyArray, high: AnyArray) -> None:
    """Set the limits of the axes of a map, unless they show a window."""
    if axes.get_autoscalex_on():
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])


def clip_to_window(axes: Axes, window: Sequence[float]) -> None:
    """Cut off what lies outside of the window, but for the scale beside it; symbols may stand out of whole pictures."""
    axes.set(xlim=window[::2], ylim=window[1::2])
    for artist in axes.get_children():
        if artist.get_gid() != SCALE and artist.get_transform().contains_branch(axes.transData):
            artist.set_clip_on(True)
    for text in axes.texts:
        if text.get_gid() != SCALE:
            text.set(annotation_clip=True)


def size_of(width: float, height: float, extra_right: float = 1.1, extra_top: float = 0.75) -> tuple[float, float]:
    """Size in inches of a figure that holds a map of this shape at equal scales, and what stands around it."""
    inner = PAPER_WIDTH - extra_right
    tall = inner * height / max(width, 1e-300)
    return PAPER_WIDTH, min(max(tall, 1.2), 7.0) + extra_top


def new_axes(axes: Axes | None, size: tuple[float, float]) -> tuple[Figure, Axes]:
    """The given axes, or those of a new figure."""
    import matplotlib.pyplot as plt

    if axes is not None:
        figure = axes.get_figure()
        assert figure is not None
        return figure.get_figure(root=True) if hasattr(figure, "get_figure") else figure, axes  # type: ignore[return-value]
    return plt.subplots(figsize=size, layout="constrained")


def new_panels(axes: Any, height: float, ratios: Sequence[float]) -> AnyArray:
    """The given axes, or panels below each other with these heights and one axis across."""
    import matplotlib.pyplot as plt

    if axes is not None:
        return np.asarray(axes)
    size = (PAPER_WIDTH, height)
    return np.asarray(
        plt.subplots(len(ratios), figsize=size, sharex=True, layout="constrained", height_ratios=ratios)[1]
    )


def add_strokes(axes: Axes, lines: Any, **options: Any) -> LineCollection:
    """Add lines, each of some points, which do not move the limits of the axes."""
    from matplotlib.collections import LineCollection

    strokes = LineCollection(list(lines), **options)
    axes.add_collection(strokes, autolim=False)
    return strokes
