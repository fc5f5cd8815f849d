"""Finite elements: what all meshes for them have in common."""

from __future__ import annotations

import math
import os
import re
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import ClassVar, NamedTuple

from . import _core
from .base.files import extension, whole_file
from .base.given import fixed, number, poisson, positive
from .base.reproducible import Reproducible
from .io.element_mesh import ElementMesh

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any, TypeAlias

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .base.record import Report
    from .base.resolution import Resolution

__all__ = ["FiniteElements", "Load", "VolumeSet", "check_steps"]

#: A load on a set: the resultant of a uniform traction (three numbers, N), or a pressure against its faces (one, MPa).
Load: TypeAlias = "Sequence[float] | float"
#: Numbers that a field of a .msh may have each.
GMSH = (1, 3, 9)


class VolumeSet(NamedTuple):
    """A named set of a volume mesh."""

    #: Nodes, ascending.
    nodes: NDArray[np.uint32]
    #: Tetrahedra, ascending.
    elements: NDArray[np.uint32]
    #: Faces (n, 2): tetrahedron, and the number (0 to 3) of the corner opposite to the face.
    faces: NDArray[np.uint32]


class FiniteElements(Reproducible, ElementMesh):
    """What meshes for finite elements have in common: named sets, forces at nodes, files."""

    #: What a set needs that is held or loaded.
    _of_sets = "faces on the boundary"
    #: Whether that has a normal for a pressure to act along.
    _has_normals = True
    #: The formats of its files.
    _writes: ClassVar[tuple[str, ...]]
    #: Those with fields.
    _with_fields: tuple[str, ...] = ("vtu", "xdmf")
    _core: _core.VolumeMesh | _core.VoxelElements | _core.Shells | _core.BeamElements
    _solid: Resolution

    @property
    @abstractmethod
    def elements(self) -> NDArray[np.uint32]:
        """Nodes of each element, in VTK's order."""

    @property
    @abstractmethod
    def sets(self) -> Mapping[str, VolumeSet]:
        """The named sets that are not empty."""

    @cached_property
    def _figures(self) -> Any:
        return self._core.report()

    @abstractmethod
    def report(self) -> Report:
        """The figures."""

    @property
    def volume(self) -> float:
        """Volume of the solid, mm³: of all domains of tetrahedra, of each hexahedron its solid share, of shells the thickness
        integrated over the area, of beams area times length, where hubs count for each of theirs.
        """
        return self._figures.volume

    def _named_sets(self) -> Mapping[str, VolumeSet]:
        found = {name: self._core.set(name) for name in self._core.sets}
        return MappingProxyType({name: VolumeSet(*map(fixed, arrays)) for name, arrays in found.items() if arrays})

    def forces(self, name: str, force: Load) -> tuple[NDArray[np.uint32], NDArray[np.float64]]:
        """Nodes of the faces of a set and forces (n, 3) at them, N: what a uniform traction with the resultant ``force`` (three
        numbers, N) does to the finite elements, force · ∫ Nᵢ dA / ∫ dA with their shape functions Nᵢ; or a pressure (one
        number, MPa, against the faces), −p ∫ Nᵢ n dA. Raises ValueError for a set that is not there, and for a pressure on
        edges or ends.
        """
        found = self._core.forces(self._with_faces("name", name), self._load(name, force))
        assert found is not None  # the set was found
        return found

    def _load(self, name: str, value: Load) -> list[float] | float:
        """The load on a set: a resultant of three finite numbers, not all 0, or a pressure."""
        what = f"the load on {name}"
        if isinstance(value, Iterable):
            found = [number(what, v) for v in value]
            if len(found) != 3 or not all(map(math.isfinite, found)) or not any(found):
                allowed = "it must be three finite numbers, not all 0 (N), or a pressure (MPa)"
                raise ValueError(f"{what} is {tuple(found)}; {allowed}")
            return found
        pressure = number(what, value)
        if not math.isfinite(pressure) or pressure == 0:
            raise ValueError(f"{what} is {pressure:g}; a pressure is a finite number, not 0 (MPa)")
        if not self._has_normals:
            raise ValueError(f"{what} is a pressure, which acts on faces, not on {self._of_sets}; give a force (N)")
        return pressure

    def _with_faces(self, what: str, name: str) -> str:
        """A name of a set with faces."""
        if name not in self._figures.sets:
            raise ValueError(f"{what}: the mesh has no set {name}; it has {', '.join(self._figures.sets)}")
        if not self._figures.sets[name].faces:
            raise ValueError(f"{what}: the set {name} has no {self._of_sets}")
        return name

    def write(
        self,
        path: str | os.PathLike[str],
        E: float = 1.0,
        nu: float = 0.3,
        hold: Iterable[str] = (),
        load: Mapping[str, Load] | None = None,
        fields: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Writes a file of one of the formats of its kind, with its sets: material ``E`` (MPa) and ``nu``, steps ``hold`` and
        ``load``, and ``fields`` as of ``VolumeMesh.write``. Raises ValueError for another suffix, and for what a format cannot
        carry.
        """
        self._write(path, extension(path, self._writes), (E, nu), (hold, load), fields)

    def _write(
        self,
        path: str | os.PathLike[str],
        kind: str,
        elastic: tuple[float, float],
        steps: tuple[Iterable[str], Mapping[str, Load] | None],
        fields: Mapping[str, ArrayLike] | None,
        *more: Any,
    ) -> None:
        """Writes a file; ``steps`` is what is held and what is loaded, ``more`` what files of this mesh alone have."""
        E, nu = positive("E", elastic[0]), poisson("nu", elastic[1])
        hold, load = ([steps[0]] if isinstance(steps[0], str) else list(steps[0])), steps[1]
        check_steps(kind, hold, load)
        held = [self._with_faces("hold", name) for name in hold]
        for name in held:
            if name in (load or {}):
                raise ValueError(
                    f"{name} is held and loaded: a force on what does not move does nothing; hold or load another set"
                )
        loads = [(self._with_faces("load", k), self._load(k, v)) for k, v in (load or {}).items()]
        if held or loads:
            self._check_loads()
            self._check_held(held, loads)
        if fields and kind not in self._with_fields:
            *others, last = self._with_fields
            raise ValueError(f"fields are written to .{', .'.join(others)} and .{last}, not .{kind}")
        further = {name: self._field(name, values) for name, values in (fields or {}).items()}
        if kind == "msh":
            for name, values in further.items():
                if values[0].size not in GMSH:
                    raise ValueError(f"{name} has {values[0].size} numbers each; fields of .msh have 1, 3 or 9: write .vtu")
        if kind == "xdmf":
            from .io.xdmf import write

            return write(os.fsdecode(path), self, further)
        count = self._figures.nodes
        arrays = [(name, v[0].size, len(v) == count, v.ravel().tolist()) for name, v in further.items()]
        moduli = self._materials(kind, E, nu)
        title = f"Trabecula {_core.__version__}: {os.path.splitext(os.path.basename(os.fsdecode(path)))[0]}"
        with whole_file(path) as temporary:
            self._core.write((temporary, kind, title), moduli, held, loads, arrays, *more)

    def _check_held(self, held: Sequence[str], loads: Sequence[tuple[str, list[float] | float]]) -> None:
        """Refuses a force on nodes all of which are held by other sets."""
        import numpy as np

        fast = np.unique(np.concatenate([self.sets[name].nodes for name in held]))
        for name, force in loads:
            if np.isin(self.forces(name, force)[0], fast).all():
                raise ValueError(f"all nodes of {name}, which is loaded, are held by {', '.join(held)}: the force does nothing")

    def _connected(self) -> NDArray[np.uint32]:
        return self.elements

    def _members(self) -> dict[str, tuple[NDArray, NDArray]]:
        return {name: (of.nodes, of.elements) for name, of in self.sets.items()}

    def _materials(self, kind: str, E: float, nu: float) -> list[list[float]]:
        """Young's modulus (MPa) and Poisson's ratio in a file: of all domains."""
        return [[E, nu]]

    def _field(self, name: str, values: ArrayLike) -> NDArray[np.float64]:
        """A field of a file: a row for each node or element."""
        import numpy as np

        found = np.asarray(values, dtype=np.float64)
        counts = self._figures.nodes, self._figures.elements
        if found.ndim not in (1, 2) or found.shape[0] not in counts or found.size == 0:
            raise ValueError(
                f"the field {name} has the shape {found.shape}; it must have a row for each of {counts[0]} nodes or "
                f"{counts[1]} elements"
            )
        if re.search(r'[<>&"\x00-\x1f]', name) or name in (
            *self._figures.sets,
            "fraction",
            "thickness",
            "domain",
            *self._of_elements(),
        ):
            raise ValueError(f"a field cannot be named {name!r}; use another name")
        return found

    def _check_loads(self) -> None:
        """Refuses a mesh that takes no step of what is held and loaded."""


def check_steps(kind: str, hold: Sequence[str], load: Mapping[str, Load] | None) -> None:
    """Whether what is held and loaded makes a step in a file."""
    if not hold and not load:
        return
    if kind != "inp":
        raise ValueError(f"hold and load are written to .inp, not .{kind}; in Python mesh.forces(set, load) has them")
    if not hold or not load:
        raise ValueError("give both hold and load: a step needs sets that do not move and forces on others")
