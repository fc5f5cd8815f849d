#!/usr/bin/env python3
"""Lattices of beams as CalculiX solves their B32R elements, beside frames of Timoshenko beams whose joints are points.

Writes docs/generated/beams_ccx.md. Needs ccx (apt-get install calculix-ccx). A minute.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trabecula as lt

PAGE = Path(__file__).resolve().parent.parent / "docs" / "generated" / "beams_ccx.md"
#: Young's modulus (MPa), the edge of the box (mm), that of its cells, and the load on its upper face (N).
E, SIZE, CELL, FORCE = 114000.0, 10.0, 5.0, (0.0, 0.0, -100.0)
#: Cells, radii (mm), Poisson's ratios and elements' greatest length (mm; four a beam where it is None).
ROWS = [
    *(("bcc", *row) for row in ((0.3, 0.34, None), (0.3, 0.0, None), (0.08, 0.34, None), (0.08, 0.34, 0.1))),
    *(("diamond", *row) for row in ((0.1, 0.34, None), (0.1, 0.0, None))),
    *(("kelvin", *row) for row in ((0.1, 0.34, None), (0.1, 0.0, None), (0.1, 0.34, 0.1))),
    *((cell, 0.1, 0.34, None) for cell in ("fcc", "octet")),
]
#: Shear correction of a circle, as in Timoshenko's theory with what the solver takes.
SHEAR = 0.9


def stiffness(d, r, nu):
    """The stiffness of a beam along d in world axes (12, 12): displacement and rotation of either end."""
    length = np.linalg.norm(d)
    x = d / length
    y = np.cross(x, np.eye(3)[np.abs(x).argmin()])
    y /= np.linalg.norm(y)
    area, inertia, shear = np.pi * r**2, np.pi * r**4 / 4, E / 2 / (1 + nu)
    # Flexibility of the far end for force and moment in local axes, the near end held; the near end by equilibrium.
    far = np.diag([length / E / area, 0, 0, length / shear / (2 * inertia), *[length / E / inertia] * 2])
    across = length**3 / 3 / E / inertia + length / SHEAR / shear / area
    far[1, 1] = far[2, 2] = across
    far[1, 5] = far[5, 1] = length**2 / 2 / E / inertia
    far[2, 4] = far[4, 2] = -far[1, 5]
    carried = np.eye(6)
    carried[4, 2], carried[5, 1] = -length, length
    both = np.vstack([-carried, np.eye(6)])
    turned = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
    return turned.T @ both @ np.linalg.inv(far) @ both.T @ turned


def frame(mesh, nu):
    """Half the work of the load on a frame of the mesh's elements, held at Z0, N mm."""
    count = len(mesh.nodes)
    whole, force = np.zeros((6 * count, 6 * count)), np.zeros((count, 6))
    for (a, b), r in zip(mesh.elements, mesh.radii, strict=True):
        at = [*range(6 * a, 6 * a + 6), *range(6 * b, 6 * b + 6)]
        whole[np.ix_(at, at)] += stiffness(mesh.nodes[b] - mesh.nodes[a], r, nu)
    nodes, forces = mesh.forces("Z1", FORCE)
    force[nodes, :3] = forces
    free = np.setdiff1d(np.arange(count), mesh.sets["Z0"].nodes)
    at = (6 * free[:, None] + np.arange(6)).ravel()
    moved = np.linalg.solve(whole[np.ix_(at, at)], force.ravel()[at])
    return 0.5 * moved @ force.ravel()[at]


def solved(mesh, nu):
    """What CalculiX prints: the reaction along z at Z0 (N) and the internal energy (N mm)."""
    with tempfile.TemporaryDirectory() as folder:
        mesh.write(Path(folder) / "a.inp", E=E, nu=nu, hold=["Z0"], load={"Z1": FORCE})
        done = subprocess.run(["ccx", "a"], cwd=folder, capture_output=True, text=True)
        if done.returncode or "ERROR" in done.stdout:
            sys.exit(done.stdout[-2000:])
        text = (Path(folder) / "a.dat").read_text(encoding="ascii")
    reaction = float(re.search(r"total force .*?\n\n(.*?)\n", text)[1].split()[2])
    return reaction, float(re.search(r"total internal energy .*?\n\n(.*?)\n", text)[1])


def main():
    """Writes the page."""
    lines = [
        "# Beams in CalculiX",
        "",
        f"Written by `scripts/beams_ccx.py`, which needs CalculiX: boxes of {SIZE:g} mm with cells of {CELL:g} mm, "
        f"held at Z0 and pressed at Z1 with {-FORCE[2]:g} N.",
        "The strain energy is that of the solver's B32R over that of a frame of Timoshenko's beams (shear correction "
        f"{SHEAR:g}) whose joints are points;",
        "less is stiffer. The reaction is the total that the solver prints for Z0.",
        "",
        "| cell | radius, mm | Poisson's ratio | elements | energy | reaction, N |",
        "|---|---|---|---|---|---|",
    ]
    for cell, radius, nu, edge in ROWS:
        beams = lt.Beams(cell=cell, radius=radius, map=lt.map.affine(wavelength=CELL))
        solid = lt.Design(region=lt.region.box(size=[SIZE] * 3), beams=beams).build()
        reaction, energy = solved(solid.beam_mesh(edge), nu)
        # One element a beam is exact.
        ratio = energy / frame(solid.beam_mesh(SIZE, order=1), nu)
        of = "four a beam" if edge is None else f"of {edge:g} mm"
        lines.append(f"| {cell} | {radius:g} | {nu:g} | {of} | {ratio:.3f} | {reaction:.1f} |")
        print(lines[-1], flush=True)
    PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
