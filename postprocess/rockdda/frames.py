# SPDX-License-Identifier: MIT
"""The blocks at one moment: frames of a results file, and the fields that can be drawn of them."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from .arrays import AnyArray, BoolArray, FloatArray, IntArray
from .columns import Columns
from .errors import InputError
from .fields import FIELD_TEXTS
from .start import StartArrays, Stored
from .storage.tables import names_in

if TYPE_CHECKING:
    import pandas


class FrameTables(StartArrays):
    """The tables that frames are rows of."""

    n_frames: int
    n_steps: int
    """Accepted steps."""
    has_joints: bool
    """Do the frames hold stresses, opening and slip along joints? Not in files of version 1."""
    has_strength: bool
    """Do the frames hold how much of their shear strength joints mobilise? Not in the first files of version 2."""

    @property
    @abstractmethod
    def units(self) -> str: ...
    @property
    @abstractmethod
    def has_contacts(self) -> bool: ...
    @abstractmethod
    def rows(self, path: str, start: int, stop: int) -> AnyArray: ...
    @abstractmethod
    def attribute(self, path: str, name: str) -> Any: ...

    @property
    def bolt_spacing(self) -> FloatArray:
        """(n,) distance of bolts with nodes out of the plane [length]: their forces over it are those of the model."""
        return np.array(self.attribute("model/bolt_first", "spacing_out_of_plane") if self.bolt_names else [], float)

    @property
    def frames(self) -> Frames:
        """The frames, as a sequence: `results.frames[-1]` is the last one."""
        return Frames(self)

    @property
    def has_stages(self) -> bool:
        """Is there more than one stage, or one with a name?"""
        return self.stage_names != ["stage 1"]

    def stage_of(self, step: int) -> int:
        """Index of the stage to which a step belongs; the start belongs to the first one."""
        if "history/stage" not in self or self.n_steps == 0:
            return 0
        row = int(np.searchsorted(self["history/step"], step))
        return int(self["history/stage"][min(row, self.n_steps - 1)])


#: A force of a beam of a lining at its start and at its end: columns of the nodes there.
BEAM_ENDS = {"N": ("N_behind", "N_before"), "M": ("M", "M"), "Q": ("Q_behind", "Q_before")}
CONTACT_TABLES = [name for name in names_in("frames", "") if re.match(r"contact_(?!offset)", name)]
#: Of each contact, from version 2 of the results on.
JOINT_TABLES = names_in("frames", "joints")
#: The same; not in the first files of version 2.
STRENGTH_TABLE = "contact_strength"


def both_sides(nodes: Columns, name: str) -> FloatArray:
    """A force of linings on both sides of their nodes."""
    return np.concatenate([nodes[column] for column in BEAM_ENDS[name]])


@dataclass(frozen=True)
class Field:
    """A number for every block of a frame."""

    name: str
    label: str  # for axes and colour bars
    description: str
    compute: Callable[[Frame], AnyArray]


@dataclass(frozen=True)
class Contacts:
    """The n contacts of one frame."""

    point: FloatArray  # (n, 2) where the contact is: the vertex or the point of the joint, after the step [length]
    force: FloatArray  # (n, 2) on the first block, zero when open [force]
    state: IntArray  # (n,) 0 open, 1 sliding, 2 locked or tied
    blocks: IntArray  # (n, 2) numbers of the two blocks, from 0
    # (n,) each, None in files of older versions
    opening: FloatArray | None = None  # distance of the edges, negative where they overlap [length]
    slip: FloatArray | None = None  # since the contact closed, without its direction [length]
    length: FloatArray | None = None  # of joint, for which the point stands [length]
    normal_stress: FloatArray | None = None  # tension positive [force/length²]
    shear_stress: FloatArray | None = None  # [force/length²]
    strength: FloatArray | None = None  # share of the shear strength that acts, 0 where open or without strength [-]

    def __len__(self) -> int:
        return len(self.state)


class Frames(Sequence["Frame"]):
    """The frames of a results file."""

    def __init__(self, results: FrameTables) -> None:
        self._results = results

    def __len__(self) -> int:
        return self._results.n_frames

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [Frame(self._results, i) for i in range(len(self))[index]]
        number = int(index)
        if number < 0:
            number += len(self)
        if not 0 <= number < len(self):
            raise IndexError(f"{self._results.path} has {len(self)} frames, there is no frame {index}")
        return Frame(self._results, number)

    def __iter__(self) -> Iterator[Frame]:
        return (Frame(self._results, i) for i in range(len(self)))


class Frame:
    """The blocks at one moment. Arrays are read when they are first used."""

    vertices = Stored[FloatArray]("vertices")
    """(nv, 2) vertices of all blocks [length]."""
    centroid = Stored[FloatArray]("centroid")
    """(nb, 2) [length]."""
    rotation = Stored[FloatArray]("rotation")
    """(nb,) since the start, counter-clockwise [rad]."""
    stress = Stored[FloatArray]("stress")
    """(nb, 3) σx σy τxy, tension positive [force/length²]."""
    velocity = Stored[FloatArray]("velocity")
    """(nb, 6) u0 v0 r0 εx εy γxy of the centroid, per time."""

    def __init__(self, results: FrameTables, index: int) -> None:
        self.results = results
        self.index = index
        self._cache: dict[str, AnyArray] = {}

    def __repr__(self) -> str:
        return f"<rockdda.Frame {self.index}: step {self.step}, time {self.time:g}>"

    def _stored(self, name: str, _: AnyArray | None = None) -> AnyArray:
        if name not in self._cache:
            self._cache[name] = self.results.rows(f"frames/{name}", self.index, self.index + 1)[0]
        return self._cache[name]

    @property
    def step(self) -> int:
        return int(self._stored("step"))

    @property
    def time(self) -> float:
        return float(self._stored("time"))

    @property
    def stage(self) -> int:
        """Index of its stage, from 0; the start belongs to the first one."""
        return self.results.stage_of(self.step)

    @property
    def stage_name(self) -> str:
        return self.results.stage_names[self.stage]

    @property
    def active(self) -> BoolArray:
        """(nb,) blocks that are there: neither excavated nor still to be placed."""
        if "frames/active" not in self.results:
            return np.ones(self.results.n_blocks, dtype=bool)
        return self._stored("active").astype(bool)

    @property
    def displacement(self) -> FloatArray:
        """(nb, 2) of the centroids since the start [length]."""
        return self.centroid - self.results.block_centroid

    @property
    def vertex_displacement(self) -> FloatArray:
        """(nv, 2) of the vertices since the start [length]."""
        return self.vertices - self.results.vertices

    @property
    def shown_vertices(self) -> FloatArray:
        """(nv, 2) vertices to be drawn [length]: NaN for blocks that are not active, which leaves a gap."""
        active = self.active
        if active.all():
            return self.vertices
        return np.where(np.repeat(active, np.diff(self.results.vertex_offset))[:, None], self.vertices, np.nan)

    @property
    def shown_displacement(self) -> FloatArray:
        """(nv, 2) of the vertices to be drawn [length]: blocks that are not active shrink to a point."""
        active, offset = self.active, self.results.vertex_offset
        if active.all():
            return self.vertex_displacement
        corners = np.diff(offset)
        first = np.repeat(self.results.vertices[offset[:-1]], corners, axis=0)
        there = np.repeat(active, corners)[:, None]
        return np.where(there, self.vertex_displacement, first - self.results.vertices)

    @property
    def contacts(self) -> Contacts:
        """The contacts of the step that ended here (none in a file without contacts)."""
        begin, end = (int(i) for i in self.results.rows("frames/contact_offset", self.index, self.index + 2))
        names = CONTACT_TABLES + (JOINT_TABLES if self.results.has_joints else [])
        if self.results.has_strength:
            names = [*names, STRENGTH_TABLE]
        return Contacts(*(self.results.rows(f"frames/{name}", begin, end) for name in names))

    @property
    def bolt_ends(self) -> FloatArray:
        """(n, 2, 2) x y of both ends of the bolts [length]; empty in files of older versions."""
        return self._bolt_row("bolt_ends", (0, 2, 2))

    @property
    def bolt_force(self) -> FloatArray:
        """(n,) axial forces of the bolts that are springs, tension positive [force]."""
        return self._bolt_row("bolt_force", (0,))[: len(self.results.bolt_ends)]

    @property
    def bolt_nodes(self) -> pandas.DataFrame:
        """Nodes of the bolts: bolt (from 0), its name, x, y, force (tension positive, per bolt), slip (bar against
        rock), use (largest share of a strength, of the steel or its grout), state (0 absent, 1 elastic, 2 slipping,
        3 yielding, 4 ruptured). Empty where bolts are springs alone."""
        return self.bolt_node_columns.to_pandas("a table of bolts")

    @property
    def bolt_node_columns(self) -> Columns:
        """The columns of `bolt_nodes`, as arrays."""
        first, names = self.results.bolt_first, self.results.bolt_names
        bolt = np.repeat(np.arange(len(names)), np.diff(first))
        place = self._or_nan("bolt_node", len(bolt), 2)
        force, slip, state, use = (
            self._or_nan(f"bolt_{name}", len(bolt)) for name in ("force", "slip", "state", "use")
        )
        columns = {"bolt": bolt, "name": np.array(names, dtype=object)[bolt], "x": place[:, 0], "y": place[:, 1]}
        return Columns(columns | {"force": force, "slip": slip, "use": use, "state": state})

    @property
    def liner_nodes(self) -> pandas.DataFrame:
        """Nodes of the linings: lining (from 0), its name, x, y, N (axial force, tension positive), M (moment, positive
        where it pulls on the side of the opening), Q (shear force), per metre out of the plane; N and Q before and
        behind the node, which differ at a corner: N and Q are those of the larger N; opening and slip of its back
        against the rock; use (largest share of the strength that N and M take together, of the node and of
        the sections beside it by which the program judges); state (0 absent, 1 sound, 2 cracked, 3 crushed)."""
        return self.liner_node_columns.to_pandas("a table of linings")

    @property
    def liner_node_columns(self) -> Columns:
        """The columns of `liner_nodes`, as arrays."""
        names = self.results.liner_names
        liner = np.repeat(np.arange(len(names)), np.diff(self.results.liner_first))
        place, force = self._or_nan("liner_point", len(liner), 2), self._or_nan("liner_force", len(liner), 3)
        state, use = (self._or_nan(f"liner_{name}", len(liner)) for name in ("state", "use"))
        columns = {"liner": liner, "name": np.array(names, dtype=object)[liner], "x": place[:, 0], "y": place[:, 1]}
        opening, slip = self._or_nan("liner_back", len(liner), 2).T
        use = np.where(use < 0, np.nan, np.where(use > 1e300, np.inf, use))
        columns |= dict(zip("NMQ", force.T, strict=True))
        has_sides = bool(names) and "frames/liner_sides" in self.results
        both = self._stored("liner_sides") if has_sides else force[:, [0, 2, 0, 2]]
        columns |= dict(zip(("N_before", "Q_before", "N_behind", "Q_behind"), both.T, strict=True))
        return Columns(columns | {"opening": opening, "slip": slip, "use": use, "state": state})

    @property
    def liner_sections(self) -> FloatArray:
        """(n, k, 2) N and M by which the program judges the sections beside each node: at the end of the beam before it
        and at the start and in the middle of that behind it; none in files of older versions."""
        n_nodes = int(self.results.liner_first[-1]) if self.results.liner_names else 0
        if not n_nodes or "frames/liner_section" not in self.results:
            return np.zeros((n_nodes, 0, 2))
        of_beam = self._stored("liner_section").reshape(n_nodes, 3, 2)
        before, first = np.roll(of_beam[:, 2:], 1, axis=0), self.results.liner_first
        for k, closed in enumerate(self.results.liner_section[:, 3] > 0):
            if first[k] < first[k + 1]:
                before[first[k]] = of_beam[first[k + 1] - 1, 2:] if closed else 0
        return np.concatenate([before, of_beam[:, :2]], axis=1)

    @property
    def liner_pieces(self) -> Columns:
        """The same pieces of linings in each frame: the parts between nodes, of closed ones also from the last to the
        first. Columns: liner (from 0), x1, y1, x2, y2, N, M, Q (means of its two ends), use (the larger one; NaN: no
        strength), there (False: absent)."""
        nodes, first = self.liner_node_columns, self.results.liner_first
        number = np.arange(nodes.n_rows)
        following = number + 1
        for k, closed in enumerate(self.results.liner_section[:, 3] > 0):
            following[first[k + 1] - 1] = first[k] if closed else -1
        start, end = (nodes.rows(chosen[following >= 0]) for chosen in (number, following))
        places = dict(zip(("x1", "y1", "x2", "y2"), [start["x"], start["y"], end["x"], end["y"]], strict=True))
        means = {name: 0.5 * (start[one] + end[other]) for name, (one, other) in BEAM_ENDS.items()}
        use, there = np.fmax(start["use"], end["use"]), (start["state"] > 0) & (end["state"] > 0)
        return Columns({"liner": start["liner"]} | places | means | {"use": use, "there": there})

    @property
    def bolt_pieces(self) -> Columns:
        """The same pieces of bolts in each frame: springs, then the parts between nodes.

        Columns: bolt (from 0), x1, y1, x2, y2, force, use (NaN: no strength is known), there (False: absent or lost).
        """
        ends = self.bolt_ends.reshape(-1, 4)
        strength = self.results.bolt_properties[:, 2] if len(ends) else np.zeros(0)
        with np.errstate(divide="ignore", invalid="ignore"):
            use = np.where(strength > 0, np.abs(self.bolt_force) / strength, np.nan)
        springs = np.column_stack([np.arange(len(ends)), ends, self.bolt_force, use, np.ones(len(ends))])
        nodes = self.bolt_node_columns
        same = np.flatnonzero(nodes["bolt"][1:] == nodes["bolt"][:-1])
        first, second = (nodes.rows(same + k) for k in (0, 1))
        parts = np.column_stack([
            first["bolt"], first.stack("x", "y"), second.stack("x", "y"), 0.5 * (first["force"] + second["force"]),
            np.fmax(first["use"], second["use"]), (first["state"] > 0) & (second["state"] > 0),
        ])  # fmt: skip
        rows = np.concatenate([springs, parts])
        columns = dict(zip(("bolt", "x1", "y1", "x2", "y2", "force", "use", "there"), rows.T, strict=True))
        return Columns(columns | {"bolt": rows[:, 0].astype(int), "there": rows[:, 7] > 0})

    def moved_pieces(self, what: str, scale: float = 1.0) -> Columns:
        """The `bolt_pieces` or `liner_pieces` (what: 'bolt', 'liner') that are there, at displacements since the first
        frame times a factor."""
        pieces: Columns = getattr(self, f"{what}_pieces")
        if scale != 1:
            start: Columns = getattr(self.results.frames[0], f"{what}_pieces")
            names = ("x1", "y1", "x2", "y2")
            pieces = Columns(pieces | {name: start[name] + scale * (pieces[name] - start[name]) for name in names})
        return pieces.rows(pieces["there"])

    def _or_nan(self, name: str, *shape: int) -> AnyArray:
        """A table of this frame; NaN where nothing is in it, or an older file does not have it."""
        return self._stored(name) if shape[0] and f"frames/{name}" in self.results else np.full(shape, np.nan)

    def _bolt_row(self, name: str, shape: tuple[int, ...]) -> FloatArray:
        return self._stored(name) if len(self.results.bolt_ends) else np.zeros(shape)

    def polygons(self) -> list[FloatArray]:
        """For each block an (m, 2) array of its vertices, counter-clockwise, not closed [length]."""
        return np.split(self.vertices, self.results.vertex_offset[1:-1])

    def principal_stress(self) -> tuple[FloatArray, FloatArray]:
        """((nb, 2) largest and smallest principal stress, (nb,) angle of the largest to the x axis [rad])."""
        sx, sy, txy = self.stress.T
        middle, radius = (sx + sy) / 2, np.hypot((sx - sy) / 2, txy)
        return np.stack([middle + radius, middle - radius], axis=1), np.arctan2(2 * txy, sx - sy) / 2

    def field(self, name: str) -> AnyArray:
        """(nb,) a number for each block; `rockdda.FIELDS` lists the names."""
        return FIELDS[field_name(name)].compute(self)


def _fields() -> dict[str, Field]:
    """All fields by name."""
    computed: dict[str, Callable[[Frame], AnyArray]] = {
        "displacement": lambda f: np.hypot(*f.displacement.T),
        "displacement_x": lambda f: f.displacement[:, 0],
        "displacement_y": lambda f: f.displacement[:, 1],
        "rotation": lambda f: f.rotation,
        "speed": lambda f: np.hypot(*f.velocity[:, :2].T),
        "velocity_x": lambda f: f.velocity[:, 0],
        "velocity_y": lambda f: f.velocity[:, 1],
        "spin": lambda f: f.velocity[:, 2],
        "stress_x": lambda f: f.stress[:, 0],
        "stress_y": lambda f: f.stress[:, 1],
        "stress_xy": lambda f: f.stress[:, 2],
        "stress_min": lambda f: f.principal_stress()[0][:, 1],
        "stress_max": lambda f: f.principal_stress()[0][:, 0],
        "stress_mean": lambda f: f.stress[:, :2].mean(axis=1),
        "stress_shear": lambda f: f.principal_stress()[0] @ np.array([0.5, -0.5]),
        "material": lambda f: f.results.block_material,
        "block": lambda f: np.arange(1, f.results.n_blocks + 1),
    }
    return {name: Field(name, label, text, computed[name]) for name, (label, text, _) in FIELD_TEXTS.items()}


FIELDS = _fields()


def field_name(name: str) -> str:
    """The name; an unknown one gives an InputError."""
    if name not in FIELDS:
        raise InputError(f"there is no field {name!r}; the fields are: {', '.join(FIELDS)}")
    return name
