# SPDX-License-Identifier: MIT
"""How sure a number is, with the program: same bits for any number of workers, kills, and refusals in words."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import rockdda
from places import EXTENSION, INPUTS, ROOT
from rockdda.certainty import convergence, reliability
from rockdda.certainty.failure import wilson
from rockdda.certainty.quantities import quantities_of
from rockdda.certainty.template import read_source
from rockdda.certainty.variants import PROPERTY, Variant, template_of, variants_of
from rockdda.cli import main
from rockdda.errors import InputError
from rockdda.report import report
from rockdda.study import collect, read_study, render, run_study

SLAB = "inputs/sau_mau_ping/full.nml"
VARY = "plane.cohesion = normal(1e5, 2e4); tan(plane.friction) = normal(0.70021, 0.10)"
FACE = """\
&boundary  vertices = 0,-1, 27,-1, 27,10, 5.7735,10, 0,0, joint_material = 2 /
&joint_set inclination = 35, spacing = 5, distribution = 'exponential', randomness = 0.5 /
&line      ends = 0,0, 26,0, joint_material = 2 /
&line      ends = 26,0, 26,10, joint_material = 2 /
&measured  points = 5.9,9.9 /
"""
FACE_MODEL = """\
&model           geometry = 'face.dc', title = 'Face with planes at random' /
&block_material  number = 1, name = 'rock', density = 2500, young = 20e9, poisson = 0.25 /
&joint_material  number = 1, name = 'plane', friction = 20 /
&joint_material  number = 2, name = 'firm', friction = 60, cohesion = 50e6, tension = 50e6 /
&load            gravity = 9.81 /
&boundary        along = 0,0, 0,-1, 27,-1, kind = 'fixed' /
&boundary        along = 27,-1, 27,10, kind = 'fixed' /
&stage           name = 'weight', until = 'equilibrium' /
"""


@pytest.fixture
def folder(native, program, tmp_path, monkeypatch):
    """A folder to work in, with the models of the tests."""
    pytest.importorskip("scipy")
    monkeypatch.setenv("ROCKDDA_PROGRAM", str(Path(program).resolve()))
    monkeypatch.chdir(tmp_path)
    for name in ("sau_mau_ping", "arch_on_centring", "six_block_beam"):
        shutil.copytree(INPUTS / name, tmp_path / "inputs" / name)
    return tmp_path


def answer_of(folder, name):
    """An answer without the place of its files."""
    return (folder / f"{name}.json").read_bytes(), (folder / "table.csv").read_bytes()


def test_a_study_may_search_factors(folder):
    shutil.copytree("inputs/sau_mau_ping", "template", ignore=shutil.ignore_patterns("dry.nml", "half_full.nml"))
    text = Path("template/full.nml").read_text().replace("friction = 35, cohesion", "friction = {{phi}}, cohesion")
    Path("template/full.nml").write_text(text)
    Path("slope.toml").write_text(
        'template = "template"\n[parameters]\nphi = [30, 35]\n[run]\ncommand = "fos"\noptions = ["--joints", "plane"]\n'
        '[results.factor]\ndataset = "search/factor"\n'
    )
    study = read_study("slope.toml")
    run_study(study)
    table = collect(study)
    assert table["factor"].tolist() == pytest.approx([1.085, 1.199], abs=0.01)
    assert run_study(read_study("slope.toml")) == []
    Path("slope.toml").write_text(Path("slope.toml").read_text().replace('"fos"', '"check"'))
    with pytest.raises(InputError, match="command: must be one of run, fos, found 'check'"):
        read_study("slope.toml")


def test_a_reliability_is_that_of_the_closed_form(folder, capsys):
    assert main(["reliability", SLAB, "--vary", VARY, "--back-analysis", "1.0", "--json", "--jobs", "2"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["runs"] == len(found["factors"]) == 30
    assert found["beta"] == pytest.approx(1.38102, abs=0.03)
    assert found["failure_probability"] == pytest.approx(0.083636, abs=0.006)
    low, high = found["interval"]
    assert low < 0.083636 < high
    point = found["design_point"]
    assert point["plane.cohesion"] == pytest.approx(0.078817e6, rel=0.02)
    assert point["tan(plane.friction)"] == pytest.approx(0.611586, rel=0.02)
    assert sum(found["sensitivity"].values()) == pytest.approx(1.0)
    assert found["design_point_distance_interval"][0] < 1.38102 < found["design_point_distance_interval"][1]
    for name, share in found["sensitivity"].items():
        first, last = found["sensitivity_interval"][name]
        assert first < share < last
        assert f"{name} {100 * share:.0f} ± {50 * (last - first):.0f} %" in found["verdict"]
    assert len(found["back_analysis"]["pairs"]) > 10
    assert (folder / "full_reliability/reliability.png").stat().st_size > 20_000
    # once more, with other workers, from the start and from what is there
    first = answer_of(folder / "full_reliability", "reliability")
    assert main(["reliability", SLAB, "--vary", VARY, "--back-analysis", "1.0", "--quiet"]) == 0
    assert answer_of(folder / "full_reliability", "reliability") == first
    again = reliability(SLAB, VARY, back_analysis=1.0, jobs=1, output="again")
    assert answer_of(folder / "again", "reliability") == first
    assert "Spend money on plane.cohesion: measured exactly" in again.verdict
    errors = replace(again, surface=replace(again.surface, error=0.0752), distance_interval=(1.3, 1.4504))
    assert "left out by ± 0.075," in errors.verdict  # not rounded up to one digit
    assert re.search(r"\(1\.\d\d ± 0\.075 standard deviations from the middle\)", errors.verdict)
    unsure = replace(again, sensitivity_interval=dict.fromkeys(again.sensitivity, (0.3, 0.7)))
    assert "plane.cohesion (or tan(plane.friction): the runs do not separate them): measured exactly" in unsure.verdict
    assert len(again.table) == 30
    assert "<table" in again._repr_html_()
    for kind in ("histogram", "tornado", "surrogate", "back-analysis"):
        again.plot(kind)
    with pytest.raises(InputError, match="there is no picture 'networks'"):
        again.plot("networks")


def test_dask_gives_the_same_bits(folder):
    pytest.importorskip("distributed")
    options = {"runs": 6, "tolerance": 0.05}
    reliability(SLAB, "plane.cohesion = uniform(0.8e5, 1.2e5)", jobs=2, output="here", **options)
    reliability(SLAB, "plane.cohesion = uniform(0.8e5, 1.2e5)", dask="local", jobs=2, output="dask", **options)
    assert answer_of(folder / "here", "reliability") == answer_of(folder / "dask", "reliability")


KILLED = {
    "reliability": ["--vary", "plane.cohesion = uniform(0.8e5, 1.2e5)", "--runs", "12"],
    "convergence": ["--fos", "--joints", "plane", "--quantity", "factor"],
}


@pytest.mark.parametrize("command", KILLED)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_study_that_is_killed_continues_with_the_same_bits(folder, number, command):
    arguments = [command, SLAB, *KILLED[command], "--jobs", "1"]
    code = f"import rockdda; rockdda.__path__.append({str(EXTENSION)!r}); from rockdda.cli import run; run()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "postprocess")}

    place = Path("runs/cases" if command == "reliability" else "factor/runs/cases")

    def done(study):
        return len(list((folder / study / place).glob("*/out.json")))

    with subprocess.Popen([sys.executable, "-c", code, *arguments], env=environment, stderr=subprocess.PIPE) as process:
        begin = time.monotonic()
        while done(f"full_{command}") < 2 and time.monotonic() - begin < 120:
            time.sleep(0.02)
        process.send_signal(number)
        process.communicate()
    assert process.returncode == (4 if number == signal.SIGTERM else -number)
    before = done(f"full_{command}")
    assert main([*arguments, "--quiet"]) == 0
    assert main([*arguments, "--quiet", "-o", "whole"]) == 0
    assert 2 <= before < done("whole")
    assert answer_of(folder / f"full_{command}", command) == answer_of(folder / "whole", command)


def test_networks_drawn_anew_stop_when_the_interval_is_narrow(folder):
    """TRUTHS-3: a plane of Poisson's set daylights in the face with the chance 1 - exp(-4.880/5) = 0.623."""
    Path("face.dl").write_text(FACE)
    Path("face.nml").write_text(FACE_MODEL)
    subprocess.run([os.environ["ROCKDDA_PROGRAM"], "lines", "face.dl", "--quiet"], check=True)
    search = {"to": 2.0, "joints": "plane", "tolerance": 0.1}
    found = reliability("face.nml", seeds=30, precision=0.2, jobs=2, **search)
    assert found.stopped and found.runs == 20
    assert found.interval[0] <= 0.6232 <= found.interval[1]
    assert found.interval == wilson(found.failed, 20)
    assert found.factors.count(None) == 20 - found.failed  # those that stand have none
    assert "runs without a factor" in found.verdict
    assert reliability("face.nml", seeds=30, precision=0.2, **search).verdict == found.verdict
    with pytest.raises(InputError, match=r"there is no statistics file .*sau_mau_ping.dl"):
        reliability(SLAB, seeds=3)


