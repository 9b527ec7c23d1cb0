# SPDX-License-Identifier: MIT
"""Waves in a bar of blocks: speed, dispersion and damping, and the collision of two bars."""

from __future__ import annotations

import cmath
import math

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..integrator import fit_recurrence, numerical_decay, numerical_frequency, roots_of_step

FloatArray = npt.NDArray[np.float64]
N = 20  # blocks of a bar, 1 m × 1 m, 1 m thick
DENSITY, MODULUS = 2500.0, 1e10  # kg/m3, Pa; ν = 0
SPEED_OF_SOUND = math.sqrt(MODULUS / DENSITY)
KICK = 0.1  # m/s


def bar(blocks: int, ratio: float, dt: float, steps: int) -> Model:
    """A free bar of bonded blocks; ratio: stiffness of a joint (two springs) over E A/h of a block."""
    model = Model("bar", e0=0.001, steps=steps, dt_max=dt, displacement_ratio=0.1)
    model.add_polygon([(0, 0), (blocks, 0), (blocks, 1), (0, 1)])
    for x in range(1, blocks):
        model.add_line((x, 0), (x, 1), joint=1 if x != N else 2)
    model.add_joint_material(friction_angle=30, cohesion=1e12, tension=1e12)
    model.add_joint_material(friction_angle=0)
    model.options = {"contact": {"stiffness": ratio * MODULUS / 2}}
    return model


def material(model: Model, speed: float) -> int:
    """A block material with a speed along the bar."""
    return model.add_block_material(
        density=DENSITY, weight=0.0, youngs_modulus=MODULUS, poisson_ratio=0.0, velocity=(speed, 0.0, 0.0)
    )


def modes(ratio: float, wave_number: float) -> tuple[float, FloatArray]:
    """Lower frequency of a chain of strained blocks on springs, and its shape (displacement, strain).

    With u = U cos κ(i+½) and e = -V sin κ(i+½) a joint opens by 2 U sin κ/2 - V h cos κ/2 (up to the sign), so that
    the energies are those of two degrees of freedom: inertia m and m h²/12, stiffness as below.
    """
    joint, block = ratio * MODULUS, MODULUS
    s, c = 2 * math.sin(wave_number / 2), math.cos(wave_number / 2)
    mass = np.array([DENSITY, DENSITY / 12])
    stiffness = np.array([[joint * s * s, -joint * s * c], [-joint * s * c, block + joint * c * c]])
    scale = 1 / np.sqrt(mass)
    squares, vectors = np.linalg.eigh(stiffness * np.outer(scale, scale))
    return float(np.sqrt(max(squares[0], 0.0))), vectors[:, 0] * scale


def waves(record: Record) -> None:
    """All wave lengths at once: the first block is kicked, and each mode is followed by itself."""
    record.text(
        f"""
**Waves.** A free bar of {N} blocks of 1 m (ρ = {DENSITY:g} kg/m³, E = {MODULUS:g} Pa, ν = 0, c = √(E/ρ) =
{SPEED_OF_SOUND:g} m/s) is glued at its joints; its first block is kicked. A continuous bar carries all waves with c.
A chain of blocks with one strain each (inertia m and m h²/12) on joints of stiffness β·EA/h has a lower frequency for
each wave number κ = π j/{N}, the root of

    det | 4 β sin²(κ/2) - m ω² h/EA        -2 β sin(κ/2) cos(κ/2)               |
        | -2 β sin(κ/2) cos(κ/2)           1 + β cos²(κ/2) - m ω² h/(12 EA)     |  =  0

and the speed c/√(1 + 1/β) for long waves; the integrator then changes frequency and amplitude as it does those of any
oscillator (as for the bolt, with Ω = ω·dt). Displacements and strains of all blocks are projected on each mode, and
frequency and decay are read from it.
"""
    )
    cases = [(10.0, 0.05), (10.0, 0.5)]
    if record.full:
        cases = [(1.0, 0.05), (10.0, 0.05), (100.0, 0.05), (10.0, 0.5), (10.0, 2.0)]
    rows, curves = [], []
    for ratio, courant in cases:
        dt = courant / SPEED_OF_SOUND
        model = bar(N, ratio, dt, 200)
        for block in range(N):
            model.add_measured((block + 0.5, 0.5))
            model.add_material_line((block + 0.2, 0.5), (block + 0.8, 0.5), material=min(block, 1) + 1)
        material(model, KICK)
        material(model, 0.0)
        results = record.run(model, f"wave-{ratio:g}-{courant:g}")
        moved = results["history/measured_displacement"][:, :, 0]
        strain = results["history/measured_stress"][:, :, 0] / MODULUS
        middle = np.arange(N) + 0.5
        points = []
        for j in range(1, N):
            kappa = math.pi * j / N
            omega, (u, v) = modes(ratio, kappa)
            motion = DENSITY * u * (moved @ np.cos(kappa * middle))
            motion -= DENSITY / 12 * v * (strain @ np.sin(kappa * middle))
            first, _ = fit_recurrence(np.concatenate([[0.0], motion]))
            expected, _ = roots_of_step(omega * dt)
            phase = abs(cmath.phase(first)) / dt / kappa / SPEED_OF_SOUND if omega * dt < 4 else math.nan
            points.append((kappa / math.pi, phase, abs(first), abs(first - expected) / abs(1 - expected)))
        found = np.array(points)
        curves.append((ratio, courant, found))
        long_waves = 1 / math.sqrt(1 + 1 / ratio)
        rows.append([ratio, courant, found[0, 1], long_waves, found[-1, 1], found[:, 3].max()])
    names = ["β", "c·dt/h", "speed of the longest wave / c", "1/√(1 + 1/β)", "speed of the shortest / c"]
    names.append("largest difference of a root")
    record.table(pandas.DataFrame(rows, columns=names), "waves", "Speeds of waves for joints and time steps.")
    draw_waves(record, curves)
    worst = max(rows, key=lambda row: row[-1])
    record.compare(
        f"roots of all modes, their difference from theory over that from 1, the worst (β = {worst[0]:g}, "
        f"c·dt/h = {worst[1]:g})",
        worst[-1],
        truth=0.0,
        truth_source="dispersion of the chain, and root of Newmark's step",
        scale=1,
        allowed=1e-3,  # strains are up to 5e-5 and move the frequencies of the stiffest modes by their size
    )
    stiff = max(rows, key=lambda row: row[0] - row[1])
    record.compare(
        f"speed of the longest wave, β = {stiff[0]:g}, c·dt/h = {stiff[1]:g}",
        stiff[2] * SPEED_OF_SOUND,
        "m/s",
        truth=SPEED_OF_SOUND,
        truth_source="√(E/ρ)",
        allowed=1.2 * (0.5 / stiff[0] + (math.pi / N) ** 2 / 24),
        explanation="joints add 1/β to the compliance of the blocks: -1/2β of the speed",
    )


