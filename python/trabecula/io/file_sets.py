"""Named sets in files of volume meshes: how many nodes, elements and faces of each a file has."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from . import gmsh

if TYPE_CHECKING:
    import meshio
    import numpy as np
    from numpy.typing import NDArray

    #: By name, and by what is counted: nodes, elements, faces.
    Sets = dict[str, dict[str, int]]

__all__ = ["of_mesh", "of_vtu"]

#: Bytes in which the header of a VTU stands.
HEADER = 1 << 20


def of_mesh(mesh: meshio.Mesh, path: str, kind: str) -> Sets:
    """The sets of a file of this kind that meshio has read, but element sets of Abaqus, which are zones."""
    import numpy as np

    if kind in ("msh", "msh2"):
        return gmsh.groups(path)
    if kind == "inp":
        return merged({name: {"nodes": len(of)} for name, of in mesh.point_sets.items()}, surfaces(path))
    if kind == "bdf":
        return nastran(mesh, path)
    if kind == "mesh":
        return medit(mesh, path)
    domains = {int(number): name for name, (number, _) in mesh.field_data.items()}
    nodes = flagged(mesh.point_data)
    own = flagged({name: np.concatenate(mesh.cell_data[name]) for name in nodes if name in mesh.cell_data}, "elements")
    return merged(referenced(mesh, "domain", 3, domains, "elements"), nodes, own)


def merged(first: Sets, *others: Sets) -> Sets:
    """What all of these have of each name."""
    found = {name: dict(of) for name, of in first.items()}
    for other in others:
        for name, of in other.items():
            found.setdefault(name, {}).update(of)
    return found


def flagged(arrays: dict[str, NDArray], what: str = "nodes") -> Sets:
    """Arrays that are 1 in a set and 0 elsewhere."""
    flags = {name: v for name, v in arrays.items() if v.ndim == 1 and v.dtype == "u1" and v.any() and v.max() == 1}
    return {name: {what: int(values.sum())} for name, values in flags.items()}


def lines(path: str) -> Iterator[str]:
    with open(path, encoding="utf-8", errors="replace") as file:
        yield from file


def surfaces(path: str) -> Sets:
    """The surfaces of Abaqus whose faces are listed one by one."""
    found: dict[str, int] = {}
    name = None
    for line in lines(path):
        if line.startswith("*"):
            match = re.match(r"\*surface\b.*?\bname\s*=\s*\"?([^,\"\n]+)", line, re.IGNORECASE)
            name = match[1].strip() if match else None
        elif name is not None and re.match(r"\s*\d+\s*,\s*S\d", line, re.IGNORECASE):
            found[name] = found.get(name, 0) + 1
    return {name: {"faces": count} for name, count in found.items()}


def nastran(mesh: meshio.Mesh, path: str) -> Sets:
    """Domains and sets of nodes (SET1) as Trabecula writes them, each below a comment with its name."""
    domains: dict[int, str] = {}
    nodes: dict[str, int] = {}
    said, name = None, None
    for line in lines(path):
        if line.startswith("$"):
            said, name = re.fullmatch(r"\$ (domain|nodes of) (\S+)\s*", line), None
        elif said and said[1] == "domain" and line.startswith("PSOLID"):
            domains[int(line[8:16])], said = said[2], None
        elif said and said[1] == "nodes of" and line.startswith("SET1"):
            name, said = said[2], None
            nodes[name] = count(line[16:])
        elif name is not None and line[:1] in ("+", " "):
            nodes[name] += count(line[8:])
        else:
            said, name = None, None
    return merged(
        referenced(mesh, "nastran:ref", 3, domains, "elements"), {name: {"nodes": number} for name, number in nodes.items()}
    )


def count(fields: str) -> int:
    """How many numbers stand in the fields of a line of Nastran."""
    return sum(fields[at : at + 8].strip().isdigit() for at in range(0, min(len(fields), 64), 8))


def medit(mesh: meshio.Mesh, path: str) -> Sets:
    """Domains and sets of faces as Trabecula writes them, with the names of references in comments at the beginning."""
    with open(path, encoding="utf-8", errors="replace") as file:
        head = file.read(HEADER).partition("Dimension")[0]
    named: dict[str, dict[int, str]] = {"tetrahedra": {}, "triangles": {}}
    for what, number, name in re.findall(r"^# (tetrahedra|triangles) with reference (\d+): (\S+)$", head, re.MULTILINE):
        named[what][int(number)] = name
    domains = referenced(mesh, "medit:ref", 3, named["tetrahedra"], "elements")
    return merged(domains, referenced(mesh, "medit:ref", 2, named["triangles"], "faces"))


def referenced(mesh: meshio.Mesh, key: str, dimension: int, names: dict[int, str], what: str) -> Sets:
    """How many cells of this dimension have the number of each name."""
    import numpy as np

    own = [np.asarray(v) for v, block in zip(mesh.cell_data.get(key, ()), mesh.cells, strict=False) if block.dim == dimension]
    numbers, counts = np.unique(np.concatenate([*own, np.zeros(0, dtype=np.int64)]), return_counts=True)
    found = {names[number]: size for number, size in zip(numbers.tolist(), counts.tolist(), strict=True) if number in names}
    return {name: {what: size} for name, size in found.items()}


def of_vtu(path: str) -> Sets:
    """Domains and sets in a VTU whose arrays follow as they are, as Trabecula writes it; none of other files."""
    import numpy as np

    with open(path, "rb") as file:
        head, mark, _ = file.read(HEADER).partition(b'<AppendedData encoding="raw">')
        text = head.decode("utf-8", "replace")
        if not mark or 'header_type="UInt64"' not in text or "compressor" in text:
            return {}
        start = len(head) + len(mark)
        file.seek(start)
        start += file.read(64).find(b"_") + 1
        whole = os.fstat(file.fileno()).st_size

        def array(tag: str) -> NDArray[np.uint8]:
            match = re.search(r'offset="(\d+)"', tag)
            file.seek(min(start + int(match[1] if match else 0), whole))
            size = min(int.from_bytes(file.read(8), "little"), whole)
            return np.frombuffer(file.read(size), dtype=np.uint8)

        def bytes_of(part: str) -> dict[str, NDArray]:
            within = text.partition(f"<{part}>")[2].partition(f"</{part}>")[0]
            tags = re.findall(r'<DataArray type="UInt8" Name="([^"]*)" NumberOfComponents="1"([^>]*)>', within)
            return {name: array(tag) for name, tag in tags}

        cells = bytes_of("CellData")
        domain = cells.pop("domain", None)
        found = merged(flagged(bytes_of("PointData")), flagged(cells, "elements"))
        comment = re.search(r"<!-- domains, from 0: (.*?) -->", text)
    if comment is None or domain is None:
        return found
    names = dict(enumerate(comment[1].split(", ")))
    counts = np.bincount(domain, minlength=len(names)).tolist()
    return merged({name: {"elements": counts[number]} for number, name in names.items() if counts[number]}, found)
