# SPDX-License-Identifier: MIT
"""Pictures of a consultant's report: contours, trajectories, the line of thrust, joints along a line; splinters."""

import subprocess

import matplotlib as mpl
import numpy as np
import pytest
import rockdda
from places import INPUTS
from rockdda import plot
from rockdda.plot.joint_maps import _resultants
from rockdda.plot.stress_maps import _Grid, corner_values
from rockdda.plot.style import usual_view
from synthetic import write_wall

mpl.use("Agg")


@pytest.fixture(scope="module")
def arch(program, tmp_path_factory):
    """The flat arch, whose thrust its README knows."""
    path = tmp_path_factory.mktemp("arch") / "arch.h5"
    subprocess.run([program, "run", INPUTS / "flat_arch", "-o", path, "--quiet"], check=True, capture_output=True)
    return rockdda.open(path)


@pytest.fixture
def wall(tmp_path):
    return rockdda.open(write_wall(tmp_path / "wall.h5", 5, 4))


def test_corners_have_the_mean_of_the_blocks_that_touch_there(wall):
    now = wall.frames[0]
    numbers = np.arange(wall.n_blocks, dtype=float)
    found = corner_values(now, numbers)
    areas, corners = wall.block_area, now.shown_vertices
    shared = 0
    for corner, value in zip(corners, found, strict=True):
        # blocks are rectangles in the first frame
        touching = [
            i for i, polygon in enumerate(now.polygons())
            if (polygon.min(axis=0) <= corner + 1e-9).all() and (polygon.max(axis=0) >= corner - 1e-9).all()
        ]  # fmt: skip
        shared += len(touching) > 1
        assert value == pytest.approx(np.average(numbers[touching], weights=areas[touching]))
    assert shared > 20


def test_contours_refuse_what_has_none(wall):
    with pytest.raises(rockdda.InputError, match="the field 'material' has no contours"):
        plot.contours(wall, "material")


def test_stress_between_equal_blocks_is_theirs(wall, monkeypatch):
    now = wall.frames[0]
    monkeypatch.setattr(type(now), "stress", np.tile([-1.0, -3.0, 0.5], (wall.n_blocks, 1)))
    grid = _Grid(now)
    assert grid.at(now.centroid[7]) == pytest.approx([-1.0, -3.0, 0.5])
    assert grid.at(np.array([-50.0, 0.0])) is None


def test_thrust_of_the_flat_arch(arch):
    pair, force, where = _resultants(arch, -1)
    assert len(pair) == 8
    supports = arch.history().iloc[-1][[f"fixed_force_{i}_x" for i in (1, 2, 3)]].sum()
    assert np.abs(force[:, 0]) == pytest.approx(abs(supports), rel=1e-6)  # the thrust is the same in all joints
    # it rises from the springings to the keystone
    order = np.argsort(where[:, 0])
    rise = where[order, 1]
    assert rise[0] < rise[1] < rise[3] and rise[4] > rise[6] > rise[7]
    axes = plot.thrust(arch, units="SI")
    assert "kN" in [text.get_text() for text in axes.texts][-1]


def test_stresses_along_a_chosen_joint(arch):
    points = arch.joints()
    one = points[points["joint"] == 3]
    line = (*one[["x1", "y1"]].iloc[0], *one[["x2", "y2"]].iloc[-1])
    data = plot.joint_profile_data(arch, line)
    order = np.argsort(data["distance"])
    assert sorted(data["normal_stress"]) == sorted(one["normal_stress"])
    assert (order == np.arange(len(one))).all()
    assert data["strength"] == pytest.approx(np.abs(one["shear_stress"] / one["mobilised"]), nan_ok=True)
    assert len(plot.joint_profile(arch, line, units="SI")) == 2
    with pytest.raises(rockdda.InputError, match="no joint runs along this line"):
        plot.joint_profile_data(arch, (line[0], line[1] + 100, line[2], line[3] + 100))
    with pytest.raises(rockdda.InputError, match="needs the line"):
        plot.joint_profile(arch)


def test_a_splinter_does_not_take_the_picture():
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    start = np.concatenate([square * 10, square * 0.1 + 10])
    offset, areas = np.array([0, 4, 8]), np.array([100.0, 0.01])
    away = start + np.repeat([[0.0, 0], [500, -300]], 4, axis=0)
    low, high = usual_view(start, away, offset, areas)
    assert (low.tolist(), high.tolist()) == ([0, 0], [10.1, 10.1])
    near = start + np.repeat([[0.0, 0], [5, 0]], 4, axis=0)
    assert usual_view(start, near, offset, areas)[1] == pytest.approx([15.1, 10.1])


def test_the_picture_says_how_many_blocks_are_beyond(tmp_path):
    import h5py

    path = write_wall(tmp_path / "wall.h5", 10, 10)
    with h5py.File(path, "r+") as file:
        first = file["frames/vertices"][-1]
        end = int(file["model/vertex_offset"][1]) if "model/vertex_offset" in file else 4
        first[:end] += [1000.0, 0.0]
        file["frames/vertices"][-1] = first
    axes = plot.blocks(rockdda.open(path))
    assert "1 block beyond the picture" in [text.get_text() for text in axes.texts]
    assert axes.get_xlim()[1] < 100
