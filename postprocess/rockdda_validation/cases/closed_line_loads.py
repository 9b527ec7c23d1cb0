# SPDX-License-Identifier: MIT
"""Pressure on edges: a block under water, a dam, a push that varies in time."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from rockdda.model import Model

from ..case import Case, Record

FloatArray = npt.NDArray[np.float64]
WATER, GRAVITY = 9810.0, 9.81  # N/m3, m/s2
SURFACE = 12.0  # level of the water [m]
STONE = 2500.0  # kg/m3
#: corners of the block under water, counter-clockwise
PENTAGON = np.array([(1.0, 2.0), (4.0, 1.5), (5.5, 4.0), (3.0, 6.0), (0.5, 4.5)])
DAM = (4.0, 6.0)  # width, height [m]
PUSH = 2e5  # N/m, on an edge of 1 m


def block(corners: npt.ArrayLike, weight: float, *, density: float = STONE, **options: Any) -> Model:
    """One block."""
    model = Model("block", e0=0.001, steps=100, dt_max=0.01, displacement_ratio=0.1, **options)
    model.add_polygon(corners)
    model.add_block_material(density=density, weight=weight, youngs_modulus=1e10, poisson_ratio=0.25)
    model.add_joint_material(friction_angle=40.0)
    model.options = {"contact": {"stiffness": 1e10}}
    return model


def water_on(corners: FloatArray, edges: list[int], surface: float) -> list[dict[str, Any]]:
    """Line loads of water on edges (number of the first corner); the pressure is perpendicular to the edge."""
    loads = []
    for edge in edges:
        start, end = corners[edge], corners[(edge + 1) % len(corners)]
        along = (end - start) / np.hypot(*(end - start))
        inward = np.array([-along[1], along[0]])
        pressure = [WATER * max(surface - point[1], 0.0) for point in (start, end)]
        load = {"ends": [*start.tolist(), *end.tolist()]}
        load["force_start"] = (pressure[0] * inward).tolist()
        load["force_end"] = (pressure[1] * inward).tolist()
        loads.append(load)
    return loads


def area_and_centroid(corners: FloatArray) -> tuple[float, FloatArray]:
    """Of a polygon, by Gauss's formulas."""
    other = np.roll(corners, -1, axis=0)
    cross = corners[:, 0] * other[:, 1] - other[:, 0] * corners[:, 1]
    area = cross.sum() / 2
    return float(area), ((corners + other) * cross[:, None]).sum(axis=0) / (6 * area)


def line_loads(record: Record) -> None:
    """All three."""
    submerged(record)
    dam(record)
    push(record)
    record.energy_closes()


def submerged(record: Record) -> None:
    """Archimedes: buoyancy, and the mean stress."""
    area, centroid = area_and_centroid(PENTAGON)
    depth = SURFACE - centroid[1]
    record.text(
        f"""
**A block under water.** Water presses on all edges of a pentagon of {area:g} m² whose centroid lies {depth:.4g} m below
the surface: linear loads on five edges. Their resultant is the weight of the displaced water and goes through the
centroid, and the mean stress in the block is -γ_w·depth in all directions, as ∮ t⊗x ds shows. A block as heavy as water
stays where it is; a heavier one sinks with g(1 - ρ_w/ρ), upright.
"""
    )
    loads = water_on(PENTAGON, list(range(5)), SURFACE)
    model = block(PENTAGON, WATER, k01=0.0)
    model.add_measured(centroid)
    model.options |= {"line_load": loads}
    results = record.run(model, "floating")
    moved = results["history/measured_displacement"][-1, 0]
    stress = results["history/measured_stress"][-1, 0]
    for name, value in (("σx", stress[0]), ("σy", stress[1])):
        record.compare(
            f"{name} of the block that floats", value, "Pa", truth=-WATER * depth, truth_source="∮ t⊗x ds", allowed=1e-4
        )  # strains are 1e-5
    record.compare(
        "τxy of the block that floats, over the pressure",
        stress[2] / (WATER * depth),
        truth=0.0,
        truth_source="∮ t⊗x ds",
        scale=1,
        allowed=1e-4,  # as above
    )
    record.compare(
        "way of the block that floats, over the free fall in the same time",
        float(np.hypot(*moved)) / (0.5 * GRAVITY * results["history/time"][-1] ** 2),
        truth=0.0,
        truth_source="Archimedes",
        scale=1,
        allowed=1e-6,
    )
    model = block(PENTAGON, STONE * GRAVITY)
    model.add_measured(centroid)
    model.options |= {"line_load": loads}
    results = record.run(model, "sinking")
    record.compare(
        "way of the block that sinks, in 1 s",
        -results["history/measured_displacement"][-1, 0, 1],
        "m",
        truth=0.5 * (GRAVITY - WATER / STONE) * results["history/time"][-1] ** 2,
        truth_source="Archimedes",
        allowed=1e-4,  # the size of the strains
    )
    record.compare(
        "rotation of the block that sinks",
        results["history/measured_rotation"][-1, 0],
        "rad",
        truth=0.0,
        truth_source="the resultant goes through the centroid",
        scale=1,
        allowed=1e-5,
    )


