"""Laws of a cell: what it does by its solid fraction, from a few fractions, interpolated."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import numpy as np

from . import _core
from . import beams as unit_cells
from .base.files import extension, write_text
from .base.formats import LAW_WRITES
from .base.given import fixed, number, poisson, positive, thread_count, whole
from .cell import tet_facts, tet_names
from .design import Design
from .errors import DesignError, DesignWarning
from .map import affine, tets
from .region import box

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .solid import Solid

    #: The number of threads, and what is called as the work goes on.
    Work = tuple[int | None, Callable[[int, int], Any] | None]
    #: What is found by column, and what was warned of.
    Found = tuple[dict[str, float | None], list[str]]

__all__ = ["PROPERTIES", "Law", "law", "monotone"]

#: What a law may have, and the columns of each, with what they are. Lengths are in units of the wavelength; of tetrahedral
#: cells, in units of the edge of a regular tetrahedron of the same volume.
PROPERTIES: dict[str, dict[str, str]] = {
    "stiffness": {
        "C11": "stiffness over E of the solid, mean of 11, 22, 33",
        "C12": "mean of 12, 13, 23",
        "C44": "mean of 44, 55, 66",
        "E": "Young's modulus along the axes over that of the solid",
        "G": "shear modulus of the planes of the axes",
        "nu": "Poisson's ratio of the axes",
        "bulk": "bulk modulus",
        "zener": "2 C44 / (C11 - C12)",
        "C_error": "estimated relative error of C",
        "E_error": "estimated relative error of E, the greatest of the axes",
        "G_error": "that of G",
    },
    "conductivity": {
        "k": "conductivity over that of the solid, mean of the axes",
        "k_error": "its estimated relative error, the greatest of the axes",
    },
    "permeability": {
        "K": "permeability of the pore over the wavelength squared, mean of the axes",
        "K_error": "its estimated relative error",
        "diameter": "hydraulic diameter over the wavelength",
        "tortuosity": "porosity over the conductivity of the pore",
    },
    "area": {"area": "area of the wall times the wavelength over the volume of the cell"},
}
#: Powers of the fraction (Gibson and Ashby), fitted to these columns.
FITTED = ("E", "G", "bulk", "k")


@dataclass(frozen=True, eq=False)
class Law:
    """What a cell does by its solid fraction. Columns by name, NaN where there is no such number (see ``notes``)."""

    cell: str
    #: What is solid; ``beams`` of a unit cell of beams.
    part: str
    #: Voxels along the cell.
    n: int
    nu: float
    #: ``fraction``, ascending, and the columns of `PROPERTIES`.
    columns: dict[str, np.ndarray]
    #: By column ``coefficient``, ``exponent`` and ``residual``: column = coefficient fraction^exponent, with the largest
    #: relative difference at the fractions.
    fits: dict[str, dict[str, float]] = field(default_factory=dict)
    #: Why there is no number, or a doubtful one, by fraction.
    notes: dict[float, list[str]] = field(default_factory=dict)
    #: Whether it is a tetrahedral cell.
    tet: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", {name: fixed(np.array(of)) for name, of in self.columns.items()})

    def at(self, column: str, fraction: Any) -> np.ndarray:
        """A column at fractions, by monotone cubics between those it was found at. Raises ValueError outside them."""
        x, y = self._points(column)
        asked = np.asarray(fraction, dtype=float)
        if np.any(asked < x[0]) or np.any(asked > x[-1]):
            raise ValueError(f"{column} is known at fractions from {x[0]:g} to {x[-1]:g}, found {fraction}")
        return monotone(x, y, asked)

    def fraction(self, **asked: float) -> float:
        """The solid fraction at which a column has a value, as in ``law.fraction(E=0.1)``. ValueError where it has none."""
        if len(asked) != 1:
            raise ValueError(f"give one column and its value, found {len(asked)}")
        ((column, value),) = asked.items()
        x, y = self._points(column)
        value = number(column, value)
        if not min(y) <= value <= max(y):
            raise ValueError(f"{column} runs from {min(y):.4g} to {max(y):.4g}, found {value:g}")
        step = next((i for i in range(len(x) - 1) if min(y[i : i + 2]) <= value <= max(y[i : i + 2])), 0)
        low, high = x[step], x[step + 1]
        rising = y[step + 1] >= y[step]
        for _ in range(60):
            middle = 0.5 * (low + high)
            if (monotone(x, y, np.array(middle)) < value) == rising:
                low = middle
            else:
                high = middle
        return float(0.5 * (low + high))

    def _points(self, column: str) -> tuple[np.ndarray, np.ndarray]:
        if column == "fraction" or column not in self.columns:
            known = [name for name in self.columns if name != "fraction"]
            raise ValueError(f"the law has no column {column!r}; it has {', '.join(known)}")
        values = self.columns[column]
        kept = np.isfinite(values)
        if kept.sum() < 2:
            raise ValueError(f"{column} is known at {kept.sum()} fractions; two are needed")
        return self.columns["fraction"][kept], values[kept]

    def to_dict(self) -> dict[str, Any]:
        """As plain data, None where there is no number."""
        plain = {name: [float(v) if np.isfinite(v) else None for v in values] for name, values in self.columns.items()}
        notes = [{"fraction": p, "messages": said} for p, said in self.notes.items()]
        head = {"cell": self.cell, "part": self.part, "tet": self.tet, "n": self.n, "nu": self.nu}
        return head | {"columns": plain, "fits": self.fits, "notes": notes}

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the columns (.csv), all of it (.json), or its plots (.svg)."""
        kind = extension(path, LAW_WRITES)
        if kind == "csv":
            lines = [",".join(self.columns)]
            rows = zip(*self.columns.values(), strict=True)
            lines += [",".join(repr(float(v)) if np.isfinite(v) else "" for v in row) for row in rows]
            text = "\n".join(lines) + "\n"
        elif kind == "json":
            import json

            text = json.dumps(self.to_dict(), indent=1) + "\n"
        else:
            text = self.svg()
        write_text(path, text)

    def svg(self) -> str:
        """Its plots as SVG."""
        from .pictures.curves import law_plots

        return law_plots(self)


