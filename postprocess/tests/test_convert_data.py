# SPDX-License-Identifier: MIT
"""Data as people have them: traces of FracPaQ, GeoPackages, Shapefiles, polygons as blocks, degrees."""

import contextlib
import json
import math
import sqlite3
import subprocess

import ezdxf
import numpy as np
import pytest
import rockdda
from rockdda.cli import main
from rockdda.convert import convert
from test_convert_drawings import cut, feature, lines_of, write_map

TRACES = ["0\t1\t2\t1.5\t4\t1", "1 -1 1.5 4", "3,-1,2.5,4", "", "# noted", "2 2"]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_traces_of_fracpaq(tmp_path, program, end):
    (tmp_path / "a.txt").write_bytes(end.join(TRACES).encode())
    done = convert(tmp_path / "a.txt", tmp_path / "a", window=(0, 0, 4, 3))
    rows, boundary = lines_of(tmp_path / "a.dc")
    assert boundary == 4
    assert rows[boundary:, :4][0].tolist() == [0, 1, 2, 1.5]
    assert cut(program, tmp_path / "a.dc")["blocks"] == 6  # one trace across, two down
    assert any("4 joint lines" in row for row in done.taken)
    assert done.left[0].endswith("1 trace of one point")
    # two of 5.02, each cut down to the height 3 of the window
    assert done.left[1].endswith("of the length of lines, which lies outside")
    assert float(done.left[1].split(": ")[1].split()[0]) == pytest.approx(2 * math.hypot(0.5, 5) * 2 / 5, rel=1e-5)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("0 0 1", r":3:5: .*a trace takes pairs x y, found 3 numbers"),
        ("0 0 1 x", r":3:7: .*expected a number .*found 'x'"),
        ("0 0 1 nan", r":3:7: .*found 'nan'"),
    ],
)
def test_wrong_traces_are_named_with_their_place(tmp_path, row, message):
    (tmp_path / "a.txt").write_bytes(f"0 0 1 1\r\r{row}\r".encode())
    with pytest.raises(rockdda.InputError, match=message):
        convert(tmp_path / "a.txt", tmp_path / "a")
    assert not (tmp_path / "a.dc").exists()


@pytest.mark.parametrize(
    "text",
    [
        "1,5\t2,5\t3,5\t4,5\r10,25\t2,5\t3,5\t14,5\x1a",
        "1,5;2,5;3,5;4,5\n10,25;2,5;3,5;14,5;\n",
        "% two traces\n1.5D0,2.5,3.5,4.5\n10.25,2.5,3.5d+0,14.5\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_decimal_commas_of_traces_are_read_where_they_are_sure(native, tmp_path, text, encoding):
    """Six other segments were written without a word."""
    (tmp_path / "a.txt").write_bytes(text.encode(encoding))
    convert(tmp_path / "a.txt", tmp_path / "a")
    assert lines_of(tmp_path / "a.dc")[0][:, :4].tolist() == [[1.5, 2.5, 3.5, 4.5], [10.25, 2.5, 3.5, 14.5]]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("1,5,2,5,3,5,4,5\n10,25,2,5,3,5,14,5\n", ":1:2: .*'1,5' may be one number with a decimal comma"),
        ("1,5 2,5 3,5 4,5\n", ":1:2: .*'1,5' may be one number with a decimal comma"),
        ("0,05 1 2 3\n", ":1:2: .*'0,05' may be one number with a decimal comma"),
        ("1;2;3.5;4\n1,5;2;3;4\n", ":2:2: .*a decimal comma, and a point in a number of line 1"),
        ("1;2;;3;4;5\n", ":1:5: .*a number is missing"),
    ],
)
def test_commas_of_traces_that_may_be_decimal_are_refused(native, tmp_path, text, place):
    (tmp_path / "a.txt").write_text(text if ";;" not in text else text + "1,5;2;3;4\n")
    with pytest.raises(rockdda.InputError, match=place):
        convert(tmp_path / "a.txt", tmp_path / "a")


