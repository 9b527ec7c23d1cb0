# SPDX-License-Identifier: MIT
"""§5.3.1 of the thesis: two blocks between pins sag until they stand as a three-hinged arch.

The truth knows no contacts and no steps: equilibrium of half of the symmetric arch, a uniformly strained block between
a pin and the plane of symmetry, solved by Newton's method with finite rotations and strains; its linear form in closed
form; and, for the number of steps, the vibrations about that equilibrium as the time integration damps them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results

from ..case import Case, Record, published
from ..vibration import block_mass, damped, modes, steps_to_rest

FloatArray = npt.NDArray[np.float64]
PUBLISHED = published("chapter5")["two_block_arch"]
SOURCE = PUBLISHED["source"]
LENGTH, THICKNESS = PUBLISHED["block_length"], PUBLISHED["thickness"]
MODULUS, POISSON, DENSITY = PUBLISHED["youngs_modulus"], PUBLISHED["poisson_ratio"], PUBLISHED["density"]
STIFFNESS, TIME_STEP = PUBLISHED["contact_stiffness"], PUBLISHED["time_step"]
GRAVITY = 9.81
SUPPORT = 100.0  # stiffness of fixed points over that of contacts
STEPS = 1500
TOLERANCES = (0.05, 0.01, 0.005, 0.001)
WEIGHT = DENSITY * GRAVITY * LENGTH * THICKNESS  # of one block


def two_block_arch(record: Record) -> None:
    """Deflection, number of steps to equilibrium, thrust."""
    arch = HalfArch(STIFFNESS)
    motion, rest = arch.equilibrium()
    truth = -rest.crown[1]
    linear = linear_deflection(MODULUS, STIFFNESS)
    record.text(
        f"Two blocks of {LENGTH} m × {THICKNESS} m, each held by a fixed point at its outer base corner, lean against "
        "each other at mid-span. They sag, the joint opens below, and they stand as a three-hinged arch. The truth is "
        "the equilibrium of one uniformly strained block between its pin and the plane of symmetry (finite rotations "
        "and strains, springs at pin and crown, Newton's method). With virtual work its linear form is\n\n"
        "    δ = 2/(SE) [N n + V v - ν(N v + V n) + 2(1 + ν) T τ] + 2 (H h + W/2)/p + H h/g0,\n\n"
        "H = W L/(2t), h = L/(2t); N = -H L, V = -W t/2, T = -W L/2 are area times mean stress σx, σy, τxy of a block "
        "under its weight W, n = -h L, v = -t/2, τ = -L/2 those under a unit load at the crown; p = 100 g0 holds a "
        f"fixed point. It gives {linear:.6g} m, the equilibrium with finite motions {truth:.6g} m."
    )
    runs = {k01: _run(record, k01) for k01 in PUBLISHED["k01"]}
    for k01, results in runs.items():
        published_here = {"published": PUBLISHED["deflection"], "published_source": SOURCE} if k01 == 1 else {}
        record.compare(
            f"deflection at rest, k01 = {k01:g}",
            _deflection(results)[-1],
            "m",
            truth=truth,
            truth_source="equilibrium of a uniformly strained block",
            allowed=5e-5,
            explanation=(
                "not explained: the published value does not follow from the published data, see the text; against the "
                "truth: "
                if k01 == 1
                else ""
            )
            + "differs by the size of the strains (2e-5), which the program adds up step by step",
            **published_here,
        )
    _balance(record, runs[0.95], rest)
    _counts(record, runs, arch, motion)
    _published_deflection(record, arch, motion, truth)
    _stiffness(record)
    record.energy_closes(1e-6, "the solver's tolerance in these runs")


# -- the truth -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rest:
    """Of the left half at rest."""

    crown: FloatArray  #: displacement of its crown corner
    thrust: float
    arm: float  #: height of the crown above the pin


class HalfArch:
    """The left block: pinned at its lower left corner, its upper right corner against the plane of symmetry x = 0.

    Its potential has the six unknowns of a uniformly strained block, which moves by rotation after strain. The spring
    between two blocks that each overlap the plane by q holds g0 (2q)²/2, half of it on either side.
    """

    def __init__(self, stiffness: float, modulus: float = MODULUS) -> None:
        self.contact, self.support = stiffness, SUPPORT * stiffness
        factor = modulus / (1 - POISSON**2)
        self.elastic = factor * np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, (1 - POISSON) / 2]])
        self.area = LENGTH * THICKNESS
        self.pin, self.crown = np.array([-LENGTH / 2, -THICKNESS / 2]), np.array([LENGTH / 2, THICKNESS / 2])

    def place(self, d: npt.NDArray, point: FloatArray) -> tuple[npt.NDArray, npt.NDArray]:
        """Displacement of a point, and its derivatives (2, 6)."""
        c, s = np.cos(d[2]), np.sin(d[2])
        turn = np.array([[c, -s], [s, c]])
        strained = point + np.array([[d[3], d[5] / 2], [d[5] / 2, d[4]]]) @ point
        x, y = point
        slopes = np.zeros((2, 6), dtype=d.dtype)
        slopes[0, 0] = slopes[1, 1] = 1
        slopes[:, 2] = np.array([[-s, -c], [c, -s]]) @ strained
        slopes[:, 3:] = turn @ np.array([[x, 0, y / 2], [0, y, x / 2]])
        return d[:2] + turn @ strained - point, slopes

    def slope(self, d: npt.NDArray) -> npt.NDArray:
        """First derivatives of the potential."""
        total = np.zeros(6, dtype=d.dtype)
        total[3:] = self.area * self.elastic @ d[3:]
        total[1] += WEIGHT
        moved, slopes = self.place(d, self.pin)
        total += self.support * slopes.T @ moved
        moved, slopes = self.place(d, self.crown)
        return total + 2 * self.contact * moved[0] * slopes[0]

    def stiffness(self, d: FloatArray) -> FloatArray:
        """Second derivatives, by complex steps: exact to round-off."""
        return np.array([self.slope(d + 1e-30j * unit).imag / 1e-30 for unit in np.eye(6)])

    def equilibrium(self) -> tuple[FloatArray, Rest]:
        """The motion to rest, and what it means."""
        d = np.zeros(6)
        for _ in range(20):  # converges quadratically, within about 5
            d = d - np.linalg.solve(self.stiffness(d), self.slope(d))
        pin, crown = self.place(d, self.pin)[0], self.place(d, self.crown)[0]
        arm = THICKNESS + crown[1] - pin[1]
        # the spring of the pin would give the thrust with few digits: its motion is 1e-12 m
        thrust = WEIGHT * (LENGTH / 2 + d[0] - pin[0]) / arm
        return d, Rest(crown, thrust, arm)

    def frequencies(self, d: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Circular frequencies about an equilibrium, and the crown's part in each mode when the load is put on."""
        mass = block_mass(DENSITY, LENGTH, THICKNESS)
        frequencies, shapes = modes(self.stiffness(d), mass)
        start = -shapes.T @ mass @ d  # modal coordinates of the start, seen from rest
        fall = self.place(d, self.crown)[1][1] @ shapes
        return frequencies, -fall * start


