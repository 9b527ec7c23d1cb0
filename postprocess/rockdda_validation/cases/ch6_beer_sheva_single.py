# SPDX-License-Identifier: MIT
"""§6.6.3 and §6.6.6 of the thesis: the immediate roof of the reservoir at Tel Beer-Sheva, a single jointed layer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results

from ..beer_sheva import EARLY, FREE_FALL, MIDDLE, VARIANTS, draw, draw_histories, draw_profiles, sag, slug
from ..case import Case, Record, published
from ..roofs import GRAVITY, Roof, compare_falls, follow, mean_fall

FloatArray = npt.NDArray[np.float64]
PUBLISHED = published("chapter6")
SINGLE = PUBLISHED["single"]
SOURCE = SINGLE["source"]
SPAN, THICKNESS = SINGLE["span"], SINGLE["thickness"]
ANGLE = PUBLISHED["rock"]["friction_angle"]
#: of the lower fibre: mid-span, quarters, beside the abutments
POINTS = {"middle": MIDDLE, "left quarter": -1.98, "right quarter": 2.02, "left end": -3.98, "right end": 3.98}
SHI, BOUNCING = "as described, Shi's rules", "10 kPa"
SHIFTS = ((0.0, 0.0), (0.1, 0.3), (1 / 3, 0.7))


def single_layer(record: Record) -> None:
    """Deflections after 0.25 s, profiles, pictures, what round-off does."""
    _introduction(record)
    angles = (*range(20, 81, 5), 85) if record.full else (30, 80)
    counts = (32, 16, 11, 8, 6, 5, 4, 3, 2) if record.full else (32, 2)
    early = {
        (name, blocks, float(angle)): _early(record, replace(roof, blocks=blocks, friction_angle=angle), name)
        for name, roof in VARIANTS.items()
        for blocks, angle in [*((32, angle) for angle in angles), *((blocks, ANGLE) for blocks in counts)]
    }
    _compare_early(record, early)
    _figure_early(record, early)
    if record.full:
        chosen = {
            name: {
                f"S_j = {SPAN / blocks:.3g} m": early[name, blocks, ANGLE]
                for blocks in sorted({b for n, b, a in early if n == name and a == ANGLE}, reverse=True)
                if blocks in (32, 16, 8, 6, 4, 2)
            }
            for name in (SHI, BOUNCING)
        }
        words = (
            "Fig. 6.15c redrawn, with four more points of the lower fibre: deflections at φ = 47°. Dashed: free fall."
        )
        draw_histories(record, chosen, list(POINTS), words)
    _figure_profiles(record, early, angles)
    _round_off(record)


def _introduction(record: Record) -> None:
    record.text(
        f"One layer of {THICKNESS} m over {SPAN:g} m, joints every S_j, Table 6.5 for material and numbers. Where the "
        "text is silent: g = 9.81 m/s²; abutments are blocks of 1 m × 1.5 m of the same rock, each held by three fixed "
        "points (as the text says; here both inner corners and the middle of the back), so that g2 counts from a half "
        "height of 0.75 m; blocks have equal widths, 8 m over a whole number (1.33 m stands for 1.25 m); gravity acts "
        "from the first step on; mid-span is the lower fibre 2 cm beside the middle.\n\n"
        "**The thrust at the start decides, and the text gives none.** Without any, the vertical joints carry no "
        "normal force and hence no friction: that all blocks fall together like a piston is an exact solution for any "
        "friction angle and spacing. It is not the only one: a thrust however small grows where blocks that hang on to "
        "the abutments turn and wedge. So what is found hangs on micrometres: on round-off, on abutments that give way "
        "under their own weight, on the rule by which contacts close. Four variants are run: *no thrust*, with "
        "weightless abutments, so that nothing moves them; *as described*, where the weight of the abutments on the "
        "fixed points presses on the layer ever so slightly; *as described, Shi's rules* (`preset = 'peer'`: a contact "
        "closes only beyond a penetration of 0.0002 of half the height, with a spring that adds "
        "spurious energy); and *10 kPa*: a horizontal stress at the start of 3 % of the arch's, less than "
        "the K0 stress under 10 m of rock; blocks that touch."
    )


def _early(record: Record, roof: Roof, name: str) -> Results:
    """A run to 0.25 s; measured: `POINTS`, and the lower fibre of each block."""
    width = SPAN / roof.blocks
    fibre = [(-SPAN / 2 + (i + 0.5) * width, 0.0) for i in range(roof.blocks)]
    model = roof.model([*((x, 0.0) for x in POINTS.values()), *fibre], save_every=10**6)
    folder = f"{slug(name)}-{roof.blocks}-{roof.friction_angle:g}"
    return follow(record, model, f"early-{folder}", EARLY)


# -- after 0.25 s ----------------------------------------------------------------------------------------------------


def _compare_early(record: Record, early: dict[tuple[str, int, float], Results]) -> None:
    explanations = {
        "no thrust": "the blocks fall freely until a thrust has grown out of round-off",
        "as described": "the weight of the abutments presses them against the layer by micrometres, and that is enough",
        SHI: "a penetration must form before a contact closes, so that no thrust grows",
        BOUNCING: "blocks that touch wedge at once: the layer bounces on its arch",
    }
    for name in VARIANTS:
        for row in SINGLE["deflection"]:
            results = early.get((name, round(SPAN / row["spacing"]), ANGLE))
            if results is None:
                continue
            record.compare(
                f"deflection after 0.25 s, S_j = {row['spacing']:g} m, φ = 47° ({name})",
                sag(results)[1][-1],
                "m",
                published=row["value"],
                published_source=SOURCE,
                explanation=f"free fall is {FREE_FALL:.3f} m; {explanations[name]}",
            )
        wide = early.get((name, 6, ANGLE))
        if wide is not None:
            record.compare(
                f"largest deflection within 0.25 s, S_j = 1.33 m, φ = 47° ({name})",
                sag(wide)[1].max(),
                "m",
                published=SINGLE["deflection_stable"],
                published_source=SOURCE,
                bound="upper",
                explanation=f"free fall is {FREE_FALL:.3f} m; {explanations[name]}",
            )
        angles = sorted((a, sag(r)[1].max()) for (n, b, a), r in early.items() if n == name and b == 32)
        spacings = sorted((SPAN / b, sag(r)[1].max()) for (n, b, a), r in early.items() if n == name and a == ANGLE)
        for what, unit, trials, value in (
            ("friction angle above which it hangs", "°", angles, SINGLE["friction_stable"]),
            ("joint spacing above which it hangs", "m", spacings, SINGLE["spacing_stable"]),
        ):
            # hangs: has not sunk by half of free fall
            fall = [x for x, deepest in trials if deepest > FREE_FALL / 2]
            above = [x for x, _ in trials if not fall or x > max(fall)]
            ends = f"from {trials[0][0]:.3g} to {trials[-1][0]:.3g} {unit}"
            if not fall:
                words = f"hangs at all values {ends}"
            elif not above:
                words = (
                    f"hangs at no value {ends}"
                    if len(fall) == len(trials)
                    else f"falls at {trials[-1][0]:.3g} {unit} still"
                )
            else:
                words = f"between {max(fall):.3g} and {min(above):.3g} {unit}"
            words = words.replace(" °", "°")
            condition = "S_j = 0.25 m" if unit == "°" else "φ = 47°"
            record.compare(
                f"{what} within 0.25 s, {condition} ({name})",
                0.5 * (max(fall) + min(above)) if fall and above else math.nan,
                unit,
                published=value,
                published_source=SOURCE,
                explanation=f"{words}; has sunk by less than half of free fall; {explanations[name]}. Published: "
                "stable from there on",
                found=words,
            )
    falls = {key: mean_fall(r) / (0.5 * GRAVITY * r["history/time"][-1] ** 2) for key, r in early.items()}
    for shi, label in ((False, "RockDDA's rules"), (True, "Shi's rules")):
        values = [value for (name, _, _), value in falls.items() if ("Shi" in name) == shi]
        compare_falls(record, values, label, promised=not shi)


def _figure_early(record: Record, early: dict[tuple[str, int, float], Results]) -> None:
    import matplotlib.pyplot as plt

    markers = dict(zip(VARIANTS, ("o-", "v-", "s-", "^-"), strict=True))
    with record.style():
        figure, ((left, right), (lower, last)) = plt.subplots(2, 2, figsize=(PAPER_WIDTH, 4.9), layout="constrained")
        for colour, name in zip(PALETTE[1:], VARIANTS, strict=False):
            points = sorted((a, sag(r)[1]) for (n, b, a), r in early.items() if n == name and b == 32)
            left.plot([a for a, _ in points], [d[-1] for _, d in points], markers[name], color=colour, label=name, ms=3)
            points = sorted((SPAN / b, sag(r)[1]) for (n, b, a), r in early.items() if n == name and a == ANGLE)
            right.plot([s for s, _ in points], [d[-1] for _, d in points], markers[name], color=colour, ms=3)
        spacings = [row["spacing"] for row in SINGLE["deflection"]]
        values = [row["value"] for row in SINGLE["deflection"]]
        left.plot(ANGLE, values[0], "*k", label="published", ms=8)
        right.plot(spacings, values, "*k", ms=8)
        for axes in (left, right):
            axes.axhline(FREE_FALL, color="0.5", linestyle="--", linewidth=0.8)
            axes.set_ylabel("deflection after 0.25 s [m]")
        left.text(85, FREE_FALL - 0.004, "free fall", fontsize=7, color="0.3", ha="right", va="top")
        left.set(xlabel="friction angle [°], S_j = 0.25 m")
        figure.legend(fontsize=7, loc="outside upper center", ncols=5)
        right.set(xlabel="joint spacing S_j [m], φ = 47°", xscale="log")
        right.set_xticks([0.25, 0.5, 1, 2, 4], labels=["0.25", "0.5", "1", "2", "4"])
        right.minorticks_off()
        for axes, name in ((lower, SHI), (last, BOUNCING)):
            chosen = [(b, a) for (n, b, a) in early if n == name and b == 32 and a in (30, 47, 60, 75, 80)]
            for colour, (blocks, angle) in zip(PALETTE[1:], sorted(set(chosen)), strict=False):
                axes.plot(*sag(early[name, blocks, angle]), color=colour, label=f"φ = {angle:g}°")
            time = np.linspace(0, EARLY, 50)
            axes.plot(time, 0.5 * GRAVITY * time**2, "--", color="0.5", linewidth=0.8)
            axes.set(xlabel="time [s]", ylabel="deflection [m]", title=name)
            axes.legend(fontsize=7)
            axes.set_ylim(-0.002, 0.32 if name == SHI else 0.08)
        record.figure(
            figure,
            "deflection",
            "Fig. 6.15 redrawn. Above: deflection of mid-span after 0.25 s. Below: time histories for S_j = 0.25 m. "
            "Dashed: free fall.",
        )


def _figure_profiles(record: Record, early: dict[tuple[str, int, float], Results], angles: range | tuple) -> None:
    """u, v, ω of the lower fibre, and the blocks, after 0.25 s."""
    import matplotlib.pyplot as plt

    chosen = [a for a in (30.0, 45.0, 75.0, 80.0) if a in angles]
    names = {SHI: 1.0, BOUNCING: 10.0}
    columns = {name: {f"φ = {angle:g}°": early[name, 32, angle] for angle in chosen} for name in names}
    draw_profiles(record, columns, len(POINTS), "Fig. 6.16 redrawn: lower fibre after 0.25 s, S_j = 0.25 m.")
    with record.style():
        figure, panels = plt.subplots(len(chosen), 2, figsize=(PAPER_WIDTH, 0.85 * len(chosen)), layout="constrained")
        for column, (name, scale) in enumerate(names.items()):
            for axes, angle in zip(panels[:, column], chosen, strict=True):
                draw(axes, early[name, 32, angle], scale)
                if column == 0:
                    axes.set_title(f"φ = {angle:g}°, {name}", fontsize=7)
                else:
                    axes.set_title(f"{name}, displacements × {scale:g}", fontsize=7)
        record.figure(figure, "blocks", "Fig. 6.17 redrawn: blocks after 0.25 s, S_j = 0.25 m.")
    for angle in chosen:
        for name in names:
            results = early[name, 32, angle]
            share = mean_fall(results) / (0.5 * GRAVITY * results["history/time"][-1] ** 2)
            if share > 0.99:
                why = "the layer falls as a piston, which does not turn"
            elif share < 0.25:
                why = "the layer moves by centimetres only, and turns accordingly"
            else:
                why = (
                    "0.25 m over the half span are 0.06 rad on average: the published turns belong to deflections that "
                )
                why += "are larger than the published ones"
            record.compare(
                f"largest rotation after 0.25 s, φ = {angle:g}° ({name})",
                np.abs(results["history/measured_rotation"][-1, len(POINTS) :]).max(),
                "rad",
                published=SINGLE["rotation_low" if angle < 60 else "rotation_high"],
                published_source=SOURCE,
                explanation=why,
            )


def _round_off(record: Record) -> None:
    """The same beam elsewhere: only round-off differs."""
    angles = (30.0, 47.0, 60.0, 70.0, 80.0) if record.full else (80.0,)
    rows, spread = [], {}
    for name, roof in VARIANTS.items():
        for angle in angles:
            values = []
            for i, origin in enumerate(SHIFTS):
                shifted = replace(roof, friction_angle=angle, origin=origin)
                model = shifted.model([(MIDDLE, 0.0)], save_every=10**6)
                results = follow(record, model, f"shift-{i}-{angle:g}-{list(VARIANTS).index(name)}", EARLY)
                values.append(float(sag(results)[1][-1]))
            spread[name, angle] = max(values) - min(values)
            row = {"start": name, "φ [°]": angle}
            row |= {f"origin ({x:.2f}, {y:.2f})": value for (x, y), value in zip(SHIFTS, values, strict=True)}
            rows.append(row)
    record.table(
        pd.DataFrame(rows),
        "round-off",
        "Deflection [m] after 0.25 s of the same beam at three places of the plane, S_j = 0.25 m: only the round-off "
        "of the coordinates differs.",
    )
    for name in VARIANTS:
        record.compare(
            f"largest difference of deflections by a shift of the origin ({name})",
            max(value for (n, _), value in spread.items() if n == name),
            "m",
            truth=0.0,
            truth_source="a shift changes nothing",
            scale=1.0,
            allowed=1e-4 if name == BOUNCING else None,
            explanation="0.1 mm would be 0.3 % of the swing"
            if name == BOUNCING
            else "where it is not small, the result is round-off's, not the model's",
        )


CASES = [Case("6.6.3-single-layer", "Tel Beer-Sheva: single layer", "Chapter 6", single_layer)]
