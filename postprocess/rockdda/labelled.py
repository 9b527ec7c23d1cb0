# SPDX-License-Identifier: MIT
"""Labelled files: the groups of a whole model as text, and its materials and tables from the groups; a model from its
files, which the compiled session has read."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import FloatArray
from .deck import BlockMaterial, JointMaterial, Place, time_table
from .errors import InputError
from .groups import as_list
from .namelist import entry_texts, last_value, parse_groups
from .native import CONFIG_FILE, CONFIG_TEXT, DIALECTS, LABELLED_TEXT, MODEL_FILE, Session
from .options import names_that_add_up, repeated_groups, replace_files

#: Groups in the order of the file: what there is, what acts, what happens; then those that are not named here, and
#: how it is computed.
FIRST = (
    "model", "block_material", "joint_material", "joint_law", "region", "subdivide", "load", "in_situ", "boundary",
    "water", "fixed_point", "loading_point", "line_load", "stage", "change",
)  # fmt: skip
LAST = ("material", "contact", "block_damping", "time", "solver", "run", "output")
WIDTH = 110  # letters of a line
#: Group and name of each option that is a field of `Model`, and the name of the field.
OPTION_FIELDS = (
    ("load", "gravity", "gravity"), ("run", "steps", "steps"), ("time", "k01", "k01"), ("time", "dt_max", "dt_max"),
    ("time", "displacement_ratio", "displacement_ratio"), ("contact", "stiffness", "stiffness"),
    ("solver", "omega", "sor_factor"),
)  # fmt: skip


def labelled_text(groups: Mapping[str, Any]) -> str:
    """The file of some groups, one after the other in the order that readers expect."""
    names = [name for name in FIRST if name in groups]
    names += sorted(name for name in groups if name not in (*FIRST, *LAST))
    names += [name for name in LAST if name in groups]
    filled = [(name, entries) for name in names for entries in as_list(groups[name]) if entries]
    indent = max((len(name) for name, _ in filled), default=0) + 2
    return "".join(_wrapped(f"&{name}".ljust(indent), entry_texts(entries), indent) for name, entries in filled)


def _wrapped(line: str, words: list[str], indent: int) -> str:
    """A group in as few lines as its words take."""
    lines = []
    for number, word in enumerate(words):
        if number and len(line) + 1 + len(word) > WIDTH:
            lines.append(line)
            line = " " * indent + word
        else:
            line = f"{line} {word}" if number else line + word
    return "\n".join([*lines, line]) + " /\n"


def merged_groups(groups: Mapping[str, Any], repeated: Container[str], adding: Container[str]) -> dict[str, Any]:
    """Groups with one dictionary for each that may not be repeated: the last value of a name counts, or, of the names
    in `adding`, all of them."""
    merged: dict[str, Any] = {}
    for name, given in groups.items():
        if name in repeated or not isinstance(given, list):
            merged[name] = given
            continue
        values: dict[str, Any] = {}
        for entries in given:
            more = {
                key: as_list(values[key]) + as_list(entries[key]) for key in entries if key in adding and key in values
            }
            values |= {**entries, **more}
        merged[name] = values
    return merged


def describes_itself(groups: Mapping[str, Any]) -> bool:
    """Are the materials 1, 2, … described by one group each, and no analysis file is named?"""
    if "analysis" in groups["model"]:
        return False
    numbers = [
        [group.get("number") for group in as_list(groups.get(f"{kind}_material", []))] for kind in ("block", "joint")
    ]
    return all(sorted(found, key=str) == sorted(range(1, len(found) + 1), key=str) for found in numbers)


def block_groups(materials: Sequence[BlockMaterial]) -> list[dict[str, Any]]:
    """The groups of block materials; what is the default is left out."""
    groups = []
    for i, m in enumerate(materials, start=1):
        entries = {"number": i, "name": m.name, "density": m.density, "young": m.youngs_modulus}
        entries |= {"poisson": m.poisson_ratio, "unit_weight": m.weight}
        entries |= {"stress": m.stress, "stress_gradient": m.stress_gradient, "velocity": m.velocity}
        groups.append({key: value for key, value in entries.items() if _is_told(value)})
    return groups


def joint_groups(materials: Sequence[JointMaterial]) -> list[dict[str, Any]]:
    """The groups of joint materials."""
    groups = []
    for i, m in enumerate(materials, start=1):
        strength = {"friction": m.friction_angle} | ({"cohesion": m.cohesion} if m.cohesion else {})
        strength |= {"tension": m.tension} if m.tension else {}
        groups.append({"number": i, **({"name": m.name} if m.name else {}), **strength, **m.values})
    return groups


def _is_told(value: Any) -> bool:
    """Does a value of a material say more than its default: an empty name, NaN, zeros of a triple?"""
    if isinstance(value, list | tuple):
        return any(value)
    return value != "" and not (isinstance(value, float) and math.isnan(value))


def block_materials(groups: Any) -> list[BlockMaterial]:
    """Block materials of their groups, by number."""
    materials = []
    for group in sorted(as_list(groups), key=lambda group: int(group["number"])):
        names = ("density", "unit_weight", "young", "poisson")
        density, weight, young, poisson = (float(group.get(name, math.nan)) for name in names)
        parts = ("stress", "stress_gradient", "velocity")
        stress, gradient, velocity = (_triple(group.get(name, (0.0, 0.0, 0.0))) for name in parts)
        name = str(group.get("name", ""))
        materials.append(BlockMaterial(density, weight, young, poisson, stress, gradient, velocity, name))
    return materials


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    first, second, third = map(float, values)
    return first, second, third


def joint_materials(groups: Any) -> list[JointMaterial]:
    """Joint materials of their groups, by number."""
    materials = []
    known = ("number", "name", "friction", "cohesion", "tension")
    for group in sorted(as_list(groups), key=lambda group: int(group["number"])):
        values = {name: value for name, value in group.items() if name not in known}
        friction, cohesion, tension = (float(group.get(name, 0.0)) for name in known[2:])
        materials.append(JointMaterial(friction, cohesion, tension, str(group.get("name", "")), values))
    return materials


def point_groups(name: str, tables: Sequence[FloatArray]) -> list[dict[str, Any]]:
    """Groups with the tables of points, of those that have rows."""
    return [{"points": i, name: table.ravel()} for i, table in enumerate(tables, start=1) if len(table)]


def take_point_tables(options: dict[str, Any], group: str, name: str, count: int) -> list[FloatArray]:
    """Tables of `count` points, from groups that are then taken out of the options; none where a point has
    several, or a group has a name or points of its own."""
    tables: list[FloatArray] = [np.zeros((0, 3)) for _ in range(count)]
    entries = as_list(options.get(group, []))
    if any("at" in entry or "name" in entry for entry in entries):
        return tables
    named = [int(i) for entry in entries for i in as_list(entry.get("points", list(range(1, count + 1))))]
    if len(set(named)) < len(named) or not all(1 <= i <= count for i in named):
        return tables
    options.pop(group, None)
    for entry in entries:
        for i in as_list(entry.get("points", list(range(1, count + 1)))):
            rows = np.ravel(np.asarray(entry[name], dtype=float))
            tables[int(i) - 1] = np.reshape([0.0, *rows] if len(rows) == 2 else rows, (-1, 3))
    return tables


# -- a model from its files ------------------------------------------------------------------------------------------

Model = Any  # rockdda.model.Model: that module imports this one


def is_labelled(session: Session) -> bool:
    """Are the files a labelled model?"""
    if session.sizes("geometry_sizes")["lines"] == 0:
        raise InputError("is a block file; a model is made of lines", session.text(MODEL_FILE))
    return "model" in parse_groups(session.text(CONFIG_TEXT))


def take_legacy(model: Model, session: Session) -> None:
    """Take a model of a geometry file and an analysis file, with its options."""
    _take_geometry(model, session)
    _take_analysis(model, session)
    model.options = parse_groups(session.text(CONFIG_TEXT), names_that_add_up())
    replace_files(model.options, Path(session.text(CONFIG_FILE)).parent)
    if session.sizes("analysis_sizes")["dialect"] == DIALECTS["dda_windows"]:
        # defaults of this dialect
        time = model.options.setdefault("time", {})
        for group in [time] if isinstance(time, dict) else time[:1]:
            given = {name for some in ([time] if isinstance(time, dict) else time) for name in some}
            if "length_scale" not in given:
                group["length_scale"] = "largest"
            if "dt_min" not in given:
                group["dt_min"] = 0.01 * float(last_value(time, "dt_max", model.dt_max))


def take_labelled(model: Model, session: Session) -> None:
    """Take a labelled model."""
    options = _groups_of(session.text(CONFIG_TEXT))
    folder = Path(session.text(CONFIG_FILE)).parent
    if not describes_itself(options):  # values of an analysis file, or of several groups of one material
        options, folder = _groups_of(session.text(LABELLED_TEXT)), Path.cwd()
    replace_files(options, folder)
    group = options.pop("model")
    title, model.units = group.get("title", ""), group.get("units")
    if title and title != model.name and "title" not in options.get("run", {}):
        options.setdefault("run", {})["title"] = title
    for group, option, name in OPTION_FIELDS:
        if option in options.get(group, {}):
            setattr(model, name, options[group].pop(option))
    _take_geometry(model, session)
    model.block_materials = block_materials(options.pop("block_material", []))
    model.joint_materials = joint_materials(options.pop("joint_material", []))
    sizes = session.sizes()
    fixed = take_point_tables(options, "fixed_point", "displacement", sizes["fixed"])
    # points that a group adds are not of the geometry
    loading = take_point_tables(options, "loading_point", "force", len(model._loading))
    _take_tables(model, session, fixed, loading)
    motion = options.get("load", {}).get("base_acceleration", "")
    if motion and Path(motion) == (folder / f"{model.name}.csv").absolute():
        model.base_acceleration = _motion_of(Path(motion))
        if model.base_acceleration is not None:
            del options["load"]["base_acceleration"]
    model.options = {group: entries for group, entries in options.items() if entries}


def _take_geometry(model: Model, session: Session) -> None:
    """Take lines and points from the compiled session."""
    sizes, found = session.geometry()
    arrays = [array.tolist() for array in found]
    e0, lines, joints, material_lines, materials, bolts, values, fixed, loading, measured, holes = arrays
    model.e0 = e0
    for i, (line, joint) in enumerate(zip(lines, joints, strict=True)):
        model.add_line(line[:2], line[2:], joint=joint, boundary=i < sizes["boundary"])
    for line, material in zip(material_lines, materials, strict=True):
        model.add_material_line(line[:2], line[2:], material=material)
    for bolt, (stiffness, pretension, strength) in zip(bolts, values, strict=True):
        model.add_bolt(bolt[:2], bolt[2:], stiffness=stiffness, pretension=pretension, strength=strength)
    for line in fixed:
        model.add_fixed(line[:2], line[2:])
    for point in loading:
        model.add_loading(point, table=())
    for point in measured:
        model.add_measured(point)
    for point in holes:
        model.add_hole(point)


def _take_analysis(model: Model, session: Session) -> None:
    """Take materials, run control and tables from the compiled session."""
    sizes = session.sizes("analysis_sizes")
    model.steps = sizes["steps"]
    names = "blocks joints tables rows"
    arrays = session.array("analysis", *(sizes[name] for name in names.split()))
    numbers, block_materials, joint_materials, table_sizes, rows = arrays
    model.k01, model.displacement_ratio, model.dt_max, model.stiffness, model.sor_factor = numbers.tolist()
    for m in block_materials.tolist():
        density, weight, youngs_modulus, poisson_ratio = m[:4]
        model.block_materials.append(
            BlockMaterial(density, weight, youngs_modulus, poisson_ratio, (*m[4:7],), (*m[7:10],), (*m[10:13],))
        )
    for m in joint_materials.tolist():
        model.joint_materials.append(JointMaterial(*m))
    tables = np.split(np.array(rows), np.cumsum(table_sizes)[:-1]) if sizes["tables"] else []
    if tables:
        fixed = session.sizes()["fixed"]
        _take_tables(model, session, tables[:fixed], tables[fixed:])


def _take_tables(model: Model, session: Session, tables: list[FloatArray], loading: list[FloatArray]) -> None:
    """Take the tables of all fixed points and all loading points of the cut model."""
    position, _, line, _ = session.array("points", 1, session.sizes()["fixed"])
    for place, table in zip(model._loading, loading, strict=True):
        place.table = table
    if all(place.ends[:2] == place.ends[2:] for place in model._fixed):
        for place, table in zip(model._fixed, tables, strict=False):
            place.table = table
        return
    # points of one fixed line that move differently become fixed points of their own, and so do all points when
    # the lines of the file do not identify their fixed lines
    owners = np.unique(line)
    places: list[Place] = []
    for i, owner in enumerate(owners):
        points = np.flatnonzero(line == owner)
        alike = all(np.array_equal(tables[k], tables[points[0]]) for k in points)
        if alike and len(owners) == len(model._fixed):
            places.append(Place(model._fixed[i].ends, tables[points[0]]))
        else:
            places += [Place((*position[k], *position[k]), tables[k]) for k in points]
    model._fixed = places


def _groups_of(text: str) -> dict[str, Any]:
    """The groups of a labelled file, each that may not be repeated as one."""
    return merged_groups(parse_groups(text, names_that_add_up()), repeated_groups(), names_that_add_up())


def _motion_of(path: Path) -> FloatArray | None:
    """The base motion in a file that a model has written; None for a file of another form."""
    head, *rows = path.read_text(encoding="utf-8").split()
    try:
        return time_table([[float(x) for x in row.split(",")] for row in rows]) if head == "t,ax,ay" else None
    except ValueError:
        return None