def law(
    cell: str,
    part: str | None = None,
    start: float = 0.05,
    stop: float = 0.6,
    count: int = 12,
    n: int = 48,
    nu: float = 0.3,
    properties: Sequence[str] = tuple(PROPERTIES),
    threads: int | None = None,
    progress: Callable[[int, int], Any] | None = None,
    tet: bool = False,
) -> Law:
    """What a named cell, or a unit cell of beams, does by its solid fraction: stiffness over E of a solid of Poisson's ratio
    ``nu``, conductivity over the solid's, permeability over the wavelength squared, area of the wall; at ``count`` fractions
    from ``start`` to ``stop``, each the limit of grids of n, n/2 and n/4 voxels along the cell, with monotone interpolation
    between and powers of the fraction fitted (Gibson and Ashby).

    ``part`` is what is solid: "sheet" (the default), "lower" or "upper" of a named cell, "beams" of a cell of beams (the
    default for names that no other cell has). Of cells with unequal edges the wavelength is the first.

    With ``tet`` it is a tetrahedral cell, in tetrahedra that fill space alike: those of the body-centred cubic lattice, which
    meshes have where no surface is near. Its ``part`` is by default the one that it is meant for, and the unit of length the
    edge of a regular tetrahedron of the same volume, the ``size`` of ``map.tets``.

    ``properties`` names fewer of "stiffness", "conductivity", "permeability", "area". Where a cell falls apart its stiffness is
    NaN, and ``notes`` says so. Raises ValueError for fractions outside 0 to 1 or out of order.
    """
    start, stop = positive("start", start), positive("stop", stop)
    count = whole("count", count, 2, 1000)
    if not start < stop < 1:
        raise ValueError(f"fractions run from {start:g} to {stop:g}; expected ascending ones between 0 and 1")
    if isinstance(properties, str):
        raise TypeError(f"properties must be a list of names, such as [{properties!r}], found {properties!r}")
    n, nu, threads = whole("n", n, 8, 4096), poisson("nu", nu), thread_count(threads)
    for name in properties:
        if name not in PROPERTIES:
            raise ValueError(f"no property {name!r}; there are {', '.join(PROPERTIES)}")
    part = _part_of(cell, part, tet)
    fractions = np.linspace(start, stop, count)
    names = [column for key, columns in PROPERTIES.items() if key in properties for column in columns]
    columns = {"fraction": fractions} | {name: np.full(count, np.nan) for name in names}
    notes: dict[float, list[str]] = {}
    for i, fraction in enumerate(fractions):
        try:
            solid = _solid(cell, part, float(fraction), tet)
        except DesignError as why:
            # Beams of no radius have this fraction.
            if part != "beams":
                raise ValueError(_by_argument(str(why))) from None
            notes[float(fraction)] = [f"no such cell: {_by_argument(str(why))}"]
            continue
        for j, key in enumerate(k for k in PROPERTIES if k in properties):
            done, total = i * len(properties) + j, count * len(properties)
            work = threads, _part(progress, done, total)
            try:
                values, said = _FOUND[key](solid, n, nu, work)
            except ValueError as why:
                values, said = {}, [f"{key}: {_by_argument(str(why))}"]
            for name, value in values.items():
                columns[name][i] = np.nan if value is None else value
            if said:
                notes.setdefault(float(fraction), []).extend(said)
    fits = {name: made for name in FITTED if name in columns and (made := _power(fractions, columns[name]))}
    return Law(cell, part, n, nu, columns, fits, notes, tet)


