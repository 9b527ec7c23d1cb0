# SPDX-License-Identifier: MIT
"""Running cases: each in a separate process, so that a failure of one does not affect another.

What a case leaves behind is kept in `DIR/data/ID.json` and `DIR/figures/ID-*`; the report is made from these alone.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib
import json
import math
import multiprocessing
import os
import shutil
import signal
import tempfile
import time as clock
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from multiprocessing.connection import wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rockdda
from rockdda.errors import InputError, OutputError, RockddaError
from rockdda.native import VERSION, Session, load
from rockdda.writing import write_file

from .case import Case, Comparison, Record
from .corner_springs import as_promised
from .registry import all_cases

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

#: of contacts, in the order of the report
FORMULATIONS = ("vertex", "length")

__all__ = ["FORMULATIONS", "Outcome", "comparisons_of", "load_records", "run_cases", "run_here", "select", "store"]

#: Called when a case has ended: cases ended, cases in all, how it ended.
Progress = Callable[[int, int, "Outcome"], None]


@dataclass(frozen=True)
class Outcome:
    """Status of a case that has ended."""

    identifier: str
    status: str  #: "agrees", "differs" (a promise is broken) or "failed"
    seconds: float
    runs: int
    steps: int
    message: str = ""
    formulation: str = ""

    @property
    def name(self) -> str:
        """Of the case, with its formulation where one was chosen."""
        return f"{self.identifier} ({self.formulation})" if self.formulation else self.identifier

    @classmethod
    def of(cls, record: dict[str, Any]) -> Outcome:
        """From the record of a case."""
        broken = [c.quantity for c in comparisons_of(record) if c.agrees is False]
        message = record.get("error", "") or "; ".join(broken)
        status = "failed" if record.get("error") else "differs" if broken else "agrees"
        numbers = (record["seconds"], record["runs"], record["steps"])
        return cls(record["identifier"], status, *numbers, message, str(record.get("formulation") or ""))


def select(identifiers: Sequence[str] | None, full: bool, cases: Sequence[Case] | None = None) -> list[Case]:
    """The cases of these names, in the order of the report; without names all of --quick or --full."""
    cases = all_cases() if cases is None else cases
    known = {case.identifier: case for case in cases}
    if not identifiers:
        return [case for case in cases if full or case.quick]
    for name in identifiers:
        if name not in known:
            near = [other for other in known if name.lower() in other.lower()]
            hint = f"; did you mean {', '.join(near)}?" if near else "; --list shows all"
            raise InputError(f"there is no case {name!r}{hint}")
        if not full and not known[name].quick:
            raise InputError(f"case {name!r} takes minutes at its least: it needs --full")
    return [case for case in cases if case.identifier in identifiers]


def run_here(
    case: Case, folder: Path, figures: Path, full: bool = False, workers: int = 1, formulation: str = ""
) -> dict[str, Any]:
    """Run a case in this process. An error of the case is kept in its record."""
    started = _work()
    record = Record(case, folder, figures, full, formulation, workers)
    error = ""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        case.function(record)
        if not record.comparisons:
            error = "the case compares nothing"
    except Exception as problem:
        error = _told(problem, folder)
    found = record.as_dict()
    found |= {"error": error, "seconds": _work() - started, "version": _version(), "processor": _processor()}
    found["build"] = _build()
    for name in ("seconds", "run_seconds"):
        found[name] = round(found[name], 1)
    return found


def run_cases(
    cases: Sequence[Case],
    target: Path,
    *,
    full: bool = False,
    formulation: str = "",
    work: Path | None = None,
    workers: int = 1,
    module: str | None = None,
    progress: Progress | None = None,
) -> list[Outcome]:
    """Run cases in separate processes, `workers` at a time, and keep their records in a folder.

    formulation: of the contacts, for all runs that choose neither one nor a preset; "": the program's default. work:
    where the input files and results of the runs are kept; without it they are removed. module: where the cases
    are found by their names, if not among all.
    """
    outcomes: list[Outcome] = []
    _make(target / "data")  # before anything is computed
    with contextlib.ExitStack() as stack:
        place = work
        if place is None:
            place = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rockdda-validate-")))
        for case, found in _run_all(cases, place.absolute() / formulation, full, formulation, workers, module):
            store(found, place / formulation / case.identifier / "figures", target)
            if work is None:
                shutil.rmtree(place / formulation / case.identifier, ignore_errors=True)
            outcomes.append(Outcome.of(found))
            if progress is not None:
                progress(len(outcomes), len(cases), outcomes[-1])
    order = [case.identifier for case in cases]
    return sorted(outcomes, key=lambda outcome: order.index(outcome.identifier))


def _run_all(
    cases: Sequence[Case], place: Path, full: bool, formulation: str, workers: int, module: str | None
) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Cases with their records, as they end."""
    context = multiprocessing.get_context("spawn")
    waiting = list(cases)
    running: dict[int, tuple[Case, BaseProcess, float]] = {}
    share = max(1, workers // max(1, len(cases)))
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                case = waiting.pop(0)
                folder = place / case.identifier
                shutil.rmtree(folder, ignore_errors=True)
                _make(folder)
                package = list(rockdda.__path__)
                job = (case.identifier, module, folder, full, formulation, share, package, os.getpid())
                process = context.Process(target=_child, args=job)
                with _without_interrupts():  # Ctrl-C is deferred until the child handles signals
                    process.start()
                running[process.sentinel] = (case, process, clock.monotonic())
            for sentinel in wait(list(running)):
                case, ended, started = running.pop(sentinel)  # type: ignore[arg-type]
                ended.join()
                file = place / case.identifier / "record.json"
                if ended.exitcode == 0 and file.is_file():
                    found = _read(file)
                else:
                    empty = Record(case, place, place, full, formulation).as_dict()
                    error = f"the process of the case ended with exit code {ended.exitcode}"
                    failure = {"error": error, "seconds": round(clock.monotonic() - started, 1), "version": _version()}
                    found = empty | failure
                yield case, found
    finally:
        for _, left, _ in running.values():
            left.terminate()
            left.join()


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block SIGINT; a process that is started meanwhile inherits the block until it unblocks the signal."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _child(
    identifier: str,
    module: str | None,
    folder: Path,
    full: bool,
    formulation: str,
    workers: int,
    package: list[str],
    parent: int,
) -> None:
    """One case, in a separate process."""
    with contextlib.suppress(OSError, AttributeError):  # do not outlive the parent (Linux)
        ctypes.CDLL(None).prctl(1, signal.SIGTERM)
    if os.getppid() != parent:
        return
    os.environ["MPLBACKEND"] = "Agg"
    rockdda.__path__[:] = package
    with contextlib.suppress(KeyboardInterrupt):  # the parent has it, too
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        cases = all_cases() if module is None else importlib.import_module(module).CASES
        case = next(case for case in cases if case.identifier == identifier)
        _write(folder / "record.json", run_here(case, folder, folder / "figures", full, workers, formulation))


