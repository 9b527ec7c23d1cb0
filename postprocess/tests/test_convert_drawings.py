# SPDX-License-Identifier: MIT
"""Drawings and maps as they come: in millimetres, at national coordinates, with openings, areas, and traps."""

import json
import math
import subprocess
import time

import ezdxf
import ezdxf.xclip
import numpy as np
import pytest
import rockdda
from rockdda.convert import convert
from rockdda.convert.dxf import read_dxf
from rockdda.convert.geojson import places_of


def section(path, unit=1.0, code=6, at=(0.0, 0.0), opening="polyline", outline="AREA"):
    """A rock mass of 40 × 30 with a tunnel of 10 × 5 below an arch of radius 5, crossed by joints; unit in metres."""
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = code
    space = document.modelspace()

    def p(x, y):
        return ((at[0] + x) / unit, (at[1] + y) / unit)

    def line(a, b, layer):
        space.add_line(p(*a), p(*b), dxfattribs={"layer": layer})

    space.add_lwpolyline([p(0, 0), p(40, 0), p(40, 30), p(0, 30)], close=True, dxfattribs={"layer": outline})
    for k in range(1, 30):
        line((-2, k), (42, k + 0.5), "BEDDING")
    for k in range(1, 40, 2):
        line((k, -1), (k + 1.5, 31), "CROSS")
    if opening == "polyline":
        corners = [(*p(15, 8), 0), (*p(25, 8), 0), (*p(25, 13), 1), (*p(15, 13), 0)]
        space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs={"layer": "OPENING_2"})
    elif opening == "lines":  # drawn one by one, in any direction, with ends that nearly meet
        line((15, 8), (25, 8.0005), "OPENING_2")
        line((25, 13), (25, 8), "OPENING_2")
        line((15, 13.0005), (15, 8), "OPENING_2")
        space.add_arc(p(20, 13), 5 / unit, 0, 180, dxfattribs={"layer": "OPENING_2"})
    document.saveas(path)


