# SPDX-License-Identifier: MIT
"""The critical factor of a model: `rockdda fos` from Python, and its search in a results file."""

from __future__ import annotations

import html
import json
import math
import os
import re
import signal
import subprocess
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from .errors import ConvergenceError, InputError, InputWarning, OutputError, RockddaError, stack_level
from .model import Model, as_files
from .outputs import output
from .program import errors_in, find_program
from .results import Results
from .results import open as open_results
from .text import PathLike

__all__ = ["CriticalFactor", "JointState", "Mechanism", "Trial", "factor_of_safety", "read_search"]


NAMES = {
    "strength": "factor of safety", "tilt": "critical tilt", "push": "critical push", "gravity": "critical gravity",
    "load": "load factor",
}  # fmt: skip
UNITS = {"tilt": "°"}


def search_title(kind: str) -> str:
    """'factor of safety', 'critical tilt [°]' …"""
    return NAMES.get(kind, f"{kind} factor") + (f" [{UNITS[kind]}]" if kind in UNITS else "")


#: Arguments of `factor_of_safety` that are options of the program.
OPTIONS = ("search", "joints", "loads", "factors", "from_", "to", "tolerance", "stage", "jobs", "max_steps", "output")
KINDS = ("sliding", "toppling", "fall")
#: Warnings among what the program prints, each with its source lines, which are indented by four.
WARNINGS = re.compile(r"^(?:[^:\n]+:(?:\d+:)*[ \t]*)?warning: .*(?:\n    .*)*", re.M)
#: exit codes of the program
INPUT, CONVERGENCE, STOPPED, OUTPUT = 2, 3, 4, 5


@dataclass(frozen=True)
class Trial:
    """One value that was tried, from the settled state."""

    value: float  #: of the factor, the tilt [deg] or the push
    stable: bool
    steps: int
    unbalanced: float  #: of the last step
    displacement: float  #: largest of any block since the settled state [length]
    seconds: float


@dataclass(frozen=True)
class Mechanism:
    """How the model fails: the blocks that move, from 0, and how they do together."""

    blocks: tuple[int, ...]
    kind: str  #: "sliding", "toppling", "fall" or "mixed"
    #: how each of the blocks moves; empty when no results were written
    kinds: tuple[str, ...] = ()
    linings: tuple[str, ...] = ()  #: that move; empty when the search was read from a results file


@dataclass(frozen=True)
class JointState:
    """The joints of one material in a search."""

    name: str  #: of the material, or its number
    reduced: bool  #: its strength was divided
    length: float  #: of all its joints [length]
    open: float  #: share of it that is open in the last stable trial: there cohesion and tension do not act


@dataclass(frozen=True)
class CriticalFactor:
    """The critical factor, between a value at which the model is stable and one at which it fails."""

    value: float
    low: float
    high: float
    search: str  #: "strength", "tilt", "push", "gravity" or "load"
    trials: tuple[Trial, ...]  #: in the order in which they were done
    mechanism: Mechanism
    #: the run of the failing trial nearest to the factor, when an output was asked for
    results: Results | None = None
    #: of the searched joints in the settled state, times their own; above 1 the model does not stand as it is
    settled_strength: float = 1.0
    #: with design factors: does the model stand with them? `value` is then its reserve, infinite where it has no end
    stands: bool | None = None
    joints: tuple[JointState, ...] = ()  #: empty when the search was read from a results file

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        stable, failing = (self.low, self.high) if self.value >= 0 else (self.high, self.low)
        unit = UNITS.get(self.search, "")
        if self.stands is not None:
            reserve = f"{self.value:.4g}" if math.isfinite(self.value) else f"above {self.low:.4g}"
            return f"stands with the factored values: {'yes' if self.stands else 'no'}, reserve {reserve}"
        return (
            f"{NAMES[self.search]}: {self.value:.4g}{unit} (stable at {stable:.4g}{unit}, fails at {failing:.4g}{unit};"
            f" {len(self.trials)} trials)"
        )

    def __repr__(self) -> str:
        return f"<rockdda.CriticalFactor: {self}>"

    def _repr_html_(self) -> str:
        """For notebooks: the factor, how it fails, and a table of the trials."""
        head = "".join(f"<th>{name}</th>" for name in ("value", "", "steps", "unbalanced", "displacement", "seconds"))
        rows = "".join(
            f"<tr><td>{t.value:.5g}</td><td>{'stable' if t.stable else 'fails'}</td><td>{t.steps}</td>"
            f"<td>{t.unbalanced:.1e}</td><td>{t.displacement:.2e}</td><td>{t.seconds:.1f}</td></tr>"
            for t in self.trials
        )
        count = len(self.mechanism.blocks)
        moves = f"{count} block{'' if count == 1 else 's'}: {self.mechanism.kind}"
        return (
            f"<p><b>{html.escape(str(self))}</b><br>{html.escape(moves)}</p>"
            f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        )

    def plot(self, kind: str | None = None, **options: Any) -> Any:
        """Draw the search ('factor') or the mechanism of the failing trial ('mechanism'); returns matplotlib axes.

        The default is the mechanism where there are results, else the search."""
        return output("draw_search", self, kind or ("factor" if self.results is None else "mechanism"), **options)


