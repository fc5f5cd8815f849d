"""The files that a design names: in its plain data found, and given other paths."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from .. import _core
from .memory import InMemory

__all__ = ["data_of", "files_in", "in_memory_in", "moved"]

#: Keys whose text names a file.
PATHS = ("path", "nodes", "struts")


def data_of(text: str) -> dict[str, Any]:
    """The plain data of a design that is a text in TOML, as solids have it."""
    return json.loads(_core.Design.from_text(text).to_json())


def in_memory_in(data: Any) -> list[InMemory]:
    """The data in memory that plain data name."""
    return [name for name in files_in(data) if isinstance(name, InMemory)]


def files_in(data: Any) -> list[str]:
    """The files that plain data names: what stands under ``path``, or as a table of beams; in a sweep every value of it."""
    found: list[str] = []

    def noted(name: str) -> str:
        found.append(name)
        return name

    moved(data, noted)
    return found


def moved(data: Any, turn: Callable[[str], str]) -> Any:
    """The data with every relative path of a file turned: what stands under ``path``, or as a table of beams."""
    if isinstance(data, list):
        return [moved(item, turn) for item in data]
    if not isinstance(data, dict):
        return data
    out: dict[str, Any] = {}
    for key, item in data.items():
        # In a sweep a key is the path of one, and its values are a list.
        names = key.rpartition(".")[2] in PATHS
        if names and isinstance(item, str):
            out[key] = turn(item)
        elif names and isinstance(item, list):
            out[key] = [turn(one) if isinstance(one, str) else moved(one, turn) for one in item]
        else:
            out[key] = moved(item, turn)
    return out
