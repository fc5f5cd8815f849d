#!/usr/bin/env python3
"""Make examples/parts/hip_stem.stl: a femoral stem of our own design, for the demo. Needs numpy only.

The solid is lofted between two rails in the plane y = 0, the lateral and the medial border of a stem seen from the
front. Every section is a superellipse whose long axis joins the rails and whose short axis is y. Rails, thickness and
exponent are natural cubic splines through the rows of STATIONS; the distal tip is rounded, the taper's end is flat with
a rounded rim. Sections turn from horizontal to the neck's 45 degrees without crossing, so the surface is embedded.

    python scripts/make_stem.py [OUT.stl]
"""

import sys
from pathlib import Path

import numpy as np

AROUND = 72  # points of a section
ALONG = 78  # sections between tip and neck end

# lateral x, z · medial x, z · half thickness in y · exponent of the superellipse (mm; x is medial, z is up)
STATIONS = np.array(
    [
        [-4.6, 0.0, 4.4, 0.0, 4.1, 2.0],
        [-5.1, 18.0, 4.9, 18.0, 4.6, 2.1],
        [-5.7, 36.0, 5.7, 35.5, 5.3, 2.3],
        [-6.5, 53.0, 7.2, 51.0, 6.1, 2.5],
        [-7.9, 68.0, 10.2, 63.5, 7.0, 2.7],
        [-10.0, 81.0, 14.4, 73.0, 7.8, 2.8],
        [-11.9, 90.5, 18.5, 79.6, 8.1, 2.8],
        [-11.3, 96.6, 21.4, 83.9, 7.8, 2.7],
        [-6.0, 99.6, 23.6, 87.4, 7.0, 2.5],
        [3.5, 99.0, 25.6, 90.7, 6.2, 2.2],
        [12.6, 99.6, 27.9, 93.8, 5.7, 2.0],
        [18.6, 103.0, 31.0, 96.9, 5.5, 2.0],
        [23.0, 107.0, 34.4, 100.2, 5.6, 2.0],
        [26.4, 110.6, 37.4, 103.2, 6.1, 2.0],
        [28.6, 113.5, 39.0, 105.6, 6.4, 2.0],
        [34.6, 119.3, 43.3, 110.6, 6.1, 2.0],
        [37.6, 122.2, 46.1, 113.7, 6.0, 2.0],
    ]
)
TIP = 9.0  # length of the rounded tip, mm
RIM = 0.8  # radius of the rim at the neck's end, mm


def natural_spline(knots, values, at):
    """Natural cubic spline through `values` (n, k) at `knots` (n,), evaluated at `at` (m,): (m, k)."""
    n, h = len(knots), np.diff(knots)
    a = np.eye(n)
    b = np.zeros_like(values)
    for i in range(1, n - 1):
        a[i, i - 1 : i + 2] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
        b[i] = 6 * ((values[i + 1] - values[i]) / h[i] - (values[i] - values[i - 1]) / h[i - 1])
    m = np.linalg.solve(a, b)
    i = np.clip(np.searchsorted(knots, at) - 1, 0, n - 2)
    t, s, d = (knots[i + 1] - at)[:, None], (at - knots[i])[:, None], h[i][:, None]
    chord = values[i] * t / d + values[i + 1] * s / d
    return chord + (m[i] * (t**3 / d - t * d) + m[i + 1] * (s**3 / d - s * d)) / 6


def section(row, size, shift):
    """One ring of points (AROUND, 3), scaled by `size` about its middle and moved by `shift` along its normal."""
    lateral, medial = row[[0, 1]], row[[2, 3]]
    middle, half = (lateral + medial) / 2, (medial - lateral) / 2
    along = np.array([-half[1], half[0]]) / np.hypot(*half)  # towards the neck
    turn = np.arange(AROUND) * 2 * np.pi / AROUND
    c, s = np.cos(turn), np.sin(turn)
    c, s = (np.sign(v) * np.abs(v) ** (2 / row[5]) for v in (c, s))
    plane = middle + shift * along + size[0] * c[:, None] * half
    return np.column_stack([plane[:, 0], size[1] * s * row[4], plane[:, 1]])


