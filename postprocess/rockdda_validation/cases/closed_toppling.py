# SPDX-License-Identifier: MIT
"""Toppling of sixteen blocks on a stepped base: Goodman and Bray's first example.

The truth is limit equilibrium, block by block from the crest down. Block n (1 at the toe), of width w, height y and
weight W, on a base that dips by p, gets the force P from the block above at the height M and hands on to the block
below, at the height L, the larger of

    toppling   Pt = (P (M - w tan f) + W/2 (y sin p - w cos p)) / L
    sliding    Ps = P - W (cos p tan f - sin p) / (1 - tan² f)

or nothing if both are negative, with the friction angle f mobilised in full between all blocks. The slope is at its
limit when the block at the toe has nothing to hand on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE

from ..bracket import Bracket, bracket, power_of_ten
from ..case import Case, Record, published

if TYPE_CHECKING:
    from rockdda.results import Frame, Results

FloatArray = npt.NDArray[np.float64]

# the example, in m and N
WIDTH, STEP, DIP = 10.0, 1.0, np.radians(30.0)
HEIGHT = np.array([4.0 * n for n in range(1, 11)] + [40.0 - 6.0 * n for n in range(1, 7)])
BLOCKS = len(HEIGHT)
GRAVITY, DENSITY = 10.0, 2500.0  # 25 kN/m³
WEIGHT = DENSITY * GRAVITY * WIDTH * HEIGHT
TOP = STEP * np.arange(BLOCKS) + HEIGHT  # above the plane of the toe's step

DYNAMIC = 2.0  # s, of the dynamic stage in which a slope fails or stands
MOVED = 0.02  # m in that stage: failed. A mean acceleration of a thousandth of gravity


def arms() -> tuple[FloatArray, FloatArray]:
    """M and L of the blocks: where the blocks above and below touch. The toe block hands on at half its height."""
    foot = STEP * np.arange(BLOCKS)
    above = np.append(np.minimum(TOP[:-1], TOP[1:]), TOP[-1]) - foot
    below = np.append(0.5 * HEIGHT[0], np.minimum(TOP[:-1], TOP[1:]) - foot[1:])
    return above, below


def handed_on(friction_angle: float) -> tuple[FloatArray, list[str]]:
    """Force that each block hands on to the next one below [N], and how: '', 'topples' or 'slides'."""
    tangent = np.tan(np.radians(friction_angle))
    force, modes, p = np.zeros(BLOCKS), [""] * BLOCKS, 0.0
    above, below = arms()
    for n in reversed(range(BLOCKS)):
        topple = p * (above[n] - WIDTH * tangent)
        topple = (topple + WEIGHT[n] / 2 * (HEIGHT[n] * np.sin(DIP) - WIDTH * np.cos(DIP))) / below[n]
        slide = p - WEIGHT[n] * (np.cos(DIP) * tangent - np.sin(DIP)) / (1 - tangent**2)
        if n == 0:
            topple = (
                -np.inf
            )  # the toe block is lower than it is wide, and nothing holds it at its foot: it can only slide
        if p > 0 or max(topple, slide) > 0:
            modes[n] = "topples" if topple > slide else "slides"
        p = max(topple, slide, 0.0) if n else slide
        force[n] = p
    return force, modes


def limit_angle() -> float:
    """Friction angle of limit equilibrium: the toe hands on nothing."""
    return _root(lambda angle: handed_on(angle)[0][0])


def limit_with_share(share: float, sliding: int) -> float:
    """Friction angle of the limit when only a share of the friction acts where toppling blocks lean on sliding ones.

    The `sliding` lowest blocks slide as one, for between them nothing moves; P from the first toppling block then acts
    on them with share·P·tan f across, and P (1 - share·tan² f) = W (cos p tan f - sin p) at the limit.
    """
    weight = WEIGHT[:sliding].sum()

    def excess(angle: float) -> float:
        tangent = np.tan(np.radians(angle))
        drive = handed_on(angle)[0][sliding] * (1 - share * tangent**2)
        return float(drive - weight * (np.cos(DIP) * tangent - np.sin(DIP)))

    return _root(excess)


def _root(function: Callable[[float], float], low: float = 31.0, high: float = 44.0) -> float:
    """Where a falling function is zero."""
    assert function(low) > 0 > function(high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) > 0 else (low, middle)
    return 0.5 * (low + high)


# -- the same slope with DDA --


@dataclass(frozen=True)
class Setting:
    """Numbers of a calculation that the limit should not depend on."""

    stiffness: float = 1e11  # N/m
    dt: float = 0.02  # s
    shear_ratio: float = 2.5

    @property
    def settling(self) -> int:
        """Steps of the static stage: without carried velocity the way to rest takes steps in proportion to 1/dt²."""
        return max(300, round(0.24 / self.dt**2))


def _global(s: float, n: float) -> tuple[float, float]:
    """From coordinates down the dip and across it."""
    return s * np.cos(DIP) + n * np.sin(DIP), -s * np.sin(DIP) + n * np.cos(DIP)


def slope(friction_angle: float, setting: Setting, dynamic: float = DYNAMIC) -> Model:
    """Sixteen blocks on one fixed block with steps. Settles without inertia first, then moves with it."""
    model = Model("toppling", e0=0.01, dt_max=setting.dt, stiffness=setting.stiffness)
    front, bottom, back = 20.0, -10.0, -BLOCKS * WIDTH

    def line(start: tuple[float, float], end: tuple[float, float]) -> None:
        model.add_line(_global(*start), _global(*end))

    outline = [(front, bottom), (front, 0.0), (0.0, 0.0)]
    for n in range(1, BLOCKS):
        outline += [(-n * WIDTH, (n - 1) * STEP), (-n * WIDTH, n * STEP)]
    outline += [(back, (BLOCKS - 1) * STEP), (back, bottom)]
    for start, end in zip(outline, outline[1:] + outline[:1], strict=True):
        line(start, end)
    for n in range(BLOCKS):
        line((-n * WIDTH, TOP[n]), (-(n + 1) * WIDTH, TOP[n]))
        line((-n * WIDTH, n * STEP), (-n * WIDTH, max(TOP[n], TOP[max(n - 1, 0)])))
        model.add_measured(_global(-(n + 0.5) * WIDTH, TOP[n] - 0.1))
    line((back, (BLOCKS - 1) * STEP), (back, TOP[-1]))
    for point in [(front - 1, -9.0), (back + 1, -9.0), (-80.0, -9.0), (back + 1, 13.0), (front - 1, -1.0)]:
        model.add_fixed(_global(*point))
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=1e11, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=friction_angle)
    model.steps = setting.settling + round(dynamic / setting.dt)
    model.options = {
        "run": {"save_every": setting.settling},
        "contact": {"shear_ratio": setting.shear_ratio},
        "stage": [{"until_step": setting.settling, "k01": 0.0}, {"k01": 1.0}],
    }
    return model


def moved(results: Results, setting: Setting) -> FloatArray:
    """Way of the blocks' tops in the dynamic stage, (steps, blocks) [m]."""
    way = results["history/measured_displacement"]
    start = setting.settling
    return np.hypot(*np.moveaxis(way[start:] - way[start - 1], 2, 0))


