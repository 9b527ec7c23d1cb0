# SPDX-License-Identifier: MIT
"""Conversion of DDAML, DXF and GeoJSON: the numbers, the messages, and that the program runs what comes out."""

import json
import math
import os
import subprocess
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import rockdda
from rockdda.convert import convert
from rockdda.convert.dxf import kinds_of_layers, write_dxf

ROOT = Path(__file__).resolve().parents[2]

DDAML = Path(os.environ.get("ROCKDDA_SHARED", ROOT.parent / "shared")) / "legacy/ddaml"
needs_ddaml = pytest.mark.skipif(not DDAML.exists(), reason="no legacy data (ROCKDDA_SHARED)")

GEOMETRY = """<?xml version="1.0"?>
<D:DDA xmlns:D="http://example.org/dda"><D:Geometry>
  <D:Edgenodedist distance="0.01"/>
  <Boundlist><Line> 0 0 4 0 </Line> <Line> 4 0 4 2 </Line> <Line> 4 2 0 2 </Line> <Line> 0 2 0 0 </Line></Boundlist>
  <Jointlist> <Joint type="2"> 2 0 2 2 </Joint> </Jointlist>
  <Matlinelist> <Line type="2"> 0.5 1 1.5 1 </Line> </Matlinelist>
  <Boltlist> <Bolt type="1"> 1 1.5 3 1.5 </Bolt> </Boltlist>
  <Fixedpointlist> <Point> 0.5 0.5 </Point> <Line> 2.5 0.2 3.5 0.2 </Line> </Fixedpointlist>
  <Loadpointlist> <Point> 3 1 </Point> <Point> 1 1 </Point> </Loadpointlist>
  <Measuredpointlist> <Point>1 1</Point> </Measuredpointlist>
</D:Geometry></D:DDA>
"""
MATERIAL = """<Blockmaterial type="1">
    <Unitmass> 2500 </Unitmass> <Unitweight> 24525 </Unitweight> <Youngsmod> 5e9 </Youngsmod>
    <Poissonratio> 0.25 </Poissonratio> <Istress> -1 -2 0.5 </Istress> <Ivelocity> 0.1 0.2 0.3 </Ivelocity>
  </Blockmaterial>"""
ANALYSIS = f"""<DDA><Analysis type="dynamic">
  <Analysistype type="dynamic"/> <Rotation type="exact"/> <Planestrain flag="yes"/>
  <Autopenalty flag="no" pfactor="20"/>
  <Numtimesteps timesteps="40"/> <Maxtimestep maxtimestep="0.002"/> <Mintimestep mintimestep="1e-5"/>
  <OCLimit maxopenclose="12"/> <Maxdisplacement maxdisplacement="0.01"/> <Saveinterval step="5"/>
  {MATERIAL}
  {MATERIAL.replace('type="1"', 'type="2"')}
  <Jointproperties type="1"><Friction> 30 </Friction></Jointproperties>
  <Jointproperties type="2">
    <Friction> 35 </Friction><Cohesion> 1e5 </Cohesion><Tensile> 2e4 </Tensile>
  </Jointproperties>
  <Boltproperties> 1e7 2e5 3e4 </Boltproperties>
  <Loadpointlist><Loadpoint numpoints="2"> 0 0 0; 1 1000 -500; </Loadpoint></Loadpointlist>
</Analysis></DDA>
"""


def numbers(path: Path) -> list[float]:
    """All numbers of a text file but those in comments."""
    lines = (line.split("#")[0] for line in path.read_text().splitlines())
    return [float(word) for line in lines for word in line.split()]


@pytest.fixture
def model(tmp_path):
    """A folder with a DDAML model."""
    (tmp_path / "wall.geo").write_text(GEOMETRY)
    (tmp_path / "wall.ana").write_text(ANALYSIS)
    return tmp_path


