"""Data in memory where a design has the path of a file: arrays, tables, meshes.

They become the bytes of a file, exact to the last bit, under a name made of their SHA-256: the same data make the same design,
and a design with them is pickled and sent with them.
"""

from __future__ import annotations

import hashlib
import os
import weakref

from .given import check_data

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray

__all__ = ["IN_MEMORY", "InMemory", "cloud", "content", "file_name", "grid", "path_of"]

#: How the names begin; the core knows it.
IN_MEMORY = "memory:"
#: What is in use, by name.
_known: weakref.WeakValueDictionary[str, InMemory] = weakref.WeakValueDictionary()


class InMemory(str):
    """The name of data in memory, and the bytes of the file that they would be, which are there as long as it is."""

    content: bytes

    @staticmethod
    def of(content: bytes, suffix: str) -> InMemory:
        """The name of these bytes."""
        name = f"{IN_MEMORY}{hashlib.sha256(content).hexdigest()}.{suffix}"
        made = _known.get(name)
        if made is None:
            made = _known[name] = InMemory(name)
            made.content = content
        return made

    def __reduce__(self) -> tuple:
        return InMemory.of, (self.content, self.rpartition(".")[2])


def content(name: str) -> bytes:
    """The bytes of a name. The core calls it. Raises ValueError where nothing has them any more."""
    found = _known.get(name)
    if found is None:
        raise ValueError(f"{name} is data that no design in this process holds; Design.save writes such data as files")
    return found.content


def file_name(name: str) -> str:
    """The name of a file for data in memory."""
    return name.removeprefix(IN_MEMORY)


def path_of(given: Any, hold: Callable[[Any], InMemory]) -> str:
    """The path of a file, or the name of what is given in its place, which ``hold`` makes."""
    return os.fspath(given) if isinstance(given, (str, os.PathLike)) else hold(given)


def grid(given: Any) -> InMemory:
    """Numbers on a grid, (nx, ny, nz), as a .npy."""
    import io

    import numpy as np

    numbers = _numbers("the grid", given, 3)
    out = io.BytesIO()
    np.save(out, numbers)
    return InMemory.of(out.getvalue(), "npy")


def cloud(given: Any) -> InMemory:
    """Rows of x, y, z (mm) and a value as a .csv, with the names of a data frame's columns if x, y and z are among them."""
    rows = _numbers("the points", given, 2).tolist()
    names = [str(name) for name in getattr(given, "columns", ())]
    head = [",".join(names)] if {"x", "y", "z"} <= {name.lower() for name in names} else []
    return InMemory.of("\n".join([*head, *(",".join(map(repr, row)) for row in rows), ""]).encode(), "csv")


def _numbers(what: str, given: Any, dimensions: int) -> NDArray[np.float64]:
    """An array of numbers, of an array or a data frame. A TypeError for what is none."""
    import numpy as np

    check_data(given)
    try:
        found = np.asarray(given.to_numpy() if hasattr(given, "to_numpy") else given)
        numbers = np.ascontiguousarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{what}: expected the path of a file or an array of numbers, found {type(given).__name__}") from None
    if numbers.ndim != dimensions or np.iscomplexobj(found):
        raise ValueError(f"{what} must be real numbers in {dimensions} dimensions, found {found.dtype} of shape {found.shape}")
    return numbers
