# SPDX-License-Identifier: MIT
"""Damaged input for the readers and converters of `rockdda-post` and for studies: each ends soon, as done or bad input.

    python postprocess/tests/fuzz_convert.py [COUNT [FIRST [KIND...]]]

runs COUNT cases (1000) of each kind from the number FIRST (0) and prints faults; `test_convert_fuzz.py` runs some.
"""

from __future__ import annotations

import contextlib
import io
import json
import random
import resource
import sys
import tempfile
import time
import warnings
from pathlib import Path

import ezdxf

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import rockdda
from places import EXTENSION
from rockdda import cli, records

if EXTENSION.is_dir() and str(EXTENSION) not in rockdda.__path__:
    rockdda.__path__.append(str(EXTENSION))

MEGABYTES = 500  # of this process, with all that it has imported
SECONDS = 10.0  # of processor time; the slowest case of some thousands takes below 2 s
WORDS = [
    "0", "-1", "1e308", "1e400", "nan", "inf", "-inf", "9" * 400, "9" * 5000, "1e-320", "", "x", "\0", "é", "{", "}",
    "[", "]", '"', "'", "\\", "\n", "<", ">", "&", "//", "null", "true", "=", ".", "999999999999", "4294967296", "0x10",
    "{{", "}}",
]  # fmt: skip