def numbers(results: Results) -> dict[int, int]:
    """Number in the example (1 at the toe, 0 the base) of each block."""
    base = int(np.argmax(results.block_area))
    order = [int(i) for i in np.argsort(-results.block_centroid[:, 0]) if i != base]
    return {base: 0} | {block: n for n, block in enumerate(order, start=1)}


def between(frame: Frame, results: Results) -> FloatArray:
    """Forces that blocks n = 1 … 16 hand on to the one below, (16, 2): along the dip, and across it [N]."""
    number, total = numbers(results), np.zeros((BLOCKS, 2))
    down, up = _global(1.0, 0.0), _global(0.0, 1.0)
    contacts = frame.contacts
    for force, state, pair in zip(contacts.force, contacts.state, contacts.blocks, strict=True):
        first, second = number[int(pair[0])], number[int(pair[1])]
        upper = max(first, second)
        if state and min(first, second) > 0:
            on_lower = -force if first == upper else force
            total[upper - 1] += (on_lower @ np.array(down), -(on_lower @ np.array(up)))
    return total


@dataclass
class Found:
    """What a bisection leaves."""

    limit: Bracket
    failing: Results  # the failing run nearest to the limit
    standing: Results
    ways: list[tuple[float, float]]  # friction angle, largest way in the dynamic stage

    def share(self, results: Results, setting: Setting, upper: int = 4) -> float:
        """Share of friction mobilised between block `upper` and the one below when the static stage ends."""
        frame = next(frame for frame in results.frames if frame.step == setting.settling)
        along, across = between(frame, results)[upper - 1]
        angle = self.limit.fails if results is self.failing else self.limit.stands
        return float(across / along / np.tan(np.radians(angle)))


