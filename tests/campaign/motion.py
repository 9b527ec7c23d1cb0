# SPDX-License-Identifier: MIT
"""Pairs and clusters in flight, piles, walls and jointed slopes: what must hold of their motion whatever it is.

Sizes from 1 cm to 1 km, moduli from 1 MPa to 1 TPa, friction from 0 to 70 degrees, joints from a tenth of E over the
size to thirty times that, time steps from a thousandth to a hundredth of the square root of the size. The energy
balance closes and contacts give no energy, blocks in flight keep their momentum and do not become faster, blocks lie in
each other by no more than their joints give way, and two threads have the same bits as one.
"""

from __future__ import annotations

import itertools
import math

import h5py
import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Fault, G, Model, Points, Run, Unsuited, area_of, box, deepest, joint, polar_of, rock
from .drawing import Kind, Values, decades, seeds, values

#: of the energy exchanged: what contacts may give (docs/theory.md, "Energy from nowhere")
GIVEN = 1e-3
#: of the energy supplied: what the time scheme may give
GAINED = 0.05
#: columns of the energy that count as exchanged
EXCHANGED = ("kinetic", "strain", "gravity", "springs", "external_work", "friction", "numerical_dissipation")


# -- models ----------------------------------------------------------------------------------------------------------


def polygon(random: np.random.Generator, radius: float, aspect: float = 1.0) -> Points:
    """Three to eight corners on an ellipse, counter-clockwise about the origin."""
    n = int(random.integers(3, 9))
    while True:
        angles = np.sort(random.uniform(0, 2 * math.pi, n))
        if np.diff(np.r_[angles, angles[0] + 2 * math.pi]).max() < 2.6:
            break
    corners = radius * np.column_stack([np.cos(angles), np.sin(angles) / aspect])
    turn = random.uniform(0, math.pi)
    return corners @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])


def _strew(
    random: np.random.Generator, count: int, aspect: float, across: tuple[float, float], up: tuple[float, float]
) -> list[Points]:
    """Polygons at random places, where they meet no circle about another one that was strewn."""
    places: list[tuple[float, float, float]] = []
    found = []
    for _ in range(40 * count):
        x, y, r = random.uniform(*across), random.uniform(*up), random.uniform(0.2, 0.7)
        if all(math.hypot(x - u, y - v) > r + s + 1e-3 for u, v, s in places):
            found.append(polygon(random, r, aspect) + np.array([x, y]))
            places.append((x, y, r))
            if len(places) == count:
                break
    return found


def _scale(drawn: Values) -> tuple[float, float]:
    """Density and time: rock that its own weight would crush is no model of rock."""
    size = drawn["size"]
    return min(2500.0, 1e-3 * drawn["young"] / (G * 12 * size)), math.sqrt(size)


def _finish(
    model: Model, drawn: Values, gravity: float, duration: float, velocities: list[str] | None = None, more: str = ""
) -> None:
    density, second = _scale(drawn)
    stiffness = f", normal_stiffness={drawn['young'] / drawn['size'] * drawn['joints']!r}" if drawn["joints"] else ""
    model.groups = [
        rock(number, drawn["young"], 0.2, density, velocity)
        for number, velocity in enumerate(velocities or [""], start=1)
    ]
    model.materials = list(range(1, len(velocities) + 1)) if velocities else []
    model.e0 = 1e-4 * drawn["size"]
    model.groups += [
        joint(friction=drawn["friction"], more=stiffness),
        f"&load gravity={gravity} /",
        *([more] if more else []),
        f"&time dt_max={drawn['step'] * second!r} /",
        f"&stage name='motion', kind='dynamic', duration={duration * second!r} /",
        "&run save_every=1000 /",
    ]


