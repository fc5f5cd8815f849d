"""Transitions between the lattices of a blend: how well they hold together, and how much is solid in them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

from . import _core
from .output import extension, whole_file

__all__ = ["Transitions"]


class Transitions(Sequence):
    """The transitions of a blend, each a dictionary. Made by ``Solid.transitions``.

    ``between`` names the two lattices; ``volume`` (mm³) is where both count; ``loose`` and ``dangling`` have the number of
    ``bodies`` that touch neither side, or hang by necks under half the narrowest of the widest way across, and their
    ``volume``; ``neck`` is the ``diameter`` (mm, to within ``step``) and ``place`` of that narrowest neck, None where no way
    leads across; ``fractions`` has for tenths of the second's ``share`` the fraction ``asked`` and ``found``, in
    windows of two cells.
    """

    def __init__(self, found: list[dict]):
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    def __getitem__(self, index):
        return self._found[index]

    def __iter__(self) -> Iterator[dict]:
        return iter(self._found)

    def __repr__(self) -> str:
        return f"<trabecula.Transitions {', '.join(' to '.join(t['between']) for t in self) or 'none'}>"

    def png(self) -> bytes:
        """The fraction found along each transition as the bytes of a PNG file; what was asked for is marked in words."""
        drawn = []
        for it in self:
            rows = it["fractions"]
            first, second = it["between"]
            tenth = 1 / 10
            edges, share, at = [0.0], [], 0.0
            for row in rows:
                low = row["share"] - tenth / 2
                if low > at + tenth / 2:  # tenths at which nothing was looked at
                    edges.append(low)
                    share.append(0.0)
                at = row["share"] + tenth / 2
                edges.append(at)
                share.append(row["found"])
            asked = [r["asked"] for r in rows]
            found = max((abs(r["found"] - r["asked"]) for r in rows), default=0.0)
            title = f"share of {second} against {first}: solid fraction found, asked {min(asked):.3f} to {max(asked):.3f}"
            marks = [(f"off by {found:.3f} at most ", 0.5)]
            drawn.append((title, edges, share, marks))
        return _core.charts(drawn, 960, 480 * len(drawn))

    def render(self, path: str | os.PathLike[str]) -> None:
        """Writes the fractions along the transitions to a .png file."""
        extension(path, ("png",))
        if not self._found:
            raise ValueError("there is no transition: the design has no blend, or one lattice alone counts everywhere")
        with whole_file(path) as temporary, open(temporary, "wb") as out:
            out.write(self.png())