def _part_of(cell: str, part: str | None, tet: bool) -> str:
    """What is solid. A ValueError for a part that the cell has not, and for a name that is none."""
    if not isinstance(cell, str):
        raise ValueError(
            "a law is of a cell with a name; of one's own take a sweep over its level.fraction with properties "
            '(lt.sweep(…, properties=["stiffness"]))'
        )
    if tet:
        if cell not in tet_names():
            raise ValueError(f"no tetrahedral cell is named {cell!r}; there are {', '.join(tet_names())}")
        meant = tet_facts(cell)["part"]
        if part == "beams":
            raise ValueError("the part of a tetrahedral cell is sheet, lower or upper, found 'beams'")
        return part or meant
    series = [it.name for it in _core.cells()]
    named = cell in series
    part = part or ("beams" if not named and cell in unit_cells.names() else "sheet")
    if part == "beams":
        try:
            unit_cells.cell(cell)
        except KeyError as why:
            raise ValueError(why.args[0]) from None
    elif not named and cell in unit_cells.names():
        raise ValueError(f"{cell} is a cell of beams: its part is 'beams', found {part!r}")
    elif not named:
        near = get_close_matches(cell, [*series, *unit_cells.names()], 1)
        meant = f'; did you mean "{near[0]}"?' if near else "."
        raise ValueError(
            f'cell: unknown cell "{cell:.80}"{meant} Allowed: {", ".join(series)}; of beams {", ".join(unit_cells.names())}; '
            f"tetrahedral, with tet (--tet), {', '.join(tet_names())}"
        )
    return part


def _solid(cell: str, part: str, fraction: float, tet: bool) -> Solid:
    """A cell of wavelength 1, or about 1 in tetrahedra, at a fraction."""
    if tet:
        core = {"cell": {"tet": {"name": cell}}, "part": part, "map": tets(size=1), "level": {"fraction": fraction}}
        design = Design(box(size=[2, 2, 2]), {"core": core})
    elif part == "beams":
        edges = unit_cells.cell(cell)["aspect"]
        shape = [v / edges[0] for v in edges]
        beams = {"cell": cell, "map": affine(wavelength=shape), "fraction": fraction}
        design = Design(box(size=shape), beams={"core": beams})
    else:
        core = {"cell": cell, "part": part, "map": affine(wavelength=1.0), "level": {"fraction": fraction}}
        design = Design(box(size=[1, 1, 1]), {"core": core})
    with warnings.catch_warnings():
        # That a cell falls apart is said by its properties, in ``notes``.
        warnings.simplefilter("ignore", DesignWarning)
        return design.build()


