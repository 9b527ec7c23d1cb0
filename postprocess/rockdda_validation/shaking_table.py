# SPDX-License-Identifier: MIT
"""The block on the shaking table of the thesis's chapter 4: rigid, integrated without contacts, and as a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from rockdda.model import Model

from .case import published

__all__ = [
    "ALONG", "ANALYSIS", "DURATION", "FREQUENCY", "LAW", "MEASURED", "TABLE", "Friction", "Setup",
    "acceleration", "back_analysis", "coulomb", "density", "rate_dependent", "resistance", "rigid_block", "table_model",
]  # fmt: skip

FloatArray = npt.NDArray[np.float64]
Friction = Callable[[FloatArray], FloatArray]  #: coefficient by sliding speed
TABLE = published("chapter4")["shaking_table"]
ANALYSIS = published("chapter4")["shaking_table_analysis"]
LAW = published("chapter4")["velocity_dependent_friction"]
GRAVITY = 9.81
ANGLE = np.radians(TABLE["inclination"])
ALONG = np.array([np.cos(ANGLE), -np.sin(ANGLE)])
FREQUENCY = np.array(TABLE["frequency"])
AMPLITUDE = np.array(TABLE["acceleration"]) * GRAVITY
MEASURED = np.array(TABLE["block_displacement"]) / 100.0
RAMP = np.cumsum([0.0, TABLE["ramp_up"], TABLE["plateau"], TABLE["ramp_down"]])
DURATION = float(RAMP[-1])
TIME_STEP = ANALYSIS["time_step"]
RESOLUTION = 5e-4  # s, step of the truth
SAMPLING = 5e-4  # s, rows of the motion given to the program

# -- the truth -------------------------------------------------------------------------------------------------------


def acceleration(time: FloatArray, test: int) -> FloatArray:
    """Horizontal, acting down the slope on the block [m/s²]; the table moves with the opposite one."""
    ramp = np.interp(time, RAMP, [0.0, 1.0, 1.0, 0.0])
    return np.asarray(AMPLITUDE[test] * ramp * np.sin(2.0 * np.pi * FREQUENCY[test] * time))


def coulomb(angle: float | FloatArray) -> Friction:
    """The same at every speed; angle in degrees, one of all tests or one of each."""
    return lambda speed: np.full_like(speed, np.tan(np.radians(angle)))


def rate_dependent(rest: float | FloatArray, fast: float | FloatArray, speed: float) -> Friction:
    """From the angle at rest to that of fast sliding [degrees], by exp(-v/speed)."""
    at_rest, far = np.tan(np.radians(rest)), np.tan(np.radians(fast))
    return lambda v: far + (at_rest - far) * np.exp(-v / speed)


def rigid_block(
    tests: npt.ArrayLike,
    friction: Friction,
    *,
    resistance: float | FloatArray = 0.0,
    absolute: bool = False,
    scale: float = 1.0,
    dt: float = RESOLUTION,
) -> tuple[FloatArray, FloatArray]:
    """Times and displacements (n, tests) along the slope [m].

    resistance: rate [1/s] that slows the velocity relative to the table, or with `absolute` that in space: then the
    plane must also push the block sideways against it. scale: of the accelerations.
    """
    numbers = np.atleast_1d(np.asarray(tests))
    n = round(DURATION / dt)
    middle = (np.arange(n) + 0.5) * dt
    pull = scale * np.column_stack([acceleration(middle, test) for test in numbers])
    table = -np.cumsum(pull, axis=0) * dt * absolute  # velocity of the table
    drive = pull * np.cos(ANGLE) + GRAVITY * np.sin(ANGLE) - resistance * table * np.cos(ANGLE)
    normal = GRAVITY * np.cos(ANGLE) - pull * np.sin(ANGLE) + resistance * table * np.sin(ANGLE)
    speed, place = np.zeros(len(numbers)), np.zeros((n + 1, len(numbers)))
    for i in range(n):
        limit = friction(np.abs(speed)) * normal[i]
        resting = speed == 0.0
        sense = np.where(resting, np.sign(drive[i]), np.sign(speed))
        after = speed + dt * (drive[i] - sense * limit - resistance * speed)
        stops = np.where(resting, np.abs(drive[i]) <= limit, after * speed < 0.0)
        after[stops] = 0.0
        place[i + 1] = place[i] + 0.5 * dt * (speed + after)
        speed = after
    return np.arange(n + 1) * dt, place


def back_analysis(
    tests: npt.ArrayLike, wanted: npt.ArrayLike, friction: Callable[[FloatArray], Friction], low: float, high: float,
    *, resistance: float | FloatArray = 0.0,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Values x for which rigid blocks with `friction(x)` slide as far as wanted, to 12/1024 of a degree.

    x is an angle (or a change of one) between `low` and `high` [degrees], more of which is more friction. Second: mean
    speed of each block while it slides [m/s].
    """
    numbers = np.atleast_1d(np.asarray(tests))
    least, most = np.full(len(numbers), low), np.full(len(numbers), high)
    while np.max(most - least) > 12.0 / 1024.0:
        middle = 0.5 * (least + most)
        times, place = rigid_block(numbers, friction(middle), resistance=resistance, dt=1e-3)
        far = place[-1] > wanted
        least, most = np.where(far, middle, least), np.where(far, most, middle)
    slides = np.diff(place, axis=0) > 0.0
    return 0.5 * (least + most), place[-1] / (slides.sum(axis=0) * (times[1] - times[0]))


