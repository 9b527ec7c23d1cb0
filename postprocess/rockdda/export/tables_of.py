# SPDX-License-Identifier: MIT
"""Results for Python: a data set of xarray, tables of GeoPandas."""

from __future__ import annotations

import itertools
import re
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import AnyArray
from ..errors import InputError, InputWarning, need, stack_level
from ..frames import CONTACT_TABLES, FIELDS, JOINT_TABLES
from ..joints import joint_points, need_contacts
from ..results import Frame, Results
from ..stages import STAGE_TABLES
from ..storage.tables import TABLES, names_in
from ..units import description
from .tables import contact_rows, counted_from_1

if TYPE_CHECKING:
    import geopandas
    import xarray


def to_xarray(results: Results, contacts: bool = True) -> xarray.Dataset:
    """Frames, history and contacts as one labelled data set (needs the package xarray: `pip install xarray`).

    Dimensions: frame (with the coordinates time, frame_step and frame_stage: its name), block, vertex, step (with
    step_time), contact (with contact_frame and contact_time; without it where `contacts` is false), xy,
    stress_component, velocity_component, energy_column, contact_count, measured, fixed, boundary. `time`, `step_time`,
    `contact_frame` and `contact_time` are indices: `data.sel(time=0.5, method="nearest")`, `data.sel(contact_frame=3)`.
    """
    xarray = need("xarray", "xarray", "to_xarray")
    xy = ["x", "y"]
    frame, block = "frame", "block"
    data: dict[str, tuple[tuple[str, ...], Any]] = {
        "vertices": ((frame, "vertex", "xy"), results["frames/vertices"]),
        "centroid": ((frame, block, "xy"), results["frames/centroid"]),
        "rotation": ((frame, block), results["frames/rotation"]),
        "stress": ((frame, block, "stress_component"), results["frames/stress"]),
        "velocity": ((frame, block, "velocity_component"), results["frames/velocity"]),
        "block_area": ((block,), results.block_area),
    }
    names = names_in("history", "")
    if "history/unbalanced" in results:  # not in older files
        names += STAGE_TABLES
        data["active"] = ((frame, block), results.active)
    for name in names:
        if name not in ("step", "time"):
            data[name] = (("step", *TABLES[f"history/{name}"].row), results[f"history/{name}"])
    data["boundary_force"] = (("step", "boundary", "xy"), results.boundary_force)
    found = xarray.Dataset(
        data,
        coords={
            "time": (frame, results.times),
            "frame_step": (frame, results.steps),
            "frame_stage": (frame, np.array(results.stage_names)[results.frame_stages]),
            "step": results["history/step"],
            "step_time": ("step", results["history/time"]),
            "block_material": (block, results.block_material),
            "vertex_block": ("vertex", np.repeat(np.arange(results.n_blocks), np.diff(results.vertex_offset))),
            "measured": results.point_numbers("measured"),
            "boundary_kind": ("boundary", results.boundary_kinds),
            "xy": xy,
            "stress_component": ["x", "y", "xy"],
            "velocity_component": ["u", "v", "r", "ex", "ey", "gxy"],
            "energy_column": results.energy_names,
            "contact_count": ["open", "sliding", "locked"],
        },
        attrs={"title": results.title, "program_version": results.program_version, "exit_reason": results.exit_reason,
               "units": description(results.units)},
    )  # fmt: skip
    if contacts:
        found = found.assign(_contacts(results)).assign_coords(_contact_coordinates(results))
    if results.units != "none":
        for name, variable in found.variables.items():
            paths = [path for group in ("frames", "history", "model") if (path := f"{group}/{name}") in results]
            if paths and (unit := results.units_of(paths[0])):
                variable.attrs["units"] = unit
    for name in ("time", "step_time", *(("contact_frame", "contact_time") if contacts else ())):
        found = found.set_xindex(name)
    return found


def _contacts(results: Results) -> dict[str, tuple[tuple[str, ...], AnyArray]]:
    """The contacts of all frames, one frame after the other."""
    tables = CONTACT_TABLES + (JOINT_TABLES if results.has_joints else [])
    return {name: (("contact", *TABLES[f"frames/{name}"].row), results[f"frames/{name}"]) for name in tables}


def _contact_coordinates(results: Results) -> dict[str, tuple[str, AnyArray]]:
    frame = np.repeat(np.arange(results.n_frames), np.diff(results["frames/contact_offset"]))
    return {"contact_frame": ("contact", frame), "contact_time": ("contact", results.times[frame])}


def to_geopandas(
    results: Results, what: str = "blocks", frame: int = -1, crs: Any = None, origin: tuple[float, float] | None = None
) -> geopandas.GeoDataFrame:
    """Shapes and values of a frame as a table of GeoPandas (`pip install geopandas`), ready for a GeoPackage.

    what: 'blocks' (polygons, with holes, and all fields; blocks that are not there are left out), 'joints' (lines with
    the columns of `Results.joints`) or 'contacts' (points). Numbers of blocks count from 1, as in `rockdda-post
    export`; crs is the reference system of the coordinates, where they have one, and `origin` the place of 0, 0 in it,
    which is added to them. Without it, that is the place to which `rockdda-post convert` moved the origin, where the
    first line of the geometry says it. Lengths are not converted."""
    geopandas = need("geopandas", "gis", "to_geopandas")
    tables = {"blocks": _blocks, "joints": _joints, "contacts": _contact_points}
    if what not in tables:
        raise InputError(f"there is no table {what!r}; the tables are: {', '.join(tables)}")
    if what != "blocks":
        need_contacts(results)
    columns, shapes = tables[what](results.frames[frame])
    found = geopandas.GeoDataFrame(columns, geometry=shapes, crs=crs)
    if crs is not None:
        origin = origin or _moved_origin(results)
        if origin is None:
            _warn("crs without origin takes 0, 0 of the model as that of the reference system")
        unit = found.crs.axis_info[0] if found.crs.axis_info else None
        if unit is not None and unit.unit_conversion_factor != 1:
            _warn(f"the reference system counts in {unit.unit_name}: the lengths of the model are not converted")
    if origin is not None:
        found = found.set_geometry(found.translate(*origin))
    found.attrs["units"] = description(results.units)
    return found


def _moved_origin(results: Results) -> tuple[float, float] | None:
    """Where `rockdda-post convert` says that the origin was."""
    head = str(results["input/geometry"]).partition("\n")[0]
    place = re.match(r"#.*; the origin was at ([-+.\de]+), ([-+.\de]+)$", head.rstrip())
    return (float(place[1]), float(place[2])) if place else None


def _warn(message: str) -> None:
    warnings.warn(f"to_geopandas: {message}", InputWarning, stacklevel=stack_level())


def _blocks(frame: Frame) -> tuple[dict[str, Any], list[Any]]:
    from shapely import Polygon

    there = frame.active
    columns = {name: frame.field(name)[there] for name in FIELDS}
    shown = itertools.compress(frame.results.rings, there.tolist())
    corners = ([frame.vertices[ring] for ring in rings] for rings in shown)
    return columns, [Polygon(outer, holes) for outer, *holes in corners]


def _joints(frame: Frame) -> tuple[dict[str, Any], Any]:
    from shapely import linestrings

    table = joint_points(frame)
    ends = table.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    return counted_from_1(table.without("edge", "x1", "y1", "x2", "y2")), linestrings(ends)


def _contact_points(frame: Frame) -> tuple[dict[str, Any], Any]:
    from shapely import points

    columns = contact_rows(frame)
    return {name: values for name, values in columns.items() if name not in "xy"}, points(frame.contacts.point)
