# SPDX-License-Identifier: MIT
"""Bolts against statics, beam theory and the balance of energy."""

import json
import math

import numpy as np
import pytest
from model_runs import INPUTS, Run, run_program

PLANE, FRICTION, COHESION, SUPPORT = math.radians(35), math.tan(math.radians(35)), 100e3, 2e6
CRACK = 60 / math.tan(math.radians(50)) + 15.336
DEPTH = 60 - CRACK * math.tan(PLANE)
LENGTH = CRACK / math.cos(PLANE)
WEIGHT = 26e3 * (0.5 * 60 * 15.336 + 0.5 * CRACK * DEPTH)


def bolted_factor(share: float) -> float:
    """F of Sau Mau Ping with a horizontal force that strength reduction does not reduce."""
    uplift, thrust = 0.5 * 10e3 * share * DEPTH * LENGTH, 0.5 * 10e3 * (share * DEPTH) ** 2
    s, c = math.sin(PLANE), math.cos(PLANE)
    resisting = COHESION * LENGTH + (WEIGHT * c - uplift - thrust * s + SUPPORT * s) * FRICTION
    return resisting / (WEIGHT * s + thrust * c - SUPPORT * c)


@pytest.mark.parametrize(
    # bars take their force only when the slope has moved, and with it the pressure on the plane
    ("name", "share", "truth", "limit"),
    [
        ("anchors_dry", 0, 1.8656, 0.005), ("anchors_full", 1, 1.4135, 0.005),
        ("bars_dry", 0, 1.8656, 0.02), ("bars_full", 1, 1.4135, 0.02),
    ],
)  # fmt: skip
def test_bolted_slope(program, tmp_path, near, name, share, truth, limit):
    assert bolted_factor(share) == pytest.approx(truth, rel=5e-5)
    found = run_program(
        program,
        [
            *("fos", str(INPUTS / "bolted_slope" / f"{name}.nml")),
            *("--joints", "plane", "--tolerance", "0.002", "--json"),
        ],
        tmp_path,
    )
    assert found.returncode == 0, found.stderr
    near(f"bolted_slope {name}: F", json.loads(found.stdout)["factor"], truth, limit)


def dowelled_sag(x: np.ndarray, w: float, t: float, young: float, stiffness: float) -> tuple[float, np.ndarray]:
    """Sag of two layers with dowels at x, held at the middle of their ends, and the forces of the dowels."""
    span, inertia = 6.0, t**3 / 12
    s = np.linspace(0, span, 20001)

    def integral(g: np.ndarray) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(0.5 * (g[1:] + g[:-1]) * np.diff(s))])

    def slip(moment: np.ndarray, thrust: np.ndarray) -> np.ndarray:
        """Of the bedding: t w' by the curvature, less the lengthening of both layers by a thrust whose mean is 0."""
        slope = integral(moment / (2 * young * inertia))
        slope = slope - integral(slope)[-1] / span
        return np.interp(x, s, t * slope - 2 * integral(thrust - integral(thrust)[-1] / span) / (young * t))

    free = w * s * (span - s) / 2
    beyond = np.array([(s >= place).astype(float) for place in x])
    bare = slip(free, 0 * s)
    each = np.array([slip(-t * one, one) for one in beyond]).T
    force = np.linalg.solve(np.eye(len(x)) + stiffness * each, -stiffness * bare)
    curvature = (free - t * (beyond.T @ force)) / (2 * young * inertia)
    bent = integral(integral(curvature))
    return float(-(bent - bent[-1] * s / span).min()), force


def test_dowelled_roof(run_model, near):
    places = np.array([0.51, 1.51, 2.51, 3.51, 4.51, 5.49])
    bedding, inertia = 5e9, math.pi * 0.025**4 / 64
    stiffness = bedding / (4 * (bedding / (4 * 200e9 * inertia)) ** 0.25)
    near("dowelled_roof: stiffness of a dowel", stiffness, 52.3145e6, 1e-5)
    sag, force = dowelled_sag(places, 12.5e3, 0.25, 10e9, stiffness)
    run = run_model("dowelled_roof")
    # cells of half a layer's thickness bend 0.2 % too much; the dowels sit in cells, not on a line
    near("dowelled_roof: sag", -run.displacement(0)[-1, 1], sag, 0.01)
    near("dowelled_roof: outer dowel", abs(run["history/bolt_dowel"][-1, 0]), abs(force[0]), 0.02)


def test_hung_block(run_model, near):
    run = run_model("hung_block")
    stage, force = run["history/stage"], run["history/bolt_force"]
    ends = [np.flatnonzero(stage == k)[-1] for k in (0, 1)]
    for row, expected in zip(ends, [(70e3 / 3, 100e3 / 3, 130e3 / 3), (50e3, 0.0, 75e3)], strict=True):
        for name, found, wanted in zip(("left", "middle", "right"), force[row], expected, strict=True):
            # bolts lengthen by 2 mm of 4 m, and the block turns with them
            near(f"hung_block: {name}, stage {stage[row] + 1}", found, wanted, 2e-3 * (wanted > 0) or 1e-9, not wanted)
    assert run["frames/bolt_state"][-1].tolist() == [1, 1, 4, 4, 1, 1]


def test_falling_wedge(run_model, near):
    run = run_model("falling_wedge")
    mass, speed, plateau = 1.5 * 2700, 3.0, 100e3
    stiffness = 200e9 * math.pi * 0.01**2 / 3
    way = (0.5 * mass * speed**2 + plateau**2 / stiffness) / (2 * plateau - mass * 9.81)
    # 80 steps on the way
    near("falling_wedge: way", -run.displacement(0)[:, 1].min(), way, 0.005)
    spent = 2 * plateau * (way - plateau / stiffness)
    near("falling_wedge: spent by yield", run["history/bolt_energy"][-1, 2], spent, 0.005)
    assert run["history/bolt_force"].max() == pytest.approx(plateau, rel=1e-9)


def test_supported_tunnel(program, tmp_path, run_model, near):
    """Bent bolts keep their tangent: without them 38 steps. The lining carries most of what they did, and its weight
    goes to the bottom."""
    results = tmp_path / "out.h5"
    outcome = run_program(program, ["run", str(INPUTS / "supported_tunnel"), "-o", str(results)], tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    run, bare = Run(results), run_model("two_headings")
    assert len(run.time) < 250
    force = run["history/boundary_force"][-1, 0, 1]
    points = run["frames/liner_point"][-1]
    weight = 0.15 * 2400 * 9.81 * np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    # the points are those of the nodes: half a segment at each end is not between two
    near("supported_tunnel, force on the bottom [N]", force - bare["history/boundary_force"][-1, 0, 1], weight, 0.005)
    crown = [-one.displacement(0)[-1, 1] for one in (run, bare)]
    assert crown[0] < 0.97 * crown[1]
    lining = run["frames/liner_force"][-1]
    assert -1e6 < lining[:, 0].min() < -0.5e6
    assert np.abs(lining[:, 1]).max() < 20e3
    assert 10e3 < run["history/bolt_force"][-1].max() < 74e3
