"""What is wrong with the keys of a sweep and their values: in which line of a design file, and what is allowed."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from ..errors import DesignError
from .keys import listless, missing

__all__ = ["check_values", "explained", "overlapping"]

#: What stands for no number in TOML, JSON and Python.
NO_NUMBER = re.compile(r"(?<![\w.\"'])[+-]?(?:nan|inf|null|NaN|Infinity)(?![\w.\"'])")


def check_values(sweep: Mapping[str, Any], text: str = "", name: str = "") -> None:
    """Refuses what is no value in a sweep: NaN and the like in a list, a number of values where the sampling takes none, and
    paths of which one lies in another; with the line of the ``text`` that it was read from, of the file ``name``.
    """
    if both := overlapping(sweep):
        raise _error(
            f"sweep.{both[1]}", f"it lies in {both[0]}, which varies too; vary one of them", _line_of(both[1], text), name
        )
    for path, of in sweep.items():
        line = _line_of(path, text)
        if isinstance(of, Mapping):
            if sweep.get("sampling", "grid") != "grid" and of.get("count") is not None and "from" in of:
                message = (
                    f'count = {of["count"]} is of a grid, and sampling is "{sweep["sampling"]}": leave it out; the number of '
                    "designs is the sweep's own count"
                )
                raise _error(f"sweep.{path}", message, line, name)
        elif isinstance(of, list):
            for i, value in enumerate(of):
                for found in _no_numbers(value):
                    if text:  # which of them it is has been lost in the data
                        line, found = next(_no_numbers_in(text, line or 1), (line, found))
                    message = f"value {i + 1} is {found}, which no key can have; give a finite number, or leave it out"
                    raise _error(f"sweep.{path}", message, line, name)


def overlapping(paths: Iterable[str]) -> tuple[str, str] | None:
    """Two of the paths of which the second lies in the first; None where there are none."""
    known = list(paths)
    return next(((outer, inner) for inner in known for outer in known if inner.startswith((f"{outer}.", f"{outer}["))), None)


def explained(error: DesignError, data: Mapping[str, Any] | None, name: str = "") -> DesignError:
    """An error in a sweep's key; where the path leads nowhere in the design, of these data, with what is there instead."""
    path = error.path.removeprefix("sweep.")
    if data is None or "unknown " in error.message or not _varies(path, data.get("sweep")):
        return error
    why = missing(path, data) or (listless(path, data) if "needs a list above it" in error.message else None)
    return _error(error.path, why, error.line, name) if why else error


def _varies(path: str, sweep: Any) -> bool:
    """Whether a sweep has values for this path, whose keys may be tables in one another."""
    if not isinstance(sweep, Mapping):
        return False
    inner = any(path.startswith(f"{key}.") and _varies(path[len(key) + 1 :], below) for key, below in sweep.items())
    return inner or isinstance(sweep.get(path), list) or (isinstance(sweep.get(path), Mapping) and "from" in sweep[path])


def _error(path: str, message: str, line: int | None, name: str) -> DesignError:
    before = ":".join(str(part) for part in (name, line) if part)
    return DesignError(f"{before}: {path}: {message}" if before else f"{path}: {message}", path, line, message)


def _no_numbers(value: Any) -> Iterator[str]:
    """What is no value in one: None, which is what JSON has for NaN, and numbers that are not finite."""
    if isinstance(value, list):
        for item in value:
            yield from _no_numbers(item)
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _no_numbers(item)
    elif value is None or (isinstance(value, float) and not math.isfinite(value)):
        yield str(value)


def _no_numbers_in(text: str, first: int) -> Iterator[tuple[int, str]]:
    """Lines of a text, from the ``first`` on, and what they have that is no number."""
    for n, line in enumerate(text.splitlines()[first - 1 :], first):
        for found in NO_NUMBER.finditer(line):
            yield n, found[0]


def _line_of(path: str, text: str) -> int | None:
    """The line of a text in which a sweep has this path: the first one after its head with the path, or its last key."""
    lines = text.splitlines()
    head = next((n for n, line in enumerate(lines) if re.match(r'\s*[\[{"]*\s*sweep\b', line)), 0)
    for word in (path, path.rpartition(".")[2]):
        for n in range(head, len(lines)):
            if word in lines[n]:
                return n + 1
    return None
