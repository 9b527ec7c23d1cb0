# SPDX-License-Identifier: MIT
"""§6.5 of the thesis: the roof of the reservoir as a classic voussoir beam, Fig. 6.11 redrawn."""

from __future__ import annotations

import math

import numpy as np
from rockdda.analysis.voussoir import Variant, VoussoirBeam, VoussoirSolution, solve_beam
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record, published

PUBLISHED = published("chapter6")
ROCK, BEAM = PUBLISHED["rock"], PUBLISHED["voussoir"]
GRAVITY = 9.81
THICKNESSES = (0.25, 0.5, 1.0, 2.0, 3.0, 5.0)
NAMES: dict[Variant, str] = {"beer-meek": "Beer and Meek", "diederichs-kaiser": "Diederichs and Kaiser"}
PRINTED_ANGLE = 46.0  # the friction angle that the printed factors belong to


def solve(span: float, thickness: float, variant: Variant = "beer-meek", samples: int = 400) -> VoussoirSolution:
    beam = VoussoirBeam(
        span, thickness, ROCK["density"] * GRAVITY, ROCK["youngs_modulus"], ROCK["strength"], BEAM["friction_angle"]
    )
    return solve_beam(beam, variant, samples)


def by_relaxation(span: float, thickness: float) -> tuple[float, float]:
    """Smallest f_c and its n: steps (i)-(v) of the appendix repeated for each n of a grid, and the best n taken."""
    weight, modulus = ROCK["density"] * GRAVITY, ROCK["youngs_modulus"]
    best = (math.inf, math.nan)
    for n in np.linspace(0.002, 0.998, 499).tolist():
        first = arm = thickness * (1 - 2 * n / 3)
        length = span + 8 * first**2 / (3 * span)
        for _ in range(2000):
            stress = weight * span**2 / (4 * n * arm)
            shortening = 0.5 * stress * (2 / 3 + n / 2) * length / modulus
            square = first**2 - 3 * span * shortening / 8
            if square <= 0:
                arm = math.nan
                break
            change, arm = math.sqrt(square) - arm, math.sqrt(square)
            if abs(change) < 1e-14 * thickness:
                break
        stress = weight * span**2 / (4 * n * arm)
        if stress < best[0]:
            best = (stress, n)
    return best


def voussoir(record: Record) -> None:
    """Factors of safety, deflection, snap-through."""
    record.text(
        "The roof layer as a classic voussoir beam (Evans, Beer and Meek; appendix of the thesis with "
        f"n = 3/2 (1 - Z/t)): γ = {ROCK['density'] * GRAVITY / 1e3:.2f} kN/m³, "
        f"E = {ROCK['youngs_modulus'] / 1e9:.2f} GPa, strength {ROCK['strength'] / 1e6:.1f} MPa, "
        f"φ = {BEAM['friction_angle']:g}°. The truth is the relaxation of the appendix, carried out for 499 values of "
        "n of which the one with the smallest f_c is taken; the library solves a cubic and refines n. The published "
        f"factors against shear along the abutments belong to {PRINTED_ANGLE:g}°, not to the 47° that are stated."
    )
    tangent = math.tan(math.radians(BEAM["friction_angle"]))
    weight = ROCK["density"] * GRAVITY
    ratio = math.tan(math.radians(PRINTED_ANGLE)) / tangent
    for row in BEAM["shear"]:
        span, thickness = row["span"], row["thickness"]
        solution = solve(span, thickness)
        stress, n = by_relaxation(span, thickness)
        at_printed = solution.safety_shear * ratio
        record.compare(
            f"factor of safety against shear, S = {span:g} m, t = {thickness:g} m",
            solution.safety_shear,
            truth=stress * n * tangent / (weight * span),
            truth_source="relaxation on a grid of n",
            published=row["safety"],
            published_source=BEAM["source"],
            allowed=0.004,  # n of the grid is known to ±0.001 of 0.75, and f_c n goes with n
            explanation=f"with {PRINTED_ANGLE:g}° it is {at_printed:.3g}"
            + ("; the text says “2”, rounded" if thickness == 2 else ""),
        )
    solution = solve(8.0, 0.5)
    record.compare(
        "deflection of mid-span, S = 8 m, t = 0.5 m",
        1e3 * solution.deflection,
        "mm",
        published=1e3 * PUBLISHED["single"]["voussoir_deflection"],
        published_source=PUBLISHED["single"]["source"],
        explanation="Z0 - Z of the arch of smallest stress; one digit is published",
    )
    record.compare(
        "friction angle needed, S = 8 m, t = 0.5 m",
        solution.required_friction_angle,
        "°",
        published=PUBLISHED["single"]["voussoir_friction"],
        published_source=PUBLISHED["single"]["source"],
        explanation="the equations give tan φ = 2t/S; how the thesis comes to 20° is not explained",
    )
    spans = np.linspace(BEAM["span"][0], BEAM["span"][1], 45 if record.full else 23)
    solutions = {t: [solve(s, t) for s in spans.tolist()] for t in THICKNESSES}
    _snap_through(record)
    _least_crushing(record, spans, solutions)
    _figure(record, spans, solutions)


