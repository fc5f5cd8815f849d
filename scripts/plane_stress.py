"""Stresses of an L-bracket and a tee joint that are loaded in their plane, for the examples with covered singular lines.

Plane stress on bilinear squares of one material (E = 1, ν = 0.3), solved directly; the stress at a node is the mean of those in
the middles of the elements about it. Written to examples/results/ell_stress.csv and tee_stress.csv.
"""

from pathlib import Path

import numpy as np

RESULTS = Path(__file__).resolve().parent.parent / "examples" / "results"
POISSON, EDGE, DEPTH = 0.3, 2.0, 8.0

#: Stress 11, 22, 12 from strain 11, 22, 2·12.
ELASTICITY = np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, 0.5 - 0.5 * POISSON]]) / (1 - POISSON**2)
CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])


def strain(at):
    """Strain from the displacements (8) of the corners of the unit square at a point of it."""
    factor = np.where(CORNERS == 1, at, 1 - np.asarray(at))
    slope = (2 * CORNERS - 1) * factor[:, ::-1]
    out = np.zeros((3, 4, 2))
    out[0, :, 0], out[1, :, 1], out[2, :, 0], out[2, :, 1] = slope[:, 0], slope[:, 1], slope[:, 1], slope[:, 0]
    return out.reshape(3, 8)


def solved(boxes, held, loads):
    """Nodes (mm) of the union of boxes and the stress 11, 22, 12 there; ``held`` and ``loads`` choose nodes by position."""
    low = np.min([b[0] for b in boxes], axis=0)
    count = np.round((np.max([b[1] for b in boxes], axis=0) - low) / EDGE).astype(int)
    i, j = np.meshgrid(*(np.arange(n) for n in count), indexing="ij")
    cells = np.stack([i.ravel(), j.ravel()], axis=1)
    middles = low + (cells + 0.5) * EDGE
    cells = cells[np.any([np.all((middles > b[0]) & (middles < b[1]), axis=1) for b in map(np.asarray, boxes)], axis=0)]
    corners = cells[:, None, :] + CORNERS
    used, numbers = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    elements = numbers.reshape(-1, 4)
    nodes = low + used * EDGE
    gauss = (0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5)
    one = sum(strain((x, y)).T @ ELASTICITY @ strain((x, y)) for x in gauss for y in gauss) / 4
    freedoms = (2 * elements[:, :, None] + np.arange(2)).reshape(-1, 8)
    matrix = np.zeros((2 * len(nodes), 2 * len(nodes)))
    for of in freedoms:
        matrix[np.ix_(of, of)] += one
    force = np.zeros((len(nodes), 2))
    for place, load in loads:
        at = place(*nodes.T)
        force[at] += np.asarray(load, float) / at.sum()
    free = np.repeat(~held(*nodes.T), 2)
    moved = np.zeros(2 * len(nodes))
    moved[free] = np.linalg.solve(matrix[np.ix_(free, free)], force.ravel()[free])
    stress = moved[freedoms] @ strain((0.5, 0.5)).T @ ELASTICITY
    shares = np.bincount(elements.ravel(), minlength=len(nodes))
    at_nodes = [np.bincount(elements.ravel(), np.repeat(s, 4), len(nodes)) / shares for s in stress.T]
    return nodes, np.stack(at_nodes, axis=1)


def ell():
    """An L held at its upper end, pulled down at the end of its foot."""
    boxes = [((0, 0), (60, 20)), ((0, 0), (20, 60))]
    return solved(boxes, lambda x, y: y > 60 - 1e-9, [(lambda x, y: x > 60 - 1e-9, (0, -1))])


def tee():
    """A tee held at both ends of its flange, its web pulled down and to the side."""
    boxes = [((0, 40), (70, 60)), ((25, 0), (45, 60))]
    return solved(boxes, lambda x, y: (x < 1e-9) | (x > 70 - 1e-9), [(lambda x, y: y < 1e-9, (0.3, -1))])


def main():
    """Write the tables."""
    for name, (nodes, stress) in {"ell": ell(), "tee": tee()}.items():
        stress = stress / np.abs(stress).max()
        rows = ["x,y,z,s11,s22,s33,s23,s13,s12"]
        for z in (0.0, DEPTH):
            for (x, y), (a, b, c) in zip(nodes, stress, strict=True):
                rows.append(f"{x:g},{y:g},{z:g},{a:.4g},{b:.4g},0,0,0,{c:.4g}")
        (RESULTS / f"{name}_stress.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
