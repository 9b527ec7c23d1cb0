# SPDX-License-Identifier: MIT
"""§6.6.4 of the thesis: joint spacing and friction angle from which on ten jointed layers are stable."""

from __future__ import annotations

import math
from dataclasses import replace

from ..beer_sheva import (
    BASE,
    COUNTS,
    CRITERION,
    Trials,
    angle_axis,
    compare_thresholds,
    draw_histories,
    draw_verdicts,
    spacing_axis,
)
from ..case import Case, Record
from .ch6_beer_sheva_layered import ANGLE, LAYERED, NAMES, POINTS, ROOFS, SHI, SPAN, TIGHT

#: Table 6.5 first; with twice its time step, since half of it would double the hours of these runs
PAIRS = tuple((dt, g0) for dt in (BASE.dt, 2 * BASE.dt) for g0 in (BASE.stiffness, 5 * BASE.stiffness))
#: blocks of a layer for which the angle is bisected, and to what width [deg]; 32 blocks take far longer
WIDE, WIDTH = 4, 2.0
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
    draw_histories(record, first, list(NAMES.values()), caption, "S_j")
    record.table(trials.table(), "verdicts", "Verdicts after 2 s.")


def angles(record: Record) -> None:
    """From which friction angle on the stack is stable."""
    roofs = {name: replace(roof, blocks=WIDE) for name, roof in ROOFS.items()}
    spacing = f"S_j = {roofs[TIGHT].spacing:g} m"
    trials = _introduction(record, f"friction angles at {spacing}", f"angles to {WIDTH:g}°")
    rigid = {TIGHT: (math.degrees(math.atan(4 * BASE.thickness / SPAN)), "rigid blocks, each layer alone: atan 4t/S")}
    axis = angle_axis((8.0, 24.0, ANGLE, 80.0), WIDTH)
    open_ = "not explained; a single layer of these blocks needs 14 to 15°, and the truth leaves out what layers do to "
    reasons = REASONS | {TIGHT: open_ + "each other: they sag differently, and press and rub on their neighbours"}
    compare_thresholds(record, trials, roofs, axis, None, reasons, thrifty=True, truths=rigid)
    draw_verdicts(record, trials, roofs, VERDICTS, [f"friction angle [°], {spacing}"])
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


CASES = [
    Case("6.6.4-spacings", "Tel Beer-Sheva: joint spacings of stable layers", "Chapter 6", spacings, quick=False),
    Case("6.6.4-angles", "Tel Beer-Sheva: friction angles of stable layers", "Chapter 6", angles, quick=False),
]
