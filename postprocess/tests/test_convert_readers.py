# SPDX-License-Identifier: MIT
"""Readers of drawings and maps against independent ones, and what they leave out."""

import json
import math
import sqlite3
from collections import Counter

import ezdxf
import numpy as np
import pytest
import rockdda
from ezdxf import disassemble
from ezdxf.path import make_path
from rockdda.convert import convert
from rockdda.convert.dxf import read_dxf
from rockdda.convert.geojson import read_geojson
from rockdda.convert.gis import read_gis
from test_convert_drawings import feature, lines_of, write_map

shapely = pytest.importorskip("shapely")


def drawing(number):
    """A random drawing: lines and curves, also on layer 0 of blocks that are mirrored, turned, scaled and nested."""
    random = np.random.default_rng(number)
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6

    def place():
        return tuple(random.uniform(-5, 5, 2))

    def draw(space, layer):
        attributes = {"layer": layer}
        mirrored = attributes | ({"extrusion": (0, 0, -1)} if random.random() < 0.4 else {})
        corners = [(*place(), random.choice([0, 0, 0.5, -0.7, 1, -1])) for _ in range(random.integers(2, 6))]
        draws = [
            lambda: space.add_line(place(), place(), dxfattribs=attributes),
            lambda: space.add_lwpolyline(corners, "xyb", close=bool(random.integers(2)), dxfattribs=mirrored),
            lambda: space.add_polyline2d(corners, "xyb", close=bool(random.integers(2)), dxfattribs=mirrored),
            lambda: space.add_polyline3d([(x, y, 0) for x, y, _ in corners], dxfattribs=attributes),
            lambda: space.add_arc(place(), random.uniform(0.5, 3), *random.uniform(0, 360, 2), dxfattribs=mirrored),
            lambda: space.add_circle(place(), random.uniform(0.5, 3), dxfattribs=mirrored),
            lambda: space.add_ellipse(place(), (*place(), 0), 0.4, *random.uniform(0, 6, 2), dxfattribs=attributes),
            lambda: space.add_open_spline([(*place(), 0) for _ in range(6)], dxfattribs=attributes),
            lambda: space.add_spline([(*place(), 0) for _ in range(5)], dxfattribs=attributes),
        ]
        for k in random.integers(len(draws), size=2):
            draws[k]()

    draw(document.modelspace(), "plain")
    for name, inner in (("A", None), ("B", "A")):
        block = document.blocks.new(name)
        draw(block, "0" if random.random() < 0.5 else "own")
        if inner:
            block.add_blockref(inner, place(), {"layer": random.choice(["0", "deep"]), "rotation": 30})
    scales = {
        "xscale": random.choice([1, -1, 2]),
        "yscale": random.choice([1, 1.5]),
        "rotation": random.uniform(0, 360),
    }
    document.modelspace().add_blockref("B", place(), {"layer": "inserted", **scales})
    return document


def lines_within(document):
    """The lines that ezdxf itself sees: flattened, and joined to one shape."""
    shapes = []
    for entity in disassemble.recursive_decompose(document.modelspace()):
        points = [(p.x, p.y) for p in make_path(entity).flattening(1e-3)]
        if len(points) > 1:
            shapes.append(shapely.LineString(points))
    return shapely.MultiLineString(shapes)


def test_fifty_drawings_are_read_as_ezdxf_shows_them(tmp_path):
    for number in range(50):
        document = drawing(number)
        document.saveas(tmp_path / "a.dxf")
        geometry, _, unit = read_dxf(tmp_path / "a.dxf", chord=1e-2)
        assert unit == 1
        found = shapely.MultiLineString([[line[:2], line[2:]] for line, _ in geometry.joints])
        expected = lines_within(document)
        # chords are 1e-2 off at most, and those of ezdxf 1e-3 from curves that it draws with cubics (1e-3 of a radius)
        assert shapely.hausdorff_distance(found, expected) < 2e-2, number
        assert found.length == pytest.approx(expected.length, rel=1e-2), number


