# SPDX-License-Identifier: MIT
"""Runs and simulations through the extension."""

import os
import signal
import subprocess
import sys
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import rockdda
from places import EXTENSION, INPUTS, ROOT, assert_same_results

pytestmark = pytest.mark.usefixtures("native")


def test_a_run_gives_what_the_program_gives(flat_arch, tmp_path):
    results = rockdda.run(INPUTS / "flat_arch", output=tmp_path / "mine.h5", steps=60, save_every=20)
    assert results.complete
    assert_same_results(flat_arch, results.path)
    assert (tmp_path / "mine.log").exists()


def test_files_options_and_threads(program, tmp_path):
    folder = INPUTS / "toppling_column"
    files = [folder / "toppling_column.dc", folder / "toppling_column.df"]
    config = tmp_path / "run.nml"
    config.write_text("&run title = 'two files' /\n&time dt_max = 0.002 /\n")
    command = [program, "run", *files, "--config", config, "-o", tmp_path / "a.h5", "--steps", "40", "--threads", "1"]
    subprocess.run([*command, "--solver", "pcg", "--quiet"], check=True, capture_output=True)
    results = rockdda.run(*files, config=config, output=tmp_path / "b.h5", steps=40, threads=2, solver="pcg")
    assert results.title == "two files"
    assert_same_results(tmp_path / "a.h5", tmp_path / "b.h5")


