# SPDX-License-Identifier: MIT
"""Load factors of masonry arches against linear programmes of rigid voussoirs without tension."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from model_runs import INPUTS, run_program

linprog = pytest.importorskip("scipy.optimize").linprog


def voussoirs(radius, thickness, half, n):
    """(n, 4, 2) outlines of an arch that is symmetric about the y axis, from the right springing to the left one."""
    angles = np.radians(90 - half + 2 * half * np.arange(n + 1) / n)
    low, high = (
        (radius + side * thickness) * np.column_stack([np.cos(angles), np.sin(angles)]) for side in (-0.5, 0.5)
    )
    return np.stack([low[:-1], high[:-1], high[1:], low[1:]], axis=1)


def limit_load(blocks, friction, dead, live):
    """The largest factor of a live load, by the static theorem.

    The joint before and after each block carries a force at both its ends and one along it: no tension, Coulomb
    friction. dead, live: (block, point, force) each.
    """
    n = len(blocks)
    middles = blocks.mean(axis=1)
    columns = 3 * (n + 1) + 1
    balance, loads = np.zeros((3 * n, columns)), np.zeros(3 * n)

    def row(i, point, force):
        arm = np.asarray(point) - middles[i]
        return np.array([force[0], force[1], arm[0] * force[1] - arm[1] * force[0]])

    for j in range(n + 1):
        low, high = blocks[j][:2] if j < n else blocks[-1][:1:-1]
        along = (high - low) / np.linalg.norm(high - low)
        normal = np.array([-along[1], along[0]])
        for k, (point, force) in enumerate(((low, normal), (high, normal), (low, along))):
            if j < n:
                balance[3 * j : 3 * j + 3, 3 * j + k] += row(j, point, force)
            if j > 0:
                balance[3 * j - 3 : 3 * j, 3 * j + k] -= row(j - 1, point, force)
    for i, point, force in dead:
        loads[3 * i : 3 * i + 3] -= row(i, point, force)
    for i, point, force in live:
        balance[3 * i : 3 * i + 3, -1] += row(i, point, force)
    slides = np.zeros((2 * (n + 1), columns))
    for j in range(n + 1):
        slides[2 * j : 2 * j + 2, 3 * j : 3 * j + 2] = -math.tan(math.radians(friction))
        slides[2 * j : 2 * j + 2, 3 * j + 2] = 1, -1
    bounds = [(0, None), (0, None), (None, None)] * (n + 1) + [(0, None)]
    aim = np.zeros(columns)
    aim[-1] = -1
    found = linprog(aim, slides, np.zeros(len(slides)), balance, loads, bounds, method="highs")
    assert found.status == 0
    return found.x[-1]


def weights(blocks, unit_weight):
    """Dead load of the blocks: half of a quadrilateral on each side of a diagonal."""
    for i, (a, b, c, d) in enumerate(blocks):
        for corners in ((a, b, c), (a, c, d)):
            u, v = corners[1] - corners[0], corners[2] - corners[0]
            yield i, np.mean(corners, axis=0), (0, -unit_weight * abs(u[0] * v[1] - u[1] * v[0]) / 2)


def search(program, folder, model, *options):
    outcome = run_program(program, ["fos", str(model), "--search", "load", "--json", "--quiet", *options], folder)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads(outcome.stdout)


def write_arch(folder, blocks, friction, unit_weight, at, young, more=""):
    """The arch between two fixed blocks, as a labelled file; more: further groups."""
    behind = []
    for joint, side in ((blocks[0][:2], -1), (blocks[-1][:1:-1], 1)):
        along = (joint[1] - joint[0]) / np.linalg.norm(joint[1] - joint[0])
        out = 0.8 * side * np.array([-along[1], along[0]])
        low, high = joint[0] - 0.3 * along, joint[1] + 0.3 * along
        behind.append(np.array([low, high, high + out, low + out]))
    outlines = [behind[0], *blocks, behind[1]]
    lines = [(*p, *q) for one in outlines for p, q in zip(one, np.roll(one, -1, axis=0), strict=True)]
    held = [point for one in behind for point in (one.mean(axis=0), one[2:].mean(axis=0))]
    head = [0.0005, f"{len(lines)} {len(lines)}", 0, 0, len(held), 0, 0, 0]
    rows = [" ".join(f"{v:.12g}" for v in line) + " 1" for line in lines]
    rows += [f"{x:.12g} {y:.12g} {x:.12g} {y:.12g}" for x, y in held]
    (folder / "arch.dc").write_text("\n".join(map(str, head + rows)) + "\n")
    (folder / "arch.nml").write_text(
        "&model geometry = 'arch.dc' /\n&load gravity = 10 /\n"
        f"&block_material number = 1, density = {unit_weight / 10}, young = {young}, poisson = 0.2 /\n"
        f"&joint_material number = 1, friction = {friction} /\n"
        f"&loading_point name = 'axle', at = {at[0]:.12g}, {at[1]:.12g}, force = 0, -1000 /\n" + more
    )
    return folder / "arch.nml"


# segment of R 5 with the load beside and at the crown; a thick half circle; a segment of few voussoirs
ARCHES = {
    "M1": (5.0, 0.5, 60, 31, 23, 31, 68.871),
    "M2": (5.0, 0.5, 60, 31, 15, 31, 132.773),
    "half circle": (4.0, 0.8, 90, 25, 8, 35, None),
    "few voussoirs": (6.0, 0.5, 50, 12, 8, 35, None),
}


@pytest.mark.parametrize("name", ARCHES)
def test_arches_carry_the_load_of_the_linear_programme(program, tmp_path, near, name):
    radius, thickness, half, n, loaded, friction, published = ARCHES[name]
    blocks = voussoirs(radius, thickness, half, n)
    at = blocks[loaded][1:3].mean(axis=0)
    truth = limit_load(blocks, friction, weights(blocks, 20e3), [(loaded, at, (0, -1000))])
    if published is not None:
        near(f"arch {name}, linear programme [kN/m]", truth, published, 0.002)
    found = search(program, tmp_path, write_arch(tmp_path, blocks, friction, 20e3, at, 20e9))
    near(f"arch {name}, load factor [kN/m]", found["factor"], truth, 0.01)
    assert found["mechanism"]["kind"] == "toppling"


@pytest.mark.parametrize("name", ARCHES)
def test_joints_four_times_as_stiff_do_not_move_the_load(program, tmp_path, near, name):
    """Automatic contacts have twice the modulus of the blocks [N/m], 16 times that in a search of the load."""
    radius, thickness, half, n, loaded, friction, _ = ARCHES[name]
    blocks = voussoirs(radius, thickness, half, n)
    at = blocks[loaded][1:3].mean(axis=0)
    loads = []
    for more in ("", f"&contact stiffness = {4 * 16 * 2 * 20e9} /\n"):
        model = write_arch(tmp_path, blocks, friction, 20e3, at, 20e9, more)
        loads.append(search(program, tmp_path, model, "--tolerance", "0.002")["factor"])
    near(f"arch {name}, load with joints four times as stiff over the load", loads[1] / loads[0], 1, 0.01)


@pytest.mark.parametrize("x", [-4.0, -2.5, -1.5, -0.5, 2.0])
def test_bridge_carries_the_axle_of_the_linear_programme(program, tmp_path, near, x):
    inner, thickness = 6.25, 0.6
    outer = inner + thickness
    half = math.degrees(math.asin(5 / inner))
    blocks = voussoirs(inner + thickness / 2, thickness, half, 29)
    dead = list(weights(blocks, 22e3))
    for i, block in enumerate(blocks):
        (first, second), width = block[1:3], abs(block[1][0] - block[2][0])
        cover = outer + 0.4 - block[1:3, 1]
        dead += [
            (i, first, (0, -18e3 * width * (2 * cover[0] + cover[1]) / 6)),
            (i, second, (0, -18e3 * width * (cover[0] + 2 * cover[1]) / 6)),
        ]
    at = np.array([x, math.sqrt((outer - 0.01) ** 2 - x**2)])
    loaded = int((math.degrees(math.atan2(at[1], at[0])) - 90 + half) // (2 * half / 29))
    truth = limit_load(blocks, 35, dead, [(loaded, at, (0, -1000))])
    text = (INPUTS / "arch_bridge" / "template" / "arch_bridge.nml").read_text()
    start = text.index("{{x}}")
    end = text.index("}}", start + 5) + 2
    (tmp_path / "arch_bridge.nml").write_text(f"{text[:start]}{at[0]:.12g}, {at[1]:.12g}{text[end:]}")
    (tmp_path / "arch_bridge.dc").write_text((INPUTS / "arch_bridge" / "arch_bridge.dc").read_text())
    found = search(program, tmp_path, tmp_path / "arch_bridge.nml", "--loads", "axle")
    near(f"arch_bridge, load factor of an axle at x = {x} [kN/m]", found["factor"], truth, 0.015)
