# SPDX-License-Identifier: MIT
"""The model at the start, as a results file holds it: arrays that do not change during the run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any

import numpy as np

from .arrays import AnyArray, FloatArray, IntArray
from .rings import split_outlines


class StartArrays(ABC):
    """Blocks, points and bolts at the start. Arrays are read when they are first used, and cannot be changed."""

    _cache: dict[str, AnyArray]

    @abstractmethod
    def __getitem__(self, path: str) -> Any: ...

    @abstractmethod
    def __contains__(self, path: object) -> bool: ...

    def _constant(self, path: str) -> AnyArray:
        if path not in self._cache:
            array = np.asarray(self[path])
            array.flags.writeable = False
            self._cache[path] = array
        return self._cache[path]

    @property
    def vertex_offset(self) -> IntArray:
        """(nb+1,) block i owns the vertices [offset[i], offset[i+1])."""
        return self._constant("model/vertex_offset")

    @property
    def vertices(self) -> FloatArray:
        """(nv, 2) vertices at the start, counter-clockwise block by block [length]."""
        return self._constant("model/vertices")

    @cached_property
    def rings(self) -> list[list[IntArray]]:
        """For each block its simple rings as indices of vertices: the outer one, then those of islands."""
        return split_outlines(self.vertices, self.vertex_offset)

    @property
    def edge_joint(self) -> IntArray:
        """(nv,) joint material of the edge that starts at the vertex; 0: a bridge to an island."""
        return self._constant("model/edge_joint")

    @property
    def block_material(self) -> IntArray:
        """(nb,) material number, from 1."""
        return self._constant("model/block_material")

    @property
    def parent(self) -> IntArray:
        """(nb,) block, from 0, that a cell was cut from (`&subdivide`); 0 ... nb-1 where no block was cut."""
        if "model/parent" in self:
            return self._constant("model/parent")
        return np.arange(len(self._constant("model/block_material")), dtype=np.int32)

    @property
    def stage_names(self) -> list[str]:
        """Names of the stages, in their order; one name without stages."""
        if "model/stage_names" not in self:
            return ["stage 1"]
        return [str(name) for name in self["model/stage_names"]]

    @property
    def block_area(self) -> FloatArray:
        """(nb,) at the start [length²]."""
        return self._constant("model/block_area")

    @property
    def block_centroid(self) -> FloatArray:
        """(nb, 2) at the start [length]."""
        return self._constant("model/block_centroid")

    @property
    def fixed_points(self) -> FloatArray:
        """(nf, 2) at the start [length]."""
        return self._constant("model/fixed_points")

    @property
    def loading_points(self) -> FloatArray:
        """(n, 2) at the start [length]."""
        return self._constant("model/loading_points")

    @property
    def measured_points(self) -> FloatArray:
        """(nm, 2) at the start [length]."""
        return self._constant("model/measured_points")

    @property
    def boundary_edges(self) -> IntArray:
        """(n, 2) edges that belong to boundaries: number of the boundary, from 0, and first vertex of the edge."""
        return self._or_none("boundary_edges", np.zeros((0, 2), dtype=np.int64))

    @property
    def boundary_ends(self) -> IntArray:
        """(n, 2) vertices at both ends of the edges of boundaries, counter-clockwise on their blocks."""
        first = self.boundary_edges[:, 1].astype(np.int64)
        offset = self._constant("model/vertex_offset")
        block = np.searchsorted(offset, first, side="right") - 1
        return np.stack([first, np.where(first + 1 < offset[block + 1], first + 1, offset[block])], axis=1)

    @property
    def bolt_ends(self) -> FloatArray:
        """(n, 2, 2) x y of both ends of the bolts at the start [length]; empty in files of older versions."""
        return self._or_none("bolt_ends", np.zeros((0, 2, 2)))

    @property
    def bolt_names(self) -> list[str]:
        """Names of the bolts where some have nodes, springs first; else empty."""
        return [str(name) for name in self["model/bolt_names"]] if "model/bolt_names" in self else []

    @property
    def bolt_first(self) -> IntArray:
        """(n + 1,) nodes before each of these bolts, of a spring its first end alone."""
        return self._or_none("bolt_first", np.zeros(1, dtype=np.int64))

    @property
    def liner_names(self) -> list[str]:
        """Names of the linings."""
        return [str(name) for name in self["model/liner_names"]] if "model/liner_names" in self else []

    @property
    def liner_first(self) -> IntArray:
        """(n + 1,) nodes before those of each lining."""
        return self._or_none("liner_first", np.zeros(1, dtype=np.int64))

    @property
    def liner_section(self) -> FloatArray:
        """(n, 5) thickness, compressive and tensile strength (infinite: none), 1: closed, 1 or -1: the opening lies to
        the left or the right of its line."""
        section = np.array(self._or_none("liner_section", np.zeros((0, 5))))
        section[:, 1:3][section[:, 1:3] > 1e300] = np.inf
        return section

    @property
    def bolt_blocks(self) -> IntArray:
        """(n, 2) the blocks that hold the ends of the bolts, from 0; -1 the fixed outside."""
        return self._or_none("bolt_blocks", np.zeros((0, 2), dtype=np.int64))

    @property
    def bolt_properties(self) -> FloatArray:
        """(n, 3) stiffness [force/length], pretension and strength (0: unlimited) [force]."""
        return self._or_none("bolt_properties", np.zeros((0, 3)))

    def _or_none(self, name: str, none: AnyArray) -> AnyArray:
        path = f"model/{name}"
        if path not in self._cache and path not in self:
            self._cache[path] = none
        return self._constant(path)
