# SPDX-License-Identifier: MIT
"""The page of a report: words, tables and pictures in one file."""

from __future__ import annotations

import base64
import hashlib
import html
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import plot
from ..certainty.half_step import compare_ends, run_half_step
from ..certainty.running import Answer, answers_beside
from ..critical import read_search
from ..errors import InputError
from ..results import Results
from ..text import PathLike, readable
from ..units import Units, description
from ..writing import complete_file, write_file
from . import facts, support
from .paper import needs_for_pdf, pdf_of

if TYPE_CHECKING:
    from ..certainty.half_step import HalfStep

Progress = Callable[[int, int], None]
MOST_STAGES = 6  # with a picture of their own
MOST_ROWS = 20  # of a table
SHEET_LINES = 45  # of an input text that is kept on one sheet
MOST_LINES = 400  # of an input text that is printed
FILL = "\0"  # a cell to be filled in by hand, on the screen or on paper


@dataclass(frozen=True)
class Cover:
    """What the engineer adds to what the program has; what is left out is a field to be filled in."""

    project: str = ""
    author: str = ""
    date: str = ""
    question: str = ""
    #: where values come from, by the name of a material or a row of the parameters: {"rock": "laboratory, report 12"}
    sources: Mapping[str, str] = field(default_factory=dict)


def report(
    results: Results, output: PathLike, *, units: str | Units | None = None, title: str | None = None,
    cover: Cover | None = None, check_step: bool = False, progress: Progress | None = None,
    beside: Results | None = None,
) -> Path:  # fmt: skip
    """Write a report of a run as one .html page, or as .pdf on A4; returns its path.

    In the order of an engineer: question, model, parameters with their sources, stages, result with its ±, checks, and
    as appendix the input with which the run can be repeated. `units` are those of the file, for the labels; `cover`
    has project, author, date, question and sources. A .pdf is laid out by WeasyPrint where it is installed, else by
    Chromium. With `check_step` the model runs again at half the time step, and the report states how far the ends
    differ; `beside` is such a run that is there. Without either it states that this was not checked. `progress` is
    called with the number of pictures done and their number. An existing file is replaced."""
    path = Path(output)
    if path.suffix.lower() not in (".html", ".pdf"):
        raise InputError(f"a report ends in .html or .pdf, not in {path.suffix or 'nothing'!r}", path)
    if not results.n_frames:
        raise InputError("there are no frames in it yet", results.path)
    if path.suffix.lower() == ".pdf":
        needs_for_pdf()
    if check_step and beside is not None:
        raise InputError(
            "the model is either run again at half the time step, or a run is given, not both", beside.path
        )
    half = run_half_step(results) if check_step else None
    if beside is not None:
        half = compare_ends(results, beside)
    title = title or results.title or results.name
    text = _page(results, Units.parse(units, results), title, cover or Cover(), half, progress)
    if path.suffix.lower() == ".pdf":
        with complete_file(path) as part:
            pdf_of(part, text=text)
    else:
        write_file(path, text)
    return path


def _page(
    results: Results, units: Units, title: str, cover: Cover, half: HalfStep | None, progress: Progress | None
) -> str:
    ended = "complete" if results.complete else f"ended early: {results.exit_reason}"
    program = f"RockDDA {results.program_version}"
    sub = f"Discontinuous deformation analysis with {program}, run of {_moment(results)}, {ended}"
    pictures = _pictures(results, units)
    drawn = {}
    for done, (name, (draw, caption)) in enumerate(pictures.items(), start=1):
        drawn[name] = _figure(draw(), caption)
        if progress is not None:
            progress(done, len(pictures))
    checked = facts.checks(results, half)
    parts = [
        f"<h1>{_text(title)}</h1>",
        f'<p class="sub">{_text(sub)}</p>',
        _cover_part(cover),
        _warning(results, checked),
        "<h2>Question</h2>",
        _lead(cover.question or facts.question(results)),
        _table(["", "at the end of the run"], facts.in_short(results, units), "facts"),
        drawn["end"],
        *_model_part(results, units, drawn),
        *_parameters_part(results, units, cover, drawn),
        *_stages_part(results, units, drawn),
        "<h2>Result</h2>",
        *_certainty_part(results),
        *_search_part(results, units, drawn),
        *_end_part(results, units, drawn),
        *_checks_part(checked, half, drawn),
        *_input_part(results),
    ]
    style = files("rockdda").joinpath("web", "report.css").read_text("utf-8")
    head = '<meta charset="utf-8">\n<meta name="viewport" content="width=device-width, initial-scale=1">\n'
    head += f"<title>{_text(title)}</title>\n<style>\n{style}</style>"
    body = "\n".join(part for part in parts if part)
    return f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n<body>\n{body}\n</body>\n</html>\n'


