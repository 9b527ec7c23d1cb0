# SPDX-License-Identifier: MIT
"""One case of a study: its folder, its status, its run.

The folder has the input files, `out.h5`, `out.log` and `status.json`. A case that is done is not run again unless
something it depends on has changed; one that was interrupted continues from its checkpoint; one that failed is reported
and run again on request. While a process runs a case it holds a lock on the folder, so that no other one disturbs it.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, OutputError
from ..program import errors_in, find_program
from ..results import Results
from ..text import decoded
from ..writing import make_folder, write_file, written_to
from .definition import TAKE, Case, Quantity, Study

#: Exit code of a case that took longer than its timeout.
TIMED_OUT = 124

#: What a search has answered, in the folder of its case.
SEARCHED = "out.json"

#: Status of a case that can continue where it was stopped.
_OPEN = ("stopped", "running", "waiting")
#: What is said of a case that another process runs.
ELSEWHERE = "another process runs this case"


@dataclass(frozen=True)
class Outcome:
    """Status of a case that has ended."""

    number: int
    name: str
    status: str  #: "done", "failed", "stopped" (resumed next time), or "running" (by another process)
    seconds: float = 0.0
    exit_code: int = 0
    message: str = ""


def pending(study: Study, *, retry: bool = False) -> list[Case]:
    """Cases that are still to be run; failed ones only when they are to be tried again."""
    return [case for case in study.cases if _is_pending(study, case, retry)]


def _is_pending(study: Study, case: Case, retry: bool) -> bool:
    status = read_status(folder_of(study, case))
    current = status.get("digest") == study.digest(case)
    if not current or status.get("status") not in ("done", "failed") or (status["status"] == "failed" and retry):
        return True
    # it ran, but a result was not found; the study names others now
    return bool(status.get("complete")) and status.get("quantities") != wanted_quantities(study)


def prepare_case(study: Study, case: Case) -> Path:
    """Write the input files of a case. What an older version of it left is removed, a checkpoint of this one kept."""
    folder, digest = folder_of(study, case), study.digest(case)
    for place in (folder.parent, folder):  # a link could lead out of the output folder
        make_folder(place)
    with _alone(folder) as handle:
        if handle is None:
            if read_status(folder).get("digest") == digest:
                return folder
            raise OutputError(f"{folder}: another process runs this case with other files")
        return _write_case(study, case, folder, digest)


def _write_case(study: Study, case: Case, folder: Path, digest: str) -> Path:
    """Write the files of a case into its folder, which is locked."""
    with written_to(folder):
        before = read_status(folder)
        if before.get("digest") not in (digest, None):
            for old in folder.iterdir():  # the folder stays, and with it its lock
                shutil.rmtree(old) if old.is_dir() and not old.is_symlink() else old.unlink()
        elif before.get("status") == "failed" and before.get("exit_code") != TIMED_OUT:
            # it would fail again where it stopped
            (folder / "out.ckpt.h5").unlink(missing_ok=True)
        for name, data in study.files(case).items():
            write_file(folder / name, data)
        continues = before.get("digest") == digest and before.get("status") in _OPEN
        write_status(
            folder,
            {
                "number": case.number,
                "name": case.name,
                "values": dict(case.values),
                "digest": digest,
                "status": "waiting",
                "quantities": wanted_quantities(study),
                "complete": before.get("digest") == digest and before.get("complete", False),
                "seconds": before.get("seconds", 0.0) if continues else 0.0,  # its times add up
                "command": {
                    "name": study.command,
                    "threads": study.threads,
                    "timeout": study.timeout,
                    "options": list(study.options),
                },
            },
        )
    return folder


def finished_case(study: Study, case: Case) -> Outcome | None:
    """Outcome of a case that is done; None for all others."""
    if _is_pending(study, case, retry=True):
        return None
    status = read_status(folder_of(study, case))
    return Outcome(case.number, case.name, "done", status.get("seconds", 0.0), 0, status.get("message", ""))


@contextlib.contextmanager
def _alone(folder: Path, patience: float = 0.0) -> Iterator[int | None]:
    """Hold the lock on a folder; None where another process still holds it after `patience` seconds.

    The lock is one of the operating system, which ends with the last process that has the handle. Where a file system
    has none (some networks), the lock of the results by the program itself remains."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        end = time.monotonic() + patience
        while True:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                if time.monotonic() >= end:
                    yield None
                    return
                time.sleep(0.2)
                continue
            except OSError:
                pass
            break
        yield handle
    finally:
        os.close(handle)


def run_case(
    folder: str, watch: Callable[[subprocess.Popen[str]], None] | None = None, patience: float = 0.0
) -> Outcome:
    """Run the case in a folder: lines (where there are statistics), cut, run or resume, or search a factor. Never
    raises for a bad case.

    A search keeps its trials itself, so that the same command continues it; its answer is in `out.json`. Where another
    process runs the case, it gets `patience` seconds to end."""
    here = Path(folder)
    with _alone(here, patience) as handle:
        status = read_status(here)
        if handle is None:
            return Outcome(status["number"], status["name"], "running", message=ELSEWHERE)
        if status["status"] == "done":  # by the other process
            return Outcome(status["number"], status["name"], "done", status["seconds"], 0, status["message"])
        return _run_locked(here, status, handle, watch)


