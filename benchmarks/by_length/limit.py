# SPDX-License-Identifier: MIT
"""Limit loads of dry-stone walls by linear programming: associated friction, and sliding without dilation.

Associated limit analysis lets joints dilate as they slide and is an upper bound on the load of Coulomb friction.
Without dilation a mechanism is enough: where joints slide the shear force is the friction, where they open the force is
zero at that end, and equilibrium gives the load (the least one, where the rest is undetermined).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from .model import Point

#: a joint opens or slides when it does so faster than this share of the fastest block
MOVES = 0.02
Box = tuple[float, float, float, float]  # x, y, width, height
Joint = tuple[int, int, Point, Point, Point, Point]  # lower and upper block, ends, normal and tangent


class Wall:
    """Blocks in courses, pushed in -x by a share of their weight; the first block is the ground."""

    def __init__(self, boxes: Sequence[Box], friction: float) -> None:
        self.friction = friction
        self.joints = [
            joint for (i, a), (j, b) in itertools.permutations(enumerate(boxes), 2) for joint in _between(i, a, j, b)
        ]
        n = len(boxes) - 1
        self.equilibrium = np.zeros((3 * n, 3 * len(self.joints)))  # forces at both ends, shear force
        self.dead, self.live = np.zeros(3 * n), np.zeros(3 * n)
        area = boxes[1][2] * boxes[1][3]
        for k, (_, _, width, height) in enumerate(boxes[1:]):
            self.dead[3 * k + 1] = -width * height / area
            self.live[3 * k] = -width * height / area
        for k, (lower, upper, p, q, normal, tangent) in enumerate(self.joints):
            for body, sign in ((upper, 1), (lower, -1)):
                if body == 0:
                    continue
                x, y, width, height = boxes[body]
                centre = np.array([x + width / 2, y + height / 2])
                row = 3 * (body - 1)
                for column, (point, along) in enumerate(((p, normal), (q, normal), (p, tangent))):
                    arm, force = np.subtract(point, centre), np.multiply(along, sign)
                    self.equilibrium[row : row + 2, 3 * k + column] += force
                    self.equilibrium[row + 2, 3 * k + column] += arm[0] * force[1] - arm[1] * force[0]

    def associated(self) -> float:
        """Limit load of joints that dilate by the friction angle."""
        return self._load(-1.0, np.zeros((0, 3 * len(self.joints))), [np.inf] * 3 * len(self.joints))

    def without_dilation(self, velocity: np.ndarray) -> float:
        """Least load of the mechanism with these velocities of the blocks but the ground: (blocks, x y rotation)."""
        rates = self.equilibrium.T @ velocity.reshape(-1)
        limit = MOVES * np.abs(velocity[:, :2]).max()
        slides = []
        most = [np.inf] * 3 * len(self.joints)
        for k in range(len(self.joints)):
            opens = [rates[3 * k + end] > limit for end in (0, 1)]
            for end in (0, 1):
                if opens[end]:
                    most[3 * k + end] = 0.0
            if abs(rates[3 * k + 2]) > limit and not all(opens):
                row = np.zeros(3 * len(self.joints))
                row[3 * k : 3 * k + 3] = self.friction, self.friction, np.sign(rates[3 * k + 2])
                slides.append(row)
        return self._load(1.0, np.array(slides).reshape(-1, 3 * len(self.joints)), most)

    def _load(self, sign: float, slides: np.ndarray, most: Sequence[float]) -> float:
        n = len(self.joints)
        bounds = [(None if k % 3 == 2 else 0.0, None if np.isinf(most[k]) else most[k]) for k in range(3 * n)]
        limits = np.zeros((2 * n, 3 * n + 1))
        for k, turn in itertools.product(range(n), (0, 1)):
            limits[2 * k + turn, 3 * k : 3 * k + 3] = -self.friction, -self.friction, 1 - 2 * turn
        equal = np.vstack(
            [
                np.hstack([self.equilibrium, self.live[:, None]]),
                np.hstack([slides, np.zeros((len(slides), 1))]),
            ]
        )
        found = linprog(
            np.r_[np.zeros(3 * n), sign],
            limits,
            np.zeros(2 * n),
            equal,
            np.r_[-self.dead, np.zeros(len(slides))],
            [*bounds, (0.0, None)],
            method="highs",
        )
        return float(found.x[-1]) if found.status == 0 else float("nan")


def _between(i: int, a: Box, j: int, b: Box) -> list[Joint]:
    """The joint of block i below, or to the left of, block j."""
    found: list[Joint] = []
    if abs(a[1] + a[3] - b[1]) < 1e-9:
        low, high = max(a[0], b[0]), min(a[0] + a[2], b[0] + b[2])
        if high - low > 1e-6:
            found.append((i, j, (low, b[1]), (high, b[1]), (0.0, 1.0), (1.0, 0.0)))
    if abs(a[0] + a[2] - b[0]) < 1e-9:
        low, high = max(a[1], b[1]), min(a[1] + a[3], b[1] + b[3])
        if high - low > 1e-6:
            found.append((i, j, (b[0], low), (b[0], high), (1.0, 0.0), (0.0, 1.0)))
    return found
