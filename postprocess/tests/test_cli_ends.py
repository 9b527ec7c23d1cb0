# SPDX-License-Identifier: MIT
"""How the command ends when it is interrupted, and when its output cannot be written."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rockdda import cli
from synthetic import write_wall

COMMANDS = [
    ["--help"],
    ["plot", "wall.h5", "--dpi", "30", "--json"],
    ["export", "wall.h5", "-o", "wall.csv"],
    ["compare", "wall.h5", "wall.h5"],
    ["convert", "a.geojson", "-o", "a", "--force"],
    ["rockload", "--span", "10", "--height", "10"],
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ends")
    write_wall(folder / "wall.h5", 5, 4)
    (folder / "a.geojson").write_text('{"type":"LineString","coordinates":[[0,0],[1,1]]}')
    return folder


def start(folder, arguments, **options):
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])}
    command = [sys.executable, "-c", "from rockdda.cli import run; run()", *arguments]
    return subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True, **options)


def complaints(problems):
    """Lines of standard error but notes and what `convert` tells that it has taken."""
    return [line for line in problems.splitlines() if "note:" not in line and not line.startswith(("taken:", " "))]


@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_a_reader_that_goes_away_is_no_error(folder, arguments):
    """The pipe is closed before anything is written, as `| true` does."""
    reading, writing = os.pipe()
    os.close(reading)
    with start(folder, arguments, stdout=writing) as process:
        os.close(writing)
        _, problems = process.communicate(timeout=60)
    assert (process.returncode, complaints(problems)) == (0, [])


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_a_full_standard_output_is_reported(folder, arguments):
    with open("/dev/full", "w") as full, start(folder, arguments, stdout=full) as process:  # noqa: PTH123
        _, problems = process.communicate(timeout=60)
    assert process.returncode == cli.NO_OUTPUT
    assert complaints(problems) == ["rockdda-post: error: standard output cannot be written: No space left on device"]


def test_closed_streams_do_no_harm(folder):
    """What is written to a closed standard output must not land in a file."""
    command = f"exec {sys.executable} -c 'from rockdda.cli import run; run()' plot wall.h5 --dpi 30 -o x.png"
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])}
    done = subprocess.run(["bash", "-c", f"{command} <&- >&- 2>&-"], cwd=folder, env=environment, timeout=60)
    assert done.returncode == 0
    assert (folder / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("send", "number"), [(os.killpg, signal.SIGINT), (os.kill, signal.SIGTERM)], ids=["Ctrl-C", "SIGTERM"]
)
def test_a_film_that_is_stopped_ends_with_4(tmp_path, send, number):
    """Ctrl-C goes to the group, ffmpeg included, as from a terminal; SIGTERM of a batch system to the command alone."""
    write_wall(tmp_path / "long.h5", 3, 2, frames=2000)  # minutes
    arguments = ["animate", "long.h5", "-o", "film.mp4", "--dpi", "30"]
    with start(tmp_path, arguments, stdout=subprocess.PIPE, start_new_session=True) as process:
        begin = time.monotonic()
        while not list(tmp_path.glob(".film.part-*/film.mp4")) and time.monotonic() - begin < 60:
            time.sleep(0.05)
        assert process.poll() is None
        send(process.pid, number)
        _, problems = process.communicate(timeout=60)
    assert (process.returncode, problems) == (cli.STOPPED, "")
    assert [path.name for path in tmp_path.iterdir()] == ["long.h5"]


def test_sigterm_in_an_export_leaves_no_part(tmp_path):
    write_wall(tmp_path / "long.h5", 3, 2, frames=2000)
    with start(tmp_path, ["export", "long.h5", "-o", "long.vtkhdf"], stdout=subprocess.PIPE) as process:
        begin = time.monotonic()
        while not list(tmp_path.glob(".long.part-*/long.vtkhdf")) and time.monotonic() - begin < 60:
            time.sleep(0.01)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        _, problems = process.communicate(timeout=60)
    assert (process.returncode, problems) == (cli.STOPPED, "")
    assert [path.name for path in tmp_path.iterdir()] == ["long.h5"]


def test_sigterm_while_an_object_goes_is_not_lost():
    # Python drops exceptions of __del__ and of callbacks of weak references
    program = """
import os, signal, time
from rockdda.cli.common import stop_on_sigterm
class Going:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
stop_on_sigterm()
try:
    Going()
    time.sleep(30)
except KeyboardInterrupt:
    print("stopped")
"""
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])}
    command = [sys.executable, "-c", program]
    run = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60)
    assert (run.stdout, run.stderr) == ("stopped\n", "")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("DISPLAY", None, "there is no display ($DISPLAY is not set"),
        ("DISPLAY", ":4711", "the display ':4711' ($DISPLAY) cannot be opened"),
        ("PYVISTA_OFF_SCREEN", "true", "PYVISTA_OFF_SCREEN=true keeps PyVista from opening a window"),
    ],
)
def test_no_window_without_a_display(folder, capsys, monkeypatch, name, value, message):
    monkeypatch.delenv("PYVISTA_OFF_SCREEN", raising=False)
    monkeypatch.delenv(name, raising=False)
    if value is not None:
        monkeypatch.setenv(name, value)
        if value == ":4711":
            import ctypes.util

            if ctypes.util.find_library("X11") is None:
                pytest.skip("no X11")
    assert cli.main(["plot", str(folder / "wall.h5"), "--interactive"]) == cli.BAD_INPUT
    error = capsys.readouterr().err
    assert message in error
    assert "rockdda-post view needs a browser only" in error


def test_shells_complete_commands_and_fields(folder):
    environment = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])}
    command = [sys.executable, "-c", "from rockdda.cli import run; run()"]
    shown = subprocess.run(
        [*command, "--show-completion", "bash"], env=environment, capture_output=True, text=True, timeout=60
    )
    for words, wanted in (("rockdda-post an", "animate"), ("rockdda-post plot a.h5 --field stress_s", "stress_shear")):
        asked = {
            "_ROCKDDA_POST_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split()) - 1),
        }
        done = subprocess.run(command, env=environment | asked, capture_output=True, text=True, timeout=60)
        assert done.stdout.split() == [wanted], shown


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_scripts_of_shells_are_taken_by_them(folder, shell):
    home = folder / "bin"
    home.mkdir(exist_ok=True)
    command = home / "rockdda-post"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m rockdda "$@"\n')
    command.chmod(0o755)
    if not shutil.which(shell):
        pytest.skip(f"there is no {shell} here")
    path = {"PATH": f"{home}:{os.environ['PATH']}", "PYTHONPATH": str(Path(cli.__file__).parents[2])}
    environment = os.environ | path | {"HOME": str(folder)}
    script = {
        "bash": 'eval "$(rockdda-post completion bash)"; COMP_WORDS=(rockdda-post compl) COMP_CWORD=1\n'
        '_rockdda_post_completion rockdda-post; printf "%s\\n" "${COMPREPLY[@]}"',
        "zsh": 'eval "$(rockdda-post completion zsh)"; whence -w _rockdda_post_completion',
        "fish": 'rockdda-post completion fish | source; complete -C "rockdda-post compl"',
    }[shell]
    done = subprocess.run([shell, "-c", script], env=environment, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    expected = "_rockdda_post_completion: function" if shell == "zsh" else "completion"
    assert [line.split("\t")[0] for line in done.stdout.splitlines()] == [expected]
