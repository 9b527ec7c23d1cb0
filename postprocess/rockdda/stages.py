# SPDX-License-Identifier: MIT
"""Stages of a run, what boundaries carry, and which blocks are there, as a results file holds them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import AnyArray, BoolArray, FloatArray
from .columns import Columns
from .errors import InputError
from .frames import Frame, FrameTables
from .storage.tables import names_in
from .text import did_you_mean

if TYPE_CHECKING:
    import pandas

#: Path of the forces of boundaries; files of versions without boundaries do not have it.
BOUNDARY_FORCE = "history/boundary_force"
#: Of the history; not in older files.
STAGE_TABLES = names_in("history", "stages")


@dataclass(frozen=True)
class Stage:
    """A stage as far as it has been computed."""

    index: int  # from 0
    name: str
    n_steps: int  # 0 where the run ended before it, or it was over at once
    first_step: int  # as in the column `step`; last_step + 1 without steps
    last_step: int
    begin: float  # times, of its start and of its last step
    end: float
    frames: tuple[int, ...]  # numbers of the frames that were saved in it
    unbalanced: float  # force at its last step; NaN in older files and without steps


class StageTables(FrameTables):
    """What `rockdda.Results` has of stages, boundaries and active blocks. Files of version 1 have one stage."""

    @property
    def stages(self) -> list[Stage]:
        """All stages of the model, in their order."""
        step, time = self["history/step"], self["history/time"]
        index = self.step_stages
        unbalanced, of_frames = self.unbalanced, self._frame_stages(step, index)
        found = []
        for k, name in enumerate(self.stage_names):
            begin, end = (int(row) for row in np.searchsorted(index, [k, k + 1]))
            there, last = end > begin, int(step[end - 1]) if end > 0 else 0
            found.append(
                Stage(
                    index=k,
                    name=name,
                    n_steps=end - begin,
                    first_step=int(step[begin]) if there else last + 1,
                    last_step=last,
                    begin=float(time[begin - 1]) if begin > 0 else 0.0,
                    end=float(time[end - 1]) if end > 0 else 0.0,
                    frames=tuple(np.flatnonzero(of_frames == k).tolist()) if there else (),
                    unbalanced=float(unbalanced[end - 1]) if there else float("nan"),
                )
            )
        return found

    def _frame_stages(self, step: AnyArray, index: AnyArray) -> AnyArray:
        """(nk,) stage of each frame."""
        if not len(index):
            return np.zeros(self.n_frames, dtype=int)
        rows = np.searchsorted(step, self["frames/step"])
        return np.asarray(index[np.minimum(rows, len(index) - 1)])

    @property
    def frame_stages(self) -> AnyArray:
        """(nk,) index of the stage of each frame; the start belongs to the first one."""
        return self._frame_stages(self["history/step"], self.step_stages)

    @property
    def step_stages(self) -> AnyArray:
        """(ns,) index of the stage of each step."""
        return np.asarray(self["history/stage"]) if "history/stage" in self else np.zeros(self.n_steps, dtype=int)

    def at_stage(self, stage: str | int) -> Frame:
        """The frame at the end of a stage, given by its name or index (negative: from the last one).

        Raises InputError for a stage that is not there, with a suggestion, and for one that has no frame."""
        chosen = self.stage(stage)
        if not chosen.frames:
            raise InputError(f"stage {chosen.name!r} has no frame: {chosen.n_steps} steps were computed", self.path)
        return self.frames[chosen.frames[-1]]

    def stage(self, stage: str | int) -> Stage:
        """A stage by its name (case and outer blanks do not count) or index."""
        stages = self.stages
        names = [entry.name.strip().lower() for entry in stages]
        if isinstance(stage, str):
            if stage.strip().lower() in names:
                return stages[names.index(stage.strip().lower())]
            hint = did_you_mean(stage, self.stage_names)
            raise InputError(
                f"there is no stage {stage!r}{hint} (the stages are: {', '.join(self.stage_names)})", self.path
            )
        if not -len(stages) <= stage < len(stages):
            raise InputError(f"there is no stage {stage}: there are {len(stages)}, from 0", self.path)
        return stages[stage]

    @property
    def unbalanced(self) -> FloatArray:
        """(ns,) largest resultant force on a block over the mean force, after each step; NaN in older files."""
        if "history/unbalanced" in self:
            return np.asarray(self["history/unbalanced"])
        return np.full(self.n_steps, np.nan)

    @property
    def active(self) -> BoolArray:
        """(nk, nb) blocks that are there in each frame: neither excavated nor still to be placed."""
        if "frames/active" in self:
            return np.asarray(self["frames/active"]).astype(bool)
        return np.ones((self.n_frames, len(self.block_material)), dtype=bool)

    @property
    def boundary_force(self) -> FloatArray:
        """(ns, n, 2) force of each boundary on the blocks, in the order of the groups `&boundary`."""
        if BOUNDARY_FORCE in self:
            return np.asarray(self[BOUNDARY_FORCE])
        return np.zeros((self.n_steps, 0, 2))

    @property
    def boundary_kinds(self) -> list[str]:
        """(n,) 'fixed', 'roller', 'moving', 'traction', 'viscous', 'free_field', in the order of groups `&boundary`."""
        if "model/boundary_edges" not in self:
            return []
        return [str(kind).strip() for kind in self.attribute("model/boundary_edges", "kind")]

    def boundary_forces(self) -> pandas.DataFrame:
        """A row for each stage and boundary: stage, boundary (from 1), kind, and the force on the blocks at the end of
        the stage, force_x and force_y. Stages without steps are left out."""
        return self.boundary_columns().to_pandas("a table of boundaries")

    def boundary_columns(self) -> Columns:
        """The columns of `boundary_forces`, as arrays."""
        force, kinds, step = self.boundary_force, self.boundary_kinds, self["history/step"]
        rows: list[tuple[Any, ...]] = []
        for stage in self.stages:
            if stage.n_steps:
                last = force[int(np.searchsorted(step, stage.last_step))].tolist()
                for number, (kind, both) in enumerate(zip(kinds, last, strict=True), start=1):
                    rows.append((stage.name, number, kind, *both))
        names = ("stage", "boundary", "kind", "force_x", "force_y")
        types: tuple[Any, ...] = (object, np.int64, object, np.float64, np.float64)
        columns = list(zip(*rows, strict=True)) or [()] * len(names)
        return Columns({n: np.array(c, dtype=t) for n, c, t in zip(names, columns, types, strict=True)})