def test_what_cannot_be_is_refused_before_any_run(folder, capsys):
    for arguments, message in (
        ([], "nothing is to vary"),
        (["--vary", "plane.friction = normal(3, 3)"], "run 3 would have friction: must be at least 0"),
        (["--vary", VARY, "--runs", "3"], "2 inputs take at least 5 runs, found 3"),
        (["--vary", "plane.friction = normal(35, 5)", "--back-analysis", "1"], "takes two inputs"),
        (["--vary", VARY, "--search", "tilt"], "--below says which critical tilt counts as failure"),
        (["--vary", VARY, "--correlate", "plane.cohesion, x = 0.1"], "'x' does not vary"),
    ):
        assert main(["reliability", SLAB, *arguments]) == 2
        assert re.search(message.replace("run 3", r"run \d+"), capsys.readouterr().err), message
    assert not Path("full_reliability").exists()
    arguments = ["reliability", SLAB, "--vary", VARY, "--runs", "5"]
    assert main([*arguments, "--joints", "plain"]) == 2  # the program knows its names
    assert "there is no joint material 'plain'; did you mean 'plane'?" in capsys.readouterr().err


def test_a_surface_that_does_not_fit_is_refused_in_words(folder, capsys):
    """The factor does not depend on the modulus of the rock."""
    arguments = ["reliability", SLAB, "--vary", "granite.young = uniform(15e9, 25e9)", "--runs", "8"]
    assert main([*arguments, "--json"]) == 3
    found = json.loads(capsys.readouterr().out)
    assert found["method"] == "counted"
    assert "no more than the interval of its search" in found["refusal"]
    assert found["interval"] == list(wilson(0, 8))
    assert main(arguments) == 3
    assert "No surface was used" in capsys.readouterr().out


