"""Results of finite elements that the core does not read itself: a mesh of volumes and one array."""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from ..base.formats import RESULT_READS, dotted, kind_of
from . import children
from .elements import BASE, PER_BYTE, VOLUMES, needed, without_contents

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Unreadable", "read"]

#: The package that reads each format, which is not needed otherwise; Gmsh's is read here.
PACKAGES = {"med": "h5py", "rmed": "h5py", "e": "netCDF4", "exo": "netCDF4"}
#: Places of a symmetric tensor's components in VTK's order, by the ends of their names.
TENSOR = {"xx": 0, "yy": 1, "zz": 2, "xy": 3, "yx": 3, "yz": 4, "zy": 4, "xz": 5, "zx": 5}


class Unreadable(ValueError):
    """What is wrong with a file, in words that do not quote it."""


class Array(NamedTuple):
    """An array of a file: its numbers, one row for each point, or for each volume, are read when they are asked for."""

    name: str
    of_cells: bool
    components: int
    rows: Callable[[], NDArray[np.float64]]


class Mesh(NamedTuple):
    """Points (n, 3), blocks of volumes (VTK's number of their kind, points of each), and arrays at the step asked for."""

    points: NDArray[np.float64]
    blocks: list[tuple[int, NDArray]]
    arrays: list[Array]


def selected(wanted: str, name: str, steps: list) -> tuple[int, str]:
    """The step that is meant of the array ``name``, as its index among ``steps`` (labels), and the array's name there: "S@2" is
    that of the label 2, all else that of the last."""
    base, at, label = wanted.rpartition("@")
    found = [i for i, step in enumerate(steps) if at and base == name and str(step) == label]
    return (found[-1], wanted) if found else (len(steps) - 1, name)


def read(path: str | os.PathLike[str], array: str, limit: float | None = None) -> tuple:
    """Points (n, 3), the points of all volumes one after the other, where each ends, its kind (VTK's number); of each array its
    name, whether it is of cells, and its number of components; of ``array`` the index among these, if it is there, and its
    numbers.

    "S" is an array at the last step, "S@2" at step 2. Read in a process of its own, as finite elements are. Raises ValueError
    for what cannot be read.
    """
    name = os.path.abspath(os.fsdecode(path))
    kind = kind_of(name)
    if kind not in RESULT_READS:
        raise ValueError(
            f"{name}: the name must end in {dotted(RESULT_READS)}; found .{kind or ' none'}. Save it as vtu (ParaView reads "
            "most results), or export a table of points (csv), for points = { path = ... } or stress = { table = ... }"
        )
    if not os.path.isfile(name):
        raise ValueError(f"{name} does not exist" if not os.path.exists(name) else f"{name} is no file")
    package = PACKAGES.get(kind)
    if package is not None:
        try:
            importlib.import_module(package)
        except ImportError:
            raise ValueError(f".{kind} files are read by {package}, which is not installed: pip install {package}") from None
    elif kind != "msh":
        needed(kind)
    size = os.path.getsize(name)
    seconds = 20 + 2e-6 * size if limit is None else limit
    memory = BASE + PER_BYTE * size
    found = children.arrays("results", [name, array], name, package or "the reader", memory, seconds)
    *elements, names, of_cells, components, chosen, values = found
    listed = [(str(n), bool(c), int(k)) for n, c, k in zip(names, of_cells, components, strict=True)]
    return (*elements, listed, int(chosen) if chosen >= 0 else None, values)


def child(name: str, wanted: str, made: str, memory: str) -> None:
    """Reads a file within ``memory`` bytes and writes its arrays; what is wrong with it is the last line of the words."""
    import io

    children.bound(float(memory))
    import numpy as np

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            arrays = taken(reader(kind_of(name))(name, wanted), wanted)
    except MemoryError:
        sys.exit(f"it takes more than {float(memory) / 1e9:.1f} GB of memory")
    except Unreadable as error:
        sys.exit(str(error))
    except (Exception, SystemExit) as error:
        if type(error).__name__ == "ReadError":
            sys.exit(without_contents(str(error)) or "no such format")
        # What else goes wrong quotes the file, which may be another than was meant.
        sys.exit(f"no result is found in it ({type(error).__name__}); is it damaged?")
    np.savez(made, *arrays)


