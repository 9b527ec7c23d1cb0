# SPDX-License-Identifier: MIT
"""The commands of `rockdda-post` for studies, tests and rules of design."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from ..errors import InputError
from ..fields import GRADIENT_LIMIT, WINDOW
from ..text import csv_text
from ..writing import complete_file, write_file, written_to
from . import common

if TYPE_CHECKING:
    from ..study import Outcome

#: Seconds that another process has to end a case, which a scheduler has started once more.
_PATIENCE = 120.0
#: A case that is stopped so soon [s] got its signal at once: Slurm sends it up to a minute early.
_SOON = 60.0


Workers = Annotated[int | None, Option("--workers", "-j", min=1, help="Runs at a time; default: one a core.")]


def study_command(
    file: Annotated[Path, Argument(metavar="STUDY.toml", help="The study.")],
    workers: Workers = None,
    retry: common.Retry = False,
    dask: common.Dask = None,
    slurm: common.Slurm = False,
    table: Annotated[bool, Option("--table", help="Run nothing: collect the results so far.")] = False,
    case: Annotated[int | None, Option(min=1, help="Run this case only, by its number.")] = None,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FOLDER", help="Write here instead.")] = None,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Run a template over a grid of parameters; one table and small multiples at the end.

    Cases that are done are not run again; interrupted ones continue from their checkpoint; failed ones are listed,
    and run again with --retry. Ctrl-C stops the runs after their present step. The exit code is 3 when cases have
    failed, 4 when some are not done.

    Examples:

        rockdda-post study tunnels.toml

        rockdda-post study tunnels.toml --workers 8 --retry

        rockdda-post study tunnels.toml --slurm && sbatch tunnels/job-array.sh

        rockdda-post study tunnels.toml --dask tcp://head:8786"""
    common.draw_into_files()
    from ..study.case import prepare_case
    from ..study.definition import read_study
    from ..study.job_array import logs_of, warning_of, write_job_array
    from ..study.runner import collect, run_study

    study = read_study(file, output)
    if sum((slurm, table, case is not None, dask is not None)) > 1:
        raise InputError("--slurm, --table, --case and --dask exclude each other")
    if slurm:
        path = write_job_array(study, retry=retry)
        warning = warning_of(study)
        told = f"{path}: submit it with sbatch; a case is stopped {warning} s before the end of its time"
        common.print_summary(quiet, as_json, told, script=path, warning=warning)
        return
    if case is not None:
        if case > len(study.cases):
            raise InputError(f"there is no case {case}; the study has cases 1 to {len(study.cases)}", file)
        outcome = _one_case(study, case, prepare_case)
        code = outcome.exit_code
        if outcome.message:
            typer.echo(outcome.message, err=True)
        common.print_summary(
            quiet, as_json, f"case {case}: {outcome.status}, {outcome.seconds:.1f} s", case=case, run_exit_code=code
        )
        raise typer.Exit(code if code in (0, common.STOPPED) else common.NO_CONVERGENCE)

    outcomes: list[Outcome] = []
    if not table:
        with common.runs_bar(quiet, as_json, lambda outcome: outcome.status) as report:
            outcomes = run_study(study, workers=workers, retry=retry, dask=dask, progress=report)
    rows = collect(study)
    written = _write_table(study, rows)
    count = {
        status: int((rows["status"] == status).sum()) for status in ("done", "failed", "stopped", "running", "waiting")
    }
    unfinished = len(rows) - count["done"] - count["failed"]
    if not quiet:
        for _, row in rows[(rows["status"] != "done") & (rows["message"] != "")].iterrows():
            said = (str(row["message"]).splitlines() or [""])[0]
            typer.echo(
                f"case {row['case']} {'failed' if row['status'] == 'failed' else 'is not done'}: {said}", err=True
            )
    summary = ", ".join(f"{number} {status}" for status, number in count.items() if number)
    common.print_summary(
        quiet,
        as_json,
        f"{study.title}: {len(rows)} cases, {summary}\n" + "\n".join(map(str, written)),
        cases=len(rows),
        run_now=len(outcomes),
        files=list(map(str, written)),
        **count,
    )
    script = study.output / "job-array.sh"
    if unfinished and not quiet:
        how = f"submit {script} again when its tasks have ended (logs: {logs_of(study)})" if script.exists() else ""
        typer.echo(f"{unfinished} of {len(rows)} cases are not done: {how or 'the same command continues'}", err=True)
    if count["failed"]:
        raise typer.Exit(common.NO_CONVERGENCE)
    if unfinished:
        raise typer.Exit(common.STOPPED)


