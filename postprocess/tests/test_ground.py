# SPDX-License-Identifier: MIT
"""Boundaries and stress in the ground in Python: options of a model, results, table, pictures, units."""

from __future__ import annotations

from pathlib import Path

import h5py
import matplotlib.collections
import numpy as np
import pytest
import rockdda
from rockdda import plot
from rockdda.analysis.compare import compare
from synthetic import write_wall


def column() -> rockdda.Model:
    """Two courses of 2 x 1 on rollers, with a pressure of 1000 on top: forces of 25,000 and more."""
    model = rockdda.Model("column", e0=0.001, k01=0.0, steps=30, dt_max=0.01, stiffness=1e9)
    model.add_polygon([(0, 0), (2, 0), (2, 2), (0, 2)])
    model.add_line((0, 1), (2, 1))
    model.add_block_material(density=1000, weight=10000, youngs_modulus=1e9, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=30)
    model.options = {
        "contact": {"formulation": "length"},
        "boundary": [
            {"along": [0, 2, 0, 0], "kind": "roller"},
            {"along": [0, 0, 2, 0], "kind": "fixed"},
            {"along": [(2, 0), (2, 2)], "kind": "roller"},
            {"along": [0, 2, 2, 2], "kind": "traction", "pressure": 1000.0, "table": [(0, 1), (1, 1)]},
        ],
        "in_situ": {"surface": 2.0, "k0": 0.5, "surcharge": 1000.0},
    }
    return model


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> rockdda.Results:
    return column().run(output=tmp_path_factory.mktemp("column") / "column.h5")


def test_forces_balance(results: rockdda.Results) -> None:
    force = results.boundary_force
    assert force.shape == (results.n_steps, 4, 2)
    assert results.boundary_kinds == ["roller", "fixed", "roller", "traction"]
    np.testing.assert_allclose(force[:, 1], np.tile([0, 42000.0], (len(force), 1)), atol=1e-6)
    # k0 times (surcharge plus half the depth) over the height
    np.testing.assert_allclose(force[:, 0, 0], 0.5 * (1000 + 10000) * 2, rtol=1e-9)
    table = results.history()
    assert table["boundary_force_4_y"].iloc[-1] == force[-1, 3, 1] == pytest.approx(-2000, rel=1e-9)


def test_edges_run_around_their_blocks(results: rockdda.Results) -> None:
    ends = results.vertices[results.boundary_ends]
    assert np.bincount(results.boundary_edges[:, 0]).tolist() == [2, 1, 2, 1]
    # the outline of the model, counter-clockwise, whatever block an edge is of
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), [1, 1, 2, 1, 1, 2])
    np.testing.assert_array_equal(ends[results.boundary_edges[:, 0] == 3][0], [[2, 2], [0, 2]])


def test_written_and_read_again_it_is_the_same_model(tmp_path: Path) -> None:
    model = column()
    paths = model.write(tmp_path)
    again = rockdda.Model.read(*paths)
    force = again.run(output=tmp_path / "again.h5").boundary_force
    np.testing.assert_array_equal(force, model.run(output=tmp_path / "first.h5").boundary_force)


@pytest.mark.parametrize(
    ("group", "entries", "problem"),
    [
        ("boundary", {"along": [0, 0, 1, 0], "kind": "rollers"}, "expected one of 'fixed', 'roller'"),
        ("boundary", {"along": [0, 0, 1], "kind": "roller"}, "expected a multiple of 2 numbers"),
        ("in_situ", {"surface": 1, "k": 1}, "unknown name; did you mean 'k0'"),
    ],
)
def test_mistakes_in_options(group: str, entries: dict[str, object], problem: str, tmp_path: Path) -> None:
    model = column()
    model.options[group] = entries
    with pytest.raises(rockdda.InputError, match=problem):
        model.write(tmp_path)


def test_pictures_show_each_kind(results: rockdda.Results) -> None:
    def lines(axes: object) -> list[matplotlib.collections.LineCollection]:
        return [item for item in axes.collections if isinstance(item, matplotlib.collections.LineCollection)]  # type: ignore[attr-defined]

    axes = plot.blocks(results, None)
    # edges and marks of fixed and traction, edges of rollers
    assert sorted(len(item.get_segments()) for item in lines(axes))[:2] == [1, 1]
    assert len(lines(axes)) == 5
    rollers = [line for line in axes.lines if line.get_marker() == "o"]
    assert len(rollers) == 1
    # they stand outside of both sides
    x = np.asarray(rollers[0].get_xdata())
    assert ((x < 0) | (x > 2)).all()
    assert (x < 0).sum() == (x > 2).sum()


def test_comparison_finds_another_force(results: rockdda.Results, tmp_path: Path) -> None:
    model = column()
    model.options["boundary"][3]["pressure"] = 1000.5
    other = model.run(output=tmp_path / "other.h5")
    found = compare(results, other)
    assert "history/boundary_force" in {difference.dataset for difference in found.differences}


def test_files_without_boundaries_stay_readable(tmp_path: Path) -> None:
    path = write_wall(tmp_path / "old.h5", 2, 2)
    with rockdda.open(path) as results:
        assert results.boundary_force.shape == (results.n_steps, 0, 2)
        assert results.boundary_kinds == []
        assert results.boundary_edges.shape == (0, 2)
        assert not [name for name in results.history().columns if name.startswith("boundary")]


@pytest.mark.parametrize("row", [[4, 0], [-1, 0], [0, 8]])
def test_damaged_edges_are_refused(results: rockdda.Results, row: list[int], tmp_path: Path) -> None:
    path = tmp_path / "damaged.h5"
    path.write_bytes(results.path.read_bytes())
    with h5py.File(path, "r+") as file:
        file["model/boundary_edges"][0] = row
    with pytest.raises(rockdda.InputError, match="boundary_edges holds an impossible number"):
        rockdda.open(path)
