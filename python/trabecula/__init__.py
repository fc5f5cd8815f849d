"""Trabecula: lattice design. A region and a lattice make a solid; a lattice is a cell seen through a map, cut by a part
at a level.

>>> import trabecula as lt
>>> core = lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.3))
>>> design = lt.Design(region=lt.region.box(size=[20, 20, 20]), lattice={"core": core})
>>> mesh = design.build().mesh(edge=0.25)
>>> mesh.closed
True

Lengths are mm, angles degrees; negative is solid; arrays are (n, 3).
"""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    from . import beams, blend, cell, grade, level, map, region, reports
    from .carrier import Carrier
    from .design import Beams, Design, Lattice, load, skin, spartan
    from .errors import DesignError, DesignWarning
    from .finite_elements import VolumeSet
    from .laws import Law, law
    from .layers import Layer, Layers
    from .levels import fraction, iso
    from .mesh import Mesh
    from .parts import write_parts
    from .pictures.viewer import View, view
    from .quadors import Quadors, Slice
    from .solid import Solid
    from .sweeps.table import objective, sweep
    from .tets import TetMesh
    from .thickness import Thickness
    from .transition import Transitions
    from .volumes import BeamMesh, ShellMesh, VolumeMesh, VoxelElements
    from .voxels import Voxels

__all__ = [
    "BeamMesh",
    "Beams",
    "Carrier",
    "Design",
    "DesignError",
    "DesignWarning",
    "Lattice",
    "Law",
    "Layer",
    "Layers",
    "Mesh",
    "Quadors",
    "ShellMesh",
    "Slice",
    "Solid",
    "TetMesh",
    "Thickness",
    "Transitions",
    "View",
    "VolumeMesh",
    "VolumeSet",
    "VoxelElements",
    "Voxels",
    "__version__",
    "beams",
    "blend",
    "cell",
    "fraction",
    "grade",
    "iso",
    "law",
    "level",
    "load",
    "map",
    "objective",
    "region",
    "reports",
    "skin",
    "spartan",
    "sweep",
    "view",
    "write_parts",
]

# Names are fetched on first use, so that the command's help does not wait for numpy.
_HOMES = {
    "Beams": "design",
    "Design": "design",
    "Lattice": "design",
    "load": "design",
    "skin": "design",
    "DesignError": "errors",
    "DesignWarning": "errors",
    "Law": "laws",
    "law": "laws",
    "Layer": "layers",
    "Layers": "layers",
    "Mesh": "mesh",
    "Quadors": "quadors",
    "Slice": "quadors",
    "Solid": "solid",
    "TetMesh": "tets",
    "Thickness": "thickness",
    "Transitions": "transition",
    "Carrier": "carrier",
    "VolumeMesh": "volumes",
    "BeamMesh": "volumes",
    "ShellMesh": "volumes",
    "VoxelElements": "volumes",
    "VolumeSet": "finite_elements",
    "Voxels": "voxels",
    "objective": "sweeps.table",
    "spartan": "design",
    "sweep": "sweeps.table",
    "View": "pictures.viewer",
    "view": "pictures.viewer",
    "write_parts": "parts",
    "iso": "levels",
    "fraction": "levels",
    "__version__": "_core",
}
_MODULES = ("beams", "blend", "cell", "grade", "level", "map", "region", "reports")


def __getattr__(name: str) -> Any:
    import importlib

    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    if name in _HOMES:
        value = getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module {__name__} has no attribute {name}")


def __dir__() -> list[str]:
    return sorted(__all__)
