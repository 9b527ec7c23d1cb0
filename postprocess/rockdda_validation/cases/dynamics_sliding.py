# SPDX-License-Identifier: MIT
"""A block that slides under an earthquake, Newmark's; and the shaking table of chapter 4 in both schemes."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas
from rockdda import records
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..columns import BY_LENGTH, SCHEMES, synthetic_record
from ..shaking_table import ALONG as TABLE_ALONG
from ..shaking_table import ANALYSIS, FREQUENCY, MEASURED, Setup, coulomb, rigid_block, table_model
from .closed_newmark import FRICTION, GRAVITY, SLOPE, START, STIFF, incline

FloatArray = npt.NDArray[np.float64]
PEAK, SINE_STEP = 4.0, 0.005  # m/s², s


def sliding(record: Record) -> None:
    """Slip of the block of closed-newmark under the synthetic record."""
    quake = synthetic_record(peak=PEAK)
    # the base moves against the record, so that a positive value drives the block downhill
    expected = float(
        records.newmark_displacement(quake, friction=math.degrees(FRICTION), slope=math.degrees(SLOPE), gravity=GRAVITY)
    )
    motion = np.column_stack([START + quake.time, -quake.acceleration, 0 * quake.time])
    motion = np.vstack([[0.0, 0.0, 0.0], motion, [START + quake.time[-1] + 9, 0.0, 0.0]])
    record.text(
        f"The block of closed-newmark (incline {math.degrees(SLOPE):g}°, friction {math.degrees(FRICTION):g}°, springs "
        f"and rock of {STIFF:g}) under the synthetic record of 10 s, scaled to {PEAK:g} m/s². The truth is "
        "`rockdda.records.newmark_displacement`, exact for straight lines between the samples of the record. "
        f"{BY_LENGTH}"
    )
    rows, curves = [], {}
    for scheme, label in SCHEMES.items():
        for dt in (0.01, 0.005, 0.0025) if record.full else (0.005,):
            model, along = incline(motion, dt, START + quake.time[-1] + 0.5, STIFF)
            model.options["contact"]["formulation"] = "length"
            model.options["time"] = {"integrator": scheme}
            with record.run(model, f"{scheme}-{1e4 * dt:g}") as results:
                time = results["history/time"][:]
                moved = results["history/measured_displacement"][:, 0] @ along
            start = int(np.searchsorted(time, START - 1e-9))
            slip = moved[start:] - moved[start]
            rows.append([label, dt, slip[-1], expected, slip[-1] / expected - 1])
            curves[label] = (time[start:] - START, slip)
            if dt == SINE_STEP:
                record.compare(
                    f"slip under the record, Δt = {1000 * dt:g} ms, {label}", slip[-1], "m", truth=expected,
                    truth_source="Newmark's rigid block", allowed=0.02,
                )  # fmt: skip
    names = ["scheme", "Δt [s]", "slip [m]", "rigid block [m]", "error"]
    record.table(pandas.DataFrame(rows, columns=names), "slip", "Slip at the end of the record.")
    draw(record, quake, curves, expected)
    record.energy_closes()


def draw(record: Record, quake: records.Record, curves: dict[str, tuple[FloatArray, FloatArray]], end: float) -> None:
    """The record and the slip in time."""
    from matplotlib import pyplot as plt

    with record.style():
        figure, axes = plt.subplots(
            2, 1, figsize=(PAPER_WIDTH, 3.2), layout="constrained", sharex=True, height_ratios=(1, 1.6)
        )
        axes[0].plot(quake.time, quake.acceleration, color=PALETTE[0], lw=0.7)
        axes[0].axhline(GRAVITY * math.tan(FRICTION - SLOPE), color=PALETTE[3], lw=0.8, ls="--")
        axes[0].set(ylabel="uphill [m/s²]")
        for color, (label, (time, slip)) in zip(PALETTE[1:], curves.items(), strict=False):
            axes[1].plot(time, 100 * slip, color=color, lw=1, label=label)
        axes[1].axhline(100 * end, color=PALETTE[0], lw=0.8, ls=":", label="rigid block, in the end")
        axes[1].set(xlabel="time [s]", ylabel="slip [cm]")
        axes[1].legend(fontsize=7)
        record.figure(figure, "slip", "Record with the acceleration at which the block begins to slide; its slip.")


def both_schemes(record: Record) -> None:
    """The eight tests of the shaking table without k01: does the second scheme come closer to what was measured?"""
    tests = np.arange(len(FREQUENCY)) if record.full else np.array([0, 3, 7])
    _, truth = rigid_block(tests, coulomb(ANALYSIS["friction_angle"]))
    record.text(
        "The tests of 4.3-shaking-table with k01 = 1, the data and the step of the thesis, in Shi's scheme and in "
        f"generalised α, nothing else changed and nothing fitted. {BY_LENGTH}"
    )
    rows = []
    off: dict[str, list[float]] = {label: [] for label in [*SCHEMES.values(), "rigid block"]}
    for j, test in enumerate(tests):
        row = [int(test) + 1, float(FREQUENCY[test]), 100 * MEASURED[test], 100 * truth[-1, j]]
        off["rigid block"].append(abs(truth[-1, j] / MEASURED[test] - 1))
        for scheme, label in SCHEMES.items():
            model = table_model(int(test), Setup())
            model.options["contact"] = {"formulation": "length"}
            model.options["time"] = {"integrator": scheme}
            with record.run(model, f"test{test + 1}-{scheme}") as results:
                moved = results["history/measured_displacement"][-1]
            found = float((moved[0] - moved[1]) @ TABLE_ALONG)
            off[label].append(abs(found / MEASURED[test] - 1))
            row += [100 * found, 100 * (found / MEASURED[test] - 1)]
            record.compare(
                f"displacement, test {test + 1} ({FREQUENCY[test]} Hz), {label}", found, "m",
                truth=float(truth[-1, j]), truth_source="rigid block", allowed=0.02,
                published=float(MEASURED[test]), published_source="Table 4.2, measured",
                explanation="the rigid block with φ = 16° differs from the measured value as much, "
                f"{100 * (truth[-1, j] / MEASURED[test] - 1):+.0f} %",
            )  # fmt: skip
        rows.append(row)
    names = ["test", "frequency [Hz]", "measured [cm]", "rigid block [cm]"]
    for label in SCHEMES.values():
        names += [f"{label} [cm]", f"{label}, off measured [%]"]
    record.table(pandas.DataFrame(rows, columns=names), "tests", "Displacements in both schemes, k01 = 1.")
    means = {label: 100 * float(np.mean(values)) for label, values in off.items()}
    shi, alpha = (means[label] for label in SCHEMES.values())
    verdict = "closer to" if alpha < shi - 0.5 else "farther from" if alpha > shi + 0.5 else "as far from"
    record.text(
        f"The mean difference to what was measured is {shi:.1f} % with Shi's scheme, {alpha:.1f} % with generalised α "
        f"and {means['rigid block']:.1f} % for the rigid block ({len(tests)} tests): without k01 the second scheme is "
        f"{verdict} the measured values {'as' if verdict == 'as far from' else 'than'} the first. A block that slides "
        "does not oscillate, so that the damping of the scheme has nothing to damp; what differs is the friction."
    )
    record.energy_closes()


CASES = [
    Case("dynamics-sliding", "Newmark's block under an earthquake", "Dynamics", sliding),
    Case("dynamics-shaking-table", "The shaking table of chapter 4 in both schemes", "Dynamics", both_schemes),
]
