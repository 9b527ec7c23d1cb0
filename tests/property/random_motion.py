# SPDX-License-Identifier: MIT
"""Random models with contact by length that nobody tuned, and what must hold of their motion whatever it is.

Pairs and clusters of polygons in flight, piles, walls and jointed slopes, of sizes from 1 cm to 1 km, with moduli from
1 MPa to 1 TPa, friction from 0 to 70°, joints from a tenth of E over the size to thirty times that, time steps from
a thousandth to a hundredth of the square root of the size. `tests/property/test_random_motion.py` runs some of them,
`scripts/campaign` as many as wanted.
"""

from __future__ import annotations

import itertools
import math
import os
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).resolve().parents[2]
G = 9.81
#: of the energy exchanged: what contacts may give (docs/theory.md, "Energy from nowhere")
GIVEN = 1e-3
#: columns of the energy that count as exchanged
EXCHANGED = ("kinetic", "strain", "gravity", "springs", "external_work", "friction", "numerical_dissipation")
FAMILIES = ("pairs", "pile", "slope", "cluster", "wall")
Points = npt.NDArray[np.float64]


@dataclass
class Sample:
    """A model in a folder, m.nml, and the numbers by which it is judged."""

    seed: int
    family: str
    size: float  #: of a block, about [m]
    modulus: float
    density: float
    friction: float
    blocks: list[Points] = field(default_factory=list)
    held: int = 0  #: so many of the first blocks are held
    stiffness: float = 0.0  #: of joints per length; 0: automatic
    height: float = 0.0  #: of the model
    gravity: float = G
    duration: float = 0.0
    step: float = 0.0

    @property
    def name(self) -> str:
        return f"{self.family}-{self.seed}"


def find_program() -> Path | None:
    """The program: named by the environment, or of the build tree."""
    named = os.environ.get("ROCKDDA_PROGRAM") or os.environ.get("ROCKDDA")
    program = Path(named) if named else ROOT / "build" / "bin" / "rockdda"
    return program.resolve() if program.is_file() else None


