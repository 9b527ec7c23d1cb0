# SPDX-License-Identifier: MIT
"""Labelled models in Python: named materials, automatic numbers, and files that round-trip."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rockdda.materials import densities_and_weights

rockdda = pytest.importorskip("rockdda")
pytest.importorskip("rockdda._rockdda")

INPUTS = Path(__file__).resolve().parents[2] / "inputs"


def block_on_base(*, labelled: bool) -> rockdda.Model:
    """A block on a base that is fixed at two points."""
    model = rockdda.Model("pushed", e0=0.01, labelled=labelled)
    if labelled:
        model.steps = 12
        model.options = {"load": {"gravity": 9.81}}
        model.add_block_material(density=2500, youngs_modulus=5e9, poisson_ratio=0.25, name="Rock")
    else:
        model.steps, model.dt_max = 12, 0.002
        model.add_block_material(density=2500, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25, name="Rock")
    model.add_joint_material(friction_angle=30, cohesion=1e3, name="bedding", damping_ratio=0.1)
    model.add_joint_material(friction_angle=10, name="Clay")
    model.add_polygon([(0, 0), (4, 0), (4, 1), (0, 1)], joint="BEDDING ")
    for start, end in [((1, 1), (1, 2)), ((1, 2), (3, 2)), ((3, 2), (3, 1))]:
        model.add_line(start, end, joint="clay")
    model.add_fixed((0.5, 0.5))
    model.add_fixed((3.5, 0.5), table=[(0, 0, 0), (1, 0.01, 0)])
    model.add_loading((2, 1.5), table=[(0, 0, 0), (1, 3e4, 0)])
    model.add_measured((2, 1.5))
    return model


def same(a: rockdda.Results, b: rockdda.Results) -> bool:
    """Are histories and frames of two runs the same, bit for bit?"""
    names = ["history/time", "history/measured_displacement", "history/energy", "frames/vertices", "frames/stress"]
    return all(np.array_equal(np.asarray(a[name]), np.asarray(b[name])) for name in names)


@pytest.mark.parametrize("labelled", [True, False])
def test_files_of_a_model_round_trip(tmp_path, monkeypatch, labelled):
    """The labelled file does what the model in memory does; so does the model that is read from it."""
    monkeypatch.chdir(tmp_path)
    model = block_on_base(labelled=labelled)
    first = model.run(output="first.h5")
    paths = model.to_files(tmp_path / "files")
    assert [path.name for path in paths] == ["pushed.dc", "pushed.nml"]
    assert same(first, rockdda.run(paths[1], output="second.h5"))
    again = rockdda.Model.read(paths[1])
    assert again.labelled
    assert [material.name for material in again.block_materials] == ["Rock"]
    assert [material.name for material in again.joint_materials] == ["bedding", "Clay"]
    assert again.joint_materials[0].values["damping_ratio"] == 0.1
    assert same(first, again.run(output="third.h5"))
    # a second generation of files says the same
    paths = again.to_files(tmp_path / "again")
    assert same(first, rockdda.run(tmp_path / "again", output="fourth.h5"))


def test_automatic_numbers_stay_automatic(tmp_path):
    """What a labelled model does not give is neither written nor filled in by reading."""
    model = block_on_base(labelled=True)
    assert model.dt_max is None
    text = model.to_files(tmp_path)[1].read_text()
    assert "dt_max" not in text
    assert "stiffness" not in text
    again = rockdda.Model.read(tmp_path / "pushed.nml")
    assert (again.dt_max, again.stiffness, again.displacement_ratio, again.steps) == (None, None, None, 12)


def test_legacy_model_of_the_inputs_becomes_labelled(tmp_path, monkeypatch):
    """A model with base motion and options in files."""
    monkeypatch.chdir(tmp_path)
    model = rockdda.Model.read(INPUTS / "shaking_block")
    model.steps = 10
    model.to_files(tmp_path / "files")
    assert same(model.run(output="a.h5"), rockdda.run(tmp_path / "files", output="b.h5"))


def test_unknown_names_suggest_the_nearest(tmp_path):
    model = block_on_base(labelled=True)
    model.add_line((0, 0.5), (4, 0.5), joint="beddingg")
    with pytest.raises(rockdda.InputError, match="no joint material 'beddingg'; did you mean 'bedding'"):
        model.to_files(tmp_path)
    with pytest.raises(rockdda.InputError, match="either gravity or weight"):
        rockdda.Model().add_block_material(density=1, youngs_modulus=1, poisson_ratio=0)
    with pytest.raises(rockdda.InputError, match="no analysis file"):
        block_on_base(labelled=True).analysis_text()


def test_densities_of_a_labelled_file_tell_its_units(tmp_path, monkeypatch):
    """Pictures check stated units by density and weight, which a labelled file holds in groups."""
    monkeypatch.chdir(tmp_path)
    results = block_on_base(labelled=True).run(output="units.h5")
    found = densities_and_weights(str(results["input/analysis"]), str(results["input/config"]))
    assert found == [(2500.0, 2500 * 9.81)]
    legacy = "1 1 1 1 0.01 0.01\n1000 9810 1e8 0.2  0 0 0  0 0 0  0 0 0\n30 0 0\n"
    changed = "&block_material number = 1, density = 900 / &block_material number = 2, density = 5, unit_weight = 7 /"
    assert densities_and_weights(legacy, changed) == [(900.0, 9810.0), (5.0, 7.0)]


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda m: m.add_joint_material(phi=38), "'friction'"),
        (lambda m: m.add_joint_material(friction=38, kn=1e9), "'normal_stiffness'"),
        (lambda m: m.add_block_material(rho=2600), "'density'"),
        (lambda m: m.add_block_material(density=2600, young=5e9, nu=0.2), "'poisson'"),
        (lambda m: m.add_in_situ(surface=0.0, K=1.0), "'k0'"),
        (lambda m: m.add_region("a", rectangle=[0, 0, 1, 1]), "'box'"),
        (lambda m: m.add_bolt((0, 0), (1, 1), k=1e6), "'stiffness'"),
        (lambda m: m.add_lines([(0, 0, 1, 1)], joints=2), "'joint'"),
        (lambda m: rockdda.Model("b", g=9.81), "'gravity'"),
        (lambda m: rockdda.options.check_options({"earthquake": {}}), "'quake'"),
    ],
)
def test_the_usual_word_for_an_argument_names_the_one_that_is_there(call, meant):
    with pytest.raises(rockdda.InputError, match=f"did you mean .*{meant}") as found:
        call(rockdda.Model("a", labelled=True))
    assert isinstance(found.value, TypeError) or "options[" in str(found.value)
