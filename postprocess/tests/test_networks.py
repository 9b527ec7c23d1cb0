# SPDX-License-Identifier: MIT
"""Lines from statistics in Python: the same as those of the program."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rockdda

# dead ends of random joints are dropped with a warning
pytestmark = [pytest.mark.usefixtures("native"), pytest.mark.filterwarnings("ignore::rockdda.InputWarning")]

INPUTS = Path(__file__).resolve().parents[2] / "inputs/joint_networks"
LATTICE = {
    "boundary": {"window": [0, 0, 10, 6]},
    "joint_set": [{"inclination": 0, "spacing": 1}, {"inclination": 90, "spacing": 2}],
}


@pytest.mark.parametrize("name", ["tunnel", "slope", "survey"])
def test_same_file_as_the_program(program, tmp_path, name):
    command = [program, "lines", INPUTS / f"{name}.dl", "-o", tmp_path / "a.dc", "--seed", "5", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    network = rockdda.lines(INPUTS / f"{name}.dl", seed=5, output=tmp_path / "b.dc")
    assert (tmp_path / "a.dc").read_text() == (tmp_path / "b.dc").read_text()
    blocks = rockdda.cut(tmp_path / "a.dc")
    again = network.cut()
    assert np.array_equal(blocks.vertices, again.vertices)
    assert again.report is not None
    assert again.report.area_difference == pytest.approx(0, abs=1e-9)


@pytest.mark.filterwarnings("always::rockdda.InputWarning")
def test_one_warning_for_all_dead_ends():
    network = rockdda.lines(INPUTS / "survey.dl")
    with pytest.warns(rockdda.InputWarning) as caught:
        blocks = network.cut()
    assert blocks.report is not None
    assert blocks.report.dropped_lines > 10
    assert [
        str(warning.message).count(f"{blocks.report.dropped_lines} lines bound no block") for warning in caught
    ] == [1]
    assert sum("dropped" in problem.message for problem in blocks.messages) == blocks.report.dropped_lines


@pytest.mark.parametrize("name", ["tunnel", "slope", "survey"])
def test_the_points_of_the_shipped_networks_lie_in_rock(name):
    network = rockdda.lines(INPUTS / f"{name}.dl")
    assert len(network.cut().measured_points) == len(network.measured)


def test_lattice_from_a_mapping():
    network = rockdda.lines(LATTICE)
    assert network.n_boundary == 4
    assert len(network.lines) == 4 + 5 + 4
    assert network.rock_area == 60
    first, second = network.sets
    assert (first.lines, first.traces, first.spacing, first.spacing_deviation) == (7, 5, 1, 0)
    assert second.spacing == 2
    assert math.isnan(first.bridge)
    # 5 x 6 blocks of 2 x 1
    assert network.cut().areas == pytest.approx(np.full(30, 2.0), rel=1e-12)


def test_model_that_runs(tmp_path):
    network = rockdda.lines(LATTICE | {"fixed": {"points": [1, 0.5, 9, 0.5]}, "measured": {"points": [5, 5.5]}})
    model = network.model("lattice", steps=5, dt_max=0.001)
    model.add_block_material(density=2500, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25)
    model.add_joint_material(friction_angle=40)
    results = model.run(output=tmp_path / "lattice.h5")
    assert results.n_blocks == 30
    # it settles by less than free fall would in 5 ms
    assert 0 < -results["history/measured_displacement"][-1, 0, 1] <= 9.81 * 0.005**2


def test_errors_have_a_place(tmp_path):
    path = tmp_path / "bad.dl"
    path.write_text("&boundary window = 0,0,1,1 /\n&joint_set inclination = 0, spacing = 0 /\n")
    with pytest.raises(rockdda.InputError) as error:
        rockdda.lines(path)
    assert (error.value.file, error.value.line, error.value.column) == (str(path), 2, 39)
    with pytest.raises(rockdda.InputError, match="unknown name 'spaceing' in &joint_set; did you mean 'spacing'"):
        rockdda.lines({"boundary": {"window": [0, 0, 1, 1]}, "joint_set": {"inclination": 0, "spaceing": 1}})
    for seed in (-1, 1.5, 2**31):
        with pytest.raises(rockdda.InputError, match="seed"):
            rockdda.lines(LATTICE, seed=seed)
    with pytest.raises(rockdda.InputError, match="joint_set"):
        rockdda.lines({"joint_set": 3})
    with pytest.warns(rockdda.InputWarning, match="lies outside the rock"):
        rockdda.lines(LATTICE | {"line": {"ends": [20, 0, 30, 1]}})
