# SPDX-License-Identifier: MIT
"""The command `rockdda-post`."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from . import cli_study, cli_validate
from .errors import ConvergenceError, InputError, OutputError, RockddaError
from .results import FIELDS, Results

__all__ = ["app", "main"]

DONE, INTERNAL, BAD_INPUT, NO_CONVERGENCE, STOPPED, NO_OUTPUT = range(6)
DIFFERENT = 1  # of `compare`, as of diff and cmp; of `validate`: a promise is broken

app = typer.Typer(
    name="rockdda-post",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    help="""Pictures, films, tables and conversions for RockDDA.

    Each command has its own help with examples: `rockdda-post plot --help`.

    Exit codes: 0 done; 1 internal error (of `compare`: the runs differ; of `validate`: a promise is broken); 2 bad
    usage or bad input; 3 a computation could not go on; 4 stopped (Ctrl-C); 5 output could not be written.
    """,
)

ResultsFile = Annotated[Path, typer.Argument(metavar="OUT.h5", help="Results file.", show_default=False)]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="File to write.", show_default=False)]
FieldName = Annotated[str, typer.Option("--field", help=f"What the colours show: {', '.join(FIELDS)}.")]
FrameNumber = Annotated[int, typer.Option("--frame", help="Number of the frame; negative: from the end.")]
UnitNames = Annotated[
    str | None,
    typer.Option("--units", help="Length, time, force for the labels, as m,s,kN or SI.", show_default=False),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no summary.")]
Json = Annotated[bool, typer.Option("--json", help="Summary on standard output as JSON.")]
Limits = Annotated[
    tuple[float, float] | None,
    typer.Option("--limits", metavar="LOW HIGH", help="Ends of the colour scale.", show_default=False),
]
Scale = Annotated[float, typer.Option("--scale", help="Factor on the displacements.")]


def tell(quiet: bool, as_json: bool, text: str, **summary: Any) -> None:
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


def open_results(path: Path, frame: int | None = None, field: str | None = None, frames: bool = True) -> Results:
    """Open a results file, and see that it has the frame and field that are asked for, and frames if needed."""
    results = Results(path)
    if not frames:
        return results
    if not results.n_frames:
        raise InputError("there are no frames in it" + ("" if results.complete else " yet"), path)
    if frame is not None and not -results.n_frames <= frame < results.n_frames:
        raise InputError(f"there are frames 0 to {results.n_frames - 1}, not {frame}", path)
    if field is not None and field not in FIELDS:
        raise InputError(f"there is no field {field!r}; the fields are: {', '.join(FIELDS)}")
    return results


def target(output: Path | None, source: Path, ending: str) -> Path:
    """The file to write: never the results themselves."""
    path = output if output is not None else Path(source.stem + ending)
    if path.suffix.lower() in (".h5", ".hdf5") or path == source:
        raise InputError("would overwrite results: choose another output", path)
    if not path.parent.is_dir():
        raise OutputError(f"{path}: cannot be written: there is no folder {path.parent}")
    return path


@app.command(name="plot")
def plot_command(
    files: Annotated[list[Path], typer.Argument(metavar="OUT.h5...", help="Results files.", show_default=False)],
    output: Output = None,
    kind: Annotated[
        str,
        typer.Option(
            "--kind", "-k", help="blocks, stress, contacts, displacements, history, profile, energy or iterations."
        ),
    ] = "blocks",
    field: FieldName = "displacement",
    frame: FrameNumber = -1,
    time: Annotated[
        float | None, typer.Option("--time", help="Take the frame nearest to this time.", show_default=False)
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option("--scale", help="Factor on the displacements, or on the arrows.", show_default=False),
    ] = None,
    units: UnitNames = None,
    limits: Limits = None,
    line: Annotated[
        str | None, typer.Option("--line", metavar="X1,Y1,X2,Y2", help="Line of a profile.", show_default=False)
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", "-c", help="Column of a history; may be repeated.", show_default=False),
    ] = None,
    labels: Annotated[
        list[str] | None,
        typer.Option("--label", help="Name of a run among several, in their order.", show_default=False),
    ] = None,
    title: Annotated[str | None, typer.Option("--title", help="Title of the picture.", show_default=False)] = None,
    outline: Annotated[bool, typer.Option("--outline/--no-outline", help="Show the start, too.")] = True,
    dpi: Annotated[int, typer.Option("--dpi", min=20, max=2400, help="Resolution of .png.")] = 200,
    interactive: Annotated[bool, typer.Option("--interactive", help="Open a window (PyVista) instead.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Draw a picture (.png, .pdf, .svg): blocks, stresses, forces, histories, profiles, energies.

    Without -o the picture gets the name of the results and the kind, as slope_blocks.png; an existing one is replaced.
    Several results files are drawn side by side with one colour scale.

    Examples:

        rockdda-post plot slope.h5

        rockdda-post plot slope.h5 --field stress_x --units m,s,kN -o slope.pdf

        rockdda-post plot slope.h5 --kind contacts --time 0.5

        rockdda-post plot roof.h5 --kind profile --field displacement_y --line=-5,2,5,2

        rockdda-post plot roof.h5 --kind history --column measured_displacement

        rockdda-post plot phi20.h5 phi30.h5 phi40.h5 --label 20° --label 30° --label 40°
    """
    import matplotlib as mpl

    if not interactive:
        mpl.use("Agg")
    from . import plot

    framed = kind not in ("history", "energy", "iterations") or interactive or len(files) > 1
    runs = [open_results(path, frame, field, framed) for path in files]
    if time is not None and framed:
        frame = runs[0].frame_at(time).index
    if interactive:
        plot.interactive(runs[0], field, frame, units=units)
        return
    given = {"scale": scale, "limits": limits, "title": title, "columns": columns or None, "units": units}
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if line is not None:
        options["line"] = _four_numbers(line)
    if not outline:
        options["outline"] = False
    explicit = field if field != "displacement" or kind != "profile" else "displacement_y"
    path = target(output, files[0], f"_{kind if len(runs) == 1 else 'multiples'}.png")
    if len(runs) > 1:
        if kind != "blocks":
            raise InputError(f"several runs side by side are drawn as blocks, not as {kind!r}")
        options.pop("title", None)
        axes = plot.small_multiples(runs, field, frame, labels=labels or None, **options)
    else:
        axes = plot.plot(runs[0], explicit, frame, kind, **options)
    plot.save(axes, path, dpi)
    shown = runs[0].frames[frame].index if framed else None
    tell(quiet, as_json, str(path), output=path, kind=kind, frame=shown)


