# SPDX-License-Identifier: MIT
"""Momentum and restitution in collisions.

Two blocks meet head-on. Rigid blocks of reduced mass m on a spring k that acts while they overlap, integrated as DDA
does (Newmark, β = ½, γ = 1: d = x1 - x0, v1 = 2 d/Δt - v0), lose energy in the contact; Ω = Δt √(k/m). With Δt → 0 the
collision is elastic, or, with a dashpot of damping ratio z, has the coefficient of restitution exp(-π z/√(1 - z²)).

A cluster of spinning polygons falls freely and collides within itself. Its momentum is P0 - M g t whatever happens
inside, its centre of mass goes along a parabola, and its angular momentum changes in a step by exactly

    Δt Σ c × m g

c being the centroids at mid-step: forces between blocks act on the arms of mid-step, and their moments cancel.
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

from ..bracket import power_of_ten
from ..case import Case, Record

if TYPE_CHECKING:
    from rockdda.results import Results

FloatArray = npt.NDArray[np.float64]

DENSITY, GRAVITY = 2500.0, 10.0  # kg/m², m/s²
MASSES = (2500.0, 900.0)  # of squares of 1 m and 0.6 m
REDUCED = MASSES[0] * MASSES[1] / (MASSES[0] + MASSES[1])
SPEEDS = (0.3, -0.2)  # m/s
GAP = 0.0501  # m; no whole number of steps away


def head_on(stiffness: float, dt: float, damping: float) -> Model:
    """Two squares, the smaller one hit in the middle: two corners on an edge."""
    model = Model("impact", e0=0.002, dt_max=dt, stiffness=stiffness, displacement_ratio=0.05, steps=round(0.25 / dt))
    model.add_polygon([(-1, 0), (0, 0), (0, 1), (-1, 1)])
    model.add_polygon([(GAP, 0.2), (GAP + 0.6, 0.2), (GAP + 0.6, 0.8), (GAP, 0.8)])
    for n, x in enumerate((-0.5, GAP + 0.3)):
        model.add_material_line((x - 0.1, 0.5), (x + 0.1, 0.5), material=n + 1)
        model.add_block_material(
            density=DENSITY, gravity=0.0, youngs_modulus=1e14, poisson_ratio=0.0, velocity=(SPEEDS[n], 0.0, 0.0)
        )
    model.add_joint_material(friction_angle=30)
    if damping:
        model.options["joint_law"] = [{"material": 1, "law": "coulomb", "damping_ratio": damping}]
    return model


def rigid(stiffness: float, dt: float, damping: float) -> float:
    """Coefficient of restitution of two rigid blocks with two contacts, by the recurrence of the integrator."""
    spring = 2 * stiffness
    dashpot = 2 * damping * math.sqrt(spring * REDUCED)
    start = SPEEDS[1] - SPEEDS[0]
    gap, speed = GAP, start
    for _ in range(round(0.25 / dt)):
        change = speed * dt
        if gap + change < 0:
            load = 2 / dt * REDUCED * speed - spring * gap
            closed = load / (2 * REDUCED / dt**2 + spring + dashpot / dt)
            change = closed if gap + closed <= 0 else change
        speed = 2 * change / dt - speed
        gap += change
    return -speed / start


def restitution(results: Results) -> float:
    velocity = results.frames[-1].velocity[:, 0]
    return float((velocity[1] - velocity[0]) / (SPEEDS[0] - SPEEDS[1]))


def momentum_error(results: Results) -> float:
    """Change of momentum over that of one block at the start, largest component."""
    first, last = results.frames[0].velocity[:, :2], results.frames[-1].velocity[:, :2]
    mass = results.block_area * DENSITY
    return float(np.abs(mass @ (last - first)).max() / (MASSES[0] * SPEEDS[0]))


def with_dashpot(damping: float) -> float:
    """Closed form: the damping ratio is that of the two blocks on their contacts."""
    return math.exp(-math.pi * damping / math.sqrt(1 - damping**2))


# -- a cluster in free fall --

# corners, centre, radius of the circle through the corners, turned by; then velocities vx vy and spin
CLUSTER = (
    (4, (0.0, 0.0), 0.7, 0.3, (0.0, 0.0, 1.0)),
    (5, (1.5, 0.2), 0.6, 0.1, (-1.0, 0.0, -2.0)),
    (3, (0.6, 1.35), 0.6, 0.5, (0.0, -1.2, 3.0)),
    (6, (-1.3, 0.5), 0.5, 0.0, (1.2, -0.2, 0.0)),
    (4, (-0.4, -1.4), 0.55, 0.9, (0.3, 1.5, -1.0)),
    (5, (1.2, -1.2), 0.5, 0.7, (-0.6, 1.0, 0.5)),
)


def cluster(dt: float) -> Model:
    model = Model("cluster", e0=0.002, dt_max=dt, stiffness=1e8, displacement_ratio=0.1, steps=round(0.6 / dt))
    for n, (corners, centre, radius, turn, velocity) in enumerate(CLUSTER):
        angle = turn + 2 * np.pi * np.arange(corners) / corners
        model.add_polygon(np.array(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
        x, y = centre
        model.add_material_line((x - 0.05, y), (x + 0.05, y), material=n + 1)
        model.add_block_material(
            density=DENSITY, gravity=GRAVITY, youngs_modulus=1e10, poisson_ratio=0.2, velocity=velocity
        )
    model.add_joint_material(friction_angle=30)
    return model


def second_moments(polygon: FloatArray) -> tuple[float, float, float]:
    """∫x², ∫y², ∫xy about the centroid, over the area."""
    x, y = (polygon - polygon.mean(axis=0)).T
    x2, y2 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y2 - x2 * y
    area = cross.sum() / 2
    cx, cy = ((x + x2) * cross).sum() / 6 / area, ((y + y2) * cross).sum() / 6 / area
    xx = ((x * x + x * x2 + x2 * x2) * cross).sum() / 12 / area - cx**2
    yy = ((y * y + y * y2 + y2 * y2) * cross).sum() / 12 / area - cy**2
    xy = ((x * y2 + 2 * x * y + 2 * x2 * y2 + x2 * y) * cross).sum() / 24 / area - cx * cy
    return float(xx), float(yy), float(xy)


@dataclass
class Ledger:
    """Momenta of the cluster after each step."""

    time: FloatArray
    momentum: FloatArray  # (steps, 2)
    centre: FloatArray  # (steps, 2) of mass
    angular: FloatArray  # about the origin
    predicted: FloatArray  # the same by the sum of the terms above
    mass: float

    @property
    def momentum_error(self) -> float:
        """Over M g t at the end."""
        expected = self.momentum[0] - np.outer(self.time, (0.0, self.mass * GRAVITY))
        return float(np.abs(self.momentum - expected).max() / (self.mass * GRAVITY * self.time[-1]))

    @property
    def centre_error(self) -> float:
        """Distance from the parabola over the way fallen."""
        fall = 0.5 * GRAVITY * self.time**2
        expected = self.centre[0] + np.outer(self.time, self.momentum[0] / self.mass)
        expected[:, 1] -= fall
        return float(np.abs(self.centre - expected).max() / fall[-1])

    @property
    def about_centre(self) -> FloatArray:
        """Angular momentum about the centre of mass, which would be constant."""
        x, y = self.centre.T
        return self.angular - (x * self.momentum[:, 1] - y * self.momentum[:, 0])


def ledger_of(results: Results) -> Ledger:
    mass = results.block_area * DENSITY
    time, velocity, place = (results[f"frames/{name}"] for name in ("time", "velocity", "centroid"))
    spin = np.zeros(len(time))
    for n, polygons in enumerate(results["frames/vertices"]):
        for m, polygon, rate in zip(mass, np.split(polygons, results.vertex_offset[1:-1]), velocity[n], strict=True):
            xx, yy, xy = second_moments(polygon)
            spin[n] += m * ((xx + yy) * rate[2] + xy * (rate[4] - rate[3]) + 0.5 * (xx - yy) * rate[5])
    angular = _cross(place, velocity) @ mass + spin
    dt = np.diff(time)
    # forces act on the arms of mid-step: those between blocks cancel, and the weight has the moment of the mean place
    change = -dt * GRAVITY * (0.5 * (place[:-1, :, 0] + place[1:, :, 0]) @ mass)
    return Ledger(
        time=time,
        momentum=np.einsum("nbi,b->ni", velocity[..., :2], mass),
        centre=np.einsum("nbi,b->ni", place, mass) / mass.sum(),
        angular=angular,
        predicted=angular[0] + np.append(0.0, np.cumsum(change)),
        mass=float(mass.sum()),
    )


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def momentum(record: Record) -> None:
    record.text(
        "Two squares (1 m and 0.6 m, practically rigid) meet head-on at 0.5 m/s, two corners on an edge. Truth: "
        "the recurrence of the integrator for two rigid blocks, and its limit for Δt → 0."
    )
    _collisions(record)
    record.text(
        "Six spinning polygons (E = 1e10 Pa, friction 30°) fall freely for 0.6 s and collide on the way. Momentum, "
        "the path of the centre of mass and the change of angular momentum in every step are compared with what "
        "theory says exactly."
    )
    _cluster(record)
    record.energy_closes()


def _collisions(record: Record) -> None:
    settings = [(1e8, 1e-4, 0.0), (1e8, 1e-3, 0.0), (1e8, 3e-3, 0.0), (1e8, 1e-4, 0.1), (1e8, 1e-4, 0.3)]
    if record.full:
        settings += [(1e8, dt, 0.0) for dt in (1e-5, 3e-5, 3e-4)] + [(1e9, dt, 0.0) for dt in (1e-4, 1e-3, 5e-3)]
        settings += [(1e8, 1e-5, z) for z in (0.1, 0.2, 0.3)]
    rows, worst, lost = [], (0.0, 0.0, 0.0), 0.0
    for stiffness, dt, damping in sorted(settings):
        name = f"k{power_of_ten(stiffness)}-dt{dt:g}-z{damping:g}"
        results = record.run(head_on(stiffness, dt, damping), name, save_every=round(0.25 / dt))
        computed, truth = restitution(results), rigid(stiffness, dt, damping)
        lost = max(lost, momentum_error(results))
        worst = max(worst, (abs(computed / truth - 1), computed, truth))
        rows.append(
            {
                "g0 [N/m]": power_of_ten(stiffness),
                "dt [s]": dt,
                "Ω": dt * math.sqrt(2 * stiffness / REDUCED),
                "damping ratio": damping,
                "restitution with DDA": computed,
                "rigid blocks, same steps": truth,
                "relative difference": computed / truth - 1,
                "Δt → 0": with_dashpot(damping),
            }
        )
    record.compare(
        "coefficient of restitution that differs most",
        worst[1],
        truth=worst[2],
        truth_source="two rigid blocks, recurrence of the integrator",
        allowed=1e-5,  # the blocks have E = 1e14 Pa, which adds 1e-6 to the compliance of the contacts
    )
    record.compare(
        "momentum lost in a head-on collision, over that of one block",
        lost,
        truth=0.0,
        truth_source="exact",
        scale=1.0,
        allowed=1e-9,  # round-off and tolerance of the solver over 25000 steps
    )
    if record.full:
        for damping in (0.0, 0.1, 0.3):
            row = next(row for row in rows if row["dt [s]"] == 1e-5 and row["damping ratio"] == damping)
            record.compare(
                f"coefficient of restitution, damping ratio {damping:g}, dt = 1e-5 s",
                float(row["restitution with DDA"]),
                truth=with_dashpot(damping),
                truth_source="closed form, Δt → 0",
                allowed=0.005,
                explanation="the integrator's own damping, Ω/4 = 0.0014",
            )
    record.table(
        pandas.DataFrame(rows),
        "restitution",
        "Coefficient of restitution. The integrator damps a contact by itself: at Ω = Δt √(2 g0/m) = 1 more than "
        "half of the approach velocity is gone, and beyond Ω = 3 what comes out depends on where in a step the "
        "blocks meet.",
    )
    with record.style():
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        omega = np.logspace(-2.4, 0.9, 150)
        unit = math.sqrt(2 * 1e8 / REDUCED)
        axes.semilogx(
            omega, [rigid(1e8, w / unit, 0.0) for w in omega], color=PALETTE[0], linewidth=0.8, label="rigid blocks"
        )
        axes.semilogx(
            omega, np.exp(-np.pi * omega / 4), "--", color=PALETTE[2], linewidth=0.8, label="exp(-πΩ/4), small Ω"
        )
        points = [(row["Ω"], row["restitution with DDA"]) for row in rows if row["damping ratio"] == 0]
        axes.semilogx(*zip(*points, strict=True), "o", ms=4, color=PALETTE[1], label="DDA")
        axes.set(xlabel="Ω = Δt √(2 g0/m)", ylabel="coefficient of restitution", ylim=(-0.05, 1.08))
        axes.legend(loc="lower left")
    record.figure(
        figure,
        "restitution",
        "Restitution without dashpot. Jagged beyond Ω = 1: it depends on where in a step the blocks meet.",
    )


def _cluster(record: Record) -> None:
    steps = (2e-3, 1e-3, 5e-4, 2.5e-4) if record.full else (2e-3,)
    rows, ledgers = [], {}
    for dt in steps:
        results = record.run(cluster(dt), f"cluster-dt{dt:g}", save_every=1)
        one = ledgers[dt] = ledger_of(results)
        about = one.about_centre
        rows.append(
            {
                "dt [s]": dt,
                "steps with a closed contact": int((results["history/contacts"][:, 1:].sum(axis=1) > 0).sum()),
                "momentum": one.momentum_error,
                "centre of mass": one.centre_error,
                "angular momentum, against prediction": np.abs(one.angular - one.predicted).max() / abs(about[0]),
                "angular momentum, against constant": np.abs(about - about[0]).max() / abs(about[0]),
            }
        )
    table = pandas.DataFrame(rows)
    record.table(
        table,
        "cluster",
        "Largest relative errors over 0.6 s. Angular momentum is that about the centre of mass; "
        "its prediction is the moment of the weight at mid-step.",
    )
    for column, what, allowed in (
        # round-off; the solver is direct
        ("momentum", "momentum of the cluster, over M g t", 1e-10),
        ("centre of mass", "distance of the centre of mass from its parabola, over the way fallen", 1e-10),
        # arms are those of mid-step to second order in the change of the motion within a step
        ("angular momentum, against prediction", "angular momentum less what theory predicts, over its start", 1e-5),
    ):
        record.compare(
            what + ": largest error",
            float(table[column].max()),
            truth=0.0,
            truth_source="exact",
            scale=1.0,
            allowed=allowed,
        )
    last = rows[-1]
    record.compare(
        f"angular momentum about the centre of mass, dt = {last['dt [s]']:g} s: largest change over its start",
        float(last["angular momentum, against constant"]),
        truth=0.0,
        truth_source="constant",
        scale=1.0,
        allowed=1e-5,
        explanation="forces act on the arms of mid-step",
    )
    with record.style():
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(figsize=(4.6, 2.8), layout="constrained")
        for n, (dt, one) in enumerate(ledgers.items()):
            about = one.about_centre
            centre = one.centre
            x, y = centre.T
            predicted = one.predicted - (x * one.momentum[:, 1] - y * one.momentum[:, 0])
            label = f"dt = {1e3 * dt:g} ms"
            axes.plot(one.time, 100 * (about / about[0] - 1), color=PALETTE[n + 1], linewidth=1.0, label=label)
            some = slice(0, None, max(1, len(one.time) // 20))
            axes.plot(
                one.time[some], 100 * (predicted[some] / about[0] - 1), "k.", ms=3, label=None if n else "predicted"
            )
        axes.set(xlabel="time [s]", ylabel="change of angular momentum [%]")
        axes.legend(loc="best")
    record.figure(
        figure,
        "angular",
        "Angular momentum of the cluster about its centre of mass; dots: what the moment of the weight gives.",
    )


CASES = [
    Case("closed-momentum", "Momentum and restitution in collisions", "Closed forms", momentum),
]
