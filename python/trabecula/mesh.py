"""Triangle meshes: arrays, figures, files, pictures."""

from __future__ import annotations

import math
import os
from functools import cached_property

from . import _core
from .base.files import extension, read_text, whole_file
from .base.formats import CAD_READS, DESIGNS, MESH_WRITES, PART_READS
from .base.given import check_data, fixed, positive, thread_count, whole
from .base.machine import file_size, fits
from .base.memory import InMemory
from .base.reproducible import Unchanging
from .base.transforms import Transformed, determinant
from .errors import warn_caller
from .pictures.drawn import Drawn
from .thickness import Thickness

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    import meshio
    import numpy as np
    import pyvista
    import trimesh
    from numpy.typing import ArrayLike, NDArray

    from .reports import (
        IslandsReport,
        MeshReport,
        QualityReport,
        SimplifyReport,
        SmoothReport,
        SpecificSurface,
        SurfaceReport,
        VoidReport,
    )
    from .solid import Solid

__all__ = ["Mesh"]

#: Pairs of triangles after which self-intersections are counted no further.
MANY = 1_000_000
#: The title in files that have one; not the file's name: the same solid is the same bytes.
TITLE = "Lattice part"


class Mesh(Drawn, Transformed, Unchanging):
    """A triangle mesh. Made by ``Solid.mesh``, read from a file by ``Mesh.read``, or ``Mesh.of`` arrays.

    It never changes, and its arrays are read-only: ``moved``, ``scaled`` and ``rotated`` give another. So a copy is the mesh
    itself. Pickled it keeps its figures, but not its region: ``thickness`` is then of the solid alone, until ``within`` gives
    a region back.
    """

    def __init__(
        self,
        core: _core.Mesh,
        region: _core.Region | None = None,
        edge: float | None = None,
        islands: IslandsReport | None = None,
        chord_error: float | None = None,
    ):
        if not isinstance(core, _core.Mesh):
            raise TypeError("use Mesh.of(vertices, triangles), or Mesh.read(path)")
        self._core = core
        self._region = region
        self._edge = edge
        self._islands = islands
        self._chord_error = chord_error
        self._simplification: SimplifyReport | None = None
        self._smoothing: SmoothReport | None = None

    @staticmethod
    def of(vertices: ArrayLike | Any, triangles: ArrayLike | None = None) -> Mesh:
        """The mesh of vertices (n, 3), mm, and triangles (m, 3), the indices of their corners, counter-clockwise seen from
        outside; or, instead of both, of a trimesh.Trimesh, a pyvista.PolyData or a meshio.Mesh, whose lengths are taken as mm.
        A ValueError for other shapes, places that are not finite, and indices of no vertex.
        """
        import numpy as np

        if triangles is None:
            from .io.bridges import parts_of

            vertices, triangles = parts_of(vertices)
        places, corners = np.asarray(vertices, dtype=np.float64), np.asarray(triangles)
        if corners.size and not np.issubdtype(corners.dtype, np.integer):
            raise ValueError(f"expected triangles as whole numbers, found {corners.dtype}")
        if places.ndim != 2 or corners.ndim != 2:
            raise ValueError(f"expected vertices (n, 3) and triangles (m, 3), found {places.shape} and {corners.shape}")
        return Mesh(_core.Mesh.of(places, corners.astype(np.int64)))

    @staticmethod
    def read(
        path: str | os.PathLike[str], chord: float | None = None, angle: float | None = None, solid: str | None = None
    ) -> Mesh:
        """Reads a mesh file (stl, 3mf, ply, obj, off; any letter case), or the solids of a file from a CAD system (step, stp,
        iges, igs; with the extra ``cad``).

        Corners of an STL file that differ by no more than single precision rounds are one, if it would not be closed else.
        The faces of a CAD system become triangles within ``chord`` mm of them (a five-thousandth of the diagonal of the bounds
        unless given) that turn by at most ``angle`` degrees (15 unless given). ``solid`` names the one that is read, of them
        and of the objects of a 3MF, which are joined to one mesh without it.
        """
        name = os.fsdecode(path)
        kind = extension(name, PART_READS)
        if kind in CAD_READS:
            from .io.cad import read

            part = read(name, chord, angle, solid)
            return Mesh.of(part.points, part.triangles)
        if chord is not None or angle is not None or (solid is not None and kind != "3mf"):
            raise ValueError(
                f"{name}: chord and angle are for files from CAD systems, and solid for these and .3mf; a .{kind} holds "
                "triangles"
            )
        data = _core.read_file(name)
        try:
            return Mesh(_core.Mesh.read(data, kind, solid))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None

    def to_trimesh(self) -> trimesh.Trimesh:
        """The mesh as a ``trimesh.Trimesh``: the same vertices and triangles, not processed, with ``cut`` as an attribute of
        faces. An ImportError without trimesh.
        """
        from .io.bridges import package

        attributes = {"cut": self.cut.copy()}
        return package("trimesh").Trimesh(
            self.vertices.copy(), self.triangles.copy(), process=False, face_attributes=attributes
        )

    def to_pyvista(self) -> pyvista.PolyData:
        """The mesh as a ``pyvista.PolyData``, with ``cut`` as data of cells. An ImportError without pyvista."""
        import numpy as np

        from .io.bridges import package

        corners = np.insert(self.triangles.astype(np.int64), 0, 3, axis=1)
        made = package("pyvista").PolyData(self.vertices.copy(), corners.ravel())
        made.cell_data["cut"] = self.cut.astype(np.uint8)
        return made

    def to_meshio(self) -> meshio.Mesh:
        """The mesh as a ``meshio.Mesh`` of triangles, with ``cut`` as data of cells (0 or 1). An ImportError without meshio."""
        import numpy as np

        from .io.bridges import package

        cells = [("triangle", self.triangles.astype(np.int64))]
        return package("meshio").Mesh(self.vertices.copy(), cells, cell_data={"cut": [self.cut.astype(np.uint8)]})

    def __reduce__(self) -> tuple:
        state = (self._core.vertices, self._core.triangles, self._core.known_cut(), self._core.design)
        names = ("_region_volume", "_edge", "_islands", "_chord_error", "_simplification", "_smoothing")
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
        """Vertex positions, (n, 3), mm; read-only, as all arrays of a mesh."""
        return fixed(self._core.vertices)

    @cached_property
    def triangles(self) -> NDArray[np.uint32]:
        """Vertex indices, (m, 3), counter-clockwise seen from outside."""
        return fixed(self._core.triangles)

    @cached_property
    def cut(self) -> NDArray[np.bool_]:
        """For each triangle, whether it lies on the region's boundary rather than on the lattice."""
        return fixed(self._core.cut)

    @cached_property
    def _size(self) -> MeshReport:
        """The figures that need no region."""
        return self._core.measure(None)

    @cached_property
    def _measures(self) -> MeshReport:
        return self._size if self._region_volume is None else self._core.measure(self._region_volume)

    def measure(self) -> MeshReport:
        """All figures: volume, areas, Euler number, connected components, cavities, closedness, bounds; with a region also
        solid fraction, porosity and hydraulic diameter, else None.
        """
        return self._measures

    def summary(self) -> SurfaceReport:
        """The figures that a streamed surface has too (``Solid.save``)."""
        from .reports import SurfaceReport

        keys = ("volume", "area", "area_lattice", "area_cut", "euler", "pieces", "cavities")
        figures = {"triangles": self.counts[1], **{k: self._size[k] for k in keys}}
        figures["islands"] = None if self._islands is None else self._islands.to_dict()
        return SurfaceReport(figures | ({} if self._chord_error is None else {"chord_error": self._chord_error}))

    @property
    def solid_fraction(self) -> float | None:
        """Volume of the solid over volume of its region, 0 to 1; None for a mesh without a region."""
        return None if self._region_volume is None else self.volume / self._region_volume

    @cached_property
    def _region_volume(self) -> float | None:
        return None if self._region is None else self._region.volume(self._edge or self._spacing())

    @property
    def specific_surface(self) -> SpecificSurface:
        """Area over volume, 1/mm: of the solid, of the region, and the lattice's area alone of the region."""
        return self._measures.specific_surface

    @property
    def hydraulic_diameter(self) -> float | None:
        """4 · pore volume / wetted area, mm, where pore volume is the region's without the solid's, and wetted area the
        lattice's; cut faces are not counted. None without a region or a lattice.
        """
        return self._measures.hydraulic_diameter

    @cached_property
    def self_intersections(self) -> int:
        """Pairs of triangles that meet elsewhere than in common corners or edges, decided exactly; a million stands for
        that many or more.
        """
        return self._core.self_intersections(MANY)

    @cached_property
    def quality(self) -> QualityReport | None:
        """Smallest angle, its 5th percentile and largest aspect ratio of the triangles; None without triangles."""
        return self._core.quality()

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
        workers = thread_count(threads)
        spacing, shape, need = self._core.thickness_needs(self._region, wanted)
        fits(need, f"{math.prod(shape):.3g} voxels", edge=spacing, power=3, word="step")
        wall = 2 * self.volume / self.area
        if wanted is not None and wanted > wall / 2:
            warn_caller(
                f"step {wanted:g} mm is more than half the mean wall, {wall:.3g} mm (2 V / A): what is found is the size of "
                f"voxels; use {wall / 8:.2g} mm or less",
            )
        return Thickness(self._core.thickness(self._region, spacing, workers, progress))

    def thickness_at_vertices(
        self,
        step: float | None = None,
        threads: int | None = None,
        progress: Callable[[int, int], Any] | None = None,
    ) -> NDArray[np.float64]:
        """Local thickness of the solid (mm) at each vertex, (n,): the largest of the voxels around it, whose edge is ``step``
        (mm; default as for ``thickness``), NaN where the solid is thinner than they are. The mesh must be closed; a
        ValueError else.
        """
        wanted = None if step is None else positive("step", step)
        workers = thread_count(threads)
        spacing, shape, need = self._core.thickness_needs(None, wanted)
        fits(need, f"{math.prod(shape):.3g} voxels", edge=spacing, power=3, word="step")
        return self._core.thickness_at_vertices(spacing, workers, progress)

    @property
    def porosity(self) -> float | None:
        """One minus the solid fraction."""
        return None if self.solid_fraction is None else 1 - self.solid_fraction

    @property
    def volume(self) -> float:
        """Enclosed volume, mm³."""
        return self._size.volume

    @property
    def area(self) -> float:
        """Area, mm²."""
        return self._size.area

    @property
    def euler(self) -> int:
        """Vertices − edges + triangles: of the surface, twice that of the solid."""
        return self._size.euler

    @property
    def pieces(self) -> int:
        """Number of separate solids; a cavity is not a piece."""
        return self._size.pieces

    @property
    def chord_error(self) -> float | None:
        """How far a mesh made by ``Solid.mesh(chord=...)`` is from the surface (mm), to first order, at thirds and quarters
        of its triangles; None for others.
        """
        return self._chord_error

    @property
    def islands(self) -> IslandsReport | None:
        """The connected components other than the largest that were found when a solid was meshed: how many, how many were
        left out, their volume (mm³), and the largest of them. None for a mesh from a file.
        """
        return self._islands

    @property
    def cavities(self) -> int:
        """Number of closed voids."""
        return self._size.cavities

    @property
    def voids(self) -> list[VoidReport]:
        """The closed voids, from which powder and resin cannot drain, the largest first; as many as ``cavities``."""
        return list(self._size.voids)

    @property
    def closed(self) -> bool:
        """Whether every edge has exactly two triangles, of opposite direction."""
        return self._size.closed

    @property
    def bounds(self) -> list[list[float]]:
        """Lower and upper corner, mm."""
        return [list(corner) for corner in self._size.bounds]

    def simplified(
        self,
        tolerance: float | None = None,
        triangles: int | None = None,
        progress: Callable[[int, int], Any] | None = None,
    ) -> Mesh:
        """A lighter mesh that keeps every guarantee and sharp edges, and the volume but for what changes at these edges and
        at borders of cuts.

        No point of either surface is farther than ``tolerance`` (mm) from the other one; or the mesh is brought down to
        ``triangles``, however far that takes it: ``simplification`` of the result says how far at most. With both,
        whichever is reached first. A mesh that is not closed, or crosses itself, is refused. ``progress(done, total)`` is
        called now and then.
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
    def simplification(self) -> SimplifyReport | None:
        """What ``simplified`` did: triangles, volume and area before and after, and ``deviation``, a bound of the distance
        between the two surfaces in both directions, mm. None for a mesh that was not simplified.
        """
        return self._simplification

    @property
    def smoothing(self) -> SmoothReport | None:
        """What ``Solid.mesh(smooth=True)`` did: triangles, smallest angle and its 5th percentile (degrees) and volume (mm³)
        before and after, numbers of changes. None for a mesh that was not smoothed.
        """
        return self._smoothing

    def within(self, region: Solid | dict | str | os.PathLike[str]) -> Mesh:
        """The same mesh measured against a region: solid fraction, lattice and cut area.

        ``region`` is a Solid, a region from the builders of that name, or the path of a design, of a file with a region
        alone, or of a closed mesh in mm. Raises DesignError for what is no region.
        """
        given = getattr(region, "_core", region)
        given = given.region if isinstance(given, _core.Solid) else given
        if isinstance(given, (str, os.PathLike)):
            given = region_of_file(os.fsdecode(given))
        if isinstance(given, dict):
            given = _core.Region.from_data({"region": given}, os.getcwd())
        if not isinstance(given, _core.Region):
            raise TypeError(f"within takes a Solid, a region or a path, found {region!r}")
        return Mesh(self._core.split_by(given), given, self._edge, self._islands)

    def _transformed(self, matrix: list[list[float]], center: list[float], shift: list[float]) -> Mesh:
        made = Mesh(self._core.transformed(matrix, center, shift))
        a, b, c = matrix
        volume = self._region_volume
        made._region_volume = None if volume is None else volume * abs(determinant(a, b, c))
        return made

    def uncapped(self) -> Mesh:
        """The lattice's own surface alone, open where the region cuts it: without the triangles that ``cut`` marks.

        For shells, and for surfaces that are to be joined to others; what is to be printed stays closed. Volume and
        porosity of an open surface mean nothing. A ValueError where it is not known which triangles are cuts, as in a mesh
        from a file: ``within`` finds them.
        """
        if self._size.area_cut is None:
            raise ValueError("which triangles are cuts is not known: use within(solid) first")
        made = Mesh(self._core.uncapped(), None, self._edge, self._islands)
        if not made.counts[1]:
            raise ValueError("all triangles lie on the region's boundary: there is no lattice in this mesh")
        return made

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh: .stl (binary), .3mf, .ply (binary) or .obj, in any letter case."""
        kind = extension(path, MESH_WRITES)
        vertices, triangles = self._core.counts
        fits(file_size(kind, triangles, vertices), f"{triangles:.3g} triangles", path)
        with whole_file(path) as temporary:
            self._core.write(temporary, kind, TITLE)

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


def region_of_file(name: str) -> _core.Region:
    """The region in a file: a design, a region alone, or a mesh."""
    folder = os.path.dirname(os.path.abspath(name))
    kind = extension(name, (*DESIGNS, *PART_READS))
    if kind in PART_READS:
        return _core.Region.from_data({"region": {"mesh": {"path": os.path.abspath(name)}}}, folder)
    return _core.Region.from_text(read_text(name), kind == "json", name, folder)


def in_memory(given: Any) -> InMemory:
    """A mesh, (vertices, triangles) or one of another package, as a .ply in double precision."""
    import numpy as np

    check_data(given)
    pair = isinstance(given, (tuple, list)) and len(given) == 2
    made = given if isinstance(given, Mesh) else Mesh.of(*given) if pair else Mesh.of(given)
    vertices, triangles = made.counts
    faces = np.empty(triangles, dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, made.triangles
    head = (
        f"ply\nformat binary_little_endian 1.0\ncomment lengths in mm\nelement vertex {vertices}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return InMemory.of(head.encode() + made.vertices.astype("<f8").tobytes() + faces.tobytes(), "ply")
