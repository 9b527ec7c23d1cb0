# SPDX-License-Identifier: MIT
"""Intact rock in tied cells: cantilevers (T25), frame, plate with a hole, sample, waves, Kirsch (T8), cracks (T26)."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from .model import Failed, G, Model, Point, Row, material, rectangle

TIE = "&joint_material number = 1, tie = .true. /\n"
SHEAR = 5 / 6  # share of the area of a rectangle that carries shear


def cells(
    nx: int, ny: int, shape: str, at: Callable[[float, float], Point], wrap: bool = False
) -> list[tuple[list[Point], int, int]]:
    """Rectangles or triangles of a lattice on the unit square, mapped by at; with their column and row."""
    found = []
    for j, i in itertools.product(range(ny), range(nx)):
        a, b = at(i / nx, j / ny), at((i + 1) / nx if not wrap else ((i + 1) % nx) / nx, j / ny)
        c = at((i + 1) / nx if not wrap else ((i + 1) % nx) / nx, (j + 1) / ny)
        d = at(i / nx, (j + 1) / ny)
        if shape == "rectangles":
            found.append(([a, b, c, d], i, j))
        elif (i + j) % 2 == 0:
            found += [([a, b, c], i, j), ([a, c, d], i, j)]
        else:
            found += [([a, b, d], i, j), ([b, c, d], i, j)]
    return found


def static(dt: float = 1.0, steps: int = 12, modulus: float = 1e10, options: str = TIE) -> Model:
    """A model without inertia to speak of, of small displacement."""
    return Model(dt=dt, steps=steps, k01=0.0, g0=modulus, g2=0.5, options=options)


def cantilever(nx: int, ny: int, shape: str, nu: float, length: float = 5.0, end_load: bool = False) -> float:
    """Deflection of the end over Timoshenko's, by weight or by a force at the end."""
    e, height = 1e10, 1.0
    g = 1e-4 * G
    model = static()
    model.materials = [
        material(gravity=0 if end_load else g, modulus=e, nu=nu),
        material(gravity=0, modulus=1e3 * e, nu=nu),
    ]
    for points, _, _ in cells(nx, ny, shape, lambda u, v: (length * u, height * v)):
        model.add(points)
    left = [(0.0, float(height * j / ny)) for j in range(ny + 1)]
    wall = model.add([(-1.0, 0.0), *left, (-1.0, height)], 2)
    model.fixed += [(x, y, wall) for x in (-0.9, -0.1) for y in (0.1, 0.9)]
    tips = []
    for number, (points, m) in enumerate(model.blocks, start=1):
        right = [p for p in points if abs(p[0] - length) < 1e-9]
        if m == 1 and len(right) == 2:
            tips.append((0.5 * (right[0][1] + right[1][1]), number))
    for y, number in tips:
        model.measure(length - 1e-9, y, number)
    q, shear_modulus, inertia = 2500 * g * height, e / 2 / (1 + nu), height**3 / 12
    if end_load:
        force = 1.0
        for y, number in tips:
            model.loading.append((length - 1e-9, y, number, [(0, 0, -force / len(tips)), (1e9, 0, -force / len(tips))]))
        exact = force * length**3 / (3 * e * inertia) + force * length / (SHEAR * shear_modulus * height)
    else:
        exact = q * length**4 / (8 * e * inertia) + q * length**2 / (2 * SHEAR * shear_modulus * height)
    return float(-model.run().measured[-1, :, 1].mean() / exact)


