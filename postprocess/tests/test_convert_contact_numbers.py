# SPDX-License-Identifier: MIT
"""One rule for g0, g1 and g2: pages, defaults, messages and the measured tables agree."""

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import h5py
import numpy as np
import pytest
from places import INPUTS, ROOT
from rockdda.convert import TEMPLATE_JOINT_STIFFNESS, convert
from rockdda.model import Model

PAGE = ROOT / "docs/contact-numbers.md"
MEASURED = ROOT / "docs/notes/contact-numbers.md"
RULE = ROOT / "src/model/data/contact_numbers.f90"
#: advice that contradicts the rule
OLD = re.compile(r"50·E|takes 50|50 times (the )?(largest )?(E\b|Young)|1 to 50 (times|E)|0\.005( to |–)0\.02")


@pytest.fixture(scope="module")
def measured() -> ModuleType:
    """The module that measures."""
    spec = importlib.util.spec_from_file_location("contact_numbers", ROOT / "benchmarks/contact_numbers.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # for its dataclasses
    spec.loader.exec_module(module)
    return module


def constant(name: str) -> float:
    found = re.search(rf"\b{name} = ([\d.e-]+)_wp", RULE.read_text(encoding="utf-8"))
    assert found is not None, name
    return float(found[1])


def test_no_other_page_or_message_has_a_rule_of_its_own():
    files = [
        *ROOT.glob("docs/*.md"),
        *ROOT.glob("docs/notes/*.md"),
        *ROOT.glob("inputs/**/*.md"),
        ROOT / "README.md",
        *ROOT.glob("src/**/*.f90"),
    ]
    files += ROOT.glob("postprocess/rockdda/*.py")
    assert len(files) > 100
    for path in files:
        assert not OLD.search(path.read_text(encoding="utf-8")), path
    for name in ("user-guide", "tutorial", "theory", "file-formats", "post-processing", "glossary"):
        assert "(contact-numbers.md" in (ROOT / f"docs/{name}.md").read_text(encoding="utf-8"), name


def test_the_page_has_the_numbers_of_the_program():
    text = PAGE.read_text(encoding="utf-8")
    assert constant("automatic_over_e") == 2
    assert "the automatic choice (0) takes twice the largest E of the model" in text
    assert f"({constant('preset_over_e'):g} times that with `preset = 'dda_windows'`" in text
    assert f"not above {constant('highest_over_e'):g} E" in text
    # the reasons are a note
    assert f"g0 when it is above {constant('far_over_e'):g} E" in MEASURED.read_text(encoding="utf-8")
    assert f"at most {constant('highest_omega'):g}·L·√(ρ/g0)" in text
    assert f"| {constant('share_of_edge'):g}·L/w0" in text
    assert f"| not above {constant('largest_ratio'):g} |" in text
    assert Model().displacement_ratio == constant("largest_ratio")
    assert Model().stiffness == 0
    assert f"{TEMPLATE_JOINT_STIFFNESS / 1e9:g} GPa/m, rough, somewhat weathered (`convert --template`)" in text


def test_the_table_of_joint_stiffness_follows_from_the_rule():
    head, *rows = re.findall(r"^\| (?:k_n|[\d.]+ GPa/m).*$", PAGE.read_text(encoding="utf-8"), re.M)
    edges = [float(x) for x in re.findall(r"L = ([\d.]+) m", head)]
    assert len(edges) == 5 and len(rows) == 5
    for row in rows:
        name, *cells = [cell.strip() for cell in row.strip("|").split("|")]
        stiffness = float(name.split()[0]) * 1e9
        assert [float(cell) for cell in cells] == pytest.approx([stiffness * edge for edge in edges], rel=1e-12)


def test_the_measured_tables_are_those_of_the_results(measured):
    rows = measured.read_results()
    assert {row["model"] for row in rows} == set(measured.STUDIES)
    assert measured.tables(rows).strip() in MEASURED.read_text(encoding="utf-8")


def test_the_tutorial_says_what_g0_does(measured):
    """Its verdict must hold and its figures be those measured."""
    rows = [row for row in measured.read_results() if row["model"] == "tutorial" and row["varied"] == "g0"]
    found = {float(row["g0_over_E"]) * 2e10: float(row["answer"]) for row in rows}
    assert all(row["status"] == "done" and float(row["loose"]) == 0 for row in rows)
    text = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    for stiffness, crown in found.items():
        power = f"{stiffness:.0e}".replace("e+0", "e").replace("e+", "e")
        assert re.search(rf"\| {power} \|.*\| {crown:.1f} mm \| stable", text), (power, crown)


def run(program: str, *arguments: object, cwd: Path) -> dict:
    command = [program, *map(str, arguments), "--json"]
    return json.loads(subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False).stdout)


def test_the_automatic_stiffness_is_twice_the_largest_modulus(program, tmp_path):
    (tmp_path / "o.nml").write_text("&contact stiffness = 0 /\n")
    done = run(program, "run", INPUTS / "stack/stack.dc", INPUTS / "stack/stack.df", "--config", "o.nml", cwd=tmp_path)
    assert done["status"] == "done"
    told = "\n".join(message["message"] for message in done["messages"])
    assert "contact stiffness (g0) is automatic: twice the largest E = 2e+10" in told
    with h5py.File(tmp_path / "stack.h5") as results:  # all at rest: the supports carry the weight
        assert results["history/fixed_force"][-1, :, 1].sum() == pytest.approx(220725, rel=1e-9)


