# SPDX-License-Identifier: MIT
"""Pictures of answers: how far numbers change; factors of runs, what they depend on, and the surface through them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..critical import search_title
from ..errors import InputError
from ..plot.style import PALETTE, PAPER_WIDTH, new_axes, style
from ..text import plain_text, short
from .failure import points_of, wilson
from .verdict import percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KINDS = {
    "step": (PALETTE[1], "o"), "corners": (PALETTE[3], "s"), "cells": (PALETTE[6], "D"),
    "elements": (PALETTE[4], "P"), "solver": (PALETTE[5], "v"), "joint stiffness": (PALETTE[2], "^"),
}  # fmt: skip
MOST = 24  # numbers of a picture: of more those that change most
LEAST = 1e-4  # share up to which changes are drawn in proportion
SIDES = {"stands": PALETTE[1], "fails": PALETTE[2]}
MARKERS = ("o", "s", "^", "D")  # of mechanisms


def draw_convergence(found: Any, axes: Axes | None = None) -> Axes:
    """How far every number changes, as shares of it: a row a number, a sign a variant."""
    from matplotlib.ticker import FuncFormatter

    rows = [one for one in found.findings if one.value is not None]
    if len(rows) > MOST:
        most = sorted(rows, key=lambda one: -max((abs(c or 0.0) / one.scale for c in one.changes.values()), default=0))
        kept = {id(one) for one in most[:MOST]}
        rows = [one for one in rows if id(one) in kept]
    with style():
        _, axes = new_axes(axes, (PAPER_WIDTH, 1.6 + 0.3 * max(len(rows), 2)))
        limit = 100 * found.limit
        axes.axvspan(-limit, limit, color="#E8EEF2", lw=0, zorder=0)
        axes.axvline(0, color="#8A8A8A", lw=0.6, zorder=1)
        largest = limit
        for variant in found.variants[1:]:
            colour, marker = KINDS[variant.kind]
            hollow = variant.step == 0.5 or variant.stiffness == 0.5
            lower = 0.13 * (list(KINDS).index(variant.kind) - 2)  # so that signs do not hide each other
            shown = [(k + lower, one.changes.get(variant.name), one.scale) for k, one in enumerate(rows)]
            points = [(k, 100 * change / scale) for k, change, scale in shown if change is not None and scale > 0]
            largest = max([largest, *(abs(x) for _, x in points)])
            axes.plot(
                [x for _, x in points], [k for k, _ in points], marker, ms=5, mew=1.1, color=colour, label=variant.name,
                mfc="none" if hollow else colour, clip_on=False, zorder=3,
            )  # fmt: skip
        axes.set_xscale("symlog", linthresh=100 * LEAST, linscale=0.6)
        axes.set_xlim(-2 * largest, 2 * largest)
        reach = int(np.ceil(np.log10(largest)))
        ticks = [10.0**power for power in range(-2, reach + 1)][:: 1 if reach < 2 else 2]
        axes.set_xticks([*(-x for x in reversed(ticks)), 0.0, *ticks])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}".replace("-", "\N{MINUS SIGN}")))
        axes.minorticks_off()
        axes.set_xlabel(f"change [% of the number]; grey: the limit, {limit:g} %")
        axes.set_yticks(range(len(rows)))
        axes.set_yticklabels([plain_text(short(o.title, 42)) for o in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
        if found.title:
            axes.set_title(plain_text(short(found.title, 70)))
    return axes


def draw_reliability(found: Any, kind: str | None = None, axes: Axes | None = None) -> Any:
    """One picture of a reliability, or all that there are side by side."""
    draw = {"histogram": _histogram}
    if found.surface is not None:
        draw |= {"tornado": _tornado, "surrogate": _surrogate}
    if found.line is not None:
        draw["back-analysis"] = _back_analysis
    if found.plan.seeds:
        draw["networks"] = _networks
    if kind is not None:
        if kind not in draw:
            raise InputError(f"there is no picture {kind!r} of it; there are: {', '.join(draw)}")
        with style():
            _, axes = new_axes(axes, (4.2, 3.2))
            draw[kind](found, axes)
        return axes
    import matplotlib.pyplot as plt

    with style():
        columns = min(len(draw), 2)
        lines = -(-len(draw) // columns)
        size = (PAPER_WIDTH if columns == 1 else 7.4, 0.4 + 2.9 * lines)
        figure, grid = plt.subplots(lines, columns, figsize=size, squeeze=False, layout="constrained")
        for one, place in zip(draw.values(), grid.flat, strict=False):
            one(found, place)
        for place in list(grid.flat)[len(draw) :]:
            place.set_visible(False)
        if found.title:
            figure.suptitle(plain_text(short(found.title, 70)), fontsize=10, x=0.01, ha="left")
    return grid


def _histogram(found: Any, axes: Axes) -> None:
    """Factors of the runs; the density of the surface."""
    known = np.array([factor for factor in found.factors if factor is not None])
    limit = found.plan.limit
    axes.set(xlabel=search_title(found.plan.search), ylabel="runs")
    if len(known):
        low, high = float(known.min()), float(known.max())
        least = 0.25 * max(abs(high), abs(low), abs(limit - low), abs(limit - high)) or 1.0  # of the width of all bars
        if high - low < least:
            low, high = 0.5 * (low + high - least), 0.5 * (low + high + least)
        count = max(5, int(np.sqrt(2 * len(known))))
        edges = np.linspace(low, high, count + 1)
        if found.surface is None and low < limit < high:  # a bar is on one side
            width = (high - low) / count
            edges = limit + width * np.arange(-np.ceil((limit - low) / width), np.ceil((high - limit) / width) + 1)
        bars: Any = axes.hist(known, edges.tolist(), color="#B8C4CE", edgecolor="white", lw=0.6)[2]
        if found.surface is not None:
            values = found.surface(points_of(found.plan.inputs, found.plan.correlation))
            first, last = np.quantile(values, [0.0005, 0.9995]).tolist()
            fine = np.linspace(first, last, 90)
            share, _ = np.histogram(values, fine)
            middle, step = 0.5 * (fine[1:] + fine[:-1]), fine[1] - fine[0]
            scale = len(known) * (edges[1] - edges[0]) / step / len(values)
            axes.plot(middle, scale * share, color=PALETTE[1], lw=1.4, label="surface")
            axes.fill_between(middle, scale * share, where=middle <= limit, color=PALETTE[2], alpha=0.5, lw=0)
        else:
            for bar in bars:
                if bar.get_x() + 0.5 * bar.get_width() < limit:
                    bar.set_facecolor(PALETTE[2])
    axes.axvline(limit, color=PALETTE[2], lw=1.2)
    low, high = found.interval
    title = f"failure {percent(found.probability)} ({percent(low)} to {percent(high)})"
    without = found.runs - len(known)
    axes.set_title(title + (f"; {without} without a factor" if without else ""))


def _tornado(found: Any, axes: Axes) -> None:
    """The factor where one input is low or high (5 and 95 %) and the others have their means."""
    surface, inputs = found.surface, found.plan.inputs
    shares = found.sensitivity
    order = sorted(range(len(inputs)), key=lambda i: shares[inputs[i].name])
    middle = float(surface(surface.mean[None, :])[0])
    for row, i in enumerate(order):
        for level, colour in ((0.05, PALETTE[5]), (0.95, PALETTE[4])):
            point = surface.mean.copy()
            point[i] = float(inputs[i].distribution.ppf(level))
            value = float(surface(point[None, :])[0])
            label = ("5 % value", "95 % value")[level > 0.5] if row == 0 else None
            axes.barh(row, value - middle, left=middle, height=0.55, color=colour, label=label)
    axes.axvline(middle, color="#444444", lw=0.8)
    axes.axvline(found.plan.limit, color=PALETTE[2], lw=1.2)
    axes.set_yticks(range(len(order)))
    axes.set_yticklabels([f"{plain_text(inputs[i].name)}\n{100 * shares[inputs[i].name]:.0f} %" for i in order])
    axes.set(xlabel=search_title(found.plan.search), ylim=(-0.6, len(order) + 0.1))
    axes.legend(
        loc="upper left", ncols=2, handlelength=1.2, columnspacing=1.0, frameon=True, framealpha=1, edgecolor="none"
    )
    axes.set_title("inputs, and their shares of the variance")


def _surrogate(found: Any, axes: Axes) -> None:
    """Factors by the surface through all other runs against those computed."""
    known = [i for i, one in enumerate(found.found) if one.factor is not None]
    computed = np.array([found.found[i].factor for i in known])
    kinds = list(dict.fromkeys(found.found[i].mechanism for i in known))
    low, high = float(min(computed.min(), found.surface.left_out.min())), float(computed.max())
    high = max(high, float(found.surface.left_out.max()))
    margin = 0.06 * (high - low or 1.0)
    ends = [low - margin, high + margin]
    axes.plot(ends, ends, color="#8A8A8A", lw=0.8, zorder=1)
    for kind, marker in zip(kinds, MARKERS * (1 + len(kinds) // len(MARKERS)), strict=False):
        rows = [k for k, i in enumerate(known) if found.found[i].mechanism == kind]
        colours = [SIDES[found.found[known[k]].side] for k in rows]
        axes.scatter(computed[rows], found.surface.left_out[rows], s=16, c=colours, marker=marker, label=kind, zorder=3)
    limit = found.plan.limit
    if ends[0] < limit < ends[1]:
        axes.axvline(limit, color=PALETTE[2], lw=1.0)
        axes.axhline(limit, color=PALETTE[2], lw=1.0)
    axes.set(
        xlabel=f"{search_title(found.plan.search)}, computed",
        ylabel="by the surface of the other runs",
        xlim=ends,
        ylim=ends,
    )
    if len(kinds) > 1:
        axes.legend(loc="upper left")
    axes.set_title(f"{found.surface.kind}, ± {found.surface.error:.2g}")


def _back_analysis(found: Any, axes: Axes) -> None:
    """The pairs of inputs that give a factor, and the runs."""
    line = found.line
    names = [one.name for one in found.plan.inputs]
    columns = [names.index(name) for name in line.names]
    values = found.plan.values[: found.runs, columns]
    colours = [SIDES.get(one.side, "#9A9A9A") for one in found.found]
    axes.scatter(values[:, 0], values[:, 1], s=9, c=colours, alpha=0.6, lw=0, zorder=2)
    if len(line.pairs):
        axes.plot(
            *line.pairs.T,
            color="black",
            lw=1.4,
            zorder=3,
            label=f"factor {line.factor:g}" + ("" if len(names) == 2 else ", the others at their means"),
        )
    if len(line.pairs_at_likely):
        axes.plot(*line.pairs_at_likely.T, "--", color="black", lw=1.2, zorder=3, label="the others as is most likely")
    if line.likely:
        place = [line.likely[name] for name in line.names]
        axes.plot(*place, "*", ms=10, color=PALETTE[4], mec="black", mew=0.6, zorder=4, label="most likely")
    axes.set(xlabel=plain_text(line.names[0]), ylabel=plain_text(line.names[1]))
    axes.ticklabel_format(style="sci", scilimits=(-3, 4), useMathText=True)
    axes.legend(loc="best")
    axes.set_title("pairs that give the factor")


def _networks(found: Any, axes: Axes) -> None:
    """The share of networks that fail, with its interval, as they are drawn."""
    fails = np.cumsum([one.side == "fails" for one in found.found])
    count = np.arange(1, found.runs + 1)
    ends = np.array([wilson(k, n) for k, n in zip(fails, count, strict=True)])
    axes.fill_between(count, 100 * ends[:, 0], 100 * ends[:, 1], color="#B8C4CE", lw=0, label="95 % interval")
    axes.plot(count, 100 * fails / count, color=PALETTE[1])
    axes.set(xlabel="networks", ylabel="share that fails [%]", ylim=(0, 100), xlim=(1, max(found.runs, 2)))
    axes.legend(loc="upper right")
    axes.set_title(f"{fails[-1]} of {found.runs} networks fail")
