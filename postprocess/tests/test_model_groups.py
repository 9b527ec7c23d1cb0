# SPDX-License-Identifier: MIT
"""Regions, boundaries, stress in the ground, water and stages of models in Python, and files that round-trip."""

import inspect
import warnings
from pathlib import Path

import numpy as np
import pytest
import rockdda
from places import INPUTS, assert_same_results
from rockdda.groups import OptionGroups
from rockdda.namelist import short_real
from rockdda.options import option_rows

pytestmark = pytest.mark.usefixtures("native")

LABELLED = sorted({path.parent.name for path in INPUTS.glob("*/*.nml") if "&model" in path.read_text()})
METHODS = {
    "add_region": "region", "subdivide": "subdivide", "add_boundary": "boundary", "add_in_situ": "in_situ",
    "add_water": "water", "add_stage": "stage", "add_change": "change", "add_line_load": "line_load",
}  # fmt: skip


def tunnel(name="tunnel"):
    """Four blocks in a frame of boundaries, of which one is dug out under a water table."""
    model = rockdda.Model(name, labelled=True, gravity=9.81)
    model.add_polygon([(0, 0), (10, 0), (10, 6), (0, 6)])
    model.add_lines([[0, 2, 10, 2], [0, 4, 10, 4], [5, 0, 5, 6]], joint="bedding")
    model.add_block_material(density=2600, young=20e9, poisson=0.25, name="rock")
    model.add_joint_material(friction=35, name="bedding", normal_stiffness=5e9, shear_stiffness=2e9)
    model.add_region("heading", box=(0, 2, 5, 4))
    model.add_region("floor", polygon=[(0, 0), (10, 0), (10, 2), (0, 2)])
    model.add_boundary([(0, 0), (10, 0)], "fixed")
    model.add_boundary([(0, 6), (0, 0)], "roller")
    model.add_boundary([(10, 0), (10, 6)], "roller")
    model.add_boundary([(0, 6), (10, 6)], "traction", pressure=1e5)
    model.add_in_situ(surface=6, k0=0.5, surcharge=1e5)
    model.add_water("pool", table=[(0, 3)], unit_weight=9810, joints=["bedding"], surfaces=False)
    model.add_stage("weight", until="equilibrium", water="none")
    model.add_stage("digging", until="equilibrium", excavate=["heading"], relax=0.5, reset_displacement=True)
    model.add_stage("end", until="equilibrium", relax=1, water=["pool"])
    model.add_change("digging", joint_material="bedding", friction=30)
    model.add_measured((2, 4.5))
    return model


def test_a_tunnel_is_dug_out(tmp_path):
    """What stands in the groups happens: the weight on the base in each stage, the block that is gone, the water."""
    results = tunnel().run(output=tmp_path / "tunnel.h5")
    assert results.stage_names == ["weight", "digging", "end"]
    assert results.boundary_kinds == ["fixed", "roller", "roller", "traction"]
    stage = results["history/stage"]
    weight = 2600 * 9.81 * 60 + 1e5 * 10
    base = results.boundary_force[:, 0, 1]
    assert base[np.flatnonzero(stage == 0)[-1]] == pytest.approx(weight, rel=1e-6)
    assert base[-1] == pytest.approx(weight - 2600 * 9.81 * 10, rel=1e-4)
    active = results.frames[-1].active
    assert np.flatnonzero(~active).size == 1
    np.testing.assert_allclose(results.block_centroid[~active], [[2.5, 3.0]])
    assert list(results["model/water_stage"]) == ["none", "none", "pool"]


def test_the_labelled_file_reads_as_people_write_it(tmp_path):
    text = tunnel().to_files(tmp_path)[1].read_text()
    assert text.splitlines()[:4] == [
        "&model          geometry = 'tunnel.dc' /",
        "&block_material number = 1, name = 'rock', density = 2600, young = 2e10, poisson = 0.25 /",
        "&joint_material number = 1, name = 'bedding', friction = 35, normal_stiffness = 5e9, shear_stiffness = 2e9 /",
        "&region         name = 'heading', box = 0, 2, 5, 4 /",
    ]
    assert "&boundary       along = 0, 6, 10, 6, kind = 'traction', pressure = 1e5 /" in text
    assert max(map(len, text.splitlines())) <= 120


