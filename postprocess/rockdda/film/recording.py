# SPDX-License-Identifier: MIT
"""Films of the blocks: .mp4 and .gif drawn with matplotlib, .html as one page that plays in any browser.

Bolts and linings of pictures are coloured by how much of their strength they use.
"""

from __future__ import annotations

import contextlib
import math
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..columns import Columns
from ..errors import InputError, OutputError, how_to_install
from ..frames import Frame, field_name
from ..interrupts import HeldInterrupts
from ..plot.block_maps import MANY, add_colour_bar, add_fixed_points, add_lines, add_outline, moment, name_map
from ..plot.boundary_marks import add_boundaries
from ..plot.style import (
    BOLT,
    DIVERGING,
    LINER,
    MATERIALS,
    USE_MAP,
    field_words,
    limits_of,
    size_of,
    style,
    without_splinters,
)
from ..plot.water_levels import add_water_tables
from ..results import Results
from ..text import PathLike, plain_text
from ..units import Units
from ..writing import complete_file
from .page import SHOWN_FIELDS, film_page

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.figure import Figure


LINER_FIELDS = ("use", "N", "M", "Q")


class Support:
    """The bolts and linings of a film, which move from frame to frame."""

    def __init__(self, results: Results, frames: list[int], units: Units, scale: float, liner: str) -> None:
        if liner not in LINER_FIELDS:
            raise InputError(f"linings are coloured by {', '.join(LINER_FIELDS)}, not by {liner!r}")
        self.scale, self.field, self.most = scale, liner, 0.0
        self.start, now = results.frames[0], [results.frames[index] for index in frames]
        #: scales of colours: map, lowest and highest value, label
        self.bars: list[tuple[str, float, float, str]] = []
        if liner != "use" and self.start.liner_pieces.n_rows:
            self.most = max(float(np.abs(one.moved_pieces("liner")[liner]).max(initial=0.0)) for one in now)
            factor, unit = units.of_section(liner, self.most)
            words = f"linings: {liner} [{unit}]" if unit else f"linings: {liner}"
            self.bars.append((DIVERGING, -factor * self.most, factor * self.most, words))
        coloured = {"bolts": "bolt"} | ({"linings": "liner"} if liner == "use" else {})
        used = [
            name
            for name, what in coloured.items()
            if any(np.isfinite(one.moved_pieces(what)["use"]).any() for one in now)
        ]
        if used:
            self.bars.append((USE_MAP, 0.0, 100.0, f"{', '.join(used)}: share of a strength [%]"))

    def add(self, axes: Axes) -> None:
        """Add them, and the scales of their colours."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        self.liners = add_lines(axes, self.start.liner_pieces, LINER, 2.4)
        for rim in self.liners[:1]:
            rim.set_color(LINER)  # zero is white
        self.bolts = add_lines(axes, self.start.bolt_pieces, BOLT)
        for colours, low, high, label in self.bars:
            mappable = ScalarMappable(Normalize(low, high if high > low else low + 1), colours)
            axes.figure.colorbar(mappable, ax=axes, label=label, shrink=0.6)

    def move(self, now: Frame) -> None:
        """Draw them as they are in a frame."""
        if self.bolts:
            _move(self.bolts, now.moved_pieces("bolt", self.scale), "use", BOLT, USE_MAP, (0.0, 1.0))
        if self.liners:
            shown = (USE_MAP, (0.0, 1.0)) if self.field == "use" else (DIVERGING, (-self.most, self.most))
            _move(self.liners, now.moved_pieces("liner", self.scale), self.field, LINER, *shown)


def _move(
    drawn: list[LineCollection], pieces: Columns, field: str, plain: str, colours: str, limits: tuple[float, float]
) -> None:
    """Pieces where they are, in the colours of a value where it is known."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgba

    for lines in drawn:
        lines.set_segments(list(pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)))
    low, high = limits
    share: Any = (pieces[field] - low) / (high - low if high > low else 1.0)
    found = ~np.isnan(share)
    shown: Any = np.where(found[:, None], colormaps[colours](np.clip(np.nan_to_num(share), 0, 1)), to_rgba(plain))
    drawn[-1].set_color(shown)


Progress = Callable[[int, int], None]
ENDINGS = (".mp4", ".gif", ".html")
BAR = 0.95  # inches, of a further scale of colours with its label


