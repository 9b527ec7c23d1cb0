# SPDX-License-Identifier: MIT
"""Damaged input for the readers and converters of `rockdda-post` and for studies: each ends soon, as done or bad input.

    python postprocess/tests/fuzz_convert.py [COUNT [FIRST [KIND...]]]

runs COUNT cases (1000) of each kind, or of those named, from the number FIRST (0) and prints faults;
`test_convert_fuzz.py` runs some. The exit code is 1 where there is a fault. A crash ends the program: the last lines
name the case.
"""

from __future__ import annotations

import contextlib
import io
import json
import random
import resource
import sqlite3
import struct
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import ezdxf

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import rockdda
from places import EXTENSION
from rockdda import cli, records

if EXTENSION.is_dir() and str(EXTENSION) not in rockdda.__path__:
    rockdda.__path__.append(str(EXTENSION))

MEGABYTES = 500  # of this process, with all that it has imported
SECONDS = 20.0  # of processor time; the slowest case of some thousands takes below 2 s
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


def gpkg_seed() -> bytes:
    """A GeoPackage of lines, polygons with holes and points, without an index; made by SQLite alone."""
    with contextlib.closing(sqlite3.connect(":memory:")) as file:
        file.executescript(TABLES)
        for fid, shape in enumerate(shapes_of_map(), start=1):
            cell = b"GP\0\1" + struct.pack("<i", 32633) + shape
            file.execute("insert into traces values (?, ?, 'joint', 1, 'x')", (fid, cell))
        file.commit()
        return file.serialize()


TABLES = """\
pragma page_size = 512;
create table gpkg_spatial_ref_sys (srs_name text, srs_id integer primary key, organization text,
    organization_coordsys_id integer, definition text, description text);
create table gpkg_contents (table_name text primary key, data_type text, identifier text, srs_id integer);
create table gpkg_geometry_columns (table_name text, column_name text, geometry_type_name text, srs_id integer,
    z tinyint, m tinyint);
create table traces (fid integer primary key, geom blob, kind text, material integer, note text);
insert into gpkg_spatial_ref_sys values ('UTM', 32633, 'EPSG', 32633,
    'PROJCS["x",GEOGCS["y",UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],UNIT["metre",1]]', '');
insert into gpkg_contents values ('traces', 'features', 'traces', 32633);
insert into gpkg_geometry_columns values ('traces', 'geom', 'GEOMETRY', 32633, 0, 0);
"""
COUNTING = "with recursive t(x) as (select 1 union all select x + 1 from t) select"
COMPUTED = (
    "drop table traces; create table traces (fid integer, geom blob as (zeroblob({size})) virtual, {more}); {rows}"
)
ROWS = "insert into traces(fid) values (1), (2), (3), (4), (5), (6), (7), (8), (9)"
SQL = (  # what a file may ask of SQLite
    "alter table traces rename to old; create view traces as select * from traces",
    f"alter table traces rename to old; create view traces as {COUNTING} x as fid, zeroblob(1) as geom from t",
    COMPUTED.format(size=999999999, more="x", rows=ROWS),
    COMPUTED.format(size=900000, more="x as (zeroblob(900000)) virtual", rows=ROWS),
    "update gpkg_geometry_columns set column_name = 'nowhere'",
    "update gpkg_geometry_columns set column_name = 'note'",
    "update gpkg_contents set table_name = null",
    "update gpkg_contents set table_name = 'sqlite_master'; "
    "update gpkg_geometry_columns set table_name = 'sqlite_master'",
    'update gpkg_spatial_ref_sys set definition = \'PROJCS["x",UNIT["y",1e999]]\'',
    "update gpkg_spatial_ref_sys set definition = 'GEOGCS[' || hex(zeroblob(50000))",
    "update traces set material = 9e18, kind = x'00ff'",
    "update traces set geom = zeroblob(100000)",
    "update traces set geom = x'4750'",
    "update traces set geom = 'text'",
    "update traces set geom = 3.5",
    "delete from gpkg_geometry_columns",
    "drop table gpkg_spatial_ref_sys",
    "drop table gpkg_contents; create view gpkg_contents as select * from gpkg_contents",
    f"drop table gpkg_contents; create view gpkg_contents as {COUNTING} 'traces' as table_name, 'features' as "
    "data_type, x from t",
    "alter table traces rename column note to geom2; alter table traces add column GEOMETRY text",
)