def shapes(random):
    """Random shapes of all kinds within 10 × 10, far from the origin."""

    def places(count):
        return [tuple(row) for row in (random.uniform(0, 10, (count, 2)) + np.array([500_000, 6_000_000])).tolist()]

    square = shapely.box(500_000, 6_000_000, 500_010, 6_000_010)
    hole = shapely.Point(places(1)[0]).buffer(0.5).intersection(square.buffer(-0.1))
    return [
        shapely.LineString(places(4)), shapely.MultiLineString([places(2), places(3)]), square.difference(hole),
        shapely.Point(places(1)[0]), shapely.MultiPoint(places(3)), shapely.LineString(), None,
        shapely.LineString([(x, y, 7.0) for x, y in places(3)]),
    ]  # fmt: skip


@pytest.mark.parametrize(("ending", "count"), [("geojson", 60), ("gpkg", 10), ("shp", 30)])
def test_a_hundred_maps_are_read_as_shapely_has_them(tmp_path, ending, count):
    geopandas = pytest.importorskip("geopandas")
    for number in range(count):
        drawn = shapes(np.random.default_rng(number))
        if ending == "shp":  # one kind in a file
            drawn = drawn[:2]
        table = geopandas.GeoDataFrame({"kind": ["joint"] * len(drawn)}, geometry=drawn, crs="EPSG:32633")
        table.loc[table.geometry.geom_type.isin(["Point", "MultiPoint"]), "kind"] = "measured"
        table.to_file(tmp_path / f"a.{ending}", engine="pyogrio")
        read = read_geojson if ending == "geojson" else read_gis
        geometry, report, system = read(tmp_path / f"a.{ending}")
        assert (system.kind, system.unit) == ("lengths", 1)
        expected = []
        for shape in drawn:
            if shape is not None and shape.geom_type not in ("Point", "MultiPoint"):
                lines = shape.boundary if shape.geom_type == "Polygon" else shape
                for part in shapely.get_parts(lines):
                    corners = np.array(shapely.force_2d(part).coords)
                    expected += np.hstack([corners[:-1], corners[1:]]).tolist()
        np.testing.assert_allclose([line for line, _ in geometry.joints], expected, rtol=0, atol=1e-9)
        if ending != "shp":
            assert len(geometry.measured) == 4
            assert sum(report.left.values()) == 2, report.left


def test_closed_splines_end_where_they_begin(tmp_path):
    """A periodic cubic is defined between its inner knots only; with the corners of a square it is nearly a circle."""
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6
    spline = document.modelspace().add_spline(dxfattribs={"layer": "block_1"})
    corners = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)]
    spline.set_closed(corners)
    document.saveas(tmp_path / "a.dxf")
    convert(tmp_path / "a.dxf", tmp_path / "a", chord=1e-4)
    # the area under a uniform B-spline: sums of products of the corners with the cubic's Gram matrix
    x, y = np.array(corners)[:, :2].T
    slopes = sum(w * np.roll(y, -k) for k, w in ((-3, -1), (-2, -56), (-1, -245), (1, 245), (2, 56), (3, 1))) / 720
    assert rockdda.cut(tmp_path / "a.blk").areas[0] == pytest.approx(float(x @ slopes), rel=1e-4)


def hatch_and_others(document):
    space, paper = document.modelspace(), document.layout("Layout1")
    for _ in range(2):
        space.add_hatch(dxfattribs={"layer": "fill"}).paths.add_polyline_path([(0, 0), (1, 0), (1, 1)])
    space.add_mtext("x", dxfattribs={"layer": "words"})
    space.add_solid([(0, 0), (1, 0), (1, 1)], dxfattribs={"layer": "fill"})
    space.add_polyline3d([(0, 0), (1, 1)], dxfattribs={"layer": "a"}).dxf.invisible = 1
    space.add_line((1, 1), (1, 1), dxfattribs={"layer": "a"})
    mesh = space.add_polyface(dxfattribs={"layer": "a"})
    mesh.append_face([(0, 0), (1, 0), (1, 1)])
    paper.add_line((0, 0), (1, 1))
    document.layers.add("gone").freeze()
    document.layers.add("dark").off()
    block = document.blocks.new("K")
    block.add_line((0, 0), (9, 9), dxfattribs={"layer": "0"})
    block.add_line((0, 1), (9, 1), dxfattribs={"layer": "A"})
    space.add_blockref("K", (0, 0), {"layer": "GONE"})
    space.add_blockref("K", (0, 0), {"layer": "Dark"})
    document.add_xref_def("far.dwg", "F")
    space.add_blockref("F", (0, 0), {"layer": "a"})
    space.add_line((0, 2), (9, 2), dxfattribs={"layer": "a"})
    space.add_point((1, 1), dxfattribs={"layer": "a"})


