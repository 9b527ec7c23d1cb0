# SPDX-License-Identifier: MIT
"""Reading results files."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import h5py
import numpy as np
import pytest
import rockdda
from places import INPUTS
from synthetic import write_wall


def test_arrays_are_those_of_the_file(flat_arch):
    with rockdda.open(flat_arch) as results, h5py.File(flat_arch) as file:
        assert results.keys()
        for path in results.keys():  # noqa: SIM118
            expected = file[path][()]
            if isinstance(expected, bytes):
                assert results[path] == expected.decode()
            elif expected.dtype.kind == "S":
                assert list(results[path]) == [text.decode() for text in expected]
            else:
                np.testing.assert_array_equal(results[path], expected)
                assert results[path].dtype == expected.dtype
        assert "frames/vertices" in results
        assert "frames/nothing" not in results
        with pytest.raises(KeyError, match="frames/nothing"):
            results["frames/nothing"]


def test_sizes_and_attributes(flat_arch):
    results = rockdda.open(flat_arch)
    assert (results.n_steps, results.n_frames) == (60, 4)
    assert len(results.frames) == 4
    assert results.n_blocks == len(results.block_area) == len(results.vertex_offset) - 1
    assert results.n_vertices == len(results.vertices) == results.vertex_offset[-1]
    assert results.complete
    assert results.exit_reason == "finished"
    np.testing.assert_array_equal(results.steps, [0, 20, 40, 60])
    assert results.frame_at(results.times[2] * 1.01).index == 2
    assert results.title in repr(results.attributes)


def test_constants_cannot_be_changed_by_mistake(flat_arch):
    results = rockdda.open(flat_arch)
    with pytest.raises(ValueError, match="read-only"):
        results.vertices[0, 0] = 1.0


def test_polygons_have_the_area_of_their_blocks(flat_arch):
    results = rockdda.open(flat_arch)
    polygons = results.polygons(0)
    assert len(polygons) == results.n_blocks
    # the shoelace formula around the first vertex is good to rounding
    for polygon, area in zip(polygons, results.block_area, strict=True):
        x, y = (polygon - polygon[0]).T
        assert np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2 == pytest.approx(area, rel=1e-12)


def test_frames_count_like_a_list(flat_arch):
    frames = rockdda.open(flat_arch).frames
    assert frames[-1].index == 3
    assert [frame.step for frame in frames[1:3]] == [20, 40]
    assert [frame.step for frame in frames] == [0, 20, 40, 60]
    with pytest.raises(IndexError, match="4 frames"):
        frames[4]


def test_fields(flat_arch):
    results = rockdda.open(flat_arch)
    frame = results.frames[-1]
    for name in rockdda.FIELDS:
        values = frame.field(name)
        assert values.shape == (results.n_blocks,), name
        assert np.all(np.isfinite(values)), name
    np.testing.assert_array_equal(frame.field("displacement"), results.field("displacement", -1))
    # invariants of the stress tensor
    smallest, largest = frame.field("stress_min"), frame.field("stress_max")
    sx, sy, txy = frame.stress.T
    scale = np.abs(frame.stress).max()
    np.testing.assert_allclose(smallest + largest, sx + sy, atol=1e-14 * scale)
    np.testing.assert_allclose(smallest * largest, sx * sy - txy**2, atol=1e-14 * scale**2)
    # the direction of the largest principal stress: rotating the tensor there leaves no shear
    angle = frame.principal_stress()[1]
    shear = (sy - sx) / 2 * np.sin(2 * angle) + txy * np.cos(2 * angle)
    np.testing.assert_allclose(shear, 0, atol=1e-14 * scale)
    with pytest.raises(ValueError, match="there is no field 'colour'; the fields are: displacement"):
        frame.field("colour")


def test_contacts_balance_in_the_file(flat_arch):
    results = rockdda.open(flat_arch)
    contacts = results.frames[-1].contacts
    assert len(contacts) == len(contacts.point) == len(contacts.force) == len(contacts.blocks) > 0
    counts = np.bincount(contacts.state, minlength=3)
    np.testing.assert_array_equal(counts, results["history/contacts"][-1])
    assert not contacts.force[contacts.state == 0].any()


def test_history_is_a_table(flat_arch):
    results = rockdda.open(flat_arch)
    table = results.history()
    assert list(table.index) == list(range(1, 61))
    np.testing.assert_array_equal(table["time"], results["history/time"])
    np.testing.assert_array_equal(table["sliding"], results["history/contacts"][:, 1])
    for i, name in enumerate(results.energy_names):
        np.testing.assert_array_equal(table[f"energy_{name}"], results["history/energy"][:, i])
    np.testing.assert_array_equal(table["measured_displacement_1_y"], results["history/measured_displacement"][:, 0, 1])
    np.testing.assert_array_equal(table["fixed_force_2_x"], results["history/fixed_force"][:, 1, 0])
    assert table.shape[1] == 12 + len(results.energy_names) + 6 * len(results.measured_points) + 2 * len(
        results.fixed_points
    )


def test_a_missing_xarray_is_named_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match=r"-m pip install xarray"):
        rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2)).to_xarray()


def test_xarray(flat_arch):
    pytest.importorskip("xarray")
    results = rockdda.open(flat_arch)
    data = results.to_xarray()
    assert data.sizes["frame"] == 4
    np.testing.assert_array_equal(data["stress"].sel(stress_component="y")[-1], results.frames[-1].stress[:, 1])
    np.testing.assert_array_equal(data["energy"].sel(energy_column="friction"), results.history()["energy_friction"])


def test_closed_results_say_so(flat_arch):
    with rockdda.open(flat_arch) as results:
        pass
    with pytest.raises(ValueError, match="were closed"):
        results["frames/time"]


def write_empty(path):
    path.touch()
    old = time.time() - 3600  # a new one is waited for
    os.utime(path, (old, old))


def write_foreign(path):
    with h5py.File(path, "w") as file:
        file["x"] = 1


def write_other_format(path):
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "climate"


def write_newer(path):
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "rockdda"
        file.attrs["format_version"] = 99


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "is a folder"),
        (write_empty, "no HDF5 file but empty"),
        (lambda path: path.write_text("0.01\n4 0\n"), "no HDF5 file"),
        (write_foreign, "no attribute 'format'"),
        (write_other_format, "its format is 'climate'"),
        (write_newer, "format version 99"),
    ],
)
def test_foreign_files_are_refused_with_the_reason(tmp_path, make, reason):
    path = tmp_path / "some.h5"
    make(path)
    with pytest.raises(rockdda.InputError, match=reason) as caught:
        rockdda.open(path)
    assert caught.value.file == str(path)
    assert caught.value.line is None
    assert str(caught.value).startswith(f"{path}: error: ")


def test_damaged_files_are_refused_with_the_reason(flat_arch, tmp_path):
    short = tmp_path / "short.h5"
    short.write_bytes(flat_arch.read_bytes()[: flat_arch.stat().st_size // 2])
    old = time.time() - 3600
    os.utime(short, (old, old))
    with pytest.raises(rockdda.InputError, match=r"damaged: .*truncated"):
        rockdda.open(short)
    lacking = tmp_path / "lacking.h5"
    shutil.copy(flat_arch, lacking)
    with h5py.File(lacking, "a") as file:
        del file["frames/stress"]
    os.utime(lacking, (old, old))
    with pytest.raises(rockdda.InputError, match="damaged: frames/stress is missing"):
        rockdda.open(lacking)


def test_tables_of_unequal_length_are_cut_to_whole_rows(flat_arch, tmp_path):
    """As a kill in the midst of a flush leaves them."""
    killed = tmp_path / "killed.h5"
    shutil.copy(flat_arch, killed)
    with h5py.File(killed, "a") as file:
        file["history/energy"].resize(57, axis=0)
        file["frames/contact_force"].resize(file["frames/contact_offset"][3] - 0, axis=0)
        file.attrs["complete"] = 0
        file.attrs["exit_reason"] = "running"
    results = rockdda.open(killed)
    assert (results.n_steps, results.n_frames) == (57, 3)
    with h5py.File(killed, "a") as file:
        file["history/energy"].resize(39, axis=0)
    assert results.refresh()
    assert (results.n_steps, results.n_frames) == (39, 2)  # frame 2 is step 40
    with h5py.File(killed, "a") as file:
        file["history/energy"].resize(57, axis=0)
    assert results.refresh()
    assert len(results["history/step"]) == len(results.history()) == 57
    assert len(results["frames/vertices"]) == 3
    assert len(results["frames/contact_offset"]) == 4
    assert len(results["frames/contact_point"]) == len(results["frames/contact_force"])
    assert not results.complete


def test_a_file_that_a_run_has_just_made_is_waited_for(flat_arch, tmp_path, monkeypatch):
    path = tmp_path / "new.h5"
    path.touch()
    shutil.copyfile(flat_arch, tmp_path / "whole.h5")
    filled = threading.Timer(0.2, lambda: (tmp_path / "whole.h5").replace(path))
    monkeypatch.setattr("rockdda.storage.file.PATIENCE", 60.0)  # a busy machine may start the thread late
    filled.start()
    assert rockdda.open(path).n_steps == 60
    filled.join()


def start_run(program, folder, model, *options):
    """A run that does not end by itself, when its first rows are there."""
    path = folder / "running.h5"
    command = [
        program,
        "run",
        INPUTS / model,
        "-o",
        path,
        "--t-end",
        "1e9",
        "--steps",
        "100000000",
        "--quiet",
        *options,
    ]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not path.with_suffix(".ckpt.h5").exists() and time.monotonic() < deadline:
        assert process.poll() is None
        time.sleep(0.01)
    return process, path


def test_what_is_read_while_the_file_grows_is_what_stays(program, tmp_path):
    """Everything of several looks, against the file in the end; beside a handle of h5py that is kept open, which
    HDF5 serves with the end and the index of the file as they were."""
    process, path = start_run(program, tmp_path, "free_fall", "--save-every", "1", "--checkpoint-every", "0.1")
    looks = []
    try:
        results = rockdda.open(path)
        kept = h5py.File(path, "r", locking=False)
        assert len(kept["history/step"]) >= 0
        deadline = time.monotonic() + 120
        # until an index has been split, with 64 pieces of 32 rows, more than once (quick machines: in few looks)
        while (results.n_frames < 4500 or len(looks) < 5) and time.monotonic() < deadline:
            time.sleep(0.1)
            if results.refresh():
                tables = {
                    name: results[name] for name in ("frames/velocity", "frames/contact_offset", "history/energy")
                }
                looks.append((results.n_steps, results.n_frames, tables, results.frames[-1].vertices))
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=120)
        kept.close()
        assert results.refresh()
        assert results.exit_reason == "signal SIGTERM"
        assert len(looks) >= 5
        whole = {name: results[name] for name in looks[0][2]}
        for n_steps, n_frames, tables, vertices in looks:
            lengths = {"frames/velocity": n_frames, "frames/contact_offset": n_frames + 1, "history/energy": n_steps}
            for name, length in lengths.items():
                assert len(tables[name]) == length
                np.testing.assert_array_equal(tables[name], whole[name][:length], err_msg=name)
            np.testing.assert_array_equal(vertices, results.frames[n_frames - 1].vertices)
    finally:
        process.kill()
        process.wait()


def test_results_that_were_complete_and_went_on(program, tmp_path):
    path = tmp_path / "x.h5"
    command = [program, "run", INPUTS / "free_fall", "-o", path, "--steps", "20", "--save-every", "1", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    results = rockdda.open(path)
    assert results.complete
    energy = results["history/energy"]
    resume = [program, "resume", tmp_path / "x.ckpt.h5", "--steps", "3000", "--quiet"]
    subprocess.run(resume, check=True, capture_output=True)
    np.testing.assert_array_equal(results["history/energy"], energy)  # what was there when it was opened
    assert results.refresh()
    assert (results.n_steps, len(results["history/energy"])) == (3020, 3020)
    # another run in its place
    subprocess.run([*command[:2], INPUTS / "stack", *command[3:], "--force"], check=True, capture_output=True)
    blocks = results.n_blocks
    assert results.refresh()
    assert blocks != results.n_blocks == len(results.block_area)


def test_tables_are_read_in_pieces_while_they_may_grow(flat_arch, tmp_path, monkeypatch):
    path = tmp_path / "x.h5"
    shutil.copy(flat_arch, path)
    with h5py.File(path, "a") as file:
        file.attrs.update(complete=0, exit_reason="running")
        vertices, energy = file["frames/vertices"][()], file["history/energy"][()]
    results = rockdda.open(path)
    monkeypatch.setattr("rockdda.storage.file.PIECE", 1)
    np.testing.assert_array_equal(results["frames/vertices"], vertices)
    np.testing.assert_array_equal(results["history/energy"], energy)
    np.testing.assert_array_equal(results.rows("history/energy", 3, 58), energy[3:58])
    np.testing.assert_array_equal(results.block_rows("rotation", 2), results["frames/rotation"][:, 2])
    # rows that are removed during reading
    with h5py.File(path, "a") as file:
        file["history/energy"].resize(50, axis=0)
    with pytest.raises(rockdda.InputError, match=r"history/energy has lost rows.*refresh"):
        _ = results["history/energy"]


def test_a_file_that_never_rests_is_reported(flat_arch, tmp_path, monkeypatch):
    path = tmp_path / "x.h5"
    shutil.copy(flat_arch, path)
    with h5py.File(path, "a") as file:
        file.attrs.update(complete=0, exit_reason="running")
    results = rockdda.open(path)
    numbers = iter(range(10**9))
    monkeypatch.setattr("rockdda.storage.file._state_of", lambda path: (0, 0, next(numbers), 0))
    monkeypatch.setattr("rockdda.storage.file.PATIENCE", 0.1)
    with pytest.raises(rockdda.InputError, match="faster than it can be read"):
        _ = results["history/energy"]


def test_a_run_that_is_resumed_after_its_end(program, tmp_path):
    """Its last frame goes: a view that still shows it says so, and does not take another frame for it."""
    run = [
        program,
        "run",
        INPUTS / "free_fall",
        "-o",
        tmp_path / "x.h5",
        "--steps",
        "7",
        "--save-every",
        "5",
        "--quiet",
    ]
    subprocess.run(run, check=True, capture_output=True)
    results = rockdda.open(tmp_path / "x.h5")
    assert results.steps.tolist() == [0, 5, 7]
    first = results.frames[0].polygons()[0]
    resume = [program, "resume", tmp_path / "x.ckpt.h5", "--quiet", "--steps"]
    # 9 is the last frame of that, then 10
    for steps, frames in (("2", [0, 5, 9]), ("1", [0, 5, 10])):
        subprocess.run([*resume, steps], check=True, capture_output=True)
        for read in (
            lambda: results.steps,
            lambda: results["frames/vertices"],
            lambda: results["frames/contact_force"],
            lambda: results.frames[-1].polygons(),
            lambda: results.block_rows("stress", 0),
        ):
            with pytest.raises(rockdda.InputError, match=r"its last frame removed: refresh\(\) reads"):
                read()
        # what is the same is shown
        assert np.array_equal(results.frames[0].polygons()[0], first)
        assert len(results["history/step"]) < frames[-1]
        assert results.refresh()
        assert results.steps.tolist() == frames
    # a longer run of the same plan keeps its frames
    subprocess.run([*resume, "5"], check=True, capture_output=True)
    assert results.steps.tolist() == [0, 5, 10]
    results.close()


def test_reading_during_the_run(program, tmp_path):
    path = tmp_path / "running.h5"
    command = [program, "run", INPUTS / "jointed_slope", "-o", path, "--t-end", "1000"]
    command += ["--steps", "1000000", "--save-every", "5", "--quiet"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 60
        while not path.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        results = rockdda.open(path)
        sizes = {results.n_frames}
        while len(sizes) < 3 and time.monotonic() < deadline:
            if results.refresh():
                sizes.add(results.n_frames)
                assert len(results["frames/stress"]) == results.n_frames
                assert len(results.history()) == results.n_steps
                assert results.frames[-1].step <= results["history/step"][-1]
                np.testing.assert_array_equal(results.steps, 5 * np.arange(results.n_frames))
            time.sleep(0.05)
        assert len(sizes) >= 3
        assert results.exit_reason == "running"
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=60)
        assert results.refresh()
        assert results.exit_reason == "signal SIGTERM"
        assert results.frames[-1].step == results.n_steps
    finally:
        process.kill()
        process.wait()