def reader(kind: str) -> Callable[[str, str], Mesh]:
    """The function that reads files of this kind."""
    own = {"med": "med", "rmed": "med", "e": "exodus", "exo": "exodus", "msh": "gmsh"}.get(kind)
    return by_meshio if own is None else importlib.import_module(f"{__package__}.{own}").read


def taken(mesh: Mesh, wanted: str) -> tuple[ArrayLike, ...]:
    """What the child writes."""
    import numpy as np

    if not mesh.blocks:
        raise Unreadable("it holds no volume; a result on tetrahedra, hexahedra, wedges or pyramids is needed")
    points = np.ascontiguousarray(mesh.points, dtype=np.float64)
    ends = np.cumsum(np.concatenate([np.full(len(cells), cells.shape[1]) for _, cells in mesh.blocks]), dtype=np.uint64)
    connectivity = np.concatenate([cells.reshape(-1) for _, cells in mesh.blocks])
    if connectivity.min() < 0 or connectivity.max() >= len(points):
        raise Unreadable("a cell names a point that is not there")
    kinds = np.concatenate([np.full(len(cells), kind, dtype=np.uint8) for kind, cells in mesh.blocks])
    chosen = next((i for i, array in enumerate(mesh.arrays) if array.name == wanted), -1)
    values: NDArray[np.float64] = np.zeros(0)
    if chosen >= 0:
        array = mesh.arrays[chosen]
        values = np.asarray(array.rows(), dtype=np.float64).reshape(-1, array.components)
        count, what = (len(ends), "volumes") if array.of_cells else (len(points), "points")
        if len(values) != count:
            raise Unreadable(f"the array has {len(values)} rows for {count} {what}")
        if not array.of_cells:
            # Points of no volume, such as centres of arcs, need no numbers.
            unused = np.ones(count, dtype=bool)
            unused[connectivity] = False
            values[unused & ~np.isfinite(values).all(axis=1)] = 0.0
    return (
        *(points, connectivity.astype(np.uint32), ends, kinds),
        np.array([array.name for array in mesh.arrays], dtype=np.str_),
        np.array([array.of_cells for array in mesh.arrays], dtype=bool),
        np.array([array.components for array in mesh.arrays], dtype=np.int64),
        *(np.int64(chosen), values.reshape(-1)),
    )


def by_meshio(name: str, wanted: str) -> Mesh:
    """A file that meshio reads; of a time series in XDMF the step that is asked for, counted from 1."""
    import meshio
    import numpy as np

    mesh, labels, step = None, [1], 0
    if kind_of(name) == "xdmf":
        with contextlib.suppress(meshio.ReadError), meshio.xdmf.TimeSeriesReader(name) as series:
            points, cells = series.read_points_cells()
            labels = list(range(1, series.num_steps + 1))
            step, _ = selected(wanted, wanted.rpartition("@")[0], labels)
            _, point_data, cell_data = series.read_data(step)
            mesh = meshio.Mesh(points, cells, point_data=point_data, cell_data=cell_data)
    if mesh is None:
        mesh = meshio.read(name)
    if np.shape(mesh.points)[-1] != 3:
        raise Unreadable("its points do not have three coordinates")
    of_volumes = [i for i, block in enumerate(mesh.cells) if block.type in VOLUMES]
    blocks = [(VOLUMES[mesh.cells[i].type], np.asarray(mesh.cells[i].data, dtype=np.int64)) for i in of_volumes]

    def array(key: str, of_cells: bool, rows: NDArray) -> Array:
        flat = np.asarray(rows, dtype=np.float64).reshape(len(rows), -1)
        return Array(selected(wanted, key, labels)[1], of_cells, max(1, flat.shape[1]), lambda: flat)

    arrays = [array(key, False, rows) for key, rows in mesh.point_data.items()]
    for key, rows in mesh.cell_data.items():
        if of_volumes:
            arrays.append(array(key, True, np.concatenate([np.asarray(rows[i]) for i in of_volumes])))
    return Mesh(mesh.points, blocks, arrays)


if __name__ == "__main__":
    # The same module as others import, so that its exceptions are the same.
    from trabecula.io.results import child as run

    run(*sys.argv[1:])