def _pairs(drawn: Values, bench: Bench) -> None:
    """Pairs far from each other, each on a course of collision."""
    random = np.random.default_rng(drawn["seed"])
    size, speed = drawn["size"], math.sqrt(drawn["size"])
    model, velocities = Model(), []
    for pair in range(drawn["count"]):
        radii = size * random.uniform(0.3, 1, 2)
        place = np.array([40 * pair * size, 0.0])
        left = polygon(random, radii[0]) + place
        place = place + np.array([radii.sum() + 0.2 * size, random.uniform(-0.7, 0.7) * radii.sum()])
        model.blocks += [left, polygon(random, radii[1]) + place]
        for low, high in ((5, 20), (-5, 0)):
            velocities.append(f", velocity={random.uniform(low, high) * speed!r},0,{random.uniform(-3, 3) / speed!r}")
    _finish(model, drawn, 0.0, 0.4, velocities)
    _judge(model, drawn, bench, groups=drawn["count"])


def _cluster(drawn: Values, bench: Bench) -> None:
    """Some blocks in flight, among them splinters."""
    random = np.random.default_rng(drawn["seed"])
    speed = math.sqrt(drawn["size"])
    model = Model()
    strewn = _strew(random, drawn["count"], drawn["aspect"], (-1.5, 1.5), (-1.5, 1.5))
    model.blocks = [points * drawn["size"] for points in strewn]
    velocities = [
        f", velocity={random.uniform(-3, 3) * speed!r},{random.uniform(-3, 3) * speed!r},"
        f"{random.uniform(-3, 3) / speed!r}"
        for _ in model.blocks
    ]
    _finish(model, drawn, 0.0, 0.8, velocities)
    _judge(model, drawn, bench, groups=1)


def _pile(drawn: Values, bench: Bench) -> None:
    """Blocks that fall on a floor, with walls or without."""
    random = np.random.default_rng(drawn["seed"])
    blocks = [box(-3, -0.5, 6, 0.5)]
    if drawn["walls"]:
        blocks += [box(-3.5, -0.5, 0.5, 4.5), box(3, -0.5, 0.5, 4.5)]
    model = Model(held=set(range(len(blocks))))
    blocks += _strew(random, drawn["count"], drawn["aspect"], (-2.3, 2.3), (0.8, 3.5))
    model.blocks = [points * drawn["size"] for points in blocks]
    _finish(model, drawn, G, 0.4)
    _judge(model, drawn, bench)


def _courses(drawn: Values, bench: Bench) -> None:
    """Courses of blocks on a floor."""
    random = np.random.default_rng(drawn["seed"])
    blocks = [box(-3, -0.5, 9, 0.5)]
    width = random.uniform(0.4, 1.2)
    height = width * float(random.choice([0.05, 0.2, 0.5, 1, 3]))
    for course in range(drawn["count"]):
        x = (0.5 * width if course % 2 else 0.0) + random.uniform(-0.05, 0.05) * width * (random.random() < 0.5)
        for _ in range(int(random.integers(2, 5))):
            blocks.append(box(x, course * height, width, height))
            x += width
    model = Model(blocks=[points * drawn["size"] for points in blocks], held={0})
    _finish(model, drawn, G, 0.2)
    _judge(model, drawn, bench)


def _slope(drawn: Values, bench: Bench) -> None:
    """Rock cut by two or three joint sets, free to the right; its weight comes at once, or it is there."""
    random = np.random.default_rng(drawn["seed"])
    size = drawn["size"]
    width, height = 12 * size, 10 * size
    text = f"&lines seed={random.integers(1, 10**6)} /\n&boundary window=0,0, {width!r},{height!r} /\n"
    angle = random.uniform(0, 180)
    for _ in range(int(random.integers(2, 4))):
        angle = (angle + random.uniform(25, 90)) % 180
        spacing = math.sqrt(width * height) * random.uniform(0.12, 0.4)
        text += f"&joint_set inclination={angle:.5g}, spacing={spacing:.6g}, randomness={random.uniform(0, 0.5):.3g}"
        if random.random() < 0.5:
            text += f", trace={spacing * random.uniform(1.5, 6):.6g}, bridge={spacing * random.uniform(0.1, 0.8):.6g}"
        text += " /\n"
    bench.folder.mkdir(parents=True, exist_ok=True)
    (bench.folder / "m.dl").write_text(text)
    done = bench.call("lines", "m.dl", "-o", "m.dc", "--force")
    if done.returncode:
        raise Unsuited
    model = Model(lines=(bench.folder / "m.dc").read_text())
    more = f"&boundary along=0,0, {width!r},0, kind='fixed' /\n&boundary along=0,0, 0,{height!r}, kind='roller' /"
    if random.random() < 0.6:
        more += f"\n&in_situ surface={height!r}, k0={random.choice([0.3, 0.5, 1, 2])} /"
    _finish(model, drawn, G, 0.2, more=more)
    _judge(model, drawn, bench, height=height)


