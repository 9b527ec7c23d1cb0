# SPDX-License-Identifier: MIT
"""The validation: its cases keep what they promise, the report has their records, the command does both."""

import json
import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import rockdda
import rockdda_validation
from places import ROOT, assert_same_results
from rockdda.cli import main
from rockdda.errors import InputError
from rockdda.report import paper
from rockdda_validation import Case, Comparison, Record, all_cases
from rockdda_validation.cases import closed_newmark
from rockdda_validation.report import PARTS, write_report
from rockdda_validation.runner import Outcome, comparison, load_records, run_cases, run_here, select, store
from synthetic_cases import CASES

pytestmark = pytest.mark.usefixtures("native")
QUICK = [case for case in all_cases() if case.quick]


def test_the_cases_have_names_and_places():
    for case in all_cases():
        assert re.fullmatch(r"[a-z0-9][a-z0-9.-]*", case.identifier), case.identifier
        assert case.part in PARTS, f"{case.identifier}: {case.part}"
        assert case.title and not case.title.endswith(".")
    names = [case.identifier for case in all_cases()]
    assert len(names) == len(set(names)) > 0
    assert names.index("5.3.1-two-block-arch") < names.index("closed-newmark")


def test_published_numbers_can_be_read():
    for package in rockdda_validation.__path__:
        for file in (ROOT / package / "published").glob("*.toml"):
            assert tomllib.loads(file.read_text(encoding="utf-8")), file


@pytest.mark.parametrize("case", QUICK, ids=[case.identifier for case in QUICK])
def test_quick_cases_keep_their_promises(case, tmp_path):
    """Every case, in its quick form; at least one promise each, or a truth or a published value to tell."""
    found = run_here(case, tmp_path / "runs", tmp_path / "figures", formulation="vertex")
    assert not found["error"], found["error"]
    assert found["energy_residual"] < 1e-6
    numbers = [comparison(values) for values in found["comparisons"]]
    broken = [
        f"{c.quantity}: {c.computed:g}, truth {c.truth}, published {c.published}" for c in numbers if c.agrees is False
    ]
    assert not broken
    assert any(c.truth is not None or c.published is not None for c in numbers)


def test_a_case_does_what_the_command_does(program, tmp_path):
    """Input files that a case leaves behind give the same bits through `rockdda run`."""
    record = Record(Case("x", "x", "Closed forms", lambda record: None), tmp_path, tmp_path)
    model, _ = closed_newmark.incline(closed_newmark.pulse_motion(), 0.005, 1.0, 1e10)
    results = record.run(model, "pulse")
    assert results.complete and record.steps == results.n_steps > 100
    results.close()
    other = tmp_path / "command.h5"
    subprocess.run([program, "run", tmp_path / "pulse", "-o", other, "--quiet"], check=True)
    assert_same_results(tmp_path / "pulse/pulse.h5", other)


def test_errors_are_relative_to_what_is_said():
    assert Comparison("a", 1.1, truth=1.0, allowed=0.2).agrees is True
    assert Comparison("a", 1.3, truth=1.0, allowed=0.2).agrees is False
    assert Comparison("a", 1.3, truth=1.0).agrees is None
    assert Comparison("a", 0.3, truth=0.0, scale=1).error == pytest.approx(0.3)
    assert Comparison("a", 0.0, truth=0.0).error == 0.0
    assert Comparison("a", float("nan"), truth=1.0, allowed=0.2).agrees is False
    assert Comparison("a", 5.0, published=4.0, allowed=0.2).agrees is False
    assert Comparison("a", 5.0, published=4.0, bound="lower").published_error == 0.0
    assert Comparison("a", 5.0, published=4.0, bound="upper").published_error == pytest.approx(0.25)


def test_the_former_name_of_the_computed_value_warns_and_works():
    with pytest.warns(DeprecationWarning, match=r"Comparison\.ours is now Comparison\.computed"):
        assert Comparison("a", 1.5).ours == 1.5


