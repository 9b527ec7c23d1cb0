# SPDX-License-Identifier: MIT
"""Models in a folder, runs of the program on them, and what it found."""

from __future__ import annotations

import itertools
import json
import math
import os
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).resolve().parents[2]
G = 9.81
Points = npt.NDArray[np.float64]
#: a run of a small model takes less than a second; where two cores are shared by many processes, some
TIMEOUT = 120.0


class Fault(Exception):
    """What the program found is not what the oracle says."""


class Unsuited(Exception):
    """A model that was drawn has no answer to compare with."""


def find_program() -> Path | None:
    """The program: named by the environment, or of the build tree."""
    named = os.environ.get("ROCKDDA_PROGRAM") or os.environ.get("ROCKDDA")
    program = Path(named) if named else ROOT / "build" / "bin" / "rockdda"
    return program.resolve() if program.is_file() else None


def require(holds: bool, words: str) -> None:
    if not holds:
        raise Fault(words)


def compare(what: str, found: float, truth: float, low: float, high: float | None = None) -> None:
    """A positive or negative quantity lies between (1 - low) and (1 + high) times its truth."""
    high = low if high is None else high
    share = found / truth - 1
    require(math.isfinite(share) and -low <= share <= high, f"{what} {found:.5g}, the oracle says {truth:.5g}")


# -- models ----------------------------------------------------------------------------------------------------------


def box(x: float, y: float, width: float, height: float) -> Points:
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


