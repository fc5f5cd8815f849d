"""Figures of the named cells, computed from their series, and the lines in which the command lists cells."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .. import _core
from ..base.terminal import figure
from ..base.texts import counted, intervals

__all__ = ["cell_facts", "cell_words", "tet_cell_words", "unit_cell_words"]


def cell_facts(name: str) -> dict[str, Any]:
    """A named cell: ``name``, ``title``, ``formula``, space ``group``, ``range`` of its values, ``source``, and
    ``connected_fraction``: for each part the intervals of the solid fraction in which the periodic solid is one connected
    component.

    Raises KeyError for the name of no cell.
    """
    it = {c.name: c for c in _core.cells()}[name]
    span, parts = _core.cell_facts(name)
    whole = {part: [list(w) for w in found] for part, found in parts}
    facts = {"name": name, "title": it.title, "formula": it.formula, "group": it.group, "range": list(span)}
    return facts | {"connected_fraction": whole, "source": it.source}


def cell_words(it: dict) -> Iterator[str]:
    """A periodic cell."""
    yield f"f       {it['formula']}"
    yield f"group   {it['group']}"
    yield f"range   {it['range'][0]:.6g} to {it['range'][1]:.6g}"
    for part, whole in it["connected_fraction"].items():
        yield f"{part:7} in one piece at fractions {intervals(whole) or 'never'}"
    yield f"source  {it['source']}"


def tet_cell_words(it: dict) -> Iterator[str]:
    """A tetrahedral cell."""
    terms = (f"{t['amplitude']:g} {t['component'].title()} ({' '.join(str(h) for h in t['hkl'])})" for t in it["terms"])
    yield f"series  group {it['group']}: {', '.join(terms)}"
    dual, site = ", dual" if it["dual"] else "", " ".join(f"{v:g}" for v in it["site"])
    yield f"tetrahedron of edge {it['edge']:.4f} cells about {site}{dual}"
    yield f"part    {it['part']} at fraction {it['fraction']:g} (iso {it['iso']:.4f})"
    yield f"faces   {counted(it['ports'], 'port')} on each, {100 * it['face_fraction']:.1f} % of it"
    for part, whole in it["connected_fraction"].items():
        yield f"{part:7} in one piece that reaches all faces at fractions {intervals(whole) or 'never'}"


def unit_cell_words(it: dict) -> Iterator[str]:
    """A unit cell of beams."""
    yield f"group    {it['group']}"
    yield f"cell     {len(it['nodes'])} nodes, {len(it['struts'])} beams of {figure(it['length'])} edges in all"
    yield f"valence  {', '.join(f'{n} of {v}' for v, n in it['valence'].items())}"
    yield f"Maxwell  {it['maxwell']:+d}"
    if it["aspect"] != [1.0, 1.0, 1.0]:
        yield f"edges    in the ratio {' : '.join(figure(v) for v in it['aspect'])} for its usual shape"
