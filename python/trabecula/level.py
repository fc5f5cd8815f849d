"""Levels: how much of the cell is solid. Every amount is a number or a grade."""

from __future__ import annotations

__all__ = ["fraction", "iso", "porosity"]

Amount = float | dict


def iso(value: Amount) -> dict:
    """The field value t: sheet |f| ≤ t, lower f ≤ t, upper f ≥ t."""
    return {"iso": value}


def fraction(value: Amount, of: str = "cell", fit: str = "table") -> dict:
    """The solid volume fraction, between 0 and 1, of the periodic cell (``of="cell"``) or of the finished part
    (``of="part"``, solved for).

    ``fit="spartan"`` uses the SPARTAN polynomial instead of the cell's own distribution (part ``lower``; diamond,
    gyroid).
    """
    return _level("fraction", value, of, fit)


def porosity(value: Amount, of: str = "cell", fit: str = "table") -> dict:
    """One minus the solid fraction; see ``fraction``."""
    return _level("porosity", value, of, fit)


def _level(key: str, value: Amount, of: str, fit: str) -> dict:
    made: dict = {key: value}
    if of != "cell":
        made["of"] = of
    if fit != "table":
        made["fit"] = fit
    return made
