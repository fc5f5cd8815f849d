#!/usr/bin/env python3
"""Writes docs/generated/file_cells.md: how near a cell from the mesh of a solid comes to it, by its number of waves, beside one
from the step on the same 64³ nodes that is 1 inside and 0 outside.

    python scripts/file_cells.py
"""

import tempfile
from pathlib import Path

import numpy as np
import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "generated" / "file_cells.md"
NODES, COUNT = 64, 4000
TERMS = (50, 200)
#: The cell is a cube of this edge (mm) about the origin.
EDGE = 10.0


def sphere(radius):
    """A ball: its mesh, whether points are in it, points on its surface, its volume."""
    rings = 96
    polar, around = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings, False), indexing="ij")
    nodes = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=2)
    number = np.arange(nodes[..., 0].size).reshape(polar.shape)
    a, c = number[:-1], number[1:]
    b, d = np.roll(a, -1, axis=1), np.roll(c, -1, axis=1)
    triangles = np.concatenate([np.stack(t, axis=2).reshape(-1, 3) for t in ((a, c, d), (a, d, b))])
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(COUNT)
    z = 1 - 2 * (np.arange(COUNT) + 0.5) / COUNT
    ring = np.sqrt(1 - z * z)
    points = radius * np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    mesh = lt.Mesh.of(radius * nodes.reshape(-1, 3), triangles)
    return mesh, lambda p: np.linalg.norm(p, axis=-1) < radius, points, 4 / 3 * np.pi * radius**3


def box(half, turn):
    """A cube, turned about its diagonal: its mesh, whether points are in it, points on its surface, its volume."""
    axis, s, c = np.ones(3) / np.sqrt(3), np.sin(turn), np.cos(turn)
    cross = np.cross(np.eye(3), axis)
    rotation = c * np.eye(3) - s * cross + (1 - c) * np.outer(axis, axis)
    corners = half * np.array([[1 if i >> a & 1 else -1 for a in range(3)] for i in range(8)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for p, q, r, s in quads for t in ((p, q, r), (p, r, s))]
    points = np.random.default_rng(1).uniform(-half, half, (COUNT, 3))
    face = np.arange(COUNT) % 3
    points[np.arange(COUNT), face] = half * np.sign(points[np.arange(COUNT), face])

    def inside(p):
        return (np.abs(p @ rotation) < half).all(axis=-1)

    return lt.Mesh.of(corners @ rotation.T, triangles), inside, points @ rotation.T, (2 * half) ** 3


def figures(cell, iso, points, volume):
    """The root mean square distance (edges) of a cell's surface from points that should lie on it, and of its fraction."""
    lattice = lt.Lattice(cell, "upper", lt.map.affine(wavelength=EDGE, offset=[-EDGE / 2] * 3), lt.level.iso(iso))
    solid = lt.Design(region=lt.region.box(size=[2 * EDGE] * 3), lattice=lattice).build()
    step = 1e-4 * EDGE
    slope = [(solid.field(points + step * e) - solid.field(points - step * e)) / (2 * step) for e in np.eye(3)]
    away = solid.field(points) / np.sqrt(sum(s * s for s in slope))
    fraction = solid.report()["lattices"]["core"]["fraction"]
    return np.sqrt((away**2).mean()) / EDGE, fraction - volume / EDGE**3


def rows(name, of, folder):
    """The rows of one solid."""
    mesh, inside, points, volume = of
    path, stepped = str(folder / "solid.ply"), str(folder / "step.npy")
    mesh.write(path)
    # The first number is that of the cell's corner, where phases are zero.
    at = EDGE * (np.arange(NODES) / NODES - 0.5)
    np.save(stepped, inside(np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1)).astype(float))
    for terms in TERMS:
        distance = figures(lt.cell.file(path, terms, period=EDGE), 0.0, points, volume)
        step = figures(lt.cell.file(stepped, terms), 0.5, points, volume)
        yield f"| {name} | {terms} | {distance[0]:.5f} | {step[0]:.5f} | {distance[1]:+.5f} | {step[1]:+.5f} |"


def main():
    solids = {
        "sphere of radius 0.3": sphere(0.3 * EDGE),
        "sphere of radius 0.45": sphere(0.45 * EDGE),
        "cube of edge 0.5": box(0.25 * EDGE, 0.0),
        "cube of edge 0.5, turned 30 degrees": box(0.25 * EDGE, np.pi / 6),
    }
    lines = [
        "# Cells from meshes, by numbers",
        "",
        "Written by `scripts/file_cells.py`: of solids in a cubic cell, whose edge is the unit, the root mean square distance",
        "of the cell's surface from the exact one, and what its fraction is off. *Distance* is the signed periodic distance,",
        f"as `cell.file` takes it of a mesh; *step* is 1 inside and 0 outside at the same {NODES}³ nodes.",
        "",
        "| solid | waves | surface, distance | surface, step | fraction, distance | fraction, step |",
        "|---|---|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for name, of in solids.items():
            for row in rows(name, of, Path(folder)):
                print(row, flush=True)
                lines.append(row)
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