def portal(n: int) -> float:
    """Sway of a portal frame with fixed feet under a push at the beam, over that of thin beams.

    Columns and beam of equal section h = n cells; height and span 20 h between axes. Sway of a frame with
    k = I_beam H / (I_column L) = 1: P H^3 / (12 E I) (3 k + 2) / (6 k + 1) / 1 with two columns, plus shear.
    """
    e, nu, h, span = 1e10, 0.2, 1.0, 20.0
    model = static()
    model.materials = [material(gravity=0, modulus=e, nu=nu), material(gravity=0, modulus=1e3 * e, nu=nu)]
    d = h / n
    columns, heights = round((span + h) / d), round((span + h / 2) / d)
    beam = heights - n
    pushed = []
    for j, i in itertools.product(range(heights), range(columns)):
        if j >= beam or i < n or i >= columns - n:
            number = model.add(rectangle(i * d, j * d, d, d))
            if j >= beam and i == 0:
                pushed.append(number)
                model.measure((i + 0.5) * d, (j + 0.5) * d, number)
    for x in (0.0, span):
        foot = [(x, -1.0), (x + h, -1.0), *((x + h - k * d, 0.0) for k in range(n + 1))]
        number = model.add(foot, 2)
        model.fixed += [(x + u * h, v, number) for u in (0.1, 0.9) for v in (-0.9, -0.1)]
    force = 1000.0
    for number in pushed:
        x, y = np.mean(model.blocks[number - 1][0], axis=0)
        model.loading.append((float(x), float(y), number, [(0, force / n, 0), (1e9, force / n, 0)]))
    inertia = h**3 / 12
    sway = force * span**3 / (24 * e * inertia) * (3 + 2) / (6 + 1) * 1.0 * 2 / 1
    return float(model.run().measured[-1, :, 0].mean() / sway)


def sample(nx: int, ny: int, shape: str, nu: float = 0.25) -> tuple[float, float]:
    """Young's modulus and Poisson's ratio of a tied sample pulled along x, over those of its cells."""
    e, length, height, pull = 1e10, 2.0, 1.0, 1e5
    model = static()
    model.materials = [material(gravity=0, modulus=e, nu=nu)]
    numbers = [(model.add(p), p) for p, _, _ in cells(nx, ny, shape, lambda u, v: (length * u, height * v))]
    options = TIE
    for number, p in numbers:
        for u, v in zip(p, [*p[1:], p[0]], strict=True):
            for x, sign in ((0.0, -1), (length, 1)):
                if abs(u[0] - x) + abs(v[0] - x) < 1e-9:
                    ends = ", ".join(repr(c) for c in (*u, *v))
                    options += f"&line_load ends = {ends}, force_start = {sign * pull}, 0 /\n"
        if min(q[0] for q in p) == 0 and min(q[1] for q in p) == 0 and not model.fixed:
            model.fixed.append((*map(float, np.mean(p, axis=0)), number))
    last = max(numbers, key=lambda item: (np.mean(item[1], axis=0)[0], -np.mean(item[1], axis=0)[1]))
    end = tuple(map(float, np.mean(last[1], axis=0)))
    model.bolts.append((end[0], end[1] - 10, *end, 0, last[0], 1e9, 0.0, 1e9))  # against rotation, without force
    model.options = options
    results = model.run()
    moved = results.centroid[-1] - results.centroid[0]
    start = results.centroid[0]
    gradient = np.linalg.lstsq(np.c_[start, np.ones(len(start))], moved, rcond=None)[0]
    strain_x, strain_y = gradient[0, 0], gradient[1, 1]
    return float(pull / strain_x / e), float(-strain_y / strain_x / nu)


def wave(n: int, shape: str, nu: float = 0.0) -> float:
    """Speed of a longitudinal pulse through a bar of n × 4 cells over sqrt(E/rho)."""
    e, rho, length = 1e10, 2500.0, 40.0
    c = np.sqrt(e / rho)
    height = length / n * 4
    dt = 0.1 * length / n / c
    model = Model(dt=float(dt), steps=round(1.1 * length / c / dt), g0=e, g2=0.5, options=TIE, save_every=1)
    model.materials = [material(gravity=0, modulus=e, nu=nu)]
    duration = 8.0 / c * 1.0
    columns = []
    for points, i, _ in cells(n, 4, shape, lambda u, v: (length * u, height * v)):
        columns.append((model.add(points), i))
    rows_of = np.linspace(0, duration, 41)
    push = [(t, 1e3 * np.sin(np.pi * t / duration) ** 2, 0) for t in rows_of] + [(1e6, 0, 0)]
    for number, i in columns:
        if i == 0:
            x, y = np.mean(model.blocks[number - 1][0], axis=0)
            model.loading.append((float(x), float(y), number, push))
    results = model.run()
    near, far = round(0.2 * n), round(0.7 * n)
    start = results.centroid[0]

    def arrival(column: int) -> float:
        """Time at which half of the final displacement is there: the middle of the pulse."""
        own = [number - 1 for number, i in columns if i == column]
        u = (results.centroid[:, own, 0] - start[own, 0]).mean(axis=1)
        return float(np.interp(0.5 * u[-1], u, results.frame_time))

    distance = (
        start[[b - 1 for b, i in columns if i == far], 0].mean()
        - start[[b - 1 for b, i in columns if i == near], 0].mean()
    )
    return float(distance / (arrival(far) - arrival(near)) / c)


