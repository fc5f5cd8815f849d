"""Keys of designs by their paths, such as ``region.box.size[0]``: whether there are such, and their units, by the schema."""

from __future__ import annotations

import difflib
import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any

from .. import _core

__all__ = ["listless", "missing", "nearest", "plain_of", "unit_of"]

#: Tables whose keys are names of the user's own.
NAMED = ("lattice", "beams", "keep", "set")
#: Names of units as they are written behind a number.
SHORT = {"degrees": "°"}


def unit_of(path: str) -> str:
    """The unit of a key, such as "mm"; nothing for what has none, or is no key."""
    unit, nodes = "", [_schema()]
    for step in _steps(path):
        if isinstance(step, str):
            unit = ""  # of a list it is that of its items
        nodes = [below for node in _all(nodes) for below in _below(node, step)]
        unit = next((node["x-unit"] for node in _all(nodes) if "x-unit" in node), unit)
    return SHORT.get(unit, unit) if nodes else ""


def missing(path: str, data: Mapping[str, Any]) -> str | None:
    """Why a path leads nowhere in a design of such data, where its schema has no such key or the design no such name."""
    table, _, rest = path.partition(".")
    name, below, _ = rest.partition(".")
    there = list(data.get(table) or ()) if table in NAMED else [name]
    if below and name not in there:
        if not there:
            return f"there is no {table}.{name}; the design has no {table}"
        near = there[0] if len(there) == 1 else next(iter(difflib.get_close_matches(name, there, 1)), None)
        hint = f"did you mean {table}.{near}? The" if near else "the"
        return f"there is no {table}.{name}; {hint} design has {', '.join(f'{table}.{it}' for it in there)}"
    nodes, own = [_schema()], {"sweep"}  # a sweep has none
    for step in _steps(path):
        found = [inner for node in _all(nodes) for inner in _below(node, step)]
        known = dict.fromkeys(key for node in _all(nodes) for key in node.get("properties", ()) if key not in own)
        if not found and isinstance(step, str) and known:
            return f'unknown key "{step}"; {nearest(step, known)}'
        if not found:
            return None
        nodes, own = found, set()
    return None


def listless(path: str, data: Any) -> str | None:
    """Which key of an item that varies, such as the last one of ``offset[0]``, is no list in the design."""
    above = ""
    for step in _steps(path):
        if isinstance(step, int):
            if not isinstance(data, list):
                found = "it is not there" if data is None else f"found {json.dumps(data):.40}"
                return f"[{step}] is an item of a list, and {above} is none in the design ({found}); write it there as a list"
            data = data[step] if step < len(data) else None
            above += f"[{step}]"
        else:
            data = data.get(step) if isinstance(data, Mapping) else None
            above += f".{step}" if above else step
    return None


def nearest(word: str, known: Iterable[str]) -> str:
    """What else may be meant by a misspelt word, in words."""
    listed = list(known)
    near = difflib.get_close_matches(word, listed, 1)
    return (f'did you mean "{near[0]}"? There are ' if near else "there are ") + ", ".join(listed)


def plain_of(text: str, is_json: bool) -> dict[str, Any] | None:
    """What a text of a design says, as plain data; None where it cannot be read here."""
    try:
        if is_json:
            return json.loads(text)
        if sys.version_info < (3, 11):
            return None
        import tomllib

        return tomllib.loads(text)
    except ValueError:
        return None


@cache
def _schema() -> dict[str, Any]:
    return json.loads(_core.schema())


def _steps(path: str) -> list[str | int]:
    """Keys and numbers of items, from the outermost one."""
    return [int(number) if number else key for key, number in re.findall(r"([^.\[\]]+(?![^\[]*\]))|\[(\d+)\]", path)]


def _all(nodes: Iterable[dict]) -> Iterator[dict]:
    """Schemas, and those that they name or choose from."""
    for node in nodes:
        yield node
        if "$ref" in node:
            yield from _all([_schema()["$defs"][node["$ref"].rpartition("/")[2]]])
        for word in ("anyOf", "oneOf", "allOf"):
            yield from _all(node.get(word, ()))


def _below(node: dict, step: str | int) -> Iterator[dict]:
    """The schemas of a key or an item of what a schema describes."""
    of = node.get("items") if isinstance(step, int) else node.get("properties", {}).get(step, node.get("additionalProperties"))
    if isinstance(of, dict):
        yield of
