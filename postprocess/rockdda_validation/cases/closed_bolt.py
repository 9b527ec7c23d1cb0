# SPDX-License-Identifier: MIT
"""A block on a bolt: free vibration, damping by the integrator, weight on a pretensioned bolt, yield."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..integrator import fit_recurrence, numerical_decay, numerical_frequency, roots_of_step

MASS, STIFFNESS, SPEED = 2500.0, 1e6, 0.1  # kg, N/m, m/s
OMEGA = math.sqrt(STIFFNESS / MASS)
WEIGHT, PRETENSION = MASS * 9.81, 10e3
STRENGTH = 3e3  # N; without yield the bolt would carry SPEED √(STIFFNESS MASS) = 5 kN


def hung(dt: float, steps: int, *, speed: float = 0.0, weight: float = 0.0, **bolt: float) -> Model:
    """A block of 1 m × 1 m below a fixed one, with a bolt from its centre; velocities are downward."""
    model = Model("bolt", e0=0.001, steps=steps, dt_max=dt, displacement_ratio=0.2)
    model.add_polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    model.add_polygon([(0, 3), (1, 3), (1, 4), (0, 4)])
    model.add_fixed((0.1, 3.5))
    model.add_fixed((0.9, 3.5))
    model.add_bolt((0.5, 0.5), (0.5, 3.5), stiffness=STIFFNESS, **bolt)
    model.add_measured((0.5, 0.5))
    model.add_block_material(density=MASS, weight=0, youngs_modulus=1e10, poisson_ratio=0.2)
    model.add_block_material(
        density=MASS, weight=weight, youngs_modulus=1e10, poisson_ratio=0.2, velocity=(0.0, -speed, 0.0)
    )
    model.add_material_line((0.1, 0.5), (0.9, 0.5), material=2)
    model.add_joint_material(friction_angle=30)
    model.options = {"contact": {"stiffness": 1e11}}  # of the anchor: 100 times that
    return model


def bolt(record: Record) -> None:
    """All four."""
    record.text(
        f"""
A block of m = {MASS:g} kg hangs on a bolt of stiffness s = {STIFFNESS:g} N/m between its centre and that of a fixed
block.