def _warning(results: Results, checked: list[tuple[str, str, str, str]]) -> str:
    """What a reader must learn before all else; '' where nothing."""
    words = []
    if not results.complete:
        reached = f"step {results.steps[-1]}, time {results.times[-1]:.4g}"
        words.append(
            f"The run did not come to its end ({results.exit_reason}). What follows is what it reached: {reached}."
        )
    broken = [row[0] for row in checked[1:] if row[3] == "not kept"]
    if broken:
        words.append(f"Checks that are not kept: {'; '.join(broken)}.")
    return f'<p class="warning">{_text(" ".join(words))}</p>' if words else ""


def _pictures(results: Results, units: Units) -> dict[str, tuple[Callable[[], Any], str]]:
    """What is drawn: functions that draw, and captions."""
    last = results.n_frames - 1

    def of(kind: str, frame: int = last, **options: Any) -> Callable[[], Any]:
        return lambda: plot.plot(results, kind=kind, frame=frame, units=units, **options)

    found = {
        "end": (of("blocks", field="displacement"), "Displacement at the end of the run; dashed: where blocks were."),
        "materials": (of("blocks", 0, field="material"), "The model at the start: block materials and supports."),
        "stress": (of("stress"), "Principal stresses at the end of the run."),
    }  # fmt: skip
    # nothing is to be seen where nothing has moved, as in ground under its stress
    stages = [
        stage for stage in results.stages if stage.frames and np.any(results.frames[stage.frames[-1]].displacement)
    ]
    if results.has_stages:
        stages = [stage for stage in stages if stage.frames[-1] != last]  # that is the first picture
        shown = stages if len(stages) <= MOST_STAGES else [*stages[: MOST_STAGES - 1], stages[-1]]
        for stage in shown:
            caption = f"Displacement at the end of stage '{stage.name}'."
            found[f"stage {stage.index}"] = (of("blocks", stage.frames[-1], field="displacement"), caption)
    if results.has_joints and len(results.frames[-1].contacts):
        found["joints"] = (of("joints", field="normal_stress"), "Normal stress along the joints, tension positive.")
        found["shear"] = (of("joints", field="shear_stress"), "Shear stress along the joints.")
        if results.has_strength:
            caption = "Share of the shear strength of the joints that acts."
            if "search/factor" in results and (search := read_search(results)).search == "strength":
                caption = f"{caption[:-1]} as given, which the trial divides by {search.high:.4g}."
            found["mobilised"] = (of("joints", field="mobilised"), caption)
    for i, (direction, motion) in enumerate(facts.motions(results)):
        caption = (
            f"Acceleration of the ground in {direction} as computed with; from it the other curves. Time from the "
        )
        caption += "begin of the motion."
        found[f"motion {i}"] = (partial(plot.record, motion, units=units), caption)
    if "model/water_edges" in results and len(results["model/water_edges"]):
        found["water"] = (of("water"), "Water tables, and the pressure on wetted edges.")
    if results.frames[-1].moved_pieces("bolt").n_rows:
        found["bolts"] = (
            of("bolts", window=support.window(results)),
            "Axial force along the bolts, per bolt, at the end of the run.",
        )
    if results.frames[-1].moved_pieces("liner").n_rows:
        caption = "N, M and Q along the linings at the end, drawn normal to them; M on the side on which it pulls."
        found["liner"] = (of("liner"), caption)
        caption = "N and M at all nodes at the end, and what the sections bear: sound, and cracked without tension."
        found["capacity"] = (of("capacity"), caption)
    if results["history/measured_displacement"].shape[1] and results.n_steps > 1:
        found["history"] = (of("history"), "Displacements of the measured points.")
    if "history/relaxation" in results and np.any(results["history/relaxation"]) and len(results.measured_points):
        found["reaction"] = (of("ground-reaction"), "Released share of the forces of the first excavation.")
    if "search/factor" in results:
        found["mechanism"] = (of("mechanism"), "How the model fails: the blocks that move, by their motion.")
        found["factor"] = (of("factor"), "Displacement in each trial over the value tried, and the bracket.")
    if results.n_steps > 1 and results.has_energies:
        found["energy"] = (of("energy"), "Energies; below, geometry and residual as shares of the largest one.")
    return found


