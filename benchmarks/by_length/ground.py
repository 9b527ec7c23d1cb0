# SPDX-License-Identifier: MIT
"""Stiffness per length (T19), stacks of unequal blocks, and stress in the ground (T24)."""

from __future__ import annotations

import itertools

import numpy as np

from .model import Failed, G, Model, Row, material, rectangle

KN, KS = 1e9, 4e8  # [force/length^3] of the joints here


def stiff_joints() -> str:
    """Stiffness of joint material 1 per length."""
    contact = "&contact fixed_stiffness_factor = 1e6 /\n"  # of the base: no movement beside that of the joints
    return f"{contact}&joint_material number = 1, normal_stiffness = {KN}, shear_stiffness = {KS} /\n"


def closure(n: int, width: float = 1.0, shear: bool = False) -> float:
    """Movement of a block on n blocks side by side over that of the closed form (static)."""
    model = Model(dt=1.0, steps=40, k01=0.0, g0=1e9, g2=0.1, materials=[material(modulus=1e13, nu=0)])
    model.joints = [[60.0, 0.0, 0.0]]
    model.options = stiff_joints()
    model.add(rectangle(-0.5, -1, width + 1, 1), held=True)
    for i in range(n):
        model.add(rectangle(width * i / n, 0, width / n, 0.5), held=n > 0 and shear)
    top = model.add(rectangle(0, 0.5, width, 1.0))
    model.measure(width / 2, 1.0, top)
    weight = 2500 * G * width
    if shear:
        force = 0.3 * weight
        model.loading.append((width / 2, 0.5 + 1e-6, top, [(0, force, 0), (1e6, force, 0)]))
        return float(model.run().measured[-1, 0, 0] / (force / (KS * width)))
    expected = weight / (KN * width) + 1.5 * weight / (KN * width)
    return float(-model.run().measured[-1, 0, 1] / expected)


def stack(widths: list[float], heights: list[float]) -> float:
    """Settlement of a stack of centred blocks over its closed form; each joint is as wide as its shorter edge."""
    model = Model(dt=1.0, steps=40, k01=0.0, g0=1e9, g2=0.1, materials=[material(modulus=1e13, nu=0)])
    model.options = stiff_joints()
    model.add(rectangle(-10, -1, 20, 1), held=True)
    y, expected = 0.0, 0.0
    areas = [w * h for w, h in zip(widths, heights, strict=True)]
    for i, (w, h) in enumerate(zip(widths, heights, strict=True)):
        top = model.add(rectangle(-w / 2, y, w, h))
        below = 20.0 if i == 0 else widths[i - 1]
        expected += 2500 * G * sum(areas[i:]) / (KN * min(w, below))
        y += h
    model.measure(0, y - 1e-3, top)
    return float(-model.run().measured[-1, 0, 1] / expected)


def stressed(
    k0: float, ratio: float, nx: int = 4, ny: int = 4, phi: float = 35.0, bonds: bool = False
) -> tuple[float, float]:
    """Error of the stress over 1 MPa, and largest movement over w0, of blocks with stress in a fixed frame."""
    modulus = 1e9
    vertical = -1e6
    model = Model(dt=0.01, steps=60, g0=ratio * modulus, g2=0.02)
    model.materials = [material(modulus=modulus, gravity=0, stress=(k0 * vertical, vertical, 0))]
    model.materials.append(material(modulus=1e4 * modulus, gravity=0))
    model.options = "&contact fixed_stiffness_factor = 1e5 /\n"
    model.joints = [[phi, 1e7 if bonds else 0.0, 1e6 if bonds else 0.0]]
    for j, i in itertools.product(range(ny), range(nx)):
        model.add(rectangle(i, j, 1, 1))
    for frame in (
        rectangle(-1, -1, nx + 2, 1),
        rectangle(-1, ny, nx + 2, 1),
        rectangle(-1, 0, 1, ny),
        rectangle(nx, 0, 1, ny),
    ):
        model.add(frame, 2, held=True)
    results = model.run()
    stress = results.stress[-1][: nx * ny]
    error = np.abs(stress - np.array([k0 * vertical, vertical, 0])).max() / 1e6
    moved = np.linalg.norm(results.centroid[-1] - results.centroid[0], axis=1)[: nx * ny].max()
    return float(error), float(moved / ((ny + 2) / 2))


def rows(quick: bool = False) -> list[Row]:
    """Closure, shear, stacks, stress in the ground."""
    found = []
    for name, width, shear in (
        ("column 1 m wide on n blocks", 1.0, False),
        ("joint 8 m long under n blocks", 8.0, False),
        ("sheared, n blocks below", 1.0, True),
    ):
        values = {}
        for n in (1, 2, 4, 8, 16):
            try:
                values[n] = closure(n, width, shear)
            except Failed as failure:
                values[n] = np.nan
                print(name, n, failure)
        error = max(abs(v - 1) if v == v else np.inf for v in values.values())
        found.append(
            Row("T19", f"{name}, n = 1 … 16", "1 ± 1e-3", ", ".join(f"{v:.5f}" for v in values.values()), error <= 1e-3)
        )
    for name, widths, heights in (
        ("stack of 5 blocks, 3 … 1 m wide", [3, 2.5, 2, 1.5, 1], [1.0] * 5),
        ("stack wider upwards, 1 … 2 m", [1, 1.25, 1.5, 1.75, 2], [1.0] * 5),
        ("stack of slabs and towers", [2, 0.3, 3, 0.5, 1], [0.2, 2, 0.1, 1, 1]),
        ("tower of 30", [1.0] * 30, [0.5] * 30),
    ):
        try:
            value = stack([float(w) for w in widths], [float(h) for h in heights])
            found.append(Row("T19", name, "1 ± 1e-3", f"{value:.5f}", abs(value - 1) <= 1e-3))
        except Failed as failure:
            found.append(Row("T19", name, "1 ± 1e-3", str(failure)[:80], False))
    for k0 in (0.5, 1.0, 3.0):
        worst, moved, where, failures = 0.0, 0.0, 0.0, 0
        for ratio in (0.2, 1.0, 50.0) if quick else (0.2, 0.5, 1.0, 5.0, 50.0):
            try:
                error, most = stressed(k0, ratio, bonds=k0 == 3.0)
            except Failed:
                failures += 1
                continue
            if error >= worst:
                worst, where = error, ratio
            moved = max(moved, most)
        found.append(
            Row(
                "T24",
                f"4 × 4 blocks in a frame 1e4 times as stiff, k0 = {k0:g}, g0/E 0.2 … 50",
                "stress to 1 %, motion ≤ 1e-5 w0",
                f"{100 * worst:.2f} % (g0/E {where:g}), {moved:.1e} w0" + (f", {failures} failed" if failures else ""),
                failures == 0 and worst <= 0.01 and moved <= 1e-5,
            )
        )
    return found
