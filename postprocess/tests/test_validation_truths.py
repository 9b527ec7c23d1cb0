# SPDX-License-Identifier: MIT
"""The independent solutions that the validation compares with are right by themselves; no DDA here."""

import math

import numpy as np
import pytest
from rockdda.errors import RockddaError
from rockdda_validation import shaking_table
from rockdda_validation.bracket import Bracket, bracket, power_of_ten
from rockdda_validation.cases import closed_arch, closed_momentum, closed_rocking, closed_single_block, closed_toppling


def test_a_bracket_holds_the_limit():
    found = bracket(lambda x: x > 0.3, 0.0, 1.0, 0.01)
    assert found.fails <= 0.3 < found.stands and found.width <= 0.01
    falling = bracket(lambda x: x < 0.3, 1.0, 0.0, 0.01)
    assert falling.stands < 0.3 <= falling.fails
    for fails, stands in ((0.4, 1.0), (0.0, 0.2)):
        with pytest.raises(RockddaError, match="no limit between"):
            bracket(lambda x: x > 0.3, fails, stands, 0.01)
    assert str(Bracket(29.999, 29.9995)) == "29.99900 – 29.99950"
    assert [power_of_ten(x) for x in (1e9, 2e-5, 1e12)] == ["1e9", "2e-5", "1e12"]


def test_toppling_blocks_are_in_equilibrium():
    """Forces and moments on a block that topples, from the forces on its neighbours."""
    angle = closed_toppling.limit_angle()
    assert angle == pytest.approx(38.15, abs=0.005)
    tangent = math.tan(math.radians(angle))
    force, modes = closed_toppling.handed_on(angle)
    assert modes == ["slides"] * 3 + ["topples"] * 10 + [""] * 3
    above, below = closed_toppling.arms()
    for n in (5, 9, 11):  # moments about the lower corner
        weight, height = closed_toppling.WEIGHT[n], closed_toppling.HEIGHT[n]
        drive = force[n + 1] * above[n] + weight * math.sin(math.radians(30)) * height / 2
        hold = force[n] * below[n] + (weight * math.cos(math.radians(30)) / 2 + force[n + 1] * tangent) * 10.0
        assert drive == pytest.approx(hold)
    assert closed_toppling.limit_with_share(1.0, 3) == pytest.approx(angle)
    assert closed_toppling.limit_with_share(0.5, 3) > angle


def test_arches_of_many_voussoirs_tend_to_milankovitch():
    limit = closed_arch.smallest_thickness_of_arcs()
    assert limit == pytest.approx(0.1075, abs=5e-5)
    errors = [closed_arch.smallest_thickness(n) - limit for n in (20, 40, 80)]
    assert errors[0] < errors[1] < errors[2] < 0
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.3)  # the sagitta of a voussoir goes with 1/n²
    assert closed_arch.heyman() == pytest.approx(0.1060, abs=1e-4)


def test_rocking_blocks_swing_as_an_integration_says():
    for share in (0.3, 0.7):
        start = share * closed_rocking.SLENDERNESS
        tilt, spin, time, dt = start, 0.0, 0.0, 1e-4
        while tilt > 0:  # velocity Verlet
            spin -= 0.5 * dt * closed_rocking.RATE**2 * math.sin(closed_rocking.SLENDERNESS - tilt)
            tilt += dt * spin
            spin -= 0.5 * dt * closed_rocking.RATE**2 * math.sin(closed_rocking.SLENDERNESS - tilt)
            time += dt
        assert 4 * time == pytest.approx(closed_rocking.period(share), abs=4 * dt)
        assert closed_rocking.housner_period(share) == pytest.approx(closed_rocking.period(share), rel=0.003)


def test_a_block_on_springs_keeps_its_energy_between_impacts():
    tilt = closed_rocking.on_springs(0.5, 1e9, 0.5, 1e-5)
    assert closed_rocking.period(0.5) / 4 > 0.5  # no impact yet
    exact = 0.5 * closed_rocking.SLENDERNESS
    spin, dt = 0.0, 1e-4
    for _ in range(5000):
        spin -= dt * closed_rocking.RATE**2 * math.sin(closed_rocking.SLENDERNESS - exact)
        exact += dt * spin
    assert tilt[-1] == pytest.approx(exact, rel=2e-3)


def test_rigid_collisions_tend_to_the_closed_forms():
    assert closed_momentum.rigid(1e8, 2e-6, 0.0) == pytest.approx(1.0, abs=1e-3)
    assert closed_momentum.rigid(1e8, 2e-6, 0.2) == pytest.approx(closed_momentum.with_dashpot(0.2), rel=1e-3)


def test_second_moments_of_a_triangle_and_a_rectangle():
    assert closed_momentum.second_moments(np.array([[5.0, 1], [7, 1], [7, 5], [5, 5]])) == pytest.approx(
        (1 / 3, 4 / 3, 0)
    )
    triangle = np.array([[0.0, 0], [3, 0], [0, 2]])
    assert closed_momentum.second_moments(triangle) == pytest.approx((9 / 18, 4 / 18, -6 / 36))


@pytest.mark.parametrize(
    ("incline", "width", "expected"),
    [(20, 0.5, "stands"), (40, 1.0, "slides"), (25, 0.2, "topples"), (55, 0.5, "topples and slides")],
)
def test_modes_of_a_block_on_an_incline(incline, width, expected):
    pair = closed_single_block.accelerations(math.radians(incline), width, math.radians(30))
    assert closed_single_block.mode(*pair) == expected


def test_the_block_on_the_shaking_table_gives_back_its_friction():
    """The angle and the speed that a rigid block had are those that its displacement gives."""
    tests = np.array([1, 3])
    times, place = shaking_table.rigid_block(tests, shaking_table.coulomb(np.array([17.0, 15.5])), dt=1e-3)
    angle, speed = shaking_table.back_analysis(tests, place[-1], shaking_table.coulomb, 12.0, 24.0)
    assert angle == pytest.approx([17.0, 15.5], abs=12 / 1024)
    fastest = np.diff(place, axis=0).max(axis=0) / (times[1] - times[0])
    assert np.all((0.2 * fastest < speed) & (speed < fastest))
