# SPDX-License-Identifier: MIT
"""Studies: a block that slides to a stop after v^2/(2 g tan(phi)), over a grid of friction angles and velocities."""

import fcntl
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rockdda import cli
from rockdda.errors import InputError
from rockdda.study import collect, evaluate, pending, prepare_case, read_study, run_study
from rockdda.study.job_array import last_words, logs_of, warning_of

GEOMETRY = """\
0.001   # e0
7 4
1
0 2 0 1 0
-2 -1 12 -1 1
12 -1 12 0 1
12 0 -2 0 1
-2 0 -2 -1 1
0 0 0 1 1
0 1 1 1 1
1 1 1 0 1
0.5 0.5 0.6 0.5 2
-1 -0.5 -1 -0.5
11 -0.5 11 -0.5
0.5 0.5
"""
ANALYSIS = """\
1 {{steps}} 2 1 0.05 {{dt:.4f}}    # k01, steps, materials, g2, g1
{{stiffness}}                      # g0
0 0
2000 {{2000*9.81}} 1e9 0.2  0 0 0  0 0 0  0 0 0
2000 {{2000*9.81}} 1e9 0.2  0 0 0  0 0 0  {{v}} 0 0
{{phi}} 0 0
"""
STUDY = """\
title = "Sliding to a stop"
template = "template"

[parameters]
phi = [20, 30, 40]
v = [2.0, 3.0]

[constants]
steps = 300
dt = 0.005
stiffness = 1e10

[results.distance]
dataset = "history/measured_displacement"
at = [0, 0]
unit = "m"
"""


@pytest.fixture
def folder(tmp_path, program, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    (tmp_path / "template").mkdir()
    (tmp_path / "template/slide.dc").write_text(GEOMETRY)
    (tmp_path / "template/slide.df").write_text(ANALYSIS)
    (tmp_path / "slide.toml").write_text(STUDY)
    return tmp_path


def check_distances(table):
    """Within 0.2 %: the step that stops the block is a share of 0.005 s v of the way too long or short, 0.1 % here."""
    for _, row in table.iterrows():
        exact = row["v"] ** 2 / (2 * 9.81 * math.tan(math.radians(row["phi"])))
        assert row["distance"] == pytest.approx(exact, rel=2e-3), row


def test_grid_is_run_once(folder):
    study = read_study(folder / "slide.toml")
    assert len(study.cases) == 6
    told = []
    outcomes = run_study(study, workers=2, progress=lambda done, total, outcome: told.append((done, total)))
    assert [outcome.status for outcome in outcomes] == ["done"] * 6
    assert told == [(i, 6) for i in range(1, 7)]
    table = collect(study)
    assert list(table["phi"]) == [20, 20, 30, 30, 40, 40]
    check_distances(table)
    # nothing is left; a change of the template asks for all, a further value for two
    assert run_study(study) == []
    (folder / "slide.toml").write_text(STUDY.replace("[20, 30, 40]", "[20, 30, 40, 50]"))
    assert [case.values["phi"] for case in pending(read_study(folder / "slide.toml"))] == [50, 50]
    (folder / "template/slide.df").write_text(ANALYSIS.replace("1e9 0.2", "2e9 0.2"))
    assert len(pending(read_study(folder / "slide.toml"))) == 8


def test_command(folder, capfd):
    (folder / "slide.toml").write_text(STUDY.replace("[2.0, 3.0]", "[2.0]"))
    assert cli.main(["study", str(folder / "slide.toml"), "--json"]) == 0
    summary = json.loads(capfd.readouterr().out)
    assert (summary["cases"], summary["done"], summary["run_now"]) == (3, 3, 3)
    assert (folder / "slide/table.csv").read_text().count("\n") == 4
    # a PNG of some size
    assert (folder / "slide/table.png").stat().st_size > 5000
    assert cli.main(["study", str(folder / "slide.toml"), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["run_now"] == 0


def test_failed_cases_are_listed_and_run_again_on_request(folder, capfd):
    # a stiffness that is no number fails in one case only
    text = (
        STUDY.replace("[2.0, 3.0]", "[2.0]")
        .replace("stiffness = 1e8\n", "")
        .replace("[parameters]", '[parameters]\nstiffness = ["soft", 1e8]')
        .replace("[20, 30, 40]", "[30]")
    )
    (folder / "slide.toml").write_text(text)
    assert cli.main(["study", str(folder / "slide.toml")]) == 3
    captured = capfd.readouterr()
    assert "case 1 failed: slide.df:" in captured.err
    assert "2 cases, 1 done, 1 failed" in captured.out
    study = read_study(folder / "slide.toml")
    assert run_study(study) == []
    (outcome,) = run_study(study, retry=True)
    assert outcome.status == "failed"
    assert "found 'soft'" in outcome.message
    assert cli.main(["study", str(folder / "slide.toml"), "--table", "--quiet"]) == 3


def test_timeout_is_a_failure_that_keeps_its_results(folder):
    text = (
        STUDY.replace("[20, 30, 40]", "[20]").replace("[2.0, 3.0]", "[2.0]").replace("steps = 300", "steps = 100000000")
    )
    (folder / "slide.toml").write_text(text + "\n[run]\ntimeout = 5\n")  # a busy machine may need long for the start
    (outcome,) = run_study(read_study(folder / "slide.toml"))
    assert (outcome.status, outcome.exit_code) == ("failed", 124)
    assert "timeout" in outcome.message
    (case,) = (folder / "slide/cases").iterdir()
    assert (case / "out.h5").stat().st_size > 0


def test_interrupted_study_continues(folder):
    """SIGTERM in the middle; what was done stays, the rest follows with the same numbers."""
    text = STUDY.replace("steps = 300", "steps = 30000")
    (folder / "slide.toml").write_text(text)
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])}
    command = [sys.executable, "-m", "rockdda", "study", str(folder / "slide.toml"), "--workers", "2"]
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        process.stderr.readline()  # the first case is done
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=120)
    assert process.returncode == cli.STOPPED
    study = read_study(folder / "slide.toml")
    left = pending(study)
    assert 0 < len(left) < 6
    assert {outcome.status for outcome in run_study(study, workers=2)} == {"done"}
    check_distances(collect(study))