def shapes_of_map() -> list[bytes]:
    """Shapes in well-known binary, of all kinds."""
    ring = [(0, 0), (4, 0), (4, 3), (0, 3), (0, 0)]
    hole = [(1, 1), (1, 2), (2, 2), (1, 1)]

    def points(rows: list[tuple[int, int]]) -> bytes:
        return struct.pack("<I", len(rows)) + b"".join(struct.pack("<dd", *row) for row in rows)

    line = b"\1" + struct.pack("<I", 2) + points([(-1, 1), (5, 1)])
    polygon = b"\1" + struct.pack("<II", 3, 2) + points(ring) + points(hole)
    point = b"\1" + struct.pack("<Idd", 1, 0.5, 0.5)
    several = b"\1" + struct.pack("<II", 5, 2) + line + line
    nested = b"\1" + struct.pack("<II", 7, 3) + line + polygon + several
    high = b"\1" + struct.pack("<II6d", 1002, 2, 0, 0, 0, 1, 2, 3)
    big_ends = b"\0" + struct.pack(">II4d", 2, 2, 0, 0, 3, 3)
    return [line, polygon, point, several, nested, high, big_ends]


def shp_seed(folder: Path) -> dict[str, bytes]:
    """The files of a Shapefile of lines."""
    import shapefile

    with shapefile.Writer(str(folder / "seed")) as file:
        file.field("kind", "C", 10)
        file.field("material", "N", 5)
        file.line([[[-1, 1], [5, 1]], [[1, -1], [1, 4]]])
        file.record("joint", 1)
        file.line([[[2, -1], [2, 4]]])
        file.record("boundary", 2)
    found = {ending: (folder / f"seed{ending}").read_bytes() for ending in (".shp", ".shx", ".dbf")}
    return found | {".prj": PRJ.encode()}


PRJ = (
    'COMPD_CS["z",PROJCS["x",GEOGCS["y",DATUM["d",SPHEROID["s",6378137,298.25]],PRIMEM["Greenwich",0],'
    'UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["scale_factor",0.9996],'
    'UNIT["US survey foot",0.3048006096012192]],VERT_CS["v",UNIT["metre",1]]]'
)


def compas_seed() -> str:
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    vertex = {str(i): dict(zip("xyz", corner, strict=True)) for i, corner in enumerate(corners)}
    mesh = {"dtype": "compas.datastructures/Mesh", "data": {"vertex": vertex, "face": dict(enumerate(faces))}}
    polygon = {"dtype": "compas.geometry/Polygon", "data": {"points": [[2, 0, 0], [3, 0, 0], [3, 0, 1]]}}
    nodes = {"0": {"block": mesh, "is_support": True}, "1": {"block": polygon}}
    edge = {"0": {"1": {"interfaces": [{"dtype": "x/Interface", "data": {"points": [[1, 0, 0]], "mesh": mesh}}]}}}
    return json.dumps({"dtype": "x/Assembly", "data": {"graph": {"data": {"node": nodes, "edge": edge}}}})


def damaged_bytes(data: bytes, random_: random.Random) -> bytes:
    """Bytes with one to six faults: bits, extreme numbers of any size and order, pieces cut out or doubled, a cut."""
    found = bytearray(data)
    for _ in range(random_.randint(1, 6)):
        at = (
            random_.randrange(len(found) + 1) if random_.random() < 0.7 else random_.randrange(min(len(found), 200) + 1)
        )
        choice = random_.randrange(6)
        if choice == 0 and at < len(found):
            found[at] ^= 1 << random_.randrange(8)
        elif choice == 1:
            number = random_.choice([0, 1, -1, 2**31 - 1, -(2**31), 50, 10**6, 2**20])
            found[at : at + 4] = struct.pack(random_.choice("<>") + "i", number)
        elif choice == 2:
            value = random_.choice([0.0, float("nan"), float("inf"), -1e308, 1e-320, 1e29, 1e15])
            found[at : at + 8] = struct.pack(random_.choice("<>") + "d", value)
        elif choice == 3:
            del found[at : at + random_.choice([1, 4, 8, 100])]
        elif choice == 4:
            found[at:at] = found[at : at + random_.choice([1, 8, 100])] * random_.choice([1, 2, 1000])
        else:
            found[at:] = b"" if random_.random() < 0.2 else found[at:]
    return bytes(found)


