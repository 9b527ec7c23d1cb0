# SPDX-License-Identifier: MIT
"""The command: its files, messages and exit codes."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
import rockdda
from PIL import Image
from places import INPUTS
from rockdda.cli import main
from synthetic import write_wall

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with results of 5 × 4 squares."""
    write_wall(tmp_path / "wall.h5", 5, 4)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(capsys, *arguments):
    """Exit code, standard output and standard error."""
    code = main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.mark.parametrize(
    "kind", ["blocks", "stress", "contacts", "displacements", "history", "profile", "energy", "iterations"]
)
def test_plot_of_every_kind(folder, capsys, kind):
    assert run(capsys, "plot", "wall.h5", "--kind", kind, "--dpi", 50) == (0, f"wall_{kind}.png\n", "")
    with Image.open(folder / f"wall_{kind}.png") as image:
        assert len(np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)) > 10


def test_plot_of_input(native, folder, capsys):
    assert run(capsys, "plot", INPUTS / "tunnel/tunnel.dc", "--units", "SI") == (0, "tunnel_input.png\n", "")
    assert run(capsys, "plot", INPUTS / "tunnel/tunnel.dc", "-k", "blocks") == (0, "tunnel_blocks.png\n", "")
    code, _, err = run(capsys, "plot", INPUTS / "tunnel/tunnel.dc", "--scale", 2)
    assert code == 2
    assert "--scale is for results, not for a geometry or block file" in err
    code, _, err = run(capsys, "plot", INPUTS / "tunnel/tunnel.df")
    assert code == 2
    assert "expected a geometry or block file" in err


