# SPDX-License-Identifier: MIT
"""A block slides over the joints of its base (T20, T21), over chamfers and steps of no more than e0."""

from __future__ import annotations

import itertools
import random

import numpy as np

from .model import Failed, G, Model, Point, Row, material, rectangle, turn

WIDTH = 20.0


def seat(tops: list[tuple[Point, Point]], left: float, width: float) -> tuple[float, float]:
    """Height of the left end and inclination [°] of an edge that lies on the tops of base blocks, under its middle.

    tops: the upper edges of the base blocks from left to right.
    """
    points = []
    for (x1, y1), (x2, y2) in tops:
        for x in (x1, left, left + width, x2):
            if max(x1, left) <= x <= min(x2, left + width):
                points.append((x, y1 + (y2 - y1) * (x - x1) / (x2 - x1)))
    middle = left + width / 2
    # the highest line through a point on each side: the edge of their upper hull above the middle
    lines = [(a, b) for a in points for b in points if a[0] <= middle < b[0]]
    (x1, y1), (x2, y2) = max(lines, key=lambda line: np.interp(middle, *zip(*line, strict=True)))
    rise = (y2 - y1) / (x2 - x1)
    return float(y1 + rise * (left - x1)), float(np.degrees(np.arctan(rise)))


def slide(
    n: int,
    g0: float,
    dt: float,
    slope: float,
    chamfer: float = 0.0,
    step: float = 0.0,
    seed: int = 0,
    width: float = 2.0,
) -> tuple[float, float, float]:
    """Distance and last speed along a base of n blocks, and the time; on the level with 1 m/s and no friction.

    The block lies on its base at the start. One that is put 0.1 to 1 mm above it would fall and bounce at its corners
    while it hardly slides: friction then lags, once and for all, by some 0.02 m/s (1 to 2 % of the distance).
    """
    draw = random.Random(seed)
    level = slope == 0
    model = Model(dt=dt, g0=g0, g2=0.02, steps=round((3.0 if level else 1.5) / dt))
    model.materials = [material(modulus=1e9, velocity=(1, 0, 0) if level else (0, 0, 0)), material(modulus=1e9)]
    model.joints = [[0.0 if level else 20.0, 0.0, 0.0]]
    tops: list[tuple[Point, Point]] = []
    for i in range(n):
        left, right = -WIDTH / 2 + WIDTH * i / n, -WIDTH / 2 + WIDTH * (i + 1) / n
        h = -draw.uniform(0, step)
        a, b = draw.uniform(0, chamfer), draw.uniform(0, chamfer)
        points = [(left, -1.0), (right, -1.0)]
        points += [(right, h - b), (right - b, h)] if chamfer else [(right, h)]
        points += [(left + a, h), (left, h - a)] if chamfer else [(left, h)]
        tops.append(((left + a, h), (right - b, h)))
        model.add(turn(points, slope), 2, held=True)
    x = -6.03 if level else 3.03
    height, tilt = seat(tops, x, width)
    block = model.add(turn(turn(rectangle(x, height, width, 1.0), tilt, (x, height)), slope))
    model.measure(*turn([(x + width / 2, 0.5)], slope)[0], block)
    results = model.run()
    moved = results.measured[:, 0]
    along = moved @ np.array([np.cos(np.radians(slope)), np.sin(np.radians(slope))]) * (1 if level else -1)
    speed = (along[-1] - along[-11]) / (results.time[-1] - results.time[-11])
    return float(along[-1]), float(speed), float(results.time[-1])


def travel(slope: float = 30.0, friction: float = 20.0, time: float = 1.5) -> float:
    """Closed form of the distance."""
    a, phi = np.radians(slope), np.radians(friction)
    return float(0.5 * G * (np.sin(a) - np.cos(a) * np.tan(phi)) * time**2)