def _four_numbers(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 4:
        raise InputError(f"line {text!r}: expected x1,y1,x2,y2")
    return numbers


@app.command(name="animate")
def animate_command(
    file: ResultsFile,
    output: Output = None,
    field: FieldName = "displacement",
    every: Annotated[int, typer.Option("--every", min=1, help="Take every n-th frame.")] = 1,
    fps: Annotated[float, typer.Option("--fps", min=0.1, max=240, help="Frames per second of .mp4 and .gif.")] = 20.0,
    scale: Scale = 1.0,
    limits: Limits = None,
    units: UnitNames = None,
    title: Annotated[str | None, typer.Option("--title", help="Title of the film.", show_default=False)] = None,
    outline: Annotated[bool, typer.Option("--outline/--no-outline", help="Show the start, too.")] = True,
    dpi: Annotated[int, typer.Option("--dpi", min=20, max=600, help="Resolution of .mp4 and .gif.")] = 120,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Make a film: .mp4, .gif, or one .html page that plays in any browser.

    The page needs no network: one can scrub, zoom, choose the field and pick a block to see its history.

    Examples:

        rockdda-post animate slope.h5 -o slope.mp4

        rockdda-post animate slope.h5 -o slope.html --field stress --units m,s,N

        rockdda-post animate slope.h5 -o slope.gif --every 5 --fps 10 --scale 100
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from .animate import animate

    results = open_results(file, field=field)
    path = target(output, file, ".mp4")
    with progress_bar("frames", quiet or as_json) as bar:
        animate(
            results, path, field, every=every, fps=fps, scale=scale, limits=limits, units=units, title=title,
            outline=outline, dpi=dpi, progress=bar,
        )  # fmt: skip
    frames = (results.n_frames - 1) // every + 1 + ((results.n_frames - 1) % every != 0)
    size = path.stat().st_size
    tell(quiet, as_json, f"{path}: {frames} frames, {size / 1e6:.2f} MB", output=path, frames=frames, bytes=size)


@app.command(name="view")
def view_command(
    file: ResultsFile,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Port on this machine; 0: any free one.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the browser.")] = True,
    field: FieldName = "displacement",
    units: UnitNames = None,
) -> None:
    """Show results in the browser, also of a run that still goes on. Ctrl-C ends it.

    Play and scrub, zoom and move, pick a block to see its values and their history. The page is served on this
    machine only.

    Examples:

        rockdda-post view slope.h5

        rockdda-post view slope.h5 --no-browser --port 8000
    """
    from .view import view

    results = open_results(file, field=field)
    view(
        results,
        port,
        browser,
        field,
        units,
        lambda address: typer.echo(f"{file} is shown at {address} (Ctrl-C ends it)"),
    )


@app.command(name="export")
def export_command(
    file: ResultsFile,
    output: Output = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="pvd (or vtk), vtu, csv, txt (or text), dxf; by default the output's ending.",
            show_default=False,
        ),
    ] = None,
    table: Annotated[
        str, typer.Option("--table", help="Of a .csv: history, blocks, vertices or contacts.")
    ] = "history",
    frames: Annotated[
        str | None,
        typer.Option("--frames", help="Such as -1, 0,5,10 or 0:50:10; by default all.", show_default=False),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Write results for other programs: VTK, CSV, plain text, DXF.

    .pvd: all frames for ParaView and PyVista (.vtu: one frame); .csv: a table; .txt: lines `block vertex x y` for each
    frame; .dxf: the outlines of one frame.

    Examples:

        rockdda-post export slope.h5 -o slope.pvd

        rockdda-post export slope.h5 -o history.csv

        rockdda-post export slope.h5 -o blocks.csv --table blocks --frames -1

        rockdda-post export slope.h5 -o outlines.txt --frames 0:100:10

        rockdda-post export slope.h5 -o end.dxf
    """
    from . import export

    results = open_results(file, frames=False)
    kind = {"vtk": "pvd", "text": "txt"}.get(kind.lower(), kind.lower()) if kind else None
    if output is not None and output.is_dir():
        output = output / f"{file.stem}.{kind or 'pvd'}"
    path = target(output, file, f".{kind or 'pvd'}")
    form = kind or path.suffix.lstrip(".").lower() or "pvd"
    if form not in ("pvd", "vtu", "csv", "txt", "dxf"):
        raise InputError(f"unknown format {form!r}; the formats are: pvd, vtu, csv, txt, dxf", path)
    if form in ("pvd", "vtu") and path.suffix.lower() != f".{form}":
        path = path.with_name(path.name + f".{form}")
    if form != "csv" or table != "history":
        open_results(file)  # frames are needed
    numbers = export.parse_frames(frames, results.n_frames)
    for number in numbers or ():
        if not -results.n_frames <= number < results.n_frames:
            raise InputError(f"there are frames 0 to {results.n_frames - 1}, not {number}", file)
    if form in ("vtu", "dxf"):
        if numbers is not None and len(numbers) != 1:
            raise InputError(f".{form} takes one frame, not {len(numbers)}")
        numbers = [-1] if numbers is None else numbers
    with progress_bar("frames", quiet or as_json) as bar:
        if form in ("pvd", "vtu"):
            export.to_vtk(results, path, numbers, bar)
        elif form == "csv":
            export.to_csv(results, path, table, numbers, bar)
        elif form == "txt":
            export.to_text(results, path, numbers, bar)
        else:
            assert numbers is not None
            export.to_dxf(results, path, numbers[0])
    count = results.n_frames if numbers is None else len(numbers)
    what = f"{results.n_steps} steps" if form == "csv" and table == "history" else f"{count} frames"
    tell(quiet, as_json, f"{path}: {what}", output=path, format=form, frames=count)


@app.command(name="convert")
def convert_command(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...", help="DDAML (.geo, .ana, or their folder), .dxf, .geojson.", show_default=False
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Stem or folder of the files to write.", show_default=False),
    ] = None,
    layers: Annotated[
        list[str] | None,
        typer.Option("--layer", metavar="NAME=KIND", help="What a layer of a drawing is.", show_default=False),
    ] = None,
    e0: Annotated[float | None, typer.Option("--e0", help="Edge-node distance.", show_default=False)] = None,
    chord: Annotated[
        float | None, typer.Option("--chord", help="Distance of chords from curves.", show_default=False)
    ] = None,
    template: Annotated[bool, typer.Option("--template", help="Write an analysis file to fill in, too.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Convert DDAML of DDA for Windows, DXF drawings and GeoJSON lines to input files (.dc, .df, .nml).

    Kinds of layers: joint:N, boundary:N (joint material N), material:N (block material), fixed, loading, measured,
    hole, bolt, skip. Layers named like that need no option; other layers get joint materials in alphabetical order.

    Examples:

        rockdda-post convert pushblock.geo pushblock.ana -o push

        rockdda-post convert slope.dxf --layer FAULTS=joint:2 --layer TEXT=skip --e0 0.01 --template

        rockdda-post convert traces.geojson -o traces
    """
    from .convert import convert

    named: dict[str, str] = {}
    for entry in layers or []:
        name, found, kind = entry.rpartition("=")
        if not found:
            raise InputError(f"layer {entry!r}: expected NAME=KIND, such as FAULTS=joint:2")
        named[name] = kind
    for name, value in (("e0", e0), ("chord", chord)):
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"{name} must be positive, found {value:g}")
    done = convert(files, output, layers=named, e0=e0, chord=chord, template=template, force=force)
    if not quiet:
        for message in done.messages:
            typer.echo(message, err=True)
    messages = [{"severity": p.severity, "message": p.message, "file": p.file, "line": p.line, "column": p.column}
                for p in done.problems]  # fmt: skip
    tell(quiet, as_json, "\n".join(map(str, done.files)), files=list(map(str, done.files)), messages=messages)


@app.command(name="compare")
def compare_command(
    first: Annotated[Path, typer.Argument(metavar="A.h5", help="One run.", show_default=False)],
    second: Annotated[Path, typer.Argument(metavar="B.h5", help="The other run.", show_default=False)],
    tolerance: Annotated[
        float,
        typer.Option("--tol", min=0.0, help="Allowed difference over the largest value of a dataset; 0: same bits."),
    ] = 0.0,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Say where and when two runs part: dataset, step, time, block and size.

    Exit code 0: they agree; 1: they differ; 2: they cannot be compared.

    Examples:

        rockdda-post compare old.h5 new.h5

        rockdda-post compare old.h5 new.h5 --tol 1e-9 && echo still the same
    """
    from .compare import compare

    a, b = open_results(first, frames=False), open_results(second, frames=False)
    with progress_bar("tables", quiet or as_json) as bar:
        found = compare(a, b, tolerance, bar)
    if as_json:
        code = DONE if found.same else DIFFERENT
        typer.echo(json.dumps({"status": "done", "exit_code": code} | found.as_dict(), default=str))
    elif found.same and not quiet:
        kind = "the same bits" if tolerance == 0 else f"no difference beyond {tolerance:g} of the largest values"
        typer.echo(f"{first} and {second}: {kind} in {len(found.compared)} datasets")
    elif not quiet:
        for number, difference in enumerate(found.differences):
            part = "they part in " if number == 0 else ""
            size = "" if difference.largest is None else f"; at most {difference.largest:.3g}"
            size += "" if difference.relative is None else f" ({difference.relative:.1e} of the largest value)"
            typer.echo(f"{part}{difference.dataset}: {difference.message}{size}")
    if not found.same:
        raise typer.Exit(DIFFERENT)


def version() -> str:
    """Of this package."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed

    try:
        return installed("rockdda")
    except PackageNotFoundError:
        return "not installed"


def _version_option(value: bool) -> None:
    if value:
        typer.echo(f"rockdda-post {version()}")
        raise typer.Exit


@app.callback()
def _common(
    _: Annotated[
        bool, typer.Option("--version", callback=_version_option, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


cli_study.register(app)
cli_validate.register(app)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code. No error shows a traceback, unless ROCKDDA_TRACEBACK is set."""
    usage_error = typer.BadParameter.__mro__[1]
    click_error = usage_error.__mro__[1]
    try:
        code = app(arguments, standalone_mode=False)
    except click_error as error:  # type: ignore[misc]
        typer.echo(f"rockdda-post: error: {error.format_message()}", err=True)  # type: ignore[attr-defined]
        return BAD_INPUT
    except InputError as error:
        text = str(error)
        typer.echo(text if error.file else f"rockdda-post: {text}", err=True)
        return BAD_INPUT
    except OutputError as error:
        typer.echo(f"rockdda-post: error: {error}", err=True)
        return NO_OUTPUT
    except ConvergenceError as error:
        typer.echo(f"rockdda-post: error: {error}", err=True)
        return NO_CONVERGENCE
    except RockddaError as error:
        typer.echo(f"rockdda-post: error: {error}", err=True)
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        return STOPPED
    except BrokenPipeError:  # the reader of our output has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        if os.environ.get("ROCKDDA_TRACEBACK"):
            raise
        text = f"internal error: {type(error).__name__}: {error}. This is a bug, please report it with the command"
        typer.echo(f"rockdda-post: {text}; ROCKDDA_TRACEBACK=1 shows where.", err=True)
        return INTERNAL
    return STOPPED if code == 130 else int(code or 0)  # 130: typer's word for Ctrl-C


def run() -> None:
    """The entry point of the command."""
    sys.exit(main())


if __name__ == "__main__":
    run()
