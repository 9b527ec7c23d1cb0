# SPDX-License-Identifier: MIT
"""Two results side by side in the browser: two pages of the viewer that show the same moment, field and section."""

from __future__ import annotations

import html
import json
import secrets
from importlib.resources import files
from urllib.parse import unquote, urlsplit

from ..results import Results
from ..units import Units
from .page import filled
from .viewer import Viewer


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