def test_joint_stiffness_of_a_load_factor_is_that_of_its_search(folder):
    """A search of the load makes joints stiffer that have no stiffness of their own: twice and half start from there.

    Without that both made the joints of the bridge softer, and the load smaller by 2 and 6 %."""
    model = INPUTS / "arch_bridge"
    found = convergence(model, quantities=["factor"], fos=True, search="load", loads="axle", jobs=2).as_json()
    (load,) = found["quantities"]
    assert load["value"] == pytest.approx(229.8, rel=0.01)  # limit analysis
    assert 0 <= load["plus_minus"][PROPERTY] <= 0.01 * load["value"]
    assert load["changes"]["joints × 2 as stiff"] >= 0 >= load["changes"]["joints ÷ 2 as stiff"]


def test_convergence_of_a_model_in_stages(folder, capsys):
    """The step of an arch on its centring does not matter, the stiffness of its joints does."""
    model = "inputs/arch_on_centring"
    assert main(["convergence", model, "--json", "--jobs", "2"]) == 3
    found = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in found["variants"]][:3] == ["as it is", "step ÷ 2", "step ÷ 4"]
    last = found["quantities"][-1]
    assert (last["name"], last["stage"]) == ("point 1 y", "striking")
    assert last["method"] < 2e-3 * abs(last["value"])
    assert last["joints"] == max(abs(last["changes"][name]) for name in ("joints × 2 as stiff", "joints ÷ 2 as stiff"))
    assert last["exceeds"] == ["joint stiffness"]
    assert "(a property: measure it)" in last["verdict"]
    assert "measure it" in found["summary"]
    results = rockdda.run(model, output="plain.h5")
    stages = results["history/stage"]
    assert last["value"] == results["history/measured_displacement"][stages == 2][-1][0][1]  # as it is: the same bits
    assert main(["convergence", model, "--limit", "80%", "--quiet"]) == 0
    first = answer_of(folder / "arch_on_centring_convergence", "convergence")
    again = convergence(model, limit=0.8, jobs=1, output="again")
    assert answer_of(folder / "again", "convergence") == first
    assert len(again.table) == len(again.findings) == 2
    assert "<table" in again._repr_html_()
    text = report(results, folder / "arch.html").read_text()
    assert "<h3>Numbers and their ±</h3>" in text and "joint stiffness" in text
    Path("inputs/arch_on_centring/arch_on_centring.nml").write_text(
        Path("inputs/arch_on_centring/arch_on_centring.nml").read_text().replace("friction = 35", "friction = 36")
    )
    other = rockdda.run(model, output="arch_on_centring.h5")
    text = report(other, folder / "other.html").read_text()
    assert "is that of another version of the model: not shown" in text