def write_gpkg(path: Path, random_: random.Random) -> None:
    """A damaged GeoPackage: its tables by SQL, its cells or its pages by bytes."""
    data = gpkg_seed()
    choice = random_.randrange(3)
    if choice == 2:
        path.write_bytes(damaged_bytes(data, random_))
        return
    path.write_bytes(data)
    with contextlib.closing(sqlite3.connect(path)) as file, contextlib.suppress(sqlite3.Error):
        file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 2_000_000)
        file.execute("pragma synchronous = off")
        if choice == 0:
            for _ in range(random_.randint(1, 2)):
                file.executescript(random_.choice(SQL))
        for fid, cell in file.execute("select rowid, geom from traces limit 100").fetchall():
            if isinstance(cell, bytes) and random_.random() < 0.5:
                head = cell[:8] if random_.random() < 0.8 else b""
                new = head + damaged_bytes(cell[len(head) :], random_)
                file.execute("update traces set geom = ? where rowid = ?", (new, fid))
        file.commit()


def changed(data: Any, random_: random.Random) -> Any:
    """JSON with one to three values replaced by others: wrong types, extreme numbers, empty lists, parts of it."""
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        for key, value in node.items() if isinstance(node, dict) else enumerate(node):
            places.append((node, key))
            if isinstance(value, dict | list):
                walk(value)

    for _ in range(random_.randint(1, 3)):
        places.clear()
        walk(data)
        if not places:
            return data
        node, key = random_.choice(places)
        other, name = random_.choice(places)
        values = [None, True, "", "x", [], {}, [[]], 0, -1, 1e308, 1e29, 1e-320, float("nan"), float("inf"), 10**39,
                  json.loads(json.dumps(other[name])), [json.loads(json.dumps(other[name]))] * 3]  # fmt: skip
        if random_.random() < 0.15:
            del node[key]
        else:
            node[key] = random_.choice(values)
    return data


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
    elif kind == "gpkg":
        write_gpkg(folder / "a.gpkg", random_)
        arguments.append(str(folder / "a.gpkg"))
    elif kind == "shp":
        for ending, data in shp_seed(folder).items():
            if random_.random() < 0.5:
                is_text = ending == ".prj"
                new = mutated(data.decode(), random_).encode() if is_text else damaged_bytes(data, random_)
                (folder / f"a{ending}").write_bytes(new)
            elif random_.random() < 0.95:
                (folder / f"a{ending}").write_bytes(data)
        (folder / "a.shp").touch()
        arguments.append(str(folder / "a.shp"))
    else:
        seed = {"dxf": dxf_seed, "geojson": geojson_seed, "compas": compas_seed}[kind]()
        path = folder / ("a.json" if kind == "compas" else f"a.{kind}")
        if kind in ("geojson", "compas") and random_.random() < 0.6:
            path.write_text(json.dumps(changed(json.loads(seed), random_)))
        else:
            path.write_text(mutated(seed, random_, kind == "dxf"))
        arguments.append(str(path))
        arguments += ["--blocks"] * (kind in ("dxf", "geojson") and random_.random() < 0.3)
    if arguments[0] == "convert":
        arguments += ["-o", str(folder / "out"), "--force", "--template"]
    out, err = io.StringIO(), io.StringIO()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begin = time.process_time()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        code = cli.main(arguments)
    seconds = time.process_time() - begin
    if code not in (0, cli.BAD_INPUT, *((cli.NO_OUTPUT,) if kind == "study" else ())):
        return f"exit code {code}: {err.getvalue()[-300:]}"
    if seconds > SECONDS:
        return f"{seconds:.1f} s"
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    megabytes = most / 1024
    if most > before and megabytes > MEGABYTES:  # the case that is the first to need them
        return f"{megabytes:.0f} MB"
    if len(err.getvalue()) > 1_000_000:
        return f"{len(err.getvalue())} characters of messages"
    return None


KINDS = ("dxf", "geojson", "gpkg", "shp", "compas", "traces", "ddaml", "study", "peer", "table")


def main() -> int:
    faults = 0
    count, first = (int(sys.argv[i]) if len(sys.argv) > i else d for i, d in ((1, 1000), (2, 0)))
    for kind in sys.argv[3:] or KINDS:
        bad = 0
        begin = time.monotonic()
        for number in range(first, first + count):
            with tempfile.TemporaryDirectory() as folder:
                found = run_case(kind, number, Path(folder))
            if number % 100 == 0:
                print(f"{kind} {number} ...", end="\r", flush=True)
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
