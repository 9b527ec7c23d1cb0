#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes the pictures of docs/gallery and docs/images/viewer.png from models of inputs/: a minute or so.

    .venv/bin/python docs/gallery/make_gallery.py [NAME...]     # all, or those whose names are given

Needs the program (build/bin/rockdda, ROCKDDA_PROGRAM or on the PATH); for the viewer Chromium.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "postprocess"))

import matplotlib as mpl  # noqa: E402

mpl.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import rockdda  # noqa: E402
from PIL import Image  # noqa: E402
from rockdda import plot  # noqa: E402
from rockdda.film import Viewer, serve  # noqa: E402
from rockdda.results import Results  # noqa: E402

UNITS = "m,s,N"
DIG = """\
&contact formulation = 'length' /
&region name = 'upper', box = -1,3,2,6 /
&stage name = 'weight', until = 'equilibrium' /
&stage name = 'half', until = 'equilibrium', excavate = 'upper', relax = 0.5 /
&stage name = 'rest', until = 'equilibrium', relax = 1 /
"""
HOLDS = "&joint_material number = 1, friction = 35 /\n&joint_material number = 2, friction = 35 /\n"
FRICTION = (15, 20, 25, 30)  # degrees, of the weak plane


class Runs:
    """Results of the models, each run once."""

    def __init__(self, folder: Path) -> None:
        built = ROOT / "build/bin/rockdda"
        program = os.environ.get("ROCKDDA_PROGRAM") or (str(built) if built.exists() else shutil.which("rockdda"))
        if not program:
            raise SystemExit("make_gallery: the program is not built")
        self.program, self.folder = program, folder
        self.known: dict[str, Results] = {}

    def run(self, name: str, model: Path) -> Results:
        if name not in self.known:
            path = self.folder / f"{name}.h5"
            subprocess.run([self.program, "run", model, "-o", path, "--quiet"], check=True, stdout=subprocess.DEVNULL)
            self.known[name] = rockdda.open(path)
        return self.known[name]

    def __call__(self, name: str) -> Results:
        return self.run(name, ROOT / "inputs" / name)

    def dug(self, name: str, stages: str) -> Results:
        """A model with stages."""
        model = self.folder / f"{name}_dug"
        if not model.exists():
            shutil.copytree(ROOT / "inputs" / name, model)
            with (model / f"{name}.nml").open("a", encoding="utf-8") as file:
                file.write(stages)
        return self.run(model.name, model)

    def search(self, name: str, options: str) -> Results:
        """The failing trial of the search of a model's factor of safety, with other options."""
        if f"{name}_factor" not in self.known:
            model, path = self.folder / f"{name}_factor", self.folder / f"{name}_factor.h5"
            shutil.copytree(ROOT / "inputs" / name, model)
            with (model / f"{name}.nml").open("a", encoding="utf-8") as file:
                file.write(options)
            command = [self.program, "fos", model, "-o", path, "--quiet"]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            self.known[f"{name}_factor"] = rockdda.open(path)
        return self.known[f"{name}_factor"]

    def slope(self, friction: int) -> Results:
        """The jointed slope with another friction of its weak plane."""
        model = self.folder / f"slope{friction}"
        if not model.exists():
            shutil.copytree(ROOT / "inputs/jointed_slope", model)
            file = model / "jointed_slope.df"
            head, _, _ = file.read_text(encoding="utf-8").rstrip("\n").rpartition("\n")
            file.write_text(f"{head}\n  {friction}  0  0\n", encoding="utf-8")
        return self.run(f"friction_{friction}", model)


def multiples(runs: Runs) -> Any:
    studies = [runs.slope(friction) for friction in FRICTION]
    names = [f"friction {friction}° on the weak plane" for friction in FRICTION]
    return plot.small_multiples(studies, "displacement", labels=names, units=UNITS)


