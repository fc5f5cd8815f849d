"""Meshes of elements for other packages: meshio, pyvista. None is imported before it is asked for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    import meshio
    import numpy as np
    import pyvista
    from numpy.typing import NDArray

__all__ = ["ElementMesh"]

#: meshio's names of elements and VTK's numbers, by the number of their nodes: of beams, shells, and volumes.
LINES = {2: ("line", 3), 3: ("line3", 21)}
TRIANGLES = {3: ("triangle", 5), 6: ("triangle6", 22)}
VOLUMES = {4: ("tetra", 10), 8: ("hexahedron", 12), 10: ("tetra10", 24)}


class ElementMesh(ABC):
    """Meshes of elements of one kind that other packages take, with what nodes and elements have, and named sets."""

    #: What the elements are for other packages, by the number of their nodes.
    _kinds: Mapping[int, tuple[str, int]] = VOLUMES

    @property
    @abstractmethod
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (n, 3), mm."""

    def to_meshio(self) -> meshio.Mesh:
        """The mesh as a ``meshio.Mesh``: numbers of nodes and elements under the names that they have in .vtu, the named sets
        as ``point_sets`` and ``cell_sets``, the numbers of domains in ``field_data``. An ImportError without meshio.
        """
        import numpy as np

        from .bridges import package

        elements = self._connected()
        return package("meshio").Mesh(
            self.nodes.copy(),
            [(self._kinds[elements.shape[1]][0], elements.astype(np.int64))],
            point_data={name: values.copy() for name, values in self._of_nodes().items()},
            cell_data={name: [values.copy()] for name, values in self._of_elements().items()},
            field_data={name: np.array([number, 3]) for number, name in enumerate(self._names_of_domains())},
            point_sets={name: nodes.astype(np.int64) for name, (nodes, _) in self._members().items()},
            cell_sets={name: [of.astype(np.int64)] for name, (_, of) in self._members().items()},
        )

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """The mesh as a ``pyvista.UnstructuredGrid``: numbers of nodes and elements under the names that they have in .vtu; of
        each named set numbers of nodes and of elements, 1 in it and 0 elsewhere; the names of domains in ``field_data``. An
        ImportError without pyvista.
        """
        import numpy as np

        from .bridges import package

        elements = self._connected()
        kind = self._kinds[elements.shape[1]][1]
        made = package("pyvista").UnstructuredGrid({kind: elements.astype(np.int64)}, self.nodes.copy())
        counts = len(self.nodes), len(elements)
        for data, arrays in ((made.point_data, self._of_nodes()), (made.cell_data, self._of_elements())):
            for name, values in arrays.items():
                data[name] = values.copy()
        for name, members in self._members().items():
            for data, of, count in zip((made.point_data, made.cell_data), members, counts, strict=True):
                flags = np.zeros(count, dtype=np.uint8)
                flags[of] = 1
                data[name] = flags
        if names := self._names_of_domains():
            made.field_data["domains"] = names
        return made

    @abstractmethod
    def _connected(self) -> NDArray[np.uint32]:
        """The nodes of each element, in VTK's order."""

    def _of_nodes(self) -> dict[str, NDArray]:
        """What each node has."""
        return {}

    def _of_elements(self) -> dict[str, NDArray]:
        """What each element has."""
        return {}

    @abstractmethod
    def _members(self) -> dict[str, tuple[NDArray, NDArray]]:
        """Nodes and elements of each set."""

    def _names_of_domains(self) -> list[str]:
        """The names of the domains, if there are any."""
        return []