@pytest.mark.parametrize("name", ["cantilever", "rocking_wall", "tunnel"])
def test_what_the_verdict_calls_safe_changes_by_less_when_all_is_refined_once_more(folder, name):
    """An eighth of the step, a quarter of the radius of corners and of the cells: docs/how-sure.md has more models."""
    shutil.copytree(INPUTS / name, folder / "inputs" / name)
    found = convergence(folder / "inputs" / name, jobs=2)
    finer = Variant("all refined", "step", step=0.125, corner=0.25, cells=0.25)
    for path in (found.folder / "model/template").iterdir():
        (folder / path.name).write_bytes(render(path, finer.values(0)))
    with (
        rockdda.run(folder / f"{name}.nml", output="finer.h5") as refined,
        rockdda.open(next((found.folder / "model/runs/cases").glob("0001_*")) / "out.h5") as base,
    ):
        by_name = {(one.name, one.stage): one for one in quantities_of(base)}
        end = float(base["history/time"][-1])
        for one in found.findings:
            value, _ = by_name[one.name, one.stage].read(refined, end)
            assert set(one.exceeds(found.limit)) <= {PROPERTY}
            assert abs(value - one.value) <= one.method


def test_convergence_of_a_run_that_ends_after_some_steps(folder):
    """Half the step takes four times as many to come to rest."""
    found = convergence("inputs/six_block_beam", quantities=["point 1 y", "max(history/max_displacement)"], jobs=2)
    point, largest = found.findings
    assert abs(point.changes["step ÷ 2"]) < 1e-3 * abs(point.value)
    assert point.extrapolated is None  # it slips with a quarter of the step
    assert "step" in point.exceeds(0.05)
    assert largest.value > 0
    assert found.exceeded
    with pytest.raises(InputError, match="quantity: expected a name such as point 1 y"):
        convergence("inputs/six_block_beam", quantities=["crown"])
    with pytest.raises(InputError, match="the factor needs --fos"):
        convergence("inputs/six_block_beam", quantities=["factor"])