**Free vibration.** Without weight and with a speed along the bolt it vibrates with ω = √(s/m) = {OMEGA:g}/s. The
integrator (Newmark, β = ½, γ = 1) multiplies the amplitude by (1 + Ω²/2)^(-½) a step, Ω = ω·dt, and the phase of a step
is arccos[(4 - Ω²)/(2√(2(2 + Ω²)))], as long as Ω < 4; beyond, the roots of a step are real and negative. Both are read
from the motion by fitting x(n+1) = a·x(n) + b·x(n-1). As dt goes to 0 the frequency becomes the true one.
"""
    )
    vibration(record)
    hanging(record)
    yielding(record)
    record.energy_closes()


def vibration(record: Record) -> None:
    """Decay and frequency against Ω."""
    sweep = (
        (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 3.7, 4.5, 6.0, 10.0) if record.full else (0.05, 0.5, 2.0, 6.0)
    )
    rows = []
    for omega_dt in sweep:
        model = hung(omega_dt / OMEGA, 12 if omega_dt > 3 else 60, speed=SPEED)
        motion = record.run(model, f"free-{omega_dt:g}")["history/measured_displacement"][:, 0, 1]
        first, _ = fit_recurrence(np.concatenate([[0.0], motion]))
        expected, _ = roots_of_step(omega_dt)
        phase = abs(cmath.phase(first)) / omega_dt if omega_dt < 4 else math.nan
        theory = numerical_frequency(omega_dt) if omega_dt < 4 else math.nan
        rows.append([omega_dt, abs(first), numerical_decay(omega_dt), phase, theory, abs(first - expected)])
    names = ["Ω", "decay a step", "theory", "frequency / ω", "theory ", "difference of the root"]
    frame = pandas.DataFrame(rows, columns=names)
    record.table(frame, "decay", "Decay and frequency of the free vibration against Ω = ω·dt.")
    worst = max(rows, key=lambda row: row[-1])
    record.compare(
        f"root of a step, all Ω, the worst: Ω = {worst[0]:g}",
        worst[1],
        truth=worst[2],
        truth_source="root of Newmark's step",
        allowed=1e-6,  # the anchor gives way by 5e-8 of the bolt; the rest is round-off
    )
    record.compare(
        f"frequency, Ω = {rows[0][0]:g}",
        rows[0][3] * OMEGA / (2 * math.pi),
        "Hz",
        truth=OMEGA / (2 * math.pi),
        truth_source="√(s/m)/2π",
        allowed=rows[0][0] ** 2,  # the integrator's 5/24 Ω² and some room
    )
    draw(record, frame)


def draw(record: Record, frame: pandas.DataFrame) -> None:
    """Decay and frequency over Ω."""
    from matplotlib import pyplot as plt

    omega_dt = np.geomspace(0.02, 10, 400)
    below = omega_dt[omega_dt < 4]
    with record.style():
        fig, (left, right) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.5))
        left.semilogx(omega_dt, [numerical_decay(w) for w in omega_dt], color=PALETTE[0], lw=1, label="theory")
        left.semilogx(frame["Ω"], frame["decay a step"], "o", ms=4, color=PALETTE[1], label="RockDDA")
        left.set(xlabel="Ω = ω·dt", ylabel="amplitude after a step / before", ylim=(0, 1.05))
        left.legend()
        right.semilogx(below, [numerical_frequency(w) for w in below], color=PALETTE[0], lw=1)
        right.semilogx(frame["Ω"], frame["frequency / ω"], "o", ms=4, color=PALETTE[1])
        right.set(xlabel="Ω = ω·dt", ylabel="frequency / √(s/m)", ylim=(0, 1.05))
        fig.tight_layout()
        record.figure(
            fig, "decay", "Free vibration of a block on a bolt: decay and frequency. Beyond Ω = 4 it alternates."
        )


def hanging(record: Record) -> None:
    """Weight on a bolt with pretension, static."""
    model = hung(0.2, 200 if record.full else 100, weight=WEIGHT, pretension=PRETENSION)
    model.k01 = 0.0
    motion = record.run(model, "hanging")["history/measured_displacement"][:, 0, 1]
    record.text(
        f"**Weight.** The block of W = {WEIGHT:g} N hangs at rest on a bolt with a pretension of {PRETENSION:g} N: "
        "it sinks by (W - N0)/s."
    )
    record.compare(
        "settlement on the pretensioned bolt",
        -motion[-1],
        "m",
        truth=(WEIGHT - PRETENSION) / STIFFNESS,
        truth_source="equilibrium",
        allowed=1e-6,
    )


def yielding(record: Record) -> None:
    """A bolt that yields: how far the block gets, and what stays."""
    elastic = STRENGTH / STIFFNESS
    plastic = (0.5 * MASS * SPEED**2 - 0.5 * STIFFNESS * elastic**2) / STRENGTH
    turn = elastic + plastic
    record.text(
        f"""
**Yield.** With a strength of Y = {STRENGTH:g} N the bolt yields before the block stops. Energy gives the farthest point
Y/s + (½mv² - ½Y²/s)/Y; from there on the block vibrates about the plastic elongation (½mv² - ½Y²/s)/Y. The force of a
step is that at its end: while it grows, the block is held back half a step too early, and both fall short by v·dt/2.
"""
    )
    rows = []
    for dt in (4e-3, 2e-3, 1e-3, 5e-4) if record.full else (2e-3, 1e-3):
        model = hung(dt, round(0.6 / dt), speed=SPEED, strength=STRENGTH)
        motion = -record.run(model, f"yield-{1e6 * dt:.0f}")["history/measured_displacement"][:, 0, 1]
        # the centre of the vibration that follows, which decays: x(n+1) - c = a (x(n) - c) + b (x(n-1) - c)
        after = motion[np.argmax(motion) + 2 :]
        columns = np.column_stack([after[1:-1], after[:-2], np.ones(len(after) - 2)])
        (a, b, c), *_ = np.linalg.lstsq(columns, after[2:], rcond=None)
        rows.append([dt, motion.max(), motion.max() / turn - 1, c / (1 - a - b), c / (1 - a - b) / plastic - 1])
    names = ["dt [s]", "farthest point [m]", "error", "plastic elongation [m]", "error "]
    record.table(pandas.DataFrame(rows, columns=names), "yield", "A bolt that yields, for time steps.")
    for column, quantity, truth in ((1, "farthest point with yield", turn), (3, "plastic elongation", plastic)):
        record.compare(
            f"{quantity}, dt = 0.001 s",
            next(row[column] for row in rows if row[0] == 1e-3),
            "m",
            truth=truth,
            truth_source="energy",
            allowed=SPEED * 1e-3 / truth,  # the force of a step is that at its end: half a step's way, and some room
        )


CASES = [Case("closed-bolt", "Block on a bolt: vibration, weight, yield", "Closed forms", bolt)]
