# SPDX-License-Identifier: MIT
"""A row of blocks between abutments: the model, and its equilibrium without DDA.

The equilibrium is that of uniformly strained blocks with springs at both ends of every joint, without tension and with
Coulomb friction: small motions, no inertia, no search for contacts, and loads that grow in small increments. At every
increment Newton's method solves for the motion at which each contact force obeys its law, shear forces by return
mapping from those of the increment before. `motion` does the same with inertia, in time steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from rockdda.model import Model

from .case import published
from .vibration import block_mass

__all__ = ["GRAVITY", "BlockRow", "State", "centrifuge_beam"]

FloatArray = npt.NDArray[np.float64]
GRAVITY = 9.81
SHEAR_RATIO, SUPPORT = 2.5, 100.0  # normal over shear stiffness; fixed points over contacts: defaults of the program
DATA = published("chapter5")["centrifuge_beam"]
OPEN, SLIDING, LOCKED = 0, 1, 2


@dataclass(frozen=True)
class State:
    """Of the row under some load; joints from left to right, of each the lower contact first."""

    level: float  #: of gravity, in g
    motion: FloatArray  #: (6 blocks) unknowns
    normal: FloatArray  #: (2 joints,), compression positive
    shear: FloatArray
    contact: npt.NDArray[np.int64]  #: OPEN, SLIDING, LOCKED


class BlockRow:
    """Cubes of the centrifuge beam between two abutments three times as high, each held at three points."""

    def __init__(self, stiffness: float = DATA["contact_stiffness"]) -> None:
        self.size, self.count = DATA["block_edge"], DATA["blocks"]
        self.density, self.friction = DATA["density"], math.tan(math.radians(DATA["friction_angle"]))
        self.half = self.count * self.size / 2
        self.normal, self.tangential, self.support = stiffness, stiffness / SHEAR_RATIO, SUPPORT * stiffness
        size = self.size
        places = np.linspace(-self.half - size / 2, self.half + size / 2, self.count + 2)
        self.centroids = np.column_stack([places, np.full(self.count + 2, size / 2)])
        heights = np.full(self.count + 2, size)
        heights[[0, -1]] = 3 * size
        self.areas = size * heights
        nu = DATA["poisson_ratio"]
        self.elastic = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]) * DATA["youngs_modulus"] / (1 - nu**2)
        n = 6 * (self.count + 2)
        self.stiffness, self.mass = np.zeros((n, n)), np.zeros((n, n))
        for i, (area, height) in enumerate(zip(self.areas, heights, strict=True)):
            block = slice(6 * i, 6 * i + 6)
            self.mass[block, block] = block_mass(self.density, size, height)
            self.stiffness[block, block][3:, 3:] = area * self.elastic
        self.fixed = [(side, x * side, y) for side in (-1, 1) for x, y in self.fixed_points()]
        for side, x, y in self.fixed:
            move = self.displacement(0 if side < 0 else self.count + 1, x, y)
            self.stiffness += self.support * move.T @ move
        joints = np.linspace(-self.half, self.half, self.count + 1)
        self.openings = np.array(  # (contacts, 2, n): gap and slip for a motion
            [
                self.displacement(j + 1, x, y) - self.displacement(j, x, y)
                for j, x in enumerate(joints.tolist())
                for y in (0.0, size)
            ]
        )

    @property
    def weight(self) -> float:
        """Of the beam at 1 g."""
        return self.density * GRAVITY * self.count * self.size**2

    def fixed_points(self) -> list[tuple[float, float]]:
        """Of the right abutment."""
        return [(self.half, -self.size), (self.half, 2 * self.size), (self.half + self.size, self.size / 2)]

    def displacement(self, block: int, x: float, y: float) -> FloatArray:
        """(2, n) that gives the displacement of a point from the motion of all blocks."""
        move = np.zeros((2, 6 * (self.count + 2)))
        a, b = x - self.centroids[block, 0], y - self.centroids[block, 1]
        move[:, 6 * block : 6 * block + 6] = [[1, 0, -b, a, 0, b / 2], [0, 1, a, 0, b, a / 2]]
        return move

    def measured(self) -> list[tuple[int, float, float]]:
        """Block, x, y of twelve points at mid-height, two in each block, symmetric about mid-span."""
        return [
            (i + 1, -self.half + (i + share) * self.size, self.size / 2)
            for i in range(self.count)
            for share in (0.25, 0.75)
        ]

    def load(self, level: float, push: float) -> FloatArray:
        """Of gravity and of the abutments, each pushed inwards by `push`."""
        load = np.zeros(6 * (self.count + 2))
        load[1::6] = -self.density * GRAVITY * level * self.areas
        for side, x, y in self.fixed:
            move = self.displacement(0 if side < 0 else self.count + 1, x, y)
            load += self.support * move.T @ np.array([-side * push, 0.0])
        return load

    def path(self, push: float, levels: int, increments: int = 20) -> list[State]:
        """Equilibrium after prestressing, and at 1 g, 2 g, … reached in `increments` each."""
        loads = [(0.0, push * (i + 1) / increments) for i in range(increments)]
        loads += [((i + 1) / increments, push) for i in range(increments * levels)]
        state, out = self._start(), []
        for i, (level, pushed) in enumerate(loads, 1):
            state = self._equilibrium(state, level, self.load(level, pushed))
            if i % increments == 0:
                out.append(state)
        return out

    def motion(self, push: float, before: int, per_level: int, levels: int, time_step: float) -> list[State]:
        """What `path` gives, in time steps: the abutments are pushed inwards within 0.02 s, `before` steps start from
        rest, then k01 = 1 and gravity grows by 1 g at once every `per_level` steps.

        Newmark's method with β = ½, γ = 1: M (2/Δt²)(x1 - x0 - v0 Δt) is in equilibrium with the forces at x1.
        """
        inertia = 2 / time_step**2 * self.mass
        state, speed, out = self._start(), np.zeros(len(self.mass)), []
        for step in range(1, before + per_level * levels + 1):
            level = max(0, (step - before - 1) // per_level + 1)
            load = self.load(level, push * min(1.0, step * time_step / 0.02))
            earlier = state.motion
            load += inertia @ (earlier + speed * time_step)
            state = self._equilibrium(state, level, load, inertia)
            speed = 2 / time_step * (state.motion - earlier) - speed if step > before else 0 * speed
            if step >= before and (step - before) % per_level == 0:
                out.append(state)
        return out

    def _start(self) -> State:
        return State(0.0, np.zeros(len(self.mass)), *np.zeros((2, len(self.openings))), np.zeros(0, dtype=int))

    def _equilibrium(self, before: State, level: float, load: FloatArray, inertia: FloatArray | float = 0.0) -> State:
        motion = before.motion
        scale = np.abs(load).max()
        held = self.stiffness + inertia
        gaps, slips = self.openings[:, 0], self.openings[:, 1]
        for _ in range(100):
            opened = gaps @ motion > 0  # contacts that just touch count as closed
            normal = np.where(opened, 0, -self.normal * (gaps @ motion))
            shear = before.shear + self.tangential * (slips @ (motion - before.motion))
            limit = self.friction * normal
            contact = np.where(opened, OPEN, np.where(np.abs(shear) > limit, SLIDING, LOCKED))
            shear = np.clip(shear, -limit, limit)
            rest = held @ motion - load - normal @ gaps + shear @ slips
            if np.abs(rest).max() <= 1e-10 * scale:
                return State(level, motion, normal, shear, contact)
            slope = held.copy()
            closed, locked, sliding = contact != OPEN, contact == LOCKED, contact == SLIDING
            slope += self.normal * gaps[closed].T @ gaps[closed]
            slope += self.tangential * slips[locked].T @ slips[locked]
            ratio = self.friction * np.sign(shear[sliding])
            slope -= self.normal * (ratio[:, None] * slips[sliding]).T @ gaps[sliding]
            motion = motion - np.linalg.solve(slope, rest)
        raise ArithmeticError(f"no equilibrium found at {level} g")

    def bonded(self) -> FloatArray:
        """Stiffness with all contacts locked."""
        gaps, slips = self.openings[:, 0], self.openings[:, 1]
        return self.stiffness + self.normal * gaps.T @ gaps + self.tangential * slips.T @ slips

    def push_for(self, thrust: float) -> float:
        """Inward displacement of each abutment for a thrust without gravity."""
        push = 1e-4 * self.size
        return push * thrust / self.path(push, 0)[-1].normal[:2].sum()

    def points(self, state: State) -> FloatArray:
        """(12, 2) displacements of the measured points."""
        return np.array([self.displacement(*place) @ state.motion for place in self.measured()])

    def stresses(self, state: State) -> FloatArray:
        """(blocks, 3) of the beam's blocks."""
        return state.motion.reshape(-1, 6)[1:-1, 3:] @ self.elastic

    def thrust(self, state: State) -> float:
        """At the abutments."""
        return float(state.normal[:2].sum())


