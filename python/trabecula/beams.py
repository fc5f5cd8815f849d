"""Unit cells of beams: the catalogue, for ``Beams(cell=…)``.

>>> from trabecula import beams
>>> beams.cell("octet")["valence"]
{12: 4}
"""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    import os
    from typing import Any

    from numpy.typing import NDArray

    from .base.names import BeamName

__all__ = ["cell", "cells", "names", "read"]


def names() -> list[BeamName]:
    """The names of the cells."""
    return [it["name"] for it in cells()]


def cells() -> list[dict[str, Any]]:
    """All cells, each with ``name``, ``title``, space ``group``, ``aspect`` (cell edges in whose ratio it has its usual
    shape), ``nodes`` (in cell edges), ``struts`` ({ends, shift}: two nodes, and the cell that the second lies in),
    ``valence`` ({struts: nodes}), ``maxwell`` (struts less three for each node) and ``length`` (of all struts, in edges).
    """
    from collections import Counter

    from . import _core

    made = []
    for c in _core.beam_cells():
        it: dict[str, Any] = {"name": c.name, "title": c.title, "group": c.group, "aspect": c.aspect, "nodes": c.nodes}
        it["struts"] = [{"ends": ends, "shift": shift} for ends, shift in zip(c.ends, c.shifts, strict=True)]
        it |= {"valence": dict(sorted(Counter(c.valences).items())), "maxwell": c.maxwell, "length": c.length}
        made.append(it)
    return made


def cell(name: str) -> dict[str, Any]:
    """One cell, as ``cells`` gives it."""
    known = {it["name"]: it for it in cells()}
    if name not in known:
        from difflib import get_close_matches

        near = get_close_matches(name, known, 1)
        hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"
        raise KeyError(f"no cell of beams is named {name}{hint}")
    return known[name]


def read(path: str | os.PathLike[str]) -> dict[str, NDArray]:
    """The graph in a file of another program: ``nodes`` (n, 3) and ``beams`` (m, 2), numbers of nodes; where the file has
    radii, ``radii`` (n,) of nodes and ``beam_radii`` (m, 2) of beams at their two ends, NaN where none is given. Lengths are mm
    if the file names its unit (3MF, most LTCX), else in the file's own. The suffix decides the format: 3mf, ltcx, csv, json,
    obj, vtu, vtk, inp, bdf, nas, txt.

    Raises OSError if it cannot be read, ValueError with line or element for what the format does not allow.
    """
    import os

    from . import _core
    from .base.files import extension
    from .base.formats import BEAM_READS

    kind = extension(path, BEAM_READS)
    try:
        nodes, radii, beams, beam_radii, _, _ = _core.read_graph(_core.read_file(os.fsdecode(path)), kind)
    except ValueError as error:
        raise ValueError(f"{os.fsdecode(path)}: {error}") from None
    found: dict[str, NDArray] = {"nodes": nodes, "beams": beams}
    more = {"radii": radii, "beam_radii": beam_radii}
    return found | {name: values for name, values in more.items() if values is not None}
