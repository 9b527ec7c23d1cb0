# SPDX-License-Identifier: MIT
"""Films: frames, sizes, and what a browser makes of the page."""

import base64
import json
import re
import shutil
import subprocess
import zlib

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
import rockdda
from browser import Page, find_browser
from matplotlib.text import Text
from PIL import Image
from synthetic import write_wall


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    """5 × 4 squares, 7 frames."""
    return rockdda.open(write_wall(tmp_path_factory.mktemp("wall") / "wall.h5", 5, 4, frames=7))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    if find_browser() is None:
        pytest.skip("no Chromium")
    pytest.importorskip("websocket")
    page = Page(tmp_path_factory.mktemp("browser"))
    yield page
    page.close()


@pytest.fixture(autouse=True)
def no_error_in_the_page(request):
    """A film writes nothing into the console of the browser."""
    yield
    if "page" in request.fixturenames:
        assert request.getfixturevalue("page").errors == []


def setup_of(path):
    """The data in a page."""
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script id="setup" type="application/json">(.*?)</script>', text, re.S).group(1))


def numbers(packed, kind):
    return np.frombuffer(zlib.decompress(base64.b64decode(packed)), dtype=f"<{kind}")


def test_gif_has_a_picture_for_each_frame(wall, tmp_path):
    done = []
    path = wall.animate(tmp_path / "wall.gif", every=4, dpi=50, progress=lambda *numbers: done.append(numbers))
    assert done == [(1, 3), (2, 3), (3, 3)]  # frames 0, 4 and the last
    with Image.open(path) as film:
        assert film.n_frames == 3
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(2)
        last = np.asarray(film.convert("RGB")).astype(int)
    assert np.abs(last - first).max() > 50
    assert list(tmp_path.iterdir()) == [path]


def test_without_a_name_a_film_is_named_after_its_results(wall, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = wall.animate(every=6, dpi=30)
    assert (path.name, [file.name for file in tmp_path.iterdir()]) == (f"{wall.path.stem}.mp4", [path.name])


def test_a_film_says_how_much_displacements_are_enlarged(wall, tmp_path, monkeypatch):
    said, write = [], Text.set_text
    monkeypatch.setattr(Text, "set_text", lambda text, words: (said.append(words), write(text, words)))
    wall.animate(tmp_path / "a.gif", every=6, dpi=30)
    assert f"{wall.title}, t = {wall.times[-1]:.4f}" in said
    wall.animate(tmp_path / "b.gif", every=6, dpi=30, scale=100)
    assert f"{wall.title}, t = {wall.times[-1]:.4f}, displacements × 100" in said


def test_no_line_is_added_below_the_film(wall, tmp_path):
    reader = pytest.importorskip("imageio_ffmpeg")
    for dpi in (51, 120):  # the size in inches gives odd numbers of pixels
        frames = reader.read_frames(str(wall.animate(tmp_path / f"{dpi}.mp4", every=6, dpi=dpi)))
        width, height = next(frames)["size"]
        picture = np.frombuffer(next(frames), dtype=np.uint8).reshape(height, width, 3)
        frames.close()
        # white paper; the compression of the film may take some of 255
        assert min(picture[-1].min(), picture[0].min(), picture[:, -1].min()) > 230


def test_mp4_has_all_frames_and_even_sides(wall, tmp_path):
    path = wall.animate(tmp_path / "wall.mp4", dpi=51, fps=10)
    assert path.read_bytes()[4:8] == b"ftyp"
    probe = shutil.which("ffprobe")
    if probe is None:
        pytest.skip("no ffprobe")
    command = [probe, "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,width,height,pix_fmt"]
    told = json.loads(subprocess.run([*command, "-of", "json", path], capture_output=True, check=True).stdout)
    (stream,) = told["streams"]
    assert int(stream["nb_read_frames"]) == 7
    assert stream["width"] % 2 == stream["height"] % 2 == 0
    assert stream["pix_fmt"] == "yuv420p"


def test_page_holds_what_the_results_hold(wall, tmp_path):
    path = wall.animate(tmp_path / "wall.html", field="stress_x", fields=["displacement", "material"])
    data = setup_of(path)
    assert [entry["name"] for entry in data["fields"]] == ["stress_x", "displacement", "material"]
    np.testing.assert_allclose(data["times"], wall.times)
    np.testing.assert_array_equal(numbers(data["offset"], "i4"), wall.vertex_offset)
    moves = numbers(data["moves"]["data"], "i2").reshape(7, -1, 2) * data["moves"]["unit"]
    expected = wall["frames/vertices"] - wall.vertices
    # half a unit of the whole numbers, and single precision
    np.testing.assert_allclose(moves, expected, atol=0.51 * data["moves"]["unit"])
    stress = data["fields"][0]
    values = numbers(stress["data"], "u2").reshape(7, -1) / 65535 * (stress["high"] - stress["low"]) + stress["low"]
    span = stress["high"] - stress["low"]
    np.testing.assert_allclose(values, wall["frames/stress"][:, :, 0], atol=0.51 * span / 65535)
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)=["'](?!data:)""", text)  # nothing from elsewhere
    assert "http" not in text.replace("http-equiv", "")