PICTURES: dict[str, tuple[str, Callable[[Runs], Any]]] = {
    "blocks": (
        "a field on the deformed blocks, start dashed",
        lambda runs: plot.blocks(runs("jointed_slope"), "displacement", units=UNITS),
    ),
    "enlarged": (
        "small displacements, enlarged",
        lambda runs: plot.blocks(runs("flat_arch"), "stress_x", scale=500, units=UNITS),
    ),
    "material": ("block materials", lambda runs: plot.blocks(runs("tunnel"), "material", units=UNITS)),
    "stress": ("principal stresses", lambda runs: plot.stress_crosses(runs("tunnel"), units=UNITS)),
    "contacts": ("contact forces and states", lambda runs: plot.contact_forces(runs("jointed_slope"), units=UNITS)),
    "joints": (
        "stresses, opening and slip along joints",
        lambda runs: plot.joints(runs("jointed_slope"), units=UNITS, title="jointed_slope, t = 1 s"),
    ),
    "displacements": ("displacement vectors", lambda runs: plot.displacements(runs("layered_roof"), units=UNITS)),
    "water": (
        "water table and pressures",
        lambda runs: plot.water(runs.run("full", ROOT / "inputs/sau_mau_ping/full.nml"), units=UNITS),
    ),
    "history": (
        "history of measured points",
        lambda runs: plot.history(runs("incline"), units=UNITS),
    ),
    "profile": (
        "profile along a line, at several times",
        lambda runs: plot.profile(
            runs("layered_roof"), "displacement_y", (-5, 0.24, 5, 0.24), (3, 6, 12, -1), units=UNITS
        ),
    ),
    "energy": ("energy ledger, and what does not close", lambda runs: plot.energy(runs("jointed_slope"), units=UNITS)),
    "iterations": ("steps, rounds, contacts", lambda runs: plot.iterations(runs("jointed_slope"), units=UNITS)),
    "ground-reaction": (
        "released share of the forces of excavated blocks over convergence",
        lambda runs: plot.ground_reaction(runs.dug("stack", DIG), units=UNITS),
    ),
    "mechanism": (
        "how a slope fails",
        lambda runs: plot.mechanism(runs.search("jointed_slope", HOLDS), units=UNITS, title="jointed slope"),
    ),
    "factor": (
        "search of the factor of safety",
        lambda runs: plot.factor(runs.search("jointed_slope", HOLDS), units=UNITS),
    ),
    "multiples": ("small multiples of a parameter study", multiples),
}


def viewer(runs: Runs) -> None:
    """A screenshot of the local viewer with a picked block."""
    browser = next((path for path in map(shutil.which, ("chromium", "chromium-browser")) if path), None)
    if browser is None:
        print("no Chromium: docs/images/viewer.png stays as it is")
        return
    shown = Viewer(runs("jointed_slope"), "speed", UNITS)
    server = serve(shown)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_address[1]}/?token={shown.token}#frame=90&pick=53"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1200,700"]
    options += ["--virtual-time-budget=5000", f"--screenshot={ROOT / 'docs/images/viewer.png'}"]
    subprocess.run([browser, *options, address], check=True, capture_output=True)
    server.shutdown()
    _smaller(ROOT / "docs/images/viewer.png")


def film(runs: Runs) -> None:
    """A film that plays in the browser."""
    runs("toppling_column").animate(
        HERE / "toppling_column.html", field="stress_min", units=UNITS, fields=["displacement", "rotation", "speed"]
    )


def _smaller(path: Path) -> None:
    """Without transparency, packed as well as it goes."""
    with Image.open(path) as image:
        image.convert("RGB").save(path, optimize=True)


def contact_sheet() -> None:
    """All kinds on one page."""
    columns, gap = 3, 0.012
    pictures = [(name, Image.open(HERE / f"{name}.png")) for name in PICTURES]
    width = (1 - gap) / columns - gap
    ratio = 1.38  # height of the page over its width
    heights = [0.0] * columns
    figure = plt.figure(figsize=(11, 11 * ratio))
    for name, picture in pictures:
        column = heights.index(min(heights))
        height = width * picture.height / picture.width / ratio
        left = gap + column * (width + gap)
        bottom = 1 - heights[column] - 0.024 - height
        figure.text(left, bottom + height + 0.004, PICTURES[name][0], fontsize=7.5, weight="bold")
        axes = figure.add_axes((left, bottom, width, height))
        axes.imshow(picture, interpolation="lanczos")
        axes.set_axis_off()
        heights[column] += height + 0.045
    used = max(heights)
    box = mpl.transforms.Bbox([[0, 11 * ratio * (1 - used + 0.015)], [11, 11 * ratio]])
    figure.savefig(HERE / "contact_sheet.png", dpi=130, bbox_inches=box)
    plt.close(figure)
    _smaller(HERE / "contact_sheet.png")


def main(names: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(Path(folder))
        for name, (_, draw) in PICTURES.items():
            if not names or name in names:
                _smaller(plot.save(draw(runs), HERE / f"{name}.png", dpi=130))
                print(name)
        if not names or "viewer" in names:
            viewer(runs)
        if not names or "film" in names:
            film(runs)
    contact_sheet()


if __name__ == "__main__":
    main(sys.argv[1:])
