"""Levels and fractions of a cell, before there is any part."""

from __future__ import annotations

from typing import TYPE_CHECKING, overload

from . import _core
from .base.given import number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .base.given import Vector
    from .base.names import PartName

__all__ = ["fraction", "iso"]


@overload
def iso(cell: str | dict, fraction: float, part: PartName = "sheet") -> float: ...
@overload
def iso(cell: str | dict, fraction: Vector, part: PartName = "sheet") -> NDArray[np.float64]: ...
def iso(cell: str | dict, fraction: float | Vector, part: PartName = "sheet") -> float | NDArray[np.float64]:
    """The level t at which this part of the cell has this solid fraction; numbers or arrays."""
    return _levels(cell, fraction, part, True)


@overload
def fraction(cell: str | dict, iso: float, part: PartName = "sheet") -> float: ...
@overload
def fraction(cell: str | dict, iso: Vector, part: PartName = "sheet") -> NDArray[np.float64]: ...
def fraction(cell: str | dict, iso: float | Vector, part: PartName = "sheet") -> float | NDArray[np.float64]:
    """The solid fraction of this part of the cell at level t; numbers or arrays."""
    return _levels(cell, iso, part, False)


def _levels(cell: str | dict, values: float | Vector, part: PartName, to_iso: bool) -> float | NDArray[np.float64]:
    if isinstance(values, str) or not hasattr(values, "__len__") or getattr(values, "ndim", 1) == 0:
        return _core.levels(cell, part, [number("the amount", values)], to_iso)[0]
    import numpy as np

    given = np.asarray(values, dtype=np.float64)
    return np.array(_core.levels(cell, part, given.ravel().tolist(), to_iso)).reshape(given.shape)