def test_job_array(folder):
    study_file = folder / "slide.toml"
    study_file.write_text(STUDY.replace("[2.0, 3.0]", "[2.0]") + '\n[cluster]\ntime = "0:10:00"\n')
    assert cli.main(["study", str(study_file), "--slurm", "--quiet"]) == 0
    script = folder / "slide/job-array.sh"
    text = script.read_text()
    assert "#SBATCH --array=1,2,3\n" in text
    assert "#SBATCH --time=0:10:00\n" in text
    # what the scheduler would do, one task after the other; the third one is left out
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "ROCKDDA_PROGRAM")}
    for task in ("1", "2"):  # as from a built tree: the script itself says where package and program are
        subprocess.run(["bash", script], env={**environment, "SLURM_ARRAY_TASK_ID": task}, check=True, timeout=120)
    assert [case.number for case in pending(read_study(study_file))] == [3]
    assert cli.main(["study", str(study_file), "--slurm", "--quiet"]) == 0
    assert "#SBATCH --array=3\n" in script.read_text()


def test_more_cases_than_slurm_takes_tasks(folder, monkeypatch):
    """MaxArraySize 3: two tasks do three cases; the table of a study that is not done ends with 4."""
    monkeypatch.setattr("rockdda.study.job_array._array_size", lambda: 3)
    study_file = folder / "slide.toml"
    study_file.write_text(STUDY.replace("[2.0, 3.0]", "[2.0]"))
    assert cli.main(["study", str(study_file), "--slurm", "--quiet"]) == 0
    script = folder / "slide/job-array.sh"
    assert "#SBATCH --array=1-2\n" in script.read_text()
    assert cli.main(["study", str(study_file), "--table", "--quiet"]) == cli.STOPPED
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for task in ("1", "2"):
        subprocess.run(["bash", script], env={**environment, "SLURM_ARRAY_TASK_ID": task}, check=True, timeout=120)
    assert cli.main(["study", str(study_file), "--table", "--quiet"]) == 0


