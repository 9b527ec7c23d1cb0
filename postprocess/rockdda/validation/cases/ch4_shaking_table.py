# SPDX-License-Identifier: MIT
"""§4.3 and §4.4 of the thesis: a block on an inclined plane on a shaking table, eight tests.

The truth for the program is the motion of a rigid block with Coulomb's friction on a rigid plane (Newmark's sliding
block), integrated here with short steps and without contacts. What was measured is a second reference: the rigid block
and the program together agree with it or do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from ... import Model
from ...plot_style import PALETTE, PAPER_WIDTH
from ..case import Case, Record, published

FloatArray = npt.NDArray[np.float64]
Friction = Callable[[FloatArray], FloatArray]  # coefficient by sliding speed
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
K01 = (1.0, 0.99, 0.98, 0.95)
RESOLUTION = 5e-4  # s, step of the truth
SAMPLING = 5e-4  # s, rows of the motion given to the program
TRUTH = "rigid block"
SIX_HERTZ = 3


def shaking_table(record: Record) -> None:
    """Eight tests: against the rigid block, against the measurements, by force and by motion, friction and damping."""
    side = np.sqrt(TABLE["base_area"])
    record.text(
        f"A block slides on a plane inclined {TABLE['inclination']}° that shakes horizontally: eight tests (Table "
        "4.2), the acceleration a ramped sine (1.5 s up, 2 s full, 1.5 s down) with the largest value of the table, "
        "φ = 16°, g0 = 5e9 N/m, Δt = 0.0025 s, g2 = 0.005. The truth is a rigid block with Coulomb's friction, "
        "integrated in Python with 0.0005 s (a relative 5e-5 from the limit). With k01 < 1 the program takes 1 - k01 "
        "of the velocity at every step; for a rigid block that is a viscous resistance of rate -ln(k01)/Δt, and this "
        "is what the truth has.\n\n"
        f"The block is {side:.4f} m square and {TABLE['thickness']} m thick with a mass of {TABLE['mass']} kg, as "
        f"listed, although that makes a density of {_density():.0f} kg/m³, three times that of steel: one of the "
        "numbers must be wrong. How a block slides does not depend on its mass. The acceleration listed and the "
        "displacement of the table listed do not agree either (a/ω² is 0.39 cm and not 0.559 cm at 4 Hz, 0.070 cm "
        "and not 0.019 cm at 8.66 Hz); the acceleration is used."
    )
    numbers = range(len(FREQUENCY)) if record.full else (0, 3, 7)
    tests = np.array(list(numbers))
    final = _dry(record, tests)
    _time_step(record, tests)
    _base_motion(record)
    _friction_and_damping(record, tests, final)


# -- the truth -------------------------------------------------------------------------------------------------------


def acceleration(time: FloatArray, test: int) -> FloatArray:
    """Horizontal, acting down the slope on the block [m/s²]; the table moves with the opposite one."""
    ramp = np.interp(time, RAMP, [0.0, 1.0, 1.0, 0.0])
    return np.asarray(AMPLITUDE[test] * ramp * np.sin(2.0 * np.pi * FREQUENCY[test] * time))


def coulomb(angle: float) -> Friction:
    """The same at every speed; angle in degrees."""
    return lambda speed: np.full_like(speed, np.tan(np.radians(angle)))


def rate_dependent(rest: float, fast: float, speed: float) -> Friction:
    """From the angle at rest to that of fast sliding [degrees], by exp(-v/speed)."""
    at_rest, far = np.tan(np.radians(rest)), np.tan(np.radians(fast))
    return lambda v: far + (at_rest - far) * np.exp(-v / speed)


def rigid_block(
    tests: npt.ArrayLike,
    friction: Friction,
    *,
    resistance: float = 0.0,
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


# -- the model -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Setup:
    """What distinguishes a run."""

    k01: float = 1.0
    dt: float = TIME_STEP
    moving: bool = False  #: the plane moves, as prescribed; else the motion is a body force
    law: tuple[float, float, float] | None = None  #: angle at rest, angle of fast sliding, speed
    damping: float = 0.0  #: of closed contacts, fraction of critical


def _density() -> float:
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
    model.add_block_material(density=_density(), gravity=GRAVITY, youngs_modulus=200e9, poisson_ratio=0.3)
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


@dataclass(frozen=True)
class Slide:
    """What came out: times, displacements of the block on the plane [m], and how much the block rocked and lifted."""

    time: FloatArray
    path: FloatArray
    rotation: float  #: largest [rad]
    lifted: int  #: steps with an open contact


def _run(record: Record, test: int, setup: Setup, name: str = "") -> Slide:
    name = name or f"test{test + 1}-k{setup.k01:g}-dt{setup.dt:g}"
    with record.run(table_model(test, setup), name) as results:
        moved = results["history/measured_displacement"]
        turned = results["history/measured_rotation"]
        closed = results["history/contacts"][:, 1:].sum(axis=1)
        path = (moved[:, 0] - moved[:, 1]) @ ALONG
        rotation = float(np.abs(turned[:, 0] - turned[:, 1]).max())
        return Slide(results["history/time"], path, rotation, int((closed < 2).sum()))


def resistance(setup: Setup) -> float:
    """Rate [1/s] at which k01 slows a block."""
    return float(-np.log(setup.k01) / setup.dt)


# -- comparisons -----------------------------------------------------------------------------------------------------


def _percent(value: float, reference: float) -> float:
    return 100.0 * (value / reference - 1.0)


def _against_measured(ours: float, measured: float, k01: float | None = None) -> str:
    """What is known of a difference to the experiment, and of the error against the rigid block."""
    words = []
    if abs(_percent(ours, measured)) > 5.0:
        words.append(
            "not explained: a rigid block slides as far with the listed data, which do not agree with each other"
        )
    if k01 == 1:
        words.append("against the truth: the block stops and starts at whole steps")
    return "; ".join(words)


def _dry(record: Record, tests: npt.NDArray[np.int64]) -> dict[int, float]:
    """The eight tests with the thesis's four values of k01; returns the final displacements with k01 = 1."""
    from matplotlib import pyplot as plt

    values = K01 if record.full else (1.0, 0.98)
    runs: dict[tuple[int, float], Slide] = {}
    truths: dict[float, FloatArray] = {}
    dry = coulomb(ANALYSIS["friction_angle"])
    for k01 in values:
        times, truths[k01] = rigid_block(tests, dry, resistance=resistance(Setup(k01)))
        for j, test in enumerate(tests):
            here = runs[test, k01] = _run(record, test, Setup(k01))
            measured = {"published": MEASURED[test], "published_source": "Table 4.2, measured"}
            record.compare(
                f"displacement, test {test + 1} ({FREQUENCY[test]} Hz), k01 = {k01:g}", here.path[-1], "m",
                truth=float(truths[k01][-1, j]), truth_source=TRUTH + ("" if k01 == 1 else ", viscous"), allowed=0.02,
                explanation=_against_measured(here.path[-1], MEASURED[test], k01), **measured,
            )  # fmt: skip
    here = runs[0, 1.0]
    record.compare(
        "displacement, test 1, k01 = 1, against the thesis's computation", here.path[-1], "m",
        truth=float(truths[1.0][-1, 0]), truth_source=TRUTH, allowed=0.02,
        published=ANALYSIS["test_1_displacement"], published_source="§4.4",
        explanation="not explained: with the listed motion a rigid block slides 0.21 m, see below",
    )  # fmt: skip
    _first_test(record)
    rows = []
    for j, test in enumerate(tests):
        row = [test + 1, FREQUENCY[test], 100 * MEASURED[test], 100 * truths[1.0][-1, j]]
        for k01 in values:
            row += [100 * runs[test, k01].path[-1], _percent(runs[test, k01].path[-1], MEASURED[test])]
        rows.append(row)
    columns = ["test", "f [Hz]", "measured [cm]", "rigid block [cm]"]
    columns += [name for k01 in values for name in (f"k01 = {k01:g} [cm]", f"error, k01 = {k01:g} [%]")]
    record.table(pd.DataFrame(rows, columns=columns), "errors", "Displacements and errors against what was measured.")
    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 3.2), layout="constrained")
        for color, k01 in enumerate(values):
            axes[0].plot(times[::50], 100 * truths[k01][::50, 0], color=PALETTE[color + 1])
            some = slice(99, None, 200)
            axes[0].plot(runs[0, k01].time[some], 100 * runs[0, k01].path[some], "o", ms=3, color=PALETTE[color + 1],
                         label=f"k01 = {k01:g}")  # fmt: skip
            errors = [_percent(runs[test, k01].path[-1], MEASURED[test]) for test in tests]
            axes[1].plot(FREQUENCY[tests], errors, "o-", ms=4, color=PALETTE[color + 1], label=f"k01 = {k01:g}")
        axes[0].plot(DURATION, 100 * MEASURED[0], "*", color=PALETTE[0], ms=8, clip_on=False, label="measured")
        axes[0].plot(DURATION, 100 * ANALYSIS["test_1_displacement"], "^", color=PALETTE[0], ms=5, clip_on=False,
                     label="thesis, k01 = 1")  # fmt: skip
        axes[0].set(xlabel="time [s]", ylabel="displacement [cm], test 1", xlim=(0, DURATION))
        axes[1].set(xlabel="frequency [Hz]", ylabel="error against measured [%]", ylim=(-60, 130))
        axes[1].axhline(0, color=PALETTE[0], lw=0.6)
        axes[0].legend()
    record.figure(
        figure, "tests",
        "Left: test 1, lines the rigid block, dots RockDDA (Fig. 4.7). Right: errors against what was measured "
        "(Fig. 4.9); test 1 with k01 = 1 (298 %) and 0.99 (180 %) is beyond the frame.",
    )  # fmt: skip
    _evolution(record, runs, times, truths, tests)
    damped = {test: _percent(runs[test, 0.98].path[-1], MEASURED[test]) for test in tests[1:]}
    worst = max(damped, key=lambda test: abs(damped[test]))
    record.text(
        "**Against the measurements.** The program does what a rigid block does, within 1.5 %; how near that is to "
        "the experiment is a matter of φ, of the motion and of k01. With k01 = 1 all tests slide further than "
        "measured; in the thesis all but that of 6 Hz, where we have "
        f"{_percent(runs[SIX_HERTZ, 1.0].path[-1], MEASURED[SIX_HERTZ]):+.1f} %. With k01 = 0.98 the thesis has all "
        f"errors below 10 %; without test 1 our largest is {damped[worst]:+.0f} % ({FREQUENCY[worst]} Hz). k01 is no "
        "property of the block: its rate is -ln(k01)/Δt, so that half the time step brakes twice as much (below)."
    )
    return {int(test): float(runs[test, 1.0].path[-1]) for test in tests}


