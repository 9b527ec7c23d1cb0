# SPDX-License-Identifier: MIT
"""`rockdda cut` against an independent polygoniser: shapely's unary_union and polygonize.

Random line sets of several kinds, with an e0 far below the spacing of the lines, so that both look at the same
geometry. Faces thinner than a few e0 may be merged by one and kept by the other: they are left out on both sides.
"""

from __future__ import annotations

import math
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

shapely = pytest.importorskip("shapely")

ROOT = Path(__file__).resolve().parents[2]
E0 = 1e-7
CASES = 60


def find_program() -> Path | None:
    """The program: named by the environment, or of the build tree."""
    named = os.environ.get("ROCKDDA_PROGRAM") or os.environ.get("ROCKDDA")
    program = Path(named) if named else ROOT / "build" / "bin" / "rockdda"
    return program.resolve() if program.is_file() else None


pytestmark = pytest.mark.skipif(find_program() is None, reason="the program is not built")


def free_lines(random: np.random.Generator) -> np.ndarray:
    """Anywhere in the unit square."""
    return random.random((random.integers(6, 60), 4))


def lattice_lines(random: np.random.Generator) -> np.ndarray:
    """Between points of a 6 x 6 lattice: overlaps, duplicates, T junctions, many lines through one point."""
    return random.integers(0, 6, (random.integers(8, 50), 4)) / 5.0


def grid_lines(random: np.random.Generator) -> np.ndarray:
    """A perturbed grid of long lines, a third of them broken into two parts."""
    n = int(random.integers(3, 12))
    at = (np.arange(n)[:, None] + 0.3 * random.random((n, 2))) / n
    lines = [[-0.1, a, 1.1, b] for a, b in at] + [[a, -0.1, b, 1.1] for a, b in at[::-1]]
    broken = []
    for line in np.array(lines):
        if random.random() < 1 / 3:
            s, t = random.random(2)
            d = line[2:] - line[:2]
            broken += [[*line[:2], *(line[:2] + s * d)], [*(line[:2] + t * d), *line[2:]]]
        else:
            broken.append(list(line))
    return np.array(broken)


def loops(random: np.random.Generator) -> np.ndarray:
    """Closed polygons strewn over the unit square: islands, islands in islands, overlapping loops."""
    lines = []
    for _ in range(random.integers(3, 15)):
        n = int(random.integers(3, 8))
        angle = np.sort(random.random(n)) * 2 * math.pi
        points = random.random(2) + 0.3 * random.random() ** 2 * np.column_stack([np.cos(angle), np.sin(angle)])
        lines += [[*points[k - 1], *points[k]] for k in range(n)]
    return np.array(lines)


def arcs(random: np.random.Generator) -> np.ndarray:
    """Circles of chords crossed by lines."""
    lines = []
    for _ in range(random.integers(1, 4)):
        center, radius, n = random.random(2), 0.2 + 0.5 * random.random(), int(random.integers(8, 40))
        angle = np.arange(n + 1) * 2 * math.pi / n
        points = center + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        points[-1] = points[0]
        lines += [[*points[k], *points[k + 1]] for k in range(n)]
    return np.vstack([np.array(lines), random.random((random.integers(2, 10), 4)) * 2 - 0.5])


def cut(lines: np.ndarray, folder: Path) -> list[np.ndarray]:
    """Corners of the blocks that the program cuts."""
    rows = [f"{E0}", f"{len(lines)} 0", "0", "0", "0", "0", "0", "0"]
    rows += [" ".join(repr(float(x)) for x in line) + " 1" for line in lines]
    (folder / "model.dc").write_text("\n".join(rows) + "\n")
    run = subprocess.run(
        [find_program(), "cut", "model.dc", "-o", "model.blk", "--force", "--allow-open"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    if run.returncode == 2 and "no closed block" in run.stderr:
        return []
    assert run.returncode == 0, run.stderr
    text = (line.split("#")[0].split() for line in (folder / "model.blk").read_text().splitlines())
    rows = [words for words in text if words]
    blocks = []
    for k, words in enumerate(rows):
        if words[0] == "block":
            blocks.append(np.array([[float(x) for x in row[:2]] for row in rows[k + 1 : k + 1 + int(words[3])]]))
    return blocks


def shoelace(corners: np.ndarray) -> float:
    x, y = (corners - corners[0]).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def region(corners: np.ndarray) -> shapely.Geometry:
    """The block as a valid shapely polygon; bridges to islands vanish."""
    shape = shapely.make_valid(shapely.Polygon(corners))
    return shapely.union_all([part for part in shapely.get_parts(shape) if part.geom_type.endswith("Polygon")])


def is_thin(area: float, perimeter: float) -> bool:
    return area < 5 * E0 * perimeter


@pytest.mark.parametrize("maker", [free_lines, lattice_lines, grid_lines, loops, arcs])
def test_blocks_are_the_faces_of_an_independent_polygoniser(maker, tmp_path):
    random = np.random.default_rng(20240229)
    compared = 0
    for case in range(CASES):
        lines = maker(random)
        blocks = cut(lines, tmp_path)
        net = shapely.unary_union(shapely.linestrings(lines.reshape(-1, 2, 2)), grid_size=1e-12)
        faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(net)))
        faces = [face for face in faces if not is_thin(face.area, face.length)]
        where = f"{maker.__name__}, case {case}"

        areas = np.array([shoelace(corners) for corners in blocks])
        assert (areas > 0).all(), where
        regions = [region(corners) for corners in blocks]
        # no edge of a block crosses another one: making the polygon valid does not change its area
        np.testing.assert_allclose([shape.area for shape in regions], areas, rtol=1e-9, err_msg=where)
        thick = [k for k, shape in enumerate(regions) if not is_thin(shape.area, shape.length)]
        assert len(thick) == len(faces), where
        if not faces:
            continue
        # places move by less than e0, so areas change by less than e0 times the perimeter
        slack = 2 * E0 * max(face.length for face in faces)
        expected = np.sort([face.area for face in faces])
        np.testing.assert_allclose(np.sort(areas[thick]), expected, rtol=0, atol=slack, err_msg=where)
        tree = shapely.STRtree(faces)
        for k in thick:
            inside = tree.query(regions[k].representative_point(), predicate="within")
            assert len(inside) == 1, where
            face = faces[inside[0]]
            assert regions[k].symmetric_difference(face).area <= 2 * E0 * face.length, f"{where}, block {k + 1}"
            compared += 1
    assert compared > 5 * CASES
