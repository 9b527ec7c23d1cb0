# SPDX-License-Identifier: MIT
"""The local viewer: its answers, and the page in a browser during a run."""

import json
import os
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

import h5py
import numpy as np
import pytest
import rockdda
from browser import Page, find_browser
from places import ROOT
from rockdda.film.page import colour_range, usual_range
from rockdda.film.server import serve, view
from rockdda.film.viewer import Viewer, _BlockInTime
from synthetic import write_wall


class Served:
    """A viewer that answers in a thread."""

    def __init__(self, path):
        self.viewer = Viewer(rockdda.open(path))
        self.server = serve(self.viewer)
        self.address = f"http://127.0.0.1:{self.server.server_address[1]}/"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()

    @property
    def page(self):
        """The address of the page, with the token."""
        return f"{self.address}?token={self.viewer.token}"

    def get(self, path="", token=None, **headers):
        query = "?" + urllib.parse.urlencode({"token": self.viewer.token if token is None else token})
        request = urllib.request.Request(self.address + path + query, headers=headers)
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.read()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def served(tmp_path):
    served = Served(write_wall(tmp_path / "wall.h5", 5, 4, frames=4))
    yield served
    served.close()


def grow(path, complete):
    """Append one frame, as a run does: everything moves by 1 in x."""
    with h5py.File(path, "a") as file:
        for name in list(file["frames"]):
            table = file[f"frames/{name}"]
            last = table[-3:] if name.startswith("contact_") and name != "contact_offset" else table[-1:]
            if name in ("step", "contact_offset"):
                last = last + (1 if name == "step" else 3)
            elif name == "time":
                last = last + 0.1
            elif name in ("vertices", "centroid"):
                last = last + np.array([1.0, 0.0])
            table.resize(table.shape[0] + len(last), axis=0)
            table[-len(last) :] = last
        for name in list(file["history"]):
            table = file[f"history/{name}"]
            table.resize(table.shape[0] + 1, axis=0)
            table[-1] = table[-2] + (1 if name == "step" else 0)
        file.attrs["complete"] = int(complete)
        file.attrs["exit_reason"] = "finished" if complete else "running"


def test_answers_are_the_arrays_of_the_results(served):
    results = served.viewer.results
    np.testing.assert_array_equal(
        np.frombuffer(served.get("displacement/2"), "<f4"),
        results.frames[2].vertex_displacement.astype(np.float32).ravel(),
    )
    np.testing.assert_array_equal(
        np.frombuffer(served.get("field/stress_x/3"), "<f4"), results.field("stress_x", 3).astype(np.float32)
    )
    assert json.loads(served.get("limits/stress_x"))[:2] == [-13.5, 0.0]
    history = json.loads(served.get("block/7"))
    assert history["displacement_y"] == pytest.approx([0, -0.02, -0.04, -0.06])
    assert set(history) == set(served.viewer.fields)
    state = json.loads(served.get("state"))
    assert state["times"] == results.times.tolist()
    assert state["state"] == "finished"
    assert not state["running"]


@pytest.mark.parametrize(
    "path", ["nothing", "field/heat/0", "field/stress/99", "block/20", "block/-1", "bolts/9", "field/../x", "limits/"]
)
def test_what_is_not_there_is_not_found(served, path):
    with pytest.raises(urllib.error.HTTPError) as caught:
        served.get(path)
    assert caught.value.code == 404


def test_history_of_a_block_is_that_of_all_frames(flat_arch):
    results = rockdda.open(flat_arch)
    for field in rockdda.FIELDS.keys() - {"block"}:
        expected = [frame.field(field)[4] for frame in results.frames]
        np.testing.assert_array_equal(_BlockInTime(results, 4).field(field), expected)


def test_only_this_machine_is_answered(served):
    assert served.server.server_address[0] == "127.0.0.1"
    with pytest.raises(urllib.error.HTTPError) as caught:
        served.get("state", Host="example.org")
    assert caught.value.code == 403


@pytest.mark.parametrize("token", ["", "x", "\u00fc"])
@pytest.mark.parametrize("path", ["", "state", "displacement/0", "block/1"])
def test_only_who_has_the_token_is_answered(served, path, token):
    with pytest.raises(urllib.error.HTTPError) as caught:
        served.get(path, token=token)
    assert caught.value.code == 403
    assert served.viewer.token.encode() not in caught.value.read()


def test_the_token_is_in_no_argument_of_the_browser(tmp_path, monkeypatch):
    told, opened = [], []

    def open_page(address):
        path = Path(urllib.parse.urlsplit(address).path)
        opened.append((address, path.read_text(), path.stat().st_mode & 0o077, path.parent.stat().st_mode & 0o077))

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", open_page)
    monkeypatch.setattr("http.server.ThreadingHTTPServer.serve_forever", stop)
    view(write_wall(tmp_path / "wall.h5", 3, 3, frames=2), ready=told.append)
    ((address, text, *open_to_others),) = opened
    token = told[0].partition("?token=")[2]
    assert len(token) >= 32
    assert token not in address
    assert told[0] in text
    assert open_to_others == [0, 0]
    assert not Path(urllib.parse.urlsplit(address).path).exists()


