"""Transitions between the lattices of a blend: how well they hold together, and how much is solid in them."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence

from .base.files import extension, write_svg
from .base.texts import off

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any, overload

    from .reports import TransitionReport

__all__ = ["Transitions"]


class Transitions(Sequence["TransitionReport"]):
    """The transitions of a blend, each a ``reports.TransitionReport``. Made by ``Solid.transitions``."""

    def __init__(self, found: list[TransitionReport]):
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    if TYPE_CHECKING:

        @overload
        def __getitem__(self, index: int) -> TransitionReport: ...
        @overload
        def __getitem__(self, index: slice) -> list[TransitionReport]: ...

    def __getitem__(self, index: Any) -> Any:
        return self._found[index]

    def __iter__(self) -> Iterator[TransitionReport]:
        return iter(self._found)

    def __repr__(self) -> str:
        return f"<trabecula.Transitions {', '.join(' to '.join(t.between) for t in self) or 'none'}>"

    @property
    def warnings(self) -> list[dict[str, str]]:
        """The transitions that no solid leads across, each with ``path`` and ``message``, like ``Solid.warnings``."""
        return [{"path": "blend", "message": _torn(it, it.gap)} for it in self if it.gap]

    def svg(self) -> str:
        """The fraction found along each transition as bars, what was asked for as a line across each: an SVG file's text."""
        from .pictures.chart import Chart, svg

        return svg([Chart(**_chart(it)) for it in self])

    def _repr_svg_(self) -> str | None:
        return self.svg() if self._found else None

    def render(self, path: str | os.PathLike[str]) -> None:
        """Writes the fractions along the transitions to a .svg file."""
        extension(path, ("svg",))
        if not self._found:
            raise ValueError("there is no transition: the design has no blend, or one lattice alone counts everywhere")
        write_svg(path, self.svg)


def _torn(it: TransitionReport, gap: list[float]) -> str:
    first, second = it.between
    place = ", ".join(f"{x:.4g}" for x in gap)
    return (
        f'no solid leads from "{first}" to "{second}" on a grid of {it.step:.3g} mm: that of "{first}" ends at ({place}) mm; '
        f"give one of them another `offset` in its map, widen the transition, or raise the fraction"
    )


def _chart(it: TransitionReport) -> dict:
    first, second = it.between
    half = 0.5 / 10  # rows are tenths
    edges, found, asked = [0.0], [], []
    for row in it.fractions:
        if row.share - half > edges[-1] + half:  # tenths without sample points
            edges.append(row.share - half)
            found.append(0.0)
            asked.append(math.nan)
        edges.append(row.share + half)
        found.append(row.found)
        asked.append(math.nan if row.asked is None else row.asked)
    worst = off(it)
    error = "" if worst is None else f"line: asked for, off by {worst:+.3f} at most; "
    neck = f"neck {it.neck.diameter:.3g} mm" if it.neck else "not connected"
    return {
        "title": f"Transition from {first} to {second}",
        "facts": f"{error}{neck}, {it.loose.bodies} loose, {it.dangling.bodies} dangling",
        "across": f"share of {second} (0 is {first} alone)",
        "up": "solid fraction, %",
        "edges": edges,
        "share": found,
        "asked": asked,
        "marks": [("equal shares", 0.5)],
    }