THREADS = """
import os, sys, rockdda
rockdda.__path__.append(sys.argv[2])
model = rockdda.Model("wall", labelled=True, gravity=10.0)
model.add_polygon([(0, 0), (40, 0), (40, 30), (0, 30)])
for i in range(1, 40):
    model.add_line((i, 0), (i, 30))
for i in range(1, 30):
    model.add_line((0, i), (40, i))
for i in range(40):
    model.add_fixed((i + 0.2, 0.2), (i + 0.8, 0.2))
model.add_block_material(density=2500, young=1e9, poisson=0.2, name="rock")
model.add_joint_material(friction=30, name="joint", normal_stiffness=1e10, shear_stiffness=1e10)
model.add_group("run", steps=3)
before = len(os.listdir("/proc/self/task"))
model.run(output=sys.argv[1])
print(before, len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="there is one core")
def test_a_small_model_runs_on_one_thread(tmp_path):
    """Nobody has chosen a number; OpenMP keeps its threads once it has started some."""
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    environment |= {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", THREADS, tmp_path / "a.h5", EXTENSION], capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, done.stderr
    before, after = map(int, done.stdout.split())
    assert after == before


def test_default_output_is_named_after_the_analysis_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    results = rockdda.run(INPUTS / "free_fall", steps=3)
    monkeypatch.chdir("/")
    assert results.path == tmp_path / "free_fall.h5"
    assert len(results["history/step"]) == 3  # also from another folder


def test_an_older_result_is_overwritten_by_force_only(tmp_path):
    path = tmp_path / "x.h5"
    rockdda.run(INPUTS / "free_fall", output=path, steps=3)
    before = path.read_bytes()
    with pytest.raises(rockdda.InputError, match="use force=True") as caught:
        rockdda.run(INPUTS / "free_fall", output=path, steps=4)
    assert caught.value.file == str(path)
    assert path.read_bytes() == before
    assert rockdda.run(INPUTS / "free_fall", output=path, steps=4, force=True).n_steps == 4


def test_bad_input_is_reported_with_its_place(tmp_path):
    (tmp_path / "m.dc").write_text((INPUTS / "incline/incline.dc").read_text())
    text = (INPUTS / "incline/incline.df").read_text().splitlines()
    last = max(i for i, line in enumerate(text) if line.strip() and not line.strip().startswith("#"))
    (tmp_path / "m.df").write_text("\n".join([*text[:last], "thirty 0 0", *text[last + 1 :]]) + "\n")
    with pytest.raises(rockdda.InputError) as caught:
        rockdda.run(tmp_path, output=tmp_path / "x.h5")
    error = caught.value
    assert error.file == str(tmp_path / "m.df")
    assert (error.line, error.column) == (last + 1, 1)
    assert "found 'thirty'" in error.problems[0].message
    assert str(error).startswith(f"{tmp_path}/m.df:{last + 1}:1: error: ")
    assert "^" in str(error)
    assert not (tmp_path / "x.h5").exists()


def test_all_problems_are_listed(tmp_path):
    (tmp_path / "m.dc").write_text((INPUTS / "incline/incline.dc").read_text())
    (tmp_path / "m.df").write_text((INPUTS / "incline/incline.df").read_text())
    (tmp_path / "m.nml").write_text("&run titlee = 'x' /\n&time k01 = 3 /\n&slover method = 'x' /\n")
    with pytest.raises(rockdda.InputError) as caught:
        rockdda.run(tmp_path, output=tmp_path / "x.h5")
    assert [problem.line for problem in caught.value.problems] == [1, 2, 3]
    assert all(problem.file == str(tmp_path / "m.nml") for problem in caught.value.problems)
    assert "did you mean 'title'" in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": -1}, "steps: expected a whole number from 0, found -1"),
        ({"steps": 1.5}, "steps: expected a whole number from 0, found 1.5"),
        ({"threads": 0}, "threads: expected a whole number from 1"),
        ({"t_end": 0.0}, "t_end: must be above 0"),
        ({"dialect": "old"}, "dialect: expected 'dda_windows' or 'g0', found 'old'"),
        ({"output": ""}, "output: expected a file name"),
        ({"solver": "magic"}, "magic"),
    ],
)
def test_bad_arguments(tmp_path, arguments, message):
    arguments.setdefault("output", tmp_path / "x.h5")
    with pytest.raises(rockdda.InputError, match=message):
        rockdda.run(INPUTS / "free_fall", **arguments)
    assert list(tmp_path.iterdir()) == []


def test_the_dialect_of_dda_for_windows_has_a_present_and_a_former_name(tmp_path):
    runs = [
        rockdda.run(INPUTS / "free_fall", output=tmp_path / f"{name}.h5", steps=3, dialect=name)
        for name in ("dda_windows", "peer")
    ]
    np.testing.assert_array_equal(runs[0]["frames/vertices"], runs[1]["frames/vertices"])


def test_missing_files(tmp_path):
    with pytest.raises(rockdda.InputError, match="no such folder"):
        rockdda.run(tmp_path / "nothing")
    with pytest.raises(rockdda.InputError, match="an analysis file is needed, too"):
        rockdda.run(INPUTS / "free_fall/free_fall.dc")
    with pytest.raises(rockdda.InputError, match="no such file") as caught:
        rockdda.run(tmp_path / "a.dc", tmp_path / "b.df")
    assert [problem.file for problem in caught.value.problems] == [str(tmp_path / "a.dc"), str(tmp_path / "b.df")]


def test_output_that_cannot_be_written(tmp_path):
    with pytest.raises(rockdda.OutputError, match="nowhere"):
        rockdda.run(INPUTS / "free_fall", output=tmp_path / "nowhere/x.h5", steps=3)


def test_no_convergence_keeps_the_results(tmp_path):
    """SOR cannot solve stiff contacts at a step that may not be cut."""
    config = tmp_path / "run.nml"
    config.write_text("&time dt_min = 0.01, dt_max = 0.01 /\n&contact stiffness = 1e13 /\n&solver method = 'sor' /\n")
    files = [INPUTS / "flat_arch/flat_arch.dc", INPUTS / "flat_arch/flat_arch.df"]
    with pytest.raises(rockdda.ConvergenceError, match="step 1") as caught:
        rockdda.run(*files, config=config, output=tmp_path / "x.h5")
    results = caught.value.results
    assert results.n_frames == 1
    assert not results.complete
    assert results.exit_reason.startswith("failed: step 1")


def test_progress_is_reported(tmp_path):
    told = []
    rockdda.run(INPUTS / "flat_arch", output=tmp_path / "x.h5", steps=60, progress=lambda *where: told.append(where))
    assert told[-1][0] == 1.0
    assert told[-1][1] == 60
    assert told == sorted(told)


def test_a_bar_can_be_shown(tmp_path, capsys):
    rockdda.run(INPUTS / "flat_arch", output=tmp_path / "x.h5", steps=5, progress=True)
    shown = capsys.readouterr()
    assert "100%" in shown.out + shown.err


def test_an_exception_of_the_caller_stops_the_run_in_order(tmp_path):
    class Enough(Exception):
        pass

    def stop(fraction, step, time):
        raise Enough

    with pytest.raises(Enough):
        rockdda.run(INPUTS / "jointed_slope", output=tmp_path / "x.h5", t_end=1000.0, progress=stop)
    results = rockdda.open(tmp_path / "x.h5")
    assert results.exit_reason == "stopped by Enough"
    assert results.frames[-1].step == results.n_steps > 0


def test_max_wall_stops_in_order(tmp_path):
    for limit in (0.5, 5, 50):  # where a busy machine needs as long for the start, there are no steps
        output = tmp_path / f"{limit}.h5"
        results = rockdda.run(INPUTS / "jointed_slope", output=output, t_end=1000.0, max_wall=limit)
        assert not results.complete
        assert results.exit_reason == "max-wall"
        assert results.frames[-1].step == results.n_steps
        if results.n_steps > 0:
            break
    assert results.n_steps > 0


def test_ctrl_c_stops_after_the_step_and_keeps_the_results(tmp_path):
    script = f"""