@pytest.mark.parametrize(
    ("what", "title"),
    [
        ("plot a.png", b"B\xf6schung"),
        ("plot a.png", b"cost $x^ and $y"),  # no mathematics
        ("animate a.html", b"B\xf6schung"),
        ("animate a.gif", b"two\nlines \x1b[31m \xed\xa0\x80"),
    ],
)
def test_names_and_titles_of_any_encoding(folder, what, title):
    name = os.fsencode(str(folder)) + b"/w\xe4nde.h5"  # Latin-1
    with open(name, "wb") as file:  # noqa: PTH123
        file.write((folder / "wall.h5").read_bytes())
    with h5py.File(name, "a") as file:
        kind = h5py.string_dtype("utf-8", len(title))
        del file.attrs["title"]
        file.attrs.create("title", np.bytes_(title), dtype=kind)
    command, output = what.split()
    done = subprocess.run(
        [sys.executable, "-m", "rockdda", command, name, "-o", b"\xfc" + output.encode()],
        capture_output=True,
        env=os.environ | {"PYTHONPATH": str(ROOT / "postprocess"), "PYTHONUTF8": "1"},
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(b"\xfc" + output.encode())  # as the shell gave it
    if output == "a.html":
        assert "<title>Böschung</title>" in (folder / os.fsdecode(b"\xfca.html")).read_text(encoding="utf-8")


def test_the_version_is_that_of_the_package(capsys):
    assert run(capsys, "--version") == (0, f"rockdda-post {rockdda.__version__}\n", "")


def test_nothing_is_answered_with_the_help(capsys):
    code, out, err = run(capsys)
    assert (code, err) == (2, "rockdda-post: error: no command given\n")
    assert "Usage: rockdda-post " in out


def test_plot_options(folder, capsys):
    options = [
        "--field",
        "stress_x",
        "--time",
        0.11,
        "--limits",
        -5,
        5,
        "--units",
        "m,s,kN",
        "--scale",
        10,
        "--title",
        "T",
    ]
    code, out, err = run(capsys, "plot", "wall.h5", "-o", "a.svg", "--json", "--no-outline", *options)
    assert (code, err) == (0, "")
    assert json.loads(out) == {"status": "done", "exit_code": 0, "output": "a.svg", "kind": "blocks", "frame": 1}
    text = (folder / "a.svg").read_text()
    assert "[kPa]" in text
    assert "T, displacements × 10" in text
    assert run(capsys, "plot", "wall.h5", "wall.h5", "--label", "a", "--label", "b", "-q", "-o", "m.pdf") == (0, "", "")
    assert (folder / "m.pdf").read_bytes().startswith(b"%PDF")
    assert run(capsys, "plot", "wall.h5", "-k", "profile", "--line=0,1.5,5,1.5", "--dpi", 50)[0] == 0


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["plot"], 2, "rockdda-post: error: Missing argument 'FILE...'"),
        (["plot", "wall.h5", "--colour", "x"], 2, "rockdda-post: error: No such option: --colour"),
        (["sing", "wall.h5"], 2, "rockdda-post: error: No such command 'sing'"),
        (["info", "wall.h5"], 2, "rockdda-post: error: No such command 'info'; it is `rockdda info`"),
        (["plot", "none.h5"], 2, "none.h5: error: no such file"),
        (["plot", "text.h5"], 2, "text.h5: error: is not a results file: it is no HDF5 file"),
        (["plot", "model.nml"], 2, "model.nml: error: is a model or an options file: `rockdda-post view` shows models"),
        (["plot", "wall.h5", "--field", "heat"], 2, "rockdda-post: error: there is no field 'heat'; the fields are:"),
        (["plot", "wall.h5", "--kind", "pie"], 2, "rockdda-post: error: there is no kind of picture 'pie'"),
        (["plot", "wall.h5", "--frame", "3"], 2, "wall.h5: error: there are frames 0 to 2, not 3"),
        (["plot", "wall.h5", "-o", "wall.h5"], 2, "wall.h5: error: would overwrite results"),
        (["plot", "wall.h5", "-o", "wall.xyz"], 2, "wall.xyz: error: pictures end in "),
        (["plot", "wall.h5", "-o", "no/where.png"], 5, "rockdda-post: error: no/where.png: cannot be written"),
        (["plot", "wall.h5", "-k", "profile", "--line", "1,2,3"], 2, "rockdda-post: error: line '1,2,3': expected"),
        (["plot", "wall.h5", "-k", "history", "-c", "heat"], 2, "rockdda-post: error: there is no column 'heat'"),
        (["plot", "wall.h5", "-k", "energy", "--scale", "2"], 2, "rockdda-post: error: a picture of kind 'energy'"),
        (["animate", "wall.h5", "-o", "film.avi"], 2, "film.avi: error: a film ends in .mp4, .gif, .html"),
        (["export", "wall.h5", "-o", "wall.doc"], 2, "wall.doc: error: unknown format 'doc'"),
        (["export", "wall.h5", "--frames", "7"], 2, "wall.h5: error: there are frames 0 to 2, not 7"),
        (["export", "wall.h5", "-o", "a.vtu", "--table", "blocks"], 2, "a.vtu: error: --table blocks makes a .csv"),
        (["export", "wall.h5", "-o", "a.vtu", "--frames", "0:2"], 2, "rockdda-post: error: .vtu takes one frame"),
        (["convert", "text.h5"], 2, "text.h5: error: is none of DDAML, DXF, GeoJSON"),
        (["convert", "a.dxf", "--layer", "x"], 2, "rockdda-post: error: layer 'x': expected NAME=KIND"),
        (["convert", "a.dxf", "--e0", "-1"], 2, "rockdda-post: error: e0 must be positive, found -1"),
        (["compare", "wall.h5", "none.h5"], 2, "none.h5: error: no such file"),
        (["view", "wall.h5", "--port", "70000"], 2, "rockdda-post: error: Invalid value for '--port'"),
    ],
)  # fmt: skip
def test_errors_are_one_line(folder, capsys, arguments, code, message):
    (folder / "text.h5").write_text("no HDF5\n")
    (folder / "model.nml").write_text("! a slope\n\n&model geometry = 'slope.dc' /\n")
    before = sorted(folder.iterdir())
    found, out, err = run(capsys, *arguments)
    assert (found, out) == (code, "")
    assert err.startswith(message)
    assert err.count("\n") == 1
    assert sorted(folder.iterdir()) == before