def centrifuge_beam(
    row: BlockRow, *, push: float, stages: list[dict[str, Any]], time_step: float | None = None, bonded: bool = False
) -> Model:
    """The row as a model: abutments are pushed inwards within 0.02 s; the last stage says when the run ends."""
    model = Model(
        "centrifuge_beam",
        e0=1e-4,
        k01=DATA["k01"],
        steps=stages[-1]["until_step"],
        dt_max=DATA["time_step"] if time_step is None else time_step,
        displacement_ratio=DATA["displacement_ratio"],
        stiffness=row.normal,
    )
    size, half = row.size, row.half
    for side in (-1, 1):
        corners = [(half, -size), (half + size, -size), (half + size, 2 * size), (half, 2 * size)]
        model.add_polygon([(side * x, y) for x, y in corners])
        for x, y in row.fixed_points():
            model.add_fixed((side * x, y), table=[(0, 0, 0), (0.02, -side * push, 0)] if push else ())
    for y in (0, size):
        model.add_line((-half, y), (half, y), boundary=True)
    for x in np.linspace(-half, half, row.count + 1)[1:-1].tolist():
        model.add_line((x, 0), (x, size))
    for _, x, y in row.measured():
        model.add_measured((x, y))
    model.add_block_material(
        density=row.density,
        gravity=GRAVITY,
        youngs_modulus=DATA["youngs_modulus"],
        poisson_ratio=DATA["poisson_ratio"],
    )
    strength = 1e9 if bonded else 0.0
    model.add_joint_material(friction_angle=DATA["friction_angle"], cohesion=strength, tension=strength)
    model.options["stage"] = stages
    return model
