# SPDX-License-Identifier: MIT
"""A slider over the frames in a notebook, with the fields to choose from. Needs ipywidgets."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..errors import need
from ..frames import FIELDS, field_name

if TYPE_CHECKING:
    from ..results import Results

DPI = 100


def slider(results: Results, field: str = "displacement", frame: int = -1, **options: Any) -> Any:
    """A slider over the frames, a list of fields and the picture of both; returns the widget, which a notebook shows.

    options: of `rockdda.plot.blocks`. The limits of colours are those of each frame unless `limits=` fixes them. Frames
    that a run adds are there after `results.refresh()` and a new slider. Needs ipywidgets (`pip install
    ipywidgets`).
    """
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
