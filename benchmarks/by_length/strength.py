# SPDX-License-Identifier: MIT
"""Bonds in bending (T26), cohesive plane failure in pieces (T1, T29), jointed slopes against limit analysis."""

from __future__ import annotations

import itertools
import random

import numpy as np
from scipy.optimize import linprog

from .model import Failed, G, Model, Point, Row, area, material, rectangle


def crack(tie: bool, length: float, g0: float = 1e10, tension: float = 1e6) -> float:
    """Moment at which a bonded edge cracks over tension L^2/6."""
    critical = tension * length**2 / 6
    steps = 120
    model = Model(dt=0.01, steps=steps, k01=0.0, g0=g0, g2=0.2, materials=[material(gravity=0, modulus=1e12, nu=0)])
    model.joints = [[30.0, 100 * tension, tension]]
    model.options = f"&joint_material number = 1, tie = {'.true.' if tie else '.false.'} /\n"
    model.add(rectangle(-length, -1, 3 * length, 1), held=True)
    block = model.add(rectangle(0, 0, length, length))
    end = 1.2
    arm = 0.8 * length
    for x, sign in ((0.1 * length, -1), (0.9 * length, 1)):
        force = sign * 1.2 * critical / arm
        model.loading.append((x, 0.5 * length, block, [(0, 0, 0), (end, 0, force), (1e3, 0, force)]))
    model.measure(0.5 * length, 0.5 * length, block)
    results = model.run()
    rotation = np.abs(results.rotation[:, 0])
    moment = 1.2 * critical * results.time / end
    slope = rotation[20] / moment[20]
    broken = np.nonzero(rotation > 1.2 * slope * moment + 1e-15)[0]
    broken = broken[broken > 20]
    return float(moment[broken[0]] / critical) if len(broken) else 1.2


def plane_failure(pieces: int, factor: float, g0: float, dt: float = 0.005) -> float:
    """Movement in the last second of three of Sau Mau Ping's block with strength divided by a factor (T1)."""
    phi, c = np.degrees(np.arctan(np.tan(np.radians(35.0)) / factor)), 0.1e6 / factor
    crest = 60 / np.tan(np.radians(50.0))
    back = crest + 15.336
    bottom = back * np.tan(np.radians(35.0))
    model = Model(dt=dt, steps=round(3.0 / dt), g0=g0, g2=0.02)
    model.materials = [material(density=26e3 / G, modulus=1e10, nu=0.2)]
    model.joints = [[phi, c, 0.0], [35.0, 1e9, 1e8]]
    model.options = (
        "&joint_material number = 1, brittle = .false. /\n&joint_material number = 2, tie = .true. /\n"
        "&block_damping mass_proportional = 1 /\n"
    )
    # the plane goes on below the toe, so that nothing stands before it
    model.add([(-20.0, -40.0), (back, -40.0), (back, bottom), (-20.0, -20 * np.tan(np.radians(35.0)))], held=True)
    cuts = np.linspace(0, back, pieces + 1)

    def top(x: float) -> float:
        return float(min(60.0, x * np.tan(np.radians(50.0))))

    def low(x: float) -> float:
        return float(x * np.tan(np.radians(35.0)))

    for left, right in itertools.pairwise(map(float, cuts)):
        points: list[Point] = [(left, low(left)), (right, low(right)), (right, top(right))]
        joints = [1, 2, 1]
        if left < crest < right:
            points.append((crest, 60.0))
            joints.append(1)
        if left > 0:
            points.append((left, top(left)))
            joints.append(2)
        number = model.add(points)
        # the back of the last piece is the tension crack: without a neighbour
        model.edge_joints[number] = joints
    middle = np.mean(model.blocks[1][0], axis=0)
    model.measure(float(middle[0]), float(middle[1]), 2)
    results = model.run()
    moved = results.measured[:, 0]
    late = int(np.argmax(results.time >= 2.0))
    return float(np.linalg.norm(moved[-1] - moved[late]))