def kirsch_points(outer: float = 20.0, a: float = 2.0) -> Callable[[float, float], Point]:
    """Map of the unit square to a ring around the hole, with geometric growth outwards."""

    def at(u: float, v: float) -> Point:
        radius = a * (outer / a) ** v
        # against u, so that the cells are counter-clockwise
        return float(radius * np.cos(-2 * np.pi * u)), float(radius * np.sin(-2 * np.pi * u))

    return at


def kirsch_displacement(x: float, y: float, a: float, sx: float, sy: float, e: float, nu: float) -> tuple[float, float]:
    """Displacement by the excavation of a round hole in plane strain, Kirsch."""
    r, t = np.hypot(x, y), np.arctan2(y, x)
    shear = e / 2 / (1 + nu)
    mean, half = 0.5 * (sx + sy), 0.5 * (sx - sy)
    ur = a**2 / (2 * shear * r) * (mean + half * (4 * (1 - nu) - a**2 / r**2) * np.cos(2 * t))
    ut = -(a**2) / (2 * shear * r) * half * (2 * (1 - 2 * nu) + a**2 / r**2) * np.sin(2 * t)
    return float(ur * np.cos(t) - ut * np.sin(t)), float(ur * np.sin(t) + ut * np.cos(t))


def kirsch(n_r: int, n_t: int, shape: str = "rectangles") -> tuple[float, float, float]:
    """Inward displacements of springline and crown over Kirsch's, and largest error of hoop stress at the wall.

    The ring begins with the stress of the ground and the hole is open; the rim at 10 radii is moved as Kirsch
    gives it. The error of stress is over 26 MPa, against Kirsch at the centroid of the cell.
    """
    a, outer, e, nu = 2.0, 20.0, 12e9, 0.3
    sx, sy = -4e6, -10e6
    model = static(modulus=e, steps=12)
    model.materials = [material(gravity=0, modulus=e, nu=nu, stress=(sx, sy, 0))]
    at = kirsch_points(outer, a)
    options = TIE + "&material plane = 'strain' /\n"
    numbers = []
    for points, i, j in cells(n_t, n_r, shape, at, wrap=True):
        numbers.append((model.add(points), i, j))
    # the rim is moved by what Kirsch gives there, in the first step
    for number, _, j in numbers:
        points = model.blocks[number - 1][0]
        if j != n_r - 1:
            continue
        for x, y in points:
            if abs(np.hypot(x, y) - outer) < 1e-6:
                u = kirsch_displacement(x, y, a, sx, sy, e, nu)
                model.prescribed[len(model.fixed)] = [(0, 0, 0), (model.dt, *u), (1e9, *u)]
                model.fixed.append((x, y, number))
    model.options = options
    # displacement of the wall: corners of the innermost cells nearest to the springline and the crown
    for target in ((a, 0.0), (0.0, a), (-a, 0.0), (0.0, -a)):
        best = min(
            (
                (np.hypot(x - target[0], y - target[1]), x, y, number)
                for number, _, j in numbers
                if j == 0
                for x, y in model.blocks[number - 1][0]
            )
        )
        model.measure(best[1], best[2], best[3])
    results = model.run()
    u = results.measured[-1]
    side = 0.5 * (-u[0, 0] + u[2, 0]) / 0.347e-3
    crown = 0.5 * (-u[1, 1] + u[3, 1]) / 2.687e-3
    worst = 0.0
    for number, _, j in numbers:
        if j != 0:
            continue
        x, y = results.centroid[0, number - 1]
        r, t = np.hypot(x, y), np.arctan2(y, x)
        s = results.stress[-1, number - 1]
        hoop = s[0] * np.sin(t) ** 2 + s[1] * np.cos(t) ** 2 - 2 * s[2] * np.sin(t) * np.cos(t)
        q = a**2 / r**2
        exact = 0.5 * (sx + sy) * (1 + q) - 0.5 * (sx - sy) * (1 + 3 * q**2) * np.cos(2 * t)
        worst = max(worst, abs(hoop - exact) / 26e6)
    return float(side), float(crown), float(worst)


