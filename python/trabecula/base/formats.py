"""File formats by the end of the name: what each command and method reads and writes. Meshes are the core's table."""

from __future__ import annotations

import os
from typing import NamedTuple

from .. import _core

__all__ = [
    *(
        "BEAMS",
        "BEAM_ELEMENT_WRITES",
        "BEAM_READS",
        "BEAM_WRITES",
        "CONDUCTIVITY_WRITES",
        "LAW_WRITES",
        "PERMEABILITY_WRITES",
        "STIFFNESS_READS",
        "STIFFNESS_WRITES",
    ),
    *("CAD_READS", "DESIGNS", "LAYERS", "LAYER_WRITES", "LayerRow", "MESHES", "MESHIO_READS", "MESHIO_WRITES", "MESH_READS"),
    *(
        "MESH_WRITES",
        "PART_READS",
        "RESULT_READS",
        "SHELL_WRITES",
        "TET_READS",
        "TET_WRITES",
        "STDIN",
        "STEP_WRITES",
        "SWEEP_WRITES",
        "VOLUME_READS",
        "VOLUME_WRITES",
        "VOXEL_ELEMENT_WRITES",
        "VOXEL_WRITES",
    ),
    *("dotted", "is_design", "kind_of"),
]

DESIGNS = ("toml", "json")
#: The name that stands for standard input.
STDIN = "-"
#: The mesh formats by suffix.
MESHES = {row.suffix: row for row in _core.mesh_formats()}
MESH_READS = tuple(MESHES)
#: Files of CAD systems, and all that holds a part.
CAD_READS = ("step", "stp", "iges", "igs")
PART_READS = (*MESH_READS, *CAD_READS)
MESH_WRITES = tuple(suffix for suffix, row in MESHES.items() if row.writes)
#: The exact surface of beams alone, for CAD systems.
STEP_WRITES = ("step", "stp")
#: Application protocols of STEP files, the usual one first.
STEP_PROTOCOLS = ("ap214", "ap242")
#: The formats of beams as such, not their surface, by suffix: what each is and whether it is written. 3MF is, by a writer of
#: its own.
BEAMS = {suffix: (title, writes or suffix == "3mf") for suffix, title, writes in _core.graph_formats()}
BEAM_READS = tuple(BEAMS)
BEAM_WRITES = tuple(suffix for suffix, row in BEAMS.items() if row[1])
#: What is found of a periodic cell: tables, the surface of Young's modulus, material cards.
STIFFNESS_READS = ("csv", "txt", "dat")
STIFFNESS_WRITES = ("csv", "png", "ply", "vtu", "inp", "bdf", "mac")
CONDUCTIVITY_WRITES = PERMEABILITY_WRITES = ("csv",)
#: What a cell does by its fraction: a table, all of it, plots.
LAW_WRITES = ("csv", "json", "svg")
#: Formats of tables.
SWEEP_WRITES = ("csv", "parquet")
VOXEL_WRITES = ("npy", "vti")


class LayerRow(NamedTuple):
    """A format of layers."""

    title: str
    #: Whether it holds pictures rather than contours.
    pictures: bool
    #: Whether all layers have one thickness.
    uniform: bool


#: The formats of layers by suffix.
LAYERS = {suffix: LayerRow(title, *has) for suffix, title, *has in _core.layer_formats()}
LAYER_WRITES = tuple(LAYERS)
#: The formats of volume meshes: suffix, what it is.
VOLUMES = {**dict(_core.volume_formats()), "xdmf": "XDMF with HDF5", "foam": "OpenFOAM, next to the folder constant/polyMesh"}
VOLUME_WRITES = tuple(VOLUMES)
#: The formats of beams, of shells, and of voxels as finite elements.
BEAM_ELEMENT_WRITES = tuple(suffix for suffix, _ in _core.beam_element_formats())
SHELL_WRITES = tuple(suffix for suffix, _ in _core.shell_formats())
VOXEL_ELEMENT_WRITES = (*dict(_core.voxel_element_formats()), "xdmf")
#: Those that are read back.
VOLUME_READS = ("inp", "msh", "msh2", "vtu", "xdmf", "bdf", "mesh")
#: Formats of tetrahedra that meshio reads and writes, by the names it has for those that are written.
MESHIO_WRITES = {"msh": "gmsh", "inp": "abaqus", "med": "med", "mesh": "medit"}
MESHIO_READS = (*MESHIO_WRITES, "msh2", "meshb", "bdf", "nas", "fem", "e", "exo", "xdmf", "cgns", "ugrid", "su2", "avs")
#: Formats of results: those of the core, and those that results.py reads.
RESULT_READS = ("vtu", "vtk", "vti", "frd", "med", "rmed", "e", "exo", "msh", "xdmf", "avs")
TET_READS = ("vtu", "vtk", "frd", *MESHIO_READS)
TET_WRITES = ("vtu", *MESHIO_WRITES)


def kind_of(path: str) -> str:
    """The suffix in small letters, without the dot."""
    return os.path.splitext(path)[1].lower().lstrip(".")


def is_design(name: str) -> bool:
    """Whether a name on the command line is that of a design."""
    return name == STDIN or kind_of(name) in DESIGNS


def dotted(suffixes: tuple[str, ...]) -> str:
    """Suffixes for a message: ".stl, .3mf, …"."""
    return ", ".join("." + s for s in suffixes)
