"""Local thickness: how thick walls and pores are, and how that is distributed over the volume."""

from __future__ import annotations

import os

from .base.files import write_svg

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

    def svg(self) -> str:
        """The histograms as the text of an SVG file, the share of the volume over the thickness."""
        from .pictures.chart import Chart, svg

        def chart(title: str, of: str, it: ThicknessSpread) -> Chart:
            # Toward sharp edges local thickness falls to zero, which is no wall: the least one may be above the percentile.
            facts = f"mean {it.mean:.3g} ± {it.sd:.2g} mm, at most {it.max:.3g} mm; accuracy {it.accuracy:.2g} mm"
            marks = [("thinnest but for sharp edges", it.min), ("5th percentile", it.p05), ("mean", it.mean)]
            named = [(f"{name} {at:.3g} mm", at) for name, at in marks]
            across, up = f"{title.lower()}, mm", f"share of the {of} volume, %"
            return Chart(title, facts, across, up, it.histogram.edges, it.histogram.share, named)

        drawn = [chart("Wall thickness", "solid", self.wall)]
        return svg(drawn + ([chart("Pore size", "pore", self.pore)] if self.pore else []))

    def _repr_svg_(self) -> str:
        return self.svg()

    def render(self, path: str | os.PathLike[str]) -> None:
        """Writes the histograms to a .svg file."""
        write_svg(path, self.svg)
