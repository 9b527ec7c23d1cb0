# SPDX-License-Identifier: MIT
"""Small multiples of a study's table: one picture for each result, one line for each value of the second parameter."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..plot.style import style
from ..writing import complete_file
from .definition import Study

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


def plot_study(study: Study, table: pandas.DataFrame) -> Figure:
    """Every result against the first parameter of numbers that varies; further ones distinguish lines and rows.

    Cases without a result are left out, so that gaps show."""
    import matplotlib.pyplot as plt
    from pandas.api.types import is_numeric_dtype

    varying = [name for name in study.parameters if table[name].nunique() > 1]
    numeric = [name for name in varying if is_numeric_dtype(table[name])]
    if not numeric:
        raise InputError("nothing to draw: no parameter of numbers varies", study.file)
    if not study.quantities:
        raise InputError("nothing to draw: the study has no [results]", study.file)
    across = numeric[0]
    others = [name for name in varying if name != across]
    lines, rows = others[:1], others[1:]
    groups = list(table.groupby(rows)) if rows else [((), table)]
    with style():
        figure, grid = plt.subplots(
            len(groups), len(study.quantities), figsize=(3.4 * len(study.quantities), 2.7 * len(groups)), squeeze=False,
            layout="constrained",
        )  # fmt: skip
        for axes_row, (key, part) in zip(grid, groups, strict=True):
            for axes, wanted in zip(axes_row, study.quantities, strict=True):
                curves = list(part.groupby(lines[0])) if lines else [(None, part)]
                colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(curves)))
                for (value, curve), colour in zip(curves, colours, strict=True):
                    curve = curve.dropna(subset=[wanted.name]).sort_values(across)
                    label = f"{lines[0]} = {value!s}" if lines else None
                    axes.plot(curve[across], curve[wanted.name], "o-", ms=3, color=colour, label=label)
                axes.set_xlabel(across)
                axes.set_ylabel(f"{wanted.name} [{wanted.unit}]" if wanted.unit else wanted.name)
                if rows:
                    axes.set_title(", ".join(f"{name} = {value}" for name, value in zip(rows, key, strict=True)))
        if lines:
            grid[0, -1].legend()
        figure.suptitle(study.title)
    return figure


def save_study_plot(study: Study, table: pandas.DataFrame, path: Path) -> None:
    """Draw and write; the ending chooses the format."""
    import matplotlib.pyplot as plt

    figure = plot_study(study, table)
    try:
        with complete_file(path) as part:
            figure.savefig(part, dpi=200)
    finally:
        plt.close(figure)
