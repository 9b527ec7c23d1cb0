# SPDX-License-Identifier: MIT
"""Runs on a real Slurm, which scripts/slurm_check starts: every result has the bits of the same run without it.

A node has four processors here, whatever the machine has, so that tasks run beside each other.
"""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SLURM = Path(os.environ["ROCKDDA_SLURM"])
PROGRAM, POST = ROOT / "build/bin/rockdda", ROOT / "build/bin/rockdda-post"
sys.path.insert(0, str(ROOT / "tests/app"))
from faults import differences  # noqa: E402
from support import ANALYSIS, GEOMETRY  # noqa: E402

STEPS = 400_000  # some ten seconds, where no other task runs
STUDY = """\
title = "Sliding, on a cluster"
template = "template"

[parameters]
phi = {phi}

[run]
options = ["--steps", "{steps}", "--save-every", "50000", "--checkpoint-every", "1"]

[results.distance]
dataset = "history/measured_displacement"
at = [0, 0]
"""
ANGLES = [10, 15, 20, 25, 30, 35]
SLAB = ROOT / "inputs/bedding_slab/bedding_slab.nml"


def call(
    *command: object, code: int | None = 0, folder: Path, timeout: float = 300
) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "ROCKDDA_PROGRAM")}
    environment["ROCKDDA"] = str(PROGRAM)
    environment["ROCKDDA_HPC"] = str(ROOT / "scripts/hpc")
    done = subprocess.run(
        [*map(str, command)], cwd=folder, env=environment, capture_output=True, text=True, timeout=timeout
    )
    assert code is None or done.returncode == code, f"{command}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done


def submit(*arguments: object, folder: Path) -> str:
    return re.fullmatch(r"Submitted batch job (\d+)\n", call("sbatch", *arguments, folder=folder).stdout)[1]


def states(job: str = "") -> list[str]:
    """States of the tasks of a job that have not ended, or of all jobs."""
    chosen = [f"--jobs={job}"] if job else []
    done = subprocess.run(["squeue", "-h", "-r", "-o", "%T", *chosen], capture_output=True, text=True)
    return done.stdout.split() if done.returncode == 0 else []


def until(condition: Callable[[], bool], what: str, timeout: float = 300) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, f"waited in vain: {what}\n" + subprocess.getoutput("squeue; sinfo")
        time.sleep(0.3)


def ended(job: str) -> None:
    until(lambda: not states(job), f"the end of job {job}")


def write_models(folder: Path) -> None:
    for name, angle in (("one", "30"), ("two", "20")):
        model = folder / "models" / name
        model.mkdir(parents=True)
        (model / "block.dc").write_text(GEOMETRY)
        (model / "block.df").write_text(ANALYSIS.replace("30 0 0", f"{angle} 0 0"))


def write_study(folder: Path, more: str = "", steps: int = STEPS, phi: list[int] = ANGLES) -> Path:
    (folder / "template").mkdir(parents=True)
    (folder / "template/block.dc").write_text(GEOMETRY)
    (folder / "template/block.df").write_text(ANALYSIS.replace("30 0 0", "{{phi}} 0 0"))
    (folder / "grid.toml").write_text(STUDY.format(phi=phi, steps=steps) + more)
    return folder / "grid.toml"


@pytest.fixture
def folder(request):
    """A folder whose name has a blank; the queue is empty before and after."""
    path = SLURM / "work" / re.sub(r"\W", " ", request.node.name)
    path.mkdir()
    yield path
    subprocess.run(["scancel", "--quiet", "--user", str(os.getuid())], check=False)
    until(lambda: not states(), "an empty queue")
    shutil.rmtree(path)


@pytest.fixture(scope="session")
def whole():
    """The same cases, run here."""
    path = SLURM / "work" / "whole"
    write_study(path)
    call(POST, "study", "grid.toml", "--quiet", folder=path)
    return path


