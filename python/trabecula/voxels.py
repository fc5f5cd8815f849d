"""Voxels: a part as occupancy on a grid."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from . import _core
from .base.files import extension, whole_file
from .base.formats import VOXEL_WRITES
from .base.given import fixed, positive
from .base.machine import fits
from .base.reproducible import Reproducible
from .base.transforms import factor_of, vector_of

if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import DTypeLike, NDArray

__all__ = ["Voxels"]


def fits_file(path: str | os.PathLike[str], count: int, step: float) -> None:
    """Refuses voxels for which there is no room on the disk of a file."""
    fits(1000.0 + count, f"{count:.3g} voxels", path, step, 3, "step")


def made_of(solid: _core.Solid, step: float, place: tuple[list[float], float] | None = None, **how: Any) -> _core.Voxels:
    """The voxels of a solid, perhaps with another origin and step."""
    made = solid.voxels(step, **how)
    return made if place is None else made.placed(*place)


class Voxels(Reproducible):
    """Occupancy on a grid of cubic voxels. Its array is read-only: ``moved`` and ``scaled`` give others.

    ``numpy.asarray`` of it is ``solid``, (nx, ny, nz), without a copy.
    """

    _make = staticmethod(made_of)
    _core: _core.Voxels

    def __repr__(self) -> str:
        return f"<trabecula.Voxels {' x '.join(map(str, self.shape))}, step {self.step:g} mm>"

    @property
    def origin(self) -> list[float]:
        """Lower corner of the first voxel, mm."""
        return list(self._core.origin)

    @property
    def step(self) -> float:
        """Edge of a voxel, mm."""
        return self._core.step

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along x, y, z."""
        nx, ny, nz = self._core.shape
        return nx, ny, nz

    @cached_property
    def solid(self) -> NDArray[np.uint8]:
        """1 where the voxel's centre is solid, indexed [x, y, z]; read-only."""
        return fixed(self._core.solid).transpose(2, 1, 0)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """``solid``, (nx, ny, nz) of uint8 and read-only, for functions of NumPy; a copy where another type is asked for.

        Raises ValueError where that needs a copy and ``copy`` is False.
        """
        found = self.solid
        if dtype is None or found.dtype == dtype:
            return found.copy() if copy else found
        if copy is False:
            raise ValueError(f"voxels are uint8; as {dtype} they are a copy, which copy=False does not allow")
        return found.astype(dtype)

    def moved(self, vector: Sequence[float]) -> Voxels:
        """The voxels with their origin moved by ``vector`` (three numbers, mm)."""
        origin = [a + b for a, b in zip(self.origin, vector_of("vector", vector), strict=True)]
        if not all(map(math.isfinite, origin)):
            raise ValueError(f"vector is {list(vector)}; the origin would be beyond 1e308 mm")
        return self._placed(origin, self.step)

    def scaled(self, factor: float, center: Sequence[float] = (0, 0, 0)) -> Voxels:
        """The voxels with origin and step scaled by one ``factor`` greater than 0 about ``center``: they stay cubes. Mirrored
        or stretched voxels are none; scale the design's mesh.
        """
        by = abs(factor_of("factor", positive("factor", factor)))
        middle = vector_of("center", center)
        return self._placed([(a - c) * by + c for a, c in zip(self.origin, middle, strict=True)], self.step * by)

    def _placed(self, origin: list[float], step: float) -> Voxels:
        return self._like(self._core.placed(origin, step), place=(origin, step))

    @property
    def volume(self) -> float:
        """Volume of the solid voxels, mm³."""
        return float(self.solid.sum(dtype="int64")) * self.step**3

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the voxels: .npy (indexed [x, y, z]) or .vti (an image for ParaView, with origin and step)."""
        kind = extension(path, VOXEL_WRITES)
        count = math.prod(self.shape)
        fits_file(path, count, self.step)
        with whole_file(path) as temporary:
            self._core.write(temporary, kind)
