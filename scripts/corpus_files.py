#!/usr/bin/env python3
"""Writes the files that designs of the corpus refer to: meshes, numbers on grids and at points, tables of beams.

    python scripts/corpus_files.py

Everything follows from the formulas here; solid_reference.py imports them for its own numbers.
"""

from itertools import permutations, product
from pathlib import Path

import numpy as np

FILES = Path(__file__).resolve().parent.parent / "corpus" / "designs" / "files"

# The outline of bracket.stl (cm) in x and y, counter-clockwise; it is 0.5 high.
BRACKET = [(0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1)]
# Scattered points of scatter.csv: y, z and value, at x = 0 and x = 8 alike.
SCATTER = [(0.0, 0.0, 0.2), (5.0, 0.5, 0.5), (1.5, 4.0, 0.35), (6.0, 3.5, 0.6)]

# The arrays of turn.vtu: the axes (1, 0, -1), (0, 1, 0) and (1, 0, 1), as a direction and as a tensor of the values 1, 2, 3
# in two orders of its components.
TURN = {"direction": (1, 0, 1), "stress_vtk": (2, 2, 2, 0, 0, 1), "stress_voigt": (2, 2, 2, 0, 1, 0)}

# The same three axes, as two arrays of axes.vtu whose order and signs change from point to point.
ORDERS = [(0, 2, 1, 1), (1, 0, -1, 1), (2, 1, 1, -1), (0, 1, -1, -1), (2, 0, 1, 1), (1, 2, 1, -1), (0, 2, -1, 1), (1, 0, 1, 1)]
AXES = np.array([(1, 0, -1), (0, 1, 0), (1, 0, 1)])


def plate(y, z):
    """The numbers of plate.npy at its nodes y = 0, 2, 4, 6 and z = 0, 2, 4."""
    return 10.0 + 3.0 * y + z * z


def rods(x, y):
    """The cell of rods.npy: two waves along x and y, and one of both."""
    return np.cos(2 * np.pi * x) + np.cos(2 * np.pi * y) + 0.5 * np.cos(2 * np.pi * (x + y))


def bracket():
    """The triangles of an L-shaped prism, outward."""
    fan = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]  # visible from corner 0
    out = []
    for a, b, c in fan:
        low, high = ([(*BRACKET[i], z) for i in (a, b, c)] for z in (0.0, 0.5))
        out += [low[::-1], high]
    for p, q in zip(BRACKET, BRACKET[1:] + BRACKET[:1], strict=True):
        a, b, c, d = (*p, 0.0), (*q, 0.0), (*q, 0.5), (*p, 0.5)
        out += [[a, b, c], [a, c, d]]
    return np.array(out)


def octahedron():
    """The triangles of the octahedron of the unit cube about the origin, outward."""
    out = []
    for s in product((-0.5, 0.5), repeat=3):
        corners = [np.eye(3)[k] * s[k] for k in range(3)]
        out.append(corners if np.prod(s) > 0 else corners[::-1])
    return np.array(out)


def open_box(size):
    """The triangles of a box from the origin without its top, outward."""
    sides = [(0, 2, 3, 1), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]  # bit a of a corner's number: upper along a
    corner = [[size[a] * (i >> a & 1) for a in range(3)] for i in range(8)]
    return np.array([[corner[i] for i in t] for a, b, c, d in sides for t in ((a, b, c), (a, c, d))], dtype=float)


def tiff(pictures):
    """A TIFF of grey pictures of eight bits, one above the other: an array of layers, rows, columns."""
    data, out = np.asarray(pictures, "u1"), bytearray(b"II*\0\0\0\0\0")
    last = 4
    for layer in data:
        place = len(out)
        out += layer.tobytes()
        out += bytes(len(out) % 2)
        out[last : last + 4] = np.uint32(len(out)).tobytes()
        rows, columns = layer.shape
        # Width, height, bits, no compression, black is 0, where the rows are, one sample, rows in the strip, bytes in it.
        tags = {256: columns, 257: rows, 258: 8, 259: 1, 262: 1, 273: place, 277: 1, 278: rows, 279: layer.size}
        out += np.uint16(len(tags)).tobytes()
        out += b"".join(np.array([tag, 4], "<u2").tobytes() + np.array([1, v], "<u4").tobytes() for tag, v in tags.items())
        last = len(out)
        out += bytes(4)
    return bytes(out)


def scan():
    """The grey values of scan.tif: bright in the middle half of sixteen layers."""
    layer = np.arange(16)
    return np.broadcast_to(np.where((layer >= 4) & (layer < 12), 200, 50)[:, None, None], (16, 4, 4))