def cut(program, path):
    command = [program, "cut", path, "-o", path.with_suffix(".blk"), "--force", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def lines_of(path):
    """Rows x1 y1 x2 y2 material of all lines of a geometry file, and the number of boundary lines."""
    rows = [line.split("#")[0].split() for line in path.read_text().splitlines()]
    rows = [row for row in rows if row]
    count, boundary = map(int, rows[1])
    return np.array([list(map(float, row)) for row in rows[8 : 8 + count]]), boundary


ROCK = 40 * 30 - 10 * 5 - math.pi * 25 / 2


@pytest.mark.parametrize("opening", ["polyline", "lines"])
def test_nothing_stays_in_an_opening_that_joints_cross(tmp_path, program, opening):
    section(tmp_path / "a.dxf", opening=opening)
    convert(tmp_path / "a.dxf", tmp_path / "a")
    found = cut(program, tmp_path / "a.dc")
    # chords are at most 1/2000 of 40 inside the arch of length 16
    assert found["area_of_blocks"] == pytest.approx(ROCK, abs=0.02 * 16)
    rows, boundary = lines_of(tmp_path / "a.dc")
    middle = (rows[:, :2] + rows[:, 2:4]) / 2
    inside = (abs(middle[:, 0] - 20) < 4.9) & (middle[:, 1] > 8.1) & (middle[:, 1] < 13)
    assert not inside.any()
    assert not ((middle < -1e-9) | (middle > [40 + 1e-9, 30 + 1e-9])).any()
    assert set(rows[:boundary, 4]) == {1, 2}  # of the area and of the opening
    assert set(rows[boundary:, 4]) == {3, 4}


def test_an_opening_without_an_area_leaves_no_blocks_in_it(tmp_path, program):
    section(tmp_path / "a.dxf", outline="boundary")
    convert(tmp_path / "a.dxf", tmp_path / "a")
    convert(tmp_path / "a.dxf", tmp_path / "b", layers={"OPENING_2": "skip"})
    found, full = (cut(program, tmp_path / f"{name}.dc")["area_of_blocks"] for name in "ab")
    assert full - found == pytest.approx(40 * 30 - ROCK, abs=0.02 * 16)  # as above


def test_millimetres_become_metres(tmp_path):
    section(tmp_path / "m.dxf")
    section(tmp_path / "mm.dxf", unit=0.001, code=4)
    convert(tmp_path / "m.dxf", tmp_path / "m")
    done = convert(tmp_path / "mm.dxf", tmp_path / "mm")
    assert any("the drawing is in millimeters ($INSUNITS): lengths are converted" in text for text in done.messages)
    metres, millimetres = lines_of(tmp_path / "m.dc")[0], lines_of(tmp_path / "mm.dc")[0]
    np.testing.assert_allclose(millimetres, metres, rtol=0, atol=1e-11)  # round-off of the arch
    done = convert(tmp_path / "mm.dxf", tmp_path / "kept", scale=1)
    np.testing.assert_allclose(lines_of(tmp_path / "kept.dc")[0][:, :4], 1000 * metres[:, :4], rtol=0, atol=1e-8)
    convert(tmp_path / "mm.dxf", tmp_path / "chord", chord=0.5)
    assert len(lines_of(tmp_path / "chord.dc")[0]) < len(metres)


def test_a_drawing_without_a_unit_is_refused_when_it_is_large(tmp_path):
    section(tmp_path / "mm.dxf", unit=0.001, code=0)
    with pytest.raises(rockdda.InputError, match=r"states no unit .* extent is 44000: state its unit: --scale 0\.001"):
        convert(tmp_path / "mm.dxf", tmp_path / "a")
    convert(tmp_path / "mm.dxf", tmp_path / "a", scale=0.001)
    section(tmp_path / "m.dxf", code=0)
    done = convert(tmp_path / "m.dxf", tmp_path / "b")
    assert any("states no unit ($INSUNITS): its numbers are kept" in text for text in done.messages)
    np.testing.assert_allclose(lines_of(tmp_path / "a.dc")[0], lines_of(tmp_path / "b.dc")[0], rtol=0, atol=1e-11)
    # a file without a header: ezdxf alone would take it for one in metres
    text = "0\nSECTION\n2\nENTITIES\n"
    for x in (0, 10_000):
        text += f"0\nLINE\n8\n0\n10\n{x}\n20\n0\n11\n{x}\n21\n8000\n"
    (tmp_path / "bare.dxf").write_text(text + "0\nENDSEC\n0\nEOF\n")
    with pytest.raises(rockdda.InputError, match=r"states no unit .* extent is 10000"):
        convert(tmp_path / "bare.dxf", tmp_path / "d")
    section(tmp_path / "odd.dxf", code=99)
    with pytest.raises(rockdda.InputError, match=r"unknown unit \$INSUNITS = 99"):
        convert(tmp_path / "odd.dxf", tmp_path / "c")
    section(tmp_path / "small.dxf", code=4)  # drawn in metres, said to be in millimetres
    done = convert(tmp_path / "small.dxf", tmp_path / "d")
    assert any("extent is 0.044 m: if it was drawn in metres, --scale 1" in text for text in done.messages)


def test_far_coordinates_get_a_local_origin(tmp_path, program):
    section(tmp_path / "far.dxf", unit=0.001, code=4, at=(500_000, 6_800_000))
    done = convert(tmp_path / "far.dxf", tmp_path / "far")
    assert any("the origin is moved to 500000,6800000" in text for text in done.messages)
    assert (
        (tmp_path / "far.dc")
        .read_text()
        .startswith("# from far.dxf; lengths in m; the origin was at 500000, 6800000\n")
    )
    section(tmp_path / "near.dxf")
    convert(tmp_path / "near.dxf", tmp_path / "near")
    far, near = lines_of(tmp_path / "far.dc")[0], lines_of(tmp_path / "near.dc")[0]
    np.testing.assert_allclose(far, near, rtol=0, atol=1e-8)  # 6.8e9 mm keep 1e-6 mm
    convert(tmp_path / "far.dxf", tmp_path / "given", origin=(500_000e3, 6_800_010e3))
    np.testing.assert_allclose(lines_of(tmp_path / "given.dc")[0], far - [0, 10, 0, 10, 0], rtol=0, atol=1e-8)
    convert(tmp_path / "far.dxf", tmp_path / "kept", origin=(0, 0))
    assert lines_of(tmp_path / "kept.dc")[0][:, 1].min() > 6_799_000


def feature(shape, coordinates, **properties):
    return {"type": "Feature", "properties": properties, "geometry": {"type": shape, "coordinates": coordinates}}


def write_map(path, *features):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def test_traces_and_areas_from_two_files(tmp_path, program):
    """Traces across a round outcrop with a hole: what is left lies in it, and its area is that of the polygon."""
    angles = np.linspace(0, 2 * math.pi, 41)
    ring, hole = ([[5 + r * math.cos(a), 5 + r * math.sin(a)] for a in angles] for r in (5, 1))
    for rings in (ring, hole):
        rings[-1] = rings[0]
    write_map(tmp_path / "area.geojson", feature("Polygon", [ring, hole], kind="boundary"))
    write_map(tmp_path / "shape.geojson", feature("Polygon", [ring, hole]))
    traces = [feature("LineString", [[-2, k], [5, k + 0.2], [12, k]]) for k in range(10)]
    traces += [feature("LineString", [[k + 0.3, -3], [k + 0.7, 13]], material=2) for k in range(10)]
    write_map(tmp_path / "traces.geojson", *traces)
    convert(tmp_path / "traces.geojson", tmp_path / "out", areas=tmp_path / "shape.geojson")
    found = cut(program, tmp_path / "out.dc")
    area = 20 * math.sin(2 * math.pi / 40) * (5**2 - 1**2)
    assert found["area_of_blocks"] == pytest.approx(area, rel=1e-9)
    rows, boundary = lines_of(tmp_path / "out.dc")
    assert boundary == 80
    assert np.hypot(*(rows[:, [0, 1, 2, 3]].reshape(-1, 2) - 5).T).max() < 5 + 1e-12
    convert([tmp_path / "traces.geojson", tmp_path / "shape.geojson"], tmp_path / "two")
    assert lines_of(tmp_path / "two.dc")[0].tolist() == rows.tolist()
    # a kind that is given wins
    convert(tmp_path / "traces.geojson", tmp_path / "lines", areas=tmp_path / "area.geojson")
    assert len(lines_of(tmp_path / "lines.dc")[0]) == 80 + 30


@pytest.mark.parametrize("kind", ["area", "opening", "joint", "boundary"])
def test_block_materials_of_areas_and_joints_are_refused(tmp_path, kind):
    """They became the joint materials of outlines."""
    ring = [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]
    write_map(tmp_path / "a.geojson", feature("Polygon", [ring], kind=kind, block_material=2))
    with pytest.raises(rockdda.InputError, match=f"1:.*block_material of a Polygon of kind {kind}, .* kind material"):
        convert(tmp_path / "a.geojson", tmp_path / "a")
    write_map(
        tmp_path / "b.geojson",
        feature("Polygon", [ring], kind="area", block_material=None),
        feature("LineString", [[0, 1], [4, 1]], kind="material", block_material=2),
    )
    convert(tmp_path / "b.geojson", tmp_path / "b", force=True)
    assert (tmp_path / "b.dc").read_text().count("0  1  4  1  2") == 1


def test_properties_that_are_not_used_are_named(tmp_path):
    ring = [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]
    write_map(
        tmp_path / "a.geojson",
        feature("Polygon", [ring], kind="area", Material=2, name="sheet 1"),
        feature("LineString", [[-1, 1], [5, 1]], name="J1", dip=30),
        feature("LineString", [[-1, 2], [5, 2]], name="J2", joint_material=1),
    )
    problems = convert(tmp_path / "a.geojson", tmp_path / "out").problems
    assert [p.message for p in problems if "properties" in p.message] == [
        "properties that are not used, with the number of their features: 'name' (3), 'Material' (1), 'dip' (1); "
        "used are: kind, material, joint_material, block_material"
    ]
    assert {p.severity for p in problems} == {"note"}
    write_map(tmp_path / "b.geojson", feature("Polygon", [ring], kind="area", joint_material=2, block_material=1))
    assert convert(tmp_path / "b.geojson", tmp_path / "plain").problems == []
    # names are those of strangers: many, long, with control characters
    strange = {f"{'x' * 100}{i}": 0 for i in range(30)} | {"\x1b[2J": 0}
    write_map(tmp_path / "c.geojson", feature("Polygon", [ring], **strange))
    (note,) = convert(tmp_path / "c.geojson", tmp_path / "strange").problems
    assert note.message.isprintable()
    assert len(note.message) <= 500


def test_edges_between_areas_stay_and_portals_open(tmp_path, program):
    write_map(
        tmp_path / "a.geojson",
        feature("Polygon", [[[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]]),
        feature("Polygon", [[[4, 0], [8, 0], [8, 4], [4, 4], [4, 0]]], material=2),
        feature("Polygon", [[[1, 0], [2, 0], [2, 1], [1, 1], [1, 0]]], kind="opening", material=3),
        feature("LineString", [[6, -1], [6, 5]], material=4),
        feature("LineString", [[-1, 4], [9, 4]], material=4),  # on the outline
    )
    convert(tmp_path / "a.geojson", tmp_path / "a")
    found = cut(program, tmp_path / "a.dc")
    assert (found["blocks"], found["area_of_blocks"]) == (3, pytest.approx(31, rel=1e-12))
    rows, boundary = lines_of(tmp_path / "a.dc")
    assert set(rows[:boundary, 4]) == {1, 2, 3}
    assert rows[boundary:].tolist() == [[6, 0, 6, 4, 4]]


def test_random_openings_and_areas_leave_the_area_of_the_polygons(tmp_path, program):
    """30 maps of overlapping polygons: blocks fill the union of the areas without the openings, whatever crosses it."""
    shapely = pytest.importorskip("shapely")
    random = np.random.default_rng(3)
    for number in range(30):
        features, shapes = [], {"area": [], "opening": []}
        for kind in ("area",) * random.integers(1, 3) + ("opening",) * random.integers(0, 4):
            angles = np.sort(random.uniform(0, 2 * math.pi, 9))
            radius = random.uniform(4, 6) if kind == "area" else random.uniform(0.5, 1.5)
            ring = random.uniform(3, 7, 2) + radius * np.column_stack([np.cos(angles), np.sin(angles)])
            shapes[kind].append(shapely.Polygon(ring))
            features.append(feature("Polygon", [[*ring.tolist(), ring[0].tolist()]], kind=kind))
        for row in random.uniform(-3, 13, (25, 4)):
            features.append(feature("LineString", [row[:2].tolist(), row[2:].tolist()]))
        write_map(tmp_path / "a.geojson", *features)
        rock = shapely.union_all(shapes["area"]).difference(shapely.union_all(shapes["opening"]))
        convert(tmp_path / "a.geojson", tmp_path / "a", force=True)
        found = cut(program, tmp_path / "a.dc")
        # nodes within e0 = extent/10,000 of a line may move onto it: a strip of e0 along the lines at most
        assert found["area_of_blocks"] == pytest.approx(rock.area, abs=2e-3 * 25), number


def test_open_outlines_are_named(tmp_path):
    write_map(
        tmp_path / "a.geojson",
        feature("LineString", [[0, 0], [4, 0], [4, 4]], kind="area"),
        feature("LineString", [[4, 4], [0, 4], [0, 0.1]], kind="area"),
    )
    with pytest.raises(rockdda.InputError, match=r"kind area do not close to polygons: .* open end at 0, 0\.1"):
        convert(tmp_path / "a.geojson", tmp_path / "a")
    convert(tmp_path / "a.geojson", tmp_path / "a", e0=0.2)
    assert len(lines_of(tmp_path / "a.dc")[0]) == 4
    write_map(tmp_path / "b.geojson", feature("Polygon", [[[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]]))
    with pytest.raises(rockdda.InputError, match=r"an area at 0, 0 is no simple polygon: Self-intersection\[2 2\]"):
        convert(tmp_path / "b.geojson", tmp_path / "b")


def test_layers_keep_their_materials_in_a_second_drawing(tmp_path):
    for name, layers in (("a", ("x", "y")), ("b", ("w", "y"))):
        document = ezdxf.new()
        for k, layer in enumerate(layers):
            document.modelspace().add_line((k, 0), (k, 5), dxfattribs={"layer": layer})
        document.saveas(tmp_path / f"{name}.dxf")
    done = convert([tmp_path / "a.dxf", tmp_path / "b.dxf"], tmp_path / "c")
    kinds = [text.split("layer ")[1] for text in done.messages if "layer" in text]
    assert kinds == [f"'{a}': 1 entities as joint {b}" for a, b in (("x", 1), ("y", 2), ("w", 3), ("y", 2))]


def test_degrees_are_refused(tmp_path):
    write_map(tmp_path / "a.geojson", feature("LineString", [[24.1, 60.1], [24.2, 60.2]]))
    with pytest.raises(rockdda.InputError, match="seem to be degrees of longitude and latitude: --geographic"):
        convert(tmp_path / "a.geojson", tmp_path / "a")
    convert(tmp_path / "a.geojson", tmp_path / "a", scale=1)


# -- traps -----------------------------------------------------------------------------------------------------------


def refused(path, message, seconds=5.0):
    begin = time.process_time()
    with pytest.raises(rockdda.InputError, match=message) as caught:
        convert(path, path.with_suffix(""))
    assert time.process_time() - begin < seconds
    assert len(str(caught.value)) < 100_000
    return caught.value


def test_blocks_that_multiply_are_refused(tmp_path):
    bomb = ezdxf.new("R2010")
    for i in range(10):
        block = bomb.blocks.new(f"B{i}")
        if i == 0:
            block.add_line((0, 0), (1, 1))
        else:
            for k in range(10):
                block.add_blockref(f"B{i - 1}", (k, 0))
    bomb.modelspace().add_blockref("B9", (0, 0))
    bomb.saveas(tmp_path / "bomb.dxf")
    refused(tmp_path / "bomb.dxf", r"bomb\.dxf: error: the drawing shows more than 1000000 entities")
    grid = ezdxf.new("R2010")
    grid.blocks.new("B").add_line((0, 0), (1, 1))
    attributes = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}
    grid.modelspace().add_blockref("B", (0, 0), dxfattribs=attributes)
    grid.saveas(tmp_path / "grid.dxf")
    refused(tmp_path / "grid.dxf", "more than 1000000 entities")
    own = ezdxf.new("R2010")
    block = own.blocks.new("S")
    block.add_blockref("S", (1, 0))
    block.add_line((0, 0), (1, 1))
    own.modelspace().add_blockref("S", (0, 0))
    own.saveas(tmp_path / "self.dxf")
    refused(tmp_path / "self.dxf", r"self\.dxf: error: block 'S' of the drawing holds itself")


def test_rows_and_columns_of_a_block_are_all_there(tmp_path):
    grid = ezdxf.new("R2010")
    grid.blocks.new("B").add_line((0, 0), (1, 1))
    attributes = {"row_count": 2, "column_count": 3, "row_spacing": 5, "column_spacing": 7}
    grid.modelspace().add_blockref("B", (0, 0), dxfattribs=attributes)
    grid.modelspace().add_blockref("nowhere", (0, 0))
    grid.saveas(tmp_path / "grid.dxf")
    done = convert(tmp_path / "grid.dxf", tmp_path / "grid")
    assert sorted(map(tuple, lines_of(tmp_path / "grid.dc")[0][:, :2])) == [(x, y) for x in (0, 7, 14) for y in (0, 5)]
    assert any("INSERT (there is no block 'nowhere') are ignored" in text for text in done.messages)


def test_chords_have_a_smallest_size(tmp_path):
    section(tmp_path / "a.dxf")
    with pytest.raises(rockdda.InputError, match="chords are at most 1e-6 of the drawing's extent off"):
        convert(tmp_path / "a.dxf", tmp_path / "a", chord=1e-12)


LINE = '{"type":"LineString","coordinates":[[0,0],[1,1]]}'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f'{{"type":"Feature","properties":[1],"geometry":{LINE}}}', r"a\.geojson:1:32: error: properties: expected"),
        ('{"type":"LineString","coordinates":[[0,0],[' + "9" * 5000 + ",1]]}", r":1:44: error: expected a number"),
        ('{"type":"LineString","coordinates":[[0,0],[1e5000,1]]}', r"geojson:1:44: error: expected a number below"),
        ('{"type":"LineString","coordinates":[[0,0],[NaN,1]]}', r"geojson:1:44: error: expected a number below"),
        ('{"type":"MultiPoint","coordinates":[' + ",".join(['["a",0]'] * 200_000) + "]}", "950 more errors at least"),
        ('{"type":"GeometryCollection","geometries":[' * 400 + LINE + "]}" * 400, "nested more than 50 times"),
        ("[" * 1_000_000, "the JSON is nested too deeply"),
        (f'{{"type":"Feature","properties":{{"material":1e300}},"geometry":{LINE}}}', "whole number from 1 to 10000"),
        (f'{{"type":"Feature","properties":{{"kind":{"[" * 90 + "]" * 90}}},"geometry":{LINE}}}', "unknown kind"),
        ('{"type":["LineString"],"coordinates":[[0,0],[1,1]]}', r"expected a GeoJSON object, found type \['LineS"),
        ('{"type":"LineString","coordinates":"' + "x" * 10**6 + '"}', "without a list 'coordinates'"),
    ],
    ids=lambda text: "",
)
def test_hostile_maps_end_soon(tmp_path, text, message):
    (tmp_path / "a.geojson").write_text(text)
    refused(tmp_path / "a.geojson", message)


