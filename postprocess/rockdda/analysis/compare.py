# SPDX-License-Identifier: MIT
"""The first differences between two runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..arrays import AnyArray, BoolArray, FloatArray
from ..results import Results
from ..storage.tables import names_in

__all__ = ["Comparison", "Difference", "compare"]

HISTORY = names_in("history", "")
FRAMES = [name for name in names_in("frames", "") if not name.startswith("contact_")]
BOUNDARY_FORCE = "history/boundary_force"
MODEL, MODEL_BOLTS = names_in("model", ""), names_in("model", "bolts")
BOLTS = names_in("frames", "bolts")
CONTACTS = ("blocks", "state", "point", "force")
JOINT_COLUMNS = [name.removeprefix("contact_") for name in names_in("frames", "joints")]  # not in files of version 1


@dataclass
class Difference:
    """The first place where a dataset differs, and the largest difference in it."""

    dataset: str
    message: str
    step: int | None = None  # of the first difference
    time: float | None = None
    index: tuple[int, ...] = ()  # within the row, from 0
    block: int | None = None  # from 1, as in the input files
    first: Any = None  # the two values there
    second: Any = None
    largest: float | None = None  # anywhere in the dataset
    relative: float | None = None  # the same over the largest value of the dataset


@dataclass
class Comparison:
    """Datasets compared, and differences, the earliest first."""

    same: bool
    tolerance: float
    compared: list[str] = field(default_factory=list)
    differences: list[Difference] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return asdict(self)


def compare(
    a: Results, b: Results, tolerance: float = 0.0, progress: Callable[[int, int], None] | None = None
) -> Comparison:
    """Compare models, histories, frames and contacts of two runs.

    `tolerance` is relative to the largest value of a dataset in either run; 0 requires the same bits. Numbers of steps,
    states and the like must always agree. Attributes (when a run was made, why it ended) and input texts do not count.
    """
    result = Comparison(True, tolerance)
    bolts = all(f"model/{name}" in results for name in MODEL_BOLTS for results in (a, b))  # not in older files
    for name in (*MODEL, *(MODEL_BOLTS if bolts else ())):
        path = f"model/{name}"
        result.compared.append(path)
        _add(
            result, _table(path, a, b, tolerance, None, a.vertex_offset if name in ("vertices", "edge_joint") else None)
        )
    if any(d.dataset in ("model/vertex_offset", "model/block_area") and d.largest is None for d in result.differences):
        return _sorted(result)  # other blocks: nothing else can be compared
    times = {"history": _clock(a, "history"), "frames": _clock(a, "frames")}
    forces = ("boundary_force",) if all(BOUNDARY_FORCE in results for results in (a, b)) else ()  # not in older files
    history = (*HISTORY, *forces)
    total, done = len(history) + len(FRAMES) + len(BOLTS) * bolts + len(CONTACTS), 0
    for group, names in (("history", history), ("frames", (*FRAMES, *(BOLTS if bolts else ())))):
        for name in names:
            path = f"{group}/{name}"
            result.compared.append(path)
            offset = a.vertex_offset if name == "vertices" else None
            _add(result, _table(path, a, b, tolerance, times[group], offset))
            done += 1
            if progress is not None:
                progress(done, total)
    result.compared += [f"frames/contact_{name}" for name in CONTACTS]
    _add(result, _contacts(a, b, tolerance, times["frames"]))
    if progress is not None:
        progress(total, total)
    return _sorted(result)


def _clock(results: Results, group: str) -> tuple[AnyArray, AnyArray]:
    return results[f"{group}/step"], results[f"{group}/time"]


def _add(result: Comparison, found: Difference | None) -> None:
    if found is not None:
        result.differences.append(found)
        result.same = False


def _sorted(result: Comparison) -> Comparison:
    """The model first, then by step; of the same step, the order of the datasets."""
    result.differences.sort(
        key=lambda d: -1 if d.dataset.startswith("model") else 1 << 62 if d.step is None else d.step
    )
    return result


def _beyond(x: AnyArray, y: AnyArray, tolerance: float, scale: float) -> tuple[BoolArray, FloatArray]:
    """Values that differ by more than allowed (NaN in both counts as equal), and by how much."""
    if x.dtype.kind in "iu" and y.dtype.kind in "iu":
        gap = np.abs(x.astype(np.int64) - y.astype(np.int64)).astype(float)
        return gap > 0, gap
    with np.errstate(invalid="ignore"):
        gap = np.abs(x - y)
    same = (x == y) | (np.isnan(x) & np.isnan(y))
    gap = np.where(same, 0.0, np.where(np.isnan(gap), np.inf, gap))
    return ~same & (gap > tolerance * scale), gap


def _table(
    path: str, a: Results, b: Results, tolerance: float,
    clock: tuple[AnyArray, AnyArray] | None, offset: AnyArray | None,
) -> Difference | None:  # fmt: skip
    """The difference of one dataset, read in pieces."""
    group = path.partition("/")[0]
    n_a, n_b = (_length(results, path, group) for results in (a, b))
    shape_a, shape_b = a.rows(path, 0, 1).shape[1:], b.rows(path, 0, 1).shape[1:]
    if (clock is None and n_a != n_b) or shape_a != shape_b:
        texts = (f"{(n_a, *shape_a)}", f"{(n_b, *shape_b)}")
        return Difference(path, f"shapes differ: {texts[0]} and {texts[1]}", first=texts[0], second=texts[1])
    n = min(n_a, n_b)
    piece = max(1, 4_000_000 // max(1, int(np.prod(shape_a))))
    scale = 0.0
    if tolerance > 0:
        for begin in range(0, n, piece):
            for results in (a, b):
                values = results.rows(path, begin, min(begin + piece, n))
                if values.dtype.kind == "f" and np.isfinite(values).any():
                    scale = max(scale, float(np.abs(values[np.isfinite(values)]).max()))
    found: Difference | None = None
    largest, highest = 0.0, 0.0
    for begin in range(0, n, piece):
        x, y = (results.rows(path, begin, min(begin + piece, n)) for results in (a, b))
        differs, gap = _beyond(x, y, tolerance, scale)
        if x.size:
            highest = max(highest, float(np.nanmax(np.abs(x.astype(float)), initial=0.0)))
        if not differs.any():
            continue
        largest = max(largest, float(gap.max()))
        if found is None:
            row = int(np.flatnonzero(differs.reshape(len(x), -1).any(axis=1))[0])
            inner = np.unravel_index(int(np.argmax(np.where(differs[row], gap[row], -1))), gap[row].shape)
            index = tuple(int(i) for i in inner)
            found = _difference(path, begin + row, index, x[row][index], y[row][index], clock, offset)
    if found is not None:
        found.largest, found.relative = largest, largest / highest if highest else None
        return found
    if n_a != n_b:
        what = "steps" if group == "history" else "frames"
        step, time = _when(clock, n - 1) if n else (None, None)
        if path.endswith("/step"):  # once for each group is enough
            message = f"{n_a} and {n_b} {what}; what both have agrees"
            return Difference(path, message, step, time, first=n_a, second=n_b)
    return None


def _length(results: Results, path: str, group: str) -> int:
    if group == "history":
        return results.n_steps
    if group == "frames":
        return results.n_frames
    return len(results[path])


def _when(clock: tuple[AnyArray, AnyArray] | None, row: int) -> tuple[int | None, float | None]:
    if clock is None or row >= len(clock[0]):
        return None, None
    return int(clock[0][row]), float(clock[1][row])


def _difference(
    path: str, row: int, index: tuple[int, ...], x: Any, y: Any,
    clock: tuple[AnyArray, AnyArray] | None, offset: AnyArray | None,
) -> Difference:  # fmt: skip
    step, time = _when(clock, row)
    place = (row, *index) if clock is None else index
    block, where = None, ""
    per_block = path.startswith("frames/") or path.startswith("model/block")
    if offset is not None and place:
        block = int(np.searchsorted(offset, place[0], side="right"))
    elif path.startswith(("frames/bolt", "model/bolt")):
        where = f", bolt {place[0] + 1}" if place else ""
    elif per_block and place:
        block = place[0] + 1
    when = f"step {step}, time {time:.6g}" if step is not None else "the model"
    where = f", block {block}" if block is not None else where
    inner = f"array index [{', '.join(map(str, place))}]:" if place else ""
    message = f"{when}{where}{', ' + inner if inner else ':'} {_shown(x)} and {_shown(y)}"
    return Difference(path, message, step, time, place, block, _native(x), _native(y))


def _shown(value: Any) -> str:
    return repr(_native(value))


def _native(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _contacts(a: Results, b: Results, tolerance: float, clock: tuple[AnyArray, AnyArray]) -> Difference | None:
    """The first frame whose contacts differ in number, blocks, state, place or force."""
    frames = min(a.n_frames, b.n_frames)
    for k in range(frames):
        x, y = a.frames[k].contacts, b.frames[k].contacts
        step, time = _when(clock, k)
        if len(x) != len(y):
            message = f"step {step}, time {time:.6g}: {len(x)} and {len(y)} contacts"
            return Difference("frames/contacts", message, step, time, first=len(x), second=len(y))
        of_joints = JOINT_COLUMNS if x.length is not None and y.length is not None else ()
        for name in (*CONTACTS, *of_joints):
            u, v = getattr(x, name), getattr(y, name)
            scale = float(max(np.abs(u).max(initial=0.0), np.abs(v).max(initial=0.0)))
            differs, gap = _beyond(u, v, tolerance, scale)
            if differs.any():
                place = np.unravel_index(int(np.argmax(np.where(differs, gap, -1))), gap.shape)
                row, index = int(place[0]), tuple(int(i) for i in place)
                block, other = (int(i) + 1 for i in x.blocks[row])
                message = (
                    f"step {step}, time {time:.6g}, block {block} against block {other}: "
                    f"{_shown(u[index])} and {_shown(v[index])}"
                )
                largest = float(gap.max())
                return Difference(
                    f"frames/contact_{name}", message, step, time, index, block, _native(u[index]), _native(v[index]),
                    largest, largest / scale if scale else None,
                )  # fmt: skip
    return None