def stl(triangles):
    """A binary STL."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("mark", "<u2")])
    records = np.zeros(len(triangles), record)
    records["corners"] = triangles
    return bytes(80) + np.uint32(len(triangles)).tobytes() + records.tobytes()


def blocks(counts, size):
    """Nodes and positive tetrahedra of a box of cubes, six to a cube about its diagonal (Kuhn's division)."""
    nodes = np.array(list(product(*(range(n + 1) for n in counts))))
    number = {tuple(p): i for i, p in enumerate(nodes.tolist())}
    tets = []
    for corner in product(*(range(n) for n in counts)):
        for order in permutations(range(3)):
            path = [np.array(corner)]
            for axis in order:
                path.append(path[-1] + np.eye(3, dtype=int)[axis])
            if np.linalg.det(np.array(path[1:]) - path[0]) < 0:
                path[2], path[3] = path[3], path[2]
            tets.append([number[tuple(p.tolist())] for p in path])
    return nodes * float(size), tets


def vtu(nodes, tets, **arrays):
    """A VTU in ASCII, with arrays of its nodes."""

    def data(kind, rows, **keys):
        given = "".join(f' {k}="{v}"' for k, v in keys.items())
        text = "\n".join(" ".join(f"{v:g}" for v in np.atleast_1d(row)) for row in rows)
        return f'<DataArray type="{kind}"{given} format="ascii">\n{text}\n</DataArray>\n'

    def wide(values):
        return 1 if np.ndim(values) == 1 else np.shape(values)[1]

    points = "".join(data("Float64", v, Name=name, NumberOfComponents=wide(v)) for name, v in arrays.items())
    return (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">\n'
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{len(nodes)}" NumberOfCells="{len(tets)}">\n'
        f"<PointData>\n{points}</PointData>\n<Points>\n{data('Float64', nodes, NumberOfComponents=3)}</Points>\n<Cells>\n"
        + data("Int64", tets, Name="connectivity")
        + data("Int64", [4 * (i + 1) for i in range(len(tets))], Name="offsets")
        + data("UInt8", [10] * len(tets), Name="types")
        + "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )


def main():
    """Write the files."""
    FILES.mkdir(exist_ok=True)
    (FILES / "bracket.stl").write_bytes(stl(bracket()))
    broken = bracket()[1:]
    broken[3] = broken[3][::-1]
    (FILES / "bracket_broken.stl").write_bytes(stl(broken))
    (FILES / "bin.stl").write_bytes(stl(open_box((8, 6, 4))))
    (FILES / "octahedron.stl").write_bytes(stl(octahedron()))
    _, y, z = np.meshgrid([0, 4, 8], [0, 2, 4, 6], [0, 2, 4], indexing="ij")
    np.save(FILES / "plate.npy", plate(y, z).astype(float))
    _, y, z = np.meshgrid([0, 2, 4, 6, 8], [0, 2, 4, 6], [0, 2, 4], indexing="ij")
    np.save(FILES / "slab.npy", plate(y, z).astype(float))
    t = np.arange(8) / 8
    np.save(FILES / "rods.npy", np.broadcast_to(rods(t[:, None, None], t[None, :, None]), (8, 8, 8)).copy())
    (FILES / "scan.tif").write_bytes(tiff(scan()))
    rows = [f"{x:g},{y:g},{z:g},{v:g}" for x in (0, 8) for y, z, v in SCATTER]
    (FILES / "scatter.csv").write_text("\n".join(["x,y,z,value", *rows]) + "\n", encoding="utf-8")
    nodes, tets = blocks((4, 3, 2), 2.0)
    (FILES / "load.vtu").write_text(vtu(nodes, tets, load=100 * nodes[:, 1] / 6), encoding="utf-8")
    (FILES / "load_m.vtu").write_text(vtu(nodes / 1000, tets, load=100 * nodes[:, 1] / 6), encoding="utf-8")
    nodes, tets = blocks((1, 1, 1), 8.0)
    same = {name: np.tile(v, (len(nodes), 1)) for name, v in TURN.items()}
    (FILES / "turn.vtu").write_text(vtu(nodes - 4.0, tets, **same), encoding="utf-8")
    mixed = {name: np.array([o[2 + k] * AXES[o[k]] for o in ORDERS]) for k, name in enumerate(("first", "third"))}
    (FILES / "axes.vtu").write_text(vtu(nodes - 4.0, tets, **mixed), encoding="utf-8")
    rows = [",".join(f"{v:g}" for v in (*point, *TURN["stress_voigt"])) for point in nodes - 4.0]
    (FILES / "turn.csv").write_text("\n".join(["x,y,z,s11,s22,s33,s23,s13,s12", *rows]) + "\n", encoding="utf-8")
    (FILES / "block.vtu").write_text(vtu(*blocks((2, 1, 1), 4.0)), encoding="utf-8")
    (FILES / "line.csv").write_text("x,y,z\n-1,0,0\n9,0,0\n", encoding="utf-8")
    (FILES / "control.csv").write_text("x,y,z,value\n0,1,1,0.6\n0,5,1,0.3\n0,3,3,0.5\n", encoding="utf-8")
    angles = np.arange(8) * np.pi / 4
    ring = [f"{6 * np.cos(a):.6f},{6 * np.sin(a):.6f},1" for a in angles]
    (FILES / "ring.csv").write_text("\n".join(["x,y,z", *ring]) + "\n", encoding="utf-8")
    (FILES / "nodes.csv").write_text("id,x,y,z,r\n1,0,0,0,1\n2,6,0,0,1\n", encoding="utf-8")
    (FILES / "struts.csv").write_text("a,b\n1,2\n", encoding="utf-8")


if __name__ == "__main__":
    main()
