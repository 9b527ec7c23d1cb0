# SPDX-License-Identifier: MIT
"""Factors of safety of slopes by strength reduction: plane failure dry and with water, toppling, random blocks."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rockdda import networks
from rockdda.analysis.limit_analysis import RigidBlocks
from rockdda.model import Model
from rockdda.program import find_program

from ..case import Case, Record
from ..factor_models import PlaneFailure, assemble, random_plane_failures
from ..factor_runs import ASSOCIATED, LENGTH, draw_mechanism, draw_trial_values, search, trial_table
from .closed_toppling import BLOCKS, DENSITY, DIP, GRAVITY, HEIGHT, STEP, TOP, WEIGHT, WIDTH, handed_on
from .factor_water import WATER, water_load

if TYPE_CHECKING:
    from rockdda.critical import CriticalFactor

__all__ = ["CASES", "random_slope", "toppling_slope"]

PART = "Critical factors"


def plane_failures(record: Record) -> None:
    """A block on a plane with friction and cohesion."""
    cases = [PlaneFailure(), *random_plane_failures(10 if record.full else 4)]
    record.text(
        "A block between slope face, failure plane and a vertical tension crack; F = (c A + W cos ψ tan φ)/(W sin ψ) "
        "(Hoek & Bray 1981). The first is Sau Mau Ping, dry; the others have random heights (20 to 100 m), faces, "
        "planes, cracks, friction and cohesion, of which those are taken whose resultant lies in the middle third of "
        f"the plane, so that the whole plane is closed, as the formula has it. {LENGTH}"
    )
    found = []
    for number, case in enumerate(cases):
        name = "Sau Mau Ping, dry" if number == 0 else f"plane failure {number}"
        one = search(record, case.model(), f"plane_{number}", tolerance=0.002)
        words = f"{name} ({case.height:.0f} m, plane {case.plane:.0f}°, φ {case.friction:.0f}°, "
        words += f"c {case.cohesion / 1e3:.0f} kPa): F"
        record.compare(words, one.value, truth=case.factor, truth_source="Hoek & Bray (1981)", allowed=0.01)
        found.append((name, one))
    wrong = sum(one.mechanism.kind != "sliding" for _, one in found)
    record.compare(
        f"mechanisms that are not sliding, of {len(found)}", wrong, truth=0, truth_source="statics", scale=1, allowed=0
    )
    trial_table(record, found, "Search of the factor of plane failures")


def sau_mau_ping(record: Record) -> None:
    """Sau Mau Ping for water depths in the tension crack."""
    record.text(
        "Sau Mau Ping with water in the tension crack to a share of its depth, which drains along the plane to the "
        "toe: U on the plane and V on the crack are triangles of pressure, F = (c A + (W cos ψ - U - V sin ψ) tan φ)/"
        f"(W sin ψ + V cos ψ) (Hoek & Bray 1981). {LENGTH}"
    )
    found = []
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        case = PlaneFailure(water=share)
        one = search(record, case.model("sau_mau_ping"), f"water_{share:g}", tolerance=0.002)
        record.compare(
            f"water to {share:g} of the crack: F", one.value, truth=case.factor, truth_source="Hoek & Bray (1981)",
            allowed=0.015,
        )  # fmt: skip
        found.append((f"water to {share:g}", one))
    trial_table(record, found, "Search of the factor at Sau Mau Ping")
    draw_mechanism(record, found[-1][1], "mechanism", "Sau Mau Ping, crack full, at the first factor that fails")
    draw_trial_values(record, found[-1][1], "search", "The search, crack full")


STEEP, GENTLE = math.radians(50), math.radians(12)  # planes of the two blocks
KINK = (30.0, 30.0 * math.tan(GENTLE))  # where they meet, below the joint between the blocks
CREST = 20.0
TABLE = np.array([(-10.0, -2.5), (0.0, 0.0), (30.0, 12.0), (70.0, 16.0)])


def two_block_slide(chamfer: float) -> Model:
    """A block on a steep plane that pushes one on a gentle plane.

    The tip of the upper block between plane and joint is cut off at a height `chamfer` above the kink.
    """
    x, y = KINK
    cut, top = x + chamfer / math.tan(STEEP), x + (CREST - y) / math.tan(STEEP)
    tip = [(cut, y + chamfer)] if chamfer > 0 else []
    outlines = [
        [(-10, -10), (70, -10), (70, CREST), (top, CREST), *tip, KINK, (0, 0), (-10, -2.5)],
        [(0, 0), KINK, *([(x, y + chamfer)] if tip else []), (x, CREST), (10, CREST)],
        [(x, y + chamfer), *tip, (top, CREST), (x, CREST)],
    ]
    return assemble("two_blocks", outlines, {0}, friction=30.0)


def two_block_factor(blocks: RigidBlocks) -> float:
    """F by statics: friction tan φ/F acts in full on both planes and on the joint between the blocks."""
    load = np.zeros((3, 3)) if blocks.load is None else blocks.load
    toe, upper = sorted(blocks.free, key=lambda i: float(blocks.polygons[i][:, 0].min()))
    (x1, y1), (x2, y2) = (load[i, :2] - (0.0, blocks.weight[i]) for i in (toe, upper))

    def shortage(factor: float) -> float:
        t = math.tan(math.radians(blocks.friction[1])) / factor
        s, c = math.sin(STEEP), math.cos(STEEP)
        # upper block: normal force N of its plane, pressure E of the joint, friction up the plane and up the joint
        _, pressure = np.linalg.solve([[t * c - s, 1.0], [c + t * s, t]], [-x2, -y2])
        s, c = math.sin(GENTLE), math.cos(GENTLE)
        normal, shear = np.linalg.solve([[-s, c], [c, s]], [pressure - x1, t * pressure - y1])
        return float(shear - t * normal)

    low, high = 0.5, 5.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if shortage(middle) > 0 else (middle, high)
    return low


def two_blocks(record: Record) -> None:
    """A block that pushes another."""
    record.text(
        "A block on a plane of 50° pushes one on a plane of 12°; the joint between them is vertical, φ = 30° "
        "everywhere. At the limit friction acts in full on the three joints, and statics gives F. The upper block has "
        "a tip in the kink of the planes, which is cut off 0.4 m above it, as it would be crushed. Left as sharp as "
        f"drawn, the tip stands on the gentle plane, and the rigid mechanism of the formula cannot move. {LENGTH}"
    )
    found = []
    for name, chamfer, wet in (("dry", 0.4, False), ("water", 0.4, True), ("dry, sharp tip", 0.0, False)):
        model = two_block_slide(chamfer)
        blocks = RigidBlocks.from_model(model)
        if wet:
            model.options["water"] = [{"name": "table", "table": TABLE.ravel().tolist(), "unit_weight": WATER}]
            blocks = blocks.with_load([water_load(one, TABLE) for one in blocks.polygons])
        one = search(record, model, name.replace(", ", "_").replace(" ", "_"), tolerance=0.005)
        record.compare(
            f"{name}: F", one.value, truth=two_block_factor(blocks), truth_source="statics",
            **({"allowed": 0.01} if chamfer else {"explanation": "the tip stands on the gentle plane"}),
        )  # fmt: skip
        found.append((name, one))
    trial_table(record, found, "Search of the factor of the two blocks")
    draw_mechanism(record, found[1][1], "mechanism", "The two blocks, with water, at the first factor that fails")


def _with_anchor(angle: float, force: float) -> float:
    """Force that the toe block hands on when a horizontal anchor holds it with `force` [N]."""
    tangent = math.tan(math.radians(angle))
    held = WEIGHT[0] * (math.cos(DIP) * tangent - math.sin(DIP)) + force * (tangent * math.sin(DIP) + math.cos(DIP))
    return float(handed_on(angle)[0][1] - held / (1 - tangent**2))


def required(force: float) -> float:
    """tan φ at the limit by Goodman and Bray's recursion, with an anchor in the toe block."""
    low, high = 31.0, 44.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _with_anchor(middle, force) > 0 else (low, middle)
    return math.tan(math.radians(0.5 * (low + high)))


