# SPDX-License-Identifier: MIT
"""The fifty tunnels of chapter 7 with joints as stiff as corners are, at half and a quarter of their time step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from rockdda.results import open as open_results

from ..case import Case, Record
from ..tunnels import FRICTION, PUBLISHED, SPACING, STIFFNESS, TIME_STEP, Cell, cells
from .ch7_time_step import STEPS, Key, key_of, subset

#: stiffness per length that g0 is by length, over what two springs of g0 at the corners of a block are
SOFTER = 6
#: parts of a run, of which the crown of a tunnel that falls goes down further in each of the last
SIXTHS, FALLING = 6, 0.1
BED = 1.0  # m, thickness of the beds
COUNT = {"vertex": 4, "length": 50}
FRACTIONS = {2: 50, 4: 23}  # parts of a step, and how many of these tunnels, drawn first, are run with them as well
VERDICTS = ("stable", "arches", "falls")


def verdict(cell: Cell) -> str:
    """Stable by both criteria; else falls or arches.

    A crown falls that goes down by more than a tenth of its way in each of the last three sixths of the run.
    """
    if cell.profile.height == 0:
        return "stable"
    with open_results(cell.file) as results:
        down = -np.asarray(results["history/measured_displacement"])[:, 0, 1]
    means = np.array([part.mean() for part in np.array_split(down, SIXTHS)])
    return "falls" if (np.diff(means)[-3:] > FALLING * means[-1]).all() else "arches"


def slips(span: float, friction: float) -> bool:
    """Does a bed as an arch of rigid blocks slip at its sides: tan φ < V/H = (γ t B/2)/(γ t B²/(8 t)) = 4 t/B?"""
    return math.tan(math.radians(friction)) < 4 * BED / span


def joint_stiffness(record: Record) -> None:
    """Verdicts of the tunnels with the g0 of the thesis, six times it, and that at fractions of the step."""
    chosen = subset(COUNT.get(record.formulation or "length", 50))
    stiff = SOFTER * STIFFNESS
    label = f"g0-{stiff:.0e}".replace("+", "")
    sets: list[tuple[str, Sequence[Key], dict[str, Any], str]] = [
        (f"{STIFFNESS:.0e}", chosen, {}, ""),
        (f"{stiff:.0e}", chosen, {"stiffness": stiff}, label),
    ]
    for n, count in FRACTIONS.items():
        changes = {"stiffness": stiff, "dt": TIME_STEP / n, "steps": n * STEPS}
        sets.append((f"{stiff:.0e}, Δt/{n}", chosen[:count], changes, f"{label}-step-{n}"))
    found: dict[str, dict[Key, Cell]] = {}
    for name, wanted, changes, folder in sets:
        group = cells(record, "fifty_tunnels/fifty.toml", _is_one_of(wanted), changes, folder)
        found[name] = {key_of(cell.values): cell for cell in group}
    verdicts = {name: {key: verdict(cell) for key, cell in group.items()} for name, group in found.items()}
    sides = [math.degrees(math.atan(4 * BED / span)) for span in (10, 15)]
    record.text(
        f"{len(chosen)} of the fifty tunnels with g0 = {STIFFNESS:.0e} N/m, that of the thesis, and with {SOFTER} "
        "times it, by which joints by length are about as stiff as with springs of g0 at their corners; "
        + ", ".join(f"{min(count, len(chosen))} of these with Δt/{n}" for n, count in FRACTIONS.items())
        + f" (Δt = {1e3 * TIME_STEP:g} ms) as well. All else is that of 7.2-fifty-tunnels.\n\n"
        "*Stable*: by both criteria. *Falls*: the crown goes down by more than a tenth of its way in each of the last "
        "three sixths of the second. *Arches*: neither; the crown has come down and holds, or still oscillates. "
        f"Statics of a bed of 1 m as an arch of rigid blocks: it slips at its sides below {sides[0]:.1f}° (span 10 m) "
        f"and {sides[1]:.1f}° (15 m), so that of all fifty the five with 10 m and 20° fall."
    )
    _table(record, chosen, verdicts)
    _compare(record, chosen, found, verdicts)


def _is_one_of(keys: Sequence[Key]) -> Callable[[dict[str, Any]], bool]:
    return lambda values: key_of(values) in keys


def _table(record: Record, chosen: Sequence[Key], verdicts: Mapping[str, Mapping[Key, str]]) -> None:
    for span in (10, 15):
        rows = []
        for spacing in SPACING[span]:
            for name, group in verdicts.items():
                keys = {phi: (span, float(spacing), phi) for phi in FRICTION}
                if any(key in chosen for key in keys.values()):
                    row: dict[str, object] = {"S_j [m]": f"{spacing:g}", "g0 [N/m]": name}
                    rows.append(row | {f"{phi}°": group.get(key, "–") for phi, key in keys.items()})
        if rows:
            caption = f"Verdicts by joint stiffness and step, span {span} m."
            record.table(pd.DataFrame(rows), f"verdicts-{span}", caption)


def _compare(
    record: Record,
    chosen: Sequence[Key],
    found: Mapping[str, Mapping[Key, Cell]],
    verdicts: Mapping[str, Mapping[Key, str]],
) -> None:
    for name, group in verdicts.items():
        for word in VERDICTS:
            count = sum(v == word for v in group.values())
            record.compare(f"tunnels, {word}, g0 = {name}", count, f"of {len(group)}", explanation="by joint stiffness")
    published = {
        (span, float(spacing), phi): height == 0
        for span in (10, 15)
        for spacing, row in zip(SPACING[span], PUBLISHED[f"span{span}"]["height"], strict=True)
        for phi, height in zip(FRICTION, row, strict=True)
    }
    for name, group in verdicts.items():
        agree = sum((group[key] == "stable") == published[key] for key in group)
        record.compare(
            f"verdicts of the thesis, stable or not, g0 = {name}", agree, f"of {len(group)}",
            published=float(len(group)),
            published_source="Tables 7.4, 7.5",
            explanation="not explained: the thesis's depend on the spacing, these on stiffness and friction",
        )  # fmt: skip
    for name, group in list(verdicts.items())[1:]:
        record.compare(
            f"tunnels that fall as statics of rigid beds says, g0 = {name}",
            sum((word == "falls") == slips(key[0], key[2]) for key, word in group.items()), f"of {len(group)}",
            truth=float(len(group)), truth_source="4 t/B > tan φ",
            explanation="beds of elastic blocks with soft joints; single blocks fall as well",
        )  # fmt: skip
    names = list(found)
    for coarse, fine in pairwise(names[1:]):
        _compare_steps(record, (coarse, fine), found, verdicts)


def _compare_steps(
    record: Record,
    names: tuple[str, str],
    found: Mapping[str, Mapping[Key, Cell]],
    verdicts: Mapping[str, Mapping[Key, str]],
) -> None:
    """What changes from the longer to the shorter step."""
    long, short = (verdicts[name] for name in names)
    both = [key for key in short if key in long]
    step = "Δt over Δt/2" if "," not in names[0] else "Δt/2 over Δt/4"
    record.compare(
        f"tunnels whose verdict is another one, {step}",
        sum(short[key] != long[key] for key in both), f"of {len(both)}", truth=0.0,
        truth_source="no dependence on the step", scale=1, explanation="stable, arches or falls",
    )  # fmt: skip
    record.compare(
        f"tunnels that fall at one step and not at the other, {step}",
        sum((short[key] == "falls") != (long[key] == "falls") for key in both), f"of {len(both)}",
        truth=0.0, truth_source="no dependence on the step", scale=1, explanation="falls, or holds",
    )  # fmt: skip
    held = [key for key in both if "falls" not in (long[key], short[key])]
    ratios = [float(found[names[0]][key].mean[0] / found[names[1]][key].mean[0]) for key in held]
    if ratios:
        record.compare(
            f"mean displacement of crowns that hold, {step}, median", float(np.median(ratios)), truth=1.0,
            truth_source="no dependence on the step",
            explanation=f"{len(ratios)} tunnels, {min(ratios):.2f} to {max(ratios):.2f}",
        )  # fmt: skip


CASES = [
    Case("7.2-joint-stiffness", "Fifty tunnels with stiffer joints", "Chapter 7", joint_stiffness, quick=False),
]