@pytest.mark.parametrize(
    "value", [0.0, -0.0, 1.0, 1e5, 123e7, -2.5e10, 1e15, 1e16, 1e300, 0.1, 1 / 3, 5e-324, 100000.5]
)
def test_short_numbers_read_back(value):
    assert float(short_real(value)) == value
    assert len(short_real(value)) <= len(repr(value))


def test_mistakes_are_told_at_once():
    model = tunnel()
    with pytest.raises(rockdda.InputError, match="&boundary: pressuree: unknown name; did you mean 'pressure'"):
        model.add_boundary([(0, 0), (1, 0)], "traction", pressuree=3)
    with pytest.raises(rockdda.InputError, match="no group &boundaryy; did you mean 'boundary'"):
        model.add_group("boundaryy", kind="fixed")
    with pytest.raises(rockdda.InputError, match="&stage: until: expected one of 'equilibrium', found 'equilibriun'"):
        model.add_stage("x", until="equilibriun")
    with pytest.raises(rockdda.InputError, match="&subdivide: size: must be greater than 0, found -1"):
        model.subdivide("floor", size=-1, joint_material="bedding")
    with pytest.raises(rockdda.InputError, match=r"&boundary: 'along' is missing: points of the polyline \[length\]"):
        model.add_group("boundary", kind="fixed")
    with pytest.raises(
        rockdda.InputError, match="joint material: normal_stifness: unknown name; did you mean 'normal_st"
    ):
        model.add_joint_material(friction=3, normal_stifness=3)
    with pytest.raises(rockdda.InputError, match="joint material: give friction_angle or friction, not both"):
        model.add_joint_material(friction=3, friction_angle=4)
    with pytest.raises(rockdda.InputError, match="block material: give youngs_modulus or young"):
        model.add_block_material(density=1, poisson=0.2)
    assert model == tunnel()  # nothing of it has been kept


def test_names_of_nothing_are_told_with_their_place(tmp_path):
    """By the program, with line and column in the file that `to_files` writes."""
    model = tunnel()
    model.add_stage("more", until="equilibrium", excavate="headingg")
    with pytest.raises(rockdda.InputError, match="there is no region 'headingg'; did you mean 'heading'") as caught:
        model.run(output=tmp_path / "x.h5")
    text = model.to_files(tmp_path)[1].read_text().splitlines()
    assert caught.value.file == "tunnel.nml"
    assert "headingg" in text[caught.value.line - 1]


@pytest.mark.parametrize("method", METHODS)
def test_names_are_those_of_the_options_file(method):
    rows = option_rows(METHODS[method])
    named = inspect.signature(getattr(OptionGroups, method)).parameters.values()
    mine = {p.name for p in named if p.name != "self" and p.kind is not inspect.Parameter.VAR_KEYWORD}
    assert mine <= set(rows)
    assert all(name in mine for name in rows) or any(p.kind is inspect.Parameter.VAR_KEYWORD for p in named)


def test_groups_that_do_not_repeat_are_one():
    model = rockdda.Model()
    model.add_group("time", dt_min=1e-6)
    model.add_group("time", dt_min=1e-5, cut_factor=None, max_open_close=np.int64(30))
    model.add_group("stage", k01=0, duration=1.0)
    model.add_group("stage", release=np.array([1, 2]))
    model.add_region("weak", material=[2, "shale"])
    assert model.options == {
        "time": {"dt_min": 1e-5, "max_open_close": 30},
        "stage": [{"k01": 0, "duration": 1.0}, {"release": [1, 2]}],
        "region": [{"name": "weak", "material": "2, shale"}],
    }


def test_files_of_pressures_count_from_the_current_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text("x,y,p\n0,0,1e4\n10,0,1e4\n0,6,0\n10,6,0\n")
    model = tunnel()
    model.options["water"] = []
    model.add_water("pool", pressure_file="p.csv")
    again = rockdda.Model.from_files(model.to_files(tmp_path / "elsewhere")[1])
    assert again == model
    assert again.cut().n_blocks == 6


