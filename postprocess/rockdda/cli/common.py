# SPDX-License-Identifier: MIT
"""Common parts of the commands of `rockdda-post`: exit codes, options, summaries, opening and naming files."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from ..errors import InputError, OutputError
from ..fields import FIELD_TEXTS, JOINT_FIELDS

if TYPE_CHECKING:
    from ..results import Results

DONE, INTERNAL, BAD_INPUT, NO_CONVERGENCE, STOPPED, NO_OUTPUT = range(6)
DIFFERENT = 1  # of `compare`, as of diff and cmp; of `validate`: a promise is broken

ResultsFile = Annotated[Path, Argument(metavar="OUT.h5", help="Results file.")]
Output = Annotated[Path | None, Option("-o", "--output", help="File to write.")]


FieldName = Annotated[
    str,
    Option(
        "--field",
        help=f"Field shown by the colours: {', '.join(FIELD_TEXTS)}.",
        autocompletion=lambda: list(FIELD_TEXTS),
    ),
]
PlotFieldName = Annotated[
    str,
    Option(
        "--field",
        help=f"Field shown by the colours: {', '.join(FIELD_TEXTS)}; of joints: "
        f"{', '.join(JOINT_FIELDS)}; of bolts: force, use; of linings: N, M, Q.",
        autocompletion=lambda: [*FIELD_TEXTS, *JOINT_FIELDS],
    ),
]
FrameNumber = Annotated[int, Option("--frame", help="Number of the frame; negative: from the end.")]
UnitNames = Annotated[
    str | None, Option("--units", help="Units of a file that does not state them: length, time, force, as m,s,N or SI.")
]
ShownUnits = Annotated[
    str | None,
    Option("--show", help="Units to convert to, as m,s,kN; where the file does not state its own, with --units."),
]
Quiet = Annotated[bool, Option("--quiet", "-q", help="No progress, no summary.")]
Json = Annotated[bool, Option("--json", help="Summary on standard output as JSON.")]
Slurm = Annotated[bool, Option("--slurm", help="Only write a Slurm job array of the runs that are left.")]
Dask = Annotated[
    str | None, Option(metavar="WHERE", help="Run through Dask: tcp://HOST:PORT, local, or slurm, pbs, lsf …")
]
Retry = Annotated[bool, Option("--retry", help="Run failed cases again, too.")]
Resolution = Annotated[int, Option("--dpi", min=20, max=2400, help="Resolution of .png.")]
Outline = Annotated[bool, Option("--outline/--no-outline", help="Show the start, too.")]
Limits = Annotated[tuple[float, float] | None, Option("--limits", metavar="LOW HIGH", help="Ends of the colour scale.")]
Scale = Annotated[float, Option("--scale", help="Factor on the displacements.")]


def print_summary(quiet: bool, as_json: bool, text: str, **summary: Any) -> None:
    """The summary on standard output."""
    if as_json:
        typer.echo(json.dumps({"status": "done", "exit_code": DONE} | summary, default=str))
    elif not quiet:
        typer.echo(text)


@contextmanager
def progress_bar(what: str, quiet: bool) -> Iterator[Callable[[int, int], None] | None]:
    """A bar on standard error, when that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def runs_bar(quiet: bool, as_json: bool, ended: Callable[[Any], str]) -> Iterator[Callable[[int, int, Any], None]]:
    """Reports runs as they end, by a bar or in lines with how each ended; says how to go on when they are stopped."""
    with progress_bar("runs", quiet or as_json) as bar:

        def report(done: int, total: int, outcome: Any) -> None:
            if bar is not None:
                bar(done, total)
            elif not (quiet or as_json):
                typer.echo(f"{done}/{total} {outcome.name}: {ended(outcome)}, {outcome.seconds:.1f} s", err=True)

        try:
            yield report
        except KeyboardInterrupt:
            if not quiet:
                typer.echo("stopped; the same command continues", err=True)
            raise