def test_titles_cannot_break_the_page(wall, tmp_path):
    path = wall.animate(tmp_path / "wall.html", title="</script><b>x</b> & co", fields=["displacement"])
    text = path.read_text(encoding="utf-8")
    assert "<title>&lt;/script&gt;" in text
    assert text.count("</script>") == 2


def test_wrong_films_are_refused(wall, tmp_path):
    with pytest.raises(rockdda.InputError, match=r"a film ends in \.mp4, \.gif, \.html, not in '\.avi'"):
        wall.animate(tmp_path / "wall.avi")
    with pytest.raises(rockdda.InputError, match="no field 'heat'"):
        wall.animate(tmp_path / "wall.html", field="heat")
    with pytest.raises(rockdda.OutputError, match="cannot be written"):
        wall.animate(tmp_path / "nowhere" / "wall.html")


def test_page_plays_in_a_browser(wall, tmp_path, page):
    path = wall.animate(tmp_path / "wall.html", fields=["displacement", "stress_x", "material"])
    page.open(path.as_uri())
    assert (page.data("blocks"), page.data("frames"), page.data("frame")) == ("20", "7", "0")
    assert page.evaluate("$('clock').textContent").startswith("t = 0 · step 0 · frame 0 of 6")
    # scrubbing
    page.evaluate("$('slider').value = 4; $('slider').oninput()")
    page.wait("document.body.dataset.frame === '4'")
    assert "t = 0.4" in page.evaluate("$('clock').textContent")
    # keys
    page.key("ArrowRight")
    page.wait("document.body.dataset.frame === '5'")
    page.key("Home")
    page.wait("document.body.dataset.frame === '0'")
    # play, to the end
    page.evaluate("$('speed').value = '40'; $('play').click()")
    page.wait("document.body.dataset.frame === '6' && !playing")
    # choice of field
    page.evaluate("$('field').value = 'stress_x'; $('field').onchange()")
    page.wait("document.body.dataset.field === 'stress_x'")
    np.testing.assert_allclose(page.evaluate("Array.from(values)"), wall.field("stress_x", -1), rtol=1e-3)
    np.testing.assert_allclose(page.evaluate("limits"), [wall.field("stress_x", -1).min(), 0])


def test_blocks_are_where_they_belong_on_the_screen(wall, tmp_path, page):
    path = wall.animate(tmp_path / "wall.html", field="material", fields=["displacement"], outline=False)
    page.open(path.as_uri() + "#frame=6")
    page.evaluate("$('outline').click()")
    centres = page.evaluate(f"Array.from(places({wall.frames[-1].centroid.ravel().tolist()}))")
    left, top = page.evaluate("[canvas.getBoundingClientRect().left, canvas.getBoundingClientRect().top]")
    with Image.open(page.screenshot(tmp_path / "screen.png")) as image:
        picture = image.convert("RGB")
        seen = [picture.getpixel((round(left + x), round(top + y))) for x, y in np.reshape(centres, (-1, 2))]
    assert set(seen[0::2]) == {(0xB8, 0xC4, 0xCE)}  # materials 1 and 2 take turns
    assert set(seen[1::2]) == {(0xE6, 0x9F, 0x00)}


def test_the_cursor_shows_values_with_their_units(wall, tmp_path, page):
    path = wall.animate(tmp_path / "wall.html", field="displacement", units="m,s,N", fields=["displacement"])
    page.open(path.as_uri() + "#frame=6")
    x, y = wall.frames[6].centroid[13]
    page.evaluate(f"hover(places([{x}, {y}]))")
    value = rf"{page.evaluate('values[13]'):.2g}"
    text = rf"x \S+ m, y \S+ m · block 14: displacement \[m?m\] {value}\d*"
    assert re.fullmatch(text, page.evaluate("$('tip').textContent"))


def test_picking_a_block_shows_its_history(wall, tmp_path, page):
    path = wall.animate(tmp_path / "wall.html", field="displacement_y", fields=["displacement"])
    page.open(path.as_uri() + "#frame=3")
    x, y = page.evaluate(f"Array.from(places({wall.frames[3].centroid[13].tolist()}))")
    left, top = page.evaluate("[canvas.getBoundingClientRect().left, canvas.getBoundingClientRect().top]")
    page.click(left + x, top + y)
    page.wait("document.body.dataset.history === '7'")
    assert page.data("picked") == "14"
    assert page.evaluate("$('name').textContent") == "block 14"  # counted from 1
    rows = page.evaluate("Array.from($('values').rows, (r) => [r.cells[0].textContent, r.cells[1].textContent])")
    told = dict(rows)
    assert float(told["displacement in y [length]"]) == pytest.approx(-0.06, rel=1e-3)
    history = page.evaluate("source.block(13).then((h) => h.displacement_y)")
    np.testing.assert_allclose(history, -0.02 * np.arange(7), atol=1e-5)
    # zooming at a place keeps that place
    before = page.evaluate("Array.from(places([2.5, 2.5]))")
    page.evaluate("{ const [x, y] = places([2.5, 2.5]); zoom(3, x, y); }")
    np.testing.assert_allclose(page.evaluate("Array.from(places([2.5, 2.5]))"), before, atol=0.01)
    page.key("Escape")
    page.wait("$('picked').hidden")
