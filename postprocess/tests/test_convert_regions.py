# SPDX-License-Identifier: MIT
"""Areas and openings drawn at random, against shapely line by line."""

import json
import math
import time

import numpy as np
import pytest
from rockdda.convert import convert
from test_convert_drawings import feature, lines_of

shapely = pytest.importorskip("shapely")


def polygons(random, count, side):
    """Overlapping polygons of three to seven corners."""
    found = []
    for x, y in random.uniform(0, side, (count, 2)):
        corners = int(random.integers(3, 8))
        turn, radius = random.uniform(0, 2 * math.pi), random.uniform(0.5, 1.2)
        angles = turn + 2 * math.pi * np.arange(corners) / corners
        ring = [[x + radius * math.cos(a), y + radius * math.sin(a)] for a in angles]
        found.append([*ring, ring[0]])
    return found


def converted(folder, features):
    path = folder / "areas.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    lines, count = lines_of(convert(path, folder / "areas.dc", origin=(0.0, 0.0)).files[0])
    return lines[:count], lines[count:]


def length_of(lines):
    return sum(math.hypot(line[2] - line[0], line[3] - line[1]) for line in lines)


def test_4000_areas_that_overlap_take_no_time_of_their_square(tmp_path):
    """They took 13 s, and 20,000 more than 200 s; every edge is there once: some parts of the outline were twice."""
    rings = polygons(np.random.default_rng(1), 4000, 63.0)
    begin = time.process_time()
    boundary, joints = converted(tmp_path, [feature("Polygon", [ring], kind="area") for ring in rings])
    taken = time.process_time() - begin
    assert taken < 6  # four times what it takes, half of what it took
    assert len(joints) == 0
    # pieces below 1e-9 of the extent are left out, coordinates have 15 digits
    assert length_of(boundary) == pytest.approx(sum(shapely.Polygon(ring).length for ring in rings), rel=1e-9)


@pytest.mark.parametrize(
    ("start", "warning"),
    [
        (10.0, None),
        (10.001, None),  # less than the distance of nodes and edges: they merge
        (10.01, "areas 1 and 2 do not meet: there is a gap near 10.005, "),
        (10.5, None),
        (9.9, "areas 1 and 2 overlap in a strip, whose both edges stay, near 9.95, "),
        (9.999, None),
        (9.0, None),
    ],
)
def test_areas_that_nearly_meet_are_told(tmp_path, start, warning):
    rings = [[[x1, 0], [x2, 0], [x2, 8], [x1, 8], [x1, 0]] for x1, x2 in ((0, 10), (start, 20))]
    path = tmp_path / "areas.geojson"
    features = [feature("Polygon", [ring], kind="area") for ring in rings]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    found = [p.message for p in convert(path, tmp_path / "areas").problems if p.severity == "warning"]
    assert [message[: len(warning or "")] for message in found] == [warning] * (warning is not None)
    # what a third area fills is no gap
    between = [[10, 0], [start, 0], [start, 8], [10, 8], [10, 0]]
    if start > 10:
        features.append(feature("Polygon", [between], kind="area"))
        path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
        assert [p for p in convert(path, tmp_path / "areas", force=True).problems if p.severity == "warning"] == []


@pytest.mark.parametrize("seed", range(6))
def test_lines_are_clipped_as_shapely_clips_each(tmp_path, seed):
    random = np.random.default_rng(seed)
    areas, openings = polygons(random, 20 if seed else 0, 6.0), polygons(random, 4, 6.0)
    lines = random.uniform(-1, 7, (30, 2, 2)).tolist()
    features = [feature("LineString", line) for line in lines]
    features += [feature("Polygon", [ring], kind="area") for ring in areas]
    features += [feature("Polygon", [ring], kind="opening") for ring in openings]
    boundary, joints = converted(tmp_path, features)
    void = shapely.union_all([shapely.Polygon(ring) for ring in openings])
    rock = shapely.union_all([shapely.Polygon(ring) for ring in areas]).difference(void)
    kept = [shapely.LineString(line).intersection(rock) if areas else shapely.LineString(line).difference(void)
            for line in lines]  # fmt: skip
    assert length_of(joints) == pytest.approx(sum(line.length for line in kept), rel=1e-9)
    edges = [shapely.LineString(ring).intersection(rock.boundary.union(rock)) for ring in areas]
    outline = rock if areas else void
    inner = [edge.difference(outline.boundary.buffer(1e-9)).length for edge in edges]
    assert length_of(boundary) == pytest.approx(outline.length + sum(inner), rel=1e-6)  # by the width of the buffer
