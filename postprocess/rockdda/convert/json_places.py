# SPDX-License-Identifier: MIT
"""Lines and columns of values in JSON text."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any

TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{},:]|[^\s\[\]{},:"]+')
JsonPath = tuple[str | int, ...]


def places_of(text: str, paths: Iterable[JsonPath]) -> dict[JsonPath, tuple[int, int]]:
    """Line and column, from 1, of the values at paths such as ('features', 3, 'geometry').

    One pass over the text, however many paths there are.
    """
    wanted: dict[Any, Any] = {}  # a tree of keys and indices; None holds the path that ends there
    for path in paths:
        node = wanted
        for part in path:
            node = node.setdefault(part, {})
        node[None] = path
    found: dict[JsonPath, tuple[int, int]] = {}
    left = len(set(paths))
    line, counted = 1, 0  # of the last place found
    stack: list[list[Any]] = []  # [is it a list, key or index, node of the tree]
    expect_key = False
    for match in TOKEN.finditer(text):
        if not left:
            break
        token = match.group()
        if token in "}]":
            stack.pop()
            expect_key = False
        elif token == ",":
            if stack[-1][0]:
                stack[-1][1] += 1
            expect_key = not stack[-1][0]
        elif token == ":":
            expect_key = False
        elif expect_key:
            stack[-1][1] = json.loads(token)
        else:
            node = stack[-1][2].get(stack[-1][1], _NOTHING) if stack else wanted
            if None in node and node[None] not in found:
                line += text.count("\n", counted, match.start())
                counted = match.start()
                found[node[None]] = (line, counted - text.rfind("\n", 0, counted))
                left -= 1
            if token in "{[":
                stack.append([token == "[", 0 if token == "[" else None, node])
                expect_key = token == "{"
    return found


_NOTHING: dict[Any, Any] = {}
