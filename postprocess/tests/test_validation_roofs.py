# SPDX-License-Identifier: MIT
"""Roofs between abutments: their geometry, and when they count as stable."""

import numpy as np
import pytest
from rockdda.errors import InputError
from rockdda_validation.roofs import Roof, bisect, joint_positions, judge


@pytest.mark.parametrize(("blocks", "top", "total"), [(6, 0, 67), (9, 11, 98), (16, 18, 168)])
def test_ten_layers_in_bond_have_the_published_numbers_of_blocks(blocks, top, total):
    roof = Roof(8.0, 0.5, blocks, layers=10, top=top)
    cut = roof.model([(0.01, 0.0)]).cut()
    assert len(cut.areas) == total
    # layers 8 m × 5 m, abutments 1 m × 6 m each
    assert cut.areas.sum() == pytest.approx(8 * 5 + 2 * 6, rel=1e-12)
    assert set(cut.material.tolist()) == {1, 2}
    assert (cut.material == 2).sum() == 2


def test_joints_are_symmetric_and_in_bond():
    assert joint_positions(8.0, 4, False) == pytest.approx([-2, 0, 2])
    assert joint_positions(8.0, 4, True) == pytest.approx([-3, -1, 1, 3])
    roof = Roof(8.0, 0.5, 4, layers=2, bond=False)
    assert roof.joints(1) == pytest.approx(roof.joints(0))


def test_a_shifted_roof_has_the_same_blocks():
    here, there = Roof(8.0, 0.5, 6), Roof(8.0, 0.5, 6, origin=(0.3, 0.1))
    shifted = there.model([]).cut().vertices - [0.3, 0.1]
    assert shifted == pytest.approx(here.model([]).cut().vertices, abs=1e-12)


def test_verdicts():
    time = np.linspace(0, 2, 8001)
    ringing = 0.02 + 0.015 * np.cos(2 * np.pi * time / 0.23)
    cases = {
        "stable": ringing,
        "more than t/2": ringing + 0.25,
        "still sinking": ringing + 0.1 * time,  # creeps by 40 mm in the last fifth, swings by 30 mm
        "velocity has a trend": np.where(time > 1.6, 0.2 * (time - 1.6) * (time - 2.0), 0) + 1e-3,
    }
    for reason, deflection in cases.items():
        verdict = judge(time, deflection, 0.5, 2.0)
        assert verdict.reason == reason
        assert verdict.stable == (reason == "stable")
    assert not judge(time[:4000], ringing[:4000], 0.5, 2.0).stable


def test_bisection_brackets_the_threshold():
    low, high = bisect(lambda x: x >= np.pi, 0.0, 10.0, 0.01)
    assert low < np.pi <= high
    assert high - low <= 0.01
    with pytest.raises(InputError, match="low < high"):
        bisect(lambda x: True, 2.0, 1.0, 0.1)