def test_static_steps_that_only_bring_to_rest_are_as_many_as_it_takes(folder):
    """Steps half as long need four times as many; with twice as many this roof is still 13 % above its rest."""
    shutil.copytree(INPUTS / "layered_roof", folder / "inputs/layered_roof")
    for one in convergence("inputs/layered_roof", jobs=2).findings:
        assert abs(one.changes["step ÷ 4"]) < 1e-3 * abs(one.value)
        assert set(one.exceeds(0.05)) <= {PROPERTY}


@pytest.mark.parametrize("name", ["supported_tunnel/supported_tunnel.nml", "bolted_slope/bars_dry.nml"])
def test_elements_of_linings_and_bolts_in_grout_are_a_number_of_the_method(folder, name):
    """The variant has half of the distances that the program finds, those that are not given as well."""
    shutil.copytree((INPUTS / name).parent, folder / "inputs" / Path(name).parent)
    with read_source(f"inputs/{name}") as source:
        (variant,) = (one for one in variants_of(source) if one.kind == "elements")
        Path("model.nml").write_text(template_of(source))
        Path("half.nml").write_bytes(render(Path("model.nml"), variant.values(0)))
        given = source.facts["elements"]
        with read_source("half.nml") as half:
            found = half.facts["elements"]
    assert {kind for kind, _ in given} == ({"bolt", "liner"} if "tunnel" in name else {"bolt"})
    assert found == {group: pytest.approx(element / 2) for group, element in given.items()}


def test_convergence_names_the_elements(folder):
    shutil.copytree(INPUTS / "bolted_slope", folder / "inputs/bolted_slope")
    for one in convergence("inputs/bolted_slope/bars_dry.nml", jobs=2).findings:
        assert one.plus_minus["elements"] == 2 * abs(one.changes["elements ÷ 2"])
        assert 0 < one.plus_minus["elements"] < one.plus_minus[PROPERTY]
        assert one.method >= one.plus_minus["elements"]


def test_convergence_of_a_factor(folder):
    found = convergence(SLAB, quantities=["factor"], fos=True, joints="plane", jobs=2)
    (factor,) = found.findings
    assert factor.value == pytest.approx(1.1988, abs=0.01)
    assert factor.plus_minus["search"] == pytest.approx(0.004, abs=0.001)
    assert not found.exceeded
    assert "± 0.004 by the search" in found.verdict
    # the point moves by 0.75 mm, which joints half as stiff nearly double: nothing beside a model of 106 m
    both = convergence(SLAB, fos=True, joints="plane", jobs=2)
    assert not both.exceeded
    assert "nothing beside the factor" in both.verdict
    assert convergence(SLAB, jobs=2, output="displacements").exceeded
    assert convergence(SLAB, fos=True, joints="plane", quantities=["point 1 y", "factor"], jobs=2).exceeded


def test_slurm_writes_an_array_that_runs_the_cases(folder, capsys):
    arguments = ["reliability", SLAB, "--vary", "plane.cohesion = uniform(0.8e5, 1.2e5)", "--runs", "4"]
    assert main([*arguments, "--slurm", "--json"]) == 0
    (script,) = json.loads(capsys.readouterr().out)["scripts"]
    text = Path(script).read_text()
    assert "#SBATCH --array=1,2,3,4" in text
    assert main([*arguments, "--slurm"]) == 0
    code = f"import rockdda; rockdda.__path__.append({str(EXTENSION)!r}); from rockdda.cli import run; run()"
    study = re.search(r"(\S+study.toml)", text)[1]
    for case in range(1, 5):
        command = ["study", study, "--output", str(Path(script).parent), "--case", str(case), "--quiet"]
        subprocess.run([sys.executable, "-c", code, *command], check=True,
                       env={**os.environ, "PYTHONPATH": str(ROOT / "postprocess")})  # fmt: skip
    assert main([*arguments, "--slurm"]) == 2
    assert "all runs are done" in capsys.readouterr().err
    assert main([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"] == 4
