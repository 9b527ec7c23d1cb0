# SPDX-License-Identifier: MIT
"""Results files with absurd contents are refused with the place, or shown: no internal error, no gigabytes."""

import time

import h5py
import numpy as np
import pytest
from rockdda import cli
from synthetic import write_wall

COMMANDS = {
    "plot": ["plot", "wall.h5", "-o", "a.png", "--dpi", "20"],
    "history": ["plot", "wall.h5", "--kind", "history", "-o", "a.png", "--dpi", "20"],
    "animate": ["animate", "wall.h5", "-o", "a.html"],
    "export": ["export", "wall.h5", "-o", "a.csv", "--table", "blocks"],
}


@pytest.fixture
def wall(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write_wall(tmp_path / "wall.h5", 3, 2, frames=2)


def replace(path, name, data):
    with h5py.File(path, "a") as file:
        attributes = dict(file[name].attrs)
        del file[name]
        table = file.create_dataset(name, data=data)
        for key, value in attributes.items():
            table.attrs[key] = value


def shown(capsys, command):
    code = cli.main(COMMANDS[command])
    return code, capsys.readouterr().err


@pytest.mark.parametrize("name", ["history/time", "frames/time", "frames/centroid", "frames/step", "model/vertices"])
def test_a_dataset_without_extent_is_refused(wall, capsys, name):
    """It was an internal error: 'NoneType' object is not iterable."""
    replace(wall, name, h5py.Empty("f8"))
    for command in ("plot", "history"):
        assert shown(capsys, command) == (
            2,
            f"wall.h5: error: the file is not as RockDDA writes it: {name} has no extent\n",
        ), command


def test_an_attribute_without_extent_is_refused(wall, capsys):
    with h5py.File(wall, "a") as file:
        file.attrs["title"] = h5py.Empty("f8")
    assert shown(capsys, "plot") == (2, "wall.h5: error: the file is not as RockDDA writes it: /@title has no extent\n")


@pytest.mark.parametrize("value", [1e300, -1.7e308])
@pytest.mark.parametrize("name", ["model/vertices", "frames/vertices", "frames/centroid", "frames/stress"])
def test_numbers_without_squares_are_refused(wall, capsys, name, value):
    with h5py.File(wall) as file:
        data = file[name][()]
    data[..., 0] = value
    replace(wall, name, data)
    code, told = shown(capsys, "plot" if name != "frames/stress" else "export")
    assert code == 2
    assert f"{name} holds a number above 1e+30 in size" in told


@pytest.mark.parametrize("command", ["plot", "animate"])
def test_a_frame_without_blocks_is_shown(wall, flat_arch, capsys, command):
    wall.write_bytes(flat_arch.read_bytes())
    with h5py.File(wall) as file:
        active = file["frames/active"][()]
    replace(wall, "frames/active", np.zeros_like(active))
    assert shown(capsys, command)[0] == 0


@pytest.mark.parametrize("where", ["title", "option", "label"])
def test_titles_of_20000_letters_end_soon(wall, capsys, where):
    """They took 2 GB and 20 s of layout."""
    long = "W $x_ " * 3400
    command = [*COMMANDS["plot"]]
    if where == "title":
        with h5py.File(wall, "a") as file:
            file.attrs["title"] = long
    elif where == "option":
        command += ["--title", long]
    else:
        command = ["plot", "wall.h5", "wall.h5", "-o", "a.png", "--dpi", "20", "--label", long, "--label", "b"]
    begin = time.process_time()
    assert cli.main(command) == 0, capsys.readouterr().err
    assert time.process_time() - begin < 10  # 1 s; the whole text took 20 s
