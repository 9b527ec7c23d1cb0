# SPDX-License-Identifier: MIT
"""The job scripts for clusters, with stand-ins for what the scheduler does."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

h5py = pytest.importorskip("h5py")
ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.setdefault("ROCKDDA_PROGRAM", os.fspath(ROOT / "build" / "bin" / "rockdda")))
sys.path.insert(0, os.fspath(ROOT / "tests" / "app"))
from faults import differences, new_folder  # noqa: E402
from support import ANALYSIS, GEOMETRY  # noqa: E402

pytestmark = pytest.mark.skipif(not PROGRAM.exists(), reason="the program is not built")
STEPS = 8000
OPTIONS = ["--steps", str(STEPS), "--save-every", "700"]

# srun starts the program and sends USR1 when the time of the job is nearly over, or kills it as a crash would, or sends
# TERM to all of the job as scancel does (CANCEL); the clock starts when the program has got ready for signals, for a
# crash when there is something to go on from. Signals for srun are handed on to the program.
SRUN = """\
#!/usr/bin/env python3
import os, signal, subprocess, sys, threading, time

program = subprocess.Popen(sys.argv[1:])
signal.signal(signal.SIGTERM, lambda *_: program.send_signal(signal.SIGTERM))
wanted = os.environ.get("SIGNAL", "USR1")


def is_ready():
    folder = f"/proc/{program.pid}"
    if wanted == "KILL":
        return any(os.readlink(file.path).endswith(".undo") for file in os.scandir(f"{folder}/fd"))
    caught = next(line.split()[1] for line in open(f"{folder}/status") if line.startswith("SigCgt:"))
    return int(caught, 16) & 0x200


def clock():
    try:
        while not is_ready():
            time.sleep(0.02)
    except (OSError, StopIteration):  # it has ended, or closed a file meanwhile
        return clock() if program.poll() is None else None
    time.sleep(float(os.environ["LIMIT"]))
    program.send_signal(signal.SIGTERM if wanted == "CANCEL" else signal.Signals["SIG" + wanted])
    if wanted == "CANCEL":
        os.kill(os.getppid(), signal.SIGTERM)


