"""Which vertices of a mesh are nearest to those of a lighter one."""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..mesh import Mesh

__all__ = ["nearest_vertices"]

#: Vertices of a cube of the grid in which they are sought.
CROWD = 3
#: How many times farther those of a surface that faces the other way count: in thin walls they are near.
OTHER_SIDE = 10.0


def nearest_vertices(mesh: Mesh, light: Mesh) -> NDArray[np.int64]:
    """For each vertex of the lighter mesh the index of the nearest one of the mesh, (n,); where the surface faces the other
    way it counts as farther.
    """
    import numpy as np

    ours, theirs = (mesh.vertices, _normals(mesh)), (light.vertices, _normals(light))
    # A surface passes through about area / edge² cubes.
    edge = (CROWD * mesh.area / mesh.counts[0]) ** 0.5 or 1.0
    found, left = np.zeros(light.counts[0], dtype=np.int64), np.arange(light.counts[0])
    while len(left):
        near, squared = _in_cubes(ours, (theirs[0][left], theirs[1][left]), edge)
        sure = squared <= edge**2  # others may have nearer ones beyond the cubes that are next to theirs
        found[left[sure]], left = near[sure], left[~sure]
        edge *= 2
    return found


def _in_cubes(
    ours: tuple[NDArray, NDArray], theirs: tuple[NDArray, NDArray], edge: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Of each of their places the nearest of ours in the cube around it and those next to that, and the squared distance;
    infinite where there is none. Both are places and normals.
    """
    import numpy as np

    low, high = ours[0].min(axis=0), ours[0].max(axis=0)
    across = np.floor((high - low) / edge).astype(np.int64) + 3

    def keys(cubes: NDArray[np.int64]) -> NDArray[np.int64]:
        return (cubes[:, 0] * across[1] + cubes[:, 1]) * across[2] + cubes[:, 2]

    def cubes(places: NDArray) -> NDArray[np.int64]:
        return np.floor((np.clip(places, low, high) - low) / edge).astype(np.int64) + 1

    key = keys(cubes(ours[0]))
    order = np.argsort(key, kind="stable")
    key = key[order]
    near, best = np.zeros(len(theirs[0]), dtype=np.int64), np.full(len(theirs[0]), np.inf)
    around = cubes(theirs[0])
    for x, y in np.ndindex(3, 3):
        # Three cubes in a row along z have keys one after the other.
        middle = keys(np.add(around, (x - 1, y - 1, 0)))
        first, last = np.searchsorted(key, middle - 1), np.searchsorted(key, middle + 1, side="right")
        many = last - first
        whose = np.repeat(np.arange(len(many)), many)
        given = order[np.arange(len(whose)) - np.repeat(np.cumsum(many) - many - first, many)]
        squared = ((ours[0][given] - theirs[0][whose]) ** 2).sum(axis=1)
        squared[(ours[1][given] * theirs[1][whose]).sum(axis=1) < 0] *= OTHER_SIDE**2
        nearer = np.flatnonzero(squared < best[whose])
        nearer = nearer[np.argsort(-squared[nearer], kind="stable")]  # of several that are given to one, the last stays
        near[whose[nearer]], best[whose[nearer]] = given[nearer], squared[nearer]
    return near, best


def _normals(mesh: Mesh) -> NDArray[np.float64]:
    """The sum of the normals of the triangles at each vertex, by their areas."""
    import numpy as np

    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    corners = mesh.triangles.ravel()
    return np.stack([np.bincount(corners, np.repeat(normals[:, k], 3), mesh.counts[0]) for k in range(3)], axis=1)
