# SPDX-License-Identifier: MIT
"""Modules, types, procedures and calls of Fortran sources in the style of this project (draw_architecture.py).

Not a compiler: `use ..., only`, type-bound procedures, components, `associate` with components and calls of module
procedures are followed; generic names, procedure pointers and interfaces are not.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Procedure:
    name: str
    module: str
    file: Path
    is_function: bool
    summary: str
    variables: dict[str, str] = field(default_factory=dict)  # name to type
    calls: list[tuple[str, ...]] = field(default_factory=list)  # a%b%c as (a, b, c), in the order of the source
    statements: list[str] = field(default_factory=list)
    arguments: list[str] = field(default_factory=list)  # names of the dummy arguments


@dataclass
class DerivedType:
    name: str
    parent: str
    components: dict[str, str] = field(default_factory=dict)
    bindings: dict[str, str] = field(default_factory=dict)  # name to procedure; "" where deferred
    deferred: dict[str, str] = field(default_factory=dict)  # name to abstract interface
    allocatable: set[str] = field(default_factory=set)  # components
    module: str = ""
    is_abstract: bool = False


@dataclass
class Module:
    name: str
    file: Path
    summary: str
    uses: list[str] = field(default_factory=list)
    imported: dict[str, str] = field(default_factory=dict)  # name to module
    procedures: dict[str, Procedure] = field(default_factory=dict)


def code_of(line: str) -> tuple[str, str]:
    """A line without its comment and with empty texts; the comment."""
    code, quote = [], ""
    for i, c in enumerate(line):
        if quote:
            if c == quote:
                quote = ""
                code.append(c)
            continue
        if c in "'\"":
            quote = c
        elif c == "!":
            return "".join(code), line[i:]
        code.append(c)
    return "".join(code), ""


def statements(text: str) -> Iterator[tuple[str, str]]:
    """Statements with continuation lines joined, each with the comment (`!>`) above it."""
    joined, comment = "", []
    for line in text.splitlines():
        code, note = code_of(line)
        code = code.strip()
        if not code:
            if note.startswith("!>"):
                comment.append(note[2:].strip())
            elif not note and not joined:
                comment = []
            continue
        joined = (joined + " " + code.lstrip("&").strip()).strip()
        if joined.endswith("&"):
            joined = joined[:-1].rstrip()
            continue
        yield joined, " ".join(comment).split("  ")[0]  # an empty line of the comment leaves two blanks
        joined, comment = "", []


def paths(statement: str) -> Iterator[tuple[str, ...]]:
    """All names a%b%c in a statement that are followed by a parenthesis or stand in a `call`."""
    for match in re.finditer(r"(?<![%\w])(?<!% )[a-z]\w*", statement):
        names, i = [match[0]], match.end()
        while True:
            before_parenthesis = i
            if statement[i : i + 1] == "(":
                level = 0
                for j in range(i, len(statement)):
                    level += {"(": 1, ")": -1}.get(statement[j], 0)
                    if level == 0:
                        break
                i = j + 1
            follow = re.match(r"\s*%\s*([a-z]\w*)", statement[i:])
            if not follow:
                break
            names.append(follow[1])
            i += follow.end()
        is_call = re.search(r"\bcall\s+$", statement[: match.start()])
        if is_call or statement[before_parenthesis : before_parenthesis + 1] == "(":
            yield tuple(names)


class Source:
    """All modules below a folder."""

    def __init__(self, folder: Path, root: Path) -> None:
        self.modules: dict[str, Module] = {}
        self.types: dict[str, DerivedType] = {}
        for file in sorted([*folder.rglob("*.f90"), *folder.rglob("*.F90")]):
            self._read(file.read_text(encoding="utf-8"), file.relative_to(root))

    def _read(self, text: str, file: Path) -> None:
        text = re.sub(r"^#.*$", "", text, flags=re.M)
        module: Module | None = None
        derived: DerivedType | None = None
        procedure: Procedure | None = None
        hosts: list[Procedure | None] = []  # of the present procedure
        for statement, comment in statements(text):
            lower = statement.lower()
            if match := re.fullmatch(r"(?:module|program)\s+(\w+)", lower):
                module = self.modules[match[1]] = Module(match[1], file, comment)
            elif module is None:
                continue
            elif match := re.match(r"use\s*(?:,\s*\w+\s*::)?\s*(\w+)(?:\s*,\s*only\s*:\s*(.*))?", lower):
                module.uses.append(match[1])
                for item in (match[2] or "").split(","):
                    module.imported[item.split("=>")[0].strip()] = match[1]
            elif derived is None and (match := re.match(r"type\b(?!\s*\()([^:]*)::\s*(\w+)$", lower)):
                parent = re.search(r"extends\s*\(\s*(\w+)", match[1])
                derived = DerivedType(match[2], parent[1] if parent else "", module=module.name)
                derived.is_abstract = "abstract" in match[1]
                self.types[match[2]] = derived
            elif re.match(r"end\s*type\b", lower):
                derived = None
            elif derived is not None:
                self._read_member(derived, lower)
            elif re.match(r"end\s*(subroutine|function)\b", lower):
                procedure = hosts.pop() if hosts else None
            elif match := re.match(r"(?:[\w()\s,=:*]*\s)?(subroutine|function)\s+(\w+)\s*(?:\(|$)", lower):
                is_function = match[1] == "function"
                hosts.append(procedure)
                procedure = Procedure(match[2], module.name, file, is_function, comment)
                procedure.variables.update(hosts[-1].variables if hosts[-1] else {})
                procedure.arguments = re.findall(r"\w+", lower[match.end() :].partition(")")[0])
                module.procedures[match[2]] = procedure
            elif procedure is not None:
                self._read_body(procedure, lower)

    @staticmethod
    def _read_member(derived: DerivedType, statement: str) -> None:
        left, _, right = statement.partition("::")
        if "allocatable" in left:
            derived.allocatable.update(re.findall(r"(?:^|,)\s*(\w+)", re.sub(r"\([^()]*\)", "", right)))
        if match := re.match(r"procedure\b([^:]*)::\s*(.*)", statement):
            for item in match[2].split(","):
                name, _, target = (part.strip() for part in item.partition("=>"))
                derived.bindings[name] = "" if "deferred" in match[1] else target or name
                if "deferred" in match[1]:
                    derived.deferred[name] = match[1].strip().lstrip("(").partition(")")[0]
        elif match := re.match(r"(?:type|class)\s*\(\s*(\w+)\s*\)[^:]*::\s*(.*)", statement):
            for name in re.findall(r"(?:^|,)\s*(\w+)", re.sub(r"\([^()]*\)", "", match[2])):
                derived.components[name] = match[1]

    @staticmethod
    def _read_body(procedure: Procedure, statement: str) -> None:
        procedure.statements.append(statement)
        if match := re.match(r"(?:type|class)\s*\(\s*(\w+)\s*\)[^:]*::\s*(.*)", statement):
            for name in re.findall(r"(?:^|,)\s*(\w+)", re.sub(r"\([^()]*\)", "", match[2])):
                procedure.variables[name] = match[1]
            return
        if statement.startswith("associate"):
            for name, path in re.findall(r"(\w+)\s*=>\s*([\w%]+)", statement):
                procedure.variables[name] = "=>" + path
        if "::" not in statement:
            procedure.calls.extend(paths(statement))

    def implementations(self, type_name: str, binding: str) -> list[Procedure]:
        """Procedures behind a binding: of the type or its nearest parent that has it, or their interface; then of its
        extensions."""
        found = []
        name = type_name
        while name in self.types:
            derived = self.types[name]
            if own := derived.bindings.get(binding) or derived.deferred.get(binding):
                found.append(self.modules[derived.module].procedures.get(own))
                break
            name = derived.parent
        for derived in self.extensions(type_name):
            if derived.bindings.get(binding):
                found.append(self.modules[derived.module].procedures.get(derived.bindings[binding]))
        return [p for p in found if p]

    def extensions(self, type_name: str) -> list[DerivedType]:
        """Types that extend a type, in the order of their files."""
        return [derived for derived in self.types.values() if self._extends(derived, type_name)]

    def is_default(self, procedure: Procedure) -> bool:
        """The procedure of an abstract type, for extensions without one of their own."""
        return any(
            derived.is_abstract
            and derived.module == procedure.module
            and procedure.name in (*derived.bindings.values(), *derived.deferred.values())
            for derived in self.types.values()
        )

    def _extends(self, derived: DerivedType, ancestor: str) -> bool:
        while derived.parent:
            if derived.parent == ancestor:
                return True
            if derived.parent not in self.types:
                return False
            derived = self.types[derived.parent]
        return False

    def _component(self, type_name: str, component: str) -> str:
        while type_name in self.types:
            derived = self.types[type_name]
            if component in derived.components:
                return derived.components[component]
            if component == derived.parent:
                return component
            type_name = derived.parent
        return ""

    def resolve(self, caller: Procedure, call: tuple[str, ...]) -> list[Procedure]:
        """The procedures that a call may reach; none for what is no procedure of these sources."""
        module = self.modules[caller.module]
        if len(call) == 1:
            if call[0] in caller.variables:
                return []
            if call[0] in module.procedures:
                return [module.procedures[call[0]]]
            return self._exported(module.imported.get(call[0], ""), call[0])
        type_name = caller.variables.get(call[0], "")
        if type_name.startswith("=>"):
            path = type_name[2:].split("%")
            type_name = caller.variables.get(path[0], "")
            for component in path[1:]:
                type_name = self._component(type_name, component)
        for component in call[1:-1]:
            type_name = self._component(type_name, component)
        return self.implementations(type_name, call[-1])

    def _exported(self, module: str, name: str) -> list[Procedure]:
        """A procedure that a module has or passes on."""
        while module in self.modules:
            if name in self.modules[module].procedures:
                return [self.modules[module].procedures[name]]
            module = self.modules[module].imported.get(name, "")
        return []

    def uses(self) -> Iterator[tuple[Module, Module]]:
        """Modules with the modules of these sources that they use."""
        for module in self.modules.values():
            for name in dict.fromkeys(module.uses):
                if name in self.modules:
                    yield module, self.modules[name]

    def find_statement(self, procedure: str, part: str) -> tuple[str, str, str] | None:
        """File, procedure and text of the first statement that contains `part`; procedure "*" stands for all."""
        for module in self.modules.values():
            for name, owner in module.procedures.items():
                for text in owner.statements if procedure in ("*", name) else ():
                    if part in text:
                        return module.file.as_posix(), name, re.sub(r"\s+", " ", text)
        return None