threading.Thread(target=clock, daemon=True).start()
code = program.wait()
sys.exit(code if code >= 0 else 128 - code)
"""
SCONTROL = """\
#!/usr/bin/env bash
echo "$@" >>"$QUEUE"
"""


class Cluster:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.queue = folder / "queue"
        tools = folder / "bin"
        tools.mkdir()
        for name, text in (("srun", SRUN), ("scontrol", SCONTROL)):
            (tools / name).write_text(text)
            (tools / name).chmod(0o755)
        for name in ("one", "two"):
            model = folder / "models" / name
            model.mkdir(parents=True)
            (model / "block.dc").write_text(GEOMETRY)
            (model / "block.df").write_text(ANALYSIS.replace("30 0 0", "30 0 0" if name == "one" else "20 0 0"))
        self.environment = {
            **os.environ,
            "PATH": f"{tools}:{os.environ['PATH']}",
            "ROCKDDA": os.fspath(PROGRAM),
            "QUEUE": os.fspath(self.queue),
            "SLURM_JOB_ID": "42",
            "LIMIT": "100",
        }

    def submit(self, script: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
        return subprocess.run(
            ["bash", os.fspath(ROOT / "scripts" / "hpc" / script), *arguments],
            cwd=self.folder,
            env={**self.environment, **environment},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=300,
        )

    def requeued(self) -> list[str]:
        return self.queue.read_text().splitlines() if self.queue.exists() else []

    def run_to_the_end(self, script: str, *arguments: str, **environment: str) -> int:
        """As the scheduler does: again while the job asks for it. How often it was stopped."""
        for _ in range(500):
            stops = len(self.requeued())
            outcome = self.submit(script, *arguments, **environment)
            if outcome.returncode == 4 and "a longer --time is needed" in outcome.stdout:
                # a busy machine, which needs as long for the start
                environment["LIMIT"] = str(2 * float(environment["LIMIT"]))
                continue
            assert outcome.returncode == 0, outcome.stderr + outcome.stdout
            if len(self.requeued()) == stops:
                return stops
        raise AssertionError("the job never ends")

    def whole(self, model: str) -> Path:
        path = self.folder / f"whole_{model}.h5"
        if not path.exists():
            command = [os.fspath(PROGRAM), "run", f"models/{model}", "-o", path.name, *OPTIONS, "--quiet"]
            subprocess.run(command, cwd=self.folder, check=True, capture_output=True)
        return path


@pytest.fixture
def cluster():
    folder = new_folder()
    yield Cluster(folder)
    shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.parametrize("scratch", [False, True])
def test_job_survives_its_time_limit(cluster, scratch):
    more = {"SCRATCH_DIR": os.fspath(cluster.folder)} if scratch else {}
    stops = cluster.run_to_the_end("job.sh", "models/one", "results/one.h5", *OPTIONS, LIMIT="0.1", **more)
    assert stops > 0
    assert cluster.requeued() == ["requeue 42"] * stops
    results = cluster.folder / "results"
    assert differences(cluster.whole("one"), results / "one.h5") == []
    assert sorted(path.name for path in results.iterdir()) == ["one.ckpt.h5", "one.h5", "one.json", "one.log"]
    assert not list(cluster.folder.glob("rockdda-*")), "the scratch folder is gone"
    summary = json.loads((results / "one.json").read_text())
    assert (summary["status"], summary["steps"]) == ("done", STEPS)
    # once more: nothing happens
    before = (results / "one.h5").read_bytes()
    outcome = cluster.submit("job.sh", "models/one", "results/one.h5", *OPTIONS, **more)
    assert outcome.returncode == 0
    assert outcome.stdout.splitlines()[-1].endswith(f": done after {STEPS} steps")
    assert (results / "one.h5").read_bytes() == before


@pytest.mark.parametrize("scratch", [False, True])
def test_job_goes_on_after_a_crash(cluster, scratch):
    more = {"SCRATCH_DIR": os.fspath(cluster.folder)} if scratch else {}
    limits = {"LIMIT": "0.1", "SIGNAL": "KILL"}
    for _ in range(3):
        every = ("--checkpoint-every", "0.05")
        outcome = cluster.submit("job.sh", "models/one", "results/one.h5", *OPTIONS, *every, **limits, **more)
        assert outcome.returncode in (0, 137)
    assert cluster.run_to_the_end("job.sh", "models/one", "results/one.h5", *OPTIONS, **more) == 0
    assert differences(cluster.whole("one"), cluster.folder / "results/one.h5") == []
    names = sorted(path.name for path in (cluster.folder / "results").iterdir())
    assert names == ["one.ckpt.h5", "one.h5", "one.json", "one.log"]


@pytest.mark.parametrize("scratch", [False, True])
def test_job_that_is_cancelled(cluster, scratch):
    more = {"SCRATCH_DIR": os.fspath(cluster.folder)} if scratch else {}
    options = ["--steps", "100000000", "--save-every", "700"]
    outcome = cluster.submit("job.sh", "models/one", "results/one.h5", *options, LIMIT="0.1", SIGNAL="CANCEL", **more)
    assert outcome.returncode == 4, outcome.stderr + outcome.stdout
    assert "cancelled (signal SIGTERM) after step " in outcome.stdout
    assert cluster.requeued() == []
    results = cluster.folder / "results"
    assert sorted(path.name for path in results.iterdir()) == ["one.ckpt.h5", "one.h5", "one.json", "one.log"]
    assert not list(cluster.folder.glob("rockdda-*")), "the scratch folder is gone"
    # submitted again it goes on
    steps = json.loads((results / "one.json").read_text())["steps"]
    cluster.submit("job.sh", "models/one", "results/one.h5", *options, LIMIT="0.1", SIGNAL="CANCEL", **more)
    assert json.loads((results / "one.json").read_text())["first_step"] == steps


def test_time_that_is_over_before_the_run_can_begin(cluster):
    # srun's stand-in for the program: it gets the signal while it still reads its model
    slow = cluster.folder / "bin" / "slow"
    slow.write_text("#!/usr/bin/env bash\nkill -USR1 $$\n")
    slow.chmod(0o755)
    outcome = cluster.submit("job.sh", "models/one", "one.h5", ROCKDDA=os.fspath(slow))
    assert outcome.returncode == 4
    assert "a longer --time is needed" in outcome.stdout
    assert cluster.requeued() == []


def test_job_begins_again_when_nothing_is_lost_by_it(cluster):
    (cluster.folder / "one.h5").write_bytes(b"killed while it was created")
    assert cluster.run_to_the_end("job.sh", "models/one", "one.h5", *OPTIONS) == 0
    assert differences(cluster.whole("one"), cluster.folder / "one.h5") == []
    # results without a checkpoint are not overwritten
    (cluster.folder / "one.ckpt.h5").unlink()
    outcome = cluster.submit("job.sh", "models/one", "one.h5", *OPTIONS)
    assert outcome.returncode == 2
    assert "one.h5: the file exists" in outcome.stderr


def test_job_without_progress_is_not_requeued(cluster):
    outcome = cluster.submit("job.sh", "models/one", "one.h5", *OPTIONS, "--max-wall", "1e-9")
    assert outcome.returncode == 4
    assert "a longer --time is needed" in outcome.stdout
    assert cluster.requeued() == []


def test_job_that_fails_says_so(cluster):
    (cluster.folder / "models/one/block.df").write_text("1 2 3\n")
    outcome = cluster.submit("job.sh", "models/one", "one.h5")
    assert outcome.returncode == 2
    assert "failed with exit code 2" in outcome.stdout
    assert "block.df" in outcome.stderr
    assert cluster.submit("job.sh").returncode == 2


def test_array_of_models(cluster):
    for task, name in ((1, "one"), (2, "two")):
        tasks = {"SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": str(task)}
        before = len(cluster.requeued())
        cluster.run_to_the_end("array.sh", "models", "results", *OPTIONS, LIMIT="0.1", **tasks)
        assert set(cluster.requeued()[before:]) == {f"requeue 7_{task}"}
        assert differences(cluster.whole(name), cluster.folder / "results" / f"{name}.h5") == []
    outcome = cluster.submit("array.sh", "models", "results", SLURM_ARRAY_TASK_ID="3")
    assert (outcome.returncode, outcome.stderr) == (2, "array.sh: there is no model number 3: 2 folders\n")
    assert cluster.submit("array.sh", "models", "results").returncode == 2