def test_equality():
    assert tunnel() == tunnel()
    assert tunnel() != tunnel("other")
    assert tunnel() != "tunnel"
    for change in (
        lambda m: m.add_measured((1, 1)),
        lambda m: m.add_line((0, 1), (10, 1)),
        lambda m: m.add_stage("more", duration=1.0),
        lambda m: setattr(m, "dt_max", 1.0),
        lambda m: setattr(m, "base_acceleration", [(0, 0, 0), (1, 1, 0)]),
        lambda m: setattr(m.block_materials[0], "density", 1.0),
        lambda m: m.add_fixed((1, 1), table=[(0, 0, 0)]),
    ):
        model = tunnel()
        change(model)
        assert model != tunnel()
    # the same said in other words
    model = tunnel()
    model.options["stage"] = tuple(model.options["stage"])
    model.options["region"][0]["box"] = np.array([[0.0, 2.0, 5.0, 4.0]])
    model.options["contact"] = {}
    assert model == tunnel()


# -- round trips -----------------------------------------------------------------------------------------------------


def random_model(seed: int) -> rockdda.Model:
    """A model of a grid of lines with random numbers of everything that a labelled file can hold."""
    rng = np.random.default_rng(seed)

    def number(low, high):
        value = rng.uniform(low, high)
        return float(rng.choice([float(f"{value:.3g}"), value, np.float32(value)]))

    def maybe(**values):
        return {name: value for name, value in values.items() if rng.random() < 0.5}

    n, m = rng.integers(2, 5, size=2).tolist()
    model = rockdda.Model(f"model{seed}", e0=number(1e-3, 1e-2), labelled=True, **maybe(gravity=number(1, 20)))
    for name, value in maybe(steps=int(rng.integers(1, 9)), dt_max=number(1e-4, 1e-2), k01=number(0, 1)).items():
        setattr(model, name, value)
    blocks = [f"rock {i}" if rng.random() < 0.7 else "" for i in range(rng.integers(1, 4))]
    joints = [f"Joint {i}" if rng.random() < 0.7 else "" for i in range(rng.integers(1, 4))]
    for name in blocks:
        model.add_block_material(
            density=number(1000, 3000), young=number(1e8, 1e11), poisson=number(0, 0.45), name=name,
            **maybe(unit_weight=number(1e4, 3e4), stress=(number(-1e5, 0), -1e5, 0.0), velocity=(0.0, 0.1, 0.0)),
        )  # fmt: skip
    for name in joints:
        strength = maybe(
            normal_stiffness=number(1e8, 1e10), damping_ratio=number(0, 0.2), brittle=bool(rng.random() < 0.5)
        )
        if rng.random() < 0.3:
            strength.pop("brittle", None)
            strength |= {"law": "residual", "residual_friction": 5.0, "slip_length": number(1e-3, 1e-2)}
        if rng.random() < 0.5:
            strength |= {"cohesion": number(1e3, 1e5)} | maybe(tension=number(200, 1e3))
        model.add_joint_material(friction=number(5, 60), name=name, **strength)

    def reference(names):
        i = int(rng.integers(len(names)))
        return names[i].upper() + " " if names[i] and rng.random() < 0.6 else i + 1

    for i in range(n + 1):
        model.add_line((i, 0), (i, m), joint=reference(joints), boundary=i in (0, n))
    for i in range(m + 1):
        model.add_line((0, i), (n, i), joint=reference(joints), boundary=i in (0, m))
    model.add_material_line((0.2, 0.5), (n - 0.2, 0.5), material=reference(blocks))
    table = [(0, 0, 0), (1, number(0, 1e-3), 0)]
    for _ in range(rng.integers(0, 3)):
        model.add_fixed((number(0.1, 0.9), 0.3), **maybe(end=(number(1.1, n - 0.1), 0.3), table=table))
    if rng.random() < 0.5:
        model.add_loading((0.5, m - 0.4), table=[(0, 0, 0), (1, number(0, 1e3), 1)] if rng.random() < 0.7 else ())
    if rng.random() < 0.5:
        model.add_measured((number(0.1, n - 0.1), 1.5))
    if rng.random() < 0.3:
        model.add_bolt(
            (0.5, 0.5), (0.5, 1.5), stiffness=number(1e5, 1e6), **maybe(pretension=number(0, 10), name="a bolt")
        )
    if rng.random() < 0.3:
        model.base_acceleration = np.cumsum(rng.uniform(0, 1, (4, 3)), axis=0)
    model.add_region("low", box=(0, 0, n, 1))
    model.add_region("Right side", circle=[(n - 0.5, m - 0.5, number(0.1, 0.4)), (n - 0.5, 1.5, 0.3)])
    if rng.random() < 0.5:
        model.add_region("low", material=reference(blocks))
    for along, kind in (([(0, 0), (n, 0)], "fixed"), ([(0, m), (0, 0)], "roller"), ([(0, m), (n, m)], "traction")):
        if rng.random() < 0.6:
            extra = (
                {"pressure": number(0, 1e5)} | maybe(table=[(0, 1), (1, number(0, 2))]) if kind == "traction" else {}
            )
            model.add_boundary(np.array(along, dtype=float), kind, **extra)
    if rng.random() < 0.5:
        where = {"profile": [(0, m), (n, m + 1)]} if rng.random() < 0.5 else {"surface": m}
        model.add_in_situ(**where, k0=number(0.3, 2), **maybe(surcharge=number(0, 1e5), region=["low", "right side"]))
    if rng.random() < 0.4:
        model.subdivide(
            size=number(0.4, 0.9), joint_material=reference(joints), **maybe(kind="triangles", region="LOW")
        )
    if rng.random() < 0.4:
        model.add_water("lake", table=[(0, 1), (n, 1.5)], unit_weight=9810, **maybe(joints=reference(joints)))
    for i in range(rng.integers(0, 4)):
        model.add_stage(
            f"stage {i}" if i != 1 else "it's night", duration=number(1e-4, 1e-3),
            **maybe(kind="static", gravity=number(0.5, 1), reset_displacement=True),
            **({"excavate": ["right side"]} | maybe(relax=number(0, 1)) if i == 1 else {}),
        )  # fmt: skip
        if i == 2:
            model.add_change("IT'S night", joint_material=reference(joints), friction=number(2, 50))
    if "stage" not in model.options and model.steps is None:
        model.steps = 3
    return model


