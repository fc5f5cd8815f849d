"""Young's modulus by direction: the surface E(n), drawn and as a mesh."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import extension, write_bytes
from ..mesh import Mesh

__all__ = ["SURFACE_WRITES", "modulus", "sphere", "surface", "write_surface"]

SURFACE_WRITES = ("png", "ply", "vtu")
#: Times that the edges of an icosahedron are halved: 10242 directions, 2 degrees apart.
HALVED = 5


def modulus(stiffness: Sequence[Sequence[float]], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Young's modulus along unit vectors (n, 3): 1 / (s · S s) with s = (x², y², z², yz, xz, xy) and S the inverse of the
    stiffness in Voigt's order 11 22 33 23 13 12.
    """
    x, y, z = np.asarray(directions, dtype=float).T
    strain = np.stack([x * x, y * y, z * z, y * z, x * z, x * y], axis=1)
    return 1.0 / np.einsum("ni,ij,nj->n", strain, np.linalg.inv(np.asarray(stiffness)), strain)


def sphere(halved: int = HALVED) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Directions (n, 3) spread evenly, and triangles (m, 3) between them, counter-clockwise seen from outside."""
    golden = (1 + 5**0.5) / 2
    corners = [(s, t * golden, 0.0) for s in (-1, 1) for t in (-1, 1)]
    vertices = [np.roll(c, turn) for turn in range(3) for c in corners]
    points = [v / np.linalg.norm(v) for v in vertices]
    near = min(np.linalg.norm(points[0] - p) for p in points[1:]) * 1.01
    close = [[np.linalg.norm(a - b) < near for b in points] for a in points]
    triangles = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if close[i][j] and close[j][k] and close[i][k]:
                    outward = np.dot(np.cross(points[j] - points[i], points[k] - points[i]), points[i]) > 0
                    triangles.append((i, j, k) if outward else (i, k, j))
    for _ in range(halved):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, known: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in known:
                known[key] = len(points)
                sum_ = points[a] + points[b]
                points.append(sum_ / np.linalg.norm(sum_))
            return known[key]

        finer = []
        for a, b, c in triangles:
            d, e, f = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        triangles = finer
    return np.array(points), np.array(triangles, dtype=np.int64)


def surface(stiffness: Sequence[Sequence[float]]) -> tuple[Mesh, NDArray[np.float64]]:
    """The surface at whose points the distance from the origin is Young's modulus that way, and that modulus at each vertex."""
    directions, triangles = sphere()
    along = modulus(stiffness, directions)
    return Mesh.of(directions * along[:, None], triangles), along


def write_surface(path: str | os.PathLike[str], stiffness: Sequence[Sequence[float]], unit: str = "") -> None:
    """Writes the surface: a picture (.png), or triangles with the modulus E at their corners (.ply with colours, .vtu)."""
    kind = extension(path, SURFACE_WRITES)
    mesh, along = surface(stiffness)
    label = f"Young's modulus E{unit and f', {unit}'}"
    draw = {"png": lambda: mesh.png((1200, 900), color=along, label=label, axes=True), "ply": lambda: ply(mesh, along)}
    data = draw.get(kind, lambda: vtu(mesh, along))()
    write_bytes(path, data)


def ply(mesh: Mesh, along: NDArray[np.float64]) -> bytes:
    """Binary PLY with colours from blue (soft) to red (stiff)."""
    low, high = along.min(), along.max()
    share = (along - low) / (high - low if high > low else 1.0)
    colours = np.stack([share, 1 - np.abs(2 * share - 1), 1 - share], axis=1)
    vertex = np.zeros(len(along), dtype=[("p", "<f4", 3), ("E", "<f4"), ("c", "u1", 3)])
    vertex["p"], vertex["E"], vertex["c"] = mesh.vertices, along, np.rint(255 * colours)
    face = np.zeros(len(mesh.triangles), dtype=[("n", "u1"), ("v", "<i4", 3)])
    face["n"], face["v"] = 3, mesh.triangles
    names = [f"property float {n}" for n in "xyzE"] + [f"property uchar {n}" for n in ("red", "green", "blue")]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertex)}", *names, f"element face {len(face)}"]
    return (
        "\n".join([*head, "property list uchar int vertex_indices", "end_header", ""]).encode()
        + vertex.tobytes()
        + face.tobytes()
    )


def vtu(mesh: Mesh, along: NDArray[np.float64]) -> bytes:
    """A VTK file of triangles with E at their corners, as text."""
    triangles = mesh.triangles

    def array(kind: str, name: str, values: Any, more: str = "") -> str:
        numbers = " ".join(f"{v:.9g}" if kind == "Float64" else str(v) for v in np.ravel(values).tolist())
        return f'<DataArray type="{kind}" Name="{name}"{more} format="ascii">{numbers}</DataArray>'

    points = array("Float64", "points", mesh.vertices, ' NumberOfComponents="3"')
    cells = [array("Int64", "connectivity", triangles), array("Int64", "offsets", np.arange(3, 3 * len(triangles) + 1, 3))]
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>',
        f'<Piece NumberOfPoints="{len(along)}" NumberOfCells="{len(triangles)}">',
        f'<PointData Scalars="E">{array("Float64", "E", along)}</PointData>',
        f"<Points>{points}</Points>",
        f"<Cells>{''.join(cells)}{array('UInt8', 'types', np.full(len(triangles), 5))}</Cells>",
        "</Piece></UnstructuredGrid></VTKFile>",
        "",
    ]
    return "\n".join(lines).encode()
