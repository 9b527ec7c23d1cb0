# SPDX-License-Identifier: MIT
"""Linings: read from results, drawn, written as a table, and the limits of their sections."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
import rockdda
from rockdda import export, plot
from rockdda.plot.support_maps import crack_limit, cracked_limit, plastic_limit

MODEL = """\
&model geometry = 'beam.dc', units = 'SI' /
&block_material number = 1, density = 2500, young = 1e10, poisson = 0.2 /
&joint_material number = 1, friction = 30 /
&load gravity = 9.81 /
&boundary along = -1,1, 0,1, kind = 'fixed' /
&liner name = 'beam', along = -1,0, 3,0, thickness = 0.2, young = 30e9, compressive_strength = 30e6,
       tensile_strength = 5e6 /
&stage until = 'equilibrium' /
"""


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    folder = tmp_path_factory.mktemp("beam")
    lines = ["-1 0 0 0 1", "0 0 0 1 1", "0 1 -1 1 1", "-1 1 -1 0 1"]
    (folder / "beam.dc").write_text("\n".join(["0.001", "4 4", "0", "0", "0", "0", "0", "0", *lines]) + "\n")
    (folder / "beam.nml").write_text(MODEL)
    yield rockdda.run(folder / "beam.nml", output=folder / "beam.h5")
    plt.close("all")


def test_nodes_and_table(beam, tmp_path):
    nodes = beam.frames[-1].liner_nodes
    sides = ["N_before", "Q_before", "N_behind", "Q_behind"]
    assert list(nodes) == ["liner", "name", "x", "y", "N", "M", "Q", *sides, "opening", "slip", "use", "state"]
    # a straight line has one force on both sides of a node
    for name in sides:
        np.testing.assert_array_equal(nodes[name], nodes[name[0]])
    root = nodes.iloc[int(np.abs(nodes["x"]).argmin())]
    # its own weight of 2500 kg/m3 on 3 m pulls on the side of the rock
    assert root["M"] == pytest.approx(-2500 * 9.81 * 0.2 * 3**2 / 2, rel=0.01)
    export.to_csv(beam, tmp_path / "liner.csv", "liner")
    rows = (tmp_path / "liner.csv").read_text().splitlines()
    assert len(rows) == 1 + beam.n_frames * len(nodes)


def test_both_sides_of_a_corner_are_drawn(tmp_path):
    """The last metre of the beam hangs down: its weight is N of the one side of the corner and Q of the other."""
    lines = ["-1 0 0 0 1", "0 0 0 1 1", "0 1 -1 1 1", "-1 1 -1 0 1"]
    (tmp_path / "beam.dc").write_text("\n".join(["0.001", "4 4", "0", "0", "0", "0", "0", "0", *lines]) + "\n")
    (tmp_path / "bent.nml").write_text(
        MODEL.replace("3,0,", "2,0, 2,-1,").replace("thickness", "element = 1, thickness")
    )
    with pytest.warns(rockdda.InputWarning, match="lies beside no rock"):
        bent = rockdda.run(tmp_path / "bent.nml", output=tmp_path / "bent.h5")
    now, weight = bent.frames[-1], 2500 * 9.81 * 0.2
    nodes = now.liner_node_columns
    corner = int(np.hypot(nodes["x"] - 2, nodes["y"]).argmin())
    found = [nodes[name][corner] for name in ("N_before", "Q_before", "N_behind", "Q_behind")]
    np.testing.assert_allclose(found, [0, weight, weight, 0], atol=0.01 * weight)
    assert nodes["N"][corner] == nodes["N_behind"][corner]
    # the means of beams are those of their own ends
    pieces = now.liner_pieces
    assert pieces["Q"][corner - 1] == pytest.approx(1.5 * weight, rel=0.01)
    assert pieces["Q"][corner] == pytest.approx(0, abs=0.01 * weight)
    (drawn,) = [one for one in plot.liner(bent, "Q").collections if one.get_zorder() == 3]
    before, behind = (path.vertices[:4] for path in drawn.get_paths()[corner - 1 : corner + 1])
    assert abs(before[2] - before[1])[1] > 10 * abs(before[2] - before[1])[0]  # Q of the beam stands on it
    assert np.hypot(*(behind[3] - behind[0])) < 0.05 * np.hypot(*(before[2] - before[1]))
    plt.close("all")


def test_pictures(beam, tmp_path):
    panels = plot.liner(beam)
    assert [axes.get_xlabel()[-40:].split(":")[0].split()[-2] for axes in panels] == ["N", "M", "Q"]
    axes = plot.liner(beam, "M")
    assert "kNm/m" in axes.get_xlabel()
    plot.save(plot.capacity(beam), tmp_path / "capacity.png")
    with pytest.raises(rockdda.InputError, match="the forces of a lining are N, M, Q"):
        plot.liner(beam, "force")


def test_limits_of_a_section():
    """L3: t 0.3, fc 30, ft 3 MPa."""
    # the whole of a section by the stresses over 20,000 fibres: elastic between the strengths, or without tension
    y = (np.arange(20000) + 0.5) / 20000 * 0.3 - 0.15
    for k, (n, m) in enumerate(zip(*crack_limit(0.3, 30.0, 3.0), strict=True)):
        if k in (0, 41):  # pulled, and pressed all over: without curvature
            assert (n, m) == (pytest.approx((-0.9, 9.0)[k > 0]), pytest.approx(0, abs=1e-12))
            continue
        elastic = 0.3 * (1 - (k - 1) / 40)
        stress = np.minimum(-3.0 + 33.0 * (y + 0.15) / elastic, 30.0)
        assert n == pytest.approx(stress.mean() * 0.3, abs=2e-3)
        assert m == pytest.approx((stress * y).mean() * 0.3, abs=2e-4)
    assert crack_limit(0.3, 30.0, 3.0)[1].max() > 0.2475
    n, m = plastic_limit(0.3, 30.0)
    for depth in (0.05, 0.15, 0.25):  # of the block of stress: N = fc a, M = fc a (t - a)/2
        assert np.interp(30 * depth, n, m) == pytest.approx(30 * depth * (0.3 - depth) / 2, rel=2e-3)
    assert m.max() == pytest.approx(1.5 * np.interp(4.5, *cracked_limit(0.3, 30.0, 3.0)), rel=1e-3)
    n, m = cracked_limit(0.3, 30.0, 3.0)
    # first crushing without tension: chords of a parabola are below it by less than 1e-3
    assert np.interp(2.0, n, m) == pytest.approx(0.21111, rel=1e-3)