def kept(tmp_path, cases, **options):
    """Records of cases in a folder, as the runner keeps them."""
    for case in cases:
        figures = tmp_path / "runs" / case.identifier / "figures"
        store(run_here(case, figures.parent, figures, **options), figures, tmp_path / "report")
    return tmp_path / "report"


def test_records_of_older_versions_are_read(tmp_path):
    """They called the computed value "ours"."""
    target = kept(tmp_path, CASES[:1])
    (file,) = (target / "data").glob("*.json")
    text = file.read_text(encoding="utf-8")
    (now,) = load_records(target, CASES)
    file.write_text(text.replace('"computed":', '"ours":'), encoding="utf-8")
    assert '"ours":' in file.read_text(encoding="utf-8")
    (then,) = load_records(target, CASES)
    values = [[comparison["computed"] for comparison in record["comparisons"]] for record in (then, now)]
    np.testing.assert_array_equal(*values)  # one is not a number
    assert not any("ours" in comparison for comparison in then["comparisons"])


def test_report_of_cases_that_agree_differ_and_fail(tmp_path):
    target = kept(tmp_path, CASES[:3])
    markdown, page = write_report(target, CASES)
    text, html = markdown.read_text(encoding="utf-8"), page.read_text(encoding="utf-8")
    first = text.split("## What was compared")[0]
    assert "| promises kept | 4 of 5 |" in first and "| cases computed | 2 |" in first
    assert "**Not computed:** [9.3-fails]" in first and "**Not run:** 9.4-crashes" in text
    assert "**1 broken promise**" in first.split("## Not explained")[1]
    assert "length" not in text.split("## How this was made")[1]  # no columns of what was not run
    mismatches = text.split("## What does not match")[1].split("##")[0]
    assert "it is wrong" in mismatches and "broken" in mismatches  # the promise
    assert "no such thing in run" in mismatches and str(tmp_path) not in text  # the failure
    assert "published 3\u00a0kN" in mismatches and "**not explained**" in mismatches
    assert "nothing is known \\| nothing at all" in mismatches
    assert "≤ 4\u00a0m | within the bound |" in text and "bounded" not in mismatches
    assert "slip" not in mismatches and "zero" not in mismatches
    for name in re.findall(r"\]\((figures/[^)]+)\)", text):
        assert (target / name).is_file()
        assert f'"{name}"' in html
    assert "The first 30 of 50 rows" in text and text.count("\n| 29 |") == 1 and "| 30 |" not in text
    assert '<h3 id="case-9-1-agrees">9.1-agrees: One that agrees</h3>' in html
    assert "<h4>A heading</h4>" in html and "&lt;tag&gt;" in html and "<table>" in html
    links = re.findall(r'href="#([^"]+)"', html)
    assert links and all(f'id="{name}"' in html for name in links)
    assert html.count('<h2 class="part">') == 2


def test_both_formulations_stand_beside_each_other(tmp_path):
    """Each in folders of its own; text and figures of vertices, numbers of both, columns only where both are there."""
    target = tmp_path / "report"
    for formulation in ("vertex", "length"):
        figures = tmp_path / formulation
        store(run_here(CASES[0], figures, figures, formulation=formulation), figures, target)
        assert (target / "data" / formulation / "9.1-agrees.json").is_file()
        assert (target / "figures" / formulation / "9.1-agrees-line.png").is_file()
    file = target / "data/length/9.1-agrees.json"
    record = json.loads(file.read_text(encoding="utf-8"))
    changed = next(c for c in record["comparisons"] if c["allowed"] is not None and c["truth"])
    changed["computed"] = 2 * changed["truth"] + 7.0
    file.write_text(json.dumps(record), encoding="utf-8")
    assert len(load_records(target, CASES)) == 2 and len(load_records(target, CASES, "length")) == 1
    text = write_report(target, CASES)[0].read_text(encoding="utf-8")
    assert "|   | vertex | length |" in text and text.count("### 9.1-agrees") == 1
    assert "(figures/vertex/9.1-agrees-line.png)" in text and "figures/length" not in text
    row = next(line for line in text.splitlines() if line.startswith(f"| {changed['quantity']} |"))
    assert f"{changed['computed']:.5g}" in row.split("|")[3] and "**broken:**" in row
    assert changed["quantity"] in text.split("## What differs by length")[1].split("\n## ")[0]


