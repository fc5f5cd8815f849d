"""Results in Exodus II (Sierra, MOOSE, Cubit), which is NetCDF: variables of nodes and of elements."""

from __future__ import annotations

import os
import re
from functools import partial
from typing import TYPE_CHECKING

from .results import TENSOR, Array, Mesh, Unreadable, selected

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

__all__ = ["read"]

#: VTK's numbers of volumes by the first letters of their types; corners come first in both.
KINDS = {"TET": 10, "HEX": 12, "WED": 13, "PYR": 14}
#: Components of a tensor or a vector, each a variable of its own.
COMPONENT = (
    re.compile(r"(.*?)[_. -]?(xx|yy|zz|xy|yx|yz|zy|zx|xz)", re.IGNORECASE),
    re.compile(r"(.*?)[_. -]?([xyz])", re.IGNORECASE),
)


def read(name: str, wanted: str) -> Mesh:
    """The mesh of a file and its variables: of several steps the one asked for, counted from 1, or the last. Variables such as
    stress_xx, stress_yy, … become one tensor ``stress`` in VTK's order; disp_x, disp_y, disp_z one vector ``disp``."""
    import netCDF4
    import numpy as np

    file = netCDF4.Dataset(name)
    file.set_auto_mask(False)
    file.set_auto_chartostring(False)
    bytes_of_all = sum(v.dtype.itemsize * v.size for v in file.variables.values())
    # NetCDF reads what is missing at the end of a classic file as zeros.
    if file.data_model.startswith("NETCDF3") and os.path.getsize(name) < bytes_of_all:
        raise Unreadable("the file is shorter than its data; was it cut off?")
    variables, sizes = file.variables, {key: len(d) for key, d in file.dimensions.items()}
    if sizes.get("num_dim", 3) != 3:
        raise Unreadable(f"its points have {sizes['num_dim']} coordinates; three are needed")
    together = "coord" in variables
    points = variables["coord"][:].T if together else np.column_stack([variables[f"coord{a}"][:] for a in "xyz"])
    blocks, numbers = [], []
    for block in range(1, sizes.get("num_el_blk", 0) + 1):
        cells = variables.get(f"connect{block}")
        kind = KINDS.get(str(getattr(cells, "elem_type", ""))[:3].upper())
        if cells is not None and kind is not None:
            blocks.append((kind, cells[:].astype(np.int64) - 1))
            numbers.append(block)
    steps = list(range(1, sizes.get("time_step", 0) + 1))

    def of_nodes(place: int, step: int) -> NDArray:
        own = variables.get(f"vals_nod_var{place + 1}")
        return own[step] if own is not None else variables["vals_nod_var"][step][place]

    def of_elements(place: int, step: int) -> NDArray:
        found = [variables.get(f"vals_elem_var{place + 1}eb{block}") for block in numbers]
        # A variable need not be there in each block.
        missing = [np.full(len(cells), np.nan) for _, cells in blocks]
        return np.concatenate([m if v is None else v[step] for v, m in zip(found, missing, strict=True)])

    def columns(numbers_of: Callable[[int, int], NDArray], places: list[int], step: int) -> NDArray:
        return np.column_stack([numbers_of(place, step) for place in places])

    arrays = []
    for key, of_cells, numbers_of in (("name_nod_var", False, of_nodes), ("name_elem_var", True, of_elements)):
        names = [row.tobytes().decode("utf-8", "replace").strip("\0 ") for row in variables[key][:]] if key in variables else []
        for title, places in joined(names).items():
            if not steps:
                continue
            step, here = selected(wanted, title, steps)
            arrays.append(Array(here, of_cells, len(places), partial(columns, numbers_of, places, step)))
    return Mesh(points, blocks, arrays)


def joined(names: list[str]) -> dict[str, list[int]]:
    """Arrays by name, each with the places of its components among the variables."""
    out: dict[str, list[int]] = {}
    for pattern, order in zip(COMPONENT, (TENSOR, {"x": 0, "y": 1, "z": 2}), strict=True):
        groups: dict[str, dict[int, int]] = {}
        for place, name in enumerate(names):
            if (match := pattern.fullmatch(name)) and match[1]:
                groups.setdefault(match[1], {})[order[match[2].lower()]] = place
        count = len(set(order.values()))
        out |= {base: [of[i] for i in range(count)] for base, of in groups.items() if len(of) == count}
    taken = {place for places in out.values() for place in places}
    return out | {name: [place] for place, name in enumerate(names) if place not in taken}
