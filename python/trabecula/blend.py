"""Blends: several lattices in one part, and which of them is where."""

from __future__ import annotations

from collections.abc import Mapping

from .base.given import named

__all__ = ["between", "of"]


@named
def between(first: str, second: str, weight: float | dict, by: str = "fraction") -> dict:
    """Two lattices: ``weight`` (a grade) is the share of the second, from 0 to 1; what is below or above counts as 0 or 1.

    ``by="fraction"`` keeps the solid fractions that were asked for all the way across; ``by="value"`` is the weighted sum
    of the fields as it comes, which loses material half-way.
    """
    return {"between": [first, second], "weight": weight} | _by(by)


@named
def of(weights: Mapping[str, float | dict], by: str = "fraction") -> dict:
    """Any number of lattices: ``weights`` is {name: weight}, numbers or grades, divided by their sum."""
    return {"of": dict(weights)} | _by(by)


def _by(by: str) -> dict:
    return {} if by == "fraction" else {"by": by}