def _global(s: float, n: float) -> tuple[float, float]:
    """From coordinates down the dip and across it."""
    return s * math.cos(DIP) + n * math.sin(DIP), -s * math.sin(DIP) + n * math.cos(DIP)


def toppling_slope(tangent: float, anchor: float = 0.0) -> Model:
    """Goodman and Bray's sixteen blocks on a fixed base with steps, as a labelled model."""
    model = Model("toppling", e0=0.01, labelled=True)
    front, bottom, back = 20.0, -10.0, -BLOCKS * WIDTH
    outline = [(front, bottom), (front, 0.0), (0.0, 0.0)]
    for n in range(1, BLOCKS):
        outline += [(-n * WIDTH, (n - 1) * STEP), (-n * WIDTH, n * STEP)]
    outline += [(back, (BLOCKS - 1) * STEP), (back, bottom)]
    for start, end in zip(outline, outline[1:] + outline[:1], strict=True):
        model.add_line(_global(*start), _global(*end))
    for n in range(BLOCKS):
        model.add_line(_global(-n * WIDTH, TOP[n]), _global(-(n + 1) * WIDTH, TOP[n]))
        model.add_line(_global(-n * WIDTH, n * STEP), _global(-n * WIDTH, max(TOP[n], TOP[max(n - 1, 0)])))
    model.add_line(_global(back, (BLOCKS - 1) * STEP), _global(back, TOP[-1]))
    for point in [(front - 1, -9.0), (back + 1, -9.0), (-80.0, -9.0), (back + 1, 13.0), (front - 1, -1.0)]:
        model.add_fixed(_global(*point))
    if anchor:
        model.add_loading(_global(-0.5 * WIDTH, 0.5 * HEIGHT[0]), table=[(0.0, -anchor, 0.0), (1e3, -anchor, 0.0)])
    model.add_block_material(density=DENSITY, youngs_modulus=20e9, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=math.degrees(math.atan(tangent)), name="joint")
    model.options = {"load": {"gravity": GRAVITY}, "stage": [{"name": "weight", "until": "equilibrium"}]}
    return model


