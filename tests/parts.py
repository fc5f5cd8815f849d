"""Parts as meshes, whole and damaged, made by an outside tool."""

import numpy as np
import pytest

manifold3d = pytest.importorskip("manifold3d")

ANGLES = (17, -31, 48)


def arrays(body):
    """Vertices and triangles of a manifold."""
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3], dtype=float), np.array(mesh.tri_verts, dtype=np.int64)


def box():
    """A block, upright."""
    return arrays(manifold3d.Manifold.cube((15, 13, 12), True))


def bracket():
    """An L bracket with a hole, turned."""
    cube = manifold3d.Manifold.cube
    body = cube((20, 12, 7)) + cube((7, 12, 18))
    hole = manifold3d.Manifold.cylinder(20, 2.5, circular_segments=40).translate((14, 6, -5))
    return arrays((body - hole).translate((-9, -6, -8)).rotate(ANGLES))


def ball():
    """A ball with bumps."""
    vertices, triangles = arrays(manifold3d.Manifold.sphere(1, 32))
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    x, y, z = vertices.T
    return vertices * (8 + 0.6 * np.sin(5 * x + 1) * np.sin(4 * y) * np.cos(5 * z))[:, None], triangles


def torus():
    """A ring of 22 mm, so round that nothing on it counts as an edge: those of united bodies are not kept."""
    ring = manifold3d.CrossSection.circle(4, 36).translate((7, 0))
    return arrays(ring.revolve(72).rotate(ANGLES))


PARTS = {"box": box, "bracket": bracket, "ball": ball, "torus": torus}


def refined(part):
    """The same with its long edges parted, so that a triangle is a small share of it."""
    body = manifold3d.Manifold(manifold3d.Mesh64(part[0], part[1].astype(np.uint64)))
    return arrays(body.refine_to_length(2.5))


def holes(part, some):
    """Triangles left out here and there."""
    vertices, triangles = part
    gone = some.choice(len(triangles), 5, replace=False)
    return vertices, np.delete(triangles, gone, axis=0)


def flipped(part, some):
    """A tenth of the triangles face inwards."""
    triangles = part[1].copy()
    which = some.random(len(triangles)) < 0.1
    triangles[which] = triangles[which, ::-1]
    return part[0], triangles


def doubled(part, some):
    """Some triangles twice, some from both sides."""
    which = some.choice(len(part[1]), 20)
    return part[0], np.concatenate([part[1], part[1][which[:10]], part[1][which[10:], ::-1]])


def overlapping(part, some):
    """The part as two bodies that overlap: the whole, and what is left of it when a half is cut off."""
    body = manifold3d.Manifold(manifold3d.Mesh64(part[0], part[1].astype(np.uint64)))
    half = arrays(body.trim_by_plane((0.3, 0.5, 0.81), 0.7))
    return np.concatenate([part[0], half[0]]), np.concatenate([part[1], half[1] + len(part[0])])


def inverted(part, some):
    """All faces inwards."""
    return part[0], part[1][:, ::-1]


def t_junctions(part, some):
    """Corners on edges that the neighbours do not know of."""
    vertices, triangles = part
    which = some.choice(len(triangles), 8, replace=False)
    a, b, c = triangles[which].T
    new = len(vertices) + np.arange(len(which))
    middle = (vertices[a] + vertices[b]) / 2
    halves = np.concatenate([np.stack([a, new, c], axis=1), np.stack([new, b, c], axis=1)])
    return np.concatenate([vertices, middle]), np.concatenate([np.delete(triangles, which, axis=0), halves])


DAMAGES = {f.__name__: f for f in (holes, flipped, doubled, overlapping, inverted, t_junctions)}


def write(path, part):
    """An OBJ file to the last bit."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in part[0].tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in part[1].tolist()]
    path.write_text("\n".join(lines) + "\n")
