# SPDX-License-Identifier: MIT
"""§6.6.1 of the thesis: open-close iterations of a stack of jointed beams against g0, g1 and g2 (Fig. 6.13)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH

from ..case import Case, Record, published
from ..roofs import GRAVITY, Roof, compare_falls, deepest_fall, follow, mean_fall

PUBLISHED = published("chapter6")["convergence"]
SOURCE = PUBLISHED["source"]
UNTIL, RATIOS = PUBLISHED["until"], PUBLISHED["ratio"]
STIFFNESSES = (50e6, 100e6, 500e6, 1e9, 5e9, 10e9, 50e9, 100e9)
#: blocks in the lowest layer, and in the uppermost one where the bond alone does not make the published number
LAYERS = {67: (6, 0), 98: (9, 11), 168: (16, 18)}
MOST_STEPS = 8  # a run that needs more than so many times the nominal steps counts as diverging


@dataclass(frozen=True)
class Outcome:
    rounds: float  #: of accepted steps, on average
    cuts: float  #: attempts that were cut, per accepted step
    steps: float  #: over the nominal number
    fall: float  #: of the centre of mass, over g t²/2
    deepest: float  #: of the corner that has sunk most, over g t²/2
    diverges: bool


def convergence(record: Record) -> None:
    """Average number of iterations per step."""
    sizes = tuple(LAYERS) if record.full else (67,)
    stiffnesses = STIFFNESSES if record.full else (50e6, 1e9)
    ratios = RATIOS if record.full else (0.01, 0.001)
    record.text(
        f"Ten layers of 0.5 m over 8 m, φ = {PUBLISHED['friction_angle']:g}°, "
        f"E = {PUBLISHED['youngs_modulus'] / 1e9:g} GPa, k01 = 1, {UNTIL} s, g1 = g2. The text gives the numbers of "
        "blocks and names Fig. 6.14b for the geometry; here: two abutments and layers in bond, alternately 6 and 7 "
        "blocks (67), 9 and 10 (98) or 16 and 17 (168), the uppermost layer of the last two with one block more. No "
        "initial stress (the text names none). “RockDDA” are the default contact rules with at most 20 rounds, “Shi” "
        "the closing rule of Shi's programs (`preset = 'peer'`) with at most 6, as in the thesis. Counted are the "
        "rounds of accepted steps; cut attempts are listed beside them. The deflection depends on g0 far more than the "
        "number of iterations: without a thrust at the start a roof that falls like a piston is a solution, too, and "
        "which one is found hangs on g0 and on round-off (see 6.6.3)."
    )
    outcomes = {
        (preset, blocks, ratio, stiffness): _outcome(record, preset, blocks, ratio, stiffness)
        for preset in ("", "peer")
        for blocks in sizes
        for ratio in ratios
        for stiffness in (stiffnesses if preset == "" or not record.full else STIFFNESSES[1::2])
    }
    _comparisons(record, outcomes)
    rows = [
        {
            "rules": "Shi" if preset else "RockDDA",
            "blocks": blocks,
            "g1 = g2": ratio,
            "g0 [MN/m]": stiffness / 1e6,
            "iterations per step": round(x.rounds, 2),
            "cuts per step": round(x.cuts, 2),
            "steps / nominal": round(x.steps, 2),
            "fall of the mass / free fall": round(x.fall, 4),
            "of the deepest corner": round(x.deepest, 3),
            "": "diverges" if x.diverges else "",
        }
        for (preset, blocks, ratio, stiffness), x in outcomes.items()
    ]
    record.table(pd.DataFrame(rows), "iterations", "All runs.")
    _figure(record, outcomes, ratios, sizes)


def _outcome(record: Record, preset: str, blocks: int, ratio: float, stiffness: float) -> Outcome:
    lowest, top = LAYERS[blocks]
    roof = Roof(
        8.0,
        0.5,
        lowest,
        layers=10,
        top=top,
        friction_angle=PUBLISHED["friction_angle"],
        youngs_modulus=PUBLISHED["youngs_modulus"],
        stiffness=stiffness,
        dt=ratio,
        displacement_ratio=ratio,
        preset=preset,
    )
    nominal = round(UNTIL / ratio)
    model = roof.model([], save_every=10**6, steps=MOST_STEPS * nominal)
    if preset:
        model.options["time"] = {"max_open_close": 6}
    name = f"{preset or 'default'}-{blocks}-{ratio:g}-{stiffness / 1e6:g}"
    results = follow(record, model, name, UNTIL)
    assert results.n_blocks == blocks
    history = results.history()
    if not len(history):
        return Outcome(math.nan, math.nan, math.nan, math.nan, math.nan, True)
    time = float(history["time"].iloc[-1])
    return Outcome(
        float(history["open_close_iterations"].mean()),
        float(history["attempts"].mean()) - 1,
        len(history) * UNTIL / time / nominal,
        mean_fall(results) / (0.5 * GRAVITY * time**2),
        deepest_fall(results) / (0.5 * GRAVITY * time**2),
        time < UNTIL * (1 - 1e-9),
    )


def _comparisons(record: Record, outcomes: dict[tuple[str, int, float, float], Outcome]) -> None:
    for row in PUBLISHED["iterations"]:
        ratio = row["ratio"]
        for preset, name in (("", "RockDDA"), ("peer", "Shi")):
            found = {key: x for key, x in outcomes.items() if key[0] == preset and key[2] == ratio}
            if not found:
                continue
            values = [x.rounds for x in found.values() if math.isfinite(x.rounds)]
            for what, value in (("smallest", min(values)), ("largest", max(values))):
                record.compare(
                    f"{what} average of iterations per step, g1 = g2 = {ratio:g} ({name})",
                    value,
                    published=row.get(what),
                    published_source=SOURCE,
                    explanation=f"published: {row['text']}",
                )
    computed = {key: x for key, x in outcomes.items() if key[0] == ""}
    for preset, name in (("", "RockDDA"), ("peer", "Shi")):
        found = {key: x for key, x in outcomes.items() if key[0] == preset}
        lost = [f"{key[1]} blocks, g1 = {key[2]:g}, {key[3] / 1e6:g} MN/m" for key, x in found.items() if x.diverges]
        record.compare(
            f"share of runs that need more than {MOST_STEPS} times the nominal steps ({name})",
            len(lost) / len(found),
            explanation=f"{'; '.join(lost) or 'none'}. Published: 67 blocks diverge at g1 = 0.01 beyond 100 MN/m",
        )
    compare_falls(record, [x.fall for x in computed.values()], "RockDDA")
    for preset, name in (("", "RockDDA"), ("peer", "Shi")):
        falls = [x.deepest for key, x in outcomes.items() if key[0] == preset and math.isfinite(x.deepest)]
        record.compare(
            f"largest fall of any corner over g t²/2 ({name})",
            max(falls),
            explanation="more than 1 only where something pushes down: layers above that have been stopped later, or "
            "springs that come into being with a penetration, and with spurious energy (Shi's rule)",
        )


def _figure(record: Record, outcomes: dict, ratios: Sequence[float], sizes: tuple[int, ...]) -> None:
    import matplotlib.pyplot as plt

    with record.style():
        columns = 2
        figure, panels = plt.subplots(
            math.ceil(len(ratios) / columns),
            columns,
            figsize=(PAPER_WIDTH, 3.8),
            layout="constrained",
            sharex=True,
            squeeze=False,
        )
        for axes, ratio in zip(panels.flat, ratios, strict=False):
            for colour, blocks in zip(PALETTE[1:], sizes, strict=False):
                for preset, line in (("", "o-"), ("peer", "s:")):
                    keys = [key for key in outcomes if key[:3] == (preset, blocks, ratio)]
                    label = f"{blocks} blocks{', Shi' if preset else ''}"
                    x = [key[3] / 1e6 for key in keys]
                    y = [outcomes[key].rounds for key in keys]
                    axes.plot(x, y, line, color=colour, markersize=3.5, linewidth=1.0, label=label)
                    fell = [(a, b) for a, b, key in zip(x, y, keys, strict=True) if outcomes[key].fall > 0.99]
                    axes.plot([a for a, _ in fell], [b for _, b in fell], line[0], color=colour, ms=3.5, mfc="white")
                    lost = [(a, b) for a, b, key in zip(x, y, keys, strict=True) if outcomes[key].diverges]
                    axes.plot([a for a, _ in lost], [b for _, b in lost], "x", color=colour, markersize=9)
            axes.set(xscale="log", title=f"g1 = g2 = {ratio:g}")
            axes.set_ylim(0, None)
            low, high = (
                next(row for row in PUBLISHED["iterations"] if row["ratio"] == ratio).get(k)
                for k in ("smallest", "largest")
            )
            for value in (low, high):
                if value is not None:
                    axes.axhline(value, color="0.6", linewidth=0.7, linestyle="--")
        for axes in panels[-1]:
            axes.set_xlabel("contact stiffness g0 [MN/m]")
        for axes in panels[:, 0]:
            axes.set_ylabel("iterations per step")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, fontsize=7, ncols=3, loc="outside lower center")
        record.figure(
            figure,
            "iterations",
            "Fig. 6.13 redrawn: average number of iterations per step. Dashed: smallest and largest published "
            "averages; hollow: the roof falls like a piston, with few contacts to settle; crosses: runs that needed "
            "too many steps.",
        )


CASES = [Case("6.6.1-iterations", "Iterations against g0, g1, g2 of layered roofs", "Chapter 6", convergence)]
