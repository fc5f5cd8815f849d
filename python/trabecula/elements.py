"""Finite-element files that the core does not read itself: through meshio, in the extra ``fe``."""

from __future__ import annotations

import os
import shutil
import tempfile
from typing import TYPE_CHECKING

from .formats import MESHIO_READS, MESHIO_WRITES, TET_READS, dotted, kind_of

if TYPE_CHECKING:
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


#: Formats that are HDF5 inside, which meshio reads and writes by another package.
HDF5 = ("med", "cgns")


def needed(kind: str = ""):
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


def read(path: str | os.PathLike[str]) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
    """Points (n, 3), the points of all volume cells one after the other, where each ends, its kind (VTK's number), zones.

    Raises ValueError for what cannot be read.
    """
    import contextlib
    import io

    name = os.fsdecode(path)
    kind = kind_of(name)
    if kind not in MESHIO_READS:
        raise ValueError(f"{name}: the name must end in {dotted(TET_READS)}; found .{kind or ' none'}")
    if not os.path.isfile(name):
        raise ValueError(f"{name} does not exist" if not os.path.exists(name) else f"{name} is no file")
    meshio = needed(kind)
    import numpy as np

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):  # it talks, and leaves with sys.exit
            mesh = meshio.read(name)
    except (Exception, SystemExit) as error:
        reason = str(error) if not isinstance(error, SystemExit) else " ".join(said.getvalue().split())
        raise ValueError(f"{name} cannot be read: {reason or type(error).__name__}") from None
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{name}: points of {points.shape[-1]} coordinates; three are needed")
    key = next((z for z in ZONES if z in mesh.cell_data), None)
    cells, ends, kinds, zones = [], [], [], []
    for i, block in enumerate(mesh.cells):
        number = VOLUMES.get(block.type)
        if number is None:
            continue
        data = np.asarray(block.data)
        cells.append(data.reshape(-1).astype(np.uint32))
        ends.append(np.full(len(data), data.shape[1], dtype=np.uint64))
        kinds.append(np.full(len(data), number, dtype=np.uint8))
        if key is not None:
            zones.append(np.asarray(mesh.cell_data[key][i]).reshape(-1).astype(np.uint32))
    if not cells:
        held = ", ".join(sorted({block.type for block in mesh.cells})) or "nothing"
        raise ValueError(f"{name} holds no volume (but {held}); tetrahedra are needed")
    none = np.zeros(0, dtype=np.uint32)
    flat = np.concatenate(cells), np.cumsum(np.concatenate(ends), dtype=np.uint64), np.concatenate(kinds)
    return np.ascontiguousarray(points), *flat, np.concatenate(zones) if zones else none


def write(path: str, kind: str, nodes: NDArray[np.float64], tets: NDArray[np.uint32], zones: NDArray[np.uint32]) -> None:
    """Writes tetrahedra as a file of the format that ``kind`` (an extension) names."""
    meshio = needed(kind)
    import numpy as np

    data = {"gmsh": "gmsh:physical", "medit": "medit:ref"}
    form = MESHIO_WRITES[kind]
    whole = zones.astype(np.int32) if len(zones) else np.zeros(len(tets), dtype=np.int32)
    fields = {data[form]: [whole]} if form in data and len(zones) else {}
    if form == "gmsh":
        fields = {"gmsh:physical": [whole], "gmsh:geometrical": [whole]}
    mesh = meshio.Mesh(nodes, [("tetra", tets.astype(np.int64))], cell_data=fields)
    more = {"file_format": "gmsh22", "binary": True} if form == "gmsh" else {"file_format": form}
    if kind not in HDF5:
        meshio.write(path, mesh, **more)
        return
    # HDF5 locks its files, and would not open one that is locked already.
    with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
        own = os.path.join(folder, f"mesh.{kind}")
        meshio.write(own, mesh, **more)
        shutil.copyfile(own, path)
