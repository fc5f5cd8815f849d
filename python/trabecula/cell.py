"""Cells: functions on the torus. ``cell.gyroid()`` and its kin are named surfaces; ``series`` is your own.

>>> from trabecula import cell
>>> cell.gyroid()
'gyroid'
>>> cell.series([cell.term([1, 0, 0]), cell.term([0, 1, 0]), cell.term([0, 0, 1])])["series"]["terms"][0]
{'hkl': [1, 0, 0]}
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches

from .given import plain

__all__ = ["names", "series", "term"]


def names() -> list[str]:
    """The names of the ready cells; each is a function of this module."""
    from . import _core

    return [c[0] for c in _core.cells()]


def term(hkl: Sequence[int], amplitude: float = 1.0, phase: float = 0.0, component: str = "re") -> dict:
    """One plane wave, amplitude · cos 2π(h·u + phase): whole numbers hkl, phase in turns; a sine if ``component="im"``."""
    made: dict = {"hkl": plain(hkl)}
    if amplitude != 1.0:
        made["amplitude"] = amplitude
    if phase != 0.0:
        made["phase"] = phase
    if component != "re":
        made["component"] = component
    return made


def series(terms: Iterable[dict]) -> dict:
    """A cell as the sum of its terms."""
    return {"series": {"terms": list(terms)}}


def __getattr__(name: str) -> Callable[[], str]:
    known = [] if name.startswith("_") else names()
    if name not in known:
        near = get_close_matches(name, known, 1)
        hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"
        raise AttributeError(f"trabecula.cell has no cell {name}{hint if known else ''}")

    def make() -> str:
        return name

    make.__name__ = make.__qualname__ = name
    make.__module__ = __name__
    make.__doc__ = f"The named cell {name}."
    globals()[name] = make
    return make


def __dir__() -> list[str]:
    return sorted([*__all__, *names()])