def test_one_splinter_does_not_take_the_colour_scale():
    areas = np.array([1.0] * 99 + [0.01])
    values = np.append(np.linspace(0, 1e-3, 99), 50.0)
    low, high = usual_range(values, areas)
    assert 0 < low < 3e-5  # a block has 1 % of the area: one or two go
    assert 9.7e-4 < high < 1e-3
    assert usual_range(np.stack([np.zeros(100), values]), areas) == (0.0, high)
    assert colour_range((0.0, 50.0), (low, high)) == (low, high)
    assert colour_range((0.0, 50.0), (1.0, 1.0)) == (0.0, 50.0)  # nothing else moves: the splinter is the picture


def test_a_port_in_use_is_reported(served):
    with pytest.raises(rockdda.InputError, match="cannot be used"):
        serve(served.viewer, served.server.server_address[1])


def test_page_follows_a_run_in_a_browser(tmp_path):
    if find_browser() is None:
        pytest.skip("no Chromium")
    pytest.importorskip("websocket")
    path = write_wall(tmp_path / "wall.h5", 5, 4, frames=4, complete=False)
    served, page = Served(path), Page(tmp_path / "browser")
    try:
        page.open(served.page + "#field=displacement_x")
        assert (page.data("frames"), page.data("frame")) == ("4", "3")
        assert page.evaluate("$('state').textContent") == "running, step 3"
        before = page.evaluate("Array.from(values)")
        grow(path, complete=False)
        page.wait(
            "document.body.dataset.frames === '5' && document.body.dataset.frame === '4'"
        )  # at the end: stays there
        np.testing.assert_allclose(page.evaluate("Array.from(values)"), np.array(before) + 1, rtol=1e-6)
        page.key("Home")
        page.wait("document.body.dataset.frame === '0'")
        grow(path, complete=True)
        page.wait("document.body.dataset.frames === '6' && $('state').textContent === 'finished'")
        assert page.data("frame") == "0"  # elsewhere: is left there
        x, y = page.evaluate(f"Array.from(places({rockdda.open(path).frames[0].centroid[7].tolist()}))")
        left, top = page.evaluate("[canvas.getBoundingClientRect().left, canvas.getBoundingClientRect().top]")
        page.click(left + x, top + y)
        page.wait("document.body.dataset.history === '6'")
        assert page.evaluate("$('name').textContent") == "block 8"  # counted from 1, as in the input files
        assert page.errors == []
    finally:
        page.close()
        served.close()


@pytest.fixture
def browser(tmp_path):
    if find_browser() is None:
        pytest.skip("no Chromium")
    pytest.importorskip("websocket")
    page = Page(tmp_path / "browser")
    yield page
    page.close()


def test_a_picked_block_does_not_slow_the_film(tmp_path, browser):
    """Each frame took a request for each field, one after the other, and the whole history again."""
    served = Served(write_wall(tmp_path / "wall.h5", 20, 20, frames=60))
    answer, paths = served.viewer.answer, []

    def late(path):  # as over a slow connection: a request takes 20 ms
        paths.append(urllib.parse.urlsplit(path).path)
        time.sleep(0.02)
        return answer(path)

    served.viewer.answer = late
    try:
        browser.open(served.page + "#frame=0&pick=7")
        first = len(paths)
        begin = time.monotonic()
        browser.key(" ")
        browser.wait("document.body.dataset.frame === '59'")
        rate = 59 / (time.monotonic() - begin)
        fetched = [path for path in paths[first:] if path != "/state"]
        assert len(fetched) == len(set(fetched)) <= 2 * 59  # displacements and values, once each
        assert rate > 8, rate  # of 20; a request after the other gave 2
        assert browser.errors == []
    finally:
        served.close()


@pytest.mark.skipif("ROCKDDA_TEST_VIEWER" not in os.environ, reason="set ROCKDDA_TEST_VIEWER=1: a minute or two")
def test_many_blocks_are_shown_quickly(browser):
    """20,000 blocks, 200 frames: neither page nor server takes more processor time than 30 frames a second leave."""
    done = subprocess.run(
        [sys.executable, ROOT / "benchmarks/viewer.py", "--least", "30"], capture_output=True, text=True
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_limits_can_be_typed_and_labels_are_whole(tmp_path, browser):
    path = write_wall(tmp_path / "wall.h5", 10, 10, frames=4)
    with h5py.File(path, "a") as file:  # one block falls out of sight, the others move a little
        file["frames/centroid"][1:, :, 1] -= np.linspace(0, 0.1, 100)
        file["frames/centroid"][1:, 5, 1] -= 1e6
    served = Served(path)
    try:
        browser.open(served.page + "#field=displacement_y")
        low, high = map(float, browser.data("limits").split())
        assert -1 < low < high < 1
        browser.evaluate("$('range').value = 'all'; $('range').onchange(); 0")
        browser.wait("Number(document.body.dataset.limits.split(' ')[0]) < -9e5")
        browser.evaluate("$('range').value = 'typed'; $('low').value = '-0.25'; $('high').value = '0.5'; 0")
        browser.evaluate("$('range').onchange()")
        browser.wait("document.body.dataset.limits === '-0.25 0.5'")
        assert not browser.evaluate("$('low').hidden")
        x, right, width = map(float, browser.data("scale").split())
        assert 0 < x < right <= width
        assert browser.errors == []
    finally:
        served.close()
