# SPDX-License-Identifier: MIT
"""What a page shows of a model before any run, following its files: its parts, and the messages of `rockdda check`."""

from __future__ import annotations

import json
import re
import secrets
import subprocess
import threading
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from ..errors import InputError
from ..namelist import parse_groups
from ..plot.style import MATERIALS, PALETTE
from ..program import find_program
from ..text import read_text
from ..units import SYSTEMS
from .page import page

PATIENCE = 60.0  # s, for `rockdda check`
GROUP = re.compile(r"^\s*[&$](\w+)", re.M)
AT = re.compile(r"\bat \(?(-?[\d.]+(?:[eE][-+]?\d+)?), ?(-?[\d.]+(?:[eE][-+]?\d+)?)")
Groups = dict[str, list[dict[str, Any]]]


@dataclass
class ModelData:
    """One state of the files. What cannot be read is taken from the state before."""

    groups: Groups = field(default_factory=dict)
    lines_of_groups: list[tuple[int, str, int]] = field(default_factory=list)  # line, group, its number from 0
    geometry: dict[str, Any] = field(default_factory=dict)  # of the page
    places: list[tuple[float, float]] = field(default_factory=list)  # of the rows of the geometry file
    rows: list[int] = field(default_factory=list)  # their lines
    page: dict[str, Any] = field(default_factory=dict)


def model_files(path: Path) -> tuple[Path | None, Path | None]:
    """The labelled or options file and the geometry of a model: a folder, a labelled file, a geometry or block file."""
    if path.is_dir():
        options = sorted(path.glob("[!.]*.nml"))
        shapes = sorted([*path.glob("[!.]*.dc"), *path.glob("[!.]*.geo"), *path.glob("[!.]*.blk")])
        if not options and not shapes:
            raise InputError("a folder without a model (.nml, .dc or .blk)", path)
        options_file = options[0] if options else None
        named = _geometry_of(options_file)
        return options_file, named or (shapes[0] if shapes else None)
    if not path.is_file():
        raise InputError("no such file", path)
    if path.suffix.lower() == ".nml":
        named = _geometry_of(path)
        if named is None:
            raise InputError("has no group &model: name its geometry or the folder", path)
        return path, named
    return None, path


def _geometry_of(path: Path | None) -> Path | None:
    """The geometry that a labelled file names."""
    if path is None:
        return None
    named = re.search(r"^\s*&model\b[^/]*?\bgeometry\s*=\s*['\"]([^'\"]+)['\"]", read_text(path), re.M | re.I)
    return path.parent / named.group(1) if named else None


def read_model(path: Path, before: ModelData | None = None) -> ModelData:
    """Read the files as they are now."""
    options, geometry = model_files(path)
    found = ModelData()
    text = read_text(options) if options is not None else ""
    _take_groups(found, text, before)
    problems: list[dict[str, Any]] = []
    try:
        _take_geometry(found, geometry)
    except InputError as error:
        problems = [asdict(problem) for problem in error.problems]
        if before is not None:
            found.geometry, found.places, found.rows = before.geometry, before.places, before.rows
    told = _check(path)
    messages = problems
    if told is not None:
        # notes without a line state the numbers that the program has chosen
        messages = [e for e in told.get("messages", []) if e.get("severity") != "note" or e.get("line")]
    system = (told or {}).get("model", {}).get("units", "").partition(" ")[0]
    length = SYSTEMS[system][0] if system in SYSTEMS else ""
    found.page = found.geometry | {
        "file": str(options or geometry),
        "geometryFile": str(geometry or ""),
        "text": text.split("\n"),
        "length": f" {length}".rstrip(),
        "bolts": [*found.geometry.get("bolts", []), *_short([bolt["ends"] for bolt in (told or {}).get("bolts", [])])],
        "regions": _regions(found, told or {}),
        "boundaries": _boundaries(found),
        "liners": [_lining(found, entry) for entry in found.groups.get("liner", [])],
        "water": [
            {"name": str(entry.get("name", "")), "table": _pairs(entry.get("table", []))}
            for entry in found.groups.get("water", [])
        ],
        "stages": _stages(found),
        "messages": [_placed(found, entry, options, geometry) for entry in messages],
    }
    return found


