"""Whether a grid carries a solid, and what is warned of where it does not."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from ..errors import warn_caller

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable

    from .. import _core
    from ..reports import DesignReport

__all__ = ["Resolution", "sample_error"]

#: Share of the volume by which voxels may reach beyond plane faces of the region unwarned.
BEYOND = 0.01
#: Share of the volume of beams that chords may cost unwarned, and what the step that is advised leaves of it.
CHORDS, SLIGHT = 0.05, 0.01
#: Share of a step below which a wall is one that shrinks to nothing somewhere.
NOTHING = 0.01
#: Steps on the diameter of a beam from which on chords cost less.
SURE = 3.0


def sample_error(share: float) -> float:
    """How far the solid share of a region may be from that of the sample that it is known from: three standard deviations."""
    return 0.05 * share + 0.005


class Resolution(ABC):
    """Solids that say which grids are too coarse for them."""

    _core: _core.Solid
    _folder: str

    report: Callable[[], DesignReport]
    spacing: Callable[..., float]

    @property
    @abstractmethod
    def skin(self) -> float | None:
        """The least thickness of the skin, mm."""

    @property
    @abstractmethod
    def wavelength(self) -> float:
        """The smallest wavelength, mm."""

    @property
    @abstractmethod
    def bounds(self) -> list[list[float]]:
        """Lower and upper corner of the region's bounds, mm."""

    @property
    @abstractmethod
    def _thinnest(self) -> dict[str, float]:
        """The thinnest wall or neck of each lattice or graph of beams, mm, by its path."""

    @property
    @abstractmethod
    def _coarser(self) -> tuple[float, float, float] | None:
        """The spacing that is used, where it is not the one that the walls need; that one; its triangles."""

    def _warn_coarser(self, edge: float | None, per_cell: float | None) -> None:
        """Tells of a spacing that nobody asked for and that is coarser than the walls need."""
        if edge is None and per_cell is None and self._coarser:
            used, wanted, triangles = self._coarser
            warn_caller(
                f"a grid spacing of {wanted:.3g} mm, which the walls need, makes about {triangles:.2g} triangles; {used:g} mm "
                "is used, which carries the thinnest wall; give an edge for another",
            )

    def _warn_thin(self, spacing: float, word: str = "edge") -> None:
        """Warns of walls and necks that the grid cannot carry."""
        if self.skin is not None and self.skin < spacing:
            warn_caller(
                f"at its thinnest, {self.skin:.3g} mm, it is less than a grid step of {spacing:g} mm: it stays closed, "
                f"but its curved parts are rough; use {_a(word)} of {self.skin:.2g} mm or less",
                "skin",
            )
        for name, thin in self._thinnest.items():
            if thin < 1.5 * spacing:
                remedy = f"use {_a(word)} of {thin / 2:.2g} mm or less" if thin > NOTHING * spacing else "no grid resolves it"
                warn_caller(
                    f"its thinnest wall or neck, {thin:.3g} mm, is less than 1.5 grid steps of {spacing:g} mm and may break "
                    f"up; {remedy}",
                    name,
                )
        beams = [thin for name, thin in self._thinnest.items() if name.startswith("beams.")]
        if word == "edge" and beams and 1.5 * spacing <= min(beams) < SURE * spacing:
            error = self._core.volume_error(spacing)
            if error is not None and error > CHORDS:
                better = spacing * (SLIGHT / error) ** 0.5
                warn_caller(
                    f"with {min(beams) / spacing:.2g} grid steps of {spacing:g} mm through the thinnest beam, chords cost "
                    f"about {100 * error:.2g} % of the volume of beams; an edge of {better:.2g} mm leaves {100 * SLIGHT:g} %",
                )

    def _warn_beyond(self, step: float) -> None:
        """Warns of voxels that reach beyond plane faces of the region: their centres are inside, and so they count."""
        low, high = self.bounds
        sizes = [b - a for a, b, flat in zip(low, high, self._core.flat_axes, strict=True) if flat]

        def beyond(step: float) -> list[float]:
            return [step * math.ceil(size / step - 1e-9) / size for size in sizes]

        more = math.prod(beyond(step)) - 1
        if more > BEYOND:
            # Of the axis along which they reach farthest.
            ratio, size = max(zip(beyond(step), sizes, strict=True))
            better = size / math.ceil(size / step - 1e-9)
            hint = f"use a step that divides its sizes, such as {better:.6g} mm"
            if math.prod(beyond(float(f"{better:.6g}"))) - 1 > BEYOND:
                hint = "use a smaller step, or one that divides its sizes"
            warn_caller(
                f"voxels of {step:g} mm reach beyond the region's plane faces, {ratio * size:.4g} mm along one of {size:.4g} "
                f"mm: their volume and fraction are up to {100 * more:.1f} % too large; {hint}",
            )

    def _warn_coarse(self, volume: float, spacing: float, word: str = "edge", pieces: int | None = None) -> None:
        """Warns of a result whose solid fraction has little to do with the design's, for want of grid steps; over tetrahedra
        also of one that falls into more ``pieces`` than the lattice has.
        """
        if pieces is not None and (message := self._core.coarse_steps(spacing, volume, pieces)):
            warn_caller(message)
            return
        share, region = self._core.expected()
        found = volume / region
        # A share of the fraction and of the porosity, and the error of the sample. Over tetrahedra that may lie where none is.
        tets = any(it.tets for it in self.report().lattices.values())
        if abs(found - share) > min(0.05, share / 3, max((1 - share) / 3, 0.005), math.inf if tets else sample_error(share)):
            better = min([spacing / 2, self.wavelength / 20, *(thin / 2 for thin in self._thinnest.values())])
            warn_caller(
                f"the grid is too coarse: the result has a solid fraction of {found:.3g}, the design one of about "
                f"{share:.2g}; use {_a(word)} of {better:.2g} mm or less",
            )


def _a(word: str) -> str:
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"
