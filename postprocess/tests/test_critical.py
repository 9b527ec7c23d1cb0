# SPDX-License-Identifier: MIT
"""`rockdda.factor_of_safety` calls the program and reads its answer; its pictures."""

import json
import math
import stat
import sys

import h5py
import numpy as np
import pytest
import rockdda
from rockdda.critical import read_search
from rockdda.plot import plot, save
from rockdda_validation.factor_models import stack
from synthetic import write_wall

ANSWER = {
    "factor": 1.2075,
    "low": 1.205,
    "high": 1.21,
    "search": "strength",
    "trials": [
        {"value": 1.0, "stable": True, "steps": 2, "unbalanced": 3e-6, "displacement": 1e-8, "seconds": 0.01},
        {"value": 2.0, "stable": False, "steps": 90, "unbalanced": 0.2, "displacement": 0.3, "seconds": 0.1},
        {"value": 1.205, "stable": True, "steps": 8, "unbalanced": 1e-6, "displacement": 2e-8, "seconds": 0.02},
        {"value": 1.21, "stable": False, "steps": 120, "unbalanced": 0.02, "displacement": 0.2, "seconds": 0.2},
    ],
    "mechanism": {"blocks": [2, 3], "kind": "mixed"},
}


@pytest.fixture
def answers(tmp_path, monkeypatch):
    """answers(out, code, told): the program becomes one that says this; returns the file that has its arguments."""

    def make(out, code=0, told=""):
        program, asked = tmp_path / "rockdda", tmp_path / "asked"
        program.write_text(
            f"#!{sys.executable}\nimport json, pathlib, sys\n"
            f"files = [pathlib.Path(a).read_text() for a in sys.argv[2:3] if a[0] == '/']\n"
            f"pathlib.Path({str(asked)!r}).write_text(json.dumps([sys.argv[1:], files]))\n"
            f"sys.stderr.write({told!r}); sys.stdout.write({out!r}); sys.exit({code})\n"
        )
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv("ROCKDDA_PROGRAM", str(program))
        return asked

    return make


def arguments(asked):
    return json.loads(asked.read_text())[0]


def with_search(path):
    """A wall of four blocks with a search: two of them slide and topple."""
    write_wall(path, 2, 2)
    with h5py.File(path, "a") as file:
        group = file.create_group("search")
        group.attrs.update(search="strength", kind="mixed")
        for name in ("factor", "low", "high"):
            group[name] = np.array([ANSWER[name]])
        for name in ("value", "stable", "steps", "unbalanced", "displacement", "seconds"):
            kind = "i4" if name in ("stable", "steps") else "f8"
            group[name] = np.array([trial[name] for trial in ANSWER["trials"]], dtype=kind)
        group["blocks"], group["block_kind"] = np.array([2, 3], dtype="i4"), np.array([0, 1], dtype="i4")
    return path


def test_the_answer_is_read(answers):
    asked = answers(json.dumps(ANSWER))
    found = rockdda.factor_of_safety("slope.nml")
    assert arguments(asked) == ["fos", "slope.nml", "--search", "strength", "--json"]
    assert (found.value, found.low, found.high, float(found)) == (1.2075, 1.205, 1.21, 1.2075)
    assert [t.value for t in found.trials if not t.stable] == [2.0, 1.21]
    assert found.trials[1].steps == 90
    assert (found.mechanism.blocks, found.mechanism.kind) == ((2, 3), "mixed")
    assert str(found) == "factor of safety: 1.208 (stable at 1.205, fails at 1.21; 4 trials)"
    assert "<b>factor of safety: 1.208" in found._repr_html_()
    assert found._repr_html_().count("<tr>") == 5


