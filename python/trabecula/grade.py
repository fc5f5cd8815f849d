"""Grades: numbers that vary in space, accepted where a level's amount stands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from .given import copied, plain

__all__ = ["depth", "formula", "linear"]

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


def _stops(stops: Stops) -> list:
    return sorted(stops.items()) if isinstance(stops, Mapping) else stops if hasattr(stops, "tolist") else list(stops)