def bisect(record: Record, setting: Setting, width: float) -> Found:
    """Between which friction angles does the slope begin to fail?"""
    runs: dict[float, Results] = {}
    ways: list[tuple[float, float]] = []

    def stands(angle: float) -> bool:
        name = f"k{power_of_ten(setting.stiffness)}-dt{setting.dt:g}-r{setting.shear_ratio:g}-phi{angle:.6g}"
        runs[angle] = record.run(slope(angle, setting), name)
        ways.append((angle, float(moved(runs[angle], setting)[-1].max())))
        return ways[-1][1] < MOVED

    limit = bracket(stands, 36.0, 44.0, width)
    return Found(limit, runs[limit.fails], runs[limit.stands], sorted(ways))


def toppling(record: Record) -> None:
    truth, table = limit_angle(), published("goodman_bray")
    modes = handed_on(truth)[1]
    record.text(
        "Sixteen rectangular blocks, 10 m wide and 4 to 40 m high, stand on the steps of a base whose treads dip "
        "at 30° out of the slope (Goodman and Bray's first example: slope of 92.5 m, 25 kN/m³). Friction alone "
        "holds them. Limit equilibrium, block by block from the crest, reproduces the published table: blocks 14 "
        "to 16 stand by themselves, 4 to 13 topple, 1 to 3 are pushed off."
    )
    record.compare(
        "limit equilibrium (no DDA): friction angle",
        truth,
        "°",
        published=table["limit"]["friction_angle"],
        published_source=table["limit"]["source"],
        scale=1.0,
        allowed=0.005,
    )
    theirs = dict(zip(table["forces"]["block"], table["forces"]["force"], strict=True))
    forces = handed_on(np.degrees(np.arctan(table["forces"]["tangent"])))[0]
    computed = {n: forces[n - 1] / 1e3 for n in theirs}
    worst = max(theirs, key=lambda n: abs(computed[n] - theirs[n]))
    record.compare(
        f"limit equilibrium: force that differs most from the table (block {worst})",
        computed[worst],
        "kN",
        published=theirs[worst],
        published_source=table["forces"]["source"],
        scale=max(theirs.values()),
        allowed=2e-4,  # of the largest force, 4837.0 kN: the table was calculated with four digits of tan φ
    )

    setting = Setting()
    found = bisect(record, setting, 0.02 if record.full else 0.2)
    share = found.share(found.standing, setting)
    record.text(
        f"DDA: rigid blocks in practice (E = 1e11 Pa), gravity at once, {setting.settling} static steps (k01 = 0) "
        f"until nothing moves, then {DYNAMIC:g} s of dynamics (k01 = 1). **Criterion:** the slope has failed when "
        f"some block has moved by more than {100 * MOVED:g} cm in the dynamic stage; half a degree below the limit "
        "it moves by decimetres, above it by less than a micrometre. The friction angle, the same in all joints, "
        "is bisected."
    )
    record.compare(
        "friction angle at which the slope begins to fail",
        found.limit.middle,
        "°",
        truth=truth,
        truth_source="limit equilibrium, friction in full between all blocks",
        published=table["limit"]["friction_angle"],
        published_source=table["limit"]["source"],
        allowed=1.0 / truth,  # one degree
        explanation="see the next line: friction between blocks 4 and 3 is not mobilised in full",
    )
    record.compare(
        "the same against limit equilibrium with the friction that acts between blocks 4 and 3",
        found.limit.middle,
        "°",
        truth=limit_with_share(share, 3),
        truth_source=f"limit equilibrium, {100 * share:.1f} % of friction between blocks 4 and 3",
        scale=1.0,
        allowed=0.05 + found.limit.width / 2,
    )
    record.text(
        "Why the limit is not at 38.15°: in the mechanism, block 4 turns about its toe, which lies on the face "
        "towards block 3, and block 3 slides along the base. Neither moves along that face, so the mechanism "
        "mobilises no friction there, and the friction in it is statically indeterminate: Goodman and Bray assume "
        "it in full, which is the most favourable value; with DDA it depends on how far the springs have been "
        f"strained on the way, here {100 * share:.1f} % of it. Limit equilibrium with that share gives the limit of "
        "DDA. Everywhere else (blocks 5 to 13) friction is mobilised in full, and the forces agree."
    )
    _forces(record, found, setting)
    _modes(record, setting, found.limit.fails - 0.5, modes)
    if record.full:
        _sensitivity(record, setting, found, truth)
    _figure(record, setting, found, truth)
    record.energy_closes()