def test_options_become_those_of_the_command(answers):
    asked = answers(json.dumps({**ANSWER, "search": "tilt", "factor": -24.5, "low": -24.55, "high": -24.45}))
    found = rockdda.factor_of_safety(
        "a.dc", "a.df", search="tilt", joints=["bedding", "fault"], from_=0, to=-45.0, tolerance=0.1, stage="weight",
        jobs=2, max_steps=900, config="a.nml", force=True,
    )  # fmt: skip
    expected = "fos a.dc a.df --config a.nml --search tilt --joints|bedding, fault --from 0 --to -45.0 --tolerance 0.1"
    expected += " --stage weight --jobs 2 --max-steps 900 --json --force"
    assert " ".join(arguments(asked)) == expected.replace("|", " ")
    assert arguments(asked)[arguments(asked).index("--joints") + 1] == "bedding, fault"
    # with a negative tilt the upper end of the bracket is the stable one
    assert str(found) == "critical tilt: -24.5° (stable at -24.45°, fails at -24.55°; 4 trials)"


def test_loads_and_design_factors(answers):
    load = {**ANSWER, "search": "load", "factor": 68.9, "low": 68.7, "high": 69.1, "loads": ["axle", "snow"]}
    load["joints"] = [{"name": "bed", "reduced": False, "length": 16.0, "open": 0.25}]
    asked = answers(json.dumps(load))
    found = rockdda.factor_of_safety("bridge.nml", search="load", loads=["axle", "snow"])
    assert arguments(asked)[:6] == ["fos", "bridge.nml", "--search", "load", "--loads", "axle, snow"]
    assert str(found) == "load factor: 68.9 (stable at 68.7, fails at 69.1; 4 trials)"
    assert (found.stands, found.joints[0].open) == (None, 0.25)
    # a design that does not stand is an answer, not an error
    asked = answers(json.dumps({**ANSWER, "factor": 0.959, "stands": False, "factors": ""}), 3)
    found = rockdda.factor_of_safety("slope.nml", factors={"friction": 1.25, "load.axle": 1.3})
    assert arguments(asked)[4:6] == ["--factors", "friction = 1.25, load.axle = 1.3"]
    assert (found.stands, str(found)) == (False, "stands with the factored values: no, reserve 0.959")
    none = {"blocks": [], "kind": None}
    answers(json.dumps({**ANSWER, "factor": None, "low": 64.0, "high": None, "stands": True, "mechanism": none}))
    found = rockdda.factor_of_safety("slope.nml", factors="ec7")
    assert (found.value, str(found)) == (math.inf, "stands with the factored values: yes, reserve above 64")


def test_a_model_is_written_and_searched(answers):
    asked = answers(json.dumps(ANSWER))
    rockdda.factor_of_safety(stack(2), search="tilt")
    command, (text,) = json.loads(asked.read_text())
    assert command[0] == "fos"
    assert command[1].endswith("stack_2.nml")
    assert "&stage" in text
    with pytest.raises(rockdda.InputError, match="brings its own analysis"):
        rockdda.factor_of_safety(stack(2), config="other.nml")


def test_errors_are_those_of_the_package(answers):
    def error(code, message, **place):
        messages = [{"severity": "error", "message": message, **place}]
        return json.dumps({"command": "fos", "status": "error", "exit_code": code, "messages": messages})

    answers(error(3, "not stable at 1: raise the friction, or begin the search below 1"), 3)
    with pytest.raises(rockdda.ConvergenceError, match=r"^not stable at 1: raise"):
        rockdda.factor_of_safety("slope.nml")
    answers(error(2, "there is no joint material 'rough'", file="slope.nml", line=3, column=2), 2)
    with pytest.raises(rockdda.InputError, match="no joint material 'rough'") as caught:
        rockdda.factor_of_safety("slope.nml", joints="rough")
    assert (caught.value.file, caught.value.line, caught.value.column) == ("slope.nml", 3, 2)
    answers(error(5, "no space left"), 5)
    with pytest.raises(rockdda.OutputError, match="no space left"):
        rockdda.factor_of_safety("slope.nml")
    answers("", 4)
    with pytest.raises(rockdda.RockddaError, match="was stopped"):
        rockdda.factor_of_safety("slope.nml")
    answers("", 1, "internal error: please report it")
    with pytest.raises(rockdda.RockddaError, match="please report it"):
        rockdda.factor_of_safety("slope.nml")
    with pytest.raises(rockdda.InputError, match="expected one of strength, tilt, push, gravity, load, found 'pull'"):
        rockdda.factor_of_safety("slope.nml", search="pull")


