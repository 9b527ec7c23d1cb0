# SPDX-License-Identifier: MIT
"""Study files that somebody else wrote: nothing in them becomes a command, and none takes long or much memory."""

import csv
import io
import json
import os
import random
import re
import shlex
import shutil
import subprocess
import sys
import time
import types

import pandas
import pytest
from places import INPUTS
from rockdda import cli
from rockdda.errors import InputError, OutputError
from rockdda.study import dask_workers, read_study, run_study, write_job_array
from rockdda.study.case import folder_of
from rockdda.study.formula import evaluate, formatted
from rockdda.text import csv_text

STUDY = """\
title = {title}
template = "template"
[parameters]
n = [3, 4]
[cluster]
{cluster}
"""


def write_study(folder, title='"harmless"', cluster='partition = "long"', name="study.toml"):
    (folder / "template").mkdir(exist_ok=True)
    (folder / "template/a.df").write_text("{{n}}\n")
    (folder / name).write_text(STUDY.format(title=title, cluster=cluster), encoding="utf-8")
    return folder / name


def in_toml(text):
    """A basic string of TOML."""
    return '"' + "".join(c if c.isalnum() and c.isascii() else f"\\U{ord(c):08x}" for c in text) + '"'


@pytest.mark.parametrize(
    ("title", "cluster", "message"),
    [
        ('"harmless\\ntouch PWNED_title\\n#"', "", r"study\.toml:1:1: error: title: line breaks and control"),
        ('"a"', 'partition = "x\\ntouch PWNED_cluster\\n#"', r"study\.toml:6:1: error: \[cluster\] 'partition': line"),
        ('"a"', 'partition = "x\\rtouch"', "line breaks and control"),
        ('"a"', 'partition = "x\\u2028touch"', "line breaks and control"),
        ('"a"', '"x\\ny" = 1', "line breaks and control"),
        ('"a"', 'job_extra = ["a\\nb"]', "line breaks and control"),
        ('"a"', '"x; touch PWNED" = 1', "is no option of sbatch"),
        ('"a"', "x = [1]", "expected a text, a number or true"),
    ],
)
def test_line_breaks_and_odd_names_are_refused(tmp_path, capsys, title, cluster, message):
    assert cli.main(["study", str(write_study(tmp_path, title, cluster)), "--slurm"]) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "study").exists()


def code_of(script):
    """The lines of a script that are no comments."""
    return [line for line in script.read_text().split("\n") if line and not line.startswith("#")]


def test_no_text_of_a_study_becomes_a_command(tmp_path):
    """300 hostile titles, values and folder names: bash takes the script as one command, and creates no file."""
    random.seed(5)
    pieces = ["\n", "$(touch P)", "`touch P`", ";touch P;", "'", '"', "\\", "#", "|touch P", ">P", "\u2028",
              "&", " ", "a", "ü", "${IFS}", "!!", "%s", "--wrap=x", "EOF", ";", "$(id)"]  # fmt: skip
    (tmp_path / "plain").mkdir()
    plain = code_of(write_job_array(read_study(write_study(tmp_path / "plain"))))
    refused = accepted = 0
    for number in range(300):
        text, value, name = ("".join(random.choices(pieces, k=random.randint(1, 4))) for _ in range(3))
        folder = tmp_path / (str(number) + re.sub(r"[\0/]", "", name))
        folder.mkdir()
        study = write_study(folder, in_toml(text), f"comment = {in_toml(value)}")
        try:
            script = write_job_array(read_study(study))
        except InputError:
            refused += 1
            continue
        accepted += 1
        before = sorted(path.relative_to(folder) for path in folder.rglob("*"))
        (at,) = [at for at, (line, usual) in enumerate(zip(code_of(script), plain, strict=True)) if line != usual]
        command = code_of(script)[at]
        assert command.startswith("  exec ")
        assert str(study.resolve()) in shlex.split(command)
        if number % 10 == 0:
            subprocess.run(["bash", "-n", script], check=True, timeout=10)
            harmless = script.with_name("run.sh")
            harmless.write_text(script.read_text().replace("exec ", "exec true "))
            environment = {**os.environ, "SLURM_ARRAY_TASK_ID": "1"}
            subprocess.run(["bash", harmless], check=True, timeout=10, cwd=folder, env=environment)
            harmless.unlink()
        assert sorted(path.relative_to(folder) for path in folder.rglob("*")) == before
    assert refused > 50  # both ways were taken
    assert accepted > 50


