# SPDX-License-Identifier: MIT
"""Random polygons that collide without friction (T23): pairs and piles."""

from __future__ import annotations

import random

import numpy as np

from .model import Failed, Model, Point, Row, material, rectangle

PAIRS = 20  # of one run, far from each other


def polygon(draw: random.Random, radius: float, x: float, y: float) -> list[Point]:
    """Corners on a circle, at random but no nearer than 20° to the next, or at angles about equal."""
    n = draw.randint(3, 7)
    if draw.random() < 0.5:
        start = draw.uniform(0, 2 * np.pi)
        angles = [start + 2 * np.pi * (i + draw.uniform(-0.33, 0.33)) / n for i in range(n)]
        return [(float(x + radius * np.cos(a)), float(y + radius * np.sin(a))) for a in angles]
    while True:
        angles = sorted(draw.uniform(0, 2 * np.pi) for _ in range(n))
        gaps = [(angles[(i + 1) % n] - angles[i]) % (2 * np.pi) for i in range(n)]
        if min(gaps) > 0.35 and max(gaps) < 0.95 * np.pi:
            return [(float(x + radius * np.cos(a)), float(y + radius * np.sin(a))) for a in angles]


def inertia(points: list[Point], density: float = 2500.0) -> tuple[float, float]:
    """Mass and polar moment about the centroid."""
    x, y = np.asarray(points).T
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y1 - x1 * y
    a = cross.sum() / 2
    cx, cy = ((x + x1) * cross).sum() / (6 * a), ((y + y1) * cross).sum() / (6 * a)
    u, v, u1, v1 = x - cx, y - cy, x1 - cx, y1 - cy
    j = ((u * u + u * u1 + u1 * u1 + v * v + v * v1 + v1 * v1) * (u * v1 - u1 * v)).sum() / 12
    return density * a, density * j


def collide(seed: int, dt: float, g0: float = 1e9, time: float = 0.4) -> np.ndarray:
    """Kinetic energy after over before, of each pair."""
    draw = random.Random(seed)
    model = Model(dt=dt, steps=round(time / dt), g0=g0, g2=0.5, materials=[], joints=[[0.0, 0.0, 0.0]])
    for pair in range(PAIRS):
        x, ra, rb = 40.0 * pair, draw.uniform(0.3, 1), draw.uniform(0.3, 1)
        offset = draw.uniform(-0.7, 0.7) * (ra + rb)
        for points, velocity in (
            (polygon(draw, ra, x, 0), (draw.uniform(5, 25), 0, draw.uniform(-3, 3))),
            (polygon(draw, rb, x + ra + rb + 0.2, offset), (-draw.uniform(0, 5), 0, draw.uniform(-3, 3))),
        ):
            model.materials.append(material(gravity=0, modulus=1e9, velocity=velocity))
            model.add(points, len(model.materials))
    results = model.run()
    ratios = []
    for pair in range(PAIRS):
        energy = []
        for frame in (0, -1):
            parts = []
            for b in (2 * pair, 2 * pair + 1):
                mass, polar = inertia(model.blocks[b][0])
                v = results.velocity[frame, b]
                parts.append(0.5 * mass * (v[0] ** 2 + v[1] ** 2) + 0.5 * polar * v[2] ** 2)
            energy.append(sum(parts))
        ratios.append(energy[1] / energy[0])
    return np.array(ratios)


def pile(seed: int, dt: float, n: int = 300, time: float = 0.5, g0: float = 1e9) -> dict[str, float]:
    """Energies of a pile of n polygons that fall without friction, over the energy turned over."""
    draw = random.Random(seed)
    model = Model(dt=dt, steps=round(time / dt), g0=g0, g2=0.05, joints=[[0.0, 0.0, 0.0]])
    model.materials = [material(modulus=1e9)]
    columns = 15
    for i in range(n):
        x, y = 1.1 * (i % columns) + 0.6, 1.1 * (i // columns) + 0.6
        model.add(polygon(draw, draw.uniform(0.35, 0.54), x, y))
    width, height = 1.1 * columns + 0.1, 1.1 * (n // columns) + 2
    for wall in (rectangle(-1, -1, width + 2, 1), rectangle(-1, 0, 1, height), rectangle(width, 0, 1, height)):
        model.add(wall, held=True)
    results = model.run()
    energy = results.energy
    total = energy[:, :4].sum(axis=1)
    turned = np.abs(energy[-1, :-1]).max()
    return {
        "gain": float((total - total[0]).max() / turned),
        "discarded": float(np.max(-energy[:, 7]) / turned),
        "geometry": float(np.max(energy[:, 8]) / turned),
    }


def rows(quick: bool = False) -> list[Row]:
    """Pairs and piles."""
    found = []
    per_step = 5 if quick else 100
    for dt in (0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005):
        ratios, failures = [], 0
        for seed in range(per_step):
            try:
                ratios.append(collide(seed, dt))
            except Failed:
                failures += 1
        values = np.concatenate(ratios) if ratios else np.array([np.inf])
        gains = int((values > 1.001).sum())
        found.append(
            Row(
                "T23",
                f"{PAIRS * per_step} random pairs, 5 … 25 m/s, {1000 * dt:g} ms",
                "energy after ≤ 1.001 before",
                f"largest {values.max():.4f}, {gains} above, least {values.min():.3f}, {failures} runs failed",
                gains == 0 and failures == 0,
            )
        )
    for dt in (0.002,) if quick else (0.0005, 0.001, 0.002, 0.005):
        worst, failures = {"gain": -np.inf, "discarded": -np.inf, "geometry": -np.inf}, 0
        count = 1 if quick else 5
        for seed in range(count):
            try:
                values_of = pile(seed, dt)
                worst = {k: max(worst[k], values_of[k]) for k in worst}
            except Failed as failure:
                print(failure)
                failures += 1
        found.append(
            Row(
                "T23",
                f"{count} piles of 300 polygons, {1000 * dt:g} ms, 0.5 s",
                "no gain; discarded and geometry never give more than 1e-3",
                ", ".join(f"{k} {v:.1e}" for k, v in worst.items()) + f", {failures} failed",
                failures == 0 and max(worst.values()) <= 1e-3,
            )
        )
    return found