def _take_groups(found: ModelData, text: str, before: ModelData | None) -> None:
    """Groups of the options and the lines where they begin; those of before while the text is broken."""
    try:
        groups = parse_groups(text)
    except (ValueError, InputError):
        groups = {} if before is None else dict(before.groups)
    found.groups = {name: value if isinstance(value, list) else [value] for name, value in groups.items()}
    count: dict[str, int] = {}
    for match in GROUP.finditer(text):
        name = match.group(1).lower()
        line = text.count("\n", 0, match.start(1)) + 1
        found.lines_of_groups.append((line, name, count.get(name, 0)))
        count[name] = count.get(name, 0) + 1


def _take_geometry(found: ModelData, path: Path | None) -> None:
    """Lines and blocks, cut in memory."""
    from ..cutting import Blocks
    from ..native import Session

    if path is None:
        raise InputError("no geometry is named")
    session = Session()
    session("cut_file", path, False)
    sizes, found_arrays = session.geometry()
    blocks = Blocks(session, was_cut=sizes["lines"] > 0)
    rows: list[Any] = [array.tolist() for array in found_arrays]
    _, lines, joints, material_lines, materials, bolts, _, fixed, loading, measured, holes = rows
    if not sizes["lines"]:
        fixed = [[*point, *point] for point in blocks.fixed_points.position.tolist()]
        loading, measured = blocks.loading_points.position.tolist(), blocks.measured_points.position.tolist()
        bolts = blocks.bolts.ends.tolist()
    corners = blocks.vertices if blocks.n_blocks else np.array(lines or [[0, 0, 1, 1]]).reshape(-1, 2)
    found.geometry = {
        "blocks": {
            "offset": blocks.vertex_offset.tolist(),
            "vertices": _short(blocks.vertices),
            "material": blocks.material.tolist(),
            "centroids": blocks.centroids.tolist(),
        },
        "lines": [[*line, joint] for line, joint in zip(_short(lines), joints, strict=True)],
        "boundaryLines": sizes["boundary"],
        "materialLines": [[*line, number] for line, number in zip(_short(material_lines), materials, strict=True)],
        "bolts": _short(bolts), "fixed": _short(fixed), "loading": _short(loading), "measured": _short(measured),
        "holes": _short(holes),
        "box": [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()],
    }  # fmt: skip
    sections = [lines, material_lines, bolts, fixed, loading, measured, holes]
    found.places = [_middle(row) for section in sections for row in section]
    if sizes["lines"]:
        rows_of_file = enumerate(read_text(path).split("\n"), start=1)
        found.rows = [k for k, row in rows_of_file if re.split(r"[#!]", row, maxsplit=1)[0].strip()][8:]
        if len(found.rows) != len(found.places):  # counts on one line, or the like
            found.rows = []


def _short(rows: Any) -> list[Any]:
    """Coordinates with seven digits, which are enough for a screen."""
    values = np.asarray(rows, dtype=float)
    return [[float(f"{x:.7g}") for x in row] for row in values.tolist()] if values.size else []


def _middle(row: list[float]) -> tuple[float, float]:
    return (row[0], row[1]) if len(row) < 4 else ((row[0] + row[2]) / 2, (row[1] + row[3]) / 2)


def _pairs(values: Any) -> list[list[float]]:
    """x1, y1, x2, y2, … as points; nothing where they are no pairs of numbers."""
    numbers = values if isinstance(values, list) else [values]
    if len(numbers) % 2 or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
        return []
    return [[float(x), float(y)] for x, y in zip(numbers[::2], numbers[1::2], strict=True)]


def _ring(entry: dict[str, Any]) -> list[list[float]]:
    """The outline of a region."""
    if "polygon" in entry:
        return _pairs(entry["polygon"])
    if "box" in entry and len(corners := _pairs(entry["box"])) == 2:
        (x1, y1), (x2, y2) = corners
        return [[x1, y1], [x2, y1], [x2, y2], [x1, y2]]
    circle = entry.get("circle")
    if isinstance(circle, list) and len(circle) == 3 and all(isinstance(x, int | float) for x in circle):
        angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
        x, y, radius = circle
        return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]).tolist()
    return []


def _regions(found: ModelData, told: dict[str, Any]) -> list[dict[str, Any]]:
    """Outlines of regions with the blocks (from 0) that the program finds in them."""
    blocks = {str(entry["name"]).lower(): entry["blocks"] for entry in told.get("regions", [])}
    return [
        {
            "name": (name := str(entry.get("name", ""))),
            "ring": _ring(entry),
            "blocks": [number - 1 for number in blocks.get(name.strip().lower(), [])],
        }
        for entry in found.groups.get("region", [])
    ]