def stem():
    """Vertices (n, 3) and outward triangles (m, 3)."""
    middle = (STATIONS[:, :2] + STATIONS[:, 2:4]) / 2
    # A knot spacing between that of the rails and that of the mid-line keeps the shoulder free of overshoot.
    step = sum(np.hypot(*np.diff(p, axis=0).T) for p in (middle, STATIONS[:, :2], STATIONS[:, 2:4])) / 3
    knots = np.r_[0, np.cumsum(step)]
    tip = TIP * (1 - np.cos(np.linspace(0, np.pi / 2, 12)[1:-1]))
    at = np.r_[tip, np.linspace(TIP, knots[-1], ALONG)]
    rows = natural_spline(knots, STATIONS, at)

    rings = []
    for u, row in zip(at, rows, strict=True):
        round_off = np.sqrt(1 - (1 - min(u, TIP) / TIP) ** 2)
        rings.append(section(row, (round_off, round_off), 0.0))
    last = rows[-1]
    sizes = np.array([np.hypot(*(last[:2] - last[2:4])) / 2, last[4]])
    for angle in np.linspace(0, np.pi / 2, 5)[1:]:
        rings.append(section(last, (sizes - RIM * (1 - np.cos(angle))) / sizes, RIM * np.sin(angle)))
    for inner in (0.66, 0.33):
        rings.append(section(last, (sizes - RIM) / sizes * inner, RIM))

    foot = (rows[0][[0, 2]].mean(), 0.0, 0.0)
    top = rings[-1].mean(axis=0)
    vertices = np.vstack([[foot], *rings, [top]])
    ring, around = np.arange(len(rings))[:-1, None], np.arange(AROUND)[None]
    a = 1 + ring * AROUND + around
    b = 1 + ring * AROUND + (around + 1) % AROUND
    c, d = a + AROUND, b + AROUND
    # The shorter diagonal of every quadrilateral.
    flip = np.linalg.norm(vertices[a] - vertices[d], axis=-1) < np.linalg.norm(vertices[b] - vertices[c], axis=-1)
    one = np.where(flip[..., None], np.stack([a, b, d], -1), np.stack([a, b, c], -1))
    two = np.where(flip[..., None], np.stack([a, d, c], -1), np.stack([b, d, c], -1))
    k = np.arange(AROUND)
    n, end = (k + 1) % AROUND, 1 + (len(rings) - 1) * AROUND
    caps = [np.column_stack([0 * k, 1 + n, 1 + k]), np.column_stack([0 * k + len(vertices) - 1, end + k, end + n])]
    triangles = np.vstack([one.reshape(-1, 3), two.reshape(-1, 3), *caps])
    return vertices, triangles


def volume(vertices, triangles):
    """Enclosed volume; positive when triangles are counter-clockwise seen from outside."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def check(vertices, triangles):
    """Refuse a mesh that is not closed, oriented and free of doubled points after rounding to f32."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward = {tuple(e) for e in edges.tolist()}
    assert len(forward) == len(edges), "an edge is used twice in one direction"
    assert all((b, a) in forward for a, b in forward), "an edge is open"
    assert len(np.unique(vertices.astype("f4"), axis=0)) == len(vertices), "two vertices share a position"
    assert volume(vertices, triangles) > 0, "the triangles face inwards"


def write_stl(path, vertices, triangles):
    """Binary STL."""
    corners = vertices.astype("<f4")[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).astype("f8")
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    facet = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    facet["normal"], facet["corners"] = normal, corners
    header = b"Trabecula example part: hip stem, mm".ljust(80, b" ")
    Path(path).write_bytes(header + np.uint32(len(triangles)).astype("<u4").tobytes() + facet.tobytes())


def main():
    """Write the stem and say what it is."""
    default = Path(__file__).resolve().parent.parent / "examples" / "parts" / "hip_stem.stl"
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    vertices, triangles = stem()
    vertices = vertices.astype("f4").astype("f8")
    check(vertices, triangles)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_stl(path, vertices, triangles)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    print(f"{path}: {len(triangles)} triangles, {volume(vertices, triangles):.1f} mm3, bounds {low} to {high} mm")


if __name__ == "__main__":
    main()
