#!/usr/bin/env python3
"""Reference numbers for the named cells, independent of the core: numpy and the printed formulas only.

Along every grid line of one axis f is a smooth function of one variable. Its zero set is found by linear interpolation
between dense samples, which gives the solid fraction of the line and, at each crossing, the normal. Then

    fraction = mean over lines of the part of the line with f <= t
    area     = sum over the three axes of the mean of |n_a| over crossings       (because n_x^2 + n_y^2 + n_z^2 = 1)
    euler    = 2 (V - E + F - C) of the cubes whose corners are all in f <= 0    (surface = twice the solid)

    python scripts/cell_reference.py [--lines 256] [--samples 768] [CELL ...]

prints one TOML table for each cell: least and greatest value, area and Euler number of f = 0 per cubic cell of edge 1,
and the fraction of f <= t at the levels listed in LEVELS.
"""

import argparse

import numpy as np

TAU = 2 * np.pi


def waves(u):
    """sin and cos of one and two turns."""
    return np.sin(TAU * u), np.cos(TAU * u), np.sin(2 * TAU * u), np.cos(2 * TAU * u)


def formula(name, x, y, z):
    """f of the cell, for waves of broadcasting coordinates."""
    (sx, cx, s2x, c2x), (sy, cy, s2y, c2y), (sz, cz, s2z, c2z) = x, y, z
    pairs = c2x * c2y + c2y * c2z + c2z * c2x if name in ("frd", "lidinoid", "split_p") else 0
    return {
        "gyroid": lambda: sx * cy + sy * cz + sz * cx,
        "gyroid_mirrored": lambda: cx * sy + cy * sz + cz * sx,
        "diamond": lambda: sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz,
        "primitive": lambda: cx + cy + cz,
        "iwp": lambda: 2 * (cx * cy + cy * cz + cz * cx) - (c2x + c2y + c2z),
        "neovius": lambda: 3 * (cx + cy + cz) + 4 * cx * cy * cz,
        "frd": lambda: 4 * cx * cy * cz - pairs,
        "fischer_koch_s": lambda: c2x * sy * cz + cx * c2y * sz + sx * cy * c2z,
        "lidinoid": lambda: 0.5 * (s2x * cy * sz + s2y * cz * sx + s2z * cx * sy) - 0.5 * pairs + 0.15,
        "split_p": lambda: 1.1 * (s2x * sz * cy + s2y * sx * cz + s2z * sy * cx) - 0.2 * pairs - 0.4 * (c2x + c2y + c2z),
    }[name]()


CELLS = [
    "gyroid",
    "gyroid_mirrored",
    "diamond",
    "primitive",
    "iwp",
    "neovius",
    "frd",
    "fischer_koch_s",
    "lidinoid",
    "split_p",
]
# Levels (of f <= t) at which the fraction is wanted; rounded values near 0.05, 0.1, 0.2, 0.3, 0.5, 0.7 and 0.9.
LEVELS = {
    "gyroid": [-1.33, -1.2, -0.91, -0.62, 0.0, 0.62, 1.2],
    "gyroid_mirrored": [-0.62, 0.62],
    "diamond": [-1.09, -0.96, -0.72, -0.49, 0.0, 0.49, 0.96],
    "primitive": [-2.07, -1.62, -1.05, -0.7, 0.0, 0.7, 1.62],
    "iwp": [-3.6, -2.99, -2.17, -1.34, 0.23, 1.62, 2.69],
    "neovius": [-7.2, -4.86, -2.3, -0.97, 0.0, 0.97, 4.86],
    "frd": [-3.2, -2.16, -1.19, -0.65, 0.31, 1.12, 1.84],
    "fischer_koch_s": [-0.973, -0.785, -0.597, -0.404, 0.0, 0.404, 0.785],
    "lidinoid": [-0.816, -0.57, -0.272, -0.111, 0.144, 0.475, 0.865],
    "split_p": [-1.333, -1.104, -0.824, -0.567, -0.028, 0.531, 1.197],
}


def lines(name, axis, n, samples):
    """Slabs of f with the line direction last: shape (n, samples + 1), one slab after another."""
    # Off the symmetry planes, and by different amounts, so that no two lines are images of each other.
    first, second = (np.arange(n) + 0.371) / n, (np.arange(n) + 0.138) / n
    along = np.arange(samples + 1) / samples
    for a in first:
        slab = [None, None, None]
        slab[axis] = waves(along[None, :])
        one, two = (k for k in range(3) if k != axis)
        slab[one] = waves(np.array([[a]]))
        slab[two] = waves(second[:, None])
        yield a, second, formula(name, *slab)


def below(f, t):
    """Part of each line with f <= t, by linear interpolation."""
    a, b = f[:, :-1], f[:, 1:]
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.clip((t - low) / np.maximum(high - low, 1e-300), 0, 1).mean()


def area(name, n, samples):
    """Area of f = 0 per cell."""
    total, step = 0.0, 1e-6
    for axis in range(3):
        one, two = (k for k in range(3) if k != axis)
        for a, across, f in lines(name, axis, n, samples):
            row, col = np.nonzero((f[:, :-1] <= 0) != (f[:, 1:] <= 0))
            start, end = f[row, col], f[row, col + 1]
            point = [None, None, None]
            point[axis] = (col + start / (start - end)) / samples
            point[one], point[two] = np.full(len(row), a), across[row]
            gradient = []
            for k in range(3):
                ahead, behind = list(point), list(point)
                ahead[k], behind[k] = point[k] + step, point[k] - step
                gradient.append(formula(name, *map(waves, ahead)) - formula(name, *map(waves, behind)))
            gradient = np.array(gradient)
            total += (np.abs(gradient[axis]) / np.linalg.norm(gradient, axis=0)).sum() / n**2
    return total


def euler(name, n=90):
    """Euler number of f = 0 per cell, from the cubes of a periodic grid that is off the symmetry planes."""
    u = (np.arange(n) + 0.37) / n
    inside = formula(name, waves(u[:, None, None]), waves(u[None, :, None]), waves(u[None, None, :])) <= 0
    count = 0
    for axes in range(8):
        block = inside
        for axis in range(3):
            if axes >> axis & 1:
                block = block & np.roll(block, -1, axis)
        count += (-1) ** bin(axes).count("1") * int(block.sum())
    return 2 * count


def main():
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("cells", nargs="*", default=CELLS)
    options.add_argument("--lines", type=int, default=256)
    options.add_argument("--samples", type=int, default=768)
    a = options.parse_args()
    for name in a.cells:
        least, greatest = np.inf, -np.inf
        fractions = np.zeros(len(LEVELS[name]))
        for _, _, f in lines(name, 2, a.lines, a.samples):
            least, greatest = min(least, f.min()), max(greatest, f.max())
            fractions += [below(f, t) / a.lines for t in LEVELS[name]]
        print(f"[{name}]")
        print(f"range = [{least:.5f}, {greatest:.5f}]")
        print(f"euler = {euler(name)}")
        print(f"area = {area(name, a.lines // 2, a.samples // 2):.5f}")
        print(
            "lower = [" + ", ".join(f"[{t}, {v:.6f}]" for t, v in zip(LEVELS[name], fractions, strict=True)) + "]\n",
            flush=True,
        )


if __name__ == "__main__":
    main()
