"""Local thickness: how thick walls and pores are, and how that is distributed over the volume."""

from __future__ import annotations

import os
from functools import cached_property

from . import _core
from .files import extension, whole_file

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .reports import ThicknessReport, ThicknessSpread

__all__ = ["Thickness"]


class Thickness:
    """Local thickness of a solid and of its pores. Made by ``Solid.thickness`` and ``Mesh.thickness``.

    At each point it is the diameter of the largest ball that lies in the solid (or in the pores) and covers the point.
    """

    def __init__(self, report: ThicknessReport):
        self._report = report

    def __repr__(self) -> str:
        def mean(it: ThicknessSpread) -> str:
            return f"{it.mean:.4g} ± {it.sd:.2g} mm"

        pores = f", pores {mean(self.pore)}" if self.pore else ""
        return f"<trabecula.Thickness walls {mean(self.wall)}{pores}, step {self.step:g} mm>"

    @property
    def wall(self) -> ThicknessSpread:
        """The distribution over the solid, mm."""
        return self._report.wall_thickness

    @property
    def pore(self) -> ThicknessSpread | None:
        """The distribution over the pores, mm; None without a region."""
        return self._report.pore_size

    @property
    def step(self) -> float:
        """Edge of a voxel, mm."""
        return self.wall.step

    def measure(self) -> ThicknessReport:
        """``wall_thickness`` and ``pore_size``: minimum, 5th percentile, mean, standard deviation, maximum, histogram, mm."""
        return self._report

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