def linear_deflection(modulus: float, contact: float, support: float | None = None) -> float:
    """Closed form for small motions, by virtual work."""
    support = SUPPORT * contact if support is None else support
    thrust, unit = WEIGHT * LENGTH / (2 * THICKNESS), LENGTH / (2 * THICKNESS)
    forces = np.array([-thrust * LENGTH, -WEIGHT * THICKNESS / 2, -WEIGHT * LENGTH / 2])
    virtual = np.array([-unit * LENGTH, -THICKNESS / 2, -LENGTH / 2])
    compliance = np.array([[1, -POISSON, 0], [-POISSON, 1, 0], [0, 0, 2 * (1 + POISSON)]]) / modulus
    blocks = 2 * virtual @ compliance @ forces / (LENGTH * THICKNESS)
    return float(blocks + 2 * (thrust * unit + WEIGHT / 2) / support + thrust * unit / contact)


# -- runs of RockDDA ------------------------------------------------------------------------------------------------


def _run(record: Record, k01: float, stiffness: float = STIFFNESS, steps: int = STEPS) -> Results:
    model = Model(
        "two_block_arch",
        e0=1e-3,
        k01=k01,
        steps=steps,
        dt_max=TIME_STEP,
        displacement_ratio=PUBLISHED["displacement_ratio"],
        stiffness=stiffness,
    )
    model.add_polygon([(-LENGTH, 0), (0, 0), (LENGTH, 0), (LENGTH, THICKNESS), (0, THICKNESS), (-LENGTH, THICKNESS)])
    model.add_line((0, 0), (0, THICKNESS))
    model.add_fixed((-LENGTH, 0))
    model.add_fixed((LENGTH, 0))
    model.add_measured((0, THICKNESS))
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=MODULUS, poisson_ratio=POISSON)
    model.add_joint_material(friction_angle=35)  # not published; 1 to 89 degrees give the same bits
    # forces of fixed points, 1e17 N/m times a motion known to 1e-20 m, carry an error of 1e-3 N, and the loads are
    # 7e4 N: with the usual tolerance of 1e-10 the first step would be rejected and begun again with a shorter one
    model.options["solver"] = {"tolerance": 1e-6}
    return record.run(model, f"k01_{k01:g}_g0_{stiffness:.0e}".replace("+", ""), save_every=steps)


