# SPDX-License-Identifier: MIT
"""Validation cases, and the record of their results."""

from __future__ import annotations

import functools
import math
import re
import time as clock
import tomllib
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rockdda.plot.style import style
from rockdda.simulation import run
from rockdda.writing import complete_file, write_file

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure
    from rockdda.model import Model
    from rockdda.results import Results

__all__ = ["Case", "Comparison", "Record", "published"]

#: the joint spacing, as words write it; pictures set it as a symbol
SYMBOL = re.compile(r"(?<![$\w])S_j\b(?!\$)")


@dataclass(frozen=True)
class Comparison:
    """One number of RockDDA beside the truth (a closed form or an independent solution) and the published value."""

    quantity: str
    computed: float
    unit: str = ""
    truth: float | None = None
    truth_source: str = ""  #: where the truth comes from: "Newmark's closed form", "Eq. 4.2", "rigid-block integration"
    published: float | None = None
    published_source: str = ""  #: page, table or figure: "Table 4.2", "p. 58"
    bound: str = (
        ""  #: "upper" or "lower" when the published value is not more than a bound: within it the difference is 0
    )
    #: promised bound on the error against the truth (without a truth: against the published value); None: no promise
    allowed: float | None = None
    #: what errors are relative to; None: the truth (published value) itself; 1: absolute errors
    scale: float | None = None
    explanation: str = ""  #: why it differs, or that it is not explained
    #: text in place of a number when there is none (`computed` is not a number): "no stable value up to 80°"
    found: str = ""

    @property
    def ours(self) -> float:
        """The former name of `computed`."""
        warnings.warn("Comparison.ours is now Comparison.computed", DeprecationWarning, stacklevel=2)
        return self.computed

    @property
    def error(self) -> float | None:
        """Of the computed value against the truth, relative to `scale`."""
        return self._error(self.truth)

    @property
    def published_error(self) -> float | None:
        """Of the computed value against the published value, relative to `scale`."""
        if self.published is not None and (
            (self.bound == "upper" and self.computed <= self.published)
            or (self.bound == "lower" and self.computed >= self.published)
        ):
            return 0.0
        return self._error(self.published)

    @property
    def agrees(self) -> bool | None:
        """True if the error is within the promised bound; None without a bound."""
        if self.allowed is None:
            return None
        error = self.error if self.truth is not None else self.published_error
        return error is not None and math.isfinite(error) and abs(error) <= self.allowed

    def _error(self, reference: float | None) -> float | None:
        if reference is None:
            return None
        scale = self.scale if self.scale is not None else abs(reference)
        if self.computed == reference:
            return 0.0
        return (self.computed - reference) / scale if scale else math.copysign(math.inf, self.computed - reference)


@dataclass(frozen=True)
class Case:
    """A case of the validation."""

    identifier: str  #: of the command line and of file names: "4.2-three-sines", "closed-newmark"
    title: str
    part: str  #: heading under which the report has it: "Chapter 3" to "Chapter 7", "Closed forms"
    function: Callable[[Record], None]
    quick: bool = True  #: part of --quick (which then does less: see `record.full`)


