"""Tetrahedral meshers from other packages, each in a process of its own: it may hang, and it may take the process along."""

from __future__ import annotations

import os
import sys
import tempfile
from typing import TYPE_CHECKING

from . import children

if TYPE_CHECKING:
    from typing import Any

__all__ = ["tetrahedra"]

#: What the child does: surface and edge in, nodes and tetrahedra out. Its folder holds both files.
CHILD = """
import sys, numpy as np
import pytetwild
given = np.load(sys.argv[1])
made = pytetwild.tetrahedralize(
    given["points"], given["triangles"], edge_length_abs=float(given["edge"]), optimize=True, simplify=True,
    epsilon=float(given["epsilon"]), vtk_ordering=True, quiet=True, num_threads=2,
)
np.savez(sys.argv[2], nodes=np.asarray(made[0], dtype=np.float64), tets=np.asarray(made[1], dtype=np.uint32))
"""


def tetrahedra(name: str, points: Any, triangles: Any, size: float, limit: float) -> tuple[Any, Any]:
    """Nodes (n, 3) and tetrahedra (m, 4) that fTetWild makes of a surface, which may be a soup of triangles.

    ``size`` is the edge (mm) of a tetrahedron, ``limit`` the seconds that it may take. Raises ValueError with one sentence
    for whatever goes wrong.
    """
    import numpy as np

    assert name == "ftetwild", name
    missing = installed()
    if missing:
        raise ValueError(
            f"the mesher ftetwild needs {missing}, not installed here: pip install 'trabecula[tets]', or use "
            'mesher = "background", which takes any region'
        )
    with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
        given, made = os.path.join(folder, "given.npz"), os.path.join(folder, "made.npz")
        # The envelope in which the surface is kept: a twentieth of the edge, as a share of the diagonal.
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        np.savez(given, points=points, triangles=triangles, edge=size, epsilon=min(1e-3, 0.05 * size / diagonal))
        outcome = children.run([sys.executable, "-c", CHILD, given, made], folder, limit)
        if outcome is not None:
            raise ValueError(
                f'the mesher ftetwild {outcome}; try a greater size, repair the surface, or use mesher = "background"'
            )
        with np.load(made) as found:
            nodes, tets = found["nodes"], found["tets"]
    if len(tets) == 0:
        raise ValueError("the mesher ftetwild found no inside: is the surface closed, in the main?")
    return nodes, mended(nodes, tets)


def installed() -> str | None:
    """What is missing of the mesher's packages."""
    from importlib.util import find_spec

    missing = [p for p in ("pytetwild", "pyvista") if find_spec(p) is None]
    return " and ".join(missing) or None


def mended(nodes: Any, tets: Any) -> Any:
    """The tetrahedra with positive volume: those numbered the other way round are turned."""
    a, b, c, d = (nodes[tets[:, i]] for i in range(4))
    import numpy as np

    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    turned = tets.copy()
    turned[negative, 2], turned[negative, 3] = tets[negative, 3], tets[negative, 2]
    return turned
