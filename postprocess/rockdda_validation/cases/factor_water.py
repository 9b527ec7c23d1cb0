# SPDX-License-Identifier: MIT
"""Water: uplift on tilted and stepped bases and on moving blocks, a dam with uplift, and searches that are refused."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely
from rockdda.errors import ConvergenceError
from rockdda.model import Model

from ..case import Case, Record
from ..factor_models import GRAVITY, Dam, PlaneFailure, assemble, rectangle, stack
from ..factor_runs import LENGTH, draw_mechanism, draw_trial_values, search, trial_table

if TYPE_CHECKING:
    from rockdda.results import Results

__all__ = ["CASES"]

PART = "Critical factors"
WATER = 9810.0
FloatArray = npt.NDArray[np.float64]
INTEGRAL = "integral of the pressure over the polygon"

#: corners of blocks on level, tilted and stepped bases, and of these bases from left to right
BASES: dict[str, tuple[list[tuple[float, float]], list[tuple[float, float]]]] = {
    "level": ([(0, 0), (6, 0), (2, 9), (0, 9)], [(0, 0), (6, 0)]),
    "tilted by 8° up": ([(0, 0), (6, 0.84), (2, 9), (0, 9)], [(0, 0), (6, 0.84)]),
    "tilted by 5° down": ([(0, 0), (6, -0.52), (2, 9), (0, 9)], [(0, 0), (6, -0.52)]),
    "stepped": (
        [(0, 0), (2, 0), (2, 0.7), (4, 0.7), (4, 1.4), (6, 1.4), (2, 9), (0, 9)],
        [(0, 0), (2, 0), (2, 0.7), (4, 0.7), (4, 1.4), (6, 1.4)],
    ),
}


def water_load(polygon: FloatArray, table: FloatArray, weight: float = WATER) -> tuple[float, float, float]:
    """Force x, y of the water on a polygon that is wet all round, and its moment about the origin.

    By the divergence theorem -∮ p n ds = -∫ grad p dA: γ (-y_t', 1) times the area under each straight piece of the
    table, at the centroid of that area. (∮ p n over the table itself is zero, because p is.)
    """
    shape = shapely.Polygon(polygon)
    low, high = float(polygon[:, 1].min()) - 1.0, float(max(polygon[:, 1].max(), table[:, 1].max())) + 1.0
    left, right = float(polygon[:, 0].min()) - 1.0, float(polygon[:, 0].max()) + 1.0
    points = [(left, float(np.interp(left, *table.T)))]
    points += [(float(x), float(y)) for x, y in table if left < x < right]
    points.append((right, float(np.interp(right, *table.T))))
    total = np.zeros(3)
    for (x1, y1), (x2, y2) in itertools.pairwise(points):
        part = shape.intersection(shapely.Polygon([(x1, low), (x2, low), (x2, min(y2, high)), (x1, min(y1, high))]))
        if part.is_empty:
            continue
        slope, centre = (y2 - y1) / (x2 - x1), part.centroid
        force = weight * part.area * np.array([-slope, 1.0])
        total += [*force, centre.x * force[1] - centre.y * force[0]]
    return float(total[0]), float(total[1]), float(total[2])


def _standing(name: str, block: list[tuple[float, float]], base: list[tuple[float, float]], level: float) -> Model:
    """A block on a fixed base, wet all round under a sloping table."""
    below = [*base, (base[-1][0] + 4, base[-1][1]), (base[-1][0] + 4, -4.0), (-4.0, -4.0), (-4.0, 0.0)]
    model = assemble(name, [below, block], {0}, friction=60.0, gravity=GRAVITY)
    model.options["stage"] = [{"name": "weight", "until": "equilibrium", "tolerance": 1e-13, "max_steps": 400,
                               "on_failure": "continue"}]  # fmt: skip
    model.options["water"] = [{"name": "table", "table": [-4.0, level, 10.0, 0.6 * level], "unit_weight": WATER}]
    return model


def _on_block(results: Results, block: int) -> tuple[float, float]:
    """Sum of the contact forces on a block in the last frame."""
    contacts = results.frames[-1].contacts
    sign = (contacts.blocks[:, 0] == block).astype(float) - (contacts.blocks[:, 1] == block)
    x, y = (sign[:, None] * contacts.force).sum(axis=0)
    return float(x), float(y)


def uplift(record: Record) -> None:
    """The load of water on blocks that stand, and on one that moves."""
    record.text(
        "A block stands on a level, tilted or stepped base; it is wet all round under a table that slopes, so that the "
        "base carries uplift. In equilibrium the effective forces on the base are weight less water, of which the "
        "truth is the integral of the pressure gradient over the wet part of the polygon where it came to rest "
        "(shapely). A block that turns and sinks, not touching anything, is accelerated by that integral at the place "
        "that its velocity leads to by the middle of each step. Forces are per unit thickness."
    )
    level = 6.0
    for name, (block, base) in BASES.items():
        results = record.run(_standing(name.split()[0], block, base, level), name.replace(" ", "_"))
        moving = int(np.argmin(results.block_area))
        polygon = results.polygons(-1)[moving]
        weight = 2400.0 * GRAVITY * float(results.block_area[moving])
        loaded = water_load(polygon, np.array([[-4.0, level], [10.0, 0.6 * level]]))
        forces = _on_block(results, moving)
        for axis, found, expected in (("x", -forces[0], loaded[0]), ("y", weight - forces[1], loaded[1])):
            record.compare(
                f"{name} base: force of the water in {axis}", found, "N/m", truth=expected, truth_source=INTEGRAL,
                scale=abs(loaded[1]), allowed=1e-9,
            )  # fmt: skip
    _moving_block(record)


def _turned(points: FloatArray, angle: float) -> FloatArray:
    """Points (n, 2) turned about the origin."""
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return points @ turn.T


def _expected_halfway(polygon: FloatArray, centroid: FloatArray, velocity: FloatArray, dt: float) -> FloatArray:
    """Vertices halfway between the start of a step and the end that a mean velocity (6,) leads to."""
    arms = polygon - centroid
    strain = dt * np.array([[velocity[3], velocity[5] / 2], [velocity[5] / 2, velocity[4]]])
    end = centroid + dt * velocity[:2] + _turned(arms + arms @ strain, dt * float(velocity[2]))
    return 0.5 * (polygon + end)


def _moving_block(record: Record) -> None:
    """A tilted block that sinks and turns under a table with a kink."""
    corners = [(0.0, 0.0), (3.0, 0.4), (2.6, 2.4), (-0.3, 1.8)]
    model = Model("sinking", e0=1e-3, labelled=True)
    model.add_polygon(corners)
    model.add_polygon(rectangle(-20, -30, 40, 1))
    model.add_fixed((-19.0, -29.5))
    model.add_fixed((19.0, -29.5))
    model.add_block_material(density=1500.0, youngs_modulus=1e12, poisson_ratio=0.2, name="rock")
    model.add_joint_material(friction_angle=30.0)
    table = np.array([[-20.0, 1.2], [1.0, 1.6], [20.0, 1.0]])
    model.options = {
        "load": {"gravity": GRAVITY},
        # the force is found from the gain of momentum in each step: Shi's scheme takes it from one instant
        "time": {"dt_max": 2e-3, "integrator": "shi"},
        "run": {"steps": 200, "save_every": 1},
        "water": [{"name": "table", "table": table.ravel().tolist(), "unit_weight": WATER}],
    }
    results = record.run(model, "sinking")
    block = int(np.argmin(results.block_area))
    mass = 1500.0 * float(results.block_area[block])
    vertices = [frame.polygons()[block] for frame in results.frames]
    velocity = np.array([frame.velocity[block] for frame in results.frames])
    times = results.times
    worst, turned = 0.0, float(results.frames[-1].rotation[block])
    for k in range(1, len(vertices)):
        dt = times[k] - times[k - 1]
        gained = mass * (velocity[k, :2] - velocity[k - 1, :2]) / dt + [0.0, mass * GRAVITY]
        # expected is the motion with the acceleration of the last step, whose motion is the mean of its velocities
        expected = 1.5 * velocity[k - 1] - 0.5 * velocity[max(k - 2, 0)]
        middle = _expected_halfway(vertices[k - 1], results.frames[k - 1].centroid[block], expected, dt)
        if k == 1:  # at rest nothing is expected, and the water is placed anew by the motion found
            middle = 0.5 * (vertices[0] + vertices[1])
        loaded = water_load(middle, table)
        worst = max(worst, float(np.hypot(*(gained - np.array(loaded[:2])))) / loaded[1])
    sunk = float(vertices[0][:, 1].mean() - vertices[-1][:, 1].mean())
    record.text(
        f"The moving block sinks by {sunk:.2f} m and turns by {math.degrees(turned):.1f}° in {times[-1]:.2f} s."
    )
    record.compare(
        "moving block: largest error of the water's force in any step", worst, truth=0.0, truth_source=INTEGRAL,
        scale=1, allowed=1e-9,
    )  # fmt: skip


def _closed_share(results: Results, case: Dam) -> float:
    """Share of the base of the dam that is closed in the settled state."""
    dam_block = max(range(len(results.block_area)), key=lambda i: float(results.polygons(0)[i][:, 1].max()))
    contacts = results.frames[0].contacts
    assert contacts.length is not None
    below = (contacts.blocks == dam_block).any(axis=1)
    closed = float(contacts.length[below & (contacts.state > 0)].sum())
    return closed * math.cos(math.radians(case.tilt)) / case.base


def dam(record: Record) -> None:
    """A gravity dam on a jointed foundation with uplift."""
    record.text(
        "A dam 30 m high on a layer of foundation blocks 6 m wide and 4 m thick; 28 m of water at its face, in the "
        "joints a table that falls in a straight line from the heel to the toe. The base is the weakest joint "
        "(45°, rock joints 60°). By hand: weight W, thrust V = γw h²/2, uplift U = γw h L/2; on a level base "
        "F = (c L + (W - U) tan φ)/V, on a tilted one with their components along and across it. "
        "Where the base has cohesion, L is the length that is closed in the settled state: joints between foundation "
        f"blocks hold parts of it open. {LENGTH}"
    )
    cases = {
        "level base": Dam(),
        "level base with cohesion 0.1 MPa": Dam(friction=40.0, cohesion=0.1e6),
        "base tilted by 5° up to the toe": Dam(tilt=5.0),
        "base tilted by 5° down to the toe": Dam(tilt=-5.0),
    }
    found = []
    for number, (name, case) in enumerate(cases.items()):
        one = search(record, case.model(), f"dam_{number}", tolerance=0.005, joints="base")
        assert one.results is not None
        if case.cohesion:
            record.compare(
                f"{name}: F, whole base", one.value, truth=case.factor, truth_source="statics",
                explanation="Cohesion acts where the joint is closed; between the foundation blocks it is open",
            )  # fmt: skip
            case = replace(case, closed=_closed_share(one.results, case))
        # the closed length is that of the settled state; as the strength falls it changes
        allowed = 0.02 if case.cohesion else 0.01
        record.compare(f"{name}: F", one.value, truth=case.factor, truth_source="statics", allowed=allowed)
        found.append((name, one))
    trial_table(record, found, "Search of the sliding factor of the dam")
    draw_mechanism(record, found[0][1], "mechanism", "The dam at the first factor that fails")
    draw_trial_values(record, found[0][1], "search", "The search, level base")


def refusal(record: Record) -> None:
    """Searches without an answer end with exit code 3 and a sentence that says what to do."""
    record.text(
        "Three searches that have no answer: a stack that is not stable at the lower end of the range, one that is "
        "still stable at its upper end, and a slope that slides in the stage before the search. Each must end with "
        "exit code 3 and say so; nothing is made up."
    )
    weak = PlaneFailure(cohesion=0.0, friction=30.0).model()
    weak.options["stage"][0]["max_steps"] = 30  # before it has slid off and lies on the ground
    searches = {
        "not stable": (stack(5), {"search": "tilt", "from_": 40.0, "to": 60.0}),
        "stable at": (stack(2), {"search": "tilt", "to": 20.0}),
        "did not come to equilibrium": (weak, {"search": "tilt"}),
    }
    told = []
    for words, (model, options) in searches.items():
        try:
            search(record, model, words.replace(" ", "_"), **options)  # type: ignore[arg-type]
            message = "no refusal"
        except ConvergenceError as error:
            message = str(error)
        told.append(f"- {message}")
        record.compare(
            f"refused with '{words}'", float(words in message), truth=1.0, truth_source="the case", scale=1, allowed=0
        )
    record.text("The program says:\n\n" + "\n".join(told))


CASES = [
    Case("factor-uplift", "Load of water on tilted and stepped bases and moving blocks", PART, uplift),
    Case("factor-dam", "Gravity dam on a jointed foundation with uplift", PART, dam),
    Case("factor-refusal", "Searches that are refused", PART, refusal),
]
