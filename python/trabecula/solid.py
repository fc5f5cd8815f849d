"""Solids: the field, the surface, voxels and figures of a built design."""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Callable, Sequence
from functools import cached_property

from . import _core
from .base.files import check_place, extension, special, whole_file
from .base.formats import MESH_WRITES, STEP_WRITES, VOXEL_WRITES
from .base.given import flag, number, positions, positive, shard_bytes, thread_count
from .base.islands import check_islands, warn_islands
from .base.machine import file_size, fits, rounded_up
from .base.reproducible import Unchanging
from .errors import warn_caller
from .io.beam_files import save_beams
from .io.implicit import save_implicit
from .layers import Layers
from .mesh import TITLE, Mesh
from .parts import PARTS, check_parts, warn_pieces
from .pictures.seen import Seen
from .quadors import Quadors
from .simulated import Simulated
from .thickness import Thickness
from .transition import Transitions
from .voxels import Voxels

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any, Literal

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .base.islands import Islands
    from .base.memory import InMemory
    from .laws import Law
    from .pictures.viewer import View
    from .reports import (
        BeamsFileReport,
        DanglingReport,
        DesignReport,
        EstimateReport,
        MeshReport,
        QualityReport,
        RepairReport,
        StepReport,
        SurfaceReport,
    )

    Progress = Callable[[int, int], Any]

__all__ = ["Solid"]

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
#: Bytes for each triangle that smoothing takes: copies, links, edges that stay, a tree, debts of volume.
SMOOTHED = 200


