# SPDX-License-Identifier: MIT
"""A block on an incline: does it stand, slide, topple, or both? And a wedge in a groove.

A block of width b along the incline and height h across it, incline a, friction f (Ashby 1971; Bray and Goodman 1981).
The truth is the motion of a rigid block from rest. With the masses taken out, N and T the forces across and along the
incline, s the acceleration down it at the lower corner and w the angular acceleration, forwards:

    topples about the fixed corner   w = g/2 (h sin a - b cos a) / ((b² + h²)/3),  |T| ≤ N tan f
    slides                           s = g (sin a - cos a tan f),  h tan f ≤ b
    both                             w (b² + h²)/12 = N/2 (h tan f - b),  N = g cos a + w b/2,
                                     s = g sin a - N tan f - w h/2

A symmetric wedge of weight W in a groove of half angle a, each face with normal and shear springs kn and ks: it sinks
by W/(2 (kn sin² a + ks cos² a)) while the faces hold, and presses on each with N = W/(2 (sin a + tan f cos a)) when
they slip.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rockdda.model import Model
from rockdda.plot.style import PALETTE

from ..bracket import bracket
from ..case import Case, Record

if TYPE_CHECKING:
    from rockdda.results import Results

GRAVITY, DENSITY = 10.0, 2500.0  # m/s², kg/m²
HEIGHT = 1.0  # m, of the block
STAND, SLIDE, TOPPLE, BOTH = "stands", "slides", "topples", "topples and slides"
TIME, DT = 0.1, 5e-4  # s: how long the first motion is looked at (a toppling block may begin to slip later)
SETTLING = 200  # static steps
SMALL = 0.01 * GRAVITY  # accelerations below are none: of the corner, and of the top against it


def accelerations(incline: float, width: float, friction: float) -> tuple[float, float]:
    """Of the lower corner down the incline, and of the angle, of a rigid block from rest; angles in rad."""
    g, h, tangent = GRAVITY, HEIGHT, math.tan(friction)
    sine, cosine = math.sin(incline), math.cos(incline)
    spin = 0.5 * g * (h * sine - width * cosine) / ((width**2 + h**2) / 3)
    if spin > 0 and abs(g * sine - spin * h / 2) <= tangent * (g * cosine + spin * width / 2):
        return 0.0, spin
    if h * tangent > width and (spin > 0 or sine > cosine * tangent):
        arm = 0.5 * (h * tangent - width)
        spin = arm * g * cosine / ((width**2 + h**2) / 12 - arm * width / 2)
        normal = g * cosine + spin * width / 2
        return g * sine - tangent * normal - spin * h / 2, spin
    return max(0.0, g * (sine - cosine * tangent)), 0.0


def mode(slip: float, spin: float) -> str:
    """What accelerations mean."""
    slides, topples = slip > SMALL, spin * HEIGHT > SMALL
    if topples:
        return BOTH if slides else TOPPLE
    return SLIDE if slides else STAND


def block(incline: float, width: float, friction: float, stiffness: float = 1e9) -> Model:
    """A block on a fixed one that is turned by the incline, lower to the right; angles in rad."""
    model = Model("incline", e0=0.001, dt_max=DT, stiffness=stiffness, displacement_ratio=0.05)
    c, s = math.cos(incline), math.sin(incline)

    def place(x: float, y: float) -> tuple[float, float]:
        return x * c + y * s, -x * s + y * c

    model.add_polygon([place(*p) for p in ((-3, -1), (3, -1), (3, 0), (-3, 0))])
    model.add_polygon([place(*p) for p in ((-width, 0), (0, 0), (0, HEIGHT), (-width, HEIGHT))])
    for p in ((-2.9, -0.9), (2.9, -0.9), (-2.9, -0.1), (2.9, -0.1)):
        model.add_fixed(place(*p))
    model.add_measured(place(-width / 2, HEIGHT / 2))
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=1e11, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=math.degrees(friction))
    return model


def first_motion(results: Results, incline: float, width: float) -> tuple[float, float]:
    """Accelerations as above, from the ways at half time and at the end.

    The difference of the two halves leaves out the speed that the block gets before its contacts carry (gravity acts at
    once, friction only after the first step).
    """
    way, turn = results["history/measured_displacement"][:, 0], results["history/measured_rotation"][:, 0]
    # of the lower corner, along the incline: that of the centroid, and the turn about it
    corner = way @ (math.cos(incline), -math.sin(incline))
    corner += (np.cos(turn) - 1) * width / 2 + np.sin(turn) * HEIGHT / 2
    half = len(turn) // 2
    scale = (0.5 * float(results["history/time"][-1])) ** 2
    return tuple(float(sign * (x[-1] - 2 * x[half - 1]) / scale) for sign, x in ((1, corner), (-1, turn)))


def _settled(model: Model, seconds: float) -> Model:
    """Settles without inertia first, in steps that are long enough to come to rest in that stage."""
    model.dt_max = 5e-3
    model.steps = SETTLING + round(seconds / model.dt_max)
    model.options["stage"] = [{"until_step": SETTLING, "k01": 0.0}, {"k01": 1.0}]
    return model


def single_block(record: Record) -> None:
    _onsets(record)
    _chart(record)
    _wedge(record)
    record.energy_closes()


def _onsets(record: Record) -> None:
    incline = math.radians(30.0)
    record.text(
        f"*Onset of sliding and of toppling.* A block on an incline settles for {SETTLING} static steps and is then "
        "left to itself for 1 s. It slides when it has moved by more than 10 µm, and topples when it has turned by "
        "more than 1 mrad; friction and width are bisected."
    )

    def holds(friction: float) -> bool:
        model = _settled(block(incline, HEIGHT, math.radians(friction)), 1.0)
        way = record.run(model, f"sliding-{friction:.6g}", save_every=model.steps)["history/measured_displacement"]
        return bool(np.hypot(*(way[-1, 0] - way[SETTLING - 1, 0])) < 1e-5)

    found = bracket(holds, 29.0, 31.0, 0.001 if record.full else 0.02)
    record.compare(
        "friction angle at which a block on an incline of 30° begins to slide",
        found.middle,
        "°",
        truth=30.0,
        truth_source="tan φ = tan α",
        scale=1.0,
        allowed=found.width,
        explanation=f"bracket {found}",
    )
    steep = math.radians(15.0)

    def stands(width: float) -> bool:
        model = _settled(block(steep, width, math.radians(40.0), 1e10), 1.0)
        turn = record.run(model, f"toppling-{width:.6g}", save_every=model.steps)["history/measured_rotation"]
        return bool(abs(turn[-1, 0] - turn[SETTLING - 1, 0]) < 1e-3)

    found = bracket(stands, 0.26, 0.276, 1e-4 if record.full else 1e-3)
    record.compare(
        "width over height at which a block on an incline of 15° begins to topple",
        found.middle,
        truth=math.tan(steep),
        truth_source="b/h = tan α",
        allowed=0.002 if record.full else 0.004,
        explanation=f"bracket {found}",
    )


def _chart(record: Record) -> None:
    friction = math.radians(30.0)
    inclines = np.radians(np.arange(4.0, 62.0, 4.0) if record.full else np.array([10.0, 25.0, 36.0, 52.0]))
    widths = np.arange(0.1, 1.45, 0.1) if record.full else np.array([0.2, 0.5, 1.0])
    rows, wrong, margins = [], 0, 0
    for n, incline in enumerate(inclines):
        for k, width in enumerate(widths):
            expected = accelerations(incline, width, friction)
            if any(0.3 * SMALL < a < 3 * SMALL for a in (expected[0], expected[1] * HEIGHT)):
                margins += 1  # too near to a boundary for a verdict from so short a time
                continue
            model = block(incline, width, friction)
            model.steps = round(TIME / DT)
            results = record.run(model, f"chart-{n}-{k}", save_every=model.steps)
            found = first_motion(results, incline, width)
            rows.append((math.degrees(incline), width, mode(*expected), mode(*found)))
            wrong += rows[-1][2] != rows[-1][3]
    record.text(
        f"*How it moves.* {len(rows)} blocks of different slenderness on different inclines, friction 30°, released "
        f"at once; the mode is that of the first {TIME:g} s (accelerations of less than {SMALL / GRAVITY:g} g count "
        f"as none; {margins} points that are nearer to a boundary than that are left out)."
    )
    record.compare(
        "blocks that move in another mode than a rigid block does",
        wrong,
        truth=0.0,
        truth_source="equations of motion of a rigid block",
        scale=1.0,
        allowed=0.0,
    )
    if not record.full:
        return
    colours = {STAND: PALETTE[5], SLIDE: PALETTE[3], TOPPLE: PALETTE[4], BOTH: PALETTE[2]}
    markers = {STAND: "s", SLIDE: ">", TOPPLE: "^", BOTH: "D"}
    with record.style():
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(figsize=(6.3, 3.4), layout="constrained")
        fine_a, fine_w = np.linspace(0.5, 65, 260), np.linspace(0.01, 1.5, 240)
        order = list(colours)
        kinds = []
        for width in fine_w:
            pairs = [accelerations(math.radians(a), width, friction) for a in fine_a]
            kinds.append([order.index(_rigid_mode(*pair)) for pair in pairs])
        levels = np.array(kinds, dtype=float)
        for n in range(len(order)):
            axes.contour(fine_a, fine_w, (levels == n).astype(float), [0.5], colors="black", linewidths=0.7)
        for name in order:
            points = [(a, w) for a, w, _, found in rows if found == name]
            axes.plot(
                *zip(*points, strict=True), markers[name], ms=4.5, color=colours[name], linestyle="none", label=name
            )
        axes.set(xlabel="incline [°]", ylabel="width over height", xlim=(0, 65), ylim=(0, 1.5))
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="DDA")
    record.figure(
        figure,
        "chart",
        "How a block on an incline moves, friction 30°. Lines: rigid block; symbols: DDA.",
    )


def _rigid_mode(slip: float, spin: float) -> str:
    """Without the threshold for what counts as motion."""
    if spin > 0:
        return BOTH if slip > 0 else TOPPLE
    return SLIDE if slip > 0 else STAND


def _wedge(record: Record) -> None:
    """Statics of a wedge between two faces."""
    half, stiffness, ratio = math.radians(30.0), 1e9, 2.5
    record.text(
        "*A wedge in a groove.* A symmetric wedge with a half angle of 30° sits in a groove and settles under its "
        "weight (k01 = 0). Each face has two contacts of stiffness g0 = 1e9 N/m, and shear springs of 1/2.5 of "
        "that. The springs hold it when tan φ ≥ ks cos a/(kn sin a), from 34.7° on."
    )
    for friction, slips in ((50.0, False), (15.0, True)):
        results = record.run(wedge(half, stiffness, friction), f"wedge-{friction:g}")
        frame = results.frames[-1]
        weight = DENSITY * GRAVITY * float(results.block_area.min())
        if slips:
            truth = weight / (2 * (math.sin(half) + math.tan(math.radians(friction)) * math.cos(half)))
        else:
            springs = 2 * stiffness * (math.sin(half) ** 2 + math.cos(half) ** 2 / ratio)
            sinking = weight / (2 * springs)
            truth = 2 * stiffness * sinking * math.sin(half)
            way = results["history/measured_displacement"][-1, :, 1]
            record.compare(
                f"sinking of the wedge into the groove, friction {friction:g}°",
                1e6 * float(way[1] - way[0]),
                "µm",
                truth=1e6 * sinking,
                truth_source="W/(2 (kn sin² a + ks cos² a))",
                allowed=1e-3,
                explanation="the blocks have E = 1e13 Pa, not infinity",
            )
        force, point = frame.contacts.force, frame.contacts.point
        right = point[:, 0] > 0
        total = np.abs(force[right].sum(axis=0))
        computed = total[0] * math.cos(half) + total[1] * math.sin(half)
        record.compare(
            f"normal force on a face of the wedge, friction {friction:g}°",
            computed / 1e3,
            "kN",
            truth=truth / 1e3,
            truth_source="limit equilibrium" if slips else "rigid wedge on springs",
            allowed=1e-3,
            explanation="" if slips else "statically indeterminate: decided by the ratio of the springs",
        )


def wedge(half: float, stiffness: float, friction: float) -> Model:
    """A triangle, point down, in a groove of one fixed block."""
    model = Model("wedge", e0=0.001, k01=0.0, dt_max=0.01, stiffness=stiffness, steps=400)
    depth = 2.0
    top = depth * math.tan(half)
    outline = [(-3, -1), (3, -1), (3, depth + 0.5)]
    lip = (depth + 0.5) * math.tan(half)
    outline += [(lip, depth + 0.5), (0.0, 0.0), (-lip, depth + 0.5), (-3, depth + 0.5)]
    model.add_polygon(outline)
    # its point is cut off, so that it touches nothing: the faces alone carry
    cut = 0.2
    corner = cut * math.tan(half)
    model.add_polygon([(-corner, cut), (corner, cut), (top, depth), (-top, depth)])
    for point in ((-2.9, -0.9), (2.9, -0.9), (2.9, depth), (-2.9, depth), (-0.5, -0.5), (0.5, -0.5)):
        model.add_fixed(point)
    model.add_hole((0.0, cut / 2))
    model.add_measured((0.0, 1.3))
    model.add_measured((0.0, -0.5))
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=1e13, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=friction)
    return model


CASES = [
    Case("closed-single-block", "A block on an incline, a wedge in a groove", "Closed forms", single_block),
]