def _first_test(record: Record) -> None:
    """What would be needed for the thesis's 0.093 m."""
    wanted = ANALYSIS["test_1_displacement"]

    def solve(function: Callable[[float], float], low: float, high: float) -> float:
        for _ in range(12):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if function(middle) > 0 else (low, middle)
        return 0.5 * (low + high)

    dry = coulomb(ANALYSIS["friction_angle"])
    scale = solve(lambda x: wanted - float(rigid_block([0], dry, scale=x, dt=1e-3)[1][-1, 0]), 0.5, 1.0)
    angle = solve(lambda x: float(rigid_block([0], coulomb(x), dt=1e-3)[1][-1, 0]) - wanted, 16.0, 22.0)
    record.text(
        f"**Test 1.** The thesis computes {wanted} m with k01 = 1; {ANALYSIS['test_1_measured']} m were measured. A "
        f"rigid block slides 0.093 m with {scale:.2f} of the listed acceleration "
        f"({scale * TABLE['acceleration'][0]:.2f} g), or with φ = {angle:.1f}°. The record of the table that the "
        "thesis used is not published; what differs in it is not known. With k01 = 0.98 the thesis has an error below "
        "4 %; ours is twice the measured value."
    )


def _evolution(
    record: Record, runs: dict[tuple[int, float], Slide], times: FloatArray, truths: dict[float, FloatArray],
    tests: npt.NDArray[np.int64],
) -> None:  # fmt: skip
    """Fig. 4.10, against the rigid block: what was measured in time is not published."""
    from matplotlib import pyplot as plt

    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.6), layout="constrained", sharey=True)
        for axis, j in zip(axes, (0, len(tests) - 1), strict=True):
            for color, k01 in enumerate(truths):
                here = runs[tests[j], k01]
                truth = np.interp(here.time, times, truths[k01][:, j])
                begun = truth > 0.01 * truth[-1]
                error = 100.0 * np.abs(here.path[begun] / truth[begun] - 1.0)
                axis.semilogy(here.time[begun], error, color=PALETTE[color + 1], label=f"k01 = {k01:g}")
            axis.set(xlabel="time [s]", xlim=(0, DURATION), ylim=(1e-4, 30), title=f"test {tests[j] + 1}")
        axes[0].set_ylabel("error against rigid block [%]")
        axes[1].legend(ncols=2)
    record.figure(
        figure, "evolution", "Error in the course of time, from 1 % of the final displacement on (Fig. 4.10)."
    )


