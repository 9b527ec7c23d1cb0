# SPDX-License-Identifier: MIT
"""Rocking of a slender block: period, onset, and the energy that impacts take (Housner 1963).

A block of width 2b and height 2h, R² = b² + h², tan a = b/h, tilted by q about a corner, moves by

    q'' = -p² sin(a - q)        p² = 3 g / (4 R)

Housner replaces the sine by its argument; a quarter of the period, from rest at q0 to the impact, then takes
acosh(1/(1 - q0/a))/p. Under a constant horizontal acceleration A the block lifts when A > g b/h. If the block does
not bounce, angular momentum about the new corner is kept, and an impact leaves the share r = (1 - 3/2 sin² a)² of the
energy.

Independent solutions without DDA: the equation above, integrated with its sine; and a rigid block on two elastic corner
springs, to which DDA must tend with small steps, since its contacts are such springs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE

from ..bracket import bracket, power_of_ten
from ..case import Case, Record

if TYPE_CHECKING:
    from rockdda.results import Results

FloatArray = npt.NDArray[np.float64]

HALF_WIDTH, HALF_HEIGHT = 0.5, 2.5  # b, h [m]
GRAVITY, DENSITY, FRICTION = 10.0, 2500.0, 70.0  # m/s², kg/m², degrees (nothing is to slide)
RADIUS = math.hypot(HALF_WIDTH, HALF_HEIGHT)
SLENDERNESS = math.atan2(HALF_WIDTH, HALF_HEIGHT)  # a
MASS = DENSITY * 4 * HALF_WIDTH * HALF_HEIGHT
RATE = math.sqrt(0.75 * GRAVITY / RADIUS)  # p
RESTITUTION = (1 - 1.5 * math.sin(SLENDERNESS) ** 2) ** 2  # r, of energy


def housner_period(share: float) -> float:
    """Of an amplitude q0 = share·a [s]."""
    return 4 / RATE * math.acosh(1 / (1 - share))


def period(share: float) -> float:
    """The same with the sine: from energy, dt = dq/(p √(2 (cos(a - q0) - cos(a - q)))), with q = q0 (1 - s²)."""
    start = share * SLENDERNESS
    nodes, weights = np.polynomial.legendre.leggauss(60)
    s = 0.5 * (nodes + 1)
    q = start * (1 - s**2)
    # cos(a - q0) - cos(a - q) as a product, which keeps its digits near q0
    fall = 2 * np.sin(SLENDERNESS - 0.5 * (q + start)) * np.sin(0.5 * (start - q))
    return float(4 * np.sum(0.5 * weights * 2 * start * s / np.sqrt(2 * fall)) / RATE)


def energy(tilt: float) -> float:
    """Of the block at rest at a tilt, over M g R: what it has more than upright."""
    return math.cos(SLENDERNESS - abs(tilt)) - math.cos(SLENDERNESS)


def on_springs(share: float, stiffness: float, end: float, dt: float) -> FloatArray:
    """Tilt of a rigid block on elastic corner springs after each step (velocity Verlet).

    A corner below ground has a normal spring and, from where it touched down, a shear spring of 1/2.5 of the stiffness.
    Springs that leave the ground are forgotten, friction limits the shear spring.
    """
    shear, mu = stiffness / 2.5, math.tan(math.radians(FRICTION))
    inertia = MASS / 3 * (HALF_WIDTH**2 + HALF_HEIGHT**2)
    tilt = share * SLENDERNESS
    c, s = math.cos(tilt), math.sin(tilt)
    x, y = -HALF_WIDTH * c + HALF_HEIGHT * s, HALF_WIDTH * s + HALF_HEIGHT * c
    speed_x = speed_y = spin = 0.0
    anchor: list[float | None] = [None, 0.0]
    force = (0.0, -GRAVITY, 0.0)
    tilts = np.empty(round(end / dt))
    for step in range(len(tilts)):
        speed_x += 0.5 * dt * force[0]
        speed_y += 0.5 * dt * force[1]
        spin += 0.5 * dt * force[2]
        x += dt * speed_x
        y += dt * speed_y
        tilt += dt * spin
        c, s = math.cos(tilt), math.sin(tilt)
        total_x = total_y = couple = 0.0
        for corner, along in ((0, -HALF_WIDTH), (1, HALF_WIDTH)):
            arm_x, arm_y = along * c - HALF_HEIGHT * s, -along * s - HALF_HEIGHT * c
            normal = -stiffness * (y + arm_y)
            if normal <= 0:
                anchor[corner] = None
                continue
            foot = x + arm_x
            origin = anchor[corner]
            if origin is None:
                origin = foot
            tangential = shear * (origin - foot)
            if abs(tangential) > mu * normal:
                tangential = math.copysign(mu * normal, tangential)
                origin = foot + tangential / shear
            anchor[corner] = origin
            total_x += tangential
            total_y += normal
            couple += arm_x * normal - arm_y * tangential
        force = (total_x / MASS, total_y / MASS - GRAVITY, -couple / inertia)
        speed_x += 0.5 * dt * force[0]
        speed_y += 0.5 * dt * force[1]
        spin += 0.5 * dt * force[2]
        tilts[step] = tilt
    return tilts


# -- DDA --


def block(tilt: float, stiffness: float, dt: float, end: float) -> Model:
    """A block on a fixed one, tilted clockwise about its right corner."""
    model = Model("rocking", e0=0.002, dt_max=dt, stiffness=stiffness, displacement_ratio=0.02, steps=round(end / dt))
    model.add_polygon([(-3, -1), (3, -1), (3, 0), (-3, 0)])
    c, s = math.cos(tilt), math.sin(tilt)
    corners = [(0.0, 0.0), (0.0, 2 * HALF_HEIGHT), (-2 * HALF_WIDTH, 2 * HALF_HEIGHT), (-2 * HALF_WIDTH, 0.0)]
    turned = [(HALF_WIDTH + x * c + y * s, -x * s + y * c) for x, y in corners]
    model.add_polygon(turned)
    for point in [(-2.9, -0.9), (2.9, -0.9), (-2.9, -0.1), (2.9, -0.1)]:
        model.add_fixed(point)
    model.add_measured(np.mean(turned, axis=0))
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=1e11, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=FRICTION)
    return model


@dataclass
class Rocking:
    """Tilt in time, from rest at share·a."""

    time: FloatArray
    tilt: FloatArray
    impacts: FloatArray  #: times at which the block is upright
    results: Results

    @property
    def restitution(self) -> float:
        """Energy at rest after the first impact over that at the start."""
        return energy(float(self.tilt.min())) / energy(float(self.tilt[0]))


def rock(record: Record, share: float, stiffness: float, dt: float, end: float) -> Rocking:
    name = f"q{share:g}-k{power_of_ten(stiffness)}-dt{dt:g}"
    start = share * SLENDERNESS
    results = record.run(block(start, stiffness, dt, end), name, save_every=max(1, round(end / dt)))
    time = np.append(0.0, results["history/time"])
    tilt = np.append(start, start - results["history/measured_rotation"][:, 0])
    return Rocking(time, tilt, _zeros(time, tilt), results)


def _zeros(time: FloatArray, tilt: FloatArray) -> FloatArray:
    before = np.flatnonzero(tilt[1:] * tilt[:-1] < 0)
    return time[before] + (time[before + 1] - time[before]) * tilt[before] / (tilt[before] - tilt[before + 1])


def swings(one: Rocking) -> list[tuple[float, float]]:
    """Amplitude over a and period: the first quarter, then each half between two impacts."""
    found = [(float(one.tilt[0]) / SLENDERNESS, 4 * float(one.impacts[0]))]
    for first, last in zip(one.impacts[:-1], one.impacts[1:], strict=True):
        within = (one.time >= first) & (one.time <= last)
        found.append((float(np.abs(one.tilt[within]).max()) / SLENDERNESS, 2 * float(last - first)))
    return found


def lifts(record: Record, acceleration: float, stiffness: float = 1e10, dt: float = 2e-3) -> bool:
    """Does the block lift under a horizontal acceleration that rises smoothly in 1 s and stays for 2 s?"""
    model = block(0.0, stiffness, dt, 3.0)
    time = np.linspace(0.0, 1.0, 51)
    rows = np.column_stack([time, acceleration * 0.5 * (1 - np.cos(np.pi * time)), 0 * time])
    model.base_acceleration = np.vstack([rows, [10.0, acceleration, 0.0]])
    results = record.run(model, f"onset-{acceleration:.6g}", save_every=model.steps)
    return bool(np.abs(results["history/measured_rotation"]).max() > 0.01 * SLENDERNESS)


def rocking(record: Record) -> None:
    record.text(
        f"A block of {2 * HALF_WIDTH:g} m × {2 * HALF_HEIGHT:g} m (b/h = {HALF_WIDTH / HALF_HEIGHT:g}) on a fixed "
        "one is tilted about a corner and let go. *Period:* Housner's formula and, with the sine that he makes "
        "linear, a quadrature. *Onset:* the base acceleration rises smoothly; has the block lifted by 1 % of a "
        "within 2 s? *Impact:* the energy left after it."
    )
    _periods(record)
    _onset(record)
    _impacts(record)
    record.energy_closes()


def _periods(record: Record) -> None:
    stiffness, dt = 1e10, 1e-3
    runs = {}
    for share in (0.2, 0.5, 0.8):
        end = 6.0 if record.full else 0.25 * period(share) + 0.05
        one = rock(record, share, stiffness, dt, end)
        record.compare(
            f"period at q0 = {share:g} a, from rest to the first impact, times four",
            4 * one.impacts[0],
            "s",
            truth=period(share),
            truth_source="quadrature of the rigid block's equation",
            published=housner_period(share),
            published_source="Housner (1963), linear in the angle",
            allowed=1e-3,
        )
        if share == 0.5:
            ledger = one.results.history()
            scale = MASS * GRAVITY * RADIUS * energy(share * SLENDERNESS)
            record.compare(
                "residual of the energy ledger over the energy of the tilt",
                float(ledger["energy_residual"].abs().max()) / scale,
                truth=0.0,
                truth_source="exact",
                scale=1.0,
                allowed=1e-8,
            )
        runs[share] = one
    if record.full:
        _figure_of_periods(record, runs)


def _onset(record: Record) -> None:
    truth = GRAVITY * HALF_WIDTH / HALF_HEIGHT
    found = bracket(lambda a: not lifts(record, a), 1.1 * truth, 0.9 * truth, 0.002 if record.full else 0.03)
    record.compare(
        "horizontal acceleration that lifts the block",
        found.middle,
        "m/s²",
        truth=truth,
        truth_source="g b/h",
        allowed=0.003 if record.full else 0.01,  # criterion (0.1 %) and width of the bracket
        explanation=f"bracket {found}",
    )


def _impacts(record: Record) -> None:
    share = 0.5
    end = 0.25 * period(share) + 0.75 * housner_period(0.5) / 2
    omega = math.sqrt(1 / MASS)
    hard = rock(record, share, 1e12, 2e-4 if record.full else 5e-4, end)
    record.compare(
        "share of energy left by the first impact, stiff contacts (g0 = 1e12 N/m, Ω > 1)",
        hard.restitution,
        truth=RESTITUTION,
        truth_source="Housner (1963): r = (1 - 3/2 sin² a)²",
        allowed=0.01,
    )
    if not record.full:
        return
    elastic = {}
    for stiffness, dt in ((1e8, 5e-5), (1e9, 1e-5)):
        tilts = on_springs(share, stiffness, end, dt)
        elastic[stiffness] = energy(float(tilts.min())) / energy(share * SLENDERNESS)
    soft = rock(record, share, 1e8, 2.5e-5, end)
    record.compare(
        "share of energy left by the first impact, soft contacts and small steps (g0 = 1e8 N/m, Ω = 0.002)",
        soft.restitution,
        truth=elastic[1e8],
        truth_source="rigid block on elastic corner springs (velocity Verlet)",
        allowed=0.01,
        explanation="with elastic corners the block bounces, and Housner's assumption does not hold",
    )
    rows = [(1e8, 2.5e-5, soft), (1e12, 2e-4, hard)]
    for stiffness in (1e8, 1e9, 1e10, 1e11, 1e12):
        for dt in (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3):
            if (stiffness, dt) != (1e12, 2e-4):
                rows.append((stiffness, dt, rock(record, share, stiffness, dt, end)))
    rows.sort(key=lambda row: row[:2])
    table = pandas.DataFrame(
        [
            {
                "g0 [N/m]": power_of_ten(stiffness),
                "dt [s]": dt,
                "Ω = √(g0/M) dt": math.sqrt(stiffness) * omega * dt,
                "error of T/4": one.impacts[0] / (0.25 * period(share)) - 1,
                "energy left": one.restitution,
                "over Housner's r": one.restitution / RESTITUTION,
            }
            for stiffness, dt, one in rows
        ]
    )
    record.table(table, "impacts", "First impact after release from q0 = a/2, against contact stiffness and time step.")
    record.text(
        "What a penalty contact makes of the impact depends on Ω. With Ω well below 1 the steps resolve the "
        "spring: the corners are elastic, the block bounces off them and keeps more energy than Housner allows; as "
        "dt → 0 DDA tends to the rigid block on elastic springs. With Ω above 1 the step in which the spring "
        "closes leaves anything between little and most of the approach velocity (see the case on momentum); the "
        "block touches down two or three times within 0.1 s, and then the impact was plastic: for small dt with Ω "
        "> 1 the loss is Housner's. With longer steps more is lost (4 % at 5 ms), as numerical dissipation of "
        "these touch-downs, says the energy ledger; before the impact the block keeps its energy to 0.3 %. So dt "
        "and g0 together choose the coefficient of restitution. A dashpot (`damping_ratio`) chooses it on purpose."
    )
    with record.style():
        import matplotlib.pyplot as plt

        figure, (left, right) = plt.subplots(1, 2, figsize=(6.3, 2.8), layout="constrained", width_ratios=(1, 1.25))
        for one, label, colour in ((hard, "g0 = 1e12 N/m", PALETTE[1]), (soft, "g0 = 1e8 N/m", PALETTE[2])):
            left.plot(one.time, one.tilt / SLENDERNESS, color=colour, label=label)
        level = _tilt_of(RESTITUTION * energy(share * SLENDERNESS)) / SLENDERNESS
        left.axhline(-level, color="black", linewidth=0.8, linestyle="--", label="Housner")
        left.set(xlabel="time [s]", ylabel="tilt q / a", ylim=(-0.6, 0.9))
        left.legend(loc="upper right")
        for n, stiffness in enumerate((1e8, 1e9, 1e10, 1e11, 1e12)):
            points = [(math.sqrt(k) * omega * dt, one.restitution) for k, dt, one in rows if k == stiffness]
            label = f"g0 = {power_of_ten(stiffness)} N/m"
            right.semilogx(*zip(*points, strict=True), "o-", ms=3, linewidth=0.8, color=PALETTE[n + 1], label=label)
            if stiffness in elastic:
                right.plot(1.3e-3, elastic[stiffness], ">", ms=5, color=PALETTE[n + 1], clip_on=False)
        right.axhline(RESTITUTION, color="black", linewidth=0.8, linestyle="--")
        right.annotate("Housner", (1.4e-3, RESTITUTION), va="bottom", fontsize=8)
        right.annotate("elastic springs", (1.6e-3, elastic[1e8] + 0.004), va="bottom", fontsize=8)
        right.set(xlabel="Ω = √(g0/M) dt", ylabel="energy left by an impact", xlim=(1.3e-3, 100), ylim=(0.83, 1.02))
        right.legend(loc="upper right", fontsize=7)
    record.figure(
        figure,
        "impacts",
        "Left: swing and first impact. Right: energy left by the first impact against Ω. Triangles: rigid block on "
        "elastic springs.",
    )


def _tilt_of(value: float) -> float:
    """The tilt with an energy."""
    return SLENDERNESS - math.acos(value + math.cos(SLENDERNESS))


def _figure_of_periods(record: Record, runs: dict[float, Rocking]) -> None:
    with record.style():
        import matplotlib.pyplot as plt

        figure, (left, right) = plt.subplots(1, 2, figsize=(6.3, 2.7), layout="constrained")
        shares = np.linspace(0.002, 0.95, 200)
        left.plot(shares, [RATE * housner_period(q) for q in shares], color=PALETTE[0], label="Housner")
        left.plot(shares, [RATE * period(q) for q in shares], color=PALETTE[2], linestyle="--", label="with the sine")
        for n, (share, one) in enumerate(runs.items()):
            found = np.array([swing for swing in swings(one) if swing[0] > 0.02])
            left.plot(found[:, 0], RATE * found[:, 1], "o", ms=3, color=PALETTE[1], label=None if n else "DDA")
            right.plot(one.time, one.tilt / SLENDERNESS, color=PALETTE[n + 1], label=f"q0 = {share:g} a")
        left.set(xlabel="amplitude q0 / a", ylabel="period p T", xlim=(0, 1), ylim=(0, 16))
        left.legend(loc="upper left")
        right.set(xlabel="time [s]", ylabel="tilt q / a", ylim=(-0.9, 1.5))
        right.legend(loc="upper right")
    record.figure(
        figure,
        "period",
        "Left: period against amplitude; dots: each half swing of three runs with DDA. Right: the runs (g0 = 1e10 "
        "N/m, dt = 1 ms).",
    )


CASES = [
    Case("closed-rocking", "Rocking of a slender block (Housner)", "Closed forms", rocking),
]
