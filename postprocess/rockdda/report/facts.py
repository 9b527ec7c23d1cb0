# SPDX-License-Identifier: MIT
"""The numbers of a report: what the model is made of, what happened in its stages, and whether it can be trusted."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import records
from ..certainty.half_step import FILES, HalfStep, path_of
from ..certainty.variants import chosen
from ..critical import search_title
from ..errors import InputError
from ..joints import joint_points, summary_columns
from ..materials import material_rows
from ..options import option_rows
from ..records import Record
from ..results import Results, Stage
from ..rings import after_on_block
from ..text import number
from ..units import Units
from .support import liner_forces

Table = tuple[list[str], list[list[str]]]  # names of the columns, rows
BLOCK_COLUMNS = {"density": "density", "unit_weight": "unit weight", "young": "E", "poisson": "ν"}
JOINT_COLUMNS = {
    "friction": "friction [°]", "cohesion": "cohesion", "tension": "tensile strength",
    "normal_stiffness": "normal stiffness", "shear_stiffness": "shear stiffness",
}  # fmt: skip
MATERIAL_DIMENSIONS = {
    "density": "density", "unit_weight": "weight", "young": "stress", "cohesion": "stress", "tension": "stress",
    "normal_stiffness": "stiffness", "shear_stiffness": "stiffness",
}  # fmt: skip
#: Quantities of the units in the table of options.
QUANTITIES = {
    "length": "length", "stress": "stress", "stress/length": "stiffness", "force/length^2": "weight", "time": "time",
    "force/length": "line_load", "s": "time", "length/time": "speed", "length/time^2": "acceleration",
    "mass/length^2": "density", "1/time": "frequency", "force": "force",
}  # fmt: skip
#: Bounds of the checks: shares of the largest energy, the mean edge, the mean force, the largest displacement.
ENERGY, GEOMETRY, OVERLAP, UNBALANCED, STEP = 1e-6, 1e-2, 1e-2, 1e-5, 5e-2
LEAST_FORCE = 0.01  #: of the largest force of a joint: joints with less are not ranked
RANKED = 10  # joints


def option_text(group: str, name: str, value: Any, units: Units) -> str:
    """The value of an option with its unit, where the units are known: '2.21 MPa'."""
    try:
        stated = str(option_rows(group).get(name, {}).get("x-unit", "")).split(", ")
    except (InputError, ImportError):  # an unknown group, or no extension
        stated = [""]
    if not units.length or isinstance(value, str | bool):
        return number(value)
    if stated == ["deg"]:
        return f"{number(value)}°"
    kinds = ["weight" if name == "unit_weight" else QUANTITIES.get(unit, "") for unit in stated]
    if len(kinds) > 1:
        return f"{number(value)} [{', '.join(map(units.of, kinds))}]"
    values = np.atleast_1d(np.asarray(value, dtype=float))
    factor, unit = units.multiple(kinds[0], float(np.abs(values).max(initial=0.0)))
    return f"{number((factor * values).tolist() if np.ndim(value) else factor * float(values[0]))} {unit}".rstrip()


def place_text(points: Any, units: Units) -> str:
    """Places and their unit: '(-15, -15) → (15, -15) m'; first and last of many."""
    places = np.asarray(points, dtype=float).reshape(-1, 2)
    factor, unit = units.multiple("length", float(np.abs(places).max(initial=0.0)))
    few = places if len(places) <= 3 else places[[0, -1]]
    text = " → ".join(f"({factor * x:.4g}, {factor * y:.4g})" for x, y in few)
    return text + (" …" if len(places) > 3 else "") + (f" {unit}" if units.length and text else "")


def files_of(groups: Mapping[str, list[dict[str, Any]]]) -> list[str]:
    """Files that the options name beside the geometry: records, pressures."""
    found = [group[name] for entries in groups.values() for group in entries for name in FILES if name in group]
    return [str(name) for name in found]


def motions(results: Results) -> list[tuple[str, Record]]:
    """Records of &quake as their files are now, with their directions; without those that cannot be read."""
    found = []
    for group in results.input_groups.get("quake", []):
        path = path_of(str(group.get("record", "")), results.path.parent)
        if path is None:
            continue
        options = {name: group[name] for name in ("format", "column", "scale") if name in group}
        with contextlib.suppress(InputError, ImportError):  # without the extension
            found.append((str(group.get("direction", "x")), records.read(path, **options)))
    return found


def in_words(results: Results, units: Units) -> str:
    """The model in a few sentences."""
    groups = results.input_groups
    (_, blocks), (_, joints) = material_tables(results)
    low, high = results.vertices.min(axis=0), results.vertices.max(axis=0)
    of, by = (_names([row[0] for row in rows]) for rows in (blocks, joints))
    factor, unit = units.multiple("length", float((high - low).max()))
    size = f"{factor * (high[0] - low[0]):.4g} × {factor * (high[1] - low[1]):.4g} {unit}"
    plane = chosen(groups, "material", "plane") or ("strain" if "model" in groups else "stress")
    vertex = chosen(groups, "contact", "formulation") == "vertex" or (
        chosen(groups, "contact", "preset") and not chosen(groups, "contact", "formulation")
    )
    held = [f"{len(results.fixed_points)} fixed points"] if len(results.fixed_points) else []
    kinds = results.boundary_kinds
    held += [f"{kinds.count(kind)} × {kind}" for kind in dict.fromkeys(kinds)]
    words = [
        f"The model, {size} in plane {plane}, has {results.n_blocks} blocks of {of}, with joints of {by}.",
        f"Contacts are {'at vertices' if vertex else 'by length of the joints'}.",
        f"Supports and boundaries: {', '.join(held) or 'none'}.",
    ]
    acting = [
        f"{len(groups[name])} × {what}" if len(groups[name]) > 1 else what
        for name, what in (("in_situ", "stress in the ground"), ("water", "water"), ("quake", "a record of motion"),
                           ("line_load", "line loads"))
        if name in groups
    ]  # fmt: skip
    n_bolts = len(results.bolt_names) or len(results.bolt_ends)
    if n_bolts:
        acting.append(f"{n_bolts} bolt{'s' if n_bolts > 1 else ''}")
    n_liners = len(results.liner_names)
    if n_liners:
        acting.append(f"{n_liners} linings" if n_liners > 1 else f"the lining {results.liner_names[0]}")
    if acting:
        words.append(f"Besides the weight there act: {', '.join(acting)}.")
    if results.has_stages and len(results.stages) > 1:
        words.append(f"It is computed in {len(results.stages)} stages.")
    return " ".join(words)


def question(results: Results) -> str:
    """What the run answers, in general words."""
    if "search/factor" in results:
        return "Does the model stand, how far is it from failure, and how does it fail?"
    kinds = [group.get("until") == "equilibrium" for group in results.input_groups.get("stage", [])]
    if kinds and all(kinds):
        return (
            "Does the model come to rest in each stage, and which displacements, stresses and forces does it have then?"
        )
    return (
        "How do the blocks move in the time that was computed, and which stresses and forces do they have at its end?"
    )


def _names(names: list[str]) -> str:
    """Names or numbers of materials, not more than five."""
    found = [name.split(" ", 1)[-1] if " " in name else f"material {name}" for name in names]
    return ", ".join(found[:5]) + (f" and {len(found) - 5} more" if len(found) > 5 else "")


def material_tables(results: Results, units: Units | None = None) -> tuple[Table, Table]:
    """Block and joint materials with the values that the input gives them."""
    blocks, joints = material_rows(str(results["input/analysis"]))
    found: dict[str, dict[Any, dict[str, Any]]] = {
        "block_material": {i: dict(zip(BLOCK_COLUMNS, row, strict=False)) for i, row in enumerate(blocks, start=1)},
        "joint_material": {i: dict(zip(JOINT_COLUMNS, row, strict=False)) for i, row in enumerate(joints, start=1)},
    }
    groups = results.input_groups
    for kind, materials in found.items():
        for group in groups.get(kind, []):
            materials.setdefault(group.get("number"), {}).update(group)
    units = units or Units()
    unit: dict[str, str] = {}
    for materials in found.values() if units.length else ():
        unit |= _in_multiples(materials, units)
    if (units.length, units.time, units.force) != ("m", "s", "N") and not units.multiples:
        unit.pop("density", None)
    return _table(found["block_material"], BLOCK_COLUMNS, unit), _table(found["joint_material"], JOINT_COLUMNS, unit)


def _in_multiples(materials: Mapping[Any, dict[str, Any]], units: Units) -> dict[str, str]:
    """Replace the values of materials by those that are shown; the unit of each column."""
    found = {}
    for name, dimension in MATERIAL_DIMENSIONS.items():
        values = [row[name] for row in materials.values() if isinstance(row.get(name), int | float)]
        if not values:
            continue
        factor, found[name] = units.multiple(dimension, max(map(abs, values)))
        for row in materials.values():
            if isinstance(row.get(name), int | float):
                row[name] = factor * row[name]
    return found


def _table(materials: Mapping[Any, Mapping[str, Any]], columns: Mapping[str, str], units: Mapping[str, str]) -> Table:
    used = [name for name in columns if any(name in values for values in materials.values())]
    rows = []
    for key, values in materials.items():
        others = {name: value for name, value in values.items() if name not in (*columns, "number", "name")}
        rest = ", ".join(f"{name} {number(value)}" for name, value in others.items())
        name = f"{key} {values.get('name', '')}".strip()
        rows.append([name, *(number(values.get(column, "–")) for column in used), rest])
    heads = [f"{columns[name]} [{units[name]}]" if name in units else columns[name] for name in used]
    if not any(row[-1] for row in rows):
        return ["material", *heads], [row[:-1] for row in rows]
    return ["material", *heads, "other"], rows


def boundary_table(results: Results, units: Units) -> Table:
    """Boundaries with their values, and the forces on the blocks at the end of the run."""
    groups, kinds, force = results.input_groups.get("boundary", []), results.boundary_kinds, results.boundary_force
    factor, unit = units.multiple("force", float(np.abs(force[-1]).max(initial=0.0)) if len(force) else 1.0)
    rows = []
    for i, kind in enumerate(kinds):
        group = groups[i] if len(groups) == len(kinds) else {}
        given = {name: value for name, value in group.items() if name not in ("along", "kind")}
        values = "; ".join(f"{name} {option_text('boundary', name, value, units)}" for name, value in given.items())
        where = place_text(group.get("along", []), units)
        last = [number(factor * component) for component in force[-1, i]] if len(force) else ["–", "–"]
        rows.append([str(i + 1), kind, where, values, *last])
    return ["", "kind", "along", "values", f"force x [{unit}]", f"force y [{unit}]"], rows


def stage_table(results: Results, units: Units) -> Table:
    """Stages: what they do, their steps, and the state at their ends."""
    groups = results.input_groups.get("stage", [])
    trial = bool(stages_before(results))
    rows: list[list[Any]] = []
    largest: list[float] = []
    for stage in results.stages:
        group = groups[stage.index] if stage.index < len(groups) else {}
        given = {name: value for name, value in group.items() if name != "name"}
        does = "; ".join(f"{name} {option_text('stage', name, value, units)}" for name, value in given.items())
        steps = str(stage.n_steps) if stage.n_steps or not trial else "before"
        row: list[str | float] = [str(stage.index + 1), stage.name, does, steps]
        if stage.frames:
            now = results.at_stage(stage.index)
            moved = np.hypot(*now.displacement[now.active].T)
            largest.append(float(moved.max(initial=0.0)))
            row += [str(int(now.active.sum())), float(moved.max()) if len(moved) else "–"]
        else:
            row += ["–", "–"]
        rows.append([*row, "–" if np.isnan(stage.unbalanced) else f"{stage.unbalanced:.1e}"])
    factor, unit = units.multiple("length", max(largest, default=0.0))
    for row in rows:
        row[5] = number(factor * row[5]) if isinstance(row[5], float) else row[5]
    moved_label = f"largest displacement [{unit}]"
    return ["", "stage", "what it does", "steps", "blocks there", moved_label, "unbalanced force"], rows


def stages_before(results: Results) -> list[Stage]:
    """Stages that a trial of a search follows, and whose steps are not in its results."""
    return [stage for stage in results.stages if not stage.n_steps] if "search/factor" in results else []


def joint_table(results: Results, units: Units) -> Table:
    """The joints that use most of their strength at the end of the run, of those that carry more than next to nothing:
    a corner that touches may use all of it."""
    table = summary_columns(joint_points(results.frames[-1]))
    force = np.hypot(table["force_x"], table["force_y"])
    use = np.where(force >= LEAST_FORCE * force.max(initial=0.0), table["largest_mobilised"], np.nan)
    order = np.argsort(-use, kind="stable")  # without use last
    ranked = table.rows(order[: min(RANKED, int(np.isfinite(use).sum()))])
    shown = {
        name: units.multiple(dimension, float(np.abs(ranked.stack(*columns)).max(initial=0.0)))
        for name, dimension, columns in (
            ("length", "length", ("length",)), ("stress", "stress", ("normal_stress", "shear_stress")),
            ("slip", "length", ("slip",)), ("opening", "length", ("largest_opening",)),
        )
    }  # fmt: skip
    stress = shown["stress"][1]
    columns = [
        "blocks", f"length [{shown['length'][1]}]", f"normal stress [{stress}]", f"shear stress [{stress}]",
        f"slip [{shown['slip'][1]}]", f"opening [{shown['opening'][1]}]", "mobilised",
    ]  # fmt: skip
    rows = []
    for found in zip(*ranked.values(), strict=True):
        row = dict(zip(ranked, found, strict=True))
        values = [
            number(shown[kind][0] * row[name])
            for name, kind in (("length", "length"), ("normal_stress", "stress"), ("shear_stress", "stress"),
                               ("slip", "slip"))
        ]  # fmt: skip
        opening = number(shown["opening"][0] * row["largest_opening"]) if row["largest_opening"] > 0 else "closed"
        blocks = f"{row['first'] + 1}, {row['second'] + 1}"
        rows.append([blocks, *values, opening, f"{row['largest_mobilised']:.3f}"])
    return columns, rows


def in_short(results: Results, units: Units) -> list[tuple[str, str]]:
    """The findings of the first page, at the end of the run."""
    now = results.frames[-1]
    there = np.flatnonzero(now.active)
    moved = np.hypot(*now.displacement.T)
    facts = []
    if len(there):
        i = int(there[np.argmax(moved[there])])
        place = f"block {i + 1}, at the start at {place_text(results.block_centroid[i], units)}"
        facts.append(("largest displacement", f"{units.text(moved[i], 'length')} ({place})"))
        principal = now.principal_stress()[0][there]
        facts.append(("largest compression in a block", units.text(max(-principal[:, 1].min(), 0.0), "stress")))
        facts.append(("largest tension in a block", units.text(max(principal[:, 0].max(), 0.0), "stress")))
        most, when = _largest_of_frames(results)
        if most > 1.01 * moved[i]:
            words = f"{units.text(most, 'length')} (frame at time {f'{when:.4g} {units.time}'.rstrip()})"
            facts.insert(1, ("largest displacement of all frames", words))
        if speed := np.hypot(*now.velocity[there, :2].T).max():  # steps of statics begin at rest
            facts.append(("largest speed", units.text(speed, "speed")))
    gone = results.n_blocks - len(there)
    facts.append(("blocks", f"{len(there)} of {results.n_blocks} are there" if gone else f"{results.n_blocks}"))
    if results.has_joints:
        points = joint_points(results.frames[-1])
        length = points["length"].sum()
        if length > 0:
            names = ("open", "sliding", "locked or tied")
            shares = [points["length"][points["state"] == k].sum() / length for k in range(3)]
            facts.append(
                ("joints by length", ", ".join(f"{100 * s:.1f} % {n}" for s, n in zip(shares, names, strict=True)))
            )
    forces = now.bolt_pieces["force"]
    if len(forces):
        factor, unit = units.of_bolt(bool(results.bolt_names), float(forces.max()))
        facts.append(("largest force of a bolt", f"{factor * float(forces.max()):.4g} {unit}".rstrip()))
    if now.moved_pieces("liner").n_rows:
        facts.append(("largest forces in linings", liner_forces(now, units)))
    for name, value in search_table(results):
        facts.append((name, value))
    return facts


def _largest_of_frames(results: Results) -> tuple[float, float]:
    """The largest displacement of a block in the frames of the last stage, and the time of that frame."""
    frames = results.stages[-1].frames if results.has_stages else range(results.n_frames)
    found = (0.0, 0.0)
    for k in frames:
        now = results.frames[k]
        found = max(found, (float(np.hypot(*now.displacement[now.active].T).max(initial=0.0)), float(now.time)))
    return found


def search_table(results: Results) -> list[tuple[str, str]]:
    """The critical factor, where a search (`rockdda fos`) has left it in the results, and its mechanism."""
    if "search/factor" not in results:
        return []
    value, low, high = (float(np.ravel(results[f"search/{name}"])[0]) for name in ("factor", "low", "high"))
    name = search_title(str(results.attribute("search", "search")).strip())
    kind, n = str(results.attribute("search", "kind")).strip(), np.size(results["search/blocks"])
    trials = f"{np.size(results['search/value'])} trials"
    return [
        (name, f"{value:.4g} (between {low:.4g} and {high:.4g}, {trials})"),
        ("mechanism", f"{kind}, {n} blocks; this is the run of the failing trial"),
    ]


def checks(results: Results, half: HalfStep | None = None) -> list[tuple[str, str, str, str]]:
    """What was checked, the value found, the bound, and 'kept', 'not kept' or '–' where there is none.

    half: the run at half the time step, where there was one."""
    rows: list[tuple[str, str, str, str]] = []

    def add(what: str, value: float, bound: float, of: str) -> None:
        found = f"{value:.1e}" if np.isfinite(value) else "no number"
        rows.append((what, found, f"{bound:.0e} {of}", "kept" if value <= bound else "not kept"))

    complete = "complete" if results.complete else results.exit_reason
    rows.append(("the run came to its end", complete, "complete", "kept" if results.complete else "not kept"))
    if results.n_steps and results.has_energies:
        table = np.abs(np.asarray(results["history/energy"]))
        names = results.energy_names
        largest = float(table[:, [i for i, n in enumerate(names) if n not in ("residual", "geometry")]].max()) or 1.0
        add("energy balance: residual", float(table[:, names.index("residual")].max()) / largest, ENERGY,
            "of the largest energy")  # fmt: skip
        add("energy of finite rotation and strain", float(table[-1, names.index("geometry")]) / largest, GEOMETRY,
            "of the largest energy")  # fmt: skip
    contacts = results.frames[-1].contacts
    if contacts.opening is not None and len(contacts):
        offset = results.vertex_offset
        edges = np.linalg.norm(results.vertices - results.vertices[after_on_block(offset)], axis=1)
        add("deepest overlap of blocks at a joint", max(-float(contacts.opening.min()), 0.0) / float(edges.mean()),
            OVERLAP, "of the mean edge")  # fmt: skip
    groups = results.input_groups.get("stage", [])
    for stage in results.stages:
        group = groups[stage.index] if stage.index < len(groups) else {}
        if group.get("until") == "equilibrium" and stage.n_steps:
            add(f"equilibrium at the end of stage '{stage.name}'", stage.unbalanced,
                float(group.get("tolerance", UNBALANCED)), "of the mean force")  # fmt: skip
    repeated = int((np.asarray(results["history/attempts"]) > 1).sum())
    rows.append(("steps that had to be shortened", f"{repeated} of {results.n_steps}", "–", "–"))
    if half is None and "search/factor" in results:
        half = HalfStep("not checked: search again with half of dt_max, and compare the factors")
    rows += step_rows(half)
    return rows


def step_rows(half: HalfStep | None) -> list[tuple[str, str, str, str]]:
    """How far the ends of the runs at the step and at half the step differ."""
    what = "half the time step"
    if half is None:
        return [(what, "was not checked: the results may depend on the step", "–", "–")]
    if half.displacement is None:
        return [(what, half.words, "–", "not kept" if half.failed else "–")]
    kept = "kept" if half.displacement <= STEP else "not kept"
    bound = f"{STEP:.0e} of the largest displacement"
    rows = [(f"{what}: displacement at the end", f"{half.displacement:.1e}", bound, kept)]
    if half.stress is not None:
        rows.append((f"{what}: stress at the end", f"{half.stress:.1e}", "of the largest stress", "–"))
    return rows
