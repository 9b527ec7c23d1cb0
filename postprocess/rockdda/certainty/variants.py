# SPDX-License-Identifier: MIT
"""A model with other numbers: of the method (step, corners, cells, elements, solver) and stiffness of its joints."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..namelist import last_value, short_real
from .template import Groups, Placeholders, Source

#: Kinds of variants: numbers of the method, which must not matter, and the one property, which is to be measured.
METHOD, PROPERTY = ("step", "corners", "cells", "elements", "solver"), "joint stiffness"
MOST_STEPS = 5000  # of a stage until equilibrium that names no other number
ENDS = ("until", "until_step", "until_time", "duration")  # of a stage
CORNER_RADIUS = 0.01  # where none is given
MANY = 1_000_000_000  # steps: the time ends the run
DIRECT = 300  # blocks up to which the automatic solver is a direct one
STIFFER = 16.0  # times: joints whose stiffness the program has chosen, in a search of the load (searched.f90)


@dataclass(frozen=True)
class Variant:
    """The model with one number changed."""

    name: str  #: "step ÷ 2"
    kind: str  #: "" as it is; one of METHOD, or PROPERTY
    step: float = 1.0  #: factor of the largest time step
    corner: float = 1.0  #: of the radius of corners
    cells: float = 1.0  #: of the size of cells
    elements: float = 1.0  #: of the distance of nodes along linings and bolts in grout
    stiffness: float = 1.0  #: of the normal and shear stiffness that joints are given
    contact: str = ""  #: further groups
    solver: str = ""

    def values(self, steps: int) -> dict[str, Any]:
        """Parameters of the study. steps: of a run that ends after this number; a variant runs to the same time."""
        names = ("name", "step", "corner", "cells", "elements", "stiffness", "contact", "solver")
        return {**{name: getattr(self, name) for name in names}, "steps": MANY if self.kind else steps}

    def changes(self, steps: int) -> dict[str, Any]:
        """Parameters that are not those of the model as it is."""
        usual = AS_IT_IS.values(0) | {"steps": MANY, "name": ""}
        return {name: value for name, value in self.values(steps).items() if value != usual[name]}


AS_IT_IS = Variant("as it is", "")
HALF_STEP = Variant("step ÷ 2", "step", step=0.5)


def variants_of(source: Source, stiffer: float = 1.0) -> list[Variant]:
    """The model as it is and its variants, of those numbers that it has. stiffer: times that a search makes joints
    whose stiffness the program has chosen."""
    found = [AS_IT_IS, HALF_STEP, Variant("step ÷ 4", "step", step=0.25)]
    if by_length(source):
        found.append(Variant("corner radius ÷ 2", "corners", corner=0.5))
    if source.groups.get("subdivide"):
        found.append(Variant("cells ÷ 2", "cells", cells=0.5))
    if any(source.facts.get("elements", {}).values()):
        found.append(Variant("elements ÷ 2", "elements", elements=0.5))
    other = other_solver(source)
    found.append(Variant(f"solver {other}", "solver", solver=f"&solver method = '{other}' /"))
    stiffness = stiffness_of(source)
    if stiffness is not None and has_chosen_stiffness(source):
        stiffness *= stiffer
    for factor, sign in ((2.0, "× 2"), (0.5, "÷ 2")):
        contact = "" if stiffness is None else f"&contact stiffness = {short_real(factor * stiffness)} /"
        found.append(Variant(f"joints {sign} as stiff", PROPERTY, stiffness=factor, contact=contact))
    return found


def steps_of(source: Source) -> int:
    """The number of steps after which a run ends; 0 where its last stage or a time ends it."""
    return 0 if ends_with_a_stage(source) else int(chosen(source.groups, "run", "steps") or 0)


def comes_to_rest(source: Source) -> bool:
    """Do the steps of a run only bring it to rest? It is static, without stages, and nothing changes with time.

    A static step moves a block by at most its force over 2 m/Δt²: steps half as long need four times as many."""
    if source.groups.get("stage") or float(source.facts.get("k01", 1.0)) > 0:
        return False
    return not any(_varies(name, group) for name, some in source.groups.items() for group in some)


def _varies(name: str, group: dict[str, Any]) -> bool:
    """Does a group change with time? The table of &water is a line, two numbers of a force are a constant."""
    options = {"level"} if name == "water" else {"harmonic", "record", "velocity", "displacement", "table"}
    return bool(options & group.keys()) or np.size(group.get("force", ())) > 2


def ends_with_a_stage(source: Source) -> bool:
    """Does the run end where its last stage ends?"""
    stages = source.groups.get("stage", [])
    return bool(stages) and any(name in stages[-1] for name in ENDS)


def by_length(source: Source) -> bool:
    """Are contacts by length of the joints?"""
    return str(source.facts.get("formulation", "length")) == "length"


def other_solver(source: Source) -> str:
    """A linear solver that the model does not use as it is."""
    method = str(chosen(source.groups, "solver", "method") or "auto").lower()
    direct = method in ("cholmod", "dense") or (method == "auto" and int(source.facts.get("blocks", 0)) <= DIRECT)
    return "pcg" if direct else "cholmod"


def stiffness_of(source: Source) -> float | None:
    """The contact stiffness (g0) to be multiplied; None where all joints have a stiffness of their own.

    Automatic stiffness goes by the blocks that meet; what represents all is its geometric mean over the model."""
    if by_length(source) and all("normal_stiffness" in joint or joint.get("tie") for joint in _joints(source)):
        return None
    given = chosen(source.groups, "contact", "stiffness")
    facts = source.facts
    if given is None and by_length(source) and "least_joint_stiffness" in facts:
        mean = math.sqrt(float(facts["least_joint_stiffness"]) * float(facts["largest_joint_stiffness"]))
        return mean * float(facts["mean_edge"])
    return float(given) if given else float(facts["contact_stiffness"])


def has_chosen_stiffness(source: Source) -> bool:
    """Are some joints as stiff as the program has chosen?"""
    return stiffness_of(source) is not None and not chosen(source.groups, "contact", "stiffness")


def _joints(source: Source) -> list[dict[str, Any]]:
    """Joint materials with what &joint_law gives them."""
    found = [dict(joint) for joint in source.groups.get("joint_material", [])]
    for law in source.groups.get("joint_law", []):
        for joint in found:
            if law.get("material") in (joint.get("number"), joint.get("name")):
                joint.update(law)
    return found


def template_of(source: Source, *, end_time: float | None = None) -> str:
    """The labelled file with placeholders for the parameters of `Variant.values`.

    A run that ends after some steps, and not with a stage, has an end time, too: that of its steps at their largest;
    where it comes to rest (`comes_to_rest`) over the factor of the step.
    end_time: one that is known."""
    groups, marks = copy.deepcopy(source.groups), Placeholders()
    ties = [joint for joint in _joints(source) if joint.get("tie")]
    for name in ("joint_material", "joint_law", "change"):
        for group in groups.get(name, []):
            named = {key for key in _names(name, group) if key is not None}
            if not any(named & {tie.get("number"), tie.get("name")} for tie in ties):
                for option in ("normal_stiffness", "shear_stiffness"):
                    if option in group:
                        group[option] = marks.mark(f"{float(group[option])!r}*stiffness")
    for group in groups.get("subdivide", []):
        group["size"] = marks.mark(f"{float(group['size'])!r}*cells")
    for (name, place), element in source.facts.get("elements", {}).items():
        groups[name][place - 1]["element"] = marks.mark(f"{element!r}*elements")
    for stage in groups.get("stage", []):
        if "until_step" in stage:
            stage["until_step"] = marks.mark(f"round({int(stage['until_step'])}/step)")
        if stage.get("until") == "equilibrium":
            stage["max_steps"] = marks.mark(f"round({int(stage.get('max_steps', MOST_STEPS))}/step)")
    largest = chosen(groups, "time", "dt_max") or source.facts.get("time_step")
    if largest is None:
        raise InputError("the largest time step of the model is not known")
    if end_time is not None:
        groups["run"] = [*groups.get("run", []), {"steps": MANY, "t_end": end_time}]
    elif steps := steps_of(source):
        end = min(chosen(groups, "run", "t_end") or math.inf, steps * float(largest))
        if comes_to_rest(source):
            end = marks.mark(f"{end!r}/step")
        groups["run"] = [*groups.get("run", []), {"steps": marks.mark("steps"), "t_end": end}]
    more = ["", "! what the study varies: {{name}}", f"&time dt_max = {{{{{float(largest)!r}*step}}}} /"]
    if by_length(source):
        radius = float(chosen(groups, "contact", "corner_radius") or CORNER_RADIUS)
        more.append(f"&contact corner_radius = {{{{{radius!r}*corner}}}} /")
    else:
        more.append("! corner_radius {{corner}} has no effect")
    more += ["{{contact}}", "{{solver}}", ""]
    text = marks.text(groups)
    # a parameter that no placeholder names would be an error of the study
    unused = [name for name in ("cells", "elements", "stiffness", "steps") if f"{name}}}}}" not in text]
    more += [f"! {name} {{{{{name}}}}}: the model has none" for name in unused]
    return text + "\n".join(more) + "\n"


def _names(kind: str, group: dict[str, Any]) -> Sequence[Any]:
    """What names the joint material of a group."""
    if kind == "joint_material":
        return [group.get("number"), group.get("name")]
    return [group.get("material") if kind == "joint_law" else group.get("joint_material")]


def chosen(groups: Groups, group: str, name: str) -> Any:
    """The last value of an option, None where it is not given."""
    return last_value(groups.get(group, []), name)
