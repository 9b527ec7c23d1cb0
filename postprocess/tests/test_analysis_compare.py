# SPDX-License-Identifier: MIT
"""Comparison of runs: the place where they part is found."""

import shutil
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
import rockdda
from rockdda.analysis.compare import compare
from synthetic import write_wall

INPUTS = Path(__file__).resolve().parents[2] / "inputs"


@pytest.fixture
def pair(tmp_path):
    """Two equal files: 5 × 4 squares, 6 frames."""
    first = write_wall(tmp_path / "a.h5", 5, 4, frames=6)
    second = tmp_path / "b.h5"
    shutil.copy(first, second)
    return first, second


def change(path, dataset, index, amount):
    with h5py.File(path, "a") as file:
        values = file[dataset][()]
        values[index] += amount
        file[dataset][...] = values


def differences(pair, tolerance=0.0):
    return compare(rockdda.open(pair[0]), rockdda.open(pair[1]), tolerance)


def test_equal_runs_are_equal(pair):
    found = differences(pair)
    assert found.same
    assert not found.differences
    assert len(found.compared) == 33
    with h5py.File(pair[1], "a") as file:
        file.attrs["created"] = "another day"
    assert differences(pair).same


def test_the_first_difference_is_found_to_the_last_bit(pair):
    change(pair[1], "frames/vertices", (4, 55, 1), 1e-3)  # later
    with h5py.File(pair[1], "a") as file:
        stress = file["frames/stress"]
        value = stress[2, 7, 1]
        stress[2, 7, 1] = np.nextafter(value, 0)
    found = differences(pair)
    assert not found.same
    assert [d.dataset for d in found.differences] == ["frames/stress", "frames/vertices"]
    first, second = found.differences
    assert (first.step, first.time, first.block, first.index) == (2, pytest.approx(0.2), 8, (7, 1))
    assert (first.first, first.second) == (value, np.nextafter(value, 0))
    assert first.message.startswith("step 2, time 0.2, block 8, array index [7, 1]: ")
    assert second.step == 4
    assert second.block == 14  # vertex 55 of squares
    assert second.largest == pytest.approx(1e-3)
    assert second.relative == pytest.approx(1e-3 / 5.2, rel=0.1)


def test_tolerance_is_relative_to_the_largest_value(pair):
    change(pair[1], "frames/stress", (5, 3, 0), 1e-6)
    largest = np.abs(rockdda.open(pair[0])["frames/stress"]).max()
    assert differences(pair, 1.01e-6 / largest).same
    assert not differences(pair, 0.99e-6 / largest).same


def test_states_and_counts_must_agree_whatever_the_tolerance(pair):
    change(pair[1], "frames/contact_state", 7, -1)  # contact 1 of frame 2
    change(pair[1], "history/open_close_iterations", 3, 1)
    found = differences(pair, 1.0)
    assert [d.dataset for d in found.differences] == ["frames/contact_state", "history/open_close_iterations"]
    assert found.differences[0].step == 2
    assert "block 1 against block 2: 1 and 0" in found.differences[0].message
    assert found.differences[1].step == 4


def test_runs_of_different_length(pair):
    with h5py.File(pair[1], "a") as file:
        for name in list(file["frames"]):
            table = file[f"frames/{name}"]
            table.resize(
                table.shape[0] - (3 if name.startswith("contact_") and name != "contact_offset" else 1), axis=0
            )
    found = differences(pair)
    assert [d.message for d in found.differences] == ["6 and 5 frames; what both have agrees"]


def test_other_blocks_cannot_be_compared_further(pair, tmp_path):
    other = write_wall(tmp_path / "c.h5", 3, 3)
    found = compare(rockdda.open(pair[0]), rockdda.open(other))
    assert found.differences[0].dataset == "model/vertex_offset"
    assert "shapes differ: (21,) and (10,)" in found.differences[0].message
    assert all(d.dataset.startswith("model/") for d in found.differences)


def test_numbers_that_are_not_finite_are_refused(pair):
    with h5py.File(pair[0], "a") as file:
        file["history/measured_rotation"][2] = np.nan
    with pytest.raises(rockdda.InputError, match="history/measured_rotation holds a number that is not finite"):
        differences(pair)


def test_runs_with_other_threads_are_the_same_and_with_other_steps_not(program, tmp_path):
    def run(name, *options):
        command = [program, "run", INPUTS / "incline", "-o", tmp_path / name, "--steps", "20", "--quiet", *options]
        subprocess.run(command, check=True, capture_output=True)
        return rockdda.open(tmp_path / name)

    first = run("one.h5", "--threads", "1")
    assert compare(first, run("two.h5", "--threads", "2")).same
    config = tmp_path / "half.nml"
    config.write_text("&time dt_max = 0.0025 /\n")
    found = compare(first, run("half.h5", "--config", str(config)))
    assert not found.same
    assert found.differences[0].step == 1