def check_study(folder: Path, whole: Path) -> None:
    """The table says that all is done, with the numbers and bits of the runs without Slurm."""
    call(POST, "study", "grid.toml", "--table", folder=folder)
    tables = []
    for place in (folder, whole):
        with (place / "grid/table.csv").open(newline="") as stream:
            tables.append([(row["phi"], row["distance"], row["status"]) for row in csv.DictReader(stream)])
    count = len(tables[0])
    assert count >= 2
    assert tables[0] == tables[1][:count]
    for path in sorted((folder / "grid/cases").iterdir()):
        assert differences(path / "out.h5", whole / "grid/cases" / path.name / "out.h5") == [], path.name


def running(folder: Path) -> int:
    """Cases whose run has written a checkpoint and goes on."""
    found = [json.loads(path.read_text())["status"] for path in folder.glob("grid/cases/*/status.json")]
    return found.count("running") if len(list(folder.glob("grid/cases/*/out.ckpt.h5"))) >= 2 else 0


def test_job_is_stopped_before_its_limit_and_goes_on(folder):
    """Slurm sends USR1 before the end of a minute; the job requeues itself, and goes on until the run is done."""
    write_models(folder)
    options = ["--steps", 3_000_000, "--save-every", 300_000]
    limit = ["--time=1", "--signal=USR1@10", "--output=job.log"]
    job = submit(*limit, ROOT / "scripts/hpc/job.sh", "models/one", "results/one.h5", *options, folder=folder)
    call(PROGRAM, "run", "models/one", "-o", "whole.h5", *options, "--quiet", folder=folder)
    ended(job)
    log = (folder / "job.log").read_text()
    assert re.search(r"stopped after step \d+, back into the queue", log), log
    assert "resume" in log
    assert log.rstrip().endswith("done after 3000000 steps"), log
    assert differences(folder / "whole.h5", folder / "results/one.h5") == []


def test_array_of_models(folder):
    write_models(folder)
    options = ["--steps", 50_000, "--save-every", 5000]
    job = submit("--array=1-2%20", ROOT / "scripts/hpc/array.sh", "models", "results", *options, folder=folder)
    for name in ("one", "two"):
        call(PROGRAM, "run", f"models/{name}", "-o", f"{name}.h5", *options, "--quiet", folder=folder)
    ended(job)
    for name in ("one", "two"):
        assert differences(folder / f"{name}.h5", folder / f"results/{name}.h5") == []


def test_job_that_is_cancelled_goes_on(folder):
    write_models(folder)
    options = ["--steps", 1_000_000, "--save-every", 100_000]
    command = ["--output=job.log", ROOT / "scripts/hpc/job.sh", "models/one", "results/one.h5", *options]
    job = submit(*command, folder=folder)
    until(lambda: (folder / "results/one.h5").exists(), "results")
    time.sleep(2)
    call("scancel", job, folder=folder)
    ended(job)
    assert "cancelled (signal SIGTERM) after step" in (folder / "job.log").read_text()
    ended(submit(*command, folder=folder))
    call(PROGRAM, "run", "models/one", "-o", "whole.h5", *options, "--quiet", folder=folder)
    assert differences(folder / "whole.h5", folder / "results/one.h5") == []


def test_study_as_an_array(folder, whole):
    """The table says how many cases wait, and its exit code that the study is not done."""
    write_study(folder)
    told = call(POST, "study", "grid.toml", "--slurm", folder=folder).stdout
    assert "a case is stopped 120 s before the end of its time" in told
    early = call(POST, "study", "grid.toml", "--table", code=4, folder=folder)
    assert "6 waiting" in early.stdout
    assert "6 of 6 cases are not done: submit grid/job-array.sh" in early.stderr
    job = submit("grid/job-array.sh", folder=folder)
    until(lambda: running(folder) >= 2, "cases that run")
    during = call(POST, "study", "grid.toml", "--table", code=4, folder=folder)
    assert re.search(r"[1-6] running", during.stdout)
    # the same command here leaves alone what runs there
    beside = call(POST, "study", "grid.toml", "--case", 1, code=None, folder=folder)
    assert beside.returncode == 0, beside.stderr
    ended(job)
    check_study(folder, whole)