def test_values_for_the_scheduler_are_quoted(tmp_path):
    cluster = 'comment = "a \\"b\\" \\\\ c"\nexclusive = true\nrequeue = false\nmem = "4G"\nnice = 10'
    text = write_job_array(read_study(write_study(tmp_path, cluster=cluster))).read_text()
    assert '#SBATCH --comment="a \\"b\\" \\\\ c"\n#SBATCH --exclusive\n#SBATCH --mem=4G\n#SBATCH --nice=10\n' in text
    assert "requeue" not in text


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("((10**1000)**1000)**1000", "too large"),
        ("9**999", "too large"),
        ("2**1000 * 2**1000 * 2**1000", "too large"),
        ("1e308*10**400", "too large"),
        ("(-8)**0.5", "no real number"),
        ("round(5, -1000000000)", "at most 300 digits"),
        ("(" * 400 + "1" + ")" * 400, "expected a parameter or a formula"),
        ("-" * 900 + "1", "nested too deeply"),
        ("1" * 2000, "the formula has 2000 characters"),
        ("+".join("1" * 200), "nested too deeply"),
        ("n" * 10**7, "the formula has 10000000 characters"),
        ("0x" + "f" * 900, "too large"),
    ],
)
def test_formulas_end_soon(formula, message):
    begin = time.process_time()
    with pytest.raises(ValueError, match=message):
        evaluate(formula, {})
    assert time.process_time() - begin < 1.0  # one takes about a millisecond


def test_formats_are_bounded():
    assert formatted(2.5, "010.3f") == "000002.500"
    assert formatted("a", ">5s") == "    a"
    for form in ("1000d", "999999999999d", ".100f", ".9999999999f", "{n}", "c"):
        with pytest.raises(ValueError, match="is no format"):
            formatted(1, form)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "a"\nthreads = ' + "9" * 5000, r"s\.toml:3:1: error: a number has too many digits"),
        ("[parameters]\nn = [" + "9" * 4000 + "]", "expected a list of numbers or texts"),
        ("[parameters]\nn = 0x" + "f" * 100_000, "expected a list of numbers or texts, found a number of too many"),
        ("x = " + "[" * 100_000, "nested too deeply"),
        ("a" + ".a" * 100_000 + " = 1", "nested too deeply"),
        ("[parameters]\n" + "".join(f"p{i} = {list(range(30))}\n" for i in range(9)), "more than 100000 cases"),
        ("[constants]\n" + "".join(f"p{i} = 1\n" for i in range(300)), "more than 200 parameters and constants"),
        ("#" * 5_000_000, "has more than 4 MB"),
        ('[parameters]\nn = "' + "a" * 100_000 + '"', r"found 'a{56}\.\.\."),
    ],
    ids=["digits", "large", "hexadecimal", "nested", "dotted", "grid", "constants", "file", "message"],
)
def test_large_studies_end_soon(tmp_path, text, message):
    (tmp_path / "template").mkdir()
    begin = time.process_time()
    (tmp_path / "s.toml").write_text(f"template = 'template'\n{text}")
    with pytest.raises(InputError, match=message) as error:
        read_study(tmp_path / "s.toml")
    assert len(str(error.value)) < 1000
    assert time.process_time() - begin < 5.0  # the slowest takes about 1 s


