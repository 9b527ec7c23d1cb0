# SPDX-License-Identifier: MIT
"""Models that move: against closed forms of rigid blocks."""

import math

import numpy as np
from model_runs import INPUTS, G


def downhill(displacement, degrees):
    """Part of a displacement down a slope that rises to the right."""
    return -displacement @ [math.cos(math.radians(degrees)), math.sin(math.radians(degrees))]


def slide(degrees, friction):
    """Acceleration of a block that slides down a slope."""
    a, phi = math.radians(degrees), math.radians(friction)
    return G * (math.sin(a) - math.cos(a) * math.tan(phi))


def friction_lag(run, g0, weight_across, friction, mass, length):
    """Speed [m/s] that a block may gain before friction acts in full, if nothing damps it.

    The shear springs of a joint of this length stretch to u = mu N/k_s, friction grows meanwhile from 0 to mu N, and
    half of the work mu N u is missing.
    """
    shear = 0.4 * run.joint_stiffness(g0) * length
    return weight_across * math.tan(math.radians(friction)) / math.sqrt(shear * mass)


def stiff(g0):
    """Options: joints a hundred times as stiff, with which blocks behave as rigid ones on rigid joints."""
    return f"&contact stiffness = {100 * g0} /"


def test_incline_one_slides_one_stays(run_model, near):
    run = run_model("incline")
    expected = 0.5 * slide(30, 20) * run.time[-1] ** 2
    # the lower block, 2 m x 1 m of E = 1 GPa, on a joint of 2 m with the automatic g0 = 2 E
    modulus, weight = 1e9, 2500 * G * 2
    along, across = weight * math.sin(math.radians(30)), weight * math.cos(math.radians(30))
    further = downhill(run.displacement(0), 30)[-1] - expected
    assert 0 < further < friction_lag(run, 2 * modulus, across, 20, 5000, 2) * run.time[-1]
    # the contact force, and with it friction, is found within the first step: (dt/t)^2 = 2.5e-5
    rigid = run_model("incline", stiff(2 * modulus))
    near("incline, slide down the slope [m]", downhill(rigid.displacement(0), 30)[-1], expected, 5e-5)
    # the block on friction 35 deg only moves on its joint and is strained; a load put on at once moves it by twice that
    # at most, and it comes to rest. It slides freely until the joint is pressed, within a quarter of its period
    joint = 2 * run.joint_stiffness(2 * modulus)
    shear = along / (0.4 * joint) + along / 2 / (modulus / 2.5) * 0.5  # m; G = E/(2 (1 + nu)) = E/2.5
    sunk = across / joint + across / 2 / modulus * 0.5
    held = np.hypot(*run.displacement(1).T)
    free = 0.5 * G * math.sin(math.radians(30)) * (math.pi / 2) ** 2 * 5000 / joint
    assert held.max() < 2 * math.hypot(shear, sunk) + free
    assert abs(held[-1] - held[len(held) // 2]) < 1e-6


def test_bedding_slab_slides_with_automatic_numbers(run_model, near):
    run = run_model("bedding_slab")
    expected = 0.5 * slide(30, 22) * run.time[-1] ** 2
    for point in (0, 1):
        # The slab begins without weight on the seam and rings on it, and friction swings with it. Contacts that slide
        # are damped: 3.1e-3 with 10 ms, 1.7e-3 with 5 ms, 0.3e-3 with 2 ms, 1.5e-3 with 0.5 ms, at the worse point.
        near("bedding_slab, slide down the slope [m]", downhill(run.displacement(point), 30)[-1], expected, 4e-3)


def test_free_fall_is_exact(run_model):
    run = run_model("free_fall")
    t, moved = run.time, run.displacement(0)
    # beta = 1/2 integrates a constant acceleration without error: round-off of 60 steps
    assert np.abs(moved[:, 0] - 4 * t).max() < 1e-12
    assert np.abs(moved[:, 1] - (6 * t - 0.5 * G * t**2)).max() < 1e-12
    assert np.abs(run["history/measured_rotation"]).max() == 0


def test_toppling_column_rotates_like_an_inverted_pendulum(run_model, near):
    run = run_model("toppling_column")
    radius = 0.5 * math.hypot(1, 4)
    p2 = 3 * G / (4 * radius)  # m g R / (4/3 m R^2)
    start = math.radians(20) - math.atan2(1, 4)  # its diagonal leans beyond the vertical by this
    angle, rate, step = start, 0.0, 1e-4
    for _ in range(round(run.time[-1] / step)):  # classic Runge-Kutta: error below 1e-12
        k1, l1 = rate, p2 * math.sin(angle)
        k2, l2 = rate + 0.5 * step * l1, p2 * math.sin(angle + 0.5 * step * k1)
        k3, l3 = rate + 0.5 * step * l2, p2 * math.sin(angle + 0.5 * step * k2)
        k4, l4 = rate + step * l3, p2 * math.sin(angle + step * k3)
        angle, rate = angle + step * (k1 + 2 * k2 + 2 * k3 + k4) / 6, rate + step * (l1 + 2 * l2 + 2 * l3 + l4) / 6
    # it does not start from rest: its corner, with the end weight of the edge, 1/6 m, sinks in under the weight put on
    # at once, at up to g sqrt(m/k): a turn by that over R, which grows as sinh(p t)/p. The time integration is of first
    # order, p dt = 0.2 %
    turned = run["history/measured_rotation"][-1, 0]
    p = math.sqrt(p2)
    foot = run.joint_stiffness(5e10) / 6
    further = G * math.sqrt(2500 * 4 / foot) / radius * math.sinh(p * run.time[-1]) / p
    assert 0 < turned - (angle - start) < further
    rigid = run_model("toppling_column", stiff(5e10))["history/measured_rotation"][-1, 0]
    near("toppling_column, rotation after 1 s [deg]", math.degrees(rigid), math.degrees(angle - start), 1e-2)
    # energy: w^2 = 2 p^2 (cos(start) - cos(now)), at the angle that the model has
    now = start + turned
    omega = run["frames/velocity"][-1, run.block_at(*_slender_centre()), 2]
    near(
        "toppling_column, angular velocity [rad/s]", omega, math.sqrt(2 * p2 * (math.cos(start) - math.cos(now))), 1e-2
    )
    # the squat block stays: its diagonal leans back
    assert abs(run["history/measured_rotation"][-1, 1]) < 1e-4
    assert np.hypot(*run.displacement(1)[-1]) < 1e-4


def _slender_centre():
    c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
    return 5.5 * c - 2 * s, 5.5 * s + 2 * c


def test_pushed_block_starts_when_the_force_exceeds_friction(run_model, near):
    run = run_model("pushed_block")
    mass, friction = 5000.0, math.tan(math.radians(30)) * 5000 * G
    start = friction / 40e3  # the force is 40 kN/s * t until t = 1 s
    grown = 1 - start
    at_one = 40e3 / mass * grown**3 / 6
    speed = 40e3 / mass * grown**2 / 2
    after = run.time[-1] - 1
    acceleration = (40e3 - friction) / mass
    expected = at_one + speed * after + 0.5 * acceleration * after**2
    final_speed = speed + acceleration * after
    # loads are taken at the end of a step: everything happens up to dt earlier
    limit = final_speed * 0.001 / expected
    near("pushed_block, slide after 1.5 s [m]", run.displacement(0)[-1, 0], expected, limit)
    # elastic: on the shear springs of a joint of 2 m. The push at 0.5 m height takes load from one end of the joint,
    # which slides first; the last sixth holds until all slide
    moved, shear = np.abs(run.displacement(0)[:, 0]), 0.4 * run.joint_stiffness(1e10) * 2
    whole = start / (1 + math.tan(math.radians(30)) * 6 * 0.5 / 2)
    assert moved[run.time < whole].max() < 2 * whole * 40e3 / shear  # the block's own shear is less than the joint's
    assert moved[run.time < start - 0.01].max() < 6 * friction / shear


def test_shaking_block_is_newmarks_sliding_block(run_model, near):
    run = run_model("shaking_block")
    resistance = math.tan(math.radians(20)) * G
    speed = (6 - resistance) * 0.4
    expected = -0.5 * speed * 0.4 * 6 / resistance
    # friction lags by the shear of the joint when the block starts, so that it is faster, and slides further, by up to
    lag = friction_lag(run, 1e10, 5000 * G, 20, 5000, 2) / speed
    near("shaking_block, slide after one pulse, soft joints [m]", run.displacement(0)[-1, 0], expected, 2 * lag)
    # the ramps of the pulse are 1e-4 s of 0.4 s long
    rigid = run_model("shaking_block", stiff(1e10))
    near("shaking_block, slide after one pulse [m]", rigid.displacement(0)[-1, 0], expected, 1e-3)
    assert abs(run["frames/velocity"][-1, :, 0]).max() < 1e-5  # it has come to rest, but for elastic vibration


def test_rocking_wall_turns_by_housners_equation(run_model, near):
    run = run_model("rocking_wall")
    dynamic = run["history/stage"] == 1
    time = run.time[dynamic] - run.time[~dynamic][-1]
    turned = -run["history/measured_rotation"][dynamic, 0]
    ground = [5 * math.sin(math.pi * i / 100) for i in range(101)]
    weight, joint = 2500 * G * 4, 1e11

    def lever(angle):
        """Of the resultant of Winkler's springs without tension, from the middle of the base."""
        whole = joint * angle / 12 / weight
        return whole if whole < 1 / 6 else 0.5 - math.sqrt(2 * weight / (joint * angle)) / 3

    def turn(t, angle):
        a = np.interp(t, np.linspace(0, 0.5, 101), ground)  # at its end the pulse is zero
        x = lever(max(angle, 0.0))
        inertia = weight / G * ((1 + 16) / 12 + x**2 + 4)
        along, up = x * math.cos(angle) - 2 * math.sin(angle), 2 * math.cos(angle) + x * math.sin(angle)
        return weight * (a / G * up - along) / inertia

    step = 1e-4
    t, angle, rate, angles = 0.0, 0.0, 0.0, []
    while t < 1:  # classic Runge-Kutta
        k1, l1 = rate, turn(t, angle)
        k2, l2 = rate + 0.5 * step * l1, turn(t + 0.5 * step, angle + 0.5 * step * k1)
        k3, l3 = rate + 0.5 * step * l2, turn(t + 0.5 * step, angle + 0.5 * step * k2)
        k4, l4 = rate + step * l3, turn(t + step, angle + step * k3)
        angle, rate = angle + step * (k1 + 2 * k2 + 2 * k3 + k4) / 6, rate + step * (l1 + 2 * l2 + 2 * l3 + l4) / 6
        t += step
        angles.append((angle, t))
    expected, when = max(angles)
    # on a rigid joint it would be 4.526 degrees (Housner): the springs let the wall turn before it stands on its corner
    near("rocking_wall, largest rotation [deg]", math.degrees(turned.max()), math.degrees(expected), 5e-3)
    near("rocking_wall, time of it [s]", time[turned.argmax()], when, 5e-3)


def test_shaken_slope_slides_like_newmarks_block(run_model, near):
    run = run_model("shaken_slope")
    rows = _record("shaken_slope")
    time = np.linspace(0, rows[-1, 0], 400_001)  # 20 µs: the sum is off by less than 1e-4
    slope, friction = math.radians(20), math.tan(math.radians(30))
    push = np.interp(time, *rows.T)
    down = push * math.cos(slope) + G * math.sin(slope) - friction * (G * math.cos(slope) - push * math.sin(slope))
    speed = expected = 0.0
    step = time[1]
    for force in down.tolist():
        speed = max(0.0, speed + step * force)
        expected += step * speed
    for point in (0, 1):
        # it starts and stops at whole steps of 5 ms, and the joint shears by mu N/k first
        near("shaken_slope, slide [m]", downhill(run.displacement(point), 20)[-1], expected, 1e-2)


def test_shaken_hillside_moves_as_level_ground_does_and_rests_where_it_began(run_model, near):
    run = run_model("shaken_hillside")
    dynamic = run["history/stage"] == 1
    time = run.time[dynamic] - run.time[~dynamic][-1]
    moved = run["history/measured_displacement"][dynamic]
    fine = np.linspace(0, 8, 80_001)
    speed = np.cumsum(np.interp(fine, *_record("shaken_hillside").T, right=0)) * fine[1]
    wave = np.cumsum(speed) * fine[1]
    shear = math.sqrt(1e9 / 2.5 / 2000)
    for point, height in ((0, 35), (1, 20)):
        level = 2 * np.interp(time - height / shear, fine, wave, left=0)
        # not the ground of a column: the hillside between them, 15 m of waves of 100 m and more, scatters
        off = abs(moved[:, point, 0] - level).max() / abs(level).max()
        near(f"shaken_hillside, ground of {height} m, off twice the wave", 1 + off, 1, 0.1)
        # what stays: the slab has moved by 0.13 m
        near("shaken_hillside, ground after the record [m]", moved[-1, point, 0], 0, 2e-4, absolute=True)
    near(
        "shaken_hillside, ground in the first dynamic steps [m]",
        abs(moved[:5, [0, 1, 4]]).max(),
        0,
        1e-6,
        absolute=True,
    )
    # a rigid block on the motion of the ground below; the slab vibrates on its joint, and friction is lost meanwhile
    slope, friction = math.atan2(15, 25), math.tan(math.radians(38))
    down, out = np.array([math.cos(slope), -math.sin(slope)]), np.array([math.sin(slope), math.cos(slope)])
    push = np.gradient(np.gradient(moved[:, 4], time, axis=0), time, axis=0)
    force = G * math.sin(slope) - push @ down - friction * (G * math.cos(slope) + push @ out)
    rate = slide_of_block = 0.0
    for pull, step in zip(force.tolist(), np.diff(time, prepend=0.0).tolist(), strict=True):
        rate = max(0.0, rate + step * pull)
        slide_of_block += step * rate
    for point in (2, 3):
        near("shaken_hillside, slide [m]", float((moved[-1, point] - moved[-1, 4]) @ down), slide_of_block, 0.15)


def _record(model):
    return np.loadtxt(INPUTS / model / "record.csv", delimiter=",", skiprows=1)


def test_released_block_waits_then_slides(run_model, near):
    run = run_model("released_block")
    moved = downhill(run.displacement(0), 35)
    held = np.argmin(np.abs(run.time - 0.2))
    assert abs(run.time[held] - 0.2) < 1e-12  # a step lands on the end of the stage
    assert abs(moved[held]) < 1e-6  # held by a spring of 1e12 N/m
    assert abs(run.time[-1] - 1.0) < 1e-12
    expected = 0.5 * slide(35, 10) * (run.time[-1] - 0.2) ** 2
    # the prop's force has to go over to the contact in the first step: (dt/t)^2 = 1e-5
    near("released_block, slide after release [m]", moved[-1] - moved[held], expected, 2e-5)


def test_jointed_slope_slides_as_one_mass(run_model, near):
    run = run_model("jointed_slope")
    areas = run["model/block_area"]
    moving = areas < 50
    assert moving.sum() >= 100
    acceleration = slide(30, 20)

    def mean_slide(one):
        travelled = one["frames/centroid"][-1] - one["frames/centroid"][0]
        return (areas[moving] @ downhill(travelled[moving], 30)) / areas[moving].sum()

    # friction lags by the shear of the plane on which the mass lies
    mass, (c, s) = 2500 * areas[moving].sum(), (math.cos(math.radians(30)), math.sin(math.radians(30)))
    expected = 0.5 * acceleration * run.time[-1] ** 2
    lag = friction_lag(run, 1e9, mass * G * c, 20, mass, _base_of_slope(run, moving))
    assert 0 < mean_slide(run) - expected < lag * run.time[-1]
    # the mass first settles on its joints (1e-4 m of 0.9 m) and so starts with a small speed of some mm/s
    rigid = run_model("jointed_slope", stiff(1e9))
    near("jointed_slope, mean slide after 1 s [m]", mean_slide(rigid), expected, 5e-3)
    # it keeps together: all three measured points go the same way
    assert np.ptp([downhill(run.displacement(k), 30)[-1] for k in range(3)]) < 2e-3
    # supports carry the weight less what the moving mass does not press: W - m a, as vectors
    total = run.support_forces().sum(axis=0)
    near("jointed_slope, support force x [N]", total[0], -mass * acceleration * c, 1e-3)
    near("jointed_slope, support force y [N]", total[1], run.weight() - mass * acceleration * s, 1e-3)


def _base_of_slope(run, moving):
    """Extent of the moving mass along the slope [m]."""
    offset, corners = run["model/vertex_offset"], run["frames/vertices"][0]
    along = np.concatenate([downhill(corners[offset[b] : offset[b + 1]], 30) for b in np.flatnonzero(moving)])
    return np.ptp(along)