def call(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the program in a folder."""
    command = [str(find_program()), *arguments, "--quiet", "--force"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=600, env=environment, check=False
    )


# -- models ----------------------------------------------------------------------------------------------------------


def polygon(random: np.random.Generator, radius: float, aspect: float = 1.0) -> Points:
    """Three to eight corners on an ellipse, counter-clockwise about the origin."""
    n = int(random.integers(3, 9))
    while True:
        angles = np.sort(random.uniform(0, 2 * math.pi, n))
        if np.diff(np.r_[angles, angles[0] + 2 * math.pi]).max() < 2.6:
            break
    corners = radius * np.column_stack([np.cos(angles), np.sin(angles) / aspect])
    turn = random.uniform(0, math.pi)
    return corners @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])


def box(x: float, y: float, width: float, height: float) -> Points:
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


def make(seed: int, folder: Path, family: str = "") -> Sample:
    """The model of a seed, written into a folder."""
    random = np.random.default_rng(seed)
    family = family or FAMILIES[seed % len(FAMILIES)]
    size = float(10 ** random.uniform(-2, 3))
    modulus = float(10 ** random.uniform(6, 12))
    # rock that its own weight would crush is no model of rock
    density = min(2500.0, 1e-3 * modulus / (G * 12 * size))
    sample = Sample(seed, family, size, modulus, density, float(random.choice([0, 5, 15, 30, 45, 70])))
    if random.random() < 0.6:
        sample.stiffness = modulus / size * 10 ** random.uniform(-1, 1.5)
    sample.step = float(random.choice([0.001, 0.002, 0.005, 0.01])) * math.sqrt(size)
    {"pairs": _pairs, "cluster": _cluster, "pile": _pile, "wall": _wall, "slope": _slope}[family](
        sample, random, folder
    )
    return sample


def _fly(sample: Sample, random: np.random.Generator) -> list[str]:
    """Velocities of blocks in flight, a material for each."""
    sample.gravity, sample.duration = 0.0, 0.8 * math.sqrt(sample.size)
    speed = math.sqrt(sample.size)
    return [
        f", velocity = {random.uniform(-3, 3) * speed!r}, {random.uniform(-3, 3) * speed!r}, "
        f"{random.uniform(-3, 3) / speed!r}"
        for _ in sample.blocks
    ]


def _pairs(sample: Sample, random: np.random.Generator, folder: Path) -> None:
    """Ten pairs far from each other, each on a course of collision."""
    velocities = []
    sample.gravity, sample.duration = 0.0, 0.4 * math.sqrt(sample.size)
    speed = math.sqrt(sample.size)
    for pair in range(10):
        radii = sample.size * random.uniform(0.3, 1, 2)
        place = np.array([40 * pair * sample.size, 0.0])
        left = polygon(random, radii[0]) + place
        place += [radii.sum() + 0.2 * sample.size, random.uniform(-0.7, 0.7) * radii.sum()]
        right = polygon(random, radii[1]) + place
        sample.blocks += [left, right]
        for low, high in ((5, 20), (-5, 0)):
            velocities.append(
                f", velocity = {random.uniform(low, high) * speed!r}, 0, {random.uniform(-3, 3) / speed!r}"
            )
    _write(sample, folder, velocities)


def _cluster(sample: Sample, random: np.random.Generator, folder: Path) -> None:
    """Some blocks in flight, among them splinters."""
    aspect = float(random.choice([1, 3, 10, 50]))
    _strew(sample, random, int(random.integers(3, 9)), aspect, (-1.5, 1.5), (-1.5, 1.5))
    _write(sample, folder, _fly(sample, random))


def _pile(sample: Sample, random: np.random.Generator, folder: Path) -> None:
    """Blocks that fall on a floor, with walls or without."""
    sample.blocks = [box(-3, -0.5, 6, 0.5) * sample.size]
    if random.random() < 0.5:
        sample.blocks += [box(-3.5, -0.5, 0.5, 4.5) * sample.size, box(3, -0.5, 0.5, 4.5) * sample.size]
    sample.held = len(sample.blocks)
    aspect = float(random.choice([1, 1, 3, 10, 50]))
    _strew(sample, random, int(random.integers(5, 20)), aspect, (-2.3, 2.3), (0.8, 3.5))
    sample.duration = 0.4 * math.sqrt(sample.size)
    _write(sample, folder)


def _strew(
    sample: Sample,
    random: np.random.Generator,
    count: int,
    aspect: float,
    across: tuple[float, float],
    up: tuple[float, float],
) -> None:
    """Polygons at random places, where they meet no circle about another one that was strewn."""
    places: list[tuple[float, float, float]] = []
    for _ in range(40 * count):
        x, y, r = random.uniform(*across), random.uniform(*up), random.uniform(0.2, 0.7)
        if all(math.hypot(x - u, y - v) > r + s + 1e-3 for u, v, s in places):
            sample.blocks.append((polygon(random, r, aspect) + np.array([x, y])) * sample.size)
            places.append((x, y, r))
            if len(places) == count:
                return


def _wall(sample: Sample, random: np.random.Generator, folder: Path) -> None:
    """Courses of blocks on a floor."""
    sample.blocks, sample.held = [box(-3, -0.5, 9, 0.5) * sample.size], 1
    width = random.uniform(0.4, 1.2)
    height = width * float(random.choice([0.05, 0.2, 0.5, 1, 3]))
    for course in range(int(random.integers(2, 7))):
        x = (0.5 * width if course % 2 else 0.0) + random.uniform(-0.05, 0.05) * width * (random.random() < 0.5)
        for _ in range(int(random.integers(2, 5))):
            sample.blocks.append(box(x, course * height, width, height) * sample.size)
            x += width
    sample.duration = 0.2 * math.sqrt(sample.size)
    _write(sample, folder)


def _slope(sample: Sample, random: np.random.Generator, folder: Path) -> None:
    """Rock cut by two or three joint sets, free to the right; its weight comes at once, or it is there."""
    width, height = 12 * sample.size, 10 * sample.size
    text = f"&lines seed = {random.integers(1, 10**6)} /\n&boundary window = 0,0, {width!r},{height!r} /\n"
    angle = random.uniform(0, 180)
    for _ in range(int(random.integers(2, 4))):
        angle = (angle + random.uniform(25, 90)) % 180
        spacing = math.sqrt(width * height) * random.uniform(0.12, 0.4)
        text += f"&joint_set inclination = {angle:.5g}, spacing = {spacing:.6g}"
        text += f", randomness = {random.uniform(0, 0.5):.3g}"
        if random.random() < 0.5:
            text += (
                f", trace = {spacing * random.uniform(1.5, 6):.6g}, bridge = {spacing * random.uniform(0.1, 0.8):.6g}"
            )
        text += " /\n"
    (folder / "m.dl").write_text(text)
    for command in (("lines", "m.dl", "-o", "m.dc"), ("cut", "m.dc", "-o", "m.blk")):
        done = call(folder, *command)
        if done.returncode:
            raise RuntimeError(done.stderr)
    sample.height, sample.duration = height, 0.2 * math.sqrt(sample.size)
    extra = f"&boundary along = 0,0, {width!r},0, kind = 'fixed' /\n"
    extra += f"&boundary along = 0,0, 0,{height!r}, kind = 'roller' /\n"
    if random.random() < 0.6:
        extra += f"&in_situ surface = {height!r}, k0 = {random.choice([0.3, 0.5, 1, 2])} /\n"
    _write_options(sample, folder, [""], extra)


def _write(sample: Sample, folder: Path, velocities: list[str] | None = None) -> None:
    """The blocks, each of a material of its own where they fly, and the options."""
    corners = np.concatenate(sample.blocks)
    sample.height = float(np.ptp(corners[:, 1]))
    fixed = []
    for number in range(sample.held):
        points = sample.blocks[number]
        fixed += [(*(0.8 * points[k] + 0.2 * points.mean(0)), number + 1) for k in range(len(points))]
    lines = [
        "rockdda-blocks 1",
        f"e0 {1e-4 * sample.size!r}",
        f"blocks {len(sample.blocks)}",
        f"vertices {len(corners)}",
    ]
    lines += [f"fixed {len(fixed)}", "loading 0", "measured 0", "bolts 0"]
    for number, points in enumerate(sample.blocks, start=1):
        lines.append(f"block {number} {number if velocities else 1} {len(points)}")
        lines += [f"{float(x)!r} {float(y)!r} 1" for x, y in points]
    lines += ["fixed_points", *(f"{float(x)!r} {float(y)!r} {b}" for x, y, b in fixed)]
    lines += ["loading_points", "measured_points", "bolt_list", "end"]
    (folder / "m.blk").write_text("\n".join(lines) + "\n")
    _write_options(sample, folder, velocities or [""])


def _write_options(sample: Sample, folder: Path, velocities: list[str], extra: str = "") -> None:
    text = "&model geometry = 'm.blk' /\n"
    for number, velocity in enumerate(velocities, start=1):
        text += f"&block_material number = {number}, density = {sample.density!r}, young = {sample.modulus!r}, "
        text += f"poisson = 0.2{velocity} /\n"
    stiffness = f", normal_stiffness = {sample.stiffness!r}" if sample.stiffness else ""
    text += f"&joint_material number = 1, friction = {sample.friction}{stiffness} /\n"
    text += f"&load gravity = {sample.gravity} /\n{extra}&time dt_max = {sample.step!r} /\n"
    text += f"&stage name = 'motion', kind = 'dynamic', duration = {sample.duration!r} /\n&run save_every = 1000 /\n"
    (folder / "m.nml").write_text(text)


# -- what must hold --------------------------------------------------------------------------------------------------


def faults(sample: Sample, folder: Path, threads: bool = False) -> list[str]:
    """Run a model; what is wrong with it, in words. threads: with two it must have the same bits."""
    done = call(folder, "run", "m.nml", "-o", "o.h5", "--threads", "1")
    if done.returncode:
        return [f"exit {done.returncode}: {done.stderr.strip()[-300:]}"]
    with h5py.File(folder / "o.h5") as results:
        found = faults_of(sample, results)
        if threads:
            call(folder, "run", "m.nml", "-o", "two.h5", "--threads", "2")
            with h5py.File(folder / "two.h5") as other:
                names = ("frames/vertices", "history/energy")
                found += [f"two threads: {n}" for n in names if not np.array_equal(results[n], other[n])]
    return found


def faults_of(sample: Sample, results: h5py.File) -> list[str]:
    """What is wrong with the results of a run."""
    found = _energy_faults(sample, results) + _overlap_faults(sample, results)
    return found if sample.gravity else found + _momentum_faults(sample, results)


def _energy_faults(sample: Sample, results: h5py.File) -> list[str]:
    """The balance closes, contacts give nothing, and what flies does not become faster."""
    names = [
        name.decode() if isinstance(name, bytes) else str(name) for name in results["history/energy"].attrs["columns"]
    ]
    energy = dict(zip(names, np.vstack([np.zeros(len(names)), results["history/energy"]]).T, strict=True))
    if not all(np.isfinite(column).all() for column in energy.values()):
        return ["an energy is no number"]
    start = _kinetic(results, sample.density, 0)
    energy["kinetic"][0] = start
    exchanged = start + sum(np.abs(np.diff(energy[name])).sum() for name in EXCHANGED)
    found = []
    if np.abs(energy["residual"]).max() > 1e-6 * exchanged:
        found.append(f"residual {np.abs(energy['residual']).max() / exchanged:.1e} of the energy exchanged")
    for name, sign in (("discarded", -1), ("geometry", 1)):
        given = sign * energy[name]
        share = float((given - np.minimum.accumulate(given)).max() / exchanged)
        if share > GIVEN:
            found.append(f"{name} gives {share:.1e} of the energy exchanged")
    if not sample.gravity:
        total = energy["kinetic"] + energy["strain"] + energy["springs"]
        if total.max() > (1 + GIVEN) * start:
            found.append(f"energy grows to {total.max() / start:.4f} of that at the start")
    return found


def _kinetic(results: h5py.File, density: float, frame: int) -> float:
    """Of the blocks' motion as rigid ones."""
    velocity = results["frames/velocity"][frame]
    area = results["model/block_area"][:]
    offset, vertices = results["model/vertex_offset"][:], results["frames/vertices"][frame]
    polar = np.array([_polar(vertices[a:b]) for a, b in itertools.pairwise(offset)])
    return float(0.5 * density * (area * (velocity[:, :2] ** 2).sum(1) + polar * velocity[:, 2] ** 2).sum())


def _polar(points: Points) -> float:
    """Polar second moment of area about the centroid."""
    x, y = (points - points.mean(0)).T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    area = cross.sum() / 2
    cx, cy = ((x + u) * cross).sum() / (6 * area), ((y + v) * cross).sum() / (6 * area)
    whole = ((x * x + x * u + u * u + y * y + y * v + v * v) * cross).sum() / 12
    return float(whole - area * (cx * cx + cy * cy))


def _momentum_faults(sample: Sample, results: h5py.File) -> list[str]:
    """Blocks in flight keep their momentum, pairs each their own."""
    impulse = results["model/block_area"][:][:, None] * results["frames/velocity"][:, :, :2]
    groups = len(impulse[0]) // 2 if sample.family == "pairs" else 1
    parts = impulse.reshape(len(impulse), groups, -1, 2)
    lost = np.linalg.norm((parts[-1] - parts[0]).sum(1), axis=1) / np.linalg.norm(parts[0], axis=2).sum(1)
    return [f"momentum changes by {lost.max():.1e}"] if lost.max() > 1e-8 else []


def _overlap_faults(sample: Sample, results: h5py.File) -> list[str]:
    """Blocks overlap by no more than their joints give way, as a mean over the length of the overlap."""
    import shapely

    offset = results["model/vertex_offset"][:]
    vertices = results["frames/vertices"]

    def deepest(frame: int) -> tuple[float, str]:
        polygons = [shapely.Polygon(vertices[frame][a:b]) for a, b in itertools.pairwise(offset)]
        crossed = [number for number, polygon in enumerate(polygons, start=1) if not polygon.is_valid]
        if crossed:
            return math.inf, f"block {crossed[0]} crosses itself"
        worst = (0.0, "")
        first, second = shapely.STRtree(polygons).query(polygons)
        for i, j in zip(first, second, strict=True):
            if i < j:
                both = polygons[i].intersection(polygons[j])
                low_x, low_y, high_x, high_y = both.bounds if both.area > 0 else (0, 0, 1, 1)
                depth = both.area / max(math.hypot(high_x - low_x, high_y - low_y), 1e-300)
                worst = max(worst, (depth, f"blocks {i + 1} and {j + 1}"))
        return worst

    edges = np.concatenate([np.diff(vertices[0][a:b], axis=0) for a, b in itertools.pairwise(offset)])
    mean = float(np.linalg.norm(edges, axis=1).mean())
    stiffness = sample.stiffness or 2 * sample.modulus / mean
    speed = float(np.abs(results["frames/velocity"][:, :, :2]).max())
    # weight of the whole height ten times over on a joint, and a column of it that arrives with three times the speed
    allowed = 10 * sample.density * sample.gravity * sample.height / stiffness
    allowed += 3 * speed * math.sqrt(sample.density * sample.height / stiffness) + 1e-6 * sample.height
    start, end = deepest(0)[0], deepest(-1)
    return [f"{end[1]} overlap by {end[0]:.2e} m, allowed {allowed:.2e} m"] if end[0] > start + allowed else []