def read_back(model, folder):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rockdda.InputWarning)
        paths = model.to_files(folder)
        return rockdda.Model.from_files(paths[1]), paths


@pytest.mark.parametrize("first", range(0, 200, 25))
def test_random_models_round_trip(first, tmp_path):
    """model → files → the same model → the same text."""
    for seed in range(first, first + 25):
        model = random_model(seed)
        again, paths = read_back(model, tmp_path / str(seed))
        assert again == model, seed
        _, others = read_back(again, tmp_path / f"{seed} again")
        assert [path.read_bytes() for path in others] == [path.read_bytes() for path in paths], seed


@pytest.mark.parametrize("seed", [1, 4, 9, 16, 25, 36])
def test_random_models_run_as_their_files(seed, tmp_path):
    """In memory, from the file, and from the model that the file gives: the same bits."""
    model = random_model(seed)
    again, paths = read_back(model, tmp_path / "files")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rockdda.InputWarning)
        one = rockdda.run(paths[1], output=tmp_path / "one.h5", steps=3)
        for name, source in (("two", model), ("three", again)):
            assert_same_results(one.path, source.run(output=tmp_path / f"{name}.h5", steps=3).path)


@pytest.mark.parametrize("name", LABELLED)
def test_models_of_the_inputs_round_trip(name, tmp_path):
    """A file written by hand → a model → files → the same model, which computes the same."""
    sources = [path for path in sorted((INPUTS / name).glob("*.nml")) if "&model" in path.read_text()]
    for source in sources:
        model = rockdda.Model.from_files(source)
        again, paths = read_back(model, tmp_path / source.stem)
        assert again == model
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rockdda.InputWarning)
            runs = [
                rockdda.run(path, output=tmp_path / f"{source.stem}{i}.h5", steps=2)
                for i, path in enumerate((source, paths[1]))
            ]
        assert_same_results(*(run.path for run in runs), except_for=("created", "title"), texts=False)
