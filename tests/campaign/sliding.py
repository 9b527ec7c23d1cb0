# SPDX-License-Identifier: MIT
"""Blocks that slide: plane failure, rigid sliding on a base that shakes, bases in pieces, run-out."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Fault, G, Model, Unsuited, box, compare, joint, rock, turned
from .drawing import Kind, Values, between, decades, values
from .limits import strength_factor, touches


def plane_failure(drawn: Values, bench: Bench) -> None:
    """A wedge of rock on a plane that daylights: F = (c L + W cos tan phi) / (W sin)."""
    height, face, plane = drawn["height"], drawn["face"], drawn["plane"]
    if face - plane < 8:
        raise Unsuited
    cot_face, cot_plane = 1 / math.tan(math.radians(face)), 1 / math.tan(math.radians(plane))
    # toe at 0,0; the rock lies at x > 0
    crest, tail = np.array([height * cot_face, height]), np.array([height * cot_plane, height])
    toe = np.zeros(2)
    below = 0.3 * height
    # the ground falls away at the toe: the plane daylights
    base = np.array([[0.0, -below], [tail[0] + below, -below], [tail[0] + below, height], tail, toe])
    wedge = np.array([toe, tail, crest])
    area = 0.5 * height * float(tail[0] - crest[0])
    length = height / math.sin(math.radians(plane))
    weight = 25000.0 * area
    sine, cosine = math.sin(math.radians(plane)), math.cos(math.radians(plane))
    cohesion = drawn["cohesive"] * weight * sine / length
    truth = drawn["factor"]
    tangent = (truth * weight * sine - cohesion * length) / (weight * cosine)
    if tangent < 0.02 or tangent > 2.5:
        raise Unsuited
    model = Model(blocks=[base, wedge], held={0}, e0=1e-4 * height)
    model.groups = [
        rock(young=2e10, more=", unit_weight=25000.0"),
        joint(friction=math.degrees(math.atan(tangent)), cohesion=cohesion),
        "&stage name='w', until='equilibrium' /",
    ]
    found = bench.factor(model)
    if truth < 1 and math.isnan(found):
        raise Fault(f"no factor below 1: refused, the oracle says {truth:.4g}")
    # the interval of the search is 0.01 of the factor
    compare("factor of safety", found, truth, 0.02)


def wedge_of_two(drawn: Values, bench: Bench) -> None:
    """An active and a passive block, from limit analysis: friction without dilation lies at most 6 % below it."""
    height = drawn["height"]
    steep, flat = math.radians(drawn["steep"]), math.radians(drawn["flat"])
    # the passive block slides on the flat plane, the active one behind it on the steep plane; vertical joint between
    front = height * drawn["front"]
    knick = np.array([front, front * math.tan(flat)])
    if knick[1] > 0.7 * height:
        raise Unsuited
    top = np.array([knick[0] + (height - knick[1]) / math.tan(steep), height])
    # the joint leaves the steep plane above the knick, or there: the tip of the active block then meets the flat plane
    foot = knick + drawn["raised"] * (top - knick)
    joint_top = np.array([foot[0], height])
    face = np.array([min(0.3 * height, 0.6 * front), height])
    passive = np.array([[0.0, 0.0], knick, *([foot] if drawn["raised"] > 0 else []), joint_top, face])
    active = np.array([foot, top, joint_top])
    low = -0.3 * height
    base = np.array([[0.0, low], [top[0] - low, low], [top[0] - low, height], top, knick, [0, 0]])
    blocks = [base, passive, active]
    friction = drawn["friction"]
    truth = strength_factor(blocks, {0}, touches(blocks, math.tan(math.radians(friction))))
    if not 1.03 < truth < 5:
        raise Unsuited
    model = Model(blocks=blocks, held={0}, e0=1e-4 * height)
    model.groups = [
        rock(young=5e10, more=", unit_weight=25000.0"),
        joint(friction=friction),
        "&stage name='w', until='equilibrium' /",
    ]
    found = bench.factor(model)
    compare("factor of safety", found, truth, 0.07, 0.02)


def slide(drawn: Values, bench: Bench) -> None:
    """A block that slides down a plane in pieces, from rest: s = g (sin - cos tan phi) t^2 / 2."""
    angle, parts, width = drawn["angle"], drawn["parts"], drawn["width"]
    friction = drawn["share"] * angle
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    acceleration = G * (sine - cosine * math.tan(math.radians(friction)))
    duration = math.sqrt(2 * drawn["way"] * width / acceleration)
    truth = drawn["way"] * width
    length = width * (4 + drawn["way"])
    model = Model(e0=1e-4 * width)
    model.blocks = [
        turned(box(-length + width * 2 + k * length / parts, -width, length / parts, width), angle)
        for k in range(parts)
    ]
    model.held = set(range(parts))
    model.blocks.append(turned(box(0, 0, width, 0.5 * width), angle))
    model.groups = [
        rock(more=", unit_weight=24525.0"),
        joint(friction=friction),
        f"&run t_end={duration!r} /",
        f"&time dt_max={drawn['step'] * math.sqrt(width)!r} /",
    ]
    moved = bench.run(model).moved()[-1]
    along = -float(moved @ np.array([cosine, sine]))
    # a block that starts at once dips into its joint: some 1e-3 of its width
    compare("way down the plane [m]", along, truth, 0.01)


def _rigid_slip(times: np.ndarray, base: np.ndarray, angle: float, friction: float) -> float:
    """Slip down a plane of a rigid block on a base that moves with a horizontal acceleration (Newmark)."""
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    tangent = math.tan(math.radians(friction))
    fine = np.linspace(0, times[-1], 200001)
    a = np.interp(fine, times, base)
    # an acceleration of the base towards the rising side pushes the block down; it never slides up here
    drive = G * sine + a * cosine
    normal = G * cosine - a * sine
    step = fine[1] - fine[0]
    speed = slip = 0.0
    for net in (drive - tangent * normal) * step:
        new = max(0.0, speed + net)
        slip += 0.5 * (speed + new) * step
        speed = new
    return slip


def newmark(drawn: Values, bench: Bench) -> None:
    """Slip of a block on a plane that shakes in pulses: the rigid block's, at any step."""
    angle, friction = drawn["angle"], drawn["angle"] + drawn["reserve"]
    frequency, cycles = drawn["frequency"], 3
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    tangent = math.tan(math.radians(friction))
    yields = G * (tangent * cosine - sine) / (cosine + tangent * sine)
    amplitude = drawn["strength"] * yields
    uphill = G * (tangent * cosine + sine) / (cosine - tangent * sine)
    if amplitude > 0.9 * uphill or amplitude > 0.8 * G:
        raise Unsuited
    times = np.linspace(0, (cycles + 0.5) / frequency, 401)
    base = amplitude * np.sin(2 * math.pi * frequency * times) * np.minimum(1, times * frequency)
    base[times > cycles / frequency] = 0.0
    truth = _rigid_slip(times, base, angle, friction)
    if truth < 1e-4:
        raise Unsuited
    model = Model(e0=1e-4)
    model.blocks = [turned(box(-6, -1, 12, 1), angle), turned(box(-1, 0, 2, 1), angle)]
    model.held = {0}
    rows = "".join(f"{t:.6f},{a:.9g},0\n" for t, a in zip(times, base, strict=True))
    model.files = {"a.csv": "t,ax,ay\n" + rows}
    model.groups = [
        rock(young=2e10, more=", unit_weight=24525.0"),
        joint(friction=friction),
        "&load base_acceleration='a.csv' /",
        f"&time dt_max={drawn['step']!r} /",
        "&stage name='w', until='equilibrium' /",
        f"&stage name='q', kind='dynamic', duration={float(times[-1])!r}, reset_displacement=.true. /",
    ]
    run = bench.run(model)
    first = int(np.argmax(run.get("frames/time") > 0))
    moved = run.moved() - run.moved(first)
    relative = moved[1] - moved[0]
    along = -float(relative @ np.array([cosine, sine]))
    compare(f"slip with steps of {drawn['step']:g} s [m]", along, truth, 0.02)


