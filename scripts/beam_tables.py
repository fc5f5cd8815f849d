#!/usr/bin/env python3
"""Writes docs/generated/beams.md and docs/images/beam_cells.svg: the unit cells of beams, in numbers and drawn."""

import math
from pathlib import Path

import numpy as np
import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
RADII = (0.02, 0.05, 0.08, 0.10, 0.12)
#: Samples along an edge of a cell, one anywhere in each small cube: good to a hundredth of the fraction at 0.02, and to less
#: than a half of that from 0.05 on.
SAMPLES = 64

TABLED = ("sc", "bcc", "fcc", "octet", "diamond", "kelvin", "rhombic_dodecahedron")
# For equal cylinders of radius x (cell edge 1) V = π x² ΣL − c x³ holds as long as no two beams overlap at mid length.
CUBIC = {
    "sc": 8 * math.sqrt(2),
    "bcc": 16 * math.sqrt(6),
    "diamond": 16 * math.sqrt(6),
    "octet": 64 * (1 + math.sqrt(2)),
    "kelvin": 60.3397786608,
    "rhombic_dodecahedron": 48 * math.sqrt(6),
}


def fraction(cell, radius):
    """The solid share of one cell, by a sample anywhere in each of many small cubes."""
    beams = lt.Beams(cell=cell, map=lt.map.affine(wavelength=1), radius=radius)
    solid = lt.Design(region=lt.region.box(min=[0, 0, 0], max=[1, 1, 1]), beams=beams).build()
    at = np.arange(SAMPLES) / SAMPLES
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(1).uniform(0, 1 / SAMPLES, points.shape)
    return np.count_nonzero(solid.field(points) <= 0) / len(points)


def drawing(cells, across=6, size=150):
    """All cells as line drawings: front beams dark, back beams pale."""
    turn, lift = math.radians(28), math.radians(18)
    rows = -(-len(cells) // across)
    width, height = across * size, rows * (size + 22)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">']
    out.append(f'<rect width="{width}" height="{height}" fill="#fff"/>')

    def place(p, edges):
        x, y, z = ((v - 0.5) * e / max(edges) for v, e in zip(p, edges, strict=True))
        right, deep = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        return right, z * math.cos(lift) + deep * math.sin(lift), deep * math.cos(lift) - z * math.sin(lift)

    for n, cell in enumerate(cells):
        left, top = (n % across) * size + size / 2, (n // across) * (size + 22) + size / 2
        lines = []
        for a, b in drawn(cell):
            p, q = place(a, cell["aspect"]), place(b, cell["aspect"])
            lines.append(((p[2] + q[2]) / 2, p, q))
        for deep, p, q in sorted(lines, key=lambda it: -it[0]):
            tone = round(60 + 130 * min(max(deep + 0.6, 0) / 1.2, 1))
            ends = " ".join(
                f'{k}="{v:.1f}"'
                for k, v in zip(
                    ("x1", "y1", "x2", "y2"),
                    (left + 88 * p[0], top - 88 * p[1], left + 88 * q[0], top - 88 * q[1]),
                    strict=True,
                )
            )
            out.append(f'<line {ends} stroke="rgb({tone},{tone},{tone + 20})" stroke-width="2.2" stroke-linecap="round"/>')
        out.append(f'<text x="{left}" y="{top + size / 2 + 10:.0f}" text-anchor="middle">{cell["name"]}</text>')
    return "\n".join([*out, "</svg>", ""])


def drawn(cell):
    """The struts of a cell that lie in it, its far faces included."""
    seen, made = set(), []
    for strut in cell["struts"]:
        a, b = (cell["nodes"][n] for n in strut["ends"])
        for n in range(27):
            by = (n % 3 - 1, n // 3 % 3 - 1, n // 9 - 1)
            p = [v + s for v, s in zip(a, by, strict=True)]
            q = [v + s + t for v, s, t in zip(b, by, strut["shift"], strict=True)]
            low, high = clipped(p, q)
            if high - low < 1e-6:
                continue
            ends = [[u + t * (v - u) for u, v in zip(p, q, strict=True)] for t in (low, high)]
            key = tuple(sorted(tuple(round(v, 6) for v in e) for e in ends))
            if key not in seen:
                seen.add(key)
                made.append(ends)
    return made


def clipped(p, q):
    """The part of a segment in the unit cube, as two shares of its length."""
    low, high = 0.0, 1.0
    for u, v in zip(p, q, strict=True):
        if abs(v - u) < 1e-12:
            if not -1e-9 <= u <= 1 + 1e-9:
                return 0.0, 0.0
            continue
        a, b = (-1e-9 - u) / (v - u), (1 + 1e-9 - u) / (v - u)
        low, high = max(low, min(a, b)), min(high, max(a, b))
    return low, high


def main():
    """Write the page and the picture."""
    cells = lt.beams.cells()
    lines = ["<!-- Made by scripts/beam_tables.py; do not edit. -->", "# The unit cells of beams in numbers", ""]
    lines += ["Lengths are in cell edges. Maxwell's count is beams less three for each node.", ""]
    lines += ["| cell | | group | nodes | beams | valence | Maxwell | length in all |", "|---|---|---|---|---|---|---|---|"]
    for it in cells:
        valence = ", ".join(f"{n} of {v}" for v, n in it["valence"].items())
        row = [f"`{it['name']}`", it["title"], it["group"], len(it["nodes"]), len(it["struts"]), valence, f"{it['maxwell']:+d}"]
        lines.append("| " + " | ".join(map(str, [*row, f"{it['length']:.6f}"])) + " |")
    lines += ["", "## Solid fraction against radius", ""]
    lines += [
        f"Radius over cell edge; beams without fillets. By {SAMPLES}³ samples; below, where it is known, the closed form",
        "π x² ΣL − c x³ for equal cylinders, which holds as long as no two beams overlap at mid length. Thin limit: π ΣL x².",
        "",
    ]
    lines += ["| cell | thin limit | " + " | ".join(f"{r:.2f}" for r in RADII) + " |", "|---" * (len(RADII) + 2) + "|"]
    for it in cells:
        if it["name"] not in TABLED:
            continue
        name, limit = it["name"], math.pi * it["length"]
        found = [fraction(name, r) for r in RADII]
        lines.append(f"| `{name}` | {limit:.3f} x² | " + " | ".join(f"{v:.4f}" for v in found) + " |")
        if name in CUBIC:
            exact = [limit * r**2 - CUBIC[name] * r**3 for r in RADII]
            lines.append("| closed form | | " + " | ".join(f"{v:.4f}" for v in exact) + " |")
    (ROOT / "docs" / "generated" / "beams.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (ROOT / "docs" / "images" / "beam_cells.svg").write_text(drawing(cells), encoding="utf-8")


if __name__ == "__main__":
    main()