def factor_of_safety(pieces: int, g0: float) -> float:
    """Strength over that with which the block begins to move."""
    low, high = 1.4, 1.75
    if plane_failure(pieces, low, g0) > 0.01:
        return low
    if plane_failure(pieces, high, g0) <= 0.01:
        return high
    while high - low > 0.008:
        middle = 0.5 * (low + high)
        if plane_failure(pieces, middle, g0) > 0.01:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def split(points: list[Point], origin: Point, direction: Point) -> list[list[Point]]:
    """A convex polygon on both sides of a line."""
    side = [direction[0] * (y - origin[1]) - direction[1] * (x - origin[0]) for x, y in points]
    if min(side) > -1e-6 or max(side) < 1e-6:
        return [points]
    parts: tuple[list[Point], list[Point]] = ([], [])
    for (p, s), (q, t) in zip(
        zip(points, side, strict=True), [*zip(points[1:], side[1:], strict=True), (points[0], side[0])], strict=True
    ):
        for part, sign in zip(parts, (1, -1), strict=True):
            if sign * s >= -1e-6:
                part.append(p)
        if s * t < 0 and min(abs(s), abs(t)) > 1e-6:
            u = s / (s - t)
            cut = (p[0] + u * (q[0] - p[0]), p[1] + u * (q[1] - p[1]))
            parts[0].append(cut)
            parts[1].append(cut)
    return [part for part in parts if len(part) > 2]


def slope_blocks(seed: int) -> tuple[list[list[Point]], list[bool]]:
    """Blocks of a slope 10 m high, cut by two sets of joints; which of them are held."""
    draw = random.Random(seed)
    face, flat, steep = draw.uniform(60, 75), draw.uniform(22, 38), draw.uniform(95, 125)
    head = 10 / np.tan(np.radians(face))
    right = float(head + 9)
    blocks = [[(0.0, 0.0), (right, 0.0), (right, 10.0), (float(head), 10.0)]]
    for angle, spacing in ((flat, draw.uniform(1.8, 2.6)), (steep, draw.uniform(1.8, 2.6))):
        d = (float(np.cos(np.radians(angle))), float(np.sin(np.radians(angle))))
        for k in range(-20, 21):
            shift = (k + 0.37) * spacing
            origin = (-d[1] * shift + (0.0 if angle < 90 else 5.0), d[0] * shift)
            blocks = [part for block in blocks for part in split(block, origin, d)]
    # slivers at the face are removed: weight without influence on the mechanism, and on both sides of the comparison
    blocks = [b for b in blocks if area(b) > 0.05]
    held = [any(y < 1e-6 or x > right - 1e-6 for x, y in b) for b in blocks]
    return blocks, held


def limit_friction(blocks: list[list[Point]], held: list[bool]) -> float:
    """Least friction angle [deg] with which forces at the ends of all joints can be in equilibrium (associated)."""
    joints = []
    for (i, a), (j, b) in itertools.combinations(enumerate(blocks), 2):
        if held[i] and held[j]:
            continue
        for p, q in zip(a, [*a[1:], a[0]], strict=True):
            for r, s in zip(b, [*b[1:], b[0]], strict=True):
                t = np.subtract(q, p)
                length = np.linalg.norm(t)
                t = t / length
                n = np.array([-t[1], t[0]])
                if max(abs(n @ np.subtract(r, p)), abs(n @ np.subtract(s, p))) > 1e-5:
                    continue
                low, high = max(0.0, t @ np.subtract(s, p)), min(length, t @ np.subtract(r, p))
                if high - low > 1e-4:
                    joints.append((i, j, np.array(p) + low * t, np.array(p) + high * t, t, n))
    free = [i for i, h in enumerate(held) if not h]
    place = {b: k for k, b in enumerate(free)}
    matrix = np.zeros((3 * len(free), 3 * len(joints)))  # N at both ends, T of the whole
    load = np.zeros(3 * len(free))
    for b in free:
        load[3 * place[b] + 1] = area(blocks[b])
    centre = [np.mean(b, axis=0) for b in blocks]
    # moments about the centroid: the weight has none
    for k, b in enumerate(blocks):
        x, y = np.asarray(b).T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y
        centre[k] = np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (
            3 * cross.sum()
        )
    for k, (i, j, p, q, t, n) in enumerate(joints):
        for body, sign in ((i, 1), (j, -1)):
            if held[body]:
                continue
            at = 3 * place[body]
            for column, point, direction in ((3 * k, p, n), (3 * k + 1, q, n), (3 * k + 2, p, t)):
                arm = point - centre[body]
                matrix[at : at + 2, column] += sign * direction
                matrix[at + 2, column] += sign * (arm[0] * direction[1] - arm[1] * direction[0])
    low, high = 1.0, 80.0
    bounds = [(0, None), (0, None), (None, None)] * len(joints)
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        f = np.tan(np.radians(middle))
        limits = np.zeros((2 * len(joints), 3 * len(joints)))
        for k in range(len(joints)):
            limits[2 * k, 3 * k : 3 * k + 3] = (-f, -f, 1)
            limits[2 * k + 1, 3 * k : 3 * k + 3] = (-f, -f, -1)
        found = linprog(
            np.zeros(3 * len(joints)), limits, np.zeros(2 * len(joints)), matrix, load, bounds, method="highs"
        )
        if found.status == 0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def cut_corners(points: list[Point], size: float) -> list[Point]:
    """Every corner cut off by a size along both edges."""
    found = []
    for a, b, c in zip([points[-1], *points[:-1]], points, [*points[1:], points[0]], strict=True):
        for other in (a, c):
            d = np.subtract(other, b)
            p = np.array(b) + d / np.linalg.norm(d) * min(size, 0.2 * np.linalg.norm(d))
            found.append((float(p[0]), float(p[1])))
    return found


