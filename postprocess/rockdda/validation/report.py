# SPDX-License-Identifier: MIT
"""The report of the validation, as Markdown (`index.md`) and as a page to read or print (`report.html`).

Both are made from the records alone: first what a reviewer asks for, then every case.
"""

from __future__ import annotations

import html
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError, OutputError
from .case import Case, Comparison, all_cases
from .runner import comparison, load_records

__all__ = ["report_text", "write_report"]

PARTS = {
    "Chapter 3": "Chapter 3: the method on two blocks",
    "Chapter 4": "Chapter 4: block on an incline, shaking table",
    "Chapter 5": "Chapter 5: arches and the centrifuge beam",
    "Chapter 6": "Chapter 6: the water reservoir of Tel Beer-Sheva",
    "Chapter 7": "Chapter 7: layered and jointed roofs",
    "Closed forms": "Closed forms beyond the thesis",
}
#: Differences beyond this share are listed on the first page, whether something was promised or not.
NOTABLE = 0.05
#: Rows of a table that the report shows; the rest is in the file beside it.
MOST_ROWS = 30
MOST_WORST = 10
MOST_MISMATCHES = 5  # of a case on the first page
MOST_WORDS = 60  # letters of a source of truth there


@dataclass(frozen=True)
class _Entry:
    """A record with its comparisons."""

    record: dict[str, Any]
    comparisons: list[Comparison]

    @property
    def identifier(self) -> str:
        return str(self.record["identifier"])

    @property
    def error(self) -> str:
        return str(self.record.get("error") or "")

    @property
    def promised(self) -> list[Comparison]:
        return [c for c in self.comparisons if c.agrees is not None]

    @property
    def verdict(self) -> str:
        if self.error:
            return "**failed**"
        if not self.promised:
            return "told only"
        return "yes" if all(c.agrees for c in self.promised) else "**no**"

    @property
    def link(self) -> str:
        return f"[{self.identifier}](#{_anchor(self.identifier)})"


def write_report(target: Path, cases: Sequence[Case] | None = None) -> list[Path]:
    """Write `index.md` and `report.html` from all records in `target/data`."""
    if not (target / "data").is_dir():
        raise InputError("there are no records in it", target)
    cases = all_cases() if cases is None else cases
    records = load_records(target, cases)
    text = report_text(records, cases)
    paths = [target / "index.md", target / "report.html"]
    try:
        paths[0].write_text(text, encoding="utf-8")
        paths[1].write_text(_page(text), encoding="utf-8")
    except OSError as problem:
        raise OutputError(f"{target}: cannot be written: {problem.strerror}") from None
    return paths


def report_text(records: Sequence[dict[str, Any]], cases: Sequence[Case]) -> str:
    """The report as Markdown."""
    entries = [_Entry(record, [comparison(c) for c in record["comparisons"]]) for record in records]
    lines = ["# Validation of RockDDA", ""]
    lines += _opening(entries)
    lines += _summary(entries)
    lines += _worst(entries)
    lines += _mismatches(entries)
    lines += _conditions(entries, cases)
    for part in dict.fromkeys(str(entry.record["part"]) for entry in entries):
        lines += [f"## {PARTS.get(part, part)}", ""]
        for entry in entries:
            if entry.record["part"] == part:
                lines += _case(entry)
    return "\n".join(lines).rstrip() + "\n"


# -- the first page --------------------------------------------------------------------------------------------------


