# SPDX-License-Identifier: MIT
"""Doing the runs of a study: on this machine, through Dask, or as a Slurm job array.

Each case has a folder with its input files, `out.h5`, `out.log` and `status.json`. A case that is done is not run again
unless something it depends on has changed; one that was interrupted continues from its checkpoint; one that failed is
reported and run again on request.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import re
import shlex
import shutil
import signal
import site
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, OutputError, RockddaError, how_to_install, need
from ..program import find_program
from ..results import Results
from ..text import decoded, has_controls, shown
from ..writing import complete_file, make_folder, write_file
from .definition import Case, Quantity, Study

if TYPE_CHECKING:
    import pandas

__all__ = ["Outcome", "collect", "pending", "prepare_case", "run_case", "run_study", "write_job_array"]

#: Options of sbatch that name files or commands, which a study must not choose.
_OF_FILES = ("output", "error", "input", "chdir", "wrap", "export-file", "get-user-env", "container", "bbf", "batch")
#: Options of dask-jobqueue that name neither.
_FOR_DASK = (
    "queue", "project", "account", "cores", "memory", "processes", "walltime", "interface", "death_timeout", "job_cpu",
    "job_mem", "job_name", "ncpus", "mem", "resource_spec", "reservation",
)  # fmt: skip

#: Exit code of a case that took longer than its timeout.
TIMED_OUT = 124

#: What a search has answered, in the folder of its case.
SEARCHED = "out.json"

#: Called to report progress: cases finished in this call, cases to do, the last outcome.
Progress = Callable[[int, int, "Outcome"], None]


@dataclass(frozen=True)
class Outcome:
    """Status of a case that has ended."""

    number: int
    name: str
    status: str  #: "done", "failed" or "stopped" (resumed next time)
    seconds: float = 0.0
    exit_code: int = 0
    message: str = ""


def run_study(
    study: Study,
    *,
    workers: int | None = None,
    retry: bool = False,
    dask: str | None = None,
    progress: Progress | None = None,
) -> list[Outcome]:
    """Run the cases that are not done. Ctrl-C stops the runs after their present step; the next call continues.

    `dask`: the address of a scheduler, ``"local"`` for a cluster on this machine, or ``"slurm"``, ``"pbs"``, ``"lsf"``
    and others for dask-jobqueue with the options of the study's [cluster] table.
    """
    todo = pending(study, retry=retry)
    folders = []
    for case in todo:
        prepare_case(study, case)
        folders.append(str(_folder(study, case)))
    if not folders:
        return []
    if dask is None:
        count = workers or max(1, (os.cpu_count() or 1) // study.threads)
        finished = _run_here(folders, count)
    else:
        finished = _run_dask(study, folders, dask, workers)
    outcomes = []
    for outcome in finished:
        outcomes.append(outcome)
        if progress is not None:
            progress(len(outcomes), len(folders), outcome)
    return outcomes


def pending(study: Study, *, retry: bool = False) -> list[Case]:
    """Cases that are still to be run; failed ones only when they are to be tried again."""
    return [case for case in study.cases if _is_pending(study, case, retry)]


def _is_pending(study: Study, case: Case, retry: bool) -> bool:
    status = _read_status(_folder(study, case))
    current = status.get("digest") == study.digest(case)
    if not current or status.get("status") not in ("done", "failed") or (status["status"] == "failed" and retry):
        return True
    # it ran, but a result was not found; the study names others now
    return bool(status.get("complete")) and status.get("quantities") != _wanted_quantities(study)


def prepare_case(study: Study, case: Case) -> Path:
    """Write the input files of a case. What an older version of it left is removed, a checkpoint of this one kept."""
    folder, digest = _folder(study, case), study.digest(case)
    for place in (folder.parent, folder):  # a link could lead out of the output folder
        make_folder(place)
    try:
        before = _read_status(folder)
        if before.get("digest") not in (digest, None):
            shutil.rmtree(folder)
            make_folder(folder)
        elif before.get("status") == "failed" and before.get("exit_code") != TIMED_OUT:
            # it would fail again where it stopped
            (folder / "out.ckpt.h5").unlink(missing_ok=True)
        for name, data in study.files(case).items():
            write_file(folder / name, data)
        _write_status(
            folder,
            {
                "number": case.number,
                "name": case.name,
                "values": dict(case.values),
                "digest": digest,
                "status": "waiting",
                "quantities": _wanted_quantities(study),
                "complete": before.get("digest") == digest and before.get("complete", False),
                "seconds": before.get("seconds", 0.0) if _can_continue(before, digest) else 0.0,
                "command": {
                    "name": study.command,
                    "threads": study.threads,
                    "timeout": study.timeout,
                    "options": list(study.options),
                },
            },
        )
    except OutputError:
        raise
    except OSError as problem:
        raise OutputError(f"{folder}: cannot be written: {problem.strerror}") from None
    return folder


def _can_continue(before: dict[str, Any], digest: str) -> bool:
    """Can a case continue where it was stopped? Its times then add up."""
    return before.get("digest") == digest and before.get("status") in ("stopped", "running", "waiting")


def finished_case(study: Study, case: Case) -> Outcome | None:
    """Outcome of a case that is done; None for all others."""
    if _is_pending(study, case, retry=True):
        return None
    status = _read_status(_folder(study, case))
    return Outcome(case.number, case.name, "done", status.get("seconds", 0.0), 0, status.get("message", ""))


def run_case(folder: str, watch: Callable[[subprocess.Popen[str]], None] | None = None) -> Outcome:
    """Run the case in a folder: lines (where there are statistics), cut, run or resume, or search a factor. Never
    raises for a bad case.

    A search keeps its trials itself, so that the same command continues it; its answer is in `out.json`.
    """
    here = Path(folder)
    status = _read_status(here)
    command, start = status["command"], time.monotonic()
    program = find_program()

    def call(*arguments: str, answer: str = "") -> tuple[int, str]:
        environment = {**os.environ, "OMP_NUM_THREADS": str(command["threads"]), "OPENBLAS_NUM_THREADS": "1"}
        with subprocess.Popen(
            [program, *arguments], cwd=here, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE if answer else subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace", start_new_session=True, preexec_fn=_end_with_parent,
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
    elif (here / "out.ckpt.h5").is_file() and status.get("status") in ("stopped", "running", "waiting"):
        code, message = call("resume", "out.ckpt.h5", "--quiet", *threads)
        if code == 2:  # another version of the program, or a damaged file: from the start, then
            (here / "out.ckpt.h5").unlink(missing_ok=True)
    if not complete and (not (here / "out.ckpt.h5").is_file() or code == 2):
        try:
            files = _model_files(here, call)
        except InputError as problem:
            code, message = 2, str(problem).removeprefix("error: ")
        else:
            _write_status(here, {**status, "status": "running"})
            written = ["-o", "out.h5", "--force", "--quiet", *threads, *command["options"]]
            if command.get("name", "run") == "fos":
                code, message = call("fos", *files, *written, "--json", answer=SEARCHED)
                message = message or _error_of(here / SEARCHED)
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
            numbers = {entry["name"]: quantity(here / "out.h5", Quantity(**entry)) for entry in _quantities(status)}
            status["results"] = numbers
        except (InputError, KeyError, IndexError) as problem:
            ending, code, message = "failed", 2, str(problem).strip("'\"").removeprefix("error: ")
            status["complete"] = True
    status |= {"status": ending, "seconds": seconds, "exit_code": code, "message": message[-2000:]}
    _write_status(here, status)
    return Outcome(status["number"], status["name"], ending, seconds, code, message)


def _error_of(path: Path) -> str:
    """The errors in an answer of the program; '' where there are none."""
    try:
        messages = json.loads(path.read_text(encoding="utf-8")).get("messages", [])
        return "\n".join(str(one["message"]) for one in messages if one.get("severity") == "error")
    except (OSError, ValueError, AttributeError, KeyError, TypeError):
        return ""


def _end_with_parent() -> None:
    """Send SIGTERM to a program when the process that started it dies (Linux); it then writes its checkpoint."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG


