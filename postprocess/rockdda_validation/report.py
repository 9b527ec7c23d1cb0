# SPDX-License-Identifier: MIT
"""The report of the validation: as Markdown (`index.md`), as a page (`report.html`), and on paper (`report.pdf`).

All are made from the records alone: first a short page (reproduced, explained, not explained), then summaries, then
every case. Where a case has records of both formulations of contacts, text, tables and pictures are those of 'vertex',
whose springs are those of the thesis, and every compared number stands beside that of 'length'.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rockdda.errors import InputError
from rockdda.writing import write_file

from . import report_words as words
from .case import Case, Comparison
from .corner_springs import BY_LENGTH, VERDICTS, counts_corners
from .registry import all_cases
from .report_entry import Entry, entries_of
from .report_first import first_page
from .report_page import page_of, write_pdf
from .runner import load_records

__all__ = ["report_text", "write_report"]

PARTS = {
    "Chapter 3": "Chapter 3: the method on two blocks",
    "Chapter 4": "Chapter 4: block on an incline, shaking table",
    "Chapter 5": "Chapter 5: arches and the centrifuge beam",
    "Chapter 6": "Chapter 6: the water reservoir of Tel Beer-Sheva",
    "Chapter 7": "Chapter 7: layered and jointed roofs",
    "Closed forms": "Closed forms beyond the thesis",
    "Dynamics": "Dynamics: time integration, waves, records",
    "Critical factors": "Critical factors: limit equilibrium and limit analysis",
}
#: Rows of a table that the report shows; the rest is in the file beside it.
MOST_ROWS = 30
MOST_WORST = 6
MOST_MISMATCHES = 5  # of a case in the list of differences


def write_report(target: Path, cases: Sequence[Case] | None = None, *, pdf: bool = False) -> list[Path]:
    """Write `index.md`, `report.html` and, with `pdf`, `report.pdf` from all records in `target/data`."""
    if not (target / "data").is_dir():
        raise InputError("there are no records in it", target)
    cases = all_cases() if cases is None else cases
    records = load_records(target, cases)
    text = report_text(records, cases)
    paths = [target / "index.md", target / "report.html"]
    write_file(paths[0], text)
    write_file(paths[1], page_of(text, PARTS.values()))
    if pdf:
        paths.append(write_pdf(paths[1]))
    return paths


def report_text(records: Sequence[dict[str, Any]], cases: Sequence[Case]) -> str:
    """The report as Markdown."""
    entries = entries_of(records)
    lines = ["# Validation of RockDDA", ""]
    lines += first_page(entries)
    lines += _summary(entries)
    lines += _worst(entries)
    lines += _mismatches(entries)
    lines += _by_length(entries)
    lines += _conditions(entries, cases)
    for part in dict.fromkeys(str(entry.record["part"]) for entry in entries):
        lines += [f"## {PARTS.get(part, part)}", ""]
        for entry in entries:
            if entry.record["part"] == part:
                lines += _case(entry)
    return "\n".join(lines).rstrip() + "\n"


# -- summaries ------------------------------------------------------------------------------------------------------


def _summary(entries: Sequence[Entry]) -> list[str]:
    rows = []
    for entry in entries:
        worst = words.largest(entry.comparisons, "error")
        compared = any(c.published_error is not None for c in entry.comparisons)
        unknown = sum(words.unexplained(c) for c in entry.apart)
        rows.append(
            [
                f"{entry.section}[{entry.record['title']}](#{words.anchor(entry.identifier)})",
                words.sources(entry.comparisons),
                words.error_text(worst, worst.error) if worst else "–",
                words.promise_text(worst) if worst and worst.allowed is not None else "–",
                entry.verdict(entry.record),
                entry.verdict(entry.beside),
                words.near(entry.comparisons),
                words.near(entry.others) if entry.beside else "–",
                str(unknown) if compared else "–",
            ]
        )
    near = f"published within {words.percent(words.NOTABLE)}"
    head = ["case", "truth", "worst error", "promised for it", "promises kept", "by length", near, "by length"]
    head += ["not explained"]
    if all(entry.beside is None for entry in entries):
        rows = [[*row[:5], row[6], row[8]] for row in rows]
        head = [*head[:5], head[6], head[8]]
    return ["## What was compared", "", *words.table(head, rows), ""]


def _worst(entries: Sequence[Entry]) -> list[str]:
    """The largest errors against the truth, relative ones."""
    found = [(entry, c) for entry in entries for c in entry.comparisons if c.error is not None and c.scale != 1]
    found.sort(key=lambda pair: -abs(words.finite(pair[1].error)))
    rows = [
        [
            entry.link,
            c.quantity,
            words.computed_number(c),
            words.number(c.truth, c.unit),
            words.error_text(c, c.error),
            words.promise_text(c),
        ]
        for entry, c in found[:MOST_WORST]
    ]
    if not rows:
        return []
    head = ["case", "quantity", "RockDDA", "truth", "error", "promised"]
    return ["## The worst errors against the truth", "", *words.table(head, rows), ""]


def _mismatches(entries: Sequence[Entry]) -> list[str]:
    """Broken promises and large differences, the worst of each case."""
    rows = []
    for entry in entries:
        if entry.error:
            rows.append([entry.link, "the case could not be computed", "–", "–", "–", entry.error])
        found = sorted(_mismatches_of(entry), key=lambda row: row[:2])
        rows += [[entry.link, *row[2:]] for row in found[:MOST_MISMATCHES]]
        if len(found) > MOST_MISMATCHES:
            rest = found[MOST_MISMATCHES:]
            open_ = sum("not explained" in row[-1] for row in rest)
            why = "see the case" + (f"; {open_} of them not explained" if open_ else "")
            rows.append([entry.link, f"and {len(rest)} more", "–", "–", "–", why])
    lines = ["## What does not match", ""]
    if not rows:
        return [
            *lines,
            f"Nothing: no promise is broken, and no difference is larger than {words.percent(words.NOTABLE)}.",
            "",
        ]
    lines += [f"Broken promises, and all differences larger than {words.percent(words.NOTABLE)}, promised or not.", ""]
    head = ["case", "quantity", "RockDDA", "against", "difference", "explanation"]
    return [*lines, *words.table(head, rows), ""]


def _mismatches_of(entry: Entry) -> list[tuple[bool, float, str, str, str, str, str]]:
    """Rows that begin with their sort keys: kept promises after broken ones, small after large differences."""
    rows = []
    for c in entry.comparisons:
        computed = words.computed_number(c)
        for name, value, error in (("truth", c.truth, c.error), ("published", c.published, c.published_error)):
            # the promise is about the truth where there is one
            broken = c.agrees is False and (name == "truth" or c.truth is None) and value is not None
            listed = error is not None and words.notable(c, error, value) and not words.is_within_promise(c, name)
            if error is not None and (broken or listed):
                mark = "**broken:** " if broken else ""
                limit = {"upper": "≤ ", "lower": "≥ "}.get(c.bound, "") if name == "published" else ""
                against = f"{name} {limit}{words.number(value, c.unit)}"
                size = -abs(words.finite(error))
                why = c.explanation or "**not explained**"
                if name == "published" and why.startswith("published"):
                    why = f"**not explained**; {why}"
                if name == "published" and not c.explanation and c.truth is not None and c.agrees:
                    why += f"; the truth ({c.truth_source}) is met, {words.error_text(c, c.error)}"
                rows.append((not broken, size, c.quantity, computed, against, mark + words.error_text(c, error), why))
    return rows


def _by_length(entries: Sequence[Entry]) -> list[str]:
    """Promises that contacts by length do not keep, and cases that could not be computed with them."""
    rows = []
    for entry in entries:
        if entry.beside and entry.beside.get("error"):
            rows.append([entry.link, "the case could not be computed", "–", "–", "–", "–", str(entry.beside["error"])])
        for at_corners, c in entry.pairs():
            if c is not None and c.agrees is False:
                rows.append(
                    [
                        entry.link, c.quantity, words.computed_number(at_corners) if at_corners else "–",
                        words.computed_number(c), words.number(c.truth, c.unit) if c.truth is not None else "–",
                        f"{words.error_text(c, c.error)}, promised {words.promise_text(c)}",
                        BY_LENGTH.get(entry.identifier, "not explained"),
                    ]
                )  # fmt: skip
    if all(entry.beside is None for entry in entries):
        return []
    lines = ["## What differs by length", ""]
    free = sum(counts_corners(entry.identifier, c) for entry in entries for c in entry.others)
    text = (
        f"{words.counted(free, 'truth')} {'counts' if free == 1 else 'count'} springs of g0 at corners and make no "
        "promise by length: a face has a stiffness per length there, g0 over the mean edge length of all blocks, those "
        "of abutments and frames included. It is softer than two springs of g0, in compression by the long edges, and "
        "three times more in bending (kL³/12). "
    )
    changed = [
        f"- {entry.link}: {VERDICTS[entry.identifier]}."
        for entry in entries
        if entry.beside and entry.identifier in VERDICTS
    ]
    if changed:
        lines += ["Verdicts that are others by length:", "", *changed, ""]
    if not rows:
        return [*lines, text + "Of the others none is broken.", ""]
    head = ["case", "quantity", "vertex", "length", "truth", "error by length", "why"]
    return [*lines, text + "Of the others these are broken:", "", *words.table(head, rows), ""]


def _builds(entries: Sequence[Entry]) -> list[str]:
    """Builds of the program that computed the numbers, as far as recorded."""
    builds: dict[str, list[str]] = {}
    for entry in entries:
        builds.setdefault(str(entry.record.get("build") or ""), []).append(entry.link)
    old = builds.pop("", [])
    if not builds:
        return []
    told = [f"`{build}` ({', '.join(links)})" for build, links in sorted(builds.items())]
    rest = f"; {words.counted(len(old), 'case')} of which it was not kept" if old else ""
    return [f"- Builds, by the first digits of the SHA-256 of the compiled part: {'; '.join(told)}{rest}."]


def _conditions(entries: Sequence[Entry], cases: Sequence[Case]) -> list[str]:
    """Program, machine and settings behind the numbers."""
    full = [entry for entry in entries if entry.record.get("full")]
    quick = [entry for entry in entries if not entry.record.get("full")]
    versions = sorted({str(entry.record.get("version") or "unknown") for entry in entries})
    processors = sorted({str(entry.record.get("processor") or "") for entry in entries} - {""})
    lines = ["## How this was made", ""]
    lines.append(f"- Program version {', '.join(versions)}; every run goes through `rockdda.run`, with one thread.")
    lines.append("- The same input gives the same bits with any number of threads, and from `rockdda run`.")
    lines += _builds(entries)
    for some, name in ((full, "full"), (quick, "quick")):
        if some:
            seconds = sum(entry.record.get("seconds", 0.0) for entry in some)
            runs, steps = (sum(entry.record[key] for entry in some) for key in ("runs", "steps"))
            of = f" ({', '.join(entry.identifier for entry in some)})" if full and quick and some is quick else ""
            lines.append(
                f"- `rockdda-post validate --{name}` made {words.counted(len(some), 'case')}{of}: "
                f"{words.counted(runs, 'run')}, {words.counted(steps, 'time step')}, "
                f"{words.duration(seconds)} on one core" + (f" ({'; '.join(processors)})." if processors else ".")
            )
    lines += _run_by_length(entries)
    # runs of a study that were done before count in run_seconds only; a busy machine alone does not make ten times
    reused = [entry for entry in entries if entry.record.get("run_seconds", 0) > 10 * entry.record.get("seconds", 0)]
    if reused:
        before = words.duration(sum(entry.record["run_seconds"] for entry in reused))
        lines.append(
            f"- Not in that time: {before} by the clock for runs that had been done before and "
            f"were kept ({', '.join(entry.link for entry in reused)})."
        )
    ran = [entry for entry in entries if entry.record["runs"]]
    if ran:
        worst = max(ran, key=lambda entry: words.finite(entry.record.get("energy_residual")))
        lines.append(
            "- Energy closes: what the ledger leaves over is at most "
            f"{words.finite(worst.record.get('energy_residual')):.1e} of the largest energy of the run ({worst.link})."
        )
    present = {entry.identifier for entry in entries}
    missing = [case.identifier for case in cases if case.identifier not in present]
    if missing:
        lines.append(f"- **Not run:** {', '.join(missing)}.")
    strange = sorted(present - {case.identifier for case in cases})
    if strange:
        lines.append(f"- Left by another version, which had other cases: {', '.join(strange)}.")
    lines.append(
        "- Promised errors of the quick form of the cases are kept by a test at every change of the program. "
        "Numbers of this report are in `data/`, one file for each case; tables and figures in `figures/`."
    )
    return [*lines, ""]


def _run_by_length(entries: Sequence[Entry]) -> list[str]:
    """What was computed by length, and which cases were not."""
    records = [entry.beside for entry in entries if entry.beside]
    if not records:
        return []
    runs, steps, seconds = (sum(record.get(key, 0) for record in records) for key in ("runs", "steps", "seconds"))
    builds = ", ".join(sorted({f"`{record['build']}`" for record in records if record.get("build")}))
    left = [entry.identifier for entry in entries if not entry.beside and entry.formulation != "length"]
    text = (
        f"- By length: {words.counted(len(records), 'case')}, {words.counted(runs, 'run')}, "
        f"{words.counted(steps, 'time step')}, {words.duration(seconds)} on one core; build {builds or 'not kept'}."
    )
    return [text + (f" **Not run by length:** {', '.join(left)}." if left else "")]


# -- a case ----------------------------------------------------------------------------------------------------------


def _case(entry: Entry) -> list[str]:
    record = entry.record
    mode = "--full" if record.get("full") else "--quick"
    mode += f" --formulation {entry.formulation}" if entry.formulation else ""
    lines = [f'<a id="{words.anchor(entry.identifier)}"></a>', "", f"### {entry.identifier}: {record['title']}", ""]
    if entry.error:
        lines += [f"**The case could not be computed:** {words.cell(entry.error)}", ""]
    figures = f"figures/{entry.formulation}" if entry.formulation else "figures"
    if entry.formulation == "length":
        lines += ["*By length only.*", ""]
    for item in record["items"]:
        if item["kind"] == "text":
            lines += [re.sub(r"^#{1,3} ", "#### ", item["text"], flags=re.M), ""]
        elif item["kind"] == "figure":
            lines += [
                f"![{words.alternative(item['caption'])}]({figures}/{item['file']})",
                "",
                f"*{item['caption'].strip()}*",
                "",
            ]
        elif item["kind"] == "table":
            rest = len(item["rows"]) - MOST_ROWS
            more = f" The first {MOST_ROWS} of {len(item['rows'])} rows." if rest > 0 else ""
            lines += [f"*{item['caption'].strip()}{more} ([CSV]({figures}/{item['file']}))*", ""]
            lines += [*words.table(item["columns"], item["rows"][:MOST_ROWS]), ""]
    if entry.comparisons:
        lines += [*_comparisons(entry), ""]
    made = f"`rockdda-post validate {mode} --case {entry.identifier}`: {words.counted(record['runs'], 'run')}, "
    made += f"{words.counted(record['steps'], 'time step')}, {words.duration(record.get('seconds', 0.0))}"
    if record["runs"]:
        left = words.finite(record.get("energy_residual"))
        made += f"; the energy ledger leaves over at most {left:.1e} of the largest energy"
    return [*lines, made + ".", ""]


def _comparisons(entry: Entry) -> list[str]:
    """All numbers of a case, those by length beside them; columns that would be empty are left out."""
    head = ["quantity", entry.formulation or "RockDDA", "length", "truth", "error", "error by length", "promised"]
    head += ["published", "difference", "difference by length", "explanation"]
    rows = []
    for here, beside in entry.pairs():
        c = here or beside
        assert c is not None
        published = (
            {"upper": "≤ ", "lower": "≥ "}.get(c.bound, "")
            + words.number(c.published, c.unit)
            + (f" ({c.published_source})" if c.published_source else "")
        )
        rows.append(
            [
                c.quantity,
                words.computed_number(here) if here else "–",
                words.computed_number(beside) if beside else "–",
                _truth(c, beside),
                words.error_text(here, here.error) if here else "–",
                words.broken_mark(beside) + words.error_text(beside, beside.error) if beside else "–",
                words.broken_mark(here) + words.promise_text(here) if here else "–",
                published if c.published is not None else "–",
                words.difference_text(here) if here else "–",
                words.difference_text(beside) if beside else "–",
                c.explanation or "–",
            ]
        )
    kept = [k for k in range(len(head)) if k < 2 or any(row[k] != "–" for row in rows)]
    return words.table([head[k] for k in kept], [[row[k] for k in kept] for row in rows])


def _truth(c: Comparison, beside: Comparison | None) -> str:
    """With its source, and the one by length where it is another."""
    if c.truth is None:
        return "–"
    text = words.number(c.truth, c.unit)
    if beside is not None and beside.truth is not None and words.number(beside.truth, c.unit) != text:
        text += f", by length {words.number(beside.truth, c.unit)}"
    return text + (f" ({c.truth_source})" if c.truth_source else "")
