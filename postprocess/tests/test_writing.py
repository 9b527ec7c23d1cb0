# SPDX-License-Identifier: MIT
"""Files that the commands write: none through a symbolic link, none under a name that can be foreseen."""

import ast
import os
import shutil
import stat

import numpy as np
import pytest
import rockdda
import typer
from places import INPUTS, ROOT
from rockdda import cli
from rockdda.analysis.pull_test import pull_curve
from rockdda.cli.command import app
from rockdda.errors import OutputError
from rockdda.writing import complete_file, write_file
from synthetic import write_wall
from test_reaction import hole

PACKAGE = ROOT / "postprocess/rockdda"
STUDY = """\
template = "template"
[parameters]
n = [1, 2]
[results.energy]
dataset = "history/energy"
at = [0]
"""
RECORD = "t,a\n" + "".join(f"{0.01 * i!r},{(-1) ** i * 0.1 * i!r}\n" for i in range(200))

#: Every command that writes, in each of its kinds.
WRITERS = {
    "plot": ["plot", "wall.h5", "-o", "out.png", "--dpi", "30"],
    "plot input": ["plot", "model.dc", "-o", "out.svg"],
    "animate html": ["animate", "wall.h5", "-o", "out.html"],
    "animate gif": ["animate", "wall.h5", "-o", "out.gif", "--dpi", "30"],
    "report": ["report", "wall.h5", "-o", "out.html"],
    "export csv": ["export", "wall.h5", "-o", "out.csv", "--table", "history"],
    "export blocks": ["export", "wall.h5", "-o", "out.csv", "--table", "blocks"],
    "export txt": ["export", "wall.h5", "-o", "out.txt"],
    "export dxf": ["export", "wall.h5", "-o", "out.dxf"],
    "export vtu": ["export", "wall.h5", "-o", "out.vtu"],
    "export pvd": ["export", "wall.h5", "-o", "out.pvd"],
    "export vtkhdf": ["export", "wall.h5", "-o", "out.vtkhdf"],
    "convert": ["convert", "traces.txt", "-o", "out", "--template", "--force"],
    "record": ["record", "quake.csv", "-o", "out.png", "--dpi", "30", "--write", "written.csv"],
    "calibrate-bolt": ["calibrate-bolt", "pull.csv", "--length", "1", "--diameter", "0.025", "-o", "out.png"],
    "ground-reaction": ["ground-reaction", "hole/hole.nml", "--releases", "2", "-o", "out.png", "--dpi", "30"],
    "study": ["study", "grid.toml", "--workers", "1"],
    "study slurm": ["study", "grid.toml", "--slurm"],
    "convergence": ["convergence", "template", "--jobs", "1"],
    "reliability": ["reliability", "template", "--vary", "joint_material 1.friction = normal(30, 3)", "--runs", "4"],
    "reliability slurm": ["reliability", "template", "--vary", "joint_material 1.friction = normal(30, 3)", "--slurm"],
    "validate": ["validate", "--case", "6.5-voussoir", "-o", "out", "--force"],
}
#: a bar of 1 m that slips at 175 kN/m, by the closed form
PULL_TEST = "displacement [mm], force [kN]\n" + "".join(
    f"{1e3 * x:.6g}, {1e-3 * pull_curve(x, 1.0, 98e6, 1.12e8, 1.75e5):.6g}\n" for x in np.linspace(0, 9e-3, 20)
)
#: Commands that write no file, or make pages in memory only.
OTHERS = {"view", "compare", "loosening", "voussoir", "rockload", "completion"}


def prepare(folder):
    """Everything that the commands read."""
    folder.mkdir()
    write_wall(folder / "wall.h5", 3, 2, frames=2)
    (folder / "quake.csv").write_text(RECORD)
    (folder / "traces.txt").write_text("0 0 10 0\n10 0 10 8\n10 8 0 8\n0 8 0 0\n0 3 10 3\n4 0 4 8\n")
    (folder / "pull.csv").write_text(PULL_TEST)
    (folder / "hole").mkdir()
    hole(12, 4).write(folder / "hole")
    shutil.copy(INPUTS / "incline/incline.dc", folder / "model.dc")
    shutil.copytree(INPUTS / "incline", folder / "template")
    options = next((folder / "template").glob("*.df"))
    options.write_text(options.read_text() + "# {{n}}\n")
    (folder / "grid.toml").write_text(STUDY)
    return folder