def _wanted_quantities(study: Study) -> list[dict[str, Any]]:
    """The quantities of a study, as `status.json` keeps them."""
    return [{**asdict(wanted), "at": list(wanted.at)} for wanted in study.quantities]


def _quantities(status: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for entry in status["quantities"]:
        yield {**entry, "at": tuple(entry["at"])}


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
    take: dict[str, Callable[[Any], Any]] = {
        "last": lambda x: x[-1], "first": lambda x: x[0], "min": np.min, "max": np.max, "mean": np.mean,
        "absmax": lambda x: np.max(np.abs(x)),
    }  # fmt: skip
    return float(take[wanted.take](series))


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


def _run_dask(study: Study, folders: list[str], where: str, workers: int | None) -> Iterator[Outcome]:
    """Cases as tasks of Dask. A task whose worker dies is given to another one and continues from its checkpoint."""
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise RockddaError(f"Dask is not installed: {how_to_install('study')}") from None
    with contextlib.ExitStack() as stack:
        if "://" in where:
            client = stack.enter_context(Client(where))
        else:
            cluster = stack.enter_context(_cluster(study, where, workers))
            client = stack.enter_context(Client(cluster))
        futures = client.map(run_case, folders, pure=False, retries=3)
        names = {future.key: folder for future, folder in zip(futures, folders, strict=True)}
        for future in as_completed(futures):
            if future.status == "finished":
                yield future.result()
            else:
                folder = Path(names[future.key])
                status = _read_status(folder)
                message = f"{type(future.exception()).__name__}: {future.exception()}"
                _write_status(folder, {**status, "status": "failed", "exit_code": 1, "message": message})
                yield Outcome(status["number"], status["name"], "failed", 0.0, 1, message)


def _cluster(study: Study, where: str, workers: int | None) -> Any:
    """A Dask cluster: on this machine, or of jobs of a scheduler through dask-jobqueue."""
    if where == "local":
        from distributed import LocalCluster

        count = workers or max(1, (os.cpu_count() or 1) // study.threads)
        return LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None)
    try:
        import dask_jobqueue
    except ImportError:
        raise RockddaError(f"dask-jobqueue is not installed: {how_to_install('cluster')}") from None
    kinds = ("SLURM", "PBS", "LSF", "SGE", "OAR", "HTCondor", "Local")
    names = {kind.lower() if kind != "Local" else "shell": f"{kind}Cluster" for kind in kinds}
    if where not in names:
        raise InputError(
            f"dask: expected an address such as tcp://host:8786, local, {', '.join(names)}; found '{where}'"
        )
    module = dask_jobqueue.local if where == "shell" else dask_jobqueue
    for name in study.cluster:
        if name not in _FOR_DASK:
            raise InputError(
                f"[cluster]: {shown(name)} is none of {', '.join(_FOR_DASK)}; what names files or commands goes into "
                "the configuration of dask-jobqueue (~/.config/dask/jobqueue.yaml)",
                study.file,
            )
    cluster = getattr(module, names[where])(**{"cores": 1, "processes": 1, "memory": "2GB", **study.cluster})
    cluster.scale(jobs=workers or 4)
    return cluster


def write_job_array(study: Study, *, retry: bool = False) -> Path:
    """A Slurm script that runs each case as one task of a job array; submitting it again runs the remaining cases."""
    if has_controls(str(study.file.resolve())):
        raise InputError("the path of the study holds line breaks or control characters", study.file)
    options = "".join(map(_scheduler_option, study.cluster.items()))
    make_folder(study.output)
    todo = pending(study, retry=retry)
    if not todo:
        raise InputError("all cases are done: there is nothing to submit", study.file)
    for case in todo:
        prepare_case(study, case)
    path = study.output / "job-array.sh"
    numbers = ",".join(str(case.number) for case in todo)
    command = shlex.join([sys.executable, "-P", "-m", "rockdda", "study", str(study.file.resolve())])
    command = f"{_environment()}{command} --output {shlex.quote(str(study.output.resolve()))}"
    text = f"""#!/bin/bash
# {_one_line(study.title)}: one task a case. Submit with `sbatch {path.name}`;
# the table comes from `rockdda-post study {_one_line(shlex.quote(study.file.name))} --table` then.
#SBATCH --job-name={_job_name(study.title)}
#SBATCH --array={numbers}
#SBATCH --cpus-per-task={study.threads}
#SBATCH --signal=B:TERM@120
{options}exec {command} --case "$SLURM_ARRAY_TASK_ID" --quiet
"""
    with complete_file(path) as part:
        part.write_text(text, encoding="utf-8")
        part.chmod(0o755)
    return path


def _environment() -> str:
    """`env …` for a task, where the package is not installed for this Python or the program does not lie beside it."""
    words = []
    package = Path(__file__).resolve().parents[2]
    if str(package) not in {*site.getsitepackages(), site.getusersitepackages()}:
        words.append(f"PYTHONPATH={shlex.quote(str(package))}${{PYTHONPATH:+:$PYTHONPATH}}")
    with contextlib.suppress(RockddaError):
        words.append(f"ROCKDDA_PROGRAM={shlex.quote(str(Path(find_program()).resolve()))}")
    return f"env {' '.join(words)} " if words else ""


def _scheduler_option(entry: tuple[str, Any]) -> str:
    """A line for sbatch, which reads words, quotes and backslashes; "" for an option that is false."""
    name, value = entry
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9-]*", name):
        raise InputError(f"[cluster]: {shown(name)} is no option of sbatch")
    if any(long.startswith(name.lower()) for long in _OF_FILES):  # sbatch takes names cut short
        raise InputError(f"[cluster]: {shown(name)} names files or commands: give it to sbatch on the command line")
    if isinstance(value, bool):
        return f"#SBATCH --{name}\n" if value else ""
    if not isinstance(value, str | int | float):
        raise InputError(f"[cluster] {name}: expected a text, a number or true, found {shown(value)}")
    text = str(value)
    if has_controls(text) or len(text) > 1000:
        raise InputError(
            f"[cluster] {name}: expected one line of at most 1000 characters, without control characters, "
            f"found {shown(value)}"
        )
    if not re.fullmatch(r"[\w@%+=:,./-]+", text, re.ASCII):
        text = '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return f"#SBATCH --{name}={text}\n"


