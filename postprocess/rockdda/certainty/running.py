# SPDX-License-Identifier: MIT
"""Runs of studies whose answers are judged, here, through Dask, or as job arrays of Slurm; their answers as files."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..results import Results
from ..study import Outcome, Study, pending, run_study, write_job_array
from ..text import PathLike, csv_text
from ..writing import complete_file, write_file
from .template import digest_of_texts, remove_others

Progress = Callable[[int, int, Outcome], None]


def output_folder(output: PathLike | None, name: str, kind: str) -> Path:
    """The folder of a study: that which is named, or NAME_KIND in the current one."""
    return Path(output) if output is not None else Path(f"{name}_{kind}")


def case_folder(study: Study, case: int) -> Path:
    """The folder of a case, from 1."""
    return study.output / "cases" / study.cases[case - 1].name


def run_studies(
    studies: Sequence[Study], jobs: int | None, dask: str | None, retry: bool, progress: Progress | None
) -> None:
    """Run what is left of studies, one after the other; Ctrl-C stops the runs, and the next call continues."""
    for study in studies:
        remove_others(study)
    left = [len(pending(study, retry=retry)) for study in studies]
    before = 0
    for study, count in zip(studies, left, strict=True):

        def report(done: int, total: int, outcome: Outcome, before: int = before) -> None:
            if progress is not None:
                progress(before + done, sum(left), outcome)

        run_study(study, workers=jobs, retry=retry, dask=dask, progress=report)
        before += count


def write_arrays(studies: Sequence[Study], retry: bool) -> list[Path]:
    """A Slurm job array for each study that is not done."""
    found = [write_job_array(study, retry=retry) for study in studies if pending(study, retry=retry)]
    if not found:
        raise InputError("all runs are done: there is nothing to submit")
    return found


def write_answer(found: Any, folder: Path, name: str) -> list[Path]:
    """Write an answer into its folder: NAME.json (numbers that are not finite are null), table.csv and NAME.png."""
    import matplotlib.pyplot as plt

    written = [folder / f"{name}.json", folder / "table.csv", folder / f"{name}.png"]
    write_file(written[0], json.dumps(_finite(found.as_json()), indent=1, ensure_ascii=False) + "\n")
    write_file(written[1], csv_text(found.table))
    figure = np.ravel(np.asarray(found.plot(), dtype=object))[0].get_figure()
    try:
        with complete_file(written[2]) as part:
            figure.savefig(part, dpi=200)
    finally:
        plt.close(figure)
    return written


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and value - value != 0 else value


LARGEST = 100_000_000  # bytes of an answer


@dataclass(frozen=True)
class Answer:
    """One answer, as its JSON has it."""

    kind: str  #: "convergence" or "reliability"
    folder: Path
    found: dict[str, Any]  #: nothing where it is of another version of the model

    @property
    def picture(self) -> bytes:
        """Its picture; nothing where there is none."""
        try:
            return (self.folder / f"{self.kind}.png").read_bytes()
        except OSError:
            return b""


def answers_beside(results: Results) -> list[Answer]:
    """The answers in folders beside the results and in the current folder whose input is that of the results.

    One in the folder that the command takes for these results (NAME_convergence, NAME_reliability) is listed without
    its content where its input is another one."""
    digest = digest_of_texts(*(str(results[f"input/{name}"]) for name in ("geometry", "analysis", "config")))
    places = list(dict.fromkeys([results.path.parent.resolve(), Path.cwd()]))
    answers = []
    for kind in ("convergence", "reliability"):
        read = [(path.parent, _read(path)) for place in places for path in sorted(place.glob(f"*/{kind}.json"))]
        fitting = [Answer(kind, folder, found) for folder, found in read if found.get("input") == digest]
        stale = [Answer(kind, folder, {}) for folder, _ in read if folder.name == f"{results.name}_{kind}"]
        answers += (fitting or stale)[:1]
    return answers


def _read(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > LARGEST:
            return {}
        found = json.loads(path.read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError, RecursionError):
        return {}