def test_all_that_is_left_out_is_listed_once_with_kind_count_and_layer(tmp_path):
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6
    hatch_and_others(document)
    document.saveas(tmp_path / "a.dxf")
    done = convert(tmp_path / "a.dxf", tmp_path / "a")
    assert sorted(row.split(": ", 1)[1] for row in done.left) == sorted([
        "2 entities of type HATCH on layer 'fill'",
        "1 entity of type MTEXT on layer 'words'",
        "1 entity of type SOLID on layer 'fill'",
        "1 entity of type POLYLINE on layer 'a', invisible",
        "1 LINE on layer 'a' without length",
        "1 entity of type POLYLINE (mesh) on layer 'a'",
        "1 entity of type LINE in paper space 'Layout1'",
        "1 entity of type INSERT on layer 'gone', which is frozen",
        "1 entity of type LINE on layer 'dark', which is off",
        "1 entity of type INSERT (of the drawing 'far.dwg', outside) on layer 'a'",
        "1 POINT on layer 'a' of lines",
    ])  # fmt: skip
    rows = lines_of(tmp_path / "a.dc")[0]
    assert sorted(rows.tolist()) == [[0, 1, 9, 1, 1], [0, 2, 9, 2, 1]]  # layers a and A are one


def test_outlines_open_by_round_off_are_closed(tmp_path):
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6
    space = document.modelspace()
    for x, gap in ((0, 1e-9), (5, -1e-9)):
        corners = [(x, 0), (x + 4, 0), (x + 4, 4), (x, 4), (x, gap)]
        space.add_lwpolyline(corners, dxfattribs={"layer": "block_1"})
    document.saveas(tmp_path / "a.dxf")
    convert(tmp_path / "a.dxf", tmp_path / "a")
    assert rockdda.cut(tmp_path / "a.blk").areas == pytest.approx([16, 16], rel=1e-8)


@pytest.mark.parametrize("flat", ["y", "x"])
def test_sections_drawn_upright_are_read_in_their_plane(tmp_path, flat):
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6
    space = document.modelspace()

    def p(x, z):
        return (x, 7, z) if flat == "y" else (7, x, z)

    for a, b in (((0, 0), (4, 0)), ((4, 0), (4, 3)), ((4, 3), (0, 3)), ((0, 3), (0, 0))):
        space.add_line(p(*a), p(*b), dxfattribs={"layer": "boundary"})
    document.saveas(tmp_path / "a.dxf")
    done = convert(tmp_path / "a.dxf", tmp_path / "a")
    assert rockdda.cut(tmp_path / "a.dc").areas == pytest.approx([12])
    assert any(f"the drawing is flat in {flat}" in text for text in done.messages)
    space.add_line((0, 0, 0), (1, 1, 1), dxfattribs={"layer": "boundary"})
    document.saveas(tmp_path / "b.dxf")
    assert any(
        "heights z, which differ by 3, are left out" in t for t in convert(tmp_path / "b.dxf", tmp_path / "b").messages
    )


@pytest.mark.parametrize(
    ("code", "metres"), [(1, 0.0254), (3, 1609.344), (8, 2.54e-8), (21, 1200 / 3937), (10, 0.9144)]
)
def test_all_units_of_drawings_are_exact(tmp_path, code, metres):
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = code
    document.modelspace().add_line((0, 0), (3, 4), dxfattribs={"layer": "boundary"})
    document.saveas(tmp_path / "a.dxf")
    convert(tmp_path / "a.dxf", tmp_path / "a")
    assert math.hypot(*lines_of(tmp_path / "a.dc")[0][0, 2:4]) == pytest.approx(5 * metres, rel=1e-15)


