# SPDX-License-Identifier: MIT
"""The probability that a model fails, where inputs scatter or joints are drawn anew."""

from __future__ import annotations

import copy
import html
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import FloatArray
from ..critical import UNITS as SEARCH_UNITS
from ..errors import ConvergenceError, InputError, need
from ..groups import as_list
from ..labelled import labelled_text
from ..model import Model
from ..namelist import parse_groups
from ..study import Study, read_study
from ..text import PathLike, decoded
from .failure import (
    BackAnalysis,
    back_analysis,
    failure_of,
    index_of,
    intervals_of_shares,
    shares_of_variance,
    wilson,
)
from .pictures import draw_reliability
from .random_inputs import RandomInput, check_values, correlation_of, lay_out, parse_inputs, sample
from .running import (
    FAILS,
    STANDS,
    UNKNOWN,
    WRONG_INPUT,
    Found,
    Progress,
    case_folder,
    found_in,
    output_folder,
    run_studies,
    search_name,
    search_options,
    write_answer,
)
from .surrogate import Surrogate, fit, least_runs, mechanisms
from .template import Placeholders, Source, read_source, write_study
from .verdict import percent, two_digits

if TYPE_CHECKING:
    import pandas

RUNS = 30
PRECISION = 0.05  #: half of the interval at which networks need not be drawn any more
BATCH = 10  #: networks after which the interval is looked at
FITS = 0.8  #: share of the variance of the factors that a surface must give at runs that are left out
MOST_UNKNOWN = 0.1  #: share of runs that may be without a factor on a side that is not known
SURFACE, COUNTED = "surface", "counted"


@dataclass(frozen=True)
class Plan:
    """What is asked for."""

    inputs: tuple[RandomInput, ...]
    correlation: FloatArray
    values: FloatArray  #: (runs, inputs)
    seeds: tuple[int, ...]  #: of the networks; none where the lines are given
    search: str
    limit: float  #: below it the model counts as failing
    precision: float
    back_analysis: float | None
    given_correlation: str = ""


