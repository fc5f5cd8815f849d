"""The stiffest gyroid sheet for a permeability: scipy's minimiser over the fraction and the cell's length along the flow.

A core carries load across x and lets a fluid through along z. A cell that is longer along z is more permeable there, so that it
may hold more material; but it is softer along x. The number of voxels along the cell for its stiffness may be given, as in
`python stiffest_gyroid.py 32`; for its permeability half as many are as sure. Each figure is printed with its estimated error.
"""

import sys
import time
from functools import cache

import numpy as np
import trabecula as lt
from scipy.optimize import minimize

N = int(sys.argv[1]) if len(sys.argv) > 1 else 64
LEAST = 0.04  # permeability along z, mm²

design = lt.Design(
    region=lt.region.box([4, 4, 4]),
    lattice={
        "core": lt.Lattice(
            cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=[4, 4, 4]), level=lt.level.fraction(0.3)
        )
    },
)
paths = ["lattice.core.level.fraction", "lattice.core.map.affine.wavelength[2]"]
figures = ["E1", "E1_error", "permeability33_mm2", "permeability_error"]
settings = {"stiffness": {"n": N}, "permeability": {"n": max(8, N // 2)}}
of = lt.objective(design, paths, figures, per_cell=8, properties=settings)


@cache
def found(fraction, length):
    """E along x relative to the solid's, permeability along z (mm²), and each with its relative error in words."""
    E, E_error, k, k_error = of({paths[0]: fraction, paths[1]: length}).values()
    return E, k, f"E {E:.4f} (± {100 * E_error:.1f} %) of the solid's along x, {k:.4f} mm² (± {100 * k_error:.1f} %) along z"


def at(x):
    """By logarithms, in which both figures are nearly straight."""
    return found(float(np.exp(x[0])), float(np.exp(x[1])))


start = time.perf_counter()
answer = minimize(
    lambda x: -np.log(at(x)[0]),
    np.log([0.2, 4.0]),
    method="COBYLA",  # takes no differences, which voxels would make rough
    bounds=np.log([(0.12, 0.45), (3.0, 9.0)]),
    constraints={"type": "ineq", "fun": lambda x: np.log(at(x)[1] / LEAST)},
    options={"rhobeg": 0.3, "tol": 0.01},
)
(fraction, length), (cubic_e, _, cubic_words), (e, k, words) = np.exp(answer.x), found(0.2, 4.0), at(answer.x)
print(f"cubic:     fraction 0.200, 4 x 4 x 4.00 mm: {cubic_words}")
print(f"stiffest:  fraction {fraction:.3f}, 4 x 4 x {length:.2f} mm: {words}")
print(f"{found.cache_info().misses} designs in {time.perf_counter() - start:.0f} s")
assert e > cubic_e and k > 0.98 * LEAST
