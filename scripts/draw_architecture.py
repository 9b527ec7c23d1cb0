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

from fortran_source import DerivedType, Procedure, Source

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path("docs/architecture.md")
FIGURE = Path("docs/images/one_step.svg")

# The folders in the order in which they may use each other, and what each of them holds.
FOLDERS = {
    "base": "kinds, errors, messages, texts, random numbers, threads, times",
    "geometry": "polygons, segments, grids",
    "linear/matrix": "the block matrix, its products and norms, what a solver is",
    "linear/direct": "factors: CHOLMOD, by blocks, dense",
    "linear/iterative": "PCG with its preconditioner, SOR",
    "linear": "the solvers by name; the automatic choice",
    "model/data": "blocks, materials, given options, the numbers of a run, the state of the blocks",
    "model/support": "where bolts and linings lie, and the columns of bolts",
    "model/automatic": "numbers that the program chooses: stiffness, time step",
    "model/option": "one row an option: name, meaning, unit, default, bounds",
    "model": "initial stress, water levels, names of blocks; the numbers of a run from options and files",
    "lines": "`rockdda lines` (Shi's DL): joints from the statistics of joint sets",
    "cutting": "`rockdda cut` (Shi's DC): blocks from lines",
    "contact/table": "rows of contacts, their intervals and corners, which block has which edge",
    "contact/find": "pairs that are close, then edges and corners that meet",
    "contact/transfer": "history of contacts from one step to the next",
    "contact": "the search of a step",
    "interaction/core": "what an interaction is; the equations, motions and arms that all share",
    "interaction/block": "inertia, elasticity, loads, held forces",
    "interaction/joint": "contacts: law of a joint, open-close states, friction, ties, dashpots",
    "interaction/bolt": "bolts: springs, bars with nodes, grout",
    "interaction/lining": "linings: segments, beams between them, ties to the rock",
    "interaction/boundary": "held edges, fixed points, tractions, quiet and free-field boundaries",
    "interaction/water": "pressures in joints and on edges",
    "interaction": "the families of interactions of a model",
    "check": "judgement of a model before a run",
    "stepping/control": "step length, stages, estimates of error; the constants of the method",
    "stepping/energy": "the energy balance",
    "stepping/step": "one attempt at a step: open-close rounds, line search, impacts, sleep",
    "stepping/stage": "excavation and placement, equilibrium at the end of a stage",
    "stepping": "a simulation: its start and its steps",
    "io/system": "files, locks, signals of the operating system",
    "io/text": "readers and writers of text files, with messages that name file, line and column",
    "io/options": "the options of a run and of joint statistics",
    "io/storage": "results and checkpoints (HDF5)",
    "io": "input files by kind: a model folder, what a file holds",
    "run": "from input files to a model; a run with its results and checkpoints",
    "run/search": "factors of safety and of loads: trials and their verdicts",
    "python": "the extension module of the Python package",
    "app": "the command line; the only folder that prints or stops",
}
# The modules through which a folder is entered; a folder that is not named here is open. What a folder keeps to itself
# can change without a look at the others.
FACES = {
    "linear/direct": "block_cholesky cholmod dense direct",
    "linear/iterative": "pcg sor",
    "linear": "factory",
    "lines": "generate joint_sets outlines report statistics statistics_options",
    "cutting": "assignment cell_lattice cut location subdivision",
    "cutting/cut": "line_report outlines",
    "cutting/subdivision": "cell_lines cell_merging",
    "contact/find": "broad_phase narrow_search",
    "contact/transfer": "inheritance merging",
    "contact": "search",
    "interaction/block": "elasticity held_forces inertia loads",
    "interaction/joint": "contact_stiffness contacts dashpots initial_traction intervals joint_response "
    "joint_strength joint_stress open_close ties trial_states",
    "interaction/joint/contacts": "contact_end contact_start friction_search striking_ends",
    "interaction/bolt": "bars bolts",
    "interaction/lining": "liner_places liner_placing liners",
    "interaction/lining/liners": "liner_friction liner_nodes liner_state",
    "interaction/boundary": "boundaries boundary_edges quiet_boundaries supports",
    "interaction/water": "water water_at_start",
    "interaction": "families",
    "check": "bolts boundaries linings material_names material_use options plausibility tables",
    "check/plausibility": "cell_joints unlikely",
    "stepping/control": "control method reach stage_watch trend",
    "stepping/control/estimates": "strikes time_error",
    "stepping/energy": "ledger",
    "stepping/step": "motion sleep step trial_step",
    "stepping/step/impact": "impulses",
    "stepping/step/newton": "arms line_search",
    "stepping/stage": "construction lodging stage_change stage_equilibrium stage_rest verdict",
    "stepping": "simulation",
    "io/options": "namelist_file option_documents statistics_file",
    "io/storage/file": "digest hdf5_adapter hdf5_driver",
    "io/storage/results": "results results_info results_tables",
    "io/storage/results/parts": "results_check results_model",
    "io/storage/checkpoint": "archive checkpoint checkpoint_model checkpoint_state",
    "io": "file_content recognise",
    "run": "checkpointing find_files hdf5_lock input labelled_text model_input model_run outcome output_choice parts "
    "read_files step_loop stop_request supports thread_choice",
    "run/search": "factor_search mechanism search_options search_results support_uses trial",
    "run/search/factor_search": "design_factors search_path settled_run",
    "app/command": "command_check command_cut command_fos command_help command_info command_lines command_new "
    "command_options command_run",
}
# The figure begins here and shows calls of procedures in these folders.
ROOT_CALL = ("simulation_type", "advance")
LANES = ("stepping", "contact", "interaction", "linear")
COLOURS = {
    "stepping": "#dce9f7",
    "contact": "#fde7c8",
    "interaction": "#dcefdc",
    "linear": "#ead9ee",
}
EXPANDED = {"stepping", "interaction"}  # calls made inside other folders are not drawn
DEPTH = 5
INTERACTION = "interaction_type"
LINKED = "linked_interaction_type"
NOT_DRAWN = {"resize", "exchange", "set_size", "make_room", "count_cut"}  # room for arrays, counters
NOT_DRAWN |= {"find_first_forces"}  # the search in an excavation before the first step, which is that of each step
NOT_DRAWN |= {"add_error"}  # the error of a step in time
NOT_DRAWN |= {"start_with_stress", "stress_contacts", "pressure_on_contacts"}  # the first step only
NOT_DRAWN |= {"bring_back"}  # the first step of a stage that places rock
NOT_DRAWN |= {"hold_contact_forces", "hold_bolt_forces"}  # the first step after an excavation
NOT_DRAWN |= {"find_acceleration", "become_quiet", "take_joints"}  # the first dynamic step
NOT_DRAWN |= {"add_impulses"}  # of contacts that close
NOT_DRAWN |= {"note_energies", "clear", "fill_record", "show_blocks", "forget", "renew_all"}  # bookkeeping
NOT_DRAWN |= {"take_forces", "take_attempt", "drop_attempts", "drop"}  # what attempts keep beside the state
NOT_DRAWN |= {"report_no_equilibrium", "report_failure"}  # messages
# within a bolt, a lining or an interval
NOT_DRAWN |= {"measure_between", "find_points", "copy_state", "dowel_response", "set_young", "share_slips", "respond"}