@dataclass(frozen=True, repr=False)
class Reliability:
    """How likely a model fails."""

    title: str
    plan: Plan
    found: tuple[Found, ...]  #: a search for each run
    probability: float
    interval: tuple[float, float]  #: 95 %
    method: str  #: SURFACE, or COUNTED: runs that fail
    refusal: str  #: why a surface was not used; '' where it was, or none was asked for
    surface: Surrogate | None
    design_point: dict[str, float]  #: the most likely values at which the model fails
    distance: float | None  #: of the design point from the middle, in standard deviations
    distance_interval: tuple[float, float] | None  #: 95 %
    sensitivity: dict[str, float]  #: share of the variance of the factor that goes when the input is known
    sensitivity_interval: dict[str, tuple[float, float]]  #: 95 %
    line: BackAnalysis | None
    digest: str  #: of the input
    folder: Path
    stopped: bool = False  #: fewer networks than asked for: the interval is narrow enough
    notes: tuple[str, ...] = field(default=())

    @property
    def runs(self) -> int:
        return len(self.found)

    @property
    def beta(self) -> float:
        """The reliability index; infinite where nothing fails."""
        return index_of(self.probability)

    @property
    def beta_interval(self) -> tuple[float, float]:
        """The interval of the index."""
        return index_of(self.interval[1]), index_of(self.interval[0])

    @property
    def factors(self) -> list[float | None]:
        """Of the runs; None where a search found none."""
        return [one.factor for one in self.found]

    @property
    def failed(self) -> int:
        """Runs that fail, with a factor or without."""
        return sum(one.side == FAILS for one in self.found)

    @property
    def table(self) -> pandas.DataFrame:
        """A row a run: inputs, seed, factor, mechanism, side, message."""
        pd = need("pandas", "tables", "a study of reliability")

        rows = []
        for i, one in enumerate(self.found):
            row: dict[str, Any] = {"run": one.case}
            row |= {"seed": self.plan.seeds[i]} if self.plan.seeds else {}
            row |= {name.name: self.plan.values[i, k] for k, name in enumerate(self.plan.inputs)}
            row |= {"factor": one.factor, "mechanism": one.mechanism, "side": one.side, "message": one.message}
            rows.append(row)
        return pd.DataFrame(rows)

    @property
    def verdict(self) -> str:
        """The answer in words, with what it rests on."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        known = np.array([factor for factor in self.factors if factor is not None])
        name, unit = search_name(self.plan.search), SEARCH_UNITS.get(self.plan.search, "")
        if len(known) > 1:
            yield (
                f"{name}: {known.mean():.4g}{unit} ± {two_digits(known.std(ddof=1))}{unit} (mean and standard "
                f"deviation of {len(known)} of {self.runs} runs)"
            )
        low, high = self.interval
        below = f"{name} below {self.plan.limit:g}{unit}"
        counted = f", by {self.failed} of {self.runs} runs that fail" if self.method == COUNTED else ""
        chance = f"{percent(self.probability, 3)}, between {percent(low, 3)} and {percent(high, 3)}"
        yield f"probability of failure: {chance}{counted} ({below})"
        first, last = self.beta_interval
        if 0 < self.probability < 1:
            yield f"reliability index: {self.beta:.3g}, between {_index(first)} and {_index(last)}"
        if self.stopped:
            yield f"stopped after {self.runs} networks: the interval is no wider than ± {self.plan.precision:g}"
        if self.design_point and self.distance is not None and self.distance_interval is not None:
            values = ", ".join(f"{name} {value:.4g}" for name, value in self.design_point.items())
            far = f"{self.distance:.2f} ± {two_digits(_half(self.distance_interval))}"
            yield f"most likely failure: {values} ({far} standard deviations from the middle)"
        if self.sensitivity:
            ranked = sorted(self.sensitivity.items(), key=lambda item: -item[1])
            ends = self.sensitivity_interval
            shares = ", ".join(f"{name} {100 * share:.0f} ± {100 * _half(ends[name]):.0f} %" for name, share in ranked)
            yield f"what makes the factor scatter: {shares}"
            if len(ranked) > 1:
                rivals = [name for name, _ in ranked[1:] if ends[name][1] > ends[ranked[0][0]][0]]
                others = f" (or {', '.join(rivals)}: the runs do not separate them)" if rivals else ""
                yield (
                    f"Spend money on {ranked[0][0]}{others}: measured exactly it would take "
                    f"{100 * ranked[0][1]:.0f} % of the variance of the factor away."
                )
        if self.surface is not None:
            yield (
                f"surface: {self.surface.kind}; it misses runs that are left out by ± "
                f"{two_digits(self.surface.error)}, and gives {100 * self.surface.explained:.1f} % of their variance"
            )
        yield from self.notes
        if self.refusal:
            yield f"No surface was used: {self.refusal}."

    def __str__(self) -> str:
        return self.verdict

    def __repr__(self) -> str:
        low, high = (percent(end, 3) for end in self.interval)
        return (
            f"<rockdda.Reliability: failure {percent(self.probability, 3)}, between {low} and {high}; {self.runs} runs>"
        )

    def _repr_html_(self) -> str:
        """For notebooks: the verdict and the runs."""
        words = "<br>".join(html.escape(line) for line in self._lines())
        return f"<p>{words}</p>" + self.table.to_html(index=False, float_format="{:.4g}".format, na_rep="–")

    def plot(self, kind: str | None = None, **options: Any) -> Any:
        """Draw 'histogram', 'tornado', 'surrogate', 'back-analysis' or, without a kind, all that there are."""
        return draw_reliability(self, kind, **options)

    def as_json(self) -> dict[str, Any]:
        """What `reliability.json` holds."""
        plan, surface = self.plan, self.surface
        of_surface: dict[str, Any] | None = None
        if surface is not None:
            of_surface = {name: getattr(surface, name) for name in ("kind", "error", "explained")}
            of_surface["left_out"] = surface.left_out.tolist()
        laws = {one.name: f"{one.law}({', '.join(f'{x:g}' for x in one.numbers)})" for one in plan.inputs}
        return {
            "title": self.title, "input": self.digest, "runs": self.runs, "failure_probability": self.probability,
            "interval": list(self.interval), "beta": self.beta, "beta_interval": list(self.beta_interval),
            "design_point": self.design_point, "design_point_distance": self.distance,
            "design_point_distance_interval": self.distance_interval, "sensitivity": self.sensitivity,
            "sensitivity_interval": {name: list(ends) for name, ends in self.sensitivity_interval.items()},
            "factors": self.factors, "search": plan.search, "limit": plan.limit, "method": self.method,
            "refusal": self.refusal, "surface": of_surface, "inputs": laws, "correlation": plan.given_correlation,
            "values": plan.values[: self.runs].tolist(), "seeds": list(plan.seeds[: self.runs]),
            "sides": [one.side for one in self.found], "mechanisms": [one.mechanism for one in self.found],
            "messages": [one.message for one in self.found], "stopped": self.stopped, "verdict": self.verdict,
            "back_analysis": None if self.line is None else self.line.as_json(),
        }  # fmt: skip


def _half(interval: tuple[float, float]) -> float:
    return 0.5 * (interval[1] - interval[0])


def _index(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "without bound"


def reliability(
    model: PathLike | Model, vary: str | Mapping[str, str] | None = None, analysis: PathLike | None = None, *,
    runs: int = RUNS, seed: int = 1, seeds: int | None = None, precision: float = PRECISION, correlate: str = "",
    below: float | None = None, back_analysis: float | None = None, config: PathLike | None = None,
    output: PathLike | None = None, jobs: int | None = None, dask: str | None = None, retry: bool = False,
    progress: Progress | None = None, **search: Any,
) -> Reliability:  # fmt: skip
    """Find the probability that a model fails, with a search of its critical factor for each of some runs.

    model: what `rockdda.run` takes. vary: inputs that scatter, 'bedding.friction = normal(35, 5); water.level =
    uniform(-2, 2)', or a mapping; `runs` values are those of a Latin hypercube from `seed`. correlate: 'a, b = -0.5',
    of normal scores. seeds: networks that are drawn anew from the statistics file beside the geometry, until half of
    the interval is below `precision`. below: the factor below which the model counts as failing, 1 where the search has
    none. back_analysis: the factor whose pairs of inputs are wanted. search: options of `rockdda.factor_of_safety`
    (search, joints, from_, to, tolerance, stage …). output: the folder of the study, NAME_reliability by default; what
    is done in it is not run again. jobs: runs at a time; dask: as of `rockdda.study.run_study`. The answer does not
    depend on either."""
    with read_source(model, analysis, config) as source:
        plan = make_plan(source, vary, runs, seed, seeds, precision, correlate, below, back_analysis, search)
        study = prepare_reliability(source, plan, output, search)
        run_reliability(plan, study, jobs, dask, retry, progress)
        found = judge_reliability(source, plan, study)
    write_answer(found, found.folder, "reliability")
    return found


def make_plan(
    source: Source, vary: str | Mapping[str, str] | None, runs: int, seed: int, seeds: int | None, precision: float,
    correlate: str, below: float | None, back: float | None, search: Mapping[str, Any],
) -> Plan:  # fmt: skip
    """Check what is asked for, and draw the values."""
    kind = str(search.get("search") or "strength")
    if not vary and not seeds:
        raise InputError("reliability: nothing is to vary: give --vary or --seeds")
    inputs = parse_inputs(vary, copy.deepcopy(source.groups)) if vary else []
    if below is None and kind in SEARCH_UNITS | {"push": ""}:
        raise InputError(f"reliability: --below says which {search_name(kind)} counts as failure")
    count = seeds or runs
    if count < 1:
        raise InputError("runs: expected at least 1")
    if inputs and not seeds and count < least_runs(len(inputs)):
        raise InputError(f"runs: {len(inputs)} inputs take at least {least_runs(len(inputs))} runs, found {count}")
    if back is not None and (len(inputs) < 2 or seeds):
        raise InputError("back-analysis: takes two inputs that vary, and given joints")
    if correlate and not inputs:
        raise InputError("correlate: nothing varies")
    if not 0 <= precision < 1:
        raise InputError(f"precision: expected a share from 0 to 1, found {precision:g}")
    matrix = correlation_of(correlate, inputs) if inputs else np.eye(0)
    values = sample(inputs, matrix, count, seed, independent=bool(seeds)) if inputs else np.zeros((count, 0))
    check_values(inputs, values)
    drawn = tuple(range(seed, seed + seeds)) if seeds else ()
    limit = 1.0 if below is None else below
    return Plan(tuple(inputs), matrix, values, drawn, kind, limit, precision, back, correlate)


def prepare_reliability(source: Source, plan: Plan, output: PathLike | None, search: Mapping[str, Any]) -> Study:
    """Write the study of the searches."""
    groups, marks = copy.deepcopy(source.groups), Placeholders()
    if plan.inputs:
        parse_inputs(
            {one.name: f"{one.law}({','.join(map(repr, one.numbers))})" for one in plan.inputs}, groups
        )  # groups that inputs add
        lay_out(plan.inputs, groups, marks)
    statistics = None
    if plan.seeds:
        if source.statistics is None:
            place = Path(str(source.groups["model"][0]["geometry"])).with_suffix(".dl")
            raise InputError(f"seeds: there is no statistics file {place}, from which the lines could be drawn anew")
        found = parse_groups(decoded(source.statistics.read_bytes()))
        lines = {**(as_list(found.get("lines", {}))[0]), "seed": "@seed@"}
        statistics = labelled_text({**found, "lines": lines}).replace("'@seed@'", "{{seed}}")
    cases: list[dict[str, Any]] = []
    for i, row in enumerate(plan.values.tolist()):
        case: dict[str, Any] = {"seed": plan.seeds[i]} if plan.seeds else {}
        cases.append(case | {one.parameter: value for one, value in zip(plan.inputs, row, strict=True)})
    folder = output_folder(output, source.name, "reliability")
    return read_study(write_study(source, folder, marks.text(groups), cases, title=f"{source.title}: reliability",
                                  command="fos", options=search_options(search), statistics=statistics))  # fmt: skip


def run_reliability(
    plan: Plan, study: Study, jobs: int | None, dask: str | None, retry: bool, progress: Progress | None
) -> None:
    """Run the searches; networks in batches, until the interval is narrow enough."""
    if not plan.seeds:
        run_studies([study], jobs, dask, retry, progress)
        return
    from dataclasses import replace

    for end in range(BATCH, len(plan.seeds) + BATCH, BATCH):
        run_studies([replace(study, cases=study.cases[:end])], jobs, dask, retry, progress)
        if narrow_after(plan, _all_found(plan, study))[1]:
            return


def _all_found(plan: Plan, study: Study) -> list[Found]:
    return [found_in(study, case_folder(study, i), i, plan.limit) for i in range(1, len(study.cases) + 1)]


def narrow_after(plan: Plan, found: Sequence[Found]) -> tuple[int, bool]:
    """After how many networks the interval is narrow enough, and whether it is."""
    for end in range(BATCH, len(found), BATCH):
        part = found[:end]
        if any(one.message == "not run yet" for one in part):
            break
        low, high = _counted(part)[1]
        if 0.5 * (high - low) <= plan.precision:
            return end, True
    return len(found), False


def _counted(found: Sequence[Found]) -> tuple[float, tuple[float, float]]:
    """Share of runs that fail, and its interval: runs of which the side is not known may be on either."""
    failed, unknown = (sum(one.side == side for one in found) for side in (FAILS, UNKNOWN))
    low, high = wilson(failed, len(found))[0], wilson(failed + unknown, len(found))[1]
    sure = len(found) - unknown
    return (failed / sure if sure else math.nan), (low, high)


def judge_reliability(source: Source, plan: Plan, study: Study) -> Reliability:
    """Judge the searches that are done."""
    found = _all_found(plan, study)
    stopped = False
    if plan.seeds:
        count, stopped = narrow_after(plan, found)
        found = found[:count]
    waiting = sum(one.message == "not run yet" for one in found)
    if waiting:
        raise InputError(f"{waiting} of {len(found)} runs are not done yet: run this command again, or their jobs")
    surface, refusal = None, ""
    if plan.inputs and not plan.seeds:
        surface, refusal = _surface(plan, found)
    share, interval = _counted(found)
    if math.isnan(share):
        if all(one.exit_code == WRONG_INPUT for one in found):
            raise InputError(found[0].message)
        raise ConvergenceError(f"no run has a factor: {found[0].message}")
    answer: dict[str, Any] = {
        "probability": share, "interval": interval, "method": COUNTED, "design_point": {}, "distance": None,
        "distance_interval": None, "sensitivity": {}, "sensitivity_interval": {}, "line": None,
    }  # fmt: skip
    if surface is not None:
        answer |= _by_surface(plan, found, surface)
    return Reliability(
        title=source.title, plan=plan, found=tuple(found), refusal=refusal, surface=surface, digest=source.digest,
        folder=study.file.parent, stopped=stopped, notes=tuple(_notes(plan, found, surface)), **answer,
    )  # fmt: skip


def _surface(plan: Plan, found: Sequence[Found]) -> tuple[Surrogate | None, str]:
    """The surface through the factors, or why there is none."""
    known = [i for i, one in enumerate(found) if one.factor is not None]
    unknown = sum(one.side == UNKNOWN for one in found)
    if unknown > MOST_UNKNOWN * len(found):
        return None, f"{unknown} of {len(found)} runs have no factor, and it is not known whether they stand"
    factors = np.array([found[i].factor for i in known], dtype=float)
    widest = 2 * max((one.half_width for one in found), default=0.0)
    if len(known) and float(np.ptp(factors)) <= widest:
        return None, f"what varies moves the factor by no more than the interval of its search, {widest:.2g}"
    laws = [one.distribution for one in plan.inputs]
    mean, deviation = (np.array([float(getattr(law, name)()) for law in laws]) for name in ("mean", "std"))
    surface = fit(plan.values[known], factors, mean, deviation) if len(known) else None
    if surface is None:
        return None, f"{len(known)} runs with a factor are too few for {len(plan.inputs)} inputs"
    if surface.explained < FITS:
        return None, (
            f"a {surface.kind} surface gives {100 * max(surface.explained, 0):.0f} % of the variance of runs that are "
            f"left out, less than {100 * FITS:g} %: the factor jumps, or another mechanism takes over"
        )
    return surface, ""


def _by_surface(plan: Plan, found: Sequence[Found], surface: Surrogate) -> dict[str, Any]:
    """Probability, design point and sensitivities by the surface; runs without a factor widen the interval where it
    does not have them on their side."""
    noise = max((one.half_width for one in found), default=0.0) / math.sqrt(3)
    failure = failure_of(surface, plan.inputs, plan.correlation, plan.limit, noise)
    predicted = surface(plan.values[: len(found)])
    low, high = failure.interval
    for one, value in zip(found, predicted, strict=True):
        if one.factor is None and one.side != (FAILS if value < plan.limit else STANDS):
            high += (value >= plan.limit) / len(found)
            low -= (value < plan.limit) / len(found)
    answer: dict[str, Any] = {"probability": failure.probability, "interval": (max(low, 0.0), min(high, 1.0))}
    answer |= {"method": SURFACE, "distance": failure.distance, "design_point": {}, "line": None}
    answer["distance_interval"] = failure.distance_interval
    if failure.design_point is not None:
        answer["design_point"] = dict(
            zip((one.name for one in plan.inputs), failure.design_point.tolist(), strict=True)
        )
    if plan.back_analysis is not None:
        answer["line"] = back_analysis(surface, plan.inputs, plan.correlation, plan.values, plan.back_analysis)
    answer["sensitivity_interval"] = intervals_of_shares(surface, plan.inputs, plan.correlation, noise)
    return answer | {"sensitivity": shares_of_variance(surface, plan.inputs, plan.correlation)}


def _notes(plan: Plan, found: Sequence[Found], surface: Surrogate | None) -> Iterator[str]:
    """What a reader must learn of the runs."""
    without = [one for one in found if one.factor is None]
    if without:
        sides = {side: sum(one.side == side for one in without) for side in (STANDS, FAILS, UNKNOWN)}
        words = {STANDS: "stand beyond the search", FAILS: "fail before it", UNKNOWN: "ended without a verdict"}
        told = ", ".join(f"{count} {words[side]}" for side, count in sides.items() if count)
        yield f"runs without a factor: {told} (run {without[0].case}: {without[0].message.splitlines()[0]})"
    kinds = mechanisms([one.mechanism for one in found])
    if len(kinds) > 1:
        yield "mechanisms: " + ", ".join(f"{kind} {count}" for kind, count in kinds.items())
    if surface is not None:
        predicted = surface(plan.values[: len(found)])
        wrong = [
            one.case
            for one, value in zip(found, predicted, strict=True)
            if one.side != UNKNOWN and (one.side == FAILS) != (value < plan.limit)
        ]
        if wrong:
            numbers = ", ".join(map(str, wrong[:8]))
            yield f"the surface has {len(wrong)} of {len(found)} runs on the wrong side: {numbers}"
