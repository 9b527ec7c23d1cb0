#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes the pictures of docs/gallery, of the README, of the viewer and of all models from inputs/: some minutes.

    .venv/bin/python docs/gallery/make_gallery.py [NAME...]     # all, or those whose names are given

`overview` is the picture of the README, `models` are the end.png of inputs/, made by the commands of their READMEs
(`models NAME` for one), `reaction` is that of the page on support, `cases` that of the notebooks, `tutorial`, `viewer`
and `film` are what they say. Needs the program (build/bin/rockdda, ROCKDDA_PROGRAM or on the PATH) and the extension;
for the viewer Chromium, for the cases Jupyter.
"""

from __future__ import annotations

import base64
import io
import os
import re
import shlex
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
from rockdda.film.model_viewer import ModelViewer  # noqa: E402
from rockdda.results import Results  # noqa: E402

EXTENSION = os.environ.get("ROCKDDA_EXTENSION", str(ROOT / "build/python"))
rockdda.__path__.append(EXTENSION)

UNITS = "SI"
DIG = """\
&contact formulation = 'length' /
&region name = 'upper', box = -1,3,2,6 /
&stage name = 'weight', until = 'equilibrium' /
&stage name = 'half', until = 'equilibrium', excavate = 'upper', relax = 0.5 /
&stage name = 'rest', until = 'equilibrium', relax = 1 /
"""
HOLDS = "&joint_material number = 1, friction = 35 /\n&joint_material number = 2, friction = 35 /\n"
WET = (
    "&joint_material number = 2, friction = 38 /\n"
    "&water name = 'rain', table = -7,-3, 0,0.2, 8,6, 26,10, unit_weight = 9810, surfaces = .false. /\n"
)
LARGEST = 60_000  #: bytes of the picture of a model
#: Notebooks and which of their pictures stands for them.
CASES = {
    "slope_with_water": 0, "tunnel_in_stages": 1, "support": 4, "masonry_wall": 1, "shaking_table": 2,
    "survey_to_loosening": 0,
}  # fmt: skip
FRICTION = (15, 20, 25, 30)  # degrees, of the weak plane


#: the command rockdda-post of this tree
POST = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT / 'postprocess')!r}); "
        "from rockdda.cli import run; run()"]  # fmt: skip


class Runs:
    """Results of the models, each run once."""

    def __init__(self, folder: Path) -> None:
        built = ROOT / "build/bin/rockdda"
        program = os.environ.get("ROCKDDA_PROGRAM") or (str(built) if built.exists() else shutil.which("rockdda"))
        if not program:
            raise SystemExit("make_gallery: the program is not built")
        self.program, self.folder = program, folder
        os.environ["ROCKDDA_PROGRAM"] = str(Path(program).resolve())
        self.known: dict[str, Results] = {}

    def run(self, name: str, model: Path) -> Results:
        if name not in self.known:
            path = self.folder / f"{name}.h5"
            subprocess.run([self.program, "run", model, "-o", path, "--quiet"], check=True, stdout=subprocess.DEVNULL)
            self.known[name] = rockdda.open(path)
        return self.known[name]

    def __call__(self, name: str) -> Results:
        return self.run(name, ROOT / "inputs" / name)

    def dug(self, name: str, stages: str, kind: str = "dug") -> Results:
        """A model with stages, or what else belongs into its options file."""
        model = self.folder / f"{name}_{kind}"
        if not model.exists():
            shutil.copytree(ROOT / "inputs" / name, model)
            with (model / f"{name}.nml").open("a", encoding="utf-8") as file:
                file.write(stages)
        return self.run(model.name, model)

    def lined(self) -> Results:
        """The tunnel in two headings with shotcrete on the upper heading, before its face is far."""
        model = self.folder / "lined"
        if not model.exists():
            shutil.copytree(ROOT / "inputs/two_headings", model)
            file = model / "two_headings.nml"
            text = file.read_text(encoding="utf-8")
            line = re.search(r"name = 'heading', polygon = (.*) /", text)
            far = "name = 'heading, face far', "
            text = text.replace(far, far + "install = 'shotcrete', ")
            section = "thickness = 0.25, young = 15e9, compressive_strength = 25e6, tensile_strength = 2e6"
            text += f"&liner name = 'shotcrete', along = {line.group(1) if line else ''}, {section} /\n"
            file.write_text(text, encoding="utf-8")
        return self.run("lined", model)

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
    "contours": (
        "contour bands over the blocks",
        lambda runs: plot.contours(runs("benched_slope"), "stress_y", title="Slope in four benches"),
    ),
    "trajectories": (
        "trajectories of the principal stresses",
        lambda runs: plot.trajectories(runs("tunnel"), units=UNITS),
    ),
    "thrust": (
        "the line of thrust",
        lambda runs: plot.thrust(runs("arch_on_centring"), title="Arch after striking its centring"),
    ),
    "stress": ("principal stresses", lambda runs: plot.stress_crosses(runs("tunnel"), units=UNITS)),
    "contacts": ("contact forces and states", lambda runs: plot.contact_forces(runs("jointed_slope"), units=UNITS)),
    "joints": (
        "stresses, opening and slip along joints",
        lambda runs: plot.joints(runs("jointed_slope"), units=UNITS),
    ),
    "displacements": ("displacement vectors", lambda runs: plot.displacements(runs("layered_roof"), units=UNITS)),
    "bolts": ("axial force along bolts", lambda runs: plot.bolts(runs("bolted_beam"), units=UNITS)),
    "liner": (
        "forces along a lining",
        lambda runs: plot.liner(runs.lined(), "M", units=UNITS),
    ),
    "capacity": (
        "N and M of a lining, what its section bears",
        lambda runs: plot.capacity(runs.lined(), units=UNITS),
    ),
    "water": (
        "water table and pressures",
        lambda runs: plot.water(runs.run("full", ROOT / "inputs/sau_mau_ping/full.nml"), units=UNITS),
    ),
    "water-joints": (
        "water pressure on chosen joints, and heads",
        lambda runs: plot.water(
            runs.dug("jointed_slope", WET, "wet"), joints=[2], heads=True, units=UNITS, title="Slope with water"
        ),
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
    "joint-profile": (
        "stresses along a chosen line of joints",
        lambda runs: plot.joint_profile(
            runs.dug("jointed_slope", WET, "wet"), (0, 0, 20.785, 12), units=UNITS, title="Weak plane, with water"
        ),
    ),
    "energy": ("energy ledger, and what does not close", lambda runs: plot.energy(runs("jointed_slope"), units=UNITS)),
    "iterations": ("steps, rounds, contacts", lambda runs: plot.iterations(runs("jointed_slope"), units=UNITS)),
    "ground-reaction": (
        "ground reaction of an excavation",
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


def overview(runs: Runs) -> None:
    """What the program can do, for the top of the README: a tunnel with bolts, a slope, an arch."""
    from rockdda.critical import read_search
    from rockdda.plot.style import clip_to_window, style, window_axes

    with style():
        figure = plt.figure(figsize=(7.6, 4.2), layout="constrained")
        grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.15), height_ratios=(1.25, 1.0))
        tunnel, slope, arch = (figure.add_subplot(place) for place in (grid[:, 0], grid[0, 1], grid[1, 1]))
    window = (-12.0, -12.0, 12.0, 12.0)
    plot.contours(
        runs("supported_tunnel"), "stress_min", axes=window_axes(window, tunnel),
        title="Tunnel with bolts and shotcrete",
    )  # fmt: skip
    clip_to_window(tunnel, window)
    failing = runs.search("jointed_slope", HOLDS)
    factor = read_search(failing).value
    plot.mechanism(failing, axes=slope, units=UNITS, title=f"Slope, factor of safety {factor:.2f}")
    plot.thrust(runs("arch_bridge"), axes=arch, title="Arch bridge: line of thrust")
    _smaller(plot.save(tunnel, ROOT / "docs/images/overview.png", dpi=180))


def reaction() -> None:
    """Ground reaction and support characteristic, for the page on support."""
    path = ROOT / "docs/images/ground_reaction.png"
    words = ["ground-reaction", ROOT / "inputs/supported_tunnel", "-o", path, "--dpi", "150"]
    subprocess.run([*POST, *words], check=True, capture_output=True, env={**os.environ, "ROCKDDA_EXTENSION": EXTENSION})
    _smaller(path)


def models(runs: Runs, names: list[str]) -> None:
    """The picture of each model, by the commands of its README up to its first picture."""
    for readme in sorted((ROOT / "inputs").glob("*/README.md")):
        name, text = readme.parent.name, readme.read_text(encoding="utf-8")
        if "(end.png)" not in text or (names and name not in names):
            continue
        folder = runs.folder / f"of_{name}"
        shutil.copytree(readme.parent, folder / "inputs" / name)
        for line in re.findall(r"^    (rockdda(?:-post plot)? .*)$", text, re.M):
            words = shlex.split(line)
            drawing = words[0] == "rockdda-post"
            command = [*POST, *words[1:]] if drawing else [runs.program, *words[1:]]
            subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
            if drawing:
                _smaller(folder / words[words.index("-o") + 1], 900, LARGEST).replace(readme.parent / "end.png")
                print(f"inputs/{name}/end.png")
                break


def tutorial(runs: Runs) -> None:
    """The pictures of the tutorial, by its commands and from the files that it prints."""
    folder = runs.folder / "tutorial"
    folder.mkdir()
    text = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    for name, block in re.findall(r"[Pp]ut this into `([^`]+)`[^\n]*\n\n((?: {4}.*\n|\n(?= {4}))+)", text):
        (folder / name).write_text(re.sub(r"^ {4}", "", block, flags=re.M).rstrip() + "\n", encoding="utf-8")
    for line in re.findall(r"^    (rockdda (?:lines|cut|run) .*|rockdda-post plot .*)$", text, re.M):
        words = shlex.split(line, comments=True)
        command = [*POST, *words[1:]] if words[0] == "rockdda-post" else [runs.program, *words[1:]]
        subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for name in ("blocks", "history", "heading", "reaction"):
        _smaller(folder / f"{name}.png", 900).replace(ROOT / f"docs/images/tutorial_{name}.png")


def viewer(runs: Runs) -> None:
    """Screenshots of the local viewer: a picked block; joints, bolts and lining of a tunnel; a model before any run."""
    browser = next((path for path in map(shutil.which, ("chromium", "chromium-browser")) if path), None)
    if browser is None:
        print("no Chromium: the pictures of the viewer stay as they are")
        return
    tunnel = ROOT / "inputs/supported_tunnel"
    for name, shown, place in (
        ("viewer", Viewer(runs("jointed_slope"), "speed", UNITS), "frame=90&pick=53"),
        ("viewer_joints", Viewer(runs("supported_tunnel")), "field=joint_shear_stress"),
        ("model_view", ModelViewer(tunnel), ""),
    ):
        server = serve(shown)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_address[1]}/?token={shown.token}#{place}"
        picture = ROOT / f"docs/images/{name}.png"
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1200,700"]
        options += ["--virtual-time-budget=8000", f"--screenshot={picture}"]
        subprocess.run([browser, *options, address], check=True, capture_output=True)
        server.shutdown()
        _smaller(picture)


def cases(runs: Runs) -> None:
    """A picture of each of six notebooks, which run for it."""
    import nbformat
    from nbclient import NotebookClient

    start = runs.folder / "start"
    start.mkdir()
    (start / "sitecustomize.py").write_text(f"import rockdda\n\nrockdda.__path__.append({EXTENSION!r})\n")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(start), str(ROOT / "postprocess")])
    figure, grid = plt.subplots(3, 2, figsize=(9.0, 8.8), layout="constrained")
    for axes, (name, number) in zip(grid.flat, CASES.items(), strict=True):
        notebook = nbformat.read(ROOT / f"docs/notebooks/{name}.ipynb", as_version=4)
        folder = runs.folder / f"case_{name}"
        folder.mkdir()
        NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(folder)}}).execute()
        outputs = (output for cell in notebook.cells for output in cell.get("outputs", []))
        found = [output["data"]["image/png"] for output in outputs if "image/png" in output.get("data", {})]
        axes.imshow(Image.open(io.BytesIO(base64.b64decode(found[number]))), interpolation="lanczos")
        axes.set_axis_off()
    figure.savefig(ROOT / "docs/images/case_studies.png", dpi=140)
    plt.close(figure)
    _smaller(ROOT / "docs/images/case_studies.png")


def film(runs: Runs) -> None:
    """A film that plays in the browser."""
    runs("toppling_column").animate(
        HERE / "toppling_column.html", field="stress_min", units=UNITS, fields=["displacement", "rotation", "speed"]
    )


def _smaller(path: Path, width: int | None = None, largest: int | None = None) -> Path:
    """Without transparency, packed as well as it goes; of a width, with few colours where too large."""
    with Image.open(path) as image:
        plain = image.convert("RGB")
    if width is not None and plain.width > width:
        plain = plain.resize((width, round(plain.height * width / plain.width)), Image.Resampling.LANCZOS)
    plain.save(path, optimize=True)
    for share in (1.0, 0.85, 0.7, 0.55):
        if largest is None or path.stat().st_size < largest:
            break
        size = (round(plain.width * share), round(plain.height * share))
        plain.resize(size, Image.Resampling.LANCZOS).quantize(128).save(path, optimize=True)
    return path


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
        if "models" in names:
            models(runs, names[names.index("models") + 1 :])
            return
        for name, (_, draw) in PICTURES.items():
            if not names or name in names:
                _smaller(plot.save(draw(runs), HERE / f"{name}.png", dpi=130))
                print(name)
        if not names or "viewer" in names:
            viewer(runs)
        if not names or "cases" in names:
            cases(runs)
        if not names or "film" in names:
            film(runs)
        if not names or "tutorial" in names:
            tutorial(runs)
        if not names or "overview" in names:
            overview(runs)
        if not names or "reaction" in names:
            reaction()
        if not names:
            models(runs, [])
    contact_sheet()


if __name__ == "__main__":
    main(sys.argv[1:])