def toppling(record: Record) -> None:
    """Goodman and Bray's toppling slope."""
    record.text(
        "Goodman and Bray's first example: sixteen blocks on a stepped base of 30°. At the limit tan φ = 0.7855 acts "
        "on all joints, the upper blocks topple and the blocks at the toe slide. Without support and with tan φ = "
        "0.9489, F = 0.9489/0.7855 = 1.208. With tan φ = 0.7855 and a horizontal anchor of 2013 kN/m in the toe block "
        "the recursion requires tan φ = 0.650, so that F is 1.208 as well. Friction in the recursion is mobilised in "
        f"full between all blocks, which statics does not demand. {LENGTH}"
    )
    found = []
    for name, tangent, anchor in (("free", 1.208 * required(0.0), 0.0), ("anchored", required(0.0), 2013e3)):
        truth = tangent / required(anchor)
        model = toppling_slope(tangent, anchor)
        one = search(record, model, name, tolerance=0.005)
        record.compare(f"{name}: F", one.value, truth=truth, truth_source="Goodman & Bray (1976)", allowed=0.03)
        blocks = RigidBlocks.from_model(model)
        loaded = _with_anchor_load(blocks, anchor)
        record.compare(
            f"{name}: F by limit analysis", loaded.strength(), truth=truth, truth_source="Goodman & Bray (1976)",
            explanation=f"{ASSOCIATED}: here the sides of the toppling blocks slide and lock",
        )  # fmt: skip
        found.append((name, one))
    free = found[0][1]
    assert free.results is not None
    motion = dict(zip(free.mechanism.blocks, free.mechanism.kinds, strict=True))
    from_the_toe = np.argsort(-free.results.block_centroid[:, 0])
    order = [int(i) for i in from_the_toe if i != int(np.argmax(free.results.block_area))]
    _, modes = handed_on(math.degrees(math.atan(required(0.0))))
    expected = {"topples": "toppling", "slides": "sliding", "": None}
    wrong = [
        n
        for n, block in enumerate(order, start=1)
        if expected[modes[n - 1]] is not None and motion.get(block) != expected[modes[n - 1]]
    ]
    record.text(
        "Blocks from the toe up, as the recursion has them: "
        + ", ".join(f"{n} {mode or 'rests'}" for n, mode in enumerate(modes, start=1))
        + "; as the program has them: "
        + ", ".join(f"{n} {motion.get(block, 'rests')}" for n, block in enumerate(order, start=1))
        + "."
    )
    record.compare("blocks whose motion differs from the recursion's", len(wrong), truth=0,
                   truth_source="Goodman & Bray (1976)", scale=1, allowed=1)  # fmt: skip
    trial_table(record, found, "Search of the factor of the toppling slope")
    draw_mechanism(record, free, "mechanism", "The slope at the first factor that fails")


def _with_anchor_load(blocks: RigidBlocks, anchor: float) -> RigidBlocks:
    """The anchor's force as a dead load on the toe block, at its half height in the middle."""
    if not anchor:
        return blocks
    place = np.array(_global(-0.5 * WIDTH, 0.5 * HEIGHT[0]))
    centre = [np.mean(one, axis=0) for one in blocks.polygons]
    toe = min(blocks.free, key=lambda i: float(np.hypot(*(centre[i] - place))))
    load = np.zeros((len(blocks.polygons), 3))
    load[toe, 0] = -anchor  # through the centroid of the rectangle
    return blocks.with_load(load)


