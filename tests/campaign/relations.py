# SPDX-License-Identifier: MIT
"""What holds whatever the answer is: units, mirror, rotation, order, frames, pieces, far blocks, steps, stiffness."""

from __future__ import annotations

import copy
import math
import re

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, G, Model, Points, Run, box, joint, require, rock, turned
from .drawing import Kind, Values, between, decades, seeds, values
from .motion import polygon

DENSITY, WEIGHT = 2500.0, 24525.0


def _heap(drawn: Values) -> Model:
    """Blocks that stand and fall on a floor: friction, opening and toppling, for a short time."""
    random = np.random.default_rng(drawn["seed"])
    model = Model(blocks=[box(-4, -1, 9, 1)], held={0})
    x = -3.0
    for _ in range(drawn["count"]):
        width, height = random.uniform(0.4, 1.0), random.uniform(0.3, 2.5)
        model.blocks.append(box(x, 0, width, height))
        if random.random() < 0.5:
            top = polygon(random, 0.3)
            model.blocks.append(top + np.array([x + 0.5 * width, height - top[:, 1].min()]))
        x += width + random.uniform(0.05, 0.6)
    model.groups = _groups(drawn)
    return model


def _groups(drawn: Values, length: float = 1.0, mass: float = 1.0, more: str = "") -> list[str]:
    """Of a heap; in units in which lengths are so many, times the square root of it, and masses per area so many."""
    second = math.sqrt(length)
    stiffness = 1e8 * mass
    return [
        rock(young=1e10 * mass * length, density=DENSITY * mass, more=f", unit_weight={WEIGHT * mass!r}{more}"),
        joint(friction=drawn["friction"], normal_stiffness=stiffness, shear_stiffness=stiffness / 2),
        f"&run t_end={0.3 * second!r}, save_every=1000 /",
        f"&time dt_max={0.002 * second!r}, displacement_ratio=0.02 /",
        f"&contact stiffness={stiffness * length!r} /",
    ]


def _end(run: Run) -> Points:
    return np.concatenate(run.outlines(-1))


def _same(first: Points, second: Points, start: Points, allowed: float, words: str) -> None:
    moved = float(np.abs(first - start).max())
    apart = float(np.abs(first - second).max()) / max(moved, 1e-9)
    require(apart <= allowed, f"{words} changes places by {apart:.1e} of the largest displacement")


def units(drawn: Values, bench: Bench) -> None:
    """The same heap in other units: lengths times 4, times times 2, masses times 2^k."""
    model = _heap(drawn)
    other = copy.deepcopy(model)
    other.blocks = [4 * points for points in model.blocks]
    other.groups = _groups(drawn, 4.0, 2.0 ** drawn["power"])
    other.e0 *= 4
    first = bench.run(model)
    there = _end(bench.run(other, name="other")) / 4
    _same(_end(first), there, np.concatenate(model.blocks), 1e-6, "another system of units")


def mirror(drawn: Values, bench: Bench) -> None:
    model = _heap(drawn)
    other = copy.deepcopy(model)
    other.blocks = [points[::-1] * [-1, 1] for points in model.blocks]
    first, second = bench.run(model), bench.run(other, name="other")
    there = np.concatenate([points[::-1] * [-1, 1] for points in second.outlines(-1)])
    # round-off grows where blocks strike
    _same(_end(first), there, np.concatenate(model.blocks), 1e-5, "a mirror")


def permutation(drawn: Values, bench: Bench) -> None:
    model = _heap(drawn)
    order = np.random.default_rng(drawn["seed"] + 1).permutation(len(model.blocks))
    other = copy.deepcopy(model)
    other.blocks = [model.blocks[k] for k in order]
    other.held = {int(np.argmax(order == 0))}
    first, second = bench.run(model), bench.run(other, name="other")
    outlines = second.outlines(-1)
    there = np.concatenate([outlines[int(np.argmax(order == k))] for k in range(len(order))])
    _same(_end(first), there, np.concatenate(model.blocks), 1e-5, "another order of the blocks")


def far_block(drawn: Values, bench: Bench) -> None:
    """A held block far away takes no part; numbers that follow from the model's size are given."""
    model = _heap(drawn)
    other = copy.deepcopy(model)
    other.blocks.append(box(drawn["far"], -1, 1.0, 1.0))
    other.held = {0, len(other.blocks) - 1}
    first, second = bench.run(model), bench.run(other, name="other")
    there = np.concatenate(second.outlines(-1)[:-1])
    # forces follow their laws to 1e-5 (docs/theory.md, "When a step is accepted"), and which motion is the first to do
    # so depends on all blocks: with tolerances of 1e-7 the largest change of 150 draws falls from 6e-6 to 6e-7
    _same(_end(first), there, np.concatenate(model.blocks), 1e-5, "a block far away")


