# SPDX-License-Identifier: MIT
"""§4.3 and §4.4 of the thesis: a block on an inclined plane on a shaking table, eight tests.

The truth for the program is the motion of a rigid block with Coulomb's friction on a rigid plane (Newmark's sliding
block), integrated with short steps and without contacts. What was measured is a second reference: the rigid block
and the program together agree with it or do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..shaking_table import (
    ALONG,
    ANALYSIS,
    DURATION,
    FREQUENCY,
    LAW,
    MEASURED,
    TABLE,
    TIME_STEP,
    FloatArray,
    Setup,
    back_analysis,
    coulomb,
    density,
    rate_dependent,
    resistance,
    rigid_block,
    table_model,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

K01 = (1.0, 0.99, 0.98, 0.95)
TRUTH = "rigid block"
SIX_HERTZ = 3
FRAME = 130  # % of error that the figure shows
LOW, HIGH = LAW["back_calculated"]  # degrees, friction of the tests by the thesis
SCATTER = 0.7  # degrees, of the tilt tests (§4.3.1)
LABEL_GAP, LABEL_COLUMN = 0.45, 0.55  # degrees, cm/s: numbers of the tests in the figure of friction


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
        f"listed, although that makes a density of {density():.0f} kg/m³, three times that of steel: one of the "
        "numbers must be wrong. How a block slides does not depend on its mass. The acceleration listed and the "
        "displacement of the table listed do not agree either (a/ω² is 0.39 cm and not 0.559 cm at 4 Hz, 0.070 cm "
        "and not 0.019 cm at 8.66 Hz); the acceleration is used."
    )
    numbers = range(len(FREQUENCY)) if record.full else (0, 3, 7)
    tests = np.array(list(numbers))
    final = _dry(record, tests)
    _time_step(record, tests)
    _base_motion(record, tests)
    _friction_and_damping(record, tests, final)
    record.energy_closes()


# -- a run ------------------------------------------------------------------------------------------------------------


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


# -- comparisons -----------------------------------------------------------------------------------------------------


def _percent(value: float, reference: float) -> float:
    return 100.0 * (value / reference - 1.0)


def _against_measured(computed: float, measured: float, angle: float, k01: float) -> str:
    """What is known of a difference to the experiment, and of the error against the rigid block."""
    words = []
    if abs(_percent(computed, measured)) > 5.0:
        within = LOW <= angle <= HIGH
        words.append(
            ("" if within else "not explained: ")
            + f"with this k01 a rigid block slides as measured with φ = {angle:.1f}° instead of 16°, "
            + (f"within the {LOW:g}° to {HIGH:g}°" if within else f"not one of the {LOW:g}° to {HIGH:g}°")
            + " of Fig. 4.5"
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
    angles = _angles(values, tests)
    for k01 in values:
        times, truths[k01] = rigid_block(tests, dry, resistance=resistance(Setup(k01)))
        for j, test in enumerate(tests):
            here = runs[test, k01] = _run(record, test, Setup(k01))
            measured = {"published": MEASURED[test], "published_source": "Table 4.2, measured"}
            record.compare(
                f"displacement, test {test + 1} ({FREQUENCY[test]} Hz), k01 = {k01:g}", here.path[-1], "m",
                truth=float(truths[k01][-1, j]), truth_source=TRUTH + ("" if k01 == 1 else ", viscous"), allowed=0.02,
                explanation=_against_measured(here.path[-1], MEASURED[test], angles[k01][j], k01),
                **measured,
            )  # fmt: skip
    here = runs[0, 1.0]
    record.compare(
        "displacement, test 1, k01 = 1, against the thesis's computation", here.path[-1], "m",
        truth=float(truths[1.0][-1, 0]), truth_source=TRUTH, allowed=0.02,
        published=ANALYSIS["test_1_displacement"], published_source="§4.4",
        explanation="not explained: with the listed motion and 16° a rigid block slides "
        f"{float(truths[1.0][-1, 0]):.2f} m, see the text on test 1",
    )  # fmt: skip
    _first_test(record, angles[1.0][0], here.path[-1], runs[0, 0.98].path[-1])
    rows = []
    for j, test in enumerate(tests):
        row = [test + 1, FREQUENCY[test], 100 * MEASURED[test], 100 * truths[1.0][-1, j]]
        for k01 in values:
            row += [100 * runs[test, k01].path[-1], _percent(runs[test, k01].path[-1], MEASURED[test])]
        rows.append(row)
        row.append(angles[1.0][j])
    columns = ["test", "f [Hz]", "measured [cm]", "rigid block [cm]"]
    columns += [name for k01 in values for name in (f"k01 = {k01:g} [cm]", f"error, k01 = {k01:g} [%]")]
    columns.append("φ that would slide as measured, k01 = 1 [°]")
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
        axes[1].set(xlabel="frequency [Hz]", ylabel="error against measured [%]", ylim=(-60, FRAME))
        axes[1].axhline(0, color=PALETTE[0], lw=0.6)
        axes[0].legend()
    record.figure(
        figure, "tests",
        "Left: test 1, lines the rigid block, dots RockDDA (Fig. 4.7). Right: errors against what was measured "
        f"(Fig. 4.9){_beyond(runs, values)}.",
    )  # fmt: skip
    _evolution(record, runs, times, truths, tests)
    damped = {test: _percent(runs[test, 0.98].path[-1], MEASURED[test]) for test in tests[1:]}
    worst = max(damped, key=lambda test: abs(damped[test]))
    worst_truth = max(
        abs(_percent(runs[test, k01].path[-1], truths[k01][-1, j])) for j, test in enumerate(tests) for k01 in values
    )
    low, high, damped_low, damped_high = (
        function(angles[k01][1:]) for k01 in (1.0, 0.98) for function in (np.min, np.max)
    )
    record.text(
        f"**Against the measurements.** The program does what a rigid block does, within {worst_truth:.1f} %; how near "
        "that is to the experiment is a matter of φ, of the motion and of k01. With k01 = 1 all tests slide further "
        "than measured; in the thesis all but that of 6 Hz, where RockDDA has "
        f"{_percent(runs[SIX_HERTZ, 1.0].path[-1], MEASURED[SIX_HERTZ]):+.1f} %. A small change of φ does much: "
        "a rigid block slides as far as measured with the angles of the last column above. Without test 1 they are "
        f"{low:.1f}° to {high:.1f}° with k01 = 1, all within the {LOW:g}° to {HIGH:g}° that the thesis quotes as "
        "back-calculated from the tests (Fig. 4.5), and highest in the test that slides fastest: one angle for all "
        "tests is enough to make these differences. Test 1 would need "
        f"{angles[1.0][0]:.1f}° and stays unexplained. With k01 = 0.98 the angles are {damped_low:.1f}° to "
        f"{damped_high:.1f}°, on both sides of the 16° that is used; this is why 0.98 seems right, and it shows that "
        "the final displacements alone cannot distinguish a higher friction from such a resistance. The "
        f"thesis has all errors below 10 % with it; without test 1 the largest of "
        f"RockDDA is {damped[worst]:+.0f} % ({FREQUENCY[worst]} Hz). "
        "k01 is no property of the block: its rate is -ln(k01)/Δt, so that half the time step brakes twice as much "
        "(see the table of comparisons)."
    )
    return {int(test): float(runs[test, 1.0].path[-1]) for test in tests}


def _angles(values: tuple[float, ...], tests: npt.NDArray[np.int64]) -> dict[float, FloatArray]:
    """Friction angles with which rigid blocks slide as far as measured, for each k01 [degrees]."""
    rates = np.repeat([resistance(Setup(k01)) for k01 in values], len(tests))
    every = np.tile(tests, len(values))
    found, _ = back_analysis(every, MEASURED[every], coulomb, 12.0, 24.0, resistance=rates)
    return dict(zip(values, found.reshape(len(values), -1), strict=True))


def _beyond(runs: dict[tuple[int, float], Slide], values: tuple[float, ...]) -> str:
    """What of test 1 the frame of the figure does not show."""
    errors = {k01: _percent(runs[0, k01].path[-1], MEASURED[0]) for k01 in values}
    out = [f"k01 = {k01:g} ({error:.0f} %)" for k01, error in errors.items() if error > FRAME]
    return f"; test 1 with {' and '.join(out)} is beyond the frame" if out else ""


def _first_test(record: Record, measured_angle: float, computed: float, damped: float) -> None:
    """What would be needed for the thesis's 0.093 m."""
    wanted = ANALYSIS["test_1_displacement"]
    dry = coulomb(ANALYSIS["friction_angle"])
    low, high = 0.5, 1.0
    for _ in range(12):
        scale = 0.5 * (low + high)
        short = float(rigid_block([0], dry, scale=scale, dt=1e-3)[1][-1, 0]) < wanted
        low, high = (scale, high) if short else (low, scale)
    (angle,), _ = back_analysis([0], wanted, coulomb, 12.0, 24.0)
    record.text(
        f"**Test 1.** The thesis computes {wanted} m with k01 = 1; {ANALYSIS['test_1_measured']} m were measured. A "
        f"rigid block slides {wanted} m with {scale:.2f} of the listed acceleration "
        f"({scale * TABLE['acceleration'][0]:.2f} g), or with φ = {angle:.1f}°, and as far as measured with "
        f"{measured_angle:.1f}°; with the listed acceleration and 16° it slides {computed:.2f} m. The record of the "
        "table that the thesis used is not published; what differs in it is not known. With k01 = 0.98 the thesis has "
        f"an error below 4 %; that of RockDDA is {damped / MEASURED[0]:.1f} times the measured value."
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


def _base_motion(record: Record, tests: npt.NDArray[np.int64]) -> None:
    """The tests by body force and by moving the plane, as the table did."""
    dry = coulomb(ANALYSIS["friction_angle"])
    times, truth = rigid_block(tests, dry)
    _, slowed = rigid_block([SIX_HERTZ], dry, resistance=resistance(Setup(0.98)), absolute=True)
    rows = []
    apart: dict[float, float] = {}
    lifted, rotation, steps = 0, 0.0, 0
    bounds = {TIME_STEP: 0.02} | ({TIME_STEP / 2.0: 0.005} if record.full else {})
    for dt in bounds:
        for j, test in enumerate(tests):
            force, motion = (
                _run(record, test, Setup(1.0, dt, moving), f"frame-{test + 1}-{moving}-{dt:g}")
                for moving in (False, True)
            )
            lifted, rotation = lifted + motion.lifted, max(rotation, motion.rotation)
            steps += len(motion.time)
            moved = np.interp(force.time, motion.time, motion.path)
            errors = [
                np.abs(path - np.interp(force.time, times, truth[:, j])).max() / truth[-1, j]
                for path in (force.path, moved)
            ]
            between = float(np.abs(moved - force.path).max() / truth[-1, j])
            apart[dt] = max(apart.get(dt, 0.0), between)
            rows.append(
                [test + 1, dt, 100 * truth[-1, j], 100 * force.path[-1], 100 * motion.path[-1],
                 *(100 * error for error in errors), 100 * between]
            )  # fmt: skip
            if dt == TIME_STEP:
                record.compare(
                    f"displacement, test {test + 1}, k01 = 1, plane moved as prescribed", motion.path[-1], "m",
                    truth=float(truth[-1, j]), truth_source=TRUTH, allowed=0.02,
                    explanation=f"by body force {force.path[-1]:.5f} m",
                )  # fmt: skip
    for dt, bound in bounds.items():
        record.compare(
            f"moved plane against body force, Δt = {dt:g} s: largest difference of the paths, over the final one",
            apart[dt], truth=0.0, truth_source="both are the same relative motion", scale=1.0, allowed=bound,
            explanation="the base acceleration is taken at the middle of a step, the prescribed place at its end; "
            "promised is what either may be off the rigid block",
        )  # fmt: skip
    columns = ["test", "Δt [s]", "rigid block [cm]", "body force [cm]", "plane moved [cm]"]
    columns += [f"largest difference {name} [% of the final path]" for name in (
        "of force and rigid block", "of motion and rigid block", "of motion and force")]  # fmt: skip
    caption = "The same tests by body force and by moving the plane, k01 = 1; differences are those at any time."
    record.table(pd.DataFrame(rows, columns=columns), "frames", caption)
    force, motion = (
        _run(record, SIX_HERTZ, Setup(0.98, moving=moving), f"frame-damped-{moving}") for moving in (False, True)
    )
    record.compare(
        f"displacement, test {SIX_HERTZ + 1}, k01 = 0.98, plane moved as prescribed", motion.path[-1], "m",
        truth=float(slowed[-1, 0]), truth_source=TRUTH + ", slowed in space", allowed=0.02,
        explanation=f"by body force {force.path[-1]:.5f} m: k01 slows the motion relative to the plane there, here "
        "that in space",
    )  # fmt: skip
    half = f", and within {100 * apart[TIME_STEP / 2.0]:.2f} % with half the time step" if record.full else ""
    record.text(
        "**Force or motion.** Moving the plane as the table did gives what a body force on the block gives: in all "
        f"{len(tests)} tests the two paths are within {100 * apart[TIME_STEP]:.1f} % of the final one of each other "
        f"at any time{half}. The thesis supposes "
        "that the real block wobbled, its contacts opening and closing, and that a body force cannot show that. A "
        f"rigid block with these data does not wobble: with the plane moved, {lifted} of {steps} steps have an open "
        f"contact, and the block turns by at most {rotation:.0e} rad. With k01 < 1 the two ways differ: k01 slows "
        "whatever moves in the frame of the computation (test "
        f"{SIX_HERTZ + 1}, k01 = 0.98: {100 * motion.path[-1]:.2f} cm with the plane moved, "
        f"{100 * force.path[-1]:.2f} cm by body force), one more reason not to take it for damping."
    )


def _against_law(computed: float, measured: float, shift: float) -> str:
    """What is known of a difference to the experiment with friction by velocity."""
    if abs(_percent(computed, measured)) <= 5.0:
        return ""
    within = round(abs(shift), 1) <= SCATTER
    return (
        ("" if within else "not explained: ")
        + f"a rigid block slides as measured if all angles of the law are changed by {shift:+.1f}°, "
        + ("within" if within else "more than")
        + f" the ±{SCATTER:g}° by which tilt tests scatter"
    )


def _friction_figure(
    tests: npt.NDArray[np.int64],
    law: tuple[float, float, float],
    angles: npt.NDArray[np.float64],
    speeds: npt.NDArray[np.float64],
    errors: dict[str, list[float]],
) -> Figure:
    """Friction by sliding velocity, and the errors with and without it."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.8), layout="constrained", width_ratios=(1, 1.5))
    v = np.linspace(0, 0.1, 200)
    axes[0].plot(100 * v, np.degrees(np.arctan(rate_dependent(*law)(v))), color=PALETTE[2])
    axes[0].axhline(ANALYSIS["friction_angle"], color=PALETTE[1])
    axes[0].plot(100 * LAW["speed"], LAW["friction_angle"], "o", color=PALETTE[0], ms=4, label="§4.3.1")
    axes[0].plot(100 * speeds, angles, "^", color=PALETTE[3], ms=4, label="as measured")
    # most tests lie close together: their numbers stand in a column beside them, from the lowest angle upwards
    top = -np.inf
    for j in np.argsort(angles):
        top = max(angles[j], top + LABEL_GAP)
        lone = speeds[j] > 1.4 * np.median(speeds)
        place = (100 * speeds[j] - 0.5, angles[j]) if lone else (LABEL_COLUMN, top)
        leader = {"arrowstyle": "-", "lw": 0.4, "color": PALETTE[0], "shrinkA": 1, "shrinkB": 2}
        axes[0].annotate(
            str(tests[j] + 1), (100 * speeds[j], angles[j]), place, arrowprops=None if lone else leader, fontsize=7,
            ha="center", va="center", bbox={"fc": "white", "ec": "none", "pad": 0.6},
        )  # fmt: skip
    axes[0].legend(loc="lower right", fontsize=7)
    axes[0].set(xlabel="sliding velocity [cm/s]", ylabel="friction angle [°]", xlim=(-0.3, 10), ylim=(13, 22))
    middle = np.arange(len(tests))
    for k, (name, values) in enumerate(errors.items()):
        axes[1].bar(middle + (k - 0.5) * 0.36, values, 0.34, color=PALETTE[k + 1], label=name)
    axes[1].axhline(0, color=PALETTE[0], lw=0.6)
    axes[1].set_xticks(middle, [f"{f:g}" for f in FREQUENCY[tests]])
    axes[1].set(xlabel="frequency [Hz]", ylabel="error against measured [%]")
    axes[1].legend()
    return figure


def _friction_and_damping(record: Record, tests: npt.NDArray[np.int64], final: dict[int, float]) -> None:
    """What the thesis wished for: friction that depends on velocity, and dashpots."""
    low, high = LAW["back_calculated"]
    at_rest, far, known = (np.tan(np.radians(x)) for x in (low, high, LAW["friction_angle"]))
    speed = float(LAW["speed"] / np.log((far - at_rest) / (far - known)))
    law = (low, high, speed)
    _, truth = rigid_block(tests, rate_dependent(*law))
    shifts, _ = back_analysis(tests, MEASURED[tests], lambda x: rate_dependent(low + x, high + x, speed), -4.0, 6.0)
    angles, speeds = back_analysis(tests, MEASURED[tests], coulomb, 12.0, 24.0)
    ratios = (0.05, 0.2, 1.0) if record.full else (0.2,)
    rows, errors = [], {"φ = 16°": [], f"φ(v), {low:g}° to {high:g}°": []}
    damped: list[float] = []
    for j, test in enumerate(tests):
        here = _run(record, test, Setup(law=law), f"law-{test + 1}").path[-1]
        record.compare(
            f"displacement, test {test + 1}, friction by velocity", here, "m",
            truth=float(truth[-1, j]), truth_source=TRUTH + " with the same law", allowed=0.02,
            published=MEASURED[test], published_source="Table 4.2, measured",
            explanation=_against_law(here, MEASURED[test], shifts[j]),
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
        figure = _friction_figure(tests, law, angles, speeds, errors)
    record.figure(
        figure, "friction",
        "Left: friction by sliding velocity; triangles: constant angles with which rigid blocks slide as far as "
        "measured, at their mean speed while they slide (as Fig. 4.5; numbers: tests). Right: errors with the law and "
        "with φ = 16°; k01 = 1.",
    )  # fmt: skip
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
