"""Writes docs/generated/thickness.md: local thickness of known shapes, and its change as the step is halved."""

import math
import tempfile
from pathlib import Path

import trabecula as lt

OUT = Path(__file__).resolve().parent.parent / "docs" / "generated" / "thickness.md"
STEPS = (0.16, 0.08, 0.04)


def turned(p):
    """A rotation about two axes, so that nothing lies along the grid."""
    x, y, z = p
    for a in (0.6, 0.9):
        x, y, z = z, x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)
    return x, y, z


def read(points, faces):
    """A mesh of points and faces."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.obj")
        lines = ["v {!r} {!r} {!r}".format(*turned(p)) for p in points]
        path.write_text("\n".join(lines + ["f " + " ".join(str(i + 1) for i in f) for f in faces]) + "\n")
        return lt.Mesh.read(path)


def slab(size, thick):
    points = [((i & 1) * size, (i >> 1 & 1) * size, (i >> 2) * thick) for i in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return read(points, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def sphere(radius, n=100):
    points = [(0, 0, radius), (0, 0, -radius)]
    for i in range(1, n):
        t = math.pi * i / n
        ring = [2 * math.pi * j / (2 * n) for j in range(2 * n)]
        points += [(radius * math.sin(t) * math.cos(a), radius * math.sin(t) * math.sin(a), radius * math.cos(t)) for a in ring]

    def at(i, j):
        return 2 + (i - 1) * 2 * n + j % (2 * n)

    faces = []
    for j in range(2 * n):
        faces += [(0, at(1, j), at(1, j + 1)), (1, at(n - 1, j + 1), at(n - 1, j))]
        for i in range(1, n - 1):
            faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
    return read(points, faces)


def gyroid(part, fraction):
    core = lt.Lattice(cell="gyroid", part=part, map=lt.map.affine(wavelength=4), level=lt.level.fraction(fraction))
    return lt.Design(region=lt.region.box(size=[8, 8, 8]), lattice={"core": core}).build().mesh(per_cell=48)


def main():
    shapes = [("slab of 1.03 mm, turned", slab(12, 1.03)), ("ball of 3 mm", sphere(1.5))]
    shapes += [(f"gyroid of 4 mm, {part}, fraction {f}", gyroid(part, f)) for part, f in (("sheet", 0.3), ("upper", 0.3))]
    lines = ["# Local thickness of known shapes", "", "Made by `scripts/thickness_accuracy.py`. mm.", ""]
    lines += ["| shape | step | wall min | p05 | mean | max | pore mean |", "|---|---|---|---|---|---|---|"]
    for name, mesh in shapes:
        for step in STEPS:
            made = mesh.thickness(step)
            figures = " | ".join(f"{made.wall[k]:.4f}" for k in ("min", "p05", "mean", "max"))
            pore = f"{made.pore['mean']:.4f}" if made.pore else ""
            lines.append(f"| {name} | {step} | {figures} | {pore} |")
    OUT.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
