"""Volume meshes of a solid, of its pore or of both: tetrahedra with named sets, for finite elements and flow."""

from __future__ import annotations

import copy
import os
import warnings
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import NamedTuple

from . import _core
from .errors import DesignWarning
from .files import extension, whole_file
from .formats import VOLUME_WRITES
from .given import number, positive
from .mesh import Mesh
from .texts import counted

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray

    from .reports import VolumeReport

    Progress = Callable[[int, int], Any]

__all__ = ["VolumeMesh", "VolumeSet"]

#: What can be meshed.
OF = ("solid", "pore", "lower", "upper", "all")
#: Dihedral angles (degrees) outside of which tetrahedra are warned of.
SHARP, FLAT = 12, 160
#: Bytes for each tetrahedron: the background, the cut mesh and its faces while they are sorted.
TET_BYTES = 420


class VolumeSet(NamedTuple):
    """A named set of a volume mesh."""

    #: Nodes, ascending.
    nodes: NDArray[np.uint32]
    #: Tetrahedra, ascending.
    elements: NDArray[np.uint32]
    #: Faces (n, 2): tetrahedron, and the number (0 to 3) of the corner opposite to the face.
    faces: NDArray[np.uint32]


class VolumeMesh:
    """Tetrahedra that conform to a solid's surfaces, edges and corners. Made by ``Solid.volume_mesh``."""

    def __init__(self, core: _core.VolumeMesh, design: str = ""):
        self._core = core
        self._design = design

    def __repr__(self) -> str:
        figures = self._figures
        return f"<trabecula.VolumeMesh of {figures.elements} tetrahedra, {figures.nodes} nodes>"

    @cached_property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (n, 3), mm: corners first, then those of edges."""
        return self._core.nodes

    @cached_property
    def elements(self) -> NDArray[np.uint32]:
        """Nodes of each tetrahedron (m, 4) or (m, 10), of positive volume, in the order of VTK, Abaqus and Nastran: corners
        0 1 2 3, then the edges 01 12 02 03 13 23.
        """
        return self._core.elements

    @cached_property
    def domain(self) -> NDArray[np.uint8]:
        """The domain of each tetrahedron, an index of ``domains``; ascending."""
        return self._core.domain

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
        skin or keep zone, and their faces on the boundary.
        """
        return {name: VolumeSet(*self._core.set(name)) for name in self._core.sets}  # type: ignore[misc]

    @cached_property
    def pairs(self) -> NDArray[np.uint32]:
        """Of a periodic mesh (n, 5): each node on upper bounding planes, its image on none of them, and by which of the three
        periods they differ (0 or 1). All other coordinates are equal in every bit.
        """
        return self._core.pairs

    @cached_property
    def _figures(self) -> VolumeReport:
        return self._core.report()

    def report(self) -> VolumeReport:
        """The figures: numbers of elements and nodes, volume, dihedral angles, distance from the surface, domains, sets."""
        return copy.deepcopy(self._figures)

    @property
    def volume(self) -> float:
        """Volume of all domains, mm³."""
        return self._figures.volume

    def boundary(self) -> Mesh:
        """The boundary of all domains together as a closed surface, straight between corners."""
        return Mesh(self._core.boundary())

    def write(self, path: str | os.PathLike[str], E: float = 1.0, nu: float = 0.3) -> None:
        """Writes .inp (Abaqus, CalculiX), .msh (Gmsh 4.1), .vtu (VTK) or .bdf (Nastran), with domains and sets.

        ``E`` (MPa) and ``nu`` are Young's modulus and Poisson's ratio of the material in .bdf, and in the .inp of a periodic
        mesh, which has equations, boundary conditions and six steps and runs as it is.
        """
        kind = extension(path, VOLUME_WRITES)
        elastic = [positive("E", E), number("nu", nu)]
        title = f"Trabecula {_core.__version__}: {os.path.splitext(os.path.basename(os.fsdecode(path)))[0]}"
        with whole_file(path) as temporary:
            self._core.write((temporary, kind, title), elastic)


def warn_flaws(made: VolumeMesh, one: bool) -> None:
    """Warns of several components, if there should be ``one``, of surfaces that cross, and of badly shaped tetrahedra."""
    figures, found = made.report(), []
    if one and figures.pieces > 1:
        found += [f"the mesh has {figures.pieces} components that do not touch: loose ones are not held by supports on another"]
    crossing = made.boundary().self_intersections
    if crossing:
        found += [f"{counted(crossing, 'pair')} of boundary triangles cross, where the void is narrow; use a smaller edge"]
    if figures.min_angle < SHARP or figures.max_angle > FLAT:
        angles = f"{figures.min_angle:.1f} to {figures.max_angle:.1f}"
        found += [f"dihedral angles run from {angles} degrees; a smaller edge mostly brings them to {SHARP} to {FLAT}"]
    for message in found:
        warnings.warn(message, DesignWarning, stacklevel=3)