def run(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert cli.main([*WRITERS[name], "--quiet"]) == (3 if name == "convergence" else 0)  # joint stiffness matters


def files(folder):
    return {path.relative_to(folder) for path in folder.rglob("*") if not path.is_dir()}


@pytest.fixture
def chosen(name, program, monkeypatch):
    """The name of a writer whose packages are installed."""
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    if name in ("validate", "convergence", "ground-reaction") or name.startswith("reliability"):
        pytest.importorskip("rockdda._rockdda")
    if name in ("export vtu", "export pvd"):
        pytest.importorskip("vtkmodules.vtkIOXML")
    if name in ("export dxf", "convert"):
        pytest.importorskip("ezdxf")
    if name in ("record", "calibrate-bolt", "validate") or name.startswith("reliability"):
        pytest.importorskip("scipy")
    return name


def test_every_command_stands_in_one_of_the_lists():
    assert {name.split()[0] for name in WRITERS} | OTHERS == set(typer.main.get_command(app).commands)


@pytest.mark.parametrize("name", WRITERS)
def test_no_command_writes_through_a_link_where_it_once_did(chosen, tmp_path, monkeypatch):
    """Once to see what is written, and again with links to a victim under all of these names and the former ones."""
    before = files(prepare(tmp_path / "first"))
    run(chosen, tmp_path / "first", monkeypatch)
    written = files(tmp_path / "first") - before
    names = {path for path in written if path.suffix != ".json" or chosen != "validate"}  # which are read first
    assert names
    second = prepare(tmp_path / "second")
    victim = tmp_path / "victim"
    victim.write_text("precious")
    for path in names:
        (second / path.parent).mkdir(parents=True, exist_ok=True)
        (second / path).symlink_to(victim)
        (second / path.with_name(f".{path.stem}.part{path.suffix}")).symlink_to(victim)
    run(chosen, second, monkeypatch)
    assert victim.read_text() == "precious"
    assert [path for path in names if (second / path).is_symlink()] == []
    assert files(second) - {path.with_name(f".{path.stem}.part{path.suffix}") for path in names} == before | written


#: What writes a file, with the place of its name among the arguments (None: the object itself).
WRITING = {"write_text": None, "write_bytes": None, "touch": None, "savefig": 0, "saveas": 0, "to_parquet": 0,
           "to_csv": 0, "write_pdf": 0, "to_file": 0, "copyfile": 1, "copy": 1, "copy2": 1, "copytree": 1}  # fmt: skip
#: Functions that write in a new folder which nobody else can enter.
PRIVATE = {
    ("writing.py", "write_file"), ("writing.py", "complete_file"), ("film/server.py", "_forwarding_page"),
    ("certainty/half_step.py", "_write_half"), ("convert/conversion.py", "_count_fixed"), ("model.py", "input_texts"),
    ("report/paper.py", "pdf_of"), ("report/paper.py", "_by_browser"),  # of both callers' `part`
}  # fmt: skip


def writes(tree):
    """(function, line, name of what is written to) of each call that writes a file."""
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        for call in ast.walk(function):
            if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute | ast.Name)):
                continue
            name = call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id
            if name in ("open", "File"):
                modes = [
                    a.value for a in [*call.args, *(k.value for k in call.keywords)] if isinstance(a, ast.Constant)
                ]
                if not any(isinstance(mode, str) and set(mode) & set("wax+") and len(mode) < 4 for mode in modes):
                    continue
                target = call.args[0] if name == "File" else getattr(call.func, "value", None)
            elif name in WRITING and isinstance(call.func, ast.Attribute):
                place = WRITING[name]
                if (place is not None and len(call.args) <= place) or getattr(call.func.value, "id", "") == "export":
                    continue  # a text, or a function of this package
                target = call.func.value if place is None else call.args[place]
            else:
                continue
            yield function.name, call.lineno, getattr(target, "id", "")


def test_all_writers_go_through_one():
    """What a function writes to is called `part` (of `complete_file`), or `stream` and `data` in memory."""
    found, seen = [], 0
    for path in sorted(PACKAGE.rglob("*.py")):
        file = path.relative_to(PACKAGE).as_posix()
        for function, line, target in writes(ast.parse(path.read_text(encoding="utf-8"))):
            seen += 1
            if target not in ("part", "stream", "data") and (file, function) not in PRIVATE:
                found.append(f"{file}:{line}: {function} writes past complete_file")
    assert found == []
    assert seen > 10


def test_the_part_lies_where_nobody_else_can_put_a_link(tmp_path):
    names = set()
    for _ in range(3):
        with complete_file(tmp_path / "out.csv") as part:
            names.add(part)
            assert part.suffix == ".csv"
            assert part.parent.parent == tmp_path
            assert stat.S_IMODE(part.parent.stat().st_mode) == 0o700
            part.write_text("1")
        assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]
    assert len(names) == 3  # another name each time


def test_a_file_has_the_rights_that_others_have(tmp_path):
    write_file(tmp_path / "out.txt", "text")
    (tmp_path / "other.txt").write_text("text")
    assert (tmp_path / "out.txt").stat().st_mode == (tmp_path / "other.txt").stat().st_mode


def test_what_fails_leaves_the_old_file_alone(tmp_path):
    write_file(tmp_path / "out.txt", "old")
    with pytest.raises(ZeroDivisionError):
        write_file(tmp_path / "out.txt", lambda stream: stream.write(str(1 / 0)))
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("out.txt", "old")]


def test_pipes_and_folders_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    for name in ("pipe", "link", "."):
        with pytest.raises(OutputError, match=r"cannot be written: it is no file"):
            write_file(tmp_path / name / "" if name == "." else tmp_path / name, "text")


def test_a_folder_that_is_a_link_gets_no_frames(tmp_path, monkeypatch):
    pytest.importorskip("vtkmodules.vtkIOXML")
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2, frames=2))
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError, match=r"out: cannot be written: it is a symbolic link"):
        results.to_vtk(tmp_path / "out.pvd")
    assert not list((tmp_path / "elsewhere").iterdir())