def far_block_automatic(drawn: Values, bench: Bench) -> None:
    """The same where the program chooses stiffness and step."""
    model = _heap(drawn)
    model.groups = [
        rock(more=f", unit_weight={WEIGHT!r}"),
        joint(friction=drawn["friction"]),
        "&stage name='w', until='equilibrium' /",
    ]
    model.blocks = [box(-4, -1, 9, 1)] + [box(1.2 * k - 3, 0, 1.0, 1.0 + 0.2 * k) for k in range(drawn["count"])]
    other = copy.deepcopy(model)
    other.blocks.append(box(20, -1, drawn["wide"], 1.0))
    other.held = {0, len(other.blocks) - 1}
    first, second = bench.run(model), bench.run(other, name="other")
    there = np.concatenate(second.outlines(-1)[:-1])
    _same(_end(first), there, np.concatenate(model.blocks), 0.05, "a block far away")


def _flight(drawn: Values) -> tuple[list[Points], np.ndarray]:
    random = np.random.default_rng(drawn["seed"])
    blocks, motions = [], []
    for k in range(drawn["count"]):
        blocks.append(polygon(random, random.uniform(0.3, 0.8)) + np.array([2.0 * k, random.uniform(-0.3, 0.3)]))
        motions.append([random.uniform(1, 4) * (1 if k % 2 == 0 else -1), random.uniform(-1, 1), random.uniform(-2, 2)])
    return blocks, np.array(motions)


def _fly(blocks: list[Points], motions: np.ndarray, friction: float) -> Model:
    model = Model(blocks=blocks, materials=list(range(1, len(blocks) + 1)))
    model.groups = [
        rock(k + 1, 1e9, 0.2, DENSITY, f", velocity={float(u)!r},{float(v)!r},{float(r)!r}")
        for k, (u, v, r) in enumerate(motions)
    ]
    model.groups += [
        joint(friction=friction, normal_stiffness=1e8, shear_stiffness=5e7),
        "&load gravity=0 /",
        "&run t_end=0.4, save_every=1000 /",
        "&time dt_max=0.001, displacement_ratio=1 /",
        "&contact stiffness=1e8 /",
    ]
    return model


def galilean(drawn: Values, bench: Bench) -> None:
    """Blocks that collide in flight, seen from a frame that moves."""
    blocks, motions = _flight(drawn)
    wind = np.array([drawn["wind"], -0.5 * drawn["wind"], 0.0])
    first = bench.run(_fly(blocks, motions, drawn["friction"]))
    second = bench.run(_fly(blocks, motions + wind, drawn["friction"]), name="other")
    there = _end(second) - 0.4 * wind[:2]
    _same(_end(first), there, np.concatenate(blocks), 1e-3, "a frame that moves")


def rotation(drawn: Values, bench: Bench) -> None:
    """Blocks that collide in flight, turned by any angle."""
    blocks, motions = _flight(drawn)
    angle = drawn["angle"]
    swung = motions.copy()
    swung[:, :2] = turned(motions[:, :2], angle)
    first = bench.run(_fly(blocks, motions, drawn["friction"]))
    second = bench.run(_fly([turned(p, angle) for p in blocks], swung, drawn["friction"]), name="other")
    _same(_end(first), turned(_end(second), -angle), np.concatenate(blocks), 1e-3, "a rotation of everything")


def half_step(drawn: Values, bench: Bench) -> None:
    """A block that slides to rest and one that falls: half the step, the same end within the error of the step."""
    model = _heap({**drawn, "count": 1, "seed": drawn["seed"]})
    model.blocks = [box(-4, -1, 9, 1), box(0, 0, 1, drawn["high"])]
    # the block alone: a floor with a speed would swing on its supports
    model.materials = [1, 2]
    moving = f", unit_weight={WEIGHT!r}, velocity={drawn['speed']!r},0,0"
    model.groups.append(rock(2, young=1e10, density=DENSITY, more=moving))
    other = copy.deepcopy(model)
    other.groups[3] = re.sub(r"dt_max=[^,]*", "dt_max=0.001", other.groups[3])
    first, second = bench.run(model), bench.run(other, name="other")
    # friction that begins half a step early or late as the weight comes changes the speed by tan(phi) g dt/2, and
    # the way of v^2/(2 g tan(phi)) by the share tan(phi) g dt/v: 3 % of that of a slow block
    allowed = max(0.01, math.tan(math.radians(drawn["friction"])) * G * 0.002 / drawn["speed"])
    _same(_end(first), _end(second), np.concatenate(model.blocks), allowed, "half the step")


