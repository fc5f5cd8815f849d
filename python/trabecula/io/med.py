"""Results in MED (Code_Aster, Salome), which is HDF5: at nodes, of cells, at points of integration and at nodes of cells."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from .results import TENSOR, Array, Mesh, Unreadable, selected

if TYPE_CHECKING:
    import h5py
    from numpy.typing import NDArray

__all__ = ["read"]

#: VTK's numbers of the types of volumes; corners come first in both.
KINDS = {"TE4": 10, "T10": 24, "HE8": 12, "H20": 25, "H27": 29, "PE6": 13, "P15": 26, "P18": 13, "PY5": 14, "P13": 27}
#: The name of the profile that has all.
ALL = "MED_NO_PROFILE_INTERNAL"


def read(name: str, wanted: str) -> Mesh:
    """The mesh of a file and its fields: of several steps the one whose number is asked for, or the last. Values at several
    points of a cell become their mean, tensors get VTK's order by the names of their components."""
    import h5py
    import numpy as np

    # A file that another program has open is locked; the child that runs this ends soon.
    file = h5py.File(name, "r", locking=False)
    meshes = list(file["ENS_MAA"].values())
    if len(meshes) != 1:
        raise Unreadable(f"it holds {len(meshes)} meshes; save one")
    dimensions = int(meshes[0].attrs["ESP"])
    if dimensions != 3:
        raise Unreadable(f"its points have {dimensions} coordinates; three are needed")
    mesh = meshes[0] if "NOE" in meshes[0] else list(meshes[0].values())[-1]
    points = mesh["NOE"]["COO"][()].reshape(3, -1).T
    blocks, counts = [], {}
    for key, group in mesh.get("MAI", {}).items():
        if key in KINDS:
            count = int(group["NOD"].attrs["NBR"])
            blocks.append((KINDS[key], group["NOD"][()].reshape(-1, count).T.astype(np.int64) - 1))
            counts[key] = count
    arrays = []
    for key, field in file.get("CHA", {}).items():
        steps = sorted(field.values(), key=lambda step: (step.attrs["NDT"], step.attrs["NOR"]))
        labels = [int(step.attrs["NDT"]) for step in steps]
        if not steps:
            continue
        chosen, title = selected(wanted, key, labels)
        step, components = steps[chosen], int(field.attrs["NCO"])
        order = vtk_order(field.attrs.get("NOM", b""), components)
        if "NOE" in step:
            arrays.append(Array(title, False, components, partial(at_nodes, file, step, len(points), order)))
        elif any(support.partition(".")[2] in counts for support in step):
            arrays.append(Array(title, True, components, partial(of_cells, file, step, counts, order)))
    return Mesh(points, blocks, arrays)


def at_nodes(file: h5py.File, step: h5py.Group, count: int, order: list[int]) -> NDArray:
    """The rows of the nodes, components in this order."""
    return values(file, step["NOE"], count, len(order))[:, order]


def of_cells(file: h5py.File, step: h5py.Group, counts: dict[str, int], order: list[int]) -> NDArray:
    """The rows of the cells of all kinds; no numbers for kinds that have none."""
    import numpy as np

    found = []
    for kind, count in counts.items():
        support = next((s for s in (f"MAI.{kind}", f"NOE.{kind}") if s in step), None)
        missing = support is None
        found.append(np.full((count, len(order)), np.nan) if missing else values(file, step[support], count, len(order)))
    return np.concatenate(found)[:, order]


def values(file: h5py.File, support: h5py.Group, count: int, components: int) -> NDArray:
    """The rows of a support of ``count`` nodes or cells, the mean of several values of each; no numbers outside its profile."""
    import numpy as np

    profile = next(iter(support))
    data = support[profile]["CO"][()].astype(np.float64)
    # Component by component, in these item by item, in these point by point.
    if profile == ALL:
        return data.reshape(components, count, -1).mean(axis=2).T
    items = file["PROFILS"][profile]["PFL"][()] - 1
    rows = np.full((count, components), np.nan)
    rows[items] = data.reshape(components, len(items), -1).mean(axis=2).T
    return rows


def vtk_order(names: bytes | str, components: int) -> list[int]:
    """The places of a tensor's six components in VTK's order, by the ends of their names of 16 characters; those of the file,
    where the names do not say."""
    text = names.decode("latin-1") if isinstance(names, bytes) else str(names)
    ends = [text[16 * i : 16 * i + 16].strip("\0 ").lower()[-2:] for i in range(components)]
    places = [TENSOR.get(end) for end in ends]
    if components == 6 and sorted(p for p in places if p is not None) == list(range(6)):
        return [places.index(i) for i in range(6)]
    return list(range(components))
