# SPDX-License-Identifier: MIT
"""The studies of tunnels in inputs/: what they ask for, and that their template runs."""

import dataclasses
import json
import re
import subprocess
import textwrap

import h5py
import numpy as np
import pytest
import rockdda
from places import INPUTS, ROOT
from rockdda import cli
from rockdda.analysis.loosening import loosening_of
from rockdda.errors import InputError
from rockdda.study import Study, read_study
from rockdda.study.runner import collect, run_study
from rockdda_validation.case import Case, Record, published
from rockdda_validation.cases import ch7_joint_stiffness, ch7_time_step, closing_family
from rockdda_validation.tunnels import done, profile_of, with_formulation

FIFTY = INPUTS / "fifty_tunnels/fifty.toml"
MORE = INPUTS / "fifty_tunnels/more.toml"
PEER = INPUTS / "fifty_tunnels/peer.toml"
RULES = INPUTS / "fifty_tunnels/rules.toml"
RANDOM = INPUTS / "random_tunnels/random.toml"


def few_steps(study: Study, number: int, output) -> Study:
    """One case of a study, five steps long, or its first 2 ms."""
    case = study.cases[number - 1]
    return dataclasses.replace(
        study, output=output, cases=(dataclasses.replace(case, values={**case.values, "steps": 5}),)
    )


def test_the_fifty_are_those_of_the_analysis_matrix():
    matrix = published("chapter7")["matrix"]
    wanted = [(b, s, phi) for b in (10, 15) for s in matrix[f"spacing_{b}"] for phi in matrix["friction"]]
    cases = read_study(FIFTY).cases
    assert [(c.values["span"], c.values["spacing"], c.values["phi"]) for c in cases] == wanted
    assert len(cases) == 50
    parameters = published("chapter7")["parameters"]
    for case in cases:
        assert case.values["height"] == matrix["tunnel_height"]
        assert [case.values[name] for name in ("trace", "bridge", "randomness")] == [25, 1, 0]
        assert case.values["stiffness"] == parameters["stiffness"]
        assert case.values["steps"] == parameters["steps"]
        low, high = parameters["dt"]
        assert low <= case.values["dt"] <= high


def test_cases_of_the_validation_find_their_studies(tmp_path):
    record = Record(Case("x", "x", "Chapter 7", lambda record: None), tmp_path, tmp_path)
    for file in (FIFTY, PEER, RULES, RANDOM):
        assert done(record, str(file.relative_to(INPUTS))) == []


def test_the_study_of_dda_for_windows_changes_its_rules_only():
    for one, other in zip(read_study(FIFTY).cases, read_study(PEER).cases, strict=True):
        differing = {name: other.values[name] for name in one.values if other.values[name] != one.values[name]}
        assert set(differing) == {"rules"}
        assert "preset = 'peer'" in differing["rules"]


def test_rules_name_the_formulation_where_they_do_not_choose():
    assert with_formulation("", "length") == "  &contact formulation = 'length' /"
    rules = "  &contact close_tolerance = 2e-4 /"
    assert with_formulation(rules, "vertex") == "  &contact formulation = 'vertex', close_tolerance = 2e-4 /"
    for kept in ("  &contact preset = 'peer' /", "  &contact formulation = 'vertex' /"):
        assert with_formulation(kept, "length") == kept
    assert with_formulation(rules, "") == rules


def test_pairs_of_tunnels_are_of_the_fifty():
    """The first loosened in the thesis, the second stable."""
    drawn = closing_family.pairs(19)
    assert len(set(drawn)) == len(drawn) == 19
    for pair, loosened in ((drawn[0], True), (drawn[7], True)):
        heights = []
        for span, spacing, phi in pair:
            matrix = published("chapter7")["matrix"]
            row = published("chapter7")[f"span{span}"]["height"][matrix[f"spacing_{span}"].index(spacing)]
            heights.append(row[matrix["friction"].index(phi)])
        assert (heights[0] > 0) is loosened and heights[1] == 0
    assert ch7_time_step.subset(50) == ch7_time_step.subset(10) + ch7_time_step.subset(50)[10:]
    assert len(set(ch7_time_step.subset(50))) == 50


def test_beds_of_rigid_blocks_slip_at_their_sides_below_an_angle():
    """tan φ = 4 t/B: 21.80° over 10 m and 14.93° over 15 m, so that five of the fifty tunnels fall."""
    assert ch7_joint_stiffness.slips(10, 21.79) and not ch7_joint_stiffness.slips(10, 21.81)
    assert ch7_joint_stiffness.slips(15, 14.92) and not ch7_joint_stiffness.slips(15, 14.94)
    assert sum(ch7_joint_stiffness.slips(span, phi) for span, _, phi in ch7_time_step.subset(50)) == 5


def test_members_of_the_family_of_closing_rules():
    """Named in the options as they are; no penetration is the default."""
    assert closing_family.OURS.rules == "  &contact close_tolerance = 1e-12 /"
    assert closing_family.WINDOWS.rules == "  &contact close_tolerance = 0.0002, open_tolerance = 2e-07 /"
    for members in (closing_family.ROOF_MEMBERS, closing_family.TUNNEL_MEMBERS):
        assert {closing_family.OURS, closing_family.WINDOWS} <= set(members)
        assert len({member.name for member in members}) == len(members)
        assert {member.start for member in members} == {closing_family.CLOSED, closing_family.OPEN}


