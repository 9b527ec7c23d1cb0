# SPDX-License-Identifier: MIT
"""Regions, stages and water: what is taken out, in which order, and what floats."""

from __future__ import annotations

import math

import numpy as np
import shapely
from hypothesis import strategies as st

from .bench import Bench, Model, Unsuited, box, joint, require, rock
from .drawing import Kind, Values, between, seeds, values
from .motion import polygon


def _lines(segments: list[list[float]], boundary: int = 0, more: str = "") -> str:
    rows = [f"0.001\n{len(segments)} {boundary}\n0 0 0 0 0 0\n"]
    return "".join(rows) + "".join(" ".join(f"{x:.9g}" for x in line) + " 1\n" for line in segments) + more


def region(drawn: Values, bench: Bench) -> None:
    """Excavated is what lies in the region with more than half of its area."""
    random = np.random.default_rng(drawn["seed"])
    half = 10.0
    corners = [[-half, -half], [half, -half], [half, half], [-half, half]]
    segments = [[*corners[k], *corners[(k + 1) % 4]] for k in range(4)]
    ring = polygon(random, drawn["radius"])
    segments += [[*ring[k - 1], *ring[k]] for k in range(len(ring))]
    for _ in range(drawn["joints"]):
        a, b = random.uniform(-half, half, (2, 2))
        d = (b - a) / np.hypot(*(b - a))
        segments.append([*(a - 30 * d), *(a + 30 * d)] if random.random() < 0.5 else [*a, *b])
    room = ring * drawn["over"]
    model = Model(lines=_lines([[float(x) for x in line] for line in segments]))
    model.groups = [
        rock(young=2e10, more=", unit_weight=0.0"),
        joint(friction=40),
        f"&boundary along={-half},{-half}, {half},{-half}, kind='fixed' /",
        "&region name='room', polygon=" + ", ".join(f"{x:.9g},{y:.9g}" for x, y in room) + " /",
        "&stage name='ground', until_step=1 /",
        "&stage name='dig', until_step=2, excavate='room' /",
    ]
    run = bench.run(model, may_fail=True)
    # one block holds all others: it never lies in the room
    require("excavates the last block" not in run.messages, "the last block is excavated: the rock around the room")
    if run.code == 2:
        raise Unsuited
    active = run.get("frames/active")[-1]
    inner = shapely.Polygon(room)
    for number, points in enumerate(run.outlines(0)):
        outline = shapely.make_valid(shapely.Polygon(points))
        share = outline.intersection(inner).area / outline.area
        if abs(share - 0.5) > 0.01:
            require(
                bool(active[number]) == (share < 0.5),
                f"block {number + 1} with {100 * share:.0f} % of its area in the region "
                f"{'stays' if active[number] else 'is excavated'}",
            )


def order(drawn: Values, bench: Bench) -> None:
    """Two rooms in elastic rock of tied cells: the end does not depend on which was dug first."""
    wide, depth = 8.0, drawn["depth"]
    rooms = {"left": box(2, 2, 1, drawn["tall"]), "right": box(5, 2, 1, drawn["tall"])}
    ends = []
    for first, second in (("left", "right"), ("right", "left")):
        model = Model(blocks=[box(0, 0, wide, depth)], fixed=[])
        model.groups = [
            rock(young=1e9, poisson=0.2, more=", unit_weight=25000.0"),
            joint(1, 30),
            joint(2, 30, ", tie=.true."),
            "&subdivide size=1, kind='rectangles', joint_material=2 /",
            f"&boundary along=0,0, {wide},0, kind='fixed' /",
            f"&boundary along=0,0, 0,{depth!r}, kind='roller' /",
            f"&boundary along={wide},0, {wide},{depth!r}, kind='roller' /",
            *(f"&region name='{name}', box={p[0][0]},{p[0][1]},{p[2][0]},{p[2][1]} /" for name, p in rooms.items()),
            "&stage name='weight', until='equilibrium', tolerance=1e-8 /",
            f"&stage name='one', until='equilibrium', tolerance=1e-8, excavate='{first}' /",
            f"&stage name='two', until='equilibrium', tolerance=1e-8, excavate='{second}' /",
        ]
        run = bench.run(model, name=first)
        moved = run.moved()
        moved[run.get("frames/active")[-1] == 0] = 0
        ends.append(moved)
    apart = float(np.abs(ends[0] - ends[1]).max() / np.abs(ends[0]).max())
    require(apart < 1e-3, f"the order of excavation changes displacements by {apart:.1e} of the largest")


def held_in_water(drawn: Values, bench: Bench) -> None:
    """A held polygon in a pool: its supports carry the weight less the water that it displaces (Archimedes)."""
    random = np.random.default_rng(drawn["seed"])
    points = polygon(random, drawn["radius"])
    low, high = float(points[:, 1].min()), float(points[:, 1].max())
    level = low + drawn["depth"] * (high - low)
    model = Model(blocks=[points], held={0}, e0=1e-5 * drawn["radius"])
    model.groups = [
        rock(young=1e12, more=", unit_weight=25000.0"),
        joint(),
        f"&water name='pool', table=0,{level!r}, unit_weight=9810 /",
        "&stage name='w', until='equilibrium', tolerance=1e-8, water='pool' /",
    ]
    run = bench.run(model)
    found = run.get("history/fixed_force")[-1].sum(0)
    shape = shapely.Polygon(points)
    under = shape.intersection(shapely.box(-1e6, -1e6, 1e6, level)).area
    truth = 25000.0 * shape.area - 9810.0 * under
    scale = 25000.0 * shape.area
    apart = math.hypot(float(found[0]), float(found[1]) - truth) / scale
    require(apart < 1e-4, f"supports carry {found[0]:.5g}, {found[1]:.5g}, Archimedes says 0, {truth:.5g}")


KINDS = [
    Kind(
        "region",
        "rooms",
        "a block is in a region when more than half of its area is (shapely)",
        values(seed=seeds(), radius=between(2, 7, 10), over=between(0.8, 1.2, 8), joints=st.integers(0, 8)),
        region,
    ),
    Kind(
        "order-of-excavation",
        "relations",
        "two rooms in elastic rock: the same end in either order",
        values(depth=between(6, 10, 4), tall=st.integers(1, 3)),
        order,
    ),
    Kind(
        "held-in-water",
        "water",
        "supports of a polygon in a pool carry its weight less the water that it displaces",
        values(seed=seeds(), radius=between(0.5, 10, 20), depth=between(0.05, 1.2, 23)),
        held_in_water,
    ),
]
