"""Triangle meshes of other packages, to and from: trimesh, pyvista, meshio. None is imported before it is asked for."""

from __future__ import annotations

from importlib import import_module

import numpy as np

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from types import ModuleType
    from typing import Any

    from numpy.typing import NDArray

__all__ = ["package", "parts_of"]

#: The packages, as messages name them.
PACKAGES = "a trimesh.Trimesh, a pyvista.PolyData or a meshio.Mesh"


def package(name: str) -> ModuleType:
    """The package of this name; an ImportError with what to install if it is missing."""
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(f"{name} is not installed: pip install {name}", name=name) from None


def parts_of(mesh: Any) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) and triangles (m, 3) of a mesh of another package, known by its attributes; larger polygons are cut into
    fans. A TypeError for anything else, a ValueError for a mesh of volume elements.
    """
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if hasattr(mesh, "points") and isinstance(getattr(mesh, "cells", None), list):
        return np.asarray(mesh.points), fans(polygons(mesh.cells))
    if hasattr(mesh, "points") and hasattr(mesh, "is_all_triangles"):
        whole = mesh if mesh.is_all_triangles else mesh.triangulate()
        return np.asarray(whole.points), np.asarray(whole.faces).reshape(-1, 4)[:, 1:]
    raise TypeError(f"expected vertices and triangles, or {PACKAGES}, found {type(mesh).__module__}.{type(mesh).__name__}")


def polygons(blocks: list) -> list[NDArray]:
    """The corners of meshio's triangles and larger polygons, a block each; points and lines are left out."""
    made = []
    for block in blocks:
        if block.type in ("triangle", "quad") or block.type.startswith("polygon"):
            made.append(np.asarray(block.data))
        elif block.type not in ("vertex", "line"):
            raise ValueError(f"expected triangles, quads or polygons, found elements of type {block.type}")
    return made


def fans(blocks: list[NDArray]) -> NDArray[np.int64]:
    """Convex polygons as triangles that share their first corners."""
    parts = [b[:, [0, k, k + 1]] for b in blocks for k in range(1, b.shape[1] - 1)]
    return np.concatenate(parts) if parts else np.empty((0, 3), dtype=np.int64)
