"""Volume meshes of a solid, of its pore or of both: tetrahedra with named sets, for finite elements and flow."""

from __future__ import annotations

import copy
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cached_property
from typing import ClassVar

from . import _core
from .base.files import check_place, extension, whole_file
from .base.formats import BEAM_ELEMENT_WRITES, SHELL_WRITES, VOLUME_WRITES, VOXEL_ELEMENT_WRITES
from .base.given import fixed
from .base.texts import counted
from .errors import warn_caller
from .finite_elements import FiniteElements, Load, VolumeSet
from .io.element_mesh import LINES, TRIANGLES
from .mesh import Mesh

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .reports import BeamMeshReport, ShellReport, VolumeReport, VoxelElementsReport

    Progress = Callable[[int, int], Any]

__all__ = ["BeamMesh", "ShellMesh", "VolumeMesh", "VoxelElements"]

#: What can be meshed.
OF = ("solid", "pore", "lower", "upper", "all")
#: Dihedral angles (degrees) outside of which tetrahedra are warned of.
SHARP, FLAT = 12, 160
#: Volume left out, as a share of the mesh, and distance from the surface, as a share of the edge, that are warned of.
LEFT_OUT, FAR = 0.005, 0.3
#: Bytes for each tetrahedron: the background, the cut mesh and its faces while they are sorted.
TET_BYTES = 420
#: Bytes for each voxel of the grid: its fraction, its piece, and nodes and faces of those that are elements.
VOXEL_BYTES = 120


class VolumeMesh(FiniteElements):
    """Tetrahedra that conform to a solid's surfaces, edges and corners. Made by ``Solid.volume_mesh``."""

    _make: ClassVar[Callable[..., _core.VolumeMesh]] = staticmethod(_core.VolumeMesh.make)
    _with_fields = ("vtu", "xdmf", "msh")
    _core: _core.VolumeMesh

    def __repr__(self) -> str:
        figures = self._figures
        return f"<trabecula.VolumeMesh of {figures.elements} tetrahedra, {figures.nodes} nodes>"

    @cached_property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (n, 3), mm: corners first, then those of edges."""
        return fixed(self._core.nodes)

    @cached_property
    def elements(self) -> NDArray[np.uint32]:
        """Nodes of each tetrahedron (m, 4) or (m, 10), of positive volume, in the order of VTK, Abaqus and Nastran: corners
        0 1 2 3, then the edges 01 12 02 03 13 23.
        """
        return fixed(self._core.elements)

    @cached_property
    def domain(self) -> NDArray[np.uint8]:
        """The domain of each tetrahedron, an index of ``domains``; ascending."""
        return fixed(self._core.domain)

    @property
    def domains(self) -> list[str]:
        """Names of the domains: SOLID, PORE, WALL, LOWER, UPPER."""
        return self._core.domains

    @cached_property
    def sets(self) -> Mapping[str, VolumeSet]:
        """The named sets that are not empty.

        X0 X1 Y0 Y1 Z0 Z1: faces on the bounding planes of a region with such planes, each also for each of several domains as
        DOMAIN_X0. CUT: faces on the region's boundary. LATTICE: faces on the lattice's own surface; between solid and pore
        they belong to the solid. Nodes and tetrahedra are those of the faces. SKIN, KEEP_NAME: all nodes and tetrahedra of a
        skin or keep zone, and their faces on the boundary and towards a fluid; of a fluid its faces on them.
        """
        return self._named_sets()

    @cached_property
    def pairs(self) -> NDArray[np.uint32]:
        """Of a periodic mesh (n, 5): each node on upper bounding planes, its image on none of them, and by which of the three
        periods they differ (0 or 1). All other coordinates are equal in every bit.
        """
        return fixed(self._core.pairs)

    def report(self) -> VolumeReport:
        """The figures: numbers of elements and nodes, volume, dihedral angles, distance from the surface, domains, sets."""
        return copy.deepcopy(self._figures)

    def boundary(self) -> Mesh:
        """The boundary of all domains together as a closed surface, straight between corners."""
        return Mesh(self._core.boundary())

    def write(
        self,
        path: str | os.PathLike[str],
        E: float = 1.0,
        nu: float = 0.3,
        hold: Iterable[str] = (),
        load: Mapping[str, Load] | None = None,
        fields: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Writes .inp (Abaqus, CalculiX), .msh (Gmsh 4.1), .msh2 (Gmsh 2.2), .vtu (VTK), .xdmf (with
        arrays in an .h5 of the same name; needs h5py), .bdf (Nastran) or .mesh (Medit), with domains and sets.

        .foam, an empty file that ParaView opens, stands for OpenFOAM: the mesh, in m, is the folder constant/polyMesh, which is
        replaced, of the case, the file's own folder, which may be new. Several domains are cell zones, opposite sides of a
        periodic mesh cyclic patches.
        In .foam, .msh2 and .mesh, where a face can belong to one patch or group only, it belongs to the smallest of its sets.

        ``E`` (MPa) and ``nu`` are Young's modulus and Poisson's ratio of the material in .bdf, and in an .inp that runs as it
        is: that of a periodic mesh, with equations, boundary conditions and six steps, and one with ``load``: by the names of
        sets resultants (N) of uniform tractions, {"X1": (0, 0, -100)}, or pressures (MPa) against their faces, {"BORE": 5},
        while the nodes of the sets ``hold`` do not move.

        ``fields`` are numbers by name, (n,) or (n, k) at nodes or in elements, for .vtu, .xdmf and, with k of 1, 3 or 9, .msh:
        {"depth": solid.field(mesh.nodes)}.
        """
        kind = extension(path, VOLUME_WRITES)
        check_order(kind, self._figures.order)
        if kind == "foam":
            if hold or load or fields:
                raise ValueError("hold, load and fields are not for .foam; give them to the solver")
            return self._write_case(os.fsdecode(path))
        self._write(path, kind, (E, nu), (hold, load), fields, [])

    def _of_elements(self) -> dict[str, NDArray]:
        return {"domain": self.domain}

    def _names_of_domains(self) -> list[str]:
        return self.domains

    def _check_loads(self) -> None:
        if self._figures.pairs:
            raise ValueError("a periodic mesh has steps of its own; leave out hold and load")
        if self.domains not in (["SOLID"], ["WALL"]):
            raise ValueError(f'the mesh has the domains {", ".join(self.domains)}; loads are for of="solid"')

    def _write_case(self, path: str) -> None:
        """The mesh of an OpenFOAM case, which has another name until it is whole, and the file that stands for it."""
        check_case(path)
        constant = os.path.join(os.path.dirname(os.path.abspath(path)), "constant")
        whole = os.path.join(constant, "polyMesh")
        os.makedirs(constant, exist_ok=True)
        with (
            whole_file(path) as temporary,
            open(temporary, "w", encoding="ascii"),
            tempfile.TemporaryDirectory(prefix=".polyMesh-", dir=constant) as scratch,
        ):
            made, old = os.path.join(scratch, "new"), os.path.join(scratch, "old")
            os.mkdir(made)
            self._core.write_poly(made)
            with suppress(FileNotFoundError):
                os.replace(whole, old)
            try:
                os.replace(made, whole)
            except OSError:
                os.replace(old, whole)
                raise


