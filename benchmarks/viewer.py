# SPDX-License-Identifier: MIT
"""Frames a second of the viewer in headless Chromium, of a wall of many blocks that shears: by the server, and a film.

    python benchmarks/viewer.py [--blocks 20000] [--frames 200] [--size 1200x800]

Shows every frame once, the next as soon as the last is on the canvas, and prints for each way: the wall clock of all
frames, frames a second of it, those of the quickest 20 frames in a row (nearer to what a machine without other work
gives), and the processor time of a frame in the page's process, in all of the browser, and in the server. `--screen`
waits for the browser's screen after each frame as `play` does, which allows 60 a second at most.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "postprocess"), str(ROOT / "postprocess/tests")]

TICKS = os.sysconf("SC_CLK_TCK")
RUN = 20  # frames
SHOW_ALL = """(async (screen) => {
  await show(0); playing = true;
  const begin = performance.now(), drawnBefore = drawn, at = [begin];
  for (let k = 1; k < setup.times.length; k++) {
    await show(k);
    if (screen) await new Promise(requestAnimationFrame);
    at.push(performance.now());
  }
  playing = false;
  return [at.map((time) => (time - begin) / 1000), drawn - drawnBefore];
})(%s)"""


def processor_seconds(process: int) -> float:
    """Of a process so far."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:  # it has ended
        return 0.0
    return (int(fields[11]) + int(fields[12])) / TICKS


def descendants(process: int) -> dict[int, str]:
    """A process and those that it has started, with their arguments."""
    parents, words = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stat = (folder / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            words[int(folder.name)] = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        parents[int(folder.name)] = int(stat[1])
    found = {process}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return {one: words.get(one, "") for one in found}


def serve_results(path: Path, address: multiprocessing.Queue) -> None:
    """`rockdda-post view` in a process of its own."""
    from rockdda.film.server import serve
    from rockdda.film.viewer import Viewer
    from rockdda.results import open as open_results

    viewer = Viewer(open_results(path))
    server = serve(viewer)
    address.put(f"http://127.0.0.1:{server.server_address[1]}/?token={viewer.token}")
    server.serve_forever()


def measure(page: object, address: str, screen: bool, server: int | None) -> dict[str, float]:
    """Show all frames of an address; seconds, frames, and processor seconds by process."""
    page.open(address)
    everyone = descendants(page.process.pid)
    page.evaluate("show(0).then(() => show(1))")  # what is compiled and loaded once

    def used() -> dict[str, float]:
        by_process = {one: processor_seconds(one) for one in everyone}
        return {
            "page": sum(seconds for one, seconds in by_process.items() if "--type=renderer" in everyone[one]),
            "browser": sum(by_process.values()),
            "server": processor_seconds(server) if server else 0.0,
        }

    before = used()
    times, drawn = page.evaluate(SHOW_ALL % str(screen).lower())
    after = used()
    n = max(1, min(RUN, len(times) - 1))
    quickest = min(end - begin for begin, end in zip(times, times[n:], strict=False))
    return {
        "seconds": times[-1],
        "frames": drawn,
        "quick": n / quickest,
        **{name: (after[name] - before[name]) / drawn for name in before},
    }


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blocks", type=int, default=20_000)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--size", default="1200x800", help="of the window, in pixels")
    parser.add_argument("--field", default="displacement")
    parser.add_argument("--screen", action="store_true", help="wait for the screen after each frame")
    parser.add_argument("--no-film", action="store_true", help="only by the server")
    parser.add_argument("--least", type=float, help="exit code 1 where a process takes more than 1/LEAST s a frame")
    wish = parser.parse_args(arguments)
    from browser import Page
    from rockdda.results import open as open_results
    from synthetic import write_wall

    width, height = (int(word) for word in wish.size.split("x"))
    rows = max(1, round((wish.blocks / 2) ** 0.5))
    slowest = float("inf")
    with tempfile.TemporaryDirectory(prefix="rockdda-viewer-") as name:
        folder = Path(name)
        path = write_wall(folder / "wall.h5", wish.blocks // rows, rows, frames=wish.frames)
        queue: multiprocessing.Queue = multiprocessing.Queue()
        server = multiprocessing.Process(target=serve_results, args=(path, queue), daemon=True)
        server.start()
        ways = {"view": (f"{queue.get(timeout=60)}#frame=0&field={wish.field}", server.pid)}
        if not wish.no_film:
            begun = time.process_time()
            film = open_results(path).animate(folder / "wall.html", field=wish.field)
            used = time.process_time() - begun
            print(f"film: {film.stat().st_size / 1e6:.1f} MB, written in {used:.0f} s of processor time")
            ways["film"] = (f"file://{film}#frame=0", None)
        page = Page(folder / "browser")
        try:
            page.call(
                "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
            )
            print(
                f"{'':6}{'frames':>8}{'s':>8}{'1/s':>8}{'quick':>8}   processor time of a frame [ms]: page, browser, "
                "server"
            )
            for way, (address, process) in ways.items():
                found = measure(page, address, wish.screen, process)
                rate = found["frames"] / found["seconds"]
                slowest = min(slowest, 1 / max(found["page"], found["server"], 1e-9))
                shares = "".join(f"{1e3 * found[one]:8.1f}" for one in ("page", "browser", "server"))
                print(
                    f"{way:6}{found['frames']:8.0f}{found['seconds']:8.2f}{rate:8.1f}{found['quick']:8.1f}   {shares}"
                )
            assert not page.errors, page.errors
        finally:
            page.close()
            server.terminate()
    return int(wish.least is not None and slowest < wish.least)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
