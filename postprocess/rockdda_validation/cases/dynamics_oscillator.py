# SPDX-License-Identifier: MIT
"""Both schemes of time integration on one oscillator: amplitude, period, spectral radius; and their order."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..columns import BY_LENGTH, SCHEMES, STRONG, Layer, LinearColumn, column, run_quietly
from ..integrator import fit_recurrence, fit_roots, generalized_alpha_roots, numerical_decay, numerical_frequency

FloatArray = npt.NDArray[np.float64]
DENSITY, STIFFNESS, RIGID = 1000.0, 1e7, 1e15  # kg/m², Pa/m, Pa
OMEGA = math.sqrt(STIFFNESS / DENSITY)
RHO = 0.8
SOURCE = "Chung, J. & Hulbert, G. M. (1993), J. Appl. Mech. 60, 371-375"
HELD = 1e6  # springs of the base over those of the joint


def oscillator(scheme: str, rho: float, dt: float, steps: int) -> Model:
    """A rigid square of 1 m on a joint that neither opens nor slips, pushed down; period 2π √(m/k)."""
    layers = [Layer(1, 1.0, DENSITY, RIGID), Layer(1, 1.0, DENSITY, RIGID, velocity=(0.0, -1e-3 * OMEGA, 0.0))]
    return on_base("oscillator", layers, scheme, rho, dt, steps)


def on_base(name: str, layers: list[Layer], scheme: str, rho: float, dt: float, steps: int) -> Model:
    """Blocks of a column 1 m wide on bonded joints, the lowest block held."""
    joint = {"cohesion": STRONG, "tension": STRONG, "normal_stiffness": STIFFNESS, "shear_stiffness": STIFFNESS}
    model = column(
        name, layers, 1.0, [joint],
        time={"integrator": scheme, "rho_infinity": rho},
        boundary=[{"along": [0, 0, 1, 0], "kind": "fixed"}],
        run={"steps": steps},
    )  # fmt: skip
    model.options["contact"]["fixed_stiffness_factor"] = HELD
    model.dt_max, model.displacement_ratio = dt, 0.5
    count = sum(layer.count for layer in layers)
    model.add_measured((1.0, count))
    return model


def motion(record: Record, model: Model, name: str) -> FloatArray:
    """Displacements (n + 1, 2) of the measured point, from the start on."""
    with run_quietly(record, model, name) as results:
        return np.vstack([[0.0, 0.0], results["history/measured_displacement"][:, 0]])


def largest_near(x: FloatArray, step: int, per_period: int) -> float:
    """Amplitude of an oscillation in the period before a step, from the parabola through its largest sample."""
    part = np.abs(x[step - per_period : step + 1])
    i = step - per_period + int(part.argmax())
    before, here, after = np.abs(x[i - 1 : i + 2])
    bend = before - 2 * here + after
    return float(here - (after - before) ** 2 / (8 * bend)) if bend else float(here)


def curves(record: Record) -> None:
    """T27, and amplitude and period over the steps of a period, for both schemes."""
    record.text(
        f"A rigid block on a bonded joint is a mass on a spring. {BY_LENGTH} Amplitude and period are those of the "
        "recurrence that fits the computed motion. The truth is the motion that does not decay; the curves of theory "
        f"are the roots of one step: of Newmark's with β = ½, γ = 1 for Shi's scheme, and of the equations of {SOURCE}."
    )
    points = (6, 10, 14, 20, 30, 50, 100, 200) if record.full else (8, 20, 100)
    rows, found = [], {}
    for scheme, label in SCHEMES.items():
        found[scheme] = []
        for n in points:
            x = motion(record, oscillator(scheme, RHO, 2 * math.pi / OMEGA / n, 11 * n), f"{scheme}-{n}")[:, 1]
            root, _ = fit_recurrence(x[n:])
            phase = abs(np.angle(root))
            kept, error = abs(root) ** (2 * math.pi / phase), 2 * math.pi / n / phase
            after_ten = largest_near(x, 10 * n + n // 2, n) / largest_near(x, n // 2 + 1, n // 2)
            found[scheme].append((1 / n, 1 - kept, error - 1))
            rows.append([label, n, kept, error - 1, after_ten])
            if n in (20, 100):
                least = {20: 0.95, 100: 0.99}[n]
                promise = {"allowed": 1 - least} if scheme == "generalized_alpha" else {}
                record.compare(
                    f"amplitude after ten periods of {n} steps, {label}", after_ten, truth=1.0,
                    truth_source="x'' = -ω²x", **promise,
                    explanation="" if promise else "Shi's scheme damps: (1 + Ω²/2)^-½ a step, Ω = ωΔt",
                )  # fmt: skip
            theory = scheme_of(scheme)(2 * math.pi / n)
            record.compare(
                f"loss of amplitude in a period of {n} steps, {label}, against the roots of a step", kept,
                truth=theory[0], truth_source="roots of a step", allowed=1e-5,
            )  # fmt: skip
    names = ["scheme", "steps a period", "amplitude after a period", "error of the period", "amplitude after ten"]
    record.table(pandas.DataFrame(rows, columns=names), "curves", "What is left of the amplitude; error of the period.")
    draw_curves(record, found)


def scheme_of(scheme: str) -> Callable[[float], tuple[float, float]]:
    """By Ω: amplitude left after a period, and computed over true period less one, from the roots of a step."""

    def shi(w: float) -> tuple[float, float]:
        phase = w * numerical_frequency(w)
        return numerical_decay(w) ** (2 * math.pi / phase), w / phase - 1

    def alpha(w: float) -> tuple[float, float]:
        root = max((r for r in generalized_alpha_roots(w, RHO) if r.imag > 0), key=abs)
        phase = float(np.angle(root))
        return float(abs(root) ** (2 * math.pi / phase)), w / phase - 1

    return shi if scheme == "shi" else alpha


def draw_curves(record: Record, found: dict[str, list[tuple[float, float, float]]]) -> None:
    """Loss of amplitude and error of the period over Δt/T."""
    from matplotlib import pyplot as plt

    line = np.geomspace(1 / 250, 1 / 5, 80)
    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.7), layout="constrained")
        for color, (scheme, rows) in zip(PALETTE[1:], found.items(), strict=False):
            theory = np.array([scheme_of(scheme)(2 * math.pi * ratio) for ratio in line])
            values = np.array(rows)
            for axis, curve, dots in ((axes[0], 1 - theory[:, 0], values[:, 1]), (axes[1], theory[:, 1], values[:, 2])):
                axis.loglog(line, curve, color=color, lw=1)
                axis.loglog(values[:, 0], dots, "o", color=color, ms=4, label=SCHEMES[scheme])
        for axis, title in zip(axes, ("loss of amplitude in a period", "error of the period"), strict=True):
            axis.set(xlabel="Δt/T", title=title)
        axes[0].legend(fontsize=7)
        record.figure(figure, "curves", "Dots: measured; lines: roots of one step.")


def radius(record: Record) -> None:
    """T17: spectral radius of a step, up to steps far longer than the period."""
    from matplotlib import pyplot as plt

    rhos = (0.8, 0.5, 0.2) if record.full else (0.8, 0.5)
    ratios = (0.1, 0.5, 1.0, 3.0, 10.0, 100.0, 1000.0) if record.full else (1.0, 1000.0)
    rows = []
    for rho in rhos:
        for ratio in ratios:
            model = oscillator("generalized_alpha", rho, ratio / OMEGA, 40)
            x = motion(record, model, f"radius-{rho:g}-{ratio:g}")[:, 1]
            lasts = 3 + math.floor(math.log(1e-5) / math.log(rho))  # steps, before rounding counts
            x = x[: lasts + 1]
            rows.append([rho, ratio, float(abs(fit_roots(x)[0])), float(abs(generalized_alpha_roots(ratio, rho)[0]))])
        record.compare(
            f"spectral radius at Ω = 1000, ρ∞ = {rho:g}", rows[-1][2], truth=rho,
            truth_source=SOURCE,
            allowed=0.04,  # at Ω = 1000 the two roots that coincide at infinity are still apart: 3.2 % for ρ∞ = 0.2
        )  # fmt: skip
    worst = max(rows, key=lambda row: abs(row[2] / row[3] - 1))
    record.compare(
        f"spectral radius, the worst (ρ∞ = {worst[0]:g}, Ω = {worst[1]:g})", worst[2], truth=worst[3],
        # roots that nearly coincide: rounding, 1e-10 of the motion, moves them by its square root and more
        truth_source="roots of the published step", allowed=1e-3,
    )  # fmt: skip
    names = ["ρ∞", "Ω = ωΔt", "spectral radius", "as published"]
    record.table(pandas.DataFrame(rows, columns=names), "radius", "Spectral radius of a step of generalised α.")
    line = np.geomspace(0.05, 2000, 120)
    with record.style():
        figure, axis = plt.subplots(figsize=(PAPER_WIDTH, 2.6), layout="constrained")
        for color, rho in zip(PALETTE[1:], rhos, strict=False):
            axis.semilogx(line, [abs(generalized_alpha_roots(w, rho)[0]) for w in line], color=color, lw=1)
            mine = [row for row in rows if row[0] == rho]
            axis.semilogx([r[1] for r in mine], [r[2] for r in mine], "o", ms=4, color=color, label=f"ρ∞ = {rho:g}")
        axis.set(xlabel="Ω = ωΔt", ylabel="spectral radius", ylim=(0, 1.05))
        axis.legend(fontsize=7)
        record.figure(figure, "radius", "Dots: of the computed motion; lines: as published.")


def both(record: Record) -> None:
    """Curves and spectral radius."""
    curves(record)
    radius(record)
    record.energy_closes()


def order(record: Record) -> None:
    """T17: error of the whole motion on halving the step, against the exact motion of the same springs."""
    record.text(
        f"Free vibration on bonded joints: one block, a chain of 20, and a block that turns on its joint. {BY_LENGTH} "
        "The truth is the exact motion of the same blocks of uniform strain on the same springs (matrices written in "
        "Python, all modes, no time steps). Compared is the root mean square of the difference over the whole motion."
    )
    young = 1e11
    base = Layer(1, 1.0, DENSITY, young)
    models = {
        "single block": ([base, Layer(1, 1.0, DENSITY, young, (0.0, -1e-3, 0.0))], 0.002, 0.4),
        "chain of 20": (
            [base, *(Layer(1, 1.0, DENSITY, young, (0.0, -1e-4 * i, 0.0)) for i in range(1, 21))], 0.002, 0.6,
        ),
        "rotating block": ([base, Layer(1, 1.0, DENSITY, young, (0.0, 0.0, 1e-3))], 0.002, 0.2),
    }  # fmt: skip
    rows = []
    for name, (layers, dt, end) in models.items():
        exact = LinearColumn(layers, 1.0, STIFFNESS, STIFFNESS, HELD)
        speed = np.concatenate([[*layer.velocity, 0.0, 0.0, 0.0] for layer in layers])
        place = exact.motion_at(len(layers) - 1, 0.5, len(layers))
        for scheme, label in SCHEMES.items():
            errors = []
            for part in (1, 2, 4) if record.full else (1, 2):
                steps = round(end / dt) * part
                model = on_base("order", layers, scheme, RHO, dt / part, steps)
                found = motion(record, model, f"{name.replace(' ', '-')}-{scheme}-{part}")
                times = np.arange(steps + 1) * dt / part
                truth = np.column_stack([exact.free(speed, times, row) for row in place])
                errors.append(float(np.sqrt(((found - truth) ** 2).sum() / (truth**2).sum())))
            ratio = errors[-2] / errors[-1]
            rows.append([name, label, dt, *errors[:2], ratio])
            if scheme == "generalized_alpha":
                record.compare(
                    f"error on halving Δt, {name}, {label}", ratio, "times less", truth=4.0,
                    truth_source="second order", allowed=0.3 / 4,
                )  # fmt: skip
    names = ["model", "scheme", "Δt [s]", "error", "error with Δt/2", "times less (last halving)"]
    record.table(pandas.DataFrame(rows, columns=names), "order", "Error of the motion, rms over rms.")
    record.energy_closes(1e-8)


CASES = [
    Case("dynamics-oscillator", "Amplitude, period and spectral radius of both schemes", "Dynamics", both),
    Case("dynamics-order", "Order of the time integration on springs of contacts", "Dynamics", order),
]