def test_long_names_of_folders_are_refused(tmp_path):
    (tmp_path / "s.toml").write_text(f"template = '{'p' * 5000}'\n[parameters]\nn = [1]")
    with pytest.raises(InputError, match=r"s\.toml:1:1: error: template: no such folder"):
        read_study(tmp_path / "s.toml")


def test_many_braces_end_soon(tmp_path):
    study = write_study(tmp_path)
    (tmp_path / "template/b.df").write_text("{{" * 500_000)
    begin = time.process_time()
    with pytest.raises(InputError, match=r"b\.df:1:1: error: placeholder \{\{: expected a formula without braces"):
        read_study(study)
    (tmp_path / "template/b.df").write_text("{{n}}\n" * 100_000)
    read_study(study)
    assert time.process_time() - begin < 5.0  # quadratic search took minutes


GRID = 'template = "template"\n[parameters]\nn = [3]\n'


def write_grid(folder, more="", output=""):
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copytree(INPUTS / "incline", folder / "template", dirs_exist_ok=True)
    options = folder / "template/incline.df"
    options.write_text(options.read_text() + "# {{n}}\n")
    (folder / "s.toml").write_text(output + GRID + more)
    return folder / "s.toml"


@pytest.mark.parametrize("words", [["-o", "../../../victim.txt"], ["--output=../../../victim.txt"],
                                   ["--output", "../../../victim.txt"], ["-c", "x.nml"], ["--config=x.nml"],
                                   ["--", "x.dc"]])  # fmt: skip
def test_options_of_runs_that_name_files_are_refused(tmp_path, capsys, words):
    """-o overwrote any file of the user, with --force."""
    victim = tmp_path / "victim.txt"
    victim.write_text("precious")
    study = write_grid(tmp_path, f"[run]\noptions = {json.dumps(words)}\n")
    assert cli.main(["study", str(study)]) == 2
    assert re.search(r"s\.toml:5:1: error: options: '.*' names a file", capsys.readouterr().err)
    assert victim.read_text() == "precious"
    assert not (tmp_path / "s").exists()


def test_every_option_of_a_run_that_takes_a_file_is_refused(program, tmp_path):
    told = subprocess.run([program, "run", "--help"], capture_output=True, text=True, check=True).stdout
    names = re.findall(r"^  (?:(-\w), )?(--[\w-]+) FILE", told, re.M)
    assert len(names) >= 2
    for name in filter(None, [word for pair in names for word in pair]):
        with pytest.raises(InputError, match="names a file"):
            read_study(write_grid(tmp_path, f'[run]\noptions = ["{name}", "x"]\n'))


@pytest.mark.parametrize(
    "name", ["..", ".", "../elsewhere", "{tmp}/elsewhere", "link", "link/deeper", "s/../../x", "loop"]
)
def test_an_output_folder_elsewhere_is_refused(tmp_path, name):
    (tmp_path / "elsewhere").mkdir()
    here = tmp_path / "here"
    here.mkdir()
    (here / "link").symlink_to(tmp_path / "elsewhere")
    (here / "loop").symlink_to("loop")
    study = write_grid(here, output=f'output = "{name.format(tmp=tmp_path)}"\n')
    with pytest.raises(InputError, match=r"s\.toml:1:1: error: output: expected a folder below that of the study file"):
        read_study(study)
    assert read_study(study, tmp_path / "elsewhere").output == tmp_path / "elsewhere"  # the user's own choice


def test_values_lead_no_case_out_of_its_folder(tmp_path):
    study = write_grid(tmp_path)
    study.write_text(study.read_text().replace("n = [3]", 'n = ["../../x", "..", "/etc/x", ".", "a/../b"]'))
    found = read_study(study)
    for case in found.cases:
        folder = folder_of(found, case)
        assert folder.resolve().parent == (tmp_path / "s/cases").resolve()
        assert folder.name.startswith(f"{case.number:04d}_n")