def _one_line(text: str) -> str:
    """A text for a comment, on one line; a Study made in Python may contain line breaks."""
    return "".join("?" if has_controls(letter) else letter for letter in text)


def _job_name(title: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in title)[:40] or "rockdda"


def collect(study: Study) -> pandas.DataFrame:
    """One row a case: number, parameters, results, status, seconds. Missing numbers are NaN.

    A case whose results do not hold a quantity has failed, as in the run that finds it missing.
    """
    pd = need("pandas", "tables", "the table of a study")

    rows = []
    for case in study.cases:
        status = _read_status(_folder(study, case))
        current = status.get("digest") == study.digest(case)
        found: dict[str, float] = {}
        message = status.get("message", "") if current else ""
        ending = status.get("status", "waiting") if current else "waiting"
        if ending == "done":
            found, message = _results_of(study, status, _folder(study, case) / "out.h5")
            if len(found) < len(study.quantities):
                ending = "failed"
        rows.append(
            {"case": case.number}
            | {name: case.values[name] for name in study.parameters}
            | {wanted.name: found.get(wanted.name, float("nan")) for wanted in study.quantities}
            | {
                "status": ending,
                "seconds": status.get("seconds", float("nan")) if current else float("nan"),
                "message": message,
                "results_file": str(_folder(study, case) / "out.h5") if found or not study.quantities else "",
            }
        )
    return pd.DataFrame(rows)


def _results_of(study: Study, status: dict[str, Any], path: Path) -> tuple[dict[str, float], str]:
    """The numbers of a case that is done; quantities added to the study since are read from its results file."""
    known = {entry["name"]: entry for entry in status.get("quantities", [])}
    numbers, message = {}, status.get("message", "")
    for wanted, entry in zip(study.quantities, _wanted_quantities(study), strict=True):
        if known.get(wanted.name) == entry and wanted.name in status.get("results", {}):
            numbers[wanted.name] = status["results"][wanted.name]
            continue
        try:
            numbers[wanted.name] = quantity(path, wanted)
        except (InputError, KeyError, IndexError) as problem:
            message = str(problem).strip("'\"").removeprefix("error: ")
    return numbers, message


def _folder(study: Study, case: Case) -> Path:
    return study.output / "cases" / case.name


def _read_status(folder: Path) -> dict[str, Any]:
    try:
        found = json.loads((folder / "status.json").read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError):
        return {}


def _write_status(folder: Path, status: dict[str, Any]) -> None:
    """Replace the file in one step, so that a kill leaves the old or the new one."""
    write_file(folder / "status.json", json.dumps(status, indent=1))
