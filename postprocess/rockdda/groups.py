# SPDX-License-Identifier: MIT
"""Groups of options by name: regions, cells, boundaries, stress in the ground, water, stages and their changes.

Each method adds a group of the options file (docs/file-formats.md has all names with units and defaults). Names of
materials and regions stand where the file has them; several are a list, or one text with commas between them. Values
are checked at once against the table of the compiled part, references to names when the model is written or run.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InputError
from .namelist import as_list, flat_values
from .options import group_row, name_arguments, option_rows, refuse_problems
from .text import PathLike

Names = str | Sequence[str]
References = int | str | Sequence[int | str]  # materials by number or name
Numbers = npt.ArrayLike  # rows as docs/file-formats.md has them, in any nesting


@name_arguments
class OptionGroups:
    """What a model has in groups of its options."""

    options: dict[str, Any]

    def add_group(self, group: str, **values: Any) -> None:
        """Add a group of options that may be repeated, or set values of one that may not.

        Values of None are left out. Raises InputError for unknown groups and names, with a suggestion, for values of
        another kind or out of bounds, and where a value that the group needs is missing."""
        rows = option_rows(group)
        given = {name: _checked_form(rows.get(name, {}), value) for name, value in values.items() if value is not None}
        present = as_list(self.options.get(group, []))
        repeated = bool(group_row(group).get("x-list"))
        missing: list[str] = []
        if repeated or not present:
            needed = group_row(group).get("required", [])
            missing = [f"{name!r} is missing: {_meaning(rows[name])}" for name in needed if name not in given]
        refuse_problems(f"&{group}", group, given, missing)
        if repeated:
            self.options[group] = [*present, given]
        else:
            self.options[group] = {name: value for entries in (*present, given) for name, value in entries.items()}

    def add_region(
        self, name: str, *, box: Numbers | None = None, circle: Numbers | None = None, polygon: Numbers | None = None,
        material: References | None = None, outline: Names | None = None, width: float | None = None,
    ) -> None:  # fmt: skip
        """Blocks with more than half of their area, at the start, in boxes (xmin ymin xmax ymax), circles (x y r), a
        polygon, or a ring of a width around the blocks of other regions (outline) [length], or that have these block
        materials. Regions of one name add up."""
        self.add_group("region", name=name, box=box, circle=circle, polygon=polygon, material=material, outline=outline,
                       width=width)  # fmt: skip

    def subdivide(
        self, region: Names | None = None, *, size: float, joint_material: int | str, kind: str | None = None
    ) -> None:
        """Cut the blocks of regions (all blocks by default) into cells of a size [length], 'rectangles' or 'triangles'.

        joint_material holds the cells together: tie=True of `add_joint_material` makes them one elastic body."""
        self.add_group("subdivide", region=region, size=size, kind=kind, joint_material=joint_material)

    def add_boundary(
        self, along: Numbers, kind: str, *, velocity: Numbers | None = None, stress: Numbers | None = None,
        traction: Numbers | None = None, pressure: float | None = None, table: Numbers | None = None, **values: Any,
    ) -> None:  # fmt: skip
        """Hold, move or load the outer edges along a polyline, rows x y [length].

        kind: 'fixed', 'roller', 'moving' (velocity vx vy [length/time]) or 'traction' (one of stress s11 s22 s12,
        traction tx ty, pressure, positive into the block [stress]). table: rows t factor. values: others of &boundary.
        """
        self.add_group("boundary", along=along, kind=kind, velocity=velocity, stress=stress, traction=traction,
                       pressure=pressure, table=table, **values)  # fmt: skip

    def add_in_situ(
        self, *, surface: float | None = None, profile: Numbers | None = None, k0: float | None = None,
        unit_weight: float | None = None, surcharge: float | None = None, stress: Numbers | None = None,
        gradient: Numbers | None = None, region: Names | None = None, **values: Any,
    ) -> None:  # fmt: skip
        """Stress in the ground at the start: under a level surface (y) or a profile, rows x y [length], with k0; or
        stress at y = 0 with its gradient, s11 s22 s12 [stress, stress/length]. region: by default all blocks."""
        self.add_group("in_situ", surface=surface, profile=profile, k0=k0, unit_weight=unit_weight, surcharge=surcharge,
                       stress=stress, gradient=gradient, region=region, **values)  # fmt: skip

    def add_water(
        self, name: str | None = None, *, table: Numbers | None = None, unit_weight: float | None = None,
        pressure_file: PathLike | None = None, joints: References | None = None, surfaces: bool | None = None,
        region: Names | None = None, level: Numbers | None = None, **values: Any,
    ) -> None:  # fmt: skip
        """Water pressure on edges: below a table, rows x y [length], with unit_weight [stress/length], or of a file
        (its path counts from the current folder). joints: those that are wetted ('none': none), all by default;
        level: rise of the table, rows t dy."""
        self.add_group("water", name=name, table=table, unit_weight=unit_weight, pressure_file=pressure_file,
                       joints=joints, surfaces=surfaces, region=region, level=level, **values)  # fmt: skip

    def add_stage(
        self, name: str | None = None, *, kind: str | None = None, until: str | None = None,
        duration: float | None = None, until_step: int | None = None, until_time: float | None = None,
        tolerance: float | None = None, max_steps: int | None = None, on_failure: str | None = None,
        excavate: Names | None = None, relax: float | None = None, relax_steps: int | None = None,
        place: Names | None = None, water: Names | None = None, release: npt.ArrayLike | None = None,
        gravity: float | None = None, k01: float | None = None, reset_displacement: bool | None = None, **values: Any,
    ) -> None:  # fmt: skip
        """Add the next stage of the run.

        kind: 'static' or 'dynamic'; end: until='equilibrium', duration, until_time [time] or until_step. excavate and
        place: regions, relax: released share of the forces of excavated blocks; water: groups that act from here on;
        release: fixed points that are let go at the end; gravity: factor of all weights. values: others of &stage."""
        self.add_group("stage", name=name, kind=kind, until=until, duration=duration, until_step=until_step,
                       until_time=until_time, tolerance=tolerance, max_steps=max_steps, on_failure=on_failure,
                       excavate=excavate, relax=relax, relax_steps=relax_steps, place=place, water=water,
                       release=release, gravity=gravity, k01=k01, reset_displacement=reset_displacement,
                       **values)  # fmt: skip

    def add_liner(
        self, along: Numbers | None = None, *, thickness: float, young: float, outline: str | None = None,
        on: str | None = None, name: str | None = None, poisson: float | None = None, density: float | None = None,
        compressive_strength: float | None = None, tensile_strength: float | None = None,
        joint_material: int | str | None = None, element: float | None = None,
    ) -> None:  # fmt: skip
        """A lining of a thickness [length] along a line of the rock, rows x y [length] (closed when it ends where it
        begins), around a region (outline), or a layer on another lining (on).

        young, compressive_strength and tensile_strength [stress], density [mass/length²]; without joint_material it is
        bonded to what it lies on. element: largest distance of its nodes. A stage places it: install=name."""
        if sum(place is not None for place in (along, outline, on)) != 1:
            raise InputError("give one of along, outline and on")
        self.add_group("liner", name=name, along=along, outline=outline, on=on, thickness=thickness, young=young,
                       poisson=poisson, density=density, compressive_strength=compressive_strength,
                       tensile_strength=tensile_strength, joint_material=joint_material, element=element)  # fmt: skip

    def add_change(
        self, stage: str, *, joint_material: int | str | None = None, block_material: int | str | None = None,
        region: Names | None = None, **values: Any,
    ) -> None:  # fmt: skip
        """New values from the start of a stage on: of a joint material (friction, cohesion, …), of a block material, or
        of the blocks of regions (young, poisson, density, unit_weight; or block_material, another one for them), or of
        a lining (liner=name, young)."""
        self.add_group("change", stage=stage, joint_material=joint_material, block_material=block_material,
                       region=region, **values)  # fmt: skip

    def add_line_load(
        self, ends: Numbers, force_start: Numbers, force_end: Numbers | None = None, *, table: Numbers | None = None,
        name: str | None = None,
    ) -> None:  # fmt: skip
        """A force per length [force/length] along one block's edge, ends x1 y1 x2 y2 [length], linear between both ends
        (by default uniform). table: rows t factor. name: for searches of the load."""
        self.add_group("line_load", name=name, ends=ends, force_start=force_start, force_end=force_end, table=table)

    def add_point_load(self, at: Numbers, force: Numbers, *, name: str | None = None) -> None:
        """A force fx fy, or rows t fx fy [force], at a point, or at each of several, x y [length]. name: for searches
        of the load."""
        self.add_group("loading_point", name=name, at=at, force=force)


def _meaning(row: Mapping[str, Any]) -> str:
    unit = f" [{row['x-unit']}]" if "x-unit" in row else ""
    return f"{row['description']}{unit}"


def _checked_form(row: Mapping[str, Any], value: Any) -> Any:
    """A value as the options hold it: names as one text, paths from the root, numbers of rows in one list."""
    if row.get("x-file") and isinstance(value, str | os.PathLike):
        return os.path.abspath(value)  # noqa: PTH100
    if "string" in as_list(row.get("type", "")):
        if isinstance(value, Iterable) and not isinstance(value, str | os.PathLike):
            return ", ".join(str(item).strip() for item in value)
        if row["type"] == "string" and isinstance(value, int | np.integer) and not isinstance(value, bool):
            return str(int(value))
    return plain_value(value, keep_lists=True)


def plain_value(value: Any, *, keep_lists: bool = False) -> Any:
    """A value as Python numbers and texts: rows in one list; a list of one value is that value, unless it is kept."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, list | tuple | np.ndarray):
        flat = [plain_value(item) for item in flat_values(value)]
        return flat[0] if len(flat) == 1 and not keep_lists else flat
    return value


def plain_options(options: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Options in one form, to be compared: a list for each group that has values."""
    plain = {
        group: [{name: plain_value(value) for name, value in entries.items()} for entries in as_list(given) if entries]
        for group, given in options.items()
    }
    return {group: entries for group, entries in plain.items() if entries}
