# SPDX-License-Identifier: MIT
"""Walls, stacks and arches against rigid limit analysis, pushed and tilted."""

from __future__ import annotations

import itertools
import math

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Model, Points, Unsuited, area_of, box, compare, joint, require, rock, turned
from .drawing import Kind, Values, between, decades, values
from .limits import Programme, strength_factor, touches

#: friction without dilation against associated limit analysis, and the interval of the search (1 %)
BELOW, ABOVE = 0.06, 0.02
#: blocks that give way by a thousandth of their size before they fall
BELOW_OF_SOFT = 0.1
#: two searches of an arch that gives way far before it falls
STEPS = 0.03
DEAD, LIVE = (0.0, -1.0), (1.0, 0.0)


def _judge(blocks: list[Points], held: set[int], friction: float, drawn: Values, bench: Bench, exact: bool) -> None:
    """Push or tilt: at most the associated multiple, and where that is exact no less than it.

    Whatever the multiple, the loads do work in the motion that the program says is the failure.
    """
    upper = Programme(blocks, held, touches(blocks, math.tan(math.radians(friction)))).multiple(DEAD, LIVE)
    if not 0.03 < upper < 2.0:
        raise Unsuited
    size = float(np.ptp(np.concatenate(blocks), axis=0).max())
    model = Model(blocks=blocks, held=held, e0=1e-5 * size)
    unit = 20000.0
    # stiff enough that what joints and blocks give way does not count: the program chooses the stiffness of the joints
    model.groups = [
        rock(young=1e7 * unit * size, poisson=0.0, more=f", unit_weight={unit!r}"),
        joint(friction=friction),
        "&contact corner_radius=0.001 /",
        "&stage name='w', until='equilibrium' /",
    ]
    search = drawn["search"]
    tolerance = 0.005 * upper if search == "push" else math.degrees(0.005 * math.atan(upper))
    run = bench.search(model, "--search", search, "--tolerance", f"{tolerance:.3g}", "-o", "m.h5")
    require(run.code == 0, f"fos: exit {run.code}: {run.messages.strip()[-200:]}")
    found, fails = (float(run.summary[name]) for name in ("factor", "high"))
    if search == "tilt":
        found, fails = math.tan(math.radians(found)), math.tan(math.radians(fails))
    low = upper * (1 - BELOW) if exact else 0.0
    require(low <= found <= upper * (1 + ABOVE), f"{search} {found:.4g} of the weight, limit analysis says {upper:.4g}")
    areas = np.array([area_of(points) for points in blocks])
    work = float((areas[:, None] * run.moved() * np.array([fails, -1.0])).sum())
    require(work > 0, f"{search} {found:.4g} of the weight: its loads do no work in the failure")


def stack(drawn: Values, bench: Bench) -> None:
    random = np.random.default_rng(drawn["seed"])
    blocks, y, x, width = [box(-2.0, -0.5, 5.0, 0.5)], 0.0, 0.0, 1.0
    for _ in range(drawn["count"]):
        height = random.uniform(0.2, 1.0)
        blocks.append(box(x, y, width, height))
        y += height
        x += random.uniform(-0.15, 0.15) * width
        width *= random.uniform(0.75, 1.05)
    _judge(blocks, {0}, drawn["friction"], drawn, bench, exact=True)


def wall(drawn: Values, bench: Bench) -> None:
    """Courses of whole blocks, every other one begins and ends with a half."""
    random = np.random.default_rng(drawn["seed"])
    width, height, long = 1.0, drawn["flat"], drawn["long"]
    blocks = [box(-1.0, -0.5, long + 2.0, 0.5)]
    for course in range(drawn["courses"]):
        bond = random.uniform(0.3, 0.7) * width
        cuts = np.arange(long + 1.0) if course % 2 else np.r_[0.0, np.arange(long) + bond, float(long)]
        blocks += [box(a, course * height, b - a, height) for a, b in itertools.pairwise(cuts)]
    _judge(blocks, {0}, drawn["friction"], drawn, bench, exact=False)


def pyramid(drawn: Values, bench: Bench) -> None:
    """A pile of square blocks, each on two."""
    rows = drawn["rows"]
    gap = drawn["gap"]
    blocks = [box(-1.0, -0.5, rows * (1 + gap) + 2.0, 0.5)]
    for row in range(rows):
        x = row * (1 + gap) / 2
        blocks += [box(x + k * (1 + gap), row * drawn["flat"], 1.0, drawn["flat"]) for k in range(rows - row)]
    _judge(blocks, {0}, drawn["friction"], drawn, bench, exact=gap > 0)


def _voussoirs(drawn: Values) -> list[Points]:
    """A circular arch of equal voussoirs, a springer at either end."""
    radius, count = 1.0, drawn["voussoirs"]
    inner, outer = radius - drawn["thick"] / 2, radius + drawn["thick"] / 2
    half = math.radians(drawn["embrace"]) / 2
    angles = np.linspace(math.pi / 2 - half, math.pi / 2 + half, count + 1)
    step = angles[1] - angles[0]
    angles = np.r_[angles[0] - step, angles, angles[-1] + step]

    def rim(r: float, angle: float) -> list[float]:
        return [r * math.cos(angle), r * math.sin(angle)]

    return [
        np.array([rim(inner, a), rim(outer, a), rim(outer, b), rim(inner, b)]) for a, b in itertools.pairwise(angles)
    ]


