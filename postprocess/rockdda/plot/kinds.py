# SPDX-License-Identifier: MIT
"""The kinds of pictures by name, several runs side by side, and saving of pictures."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray
from ..errors import InputError
from ..frames import field_name
from ..results import Results
from ..text import LONGEST_IN_PICTURE, PathLike, plain_text
from ..units import Units
from ..writing import complete_file
from .block_maps import blocks, contact_forces, displacements, stress_crosses
from .curves import energy, history, iterations, profile
from .ground_reaction import ground_reaction
from .joint_maps import joint_profile, joints, thrust
from .search_maps import factor, mechanism
from .stress_maps import contours, trajectories
from .style import (
    PAPER_WIDTH,
    clip_to_window,
    field_words,
    limits_of,
    name_axis,
    nice_ticks,
    style,
    window_axes,
    without_splinters,
)
from .support_maps import bolts, capacity, liner
from .water_maps import water

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def small_multiples(
    runs: Sequence[Results], field: str = "displacement", frame: int = -1, *, labels: Sequence[str] | None = None,
    columns: int | None = None, scale: float = 1.0, limits: tuple[float, float] | None = None,
    units: str | Units | None = None, outline: bool = True, window: Sequence[float] | None = None,
) -> AnyArray:  # fmt: skip
    """One frame of several runs side by side, with one colour scale; returns their axes, one for each run.

    `labels` name the runs (by default their files), `columns` is the number of pictures in a row, `window` x0 y0 x1 y1
    the part of the models that is shown."""
    import matplotlib.pyplot as plt

    if not runs:
        raise InputError("small multiples need at least one run")
    units = Units.parse(units, runs[0])
    names = list(labels) if labels is not None else [plain_text(run.name) for run in runs]
    if len(names) != len(runs):
        raise InputError(f"{len(runs)} runs, but {len(names)} labels")
    field = field_name(field)
    parts = [(run.frames[frame], run.block_area) for run in runs]
    values = np.concatenate([without_splinters(now.field(field), area, now.active) for now, area in parts])
    low, high, colour_map = limits_of(field, values, limits)
    columns = columns or math.ceil(math.sqrt(len(runs)))
    rows = math.ceil(len(runs) / columns)
    sizes = np.array([np.ptp(run.vertices, axis=0) for run in runs])
    extents, alike = sizes.max(axis=0), window is not None or bool(np.allclose(sizes, sizes[0]))
    if window is not None:
        extents = np.array([window[2] - window[0], window[3] - window[1]])
    width = (PAPER_WIDTH - 0.9) / columns
    height = rows * min(max(width * extents[1] / extents[0], 0.5) + 0.35, 6.0) + 0.5
    with style():
        figure, grid = plt.subplots(rows, columns, figsize=(PAPER_WIDTH, height), layout="constrained", squeeze=False)
        drawn: list[Any] = []
        for axes, run, name in zip(grid.flat, runs, names, strict=False):
            if window is not None:
                window_axes(window, axes)
            blocks(
                run, field, frame, axes=axes, scale=scale, limits=(low, high), colour_map=colour_map, colour_bar=False,
                units=units, title=name, outline=outline,
            )  # fmt: skip
            if window is not None:
                clip_to_window(axes, window)
            number = len(drawn)
            if alike and number % columns:
                axes.set_ylabel("")
                axes.tick_params(labelleft=False)
            if alike and number + columns < len(runs):
                axes.set_xlabel("")
                axes.tick_params(labelbottom=False)
            drawn.append(axes)
        for axes in grid.flat[len(runs) :]:
            axes.set_visible(False)
        if field != "material":
            bar = figure.colorbar(drawn[0].collections[0], ax=grid, shrink=0.8, aspect=30, pad=0.01)
            bar.outline.set_linewidth(0.4)  # type: ignore[operator]
            name_axis(bar.ax.yaxis, units, *field_words(field))
            nice_ticks(bar.ax.yaxis)
    return np.array(drawn)


KINDS: dict[str, Callable[..., Any]] = {
    "blocks": blocks, "contours": contours, "stress": stress_crosses, "trajectories": trajectories, "thrust": thrust,
    "contacts": contact_forces, "joints": joints, "displacements": displacements, "water": water, "bolts": bolts,
    "liner": liner, "capacity": capacity, "history": history, "profile": profile, "joint-profile": joint_profile,
    "energy": energy, "iterations": iterations, "ground-reaction": ground_reaction, "mechanism": mechanism,
    "factor": factor,
}  # fmt: skip


MAPS = (
    "blocks", "contours", "stress", "trajectories", "thrust", "contacts", "joints", "displacements", "water", "bolts",
    "liner", "mechanism",
)  # fmt: skip


def plot(
    results: Results, field: str | None = None, frame: int = -1, kind: str = "blocks", *,
    window: Sequence[float] | None = None, **options: Any,
) -> Any:  # fmt: skip
    """Draw a picture and return its axes (an array of them where there are several panels).

    `kind` is one of KINDS; `field` colours the blocks or joints or is drawn along the line of a profile; `options`
    go to the function of the kind, for example `scale=100` to enlarge displacements or `units="m,s,kN"` for the labels.
    `window` x0 y0 x1 y1 is the part of the model that a map of blocks or joints shows."""
    if kind not in KINDS:
        raise InputError(f"there is no kind of picture {kind!r}; the kinds are: {', '.join(KINDS)}")
    draw = KINDS[kind]
    known = inspect.signature(draw).parameters
    if "field" in known and field is not None:
        options["field"] = field
    if "frame" in known:
        options["frame"] = frame
    elif "frames" in known:
        options.setdefault("frames", (frame,))
    unknown = set(options) - set(known)
    if unknown:
        raise InputError(f"a picture of kind {kind!r} has no option {sorted(unknown)[0]!r}; it has: {', '.join(known)}")
    if window is None:
        return draw(results, **options)
    if kind not in MAPS:
        raise InputError(f"a picture of kind {kind!r} has no window; these have: {', '.join(MAPS)}")
    axes = draw(results, axes=window_axes(window, options.pop("axes", None)), **options)
    clip_to_window(axes, window)
    return axes


def save(axes: Any, path: PathLike, dpi: int = 200) -> Path:
    """Write the figure of some axes (.pdf, .svg, .png, …) and close it."""
    import matplotlib.pyplot as plt
    from matplotlib.text import Text

    path = Path(path)
    first = np.ravel(np.asarray(axes, dtype=object))[0]
    figure: Figure = first.get_figure()
    known = figure.canvas.get_supported_filetypes()
    if path.suffix.lower().lstrip(".") not in known:
        raise InputError(f"pictures end in .{', .'.join(sorted(known))}, not in {path.suffix or 'nothing'!r}", path)
    for text in figure.findobj(Text):
        if len(text.get_text()) > LONGEST_IN_PICTURE:
            text.set_text(plain_text(text.get_text()))
    try:
        with style(), complete_file(path) as part:
            figure.savefig(part, dpi=dpi, bbox_inches="tight", pad_inches=0.03)
    finally:
        plt.close(figure)
    return path
