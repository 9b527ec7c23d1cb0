# SPDX-License-Identifier: MIT
"""Results that are damaged or lead out of the file: refused in bounded time and memory, as by the program."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import rockdda
from places import ROOT

sys.path.insert(0, str(ROOT / "tests/fuzz"))
import damaged_results

PRECIOUS = b"a precious file of the user\n" * 20


@pytest.fixture
def results(flat_arch, tmp_path) -> Path:
    """A copy, and beside it a file that is none of RockDDA's business."""
    shutil.copy(flat_arch, tmp_path / "a.h5")
    (tmp_path / "victim.txt").write_bytes(PRECIOUS)
    return tmp_path / "a.h5"


def settle(path):
    """It was written long ago, and no run writes it any more."""
    os.utime(path, (1e9, 1e9))


def put(name, values, **options):
    def change(file):
        del file[name]
        file.create_dataset(name, data=values, **options)

    return change


def lead(name, link):
    def change(file):
        del file[name]
        file[name] = link

    return change


def external(file):
    n = file["model/block_area"].size
    del file["model/block_area"]
    file.create_dataset("model/block_area", shape=(n,), dtype="f8", external=[("victim.txt", 0, 8 * n)])


def virtual(file):
    del file["history/time"]
    layout = h5py.VirtualLayout((60,), "f8")
    layout[...] = h5py.VirtualSource("other.h5", "x", (60,))
    file.create_virtual_dataset("history/time", layout)


def cycle(file):
    file["frames/again"] = file["/"]


def large(file):
    del file["history/time"]
    file.create_dataset("history/time", (10**9,), "f8", chunks=(1024,))


def named_type(file):
    file["frames/type"] = np.dtype("f8")


def opaque(file):
    file["x"] = np.zeros(3, dtype="V9")


def not_finite(file):
    file["model/vertices"][0, 0] = np.nan


def offset(value):
    def change(file):
        file["model/vertex_offset"][1] = value

    return change


def block_of_a_point(file):
    file["model/fixed_points"].attrs.modify("block", np.full(len(file["model/fixed_points"]), 10**6, dtype="i4"))


def numbers(*values):
    return lambda file: file["model/measured_points"].attrs.create("number", np.array(values, dtype="i4"))


CASES = [
    (external, "not as RockDDA writes it: model/block_area keeps its values in another file"),
    (
        lead("history", h5py.ExternalLink("other.h5", "/history")),
        "not as RockDDA writes it: history is a link into another",
    ),
    (lead("history", h5py.SoftLink("/frames")), "not as RockDDA writes it: history is a soft link"),
    (cycle, "not as RockDDA writes it: frames/again is another name of an object that is there already"),
    (virtual, "not as RockDDA writes it: history/time is a virtual dataset"),
    (put("history/time", np.zeros(60), chunks=True, scaleoffset=3), "history/time is packed with an unknown filter"),
    (large, "not as RockDDA writes it: history/time is larger than the file can hold"),
    (named_type, "not as RockDDA writes it: frames/type is neither a group nor a dataset"),
    (opaque, "not as RockDDA writes it: x is neither of numbers nor of texts"),
    (lambda file: file.__delitem__("frames/stress"), "damaged: frames/stress is missing"),
    (put("frames/stress", np.zeros((4, 1, 3))), "damaged: frames/stress has an unexpected shape"),
    (put("frames/step", np.zeros(4)), "damaged: frames/step cannot be read: it holds no integers"),
    (offset(10**9), "damaged: model/vertex_offset holds an impossible number"),
    (offset(-1), "damaged: model/vertex_offset holds an impossible number"),
    (not_finite, "damaged: model/vertices holds a number that is not finite"),
    (block_of_a_point, "damaged: model/fixed_points@block holds an impossible number"),
    (numbers(0), "damaged: model/measured_points@number holds an impossible number"),
    (numbers(1, 2), "damaged: model/measured_points@number has an unexpected shape"),
]


@pytest.mark.parametrize(("change", "words"), CASES, ids=[words.split(": ")[-1] for _, words in CASES])
def test_program_and_package_refuse_with_the_same_words(results, program, change, words):
    with h5py.File(results, "r+") as file:
        change(file)
    settle(results)
    with pytest.raises(rockdda.InputError) as caught:
        rockdda.open(results)
    assert words in str(caught.value)
    outcome = subprocess.run(
        [program, "info", results.name], cwd=results.parent, capture_output=True, text=True, timeout=60
    )
    assert outcome.returncode == 2
    assert words in outcome.stderr
    assert (results.parent / "victim.txt").read_bytes() == PRECIOUS


def test_a_heap_in_which_hdf5_reads_for_ever(results):
    """Sizes of 0 in the heap of texts."""
    data = bytearray(results.read_bytes())
    place = data.find(b"GCOL")
    while place > 0:
        data[place + 16 : place + 4096] = bytes(4080)
        data[place + 16] = 7
        place = data.find(b"GCOL", place + 4)
    results.write_bytes(data)
    settle(results)
    with pytest.raises(rockdda.InputError, match="has a damaged heap of texts"):
        rockdda.open(results)


def test_numbers_of_frames_are_checked_when_they_are_read(results):
    with h5py.File(results, "r+") as file:
        file["frames/stress"][1, 0, 0] = np.inf
        file["frames/contact_blocks"][-1] = 10**6
        file["frames/contact_state"][0] = 7
    settle(results)
    with rockdda.open(results) as opened:
        assert opened.frames[0].stress.shape[1] == 3
        with pytest.raises(rockdda.InputError, match="damaged: frames/stress holds a number that is not finite"):
            _ = opened.frames[1].stress
        with pytest.raises(rockdda.InputError, match="damaged: frames/contact_blocks holds an impossible number"):
            _ = opened.frames[-1].contacts
        with pytest.raises(rockdda.InputError, match="damaged: frames/contact_state holds an impossible number"):
            _ = opened["frames/contact_state"]


def test_a_title_of_no_encoding_can_be_written(results):
    with h5py.File(results, "r+") as file:
        file.attrs["title"] = b"Stra\xdfe 5"
    with rockdda.open(results) as opened:
        assert opened.title.encode().startswith(b"Stra")


def test_damage_of_all_kinds(flat_arch, monkeypatch):
    """A slice of tests/fuzz/damaged_results.py, each case within 2 GB and 10 s."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "postprocess"))
    outcomes, wrong = damaged_results.run(flat_arch, 1, 40, 3, 2)
    assert wrong == []
    assert outcomes["refused"] >= 10