def test_first_page_says_whether_a_closing_rule_gives_the_published_verdicts():
    from rockdda_validation.report_entry import Entry
    from rockdda_validation.report_first import first_page

    def entry(identifier, quantity, computed, found=""):
        values = {"quantity": quantity, "computed": computed, "unit": "of 13", "published": 13.0, "found": found}
        return Entry({"identifier": identifier, "runs": 7, "comparisons": [values]})

    tunnels = entry("7.2.1-closing-family", "members of the family that agree", 13.0)
    for verdicts, answer in ((11.0, "None of the members computed does"), (13.0, "One does")):
        layer = entry("6.6.3-closing-family", "verdicts on the single layer, best member of the family", verdicts)
        gap = entry("6.6.3-opening-gap", "angle, opening gap 2e-07 w₀", float("nan"), "between 74 and 75°")
        other = entry("6.6.3-opening-gap", "angle, opening gap 1e-05 w₀", 3.0)
        text = "\n".join(first_page([layer, gap, tunnels])).replace("\xa0", " ").split("## Is there a closing rule")[1]
        assert answer in text and "7 runs" in text and f"family {verdicts:g} of 13, published 13 of 13" in text
        assert "opening gap 2e-07 w₀ between 74 and 75°, published 13" in text
        assert "1e-05" not in "\n".join(first_page([other])).split("## Is there a closing rule")[1]
    assert "closing rule" not in "\n".join(first_page([entry("7.2-other", "angle", 1.0)]))


def test_truths_of_corner_springs_promise_nothing_by_length():
    from rockdda_validation.corner_springs import CORNERS, as_promised

    spring = Comparison("settlement", 2.0, truth=1.0, truth_source="statics of the chain", allowed=0.01)
    other = Comparison("speed", 2.0, truth=1.0, truth_source="Newton's law", allowed=0.01)
    name = "7.1-settling-column"
    assert as_promised(name, "vertex", spring).agrees is False
    assert as_promised(name, "length", spring).agrees is None
    assert as_promised(name, "length", other).agrees is False
    assert as_promised("closed-newmark", "length", spring).agrees is False
    assert set(CORNERS) <= {case.identifier for case in all_cases()}


def test_a_case_chooses_the_formulation_where_a_model_does_not(tmp_path):
    record = Record(CASES[0], tmp_path, tmp_path, formulation="length")
    for given, expected in (
        ({}, {"formulation": "length"}),
        ({"stiffness": 1.0}, {"stiffness": 1.0, "formulation": "length"}),
        ({"preset": "dda_windows"}, {"preset": "dda_windows"}),
        ({"formulation": "vertex"}, {"formulation": "vertex"}),
    ):
        model = rockdda.Model("x", options={"contact": dict(given)})
        record.choose_formulation(model)
        assert model.options["contact"] == expected
    model = rockdda.Model("x")
    Record(CASES[0], tmp_path, tmp_path).choose_formulation(model)
    assert not model.options