def _deflection(results: Results) -> FloatArray:
    return -results["history/measured_displacement"][:, 0, 1]


def _balance(record: Record, results: Results, rest: Rest) -> None:
    """Supports."""
    left, right = results["history/fixed_force"][-1]
    source = "equilibrium of the whole"
    record.compare("supports, vertical", left[1] + right[1], "N", truth=2 * WEIGHT, truth_source=source, allowed=1e-6)
    record.compare(
        "thrust times arm over moment of the weight",
        left[0] * rest.arm / (WEIGHT * LENGTH / 2),
        truth=1.0,
        truth_source="H z = W L/2, z at rest",
        allowed=5e-5,
        explanation="L at rest is shorter by the strain",
    )
    record.compare("thrust", left[0], "N", truth=rest.thrust, truth_source="uniformly strained block", allowed=5e-5)
    record.compare(
        "thrust, left less right",
        left[0] + right[0],
        "N",
        truth=0.0,
        truth_source=source,
        scale=rest.thrust,
        allowed=1e-6,
    )


def _counts(record: Record, runs: dict[float, Results], arch: HalfArch, motion: FloatArray) -> None:
    """Steps to equilibrium, against the damping of the time integration."""
    frequencies, parts = arch.frequencies(motion)
    rest = -arch.place(motion, arch.crown)[0][1]
    rows = []
    for k01, count in zip(PUBLISHED["k01"], PUBLISHED["steps_to_equilibrium"], strict=True):
        computed = _deflection(runs[k01]) - _deflection(runs[k01])[-1]
        theory = damped(frequencies, parts, k01, STEPS, TIME_STEP)
        row: dict[str, object] = {"k01": k01, "published": count}
        for tolerance in TOLERANCES:
            limit = tolerance * rest
            row[f"RockDDA, {tolerance:.1%}"] = steps_to_rest(computed, limit)
            row[f"theory, {tolerance:.1%}"] = steps_to_rest(theory, limit)
        left_over = np.abs(theory[count - 1 :]).max() / rest
        row["left at the published count"] = f"{left_over:.2%}"
        rows.append(row)
        # in an oscillation the last crossing of the limit jumps by half a period when it just touches the limit
        record.compare(
            f"steps to within 0.5 % of rest, k01 = {k01:g}",
            steps_to_rest(computed, 0.005 * rest),
            truth=steps_to_rest(theory, 0.005 * rest),
            truth_source="vibration of the arch, damped by the time integration",
            published=count,
            published_source=SOURCE,
            allowed=0.02,
            explanation=_against_count(count, steps_to_rest(theory, 0.005 * rest), left_over),
        )
    record.table(
        pd.DataFrame(rows),
        "steps",
        "Steps until the deflection stays within a share of that at rest, and what is left at the published count",
    )
    record.text(
        "**Number of steps.** The slowest vibration of the arch at rest has "
        f"{frequencies[0] / (2 * math.pi):.2f} Hz, so Ω = ωΔt = {frequencies[0] * TIME_STEP:.4f}. A step multiplies "
        "its amplitude by √(2 k01/(2 + Ω²)) as long as it swings, and by 2/(2 + Ω²) with k01 = 0: without velocities "
        "the arch needs half as many steps as with all of them, whatever the criterion. Ours agree with this theory "
        "to the step. Staying within about 0.6 % of the deflection at rest explains the published numbers for "
        "k01 = 1, 0.99 and 0.95, but not the other two: for k01 = 0.9 nearly 7 % is left at the published step 40, and "
        "for k01 = 0 about 160 steps instead of 240 would do. Each would need a criterion of its own; this is "
        "unexplained. The trend is as published: taking 5 to 10 % of the velocity at each step brings the arch to rest "
        "in the fewest steps among the published values."
    )
    _draw(record, runs, frequencies, parts, rest)


def _against_count(published_count: int, theory: int, left_over: float) -> str:
    """What is known of a difference to a published number of steps."""
    if abs(theory / published_count - 1) <= 0.1:
        return "the thesis states no criterion; within 0.6 % instead of 0.5 % it would be the published number or fewer"
    return (
        f"not explained: at the published step {100 * left_over:.2g} % of the deflection is left; the thesis states no "
        "criterion, and none fits all five numbers"
    )