class Short:
    """History of a run that did its steps in 0.2 s of the planned 1 s: the crown falls, the point above rests."""

    def __init__(self) -> None:
        self.measured_points = np.array([[0.0, 0.0], [0.0, 4.5], [0.0, 8.5]])
        self.attributes = {"planned_time": 1.0}

    def __getitem__(self, name: str):
        times = np.linspace(0.001, 0.2, 200)
        if name == "history/time":
            return times
        moved = np.zeros((200, 3, 2))
        moved[:, 0, 1] = -5 * times**2
        return moved


def test_tunnels_that_are_thrown_apart_early_are_judged():
    """`rockdda-post loosening` refuses them, and they would end the whole case."""
    with pytest.raises(InputError, match="too short to judge"):
        loosening_of(Short())
    assert profile_of(Short()).height == 4.5


def test_random_study_has_twenty_realisations_a_cell():
    cases = read_study(RANDOM).cases
    assert len(cases) == 300
    ratios = {(c.values["spacing"] / c.values["span"], c.values["phi"]) for c in cases}
    assert ratios == {(ratio, phi) for ratio in (0.15, 0.2, 0.3) for phi in (20, 30, 40, 50, 60)}
    # the first thirty are two realisations of every cell
    assert {c.values["seed"] for c in cases[:30]} == {1, 2}
    assert len({tuple(sorted(c.values.items())) for c in cases}) == 300


@pytest.mark.parametrize(("file", "number"), [(FIFTY, 50), (PEER, 50), (MORE, 14), (RULES, 2), (RANDOM, 11)])
def test_template_runs(program, monkeypatch, capsys, tmp_path, file, number):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    study = few_steps(read_study(file), number, tmp_path / "out")
    (outcome,) = run_study(study, workers=1)
    assert (outcome.status, outcome.message) == ("done", "")
    row = collect(study).iloc[0]
    results = rockdda.open(row["results_file"])
    assert results.measured_points[:, 0].tolist() == [0] * 7
    assert results.measured_points[:, 1].tolist() == published("chapter7")["points"]["heights"]
    # nothing but the own weight has acted: everything falls, at most freely (t^2/2 at every step's end)
    profile = loosening_of(results)
    free = 0.5 * 9.81 * results["history/time"][-1] ** 2
    assert (profile.displacement < 0).all()
    assert (profile.displacement >= -1.01 * free).all()
    assert row["crown"] == profile.displacement[0]
    assert row["y28"] == profile.displacement[-1]

    # the command says the same
    assert cli.main(["loosening", row["results_file"], "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)["runs"]
    assert told["displacement"] == profile.displacement.tolist()
    assert told["gradient"] == [*profile.gradient.tolist(), None]
    # a fall that has just begun is a trend
    assert told["height"] is None
    assert not any(told["equilibrium"])
    assert cli.main(["loosening", row["results_file"]]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + 7 + 1
    assert lines[-1] == "loosened, beyond the highest point"
    assert cli.main(["loosening", row["results_file"], row["results_file"]]) == 0
    assert capsys.readouterr().out.count("out.h5: loosened, beyond the highest point\n") == 2
    assert cli.main(["loosening", row["results_file"], "--window", "2"]) == 2
    assert "--window: must be above 0 and at most 1, found 2" in capsys.readouterr().err
    assert cli.main(["loosening", row["results_file"], "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    results.close()
    with h5py.File(row["results_file"], "r+") as opened:
        opened.attrs["complete"] = np.int32(0)
    assert cli.main(["loosening", row["results_file"]]) == 0
    assert capsys.readouterr().out.endswith("beyond the highest point (the run has not come to its end)\n")


def test_the_models_of_the_tutorial_run(program, tmp_path):
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    for name in ("rock.dl", "rock.df"):
        block = re.search(rf"`{name}`[^\n]*\n\n((?:    .*\n)+)", page)
        (tmp_path / name).write_text(textwrap.dedent(block[1]), encoding="utf-8")

    def call(*arguments):
        command = [program, *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    assert "spacing 0.81116 +- 0.211 (wanted: 0.8)" in call("lines", "rock.dl")
    assert "364 blocks" in call("cut", "rock.dc")
    assert "0 errors" in call("check", "rock.dc", "rock.df")
    call("run", "rock.dc", "rock.df", "--save-every", "100", "--steps", "3", "--quiet")
    assert loosening_of(rockdda.open(tmp_path / "rock.h5")).heights.tolist() == [0, 1.5, 3, 4.5, 6, 7.5]

    # steps that are kept short: the run ends long before the time that its steps were to cover
    (tmp_path / "slow.nml").write_text("&time displacement_ratio = 1e-10 /\n", encoding="utf-8")
    call("run", "rock.dc", "rock.df", "--config", "slow.nml", "--steps", "3", "--quiet", "--force")
    with pytest.raises(InputError, match="of the planned"):
        loosening_of(rockdda.open(tmp_path / "rock.h5"))