def draw_waves(record: Record, curves: list[tuple[float, float, FloatArray]]) -> None:
    """Speed and decay over the wave number."""
    from matplotlib import pyplot as plt

    kappa = np.linspace(0.01, 0.999 * math.pi, 200)
    with record.style():
        fig, (left, right) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 3.2))
        for color, (ratio, courant, found) in zip(PALETTE[1:], curves, strict=False):
            omega_dt = np.array([modes(ratio, k)[0] * courant / SPEED_OF_SOUND for k in kappa])
            shown = omega_dt < 3.99
            speed = [
                numerical_frequency(w) * w / courant / k for w, k in zip(omega_dt[shown], kappa[shown], strict=True)
            ]
            left.plot(kappa[shown] / math.pi, speed, color=color, lw=1)
            left.plot(found[:, 0], found[:, 1], "o", ms=3.5, color=color, label=f"β = {ratio:g}, c·dt/h = {courant:g}")
            right.plot(kappa / math.pi, [numerical_decay(w) for w in omega_dt], color=color, lw=1)
            right.plot(found[:, 0], found[:, 2], "o", ms=3.5, color=color)
        left.set(xlabel="wave number κ/π (1: two blocks a wave)", ylabel="phase speed / c", ylim=(0, 1.3))
        left.axhline(1, color="0.6", lw=0.8, ls="--", zorder=0)
        right.set(xlabel="wave number κ/π", ylabel="amplitude after a step / before", ylim=(0, 1.05))
        fig.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        fig.tight_layout(rect=(0, 0.14, 1, 1))
        record.figure(
            fig,
            "waves",
            "Phase speed and decay of the waves in the bar: dots RockDDA, lines theory (no speed beyond Ω = 4).",
        )


def chain(ratio: float, end: float) -> tuple[FloatArray, FloatArray, float]:
    """Independent: half of the collision, a bar on a rigid wall, by central differences with a tiny step.

    Returns times, force in the collision, and mean speed at the end. The wall is the plane of symmetry: of the joint
    between the bars each bar has half, which is twice as stiff.
    """
    joint = ratio * MODULUS
    dt = 0.05 * math.sqrt(DENSITY / (12 * (MODULUS + 2 * joint)))
    u, e = np.zeros(N), np.zeros(N)
    v, w = np.full(N, KICK), np.zeros(N)
    times, forces = [], []
    for step in range(round(end / dt)):
        right, left = u + e / 2, u - e / 2
        pull = joint * (left[1:] - right[:-1])
        push = max(2 * joint * right[-1], 0.0)
        face = np.concatenate([[0.0], pull, [-push]])
        v = v + dt * (face[1:] - face[:-1]) / DENSITY
        w = w + dt * 12 * (0.5 * (face[1:] + face[:-1]) - MODULUS * e) / DENSITY
        u, e = u + dt * v, e + dt * w
        times.append(step * dt)
        forces.append(push)
    return np.array(times), np.array(forces), float(v.mean())


