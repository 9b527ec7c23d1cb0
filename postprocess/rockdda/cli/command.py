# SPDX-License-Identifier: MIT
"""The command `rockdda-post`, and its commands for pictures: plot, animate, view."""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
import warnings
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer
from typer import Argument, Option
from typer.completion import get_completion_script

from ..errors import ConvergenceError, InputError, InputWarning, OutputError, RockddaError
from ..fields import JOINT_FIELDS
from . import certainty, common, exchange, studies
from .common import BAD_INPUT, DONE, INTERNAL, NO_CONVERGENCE, NO_OUTPUT, STOPPED, in_shown_units, open_results

#: Fields of kinds of pictures where none is given; but for profiles they have fields of their own, not those of blocks.
USUAL_FIELDS = {"joints": "normal_stress", "bolts": "force", "liner": "", "capacity": "", "profile": "displacement_y"}
#: Commands of the program, which are no commands here.
PROGRAM_COMMANDS = ("new", "lines", "cut", "run", "resume", "fos", "check", "info", "help")

app = typer.Typer(
    name="rockdda-post",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    help="""Pictures, films, tables and conversions for RockDDA.

    Each command has its own help with examples: `rockdda-post plot --help`.

    Exit codes: 0 done; 1 internal error (of `compare`: the runs differ; of `validate`: a promise is broken); 2 bad
    usage or bad input; 3 a computation could not continue; 4 stopped (Ctrl-C, SIGTERM); 5 output could not be written.
    """,
)


