#!/usr/bin/env python3
"""Reference numbers for corpus/designs, independent of the core: numpy and the formulas, written out once more here.

Volume and areas come from dense parallel lines, as in cell_reference.py; Euler number, pieces and cavities from the
cubes of a fine grid (scipy labels them). Where a number is known in closed form, corpus/solids.toml uses that.

    python scripts/solid_reference.py [--lines 300] [NAME ...]
"""

import argparse

import numpy as np
from cell_reference import formula, waves
from scipy import ndimage

TAU = 2 * np.pi


def rotation(x, y, z):
    """Rx Ry Rz, degrees."""
    (sx, cx), (sy, cy), (sz, cz) = ((np.sin(a), np.cos(a)) for a in np.radians((x, y, z)))
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return rx @ ry @ rz


def seen(name, p, matrix, offset=(0, 0, 0)):
    """The named cell at phases matrix (p - offset)."""
    u = [sum(matrix[i][k] * (p[k] - offset[k]) for k in range(3)) for i in range(3)]
    return formula(name, *map(waves, u))


def box(p, low, high):
    """A function with the sign of the distance to a box."""
    parts = [np.maximum(low[k] - p[k], p[k] - high[k]) for k in range(3)]
    return np.maximum(np.maximum(parts[0], parts[1]), parts[2])


def ball(p, centre, radius):
    """Distance to a sphere."""
    return np.sqrt(sum((p[k] - centre[k]) ** 2 for k in range(3))) - radius


def tube(p, radius, low, high):
    """A function with the sign of the distance to an upright cylinder."""
    return np.maximum(np.hypot(p[0], p[1]) - radius, np.maximum(low - p[2], p[2] - high))


def ramp(s, s0, v0, s1, v1):
    """Linear between two stops, constant beyond."""
    return v0 + (v1 - v0) * np.clip((s - s0) / (s1 - s0), 0, 1)


def lens(p):
    """The ball of radius 9 about (0, 0, -4) above z = -1, grown by 0.5 as min and max do it."""
    return np.maximum(ball(p, (0, 0, -4), 9), -1 - p[2]) - 0.5


def iso(n):
    """Scaling by 1/n."""
    return np.eye(3) / n


SHEAR = np.array([[1, 0, -np.tan(np.radians(20))], [0, 1, 0], [0, 0, 1]])
MOVED = (0.3, 0.7, 1.1)
T30 = 0.463951958  # gyroid, sheet, fraction 0.30: corpus/cells.toml
D35 = 0.365449953  # diamond, f >= t, fraction 0.35: the sheet of fraction 0.3 has this half-level, and V(-t) = 0.35

# name: (bounds, region, lattice), negative inside
SOLIDS = {
    "lamellae": (
        ((-5,) * 3, (5,) * 3),
        lambda p: box(p, (-5,) * 3, (5,) * 3),
        lambda p: np.cos(TAU * (p[0] - 0.3) / 5) + 0 * p[1] * p[2],
    ),
    "gyroid_half": (
        ((-5,) * 3, (5,) * 3),
        lambda p: box(p, (-5,) * 3, (5,) * 3),
        lambda p: seen("gyroid", p, iso(5), MOVED),
    ),
    "gyroid_sheet_30": (
        ((0,) * 3, (10,) * 3),
        lambda p: box(p, (0,) * 3, (10,) * 3),
        lambda p: np.abs(seen("gyroid", p, iso(5), MOVED)) - T30,
    ),
    "diamond_upper_porous": (
        ((0,) * 3, (12, 10, 8)),
        lambda p: box(p, (0,) * 3, (12, 10, 8)),
        lambda p: D35 - seen("diamond", p, np.diag([1 / 6, 1 / 5, 1 / 4]), MOVED),
    ),
    "primitive_cavities": (
        ((-2.5,) * 3, (7.5,) * 3),
        lambda p: box(p, (-2.5,) * 3, (7.5,) * 3),
        lambda p: seen("primitive", p, iso(5)) - 2.5,
    ),
    "primitive_blobs": (
        ((-2.5,) * 3, (7.5,) * 3),
        lambda p: box(p, (-2.5,) * 3, (7.5,) * 3),
        lambda p: 2.5 - seen("primitive", p, iso(5)),
    ),
    "iwp_ball": (
        ((-5, -4, -3), (7, 8, 9)),
        lambda p: ball(p, (1, 2, 3), 6),
        lambda p: np.abs(seen("iwp", p, iso(5) @ rotation(10, 20, 30).T, (0.5, -0.25, 1.0))) - 0.9,
    ),
    "spartan_cylinder": (
        ((-6, -6, -4), (6, 6, 5)),
        lambda p: tube(p, 6, -4, 5),
        lambda p: seen("gyroid_mirrored", p, rotation(20, 35, 50).T @ np.diag([1 / 4, 1 / 5, 1 / 6])) - 0.25,
    ),
    "linear_slab": (
        ((0,) * 3, (20, 8, 8)),
        lambda p: box(p, (0,) * 3, (20, 8, 8)),
        lambda p: np.abs(seen("gyroid", p, iso(4), MOVED)) - ramp(p[0], 2, 0.2, 18, 0.9),
    ),
    "depth_ball": (
        ((-7,) * 3, (7,) * 3),
        lambda p: ball(p, (0,) * 3, 7),
        lambda p: np.abs(seen("primitive", p, iso(5))) - ramp(-ball(p, (0,) * 3, 7), 0, 0.9, 4, 0.3),
    ),
    "formula_ring": (
        ((-9, -9, 0), (9, 9, 5)),
        lambda p: np.maximum(tube(p, 9, 0, 5), -tube(p, 4, -1, 6)),
        lambda p: np.abs(seen("diamond", p, iso(5))) - (0.4 + 0.1 * np.sin(p[0] / 3)),
    ),
    "skewed_lens": (
        ((-9.5, -9.5, -1.5), (9.5, 9.5, 5.5)),
        lens,
        lambda p: -seen("neovius", p, iso(6) @ SHEAR),
    ),
}