def _one_case(study: Any, number: int, prepare: Any) -> Outcome:
    """Run one case that is not done, as a task of a job array does; SIGTERM lets it write its checkpoint."""
    from ..study.case import finished_case, read_status, run_case, write_status
    from ..study.job_array import warning_of

    wanted = study.cases[number - 1]
    done = finished_case(study, wanted)
    if done is not None:
        return done
    folder = prepare(study, wanted)
    children: list[Any] = []
    start, stopped = time.monotonic(), []

    def stop(*_: object) -> None:
        stopped.append(time.monotonic() - start)
        for child in children:
            child.terminate()

    signal.signal(signal.SIGTERM, stop)
    found = run_case(str(folder), children.append, _PATIENCE)
    if found.status == "stopped" and stopped and stopped[0] < _SOON and os.environ.get("SLURM_JOB_ID"):
        note = (
            f"stopped {stopped[0]:.0f} s after its start: where nobody cancelled it, the time of the job (--time) is "
            f"hardly longer than the warning of {warning_of(study)} s before its end; give it more"
        )
        found = replace(found, message=f"{note}. {found.message}")
        write_status(folder, {**read_status(folder), "message": found.message})
    return found


def _write_table(study: Any, rows: Any) -> list[Path]:
    """The table as CSV (and Parquet where pyarrow is installed), and the small multiples."""
    from .. import plot
    from ..study.runner import plot_study

    with written_to(study.output):
        study.output.mkdir(parents=True, exist_ok=True)
        written = [study.output / "table.csv"]
        write_file(written[0], csv_text(rows))
        with contextlib.suppress(ImportError), complete_file(study.output / "table.parquet") as part:
            rows.to_parquet(part, index=False)
            written.append(study.output / "table.parquet")
        if study.quantities and (rows["status"] == "done").any():
            try:
                plot.save(plot_study(study, rows).axes, study.output / "table.png")
                written.append(study.output / "table.png")
            except InputError:
                pass  # nothing varies that could be drawn
    return written


def loosening_command(
    files: Annotated[list[Path], Argument(metavar="OUT.h5...", help="Results files.")],
    window: Annotated[
        float, Option(show_default="2/3", help="Share of the run, at its end, in which oscillations are looked at.")
    ] = WINDOW,
    limit: Annotated[float, Option(help="Difference over distance up to which points move together.")] = GRADIENT_LIMIT,
    quiet: Annotated[bool, Option("--quiet", "-q", help="No summary.")] = False,
    as_json: common.Json = False,
) -> None:
    """Height of loosened rock above an opening, from measured points on a vertical line above its crown.

    A point is held when it oscillates about an equilibrium; two neighbours arch together when the difference of their
    displacements over their distance stays below the limit. Loosening reaches up to where both hold.

    Examples:

        rockdda-post loosening tunnel.h5

        rockdda-post loosening tunnels/cases/*/out.h5"""
    from ..analysis.loosening import loosening_of

    if not 0 < window <= 1:
        raise InputError(f"--window: must be above 0 and at most 1, found {window:g}")
    if not limit > 0:
        raise InputError(f"--limit: must be above 0, found {limit:g}")
    found = []
    for path in files:
        with common.open_results(path, frames=False) as results:
            try:
                profile = loosening_of(results, window=window, gradient_limit=limit)
            except InputError as error:
                raise InputError(str(error).removeprefix("error: "), error.file or path) from None
            note = "" if results.complete else " (the run has not come to its end)"
        height = profile.height
        found.append({"file": str(path), "height": height if math.isfinite(height) else None} | profile.table())
        if as_json or quiet:
            continue
        if math.isfinite(height):
            verdict = ("stable" if height == 0 else f"loosened, at most {height:g} above the crown") + note
        else:
            verdict = "loosened, beyond the highest point" + note
        if len(files) > 1:
            common.print_summary(False, False, f"{path}: {verdict}")
            continue
        lines = [f"{'height':>8} {'displacement':>13} {'gradient up':>12}  state"]
        for row in zip(*profile.table().values(), strict=True):
            held = "held" if row[3] else "moving"
            together = {True: ", moves with the next", False: ", parts from the next", None: ""}[row[4]]
            gradient = "" if row[2] is None else f"{row[2]:.2e}"
            lines.append(f"{row[0]:8g} {row[1]:13.4g} {gradient:>12}  {held}{together}")
        common.print_summary(False, False, "\n".join([*lines, verdict]))
    if as_json:
        common.print_summary(False, True, "", runs=found)


