# SPDX-License-Identifier: MIT
"""Pictures of input before any run: lines of a geometry file by joint material, or blocks, with points and bolts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray, FloatArray
from ..errors import InputError
from ..text import PathLike, decoded, plain_text
from ..units import Units
from .block_maps import MANY, add_blocks, add_bolts
from .style import MATERIALS, PALETTE, add_strokes, clip_to_window, new_axes, set_limits, size_of, style, window_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..cutting import Blocks

INPUT_KINDS = ("lines", "blocks")
MOST_NUMBERS = 40  # points of a kind that get their numbers
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)))
# marker, filled, what the legend calls it
POINTS = {
    "fixed": ("^", "#FFFFFF", "fixed point"),
    "loading": ("v", "#000000", "loading point"),
    "measured": ("o", "#FFFFFF", "measured point"),
    "hole": ("x", "#000000", "hole point"),
}


def is_input(path: PathLike) -> bool:
    """True for a file that is neither named as results nor HDF5: it is drawn as a geometry or block file."""
    if Path(path).suffix.lower() in (".h5", ".hdf5"):
        return False
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(8)
    except OSError:
        return False
    return bool(head) and head != b"\x89HDF\r\n\x1a\n"


def _is_namelist(path: PathLike) -> bool:
    """True for a file whose first line that is no comment begins a group, as `&model`."""
    with Path(path).open("rb") as stream:
        head = decoded(stream.read(65536))
    first = re.search(r"^\s*([^\s#!])", head, re.M)
    return first is not None and first[1] in "&$"


def input_plot(
    path: PathLike, kind: str | None = None, *, axes: Axes | None = None, units: str | Units | None = None,
    title: str | None = None, window: Sequence[float] | None = None,
) -> Axes:  # fmt: skip
    """Draw a geometry file (.dc, .geo) or a block file (.blk) with its points and bolts; returns the axes.

    `kind` is 'lines' (of a geometry file, coloured by joint material; its default) or 'blocks' (cut if need be,
    coloured by block material). Points are numbered from 1, as in the file. `window` x0 y0 x1 y1: what is shown."""
    from ..cutting import Blocks
    from ..native import Session

    if _is_namelist(path):
        raise InputError(
            "is a model or an options file: `rockdda-post view` shows models; pictures are of results, "
            "or of geometry and block files",
            path,
        )
    if kind not in (None, *INPUT_KINDS):
        raise InputError(f"input is drawn as {' or '.join(INPUT_KINDS)}, not as {kind!r}", path)
    session = Session()
    session("cut_file", path, False)
    session.warn()
    sizes, arrays = session.geometry()
    if kind == "lines" and sizes["lines"] == 0:
        raise InputError("is a block file: it has no lines, and is drawn as blocks", path)
    blocks = Blocks(session, was_cut=sizes["lines"] > 0)
    units = Units.parse(units)
    if window is not None:
        axes = window_axes(window, axes)
    with style():
        if sizes["lines"] and kind != "blocks":
            axes = _lines(arrays, sizes, axes, units)
        else:
            axes = _blocks(blocks, arrays[-1], axes, units)
        axes.set_title(plain_text(Path(path).name) if title is None else title)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), handlelength=2.4)
        if window is not None:
            clip_to_window(axes, window)
    return axes


def _map_axes(points: FloatArray, axes: Axes | None, units: Units) -> Axes:
    if not len(points):
        points = np.array([[0.0, 0.0], [1.0, 1.0]])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * (float((high - low).max()) or 1.0)
    width, height = (high - low + 2 * margin).tolist()
    _, axes = new_axes(axes, size_of(width, height, extra_right=1.9))
    set_limits(axes, low - margin, high + margin)
    axes.set_aspect("equal")
    axes.set_xlabel(units.label("x", "length"))
    axes.set_ylabel(units.label("y", "length"))
    return axes


def _lines(arrays: list[AnyArray], sizes: dict[str, int], axes: Axes | None, units: Units) -> Axes:
    """The lines as they are in the file, before cutting."""
    _, lines, joints, material_lines, materials, bolts, _, fixed, loading, measured, holes = arrays
    ends = [array.reshape(-1, 2) for array in (lines, material_lines, bolts, fixed, loading, measured, holes)]
    axes = _map_axes(np.concatenate(ends), axes, units)
    boundary = np.arange(len(lines)) < sizes["boundary"]
    thin = 0.4 if len(lines) > MANY else 0.9
    groups = [(boundary, "boundary", 2 * thin), (~boundary, "lines" if not sizes["boundary"] else "joints", thin)]
    for chosen, name, width in groups:
        for material in np.unique(joints[chosen]).tolist():
            rows = lines[chosen & (joints == material)].reshape(-1, 2, 2)
            index, dashes = (material - 1) % len(PALETTE), DASHES[(material - 1) // len(PALETTE) % len(DASHES)]
            add_strokes(
                axes, rows, colors=PALETTE[index], linewidths=width, linestyles=[dashes],
                label=f"{name}, joint material {material}", rasterized=len(lines) > MANY,
            )  # fmt: skip
    for material in np.unique(materials).tolist():
        rows = material_lines[materials == material].reshape(-1, 2, 2)
        options: dict[str, Any] = {"linestyles": [DASHES[2]], "label": f"material line, block material {material}"}
        add_strokes(axes, rows, colors=MATERIALS[(material - 1) % len(MATERIALS)], linewidths=2.2, **options)
    add_bolts(axes, bolts.reshape(-1, 2, 2), label="bolt")
    lined = np.any(fixed[:, :2] != fixed[:, 2:], axis=1)
    if lined.any():
        add_strokes(axes, fixed[lined].reshape(-1, 2, 2), colors="#8C510A", linewidths=2.6, label="fixed line")
    for kind, points in (("fixed", fixed[~lined, :2]), ("loading", loading), ("measured", measured), ("hole", holes)):
        _add_points(axes, kind, points)
    return axes


def _blocks(blocks: Blocks, holes: FloatArray, axes: Axes | None, units: Units) -> Axes:
    """The blocks as they are cut, with points and bolts."""
    bolts = blocks.bolts.ends.reshape(-1, 2, 2)
    axes = _map_axes(np.concatenate([blocks.vertices, bolts.reshape(-1, 2), holes]), axes, units)
    if blocks.n_blocks:
        colours = [MATERIALS[(m - 1) % len(MATERIALS)] for m in blocks.material]
        add_blocks(axes, blocks.vertices, blocks.vertex_offset, facecolors=colours)
    for material in np.unique(blocks.material).tolist():
        colour = MATERIALS[(material - 1) % len(MATERIALS)]
        options: dict[str, Any] = {"markeredgecolor": "#333333", "markeredgewidth": 0.5, "linestyle": "none"}
        axes.plot([], [], "s", color=colour, markersize=8, label=f"block material {material}", **options)
    add_bolts(axes, bolts, label="bolt")
    for kind in ("fixed", "loading", "measured"):
        points = getattr(blocks, f"{kind}_points")
        _add_points(axes, kind, points.position, points.number)
    _add_points(axes, "hole", holes)
    return axes


def _add_points(axes: Axes, kind: str, points: FloatArray, numbers: AnyArray | None = None) -> None:
    """Points with their numbers, by default 1, 2, …"""
    if not len(points):
        return
    marker, fill, label = POINTS[kind]
    axes.plot(
        points[:, 0], points[:, 1], marker, color="black", markerfacecolor=fill, markersize=5, markeredgewidth=0.9,
        zorder=5, clip_on=False, label=label, linestyle="none",
    )  # fmt: skip
    if len(points) > MOST_NUMBERS or kind == "hole":
        return
    for number, point in zip(np.arange(1, len(points) + 1) if numbers is None else numbers, points, strict=True):
        axes.annotate(
            str(number), tuple(point), xytext=(4, 3), textcoords="offset points", fontsize=7, zorder=6,
            bbox={"boxstyle": "square,pad=0.1", "facecolor": "#FFFFFFB0", "edgecolor": "none"}, annotation_clip=False,
        )  # fmt: skip