def _cover_part(cover: Cover) -> str:
    """Project, author and date, and where the report is signed."""
    rows = [
        ("project", cover.project or FILL, "date", cover.date or FILL),
        ("author", cover.author or FILL, "signature", FILL),
        ("checked by", FILL, "signature", FILL),
    ]
    return _table(["", "", "", ""], rows, "cover")


def _model_part(results: Results, units: Units, drawn: dict[str, str]) -> list[str]:
    areas = results.block_area
    factor, unit = units.multiple("area", float(areas.max()))
    rows = [("areas of blocks", f"{factor * areas.min():.3g} to {factor * areas.max():.3g} {unit}")]
    parts = [
        "<h2>Model</h2>", _lead(facts.in_words(results, units)), drawn["materials"], _table(["", ""], rows, "facts"),
    ]  # fmt: skip
    if results.boundary_kinds:
        parts += [
            "<h3>Boundaries</h3>",
            _lead("Forces are those on the blocks at the end of the run."),
            _table(*facts.boundary_table(results, units)),
        ]
    return parts


def _parameters_part(results: Results, units: Units, cover: Cover, drawn: dict[str, str]) -> list[str]:
    """Values with the place where they come from, given or to be filled in."""
    rows: list[tuple[str, ...]] = []
    left = dict(cover.sources)
    groups = results.input_groups
    for name, words in (
        ("load", "loads"),
        ("in_situ", "stress in the ground"),
        ("water", "water"),
        ("quake", "motion of the ground"),
        ("line_load", "line load"),
        ("bolt", "bolts"),
        ("liner", "linings"),
        ("subdivide", "cells"),
        ("change", "change"),
        ("block_damping", "damping"),
        ("contact", "contacts"),
        ("time", "time steps"),
    ):
        for group in groups.get(name, []):
            values = (f"{key} {facts.option_text(name, key, value, units)}" for key, value in group.items())
            rows.append((words, "; ".join(values), cover.sources.get(words, FILL)))
            left.pop(words, None)
    blocks, joints = facts.material_tables(results, units)
    given = "Values as in the input; consistent units" + (
        f" of {units.length}, {units.time}, {units.force}" if units.length else ""
    )
    if units.multiples:
        system = description(results.units) if results.units != "none" else "m, s, N"
        given = f"The input is in {system}; values are shown in the units that stand by them"
    parts = ["<h2>Parameters</h2>", _lead(f"{given}.")]
    for columns, materials in (blocks, joints):
        sourced = []
        for row in materials:
            number, _, name = row[0].partition(" ")
            called = next((word for word in (row[0], name, number) if word in cover.sources), "")
            sourced.append([*row, cover.sources.get(called, FILL)])
            left.pop(called, None)
        parts.append(_table([*columns, "source"], sourced))
    if left:
        known = ", ".join([*(row[0] for _, table in (blocks, joints) for row in table), *(row[0] for row in rows)])
        raise InputError(f"a source is given for {next(iter(left))!r}; the parameters are: {known}")
    parts.append(_table(["", "", "source"], rows, "facts"))
    motion = [figure.replace("<figure>", '<figure class="tall">') for name, figure in drawn.items() if "motion" in name]
    if motion:
        parts += ["<h3>Motion of the ground</h3>", *motion]
    return parts


def _stages_part(results: Results, units: Units, drawn: dict[str, str]) -> list[str]:
    if not results.has_stages:
        return []
    parts = ["<h2>Stages</h2>", _table(*facts.stage_table(results, units))]
    if facts.stages_before(results):
        parts.append("<p>The trial begins where the stages before it have ended; the results hold its steps alone.</p>")
    parts += [figure for name, figure in drawn.items() if name.startswith("stage ")]
    return [*parts, drawn.get("reaction", "")]


