# SPDX-License-Identifier: MIT
"""Curves: time histories, profiles along a line, the energy ledger, iterations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, FloatArray, IntArray
from ..columns import Columns
from ..errors import InputError
from ..frames import field_name
from ..results import Results
from ..text import plain_text
from ..units import Units, dimension_of
from .style import (
    PALETTE,
    PAPER_WIDTH,
    STATES,
    field_words,
    name_axis,
    new_axes,
    new_panels,
    nice_ticks,
    style,
    title_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1.5, 1, 1.5)))
STORED = ("kinetic", "strain", "gravity", "springs")
CHECKS = ("geometry", "residual")


def _line_style(i: int) -> dict[str, Any]:
    """Colour and dashes of the i-th curve: both change, so that grey prints can be read, too."""
    return {"color": PALETTE[i % len(PALETTE)], "linestyle": DASHES[(i // len(PALETTE) + i) % len(DASHES)]}


def _legend(axes: Axes) -> None:
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.03), handlelength=2.2)


def _time_axis(axes: Axes, units: Units, largest: float, least: float = 0.0) -> None:
    axes.set_xlabel(units.label("time", "time"))
    axes.set_xlim(least, largest if largest > least else least + 1.0)
    axes.grid(color="#E4E4E4", lw=0.5)


def _readable(column: str) -> str:
    """'measured_displacement_1_x' as 'displacement x, point 1'."""
    parts = column.split("_")
    digits = [i for i, part in enumerate(parts) if part.isdigit()]
    if not digits:
        return column.replace("_", " ")
    i = digits[0]
    what = " ".join(parts[1:i] + parts[i + 1 :])
    owner = "support" if parts[0] == "fixed" else "point"
    return f"{what}, {owner} {parts[i]}"


def default_columns(results: Results) -> list[str]:
    """Displacements of the first measured points, or the largest displacement of the steps."""
    numbers = results.point_numbers("measured")[:4]
    return [f"measured_displacement_{i}_{k}" for i in numbers for k in "xy"] or ["max_displacement"]


def _rows(results: Results, stage: str | None) -> Columns:
    """The rows of the history of a stage (None: all)."""
    table = results.history_columns()
    if stage is None:
        return table
    chosen = results.stage(stage)
    rows = np.flatnonzero(table["stage"] == chosen.index) if "stage" in table else np.arange(table.n_rows)
    if not len(rows):
        raise InputError(f"stage {chosen.name!r} has no steps", results.path)
    return table.rows(rows)


def _title(results: Results, stage: str | None, title: str | None) -> str:
    """The title of a picture of a run, or of one of its stages."""
    if title is not None:
        return title
    parts = [title_of(results), "" if stage is None else results.stage(stage).name]
    return plain_text(", ".join(part for part in parts if part))


def _mark_stages(axes: Axes, results: Results, stage: str | None) -> None:
    """Lines where stages end, with their names where there is room: static and dynamic ones share the axis of time."""
    ended = [one for one in results.stages if one.n_steps]
    if stage is not None or len(ended) < 2:
        return
    first, last = axes.get_xlim()
    begin = first
    for one in ended:
        if one is not ended[-1]:
            axes.axvline(one.end, color="#9A9A9A", lw=0.6, ls=(0, (2, 2)), zorder=0.5)
        share = (one.end - begin) / (last - first)
        name = plain_text(one.name)
        if share > 0.016 * len(name):
            axes.text(begin + 0.006 * (last - first), 1.0, name, transform=axes.get_xaxis_transform(), fontsize=7,
                      color="#6E6E6E", va="top")  # fmt: skip
        begin = one.end


def _need_energies(results: Results) -> None:
    """InputError where the run computed no energies."""
    if not results.has_energies:
        raise InputError(
            "there are no energies in it: the energy balance was switched off (&output energy = .false.)", results.path
        )


def history(
    results: Results, columns: Sequence[str] | str | None = None, *, axes: Axes | None = None,
    units: str | Units | None = None, title: str | None = None, stage: str | None = None,
) -> Axes:  # fmt: skip
    """Columns of `results.history()` over time; by default what the measured points did.

    Columns must be of one kind, since they share an axis; `measured_displacement` means all columns that begin so.
    `stage`: of this stage only, from its beginning."""
    units = Units.parse(units, results)
    table = _rows(results, stage)
    known = [name for name in table if name != "step"]
    start = stage is None or results.stage(stage).index == 0  # later stages may begin to count displacements anew
    wanted = [columns] if isinstance(columns, str) else list(columns or default_columns(results))
    chosen: list[str] = []
    for name in wanted:
        found = [c for c in known if c == name] or [c for c in known if c.startswith(f"{name}_")]
        if not found:
            raise InputError(f"there is no column {name!r}; the columns are: {', '.join(known)}")
        chosen += found
    kinds = {dimension_of(name) for name in chosen}
    if "energy" in kinds:
        _need_energies(results)
    if len(kinds) > 1:
        raise InputError(f"columns of different kinds cannot share an axis: {', '.join(chosen)}")
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 2.9))
        time = np.concatenate([[0.0] * start, table["time"]])
        cumulative = kinds == {"length"} and "max_displacement" not in chosen
        for i, name in enumerate(chosen):
            first = 0.0 if cumulative else table[name][0]
            values = np.concatenate([[first] * start, table[name]])
            axes.plot(time, values, label=_readable(name), **_line_style(i))
        _time_axis(axes, units, float(time[-1]), float(time[0]))
        _mark_stages(axes, results, stage)
        what = {_readable(name).split(",")[0].removesuffix(" x").removesuffix(" y") for name in chosen}
        name_axis(axes.yaxis, units, what.pop() if len(what) == 1 else "value", kinds.pop())
        nice_ticks(axes.yaxis)
        _legend(axes)
        axes.set_title(_title(results, stage, title))
    return axes


def profile_data(
    results: Results, field: str, line: Sequence[float], frame: int = -1
) -> tuple[FloatArray, FloatArray, IntArray]:
    """(n,) distances along the line x1 y1 x2 y2, (n,) values there, (n,) blocks; two points for each block it crosses.

    The line is drawn through the blocks at the start. Displacements are those of the points of the line, which move
    with their blocks; other fields have one value for each block. Blocks that are not there in the frame are gaps."""
    start, end = np.array(line[:2], dtype=float), np.array(line[2:], dtype=float)
    length = float(np.hypot(*(end - start)))
    if length == 0 or not np.isfinite(length):
        raise InputError("the ends of the line of a profile must differ")
    now = results.frames[frame]
    pieces = sorted((a, b, i) for i, parts in _crossings(results, start, end) if now.active[i] for a, b in parts)
    distance = np.array([s for a, b, _ in pieces for s in (a, b)])
    owner = np.array([i for _, _, i in pieces for _ in range(2)], dtype=np.int64)
    if not field.startswith("displacement"):
        return distance * length, now.field(field)[owner].astype(float), owner
    points = start + distance[:, None] * (end - start)
    moved = np.empty_like(points)
    offset = results.vertex_offset
    for i in np.unique(owner):
        here = owner == i
        corners = slice(offset[i], offset[i + 1])
        origin = results.block_centroid[i]
        # blocks deform by affine maps: fit it through the corners
        system = np.column_stack([results.vertices[corners] - origin, np.ones(offset[i + 1] - offset[i])])
        matrix = np.linalg.lstsq(system, now.vertices[corners], rcond=None)[0]
        moved[here] = np.column_stack([points[here] - origin, np.ones(here.sum())]) @ matrix
    shift = moved - points
    values = {"displacement_x": shift[:, 0], "displacement_y": shift[:, 1]}.get(field, np.hypot(*shift.T))
    return distance * length, values, owner


def _crossings(results: Results, start: FloatArray, end: FloatArray) -> list[tuple[int, list[tuple[float, float]]]]:
    """For each block that the line crosses at the start: the parts of the line in it, as parameters 0 … 1."""
    along = end - start
    offset, vertices = results.vertex_offset, results.vertices
    relative = vertices - start
    side = along[0] * relative[:, 1] - along[1] * relative[:, 0]
    place = relative @ along / (along @ along)
    low, high = np.minimum.reduceat(side, offset[:-1]), np.maximum.reduceat(side, offset[:-1])
    first, last = np.minimum.reduceat(place, offset[:-1]), np.maximum.reduceat(place, offset[:-1])
    found = []
    for i in np.flatnonzero((low < 0) & (high > 0) & (last > 0) & (first < 1)):
        s, t = side[offset[i] : offset[i + 1]], place[offset[i] : offset[i + 1]]
        up = s > 0
        crossing = np.flatnonzero(up != np.roll(up, -1))
        after = (crossing + 1) % len(s)
        cuts = np.sort(t[crossing] + (t[after] - t[crossing]) * s[crossing] / (s[crossing] - s[after]))
        parts = [(max(a, 0.0), min(b, 1.0)) for a, b in cuts.reshape(-1, 2) if b > 0 and a < 1]
        if parts:
            found.append((int(i), parts))
    return found


def profile(
    results: Results, field: str = "displacement_y", line: Sequence[float] | None = None, frames: Sequence[int] = (-1,),
    *, axes: Axes | None = None, units: str | Units | None = None, title: str | None = None,
) -> Axes:  # fmt: skip
    """A field along a line x1 y1 x2 y2 (by default horizontal at half the height) through the start geometry."""
    field, units = field_name(field), Units.parse(units, results)
    if line is None:
        low, high = results.vertices.min(axis=0), results.vertices.max(axis=0)
        # not quite the middle: where that is a joint, the line would run between the blocks
        middle = low[1] + 0.487 * (high[1] - low[1])
        line = (float(low[0]), float(middle), float(high[0]), float(middle))
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 2.7))
        for k, frame in enumerate(frames):
            distance, values, _ = profile_data(results, field, line, frame)
            if not len(distance):
                raise InputError("the line of the profile meets no block")
            label = f"t = {results.frames[frame].time:.4g}" + (f" {units.time}" if units.time else "")
            gaps = np.flatnonzero(np.diff(distance)[1::2] > 1e-9 * distance[-1]) * 2 + 2
            axes.plot(np.insert(distance, gaps, np.nan), np.insert(values, gaps, np.nan), label=label, **_line_style(k))
        x1, y1, x2, y2 = line
        name_axis(axes.xaxis, units, f"distance from ({x1:.4g}, {y1:.4g}) towards ({x2:.4g}, {y2:.4g})", "length")
        name_axis(axes.yaxis, units, *field_words(field))
        axes.grid(color="#E4E4E4", lw=0.5)
        nice_ticks(axes.yaxis)
        _legend(axes)
        axes.set_title(title_of(results) if title is None else title)
    return axes


def energy(
    results: Results, *, axes: Sequence[Axes] | None = None, units: str | Units | None = None, title: str | None = None,
    stage: str | None = None,
) -> AnyArray:  # fmt: skip
    """The energy balance: stored energies and losses, and below the residual relative to the turnover.

    `stage`: of this stage only.

    Returns the two axes."""

    units = Units.parse(units, results)
    _need_energies(results)
    table = _rows(results, stage)
    names = [name for name in results.energy_names if name not in CHECKS]
    time = table["time"]
    turnover = float(np.max([np.abs(table[f"energy_{name}"]).max(initial=0.0) for name in names])) or 1.0
    with style():
        panels = new_panels(axes, 4.4, (2.4, 1))
        for i, name in enumerate(names):
            values = table[f"energy_{name}"]
            kind: dict[str, Any] = {"linestyle": "-" if name in STORED else (0, (4, 1.5))}
            none = np.abs(values).max(initial=0.0) <= 1e-3 * turnover
            label = name.replace("_", " ") + (" (≈ 0)" if none else "")
            kind["linewidth"] = 0.7 if none else 1.3
            panels[0].plot(time, values, label=label, **_line_style(i) | kind)
        name_axis(panels[0].yaxis, units, "energy", "energy")
        panels[0].axhline(0, color="#777777", lw=0.5, zorder=1)
        nice_ticks(panels[0].yaxis)
        _legend(panels[0])
        for i, name in enumerate(CHECKS):
            share = np.maximum(np.abs(table[f"energy_{name}"]) / turnover, 1e-16)
            panels[1].semilogy(time, share, label=f"|{name}|", **_line_style(i))
        panels[1].set_ylabel("share of\nlargest energy")
        panels[1].set_ylim(1e-16, max(1.0, panels[1].get_ylim()[1]))
        _legend(panels[1])
        for panel in panels:
            last, first = (float(time[-1]), 0.0 if stage is None else float(time[0])) if len(time) else (1.0, 0.0)
            _time_axis(panel, units, last, first)
        _mark_stages(panels[0], results, stage)
        panels[0].set_xlabel("")
        panels[0].set_title(_title(results, stage, title))
    return panels


def iterations(
    results: Results, *, axes: Sequence[Axes] | None = None, units: str | Units | None = None, title: str | None = None,
    stage: str | None = None,
) -> AnyArray:  # fmt: skip
    """Step size, rounds of the open-close loop and attempts, and numbers of contacts, over the steps.

    `stage`: of this stage only.

    Returns the three axes."""
    from matplotlib.ticker import MaxNLocator
    from matplotlib.transforms import ScaledTranslation

    units = Units.parse(units, results)
    table = _rows(results, stage)
    step = table["step"]
    with style():
        panels = new_panels(axes, 5.0, (1, 1, 1))
        panels[0].step(step, table["dt"], where="mid", color=PALETTE[0])
        panels[0].set_ylabel(units.label("time step", "time"))
        panels[0].set_ylim(0, 1.08 * float(table["dt"].max()) if table.n_rows else 1.0)
        nice_ticks(panels[0].yaxis, 4)
        panels[1].step(step, table["open_close_iterations"], where="mid", label="open–close rounds", color=PALETTE[1])
        panels[1].step(step, table["attempts"], where="mid", label="attempts", color=PALETTE[2], ls=(0, (4, 1.5)))
        lines = list(panels[1].lines)
        place = panels[1].transAxes
        if table["solver_iterations"].any():
            beside = panels[1].twinx()
            lines += beside.step(
                step, table["solver_iterations"], where="mid", label="solver iterations (right)", color=PALETTE[3],
                lw=0.8,
            )  # fmt: skip
            beside.set_ylim(bottom=0)
            beside.tick_params(axis="y", colors=PALETTE[3])
            beside.spines.right.set(visible=True, color=PALETTE[3])
            nice_ticks(beside.yaxis, 4)
            place += ScaledTranslation(0.4, 0, panels[1].figure.dpi_scale_trans)  # behind the numbers of that axis
        panels[1].set_ylabel("number")
        panels[1].set_ylim(bottom=0)
        panels[1].yaxis.set_major_locator(MaxNLocator(4, integer=True))
        panels[1].legend(
            handles=lines, loc="upper left", bbox_to_anchor=(1.01, 1.03), bbox_transform=place, handlelength=2.2
        )
        names = ("locked", "sliding", "open")
        colours = [STATES[name] for name in names]
        panels[2].stackplot(step, *(table[name] for name in names), labels=names, colors=colours, linewidth=0)
        panels[2].set_ylabel("contacts")
        panels[2].set_xlabel("step")
        panels[2].yaxis.set_major_locator(MaxNLocator(4, integer=True))
        _legend(panels[2])
        for panel in panels:
            panel.set_xlim(step[0] if len(step) > 1 else 0, step[-1] if len(step) > 1 else 2)
            panel.grid(color="#E4E4E4", lw=0.5)
        panels[0].set_title(_title(results, stage, title))
    return panels
