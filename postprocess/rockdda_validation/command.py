# SPDX-License-Identifier: MIT
"""The command `rockdda-post validate`."""

from __future__ import annotations

import contextlib
import enum
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rockdda.cli.common import DIFFERENT, DONE, NO_CONVERGENCE, Json, Quiet, print_summary, progress_bar
from rockdda.errors import InputError, RockddaError
from typer import Option

if TYPE_CHECKING:
    from .case import Case


class Formulation(enum.StrEnum):
    """Which formulations of contacts the cases are run with."""

    BOTH = "both"
    LENGTH = "length"
    VERTEX = "vertex"


def validate_command(
    quick: Annotated[bool, Option("--quick", help="Fewer runs, minutes; the default.")] = False,
    full: Annotated[bool, Option("--full", help="All runs of all cases.")] = False,
    case: Annotated[list[str] | None, Option(metavar="ID", help="Only this case; may be repeated.")] = None,
    formulation: Annotated[
        Formulation, Option(help="Of the contacts: one of them, or both one after the other.")
    ] = Formulation.VERTEX,
    missing: Annotated[
        bool, Option("--missing", help="Only cases without a result in DIR, to continue after Ctrl-C.")
    ] = False,
    show: Annotated[bool, Option("--list", help="Run nothing: list the cases.")] = False,
    report_only: Annotated[bool, Option("--report-only", help="Run nothing: write the report again.")] = False,
    pdf: Annotated[bool, Option("--pdf", help="Also as DIR/report.pdf; by WeasyPrint or Chromium.")] = False,
    output: Annotated[Path, Option("-o", "--output", metavar="DIR", help="Folder of the report.")] = Path("validation"),
    work: Annotated[Path | None, Option(metavar="DIR", help="Keep input files and results of all runs.")] = None,
    workers: Annotated[
        int | None, Option("--workers", "-j", min=1, help="Cases at a time; default: one a core.")
    ] = None,
    force: Annotated[
        bool, Option("--force", help="Write into a folder with other files; replace --full by --quick.")
    ] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run the cases of the validation, compare with closed forms and published values, write the report.

    DIR/index.md and DIR/report.html are made from what all cases left in DIR/data and DIR/figures; with --case only
    those cases are run again. With --formulation length runs that choose neither a formulation of contacts nor a preset
    have contacts by length, otherwise springs at vertices as in the thesis; the report shows both beside each other
    where both are there. After Ctrl-C the finished cases are kept; the same command with --missing continues. Exit
    code 0: all promises are kept; 1: some are not; 3: a case could not be computed; 4: stopped.

    Examples:

        rockdda-post validate

        rockdda-post validate --full -o validation --workers 8

        rockdda-post validate --case closed-newmark --work runs

        rockdda-post validate --full --formulation both -o validation

        rockdda-post validate --report-only --pdf

        rockdda-post validate --list"""
    from rockdda.report.paper import needs_for_pdf

    from .registry import all_cases
    from .report import write_report
    from .runner import FORMULATIONS, Outcome, run_cases, select

    if quick and full:
        raise InputError("--quick and --full exclude each other")
    if show + report_only + bool(case) > 1:
        raise InputError("--list, --report-only and --case exclude each other")
    if pdf:
        needs_for_pdf()  # before anything is computed
    known = all_cases()
    if show:
        _list_cases(known, quiet, as_json)
        return
    if report_only:
        written = write_report(output, known, pdf=pdf)
        print_summary(quiet, as_json, "\n".join(map(str, written)), files=list(map(str, written)))
        return
    picked = select(case, full, known)
    names = [name for name in FORMULATIONS if formulation.value in (name, "both")]
    if missing:
        chosen = {name: _without(output, picked, full, name) for name in names}
    else:
        for name in names:
            _check_folder(output, picked, full, force, name)
        chosen = dict.fromkeys(names, picked)
    of = sum(map(len, chosen.values()))
    ended: list[Outcome] = []
    with progress_bar("cases", quiet or as_json) as bar:

        def report(done: int, total: int, outcome: Outcome) -> None:
            ended.append(outcome)
            if bar is not None:
                bar(len(ended), of)
            elif not (quiet or as_json):
                typer.echo(f"{len(ended)}/{of} {outcome.name}: {outcome.status}, {outcome.seconds:.1f} s", err=True)

        count = workers or os.cpu_count() or 1
        try:
            outcomes = [
                outcome
                for name, some in chosen.items()
                for outcome in run_cases(
                    some, output, full=full, formulation=name, work=work, workers=count, progress=report
                )
            ]
        except KeyboardInterrupt:
            _report_stopped(output, known, len(ended), of, quiet)
            raise
    written = write_report(output, known, pdf=pdf)
    status = {name: sum(o.status == name for o in outcomes) for name in ("agrees", "differs", "failed")}
    code = NO_CONVERGENCE if status["failed"] else DIFFERENT if status["differs"] else DONE
    if not quiet:
        for outcome in outcomes:
            if outcome.status != "agrees":
                typer.echo(f"{outcome.name} {outcome.status}: {outcome.message}", err=True)
    seconds = sum(o.seconds for o in outcomes)
    several = {"agrees": "agree", "differs": "differ", "failed": "failed"}
    summary = f"{len(outcomes)} case{'' if len(outcomes) == 1 else 's'}: " + ", ".join(
        f"{number} {name if number == 1 else several[name]}" for name, number in status.items() if number
    )
    if not outcomes:
        summary = "no case is missing"
    print_summary(
        quiet,
        as_json,
        f"{summary}; {sum(o.runs for o in outcomes)} runs, {seconds:.0f} s of work\n" + "\n".join(map(str, written)),
        status="done" if code == DONE else "differs" if code == DIFFERENT else "failed",
        exit_code=code,
        files=list(map(str, written)),
        cases=[vars(outcome) for outcome in outcomes],
    )
    if code != DONE:
        raise typer.Exit(code)


def _without(output: Path, chosen: list[Case], full: bool, formulation: str) -> list[Case]:
    """The cases without a result in the folder, or with one of --quick only where --full is given."""
    from .runner import load_records

    if output.exists() and not (output / "data").is_dir():
        raise InputError("has no results to continue from; leave out --missing", output)
    there = load_records(output, chosen, formulation) if output.is_dir() else []
    done = {record["identifier"] for record in there if not record.get("error") and (record.get("full") or not full)}
    return [case for case in chosen if case.identifier not in done]


def _report_stopped(output: Path, known: list[Case], done: int, of: int, quiet: bool) -> None:
    """After Ctrl-C: write the report of the finished cases, and print how to continue."""
    from .report import write_report

    with contextlib.suppress(RockddaError):
        write_report(output, known)
    if not quiet:
        kept = f"{done} of {of} cases are done and kept in {output}" if done else "no case is done yet"
        typer.echo(f"stopped: {kept}; the same command with --missing continues", err=True)


def _list_cases(known: list[Case], quiet: bool, as_json: bool) -> None:
    """Print the list of cases."""

    wide = max((len(case.identifier) for case in known), default=0)
    lines = []
    for part in dict.fromkeys(case.part for case in known):
        lines.append(part)
        lines += [
            f"  {case.identifier:{wide}}  {case.title}{'' if case.quick else ' (--full only)'}"
            for case in known
            if case.part == part
        ]
    names = [
        {"identifier": case.identifier, "title": case.title, "part": case.part, "quick": case.quick} for case in known
    ]
    print_summary(quiet, as_json, "\n".join(lines), cases=names)


def _check_folder(output: Path, chosen: list[Case], full: bool, force: bool, formulation: str) -> None:
    """InputError if other files, or results of --full by those of --quick, would be overwritten."""
    from .runner import load_records

    if not chosen:
        raise InputError("there is no case to run")
    if output.exists() and not output.is_dir():
        raise InputError("is no folder", output)
    if force or not output.is_dir():
        return
    if any(output.iterdir()) and not (output / "data").is_dir():
        raise InputError("holds other files; choose another folder, or use --force", output)
    if full:
        return
    names = {case.identifier for case in chosen}
    better = [
        r["identifier"] for r in load_records(output, chosen, formulation) if r.get("full") and r["identifier"] in names
    ]
    if better:
        raise InputError(f"has results of --full for {', '.join(better)}; --force replaces them by --quick", output)