# -- the model -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Setup:
    """Parameters of a run."""

    k01: float = 1.0
    dt: float = TIME_STEP
    moving: bool = False  #: the plane moves, as prescribed; else the motion is a body force
    law: tuple[float, float, float] | None = None  #: angle at rest, angle of fast sliding, speed
    damping: float = 0.0  #: of closed contacts, fraction of critical


def density() -> float:
    return float(TABLE["mass"] / (TABLE["base_area"] * TABLE["thickness"]))


def table_model(test: int, setup: Setup) -> Model:
    """The plane (a wedge on two fixed points) and the block, with the motion of a test."""
    model = Model(
        "table", e0=1e-5, k01=setup.k01, dt_max=setup.dt, stiffness=ANALYSIS["contact_stiffness"], steps=10**6,
        displacement_ratio=ANALYSIS["displacement_ratio"],
    )  # fmt: skip
    width = 0.6
    top = width * np.tan(ANGLE)
    model.add_polygon([(0, -0.1), (width, -0.1), (width, 0), (0, top)])
    normal = np.array([np.sin(ANGLE), np.cos(ANGLE)])
    corner = np.array([0.0, top]) + 0.1 * ALONG
    base, side = np.sqrt(TABLE["base_area"]) * ALONG, TABLE["thickness"] * normal
    model.add_polygon([corner, corner + base, corner + base + side, corner + side])
    prescribed = _table_motion(test, setup.dt) if setup.moving else ()
    model.add_fixed((0.02, -0.08), table=prescribed)
    model.add_fixed((width - 0.02, -0.08), table=prescribed)
    model.add_measured(corner + 0.5 * (base + side))
    model.add_measured((width / 2.0, -0.05))
    # two dimensions: mass per length across, divided by the area of the section
    model.add_block_material(density=density(), gravity=GRAVITY, youngs_modulus=200e9, poisson_ratio=0.3)
    model.add_joint_material(friction_angle=setup.law[0] if setup.law else ANALYSIS["friction_angle"])
    model.options = {"run": {"t_end": DURATION, "save_every": 10**6}}
    if not setup.moving:
        time = np.arange(round(DURATION / SAMPLING) + 1) * SAMPLING
        model.base_acceleration = np.column_stack([time, -acceleration(time, test), np.zeros_like(time)])
    if setup.law or setup.damping:
        joint: dict[str, object] = {"material": 1, "damping_ratio": setup.damping}
        if setup.law:
            joint |= {"law": "velocity", "parameters": list(setup.law[1:])}
        model.options["joint_law"] = joint
    return model


def _table_motion(test: int, dt: float) -> FloatArray:
    """Displacements of the table, a row for each step: the acceleration integrated twice from rest."""
    fine = 2.5e-5
    a = -acceleration(np.arange(round(DURATION / fine) + 1) * fine, test)
    v = np.concatenate([[0.0], np.cumsum(0.5 * fine * (a[1:] + a[:-1]))])
    x = np.concatenate([[0.0], np.cumsum(0.5 * fine * (v[1:] + v[:-1]))])[:: round(dt / fine)]
    return np.column_stack([np.arange(len(x)) * dt, x, np.zeros_like(x)])


def resistance(setup: Setup) -> float:
    """Rate [1/s] at which k01 slows a block."""
    return float(-np.log(setup.k01) / setup.dt)
