# SPDX-License-Identifier: MIT
"""Some of the fifty tunnels of chapter 7 at their time step, half of it and a quarter: verdicts and displacements."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record
from ..tunnels import FRICTION, PUBLISHED, SPACING, TIME_STEP, Cell, cells, label

SEED = 7
COUNT = 2
#: a run of one second takes this many times the steps
PARTS = (1, 2, 4)
STEPS: int = PUBLISHED["parameters"]["steps"]
Key = tuple[int, float, int]


def subset(count: int = COUNT) -> list[Key]:
    """Span, spacing and friction angle of tunnels drawn from the fifty: a longer list begins with a shorter one."""
    fifty = [(span, spacing, phi) for span in (10, 15) for spacing in SPACING[span] for phi in FRICTION]
    return random.Random(SEED).sample(fifty, len(fifty))[:count]


def key_of(values: Mapping[str, float]) -> Key:
    """Span, spacing and friction angle."""
    return int(values["span"]), float(values["spacing"]), int(values["phi"])


def time_step(record: Record) -> None:
    """Verdicts and displacements at the step of the study, half of it and a quarter."""
    chosen = subset()
    found: dict[int, dict[Key, Cell]] = {}
    for part in PARTS:
        changes = {"dt": TIME_STEP / part, "steps": STEPS * part}
        group = cells(record, "fifty_tunnels/fifty.toml", lambda v: key_of(v) in chosen, changes, f"step-{part}")
        found[part] = {key_of(cell.values): cell for cell in group}
    record.text(
        f"{len(chosen)} tunnels, drawn from the fifty with seed {SEED}, for the same second in {STEPS} steps of "
        f"{1e3 * TIME_STEP:g} ms, the longer of the two steps of Table 7.3, and in steps of half and a quarter of it. "
        "All else is that of 7.2-fifty-tunnels. The crown's displacement is the mean over the last half of the run."
    )
    _table(record, chosen, found)
    _compare(record, chosen, found)
    _figure(record, chosen, found)


def _table(record: Record, chosen: Sequence[Key], found: Mapping[int, Mapping[Key, Cell]]) -> None:
    rows = []
    for key in chosen:
        row: dict[str, object] = {"B [m]": key[0], "S_j [m]": f"{key[1]:g}", "φ": f"{key[2]}°"}
        for part in PARTS:
            cell = found[part][key]
            row[f"verdict, Δt/{part}"] = label(cell.profile.height)
            row[f"crown down, Δt/{part} [mm]"] = -1e3 * float(cell.mean[0])
            row[f"28 m above, Δt/{part} [mm]"] = -1e3 * float(cell.mean[-1])
        rows.append(row)
    record.table(pd.DataFrame(rows), "steps", "Loosening height over the tunnel's, and mean displacements downwards.")


def _compare(record: Record, chosen: Sequence[Key], found: Mapping[int, Mapping[Key, Cell]]) -> None:
    finest = PARTS[-1]
    last = found[finest]
    why = "to compare the formulations: the same file"
    stable = sum(last[key].profile.height == 0 for key in chosen)
    record.compare(f"stable tunnels, Δt/{finest}", stable, f"of {len(chosen)}", explanation=why)
    down = [-float(last[key].mean[0]) for key in chosen]
    record.compare(
        f"mean displacement of the crown, Δt/{finest}, all tunnels", float(np.mean(down)), "m", explanation=why
    )
    for part in PARTS[:-1]:
        changed = sum(
            (found[part][key].profile.height == 0) != (found[finest][key].profile.height == 0) for key in chosen
        )
        record.compare(
            f"tunnels whose verdict is another one with Δt/{part} than with Δt/{finest}", changed,
            f"of {len(chosen)}", truth=0.0, truth_source="no dependence on the step", scale=1,
            explanation="stable, or loosened",
        )  # fmt: skip
    for part in PARTS[:-1]:
        for where, point in (("crown", 0), ("point 28 m above", -1)):
            ratios = {key: float(found[part][key].mean[point] / found[finest][key].mean[point]) for key in chosen}
            worst = max(ratios, key=lambda key: abs(ratios[key] - 1))
            record.compare(
                f"mean displacement of the {where}, Δt/{part}, over that with Δt/{finest}, the one furthest from 1",
                ratios[worst], truth=1.0, truth_source="no dependence on the step",
                explanation=f"B = {worst[0]} m, S_j = {worst[1]:g} m, {worst[2]}°; median of the "
                f"{len(chosen)} tunnels {np.median(list(ratios.values())):.3f}",
            )  # fmt: skip


def _figure(record: Record, chosen: Sequence[Key], found: Mapping[int, Mapping[Key, Cell]]) -> None:
    import matplotlib.pyplot as plt

    with record.style():
        figure, panels = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.7), layout="constrained")
        for axes, point, title in zip(panels, (0, -1), ("crown", "28 m above the crown"), strict=True):
            for number, key in enumerate(chosen):
                finest = found[PARTS[-1]][key].mean[point]
                values = [float(found[part][key].mean[point] / finest) for part in PARTS]
                axes.plot([1e3 * TIME_STEP / part for part in PARTS], values, "o-", markersize=3,
                          color=PALETTE[number % len(PALETTE)], linestyle="-" if number < len(PALETTE) else "--",
                          label=f"{key[0]} m, {key[1]:g} m, {key[2]}°")  # fmt: skip
            axes.set_title(title, fontsize=8)
            axes.set_xlabel("time step [ms]")
            axes.set_xlim(0, 1.05e3 * TIME_STEP)
        panels[0].set_ylabel("mean displacement over that\nwith a quarter of the step")
        figure.legend(
            *panels[0].get_legend_handles_labels(), fontsize=7, loc="outside right center", title="B, S_j, φ",
            title_fontsize=7,
        )  # fmt: skip
        record.figure(figure, "steps", "Displacements with three time steps.")


CASES = [
    Case("7.2-time-step", "Fifty tunnels at half and a quarter of their step", "Chapter 7", time_step, quick=False)
]