def sweep(bounds, region, lattice, axis, n, samples):
    """(volume, this axis' share of the lattice and cut areas), from lines along `axis`."""
    low, high = (np.array(b, float) for b in bounds)
    size = high - low
    one, two = (k for k in range(3) if k != axis)
    first = low[one] + size[one] * (np.arange(n) + 0.5) / n
    second = low[two] + size[two] * (np.arange(n) + 0.5) / n
    # A margin, so that surfaces on the bounds are crossed.
    start, stop = low[axis] - 0.01 * size[axis], high[axis] + 0.01 * size[axis]
    along = np.linspace(start, stop, samples + 1)
    element = size[one] * size[two] / n**2
    volume, areas = 0.0, np.zeros(2)
    for a in first:
        p = [None] * 3
        p[axis], p[one], p[two] = along[None, :], np.array([[a]]), second[:, None]
        f = np.maximum(*np.broadcast_arrays(region(p), lattice(p)))
        b, e = f[:, :-1], f[:, 1:]
        w = np.clip(-np.minimum(b, e) / np.maximum(np.abs(e - b), 1e-300), 0, 1)
        volume += w.sum() * (along[1] - along[0]) * element
        row, col = np.nonzero((b <= 0) != (e <= 0))
        # The crossing by bisection on the max, so that either function may end the solid.
        left, right, inside = along[col], along[col + 1], b[row, col] <= 0
        q = [None] * 3
        q[one], q[two] = np.full(len(row), a), second[row]
        for _ in range(40):
            q[axis] = (left + right) / 2
            same = (np.maximum(region(q), lattice(q)) <= 0) == inside
            left, right = np.where(same, q[axis], left), np.where(same, right, q[axis])
        cut = region(q) > lattice(q)
        for k, function in enumerate((lattice, region)):
            mine = cut == bool(k)
            gradient = []
            for d in range(3):
                ahead, behind = [v[mine].copy() for v in q], [v[mine].copy() for v in q]
                ahead[d] += 1e-6
                behind[d] -= 1e-6
                gradient.append(function(ahead) - function(behind))
            gradient = np.array(gradient)
            weight = np.abs(gradient[axis]) / np.maximum(np.linalg.norm(gradient, axis=0), 1e-300)
            areas[k] += weight.sum() * element
    return volume, areas


def topology(bounds, region, lattice, n):
    """(Euler number of the surface, pieces, cavities) from the cubes of a grid whose corners are all inside."""
    low, high = (np.array(b, float) for b in bounds)
    step = (high - low).max() / n
    axes = [np.arange(a - 1.63 * step, b + 2 * step, step) for a, b in zip(low, high, strict=True)]
    p = np.meshgrid(*axes, indexing="ij", sparse=True)
    inside = np.maximum(region(p), lattice(p)) <= 0
    euler = 0
    for mask in range(8):
        block = inside
        for axis in range(3):
            if mask >> axis & 1:
                block = np.logical_and(
                    *(np.take(block, np.arange(block.shape[axis])[s], axis) for s in (slice(1, None), slice(None, -1)))
                )
        euler += (-1) ** bin(mask).count("1") * int(block.sum())
    pieces = ndimage.label(inside)[1]
    voids = ndimage.label(~inside, np.ones((3, 3, 3)))[1] - 1
    return 2 * euler, pieces, voids


def main():
    """Print the numbers."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("names", nargs="*", default=list(SOLIDS))
    options.add_argument("--lines", type=int, default=200)
    options.add_argument("--samples", type=int, default=400)
    options.add_argument("--grid", type=int, default=200)
    a = options.parse_args()
    for name in a.names:
        solid = SOLIDS[name]
        sweeps = [sweep(*solid, axis, a.lines, a.samples) for axis in range(3)]
        volumes = [v for v, _ in sweeps]
        lattice, cut = sum(s for _, s in sweeps)
        euler, pieces, cavities = topology(*solid, a.grid)
        print(
            f"[{name}]\nvolume = {np.mean(volumes):.4f}  # spread {np.ptp(volumes):.1e}\narea_lattice = {lattice:.3f}\n"
            f"area_cut = {cut:.3f}\neuler = {euler}\npieces = {pieces}\ncavities = {cavities}\n",
            flush=True,
        )


if __name__ == "__main__":
    main()
