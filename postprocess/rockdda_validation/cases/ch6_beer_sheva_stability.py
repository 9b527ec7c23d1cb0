# SPDX-License-Identifier: MIT
"""§6.6.3 and §6.6.6 of the thesis: when a single layer is stable, and what its arch is beside the classic one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
from rockdda.analysis.voussoir import VoussoirBeam, solve_beam
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..beer_sheva import (
    BASE,
    CRITERION,
    MIDDLE,
    TIGHT,
    VARIANTS,
    Trials,
    angle_axis,
    compare_thresholds,
    draw_verdicts,
    sag,
    spacing_axis,
)
from ..case import Case, Record, published
from ..roofs import GRAVITY, Roof, bisect, follow

PUBLISHED = published("chapter6")
ROCK, NUMERICS, SINGLE = PUBLISHED["rock"], PUBLISHED["numerics"], PUBLISHED["single"]
SOURCE = SINGLE["source"]
SPAN, THICKNESS = SINGLE["span"], SINGLE["thickness"]
ANGLE = ROCK["friction_angle"]
#: the angle below which a tight beam of rigid blocks slips down its abutments: thrust line from corner to corner
RIGID_ANGLE = math.degrees(math.atan(4 * THICKNESS / SPAN))
UNSETTLED = ("as described", "as described, Shi's rules")
#: what the limits of layers without stress at the start hang on
REASONS = {
    "as described": "the weight of the abutments presses the blocks together by micrometres before they have fallen "
    "far, and from that a thrust grows; what started one in the thesis is not said",
    "as described, Shi's rules": "contacts close with a penetration only, when the layer falls already: whether it "
    "is caught hangs on the step in which they close, so on dt, g0 and round-off",
}


def stability(record: Record) -> None:
    """Deflections at rest, thresholds."""
    _static(record)
    _thresholds(record)
    if record.full:
        _scans(record)


# -- at rest ---------------------------------------------------------------------------------------------------------


def two_block_sag(stress: float) -> float:
    """Static sag of two blocks of half the span, three hinges at corners: the springs' and the blocks' shortening.

    By virtual work with the mean stresses of a block (S its area) under its weight W and the thrust H, and under a unit
    load at the crown; one spring g0 at each abutment and one between the blocks, a shear spring g0/2.5 at each
    abutment; arms are those of the sunk arch. At the start each corner carries half of the stress over its joint.
    """
    length, area = SPAN / 2, SPAN / 2 * THICKNESS
    weight = ROCK["density"] * GRAVITY * area
    modulus, nu, spring = ROCK["youngs_modulus"], ROCK["poisson_ratio"], NUMERICS["stiffness"]
    sunk = 0.0
    for _ in range(50):
        arm = THICKNESS - sunk
        thrust, unit = weight * length / (2 * arm), length / (2 * arm)
        normal, vertical, shear = -thrust * length, -weight * THICKNESS / 2, -weight * length / 2
        normal -= stress * area  # the blocks were under this stress at the start
        n, v, t = -unit * length, -THICKNESS / 2, -length / 2
        work = normal * n + vertical * v - nu * (normal * v + vertical * n) + 2 * (1 + nu) * shear * t
        carried = -stress * THICKNESS / 2  # by each spring, before the arch sinks
        joints = 3 * (thrust - carried) * unit / spring + weight / 2 * 2.5 / spring * 2
        sunk = 2 / (area * modulus) * work + joints
    return sunk


def _static(record: Record) -> None:
    """Deflection at rest beside the classic solution (6.6.6)."""
    unit_weight = ROCK["density"] * GRAVITY
    beam = VoussoirBeam(SPAN, THICKNESS, unit_weight, ROCK["youngs_modulus"])
    classic = {v: solve_beam(beam, v) for v in ("beer-meek", "diederichs-kaiser")}
    counts = (2, 3, 4, 5, 8, 16, 32) if record.full else (2,)
    rows = []
    for blocks in counts:
        roof = replace(BASE, blocks=blocks, friction_angle=80.0, stress=TIGHT, k01=0.99)
        results = follow(record, roof.model([(MIDDLE, 0.0)], save_every=10**6), f"static-{blocks}", 1.5)
        sunk = float(sag(results)[1][-1])
        # half of the sum over both abutments: forces of the supports on the abutment blocks
        force = results["history/fixed_force"][-1]
        inward = float(np.abs(force[:3, 0].sum()) + np.abs(force[3:, 0].sum())) / 2
        rows.append(
            {
                "S_j [m]": SPAN / blocks,
                "deflection at rest [mm]": 1e3 * sunk,
                "thrust [kN]": inward / 1e3,
                "arm Z [m]": unit_weight * THICKNESS * SPAN**2 / 8 / inward,
                "over classic (Beer, Meek)": sunk / classic["beer-meek"].deflection,
            }
        )
        # moments about the abutment's lower corner: the thrust passes the upper corner of the joint next to mid-span
        joint = 0.0 if blocks % 2 == 0 else SPAN / blocks / 2
        moment = unit_weight * THICKNESS / 2 * (SPAN**2 / 4 - joint**2)
        record.compare(
            f"thrust at rest, S_j = {SPAN / blocks:.3g} m",
            inward / 1e3,
            "kN",
            truth=moment / (THICKNESS - sunk) / 1e3,
            truth_source="moments of half of the sunk arch",
            allowed=0.002,
            explanation="corner to corner, with the sag as it came out",
        )
        if blocks == 2:
            record.compare(
                "deflection at rest, S_j = 4 m",
                1e3 * sunk,
                "mm",
                truth=1e3 * two_block_sag(TIGHT),
                truth_source="three-hinged arch of two uniformly strained blocks",
                allowed=0.01,
                published=1e3 * SINGLE["voussoir_deflection"],
                published_source=SOURCE,
                explanation="of the sum 1.8 mm are the three contact springs of 10⁹ N/m; the published value is the "
                "classic solution's, which has none",
            )
        if blocks == 4:
            record.compare(
                "deflection at rest, S_j = 2 m",
                1e3 * sunk,
                "mm",
                published=1e3 * SINGLE["voussoir_deflection"],
                published_source=SOURCE,
                explanation="published: “similar” to the classic 2 mm at r_b = 4",
            )
    record.table(
        pd.DataFrame(rows),
        "static",
        "At rest without slip (φ = 80°, k01 = 0.99, 10 kPa). Classic: "
        f"{1e3 * classic['beer-meek'].deflection:.2f} mm, thrust {classic['beer-meek'].thrust / 1e3:.0f} kN, "
        f"Z = {classic['beer-meek'].moment_arm:.3f} m (Beer and Meek); "
        f"{1e3 * classic['diederichs-kaiser'].deflection:.2f} mm (Diederichs and Kaiser). The classic arch has a "
        "triangle of stress at its ends, Z ≈ t/2; uniformly strained blocks lean on their corners, Z ≈ t, and thrust "
        "half as much. Every joint adds the shortening of its spring.",
    )


# -- thresholds ------------------------------------------------------------------------------------------------------


def _threshold(trials: Trials, roof: Roof, pairs: int) -> tuple[float, float]:
    """Friction angles: largest found unstable and smallest found stable for all of the first pairs, 1° apart."""

    def stable(angle: float) -> bool:
        tried = replace(roof, friction_angle=angle)
        name = f"{-roof.stress / 1e3:g} kPa"
        return all(trials.verdict(name, tried, pair).stable for pair in range(pairs))

    low, high = 4.0, 36.0
    while not stable(high) and high < 85:
        low, high = high, min(high + 16.0, 85.0)
    return bisect(stable, low, high, 1.0)


def _thresholds(record: Record) -> None:
    """Friction angles at which a tight layer becomes stable."""
    counts = (32, 16, 8, 4, 2) if record.full else (4,)
    trials, pairs = Trials(record), 4 if record.full else 1
    stresses = (TIGHT, -1e3, -100e3) if record.full else (TIGHT,)
    record.text(
        CRITERION + " For 10 kPa this must hold for two time steps (0.25 and 0.125 ms) and two stiffnesses (1 and "
        "5 GN/m). A layer of rigid blocks that touch slips down its abutments when tan φ < 4t/S: no thrust line that "
        "fits into it is steeper at its ends than the one from corner to corner "
        f"({RIGID_ANGLE:.1f}°). Blocks that give way sink before the thrust is there, and need more."
    )
    found: dict[tuple[float, int], tuple[float, float]] = {}
    for stress in stresses:
        for blocks in counts:
            roof = replace(BASE, blocks=blocks, stress=stress)
            found[stress, blocks] = _threshold(trials, roof, pairs if stress == TIGHT else 1)
    for blocks in counts:
        low, high = found[TIGHT, blocks]
        record.compare(
            f"friction angle of stability, S_j = {SPAN / blocks:g} m (10 kPa)",
            0.5 * (low + high),
            "°",
            truth=RIGID_ANGLE,
            truth_source="rigid blocks: atan 4t/S",
            scale=1.0,
            allowed=1.0 if blocks <= 4 else None,  # the bracket is 1° wide
            published=SINGLE["friction_stable"] if blocks == 32 else None,
            published_source=SOURCE,
            explanation=f"between {low:.2f}° and {high:.2f}°"
            + ("; published for a layer without a thrust at the start, see below" if blocks == 32 else ""),
        )
    rows = [
        {"S_j [m]": SPAN / blocks}
        | {
            f"{-stress / 1e3:g} kPa": f"{found[stress, blocks][0]:.1f} … {found[stress, blocks][1]:.1f}"
            for stress in stresses
        }
        for blocks in counts
    ]
    record.table(
        pd.DataFrame(rows),
        "thresholds",
        "Friction angle [°]: largest found unstable … smallest found stable, against joint spacing and stress at the "
        "start (10 kPa: for two time steps and two stiffnesses; others: for 0.25 ms and 1 GN/m).",
    )
    below = [blocks for blocks in counts if found[TIGHT, blocks][1] < ANGLE]
    record.compare(
        "smallest joint spacing found stable at φ = 47° (10 kPa)",
        SPAN / max(below, default=math.inf),
        "m",
        published=SINGLE["spacing_stable"],
        published_source=SOURCE,
        explanation="the smallest that was tried: blocks that touch are stable at all spacings",
    )
    _figure_thresholds(record, found, counts, stresses)


def _figure_thresholds(record: Record, found: dict, counts: tuple[int, ...], stresses: tuple[float, ...]) -> None:
    import matplotlib.pyplot as plt

    classic = solve_beam(VoussoirBeam(SPAN, THICKNESS, ROCK["density"] * GRAVITY, ROCK["youngs_modulus"]))
    with record.style():
        figure, axes = plt.subplots(figsize=(0.7 * PAPER_WIDTH, 3.0), layout="constrained")
        for colour, stress in zip(PALETTE[1:], stresses, strict=False):
            x = [SPAN / b for b in counts]
            y = np.array([found[stress, b] for b in counts])
            axes.errorbar(
                x,
                y.mean(axis=1),
                yerr=np.ptp(y, axis=1) / 2,
                color=colour,
                marker="o",
                ms=3,
                capsize=2,
                lw=1.0,
                label=f"{-stress / 1e3:g} kPa",
            )
        axes.axhline(RIGID_ANGLE, color="0.3", linestyle="--", linewidth=0.8)
        axes.text(4, RIGID_ANGLE - 1.4, "tan φ = 4t/S", fontsize=7, ha="right", va="top")
        axes.axhline(classic.required_friction_angle, color="0.6", linestyle=":", linewidth=0.9)
        axes.text(4, classic.required_friction_angle - 0.6, "classic voussoir beam", fontsize=7, ha="right", va="top")
        axes.plot(0.25, SINGLE["friction_stable"], "*k", ms=8, label="published")
        axes.plot(SINGLE["spacing_stable"], ANGLE, "*k", ms=8)
        axes.set(xlabel="joint spacing S_j [m]", ylabel="friction angle of stability [°]", xscale="log", ylim=(0, 85))
        axes.set_xticks([0.25, 0.5, 1, 2, 4], labels=["0.25", "0.5", "1", "2", "4"])
        axes.minorticks_off()
        axes.legend(fontsize=7)
        record.figure(
            figure,
            "thresholds",
            "Friction angle at which the single layer becomes stable, for small stresses at the start.",
        )


def _scans(record: Record) -> None:
    """Without initial stress: from which angle, from which spacing on, and whether there is such a limit at all."""
    record.text(
        "**Without stress at the start** a grid of friction angles at S_j = 0.25 m, and of spacings at φ = 47°, is "
        "run, by Shi's rules for all four pairs, by RockDDA's for the first pair and for all four where the limit may "
        "be. Where a single change from unstable to stable is found it is bisected, to 1° or to the next whole number "
        "of blocks; where stable and unstable values alternate there is no limit to bisect, and the table says so "
        "instead of giving a number. “Table 6.5” are the numbers of the thesis alone, 0.25 ms and 1 GN/m."
    )
    trials, roofs = Trials(record), {name: VARIANTS[name] for name in UNSETTLED}
    angles = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, SINGLE["friction_stable"], 80.0)
    for start, roof in roofs.items():
        thrifty = roof.preset == ""
        for axis, value in (
            (angle_axis(angles, 1.0), SINGLE["friction_stable"]),
            (spacing_axis(), SINGLE["spacing_stable"]),
        ):
            compare_thresholds(record, trials, {start: roof}, axis, value, REASONS, thrifty)
    caption = (
        "No initial stress: verdicts after 2 s, for two time steps and two contact stiffnesses; the first row has the "
        "numbers of Table 6.5. “Gone”: a corner has sunk by t; “moves on”: any other reason."
    )
    draw_verdicts(record, trials, roofs, caption)
    record.table(trials.table(), "unstressed", "No initial stress: verdicts after 2 s.")


CASES = [Case("6.6.3-stability", "Tel Beer-Sheva: stability of the single layer", "Chapter 6", stability)]
