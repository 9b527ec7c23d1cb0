# SPDX-License-Identifier: MIT
"""The command of `rockdda-post` for records of ground motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from ..errors import InputError
from .common import Json, Output, Quiet, UnitNames, print_summary, target


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="record")(record_command)


def record_command(
    file: Annotated[Path, Argument(metavar="RECORD", help="Record: .csv or .at2 (PEER).")],
    output: Output = None,
    kind: Annotated[str | None, Option("--format", help="csv or at2; by default by the ending.")] = None,
    column: Annotated[str | None, Option("--column", "-c", help="Column of a .csv: name or number.")] = None,
    scale: Annotated[
        float | None, Option("--scale", help="Factor of the values; by default from their unit to m/s².")
    ] = None,
    start: Annotated[float | None, Option("--from", help="Begin at this time.")] = None,
    end: Annotated[float | None, Option("--to", help="End at this time.")] = None,
    baseline: Annotated[
        int | None, Option("--baseline", metavar="DEGREE", help="Correct the baseline by a polynomial.")
    ] = None,
    step: Annotated[float | None, Option("--step", help="Resample to this step.")] = None,
    damping: Annotated[float, Option("--damping", help="Damping ratio of the response spectrum.")] = 0.05,
    write: Annotated[Path | None, Option("--write", metavar="OUT.csv", help="Write the record, too.")] = None,
    units: UnitNames = None,
    dpi: Annotated[int, Option("--dpi", min=20, max=2400, help="Resolution of .png.")] = 200,
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