def option_words(options: Mapping[str, Any]) -> list[str]:
    """Options of the program, by their names in Python, as words of its command line; those that are None are not."""
    given = {name.rstrip("_").replace("_", "-"): value for name, value in options.items() if value is not None}
    return [word for name, value in given.items() for word in (f"--{name}", _word(value))]


def _word(value: Any) -> str:
    """A value on the command line: names and factors with commas between them."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} = {_word(one)}" for name, one in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(map(_word, value))
    return repr(float(value)) if isinstance(value, float | np.floating) else str(value)


def factor_of_safety(
    model: PathLike | Model, analysis: PathLike | None = None, *, search: str = "strength",
    joints: str | Sequence[str] | None = None, loads: str | Sequence[str] | None = None,
    factors: str | Mapping[str, float] | None = None, from_: float | None = None, to: float | None = None,
    tolerance: float | None = None, stage: str | None = None, jobs: int | None = None, max_steps: int | None = None,
    config: PathLike | None = None, output: PathLike | None = None, force: bool = False, progress: bool = False,
) -> CriticalFactor:  # fmt: skip
    """Search the factor at which a model loses equilibrium, with `rockdda fos`.

    model: what `rockdda.run` takes. search: 'strength' divides tan φ, cohesion and tension (of the joint materials
    `joints`, by default of all); 'tilt' turns gravity by degrees, counter-clockwise positive; 'push' is a horizontal
    acceleration α·g; 'gravity' multiplies it; 'load' multiplies the loads of these names (`loads`, by default all that
    have one), which are 0 before the search. factors: those of a design, 'ec7' or {'friction': 1.25, 'load.NAME': 1.3}
    (friction, cohesion, tension, water, load.NAME): `stands` states whether the model stands with them, `value` is the
    reserve of strength on top. The search begins with the settled state after `stage` (default: the
    last), between `from_` and `to`, until stable and failing value are not farther apart than `tolerance`. jobs: trials
    side by side; the answer does not depend on it. output: results file of the failing trial nearest to the factor.
    progress: the program prints what it tries on standard error.

    Raises InputError; ConvergenceError when the range does not hold the limit (not stable at its lower end, stable at
    its upper end) or the model is not in equilibrium before the search; OutputError."""
    if search not in NAMES:
        raise InputError(f"search: expected one of {', '.join(NAMES)}, found {search!r}")
    options = option_words({name: value for name, value in locals().items() if name in OPTIONS})
    with as_files(model, analysis, config) as (files, folder):
        command = [find_program(), "fos", *files, *options, "--json", *(["--force"] if force else [])]
        code, out, told = _call(command, progress)
        if folder:
            out, told = (text.replace(f"{folder}{os.sep}", "") for text in (out, told))
        if code != 0 and not _is_verdict(code, out):
            _raise(code, out, told)
    for message in WARNINGS.findall(told.replace("\r", "\n")):
        warnings.warn(message, InputWarning, stacklevel=stack_level())
    results = None if output is None else open_results(output)
    return _from_json(json.loads(out), results)


def read_search(results: Results | PathLike) -> CriticalFactor:
    """The search in a results file that `rockdda fos -o` wrote."""
    if not isinstance(results, Results):
        results = open_results(results)
    if "search/factor" not in results:
        raise InputError("holds no search: it is not a file of 'rockdda fos -o'", results.path)
    names = ("value", "stable", "steps", "unbalanced", "displacement", "seconds")
    columns = [np.atleast_1d(results[f"search/{name}"]).tolist() for name in names]
    trials = [Trial(row[0], bool(row[1]), int(row[2]), *row[3:]) for row in zip(*columns, strict=True)]
    factor, low, high = (float(np.ravel(results[f"search/{name}"])[0]) for name in ("factor", "low", "high"))
    words = {name: str(results.attribute("search", name)).strip() for name in ("search", "kind")}
    # not in files of older versions, whose models stand
    strength = float(np.ravel(results["search/settled_strength"])[0]) if "search/settled_strength" in results else 1.0
    mechanism = _mechanism(results, words["kind"])
    return CriticalFactor(factor, low, high, words["search"], tuple(trials), mechanism, results, strength)


def _mechanism(results: Results, kind: str) -> Mechanism:
    blocks = np.atleast_1d(results["search/blocks"]).astype(int).tolist()
    kinds = tuple(KINDS[int(number)] for number in np.atleast_1d(results["search/block_kind"]))
    return Mechanism(tuple(blocks), kind, kinds)


def _call(command: list[str], progress: bool) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of the program; Ctrl-C ends it in order, then this process."""
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=None if progress else subprocess.PIPE, text=True, encoding="utf-8",
        errors="replace",
    )  # fmt: skip
    try:
        out, told = process.communicate()
    except BaseException:
        process.send_signal(signal.SIGTERM)
        process.communicate()
        raise
    return process.returncode, out, told or ""


