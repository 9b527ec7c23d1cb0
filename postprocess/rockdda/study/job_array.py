# SPDX-License-Identifier: MIT
"""Cases of a study as tasks of a Slurm job array, and what the logs of its tasks say."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import shutil
import site
import subprocess
import sys
from pathlib import Path
from typing import Any

from ..errors import InputError, RockddaError
from ..program import find_program
from ..text import has_controls, shown
from ..writing import complete_file, make_folder
from .case import pending, prepare_case
from .definition import Study

#: Options of sbatch that name files or commands, which a study must not choose.
_OF_FILES = ("output", "error", "input", "chdir", "wrap", "export-file", "get-user-env", "container", "bbf", "batch")

#: Seconds between the signal to a case and the end of its time; Slurm may send it a minute earlier.
_WARNING = 120
_SHORTEST = 10

#: Slurm's usual MaxArraySize: task numbers of an array are below it. Used where scontrol does not print the setting.
_ARRAY_SIZE = 1001

#: How the log of a task names its case, and its end.
_BEGINS, _ENDS = "rockdda-post: case {}", "rockdda-post: case {} ended with exit code {}"
_LONGEST_LOG = 1_000_000  # bytes that are read of a log, at its end


def write_job_array(study: Study, *, retry: bool = False) -> Path:
    """A Slurm script that runs each case as one task of a job array; submitting it again runs the remaining cases."""
    for path in (study.file.resolve(), study.output.resolve()):
        if has_controls(str(path)) or "\\" in str(path):
            raise InputError("the path of the study holds line breaks, control characters or backslashes", study.file)
    options = {"signal": f"B:TERM@{warning_of(study)}", "requeue": True, "open-mode": "append"} | dict(study.cluster)
    lines = "".join(map(_scheduler_option, options.items()))
    make_folder(study.output)
    todo = pending(study, retry=retry)
    if not todo:
        raise InputError("all cases are done: there is nothing to submit", study.file)
    for case in todo:
        prepare_case(study, case)
    make_folder(logs_of(study))
    path = study.output / "job-array.sh"
    numbers = [case.number for case in todo]
    size = _array_size()
    tasks, cases = ",".join(map(str, numbers)), '"$SLURM_ARRAY_TASK_ID"'
    if numbers[-1] >= size:  # more than Slurm takes: several cases a task, one after the other
        count = min(len(numbers), size - 1)
        shares = [" ".join(map(str, numbers[first::count])) for first in range(count)]
        listed = "\n".join(f"  '{share}'" for share in shares)
        tasks, cases = f"1-{count}", "${shares[SLURM_ARRAY_TASK_ID - 1]}"
        lines += f"shares=(\n{listed}\n)\n"
    command = shlex.join([sys.executable, "-P", "-m", "rockdda", "study", str(study.file.resolve())])
    command = f"{_environment()}{command} --output {shlex.quote(str(study.output.resolve()))}"
    log = str(logs_of(study).resolve() / "%A_%a.log").replace("%", "%%").replace("%%A_%%a", "%A_%a")
    text = f"""#!/bin/bash
# {_one_line(study.title)}: one task a case. Submit with `sbatch {path.name}`;
# the table comes from `rockdda-post study {_one_line(shlex.quote(study.file.name))} --table` then.
#SBATCH --job-name={_job_name(study.title)}
#SBATCH --array={tasks}
#SBATCH --cpus-per-task={study.threads}
#SBATCH --output={_quoted(log)}
{lines}one_case() {{
  exec {command} --case "$case" --quiet
}}
worst=0 stopped= run=
trap 'signalled=yes stopped=yes; [ -z "$run" ] || kill -TERM "$run" 2>/dev/null' TERM INT
for case in {cases}; do
  [ -z "$stopped" ] || exit 4
  echo "{_BEGINS.format("$case")}" >&2
  one_case &
  run=$! signalled=yes
  while [ -n "$signalled" ]; do # the case writes its checkpoint first
    signalled=
    wait "$run"
    code=$?
  done
  run=
  [ "$code" = 0 ] || {{ echo "{_ENDS.format("$case", "$code")}" >&2; worst=$code; }}
