# SPDX-License-Identifier: MIT
"""The single layer of Tel Beer-Sheva at its time step, half of it and a quarter: verdicts and deflections."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..beer_sheva import BASE, COUNTS, CRITERION, EARLY, MIDDLE, UNTIL, VARIANTS, sag, slug
from ..case import Case, Record
from ..roofs import Roof, Verdict, follow, judge

SEED = 7
COUNT = 8
PARTS = (1, 2, 4)
STARTS = ("as described", "10 kPa")
ANGLES = (20.0, 30.0, 40.0, 47.0, 60.0, 78.0)
Key = tuple[str, int, float]


def subset(count: int = COUNT) -> list[Key]:
    """Start, blocks and friction angle of layers drawn from those of the case 6.6.3-stability."""
    layers = [(start, 32, angle) for start in STARTS for angle in ANGLES]
    layers += [(start, blocks, 47.0) for start in STARTS for blocks in COUNTS if blocks != 32]
    return random.Random(SEED).sample(layers, count)


def time_step(record: Record) -> None:
    """Verdicts after 2 s and deflections."""
    chosen = subset()
    found = {key: [_run(record, key, part) for part in PARTS] for key in chosen}
    finest = len(PARTS) - 1
    record.text(
        f"{len(chosen)} layers, drawn with seed {SEED} from those of 6.6.3-stability: two starts, friction angles at "
        f"S_j = 0.25 m and spacings at 47°; Δt = {1e3 * BASE.dt:g} ms is that of Table 6.5. {CRITERION}"
    )
    for i, part in enumerate(PARTS[:-1]):
        changed = sum(runs[i][0].stable != runs[finest][0].stable for runs in found.values())
        record.compare(
            f"layers whose verdict is another one with Δt/{part} than with Δt/{PARTS[finest]}", changed,
            f"of {len(chosen)}", truth=0.0, truth_source="no dependence on the step", scale=1,
        )  # fmt: skip
        ratios = {key: runs[i][1] / runs[finest][1] for key, runs in found.items()}
        worst = max(ratios, key=lambda key: abs(ratios[key] - 1))
        record.compare(
            f"deflection after 0.25 s, Δt/{part}, over that with Δt/{PARTS[finest]}, the one furthest from 1",
            ratios[worst], truth=1.0, truth_source="no dependence on the step",
            explanation=f"{_words(worst)}; median of the {len(chosen)} layers {np.median(list(ratios.values())):.3f}",
        )  # fmt: skip
    record.compare(
        f"layers that are stable, Δt/{PARTS[finest]}", sum(runs[finest][0].stable for runs in found.values()),
        f"of {len(chosen)}", explanation="to compare the formulations: the same file, with g0 at each corner, or over "
        "the mean edge length on every joint",
    )  # fmt: skip
    rows = []
    for key, runs in found.items():
        row: dict[str, object] = {"start": key[0], "S_j [m]": BASE.span / key[1], "φ": f"{key[2]:g}°"}
        for part, (verdict, early) in zip(PARTS, runs, strict=True):
            row[f"verdict, Δt/{part}"] = verdict.reason
            row[f"after 0.25 s, Δt/{part} [mm]"] = 1e3 * early
        rows.append(row)
    record.table(pd.DataFrame(rows), "steps", "Verdicts after 2 s and deflections of mid-span after 0.25 s.")
    _figure(record, found)


def _words(key: Key) -> str:
    return f"{key[0]}, S_j = {BASE.span / key[1]:.3g} m, {key[2]:g}°"


def _run(record: Record, key: Key, part: int) -> tuple[Verdict, float]:
    """Verdict, and the deflection after 0.25 s [m]."""
    start, blocks, angle = key
    roof: Roof = replace(VARIANTS[start], blocks=blocks, friction_angle=angle, dt=BASE.dt / part)
    name = f"{slug(start)}-{blocks}-{angle:g}-{part}"
    results = follow(record, roof.model([(MIDDLE, 0.0)], save_every=10**6), name, UNTIL, sunk=roof.thickness)
    times, down = sag(results)
    return judge(times, down, roof.thickness, UNTIL), float(np.interp(EARLY, times, down))


def _figure(record: Record, found: dict[Key, list[tuple[Verdict, float]]]) -> None:
    import matplotlib.pyplot as plt

    with record.style():
        figure, axes = plt.subplots(figsize=(PAPER_WIDTH, 2.6), layout="constrained")
        for number, (key, runs) in enumerate(found.items()):
            axes.plot(
                [1e3 * BASE.dt / part for part in PARTS], [early / runs[-1][1] for _, early in runs], "o-",
                markersize=3, color=PALETTE[number % len(PALETTE)], label=_words(key),
                linestyle="-" if number < len(PALETTE) else "--",
            )  # fmt: skip
        axes.set_xlim(0, 1.05e3 * BASE.dt)
        axes.set_xlabel("time step [ms]")
        axes.set_ylabel("deflection after 0.25 s over that\nwith a quarter of the step")
        figure.legend(fontsize=7, loc="outside right center")
        record.figure(figure, "steps", "Deflection of mid-span after 0.25 s with three time steps.")


CASES = [
    Case("6.6.3-time-step", "Tel Beer-Sheva at half and a quarter of its step", "Chapter 6", time_step, quick=False)
]