def dam(record: Record) -> None:
    """A rectangular block on rock, water on one side."""
    width, height = DAM
    thrust, weight = WATER * height**2 / 2, STONE * GRAVITY * width * height
    moment = thrust * height / 3
    record.text(
        f"""
**A dam.** A block of {width:g} m × {height:g} m on rock, with water to its crest on the left. Thrust γ_w h²/2 and
weight are carried by the two contacts at the corners of its base: W/2 ± M/w, M = thrust·h/3, and both together hold the
thrust by friction (40°). With φ = 12° they do not: the dam slides with (thrust - W tan φ)/m.
"""
    )
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)])

    def standing(friction: float, k01: float, steps: int) -> Model:
        model = block([(-4, -2), (10, -2), (10, 0), (-4, 0)], STONE * GRAVITY, k01=k01)
        model.add_polygon(corners)
        model.add_fixed((-4, -2))
        model.add_fixed((10, -2))
        model.add_fixed((-4, -0.01))
        model.add_fixed((10, -0.01))
        model.add_measured((width / 2, height / 2))
        model.joint_materials[0].friction_angle = friction
        model.steps = steps
        model.options |= {"line_load": water_on(corners.astype(float), [3], height)}
        return model

    contacts = record.run(standing(40.0, 0.0, 200), "dam").frames[-1].contacts
    force = np.abs(contacts.force)
    toe = contacts.point[:, 0] > width / 2
    for name, value, truth in (
        ("force under the toe", force[toe, 1].sum(), weight / 2 + moment / width),
        ("force under the heel", force[~toe, 1].sum(), weight / 2 - moment / width),
        ("friction under the dam", force[:, 0].sum(), thrust),
    ):
        # levers and the slope of the base change by the size of the strains
        record.compare(name, value, "N", truth=truth, truth_source="statics", allowed=1e-4)
    friction = 12.0
    results = record.run(standing(friction, 1.0, 100), "sliding")
    time, way = results["history/time"][:], results["history/measured_displacement"][:, 0, 0]
    late = time > 0.5 * time[-1]
    acceleration = 2 * np.polyfit(time[late], way[late], 2)[0]
    record.compare(
        f"acceleration of the sliding dam, φ = {friction:g}°",
        acceleration,
        "m/s²",
        truth=(thrust - weight * np.tan(np.radians(friction))) / (STONE * width * height),
        truth_source="Newton's law",
        allowed=1e-3,  # the sudden load makes the springs vibrate, which has not quite ended
    )


def push(record: Record) -> None:
    """A line load that rises and falls."""
    record.text(
        f"""
**A push.** A block of 1 m × 1 m without weight is pushed on one edge by a load of {PUSH:g} N/m times a factor that
rises from 0 to 1 in 0.1 s, stays for 0.1 s and falls to 0 in 0.2 s. The impulse gives its speed: {PUSH:g}·0.25 s/m.
"""
    )
    model = block([(0, 0), (1, 0), (1, 1), (0, 1)], 0.0)
    model.steps, model.dt_max, model.displacement_ratio = 60, 0.01, 1.0
    model.add_measured((0.5, 0.5))
    load = {"ends": [0, 0, 0, 1], "force_start": [PUSH, 0], "table": [0, 0, 0.1, 1, 0.2, 1, 0.4, 0]}
    model.options |= {"line_load": [load]}
    results = record.run(model, "push")
    way, time = results["history/measured_displacement"][:, 0, 0], results["history/time"][:]
    record.compare(
        "speed after the push",
        (way[-1] - way[-10]) / (time[-1] - time[-10]),
        "m/s",
        truth=PUSH * 0.25 / STONE,
        truth_source="impulse over mass",
        allowed=1e-5,  # the edge grows by its strain (1e-5), and the load with it
    )


CASES = [Case("closed-line-loads", "Pressure on edges: water, a dam, a push", "Closed forms", line_loads)]
