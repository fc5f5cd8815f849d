"""Outside judges of meshes: nothing of Trabecula is asked here."""

import numpy as np
import pytest

manifold3d = pytest.importorskip("manifold3d")


def volume(vertices, triangles):
    """The signed volume, mm³."""
    a, b, c = (vertices[triangles[:, k]] - vertices.mean(axis=0) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def area(vertices, triangles):
    """The area, mm²."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def status(vertices, triangles):
    """What manifold3d says: NoError if the mesh is closed, oriented and manifold."""
    mesh = manifold3d.Mesh64(np.array(vertices), np.ascontiguousarray(triangles, dtype=np.uint64))
    return manifold3d.Manifold(mesh).status()


def near_pairs(vertices, triangles):
    """Pairs of triangles whose boxes meet, by a grid of cells: each is found in the one cell of the upper of both lower
    corners."""
    corners = vertices[triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    origin = low.min(axis=0)
    cell = 1.1 * np.median((high - low).max(axis=1)) + 1e-300
    first = np.floor((low - origin) / cell).astype(np.int64)
    shape = np.floor((high - origin) / cell).astype(np.int64) - first + 1
    count = shape.prod(axis=1)
    who = np.repeat(np.arange(len(triangles)), count)
    step = np.arange(len(who)) - np.repeat(np.cumsum(count) - count, count)
    nx, ny = shape[who, 0], shape[who, 1]
    at = first[who] + np.stack([step % nx, step // nx % ny, step // (nx * ny)], axis=1)
    size = at.max(axis=0) + 1
    key = (at[:, 2] * size[1] + at[:, 1]) * size[0] + at[:, 0]
    order = np.argsort(key, kind="stable")
    key, who, at = key[order], who[order], at[order]
    end = np.searchsorted(key, key, side="right")
    index = np.arange(len(key))
    out = []
    for k in range(1, int((end - index).max(initial=1))):
        i = index[index + k < end]
        a, b = who[i], who[i + k]
        own = (np.maximum(first[a], first[b]) == at[i]).all(axis=1)
        a, b = a[own], b[own]
        meet = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
        out.append(np.stack([a[meet], b[meet]], axis=1))
    return np.concatenate(out) if out else np.zeros((0, 2), dtype=np.int64)


def parted(vertices, triangles, pairs):
    """Whether a triangle's plane has all corners of the other on one side, or on it: then no edge passes through."""
    a = vertices[triangles[:, 0]]
    n = np.cross(vertices[triangles[:, 1]] - a, vertices[triangles[:, 2]] - a)
    level = np.einsum("ij,ij->i", n, a)
    rounding = 1e-14 * np.abs(vertices).max() * np.linalg.norm(n, axis=1)
    out = np.zeros(len(pairs), dtype=bool)
    for one, other in (pairs.T, pairs[:, ::-1].T):
        normal, of = n[one], triangles[other]
        sides = [np.einsum("ij,ij->i", normal, vertices[of[:, k]]) - level[one] for k in range(3)]
        low, high = np.minimum.reduce(sides), np.maximum.reduce(sides)
        out |= (low > -rounding[one]) | (high < rounding[one])
    return out


def pierced(p, q, a, b, c):
    """Whether segments pq pass through triangles abc, surely: six volumes have the right signs by more than rounding."""

    def volume_of(o, x, y, z):
        x, y, z = x - o, y - o, z - o
        return np.einsum("ij,ij->i", x, np.cross(y, z))

    size = np.abs(np.stack([p, q, a, b, c])).max(axis=(0, 2))
    reach = np.maximum.reduce([np.abs(v - a).max(axis=1) for v in (p, q, b, c)])
    # Differences are off by the rounding of the larger coordinate, the product of three by so much times two lengths.
    rounding = 1e-15 * (16 * size * reach**2 + 64 * reach**3)
    sides = np.stack([volume_of(a, b, c, p), volume_of(a, b, c, q)])
    turns = np.stack([volume_of(p, q, a, b), volume_of(p, q, b, c), volume_of(p, q, c, a)])
    apart = (sides.min(axis=0) < -rounding) & (sides.max(axis=0) > rounding)
    return apart & ((turns.min(axis=0) > rounding) | (turns.max(axis=0) < -rounding))


def crossings(vertices, triangles):
    """The number of pairs of triangles of which an edge of one surely passes through the inside of the other, and of
    neighbours that are folded flat onto each other."""
    triangles = np.asarray(triangles, dtype=np.int64)
    pairs = near_pairs(vertices, triangles)
    pairs = pairs[~parted(vertices, triangles, pairs)]
    bad = np.zeros(len(pairs), dtype=bool)
    for one, other in (pairs.T, pairs[:, ::-1].T):
        for k in range(3):
            p, q = triangles[one, k], triangles[one, (k + 1) % 3]
            # An edge that ends in a corner of the other triangle touches it there.
            i = np.nonzero(~((triangles[other] == p[:, None]) | (triangles[other] == q[:, None])).any(axis=1))[0]
            corners = [vertices[triangles[other[i], m]] for m in range(3)]
            bad[i] |= pierced(vertices[p[i]], vertices[q[i]], *corners)
    return int(bad.sum()) + folded(vertices, triangles)


def folded(vertices, triangles):
    """The number of edges at which two triangles lie flat on each other."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-300)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    same = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    s, t = order[1:][same] // 3, order[:-1][same] // 3
    return int((np.einsum("ij,ij->i", n[s], n[t]) < -1 + 1e-14).sum())


def sound(mesh):
    """Judges a mesh as its file in single precision holds it; gives its volume."""
    vertices = mesh.vertices.astype(np.float32).astype(np.float64)
    triangles = mesh.triangles.astype(np.int64)
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    assert status(vertices, triangles) == manifold3d.Error.NoError
    assert crossings(vertices, triangles) == 0
    return volume(vertices, triangles)


def of_stl(path):
    """Vertices and triangles of a binary STL: places that are the same to the last bit are one vertex."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    corners = np.fromfile(path, record, offset=84)["corners"].reshape(-1, 3)
    vertices, which = np.unique(corners, axis=0, return_inverse=True)
    return vertices.astype(np.float64), which.reshape(-1, 3)


def distance(vertices, triangles, points):
    """Signed distances of points from a closed mesh, negative inside, by the solid angle of all triangles."""
    out = np.empty(len(points))
    x, y, z = corners = np.moveaxis(vertices[triangles], 1, 0)
    middles = corners.mean(axis=0)
    reach = np.linalg.norm(corners - middles, axis=2).max(axis=0)
    normals = np.cross(x, y) + np.cross(y, z) + np.cross(z, x)
    levels = dots(x, np.cross(y, z))
    for part in np.array_split(np.arange(len(points)), len(points) * len(triangles) // 200_000 + 1):
        p = points[part]
        square = dots(p, p)[:, None]
        off = np.linalg.norm(vertices[None] - p[:, None], axis=2)
        la, lb, lc = (off[:, triangles[:, k]] for k in range(3))
        # Products of corners seen from each point, (x − p)·(y − p) = x·y − p·(x + y) + p², and so the volume of all three.
        ab, bc, ca = (dots(u, v) - p @ (u + v).T + square for u, v in ((x, y), (y, z), (z, x)))
        turn = 2 * np.arctan2(levels - p @ normals.T, la * lb * lc + ab * lc + bc * la + ca * lb)
        inside = turn.sum(axis=1) > 2 * np.pi
        # A triangle has its middle in it: none whose middle is farther than the nearest by more than its reach is nearest.
        far = np.linalg.norm(middles[None] - p[:, None], axis=2)
        of, which = np.nonzero(far - reach <= far.min(axis=1)[:, None] * (1 + 1e-9))
        nearest = np.full(len(p), np.inf)
        np.minimum.at(nearest, of, to_triangle(*(corners[:, which] - p[of])))
        out[part] = np.sqrt(nearest) * np.where(inside, -1, 1)
    return out


def dots(x, y):
    """Products of vectors along the last axis."""
    return np.einsum("...k,...k->...", x, y)


def to_triangle(a, b, c):
    """Squared distance of the origin from triangles abc."""
    square = np.minimum.reduce([to_segment(x, y) for x, y in ((a, b), (b, c), (c, a))])
    n = np.cross(b - a, c - a)
    over = np.logical_and.reduce([dots(np.cross(x, y), n) > 0 for x, y in ((a, b), (b, c), (c, a))])
    height = dots(a, n) ** 2 / np.maximum(dots(n, n), 1e-300)
    return np.where(over, np.minimum(square, height), square)


def to_segment(a, b):
    """Squared distance of the origin from segments ab."""
    d = b - a
    t = -dots(a, d) / np.maximum(dots(d, d), 1e-300)
    x = a + np.clip(t, 0, 1)[..., None] * d
    return dots(x, x)
