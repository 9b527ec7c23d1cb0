# SPDX-License-Identifier: MIT
"""Doing the runs of a study, on this machine or through Dask; its table, and small multiples of it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, need
from ..plot.style import style
from .case import (
    Outcome,
    folder_of,
    pending,
    prepare_case,
    quantity,
    read_status,
    run_case,
    wanted_quantities,
)  # fmt: skip
from .dask_workers import run_dask
from .definition import Study
from .job_array import last_words

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

#: Called to report progress: cases finished in this call, cases to do, the last outcome.
Progress = Callable[[int, int, Outcome], None]


def run_study(
    study: Study, *, workers: int | None = None, retry: bool = False, dask: str | None = None,
    progress: Progress | None = None,
) -> list[Outcome]:  # fmt: skip
    """Run the cases that are not done. Ctrl-C stops the runs after their present step; the next call continues.

    `dask`: the address of a scheduler, ``"local"`` for a cluster on this machine, or ``"slurm"``, ``"pbs"``, ``"lsf"``
    and others for dask-jobqueue with the options of the study's [cluster] table."""
    todo = pending(study, retry=retry)
    folders = []
    for case in todo:
        prepare_case(study, case)
        folders.append(str(folder_of(study, case)))
    if not folders:
        return []
    if dask is None:
        count = workers or max(1, (os.cpu_count() or 1) // study.threads)
        finished = _run_here(folders, count)
    else:
        finished = run_dask(study, folders, dask, workers)
    outcomes = []
    for outcome in finished:
        outcomes.append(outcome)
        if progress is not None:
            progress(len(outcomes), len(folders), outcome)
    return outcomes


def _run_here(folders: list[str], workers: int) -> Iterator[Outcome]:
    """Cases on this machine, `workers` at a time. On Ctrl-C the running programs write their checkpoints."""
    running: set[subprocess.Popen[str]] = set()
    lock, stopping = threading.Lock(), threading.Event()

    def watch(process: subprocess.Popen[str]) -> None:
        with lock:
            running.add(process)
            if stopping.is_set():
                process.terminate()

    def work(folder: str) -> Outcome | None:
        return None if stopping.is_set() else run_case(folder, watch)

    with ThreadPoolExecutor(workers) as pool:
        left = {pool.submit(work, folder) for folder in folders}
        try:
            while left:
                finished, left = wait(left, return_when=FIRST_COMPLETED)
                for future in finished:
                    outcome = future.result()
                    if outcome is not None:
                        yield outcome
        except (KeyboardInterrupt, GeneratorExit):
            with lock:
                stopping.set()
                for process in running:
                    with contextlib.suppress(OSError):
                        process.send_signal(signal.SIGTERM)
            raise


def collect(study: Study) -> pandas.DataFrame:
    """One row a case: number, parameters, results, status, seconds. Missing numbers are NaN.

    A case whose results do not hold a quantity has failed, as in the run that finds it missing. So has one whose task
    of a job array ended before the case could begin."""
    pd = need("pandas", "tables", "the table of a study")

    rows, said = [], last_words(study)
    for case in study.cases:
        status = read_status(folder_of(study, case))
        current = status.get("digest") == study.digest(case)
        found: dict[str, float] = {}
        message = status.get("message", "") if current else ""
        ending = status.get("status", "waiting") if current else "waiting"
        if ending == "done":
            found, message = _results_of(study, status, folder_of(study, case) / "out.h5")
            if len(found) < len(study.quantities):
                ending = "failed"
        elif ending != "failed" and case.number in said:
            has_failed, message = said[case.number]
            ending = "failed" if has_failed else ending
        rows.append(
            {"case": case.number}
            | {name: case.values[name] for name in study.parameters}
            | {wanted.name: found.get(wanted.name, float("nan")) for wanted in study.quantities}
            | {
                "status": ending,
                "seconds": status.get("seconds", float("nan")) if current else float("nan"),
                "message": message,
                "results_file": str(folder_of(study, case) / "out.h5") if found or not study.quantities else "",
            }
        )
    return pd.DataFrame(rows)


def _results_of(study: Study, status: dict[str, Any], path: Path) -> tuple[dict[str, float], str]:
    """The numbers of a case that is done; quantities added to the study since are read from its results file."""
    known = {entry["name"]: entry for entry in status.get("quantities", [])}
    numbers, message = {}, status.get("message", "")
    for wanted, entry in zip(study.quantities, wanted_quantities(study), strict=True):
        if known.get(wanted.name) == entry and wanted.name in status.get("results", {}):
            numbers[wanted.name] = status["results"][wanted.name]
            continue
        try:
            numbers[wanted.name] = quantity(path, wanted)
        except (InputError, KeyError, IndexError) as problem:
            message = str(problem).strip("'\"").removeprefix("error: ")
    return numbers, message


def plot_study(study: Study, table: pandas.DataFrame) -> Figure:
    """Every result against the first parameter of numbers that varies; further ones distinguish lines and rows.

    Cases without a result are left out, so that gaps show."""
    import matplotlib.pyplot as plt
    from pandas.api.types import is_numeric_dtype

    varying = [name for name in study.parameters if table[name].nunique() > 1]
    numeric = [name for name in varying if is_numeric_dtype(table[name])]
    if not numeric:
        raise InputError("nothing to draw: no parameter of numbers varies", study.file)
    if not study.quantities:
        raise InputError("nothing to draw: the study has no [results]", study.file)
    across = numeric[0]
    others = [name for name in varying if name != across]
    lines, rows = others[:1], others[1:]
    groups = list(table.groupby(rows)) if rows else [((), table)]
    with style():
        figure, grid = plt.subplots(
            len(groups), len(study.quantities), figsize=(3.4 * len(study.quantities), 2.7 * len(groups)), squeeze=False,
            layout="constrained",
        )  # fmt: skip
        for axes_row, (key, part) in zip(grid, groups, strict=True):
            for axes, wanted in zip(axes_row, study.quantities, strict=True):
                curves = list(part.groupby(lines[0])) if lines else [(None, part)]
                colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(curves)))
                for (value, curve), colour in zip(curves, colours, strict=True):
                    curve = curve.dropna(subset=[wanted.name]).sort_values(across)
                    label = f"{lines[0]} = {value!s}" if lines else None
                    axes.plot(curve[across], curve[wanted.name], "o-", ms=3, color=colour, label=label)
                axes.set_xlabel(across)
                axes.set_ylabel(f"{wanted.name} [{wanted.unit}]" if wanted.unit else wanted.name)
                if rows:
                    axes.set_title(", ".join(f"{name} = {value}" for name, value in zip(rows, key, strict=True)))
        if lines:
            grid[0, -1].legend()
        figure.suptitle(study.title)
    return figure
