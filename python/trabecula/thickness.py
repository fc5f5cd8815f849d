"""Local thickness: how thick walls and pores are, and how that is distributed over the volume."""

from __future__ import annotations

import os
from functools import cached_property

from . import _core
from .output import extension, whole_file

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

__all__ = ["Thickness"]


class Thickness:
    """Local thickness of a solid and of its pores. Made by ``Solid.thickness`` and ``Mesh.thickness``.

    At each point it is the diameter of the largest ball that lies in the solid (or in the pores) and covers the point.
    """

    def __init__(self, wall: dict[str, Any], pore: dict[str, Any] | None):
        self.wall = wall
        self.pore = pore

    def __repr__(self) -> str:
        def told(it: dict) -> str:
            return f"{it['mean']:.4g} ± {it['sd']:.2g} mm"

        pores = f", pores {told(self.pore)}" if self.pore else ""
        return f"<trabecula.Thickness walls {told(self.wall)}{pores}, step {self.step:g} mm>"

    @property
    def step(self) -> float:
        """Edge of a voxel, mm."""
        return self.wall["step"]

    def measure(self) -> dict:
        """``wall_thickness`` and ``pore_size``, each {min, p05, mean, sd, max, step, accuracy, histogram: {edges,
        share}}, mm; ``pore_size`` is None without a region.
        """
        return {"wall_thickness": self.wall, "pore_size": self.pore}

    def png(self) -> bytes:
        """The histograms as the bytes of a PNG file."""
        named = [("wall thickness, mm", self.wall), ("pore size, mm", self.pore)]
        drawn = [
            (title, it["histogram"]["edges"], it["histogram"]["share"], [], [(k, it[k]) for k in ("min", "p05", "mean")])
            for title, it in named
            if it
        ]
        return _core.charts(drawn, 960, 480 * len(drawn))

    @cached_property
    def _png(self) -> bytes:
        return self.png()

    def _repr_png_(self) -> bytes:
        return self._png

    def render(self, path: str | os.PathLike[str]) -> None:
        """Writes the histograms to a .png file."""
        extension(path, ("png",))
        with whole_file(path) as temporary, open(temporary, "wb") as out:
            out.write(self.png())
