# SPDX-License-Identifier: MIT
"""The model at the start, as a results file holds it: arrays that do not change during the run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from .arrays import AnyArray, FloatArray, IntArray
from .namelist import groups_in
from .rings import after_on_block, split_outlines

A = TypeVar("A", bound=AnyArray)


class Stored(Generic[A]):
    """An array of the file as an attribute: read when it is first used, `none` where older files do not have it."""

    def __init__(self, path: str, none: A | None = None) -> None:
        self.path, self.none = path, none

    def __get__(self, owner: Any, _: object = None) -> A:
        found: Any = owner._stored(self.path, self.none) if owner is not None else self
        return found


class StartArrays(ABC):
    """Blocks, points and bolts at the start. Arrays are read when they are first used, and cannot be changed."""

    path: Path
    n_blocks: int
    n_vertices: int
    """Vertices of all blocks."""
    _cache: dict[str, AnyArray]

    @abstractmethod
    def __getitem__(self, path: str) -> Any: ...

    @abstractmethod
    def __contains__(self, path: object) -> bool: ...

    def _stored(self, path: str, none: AnyArray | None = None) -> AnyArray:
        if path not in self._cache:
            array = np.asarray(self[path]) if none is None or path in self else none
            array.flags.writeable = False
            self._cache[path] = array
        return self._cache[path]

    @property
    def input_groups(self) -> dict[str, list[dict[str, Any]]]:
        """The groups of the options or labelled file of the run, a list for each name; none where it cannot be read."""
        return groups_in(str(self["input/config"])) if "input/config" in self else {}

    def _names(self, kind: str) -> list[str]:
        path = f"model/{kind}_names"
        return [str(name) for name in self[path]] if path in self else []

    vertex_offset = Stored[IntArray]("model/vertex_offset")
    """(nb+1,) block i owns the vertices [offset[i], offset[i+1])."""
    vertices = Stored[FloatArray]("model/vertices")
    """(nv, 2) vertices at the start, counter-clockwise block by block [length]."""
    edge_joint = Stored[IntArray]("model/edge_joint")
    """(nv,) joint material of the edge that starts at the vertex; 0: a bridge to an island."""
    block_material = Stored[IntArray]("model/block_material")
    """(nb,) material number, from 1."""
    block_area = Stored[FloatArray]("model/block_area")
    """(nb,) at the start [length²]."""
    block_centroid = Stored[FloatArray]("model/block_centroid")
    """(nb, 2) at the start [length]."""
    fixed_points = Stored[FloatArray]("model/fixed_points")
    """(nf, 2) at the start [length]."""
    loading_points = Stored[FloatArray]("model/loading_points")
    """(n, 2) at the start [length]."""
    measured_points = Stored[FloatArray]("model/measured_points")
    """(nm, 2) at the start [length]."""
    boundary_edges = Stored[IntArray]("model/boundary_edges", np.zeros((0, 2), dtype=np.int64))
    """(n, 2) edges that belong to boundaries: number of the boundary, from 0, and first vertex of the edge."""
    bolt_ends = Stored[FloatArray]("model/bolt_ends", np.zeros((0, 2, 2)))
    """(n, 2, 2) x y of both ends of the bolts at the start [length]; empty in files of older versions."""
    bolt_first = Stored[IntArray]("model/bolt_first", np.zeros(1, dtype=np.int64))
    """(n + 1,) nodes before each of these bolts, of a spring its first end alone."""
    liner_first = Stored[IntArray]("model/liner_first", np.zeros(1, dtype=np.int64))
    """(n + 1,) nodes before those of each lining."""
    bolt_blocks = Stored[IntArray]("model/bolt_blocks", np.zeros((0, 2), dtype=np.int64))
    """(n, 2) the blocks that hold the ends of the bolts, from 0; -1 the fixed outside."""
    bolt_properties = Stored[FloatArray]("model/bolt_properties", np.zeros((0, 3)))
    """(n, 3) stiffness [force/length], pretension and strength (0: unlimited) [force]."""

    @cached_property
    def rings(self) -> list[list[IntArray]]:
        """For each block its simple rings as indices of vertices: the outer one, then those of islands."""
        return split_outlines(self.vertices, self.vertex_offset)

    @property
    def parent(self) -> IntArray:
        """(nb,) block, from 0, that a cell was cut from (`&subdivide`); 0 ... nb-1 where no block was cut."""
        none = None if "model/parent" in self else np.arange(len(self.block_material), dtype=np.int32)
        return self._stored("model/parent", none)

    @property
    def stage_names(self) -> list[str]:
        """Names of the stages, in their order; one name without stages."""
        return self._names("stage") or ["stage 1"]

    @property
    def boundary_ends(self) -> IntArray:
        """(n, 2) vertices at both ends of the edges of boundaries, counter-clockwise on their blocks."""
        first = self.boundary_edges[:, 1].astype(np.int64)
        return np.stack([first, after_on_block(self.vertex_offset)[first]], axis=1)

    @property
    def bolt_names(self) -> list[str]:
        """Names of the bolts where some have nodes, springs first; else empty."""
        return self._names("bolt")

    @property
    def liner_names(self) -> list[str]:
        """Names of the linings."""
        return self._names("liner")

    @property
    def liner_section(self) -> FloatArray:
        """(n, 5) thickness, compressive and tensile strength (infinite: none), 1: closed, 1 or -1: the opening lies to
        the left or the right of its line."""
        section = np.array(self._stored("model/liner_section", np.zeros((0, 5))))
        section[:, 1:3][section[:, 1:3] > 1e300] = np.inf
        return section
