# SPDX-License-Identifier: MIT
"""§6.6.4 of the thesis: the roof of the reservoir at Tel Beer-Sheva as a stack of ten jointed layers."""

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
LAYERED = PUBLISHED["layered"]
SOURCE = LAYERED["source"]
ANGLE = PUBLISHED["rock"]["friction_angle"]
SHI, TIGHT = "as described, Shi's rules", "10 kPa"
ROOFS = {name: replace(VARIANTS[name], layers=LAYERED["layers"]) for name in ("as described", SHI, TIGHT)}
SPAN = ROOFS[TIGHT].span
#: lower fibre of the first, of the sixth layer, upper fibre of the last one; ends of the sixth layer
POINTS = {
    "m1": (MIDDLE, 0.0),
    "m2": (MIDDLE, 2.51),
    "m3": (MIDDLE, 4.99),
    "m4": (-SPAN / 2 + MIDDLE, 2.51),
    "m5": (SPAN / 2 - MIDDLE, 2.51),
}
#: what the pictures call them
NAMES = {
    "m1": "m1: mid-span,\nlowest fibre",
    "m2": "m2: mid-span,\nhalf height",
    "m3": "m3: mid-span,\nhighest fibre",
    "m4": "m4: left\nabutment,\nhalf height",
    "m5": "m5: right\nabutment,\nhalf height",
}
REASONS = {
    "as described": "the abutments' weight makes a thrust, and the stack falls freely until it is there",
    SHI: "contacts close by this rule only when the stack falls already, and no thrust is there",
    TIGHT: "blocks that touch wedge at once, and the stack bounces on its arches",
}
Runs = dict[tuple[str, int, float], Results]


def layered(record: Record) -> None:
    """Deflections after 0.25 s, time histories, profiles, pictures."""
    record.text(
        "Ten layers of 0.5 m, 8 m wide, Table 6.5, as in the case of the single layer; the half height that g2 counts "
        "from is 3 m. Joints are in bond: the figure is not at hand, but 67, one of the numbers of blocks of 6.6.1, is "
        "that of two abutments and ten layers in bond. m2 is the lower fibre of the sixth layer, m3 the upper one of "
        "the tenth, m4 and m5 are the ends of the sixth layer. The start is *as described*, without initial stress, by "
        "RockDDA's and by Shi's rules, or under 10 kPa of horizontal stress."
    )
    angles = (20, 30, 40, 50, 60, 70, 80) if record.full else ()
    counts = (32, 16, 11, 8, 4, 2) if record.full else (8,)
    runs: Runs = {
        (name, blocks, float(angle)): _early(record, replace(roof, blocks=blocks, friction_angle=angle), name)
        for name, roof in ROOFS.items()
        for blocks, angle in [*((32, angle) for angle in angles), *((blocks, ANGLE) for blocks in counts)]
    }
    _compare(record, runs)
    _bounds(record, runs)
    _figure(record, runs)
    if record.full:
        _histories(record, runs)
        _pictures(record, runs)


def _early(record: Record, roof: Roof, name: str) -> Results:
    width = SPAN / roof.blocks
    fibre = [(-SPAN / 2 + (i + 0.5) * width, 0.0) for i in range(roof.blocks)]
    model = roof.model([*POINTS.values(), *fibre], save_every=10**6)
    return follow(record, model, f"early-{slug(name)}-{roof.blocks}-{roof.friction_angle:g}", EARLY)


def _compare(record: Record, runs: Runs) -> None:
    for name in ROOFS:
        for row in LAYERED["deflection"]:
            results = runs.get((name, round(SPAN / row["spacing"]), ANGLE))
            if results is None:
                continue
            for i, point in enumerate(("m1", "m2", "m3")):
                value, only_bound = row["value"][i], i > 0 or row["spacing"] > 0.7
                record.compare(
                    f"deflection of {point} after 0.25 s, S_j = {row['spacing']:g} m, φ = 47° ({name})",
                    sag(results, i)[1][-1],
                    "m",
                    published=value,
                    published_source=SOURCE,
                    bound="upper" if only_bound else "",
                    explanation=f"the published value exceeds free fall, {FREE_FALL:.3f} m: times or deflections of "
                    "the thesis are not what they are said to be"
                    if value > FREE_FALL
                    else f"free fall is {FREE_FALL:.3f} m; {REASONS[name]}",
                )
    rows = [
        {"start": name, "S_j [m]": SPAN / blocks, "φ [°]": angle}
        | {f"{point} [m]": sag(results, i)[1][-1] for i, point in enumerate(POINTS)}
        | {"largest m1 [m]": sag(results)[1].max()}
        for (name, blocks, angle), results in runs.items()
    ]
    record.table(pd.DataFrame(rows), "deflections", "Deflections after 0.25 s, and the largest of m1 until then.")


