"""The tetrahedra of a lattice over tetrahedra as finite elements, each a material by the fraction of its cell."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property

from . import _core
from .base.files import extension
from .base.formats import VOLUME_WRITES
from .base.given import fixed, poisson, positive, thread_count, whole
from .finite_elements import Load
from .volumes import VolumeMesh, check_order

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Progress = Callable[[int, int], Any]

__all__ = ["Carrier"]


class Carrier(VolumeMesh):
    """The tetrahedra of a lattice over tetrahedra, each a material by the solid fraction of its cell: a model of the whole part
    with as many elements as the lattice has cells. Made by ``Solid.carrier``.

    Its domains are classes of the solid fraction, in twentieths: FRACTION_005 to FRACTION_100, or ZONE_NAME_FRACTION_005 in a
    mesh of several zones. Its sets are SURFACE, the whole boundary; X0 X1 Y0 Y1 Z0 Z1; and those of the design. ``volume``
    (mm³) is that of the tetrahedra. A skin, keep zones and a net are no part of it.

    In .msh, .vtu and .xdmf each tetrahedron has its ``fraction`` and its ``orientation``, the nine numbers of ``axes``;
    ``fields`` may have materials: ``carrier.moduli()``, {"C": carrier.stiffness().reshape(-1, 36)}.
    """

    _make = staticmethod(_core.VolumeMesh.carrier)

    def __repr__(self) -> str:
        return super().__repr__().replace("VolumeMesh", "Carrier")

    @cached_property
    def fraction(self) -> NDArray[np.float64]:
        """The solid fraction of each tetrahedron."""
        return fixed(self._core.fraction)

    @cached_property
    def axes(self) -> NDArray[np.float64]:
        """The axes of each tetrahedron (m, 3, 3), unit vectors, one row each: those of the body-centred cubic lattice whose
        tetrahedra it is most like, along its two longest opposite edges and across. Where all are such tetrahedra, as inside
        the background mesh, they are the same everywhere but for their order and signs.
        """
        return fixed(self._core.axes.reshape(-1, 3, 3))

    def stiffness(
        self, nu: float = 0.3, n: int = 32, threads: int | None = None, progress: Progress | None = None
    ) -> NDArray[np.float64]:
        """The stiffness of each tetrahedron (m, 6, 6) over Young's modulus of the solid, in world axes, Voigt's order
        11 22 33 23 13 12: cubic along ``axes`` a, C12 δᵢⱼδₖₗ + C44 (δᵢₖδⱼₗ + δᵢₗδⱼₖ) + (C11 − C12 − 2 C44) Σ aᵢaⱼaₖaₗ, that
        of the cell in equal tetrahedra at the mean fraction of the domain. See ``moduli`` for what it does not show, for ``nu``
        and ``n``, and for what it raises.
        """
        import numpy as np

        found = self._of_domains(poisson("nu", nu), whole("n", n, 8, 512), threads, progress)
        c11, c12, c44 = np.array([cubic for cubic, _ in found])[self.domain].T
        alike = np.zeros((2, 6, 6))
        alike[0, :3, :3] = 1
        alike[1] = np.diag([2.0, 2, 2, 1, 1, 1])
        x, y, z = np.moveaxis(self.axes, -1, 0)
        # The squares of an axis as a tensor, a ⊗ a.
        squares = np.stack([x * x, y * y, z * z, y * z, x * z, x * y], axis=-1)
        along = np.einsum("eai,eaj->eij", squares, squares)
        cut = [c12, c44, c11 - c12 - 2 * c44]
        return sum(c[:, None, None] * of for c, of in zip(cut, [*alike, along], strict=True))

    def write(
        self,
        path: str | os.PathLike[str],
        E: float = 1.0,
        nu: float = 0.3,
        hold: Iterable[str] = (),
        load: Mapping[str, Load] | None = None,
        fields: Mapping[str, ArrayLike] | None = None,
        oriented: bool = False,
    ) -> None:
        """As ``VolumeMesh.write``. In .inp and .bdf each domain has a material: ``moduli(nu)`` times the ``E`` (MPa) of the
        solid. With ``oriented`` it is cubic, along the ``axes`` of each element (*ORIENTATION by a *DISTRIBUTION), as
        ``stiffness(nu)``; in .inp alone. Raises ValueError as ``VolumeMesh.write`` and ``moduli``.
        """
        kind = extension(path, VOLUME_WRITES)
        if not oriented:
            return super().write(path, E, nu, hold, load, fields)
        if kind != "inp":
            raise ValueError(f"oriented materials are for .inp, not .{kind}; leave oriented out")
        check_order(kind, self._figures.order)
        of_solid = positive("E", E)
        cubic = [[of_solid * c for c in of] for of, _ in self._of_domains(poisson("nu", nu), 32, None, None)]
        self._write(path, kind, (E, nu), (hold, load), fields, cubic)

    def moduli(
        self, nu: float = 0.3, n: int = 32, threads: int | None = None, progress: Progress | None = None
    ) -> dict[str, NDArray[np.float64]]:
        """The material of each tetrahedron: ``young``, Young's modulus over that of the solid, and ``poisson``, Poisson's
        ratio, where that of the solid is ``nu``.

        A domain has that of its mean fraction: Hill's mean over all directions of the effective stiffness of the cell in equal
        tetrahedra, those of the body-centred cubic lattice, found on ``n`` voxels along its edge as by ``Solid.stiffness``.
        Tetrahedra whose edges are much longer one way are stiffer that way, which a mean does not show.

        Raises ValueError for a cell that carries no load at the fraction of a domain, and for ``nu`` outside -1 to 0.5.
        """
        import numpy as np

        found = self._of_domains(poisson("nu", nu), whole("n", n, 8, 512), threads, progress)
        young, ratio = np.array([mean for _, mean in found])[self.domain].T
        return {"young": young, "poisson": ratio}

    def materials(
        self, nu: float, kind: str, threads: int | None = None, progress: Progress | None = None
    ) -> dict[str, NDArray[np.float64]]:
        """``moduli`` (m,) and ``stiffness`` (m, 36), row by row, as fields of a file of a ``kind``, its suffix; in "msh", which
        has no such field, C11, C12 and C44 (m,) along the axes in place of the latter. Raises as ``moduli``.
        """
        import numpy as np

        found = self.moduli(nu, threads=threads, progress=progress)
        if kind != "msh":
            return found | {"stiffness": self.stiffness(nu, threads=threads).reshape(-1, 36)}
        constants = np.array([cubic for cubic, _ in self._of_domains(nu, 32, threads, progress)])[self.domain]
        return found | dict(zip(("C11", "C12", "C44"), constants.T, strict=True))

    @cached_property
    def _found(self) -> dict[tuple[float, int], list[tuple[list[float], list[float]]]]:
        return {}

    def _of_domains(
        self, nu: float, n: int, threads: int | None, progress: Progress | None
    ) -> list[tuple[list[float], list[float]]]:
        """Of each domain C11, C12 and C44, and Young's modulus and Poisson's ratio of their mean; found once."""
        if (nu, n) not in self._found:
            self._found[nu, n] = _core.VolumeMesh.carrier_materials(self._solid._core, nu, n, thread_count(threads), progress)
        return self._found[nu, n]

    def _of_elements(self) -> dict[str, NDArray]:
        return super()._of_elements() | {"fraction": self.fraction, "orientation": self.axes.reshape(-1, 9)}

    def _materials(self, kind: str, E: float, nu: float) -> list[list[float]]:
        if kind not in ("inp", "bdf"):
            return []
        return [[E * young, ratio] for _, (young, ratio) in self._of_domains(nu, 32, None, None)]

    def _check_loads(self) -> None:
        """All of it is solid."""