def animate(
    results: Results, output: PathLike, field: str = "displacement", *, every: int = 1, fps: float = 20.0,
    scale: float = 1.0, outline: bool = True, limits: tuple[float, float] | None = None,
    units: str | Units | None = None, fields: Sequence[str] | None = None, title: str | None = None, dpi: int = 120,
    joints: bool = False, liner: str = "use", progress: Progress | None = None,
) -> Path:  # fmt: skip
    """Make a film of all frames (or every n-th and the last); returns its path.

    The ending of `output` selects the kind. `field` colours the blocks; a page (.html) lets its viewer choose among
    `fields`, beginning with `field`, with `joints` also among stresses, opening and slip along joints. `liner` colours
    linings in .mp4 and .gif: by the share of their strength ('use'), or by N, M, Q; a page lets its viewer choose.
    `scale` enlarges the displacements in .mp4 and .gif. `progress` is called with the number of frames done and their
    number. An existing film is replaced; Ctrl-C stops between two frames and leaves it as it was, a second Ctrl-C does
    not wait for the frame."""
    path = Path(output)
    units = Units.parse(units, results)
    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"a film ends in {', '.join(ENDINGS)}, not in {path.suffix or 'nothing'!r}", path)
    field, fields = field_name(field), [field_name(name) for name in fields or SHOWN_FIELDS]
    if every < 1:
        raise InputError("every: must be 1 or more")
    frames = list(range(0, results.n_frames, every))
    if not frames:
        raise InputError("there are no frames yet", results.path)
    if frames[-1] != results.n_frames - 1:
        frames.append(results.n_frames - 1)
    try:
        with complete_file(path) as part:
            if path.suffix.lower() == ".html":
                chosen = list(dict.fromkeys([field, *fields]))
                name = title or results.title or results.name
                part.write_text(film_page(results, frames, chosen, units, name, progress, joints), encoding="utf-8")
            else:
                _draw(results, part, frames, field, fps, scale, outline, limits, units, title, dpi, liner, progress)
    except subprocess.CalledProcessError as error:  # of ffmpeg, which has said why on standard error
        raise OutputError(f"{path}: cannot be written: ffmpeg ended with code {error.returncode}") from error
    return path


def _draw(
    results: Results, path: Path, frames: list[int], field: str, fps: float, scale: float, outline: bool,
    limits: tuple[float, float] | None, units: Units, title: str | None, dpi: int, liner: str,
    progress: Progress | None,
) -> None:  # fmt: skip
    """Draw all frames into one figure and hand them to a writer."""
    from matplotlib import pyplot as plt

    with style():
        support = Support(results, frames, units, scale, liner)
        axes, drawn = _scene(results, frames, field, scale, outline, limits, units, dpi, len(support.bars))
        support.add(axes)
        figure = cast("Figure", axes.figure)
        stamp = title if title is not None else plain_text(results.title)
        first, last = (float(results.times[k]) for k in (frames[0], frames[-1]))
        enlarged = f"displacements × {scale:g}" if scale != 1 else ""
        clock = axes.set_title(" ")
        marks: list[Artist] = []  # of boundaries and water, which each frame has anew
        (bar,) = axes.plot([], [], color="#0072B2", lw=2.5, transform=axes.transAxes, clip_on=False)
        figure.get_layout_engine().execute(figure)  # type: ignore[union-attr]
        figure.set_layout_engine("none")  # the picture must not move within the film
        writer = _writer(path, fps)

        def draw(index: int) -> None:
            now = results.frames[index]
            drawn.set_verts(np.split(_moved(results, now.shown_vertices, scale), results.vertex_offset[1:-1]))
            if field != "material":
                drawn.set_array(now.field(field))
            share = (now.time - first) / (last - first) if last > first else 1.0
            support.move(now)
            bar.set_data([0, share], [1.005, 1.005])
            while marks:
                marks.pop().remove()
            marks.extend(add_boundaries(axes, results, _moved(results, now.shown_vertices, scale), now.time))
            marks.extend(add_water_tables(axes, results, now))
            clock.set_text(", ".join(part for part in (stamp, moment(now, units, ".4f"), enlarged) if part))

        try:
            _record(writer, figure, path, dpi, frames, draw, progress)
        finally:
            plt.close(figure)