@pytest.mark.parametrize(
    ("limit", "warning"),
    [("0:01:00", 12), ("1", 12), ("0:10:00", 120), ("1-00", 120), ("30:00", 120), ("5:00", 60), ("forever", 120)],
)
def test_the_warning_fits_the_time(folder, limit, warning):
    (folder / "slide.toml").write_text(STUDY + f'\n[cluster]\ntime = "{limit}"\n')
    assert warning_of(read_study(folder / "slide.toml")) == warning


def test_logs_of_tasks_that_ended_before_their_case(folder):
    (folder / "slide.toml").write_text(STUDY)
    study = read_study(folder / "slide.toml")
    logs_of(study).mkdir(parents=True)
    (logs_of(study) / "7_1.log").write_text(
        "rockdda-post: case 1\nNo module named rockdda\nrockdda-post: case 1 ended with exit code 1\n"
        "rockdda-post: case 2\nrockdda-post: case 3\n"
        "slurmstepd: error: *** JOB 7 CANCELLED AT 12:00 DUE TO TIME LIMIT ***\n"
    )
    found = last_words(study)
    assert found[1] == (True, f"No module named rockdda ({logs_of(study) / '7_1.log'})")
    assert 2 not in found
    assert not found[3][0] and "TIME LIMIT" in found[3][1]
    rows = collect(study)
    assert list(rows["status"][:3]) == ["failed", "waiting", "waiting"]


def test_a_case_that_another_process_runs_is_left_alone(folder):
    """By its lock; neither its status nor its files change."""
    (folder / "slide.toml").write_text(STUDY.replace("[20, 30, 40]", "[20]").replace("[2.0, 3.0]", "[2.0]"))
    study = read_study(folder / "slide.toml")
    place = prepare_case(study, study.cases[0])
    before = {path.name: path.read_bytes() for path in place.iterdir()}
    handle = os.open(place, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        (outcome,) = run_study(study)
        assert (outcome.status, outcome.message) == ("running", "another process runs this case")
        assert {path.name: path.read_bytes() for path in place.iterdir()} == before
    finally:
        os.close(handle)
    (outcome,) = run_study(study)
    assert outcome.status == "done"


def test_dask_with_a_worker_that_dies(folder):
    distributed = pytest.importorskip("distributed")
    text = STUDY.replace("steps = 300", "steps = 40000").replace("[2.0, 3.0]", "[2.0]")
    (folder / "slide.toml").write_text(text)
    study = read_study(folder / "slide.toml")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        victim = next(iter(cluster.workers.values())).process.process.pid

        def kill() -> None:
            # while both workers run a case
            while len(list((folder / "slide/cases").glob("*/out.h5"))) < 2:
                time.sleep(0.02)
            os.kill(victim, signal.SIGKILL)

        import threading

        killer = threading.Thread(target=kill)
        killer.start()
        outcomes = run_study(study, dask=cluster.scheduler_address)
        killer.join()
    assert {outcome.status for outcome in outcomes} == {"done"}
    check_distances(collect(study))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "phi = [20, 30, 40]",
            "phi = []",
            "slide.toml:5:1: error: parameter 'phi': expected a list of numbers or texts",
        ),
        ("phi = [20, 30, 40]", "phi = [20, 20]", "slide.toml:5:1: error: parameter 'phi': a value is given twice"),
        ("v = [2.0, 3.0]", "w = [2.0]", "template/slide.df: error: 'v' is no parameter or constant of slide.toml"),
        ("[constants]", "[constants]\nzeta = 1", None),
        (
            "v = [2.0, 3.0]",
            "v = [2.0]\nw = [1]",
            "slide.toml:7:1: error: parameter 'w' is used in no file of the template",
        ),
        (
            "[constants]",
            "[constant]",
            "slide.toml:8:1: error: unknown name 'constant' in the study; did you mean 'constants'?",
        ),
        ('template = "template"', 'template = "nowhere"', "slide.toml:2:1: error: template: no such folder"),
        ("at = [0, 0]", "at = 0.5", "slide.toml:13:1: error: result 'distance': at: expected whole numbers, found 0.5"),
        ("at = [0, 0]", 'take = "median"', "error: result 'distance': take: must be one of last, first"),
        ("steps = 300", "steps = ", "slide.toml:9:9: error: Invalid value"),
        (
            "[results.distance]",
            "[run]\nthreads = 0\n[results.distance]",
            "error: threads: expected a whole number from 1 to 100000",
        ),
    ],
)
def test_bad_studies(folder, old, new, message):
    (folder / "slide.toml").write_text(STUDY.replace(old, new))
    if message is None:  # constants need not be used
        read_study(folder / "slide.toml")
        return
    with pytest.raises(InputError) as error:
        read_study(folder / "slide.toml")
    assert message in str(error.value)