import os, signal, sys, threading
import rockdda
rockdda.__path__.append({str(EXTENSION)!r})
started = threading.Event()
threading.Thread(target=lambda: (started.wait(), os.kill(os.getpid(), signal.SIGINT))).start()
try:
    rockdda.run({str(INPUTS / "jointed_slope")!r}, output="x.h5", t_end=1000.0, progress=lambda *where: started.set())
except KeyboardInterrupt as error:
    print(error)
    sys.exit(7)
finally:
    started.set()
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "postprocess")}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 7, done.stderr
    results = rockdda.open(tmp_path / "x.h5")
    assert results.exit_reason == "signal SIGINT"
    assert results.frames[-1].step == results.n_steps > 0
    assert f"stopped after step {results.n_steps}; the results so far are in {tmp_path}/x.h5" in done.stdout


def test_the_lock_is_free_while_steps_are_done(tmp_path):
    """A thread counts while the main thread is in one long call of the extension."""
    simulation = rockdda.Simulation(INPUTS / "jointed_slope")
    counted = 0
    stop = threading.Event()

    def count():
        nonlocal counted
        while not stop.wait(0.001):
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    simulation._session.advance(100, 1e9)
    stop.set()
    thread.join()
    assert simulation._session.sizes()["step"] == 100
    # 100 steps take half a second and more; with the lock held the thread counts before and after them only
    assert counted > 10


def test_runs_in_threads_do_not_disturb_each_other(tmp_path):
    """With results being written by all of them."""
    names = ["flat_arch", "six_block_beam", "stack", "jointed_slope"]

    def run(name, kind):
        return rockdda.run(INPUTS / name, output=tmp_path / f"{name}_{kind}.h5", steps=30, save_every=1).path

    alone = [run(name, "alone") for name in names]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(run, names, ["together"] * len(names)))
    for one, other in zip(alone, together, strict=True):
        assert_same_results(one, other)


def test_simulation_is_the_run_step_by_step(flat_arch):
    results = rockdda.open(flat_arch)
    with rockdda.Simulation(INPUTS / "flat_arch", steps=60) as simulation:
        assert simulation.n_blocks == results.n_blocks
        for frame in results.frames:
            assert simulation.step == frame.step
            assert simulation.time == frame.time
            for name in ("vertices", "centroid", "rotation", "stress", "velocity"):
                np.testing.assert_array_equal(getattr(simulation, name), getattr(frame, name), err_msg=name)
            for name in ("point", "force", "state", "blocks"):
                expected = getattr(frame.contacts, name)
                np.testing.assert_array_equal(getattr(simulation.contacts, name), expected, err_msg=name)
            done = simulation.advance(20)
        assert done == 0
        assert simulation.finished
        assert simulation.energy == dict(zip(results.energy_names, results["history/energy"][-1], strict=True))
        assert simulation.dt == results["history/dt"][-1]


def test_arrays_of_a_simulation_stay_as_they_were():
    simulation = rockdda.Simulation(INPUTS / "free_fall", steps=10)
    before = simulation.vertices
    copy = before.copy()
    simulation.advance(5)
    np.testing.assert_array_equal(before, copy)
    assert np.any(simulation.vertices != copy)
    np.testing.assert_array_equal(simulation.displacement, simulation.vertices - copy)
    with pytest.raises(ValueError, match="read-only"):
        simulation.velocity[0, 0] = 1.0


def test_simulation_can_write_results(flat_arch, tmp_path):
    with rockdda.Simulation(INPUTS / "flat_arch", output=tmp_path / "x.h5", steps=60, save_every=20) as simulation:
        while simulation.advance(7):
            pass
    assert_same_results(flat_arch, tmp_path / "x.h5")
    assert simulation.results().complete


def test_a_simulation_that_is_left_early_says_so(tmp_path):
    with rockdda.Simulation(INPUTS / "flat_arch", output=tmp_path / "x.h5") as simulation:
        simulation.advance(3)
    assert simulation.results().exit_reason == "closed"
    with pytest.raises(rockdda.InputError, match="writes no results"):
        rockdda.Simulation(INPUTS / "flat_arch").results()


def test_a_simulation_that_is_forgotten_closes_its_results(tmp_path):
    simulation = rockdda.Simulation(INPUTS / "flat_arch", output=tmp_path / "x.h5")
    simulation.advance(3)
    del simulation
    results = rockdda.open(tmp_path / "x.h5")
    assert (results.n_steps, results.exit_reason) == (3, "closed")


