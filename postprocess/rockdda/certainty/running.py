# SPDX-License-Identifier: MIT
"""Runs and searches as cases of a study, here, through Dask, or as job arrays of Slurm; answers as files."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..critical import NAMES, option_words
from ..errors import InputError
from ..plot.kinds import save
from ..results import Results
from ..study import Outcome, Study, pending, run_study, write_job_array
from ..study.case import SEARCHED, read_status
from ..text import PathLike, csv_text
from ..writing import write_file
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
    written = [folder / f"{name}.json", folder / "table.csv", folder / f"{name}.png"]
    write_file(written[0], json.dumps(_finite(found.as_json()), indent=1, ensure_ascii=False) + "\n")
    write_file(written[1], csv_text(found.table))
    save(found.plot(), written[2])
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


#: What a model without a factor does at the value that counts.
STANDS, FAILS, UNKNOWN = "stands", "fails", "unknown"
WRONG_INPUT = 2  #: exit code of the program
#: Options of `rockdda fos` that a study may choose.
OPTIONS = ("search", "joints", "loads", "factors", "from", "to", "tolerance", "stage", "max-steps", "solver")


@dataclass(frozen=True)
class Found:
    """The end of a search."""

    case: int
    factor: float | None
    half_width: float  #: of the interval between the stable and the failing value
    mechanism: str  #: "sliding", "toppling", "fall", "mixed"; '' without a factor
    side: str  #: STANDS, FAILS or UNKNOWN at the value that counts; of a factor at or above it: STANDS
    message: str  #: why there is no factor
    exit_code: int = 0  #: of the program


def search_options(options: Mapping[str, Any]) -> list[str]:
    """Words of the command line; those that are None are left out."""
    for name in options:
        if name.rstrip("_").replace("_", "-") not in OPTIONS:
            raise InputError(f"{name}: no option of a search; there are {', '.join(OPTIONS)}")
    return option_words(options)


def search_name(kind: str | None) -> str:
    """'factor of safety', 'critical tilt' …"""
    return NAMES.get(kind or "strength", f"{kind} factor")


def found_in(study: Study, folder: Path, case: int, limit: float = 1.0) -> Found:
    """What the search of a case has found. limit: below it the model counts as failing."""
    try:
        answer = json.loads((folder / SEARCHED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        answer = {}
    status = read_status(folder)
    unfinished = status.get("status") in ("waiting", "running", "stopped")
    if unfinished or status.get("digest") != study.digest(study.cases[case - 1]):
        return Found(case, None, 0.0, "", UNKNOWN, "not run yet")
    if "factor" in answer:  # also of a design that does not stand, which ends as a run that failed
        factor, low, high = (answer[name] for name in ("factor", "low", "high"))
        if factor is None:
            return Found(case, None, 0.0, "", STANDS, "stands with any strength that was tried")
        half = 0.5 * abs(float(high) - float(low)) if None not in (low, high) else 0.0
        kind = str(answer.get("mechanism", {}).get("kind", ""))
        return Found(case, float(factor), half, kind, FAILS if factor < limit else STANDS, "")
    message = str(status.get("message", "")) or "no answer"
    code = int(status.get("exit_code", 0))
    return Found(case, None, 0.0, "", _side(message, limit), message.removeprefix("rockdda: error: "), code)


def _side(message: str, limit: float) -> str:
    """What a search without a factor says of the value that counts, by its message.

    It stands at the upper end of the range, does not stand at the lower one, or slides off with any strength."""
    text = message.removeprefix("rockdda: error: ")
    words = text.split(",")[0].split()
    if text.startswith(("stable at ", "not stable at ")):
        try:
            value = float(words[-1])
        except ValueError:
            return UNKNOWN
        if text.startswith("stable"):
            return STANDS if value >= limit else UNKNOWN
        return FAILS if value <= limit else UNKNOWN
    moved = "does not fall" in text or "is not the one that was drawn" in text
    return FAILS if text.startswith("the model does not stand") and moved else UNKNOWN
