# SPDX-License-Identifier: MIT
"""The benchmark suite runs, and what it counts (not what it times) is as it should be."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from figures import fit_exponent, middle_of, work_of

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def build():
    """The build under test, when it is an optimised one."""
    if "ROCKDDA_PROGRAM" not in os.environ:
        pytest.skip("ROCKDDA_PROGRAM does not name a program")
    folder = Path(os.environ["ROCKDDA_PROGRAM"]).resolve().parents[1]
    cache = (folder / "CMakeCache.txt").read_text() if (folder / "CMakeCache.txt").exists() else ""
    if "CMAKE_BUILD_TYPE:STRING=Rel" not in cache:
        pytest.skip("the program is not an optimised build")
    return folder


@pytest.fixture(scope="module")
def figures(build, tmp_path_factory):
    """What `scripts/bench --quick` finds."""
    output = tmp_path_factory.mktemp("bench")
    done = subprocess.run(
        [ROOT / "scripts" / "bench", "--quick", "--quiet", "--threads", "1,2,4", "--output", output],
        env={**os.environ, "ROCKDDA_BUILD": str(build), "OMP_WAIT_POLICY": "passive"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "exponent of cost" in done.stdout
    assert (output / "bench.png").stat().st_size > 10_000
    return json.loads((output / "bench.json").read_text())


def wall_of(figures, size):
    return next(run for run in figures["runs"] if run["kind"] == "scaling" and run["size"] == size)


def test_counted_work_grows_with_the_number_of_blocks(figures):
    assert 0.95 <= figures["derived"]["exponent_of_work"] <= 1.05


def test_iterations_do_not_depend_on_size(figures):
    small, large = (wall_of(figures, size)["early"]["iterations"] for size in (1000, 10_000))
    assert 0 < large <= 1.1 * small


def test_memory_of_a_block(figures):
    # 11.3 kB in a wall of 10,000 (and of 100,000), and room for what a few columns of the contact table take
    assert 0 < wall_of(figures, 10_000)["bytes_per_block"] <= 11.8e3


def test_threads_do_not_change_a_bit(figures):
    sums = {run["threads"]: run["checksum"] for run in figures["runs"] if run["kind"] == "threads"}
    assert sorted(sums) == [1, 2, 4]
    assert len(set(sums.values())) == 1


def test_every_run_tells_where_its_time_went(figures):
    names = {run["model"] for run in figures["runs"]}
    assert names == {"wall", "roof", "tunnel", "slope", "slide"}
    for run in figures["runs"]:
        assert all(run["settled"]["phases"][phase] > 0 for phase in ("search", "assembly", "solve", "update"))
        assert run["first"]["closed"] > 0
    assert any(run["last_output"] > 0 for run in figures["runs"])


@pytest.mark.parametrize(
    "model",
    [
        "wall blocks=300 ratio=40",
        "wall blocks=200 ratio=40 softness=50",
        "roof blocks=200",
        "slope blocks=300",
        "tunnel",
    ],
)
def test_a_solver_twice_as_accurate_changes_no_contact(build, figures, model):
    """The default tolerance is small enough: rounds and states of every step stay (`figures` has built the program)."""
    runs = []
    for tolerance in ("1e-10", "5e-11"):
        words = [build / "bin" / "bench_steps", *model.split(), "steps=8", "solver=pcg", f"tolerance={tolerance}"]
        lines = subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
        steps = [json.loads(line) for line in lines[1:-1]]
        runs.append([[step[name] for name in ("attempts", "rounds", "closed", "sliding")] for step in steps])
    assert len(runs[0]) == 8
    assert runs[0] == runs[1]


def test_exponent_of_a_power_law():
    assert fit_exponent([(n, 3.0 * n**1.5) for n in (10, 200, 5000)]) == pytest.approx(1.5)


def test_middle_of_steps():
    steps = [{"seconds": s, "phases": {"solve": s / 2}} for s in (1.0, 9.0, 2.0)]
    assert middle_of(steps) == {"seconds": 2.0, "phases": {"solve": pytest.approx(2.0)}}


def test_counted_work():
    assert work_of({"iterations": 10, "stored": 30, "solves": 2, "contacts": 50}) == 10 * 30 + 2 * (30 + 50)


def test_two_programs_in_turn(tmp_path):
    """The same program twice: the same steps, instructions or not, and a ratio with its spread for each time."""
    if "ROCKDDA_PROGRAM" not in os.environ:
        pytest.skip("ROCKDDA_PROGRAM does not name a program")
    program, figures = os.environ["ROCKDDA_PROGRAM"], tmp_path / "figures.json"
    command = [ROOT / "scripts" / "bench", "--compare", program, program, "--pairs", "2", "--steps", "2"]
    command += ["--models", "start_up,wall-60-ratio-40,layered_roof", "--json", figures]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = json.loads(figures.read_text())
    assert [row["run"] for row in rows] == ["start_up", "wall-60-ratio-40", "layered_roof"]
    # the wall: 8 courses of 7 bricks, every other one with another half brick, and the base
    assert [row["blocks"] for row in rows] == [[2, 2], [61, 61], [166, 166]]
    for row in rows:
        assert row["steps"] == [2, 2]
        old, new, ratio, low, high = row["wall"]
        assert old > 0 < new
        assert 0 < low <= ratio <= high


def test_an_unknown_run_is_refused(tmp_path):
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    command = [ROOT / "scripts" / "bench", "--compare", program, program, "--models", "well-2000"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "unknown run 'well-2000', expected start_up" in done.stderr