def test_bad_placeholders(folder):
    for text, message in (
        ("{{phi +}}", "expected a parameter or a formula"),
        ("{{1/(phi-20)}}", "division by zero"),
        ("{{open(1)}}", "expected a parameter or a formula"),
        ("{{phi.real}}", "expected a parameter or a formula"),
        ("{{phi:q}}", "is no format such as .3f"),
    ):
        (folder / "template/slide.df").write_text(ANALYSIS + text)
        with pytest.raises(InputError, match=r"slide\.df:7") as error:
            read_study(folder / "slide.toml")
        assert message in str(error.value)


def test_formulas():
    values = {"span": 10.0, "n": 3}
    assert evaluate("span/2 - n**2 + max(1, n)", values) == 5 - 9 + 3
    assert evaluate("sin(pi/2)*-n", values) == -3
    for bad in ("__import__('os')", "span if n else 0", "[n]", "n**9999", "lambda: 0", "'a'*5"):
        with pytest.raises(ValueError):
            evaluate(bad, values)


def test_unknown_result(folder):
    (folder / "slide.toml").write_text(STUDY.replace("at = [0, 0]", "at = [7, 0]").replace("[20, 30, 40]", "[20]"))
    outcomes = run_study(read_study(folder / "slide.toml"))
    assert {outcome.status for outcome in outcomes} == {"failed"}
    assert "history/measured_displacement has the shape" in outcomes[0].message


def test_results_named_later_come_from_the_runs_that_are_there(folder, monkeypatch):
    """A study with a further result, or one that mends a wrong one, runs nothing again."""
    once = STUDY.replace("[20, 30, 40]", "[20]").replace("[2.0, 3.0]", "[2.0]")
    (folder / "slide.toml").write_text(once + '[results.top]\ndataset = "history/nothing"\n')
    (outcome,) = run_study(read_study(folder / "slide.toml"))
    assert outcome.status == "failed"
    assert "history/nothing" in outcome.message
    assert pending(read_study(folder / "slide.toml")) == []
    monkeypatch.setattr("rockdda.study.case._model_files", lambda *_: pytest.fail("it runs again"))
    (folder / "slide.toml").write_text(once)
    study = read_study(folder / "slide.toml")
    (outcome,) = run_study(study)
    assert outcome.status == "done"
    check_distances(collect(study))
    (folder / "slide.toml").write_text(once + '[results.steps]\ndataset = "history/time"\n')
    study = read_study(folder / "slide.toml")
    assert run_study(study) == []
    # 300 steps of 0.005 s, or fewer where steps were cut
    assert 1.0 < collect(study)["steps"][0] <= 1.5 + 1e-9


def test_a_wrong_result_named_later_is_a_failure(folder, capfd):
    """The table had an empty column, and the command said that all cases were done."""
    once = STUDY.replace("[20, 30, 40]", "[20]").replace("[2.0, 3.0]", "[2.0]")
    (folder / "slide.toml").write_text(once)
    assert cli.main(["study", str(folder / "slide.toml")]) == 0
    for wrong, message in (
        ("history/nothing", "has no array 'history/nothing'"), ("history/time", "history/time has the shape"),
    ):  # fmt: skip
        (folder / "slide.toml").write_text(once + f'[results.top]\ndataset = "{wrong}"\nat = [3]\n')
        capfd.readouterr()
        assert cli.main(["study", str(folder / "slide.toml")]) == 3
        captured = capfd.readouterr()
        assert re.search(f"case 1 failed: .*{message}", captured.err), captured.err
        assert "1 failed" in captured.out
    (folder / "slide.toml").write_text(once)
    assert cli.main(["study", str(folder / "slide.toml"), "--table"]) == 0


