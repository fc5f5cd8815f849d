"""Transitions between the lattices of a blend: how well they hold together, and how much is solid in them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

from . import _core
from .files import extension, whole_file

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .reports import TransitionReport

__all__ = ["Transitions"]


class Transitions(Sequence):
    """The transitions of a blend, each a ``reports.TransitionReport``. Made by ``Solid.transitions``."""

    def __init__(self, found: list[TransitionReport]):
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    def __getitem__(self, index):
        return self._found[index]

    def __iter__(self) -> Iterator[TransitionReport]:
        return iter(self._found)

    def __repr__(self) -> str:
        return f"<trabecula.Transitions {', '.join(' to '.join(t.between) for t in self) or 'none'}>"

    def png(self) -> bytes:
        """The fraction found along each transition as bars, what was asked for as a line across each: a PNG file's bytes."""
        drawn = []
        for it in self:
            rows = it.fractions
            first, second = it.between
            half = 0.5 / 10  # rows are tenths
            edges, found, asked, at = [0.0], [], [], 0.0
            for row in rows:
                low = row.share - half
                if low > at + half:  # tenths without sample points
                    edges.append(low)
                    found.append(0.0)
                    asked.append(0.0)
                at = row.share + half
                edges.append(at)
                found.append(row.found)
                asked.append(row.asked or 0.0)
            worst = off(it)
            words = "found" if worst is None else f"found, line: asked for, off by {worst:+.3f} at most"
            neck = f"neck {it.neck.diameter:.3g} mm" if it.neck else "not connected"
            loose, dangling = it.loose.bodies, it.dangling.bodies
            title = f"share of {second} against {first}. solid fraction {words}"
            drawn.append((title, edges, found, asked, [(f"{neck}, {loose} loose, {dangling} dangling; half at", 0.5)]))
        return _core.charts(drawn, 960, 480 * len(drawn))

    def _repr_png_(self) -> bytes | None:
        return self.png() if self._found else None

    def render(self, path: str | os.PathLike[str]) -> None:
        """Writes the fractions along the transitions to a .png file."""
        extension(path, ("png",))
        if not self._found:
            raise ValueError("there is no transition: the design has no blend, or one lattice alone counts everywhere")
        with whole_file(path) as temporary, open(temporary, "wb") as out:
            out.write(self.png())


def off(transition: TransitionReport) -> float | None:
    """The greatest difference between the fraction found and the one asked for; None where that is not known."""
    each = [r.found - r.asked for r in transition.fractions if r.asked is not None]
    return max(each, key=abs, default=None)
