"""Closed polygons as a drawing."""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["outlines_svg"]


def outlines_svg(loops: list[NDArray], frame: NDArray | None = None) -> str:
    """A drawing in mm of polygons (n, 2), the second coordinate upwards, what they enclose filled; as large as they, or as the
    ``frame`` (2, 2), its lower and its upper corner.
    """
    import numpy as np

    corners = np.concatenate(loops) if loops else np.zeros((1, 2))
    corners = corners if frame is None else frame
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = np.maximum(high - low, 1e-6)
    path = " ".join("M " + " L ".join(f"{u:.9g} {-v:.9g}" for u, v in loop) + " Z" for loop in loops)
    box = f"{low[0]:.9g} {-high[1]:.9g} {width:.9g} {height:.9g}"
    size = f'width="{width:.9g}mm" height="{height:.9g}mm" viewBox="{box}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n<path fill-rule="nonzero" d="{path}"/>\n</svg>\n'
