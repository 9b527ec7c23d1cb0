# SPDX-License-Identifier: MIT
"""Bolts with nodes and linings in random networks of joints, under load and excavation."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Model, Run, Unsuited, joint, require, rock
from .drawing import Kind, Values, between, decades, seeds, values
from .rooms import _lines

KINDS_OF_BOLTS = ("grouted", "end_anchored", "yielding", "friction")


def steel(random: np.random.Generator, kind: str) -> str:
    """Numbers of a bolt, of which some are weak enough to slip, yield or break."""
    text = f"kind='{kind}', diameter={random.choice([0.016, 0.025, 0.05])}, young=200e9"
    strong = float(10 ** random.uniform(3.5, 6))
    if kind in ("grouted", "friction"):
        text += f", grout_stiffness={10 ** random.uniform(7, 10):.4g}, grout_strength={10 ** random.uniform(3, 6):.4g}"
        text += f", grout_residual={random.choice([1.0, 0.5, 0.0])}"
        text += random.choice(["", f", plate_strength={strong:.4g}"])
        text += random.choice(["", ", element=0.02"])
    if kind == "yielding":
        text += f", plateau_force={strong:.4g}, stroke={10 ** random.uniform(-4, -1):.4g}"
    elif kind != "friction" and random.random() < 0.6:
        text += f", yield_force={strong:.4g}" + random.choice(["", ", rupture_strain=1e-4", ", rupture_strain=0.02"])
    if kind == "end_anchored" and random.random() < 0.4:
        text += f", pretension={0.2 * strong:.4g}"
    if random.random() < 0.5:
        text += f", shear_stiffness={10 ** random.uniform(6, 9):.4g}"
        text += random.choice(["", f", shear_strength={10 ** random.uniform(3, 5):.4g}"])
    return text + f", spacing_out_of_plane={random.choice([1.0, 1.5])}"


def ends(random: np.random.Generator, segments: list[list[float]], half: float) -> np.ndarray:
    """Anywhere, at any angle; in joints, in corners, along joints, outside."""
    lines = np.array(segments)
    found = random.uniform(-half, half, (2, 2))
    which = random.integers(0, 6)
    one = lines[random.integers(len(lines))].reshape(2, 2)
    if which == 1:  # an end in a joint
        found[0] = one[0] + random.random() * (one[1] - one[0])
    elif which == 2:  # an end in a corner
        found[0] = one[random.integers(2)]
    elif which == 3:  # along a joint
        share = np.sort(random.random(2))
        found = one[0] + share[:, None] * (one[1] - one[0])
    elif which == 4:  # an end outside
        found[1] = random.uniform(half, 1.5 * half, 2) * random.choice([-1.0, 1.0], 2)
    elif which == 5:  # from corner to corner
        found = np.array([one[0], lines[random.integers(len(lines))].reshape(2, 2)[1]])
    return np.clip(found, -2 * half, 2 * half)


def network(drawn: Values, bench: Bench) -> None:
    """No crash; the energies balance to 1e-9 of the turnover; the run comes to rest, or ends with a message."""
    random = np.random.default_rng(drawn["seed"])
    half = 5.0
    corners = [[-half, -half], [half, -half], [half, half], [-half, half]]
    segments = [[*corners[k], *corners[(k + 1) % 4]] for k in range(4)]
    for _ in range(drawn["joints"]):
        a, b = random.uniform(-half, half, (2, 2))
        d = (b - a) / np.hypot(*(b - a))
        line = [*(a - 30 * d), *(a + 30 * d)]
        segments.append(line)
        if random.random() < 0.3:  # a thin splinter beside it
            shift = 10 ** random.uniform(-2.5, -1) * np.array([-d[1], d[0]])
            segments.append([*(np.array(line[:2]) + shift), *(np.array(line[2:]) + shift * random.choice([1.0, 0.6]))])
    inside = [[float(x) for x in line] for line in segments]
    model = Model(lines=_lines(inside))
    bolts = []
    for k in range(drawn["bolts"]):
        head, toe = ends(random, [np.clip(line, -half, half).tolist() for line in inside], half)
        if np.hypot(*(toe - head)) < 0.05:
            continue
        text = steel(random, KINDS_OF_BOLTS[random.integers(4)])
        bolts.append(f"&bolt name='b{k}', from={head[0]:.9g},{head[1]:.9g}, to={toe[0]:.9g},{toe[1]:.9g}, {text} /")
    first = f"install='b{drawn['bolts'] - 1}'," if bolts and f"'b{drawn['bolts'] - 1}'" in bolts[-1] else ""
    still = "until='equilibrium', max_steps=300, on_failure='continue'"
    model.groups = [
        rock(young=2e10, more=", unit_weight=26000.0"),
        joint(friction=float(random.uniform(15, 45))),
        f"&boundary along={-half},{-half}, {half},{-half}, kind='fixed' /",
        f"&boundary along={-half},{-half}, {-half},{half}, kind='roller' /",
        f"&boundary along={half},{-half}, {half},{half}, kind='roller' /",
        f"&boundary along={-half},{half}, {half},{half}, kind='traction', pressure={10 ** random.uniform(3, 6):.4g} /",
        f"&region name='room', box=-1.5,{-half}, 1.5,0 /",
        *bolts,
        f"&stage name='load', {still} /",
        f"&stage name='dig', {still}, {first} excavate='room' /",
        "&stage name='shake', kind='dynamic', duration=0.02 /",
    ]
    run = judged(model, bench)
    if bolts and run.code == 0:
        force = run.get("history/bolt_force")
        require(bool(np.isfinite(force).all()), "a bolt has a force that is no number")


def judged(model: Model, bench: Bench) -> Run:
    """A run that ends well or with a message, whose energies balance."""
    run = bench.run(model, may_fail=True)
    if run.code == 2:  # such as a bolt outside the rock, or no block in the room
        require("error" in run.messages, "refused without a message")
        raise Unsuited
    require(run.code in (0, 3), f"exit {run.code}")
    if run.code == 3:
        require("error" in run.messages, "ended without a message")
    if not run.results.exists():
        raise Unsuited
    rows = run.energy()
    turnover = max(float(np.abs(values).max(initial=0.0)) for name, values in rows.items() if name != "residual")
    rest = float(np.abs(rows["residual"]).max(initial=0.0))
    require(rest <= 1e-9 * turnover, f"energies miss {rest / turnover:.1e} of the turnover")
    return run


def opening(random: np.random.Generator, size: float) -> np.ndarray:
    """A square, a horseshoe, a circle of few edges or a slit, counter-clockwise from its bottom."""
    wide, high = size * 10 ** random.uniform(-0.4, 0.2, 2)
    kind = random.integers(4)
    if kind == 0:
        return np.array([[-wide, -high], [wide, -high], [wide, high], [-wide, high]])
    n = int(random.integers(5, 40))
    if kind == 1:
        angle = 2 * np.pi * (np.arange(n) + random.random()) / n
        return size * np.column_stack([np.cos(angle), np.sin(angle)])
    angle = np.pi * np.arange(n + 1) / n
    roof = np.column_stack([wide * np.cos(angle), high * (1.0 if kind == 2 else 0.2) * np.sin(angle)])
    return np.vstack([[[-wide, -high], [wide, -high]], roof])


def shell(random: np.random.Generator, wall: np.ndarray, size: float, young: float) -> list[str]:
    """A lining of the wall or of a part of it, bonded or not, of one or two layers."""
    thickness = size * 10 ** random.uniform(-2, -0.5)
    stress = young * 10 ** random.uniform(-5, -3)
    points = np.vstack([wall, wall[:1]])
    if random.random() < 0.5:  # an open one: without the floor, or anywhere
        points = np.roll(wall, -1 if random.random() < 0.7 else int(random.integers(len(wall))), axis=0)
    if random.random() < 0.3:
        points = points[::-1]
    numbers = f"young={young:.4g}, poisson={random.choice([0.0, 0.2, 0.3])}, density=2400"
    numbers += random.choice(["", f", element={thickness * 10 ** random.uniform(-0.3, 0.6):.4g}"])
    numbers += random.choice(["", f", compressive_strength={10 * stress:.4g}, tensile_strength={stress:.4g}"])
    numbers += random.choice(["", ", joint_material='skin'"])
    line = ", ".join(f"{x:.9g}, {y:.9g}" for x, y in points)
    groups = [f"&liner name='shell', along={line}, thickness={thickness:.4g}, {numbers} /"]
    if random.random() < 0.3:
        groups.append(f"&liner name='inner', on='shell', thickness={0.5 * thickness:.4g}, young={young:.4g} /")
    return groups


def lined(drawn: Values, bench: Bench) -> None:
    """The same of openings with linings from centimetres to kilometres; a run that goes on from its middle, with two
    threads, ends with the same bits."""
    random = np.random.default_rng(drawn["seed"])
    size = 10 ** drawn["scale"]
    half = 4 * size
    young, stiff = 10 ** drawn["young"], 10 ** drawn["ratio"]
    wall = opening(random, size)
    corners = [[-half, -half], [half, -half], [half, half], [-half, half]]
    segments = [[*corners[k], *corners[(k + 1) % 4]] for k in range(4)]
    segments += [[*wall[k - 1], *wall[k]] for k in range(len(wall))]
    for _ in range(drawn["joints"]):
        a, b = random.uniform(-half, half, (2, 2))
        d = (b - a) / np.hypot(*(b - a))
        segments.append([*(a - 8 * half * d), *(a + 8 * half * d)])
    text = _lines([[float(x) for x in line] for line in segments]).replace("0.001\n", f"{1e-4 * size:.4g}\n", 1)
    model = Model(lines=text)
    weight = young * 10 ** random.uniform(-6, -4) / half
    still = "until='equilibrium', max_steps=60, on_failure='continue'"
    tie = random.random() < 0.3
    extra = random.choice(["", ", cohesion=" + f"{young * 1e-5:.4g}, tension={young * 5e-6:.4g}"])
    linings = shell(random, wall, size, young * stiff)
    names = ", ".join(("shell", "inner")[: len(linings)])
    late = random.random() < 0.5
    model.groups = [
        rock(young=young, more=f", unit_weight={weight:.6g}", density=weight / 9.81),
        joint(friction=float(random.uniform(15, 45)), more=", tie=.true." if tie else ""),
        f"&joint_material number=2, name='skin', friction=30{extra} /",
        f"&boundary along={-half},{-half}, {half},{-half}, kind='fixed' /",
        f"&boundary along={-half},{-half}, {-half},{half}, kind='roller' /",
        f"&boundary along={half},{-half}, {half},{half}, kind='roller' /",
        f"&boundary along={-half},{half}, {half},{half}, kind='traction', pressure={weight * half:.6g} /",
        "&region name='room', polygon=" + ", ".join(f"{x:.9g},{y:.9g}" for x, y in wall) + " /",
        f"&region name='side', box={size:.9g},{-size:.9g}, {half:.9g},{size:.9g} /",
        *linings,
        f"&bolt name='b', from=0,{wall[:, 1].max():.9g}, to={0.5 * size:.9g},{0.9 * half:.9g}, "
        f"kind='grouted', area={1e-4 * size:.4g}, young={young * stiff:.4g}, "
        f"grout_stiffness={young:.4g}, grout_strength={young * size * 1e-5:.4g} /",
        f"&stage name='load', {still} /",
        f"&stage name='dig', {still}, excavate='room'" + (", relax=0.5 /" if late else f", install='{names}, b' /"),
        *([f"&stage name='line', {still}, install='{names}, b', relax=1 /"] if late else []),
        f"&stage name='then', {still}" + random.choice(["", ", excavate='side'", f", remove='{names}'"]) + " /",
        f"&change stage='then', liner='shell', young={2 * young * stiff:.4g} /",
        f"&stage name='shake', kind='dynamic', duration={0.02 * math.sqrt(size):.4g} /",
    ]
    run = judged(model, bench)
    ends = [run.get(f"frames/{name}")[-1] for name in ("vertices", "liner_force", "liner_point", "bolt_force")]
    require(all(bool(np.isfinite(end).all()) for end in ends), "a vertex or a force is no number")
    steps = len(run.get("history/time"))
    if run.code or steps < 4:
        return
    place, middle = bench.folder / "half", str(steps // 2)
    model.write(place)
    first = bench.call("run", "m.nml", "--force", "--steps", middle, "--threads", "2", folder=place)
    require(first.returncode == 0, f"half of it ends with {first.returncode}")
    done = bench.call("resume", "m.ckpt.h5", "--threads", "2", "--steps", str(steps - steps // 2), folder=place)
    require(done.returncode == 0, f"resumed, it ends with {done.returncode}: {done.stderr.strip()[-200:]}")
    again = Run(0, "", "", place / "m.h5")
    for name in ("history/energy", "history/time"):
        require(np.array_equal(run.get(name), again.get(name)), f"{name} has other bits after a resumption")
    for name, end in zip(("vertices", "liner_force", "liner_point", "bolt_force"), ends, strict=True):
        require(np.array_equal(end, again.get(f"frames/{name}")[-1]), f"{name} has other bits after a resumption")


def hang(drawn: Values, bench: Bench) -> None:
    """A block on two grouted bars falls when it is heavier than both yield forces, and hangs when it is lighter."""
    most, height, above = drawn["yield_force"], drawn["height"], drawn["above"]
    strength = drawn["grout"] * most / min(height, above)  # both ends hold more than the steel
    wide, roof = 3.0, above + 1.0
    corners = [(-wide, 0), (wide, 0), (wide, roof), (-wide, roof), (-1, -height), (1, -height), (1, 0), (-1, 0)]
    sides = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (7, 4)]
    model = Model(lines=_lines([[*corners[a], *corners[b]] for a, b in sides]))
    bar = (
        f"kind='grouted', diameter=0.025, young=200e9, yield_force={most:.9g}, "
        f"grout_stiffness={drawn['stiffness']:.4g}, grout_strength={strength:.9g}"
        + (f", element={drawn['element'] * above:.4g}" if drawn["element"] else "")
    )
    model.groups = [
        rock(young=2e10, more=f", unit_weight={drawn['share'] * 2 * most / (2 * height):.9g}"),
        joint(friction=0.0),
        f"&boundary along={-wide},{roof}, {wide},{roof}, kind='fixed' /",
        *(f"&bolt name='b{x}', from={x},{-height}, to={x},{above}, {bar} /" for x in (-0.5, 0.5)),
        "&stage name='hang', until='equilibrium' /",
    ]
    hangs = bench.run(model, may_fail=True).code == 0
    weight = f"{drawn['share']:.3g} of both yield forces"
    require(hangs == (drawn["share"] < 1), f"{weight}: it {'hangs' if hangs else 'falls'}")


KINDS = [
    Kind(
        "hung-on-bars",
        "support",
        "a block on two grouted bars hangs when it is lighter than both yield forces, and falls when it is heavier",
        values(
            yield_force=decades(1e3, 3e5),
            height=between(0.3, 6.0),
            above=between(0.5, 10.0),
            grout=decades(1.5, 30.0),
            stiffness=decades(1e8, 1e10),
            element=st.sampled_from([0.0, 0.02, 0.3]),
            share=st.one_of(between(0.3, 0.97), between(1.03, 3.0)),
        ),
        hang,
    ),
    Kind(
        "bolted-networks",
        "support",
        "bolts at any place through random networks, loaded and excavated: no crash, balance to 1e-9, a clear end",
        values(seed=seeds(), joints=st.integers(1, 9), bolts=st.integers(1, 8)),
        network,
    ),
    Kind(
        "lined-networks",
        "support",
        "linings and bolts in random networks: no crash, balance to 1e-9, a clear end, the same bits when resumed",
        values(
            seed=seeds(),
            joints=st.integers(0, 7),
            scale=between(-2.0, 3.0),
            young=between(6.0, 11.0),
            ratio=between(-2.0, 2.0),
        ),
        lined,
        sample=1,
    ),
]