def dxf_seed() -> str:
    document = ezdxf.new("R2000")
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (4, 0), (4, 3), (0, 3)], close=True, dxfattribs={"layer": "area"})
    space.add_lwpolyline(
        [(1, 1, 0.5), (2, 1, 0), (2, 2, -1)], format="xyb", close=True, dxfattribs={"layer": "opening_2"}
    )
    space.add_line((-1, 1), (5, 1.5), dxfattribs={"layer": "a"})
    space.add_arc((2, 3), 1, 180, 270, dxfattribs={"layer": "b"})
    space.add_circle((3, 1), 0.3, dxfattribs={"layer": "measured"})
    space.add_ellipse((2, 2), (1, 0), 0.4, dxfattribs={"layer": "c"})
    space.add_spline([(0, 0), (1, 2), (2, 1), (4, 3)], dxfattribs={"layer": "c"})
    space.add_polyline2d([(0, 1), (1, 1, 0.3), (2, 0)], format="xyb", dxfattribs={"layer": "b"})
    space.add_point((1, 1), dxfattribs={"layer": "fixed"})
    block = document.blocks.new("B")
    block.add_line((0, 0), (1, 1), dxfattribs={"layer": "a"})
    attributes = {"row_count": 2, "column_count": 2, "row_spacing": 1, "column_spacing": 1, "xscale": -2}
    space.add_blockref("B", (1, 0), dxfattribs=attributes)
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def geojson_seed() -> str:
    def feature(shape: str, coordinates: object, **properties: object) -> dict[str, object]:
        return {"type": "Feature", "properties": properties, "geometry": {"type": shape, "coordinates": coordinates}}

    ring = [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]
    features = [
        feature("Polygon", [ring]),
        feature("Polygon", [[[1, 1], [2, 1], [2, 2], [1, 1]]], kind="opening", material=2),
        feature("MultiLineString", [[[1, -1], [1, 4]], [[-1, 2], [2, 1], [5, 1]]]),
        feature("LineString", [[0.5, 0.5], [3, 3]], kind="material", block_material=2),
        feature("MultiPoint", [[3, 2, 7]]),
        {"type": "GeometryCollection", "geometries": [{"type": "Point", "coordinates": [0.5, 1]}]},
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def ddaml_seeds() -> tuple[str, str]:
    from test_convert import ANALYSIS, GEOMETRY

    return GEOMETRY, ANALYSIS


TRACES = "# traces\nx1 y1 x2 y2\n0,5\t1,5\t2\t1,5\t4\t1\n1\t-1\t1,5\t4\n3,25\t-1\t2,5\t4\n"
PEER = """\
PEER NGA STRONG MOTION DATABASE RECORD
MADE UP 01/01/00, ESTACIÓN A, 090
ACCELERATION TIME HISTORY IN UNITS OF G
NPTS=     13, DT= .0100 SEC
  0.0000000E+00  1.0000000E-01  2.0000000E-01  1.0000000E-01  0.0000000E+00
 -1.0000000D-01 -2.0000000E-01 -1.0000000E-01  0.0000000E+00  5.0000000E-02
  0.0000000E+00 -5.0000000E-02  0.0000000E+00
"""
TABLE = "# station\ntime (s);NS (cm/s2);EW [gal]\n" + "".join(
    f"{0.02 * k:g};{k % 7 - 3};{k % 5:.2f}\n" for k in range(40)
)

STUDY = """\
title = "a"
template = "template"
[parameters]
n = [1, 2.5, "x"]
m = [3]
[constants]
c = 2
[run]
threads = 1
timeout = 10.0
options = ["--solver", "pcg"]
[results.d]
dataset = "history/energy"
at = [0, 1]
take = "max"
[cluster]
time = "1:00"
"""
TEMPLATE = "{{n}} {{m**2 + max(1, c)/3:.3f}} {{round(-m, 2)}} {{(m + (c - 1)*2)//1:5d}}\n"


def mutated(text: str, random_: random.Random, dxf: bool = False) -> str:
    """The text with one to four faults: words replaced, pieces cut out, doubled, repeated or nested."""
    for _ in range(random_.randint(1, 4)):
        if dxf and random_.random() < 0.7:  # the value of a group within the entities, where most of it is read
            lines = text.split("\n")
            begin = next((i for i, line in enumerate(lines) if line == "ENTITIES"), 0)
            if random_.random() < 0.3:
                begin = next((i for i, line in enumerate(lines) if line == "BLOCKS"), 0)
            k = min(begin + 2 * random_.randrange(1, 200) + 1, len(lines) - 1)
            lines[k - random_.randint(0, 1)] = random_.choice([*WORDS, *lines[begin : begin + 200]])
            text = "\n".join(lines)
            continue
        a = random_.randrange(len(text) + 1)
        b = min(len(text), a + random_.choice([0, 1, 3, 10, 50]))
        choice = random_.randrange(6)
        piece = text[a:b]
        if choice == 0:
            new = random_.choice(WORDS)
        elif choice == 1:
            new = ""
        elif choice == 2:
            new = piece * 2
        elif choice == 3:
            new = piece * random_.choice([10, 1000, 20_000]) if len(piece) < 20 else piece
        elif choice == 4:
            new = random_.choice("[{(<-") * random_.choice([10, 2000, 100_000]) + piece
        else:
            c = random_.randrange(len(text) + 1)
            new = text[c : c + random_.choice([1, 10, 100])]
        text = text[:a] + new + text[b:]
    return text


def encoded(text: str, random_: random.Random) -> bytes:
    """The text with some line end, in some encoding, perhaps with decimal commas and Ctrl-Z."""
    text = text.replace("\n", random_.choice(["\n", "\n", "\r", "\r\n"])) + random_.choice(["", "", "\x1a"])
    if random_.random() < 0.3:
        text = text.replace(".", ",")
    if random_.random() < 0.3:
        text = text.replace(";", random_.choice([",", " ", "\t"]))
    data = text.encode(random_.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1", "utf-32"]), "replace")
    return data if random_.random() < 0.9 else data[: random_.randrange(len(data) + 1)]


def record_options(random_: random.Random) -> list[str]:
    """Some options of `record`, not all of them sensible."""
    numbers = ["0", "1", "0.005", "-1", "1e-300", "1e300", "inf", "nan"]
    options = []
    for name in ("--step", "--from", "--to", "--scale", "--damping"):
        if random_.random() < 0.15:
            options += [name, random_.choice(numbers)]
    if random_.random() < 0.2:
        options += ["--baseline", random_.choice(["0", "1", "3", "1000000", "-1"])]
    if random_.random() < 0.3:
        options += ["--column", random_.choice(["2", "3", "ew", "ns (cm/s2)", "0", "1e9", "nan", ""])]
    return options


def read_alone(path: Path, random_: random.Random) -> str | None:
    """Read a record; what is wrong, or None."""
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            records.read(path, column=random_.choice([None, None, 2, 3, "ew"]) if path.suffix == ".csv" else None)
        except rockdda.InputError as error:
            if error.file is None:
                return f"no file in {error}"
    seconds = time.process_time() - begin
    return f"{seconds:.1f} s" if seconds > SECONDS else None


def run_case(kind: str, number: int, folder: Path) -> str | None:
    """Run one case; what is wrong with it, or None."""
    random_ = random.Random(f"{kind} {number}")
    arguments = ["convert"]
    if kind in ("peer", "table"):
        path = folder / ("a.at2" if kind == "peer" else "a.csv")
        path.write_bytes(encoded(mutated(PEER if kind == "peer" else TABLE, random_), random_))
        if random_.random() < 0.8:  # without the picture, which takes a hundred times as long
            return read_alone(path, random_)
        arguments = ["record", str(path), "-o", str(folder / "out.png"), "--dpi", "20", *record_options(random_)]
    elif kind == "traces":
        (folder / "a.txt").write_bytes(encoded(mutated(TRACES, random_), random_))
        arguments.append(str(folder / "a.txt"))
    elif kind == "study":
        (folder / "template").mkdir(exist_ok=True)
        damaged_template = random_.random() < 0.5
        (folder / "template/a.df").write_text(mutated(TEMPLATE, random_) if damaged_template else TEMPLATE)
        (folder / "s.toml").write_text(STUDY if damaged_template else mutated(STUDY, random_), errors="replace")
        arguments = ["study", str(folder / "s.toml"), "--slurm"]
    elif kind == "ddaml":
        for name, text in zip(("a.geo", "a.ana"), ddaml_seeds(), strict=True):
            (folder / name).write_text(mutated(text, random_) if random_.random() < 0.7 else text)
            arguments.append(str(folder / name))
    else:
        seed = dxf_seed() if kind == "dxf" else geojson_seed()
        (folder / f"a.{kind}").write_text(mutated(seed, random_, kind == "dxf"))
        arguments.append(str(folder / f"a.{kind}"))
    if arguments[0] == "convert":
        arguments += ["-o", str(folder / "out"), "--force", "--template"]
    out, err = io.StringIO(), io.StringIO()
    begin = time.process_time()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        code = cli.main(arguments)
    seconds = time.process_time() - begin
    if code not in (0, cli.BAD_INPUT, *((cli.NO_OUTPUT,) if kind == "study" else ())):
        return f"exit code {code}: {err.getvalue()[-300:]}"
    if seconds > SECONDS:
        return f"{seconds:.1f} s"
    if len(err.getvalue()) > 1_000_000:
        return f"{len(err.getvalue())} characters of messages"
    return None


KINDS = ("dxf", "geojson", "ddaml", "study", "peer", "table", "traces")


def main() -> int:
    faults = 0
    count, first = (int(sys.argv[i]) if len(sys.argv) > i else d for i, d in ((1, 1000), (2, 0)))
    for kind in sys.argv[3:] or KINDS:
        bad = 0
        begin = time.monotonic()
        for number in range(first, first + count):
            with tempfile.TemporaryDirectory() as folder:
                found = run_case(kind, number, Path(folder))
            if found is not None:
                bad += 1
                faults += 1
                print(f"{kind} {number}: {found}", flush=True)
        size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{kind}: {count} cases, {bad} bad, {time.monotonic() - begin:.0f} s, {size:.0f} MB at most", flush=True)
        faults += size > MEGABYTES
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