def open_results(path: Path, frame: int | None = None, field: str | None = None, frames: bool = True) -> Results:
    """Open a results file, and check that it has the given frame and field, and frames if needed."""
    from ..frames import field_name
    from ..results import Results

    results = Results(path)
    if not frames:
        return results
    if not results.n_frames:
        raise InputError("there are no frames in it" + ("" if results.complete else " yet"), path)
    if frame is not None and not -results.n_frames <= frame < results.n_frames:
        raise InputError(f"there are frames 0 to {results.n_frames - 1}, not {frame}", path)
    if field is not None:
        field_name(field)
    return results


def in_shown_units(results: Results, units: str | None, show: str | None) -> tuple[Results, str | None]:
    """The results in the units of --show, and the names of their units; InputError for units that cannot be."""
    from ..units import SYSTEMS, check_units, in_units

    if units is None:
        if show is not None and results.units in SYSTEMS:
            return in_units(results, ",".join(SYSTEMS[results.units]), show), show
        if show is not None:
            raise InputError("--show converts from the units of the file: state them, too, as in --units m,s,N")
        return results, None
    check_units(results, units)
    return (results, units) if show is None else (in_units(results, units, show), show)


def numbers(option: str, text: str, form: str = "x1,y1,x2,y2") -> tuple[Any, ...]:
    """The numbers of an option, as many as its form has; those of a window name its lower left and upper right."""
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    window = " with x1 < x2 and y1 < y2" if option == "window" else ""
    good = len(found) == form.count(",") + 1 and all(abs(value) < 1e30 for value in found)
    if not good or (window and not (found[0] < found[2] and found[1] < found[3])):
        raise InputError(f"{option} {text!r}: expected {form}{window}")
    return found


def draw_into_files() -> None:
    """Let matplotlib draw without a display."""
    import matplotlib as mpl

    mpl.use("Agg")


def target(output: Path | None, source: Path, ending: str) -> Path:
    """The file to write: never the results themselves."""
    path = output if output is not None else Path(source.stem + ending)
    if path.suffix.lower() in (".h5", ".hdf5") or path == source:
        raise InputError("would overwrite results: choose another output", path)
    if not path.parent.is_dir():
        raise OutputError(f"{path}: cannot be written: there is no folder {path.parent}")
    return path


def need_display() -> None:
    """InputError, which says why, where no window can be opened."""
    hint = "rockdda-post plot without --interactive draws a file, rockdda-post view needs a browser only"
    if os.environ.get("PYVISTA_OFF_SCREEN", "").lower() == "true":
        raise InputError(f"--interactive: PYVISTA_OFF_SCREEN=true keeps PyVista from opening a window: {hint}")
    if not sys.platform.startswith("linux"):
        return
    name = os.environ.get("DISPLAY")
    if not name:
        raise InputError(
            f"--interactive: there is no display ($DISPLAY is not set; over ssh, 'ssh -X' brings one): {hint}"
        )
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return  # PyVista says what is missing
    x11.XOpenDisplay.restype, x11.XOpenDisplay.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:  # VTK would end the process
        raise InputError(f"--interactive: the display {name!r} ($DISPLAY) cannot be opened: {hint}")
    x11.XCloseDisplay(display)


def stop_on_sigterm() -> None:
    """Treat SIGTERM as Ctrl-C, also where that waits (`HeldInterrupts`) or is ignored."""

    def stop(_: int, frame: FrameType | None) -> None:
        if hasattr(signal, "setitimer") and is_in_callback(frame):
            signal.signal(signal.SIGALRM, stop)
            signal.setitimer(signal.ITIMER_REAL, 0.01)
            return
        on_ctrl_c = signal.getsignal(signal.SIGINT)
        if not callable(on_ctrl_c):
            raise KeyboardInterrupt
        on_ctrl_c(signal.SIGINT, frame)

    signal.signal(signal.SIGTERM, stop)


def is_in_callback(frame: FrameType | None) -> bool:
    """Is this code that Python calls when an object goes, of which it drops all exceptions?"""
    while frame is not None:
        if frame.f_code.co_filename == weakref.__file__ or frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False
