# SPDX-License-Identifier: MIT
"""The viewer in a browser: measuring a distance, two results side by side, keys."""

import json
import threading
from contextlib import contextmanager

import numpy as np
import pytest
import rockdda
from browser import Page, find_browser
from rockdda.film.server import serve
from rockdda.film.viewer import PairViewer, Viewer
from synthetic import add_bolts, write_wall

needs_browser = pytest.mark.skipif(find_browser() is None, reason="there is no browser")


COLOURS = """(() => {
  draw();
  const at = places(present()), found = [];
  for (let i = 0; i < setup.blocks; i += 97) {
    let x = 0, y = 0;
    for (let v = offset[i]; v < offset[i + 1]; v++) { x += at[2 * v] / 4; y += at[2 * v + 1] / 4; }
    found.push(Array.from(pen.getImageData(x, y, 1, 1).data).join());
  }
  return found;
})()"""
BY_PATHS = """(() => {
  const hex = (n) => (n & 255).toString(16).padStart(2, "0");
  paintPixels = (seen, at, width, height, colourOf) => {
    for (const i of seen) {
      const word = colourOf(i);
      pen.fillStyle = `#${hex(word)}${hex(word >>> 8)}${hex(word >>> 16)}`;
      paint([i], at, () => pen.fill());
    }
  };
})()"""


@contextmanager
def opened(viewer, tmp_path, ready=True):
    """The page of a viewer in a browser."""
    pytest.importorskip("websocket")
    server = serve(viewer)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()
    page = Page(tmp_path / "browser")
    address = f"http://127.0.0.1:{server.server_address[1]}/?token={viewer.token}"
    try:
        if ready:
            page.open(address)
        else:
            page.call("Page.navigate", url=address)
        yield page
        assert page.errors == []
    finally:
        page.close()
        server.shutdown()
        server.server_close()


@needs_browser
def test_a_distance_follows_the_vertices(tmp_path):
    path = write_wall(tmp_path / "wall.h5", 5, 4, frames=3)
    add_bolts(path)
    results = rockdda.open(path)
    with opened(Viewer(results), tmp_path) as page:
        page.key("m")
        for corner in ((0.0, 0.0), (3.0, 4.0)):
            vertex = int(np.argmin(np.hypot(*(results.vertices - corner).T)))
            place = page.evaluate(
                f"(() => {{ const at = places(present()), box = canvas.getBoundingClientRect();"
                f"return [box.left + at[{2 * vertex}] + 2, box.top + at[{2 * vertex + 1}] - 2]; }})()"
            )
            page.click(*place)
        # frame 2: x moves by y/50 relative to the base, so that the ends are 3.08 and 4 apart
        distance, change = map(float, page.data("distance").split())
        assert distance == pytest.approx(np.hypot(3.08, 4), rel=1e-6)
        assert change == pytest.approx(np.hypot(3.08, 4) - 5, rel=1e-4)
        assert page.data("picked") in (None, "")  # a click measures, it does not pick
        page.key("Home")
        page.wait("document.body.dataset.frame === '0'")
        assert float(page.data("distance").split()[1]) == pytest.approx(0, abs=1e-6)
        page.key("Escape")
        assert page.evaluate("ends.length") == 0
        page.key("?")
        assert page.evaluate("!document.getElementById('keys').hidden")
        page.key("Escape")
        x, y = page.evaluate("(() => { const at = places([1.1, 0.5]); return [at[0], at[1]]; })()")
        assert "bolt 1" in page.evaluate(f"boltAt({x}, {y})")
        assert page.evaluate(f"boltAt({x}, {y - 100})") == ""


def test_two_results_have_one_range_of_colours(tmp_path):
    first, second = (rockdda.open(write_wall(tmp_path / f"{n}.h5", 3, 2, frames=n)) for n in (3, 5))
    pair = PairViewer(first, second, "stress_min")
    of_pair = json.loads(pair.answer("/a/limits/stress_min")[1])
    assert of_pair == json.loads(pair.answer("/b/limits/stress_min")[1])
    alone = [json.loads(Viewer(results).answer("/limits/stress_min")[1]) for results in (first, second)]
    assert of_pair[0] == min(low for low, *_ in alone) < max(low for low, *_ in alone)
    assert json.loads(pair.answer("/b/state")[1])["times"] == second.times.tolist()
    with pytest.raises(KeyError):
        pair.answer("/c/state")


@needs_browser
def test_two_results_show_the_same_moment(tmp_path):
    first, second = (rockdda.open(write_wall(tmp_path / f"{n}.h5", 3, 2, frames=n)) for n in (3, 5))
    with opened(PairViewer(first, second, "displacement"), tmp_path, ready=False) as page:
        sides = [f"document.querySelectorAll('iframe')[{k}].contentDocument?.body?.dataset" for k in (0, 1)]
        page.wait(f"document.querySelectorAll('iframe').length === 2 && {sides[0]}.ready && {sides[1]}.ready")
        assert [page.evaluate(f"{side}.frame") for side in sides] == ["2", "4"]
        width = page.evaluate("innerWidth")
        page.click(0.25 * width, 300)  # the left one leads
        page.key("Home")
        page.wait(f"{sides[1]}.frame === '0'")
        page.key("ArrowRight")
        page.wait(f"{sides[0]}.frame === '1' && {sides[1]}.frame === '1'")
        scale = "document.querySelectorAll('iframe')[{}].contentWindow.eval('view.scale')"
        page.evaluate("document.querySelectorAll('iframe')[0].contentWindow.eval('zoom(2, 100, 100)')")
        page.wait(f"{scale.format(0)} === {scale.format(1)}")
        page.click(0.75 * width, 300)  # then the right one
        page.key("End")
        page.wait(f"{sides[0]}.frame === '2' && {sides[1]}.frame === '4'")


@needs_browser
def test_many_blocks_are_filled_by_pixels_as_by_paths(tmp_path):
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 90, 60, frames=2))
    with opened(Viewer(results, "stress_min"), tmp_path) as page:
        assert page.data("pixels") == "yes"
        # the middle of each block has the colour of its value, whichever way it is painted
        by_pixels = page.evaluate(COLOURS)
        assert len(set(by_pixels)) > 5
        page.evaluate(BY_PATHS)
        assert page.evaluate(COLOURS) == by_pixels
