# SPDX-License-Identifier: MIT
"""Kinds of models, and how they are drawn, judged and shrunk."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.configuration import set_hypothesis_home_dir

from .bench import ROOT, Bench, Fault, Unsuited

Values = dict[str, Any]
# what it keeps belongs into the build tree
set_hypothesis_home_dir(ROOT / "build" / "hypothesis")
#: models that a shrink may judge: enough to bring every number to its simplest, some seconds to a minute
SHRINKS = 60


@dataclass(frozen=True)
class Kind:
    """One kind of model with its oracle."""

    name: str
    family: str
    truth: str  #: the oracle, in words
    drawn: st.SearchStrategy[Values]
    judge: Callable[[Values, Bench], None]  #: raises Fault, or Unsuited
    known: str = ""  #: what does not hold today, in words; empty: it holds
    sample: int = 2  #: draws in the gate
    needs: str = ""  #: module of an oracle that the gate does not install


@dataclass(frozen=True)
class Verdict:
    """What became of one draw."""

    values: Values
    fault: str  #: empty: it holds
    suited: bool = True


@dataclass(frozen=True)
class Drawn:
    """Draws of one kind from one seed."""

    kind: str
    chunk: int
    verdicts: list[Verdict]
    seconds: float

    @property
    def tried(self) -> int:
        return sum(verdict.suited for verdict in self.verdicts)

    @property
    def failed(self) -> list[int]:
        """Draws at fault, from 1, among those that were suited."""
        suited = [verdict for verdict in self.verdicts if verdict.suited]
        return [number for number, verdict in enumerate(suited, start=1) if verdict.fault]


def between(low: float, high: float, steps: int = 100) -> st.SearchStrategy[float]:
    """Numbers of four digits; simplest the lowest."""
    return st.integers(0, steps).map(lambda k: float(f"{low + (high - low) * k / steps:.4g}"))


def decades(low: float, high: float, steps: int = 60) -> st.SearchStrategy[float]:
    """Numbers of two digits, as many in each decade; simplest the lowest."""
    return st.integers(0, steps).map(lambda k: float(f"{low * (high / low) ** (k / steps):.2g}"))


def seeds() -> st.SearchStrategy[int]:
    """Seeds of models that a generator of random numbers draws."""
    return st.integers(0, 10**6)


def values(**drawn: st.SearchStrategy[Any]) -> st.SearchStrategy[Values]:
    return st.fixed_dictionaries(drawn)


def judge(kind: Kind, drawn: Values, program: Path, folder: Path | None = None) -> Verdict:
    """Judge one model, in a folder that is kept or in one that goes."""
    with tempfile.TemporaryDirectory(prefix="rockdda-campaign-") as place:
        try:
            kind.judge(drawn, Bench(program, folder or Path(place)))
        except Fault as fault:
            return Verdict(drawn, str(fault))
        except Unsuited:
            return Verdict(drawn, "", suited=False)
    return Verdict(drawn, "")


def draw(kind: Kind, count: int, chunk: int, program: Path, known: dict[str, Verdict] | None = None) -> Drawn:
    """Judge so many models, the same ones each time."""
    verdicts: list[Verdict] = []
    seen = {} if known is None else known
    started = time.monotonic()

    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @seed(chunk)
    @given(kind.drawn)
    def one(drawn: Values) -> None:
        key = json.dumps(drawn, sort_keys=True)
        if key not in seen:
            seen[key] = judge(kind, drawn, program)
            verdicts.append(seen[key])

    one()
    return Drawn(kind.name, chunk, verdicts, time.monotonic() - started)


def shrink(kind: Kind, count: int, chunk: int, program: Path) -> tuple[Verdict, int] | None:
    """The simplest model at fault that a chunk of draws leads to, and the draws that the first one took."""
    seen: dict[str, Verdict] = {}
    budget, first = SHRINKS, 0

    class Found(Exception):
        pass

    class Enough(BaseException):
        """Ends a shrink, which would go on for minutes; each fault of a shrink is simpler than the one before."""

    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
        print_blob=False,
    )
    @seed(chunk)
    @given(kind.drawn)
    def one(drawn: Values) -> None:
        nonlocal budget, first
        key = json.dumps(drawn, sort_keys=True)
        if key not in seen:
            if first and not budget:
                raise Enough
            budget -= bool(first)
            seen[key] = judge(kind, drawn, program)
            if seen[key].fault and not first:
                first = sum(verdict.suited for verdict in seen.values())
        if seen[key].fault:
            smallest.append(seen[key])
            raise Found

    smallest: list[Verdict] = []
    try:
        one()
    except (Found, Enough):
        return smallest[-1], first
    return None