def slope_moves(blocks: list[list[Point]], held: list[bool], phi: float, cut: float, g0: float, dt: float) -> float:
    """Largest movement in the second half of 2 s."""
    model = Model(dt=dt, steps=round(2.0 / dt), g0=g0, g2=0.02, save_every=round(0.5 / dt))
    model.materials = [material(modulus=1e10)]
    model.joints = [[phi, 0.0, 0.0]]
    model.options = "&block_damping mass_proportional = 2 /\n"
    for points, is_held in zip(blocks, held, strict=True):
        model.add(cut_corners(points, cut) if cut else points, held=is_held)
    results = model.run()
    late = int(np.argmax(results.frame_time >= 1.0 - 1e-9))
    return float(np.linalg.norm(results.centroid[-1] - results.centroid[late], axis=1).max())


def critical_friction(
    blocks: list[list[Point]], held: list[bool], near: float, cut: float, g0: float, dt: float
) -> float:
    """Friction angle [deg] below which the slope moves, between 0.8 and 1.25 of a value."""
    low, high = 0.8 * near, 1.25 * near
    if slope_moves(blocks, held, high, cut, g0, dt) > 0.01:
        return high
    if slope_moves(blocks, held, low, cut, g0, dt) <= 0.01:
        return low
    while high - low > 0.01 * near:
        middle = 0.5 * (low + high)
        if slope_moves(blocks, held, middle, cut, g0, dt) > 0.01:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def rows(quick: bool = False) -> list[Row]:
    """Bending, plane failure, slopes."""
    found = []
    for tie, length in itertools.product((True, False), (0.5, 1.0, 3.0)):
        case = f"{'tie' if tie else 'bonded joint'} {length:g} m long in bending"
        try:
            value = crack(tie, length)
            found.append(Row("T26", case, "σt L²/6 ± 3 %", f"{value:.3f}", abs(value - 1) <= 0.03))
        except Failed as failure:
            found.append(Row("T26", case, "σt L²/6 ± 3 %", str(failure)[:100], False))
    for g0 in (1e10,) if quick else (1e9, 1e10, 1e11):
        for pieces in (1, 3, 10):
            case = f"Sau Mau Ping in {pieces} pieces, g0 {g0:.0e}"
            try:
                value = factor_of_safety(pieces, g0)
                found.append(Row("T29", case, "F = 1.584 ± 0.03", f"{value:.3f}", abs(value - 1.584) <= 0.03))
            except Failed as failure:
                found.append(Row("T29", case, "F = 1.584 ± 0.03", str(failure)[:100], False))
    for seed in range(2 if quick else 10):
        blocks, held = slope_blocks(seed)
        bound = limit_friction(blocks, held)
        case = f"jointed slope {seed + 1}, {len(blocks)} blocks, bound {bound:.1f}°"
        truth = "strength ≤ 1.01 of the bound; corners cut: the same ± 3 %"
        try:
            sharp = critical_friction(blocks, held, bound, 0.0, 1e10, 0.005)
            blunt = critical_friction(blocks, held, bound, 0.01, 1e10, 0.005)
        except Failed as failure:
            found.append(Row("slopes", case, truth, str(failure)[:100], False))
            continue
        strength = np.tan(np.radians(bound)) / np.tan(np.radians(sharp))
        met = bool(strength <= 1.01 and abs(blunt / sharp - 1) <= 0.03)
        found.append(
            Row("slopes", case, truth, f"{sharp:.1f}°, strength {strength:.3f}; corners cut {blunt:.1f}°", met)
        )
    return found
