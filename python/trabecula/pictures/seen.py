"""What a solid is by the point, solved maps and blends, and pictures of that."""

from __future__ import annotations

import os

from ..base.given import check_keywords, parameters, positions
from ..base.resolution import Resolution
from .camera import towards
from .drawn import Drawn, Picture
from .shown import look

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack

    from ..laws import Law
    from ..mesh import Mesh
    from .drawn import Look

__all__ = ["Seen"]


class Seen(Picture, Resolution):
    """Solids that say what they are at points, and show it."""

    mesh: Callable[..., Mesh]
    #: As `law` of the package.
    _law: Callable[..., Law]

    def map_error(self, points: ArrayLike, lattice: str | None = None) -> dict[str, NDArray[np.float64]]:
        """Deviation of a solved map (``map.phase``) from the one asked for, at points (n, 3) in mm; arrays (n,).

        ``angle``: between a grating and the wanted one, the worst of three, degrees; ``spacing``: the ratio of their spacings
        or its inverse, the worst of three; ``density``: det J over the one asked for, cells for each cell wanted. ``lattice``
        names the lattice; by default the first one with such a map. A ValueError where there is none.
        """
        return self._core.map_error(self._solved(lattice), _points(points))

    def map_asked(self, points: ArrayLike, lattice: str | None = None) -> NDArray[np.float64]:
        """The gradients Kᵢ that a solved map (``map.phase``) is asked for, at points (n, 3) in mm; an array (n, 3, 3).

        Row i is the direction along which cells follow each other on their axis i, as long as there are cells on a mm;
        directions without a sign, such as principal ones, have that of the grid's nodes about them. ``lattice`` as for
        ``map_error``.
        """
        return self._core.map_asked(self._solved(lattice), _points(points))

    def cell_at(self, points: ArrayLike, lattice: str | None = None) -> dict[str, NDArray[np.float64]]:
        """The cell of a lattice at points (n, 3) in mm.

        ``fraction`` (n,): its solid fraction; ``axes`` (n, 3, 3): the unit vectors along which cells follow each other on their
        axes 1, 2 and 3, each a row; ``wavelength`` (n, 3): the period along each, mm. With the map u(x), they are directions
        and lengths of the columns of (du/dx)^-1, NaN where it has none, as on the axis of ``map.cylinder``. ``lattice`` names
        the lattice; by default the first. A ValueError where there is none of that name.
        """
        import numpy as np

        if lattice is not None and not isinstance(lattice, str):
            raise TypeError(f"lattice must be the name of a lattice, found {lattice!r}")
        names = list(self.report().lattices)
        name = lattice if lattice is not None or not names else names[0]
        found = None if name is None else self._core.cell_at(name, _points(points))
        if found is None:
            if name in names:
                raise ValueError(f"lattice {name} lies over tetrahedra, each with a map of its own")
            there = f"there is no lattice named {name}; there are {', '.join(names)}" if names else "the design has no lattice"
            raise ValueError(there)
        fraction, gradients = found
        regular = np.linalg.det(gradients) != 0
        columns = np.full_like(gradients, np.nan)
        columns[regular] = np.linalg.inv(gradients[regular]).transpose(0, 2, 1)
        wavelength = np.linalg.norm(columns, axis=2)
        return {"fraction": fraction, "axes": columns / wavelength[:, :, None], "wavelength": wavelength}

    def shares(self, points: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """The share of each lattice of a blend at points (n, 3) in mm, 0 to 1, together 1; an array (n,) by each name.

        A ValueError without a blend.
        """
        found = self._core.shares(_points(points))
        if found is None:
            raise ValueError("the design has no blend: one lattice is everywhere")
        return dict(zip(found[0], found[1].T, strict=True))

    def render(
        self,
        path: str | os.PathLike[str],
        size: tuple[float, float] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
        show: str | None = None,
        edge: float | None = None,
        per_cell: float | None = None,
        threads: int | None = None,
        **style: Unpack[Look],
    ) -> None:
        """Writes a picture of the solid, meshed at a spacing as for ``mesh``, to a .png file, or a line drawing to an .svg
        file; camera and ``style`` (section, background, dpi, projection, scale_bar, axes, up) as for ``Mesh.png``.

        ``show`` is what it shows beside the form: ``thickness``, the local thickness of walls; ``overhang``, see ``Mesh.png``,
        of layers stacked along ``up``; ``fraction``, the solid fraction of the cell; ``stiffness``, Young's modulus of the cell
        along its axes by its fraction, over that of the solid, of cubic cells with a name (see ``law``). Of a solved map
        (``map.phase``): ``angle``, ``spacing``, ``density``, the deviation from the one asked for, see ``map_error``;
        ``axes``, the directions asked for, at places on the region's surface; ``trajectories``, lines along them on that
        surface; ``singularities``, the lines round which they do not come back to themselves. Of a blend: ``lattice``, which
        lattice is where. A ValueError where the design has none.
        """
        check_keywords("render", style, [*parameters(Seen.render), *parameters(Drawn.render), *parameters(Drawn.png)])
        seen = None if show is None else look(self, show, threads)
        made = self.mesh(edge=edge, per_cell=per_cell, threads=threads)
        shown = dict(seen(made, towards(azimuth, elevation))) if seen else {}
        made.render(path, size, azimuth, elevation, **{**shown, "solid": self, **style})

    def _solved(self, lattice: str | None) -> str:
        """The lattice of that name, or else the first whose map was solved for."""
        if lattice is not None:
            return lattice
        for name, it in self.report().lattices.items():
            if it.distortion:
                return name
        raise ValueError("no lattice has a map that was solved for; only map.phase is")


def _points(points: ArrayLike) -> NDArray[np.float64]:
    import numpy as np

    given = positions("points", points)
    if given.ndim != 2:
        raise ValueError(f"points must have shape (n, 3), found {given.shape}")
    return np.ascontiguousarray(given)