def _is_verdict(code: int, out: str) -> bool:
    """Is it the answer that a design does not stand, with which the program ends as without convergence?"""
    try:
        return code == CONVERGENCE and "stands" in json.loads(out)
    except ValueError:
        return False


def _from_json(found: dict[str, Any], results: Results | None) -> CriticalFactor:
    trials = tuple(Trial(**{name: trial[name] for name in Trial.__dataclass_fields__}) for trial in found["trials"])
    mechanism = Mechanism(
        tuple(found["mechanism"]["blocks"]),
        found["mechanism"]["kind"] or "none",
        linings=tuple(found["mechanism"].get("linings", ())),
    )
    if results is not None and "search/factor" in results:
        mechanism = _mechanism(results, mechanism.kind)
    factor, low, high = (math.inf if found[name] is None else float(found[name]) for name in ("factor", "low", "high"))
    strength = float(found.get("settled_strength", 1.0))
    joints = tuple(JointState(**joint) for joint in found.get("joints", []))
    return CriticalFactor(
        factor, low, high, found["search"], trials, mechanism, results, strength, found.get("stands"), joints
    )


def _raise(code: int, out: str, told: str) -> NoReturn:
    """The package's error for an exit code."""
    problems = errors_in(out)
    text = "\n".join(map(str, problems)) or told.strip() or f"rockdda fos ended with exit code {code}"
    plain = "; ".join(problem.message for problem in problems) or text
    if code == INPUT:
        raise InputError(text, problems=problems)
    if code == CONVERGENCE:
        raise ConvergenceError(plain)
    if code == OUTPUT:
        raise OutputError(plain)
    if code == STOPPED:
        raise RockddaError("the search was stopped")
    raise RockddaError(text)
