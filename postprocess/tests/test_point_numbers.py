# SPDX-License-Identifier: MIT
"""Measured points keep the numbers of the input when one before them lies in no block and is ignored."""

import json
import subprocess

import h5py
import matplotlib as mpl
import numpy as np
import pytest
import rockdda
from rockdda.plot import input_plot

mpl.use("Agg")

# two squares, one on the other; the second of three measured points lies outside
GEOMETRY = """0.01
5 0
0
0
1
0
3
0
0 0 1 0 1
1 0 1 2 1
1 2 0 2 1
0 2 0 0 1
0 1 1 1 1
0.5 0.5 0.5 0.5
0.25 0.5
9 9
0.25 1.5
"""
ANALYSIS = """0 4 1 1 0.01 0.001
1e8
0
1000 10000 1e9 0.2  0 0 0  0 0 0  0 0 0
30 0 0
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "two.dc").write_text(GEOMETRY)
    (tmp_path / "two.df").write_text(ANALYSIS)
    return tmp_path


def run(program, folder, *arguments):
    command = [program, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done


def check_results(path):
    with h5py.File(path) as file:
        assert file["model/measured_points"].attrs["number"].tolist() == [1, 3]
        assert "number" not in file["model/fixed_points"].attrs
    with rockdda.open(path) as results:
        assert results.point_numbers("measured").tolist() == [1, 3]
        assert results.point_numbers("fixed").tolist() == [1]
        table = results.history()
        names = [name for name in table.columns if name.startswith("measured_rotation")]
        assert names == ["measured_rotation_1", "measured_rotation_3"]
        last = table["measured_displacement_3_y"].to_numpy()
        assert np.array_equal(last, results["history/measured_displacement"][:, 1, 1])
        labels = results.plot(kind="history").get_legend_handles_labels()[1]
        assert labels[-1] == "displacement y, point 3"


def test_from_geometry_to_labels(program, folder):
    done = run(program, folder, "run", "two.dc", "two.df")
    assert "measured point 2 at (9, 9) lies in no block: ignored" in done.stderr
    check_results(folder / "two.h5")
    assert "measured point numbers  1, 3" in run(program, folder, "info", "two.h5").stdout


def test_through_a_block_file(program, folder):
    run(program, folder, "cut", "two.dc")
    assert "\n0.25 0.5 1\n0.25 1.5 2 3\n" in (folder / "two.blk").read_text()
    done = run(program, folder, "info", "two.blk", "--json")
    assert json.loads(done.stdout)["files"][0]["measured_point_numbers"] == "1, 3"
    run(program, folder, "run", "two.blk", "two.df")
    check_results(folder / "two.h5")


def test_after_a_restart(program, folder):
    run(program, folder, "run", "two.dc", "two.df", "--steps", "2")
    run(program, folder, "resume", "two.ckpt.h5", "--steps", "2")
    check_results(folder / "two.h5")


def test_files_without_numbers_count_from_1(program, folder):
    run(program, folder, "run", "two.dc", "two.df")
    with h5py.File(folder / "two.h5", "r+") as file:
        del file["model/measured_points"].attrs["number"]
    with rockdda.open(folder / "two.h5") as results:
        assert results.point_numbers("measured").tolist() == [1, 2]
        assert "measured_rotation_2" in results.history()
    assert "numbers" not in run(program, folder, "info", "two.h5").stdout


def test_numbers_that_do_not_increase_are_refused(program, folder):
    run(program, folder, "run", "two.dc", "two.df")
    with h5py.File(folder / "two.h5", "r+") as file:
        file["model/measured_points"].attrs["number"] = np.array([3, 1], dtype="i4")
    words = "model/measured_points@number holds an impossible number"
    with pytest.raises(rockdda.InputError, match=words):
        rockdda.open(folder / "two.h5")
    done = subprocess.run([program, "info", "two.h5"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert (done.returncode, words in done.stderr) == (2, True)


@pytest.mark.usefixtures("native")
def test_pictures_of_blocks(folder):
    with pytest.warns(rockdda.InputWarning, match="measured point 2"):
        blocks = rockdda.cut(folder / "two.dc")
    assert blocks.measured_points.number.tolist() == [1, 3]
    blocks.write(folder / "two.blk")
    axes = input_plot(folder / "two.blk")
    assert [text.get_text() for text in axes.texts][-2:] == ["1", "3"]