def run_out(drawn: Values, bench: Bench) -> None:
    """A block with a speed on a level floor stops after v^2 / (2 g tan phi)."""
    speed, friction = drawn["speed"], drawn["friction"]
    truth = speed**2 / (2 * G * math.tan(math.radians(friction)))
    model = Model(e0=1e-4)
    reach = truth + 3
    model.blocks = [box(-2, -1, reach + 2, 1), box(0, 0, 1.0, 0.3)]
    model.materials = [1, 2]
    model.held = {0}
    model.groups = [
        rock(more=", unit_weight=24525.0"),
        rock(2, more=f", unit_weight=24525.0, velocity={speed!r},0,0"),
        joint(friction=friction),
        f"&run t_end={1.3 * speed / (G * math.tan(math.radians(friction)))!r} /",
        f"&time dt_max={drawn['step']!r} /",
    ]
    compare("way to rest [m]", float(bench.run(model).moved()[1][0]), truth, 0.01)


def friction_under_water(drawn: Values, bench: Bench) -> None:
    """A block on the level under a still table, pushed: (W - uplift) tan phi."""
    width, height, depth = drawn["width"], drawn["width"] * drawn["slender"], drawn["depth"]
    model = Model(e0=1e-4 * width)
    model.blocks = [box(-3 * width, -width, 7 * width, width), box(0, 0, width, height)]
    model.held = {0}
    level = depth * height
    friction = drawn["friction"]
    tangent = math.tan(math.radians(friction))
    unit = 24525.0
    under = width * level * 9810.0
    weight = unit * width * height
    truth = (weight - under) * tangent / weight
    # it slides before it topples, with a margin: level water on both sides gives no moment
    pressed = weight - under
    if pressed <= 0.1 * weight or tangent * (weight - under) * height / 2 > 0.7 * pressed * width / 2:
        raise Unsuited
    model.groups = [
        rock(young=2e10, more=f", unit_weight={unit!r}"),
        joint(friction=friction),
        f"&water name='w', table=0,{level!r}, unit_weight=9810 /",
        "&stage name='w', until='equilibrium', water='w' /",
    ]
    found = bench.factor(model, "--search", "push", "--tolerance", f"{0.005 * truth:.3g}")
    compare("push over weight", found, truth, 0.02)