def stiffness(drawn: Values, bench: Bench) -> None:
    """A column at rest: twice the stiffness of joints and rock, half the settlement."""
    ends = []
    for factor in (1.0, 2.0):
        model = Model(blocks=[box(-1, -1, 3, 1)], held={0})
        model.blocks += [box(0, 0.5 * k, 1, 0.5) for k in range(drawn["count"])]
        model.groups = [
            rock(young=drawn["young"] * factor, more=f", unit_weight={WEIGHT!r}"),
            joint(friction=35, normal_stiffness=1e9 * factor, shear_stiffness=1e9 * factor),
            "&stage name='w', until='equilibrium', tolerance=1e-8 /",
        ]
        ends.append(bench.run(model, name=f"times{factor:g}").moved()[-1][1])
    require(abs(ends[0] / ends[1] - 2) < 0.01, f"twice the stiffness: settlement {ends[0]:.5g} becomes {ends[1]:.5g}")


def tied_pieces(drawn: Values, bench: Bench) -> None:
    """A block that slides, cut into tied cells, goes as far."""
    ends = []
    for size in (0.0, drawn["size"]):
        model = Model(blocks=[turned(box(-9, -1, 14, 1), drawn["angle"]), turned(box(0, 0, 2, 1), drawn["angle"])])
        model.held = {0}
        model.groups = [
            rock(more=f", unit_weight={WEIGHT!r}"),
            joint(1, friction=0.6 * drawn["angle"], normal_stiffness=1e9, shear_stiffness=5e8),
            joint(2, 30, ", tie=.true."),
            "&run t_end=0.8, save_every=1000 /",
            "&time dt_max=0.001 /",
        ]
        if size:
            middle = model.blocks[1].mean(0)
            model.groups += [
                f"&region name='block', circle={float(middle[0])!r},{float(middle[1])!r},1.5 /",
                f"&subdivide region='block', size={size!r}, joint_material=2 /",
            ]
        moved = bench.run(model, name=f"size{size:g}").moved()
        ends.append(float(np.hypot(*moved[1:].mean(0))))
    require(
        abs(ends[1] / ends[0] - 1) < 0.01, f"cut into cells it slides {ends[1]:.5g} m, in one piece {ends[0]:.5g} m"
    )


HEAP = {"seed": seeds(), "count": st.integers(1, 5), "friction": between(5, 45, 40)}
FLIGHT = {"seed": seeds(), "count": st.integers(2, 4), "friction": between(0, 45, 9)}
KINDS = [
    Kind("units", "relations", "the same heap in other units", values(**HEAP, power=st.integers(-10, 10)), units),
    Kind("mirror", "relations", "the same heap in a mirror", values(**HEAP), mirror),
    Kind("permutation", "relations", "the same heap, its blocks in another order", values(**HEAP), permutation),
    Kind(
        "far-block",
        "relations",
        "the same heap beside a block far away, stiffness and step given",
        values(**HEAP, far=decades(20, 2000)),
        far_block,
    ),
    Kind(
        "far-block-automatic",
        "relations",
        "the same settlement beside a block far away, stiffness chosen by the program",
        values(count=st.integers(1, 5), friction=between(20, 45, 5), wide=decades(1, 200), seed=st.just(0)),
        far_block_automatic,
    ),
    Kind(
        "galilean",
        "relations",
        "the same collisions in a frame that moves",
        values(**FLIGHT, wind=between(-20, 20, 40)),
        galilean,
    ),
    Kind(
        "rotation",
        "relations",
        "the same collisions turned by an angle",
        values(**FLIGHT, angle=between(0, 360, 360)),
        rotation,
    ),
    Kind(
        "half-step",
        "relations",
        "a sliding block with half the step",
        values(seed=seeds(), friction=between(5, 40, 35), high=between(0.3, 0.8, 5), speed=between(0.5, 5, 9)),
        half_step,
    ),
    Kind(
        "twice-the-stiffness",
        "relations",
        "half the settlement of a column",
        values(count=st.integers(1, 8), young=decades(1e8, 1e11)),
        stiffness,
    ),
    Kind(
        "cut-into-cells",
        "relations",
        "a sliding block and the same one cut into tied cells",
        values(angle=between(20, 40, 20), size=between(0.25, 1.0, 6)),
        tied_pieces,
    ),
]
