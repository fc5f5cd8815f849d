"""Affine transforms of meshes: moved, scaled, rotated; what is transformed is a new object."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set

from .given import number, three

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any, TypeVar

    Self = TypeVar("Self", bound="Transformed")

__all__ = ["Transformed", "determinant", "factor_of", "vector_of"]

#: The sizes of factors that are allowed: far beyond any unit, and squares and cubes stay finite.
LEAST, MOST = 1e-30, 1e30


class Transformed:
    """Meshes that are moved, scaled and rotated.

    A new mesh each: its vertices in the same order, rounded to f64, its triangles or tetrahedra too, which of them are cuts,
    and zones. It belongs to no region and no design any more; the region's volume, where it is known, is scaled along.
    """

    #: The mesh c + M (x − c) + s, of the rows of M, c and s.
    _transformed: Callable[[list[list[float]], list[float], list[float]], Any]

    def moved(self: Self, vector: Sequence[float]) -> Self:
        """The mesh moved by ``vector`` (three numbers, mm): x + v.

        A ValueError for numbers that are not finite, and so far from the origin (over a million sizes of the mesh) that f64
        would round its shape. Files of single precision (stl) round at 6e-8 of the distance from the origin.
        """
        return self._transformed(_diagonal([1.0] * 3), [0.0] * 3, vector_of("vector", vector))

    def scaled(self: Self, factor: float | Sequence[float], center: Sequence[float] = (0, 0, 0)) -> Self:
        """The mesh scaled about ``center`` (mm) by one ``factor`` or by three, along x, y, z: c + D (x − c).

        Volumes are multiplied by the size of the factors' product. Negative factors mirror; triangles are then turned over,
        so that they stay counter-clockwise seen from outside, and tetrahedra keep a positive volume. A ValueError for 0 and
        numbers that are not finite (sizes from 1e-30 to 1e30 are allowed).
        """
        factors = [factor_of("factor", v) for v in three("factor", factor)]
        return self._transformed(_diagonal(factors), vector_of("center", center), [0.0] * 3)

    def rotated(self: Self, axis: str | Sequence[float], degrees: float, center: Sequence[float] = (0, 0, 0)) -> Self:
        """The mesh rotated by ``degrees`` about the ``axis`` ("x", "y", "z" or a direction) through ``center`` (mm),
        counter-clockwise for who looks against the axis (right-hand rule): c + R (x − c), R by Rodrigues' formula.

        Multiples of 90 degrees about x, y and z are exact in R. A ValueError for a direction of length 0 and numbers that are
        not finite. A rotated mesh from a grid is no longer aligned with it, so a file of single precision may round narrow
        triangles into each other; ``self_intersections`` of the mesh itself stay what they were, up to rounding in f64.
        """
        direction = _axis(axis)
        turn = number("degrees", degrees)
        if not math.isfinite(turn):
            raise ValueError(f"degrees is {turn}; it must be a finite number")
        return self._transformed(_rotation(direction, turn), vector_of("center", center), [0.0] * 3)


def vector_of(name: str, value: Any) -> list[float]:
    """Three finite numbers."""
    if isinstance(value, (str, bytes, Set, Mapping)) or not hasattr(type(value), "__len__") or len(value) != 3:
        raise ValueError(f"{name} must be three numbers, found {value!r:.80}")
    found = [number(name, v) for v in value]
    if not all(map(math.isfinite, found)):
        raise ValueError(f"{name} is {found}; it must be three finite numbers")
    return found


def factor_of(name: str, value: Any) -> float:
    """A finite number that is not 0, of any sign."""
    found = number(name, value)
    if not LEAST <= abs(found) <= MOST:
        raise ValueError(f"{name} is {found:g}; it must be a finite number other than 0, of a size from {LEAST:g} to {MOST:g}")
    return found


def determinant(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> float:
    """The determinant of the matrix of these rows."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def _diagonal(factors: Sequence[float]) -> list[list[float]]:
    return [[factors[i] if i == j else 0.0 for j in range(3)] for i in range(3)]


def _axis(axis: Any) -> list[float]:
    if isinstance(axis, str):
        if axis not in ("x", "y", "z"):
            raise ValueError(f'axis is "{axis:.80}"; it must be "x", "y", "z" or a direction of three numbers')
        return [float(axis == name) for name in "xyz"]
    direction = vector_of("axis", axis)
    largest = max(map(abs, direction))
    if largest == 0:
        raise ValueError("axis is [0, 0, 0]; a direction has a length greater than 0")
    direction = [v / largest for v in direction]
    length = math.hypot(*direction)
    return [v / length for v in direction]


def _rotation(axis: Sequence[float], degrees: float) -> list[list[float]]:
    """R = cos · 1 + sin · [a]× + (1 − cos) a aᵀ."""
    turn = math.fmod(degrees, 360.0)
    quarter = turn / 90.0
    if quarter == round(quarter):
        cos, sin = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    else:
        cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    x, y, z = axis
    crossed = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    outer = [[a * b for b in axis] for a in axis]
    return [[cos * (i == j) + sin * crossed[i][j] + (1 - cos) * outer[i][j] for j in range(3)] for i in range(3)]
