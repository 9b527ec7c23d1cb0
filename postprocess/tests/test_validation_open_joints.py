# SPDX-License-Identifier: MIT
"""Blocks made smaller, so that the joints between them are open."""

import numpy as np
import pytest
from rockdda import Model
from rockdda.errors import InputError
from rockdda_validation.open_joints import open_joints, shrunk


def test_edges_move_inwards_by_the_same_distance():
    # a corner in the middle of a straight edge, and a concave one
    corners = np.array([[0, 0], [2, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]], dtype=float)
    moved = [[0.1, 0.1], [2, 0.1], [3.9, 0.1], [3.9, 0.9], [0.9, 0.9], [0.9, 2.9], [0.1, 2.9]]
    np.testing.assert_allclose(shrunk(corners, 0.1), moved, rtol=0, atol=1e-14)
    # an edge that is not along an axis stays parallel, 0.1 from where it was
    triangle = np.array([[0, 0], [3, 0], [0, 4]], dtype=float)
    small = shrunk(triangle, 0.1)
    np.testing.assert_allclose((12 - 4 * small[1:, 0] - 3 * small[1:, 1]) / 5, 0.1, rtol=0, atol=1e-14)
    with pytest.raises(InputError, match="too short"):
        shrunk(triangle, 1.1)  # the circle inside has a radius of 1


def test_a_cut_model_gets_joints_as_wide_as_wanted(tmp_path):
    model = Model("pair")
    model.add_polygon([(0, 0), (2, 0), (2, 1), (0, 1)])
    model.add_line((1, 0), (1, 1))
    model.add_measured((0.5, 0.5))
    model.cut().write(tmp_path / "pair.txt")
    text = open_joints((tmp_path / "pair.txt").read_text(), 0.02, 0.25)
    (tmp_path / "pair.blk").write_text(text)
    corners = [
        tuple(float(word) for word in line.split()[:2]) for line in text.splitlines() if line.split()[2:] == ["1"]
    ]
    wanted = {(x, y) for x in (0.01, 0.99, 1.01, 1.99) for y in (0.01, 0.99)}
    np.testing.assert_allclose(sorted(corners), sorted(wanted), rtol=0, atol=1e-14)
    assert "0.5 0.75 " in text
