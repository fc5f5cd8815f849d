#!/usr/bin/env python3
"""Stiffness of a cell of plain voxels by this package and by muGrid: processor time each, and how far apart they are.

    python bench/stiffness.py [--n 32,64] [--repeat 3] [--cell gyroid] [--part sheet] [--fraction 0.4]

Both take the same voxels, trilinear elements and conjugate gradients in one thread, to a relative residual of 1e-8; muGrid
(pip install muGrid) with its Green-Jacobi preconditioner. Runs are interleaved, and medians are printed with the least and
the greatest. Ours solves grids of n, n/2 and n/4 and finds the voxels itself; muGrid is given them, and its set-up counts.
"""

import argparse
import statistics
import time

import muGrid
import numpy as np
import trabecula as lt
from muGrid.Preconditioners import make_green_jacobi_preconditioner
from muGrid.Solvers import conjugate_gradients

PAIRS = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
E, NU, EDGE = 1.0, 0.3, 4.0


def by_mugrid(solid, E=E, nu=NU):
    """C, 6 x 6 in Voigt's order 11 22 33 23 13 12, of a cube of voxels (n, n, n), 1 where they are solid, of this E and nu."""
    n, world = len(solid), muGrid.Communicator()
    element, spacing = muGrid.FEMElement.q1, [1 / n] * 3
    operator = muGrid.IsotropicStiffnessOperator3D(spacing, element)
    grid = muGrid.FFTEngine([n] * 3, world, nb_ghosts_left=[1] * 3, nb_ghosts_right=[1] * 3)
    lame = [grid.real_space_field(name) for name in ("first", "second")]
    for field, of_solid in zip(lame, (E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))), strict=True):
        field.p[...] = of_solid * solid
        grid.communicate_ghosts(field)
    moved, load = (grid.real_space_field(name, (3,)) for name in ("moved", "load"))
    better = make_green_jacobi_preconditioner(grid, operator, *lame, 3, element=element, grid_spacing=spacing)

    def apply(x, y):
        grid.communicate_ghosts(x)
        operator.apply(x, *lame, y)

    c = np.empty((6, 6))
    for column, (i, j) in enumerate(PAIRS):
        strain = np.zeros((3, 3))
        strain[i, j] += 0.5
        strain[j, i] += 0.5
        operator.apply_macro_rhs(*lame, strain.ravel().tolist(), load)
        load.p[...] *= -1
        moved.p[...] = 0
        conjugate_gradients(world, grid.real_space_collection, load, moved, apply, better, rtol=1e-8)
        grid.communicate_ghosts(moved)
        stress = np.reshape(operator.average_stress(moved, *lame, strain.ravel().tolist()), (3, 3))
        c[:, column] = [stress[pair] for pair in PAIRS]
    return c


def timed(work):
    """Seconds of the processor, and the result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--n", default="32,64")
    ask.add_argument("--repeat", type=int, default=3)
    ask.add_argument("--cell", default="gyroid")
    ask.add_argument("--part", default="sheet")
    ask.add_argument("--fraction", type=float, default=0.4)
    asked = ask.parse_args()
    lattice = lt.Lattice(asked.cell, asked.part, lt.map.affine(EDGE), lt.level.fraction(asked.fraction))
    # Larger than the cell, whose faces would else be those of the region.
    cell = lt.Design(lt.region.box(min=[-EDGE] * 3, max=[2 * EDGE] * 3), lattice).build()
    print(f"trabecula {lt.__version__}, muGrid {muGrid.__version__}; {asked.cell} {asked.part} {asked.fraction:g}, s")
    for n in map(int, asked.n.split(",")):
        middles = (np.arange(n) + 0.5) / n * EDGE
        points = np.stack(np.meshgrid(middles, middles, middles, indexing="ij"), axis=-1).reshape(-1, 3)
        solid = (cell.field(points).reshape(n, n, n) <= 0).astype(float)
        taken = {"trabecula": [], "muGrid": []}
        for _ in range(asked.repeat):
            seconds, found = timed(lambda n=n: cell.stiffness(n=n, E=E, nu=NU, voxels=True, threads=1).C_n)
            taken["trabecula"].append(seconds)
            seconds, wanted = timed(lambda solid=solid: by_mugrid(solid))
            taken["muGrid"].append(seconds)
        apart = np.abs(np.array(found) - wanted).max() / np.abs(wanted).max()
        of = "; ".join(f"{k} {statistics.median(v):.2f} ({min(v):.2f} to {max(v):.2f})" for k, v in taken.items())
        print(f"n = {n}: {of}; C apart by {apart:.1e}", flush=True)


if __name__ == "__main__":
    main()
