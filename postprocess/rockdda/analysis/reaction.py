# SPDX-License-Identifier: MIT
"""Ground reaction and support characteristic of an excavation: how far rock and lining share the load.

Two runs of one model. *Without support* the forces of the excavated blocks are released in equal parts, each until
equilibrium; what is still held, as a share of the pressure in the ground, over the convergence is the ground reaction.
*With support* the model runs as it is. Its lining presses on the rock with the mean of its axial force over its radius,
as a thin ring does: the support characteristic, from the convergence at which the lining was placed. Round and in
continuous ground, rock and lining are in equilibrium where both curves meet. Elsewhere the pressure is no more than a
mean, and one point does not move as the others do: how far the end of the run is from the crossing says how much that
matters.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..groups import as_list
from ..model import Model
from ..plot.ground_reaction import ground_reaction_data
from ..results import Results
from ..text import PathLike
from ..units import Units

__all__ = ["Reaction", "support_reaction"]

Stages = list[dict[str, Any]]
ROUND = 0.1  # of the radius: a line that is farther from a circle in the mean is no arc


@dataclass(frozen=True, repr=False)
class Reaction:
    """Both curves. Convergences are those of one measured point since the excavation [length], pressures [stress]."""

    title: str
    units: Units
    liner: str
    point: int  #: number of the measured point, from 1
    radius: float  #: of the lining [length]
    ground_pressure: float  #: mean stress across the line of the lining before the excavation
    ground: FloatArray  #: (n, 2) convergence, held share of the pressure: without support, at equilibrium
    support: FloatArray  #: (m, 2) convergence, pressure of the lining over that in the ground; from its placing on

    @property
    def crossing(self) -> tuple[float, float] | None:
        """Convergence and share where the ground reaction meets the characteristic, which is drawn out as a straight
        line; None where they do not meet."""
        (u0, _), (u1, p1) = self.support[0], self.support[-1]
        if not u1 > u0:
            return None
        apart = self.ground[:, 1] - p1 * (self.ground[:, 0] - u0) / (u1 - u0)
        for k in np.flatnonzero((apart[:-1] >= 0) & (apart[1:] < 0)):
            part = apart[k] / (apart[k] - apart[k + 1])
            u, p = self.ground[k] + part * (self.ground[k + 1] - self.ground[k])
            return float(u), float(p)
        return None

    def plot(self, **options: Any) -> Any:
        """Both curves with their crossing; the axes."""
        from ..plot.ground_reaction import reaction_picture

        return reaction_picture(self, **options)

    def __str__(self) -> str:
        def told(at: Any) -> str:
            length, unit = self.units.multiple("length", float(at[0]))
            pressure = self.units.text(float(at[1]) * self.ground_pressure, "stress")
            return f"{length * at[0]:.4g} {unit}, {100 * at[1]:.3g} % ({pressure})"

        rows = [
            f"pressure in the ground at the lining  {self.units.text(self.ground_pressure, 'stress')}",
            f"radius of the lining                  {self.units.text(self.radius, 'length')}",
            f"placed at                             {told(self.support[0])}",
            f"end of the run with support           {told(self.support[-1])}",
            f"crossing of both curves               {told(self.crossing) if self.crossing else 'none'}",
            f"without support                       {told(self.ground[-1])}",
        ]
        return "\n".join(rows)

    def __repr__(self) -> str:
        return f"<rockdda.analysis.reaction.Reaction of {self.liner!r}: {len(self.ground)} points of the ground>"


def support_reaction(
    model: Model | PathLike, *, liner: str | None = None, point: int = 1, releases: int = 10,
    work: PathLike | None = None, progress: Callable[[str], None] | None = None, **options: Any,
) -> Reaction:  # fmt: skip
    """Compute both curves of a model whose stages excavate, and place a lining, once.

    `liner` is the name of the lining (by default the first that a stage installs), `point` the number of the measured
    point whose convergence counts, `releases` the number of parts in which the forces are released without support.
    `work` keeps the two runs (bare.h5, supported.h5). `progress` is given what runs; `options` go to `rockdda.run`."""
    if releases < 2:
        raise InputError(f"releases: expected 2 or more, found {releases}")
    given = model if isinstance(model, Model) else Model.read(model)
    name, dig, last = _stage_of(given, liner)
    n_points = len(given._measured)
    if not 1 <= point <= n_points:
        raise InputError(f"there is no measured point {point}; there are {n_points}")
    with TemporaryDirectory() as folder:
        place = Path(folder if work is None else work)
        place.mkdir(parents=True, exist_ok=True)
        runs = []
        models = {"bare": _bare(given, dig, releases), "supported": _cut(given, _stages(given)[: last + 1])}
        for kind, made in models.items():
            if progress is not None:
                progress(f"run {'without' if kind == 'bare' else 'with'} support")
            runs.append(made.run(output=place / f"{kind}.h5", save_every=1, force=True, **options))
        bare, supported = runs
        try:
            return _reaction(bare, supported, name, dig, point)
        finally:
            bare.close()
            supported.close()


def _names(value: Any) -> list[str]:
    return [part.strip().lower() for part in str(value or "").split(",") if part.strip()]


def _stages(model: Model) -> Stages:
    return [dict(stage) for stage in as_list(model.options.get("stage", []))]


def _stage_of(model: Model, liner: str | None) -> tuple[str, int, int]:
    """Name of the lining, index of the stage that excavates before or with its placing, and of the last one before the
    next excavation."""
    stages = _stages(model)
    given = [str(group.get("name", "")) for group in as_list(model.options.get("liner", []))]
    linings = {name.strip().lower(): name for name in given}
    if liner is not None and liner.strip().lower() not in linings:
        raise InputError(f"there is no lining {liner!r}; the linings are: {', '.join(linings.values()) or 'none'}")
    wanted = linings if liner is None else [liner.strip().lower()]
    placed = [(k, name) for k, stage in enumerate(stages) for name in _names(stage.get("install")) if name in wanted]
    if not placed:
        raise InputError("no stage installs a lining: the characteristic begins where one is placed")
    at, name = placed[0]
    digs = [k for k, stage in enumerate(stages) if _names(stage.get("excavate"))]
    before = [k for k in digs if k <= at]
    if not before:
        raise InputError(f"no stage excavates before {linings[name]!r} is placed")
    after = [k for k in digs if k > at]
    return linings[name], before[-1], (after[0] if after else len(stages)) - 1


def _cut(model: Model, stages: Stages) -> Model:
    """A copy of the model with other stages; changes of stages that are gone go."""
    made = copy.deepcopy(model)
    made.options["stage"] = stages
    kept = {name for stage in stages for name in _names(stage.get("name"))}
    if "change" in made.options:
        changes = [one for one in as_list(made.options["change"]) if _names(one.get("stage"))[0] in kept]
        made.options["change"] = changes
    return made


def _bare(model: Model, dig: int, releases: int) -> Model:
    """The model without what is installed from the excavation on; its forces are released in equal parts."""
    stages = _stages(model)
    gone = {name for stage in stages[dig:] for name in _names(stage.get("install"))}
    like = {key: value for key, value in stages[dig].items() if key not in ("name", "excavate", "relax", "install")}
    like |= {"kind": "static", "until": "equilibrium"}
    for key in ("duration", "until_time", "until_step"):
        like.pop(key, None)
    parts = [{**like, "name": f"release {k}", "relax": k / releases} for k in range(1, releases + 1)]
    parts[0]["excavate"] = stages[dig]["excavate"]
    for part in parts[1:]:
        for key in ("place", "release", "reset_displacement", "remove"):
            part.pop(key, None)
    made = _cut(model, stages[:dig] + parts)
    for group in ("bolt", "liner"):
        for _ in range(2):  # what lies on a lining that is gone goes, too
            kept = [one for one in as_list(made.options.get(group, [])) if not gone & {*_names(one.get("name"))}]
            lost = [one for one in kept if group == "liner" and gone & {*_names(one.get("on"))}]
            gone |= {name for one in lost for name in _names(one.get("name"))}
            made.options[group] = kept
        if not made.options[group]:
            del made.options[group]
    return made


def _reaction(bare: Results, supported: Results, name: str, dig: int, point: int) -> Reaction:
    numbers = list(supported.point_numbers("measured"))
    if point not in numbers:
        raise InputError(f"the measured point {point} lies in no block", supported.path)
    column = numbers.index(point)
    stage = bare.stage_names[dig]
    share, moved, ends = ground_reaction_data(bare, stage)
    ground = np.column_stack([moved[ends, column], 1 - share[ends]])
    _, moved, _ = ground_reaction_data(supported, supported.stage_names[dig])
    steps = supported["history/step"]
    first = int(np.flatnonzero(supported["history/stage"] >= dig)[0])
    k = [one.strip().lower() for one in supported.liner_names].index(name.strip().lower())
    rows, force, line = [], [], np.zeros((0, 2))
    for index in range(supported.n_frames):
        now = supported.frames[index]
        pieces = now.liner_pieces
        pieces = pieces.rows((pieces["liner"] == k) & pieces["there"])
        if not pieces.n_rows or now.step == 0:
            continue
        ends_of = pieces.stack("x1", "y1", "x2", "y2")
        length = np.hypot(ends_of[:, 2] - ends_of[:, 0], ends_of[:, 3] - ends_of[:, 1])
        if not len(line):
            line = np.concatenate([ends_of[:, :2], ends_of[-1:, 2:]])
        rows.append(int(np.searchsorted(steps, now.step)) - first + 1)
        force.append(-float(pieces["N"] @ length / length.sum()))
    if not rows:
        raise InputError(f"the lining {name!r} is never there", supported.path)
    radius = _radius(line, name)
    pressure = _pressure_in_ground(supported, line, dig)
    begin = max(rows[0] - 1, 0)
    support = np.column_stack([
        np.concatenate([[moved[begin, column]], moved[rows, column]]),
        np.concatenate([[0.0], force]) / (radius * pressure),
    ])  # fmt: skip
    units = Units.parse(None, supported)
    return Reaction(supported.title or supported.name, units, name, point, radius, pressure, ground, support)


def _radius(line: FloatArray, name: str) -> float:
    """Radius of the circle that is nearest to a line, in the least squares of the distances' squares."""
    x, y = (line - line.mean(axis=0)).T
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones(len(x))]), x**2 + y**2, rcond=None)
    radius = float(np.sqrt(c + a**2 + b**2))
    away = float(np.sqrt(np.mean((np.hypot(x - a, y - b) - radius) ** 2)))
    turns = float(np.hypot(*(line[-1] - line[0]))) / radius
    if away > ROUND * radius or (turns < 0.2 and np.ptp(line, axis=0).max() < 0.2 * radius):
        raise InputError(f"the line of {name!r} is no arc: the pressure of a lining is its axial force over its radius")
    return radius


def _pressure_in_ground(results: Results, line: FloatArray, dig: int) -> float:
    """Mean pressure on a line, of the blocks beside it, before the stage that excavates."""
    index = 0 if dig == 0 else results.stages[dig - 1].frames[-1]
    now = results.frames[index]
    along = np.diff(line, axis=0)
    length = np.hypot(*along.T)
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
    middle = 0.5 * (line[1:] + line[:-1])
    place = now.centroid[now.active]
    near = [int(np.argmin(np.hypot(*(place - at).T))) for at in middle]
    sx, sy, txy = now.stress[now.active][near].T
    across = sx * normal[:, 0] ** 2 + sy * normal[:, 1] ** 2 + 2 * txy * normal[:, 0] * normal[:, 1]
    pressure = -float(across @ length / length.sum())
    if not pressure > 0:
        raise InputError("the ground beside the lining is not compressed before the excavation", results.path)
    return pressure