def test_places_are_those_of_the_values():
    """Against a slow search: the n-th value of a text that names its own place."""
    text = '{\n "a": [10, {"b": "x, [1]", "c": [\n[ 20 ]]}],\n "d": {"e": null}}'
    paths = {("a", 0): "10", ("a", 1, "b"): '"x, [1]"', ("a", 1, "c", 0, 0): "20", ("d", "e"): "null", ("d",): '{"e"'}
    found = places_of(text, [*paths, ("a", 7), ("nothing",)])
    assert set(found) == set(paths)
    for path, start in paths.items():
        line, column = found[path]
        assert text.split("\n")[line - 1][column - 1 :].startswith(start)


def test_what_ezdxf_logs_is_a_warning_once(tmp_path):
    path = tmp_path / "a.dxf"
    section(path)
    bad = "  0\nCLAS\n  1\nX\n" * 20_000
    path.write_text(path.read_text().replace("  2\nCLASSES\n", "  2\nCLASSES\n" + bad, 1))
    _, report, _ = read_dxf(path)
    assert [str(p) for p in report.problems if "CLAS" in str(p)] == [
        f"{path}: warning: Ignored invalid DXF entity type 'CLAS' in section CLASSES."
    ]


def test_hostile_ddaml_ends_soon(tmp_path):
    head = '<DDA><Geometry><Edgenodedist distance="0.01"/>'
    entities = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10 if i else "x"}">' for i in range(12))
    for text, message in (
        (f"<!DOCTYPE DDA [{entities}]>{head}&a11;</Geometry></DDA>", "entity 'a0' is declared"),
        (
            head + "<Jointlist>" + '<Joint type="1"> x 0 0 0 </Joint>' * 20_000 + "</Jointlist></Geometry></DDA>",
            "950 more",
        ),
        (head + "".join(f"<Jointlis{i}/>" for i in range(20_000)) + "</Geometry></DDA>", "more than 1000 unknown"),
        (
            head + '<Jointlist><Joint type="1000000000"> 0 0 1 1 </Joint></Jointlist></Geometry></DDA>',
            "of at most 10000",
        ),
        (head + f"<Jointlist><Joint> 0 0 1 {'9' * 5000} </Joint></Jointlist></Geometry></DDA>", "expected a number"),
        ("<a>" * 20_000, "the XML is broken"),
        ("<?xml vers" * 20_000, "the XML is broken"),
    ):
        (tmp_path / "a.geo").write_text(text)
        refused(tmp_path / "a.geo", message, 30.0)


