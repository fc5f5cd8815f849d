"""Results and physical groups in Gmsh's format 2.2 and 4.1, text or binary."""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import TYPE_CHECKING

from .results import Array, Mesh, Unreadable, selected

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import DTypeLike, NDArray

__all__ = ["groups", "read"]

#: Points of each type of element.
POINTS = {
    1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10, 12: 27, 13: 18, 14: 14, 15: 1, 16: 8, 17: 20, 18: 15,
    19: 13, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 26: 4, 27: 5, 28: 6, 29: 20, 30: 35, 31: 56, 92: 64, 93: 125,
}  # fmt: skip
#: VTK's number of the volume that a type is by its corners, which come first.
KINDS = {
    4: 10,
    11: 10,
    29: 10,
    30: 10,
    31: 10,
    5: 12,
    12: 12,
    17: 12,
    92: 12,
    93: 12,
    6: 13,
    13: 13,
    18: 13,
    7: 14,
    14: 14,
    19: 14,
}
#: Triangles and quadrilaterals.
FLAT = (2, 3, 9, 10, 16, 20, 21, 22, 23, 24, 25)


class Source:
    """The bytes of a file, taken number by number."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at, self.new, self.binary, self.wide = data, 0, True, False, "u8"

    def line(self) -> str:
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        text, self.at = self.data[self.at : end], end + 1
        return text.decode("latin-1").strip()

    def section(self, name: str) -> Numbers:
        """The numbers up to the section's end; of binary ones the end is known when they are read."""
        end = self.data.find(b"$End" + name.encode(), self.at)
        if end < 0:
            raise Unreadable(f"${name} has no end; was it cut off?")
        return Numbers(self, end)

    def skip(self, name: str) -> None:
        end = self.data.find(b"$End" + name.encode(), self.at)
        self.at = len(self.data) if end < 0 else end
        self.line()


class Numbers:
    """The numbers of a section."""

    def __init__(self, source: Source, end: int) -> None:
        import numpy as np

        self.source = source
        self.text = None
        if not source.binary:
            self.text, self.place = np.array(source.data[source.at : end].split(), dtype=np.float64), 0

    def take(self, count: int, kind: DTypeLike) -> NDArray:
        """The next numbers, of this type where they are binary."""
        import numpy as np

        if self.text is not None:
            found = self.text[self.place : self.place + count]
            self.place += count
        else:
            found = np.frombuffer(self.source.data, dtype=kind, count=count, offset=self.source.at)
            self.source.at += found.nbytes
        if len(found) != count:
            raise Unreadable("it ends early; was it cut off?")
        return found

    def rows(self, count: int, columns: list[tuple[str, int]]) -> list[NDArray]:
        """Rows of several columns, by type and number of columns."""
        import numpy as np

        if self.text is not None:
            table = self.take(count * sum(n for _, n in columns), "").reshape(count, -1)
            return np.split(table, np.cumsum([n for _, n in columns])[:-1], axis=1)
        table = self.take(count, np.dtype([(f"c{i}", kind, (n,)) for i, (kind, n) in enumerate(columns)]))
        return [table[f"c{i}"] for i in range(len(columns))]


def sections(source: Source) -> Iterator[str]:
    """The names of the sections that follow the first, each while its contents come next."""
    while source.at < len(source.data):
        line = source.line()
        if line == "$MeshFormat":
            version, binary, size = source.line().split()[:3]
            if version not in ("2.2", "4.1"):
                raise Unreadable(f"it has version {version[:8]} of the format; save it as 4.1")
            source.new, source.binary, source.wide = version == "4.1", binary == "1", f"u{size}"
            if source.binary and source.data[source.at : source.at + 4] != b"\1\0\0\0":
                raise Unreadable("its numbers are binary of another machine; save it as text")
            source.skip("MeshFormat")
        elif line.startswith("$") and not line.startswith("$End"):
            yield line[1:]
            source.skip(line[1:])