# -- what must hold --------------------------------------------------------------------------------------------------


def _judge(model: Model, drawn: Values, bench: Bench, groups: int = 0, height: float = 0.0) -> None:
    """groups: of blocks in flight, each of which keeps its momentum; 0: under gravity."""
    run = bench.run(model)
    found = faults_of(run, drawn, groups, height, frozenset(model.held))
    if drawn["seed"] % 10 == 0:
        other = bench.run(model, "--threads", "2", name="two")
        names = ("frames/vertices", "history/energy")
        found += [f"two threads: {name}" for name in names if not np.array_equal(run.get(name), other.get(name))]
    if found:
        raise Fault("; ".join(found))


def faults_of(
    run: Run, drawn: Values, groups: int = 0, height: float = 0.0, held: frozenset[int] = frozenset()
) -> list[str]:
    """What is wrong with the results of a run; held: blocks that cannot move."""
    density, _ = _scale(drawn)
    found = _energy_faults(run, density, groups, held) + _overlap_faults(run, drawn, density, groups, height)
    return found + _momentum_faults(run, groups) if groups else found


def _energy_faults(run: Run, density: float, groups: int, held: frozenset[int]) -> list[str]:
    """The balance closes, contacts give nothing where no crushed block is reported, and what flies gets no faster."""
    energy = {name: np.r_[0.0, column] for name, column in run.energy().items()}
    if not all(np.isfinite(column).all() for column in energy.values()):
        return ["an energy is no number"]
    start = _kinetic(run, density)
    energy["kinetic"][0] = start
    exchanged = start + sum(np.abs(np.diff(energy[name])).sum() for name in EXCHANGED)
    found = []
    if np.abs(energy["residual"]).max() > 1e-6 * exchanged:
        found.append(f"residual {np.abs(energy['residual']).max() / exchanged:.1e} of the energy exchanged")
    for name, sign in (("discarded", -1), ("geometry", 1)):
        given = sign * energy[name]
        share = float((given - np.minimum.accumulate(given)).max() / exchanged)
        # a splinter that is crushed: the run says that what follows is not to be trusted
        if share > GIVEN and "What follows is not to be trusted" not in run.messages:
            found.append(f"{name} gives {share:.1e} of the energy exchanged")
    supplied = start + np.abs(energy["gravity"]).max() + np.abs(energy["external_work"]).max()
    outlines = run.outlines(0)
    weight = density * G * sum(area_of(points) for number, points in enumerate(outlines) if number not in held)
    # the program judges no less than a thousandth of the weight of free blocks falling half the height
    supplied = max(supplied, GIVEN / GAINED * weight * float(np.ptp(np.concatenate(outlines)[:, 1])) / 2)
    gained = -float(energy["numerical_dissipation"].min() / supplied)
    if gained > 2 * GAINED and "energy from nowhere" not in run.messages:
        found.append(f"the time scheme gives {gained:.1e} of the energy supplied")
    if groups:
        total = energy["kinetic"] + energy["strain"] + energy["springs"]
        if total.max() > (1 + GIVEN) * start:
            found.append(f"energy grows to {total.max() / start:.4f} of that at the start")
    return found


def _kinetic(run: Run, density: float) -> float:
    """Of the blocks' motion as rigid ones, at the start."""
    velocity, outlines = run.get("frames/velocity")[0], run.outlines(0)
    areas, polar = np.array([area_of(p) for p in outlines]), np.array([polar_of(p) for p in outlines])
    return float(0.5 * density * (areas * (velocity[:, :2] ** 2).sum(1) + polar * velocity[:, 2] ** 2).sum())


