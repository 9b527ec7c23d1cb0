# SPDX-License-Identifier: MIT
"""How the six-block beam of chapter 5 depends on the time step and on the contact stiffness.

With bonded joints the beam is linear, and its vibration when gravity is put on at once is known exactly: modes of
uniformly strained blocks on springs. That is the truth for the time step. For the contact stiffness it is the
equilibrium of the same blocks with joints that open and slide.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..block_row import BlockRow, centrifuge_beam
from ..case import Case, Record, published
from ..vibration import damped, modes, undamped

FloatArray = npt.NDArray[np.float64]
DATA = published("chapter5")["centrifuge_beam"]
MIDDLE = 5  # measured point left of mid-span
MICRO = 1e6


def convergence(record: Record) -> None:
    """Time step, contact stiffness."""
    _time_step(record)
    _stiffness(record)
    record.energy_closes()


def _time_step(record: Record) -> None:
    row = BlockRow()
    frequencies, shapes = modes(row.bonded(), row.mass)
    rest = np.linalg.solve(row.bonded(), row.load(1.0, 0.0))
    down = -row.displacement(*row.measured()[MIDDLE])[1]
    parts, settled = -(down @ shapes) * (shapes.T @ row.mass @ rest), float(down @ rest)
    period = 2 * np.pi / float(frequencies[0])
    record.text(
        "**Time step.** All joints are bonded, so that the beam is linear; 1 g acts at once on the beam at rest, k01 = "
        "1, "
        f"g0 = {row.normal / 1e6:g} MN/m. Its slowest vibration has {1 / period:.1f} Hz. Two truths: the exact "
        f"vibration "
        "(all modes, undamped), which the program must approach with the first order of its time integration; and the "
        "vibration as the theory of the time integration damps it, mode by mode, which it must hit at any step. "
        f"Errors are root mean squares over two periods ({2e3 * period:.3f} ms), relative to the deflection at rest."
    )
    numbers = [20 * 2**i for i in range(8 if record.full else 5)]  # steps in a period
    rows, curves = [], {}
    for number in numbers:
        step = period / number
        stages = [{"until_step": 2 * number, "gravity": 1, "k01": 1}]
        model = centrifuge_beam(row, push=0.0, stages=stages, time_step=step, bonded=True)
        results = record.run(model, f"steps_{number}", save_every=2 * number)
        y = -results["history/measured_displacement"][:, MIDDLE, 1]
        times = step * np.arange(1, 2 * number + 1)
        exact = settled + undamped(frequencies, parts, times)
        theory = settled + damped(frequencies, parts, 1.0, 2 * number, step)
        curves[number] = times, y, exact
        rows.append(
            {
                "steps in a period": number,
                "Ω of the slowest": frequencies[0] * step,
                "error against exact": _rms(y - exact) / settled,
                "error against theory of the integration": _rms(y - theory) / settled,
                "largest deflection [µm]": y.max() * MICRO,
            }
        )
    errors = np.array([entry["error against exact"] for entry in rows])
    orders = np.log2(errors[:-1] / errors[1:])
    for entry, order in zip(rows[1:], orders.tolist(), strict=True):
        entry["order"] = order
    rows[0]["order"] = np.nan
    record.table(pd.DataFrame(rows), "step", "Bonded beam under 1 g put on at once: error against the time step")
    record.compare(
        f"order of convergence, {numbers[-2]} to {numbers[-1]} steps in a period",
        orders[-1],
        truth=1.0,
        truth_source="algorithmic damping, ratio Ω/4",
        allowed=0.02 if record.full else 0.05,
        explanation="first order in the limit; fast modes are damped away at the larger steps",
    )
    record.compare(
        "largest error against the theory of the integration",
        max(entry["error against theory of the integration"] for entry in rows),
        truth=0.0,
        truth_source="Newmark β = ½, γ = 1, mode by mode",
        scale=1.0,
        allowed=2e-5,
        explanation="second order in the motion (deflection over height: 4e-5)",
    )
    # the instant of the first peak is a point of every grid: half a period
    halves = np.array([curves[number][1][number // 2 - 1] for number in numbers])
    limit = 2 * halves[-1] - halves[-2]
    exact_half = float(curves[numbers[-1]][2][numbers[-1] // 2 - 1])
    record.compare(
        "deflection after half a period, Richardson extrapolation of the two finest",
        limit * MICRO,
        "µm",
        truth=exact_half * MICRO,
        truth_source="exact vibration, all modes",
        allowed=1e-4,
        explanation="what is left is of second order in the step",
    )
    _draw(record, rows, curves, period)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _draw(record: Record, rows: list[dict], curves: dict[int, tuple[FloatArray, ...]], period: float) -> None:
    import matplotlib.pyplot as plt

    with record.style():
        figure, (history, error) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.7), width_ratios=(1.4, 1))
        chosen = list(curves)[:: max(1, len(curves) // 3)][:3]
        for colour, number in zip(PALETTE[1:], chosen, strict=False):
            times, y, _ = curves[number]
            history.plot(times / period, y * MICRO, color=colour, lw=1, label=f"{number} steps in a period")
        times, _, exact = curves[max(curves)]
        history.plot(times / period, exact * MICRO, color="black", lw=0.9, ls="--", label="exact")
        history.set(xlabel="time [periods]", ylabel="mid-span deflection [µm]")
        history.set_ylim(4.0, -1.3)
        history.legend(fontsize=7, ncols=2, loc="upper center")
        steps = np.array([1 / entry["steps in a period"] for entry in rows])
        against = np.array([entry["error against exact"] for entry in rows])
        theory = np.array([entry["error against theory of the integration"] for entry in rows])
        error.loglog(steps, against, "o-", color=PALETTE[1], label="against exact")
        error.loglog(steps, theory, "s-", color=PALETTE[2], label="against theory")
        error.loglog(steps, against[-1] * steps / steps[-1], ":", color="0.5", label="first order")
        error.set(xlabel="Δt [periods]", ylabel="error")
        error.xaxis.set_minor_formatter("")
        error.legend(fontsize=7)
        figure.tight_layout()
    record.figure(figure, "step", "Bonded beam under 1 g put on at once: vibration and error against the time step")


def _stiffness(record: Record) -> None:
    import matplotlib.pyplot as plt

    values = [25e6 * 2**i for i in range(8 if record.full else 4)]
    thrust = BlockRow().weight / BlockRow().friction
    level, before = 12, 200
    computed, truth = [], []
    for value in values:
        row = BlockRow(value)
        push = row.push_for(thrust)
        stages = [{"until_step": before, "gravity": 0, "k01": 0}]
        parts = 4 * level
        stages += [{"until_step": before + 60 * (i + 1), "gravity": (i + 1) / 4, "k01": 0} for i in range(parts)]
        results = record.run(centrifuge_beam(row, push=push, stages=stages), f"g0_{value / 1e6:g}", save_every=10**6)
        y = results["history/measured_displacement"][:, MIDDLE, 1]
        computed.append((y[before - 1] - y[-1]) * MICRO)
        path = row.path(push, level)
        truth.append((row.points(path[0]) - row.points(path[-1]))[MIDDLE, 1] * MICRO)
    found, expected = np.array(computed), np.array(truth)
    soft = 1 / np.array(values)
    limit = found[-1] + (found[-1] - found[-2]) * soft[-1] / (soft[-2] - soft[-1])
    record.text(
        f"**Contact stiffness.** Deflection at {level} g (static, prestress T = {thrust:.4g} N/m), with joints that "
        f"open and "
        f"slide. It falls in proportion to 1/g0 towards {limit:.3g} µm (Richardson extrapolation of the two stiffest), "
        f"the part of the "
        "blocks: at the published 250 MN/m all but a tenth of the deflection is that of the contact springs. g0 is "
        "therefore "
        "no mere numerical parameter in this beam, but the stiffness of its joints, and should be chosen to match them."
    )
    frame = pd.DataFrame(
        {
            "g0 [MN/m]": np.array(values) / 1e6,
            "RockDDA [µm]": found,
            "truth [µm]": expected,
            "error": found / expected - 1,
            "share of the springs": 1 - limit / found,
        }
    )
    record.table(frame, "g0", f"Mid-span deflection at {level} g against contact stiffness")
    worst = int(np.argmax(np.abs(found[1:] / expected[1:] - 1))) + 1
    record.compare(
        f"mid-span deflection at {level} g, g0 ≥ 50 MN/m, the worst: {values[worst] / 1e6:g} MN/m",
        found[worst],
        "µm",
        truth=expected[worst],
        truth_source="uniformly strained blocks on springs with friction",
        allowed=1e-2,
        explanation="second order: the arch sags by up to 5e-3 of its height with the softest springs",
    )
    with record.style():
        figure, axis = plt.subplots(figsize=(PAPER_WIDTH / 2, 2.6))
        axis.plot(soft * 1e9, expected, color="black", lw=0.9, label="truth")
        axis.plot(soft * 1e9, found, "o", color=PALETTE[1], ms=5, label="RockDDA")
        axis.plot(0, limit, "x", color=PALETTE[2], ms=7, label="extrapolated")
        axis.set(xlabel="1/g0 [m/GN]", ylabel="mid-span deflection [µm]", ylim=(0, None))
        axis.legend()
    record.figure(figure, "g0", f"Mid-span deflection at {level} g against the compliance of contacts")


CASES = [
    Case("5.3-centrifuge-convergence", "Six-block beam: time step and contact stiffness", "Chapter 5", convergence)
]
