"""Grades: numbers that vary in space, accepted where a level's amount or a number of a phase map stands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from .given import copied, plain, settings

__all__ = ["depth", "distance", "field", "formula", "grid", "linear", "points", "radial", "rbf", "region", "sigmoid"]

Stops = Mapping[float, float] | Iterable[Sequence[float]]


def linear(along: Sequence[float], stops: Stops) -> dict:
    """Piecewise linear in s = along · x, constant beyond the ends; ``stops`` is {s: value} or [(s, value), ...]."""
    return {"linear": {"along": plain(along), "stops": copied(_stops(stops))}}


def depth(stops: Stops) -> dict:
    """Piecewise linear in the depth (mm) below the region's surface; ``stops`` is {depth: value} or pairs."""
    return {"depth": {"stops": copied(_stops(stops))}}


def formula(text: str) -> dict:
    """A formula in x, y, z (mm), such as "0.3 + 0.1*sin(x/5)"; parsed, never run as code."""
    return {"formula": text}


def radial(stops: Stops, center: Sequence[float] | None = None, axis: Sequence[float] | None = None) -> dict:
    """Piecewise linear in the distance (mm) from a point, or from the line through it along ``axis``; constant beyond."""
    given = settings(center=center, axis=axis)
    return {"radial": {**given, "stops": copied(_stops(stops))}}


def grid(
    path: str,
    origin: Sequence[float] | None = None,
    step: float | Sequence[float] | None = None,
    array: str | None = None,
    remap: Stops | None = None,
) -> dict:
    """Numbers on a grid from a file: npy (with the ``origin`` of the first number and the ``step``, mm), vti, vtk; or from
    grey pictures one above the other, png or tif ("scan/*.png", with ``origin`` and ``step``).

    ``remap`` says what they stand for: {number: value} or pairs, linear between. A ``path`` is relative to the design's
    folder.
    """
    return {"grid": settings(path=path, origin=origin, step=step, array=array, remap=_remap(remap))}


def points(path: str, neighbours: int | None = None, remap: Stops | None = None) -> dict:
    """Numbers at scattered points from a table (csv) of x, y, z (mm), value: the mean of the nearest ``neighbours``."""
    return {"points": settings(path=path, neighbours=neighbours, remap=_remap(remap))}


def field(path: str, array: str, component: int | None = None, remap: Stops | None = None) -> dict:
    """An array of points or cells of a result on a mesh (vtu, vtk) or a grid (vti, vtk)."""
    return {"field": settings(path=path, array=array, component=component, remap=_remap(remap))}


def sigmoid(of: float | dict, width: float, at: float = 0.0) -> dict:
    """A smooth step (the logistic function, with ends) from 0 to 1 as the grade ``of`` rises through ``at``, over ``width`` in
    its unit; a negative width falls."""
    return {"sigmoid": {"of": of, "width": width} | ({"at": at} if at else {})}


def region(of: dict, width: float) -> dict:
    """1 inside a region (from the builders of ``trabecula.region``) and 0 outside, with a smooth step of ``width`` mm."""
    return {"region": {"of": of, "width": width}}


def distance(
    points: Iterable[Sequence[float]] | str,
    closed: bool = False,
    axis: Sequence[float] | None = None,
    sharpness: float | None = None,
) -> dict:
    """Distance (mm) to a line through control points: [x, y, z] in order, or the path of a table (csv) of them.

    With an ``axis`` all is seen along it, and inside a ``closed`` line distances are negative. ``sharpness`` (at least 10)
    asks for the smooth form instead of the exact one.
    """
    given = settings(axis=axis, sharpness=sharpness) | ({"closed": True} if closed else {})
    return {"distance": _control(points) | given}


def rbf(
    points: Iterable[Sequence[float]] | str,
    values: Sequence[float] | None = None,
    delta: float | None = None,
    axis: Sequence[float] | None = None,
) -> dict:
    """Gaussian radial basis functions that take ``values`` (1 unless given) at control points; ``delta`` (mm) is their width.

    ``points`` are [x, y, z] or the path of a table (csv) of x, y, z, or x, y, z, value.
    """
    return {"rbf": _control(points) | settings(values=values, delta=delta, axis=axis)}


def _control(points: Iterable[Sequence[float]] | str) -> dict:
    if isinstance(points, str) or hasattr(points, "__fspath__"):
        return {"path": points}
    return {"points": copied(points if hasattr(points, "tolist") else [list(p) for p in points])}


def _remap(remap: Stops | None) -> list | None:
    return None if remap is None else copied(_stops(remap))


def _stops(stops: Stops) -> list:
    return sorted(stops.items()) if isinstance(stops, Mapping) else stops if hasattr(stops, "tolist") else list(stops)
