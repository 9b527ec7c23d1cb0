# SPDX-License-Identifier: MIT
"""The campaign: all kinds, chunks of draws by several workers, what is left of a run that was killed, and the table."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import subprocess
import tomllib
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from . import bolting, collisions, elastic, joint_law, masonry, motion, readers, relations, rooms, silence, sliding
from .bench import ROOT
from .drawing import Kind, Values, draw, judge, shrink

FAMILIES = (motion, joint_law, sliding, masonry, collisions, elastic, rooms, relations, readers, silence, bolting)
KINDS: dict[str, Kind] = {kind.name: kind for module in FAMILIES for kind in module.KINDS}
#: draws of one chunk: what is lost when a run is killed
CHUNK = 25
KNOWN = Path(__file__).parent / "known"
#: faults that were kept, and do not happen any more
MENDED = Path(__file__).parent / "mended"
PAGE = ROOT / "docs" / "notes" / "campaign.md"
BEGIN, END = "<!-- table (made by scripts/campaign --page) -->", "<!-- end of the table -->"


def is_there(kind: Kind) -> bool:
    """The oracle of a kind may need a package."""
    return all(importlib.util.find_spec(name) is not None for name in kind.needs.split())


@dataclass(frozen=True)
class Row:
    """A chunk that is done."""

    kind: str
    chunk: int
    tried: int
    failed: int
    first: int  #: draw of the first fault, from 1; 0: none
    seconds: float
    values: Values | None  #: of the first fault
    fault: str
    count: int = 0  #: draws that were asked for; other draws come of another number, so that it is drawn anew for more


def _chunk(name: str, chunk: int, count: int, program: Path) -> Row:
    drawn = draw(KINDS[name], count, chunk, program)
    suited = [verdict for verdict in drawn.verdicts if verdict.suited]
    failed = drawn.failed
    at_fault = suited[failed[0] - 1] if failed else None
    return Row(
        name,
        chunk,
        drawn.tried,
        len(failed),
        failed[0] if failed else 0,
        round(drawn.seconds, 1),
        at_fault.values if at_fault else None,
        at_fault.fault if at_fault else "",
        count,
    )


class State:
    """Chunks that are done with one program, a line each: a run that was killed goes on after the last whole line."""

    def __init__(self, program: Path, folder: Path) -> None:
        digest = hashlib.sha256(program.read_bytes()).hexdigest()[:12]
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / f"{digest}.jsonl"
        self.rows: list[Row] = []
        if self.path.exists():
            for line in self.path.read_text(encoding="utf-8").splitlines(keepends=True):
                if line.endswith("\n"):
                    self._replace(Row(**json.loads(line)))
            self.path.write_text("".join(_line(row) for row in self.rows), encoding="utf-8")

    def _replace(self, row: Row) -> None:
        self.rows = [other for other in self.rows if (other.kind, other.chunk) != (row.kind, row.chunk)] + [row]

    def add(self, row: Row) -> None:
        self._replace(row)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(_line(row))

    def of(self, kind: str) -> list[Row]:
        return sorted((row for row in self.rows if row.kind == kind), key=lambda row: row.chunk)

    def first(self, kind: str) -> tuple[int, Row] | None:
        """Draws that the first fault took, and its chunk."""
        before = 0
        for row in self.of(kind):
            if row.failed:
                return before + row.first, row
            before += row.tried
        return None


def _line(row: Row) -> str:
    return json.dumps(asdict(row), ensure_ascii=False) + "\n"


def campaign(
    names: Iterable[str], count: int, program: Path, state: State, workers: int, tell: Callable[[str], None] = print
) -> None:
    """Draw so many models of each kind; chunks of which as many are done already are not drawn again."""
    done = {(row.kind, row.chunk): row.count for row in state.rows}
    sizes = [min(CHUNK, count - first) for first in range(0, count, CHUNK)]
    # kinds take turns, so that a run that is stopped has tried all of them
    jobs = [(name, k, size) for k, size in enumerate(sizes) for name in names if done.get((name, k), 0) < size]
    with ProcessPoolExecutor(workers) as pool:
        waiting = [pool.submit(_chunk, name, k, size, program) for name, k, size in jobs]
        try:
            for future in as_completed(waiting):
                row = future.result()
                state.add(row)
                words = f"{row.kind} {row.chunk}: {row.failed} of {row.tried} failed, {row.seconds:.1f} s"
                tell(words + (f"; draw {row.first}: {row.fault}" if row.failed else ""))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


# -- faults that are kept --------------------------------------------------------------------------------------------


def keep(kind: Kind, count: int, chunk: int, program: Path, folder: Path) -> Path | None:
    """Shrink the first fault of a chunk and write it: KIND.toml, and beside it the files of the model."""
    found = shrink(kind, count, chunk, program)
    if found is None:
        return None
    verdict, draws = found
    judge(kind, verdict.values, program, folder / kind.name)
    for place in [folder / kind.name, *(folder / kind.name).iterdir()]:
        if place.is_dir():
            for path in place.iterdir():
                if path.suffix not in (".nml", ".blk", ".dc", ".dl", ".csv", ".dxf", ".geojson"):
                    path.unlink() if path.is_file() else None
    path = folder / f"{kind.name}.toml"
    path.write_text(
        f"# {kind.known or 'does not hold'}\n"
        f"kind = {_text(kind.name)}\n"
        f"oracle = {_text(kind.truth)}\n"
        f"found = {_text(verdict.fault)}\n"
        f"draws = {draws}  # until the first fault, from seed {chunk}\n"
        f"program = {_text(version_of(program))}\n\n"
        "[drawn]\n" + "".join(f"{name} = {_value(value)}\n" for name, value in verdict.values.items()),
        encoding="utf-8",
    )
    return path


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _value(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else json.dumps(value, ensure_ascii=False)


def version_of(program: Path) -> str:
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    return (done.stdout.splitlines() or ["unknown"])[0]


def read_kept(path: Path) -> tuple[Kind, Values]:
    text = tomllib.loads(path.read_text(encoding="utf-8"))
    return KINDS[text["kind"]], dict(text["drawn"])


def again(path: Path, program: Path, folder: Path | None = None) -> str:
    """Judge a fault that was kept; what is wrong, empty where it holds."""
    kind, drawn = read_kept(path)
    return judge(kind, drawn, program, folder).fault


# -- the table -------------------------------------------------------------------------------------------------------


def table(state: State) -> str:
    """Kinds, how many were tried and failed, and what is known of those that do not hold."""
    rows = ["| family | kind | oracle | tried | failed | first after | |", "|---|---|---|---|---|---|---|"]
    tried = failed = 0
    for kind in sorted(KINDS.values(), key=lambda kind: (kind.family, kind.name)):
        done = state.of(kind.name)
        here, bad = sum(row.tried for row in done), sum(row.failed for row in done)
        first = state.first(kind.name)
        words = kind.known or ("" if not bad else "**not known**: " + " ".join(first[1].fault.split()) if first else "")
        rows.append(
            f"| {kind.family} | `{kind.name}` | {kind.truth} | {here} | {bad} | {first[0] if first else ''} | {words} |"
        )
        tried, failed = tried + here, failed + bad
    rows.append(f"| | | all | {tried} | {failed} | | |")
    return "\n".join(rows) + "\n"


def write_page(state: State, program: Path) -> None:
    """Put the table into its page."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    words = f"\n{version_of(program)}\n\n"
    PAGE.write_text(before + BEGIN + words + table(state) + END + after, encoding="utf-8")