def _snap_through(record: Record) -> None:
    """The span at which the thinnest layer snaps through, of both variants."""
    for thickness in (0.25, 0.5):
        for variant, name in NAMES.items():
            low, high = 4.0, 40.0
            while high - low > 0.01:
                middle = 0.5 * (low + high)
                if solve(middle, thickness, variant).snaps_through:
                    high = middle
                else:
                    low = middle
            record.compare(
                f"span of snap-through, t = {thickness:g} m, {name}",
                low,
                "m",
                published=BEAM["snap_span"] if thickness == 0.25 and variant == "beer-meek" else None,
                published_source=BEAM["source"],
                explanation="published: below t = 0.5 m beyond 10 m, from the iteration that did not converge"
                if thickness == 0.25
                else "a layer of 0.5 m carries itself over all spans considered (5 … 16 m)",
            )


def _least_crushing(record: Record, spans: np.ndarray, solutions: dict[float, list[VoussoirSolution]]) -> None:
    """The smallest factor of safety against crushing of beams of 0.5 m and more."""
    values = {(t, s): x.safety_crushing for t in THICKNESSES[1:] for s, x in zip(spans, solutions[t], strict=True)}
    (thickness, span), least = min(values.items(), key=lambda item: item[1])
    record.compare(
        "least factor of safety against crushing, t ≥ 0.5 m, S = 5 … 16 m",
        least,
        published=BEAM["crushing_at_least"],
        published_source=BEAM["source"],
        bound="lower",
        explanation=f"published as a lower bound; found at S = {span:.3g} m, t = {thickness:g} m",
    )


def _figure(record: Record, spans: np.ndarray, solutions: dict[float, list[VoussoirSolution]]) -> None:
    import matplotlib.pyplot as plt

    with record.style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 3.0), layout="constrained")
        for colour, (thickness, row) in zip(PALETTE, solutions.items(), strict=False):
            other = [solve(s, thickness, "diederichs-kaiser").safety_crushing for s in spans.tolist()]
            left.plot(spans, [x.safety_crushing for x in row], color=colour, label=f"t = {thickness:g} m")
            left.plot(spans, other, color=colour, linestyle=":", linewidth=1.0)
        left.plot([], [], color="0.3", linestyle=":", linewidth=1.0, label="Diederichs–Kaiser")
        left.axhline(1, color="0.6", linewidth=0.8)
        left.set(xlabel="span S [m]", ylabel="factor of safety, crushing", yscale="log")
        left.legend(ncols=2, fontsize=7, loc="upper right", handlelength=1.4, columnspacing=0.9)
        left.set_ylim(1, 3000)
        for colour, span in zip(PALETTE[1:], (8.0, 12.0), strict=False):
            depths = np.geomspace(0.25 if span == 8 else 0.5, 5, 40)
            line = [solve(span, t) for t in depths.tolist()]
            right.plot(span / depths, [x.safety_shear for x in line], color=colour, label=f"S = {span:g} m, φ = 47°")
            points = [row for row in BEAM["shear"] if row["span"] == span]
            right.plot(
                [span / row["thickness"] for row in points],
                [row["safety"] for row in points],
                "o" if span == 8 else "s",
                color=colour,
                markerfacecolor="none",
                label="published",
            )
        for angle in (20, 30, 60):
            x = np.array([1.6, 32.0])
            right.plot(x, x / 2 * math.tan(math.radians(angle)), color="0.7", linewidth=0.7)
            right.text(32.5, 16 * math.tan(math.radians(angle)), f"{angle}°", color="0.4", fontsize=7, va="center")
        right.axhline(1, color="0.6", linewidth=0.8)
        right.set(xlabel="span over thickness S/t", ylabel="factor of safety, shear", xscale="log", yscale="log")
        right.set_xticks([2, 5, 10, 20], labels=["2", "5", "10", "20"])
        right.minorticks_off()
        right.legend(loc="upper left", fontsize=7)
        record.figure(
            figure,
            "safety",
            "Fig. 6.11 redrawn. Left: against crushing (curves end where the beam snaps through; dotted: average "
            "stress of Diederichs and Kaiser). Right: against shear along the abutments; grey: other friction angles, "
            "S/(2t) tan φ.",
        )


CASES = [Case("6.5-voussoir", "Tel Beer-Sheva: classic voussoir beam", "Chapter 6", voussoir)]
