"""Exact queries of beams: points, rays, nearest places, plane slices, and the faces of hubs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property

from . import _core
from .base.files import write_svg
from .base.given import number, positive, three, whole
from .base.reproducible import Reproducible
from .pictures.outlines import outlines_svg

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .base.resolution import Resolution

__all__ = ["Quadors", "Slice"]


class Quadors(Reproducible):
    """The beams of a design as quadrics: everything asked of them is answered in closed form. Made by ``Solid.quadors``.

    These are the beams alone, uncut by the region and without a skin. ``whole`` says whether that is the part; where it is
    not, ``Solid.field`` has the part's own sign.
    """

    _make = staticmethod(_core.Solid.quadors)
    _core: _core.Quadors
    _solid: Resolution

    def __len__(self) -> int:
        return self._core.hubs

    def __repr__(self) -> str:
        uncut = "" if self.whole else ", uncut"
        return f"<trabecula.Quadors of {self._core.hubs} hubs and {self._core.beams} beams{uncut}>"

    @cached_property
    def whole(self) -> bool:
        """Whether these beams are all of the part: the region cuts none, there is no skin, keep zone or other lattice. For a
        pattern of more than 20 000 beams this is decided by its bounding box.
        """
        return self._solid._core.whole_beams(self._plan["name"])

    def volume(self) -> float:
        """The volume in mm³, fillets included, to 1e-10. Beams that run into each other without a node are refused."""
        return self._core.volume()

    def fillets(self) -> dict[str, NDArray]:
        """The fillets of each of the n hubs; a crotch is where two of its beams meet.

        ``centers`` (n, 3), mm; ``crotches`` (n,), how many; ``short`` (n,), how many of them have a smaller fillet than asked
        for; ``radius`` (n, 2), mm, of the smallest and the largest fillet, infinite where no crotch is concave, 0 without
        fillets; ``tau`` (n, 2), the least and the greatest, which the smallest fillet has, NaN without crotches.
        """
        return self._core.fillets()

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points (n, 3) in mm are in the beams."""
        return self._core.contains(_points("points", points))

    def rays(self, origins: ArrayLike, directions: ArrayLike) -> dict[str, NDArray]:
        """Where rays from ``origins`` (n, 3), mm, along ``directions`` (n, 3) first enter the solid; arrays of n.

        ``distance`` in lengths of the direction, infinite without a hit; ``normals`` (n, 3) out of the solid; ``hubs``, -1
        without. A ValueError for a direction of zero length.
        """
        starts, along = _points("origins", origins), _points("directions", directions)
        if along.size and not along.any(axis=1).all():
            raise ValueError(f"direction {int((~along.any(axis=1)).argmax())} is (0, 0, 0); give one that is not zero")
        distance, normals, hubs = self._core.rays(starts, along)
        return {"distance": distance, "normals": normals, "hubs": hubs}

    def closest(self, points: ArrayLike) -> dict[str, NDArray]:
        """The place of the surface nearest to each of points (n, 3) in mm, exact up to rounding.

        ``points`` (n, 3) on the surface; ``normals`` out of the solid there; ``distance``, negative in the solid;
        ``hubs`` that the places belong to.
        """
        at, normals, distance, hubs = self._core.closest(_points("points", points))
        return {"points": at, "normals": normals, "distance": distance, "hubs": hubs}

    def slice(
        self, z: float | None = None, *, point: Sequence[float] | None = None, normal: Sequence[float] = (0, 0, 1)
    ) -> Slice:
        """The slice at a height ``z`` (mm), or by the plane through a ``point`` with a ``normal``."""
        if (z is None) == (point is None):
            raise ValueError("give z, or a point (and a normal), not both")
        if point is None:
            if list(normal) != [0, 0, 1]:
                raise ValueError("z is along the normal (0, 0, 1); give a point to slice along another one")
            point = (0, 0, number("z", z))
        return Slice(self, {"point": three("point", point), "normal": three("normal", normal)})

    def hub(self, hub: int) -> dict[str, Any]:
        """The surface of a hub, up to where its beams are parted, as faces of quadrics; places are from its ``center``.

        ``vertices`` (n, 3). ``arcs``: the ``vertices`` that each joins (one twice if it closes on itself), the ``faces``
        to its left and right, and rational quadratic Bézier ``points`` (k, 3, 3) with ``weights`` (k,). ``faces``: the
        ``beams`` that shape each (none the ball, one its own surface, two a fillet, more a corner), its ``quadric`` as a
        symmetric 4 × 4 matrix, negative inside, ``loops`` of (arc, forward) with the face to the left, and the beam whose
        ``end_circle`` bounds it too. ``patches``: exact biquadratic ``points`` (3, 3, 3) and ``weights`` (3, 3) over ``range``
        ((s, s), (t, t)), and ``loops`` of sides in space (``points``, ``weights``) and in (s, t) (``parameters``,
        ``parameter_weights``), with the ``arcs`` that they are part of. ``unpatched``: faces left out of them.
        """
        return self._core.hub(whole("hub", hub, 0, len(self) - 1))


class Slice(Reproducible):
    """A plane slice of beams. Made by ``Quadors.slice``."""

    _make = staticmethod(_core.Quadors.slice)
    _core: _core.Slice

    def __repr__(self) -> str:
        return f"<trabecula.Slice of {self.area:g} mm²>"

    @property
    def area(self) -> float:
        """The solid's area, mm², in closed form."""
        return self._core.area

    @property
    def moved(self) -> float:
        """How far the plane was moved along its normal, mm: not zero only where it would touch the surface, not cut it."""
        return self._core.moved

    @property
    def hubs(self) -> int:
        """Number of hubs that the plane reaches; the others are not evaluated."""
        return self._core.hubs

    @property
    def plane(self) -> dict[str, list[float]]:
        """The plane's ``origin``, its axes ``u`` and ``v`` (x and y for a slice by z), and its ``normal``."""
        return dict(zip(("origin", "u", "v", "normal"), map(list, self._core.plane), strict=True))

    @cached_property
    def loops(self) -> list[dict[str, NDArray]]:
        """Closed loops of conic arcs, the solid to the left: outlines run counter-clockwise, holes clockwise.

        Rational quadratic Bézier curves, one after the other: ``points`` (n, 3, 2) in the plane's (u, v), mm; ``weights``
        (n,) of the middle points (below 1 an ellipse, above a hyperbola); ``hubs`` (n,); and ``conics`` (n, 6): a, b, c,
        d, e, f of a u² + 2 b uv + c v² + 2 d u + 2 e v + f = 0 with (u, v) from ``about`` (n, 2).
        """
        return self._core.loops()

    def polygons(self, chord: float = 0.01) -> list[NDArray[np.float64]]:
        """The loops as polygons (n, 2) that are nowhere further than ``chord`` (mm) from them."""
        return self._core.polygons(positive("chord", chord))

    def svg(self, chord: float = 0.01) -> str:
        """A drawing in mm, v upwards, the solid filled."""
        return outlines_svg(self.polygons(chord))

    def write(self, path: str | os.PathLike[str], chord: float = 0.01) -> None:
        """Writes the drawing (.svg)."""
        write_svg(path, lambda: self.svg(chord))


def _points(name: str, given: ArrayLike) -> NDArray[np.float64]:
    import numpy as np

    points = np.asarray(given, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), found {points.shape}")
    return np.ascontiguousarray(points)
