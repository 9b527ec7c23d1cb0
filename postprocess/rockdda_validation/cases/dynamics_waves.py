# SPDX-License-Identifier: MIT
"""Waves along a column of cells: through a soft joint, out of a viscous boundary, and up through layers."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.records import Record as Quake
from rockdda.records import response_spectrum

from ..case import Case, Record
from ..columns import BY_LENGTH, SCHEMES, STRONG, Layer, column, run_quietly, synthetic_record

FloatArray = npt.NDArray[np.float64]
KINDS = ("compression", "shear")
WIDE = 20.0  # width over height of a column that shears: it turns by (height/width)² of that
CELLS = (
    "For compression the cells are squares of tied rock. A shear wave would bend so narrow a column: there its cells "
    "are slabs on bonded joints of 1000 G over the height of a cell, 20 times as wide as the column is high, and it "
    "only shears."
)


def wave_column(
    name: str, kind: str, layers: list[Layer], size: float, soft: dict[int, int] | None = None,
    joint: dict[str, Any] | None = None, *, base_only: bool = False, **options: Any,
) -> Model:  # fmt: skip
    """A column with viscous ends into which the record comes as a wave of compression (y) or shear (x)."""
    height = sum(layer.count * layer.height for layer in layers)
    width = size if kind == "compression" else WIDE * height
    stiff = max(1000 * layer.young / 2 / layer.height for layer in layers)
    rock: dict[str, Any] = {"tie": True}
    if kind == "shear":
        rock = {"cohesion": STRONG, "tension": STRONG, "normal_stiffness": 2 * stiff, "shear_stiffness": stiff}
    if joint and kind == "shear":
        joint = joint | {"normal_stiffness": stiff}  # it does not turn the slabs
    ends = [[0, 0, width, 0]] + ([] if base_only else [[0, height, width, height]])
    model = column(
        name, layers, width, [rock, *([joint] if joint else [])], soft,
        boundary=[{"along": along, "kind": "viscous"} for along in ends],
        quake=[{
            "record": "record.csv", "apply": "viscous_base", "direction": "y" if kind == "compression" else "x",
        }],
        **options,
    )  # fmt: skip
    model.displacement_ratio = 0.01
    return model


def width_of(kind: str, count: int, size: float) -> float:
    """Of a column of equal cells."""
    return size if kind == "compression" else WIDE * count * size


def motions(record: Record, model: Model, name: str, quake: Quake, kind: str) -> tuple[FloatArray, FloatArray]:
    """Times and displacements (n + 1, points) along the direction of the motion."""
    with run_quietly(record, model, name, quake) as results:
        moved = results["history/measured_displacement"][:, :, 1 if kind == "compression" else 0]
        return (
            np.concatenate([[0.0], results["history/time"][:]]),
            np.vstack([np.zeros((1, moved.shape[1])), moved]),
        )


# -- T13 -------------------------------------------------------------------------------------------------------------

ROCK, SPEED, JOINT = 2650.0, 5000.0, 5e9  # kg/m², m/s, Pa/m
A_WAVE, A_PERIOD = 40, 100  # cells in a wavelength, steps in a period


def through_joint(record: Record) -> None:
    """T13 for both kinds of waves, three frequencies."""
    record.text(
        f"A harmonic wave ({ROCK:g} kg/m³, {SPEED:g} m/s) runs up a column and meets one soft joint of {JOINT:g} Pa/m; "
        f"both ends are viscous, {A_WAVE} cells in a wavelength, {A_PERIOD} steps in a period. {CELLS} Transmitted is "
        "|T| = [1 + (ρcω/2k)²]^-½, reflected |R|² = 1 - |T|² (Pyrak-Nolte et al. 1990). Amplitudes are those of the "
        f"steady motion, above the joint and, parted into both directions, below it. {BY_LENGTH}"
    )
    schemes = SCHEMES if record.full else {"generalized_alpha": SCHEMES["generalized_alpha"]}
    rows = []
    for scheme, label in schemes.items():
        for kind in KINDS:
            for frequency in (50.0, 100.0, 200.0):
                through, back = _transmission(record, kind, scheme, frequency)
                ratio = ROCK * SPEED * 2 * math.pi * frequency / (2 * JOINT)
                expected = 1 / math.hypot(1, ratio)
                rows.append([label, kind, frequency, through, expected, back, math.sqrt(1 - expected**2)])
                why = "" if scheme == "generalized_alpha" else "Shi's scheme damps the wave on its way"
                for quantity, found, truth in (
                    ("transmitted", through, expected), ("reflected", back, math.sqrt(1 - expected**2)),
                ):  # fmt: skip
                    record.compare(
                        f"{quantity} amplitude, {kind}, {frequency:g} Hz, {label}", found, truth=truth,
                        truth_source="closed form", scale=1.0 if quantity == "reflected" else None,
                        allowed=0.02 if scheme == "generalized_alpha" else None, explanation=why,
                    )  # fmt: skip
    names = ["scheme", "wave", "frequency [Hz]", "transmitted", "closed form", "reflected", "closed form of it"]
    record.table(pandas.DataFrame(rows, columns=names), "amplitudes", "Amplitudes over that of the wave that comes in.")
    _draw_transmission(record, rows)
    record.energy_closes(1e-8)


def _transmission(record: Record, kind: str, scheme: str, frequency: float) -> tuple[float, float]:
    """Amplitudes transmitted and reflected over that of the wave that comes in."""
    size, omega, dt = SPEED / frequency / A_WAVE, 2 * math.pi * frequency, 1 / frequency / A_PERIOD
    below, above, peak = 20, 12, 1e-3
    young = ROCK * SPEED**2 * (1 if kind == "compression" else 2)
    joint = {"cohesion": STRONG, "tension": STRONG, "normal_stiffness": JOINT, "shear_stiffness": JOINT}
    ramp, periods = 2.0, 5.0
    time = np.arange(round(periods * A_PERIOD) + 1) * dt
    share = np.clip(time * frequency / ramp, 0, 1)
    rise, slope = np.sin(0.5 * math.pi * share) ** 2, 0.5 * math.pi * frequency / ramp * np.sin(math.pi * share)
    quake = Quake(time, peak * (omega * np.cos(omega * time) * rise + np.sin(omega * time) * slope))
    model = wave_column(
        "joint", kind, [Layer(below + above, size, ROCK, young)], size, {below: 2}, joint,
        time={"integrator": scheme}, run={"steps": len(time) - 1},
    )  # fmt: skip
    model.dt_max = dt
    places = np.array([6.5, 14.5, below + 5.5]) * size
    for y in places:
        model.add_measured((0.5 * width_of(kind, below + above, size), y))
    times, moved = motions(record, model, f"{scheme}-{kind}-{frequency:g}", quake, kind)
    last = slice(-A_PERIOD, None)  # a whole period
    wave = np.exp(-1j * omega * times[last]) @ (moved[last] - moved[last].mean(axis=0)) * 2 / A_PERIOD * omega / peak
    k = omega / SPEED
    low, high, top = wave
    # low = up e^(-iky1) + down e^(iky1), high likewise
    up, down = np.linalg.solve(
        [[cmath.exp(-1j * k * y), cmath.exp(1j * k * y)] for y in places[:2]], np.array([low, high])
    )
    return float(abs(top) / abs(up)), float(abs(down) / abs(up))


def _draw_transmission(record: Record, rows: list[list[Any]]) -> None:
    from matplotlib import pyplot as plt

    frequency = np.linspace(1, 260, 200)
    ratio = ROCK * SPEED * 2 * math.pi * frequency / (2 * JOINT)
    with record.style():
        figure, axis = plt.subplots(figsize=(PAPER_WIDTH, 2.6), layout="constrained")
        axis.plot(frequency, 1 / np.hypot(1, ratio), color=PALETTE[0], lw=1, label="transmitted, closed form")
        axis.plot(frequency, ratio / np.hypot(1, ratio), "--", color=PALETTE[0], lw=1, label="reflected, closed form")
        for (kind, mark), color in zip({"compression": "o", "shear": "x"}.items(), PALETTE[1:], strict=False):
            mine = [row for row in rows if row[1] == kind and row[0] == SCHEMES["generalized_alpha"]]
            for column_of in (3, 5):
                label = kind if column_of == 3 else None
                axis.plot([r[2] for r in mine], [r[column_of] for r in mine], mark, color=color, ms=5, label=label)
        axis.set(xlabel="frequency [Hz]", ylabel="amplitude / that of the wave", ylim=(0, 1))
        axis.legend(fontsize=7)
        record.figure(figure, "amplitudes", "Amplitudes that a joint of 5 GPa/m lets through and sends back.")


# -- T14 -------------------------------------------------------------------------------------------------------------


def viscous_end(record: Record) -> None:
    """T14 at 0°: a pulse of 20 cells that comes in at one viscous end and leaves at the other."""
    record.text(
        "A pulse of velocity sin², 20 cells long, comes in at the viscous base of a column of 60 cells and leaves at "
        f"its viscous top (Lysmer & Kuhlemeyer 1969). {CELLS} Reflected is the largest velocity of the middle cell "
        "after the pulse has passed, over the largest one of the pulse. At an angle of 30° a viscous boundary does "
        "send waves back; table of the closed form below."
    )
    rows, curves = [], {}
    count, cells = 60, 20
    fraction = 0.1 if record.full else 0.2
    for kind in KINDS:
        young = ROCK * SPEED**2 * (1 if kind == "compression" else 2)
        for scheme, label in SCHEMES.items():
            dt = fraction / SPEED
            length = cells / SPEED
            time = np.arange(round(cells / fraction) + 1) * dt
            quake = Quake(time, 1e-3 * math.pi / length * np.sin(2 * math.pi * time / length))
            model = wave_column(
                "end", kind, [Layer(count, 1.0, ROCK, young)], 1.0,
                time={"integrator": scheme}, run={"steps": round(115 / fraction)},
            )  # fmt: skip
            model.dt_max = dt
            model.add_measured((0.5 * width_of(kind, count, 1.0), 30.5))
            times, moved = motions(record, model, f"{kind}-{scheme}", quake, kind)
            middle, speed = 0.5 * (times[1:] + times[:-1]), np.diff(moved[:, 0]) / dt
            came = np.abs(speed[middle < 60 / SPEED]).max()
            back = np.abs(speed[middle > 80 / SPEED]).max()
            rows.append([kind, label, came / 1e-3, back / came])
            curves[kind, scheme] = (middle, speed)
            record.compare(
                f"reflected amplitude of a {kind} wave at 0°, {label}", back / came, truth=0.0, scale=1.0,
                truth_source="no reflection at 0°", allowed=0.01,
            )  # fmt: skip
            record.compare(
                f"amplitude of a {kind} wave from the viscous base, {label}", came / 1e-3, truth=1.0,
                truth_source="the wave of the record",
                allowed=0.01 if scheme == "generalized_alpha" else None,
                explanation="" if scheme == "generalized_alpha" else "Shi's scheme damps the wave on its way",
            )  # fmt: skip
    names = ["wave", "scheme", "pulse in the middle / record", "reflected / pulse"]
    record.table(pandas.DataFrame(rows, columns=names), "reflected", "What comes back from the viscous top.")
    angles = (0, 10, 20, 30, 45, 60)
    closed = [[angle, *reflected("compression", angle), *reflected("shear", angle)] for angle in angles]
    record.table(
        pandas.DataFrame(closed, columns=["angle [°]", "P → P", "P → S", "S → S", "S → P"]), "angles",
        "Closed form: amplitudes (of displacement) that a viscous boundary sends back of a plane wave, ν = 0.25. "
        "The S wave is beyond its critical angle (35.3°) at 45° and 60°.",
    )  # fmt: skip
    _draw_pulses(record, curves)
    record.energy_closes(3e-8, "rounding of the lengths of ties, 1000 times as stiff as their cells")


def reflected(kind: str, angle: float, poisson: float = 0.25) -> tuple[float, float]:
    """Amplitudes of the waves of the same and of the other kind that a viscous boundary reflects.

    The boundary is y = 0, the medium below it; a plane wave comes at an angle [degrees] from the normal. Its traction
    and those of both reflected waves are -ρ c_p v_n and -ρ c_s v_t. Units: ρ = c_p = ω = 1.
    """
    cs = math.sqrt((1 - 2 * poisson) / (2 - 2 * poisson))
    shear, lame = cs**2, 1 - 2 * cs**2
    slow = math.sin(math.radians(angle)) / (1.0 if kind == "compression" else cs)  # slowness along the boundary
    p, s = cmath.sqrt(1 - slow**2), cmath.sqrt(1 / cs**2 - slow**2)  # along its normal

    def rest(direction: tuple[complex, complex], along: complex) -> list[complex]:
        """Traction plus what the dashpots give, over iω: motion direction · exp(iω(slow x + along y - t))."""
        u, v = direction
        normal = lame * (slow * u + along * v) + 2 * shear * along * v
        tangential = shear * (along * u + slow * v)
        return [normal - v, tangential - cs * u]

    waves = {
        "up P": ((slow, p), p), "up S": ((s * cs, -slow * cs), s),
        "down P": ((slow, -p), -p), "down S": ((s * cs, slow * cs), -s),
    }  # fmt: skip
    coming = rest(*waves["up P" if kind == "compression" else "up S"])
    going = np.array([rest(*waves["down P"]), rest(*waves["down S"])]).T
    amplitudes = np.abs(np.linalg.solve(going, -np.array(coming)))
    return (float(amplitudes[0]), float(amplitudes[1]))[:: 1 if kind == "compression" else -1]


def _draw_pulses(record: Record, curves: dict[tuple[str, str], tuple[FloatArray, FloatArray]]) -> None:
    from matplotlib import pyplot as plt

    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.5), layout="constrained", sharey=True)
        for axis, kind in zip(axes, KINDS, strict=True):
            for color, (scheme, label) in zip(PALETTE[1:], SCHEMES.items(), strict=False):
                times, speed = curves[kind, scheme]
                axis.semilogy(1000 * times, np.abs(speed) / 1e-3 + 1e-9, color=color, lw=0.9, label=label)
            axis.set(xlabel="time [ms]", title=kind, ylim=(1e-6, 2))
        axes[0].set_ylabel("|velocity| of the middle / pulse")
        axes[0].legend(fontsize=7)
        record.figure(figure, "pulses", "Velocity of the middle cell; what came back would arrive at 18 to 22 ms.")


# -- layers ----------------------------------------------------------------------------------------------------------

#: height [m], density [kg/m²], speed of shear waves [m/s], cells; from below: rock, till, sand
GROUND = ((20.0, 2400.0, 800.0, 5), (30.0, 2100.0, 450.0, 20), (20.0, 1900.0, 220.0, 25))
PAD = 8  # times the record: the motion has died away by radiation into the base


def surface_motion(quake: Quake) -> FloatArray:
    """Acceleration of the surface for a wave with this acceleration that comes up from below; exact, SciPy's FFT.

    In each layer u = A e^(ikz) + B e^(-ikz), z downwards, A = B at the free surface; displacement and traction are
    continuous at interfaces (Kramer 1996, §7.2). The surface moves with 2 A of the top layer, the wave that comes is A
    of the rock, at its lower end.
    """
    from scipy import fft

    n = fft.next_fast_len(PAD * len(quake.time))
    omega = 2 * math.pi * fft.rfftfreq(n, quake.step)
    up = np.ones_like(omega, dtype=complex)
    down = np.ones_like(up)
    layers = GROUND[::-1]
    for i, (height, density, speed, _) in enumerate(layers):
        phase = np.exp(1j * omega / speed * height)
        up, down = up * phase, down / phase
        if i + 1 < len(layers):
            ratio = density * speed / (layers[i + 1][1] * layers[i + 1][2])
            up, down = 0.5 * (up * (1 + ratio) + down * (1 - ratio)), 0.5 * (up * (1 - ratio) + down * (1 + ratio))
    return np.asarray(fft.irfft(fft.rfft(quake.acceleration, n) * 2 / up, n))[: len(quake.time)]


def layered(record: Record) -> None:
    """Sand on till on rock; the record comes in at the viscous base."""
    record.text(
        "20 m of sand (220 m/s) on 30 m of till (450 m/s) on rock (800 m/s), as slabs on bonded joints; the synthetic "
        "record comes up through the viscous base as a shear wave (peak 1 m/s², 0.2 to 10 Hz). Cells are at most 1/20 "
        "of the wavelength at 10 Hz. The truth is the exact solution of the layers, without damping, on elastic rock, "
        f"in the frequency domain. Compared are accelerations of the surface over two steps of 5 ms. {BY_LENGTH}"
    )
    dt = 0.005
    base = synthetic_record()
    quiet = np.arange(1, 201) * base.step  # two seconds more, in which the ground comes to rest
    quake = Quake(np.append(base.time, base.time[-1] + quiet), np.append(base.acceleration, 0 * quiet))
    fine = Quake(np.arange(round(quake.duration / dt) + 1) * dt, np.interp(
        np.arange(round(quake.duration / dt) + 1) * dt, quake.time, quake.acceleration))  # fmt: skip
    truth = surface_motion(fine)
    spectra = {
        "record": response_spectrum(fine, damping=0.05),
        "exact": response_spectrum(Quake(fine.time, truth), damping=0.05),
    }
    top = sum(height for height, *_ in GROUND)
    layers = [Layer(n, height / n, density, 2 * density * speed**2) for height, density, speed, n in GROUND]
    rows, curves = [], {}
    for scheme, label in SCHEMES.items():
        if scheme == "shi" and not record.full:
            continue
        for step in (dt, dt / 2) if record.full else (dt,):
            model = wave_column(
                "ground", "shear", layers, 4.0, base_only=True,
                time={"integrator": scheme}, run={"steps": round(quake.duration / step)},
            )  # fmt: skip
            model.dt_max = step
            model.add_measured((0.5 * WIDE * top, top))
            _, moved = motions(record, model, f"{scheme}-{1000 * step:g}ms", quake, "shear")
            part = round(dt / step)
            moved = moved[::part, 0]
            found = np.zeros_like(moved)
            found[1:-1] = (moved[2:] - 2 * moved[1:-1] + moved[:-2]) / dt**2
            spectrum = response_spectrum(Quake(fine.time, found), damping=0.05)
            apart = float(np.abs(spectrum.acceleration / spectra["exact"].acceleration - 1).max())
            rows.append([label, step, np.abs(found).max(), np.abs(found).max() / np.abs(truth).max() - 1, apart])
            curves[label] = (found, spectrum)
            promised = scheme == "generalized_alpha"
            record.compare(
                f"largest acceleration of the surface, Δt = {1000 * step:g} ms, {label}", np.abs(found).max(), "m/s²",
                truth=float(np.abs(truth).max()), truth_source="exact layers", allowed=0.03 if promised else None,
                explanation="" if promised else "Shi's scheme damps what a step does not resolve",
            )  # fmt: skip
    names = ["scheme", "Δt [s]", "largest acceleration [m/s²]", "its error", "largest error of the spectrum"]
    record.table(pandas.DataFrame(rows, columns=names), "surface", "The surface; spectrum with a damping of 0.05.")
    _draw_layers(record, fine.time, truth, curves, spectra)
    record.energy_closes(1e-8)


def _draw_layers(
    record: Record, time: FloatArray, truth: FloatArray, curves: dict[str, Any], spectra: dict[str, Any]
) -> None:
    from matplotlib import pyplot as plt

    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.8), layout="constrained", width_ratios=(1.4, 1))
        axes[0].plot(time, truth, color=PALETTE[0], lw=2.2, alpha=0.35, label="exact layers")
        exact = spectra["exact"]
        axes[1].semilogx(exact.period, exact.acceleration, color=PALETTE[0], lw=2.2, alpha=0.35)
        wave = spectra["record"]
        axes[1].semilogx(wave.period, wave.acceleration, ":", color=PALETTE[0], lw=1, label="wave that comes in")
        for color, (label, (found, spectrum)) in zip(PALETTE[1:], curves.items(), strict=False):
            axes[0].plot(time, found, color=color, lw=0.8, label=label)
            axes[1].semilogx(spectrum.period, spectrum.acceleration, color=color, lw=0.9)
        axes[0].set(xlabel="time [s]", ylabel="acceleration of the surface [m/s²]")
        axes[1].set(xlabel="period [s]", ylabel="spectral acceleration [m/s²]")
        axes[0].legend(fontsize=7)
        axes[1].legend(fontsize=7)
        record.figure(figure, "surface", "Surface of the layers in time, and its response spectrum (damping 0.05).")


CASES = [
    Case("dynamics-joint", "Harmonic waves through one soft joint", "Dynamics", through_joint),
    Case("dynamics-viscous-end", "Waves that leave at a viscous boundary", "Dynamics", viscous_end),
    Case("dynamics-layers", "Layered ground on rock under an earthquake", "Dynamics", layered),
]