done
exit "$worst"
"""
    with complete_file(path) as part:
        part.write_text(text, encoding="utf-8")
        part.chmod(0o755)
    return path


def logs_of(study: Study) -> Path:
    """The folder with the logs of the tasks."""
    return study.output / "jobs"


def warning_of(study: Study) -> int:
    """Seconds before the end of a task's time at which its case is stopped; less where [cluster] gives little time."""
    own = re.search(r"@(\d+)$", str(study.cluster.get("signal", "")))
    if own:
        return int(own[1])
    limit = _seconds(str(study.cluster.get("time", "")))
    if limit is None:
        return _WARNING
    return min(_WARNING, max(_SHORTEST, int(limit // 5)))


def _seconds(text: str) -> float | None:
    """A time as sbatch reads it: M, M:S, H:M:S, D-H, D-H:M, D-H:M:S; None for all else, which sbatch shall judge."""
    found = re.fullmatch(r"(?:(\d+)-)?(\d+)(?::(\d+))?(?::(\d+))?", text.strip())
    if not found:
        return None
    days, first, second, third = (int(part) if part else 0 for part in found.groups())
    if found[1] is not None:
        return 86400 * days + 3600 * first + 60 * second + third
    return 3600 * first + 60 * second + third if found[4] is not None else 60 * first + second


def _array_size() -> int:
    """Slurm's MaxArraySize."""
    scontrol = shutil.which("scontrol")
    if scontrol is not None:
        with contextlib.suppress(OSError, subprocess.TimeoutExpired):
            answer = subprocess.run([scontrol, "show", "config"], capture_output=True, text=True, timeout=20)
            found = re.search(r"^MaxArraySize\s*=\s*(\d+)", answer.stdout, re.M)
            if found and int(found[1]) > 1:
                return int(found[1])
    return _ARRAY_SIZE


def last_words(study: Study) -> dict[int, tuple[bool, str]]:
    """For cases by their number: has the last task ended with an error, and the last line of its log with its path.

    A case says itself how it ended, in its folder. This is for tasks that could not begin one, and for those that the
    scheduler ended; the log of a task that came to its end without an error is not named."""
    found: dict[int, tuple[bool, str]] = {}
    logs: list[tuple[float, Path]] = []
    with contextlib.suppress(OSError):
        logs = sorted((path.stat().st_mtime, path) for path in logs_of(study).glob("*.log"))
    for _, path in logs:
        with path.open("rb") as stream:
            stream.seek(max(0, path.stat().st_size - _LONGEST_LOG))
            text = stream.read().decode("utf-8", "replace")
        case, said = 0, ""
        for line in filter(None, map(str.strip, text.splitlines())):
            begins = re.fullmatch(_BEGINS.format(r"(\d+)"), line)
            ends = re.fullmatch(_ENDS.format(r"(\d+)", r"(\d+)"), line)
            if begins:
                case, said = int(begins[1]), ""
                found.pop(case, None)
            elif ends:
                code = int(ends[2])
                found[case] = (code not in (4, 143), f"{said or f'exit code {code}'} ({path})")
                case = 0
            elif case:
                said = line
                if line.startswith(("slurmstepd", "srun: ")):
                    found[case] = (False, f"{line} ({path})")
    return found


def _environment() -> str:
    """`env …` for a task, where the package is not installed for this Python or the program does not lie beside it."""
    words = []
    package = Path(__file__).resolve().parents[2]
    if str(package) not in {*site.getsitepackages(), site.getusersitepackages()}:
        words.append(f"PYTHONPATH={shlex.quote(str(package))}${{PYTHONPATH:+:$PYTHONPATH}}")
    with contextlib.suppress(RockddaError):
        words.append(f"ROCKDDA_PROGRAM={shlex.quote(str(Path(find_program()).resolve()))}")
    extension = os.environ.get("ROCKDDA_EXTENSION")
    if extension:
        words.append(f"ROCKDDA_EXTENSION={shlex.quote(extension)}")
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
    return f"#SBATCH --{name}={_quoted(text)}\n"


def _quoted(text: str) -> str:
    """A word for sbatch."""
    if re.fullmatch(r"[\w@%+=:,./-]+", text, re.ASCII):
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _one_line(text: str) -> str:
    """A text for a comment, on one line; a Study made in Python may contain line breaks."""
    return "".join("?" if has_controls(letter) else letter for letter in text)


def _job_name(title: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in title)[:40] or "rockdda"
