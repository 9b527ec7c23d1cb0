# SPDX-License-Identifier: MIT
"""Limit analysis of rigid blocks: an independent truth for factors of safety, by linear programming.

The joint between two blocks is the stretch on which two of their edges face each other. It carries a compressive force
at each of its ends, N1 and N2, and a shear force T along it:

    N1 ≥ 0,  N2 ≥ 0,  |T| ≤ tan φ (N1 + N2) + c l

(no tension, Coulomb friction, cohesion c on the length l; crushing is excluded). Blocks that are not fixed are in
equilibrium under their dead load and α times their live load. By the static theorem of plasticity any such set of
forces gives a lower bound of the collapse factor of an *associated* material, and the largest α is this factor. Coulomb
friction without dilation can fail at a lower α, never at a higher one (Drucker 1954; Ferris & Tin-Loi 2001).

Without dilation the load is found by a row of linear programmes (Gilbert, Casapulla & Ahmed 2006): the limit of each
joint becomes one that does not depend on its normal force, |T| ≤ tan φ N', so that sliding does not dilate, with the
N' of the programmes before; it is found when N' no longer changes the load. Forces of blocks that do not move are not
unique, and such loads need not be: the statics of the mechanism shows whether it is one.

For a known mechanism the load without dilation follows from equilibrium alone: where a joint slides its shear force is
the friction, against the motion; at an end that opens there is no force. The forces of the other joints obey the limits
above, and the least α of all such sets is the load.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from ..arrays import FloatArray, IntArray
from ..errors import InputError, RockddaError, need
from ..namelist import last_value

if TYPE_CHECKING:
    from ..model import Model

__all__ = ["Joint", "LimitLoad", "RigidBlocks", "find_joints"]


PARALLEL = 1e-3  # sine of the angle between edges that face each other
SHORTEST = 1e-6  # share of the shorter edge: shorter stretches are corners that touch
KEPT = 0.6  # share of the normal forces before that the next programme keeps, so that the row does not run in circles
MOST_PROGRAMMES = 100
MOVES = 0.02  # share of the largest displacement: joints that slide or open by less only deform


@dataclass(frozen=True)
class Joint:
    """Where an edge of one block faces an edge of another; the first block lies to the left of start to end."""

    first: int
    second: int
    start: tuple[float, float]
    end: tuple[float, float]
    material: int = 1

    @property
    def length(self) -> float:
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class LimitLoad:
    """The largest factor of the live load, and the mechanism of collapse."""

    factor: float
    #: (nb, 3) velocities u v r of the blocks' centroids in the mechanism (dual variables); the live load has power 1
    velocity: FloatArray


def find_joints(
    polygons: Sequence[FloatArray], edge_joint: Sequence[IntArray] | None = None, distance: float = 0.0
) -> list[Joint]:
    """All stretches on which edges of two blocks face each other, not farther apart than `distance` [length].

    polygons: (m, 2) vertices of each block, counter-clockwise; edge_joint: joint material of the edge that starts at
    each vertex (0: none), by default 1. Two edges of unlike materials make a joint of the larger number, as in the
    program. Corners that only touch make no joint."""
    starts = np.vstack(polygons)
    ends = np.vstack([np.roll(one, -1, axis=0) for one in polygons])
    owner = np.repeat(np.arange(len(polygons)), [len(one) for one in polygons])
    material = np.ones(len(starts), dtype=int) if edge_joint is None else np.concatenate(edge_joint)
    size = float(np.ptp(starts, axis=0).max())
    reach = max(distance, 1e-9 * size)
    segments = shapely.linestrings(np.stack([starts, ends], axis=1))
    near = shapely.STRtree(segments).query(segments, predicate="dwithin", distance=reach)
    joints = []
    for i, j in near.T:
        if owner[i] < owner[j] and material[i] > 0 and material[j] > 0:
            stretch = _facing(starts[i], ends[i], starts[j], ends[j], reach)
            if stretch is not None:
                joints.append(Joint(int(owner[i]), int(owner[j]), *stretch, int(max(material[i], material[j]))))
    return joints


def _facing(
    a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, reach: float
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """The part of the edge a to b that faces the edge c to d of another block, halfway between both."""
    along, other = b - a, d - c
    length, width = float(np.hypot(*along)), float(np.hypot(*other))
    along, other = along / length, other / width
    if float(along @ other) > 0 or abs(float(along[0] * other[1] - along[1] * other[0])) > PARALLEL:
        return None
    normal = np.array([-along[1], along[0]])
    apart = 0.5 * float((c - a) @ normal + (d - a) @ normal)
    low, high = max(0.0, float((d - a) @ along)), min(length, float((c - a) @ along))
    if abs(apart) > reach or high - low < SHORTEST * min(length, width):
        return None
    first, last = (a + s * along + 0.5 * apart * normal for s in (low, high))
    return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))


@dataclass(frozen=True)
class RigidBlocks:
    """Rigid blocks with joints between them, of which some are fixed. Any consistent set of units."""

    polygons: list[FloatArray]
    weight: FloatArray  #: (nb,) of each block [force]
    fixed: frozenset[int]
    joints: list[Joint]
    friction: dict[int, float]  #: friction angle of each joint material [deg]
    cohesion: dict[int, float] = field(default_factory=dict)  #: of joint materials [force/length²], default 0
    #: (nb, 3) further dead load on each block: force x, y and moment about its centroid, for example by water
    load: FloatArray | None = None

    @classmethod
    def from_polygons(
        cls, polygons: Sequence[npt.ArrayLike], fixed: Collection[int], *, friction: float, cohesion: float = 0.0,
        unit_weight: float = 1.0,
    ) -> RigidBlocks:  # fmt: skip
        """Blocks of one material, from their outlines; `fixed` are the numbers of those that do not move."""
        outlines = [one if _area(one) > 0 else one[::-1] for one in (np.asarray(one, dtype=float) for one in polygons)]
        weight = np.array([unit_weight * _area(one) for one in outlines])
        return cls(outlines, weight, frozenset(fixed), find_joints(outlines), {1: friction}, {1: cohesion})

    @classmethod
    def from_model(cls, model: Model) -> RigidBlocks:
        """The blocks that RockDDA cuts of a model; those with fixed points are fixed."""
        blocks = model.cut()
        given = last_value(model.options.get("load", {}), "gravity", model.gravity)
        gravity = math.nan if given is None else float(given)
        unit = [
            material.weight if math.isfinite(material.weight) else material.density * gravity
            for material in model.block_materials
        ]
        weight = np.asarray(blocks.areas) * np.array(unit)[blocks.material - 1]
        if not np.isfinite(weight).all():
            raise InputError("limit analysis needs weights of blocks: neither unit weight nor gravity is given")
        joints = find_joints(blocks.polygons(), np.split(blocks.edge_joint, blocks.vertex_offset[1:-1]), model.e0)
        friction = {i: m.friction_angle for i, m in enumerate(model.joint_materials, start=1)}
        cohesion = {i: m.cohesion for i, m in enumerate(model.joint_materials, start=1)}
        fixed = frozenset(int(i) for i in blocks.fixed_points.block)
        return cls(blocks.polygons(), weight, fixed, joints, friction, cohesion)

    @property
    def free(self) -> list[int]:
        """Blocks that can move."""
        return [i for i in range(len(self.polygons)) if i not in self.fixed]

    def push(self, direction: float = 1.0) -> LimitLoad:
        """Horizontal load α × weight on every block: its largest factor; direction -1 pushes in -x."""
        return self.largest(self._push(direction))

    def push_without_dilation(self, direction: float = 1.0, tolerance: float = 1e-4) -> LimitLoad:
        """The push with Coulomb friction that slides without dilation, to a share `tolerance`, and its mechanism."""
        return self.largest_without_dilation(self._push(direction), tolerance)

    def largest(self, live: npt.ArrayLike) -> LimitLoad:
        """The largest factor of a live load, (nb, 3): force x, y and moment about the centroid of each block."""
        found = self._largest(self._dead(0.0), np.asarray(live, dtype=float), 1.0)
        if found is None:
            raise RockddaError("limit analysis: no equilibrium under the dead load alone")
        return found

    def largest_without_dilation(self, live: npt.ArrayLike, tolerance: float = 1e-4) -> LimitLoad:
        """As `largest`, with Coulomb friction that slides without dilation, to a share `tolerance`."""
        live = np.asarray(live, dtype=float)
        problem = self._problem(self._dead(0.0), live, 1.0)
        entries, most = self._limits(1.0)
        n = 3 * len(self.joints)
        tangents = np.repeat([math.tan(math.radians(self.friction[j.material])) for j in self.joints], 2)
        shear = _sparse([entry for entry in entries if entry[1] % 3 == 2], (len(most), n + 1))
        normal: FloatArray | None = None
        factors: list[float] = []
        for _ in range(MOST_PROGRAMMES):
            found = _solve(problem)
            if found is not None and found.status == 3 and normal is None:  # locked by dilation alone
                found = _solve(self._problem(self._dead(0.0), np.zeros_like(live), 1.0))
            if found is None or found.status != 0:
                raise RockddaError("limit analysis: no load without dilation was found")
            factors.append(float(found.x[-1]))
            if len(factors) > 4 and np.ptp(factors[-4:]) <= tolerance * abs(factors[-1]):
                velocity = np.zeros((len(self.weight), 3))
                velocity[self.free] = -found.eqlin.marginals.reshape(-1, 3) * self._scale
                return LimitLoad(factors[-1], velocity)
            last = found.x[0:n:3] + found.x[1:n:3]
            normal = last if normal is None else KEPT * normal + (1.0 - KEPT) * last
            problem |= {"A_ub": shear, "b_ub": np.array(most) + tangents * np.repeat(normal, 2)}
        raise RockddaError(f"limit analysis: loads without dilation still change: {factors[-4:]}")

    def push_of_mechanism(self, motion: npt.ArrayLike, direction: float = 1.0) -> float:
        """The least push under which the blocks can move like this with Coulomb friction without dilation.

        motion: (nb, 3) displacements u v r of the centroids, or velocities."""
        moved = np.asarray(motion, dtype=float)
        live = self._push(direction)
        n = 3 * len(self.joints)
        least = MOVES * float(np.abs(moved[:, :2]).max())
        rates = self._rates(moved)
        problem = self._problem(self._dead(0.0), live, 1.0)
        problem["c"] = -problem["c"]
        entries: list[tuple[int, int, float]] = []
        slides = 0
        for j, joint in enumerate(self.joints):
            opens = [rates[j, end] > least for end in (0, 1)]
            for end in (0, 1):
                if opens[end]:
                    problem["bounds"][3 * j + end] = (0.0, 0.0)
            if abs(rates[j, 2]) > least and not all(opens):
                tangent = math.tan(math.radians(self.friction[joint.material]))
                entries += [(slides, 3 * j, tangent), (slides, 3 * j + 1, tangent)]
                entries.append((slides, 3 * j + 2, math.copysign(1.0, rates[j, 2])))
                problem["b_eq"] = np.append(
                    problem["b_eq"], -self.cohesion.get(joint.material, 0.0) * joint.length / self._unit
                )
                slides += 1
        if slides:
            from scipy.sparse import vstack

            problem["A_eq"] = vstack([problem["A_eq"], _sparse(entries, (slides, n + 1))], format="csr")
        found = _solve(problem)
        if found is None or found.status != 0:
            raise RockddaError("limit analysis: no push keeps this mechanism in equilibrium without dilation")
        return float(found.x[-1])

    def is_stable(self, factor: float = 1.0, tilt: float = 0.0) -> bool:
        """Can the blocks be in equilibrium with tan φ and c divided by `factor`, gravity turned by `tilt` [deg]?"""
        return self._largest(self._dead(tilt), np.zeros((len(self.weight), 3)), factor) is not None

    def strength(self, tolerance: float = 1e-5) -> float:
        """The factor by which tan φ and c are divided at the limit; inf where the blocks stand without any strength."""
        low, high = 1e-3, 1e3
        if not self.is_stable(low):
            raise RockddaError("limit analysis: the blocks are not stable with any friction")
        if self.is_stable(high):
            return math.inf
        return _limit(self.is_stable, low, high, lambda low: tolerance * low)

    def tilt(self, tolerance: float = 1e-4, direction: float = 1.0) -> float:
        """The angle by which gravity turns counter-clockwise (direction -1: clockwise) up to the limit [deg]."""
        low, high = 0.0, 90.0
        if not self.is_stable():
            raise RockddaError("limit analysis: the blocks are not stable without tilt")
        if self.is_stable(tilt=direction * high):
            return math.inf
        return _limit(lambda angle: self.is_stable(tilt=direction * angle), low, high, lambda _: tolerance)

    def with_load(self, load: npt.ArrayLike) -> RigidBlocks:
        """The same blocks with a further dead load, (nb, 3)."""
        return replace(self, load=np.asarray(load, dtype=float))

    def _push(self, direction: float) -> FloatArray:
        """(nb, 3) horizontal load of the weight of each block."""
        live = np.zeros((len(self.weight), 3))
        live[:, 0] = direction * self.weight
        return live

    def _dead(self, tilt: float) -> FloatArray:
        """(nb, 3) dead load."""
        angle = math.radians(tilt)
        dead = np.zeros((len(self.weight), 3))
        dead[:, 0], dead[:, 1] = self.weight * math.sin(angle), -self.weight * math.cos(angle)
        return dead if self.load is None else dead + self.load

    def _largest(self, dead: FloatArray, live: FloatArray, factor: float) -> LimitLoad | None:
        """Maximise α with dead load + α × live load in equilibrium; strength is divided by `factor`.

        None when there is no equilibrium under the dead load alone."""
        found = _solve(self._problem(dead, live, factor))
        velocity = np.zeros((len(self.weight), 3))
        if found is None:
            return None
        if found.status == 3:
            return LimitLoad(math.inf, velocity)
        velocity[self.free] = -found.eqlin.marginals.reshape(-1, 3) * self._scale
        return LimitLoad(float(found.x[-1]), velocity)

    def _problem(self, dead: FloatArray, live: FloatArray, factor: float) -> dict[str, Any]:
        """The linear programme: unknowns are N1, N2, T of each joint; α is last."""
        free, n = self.free, 3 * len(self.joints)
        balance = self._balance()
        for row, block in enumerate(free):
            balance += [(3 * row + k, n, float(live[block, k] * self._scale[k])) for k in range(3) if live[block, k]]
        limits, most = self._limits(factor)
        pushed = bool(np.any(live[free]))
        return {
            "c": np.append(np.zeros(n), -1.0 if pushed else 0.0),
            "A_ub": _sparse(limits, (len(most), n + 1)),
            "b_ub": most,
            "A_eq": _sparse(balance, (3 * len(free), n + 1)),
            "b_eq": -(dead[free] * self._scale).ravel(),
            "bounds": [(0.0, np.inf), (0.0, np.inf), (-np.inf, np.inf)] * len(self.joints)
            + [(0.0, np.inf if pushed else 0.0)],
        }

    def _rates(self, motion: FloatArray) -> FloatArray:
        """(joints, 3) of a motion: opening at both ends, sliding of the first block along the joint."""
        moved = motion[self.free] * [1.0, 1.0, self._size]
        rates = np.zeros(3 * len(self.joints))
        for row, column, value in self._balance():
            rates[column] += value * moved[row // 3, row % 3]
        return rates.reshape(-1, 3)

    @property
    def _scale(self) -> FloatArray:
        """Forces in mean weights and moments in mean weights × size, so that numbers are near 1."""
        return np.array([1.0, 1.0, 1.0 / self._size]) / self._unit

    @property
    def _unit(self) -> float:
        """Mean weight of a block."""
        return float(np.abs(self.weight).mean())

    @property
    def _size(self) -> float:
        return float(np.ptp(np.vstack(self.polygons), axis=0).max())

    def _balance(self) -> list[tuple[int, int, float]]:
        """Entries (row, column, value) of the equilibrium of the free blocks: force x, y, moment / size."""
        rank = {block: k for k, block in enumerate(self.free)}
        entries: list[tuple[int, int, float]] = []
        for j, joint in enumerate(self.joints):
            start, end = np.array(joint.start), np.array(joint.end)
            along = (end - start) / joint.length
            normal = np.array([-along[1], along[0]])  # into the first block
            for block, sign in ((joint.first, 1.0), (joint.second, -1.0)):
                if block not in rank:
                    continue
                centre, row = _centroid(self.polygons[block]), 3 * rank[block]
                for k, (point, way) in enumerate(((start, normal), (end, normal), (start, along))):
                    x, y = point - centre
                    turn = (x * way[1] - y * way[0]) / self._size
                    entries += [(row + i, 3 * j + k, sign * float(v)) for i, v in enumerate((*way, turn))]
        return entries

    def _limits(self, factor: float) -> tuple[list[tuple[int, int, float]], list[float]]:
        """Entries of ±T - tan φ (N1 + N2) ≤ c l, and the right-hand sides."""
        entries: list[tuple[int, int, float]] = []
        most: list[float] = []
        for j, joint in enumerate(self.joints):
            tangent = math.tan(math.radians(self.friction[joint.material])) / factor
            for sign in (1.0, -1.0):
                row = len(most)
                entries += [(row, 3 * j, -tangent), (row, 3 * j + 1, -tangent), (row, 3 * j + 2, sign)]
                most.append(self.cohesion.get(joint.material, 0.0) * joint.length / factor / self._unit)
        return entries, most


def _limit(is_stable: Callable[[float], bool], low: float, high: float, tolerance: Callable[[float], float]) -> float:
    """The middle of the interval, no wider than a tolerance, between the last stable value and the first other one."""
    while high - low > tolerance(low):
        middle = math.sqrt(low * high) if high > 2 * low > 0 else 0.5 * (low + high)
        low, high = (middle, high) if is_stable(middle) else (low, middle)
    return 0.5 * (low + high)


def _solve(problem: dict[str, Any]) -> Any:
    """The solution of a linear programme; None: there is none. Status 3: unbounded."""
    linprog = need("scipy.optimize", "records", "limit analysis").linprog
    # close to the limit one of the solver's methods may end without an answer
    for method, presolve in (("highs-ds", True), ("highs-ds", False), ("highs-ipm", True)):
        found = linprog(**problem, method=method, options={"presolve": presolve})
        if found.status in (0, 2, 3):
            return None if found.status == 2 else found
    raise RockddaError(f"limit analysis: the linear programme was not solved: {found.message}")


def _sparse(entries: Sequence[tuple[int, int, float]], shape: tuple[int, int]) -> Any:
    """A sparse matrix of its entries (row, column, value)."""
    from scipy.sparse import csr_array

    rows, columns, values = zip(*entries, strict=True) if entries else ((), (), ())
    return csr_array((values, (rows, columns)), shape=shape)


def _area(polygon: FloatArray) -> float:
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _centroid(polygon: FloatArray) -> FloatArray:
    origin = polygon[0]
    a, b = polygon - origin, np.roll(polygon, -1, axis=0) - origin
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return origin + ((a + b) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
