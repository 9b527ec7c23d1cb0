# SPDX-License-Identifier: MIT
"""Models that are built in stages, against balances of forces and limit analysis."""

import itertools
import math

import numpy as np
import pytest
from model_runs import INPUTS, G, run_program


def stage_ends(run) -> list[int]:
    """Row of the history that ends each stage."""
    stage = run["history/stage"]
    return [int(np.flatnonzero(stage == k)[-1]) for k in range(stage.max() + 1)]


def active_area(run, row: int, material: int | None = None) -> float:
    """Area of the blocks that are there in the frame of a row of the history, which ends a stage."""
    frame = np.flatnonzero(run["frames/step"] == run["history/step"][row])[0]
    chosen = run["frames/active"][frame] > 0
    if material is not None:
        chosen = chosen & (run["model/block_material"] == material)
    return float(run["model/block_area"][chosen].sum())


@pytest.mark.parametrize("name", ["two_headings", "benched_slope"])
def test_lines_of_the_survey_are_those_of_the_model(program, tmp_path, name):
    done = run_program(program, ["lines", str(INPUTS / name / f"{name}.dl"), "-o", str(tmp_path / "new.dc")], tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "new.dc").read_text() == (INPUTS / name / f"{name}.dc").read_text()


def test_supports_of_the_tunnel_bear_weight_and_overburden(run_model, near):
    run = run_model("two_headings")
    force, share = run["history/boundary_force"], run["history/relaxation"]
    rows = stage_ends(run)
    assert len(rows) == 4
    assert list(share[rows]) == [0, 0.5, 1, 1]
    assert (run["history/unbalanced"][rows] <= 1e-5).all()
    whole, heading, _, _ = (active_area(run, row) for row in rows)
    held = 0.5 * (whole - heading)  # half of the heading's forces, which balanced its weight, still act
    # stages end at an unbalanced force of 1e-5 of the mean on a block, which is 1e-3 of the sum here
    for row, rest in zip(rows, (0.0, held, 0.0, 0.0), strict=True):
        weight = 2650 * G * (active_area(run, row) + rest)
        near("two_headings, force on the bottom [N]", force[row, 0, 1], weight + 40 * 1.56e6, 1e-6)
        assert abs(force[row, :, 0].sum()) < 1e-6 * abs(force[row, 1, 0])


def test_convergence_of_the_tunnel_lies_between_rock_without_joints_and_with_endless_ones(run_model):
    run = run_model("two_headings")
    young, poisson, k_n, k_s = 20e9, 0.25, 20e9, 8e9
    vertical = 1.56e6 + 18.5 * 2650 * G  # at the floor of the heading
    mean, half = 1.25 * vertical, 0.25 * vertical
    intact = 2 * 4.5 * (1 + poisson) / young * (mean + half * (3 - 4 * poisson))  # Kirsch
    softer = 1 / young
    for inclination, spacing in ((12, 1.15), (78, 1.5), (135, 2.4)):
        s, c = math.sin(math.radians(inclination)), math.cos(math.radians(inclination))
        softer += (s**4 / k_n + s**2 * c**2 / k_s) / spacing
    closure = run.displacement(1)[:, 0] - run.displacement(2)[:, 0]
    ends = closure[stage_ends(run)]
    assert (np.diff(ends) > 0).all()
    assert intact < ends[-1] < intact * young * softer


def test_bottom_of_the_slope_bears_what_is_left_of_it(run_model, near):
    run = run_model("benched_slope")
    force, rows = run["history/boundary_force"], stage_ends(run)
    assert len(rows) == 5
    areas = [2450.0]
    for k in range(4):  # what a cut takes away: from the middle of its face to the right side
        areas.append(areas[-1] - 5 * (40 - 4.25 * k - 0.625))
    for row, area in zip(rows, areas, strict=True):
        near("benched_slope, force on the bottom [N]", force[row, 0, 1], 2500 * G * area, 1e-6)
        assert abs(force[row, :, 0].sum()) < 1e-6 * force[row, 1, 0]
    heave = run.displacement(2)[rows, 1]
    assert (np.diff(heave) > 0).all()


def thrusts(angles: list[float], inner: float, outer: float, unit_weight: float) -> tuple[float, float]:
    """Least and largest thrust of half an arch whose line of thrust stays within its joints, given from the crown on.

    With the thrust H at the height h of the crown, unknowns H and H h, each joint gives two linear conditions: moments
    about its inner and outer end have opposite signs.
    """
    top = [(0.0, inner * math.sin(math.radians(angles[0]))), (0.0, outer * math.sin(math.radians(angles[0])))]
    last, weight, moment = top, 0.0, 0.0
    conditions = [(-top[0][1], 1.0, 0.0), (top[1][1], -1.0, 0.0)]
    for angle in angles:
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        joint = [(inner * c, inner * s), (outer * c, outer * s)]
        x, y = np.array([last[0], joint[0], joint[1], last[1]]).T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y
        area = cross.sum() / 2
        weight += area * unit_weight
        moment += ((x + np.roll(x, -1)) * cross).sum() / 6 * unit_weight
        for (px, py), sign in zip(joint, (-1, 1), strict=True):
            conditions.append((sign * py, -sign, sign * (moment - px * weight)))
        last = joint
    found = []
    for a, b in itertools.combinations(conditions, 2):
        determinant = a[0] * b[1] - a[1] * b[0]
        if abs(determinant) < 1e-9:
            continue
        h = (a[2] * b[1] - a[1] * b[2]) / determinant
        m = (a[0] * b[2] - a[2] * b[0]) / determinant
        if all(c[0] * h + c[1] * m >= c[2] - 1e-6 * abs(h) for c in conditions):
            found.append(h)
    return min(found), max(found)


def test_arch_carries_itself_with_a_thrust_of_limit_analysis(run_model, near):
    run = run_model("arch_on_centring")
    force, rows = run["history/boundary_force"], stage_ends(run)
    assert [active_area(run, row, 2) > 0 for row in rows] == [False, True, True]
    least, most = thrusts([85 - 10 * k for k in range(8)], 4.5, 5.5, 2400 * G)
    left, right, centring = force[rows[-1]]
    assert least < left[0] < most
    assert np.abs(centring).max() == 0
    # the springs of the abutments: 1e-5 of the mean force of a block
    near("arch_on_centring, thrust, left and right [N]", left[0], -right[0], 1e-5)
    half = 0.5 * G * (2400 * active_area(run, rows[-1], 2) + 2500 * active_area(run, rows[-1], 1))
    near("arch_on_centring, vertical reaction [N]", left[1], half, 1e-5)
    # on the centring it bears a part only
    assert force[rows[1], 2, 1] > 0.5 * 2400 * G * active_area(run, rows[1], 2)
