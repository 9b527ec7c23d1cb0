# SPDX-License-Identifier: MIT
"""Walls and arches pushed by a share of their weight (T4, T5, T6), tilted stacks (T7)."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from .limit import Box, Wall
from .model import Failed, G, Model, Row, material, rectangle

H = 0.175  # height of a course
W = 0.4  # width of a whole block
FRICTION = 0.65
MOVES = 2e-3  # in the last second: more than the creep of what stands
DAMPED = "&block_damping mass_proportional = 5 /\n"  # [1/s] no swinging by the weight and the push


def ramp(alpha: float) -> list[tuple[float, float, float]]:
    """Weight alone for 0.3 s, then the push, which is full after 1.3 s."""
    return [(0, 0, 0), (0.3, 0, 0), (1.3, alpha * G, 0), (1e3, alpha * G, 0)]


def late(model: Model) -> float:
    """Largest movement of a block in the last second."""
    model.save_every = round(0.5 / model.dt)
    results = model.run()
    before = int(np.argmax(results.frame_time >= results.frame_time[-1] - 1.0 - 1e-9))
    return float(np.linalg.norm(results.centroid[-1] - results.centroid[before], axis=1).max())


def boxes(courses: list[str]) -> list[Box]:
    """The ground, and the blocks of a wall: of a course w is a whole block, h half of one, o an opening."""
    found: list[Box] = [(-1.0, -0.5, 6.0, 0.5)]
    for row, course in enumerate(courses):
        x = 0.0
        for letter in course:
            width = W / 2 if letter == "h" else W
            if letter != "o":
                found.append((x, H * row, width, H))
            x += width
    return found


def wall_model(courses: list[str], alpha: float, dt: float, g0: float, time: float = 3.5) -> Model:
    """A wall that is pushed."""
    model = Model(
        dt=dt, steps=round(time / dt), g0=g0, g2=0.02, materials=[material(density=2000, modulus=1e10, nu=0.2)]
    )
    model.joints = [[float(np.degrees(np.arctan(FRICTION))), 0.0, 0.0]]
    model.base = ramp(alpha)
    model.options = DAMPED
    for number, box in enumerate(boxes(courses)):
        model.add(rectangle(*box), held=number == 0)
    return model


def wall(courses: list[str], alpha: float, dt: float, g0: float) -> float:
    """Largest movement in the last second of a wall."""
    return late(wall_model(courses, alpha, dt, g0))


def load_without_dilation(courses: list[str], alpha: float, dt: float, g0: float) -> float:
    """Load of the mechanism by which a wall moves under more than its limit load, without dilation."""
    model = wall_model(courses, alpha, dt, g0)
    model.save_every = round(0.1 / dt)
    results = model.run()
    moved = np.linalg.norm(results.centroid - results.centroid[0], axis=2).max(axis=1)
    first = int(np.argmax(moved > 2 * MOVES))
    return Wall(boxes(courses), FRICTION).without_dilation(results.velocity[first, 1:, :3])


WALL_1 = ["hwwwwh", "wwwww"] * 3
WALL_3 = ["wwww", "hwwwh", "wwww", "hwowh", "whohw", "hwowh", "whohw", "hwowh", "wwww", "hwwwh", "wwww"]


def arch(alpha: float, n: int, dt: float, g0: float, time: float = 3.5) -> float:
    """Largest movement in the last second of an arch of n voussoirs between fixed springers."""
    model = Model(dt=dt, steps=round(time / dt), g0=g0, g2=0.02, materials=[material(modulus=5e10, nu=0.0)])
    model.joints = [[80.0, 0.0, 0.0]]
    model.base = ramp(alpha)
    model.options = DAMPED
    inner, outer = 10 - 0.75, 10 + 0.75
    start = np.radians(90 - 157.5 / 2)
    step = np.radians(157.5) / n

    def at(radius: float, angle: float) -> tuple[float, float]:
        return float(radius * np.cos(angle)), float(radius * np.sin(angle))

    for i in range(n):
        a, b = start + i * step, start + (i + 1) * step
        model.add([at(inner, a), at(outer, a), at(outer, b), at(inner, b)])
    for side in (0, 1):
        angle = start if side == 0 else start + n * step
        turn_by = -0.1 if side == 0 else 0.1
        points = [at(inner - 0.3, angle), at(outer + 0.3, angle), at(outer + 0.3, angle + turn_by)]
        points.append(at(inner - 0.3, angle + turn_by))
        model.add(points if side == 1 else points[::-1], held=True)
    return late(model)


def tilted(n: int, b: float, h: float, theta: float, phi: float, dt: float, g0: float) -> float:
    """Largest movement of a stack of n blocks when weight acts at an angle to the normal of its base."""
    model = Model(dt=dt, steps=round(1.0 / dt), g0=g0, g2=0.02)
    model.materials = [material(modulus=1e10, gravity=G * np.cos(theta))]
    model.joints = [[phi, 0.0, 0.0]]
    model.base = [(0, G * np.sin(theta), 0), (1e3, G * np.sin(theta), 0)]
    model.add(rectangle(-5, -1, 10, 1), held=True)
    for i in range(n):
        model.add(rectangle(-b / 2, i * h, b, h))
    results = model.run()
    return float(np.linalg.norm(results.centroid[-1] - results.centroid[0], axis=1).max())


def critical(
    moves: Callable[[float], float],
    truth: float,
    limit: float,
    low: float = 0.85,
    high: float = 1.15,
    halvings: int = 6,
) -> float:
    """Load over its truth at which the movement passes the limit, by bisection."""
    if moves(low * truth) > limit:
        return low
    if moves(high * truth) <= limit:
        return high
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        if moves(middle * truth) > limit:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def rows(quick: bool = False) -> list[Row]:
    """Collapse loads over limit analysis."""
    found = []
    halvings = 4 if quick else 6
    stiffness = (1e10,) if quick else (1e9, 1e10, 1e11)
    for (name, topic, truth, run, limit), (g0, dt) in itertools.product(
        (
            ("wall of 6 courses (0.64286)", "T4", 0.64286, lambda a, g0, dt: wall(WALL_1, a, dt, g0), MOVES),
            ("wall with an opening (0.40369)", "T5", 0.40369, lambda a, g0, dt: wall(WALL_3, a, dt, g0), MOVES),
            ("arch of 7 voussoirs (0.3736)", "T6", 0.3736, lambda a, g0, dt: arch(a, 7, dt, g0), MOVES),
            ("arch of 28 voussoirs (0.3549)", "T6", 0.3549, lambda a, g0, dt: arch(a, 28, dt, g0), MOVES),
        ),
        itertools.product(stiffness, (0.002,)),
    ):
        try:
            value = critical(lambda a, run=run, g0=g0, dt=dt: run(a, g0, dt), truth, limit, halvings=halvings)
            result, met = f"{value:.3f} of it", bool(0.94 <= value <= 1.01)
        except Failed as failure:
            result, met = str(failure)[:100], False
        found.append(Row(topic, f"{name}, g0 {g0:.0e}, {1000 * dt:g} ms", "0.94 … 1.01 of it", result, met))
        if topic == "T5" and "of it" in result:
            own = load_without_dilation(WALL_3, 1.03 * value * truth, dt, g0)
            if not np.isfinite(own):  # soft joints: no mechanism of rigid blocks moves as the wall does
                continue
            found.append(
                Row(
                    topic,
                    f"the same against the load of its own mechanism without dilation, {own:.5f}",
                    "0.98 … 1.01 of it",
                    f"{value * truth / own:.3f} of it",
                    bool(0.98 <= value * truth / own <= 1.01),
                )
            )
    for n, b, h in ((1, 1.0, 2.0), (3, 1.0, 1.0), (8, 1.0, 0.5)):
        truth = float(np.arctan(b / (n * h)))
        try:
            value = critical(
                lambda a, n=n, b=b, h=h: tilted(n, b, h, a, 60.0, 0.002, 1e10), truth, 0.05, halvings=halvings
            )
            result, met = f"{value:.3f} of it", bool(abs(value - 1) <= 0.02)
        except Failed as failure:
            result, met = str(failure)[:100], False
        found.append(
            Row("T7", f"stack of {n}, {b:g} × {h:g} m, turned", f"{np.degrees(truth):.2f}° ± 2 %", result, met)
        )
    return found
