# SPDX-License-Identifier: MIT
"""Models that are broken on purpose: `check` says so, or the answers stay as they were.

A rock face of beds and cross joints, drawn as lines, is valid and checks without a warning. One thing is made wrong.
The answers are the number of blocks, their area, and the settlement under the weight.
"""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Fault, G, Model, Unsuited, box, joint, rock
from .drawing import Kind, Values, between, decades, seeds, values

Line = list[float]
#: a change of an answer that may not be silent
SILENT = 0.01


def _face(drawn: Values) -> tuple[list[Line], list[Line], float, float]:
    """Outline and joints of a bedded rock: beds from side to side, cross joints between two beds each."""
    random = np.random.default_rng(drawn["seed"])
    wide, high, beds = 12.0 * drawn["scale"], 8.0 * drawn["scale"], drawn["beds"]
    levels = np.linspace(0, high, beds + 2)
    levels[1:-1] += random.uniform(-0.1, 0.1, beds) * high / beds
    outline = [[0.0, 0.0, wide, 0.0], [wide, 0.0, wide, high], [wide, high, 0.0, high], [0.0, high, 0.0, 0.0]]
    joints = [[0.0, float(y), wide, float(y)] for y in levels[1:-1]]
    for k in range(beds + 1):
        cross = np.arange(1, drawn["cross"] + 1) + random.uniform(-0.15, 0.15) + (0.25 if k % 2 else -0.25)
        for x in cross / (drawn["cross"] + 1) * wide:
            joints.append([float(x), float(levels[k]), float(x), float(levels[k + 1])])
    return outline, joints, wide, high


def _write(outline: list[Line], joints: list[Line], wide: float, options: Values) -> Model:
    rows = [f"{1e-4 * wide!r}", f"{len(outline) + len(joints)} {len(outline)}", "0 0 0 0 0 0"]
    rows += [" ".join(repr(x) for x in line) + " 2" for line in outline]
    rows += [" ".join(repr(x) for x in line) + " 1" for line in joints]
    model = Model(lines="\n".join(rows) + "\n")
    water = f"&water name='w', table=0,{options['level']!r}, unit_weight={options['water']!r} /"
    model.groups = [
        rock(young=options["young"], density=options["density"]),
        joint(1, options["friction"], normal_stiffness=options["stiffness"], shear_stiffness=options["stiffness"] / 2),
        joint(2, options["friction"]),
        f"&load gravity={options['gravity']!r} /",
        f"&boundary along=0,0, {wide!r},0, kind='fixed' /",
        water,
        "&stage name='weight', until='equilibrium', water='w' /",
    ]
    return model


def _answers(bench: Bench, model: Model, name: str) -> tuple[float, ...] | None:
    run = bench.run(model, name=name, may_fail=True)
    if run.code:
        return None
    return (
        float(len(run.get("model/block_area"))),
        float(run.get("model/block_area").sum()),
        float(np.hypot(*run.moved().T).max()),
    )


def _warnings(text: str) -> list[str]:
    return [line for line in text.splitlines() if "warning: " in line or "error: " in line]


def _judge(drawn: Values, bench: Bench, break_it: str) -> None:
    outline, joints, wide, high = _face(drawn)
    options = {
        "young": 2e10,
        "density": 2600.0,
        "friction": 35.0,
        "stiffness": 5e9,
        "gravity": G,
        "water": 9810.0,
        "level": 0.3 * high,
    }
    valid = _write(outline, joints, wide, options)
    before, said = _answers(bench, valid, "valid"), _warnings(bench.check(valid, "valid").messages)
    if before is None or said:
        raise Unsuited
    random = np.random.default_rng(drawn["seed"] + 1)
    broken: Model
    if break_it == "gap":
        k, share = int(random.integers(4)), drawn["share"]
        x, y, u, v = outline[k]
        outline[k] = [x, y, u + share * (x - u), v + share * (y - v)]
    elif break_it == "swapped":
        k = int(random.integers(len(outline) + len(joints)))
        lines = outline if k < len(outline) else joints
        k -= 0 if lines is outline else len(outline)
        x, y, u, v = lines[k]
        lines[k] = [y, x, u, v]
    elif break_it == "lost":
        del joints[int(random.integers(drawn["beds"]))]
    elif break_it == "unit":
        name, factor = drawn["unit"]
        options[name] *= factor
    broken = _write(outline, joints, wide, options)
    after = _answers(bench, broken, "broken")
    if after is None:
        return  # refused
    apart = max(abs(b / a - 1) for a, b in zip(before, after, strict=True))
    if apart > SILENT and not _warnings(bench.check(broken, "broken").messages):
        raise Fault(
            f"check says nothing; blocks, area, settlement {', '.join(f'{x:.4g}' for x in before)} become "
            f"{', '.join(f'{x:.4g}' for x in after)}"
        )


def double(drawn: Values, bench: Bench) -> None:
    """A block that is there twice."""
    random = np.random.default_rng(drawn["seed"])
    blocks = [box(-1, -1, 6, 1)] + [box(k, 0, 1, float(random.uniform(0.5, 2))) for k in range(4)]
    twin = blocks[int(random.integers(1, 5))]
    model = Model(blocks=[*blocks, twin + drawn["aside"]], held={0})
    model.groups = [rock(), joint(), f"&load gravity={G} /", "&stage until='equilibrium' /"]
    if not _warnings(bench.check(model).messages):
        raise Fault("check says nothing of a block that is there twice")


def _kind(name: str, truth: str, break_it: str, known: str = "", **more: st.SearchStrategy[object]) -> Kind:
    drawn = values(seed=seeds(), scale=decades(0.5, 5, 10), beds=st.integers(1, 4), cross=st.integers(1, 4), **more)
    return Kind(name, "silence", truth, drawn, lambda drawn, bench: _judge(drawn, bench, break_it), known)


UNITS = st.sampled_from(
    [
        ("young", 1e-6),
        ("young", 1e-3),
        ("young", 1e-9),
        ("density", 1e-3),
        ("density", G),
        ("friction", math.pi / 180),
        ("stiffness", 1e-6),
        ("stiffness", 1e-3),
        ("gravity", 1e3),
        ("gravity", 0.1),
        ("water", 1e-3),
        ("water", 1 / G),
    ]
)
TOLD = "`check` says so, or blocks, area and settlement stay within 1 %: "
KINDS = [
    _kind("open-outline", TOLD + "a gap in the outline", "gap", share=between(0.005, 0.2, 39)),
    _kind(
        "wrong-unit",
        TOLD + "one number in another unit",
        "unit",
        "a modulus, density, gravity or stiffness of joints far too low is taken without a word",
        unit=UNITS,
    ),
    _kind(
        "swapped-coordinates",
        TOLD + "x and y of one end of a line exchanged",
        "swapped",
        "a joint inside that runs elsewhere makes another model, which is valid as well",
    ),
    _kind("lost-bed", TOLD + "a bed on which cross joints end is missing", "lost"),
    Kind(
        "double-block",
        "silence",
        "`check` names a block that is there twice",
        values(seed=seeds(), aside=between(0, 0.05, 5)),
        double,
    ),
]
