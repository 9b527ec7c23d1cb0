# SPDX-License-Identifier: MIT
"""DDAML: the XML geometry (.geo) and analysis (.ana) files of DDA for Windows.

Which keys its reader accepts and what it does with them was taken from its behaviour: materials count in the order of
their elements (`type` is for the human reader), the first `Boltproperties` hold for all bolts, unknown keys are passed
over in silence. Here they are named in warnings, and keys that are almost right are taken for what was meant.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..deck import BlockMaterial, JointMaterial, number_text
from ..text import decoded, read_text
from .ddaml_reader import Element, Reader, Word, parse_xml
from .geometry import LARGEST_MATERIAL, Analysis, Geometry, TimeRow
from .report import Report

#: Lists of a geometry: the list of `Geometry` that takes them, their children, what these are, numbers of each.
LISTS = {
    "Jointlist": ("joints", ["Joint"], "joint", 4), "Boundlist": ("boundary", ["Line"], "boundary line", 4),
    "Matlinelist": ("material_lines", ["Line"], "material line", 4), "Boltlist": ("bolts", ["Bolt"], "bolt", 4),
    "Fixedpointlist": ("fixed", ["Point", "Line"], "fixed", 4), "Holepointlist": ("holes", ["Point"], "hole point", 2),
    "Loadpointlist": ("loading", ["Point"], "loading point", 2),
    "Measuredpointlist": ("measured", ["Point"], "measured point", 2),
}  # fmt: skip
#: Limits of the properties of materials, in words, and what they are.
LIMITS: dict[str, tuple[str, Callable[[float], bool]]] = {
    "Unitmass": ("positive", lambda x: x > 0), "Youngsmod": ("positive", lambda x: x > 0),
    "Poissonratio": ("between -1 and 0.5", lambda x: -1 < x < 0.5),
    "Friction": ("in [0, 90) degrees", lambda x: 0 <= x < 90), "Cohesion": ("zero or positive", lambda x: x >= 0),
    "Tensile": ("zero or positive", lambda x: x >= 0),
}  # fmt: skip
#: Properties that are not converted.
LEFT = {"Damping": "see &block_damping", "Istrain": "initial strains have no counterpart"}
CONSTANTS = {"Openclose": 0.0002, "Opencriteria": 2e-7, "NormSpringPen": 0.0004, "AngleOverlap": 3.0}
CONSTANTS |= {"ShearNormRatio": 2.5}
OTHER_CONSTANTS = ["Domainscale", "NormExternDist", "NormPenDist", "MinReflineFactor"]


def is_ddaml(path: Path) -> str | None:
    """'geometry', 'analysis' or 'both' for a DDAML file; None for anything else that can be read."""
    try:
        head = decoded(path.open("rb").read(4096)).lstrip()
    except OSError:
        return None
    if not head.startswith("<"):
        return None
    report = Report(path)
    root = parse_xml(read_text(path), report)
    if root is None:  # the error is reported when the file is read
        return "analysis" if path.suffix.lower() in (".ana", ".df") else "geometry"
    names = {element.name.lower() for element in [root, *root.children]}
    found = [name for name in ("geometry", "analysis") if name in names]
    return {1: found[0], 2: "both"}.get(len(found)) if found else None


def read_geometry(path: Path) -> tuple[Geometry, Report]:
    """A geometry file; InputError with all problems when it cannot be used."""
    reader = Reader(path)
    section = reader.section("Geometry")
    if section is None:
        reader.report.fail("no element 'Geometry' in the root element")
    geometry = Geometry(e0=math.nan)
    for element in section.children:
        key = reader.known(element, ["Edgenodedist", *LISTS, "Seismicpointlist"])
        if key == "Edgenodedist":
            geometry.e0 = reader.value(element, "distance")
            if geometry.e0 <= 0:
                reader.error("distance of <Edgenodedist> must be positive", element)
        elif key == "Seismicpointlist":
            reader.warning("seismic points are not converted", element)
        elif key is not None:
            _read_list(reader, element, key, geometry)
    if math.isnan(geometry.e0):
        reader.error("no element 'Edgenodedist'", section)
    if not geometry.lines:
        reader.error("no lines: 'Jointlist' and 'Boundlist' are missing or empty", section)
    reader.report.raise_errors()
    return geometry, reader.report


def _children(reader: Reader, element: Element, names: list[str]) -> list[Element]:
    """The children of a list that bear one of these names."""
    found = []
    for child in element.children:
        name = reader.known(child, names)
        if name is not None:
            child.name = name
            found.append(child)
    return found


def _read_list(reader: Reader, element: Element, key: str, geometry: Geometry) -> None:
    name, children, what, count = LISTS[key]
    into: list[Any] = getattr(geometry, name)
    has_material = name in ("joints", "boundary", "material_lines")
    for child in _children(reader, element, children):
        is_point = child.name == "Point" and name == "fixed"
        label = f"fixed {child.name.lower()}" if name == "fixed" else what
        values = reader.numbers(child, 2 if is_point else count, f"{label} {len(into) + 1}")
        material = 1
        if has_material and (name != "boundary" or "type" in child.attributes):
            material = reader.whole(child, "type", 1, LARGEST_MATERIAL)
        if values:
            place = (*values, *values) if is_point else tuple(values)
            into.append((place, material) if has_material else place)


def read_analysis(path: Path) -> tuple[Analysis, tuple[float, float, float] | None, Report]:
    """An analysis file, and the values of the bolts (stiffness, pretension, strength) if it has any."""
    reader = Reader(path)
    section = reader.section("Analysis")
    if section is None:
        reader.report.fail("no element 'Analysis' in the root element")
    analysis = Analysis(math.nan, -1, math.nan, math.nan, stiffness=0.0)
    state = _State(reader, analysis)
    # behaviour of DDA for Windows that is not the default of RockDDA
    analysis.set_option("time", "length_scale", "'largest'")
    for element in section.children:
        key = reader.known(element, list(state.handlers))
        if key is not None:
            state.handlers[key](element)
    if math.isnan(analysis.k01):
        kind = section.attributes.get("type", "static")
        analysis.k01 = 1.0 if kind == "dynamic" else 0.0
        reader.warning(f"no element 'Analysistype': taken as {kind!r}", section)
    for name, missing in (
        ("Numtimesteps", analysis.steps < 0),
        ("Maxtimestep", math.isnan(analysis.dt_max)),
        ("Maxdisplacement", math.isnan(analysis.displacement_ratio)),
        ("Blockmaterial", not analysis.block_materials),
        ("Jointproperties", not analysis.joint_materials),
    ):
        if missing:
            reader.error(f"no element {name!r}", section)
    reader.report.raise_errors()
    if state.penalty_factor > 0:
        analysis.stiffness = state.penalty_factor * max(block.youngs_modulus for block in analysis.block_materials)
    _compare_gravity(state, analysis)
    return analysis, state.bolt_values, reader.report


def _compare_gravity(state: _State, analysis: Analysis) -> None:
    """Gravity is weight over density; a separate value must agree with it."""
    if state.gravity is None:
        return
    for i, block in enumerate(analysis.block_materials, start=1):
        implied = block.weight / block.density
        if not math.isclose(implied, state.gravity, rel_tol=1e-3):
            state.reader.report.warning(
                f"Gravaccel {number_text(state.gravity)} is ignored: Unitweight over Unitmass of block material {i} "
                f"is {implied:.6g}, and that counts"
            )


class _State:
    """Reads the elements of the analysis section, one method each."""

    def __init__(self, reader: Reader, analysis: Analysis) -> None:
        self.reader = reader
        self.analysis = analysis
        self.bolt_values: tuple[float, float, float] | None = None
        self.penalty_factor = 0.0
        self.gravity: float | None = None
        option = analysis.set_option
        self.handlers: dict[str, Callable[[Element], None]] = {
            "Analysistype": self.analysis_type,
            "Rotation": self.rotation,
            "Gravity": lambda e: self.unless_no(e, "the stepwise turning on of gravity is not converted: use &stage"),
            "Autotimestep": lambda e: self.unless_no(e, "the time step follows RockDDA's rules, at most maxtimestep"),
            "Autopenalty": self.penalty,
            "Planestrain": self.plane,
            "Numtimesteps": lambda e: setattr(analysis, "steps", reader.whole(e, "timesteps", 0)),
            "Maxtimestep": lambda e: setattr(analysis, "dt_max", self.positive(e, "maxtimestep")),
            "Mintimestep": lambda e: option("time", "dt_min", number_text(self.positive(e, "mintimestep"))),
            "Opencloselimit": lambda e: option("time", "max_open_close", str(reader.whole(e, "maxopenclose", 1))),
            "Maxdisplacement": lambda e: setattr(analysis, "displacement_ratio", self.positive(e, "maxdisplacement")),
            "Saveinterval": lambda e: option("run", "save_every", str(reader.whole(e, "step", 1))),
            "AConstants": self.constants,
            "Blockmaterial": self.block_material,
            "Jointproperties": self.joint_material,
            "Boltproperties": self.bolts,
            "Loadpointlist": self.loads,
            "Timehistory": lambda e: self.ignore(e, "give the motion as a CSV file in &load base_acceleration"),
            "ContactDamping": self.damping,
            "Gravaccel": lambda e: setattr(self, "gravity", reader.value(e, "value")),
            "Writevertices": lambda e: None,  # results always hold all vertices
        }

    def warn(self, element: Element, text: str) -> None:
        self.reader.warning(text, element)

    def ignore(self, element: Element, advice: str) -> None:
        self.warn(element, f"<{element.name}> is not converted: {advice}")

    def unless_no(self, element: Element, text: str) -> None:
        if self.reader.flag(element):
            self.warn(element, text)

    def positive(self, element: Element, name: str) -> float:
        found = self.reader.value(element, name)
        if found <= 0:
            message = f"{name} of <{element.name}> must be positive, found {number_text(found)}"
            self.reader.error(message, element)
        return found

    def analysis_type(self, element: Element) -> None:
        kind = (self.reader.attribute(element, "type") or "").lower()
        if kind not in ("dynamic", "static"):
            self.warn(element, f"type {kind!r} is taken as 'static'; expected 'static' or 'dynamic'")
        self.analysis.k01 = 1.0 if kind == "dynamic" else 0.0

    def rotation(self, element: Element) -> None:
        kind = (self.reader.attribute(element, "type") or "linear").lower()
        if kind not in ("linear", "exact"):
            self.warn(element, f"rotation {kind!r} is taken as 'exact'")
            kind = "exact"
        self.analysis.set_option("time", "rotation", f"'{kind}'")

    def penalty(self, element: Element) -> None:
        factor = self.positive(element, "pfactor") if self.reader.attribute(element, "pfactor") else 50.0
        self.penalty_factor = factor
        if self.reader.flag(element):
            self.warn(
                element, f"the contact stiffness is not adapted during the run: it is {number_text(factor)} times E"
            )

    def plane(self, element: Element) -> None:
        if self.reader.flag(element):
            self.analysis.set_option("material", "plane", "'strain'")

    def constants(self, element: Element) -> None:
        for child in element.children:
            key = self.reader.known(child, [*CONSTANTS, *OTHER_CONSTANTS])
            if key is None:
                continue
            found = self.positive(child, "value")
            if key == "AngleOverlap":
                self.analysis.set_option("contact", "angle_tolerance", number_text(found))
            elif key == "ShearNormRatio":
                self.analysis.set_option("contact", "shear_ratio", number_text(found))
            elif key not in CONSTANTS or not math.isclose(found, CONSTANTS[key]):
                self.warn(child, f"<{child.name}> is not converted: it has no counterpart")

    def damping(self, element: Element) -> None:
        if self.reader.value(element, "value") != 0:
            self.ignore(element, "see damping_ratio of &joint_law")

    def block_material(self, element: Element) -> None:
        n = len(self.analysis.block_materials) + 1
        self._check_order(element, n, "block material")
        singles = ("Unitmass", "Unitweight", "Youngsmod", "Poissonratio", "Damping")
        triples = ("Istress", "Ivelocity", "Istrain")
        what = f"block material {n}"
        found = self._properties(element, dict.fromkeys(singles, 1) | dict.fromkeys(triples, 3), what)
        for key in singles[:4]:
            if key not in found:
                message = f"block material {n} has no <{key}>"
                self.reader.error(message, element)
                found[key] = [1.0]
        density, weight, young, poisson = (found[key][0] for key in singles[:4])
        triple_of = {"stress": "Istress", "velocity": "Ivelocity"}
        given: Any = {name: tuple(found.get(key, [0.0] * 3)) for name, key in triple_of.items()}
        self.analysis.block_materials.append(BlockMaterial(density, weight, young, poisson, **given))

    def joint_material(self, element: Element) -> None:
        n = len(self.analysis.joint_materials) + 1
        self._check_order(element, n, "joint material")
        found = self._properties(element, dict.fromkeys(("Friction", "Cohesion", "Tensile"), 1), f"joint material {n}")
        friction, cohesion, tension = (found.get(key, [0.0])[0] for key in ("Friction", "Cohesion", "Tensile"))
        self.analysis.joint_materials.append(JointMaterial(friction, cohesion, tension))

    def _properties(self, element: Element, counts: dict[str, int], what: str) -> dict[str, list[float]]:
        """Numbers of the properties that a material has, of those with these counts."""
        found: dict[str, list[float]] = {}
        for child in element.children:
            key = self.reader.known(child, list(counts))
            if key is not None:
                found[key] = self.reader.numbers(child, counts[key], f"{key} of {what}") or [0.0] * counts[key]
                wanted, holds = LIMITS.get(key, ("", bool))
                if wanted and not holds(found[key][0]):
                    message = f"{key} of {what} must be {wanted}, found {number_text(found[key][0])}"
                    self.reader.error(message, child)
                if key in LEFT and any(found[key]):
                    self.warn(child, f"<{child.name}> of {what} is not converted: {LEFT[key]}")
        return found

    def _check_order(self, element: Element, n: int, what: str) -> None:
        kind = element.attributes.get("type")
        if kind is not None and kind.strip() != str(n):
            self.warn(element, f"type {kind!r} is ignored: this is {what} {n}, in the order of the file")

    def bolts(self, element: Element) -> None:
        values = self.reader.numbers(element, 3, "bolt properties (stiffness, strength, pretension)")
        if values is None:
            return
        if self.bolt_values is not None:
            self.warn(element, "the first <Boltproperties> hold for all bolts; these are ignored")
            return
        self.bolt_values = (values[0], values[2], values[1])
        if values[0] <= 0 or values[1] < 0:
            message = "bolt properties: stiffness must be positive, strength zero or positive"
            self.reader.error(message, element)

    def loads(self, element: Element) -> None:
        for child in _children(self.reader, element, ["Loadpoint"]):
            n = len(self.analysis.loading_tables) + 1
            rows: list[TimeRow] = []
            record: list[Word] = []
            for word in [*child.words, Word(";", child.line, child.column)]:
                if word.text != ";":
                    record.append(word)
                    continue
                if record:
                    rows += self._load_row(record, n, rows)
                    record = []
            wanted = self.reader.whole(child, "numpoints", 1)
            if len(rows) != wanted and not self.reader.report.errors:
                message = f"load point {n}: numpoints is {wanted}, but there are {len(rows)} records (';' ends one)"
                self.reader.error(message, child)
            self.analysis.loading_tables.append(rows)

    def _load_row(self, record: list[Word], n: int, before: list[TimeRow]) -> list[TimeRow]:
        first, what = record[0], f"load point {n}, record {len(before) + 1}"
        if len(record) != 3:
            message = f"{what}: expected t fx fy, found {len(record)} numbers"
            self.reader.error(message, first)
            return []
        t, x, y = (self.reader.number(word, what) for word in record)
        if before and t < before[-1][0]:
            message = f"{what}: time {number_text(t)} comes before {number_text(before[-1][0])}"
            self.reader.error(message, first)
        return [(t, x, y)]