def test_huge_files_are_not_read(tmp_path):
    for name in ("a.dxf", "a.geojson"):
        with (tmp_path / name).open("wb") as stream:
            stream.truncate(10**11)  # takes no room on the disk
        refused(tmp_path / name, "has more than 64 MB: files that large are not read")


@pytest.mark.parametrize(
    ("code", "scale", "unit_line"),
    [(6, None, "lengths in m"), (4, None, "lengths in m"), (4, 1.0, "lengths of the drawing times 1"),
     (0, None, "lengths as in a.dxf, which states no unit")],
)  # fmt: skip
def test_files_that_are_written_say_the_unit_of_their_lengths(tmp_path, code, scale, unit_line):
    section(tmp_path / "a.dxf", unit=0.001 if code == 4 else 1.0, code=code)
    convert(tmp_path / "a.dxf", output=tmp_path / "a", scale=scale, template=True)
    assert (tmp_path / "a.dc").read_text().splitlines()[0].startswith(f"# from a.dxf; {unit_line}")
    assert "units = 'SI'" in (tmp_path / "a.nml").read_text()


def test_large_drawings_are_refused_before_they_take_long(tmp_path):
    """150,001 lines took 14 s, 330,000 of 56 MB 50 s and 595 MB."""
    lines = "0\nSECTION\n2\nENTITIES\n" + "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n1\n21\n1\n" * 150_001
    vertices = "0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n8\n0\n" + "10\n0\n20\n0\n" * 800_000
    binary = b"AutoCAD Binary DXF\r\n\x1a\0" + bytes(5_000_000)
    for text, message in ((lines, "has 15000[0-9] entities"), (vertices, "has 320000[0-9] lines of text"),
                       (binary, "has 5000022 bytes in its binary form")):  # fmt: skip
        (tmp_path / "a.dxf").write_bytes(text if isinstance(text, bytes) else text.encode())
        begin = time.process_time()
        with pytest.raises(rockdda.InputError, match=message):
            convert(tmp_path / "a.dxf", output=tmp_path / "a")
        assert time.process_time() - begin < 2
    document = ezdxf.new("R2010")
    document.blocks.new("B").add_line((0, 0), (1, 1))
    grid = {"row_count": 400, "column_count": 400, "row_spacing": 1, "column_spacing": 1}
    document.modelspace().add_blockref("B", (0, 0), dxfattribs=grid)
    document.saveas(tmp_path / "a.dxf")
    with pytest.raises(rockdda.InputError, match="shows 160001 entities"):
        convert(tmp_path / "a.dxf", output=tmp_path / "a")