def _boundaries(found: ModelData) -> list[dict[str, Any]]:
    return [
        {"kind": str(entry.get("kind", "")), "along": _pairs(entry.get("along", []))}
        for entry in found.groups.get("boundary", [])
    ]


def _lining(found: ModelData, entry: dict[str, Any]) -> dict[str, Any]:
    """Name and line of a lining: its own, that of its region, or that of the lining on which it lies."""

    def line_of(entry: dict[str, Any], depth: int = 0) -> list[list[float]]:
        if "along" in entry or depth > len(found.groups["liner"]):
            return _pairs(entry.get("along", []))
        word = "outline" if "outline" in entry else "on"
        others = found.groups.get("region" if word == "outline" else "liner", [])
        wanted = _names(entry.get(word, ""))[:1]
        other = next((one for one in others if _names(one.get("name", ""))[:1] == wanted), None)
        if other is None or not wanted:
            return []
        if word == "on":
            return line_of(other, depth + 1)
        ring = _ring(other)
        return [*ring, *ring[:1]]

    return {"name": str(entry.get("name", "")), "along": line_of(entry)}


def _names(value: Any) -> list[str]:
    """Names in a list: between commas, or several texts."""
    parts = value if isinstance(value, list) else str(value).split(",")
    return [str(part).strip().lower() for part in parts if str(part).strip()]


def _stages(found: ModelData) -> list[dict[str, Any]]:
    """Stages with what happens in them, and the line where each stands."""
    lines = {number: line for line, name, number in found.lines_of_groups if name == "stage"}
    return [
        {
            "name": str(entry.get("name", f"stage {k + 1}")),
            "excavate": _names(entry.get("excavate", "")),
            "place": _names(entry.get("place", "")),
            "water": str(entry["water"]).strip().lower() if "water" in entry else None,
            "words": ", ".join(f"{name} = {_word(value)}" for name, value in entry.items() if name != "name"),
            "line": lines.get(k),
        }
        for k, entry in enumerate(found.groups.get("stage", []))
    ]


def _word(value: Any) -> str:
    """A value as the file has it."""
    if isinstance(value, bool):
        return f".{str(value).lower()}."
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _check(path: Path) -> dict[str, Any] | None:
    """What `rockdda check` says; None where the program cannot be asked."""
    try:
        done = subprocess.run(
            [find_program(), "check", path, "--json"], capture_output=True, timeout=PATIENCE, check=False
        )
        told = json.loads(done.stdout)
    except (InputError, RuntimeError, OSError, ValueError, subprocess.TimeoutExpired):
        return None
    return told if isinstance(told, dict) else None


def _placed(found: ModelData, entry: dict[str, Any], options: Path | None, geometry: Path | None) -> dict[str, Any]:
    """A message with the place in the drawing that it is about, where there is one."""
    file, line = Path(str(entry.get("file") or "")).name, entry.get("line")
    place = None
    if line and geometry is not None and file == geometry.name and line in found.rows:
        place = found.places[found.rows.index(line)]
    elif line and options is not None and file == options.name:
        place = _place_of_group(found, line)
    if place is None and (match := AT.search(str(entry.get("message", "")))):
        place = (float(match.group(1)), float(match.group(2)))
    message = {name: entry.get(name) for name in ("severity", "message", "line", "column")}
    return message | {"file": file, "place": place, "isOptions": options is not None and file == options.name}


def _place_of_group(found: ModelData, line: int) -> tuple[float, float] | None:
    """The middle of what the group at a line of the options draws."""
    before = [row for row in found.lines_of_groups if row[0] <= line]
    if not before:
        return None
    _, name, number = before[-1]
    entries = found.groups.get(name, [])
    if number >= len(entries):
        return None
    entry = entries[number]
    points = _ring(entry) if name == "region" else _pairs(entry.get({"boundary": "along"}.get(name, "table"), []))
    if not points or name not in ("region", "boundary", "water"):
        return None
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    return float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2


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
        setup = {"model": self._data.page, "version": self.version, "palette": PALETTE, "materials": MATERIALS}
        return page(self.path.name or str(self.path), setup, "model")