# -- reference systems -----------------------------------------------------------------------------------------------


def square_in(crs, at=(25.0, 60.0), size=100.0):
    """A square of `size` metres about a place, in another system, as PROJ has it."""
    pyproj = pytest.importorskip("pyproj")
    local = f"+proj=tmerc +lat_0={at[1]} +lon_0={at[0]} +ellps=WGS84"
    change = pyproj.Transformer.from_crs(local, crs, always_xy=True)
    h = size / 2
    return [change.transform(x, y) for x, y in ((-h, -h), (h, -h), (h, h), (-h, h), (-h, -h))]


def sides_of(path):
    """The lengths of all lines; a grid may turn them."""
    rows = lines_of(path)[0]
    return np.hypot(*(rows[:, 2:4] - rows[:, :2]).T).tolist()


@pytest.mark.parametrize(
    "name",
    [
        "EPSG:3857",
        "urn:ogc:def:crs:EPSG::3857",
        "urn:ogc:def:crs:OGC:1.3:CRS84",
        "EPSG:4326",
        "EPSG:32635",
        "EPSG:2225",
    ],
)
def test_the_crs_of_geojson_says_what_coordinates_are(tmp_path, name):
    at = (-122.0, 40.0) if name == "EPSG:2225" else (25.0, 60.0)
    ring = square_in("EPSG:4326" if "CRS84" in name else name.replace("urn:ogc:def:crs:EPSG::", "EPSG:"), at)
    data = {"type": "FeatureCollection", "features": [feature("Polygon", [ring])]}
    data["crs"] = {"type": "name", "properties": {"name": name}}
    (tmp_path / "a.geojson").write_text(json.dumps(data))
    done = convert(tmp_path / "a.geojson", tmp_path / "a")
    # UTM's own scale is 0.9996 in the middle
    assert sides_of(tmp_path / "a.dc") == pytest.approx([100] * 4, rel=2e-3)
    if "3857" in name:
        assert any("web Mercator" in text and "multiplied by 0.5," in text for text in done.messages)
    if name == "EPSG:2225":
        assert any("in units of 0.30480061 m" in text for text in done.messages)


def test_a_crs_in_lengths_keeps_numbers_that_look_like_degrees(tmp_path):
    line = feature("LineString", [[10.1, 20.2], [10.5, 20.9]])
    write_map(tmp_path / "a.geojson", line)
    with pytest.raises(rockdda.InputError, match="seem to be degrees"):
        convert(tmp_path / "a.geojson", tmp_path / "a")
    data = {
        "type": "FeatureCollection",
        "features": [line],
        "crs": {"type": "name", "properties": {"name": "EPSG:32633"}},
    }
    (tmp_path / "b.geojson").write_text(json.dumps(data))
    convert(tmp_path / "b.geojson", tmp_path / "b")
    assert lines_of(tmp_path / "b.dc")[0].tolist() == [[10.1, 20.2, 10.5, 20.9, 1]]
    for crs in ({"type": "name", "properties": {"name": "EPSG:1"}}, {"type": "link"}, 4326):
        (tmp_path / "c.geojson").write_text(json.dumps(data | {"crs": crs}))
        with pytest.raises(rockdda.InputError, match=r"reference system does not give lengths: 'EPSG:1'|crs: expected"):
            convert(tmp_path / "c.geojson", tmp_path / "c")


