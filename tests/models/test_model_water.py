# SPDX-License-Identifier: MIT
"""Water against statics: Sau Mau Ping dry, half full and full, and a dam with uplift."""

import math

import numpy as np
import pytest
from model_runs import INPUTS, Run, run_program

PLANE, HEIGHT, COHESION = math.radians(35), 60.0, 100e3
CRACK = HEIGHT / math.tan(math.radians(50)) + 15.336
DEPTH = HEIGHT - CRACK * math.tan(PLANE)
LENGTH = CRACK / math.cos(PLANE)


@pytest.mark.parametrize(("name", "share"), [("dry", 0.0), ("half_full", 0.5), ("full", 1.0)])
def test_sau_mau_ping(program, tmp_path, near, name, share):
    results = tmp_path / "out.h5"
    outcome = run_program(program, ["run", str(INPUTS / "sau_mau_ping" / f"{name}.nml"), "-o", str(results)], tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    run = Run(results)
    block = int(np.argmin(run["model/block_area"]))
    weight = 26e3 * run["model/block_area"][block]
    uplift = 0.5 * 10e3 * share * DEPTH * LENGTH
    thrust = 0.5 * 10e3 * (share * DEPTH) ** 2
    force = np.zeros(2)
    for blocks, _, of_contact in run.contacts():
        force += of_contact * ((blocks[0] == block) - int(blocks[1] == block))
    normal = float(force @ [-math.sin(PLANE), math.cos(PLANE)])
    shear = float(force @ [math.cos(PLANE), math.sin(PLANE)])
    expected_normal = weight * math.cos(PLANE) - uplift - thrust * math.sin(PLANE)
    expected_shear = weight * math.sin(PLANE) + thrust * math.cos(PLANE)
    # the block has come down by some 0.1 mm of 14 m of water, and turned with its base
    near(f"sau_mau_ping {name}: N on the plane", normal, expected_normal, 3e-5)
    near(f"sau_mau_ping {name}: T on the plane", shear, expected_shear, 3e-5)
    factor = (COHESION * LENGTH + normal * math.tan(PLANE)) / shear
    expected = (COHESION * LENGTH + expected_normal * math.tan(PLANE)) / expected_shear
    near(f"sau_mau_ping {name}: factor of safety", factor, expected, 3e-5)
    if share in (0.0, 1.0):
        assert expected == pytest.approx({0.0: 1.584, 1.0: 1.199}[share], abs=5e-4)
    if share == 1.0:
        assert (uplift / 1e6, thrust / 1e6) == pytest.approx((5.617, 0.981), abs=1e-3)  # their third decimal
    assert run.relative_residual() < 1e-9


def test_dam_on_joints(run_model, near):
    """The base carries weight less uplift, and the thrust of the reservoir: F = (W - U) tan 45 / V."""
    run = run_model("dam_on_joints")
    dam = int(np.argmax(run["model/block_centroid"][:, 1]))
    weight = 24e3 * run["model/block_area"][dam]
    uplift, thrust = 0.5 * 9810 * 28 * 24, 0.5 * 9810 * 28**2
    force = np.zeros(2)
    for blocks, _, of_contact in run.contacts():
        force += of_contact * ((blocks[0] == dam) - int(blocks[1] == dam))
    # the dam has moved by some 0.5 mm, of which the water takes part, and heaves as much
    near("dam_on_joints: N on the base", float(force[1]), weight - uplift, 1e-4)
    near("dam_on_joints: T on the base", float(-force[0]), thrust, 1e-4)
    near("dam_on_joints: sliding factor", float(-force[1] / force[0]), (weight - uplift) / thrust, 1e-4)
    assert (weight - uplift) / thrust == pytest.approx(1.8577, abs=1e-4)