class Solid(Seen, Simulated, Unchanging):
    """A region and the lattice in it. Made by ``Design.build``.

    It never changes, so a copy is the solid itself; pickled it is its design, and is built again where that is read.
    """

    def __init__(self, core: _core.Solid, folder: str = "", memory: Sequence[InMemory] = ()):
        self._core = core
        self._folder = folder
        #: Data in memory that its design names, which are there as long as this.
        self._memory = memory

    def __reduce__(self) -> tuple:
        return _rebuilt, (self._core.design, self._folder, self._memory)

    def __repr__(self) -> str:
        (a, b, c), (d, e, f) = self.bounds
        return f"<trabecula.Solid in {d - a:g} x {e - b:g} x {f - c:g} mm, wavelength {self.wavelength:g} mm>"

    @property
    def bounds(self) -> list[list[float]]:
        """Lower and upper corner of the region's bounds, mm."""
        return [list(corner) for corner in self._core.bounds]

    @property
    def wavelength(self) -> float:
        """The smallest wavelength, mm."""
        return self._core.wavelength

    @property
    def skin(self) -> float | None:
        """The least thickness of the skin, mm; None without one."""
        return self._core.skin

    @property
    def warnings(self) -> list[dict[str, str]]:
        """Possible mistakes in the design, as {path, message}."""
        return [{"path": p, "message": m} for p, m in self._core.warnings]

    @property
    def repairs(self) -> dict[str, RepairReport]:
        """What was repaired in each mesh of the region, by the path of its table (``"region.mesh"``); all zero for a clean
        mesh.
        """
        return dict(self._core.repairs)

    @property
    def beams(self) -> dict[str, dict[str, NDArray]]:
        """The graphs of beams by name: ``centers`` (n, 3) and ``radii`` (n,) of hubs, mm, and ``struts`` (m, 2), the hubs
        that each beam joins; with neighbours outside the region whose fillets shape what is in it.
        """
        return {name: {"centers": c, "radii": r, "struts": s} for name, c, r, s in self._core.beams}

    def quadors(self, name: str | None = None) -> Quadors:
        """The beams of a ``name`` (needed only if there are several) as quadrics, for exact queries. They are not cut by the
        region: ``Quadors.whole`` says whether that makes a difference.
        """
        if name is None:
            names = list(self.beams)
            if len(names) != 1:
                raise ValueError(f"name one of the beams: {', '.join(names)}" if names else "the design has no beams")
            name = names[0]
        return Quadors(self, {"name": name})

    def report(self) -> DesignReport:
        """The figures without meshing: level, fraction and thickness of each lattice, lengths and counts of beams, the region,
        the blend and the warnings. ``str(report)`` is what ``trabecula check`` prints.
        """
        return copy.deepcopy(self._report)

    @cached_property
    def _report(self) -> DesignReport:
        return self._core.report()

    def transitions(self) -> Transitions:
        """The transitions between the lattices of a blend: loose and weakly attached components, the narrowest neck, and
        the solid fraction along each. Sampled on the lattices alone, without skin and keep zones.
        """
        return Transitions(self._core.transitions())

    def dangling(
        self, neck: float | None = None, threads: int | None = None, progress: Progress | None = None
    ) -> DanglingReport:
        """Fragments attached by necks thinner than half of ``neck``, or not at all: what the region cuts off the lattice.

        ``neck`` (mm) is the lattice's narrowest wall or neck unless given; a ValueError where that is not known.
        """
        narrowest = min(self._thinnest.values(), default=None) if neck is None else positive("neck", neck)
        if narrowest is None:
            raise ValueError("the lattice's narrowest neck is not known: give neck, mm")
        return self._core.dangling(narrowest, thread_count(threads), progress)

    def field(self, points: ArrayLike) -> NDArray[np.float64]:
        """Values at points (n, 3) in mm: negative in the solid, positive outside, continuous; not a distance."""
        import numpy as np

        given = positions("points", points)
        flat = np.ascontiguousarray(given.reshape(-1, 3))
        return self._core.field(flat).reshape(given.shape[:-1])

    def spacing(self, edge: float | None = None, per_cell: float | None = None) -> float:
        """The grid spacing (mm) of a request: ``edge`` itself, or the smallest wavelength / ``per_cell``. Without a request
        the one that the design's walls need, ``report().spacing``; where that makes more than 20 million triangles, which are
        1 GB of STL, a coarser one that still carries the thinnest wall, and ``mesh`` warns of it.
        """
        if edge is not None and per_cell is not None:
            raise ValueError("give edge or per_cell, not both")
        if per_cell is not None:
            edge = self.wavelength / positive("per_cell", per_cell)
        edge = self._default if edge is None else positive("edge", edge)
        low, high = self.bounds
        extents = [b - a for a, b in zip(low, high, strict=True)]
        least = max(max(extents) / _core.MOST_STEPS, (math.prod(extents) / _core.MOST_CELLS) ** (1 / 3))
        if max(extents) / _core.MOST_STEPS > edge:
            raise ValueError(
                f"grid spacing {edge:g} mm cuts the region's {max(extents):.6g} mm into more than {_core.MOST_STEPS:g} steps; "
                f"use {rounded_up(least):g} mm or more; without a spacing {self._default:.3g} mm is used"
            )
        if edge > self.wavelength / 2:
            raise ValueError(
                f"grid spacing {edge:g} mm is more than half the smallest wavelength, {self.wavelength:g} mm: the lattice is "
                f"not resolved; without a spacing {self._default:.3g} mm is used"
            )
        return edge

    def estimate(self, edge: float | None = None, per_cell: float | None = None) -> EstimateReport:
        """What a surface at this spacing takes: grid cells, triangles, bytes of memory, bytes of a binary STL."""
        return self._need(self.spacing(edge, per_cell))

    def region_volume(self, edge: float | None = None) -> float:
        """Volume of the region, mm³: exact where it is known in closed form, else of its surface at grid spacing ``edge``
        (mm), or a 200th of its extent if that is more.
        """
        return self._core.region.volume(0.0 if edge is None else positive("edge", edge))

    @cached_property
    def _usual(self) -> float:
        """The grid spacing that the walls need, mm."""
        return self.report().spacing

    @cached_property
    def _coarser(self) -> tuple[float, float, float] | None:
        """Where that is too fine for one mesh: the spacing that is used, the one that the walls need, its triangles."""
        return self._core.coarser_spacing()

    @property
    def open_ends(self) -> bool:
        """Whether files of its mesh have no caps on the region's boundary (``surface = "open"`` of a map over tetrahedra).

        ``save`` and the command leave them out; ``mesh`` has them all the same, and ``Mesh.uncapped`` takes them off."""
        return self._core.open_ends

    @property
    def _default(self) -> float:
        """The grid spacing of a mesh unless another is asked for, mm."""
        return self._coarser[0] if self._coarser else self._usual

    @cached_property
    def _thinnest(self) -> dict[str, float]:
        """The thinnest wall or neck of each lattice or graph of beams, mm, by its path, where there is one."""
        report = self.report()
        all_ = {f"lattice.{name}": it.thickness for name, it in report.lattices.items()}
        all_ |= {f"beams.{name}": it.thickness for name, it in report.beams.items()}
        ends = {name: t[0] if isinstance(t, list) else t for name, t in all_.items()}
        return {name: t for name, t in ends.items() if t}

    def _need(self, spacing: float) -> EstimateReport:
        """The estimate; at fine spacings scaled from a coarser one."""
        return self._core.estimate(spacing, self.wavelength / 16)

    def mesh(
        self,
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        islands: Islands = "drop-small",
        chord: float | None = None,
        smooth: bool = False,
    ) -> Mesh:
        """The surface as a closed mesh.

        ``edge`` is the grid spacing, mm, or ``per_cell`` samples on the smallest wavelength; else it is ``spacing()``.
        The result is the same for any number of ``threads``. ``progress(done, total)`` is called now and then.

        ``islands``: what becomes of all pieces but the largest. ``"drop-small"`` leaves out those at the region's boundary
        with less than eight grid cells' volume and a thousandth of the largest one's, and warns of the others; ``"keep"``
        leaves all, with a warning; ``"drop"`` leaves them out; ``"error"`` refuses. ``Mesh.islands`` counts them.

        ``chord``, instead of a spacing, is for beams alone that the region does not cut: no grid is made, triangles follow
        the patches of beams and fillets at a distance of at most ``chord`` (mm) and enclose their exact volume;
        ``Mesh.chord_error`` is the distance reached. All pieces are kept. Such beams are meshed so, at ``report().chord``,
        if no resolution is given and ``smooth`` is not asked for.

        ``smooth`` improves the triangles, as finite elements and simulations want them: slivers are merged, edges flipped and
        vertices moved within the surface. Every guarantee, sharp edges, flat faces and the volume are kept; positions are then
        single-precision numbers. ``Mesh.smoothing`` says what was done. Not for ``chord``.
        """
        check_islands(islands)
        smooth = flag("smooth", smooth)
        if smooth and chord is not None:
            raise ValueError("smooth is for meshes on a grid; with chord the triangles follow the patches of beams")
        if not smooth:
            chord = self._chord_of(chord, edge, per_cell, islands)
        if chord is not None:
            count, _ = self._core.expected_beams(self._chord(chord, edge, per_cell, islands))
            # Places and triangles, their parts while they are joined, and as much again for measuring and writing.
            fits(2 * TRIANGLE * count, f"{count:.3g} triangles", edge=chord, power=1, word="chord")
            core, error = self._core.mesh_beams(chord, thread_count(threads), progress)
            return Mesh(core, self._core.region, chord_error=error)
        spacing = self.spacing(edge, per_cell)
        need = self._need(spacing)
        # Measuring and writing take as much again.
        memory = 2 * need.memory + (SMOOTHED * need.triangles if smooth else 0)
        fits(memory, f"{need.triangles:.3g} triangles", edge=spacing, coarsest=self.wavelength / 2)
        self._warn_coarser(edge, per_cell)
        self._warn_thin(spacing)
        core, others, words = self._core.mesh(spacing, thread_count(threads), progress, islands)
        self._warn_coarse(core.volume() + others.dropped_volume, spacing, pieces=others.found + 1)
        warn_islands(others, words)
        if not smooth:
            return Mesh(core, self._core.region, spacing, others)
        core, report = core.smoothed(progress)
        made = Mesh(core, self._core.region, spacing, others)
        made._smoothing = report
        return made

    def measure(
        self,
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        cluster: str | None = None,
    ) -> MeshReport:
        """The figures of the surface at this spacing, as ``Mesh.measure`` gives them, taken tile by tile while it is made: in
        little more time than meshing, and without holding the mesh in memory. Of beams alone and over tetrahedra it is held.
        ``cluster`` is as for ``save``.
        """
        apart = {"cluster": cluster} if cluster else None
        if self._chord_of(None, edge, per_cell, "drop-small") is not None:
            if apart:
                raise ValueError(OF_BEAMS)
            return self.mesh(edge, per_cell, threads, progress).measure()
        return self._measured(edge, per_cell, threads, progress, apart)[0]

    def volume_error(self, edge: float | None = None, per_cell: float | None = None) -> float | None:
        """The relative error to expect of the volume that lattices and beams have in a mesh on a grid of this spacing, without
        meshing the part: one period of each lattice is meshed and held against its fraction on the torus, and some hubs with
        their beams against their exact volume. The realised error is at most three times as much. None where neither is meshed
        on a grid, over tetrahedra, and of beams that overlap halfway along.
        """
        return self._core.volume_error(self.spacing(edge, per_cell))

    def _measured(
        self,
        edge: float | None,
        per_cell: float | None,
        threads: int | None,
        progress: Progress | None,
        apart: dict[str, Any] | None = None,
    ) -> tuple[MeshReport, QualityReport | None]:
        """The figures of the surface on a grid, and the quality of its triangles; ``apart`` says how it is done in ranges."""
        spacing = self.spacing(edge, per_cell)
        self._warn_coarser(edge, per_cell)
        self._warn_thin(spacing)
        volume = self.region_volume(spacing)
        if apart is None:
            made, quality, islands = self._core.measure(spacing, volume, thread_count(threads), progress)
        else:
            from .jobs import ranges

            made, quality, islands = ranges.measure(self, spacing, volume, threads, progress, **apart)
        self._warn_coarse(made.volume + islands.dropped_volume, spacing, pieces=islands.found + 1)
        return made, quality

    def _chord_of(self, chord: float | None, edge: float | None, per_cell: float | None, islands: str) -> float | None:
        """The chord error that is asked for; that of whole beams if no resolution is; None for a grid."""
        if chord is not None or edge is not None or per_cell is not None or islands in ("drop", "error"):
            return chord
        return self._core.default_chord

    def parts(
        self,
        edge: float | None = None,
        per_cell: float | None = None,
        names: Sequence[str] = PARTS,
        threads: int | None = None,
        progress: Progress | None = None,
        islands: Literal["keep", "error"] = "keep",
    ) -> dict[str, Mesh]:
        """The solids into which a sheet divides its region, as closed meshes by name.

        ``wall`` is what the design makes: the sheet with skin and keep zones. ``lower`` and ``upper`` are what is left of the
        region on either side of the mid-surface, where the cell's function is less and greater than in its middle. ``names``
        says which are wanted, in which order; ``edge``, ``per_cell``, ``threads`` and ``progress`` are those of ``mesh``.

        All come from one grid: the triangles between two of them are the same in both, turned round, with the same
        coordinates to the last bit, and the three volumes (mm³) add up to the region's: to rounding where the region is flat,
        with an error of the order of ``edge``² where it is curved. No piece is dropped, since that would leave a gap: several
        pieces of one part are warned of, or refused by ``islands = "error"``.

        A ValueError if the design is not a sheet (a network, beams, tetrahedra, a blend with any of these), or where its wall
        has no thickness, so that nothing is between lower and upper.
        """
        chosen = check_parts(names)
        if islands not in ("keep", "error"):
            raise ValueError(
                f'islands is {islands!r}; of parts it must be "keep" or "error": a dropped piece would leave a gap'
            )
        spacing = self.spacing(edge, per_cell)
        need = self._need(spacing)
        # Each part has its own copy of what it shares; measuring and writing take as much again.
        most = 2 * len(chosen) * need.memory
        fits(most, f"{need.triangles:.3g} triangles in each part", edge=spacing, coarsest=self.wavelength / 2)
        self._warn_coarser(edge, per_cell)
        self._warn_thin(spacing)
        made = self._core.parts(chosen, spacing, thread_count(threads), progress, islands == "error")
        parts = {}
        for name, (core, others, words) in zip(chosen, made, strict=True):
            if name == "wall":
                self._warn_coarse(core.volume(), spacing)
            warn_pieces(name, others, words)
            parts[name] = Mesh(core, self._core.region, spacing, others)
        return parts

    def _chord(self, chord: float, edge: float | None, per_cell: float | None, islands: str) -> float:
        """A chord error, where nothing is asked for that needs a grid."""
        if edge is not None or per_cell is not None:
            raise ValueError("give a chord error or the spacing of a grid, not both")
        if islands in ("drop", "error"):
            raise ValueError(f'islands = "{islands}" looks for pieces on a grid: give edge or per_cell instead of chord')
        return positive("chord", chord)

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
            if made.solids > max(meant, 1):
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

    def voxels(
        self,
        step: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Voxels:
        """Occupancy on cubic voxels of edge ``step`` (mm) that cover the region's bounds and are centred on them: solid where
        their centres are. Warns where a step that was asked for reaches so far beyond the bounds that the volume may be more
        than 1 % too large.
        """
        spacing, _ = self._voxel_grid(step, per_cell)
        self._warn_thin(spacing, "step")
        made = Voxels(self, {"step": spacing}, threads=thread_count(threads), progress=progress)
        if step is not None or per_cell is not None:
            self._warn_beyond(spacing)
        self._warn_coarse(made.volume, spacing, "step")
        return made

    def _voxel_grid(self, step: float | None, per_cell: float | None) -> tuple[float, int]:
        """The edge of the voxels (mm), and how many there are, if they fit into memory."""
        step = step if step is None else positive("step", step)
        spacing = self.spacing(self._usual if step is None and per_cell is None else step, per_cell)
        low, high = self.bounds
        count = math.prod(math.ceil((b - a) / spacing) for a, b in zip(low, high, strict=True))
        fits(2.0 * count, f"{count:.3g} voxels", edge=spacing, power=3, word="step", coarsest=self.wavelength)
        return spacing, count

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

    def layers(
        self,
        layer: float,
        tolerance: float = 0.001,
        start: float | None = None,
        stop: float | None = None,
        step: float | None = None,
        threads: int | None = None,
        adaptive: float | None = None,
        least: float | None = None,
    ) -> Layers:
        """The layers of the part, for machines: a sequence of ``Layer`` (``z``, ``height``, ``loops``, ``area``), each made
        from the field when it is asked for, without a mesh; and ``save(path)``.

        ``layer`` is their thickness, mm, along z from ``start`` to ``stop`` (mm; default: the region's ends, where the last one
        ends thinner). A layer is the section in its middle, so the sum of area times thickness is the volume by the midpoint
        rule. Contours are within ``tolerance`` (mm) of the section and have its area; corners where surfaces meet are kept.
        ``step`` is the edge (mm) of the cells in which the section is looked for, by default one and a half times
        ``report().spacing``, with beams once; cells that leave it undecided are refined to an eighth.

        ``adaptive`` (mm) is the greatest height of steps on the surface, layer height times the vertical component of the
        surface's unit normal: layers are then as thick as it allows on 95 % of their contours, from ``least`` (mm, by default a
        quarter of ``layer``) to ``layer``.
        """
        coarse = 1.0 if self.beams else 1.5  # crevices between beams show in finer cells only
        spacing = coarse * self._usual if step is None else positive("step", step)
        if spacing > self.wavelength / 2 and step is not None:
            raise ValueError(
                f"step is {spacing:g} mm, more than half the smallest wavelength, {self.wavelength:g} mm: sections would be "
                f"missed; without a step {coarse * self._usual:.3g} mm is used"
            )
        begin = None if start is None else number("start", start)
        end = None if stop is None else number("stop", stop)
        thick, within = positive("layer", layer), positive("tolerance", tolerance)
        cusp = None
        if adaptive is not None:
            cusp = [positive("adaptive", adaptive), thick / 4 if least is None else positive("least", least)]
        elif least is not None:
            raise ValueError("least is for adaptive layers: give adaptive, the greatest height of steps on the surface, mm")
        plan = {"layer": thick, "tolerance": within, "step": spacing, "begin": begin, "end": end, "adaptive": cusp}
        return Layers(self, plan, threads=thread_count(threads))

    def thickness(
        self,
        step: float | None = None,
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Thickness:
        """Local thickness of walls and pores on voxels of edge ``step`` (mm), as ``Mesh.thickness`` of the surface at grid
        spacing ``edge``, or ``per_cell`` samples on the smallest wavelength; without either
        ``Solid.spacing()``.
        """
        wanted = None if step is None else positive("step", step)
        return self.mesh(edge, per_cell, threads).thickness(wanted, threads, progress)

    def view(
        self,
        values: ArrayLike | Callable[[NDArray], ArrayLike] | str | None = None,
        label: str = "",
        edge: float | None = None,
        per_cell: float | None = None,
        **look: Any,
    ) -> View:
        """The solid to turn, meshed at a spacing as for ``mesh``: see ``Mesh.view``. ``values`` may also be what ``render``
        shows as a number: ``"fraction"``, ``"stiffness"``, ``"angle"``, ``"spacing"`` or ``"density"``.
        """
        from .pictures.viewer import view

        return view(self, values, label, edge, per_cell, **look)

    @staticmethod
    def _law(*given: Any, **more: Any) -> Law:
        from .laws import law

        return law(*given, **more)

    def _picture(self) -> Mesh:
        low, high = self.bounds
        return self.mesh(edge=max(self.wavelength / 20, max(b - a for a, b in zip(low, high, strict=True)) / 160))


def _shards_in(name: str) -> str:
    """The folder for the files of an output in several."""
    folder = os.path.splitext(name)[0]
    if os.path.exists(folder):
        raise ValueError(f"{folder} exists; shards go to a new folder of this name")
    return folder


def _rebuilt(design: str, folder: str, memory: Sequence[InMemory] = ()) -> Solid:
    """A solid that was pickled."""
    return Solid(_core.Design.from_text(design).build(folder), folder, memory)
