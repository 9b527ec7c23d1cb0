# SPDX-License-Identifier: MIT
"""Local pages that show a results file in the browser, also during the run, or two results side by side."""

from __future__ import annotations

import html
import json
import secrets
import threading
from importlib.resources import files
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np

from ..arrays import AnyArray
from ..errors import InputError
from ..frames import FIELDS, Frame, field_name
from ..results import Results
from ..units import Units
from .overlays import has_water, joint_entries, joint_range, joint_rows, water_of, widest
from .page import SHOWN_FIELDS, bolt_rows, colour_range, describe, filled, liner_rows, page, shown_fields, usual_range

MOST_JOINTS = 5  # the same of joints
MOST_SAMPLED = 25  # frames whose values make the colour scale of a long run


class Viewer:
    """Answers to the requests of the page. One results file, used by one request at a time."""

    def __init__(
        self, results: Results, field: str = "displacement", units: str | Units | None = None, paired: bool = False
    ) -> None:
        self.results, self.paired = results, paired
        self.units = Units.parse(units, results)
        self.fields = list(dict.fromkeys([field_name(field), *SHOWN_FIELDS]))
        self.shown = shown_fields(results, self.fields, self.units) if results.n_frames else {}
        self.joint_fields = [entry["name"] for entry in joint_entries(results, self.shown)] if self.shown else []
        self._lock = threading.Lock()
        self._joints: dict[int, dict[str, tuple[float, float, float, float]]] = {}
        self._limits: dict[str, dict[int, tuple[float, float, float, float]]] = {}
        self.token = secrets.token_urlsafe(24)

    def answer(self, path: str) -> tuple[str, bytes]:
        """Type and content for a path; KeyError for one that is not there."""
        parts = [unquote(part) for part in urlsplit(path).path.strip("/").split("/")]
        with self._lock:
            if parts == [""]:
                return "text/html; charset=utf-8", self._page().encode()
            if parts == ["state"]:
                return "application/json", json.dumps(self._state()).encode()
            if len(parts) == 2 and parts[0] == "limits" and parts[1] in FIELDS:
                return "application/json", json.dumps(self._range(parts[1])).encode()
            if len(parts) == 2 and parts[0] == "displacement":
                return self._floats(self._frame(parts[1]).shown_displacement)
            if len(parts) == 3 and parts[0] == "field" and parts[1] in FIELDS:
                return self._floats(self._factor(parts[1]) * self._frame(parts[2]).field(parts[1]))
            if len(parts) == 2 and parts[0] == "limits" and parts[1] in self.joint_fields:
                return "application/json", json.dumps(self._joint_range(parts[1])).encode()
            if len(parts) == 2 and parts[0] == "joints" and self.joint_fields:
                return self._floats(joint_rows(self._frame(parts[1]), self.shown))
            if len(parts) == 2 and parts[0] == "water" and has_water(self.results):
                return "application/json", json.dumps(water_of(self.results, self._frame(parts[1]))).encode()
            if len(parts) == 2 and parts[0] == "bolts":
                return self._floats(bolt_rows(self._frame(parts[1]), self.shown))
            if len(parts) == 2 and parts[0] == "liners":
                return self._floats(liner_rows(self._frame(parts[1]), self.shown))
            if len(parts) == 2 and parts[0] == "block":
                return "application/json", json.dumps(self._block(int(parts[1]))).encode()
        raise KeyError(path)

    def _floats(self, values: Any) -> tuple[str, bytes]:
        return "application/octet-stream", np.ascontiguousarray(values, dtype="<f4").tobytes()

    def _frame(self, text: str) -> Any:
        return self.results.frames[int(text)]

    def _state(self) -> dict[str, Any]:
        results = self.results
        results.refresh()  # also when it was complete: it may have been resumed
        running = not results.complete and results.exit_reason == "running"
        return {
            "times": results.times.tolist(),
            "steps": results.steps.tolist(),
            "frameStages": results.frame_stages.tolist(),
            "running": running,
            "state": f"running, step {results.n_steps}" if running else results.exit_reason,
        }

    def _page(self) -> str:
        state = self._state()
        if not state["times"]:
            raise InputError("there are no frames yet", self.results.path)
        title = self.results.title or self.results.name
        return page(
            title,
            describe(self.results, self.fields, self.units, shown=self.shown)
            | state
            | {"live": True, "paired": self.paired},
        )

    def _factor(self, name: str) -> float:
        """By which the numbers of a field are multiplied."""
        return self.shown[name][0] if name in self.shown else 1.0

    def _range(self, name: str) -> tuple[float, float, float, float]:
        """Smallest and largest value of a field, in some frames of a long run, else in all; then the usual range."""
        known = self._limits.setdefault(name, {})
        n = self.results.n_frames
        for k in np.unique(np.linspace(0, n - 1, min(n, MOST_SAMPLED)).round().astype(int)):
            if int(k) not in known:
                now = self.results.frames[int(k)]
                values = self._factor(name) * now.field(name)[now.active]
                usual = usual_range(values, self.results.block_area[now.active])
                known[int(k)] = (float(values.min()), float(values.max()), *usual)
        low, high, usual_low, usual_high = zip(*known.values(), strict=True)
        whole = min(low), max(high)
        return *whole, *colour_range(whole, (min(usual_low), max(usual_high)))

    def _joint_range(self, name: str) -> tuple[float, float, float, float]:
        """As `_range`, of a field of joints, in few frames: each has to be matched with its edges."""
        n = self.results.n_frames
        chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_JOINTS)).round().astype(int))
        for k in chosen.tolist():
            if k not in self._joints:
                rows = joint_rows(self.results.frames[k], self.shown)
                self._joints[k] = {field: joint_range(rows, field) for field in self.joint_fields}
        return widest([self._joints[k][name] for k in chosen.tolist()], name)

    def _block(self, block: int) -> dict[str, list[float]]:
        """All fields of one block (from 0) in all frames, in one answer."""
        if not 0 <= block < self.results.n_blocks:
            raise KeyError(block)
        now = _BlockInTime(self.results, block)
        return {
            name: (self._factor(name) * np.asarray(now.field(name), dtype=float)).tolist()
            for name in self.fields
            if name != "block"
        }