def test_without_a_writer_of_pdf_nothing_is_run(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    monkeypatch.setattr(paper.shutil, "which", lambda name: None)  # no browser
    code, out, err = command(capsys, "--case", "closed-newmark", "--pdf", "-o", tmp_path / "report")
    assert code == 2 and "-m pip install weasyprint" in err and not out
    assert not (tmp_path / "report").exists()


def test_the_report_on_paper(tmp_path, capsys):
    pytest.importorskip("weasyprint")
    target = kept(tmp_path, CASES[:2])
    assert command(capsys, "--report-only", "--pdf", "-o", target)[0] == 0
    assert (target / "report.pdf").read_bytes().startswith(b"%PDF-")


def test_records_come_back_as_they_were(tmp_path):
    target = kept(tmp_path, CASES[:3])
    first = (target / "index.md").exists(), [r["identifier"] for r in load_records(target, CASES)]
    assert first == (False, ["9.1-agrees", "9.2-differs", "9.3-fails"])
    told = comparison(load_records(target, CASES)[0]["comparisons"][3])
    assert told.computed != told.computed and told.published == 1.0  # not a number
    json.loads((target / "data/9.1-agrees.json").read_text(), parse_constant=lambda name: pytest.fail(name))
    kept(tmp_path, CASES[1:2], full=True)
    records = load_records(target, CASES)
    assert [record["full"] for record in records] == [False, True, False]
    (build,) = {record["build"] for record in records}
    assert re.fullmatch(r"[0-9a-f]{12}", build)
    assert f"`{build}`" in write_report(target, CASES)[0].read_text(encoding="utf-8")
    assert records[1]["items"][0]["text"] == "Here all."
    # a case that leaves less behind than before takes its files away
    store(records[0] | {"items": []}, tmp_path, target)
    assert not list((target / "figures").iterdir())


def test_each_case_has_its_process(tmp_path):
    told = []
    outcomes = run_cases(
        CASES, tmp_path / "out", full=True, workers=2, module="synthetic_cases", progress=lambda *a: told.append(a)
    )
    assert [outcome.status for outcome in outcomes] == ["agrees", "differs", "failed", "failed"]
    assert "exit code 7" in outcomes[3].message and "no such thing" in outcomes[2].message
    assert [(done, total) for done, total, _ in told] == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert len(list((tmp_path / "out/data").iterdir())) == 4
    assert (tmp_path / "out/figures/9.1-agrees-line.png").stat().st_size > 1000


def test_cases_are_chosen_by_name():
    assert [case.identifier for case in select(None, False, CASES)] == ["9.1-agrees", "9.2-differs", "9.3-fails"]
    assert len(select(None, True, CASES)) == 4
    assert [case.identifier for case in select(["9.2-differs", "9.1-agrees"], False, CASES)] == [
        "9.1-agrees",
        "9.2-differs",
    ]
    with pytest.raises(InputError, match=r"did you mean 9\.3-fails"):
        select(["fails"], False, CASES)
    with pytest.raises(InputError, match="needs --full"):
        select(["9.4-crashes"], False, CASES)


def command(capsys, *arguments):
    code = main(["validate", *map(str, arguments)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_the_command_runs_a_case_and_writes_the_report(tmp_path, capsys):
    target = tmp_path / "validation"
    code, out, err = command(capsys, "--case", "closed-newmark", "-o", target, "--work", tmp_path / "runs", "--json")
    assert code == 0, err
    summary = json.loads(out)
    assert summary["cases"][0]["status"] == "agrees" and summary["cases"][0]["steps"] > 100
    assert (tmp_path / "runs/vertex/closed-newmark/sine-5000/newmark.dc").is_file()
    text = (target / "index.md").read_text(encoding="utf-8")
    assert "closed-newmark" in text and str(tmp_path) not in text + (target / "report.html").read_text(encoding="utf-8")
    (target / "index.md").unlink()
    assert command(capsys, "--report-only", "-o", target)[0] == 0
    assert (target / "index.md").read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("status", "expected"), [("agrees", 0), ("differs", 1), ("failed", 3)], ids=["agrees", "differs", "failed"]
)
def test_exit_codes(tmp_path, capsys, monkeypatch, status, expected):
    from rockdda_validation import runner

    def pretend(cases, target, **options):
        kept(tmp_path, [case for case in CASES if case.identifier.endswith(status.removesuffix("ed"))] or CASES[2:3])
        return [Outcome("closed-newmark", status, 1.0, 1, 10, "something")]

    monkeypatch.setattr(runner, "run_cases", pretend)
    code, _, err = command(capsys, "--case", "closed-newmark", "-o", tmp_path / "report")
    assert code == expected
    assert ("something" in err) == (expected != 0)


def test_cases_done_before_ctrl_c_are_kept_and_missing_continues(tmp_path, capsys, monkeypatch):
    from rockdda_validation import runner

    names = ["closed-newmark", "closed-bolt"]
    ran = []

    def pretend(cases, target, *, full, formulation, progress, stop_after, **options):
        for number, case in enumerate(cases, 1):
            ran.append(case.identifier)
            record = run_here(CASES[0], tmp_path, tmp_path / "figures", full=full, formulation=formulation)
            store(record | {"identifier": case.identifier}, tmp_path / "figures", target)
            progress(number, len(cases), Outcome(case.identifier, "agrees", 1.0, 1, 10))
            if number == stop_after:
                raise KeyboardInterrupt
        return [Outcome(case.identifier, "agrees", 1.0, 1, 10) for case in cases]

    chosen = ["--case", names[0], "--case", names[1], "-o", tmp_path / "report"]
    monkeypatch.setattr(runner, "run_cases", lambda *a, **o: pretend(*a, stop_after=1, **o))
    code, out, err = command(capsys, *chosen)
    assert code == 4 and not out
    assert "1 of 2 cases are done" in err and "--missing continues" in err
    text = (tmp_path / "report/index.md").read_text(encoding="utf-8")
    first, second = ran[0], next(name for name in names if name != ran[0])
    assert f"### {first}:" in text and f"### {second}:" not in text
    monkeypatch.setattr(runner, "run_cases", lambda *a, **o: pretend(*a, stop_after=0, **o))
    assert command(capsys, *chosen, "--missing")[0] == 0
    assert ran == [first, second]
    code, out, _ = command(capsys, *chosen, "--missing")
    assert code == 0 and "no case is missing" in out and ran == [first, second]
    assert command(capsys, *chosen, "--missing", "--full")[0] == 0
    assert ran == [first, second] + [case.identifier for case in all_cases() if case.identifier in names]


def test_errors_are_reported_before_anything_runs(tmp_path, capsys):
    full = tmp_path / "full"
    (full / "data").mkdir(parents=True)
    record = run_here(CASES[0], tmp_path, tmp_path / "figures", full=True, formulation="vertex")
    store(record | {"identifier": "closed-newmark"}, tmp_path / "figures", full)
    (tmp_path / "other").mkdir()
    (tmp_path / "other/thesis.txt").write_text("mine")
    for arguments, words in (
        (["--quick", "--full"], "exclude each other"),
        (["--list", "--report-only"], "exclude each other"),
        (["--case", "newmark"], "did you mean closed-newmark"),
        (["-o", tmp_path / "other"], "holds other files"),
        (["--report-only", "-o", tmp_path / "other"], "no records"),
        (["--case", "closed-newmark", "-o", full], "--force replaces"),
    ):
        code, out, err = command(capsys, *arguments)
        assert code == 2 and words in err and not out, arguments
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["thesis.txt"]


def test_the_list_names_all_cases(capsys):
    code, out, _ = command(capsys, "--list")
    assert code == 0
    for case in all_cases():
        assert f"  {case.identifier} " in out and case.title in out
    code, out, _ = command(capsys, "--list", "--json")
    assert [entry["identifier"] for entry in json.loads(out)["cases"]] == [case.identifier for case in all_cases()]


def test_symbols_in_pictures_are_set_as_symbols(tmp_path):
    import matplotlib.pyplot as plt
    from rockdda_validation.case import SYMBOL

    assert SYMBOL.sub("x", "S_j = 1 m, $S_j$, DS_j, S_jk") == "x = 1 m, $S_j$, DS_j, S_jk"
    record = Record(Case("a", "A", "Closed forms", lambda _: None), tmp_path, tmp_path / "figures")
    figure, axes = plt.subplots()
    axes.set_xlabel("joint spacing S_j [m]")
    record.figure(figure, "b", "words with S_j")
    assert axes.get_xlabel() == r"joint spacing $S_\mathrm{j}$ [m]"
    assert (tmp_path / "figures/a-b.png").stat().st_size > 1000
