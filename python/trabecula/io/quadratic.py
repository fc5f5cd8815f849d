"""Files of quadratic tetrahedra as they are: the volume within their curved faces, and all of their nodes."""

from __future__ import annotations

import importlib.util
import re
from typing import TYPE_CHECKING, NamedTuple

from . import elements

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["Found", "found_in"]

#: VTK's numbers of linear and of quadratic tetrahedra, and of the other volumes that have nodes beside their corners.
LINEAR, QUADRATIC, OTHERS = 10, 24, (25, 26, 27, 29)
#: Tetrahedra at a time.
CHUNK = 100_000


class Found(NamedTuple):
    """What stands in a file."""

    #: Nodes of elements.
    nodes: int
    #: mm³; None where only that of the corners is known.
    volume: float | None


def found_in(path: str, corners: int, arrays: list[NDArray]) -> Found | None:
    """What a file has whose mesh has so many ``corners``, by its arrays where they were read; None if it has no other nodes."""
    import numpy as np

    if not arrays:  # a .vtu, which the core reads
        with open(path, "rb") as file:
            count = sum(map(int, re.findall(rb'NumberOfPoints="(\d+)"', file.read(4096))))
        if count <= corners:
            return None
        if importlib.util.find_spec("meshio") is None:
            return Found(count, None)
        arrays = elements.arrays_of(path)
    points, connectivity, ends, kinds = arrays[:4]
    if not np.isin(kinds, (QUADRATIC, *OTHERS)).any():
        return None
    used = len(np.unique(connectivity))
    if not np.isin(kinds, (LINEAR, QUADRATIC)).all():
        return Found(used, None)
    starts = ends - np.diff(ends, prepend=np.uint64(0))
    volume = 0.0
    for kind, each in ((LINEAR, 4), (QUADRATIC, 10)):
        of = starts[kinds == kind].astype(np.int64)
        for at in range(0, len(of), CHUNK):
            nodes = points[connectivity[of[at : at + CHUNK, None] + np.arange(each)]]
            volume += float((linear(nodes) if kind == LINEAR else curved(nodes)).sum())
    return Found(used, abs(volume))


def linear(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Volumes of tetrahedra (m, 4, 3)."""
    import numpy as np

    return np.linalg.det(nodes[:, 1:] - nodes[:, :1]) / 6


def curved(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Volumes of quadratic tetrahedra (m, 10, 3): corners, then the edges 01 12 02 03 13 23. The Jacobian is a cubic, of which
    these five points give the integral.
    """
    import numpy as np

    sixth = 1 / 6
    places = [([0.25] * 4, -0.8)] + [([0.5 if i == k else sixth for i in range(4)], 0.45) for k in range(4)]
    # Derivatives of barycentric coordinates by x, y, z of the tetrahedron of reference.
    slopes = np.vstack([[-1.0, -1.0, -1.0], np.eye(3)])
    volume = np.zeros(len(nodes))
    for place, weight in places:
        corners = [(4 * place[k] - 1) * slopes[k] for k in range(4)]
        edges = [4 * (place[a] * slopes[b] + place[b] * slopes[a]) for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
        jacobian = np.einsum("mni,nj->mij", nodes, np.array(corners + edges))
        volume += weight / 6 * np.linalg.det(jacobian)
    return volume