def turned(points: Points, degrees: float, about: Sequence[float] = (0.0, 0.0)) -> Points:
    """Points turned counter-clockwise."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    center = np.asarray(about, dtype=float)
    return (np.asarray(points, dtype=float) - center) @ np.array([[c, s], [-s, c]]) + center


def area_of(points: Points) -> float:
    x, y = (points - points[0]).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def centroid_of(points: Points) -> Points:
    local = points - points[0]
    x, y = local.T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    return points[0] + np.array([((x + u) * cross).sum(), ((y + v) * cross).sum()]) / (3 * cross.sum())


def polar_of(points: Points) -> float:
    """Polar second moment of area about the centroid."""
    x, y = (points - centroid_of(points)).T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    return float(((x * x + x * u + u * u + y * y + y * v + v * v) * cross).sum() / 12)


@dataclass
class Model:
    """Blocks (or the lines of a geometry file) and the groups of the labelled file."""

    groups: list[str] = field(default_factory=list)
    blocks: list[Points] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)  #: of blocks; empty: 1
    joints: dict[tuple[int, int], int] = field(default_factory=dict)  #: of edges (block, edge) that are not of joint 1
    held: set[int] = field(default_factory=set)  #: blocks, from 0, that are held near their corners
    fixed: list[tuple[float, float, int]] = field(default_factory=list)  #: further fixed points: x, y, block from 0
    loading: list[tuple[float, float, int]] = field(default_factory=list)
    measured: list[tuple[float, float, int]] = field(default_factory=list)
    e0: float = 1e-4
    lines: str = ""  #: text of the geometry file, instead of blocks
    files: dict[str, str] = field(default_factory=dict)  #: tables beside the model

    @property
    def geometry(self) -> str:
        return "m.dc" if self.lines else "m.blk"

    def write(self, folder: Path, name: str = "m.nml") -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / self.geometry).write_text(self.lines or self._block_file())
        for other, text in self.files.items():
            (folder / other).write_text(text)
        path = folder / name
        path.write_text(f"&model geometry = '{self.geometry}', units = 'none' /\n" + "\n".join(self.groups) + "\n")
        return path

    def _block_file(self) -> str:
        fixed = list(self.fixed)
        for number in sorted(self.held):
            points = self.blocks[number]
            fixed += [(*(0.98 * points[k] + 0.02 * points.mean(0)), number) for k in range(len(points))]
        rows = ["rockdda-blocks 1", f"e0 {self.e0!r}", f"blocks {len(self.blocks)}"]
        rows += [f"vertices {sum(map(len, self.blocks))}", f"fixed {len(fixed)}", f"loading {len(self.loading)}"]
        rows += [f"measured {len(self.measured)}", "bolts 0"]
        for number, points in enumerate(self.blocks):
            material = self.materials[number] if self.materials else 1
            rows.append(f"block {number + 1} {material} {len(points)}")
            rows += [
                f"{float(x)!r} {float(y)!r} {self.joints.get((number, edge), 1)}" for edge, (x, y) in enumerate(points)
            ]
        for section, places in (
            ("fixed_points", fixed),
            ("loading_points", self.loading),
            ("measured_points", self.measured),
        ):
            rows += [section, *(f"{float(x)!r} {float(y)!r} {block + 1}" for x, y, block in places)]
        return "\n".join([*rows, "bolt_list", "end"]) + "\n"


def rock(number: int = 1, young: float = 1e10, poisson: float = 0.25, density: float = 2500.0, more: str = "") -> str:
    return f"&block_material number={number}, density={density!r}, young={young!r}, poisson={poisson!r}{more} /"


def joint(number: int = 1, friction: float = 35.0, more: str = "", **values: float) -> str:
    named = "".join(f", {name}={value!r}" for name, value in values.items())
    return f"&joint_material number={number}, friction={friction!r}{named}{more} /"


# -- runs ------------------------------------------------------------------------------------------------------------


@dataclass
class Run:
    """One call of the program."""

    code: int
    messages: str  #: standard error, and the log of a run
    output: str
    results: Path

    @property
    def summary(self) -> dict[str, Any]:
        try:
            return dict(json.loads(self.output))
        except ValueError as problem:
            raise Fault(f"the summary is no JSON: {self.output[:200]!r}") from problem

    def get(self, path: str) -> npt.NDArray[Any]:
        with h5py.File(self.results) as file:
            return np.asarray(file[path])

    def attribute(self, path: str, name: str) -> list[str]:
        with h5py.File(self.results) as file:
            values = file[path].attrs[name]
            return [value.decode() if isinstance(value, bytes) else str(value) for value in values]

    def energy(self) -> dict[str, npt.NDArray[np.float64]]:
        return dict(zip(self.attribute("history/energy", "columns"), self.get("history/energy").T, strict=True))

    def outlines(self, frame: int) -> list[Points]:
        offset = self.get("model/vertex_offset")
        with h5py.File(self.results) as file:
            vertices = np.asarray(file["frames/vertices"][frame])
        return [vertices[a:b] for a, b in itertools.pairwise(offset)]

    def moved(self, frame: int = -1) -> Points:
        """Displacement of the centroid of each block."""
        now, start = self.outlines(frame), self.outlines(0)
        return np.array([centroid_of(a) - centroid_of(b) for a, b in zip(now, start, strict=True)])

    def place_of(self, point: Sequence[float], block: int, frame: int = -1) -> Points:
        """Where the corner of a block nearest to a point of the start is now."""
        start = self.outlines(0)[block]
        corner = int(np.argmin(np.hypot(*(start - np.asarray(point)).T)))
        return self.outlines(frame)[block][corner]


class Bench:
    """A program and a folder for its models."""

    def __init__(self, program: Path, folder: Path) -> None:
        self.program = program
        self.folder = folder
        self.runs = 0

    def call(self, *arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
        self.runs += 1
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "ROCKDDA_PROGRAM": os.fspath(self.program)}
        place = folder or self.folder
        place.mkdir(parents=True, exist_ok=True)
        try:
            done = subprocess.run(
                [os.fspath(self.program), *arguments],
                cwd=place,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=TIMEOUT,
                env=environment,
                check=False,
            )
        except subprocess.TimeoutExpired as problem:
            raise Fault(f"{arguments[0]}: not done after {TIMEOUT:.0f} s") from problem
        if done.returncode not in (0, 2, 3, 4, 5):
            raise Fault(f"{arguments[0]}: exit {done.returncode}: {done.stderr.strip()[-200:]}")
        return done

    def run(self, model: Model, *arguments: str, name: str = "m", may_fail: bool = False) -> Run:
        """Run a model in a folder of that name; a run that is refused or does not end is a fault, but with may_fail."""
        place = self.folder / name
        model.write(place)
        done = self.call("run", "m.nml", "--force", "--json", "--threads", "1", *arguments, folder=place)
        if done.returncode and not may_fail:
            raise Fault(f"exit {done.returncode}: {_first_error(done.stderr)}")
        return Run(done.returncode, done.stderr, done.stdout, place / "m.h5")

    def check(self, model: Model, name: str = "m") -> Run:
        place = self.folder / name
        model.write(place)
        done = self.call("check", "m.nml", folder=place)
        return Run(done.returncode, done.stderr + done.stdout, done.stdout, place / "m.h5")

    def factor(self, model: Model, *arguments: str, name: str = "m") -> float:
        """What the search finds; nan when it is refused."""
        found = self.search(model, *arguments, name=name)
        if found.code == 3:
            return math.nan
        if found.code:
            raise Fault(f"fos: exit {found.code}: {_first_error(found.messages)}")
        return float(found.summary["factor"])

    def search(self, model: Model, *arguments: str, name: str = "m") -> Run:
        place = self.folder / name
        model.write(place)
        for left in place.glob("*.search*"):
            left.unlink()
        done = self.call("fos", "m.nml", "--force", "--json", "--threads", "1", *arguments, folder=place)
        return Run(done.returncode, done.stderr, done.stdout, place / "m.h5")


def _first_error(text: str) -> str:
    lines = [line for line in text.splitlines() if "error" in line] or text.strip().splitlines()[-1:]
    return lines[0][:200] if lines else "no message"


def deepest(outlines: Iterable[Points]) -> tuple[float, float, str]:
    """Of the pair that overlaps most: mean depth over the length of the overlap, share of the smaller one's area."""
    import shapely

    polygons = [shapely.Polygon(points) for points in outlines]
    crossed = [number for number, polygon in enumerate(polygons, start=1) if not polygon.is_valid]
    if crossed:
        return math.inf, 1.0, f"block {crossed[0]} crosses itself"
    worst = (0.0, 0.0, "")
    for i, j in zip(*shapely.STRtree(polygons).query(polygons), strict=True):
        if i < j:
            both = polygons[i].intersection(polygons[j])
            if both.area > 0:
                low_x, low_y, high_x, high_y = both.bounds
                depth = both.area / max(math.hypot(high_x - low_x, high_y - low_y), 1e-300)
                share = both.area / min(polygons[i].area, polygons[j].area)
                worst = max(worst, (depth, share, f"blocks {i + 1} and {j + 1}"))
    return worst