def test_bugs_ask_for_a_report(folder, capsys, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("rockdda.cli.command.open_results", broken)
    code, _, err = run(capsys, "plot", "wall.h5")
    assert code == 1
    assert "internal error: ZeroDivisionError: oh. This is a bug, please report it" in err
    assert "Traceback" not in err


def test_animate(folder, capsys):
    code, out, _ = run(capsys, "animate", "wall.h5", "-o", "wall.html", "--every", 2)
    assert code == 0
    assert out.startswith("wall.html: 2 frames, 0.")
    code, out, _ = run(capsys, "animate", "wall.h5", "-o", "wall.gif", "--dpi", 40, "--json")
    assert json.loads(out)["frames"] == 3


def test_export(folder, capsys):
    assert run(capsys, "export", "wall.h5") == (0, "wall.pvd: 3 frames\n", "")
    assert len(list((folder / "wall").glob("*.vtu"))) == 3
    assert run(capsys, "export", "wall.h5", "-o", "h.csv") == (0, "h.csv: 2 steps\n", "")
    assert run(capsys, "export", "wall.h5", "-o", "b.csv", "--table", "blocks", "--frames", "-1")[0] == 0
    assert run(capsys, "export", "wall.h5", "--table", "blocks") == (0, "wall_blocks.csv: 3 frames\n", "")
    assert len((folder / "b.csv").read_text().splitlines()) == 21
    assert run(capsys, "export", "wall.h5", "-o", "outlines", "--format", "txt", "--frames", "::2")[0] == 0
    assert np.loadtxt(folder / "outlines").shape == (200, 4)
    assert run(capsys, "export", "wall.h5", "-o", "end.dxf") == (0, "end.dxf: 1 frame\n", "")
    assert run(capsys, "export", "wall.h5", "-o", "end.vtu", "-q") == (0, "", "")
    (folder / "there").mkdir()
    assert run(capsys, "export", "wall.h5", "-o", "there", "--format", "csv") == (0, "there/wall.csv: 2 steps\n", "")
    assert run(capsys, "export", "wall.h5", "-o", "there/all") == (0, "there/all.pvd: 3 frames\n", "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")  # noqa: PTH110
@pytest.mark.parametrize("ending", ["png", "svg"])
def test_a_full_disk_is_reported(folder, capsys, ending):
    (folder / f"a.{ending}").symlink_to("/dev/full")
    code, out, err = run(capsys, "plot", "wall.h5", "-o", f"a.{ending}")
    assert (code, out) == (5, "")
    assert err == f"rockdda-post: error: a.{ending}: cannot be written: No space left on device\n"


def test_compare_says_where_and_when(folder, capsys):
    import h5py

    write_wall(folder / "b.h5", 5, 4)
    code, out, err = run(capsys, "compare", "wall.h5", "b.h5")
    assert (code, err) == (0, "")
    assert out == "wall.h5 and b.h5: the same bits in 33 datasets\n"
    with h5py.File("b.h5", "a") as file:
        file["frames/stress"][1, 7, 1] += 0.5
    code, out, err = run(capsys, "compare", "wall.h5", "b.h5")
    assert (code, err) == (1, "")
    assert out.startswith(
        "they part in frames/stress: step 1, time 0.1, block 8, array index [7, 1]: -3.0 and -2.5; at most 0.5 ("
    )
    code, out, _ = run(capsys, "compare", "wall.h5", "b.h5", "--json")
    assert json.loads(out)["differences"][0]["block"] == 8  # counted from 1
    assert run(capsys, "compare", "wall.h5", "b.h5", "--tol", 0.1)[0] == 0


def test_convert_shows_warnings_and_keeps_files(folder, capsys):
    (folder / "a.geojson").write_text('{"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [2, 2], [0, 0]]]}')
    code, out, err = run(capsys, "convert", "a.geojson", "--template")
    assert (code, out) == (0, "a.dc\na.nml\n")
    assert err.startswith("a.geojson: note: the labelled file has typical values")
    code, _, err = run(capsys, "convert", "a.geojson")
    assert (code, err) == (2, "a.dc: error: the file exists; use --force to overwrite it\n")
    code, out, err = run(capsys, "convert", "a.geojson", "--force", "--json")
    assert json.loads(out)["files"] == ["a.dc"]


@pytest.mark.parametrize("command", ["plot", "animate", "view", "export", "convert", "compare"])
def test_help_has_examples(command):
    done = subprocess.run(
        [sys.executable, "-m", "rockdda", command, "--help"], capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONPATH": str(ROOT / "postprocess"), "COLUMNS": "100"},
    )  # fmt: skip
    assert "Examples" in done.stdout
    assert done.stdout.count(f"rockdda-post {command} ") >= 2
    assert max(done.stdout) < "\U0001f000"  # rich draws :100: as a pictogram


def test_view_serves_until_interrupted(folder):
    command = [sys.executable, "-m", "rockdda", "view", "wall.h5", "--no-browser"]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "postprocess"), "PYTHONUNBUFFERED": "1"}
    # tests in the background ignore SIGINT, and so would what they start
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        address = next(word for word in process.stdout.readline().split() if word.startswith("http"))
        assert address.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(address, timeout=120) as answer:
            assert "<title>wall</title>" in answer.read().decode()
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=120) == 0
        assert process.stderr.read() == ""
    finally:
        process.kill()
        process.wait()


