# SPDX-License-Identifier: MIT
"""The blocks with a slider over the frames: in a window, to pick blocks (needs PyVista and a display), and in a
notebook (needs ipywidgets)."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import need
from ..frames import FIELDS, field_name
from ..results import Results
from ..units import Units
from .block_maps import moment
from .style import SEQUENTIAL, field_words, limits_of


def polygons_mesh(results: Results, frame: int = -1) -> Any:
    """The blocks of a frame as a PyVista mesh with one polygon for each."""
    pyvista = need("pyvista", "vtk", "the window")
    offset = results.vertex_offset
    count = np.diff(offset)
    faces = np.insert(np.arange(offset[-1]), offset[:-1], count)
    vertices = results.vertices + results.frames[frame].shown_displacement
    return pyvista.PolyData(np.column_stack([vertices, np.zeros(len(vertices))]), faces=faces)


def interactive(
    results: Results, field: str = "displacement", frame: int = -1, *, units: str | Units | None = None,
    show: bool = True,
) -> Any:  # fmt: skip
    """Open a window with a slider for the frames; a click on a block shows its number and value.

    With `show=False` the plotter is returned without a window."""
    pyvista = need("pyvista", "vtk", "the window")
    units = Units.parse(units, results)
    field = field_name(field)
    frames = results.frames
    start = frames[frame].index
    mesh = polygons_mesh(results, start)
    found = np.concatenate([frames[k].field(field) for k in (0, start, -1)])
    words, dimension = field_words(field)
    factor, unit = units.multiple(dimension, float(np.abs(found).max()))
    mesh.cell_data[field] = factor * frames[start].field(field)
    plotter = pyvista.Plotter(off_screen=not show, title=f"RockDDA: {results.title}")
    label = (f"{words} [{unit}]" if unit else words).replace("$", "").replace("\\", "")
    low, high, _ = limits_of(field, factor * found, None)
    plotter.add_mesh(
        mesh, scalars=field, clim=(low, high), cmap=SEQUENTIAL, show_edges=True, lighting=False,
        scalar_bar_args={"title": label},
    )  # fmt: skip

    def turn(value: float) -> None:
        now = frames[round(value)]
        mesh.points[:, :2] = results.vertices + now.shown_displacement
        mesh.cell_data[field] = factor * now.field(field)
        plotter.add_text(moment(now, units), name="time", font_size=10)

    def picked(cell: Any) -> None:
        if cell is not None and cell.n_cells:
            number = int(mesh.find_closest_cell(cell.center))  # from 0; blocks count from 1
            text = f"block {number + 1}: {mesh.cell_data[field][number]:.6g}"
            plotter.add_text(text, position="lower_left", name="picked", font_size=10)

    if len(frames) > 1:
        plotter.add_slider_widget(turn, (0, len(frames) - 1), value=start, title="frame", fmt="%.0f", style="modern")
    turn(start)
    plotter.enable_cell_picking(picked, through=False, show_message=False)
    plotter.view_xy()
    plotter.enable_image_style() if not show else plotter.enable_2d_style()
    if show:
        plotter.show()
    return plotter


DPI = 100


def slider(results: Results, field: str = "displacement", frame: int = -1, **options: Any) -> Any:
    """A slider over the frames, a list of fields and the picture of both; returns the widget, which a notebook shows.

    options: of `rockdda.plot.blocks`. The limits of colours are those of each frame unless `limits=` fixes them. Frames
    that a run adds are there after `results.refresh()` and a new slider. Needs ipywidgets (`pip install
    ipywidgets`)."""
    widgets = need("ipywidgets", "notebook", "a slider")
    last = len(results.frames) - 1
    frames = widgets.IntSlider(
        value=results.frames[frame].index, min=0, max=last, description="frame", continuous_update=False
    )
    fields = widgets.Dropdown(options=list(FIELDS), value=field_name(field), description="field")
    label = widgets.Label()
    picture = widgets.Image(format="png")

    def draw(_: Any = None) -> None:
        now = results.frames[frames.value]
        stage = f", {now.stage_name}" if results.has_stages else ""
        label.value = f"step {now.step}, time {now.time:.6g}{stage}"
        picture.value = _drawn(lambda axes: results.plot(fields.value, now.index, axes=axes, **options))

    for widget in (frames, fields):
        widget.observe(draw, names="value")
    draw()
    return widgets.VBox([widgets.HBox([frames, fields, label]), picture])


def _drawn(draw: Callable[[Any], Any]) -> bytes:
    """A picture as PNG, drawn without a window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure.add_subplot())
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()