def elastic_travel(joint: float, time: float = 1.5, steps: int = 400_000) -> float:
    """Travel of a rigid block 2 x 1 on the three springs of an interval, the weight put on at once.

    joint: normal stiffness per length; shear springs are 2.5 times softer, each slips at its own friction.
    """
    width, height, density, mu = 2.0, 1.0, 2500.0, np.tan(np.radians(20.0))
    along, across = G * np.sin(np.radians(30.0)), G * np.cos(np.radians(30.0))
    mass = density * width * height
    inertia = mass * (width**2 + height**2) / 12
    places = (-width / 2, 0.0, width / 2)
    stiffness = [joint * width / 6, joint * width * 2 / 3, joint * width / 6]
    dt = time / steps
    x = y = turned = vx = vy = spin = 0.0
    stretch = [0.0, 0.0, 0.0]
    for _ in range(steps):
        normal = shear = moment = 0.0
        slip = (vx + 0.5 * height * spin) * dt
        for i in range(3):
            force = -stiffness[i] * (y + turned * places[i])
            if force <= 0:
                stretch[i] = 0.0
                continue
            most = mu * force / (stiffness[i] / 2.5)
            stretch[i] = min(most, max(-most, stretch[i] + slip))
            normal += force
            moment += force * places[i]
            shear += stiffness[i] / 2.5 * stretch[i]
        vx += (along - shear / mass) * dt
        vy += (normal / mass - across) * dt
        spin += (moment - 0.5 * height * shear) / inertia * dt
        x, y, turned = x + vx * dt, y + vy * dt, turned + spin * dt
    return float(x)


def rows(quick: bool = False) -> list[Row]:
    """Every number of base blocks, stiffness and step."""
    found = []
    numbers = (1, 3, 10) if quick else (1, 2, 3, 4, 7, 10, 20, 40)
    stiffnesses = (1e8, 1e11) if quick else (1e8, 1e9, 1e10, 1e11)
    steps = (0.002,) if quick else (0.001, 0.002, 0.005)
    bases = [("flat", 0.0, 0.0), ("chamfers", 1e-3, 0.0), ("steps", 0.0, 1e-3), ("chamfers and steps", 1e-3, 1e-3)]
    for (name, chamfer, step), (slope, truth, limit), g0 in itertools.product(
        bases, ((30.0, travel(), 0.005), (0.0, 1.0, 0.01)), stiffnesses
    ):
        worst, where, n_bad, failures, total = 0.0, "", 0, 0, 0
        for n, dt in itertools.product(numbers, steps):
            if name != "flat" and (n == 1 or dt == 0.001):
                continue
            total += 1
            try:
                distance, speed, time = slide(n, g0, dt, slope, chamfer, step, seed=n)
            except Failed:
                failures += 1
                continue
            # a step that was cut makes the run shorter
            error = (distance / travel(time=time) if slope else speed) - 1
            n_bad += abs(error) > limit
            if abs(error) >= abs(worst):
                worst, where = error, f"n {n}, {1000 * dt:g} ms"
        case = f"{name}, g0 {g0:.0e}, n 1 … 40, 1 … 5 ms" + ("" if slope else ", level, no friction")
        outside = f"; {n_bad + failures} of {total} outside" if n_bad + failures else ""
        result = f"worst {100 * worst:+.2f} % ({where}){outside}"
        want = f"{truth:.4f} m ± 0.5 %" if slope else "1 m/s ± 1 %"
        found.append(Row("T20" if slope else "T21", case, want, result, n_bad + failures == 0))
    # what the springs of the joint alone make of it: a mean edge is 6 m long with one base block
    for g0 in (1e8,) if quick else (1e8, 1e9):
        own = elastic_travel(g0 / 6)
        case = f"flat, g0 {g0:.0e}, n 1, 1 ms, against a rigid block on the springs of its joint"
        try:
            error = slide(1, g0, 0.001, 30.0)[0] / own - 1
        except Failed as failure:
            found.append(Row("T20", case, f"{own:.4f} m ± 0.3 %", str(failure)[:100], False))
            continue
        want = f"{own:.4f} m ± 0.3 %"
        found.append(Row("T20", case, want, f"{100 * error:+.2f} %", bool(abs(error) <= 0.003)))
    return found