class _BlockInTime(Frame):
    """One block through all frames, in the shape of one frame with as many blocks."""

    def __init__(self, results: Results, block: int) -> None:
        super().__init__(results, 0)
        self.block = block
        self.results = SimpleNamespace(  # type: ignore[assignment]
            block_centroid=results.block_centroid[block],
            block_material=np.full(results.n_frames, results.block_material[block]),
            n_blocks=results.n_frames,
        )
        self._source = results

    def _stored(self, name: str, _: AnyArray | None = None) -> AnyArray:
        if name not in self._cache:
            self._cache[name] = self._source.block_rows(name, self.block)
        return self._cache[name]


class PairViewer:
    """Answers for two results, `a` and `b`, with common ranges of colours."""

    def __init__(self, first: Results, second: Results, field: str, units: str | Units | None = None) -> None:
        self.sides = {"a": Viewer(first, field, units, paired=True), "b": Viewer(second, field, units, paired=True)}
        self.sides["b"].shown = self.sides["a"].shown | {
            name: row for name, row in self.sides["b"].shown.items() if name not in self.sides["a"].shown
        }
        self.token = secrets.token_urlsafe(24)

    def answer(self, path: str) -> tuple[str, bytes]:
        """Type and content for a path; KeyError for one that is not there."""
        parts = [unquote(part) for part in urlsplit(path).path.strip("/").split("/")]
        if parts == [""]:
            names = " and ".join(side.results.title or side.results.name for side in self.sides.values())
            text = files("rockdda").joinpath("web", "pair.html").read_text(encoding="utf-8")
            return "text/html; charset=utf-8", filled(text, {"title": html.escape(names)}).encode()
        if parts[0] not in self.sides:
            raise KeyError(path)
        inner = "/" + "/".join(parts[1:])
        if parts[1:2] == ["limits"]:
            return "application/json", json.dumps(self._limits(inner)).encode()
        return self.sides[parts[0]].answer(inner)

    def _limits(self, path: str) -> list[float]:
        """The ranges of a field that hold for both; those of one side where the other does not have the field."""
        found = []
        for side in self.sides.values():
            try:
                found.append(json.loads(side.answer(path)[1]))
            except KeyError:
                continue
        if not found:
            raise KeyError(path)
        return [bound(row[k] for row in found) for k, bound in enumerate((min, max, min, max))]