@pytest.mark.parametrize("name", ["cases", "cases/0001_n3"])
def test_links_below_the_output_folder_are_refused(tmp_path, name):
    (tmp_path / "elsewhere").mkdir()
    study = read_study(write_grid(tmp_path / "here"))
    link = study.output / name
    link.parent.mkdir(parents=True)
    link.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError, match="it is a symbolic link"):
        run_study(study)
    assert not list((tmp_path / "elsewhere").iterdir())


def test_files_that_a_template_names_are_not_written(program, tmp_path, monkeypatch):
    """The run has an option `output` in its file; the study's own name prevails."""
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    study = write_grid(tmp_path / "here")
    (tmp_path / "here/template/options.nml").write_text("&run output = '../../../../victim.h5', force = .true. /\n")
    (tmp_path / "victim.h5").write_text("precious")
    code = cli.main(["study", str(study), "--quiet"])
    assert (tmp_path / "victim.h5").read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["here", "victim.h5"]
    assert code in (0, 3)


@pytest.mark.parametrize("name", ["output", "error", "outp", "err", "input", "chdir", "wrap", "Output"])
def test_options_of_the_scheduler_that_name_files_are_refused(tmp_path, name):
    study = read_study(write_study(tmp_path, cluster=f'{name} = "/home/user/.bashrc"'))
    with pytest.raises(InputError, match="names files or commands"):
        write_job_array(study)


def test_commands_for_workers_of_dask_are_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "dask_jobqueue", types.SimpleNamespace())
    study = read_study(write_study(tmp_path, cluster='job_script_prologue = ["touch PWNED"]'))
    with pytest.raises(InputError, match=r"\[cluster\]: 'job_script_prologue' is none of queue, project"):
        dask_workers._cluster(study, "slurm", 1)


def test_cells_are_no_formulas_and_hold_no_control_characters():
    """A spreadsheet takes cells that begin with = + - @ for formulas; numbers stay numbers."""
    cells = [
        "=HYPERLINK(1)",
        "+1+1",
        "-2+3",
        "@SUM(1)",
        " =1",
        "\uff1d1+1",
        "\t=1",
        "a\x1b[2Jb",
        "a\nb",
        "-5",
        "+1e3",
        "x=1",
    ]
    safe = ["'=HYPERLINK(1)", "'+1+1", "'-2+3", "'@SUM(1)", "' =1", "'\uff1d1+1", r"\t=1", r"a\x1b[2Jb", r"a\nb", "-5",
            "+1e3", "x=1"]  # fmt: skip
    table = pandas.DataFrame({"=name": cells, "number": [-0.5] * len(cells)})
    rows = list(csv.reader(io.StringIO(csv_text(table))))
    assert rows == [["'=name", "number"], *([cell, "-0.5"] for cell in safe)]


def test_the_table_of_a_study_holds_no_formulas(program, tmp_path, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    study = write_grid(tmp_path / "here")
    study.write_text(study.read_text().replace("n = [3]", """n = ["=cmd|'/C calc'!A0"]"""))
    cli.main(["study", str(study), "--quiet"])
    with (tmp_path / "here/s/table.csv").open(newline="") as stream:
        (row,) = csv.DictReader(stream)
    assert row["n"] == "'=cmd|'/C calc'!A0"


@pytest.mark.parametrize("formula", ["1e308*10*n", "1e400", "-1e308*10", "(1e308*10) - (1e308*10)", "n*1e308*1e308"])
def test_numbers_that_are_not_finite_are_refused(tmp_path, formula):
    study = write_study(tmp_path)
    (tmp_path / "template/a.df").write_text("\n {{" + formula + "}} {{n}}\n")
    with pytest.raises(InputError, match=r"a\.df:2:2: error: placeholder .*: the result is no finite number"):
        read_study(study)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_a_study_of_any_encoding_and_line_end_is_the_same(tmp_path, encoding):
    path = write_study(tmp_path, '"Böschung" # a comment')
    wanted = read_study(path)
    path.write_bytes(path.read_text(encoding="utf-8").replace("\n", "\r").encode(encoding))
    assert read_study(path).title == wanted.title == "Böschung"