def _time_step(record: Record, tests: npt.NDArray[np.int64]) -> None:
    """Half the time step: of k01 = 1 and of k01 = 0.98."""
    dry = coulomb(ANALYSIS["friction_angle"])
    last = int(tests[-1])
    for k01 in (1.0, 0.98):
        setup = Setup(k01, TIME_STEP / 2.0)
        _, truth = rigid_block([last], dry, resistance=resistance(setup))
        here = _run(record, last, setup)
        record.compare(
            f"displacement, test {last + 1}, k01 = {k01:g}, half the time step", here.path[-1], "m",
            truth=float(truth[-1, 0]), truth_source=TRUTH + ("" if k01 == 1 else ", viscous"), allowed=0.005,
            explanation="the block stops and starts at whole steps: little is left of the error with 0.0025 s"
            if k01 == 1 else "twice the resistance of the same k01 with 0.0025 s",
        )  # fmt: skip


def _base_motion(record: Record) -> None:
    """The same test by body force and by moving the plane."""
    dry = coulomb(ANALYSIS["friction_angle"])
    test = SIX_HERTZ
    for k01 in (1.0, 0.98):
        force, motion = (
            _run(record, test, Setup(k01, moving=moving), f"frame-{moving}-{k01:g}") for moving in (False, True)
        )
        _, truth = rigid_block([test], dry, resistance=resistance(Setup(k01)), absolute=True)
        record.compare(
            f"displacement, test {test + 1}, k01 = {k01:g}, plane moved as prescribed", motion.path[-1], "m",
            truth=float(truth[-1, 0]), truth_source=TRUTH + ("" if k01 == 1 else ", slowed in space"), allowed=0.02,
            published=MEASURED[test], published_source="Table 4.2, measured",
            explanation=f"by body force {force.path[-1]:.5f} m" + (
                "" if k01 == 1 else ": k01 slows the motion relative to the plane there, here that in space"),
        )  # fmt: skip
        if k01 == 1:
            record.compare(
                f"moved plane against body force, test {test + 1}, displacement", motion.path[-1], "m",
                truth=force.path[-1], truth_source="body force", allowed=0.005,
                explanation="the base acceleration is taken at the middle of a step, the prescribed place at its end",
            )  # fmt: skip
    _, relative = rigid_block([test], dry, resistance=resistance(Setup(0.98)))
    record.text(
        "**Force or motion.** Moving the plane as the table did gives what a body force on the block gives. The "
        "thesis supposes that the real block wobbled, its contacts opening and closing, and that a body force cannot "
        f"show that. A rigid block with these data does not: with the plane moved, {motion.lifted} of 2000 steps have "
        f"an open contact, and the block turns by at most {motion.rotation:.0e} rad. With k01 < 1 the two ways differ: "
        "k01 slows whatever moves in the frame of the computation "
        f"({100 * float(truth[-1, 0]):.2f} cm with the plane moved, {100 * float(relative[-1, 0]):.2f} cm by body "
        "force), one more reason not to take it for damping."
    )