def voussoir_command(
    span: Annotated[float, Option(help="Span of the roof layer.")],
    thickness: Annotated[float, Option(help="Thickness of the layer.")],
    unit_weight: Annotated[float, Option(help="Weight per volume.")],
    modulus: Annotated[float, Option(help="Elastic modulus of the rock mass.")],
    strength: Annotated[float | None, Option(help="Uniaxial compressive strength.")] = None,
    friction: Annotated[float | None, Option(help="Friction angle of the joints [deg].")] = None,
    variant: Annotated[str, Option(help="Average stress: beer-meek or diederichs-kaiser.")] = "beer-meek",
    quiet: Annotated[bool, Option("--quiet", "-q", help="No summary.")] = False,
    as_json: common.Json = False,
) -> None:
    """The classic voussoir beam: does a roof layer carry itself as a flat arch?

    Units are consistent, for example m, N/m3 and Pa.

    Example:

        rockdda-post voussoir --span 8 --thickness 0.5 --unit-weight 18640 --modulus 7.84e9 --friction 47"""
    from ..analysis.voussoir import DESIGN_BUCKLING_LIMIT, VoussoirBeam, solve_beam

    beam = VoussoirBeam(span, thickness, unit_weight, modulus, strength, friction)
    found = solve_beam(beam, variant)  # type: ignore[arg-type]
    values = {
        "compressed_share": found.compressed_share, "moment_arm": found.moment_arm, "stress": found.stress,
        "thrust": found.thrust, "deflection": found.deflection, "buckling_limit": found.buckling_limit,
        "safety_crushing": found.safety_crushing, "safety_shear": found.safety_shear,
    }  # fmt: skip
    if not found.snaps_through:
        values["required_friction_angle"] = found.required_friction_angle
    lines = [f"{name.replace('_', ' '):24} {value:.5g}" for name, value in values.items() if not math.isnan(value)]
    if found.snaps_through:
        lines.append("the beam snaps through: no arch carries it")
    elif found.buckling_limit > DESIGN_BUCKLING_LIMIT:
        lines.append(f"the buckling limit is above {DESIGN_BUCKLING_LIMIT:g}: not advised in design")
    numbers = {name: None if math.isnan(value) else value for name, value in values.items()}
    common.print_summary(
        quiet, as_json, "\n".join(lines), snaps_through=found.snaps_through, variant=variant, **numbers
    )


def rock_load_command(
    span: Annotated[float, Option(help="Width B of the tunnel.")],
    height: Annotated[float, Option(help="Height of the tunnel.")],
    rqd: Annotated[float | None, Option(help="Rock quality [%], for Rose.")] = None,
    quiet: Annotated[bool, Option("--quiet", "-q", help="No summary.")] = False,
    as_json: common.Json = False,
) -> None:
    """Height of loosened rock above a tunnel by the rules of Terzaghi and Rose.

    Example:

        rockdda-post rockload --span 10 --height 10 --rqd 60"""
    from ..analysis.rock_load import rose, terzaghi

    kinds = ("horizontally stratified", "vertically stratified", "moderately jointed", "blocky")
    loads = [terzaghi(kind, span, height) for kind in kinds]
    if rqd is not None:
        loads.append(rose(rqd, span, height))
    lines = [f"{load.source}, {load.condition}: {load.low:.4g} to {load.high:.4g}" for load in loads]
    entries = [{"source": l.source, "condition": l.condition, "low": l.low, "high": l.high} for l in loads]  # noqa: E741
    common.print_summary(quiet, as_json, "\n".join(lines), loads=entries)


