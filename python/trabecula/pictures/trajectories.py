"""Trajectories of the axes that a solved map is asked for: curves on the region's surface along them, evenly spaced.

They are traced in all directions at once from many places, on to the axis nearest to the last direction, as axes have neither
sign nor order; then taken one after another, the longest first, where they are not too near to others (Jobard and Lefer
1997).
"""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Field = Callable[[NDArray], NDArray]

__all__ = ["trajectories"]

#: Steps between two lines' distance; the least distance kept along a line, and the least length, in distances.
STEPS, NEAR, SHORT = 4, 0.5, 4.0
#: Most steps of a line in each direction.
MOST = 600
#: Sine of the angle to the surface up to which an axis counts as along it; cosines of the most that a line and the surface
#: turn in a step, beyond which there is an edge; there the slope of the distance is less than one too.
ALONG, STRAIGHT, SMOOTH, SLOPE = 0.6, 0.8, 0.93, 0.9


def trajectories(places: NDArray, step: float, axes: Field, distance: Field, eye: ArrayLike) -> list[list[NDArray]]:
    """Lines along the first, second and third of the unit ``axes`` (n, 3, 3) on the surface where ``distance`` (mm) is zero.

    Each begins at one of the ``places`` on that surface, runs as far as the axis is along the surface and the surface has no
    edge and faces the ``eye``, and is about ``step`` mm from the next.
    """
    import numpy as np

    if not len(places):
        return [[], [], []]
    surface = _Surface(axes, distance, np.asarray(eye), step / STEPS)
    numbers, kinds = (v.ravel() for v in np.indices((len(places), 3)))
    starts, ways = places[numbers], axes(places).reshape(-1, 3)
    normals, slopes = surface.normals(starts)
    flat = (np.abs((ways * normals).sum(axis=1)) < ALONG) & (slopes > SLOPE)
    starts, ways, kinds = starts[flat], ways[flat], kinds[flat]
    halves = [surface.traced(starts, sign * ways) for sign in (1.0, -1.0)]
    found: list[list[NDArray]] = [[], [], []]
    taken: list[set[tuple[int, ...]]] = [set(), set(), set()]
    order = sorted(range(len(starts)), key=lambda i: -sum(len(half[i]) for half in halves))
    for i in order:
        cells = taken[kinds[i]]
        forth, back = (_free(half[i], cells, NEAR * step) for half in halves)
        line = np.concatenate([back[:0:-1], forth]) if len(forth) and len(back) else forth
        if len(line) > SHORT * STEPS:
            found[kinds[i]].append(line)
            cells.update(map(tuple, np.floor(line / (NEAR * step)).astype(int).tolist()))
    return found


def _free(line: NDArray, taken: set[tuple[int, ...]], size: float) -> NDArray:
    """The part of a line before it comes into a taken cell or one beside it."""
    import numpy as np

    for i, (x, y, z) in enumerate(np.floor(line / size).astype(int).tolist()):
        around = ((x + a, y + b, z + c) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1))
        if not taken.isdisjoint(around):
            return line[:i]
    return line


class _Surface:
    """The surface of a region, and the axes on it."""

    def __init__(self, axes: Field, distance: Field, eye: NDArray, step: float):
        self.axes, self.distance, self.eye, self.step = axes, distance, eye, step

    def normals(self, points: NDArray) -> tuple[NDArray, NDArray]:
        """Unit normals, by differences of the distance, and its slopes."""
        import numpy as np

        h = 0.05 * self.step
        slope = np.stack([self.distance(points + e) - self.distance(points - e) for e in h * np.eye(3)], axis=1) / (2 * h)
        size = np.linalg.norm(slope, axis=1)
        return slope / np.maximum(size, 1e-300)[:, None], size

    def onward(self, points: NDArray, ways: NDArray, normals: NDArray) -> tuple[NDArray, NDArray]:
        """Directions along the surface of the axes nearest to ``ways``, cosines of the angles to these; -1 off the surface."""
        import numpy as np

        axes = self.axes(points)
        cosines = np.einsum("nij,nj->ni", axes, ways)
        nearest = np.abs(cosines).argmax(axis=1)
        rows = np.arange(len(points))
        found = axes[rows, nearest] * np.sign(cosines[rows, nearest])[:, None]
        rise = (found * normals).sum(axis=1)
        found = found - rise[:, None] * normals
        found /= np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300)
        return found, np.where(np.abs(rise) < ALONG, (found * ways).sum(axis=1), -1.0)

    def traced(self, starts: NDArray, ways: NDArray) -> list[NDArray]:
        """Lines from ``starts``: midpoint steps, each back onto the surface, until a line comes to
        an edge or out of sight, turns off or has come round."""
        import numpy as np

        normals, _ = self.normals(starts)
        at, ways = starts.copy(), self.onward(starts, ways, normals)[0]
        passed, running = [starts], np.arange(len(starts))
        ends = np.ones(len(starts), int)
        for _ in range(MOST):
            if not len(running):
                break
            here, way, normal = at[running], ways[running], normals[running]
            middle, _ = self.onward(here + 0.5 * self.step * way, way, normal)
            there = here + self.step * middle
            there = there - self.distance(there)[:, None] * self.normals(there)[0]
            turned, slopes = self.normals(there)
            onward, cosines = self.onward(there, way, turned)
            smooth = (
                ((turned * normal).sum(axis=1) > SMOOTH) & (slopes > SLOPE) & (np.abs(self.distance(there)) < 0.05 * self.step)
            )
            came_round = (ends[running] > 8) & (np.linalg.norm(there - starts[running], axis=1) < 0.6 * self.step)
            goes = smooth & (cosines > STRAIGHT) & (turned @ self.eye > 0) & ~came_round
            running = running[goes]
            at[running], ways[running], normals[running] = there[goes], onward[goes], turned[goes]
            ends[running] += 1
            passed.append(at.copy())
        all_points = np.stack(passed, axis=1)
        return [points[:count] for points, count in zip(all_points, ends, strict=True)]
