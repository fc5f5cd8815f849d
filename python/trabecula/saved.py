"""What solids write to files: their surface, at once or in ranges, voxels, beams, STEP, functions."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable

from .base.files import check_place, extension, special, whole_file
from .base.formats import MESH_WRITES, STEP_WRITES, VOXEL_WRITES
from .base.given import positive, shard_bytes, thread_count
from .base.islands import check_islands, warn_islands
from .base.machine import file_size, fits
from .base.resolution import Resolution
from .errors import warn_caller
from .io.beam_files import save_beams
from .io.implicit import save_implicit
from .mesh import TITLE

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    from .base.islands import Islands
    from .mesh import Mesh
    from .reports import BeamsFileReport, EstimateReport, StepReport, SurfaceReport

    Progress = Callable[[int, int], Any]

__all__ = ["OF_BEAMS", "OPEN_IN_RANGES", "TRIANGLE", "Saved"]

#: Why a surface with open ends, and why beams alone are not made in ranges.
OPEN_IN_RANGES = (
    'the design\'s ends are open (surface = "open" of map.tets), and a surface is made in ranges of tiles with its caps; '
    "leave resume, cluster and shards out"
)
OF_BEAMS = (
    "beams alone are meshed by their own patches, not on a grid whose tiles can be made apart; leave resume and cluster out, "
    "or give an edge"
)
#: Bytes for each triangle of a mesh without a grid: its numbers and half a place, twice while parts are joined.
TRIANGLE = 2 * (12 + 12)
#: Bytes for each triangle of the temporary files of vertices and triangles.
SPOOLED = 24


class Saved(Resolution):
    """Solids that are written to files."""

    mesh: Callable[..., Mesh]
    _need: Callable[[float], EstimateReport]
    _chord: Callable[..., float]
    _chord_of: Callable[..., float | None]

    @property
    @abstractmethod
    def open_ends(self) -> bool:
        """Whether files of its mesh have no caps on the region's boundary."""

    @property
    @abstractmethod
    def _usual(self) -> float:
        """The grid spacing that the walls need, mm."""

    def _stream_beams(self, path: str | os.PathLike[str], chord: float, threads: int | None) -> SurfaceReport:
        """Beams alone, those of equal hubs made once, hub by hub into a file."""
        need, held = self._core.expected_beams(chord)
        fits(2 * TRIANGLE * held, f"{held:.3g} triangles of hubs that differ", edge=chord, power=1, word="chord")
        fits(file_size("stl", need), f"{need:.3g} triangles", path, chord, 1, "chord")
        if special(os.fsdecode(path)):
            return self._core.stream_beams(path, chord, thread_count(threads))
        with whole_file(path) as temporary:
            return self._core.stream_beams(temporary, chord, thread_count(threads))

    def check_room(self, path: str | os.PathLike[str], edge: float | None = None, per_cell: float | None = None) -> None:
        """Raises ValueError if the disk has no room for the mesh file ``path`` at this spacing and the temporary files that
        it is made from; meshes nothing.
        """
        spacing = self.spacing(edge, per_cell)
        need = self._need(spacing).triangles
        kind = extension(path, MESH_WRITES)
        size = file_size(kind, need) * (2 if kind == "3mf" else 1) + (0 if kind == "stl" else SPOOLED * need)
        fits(size, f"{need:.3g} triangles", path, spacing, coarsest=self.wavelength / 2)

    def save(
        self,
        path: str | os.PathLike[str],
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        islands: Islands = "drop-small",
        chord: float | None = None,
        resume: bool = False,
        cluster: str | None = None,
        new: bool = False,
        shards: float | None = None,
    ) -> SurfaceReport:
        """Streams the surface to a mesh file (.stl, .3mf, .ply or .obj) without holding it in memory, and gives its figures.

        The bytes are those of ``mesh(…).write(path)``, or, where the design has ``open_ends``, of
        ``mesh(…).uncapped().write(path)``, with the figures of the closed surface. ``islands`` and
        ``chord`` are as for ``mesh``; with ``chord`` the mesh is held in memory unless the file is an STL.

        An .stl is written at once; for the others vertices and triangles go to temporary files beside it, which are gone at
        the end, whatever that is.

        With ``resume`` an .stl is made in ranges of tiles, which stand in the folder ``path``.parts with checksums as soon as
        they are made. After any end the same call goes on there, unless a ``new`` run is wanted; at the end the folder is gone.
        With ``cluster`` the ranges are made by the workers of a Dask cluster, an address or "local:N" (extra ``scale``). With
        ``shards`` (GB) the output is a folder with the name of ``path`` without .stl: files of about this size, the triangles
        in the same order, and ``manifest.json``, with their number, bytes and SHA-256; it may have more than 2³² triangles.
        """
        size = shard_bytes(shards)
        apart = {"cluster": cluster, "new": new, "shards": size} if resume or cluster or new or size else None
        return self._save(path, edge, per_cell, threads, progress, islands, chord, apart=apart)

    def save_step(
        self,
        path: str | os.PathLike[str],
        tolerance: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        protocol: str = "ap214",
        assembly: bool | None = None,
    ) -> StepReport:
        """Writes a STEP file (.step or .stp; mm) of smooth faces for CAD systems, and gives its figures. Each connected
        component is a solid, with a warning of several of a lattice. ``protocol`` is "ap214" or "ap242".

        Beams alone are exact: cylinders, cones and balls are written as such, other beams as surfaces of revolution, fillets as
        rational B-splines; where a box, a tetrahedron, half-spaces or an intersection of these cuts them, the cuts are planar
        faces. A ValueError for other regions that cut them, and beams that run into each other without a node.

        With ``assembly`` a lattice of beams is one, of which each part is a hub with its half-beams, closed by planar faces
        where beams are halved: equal ones are written once and placed. None makes it one where there are more than 2,000 hubs
        and at most half as many distinct ones; False keeps every connected component one solid.

        Of lattices and blends of them in a box the surface is bicubic patches, with planar faces in the box's planes.
        Patches are no farther than ``tolerance`` (mm; default: a thousandth of ``wavelength``) from the surface, and have its
        normal at their corners; ``deviation`` (mm) and ``angle`` (degrees, between the normals of adjacent patches) of the
        report say how near they come. A ValueError for other regions, skins, keep zones, lattices over tetrahedra and blends
        with beams.
        """
        extension(path, STEP_WRITES)
        name = os.path.splitext(os.path.basename(os.fsdecode(path)))[0]
        within = None if tolerance is None else positive("tolerance", tolerance)
        with whole_file(path) as temporary:
            made = self._core.write_step(temporary, (name, protocol), within, assembly, thread_count(threads), progress)
            meant = sum(of.pieces or 1 for of in self.report().beams.values())  # of beams, those that do not touch by design
            if made.parts is None and made.solids > max(meant, 1):  # parts of an assembly touch in their planar faces
                warn_caller(
                    f"the file has {made.solids} solids that do not touch: a STEP file keeps all components, of which meshes "
                    "drop the small ones",
                )
            return made

    def save_beams(
        self, path: str | os.PathLike[str], chord: float | None = None, mesh: bool = True, threads: int | None = None
    ) -> BeamsFileReport:
        """Writes the beams themselves rather than their surface, and gives the file's figures. A ValueError for whatever else a
        design has: lattices, a skin, keep zones. What the format cannot hold is warned of, and stands in ``lost``.

        A .3mf has the beam lattice extension 1.2.0: frusta of cones whose radii are within ``chord`` (mm; default: a fiftieth
        of the thinnest beam's radius) of those of the beams, so that cylinders are one each and beams with a waist several;
        hubs larger than their beams as balls; the region's mesh, by which readers clip, where it cuts beams; sets of all beams
        and of those that are cut. Fillets are left out. With ``mesh``, a coarse mesh goes with them for programs that do not
        know the extension.

        A file has the beams of which something is in the region, whole where it cuts them. Others than .3mf are graphs of nodes
        and beams, in decimals that read back to the same numbers:
        .ltcx (nTopology, radii at nodes), .csv (a row of end points and radii for each beam), .json, .vtu, .obj (lines without
        radii), .inp (Abaqus B31) and .bdf (Nastran CBAR, numbers of sixteen characters), these two with a circular section for
        each radius.
        """
        return save_beams(self, path, None if chord is None else positive("chord", chord), mesh, thread_count(threads))

    def save_implicit(self, path: str | os.PathLike[str]) -> dict[str, Any]:
        """Writes the part as a function of position to a .3mf with the volumetric and implicit extensions (0.8.0, a draft):
        exact, and a few kilobytes in addition to a region's mesh. Gives ``nodes`` of the function, ``triangles`` of the mesh in
        the file (the bounds, unless the region is a mesh) and ``bytes``.

        The function is ``field``, in mm. A lattice may be of any series, with an affine or Spartan map; its level an iso,
        fraction or pore that does not vary, or an iso that is a linear grade or a formula; the region a box, ball, cylinder,
        half-space, their combinations and offsets, or a mesh. A ValueError for all else: blends, skins, keep zones, solved
        maps, thicknesses, beams.
        """
        return save_implicit(self, path)

    def _save(
        self,
        path: str | os.PathLike[str],
        edge: float | None,
        per_cell: float | None,
        threads: int | None,
        progress: Progress | None,
        islands: Islands,
        chord: float | None,
        accept: Callable[[SurfaceReport], Any] = lambda made: None,
        apart: dict[str, Any] | None = None,
    ) -> SurfaceReport:
        """As ``save``; what ``accept`` or a warning raises leaves no file behind. ``apart`` says how it is made in ranges."""
        check_islands(islands)
        kind = extension(path, MESH_WRITES)
        check_place(path)
        if apart is not None:
            return self._save_in_ranges(path, edge, per_cell, threads, progress, islands, chord, accept, apart)

        def written(made: Mesh) -> SurfaceReport:
            summary = made.summary()
            accept(summary)
            (made.uncapped() if self.open_ends else made).write(path)
            return summary

        if self.open_ends:
            return written(self.mesh(edge, per_cell, threads, progress, islands, chord=chord))
        chord = self._chord_of(chord, edge, per_cell, islands)
        if chord is not None and kind != "stl":
            return written(self.mesh(chord=self._chord(chord, edge, per_cell, islands), threads=threads, progress=progress))
        if chord is not None:
            return self._stream_beams(path, self._chord(chord, edge, per_cell, islands), threads)
        spacing = self.spacing(edge, per_cell)
        self._warn_coarser(edge, per_cell)
        if special(os.fsdecode(path)):  # a stream cannot be gone back in, to write the count
            return written(self.mesh(spacing, None, threads, progress, islands))
        self.check_room(path, spacing)
        self._warn_thin(spacing)
        with whole_file(path) as temporary:
            summary, words = self._core.stream((temporary, kind, TITLE), spacing, thread_count(threads), progress, islands)
            self._accept(summary, words, spacing, accept)
        return summary

    def _accept(self, made: SurfaceReport, words: str, spacing: float, accept: Callable[[SurfaceReport], Any]) -> None:
        """Warns of what may be wrong with a surface before its file gets its name."""
        assert made.islands is not None  # on a grid they are looked for
        self._warn_coarse(made.volume + made.islands.dropped_volume, spacing, pieces=made.islands.found + 1)
        warn_islands(made.islands, words)
        accept(made)

    def _save_in_ranges(
        self,
        path: str | os.PathLike[str],
        edge: float | None,
        per_cell: float | None,
        threads: int | None,
        progress: Progress | None,
        islands: Islands,
        chord: float | None,
        accept: Callable[[SurfaceReport], Any],
        apart: dict[str, Any],
    ) -> SurfaceReport:
        from .jobs import ranges

        name = os.fsdecode(path)
        if extension(path, MESH_WRITES) != "stl" or special(name):
            raise ValueError(f"{name}: a surface is made in ranges as .stl only, to a file; leave resume and cluster out")
        if self.open_ends:
            raise ValueError(OPEN_IN_RANGES)
        if self._chord_of(chord, edge, per_cell, islands) is not None:
            raise ValueError(OF_BEAMS)
        name = _shards_in(name) if apart.get("shards") else name
        spacing = self.spacing(edge, per_cell)
        self._warn_coarser(edge, per_cell)
        self._warn_thin(spacing)

        def accepted(made: SurfaceReport, words: str) -> None:
            self._accept(made, words, spacing, accept)

        return ranges.save(self, name, spacing, islands, threads, progress, accept=accepted, **apart)

    def save_voxels(
        self,
        path: str | os.PathLike[str],
        step: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        cluster: str | None = None,
        new: bool = False,
        shards: float | None = None,
    ) -> dict[str, Any]:
        """Writes the voxels that ``voxels`` gives to a file (.npy, .vti) without holding them in memory: layers stand in the
        folder ``path``.parts as soon as they are made, and after any end the same call goes on there, as for ``save`` with
        ``resume``. With ``shards`` (GB) the output is a folder with the name of ``path`` without its ending: files of about
        this size, whole layers each, ``manifest.json``, and of .vti ``all.pvti``, by which ParaView opens them as one. Gives
        ``shape``, ``step`` and ``origin`` (mm), ``volume`` (mm³).
        """
        apart = {"cluster": cluster, "new": new, "shards": shard_bytes(shards)}
        return self._save_voxels(path, step, per_cell, threads, progress, apart)

    def _save_voxels(
        self,
        path: str | os.PathLike[str],
        step: float | None,
        per_cell: float | None,
        threads: int | None,
        progress: Progress | None,
        apart: dict[str, Any],
        settle: Callable[[], Any] = lambda: None,
    ) -> dict[str, Any]:
        from .jobs import ranges

        name, kind = os.fsdecode(path), extension(path, VOXEL_WRITES)
        check_place(path)
        if special(name):
            raise ValueError(f"{name} is a device or a pipe; voxels are made in ranges to a file")
        name = _shards_in(name) if apart.get("shards") else name
        spacing = self.spacing(self._usual if step is None and per_cell is None else step, per_cell)
        self._warn_thin(spacing, "step")

        def accept(volume: float) -> None:
            if step is not None or per_cell is not None:
                self._warn_beyond(spacing)
            self._warn_coarse(volume, spacing, "step")
            settle()

        return ranges.save_voxels(self, name, kind, spacing, threads, progress, accept=accept, **apart)


def _shards_in(name: str) -> str:
    """The folder for the files of an output in several."""
    folder = os.path.splitext(name)[0]
    if os.path.exists(folder):
        raise ValueError(f"{folder} exists; shards go to a new folder of this name")
    return folder
