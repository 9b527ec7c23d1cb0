# SPDX-License-Identifier: MIT
"""Barton and Bandis' strength (T12) and restitution (T28)."""

from __future__ import annotations

import numpy as np

from .model import Failed, G, Model, Row, material, rectangle


def barton_bandis(stress: float, expected: float) -> float:
    """Shear stress at which a block under a normal stress begins to slide, over the one expected."""
    model = Model(dt=0.1, steps=120, k01=0.0, g0=1e11, g2=0.5, materials=[material(gravity=0, modulus=1e13, nu=0)])
    model.joints = [[30.0, 0.0, 0.0]]
    model.options = (
        "&joint_material number = 1, law = 'barton_bandis', jrc = 10, jcs = 1e8, residual_friction = 30 /\n"
        "&contact fixed_stiffness_factor = 1e4 /\n"
    )
    model.add(rectangle(-1, -1, 4, 1), held=True)
    block = model.add(rectangle(0, 0, 1, 1))
    # 1 s to come to rest, then from 0.999 to 1.001 of the strength, in 100 steps, at the height of the joint
    end = 11.0
    model.loading.append((0.5, 0.5, block, [(0, 0, -stress), (1e6, 0, -stress)]))
    share = [(0, 0.9), (0.5, 0.999), (1.0, 0.999), (end, 1.001), (1e6, 1.001)]
    model.loading.append((0.5, 1e-9, block, [(t, f * expected, 0) for t, f in share]))
    model.measure(0.5, 0.0, block)
    model.steps = 110
    results = model.run()
    u = results.measured[:, 0, 0]
    speed = np.diff(u)
    elastic = np.median(speed[20:40])
    moving = np.nonzero(speed[15:] > 3 * abs(elastic) + 1e-15)[0]
    if not len(moving):
        return 1.001
    return float(np.interp(results.time[moving[0] + 16], [1.0, end], [0.999, 1.001]))


def drop(height: float, restitution: float, dt: float, g0: float = 1e9) -> float:
    """Speed after over speed before of a flat block, from the height to which it bounces."""
    fall = np.sqrt(2 * height / G)
    model = Model(dt=dt, steps=round(1.9 * fall / dt), g0=g0, g2=0.5, materials=[material(modulus=1e10, nu=0)])
    model.options = f"&joint_material number = 1, restitution = {restitution} /\n"
    model.add(rectangle(-2, -1, 5, 1), held=True)
    block = model.add(rectangle(0, height, 1, 1))
    model.measure(0.5, height + 0.5, block)
    results = model.run()
    y = height + results.measured[:, 0, 1]
    lowest = int(np.argmin(y[: round(1.15 * fall / dt)]))
    return float(np.sqrt(max(0.0, y[lowest:].max()) / height))


def rows(quick: bool = False) -> list[Row]:
    """T12, T28."""
    found = []
    for stress, strength in ((0.1e6, 0.17321e6), (5e6, 4.6643e6)):
        case = f"Barton-Bandis, JRC 10, JCS 100 MPa, φr 30°, {stress / 1e6:g} MPa"
        truth = f"{strength / 1e6:g} MPa ± 1e-4"
        try:
            value = barton_bandis(stress, strength)
            found.append(Row("T12", case, truth, f"{value * strength / 1e6:.5f} MPa", bool(abs(value - 1) <= 1e-4)))
        except Failed as failure:
            found.append(Row("T12", case, truth, str(failure)[:100], False))
    for restitution in (0.0, 0.3, 0.7, 1.0):
        values = []
        try:
            for height in (0.3, 1.0, 2.0):
                values += [drop(height, restitution, dt) for dt in ((0.001, 0.005) if not quick else (0.002,))]
            result, met = ", ".join(f"{v:.2f}" for v in values), max(abs(v - restitution) for v in values) <= 0.05
        except Failed as failure:
            result, met = str(failure)[:100], False
        found.append(
            Row("T28", f"flat drop from 0.3, 1, 2 m, 1 and 5 ms, e = {restitution:g}", "e ± 0.05", result, bool(met))
        )
    return found
