# SPDX-License-Identifier: MIT
"""What pictures, films and exports show of excavated blocks, and the ground reaction."""

import subprocess
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import rockdda
from rockdda import plot
from rockdda.errors import InputError
from rockdda.export.grids import grids_of

mpl.use("Agg")
STACK = Path(__file__).parents[2] / "inputs/stack"
OPTIONS = """\
&contact formulation = 'length' /
&region name = 'top', box = -1,4,2,6 /
&stage name = 'weight', until = 'equilibrium' /
&stage name = 'half', until = 'equilibrium', excavate = 'top', relax = 0.5, reset_displacement = .true. /
&stage name = 'rest', until = 'equilibrium', relax = 1 /
"""


@pytest.fixture(scope="module")
def dug(program, tmp_path_factory) -> rockdda.Results:
    folder = tmp_path_factory.mktemp("stages")
    (folder / "dig.nml").write_text(OPTIONS)
    files = [STACK / "stack.dc", STACK / "stack.df", "--config", folder / "dig.nml", "-o", folder / "dig.h5"]
    subprocess.run([program, "run", *files, "--quiet"], check=True, capture_output=True)
    return rockdda.open(folder / "dig.h5")


def test_the_results_name_stages_and_active_blocks(dug):
    assert dug.stage_names == ["weight", "half", "rest"]
    table = dug.history()
    assert sorted(set(table["stage"])) == [0, 1, 2]
    ends = [table[table["stage"] == k].iloc[-1] for k in range(3)]
    assert [end["relaxation"] for end in ends] == [0, 0.5, 1]
    assert all(end["unbalanced"] <= 1e-5 for end in ends)
    assert dug.frames[0].active.all()
    top = int(np.argmax(dug.block_centroid[:, 1]))
    assert np.flatnonzero(~dug.frames[-1].active).tolist() == [top]


def test_excavated_blocks_are_gaps_in_pictures_and_left_out_of_exports(dug, tmp_path):
    last = dug.frames[-1]
    gone = np.repeat(~last.active, np.diff(dug.vertex_offset))
    assert np.isnan(last.shown_vertices[gone]).all()
    assert np.array_equal(last.shown_vertices[~gone], last.vertices[~gone])
    # where NaN cannot be, they shrink to a point
    places = (dug.vertices + last.shown_displacement)[gone]
    assert np.ptp(places, axis=0).tolist() == [0, 0]
    for kind in ("blocks", "stress", "contacts", "displacements"):
        plot.save(plot.plot(dug, kind=kind), tmp_path / f"{kind}.png")
    axes = plot.plot(dug, "displacement")
    drawn = [path for path in axes.collections[0].get_paths() if np.isfinite(path.vertices).all()]
    assert len(drawn) == dug.n_blocks - 1
    assert len(grids_of(dug, last)[""].offset) - 1 == dug.n_blocks - 1
    assert len(grids_of(dug, dug.frames[0])[""].offset) - 1 == dug.n_blocks


def test_the_ground_reaction_of_an_elastic_column_is_a_line(dug):
    share, convergence, ends = plot.ground_reaction_data(dug)
    assert share[ends].tolist() == [0, 0.5, 1]
    # point 4 is in the block below the excavated one, which it lifts by the weight taken off; strains are 1e-5
    way = convergence[:, 3]
    assert way[-1] > 0
    np.testing.assert_allclose(way[ends], way[-1] * share[ends], rtol=1e-4)
    # each step of the release is at rest: the first ones, too, which once lagged behind by their inertia
    np.testing.assert_allclose(way, way[-1] * share, atol=1e-3 * way[-1])
    # σ = 24525 Pa off three whole blocks and half of the fourth, and off the joints below: four of 2.5 E/m and more
    assert 3.5 * 24525 / 1e10 < way[-1] < 3 * 3.5 * 24525 / 1e10
    axes = plot.plot(dug, kind="ground-reaction", stage="half")
    # point 5 is on the excavated block
    assert [line.get_label() for line in axes.lines if not line.get_label().startswith("_")] == [
        f"point {k}" for k in range(1, 5)
    ]
    assert axes.get_ylabel() == "relaxation"
    with pytest.raises(InputError, match="there is no stage 'quarter'"):
        plot.plot(dug, kind="ground-reaction", stage="quarter")


def test_the_ground_reaction_has_no_line_along_the_axis_in_files_whose_share_falls_to_zero(dug, monkeypatch):
    """Files of before hold 0 in the stages after the last excavation."""
    share = dug["history/relaxation"].copy()
    share[-3:] = 0
    read = rockdda.Results.__getitem__
    monkeypatch.setattr(
        rockdda.Results, "__getitem__", lambda self, name: share if name == "history/relaxation" else read(self, name)
    )
    released, _, ends = plot.ground_reaction_data(dug)
    assert released[ends[-1]] == released.max() > 0.5
    assert (np.diff(released) >= 0).all()


def test_a_run_without_excavation_has_no_ground_reaction(flat_arch):
    with pytest.raises(InputError, match="no stage has released forces"):
        plot.plot(rockdda.open(flat_arch), kind="ground-reaction")


def test_boundaries_of_excavated_blocks_are_not_drawn(program, tmp_path):
    options = OPTIONS.replace("&region", "&boundary along = 0,5, 1,5, kind = 'traction', pressure = 1e4 /\n&region", 1)
    (tmp_path / "dig.nml").write_text(options)
    files = [STACK / "stack.dc", STACK / "stack.df", "--config", tmp_path / "dig.nml", "-o", tmp_path / "dig.h5"]
    subprocess.run([program, "run", *files, "--quiet"], check=True, capture_output=True)
    dug = rockdda.open(tmp_path / "dig.h5")
    for frame, drawn in ((0, True), (-1, False)):
        axes = plot.blocks(dug, "displacement", frame)
        colours = [one.get_edgecolor()[0] for one in axes.collections if len(one.get_edgecolor())]
        traction = mpl.colors.to_rgba(plot.boundary_marks.BOUNDARIES["traction"])
        assert any(tuple(colour) == traction for colour in colours) == drawn
        axes.figure.canvas.draw()


@pytest.mark.parametrize("kind", ["history", "energy", "iterations"])
def test_curves_of_one_stage_hold_its_steps_only(dug, kind):
    """A static stage took most of the axis of time of a short dynamic one."""
    axes = np.ravel(plot.plot(dug, kind=kind, stage="Half"))[0]
    table = dug.history()
    chosen = table[table["stage"] == 1]
    along = chosen.index if kind == "iterations" else chosen["time"]
    for line in axes.lines:
        if len(line.get_xdata()) > 2:
            np.testing.assert_array_equal(line.get_xdata(), along)
    assert axes.get_xlim() == pytest.approx(
        (along.iloc[0], along.iloc[-1]) if kind != "iterations" else (along[0], along[-1])
    )
    assert axes.get_title(loc="left") == "stack, half" if dug.title == "stack" else "half" in axes.get_title(loc="left")
    with pytest.raises(InputError, match="there is no stage 'hlaf'; did you mean 'half'"):
        plot.plot(dug, kind=kind, stage="hlaf")


def test_curves_of_all_stages_tell_where_they_end(dug):
    axes = plot.plot(dug, kind="history")
    ends = [stage.end for stage in dug.stages][:-1]
    upright = [
        line.get_xdata()[0] for line in axes.lines if len(set(line.get_xdata())) == 1 and len(line.get_xdata()) == 2
    ]
    assert upright == pytest.approx(ends)
