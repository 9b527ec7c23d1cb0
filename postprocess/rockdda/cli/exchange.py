# SPDX-License-Identifier: MIT
"""The commands of `rockdda-post` for files: export, convert, compare, record."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from ..errors import InputError
from . import common


def export_command(
    file: common.ResultsFile,
    output: common.Output = None,
    kind: Annotated[
        str | None,
        Option("--format", help="pvd (or vtk), vtkhdf, vtu, csv, txt (or text), dxf; by default the output's ending."),
    ] = None,
    table: Annotated[
        str | None,
        Option(
            help="As .csv: history (default), boundaries, blocks, vertices, contacts, joints, joint_points, bolts or "
            "liner."
        ),
    ] = None,
    frames: Annotated[str | None, Option(help="Such as -1, 0,5,10 or 0:50:10; by default all.")] = None,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Write results for other programs: VTK, CSV, plain text, DXF.

    .pvd: all frames for ParaView and PyVista (.vtkhdf: in one file; .vtu: one frame); .csv: a table; .txt: lines
    `block vertex x y` for each frame; .dxf: the outlines of one frame.

    Examples:

        rockdda-post export slope.h5 -o slope.pvd

        rockdda-post export slope.h5 -o slope.vtkhdf

        rockdda-post export slope.h5 -o history.csv

        rockdda-post export slope.h5 -o blocks.csv --table blocks --frames -1

        rockdda-post export slope.h5 -o joints.csv --table joints --frames -1

        rockdda-post export slope.h5 -o outlines.txt --frames 0:50:10

        rockdda-post export slope.h5 -o end.dxf"""
    from .. import export

    results = common.open_results(file, frames=False)
    kind = {"vtk": "pvd", "text": "txt"}.get(kind.lower(), kind.lower()) if kind else None
    usual = kind or ("csv" if table else "pvd")
    ending = f"_{table}.csv" if table and usual == "csv" else f".{usual}"
    if output is not None and output.is_dir():
        output = output / f"{file.stem}{ending}"
    path = common.target(output, file, ending)
    form = kind or path.suffix.lstrip(".").lower() or usual
    if table and form != "csv":
        raise InputError(f"--table {table} makes a .csv, not .{form}", path)
    table = table or "history"
    if form not in ("pvd", "vtkhdf", "vtu", "csv", "txt", "dxf"):
        raise InputError(f"unknown format {form!r}; the formats are: pvd, vtkhdf, vtu, csv, txt, dxf", path)
    if form in ("pvd", "vtkhdf", "vtu") and path.suffix.lower() != f".{form}":
        path = path.with_name(path.name + f".{form}")
    whole = {"history": f"{results.n_steps} steps", "boundaries": f"{len(results.stages)} stages"}
    if form != "csv" or table not in whole:
        common.open_results(file)  # frames are needed
    numbers = export.parse_frames(frames, results.n_frames)
    for number in numbers or ():
        if not -results.n_frames <= number < results.n_frames:
            raise InputError(f"there are frames 0 to {results.n_frames - 1}, not {number}", file)
    if form in ("vtu", "dxf"):
        if numbers is not None and len(numbers) != 1:
            raise InputError(f".{form} takes one frame, not {len(numbers)}")
        numbers = [-1] if numbers is None else numbers
    with common.progress_bar("frames", quiet or as_json) as bar:
        if form in ("pvd", "vtkhdf", "vtu"):
            export.to_vtk(results, path, numbers, bar)
        elif form == "csv":
            export.to_csv(results, path, table, numbers, bar)
        elif form == "txt":
            export.to_text(results, path, numbers, bar)
        else:
            assert numbers is not None
            export.to_dxf(results, path, numbers[0])
    count = results.n_frames if numbers is None else len(numbers)
    what = whole[table] if form == "csv" and table in whole else f"{count} frame{'' if count == 1 else 's'}"
    common.print_summary(quiet, as_json, f"{path}: {what}", output=path, format=form, frames=count)


