"""The design that ``trabecula new`` writes."""

__all__ = ["STARTER"]

STARTER = """\
# A lattice part. Lengths are mm, angles degrees.
#
#   trabecula check {file}
#   trabecula mesh {file} -o part.3mf --edge 0.25
schema = 1
units  = "mm"

# Where the part may be. Other regions: cylinder, sphere, mesh (a closed {meshes} file),
# union, intersection, difference, offset. For a part of your own:
#   [region.mesh]
#   path = "part.stl"
[region.box]
size = [20, 20, 20]         # about the origin, unless `center` says otherwise

[lattice.core]
cell = "{cell}"             # `trabecula cells` lists the others
part = "sheet"              # sheet |f| <= t, lower f <= t, upper f >= t

[lattice.core.map.affine]
wavelength = 5.0            # the cell's edge; or three: [5, 5, 8]
# rotate = [0, 0, 45]       # turns the lattice about x, y, z
# offset = [0, 0, 0]        # moves it

# How much is solid: exactly one of iso, fraction, porosity, thickness. Each may vary in space:
#   fraction = {{ linear = {{ along = [0, 0, 1], stops = [[-10, 0.20], [10, 0.45]] }} }}
#   fraction = {{ depth = {{ stops = [[0, 0.60], [4, 0.25]] }} }}
#   fraction = {{ formula = "0.3 + 0.1*sin(x/5)" }}
[lattice.core.level]
fraction = 0.30             # of the cell; porosity = 0.70 says the same

# A skin and solid bosses, if the part wants them:
#   [skin]
#   thickness = 1.0
#   open      = ["-z"]      # flat faces without skin, so that powder drains
#   [keep.boss.cylinder]
#   base = [0, 0, -10]
#   radius = 3
#   height = 20
"""
