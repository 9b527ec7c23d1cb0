# SPDX-License-Identifier: MIT
"""A model from its files, which the compiled session has read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .arrays import FloatArray
from .deck import BlockMaterial, JointMaterial, Place, time_table
from .errors import InputError
from .groups import as_list
from .labelled import (
    OPTION_FIELDS,
    block_materials,
    describes_itself,
    joint_materials,
    merged_groups,
    take_point_tables,
)
from .namelist import parse_groups
from .native import CONFIG_FILE, CONFIG_TEXT, DIALECTS, LABELLED_TEXT, MODEL_FILE, Session
from .options import names_that_add_up, repeated_groups, replace_files

Model = Any  # rockdda.model.Model: that module imports this one


def is_labelled(session: Session) -> bool:
    """Are the files a labelled model?"""
    if session.geometry_sizes()["lines"] == 0:
        raise InputError("is a block file; a model is made of lines", session.text(MODEL_FILE))
    return "model" in parse_groups(session.text(CONFIG_TEXT))


def take_legacy(model: Model, session: Session) -> None:
    """Take a model of a geometry file and an analysis file, with its options."""
    _take_geometry(model, session)
    _take_analysis(model, session)
    model.options = parse_groups(session.text(CONFIG_TEXT), names_that_add_up())
    replace_files(model.options, Path(session.text(CONFIG_FILE)).parent)
    if session.analysis_sizes()["dialect"] == DIALECTS["dda_windows"]:
        # defaults of this dialect
        time = model.options.setdefault("time", {})
        for group in [time] if isinstance(time, dict) else time[:1]:
            given = {name for some in ([time] if isinstance(time, dict) else time) for name in some}
            if "length_scale" not in given:
                group["length_scale"] = "largest"
            if "dt_min" not in given:
                group["dt_min"] = 0.01 * float(_last(time, "dt_max", model.dt_max))


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
    sizes = session.geometry_sizes()
    names = "lines materials bolts fixed loading measured holes"
    arrays = [array.tolist() for array in session.array("geometry", *(sizes[name] for name in names.split()))]
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
    sizes = session.analysis_sizes()
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


def _last(groups: Any, name: str, default: Any) -> Any:
    """The value of a name in one or several groups."""
    for group in as_list(groups):
        default = group.get(name, default)
    return default


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
