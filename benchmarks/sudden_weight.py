#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A block that friction holds, its weight put on at once or by a static stage, with steps that resolve its vibration.

    python3 benchmarks/sudden_weight.py

A block 2 x 1 on an incline of 30 degrees, friction 35 degrees. Without damping the vibration of the sudden weight goes
on, friction feeds it from the way downhill, and the block creeps. `integrate` solves the same equations by itself, with
steps of 1 to 4 microseconds: a block of constant strain on Coulomb springs. The program is that of ROCKDDA_PROGRAM,
else of the build tree.
"""

from __future__ import annotations

import math

import numpy as np
from by_length.model import G, Model, material, rectangle, turn

LENGTH, HEIGHT, DENSITY, YOUNG, POISSON = 2.0, 1.0, 2500.0, 1e9, 0.25
BASE = 1e13  # E of the base
SLOPE, FRICTION = math.radians(30), math.radians(35)
STIFFNESS = 1e9  # of the joint, normal, per length [Pa/m]
SHEAR_RATIO = 2.5
SHARES = (1 / 6, 2 / 3, 1 / 6)  # of the length, of the stations of an interval
TIME = 1.0
SECOND = "&time integrator = 'generalized_alpha', rho_infinity = 1 /\n"
STATIC = "&stage name = 'rest', until = 'equilibrium' /\n&stage name = 'wait', kind = 'dynamic', duration = 1 /\n"


def run(dt: float, damping: float = 0.0, options: str = "", formulation: str = "length") -> float:
    """Way along the incline after TIME, of the program [m]."""
    model = Model(dt=dt, steps=round(TIME / dt), g0=2 * YOUNG, g2=0.02, formulation=formulation)
    model.materials = [material(density=DENSITY, modulus=YOUNG, nu=POISSON), material(modulus=BASE)]
    model.joints = [[math.degrees(FRICTION), 0.0, 0.0]]
    number = "&joint_material number = 1, normal_stiffness = {}, shear_stiffness = {}, damping_ratio = {} /\n"
    if formulation == "length":
        model.options = number.format(STIFFNESS, STIFFNESS / SHEAR_RATIO, damping)
    model.options += options
    model.add(turn(rectangle(-3.0, -1.0, 6.0, 1.0), math.degrees(SLOPE)), 2, held=True)
    block = model.add(turn(rectangle(-1.0, 0.0, LENGTH, HEIGHT), math.degrees(SLOPE)))
    model.measure(*turn([(0.0, HEIGHT / 2)], math.degrees(SLOPE))[0], block)
    moved = model.run().measured[-1, 0]
    return float(-moved @ (math.cos(SLOPE), math.sin(SLOPE)))


def integrate(dt: float = 2e-6) -> float:
    """The same by symplectic Euler steps: displacement of the centroid (u, v) and its gradient, springs that slip.

    Coordinates go along the incline, downhill, and away from it; plane stress; small rotations; a rigid base.
    """
    mass = DENSITY * LENGTH * HEIGHT
    along, across = mass * LENGTH**2 / 12, mass * HEIGHT**2 / 12
    volume, stiff = LENGTH * HEIGHT, YOUNG / (1 - POISSON**2)
    shear_modulus, friction = YOUNG / 2 / (1 + POISSON), math.tan(FRICTION)
    stations = [
        (x, STIFFNESS * LENGTH * share, STIFFNESS * LENGTH * share / SHEAR_RATIO)
        for x, share in zip((-LENGTH / 2, 0.0, LENGTH / 2), SHARES, strict=True)
    ]
    slip = [0.0, 0.0, 0.0]
    y = -HEIGHT / 2
    u = v = ux = uy = vx = vy = 0.0
    du = dv = dux = duy = dvx = dvy = 0.0
    for _ in range(round(TIME / dt)):
        fu, fv = mass * G * math.sin(SLOPE), -mass * G * math.cos(SLOPE)
        shear = volume * shear_modulus * (uy + vx)
        qux, quy = -volume * stiff * (ux + POISSON * vy), -shear
        qvx, qvy = -shear, -volume * stiff * (vy + POISSON * ux)
        for i, (x, normal, tangential) in enumerate(stations):
            gap, way = v + vx * x + vy * y, u + ux * x + uy * y
            if gap >= 0:
                slip[i] = way
                continue
            force = -normal * gap
            hold = -tangential * (way - slip[i])
            if abs(hold) > friction * force:
                hold = math.copysign(friction * force, hold)
                slip[i] = way + hold / tangential
            fu, fv = fu + hold, fv + force
            qux, quy, qvx, qvy = qux + hold * x, quy + hold * y, qvx + force * x, qvy + force * y
        du, dv = du + dt * fu / mass, dv + dt * fv / mass
        dux, dvx = dux + dt * qux / along, dvx + dt * qvx / along
        duy, dvy = duy + dt * quy / across, dvy + dt * qvy / across
        u, v, ux, uy, vx, vy = u + dt * du, v + dt * dv, ux + dt * dux, uy + dt * duy, vx + dt * dvx, vy + dt * dvy
    return u


def main() -> None:
    """Print the ways as rows of Markdown."""
    steps = (5e-3, 6.25e-4, 1.5625e-4, 3.90625e-5)
    rows = [
        ("weight at once, no damping", {}),
        ("weight at once, `damping_ratio = 0.1`", {"damping": 0.1}),
        ("a static stage first, no damping", {"options": STATIC}),
        ("weight at once, no damping, generalised alpha, rho 1", {"options": SECOND}),
        ("weight at once, at vertices, no damping", {"formulation": "vertex"}),
    ]
    print("| way in 1 s [mm] |", " | ".join(f"{1e3 * dt:.3g} ms" for dt in steps), "|")
    print("|---|" + "---|" * len(steps))
    for name, options in rows:
        ways = [run(dt, **options) for dt in steps]
        print(f"| {name} |", " | ".join(f"{1e3 * way:.3g}" for way in ways), "|", flush=True)
    ways = np.array([integrate(dt) for dt in (4e-6, 2e-6, 1e-6)])
    print("integrated by itself (4, 2, 1 microseconds):", ", ".join(f"{1e3 * way:.3g} mm" for way in ways))


if __name__ == "__main__":
    main()
