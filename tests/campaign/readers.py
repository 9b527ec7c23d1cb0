# SPDX-License-Identifier: MIT
"""Readers against each other: the same blocks from every format, the same motion from every spelling of a table."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import shapely
from hypothesis import strategies as st

from .bench import ROOT, Bench, Fault, Model, Points, Unsuited, box, joint, require, rock
from .drawing import Kind, Values, seeds, values


def _convert(folder: Path, *arguments: str) -> None:
    """rockdda-post of this tree: --program chooses the program, not the package."""
    environment = {**os.environ, "PYTHONPATH": os.fspath(ROOT / "postprocess")}
    done = subprocess.run(
        [sys.executable, "-m", "rockdda", "convert", *arguments, "--force"],
        cwd=folder,
        capture_output=True,
        text=True,
        env=environment,
        check=False,
        timeout=120,
    )
    require(done.returncode == 0, f"convert {' '.join(arguments)}: {done.stderr.strip()[-300:]}")


def _outlines(path: Path) -> list[Points]:
    rows = [line.split("#")[0].split() for line in path.read_text().splitlines()]
    rows = [row for row in rows if row]
    return [
        np.array([[float(x) for x in row[:2]] for row in rows[k + 1 : k + 1 + int(rows[k][3])]])
        for k in range(len(rows))
        if rows[k][0] == "block"
    ]


def _faces(drawn: Values) -> list[Points]:
    """Polygons that share edges: the faces of lines in a box."""
    random = np.random.default_rng(drawn["seed"])
    lines = [shapely.LinearRing(box(0, 0, 10, 10))]
    for _ in range(drawn["lines"]):
        a, b = random.uniform(0, 10, (2, 2))
        d = (b - a) / np.hypot(*(b - a))
        lines.append(shapely.LineString([a - 20 * d, a + 20 * d]).intersection(shapely.box(0, 0, 10, 10)))
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.unary_union(lines, grid_size=1e-9))))
    if any(face.area < 0.05 for face in faces):
        raise Unsuited
    return [np.asarray(shapely.orient_polygons(face).exterior.coords)[:-1] for face in faces]


def _write_format(kind: str, faces: list[Points], folder: Path) -> str:
    polygons = [shapely.Polygon(face) for face in faces]
    name = f"blocks.{kind}"
    if kind == "dxf":
        import ezdxf

        drawing = ezdxf.new()
        for face in faces:
            drawing.modelspace().add_lwpolyline([tuple(map(float, p)) for p in face], close=True)
        drawing.saveas(folder / name)
    elif kind == "geojson":
        features = [
            {"type": "Feature", "properties": {}, "geometry": json.loads(shapely.to_geojson(p))} for p in polygons
        ]
        (folder / name).write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    else:
        import geopandas

        geopandas.GeoDataFrame(geometry=polygons, crs=32632).to_file(folder / name)
    return name


def formats(drawn: Values, bench: Bench) -> None:
    """Blocks written by ezdxf, shapely or geopandas, converted and cut: the same blocks."""
    bench.folder.mkdir(parents=True, exist_ok=True)
    faces = _faces(drawn)
    name = _write_format(drawn["format"], faces, bench.folder)
    _convert(bench.folder, name, *(["--blocks"] if drawn["blocks"] else []), "-o", "m")
    if not (bench.folder / "m.blk").exists():  # lines, of drawings
        done = bench.call("cut", "m.dc", "-o", "m.blk", "--force")
        require(done.returncode == 0, f"cut: {done.stderr.strip()[-200:]}")
    found = [shapely.Polygon(points) for points in _outlines(bench.folder / "m.blk")]
    require(len(found) == len(faces), f"{drawn['format']}: {len(found)} blocks, written were {len(faces)}")
    tree = shapely.STRtree(found)
    for face in faces:
        truth = shapely.Polygon(face)
        best = max((found[k].intersection(truth).area for k in tree.query(truth)), default=0.0)
        require(abs(best / truth.area - 1) < 2e-3, f"{drawn['format']}: no block covers the one of area {truth.area:g}")


SPELLINGS = ("crlf", "cr", "mark", "utf16", "ctrl-z", "d-exponent", "decimal-comma", "semicolon")


def _spell(text: str, spelling: str) -> bytes:
    match spelling:
        case "crlf":
            return text.replace("\n", "\r\n").encode()
        case "cr":
            return text.replace("\n", "\r").encode()
        case "mark":
            return b"\xef\xbb\xbf" + text.encode()
        case "utf16":
            return text.encode("utf-16")
        case "ctrl-z":
            return text.encode() + b"\x1a"
        case "d-exponent":
            return text.replace("e-", "D-").replace("e+", "D+").encode()
        case "decimal-comma":
            return text.replace(",", ";").replace(".", ",").encode()
        case _:
            return text.replace(",", ";").encode()


def tables(drawn: Values, bench: Bench) -> None:
    """A record of the base in another spelling: the same motion, or it is refused by name."""
    random = np.random.default_rng(drawn["seed"])
    times = np.linspace(0, 0.3, 31)
    rows = "".join(f"{t:.6e},{a:.6e},{0.0:.6e}\n" for t, a in zip(times, random.uniform(-2, 2, 31), strict=True))
    ends = []
    for spelling in ("plain", drawn["spelling"]):
        model = Model(blocks=[box(-3, -1, 7, 1), box(0, 0, 1, 0.5)], held={0})
        model.groups = [
            rock(more=", unit_weight=24525.0"),
            joint(friction=5, normal_stiffness=1e9),
            "&load base_acceleration='a.csv' /",
            "&run t_end=0.3 /",
            "&time dt_max=0.002 /",
        ]
        text = "t,ax,ay\n" + rows
        place = bench.folder / spelling
        model.write(place)
        (place / "a.csv").write_bytes(text.encode() if spelling == "plain" else _spell(text, spelling))
        done = bench.call("run", "m.nml", "--force", "--json", "--threads", "1", folder=place)
        if done.returncode == 2 and spelling != "plain":
            if "a.csv" in done.stderr:
                return  # refused, the file is named
            raise Fault(f"{spelling}: refused without the file's name: {done.stderr.strip()[-200:]}")
        require(done.returncode == 0, f"{spelling}: exit {done.returncode}: {done.stderr.strip()[-200:]}")
        import h5py

        with h5py.File(place / "m.h5") as results:
            ends.append(results["frames/vertices"][-1])
    require(np.array_equal(ends[0], ends[1]), f"{drawn['spelling']}: another motion, without a word")


def options(drawn: Values, bench: Bench) -> None:
    """A labelled file in another spelling: the same model, or it is refused by name."""
    spelling = drawn["spelling"]
    texts = []
    for which in ("plain", spelling):
        model = Model(blocks=[box(-3, -1, 7, 1), box(0, 0, 1, 0.5 + drawn["high"] / 10)], held={0})
        model.groups = [
            rock(young=1.25e10, more=", unit_weight=2.4525e+04"),
            joint(friction=17.5, normal_stiffness=1e9),
            "&stage name='w', until='equilibrium' /",
        ]
        place = bench.folder / which
        path = model.write(place)
        if which != "plain":
            path.write_bytes(_spell(path.read_text(), spelling))
        done = bench.call("run", "m.nml", "--force", "--json", "--threads", "1", folder=place)
        if done.returncode == 2 and which != "plain":
            require("m.nml" in done.stderr, f"{spelling}: refused without the file's name")
            return
        require(done.returncode == 0, f"{spelling}: exit {done.returncode}: {done.stderr.strip()[-200:]}")
        import h5py

        with h5py.File(place / "m.h5") as results:
            texts.append(results["frames/vertices"][-1])
    require(np.array_equal(texts[0], texts[1]), f"{spelling}: another model, without a word")


KINDS = [
    Kind(
        "formats",
        "readers",
        "blocks written by ezdxf, shapely and geopandas, read by rockdda-post convert: the same blocks",
        values(
            seed=seeds(),
            lines=st.integers(0, 5),
            format=st.sampled_from(["dxf", "geojson", "gpkg", "shp"]),
            blocks=st.booleans(),
        ),
        formats,
    ),
    Kind(
        "spellings-of-tables",
        "readers",
        "a record with other line ends, marks, encodings, exponents: the same bits, or refused by name",
        values(seed=seeds(), spelling=st.sampled_from(SPELLINGS)),
        tables,
    ),
    Kind(
        "spellings-of-options",
        "readers",
        "a labelled file with other line ends, marks, encodings, exponents: the same bits, or refused by name",
        values(high=st.integers(0, 20), spelling=st.sampled_from(SPELLINGS[:6])),
        options,
    ),
]
