# SPDX-License-Identifier: MIT
"""Water in models built in Python."""

import numpy as np
import pytest
import rockdda

pytestmark = pytest.mark.usefixtures("native")

WEIGHT, GRAVITY, DENSITY = 9810.0, 9.81, 2500.0


def block_on_a_base():
    """A block 1 x 1 on a base 3 x 1 that is held at its corners, static."""
    model = rockdda.Model("wet", e0=1e-3, k01=0.0, steps=100, dt_max=0.01, stiffness=1e10)
    model.add_polygon([(0, 0), (3, 0), (3, 1), (0, 1)])
    model.add_lines([[1, 1, 1, 2], [1, 2, 2, 2], [2, 2, 2, 1]])
    for point in ((0, 0), (3, 0), (3, 1), (0, 1)):
        model.add_fixed(point)
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=1e10, poisson_ratio=0.25)
    model.add_joint_material(friction_angle=30)
    return model


def carried(results):
    """What the supports carry, upwards."""
    return float(results["history/fixed_force"][-1][:, 1].sum())


def test_supports_carry_what_the_water_leaves(tmp_path):
    model = block_on_a_base()
    dry = DENSITY * GRAVITY * 4
    assert carried(model.run(output=tmp_path / "dry.h5")) == pytest.approx(dry, rel=1e-6)  # what is left of the motion
    model.options["water"] = {"name": "lake", "table": [0, 1.25], "unit_weight": WEIGHT}
    wet = model.run(output=tmp_path / "wet.h5")
    # the base, and a quarter of the block; the block sinks by micrometres
    assert carried(wet) == pytest.approx(dry - WEIGHT * 3.25, rel=1e-5)
    assert "model/water_edges" in wet


def test_a_pressure_file_beside_the_script(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    x, y = np.meshgrid(np.linspace(-1, 4, 6), np.linspace(-1, 3, 9))
    rows = np.column_stack([x.ravel(), y.ravel(), WEIGHT * (4 - y.ravel())])
    np.savetxt("p.csv", rows, delimiter=",", header="x,y,p", comments="")
    model = block_on_a_base()
    model.options["water"] = [{"pressure_file": "p.csv"}]
    assert carried(model.run(output="wet.h5")) == pytest.approx((DENSITY * GRAVITY - WEIGHT) * 4, rel=1e-6)


def test_an_unknown_joint_is_named(tmp_path):
    model = block_on_a_base()
    model.options["water"] = {"table": [0, 1], "unit_weight": WEIGHT, "joints": "bedding"}
    with pytest.raises(rockdda.InputError, match="there is no joint material 'bedding'"):
        model.run(output=tmp_path / "wet.h5")
