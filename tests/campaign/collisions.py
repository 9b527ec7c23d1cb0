# SPDX-License-Identifier: MIT
"""Blocks that strike: restitution on a floor and in flight, falls, rocking; against closed forms, pymunk and Box2D."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from .bench import (
    Bench,
    G,
    Model,
    Unsuited,
    area_of,
    box,
    centroid_of,
    deepest,
    joint,
    polar_of,
    require,
    rock,
    turned,
)
from .drawing import Kind, Values, between, decades, seeds, values
from .motion import GAINED, polygon

DENSITY = 2500.0
WEIGHT = f", unit_weight={DENSITY * G!r}"


def _velocity(vx: float, vy: float = 0.0, vr: float = 0.0) -> str:
    return f", velocity={vx!r},{vy!r},{vr!r}"


def crash_on_floor(drawn: Values, bench: Bench) -> None:
    """Two blocks of one height on a floor without friction: momentum, and the speeds of restitution."""
    left, right, height, speed, e = (drawn[name] for name in ("left", "right", "height", "speed", "restitution"))
    model = Model(blocks=[box(-9, -1, 30, 1), box(-left - 0.02, 0, left, height), box(0, 0, right, height)], held={0})
    model.materials = [1, 2, 1]
    model.groups = [
        rock(more=WEIGHT),
        rock(2, more=WEIGHT + _velocity(speed)),
        joint(friction=0, restitution=e),
        f"&run t_end={0.02 / speed + 0.1!r} /",
        "&time dt_max=0.0005 /",
        "&contact stiffness=1e9 /",
    ]
    run = bench.run(model)
    u, v = (float(run.get("frames/velocity")[-1][block][0]) for block in (1, 2))
    share = left / (left + right)
    for found, truth in ((u, speed * (share - e * (1 - share))), (v, speed * share * (1 + e))):
        # restitution ± 0.05
        require(
            abs(found - truth) <= 0.05 * speed,
            f"speeds {u:.3g} and {v:.3g} m/s after the crash of {speed:g} m/s, "
            f"the oracle says {speed * (share - e * (1 - share)):.3g} and {speed * share * (1 + e):.3g}",
        )


def flat_drop(drawn: Values, bench: Bench) -> None:
    """A block that falls flat on a floor: it leaves with the share of restitution of its speed."""
    height, e = drawn["height"], drawn["restitution"]
    model = Model(blocks=[box(-3, -1, 7, 1), box(0, height, 1, drawn["high"])], held={0})
    speed = math.sqrt(2 * G * height)
    fall = speed / G
    model.groups = [
        rock(more=WEIGHT),
        joint(friction=30, restitution=e),
        f"&run t_end={fall + 0.25 * max(e, 0.1) * speed / G + 0.01!r} /",
        f"&time dt_max={drawn['step']!r} /",
        "&contact stiffness=1e9 /",
        "&run save_every=1 /",
    ]
    run = bench.run(model)
    found = float(run.get("frames/velocity")[:, 1, 1].max()) / speed
    require(abs(found - e) <= 0.05, f"leaves with {found:.3g} of its speed, restitution {e:g}")


def _struck(drawn: Values) -> tuple[Model, list[np.ndarray], np.ndarray]:
    """Two polygons in flight without friction, on a course of collision."""
    random = np.random.default_rng(drawn["seed"])
    first, second = polygon(random, random.uniform(0.3, 1)), polygon(random, random.uniform(0.3, 1))
    reach = np.hypot(*first.T).max() + np.hypot(*second.T).max()
    second = second + np.array([reach + 0.05, drawn["aside"] * reach])
    model = Model(blocks=[first, second], materials=[1, 2])
    motions = np.array([[drawn["speed"], 0.0, random.uniform(-1, 1)], [0.0, 0.0, random.uniform(-1, 1)]])
    duration = float(2 * reach + 0.1) / drawn["speed"]
    model.groups = [
        *(rock(k + 1, 1e10, 0.2, DENSITY, _velocity(*map(float, motions[k]))) for k in (0, 1)),
        joint(friction=0, restitution=drawn["restitution"]),
        "&load gravity=0 /",
        f"&run t_end={duration!r} /",
        "&time dt_max=0.0002 /",
        "&contact stiffness=1e9 /",
    ]
    return model, [first, second], motions


def _judge_struck(drawn: Values, bench: Bench, other: np.ndarray, who: str) -> None:
    model, _, motions = _struck(drawn)
    if np.abs(other[:, :2] - motions[:, :2]).max() < 0.02 * drawn["speed"]:
        raise Unsuited  # they miss each other
    found = bench.run(model).get("frames/velocity")[-1][:, :3]
    apart = float(np.abs(found[:, :2] - other[:, :2]).max()) / drawn["speed"]
    # corners are round (0.01 of an edge) and joints give way: the normal turns a little
    words = f"{np.round(found[:, :2], 3).tolist()} after the strike, {who} says {np.round(other[:, :2], 3).tolist()}"
    require(apart <= 0.08, f"velocities {words}")


def flight_pymunk(drawn: Values, bench: Bench) -> None:
    import pymunk

    _, outlines, motions = _struck(drawn)

    def after(step: float, shift: float = 0.0) -> np.ndarray:
        space = pymunk.Space()
        space.gravity, space.collision_slop, space.iterations = (0, 0), 1e-6, 30
        bodies = []
        for points, motion in zip(outlines, motions, strict=True):
            middle, mass = centroid_of(points), DENSITY * area_of(points)
            body = pymunk.Body(mass, DENSITY * polar_of(points))
            aside = shift if bodies else 0.0
            body.position, body.velocity, body.angular_velocity = (
                (middle[0], middle[1] + aside),
                tuple(motion[:2]),
                float(motion[2]),
            )
            shape = pymunk.Poly(body, [tuple(map(float, p - middle)) for p in points])
            shape.elasticity, shape.friction = math.sqrt(drawn["restitution"]), 0.0
            space.add(body, shape)
            bodies.append(body)
        for _ in range(int(2.2 * (outlines[1][:, 0].max() + 1) / drawn["speed"] / step)):
            space.step(step)
        return np.array([[*body.velocity, body.angular_velocity] for body in bodies])

    other = after(1e-3 / drawn["speed"])
    # round corners and joints that give way move the place of the strike: where that decides, as with a corner on a
    # corner or a second strike, there is nothing to compare
    for step, shift in ((3e-3, 0.0), (1e-3, 0.02), (1e-3, -0.02)):
        if np.abs(other - after(step / drawn["speed"], shift))[:, :2].max() > 0.05 * drawn["speed"]:
            raise Unsuited
    _judge_struck(drawn, bench, other, "pymunk")


def _fallen_in_box2d(outlines: list[np.ndarray], push: float, friction: float, duration: float) -> int:
    import Box2D

    world = Box2D.b2World(gravity=(0, -G), doSleep=False)
    settings = Box2D.b2FixtureDef(density=1.0, friction=math.tan(math.radians(friction)), restitution=0.0)
    bodies = []
    for number, points in enumerate(outlines):
        body = (world.CreateDynamicBody if number else world.CreateStaticBody)(position=(0, 0))
        settings.shape = Box2D.b2PolygonShape(vertices=[tuple(map(float, p)) for p in points])
        body.CreateFixture(settings)
        bodies.append(body)
    bodies[1].linearVelocity, bodies[1].angularVelocity = (push / 2, 0), -push
    for _ in range(int(duration * 500)):
        world.Step(1 / 500, 20, 10)
    return sum(abs(body.angle) > 0.3 for body in bodies[1:])


def dominoes(drawn: Values, bench: Bench) -> None:
    """A row of dominoes of height 1, the first one struck: how many fall, by Box2D."""
    count, thick, push, friction = drawn["count"], 1 / drawn["slender"], drawn["push"], 30.0
    pitch = thick + drawn["gap"]
    outlines = [box(-1, -0.5, count * pitch + 3, 0.5)] + [box(k * pitch, 0, thick, 1.0) for k in range(count)]
    duration = 0.35 * count + 1.0
    fallen = _fallen_in_box2d(outlines, push, friction, duration)
    if any(_fallen_in_box2d(outlines, push * f, friction, duration) != fallen for f in (0.6, 1.5)):
        raise Unsuited  # a hair decides
    model = Model(blocks=outlines, held={0}, materials=[1, 2] + [1] * (count - 1))
    model.groups = [
        rock(more=WEIGHT),
        rock(2, more=WEIGHT + _velocity(push / 2, 0.0, -push)),
        joint(friction=friction, restitution=0.0),
        f"&run t_end={duration!r} /",
        "&time dt_max=0.002 /",
        "&contact stiffness=1e8 /",
    ]
    rotation = bench.run(model).get("frames/rotation")[-1][1:]
    found = int((np.abs(rotation) > 0.3).sum())
    require(abs(found - fallen) <= 1, f"{found} of {count} dominoes fall, Box2D says {fallen}")


def rocking(drawn: Values, bench: Bench) -> None:
    """A block that rocks on a floor without bouncing: its next swing, by Housner.

    His block is rigid. On a joint of stiffness k the toe carries the weight W on a length sqrt(2 W/(k angle)), here a
    sixtieth of the width at the release. With a fifteenth, blocks of 2 to 12 m swing up to 0.19 less, at any step.
    """
    slender, share = drawn["slender"], drawn["share"]
    width = drawn["width"]
    height = width * slender
    alpha = math.atan(1 / slender)
    start = share * alpha
    kept = (1 - 1.5 * math.sin(alpha) ** 2) ** 2
    cosine = math.cos(alpha) + kept * (math.cos(alpha - start) - math.cos(alpha))
    truth = (alpha - math.acos(cosine)) / start
    radius = 0.5 * math.hypot(width, height)
    stiffness = 2 * DENSITY * G * slender * 60**2 / start
    frequency = math.sqrt(3 * G / (4 * radius))
    quarter = math.acosh(1 / (1 - share)) / frequency
    model = Model(
        blocks=[box(-5 * width, -width, 10 * width, width), turned(box(-width, 0, width, height), -math.degrees(start))]
    )
    model.held = {0}
    model.e0 = 1e-4 * width
    model.groups = [
        rock(more=WEIGHT),
        joint(friction=60, restitution=0),
        f"&run t_end={2.4 * quarter!r}, save_every=1 /",
        f"&time dt_max={0.002 * math.sqrt(width)!r} /",
        f"&contact stiffness={stiffness!r} /",
    ]
    rotation = bench.run(model).get("frames/rotation")[:, 1] - start
    # the block stands at -start and swings to the other side
    found = float(rotation.max()) / start
    found = max(found, 0.0)
    require(abs(found - truth) <= 0.04, f"swings to {found:.3f} of its release, Housner says {truth:.3f}")


def falls(drawn: Values, bench: Bench) -> None:
    """Polygons that fall on soft joints: no block ends inside another, or the program says so."""
    random = np.random.default_rng(drawn["seed"])
    model = Model(blocks=[box(-6, -2, 12, 2), box(-0.5, 0, 1, drawn["high"])], held={0}, materials=[1, 1, 2])
    falling = turned(box(-0.35, 0, 0.7, 0.65), float(random.uniform(0, 90)))
    falling = falling + np.array([random.uniform(-0.8, 0.8), drawn["high"] + 0.05 - falling[:, 1].min()])
    model.blocks.append(falling)
    model.groups = [
        rock(more=WEIGHT),
        rock(2, more=WEIGHT + _velocity(0.0, -drawn["speed"])),
        joint(friction=drawn["friction"]),
        "&run t_end=0.6 /",
        f"&contact stiffness={drawn['stiffness']!r} /",
    ]
    run = bench.run(model)
    depth, _, pair = deepest(run.outlines(-1))
    told = "inside" in run.messages or "overlap" in run.messages or "lie in each other" in run.messages
    # a column of the falling block that arrives with its speed, three times over, and its weight ten times over
    arrives = 3 * drawn["speed"] * math.sqrt(DENSITY * 0.5 / drawn["stiffness"]) + 1e5 / drawn["stiffness"]
    inner = 0.02 * 0.3
    require(
        told or depth <= max(inner, min(arrives, 0.06)),
        f"{pair} lie in each other by {depth:.3g} m at the end, and nothing says so",
    )


def thud(drawn: Values, bench: Bench) -> None:
    """A polygon or a bar that falls on a floor, with the numbers of the program: it rises no higher than it began."""
    random = np.random.default_rng(drawn["seed"])
    falling = polygon(random, drawn["size"], drawn["aspect"])
    if drawn["is_bar"]:
        falling = turned(box(0, 0, drawn["size"], drawn["size"] / drawn["aspect"]), float(random.uniform(0, 90)))
    falling = falling - [0.0, falling[:, 1].min() - drawn["drop"] * drawn["size"]]
    floor = 6 * drawn["size"]
    model = Model(blocks=[box(-floor, -floor / 3, 2 * floor, floor / 3), falling], held={0})
    model.groups = [
        rock(more=WEIGHT),
        joint(friction=drawn["friction"]),
        f"&run t_end={6 * math.sqrt(2 * (drawn['drop'] + 1) * drawn['size'] / G)!r} /",
    ]
    run = bench.run(model)
    energy = run.energy()
    total = energy["kinetic"] + energy["strain"] + energy["gravity"] + energy["springs"]
    weight = DENSITY * G * area_of(falling)
    grows = float(total.max()) / (weight * float(centroid_of(falling)[1]))
    told = "energy from nowhere" in run.messages
    require(grows <= 0.5, f"energy grows by {grows:.3g} of that above the floor")
    require(told or grows <= 0.15, f"energy grows by {grows:.3g} of that above the floor, and nothing says so")


def _splinter(random: np.random.Generator, size: float, thin: float, shape: str) -> np.ndarray:
    """A polygon with one short edge, a wedge with a sharp tip, or a block that is small in all."""
    if shape == "crumb":
        return polygon(random, thin * size)
    if shape == "wedge":
        return turned([[0, 0], [size, 0], [random.uniform(0, 1) * size, thin * size]], float(random.uniform(0, 360)))
    points = polygon(random, size)
    k = int(random.integers(len(points)))
    back = points[k - 1] - points[k]
    # the corner is cut off near its tip
    ahead = points[(k + 1) % len(points)] - points[k]
    cut = [points[k] + thin * size * side / np.hypot(*side) for side in (back, ahead)]
    return np.vstack([points[:k], *cut, points[k + 1 :]])


def splinters(drawn: Values, bench: Bench) -> None:
    """A block falls on a floor with a slab, beside or on others that have edges or sizes of a thousandth of it."""
    random = np.random.default_rng(drawn["seed"])
    size, thin = drawn["size"], drawn["thin"]
    blocks, top = [box(-6 * size, -2 * size, 12 * size, 2 * size), box(-size, 0, 2 * size, 0.5 * size)], 0.5 * size
    for _ in range(drawn["count"]):
        one = _splinter(random, size, thin, drawn["shape"])
        shift = np.array([random.uniform(-0.5, 0.5) * size, top + 0.02 * thin * size])
        one = one + shift - [one[:, 0].mean(), one[:, 1].min()]
        blocks.append(one)
        top = float(one[:, 1].max())
    falling = turned(box(-0.4 * size, 0, 0.8 * size, 0.6 * size), float(random.uniform(0, 90)))
    shift = np.array([random.uniform(-0.5, 0.5) * size, top + 0.05 * size])
    blocks.append(falling + shift - [0.0, falling[:, 1].min()])
    model = Model(blocks=blocks, held={0}, materials=[1] * (len(blocks) - 1) + [2], e0=1e-3 * thin * size)
    second = math.sqrt(size)
    model.groups = [
        rock(more=WEIGHT),
        rock(2, more=WEIGHT + _velocity(0.0, -drawn["speed"] * second)),
        joint(friction=drawn["friction"]),
        f"&run t_end={0.6 * second!r} /",
    ]
    run = bench.run(model, may_fail=True)
    if run.code:
        require(run.code == 3, f"exit {run.code}")
        raise Unsuited  # it says that its steps cannot be solved
    energy = run.energy()
    total = energy["kinetic"] + energy["strain"] + energy["gravity"] + energy["springs"]
    supplied = float(energy["kinetic"][0] - energy["gravity"].min())
    # a blow that no step resolves gives back within some steps what it took: what rises above ten steps counts
    before = np.lib.stride_tricks.sliding_window_view(np.r_[np.full(9, total[0]), total[:-1]], 10).max(axis=1)
    grows = float(np.maximum(total[1:] - before, 0.0).sum()) / supplied
    told = "energy from nowhere" in run.messages or "inside each other" in run.messages
    require(told or grows <= GAINED, f"energy grows by {grows:.3g} of what fall and speed supply, and nothing says so")


RESTITUTION = between(0.0, 0.8, 8)
KINDS = [
    Kind(
        "crash-on-floor",
        "collisions",
        "momentum and restitution of two blocks on a floor without friction",
        values(
            left=between(0.5, 2, 15),
            right=between(0.5, 2, 15),
            height=between(0.5, 1.5, 10),
            speed=between(0.5, 4, 35),
            restitution=RESTITUTION,
        ),
        crash_on_floor,
    ),
    Kind(
        "flat-drop",
        "collisions",
        "the speed after a flat fall is e times the one before",
        values(
            height=between(0.3, 2, 17), high=between(0.3, 2, 17), restitution=RESTITUTION, step=decades(2e-4, 2e-3, 10)
        ),
        flat_drop,
    ),
    Kind(
        "flight-pymunk",
        "collisions",
        "velocities after two polygons have struck in flight, by pymunk",
        values(seed=seeds(), aside=between(-0.5, 0.5, 20), speed=between(2, 10, 16), restitution=between(0.0, 0.8, 8)),
        flight_pymunk,
        needs="pymunk",
    ),
    Kind(
        "dominoes",
        "collisions",
        "how many dominoes of a row fall, by Box2D",
        values(
            count=st.integers(3, 10),
            gap=between(0.2, 0.8, 12),
            slender=between(4, 8, 8),
            push=between(0.5, 3, 10),
        ),
        dominoes,
        needs="Box2D",
    ),
    Kind(
        "rocking",
        "collisions",
        "the next swing of a rocking block by Housner, without bouncing",
        values(width=between(0.3, 2, 17), slender=between(2.5, 6, 14), share=between(0.3, 0.7, 8)),
        rocking,
    ),
    Kind(
        "falls",
        "collisions",
        "blocks that fall on soft joints end in no other block, or the program says so",
        values(
            seed=seeds(),
            high=between(0.3, 1, 7),
            speed=between(3, 8, 10),
            friction=between(0, 45, 9),
            stiffness=decades(2e7, 3e8, 12),
        ),
        falls,
    ),
    Kind(
        "thud",
        "collisions",
        "a block that falls on a floor gains no energy",
        values(
            seed=seeds(),
            size=decades(0.1, 10, 8),
            aspect=st.sampled_from([1.0, 3.0, 7.0]),
            is_bar=st.booleans(),
            drop=decades(0.02, 1, 8),
            friction=between(0, 45, 9),
        ),
        thud,
    ),
    Kind(
        "splinters",
        "collisions",
        "blocks that fall on splinters and crumbs gain no energy, or the program says so",
        values(
            seed=seeds(),
            size=decades(0.1, 10, 4),
            thin=decades(1e-4, 1e-2, 8),
            shape=st.sampled_from(["short edge", "wedge", "crumb"]),
            count=st.integers(1, 3),
            speed=between(0, 5, 5),
            friction=between(0, 45, 9),
        ),
        splinters,
    ),
]
