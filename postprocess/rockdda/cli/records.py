# SPDX-License-Identifier: MIT
"""The command of `rockdda-post` for records of ground motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .common import Json, Output, Quiet, UnitNames, print_summary, target

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="record")(record_command)


def record_command(
    file: Annotated[Path, typer.Argument(metavar="RECORD", help="Record: .csv or .at2 (PEER).", show_default=False)],
    output: Output = None,
    kind: Annotated[
        str | None, typer.Option("--format", help="csv or at2; by default by the ending.", show_default=False)
    ] = None,
    column: Annotated[
        str | None, typer.Option("--column", "-c", help="Column of a .csv: name or number.", show_default=False)
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option("--scale", help="Factor of the values; by default from their unit to m/s².", show_default=False),
    ] = None,
    start: Annotated[float | None, typer.Option("--from", help="Begin at this time.", show_default=False)] = None,
    end: Annotated[float | None, typer.Option("--to", help="End at this time.", show_default=False)] = None,
    baseline: Annotated[
        int | None,
        typer.Option("--baseline", metavar="DEGREE", help="Correct the baseline by a polynomial.", show_default=False),
    ] = None,
    step: Annotated[float | None, typer.Option("--step", help="Resample to this step.", show_default=False)] = None,
    damping: Annotated[float, typer.Option("--damping", help="Damping ratio of the response spectrum.")] = 0.05,
    write: Annotated[
        Path | None, typer.Option("--write", metavar="OUT.csv", help="Write the record, too.", show_default=False)
    ] = None,
    units: UnitNames = None,
    dpi: Annotated[int, typer.Option("--dpi", min=20, max=2400, help="Resolution of .png.")] = 200,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Draw a record of ground acceleration and its response spectrum, and change it for a run.

    The record is cut, resampled and corrected in this order; --write gives the file for `&quake record = 'OUT.csv'`.

    Examples:

        rockdda-post record station.at2 --units m,s,N

        rockdda-post record station.csv --column ns --scale 0.01 --from 2 --to 22 --baseline 1 --write quake.csv
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from .. import plot, records

    record = records.read(file, kind, column=column, scale=scale)
    if not record.is_si and scale is None:
        typer.echo(f"{file}: note: the record names no unit: its values are taken as in m/s²", err=True)
    try:
        if start is not None or end is not None:
            record = records.cut(record, start, end)
        if step is not None:
            record = records.resample(record, step)
        if baseline is not None:
            record = records.correct_baseline(record, baseline)
        drawn = plot.record(record, damping=damping, units=units)
    except (ValueError, ImportError) as error:
        raise error if isinstance(error, InputError) else InputError(str(error), file) from error
    path = target(output, file, "_record.png")
    plot.save(drawn, path, dpi)
    if write is not None:
        records.write(record, write)
    facts = {
        "samples": len(record.time),
        "duration": record.duration,
        "peak": record.peak,
        "peak_velocity": float(abs(record.velocity).max()),
        "peak_displacement": float(abs(record.displacement).max()),
        "end_velocity": float(record.velocity[-1]),
        "arias_intensity": records.arias_intensity(record),
    }
    shown = ", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in facts.items())
    print_summary(quiet, as_json, f"{path}: {shown}", output=path, record=write, **facts)
