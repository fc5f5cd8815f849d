"""Figures of the named cells, computed from their series."""

from __future__ import annotations

from typing import Any

from . import _core

__all__ = ["cell_facts"]


def cell_facts(name: str) -> dict[str, Any]:
    """A named cell: ``name``, ``title``, ``formula``, space ``group``, ``range`` of its values, ``source``, and
    ``connected_fraction``: for each part the intervals of the solid fraction in which the periodic solid is one connected
    component.

    Raises KeyError for the name of no cell.
    """
    known = {c[0]: c for c in _core.cells()}
    name, title, formula, group, source = known[name]
    span, parts = _core.cell_facts(name)
    whole = {part: [list(w) for w in intervals] for part, intervals in parts}
    facts = {"name": name, "title": title, "formula": formula, "group": group, "range": list(span)}
    return facts | {"connected_fraction": whole, "source": source}
