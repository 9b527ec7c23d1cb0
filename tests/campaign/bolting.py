# SPDX-License-Identifier: MIT
"""Bolts with nodes through random networks of joints, under load and excavation."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Model, Unsuited, joint, require, rock
from .drawing import Kind, Values, seeds, values
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
    run = bench.run(model, may_fail=True)
    if run.code == 2:  # such as a bolt outside the rock, or no block in the room
        require("error" in run.messages, "refused without a message")
        raise Unsuited
    require(run.code in (0, 3), f"exit {run.code}")
    if run.code == 3:
        require("error" in run.messages, "ended without a message")
    if not run.results.exists():
        return
    rows = run.energy()
    turnover = max(float(np.abs(values).max(initial=0.0)) for name, values in rows.items() if name != "residual")
    rest = float(np.abs(rows["residual"]).max(initial=0.0))
    require(rest <= 1e-9 * turnover, f"energies miss {rest / turnover:.1e} of the turnover")
    if bolts and run.code == 0:
        force = run.get("history/bolt_force")
        require(bool(np.isfinite(force).all()), "a bolt has a force that is no number")


KINDS = [
    Kind(
        "bolted-networks",
        "support",
        "bolts at any place through random networks, loaded and excavated: no crash, balance to 1e-9, a clear end",
        values(seed=seeds(), joints=st.integers(1, 9), bolts=st.integers(1, 8)),
        network,
    ),
]
