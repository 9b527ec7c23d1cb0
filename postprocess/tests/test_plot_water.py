# SPDX-License-Identifier: MIT
"""Pictures of water: pressures along edges, tables that rise, and models without water."""

import matplotlib

matplotlib.use("Agg")

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
import rockdda
from matplotlib.collections import PolyCollection
from rockdda.cli import main
from rockdda.errors import InputError
from rockdda.plot.water_levels import water_table, wetted_stretches
from rockdda.units import in_units
from synthetic import write_wall

WEIGHT = 9810.0


def pressure_diagrams(results, frame=-1):
    return [(stretch.at, stretch.pressure, stretch.free) for stretch in wetted_stretches(results, frame)]


def add_water(path, *, points=False):
    """Water on the edges of block 0: below a joint, on the left a pool."""
    with h5py.File(path, "r+") as file:
        model = file["model"]
        model["water_edges"] = np.array([[0, 0, 1, 2], [0, 3, 0, 0]], dtype="i4")
        model["water_names"] = ["lake"]
        model["water_ends"] = np.array([[0.0, 0.5], [0.0, 1.0]])
        model["water_unit_weight"] = np.array([0.0 if points else WEIGHT])
        model["water_table"] = np.zeros((0, 2)) if points else np.array([[-1.0, 0.6], [1.0, 0.6]])
        model["water_table_group"] = np.zeros(0 if points else 2, dtype="i4")
        model["water_level_time"] = np.array([] if points else [0.0, 1e3])
        model["water_level_rise"] = np.array([] if points else [0.0, 1e3])
        model["water_level_group"] = np.zeros(0 if points else 2, dtype="i4")
        corners = np.array([[-5.0, -5.0], [5.0, -5.0], [0.0, 9.0]])
        model["water_points"] = corners if points else np.zeros((0, 2))
        model["water_pressure"] = WEIGHT * (1 - corners[:, 1]) if points else np.zeros(0)
        model["water_points_group"] = np.zeros(3 if points else 0, dtype="i4")
    return path


@pytest.fixture
def wet(tmp_path):
    yield rockdda.open(add_water(write_wall(tmp_path / "wet.h5", 2, 2)))
    plt.close("all")


def test_pressure_along_edges(wet):
    start = wet.frames[0]
    (below, joint, joint_is_free), (beside, pool, pool_is_free) = pressure_diagrams(wet, 0)
    assert (joint_is_free, pool_is_free) == (False, True)
    np.testing.assert_allclose(joint, WEIGHT * (0.6 - below[:, 1]))
    p, q = start.vertices[0], start.vertices[1]
    np.testing.assert_allclose(below[[0, -1]], [p, 0.5 * (p + q)])
    np.testing.assert_allclose(pool, WEIGHT * np.maximum(0, 0.6 - beside[:, 1]))
    assert (pool == 0).any()


def test_tables_rise_in_time(wet):
    np.testing.assert_allclose(water_table(wet, 0, 2.5)[:, 1], 3.1)


def test_pressures_at_points_are_linear_in_triangles(tmp_path):
    wet = rockdda.open(add_water(write_wall(tmp_path / "points.h5", 2, 2), points=True))
    for at, value, _ in pressure_diagrams(wet, 0):
        np.testing.assert_allclose(value, WEIGHT * (1 - at[:, 1]), rtol=1e-12)
    assert water_table(wet, 0, 0.0) is None


def test_bands_lie_outside_of_free_edges_and_inside_at_joints(wet):
    axes = wet.plot(kind="water", frame=0)
    bands = next(a for a in axes.collections if isinstance(a, PolyCollection) and len(a.get_paths()) == 2)
    joint, pool = (path.vertices for path in bands.get_paths())
    v = wet.frames[0].vertices
    assert joint[:, 1].max() > v[0, 1] + 1e-3
    assert joint[:, 1].min() >= v[0, 1] - 1e-12
    assert pool[:, 0].min() < v[0, 0] - 1e-3
    assert pool[:, 0].max() <= v[0, 0] + 1e-12
    assert "largest" in axes.get_legend().get_texts()[1].get_text()


def test_stages_choose_groups(tmp_path):
    path = add_water(write_wall(tmp_path / "stages.h5", 2, 2))
    with h5py.File(path, "r+") as file:
        file["model/water_stage"] = ["none", " Lake "]
        if "history/stage" in file:
            del file["history/stage"]
        file["history/stage"] = np.array([0, 1], dtype="i4")
    results = rockdda.open(path)
    assert [len(pressure_diagrams(results, frame)) for frame in range(3)] == [0, 0, 2]
    plt.close(results.plot(kind="water", frame=0).get_figure())


def test_in_other_units(wet):
    shown = in_units(wet, "m,s,N", "mm,s,kN")
    for (_, plain, _), (_, other, _) in zip(pressure_diagrams(wet, 0), pressure_diagrams(shown, 0), strict=True):
        np.testing.assert_allclose(other, 1e-3 / 1e6 * plain, rtol=1e-9)


def test_a_model_without_water_says_so(tmp_path, capsys):
    path = write_wall(tmp_path / "dry.h5", 2, 2)
    with pytest.raises(InputError, match=r"has no water \(&water\)"):
        rockdda.open(path).plot(kind="water")
    add_water(path)
    assert main(["plot", str(path), "--kind", "water", "-o", str(tmp_path / "w.png")]) == 0
    assert (tmp_path / "w.png").stat().st_size > 5000
