"""Fill the hip stem with a gyroid that is dense at the surface and open in the core; write it; print what it is."""

from pathlib import Path

import numpy as np
import trabecula as lt

stem = lt.region.mesh(Path(__file__).parent / "parts" / "hip_stem.stl")  # a closed surface, mm
dense_rim = lt.grade.depth({0: 0.60, 4: 0.25})  # solid fraction by depth below the surface

core = lt.Lattice(
    cell=lt.cell.gyroid(),
    part="sheet",
    map=lt.map.affine(wavelength=5.0),
    level=lt.level.fraction(dense_rim),
)
solid = lt.Design(region=stem, lattice={"core": core}).build()  # the last line that can raise
mesh = solid.mesh(edge=0.5)

print(f"volume {mesh.volume:.1f} mm3, area {mesh.area:.1f} mm2, Euler number {mesh.euler}, pieces {mesh.pieces}")
print("field at two points:", solid.field(np.array([[0.0, 0.0, 40.0], [0.0, 0.0, 200.0]])))
assert mesh.closed
mesh.write("hip_stem.3mf")