def test_whole_coordinates_with_commas_are_traces(native, tmp_path):
    (tmp_path / "a.txt").write_text("0,0,4,0\n4,0,4,3,0,3\n")
    convert(tmp_path / "a.txt", tmp_path / "a")
    assert lines_of(tmp_path / "a.dc")[0][:, :4].tolist() == [[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3]]


def test_a_head_of_words_is_left_out_and_scale_holds(tmp_path):
    (tmp_path / "a.txt").write_text("x1 y1 x2 y2\n0 0 100 100\n")
    done = convert(tmp_path / "a.txt", tmp_path / "a", scale=0.01)
    assert lines_of(tmp_path / "a.dc")[0].tolist() == [[0, 0, 1, 1, 1]]
    assert any("line of words at the head" in row for row in done.left)


def frame_of(shapes, crs="EPSG:32633", **columns):
    geopandas = pytest.importorskip("geopandas")
    return geopandas.GeoDataFrame(columns, geometry=shapes, crs=crs)


def survey(folder, kind, crs="EPSG:32633", at=(500000.0, 6800000.0), unit=1.0):
    """A square of 10 m in two halves, and a point; written by GDAL."""
    shapely = pytest.importorskip("shapely")

    def p(*points):
        return [(at[0] + x / unit, at[1] + y / unit) for x, y in points]

    line = shapely.LineString(p((-1, 4), (11, 4)))
    area = shapely.Polygon(p((0, 0), (10, 0), (10, 10), (0, 10)))
    if kind == "gpkg":
        path = folder / "survey.gpkg"
        lines = frame_of(
            [line, shapely.Point(p((5, 8))[0]), None], crs, material=[2.0, None, None], note=["a", "b", "c"]
        )
        lines.to_file(path, layer="traces", driver="GPKG")
        frame_of([area], crs).to_file(path, layer="area", driver="GPKG")
        return [path], []
    frame_of([line], crs, MATERIAL=[2]).to_file(folder / "traces.shp")
    frame_of([area], crs).to_file(folder / "outline.shp")
    return [folder / "traces.shp"], [folder / "outline.shp"]


@pytest.mark.parametrize("kind", ["gpkg", "shp"])
def test_geopackages_and_shapefiles_that_gdal_wrote(tmp_path, program, kind):
    pytest.importorskip("shapefile")
    files, areas = survey(tmp_path, kind)
    done = convert(files, tmp_path / "a", areas=areas)
    rows, boundary = lines_of(tmp_path / "a.dc")
    assert boundary == 4
    assert rows[4:].tolist() == [[0, 4, 10, 4, 2]]  # clipped, in the local origin
    assert cut(program, tmp_path / "a.dc")["blocks"] == 2
    assert any("the origin is moved to 500000,6800000" in text for text in done.messages)
    assert any("1 joint lines, 10 long in all (by material 2: 1)" in row for row in done.taken)
    if kind == "gpkg":
        assert any("1 row without a shape" in row for row in done.left)
        assert any(
            "properties that are not used, with the number of their features: 'note' (2)" in t for t in done.messages
        )
        assert any("1 measured points" in row for row in done.taken)


def test_reference_systems_in_feet_and_degrees(tmp_path):
    files, _ = survey(tmp_path, "gpkg", crs="EPSG:2225", at=(6000000.0, 2000000.0), unit=1200 / 3937)
    done = convert(files, tmp_path / "feet")
    assert any("in units of 0.30480061 m" in text for text in done.messages), done.messages
    rows = lines_of(tmp_path / "feet.dc")[0]
    assert np.ptp(rows[:, [0, 2]]) == pytest.approx(10, abs=1e-6)  # of coordinates of 2,000 km in doubles
    (tmp_path / "degrees").mkdir()
    files, _ = survey(tmp_path / "degrees", "gpkg", crs="EPSG:4326", at=(15.0, 60.0), unit=111_000.0)
    done = convert(files, tmp_path / "degrees")
    assert any("longitudes and latitudes become metres" in text for text in done.messages)
    assert (tmp_path / "degrees" / "survey.dc").exists()


