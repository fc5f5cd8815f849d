"""Triangle meshes: arrays, figures, files, pictures."""

from __future__ import annotations

import math
import os
from functools import cached_property

from . import _core
from .given import number, positive, whole
from .machine import file_size, fits
from .output import extension, whole_file
from .thickness import Thickness

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

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
    "voids",
    "closed",
    "bounds",
    "specific_surface",
    "hydraulic_diameter",
)
#: Pairs of triangles after which self-intersections are counted no further.
MANY = 1_000_000
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
    """A triangle mesh. Made by ``Solid.mesh``, read from a file by ``Mesh.read``, or ``Mesh.of`` arrays.

    It never changes, so a copy is the mesh itself. Pickled it keeps its figures, but not its region: ``thickness`` is then of
    the solid alone, until ``within`` gives a region back.
    """

    def __init__(
        self,
        core: _core.Mesh,
        region: _core.Region | None = None,
        edge: float | None = None,
        islands: dict | None = None,
        chord_error: float | None = None,
    ):
        if not isinstance(core, _core.Mesh):
            raise TypeError("use Mesh.of(vertices, triangles), or Mesh.read(path)")
        self._core = core
        self._region = region
        self._edge = edge
        self._islands = islands
        self._chord_error = chord_error
        self._simplification: dict | None = None

    @staticmethod
    def of(vertices: ArrayLike, triangles: ArrayLike) -> Mesh:
        """The mesh of vertices (n, 3), mm, and triangles (m, 3), the indices of their corners, counter-clockwise seen from
        outside. A ValueError for other shapes, places that are not finite, and indices of no vertex.
        """
        import numpy as np

        places, corners = np.asarray(vertices, dtype=np.float64), np.asarray(triangles)
        if corners.size and not np.issubdtype(corners.dtype, np.integer):
            raise ValueError(f"expected triangles as whole numbers, found {corners.dtype}")
        if places.ndim != 2 or corners.ndim != 2:
            raise ValueError(f"expected vertices (n, 3) and triangles (m, 3), found {places.shape} and {corners.shape}")
        return Mesh(_core.Mesh.of(places, corners.astype(np.int64)))

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Mesh:
        """Reads a mesh file (stl, 3mf, ply, obj, off; any letter case).

        Corners of an STL file that differ by no more than single precision rounds are one, if it would not be closed else.
        """
        name = os.fsdecode(path)
        kind = extension(name, READS)
        data = _core.read_file(name)
        try:
            return Mesh(_core.Mesh.read(data, kind))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None

    def __copy__(self) -> Mesh:
        return self

    def __deepcopy__(self, memo: dict) -> Mesh:
        return self

    def __reduce__(self) -> tuple:
        state = (self._core.vertices, self._core.triangles, self._core.known_cut(), self._core.design)
        names = ("_region_volume", "_edge", "_islands", "_chord_error", "_simplification")
        return _revived, (state, {name: getattr(self, name) for name in names})

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
        voids, closed, bounds, specific_surface, hydraulic_diameter. Those that need a region are None for a mesh without one.
        """
        figures = dict(self._figures)
        share = self.solid_fraction
        figures |= {"solid_fraction": share, "porosity": None if share is None else 1 - share}
        figures |= {"specific_surface": self.specific_surface, "hydraulic_diameter": self.hydraulic_diameter}
        figures["voids"] = self.voids
        return {k: figures[k] for k in FIGURES}

    @cached_property
    def solid_fraction(self) -> float | None:
        """Volume of the solid over volume of its region; None for a mesh without a region."""
        return None if self._region_volume is None else self.volume / self._region_volume

    @cached_property
    def _region_volume(self) -> float | None:
        return None if self._region is None else self._region.volume(self._edge or self._spacing())

    @property
    def specific_surface(self) -> dict[str, float | None]:
        """Area over volume, 1/mm: ``area_of_solid`` is all area over the solid's volume, ``area_of_region`` all area and
        ``lattice_of_region`` the lattice's area, without cuts, over the region's volume.
        """
        area, lattice = self.area, self._figures["area_lattice"]
        whole = self._region_volume
        return {
            "area_of_solid": area / self.volume if self.volume else None,
            "area_of_region": area / whole if whole else None,
            "lattice_of_region": lattice / whole if whole and lattice is not None else None,
        }

    @property
    def hydraulic_diameter(self) -> float | None:
        """4 · pore volume / wetted area, mm: the region's volume without the solid's, and the lattice's area without
        cuts. None without a region or a lattice.
        """
        lattice = self._figures["area_lattice"]
        if self._region_volume is None or not lattice:
            return None
        return 4 * (self._region_volume - self.volume) / lattice

    @cached_property
    def self_intersections(self) -> int:
        """Pairs of triangles that meet elsewhere than in common corners or edges, decided exactly; a million stands for
        that many or more.
        """
        return self._core.self_intersections(MANY)

    @cached_property
    def quality(self) -> dict[str, float] | None:
        """How well shaped the triangles are: ``smallest_angle`` and its 5th percentile ``smallest_angle_p05``, degrees (60
        at best), and ``largest_aspect``, the longest edge over 2√3 times the inscribed circle's radius (1 at best; None
        for a triangle without area). None without triangles.
        """
        found = self._core.quality()
        if found is None:
            return None
        least, p05, aspect = found
        return {
            "smallest_angle": least,
            "smallest_angle_p05": p05,
            "largest_aspect": aspect if math.isfinite(aspect) else None,
        }

    @cached_property
    def defects(self) -> list[str]:
        """What is wrong with the mesh as the surface of a solid, in words; empty if nothing is."""
        words = (
            ("edge with one triangle", "edges with one triangle"),
            ("edge with more than two triangles", "edges with more than two triangles"),
            ("edge whose two triangles face opposite ways", "edges whose two triangles face opposite ways"),
            ("triangle given twice", "triangles given twice"),
            ("triangle without area", "triangles without area"),
            ("vertex where surfaces touch", "vertices where surfaces touch"),
            ("pair of triangles that cross or touch", "pairs of triangles that cross or touch"),
        )
        counts = (*self._core.flaws(), *self._core.oddities(), self.self_intersections)
        found = [f"{n} {two if n > 1 else one}" for n, (one, two) in zip(counts, words, strict=True) if n]
        return [*found, "inside out"] if self.closed and self.volume < 0 else found

    def thickness(
        self,
        step: float | None = None,
        threads: int | None = None,
        progress: Callable[[int, int], Any] | None = None,
    ) -> Thickness:
        """Local thickness of the solid and, if the mesh has a region, of its pores, on voxels of edge ``step`` (mm).

        Unless given, the step is an eighth of the mean wall 2 V / A, or such that there are 2²⁴ voxels. The mesh must be
        closed.
        """
        wanted = None if step is None else positive("step", step)
        workers = None if threads is None else whole("threads", threads, 1, 4096)
        spacing, shape, need = self._core.thickness_needs(self._region, wanted)
        fits(need, f"{math.prod(shape):.3g} voxels", edge=spacing, power=3, word="step")
        return Thickness(*self._core.thickness(self._region, spacing, workers, progress))

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
    def chord_error(self) -> float | None:
        """How far a mesh made by ``Solid.mesh(chord=...)`` is from the surface (mm), to first order, at thirds and quarters
        of its triangles; None for others.
        """
        return self._chord_error

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

    @cached_property
    def voids(self) -> list[dict]:
        """The closed voids, from which powder and resin cannot drain, the largest first.

        Each has ``volume`` (mm³), ``point`` (mm, inside the void) and ``bounds`` (lower and upper corner, mm). There are
        as many as ``cavities``.
        """
        found = self._core.voids() if self.cavities else []
        return [{"volume": v, "point": list(p), "bounds": [list(c) for c in b]} for v, p, b in found]

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

    def simplified(
        self,
        tolerance: float | None = None,
        triangles: int | None = None,
        progress: Callable[[int, int], Any] | None = None,
    ) -> Mesh:
        """A lighter mesh that keeps every guarantee, sharp edges, and the volume.

        No point of either surface is farther than ``tolerance`` (mm) from the other one; or the mesh is brought down to
        ``triangles``, and ``simplification`` of the result says how far it is then at most. With both, whichever is
        reached first. A mesh that is not closed, or crosses itself, is refused. ``progress(done, total)`` is called now
        and then.
        """
        if tolerance is None and triangles is None:
            raise ValueError("give a tolerance (mm), a number of triangles, or both")
        length = None if tolerance is None else positive("tolerance", tolerance)
        most = None if triangles is None else whole("triangles", triangles, 4, 2**32)
        # Links, quadrics, displacements, candidates, a tree, and the copies before and after.
        fits(320.0 * self._core.counts[1], f"simplifying {self._core.counts[1]} triangles")
        core, report = self._core.simplified(length, most, progress)
        made = Mesh(core, self._region, self._edge, self._islands)
        made._simplification = report
        return made

    @property
    def simplification(self) -> dict | None:
        """What ``simplified`` did: triangles, volume and area before and after, and ``deviation``, a bound of the distance
        between the two surfaces in both directions, mm. None for a mesh that was not simplified.
        """
        return None if self._simplification is None else dict(self._simplification)

    def within(self, solid_or_region) -> Mesh:
        """The same mesh measured against a region, from the builders of that name or that of a Solid: solid fraction, lattice
        and cut area.
        """
        region = getattr(solid_or_region, "_core", solid_or_region)
        region = region.region if isinstance(region, _core.Solid) else region
        if isinstance(region, dict):
            region = _core.Region.from_data({"region": region}, os.getcwd())
        if not isinstance(region, _core.Region):
            raise TypeError(f"within takes a Solid or a region, found {solid_or_region!r}")
        return Mesh(self._core.split_by(region), region, self._edge, self._islands)

    def uncapped(self) -> Mesh:
        """The lattice's own surface alone, open where the region cuts it: without the triangles that ``cut`` marks.

        For shells, and for surfaces that are to be joined to others; what is to be printed stays closed. Volume and
        porosity of an open surface mean nothing. A ValueError where it is not known which triangles are cuts, as in a mesh
        from a file: ``within`` finds them.
        """
        if self._figures["area_cut"] is None:
            raise ValueError("which triangles are cuts is not known: use within(solid) first")
        made = Mesh(self._core.uncapped(), None, self._edge, self._islands)
        if not made.counts[1]:
            raise ValueError("all triangles lie on the region's boundary: there is no lattice in this mesh")
        return made

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh: .stl (binary), .3mf, .ply (binary) or .obj, in any letter case."""
        kind = extension(path, WRITES)
        vertices, triangles = self._core.counts
        fits(file_size(kind, triangles, vertices), f"{triangles:.3g} triangles", path)
        title = "Lattice part"  # not the file's name: the same solid is the same bytes
        with whole_file(path) as temporary:
            self._core.write(temporary, kind, title)

    def png(
        self,
        size: tuple[int, int] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
        color: ArrayLike | None = None,
        label: str = "",
        span: tuple[float, float] | None = None,
    ) -> bytes:
        """A picture as the bytes of a PNG file; the camera looks from ``azimuth`` about +z and ``elevation``, degrees.

        ``color`` is a number for each vertex, shown on a scale that says ``label`` and goes over ``span``, or from the least
        to the greatest.
        """
        width, height = (whole("size", v, 1, 16384) for v in size)
        angles = number("azimuth", azimuth), number("elevation", elevation)
        if not all(map(math.isfinite, angles)):
            raise ValueError(f"azimuth and elevation are {angles}; they must be finite, degrees")
        return self._core.png(width, height, *angles, self._tint(color, label, span))

    def _tint(self, color: ArrayLike | None, label: str, span: tuple[float, float] | None) -> tuple | None:
        if color is None:
            return None
        import numpy as np

        values = np.asarray(color, dtype=np.float64)
        if values.shape != (self.counts[0],):
            raise ValueError(f"color must be {self.counts[0]} numbers, one for each vertex, found shape {values.shape}")
        if span is None:
            finite = values[np.isfinite(values)]
            span = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
        low, high = (number("span", v) for v in span)
        if not -math.inf < low <= high < math.inf:
            raise ValueError(f"span is {span}; it must be two finite numbers, the lower first")
        return label, values.tolist(), (low, high if high > low else low + 1.0)

    def render(
        self,
        path: str | os.PathLike[str],
        size: tuple[int, int] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
        color: ArrayLike | None = None,
        label: str = "",
        span: tuple[float, float] | None = None,
    ) -> None:
        """Writes a picture to a .png file; see ``png``."""
        extension(path, ("png",))
        with whole_file(path) as temporary, open(temporary, "wb") as out:
            out.write(self.png(size, azimuth, elevation, color, label, span))

    def _picture(self) -> Mesh:
        return self

    def _spacing(self) -> float:
        low, high = self.bounds
        return max(b - a for a, b in zip(low, high, strict=True)) / 200


def _revived(state: tuple, known: dict) -> Mesh:
    """A mesh that was pickled."""
    vertices, triangles, cut, design = state
    mesh = Mesh(_core.Mesh.of(vertices, triangles.astype("int64"), cut, design))
    mesh.__dict__.update(known)
    return mesh