def _forces(record: Record, found: Found, setting: Setting) -> None:
    """Forces between the toppling blocks when the slope just stands."""
    frame = next(frame for frame in found.standing.frames if frame.step == setting.settling)
    dda = between(frame, found.standing)
    truth, modes = handed_on(found.limit.stands)
    tangent = np.tan(np.radians(found.limit.stands))
    rows = [
        {
            "block": n,
            "height [m]": HEIGHT[n - 1],
            "limit equilibrium": modes[n - 1] or "stands",
            "its force on the next [kN]": truth[n - 1] / 1e3 if n > 1 else 0.0,
            "DDA [kN]": dda[n - 1, 0] / 1e3,
            "friction mobilised with DDA": dda[n - 1, 1] / dda[n - 1, 0] / tangent if dda[n - 1, 0] else float("nan"),
        }
        for n in range(BLOCKS, 0, -1)
    ]
    caption = f"Forces between the blocks at {found.limit.stands:.5g}°, where the slope just stands with DDA."
    record.table(pandas.DataFrame(rows), "forces", caption)
    toppling_blocks = np.arange(4, 13)  # numbers 5 to 13
    error = (dda[toppling_blocks, 0] - truth[toppling_blocks]) / truth.max()
    worst = int(toppling_blocks[np.argmax(np.abs(error))])
    record.compare(
        f"force between toppling blocks that differs most (block {worst + 1})",
        dda[worst, 0] / 1e3,
        "kN",
        truth=truth[worst] / 1e3,
        truth_source="limit equilibrium at the same friction angle",
        scale=truth.max() / 1e3,
        # the nearer to the limit, the better friction is mobilised; the quick bracket is ten times wider
        allowed=0.002 if record.full else 0.05,
    )


def _modes(record: Record, setting: Setting, angle: float, modes: list[str]) -> None:
    """How many blocks topple, slide and stand when the slope fails; a picture of it."""
    results = record.run(slope(angle, setting), f"failing-phi{angle:.4g}")
    frame = results.frames[-1]
    number = numbers(results)
    way = moved(results, setting)[-1]
    kinds = {}
    for block, n in number.items():
        if n == 0:
            continue
        turned = abs(frame.rotation[block]) * HEIGHT[n - 1]
        if way[n - 1] < 0.01 * way.max():
            kinds[n] = ""
        else:
            kinds[n] = "topples" if turned > 0.5 * way[n - 1] else "slides"
    for word, name in (("topples", "topple"), ("slides", "slide"), ("", "stand")):
        record.compare(
            f"blocks that {name}, half a degree below the limit",
            sum(kind == word for kind in kinds.values()),
            truth=float(modes.count(word)),
            truth_source="limit equilibrium",
            allowed=0.0,
        )
    seconds = 8.0
    frame = record.run(slope(angle, setting, seconds), f"fallen-phi{angle:.4g}").frames[-1]
    colours = {"": PALETTE[5], "topples": PALETTE[4], "slides": PALETTE[3]}
    with record.style():
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(figsize=(6.3, 3.6), layout="constrained")
        start = results.frames[0].polygons()
        for block, polygon in enumerate(frame.polygons()):
            n = number[block]
            colour = "0.85" if n == 0 else colours[kinds[n]]
            axes.fill(*start[block].T, facecolor="none", edgecolor="0.6", linewidth=0.5, zorder=3)
            axes.fill(*polygon.T, facecolor=colour, edgecolor="black", linewidth=0.6, zorder=2)
            if n:
                axes.annotate(str(n), polygon.mean(axis=0), ha="center", va="center", fontsize=7, zorder=4)
        for word, label in (("", "stands"), ("topples", "topples"), ("slides", "slides")):
            axes.fill([], [], facecolor=colours[word], edgecolor="black", linewidth=0.6, label=label)
        axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        axes.legend(loc="upper right")
    record.figure(
        figure,
        "mechanism",
        f"Half a degree below the limit ({angle:.4g}°), after {seconds:g} s; thin lines: the start. Displacements "
        "are to scale.",
    )


