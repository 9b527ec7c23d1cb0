# SPDX-License-Identifier: MIT
"""Rigid blocks on joints of given stiffness: closed forms of a base of springs that take no tension."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, G, Model, Unsuited, box, compare, joint, rock
from .drawing import Kind, Values, between, decades, values


def winkler_angle(width: float, height: float, weight: float, stiffness: float) -> float:
    """Tilt [degrees] at which a rigid block on springs without tension falls: gravity turned under it.

    The pressure is a triangle of length a = 3 (b/2 - e), the block turns by 2 W/(k a^2), and e is its height times the
    tangent of both: the largest tilt over all e.
    """
    edge = width / 2
    e = np.linspace(edge / 3, edge, 200001)[:-1]
    tilt = np.arctan(2 * e / height) - 2 * weight / (stiffness * 9 * (edge - e) ** 2)
    return math.degrees(float(tilt.max()))


def _block_on_floor(drawn: Values, floor: float = 1.0, parts: int = 1) -> Model:
    """A block at the middle of a held floor that reaches so many widths beyond it, drawn in so many pieces."""
    width, height = drawn["width"], drawn["width"] * drawn["slender"]
    whole, deep = width * (1 + 2 * floor), 0.5 * width * (1 + 2 * floor)
    model = Model(e0=1e-4 * width)
    model.blocks = [box(-floor * width + k * whole / parts, -deep, whole / parts, deep) for k in range(parts)]
    model.held = set(range(parts))
    model.blocks.append(box(0.0, 0.0, width, height))
    return model


def winkler_toe(drawn: Values, bench: Bench) -> None:
    model = _block_on_floor(drawn)
    width = drawn["width"]
    weight = 24525.0 * width * width * drawn["slender"]
    # the joint closes by this share of the width under the weight
    stiffness = weight / (width * width * drawn["closes"])
    model.groups = [
        rock(young=1e5 * stiffness * width, poisson=0.0, more=", unit_weight=24525.0"),
        joint(friction=60, normal_stiffness=stiffness, shear_stiffness=stiffness),
        "&stage name='w', until='equilibrium' /",
    ]
    truth = winkler_angle(width, width * drawn["slender"], weight, stiffness)
    # of the corner radius 0.01 of the shorter edge, and of the interval of the search
    found = bench.factor(model, "--search", "tilt", "--tolerance", f"{0.005 * truth:.3g}")
    compare("tilt at which the block falls [deg]", found, truth, 0.03)


def eccentric_load(drawn: Values, bench: Bench) -> None:
    width, force = drawn["width"], 1e5
    e = drawn["eccentric"] * width
    model = _block_on_floor({"width": width, "slender": 1.0})
    stiffness = force / (width * width * drawn["closes"])
    model.loading = [(width / 2 + e, 0.5 * width, 1)]
    model.groups = [
        rock(young=1e5 * stiffness * width, poisson=0.0, more=", unit_weight=0.0"),
        joint(friction=60, normal_stiffness=stiffness, shear_stiffness=stiffness),
        f"&loading_point force=0,0,{-force!r}, 1e9,0,{-force!r} /",
        "&stage name='w', until='equilibrium', tolerance=1e-8 /",
    ]
    run = bench.run(model)
    found = -float(run.get("frames/rotation")[-1][1])
    if e <= width / 6:
        truth = 12 * force * e / (stiffness * width**3)
    else:
        truth = 2 * force / (stiffness * (3 * (width / 2 - e)) ** 2)
    compare("rotation under the load", found, truth, 0.03)


def settlement_on_pieces(drawn: Values, bench: Bench) -> None:
    """The settlement of a block does not depend on the pieces in which its base is drawn."""
    moved = []
    for parts in (1, drawn["parts"]):
        model = _block_on_floor(drawn, parts=parts)
        stiffness = 24525.0 * drawn["slender"] / drawn["closes"]
        model.groups = [
            rock(young=1e5 * stiffness * drawn["width"], poisson=0.0, more=", unit_weight=24525.0"),
            joint(friction=45, normal_stiffness=stiffness, shear_stiffness=stiffness),
            "&stage name='w', until='equilibrium', tolerance=1e-8 /",
        ]
        shift = bench.run(model, name=f"pieces{parts}").moved()
        # supports give way, too
        moved.append(float(shift[:-1, 1].mean() - shift[-1, 1]))
    truth = drawn["closes"] * drawn["width"]
    for found in moved:
        compare("settlement on its joint", found, truth, 0.005)


def drawn_foundation(drawn: Values, bench: Bench) -> None:
    """The tilt at which a column falls does not depend on how much of the ground below it is drawn."""
    found = []
    for floor in (1.0, drawn["floor"]):
        model = _block_on_floor(drawn, floor)
        model.groups = [
            rock(more=", unit_weight=24525.0"),
            joint(friction=45),
            "&stage name='w', until='equilibrium' /",
        ]
        angle = math.degrees(math.atan(1 / drawn["slender"]))
        found.append(
            bench.factor(model, "--search", "tilt", "--tolerance", f"{0.005 * angle:.3g}", name=f"floor{floor:g}")
        )
    compare(f"tilt on a foundation {drawn['floor']:g} widths larger [deg]", found[1], found[0], 0.03)


def _mean_fall(stretch: np.ndarray) -> float:
    """How far a stretch that goes up and down falls, without the first time."""
    least = 0.25 * float(np.ptp(stretch))
    turns = [float(stretch[0])]  # a low, a peak, a low ...
    for value in map(float, stretch):
        rises = len(turns) % 2 == 0
        if (value > turns[-1]) == rises:
            turns[-1] = value
        elif abs(value - turns[-1]) > least:
            turns.append(value)
    falls = -np.diff(turns)[1:-1:2]
    if len(falls) < 3:
        raise Unsuited
    return float(falls[1:].mean())


def stick_slip(drawn: Values, bench: Bench) -> None:
    """A belt carries a block on a spring until it slides back: the fall of the stretch, by its equation of motion.

    Friction falls from tan 30 to tan 20 degrees by the law of the slip rate, whose scale is a share of what sliding
    reaches. The oracle goes on in steps of 2e-4 of the period (velocities half a step late).
    """
    omega, static, moving = drawn["omega"], math.tan(math.radians(30)), math.tan(math.radians(20))
    reached = (static - moving) * G / omega
    belt, rate = drawn["belt"] * reached, drawn["rate"] * reached
    duration = 5 * ((static - moving) * 2 * G / omega**2 / belt + 2 * math.pi / omega) + static * G / omega**2 / belt
    dt = 2e-4 * 2 * math.pi / omega
    x, v, found = 0.0, belt, []
    for _ in range(int(duration / dt)):
        held = omega**2 * x  # friction per mass that keeps the speed of the belt
        if not (v >= belt and held <= static * G):
            friction = G * (moving + (static - moving) * math.exp(-max(belt - v, 0.0) / rate))
            v = min(v + (friction - held) * dt, belt)
        x += v * dt
        found.append(x)
    model = Model(blocks=[box(-4, -1, 12, 1), box(0, 0, 1, 0.5), box(3, 0.1, 1, 0.5)], held={0, 2})
    model.groups = [
        rock(),
        joint(friction=30.0, more=f", law='velocity', residual_friction=20, slip_rate={rate!r}"),
        f"&fixed_point points=1,2,3,4, displacement=0,0,0, 1,0,0, {1 + duration!r},{belt * duration!r},0 /",
        f"&bolt from=0.5,0.25, to=3.5,0.25, stiffness={1250 * omega**2!r} /",
        f"&load gravity={G} /",
        "&stage name='weight', until='equilibrium' /",
        "&stage name='belt' /",
        f"&run t_end={1 + duration!r}, save_every=1 /",
        f"&time dt_max={drawn['step'] / omega!r} /",
    ]
    run = bench.run(model)
    stretch = (run.get("frames/centroid")[:, 1, 0] - 0.5)[run.get("frames/time") >= 1]
    compare("fall of the stretch", _mean_fall(stretch), _mean_fall(np.array(found)), 0.03)


KINDS = [
    Kind(
        "winkler-toe",
        "joints",
        "a rigid block on springs without tension: the tilt at which it falls, in closed form",
        values(width=between(0.5, 4), slender=between(2, 12), closes=decades(1e-5, 8e-3)),
        winkler_toe,
    ),
    Kind(
        "eccentric-load",
        "joints",
        "a rigid block on springs without tension under an eccentric load: its rotation, in closed form",
        values(width=between(0.5, 4), eccentric=between(0.05, 0.45, 40), closes=decades(1e-6, 1e-4)),
        eccentric_load,
    ),
    Kind(
        "settlement-on-pieces",
        "relations",
        "weight over stiffness of the joint, for a base of one piece and of several",
        values(width=between(0.5, 4), slender=between(0.3, 3), closes=decades(1e-6, 1e-4), parts=st.integers(2, 8)),
        settlement_on_pieces,
    ),
    Kind(
        "drawn-foundation",
        "relations",
        "the same tilt for any size of the ground that is drawn below a column",
        values(width=between(0.5, 2), slender=between(4, 20), floor=between(2, 40, 38)),
        drawn_foundation,
    ),
    Kind(
        "stick-slip",
        "joints",
        "a block on a spring that a belt carries until it slides back, by its equation of motion",
        values(
            omega=decades(3, 60, 12), belt=between(0.05, 0.3, 10), rate=between(0.2, 1, 8), step=decades(0.01, 0.1, 10)
        ),
        stick_slip,
    ),
]
