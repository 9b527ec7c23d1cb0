# SPDX-License-Identifier: MIT
"""Answers to the page that shows a model before any run and follows its files."""

from __future__ import annotations

import html
import json
import secrets
import threading
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from ..plot.style import MATERIALS, PALETTE
from .model_data import ModelData, model_files, read_model
from .page import filled

Stamp = tuple[tuple[str, int, int], ...]


class ModelViewer:
    """Reads the files of a model again when one of them has changed. Used by one request at a time."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.token = secrets.token_urlsafe(24)
        self._lock = threading.Lock()
        self._data: ModelData | None = None
        self._stamp: Stamp = ()
        self.version = 0
        model_files(path)  # an error at once for what is no model
        self._refresh()  # and where the compiled part is missing

    def answer(self, path: str) -> tuple[str, bytes]:
        """Type and content for a path; KeyError for one that is not there."""
        parts = urlsplit(path).path.strip("/").split("/")
        with self._lock:
            if parts == [""]:
                return "text/html; charset=utf-8", self._page().encode()
            if len(parts) == 2 and parts[0] == "state":
                self._refresh()
                news: dict[str, Any] = {"version": self.version}
                if parts[1] != str(self.version):
                    assert self._data is not None
                    news["model"] = self._data.page
                return "application/json", json.dumps(news).encode()
        raise KeyError(path)

    def _refresh(self) -> None:
        """Read the files when they are others than before. An editor may just be replacing one."""
        stamp = self._stamps()
        if self._data is None or stamp != self._stamp:
            self._data = read_model(self.path, self._data)
            self._stamp, self.version = stamp, self.version + 1

    def _stamps(self) -> Stamp:
        """Names, times and sizes of the files in the folder that a model may consist of."""
        folder = self.path if self.path.is_dir() else self.path.parent
        found = []
        for path in sorted(folder.iterdir()):
            if path.suffix.lower() in (".nml", ".dc", ".geo", ".blk", ".df", ".csv", ".txt"):
                try:
                    state = path.stat()
                except OSError:
                    continue
                found.append((path.name, state.st_mtime_ns, state.st_size))
        return tuple(found)

    def _page(self) -> str:
        self._refresh()
        assert self._data is not None
        web = files("rockdda").joinpath("web")
        setup = {
            "model": self._data.page,
            "version": self.version,
            "palette": list(PALETTE),
            "materials": list(MATERIALS),
        }
        parts = {
            "title": html.escape(self.path.name or str(self.path)),
            "css": web.joinpath("player.css").read_text(encoding="utf-8"),
            "script": web.joinpath("model.js").read_text(encoding="utf-8"),
            "setup": json.dumps(setup, separators=(",", ":")).replace("<", "\\u003c"),
        }
        return filled(web.joinpath("model.html").read_text(encoding="utf-8"), parts)
