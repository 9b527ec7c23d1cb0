#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the figures of docs/theory.md on contact by length: scripts/draw_contacts.py [FOLDER] (docs/images)."""

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("svg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
ROCK, OTHER, THIRD, LINE, MARK, SOFT = "#dfe7ef", "#f3e3c8", "#dcebd5", "#333333", "#b03020", "#777777"
# text stays text, and the same figure gives the same file
mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "rockdda", "font.size": 9, "font.family": "sans-serif"})


def panels(
    width: float, height: float, titles: list[str], widths: list[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """A figure of panels side by side without scales."""
    figure, axes = plt.subplots(1, len(titles), figsize=(width, height), width_ratios=widths, squeeze=False)
    for ax, title in zip(axes[0], titles, strict=True):
        ax.set_title(title, fontsize=9, loc="left")
        ax.set_aspect("equal")
        ax.axis("off")
    return figure, list(axes[0])


def block(
    ax: Axes, points: list[tuple[float, float]], fill: str, label: str = "", at: tuple[float, float] = (0, 0)
) -> None:
    ax.fill(*zip(*points, strict=True), facecolor=fill, edgecolor=LINE, linewidth=1.1, zorder=1)
    if label:
        ax.text(*at, label, ha="center", va="center", fontsize=11)


def arrow(
    ax: Axes, start: tuple[float, float], end: tuple[float, float], colour: str = LINE, style: str = "-|>"
) -> None:
    options = {"arrowstyle": style, "color": colour, "lw": 1.1, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", end, start, arrowprops=options, zorder=4)


def draw_interval() -> Figure:
    """Closed part of an interval, and the weight of a lone corner."""
    figure, (ax, alone) = panels(9.6, 3.3, ["interval that is open at one end", "a corner alone"], [1.45, 1])
    slope, left = 0.17, -0.2

    def edge(x: float) -> float:
        return left + slope * (x - 0.9)

    low, high = 0.9, 3.4
    zero = 0.9 - left / slope
    block(ax, [(0, 0), (3.4, 0), (3.4, -0.75), (0, -0.75)], ROCK, "block b", (0.42, -0.5))
    block(ax, [(0.9, edge(0.9)), (4.2, edge(4.2)), (4.2, 1.35), (0.9, 1.35)], OTHER, "block a", (3.6, 1.05))
    for x in np.linspace(low, zero - 0.25, 6):
        arrow(ax, (x, edge(0.9) - 0.03), (x, edge(0.9) - 0.03 + 3.2 * (0 - edge(x))), MARK)
    ax.plot([low, zero], [edge(0.9) - 0.03 - 3.2 * edge(0.9), edge(0.9) - 0.03], color=MARK, linewidth=1)
    ax.text(1.25, 0.36, "k g", color=MARK, fontsize=10)
    for place, name in ((0.5 - 12**-0.5, "1"), (0.5 + 12**-0.5, "2")):
        x = low + place * (high - low)
        ax.plot(x, 0.5 * edge(x), "o", color=LINE, markersize=4, zorder=5)
        ax.text(x + 0.08, 0.5 * edge(x) + 0.03, name, fontsize=10, zorder=5)
    ax.text(3.46, edge(3.8) - 0.18, "edge f", color=SOFT)
    ax.text(0.05, 0.06, "edge e", color=SOFT)
    for y, end, name in ((-0.5, zero, "a"), (-0.95, high, "L")):
        arrow(ax, (low, y), (end, y), style="<|-|>")
        ax.text(0.5 * (low + end), y - 0.15, name, ha="center", va="center")
    for x, y in ((low, -1.02), (zero, -0.57), (high, -1.02)):
        ax.plot([x, x], [y, 0], color=SOFT, linewidth=0.7, linestyle=":")
    ax.set(xlim=(-0.1, 4.3), ylim=(-1.25, 1.45))
    draw_lone_corner(alone)
    return figure


def draw_lone_corner(ax: Axes) -> None:
    """Angles and lengths of which the weight of a corner on an edge is made."""
    block(ax, [(0.2, 0), (3.6, 0), (3.6, -0.95), (0.2, -0.95)], ROCK, "block b", (3.15, -0.74))
    v = np.array([2.3, 0.05])
    into, out = v + 2.0 * np.array([-np.cos(0.22), np.sin(0.22)]), v + 1.15 * np.array([np.cos(0.9), np.sin(0.9)])
    block(ax, [tuple(v), tuple(out), (2.6, 1.5), (0.9, 1.5), tuple(into)], OTHER, "block a", (1.85, 1.15))
    ax.plot(*v, "o", color=MARK, markersize=4, zorder=5)
    ax.text(2.28, 0.2, "v", color=MARK, ha="center")
    for start, stop, radius, name in ((np.pi - 0.22, np.pi, 1.1, "α"), (0, 0.9, 0.42, "β")):
        t = np.linspace(start, stop, 30)
        ax.plot(v[0] + radius * np.cos(t), v[1] + radius * np.sin(t), color=LINE, linewidth=0.9, zorder=3)
        middle = 0.5 * (start + stop)
        x, y = v + (radius + 0.13) * np.array([np.cos(middle), np.sin(middle)])
        ax.text(x, y, name, ha="center", va="center")
    arrow(ax, (v[0], -0.2), (v[0] - 2.0, -0.2), style="<|-|>")
    ax.text(v[0] - 1.0, -0.38, "l_in", ha="center", va="center")
    arrow(ax, (v[0], -0.2), (v[0] + 1.15, -0.2), style="<|-|>")
    ax.text(v[0] + 0.57, -0.38, "l_out", ha="center", va="center")
    ax.text(1.9, -1.14, "weight (l_in β + l_out α) / (6 (α + β))", ha="center", va="center", color=MARK)
    ax.set(xlim=(0.1, 3.7), ylim=(-1.3, 1.6))


def draw_riding() -> Figure:
    """A block that slides over a joint: what its corner cannot strike."""
    titles = ["1  covered", "2  below the line of an edge that is borne", "exposed"]
    figure, axes = panels(10.4, 2.7, titles)
    cut = 0.3
    left = [[(2, 0)], [(2, -cut), (2 - cut, 0)], [(2, 0)]]
    right = [[(2, 0)], [(2 + cut, 0), (2, -cut)], [(2, 0.34)]]
    bottom, corner = -0.07, (2.03, 2.13, 1.98)
    for k, ax in enumerate(axes):
        level = right[k][0][1]
        block(ax, [(0, 0), (0, -1), (2, -1), *left[k]], ROCK, "C", (0.9, -0.55))
        block(ax, [(4, -1), (4, level), *right[k], (2, -1)], THIRD, "D", (3.1, -0.55))
        x = corner[k]
        block(ax, [(x - 1.7, bottom), (x, bottom), (x, 0.85), (x - 1.7, 0.85)], OTHER, "A", (x - 0.9, 0.45))
        ax.plot(x, bottom, "o", color=MARK, markersize=4.5, zorder=5)
        ax.text(x + 0.1, bottom + (0.15, 0.15, -0.22)[k], "v", color=MARK, zorder=5)
        arrow(ax, (x - 0.55, 1.05), (x - 0.05, 1.05))
        ax.set(xlim=(-0.1, 4.1), ylim=(-1.35, 1.25))
    axes[0].plot([2, 2], [-0.02, -0.98], color=MARK, linewidth=3, zorder=4)
    axes[0].text(2, -1.22, "the side of D is covered by C: v passes", ha="center", va="center", color=MARK)
    axes[1].plot([0.2, 4.0], [bottom, bottom], color=MARK, linewidth=1, linestyle="--", zorder=4)
    axes[1].text(2, -1.22, "the chamfer lies below the edge of A: v passes", ha="center", va="center", color=MARK)
    axes[2].plot([2, 2], [0.0, 0.34], color=MARK, linewidth=3, zorder=4)
    axes[2].text(2, -1.22, "a step higher than the tolerance stops A", ha="center", va="center", color=MARK)
    return figure


def rounded_gap(x: np.ndarray, y: np.ndarray, normals: np.ndarray, radius: float) -> np.ndarray:
    """Distance from a wedge with its tip at the origin and a rounded tip, as in src/contact/table/corners.f90."""
    half = normals.sum(axis=0)
    cosine2 = (half @ half) / 4
    px, py = x + half[0] * radius / (2 * cosine2), y + half[1] * radius / (2 * cosine2)
    turn = normals[0, 0] * normals[1, 1] - normals[0, 1] * normals[1, 0]
    first = (px * normals[1, 1] - py * normals[1, 0]) * turn
    second = (normals[0, 0] * py - normals[0, 1] * px) * turn
    sides = [x * n[0] + y * n[1] for n in normals]
    return np.where((first >= 0) & (second >= 0), np.hypot(px, py) - radius, np.maximum(*sides))


def draw_corner() -> Figure:
    """Two corners, and the wedge that their difference makes, with lines of equal gap."""
    figure, (ax, wedge) = panels(9.2, 3.7, ["corner a before corner b", "the wedge: lines of equal gap of a"])
    block(ax, [(0, 0), (-2, 0), (-2, -1.5), (0, -1.5)], ROCK, "block b", (-1.1, -0.8))
    turn = np.radians(18)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    corners = [(0.28, 0.22) + rotation @ p for p in ((0, 0), (1.6, 0), (1.6, 1.35), (0, 1.35))]
    block(ax, [tuple(p) for p in corners], OTHER, "block a", (0.72, 1.12))
    for at, name, dx, dy in (((0, 0), "b", -0.16, -0.2), (corners[0], "a", 0.16, 0.24)):
        ax.plot(*at, "o", color=MARK, markersize=4, zorder=5)
        ax.text(at[0] + dx, at[1] + dy, name, color=MARK)
    ax.set(xlim=(-2.2, 2.0), ylim=(-1.7, 2.1))
    normals = np.array([[0.0, 1.0], [np.cos(turn), np.sin(turn)]])
    radius = 0.55
    x, y = np.meshgrid(np.linspace(-2, 1.6, 500), np.linspace(-1.7, 1.6, 500))
    gap = rounded_gap(x, y, normals, radius)
    wedge.contourf(x, y, gap, levels=[-9, 0], colors=[ROCK])
    levels = [-0.45, -0.3, -0.15, 0, 0.25, 0.5, 0.75]
    widths = [0.8] * 3 + [1.6] + [0.8] * 3
    wedge.contour(x, y, gap, levels=levels, colors=[SOFT] * 3 + [LINE] + [SOFT] * 3, linewidths=widths)
    for level in levels[4:]:
        wedge.text(
            -1.2,
            level,
            f"{level:g}",
            fontsize=7,
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
        )
    half = normals.sum(axis=0)
    centre = -half * radius / (half @ half / 2)
    wedge.plot(*centre, "o", color=LINE, markersize=3)
    wedge.text(centre[0] - 0.1, centre[1] - 0.02, "c", ha="right", va="top")
    for n in normals:
        wedge.plot(*zip(centre, centre + 1.9 * n, strict=True), color=SOFT, linewidth=0.8, linestyle=":")
    for share in (0.0, 0.33, 0.67, 1.0):
        n = (1 - share) * normals[0] + share * normals[1]
        n /= np.hypot(*n)
        arrow(wedge, tuple(centre + radius * n), tuple(centre + (radius + 0.45) * n), MARK)
    wedge.text(-1.3, -1.15, "inside: the side that\nis less deep", fontsize=8, va="center", color=SOFT)
    wedge.text(-1.95, 0.05, "side 1: edge of b", fontsize=8)
    wedge.text(0.62, -1.35, "side 2: edge of a", fontsize=8, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})
    wedge.set(xlim=(-2, 1.6), ylim=(-1.7, 1.6))
    return figure


def draw_tie() -> Figure:
    """Traction of a tie along its interval, and the law of a tie that breaks in tension and in shear."""
    figure, (along, tension, shear) = plt.subplots(1, 3, figsize=(10.4, 3.0), layout="constrained")
    s = np.array([-0.5, 0.5])
    mean, linear = 0.35, 0.45
    along.fill_between(s, 0, mean + linear * s / 0.5, color=OTHER)
    along.plot(s, mean + linear * s / 0.5, color=LINE)
    along.axhline(0, color=LINE, linewidth=0.8)
    along.axhline(0.7, color=MARK, linewidth=1, linestyle="--")
    along.text(-0.48, 0.73, "tensile strength", color=MARK, fontsize=8)
    for x, height in ((-0.5, mean - linear), (0.0, mean), (0.5, mean + linear)):
        arrow(along, (x, 0), (x, height), MARK)
    along.text(0.03, 0.12, "mean", fontsize=8)
    along.text(0.49, 0.86, "mean + 6 M/L²", fontsize=8, ha="right")
    along.set(title="traction along the interval", ylim=(-0.2, 1.0), xlabel="s/L", xticks=[-0.5, 0, 0.5], yticks=[])
    for ax, title, x_label, y_label in (
        (tension, "opening: breaks at the strength", "opening", "tension"),
        (shear, "slip: the joint keeps what friction holds", "slip", "shear"),
    ):
        ax.set(title=title, xlabel=x_label, ylabel=y_label, xticks=[], yticks=[], xlim=(-0.35, 1.0), ylim=(-0.75, 1.1))
        ax.axhline(0, color=LINE, linewidth=0.7)
        ax.axvline(0, color=LINE, linewidth=0.7)
    tension.plot([-0.05, 0.06], [-0.7, 0.84], color=MARK, linewidth=2, label="tie: 1000 k")
    tension.plot([0.06, 0.06, 1.0], [0.84, 0, 0], color=MARK, linewidth=1.2, linestyle=":")
    tension.plot([-0.32, 0, 1.0], [-0.7, 0, 0], color=LINE, linewidth=1.4, label="joint after the break")
    shear.plot([-0.05, 0.065], [-0.7, 0.9], color=MARK, linewidth=2, label="tie: c + σ tan φ")
    shear.plot([0.065, 0.065], [0.9, 0.45], color=MARK, linewidth=1.2, linestyle=":")
    shear.plot([0.065, 1.0], [0.45, 0.45], color=LINE, linewidth=1.4, label="joint: σ tan φ")
    for ax in (tension, shear):
        ax.legend(fontsize=7, loc="upper right", frameon=False)
    for ax in (along, tension, shear):
        ax.title.set_fontsize(9)
        ax.title.set_horizontalalignment("center")
        ax.spines[["top", "right"]].set_visible(False)
    return figure


def main() -> int:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    for name, draw in (("interval", draw_interval), ("joint", draw_riding), ("corner", draw_corner), ("tie", draw_tie)):
        figure = draw()
        if name != "tie":
            figure.tight_layout()
        figure.savefig(folder / f"contact-{name}.svg", metadata={"Date": None})
        plt.close(figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