def read(name: str, wanted: str) -> Mesh:
    """The mesh of a file and its data: of several steps the one whose number is asked for, or the last. Data go to nodes and
    elements by their numbers; what has none gets no numbers."""
    import numpy as np

    with open(name, "rb") as file:
        source = Source(file.read())
    nodes, elements = None, []
    found: dict[tuple[bool, str], list[tuple[int, int, NDArray, NDArray]]] = {}
    for section in sections(source):
        if section == "Nodes":
            nodes = (nodes_41 if source.new else nodes_22)(source)
        elif section == "Elements":
            elements = (elements_41 if source.new else elements_22)(source)
        elif section in ("NodeData", "ElementData"):
            key, step, components, numbers, rows = data_of(source, section)
            found.setdefault((section == "ElementData", key), []).append((step, components, numbers, rows))
    if nodes is None:
        raise Unreadable("it has no $Nodes: is it of Gmsh? Meshes of ANSYS have no results")
    tags, points = nodes
    volumes = [(KINDS[kind], own, corners) for kind, own, corners in elements if kind in KINDS and len(own)]
    cells = np.concatenate([own for _, own, _ in volumes]) if volumes else np.zeros(0, dtype=np.int64)
    arrays = []
    for (of_cells, key), steps in found.items():
        chosen, title = selected(wanted, key, [step for step, *_ in steps])
        _, components, numbers, rows = steps[chosen]
        arrays.append(Array(title, of_cells, components, partial(spread, cells if of_cells else tags, numbers, rows)))
    return Mesh(points, [(kind, places(tags, corners)) for kind, _, corners in volumes], arrays)


def places(tags: NDArray, wanted: NDArray) -> NDArray:
    """The index of each number among ``tags``; -1 where it is not there."""
    import numpy as np

    order = np.argsort(tags, kind="stable")
    at = np.minimum(np.searchsorted(tags[order], wanted), len(tags) - 1)
    found = order[at]
    return np.where(tags[found] == wanted, found, -1)


def spread(tags: NDArray, numbers: NDArray, rows: NDArray) -> NDArray:
    """Rows given for some of ``tags``, for all of them."""
    import numpy as np

    out = np.full((len(tags), rows.shape[1]), np.nan)
    if len(tags):
        at = places(tags, numbers)
        out[at[at >= 0]] = rows[at >= 0]
    return out


def nodes_41(source: Source) -> tuple[NDArray, NDArray]:
    import numpy as np

    numbers = source.section("Nodes")
    blocks, *_ = numbers.take(4, source.wide)
    tags, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    for _ in range(int(blocks)):
        dimension, _, parametric = numbers.take(3, "i4")
        (count,) = numbers.take(1, source.wide)
        tags.append(numbers.take(int(count), source.wide).astype(np.int64))
        width = 3 + (int(dimension) if parametric else 0)
        points.append(numbers.take(int(count) * width, "f8").reshape(-1, width)[:, :3])
    return np.concatenate(tags), np.concatenate(points)


def nodes_22(source: Source) -> tuple[NDArray, NDArray]:
    import numpy as np

    count = int(source.line())
    tags, points = source.section("Nodes").rows(count, [("i4", 1), ("f8", 3)])
    return tags[:, 0].astype(np.int64), points


def points_of(kind: float) -> int:
    """The number of points of a type of element."""
    if int(kind) not in POINTS:
        raise Unreadable(f"it has elements of type {int(kind)}, which are not known here")
    return POINTS[int(kind)]


def blocks_41(source: Source) -> list[tuple[tuple[int, int], int, NDArray]]:
    """Of each block of elements the entity (dimension and number), their type, and their numbers with those of their nodes."""
    import numpy as np

    numbers = source.section("Elements")
    blocks, *_ = numbers.take(4, source.wide)
    out = []
    for _ in range(int(blocks)):
        dimension, entity, kind = (int(v) for v in numbers.take(3, "i4"))
        (count,) = numbers.take(1, source.wide)
        width = 1 + points_of(kind)
        table = numbers.take(int(count) * width, source.wide).reshape(-1, width).astype(np.int64)
        out.append(((dimension, entity), kind, table))
    return out


def elements_41(source: Source) -> list[tuple[int, NDArray, NDArray]]:
    return [(kind, table[:, 0], table[:, 1:]) for _, kind, table in blocks_41(source)]


