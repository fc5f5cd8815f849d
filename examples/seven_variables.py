"""The seven variables of the SPARTAN note in one call, and the porosity that comes out."""

import trabecula as lt

design = lt.spartan(
    "diamond",
    wavelength=(6, 6, 6),
    rotate=(0, 0, 0),
    porosity=0.7,
    region=lt.region.box(size=[24, 24, 24]),
)
mesh = design.build().mesh(per_cell=32)
porosity = 1 - mesh.volume / 24**3

print(f"asked 0.7, realised {porosity:.5f}")
assert abs(porosity - 0.7) < 1e-4