class VoxelElements(FiniteElements):
    """Voxels as finite elements: hexahedra of a regular grid, each with its solid fraction, in one piece. Made by
    ``Solid.voxel_elements``.

    ``write`` makes .inp (Abaqus, CalculiX: C3D8), .msh or .msh2 (Gmsh 2.2), .vtu (VTK) or .xdmf, with fractions and sets. In
    .inp elements are in sets by their solid fraction, in twentieths; with ``hold`` and ``load`` it runs as it is: Young's
    modulus in each set is ``E`` (MPa) times its mean fraction.
    """

    _make = staticmethod(_core.VoxelElements.make)
    _writes = VOXEL_ELEMENT_WRITES
    _core: _core.VoxelElements

    def __repr__(self) -> str:
        figures = self._figures
        return f"<trabecula.VoxelElements of {figures.elements} hexahedra, {figures.nodes} nodes>"

    @cached_property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (n, 3), mm, x fastest."""
        return fixed(self._core.nodes)

    @cached_property
    def elements(self) -> NDArray[np.uint32]:
        """Nodes of each hexahedron (m, 8), in the order of VTK, Abaqus and Gmsh: round the lower face, then the upper one."""
        return fixed(self._core.elements)

    @cached_property
    def fraction(self) -> NDArray[np.float64]:
        """The share of each hexahedron that is solid."""
        return fixed(self._core.fraction)

    @cached_property
    def sets(self) -> Mapping[str, VolumeSet]:
        """The named sets that are not empty: X0 X1 Y0 Y1 Z0 Z1, the faces on the sides of the grid; SURFACE, the rest of the
        boundary; and those of the design. Faces (n, 2) are a hexahedron and the number, from 0, of S1 to S6 of Abaqus.
        """
        return self._named_sets()

    def _of_elements(self) -> dict[str, NDArray]:
        return {"fraction": self.fraction}

    def report(self) -> VoxelElementsReport:
        """The figures: numbers of elements and nodes, solid volume, what was left out, sets."""
        return copy.deepcopy(self._figures)


class ShellMesh(FiniteElements):
    """Triangles on the mid-surface of a sheet, with the wall's thickness at each node. Made by ``Solid.shell_mesh``.

    ``write`` makes .inp (Abaqus, CalculiX: S3 or S6), .bdf (Nastran: CTRIA3 or CTRIA6) or .vtu (VTK), with the thickness at
    nodes and sets. With ``hold`` and ``load`` an .inp runs as it is: the nodes of the sets ``hold`` neither move nor turn, and
    each resultant is that of a uniform traction on the wall's faces at the border. ``fields`` are for .vtu.
    """

    _make = staticmethod(_core.Shells.make)
    _writes = SHELL_WRITES
    _kinds = TRIANGLES
    _of_sets = "edges on the border"
    _has_normals = False
    _core: _core.Shells

    def __repr__(self) -> str:
        figures = self._figures
        return f"<trabecula.ShellMesh of {figures.elements} triangles, {figures.nodes} nodes>"

    @cached_property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (n, 3), mm: corners first, then those of edges."""
        return fixed(self._core.nodes)

    @cached_property
    def elements(self) -> NDArray[np.uint32]:
        """Nodes of each triangle (m, 3) or (m, 6), counter-clockwise seen from the upper side of the sheet: corners 0 1 2, then
        the edges 01 12 20.
        """
        return fixed(self._core.elements)

    @cached_property
    def thickness(self) -> NDArray[np.float64]:
        """The wall's thickness (n,) at each node, mm: the length of the mid-surface's normal between the two faces."""
        return fixed(self._core.thickness)

    @cached_property
    def sets(self) -> Mapping[str, VolumeSet]:
        """The named sets that are not empty: X0 X1 Y0 Y1 Z0 Z1, the edges on the region's bounding planes; BORDER, all edges of
        one triangle only; and those of the design, all triangles within their region. Faces (n, 2) are edges: a triangle, and
        the corner from which the edge goes to the next one.
        """
        return self._named_sets()

    def _of_nodes(self) -> dict[str, NDArray]:
        return {"thickness": self.thickness}

    def report(self) -> ShellReport:
        """The figures: numbers of triangles and nodes, area, volume, thickness, angles, sets."""
        return copy.deepcopy(self._figures)