def arch(drawn: Values, bench: Bench) -> None:
    """A circular arch of equal voussoirs between held springers, without sliding."""
    blocks = _voussoirs(drawn)
    _judge(blocks, {0, len(blocks) - 1}, 75.0, drawn, bench, exact=True)


def _same_by_short_steps(model: Model, search: str, tolerance: float, bench: Bench) -> None:
    """Trials whose steps move blocks by a third as far find the same."""
    factor = bench.factor(model, "--search", search, "--tolerance", f"{tolerance}")
    if math.isnan(factor):
        raise Unsuited
    model.groups.append("&time displacement_ratio=1e-3 /")
    other = bench.factor(model, "--search", search, "--tolerance", f"{tolerance}", name="short")
    require(not math.isnan(other), f"{search} {factor:.4g}, with short steps no factor")
    require(
        abs(factor - other) <= 2 * tolerance + STEPS * other, f"{search} {factor:.4g}, with short steps {other:.4g}"
    )


def soft_arch(drawn: Values, bench: Bench) -> None:
    """An arch on joints that give way, which slides as well."""
    blocks = _voussoirs(drawn)
    model = Model(blocks=blocks, held={0, len(blocks) - 1}, e0=1e-5)
    model.groups = [
        rock(young=2e10, poisson=0.2, more=", unit_weight=25000.0"),
        joint(
            friction=drawn["friction"], normal_stiffness=drawn["stiffness"], shear_stiffness=0.4 * drawn["stiffness"]
        ),
        "&stage name='w', until='equilibrium' /",
    ]
    _same_by_short_steps(model, "push", 0.005, bench)


def columns(drawn: Values, bench: Bench) -> None:
    """Columns of width 1 on a plane, its downhill side the left: they grow to the highest one and fall from there."""
    random = np.random.default_rng(drawn["seed"])
    count, highest = drawn["count"], int(drawn["count"] * random.uniform(0.5, 0.8))
    top, fall = random.uniform(2.0, 6.0), random.uniform(0.1, 0.3)
    heights = [
        top * (0.2 + 0.8 * (k + 1) / highest if k < highest else max(0.2, 1 - (k + 1 - highest) * fall))
        for k in range(count)
    ]
    blocks = [box(float(k), 0, 1, height) for k, height in enumerate(heights)] + [box(-2, -1.5, count + 3, 1.5)]
    blocks = [turned(points, drawn["dip"]) for points in blocks]
    friction = math.tan(math.radians(drawn["friction"]))
    upper = strength_factor(blocks, {count}, touches(blocks, friction))
    model = Model(blocks=blocks, held={count}, e0=1e-4)
    model.groups = [
        rock(young=drawn["modulus"] * 2e4 * count, poisson=0.2, more=", unit_weight=20000.0"),
        joint(friction=drawn["friction"]),
        "&stage name='w', until='equilibrium' /",
    ]
    if not upper < 10.0:
        raise Unsuited
    compare("factor", bench.factor(model), upper, BELOW_OF_SOFT, ABOVE)


SEARCH = st.sampled_from(["push", "tilt"])
KINDS = [
    Kind(
        "stacks",
        "masonry",
        "limit analysis (linear programme) of stacks of uneven blocks, tilted and pushed",
        values(seed=st.integers(0, 9999), count=st.integers(1, 6), friction=between(10, 50, 20), search=SEARCH),
        stack,
        sample=3,
    ),
    Kind(
        "walls",
        "masonry",
        "limit analysis of walls in bond (an upper bound), and the work of the loads in the failure",
        values(
            seed=st.integers(0, 9999),
            long=st.integers(2, 4),
            courses=st.integers(1, 6),
            flat=between(0.25, 1.0, 15),
            friction=between(20, 45, 25),
            search=SEARCH,
        ),
        wall,
    ),
    Kind(
        "piles-of-squares",
        "masonry",
        "limit analysis of pyramids, each block on two",
        values(
            rows=st.integers(2, 5),
            gap=between(0.0, 0.3, 6),
            flat=between(0.4, 1.2, 16),
            friction=between(15, 45, 30),
            search=SEARCH,
        ),
        pyramid,
    ),
    Kind(
        "arches",
        "masonry",
        "limit analysis of circular arches that do not slide",
        values(
            voussoirs=st.integers(5, 16),
            thick=between(0.12, 0.3, 18),
            embrace=between(90, 170, 16),
            search=SEARCH,
        ),
        arch,
    ),
    Kind(
        "soft-arches",
        "masonry",
        "the same push with steps that move blocks by a third as far: thin arches on soft joints",
        values(
            voussoirs=st.integers(4, 20),
            thick=between(0.07, 0.2, 13),
            embrace=between(90, 160, 14),
            friction=between(30, 45, 15),
            stiffness=decades(1e9, 1e11),
        ),
        soft_arch,
    ),
    Kind(
        "columns",
        "masonry",
        "limit analysis of columns of soft rock that topple on a plane",
        values(
            seed=st.integers(0, 9999),
            count=st.integers(5, 15),
            dip=between(10, 35, 25),
            friction=between(25, 55, 30),
            modulus=decades(3e4, 1e6),
        ),
        columns,
    ),
]
