# SPDX-License-Identifier: MIT
"""§6.6.4 of the thesis: friction angle and joint spacing from which on ten jointed layers are stable."""

from __future__ import annotations

import math
from dataclasses import replace

from ..beer_sheva import (
    BASE,
    COUNTS,
    CRITERION,
    VARIANTS,
    Trials,
    angle_axis,
    compare_thresholds,
    draw_histories,
    draw_verdicts,
    spacing_axis,
)
from ..case import Case, Record
from ..roofs import Roof
from ..thresholds import find_threshold
from .ch6_beer_sheva_layered import ANGLE, LAYERED, POINTS, ROOFS, SHI, TIGHT

#: Table 6.5 first; with twice its time step, since half of it would double the hours of these runs
PAIRS = tuple((dt, g0) for dt in (BASE.dt, 2 * BASE.dt) for g0 in (BASE.stiffness, 5 * BASE.stiffness))
#: bisected angles are as close as this [deg]
WIDTH = 2.5
REASONS = {
    "as described": "the abutments' weight starts a thrust; what started one in the thesis is not said",
    SHI: "contacts close by this rule only when the stack falls already",
    TIGHT: "blocks that touch wedge at once; that of the thesis had no thrust at the start",
}


def layered_stability(record: Record) -> None:
    """Thresholds of the stack by the criterion of the single layer."""
    trials = Trials(record, tuple(POINTS.values()), PAIRS)
    record.text(
        f"The roof of 6.6.4-layered, run for 2 s. {CRITERION} Mid-span is m1, of the lowest layer. A value counts as "
        "stable when this holds for two time steps and two stiffnesses: "
        f"{'; '.join(trials.words(pair) for pair in range(len(PAIRS)))}. A grid of friction angles at "
        "S_j = 0.25 m and of spacings at φ = 47° is run with the numbers of Table 6.5 (the first pair), so that a "
        "second change would be seen; all four pairs are run where the limit may be, and the limit is bisected: angles "
        f"to {WIDTH:g}°, spacings to the next whole number of blocks. Pairs that a failing one before them makes "
        "superfluous are not run."
    )
    _rigid(record, trials)
    compare_thresholds(record, trials, ROOFS, spacing_axis(), LAYERED["spacing_stable"], REASONS, thrifty=True)
    angles = angle_axis((20.0, 30.0, ANGLE, 80.0), WIDTH)
    compare_thresholds(record, trials, ROOFS, angles, None, REASONS, thrifty=True)
    draw_verdicts(
        record,
        trials,
        ROOFS,
        "Verdicts after 2 s on ten layers; “gone”: a corner has sunk by t; “moves on”: any other reason.",
    )
    kept = {
        name: {
            f"{BASE.span / blocks:.2g} m": trials.results[name, blocks, ANGLE, 0]
            for blocks in COUNTS
            if (name, blocks, ANGLE, 0) in trials.results
        }
        for name in ROOFS
    }
    caption = (
        "Time histories of m1 to m5 over 2 s at φ = 47°, with the numbers of Table 6.5: stable roofs ring about their "
        "equilibrium. Dashed: free fall."
    )
    draw_histories(record, kept, list(POINTS), caption, "S_j")
    record.table(trials.table(), "stability", "Verdicts after 2 s.")


def _rigid(record: Record, trials: Trials) -> None:
    """Few blocks that touch: each layer by itself is an arch that slips at a known angle."""
    roof = replace(VARIANTS[TIGHT], layers=LAYERED["layers"], blocks=4)

    def at(angle: float) -> Roof:
        return replace(roof, friction_angle=angle)

    found = find_threshold(
        lambda angle: trials.stands(TIGHT, at(angle)),
        (8.0, 24.0, 40.0),
        lambda low, high: None if high - low <= 2.0 else 0.5 * (low + high),
        lambda angle: trials.verdict(TIGHT, at(angle), 0).stable,
    )
    record.compare(
        f"friction angle of stability, S_j = {roof.spacing:g} m ({TIGHT}; all four pairs)",
        0.5 * sum(found.bracket) if found.bracket else math.nan,
        "°",
        truth=math.degrees(math.atan(4 * roof.thickness / roof.span)),
        truth_source="rigid blocks, each layer by itself: atan 4t/S",
        scale=1.0,
        explanation=f"{found.words('°')}; blocks that give way sink before the thrust is there, and need more",
        found=found.words("°"),
    )


CASES = [
    Case("6.6.4-stability", "Tel Beer-Sheva: stability of ten layers", "Chapter 6", layered_stability, quick=False)
]