def _friction_and_damping(record: Record, tests: npt.NDArray[np.int64], final: dict[int, float]) -> None:
    """What the thesis wished for: friction that depends on velocity, and dashpots."""
    from matplotlib import pyplot as plt

    low, high = LAW["back_calculated"]
    at_rest, far, known = (np.tan(np.radians(x)) for x in (low, high, LAW["friction_angle"]))
    speed = float(LAW["speed"] / np.log((far - at_rest) / (far - known)))
    law = (low, high, speed)
    _, truth = rigid_block(tests, rate_dependent(*law))
    ratios = (0.05, 0.2, 1.0) if record.full else (0.2,)
    rows, errors = [], {"φ = 16°": [], f"φ(v), {low:g}° to {high:g}°": []}
    damped: list[float] = []
    for j, test in enumerate(tests):
        here = _run(record, test, Setup(law=law), f"law-{test + 1}").path[-1]
        record.compare(
            f"displacement, test {test + 1}, friction by velocity", here, "m",
            truth=float(truth[-1, j]), truth_source=TRUTH + " with the same law", allowed=0.02,
            published=MEASURED[test], published_source="Table 4.2, measured",
            explanation=_against_measured(here, MEASURED[test]),
        )  # fmt: skip
        row = [test + 1, _percent(final[int(test)], MEASURED[test]), _percent(here, MEASURED[test])]
        for ratio in ratios:
            for moving in (False, True):
                name = f"voigt-{test + 1}-{ratio:g}-{'moved' if moving else 'force'}"
                with_damping = _run(record, test, Setup(damping=ratio, moving=moving), name).path[-1]
                damped.append(abs(_percent(with_damping, final[int(test)])))
            row.append(_percent(with_damping, MEASURED[test]))
        rows.append(row)
        for name, value in zip(errors, row[1:3], strict=True):
            errors[name].append(value)
    columns = ["test", "φ = 16° [%]", "φ(v) [%]", *(f"dashpots ζ = {ratio:g}, plane moved [%]" for ratio in ratios)]
    record.table(pd.DataFrame(rows, columns=columns), "friction", "Errors against what was measured, k01 = 1.")
    record.compare(
        "largest change of a displacement by dashpots at the contacts", max(damped) / 100.0, "",
        truth=0.0, truth_source="a rigid block that does not lift feels no dashpot", scale=1.0, allowed=0.02,
        explanation="of the accuracy that Δt = 0.0025 s has",
    )  # fmt: skip
    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.8), layout="constrained", width_ratios=(1, 1.5))
        v = np.linspace(0, 0.15, 200)
        axes[0].plot(100 * v, np.degrees(np.arctan(rate_dependent(*law)(v))), color=PALETTE[2])
        axes[0].axhline(ANALYSIS["friction_angle"], color=PALETTE[1])
        axes[0].plot(100 * LAW["speed"], LAW["friction_angle"], "o", color=PALETTE[0], ms=4)
        axes[0].set(xlabel="sliding velocity [cm/s]", ylabel="friction angle [°]", ylim=(13, 20))
        place = np.arange(len(tests))
        for k, (name, values) in enumerate(errors.items()):
            axes[1].bar(place + (k - 0.5) * 0.36, values, 0.34, color=PALETTE[k + 1], label=name)
        axes[1].axhline(0, color=PALETTE[0], lw=0.6)
        axes[1].set_xticks(place, [f"{f:g}" for f in FREQUENCY[tests]])
        axes[1].set(xlabel="frequency [Hz]", ylabel="error against measured [%]")
        axes[1].legend()
    record.figure(figure, "friction", "Friction by sliding velocity, and the errors with it and with φ = 16°; k01 = 1.")
    constant, varied = (np.abs(values) for values in errors.values())
    record.text(
        f"**Friction by velocity.** The law μ(v) of the program (theory manual §6) from {low:g}° at rest to {high:g}°, "
        "the range that Fig. 4.5 is said to have, with 17° at 3 cm/s (§4.3.1) and so "
        f"v_c = {100 * speed:.2f} cm/s; nothing is fitted to the displacements. The mean of the absolute errors goes "
        f"from {constant.mean():.0f} % to {varied.mean():.0f} %; without test 1 from {constant[1:].mean():.0f} % to "
        f"{varied[1:].mean():.0f} %: it slows the fast tests (1 and 2) and lets the slow ones slide a little "
        "further. **Dashpots** at the contacts (Voigt) do nothing for a block that slides without lifting: a sliding "
        "contact has only a normal one, and the normal motion is tiny; the displacements change by "
        f"{max(damped):.2f} % at most. What the thesis hopes of them would need a block that rocks or bounces."
    )


CASES = [Case("4.3-shaking-table", "Block on a shaking table", "Chapter 4", shaking_table)]