KINDS = [
    Kind(
        "plane-failure",
        "stability",
        "F = (c L + W cos ψ tan φ)/(W sin ψ), from 1.1 to 3",
        values(
            height=between(5, 80),
            face=between(45, 85, 40),
            plane=between(20, 60, 40),
            factor=decades(1.1, 3),
            cohesive=between(0, 0.8, 8),
        ),
        plane_failure,
    ),
    Kind(
        "below-one",
        "stability",
        "the same where the plane does not stand: F from 0.3 to 0.9",
        values(
            height=between(5, 80),
            face=between(45, 85, 40),
            plane=between(20, 60, 40),
            factor=decades(0.3, 0.9),
            cohesive=between(0, 0.8, 8),
        ),
        plane_failure,
    ),
    Kind(
        "wedge-of-two",
        "stability",
        "limit analysis of an active and a passive block, strength reduced",
        values(
            height=between(5, 60),
            steep=between(45, 70, 25),
            flat=between(5, 25, 20),
            front=between(0.5, 1.5, 20),
            friction=between(20, 45, 25),
            raised=st.sampled_from([0.0, 0.02, 0.1]),
        ),
        wedge_of_two,
    ),
    Kind(
        "slide-on-pieces",
        "sliding",
        "g (sin ψ – cos ψ tan φ) t²/2 on a plane of any number of pieces",
        values(
            angle=between(20, 45, 25),
            share=between(0.3, 0.9, 12),
            parts=st.integers(1, 8),
            width=decades(0.2, 20),
            way=between(1, 4, 12),
            step=decades(2e-4, 4e-3),
        ),
        slide,
    ),
    Kind(
        "newmark",
        "sliding",
        "slip of the rigid block, integrated by itself, at steps of 0.1 to 2 ms",
        values(
            angle=between(5, 25, 20),
            reserve=between(5, 15, 10),
            frequency=between(1, 4, 12),
            strength=between(1.5, 3, 15),
            step=decades(1e-4, 2e-3, 12),
        ),
        newmark,
    ),
    Kind(
        "run-out",
        "sliding",
        "v²/(2 g tan φ)",
        values(speed=between(1, 5, 40), friction=between(10, 40, 30), step=decades(2e-4, 4e-3)),
        run_out,
    ),
    Kind(
        "push-under-water",
        "water",
        "(W – γw × area under the table) tan φ",
        values(
            width=between(0.5, 10), slender=between(0.3, 1.5, 24), depth=between(0.1, 1.0, 18), friction=between(10, 40)
        ),
        friction_under_water,
    ),
]