def test_warnings_of_the_program_are_warnings(answers):
    told = (
        "trial 1: 1.0 stable\nslope.nml:3:1: warning: the water wets nothing\n    &water\n    ^\n  0 %  1.5, step 3\n"
    )
    answers(json.dumps(ANSWER), told=told)
    with pytest.warns(rockdda.InputWarning, match="the water wets nothing") as caught:
        rockdda.factor_of_safety("slope.nml")
    assert caught[0].filename == __file__
    assert str(caught[0].message) == "slope.nml:3:1: warning: the water wets nothing\n    &water\n    ^"


def test_the_results_hold_the_search(answers, tmp_path):
    path = with_search(tmp_path / "failing.h5")
    answers(json.dumps(ANSWER))
    found = rockdda.factor_of_safety("slope.nml", output=path)
    assert found.results.path == path
    assert found.mechanism.kinds == ("sliding", "toppling")
    again = read_search(path)
    assert (again.value, again.low, again.high, again.search) == (1.2075, 1.205, 1.21, "strength")
    assert again.trials == found.trials
    assert again.mechanism == found.mechanism
    with pytest.raises(rockdda.InputError, match="holds no search"):
        read_search(write_wall(tmp_path / "wall.h5", 2, 2))


def test_the_picture_of_the_mechanism(tmp_path):
    from matplotlib.collections import PolyCollection
    from matplotlib.quiver import Quiver

    results = rockdda.open(with_search(tmp_path / "failing.h5"))
    axes = plot(results, kind="mechanism")
    (blocks,) = [artist for artist in axes.collections if type(artist) is PolyCollection]
    colours = [tuple(colour) for colour in blocks.get_facecolors()]
    assert len(set(colours)) == 3  # at rest, sliding, toppling
    assert colours[0] == colours[1]
    (arrows,) = [artist for artist in axes.collections if isinstance(artist, Quiver)]
    # of the two that move, from the settled state on: by frame 2 they have moved by 2 y/100, -2/50
    moved = np.array([[2 * 1.5 / 100, -0.04]] * 2)
    drawn = np.column_stack([arrows.U, arrows.V])
    assert np.allclose(drawn / np.hypot(*drawn[0]), moved / np.hypot(*moved[0]))
    assert np.hypot(*drawn[0]) == pytest.approx(0.1 * 2)  # a tenth of the model's extent
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["sliding (1)", "toppling (1)", "at rest (2)"]
    assert axes.get_title(loc="left") == "wall, factor of safety 1.208: mixed"
    assert save(axes, tmp_path / "mechanism.png").stat().st_size > 1000


def test_the_picture_of_the_search(answers, tmp_path):
    axes = plot(rockdda.open(with_search(tmp_path / "failing.h5")), kind="factor", units="m,s,N")
    stable, failing = (line for line in axes.lines if line.get_label() in ("stable", "fails"))
    assert stable.get_xdata().tolist() == [1.0, 1.205]
    assert failing.get_xdata().tolist() == [2.0, 1.21]
    assert failing.get_ydata().tolist() == [0.3, 0.2]
    assert axes.get_ylabel() == "largest displacement [m]"
    assert axes.get_xlabel() == "factor"
    # without results the search alone is drawn
    answers(json.dumps(ANSWER))
    found = rockdda.factor_of_safety("slope.nml")
    assert found.plot().get_xlabel() == "factor"
    with pytest.raises(rockdda.InputError, match="search with output="):
        found.plot("mechanism")
    with pytest.raises(rockdda.InputError, match="no picture 'pie'"):
        found.plot("pie")


def test_lengths_are_shown_in_other_units(tmp_path):
    results = rockdda.units.in_units(rockdda.open(with_search(tmp_path / "failing.h5")), "m,s,N", "mm,s,N")
    assert read_search(results).trials[1].displacement == pytest.approx(300.0)
