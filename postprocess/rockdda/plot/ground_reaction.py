# SPDX-License-Identifier: MIT
"""Ground reaction: how far the ground has moved when a share of the forces of excavated blocks is released."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, FloatArray
from ..errors import InputError
from ..results import Results
from ..text import plain_text
from ..units import Units
from .style import PALETTE, PAPER_WIDTH, name_axis, new_axes, nice_ticks, style, title_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes


def ground_reaction_data(results: Results, stage: str | None = None) -> tuple[FloatArray, FloatArray, AnyArray]:
    """(n,) released shares, (n, points) convergence of the measured points [length], (n,) rows that end a stage.

    The rows are those from the end of the stage before the excavation on: of the first excavation, or of the one in
    the stage of this name, up to the next one. The convergence of a point is its displacement since then in the
    direction in which it has moved at the end."""
    if "history/relaxation" not in results:
        raise InputError("there are no stages in it: the file was written by an older version", results.path)
    share, index = results["history/relaxation"], results["history/stage"]
    moved = results["history/measured_displacement"]
    names = [name.strip().lower() for name in results.stage_names]
    digs = _stages_with(results, lambda stage: bool(str(stage.get("excavate", "")).strip()))
    begins = [k for k in range(len(names)) if (share[index == k] > 0).any() and _is_new(share, index, k, digs)]
    if not begins:
        raise InputError("no stage has released forces of excavated blocks", results.path)
    if stage is not None and stage.strip().lower() not in names:
        raise InputError(f"there is no stage {stage!r}; the stages are: {', '.join(results.stage_names)}", results.path)
    first = begins[0] if stage is None else names.index(stage.strip().lower())
    if first not in begins:
        raise InputError(f"stage {stage!r} excavates nothing", results.path)
    if not moved.shape[1]:
        raise InputError("there is no measured point in it: convergence needs one", results.path)
    later = [k for k in begins if k > first]
    rows = np.flatnonzero((index >= first) & (index < (later[0] if later else len(names))))
    way = _way(results, rows)
    length = np.hypot(way[-1, :, 0], way[-1, :, 1])
    direction = way[-1] / np.where(length > 0, length, 1.0)[:, None]
    convergence = np.concatenate([np.zeros((1, moved.shape[1])), (way * direction).sum(axis=2)])
    ends = np.concatenate([[True], np.diff(index[rows]) > 0, [True]])
    # forces are never held again; older files fall to 0 with the first stage that excavates nothing
    released = np.maximum.accumulate(share[rows])
    return np.concatenate([[0.0], released]), convergence, np.flatnonzero(ends)


def _is_new(share: FloatArray, index: AnyArray, stage: int, digs: set[int]) -> bool:
    """Does the share begin in this stage: at less than it was before, or with an excavation?"""
    rows = np.flatnonzero(index == stage)
    before = share[rows[0] - 1] if rows[0] > 0 else 0.0
    return bool(before == 0 or share[rows[0]] < before or stage in digs)


def _stages_with(results: Results, holds: Callable[[dict[str, Any]], bool]) -> set[int]:
    """Indices of the stages of the input for which something holds."""
    return {k for k, stage in enumerate(results.input_groups.get("stage", [])) if holds(stage)}


def _way(results: Results, rows: AnyArray) -> FloatArray:
    """(n, points, 2) displacements of the measured points since the row before the first, across stages that let them
    count anew."""
    moved, index = results["history/measured_displacement"], results["history/stage"]
    resets = _stages_with(results, lambda stage: stage.get("reset_displacement") is True)
    way = np.zeros((len(rows), *moved.shape[1:]))
    last, before = np.zeros_like(moved[0]), np.zeros_like(moved[0])
    for k, row in enumerate(rows):
        new_stage = row == 0 or index[row] != index[row - 1]
        if row > 0 and not (new_stage and int(index[row]) in resets):
            before = moved[row - 1]
        else:
            before = np.zeros_like(moved[0])
        last = last + (moved[row] - before)
        way[k] = last
    return way


def ground_reaction(
    results: Results, stage: str | None = None, *, axes: Axes | None = None, units: str | Units | None = None,
    title: str | None = None,
) -> Axes:  # fmt: skip
    """Released share of the forces of excavated blocks over the convergence of the measured points.

    `stage` names the excavation (by default the first one); dots mark the ends of stages. Points on excavated blocks
    are left out."""
    units = Units.parse(units, results)
    share, convergence, ends = ground_reaction_data(results, stage)
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 2.9))
        moves = np.abs(convergence).max(axis=0) > 0
        for i, number in enumerate(results.point_numbers("measured")):
            if not moves[i] and moves.any():  # on a block that is no more
                continue
            colour = PALETTE[i % len(PALETTE)]
            axes.plot(convergence[:, i], share, color=colour, label=f"point {number}")
            axes.plot(convergence[ends, i], share[ends], "o", color=colour, markersize=3.5)
        axes.set_ylabel("relaxation")
        axes.set_ylim(0, 1.05)
        axes.set_xlim(left=min(0.0, float(convergence.min())))
        name_axis(axes.xaxis, units, "convergence", "length")
        nice_ticks(axes.xaxis)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1))
        axes.set_title(title_of(results) if title is None else title)
    return axes


def reaction_picture(found: Any, *, title: str | None = None) -> Any:
    """Ground reaction and support characteristic with their crossing, over the convergence; the axes of two panels.

    `found` is a `Reaction` of `analysis.reaction`; the second panel shows the part from the placing of the lining on.
    """
    import matplotlib.pyplot as plt

    units = found.units
    factor, unit = units.multiple("length", float(np.abs(found.ground[:, 0]).max()))
    with style():
        figure, (whole, near) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 3.3), layout="constrained")
        for axes in (whole, near):
            _draw_reaction(axes, found, factor)
            axes.set_xlabel(f"convergence of point {found.point}{f' [{unit}]' if unit else ''}")
        whole.set_ylim(0, 105)
        whole.set_xlim(left=0)
        whole.set_ylabel(f"pressure / {units.text(found.ground_pressure, 'stress', 3)} in the ground [%]")
        most = 100 * max(float(found.support[:, 1].max()), found.crossing[1] if found.crossing else 0.0)
        begin, end = factor * float(found.support[0, 0]), factor * float(found.ground[-1, 0])
        end = max(end, factor * float(found.support[-1, 0]))
        near.set_xlim(begin - 0.08 * (end - begin), end + 0.08 * (end - begin))
        near.set_ylim(0, 1.5 * most if most > 0 else 1.0)
        figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        whole.set_title(plain_text(found.title) if title is None else title)
        near.set_title("from the placing of the lining on")
    return np.array([whole, near])


def _draw_reaction(axes: Axes, found: Any, factor: float) -> None:
    """Both curves, the end of the run with support, and the crossing."""
    ground, support = (curve * [factor, 100] for curve in (found.ground, found.support))
    axes.plot(*ground.T, "o-", color=PALETTE[0], markersize=3, label="ground, without support")
    axes.plot(*support.T, "-", color=PALETTE[1], linewidth=2, label=f"{found.liner}: mean N over the radius")
    axes.plot(*support[-1], "s", color=PALETTE[1], markersize=5, label="end of the run with support")
    if found.crossing is not None:
        u, p = factor * found.crossing[0], 100 * found.crossing[1]
        if u > support[-1, 0]:
            axes.plot([support[-1, 0], u], [support[-1, 1], p], ":", color=PALETTE[1])
        axes.plot(u, p, "D", color=PALETTE[2], markersize=5, markerfacecolor="none", label="crossing")
