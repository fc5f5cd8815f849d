"""The design that ``trabecula new`` writes."""

from __future__ import annotations

import math

__all__ = ["starter", "wavelength_for"]

HEAD = """\
{directive}# A lattice part. Lengths are mm, angles degrees.
#
#   trabecula check {file}
#   trabecula mesh {file} -o part.3mf
schema = 1
units  = "mm"
"""

BOX = """
# Where the part may be. Other regions: cylinder, sphere, mesh (a closed {meshes} file),
# union, intersection, difference, offset. For a part of your own: trabecula new --part part.stl
[region.box]
size = [20, 20, 20]         # about the origin, unless `center` says otherwise
"""

PART = """
# The part, {size} mm. `unit = "inch"` if the file's numbers are inches.
[region.mesh]
path = {path}
"""

LATTICE = """
[lattice.core]
cell = {cell:<21}# `trabecula cells` lists the others
part = "sheet"              # sheet |f| <= t, lower f <= t, upper f >= t

[lattice.core.map.affine]
wavelength = {wavelength:<15g}# the cell's edge; or three: [5, 5, 8]
# rotate = [0, 0, 45]       # turns the lattice about x, y, z
# offset = [0, 0, 0]        # moves it

# How much is solid: one of fraction, porosity, thickness, pore, iso, stiffness, permeability. Each may vary in space:
#   fraction = {{ linear = {{ along = [0, 0, 1], stops = [[-10, 0.20], [10, 0.45]] }} }}
#   fraction = {{ depth = {{ stops = [[0, 0.60], [4, 0.25]] }} }}
#   fraction = {{ formula = "0.3 + 0.1*sin(x/5)" }}
# Fraction and thickness together, and no wavelength: the wavelength is solved for.
[lattice.core.level]
fraction = 0.30             # of the cell; porosity = 0.70 says the same
"""

BEAMS = """
[beams.core]
cell   = {cell:<19}# `trabecula cells --beams` lists the others
radius = {radius:<19g}# of a beam at mid length, mm; may vary in space:
#   radius = {{ depth = {{ stops = [[0, {radius:g}], [4, {half:g}]] }} }}
fillet = "auto"             # the largest that fits; "none", or {{ radius = MM }}

[beams.core.map.affine]
wavelength = {wavelength:<15g}# the cell's edge
# rotate = [0, 0, 45]       # turns the lattice about x, y, z
"""

SKIN = """
[skin]
thickness = {skin:g}
# open = ["-z"]             # flat faces without skin, so that powder drains
"""

NO_SKIN = """
# A skin, if the part wants one:
#   [skin]
#   thickness = 1.0
#   open      = ["-z"]      # flat faces without skin, so that powder drains
"""

KEEP = """
# Regions that stay solid, such as bolt bosses:
#   [keep.boss.cylinder]
#   base = [0, 0, -10]
#   radius = 3
#   height = 20
"""

#: Cells through the thinnest extent of a part.
THROUGH = 4
#: Wavelength of beams / their radius.
SLENDERNESS = 12


def wavelength_for(size: list[float]) -> float:
    """A round wavelength (mm): about a quarter of the least extent of a part whose bounds measure ``size``, mm."""
    most = min(size) / THROUGH
    decade = 10.0 ** math.floor(math.log10(most))
    return max(step * decade for step in (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8) if step * decade <= most * (1 + 1e-9))


def starter(
    file: str,
    cell: str,
    beams: str | None = None,
    part: tuple[str, list[float]] | None = None,
    skin: float | None = None,
    meshes: str = "",
    schema: str | None = None,
) -> str:
    """The text of a design ``file``: a lattice of the named ``cell``, or beams of the catalogue's cell ``beams``; in a box of
    20 mm, or in ``part``: the path of its file, from the design's folder, and its size (mm); with a skin of ``skin`` mm.
    ``meshes`` names the formats of parts, ``schema`` the file of the JSON Schema for editors.
    """
    wavelength = wavelength_for(part[1]) if part else 5.0
    radius = float(f"{wavelength / SLENDERNESS:.1g}")
    texts = [HEAD, PART if part else BOX, BEAMS if beams else LATTICE, NO_SKIN if skin is None else SKIN, KEEP]
    path, size = (toml_string(part[0]), " × ".join(f"{v:.4g}" for v in part[1])) if part else ("", "")
    return "".join(texts).format(
        **{
            "directive": f"#:schema ./{schema}\n\n" if schema else "",
            "file": file,
            "cell": f'"{beams or cell}"',
            "meshes": meshes,
            "path": path,
            "size": size,
            "skin": skin,
        },
        **{"wavelength": wavelength, "radius": radius, "half": radius / 2},
    )


def toml_string(text: str) -> str:
    """A basic string of TOML; JSON's escapes are TOML's."""
    import json

    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