def store(record: dict[str, Any], figures: Path, target: Path) -> None:
    """Keep the record of a case, `data/ID.json`, and its files in `figures`, in place of earlier ones.

    Those of a case with a given formulation are in the folders of its name, `data/length/ID.json`, `figures/length`.
    """
    formulation = str(record.get("formulation") or "")
    file = target / "data" / formulation / f"{record['identifier']}.json"
    kept = target / "figures" / formulation
    _make(file.parent)
    for name in _files(_read(file)) if file.is_file() else []:
        (kept / name).unlink(missing_ok=True)
    for name in _files(record):
        _make(kept)
        if (figures / name).is_file():
            write_file(kept / name, (figures / name).read_bytes())
    _write(file, record)


def load_records(
    target: Path, cases: Sequence[Case] | None = None, formulation: str | None = None
) -> list[dict[str, Any]]:
    """All records in a folder, in the order of the cases; those of no case are last. formulation: only those of one."""
    cases = all_cases() if cases is None else cases
    order = {case.identifier: number for number, case in enumerate(cases)}
    folders = [name for name in ("", *FORMULATIONS) if formulation in (None, name)]
    records = [_read(file) for name in folders for file in sorted((target / "data" / name).glob("[!.]*.json"))]
    return sorted(records, key=lambda r: order.get(r["identifier"], len(order)))


def comparison(values: dict[str, Any]) -> Comparison:
    """A comparison from its record."""
    return Comparison(**{field.name: values[field.name] for field in fields(Comparison) if field.name in values})


def comparisons_of(record: dict[str, Any]) -> list[Comparison]:
    """The comparisons of a record, with the promises that its formulation makes."""
    formulation = str(record.get("formulation") or "")
    return [as_promised(record["identifier"], formulation, comparison(values)) for values in record["comparisons"]]


def _files(record: dict[str, Any]) -> list[str]:
    """Names of the files of a record."""
    return [item["file"] for item in record["items"] if item.get("file")]


def _told(problem: Exception, folder: Path) -> str:
    """An error as the report shows it: with its place in the package, without paths of this machine."""
    text = str(problem) if isinstance(problem, RockddaError) else f"{type(problem).__name__}: {problem}"
    text = text.replace(f"{folder}{os.sep}", "").replace(str(folder), ".").replace(f"{Path.cwd()}{os.sep}", "")
    frames = traceback.extract_tb(problem.__traceback__)
    own = [frame for frame in frames if frame.name != "run_here"]
    if own:
        text += f" (in {Path(own[0].filename).name}, line {own[0].lineno})"
    return text


def _work() -> float:
    """Processor seconds of this process and its children, which do not depend on the load of the machine."""
    return sum(os.times()[:4])


def _version() -> str:
    """Of the program."""
    try:
        return Session().text(VERSION)
    except ImportError:
        return ""


def _build() -> str:
    """Build of the program: the first digits of the SHA-256 of its compiled part."""
    with contextlib.suppress(ImportError, OSError):
        return hashlib.sha256(Path(str(load().__file__)).read_bytes()).hexdigest()[:12]
    return ""


def _processor() -> str:
    """Machine on which the seconds were measured."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return ""


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise OutputError(f"{folder}: cannot be written: {problem.strerror}") from None


def _read(file: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise InputError(f"is no record of a case: {problem}", file) from None
    if not {"identifier", "title", "part", "comparisons", "items"} <= set(found):
        raise InputError("is no record of a case: something is missing in it", file)
    for values in found["comparisons"]:
        if "ours" in values:  # of a record by an older version
            values["computed"] = values.pop("ours")
        for name in ("computed", "truth", "published", "allowed", "scale"):
            if isinstance(values.get(name), str):
                values[name] = float(values[name])
    return found


def _write(file: Path, record: dict[str, Any]) -> None:
    """As JSON; numbers that JSON cannot express become texts such as "nan"."""
    text = json.dumps(_plain(record), indent=1, ensure_ascii=False, allow_nan=False)
    write_file(file, text + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return value