def _end_part(results: Results, units: Units, drawn: dict[str, str]) -> list[str]:
    parts = ["<h3>State at the end</h3>", drawn.get("history", ""), drawn["stress"]]
    if "joints" in drawn:
        parts += ["<h3>Joints</h3>", drawn["joints"], drawn["shear"], drawn.get("mobilised", "")]
        columns, rows = facts.joint_table(results, units)
        if rows:
            words = (
                "The joints that use most of their strength as given (means over the length, largest opening and "
                f"largest use; joints with at least {100 * facts.LEAST_FORCE:g} % of the largest force):"
            )
            parts += [_lead(words), _table(columns, rows)]
    parts += [drawn.get("water", "")]
    now = results.frames[-1]
    if now.bolt_pieces.n_rows:
        lead, table = support.bolt_table(results, units)
        parts += ["<h3>Bolts</h3>", drawn.get("bolts", ""), _lead(lead) if lead else "", _table(*table)]
    if "liner" in drawn:
        words = (
            "Largest values of all frames, per metre of thickness: compression and tension apart, M and Q without "
            "regard to sign. The share is that of N and M together in what the section bears."
        )
        parts += ["<h3>Linings</h3>", _lead(words), _table(*support.liner_table(results, units)), drawn["liner"]]
        parts += [drawn["capacity"]]
    return parts


def _search_part(results: Results, units: Units, drawn: dict[str, str]) -> list[str]:
    """The search of a critical factor: how the model fails, and the trials."""
    if "mechanism" not in drawn:
        return []
    found = read_search(results)
    factor, unit = units.multiple("length", max((t.displacement for t in found.trials if t.stable), default=1.0))
    rows = [
        [facts.number(t.value), "stable" if t.stable else "fails", str(t.steps), facts.number(t.unbalanced),
         facts.number(factor * t.displacement)]
        for t in sorted(found.trials, key=lambda trial: trial.value)
    ]  # fmt: skip
    columns = ["value", "verdict", "steps", "unbalanced force", f"displacement [{unit}]"]
    return ["<h3>Critical factor</h3>", _lead(str(found)), drawn["mechanism"], drawn["factor"],
            _table(columns, rows)]  # fmt: skip


def _certainty_part(results: Results) -> list[str]:
    """Convergence and reliability of this model, where they are there."""
    parts = []
    answers = answers_beside(results)
    if not any(answer.kind == "convergence" for answer in answers):
        words = "The ± of the numbers was not computed; rockdda-post convergence does it, and is then shown here."
        parts.append(f"<p>{_text(words)}</p>")
    for answer in answers:
        parts.append(f"<h3>{'Numbers and their ±' if answer.kind == 'convergence' else 'Reliability'}</h3>")
        if not answer.found:
            words = f"The {answer.kind} in {answer.folder.name} is that of another version of the model: not shown."
            parts.append(f"<p>{_text(words)}</p>")
        elif answer.kind == "convergence":
            parts += _convergence(answer)
        else:
            parts += [f"<p>{_text(line)}</p>" for line in str(answer.found.get("verdict", "")).splitlines()]
            laws, shares = answer.found.get("inputs", {}), answer.found.get("sensitivity", {})
            point = answer.found.get("design_point", {})
            rows = [
                [name, str(law), f"{100 * shares[name]:.0f} %" if name in shares else "–",
                 facts.number(point[name]) if name in point else "–"]
                for name, law in laws.items()
            ]  # fmt: skip
            parts.append(_table(["input", "distribution", "share of the variance", "most likely failure"], rows))
            parts.append(_image(answer.picture, "Factors of the runs, what they depend on, and the surface."))
    return parts


def _convergence(answer: Answer) -> list[str]:
    """The verdicts on numbers, and their changes."""
    rows = []
    for one in answer.found.get("quantities", []):
        title = ", ".join(text for text in (str(one.get("name", "")), str(one.get("stage", ""))) if text)
        rows.append([title, str(one.get("verdict", "")).removeprefix(f"{title}: ")])
    caption = "Change of each number by other numbers of the method, and by joints twice and half as stiff."
    return [
        _lead(str(answer.found.get("summary", ""))),
        _table(["number", "how sure"], rows),
        _image(answer.picture, caption),
    ]