@pytest.mark.parametrize("crs", ["EPSG:3857", "EPSG:4326", "EPSG:32635"])
def test_geopackages_and_shapefiles_are_in_metres_whatever_their_system(tmp_path, crs):
    geopandas = pytest.importorskip("geopandas")
    ring = square_in(crs)
    for ending in ("gpkg", "shp"):
        geopandas.GeoDataFrame({"kind": ["area"]}, geometry=[shapely.Polygon(ring)], crs=crs).to_file(
            tmp_path / f"a.{ending}"
        )
        done = convert(tmp_path / f"a.{ending}", tmp_path / ending)
        assert sides_of(tmp_path / f"{ending}.dc") == pytest.approx([100] * 4, rel=2e-3), ending
        if crs == "EPSG:3857":
            assert any("multiplied by 0.5," in text for text in done.messages), ending
            (west, south), (east, north) = ring[0], ring[2]
            convert(
                tmp_path / f"a.{ending}",
                tmp_path / "w",
                window=(west, south, (west + east) / 2, north),
                origin=ring[0],
                force=True,
            )
            rows = lines_of(tmp_path / "w.dc")[0]
            assert rows[:, :4].max() == pytest.approx(100, rel=1e-3)
            assert rows[:, :4].min() == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize(
    ("first", "second", "names"),
    [
        ("EPSG:32632", "EPSG:32633", ("WGS 84 / UTM zone 32N", "WGS 84 / UTM zone 33N")),
        ("EPSG:26918", "EPSG:26718", ("NAD83 / UTM zone 18N", "NAD27 / UTM zone 18N")),
        ("EPSG:4267", "EPSG:4326", ("NAD27", "WGS 84")),
    ],
)
def test_maps_in_different_systems_are_refused(tmp_path, first, second, names):
    """They were merged as they are: 200 m apart for NAD27 and NAD83. One system is one, whoever wrote its text."""
    geopandas = pytest.importorskip("geopandas")
    ring = square_in(first, (-75.0, 40.0) if "EPSG:26" in first else (12.0, 47.0))
    frame = geopandas.GeoDataFrame({"kind": ["area"]}, geometry=[shapely.Polygon(ring)], crs=first)
    frame.to_file(tmp_path / "a.gpkg")
    frame.to_file(tmp_path / "same.shp")  # in the words of ESRI, without the number
    data = json.loads(frame.to_json()) | {"crs": {"type": "name", "properties": {"name": first}}}
    (tmp_path / "same.geojson").write_text(json.dumps(data))
    other = frame.to_crs(second)
    for path in (tmp_path / "b.gpkg", tmp_path / "b.shp"):
        other.to_file(path)
        with pytest.raises(
            rockdda.InputError, match=r"is in the reference system .*, the maps before in .*ogr2ogr"
        ) as e:
            convert([tmp_path / "a.gpkg", path], tmp_path / "x")
        assert f"before in {names[0]!r}" in str(e.value)
        assert path.suffix == ".shp" or f"system {names[1]!r}" in str(e.value)
    convert([tmp_path / "a.gpkg", tmp_path / "same.shp", tmp_path / "same.geojson"], tmp_path / "x")
    convert([tmp_path / "a.gpkg", tmp_path / "b.gpkg"], tmp_path / "y", scale=1.0)
    other.to_file(tmp_path / "a.gpkg", layer="other")
    with pytest.raises(rockdda.InputError, match=f"different reference systems: 'a' is in {names[0]!r}, 'other' in"):
        convert(tmp_path / "a.gpkg", tmp_path / "z")


