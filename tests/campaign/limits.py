# SPDX-License-Identifier: MIT
"""Rigid-block limit analysis by linear programmes, from the outlines alone.

Unknown are the forces at both ends of every length on which two blocks touch: pressure there, and the shear of the
length. Every block that is not held is in equilibrium under its dead load and a multiple of its live load, the shear is
at most the friction times the pressure (static theorem: with an associated flow rule the largest multiple is exact, and
an upper bound without dilation; where the forces follow from statics, as in a stack, or nothing slides, it is exact as
well). Walls in bond may fall far below it: blocks that lift each other off carry no friction.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import lil_matrix

from .bench import Points, area_of, centroid_of


@dataclass(frozen=True)
class Touch:
    """A length on which two blocks touch; the tangent runs along the edge of the first one."""

    first: int
    second: int
    ends: Points
    friction: float


def touches(blocks: list[Points], friction: float, tolerance: float = 1e-9) -> list[Touch]:
    """All lengths on which edges of two blocks lie on each other."""
    found = []
    for i, j in itertools.combinations(range(len(blocks)), 2):
        for a, b in zip(blocks[i], np.roll(blocks[i], -1, axis=0), strict=True):
            length = float(np.hypot(*(b - a)))
            t = (b - a) / length
            n = np.array([-t[1], t[0]])
            for c, d in zip(blocks[j], np.roll(blocks[j], -1, axis=0), strict=True):
                if np.dot(d - c, t) >= 0 or max(abs(np.dot(c - a, n)), abs(np.dot(d - a, n))) > tolerance * length:
                    continue
                low, high = max(0.0, float(np.dot(d - a, t))), min(length, float(np.dot(c - a, t)))
                if high - low > 1e-6 * length:
                    found.append(Touch(i, j, np.array([a + low * t, a + high * t]), friction))
    return found


class Programme:
    """The linear programme of a set of blocks."""

    def __init__(self, blocks: list[Points], held: set[int], contacts: list[Touch]) -> None:
        self.contacts = contacts
        self.free = [number for number in range(len(blocks)) if number not in held]
        self.areas = np.array([area_of(blocks[number]) for number in self.free])
        row = {number: 3 * k for k, number in enumerate(self.free)}
        self.equilibrium = lil_matrix((3 * len(self.free), 3 * len(contacts)))
        for k, touch in enumerate(contacts):
            t = (touch.ends[1] - touch.ends[0]) / np.hypot(*(touch.ends[1] - touch.ends[0]))
            inward = np.array([-t[1], t[0]])  # into the first block, whose corners run counter-clockwise
            for number, sign in ((touch.first, 1.0), (touch.second, -1.0)):
                if number not in row:
                    continue
                middle = centroid_of(blocks[number])
                for column, (place, force) in enumerate(
                    ((touch.ends[0], inward), (touch.ends[1], inward), (touch.ends.mean(0), t))
                ):
                    arm = place - middle
                    at = row[number]
                    self.equilibrium[at, 3 * k + column] = sign * force[0]
                    self.equilibrium[at + 1, 3 * k + column] = sign * force[1]
                    self.equilibrium[at + 2, 3 * k + column] = sign * (arm[0] * force[1] - arm[1] * force[0])

    def multiple(self, dead: tuple[float, float], live: tuple[float, float]) -> float:
        """Largest multiple of the live load (per weight, as the dead one); -1 where not even the dead load stands."""
        count = len(self.contacts)
        forces = 3 * count
        loads = np.zeros((3 * len(self.free), 2))
        for k, area in enumerate(self.areas):
            loads[3 * k : 3 * k + 2, 0] = area * np.array(live)
            loads[3 * k : 3 * k + 2, 1] = -area * np.array(dead)
        scale = float(self.areas.max())
        left = lil_matrix((len(loads), forces + 1))
        left[:, :forces] = self.equilibrium
        left[:, forces] = loads[:, :1] / scale
        shear = lil_matrix((2 * count, forces + 1))
        right = np.zeros(2 * count)
        for k, touch in enumerate(self.contacts):
            for sign, at in ((1.0, 2 * k), (-1.0, 2 * k + 1)):
                shear[at, 3 * k + 2] = sign
                shear[at, 3 * k] = shear[at, 3 * k + 1] = -touch.friction
        bounds = ([(0, None), (0, None), (None, None)] * count) + [(0, 1e6)]
        cost = np.zeros(forces + 1)
        cost[-1] = -1
        done = linprog(cost, shear.tocsr(), right, left.tocsr(), loads[:, 1] / scale, bounds=bounds, method="highs")
        if done.status != 0:
            return -1.0
        return float(done.x[-1])


def strength_factor(
    blocks: list[Points], held: set[int], contacts: list[Touch], dead: tuple[float, float] = (0.0, -1.0)
) -> float:
    """Factor by which friction may be divided before not even the dead load stands."""

    def stands(factor: float) -> bool:
        reduced = [Touch(c.first, c.second, c.ends, c.friction / factor) for c in contacts]
        return Programme(blocks, held, reduced).multiple(dead, (0.0, 0.0)) >= 0

    low, high = 0.02, 50.0
    if stands(high):
        return math.inf
    if not stands(low):
        return 0.0
    while high / low > 1.001:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stands(middle) else (low, middle)
    return math.sqrt(low * high)
