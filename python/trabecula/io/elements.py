"""Finite-element files that the core does not read itself: through meshio, in the extra ``fe``."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..base.formats import MESHIO_READS, MESHIO_WRITES, TET_READS, dotted, kind_of
from ..errors import warn_caller
from . import children

if TYPE_CHECKING:
    from types import ModuleType

    import meshio
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["read", "write"]

#: VTK's numbers of the cell types that are volumes, by meshio's names.
VOLUMES = {
    "tetra": 10,
    "tetra10": 24,
    "hexahedron": 12,
    "hexahedron20": 25,
    "hexahedron27": 29,
    "wedge": 13,
    "wedge15": 26,
    "pyramid": 14,
    "pyramid13": 27,
}

#: Names under which programs keep the zones of cells.
ZONES = ("zone", "gmsh:physical", "medit:ref", "cell_tags", "MaterialIds", "material", "zones")


#: A name that is the number of a zone.
NUMBER = re.compile(r"ZONE_(-?\d{1,9})")
#: What names in files must not have, and what would make a name that is none a number.
UNFIT = re.compile(r"[^ -~]|[\"'\\,=/*]|(?<=^ZONE)_(?=-?\d{1,9}$)")

#: Formats that are HDF5 inside, which meshio reads and writes by another package.
HDF5 = ("med", "cgns")


#: The number of a zone and one of its names.
Named = tuple[int, str]

#: Bytes of memory that reading takes at most: of the interpreter with its packages, and for each byte of the file. A digit
#: of a text may become a list's number of 32 bytes and its place in the list, twice over while lists grow.
BASE, PER_BYTE = 3e9, 100.0


#: Where what is read is kept as well.
kept: list[NDArray] | None = None


def needed(kind: str = "") -> ModuleType:
    """The package meshio; one clear error if it, or what it needs for files of this ``kind``, is missing."""
    try:
        import meshio
    except ImportError:
        raise ValueError(
            "files of this format are read and written by meshio, which is not installed: pip install 'trabecula[fe]' "
            "(vtu needs nothing more)"
        ) from None
    if kind in HDF5:
        try:
            import h5py  # noqa: F401
        except ImportError:
            raise ValueError(f".{kind} files need h5py beside meshio, which is not installed: pip install h5py") from None
    return meshio


def read(
    path: str | os.PathLike[str], limit: float | None = None
) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray, list[Named]]:
    """Points (n, 3), the points of all volume cells one after the other, where each ends, its kind (VTK's number), its zone (a
    number), and the names of zones as pairs (number, name).

    Read in a process of its own, of at most ``limit`` seconds (20 and 2 for each MB, unless given) and of bounded memory:
    damaged files make readers hang. Raises ValueError for what cannot be read.
    """
    name = os.path.abspath(os.fsdecode(path))
    kind = kind_of(name)
    if kind not in MESHIO_READS:
        raise ValueError(f"{name}: the name must end in {dotted(TET_READS)}; found .{kind or ' none'}")
    if not os.path.isfile(name):
        raise ValueError(f"{name} does not exist" if not os.path.exists(name) else f"{name} is no file")
    needed(kind)
    found = arrays_of(name, limit)
    points, connectivity, ends, kinds, zones, named, names, _ = found
    if kept is not None:
        kept[:] = found
    return points, connectivity, ends, kinds, zones, list(zip(named.tolist(), names.tolist(), strict=True))


@contextlib.contextmanager
def keeping() -> Iterator[list[NDArray]]:
    """A list in which are, once a file has been read within, the ``arrays_of`` it, of which the core took the corners."""
    global kept
    found: list[NDArray] = []
    kept = found
    try:
        yield found
    finally:
        kept = None


def arrays_of(path: str, limit: float | None = None) -> list[NDArray]:
    """What ``read`` gives of a file that is there, numbers and names of zones apart, and the sets as text."""
    name = os.path.abspath(path)
    size = os.path.getsize(name)
    seconds = 20 + 2e-6 * size if limit is None else limit
    return children.arrays("elements", [name], name, "meshio", BASE + PER_BYTE * size, seconds)


def child(name: str, made: str, memory: str) -> None:
    """Reads a file within ``memory`` bytes and writes its arrays; what is wrong with it is the last line of the words."""
    import io

    children.bound(float(memory))
    import meshio
    import numpy as np

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):  # it talks, and leaves with sys.exit
            kind = kind_of(name)
            mesh = meshio.read(with_all_nodes(name) if kind == "inp" else name, "gmsh" if kind == "msh2" else None)
        arrays = volumes(mesh)
        # As text, since each set has other figures.
        arrays += (np.array(json.dumps(sets_of(mesh, name, kind))),)
    except MemoryError:
        sys.exit(f"it takes more than {float(memory) / 1e9:.1f} GB of memory")
    except NoVolume as error:
        sys.exit(str(error))
    except meshio.ReadError as error:
        sys.exit(without_contents(str(error)) or "no such format")
    except (Exception, SystemExit) as error:
        # What else goes wrong quotes the file, which may be another than was meant.
        sys.exit(f"meshio finds no mesh in it ({type(error).__name__}); is it damaged?")
    np.savez(made, *arrays)


def sets_of(mesh: meshio.Mesh, name: str, kind: str) -> dict[str, dict[str, int]]:
    """The named sets of the file; none where they are not as expected, since the mesh is there."""
    from .file_sets import of_mesh

    try:
        return of_mesh(mesh, name, kind)
    except (ValueError, LookupError, MemoryError):
        return {}


def with_all_nodes(name: str) -> str:
    """An Abaqus file, or in the working folder a copy of it with all nodes in the first block: of several meshio keeps the
    last alone. Reference nodes often have a block of their own. Of two nodes of one number the first counts.
    """

    def keyword(line: str) -> str:
        return line.partition(",")[0].strip().upper() if line.startswith("*") and not line.startswith("**") else ""

    with open(name, encoding="utf-8", errors="replace") as file:
        words = [word for word in map(keyword, file) if word in ("*NODE", "*INCLUDE")]
    # Included files are found from the file's own folder.
    if words.count("*NODE") < 2 or "*INCLUDE" in words:
        return name
    nodes: dict[int, str] = {}
    before: list[str] = []
    rest: list[str] = []
    with open(name, encoding="utf-8", errors="replace") as file:
        within, twice = False, False
        for line in file:
            word = keyword(line)
            if line.startswith("*"):
                within = word == "*NODE"
                if word == "*ELEMENT" and twice:
                    raise NoVolume("its parts have nodes of the same numbers; write one part, or the mesh without parts")
                if not within or not nodes:
                    (rest if nodes else before).append(line)
            elif not within:
                (rest if nodes else before).append(line)
            elif line.strip():
                number = int(line.partition(",")[0])
                twice = twice or number in nodes
                nodes.setdefault(number, line if line.endswith("\n") else line + "\n")
    with open("gathered.inp", "w", encoding="utf-8") as file:
        for lines in (before, nodes.values(), rest):
            file.writelines(lines)
    return os.path.abspath("gathered.inp")


def without_contents(text: str) -> str:
    """The first 80 characters of a message, without what it quotes of a file: it may be another file than was meant."""
    line = " ".join(text.split())
    line = re.sub(r"""(["'`])(?!\*?\$?\w{1,16}\1).*?\1""", "...", line)
    return line if len(line) <= 80 else line[:77] + "..."


class NoVolume(ValueError):
    """A mesh without cells of three dimensions."""


def volumes(mesh: meshio.Mesh) -> tuple[NDArray, ...]:
    """The volume cells of a mesh, as ``read`` gives them; the numbers and the names of zones apart."""
    import numpy as np

    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise NoVolume(f"its points have {points.shape[-1]} coordinates; three are needed")
    cells, ends, kinds, blocks = [], [], [], []
    for i, block in enumerate(mesh.cells):
        number = VOLUMES.get(block.type)
        if number is None:
            continue
        blocks.append(i)
        data = np.asarray(block.data)
        cells.append(data.reshape(-1).astype(np.uint32))
        ends.append(np.full(len(data), data.shape[1], dtype=np.uint64))
        kinds.append(np.full(len(data), number, dtype=np.uint8))
    if not cells:
        held = ", ".join(sorted({block.type for block in mesh.cells})) or "nothing"
        raise NoVolume(f"it holds no volume (but {held:.60}); tetrahedra are needed")
    flat = np.concatenate(cells), np.cumsum(np.concatenate(ends), dtype=np.uint64), np.concatenate(kinds)
    zones, names = numbered(*zones_of(mesh, blocks))
    named = np.array([number for number, _ in names], dtype=np.int64)
    return np.ascontiguousarray(points), *flat, zones, named, np.array([name for _, name in names], dtype=np.str_)


def zones_of(mesh: meshio.Mesh, blocks: list[int]) -> tuple[NDArray, list[Named]]:
    """The zone of each cell of these blocks, a number, or none, and the names of zones as pairs (number, name).

    Numbers are the file's own. Where it has sets of elements, cells of equal number in different sets get numbers of their
    own, and so do cells of sets alone, from 1; what is in no set is then 0.
    """
    import numpy as np

    key = next((z for z in ZONES if len(mesh.cell_data.get(z, ())) == len(mesh.cells)), None)
    count = sum(len(mesh.cells[i].data) for i in blocks)
    zones = np.zeros(0, dtype=np.int64)
    if key is not None:
        zones = np.concatenate([np.asarray(mesh.cell_data[key][i]).reshape(-1) for i in blocks]).astype(np.int64)
    # Families of MED; physical groups of Gmsh, by number and dimension, unless they are sets too.
    families = getattr(mesh, "cell_tags", None) if key == "cell_tags" else None
    names = [(int(number), str(name)) for number, of in (families or {}).items() for name in of]
    sets = {name: flags for name in mesh.cell_sets if (flags := members(mesh, name, blocks)).any()}
    if key == "gmsh:physical":
        groups = {name: v for name, v in mesh.field_data.items() if name not in sets and np.shape(v) == (2,) and v[1] == 3}
        names += [(int(v[0]), name) for name, v in groups.items()]
    if not sets:
        return zones, names
    base = zones if len(zones) else np.zeros(count, dtype=np.int64)
    # The kinds of cells: number, and for each set whether they are outside; set by set, in the order of these columns.
    first, which = np.unique(base, return_inverse=True)
    kinds = first[:, None]
    for flags in sets.values():
        both, which = np.unique(2 * which.reshape(-1) + ~flags, return_inverse=True)
        kinds = np.column_stack([kinds[both // 2], both % 2])
    own_names, numbers, fresh = list(names), [], max(0, int(base.max()))
    for kind in kinds.tolist():
        own = kind[0]
        if (own in numbers) if len(zones) else (0 in kind[1:]):
            fresh += 1
            numbers.append(fresh)
        else:
            numbers.append(own)
        if len(zones):
            names += [(numbers[-1], name) for number, name in own_names if number == own != numbers[-1]]
            names += [(n, str(own)) for n in {own, numbers[-1]} if own != numbers[-1] and (n, str(own)) not in names]
        names += [(numbers[-1], name) for name, out in zip(sets, kind[1:], strict=True) if not out]
    return np.array(numbers, dtype=np.int64)[which.reshape(-1)], names


def members(mesh: meshio.Mesh, name: str, blocks: list[int]) -> NDArray:
    """Which cells of these blocks are in a set; none, where the reader left something else than indices."""
    import numpy as np

    of = mesh.cell_sets[name]
    parts = []
    for i in blocks:
        flags = np.zeros(len(mesh.cells[i].data), dtype=bool)
        with contextlib.suppress(ValueError, TypeError):
            # Sets that a file has before its last elements are shorter; Gmsh's bounding entities are no cells.
            chosen = np.asarray(of[i] if i < len(of) and not name.startswith("gmsh:") else [])
            if chosen.ndim == 1 and chosen.size and chosen.dtype.kind in "iu":
                flags[chosen[(chosen >= 0) & (chosen < len(flags))]] = True
        parts.append(flags)
    return np.concatenate(parts)


def numbered(zones: NDArray, names: list[Named]) -> tuple[NDArray, list[Named]]:
    """Zones with the numbers that ``write`` put into names, and the other names."""
    import numpy as np

    found = [(number, int(match[1])) for number, name in names if (match := NUMBER.fullmatch(name))]
    own = {number: number for number in np.unique(zones).tolist()} | dict(found)
    if not found or len(dict(found)) < len(found) or len(set(own.values())) < len(own):
        return zones, names
    rest = [(own[number], name) for number, name in names if not NUMBER.fullmatch(name)]
    return np.vectorize(own.get, otypes=[np.int64])(zones), rest


def kept_names(kind: str, names: list[Named]) -> list[Named]:
    """The names of zones as a file of this format has them; warns of those that are other than before, or left out."""
    plain = [(number, UNFIT.sub("-", name)[:80].strip()) for number, name in names]
    if kind == "msh":
        several = {name for number, name in plain if any(other == name and n != number for n, other in plain)}
        plain = [(number, name) for number, name in plain if name not in several]
    elif kind in ("mesh", "vtu"):
        plain = []
    lost = sorted({name for _, name in names} - {name for _, name in plain})
    if lost:
        warn_caller(
            f"a .{kind} cannot hold {'the name' if len(lost) == 1 else 'the names'} {', '.join(lost):.300} of zones as "
            f"{'it is' if len(lost) == 1 else 'they are'}; numbers are kept",
        )
    return plain


def write(
    path: str, kind: str, nodes: NDArray[np.float64], tets: NDArray[np.uint32], zones: NDArray[np.int64], names: list[Named]
) -> None:
    """Writes tetrahedra as a file of the format that ``kind`` (an extension) names, with their zones and those ``names`` of
    zones that it can hold (``kept_names``).
    """
    meshio = needed(kind)
    import numpy as np

    form = MESHIO_WRITES[kind]
    mesh = meshio.Mesh(nodes, [("tetra", tets.astype(np.int64))])
    numbers = [int(number) for number in np.unique(zones)]
    if form == "gmsh":
        whole = zones.astype(np.int32) if len(zones) else np.zeros(len(tets), dtype=np.int32)
        mesh.cell_data = {"gmsh:physical": [whole], "gmsh:geometrical": [whole]}
        mesh.field_data = {name: np.array([number, 3]) for number, name in names}
    elif form == "medit" and len(zones):
        mesh.cell_data = {"medit:ref": [zones.astype(np.int32)]}
    elif form == "abaqus":
        of = {f"ZONE_{number}": [number] for number in numbers}
        for number, name in names:
            of.setdefault(name, []).append(number)
        mesh.cell_sets = {name: [np.flatnonzero(np.isin(zones, own))] for name, own in of.items()}
    elif form == "med" and numbers:
        # Families of elements have numbers below 0.
        family = {n: n if n < 0 else min(0, numbers[0]) - 1 - n for n in numbers}
        mesh.cell_data = {"cell_tags": [np.vectorize(family.get)(zones)]}
        own = {number: [name for n, name in names if n == number] for number in numbers}
        mesh.cell_tags = {family[n]: of + [f"ZONE_{n}"] * (n >= 0 or not of) for n, of in own.items()}
    more = {"file_format": "gmsh22", "binary": True} if form == "gmsh" else {"file_format": form}
    if kind not in HDF5:
        meshio.write(path, mesh, **more)
        return
    # HDF5 locks its files, and would not open one that is locked already.
    with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
        made = os.path.join(folder, f"mesh.{kind}")
        meshio.write(made, mesh, **more)
        shutil.copyfile(made, path)


if __name__ == "__main__":
    child(*sys.argv[1:])
