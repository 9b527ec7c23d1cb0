# SPDX-License-Identifier: MIT
"""Reports to hand in."""

import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser

import h5py
import numpy as np
import pytest
import rockdda
from rockdda.certainty.half_step import HalfStep, compare_ends, run_half_step
from rockdda.cli import main
from rockdda.critical import read_search
from rockdda.plot.water_levels import acting_groups
from rockdda.report import facts, report
from rockdda.report.paper import BROWSERS
from rockdda.units import Units
from synthetic import add_bolts, write_wall
from test_stages import dug  # noqa: F401  (a fixture)


class Tags(HTMLParser):
    """Tags of a page that are open at its end, and the sources of its pictures."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag == "img":
            self.sources.append(dict(attributes)["src"])
        elif tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_has_all_parts_and_needs_nothing_else(dug, tmp_path):  # noqa: F811
    text = report(dug, tmp_path / "report.html", units="SI", title="Wall & fill").read_text()
    tags = Tags(text)
    assert tags.open == []
    # start, end, stresses; stages but the last, ground reaction; joints; water, points; energy
    assert len(tags.sources) == 3 + 3 + 3 + 2 + 1
    assert all(source.startswith("data:image/png;base64,") for source in tags.sources)
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert re.findall("<h2>(.*?)</h2>", text) == [
        "Question", "Model", "Parameters", "Stages", "Result", "Checks", "Appendix: input",
    ]  # fmt: skip
    assert "<h1>Wall &amp; fill</h1>" in text
    for shown in ("rock", "friction [°]", "digging, face near", "excavate middle", "pressure 10 kPa", "SHA-256"):
        assert shown in text
    assert "not kept" not in text
    assert "E [MPa]" in text
    assert "has 6 blocks of rock, with joints of joint" in text
    assert "was not checked" in text  # half the time step
    assert "&amp;stage" in text  # the input


def test_the_numbers_are_those_of_the_results(dug):  # noqa: F811
    units = Units.parse("m,s,N")
    now = dug.frames[-1]
    shown = dict(facts.in_short(dug, units))
    moved = np.hypot(*now.displacement[now.active].T).max()
    assert shown["largest displacement"].startswith(f"{moved:.4g} m (block ")
    assert shown["blocks"] == "5 of 6 are there"
    _, rows = facts.stage_table(dug, units)
    assert [row[1] for row in rows] == dug.stage_names
    assert [int(row[4]) for row in rows] == [5, 4, 5]
    _, rows = facts.boundary_table(dug, units)
    assert float(rows[0][5]) == pytest.approx(dug.boundary_force[-1, 0, 1], rel=1e-3)
    (names, blocks), (_, joints) = facts.material_tables(dug)
    assert dict(zip(names, blocks[0], strict=True)) | {"E": "1e+09", "ν": "0.2"} == dict(
        zip(names, blocks[0], strict=True)
    )
    assert joints[0][:2] == ["1 joint", "35"]


def test_checks_that_are_not_kept_say_so(dug, tmp_path):  # noqa: F811
    kept = {row[0]: row[3] for row in facts.checks(dug)}
    assert kept["energy balance: residual"] == kept["equilibrium at the end of stage 'fill'"] == "kept"
    path = tmp_path / "bad.h5"
    path.write_bytes(dug.path.read_bytes())
    with h5py.File(path, "a") as file:
        file["history/unbalanced"][-1] = 0.5
        file["history/energy"][:, -1] = 1e9
        file["frames/contact_opening"][-1] = -0.5
        file.attrs["complete"] = 0
        file.attrs["exit_reason"] = "step 3 cannot be solved"
    found = {row[0]: row[3] for row in facts.checks(rockdda.open(path))}
    assert sum(value == "not kept" for value in found.values()) == 4
    text = report(rockdda.open(path), tmp_path / "bad.html").read_text()
    assert "did not come to its end (step 3 cannot be solved)" in text
    assert text.index("Checks that are not kept: energy balance") < text.index("<h2>Model</h2>")


def sliding(folder, only_model=False, **time):
    """A block that slides down a plane of 30 degrees, shaken by a record, and its results."""
    model = rockdda.Model("sliding", labelled=True, gravity=10.0)
    model.add_polygon([(0, 0), (8, 0), (0, 4)])
    model.add_polygon([(1.0, 3.5), (2.0, 3.0), (2.5, 4.0), (1.5, 4.5)])
    for point in ((0.2, 0.2), (7, 0.2), (0.2, 3.5)):
        model.add_fixed(point)
    model.add_block_material(density=2500, young=1e9, poisson=0.2, name="rock")
    model.add_joint_material(friction=15, name="plane", normal_stiffness=1e9, shear_stiffness=1e9)
    model.add_group("time", **time)
    (folder / "record.csv").write_text("t,a\n0,0\n0.1,1\n0.2,0\n")
    model.add_group("quake", record=str(folder / "record.csv"))
    if only_model:
        return model
    model.add_group("run", t_end=0.2)
    return model.run(output=folder / "sliding.h5")


def test_half_the_step_is_computed_where_it_is_asked_for(native, tmp_path):
    results = sliding(tmp_path, dt_max=0.004)
    half = run_half_step(results)
    n = results.n_steps
    assert half.words == f"{2 * n} steps of 0.002 on average in place of {n} of 0.004"
    assert 0 < half.displacement < facts.STEP
    moved, stress = facts.checks(results, half)[-2:]
    assert (moved[0], moved[3]) == ("half the time step: displacement at the end", "kept")
    assert (stress[0], stress[3]) == ("half the time step: stress at the end", "–")
    text = report(results, tmp_path / "a.html", check_step=True).read_text()
    assert f"Half the time step: {half.words}" in text
    assert f"which the results hold, and the files that they name ({tmp_path}/record.csv), this version" in text
    coarse = facts.checks(results, HalfStep("", displacement=0.06))[-1]
    assert coarse[3] == "not kept"
    assert facts.checks(results, HalfStep("the run at half the step failed", failed=True))[-1][3] == "not kept"
    assert text.count("<figure") == text.count("<figure>") + 1  # the motion of the ground
    assert "Acceleration of the ground in x as computed with" in text
    (tmp_path / "record.csv").unlink()
    assert facts.motions(results) == []
    with pytest.raises(rockdda.InputError, match=r"record.csv, which the input names, lies neither beside"):
        run_half_step(results)


def test_the_motion_is_that_of_the_run(native, tmp_path):
    """With the factor and the column of the options."""
    model = sliding(tmp_path, dt_max=0.004, only_model=True)
    (tmp_path / "two.csv").write_text("t,north,up\n0,0,0\n0.1,5,1\n0.2,0,0\n")
    model.add_group("quake", record=str(tmp_path / "two.csv"), column="up", scale=-2.0, direction="y")
    model.add_group("run", steps=2)
    results = model.run(output=tmp_path / "two.h5")
    (first, _), (direction, motion) = facts.motions(results)
    assert (first, direction) == ("x", "y")
    assert motion.acceleration.tolist() == [0.0, -2.0, 0.0]
    (tmp_path / "two.csv").write_text("t,north\n0,0\n")  # another one now
    assert len(facts.motions(results)) == 1


def test_the_largest_displacement_may_lie_before_the_end(tmp_path):
    path = write_wall(tmp_path / "back.h5", 3, 2, frames=4)
    assert "largest displacement of all frames" not in dict(facts.in_short(rockdda.open(path), Units()))
    with h5py.File(path, "a") as file:
        file["frames/centroid"][2, 0, 0] += 300.0
    shown = dict(facts.in_short(rockdda.open(path), Units()))
    most = shown["largest displacement of all frames"]
    assert float(most.split()[0]) == pytest.approx(300.0, rel=1e-3)
    assert f"(frame at time {rockdda.open(path).frames[2].time:.4g})" in most


def test_joints_that_carry_next_to_nothing_are_not_ranked(dug, tmp_path):  # noqa: F811
    """A corner that touches may use all of its strength, with any stress; and joints name their units."""
    columns, rows = facts.joint_table(dug, Units.parse("m,s,N"))
    assert {"normal stress [Pa]", "slip [m]", "opening [m]"} < set(columns)
    names = [row[0] for row in rows]
    path = tmp_path / "touch.h5"
    path.write_bytes(dug.path.read_bytes())
    name = names[0]
    pair = {int(number) - 1 for number in name.split(", ")}
    with h5py.File(path, "a") as file:
        contacts = dug.frames[-1].contacts
        blocks = file["frames/contact_blocks"]
        mine = np.array([set(row) == pair for row in contacts.blocks.tolist()])
        start = len(blocks) - len(mine)
        for k in np.flatnonzero(mine) + start:
            file["frames/contact_force"][k] *= 1e-6
            file["frames/contact_length"][k] *= 1e-6
    assert name not in [row[0] for row in facts.joint_table(rockdda.open(path), Units())[1]]


def test_half_the_step_is_refused_in_words(dug, tmp_path):  # noqa: F811
    path = tmp_path / "early.h5"
    path.write_bytes(dug.path.read_bytes())
    with h5py.File(path, "a") as file:
        file.attrs["complete"] = 0
    half = run_half_step(rockdda.open(path))
    assert half == HalfStep("not checked: the run did not come to its end")
    assert facts.checks(rockdda.open(path), half)[-1][3] == "–"


def test_stages_until_equilibrium_end_in_the_same_place_at_half_the_step(dug):  # noqa: F811
    assert run_half_step(dug).displacement < 1e-3


def test_the_last_stage_without_an_end_lasts_as_long_at_half_the_step(native, tmp_path):
    """Its number of steps is that of the run."""
    model = sliding(tmp_path, dt_max=0.004, only_model=True)
    model.add_group("run", steps=40)
    model.add_stage("first", until_step=10)
    model.add_stage("second")
    results = model.run(output=tmp_path / "stages.h5")
    assert results.n_steps == 40
    assert run_half_step(results).words.startswith("80 steps of 0.002")


def test_water_is_drawn_where_the_history_begins_later(dug, tmp_path):  # noqa: F811
    """Trials of a search count their steps from the settled state."""
    path = tmp_path / "trial.h5"
    path.write_bytes(dug.path.read_bytes())
    with h5py.File(path, "a") as file:
        file["history/step"][:] += 40
        file["frames/step"][:] += 40
    groups = [acting_groups(one, -1) for one in (dug, rockdda.open(path))]
    assert groups[0] == groups[1] == {1}


def test_a_critical_factor_stands_on_the_first_page(tmp_path):
    path = write_wall(tmp_path / "fos.h5", 3, 2)
    assert facts.search_table(rockdda.open(path)) == []
    with h5py.File(path, "a") as file:
        for name, value in (("factor", [1.208]), ("low", [1.203]), ("high", [1.213]), ("blocks", [0, 3])):
            file[f"search/{name}"] = np.array(value)
        file["search/value"] = np.array([1.0, 2.0, 1.5])
        file["search"].attrs.update(search="strength", kind="sliding")
    shown = dict(facts.in_short(rockdda.open(path), Units()))
    assert shown["factor of safety"] == "1.208 (between 1.203 and 1.213, 3 trials)"
    assert shown["mechanism"].startswith("sliding, 2 blocks")


def test_old_files_and_bolts(tmp_path, capsys):
    """Files of version 1 have neither stages nor stresses along joints."""
    path = write_wall(tmp_path / "old.h5", 3, 2, frames=3)
    add_bolts(path)
    assert main(["report", str(path), "-o", str(tmp_path / "old.html"), "--json"]) == 0
    text = (tmp_path / "old.html").read_text()
    assert json.loads(capsys.readouterr().out)["bytes"] == len(text.encode())
    assert "<h2>Stages</h2>" not in text
    assert "<h3>Bolts</h3>" in text
    assert "unlimited" in text
    assert Tags(text).open == []


def test_numbers_in_words():
    assert [facts.number(value) for value in (-0.0, np.float64(-0.0), 1.23456, 3, float("nan"), True, [1, 2.5])] == [
        "0", "0", "1.235", "3", "–", "yes", "1, 2.5",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("group", "name", "metres", "millimetres", "shown"),
    [
        ("load", "gravity", 9.81, 9810, "9.81 m/s²"),
        ("in_situ", "surface", 15, 15000, "15 m"),
        ("in_situ", "surcharge", 2.21e6, 2.21, "2.21 MPa"),
        ("in_situ", "unit_weight", 26500, 2.65e-5, "26.5 kN/m³"),
        ("in_situ", "k0", 0.8, 0.8, "0.8"),
        ("boundary", "traction", [0, -2e3], [0, -2e-3], "0, -2 kPa"),
        ("boundary", "velocity", [0.001, 0], [1, 0], "1, 0 mm/s"),
        ("line_load", "force_start", [0, -5e4], [0, -0.05], "0, -50 kN/m"),
        ("stage", "duration", 2.5, 2.5, "2.5 s"),
        ("stage", "until", "equilibrium", "equilibrium", "equilibrium"),
        ("joint_material", "friction", 35, 35, "35°"),
    ],
)
def test_values_of_the_input_have_their_unit_in_any_system(native, group, name, metres, millimetres, shown):
    for value, system in ((metres, ("m", "s", "N")), (millimetres, ("mm", "s", "N"))):
        assert facts.option_text(group, name, value, Units(*system, multiples=True)) == shown
    assert facts.option_text(group, name, metres, Units()) == facts.number(metres)


def test_places_have_their_unit():
    ends = np.array([[-15, -15], [15, -15]])
    for scale, length in ((1, "m"), (1000, "mm")):
        units = Units(length, "s", "N", multiples=True)
        assert facts.place_text(scale * ends, units) == "(-15, -15) → (15, -15) m"
    assert facts.place_text(ends, Units()) == "(-15, -15) → (15, -15)"


def test_endings(tmp_path):
    results = rockdda.open(write_wall(tmp_path / "a.h5", 2, 2))
    with pytest.raises(rockdda.InputError, match=r"a report ends in .html or .pdf, not in '.docx'"):
        report(results, tmp_path / "a.docx")


def test_what_the_engineer_adds_stands_in_its_place(dug, tmp_path, capsys):  # noqa: F811
    command = ["report", str(dug.path), "-o", str(tmp_path / "r.html"), "--units", "SI", "--project", "Road <7>"]
    words = ["--author", "A. B.", "--date", "2026-11-29", "--question", "Does the fill hold?"]
    assert main([*command, *words, "--source", "joint=shear tests"]) == 0
    text = (tmp_path / "r.html").read_text()
    assert Tags(text).open == []
    for shown in ("Road &lt;7&gt;", "A. B.", "2026-11-29", "Does the fill hold?", "<td>shear tests</td>"):
        assert shown in text
    assert "not computed; rockdda-post convergence does" in text
    plain = report(dug, tmp_path / "plain.html").read_text()
    fields = plain.count('class="fill"') - text.count('class="fill"')
    assert fields == 4  # project, author, date, source of the joint
    assert "Does the model come to rest in each stage" in plain
    assert main([*command, "--source", "1 joint=shear tests"]) == 0  # as the table and the message have it
    assert "<td>shear tests</td>" in (tmp_path / "r.html").read_text()
    assert main([*command, "--source", "juncture=x"]) == 2
    assert "a source is given for 'juncture'; the parameters are: " in capsys.readouterr().err


def test_a_pdf_needs_weasyprint_or_chromium(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    results = rockdda.open(write_wall(tmp_path / "a.h5", 2, 2))
    if any(map(shutil.which, BROWSERS)):
        assert report(results, tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(rockdda.RockddaError, match=r"a PDF needs WeasyPrint, .* install weasyprint, or Chromium"):
        report(results, tmp_path / "b.pdf")


def test_pages_on_a4(tmp_path):
    pytest.importorskip("weasyprint", exc_type=(ImportError, OSError))
    results = rockdda.open(write_wall(tmp_path / "a.h5", 2, 2))
    data = report(results, tmp_path / "a.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert not list(tmp_path.glob(".*"))


def test_no_head_stands_alone_at_the_end_of_a_sheet(dug, tmp_path):  # noqa: F811
    """Neither the head of a table nor that of a part, wherever the sheet ends; long tables repeat their head."""
    weasyprint = pytest.importorskip("weasyprint", exc_type=(ImportError, OSError))
    text = report(dug, tmp_path / "a.html", units="SI").read_text()
    assert text.count("<thead>") > 5
    text = re.sub("<figure>.*?</figure>", "", text, flags=re.DOTALL)
    rows = "".join(f"<tr><td>{i}</td></tr>" for i in range(90))
    text = text.replace("<h2>Checks", f'<table class="long"><thead><tr><th>n</th></tr></thead>{rows}</table><h2>Checks')
    head, body = text.split("<body>")
    body = body.split("</body>")[0]
    start = '<p style="break-before: page; height: {}px">begin</p>'
    copies = "".join(start.format(height) + body for height in range(0, 960, 120))
    pages = weasyprint.HTML(string=f"{head}<body>{copies}</body></html>").render().pages
    kinds = ("h2", "h3", "th", "td", "p", "pre")
    for number, page in enumerate(pages, start=1):
        last = [box.element_tag for box in page._page_box.descendants() if box.element_tag in kinds][-1]
        assert last in ("td", "p", "pre"), number
    assert len(pages) > 20


def test_the_dependence_on_the_time_step_is_reported(tmp_path, capsys):
    first, second = (write_wall(tmp_path / f"{name}.h5", 3, 2, frames=3) for name in ("full", "half"))
    with h5py.File(second, "a") as file:  # the largest displacement, hypot(0.03, 0.04), becomes longer by a tenth of it
        file["frames/centroid"][-1, :, 1] -= 0.005
        file["frames/stress"][-1] *= 1.01
        file["history/dt"][:] = 0.05
    half = compare_ends(rockdda.open(first), rockdda.open(second))
    assert "of 0.05 on average in place of" in half.words
    moved, stress = facts.checks(rockdda.open(first), half)[-2:]
    assert moved[0] == "half the time step: displacement at the end"
    largest = np.hypot(*rockdda.open(first).frames[-1].displacement.T).max()
    assert float(moved[1]) == pytest.approx(0.005 / largest, rel=0.05)  # two digits are shown
    assert stress[1] == "1.0e-02"
    assert main(["report", str(first), "--half", str(second), "-o", str(tmp_path / "r.html"), "--quiet"]) == 0
    text = (tmp_path / "r.html").read_text()
    assert moved[0] in text
    assert half.words in text
    with pytest.raises(rockdda.InputError, match="either run again at half the time step, or a run is given"):
        report(rockdda.open(first), tmp_path / "t.html", check_step=True, beside=rockdda.open(second))
    write_wall(tmp_path / "other.h5", 4, 2)
    assert main(["report", str(first), "--half", str(tmp_path / "other.h5"), "-o", str(tmp_path / "s.html")]) == 2
    assert "is no run of the same model" in capsys.readouterr().err


def test_a_failing_trial_has_a_part_of_its_own(program, tmp_path):
    for command in (["new", "arch", "a"], ["fos", "a.nml", "--search", "push", "-o", "f.h5", "--quiet"]):
        subprocess.run([program, *command], cwd=tmp_path, check=True, capture_output=True)
    results = rockdda.open(tmp_path / "f.h5")
    text = report(results, tmp_path / "f.html").read_text()
    assert Tags(text).open == []
    part = text[text.index("<h3>Critical factor</h3>") : text.index("<h3>State at the end</h3>")]
    found = read_search(results)
    assert str(found) in part
    assert part.count("<img") == 2  # the mechanism and the search
    assert "the factors</td>" in text  # half the step: search again
    assert "<td>before</td>" in text or not facts.stages_before(results)
    assert part.count("<td>stable</td>") + part.count("<td>fails</td>") == len(found.trials)
