# SPDX-License-Identifier: MIT
"""Random joint networks at rest: what no load asks for must not happen, and the search distance decides nothing.

Networks of two or three joint sets in windows of aspect 1:1 to 1:50, contact stiffness 1e-3 to 1e3 E, allowed
displacement g2 1e-4 to 0.05. `ROCKDDA_NETWORKS` sets the number of networks (30): some hundreds take some minutes.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
NETWORKS = int(os.environ.get("ROCKDDA_NETWORKS", "30"))
E = 5e9
DISCARDED = 7


def find_program() -> Path | None:
    """The program: named by the environment, or of the build tree."""
    named = os.environ.get("ROCKDDA_PROGRAM") or os.environ.get("ROCKDDA")
    program = Path(named) if named else ROOT / "build" / "bin" / "rockdda"
    return program.resolve() if program.is_file() else None


pytestmark = pytest.mark.skipif(find_program() is None, reason="the program is not built")


def call(folder: Path, *arguments: str) -> None:
    """Run the program; its messages are the reason of a failure."""
    result = subprocess.run(
        [str(find_program()), *arguments, "--quiet", "--force"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert result.returncode == 0, result.stderr


def make_network(folder: Path, random: np.random.Generator, framed: bool) -> float:
    """Blocks of a random network as n.blk; returns a contact stiffness."""
    aspect = np.exp(random.uniform(0, np.log(50)))
    area = np.exp(random.uniform(np.log(20), np.log(200)))
    short = np.sqrt(area / aspect)
    width, height = (short, short * aspect) if random.random() < 0.5 else (short * aspect, short)
    text = f"&lines seed = {random.integers(1, 10**6)} /\n"
    text += f"&boundary window = 0,0, {width:.6g},{height:.6g}{', frame = 1' if framed else ''} /\n"
    angle = random.uniform(0, 180)
    for _ in range(random.integers(2, 4)):
        angle = (angle + random.uniform(25, 90)) % 180
        spacing = np.exp(random.uniform(np.log(0.5), np.log(2)))
        text += (
            f"&joint_set inclination = {angle:.4g}, spacing = {spacing:.4g}, randomness = {random.uniform(0, 0.5):.3g}"
        )
        if random.random() < 0.6:
            text += f", trace = {spacing * random.uniform(1.5, 6):.4g}"
            text += f", bridge = {spacing * random.uniform(0.1, 0.8):.4g}"
        text += " /\n"
    (folder / "n.dl").write_text(text)
    call(folder, "lines", "n.dl", "-o", "n.dc")
    call(folder, "cut", "n.dc", "-o", "n.blk")
    return E * 10 ** random.uniform(-3, 3)


def run(folder: Path, stiffness: float, g2: float, weight: float, n_fixed: int) -> h5py.File:
    """Five dynamic steps of at most 1 ms; the results, open."""
    tables = "0\n" * n_fixed
    (folder / "n.df").write_text(
        f"1\n5\n1 1\n{g2:.6g}\n0.001\n{stiffness:.8g}\n{tables}"
        f"2500 {weight} {E} 0.25\n0 0 0 0 0 0\n0 0 0\n35 0 0\n1.4\n"
    )
    call(folder, "run", "n.blk", "n.df", "-o", "n.h5", "--dialect", "g0", "--threads", "1")
    return h5py.File(folder / "n.h5")


@pytest.mark.parametrize("seed", range(NETWORKS))
def test_nothing_moves_without_load(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    stiffness = make_network(tmp_path, random, framed=False)
    for g2 in 10 ** random.uniform(-4, np.log10(0.05), size=2):
        with run(tmp_path, stiffness, g2, 0, 0) as results:
            vertices = results["frames/vertices"][:]
            extent = np.ptp(vertices[0], axis=0).max()
            # round-off of coordinates only: 1e-9 of half the model's extent
            assert abs(vertices - vertices[0]).max() <= 0.5e-9 * extent
            # a spring closed by round-off has at most a force of stiffness times 1e-12 w0
            forces = results["frames/contact_force"][:]
            assert abs(forces).max(initial=0.0) <= 1e-11 * stiffness * extent
            assert abs(results["history/energy"][:, DISCARDED]).max() <= 1e-20 * stiffness * extent**2


@pytest.mark.parametrize("seed", range(max(4, NETWORKS // 3)))
def test_search_distance_decides_nothing(tmp_path: Path, seed: int) -> None:
    stiffness = make_network(tmp_path, np.random.default_rng(1000 + seed), framed=True)
    moved = []
    for g2 in (1e-3, 5e-2):
        with run(tmp_path, stiffness, g2, 2.5e4, 12) as results:
            moved.append(results["frames/vertices"][-1] - results["frames/vertices"][0])
    assert abs(moved[1] - moved[0]).max() <= 1e-6 * abs(moved[0]).max()


@pytest.mark.parametrize("seed", range(4))
def test_networks_resume_with_the_same_bits(tmp_path: Path, seed: int) -> None:
    """Rows of contacts whose partners have other partners are no damage: three sets make such corners."""
    (tmp_path / "n.dl").write_text(
        f"&lines seed = {seed + 1} /\n&boundary window = 0,0, 8,6, frame = 1 /\n"
        "&joint_set inclination = 10, spacing = 0.7, randomness = 0.4 /\n"
        "&joint_set inclination = 75, spacing = 0.8, randomness = 0.4 /\n"
        "&joint_set inclination = 130, spacing = 0.9, randomness = 0.4 /\n"
    )
    call(tmp_path, "lines", "n.dl", "-o", "n.dc")
    call(tmp_path, "cut", "n.dc", "-o", "n.blk")
    tables = "0\n" * 12
    (tmp_path / "n.df").write_text(
        f"1\n14\n1 1\n0.01\n0.001\n{E}\n{tables}2500 25000 {E} 0.25\n0 0 0 0 0 0\n0 0 0\n35 0 0\n1.4\n"
    )
    arguments = ("run", "n.blk", "n.df", "--dialect", "g0", "--threads", "1", "-o")
    call(tmp_path, *arguments, "whole.h5")
    call(tmp_path, *arguments, "part.h5", "--steps", "10")
    call(tmp_path, "resume", "part.ckpt.h5", "--steps", "4")
    with h5py.File(tmp_path / "whole.h5") as whole, h5py.File(tmp_path / "part.h5") as part:
        for name in ("vertices", "velocity", "stress", "contact_force"):
            assert np.array_equal(whole[f"frames/{name}"][:], part[f"frames/{name}"][:])


def test_vertex_across_a_thin_window(tmp_path: Path) -> None:
    """A search that reaches further than blocks are large: vertices moved by 0.98 m, with forces of 2.9e9 N."""
    (tmp_path / "n.dl").write_text(
        "&lines seed = 1 /\n&boundary window = 0,0, 6,150 /\n"
        "&joint_set inclination = 5, spacing = 1, randomness = 0.3 /\n"
        "&joint_set inclination = 80, spacing = 1, randomness = 0.4, trace = 3, bridge = 0.5 /\n"
    )
    call(tmp_path, "lines", "n.dl", "-o", "n.dc")
    call(tmp_path, "cut", "n.dc", "-o", "n.blk")
    with run(tmp_path, E, 0.01, 0, 0) as results:
        vertices = results["frames/vertices"][:]
        assert abs(vertices - vertices[0]).max() <= 75e-9
        assert abs(results["frames/contact_force"][:]).max(initial=0.0) <= 1e-9 * E
