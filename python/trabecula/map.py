"""Maps: position (mm) to phase (turns)."""

from __future__ import annotations

from collections.abc import Sequence

from .given import settings

__all__ = ["affine", "cylinder", "phase", "spartan", "sphere", "sweep", "tets"]


def affine(
    wavelength: float | Sequence[float],
    rotate: Sequence[float] | None = None,
    offset: Sequence[float] | None = None,
    skew: dict[str, float] | None = None,
) -> dict:
    """A rigid rotation of the scaled lattice: u = D Rᵀ (x − offset), D = diag(1/wavelength).

    ``wavelength`` is the cell's edge in mm, one or three; ``rotate`` the angles about x, y, z in degrees (z is turned
    first); ``offset`` moves the lattice (mm); ``skew`` names shears in degrees: ``{"xz": 20}`` moves x by tan 20° · z.
    """
    return {"affine": settings(wavelength=wavelength, rotate=rotate, offset=offset, skew=skew)}


def spartan(
    wavelength: float | Sequence[float],
    rotate: Sequence[float] | None = None,
    offset: Sequence[float] | None = None,
) -> dict:
    """The SPARTAN note's reading, scaled first and rotated in phase: u = Rᵀ D (x − offset).

    With unequal wavelengths this shears the lattice in space; ``affine`` turns it rigidly.
    """
    return {"spartan": settings(wavelength=wavelength, rotate=rotate, offset=offset)}


def phase(
    wavelength: float | dict | Sequence[float | dict],
    rotate: Sequence[float | dict] | None = None,
    *,
    rotate_x: float | dict | None = None,
    rotate_y: float | dict | None = None,
    rotate_z: float | dict | None = None,
    direction: Sequence[float | dict] | None = None,
    frame: dict | None = None,
    stress: Sequence[float | dict] | dict | None = None,
    weight: dict | None = None,
    angle_weight: float | None = None,
    offset: Sequence[float] | None = None,
    step: float | None = None,
    domain: str | None = None,
    folds: bool | None = None,
) -> dict:
    """Cells that turn and stretch as asked for without tearing: phases with ∇Φᵢ = R eᵢ / λᵢ in least squares.

    Every number may be a grade. Cells are turned by ``rotate`` (three angles in degrees; or ``rotate_x``, ``rotate_y``,
    ``rotate_z``), ``direction`` (a vector for the cell's z axis), ``frame`` (``{"x": …, "z": …}``) or ``stress`` (the
    components 11, 22, 33, 23, 13, 12 of a tensor whose principal directions the axes take). ``weight`` says how much it
    matters where: what no map can follow is left to where it is small. ``angle_weight`` is what an error of angle counts for
    the same error of spacing: above 1 cells are nearer to their directions, below 1 to their sizes. ``step`` is the spacing
    in mm of the grid that is solved on; ``domain`` is "region" or "box"; ``folds=True`` allows cells to turn inside out.
    """
    given = settings(
        wavelength=wavelength,
        rotate=rotate,
        rotate_x=rotate_x,
        rotate_y=rotate_y,
        rotate_z=rotate_z,
        direction=direction,
        frame=frame,
        stress=stress,
        weight=weight,
        angle_weight=angle_weight,
        offset=offset,
        step=step,
        domain=domain,
        folds=folds,
    )
    return {"phase": given}


def cylinder(
    wavelength: float | Sequence[float],
    around: int,
    center: Sequence[float] | None = None,
    axis: Sequence[float] | None = None,
) -> dict:
    """Cells round an axis, ``around`` of them, so that the lattice closes: u = (r/λ, around · θ/2π, z/λ).

    ``wavelength`` is the cell's edge in mm along the radius and along the axis, one or two.
    """
    return {"cylinder": settings(wavelength=wavelength, around=around, center=center, axis=axis)}


def sphere(
    wavelength: float,
    around: int,
    center: Sequence[float] | None = None,
    axis: Sequence[float] | None = None,
) -> dict:
    """Shells of cells about a centre, ``around`` (even) of them round the equator and half as many from pole to pole."""
    return {"sphere": settings(wavelength=wavelength, around=around, center=center, axis=axis)}


def sweep(
    wavelength: float | Sequence[float],
    points: Sequence[Sequence[float]] | str,
    closed: bool | None = None,
    normal: Sequence[float] | None = None,
) -> dict:
    """Cells along a line, in a frame that does not rotate about it: u = (a/λ₁, b/λ₂, s/λ₃), a and b across it, s along it.

    ``points`` are control points (mm) of a cubic spline, or the path of a table of them (csv); ``closed=True`` joins the last
    with the first, with a whole number of cells around. ``normal`` is where the first edge points at the start. A region in
    which the lattice would fold or tear is refused.
    """
    line = {"path": points} if isinstance(points, str) else {"points": [list(p) for p in points]}
    return {"sweep": settings(wavelength=wavelength, **line, closed=closed, normal=normal)}


def tets(
    size: float | dict | None = None,
    mesher: str | None = None,
    limit: float | None = None,
    *,
    zones: dict[int, dict] | None = None,
    path: str | None = None,
    unit: str | None = None,
    split: bool | None = None,
    overlap: float | None = None,
    method: str | None = None,
) -> dict:
    """A cell in each tetrahedron of a mesh of the region, made or read.

    Made: ``size`` is the edge (mm, a number or a grade) of a regular tetrahedron of the volume they are to have, ``mesher``
    is "background" (ours, takes any region) or "ftetwild" (in the extra ``tets``, takes soups), ``limit`` the seconds that
    the latter may take, ``zones`` regions by number: a tetrahedron is of the first that has its middle, else of zone 0, and
    ``cell.tet(zones=…)`` names a cell for each. Read: ``path`` (vtu, vtk; with the extra ``fe`` msh, inp, med, mesh …),
    ``unit`` of its coordinates, ``split=True`` to have hexahedra, wedges and pyramids cut into tetrahedra.

    ``overlap`` smooths the creases at the faces of tetrahedra, from 0 (creases) to 0.2. ``method`` is "explicit", in each
    tetrahedron apart, which is fast and needs no grid, or "implicit", on a grid like other lattices.
    """
    given = settings(size=size, mesher=mesher, limit=limit, path=path, unit=unit, split=split, overlap=overlap, method=method)
    if zones is not None:
        given["zones"] = {str(zone): region for zone, region in zones.items()}
    return {"tets": given}
