# SPDX-License-Identifier: MIT
"""The local viewer: its answers, and the page in a browser while a run goes on."""

import json
import threading
import urllib.error
import urllib.request

import h5py
import numpy as np
import pytest
import rockdda
from browser import Page, find_browser
from rockdda.view import Viewer, block_history, serve
from synthetic import write_wall


class Served:
    """A viewer that answers in a thread."""

    def __init__(self, path):
        self.viewer = Viewer(rockdda.open(path))
        self.server = serve(self.viewer)
        self.address = f"http://127.0.0.1:{self.server.server_address[1]}/"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()

    def get(self, path="", **headers):
        request = urllib.request.Request(self.address + path, headers=headers)
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
    assert json.loads(served.get("limits/stress_x")) == [-13.5, 0.0]
    assert json.loads(served.get("history/displacement_y/7")) == pytest.approx([0, -0.02, -0.04, -0.06])
    state = json.loads(served.get("state"))
    assert state["times"] == results.times.tolist()
    assert state["state"] == "finished"
    assert not state["running"]


@pytest.mark.parametrize(
    "path", ["nothing", "field/heat/0", "field/stress/99", "history/stress/20", "field/../x", "limits/"]
)
def test_what_is_not_there_is_not_found(served, path):
    with pytest.raises(urllib.error.HTTPError) as caught:
        served.get(path)
    assert caught.value.code == 404


def test_history_of_a_block_is_that_of_all_frames(flat_arch):
    results = rockdda.open(flat_arch)
    for field in rockdda.FIELDS:
        expected = [frame.field(field)[4] for frame in results.frames]
        np.testing.assert_array_equal(block_history(results, field, 4), expected)


def test_only_this_machine_is_answered(served):
    assert served.server.server_address[0] == "127.0.0.1"
    with pytest.raises(urllib.error.HTTPError) as caught:
        served.get("state", Host="example.org")
    assert caught.value.code == 403


def test_a_port_in_use_is_said(served):
    with pytest.raises(rockdda.InputError, match="cannot be used"):
        serve(served.viewer, served.server.server_address[1])


def test_page_follows_a_run_in_a_browser(tmp_path):
    if find_browser() is None:
        pytest.skip("no Chromium")
    pytest.importorskip("websocket")
    path = write_wall(tmp_path / "wall.h5", 5, 4, frames=4, complete=False)
    served, page = Served(path), Page(tmp_path / "browser")
    try:
        page.open(served.address + "#field=displacement_x")
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
        assert page.evaluate("$('name').textContent") == "block 7"
    finally:
        page.close()
        served.close()