def elements_22(source: Source) -> list[tuple[int, NDArray, NDArray]]:
    import numpy as np

    count = int(source.line())
    numbers, done = source.section("Elements"), 0
    rows: dict[int, list[NDArray]] = {}
    while done < count:
        # In text each element is a block of one, which begins with its number.
        head = numbers.take(3, "i4")
        kind, follow, tags = (head[0], head[1], head[2]) if source.binary else (head[1], 1, head[2])
        width = int(tags) + points_of(kind)
        if source.binary:
            table = numbers.take(int(follow) * (1 + width), "i4").reshape(-1, 1 + width)
        else:
            table = np.concatenate([head[:1], numbers.take(width, "")])[None]
        rows.setdefault(int(kind), []).append(np.delete(table, range(1, 1 + int(tags)), axis=1).astype(np.int64))
        done += int(follow)
    tables = {kind: np.concatenate(of) for kind, of in rows.items()}
    return [(kind, table[:, 0], table[:, 1:]) for kind, table in tables.items()]


def data_of(source: Source, section: str) -> tuple[str, int, int, NDArray, NDArray]:
    """Name, step, number of components, the numbers of the items and their rows."""
    import numpy as np

    texts = [source.line().strip('"') for _ in range(int(source.line()))]
    for _ in range(int(source.line())):
        source.line()
    whole = [int(source.line()) for _ in range(int(source.line()))]
    step, components, count = whole[:3]
    items, rows = source.section(section).rows(count, [("i4", 1), ("f8", components)])
    return (texts[0] if texts else ""), step, components, items[:, 0].astype(np.int64), np.asarray(rows, dtype=np.float64)


def groups(name: str) -> dict[str, dict[str, int]]:
    """The physical groups of surfaces and volumes that have a name: how many faces and elements are in each."""
    with open(name, "rb") as file:
        source = Source(file.read())
    names: dict[tuple[int, int], str] = {}
    physical: dict[tuple[int, int], set[int]] = {}
    counts: Counter[tuple[int, int]] = Counter()
    for section in sections(source):
        if section == "PhysicalNames":
            for _ in range(int(source.line())):
                plane, group, text = source.line().split(maxsplit=2)
                names[int(plane), int(group)] = text.strip('"')
        elif section == "Entities":
            physical = entities(source)
        elif section == "Elements" and source.new:
            for (dimension, entity), _, table in blocks_41(source):
                counts.update({(dimension, tag): len(table) for tag in physical.get((dimension, entity), ())})
        elif section == "Elements":
            counts = members_22(source)
    found: dict[str, dict[str, int]] = {}
    for (dimension, tag), text in names.items():
        if dimension > 1 and counts[dimension, tag]:
            found.setdefault(text, {})["faces" if dimension == 2 else "elements"] = counts[dimension, tag]
    return found


def entities(source: Source) -> dict[tuple[int, int], set[int]]:
    """The physical groups of each entity, by its dimension and number."""
    numbers, found = source.section("Entities"), {}
    for dimension, count in enumerate(numbers.take(4, source.wide).tolist()):
        for _ in range(int(count)):
            (entity,) = numbers.take(1, "i4")
            numbers.take(6 if dimension else 3, "f8")
            for part in range(2 if dimension else 1):
                (size,) = numbers.take(1, source.wide)
                tags = {abs(int(tag)) for tag in numbers.take(int(size), "i4")}
                if part == 0:
                    found[dimension, int(entity)] = tags
    return found


def members_22(source: Source) -> Counter[tuple[int, int]]:
    """How many elements each physical group has, by its dimension and number."""
    count, done = int(source.line()), 0
    counts: Counter[tuple[int, int]] = Counter()
    if source.binary:
        numbers = source.section("Elements")
        while done < count:
            kind, follow, tags = numbers.take(3, "i4").tolist()
            table = numbers.take(follow * (1 + tags + points_of(kind)), "i4").reshape(follow, -1)
            counts.update((kind, tag) for tag in table[:, 1].tolist() if tags)
            done += follow
    else:
        end = source.data.find(b"$EndElements", source.at)
        rows = (line.split(None, 4) for line in source.data[source.at : end].splitlines())
        counts.update((int(row[1]), int(row[3])) for row in rows if len(row) > 3 and row[2] != b"0")
    of: Counter[tuple[int, int]] = Counter()
    for (kind, tag), size in counts.items():
        of[3 if kind in KINDS else 2 if kind in FLAT else 1, abs(tag)] += size
    return of
