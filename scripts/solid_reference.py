#!/usr/bin/env python3
"""Reference numbers for corpus/designs, independent of the core: numpy and the formulas, written out once more here.

Volume and areas come from dense parallel lines, as in cell_reference.py; Euler number, pieces and cavities from the
cubes of a fine grid (scipy labels them). Where a number is known in closed form, corpus/solids.toml uses that.

    python scripts/solid_reference.py [--lines 300] [NAME ...]
"""

import argparse

import numpy as np
from corpus_solids import CLOSED, SOLIDS
from scipy import ndimage


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
    options.add_argument("names", nargs="*", default=[*SOLIDS, *CLOSED])
    options.add_argument("--lines", type=int, default=200)
    options.add_argument("--samples", type=int, default=400)
    options.add_argument("--grid", type=int, default=200)
    a = options.parse_args()
    for name in a.names:
        if name in CLOSED:
            numbers = zip(("volume", "area"), CLOSED[name](), strict=False)
            print(f"[{name}]", *(f"{key} = {value:.6f}" for key, value in numbers), "", sep="\n", flush=True)
            continue
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
