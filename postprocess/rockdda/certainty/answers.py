# SPDX-License-Identifier: MIT
"""Answers of convergence and reliability that lie beside results of the same model."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .template import digest_of_texts

if TYPE_CHECKING:
    from ..results import Results

LARGEST = 100_000_000  # bytes of an answer


@dataclass(frozen=True)
class Answer:
    """One answer, as its JSON has it."""

    kind: str  #: "convergence" or "reliability"
    folder: Path
    found: dict[str, Any]  #: nothing where it is of another version of the model

    @property
    def picture(self) -> bytes:
        """Its picture; nothing where there is none."""
        try:
            return (self.folder / f"{self.kind}.png").read_bytes()
        except OSError:
            return b""


def answers_beside(results: Results) -> list[Answer]:
    """The answers in folders beside the results and in the current folder whose input is that of the results.

    One in the folder that the command takes for these results (NAME_convergence, NAME_reliability) is listed without
    its content where its input is another one.
    """
    digest = digest_of_texts(*(str(results[f"input/{name}"]) for name in ("geometry", "analysis", "config")))
    places = list(dict.fromkeys([results.path.parent.resolve(), Path.cwd()]))
    answers = []
    for kind in ("convergence", "reliability"):
        read = [(path.parent, _read(path)) for place in places for path in sorted(place.glob(f"*/{kind}.json"))]
        fitting = [Answer(kind, folder, found) for folder, found in read if found.get("input") == digest]
        stale = [Answer(kind, folder, {}) for folder, _ in read if folder.name == f"{results.name}_{kind}"]
        answers += (fitting or stale)[:1]
    return answers


def _read(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > LARGEST:
            return {}
        found = json.loads(path.read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError, RecursionError):
        return {}
