# SPDX-License-Identifier: MIT
"""A round tunnel in three sets of joints, against the equivalent continuum; all sizes: benchmarks/jointed_hole.py."""

import os
import sys

import numpy as np
import pytest
from model_runs import ROOT


@pytest.fixture(scope="module")
def hole(program):
    sys.path.insert(0, str(ROOT / "benchmarks"))
    import jointed_hole

    os.environ.setdefault("ROCKDDA_PROGRAM", str(program))
    return jointed_hole


def test_the_closed_form_without_joints_is_that_of_kirsch(hole, monkeypatch):
    monkeypatch.setattr(hole, "RIM", 2000.0)
    monkeypatch.setattr(hole, "MEASURED", hole.RADIUS)
    np.testing.assert_allclose(hole.closed_form(None), [0.3467e-3, 2.6867e-3], rtol=1e-3)


def test_joints_that_hold_soften_the_ground_as_they_should(hole):
    result = hole.run(1.0, hole.JOINTS["joints that hold"])
    side, top = hole.closed_form(1.0)
    # two blocks along the radius of the hole: -4.5 and -4.8 %
    assert result.way[-1, 1] == pytest.approx(top, rel=0.06)
    assert result.way[-1].mean() == pytest.approx(0.5 * (side + top), rel=0.06)
    # linear in the released share; the first steps have some inertia
    np.testing.assert_allclose(result.way[4:11, 1], result.share[4:11] * result.way[10, 1], rtol=1e-2)