def _record(
    writer: Any, figure: Figure, path: Path, dpi: int, frames: list[int], draw: Callable[[int], None],
    progress: Progress | None,
) -> None:  # fmt: skip
    """Hand the figure, as `draw` changes it for each frame, to a writer. Ctrl-C takes effect between two frames."""
    import matplotlib as mpl

    with mpl.rc_context({"savefig.bbox": None}):  # pictures of one size
        # Ctrl-C in a terminal also ends ffmpeg: the interrupt then hides the pipe that breaks
        with HeldInterrupts() as interrupts:
            writer.setup(figure, str(path), dpi)
            try:
                for k, index in enumerate(frames):
                    interrupts.check()
                    draw(index)
                    writer.grab_frame()
                    if progress is not None:
                        progress(k + 1, len(frames))
            except OSError:  # where ffmpeg has ended, its exit code says more
                writer.finish()
                raise
            except BaseException:
                if path.suffix.lower() != ".gif":  # which would be put together now
                    with contextlib.suppress(subprocess.CalledProcessError):
                        writer.finish()
                raise
        writer.finish()


def _moved(results: Results, vertices: Any, scale: float) -> Any:
    return results.vertices + scale * (vertices - results.vertices)


def _scene(
    results: Results, frames: list[int], field: str, scale: float, outline: bool,
    limits: tuple[float, float] | None, units: Units, dpi: int, n_bars: int,
) -> tuple[Axes, PolyCollection]:  # fmt: skip
    """Axes for all frames: limits around all of them, one colour scale, room for further ones."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    low, high = results.vertices.min(axis=0), results.vertices.max(axis=0)
    values, there = [], []
    for index in frames:
        now = results.frames[index]
        shown = _moved(results, now.shown_vertices, scale)
        low, high = np.fmin(low, np.nanmin(shown, axis=0)), np.fmax(high, np.nanmax(shown, axis=0))
        values.append(now.field(field))
        there.append(now.active)
    margin = 0.03 * float((high - low).max())
    # H.264 takes even numbers of pixels; a quarter of one more, so that rounding does not lose one
    wide, tall = size_of(*(high - low + 2 * margin))
    size = [(2 * math.ceil(inches * dpi / 2) + 0.25) / dpi for inches in (wide + BAR * n_bars, tall)]
    _, axes = plt.subplots(figsize=size, layout="constrained")
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    name_map(axes, units)
    many = results.n_blocks > MANY
    drawn = PolyCollection([], edgecolors="face" if many else "#333333", linewidths=0.1 if many else 0.5)
    drawn.set_in_layout(False)
    axes.add_collection(drawn, autolim=False)
    if field == "material":
        drawn.set_facecolor([MATERIALS[(m - 1) % len(MATERIALS)] for m in results.block_material])
    else:
        shown_values = without_splinters(np.array(values), results.block_area, np.array(there))
        bottom, top, colour_map = limits_of(field, shown_values, limits)
        drawn.set(cmap=colour_map, clim=(bottom, top), array=np.zeros(results.n_blocks))
        add_colour_bar(axes, drawn, units, *field_words(field), np.array(values)[np.array(there)])
    if outline:
        add_outline(axes, results.vertices, results.vertex_offset)
    add_fixed_points(axes, results)
    return axes, drawn


def _writer(path: Path, fps: Any) -> Any:
    """The writer that joins pictures: Pillow for .gif, ffmpeg (that of imageio-ffmpeg, or the system's) for .mp4."""
    import matplotlib as mpl
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if path.suffix.lower() == ".gif":
        return PillowWriter(fps=fps)
    program = shutil.which("ffmpeg")
    if program is None:
        try:
            import imageio_ffmpeg

            program = imageio_ffmpeg.get_ffmpeg_exe()
        except (ImportError, RuntimeError) as error:
            raise InputError(
                f"an .mp4 needs ffmpeg: {how_to_install('films')}, or make a .gif or .html", path
            ) from error
    mpl.rcParams["animation.ffmpeg_path"] = program
    # colours that every player shows
    arguments = ["-pix_fmt", "yuv420p", "-crf", "20"]
    return FFMpegWriter(fps=fps, codec="libx264", extra_args=arguments)
