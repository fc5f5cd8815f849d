"""Cells: functions on the torus. ``cell.gyroid()`` and its kin are named surfaces; ``series`` is your own.

>>> from trabecula import cell
>>> cell.gyroid()
'gyroid'
>>> cell.series([cell.term([1, 0, 0]), cell.term([0, 1, 0]), cell.term([0, 0, 1])])["series"]["terms"][0]
{'hkl': [1, 0, 0]}
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence

from .base import memory
from .base.given import named, plain, settings

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from .base.given import Vector
    from .base.names import CellName, Component, TetName

__all__ = ["file", "group", "names", "series", "term", "tet", "tet_facts", "tet_names"]


def names() -> list[CellName]:
    """The names of the ready cells; each is a function of this module."""
    from . import _core

    return [c.name for c in _core.cells()]


@named
def term(hkl: Sequence[int] | NDArray, amplitude: float = 1.0, phase: float = 0.0, component: Component = "re") -> dict:
    """One plane wave, amplitude · cos 2π(h·u + phase): whole numbers hkl, phase in turns; a sine if ``component="im"``.

    In a series with a group it is the real or imaginary part of amplitude · e^{2πi phase} Σ e^{2πi h·(R u + t)}, the sum
    over the group's operations, divided by its largest Fourier coefficient.
    """
    made: dict = {"hkl": plain(hkl)}
    if amplitude != 1.0:
        made["amplitude"] = amplitude
    if phase != 0.0:
        made["phase"] = phase
    if component != "re":
        made["component"] = component
    return made


@named
def series(terms: Iterable[dict], group: int | str | None = None) -> dict:
    """A cell as the sum of its terms; with ``group``, each of them summed over that space group.

    ``group``: the number (227), the Hermann–Mauguin symbol (``"Fd-3m"``), either with a setting (``"227:1"``; origin choice
    2 unless given), or the Hall symbol (``"-F 4vw 2vw 3"``). Designs refuse a wave that the group's centring, screws or
    glides extinguish.
    """
    made: dict = {"terms": list(terms)}
    if group is not None:
        made["group"] = plain(group)
    return {"series": made}


@named
def file(
    path: str | os.PathLike[str] | ArrayLike,
    terms: int | None = None,
    threshold: float | None = None,
    step: float | Vector | None = None,
    period: float | Vector | None = None,
) -> dict:
    """A cell from a file: numbers over one period (npy), grey pictures one above the other (png, tif; "scan/*.png" or the
    folder "scan/"), or a mesh of the solid in one period; its largest ``terms`` waves. Or the numbers themselves, an array.

    Of a mesh the function is the signed periodic distance, positive inside and in edges of the cell, so ``part="upper"`` with
    ``iso`` 0 is the solid itself, but for what the waves leave out: ``truncation`` in a solid's report. ``period`` (mm, one
    or three) is that of a mesh smaller than it, about its middle.

    With ``threshold`` numbers above it are solid, and the function is their signed periodic distance too, numbers being
    ``step`` (mm, one or three) apart; without it the function is the numbers.
    """
    more = settings(terms=terms, threshold=threshold, step=step, period=period)
    return {"file": {"path": memory.path_of(path, memory.grid), **more}}


def tet_names() -> list[TetName]:
    """The names of the ready tetrahedral cells."""
    from . import _core

    return _core.tet_cells()


def tet_facts(name: str) -> dict:
    """What is known of a ready tetrahedral cell: ``terms``, ``site``, ``edge``, ``dual``; the ``part`` and ``fraction`` it is
    made for, its ``ports`` on each face there; and the fractions at which each part is one piece that reaches all faces."""
    import json

    from . import _core

    return json.loads(_core.tet_cell_facts(name))


@named
def tet(
    name: TetName | None = None,
    *,
    group: int | str | None = None,
    terms: Iterable[dict] | None = None,
    site: Vector | None = None,
    dual: bool | None = None,
    edge: float | None = None,
    zones: Mapping[int, str] | Mapping[str, str] | None = None,
) -> dict:
    """A tetrahedral cell, for ``map.tets``: a ready one by its name, your own, or a ready one for each of the mesh's ``zones``,
    by their numbers or their names in the mesh's file.

    Your own is what a regular tetrahedron of ``edge`` (in edges of the cubic cell) about ``site`` (turns) cuts out of the sum
    of ``terms`` over ``group``, which must have full tetrahedral symmetry there; ``dual`` turns the tetrahedron upside down.
    """
    given = settings(name=name, group=group, site=site, dual=dual, edge=edge, zones=zones)
    if terms is not None:
        given["terms"] = list(terms)
    return {"tet": given}


def group(symbol: int | str) -> dict:
    """A space group: ``number`` (None for a Hall symbol in a setting of one's own), ``name``, and ``operations``, pairs of a
    rotation R (3×3) and a translation t, u ↦ R u + t with u in turns and t as fractions; centring included.

    Symbols as in ``series``; what is no group raises a ``DesignError``.
    """
    from fractions import Fraction

    from . import _core

    number, name, operations = _core.group(str(plain(symbol)))
    parts = [(r, [Fraction(v, 24) for v in t]) for r, t in operations]
    return {"number": number, "name": name, "operations": parts}


def __getattr__(name: str) -> Callable[[], CellName]:
    known = [] if name.startswith("_") else names()
    if name not in known:
        from difflib import get_close_matches

        near = get_close_matches(name, known, 1)
        hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"
        raise AttributeError(f"trabecula.cell has no cell {name}{hint if known else ''}")

    ready = known[known.index(name)]

    def make() -> CellName:
        return ready

    make.__name__ = make.__qualname__ = name
    make.__module__ = __name__
    make.__doc__ = f"The named cell {name}."
    globals()[name] = make
    return make


def __dir__() -> list[str]:
    return sorted([*__all__, *names()])