def _momentum_faults(run: Run, groups: int) -> list[str]:
    """Blocks in flight keep their momentum, pairs each their own."""
    impulse = run.get("model/block_area")[:, None] * run.get("frames/velocity")[:, :, :2]
    parts = impulse.reshape(len(impulse), groups, -1, 2)
    lost = np.linalg.norm((parts[-1] - parts[0]).sum(1), axis=1) / np.linalg.norm(parts[0], axis=2).sum(1)
    return [f"momentum changes by {lost.max():.1e}"] if lost.max() > 1e-8 else []


def _overlap_faults(run: Run, drawn: Values, density: float, groups: int, height: float) -> list[str]:
    """Blocks overlap by no more than their joints give way, as a mean over the length of the overlap."""
    first = run.outlines(0)
    height = height or float(np.ptp(np.concatenate(first)[:, 1]))
    edges = np.concatenate([np.diff(points, axis=0) for points in first])
    mean = float(np.linalg.norm(edges, axis=1).mean())
    stiffness = drawn["young"] / drawn["size"] * drawn["joints"] or 2 * drawn["young"] / mean
    speed = float(np.abs(run.get("frames/velocity")[:, :, :2]).max())
    # weight of the whole height ten times over on a joint, and a column of it that arrives with three times the speed
    allowed = 10 * density * (0.0 if groups else G) * height / stiffness
    allowed += 3 * speed * math.sqrt(density * height / stiffness) + 1e-6 * height
    start, end = deepest(first)[0], deepest(run.outlines(-1))
    return [f"{end[2]} overlap by {end[0]:.2e} m, allowed {allowed:.2e} m"] if end[0] > start + allowed else []


def spoil(results: h5py.File) -> None:
    """Add energy, push two blocks together and change a momentum: what the oracle must find."""
    energy = results["history/energy"]
    names = [str(name) for name in energy.attrs["columns"].astype(str)]
    kinetic = energy[0, names.index("kinetic")]
    energy[-1, names.index("geometry")] += 0.1 * kinetic
    energy[-1, names.index("residual")] += 0.1 * kinetic
    energy[-1, names.index("kinetic")] += kinetic
    velocity, vertices = results["frames/velocity"], results["frames/vertices"]
    velocity[-1, 0, 0] *= 1.01
    moved, offset = vertices[-1], results["model/vertex_offset"][:]
    (a, b), (_, c) = itertools.pairwise(offset[:3])
    moved[b:c] += moved[a:b].mean(0) - moved[b:c].mean(0)
    vertices[-1] = moved


def _drawn(**more: st.SearchStrategy[object]) -> st.SearchStrategy[Values]:
    return values(
        size=decades(0.01, 1000),
        young=decades(1e6, 1e12),
        friction=st.sampled_from([30.0, 0.0, 5.0, 15.0, 45.0, 70.0]),
        joints=st.just(0.0) | decades(0.1, 30),
        step=st.sampled_from([0.002, 0.001, 0.005, 0.01]),
        seed=seeds(),
        **more,
    )


WHAT = "the energy balance, overlaps, the same bits with two threads"
KINDS = [
    Kind("pairs", "motion", WHAT + ", momentum", _drawn(count=st.integers(1, 10)), _pairs),
    Kind(
        "clusters",
        "motion",
        WHAT + ", momentum",
        _drawn(count=st.integers(2, 8), aspect=st.sampled_from([1.0, 3.0, 10.0, 50.0])),
        _cluster,
    ),
    Kind(
        "piles",
        "motion",
        WHAT,
        _drawn(count=st.integers(1, 20), aspect=st.sampled_from([1.0, 3.0, 10.0, 50.0]), walls=st.booleans()),
        _pile,
    ),
    Kind("courses", "motion", WHAT, _drawn(count=st.integers(2, 6)), _courses),
    Kind("slopes", "motion", WHAT, _drawn(), _slope),
]
