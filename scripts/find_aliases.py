# SPDX-License-Identifier: MIT
"""Calls that pass a part of an array that the callee moves: `call add(list, list%item(k))`, `add` enlarging `list`.

Such an argument refers to memory that is free as soon as the array has moved. Each path (`self%list%item`) that a
procedure may move is found: by move_alloc, deallocate, an assignment to an allocatable as a whole, intent(out), or a
call to a procedure that moves it. At a call none of these paths may begin the path of another argument, unless that
one is passed by value or is an expression (a copy), and no name of an enclosing `associate` may stand for it.

Follows what fortran_source.py follows: no pointers, no generic names.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from fortran_source import Procedure, Source

Names = tuple[str, ...]


def balanced(text: str, start: int) -> int:
    """Position behind the parenthesis that closes the one at `start`."""
    level = 0
    for i in range(start, len(text)):
        level += {"(": 1, ")": -1}.get(text[i], 0)
        if level == 0:
            return i + 1
    return len(text)


def split_arguments(text: str) -> list[str]:
    """Parts between the commas that stand in no parenthesis or bracket."""
    parts, level, start = [], 0, 0
    for i, c in enumerate(text):
        level += {"(": 1, "[": 1, ")": -1, "]": -1}.get(c, 0)
        if c == "," and level == 0:
            parts.append(text[start:i])
            start = i + 1
    return [part.strip() for part in [*parts, text[start:]] if part.strip()]


def designator(text: str) -> Names | None:
    """Names of a variable, element or component, `a(i)%b(j)` as (a, b); None for what is no such thing."""
    names, i, text = [], 0, text.strip()
    while match := re.match(r"\s*([a-z]\w*)\s*", text[i:]):
        names.append(match[1])
        i += match.end()
        while text[i : i + 1] == "(":
            i = balanced(text, i)
            i += len(text[i:]) - len(text[i:].lstrip())
        if i == len(text):
            return tuple(names)
        if text[i] != "%":
            return None
        i += 1
    return None


def references(statement: str) -> Iterator[tuple[Names, list[str]]]:
    """Everything with arguments in a statement, names and arguments: calls, functions, and elements alike."""
    for match in re.finditer(r"(?<![\w%])(?<!% )[a-z]\w*", statement):
        names, i = [match[0]], match.end()
        while True:
            arguments: list[str] | None = None
            opening = re.match(r"\s*\(", statement[i:])
            if opening:
                end = balanced(statement, i + opening.end() - 1)
                arguments = split_arguments(statement[i + opening.end() : end - 1])
                i = end
            follow = re.match(r"\s*%\s*([a-z]\w*)", statement[i:])
            if not follow:
                break
            names.append(follow[1])
            i += follow.end()
        if arguments is not None or re.search(r"\bcall\s+$", statement[: match.start()]):
            yield tuple(names), arguments or []


class Moves:
    """What each procedure may move."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.procedures = [p for module in source.modules.values() for p in module.procedures.values()]
        self.declared = {id(p): declarations(p) for p in self.procedures}
        self.moved: dict[int, set[Names]] = {id(p): set(self._own_moves(p)) for p in self.procedures}
        self.calls = {id(p): list(self._calls(p)) for p in self.procedures}
        changed = True
        while changed:
            changed = False
            for p in self.procedures:
                mine = self.moved[id(p)]
                before = len(mine)
                for _, pairs, callee, _ in self.calls[id(p)]:
                    mine.update(m for m in self.moved_by(callee, pairs) if self._lasts(p, m))
                changed = changed or len(mine) > before

    def _lasts(self, procedure: Procedure, path: Names) -> bool:
        """Does a path belong to an argument or to the host, not to a variable of the procedure?"""
        return path[0] in procedure.arguments or path[0] not in self.declared[id(procedure)]

    def _own_moves(self, p: Procedure) -> Iterator[Names]:
        declared = self.declared[id(p)]
        for name in p.arguments:
            attributes = declared.get(name, "")
            if "intent(out)" in attributes:
                if "allocatable" in attributes:
                    yield (name,)
                else:
                    for path in self._allocatables(p.variables.get(name, "")):
                        yield (name, *path)
        for _, statement in self._statements(p):
            found: list[str] = []
            for names, arguments in references(statement) if re.search("move_alloc|deallocate", statement) else ():
                if names == ("move_alloc",) or names == ("deallocate",):
                    found += arguments
            if match := re.match(r"(?:if\s*\(.*\)\s*)?([a-z][\w%() ,:+*-]*?)\s*=(?![=>])", statement):
                path = designator(match[1])
                if path and match[1].rstrip().endswith(path[-1]) and self._is_allocatable(p, path):
                    found.append(match[1])
            for text in found:
                path = designator(text)
                if path and self._lasts(p, path):
                    yield path

    def _is_allocatable(self, p: Procedure, path: Names) -> bool:
        if len(path) == 1:
            return "allocatable" in self.declared[id(p)].get(path[0], "")
        kind = p.variables.get(path[0], "")
        for name in path[1:-1]:
            kind = self.source._component(kind, name)
        while kind in self.source.types:
            if path[-1] in self.source.types[kind].allocatable:
                return True
            kind = self.source.types[kind].parent
        return False

    def _allocatables(self, kind: str) -> Iterator[Names]:
        """Allocatable components of a type, of its parents and of its components."""
        while kind in self.source.types:
            derived = self.source.types[kind]
            for name in sorted(derived.allocatable):
                yield (name,)
            for name, inner in derived.components.items():
                if name not in derived.allocatable:
                    yield from ((name, *path) for path in self._allocatables(inner))
            kind = derived.parent

    @staticmethod
    def _statements(p: Procedure) -> Iterator[tuple[dict[str, Names], str]]:
        """Names of `associate` and what they stand for around each statement; the statement with that in place."""
        blocks: list[dict[str, Names]] = []
        for statement in p.statements:
            if re.match(r"end\s*associate", statement):
                blocks.pop()
                continue
            names: dict[str, Names] = {k: v for block in blocks for k, v in block.items()}
            if match := re.match(r"associate\s*\(", statement):
                block = {}
                for item in split_arguments(statement[match.end() : balanced(statement, match.end() - 1) - 1]):
                    name, _, target = item.partition("=>")
                    path = designator(target)
                    if path:
                        path = (*names.get(path[0], path[:1]), *path[1:])
                        block[name.strip()] = path
                blocks.append(block)
                continue
            if "::" in statement:
                continue
            text = re.sub(
                r"(?<![\w%])(?<!% )[a-z]\w*",
                lambda m, names=names: "%".join(names[m[0]]) if m[0] in names else m[0],
                statement,
            )
            yield names, text

    def _calls(self, p: Procedure) -> Iterator[tuple[str, list[tuple[str, str]], Procedure, dict[str, Names]]]:
        """Statement, (dummy, actual argument) pairs, and callee of each call."""
        for names, statement in self._statements(p):
            for path, arguments in references(statement):
                for callee in self.source.resolve(p, path):
                    actuals = list(arguments)
                    if len(path) > 1:
                        actuals.insert(0, "%".join(path[:-1]))
                    pairs = []
                    for i, text in enumerate(actuals):
                        keyword = re.match(r"([a-z]\w*)\s*=(?!=)\s*(.*)", text)
                        if keyword:
                            pairs.append((keyword[1], keyword[2]))
                        elif i < len(callee.arguments):
                            pairs.append((callee.arguments[i], text))
                    yield statement, pairs, callee, names

    def moved_by(self, callee: Procedure, pairs: list[tuple[str, str]]) -> set[Names]:
        """Paths of the caller that a call moves."""
        actual = dict(pairs)
        found = set()
        for path in self.moved[id(callee)]:
            if path[0] in callee.arguments:
                root = designator(actual.get(path[0], ""))
                if root:
                    found.add((*root, *path[1:]))
            else:
                found.add(path)  # of the host
        return found

    def faults(self) -> Iterator[str]:
        """Every call that hands over, or keeps a name for, what it moves."""
        for p in self.procedures:
            for statement, pairs, callee, names in self.calls[id(p)]:
                declared = self.declared[id(callee)]
                for moved in sorted(self.moved_by(callee, pairs)):
                    for dummy, text in pairs:
                        path = designator(text)
                        if path is None or path[: len(moved)] != moved or "value" in declared.get(dummy, ""):
                            continue
                        if any(m[0] == dummy and (*path, *m[1:]) == moved for m in self.moved[id(callee)]):
                            continue  # the argument that moves
                        path_moved = "%".join(moved)
                        yield f"{p.file}: {p.name}: `{statement}` passes {text}; {callee.name} moves {path_moved}"
                    for name, path in names.items():
                        if path[: len(moved)] == moved:
                            yield f"{p.file}: {p.name}: `{statement}` moves what {name} => {'%'.join(path)} stands for"


def declarations(p: Procedure) -> dict[str, str]:
    """Attributes of each argument and variable."""
    found = {}
    for statement in p.statements:
        left, colons, right = statement.partition("::")
        if not colons or not re.match(r"(type|class|integer|real|logical|character|complex|procedure)\b", left):
            continue
        for item in split_arguments(right):
            if match := re.match(r"[a-z]\w*", item):
                found[match[0]] = re.sub(r"\s", "", left)
    return found


def find_faults(root: Path, folder: str = "src") -> list[str]:
    """The faults of all sources below a folder."""
    return sorted(set(Moves(Source(root / folder, root)).faults()))


if __name__ == "__main__":
    faults = find_faults(Path(__file__).resolve().parents[1])
    print("\n".join(faults))
    sys.exit(1 if faults else 0)
