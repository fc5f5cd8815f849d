"""Levels: how much of the cell is solid. Every amount is a number or a grade."""

from __future__ import annotations

from .base.given import named

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .base.given import Vector
    from .base.names import Fit, Of

__all__ = ["fraction", "iso", "permeability", "pore", "porosity", "stiffness", "thickness"]

Amount = float | dict


@named
def iso(value: Amount, mid: float = 0.0) -> dict:
    """The field value t: sheet |f| ≤ t, lower f ≤ t, upper f ≥ t.

    ``mid`` moves a sheet off its centre: |f - mid| ≤ t.
    """
    return _level("iso", value, mid=mid)


@named
def thickness(value: Amount, mid: float = 0.0) -> dict:
    """The thickness w of a sheet's wall in mm: solid is what lies within w/2 of the mid-surface f = ``mid``.

    It is the distance in space that counts, also with unequal wavelengths and shears. Above twice the least radius of
    curvature of the mid-surface a wall folds; building then warns with the limit.
    """
    return _level("thickness", value, mid=mid)


@named
def pore(value: Amount, mid: float = 0.0) -> dict:
    """The diameter in mm of the largest ball that passes through the void from cell to cell; of a sheet through both sides.

    The map is ``map.affine()`` or ``map.spartan()``.
    """
    return _level("pore", value, mid=mid)


@named
def stiffness(value: Amount, along: Vector = (1.0, 0.0, 0.0), nu: float = 0.3, n: int = 48, mid: float = 0.0) -> dict:
    """Young's modulus of the periodic cell over that of the solid, ``along`` a direction in the axes of the cell: the fraction
    is solved for.

    ``nu`` is Poisson's ratio of the solid, ``n`` how many voxels along the cell it is found on. The map is ``map.affine()``
    or ``map.spartan()``.
    """
    given = {"along": ([float(v) for v in along], [1.0, 0.0, 0.0]), "nu": (nu, 0.3), "n": (n, 48)}
    return _level("stiffness", value, mid=mid) | {k: v for k, (v, usual) in given.items() if v != usual}


@named
def permeability(value: Amount, along: Vector = (1.0, 0.0, 0.0), n: int = 32, mid: float = 0.0) -> dict:
    """The permeability of the pore in mm², of both sides of a sheet together, ``along`` a direction in the axes of the cell:
    the fraction is solved for.

    ``n`` is how many nodes along the cell it is found on. The map is ``map.affine()`` or ``map.spartan()``.
    """
    given = {"along": ([float(v) for v in along], [1.0, 0.0, 0.0]), "n": (n, 32)}
    return _level("permeability", value, mid=mid) | {k: v for k, (v, usual) in given.items() if v != usual}


@named
def fraction(
    value: Amount,
    of: Of = "cell",
    fit: Fit = "table",
    mid: float = 0.0,
    thickness: float | None = None,
    pore: float | None = None,
) -> dict:
    """The solid volume fraction, between 0 and 1, of the periodic cell (``of="cell"``) or of the finished part
    (``of="part"``, solved for).

    ``fit="spartan"`` uses the SPARTAN polynomial instead of the cell's own distribution (part ``lower``; diamond,
    gyroid). ``mid`` moves a sheet off its centre: |f - mid| ≤ t.

    With ``thickness``, mm, of a sheet's wall or a network's narrowest neck, or ``pore``, mm, the wavelength is solved for: the
    map is ``map.affine()`` or ``map.spartan()`` without one, or with three as ratios.
    """
    return _level("fraction", value, of, fit, mid, thickness, pore)


@named
def porosity(
    value: Amount,
    of: Of = "cell",
    fit: Fit = "table",
    mid: float = 0.0,
    thickness: float | None = None,
    pore: float | None = None,
) -> dict:
    """One minus the solid fraction; see ``fraction``."""
    return _level("porosity", value, of, fit, mid, thickness, pore)


def _level(
    key: str,
    value: Amount,
    of: Of = "cell",
    fit: Fit = "table",
    mid: float = 0.0,
    thickness: float | None = None,
    pore: float | None = None,
) -> dict:
    given = {
        "of": (of, "cell"),
        "fit": (fit, "table"),
        "mid": (mid, 0.0),
        "thickness": (thickness, None),
        "pore": (pore, None),
    }
    return {key: value} | {k: v for k, (v, usual) in given.items() if v != usual}