def clipped_drawing(path, nested=False, outside=False):
    """Joints x = 1 … 9 of length 10 in a block, inserted twice as large at 100, 0 and clipped to [2, 6] × [3, 8]."""
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 6
    block = document.blocks.new("JOINTS")
    for k in range(1, 10):
        block.add_line((k, 0), (k, 10), dxfattribs={"layer": "joint"})
    block.add_point((4, 4), dxfattribs={"layer": "measured"})
    block.add_point((1, 1), dxfattribs={"layer": "measured"})
    block.add_lwpolyline([(5, 5), (9, 5), (9, 6), (5, 6)], close=True, dxfattribs={"layer": "opening"})
    place = document.modelspace()
    if nested:
        place = document.blocks.new("OUTER")
        document.modelspace().add_blockref("OUTER", (100, 0), dxfattribs={"xscale": 2, "yscale": 2})
        insert = place.add_blockref("JOINTS", (0, 0))
    else:
        insert = place.add_blockref("JOINTS", (100, 0), dxfattribs={"xscale": 2, "yscale": 2})
    clip = ezdxf.xclip.XClip(insert)
    clip.set_block_clipping_path([(2, 3), (6, 8)])
    if outside:
        clip.invert_clipping_path([(0, 0), (10, 10)], ignore_acad_compatibility=True)
    document.modelspace().add_lwpolyline(
        [(100, 0), (120, 0), (120, 20), (100, 20)], close=True, dxfattribs={"layer": "boundary"}
    )
    document.saveas(path)