def _run_locked(
    here: Path, status: dict[str, Any], handle: int, watch: Callable[[subprocess.Popen[str]], None] | None
) -> Outcome:
    """Run a case in its folder; its programs share the lock, which therefore outlives a killed Python."""
    command, start = status["command"], time.monotonic()
    program = find_program()

    def call(*arguments: str, answer: str = "") -> tuple[int, str]:
        environment = {**os.environ, "OMP_NUM_THREADS": str(command["threads"]), "OPENBLAS_NUM_THREADS": "1"}
        with subprocess.Popen(
            [program, *arguments], cwd=here, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE if answer else subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace", start_new_session=True, preexec_fn=_end_with_parent, pass_fds=(handle,),
        ) as process:  # fmt: skip
            if watch is not None:
                watch(process)
            try:
                told, problems = process.communicate(timeout=command["timeout"])
            except subprocess.TimeoutExpired:
                process.terminate()  # it writes a checkpoint
                try:
                    process.communicate(timeout=60)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.communicate()
                return TIMED_OUT, f"stopped after {command['timeout']:g} s (timeout)"
        if answer:
            write_file(here / answer, told)
        return process.returncode, problems.strip()

    code, message = 0, ""
    threads = ["--threads", str(command["threads"])]
    complete = bool(status.pop("complete", False)) and (here / "out.h5").is_file()
    if complete:
        pass  # only the results are to be taken
    elif (here / "out.ckpt.h5").is_file() and status.get("status") in _OPEN:
        code, message = call("resume", "out.ckpt.h5", "--quiet", *threads)
        if code == 2:  # another version of the program, or a damaged file: from the start, then
            (here / "out.ckpt.h5").unlink(missing_ok=True)
    if not complete and (not (here / "out.ckpt.h5").is_file() or code == 2):
        try:
            files = _model_files(here, call)
        except InputError as problem:
            code, message = 2, str(problem).removeprefix("error: ")
        else:
            write_status(here, {**status, "status": "running"})
            written = ["-o", "out.h5", "--force", "--quiet", *threads, *command["options"]]
            if command.get("name", "run") == "fos":
                code, message = call("fos", *files, *written, "--json", answer=SEARCHED)
                if not message and (here / SEARCHED).is_file():
                    message = "\n".join(
                        one.message for one in errors_in((here / SEARCHED).read_text("utf-8", "replace"))
                    )
            else:
                code, message = call("run", *files, *written)
    seconds = time.monotonic() - start + status.get("seconds", 0.0)
    if code == -signal.SIGTERM:  # before the program could listen
        code = 4
    ending = {0: "done", 4: "stopped"}.get(code, "failed")
    if ending == "failed" and not message:
        message = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
    if ending == "done":
        try:
            status["results"] = {
                entry["name"]: quantity(here / "out.h5", Quantity(**entry | {"at": tuple(entry["at"])}))
                for entry in status["quantities"]
            }
        except (InputError, KeyError, IndexError) as problem:
            ending, code, message = "failed", 2, str(problem).strip("'\"").removeprefix("error: ")
            status["complete"] = True
    status |= {"status": ending, "seconds": seconds, "exit_code": code, "message": message[-2000:]}
    write_status(here, status)
    return Outcome(status["number"], status["name"], ending, seconds, code, message)


def _end_with_parent() -> None:
    """Send SIGTERM to a program when the process that started it dies (Linux); it then writes its checkpoint."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG


def wanted_quantities(study: Study) -> list[dict[str, Any]]:
    """The quantities of a study, as `status.json` keeps them."""
    return [{**asdict(wanted), "at": list(wanted.at)} for wanted in study.quantities]


def quantity(path: Path, wanted: Quantity) -> float:
    """One number of a results file."""
    with Results(path) as results:
        values = np.asarray(results[wanted.dataset], dtype=float)
    try:
        indices: tuple[Any, ...] = (slice(None), *wanted.at)
        series = values[indices]
    except IndexError:
        raise IndexError(
            f"result '{wanted.name}': {wanted.dataset} has the shape {values.shape}, not indices {list(wanted.at)}"
        ) from None
    if series.ndim != 1 or not series.size:
        raise IndexError(
            f"result '{wanted.name}': {wanted.dataset} has the shape {values.shape}; 'at' must leave one number a step"
        )
    return float(TAKE[wanted.take](series))


def _model_files(folder: Path, call: Callable[..., tuple[int, str]]) -> list[str]:
    """What `rockdda run` takes of a case: its labelled file, or geometry (statistics are drawn), analysis, options."""

    def one(kinds: Iterable[str], what: str) -> str | None:
        found = [path.name for path in folder.glob("[!.]*") if path.suffix.lower() in kinds]
        if len(found) > 1:
            raise InputError(f"the template has {len(found)} {what}s: {', '.join(sorted(found))}")
        return found[0] if found else None

    statistics = one((".dl",), "statistics file")
    if statistics is not None:
        code, message = call("lines", statistics, "-o", Path(statistics).stem + ".dc", "--force", "--quiet")
        if code:
            raise InputError(message)
    model = one((".dc", ".geo", ".blk"), "geometry or block file")
    analysis = one((".df", ".ana"), "analysis file")
    options = one((".nml",), "options file")
    if analysis is None and options is not None:
        text = decoded((folder / options).read_bytes())
        if re.search(r"^\s*&model\b", text, re.I | re.M):
            return [options]
    if model is None or analysis is None:
        raise InputError(
            "the template needs a labelled file (.nml with &model), or an analysis file and a geometry, block or "
            "statistics file"
        )
    return [model, analysis, *(["--config", options] if options else [])]


def folder_of(study: Study, case: Case) -> Path:
    return study.output / "cases" / case.name


def read_status(folder: Path) -> dict[str, Any]:
    try:
        found = json.loads((folder / "status.json").read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError):
        return {}


def write_status(folder: Path, status: dict[str, Any]) -> None:
    """Replace the file in one step, so that a kill leaves the old or the new one."""
    write_file(folder / "status.json", json.dumps(status, indent=1))
