"""Regions: where the part may be. Lengths in mm."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal

from .given import settings

__all__ = ["box", "cylinder", "difference", "halfspace", "intersection", "mesh", "offset", "sphere", "tetrahedron", "union"]

Point = Sequence[float]


def box(
    size: Point | None = None,
    center: Point | None = None,
    *,
    min: Point | None = None,
    max: Point | None = None,
) -> dict:
    """An axis-aligned box, by ``size`` and ``center`` (the origin unless given) or by the corners ``min`` and ``max``."""
    return {"box": settings(size=size, center=center, min=min, max=max)}


def cylinder(base: Point, radius: float, height: float, axis: Point | None = None) -> dict:
    """A straight round cylinder from the middle of its lower face, ``base``, along ``axis`` (+z unless given)."""
    return {"cylinder": settings(base=base, axis=axis, radius=radius, height=height)}


def sphere(radius: float, center: Point | None = None) -> dict:
    """A ball about ``center`` (the origin unless given)."""
    return {"sphere": settings(center=center, radius=radius)}


def tetrahedron(corners: Sequence[Point], sharpness: float | None = None) -> dict:
    """The tetrahedron of four ``corners`` (mm), in any order.

    With a ``sharpness`` (per mm) its faces are joined by a smooth maximum (LogSumExp): edges draw back by ln 2 / sharpness,
    corners by ln 3 / sharpness. Neighbours then leave gaps between them, so it is for a single one only.
    """
    return {"tetrahedron": settings(corners=corners, sharpness=sharpness)}


def halfspace(point: Point, normal: Point) -> dict:
    """One side of the plane through ``point``; ``normal`` points out of the solid."""
    return {"halfspace": settings(point=point, normal=normal)}


def mesh(
    path: str | os.PathLike[str],
    unit: str | None = None,
    scale: float | None = None,
    repair: Literal["auto", "refuse"] | None = None,
) -> dict:
    """A triangle mesh from a file (stl, obj, ply, off, 3mf).

    ``unit`` is that of the file (mm unless given; a 3MF names its own), ``scale`` a factor on top. A relative path
    starts at the design file, or at the working directory for a design made in Python. A mesh that does not bound a
    solid is repaired, with a warning that says how, or with ``repair="refuse"`` it is an error with counts.
    """
    return {"mesh": settings(path=os.fspath(path), unit=unit, scale=scale, repair=repair)}


def union(*regions: dict) -> dict:
    """Points in any of the regions."""
    return {"union": list(regions)}


def intersection(*regions: dict) -> dict:
    """Points in all of the regions."""
    return {"intersection": list(regions)}


def difference(first: dict, *others: dict) -> dict:
    """Points in the first region and in none of the others."""
    return {"difference": [first, *others]}


def offset(of: dict, by: float) -> dict:
    """A region grown by a distance (mm), or shrunk by a negative one."""
    return {"offset": {"of": of, "by": by}}