def test_warnings_about_input_are_python_warnings(tmp_path):
    (tmp_path / "m.dc").write_text((INPUTS / "free_fall/free_fall.dc").read_text())
    (tmp_path / "m.df").write_text((INPUTS / "free_fall/free_fall.df").read_text())
    (tmp_path / "m.nml").write_text("&run title = 'x', title = 'y' /\n")
    with pytest.warns(rockdda.InputWarning, match="given again") as caught:
        rockdda.run(tmp_path, output=tmp_path / "x.h5", steps=1)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(rockdda.InputWarning):
            rockdda.run(tmp_path, output=tmp_path / "y.h5", steps=1)
    assert not (tmp_path / "y.h5").exists()


def test_non_ascii_paths_and_titles(tmp_path):
    folder = tmp_path / "Böschung – Süd"
    folder.mkdir()
    (folder / "größe.dc").write_text((INPUTS / "free_fall/free_fall.dc").read_text())
    (folder / "größe.df").write_text((INPUTS / "free_fall/free_fall.df").read_text())
    (folder / "größe.nml").write_text("&run title = 'Rutschung α' /\n")
    results = rockdda.run(folder, output=folder / "aus gäng.h5", steps=2)
    assert results.title == "Rutschung α"
    assert results.path.name == "aus gäng.h5"


def test_signal_handlers_of_python_are_left_alone(tmp_path):
    before = signal.getsignal(signal.SIGINT)
    rockdda.run(INPUTS / "free_fall", output=tmp_path / "x.h5", steps=1)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_stretched_bond_is_kept_at_rest(tmp_path):
    """A block hangs from a bonded joint, stretched two hundred times as far as gravity moves it in a step."""
    model = rockdda.Model("hanging", e0=0.001, k01=0.9, steps=300, dt_max=0.001)
    model.add_polygon([(0, 0), (1, 0), (1, 2), (0, 2)])
    model.add_line((0, 1), (1, 1))
    for x, y in ((0.1, 1.9), (0.9, 1.9), (0.5, 1.1)):
        model.add_fixed((x, y))
    model.add_measured((0.5, 0.99))
    model.add_measured((0.5, 1.01))
    model.add_block_material(density=2500, gravity=9.81, youngs_modulus=1e10, poisson_ratio=0.25)
    model.add_joint_material(friction_angle=30, cohesion=1e6, tension=1e6)
    weight, stretch = 2500 * 9.81, 1e-3
    model.stiffness = weight / stretch  # of the joint, which is as long as the mean edge
    results = model.run(output=tmp_path / "hanging.h5")
    assert results["history/contacts"][-1].tolist() == [0, 0, 2]
    hanging, above = results["history/measured_displacement"][-1, :, 1]
    assert above - hanging == pytest.approx(stretch, rel=0.01)  # and the strain of the blocks near the joint


FALL = """0.01 8 0 0 0 2 0 0 0
0 0 4 0 1  4 0 4 1 1  4 1 0 1 1  0 1 0 0 1  1 1.05 1 2.05 1  1 2.05 3 2.05 1  3 2.05 3 1.05 1  3 1.05 1 1.05 1
0.5 0.5 0.5 0.5  3.5 0.5 3.5 0.5
"""


def test_energy_from_nowhere_is_a_warning_or_an_error(tmp_path):
    # with the preset contacts close late, with an overlap whose energy nothing has put in
    (tmp_path / "fall.dc").write_text(FALL, encoding="utf-8")
    (tmp_path / "fall.df").write_text(
        "1 40 1 1 0.02 0.01 1e8 0 0\n1000 9810 1e8 0.2 0 0 0 0 0 0 0 0 0\n30 0 0\n", encoding="utf-8"
    )
    (tmp_path / "late.nml").write_text("&contact preset = 'dda_windows', close_tolerance = 0.005 /\n", encoding="utf-8")
    model = (tmp_path / "fall.dc", tmp_path / "fall.df")
    settings = {"config": tmp_path / "late.nml", "output": tmp_path / "fall.h5", "force": True}
    with pytest.warns(rockdda.InputWarning, match="energy from nowhere"):
        rockdda.run(*model, **settings)
    with pytest.raises(rockdda.ConvergenceError, match="energy from nowhere") as caught:
        rockdda.run(*model, **settings, strict=True)
    assert 0 < caught.value.results.n_steps < 40
    simulation = rockdda.Simulation(*model, config=tmp_path / "late.nml", strict=True)
    with pytest.raises(rockdda.ConvergenceError, match="energy from nowhere"):
        simulation.advance(40)
    assert 0 < simulation.step < 40