def calibrate_bolt_command(
    file: Annotated[Path, Argument(metavar="TEST.csv", help="Displacement of the head and force.")],
    length: Annotated[float, Option(help="Length in grout [m].")],
    young: Annotated[float, Option(help="Young's modulus of the steel [Pa].")] = 200e9,
    diameter: Annotated[float | None, Option(help="Of the steel [m].")] = None,
    area: Annotated[float | None, Option(help="Of the steel [m²].")] = None,
    free_length: Annotated[float, Option(help="Steel between the measured point and the grout [m].")] = 0.0,
    yield_force: Annotated[float | None, Option(help="Of the steel [N]: points there are left out.")] = None,
    output: common.Output = None,
    dpi: common.Resolution = 200,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Stiffness and strength of the grout of a bolt from a pull test, with a picture.

    The table has its units in the head, such as `displacement [mm], force [kN]`. The bar slips from its head on; the
    fit of this curve gives grout_stiffness and grout_strength with their 95 % intervals. A curve that leaves one of
    them open is refused (exit 2).

    Example:

        rockdda-post calibrate-bolt lab.csv --length 1 --diameter 0.025 --free-length 0.3"""
    common.draw_into_files()
    from .. import plot
    from ..analysis.pull_test import calibrate_bolt

    fit = calibrate_bolt(
        file, length=length, young=young, diameter=diameter, area=area, free_length=free_length, yield_force=yield_force
    )
    path = common.target(output, file, "_fit.png")
    plot.save(fit.plot(), path, dpi)
    onset, force = fit.onset
    lines = [
        *(f"note: {note}" for note in fit.notes),
        f"grout stiffness  {fit.grout_stiffness / 1e6:.4g} ± {fit.grout_stiffness_error / 1e6:.2g} MN/m²",
        f"grout strength   {fit.grout_strength / 1e3:.4g} ± {fit.grout_strength_error / 1e3:.2g} kN/m",
        f"slip begins      at {force / 1e3:.4g} kN, {1e3 * onset:.4g} mm; all slips at {fit.plateau / 1e3:.4g} kN",
        f"scatter          {fit.scatter / 1e3:.2g} kN, {int(fit.used.sum())} points",
        f"&bolt ... {fit.option_text} ... /",
        str(path),
    ]
    common.print_summary(
        quiet, as_json, "\n".join(lines), output=path, grout_stiffness=fit.grout_stiffness,
        grout_stiffness_error=fit.grout_stiffness_error, grout_strength=fit.grout_strength,
        grout_strength_error=fit.grout_strength_error, onset_displacement=onset, onset_force=force,
        plateau=fit.plateau, scatter=fit.scatter, points=int(fit.used.sum()), notes=list(fit.notes),
    )  # fmt: skip


def ground_reaction_command(
    model: Annotated[Path, Argument(metavar="MODEL", help="Labelled file or folder.")],
    liner: Annotated[str | None, Option(help="Lining; by default the first that a stage installs.")] = None,
    point: Annotated[int, Option(min=1, help="Measured point whose convergence counts.")] = 1,
    releases: Annotated[int, Option(min=2, max=1000, help="Parts of the release without support.")] = 10,
    work: Annotated[Path | None, Option(help="Folder that keeps both runs.")] = None, output: common.Output = None,
    dpi: common.Resolution = 200, quiet: common.Quiet = False, as_json: common.Json = False,
) -> None:  # fmt: skip
    """Ground reaction and support characteristic of a lined excavation, with their crossing, in a picture.

    The model runs without support, its forces released in parts, and with support. The pressure of the lining is the
    mean of its axial force over its radius: the line of the lining must be an arc.

    Example:

        rockdda-post ground-reaction tunnel.nml --point 1"""
    common.draw_into_files()
    from .. import plot
    from ..analysis.reaction import support_reaction

    def say(text: str) -> None:
        if not quiet and not as_json:
            typer.echo(text, err=True)

    found = support_reaction(model, liner=liner, point=point, releases=releases, work=work, progress=say)
    path = common.target(output, model, "_reaction.png")
    plot.save(found.plot(), path, dpi)
    common.print_summary(
        quiet, as_json, f"{found}\n{path}", output=path, liner=found.liner, radius=found.radius,
        ground_pressure=found.ground_pressure, placed=found.support[0].tolist(), end=found.support[-1].tolist(),
        crossing=found.crossing, without=found.ground[-1].tolist(),
    )  # fmt: skip


COMMANDS = {
    "study": study_command, "loosening": loosening_command, "voussoir": voussoir_command, "rockload": rock_load_command,
    "calibrate-bolt": calibrate_bolt_command, "ground-reaction": ground_reaction_command,
}  # fmt: skip