def convert_command(
    files: Annotated[
        list[Path],
        Argument(
            metavar="FILE...",
            help="DDAML (.geo, .ana, or their folder), .dxf, .geojson, .gpkg, .shp, traces (.txt), COMPAS (.json).",
        ),
    ],
    output: Annotated[Path | None, Option("-o", "--output", help="Stem or folder of the files to write.")] = None,
    layers: Annotated[
        list[str] | None, Option("--layer", metavar="NAME=KIND", help="What a layer of a drawing is.")
    ] = None,
    e0: Annotated[float | None, Option(help="Edge-node distance.")] = None,
    chord: Annotated[float | None, Option(help="Distance of chords from curves.")] = None,
    scale: Annotated[float | None, Option(help="Length of a drawing's unit, such as 0.001 for mm.")] = None,
    origin: Annotated[str | None, Option(metavar="X,Y", help="Point of the drawing that becomes 0,0.")] = None,
    areas: Annotated[list[Path] | None, Option("--area", metavar="FILE", help="Polygons that clip the lines.")] = None,
    window: Annotated[str | None, Option(metavar="X1,Y1,X2,Y2", help="A rectangle that clips the lines.")] = None,
    blocks: Annotated[bool, Option("--blocks", help="Each polygon is a block: nothing is cut (.blk).")] = False,
    geographic: Annotated[
        bool, Option("--geographic", help="Coordinates are longitudes and latitudes: make them metres.")
    ] = False,
    template: Annotated[bool, Option("--template", help="Write a labelled file that runs, too.")] = False,
    force: Annotated[bool, Option("--force", help="Overwrite existing files.")] = False,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Convert DDAML of DDA for Windows, drawings, maps and traces to input files (.dc or .blk, .df, .nml).

    Maps are GeoJSON, GeoPackage and Shapefile; traces are text as FracPaQ reads it, x and y of the nodes of a trace in
    each line; blocks also come from JSON of COMPAS. What is taken and what is not is printed at the end.

    Kinds of layers: joint:N, boundary:N (joint material N), material:N (block material), area:N (clips all lines),
    opening:N (nothing stays in it), block:N (closed outlines, block material N), fixed, loading, measured, hole,
    bolt, skip. Layers named like that need no option; other layers get joint materials in alphabetical order. Several
    drawings make one geometry. Lengths in DXF are converted to metres by the drawing's $INSUNITS; --scale overrides
    this.

    Examples:

        rockdda-post convert pushblock.geo pushblock.ana -o push

        rockdda-post convert slope.dxf --layer FAULTS=joint:2 --layer TEXT=skip --e0 0.01 --template

        rockdda-post convert section.dxf --scale 0.001 --origin 500000,6800000

        rockdda-post convert traces.geojson --area area.geojson -o outcrop

        rockdda-post convert fracpaq.txt --scale 0.01 --window 100,100,900,700 -o outcrop

        rockdda-post convert wall.dxf --blocks --template"""
    from ..convert.conversion import convert

    named: dict[str, str] = {}
    for entry in layers or []:
        name, found, kind = entry.rpartition("=")
        if not found:
            raise InputError(f"layer {entry!r}: expected NAME=KIND, such as FAULTS=joint:2")
        named[name] = kind
    for name, value in (("e0", e0), ("chord", chord), ("scale", scale)):
        if value is not None and not 0 < value < float("inf"):
            raise InputError(f"{name} must be positive, found {value:g}")
    done = convert(
        files, output, layers=named, e0=e0, chord=chord, template=template, force=force, areas=areas or (),
        scale=scale, origin=None if origin is None else common.numbers("origin", origin, "x,y"),
        window=None if window is None else common.numbers("window", window), blocks=blocks, geographic=geographic,
    )  # fmt: skip
    if not quiet:
        for message in done.messages:
            typer.echo(message, err=True)
        for title, rows in (("taken:", done.taken), ("not taken:", done.left)):
            if rows:
                typer.echo("\n   ".join([title, *rows]), err=True)
    messages = [asdict(problem) for problem in done.problems]
    names = list(map(str, done.files))
    common.print_summary(
        quiet, as_json, "\n".join(names), files=names, messages=messages, taken=done.taken, not_taken=done.left
    )


def compare_command(
    first: Annotated[Path, Argument(metavar="A.h5", help="One run.")],
    second: Annotated[Path, Argument(metavar="B.h5", help="The other run.")],
    tolerance: Annotated[
        float, Option("--tol", min=0.0, help="Allowed difference over the largest value of a dataset; 0: same bits.")
    ] = 0.0,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Say where and when two runs part: dataset, step, time, block and size.

    Exit code 0: they agree; 1: they differ; 2: they cannot be compared.

    Examples:

        rockdda-post compare old.h5 new.h5

        rockdda-post compare old.h5 new.h5 --tol 1e-9 && echo still the same"""
    from ..analysis.compare import compare

    a, b = common.open_results(first, frames=False), common.open_results(second, frames=False)
    with common.progress_bar("tables", quiet or as_json) as bar:
        found = compare(a, b, tolerance, bar)
    if as_json:
        code = common.DONE if found.same else common.DIFFERENT
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
        raise typer.Exit(common.DIFFERENT)


def record_command(
    file: Annotated[Path, Argument(metavar="RECORD", help="Record: .csv or .at2 (PEER).")],
    output: common.Output = None,
    kind: Annotated[str | None, Option("--format", help="csv or at2; by default by the ending.")] = None,
    column: Annotated[str | None, Option("--column", "-c", help="Column of a .csv: name or number.")] = None,
    scale: Annotated[float | None, Option(help="Factor of the values; by default from their unit to m/s².")] = None,
    start: Annotated[float | None, Option("--from", help="Begin at this time.")] = None,
    end: Annotated[float | None, Option("--to", help="End at this time.")] = None,
    baseline: Annotated[int | None, Option(metavar="DEGREE", help="Correct the baseline by a polynomial.")] = None,
    step: Annotated[float | None, Option(help="Resample to this step.")] = None,
    damping: Annotated[float, Option(help="Damping ratio of the response spectrum.")] = 0.05,
    write: Annotated[Path | None, Option(metavar="OUT.csv", help="Write the record, too.")] = None,
    units: common.UnitNames = None,
    dpi: common.Resolution = 200,
    quiet: common.Quiet = False,
    as_json: common.Json = False,
) -> None:
    """Draw a record of ground acceleration and its response spectrum, and change it for a run.

    The record is cut, resampled and corrected in this order; --write gives the file for `&quake record = 'OUT.csv'`.

    Examples:

        rockdda-post record station.at2 --units m,s,N

        rockdda-post record station.csv --column ns --scale 0.01 --from 2 --to 22 --baseline 1 --write quake.csv"""
    common.draw_into_files()
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
    path = common.target(output, file, "_record.png")
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
    common.print_summary(quiet, as_json, f"{path}: {shown}", output=path, record=write, **facts)


COMMANDS = {"export": export_command, "convert": convert_command, "compare": compare_command, "record": record_command}
