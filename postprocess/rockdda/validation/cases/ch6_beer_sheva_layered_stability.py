# SPDX-License-Identifier: MIT
"""§6.6.4 of the thesis: joint spacing and friction angle from which on ten jointed layers are stable."""

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
WIDTH = 5.0
VERDICTS = "Verdicts after 2 s on ten layers; “gone”: a corner has sunk by t; “moves on”: any other reason."
REASONS = {
    "as described": "the abutments' weight starts a thrust; what started one in the thesis is not said",
    SHI: "contacts close by this rule only when the stack falls already",
    TIGHT: "blocks that touch wedge at once; that of the thesis had no thrust at the start",
}


def spacings(record: Record) -> None:
    """From which joint spacing on the stack is stable."""
    trials = _introduction(record, "joint spacings at φ = 47°", "spacings to the next whole number of blocks")
    compare_thresholds(record, trials, ROOFS, spacing_axis(), LAYERED["spacing_stable"], REASONS, thrifty=True)
    draw_verdicts(record, trials, ROOFS, VERDICTS, ["joint spacing S_j [m], φ = 47°"])
    first = {
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
    draw_histories(record, first, list(POINTS), caption, "S_j")
    record.table(trials.table(), "verdicts", "Verdicts after 2 s.")


def angles(record: Record) -> None:
    """From which friction angle on the stack is stable."""
    trials = _introduction(record, "friction angles at S_j = 0.25 m", f"angles to {WIDTH:g}°")
    _rigid(record)
    compare_thresholds(record, trials, ROOFS, angle_axis((20.0, 30.0, 40.0, 80.0), WIDTH), None, REASONS, thrifty=True)
    draw_verdicts(record, trials, ROOFS, VERDICTS, ["friction angle [°], S_j = 0.25 m"])
    record.table(trials.table(), "verdicts", "Verdicts after 2 s.")


def _introduction(record: Record, grid: str, closeness: str) -> Trials:
    trials = Trials(record, tuple(POINTS.values()), PAIRS)
    record.text(
        f"The roof of 6.6.4-layered, run for 2 s. {CRITERION} Mid-span is m1, of the lowest layer. A value counts as "
        "stable when this holds for two time steps and two stiffnesses: "
        f"{'; '.join(trials.words(pair) for pair in range(len(PAIRS)))}. A grid of {grid} is run with the numbers of "
        "Table 6.5 (the first pair), so that a second change would be seen; all four pairs are run where the limit may "
        f"be, and the limit is bisected: {closeness}. Pairs that a failing one before them makes superfluous are not "
        "run."
    )
    return trials


def _rigid(record: Record) -> None:
    """Few blocks that touch: each layer by itself is an arch that slips at a known angle."""
    trials = Trials(record, pairs=PAIRS)
    roof = replace(VARIANTS[TIGHT], layers=LAYERED["layers"], blocks=4)

    def at(angle: float) -> Roof:
        return replace(roof, friction_angle=angle)

    found = find_threshold(
        lambda angle: trials.stands(TIGHT, at(angle)),
        (8.0, 24.0),
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
    Case("6.6.4-spacings", "Tel Beer-Sheva: joint spacings of stable layers", "Chapter 6", spacings, quick=False),
    Case("6.6.4-angles", "Tel Beer-Sheva: friction angles of stable layers", "Chapter 6", angles, quick=False),
]
