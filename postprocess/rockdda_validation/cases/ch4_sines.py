# SPDX-License-Identifier: MIT
"""§4.2 of the thesis: a block on an incline at its friction angle, under a horizontal motion of three sines.

The truth is Eq. 4.2, the horizontal displacement (along the slope it is 1/cos α of that). The block never comes to rest
for longer than an instant, so that it holds throughout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.errors import RockddaError
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results

from ..case import Case, Record, published

FloatArray = npt.NDArray[np.float64]
PUBLISHED = published("chapter4")["three_sines"]
SENSITIVITY = published("chapter4")["sensitivity"]
SOURCE = PUBLISHED["source"]
GRAVITY = 9.81
ANGLE = np.radians(PUBLISHED["inclination"])
AMPLITUDE = np.array(PUBLISHED["amplitude"]) * GRAVITY
SETS = [np.array(omega) * np.pi for omega in PUBLISHED["omega"]]
STIFFNESS = PUBLISHED["contact_stiffness"]
SHEAR_RATIO = 2.5
LENGTH, HEIGHT = 1.0, 0.5  # of the block; not given
DURATION = 5.0  # not given; that of the shaking table
REST = 100  # least number of steps at rest before the motion, k01 = 0
SETTLED = 1e-8  # share of the shear force that may still be missing when the motion begins
SECOND_SET = 1


def three_sines(record: Record) -> None:
    """Error norms of the three sets, what the start does, and the sweeps of Fig. 4.2."""
    record.text(
        f"A block ({LENGTH} m × {HEIGHT} m: the thesis gives no size) on an incline of 15° with a friction angle of "
        "15° slides under a(t) = Σ aᵢ sin ωᵢt. The truth is Eq. 4.2. It is the *horizontal* displacement; along the "
        "slope the block moves 1/cos α as far. Each set is run twice: *as in the thesis*, where weight and motion "
        "begin together with the springs still unloaded, and *from rest*, with the motion beginning after "
        f"{REST} or more static steps (k01 = 0) under the weight."
    )
    _sets(record)
    _start(record)
    _sweeps(record)
    _solvers(record)
    record.energy_closes(1e-7, "most of it in the runs with extreme penalties")


# -- the truth -------------------------------------------------------------------------------------------------------


def displacement(time: FloatArray, omega: FloatArray) -> FloatArray:
    """Horizontal displacement [m], Eq. 4.2 with θ = 0."""
    phase = np.outer(time, omega)
    return np.asarray((AMPLITUDE / omega**2 * (phase - np.sin(phase))).sum(axis=1))


def quadrature_error(omega: FloatArray, dt: float) -> float:
    """Relative error of the midpoint rule for the highest sine, to leading order."""
    return float(omega.max() * dt) ** 2 / 24.0


def steps_to_rest(stiffness: float, dt: float) -> int:
    """Static steps after which the shear springs bear the weight: each leaves 2/(2 + Ω²) of what was missing."""
    inertia = 2.0 * PUBLISHED["density"] * LENGTH * HEIGHT / dt**2
    kept = inertia / (inertia + 2.0 * stiffness / SHEAR_RATIO)
    return max(REST, int(np.ceil(np.log(SETTLED) / np.log(kept))))


def speed_after_start(stiffness: float, dt: float, steps: int) -> float:
    """Horizontal speed [m/s] that a rigid block on two springs has when its weight has come upon them.

    One spring of 2 g0 along the normal, one of 2 g0/2.5 along the slope with Coulomb's limit, integrated as the program
    does (Newmark, β = ½, γ = 1). A rigid block on a rigid slope of its friction angle would stay at rest.
    """
    mass = PUBLISHED["density"] * LENGTH * HEIGHT
    inertia = 2.0 * mass / dt**2
    normal, shear = 2.0 * stiffness, 2.0 * stiffness / SHEAR_RATIO
    gap = fall = speed = force = 0.0
    for _ in range(steps):
        load = 2.0 * mass / dt * fall - mass * GRAVITY * np.cos(ANGLE)
        step = (load - normal * gap) / (inertia + normal)
        if gap + step > 0.0:
            step = load / inertia
        fall, gap = 2.0 * step / dt - fall, gap + step
        limit = np.tan(ANGLE) * max(0.0, -normal * gap)
        load = 2.0 * mass / dt * speed + mass * GRAVITY * np.sin(ANGLE)
        step = (load - force) / (inertia + shear)
        force += shear * step
        if abs(force) > limit:
            force = np.copysign(limit, force)
            step = (load - force) / inertia
        speed = 2.0 * step / dt - speed
    return float(speed * np.cos(ANGLE))


# -- the model -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Slide:
    """What came out of a run; time and displacement count from the start of the motion."""

    time: FloatArray
    horizontal: FloatArray
    truth: FloatArray
    sunk: float  #: of the block's centre into the slope, before the motion or at the end [m]
    steps: int

    @property
    def error(self) -> float:
        """Eq. 4.5 [%]"""
        return float(np.linalg.norm(self.truth - self.horizontal) / np.linalg.norm(self.truth)) * 100.0

    @property
    def difference(self) -> float:
        """Eq. 4.6 [%]"""
        truth = np.linalg.norm(self.truth)
        return float((truth - np.linalg.norm(self.horizontal)) / truth) * 100.0


def incline(
    omega: FloatArray, dt: float, stiffness: float, rest: int, duration: float, solver: str = "auto",
    length: float = LENGTH, modulus: float = PUBLISHED["youngs_modulus"],
) -> Model:  # fmt: skip
    """The block on its slope."""
    model = Model(
        "sines", e0=1e-3, k01=PUBLISHED["k01"], dt_max=dt, stiffness=stiffness, steps=10**6,
        displacement_ratio=PUBLISHED["displacement_ratio"],
    )  # fmt: skip
    width, top = 4.0, 4.0 * np.tan(ANGLE)
    model.add_polygon([(0, -0.5), (width, -0.5), (width, 0), (0, top)])
    along, normal = np.array([np.cos(ANGLE), -np.sin(ANGLE)]), np.array([np.sin(ANGLE), np.cos(ANGLE)])
    corner = np.array([0.0, top]) + 0.5 * along
    sides = length * along, HEIGHT / LENGTH * length * normal
    model.add_polygon([corner, corner + sides[0], corner + sides[0] + sides[1], corner + sides[1]])
    model.add_fixed((0.2, -0.3))
    model.add_fixed((width - 0.2, -0.3))
    model.add_measured(corner + 0.5 * (sides[0] + sides[1]))
    model.add_block_material(
        density=PUBLISHED["density"], gravity=GRAVITY,
        youngs_modulus=modulus, poisson_ratio=PUBLISHED["poisson_ratio"],
    )  # fmt: skip
    model.add_joint_material(friction_angle=PUBLISHED["friction_angle"])
    begin = rest * dt
    terms = [[-a, 0.0, w / (2.0 * np.pi), 0.0, begin] for a, w in zip(AMPLITUDE, omega, strict=True)]
    model.options = {
        "run": {"t_end": begin + duration, "save_every": 10**6},
        "load": {"harmonic": [float(value) for term in terms for value in term]},
        "solver": {"method": solver},
    }
    if rest:
        model.options["stage"] = [{"until_step": rest, "k01": 0.0}, {"k01": 1.0}]
    return model


def slide(results: Results, omega: FloatArray, dt: float, rest: int) -> Slide:
    """Displacements since the start of the motion."""
    time, moved = results["history/time"], results["history/measured_displacement"][:, 0]
    start = moved[rest - 1] if rest else np.zeros(2)
    since, path = time[rest:] - rest * dt, moved[rest:] - start
    normal = np.array([np.sin(ANGLE), np.cos(ANGLE)])
    return Slide(since, path[:, 0], displacement(since, omega), -float(moved[-1] @ normal), len(time))


def _run(
    record: Record, name: str, omega: FloatArray, dt: float, stiffness: float = STIFFNESS, rest: int = 0,
    duration: float = DURATION, **block: float,
) -> Slide:  # fmt: skip
    """`block`: its length or modulus."""
    with record.run(incline(omega, dt, stiffness, rest, duration, **block), name) as results:  # type: ignore[arg-type]
        return slide(results, omega, dt, rest)


# -- comparisons -----------------------------------------------------------------------------------------------------


def _sets(record: Record) -> None:
    from matplotlib import pyplot as plt

    rows = []
    with record.style():
        figure, axes = plt.subplots(2, 1, figsize=(PAPER_WIDTH, 4.4), sharex=True, height_ratios=(1, 1.6))
        for number, omega in enumerate(SETS):
            for dt, bound in zip(PUBLISHED["time_step"], PUBLISHED["error"], strict=True):
                for rest in (0, steps_to_rest(STIFFNESS, dt)):
                    here = _run(
                        record, f"set{number + 1}-{dt:g}-{'rest' if rest else 'turned_on'}", omega, dt, rest=rest
                    )
                    start = "from rest" if rest else "as in the thesis"
                    rows.append(
                        [number + 1, dt, start, here.error, here.difference, here.horizontal[-1], here.truth[-1]]
                    )
                    turn_on = (
                        "weight and springs begin together: the block is left with a small constant speed, see “The "
                        "start”; promised is the published bound"
                    )
                    record.compare(
                        f"e (Eq. 4.5), set {number + 1}, Δt = {dt:g} s, {start}", here.error, "%",
                        truth=0.0, truth_source="Eq. 4.2", scale=1.0,
                        published=bound, published_source="§4.2, upper bound of all sets", bound="upper",
                        allowed=100.0 * quadrature_error(omega, dt) if rest else bound,
                        explanation="below the leading error of the midpoint rule for the highest sine, (ωΔt)²/24"
                        if rest else turn_on,
                    )  # fmt: skip
            if number == SECOND_SET:
                motion = np.sin(np.outer(here.time, omega)) @ AMPLITUDE / GRAVITY
                axes[0].plot(here.time, motion, color=PALETTE[number + 1])
            axes[1].plot(here.time, here.truth, color=PALETTE[number + 1], label=f"set {number + 1}, Eq. 4.2")
            some = slice(99, None, 200)
            axes[1].plot(here.time[some], here.horizontal[some], "o", ms=4, mfc="none", color=PALETTE[0])
        axes[1].plot([], [], "o", ms=4, mfc="none", color=PALETTE[0], label="RockDDA, from rest, Δt = 0.0025 s")
        axes[0].set_ylabel("a(t) / g, set 2")
        axes[1].set(xlabel="time [s]", ylabel="horizontal displacement [m]", xlim=(0, DURATION))
        axes[1].legend()
    columns = ["set", "Δt [s]", "start", "e [%]", "e' [%]", "displacement at 5 s [m]", "Eq. 4.2 [m]"]
    record.table(pd.DataFrame(rows, columns=columns), "norms", "Error norms of Eqs. 4.5 and 4.6.")
    record.figure(
        figure, "displacement", "Input motion of set 2, and displacements of all sets (the thesis's Fig. 4.1)."
    )


def _start(record: Record) -> None:
    """The speed that turning on the weight leaves."""
    duration, dt, rigid = 2.0, 0.0025, 5e13
    published = PUBLISHED["youngs_modulus"]
    for stiffness in (5e7, STIFFNESS):
        expected = speed_after_start(stiffness, dt, round(duration / dt))
        for modulus in (rigid, published):
            name = f"start-{stiffness:.0e}-{modulus:.0e}"
            here = _run(record, name, SETS[SECOND_SET], dt, stiffness, duration=duration, modulus=modulus)
            strained = modulus == published and stiffness == STIFFNESS
            record.compare(
                f"speed left by turning on the weight, g0 = {stiffness:.0e} N/m, E = {modulus:.0e} Pa",
                (here.horizontal[-1] - here.truth[-1]) / here.time[-1], "m/s",
                truth=expected, truth_source="rigid block on a normal and a shear spring",
                allowed=0.25 if strained else 0.05,
                explanation="2 g0 is not small beside E: the block is strained, which the truth leaves out; see the "
                "line with a stiffer block" if strained else "the block also rocks on its two corners",
            )  # fmt: skip
    record.text(
        "**The start.** With weight and motion beginning together, the block falls onto unloaded springs; friction is "
        "limited by a normal force that swings about its mean while the shear spring must first be stretched, and when "
        "that is over the block keeps a constant speed of the order g sin α √(m/g0). A spring model of two unknowns "
        "without any DDA has the same speed. This, and not the time integration, is nearly all of the error that "
        "remains in runs set up as in the thesis; long time steps damp the swinging, so that the error "
        "*grows* when the time step is halved. From rest the errors are those of the midpoint rule for a(t): below "
        "0.1 % with 0.005 s and 0.01 % with 0.0025 s."
    )


def _sweeps(record: Record) -> None:
    """Fig. 4.2."""
    from matplotlib import pyplot as plt

    steps = (0.00125, 0.0025, 0.005, 0.0075, 0.01, 0.02) if record.full else (0.0025, 0.01)
    stiffnesses = (
        (5e7, 1e8, 2.5e8, 5e8, 1e9, 5e9, 5e10, 5e11, 5e12, 5e13, 5e14, 5e15) if record.full else (5e7, 1e9, 5e10)
    )
    omega = SETS[SECOND_SET]
    period = 2.0 * np.pi / omega.max()
    errors: dict[bool, FloatArray] = {}
    for rested in (False, True):
        errors[rested] = np.full((len(steps), len(stiffnesses)), np.nan)
        for i, dt in enumerate(steps):
            for j, stiffness in enumerate(stiffnesses):
                name = f"sweep-{dt:g}-{stiffness:.1e}-{'rest' if rested else 'turned_on'}"
                rest = steps_to_rest(stiffness, dt) if rested else 0
                try:
                    here = _run(record, name, omega, dt, stiffness, rest)
                except RockddaError:
                    continue  # stays NaN: the run failed
                errors[rested][i, j] = here.error
    table = pd.DataFrame(
        [[g0, dt, dt / period, errors[False][i, j], errors[True][i, j]]
         for i, dt in enumerate(steps) for j, g0 in enumerate(stiffnesses)],
        columns=["g0 [N/m]", "Δt [s]", "Δt/T", "e [%], as in the thesis", "e [%], from rest"],
    )  # fmt: skip
    record.table(table, "sensitivity", "Error norm (Eq. 4.5) of set 2 after 5 s (the thesis's Fig. 4.2).")
    with record.style():
        figure, axes = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 3.4), sharey=True)
        for i, dt in enumerate(steps):
            axes[0].loglog(stiffnesses, errors[False][i], "-", color=PALETTE[i], label=f"{dt:g} s")
            axes[0].loglog(stiffnesses, errors[True][i], "--", color=PALETTE[i])
        shown = [j for j, g0 in enumerate(stiffnesses) if g0 in (5e7, 2.5e8, 1e9, 5e10, 5e12)]
        for color, j in enumerate(shown):
            axes[1].loglog(np.array(steps) / period, errors[False][:, j], "o-", ms=3, color=PALETTE[color],
                           label=f"{stiffnesses[j]:.2g} N/m")  # fmt: skip
            axes[1].loglog(np.array(steps) / period, errors[True][:, j], "o--", ms=3, color=PALETTE[color])
        axes[0].set(xlabel="contact stiffness g0 [N/m]", ylabel="e [%], Eq. 4.5", ylim=(1e-3, 5e3))
        axes[1].set(xlabel="Δt / T")
        axes[0].legend(title="Δt", ncols=2)
        axes[1].legend(title="g0")
    record.figure(
        figure, "sensitivity",
        "Error against stiffness and time step. Full lines: weight and motion begin together; dashed: from rest.",
    )  # fmt: skip
    low, high = SENSITIVITY["insensitive_from"], SENSITIVITY["insensitive_to"]
    plateau = [j for j, g0 in enumerate(stiffnesses) if low <= g0 <= high]
    optimal = steps.index(0.0025)
    worst = float(np.nanmax(errors[False][optimal, plateau]))
    record.compare(
        f"largest e, Δt = 0.0025 s, g0 from {low:.0e} to {high:.0e} N/m, as in the thesis", worst, "%",
        truth=0.0, truth_source="Eq. 4.2", scale=1.0,
        published=SENSITIVITY["insensitive_error"], published_source="§4.2, never exceeded", bound="upper",
        allowed=SENSITIVITY["insensitive_error"],
    )  # fmt: skip
    usual = [i for i, dt in enumerate(steps) if dt <= 0.005]
    common = [j for j, g0 in enumerate(stiffnesses) if g0 <= 5e13]
    record.compare(
        "largest e, Δt up to 0.005 s, g0 from 5e7 to 5e13 N/m, from rest",
        float(np.max(errors[True][np.ix_(usual, common)])), "%",
        truth=0.0, truth_source="Eq. 4.2", scale=1.0, allowed=100.0 * quadrature_error(omega, 0.005),
        explanation="promised is (ωΔt)²/24 with Δt = 0.005 s; elastic slip of soft springs limits shorter steps",
    )  # fmt: skip
    if not record.full:
        return
    _least(record, omega, period)


def _least(record: Record, omega: FloatArray, period: float) -> None:
    """The combination that the thesis calls the best, and what the size of the block does to it."""
    stiffnesses = (SENSITIVITY["least_error_stiffness"], 5e8, 1e9)
    dt = SENSITIVITY["least_error_step"] * period
    rows = []
    for length in (0.5, 0.7, LENGTH, 1.5):
        mass = PUBLISHED["density"] * HEIGHT / LENGTH * length**2
        errors = [_run(record, f"least-{length:g}-{g0:.1e}", omega, dt, g0, length=length).error for g0 in stiffnesses]
        rows.append([length, mass, *errors])
    smaller, least, larger = (row[2] for row in rows[1:])
    record.compare(
        f"e, Δt/T = {SENSITIVITY['least_error_step']}, g0 = 2.5e8 N/m, as in the thesis", least, "%",
        truth=0.0, truth_source="Eq. 4.2", scale=1.0,
        published=SENSITIVITY["least_error"], published_source="§4.2, called the lowest",
        explanation="the speed left by the start grows with the mass of the block, and the thesis gives no size: "
        f"{smaller:.2g} % with a block 0.7 m long, {larger:.2g} % with one of 1.5 m",
    )  # fmt: skip
    columns = ["length of the block [m]", "its mass [kg/m]", *(f"e [%], g0 = {g0:.1e} N/m" for g0 in stiffnesses)]
    record.table(
        pd.DataFrame(rows, columns=columns), "size",
        f"Set 2 as in the thesis, Δt/T = {SENSITIVITY['least_error_step']}, blocks of half that height.",
    )  # fmt: skip
    record.text(
        f"**The best combination.** The thesis calls 0.6 % at Δt/T = {SENSITIVITY['least_error_step']} with g0 = 2.5e8 "
        "N/m its lowest error, with errors ten times as large for twice and four times the stiffness. What the start "
        "leaves depends on the mass of the block: 0.6 % belongs to one between 0.7 m and 1 m long, if twice as long as "
        "high. With such a block, stiffer springs make the error smaller and not larger, down to that of the midpoint "
        "rule (0.09 %); that part is not explained."
    )


def _solvers(record: Record) -> None:
    """Why extreme penalties fail."""
    rows = []
    dt, duration = 0.0025, 0.1
    for stiffness in (1e9, 5e10, 5e11, 5e12) + ((5e13,) if record.full else ()):
        for method in ("sor", "dense"):
            name = f"solver-{method}-{stiffness:.0e}"
            model = incline(SETS[SECOND_SET], dt, stiffness, 0, duration, method)
            with record.run(model, name) as results:
                history = results.history()
                here = slide(results, SETS[SECOND_SET], dt, 0)
            sweeps = float(history["solver_iterations"].mean()) if method == "sor" else float("nan")
            rows.append([stiffness, method, len(history), int(history["attempts"].sum()), sweeps, here.horizontal[-1]])
    columns = ["g0 [N/m]", "solver", "steps", "attempts", "sweeps per step", "displacement at 0.1 s [m]"]
    record.table(
        pd.DataFrame(rows, columns=columns), "solvers", f"{duration} s with Δt = {dt} s: 40 steps, if none is cut."
    )
    record.text(
        "**Extreme penalties.** With a direct solver nothing happens up to 5e13 N/m: the displacement does not depend "
        "on the penalty any more. At 5e14 N/m round-off begins to show, at 5e15 N/m it spoils the run: weight over "
        "stiffness is then below 1e-11 m, and friction rests on penetrations of which coordinates of some metres keep "
        "few digits. What fails earlier is the thesis's solver, successive over-relaxation: its sweeps grow with the "
        "ratio of penalty to inertia, g0 Δt²/2m, until they are exhausted. A program that accepts what it then has "
        "goes wrong (the thesis: above 5e10 N/m with 0.0025 s, lower for longer steps). RockDDA counts such a "
        "solution as not converged and cuts the step; the run becomes very slow or ends with a message. Contact "
        "*forces* at high penalty alternate from step to step (Ω ≥ 4, theory manual §5); the slide does not notice, "
        "since their mean is right."
    )


CASES = [Case("4.2-three-sines", "Sum of three sines on an incline", "Chapter 4", three_sines)]