def _opening(entries: Sequence[_Entry]) -> list[str]:
    numbers = [c for entry in entries for c in entry.comparisons]
    promised = [c for c in numbers if c.agrees is not None]
    kept = sum(c.agrees is True for c in promised)
    failed = [entry for entry in entries if entry.error]
    published = [c for c in numbers if c.published_error is not None]
    apart = [c for c in published if _notable(c, c.published_error, c.published)]
    text = (
        f"{_count(len(entries), 'case')}, {_count(len(numbers), 'compared number')}: "
        f"{sum(c.truth is not None for c in numbers)} against a closed form or an independent numerical solution that "
        f"has no DDA in it (the *truth*), {sum(c.published is not None for c in numbers)} against published values. "
        f"The cases promise {_count(len(promised), 'agreement')} within stated bounds; **{kept} of {len(promised)} are "
        "kept**"
    )
    text += (
        f", and **{_count(len(failed), 'case')} could not be computed**." if failed else "; every case was computed."
    )
    if published:
        text += (
            f" Of the published values, {len(published) - len(apart)} of {len(published)} are met within "
            f"{_percent(NOTABLE)}"
        )
        text += (
            f"; the other {len(apart)} differ: {sum(_unexplained(c) for c in apart)} are not explained, the rest have "
            "a note of what is known."
            if apart
            else "."
        )
    return [
        text,
        "",
        "Errors are (ours - truth)/truth, differences (ours - published)/published, unless a scale is given. A promise "
        "is a bound on the error against the truth, or, where there is none, on the difference to the published value; "
        "the case says where it comes from. No "
        "parameter was tuned to meet a published value: what does not match is listed below with its explanation, or "
        "is said to be unexplained. Curves of the thesis that are not in its text or tables are not compared.",
        "",
    ]


def _summary(entries: Sequence[_Entry]) -> list[str]:
    rows = []
    for entry in entries:
        worst = _largest(entry.comparisons, "error")
        compared = [c for c in entry.comparisons if c.published_error is not None]
        defined = [c for c in compared if math.isfinite(c.published_error or 0.0)]
        apart = _largest(defined or compared, "published_error")
        lost = f", {len(compared) - len(defined)} without a number" if defined and len(defined) < len(compared) else ""
        kept = f"{sum(c.agrees is True for c in entry.promised)} of {len(entry.promised)}" if entry.promised else "–"
        rows.append(
            [
                f"{entry.link} {entry.record['title']}",
                _sources(entry.comparisons),
                _error(worst, worst.error) if worst else "–",
                _allowed(worst) if worst and worst.allowed is not None else "–",
                kept,
                _difference(apart) + lost if apart else "–",
                _near(entry.comparisons),
                entry.verdict,
            ]
        )
    head = ["case", "truth", "worst error", "promised for it", "promises kept", "worst difference to published"]
    head += [f"published within {_percent(NOTABLE)}", "agrees as promised"]
    return ["## What was compared", "", *_table(head, rows), ""]


def _worst(entries: Sequence[_Entry]) -> list[str]:
    """The largest errors against the truth, relative ones."""
    found = [(entry, c) for entry in entries for c in entry.comparisons if c.error is not None and c.scale != 1]
    found.sort(key=lambda pair: -abs(_finite(pair[1].error)))
    rows = [
        [entry.link, c.quantity, _ours(c), _value(c.truth, c.unit), _error(c, c.error), _allowed(c)]
        for entry, c in found[:MOST_WORST]
    ]
    if not rows:
        return []
    head = ["case", "quantity", "ours", "truth", "error", "promised"]
    return ["## The worst errors against the truth", "", *_table(head, rows), ""]


def _mismatches(entries: Sequence[_Entry]) -> list[str]:
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
        return [*lines, f"Nothing: no promise is broken, and no difference is larger than {_percent(NOTABLE)}.", ""]
    lines += [f"Broken promises, and all differences larger than {_percent(NOTABLE)}, promised or not.", ""]
    head = ["case", "quantity", "ours", "against", "difference", "explanation"]
    return [*lines, *_table(head, rows), ""]


def _mismatches_of(entry: _Entry) -> list[tuple[bool, float, str, str, str, str, str]]:
    """Rows that begin with what they are sorted by: kept promises after broken ones, small after large differences."""
    rows = []
    for c in entry.comparisons:
        ours = _ours(c)
        for name, value, error in (("truth", c.truth, c.error), ("published", c.published, c.published_error)):
            # the promise is about the truth where there is one
            broken = c.agrees is False and (name == "truth" or c.truth is None) and value is not None
            if error is not None and (broken or (_notable(c, error, value) and not _told(c, name))):
                mark = "**broken:** " if broken else ""
                limit = {"upper": "≤ ", "lower": "≥ "}.get(c.bound, "") if name == "published" else ""
                against = f"{name} {limit}{_value(value, c.unit)}"
                size = -abs(_finite(error))
                why = c.explanation or "**not explained**"
                if name == "published" and why.startswith("published"):
                    why = f"**not explained**; {why}"
                if name == "published" and not c.explanation and c.truth is not None and c.agrees:
                    why += f"; the truth ({c.truth_source}) is met, {_error(c, c.error)}"
                rows.append((not broken, size, c.quantity, ours, against, mark + _error(c, error), why))
    return rows