@app.command(name="plot")
def plot_command(
    files: Annotated[list[Path], Argument(metavar="FILE...", help="Results files, or one geometry or block file.")],
    output: common.Output = None,
    kind: Annotated[
        str | None,
        Option(
            "--kind",
            "-k",
            help="blocks (the default), contours, stress (crosses), trajectories, thrust, contacts, joints, "
            "displacements, water, bolts, liner (N, M, Q; or one by --field), capacity, "
            "history, profile, joint-profile, energy, iterations, ground-reaction, "
            "mechanism or factor; of a geometry file lines (the default) or blocks.",
        ),
    ] = None,
    field: common.PlotFieldName = "displacement",
    frame: common.FrameNumber = -1,
    time: Annotated[float | None, Option(help="Take the frame nearest to this time.")] = None,
    scale: Annotated[float | None, Option(help="Factor on the displacements, or on the arrows.")] = None,
    units: common.UnitNames = None,
    show: common.ShownUnits = None,
    limits: common.Limits = None,
    line: Annotated[str | None, Option(metavar="X1,Y1,X2,Y2", help="Line of a profile or joint profile.")] = None,
    columns: Annotated[list[str] | None, Option("--column", "-c", help="Column of a history; may be repeated.")] = None,
    stage: Annotated[
        str | None, Option(help="Stage of a history, of energies or iterations; excavation of a ground reaction.")
    ] = None,
    joints: Annotated[
        list[int] | None, Option("--joint", help="Joint material with water pressures; may be repeated.")
    ] = None,
    heads: Annotated[bool, Option("--heads", help="Contours of the head of water.")] = False,
    window: Annotated[str | None, Option(metavar="X0,Y0,X1,Y1", help="Part of the model that is shown.")] = None,
    labels: Annotated[list[str] | None, Option("--label", help="Name of a run among several, in their order.")] = None,
    title: Annotated[str | None, Option(help="Title of the picture.")] = None,
    outline: common.Outline = True,
    dpi: common.Resolution = 200,
    interactive: Annotated[bool, Option("--interactive", help="Open a window (PyVista) instead.")] = False,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Draw a picture (.png, .pdf, .svg): blocks, stresses, forces, joints, histories, profiles, energies.

    Without -o the picture gets the name of the results and the kind, as slope_blocks.png; an existing one is replaced.
    Several results files are drawn side by side with one colour scale. A geometry file is drawn before any run: its
    lines by joint material, or the blocks that they make (--kind blocks), with points and bolts; so is a block file.

    Examples:

        rockdda-post plot slope.dc

        rockdda-post plot slope.h5

        rockdda-post plot slope.h5 --field stress_x --units m,s,N --show m,s,kN -o slope.pdf

        rockdda-post plot slope.h5 --kind contacts --time 0.5

        rockdda-post plot slope.h5 --kind joints --field mobilised --window 10,0,20,8

        rockdda-post plot roof.h5 --kind profile --field displacement_y --line=-5,2,5,2

        rockdda-post plot dam.h5 --kind joint-profile --line=0,0,30,0

        rockdda-post plot roof.h5 --kind history --column measured_displacement

        rockdda-post plot dam.h5 --kind history --stage quake

        rockdda-post plot tunnel.h5 --kind ground-reaction --stage heading

        rockdda-post plot failing.h5 --kind mechanism

        rockdda-post plot phi20.h5 phi30.h5 phi40.h5 --label 20° --label 30° --label 40°"""
    if not interactive:
        common.draw_into_files()
    from .. import plot

    if any(plot.is_input(path) for path in files):
        given_options = (("scale", scale), ("limits", limits), ("line", line), ("column", columns), ("label", labels))
        unused = [name for name, value in (*given_options, ("time", time)) if value] + ["interactive"] * interactive
        if len(files) > 1:
            raise InputError("geometry and block files are drawn one at a time")
        if unused:
            raise InputError(f"--{unused[0]} is for results, not for a geometry or block file", files[0])
        shown_part = None if window is None else common.numbers("window", window)
        drawn = plot.input_plot(files[0], kind, units=units, title=title, window=shown_part)
        path = common.target(output, files[0], f"_{kind or 'input'}.png")
        plot.save(drawn, path, dpi)
        common.print_summary(quiet, as_json, str(path), output=path, kind=kind or "input")
        return
    kind = kind or ("joints" if field in JOINT_FIELDS else "blocks")
    if kind == "joints" and field != "displacement":
        plot.joint_field_name(field)
    of_blocks = field if kind == "profile" or kind not in USUAL_FIELDS else None
    field = USUAL_FIELDS.get(kind, field) if field == "displacement" else field
    framed = (
        kind not in ("history", "energy", "iterations", "ground-reaction", "factor") or interactive or len(files) > 1
    )
    opened = [in_shown_units(open_results(path, frame, of_blocks, framed), units, show) for path in files]
    runs, units = [run for run, _ in opened], opened[0][1]
    if time is not None and framed:
        frame = runs[0].frame_at(time).index
    if interactive:
        common.need_display()
        plot.interactive(runs[0], field, frame, units=units)
        return
    given = {
        "scale": scale, "limits": limits, "title": title, "columns": columns or None, "units": units, "stage": stage,
        "joints": joints or None, "heads": heads or None, "outline": None if outline else False,
        "line": None if line is None else common.numbers("line", line),
        "window": None if window is None else common.numbers("window", window),
    }  # fmt: skip
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    path = common.target(output, files[0], f"_{kind if len(runs) == 1 else 'multiples'}.png")
    if len(runs) > 1:
        if kind != "blocks":
            raise InputError(f"several runs side by side are drawn as blocks, not as {kind!r}")
        options.pop("title", None)
        axes = plot.small_multiples(runs, field, frame, labels=labels or None, **options)
    else:
        axes = plot.plot(runs[0], field or None, frame, kind, **options)
    plot.save(axes, path, dpi)
    shown = runs[0].frames[frame].index if framed else None
    common.print_summary(quiet, as_json, str(path), output=path, kind=kind, frame=shown)


@app.command(name="animate")
def animate_command(
    file: common.ResultsFile,
    output: common.Output = None,
    field: common.FieldName = "displacement",
    every: Annotated[int, Option(min=1, help="Take every n-th frame.")] = 1,
    fps: Annotated[float, Option(min=0.1, max=240, help="Frames per second of .mp4 and .gif.")] = 20.0,
    scale: common.Scale = 1.0,
    limits: common.Limits = None,
    units: common.UnitNames = None,
    show: common.ShownUnits = None,
    title: Annotated[str | None, Option(help="Title of the film.")] = None,
    outline: common.Outline = True,
    dpi: Annotated[int, Option(min=20, max=600, help="Resolution of .mp4 and .gif.")] = 120,
    joints: Annotated[bool, Option("--joints", help="Of .html: keep stresses, opening and slip of joints.")] = False,
    liner: Annotated[str, Option(help="Of .mp4 and .gif: colour of linings, use (of strength), N, M or Q.")] = "use",
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Make a film: .mp4, .gif, or one .html page that plays in any browser.

    The page needs no network: one can scrub, zoom, choose the field and pick a block to see its history.

    Examples:

        rockdda-post animate slope.h5 -o slope.mp4

        rockdda-post animate slope.h5 -o slope.html --field stress_min --units m,s,N --joints

        rockdda-post animate slope.h5 -o slope.gif --every 5 --fps 10 --scale 100

        rockdda-post animate tunnel.h5 -o tunnel.mp4 --field stress_min --liner N"""
    common.draw_into_files()
    from ..film.recording import animate

    results, units = in_shown_units(open_results(file, field=field), units, show)
    path = common.target(output, file, ".mp4")
    with common.progress_bar("frames", quiet or as_json) as bar:
        animate(
            results, path, field, every=every, fps=fps, scale=scale, limits=limits, units=units, title=title,
            outline=outline, dpi=dpi, joints=joints, liner=liner, progress=bar,
        )  # fmt: skip
    frames = (results.n_frames - 1) // every + 1 + ((results.n_frames - 1) % every != 0)
    size = path.stat().st_size
    common.print_summary(
        quiet, as_json, f"{path}: {frames} frames, {size / 1e6:.2f} MB", output=path, frames=frames, bytes=size
    )


@app.command(name="view")
def view_command(
    file: Annotated[Path, Argument(metavar="FILE", help="Results, or a model.")],
    beside: Annotated[Path | None, Argument(metavar="OTHER.h5", help="Results to compare with.")] = None,
    port: Annotated[int, Option(min=0, max=65535, help="Port on this machine; 0: any free one.")] = 0,
    browser: Annotated[bool, Option("--browser/--no-browser", help="Open the browser.")] = True,
    field: common.FieldName = "displacement",
    units: common.UnitNames = None,
    show: common.ShownUnits = None,
) -> None:
    """Show results, or a model before any run, in the browser. Ctrl-C ends the server.

    Results (also during the run): play and scrub, zoom and move, pick a block to see its values and their history.
    With two results: both side by side, at the same moment, field and section.
    A model (.nml, .dc, .blk or a folder): lines, blocks, regions, boundaries, water and stages, with the messages of
    `rockdda check` at their places; the page follows the files as they are edited. It is served on this machine only.

    Examples:

        rockdda-post view slope.h5

        rockdda-post view slope.h5 --no-browser --port 8000

        rockdda-post view dry.h5 wet.h5

        rockdda-post view slope.nml"""
    from ..film.server import view
    from ..plot.input_files import is_input

    def ready(address: str) -> None:
        typer.echo(f"{file} is shown at {address} (Ctrl-C ends it)")

    if file.is_dir() or is_input(file):
        if beside is not None:
            raise InputError("a model is shown alone; two results are compared", beside)
        view(file, port, browser, ready=ready)
        return
    other = None if beside is None else in_shown_units(open_results(beside, field=field), units, show)[0]
    results, units = in_shown_units(open_results(file, field=field), units, show)
    view(results, port, browser, field, units, ready, other)


@app.command(name="report")
def report_command(
    file: common.ResultsFile,
    output: common.Output = None,
    units: common.UnitNames = None,
    title: Annotated[str | None, Option(help="Title of the report.")] = None,
    project: Annotated[str, Option(help="Project, at the head.")] = "",
    author: Annotated[str, Option(help="Who signs it.")] = "",
    date: Annotated[str, Option(help="Date of the report.")] = "",
    question: Annotated[str, Option(help="What the model is to answer.")] = "",
    sources: Annotated[
        list[str] | None,
        Option(
            "--source",
            metavar="NAME=TEXT",
            help="Where the values of a material, or of loads, water …, come from; may be repeated.",
        ),
    ] = None,
    check_step: Annotated[
        bool, Option("--check-step", help="Run the model again at half the time step, and compare.")
    ] = False,
    half: Annotated[
        Path | None, Option(metavar="OTHER.h5", help="Compare with this run at half the time step.")
    ] = None,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Write a report to hand in: one .html page, or .pdf on A4.

    In the order of an engineer: question, model, parameters with their sources, stages, result with its ± (of
    rockdda-post convergence, where it lies beside), checks (energy balance, overlap of blocks, unbalanced forces), and
    the input for reproduction. What is not given (project, author, date, sources) is a field to be filled in, in the
    browser or by hand. Whether half the time step gives the same is checked with --check-step only, by a second run. A
    .pdf takes WeasyPrint (pip install weasyprint) or Chromium.

    Examples:

        rockdda-post report tunnel.h5

        rockdda-post report tunnel.h5 -o tunnel.pdf --units SI --title "Tunnel, section 12" --author "A. B."

        rockdda-post report slope.h5 --source "bedding=shear tests of the laboratory"

        rockdda-post report slope.h5 --half slope_half.h5"""
    common.draw_into_files()
    from ..report import Cover, report
    from ..report.paper import needs_for_pdf

    given = [entry.partition("=") for entry in sources or []]
    if unclear := [name for name, sign, _ in given if not (name and sign)]:
        raise InputError(f"--source: expected NAME=TEXT, found {unclear[0]!r}")
    cover = Cover(project, author, date, question, {name.strip(): text.strip() for name, _, text in given})
    results, units = in_shown_units(open_results(file), units, None)
    other = None if half is None else in_shown_units(open_results(half), units, None)[0]
    path = common.target(output, file, "_report.html")
    with common.progress_bar("pictures", quiet or as_json) as bar:
        report(
            results, path, units=units, title=title, cover=cover, check_step=check_step, beside=other, progress=bar
        )  # fmt: skip
    size = path.stat().st_size
    by = f", laid out by {Path(needs_for_pdf()).name}" if path.suffix.lower() == ".pdf" else ""
    common.print_summary(quiet, as_json, f"{path}: {size / 1e6:.2f} MB{by}", output=path, bytes=size)


def version() -> str:
    """Of this package."""
    from ..version import __version__

    return __version__


def _version_option(value: bool) -> None:
    if value:
        typer.echo(f"rockdda-post {version()}")
        raise typer.Exit


@app.callback()
def _common(
    _: Annotated[bool, Option("--version", callback=_version_option, is_eager=True, help="Show the version.")] = False,
) -> None:
    pass


for _module in (exchange, studies, certainty):
    for _name, _command in _module.COMMANDS.items():
        app.command(name=_name)(_command)

try:
    from rockdda_validation.command import validate_command

    app.command(name="validate")(validate_command)
except ModuleNotFoundError as _error:
    if _error.name != "rockdda_validation":
        raise

    @app.command(name="validate", context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
    def _without_cases() -> None:
        """Run the cases of the validation, which come with the source of RockDDA."""
        advice = "take rockdda-post of the folder build/bin there"
        raise RockddaError(f"the cases of the validation come with the source of RockDDA, in no wheel: {advice}")


class Shell(StrEnum):
    """Shells with a script."""

    bash = "bash"
    zsh = "zsh"
    fish = "fish"


@app.command(name="completion")
def completion_command(shell: Annotated[Shell, Argument(metavar="bash|zsh|fish", help="The shell.")]) -> None:
    """Print a script that completes commands, options and field names.

    Examples:

        eval "$(rockdda-post completion bash)"

        rockdda-post completion fish | source"""
    script = get_completion_script(
        prog_name="rockdda-post", complete_var="_ROCKDDA_POST_COMPLETE", shell=shell.value
    ).strip()
    if shell is Shell.zsh:  # evaluated, not found in a folder of functions
        script = f"autoload -U +X compinit && compinit\n{script}"
    typer.echo(script)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code. No error shows a traceback, unless ROCKDDA_TRACEBACK is set."""
    usage_error = typer.BadParameter.__mro__[1]
    click_error = usage_error.__mro__[1]
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # names of files in any encoding are printed as they are
            stream.reconfigure(errors="surrogateescape")
    try:
        code = app(arguments, prog_name="rockdda-post", standalone_mode=False)
        if sys.stdout is not None:
            sys.stdout.flush()
    except click_error as error:  # type: ignore[misc]
        text = error.format_message() or "no command given"  # type: ignore[attr-defined]
        named = re.match(r"No such command '(\w+)'", text)
        if named and named[1] in PROGRAM_COMMANDS:
            text = f"{text.rstrip('.')}; it is `rockdda {named[1]}`"
        return _end(BAD_INPUT, f"error: {text}")
    except InputError as error:
        return _end(BAD_INPUT, str(error), "" if error.file else "rockdda-post: ")
    except OutputError as error:
        return _end(NO_OUTPUT, f"error: {error}")
    except ConvergenceError as error:
        return _end(NO_CONVERGENCE, f"error: {error}")
    except RockddaError as error:
        return _end(BAD_INPUT, f"error: {error}")
    except (KeyboardInterrupt, typer.Abort):
        return _end(STOPPED)
    except OSError as error:
        if not isinstance(error, BrokenPipeError) and _can_write(sys.stdout):
            return _internal(error)
        _leave_stdout()
        if isinstance(error, BrokenPipeError):  # the reader of the output has ended
            return _end(DONE)
        return _end(NO_OUTPUT, f"error: standard output cannot be written: {error.strerror}")
    except SystemExit as error:
        # of Rich, when the reader of a help page has gone; of the completion, which ends so
        completes = isinstance(error.code, int) and "_ROCKDDA_POST_COMPLETE" in os.environ
        return int(error.code or 0) if completes else DONE
    except ImportError as error:  # the compiled part or a library is missing
        return _end(BAD_INPUT, f"error: {error}")
    except Exception as error:
        return _internal(error)
    return STOPPED if code == 130 else int(code or 0)  # 130: typer's exit code for Ctrl-C


def _internal(error: Exception) -> int:
    if os.environ.get("ROCKDDA_TRACEBACK"):
        raise error
    text = f"internal error: {type(error).__name__}: {error}. This is a bug, please report it with the command"
    return _end(INTERNAL, f"{text}; ROCKDDA_TRACEBACK=1 shows where.")


def _end(code: int, message: str = "", prefix: str = "rockdda-post: ") -> int:
    """The exit code, after a message on standard error where that can be written."""
    if message:
        with contextlib.suppress(OSError):
            typer.echo(prefix + message, err=True)
    return code


def _can_write(stream: Any) -> bool:
    """Can the buffer of a stream be written?"""
    try:
        stream.write("")
        stream.flush()
    except (OSError, ValueError, AttributeError):
        return False
    return True


def _leave_stdout() -> None:
    """Discard the rest of the buffer of standard output, which the interpreter could not write at its end."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int,
    file: TextIO | None = None, line: str | None = None,
) -> None:  # fmt: skip
    """Warnings of the program are printed as it prints them, without the line of Python that they come from."""
    if not issubclass(category, InputWarning):
        print(f"{category.__name__}: {message}", file=sys.stderr)
        return
    text = str(message)
    print(text if "warning: " in text else f"warning: {text}", file=sys.stderr)


def run() -> None:
    """The entry point of the command."""
    warnings.showwarning = _show_warning
    for number in range(3):  # a file that is opened later must not get the number of a closed stream
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    common.stop_on_sigterm()
    sys.exit(main())


if __name__ == "__main__":
    run()
