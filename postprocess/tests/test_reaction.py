# SPDX-License-Identifier: MIT
"""Ground reaction and support characteristic: a round hole in continuous ground against its closed form; refusals."""

import json
import math

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
from rockdda import InputError, Model
from rockdda.analysis.reaction import support_reaction
from rockdda.cli import main

RADIUS, PRESSURE, YOUNG, POISSON = 5.0, 10e6, 1e10, 0.25


def around(radius, n):
    angle = 2 * np.pi * np.arange(n + 1) / n
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def hole(n=48, rings=12):
    """A hole in tied cells under even pressure, lined at half the release; the edge of the ground is 20 radii away."""
    radii = RADIUS * 20 ** (np.arange(rings + 1) / rings)
    model = Model("hole", labelled=True, units="SI", e0=1e-3)
    for k in range(rings + 1):
        corners = around(radii[k], n)
        model.add_lines(np.hstack([corners[:-1], corners[1:]]), boundary=k == rings)
        if k:
            model.add_lines(np.hstack([around(radii[k - 1], n)[:-1], corners[:-1]]))
    model.add_block_material(density=2500, young=YOUNG, poisson=POISSON)
    model.add_joint_material(tie=True, friction=0)
    model.add_measured((0.01, 1.001 * RADIUS))
    model.add_boundary(around(radii[-1], n), "fixed")
    model.add_region("hole", circle=(0, 0, RADIUS))
    model.add_in_situ(stress=(-PRESSURE, -PRESSURE, 0))
    model.add_liner(around(RADIUS, 480), name="Shell", thickness=0.3, young=30e9, poisson=0.2)
    model.add_liner(on="shell", name="later", thickness=0.1, young=30e9)
    model.add_stage("dig", until="equilibrium", excavate="hole", relax=0.5)
    model.add_stage("line", until="equilibrium", install="shell", relax=1)
    model.add_stage("then", until="equilibrium", install="later")
    model.add_change("then", liner="shell", young=30e9)
    return model


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    yield support_reaction(hole(), releases=4, work=tmp_path_factory.mktemp("runs"))
    plt.close("all")


def test_a_round_hole_follows_the_closed_form(found):
    # a thin ring with full bond: Einstein and Schwartz (1979), even pressure; tolerances are those of 48 cells around
    way = (1 + POISSON) / YOUNG * PRESSURE * RADIUS
    assert found.radius == pytest.approx(RADIUS, rel=2e-3)
    assert found.ground_pressure == pytest.approx(PRESSURE, rel=1e-9)
    np.testing.assert_allclose(found.ground[:, 1], [1, 0.75, 0.5, 0.25, 0], atol=1e-12)
    np.testing.assert_allclose(found.ground[:, 0], way * (1 - found.ground[:, 1]), rtol=0.04)
    share = 0.5 / (1 + RADIUS * (1 - 0.2**2) / (30e9 * 0.3) * YOUNG / (1 + POISSON))
    assert found.support[0] == pytest.approx((way / 2, 0), rel=0.04)
    assert found.support[-1, 1] == pytest.approx(share, rel=0.04)


def test_both_curves_cross_where_the_run_with_support_ends(found):
    assert found.crossing == pytest.approx(found.support[-1], rel=0.01)
    # the second lining, which takes nothing, and the change of its stage do not hold the ground in the run without them
    assert found.ground[-1, 0] > 1.05 * found.support[-1, 0]


def test_the_picture_shows_both(found):
    whole, near = found.plot()
    assert whole.get_ylabel() == "pressure / 10 MPa in the ground [%]"
    assert whole.get_xlabel() == "convergence of point 1 [mm]"
    for axes in (whole, near):
        ground, support = (line.get_xydata() for line in axes.lines[:2])
        np.testing.assert_allclose(ground, found.ground * [1e3, 100])
        np.testing.assert_allclose(support, found.support * [1e3, 100])
    assert "placed at" in str(found)


def test_what_has_no_characteristic_is_refused(found, tmp_path):
    model = hole(12, 3)
    with pytest.raises(InputError, match="there is no lining 'steel'; the linings are: Shell, later"):
        support_reaction(model, liner="steel")
    with pytest.raises(InputError, match="expected 2 or more, found 1"):
        support_reaction(model, releases=1)
    with pytest.raises(InputError, match="there is no measured point 3; there are 1"):
        support_reaction(model, point=3, releases=2)
    bare = hole(12, 3)
    bare.options["stage"] = bare.options["stage"][:1]
    with pytest.raises(InputError, match="no stage installs a lining"):
        support_reaction(bare)
    early = hole(12, 3)
    del early.options["stage"][0]["excavate"]
    with pytest.raises(InputError, match="no stage excavates before 'Shell' is placed"):
        support_reaction(early)


def test_command(tmp_path, monkeypatch, capsys):
    hole(24, 6).to_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(["ground-reaction", "hole.nml", "--releases", "2", "--work", "runs", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["crossing"][1] == pytest.approx(told["end"][1], rel=0.03)  # 24 cells around; 48 have 1 %
    assert math.isclose(told["ground_pressure"], PRESSURE, rel_tol=1e-9)
    assert (tmp_path / "hole_reaction.png").stat().st_size > 10_000
    assert sorted(path.name for path in (tmp_path / "runs").glob("*d.h5")) == ["supported.h5"]
    assert (tmp_path / "runs/bare.h5").exists()