def _builds(entries: Sequence[_Entry]) -> list[str]:
    """Which builds of the program the numbers come from, as far as it was kept."""
    builds: dict[str, list[str]] = {}
    for entry in entries:
        builds.setdefault(str(entry.record.get("build") or ""), []).append(entry.link)
    old = builds.pop("", [])
    if not builds:
        return []
    told = [f"`{build}` ({', '.join(links)})" for build, links in sorted(builds.items())]
    rest = f"; {_count(len(old), 'case')} of which it was not kept" if old else ""
    return [f"- Builds, by the first digits of the SHA-256 of the compiled part: {'; '.join(told)}{rest}."]


def _conditions(entries: Sequence[_Entry], cases: Sequence[Case]) -> list[str]:
    """How the numbers came to be."""
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
                f"- `rockdda-post validate --{name}` made {_count(len(some), 'case')}{of}: "
                f"{_count(runs, 'run')}, {_count(steps, 'time step')}, {_duration(seconds)} on one core"
                + (f" ({'; '.join(processors)})." if processors else ".")
            )
    # runs of a study that were done before count in run_seconds only; a busy machine alone does not make ten times
    reused = [entry for entry in entries if entry.record.get("run_seconds", 0) > 10 * entry.record.get("seconds", 0)]
    if reused:
        lines.append(
            f"- Not in that time: {_duration(sum(entry.record['run_seconds'] for entry in reused))} by the clock for "
            f"runs that had been done before and were kept ({', '.join(entry.link for entry in reused)})."
        )
    ran = [entry for entry in entries if entry.record["runs"]]
    if ran:
        worst = max(ran, key=lambda entry: _finite(entry.record.get("energy_residual")))
        lines.append(
            "- Energy closes: what the ledger leaves over is at most "
            f"{_finite(worst.record.get('energy_residual')):.1e} of the largest energy of the run ({worst.link})."
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


# -- a case ----------------------------------------------------------------------------------------------------------


def _case(entry: _Entry) -> list[str]:
    record = entry.record
    mode = "--full" if record.get("full") else "--quick"
    lines = [f'<a id="{_anchor(entry.identifier)}"></a>', "", f"### {entry.identifier}: {record['title']}", ""]
    if entry.error:
        lines += [f"**The case could not be computed:** {_cell(entry.error)}", ""]
    tables = 0
    for item in record["items"]:
        if item["kind"] == "text":
            lines += [re.sub(r"^#{1,3} ", "#### ", item["text"], flags=re.M), ""]
        elif item["kind"] == "figure":
            lines += [f"![{_alt(item['caption'])}](figures/{item['file']})", "", f"*{item['caption'].strip()}*", ""]
        elif item["kind"] == "table":
            tables += 1
            rest = len(item["rows"]) - MOST_ROWS
            more = f" The first {MOST_ROWS} of {len(item['rows'])} rows." if rest > 0 else ""
            lines += [f"*{item['caption'].strip()}{more} ([CSV](figures/{item['file']}))*", ""]
            lines += [*_table(item["columns"], item["rows"][:MOST_ROWS]), ""]
    if entry.comparisons:
        lines += [*_comparisons(entry.comparisons), ""]
    made = f"`rockdda-post validate {mode} --case {entry.identifier}`: {_count(record['runs'], 'run')}, "
    made += f"{_count(record['steps'], 'time step')}, {_duration(record.get('seconds', 0.0))}"
    if record["runs"]:
        left = _finite(record.get("energy_residual"))
        made += f"; the energy ledger leaves over at most {left:.1e} of the largest energy"
    return [*lines, made + ".", ""]


def _comparisons(comparisons: Sequence[Comparison]) -> list[str]:
    """All numbers of a case; columns that would be empty are left out."""
    head = ["quantity", "ours", "truth", "error", "promised", "published", "difference", "explanation"]
    rows = []
    for c in comparisons:
        truth = f"{_value(c.truth, c.unit)} ({c.truth_source})" if c.truth_source else _value(c.truth, c.unit)
        published = (
            {"upper": "≤ ", "lower": "≥ "}.get(c.bound, "")
            + _value(c.published, c.unit)
            + (f" ({c.published_source})" if c.published_source else "")
        )
        rows.append(
            [
                c.quantity,
                _ours(c),
                truth if c.truth is not None else "–",
                _error(c, c.error),
                _broken(c) + _allowed(c),
                published if c.published is not None else "–",
                _difference(c),
                c.explanation or "–",
            ]
        )
    kept = [k for k in range(len(head)) if k < 2 or any(row[k] != "–" for row in rows)]
    return _table([head[k] for k in kept], [[row[k] for k in kept] for row in rows])


# -- words and numbers -----------------------------------------------------------------------------------------------


def _sources(comparisons: Sequence[Comparison]) -> str:
    """Where the truths come from, in few words."""
    names = list(
        dict.fromkeys(c.truth_source for c in comparisons if c.truth_source and "energy" not in c.truth_source)
    )
    if not names:
        return "–"
    text = "; ".join(names)
    return text if len(text) <= MOST_WORDS else text[:MOST_WORDS].rsplit(" ", 1)[0].rstrip(",;") + " …"


def _near(comparisons: Sequence[Comparison]) -> str:
    """How many published values are met."""
    found = [c for c in comparisons if c.published_error is not None]
    near = sum(not _notable(c, c.published_error, c.published) for c in found)
    return f"{near} of {len(found)}" if found else "–"


def _largest(comparisons: Sequence[Comparison], name: str) -> Comparison | None:
    """The comparison with the largest error; relative errors go before absolute ones."""
    found = [c for c in comparisons if getattr(c, name) is not None]
    relative = [c for c in found if c.scale != 1]
    return max(relative or found, key=lambda c: abs(_finite(getattr(c, name))), default=None)


def _finite(error: float | None) -> float:
    return math.inf if error is None or math.isnan(error) else error


def _notable(c: Comparison, error: float | None, reference: float | None) -> bool:
    """Is a difference worth the first page? Absolute ones are when they are a large share of the reference."""
    if error is None:
        return False
    return abs(_finite(error)) > NOTABLE * (abs(reference or 0.0) if c.scale == 1 else 1.0)


def _unexplained(c: Comparison) -> bool:
    """Without words, or with words that only quote what was published."""
    return not c.explanation or c.explanation.startswith(("not explained", "published"))


def _broken(c: Comparison) -> str:
    return "**broken:** " if c.agrees is False else ""


def _ours(c: Comparison) -> str:
    """Our number, or what is told in its place."""
    return c.found if c.found and math.isnan(c.ours) else _value(c.ours, c.unit)


def _value(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    if math.isnan(value):
        return "no number"
    return _with_unit(f"{value:.5g}", unit)


def _error(c: Comparison, error: float | None) -> str:
    """A relative error in percent (the very small ones as powers of ten), an absolute one with its unit."""
    if error is None:
        return "–"
    if not math.isfinite(error):
        if not math.isnan(error):
            return "unbounded"
        return "–" if c.found else "no number"  # or its place in the table has the words
    if error == 0:
        return "0"
    if c.scale == 1:  # of shares in percent a difference has percentage points
        return _with_unit(f"{error:+.2g}", "points" if c.unit == "%" else c.unit)
    return _percent(error, "+")


def _told(c: Comparison, name: str) -> bool:
    """An absolute error against the truth (of which shares say nothing) that is as small as promised."""
    return name == "truth" and c.scale == 1 and c.agrees is True


def _difference(c: Comparison) -> str:
    """From the published value."""
    if c.bound and c.published_error == 0:
        return "within the bound"
    return _error(c, c.published_error)


def _allowed(c: Comparison) -> str:
    if c.allowed is None:
        return "–"
    return "≤ " + (
        _with_unit(f"{c.allowed:.2g}", "points" if c.unit == "%" else c.unit) if c.scale == 1 else _percent(c.allowed)
    )


def _percent(share: float, sign: str = "") -> str:
    if 0 < abs(share) < 1e-5:
        return f"{share:{sign}.1e}"
    if abs(share) >= 10:
        return _with_unit(f"{100 * share:{sign}.0f}", "%")
    return _with_unit(f"{100 * share:{sign}.3g}" if abs(share) >= 0.1 else f"{100 * share:{sign}.2g}", "%")


def _with_unit(number: str, unit: str) -> str:
    """Number and unit stay on one line."""
    return number + ("" if unit in ("", "°") else "\u00a0") + unit


def _count(number: int, name: str) -> str:
    return f"{number:,}".replace(",", "\u00a0") + f" {name}{'' if number == 1 else 's'}"


def _duration(seconds: float) -> str:
    if seconds < 10:
        return f"{seconds:.1f} s"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def _anchor(identifier: str) -> str:
    return "case-" + re.sub(r"[^a-z0-9]+", "-", identifier.lower()).strip("-")


def _cell(text: Any) -> str:
    """Words within a cell of a table."""
    return re.sub(r"[ \t\r\n]+", " ", str(text)).strip().replace("|", "\\|")


def _alt(caption: str) -> str:
    return re.sub(r"[\[\]*_`]", "", _cell(caption))


def _table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(_cell(cell) or " " for cell in line) + " |" for line in lines]


# -- the page --------------------------------------------------------------------------------------------------------

STYLE = """
:root { color: #1a1a1a; background: #fff; font: 15px/1.5 system-ui, "Segoe UI", Roboto, Helvetica, Arial, sans-serif; }
body { max-width: 66rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.9rem; margin: 0 0 .8rem; } h2 { font-size: 1.35rem; margin: 2.4rem 0 .6rem;
  border-bottom: 1px solid #c8ced4; padding-bottom: .2rem; } h3 { font-size: 1.08rem; margin: 2rem 0 .5rem; }
p, li { max-width: 52rem; } a { color: #0060a0; text-decoration: none; } a:hover { text-decoration: underline; }
code { font: .88em ui-monospace, Menlo, Consolas, monospace; background: #f2f4f6; padding: .05em .3em; }
pre { background: #f2f4f6; padding: .6rem .8rem; overflow-x: auto; } pre code { padding: 0; }
.wide { overflow-x: auto; margin: .6rem 0 1rem; }
table { border-collapse: collapse; font-size: .84rem; line-height: 1.35; font-variant-numeric: tabular-nums; }
th { text-align: left; border-bottom: 1.5px solid #444; padding: .25rem .7rem .25rem 0; vertical-align: bottom; }
td { border-bottom: 1px solid #e0e4e8; padding: .25rem .7rem .25rem 0; vertical-align: top; }
td:first-child { min-width: 11em; } td strong { color: #b03a00; } img { max-width: 100%; height: auto; display: block; }
@page { size: A4; margin: 16mm 14mm; }
@media print {
  :root { font-size: 10px; } body { max-width: none; margin: 0; padding: 0; } .wide { overflow: visible; }
  h2 { break-after: avoid; } h2.part { break-before: page; } h3, caption { break-after: avoid; }
  tr, img { break-inside: avoid; } img { max-width: 135mm; } a { color: inherit; }
}
"""


def _page(text: str) -> str:
    """The Markdown as a page that needs nothing but the figures beside it."""
    from markdown_it import MarkdownIt

    marked = re.sub(r'<a id="(case-[a-z0-9-]+)"></a>\n\n### ', "### \ue000\\1\ue001", text)
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(marked)
    body = re.sub("<h3>\ue000([^\ue001]*)\ue001", r'<h3 id="\1">', body)
    for title in PARTS.values():
        body = body.replace(f"<h2>{html.escape(title)}</h2>", f'<h2 class="part">{html.escape(title)}</h2>')
    body = body.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
    head = '<meta charset="utf-8">\n<meta name="viewport" content="width=device-width, initial-scale=1">\n'
    head += f"<title>Validation of RockDDA</title>\n<style>{STYLE}</style>"
    return f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n<body>\n{body}</body>\n</html>\n'