def test_a_geopackage_without_a_reference_system_is_in_metres(tmp_path):
    """As a Shapefile is; GDAL says that it is geographic, and it was projected, or refused."""
    for crs, number in (("EPSG:32633", 0), ("EPSG:32633", -1)):
        folder = tmp_path / str(number)
        folder.mkdir()
        files, _ = survey(folder, "gpkg", crs=crs, at=(0.0, 0.0), unit=0.01)  # 1,000 m
        with contextlib.closing(sqlite3.connect(files[0])) as file, file:
            for table in ("gpkg_contents", "gpkg_geometry_columns"):
                file.execute(f"update {table} set srs_id = {number}")
        convert(files, folder / "a", origin=(0, 0))
        assert np.ptp(lines_of(folder / "a.dc")[0][:, [0, 2]]) == pytest.approx(1000, abs=1e-9)


def test_numbers_of_materials_may_be_texts(tmp_path):
    path = tmp_path / "a.geojson"
    for value in ("2", " 2 ", 2.0):
        write_map(path, feature("LineString", [[0, 0], [3, 4]], material=value))
        convert(path, tmp_path / "a", force=True)
        assert lines_of(tmp_path / "a.dc")[0][:, 4].tolist() == [2]
    for value in ("2.5", "two", "0", "", True, "1e1", "9999999999"):
        write_map(path, feature("LineString", [[0, 0], [3, 4]], material=value))
        with pytest.raises(rockdda.InputError, match="expected a whole number from 1"):
            convert(path, tmp_path / "a", force=True)


def test_blocks_that_overlap_are_reported_when_they_are_written(tmp_path, program):
    squares = [[[x, y], [x + 2, y], [x + 2, y + 2], [x, y + 2], [x, y]] for x, y in ((0, 0), (1, 1), (3, 1))]
    far = 100 / 3  # squares that touch up to rounding
    beside = [[2, 0], [4, 0], [4, 2], [2, 2], [2, 0]]
    squares += [[[x + far, y + far] for x, y in ring] for ring in (squares[0], beside)]
    write_map(tmp_path / "a.geojson", *(feature("Polygon", [ring]) for ring in squares))
    done = convert(tmp_path / "a.geojson", tmp_path / "a", blocks=True, origin=(0, 0))
    reported = [text for text in done.messages if "overlap" in text]
    assert len(reported) == 1 and "blocks 1 and 2 overlap near 1.5, 1.5, by an area of 1" in reported[0]
    check = subprocess.run([program, "check", tmp_path / "a.blk"], capture_output=True, text=True, check=False)
    assert "block 2 overlaps block 1 (line 10), by 1 near (1, 1)" in check.stderr


def test_degrees_become_metres_as_an_independent_projection_says(tmp_path):
    pyproj = pytest.importorskip("pyproj")
    path = tmp_path / "a.geojson"
    corners = [[7.5, 46.5], [7.53, 46.501], [7.52, 46.52]]
    write_map(path, feature("LineString", corners))
    with pytest.raises(rockdda.InputError, match="--geographic projects them"):
        convert(path, tmp_path / "a")
    convert(path, tmp_path / "a", geographic=True)
    rows = lines_of(tmp_path / "a.dc")[0]
    middle = f"+lon_0={7.515} +lat_0={46.51}"
    expected = pyproj.Proj(f"+proj=tmerc {middle} +ellps=WGS84")(*zip(*corners, strict=True))
    np.testing.assert_allclose(rows[:, :2], np.transpose(expected)[:2], rtol=0, atol=1e-6)
    # true lengths on the ellipsoid: 1e-6 within 10 km, as the module says
    length = pyproj.Geod(ellps="WGS84").inv(*corners[0], *corners[1])[2]
    assert math.dist(rows[0, :2], rows[0, 2:4]) == pytest.approx(length, rel=1e-6)


