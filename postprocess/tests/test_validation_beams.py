# SPDX-License-Identifier: MIT
"""The truths of chapter 5 against closed forms of their own."""

import math

import numpy as np
import pytest
from rockdda_validation.block_row import GRAVITY, OPEN, BlockRow
from rockdda_validation.cases.ch5_3_1_two_block_arch import MODULUS, HalfArch, linear_deflection
from rockdda_validation.vibration import block_mass, damped, modes, steps_to_rest, undamped


@pytest.fixture(scope="module")
def row():
    return BlockRow()


def test_mass_is_that_of_a_grid_of_points():
    n, density, width, height = 400, 3.0, 0.8, 0.5
    x, y = np.meshgrid(((np.arange(n) + 0.5) / n - 0.5) * width, ((np.arange(n) + 0.5) / n - 0.5) * height)
    one, nothing = np.ones_like(x), np.zeros_like(x)
    move = np.array([[one, nothing, -y, x, nothing, y / 2], [nothing, one, x, nothing, y, x / 2]])
    expected = density * width * height / n**2 * np.einsum("iaxy,ibxy->ab", move, move)
    assert block_mass(density, width, height) == pytest.approx(expected, rel=1e-5, abs=1e-12)


def test_thrust_without_gravity_is_the_given_one(row):
    state = row.path(row.push_for(100.0), 0)[-1]
    assert row.thrust(state) == pytest.approx(100, rel=1e-9)
    assert row.stresses(state)[:, 0] == pytest.approx(-100 / row.size, rel=1e-9)


def test_a_row_whose_joints_have_opened_is_a_three_hinged_arch(row):
    state = row.path(row.push_for(row.weight / row.friction), 12)[-1]
    assert (state.contact == OPEN).sum() == 3
    assert row.thrust(state) == pytest.approx(12 * row.weight * 2 * row.half / (8 * row.size), rel=1e-9)
    # mean shear stress of a block: vertical force through its middle over its height
    shear = 12 * row.density * GRAVITY * row.size * np.array([-2.5, -1.5, -0.5, 0.5, 1.5, 2.5])
    assert row.stresses(state)[:, 2] == pytest.approx(shear, rel=1e-9)
    assert (np.abs(state.shear) <= row.friction * state.normal * (1 + 1e-12)).all()


def test_damping_of_a_row_in_motion_leaves_it_at_rest_in_equilibrium(row):
    push = row.push_for(3 * row.weight / row.friction)  # nothing slides: the way to rest does not matter
    at_rest = row.path(push, 1)[-1]
    damped_out = row.motion(push, 200, 240, 1, 5e-4)[-1]
    assert row.points(damped_out) == pytest.approx(row.points(at_rest), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("steps", [2, 5])
def test_a_row_with_closed_joints_swings_as_its_modes_do(row, steps):
    before, swung = row.motion(row.push_for(3 * row.weight / row.friction), 200, steps, 1, 5e-4)
    frequencies, shapes = modes(row.bonded(), row.mass)
    rest = np.linalg.solve(row.bonded(), row.load(1.0, 0.0))
    down = row.displacement(*row.measured()[5])[1]
    parts = -(down @ shapes) * (shapes.T @ row.mass @ rest)
    expected = down @ rest + damped(frequencies, parts, 1.0, steps, 5e-4)[-1]
    assert (row.points(swung) - row.points(before))[5, 1] == pytest.approx(expected, rel=1e-6)


def test_an_oscillator_is_damped_as_the_eigenvalues_say():
    omega, step, k01 = np.array([2.0]), 0.1, 0.97
    matrix = np.array([[2, 2 * k01], [-2 * 0.04, (2 - 0.04) * k01]]) / 2.04
    values = [(np.linalg.matrix_power(matrix, n) @ [1.0, 0.0])[0] for n in (1, 7, 50)]
    assert damped(omega, np.ones(1), k01, 50, step)[[0, 6, 49]] == pytest.approx(values, rel=1e-12)
    assert undamped(omega, np.ones(1), np.array([math.pi / 2])) == pytest.approx(-1)


def test_modes_of_two_masses():
    stiffness, mass = np.array([[2.0, -1.0], [-1.0, 2.0]]), np.diag([4.0, 4.0])
    frequencies, shapes = modes(stiffness, mass)
    assert frequencies == pytest.approx([0.5, math.sqrt(3) / 2])
    assert shapes.T @ mass @ shapes == pytest.approx(np.eye(2))


def test_steps_to_rest_counts_from_one():
    assert steps_to_rest(np.array([3.0, -2.0, 0.5, 1.5, 0.5, 0.1]), 1.0) == 5
    assert steps_to_rest(np.zeros(3), 1.0) == 1


def test_small_deflections_of_the_arch_are_the_closed_form():
    arch = HalfArch(1e15, 1e4 * MODULUS)  # so stiff that motions are small
    assert -arch.equilibrium()[1].crown[1] == pytest.approx(linear_deflection(1e4 * MODULUS, 1e15), rel=1e-5)
