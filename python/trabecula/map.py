"""Maps: position (mm) to phase (turns)."""

from __future__ import annotations

from collections.abc import Sequence

from .given import settings

__all__ = ["affine", "spartan"]


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
