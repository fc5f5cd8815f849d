"""Solids: the field, the surface, voxels and figures of a built design."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from functools import cached_property

from . import _core
from .base.given import flag, number, positions, positive, thread_count
from .base.islands import check_islands, warn_islands
from .base.machine import fits, rounded_up
from .base.reproducible import Unchanging
from .layers import Layers
from .mesh import Mesh
from .parts import PARTS, check_parts, warn_pieces
from .pictures.seen import Seen
from .quadors import Quadors
from .saved import OF_BEAMS, TRIANGLE, Saved
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
        DanglingReport,
        DesignReport,
        EstimateReport,
        MeshReport,
        QualityReport,
        RepairReport,
    )

    Progress = Callable[[int, int], Any]

__all__ = ["Solid"]

#: Bytes for each triangle that smoothing takes: copies, links, edges that stay, a tree, debts of volume.
SMOOTHED = 200


class Solid(Seen, Simulated, Saved, Unchanging):
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
        their beams against their exact volume; where surfaces of the region that are no planes of the grid cut lattices, a term
        of the third power of the spacing is added. The realised error is at most three times as much. None where neither is
        meshed on a grid, over tetrahedra, and of beams that overlap halfway along.
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
        ``report().spacing``, with beams once; cells that leave it undecided are refined to an eighth, about creases to a 32nd.

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


def _rebuilt(design: str, folder: str, memory: Sequence[InMemory] = ()) -> Solid:
    """A solid that was pickled."""
    return Solid(_core.Design.from_text(design).build(folder), folder, memory)