def test_study_whose_tasks_cannot_begin(folder):
    """A Python without the package: each case has failed, with its error and the path of the log."""
    write_study(folder, phi=[10, 15])
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    script = folder / "grid/job-array.sh"
    script.write_text(script.read_text().replace("-m rockdda ", "-m rockdda_is_missing "))
    ended(submit("grid/job-array.sh", folder=folder))
    done = call(POST, "study", "grid.toml", "--table", code=3, folder=folder)
    for case in (1, 2):
        (line,) = [line for line in done.stderr.splitlines() if line.startswith(f"case {case} ")]
        assert re.match(
            rf"case {case} failed: .*No module named rockdda_is_missing \(.*/jobs/\d+_{case}\.log\)", line
        ) or ("grid/jobs/" in line and "No module named rockdda_is_missing" in line), line
    # the right script runs them, without --retry
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    ended(submit("grid/job-array.sh", folder=folder))
    assert "2 done" in call(POST, "study", "grid.toml", "--table", folder=folder).stdout


def test_case_that_fails_says_why(folder):
    write_study(folder, phi=[10, -500])
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    ended(submit("grid/job-array.sh", folder=folder))
    done = call(POST, "study", "grid.toml", "--table", code=3, folder=folder)
    assert "1 done, 1 failed" in done.stdout
    assert re.search(r"case 2 failed: .*friction", done.stderr), done.stderr


def test_time_shorter_than_its_warning(folder):
    """In the study: the warning is shortened, and that is said. On the command line: the cases say why they stopped."""
    write_study(folder, '\n[cluster]\ntime = "0:01:00"\n', steps=10_000_000, phi=[10, 15])
    told = call(POST, "study", "grid.toml", "--slurm", folder=folder).stdout
    assert "a case is stopped 12 s before the end of its time" in told
    job = submit("--signal=B:TERM@120", "grid/job-array.sh", folder=folder)
    ended(job)
    done = call(POST, "study", "grid.toml", "--table", code=4, folder=folder)
    assert "2 stopped" in done.stdout
    assert done.stderr.count("the time of the job (--time) is hardly longer than the warning") == 2, done.stderr


def test_cancelled_study_goes_on(folder, whole):
    write_study(folder)
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    job = submit("grid/job-array.sh", folder=folder)
    until(lambda: running(folder) >= 2, "cases that run")
    call("scancel", job, folder=folder)
    ended(job)
    done = call(POST, "study", "grid.toml", "--table", code=4, folder=folder)
    assert "stopped" in done.stdout
    assert "failed" not in done.stdout
    ended(submit("grid/job-array.sh", folder=folder))
    check_study(folder, whole)


def test_two_arrays_of_one_study(folder, whole):
    """Submitted twice by mistake: no case is run by two tasks at a time, none fails."""
    write_study(folder, phi=[10, 15])
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    jobs = [submit("grid/job-array.sh", folder=folder) for _ in range(2)]
    for job in jobs:
        ended(job)
    check_study(folder, whole)


def test_node_that_dies(folder, whole):
    """slurmd and all processes of its jobs are killed; it comes back, Slurm puts the tasks back into the queue."""
    write_study(folder)
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    job = submit("grid/job-array.sh", folder=folder)
    until(lambda: running(folder) >= 2, "cases that run")
    os.kill(int((SLURM / "slurmd.pid").read_text()), signal.SIGKILL)
    for process in family_of_steps():
        os.kill(process, signal.SIGKILL)
    until(lambda: "down" in subprocess.getoutput("sinfo -h -o %T"), "the loss of the node")
    subprocess.run(["slurmd", "-c"], check=True)
    until(lambda: states(job).count("RUNNING") > 0, "a task that runs again")
    ended(job)
    check_study(folder, whole)


