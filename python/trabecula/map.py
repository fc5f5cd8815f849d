# Made by scripts/builders.py from schema/design.json; do not edit.
"""Maps: position (mm) to phase (turns)."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Literal

from .base.given import control, named, settings

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .base.given import Points, Vector

__all__ = ["affine", "cylinder", "phase", "spartan", "sphere", "sweep", "tets"]


@named
def affine(
    wavelength: float | Vector | None = None,
    rotate: Vector | None = None,
    offset: Vector | None = None,
    skew: dict | None = None,
) -> dict:
    """A rigid rotation of the scaled lattice: u = D Rᵀ (x − offset), D = diag(1/wavelength).

    wavelength: Cell edge, one number or three. Left out where the level has a fraction and a thickness or a pore, from
        which it follows; three numbers are ratios then. [mm, above 0, optional]
    rotate: Angles about x, y, z: z is turned first, then y, then x. [degrees, default [0.0, 0.0, 0.0]]
    offset: Moves the lattice. [mm, default [0.0, 0.0, 0.0]]
    skew: Shears by name, in degrees: xz = 20 moves x by tan(20°) · z. [default {}]
    """
    return {"affine": settings(wavelength=wavelength, rotate=rotate, offset=offset, skew=skew)}


@named
def spartan(wavelength: float | Vector | None = None, rotate: Vector | None = None, offset: Vector | None = None) -> dict:
    """The SPARTAN reading, scaled first and rotated in phase: u = Rᵀ D (x − offset).

    wavelength: Cell edge, one number or three. Left out where the level has a fraction and a thickness or a pore, from
        which it follows; three numbers are ratios then. [mm, above 0, optional]
    rotate: Angles about x, y, z: z is turned first, then y, then x. [degrees, default [0.0, 0.0, 0.0]]
    offset: Moves the lattice. [mm, default [0.0, 0.0, 0.0]]
    """
    return {"spartan": settings(wavelength=wavelength, rotate=rotate, offset=offset)}


@named
def phase(
    wavelength: float | dict | Sequence[float | dict] | Vector | None = None,
    rotate: Sequence[float | dict] | Vector | None = None,
    *,
    weight: float | dict | None = None,
    angle_weight: float | None = None,
    smooth: float | None = None,
    align: Literal["surface"] | None = None,
    align_depth: float | None = None,
    stretch: Vector | None = None,
    fix: Sequence[dict] | None = None,
    core: Literal["solid", "void"] | None = None,
    core_radius: float | None = None,
    offset: Vector | None = None,
    step: float | None = None,
    domain: Literal["region", "box"] | None = None,
    folds: bool | None = None,
    rotate_x: float | dict | None = None,
    rotate_y: float | dict | None = None,
    rotate_z: float | dict | None = None,
    direction: Sequence[float | dict] | Vector | dict | None = None,
    frame: dict | None = None,
    stress: Sequence[float | dict] | Vector | dict | None = None,
) -> dict:
    """Three phases of given orientation R and wavelengths λᵢ, by least squares: ∇Φᵢ = R eᵢ / λᵢ, without tearing. At
    most one of rotate (or rotate_x, rotate_y, rotate_z), direction, frame, stress; without, cells are not turned.

    wavelength: Cell edge, one number or three, along the cell's axes or, { principal = [a, b, c] }, the principal
        directions of the stress; each may vary. Left out where the level has a fraction and a thickness or a pore, from
        which it follows wherever they vary; three numbers are ratios then. [mm, above 0, optional]
    rotate: Angles about x, y, z: z is turned first, then y, then x. Each may vary. [degrees, optional]
    weight: Weight of the cell's shape here, compared with other positions (0 or more): where no map can follow
        everything, the error goes where this is small. [optional]
    angle_weight: Weight of an error of angle against the same error of spacing: where no map can follow both, above 1
        cells are nearer to their directions, below 1 to their sizes. [from 0.001 to 1000, default 1.0]
    smooth: Length over which a direction, a frame or a stress is smoothed before cells follow it, without regard to the
        signs and the order of their axes. Parts of a stress count by how much they differ between directions. None
        unless given. [mm, above 0, optional]
    align: "surface": an axis of the cell, whichever is nearest, along the normal of the region's surface, and farther
        in what is asked for there; without an orientation, what continues the surface's. [optional]
    align_depth: How deep that reaches below the surface; two wavelengths unless given. [mm, above 0, optional]
    stretch: The least and the greatest length of a cell, along any direction, over the one asked for: [0.67, 1.5], say.
        The map is the one nearest to the target that keeps to it; a warning where none is found. Any unless given.
        [optional]
    fix: Regions: on the parts of the surface in each of them the phase along the normal is a whole number, so that the
        lattice ends there with whole cells, as many as fit best, and parts that meet there fit. [default []]
    core: What covers singular lines, round which the stress's or the frame's axes do not come back to themselves:
        "solid" or "void". Outside these cores cells are whole. A cell has to be the same after the turn of the axes;
        singular lines stay bare unless given. [optional]
    core_radius: The radius of the cores; half the wavelength at the lines unless given. [mm, above 0, optional]
    offset: Moves the lattice. [mm, default [0.0, 0.0, 0.0]]
    step: Spacing of the grid that the phases are solved on; a quarter of the least wavelength unless given. [mm, above
        0, optional]
    domain: What counts when the phases are solved. [default "region"]
    folds: Whether the map may fold, where cells turn inside out. [default false]
    rotate_x: The angle about x alone, in addition to or in place of `rotate_y` and `rotate_z`. [degrees, optional]
    rotate_y: The angle about y alone. [degrees, optional]
    rotate_z: The angle about z alone. [degrees, optional]
    direction: Direction of the cell's z axis; its sign and length do not matter. [optional]
    frame: The directions of the cell's x and z axes: { x = [x, y, z], z = [x, y, z] }. Signs that flip from one
        position to the next, and axes of a result that change places, do not matter. [optional]
    stress: A stress tensor whose principal directions the cell's axes take: its components 11, 22, 33, 23, 13, 12, the
        field of a result, a table, or several load cases, { cases = [...] }. [optional]
    """
    given = settings(
        wavelength=wavelength,
        rotate=rotate,
        weight=weight,
        angle_weight=angle_weight,
        smooth=smooth,
        align=align,
        align_depth=align_depth,
        stretch=stretch,
        fix=fix,
        core=core,
        core_radius=core_radius,
        offset=offset,
        step=step,
        domain=domain,
        folds=folds,
        rotate_x=rotate_x,
        rotate_y=rotate_y,
        rotate_z=rotate_z,
        direction=direction,
        frame=frame,
        stress=stress,
    )
    return {"phase": given}


@named
def cylinder(
    wavelength: float | Vector,
    around: int,
    center: Vector | None = None,
    axis: Vector | None = None,
    start: float | None = None,
) -> dict:
    """Wrapped round an axis, a whole number of cells, so that the lattice closes: u = (r/λ, around · θ/2π, z/λ).

    wavelength: Cell edge along the radius and along the axis, one number or two. [mm, above 0]
    around: Number of cells around. [from 1 to 1e+06]
    center: A point on the axis. [mm, default [0.0, 0.0, 0.0]]
    axis: Direction of the axis. [default [0.0, 0.0, 1.0]]
    start: Angle round the axis at which a cell begins, by the right-hand rule: from x if the axis is z, else from the
        coordinate axis that is most normal to it. [degrees, from -360 to 360, default 0.0]
    """
    return {"cylinder": settings(wavelength=wavelength, around=around, center=center, axis=axis, start=start)}


@named
def sphere(wavelength: float, around: int, center: Vector | None = None, axis: Vector | None = None) -> dict:
    """Wrapped about a centre in shells, a whole number of cells round the equator and half as many from pole to pole.

    wavelength: Cell edge along the radius. [mm, above 0]
    around: Number of cells round the equator, even. [from 2 to 1e+06]
    center: The centre. [mm, default [0.0, 0.0, 0.0]]
    axis: Direction from pole to pole. [default [0.0, 0.0, 1.0]]
    """
    return {"sphere": settings(wavelength=wavelength, around=around, center=center, axis=axis)}


@named
def sweep(wavelength: float | Vector, points: Points, closed: bool | None = None, normal: Vector | None = None) -> dict:
    """Along a line, in a frame that does not rotate about it: a cubic spline through control points, straight on beyond
    the ends of an open one; u = (a/λ₁, b/λ₂, s/λ₃), a and b across it, s along it.

    wavelength: Cell edge, one number or three: two across the line and one along it. Along a closed line it is made to
        fit. [mm, above 0]
    points: Points [x, y, z] in order, or the path of a table (csv) of them. [mm]
    closed: Whether the last point is followed by the first. [default false]
    normal: Direction of the cell's x axis at the start, up to its component along the line; chosen if not given.
        [optional]
    """
    return {"sweep": settings(wavelength=wavelength, **control(points), closed=closed, normal=normal)}


@named
def tets(
    size: float | dict | None = None,
    mesher: Literal["background", "ftetwild"] | None = None,
    limit: float | None = None,
    *,
    zones: Mapping[int, dict] | None = None,
    layers: dict | None = None,
    overlap: float | None = None,
    method: Literal["explicit", "implicit"] | None = None,
    surface: Literal["capped", "open", "net", "rounded"] | None = None,
    net: dict | None = None,
    path: str | os.PathLike[str] | None = None,
    unit: Literal["mm", "micron", "cm", "m", "inch", "foot"] | None = None,
    split: bool | None = None,
) -> dict:
    """Piecewise affine over a tetrahedral mesh of the region, made or from a file: a cell in each tetrahedron.

    size: Edge of a regular tetrahedron of the greatest volume that tetrahedra have, a number or a grade. [mm, above 0,
        optional]
    mesher: The program that makes it. [default "background"]
    limit: Time that another mesher than the background one may take. [s, above 0, default 600.0]
    zones: Regions whose tetrahedra, by their middles, are of a zone of this number, such as `{ 1 = { sphere = { radius
        = 5 } } }`; the first of several counts, and all others are of zone 0. [default {}]
    layers: Layers of prisms along the part's surface, each prism cut into three tetrahedra. [optional]
    overlap: Smooths the creases at the faces of tetrahedra: by how much of their barycentric coordinates they reach
        beyond themselves and are mixed with their neighbours, from 0 (creases) to 0.2. [from 0 to 0.2, default 0.0]
    method: How the surface is made. [default "explicit"]
    surface: How the lattice ends at the part's surface. [default "capped"]
    net: The net of surface = "net". [optional]
    path: Path of the file, relative to the design file: vtu, vtk; with the extra "fe" of the Python package also msh,
        inp, med, mesh and others. [optional]
    unit: Unit of the file's coordinates (mm unless given). [optional]
    split: Whether hexahedra, wedges and pyramids are cut into tetrahedra that fit face to face; refused otherwise.
        [default false]
    """
    given = settings(
        size=size,
        mesher=mesher,
        limit=limit,
        zones=zones,
        layers=layers,
        overlap=overlap,
        method=method,
        surface=surface,
        net=net,
        path=None if path is None else os.fspath(path),
        unit=unit,
        split=split,
    )
    return {"tets": given}
