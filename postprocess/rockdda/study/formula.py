# SPDX-License-Identifier: MIT
"""Formulas and formats in the placeholders of a template, with bounds on time and memory."""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

Value = int | float | str | bool

LONGEST_FORMULA = 1000  # characters
DEEPEST_FORMULA = 50  # operations within operations
LARGEST_BITS = 1024  # of a whole number; that of the largest float
LARGEST_DIGITS = 300  # of round(x, digits)

CONSTANTS = {"pi": math.pi}
_FORMAT = re.compile(r"(?:.?[<>=^])?[-+ ]?z?#?0?\d{0,3}[_,]?(?:\.\d{1,2})?[bdeEfFgGnosxX%]?")


def _round(number: Any, digits: Any = None) -> Any:
    if digits is not None and abs(digits) > LARGEST_DIGITS:
        raise ValueError(f"round: at most {LARGEST_DIGITS} digits")
    return round(number, digits)


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "atan": math.atan, "radians": math.radians,
    "degrees": math.degrees, "abs": abs, "min": min, "max": max, "round": _round,
}  # fmt: skip
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip


def parse_formula(formula: str) -> ast.Expression:
    """The syntax tree; ValueError for text that is no formula, or is too long or nested too deeply."""
    if len(formula) > LONGEST_FORMULA:
        raise ValueError(f"the formula has {len(formula)} characters; at most {LONGEST_FORMULA} are allowed")
    try:
        tree = ast.parse(formula, mode="eval")
    except (SyntaxError, ValueError):
        raise ValueError("expected a parameter or a formula") from None
    except (RecursionError, MemoryError):
        raise ValueError("the formula is nested too deeply") from None
    level: list[ast.AST] = [tree.body]
    for _ in range(DEEPEST_FORMULA):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return tree
    raise ValueError("the formula is nested too deeply")


def names_in(formula: str) -> Iterator[str]:
    """The parameters that a formula uses."""
    tree = parse_formula(formula)
    called = {node.func for node in ast.walk(tree) if isinstance(node, ast.Call)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node not in called and node.id not in CONSTANTS:
            yield node.id


def evaluate(expression: str, values: Mapping[str, Value]) -> Any:
    """A formula of parameters: numbers, + - * / // % **, parentheses, pi and a few functions; nothing else."""

    def visit(node: ast.AST) -> Any:
        found = compute(node)
        if isinstance(found, complex):
            raise ValueError("the result is no real number")
        if isinstance(found, int) and found.bit_length() > LARGEST_BITS:
            raise ValueError("the number is too large")
        if isinstance(found, float) and not math.isfinite(found):
            raise ValueError("the result is no finite number")
        return found

    def compute(node: ast.AST) -> Any:
        match node:
            case ast.Constant(value=int() | float() as value):
                return value
            case ast.Name(id=name) if name in values:
                return values[name]
            case ast.Name(id=name) if name in CONSTANTS:
                return CONSTANTS[name]
            case ast.Name(id=name):
                raise ValueError(f"'{name}' is not known")
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -visit(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return visit(operand)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                a, b = visit(left), visit(right)
                if isinstance(a, str) or isinstance(b, str):
                    raise ValueError("texts cannot be computed with")
                if isinstance(op, ast.Pow):
                    if abs(b) > 1000:
                        raise ValueError(f"the exponent {b:g} is too large")
                    if isinstance(a, int) and a.bit_length() * b > 2 * LARGEST_BITS:  # before it is computed
                        raise ValueError("the number is too large")
                return _OPERATORS[type(op)](a, b)
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
                return FUNCTIONS[name](*map(visit, arguments))
        raise ValueError("expected a parameter or a formula")

    return visit(parse_formula(expression).body)


def formatted(value: Value, form: str) -> str:
    """A value in a format such as .3f; ValueError for a format with a width above 999 or more than 99 digits."""
    if not _FORMAT.fullmatch(form):
        raise ValueError(f"{form[:40]!r} is no format such as .3f, 8.2e or 05d")
    return format(value, form)