def test_daemon_of_a_node_that_is_killed(folder, whole):
    """slurmd alone is killed and comes back before the node counts as lost; its jobs go on."""
    write_study(folder, phi=[10, 15])
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    job = submit("grid/job-array.sh", folder=folder)
    until(lambda: running(folder) >= 2, "cases that run")
    os.kill(int((SLURM / "slurmd.pid").read_text()), signal.SIGKILL)
    time.sleep(1)
    subprocess.run(["slurmd"], check=True)
    ended(job)
    check_study(folder, whole)


def family_of_steps() -> list[int]:
    """The processes of Slurm's steps and all that they have started."""
    parents, names = {}, {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            head, _, tail = entry.read_text().rpartition(")")
        except OSError:
            continue
        number = int(entry.parent.name)
        names[number], parents[number] = head.partition("(")[2], int(tail.split()[1])
    found = {number for number, name in names.items() if name.startswith("slurmstepd")}
    while True:
        more = {number for number, parent in parents.items() if parent in found} - found
        if not more:
            return sorted(found)
        found |= more


def test_full_queue(folder, whole):
    """Slurm takes no more jobs (MaxJobCount): sbatch waits, then the array runs as ever."""
    (folder / "wait.sh").write_text("#!/bin/bash\nsleep 1\n")
    write_study(folder, phi=[10, 15])
    call(POST, "study", "grid.toml", "--slurm", folder=folder)
    held = [submit("--hold", "wait.sh", folder=folder) for _ in range(39)]
    with subprocess.Popen(["sbatch", "grid/job-array.sh"], cwd=folder, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "Slurm temporarily unable to accept job" in process.stderr.readline()
        call("scancel", *held, folder=folder)
        process.communicate(timeout=120)
        assert process.returncode == 0
    until(lambda: not states(), "the end of all jobs")
    check_study(folder, whole)


def test_dask(folder, whole):
    """Two jobs of workers; one of them is cancelled while it runs a case, which goes on in the other."""
    write_study(folder)
    command = [POST, "study", "grid.toml", "--dask", "slurm", "--workers", "2"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True) as process:
        until(lambda: running(folder) >= 2, "cases that run")
        first = subprocess.getoutput("squeue -h -o %A").split()[0]
        call("scancel", first, folder=folder)
        _, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    check_study(folder, whole)


def test_dask_whose_jobs_are_refused(folder):
    write_study(folder, '\n[cluster]\nqueue = "nosuch"\n', phi=[10, 15])
    done = call(POST, "study", "grid.toml", "--dask", "slurm", code=2, folder=folder, timeout=60)
    assert "sbatch: error: invalid partition specified: nosuch" in done.stderr
    assert "Traceback" not in done.stderr


def test_dask_whose_jobs_end_too_early(folder):
    write_study(folder, phi=[10, 15], steps=100_000_000)
    command = [POST, "study", "grid.toml", "--dask", "slurm", "--workers", "1"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True) as process:
        until(lambda: bool(list(folder.glob("grid/cases/*/out.ckpt.h5"))), "a case that runs")
        subprocess.run(["scancel", "--user", str(os.getuid())], check=True)
        _, said = process.communicate(timeout=120)
    assert process.returncode == 2, said
    assert "the jobs of the workers have ended, and cases are left" in said


def test_reliability(folder):
    """The factors, the surface and the probability have the bits of a run here."""
    command = [POST, "reliability", SLAB, "--vary", "clay seam.friction = uniform(26, 32)", "--runs", 8]
    script = Path(json.loads(call(*command, "--slurm", "--json", folder=folder).stdout)["scripts"][0])
    ended(submit(script, folder=folder))
    statuses = [json.loads(path.read_text())["status"] for path in folder.glob("**/cases/*/status.json")]
    assert statuses == ["done"] * 8
    there = json.loads(call(*command, "--json", folder=folder).stdout)
    here = json.loads(call(*command, "--json", "-o", "here", "--jobs", 2, folder=folder).stdout)
    assert len(there["factors"]) == 8
    del there["files"], here["files"]
    assert there == here
