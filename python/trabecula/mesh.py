"""Triangle meshes: arrays, figures, files, pictures."""

from __future__ import annotations

import math
import os
from functools import cached_property
from typing import TYPE_CHECKING

from . import _core
from .given import number, whole
from .machine import file_size, fits
from .output import extension, whole_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["READS", "WRITES", "Mesh"]

WRITES = ("stl", "3mf", "ply", "obj")
FIGURES = (
    "volume",
    "area",
    "area_lattice",
    "area_cut",
    "solid_fraction",
    "porosity",
    "euler",
    "pieces",
    "cavities",
    "closed",
    "bounds",
)
READS = ("stl", "3mf", "ply", "obj", "off")


class Picture:
    """Things that show themselves as a picture in a notebook."""

    def _picture(self) -> Mesh:
        raise NotImplementedError

    @cached_property
    def _png(self) -> bytes:
        return self._picture().png((640, 480))

    def _repr_png_(self) -> bytes:
        return self._png

    def _repr_html_(self) -> str:
        import base64
        import html

        data = base64.b64encode(self._png).decode("ascii")
        text = html.escape(repr(self))
        return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"/><figcaption>{text}</figcaption></figure>'


class Mesh(Picture):
    """A triangle mesh. Made by ``Solid.mesh``, or read from a file by ``Mesh.read``."""

    def __init__(
        self,
        core: _core.Mesh,
        region: _core.Region | None = None,
        edge: float | None = None,
        islands: dict | None = None,
    ):
        self._core = core
        self._region = region
        self._edge = edge
        self._islands = islands

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Mesh:
        """Reads a mesh file (stl, 3mf, ply, obj, off; any letter case)."""
        name = os.fsdecode(path)
        kind = extension(name, READS)
        data = _core.read_file(name)
        try:
            return Mesh(_core.Mesh.read(data, kind))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None

    def __repr__(self) -> str:
        vertices, triangles = self._core.counts
        return f"<trabecula.Mesh {triangles} triangles, {vertices} vertices>"

    @property
    def counts(self) -> tuple[int, int]:
        """Numbers of vertices and triangles."""
        return self._core.counts

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """Vertex positions, (n, 3), mm."""
        return self._core.vertices

    @cached_property
    def triangles(self) -> NDArray[np.uint32]:
        """Vertex indices, (m, 3), counter-clockwise seen from outside."""
        return self._core.triangles

    @cached_property
    def cut(self) -> NDArray[np.bool_]:
        """For each triangle, whether it lies on the region's boundary rather than on the lattice."""
        return self._core.cut

    @cached_property
    def _figures(self) -> dict:
        return self._core.measure()

    def measure(self) -> dict:
        """Every figure: volume, area, area_lattice, area_cut, solid_fraction, porosity, euler, pieces, cavities,
        closed, bounds. Those that need a region are None for a mesh without one.
        """
        figures = dict(self._figures)
        share = self.solid_fraction
        figures |= {"solid_fraction": share, "porosity": None if share is None else 1 - share}
        return {k: figures[k] for k in FIGURES}

    @cached_property
    def solid_fraction(self) -> float | None:
        """Volume of the solid over volume of its region; None for a mesh without a region."""
        if self._region is None:
            return None
        return self.volume / self._region.volume(self._edge or self._spacing())

    @property
    def porosity(self) -> float | None:
        """One minus the solid fraction."""
        return None if self.solid_fraction is None else 1 - self.solid_fraction

    @property
    def volume(self) -> float:
        """Enclosed volume, mm³."""
        return self._figures["volume"]

    @property
    def area(self) -> float:
        """Area, mm²."""
        return self._figures["area"]

    @property
    def euler(self) -> int:
        """Vertices − edges + triangles: of the surface, twice that of the solid."""
        return self._figures["euler"]

    @property
    def pieces(self) -> int:
        """Number of separate solids; a cavity is not a piece."""
        return self._figures["pieces"]

    @property
    def islands(self) -> dict | None:
        """What there was beside the largest piece when a solid was meshed; None for a mesh from a file.

        ``found`` and ``dropped`` count the pieces, ``border`` those with surface on the region's boundary, mostly crumbs
        that it cuts off; the others lie inside. ``volume`` is theirs together, mm³, and ``share`` the largest piece's
        share of all. ``largest`` has the ``volume``, ``place`` and ``bounds`` (mm) of the largest of them, or is None.
        """
        return self._islands

    @property
    def cavities(self) -> int:
        """Number of closed voids."""
        return self._figures["cavities"]

    @property
    def closed(self) -> bool:
        """Whether every edge has exactly two triangles, of opposite direction."""
        return self._figures["closed"]

    @property
    def bounds(self) -> list[list[float]]:
        """Lower and upper corner, mm."""
        return [list(c) for c in self._figures["bounds"]]

    def _summary(self) -> dict:
        """The figures that a streamed surface has too."""
        keys = ("volume", "area", "area_lattice", "area_cut", "euler", "pieces", "cavities")
        return {"triangles": self.counts[1], **{k: self._figures[k] for k in keys}, "islands": self._islands}

    def within(self, solid_or_region) -> Mesh:
        """The same mesh measured against the region of a Solid: solid fraction, lattice and cut area."""
        region = getattr(solid_or_region, "_core", solid_or_region)
        region = region.region if isinstance(region, _core.Solid) else region
        if not isinstance(region, _core.Region):
            raise TypeError(f"within takes a Solid, found {solid_or_region!r}")
        return Mesh(self._core.split_by(region), region, self._edge, self._islands)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh: .stl (binary), .3mf, .ply (binary) or .obj, in any letter case."""
        kind = extension(path, WRITES)
        vertices, triangles = self._core.counts
        fits(file_size(kind, triangles, vertices), f"{triangles:.3g} triangles", path)
        title = "Lattice part"  # not the file's name: the same solid is the same bytes
        with whole_file(path) as temporary:
            self._core.write(temporary, kind, title)

    def png(self, size: tuple[int, int] = (1600, 1200), azimuth: float = 30, elevation: float = 25) -> bytes:
        """A picture as the bytes of a PNG file; the camera looks from ``azimuth`` about +z and ``elevation``, degrees."""
        width, height = (whole("size", v, 1, 16384) for v in size)
        angles = number("azimuth", azimuth), number("elevation", elevation)
        if not all(map(math.isfinite, angles)):
            raise ValueError(f"azimuth and elevation are {angles}; they must be finite, degrees")
        return self._core.png(width, height, *angles)

    def render(
        self,
        path: str | os.PathLike[str],
        size: tuple[int, int] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
    ) -> None:
        """Writes a picture to a .png file."""
        extension(path, ("png",))
        with whole_file(path) as temporary, open(temporary, "wb") as out:
            out.write(self.png(size, azimuth, elevation))

    def _picture(self) -> Mesh:
        return self

    def _spacing(self) -> float:
        low, high = self.bounds
        return max(b - a for a, b in zip(low, high, strict=True)) / 200
