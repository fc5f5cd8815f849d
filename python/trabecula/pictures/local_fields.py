"""What a design says at the nodes of a volume mesh: fields for solvers and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .seen import Seen

__all__ = ["FIELDS", "fields_at"]


def fields_at(solid: Seen, names: Iterable[str], nodes: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Fields by their names in a file, (n,) or (n, k), at nodes (n, 3) in mm; each name of ``FIELDS`` may stand for several.

    Raises ValueError for a name that is none, and for what the design has not.
    """
    found: dict[str, NDArray[np.float64]] = {}
    for name in names:
        if name not in FIELDS:
            raise ValueError(f"there is no field {name}; there are {', '.join(FIELDS)}")
        found |= FIELDS[name](solid, nodes)
    return found


def _shares(solid: Seen, nodes: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """The share of each lattice; of the only one 1."""
    import numpy as np

    names = list(solid.report().lattices)
    if len(names) == 1:
        return {names[0]: np.ones(len(nodes))}
    return solid.shares(nodes)


def _fraction(solid: Seen, nodes: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """The mean of the lattices' fractions by their shares."""
    import numpy as np

    shares = _shares(solid, nodes)
    of = {name: solid.cell_at(nodes, name)["fraction"] for name in shares}
    return {"solid_fraction": sum((share * of[name] for name, share in shares.items()), np.zeros(len(nodes)))}


def _of_greatest(solid: Seen, nodes: NDArray[np.float64], what: str) -> NDArray[np.float64]:
    """What the cell of the lattice of the greatest share has."""
    import numpy as np

    shares = _shares(solid, nodes)
    greatest = np.argmax(list(shares.values()), axis=0)
    of = np.array([solid.cell_at(nodes, name)[what] for name in shares])
    return of[greatest, np.arange(len(nodes))]


def _orientation(solid: Seen, nodes: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    axes = _of_greatest(solid, nodes, "axes")
    return {f"axis_{k + 1}": axes[:, k] for k in range(3)}


#: The fields by name.
FIELDS: dict[str, Callable[[Seen, NDArray], dict[str, NDArray]]] = {
    "fraction": _fraction,
    "share": lambda solid, nodes: {f"share_{name}": share for name, share in _shares(solid, nodes).items()},
    "orientation": _orientation,
    "wavelength": lambda solid, nodes: {"wavelength": _of_greatest(solid, nodes, "wavelength")},
}
