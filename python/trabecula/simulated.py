"""What solvers take of a solid, finite elements of it, and what the periodic cell of a lattice does."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from functools import cached_property

from . import _core
from .base.given import flag, number, poisson, positive, thread_count, whole
from .base.machine import fits, rounded_down, rounded_up
from .base.resolution import Resolution, sample_error
from .base.texts import point
from .carrier import Carrier
from .errors import warn_caller
from .volumes import OF, TET_BYTES, VOXEL_BYTES, BeamMesh, ShellMesh, VolumeMesh, VoxelElements, warn_flaws, warn_sharp

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any, Literal

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .reports import ConductivityReport, PermeabilityReport, StiffnessReport

    Progress = Callable[[int, int], Any]

__all__ = ["Simulated"]

#: Bytes for each voxel of a cell: six fields of displacements, residuals and directions, on all grids; three of temperature.
STIFFNESS_BYTES, CONDUCTIVITY_BYTES = 800, 200
#: Bytes of voxels that the interface of two conductors cuts, for each of n² squares: some twelve of 800 bytes.
CUT_BYTES = 10_000
#: Bytes for each node of a pore: nineteen populations, where each comes from, and the states that are combined.
PERMEABILITY_BYTES = 1300
#: Short edges of a volume mesh's tetrahedra as a fraction of the long ones.
SHORT_EDGE = math.sqrt(0.75)
#: Most tetrahedra of a volume mesh for which no size was given: about 2 GB.
MOST_TETS = 5e6
#: Most tetrahedra of any volume mesh, whose nodes and faces have numbers of 32 bits.
POSSIBLE_TETS = 3e8
#: Places along the longest edge of the bounds among which that of the thinnest wall is looked for, and how near to the least
#: thickness others count as thinnest too.
PLACES, THINNEST = 40, 1.02


def _order(given: int, of: str = "tetrahedra") -> int:
    if isinstance(given, bool) or given not in (1, 2):
        raise ValueError(f"order is {given}; it must be 1 (linear {of}) or 2 (quadratic ones)")
    return int(given)


class Simulated(Resolution):
    """Solids that are meshed for solvers, or whose cell is solved for."""

    cell_at: Callable[..., dict[str, NDArray[np.float64]]]
    shares: Callable[..., dict[str, NDArray[np.float64]]]

    def volume_mesh(
        self,
        edge: float | None = None,
        per_cell: float | None = None,
        wall: float | None = None,
        order: int = 1,
        of: str = "solid",
        periodic: bool = False,
        threads: int | None = None,
        progress: Progress | None = None,
        islands: Literal["keep", "drop", "error"] = "keep",
    ) -> VolumeMesh:
        """Tetrahedra that conform to all surfaces, edges and corners of the solid, for finite elements.

        One size: ``edge`` (mm), the longest edge of most tetrahedra; ``per_cell``, edges along the smallest wavelength;
        ``wall``, edges through the thinnest wall or neck. Without one, two through the thinnest wall, at least 16 along the
        wavelength; where that makes more than 5 million tetrahedra, longer ones that the thinnest wall allows, with a warning.

        ``order`` 2 gives quadratic tetrahedra, the nodes of boundary edges on the surface. Nodes of linear
        ones are shifted off curved surfaces by about half the distance of a chord, so that the volume is kept.

        ``of``: ``"solid"``; ``"pore"``, the rest of the region; ``"lower"`` or ``"upper"``, the space on one side of a sheet;
        ``"all"``, the wall and both spaces of a sheet, else solid and pore, with common nodes.

        ``periodic`` is for a box with whole cells: nodes and faces on opposite faces of the box match bit for bit.

        Crumbs, flat tetrahedra at the boundary, and places where it touches itself are left out, ``report().dropped`` is their
        volume. ``islands`` says what becomes of components other than the largest, which no support on that one holds:
        ``"keep"``, with a warning if it is the solid; ``"drop"``; or ``"error"``; the last two of one domain that is not
        periodic.

        Warns of boundary triangles that cross, and of dihedral angles below 12 or above 160 degrees. The same for any number of
        ``threads``. Raises ValueError for an edge greater than the thinnest wall, a mesh beyond the memory there is, a side of
        what is no sheet, ``periodic`` where the solid is not.
        """
        if of not in OF:
            raise ValueError(f'of is "{of}"; it must be {", ".join(OF[:-1])} or {OF[-1]}')
        order, periodic = _order(order), flag("periodic", periodic)
        if islands not in ("keep", "drop", "error"):
            raise ValueError(f'islands is {islands!r}; it must be "keep", "drop" or "error"')
        one = of in ("solid", "lower", "upper") and not periodic
        if islands != "keep" and (periodic or of == "all"):
            what = "a periodic cell, whose components hold together across its faces" if periodic else "all domains together"
            raise ValueError(f'islands is "{islands}"; of {what} it must be "keep"')
        size = self._volume_edge(edge, per_cell, wall)
        share, region = self._core.expected()
        part = {"solid": share, "all": 1.0, "pore": 1 - share}.get(of, 0.5 * (1 - share))
        filled = 12 * max(part, 0.02) * region
        count = filled / size / size / size
        usable = min(self._thinnest_wall()[1] / SHORT_EDGE, self.wavelength / 4)
        if count > MOST_TETS and edge is None and per_cell is None and wall is None:
            used = rounded_down(min(size * (count / MOST_TETS) ** (1 / 3), usable))
            if used > size:
                warn_caller(
                    f"an edge of {used:g} mm is used: two edges through the thinnest wall ({size:.3g} mm) would make about "
                    f"{count:.2g} tetrahedra; give an edge to have them",
                )
                size, count = used, count * (size / used) ** 3
        if math.isfinite(count):
            fits(TET_BYTES * order * count, f"about {count:.2g} tetrahedra", edge=size, power=3, coarsest=usable)
        if count > POSSIBLE_TETS:
            better = rounded_up((filled / POSSIBLE_TETS) ** (1 / 3))
            raise ValueError(
                f"edge {size:.3g} mm makes about {count:.2g} tetrahedra; at most {POSSIBLE_TETS:g} are possible; try edge "
                f"{better:g} mm"
            )
        plan = {"edge": size, "of": of, "order": order, "periodic": periodic, "largest": islands == "drop"}
        made = VolumeMesh(self, plan, threads=thread_count(threads), progress=progress)
        if islands == "error" and (pieces := made.report().pieces) > 1:
            raise ValueError(f"the mesh has {pieces} components that do not touch; drop or keep those other than the largest")
        # What no tetrahedron has is known by the sample that the share is from.
        missing = share * region - made.report().volume
        known = of == "solid" and islands == "keep" and not periodic and missing > sample_error(share) * region
        warn_flaws(made, one=one, missing=missing if known else 0.0)
        return made

    def carrier(self, order: int = 1, threads: int | None = None) -> Carrier:
        """The tetrahedra that carry a lattice over tetrahedra (``map.tets``) as finite elements, each a material by the solid
        fraction of its cell: a model of the whole part by as few elements as there are cells.

        ``order`` 2 gives quadratic tetrahedra, whose boundary edges are bent onto the region's surface. A skin, keep zones and
        a net are left out, with a warning. Raises ValueError for a design that is more or other than one such lattice, for an
        empty set, and for more than 256 domains.
        """
        order = _order(order)
        made = Carrier(self, {"order": order}, threads=thread_count(threads))
        if left := self._core.bodies:
            warn_caller(f"{', '.join(left)}: no part of the carrier, which is the lattice alone")
        return made

    def voxel_elements(
        self,
        step: float,
        least: float = 0.01,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> VoxelElements:
        """Voxels as finite elements: hexahedra over the region's bounds with edges of about ``step`` (mm), stretched so that a
        whole number fits, each with its exact solid fraction.

        Those of which a share of at least ``least`` is solid are elements if they belong to the largest piece by common
        faces. A set of the design has the faces whose centres are at most half a voxel outside its region. Raises ValueError
        for a step beyond the memory there is, and where no voxel has that share.
        """
        size, share = positive("step", step), number("least", least)
        if not 0 < share <= 1:
            raise ValueError(f"least is {share:g}; it must be greater than 0 and at most 1")
        low, high = self.bounds
        count = math.prod((b - a) / size + 1 for a, b in zip(low, high, strict=True))
        fits(VOXEL_BYTES * count, f"{count:.3g} voxels", edge=size, power=3, word="step")
        plan = {"step": size, "least": share}
        return VoxelElements(self, plan, threads=thread_count(threads), progress=progress)

    def shell_mesh(
        self,
        edge: float | None = None,
        per_cell: float | None = None,
        order: int = 1,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> ShellMesh:
        """Shells of a sheet, whether of one lattice or of a blend of sheets: triangles on its mid-surface, whose nodes have the
        wall's thickness. For thin walls, of which solid elements would have to be as small.

        Edges are about ``edge`` (mm) long, or the smallest wavelength over ``per_cell`` (default: 16). ``order`` 2 gives
        quadratic triangles, the nodes of edges on the mid-surface; edges on the border that is no plane normal to an axis stay
        straight, ``report().straight`` is their number. Volume is right where a wall is thin: ∫ t dA differs from that of a
        wall of thickness t by its share t² K / 12, K the Gaussian curvature.

        The same for any number of ``threads``. Warns of a wall that is thicker than two edges. Raises ValueError for what is no
        sheet, for a skin or keep zones, and for a wall without thickness.
        """
        order = _order(order, "triangles")
        size = self.spacing(edge, 16 if edge is None and per_cell is None else per_cell)
        plan = {"edge": size, "quadratic": order == 2}
        made = ShellMesh(self, plan, threads=thread_count(threads), progress=progress)
        if found := made._core.warning:
            warn_caller(f"{found[0]}: {found[1]}")
        warn_sharp(made)
        return made

    def beam_mesh(
        self,
        edge: float | None = None,
        order: int = 2,
        islands: Literal["keep", "drop", "error"] = "keep",
        threads: int | None = None,
    ) -> BeamMesh:
        """Beams alone as line elements along their axes, as far as these are in the region: a model with few unknowns of a
        lattice of slender beams.

        Elements are at most ``edge`` (mm) long; without it each beam has four. ``order`` 2 gives quadratic ones. Each has a
        circular section, the mean of the beam's along it; hubs are joints without size, and fillets are left out. Beams are
        cut where the region's boundary crosses their axes; those that lie in it have whole sections.

        ``islands`` says what becomes of connected components other than the longest: ``"keep"``, with a warning, ``"drop"`` or
        ``"error"``. Raises ValueError for a design that is more or other than one graph of beams.
        """
        order = _order(order, "beams")
        if islands not in ("keep", "drop", "error"):
            raise ValueError(f'islands is {islands!r}; it must be "keep", "drop" or "error"')
        size = None if edge is None else positive("edge", edge)
        plan = {"edge": size, "quadratic": order == 2, "largest": islands == "drop"}
        made = BeamMesh(self, plan, threads=thread_count(threads))
        pieces = made.report().pieces
        if pieces > 1 and islands == "error":
            raise ValueError(f"the beams have {pieces} components that do not touch; drop or keep those other than the longest")
        if pieces > 1:
            warn_caller(
                f"the beams have {pieces} components that do not touch: loose ones are not held by supports on another; "
                'islands = "drop" (--islands drop) leaves all but the longest out',
            )
        if found := made._core.warning:
            warn_caller(f"{found[0]}: {found[1]}")
        return made

    def _thinnest_wall(self) -> tuple[str, float]:
        """Where the thinnest wall is, and its thickness (mm); infinite where none is known."""
        walls = self._thinnest if self.skin is None else {**self._thinnest, "skin": self.skin}
        return min(walls.items(), key=lambda item: item[1], default=("", math.inf))

    def _thinnest_at(self, where: str) -> str:
        """About where the wall of a lattice that varies is thinnest, in words; none where it is the same everywhere, or its
        cells are not known by the point.

        A wall is the thicker the greater the solid fraction and the wavelength, so the product of both is least there.
        """
        import numpy as np

        kind, _, name = where.partition(".")
        lattices = self.report().lattices
        if kind != "lattice" or lattices[name].tets or not isinstance(lattices[name].thickness, list):
            return ""
        low, high = self.bounds
        step = max(b - a for a, b in zip(low, high, strict=True)) / PLACES
        axes = [np.linspace(a, b, max(2, round((b - a) / step) + 1)) for a, b in zip(low, high, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        places = places[self._core.region.distance(places) <= 1e-9 * step]
        if len(lattices) > 1:
            places = places[self.shares(places)[name] > 0]
        cell = self.cell_at(places, name)
        thickness = cell["fraction"] * cell["wavelength"].min(axis=1)
        known = np.isfinite(thickness)  # the map has no cells on the axis of a cylinder
        if not known.any():
            return ""
        thinnest = places[known & (thickness <= THINNEST * thickness[known].min())]
        middle = np.linalg.norm(thinnest - thinnest.mean(axis=0), axis=1).argmin()
        return f" about {point(thinnest[middle].tolist())} mm"

    def _volume_edge(self, edge: float | None, per_cell: float | None, wall: float | None) -> float:
        """The edge (mm) of a request for a volume mesh."""
        if sum(v is not None for v in (edge, per_cell, wall)) > 1:
            raise ValueError("give one of edge, per_cell and wall")
        where, thin = self._thinnest_wall()
        if wall is not None:
            if not where:
                raise ValueError("wall: the thinnest wall of this design is not known; give edge, mm")
            size = thin / positive("wall", wall)
        elif edge is None and per_cell is None:
            size = min(thin / 2, self.wavelength / 16)
        else:
            size = positive("edge", edge) if edge is not None else self.wavelength / positive("per_cell", per_cell)
        # Four of a tetrahedron's six edges are shorter than the longest, by half the root of three.
        if SHORT_EDGE * size > thin:
            raise ValueError(
                f"an edge of {size:.4g} mm leaves less than one tetrahedron through the thinnest wall, {thin:.4g} mm at "
                f"{where}{self._thinnest_at(where)}; use {rounded_down(thin / SHORT_EDGE):g} mm or less"
            )
        if size > self.wavelength / 4:
            what = "wavelength" if self.report().lattices else "scale of the beams"
            raise ValueError(
                f"an edge of {size:.4g} mm is more than a quarter of the {what}, {self.wavelength:g} mm; use "
                f"{rounded_down(self.wavelength / 4):g} mm or less"
            )
        return size

    @cached_property
    def _cell(self) -> _core.Cell:
        """The periodic cell of its lattice or beams. A DesignError where there is none."""
        return _core.Cell.of(self._core, self._folder or os.getcwd())

    def stiffness(
        self,
        n: int = 64,
        E: float = 1.0,
        nu: float = 0.3,
        C: ArrayLike | None = None,
        voxels: bool = False,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> StiffnessReport:
        """The effective stiffness of the periodic cell, of a solid of Young's modulus ``E`` and Poisson's ratio ``nu``, or of a
        stiffness ``C`` (6, 6): stress = C strain in Voigt's order 11 22 33 23 13 12 with engineering shears, world axes, in
        the unit of E; with Young's and shear moduli, anisotropy, bounds, and how sure it is.

        The cell is that of one lattice under an affine map at one level, or of beams by a unit cell; the region plays no
        part. Trilinear finite elements on ``n`` voxels along its edge, weighted by the exact solid fraction of each
        (``voxels``: solid or not by their centres), on n/2 and n/4 too, and the limit of the three.

        Raises DesignError for a design without such a cell, ValueError for a cell that falls apart, for ``n`` below 8 or beyond
        the memory there is, and for a solid that is none.
        """
        import numpy as np

        if C is not None and (E, nu) != (1.0, 0.3):
            raise ValueError("E and nu are of an isotropic solid, C is a stiffness of its own: give one of them")
        given = None if C is None else np.asarray(C, dtype=float)
        if given is not None and given.shape != (6, 6):
            raise ValueError(f"expected C of shape (6, 6), found {given.shape}")
        grid = _voxels(n, STIFFNESS_BYTES), voxels
        solid = number("E", E), poisson("nu", nu)
        return self._cell.stiffness(grid, solid, None if given is None else given.tolist(), (thread_count(threads), progress))

    def conductivity(
        self,
        n: int = 64,
        pore: float = 0.0,
        voxels: bool = False,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> ConductivityReport:
        """The effective conductivity of the periodic cell, (3, 3) relative to the solid's, where the ``pore`` conducts this
        many times as well as the solid; for heat, electricity and diffusion alike. Else as ``stiffness``.
        """
        grid = _voxels(n, CONDUCTIVITY_BYTES, 0 if pore == 0 or voxels else CUT_BYTES), voxels
        return self._cell.conductivity(grid, number("pore", pore), (thread_count(threads), progress))

    def permeability(
        self,
        n: int = 64,
        side: Literal["lower", "upper"] | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> PermeabilityReport:
        """The permeability of the pore of the periodic cell to creeping flow, (3, 3) in mm²: mean flux over the whole cell = -k
        grad p / viscosity; with hydraulic diameter, tortuosity, Kozeny's constant, and how sure it is. Both sides of a sheet
        together, or that of one ``side``.

        Stokes's flow between the exact walls, by a lattice Boltzmann scheme of two relaxation times with interpolated
        bounce-back on ``n`` nodes along the cell's edge, on n/2 and n/4 too, and the limit of the three. Directions in which
        the pore does not go through have zeros, and a warning.

        Raises DesignError for a design without such a cell, ValueError for the side of what is no sheet, for ``n`` below 8 or
        beyond the memory there is.
        """
        if side not in (None, "lower", "upper"):
            raise ValueError(f'side is {side!r}; expected "lower", "upper" or None for both')
        n = _voxels(n, PERMEABILITY_BYTES)
        return self._cell.permeability(n, None if side is None else side == "upper", (thread_count(threads), progress))


def _voxels(n: int, each: float, cut: float = 0) -> int:
    """A number of voxels along an edge that fits the memory, at ``each`` bytes a voxel and ``cut`` a square of the grid."""
    n = whole("n", n, 8, 4096)
    fits(each * n**3 + cut * n**2, f"{n} x {n} x {n} voxels")
    return n
