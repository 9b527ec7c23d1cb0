# SPDX-License-Identifier: MIT
"""When contacts close and open, by the options of their tolerances: a block of 1 m by 1 m falls 1 cm onto a base."""

import subprocess

import h5py
import numpy as np
import pytest

GRAVITY, STIFFNESS, STEP, HALF_HEIGHT, GAP = 10.0, 1e9, 0.001, 1.005, 0.01
GEOMETRY = """\
0.001   # e0
8 4
0
0 2 0 1 0
-2 -1 3 -1 1
3 -1 3 0 1
3 0 -2 0 1
-2 0 -2 -1 1
0 0.01 0 1.01 1
0 1.01 1 1.01 1
1 1.01 1 0.01 1
1 0.01 0 0.01 1
-1 -0.5 -1 -0.5
2 -0.5 2 -0.5
0.5 0.5
"""
ANALYSIS = f"""\
1 {{steps}} 1 1 0.05 {STEP}
{STIFFNESS}
0 0
2000 {2000 * GRAVITY} 1e12 0.2  0 0 0  0 0 0  0 0 0
30 0 0
"""


def fall(program, folder, contact: str, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """After each step: how far it has fallen, the number of closed contacts, the energy that springs have discarded."""
    (folder / "model.dc").write_text(GEOMETRY)
    (folder / "model.df").write_text(ANALYSIS.format(steps=steps))
    (folder / "model.nml").write_text(f"&contact {contact} /\n")
    command = [program, "run", folder, "-o", folder / "out.h5", "--force", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    with h5py.File(folder / "out.h5") as file:
        history = file["history"]
        column = list(history["energy"].attrs["columns"]).index("discarded")
        np.testing.assert_allclose(history["dt"], STEP)
        return (
            -history["measured_displacement"][:, 0, 1],
            history["contacts"][:, 1:].sum(axis=1),
            history["energy"][:, column],
        )


@pytest.mark.parametrize("formulation", ["vertex", "length"])
@pytest.mark.parametrize("tolerance", [None, 1e-3])
def test_a_contact_closes_beyond_its_tolerance(program, tmp_path, tolerance, formulation):
    """Until then the block falls freely, into the base. Two corners close, or both rows of the joint."""
    contact = f"formulation = '{formulation}'" + ("" if tolerance is None else f", close_tolerance = {tolerance}")
    fallen, closed, _ = fall(program, tmp_path, contact, 47)
    free = GRAVITY * (STEP * np.arange(1, 48)) ** 2 / 2
    before = free < GAP + (tolerance or 0) * HALF_HEIGHT
    assert before.sum() == (44 if tolerance is None else 46)
    np.testing.assert_allclose(fallen[before], free[before], rtol=1e-9)
    assert not closed[before].any()
    assert closed[~before][0] == 2
    assert fallen[~before][0] < free[~before][0]


@pytest.mark.parametrize("formulation", ["vertex", "length"])
def test_a_contact_that_closes_late_has_no_energy(program, tmp_path, formulation):
    """What it has closed without force stays free of force, and the block comes to rest at that depth at most."""
    contact = f"formulation = '{formulation}', close_tolerance = 1e-3"
    fallen, closed, discarded = fall(program, tmp_path, contact, 200)
    assert closed[46:49].min() == 2
    assert discarded.min() >= 0
    # the speed of 0.45 m/s is stopped within v sqrt(m/k), k = 1e9/2.375, beyond the tolerance and the steps of 0.5 mm
    assert fallen.max() < GAP + 1e-3 * HALF_HEIGHT + 2 * STEP * 0.46 + 0.46 * (2000 * 2.375 / STIFFNESS) ** 0.5


def test_a_contact_that_closes_late_with_the_preset_has_spurious_energy(program, tmp_path):
    """Half the stiffness times the squared depth in each spring, as discarded below zero in the ledger."""
    fallen, _, discarded = fall(program, tmp_path, "preset = 'dda_windows', close_tolerance = 1e-3", 47)
    assert discarded[45] == 0
    # the base has sunk by W/(2 · 100 k) = 0.5 micrometres on its two fixed points, as good as rigid otherwise
    depth = fallen[45] - GAP - 5 * 2000 * GRAVITY / (200 * STIFFNESS)
    assert discarded[46] == pytest.approx(-2 * STIFFNESS / 2 * depth**2, rel=1e-4)