# Where a reader finds what is wanted most often: what, and places (procedure, part of the statement). The first place
# that the source has is taken.
LANDMARKS: list[tuple[str, list[tuple[str, str]]]] = [
    ("a sliding contact slides on, or else locks", [("map_joint", "else if (has_slid .and.")]),
    ("a locked contact begins to slide", [("map_joint", "else if (abs(trial) > limit")]),
    ("an interval that would slide back locks first", [("judge_interval", "new = contact_state%locked")]),
    ("a closed contact opens", [("stays_closed", "stays_closed = .not. gap > limit")]),
    ("an open contact closes", [("closes", "if (gap >= closing_gap(")]),
    ("an interval closed on a part, or open, opens or closes", [("judge_interval", "is_closed = interval%lowest <=")]),
    ("shear strength of a joint", [("shear_strength", "strength = friction")]),
    ("friction coefficient of a joint", [("friction_coefficient", "friction_coefficient = law%friction")]),
    (
        "a bolt that is a spring yields",
        [("bolt_response", "yields = abs(new_force) > strength")],
    ),
    ("steel of other bolts yields", [("measure_elements", "call law(stiffness(e), yield(e)")]),
    (
        "force of the normal spring: g0 times the overlap",
        [
            ("linearise_joint", "force(1) = -joint%k_n*(joint%gap"),
        ],
    ),
    (
        "g0 of each step, for contacts: `stiffness%given(1, :)`, k_s `(2, :)`, could depend on time after this",
        [("prepare", "call self%stiffness%renew(context%blocks, context%parameters, self%stiffness_is_new)")],
    ),
    (
        "stiffness of a contact from g0, or from its joint material",
        [("set_stiffness", "k_n = parameters%normal_stiffness")],
    ),
    ("g0 as the files have it, or 2 E", [("*", "parameters%normal_stiffness = automatic_over_e/springs*e_max")]),
    ("length of the next step", [("accepted", "self%dt = max(parameters%dt_min, wanted)")]),
    ("g2 cuts a step", [("*", "= cut_for_displacement(")]),
    ("k01 reduces the velocity", [("accept_step", "step%state%velocity = k01*step%state%velocity")]),
    ("the blocks move", [("accept_step", "call move()")]),
    ("results of a step are written", [("write_rows", "call self%results%append_history(self%sim%record)")]),
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


def lane(path: Path) -> str:
    """The column of the figure for a source file: the first of its folders."""
    return folder(path).split("/")[0]


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
        targets = [p for p in source.resolve(procedure, call) if lane(p.file) in LANES and p.name not in NOT_DRAWN]
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
        is_open = lane(target.file) in EXPANDED and bool(visible_calls(source, target))
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
    lanes = [name for name in LANES if any(lane(row.procedure.file) == name for row in rows)]
    height, indent, top, width, first = 21, 20, 46, 215, 300
    left = {name: 12 + (first + 14 + (i - 1) * (width + 14) if i else 0) for i, name in enumerate(lanes)}
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
    for name in lanes:
        lane_width = first if name == lanes[0] else width
        parts.append(
            f'<rect x="{left[name]}" y="8" width="{lane_width}" height="{bottom - 16}" fill="#f6f6f6"/>'
            f'<text x="{left[name] + lane_width / 2:g}" y="28" text-anchor="middle" font-weight="bold" '
            f'font-size="14">src/{name}</text>'
        )
    parents: list[tuple[float, float]] = []
    above: list[str] = []  # lanes of the callers of a row
    for i, row in enumerate(rows):
        column = lane(row.procedure.file)
        y = top + i * height
        is_first = column == lanes[0]
        del above[row.depth :]
        x = left[column] + 6 + indent * above.count(column)
        above.append(column)
        box = (first if is_first else width) - 12 - (x - left[column] - 6)
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
            f'<rect x="{x:g}" y="{y}" width="{box:g}" height="{height - 3}" rx="3" fill="{COLOURS[column]}" '
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


def faces(path: str) -> set[str] | None:
    """Files through which others enter a folder of src; none: all of them."""
    return set(FACES[path].split()) if path in FACES else None


def folder_table(source: Source) -> str:
    """What each folder holds, and by which of its modules it is entered."""
    used = {folder(module.file) for module in source.modules.values()}
    lines = ["| folder | holds | entered through |", "|---|---|---|"]
    for name, holds in FOLDERS.items():
        if name in used:
            lines.append(f"| `{name}` | {holds} | {', '.join(sorted(faces(name) or ['all']))} |")
    return "\n".join(lines)


def interaction_table(source: Source) -> str:
    """What an interaction offers, and which kinds of interaction do; nothing where the source has no such type."""
    if INTERACTION not in source.types:
        return ""
    lines = [
        "### Interactions",
        "",
        f"Everything that acts on blocks extends `{INTERACTION}`; what couples blocks by links extends",
        f"`{LINKED}`, which itself does. The step calls these procedures; each kind has those that it needs:",
    ]
    for type_name in (INTERACTION, LINKED):
        base = source.types.get(type_name, DerivedType(type_name, ""))
        kinds = [kind for kind in source.extensions(INTERACTION) if not kind.is_abstract]
        own = {
            name: ", ".join(kind.name.removesuffix("_type") for kind in kinds if name in kind.bindings) or "–"
            for name in base.bindings
        }
        all_alike = len(own) > 1 and len(set(own.values())) == 1
        if all_alike:
            lines += ["", f"| `{type_name}` | what it does (each of {next(iter(own.values()))}) |", "|---|---|"]
        else:
            lines += ["", f"| `{type_name}` | what it does | of |", "|---|---|---|"]
        for name in base.bindings:
            found = source.implementations(type_name, name)
            summary = shortened(found[0].summary, 160) if found else ""
            lines.append(f"| `{name}` | {summary} |" + ("" if all_alike else f" {own[name]} |"))
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
    """`use` statements against the order of the folders, or past the modules through which a folder is entered."""
    order = list(FOLDERS)
    wrong = []
    entered: dict[str, set[str]] = {}
    for module, used in source.uses():
        a, b = folder(module.file), folder(used.file)
        own, other = (item.file.parent.relative_to("src").as_posix() for item in (module, used))
        if own != other:
            entered.setdefault(other, set()).add(used.file.stem)
        if a not in order:
            wrong.append(f"{module.file}: folder {a} is not in FOLDERS of scripts/draw_architecture.py")
        elif b not in order:
            continue
        elif order.index(b) > order.index(a):
            wrong.append(f"{module.file} uses {used.name} of {b}, a folder after {a}")
        elif a == "app" and b == "python":
            wrong.append(f"{module.file} uses {used.name}: the program does not use the extension module")
        elif a == b and f"{own}/".startswith(f"{other}/"):
            continue  # a room uses what the rooms around it keep to themselves
        elif used.file.stem not in (faces(other) or {used.file.stem}):
            wrong.append(f"{module.file} uses {used.name}, which {other} keeps to itself (FACES)")
    for path, files in entered.items():
        wrong += [f"nobody enters {path} through {name} (FACES)" for name in sorted((faces(path) or files) - files)]
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