@dataclass
class Record:
    """The record of a case, which its function fills. Texts are Markdown; the report keeps their order."""

    case: Case
    folder: Path  #: for the runs of this case
    figures: Path  #: folder of the report's figures
    full: bool = False  #: --full
    formulation: str = ""  #: of the contacts of all runs that do not choose one; "": the program's default
    workers: int = 1  #: processes that the case may use at a time
    comparisons: list[Comparison] = field(default_factory=list)
    items: list[dict[str, Any]] = field(default_factory=list)  #: words, tables and figures, in order
    runs: int = 0
    steps: int = 0
    run_seconds: float = 0.0
    #: largest residual of the energy ledger in any run and step, over the largest energy of that run
    energy_residual: float = 0.0

    def text(self, markdown: str) -> None:
        """A paragraph: the comparison, its method, its result."""
        self.items.append({"kind": "text", "text": markdown.strip()})

    def compare(self, quantity: str, computed: float, unit: str = "", **rest: Any) -> Comparison:
        """Add a comparison; `rest` are the other fields of `Comparison`. The report has a table of all of them."""
        comparison = Comparison(quantity, float(computed), unit, **rest)
        self.comparisons.append(comparison)
        return comparison

    def energy_closes(self, allowed: float = 1e-9, explanation: str = "") -> Comparison:
        """Promise what the energy ledgers of the runs so far leave over; the solver's tolerance is 1e-10."""
        return self.compare(
            "energy that the ledger leaves over, of the largest energy", self.energy_residual,
            truth=0.0, truth_source="conservation of energy", scale=1, allowed=allowed, explanation=explanation,
        )  # fmt: skip

    def table(self, frame: pandas.DataFrame, name: str, caption: str) -> None:
        """A table beside the comparisons (its index is not shown); also written as NAME.csv beside the figures."""
        self.figures.mkdir(parents=True, exist_ok=True)
        file = f"{self.case.identifier}-{name}.csv"
        write_file(self.figures / file, frame.to_csv(index=False))
        rows = [[_cell(value) for value in row] for row in frame.itertuples(index=False)]
        self.items.append(
            {
                "kind": "table",
                "columns": [str(c) for c in frame.columns],
                "rows": rows,
                "caption": caption,
                "file": file,
            }
        )

    def figure(self, figure: Figure, name: str, caption: str) -> None:
        """A picture, saved as PNG; the figure is closed. Draw it within `with record.style():`."""
        from matplotlib import pyplot
        from matplotlib.text import Text

        self.figures.mkdir(parents=True, exist_ok=True)
        file = f"{self.case.identifier}-{name}.png"
        for text in figure.findobj(Text):
            text.set_text(SYMBOL.sub(r"$S_\\mathrm{j}$", text.get_text()))
        with style(), complete_file(self.figures / file) as part:
            figure.savefig(part, dpi=130, bbox_inches="tight", metadata={"Software": None})
        pyplot.close(figure)
        self.items.append({"kind": "figure", "file": file, "caption": caption})

    style = staticmethod(style)

    def run(self, model: Model, name: str, **options: Any) -> Results:
        """Run a model through `rockdda.run`; input files and results are kept in `folder / name`.

        The input files can be run again with `rockdda run FOLDER`, which gives the same results, bit for bit.
        """
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        self.choose_formulation(model)
        model.write(folder, force=True)
        started = clock.monotonic()
        try:
            results = run(folder, output=folder / f"{name}.h5", force=True, **{"threads": 1} | options)
        finally:
            self.run_seconds += clock.monotonic() - started
            self.runs += 1
        self.note(results)
        return results

    def choose_formulation(self, model: Model) -> None:
        """Write the formulation of the record into a model that names neither one nor a preset."""
        if self.formulation and not {"formulation", "preset"} & set(model.options.get("contact", {})):
            model.options.setdefault("contact", {})["formulation"] = self.formulation

    def note(self, results: Results) -> None:
        """Count the steps of a run, and keep the largest residual of its energy."""
        self.steps += results.n_steps
        if results.n_steps:
            energy = np.abs(results["history/energy"])
            largest, residual = float(energy[:, :-1].max()), float(energy[:, -1].max())
            share = residual / largest if largest > 0 else residual
            self.energy_residual = share if math.isnan(share) else max(self.energy_residual, share)

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file from which the report can be written again."""
        return {
            "identifier": self.case.identifier,
            "title": self.case.title,
            "part": self.case.part,
            "full": self.full,
            "formulation": self.formulation,
            "comparisons": [asdict(comparison) for comparison in self.comparisons],
            "items": self.items,
            "runs": self.runs,
            "steps": self.steps,
            "run_seconds": self.run_seconds,
            "energy_residual": self.energy_residual,
        }


@functools.cache
def published(name: str) -> dict[str, Any]:
    """The published numbers of `published/NAME.toml`; each table there names its page, table or figure."""
    file = resources.files(__package__) / "published" / f"{name}.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.4g}"
    return str(value)