def row(topic: str, case: str, truth: str, run: Callable[[], tuple[str, bool]]) -> Row:
    """A row of a case that may fail."""
    try:
        result, met = run()
    except Failed as failure:
        result, met = " ".join(str(failure).split())[:100], False
    return Row(topic, case, truth, result, bool(met))


def rows(quick: bool = False) -> list[Row]:
    """All cases of tied cells."""
    found = []
    sizes = ((10, 2, None), (20, 4, 0.05), (40, 8, None), (80, 16, 0.01))[: 2 if quick else 4]
    for shape, (nx, ny, limit) in itertools.product(("rectangles", "triangles"), sizes):

        def bent(shape: str = shape, nx: int = nx, ny: int = ny, limit: float | None = limit) -> tuple[str, bool]:
            values = [cantilever(nx, ny, shape, nu) for nu in (0.0, 0.15, 0.3)]
            values.append(cantilever(nx, ny, shape, 0.25, end_load=True))
            met = limit is None or max(abs(v - 1) for v in values) <= limit
            return ", ".join(f"{v:.4f}" for v in values), met

        case = f"cantilever of {nx} × {ny} {shape}; ν 0, 0.15, 0.3; load at the end"
        found.append(row("T25", case, "of Timoshenko" + (f" ± {100 * limit:g} %" if limit else ""), bent))
    for n, limit in ((2, None), (4, None), (8, 0.05)):

        def swayed(n: int = n, limit: float | None = limit) -> tuple[str, bool]:
            value = portal(n)
            return f"{value:.4f}", limit is None or abs(value - 1) <= limit

        found.append(
            row(
                "T25",
                f"portal frame, {n} cells across",
                "of thin beams" + (f" ± {100 * limit:g} %" if limit else ""),
                swayed,
            )
        )
    for shape, (n_r, n_t, limit) in itertools.product(
        ("rectangles", "triangles"), ((8, 24, 0.10), (16, 48, 0.05), (24, 72, 0.03))
    ):

        def hole(n_r: int = n_r, n_t: int = n_t, shape: str = shape, limit: float = limit) -> tuple[str, bool]:
            side, crown, stress = kirsch(n_r, n_t, shape)
            met = max(abs(side - 1), abs(crown - 1), stress) <= limit
            return f"springline {side:.4f}, crown {crown:.4f}, stress at the wall off by {100 * stress:.1f} %", met

        found.append(row("T8", f"ring of {n_r} × {n_t} {shape}", f"Kirsch ± {100 * limit:g} %", hole))
    for shape in ("rectangles", "triangles"):

        def pulled(shape: str = shape) -> tuple[str, bool]:
            e, nu = sample(20, 10, shape)
            return f"E {e:.4f}, ν {nu:.4f}", max(abs(e - 1), abs(nu - 1)) <= 0.01

        def travelled(shape: str = shape) -> tuple[str, bool]:
            value = wave(80, shape)
            return f"{value:.4f}", abs(value - 1) <= 0.01

        found.append(row("E, ν", f"sample of 20 × 10 {shape}", "of the cells ± 1 %", pulled))
        found.append(row("wave", f"bar of 80 × 4 {shape}, pulse of 16 cells", "sqrt(E/ρ) ± 1 %", travelled))
    return found
