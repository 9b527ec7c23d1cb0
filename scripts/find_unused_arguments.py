# SPDX-License-Identifier: MIT
"""Dummy arguments that a procedure never mentions.

A compiler's warning has no exception for procedures whose arguments are given by a type: those that a type binds and
its parent or an extension binds, too. They may leave out what they do not need.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from fortran_source import Source

PROCEDURE = re.compile(
    r"^   (?:[\w()=*, ]+ )?(?:subroutine|function) (\w+)\((.*?)\)(.*?)^   end (?:subroutine|function) \1$", re.M | re.S
)
DECLARATION = re.compile(r"^ *(?:type|class|real|integer|logical|character|procedure)\b[^\n]*?::", re.M)


def given_names(source: Source) -> set[tuple[str, str]]:
    """Module and name of procedures behind bindings that more than one type has, or an abstract one."""
    found = set()
    for derived in source.types.values():
        family = [derived, *source.extensions(derived.name)]
        for name in derived.bindings:
            sharing = [kind for kind in family if name in kind.bindings]
            if len(sharing) > 1 or derived.is_abstract:
                found |= {(kind.module, kind.bindings[name]) for kind in sharing}
    return found


def find_unused(root: Path) -> Iterator[str]:
    source = Source(root / "src", root)
    given = given_names(source)
    for module in source.modules.values():
        text = (root / module.file).read_text(encoding="utf-8")
        text = re.sub(r"&\n *&?", " ", re.sub(r" *!(?!\$).*", "", text)).partition("\ncontains\n")[2]
        for name, arguments, body in PROCEDURE.findall(text):
            code = DECLARATION.sub("", body)
            for argument in re.findall(r"\w+", arguments):
                is_made = re.search(rf"intent\(out\)[^\n]*::[^\n]*\b{argument}\b", body)
                if len(re.findall(rf"\b{argument}\b", code)) < 2 and not is_made and (module.name, name) not in given:
                    yield f"{module.file}: {name} does not use {argument}"


if __name__ == "__main__":
    faults = list(find_unused(Path(__file__).resolve().parents[1]))
    print(*faults, sep="\n", end="\n" * bool(faults))
    sys.exit(bool(faults))
