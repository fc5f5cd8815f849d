"""Conditions on numbers that have names with dots: comparisons of sums, products and a few functions, no other Python."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["condition"]

COMPARISONS = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge}
COMPARISONS |= {ast.Eq: operator.eq, ast.NotEq: operator.ne}
ARITHMETIC = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
ARITHMETIC |= {ast.Pow: math.pow, ast.Mod: operator.mod}
FUNCTIONS: dict[str, Callable[..., float]] = {"min": min, "max": max, "abs": abs}
FUNCTIONS |= {"sqrt": math.sqrt, "log": math.log, "exp": math.exp}
WORDS = "numbers, names, + - * / ** %, comparisons, and, or, not, " + ", ".join(FUNCTIONS)


def condition(text: str) -> Callable[[Mapping[str, Any]], bool]:
    """A function of values by name that says whether they keep the condition.

    Raises ValueError for a text that is no condition; the function does for a name without a value, and for numbers on which it
    is not defined.
    """
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f'"{text}" is no condition; it has {WORDS}') from None

    def holds(values: Mapping[str, Any]) -> bool:
        try:
            return bool(_value(tree, values, text))
        except (ArithmeticError, TypeError, IndexError) as error:
            raise ValueError(f'"{text}" has no value: {error}') from None

    return holds


def _value(node: ast.expr, values: Mapping[str, Any], text: str) -> Any:
    def of(inner: ast.expr) -> Any:
        return _value(inner, values, text)

    match node:
        case ast.Constant(value=bool() | int() | float() | str() as value):
            return value
        case ast.Name() | ast.Attribute() | ast.Subscript():
            name = ast.unparse(node)
            if name not in values:
                known = ", ".join(values)
                raise ValueError(f'"{text}" names {name}, which is no key of the design with one value; that vary: {known}')
            return values[name]
        case ast.BinOp(left, op, right) if type(op) in ARITHMETIC:
            return ARITHMETIC[type(op)](of(left), of(right))
        case ast.UnaryOp(ast.USub(), inner):
            return -of(inner)
        case ast.UnaryOp(ast.Not(), inner):
            return not of(inner)
        case ast.BoolOp(op, parts):
            return (all if isinstance(op, ast.And) else any)(of(part) for part in parts)
        case ast.Compare(left, ops, rights) if all(type(op) in COMPARISONS for op in ops):
            terms = [of(term) for term in (left, *rights)]
            return all(COMPARISONS[type(op)](a, b) for op, a, b in zip(ops, terms, terms[1:], strict=False))
        case ast.Call(ast.Name(name), arguments, []) if name in FUNCTIONS:
            return FUNCTIONS[name](*map(of, arguments))
    raise ValueError(f'"{text}": {ast.unparse(node)} cannot stand in a condition; it has {WORDS}')
