# SPDX-License-Identifier: MIT
"""A column of 50 blocks on shear joints under 10 s of an earthquake, against the exact motion of the same chain."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..columns import BY_LENGTH, SCHEMES, STRONG, Layer, LinearColumn, column, run_quietly, synthetic_record

FloatArray = npt.NDArray[np.float64]
COUNT, DENSITY, YOUNG = 50, 2500.0, 5e9
WIDTH = 400.0  # so wide that the column shears and does not bend
SHEAR = DENSITY * 404.0**2  # period 2π/(404/s · π/101) = 0.5 s of a chain of rigid blocks
NORMAL = 10 * SHEAR
PROMISED = {0.01: (0.10, 0.25), 0.002: (0.02, 0.05)}  # of peak and rms


def shear_column(record: Record) -> None:
    """Both schemes, two time steps."""
    layers = [Layer(COUNT, 1.0, DENSITY, YOUNG)]
    exact = LinearColumn(layers, WIDTH, NORMAL, SHEAR)
    top = exact.motion_at(COUNT - 1, 0.0, COUNT - 0.5)[0]
    quake = synthetic_record()
    share = (top @ exact.shapes) * (exact.shapes.T @ exact.mass @ np.tile([1.0, 0, 0, 0, 0, 0], COUNT))
    period = 2 * math.pi / float(exact.frequencies[np.argmax(np.abs(share))])
    record.text(
        f"{COUNT} blocks of 1 m on top of each other, {WIDTH:g} m wide so that the column shears and does not bend, on "
        f"bonded joints of {SHEAR:.3g} Pa/m in shear; the longest period is {period:.3f} s, and nothing damps. The "
        f"record is synthetic, {quake.duration:g} s from 0.2 to 10 Hz with a peak of 1 m/s². {BY_LENGTH} The truth is "
        "the exact motion of the same blocks of uniform strain on the same springs: all modes, each with the exact "
        "response to a record that is linear between its samples."
    )
    rows, curves = [], {}
    for dt in (0.01, 0.002):
        end = quake.duration if record.full or dt == 0.01 else 0.5 * quake.duration
        times = np.arange(round(end / dt) + 1) * dt
        truth = exact.shaken(quake, times, top)
        for scheme, label in SCHEMES.items():
            if scheme == "shi" and dt < 0.01 and not record.full:
                continue
            joint = {"cohesion": STRONG, "tension": STRONG, "normal_stiffness": NORMAL, "shear_stiffness": SHEAR}
            model = column(
                "column", layers, WIDTH, [joint],
                time={"integrator": scheme},
                boundary=[{"along": [0, 0, WIDTH, 0], "kind": "fixed"}],
                quake=[{"record": "record.csv"}],
                run={"steps": len(times) - 1},
            )  # fmt: skip
            model.dt_max, model.displacement_ratio = dt, 0.004
            model.add_measured((WIDTH / 2, COUNT - 0.5))
            with run_quietly(record, model, f"{scheme}-{1000 * dt:g}ms", quake) as results:
                found = np.concatenate([[0.0], results["history/measured_displacement"][:, 0, 0]])
            peak = np.abs(found).max() / np.abs(truth).max()
            rms = float(np.sqrt(((found - truth) ** 2).mean() / (truth**2).mean()))
            rows.append([label, dt, np.abs(found).max(), peak - 1, rms])
            curves[scheme, dt] = (times, found, truth)
            promised = PROMISED[dt] if scheme == "generalized_alpha" else (None, None)
            why = "" if promised[0] else "Shi's scheme damps what a step does not resolve"
            record.compare(
                f"largest displacement of the top, Δt = {1000 * dt:g} ms, {label}", np.abs(found).max(), "m",
                truth=float(np.abs(truth).max()), truth_source="exact chain", allowed=promised[0], explanation=why,
            )  # fmt: skip
            record.compare(
                f"rms of the difference over that of the motion, Δt = {1000 * dt:g} ms, {label}", rms, truth=0.0,
                scale=1.0, truth_source="exact chain", allowed=promised[1], explanation=why,
            )  # fmt: skip
    names = ["scheme", "Δt [s]", "largest displacement [m]", "its error", "rms of the difference / of the motion"]
    record.table(pandas.DataFrame(rows, columns=names), "errors", "Displacement of the top relative to the base.")
    draw(record, curves)
    # the coordinates of blocks 400 m wide are rounded to 5e-14 m, steps are 1e-5 to 1e-3 m
    record.energy_closes(1e-8)


def draw(record: Record, curves: dict[tuple[str, float], tuple[FloatArray, FloatArray, FloatArray]]) -> None:
    """The top in time, at the longer step."""
    from matplotlib import pyplot as plt

    with record.style():
        figure, axis = plt.subplots(figsize=(PAPER_WIDTH, 2.6), layout="constrained")
        times, _, truth = curves["shi", 0.01]
        axis.plot(times, 100 * truth, color=PALETTE[0], lw=2.2, alpha=0.35, label="exact chain")
        for color, (scheme, label) in zip(PALETTE[1:], SCHEMES.items(), strict=False):
            axis.plot(times, 100 * curves[scheme, 0.01][1], color=color, lw=0.9, label=label)
        axis.set(xlabel="time [s]", ylabel="top relative to base [cm]")
        axis.legend(fontsize=7, ncols=3)
        record.figure(figure, "top", "Displacement of the top with Δt = 10 ms, some 50 steps in the longest period.")


CASES = [Case("dynamics-shear-column", "A column of 50 blocks under an earthquake", "Dynamics", shear_column)]
