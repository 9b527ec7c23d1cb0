# SPDX-License-Identifier: MIT
"""Any model as the template of a study: one labelled file with placeholders, beside the files that it names."""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..groups import as_list
from ..labelled import labelled_text
from ..model import Model, as_files
from ..namelist import parse_groups
from ..options import names_that_add_up, option_rows, options_schema
from ..program import errors_in, find_program
from ..study import Study
from ..text import PathLike, decoded, has_controls
from ..writing import make_folder, write_file

Groups = dict[str, list[dict[str, Any]]]


@dataclass(frozen=True)
class Source:
    """A model as it is before anything is varied."""

    name: str  #: of the results: the stem of its labelled or analysis file
    title: str
    units: str
    groups: Groups  #: of its labelled file
    facts: Mapping[str, Any]  #: what `rockdda check` finds: numbers of blocks and points, automatic numbers; elements
    files: tuple[Path, ...]  #: those that the groups name
    statistics: Path | None  #: of the joint sets that its lines are drawn from; None: they are given
    digest: str  #: of the texts of its files


class Placeholders:
    """Marks in the values of groups that become placeholders of the template."""

    def __init__(self) -> None:
        self._formulas: list[str] = []

    def mark(self, formula: str) -> str:
        """A value that is written as the placeholder of a formula."""
        self._formulas.append(formula)
        return f"@{len(self._formulas) - 1}@"

    def text(self, groups: Mapping[str, Any]) -> str:
        """The labelled file of some groups with its placeholders."""
        return re.sub(r"'@(\d+)@'", lambda found: f"{{{{{self._formulas[int(found[1])]}}}}}", labelled_text(groups))


@contextlib.contextmanager
def read_source(
    model: PathLike | Model, analysis: PathLike | None = None, config: PathLike | None = None
) -> Iterator[Source]:
    """Read a model with the program; InputError where it cannot be run.

    model: a labelled file, a folder, a geometry or block file (then with `analysis`), or a `Model`. The files of a
    `Model` are there as long as the block lasts."""
    with as_files(model, analysis, config) as (files, _):
        told = json.loads(_call("check", *files, "--json"))
        text = _call("check", *files, "--as-namelist")
        found = groups_of(text)
        facts = told.get("model", {}) | {"elements": dict(_elements(told))}
        kinds = {str(one["kind"]): Path(str(one["file"])) for one in told.get("files", [])}
        labelled = next((path for kind, path in kinds.items() if "labelled" in kind), None)
        control = labelled or next((path for kind, path in kinds.items() if "analysis" in kind), None)
        geometry = Path(str(found["model"][0]["geometry"]))
        statistics = geometry.with_suffix(".dl")
        options = [path for kind, path in kinds.items() if "option" in kind]
        legacy = [control] if control and control != labelled else []
        yield Source(
            name=(control or geometry).stem,
            title=str(facts.get("title", "")) or (control or geometry).stem,
            units=str(found["model"][0].get("units", "SI")),
            groups=found,
            facts=facts,
            files=tuple(_named_files(found)),
            statistics=statistics if statistics.is_file() else None,
            digest=digest_of_texts(*(
                "\n".join(decoded(path.read_bytes()) for path in paths)
                for paths in ([geometry], legacy, [labelled] if labelled else options)
            )),
        )  # fmt: skip


def _elements(told: Mapping[str, Any]) -> Iterator[tuple[tuple[str, int], float]]:
    """Largest distances of nodes along bolts and linings, by the name and the number of their group."""
    for bolt in told.get("bolts", []):
        if bolt["element"]:
            yield ("bolt", bolt["group"]), bolt["element"]
    for number, liner in enumerate(told.get("liners", []), start=1):
        if liner["element"]:
            yield ("liner", number), liner["element"]


def groups_of(text: str) -> Groups:
    """The groups of a labelled file, a list for each kind."""
    return {name: as_list(entries) for name, entries in parse_groups(text, names_that_add_up()).items()}


def digest_of_texts(geometry: str, analysis: str, config: str) -> str:
    """A digest of the input of a run, of its texts without blanks at their ends."""
    whole = "\0".join(decoded(text.encode("utf-8", "surrogateescape")).strip() for text in (geometry, analysis, config))
    return hashlib.sha256(whole.encode("utf-8", "surrogateescape")).hexdigest()


def _call(*arguments: str) -> str:
    """Standard output of the program; InputError with what it says of wrong input."""
    done = subprocess.run(
        [find_program(), *arguments], capture_output=True, text=True, encoding="utf-8", errors="surrogateescape"
    )
    if done.returncode:
        if problems := errors_in(done.stdout):
            first = problems[0]
            raise InputError("\n".join(one.message for one in problems), first.file, first.line, first.column)
        raise InputError(done.stderr.strip().removeprefix("rockdda: error: ") or f"exit code {done.returncode}")
    return done.stdout


def _named_files(groups: Groups) -> Iterator[Path]:
    """The files that groups name."""
    for group, entries in groups.items():
        if group in options_schema()["$defs"]:
            names = [name for name, row in option_rows(group).items() if row.get("x-file")]
        else:
            names = []
        if group == "model":
            names = ["geometry", "analysis"]
        for entry in entries:
            yield from (Path(str(entry[name])) for name in names if name in entry)


def write_study(
    source: Source, folder: Path, template: str, cases: Sequence[Mapping[str, Any]], *, title: str,
    command: str = "run", options: Sequence[str] = (), constants: Mapping[str, Any] | None = None,
    statistics: str | None = None,
) -> Path:  # fmt: skip
    """Write a study into a folder: `study.toml`, and `template` with a labelled file and what that names.

    constants: values that cases need not give. statistics: the text of a statistics file from which each case draws its
    lines. Returns the path of the study."""
    make_folder(folder)
    place = folder / "template"
    make_folder(place)
    names: dict[Path, str] = {}
    for path in source.files:
        names[path] = path.name
        while list(names.values()).count(names[path]) > 1:
            names[path] = f"_{names[path]}"
    for path in place.iterdir():
        if path.is_file() and path.name not in names.values():
            path.unlink()
    for path, name in names.items():
        if statistics is not None and path == source.files[0]:
            continue  # it is drawn
        write_file(place / name, path.read_bytes())
    for path, name in names.items():
        template = template.replace(f"'{path}'", f"'{name}'")
    write_file(place / f"{source.name}.nml", template)
    if statistics is not None:
        write_file(place / Path(names[source.files[0]]).with_suffix(".dl"), statistics)
    lines = [f"title = {_toml(title)}", 'template = "template"', 'output = "runs"', ""]
    lines += ["[run]", f"command = {_toml(command)}", f"options = {_toml(list(options))}"]
    if constants:
        lines += ["", "[constants]", *(f"{_toml(name)} = {_toml(value)}" for name, value in constants.items())]
    for case in cases:
        lines += ["", "[[cases]]", *(f"{_toml(name)} = {_toml(value)}" for name, value in case.items())]
    write_file(folder / "study.toml", "\n".join(lines) + "\n")
    return folder / "study.toml"


def remove_others(study: Study) -> None:
    """Remove the folders of cases that the study had before it was changed."""
    names = {case.name for case in study.cases}
    for path in (study.output / "cases").glob("[0-9][0-9][0-9][0-9]_*"):
        if path.name not in names and not path.is_symlink() and (path / "status.json").is_file():
            shutil.rmtree(path)


def _toml(value: Any) -> str:
    """A number, a text, or a list of them in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        if has_controls(value.replace("\n", "")):
            raise InputError(f"control characters are not allowed: {value!r}")
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(float(value)) if isinstance(value, float) else str(int(value))