def collision(record: Record) -> None:
    """Two equal bars meet."""
    ratio, length = 10.0, float(N)
    duration, plateau = 2 * length / SPEED_OF_SOUND, DENSITY * SPEED_OF_SOUND * KICK
    end = 1.5 * duration
    record.text(
        f"""
**Collision.** Two such bars (β = {ratio:g}) meet end to end with {KICK:g} m/s each. Continuous bars would press on each
other with ρ c v A for 2L/c and part with the speeds that they came with. The blocks' own truth is that of the chain: a
bar of springs, masses and strains against a rigid wall in the plane of symmetry, integrated in Python by central
differences with 1/40 of its stability limit. It keeps some energy as vibration, so that it comes back a little slower.
The integrator damps these vibrations; with shorter steps the result of RockDDA approaches that of the chain.
"""
    )
    times, forces, back = chain(ratio, end)
    expected = float(np.trapezoid(forces, times))
    apart = float(times[np.flatnonzero(forces)[-1]])
    rows, curves = [], []
    for courant in (0.8, 0.4, 0.2, 0.1, 0.05) if record.full else (0.2,):
        dt = courant / SPEED_OF_SOUND
        model = bar(2 * N, ratio, dt, round(end / dt))
        model.add_material_line((0.2, 0.5), (N - 0.2, 0.5), material=1)
        model.add_material_line((N + 0.2, 0.5), (2 * N - 0.2, 0.5), material=2)
        material(model, KICK)
        material(model, -KICK)
        model.options["run"] = {"save_every": 1}
        results = record.run(model, f"collision-{courant:g}")
        time = results.times[1:]
        offset = results["frames/contact_offset"][1:]
        between = np.abs(results["frames/contact_point"][:, 0] - N) < 0.3
        total = np.concatenate([[0.0], np.cumsum(between * np.abs(results["frames/contact_force"][:, 0]))])
        force = np.diff(total[offset])
        velocity = results.frames[-1].velocity
        closed = float(time[np.flatnonzero(force > 1e-6 * plateau)[-1]])
        left = results.block_centroid[:, 0] < N
        rows.append([courant, closed, force.sum() * dt, -velocity[left, 0].mean()])
        curves.append((courant, time, force))
    shown = [*rows, ["chain", apart, expected, -back], ["continuous bars", duration, plateau * duration, KICK]]
    frame = pandas.DataFrame(shown, columns=["c·dt/h", "in contact [s]", "impulse [Ns]", "speed after [m/s]"])
    record.table(frame, "collision", "Collision of two bars: time steps, chain and continuum.")
    draw_collision(record, curves[-1], (times, forces), plateau, duration)
    row = rows[-1]
    for column, quantity, unit, truth in (
        (1, "time in contact", "s", apart),
        (2, "impulse of the collision", "Ns", expected),
        (3, "speed after the collision", "m/s", -back),
    ):
        record.compare(
            f"{quantity}, c·dt/h = {row[0]:g}",
            row[column],
            unit,
            truth=truth,
            truth_source="chain",
            # the front is the worst for an integrator that damps: the loss falls by 0.6 when the step is halved
            allowed=0.02 if record.full else 0.06,
            explanation="the integrator damps the short waves of the front" if column > 1 else "",
        )
    record.compare(
        "impulse of the collision against that of continuous bars",
        row[2],
        "Ns",
        truth=plateau * duration,
        truth_source="ρ c v A · 2L/c",
        allowed=0.05,  # the joints' compliance takes part of the energy as vibrations
    )


def draw_collision(
    record: Record,
    computed: tuple[float, FloatArray, FloatArray],
    expected: tuple[FloatArray, FloatArray],
    plateau: float,
    duration: float,
) -> None:
    """Force in time."""
    from matplotlib import pyplot as plt

    with record.style():
        fig, axes = plt.subplots(figsize=(PAPER_WIDTH, 2.4))
        axes.plot([0, 0, duration, duration], [0, plateau / 1e3, plateau / 1e3, 0], "--", color="0.6", lw=1)
        axes.plot(expected[0], expected[1] / 1e3, color=PALETTE[0], lw=2, alpha=0.4, label="chain")
        axes.plot(computed[1], computed[2] / 1e3, color=PALETTE[1], lw=1, label=f"RockDDA, c·dt/h = {computed[0]:g}")
        axes.set(xlabel="time [s]", ylabel="force between the bars [kN]")
        axes.legend(loc="upper right")
        record.figure(fig, "collision", "Force between the bars; dashed: continuous bars.")


def waves_and_collision(record: Record) -> None:
    """Both."""
    waves(record)
    collision(record)
    record.energy_closes(1e-8)


CASES = [
    Case("closed-bar", "Waves in a bar of blocks, and the collision of two bars", "Closed forms", waves_and_collision)
]