def _by_argument(message: str) -> str:
    """A message on the design of a cell, which nobody wrote: by the argument in place of the key."""
    key, _, said = message.partition(": ")
    found = re.fullmatch(r"(?:lattice|beams)\.core\.(cell|part|level|fraction)(?:\.\w+)*", key)
    if not found:
        return message
    return f"{'fraction' if found[1] == 'level' else found[1]}: {said}"


def _part(progress: Callable[[int, int], Any] | None, done: int, total: int) -> Callable[[int, int], Any] | None:
    """The progress of one of ``total`` pieces of work."""
    if progress is None:
        return None
    return lambda at, of: progress(round(1e6 * (done + at / max(of, 1))), 1_000_000 * total)


def _unit(solid: Solid) -> float:
    """The unit of length: 1, or in tetrahedra, twelve of which fill the cell, the edge of a regular one of the same volume."""
    tilings = [it for it in solid.report().lattices.values() if it.tets is not None]
    return (solid._cell.volume / np.sqrt(2)) ** (1 / 3) if tilings else 1.0


def _mean(values: Sequence[float] | np.ndarray) -> float:
    return float(np.mean(values))


def _stiffness(solid: Solid, n: int, nu: float, work: Work) -> Found:
    found = solid.stiffness(n, 1.0, nu, None, False, *work)
    c = np.array(found.C)
    made: dict[str, float | None] = {
        "C11": _mean(c[[0, 1, 2], [0, 1, 2]]),
        "C12": _mean(c[[0, 0, 1], [1, 2, 2]]),
        "C44": _mean(c[[3, 4, 5], [3, 4, 5]]),
        "C_error": found.error,
        "zener": found.zener,
        "bulk": found.bulk,
    }
    if found.E and found.G and found.nu and found.E_error and found.G_error:
        made |= {"E": _mean(found.E), "G": _mean(found.G), "nu": _mean(found.nu)}
        made |= {"E_error": max(found.E_error), "G_error": max(found.G_error)}
    return made, [f"stiffness: {w['message']}" for w in found.warnings]


def _conductivity(solid: Solid, n: int, _: float, work: Work) -> Found:
    found = solid.conductivity(n, 0.0, False, *work)
    made: dict[str, float | None] = {"k": _mean(np.diag(found.k)), "k_error": max(found.axis_errors)}
    return made, [f"conductivity: {w['message']}" for w in found.warnings]


def _permeability(solid: Solid, n: int, _: float, work: Work) -> Found:
    found = solid.permeability(n, None, *work)
    unit = _unit(solid)
    made = {
        "K": _mean(np.diag(found.k)) / unit**2,
        "K_error": found.error,
        "diameter": found.hydraulic_diameter and found.hydraulic_diameter / unit,
        "tortuosity": found.tortuosity,
    }
    return made, [f"permeability: {w['message']}" for w in found.warnings]


def _area(solid: Solid, n: int, _: float, work: Work) -> Found:
    return {"area": solid._cell.area(n, work[0]) / solid._cell.volume * _unit(solid)}, []


_FOUND: dict[str, Callable[[Solid, int, float, Work], Found]] = {
    "stiffness": _stiffness,
    "conductivity": _conductivity,
    "permeability": _permeability,
    "area": _area,
}


def _power(x: np.ndarray, y: np.ndarray) -> dict[str, float] | None:
    """The power of x nearest to y in the squares of the logarithms, and its largest relative difference."""
    kept = np.isfinite(y) & (y > 0)
    if kept.sum() < 3:
        return None
    x, y = x[kept], y[kept]
    exponent, constant = np.polyfit(np.log(x), np.log(y), 1)
    off = np.exp(constant) * x**exponent / y - 1
    return {
        "coefficient": float(np.exp(constant)),
        "exponent": float(exponent),
        "residual": float(np.abs(off).max()),
    }


def monotone(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values at positions (n,) or () of the piecewise cubic through points (x, y) of ascending x that has no extremum between
    them (Fritsch and Carlson 1980); beyond the ends the value there.
    """
    positions = np.asarray(at, dtype=float)
    found = _core.monotone(np.column_stack([x, y]).tolist(), positions.ravel().tolist())
    return np.array(found).reshape(positions.shape)
