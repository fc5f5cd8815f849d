"""Solids: the field, the surface, voxels and figures of a built design."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _core
from .design import Design, Lattice
from .errors import DesignWarning
from .mesh import Mesh, Picture
from .output import check_place, extension, fits, whole_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Solid", "Voxels", "fraction", "iso", "spartan"]

Progress = Callable[[int, int], Any]
PartName = Literal["sheet", "lower", "upper"]
VOXEL_FORMATS = ("npy", "vti")
PER_CELL = 32


class Solid(Picture):
    """A region and the lattice in it. Made by ``Design.build``."""

    def __init__(self, core: _core.Solid):
        self._core = core

    def __repr__(self) -> str:
        (a, b, c), (d, e, f) = self.bounds
        return f"<trabecula.Solid in {d - a:g} x {e - b:g} x {f - c:g} mm, wavelength {self.wavelength:g} mm>"

    @property
    def bounds(self) -> tuple[list[float], list[float]]:
        """Lower and upper corner of the region's bounds, mm."""
        low, high = self._core.bounds
        return list(low), list(high)

    @property
    def wavelength(self) -> float:
        """The smallest wavelength, mm."""
        return self._core.wavelength

    @property
    def warnings(self) -> list[dict[str, str]]:
        """What may not be meant, as {path, message}."""
        return [{"path": p, "message": m} for p, m in self._core.warnings]

    @property
    def repairs(self) -> dict[str, dict[str, int | float]]:
        """What was repaired in each mesh of the region, by the path of its table (``"region.mesh"``).

        Counts of corners ``joined``, edges ``split``, ``degenerate`` triangles and ``duplicates`` left out, triangles
        ``turned``, ``bodies_turned``, ``holes`` (with ``hole_length`` in mm, ``hole_area`` in mm² and ``hole_share`` of
        the surface), ``crossings`` cut and ``inner`` triangles left out. All zero for a clean mesh.
        """
        return dict(self._core.repairs)

    def report(self) -> dict:
        """The figures without meshing: ``lattices.NAME.{iso, fraction, porosity, thickness, connected_fraction}``.

        Each is a number, or [min, max] over the region where it varies; beside them the region's bounds and volume,
        and the warnings.
        """
        return json.loads(self._core.report())

    def field(self, points: ArrayLike) -> NDArray[np.float64]:
        """Values at points (n, 3) in mm: negative in the solid, positive outside, continuous; not a distance."""
        import numpy as np

        given = np.asarray(points, dtype=np.float64)
        if given.ndim == 0 or given.shape[-1] != 3:
            raise ValueError(f"points must have shape (n, 3), found {given.shape}")
        flat = np.ascontiguousarray(given.reshape(-1, 3))
        return self._core.field(flat).reshape(given.shape[:-1])

    def spacing(self, edge: float | None = None, per_cell: float | None = None) -> float:
        """The grid spacing (mm) of a request: ``edge`` itself, or the smallest wavelength / ``per_cell`` (32)."""
        if edge is not None and per_cell is not None:
            raise ValueError("give edge or per_cell, not both")
        if edge is None:
            edge = self.wavelength / _positive("per_cell", PER_CELL if per_cell is None else per_cell)
        edge = _positive("edge", edge)
        if edge > self.wavelength / 2:
            raise ValueError(
                f"a grid step of {edge:g} mm is more than half the smallest wavelength, {self.wavelength:g} mm, and shows "
                f"nothing of the lattice; {self.wavelength / PER_CELL:.3g} mm is usual"
            )
        return edge

    def estimate(self, edge: float | None = None, per_cell: float | None = None) -> dict:
        """What a surface will take: grid cells, triangles, bytes of memory, bytes of a binary STL."""
        return self._need(self.spacing(edge, per_cell))

    def _warn_thin(self, spacing: float) -> None:
        """Warns of walls and necks that the grid cannot carry."""
        if self.wavelength / spacing >= 64:
            return  # only fractions of a hundredth or two are that thin, and `report` tells
        for name, lattice in self.report()["lattices"].items():
            thin = lattice["thickness"]
            thin = thin[0] if isinstance(thin, list) else thin
            if thin is not None and 0 < thin < 1.5 * spacing:
                warnings.warn(
                    f"lattice.{name}: its thinnest wall or neck, {thin:.3g} mm, is less than 1.5 grid steps of "
                    f"{spacing:g} mm and may break up in the mesh; use an edge of {thin / 2:.2g} mm or less",
                    DesignWarning,
                    stacklevel=3,
                )

    def _need(self, spacing: float) -> dict:
        """The estimate, at fine spacings scaled from a coarser one: triangles grow as spacing to the −2."""
        coarse = max(spacing, self.wavelength / 16)
        need = self._core.estimate(coarse)
        for key in ("triangles", "memory", "stl"):
            need[key] *= (coarse / spacing) ** 2
        return need

    def mesh(
        self,
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Mesh:
        """The surface as a closed mesh.

        ``edge`` is the grid spacing in mm, or ``per_cell`` samples on the smallest wavelength (32 unless given). The
        result is the same for any number of ``threads``. ``progress(done, total)`` is called now and then.
        """
        spacing = self.spacing(edge, per_cell)
        need = self._need(spacing)
        fits(need["memory"], f"{need['triangles']:.3g} triangles", spacing, 2)
        self._warn_thin(spacing)
        core = self._core.mesh(spacing, _threads(threads), progress)
        return Mesh(core, self._core.region, spacing)

    def save_stl(
        self,
        path: str | os.PathLike[str],
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> dict:
        """Streams the surface to a binary STL without holding it in memory; gives triangles, volume and areas."""
        extension(path, ("stl",))
        check_place(path)
        spacing = self.spacing(edge, per_cell)
        need = self._need(spacing)
        fits(need["stl"], f"{need['triangles']:.3g} triangles", spacing, 2, os.fspath(path))
        self._warn_thin(spacing)
        with whole_file(path) as temporary:
            return self._core.stream_stl(temporary, spacing, _threads(threads), progress)

    def voxels(
        self,
        step: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Voxels:
        """Occupancy on cubic voxels of edge ``step`` (mm) over the region's bounds."""
        spacing = self.spacing(step, per_cell)
        low, high = self.bounds
        count = math.prod(math.ceil((b - a) / spacing) for a, b in zip(low, high, strict=True))
        fits(2.0 * count, f"{count:.3g} voxels", spacing, 3, word="step")
        return Voxels(self._core.voxels(spacing, _threads(threads), progress))

    def _picture(self) -> Mesh:
        low, high = self.bounds
        return self.mesh(edge=max(self.wavelength / 20, max(b - a for a, b in zip(low, high, strict=True)) / 160))


class Voxels:
    """Occupancy on a grid of cubic voxels."""

    def __init__(self, core: _core.Voxels):
        self._core = core

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
        """1 where the voxel's centre is solid, indexed [x, y, z]."""
        return self._core.solid.transpose(2, 1, 0)

    @property
    def volume(self) -> float:
        """Volume of the solid voxels, mm³."""
        return float(self.solid.sum(dtype="int64")) * self.step**3

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the voxels: .npy (indexed [x, y, z]) or .vti (an image for ParaView, with origin and step)."""
        kind = extension(path, VOXEL_FORMATS)
        with whole_file(path) as temporary:
            self._core.write(temporary, kind)


def spartan(
    name: Literal["diamond", "gyroid"],
    wavelength: float | Sequence[float] = (4, 4, 4),
    rotate: Sequence[float] = (0, 0, 0),
    porosity: float | dict = 0.7,
    region: dict | None = None,
    fit: Literal["table", "spartan"] = "table",
) -> Design:
    """The seven variables of "Equations for SPARTAN Gyroids and Diamonds" in one call.

    Positions are scaled to phases and rotated there (``map.spartan``); solid is f ≤ t. The note's gyroid is the mirror
    image of the usual one, so ``"gyroid"`` here is the cell ``gyroid_mirrored``. The porosity is met exactly, by the
    cell's own distribution; ``fit="spartan"`` uses the note's polynomial for the diamond (porosity within 0.0031), and a
    fit of ours in the same form for the gyroid, for which the note gives none. ``region`` is a box of 4 × 4 × 4
    wavelengths about the origin unless given.
    """
    from . import level, map

    cells = {"diamond": "diamond", "gyroid": "gyroid_mirrored", "gyroid_mirrored": "gyroid_mirrored"}
    if name not in cells:
        raise ValueError(f'spartan: the note has "gyroid" and "diamond", found {name!r}')
    three = [wavelength] * 3 if isinstance(wavelength, (int, float)) else [float(w) for w in wavelength]
    lattice = Lattice(
        cell=cells[name],
        part="lower",
        map=map.spartan(wavelength=three, rotate=rotate),
        level=level.porosity(porosity, fit=fit),
    )
    box = {"box": {"size": [4 * w for w in three]}} if region is None else region
    return Design(region=box, lattice={name: lattice})


@overload
def iso(cell: str | dict, fraction: float, part: PartName = "sheet") -> float: ...
@overload
def iso(cell: str | dict, fraction: NDArray[np.float64], part: PartName = "sheet") -> NDArray[np.float64]: ...
def iso(cell, fraction, part="sheet"):
    """The level t at which this part of the cell has this solid fraction; numbers or arrays."""
    return _levels(cell, fraction, part, True)


@overload
def fraction(cell: str | dict, iso: float, part: PartName = "sheet") -> float: ...
@overload
def fraction(cell: str | dict, iso: NDArray[np.float64], part: PartName = "sheet") -> NDArray[np.float64]: ...
def fraction(cell, iso, part="sheet"):
    """The solid fraction of this part of the cell at level t; numbers or arrays."""
    return _levels(cell, iso, part, False)


def _levels(cell, values, part, to_iso):
    if isinstance(values, (int, float)):
        return _core.levels(cell, part, [values], to_iso)[0]
    import numpy as np

    given = np.asarray(values, dtype=np.float64)
    return np.array(_core.levels(cell, part, given.ravel().tolist(), to_iso)).reshape(given.shape)


def _positive(name: str, value: float) -> float:
    if not (isinstance(value, (int, float)) or hasattr(value, "__float__")) or isinstance(value, bool):
        raise TypeError(f"{name} must be a number, found {value!r}")
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise ValueError(f"{name} is {value}; it must be a finite number greater than 0")
    return number


def _threads(threads: int | None) -> int | None:
    if threads is not None and (not isinstance(threads, int) or threads < 1):
        raise ValueError(f"threads is {threads}; it must be a whole number of at least 1")
    return threads