def test_three_lines_do(flat_arch):
    """What the README promises, less the run itself."""
    results = rockdda.open(flat_arch)
    axes = results.plot("stress_min")
    assert axes.get_xlabel() == "x [length]"


@pytest.mark.parametrize("steps", [0, 1])
def test_runs_of_no_or_one_step(folder, capsys, program, steps):
    command = [program, "run", ROOT / "inputs/incline", "-o", "short.h5", "--steps", str(steps), "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for kind in ("history", "energy", "iterations", "profile", "displacements"):
            assert run(capsys, "plot", "short.h5", "-k", kind, "--dpi", 40) == (0, f"short_{kind}.png\n", "")
    assert run(capsys, "animate", "short.h5", "-o", "short.html")[0] == 0
    assert run(capsys, "compare", "short.h5", "short.h5")[0] == 0


def test_results_without_frames(folder, capsys, program):
    (folder / "bare.nml").write_text("&output frames = .false. /\n")
    command = [
        program,
        "run",
        ROOT / "inputs/incline",
        "-o",
        "bare.h5",
        "--steps",
        "3",
        "--quiet",
        "--config",
        "bare.nml",
    ]
    subprocess.run(command, check=True, capture_output=True)
    assert run(capsys, "plot", "bare.h5", "-k", "energy", "--dpi", 40) == (0, "bare_energy.png\n", "")
    assert run(capsys, "export", "bare.h5", "-o", "bare.csv") == (0, "bare.csv: 3 steps\n", "")
    assert run(capsys, "compare", "bare.h5", "bare.h5")[0] == 0
    for command in (["plot"], ["export"], ["export", "--table", "blocks", "-o", "b.csv"], ["animate"], ["view"]):
        code, _, err = run(capsys, command[0], "bare.h5", *command[1:])
        assert (code, err) == (2, "bare.h5: error: there are no frames in it\n")


def test_frames_of_single_precision(folder, capsys, program):
    """Every command reads them, as 64 bits in Python; what differs from a run in double precision is rounding."""
    (folder / "single.nml").write_text("&output precision = 'single' /\n")
    for name, options in (("double", ()), ("single", ("--config", "single.nml"))):
        model = [program, "run", ROOT / "inputs/flat_arch", "-o", f"{name}.h5", *options]
        subprocess.run([*model, "--steps", "20", "--save-every", "5", "--quiet"], check=True, capture_output=True)
    exact, found = rockdda.open("double.h5"), rockdda.open("single.h5")
    np.testing.assert_array_equal(found.frames[-1].vertices, exact.frames[-1].vertices)
    assert found["frames/stress"].dtype == np.float64
    for name in ("frames/stress", "frames/rotation", "frames/contact_force", "frames/contact_normal_stress"):
        assert not np.array_equal(found[name], exact[name]), name
        # one rounding to 24 bits
        np.testing.assert_allclose(found[name], exact[name], rtol=2**-24, atol=1e-44, err_msg=name)
    assert run(capsys, "compare", "double.h5", "single.h5")[0] == 1
    assert run(capsys, "compare", "double.h5", "single.h5", "--tol", 1e-7)[0] == 0
    for kind in ("blocks", "stress", "contacts", "joints", "energy"):
        assert run(capsys, "plot", "single.h5", "-k", kind, "--dpi", 40) == (0, f"single_{kind}.png\n", "")
    for ending in ("pvd", "dxf", "txt"):
        assert run(capsys, "export", "single.h5", "-o", f"end.{ending}")[0] == 0
    for table in ("blocks", "contacts", "joints"):
        assert run(capsys, "export", "single.h5", "-o", f"{table}.csv", "--table", table)[0] == 0
    assert run(capsys, "animate", "single.h5", "-o", "single.html")[0] == 0
    assert run(capsys, "report", "single.h5", "-o", "single_report.html")[0] == 0