def _sensitivity(record: Record, setting: Setting, found: Found, truth: float) -> None:
    """Contact stiffness, time step, and shear stiffness."""
    rows = []
    settings = [Setting(stiffness=k, dt=dt) for k in (1e10, 1e11, 1e12) for dt in (0.04, 0.02, 0.01)]
    settings += [Setting(shear_ratio=r) for r in (1.0, 0.25)]
    for some in settings:
        one = found if some == setting else bisect(record, some, 0.02)
        shares = one.share(one.standing, some)
        rows.append(
            {
                "g0 [N/m]": power_of_ten(some.stiffness),
                "dt [s]": some.dt,
                "normal/shear stiffness": some.shear_ratio,
                "limit with DDA [°]": str(one.limit),
                "over 38.15° by [°]": one.limit.middle - truth,
                "friction between 4 and 3": shares,
                "limit equilibrium with it [°]": limit_with_share(shares, 3),
            }
        )
        if some.shear_ratio == 0.25:
            record.compare(
                "friction angle of failure, shear springs four times as stiff as normal springs",
                one.limit.middle,
                "°",
                truth=truth,
                truth_source="limit equilibrium, friction in full between all blocks",
                published=published("goodman_bray")["limit"]["friction_angle"],
                published_source=published("goodman_bray")["limit"]["source"],
                scale=1.0,
                allowed=0.05,
                explanation=f"stiff shear springs mobilise {100 * shares:.1f} % of friction between blocks 4 and 3",
            )
    record.table(
        pandas.DataFrame(rows),
        "convergence",
        "Limit against contact stiffness, time step and shear stiffness. All differences from 38.15° are those of "
        "the friction between blocks 4 and 3: the last column follows the DDA limit.",
    )


def _figure(record: Record, setting: Setting, found: Found, truth: float) -> None:
    """Forces down the slope, and motion against friction angle."""
    table = published("goodman_bray")["forces"]
    frame = next(frame for frame in found.standing.frames if frame.step == setting.settling)
    dda = between(frame, found.standing)[:, 0]
    with record.style():
        import matplotlib.pyplot as plt

        figure, (left, right) = plt.subplots(1, 2, figsize=(6.3, 2.7), layout="constrained")
        n = np.arange(1, BLOCKS + 1)
        left.plot(n[1:], handed_on(truth)[0][1:] / 1e6, color=PALETTE[0], label=f"limit equilibrium, {truth:.2f}°")
        left.plot(
            table["block"],
            np.array(table["force"]) / 1e3,
            "s",
            mfc="none",
            color=PALETTE[2],
            label="Goodman and Bray (1976)",
        )
        left.plot(n[1:], dda[1:] / 1e6, ".", color=PALETTE[1], label=f"DDA, {found.limit.stands:.2f}°")
        left.set(
            xticks=range(1, 17, 3),
            xlabel="block (1 at the toe)",
            ylabel="force on the block below [MN]",
            ylim=(-0.2, 7),
        )
        left.legend(loc="upper right")
        angles, ways = np.array(found.ways).T
        right.semilogy(angles, np.maximum(ways, 1e-9), "o-", ms=3.5, color=PALETTE[1], label="DDA")
        right.axhline(MOVED, color="0.5", linewidth=0.8, linestyle="--")
        right.annotate("criterion", (angles.max(), MOVED), ha="right", va="bottom", fontsize=8, color="0.4")
        right.axvline(truth, color=PALETTE[0], linewidth=0.8, label=f"{truth:.2f}°")
        right.set(xlabel="friction angle [°]", ylabel=f"largest way in {DYNAMIC:g} s [m]")
        right.legend(loc="center right")
    record.figure(
        figure,
        "limit",
        "Left: forces between the blocks. Right: motion in the dynamic stage against the friction angle.",
    )


CASES = [
    Case("closed-toppling", "Toppling of sixteen blocks (Goodman and Bray)", "Closed forms", toppling),
]
