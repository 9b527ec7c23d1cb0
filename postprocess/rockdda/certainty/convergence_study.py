# SPDX-License-Identifier: MIT
"""Does a number of a run depend on numbers of the method, and how far on the stiffness of the joints?"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..critical import search_title
from ..errors import ConvergenceError, InputError, need
from ..model import Model
from ..results import Results
from ..study import Study, read_study
from ..text import PathLike
from ..units import Units
from .pictures import draw_convergence
from .quantities import check_names, extent_of, measure, quantities_of
from .running import (
    WRONG_INPUT,
    Found,
    Progress,
    case_folder,
    found_in,
    output_folder,
    run_studies,
    search_options,
    write_answer,
)
from .template import Source, read_source, write_study
from .variants import (
    AS_IT_IS,
    MANY,
    METHOD,
    PROPERTY,
    STIFFER,
    Variant,
    comes_to_rest,
    has_chosen_stiffness,
    steps_of,
    template_of,
    variants_of,
)
from .verdict import AS_WORD, EQUILIBRIUM, UNNAMED, WORDS, Finding, judge, listed, percent

if TYPE_CHECKING:
    import pandas

LIMIT = 0.05  #: share of a number by which it may change
FACTOR = "factor"


@dataclass(frozen=True, repr=False)
class Convergence:
    """Numbers of a model, and how sure each is."""

    title: str
    findings: tuple[Finding, ...]
    variants: tuple[Variant, ...]
    failed: dict[str, str]  #: messages of the variants that have no results
    limit: float  #: share by which a number may change
    units: Units
    chosen_stiffness: bool  #: has the program chosen the stiffness of joints?
    digest: str  #: of the input
    folder: Path

    @property
    def exceeded(self) -> bool:
        """Does a number change by more than the limit, or has a variant failed?"""
        return bool(self.failed) or any(finding.exceeds(self.limit) for finding in self.findings)

    @property
    def table(self) -> pandas.DataFrame:
        """A row a number: value, change by each variant, order, extrapolated value, errors."""
        pd = need("pandas", "tables", "a study of convergence")

        rows = []
        for one in self.findings:
            row: dict[str, Any] = {"quantity": one.name, "stage": one.stage, "value": one.value}
            row |= {name: one.changes.get(name) for name in self.names}
            row |= {"order": one.order, "extrapolated": one.extrapolated}
            row |= {"method": one.method, "joints": one.joints, "verdict": self.words(one)}
            rows.append(row)
        return pd.DataFrame(rows)

    @property
    def names(self) -> list[str]:
        """Of the variants."""
        return [variant.name for variant in self.variants if variant.kind]

    def words(self, finding: Finding) -> str:
        """The verdict of a number."""
        return finding.words(self.units, self.chosen_stiffness, self.limit)

    @property
    def verdict(self) -> str:
        """All verdicts, and what to do."""
        return "\n".join([*map(self.words, self.findings), *self._failures(), self.summary])

    def _failures(self) -> list[str]:
        return [f"the run with {name} failed: {message.splitlines()[0]}" for name, message in self.failed.items()]

    @property
    def summary(self) -> str:
        """What to spend money on."""
        known = [one for one in self.findings if one.value is not None]
        if not known:
            return "There is no number to judge."
        wrong = [kind for kind in METHOD if any(kind in one.exceeds(self.limit) for one in known)]
        most = max(known, key=lambda one: one.deciding(one.joints))
        method = max(one.deciding(one.method) for one in known)
        if wrong:
            causes = listed([WORDS[kind] for kind in wrong])
            text = f"Numbers of the method matter: refine {causes} before you use these numbers."
        else:
            text = (
                f"Each number of the method matters by less than {100 * self.limit:g} % (all together "
                f"{percent(max(method, UNNAMED))} at most): no time need be spent on them."
            )
            if any(one.method > self.limit * abs(one.value or 0.0) for one in known):
                text += " Shares of a component are shares of the whole displacement of its point."
        errors = [(one, error) for one in known for error in one.plus_minus.values()]
        few = any(one.share(error) > self.limit >= one.deciding(error) for one, error in errors)
        if few:
            text += f" Displacements that change by less than {AS_WORD} do not count beside a factor."
        share = most.deciding(most.joints)
        if share > self.limit:
            text += (
                f" The joint stiffness moves {most.title} by {percent(share)} when it is half or twice as "
                "large: measure it."
            )
        elif PROPERTY in most.plus_minus:
            number = "other number" if few else "number"
            text += f" Half or twice the joint stiffness moves no {number} by more than {percent(max(share, UNNAMED))}."
        return text

    def __str__(self) -> str:
        return self.verdict

    def __repr__(self) -> str:
        return f"<rockdda.Convergence: {len(self.findings)} numbers; {self.summary}>"

    def _repr_html_(self) -> str:
        """For notebooks: the table and the verdict."""
        words = "<br>".join(html.escape(line) for line in self.verdict.splitlines())
        return f"<p>{words}</p>" + self.table.drop(columns="verdict").to_html(index=False, float_format="{:.4g}".format)

    def plot(self, axes: Any = None) -> Any:
        """Draw the changes of every number; returns matplotlib axes."""
        return draw_convergence(self, axes)

    def as_json(self) -> dict[str, Any]:
        """What `convergence.json` holds."""
        names = ("title", "limit", "exceeded", "chosen_stiffness", "failed", "summary")
        rows = [
            asdict(one) | {"method": one.method, "joints": one.joints, "exceeds": one.exceeds(self.limit)}
            | {"verdict": self.words(one)} for one in self.findings
        ]  # fmt: skip
        return {name: getattr(self, name) for name in names} | {
            "input": self.digest, "units": [self.units.length, self.units.time, self.units.force],
            "variants": [asdict(variant) for variant in self.variants], "quantities": rows,
        }  # fmt: skip


def convergence(
    model: PathLike | Model, analysis: PathLike | None = None, *, quantities: Sequence[str] = (), fos: bool = False,
    limit: float = LIMIT, config: PathLike | None = None, output: PathLike | None = None, jobs: int | None = None,
    dask: str | None = None, retry: bool = False, progress: Progress | None = None, **search: Any,
) -> Convergence:  # fmt: skip
    """Run a model with other numbers of the method and other joint stiffness, and judge its numbers.

    model: what `rockdda.run` takes. quantities: names as 'point 1 y', 'factor', or 'max(history/energy[0])'; by default
    the displacements of all measured points at the end of every stage. fos: also the critical factor, with the options
    of `rockdda.factor_of_safety` (search, joints, from_, to, tolerance, stage …). limit: share of a number by which it
    may change. output: the folder of the study, NAME_convergence by default; what is done in it is not run again.
    jobs: runs at a time; dask: as of `rockdda.study.run_study`. The answer does not depend on either."""
    wanted = _checked(quantities, fos, limit)
    with read_source(model, analysis, config) as source:
        studies = prepare_convergence(source, output, fos, search)
        run_studies(studies, jobs, dask, retry, progress)
        found = judge_convergence(source, studies, wanted, bool(quantities) and not wanted, limit, search)
    write_answer(found, found.folder, "convergence")
    return found


def _checked(quantities: Sequence[str], fos: bool, limit: float) -> list[str]:
    """Names of quantities but the factor; InputError for what is wrong before any run."""
    if not limit > 0:
        raise InputError(f"limit: expected a share above 0, found {limit:g}")
    wanted = [name for name in quantities if name.lower() != FACTOR]
    if len(wanted) < len(quantities) and not fos:
        raise InputError("quantity: the factor needs --fos")
    check_names(wanted)
    return wanted


def prepare_convergence(source: Source, output: PathLike | None, fos: bool, search: dict[str, Any]) -> list[Study]:
    """Write the studies of the runs and, with `fos`, of the searches."""
    folder = output_folder(output, source.name, "convergence")
    words = search_options(search)
    if words and not fos:
        raise InputError(f"{words[0]}: options of a search need --fos")
    template, stiffer = template_of(source), STIFFER if search.get("search") == "load" else 1.0
    kinds: list[tuple[str, str, list[str], float]] = [("model", "run", [], 1.0), ("factor", "fos", words, stiffer)]
    return [
        read_study(write_study(source, folder / part, template,
                               [one.changes(steps_of(source)) for one in variants_of(source, times)],
                               title=f"{source.title}: {part}", command=command, options=options,
                               constants=AS_IT_IS.values(0) | {"steps": MANY}))
        for part, command, options, times in (kinds if fos else kinds[:1])
    ]  # fmt: skip


def judge_convergence(
    source: Source, studies: Sequence[Study], quantities: Sequence[str], only_factor: bool, limit: float,
    search: dict[str, Any],
) -> Convergence:  # fmt: skip
    """Judge the numbers of studies that are done."""
    variants = variants_of(source)
    findings, failed, units = _of_runs(
        studies[0], variants, quantities, steps_of(source) > 0 and not comes_to_rest(source),
        EQUILIBRIUM if len(studies) == 2 and not quantities else 0.0,
    )  # fmt: skip
    if only_factor:
        findings = []
    if len(studies) == 2:
        factor, messages = _of_searches(studies[1], variants, search)
        findings.append(factor)
        failed |= {f"{name} (search)": message for name, message in messages.items()}
    return Convergence(
        source.title, tuple(findings), tuple(variants), failed, limit, units, has_chosen_stiffness(source),
        source.digest, studies[0].file.parent.parent,
    )  # fmt: skip


def _of_runs(
    study: Study, variants: Sequence[Variant], names: Sequence[str], by_steps: bool, nothing: float
) -> tuple[list[Finding], dict[str, str], Units]:
    """Findings of the runs, messages of those that failed, and the units. by_steps: a number of steps ends the run, so
    that variants are read at the time that it reaches. nothing: share of the extent of the model by which a
    displacement may change without a say in the verdict."""
    from ..study import collect

    table = collect(study)
    failed = {
        variants[int(case) - 1].name: str(message) or str(status)
        for case, status, message in zip(table["case"], table["status"], table["message"], strict=True)
        if status != "done"
    }
    opened: dict[str, Results] = {}
    try:
        for number, variant in enumerate(variants, start=1):
            if variant.name not in failed:
                opened[variant.name] = Results(case_folder(study, number) / "out.h5")
        base = opened.get(variants[0].name)
        if base is None:
            raise ConvergenceError(f"the model as it is has no results: {failed[variants[0].name]}")
        extent = extent_of(base)
        end = float(base["history/time"][-1]) if by_steps and base.n_steps else math.inf
        found = [
            judge(
                one.name,
                one.stage,
                one.dimension,
                measure(one, base, end),
                {
                    variant.name: _first(measure(one, opened[variant.name], end)) if variant.name in opened else None
                    for variant in variants[1:]
                },
                variants,
                nothing=nothing * extent if one.dimension == "length" else 0.0,
            )
            for one in quantities_of(base, names)
        ]
        return found, failed, Units.parse(None, base)
    finally:
        for results in opened.values():
            results.close()


def _first(found: tuple[float, float] | None) -> float | None:
    return None if found is None else found[0]


def _of_searches(study: Study, variants: Sequence[Variant], search: dict[str, Any]) -> tuple[Finding, dict[str, str]]:
    """The finding of the factor, and messages of the searches without one."""
    found: list[Found] = [found_in(study, case_folder(study, i), i) for i in range(1, len(variants) + 1)]
    base, kind = found[0], str(search.get("search") or "strength")
    if base.exit_code == WRONG_INPUT:
        raise InputError(base.message)
    values = {variant.name: one.factor for variant, one in zip(variants[1:], found[1:], strict=True)}
    finding = judge(
        search_title(kind), "", "", None if base.factor is None else (base.factor, abs(base.factor)), values, variants,
        max(one.half_width for one in found),
    )  # fmt: skip
    messages = {v.name: one.message for v, one in zip(variants, found, strict=True) if one.factor is None}
    return finding, messages