class BeamMesh(FiniteElements):
    """Beams as line elements along their axes, each with a circular section. Made by ``Solid.beam_mesh``."""

    _make = staticmethod(_core.BeamElements.make)
    _of_sets = "ends of elements"
    _has_normals = False
    _kinds = LINES
    _core: _core.BeamElements

    def __repr__(self) -> str:
        figures = self._figures
        return f"<trabecula.BeamMesh of {figures.elements} elements, {figures.nodes} nodes>"

    @cached_property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (n, 3), mm: ends of elements first, then their middles."""
        return fixed(self._core.nodes)

    @cached_property
    def elements(self) -> NDArray[np.uint32]:
        """Nodes of each element (m, 2) or (m, 3): both ends, then the middle."""
        return fixed(self._core.elements)

    @cached_property
    def radii(self) -> NDArray[np.float64]:
        """The radius (m,) of each element, mm, whose section is the mean of those of its beam along it."""
        return fixed(self._core.radii)

    @cached_property
    def sets(self) -> Mapping[str, VolumeSet]:
        """The named sets that are not empty: X0 X1 Y0 Y1 Z0 Z1, the nodes least and farthest along each axis, and those of the
        design, all nodes within their region. Elements are those between these nodes. Faces (n, 2) are ends of the elements
        that come to them from elsewhere: an element, and 0 or 1.
        """
        return self._named_sets()

    def _of_elements(self) -> dict[str, NDArray]:
        return {"radius": self.radii}

    def report(self) -> BeamMeshReport:
        """The figures: numbers of elements, nodes and beams, length, volume, radii, sets."""
        return copy.deepcopy(self._figures)

    def write(
        self,
        path: str | os.PathLike[str],
        E: float = 1.0,
        nu: float = 0.3,
        hold: Iterable[str] = (),
        load: Mapping[str, Load] | None = None,
        fields: Mapping[str, ArrayLike] | None = None,
        solver: str = "calculix",
    ) -> None:
        """Writes .inp (B32R of CalculiX, B31 or B32 of Abaqus), .bdf (Nastran: CBAR) or .vtu (VTK, with radii), with
        sections, material and sets.

        ``solver`` is whose .inp it is, ``"calculix"`` or ``"abaqus"``: of a circular section the one takes the diameter, the
        other the radius. With ``hold`` and ``load``, as of ``VolumeMesh.write``, it runs as it is: the nodes of the sets
        ``hold`` neither move nor turn, and each resultant is shared by the areas of the ends in its set. ``fields`` are those
        of ``VolumeMesh.write``, for .vtu.
        """
        kind = extension(path, BEAM_ELEMENT_WRITES)
        check_solver(kind, solver, self._figures.order)
        self._write(path, kind, (E, nu), (hold, load), fields, solver == "abaqus")


def check_solver(kind: str, solver: str | None, order: int) -> None:
    """Refuses a solver that is not known, and an order that a format or CalculiX has not."""
    if solver not in (None, "calculix", "abaqus"):
        raise ValueError(f'solver is {solver!r}; it must be "calculix" or "abaqus"')
    if solver == "abaqus" and kind != "inp":
        raise ValueError(f"solver is of .inp, not .{kind}; leave it out")
    if kind == "inp" and solver != "abaqus" and order == 1:
        raise ValueError("CalculiX takes circular sections of quadratic beams alone; make the mesh with order 2, or for abaqus")
    if kind == "bdf" and order == 2:
        raise ValueError(".bdf takes linear beams (CBAR); make the mesh with order 1")


def check_order(kind: str, order: int) -> None:
    """Refuses quadratic tetrahedra where a format has none."""
    if kind in ("foam", "mesh") and order == 2:
        raise ValueError(f".{kind} takes linear tetrahedra; make the mesh with order 1")


def check_case(path: str | os.PathLike[str]) -> None:
    """Refuses a .foam that cannot be written; the folder of its case is made if that one alone is missing."""
    folder = os.path.dirname(os.path.abspath(os.fsdecode(path)))
    check_place(path if os.path.isdir(folder) else folder)


def warn_sharp(made: ShellMesh) -> None:
    """Warns of triangles of a shell with an angle below the least that is usual: how many, and where the worst is."""
    import numpy as np

    if made.report().min_angle >= SHARP:
        return
    corners = made.nodes[made.elements[:, :3]]
    sides = np.roll(corners, -1, axis=1) - corners
    back = -np.roll(sides, 1, axis=1)
    across = np.linalg.norm(np.cross(sides, back), axis=2)
    least = np.degrees(np.arctan2(across, (sides * back).sum(axis=2))).min(axis=1)
    worst, few = least.argmin(), int((least < SHARP).sum())
    place = ", ".join(f"{v:.4g}" for v in corners[worst].mean(axis=0))
    some = f"{counted(few, 'triangle')} of {len(least)} have an angle below {SHARP} degrees"
    message = f"{some}, the least is {least[worst]:.2g} at ({place}) mm: bending there is poor; another edge mostly has none"
    warn_caller(message)


def warn_flaws(made: VolumeMesh, one: bool, missing: float = 0.0) -> None:
    """Warns of what was left out, which is what was dropped or more if more is ``missing`` (mm³), of faces far from the
    surface, of several components, if there should be ``one``, of surfaces that cross, and of badly shaped tetrahedra.
    """
    figures, found = made.report(), []
    out = max(figures.dropped, missing)
    if out > LEFT_OUT * figures.volume:
        share = f"{out:.3g} mm³ ({100 * out / (figures.volume + out):.2g} %)"
        found += [f"{share} is left out where the solid is thinner than an edge; use a smaller edge"]
    if figures.deviation > FAR * max(figures.edge):
        off = f"the boundary is up to {figures.deviation:.2g} mm off the surface"
        found += [f"{off}: the edge is too long for it; use a smaller one"]
    if one and figures.pieces > 1:
        found += [f"the mesh has {figures.pieces} components that do not touch: loose ones are not held by supports on another"]
        found[-1] += '; islands = "drop" (--islands drop) leaves all but the largest out'
    crossing = made.boundary().self_intersections
    if crossing:
        found += [f"{counted(crossing, 'pair')} of boundary triangles cross, where the void is narrow; use a smaller edge"]
    if figures.min_angle < SHARP or figures.max_angle > FLAT:
        angles = f"{figures.min_angle:.1f} to {figures.max_angle:.1f}"
        found += [f"dihedral angles run from {angles} degrees; a smaller edge mostly brings them to {SHARP} to {FLAT}"]
    for message in found:
        warn_caller(message)