@pytest.mark.parametrize(
    ("options", "warning"),
    [
        (
            "&contact stiffness = 2.01e12 /",
            "the contact stiffness (g0) is 201 times the largest E: take the joint stiff",
        ),
        (
            "&contact formulation = 'vertex', stiffness = 1.01e12 /",
            "the contact stiffness (g0) is 101 times the largest E: take half",
        ),
        # five cubes on a base 1 high: w0 = 3, the mean edge is 1.25
        ("&time displacement_ratio = 0.42 /", "g2 = 0.00833333 is advised"),
        ("&contact stiffness = 2e12 / \n &time displacement_ratio = 0.41 /", None),
    ],
)
def test_numbers_far_from_the_rule_are_named(program, tmp_path, options, warning):
    (tmp_path / "o.nml").write_text(options + "\n")
    done = run(
        program, "run", INPUTS / "stack/stack.dc", INPUTS / "stack/stack.df", "--config", "o.nml", "--steps", 1,
        cwd=tmp_path,
    )  # fmt: skip
    found = [message["message"] for message in done["messages"] if message["severity"] == "warning"]
    found = [text for text in found if "without equilibrium" not in text]  # after one step
    assert len(found) == (warning is not None)
    assert warning is None or warning in found[0]


def trace_map(seed: int) -> dict:
    """Short traces of two sets and of all directions in a window of 20 m: splinters, crossings at small angles."""
    rng = np.random.default_rng(seed)
    corners = [(-10, -10), (10, -10), (10, 10), (-10, 10), (-10, -10)]
    features = [({"kind": "boundary"}, "LineString", corners)]
    for strike, count in ((10, 160), (75, 140), (None, 100)):
        angle = np.radians(rng.normal(strike, 8, count)) if strike else rng.uniform(0, np.pi, count)
        length = rng.lognormal(np.log(2.5) - 0.32, 0.8, count)
        middle = rng.uniform(-10, 10, (count, 2))
        half = 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        reach = np.minimum(length / 2, ((10 - np.abs(middle)) / np.abs(half) / 2).min(axis=1))  # within the window
        ends = np.stack([middle - 2 * reach[:, None] * half, middle + 2 * reach[:, None] * half], axis=1).round(3)
        features += [({"kind": "joint"}, "LineString", one.tolist()) for one in ends]
    features += [({"kind": "fixed"}, "Point", [0.999 * x, 0.999 * y]) for x, y in corners[:4]]
    return {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "properties": kind, "geometry": {"type": shape, "coordinates": where}}
            for kind, shape, where in features
        ],
    }


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_trace_maps_run_with_the_template(program, tmp_path, seed):
    """Maps on which runs with g0 = 50 E, contacts at vertices and 5 ms ended in their first steps."""
    (tmp_path / "map.geojson").write_text(json.dumps(trace_map(seed)))
    convert(tmp_path / "map.geojson", tmp_path / "map", template=True)
    done = run(program, "run", "map.nml", "--steps", 12, "--threads", 1, cwd=tmp_path)
    assert done["status"] == "done" and done["blocks"] > 200


SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]


@pytest.mark.parametrize(
    ("ring", "points", "kinds"),
    [
        (SQUARE, 1, []),
        (SQUARE, 0, ["fixed", "roller", "roller"]),
        ([[0, 0], [2, 0], [3, 2], [0, 2], [0, 0]], 0, ["fixed", "roller"]),
        ([[0, 1], [1, 0], [2, 1], [1, 2], [0, 1]], 0, []),
    ],
)
def test_the_template_is_a_labelled_file_that_runs(program, tmp_path, ring, points, kinds):
    """It was an analysis file; a level base and upright sides hold a drawing without fixed points."""
    features = [{"type": "Polygon", "coordinates": [ring]}, {"type": "LineString", "coordinates": [[0, 1], [2, 1]]}]
    found = [{"type": "Feature", "properties": {}, "geometry": one} for one in features]
    fixed = {"type": "Point", "coordinates": [1, 0.5]}
    found += [{"type": "Feature", "properties": {"kind": "fixed"}, "geometry": fixed}] * points
    (tmp_path / "it's.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": found}))
    done = convert(tmp_path / "it's.geojson", tmp_path / "it's", template=True)
    assert [path.name for path in done.files] == ["it's.dc", "it's.nml"]
    text = done.files[1].read_text()
    assert re.findall(r"^&boundary.*kind = '(\w+)'", text, re.M) == kinds
    assert ("Nothing holds the model yet" in text) == (not kinds and not points)
    told = [problem.message for problem in done.problems if "holds the model" in problem.message]
    assert len(told) == (not points)
    assert re.findall(r"(fixed|roller) along", " ".join(told)) == kinds
    assert sum(line.startswith("!") for line in text.splitlines()) >= 10
    told = run(program, "check", "it's.nml", cwd=tmp_path)
    assert told["status"] == "done"
    assert [message["message"] for message in told["messages"] if message["severity"] == "error"] == []
    told = run(program, "run", "it's.nml", cwd=tmp_path)
    assert told["status"] == "done"
