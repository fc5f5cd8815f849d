# Made by scripts/builders.py from schema/design.json; do not edit.
"""Grades: numbers that vary in space, for a level's amount or a number of a phase map. Lengths in mm."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal

from .base import memory
from .base.given import control, named, pairs, settings

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .base.given import Points, Stops, Vector

__all__ = [
    "combined",
    "depth",
    "distance",
    "field",
    "formula",
    "grid",
    "linear",
    "points",
    "radial",
    "rbf",
    "region",
    "sigmoid",
    "steps",
]


@named
def linear(along: Vector, stops: Stops) -> dict:
    """Along a direction: piecewise linear in s = along · x, constant beyond the ends.

    along: The direction [x, y, z]; s is measured in multiples of its length.
    stops: Pairs [s, value], s rising.
    """
    return {"linear": settings(along=along, stops=pairs(stops))}


@named
def steps(along: Vector, stops: Stops) -> dict:
    """In steps along a direction: piecewise constant in s = along · x, the value of the last stop at or below s; before
    the first stop its value. Its gradient is 0 everywhere.

    along: The direction [x, y, z]; s is measured in multiples of its length.
    stops: Pairs [s, value], s rising: the value from s on.
    """
    return {"steps": settings(along=along, stops=pairs(stops))}


@named
def depth(stops: Stops, of: dict | None = None) -> dict:
    """By depth below a surface: piecewise linear, constant beyond the ends.

    stops: Pairs [depth in mm, value], depth rising.
    of: Another region whose surface is meant, such as that of a bore or a bearing face; depth is negative outside it.
        The design's own unless given. [optional]
    """
    return {"depth": settings(stops=pairs(stops), of=of)}


@named
def radial(stops: Stops, center: Vector | None = None, axis: Vector | None = None) -> dict:
    """By the distance from a point or a line: piecewise linear, constant beyond the ends.

    stops: Pairs [distance in mm, value], distance rising.
    center: The point, or a point on the line. [mm, default [0.0, 0.0, 0.0]]
    axis: Direction of the line; without it, distances are from the point. [optional]
    """
    return {"radial": settings(stops=pairs(stops), center=center, axis=axis)}


@named
def formula(text: str) -> dict:
    """A formula in x, y, z (mm), such as "0.3 + 0.1*sin(x/5)"; parsed, never run as code."""
    return {"formula": text}


@named
def combined(formula: str, of: dict) -> dict:
    """Other numbers combined by a formula, such as "load * (1 - 0.5*skin)", "min(a, b)" or "0.2 + 0.1*exp(-depth/2)".

    formula: The formula in x, y, z (mm) and the names of the numbers; parsed, never run as code.
    of: The numbers by their names, in which letters, digits and _ stand.
    """
    return {"combined": settings(formula=formula, of=of)}


@named
def grid(
    path: str | os.PathLike[str] | ArrayLike,
    origin: Vector | None = None,
    step: float | Vector | None = None,
    array: str | None = None,
    remap: Stops | None = None,
) -> dict:
    """Numbers on a grid, from a file; linear between them.

    path: Path of the file (npy, vti, vtk), relative to the design file; or of grey pictures one above the other (png,
        tif, DICOM): one file, "scan/*.png" with a * in the last part for any text, or their folder, "scan/". Columns
        run along x, rows along y, pictures along z; DICOM as its axes say. Or the numbers themselves, an array (nx, ny,
        nz), with origin and step.
    origin: Position of the first number, of pictures the middle of the first pixel. VTI, VTK and DICOM files contain
        it. [mm, optional]
    step: Distance between numbers, one or three. VTI, VTK and DICOM files contain it. [mm, optional]
    array: Name of the array, where a file has several. [optional]
    remap: The values that the numbers map to: pairs [number, value], number rising, linear between. [optional]
    """
    return {"grid": settings(path=memory.path_of(path, memory.grid), origin=origin, step=step, array=array, remap=pairs(remap))}


@named
def points(
    path: str | os.PathLike[str] | ArrayLike,
    neighbours: int | None = None,
    remap: Stops | None = None,
    columns: Sequence[str] | None = None,
    unit: Literal["mm", "micron", "cm", "m", "inch", "foot"] | None = None,
) -> dict:
    """Numbers at scattered points, from a file: the mean of the nearest, weighted by one over the square of the
    distance.

    path: Path of a table (csv) of x, y, z, value, relative to the design file. Or the rows themselves, an array (n, 4)
        or a data frame.
    neighbours: Number of nearest points that count. [from 1 to 64, default 8]
    remap: The values that the numbers map to: pairs [number, value], number rising, linear between. [optional]
    columns: The names, in the table's first line, of x, y, z and the value; unless given, the table has these four
        columns alone. [optional]
    unit: Unit of the coordinates (mm unless given). [optional]
    """
    given = settings(
        path=memory.path_of(path, memory.cloud),
        neighbours=neighbours,
        remap=pairs(remap),
        columns=columns,
        unit=unit,
    )
    return {"points": given}


@named
def field(
    path: str | os.PathLike[str],
    array: str,
    unit: Literal["mm", "micron", "cm", "m", "inch", "foot"] | None = None,
    component: int | None = None,
    invariant: Literal["magnitude", "von_mises", "mean", "max_principal", "min_principal", "strain_energy"] | None = None,
    order: Literal["vtk", "voigt", "abaqus"] | None = None,
    nu: float | None = None,
    remap: Stops | None = None,
) -> dict:
    """An array of a result on a mesh of volume elements, from a file.

    path: Path of the file (vtu, vtk, vti; frd of CalculiX; in Python also med, e, exo, msh, xdmf, avs), relative to the
        design file.
    array: Name of the array, of points or cells. Where a file has several steps, "STRESS" is that of the last,
        "STRESS@2" that of the second.
    unit: Unit of the file's coordinates (mm unless given). [optional]
    component: Which of its components, from 0, where it has several. [from 0, optional]
    invariant: A number made of all its components. [optional]
    order: The order of the six components of a tensor, on which its principal values depend; `"vtk"` unless given.
        [optional]
    nu: Poisson's ratio, for the strain energy; 0.3 unless given. [above -1 to 0.5, optional]
    remap: The values that the numbers map to: pairs [number, value], number rising, linear between. [optional]
    """
    given = settings(
        path=os.fspath(path),
        array=array,
        unit=unit,
        component=component,
        invariant=invariant,
        order=order,
        nu=nu,
        remap=pairs(remap),
    )
    return {"field": given}


@named
def sigmoid(of: float | dict, width: float, at: float | None = None) -> dict:
    """A smooth step from 0 to 1 of another number: the logistic function, with ends.

    of: The number that it is a step of.
    width: From where it is 0 to where it is 1, in the unit of the number; a negative width falls.
    at: Where it is one half. [default 0.0]
    """
    return {"sigmoid": settings(of=of, width=width, at=at)}


@named
def region(of: dict, width: float, remap: Stops | None = None) -> dict:
    """1 inside a region and 0 outside, with a smooth step at its surface.

    of: The region.
    width: Width of the step, half of it on either side of the surface. [mm, above 0]
    remap: The values that the numbers map to: pairs [number, value], number rising, linear between: [[0, outside], [1,
        inside]]. [optional]
    """
    return {"region": settings(of=of, width=width, remap=pairs(remap))}


@named
def distance(points: Points, closed: bool | None = None, axis: Vector | None = None, sharpness: float | None = None) -> dict:
    """Distance to a chain of straight segments through control points.

    points: Points [x, y, z] in order, or the path of a table (csv) of them. [mm]
    closed: Whether the last is joined to the first. [default false]
    axis: Direction of projection: the distance is that from a wall through the line along it. Inside a closed line it
        is negative. [optional]
    sharpness: The smooth form instead of the exact distance: off by at most 0.2785/sharpness of the longest segment,
        without a sign. [from 10, optional]
    """
    return {"distance": settings(**control(points), closed=closed, axis=axis, sharpness=sharpness)}


@named
def rbf(points: Points, values: Vector | None = None, delta: float | None = None, axis: Vector | None = None) -> dict:
    """Gaussian radial basis functions through control points: the sum of β exp(−r²/δ²).

    points: Points [x, y, z] in order, or the path of a table (csv) of them. [mm]
    values: The values taken at the points: 1 at all unless given here or as a fourth column of the file. [optional]
    delta: δ; one and a half times the mean distance of a point from its nearest neighbour unless given. [mm, above 0,
        optional]
    axis: Direction of projection: each point becomes a line along it. [optional]
    """
    return {"rbf": settings(**control(points), values=values, delta=delta, axis=axis)}