PRJ = 'PROJCS["x",GEOGCS["g",UNIT["degree",0.0174532925199433]],PROJECTION["{method}"],UNIT["u",{unit}]]'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PRJ.format(method="Transverse_Mercator", unit="1e999"), "its unit 'u' of inf m is none of length"),
        (PRJ.format(method="Transverse_Mercator", unit="nan"), "of nan m is none of length"),
        (PRJ.format(method="Transverse_Mercator", unit="1-2"), "of nan m is none of length"),
        (PRJ.format(method="Transverse_Mercator", unit="-1"), "of -1 m is none of length"),
        (PRJ.format(method="Plate_Carree", unit="1"), "lengths are not true in its projection 'plate carree'"),
        (PRJ.format(method="Mercator", unit="1"), "lengths are not true in its projection 'mercator'"),
        ('LOCAL_CS["Undefined SRS",UNIT["unknown",0]]', "reference system does not give lengths: the file has none"),
        ('GEOGCS["g",UNIT["grad",0.015707963267949]]', "it counts angles in 'grad' of 0.015708 rad"),
        ('GEOCCS["g",UNIT["metre",1]]', "geocentric"),
    ],
)
def test_reference_systems_without_a_length_are_refused(tmp_path, text, message):
    geopandas = pytest.importorskip("geopandas")
    geopandas.GeoDataFrame(geometry=[shapely.LineString([(0, 0), (30, 40)])]).to_file(tmp_path / "a.shp")
    (tmp_path / "a.prj").write_text(text)
    with pytest.raises(rockdda.InputError, match=message):
        convert(tmp_path / "a.shp", tmp_path / "a")
    convert(tmp_path / "a.shp", tmp_path / "a", scale=1)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        (PRJ.format(method="Lambert_Conformal_Conic", unit="0.3048"), 0.3048),
        (f'COMPD_CS["c",{PRJ.format(method="Cassini", unit="0.3048")},VERT_CS["v",UNIT["m",1]]]', 0.3048),
        ('PROJCRS["p",BASEGEOGCRS["g"],CONVERSION["c",METHOD["Transverse Mercator"]],CS[Cartesian,2],'
         'AXIS["E",east],AXIS["N",north],LENGTHUNIT["foot",0.3048]]', 0.3048),
        ('PROJCRS["p",CONVERSION["c",METHOD["Transverse Mercator"]],CS[Cartesian,2],'
         'AXIS["E",east,LENGTHUNIT["foot",0.3048]],AXIS["N",north,LENGTHUNIT["foot",0.3048]]]', 0.3048),
        ('LOCAL_CS["mine",UNIT["foot",0.3048]]', 0.3048),
        ("nonsense", 1.0),
    ],
)  # fmt: skip
def test_units_of_reference_systems_are_found_in_both_versions(tmp_path, text, unit):
    geopandas = pytest.importorskip("geopandas")
    geopandas.GeoDataFrame(geometry=[shapely.LineString([(0, 0), (30, 40)])]).to_file(tmp_path / "a.shp")
    (tmp_path / "a.prj").write_text(text)
    done = convert(tmp_path / "a.shp", tmp_path / "a")
    assert lines_of(tmp_path / "a.dc")[0][0, :4].tolist() == pytest.approx([0, 0, 30 * unit, 40 * unit])
    assert any("in units of" in t or "no reference system that can be read" in t for t in done.messages)


# -- traps -----------------------------------------------------------------------------------------------------------


def test_shapes_that_claim_more_than_they_hold_are_refused(tmp_path):
    from fuzz_convert import SQL, gpkg_seed

    path = tmp_path / "a.gpkg"
    told = Counter()
    for statements in SQL:
        path.write_bytes(gpkg_seed())
        with sqlite3.connect(path) as file:
            file.executescript(statements)
        file.close()
        try:
            convert(path, tmp_path / "a", force=True)
            told["done"] += 1
        except rockdda.InputError as error:
            told[str(error).split(": ")[1][:24]] += 1
    assert told["done"] <= 3, told
    assert sum(told.values()) == len(SQL)


def test_a_geopackage_whose_names_are_no_text_is_refused(tmp_path):
    """Damage in the schema: SQLite hands names on that Python cannot decode."""
    from fuzz_convert import gpkg_seed

    path = tmp_path / "a.gpkg"
    data = gpkg_seed()
    for name in (b"gpkg_contents", b"CREATE TABLE"):
        path.write_bytes(data.replace(name, name[:-2] + b"\xf5\xa0"))
        with pytest.raises(rockdda.InputError):
            convert(path, tmp_path / "a", force=True)


@pytest.mark.parametrize(
    ("piece", "message"),
    [
        ("[],", "more than 2000000 lists and objects"),
        ("1,", "more than 6000000 values"),
        ('"":0,', "more than 2000000 members"),
        ("\n", "the JSON is broken"),
    ],
)
def test_json_that_swells_in_memory_is_refused(tmp_path, piece, message):
    # both formats are checked by the same code
    for name in ("a.geojson", "a.json") if piece == "1," else ("a.geojson",):
        head = '{"type":"compas","dtype":"compas","data":' if name == "a.json" else '{"type":"Point","coordinates":'
        (tmp_path / name).write_text(head + piece * 7_000_000)
        with pytest.raises(rockdda.InputError, match=message):
            convert(tmp_path / name, tmp_path / "a")