def random_slope(
    seed: int = 3, *, width: float = 20.0, height: float = 12.0, bedding: float = 1.3, cross: float = 1.6
) -> Model:
    """A slope of 65° with bedding that dips out of it at 25° and random cross joints, by their spacing."""
    network = networks.lines(
        {
            "boundary": {"window": [0, 0, width, height], "slope_toe": [6, 3], "slope_angle": 65},
            "joint_set": [
                {"inclination": 25, "spacing": bedding, "randomness": 0.3},
                {"inclination": 80, "spacing": cross, "ends_at": 1, "stagger": 0.5, "randomness": 0.2},
            ],
        },
        seed=seed,
    )
    model = network.model("random_slope", labelled=True)
    model.add_block_material(density=2500, youngs_modulus=20e9, poisson_ratio=0.25, name="rock")
    model.add_joint_material(friction_angle=40.0, name="joint")
    around = [0, 3, 0, 0, width, 0, width, height]
    model.options = {
        "load": {"gravity": 9.81},
        "boundary": [{"along": around, "kind": "fixed"}],
        "stage": [{"name": "weight", "until": "equilibrium"}],
    }
    return model


def stiffness_and_step(record: Record) -> None:
    """A slope of random blocks: does the factor depend on contact stiffness and time step?"""
    record.text(
        "A slope in bedded rock with random cross joints. Contact stiffness × 4 and ÷ 4, and half the largest time "
        "step: each search must end with the same factor, and every trial below the factor be stable, every one above "
        f"fail. {LENGTH}"
    )
    changes: dict[str, Callable[[Model, dict[str, float]], None]] = {
        "as it is": lambda model, numbers: None,
        "g0 × 4": lambda model, numbers: _set(model, stiffness=4 * numbers["stiffness"], dt_max=numbers["dt_max"]),
        "g0 ÷ 4": lambda model, numbers: _set(model, stiffness=numbers["stiffness"] / 4, dt_max=numbers["dt_max"]),
        "Δt ÷ 2": lambda model, numbers: _set(model, dt_max=numbers["dt_max"] / 2),
    }
    found: list[tuple[str, CriticalFactor]] = []
    numbers = automatic_numbers(random_slope(), record.folder / "numbers")
    blocks = len(random_slope().cut())
    record.text(
        f"{blocks} blocks; automatic numbers: g0 = {numbers['stiffness']:.3g} N/m, g1 = {numbers['dt_max']:.3g} s."
    )
    for name, change in changes.items():
        model = random_slope()
        change(model, numbers)
        one = search(record, model, name.replace(" ", "_").replace("×", "x").replace("÷", "over"), tolerance=0.005)
        found.append((name, one))
    first = found[0][1].value
    for name, one in found[1:]:
        record.compare(f"{name}: F", one.value, truth=first, truth_source="the same search as it is", allowed=0.02)
    for name, one in found:
        stable = [trial.value for trial in one.trials if trial.stable]
        failing = [trial.value for trial in one.trials if not trial.stable]
        record.compare(
            f"{name}: overlap of stable and failing values", max(0.0, max(stable) - min(failing)), truth=0.0,
            truth_source="monotony", scale=1, allowed=0,
        )  # fmt: skip
    trial_table(record, found, "Search of the factor of the slope")
    draw_mechanism(record, found[0][1], "mechanism", "The slope at the first factor that fails")


def _set(model: Model, **values: float) -> None:
    for name, value in values.items():
        setattr(model, name, value)


def automatic_numbers(model: Model, folder: Path) -> dict[str, float]:
    """Contact stiffness and largest time step that the program chooses for a model."""
    folder.mkdir(parents=True, exist_ok=True)
    model.write(folder, force=True)
    command = [find_program(), "check", str(folder / f"{model.name}.nml"), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)["model"]
    return {"stiffness": found["contact_stiffness"], "dt_max": found["time_step"]}


CASES = [
    Case("factor-plane-failure", "Plane failure with friction and cohesion", PART, plane_failures),
    Case("factor-sau-mau-ping", "Sau Mau Ping with water in the tension crack", PART, sau_mau_ping),
    Case("factor-two-blocks", "A block that pushes another, dry and with water", PART, two_blocks),
    Case("factor-toppling", "Toppling slope of Goodman and Bray", PART, toppling),
    Case("factor-numbers", "Slope of random blocks: stiffness and time step", PART, stiffness_and_step, quick=False),
]
