# SPDX-License-Identifier: MIT
"""Blocks with islands: their rings, and the way out and back through DXF, GeoPandas, VTK and COMPAS."""

import json
import math
import subprocess

import numpy as np
import pytest
import rockdda
from rockdda import export
from rockdda.convert import convert
from rockdda.rings import bridged, rings_of, signed_area, triangles
from test_convert_drawings import feature, write_map

shapely = pytest.importorskip("shapely")


def star(random, x, y, radius, count):
    angles = np.sort(random.uniform(0, 2 * math.pi, count) + np.linspace(0, 1e-3, count))
    radii = radius * random.uniform(0.4, 1, count)
    return [(x + r * math.cos(a), y + r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]


def polygon_with_holes(random):
    """A square of 10 with 1 to 12 holes apart from each other; some have corners on a lattice."""
    whole = shapely.box(0, 0, 10, 10)
    for _ in range(random.integers(1, 13)):
        x, y = random.uniform(1.5, 8.5, 2)
        if random.random() < 0.5:
            x, y = round(x), round(y)
            hole = shapely.box(x - 0.5, y - 0.5, x + 0.5, y + 0.5)
        else:
            hole = shapely.Polygon(star(random, x, y, 1.2, 7)).buffer(0)
        if hole.geom_type == "Polygon" and whole.contains_properly(hole):
            whole = whole.difference(hole)
    return shapely.geometry.polygon.orient(whole)


def test_rings_of_bridged_outlines_are_the_polygon():
    for number in range(100):
        polygon = polygon_with_holes(np.random.default_rng(number))
        rings = [list(ring.coords)[:-1] for ring in (polygon.exterior, *polygon.interiors)]
        outline, is_bridge = bridged(rings)
        assert sum(is_bridge) == 2 * (len(rings) - 1)
        assert len(outline) == sum(map(len, rings)) + 2 * (len(rings) - 1)
        ends = [(a, b) for a, b, bridge in zip(outline, outline[1:] + outline[:1], is_bridge, strict=True) if bridge]
        assert sorted(ends) == sorted((b, a) for a, b in ends)
        for bridge in map(shapely.LineString, ends):
            assert polygon.covers(bridge), number
            assert bridge.intersection(polygon.boundary).length < 1e-12, number
        corners = np.array(outline)
        found = [corners[ring] for ring in rings_of(corners)]
        again = shapely.Polygon(found[0], found[1:])
        assert again.is_valid
        assert again.equals(polygon), number
        pieces = corners[triangles(corners)]
        areas = np.array([signed_area(piece) for piece in pieces])
        assert areas.min() > -1e-12, number
        assert areas.sum() == pytest.approx(polygon.area, rel=1e-12)
        # in the polygon, but for round-off of corners on lines
        outside = shapely.difference(shapely.polygons(pieces), polygon)
        assert shapely.area(outside).max() < 1e-9, number


def test_an_island_that_touches_at_a_corner_has_no_bridge():
    outer = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
    hole = [(4.0, 4.0), (3.0, 2.0), (2.0, 3.0)]
    outline, is_bridge = bridged([outer, hole if signed_area(np.array(hole)) < 0 else hole[::-1]])
    assert not any(is_bridge)
    assert len(outline) == 7
    first, second = rings_of(np.array(outline))
    polygon = shapely.Polygon(np.array(outline)[first], [np.array(outline)[second]])
    assert polygon.is_valid
    assert polygon.area == pytest.approx(16 - 1.5)


LABELLED = """\
&model geometry = '{}' /
&block_material number = 1, density = 2600, young = 5e9, poisson = 0.25 /
&joint_material number = 1, friction = 30 /
&load gravity = 9.81 /
&stage name = 'fall', kind = 'dynamic', duration = 1 /
"""


def model_with_islands(folder, program, number):
    """Results of one step of a random model: blocks within blocks, openings and a joint across."""
    random = np.random.default_rng(number)
    rock = polygon_with_holes(random)
    features = [feature("Polygon", [list(map(list, r.coords)) for r in (rock.exterior, *rock.interiors)])]
    free = rock.buffer(-0.05)
    for _ in range(4):  # islands of rock in rock
        island = shapely.Polygon(star(random, *random.uniform(1, 9, 2), 0.9, 6)).buffer(0)
        if island.geom_type == "Polygon" and island.area > 0.05 and free.contains_properly(island):
            free = free.difference(island.buffer(0.05))
            features.append(feature("LineString", list(map(list, island.exterior.coords))))
    write_map(folder / "a.geojson", *features)
    convert(folder / "a.geojson", folder / "a", e0=1e-4)
    (folder / "a.nml").write_text(LABELLED.format("a.dc"))
    run = [program, "run", folder / "a.nml", "-o", folder / "a.h5", "--steps", "1", "--quiet"]
    done = subprocess.run(run, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return rockdda.open(folder / "a.h5")


def same_blocks(blocks, results):
    """The areas of blocks, in their order, and their number."""
    np.testing.assert_allclose(blocks.areas, results.block_area, rtol=1e-6)


@pytest.mark.parametrize("number", range(4))
def test_islands_survive_the_way_out_and_back(tmp_path, program, number):
    geopandas = pytest.importorskip("geopandas")
    results = model_with_islands(tmp_path, program, number)
    assert any(len(rings) > 1 for rings in results.rings)
    export.to_dxf(results, tmp_path / "d.dxf", 0)
    convert(tmp_path / "d.dxf", tmp_path / "d", scale=1, origin=(0, 0))
    assert sorted(rockdda.cut(tmp_path / "d.blk").areas) == pytest.approx(sorted(results.block_area), rel=1e-6)
    table = results.to_geopandas("blocks", 0)
    assert table.geometry.is_valid.all()
    np.testing.assert_allclose(table.geometry.area, results.block_area, rtol=1e-6)
    assert [len(shape.interiors) for shape in table.geometry] == [len(rings) - 1 for rings in results.rings]
    for ending in ("gpkg", "geojson"):
        columns = geopandas.GeoDataFrame({"material": results.block_material}, geometry=table.geometry)
        columns.to_file(tmp_path / f"g.{ending}")
        convert(tmp_path / f"g.{ending}", tmp_path / ending, blocks=True, scale=1, origin=(0, 0))
        same_blocks(rockdda.cut(tmp_path / f"{ending}.blk"), results)
    (tmp_path / "b.nml").write_text(LABELLED.format("gpkg.blk"))
    check = subprocess.run([program, "check", tmp_path / "b.nml"], capture_output=True, text=True, check=False)
    assert check.returncode == 0, check.stderr


@pytest.mark.parametrize("ending", ["vtu", "vtkhdf"])
def test_cells_of_vtk_leave_holes_open(tmp_path, program, ending):
    pyvista = pytest.importorskip("pyvista")
    results = model_with_islands(tmp_path, program, 2)
    export.to_vtk(results, tmp_path / f"v.{ending}", [0])
    grid = pyvista.read(tmp_path / f"v.{ending}")
    shapes = [shapely.Polygon(grid.get_cell(i).points[:, :2]) for i in range(grid.n_cells)]
    assert all(shape.is_valid for shape in shapes)
    numbers = grid.cell_data["block"]
    for block, shape in enumerate(results.to_geopandas("blocks", 0).geometry, start=1):
        cells = [cell for cell, number in zip(shapes, numbers, strict=True) if number == block]
        assert sum(cell.area for cell in cells) == pytest.approx(shape.area, rel=1e-9)
        assert shapely.union_all(cells, grid_size=1e-9).symmetric_difference(shape).area < 1e-6
    # blocks without holes stay one cell
    whole = sum(len(rings) == 1 for rings in results.rings)
    assert grid.n_cells == whole + sum(
        len(np.concatenate(rings)) + 2 * (len(rings) - 1) - 2 for rings in results.rings if len(rings) > 1
    )


def test_outlines_within_outlines_are_islands(tmp_path):
    """Three squares within each other, drawn without a word about holes: each block reaches to the next one."""
    squares = [[[-w, -w], [w, -w], [w, w], [-w, w], [-w, -w]] for w in (1, 3, 2)]
    write_map(tmp_path / "a.geojson", *(feature("Polygon", [ring], kind="block") for ring in squares))
    done = convert(tmp_path / "a.geojson", tmp_path / "a")
    assert rockdda.cut(tmp_path / "a.blk").areas == pytest.approx([4, 36 - 16, 16 - 4], rel=1e-12)
    assert any("blocks lie within others, which have holes there" in text for text in done.messages)


def test_openings_are_taken_out_of_the_smallest_block_around(tmp_path):
    ring = [[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]
    inner, hole = ([[x + w * dx, y + w * dy] for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))]
                   for x, y, w in ((1, 1, 5), (2, 2, 1)))  # fmt: skip
    features = [feature("Polygon", [ring, inner], kind="block"), feature("Polygon", [inner], kind="block")]
    write_map(tmp_path / "a.geojson", *features, feature("Polygon", [hole], kind="opening"),
              feature("Polygon", [[[20, 0], [21, 0], [21, 1], [20, 0]]], kind="opening"))  # fmt: skip
    done = convert(tmp_path / "a.geojson", tmp_path / "a")
    assert rockdda.cut(tmp_path / "a.blk").areas == pytest.approx([81 - 25, 25 - 1], rel=1e-12)
    assert any("1 opening outside of blocks" in row for row in done.left)


def test_frames_of_compas_keep_their_openings(tmp_path):
    """A frame of 4 × 4 around 2 × 2 with a box in it, in the plane x-z."""
    points, faces = [], []
    for y in (0, 0.2):
        points += [(x * w, y, z * w) for w in (2, 1) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for a in range(4):
        b = (a + 1) % 4
        faces += [[a, b, 4 + b, 4 + a], [8 + a, 12 + a, 12 + b, 8 + b], [a, 8 + a, 8 + b, b]]
        faces.append([4 + a, 4 + b, 12 + b, 12 + a])
    box = [(x, y, z) for y in (0, 0.2) for x, z in ((-0.3, -1), (0.3, -1), (0.3, -0.4), (-0.3, -0.4))]
    sides = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
    meshes = [
        {
            "vertex": {str(i): dict(zip("xyz", p, strict=True)) for i, p in enumerate(corners)},
            "face": dict(enumerate(f)),
        }
        for corners, f in ((points, faces), (box, sides))
    ]
    interface = {"dtype": "compas.datastructures/Mesh", "data": meshes[1]}
    nodes = {
        str(i): {"block": {"dtype": "x/Block", "data": mesh}, "is_support": i == 0} for i, mesh in enumerate(meshes)
    }
    edges = {"0": {"1": {"interfaces": [{"dtype": "x/Interface", "data": {"mesh": interface}}]}}}
    data = {
        "dtype": "compas_assembly.datastructures/Assembly",
        "data": {"graph": {"data": {"node": nodes, "edge": edges}}},
    }
    (tmp_path / "a.json").write_text(json.dumps(data))
    done = convert(tmp_path / "a.json", tmp_path / "a")
    blocks = rockdda.cut(tmp_path / "a.blk")
    assert blocks.areas == pytest.approx([12, 0.36], rel=1e-12)
    assert any("1 interface of blocks" in row for row in done.left)
    text = (tmp_path / "a.blk").read_text().splitlines()
    held = text[text.index("fixed_points") + 1 : text.index("loading_points")]
    assert [row.split()[2] for row in held] == ["1", "1"]
    for x, z, _ in (map(float, row.split()) for row in held):  # inside of the frame, not on its edges
        assert 1 < max(abs(x), abs(z)) < 2
