"""Tetrahedral meshes: the domain of a lattice that follows the part's own shape."""

from __future__ import annotations

import copy
import os
from functools import cached_property
from typing import TYPE_CHECKING

from . import _core
from .base.files import extension, read_text, whole_file
from .base.formats import TET_READS, TET_WRITES
from .base.given import fixed, thread_count
from .base.reproducible import Unchanging
from .base.transforms import Transformed
from .design import Design
from .errors import DesignError, warn_caller
from .io.element_mesh import ElementMesh
from .mesh import Mesh
from .pictures.drawn import Picture

if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray

    from .reports import TetMeshReport

    #: The rows of M, c and s of x ↦ c + M (x − c) + s.
    Affine = tuple[list[list[float]], list[float], list[float]]

__all__ = ["TetMesh"]


class TetMesh(Picture, Transformed, Unchanging, ElementMesh):
    """A tetrahedral mesh, checked: conforming, every tetrahedron of positive volume.

    Made by ``TetMesh.of`` a design, or read from a file by ``TetMesh.read``. It never changes, and its arrays are read-only:
    ``moved``, ``scaled`` and ``rotated`` give another. So a copy is the mesh itself. Pickled it is the design or the file's
    name, and is made again where that is read: the same in every bit.
    """

    def __init__(self, core: _core.TetMesh, maker: str, given: tuple, moves: tuple[Affine, ...] = ()):
        self._core = core
        #: What of the core made it and of what; the affine maps since then.
        self._plan = maker, given, moves

    def __reduce__(self) -> tuple:
        return _again, self._plan

    @staticmethod
    def of(design: Design | dict | str | os.PathLike[str], lattice: str | None = None, threads: int | None = None) -> TetMesh:
        """The tetrahedral mesh that a design's ``map.tets`` asks for: of the lattice of this name, or of the first that has
        one. A design may also be the path of its file, or plain data; keys other than the region and the mesh are left
        alone. The same for any number of ``threads``.

        Raises DesignError for anything wrong, and warns (DesignWarning) of possible mistakes: thin walls that are lost,
        slivers, several pieces.
        """
        threads = thread_count(threads)
        if isinstance(design, Design):
            return made_by("from_data", design.to_dict(), design.folder or os.getcwd(), lattice, threads=threads)
        if isinstance(design, dict):
            return made_by("from_data", design, os.getcwd(), lattice, threads=threads)
        name = os.fsdecode(design)
        kind = extension(name, ("toml", "json"))
        folder = os.path.dirname(os.path.abspath(name))
        return made_by("from_text", read_text(name), kind == "json", name, folder, lattice, threads=threads)

    @staticmethod
    def read(path: str | os.PathLike[str], unit: str | None = None, split: bool = False) -> TetMesh:
        """Reads a file of tetrahedra: vtu or vtk; with the extra ``fe`` also msh, inp, med, mesh and others.

        ``unit`` is that of its coordinates ("mm" unless given). Hexahedra, wedges and pyramids are refused unless ``split``,
        which cuts them into tetrahedra that fit face to face.

        Raises ValueError for what is no conforming mesh: inverted or flat tetrahedra, hanging nodes, nodes in one place.
        """
        name = os.path.abspath(os.fsdecode(path))
        extension(name, TET_READS)
        try:
            return made_by("read", name, os.getcwd(), unit, split)
        except DesignError as error:
            raise ValueError(str(error)) from None

    def __repr__(self) -> str:
        nodes, tets = self.counts
        return f"<trabecula.TetMesh {tets} tetrahedra, {nodes} nodes>"

    @property
    def counts(self) -> tuple[int, int]:
        """Numbers of nodes and tetrahedra."""
        return self._core.counts

    @cached_property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes, (n, 3), mm."""
        return fixed(self._core.nodes)

    @cached_property
    def tets(self) -> NDArray[np.uint32]:
        """The nodes of each tetrahedron, (m, 4), of positive volume: (b − a) × (c − a) · (d − a) > 0."""
        return fixed(self._core.tets)

    @cached_property
    def zones(self) -> NDArray[np.int64]:
        """The zone of each tetrahedron, a number of the mesher's own; empty where there are none."""
        return fixed(self._core.zones)

    @property
    def zone_names(self) -> dict[str, list[int]]:
        """Numbers of the zones of each name in the file: groups, families, element sets. Elements of one group that are of
        other groups too have a number of their own, so a name may have several numbers and a number several names.
        """
        names: dict[str, list[int]] = {}
        for number, name in self._core.zone_names:
            names.setdefault(name, []).append(number)
        return names

    @cached_property
    def least_dihedral(self) -> NDArray[np.float64]:
        """The least dihedral angle of each tetrahedron, degrees; 70.5 in a regular one."""
        return fixed(self._core.shapes()[0])

    @cached_property
    def sizes(self) -> NDArray[np.float64]:
        """The size of each tetrahedron: the edge (mm) of a regular one of its volume."""
        return fixed(self._core.shapes()[1])

    @property
    def warnings(self) -> list[dict[str, str]]:
        """Possible mistakes, as {path, message}."""
        return [{"path": p, "message": m} for p, m in self._core.warnings]

    def report(self) -> TetMeshReport:
        """The figures: shapes and sizes, the fit to the region (None without one), what made the mesh, the warnings."""
        return self._core.report()

    @property
    def volume(self) -> float:
        """Volume, mm³."""
        return self.report().quality.volume

    def _transformed(self, matrix: list[list[float]], center: list[float], shift: list[float]) -> TetMesh:
        maker, given, moves = self._plan
        return TetMesh(self._core.transformed(matrix, center, shift), maker, given, (*moves, (matrix, center, shift)))

    def boundary(self) -> Mesh:
        """The boundary as a triangle mesh."""
        return Mesh(self._core.boundary())

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh: vtu (with ``least_dihedral`` and ``size`` of each tetrahedron); with the extra ``fe`` msh, inp, med,
        mesh.

        Zones keep their numbers in all of them, and their names in .inp (element sets), .med (groups) and .msh (physical
        groups, where a name is that of one number). In .inp, and in .med if it is not negative, the number n is the name ZONE_n
        of a set. Warns of names that are lost.
        """
        from .io import elements

        kind = extension(path, TET_WRITES)
        names = elements.kept_names(kind, self._core.zone_names)
        if kind == "vtu":
            with whole_file(path) as temporary:
                self._core.write_vtu(temporary)
            return
        elements.needed(kind)
        with whole_file(path) as temporary:
            elements.write(temporary, kind, self.nodes, self.tets, self.zones, names)

    def _connected(self) -> NDArray[np.uint32]:
        return self.tets

    def _of_elements(self) -> dict[str, NDArray]:
        zones = {"zone": self.zones} if len(self.zones) else {}
        return zones | {"least_dihedral": self.least_dihedral, "size": self.sizes}

    def _members(self) -> dict[str, tuple[NDArray, NDArray]]:
        import numpy as np

        found = {name: np.flatnonzero(np.isin(self.zones, numbers)) for name, numbers in self.zone_names.items()}
        return {name: (np.unique(self.tets[of]), of) for name, of in found.items()}

    def _picture(self) -> Mesh:
        return self.boundary()


def made_by(maker: str, *given: Any, **how: Any) -> TetMesh:
    """The mesh that the core makes so; its warnings are raised."""
    made = TetMesh(getattr(_core.TetMesh, maker)(*given, **how), maker, copy.deepcopy(given))
    for path, message in made._core.warnings:
        warn_caller(message, path)
    return made


def _again(maker: str, given: tuple, moves: tuple[Affine, ...]) -> TetMesh:
    """A mesh that was pickled."""
    core = getattr(_core.TetMesh, maker)(*given)
    for move in moves:
        core = core.transformed(*move)
    return TetMesh(core, maker, given, moves)