def _bounds(record: Record, runs: Runs) -> None:
    """Nothing falls faster than freely."""
    for shi, label in ((False, "RockDDA's rules"), (True, "Shi's rules")):
        found = {key: results for key, results in runs.items() if (key[0] == SHI) == shi}
        falls = [mean_fall(r) / (0.5 * GRAVITY * r["history/time"][-1] ** 2) for r in found.values()]
        compare_falls(record, falls, label, promised=not shi)
        deepest = max(found, key=lambda key: float(sag(runs[key])[1][-1]))
        record.compare(
            f"largest deflection of m1 after 0.25 s ({label})",
            sag(runs[deepest])[1][-1],
            "m",
            published=max(LAYERED["deflection_low"][0], LAYERED["deflection"][0]["value"][0]),
            published_source=SOURCE,
            explanation=f"at S_j = {SPAN / deepest[1]:g} m, φ = {deepest[2]:g}°; free fall is {FREE_FALL:.4f} m",
        )
    published_fall = LAYERED["deflection"][0]["value"][0]
    record.compare(
        "time of free fall through the published deflection of m1",
        math.sqrt(2 * published_fall / GRAVITY),
        "s",
        published=EARLY,
        published_source=SOURCE,
        explanation=f"{published_fall} m cannot be reached from rest within {EARLY} s unless something pushes down; "
        "contacts that close by Shi's rule can, with spurious energy",
    )


def _figure(record: Record, runs: Runs) -> None:
    import matplotlib.pyplot as plt

    markers = dict(zip(ROOFS, ("v-", "s-", "^-"), strict=True))
    with record.style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.7), layout="constrained")
        for colour, name in zip(PALETTE[1:], ROOFS, strict=False):
            for axes, points in (
                (left, sorted((a, r) for (n, b, a), r in runs.items() if n == name and b == 32)),
                (
                    right,
                    sorted((SPAN / b, r) for (n, b, a), r in runs.items() if n == name and a == ANGLE),
                ),
            ):
                for i, (width, label) in enumerate(((1.3, name), (0.8, ""), (0.5, ""))):
                    axes.plot(
                        [x for x, _ in points],
                        [sag(r, i)[1][-1] for _, r in points],
                        markers[name],
                        color=colour,
                        label=label or None,
                        linewidth=width,
                        markersize=3 if i == 0 else 1.5,
                    )
        for row in LAYERED["deflection"]:
            right.plot(
                [row["spacing"]] * 3, row["value"], "*k", ms=6, label="published" if row["spacing"] < 0.3 else None
            )
        left.plot([45] * 3, LAYERED["deflection_low"], "*k", ms=6)
        for axes in (left, right):
            axes.axhline(FREE_FALL, color="0.5", linestyle="--", linewidth=0.8)
            axes.set_ylabel("deflection after 0.25 s [m]")
        left.set(xlabel="friction angle [°], S_j = 0.25 m")
        right.set(xlabel="joint spacing S_j [m], φ = 47°", xscale="log")
        right.set_xticks([0.25, 0.5, 1, 2, 4], labels=["0.25", "0.5", "1", "2", "4"])
        right.minorticks_off()
        figure.legend(*right.get_legend_handles_labels(), fontsize=7, loc="outside upper center", ncols=4)
        record.figure(
            figure,
            "deflection",
            "Fig. 6.18a redrawn: deflection of m1 (thick), m2, m3 (thin) after 0.25 s. Dashed: free fall.",
        )


def _histories(record: Record, runs: Runs) -> None:
    """All five points."""
    columns = {
        name: {
            f"{SPAN / blocks:.2g} m": runs[name, blocks, ANGLE]
            for blocks in sorted({b for n, b, a in runs if n == name and a == ANGLE}, reverse=True)
        }
        for name in ROOFS
    }
    caption = (
        "Fig. 6.18b to d redrawn, with the points at the abutments: time histories of m1 to m5 at φ = 47°. Dashed: "
        "free fall. Where all five points follow it the stack falls as a piston."
    )
    draw_histories(record, columns, list(NAMES.values()), caption, "S_j")


def _pictures(record: Record, runs: Runs) -> None:
    """Profiles of the lowest fibre, and the blocks."""
    import matplotlib.pyplot as plt

    chosen = (30.0, 50.0, 70.0)
    columns = {name: {f"φ = {angle:g}°": runs[name, 32, angle] for angle in chosen} for name in (SHI, TIGHT)}
    draw_profiles(record, columns, len(POINTS), "Lowest fibre of the stack after 0.25 s, S_j = 0.25 m.")
    with record.style():
        figure, panels = plt.subplots(2, 2, figsize=(PAPER_WIDTH, 3.5), layout="constrained")
        for column, (name, scale) in enumerate(((SHI, 1.0), (TIGHT, 10.0))):
            for axes, angle in zip(panels[:, column], chosen[1:], strict=True):
                draw(axes, runs[name, 32, angle], scale)
                axes.set_title(f"φ = {angle:g}°, {name}" + (f", × {scale:g}" if scale > 1 else ""), fontsize=7)
        record.figure(
            figure,
            "blocks",
            "Fig. 6.19 redrawn: blocks after 0.25 s, S_j = 0.25 m; right: displacements ten times enlarged.",
        )


CASES = [Case("6.6.4-layered", "Tel Beer-Sheva: ten layers", "Chapter 6", layered)]
