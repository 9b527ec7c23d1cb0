#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the calls of one step, and fills in the tables of docs/architecture.md, from the Fortran source.

    scripts/draw_architecture.py [--check]

Writes docs/images/one_step.svg and the parts of docs/architecture.md between the comments "generated: NAME" and "end".
--check writes nothing and fails when one of them is out of date. What is drawn is chosen by the constants below.
"""

import argparse
import html
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from fortran_source import Procedure, Source

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path("docs/architecture.md")
FIGURE = Path("docs/images/one_step.svg")

# The folders in the order in which they may use each other, and what each of them holds.
FOLDERS = {
    "base": "kinds, errors, messages, texts, random numbers, threads, times",
    "geometry": "polygons, segments, grids",
    "linear": "the block matrix and the solvers: direct (CHOLMOD, a factor by blocks), PCG, SOR, automatic",
    "model": "what a model is: blocks, materials, options, the numbers of a run, the state of the blocks",
    "lines": "`rockdda lines` (Shi's DL): joints from the statistics of joint sets",
    "cutting": "`rockdda cut` (Shi's DC): blocks from lines",
    "contact": "which contacts there are: search, identity from step to step",
    "assembly": "stiffness and load of each term, and their sum",
    "interaction": "what acts on blocks, one file for each kind: its law, its state, its energy",
    "stepping": "one step: open-close loop, step control, stages, energy balance",
    "io/system": "files, locks, signals of the operating system",
    "io/text": "readers and writers of text files, with messages that name file, line and column",
    "io/options": "the options of a run and of joint statistics",
    "io/storage": "results and checkpoints (HDF5)",
    "io": "input files by kind: a model folder, what a file holds",
    "run": "from input files to a model; a run with its results and checkpoints",
    "python": "the extension module of the Python package",
    "app": "the command line; the only folder that prints or stops",
}
# The figure begins here and shows calls of procedures in these folders.
ROOT_CALL = ("simulation_type", "advance")
LANES = ("stepping", "contact", "assembly", "interaction", "linear")
COLOURS = {
    "stepping": "#dce9f7",
    "contact": "#fde7c8",
    "assembly": "#dcefdc",
    "interaction": "#dcefdc",
    "linear": "#ead9ee",
}
EXPANDED = {"stepping", "interaction"}  # calls made inside other folders are not drawn
DEPTH = 5
INTERACTION = "interaction_type"
NOT_DRAWN = {"resize", "exchange", "set_size", "make_room", "count_cut"}  # room for arrays, counters
NOT_DRAWN |= {"find_first_forces"}  # the search in an excavation before the first step, which is that of each step
NOT_DRAWN |= {"add_error"}  # the error of a step in time
NOT_DRAWN |= {"start_with_stress", "stress_contacts", "pressure_on_contacts"}  # the first step only
NOT_DRAWN |= {"bring_back"}  # the first step of a stage that places rock
NOT_DRAWN |= {"hold_contact_forces", "hold_bolt_forces"}  # the first step after an excavation
NOT_DRAWN |= {"find_acceleration", "become_quiet", "take_joints"}  # the first dynamic step
NOT_DRAWN |= {"add_impulses"}  # of contacts that close
NOT_DRAWN |= {"note_energies", "clear", "fill_record", "show_blocks", "forget", "renew_all"}  # bookkeeping
NOT_DRAWN |= {"take_forces", "take_attempt", "drop_attempts"}  # what attempts keep beside the state
NOT_DRAWN |= {"report_no_equilibrium", "report_failure"}  # messages
NOT_DRAWN |= {"measure_between", "find_points", "copy_state", "dowel_response", "set_young"}  # within a bolt or lining

# Where a reader finds what is wanted most often: what, and places (procedure, part of the statement). The first place
# that the source has is taken.
LANDMARKS: list[tuple[str, list[tuple[str, str]]]] = [
    (
        "a sliding contact locks again",
        [("map_joint", "response%state = contact_state%locked")],
    ),
    (
        "a locked contact begins to slide",
        [("map_joint", "response%state = contact_state%sliding")],
    ),
    (
        "a closed contact opens",
        [("judge_contact", "new = contact_state%open")],
    ),
    (
        "an open contact closes",
        [("judge_contact", "new = response%state")],
    ),
    ("shear strength of a joint", [("shear_strength", "strength = friction")]),
    ("friction coefficient of a joint", [("friction_coefficient", "friction_coefficient = law%friction")]),
    (
        "a bolt yields",
        [("bolt_response", "yields = abs(new_force) > strength")],
    ),
    (
        "force of the normal spring: g0 times the overlap",
        [
            ("linearise_joint", "force(1) = -joint%k_n*(joint%gap"),
        ],
    ),
    (
        "g0 of each step, for contacts: to let it depend on time, scale `stiffness%given(1, :)` by a function of "
        "`context%state%time` after this line, with `keep_force` true where springs shall keep their force (k_s is "
        "`stiffness%given(2, :)`; fixed points and the search radius use the run's own number)",
        [("prepare", "call self%stiffness%renew(context%blocks, context%parameters, self%stiffness_is_new)")],
    ),
    ("stiffness of a contact from g0, or from its joint material", [("*", "k_n = parameters%normal_stiffness")]),
    ("g0 as the files have it, or 2 E", [("*", "parameters%normal_stiffness = automatic_over_e/springs*e_max")]),
    ("g2 cuts a step", [("*", "= cut_for_displacement(")]),
    ("k01 reduces the velocity", [("accept_step", "step%state%velocity = k01*step%state%velocity")]),
    ("the blocks move", [("accept_step", "call move(step")]),
]


class Row(NamedTuple):
    """A procedure in the figure, or a line that names what a procedure calls."""

    depth: int
    name: str
    procedure: Procedure
    kinds: int  # implementations of the same binding
    is_repeated: bool  # its own calls are drawn further up


def folder(path: Path) -> str:
    """The folder of FOLDERS that holds a source file, itself or in one of its own folders; else the path from src."""
    own = path.parent.relative_to("src")
    return next((name.as_posix() for name in (own, *own.parents) if name.as_posix() in FOLDERS), own.as_posix())


def visible_calls(
    source: Source, procedure: Procedure, callers: tuple[int, ...] = ()
) -> list[tuple[str, list[Procedure]]]:
    """The calls of a procedure that are drawn, each once: name and the procedures that it may reach.

    Left out: functions and procedures of the same file that call nothing drawn, except in the file of the step itself.
    """
    found: dict[int, tuple[str, list[Procedure]]] = {}
    callers = (*callers, id(procedure))
    root_file = source.implementations(*ROOT_CALL)[0].file
    for call in procedure.calls:
        targets = [p for p in source.resolve(procedure, call) if folder(p.file) in LANES and p.name not in NOT_DRAWN]
        if not targets or id(targets[0]) in found:
            continue
        target = targets[0]
        is_own = target.file == procedure.file != root_file
        if (target.is_function or is_own) and (id(target) in callers or not visible_calls(source, target, callers)):
            continue
        found[id(target)] = (call[-1], targets)
    return list(found.values())


def walk(source: Source, procedure: Procedure, depth: int, seen: set[int]) -> Iterator[Row]:
    """Rows of the calls that a procedure makes, in the order of the source."""
    for name, targets in visible_calls(source, procedure):
        target = targets[0]
        is_open = folder(target.file) in EXPANDED and bool(visible_calls(source, target))
        kinds = len(targets) - source.is_default(target)
        yield Row(depth, name, target, kinds, is_open and id(target) in seen)
        if is_open and depth < DEPTH and id(target) not in seen:
            seen.add(id(target))
            yield from walk(source, target, depth + 1, seen)


def step_rows(source: Source) -> list[Row]:
    """The call path of one step."""
    type_name, binding = ROOT_CALL
    roots = source.implementations(type_name, binding)
    if not roots:
        raise SystemExit(f"{ROOT_CALL}: no such binding in src; change ROOT_CALL of scripts/draw_architecture.py")
    return [Row(0, binding, roots[0], 1, False), *walk(source, roots[0], 1, {id(roots[0])})]


def draw(rows: list[Row]) -> str:
    """The figure: one row per call from top to bottom, one lane per folder, indented by depth in the first."""
    lanes = [lane for lane in LANES if any(folder(row.procedure.file) == lane for row in rows)]
    height, indent, top, width, first = 21, 20, 46, 215, 300
    left = {lane: 12 + (first + 14 + (i - 1) * (width + 14) if i else 0) for i, lane in enumerate(lanes)}
    total = left[lanes[-1]] + width + 12
    note_left = total
    total += 640
    bottom = top + height * len(rows) + 8
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{total}" height="{bottom}" viewBox="0 0 {total} {bottom}" '
        'font-family="Helvetica, Arial, sans-serif" font-size="12">',
        "<title>The calls of one step, from the source</title>",
        f'<rect width="{total}" height="{bottom}" fill="#ffffff"/>',
    ]
    for lane in lanes:
        lane_width = first if lane == lanes[0] else width
        parts.append(
            f'<rect x="{left[lane]}" y="8" width="{lane_width}" height="{bottom - 16}" fill="#f6f6f6"/>'
            f'<text x="{left[lane] + lane_width / 2:g}" y="28" text-anchor="middle" font-weight="bold" '
            f'font-size="14">src/{lane}</text>'
        )
    parents: list[tuple[float, float]] = []
    above: list[str] = []  # lanes of the callers of a row
    for i, row in enumerate(rows):
        lane = folder(row.procedure.file)
        y = top + i * height
        is_first = lane == lanes[0]
        del above[row.depth :]
        x = left[lane] + 6 + indent * above.count(lane)
        above.append(lane)
        box = (first if is_first else width) - 12 - (x - left[lane] - 6)
        middle = y + height / 2 - 1
        del parents[row.depth :]
        if parents:
            px, py = parents[-1]
            parts.append(f'<path d="M{px:g} {py:g} V{middle:g} H{x:g}" fill="none" stroke="#8a8a8a"/>')
        parents.append((x + 8, y + height - 3))
        label = row.name
        if row.kinds > 1:
            label += f" ×{row.kinds}"
        if row.is_repeated:
            label += " ↑"
        parts.append(
            f'<rect x="{x:g}" y="{y}" width="{box:g}" height="{height - 3}" rx="3" fill="{COLOURS[lane]}" '
            f'stroke="#555555"/><text x="{x + 6:g}" y="{y + 13}">{html.escape(label)}</text>'
        )
        note = shortened(row.procedure.summary, 100)
        parts.append(f'<text x="{note_left}" y="{y + 13}" fill="#333333">{html.escape(note)}</text>')
    parts.append("</svg>\n")
    return "\n".join(parts)


def shortened(text: str, length: int) -> str:
    """The first sentence, cut at a word where it is longer than that."""
    text = re.split(r"(?<=\w\w\w[.)])\s", text, maxsplit=1)[0].rstrip(".:;")
    return text if len(text) <= length else text[:length].rsplit(" ", 1)[0] + " …"


def folder_table(source: Source) -> str:
    """What each folder holds and uses."""
    uses: dict[str, set[str]] = {folder(module.file): set() for module in source.modules.values()}
    for module, other in source.uses():
        uses[folder(module.file)].add(folder(other.file))
    lines = ["| folder | holds | uses |", "|---|---|---|"]
    order = list(FOLDERS)
    for name, holds in FOLDERS.items():
        if name not in uses:
            continue
        used = sorted((u for u in uses[name] if u != name), key=order.index)
        lines.append(f"| `{name}` | {holds} | {', '.join(used) or '–'} |")
    return "\n".join(lines)


def interaction_table(source: Source) -> str:
    """What an interaction offers, and which kinds of interaction do; nothing where the source has no such type."""
    base = source.types.get(INTERACTION)
    if base is None:
        return ""
    kinds = source.extensions(INTERACTION)
    lines = [
        "### Interactions",
        "",
        f"Everything that acts on blocks extends `{INTERACTION}`. The step calls these procedures of all of",
        "them, in the order of the list; each kind has those that it needs:",
        "",
        "| procedure | what it does | of |",
        "|---|---|---|",
    ]
    for name in base.bindings:
        own = [kind.name.removesuffix("_type") for kind in kinds if name in kind.bindings]
        found = source.implementations(INTERACTION, name)
        summary = shortened(found[0].summary, 160) if found else ""
        lines.append(f"| `{name}` | {summary} | {', '.join(own) or '–'} |")
    return "\n".join([*lines, ""])


def landmark_table(source: Source) -> str:
    """Where to find what, each with its statement."""
    lines = ["| what | file, procedure | statement |", "|---|---|---|"]
    for what, places in LANDMARKS:
        found = next(filter(None, (source.find_statement(name, part) for name, part in places)), None)
        if not found:
            raise SystemExit(
                f"{what}: no statement like {places[0][1]}; change LANDMARKS of scripts/draw_architecture.py"
            )
        file, name, statement = found
        lines.append(f"| {what} | `{file}`, `{name}` | `{statement}` |")
    return "\n".join(lines)


def order_violations(source: Source) -> list[str]:
    """`use` statements against the order of the folders."""
    order = list(FOLDERS)
    wrong = []
    for module, used in source.uses():
        a, b = folder(module.file), folder(used.file)
        if a not in order:
            wrong.append(f"{module.file}: folder {a} is not in FOLDERS of scripts/draw_architecture.py")
        elif b not in order:
            continue
        elif order.index(b) > order.index(a):
            wrong.append(f"{module.file} uses {used.name} of {b}, a folder after {a}")
        elif a == "app" and b == "python":
            wrong.append(f"{module.file} uses {used.name}: the program does not use the extension module")
    return wrong


def generated(root: Path) -> dict[Path, str]:
    """Texts of the files that follow from the source."""
    source = Source(root / "src", root)
    tables = {
        "folders": folder_table(source),
        "places": landmark_table(source),
        "interactions": interaction_table(source),
    }
    text = (root / PAGE).read_text(encoding="utf-8")
    for name, table in tables.items():
        begin = f"<!-- generated: {name} -->\n"
        if text.count(begin) != 1:
            raise SystemExit(f"{PAGE}: no part 'generated: {name}'")
        before, _, after = text.partition(begin)
        text = before + begin + table + ("\n" if table else "") + "<!-- end -->" + after.partition("<!-- end -->")[2]
    return {PAGE: text, FIGURE: draw(step_rows(source))}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; fail when a file is out of date")
    arguments = parser.parse_args()
    status = 0
    for path, text in generated(ROOT).items():
        file = ROOT / path
        if file.exists() and file.read_text(encoding="utf-8") == text:
            continue
        if arguments.check:
            print(f"{path} is out of date: run scripts/draw_architecture.py", file=sys.stderr)
            status = 1
        else:
            file.write_text(text, encoding="utf-8")
            print(f"{path} written")
    return status


if __name__ == "__main__":
    sys.exit(main())