@pytest.mark.parametrize("nested", [False, True])
def test_what_a_clipping_path_hides_is_left_out(tmp_path, nested):
    clipped_drawing(tmp_path / "a.dxf", nested)
    done = convert(tmp_path / "a.dxf", output=tmp_path / "a", origin=(100, 0))
    rows, boundary = lines_of(tmp_path / "a.dc")
    upright = [(x, min(y1, y2), max(y1, y2)) for x, y1, other, y2, _ in rows[boundary:].tolist() if x == other]
    assert sorted(row for row in upright if row[0] < 10) == [(4, 6, 16), (6, 6, 16), (8, 6, 16)]
    # of the opening, x = 10 … 18 and y = 10 … 12, what is left of 12 is there
    assert sorted(row for row in upright if row[0] > 10) == [(12, 6, 10), (12, 12, 16)]
    assert (tmp_path / "a.dc").read_text().count("\n8  8\n") == 1  # the measured point inside alone
    assert "\n2  2\n" not in (tmp_path / "a.dc").read_text()
    assert "XCLIP" in "".join(done.messages)


def test_a_clipping_path_that_hides_its_inside_leaves_the_rest(tmp_path):
    clipped_drawing(tmp_path / "a.dxf", outside=True)
    convert(tmp_path / "a.dxf", output=tmp_path / "a", origin=(100, 0))
    rows, boundary = lines_of(tmp_path / "a.dc")
    at_8 = sorted(sorted(row[1:4:2]) for row in rows[boundary:].tolist() if row[0] == row[2] == 8)
    assert at_8 == [[0, 6], [16, 20]]
    assert "\n2  2\n" in (tmp_path / "a.dc").read_text()