@pytest.mark.parametrize("head", ["&model", "! slides\n  &MODEL"])
def test_the_template_may_be_a_labelled_file(folder, head):
    """It was refused for want of an analysis file."""
    (folder / "template/slide.df").unlink()
    (folder / "template/slide.nml").write_text(
        head + " geometry = 'slide.dc' /\n"
        "&block_material number = 1, density = 2000, young = 1e9, poisson = 0.2 /\n"
        "&block_material number = 2, density = 2000, young = 1e9, poisson = 0.2 /\n"
        "&joint_material number = 1, friction = {{phi}} /\n"
        "&load gravity = 9.81 /\n&stage kind = 'dynamic', duration = {{last/100}} /\n"
    )
    study = '[parameters]\nphi = [30]\nlast = [2, 4]\n[results.end]\ndataset = "history/time"\n'
    (folder / "slide.toml").write_text('template = "template"\n' + study)
    outcomes = run_study(read_study(folder / "slide.toml"))
    assert [(outcome.status, outcome.message) for outcome in outcomes] == [("done", "")] * 2
    assert collect(read_study(folder / "slide.toml"))["end"].tolist() == pytest.approx([0.02, 0.04])
    (folder / "template/slide.nml").write_text("&run t_end = {{phi*last}} /\n")
    outcomes = run_study(read_study(folder / "slide.toml"))
    assert "needs a labelled file (.nml with &model), or an analysis file" in outcomes[0].message


def test_one_case_says_why_it_failed(folder, capfd):
    (folder / "slide.toml").write_text(STUDY.replace("1e10", '"soft"'))
    assert cli.main(["study", str(folder / "slide.toml"), "--case", "2"]) == 3
    captured = capfd.readouterr()
    assert "found 'soft'" in captured.err
    assert captured.out.startswith("case 2: failed")


def test_one_case_that_is_done_is_left_alone(folder, capfd):
    (folder / "slide.toml").write_text(STUDY)
    assert cli.main(["study", str(folder / "slide.toml"), "--case", "2"]) == 0
    status = next((folder / "slide/cases").glob("0002*/status.json"))
    before = (status.read_text(), status.stat().st_mtime_ns)
    assert cli.main(["study", str(folder / "slide.toml"), "--case", "2"]) == 0
    assert (status.read_text(), status.stat().st_mtime_ns) == before
    first, second = capfd.readouterr().out.splitlines()
    assert first == second  # with the seconds of the run


def test_the_parts_of_a_stopped_case_add_up_in_its_seconds(folder):
    study = read_study(folder / "slide.toml")
    here = prepare_case(study, study.cases[0])
    status = json.loads((here / "status.json").read_text())
    for ending, kept in (("stopped", 1000.0), ("failed", 0.0)):
        (here / "status.json").write_text(json.dumps({**status, "status": ending, "seconds": 1000.0, "exit_code": 3}))
        prepare_case(study, study.cases[0])
        assert json.loads((here / "status.json").read_text())["seconds"] == kept
    (here / "status.json").write_text(json.dumps({**status, "status": "stopped", "seconds": 1000.0}))
    (outcome,) = [o for o in run_study(study) if o.number == 1]
    assert outcome.status == "done"
    assert outcome.seconds > 1000


def test_a_misspelt_value_of_a_case_is_named(folder):
    cases = "cases = [{phi = 20, v = 2}, {phi = 20, vv = 2}]"
    (folder / "slide.toml").write_text(STUDY.replace("[parameters]\nphi = [20, 30, 40]\nv = [2.0, 3.0]", cases))
    with pytest.raises(InputError, match="case 1 gives no value for 'vv', which case 2 gives"):
        read_study(folder / "slide.toml")
