# SPDX-License-Identifier: MIT
"""Pictures of the search of a critical factor: the mechanism of failure, and the trials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, FloatArray
from ..critical import NAMES, UNITS, CriticalFactor, read_search
from ..errors import InputError
from ..results import Results
from ..units import Units
from .block_maps import add_blocks, add_outline, add_rest, frame_axes
from .style import PAPER_WIDTH, name_axis, new_axes, nice_ticks, style, title_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOTIONS = {"sliding": "#E69F00", "toppling": "#56B4E9", "fall": "#CC79A7"}
STABLE, FAILING = "#0072B2", "#D55E00"
LONGEST = 0.1  # of the arrows, as a share of the model's extent
SHORTEST = 0.03  # share of the longest arrow below which there is none: no more than a point
FEW = 40  # arrows, of more some are left out
GRID = 0.06  # side of the squares that have one arrow each, as a share of the model's extent
AXIS = {"strength": "factor", "tilt": "tilt", "push": "push α", "gravity": "gravity factor", "load": "load factor"}
FLOOR = 1e-12  # of displacements on a logarithmic axis, as a share of the largest


def mechanism(
    results: Results, frame: int = -1, *, axes: Axes | None = None, scale: float | None = None,
    units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """How the model fails: the blocks that move, coloured by their motion, and arrows of their displacement.

    results: a file of `rockdda fos -o`, whose first frame is the settled state. Displacements count from it. `scale` is
    the factor on the arrows' length; by default the longest is a tenth of the model."""
    from matplotlib.patches import Patch

    found, units = read_search(results), Units.parse(units, results)
    now, settled = results.frames[frame], results.frames[0]
    motion = dict(zip(found.mechanism.blocks, found.mechanism.kinds, strict=True))
    colours = [MOTIONS[motion[i]] if i in motion else "#F0F1F2" for i in range(results.n_blocks)]
    moved = now.centroid - settled.centroid
    length = np.where(now.active, np.hypot(*moved.T), 0.0)
    length[[i for i in range(results.n_blocks) if i not in motion]] = 0.0
    extent = float(np.ptp(results.vertices, axis=0).max())
    largest = float(length.max())
    if scale is None:
        scale = LONGEST * extent / largest if largest > 0 else 1.0
    with style():
        shown = now.shown_vertices
        axes = frame_axes(results, now, shown, axes, units, title)
        add_blocks(axes, shown, results.vertex_offset, facecolors=colours, edgecolors="#8A8A8A", linewidths=0.4)
        if largest > 0.002 * extent:
            _outline_of(axes, results, settled.vertices, sorted(motion))
        drawn = _thinned(np.flatnonzero(length > SHORTEST * largest), now.centroid, extent)
        if len(drawn):
            arrows = axes.quiver(
                *now.centroid[drawn].T, *(scale * moved[drawn]).T, angles="xy", scale_units="xy", scale=1,
                color="#222222", width=0.003, headwidth=4, headlength=4.5, headaxislength=4, zorder=4,
                clip_on=False,
            )  # fmt: skip
            arrows.set_in_layout(False)  # unclipped, its extent would be without bounds
        add_rest(axes, results, now, shown)
        kinds = [kind for kind in MOTIONS if kind in motion.values()]
        count = {kind: list(motion.values()).count(kind) for kind in kinds}
        handles = [Patch(facecolor=MOTIONS[kind], edgecolor="#8A8A8A", lw=0.4) for kind in kinds]
        handles.append(Patch(facecolor="#F0F1F2", edgecolor="#8A8A8A", lw=0.4))
        labels = [f"{kind} ({count[kind]})" for kind in kinds] + [f"at rest ({results.n_blocks - len(motion)})"]
        axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1))
        if title is None:
            value = f"{NAMES[found.search]} {found.value:.4g}{UNITS.get(found.search, '')}: {found.mechanism.kind}"
            axes.set_title(", ".join(part for part in (title_of(results), value) if part))
    return axes


def _thinned(blocks: AnyArray, centroid: FloatArray, extent: float) -> AnyArray:
    """Of many blocks the first one in each square of a grid, so that arrows do not hide one another."""
    if len(blocks) <= FEW:
        return blocks
    squares = np.floor(centroid[blocks] / (GRID * extent)).astype(int)
    _, first = np.unique(squares, axis=0, return_index=True)
    return blocks[np.sort(first)]


def _outline_of(axes: Axes, results: Results, vertices: FloatArray, blocks: list[int]) -> None:
    """Dashed outlines of some blocks where they were."""
    offset = results.vertex_offset
    parts = [vertices[offset[i] : offset[i + 1]] for i in blocks]
    if parts:
        ends = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
        add_outline(axes, np.concatenate(parts), ends, zorder=3.5)


def factor(
    results: Results, *, axes: Axes | None = None, units: str | Units | None = None, title: str | None = None
) -> Axes:
    """The search of a critical factor: displacement of every trial over the value that was tried, and the bracket."""
    return draw_trials(read_search(results), axes=axes, units=units, title=title)


def draw_trials(
    found: CriticalFactor, *, axes: Axes | None = None, units: str | Units | None = None, title: str | None = None
) -> Axes:
    """As `factor`, of a search that need not have a results file."""
    units = Units.parse(units, found.results)
    values = np.array([trial.value for trial in found.trials])
    stable = np.array([trial.stable for trial in found.trials])
    largest = max((trial.displacement for trial in found.trials), default=0.0) or 1.0
    moved = np.maximum([trial.displacement for trial in found.trials], FLOOR * largest)
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 3.0))
        axes.axvspan(found.low, found.high, color="#E4E4E4", lw=0, zorder=0)
        axes.axvline(found.value, color="#8A8A8A", lw=0.8, zorder=1)
        for chosen, colour, marker, label in ((stable, STABLE, "o", "stable"), (~stable, FAILING, "X", "fails")):
            axes.plot(values[chosen], moved[chosen], marker, color=colour, markersize=5, label=label, zorder=3)
        for number, (value, far) in enumerate(zip(values, moved, strict=True), start=1):
            axes.annotate(
                str(number), (value, far), xytext=(4, 3), textcoords="offset points", fontsize=7, color="#555555"
            )
        axes.set_yscale("log")
        axes.margins(x=0.08, y=0.12)
        unit = UNITS.get(found.search, "")
        axes.set_xlabel(AXIS[found.search] + (f" [{unit}]" if unit else ""))
        name_axis(axes.yaxis, units, "largest displacement", "length")
        axes.grid(color="#EFEFEF", lw=0.5)
        nice_ticks(axes.xaxis)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.03))
        axes.set_title(str(found) if title is None else title)
    return axes


def draw_search(found: CriticalFactor, kind: str, **options: Any) -> Axes:
    """Draw the 'mechanism' or the 'factor' of a search."""
    if kind == "factor":
        return draw_trials(found, **options)
    if kind != "mechanism":
        raise InputError(f"there is no picture {kind!r} of a search; there are: mechanism, factor")
    if found.results is None:
        raise InputError("the mechanism is drawn from results: search with output='FILE.h5'")
    return mechanism(found.results, **options)