def compas_file(path, transformation, shape=True):
    """Two unit squares in one assembly, the second with a transformation."""
    square = {"vertex": {str(i): dict(zip("xyz", p, strict=True)) for i, p in enumerate(
        [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)])}, "face": {"0": [0, 1, 2, 3]}}  # fmt: skip
    mesh = {"dtype": "compas.datastructures/Mesh", "data": square}
    second = {"geometry": mesh} if shape else {}
    elements = [{"dtype": "x/Block", "data": {"geometry": mesh, "transformation": None}},
                {"dtype": "x/Block", "data": second | {"transformation": transformation}}]  # fmt: skip
    path.write_text(json.dumps({"dtype": "x/Model", "data": {"elements": elements}}))


def test_a_transformation_of_a_compas_block_is_applied(tmp_path):
    # a quarter turn about y and a step of 5 in x
    matrix = [[0, 0, 1, 5], [0, 1, 0, 0], [-1, 0, 0, 2], [0, 0, 0, 1]]
    compas_file(tmp_path / "a.json", {"dtype": "compas.geometry/Transformation", "data": {"matrix": matrix}})
    convert(tmp_path / "a.json", output=tmp_path / "a")
    rows = [line.split() for line in (tmp_path / "a.blk").read_text().splitlines()]
    corners = {(float(row[0]), float(row[1])) for row in rows if len(row) == 3 and row[2] == "1"}
    assert corners == {(0, 0), (1, 0), (1, 1), (0, 1), (5, 2), (5, 1), (6, 1), (6, 2)}


@pytest.mark.parametrize(
    ("transformation", "shape", "message"),
    [
        ({"data": {"matrix": [[1, 0], [0, 1]]}}, True, "4 × 4"),
        ({"data": {"vector": [1, 0, 0]}}, True, "matrix"),
        ({"data": {"matrix": [[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}, False, "shape of its own"),
    ],
)
def test_a_transformation_that_cannot_be_applied_is_refused(tmp_path, transformation, shape, message):
    compas_file(tmp_path / "a.json", transformation, shape)
    with pytest.raises(rockdda.InputError, match=message):
        convert(tmp_path / "a.json", output=tmp_path / "a")
