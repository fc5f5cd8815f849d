# Made by scripts/builders.py from schema/design.json; do not edit.
"""Regions: where the part may be. Lengths in mm."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal

from .base import memory
from .base.given import named, settings
from .mesh import in_memory

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .base.given import MeshLike, Vector

__all__ = [
    "box",
    "capsule",
    "cylinder",
    "difference",
    "faces",
    "halfspace",
    "intersection",
    "mesh",
    "moved",
    "offset",
    "repeated",
    "sphere",
    "tetrahedron",
    "union",
]


@named
def box(
    size: Vector | None = None,
    center: Vector | None = None,
    *,
    min: Vector | None = None,
    max: Vector | None = None,
) -> dict:
    """An axis-aligned box, by its size and centre, or by two corners.

    size: Edge lengths [x, y, z]. [mm, above 0, optional]
    center: Its middle. [mm, default [0.0, 0.0, 0.0]]
    min: Lower corner. [mm, optional]
    max: Upper corner. [mm, optional]
    """
    return {"box": settings(size=size, center=center, min=min, max=max)}


@named
def cylinder(base: Vector, radius: float, height: float, axis: Vector | None = None) -> dict:
    """A straight round cylinder.

    base: Middle of the lower face. [mm]
    radius: Radius. [mm, above 0]
    height: Height along the axis. [mm, above 0]
    axis: Direction from the lower to the upper face; its length does not matter. [default [0.0, 0.0, 1.0]]
    """
    return {"cylinder": settings(base=base, radius=radius, height=height, axis=axis)}


@named
def sphere(radius: float, center: Vector | None = None) -> dict:
    """A ball.

    radius: Radius. [mm, above 0]
    center: Centre. [mm, default [0.0, 0.0, 0.0]]
    """
    return {"sphere": settings(radius=radius, center=center)}


@named
def capsule(start: Vector, end: Vector, radius: float) -> dict:
    """A capsule: all points within a distance of a straight segment.

    start: One end of the segment, the centre of a hemisphere. [mm]
    end: The other end of the segment. [mm]
    radius: Radius. [mm, above 0]
    """
    return {"capsule": settings(start=start, end=end, radius=radius)}


@named
def tetrahedron(corners: Sequence[Vector] | NDArray, sharpness: float | None = None) -> dict:
    """A tetrahedron.

    corners: Its four corners, in any order. [mm]
    sharpness: With it faces are joined by a smooth maximum (LogSumExp) of this sharpness, which draws edges back by ln
        2 over it and corners by ln 3: smooth, but with gaps between neighbours, so for a single tetrahedron only. [per
        mm, above 0, optional]
    """
    return {"tetrahedron": settings(corners=corners, sharpness=sharpness)}


@named
def halfspace(point: Vector, normal: Vector) -> dict:
    """One side of a plane; it bounds nothing alone, so combine it.

    point: A point on the plane. [mm]
    normal: Normal of the plane; it points out of the solid. Its length does not matter.
    """
    return {"halfspace": settings(point=point, normal=normal)}


@named
def mesh(
    path: str | os.PathLike[str] | MeshLike,
    unit: Literal["mm", "micron", "cm", "m", "inch", "foot"] | None = None,
    scale: float | None = None,
    repair: Literal["auto", "refuse"] | None = None,
    caps: float | None = None,
    chord: float | None = None,
    angle: float | None = None,
    solid: str | None = None,
) -> dict:
    """A triangle mesh from a file (stl, 3mf, ply, obj, off), or the solids of a part from a CAD system (step, iges).

    path: Path of the file, relative to the design file. Or a mesh in memory: ours, of trimesh, pyvista or meshio, or
        (vertices, triangles).
    unit: Unit of the file's coordinates (mm unless given); 3MF, STEP and IGES files name their own. [optional]
    scale: Factor on all coordinates, after the unit. [above 0, default 1.0]
    repair: Whether a mesh with holes, flipped faces or crossings is repaired (auto) or refused with counts (refuse).
        [default "auto"]
    caps: Greatest share of the surface that caps of holes may make up, 0 to 1: a cap is a guess, flat over a flat hole.
        [from 0 to 1, default 0.1]
    chord: Of a STEP or IGES file: greatest distance of its faces from their triangles (a five-thousandth of the
        diagonal of its bounds unless given). [mm, above 0, optional]
    angle: Of a STEP or IGES file: greatest angle, degrees, between the normals of a face within a triangle (15 unless
        given). [above 0 to 90, optional]
    solid: Of a STEP or IGES file: name of the solid that is read (all of them unless given). [optional]
    """
    given = settings(
        path=memory.path_of(path, in_memory),
        unit=unit,
        scale=scale,
        repair=repair,
        caps=caps,
        chord=chord,
        angle=angle,
        solid=solid,
    )
    return {"mesh": given}


@named
def faces(named: Sequence[str], within: float) -> dict:
    """All points within a distance of faces of the design's region, as its STEP file names them.

    named: The faces, each by its name, its colour such as "#ff0000", or its number in the file.
    within: Distance from them. [mm, above 0]
    """
    return {"faces": settings(named=named, within=within)}


@named
def union(*regions: dict) -> dict:
    """Points in any of the regions."""
    return {"union": list(regions)}


@named
def intersection(*regions: dict) -> dict:
    """Points in all of the regions."""
    return {"intersection": list(regions)}


@named
def difference(first: dict, *others: dict) -> dict:
    """Points in the first region and in none of the others."""
    return {"difference": [first, *others]}


@named
def offset(of: dict, by: float) -> dict:
    """A region grown or shrunk by a distance.

    of: The region.
    by: Distance; positive grows. [mm]
    """
    return {"offset": settings(of=of, by=by)}


@named
def moved(
    of: dict,
    by: Vector | None = None,
    rotate: Vector | None = None,
    axis: Vector | None = None,
    angle: float | None = None,
    about: Vector | None = None,
    mirror: str | Vector | None = None,
    scale: float | None = None,
) -> dict:
    """A region that is mirrored, scaled and turned about a point and then moved, in this order.

    of: The region.
    by: Displacement, after all else. [mm, default [0.0, 0.0, 0.0]]
    rotate: Angles about x, y, z: z is turned first, then y, then x. [degrees, from -1e+06 to 1e+06, default [0.0, 0.0,
        0.0]]
    axis: Direction about which it is turned by `angle`, in place of `rotate`; its length does not matter. [optional]
    angle: Angle about `axis`, by the right-hand rule. [degrees, from -1e+06 to 1e+06, optional]
    about: The point that stays where it is when the region is mirrored, scaled and turned. [mm, default [0.0, 0.0,
        0.0]]
    mirror: Normal of the plane through `about` in which it is mirrored: "x", "y", "z" or a direction. [optional]
    scale: Factor on all lengths. [above 0, default 1.0]
    """
    return {"moved": settings(of=of, by=by, rotate=rotate, axis=axis, angle=angle, about=about, mirror=mirror, scale=scale)}


@named
def repeated(of: dict, along: Sequence[dict] | None = None, around: dict | None = None) -> dict:
    """Copies of a region, in up to three rows or about an axis, or both: each copy about the axis is then repeated in
    rows.

    of: The region that is repeated: the first copy.
    along: Rows, up to three, such as [{ by = [10, 0, 0], count = 5 }]: two make a grid. [default []]
    around: About an axis, such as { count = 6 }. [optional]
    """
    return {"repeated": settings(of=of, along=along, around=around)}
