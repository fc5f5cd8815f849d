"""Several solids of one design: the wall of a sheet and the spaces adjacent to it. Their names, their files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from . import _core
from .base.files import check_place, extension, whole_file
from .base.formats import MESH_WRITES
from .base.machine import file_size, fits
from .errors import IslandsWarning, warn_caller

__all__ = ["PARTS", "check_parts", "part_files", "warn_pieces", "write_parts"]

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .mesh import Mesh
    from .reports import IslandsReport

#: What the design makes, and what is left of the region on each side of the mid-surface.
PARTS = ("wall", "lower", "upper")


def check_parts(names: Sequence[str]) -> list[str]:
    """The names of parts as a list; unknown ones, repeated ones and none at all are refused."""
    found = [names] if isinstance(names, str) else list(names)
    if not found or len(set(found)) < len(found) or any(name not in PARTS for name in found):
        raise ValueError(f"parts are {', '.join(map(repr, found))}; name one or more of {', '.join(PARTS)}, each once")
    return found


def warn_pieces(name: str, islands: IslandsReport, words: str) -> None:
    """Warns of a part in several pieces."""
    if islands.found:
        message = f"{name} is not in one piece: {words}; all are kept, since a dropped one would leave a gap between the parts"
        warn_caller(message, kind=IslandsWarning)


def part_files(path: str | os.PathLike[str], names: Sequence[str]) -> dict[str, str]:
    """The file of each part: all in ``path`` if it is a .3mf, else ``OUT-wall.stl`` for ``OUT.stl`` and so on."""
    kind = extension(path, MESH_WRITES)
    stem, suffix = os.path.splitext(os.fsdecode(path))
    return {name: os.fsdecode(path) if kind == "3mf" else f"{stem}-{name}{suffix}" for name in names}


def write_parts(path: str | os.PathLike[str], parts: Mapping[str, Mesh]) -> dict[str, str]:
    """Writes meshes by name, as ``Solid.parts`` gives them: into one .3mf as an object each, with its name; in any other format
    into a file each, ``OUT-wall.stl`` and so on. Gives the file of each.

    Raises OSError if a file cannot be written, ValueError for an unknown format, no mesh or no room.
    """
    from .mesh import Mesh

    if not isinstance(parts, Mapping) or any(not isinstance(mesh, Mesh) for mesh in parts.values()):
        raise TypeError(f"parts must be meshes by name, {{name: Mesh}}, found {parts!r:.80}")
    if not parts:
        raise ValueError("there is no mesh to write")
    files = part_files(path, list(parts))
    for name in files.values():
        check_place(name)
    if extension(path, MESH_WRITES) != "3mf":
        for name, mesh in parts.items():
            mesh.write(files[name])
        return files
    vertices, triangles = (sum(of) for of in zip(*(mesh._core.counts for mesh in parts.values()), strict=True))
    fits(file_size("3mf", triangles, vertices), f"{triangles:.3g} triangles", path)
    with whole_file(path) as temporary:
        _core.Mesh.write_objects(temporary, [(name, mesh._core) for name, mesh in parts.items()], "Lattice part")
    return files
