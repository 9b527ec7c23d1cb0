# SPDX-License-Identifier: MIT
"""The two criteria of stable arching on motions whose answer is known."""

import math

import numpy as np
import pytest
from rockdda.analysis.loosening import height_label, loosening
from rockdda.errors import InputError

HEIGHTS = [0.0, 4.5, 8.5, 13.5]
TIME = np.linspace(0.0004, 1.0, 2500)


def held(period=0.27, mean=-0.03, phase=0.0):
    """An oscillation about a constant."""
    return mean * (1 - np.cos(2 * np.pi * TIME / period + phase))


def falling(start=0.2, gravity=9.81):
    """Free fall from a moment on."""
    return -0.5 * gravity * np.maximum(TIME - start, 0) ** 2


def test_rock_that_oscillates_together_is_stable():
    found = loosening(TIME, np.stack([held()] * 4, axis=1), HEIGHTS)
    assert found.equilibrium.all()
    assert found.homogeneous.all()
    assert found.height == 0


def test_falling_crown_is_found_by_both_criteria():
    found = loosening(TIME, np.stack([falling(), held(), held(), held()], axis=1), HEIGHTS)
    assert found.equilibrium.tolist() == [False, True, True, True]
    assert found.height_by_equilibrium == 4.5
    # at the end the crown has fallen 9.81 * 0.8**2 / 2 m, the others 0.03 (1 - cos(2 pi / 0.27)) m
    expected = (held()[-1] - falling()[-1]) / 4.5
    assert found.gradient[0] == pytest.approx(expected)
    assert found.gradient[1:] == pytest.approx(0)
    assert found.height_by_profile == 4.5
    assert found.height == 4.5


def test_criteria_see_different_things():
    # a crown that has sunk 0.1 m and rests there: only the profile tells
    rests = held() - 0.1
    found = loosening(TIME, np.stack([rests, held(), held(), held()], axis=1), HEIGHTS)
    assert (found.height_by_equilibrium, found.height_by_profile) == (0, 4.5)
    # everything sinks together: only the trend tells
    sinks = held() - 0.5 * TIME
    found = loosening(TIME, np.stack([sinks] * 4, axis=1), HEIGHTS)
    assert (found.height_by_equilibrium, found.height_by_profile) == (math.inf, 0)
    assert found.height == math.inf


def test_loosening_reaches_to_the_highest_pair():
    # the middle pair opens: what hangs below it is loose, too, although it moves as one
    found = loosening(TIME, np.stack([held() - 0.1, held() - 0.1, held(), held()], axis=1), HEIGHTS)
    assert found.homogeneous.tolist() == [True, False, True]
    assert found.height == 8.5


def test_drift_of_a_straight_line_and_range_of_a_sine():
    # the window is the last half: a line of slope -0.2 drifts by -0.1, a sine has twice its amplitude
    columns = np.stack([-0.2 * TIME, 0.01 * np.cos(8 * np.pi * TIME)], axis=1)
    found = loosening(TIME, columns, [0, 1], window=0.5)
    assert found.drift[0] == pytest.approx(-0.1)
    assert found.oscillation[0] == pytest.approx(0, abs=1e-12)
    assert found.drift[1] == pytest.approx(0, abs=1e-6)  # even about the window's middle
    assert found.oscillation[1] == pytest.approx(0.02, rel=1e-4)


@pytest.mark.parametrize("periods", [1.0, 1.3, 1.7, 2.4, 6.0])
def test_one_period_in_the_window_suffices(periods):
    for phase in np.linspace(0, 2 * np.pi, 37):
        column = np.sin(2 * np.pi * periods * TIME / 0.5 + phase)
        found = loosening(TIME, np.stack([column, column], axis=1), [0, 1], window=0.5)
        # at exactly one period and the worst phase drift and oscillation are equal
        assert (np.abs(found.drift) <= found.oscillation * (1 + 1e-3)).all()


def test_order_of_points_and_length_of_steps_do_not_matter():
    columns = np.stack([falling(), held(), held(phase=0.3), held(phase=0.6)], axis=1)
    plain = loosening(TIME, columns, HEIGHTS)
    turned = loosening(TIME, columns[:, ::-1], [h + 100 for h in HEIGHTS[::-1]])
    assert np.array_equal(turned.heights, plain.heights)
    assert np.array_equal(turned.displacement, plain.displacement)
    assert np.array_equal(turned.equilibrium, plain.equilibrium)
    # every second step of the first third left out: the window begins where it did
    keep = np.r_[0:800:2, 800:2500]
    assert np.allclose(loosening(TIME[keep], columns[keep], HEIGHTS).drift, plain.drift, rtol=1e-9)


def test_labels():
    assert [height_label(h, 10) for h in (0, 4.5, 8.5, math.inf)] == ["Stable", "< 0.45", "< 0.85", "> all"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((TIME, np.zeros((2500, 3)), HEIGHTS), "shapes"),
        ((TIME[:2], np.zeros((2, 4)), HEIGHTS), "at least"),
        ((TIME[::-1], np.zeros((2500, 4)), HEIGHTS), "increase"),
        ((TIME, np.full((2500, 4), np.nan), HEIGHTS), "finite"),
        ((TIME, np.zeros((2500, 4)), [0, 1, 1, 2]), "same height"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        loosening(*arguments)


def test_bad_limits_are_refused():
    columns = np.zeros((2500, 4))
    with pytest.raises(InputError, match="window"):
        loosening(TIME, columns, HEIGHTS, window=0)
    with pytest.raises(InputError, match="gradient_limit"):
        loosening(TIME, columns, HEIGHTS, gradient_limit=0)


def test_a_history_shorter_than_the_window_is_refused():
    columns = np.stack([held()] * 4, axis=1)
    assert loosening(TIME, columns, HEIGHTS, planned_time=1.0).height == 0
    # 1,500 steps that were cut again and again: 0.018 of 0.75
    few = np.linspace(0.018 / 1500, 0.018, 1500)
    with pytest.raises(InputError, match=r"covers a time of 0\.018, the window is 0\.667 of the planned 0\.75"):
        loosening(few, columns[:1500], HEIGHTS, planned_time=0.75)
    # just long enough
    assert loosening(TIME, columns, HEIGHTS, planned_time=1.49).height == 0
    with pytest.raises(InputError, match="too short"):
        loosening(TIME, columns, HEIGHTS, planned_time=1.51)
    # the first half of the run is missing
    with pytest.raises(InputError, match="too short"):
        loosening(TIME[1250:], columns[1250:], HEIGHTS)