def _draw(record: Record, runs: dict[float, Results], frequencies: FloatArray, parts: FloatArray, rest: float) -> None:
    import matplotlib.pyplot as plt

    with record.style():
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(PAPER_WIDTH, 2.7), width_ratios=(1.5, 1), layout="constrained"
        )
        shown = 300
        for colour, (k01, results) in zip(PALETTE, runs.items(), strict=False):
            y = _deflection(results)[:shown] * 1e3
            left.plot(results["history/time"][:shown], y, color=colour, label=f"k01 = {k01:g}", lw=1)
        left.axhline(rest * 1e3, color="0.5", lw=0.8, ls="--")
        left.set(xlabel="time [s]", ylabel="deflection of the crown [mm]", xlim=(0, shown * TIME_STEP))
        left.invert_yaxis()
        left.legend(ncols=2)
        grid = np.concatenate([np.arange(0, 0.9, 0.05), np.arange(0.9, 1.0001, 0.005)])
        for tolerance, style in ((0.01, ":"), (0.005, "-"), (0.001, "--")):
            counts = [steps_to_rest(damped(frequencies, parts, k, STEPS, TIME_STEP), tolerance * rest) for k in grid]
            right.plot(grid, counts, color=PALETTE[0], ls=style, lw=1, label=f"theory, {tolerance:.1%}")
        computed = [steps_to_rest(_deflection(r) - _deflection(r)[-1], 0.005 * rest) for r in runs.values()]
        right.plot(list(runs), computed, "o", color=PALETTE[1], label="RockDDA, 0.5%", ms=5)
        right.plot(PUBLISHED["k01"], PUBLISHED["steps_to_equilibrium"], "x", color=PALETTE[2], label="published", ms=6)
        right.set(xlabel="k01", ylabel="steps to equilibrium", ylim=(0, None))
        right.legend(loc="upper center", bbox_to_anchor=(0.45, 1.0), fontsize=6)
    record.figure(
        figure,
        "deflection",
        "As Fig. 5.3: deflection in time (dashed: truth), and steps until the deflection stays within a share of that "
        "at rest",
    )


def _published_deflection(record: Record, arch: HalfArch, motion: FloatArray, truth: float) -> None:
    """What the published deflection would need."""
    target = PUBLISHED["deflection"]
    blocks = linear_deflection(MODULUS, math.inf, math.inf)
    modulus = MODULUS * blocks / target
    springs = (linear_deflection(MODULUS, 1.0, SUPPORT) - blocks) / (target - blocks)
    alike = (linear_deflection(MODULUS, 1.0, 1.0) - blocks) / (target - blocks)
    soft = HalfArch(STIFFNESS, modulus)
    slow = float(soft.frequencies(soft.equilibrium()[0])[0][0]) * TIME_STEP
    steps = 320
    stiff = float(arch.frequencies(motion)[0][0]) * TIME_STEP
    left_over = (1 + slow**2 / 2) ** (-steps / 2)
    record.text(
        f"**The published deflection** of {target} m is {target / truth:.1f} times what the published data give. It "
        f"would need E = {modulus / 1e9:.2f} GPa, or springs of g0 = {springs:.2g} N/m ({alike:.2g} N/m if fixed "
        "points were no stiffer than contacts). The published numbers of steps speak against it as well: with k01 = 1 "
        f"an arch so soft has Ω = {slow:.3f} and still {left_over:.0%} of its amplitude after {steps} steps, where the "
        f"stiffness computed here leaves {(1 + stiff**2 / 2) ** (-steps / 2):.1%}. Published numbers of steps and "
        "deflection cannot belong to the same arch. The deflection is unexplained."
    )


def _stiffness(record: Record) -> None:
    """Deflection against g0."""
    values = [10.0**n for n in (range(7, 16) if record.full else (8, 10, 12))]
    rows = []
    for value in values:
        computed = _deflection(_run(record, 0.9, value, 1000))[-1]
        truth = -HalfArch(value).equilibrium()[1].crown[1]
        rows.append(
            {
                "g0 [N/m]": value,
                "RockDDA [m]": computed,
                "truth [m]": truth,
                "linear [m]": linear_deflection(MODULUS, value),
            }
        )
        rows[-1]["error"] = computed / truth - 1
    record.table(
        pd.DataFrame(rows),
        "stiffness",
        "Deflection at rest against contact stiffness (truth: finite motions), k01 = 0.9",
    )
    worst = max(rows, key=lambda row: abs(row["error"]))
    record.compare(
        f"deflection, g0 = {values[0]:.0e} to {values[-1]:.0e} N/m, the worst: g0 = {worst['g0 [N/m]']:.0e}",
        worst["RockDDA [m]"],
        "m",
        truth=worst["truth [m]"],
        truth_source="equilibrium of a uniformly strained block",
        allowed=5e-4,
        explanation="second order in rotations and strains (0.01 and 0.001 at the softest springs)",
    )


CASES = [
    Case("5.3.1-two-block-arch", "Two-block arch: deflection and steps to equilibrium", "Chapter 5", two_block_arch)
]
