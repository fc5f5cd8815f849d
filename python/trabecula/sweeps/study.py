"""Studies: the designs that a sweep makes of one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..base.given import copied
from ..base.varying import check_values, explained
from ..design import Design
from ..errors import DesignError
from .conditions import condition
from .sampling import latin, sobol

__all__ = ["Study"]

#: Designs that are tried for one that keeps the conditions, for each that is asked for.
PATIENCE = 1000


def _where(text: str) -> Callable[[Mapping[str, Any]], bool]:
    """A condition of a study, whose errors say so."""
    try:
        holds = condition(text)
    except ValueError as error:
        raise ValueError(f"sweep.where: {error}") from None

    def checked(values: Mapping[str, Any]) -> bool:
        try:
            return holds(values)
        except ValueError as error:
            raise ValueError(f"sweep.where: {error}") from None

    return checked


@dataclass(frozen=True)
class Study:
    """A design and what varies in it, as its table ``sweep`` says.

    Raises ValueError for a design without that table, and DesignError for one that is none.
    """

    design: Design

    def __post_init__(self) -> None:
        if not self.design.sweep:
            raise ValueError(
                'nothing varies: the design has no [sweep]; give it one, such as "lattice.core.level.fraction" = [0.2, 0.3]'
            )
        check_values(self._sweep)
        try:
            self.design._checked()
        except DesignError as error:
            raise explained(error, self.design.to_dict()) from None

    @cached_property
    def _sweep(self) -> dict[str, Any]:
        """The table as plain data."""
        return copied(self.design.sweep)

    @property
    def settings(self) -> dict[str, Any]:
        """How values are chosen: sampling, count, seed, where."""
        given = {key: self._sweep[key] for key in ("sampling", "count", "seed", "where") if key in self._sweep}
        return {"sampling": "grid", "count": None, "seed": 0, "where": []} | given

    @property
    def parameters(self) -> dict[str, list | dict]:
        """The values of each path, by name: a list, or a range {from, to, count, scale}."""
        return {path: of for path, of in sorted(self._sweep.items()) if path not in self.settings}

    def size(self) -> int:
        """The number of designs, or of those of a grid before conditions."""
        if self.settings["sampling"] != "grid":
            return self.settings["count"]
        return math.prod(len(of) if isinstance(of, list) else of["count"] for of in self.parameters.values())

    def points(self) -> Iterator[dict[str, Any]]:
        """The values of each path, design by design: of a grid the last path varies fastest.

        Raises ValueError for conditions that no design keeps, or of random ones fewer than asked for, and for what is no
        condition.
        """
        conditions = [(text, _where(text)) for text in self.settings["where"]]
        plain = _by_path(self.design.to_dict())
        wanted = self.settings["count"] if self.settings["count"] is not None else math.inf
        found, missed = 0, ""
        for point in self._all(1 if not conditions else PATIENCE):
            known = plain | {key: value for path, of in point.items() for key, value in _by_path(of, path).items()} | point
            missed = next((text for text, holds in conditions if not holds(known)), "")
            if missed:
                continue
            found += 1
            yield point
            if found >= wanted:
                return
        if not found:
            raise ValueError(f'sweep.where: no design keeps the conditions; the last one missed "{missed}"')
        if found < wanted and self.settings["sampling"] != "grid":
            raise ValueError(
                f"sweep.where: {found} of {PATIENCE * wanted} random designs keep the conditions, {wanted} are asked for; "
                "narrow the ranges, or ask for fewer"
            )

    def _all(self, patience: int) -> Iterator[dict[str, Any]]:
        """The points before conditions; of random ones up to ``patience`` times as many as are asked for."""
        paths, values = list(self.parameters), list(self.parameters.values())
        settings = self.settings
        if settings["sampling"] == "grid":
            for point in itertools.product(*map(_listed, values)):
                yield dict(zip(paths, point, strict=True))
            return
        if settings["sampling"] == "sobol":
            places = sobol(settings["count"] * patience, len(paths), settings["seed"])
        else:
            # One hypercube after the other: each is whole, so that conditions take what they take out of whole ones.
            cubes = (latin(settings["count"], len(paths), settings["seed"] + i) for i in range(patience))
            places = itertools.chain.from_iterable(cubes)
        for place in places:
            yield {path: _at(of, u) for path, of, u in zip(paths, values, place, strict=True)}

    def varied(self, point: Mapping[str, Any]) -> Design:
        """The design at a point. Raises DesignError if it is none."""
        from ..design import parsed

        core = self.design._checked().varied(list(point.items()))
        return parsed(core.to_json(), True, "", self.design.folder or "")


def _listed(of: list | dict) -> list:
    """The values of a path in a grid."""
    if isinstance(of, list):
        return of
    return [_at(of, i / (of["count"] - 1)) for i in range(of["count"])]


def _at(of: list | dict, u: float) -> Any:
    """The value at ``u`` from 0 to 1 of a list, in equal parts, or of a range."""
    if isinstance(of, list):
        return of[min(int(u * len(of)), len(of) - 1)]
    low, high = of["from"], of["to"]
    if u in (0.0, 1.0):
        return high if u else low
    # Twelve digits: what was meant by 0.1 to 0.5 in five steps, and far below what any design can show.
    value = low * (high / low) ** u if of.get("scale") == "log" else low + u * (high - low)
    return float(f"{value:.12g}")


def _by_path(data: Any, path: str = "") -> dict[str, Any]:
    """Every single value of plain data by its path."""
    if isinstance(data, Mapping):
        below = (_by_path(item, f"{path}.{key}" if path else key) for key, item in data.items() if path or key != "sweep")
    elif isinstance(data, list | tuple):
        below = (_by_path(item, f"{path}[{i}]") for i, item in enumerate(data))
    else:
        return {path: data}
    return {key: value for part in below for key, value in part.items()}