def run(program, *arguments, cwd):
    return subprocess.run([program, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, check=False)


def test_ddaml_gives_all_numbers(model, program, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    done = convert([model / "wall.geo", model / "wall.ana"], model)
    assert [path.name for path in done.files] == ["wall.dc", "wall.df", "wall.nml"]
    geometry = numbers(model / "wall.dc")
    assert geometry[:9] == [0.01, 5, 4, 1, 1, 2, 2, 1, 0]
    assert geometry[9 + 20 : 9 + 25] == [2, 0, 2, 2, 2]  # the joint comes after the boundary, with its material
    assert geometry[34:39] == [0.5, 1, 1.5, 1, 2]
    assert geometry[39:46] == [1, 1.5, 3, 1.5, 1e7, 3e4, 2e5]  # stiffness, pretension, strength
    assert geometry[46:54] == [0.5, 0.5, 0.5, 0.5, 2.5, 0.2, 3.5, 0.2]
    analysis = numbers(model / "wall.df")
    assert analysis[:7] == [1, 40, 2, 2, 0.01, 0.002, 20 * 5e9]
    # one fixed point and a fixed line with two ends in one block; two loading points, one of them without values
    assert analysis[7:12] == [0, 0, 0, 2, 0]
    assert analysis[12:18] == [0, 0, 0, 1, 1000, -500]
    assert analysis[18:31] == [2500, 24525, 5e9, 0.25, -1, -2, 0.5, 0, 0, 0, 0.1, 0.2, 0.3]
    assert analysis[44:] == [30, 0, 0, 35, 1e5, 2e4]
    options = (model / "wall.nml").read_text()
    for entry in ("length_scale = 'largest'", "rotation = 'exact'", "dt_min = 1e-05", "max_open_close = 12"):
        assert entry in options
    assert "plane = 'strain'" in options
    assert "save_every = 5" in options
    told = "\n".join(done.messages)
    assert "8:3: warning" not in told
    assert "wall.ana:5:3: warning: unknown element 'OCLimit'" in told
    assert "1 of 2 loading points have no values" in told


def test_converted_ddaml_runs(model, program, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    convert(model, model / "out")
    done = run(program, "run", "out.dc", "out.df", "--config", "out.nml", "-o", "out.h5", cwd=model)
    assert done.returncode == 0, done.stderr
    results = rockdda.open(model / "out.h5")
    assert results.n_steps >= 40
    assert sorted(results.block_material) == [1, 2]


def test_an_analysis_alone_counts_the_points_of_its_neighbour(model, program, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    convert(model, model / "both")
    done = convert(model / "wall.ana", model / "alone.df")
    assert numbers(model / "alone.df") == numbers(model / "both.df")
    assert any("points are counted in" in message for message in done.messages)
    (model / "wall.geo").unlink()
    with pytest.raises(rockdda.InputError, match="name the geometry file, too"):
        convert(model / "wall.ana", model / "nothing")


def test_misspelt_keys_are_taken_for_what_was_meant(model):
    text = GEOMETRY.replace("Measuredpointlist", "Measuredpointslist").replace("<Joint type", "<joint typ")
    (model / "wall.geo").write_text(text.replace("</Joint>", "</joint>"))
    done = convert(model / "wall.geo", model / "out")
    told = "\n".join(done.messages)
    assert "wall.geo:10:3: warning: unknown element 'Measuredpointslist' (which DDA for Windows ignores) is tak" in told
    assert "unknown element 'joint'" in told
    assert "unknown attribute 'typ' of <Joint> is taken as 'type'" in told
    assert numbers(model / "out.dc")[:9] == [0.01, 5, 4, 1, 1, 2, 2, 1, 0]


JOINT = '<Joint type="2"> 2 0 2 2 </Joint>'
BAD = [
    (JOINT, JOINT.replace("2 0 2", "2 zero 2"), "5:34: error: joint 1: expected a number, found 'zero'"),
    (JOINT, JOINT.replace("2 0 2 2", "2 0 2"), "5:15: error: joint 1: expected 4 numbers, found 3"),
    (
        JOINT,
        JOINT.replace('"2"', '"1.5"'),
        "5:15: error: type of <Joint>: expected a whole number of at least 1, found",
    ),
    ('distance="0.01"', 'distance="-1"', "3:3: error: distance of <Edgenodedist> must be positive"),
    ("</Jointlist>", "", "error: the XML is broken: mismatched tag"),
    ('<D:Edgenodedist distance="0.01"/>', "", "error: no element 'Edgenodedist'"),
    ('<?xml version="1.0"?>', '<!DOCTYPE a [<!ENTITY b "c">]>', "entity 'b' is declared"),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_bad_ddaml_is_refused_with_its_place(model, old, new, message):
    (model / "wall.geo").write_text(GEOMETRY.replace(old, new))
    with pytest.raises(rockdda.InputError) as caught:
        convert(model / "wall.geo", model / "out")
    assert message in str(caught.value)
    assert caught.value.file == str(model / "wall.geo")
    assert not list(model.glob("out*"))


def test_all_problems_are_reported_at_once_with_the_line_and_a_mark(model):
    text = ANALYSIS.replace('timesteps="40"', 'timesteps="many"').replace("0 0 0; 1 1000 -500;", "1 0 0; 0 5;")
    (model / "wall.ana").write_text(text.replace("<Poissonratio> 0.25", "<Poissonratio> 0.5", 1))
    with pytest.raises(rockdda.InputError) as caught:
        convert(model, model / "out")
    told = str(caught.value)
    assert len(caught.value.problems) == 3
    assert "timesteps of <Numtimesteps>: expected a number, found 'many'\n      <Numtimesteps timesteps=" in told
    assert "\n      ^" in told
    assert "load point 1, record 2: expected t fx fy, found 2 numbers" in told
    assert "Poissonratio of block material 1 must be between -1 and 0.5, found 0.5" in told


def test_existing_files_are_kept_without_force(model, program, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    (model / "wall.df").write_text("mine")
    with pytest.raises(rockdda.InputError, match="the file exists"):
        convert(model, model)
    assert (model / "wall.df").read_text() == "mine"
    assert not (model / "wall.dc").exists()
    convert(model, model, force=True)
    assert (model / "wall.df").read_text() != "mine"


@needs_ddaml
def test_pushed_block_moves_as_newton_says(tmp_path, program):
    """Mass 450, force 5000, no friction: 1/2 a t^2 = 5.4450 at t = 0.99, to a tenth of a percent."""
    convert([DDAML / "pushblock.geo", DDAML / "pushblock.ana"], tmp_path)
    files = ["pushblock.dc", "pushblock.df", "--config", "pushblock.nml", "--steps", "99", "-o", "out.h5"]
    done = run(program, "run", *files, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    frame = rockdda.open(tmp_path / "out.h5").frame_at(0.99)
    assert math.isclose(frame.time, 0.99, rel_tol=1e-12)
    pushed = int(np.argmax(frame.displacement[:, 0]))
    assert frame.displacement[pushed, 0] == pytest.approx(5.4450, rel=1e-3)
    assert frame.centroid[pushed, 0] == pytest.approx(22.945, rel=1e-3)


@needs_ddaml
@pytest.mark.parametrize("case", range(1, 9))
def test_fixed_lines_convert_and_run(tmp_path, program, case):
    convert(DDAML / f"fixedlines/case{case}.geo", tmp_path / "case", template=True)
    done = run(program, "cut", "case.dc", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # both ends of each part in a block: one block, and two blocks in cases 5 and 6
    blocks = 2 if case in (5, 6) else 1
    found = json.loads(done.stdout)
    assert (found["blocks"], found["fixed_points"]) == (blocks, 2 * blocks)
    done = run(program, "run", "case.nml", "--steps", "20", "-o", "case.h5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def drawing(path):
    """A square with an arc over it, a joint within a block reference, a hole and a bolt."""
    document = ezdxf.new("R2010")
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (4, 0), (4, 3), (0, 3)], close=True, dxfattribs={"layer": "Boundary"})
    space.add_arc((2, 3), 1, 0, 180, dxfattribs={"layer": "FAULT"})
    joint = document.blocks.new("JOINT")
    joint.add_line((0, 0), (0, 3), dxfattribs={"layer": "bedding"})
    space.add_blockref("JOINT", (1, 0))
    space.add_polyline2d([(2, 0), (3, 1), (3, 3)], dxfattribs={"layer": "joint_5"})
    space.add_point((2, 1), dxfattribs={"layer": "hole_points"})
    space.add_circle((0.2, 0.2), 0.1, dxfattribs={"layer": "measured"})
    space.add_point((0.5, 0.5), dxfattribs={"layer": "fixed"})
    space.add_line((0.5, 1), (1.5, 1), dxfattribs={"layer": "bolts"})
    space.add_text("a title", dxfattribs={"layer": "0"})
    document.saveas(path)


def test_dxf_layers_become_materials(tmp_path):
    drawing(tmp_path / "wall.dxf")
    done = convert(tmp_path / "wall.dxf", tmp_path / "wall", template=True, e0=0.001)
    told = "\n".join(done.messages)
    assert "1 entities of type TEXT are ignored" in told
    assert "layer 'FAULT': 1 entities as joint 3" in told  # 1 is the boundary, bedding comes first
    found = numbers(tmp_path / "wall.dc")
    lines = int(found[1])
    rows = np.array(found[9 : 9 + 5 * lines]).reshape(-1, 5)
    assert found[2] == 4  # boundary lines
    np.testing.assert_array_equal(rows[:4, :4], [[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]])
    np.testing.assert_array_equal(rows[rows[:, 4] == 5][:, :4], [[2, 0, 3, 1], [3, 1, 3, 3]])
    np.testing.assert_array_equal(rows[rows[:, 4] == 2][:, :4], [[1, 0, 1, 3]])
    # the chords of the arc: ends on it, middles no farther inside than extent/2000
    arc = rows[rows[:, 4] == 3][:, :4]
    np.testing.assert_allclose(np.hypot(arc[:, 0] - 2, arc[:, 1] - 3), 1, atol=1e-12)
    middles = (arc[:, :2] + arc[:, 2:]) / 2
    assert np.hypot(*(middles - [2, 3]).T).min() > 1 - 4.0 / 2000
    assert found[3:9] == [0, 1, 1, 0, 1, 1]


def test_dxf_layers_can_be_named(tmp_path):
    assert kinds_of_layers(["Joint_2", "x", "a", "Fixed lines"], {"X": "material:4"}) == {
        "Joint_2": ("joint", 2),
        "x": ("material", 4),
        "a": ("joint", 1),
        "Fixed lines": ("fixed", 1),
    }
    drawing(tmp_path / "wall.dxf")
    with pytest.raises(rockdda.InputError, match="'spline' is no kind of line"):
        convert(tmp_path / "wall.dxf", tmp_path / "wall", layers={"FAULT": "spline"})
    done = convert(tmp_path / "wall.dxf", tmp_path / "wall", layers={"fault": "skip", "nothing": "joint:1"})
    assert any("there is nothing on a layer 'nothing'" in message for message in done.messages)


def test_blocks_return_from_dxf_as_they_were(flat_arch, tmp_path, program):
    """Blocks to DXF, DXF to lines, lines to blocks: the same number of blocks with the same areas."""
    results = rockdda.open(flat_arch)
    write_dxf(results.frames[0], tmp_path / "arch.dxf")
    polylines = ezdxf.readfile(tmp_path / "arch.dxf").modelspace().query("LWPOLYLINE")
    assert len(polylines) == results.n_blocks
    convert(tmp_path / "arch.dxf", tmp_path / "arch", layers={"block_material_1": "joint:1"}, e0=0.001)
    done = run(program, "cut", "arch.dc", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["blocks"] == results.n_blocks
    assert found["area_of_blocks"] == pytest.approx(results.block_area.sum(), rel=1e-9)


def test_broken_dxf_is_refused(tmp_path):
    path = tmp_path / "a.dxf"
    path.write_text("  0\nSECTION\n  2\nENTITIES\nnonsense\n")
    with pytest.raises(rockdda.InputError, match=r"a\.dxf: error: .*DXF"):
        convert(path, tmp_path / "a")
    drawing(path)
    text = path.read_text()
    path.write_text(text.replace("\nARC\n", "\nARC\n 40\nwide\n", 1))  # a radius that is no number
    with pytest.raises(rockdda.InputError, match=r"a\.dxf: error: the DXF drawing is broken: .*wide"):
        convert(path, tmp_path / "a")
    assert not list(tmp_path.glob("a.dc*"))
    ezdxf.new().saveas(path)
    with pytest.raises(rockdda.InputError, match="no lines"):
        convert(path, tmp_path / "a")


FEATURES = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {},
            "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]]},
        },
        {
            "type": "Feature",
            "properties": {"material": 2},
            "geometry": {"type": "MultiLineString", "coordinates": [[[1, 0], [1, 3]], [[2, 0], [2, 1], [4, 1]]]},
        },
        {"type": "Feature", "properties": {"kind": "fixed"}, "geometry": {"type": "Point", "coordinates": [0.5, 1]}},
        {"type": "Feature", "properties": None, "geometry": {"type": "MultiPoint", "coordinates": [[3, 2, 7]]}},
    ],
}


def as_text(data):
    """One feature per line."""
    return '{"type": "FeatureCollection", "features": [\n' + ",\n".join(map(json.dumps, data["features"])) + "\n]}\n"


def test_geojson_lines(tmp_path, program):
    (tmp_path / "map.geojson").write_text(as_text(FEATURES))
    convert(tmp_path / "map.geojson", tmp_path / "map", e0=0.01, template=True)
    found = numbers(tmp_path / "map.dc")
    assert found[:9] == [0.01, 7, 4, 0, 0, 1, 0, 1, 0]
    assert found[29:44] == [1, 0, 1, 3, 2, 2, 0, 2, 1, 2, 2, 1, 4, 1, 2]
    done = run(program, "run", "map.nml", "--steps", "5", "-o", "map.h5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert rockdda.open(tmp_path / "map.h5").n_blocks == 3


@pytest.mark.parametrize(
    ("old", "new", "message", "there"),
    [
        ("[2, 1]", '[2, "x"]', 'error: expected a number below 1e+30 in size, found "x"', '"x"'),
        (
            '"kind": "fixed"',
            '"kind": "glued"',
            "error: unknown kind 'glued' of a Point; the kinds are: joint",
            '{"type": "Point"',
        ),
        (
            '"material": 2',
            '"material": 2.5',
            "error: material of a LineString: expected a whole number",
            '{"type": "MultiLineString"',
        ),
        ('"MultiLineString"', '"Curve"', "error: expected a GeoJSON object, found type 'Curve'", '{"type": "Curve"'),
        ("[0.5, 1]", "[0.5 1]", "error: the JSON is broken", "1]}}"),
    ],
)
def test_bad_geojson_is_refused_with_its_place(tmp_path, old, new, message, there):
    path = tmp_path / "map.geojson"
    assert old in as_text(FEATURES)
    path.write_text(as_text(FEATURES).replace(old, new))
    with pytest.raises(rockdda.InputError) as caught:
        convert(path, tmp_path / "map")
    assert message in str(caught.value)
    line, column = caught.value.line, caught.value.column
    assert path.read_text().splitlines()[line - 1][column - 1 :].startswith(there)


def test_files_that_cannot_be_converted_are_reported(tmp_path):
    with pytest.raises(rockdda.InputError, match="no such file"):
        convert(tmp_path / "none.geo")
    (tmp_path / "a.dc").write_text("0.01\n4 0\n")
    with pytest.raises(rockdda.InputError, match="RockDDA's own files need no conversion"):
        convert(tmp_path / "a.dc")
    (tmp_path / "a.geo").write_text("<html><body/></html>")
    with pytest.raises(rockdda.InputError, match="is XML, but not DDAML"):
        convert(tmp_path / "a.geo")
    (tmp_path / "empty").mkdir()
    with pytest.raises(rockdda.InputError, match="a folder without DDAML files"):
        convert(tmp_path / "empty")
