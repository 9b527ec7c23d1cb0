# SPDX-License-Identifier: MIT
"""Pendulums (T22), rocking and overturning blocks, flat drops (T28)."""

from __future__ import annotations

import numpy as np

from .model import Failed, G, Model, Row, material, rectangle, turn


def swing(start: float, dt: float, time: float, link: str = "pin") -> tuple[float, float, float]:
    """A square 1 × 1 hung by a corner: angle in the last 3.5 s over the start, gain and loss of energy.

    On a bolt it is a double pendulum without an amplitude of its own: 1 is returned for it.
    """
    model = Model(dt=dt, steps=round(time / dt), g0=1e9, g2=1.0, materials=[material(modulus=1e10)])
    half = np.sqrt(0.5)
    square = turn([(0.0, 0.0), (-half, -half), (0.0, -2 * half), (half, -half)], start)
    block = model.add(square)
    lowest = -half
    if link == "pin":
        model.fixed.append((*square[0], block))
    else:
        anchor = turn([(0.0, 1.0)], start)[0]
        model.bolts.append((*anchor, *square[0], 0, block, 1e9, 0.0, 1e9))
        lowest = anchor[1] - 1 - half
        model.add(rectangle(-0.2, 5.0, 0.4, 0.4), held=True)
    middle = np.mean(square, axis=0)
    model.measure(*middle, block)
    results = model.run()
    x, y = (middle + results.measured[:, 0]).T
    total = results.energy[:, :4].sum(axis=1) - results.energy[0, :4].sum()
    range_of = 2500 * G * (middle[1] - lowest)
    last = 1.0
    if link == "pin":
        angle = np.degrees(np.arctan2(x, -y))
        last = float(np.abs(angle[results.time > results.time[-1] - 3.5]).max() / start)
    return last, float(total.max() / range_of), float(-total.min() / range_of)


def rocking_rows() -> list[Row]:
    """Time of the first impact of a rocking block (Housner), and a block tipped beyond its balance."""
    found = []
    b, h = 0.5, 2.0  # half width, half height
    size, slender = np.hypot(b, h), np.arctan(b / h)
    p = np.sqrt(3 * G / (4 * size))
    for share, g0, dt in ((0.5, 1e10, 0.001), (0.5, 1e11, 0.002), (0.9, 1e10, 0.001), (1.1, 1e10, 0.001)):
        theta = share * slender
        model = Model(dt=dt, steps=round(2.0 / dt), g0=g0, g2=0.5, materials=[material(modulus=1e11, nu=0.0)])
        model.joints = [[60.0, 0.0, 0.0]]
        model.add(rectangle(-5, -1, 10, 1), held=True)
        # a positive angle: the block stands on its left lower corner, at the origin
        block = model.add(turn(rectangle(0, 0, 2 * b, 2 * h), np.degrees(theta)))
        model.measure(*turn([(b, h)], np.degrees(theta))[0], block)
        truth = np.arccosh(1 / (1 - share)) / p if share < 1 else np.nan
        case = f"block 1 × 4 m leaned at {share:g} of its balance, g0 {g0:.0e}, {1000 * dt:g} ms"
        try:
            results = model.run()
        except Failed as failure:
            found.append(Row("rocking", case, "first impact", str(failure)[:80], False))
            continue
        angle = theta + results.rotation[:, 0]
        if share > 1:
            met = bool(angle[-1] > theta)
            found.append(Row("rocking", case, "overturns", f"{np.degrees(angle[-1]):.1f}° after 2 s", met))
            continue
        hit = int(np.argmax(angle < 0))
        t = float(results.time[hit])
        found.append(
            Row(
                "rocking",
                case,
                f"first impact at {truth:.3f} s ± 2 %",
                f"{t:.3f} s",
                bool(hit > 0 and abs(t / truth - 1) <= 0.02),
            )
        )
    return found


def pendulum_rows(quick: bool = False) -> list[Row]:
    """Amplitude after 100 s."""
    found = []
    time = 20.0 if quick else 100.0
    for link in ("pin", "bolt"):
        for start in (30.0, 90.0):
            case = f"square hung by a corner ({link}), {start:g}°, {time:g} s, 10, 5, 2, 1 ms"
            truth = "amplitude 1 (never above 1.001), no energy above the start's by 1e-3"
            try:
                values = [swing(start, dt, time, link) for dt in (0.01, 0.005, 0.002, 0.001)]
            except Failed as failure:
                found.append(Row("T22", case, truth, str(failure)[:100], False))
                continue
            gain, loss = max(v[1] for v in values), [v[2] for v in values]
            result = "amplitude " + ", ".join(f"{v[0]:.4f}" for v in values) + "; " if link == "pin" else ""
            result += f"gain {gain:.1e}; loss " + ", ".join(f"{v:.1e}" for v in loss)
            met = gain <= 1e-3 and all(0.99 <= v[0] <= 1.001 for v in values)
            found.append(Row("T22", case, truth, result, bool(met)))
    return found


def rows(quick: bool = False) -> list[Row]:
    """Pendulums, rocking."""
    return [*rocking_rows(), *pendulum_rows(quick)]