def _checks_part(rows: list[tuple[str, str, str, str]], half: HalfStep | None, drawn: dict[str, str]) -> list[str]:
    body = _table(["check", "found", "bound", ""], rows)
    body = body.replace("<td>not kept</td>", '<td class="bad">not kept</td>').replace(
        "<td>kept</td>", '<td class="good">kept</td>'
    )
    words = "" if half is None or half.displacement is None else f"<p>{_text(f'Half the time step: {half.words}.')}</p>"
    return ["<h2>Checks</h2>", body, words, drawn.get("energy", "")]


def _input_part(results: Results) -> list[str]:
    """What the run was made of, so that it can be repeated."""
    files = facts.files_of(results.input_groups)
    beside = f", and the files that they name ({', '.join(files)})" if files else ""
    what = "the search gives the same trials" if "search/factor" in results else "this version gives the same numbers"
    words = f"With these texts, which the results hold{beside}, {what}, bit for bit."
    parts = ["<h2>Appendix: input</h2>", _lead(words)]
    texts = {name: str(results[f"input/{name}"]) for name in ("config", "analysis", "geometry")}
    names = {"config": "options or labelled file", "analysis": "analysis file", "geometry": "geometry or block file"}
    rows = [
        ("program", f"RockDDA {results.program_version}"),
        ("results", results.path.name),
        ("run", _moment(results)),
    ]
    for name, text in texts.items():
        if text:
            digest = hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()
            rows.append((names[name], f"{len(text.splitlines())} lines, SHA-256 {digest}"))
    parts.append(_table(["", ""], rows, "facts"))
    code = f"rockdda.open({results.path.name!r})['input/geometry']"
    parts.append(f"<p>The geometry is not printed; <code>{_text(code)}</code> in Python gives it.</p>")
    for name in ("config", "analysis"):
        lines = texts[name].splitlines()
        if lines:
            more = [f"… {len(lines) - MOST_LINES} more lines"] if len(lines) > MOST_LINES else []
            kind = ' class="short"' if len(lines) <= SHEET_LINES else ""
            parts += [
                f"<h3>{names[name].capitalize()}</h3>",
                f"<pre{kind}>{_text(chr(10).join([*lines[:MOST_LINES], *more]))}</pre>",
            ]
    return parts


def _moment(results: Results) -> str:
    """When the run began, to the minute."""
    return f"{str(results.created)[:16].replace('T', ' ')} UTC"


def _text(text: str) -> str:
    return html.escape(readable(text))


def _lead(text: str) -> str:
    """Words that stand on the same sheet as what follows."""
    return f'<p class="lead">{_text(text)}</p>'


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table; without rows nothing. A long one continues on the next sheet, under its head."""
    rows = list(rows)
    if not rows:
        return ""
    body = "".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows)
    head = "".join(f"<th>{_text(name)}</th>" for name in columns) if any(columns) else ""
    head = f"<thead><tr>{head}</tr></thead>" if head else ""
    kinds = " ".join(name for name in (kind, "long" if len(rows) > MOST_ROWS else "") if name)
    return (
        f'<table class="{kinds}">{head}<tbody>{body}</tbody></table>'
        if kinds
        else (f"<table>{head}<tbody>{body}</tbody></table>")
    )


def _cell(value: Any) -> str:
    return '<td class="fill" contenteditable="true"></td>' if value == FILL else f"<td>{_text(str(value))}</td>"


def _figure(axes: Any, caption: str) -> str:
    """A picture within the page."""
    import matplotlib.pyplot as plt

    from ..plot.style import style

    figure = np.ravel(np.asarray(axes, dtype=object))[0].get_figure()
    data = io.BytesIO()
    with style():
        figure.savefig(data, format="png", dpi=170, bbox_inches="tight", pad_inches=0.03)
    plt.close(figure)
    return _image(data.getvalue(), caption)


def _image(data: bytes, caption: str) -> str:
    """A picture, as PNG, within the page; nothing where there is none."""
    if not data:
        return ""
    image = base64.b64encode(data).decode()
    words = _text(caption)
    return f'<figure><img alt="{words}" src="data:image/png;base64,{image}"><figcaption>{words}</figcaption></figure>'
