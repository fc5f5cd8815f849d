# Made by scripts/builders.py from schema/design.json; do not edit.
"""Words of a design, as types."""

from typing import Literal

__all__ = ["BeamName", "CellName", "Component", "Dangling", "Fit", "Of", "PartName", "Side", "TetName", "Trim", "Unit"]

BeamName = Literal[
    "sc",
    "bcc",
    "bccz",
    "sc_bcc",
    "fcc",
    "fccz",
    "fbcc",
    "fbccz",
    "octet",
    "octahedra",
    "diamond",
    "kelvin",
    "rhombic_dodecahedron",
    "weaire_phelan",
    "truncated_cube",
    "rhombicuboctahedron",
    "truncated_cuboctahedron",
    "pyrochlore",
    "gyroid_graph",
    "tesseract",
    "re_entrant",
    "hexagonal_prism",
    "triangular_prism",
]
CellName = Literal[
    "gyroid",
    "gyroid_mirrored",
    "diamond",
    "primitive",
    "iwp",
    "neovius",
    "frd",
    "fischer_koch_s",
    "lidinoid",
    "split_p",
]
Component = Literal["re", "im"]
Dangling = Literal["keep", "drop"]
Fit = Literal["table", "spartan"]
Of = Literal["cell", "part"]
PartName = Literal["sheet", "lower", "upper"]
Side = Literal["-x", "+x", "-y", "+y", "-z", "+z"]
TetName = Literal[
    "primitive",
    "primitive_sheet",
    "neovius_sheet",
    "diamond",
    "diamond_sheet",
    "diamond_triple",
    "diamond_cage",
    "iwp",
    "i43m",
    "i43m_sheet",
    "p43m",
    "p43m_sheet",
    "f43m",
    "f43m_sheet",
    "pn3m",
    "pn3m_dual",
    "pn3m_sheet",
    "frd",
    "fm3m",
    "fm3m_sheet",
]
Trim = Literal["cut", "drop", "snap"]
Unit = Literal["mm", "micron", "cm", "m", "inch", "foot"]