def test_a_geopackage_that_is_none_is_told(tmp_path):
    (tmp_path / "a.gpkg").write_bytes(b"SQLite format 3\0" + bytes(100))
    with pytest.raises(rockdda.InputError, match="is no GeoPackage, or is damaged"):
        convert(tmp_path / "a.gpkg", tmp_path / "a")


def test_shapefiles_say_what_to_install(tmp_path, monkeypatch):
    import sys

    (tmp_path / "a.shp").write_bytes(bytes(100))
    monkeypatch.setitem(sys.modules, "shapefile", None)
    with pytest.raises(ImportError, match=r"needs the package pyshp: \S+ -m pip install geopandas pyshp shapely"):
        convert(tmp_path / "a.shp", tmp_path / "a")


WALL = [  # bricks in bond; the second is listed clockwise, the last repeats its first corner
    [(0, 0), (2, 0), (2, 1), (0, 1)],
    [(2, 0), (2, 1), (4, 1), (4, 0)],
    [(0, 1), (1, 1), (1, 2), (0, 2)],
    [(1, 1), (3, 1), (3, 2), (1, 2), (1, 1)],
]


def drawn_wall(path):
    if path.suffix == ".dxf":
        document = ezdxf.new("R2010")
        document.header["$INSUNITS"] = 6
        space = document.modelspace()
        for k, ring in enumerate(WALL):
            space.add_lwpolyline(ring[:4], close=True, dxfattribs={"layer": "BRICK" if k < 2 else "stone"})
        space.add_lwpolyline([(0, 3), (1, 3)], dxfattribs={"layer": "BRICK"})
        space.add_point((0.5, 0.5), dxfattribs={"layer": "fixed"})
        space.add_point((3.5, 0.5), dxfattribs={"layer": "fixed"})
        space.add_point((9, 9), dxfattribs={"layer": "measured"})
        document.saveas(path)
    else:
        bricks = [
            feature("Polygon", [[*map(list, ring), list(ring[0])]], material=1 + k // 2, joint_material=3)
            for k, ring in enumerate(WALL)
        ]
        write_map(path, *bricks, feature("Point", [0.5, 0.5], kind="fixed"), feature("Point", [3.5, 0.5], kind="fixed"))


def test_the_template_leaves_the_ends_of_a_wall_free(tmp_path):
    """It put rollers there without a word: a wall with a free end could not fall."""
    bricks = [[[x, y], [x + 2, y], [x + 2, y + 1], [x, y + 1], [x, y]] for x in (0, 2) for y in (0, 1)]
    write_map(tmp_path / "wall.geojson", *(feature("Polygon", [ring]) for ring in bricks))
    done = convert(tmp_path / "wall.geojson", tmp_path / "wall", blocks=True, template=True)
    boundaries = [row for row in (tmp_path / "wall.nml").read_text().splitlines() if row.startswith("&boundary")]
    assert boundaries == ["&boundary        along = 0,0, 4,0, kind = 'fixed' /"]
    (told,) = (problem.message for problem in done.problems if "holds the model" in problem.message)
    assert told.endswith("by &boundary: fixed along 0,0, 4,0; the sides of the blocks are free")


@pytest.mark.parametrize("ending", ["dxf", "geojson"])
def test_polygons_are_blocks_that_run(tmp_path, program, ending):
    drawn_wall(tmp_path / f"wall.{ending}")
    done = convert(tmp_path / f"wall.{ending}", tmp_path / "wall", blocks=True, template=True)
    assert [path.name for path in done.files] == ["wall.blk", "wall.nml"]
    output = tmp_path / "wall.h5"
    run = subprocess.run(
        [program, "run", tmp_path / "wall.nml", "-o", output, "--steps", "3", "--quiet"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    results = rockdda.open(output)
    assert results.block_area.tolist() == [2, 2, 1, 2]
    assert results.block_material.tolist() == [1, 1, 2, 2]
    assert set(results.edge_joint.tolist()) == {3 if ending == "geojson" else 1}
    assert results.point_blocks("fixed").tolist() == [0, 1]
    assert any("4 blocks (by material 1: 2, 2: 2)" in row for row in done.taken)
    if ending == "dxf":
        assert [row.split(": ")[1] for row in done.left] == [
            "1 open LWPOLYLINE on layer 'BRICK' of blocks",
            "1 measured point outside of blocks",
        ]
        # outlines that rockdda-post exports come back
        again = results.frames[0]
        rockdda.convert.dxf.write_dxf(again, tmp_path / "again.dxf")
        convert(tmp_path / "again.dxf", tmp_path / "again", scale=1)
        assert (tmp_path / "again.blk").read_text().count("block ") == 4


def test_polygons_that_are_no_blocks_are_named(tmp_path):
    write_map(tmp_path / "a.geojson", feature("Polygon", [[[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]]))
    with pytest.raises(rockdda.InputError, match="is no simple polygon: Self-intersection"):
        convert(tmp_path / "a.geojson", tmp_path / "a", blocks=True)
    write_map(tmp_path / "b.geojson", feature("LineString", [[0, 0], [9, 0], [9, 9]], kind="block"))
    with pytest.raises(rockdda.InputError, match="a LineString cannot be a block: that takes Polygons"):
        convert(tmp_path / "b.geojson", tmp_path / "b", blocks=True)


def mesh(points, faces):
    vertex = {str(k): dict(zip("xyz", point, strict=True)) for k, point in enumerate(points)}
    return {"dtype": "compas.datastructures/Mesh", "data": {"vertex": vertex, "face": dict(enumerate(faces))}}


def test_meshes_and_assemblies_of_compas(tmp_path, program):
    points = [(x, y, 0.0) for y in (0, 1, 2) for x in (0, 1, 2)]
    flat = mesh(points, [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [8, 7, 4, 5]])
    (tmp_path / "flat.json").write_text(json.dumps(flat))
    convert(tmp_path / "flat.json", tmp_path / "flat")
    assert rockdda.cut(tmp_path / "flat.blk").areas.tolist() == [1, 1, 1, 1]
    # two voussoirs that stand in the plane x-z, 0.4 thick, in an assembly
    boxes = []
    for x in (0.0, 1.0):
        corners = [(x, 0, 0), (x + 1, 0, 0), (x + 1, 0, 2), (x, 0, 1)]
        solid = corners + [(a, 0.4, c) for a, _, c in corners]
        faces = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
        boxes.append(mesh(solid, faces))
    nodes = {str(k): {"block": box} for k, box in enumerate(boxes)}
    assembly = {"dtype": "compas_assembly.datastructures/Assembly", "data": {"graph": {"data": {"node": nodes}}}}
    (tmp_path / "arch.json").write_text(json.dumps(assembly))
    done = convert(tmp_path / "arch.json", tmp_path / "arch")
    assert rockdda.cut(tmp_path / "arch.blk").areas == pytest.approx([1.5, 1.5], rel=1e-9)
    assert any("the plane of the model is x-z" in text for text in done.messages)
    (tmp_path / "none.json").write_text('{"dtype": "compas.geometry/Frame", "data": {}}')
    with pytest.raises(rockdda.InputError, match="no mesh, polygon or block of COMPAS"):
        convert(tmp_path / "none.json", tmp_path / "none")


def test_the_command_prints_what_was_taken_and_what_not(tmp_path, capsys):
    drawn_wall(tmp_path / "wall.dxf")
    command = ["convert", str(tmp_path / "wall.dxf"), "--blocks", "-o", str(tmp_path / "wall")]
    assert main(command) == 0
    err = capsys.readouterr().err
    told = err[err.index("taken:") :].splitlines()
    assert told[0] == "taken:"
    assert "   4 blocks (by material 1: 2, 2: 2)" in told
    assert "not taken:" in told
    assert main([*command, "--force", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["not_taken"][0].endswith("1 open LWPOLYLINE on layer 'BRICK' of blocks")
