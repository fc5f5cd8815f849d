"""``trabecula stiffness``, ``conductivity``, ``permeability``, ``law``: what a periodic cell does, printed and written."""

from __future__ import annotations

import csv
import io
import re
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from ..base.files import check_place, read_text, write_text
from ..base.formats import kind_of
from ..base.terminal import Progress, figure, say, warn
from ..errors import Refused, WrongUsage
from ..io.cards import CARDS
from ..reports import ConductivityReport, PermeabilityReport, StiffnessReport
from ..solid import Solid
from .inputs import build, keep_file
from .moduli import SURFACE_WRITES, write_surface

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..laws import Law

__all__ = ["LINES", "conductivity", "law", "lines_of_law", "permeability", "stiffness"]

#: What is found of a cell.
Found = StiffnessReport | ConductivityReport | PermeabilityReport

#: The pairs of axes in Voigt's order.
AXES = ("11", "22", "33", "23", "13", "12")


def stiffness(args: Namespace) -> StiffnessReport:
    """The stiffness that is asked for; written where a file is named."""
    if args.C and (args.E, args.nu) != (None, None):
        raise WrongUsage("--C is the stiffness of a solid, --E and --nu are those of an isotropic one: give one of both")
    given = stiffness_of_file(args.C) if args.C else None
    E, nu = 1.0 if args.E is None else args.E, 0.3 if args.nu is None else args.nu
    solid = placed(args)
    try:
        with Progress("stiffness", args.progress) as progress:
            found = solid.stiffness(args.n, E, nu, given, args.voxels, args.threads, progress)
    except ValueError as error:
        if given and str(error).startswith("C: "):
            raise Refused(f"{args.C}: {str(error)[3:]}") from None
        raise
    for name in args.output or ():
        kind = kind_of(name)
        if kind in SURFACE_WRITES:
            write_surface(name, found.C)
        else:
            of = f"of the stiffness in {args.C}" if args.C else f"E = {E:g}, nu = {nu:g}"
            title = f"effective stiffness of {args.design}, solid {of}, fraction {found.fraction:.6g}"
            write_text(name, CARDS[kind](found, title) if kind in CARDS else table(rows_of_stiffness(found)))
    say_found(found, args)
    return found


def stiffness_of_file(name: str) -> list[list[float]]:
    """Six rows of six numbers by commas, semicolons or spaces, a row on each line; what follows # is a comment.

    Raises Refused with the line of what is none.
    """
    rows = []
    for number, line in enumerate(read_text(name).splitlines(), 1):
        words = re.split(r"\s*[,;]\s*|\s+", line.partition("#")[0].strip())
        if words == [""]:
            continue
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            raise Refused(f"{name}:{number}: expected 6 numbers, found {line.strip()!r:.80}") from None
        if len(words) != 6:
            raise Refused(f"{name}:{number}: expected 6 numbers, found {len(words)}")
    if len(rows) != 6:
        raise Refused(f"{name}: expected 6 lines of 6 numbers, in Voigt's order 11 22 33 23 13 12, found {len(rows)}")
    return rows


def conductivity(args: Namespace) -> ConductivityReport:
    """The conductivity that is asked for; written where a file is named."""
    solid = placed(args)
    with Progress("conductivity", args.progress) as progress:
        found = solid.conductivity(args.n, args.pore, args.voxels, args.threads, progress)
    for name in args.output or ():
        write_text(name, table(rows_of_conductivity(found)))
    say_found(found, args)
    return found


def permeability(args: Namespace) -> PermeabilityReport:
    """The permeability that is asked for; written where a file is named."""
    solid = placed(args)
    with Progress("permeability", args.progress) as progress:
        found = solid.permeability(args.n, args.side, args.threads, progress)
    for name in args.output or ():
        write_text(name, table(rows_of_permeability(found)))
    say_found(found, args)
    return found


def law(args: Namespace) -> Law:
    """The law that is asked for; written where files are named."""
    from .. import laws

    for name in args.output or ():
        check_place(name)
    with Progress("law", args.progress) as progress:
        settings = args.start, args.stop, args.count, args.n, args.nu, tuple(args.properties)
        found = laws.law(args.cell, args.part, *settings, args.threads, progress, args.tet)
    for fraction, messages in found.notes.items():
        for message in messages:
            warn(message, f"fraction {fraction:.4g}", not args.json)
    for name in args.output or ():
        found.write(name)
        say(f"{name}: written")
    return found


def placed(args: Namespace) -> Solid:
    """The solid of the design, after the outputs' places have been checked."""
    for name in args.output or ():
        check_place(name)
        for read in filter(None, (args.design, getattr(args, "C", None))):
            keep_file(read, name)
    return build(args.design, tell=not args.json)


def say_found(found: Found, args: Namespace) -> None:
    """Says warnings and what was written."""
    for warning in found.warnings:
        warn(warning["message"], warning["path"], not args.json)
    for name in args.output or ():
        say(f"{name}: written")


class Row(NamedTuple):
    """A figure of a report by its name there, and what is known of it; errors are relative."""

    figure: str
    value: float | None
    unit: str = ""
    row: str = ""
    column: str = ""
    at_n: float | None = None
    error: float | None = None
    bounds: Sequence[float] | None = None


def table(rows: Iterable[Row]) -> str:
    """Figures as CSV, a row for each that there is."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["figure", "row", "column", "value", "at_n", "error", "lower_bound", "upper_bound", "unit"])
    for it in rows:
        if it.value is not None:
            writer.writerow([it.figure, it.row, it.column, it.value, it.at_n, it.error, *(it.bounds or ("", "")), it.unit])
    return out.getvalue()


def entries(
    figure: str,
    limit: Sequence[Sequence[float]] | None,
    finest: Sequence[Sequence[float]] | None,
    names: Sequence[str],
    errors: Sequence[float] | None = None,
    unit: str = "",
) -> Iterator[Row]:
    """The entries of a tensor, with those of the finest grid and the errors of the diagonal."""
    for i, row in enumerate(limit or ()):
        for j, value in enumerate(row):
            error = errors[i] if errors and i == j else None
            yield Row(figure, value, unit, names[i], names[j], finest[i][j] if finest else None, error)


def rows_of_stiffness(found: StiffnessReport) -> Iterator[Row]:
    """C, the constants of engineers, and how sure they are."""
    yield from entries("C", found.C, found.C_n, AXES)
    for name, values, errors, of in (
        ("E", found.E, found.E_error, "123"),
        ("G", found.G, found.G_error, AXES[3:]),
        ("nu", found.nu, None, AXES[3:]),
    ):
        for i, value in enumerate(values or ()):
            yield Row(name, value, row=of[i], error=errors[i] if errors else None)
    yield Row("bulk", found.bulk, bounds=found.bulk_bounds)
    yield Row("shear", found.shear, bounds=found.shear_bounds)
    yield from plainly(found, "zener", "anisotropy", "error", "fraction", "n", "residual", "wall_voxels")


def rows_of_conductivity(found: ConductivityReport) -> Iterator[Row]:
    """k, its mean with bounds, and how sure it is."""
    yield from entries("k", found.k, found.k_n, "123", found.axis_errors)
    yield Row("mean", sum(found.k[i][i] for i in range(3)) / 3, bounds=found.bounds)
    yield from plainly(found, "pore", "error", "fraction", "n", "residual", "wall_voxels")


def rows_of_permeability(found: PermeabilityReport) -> Iterator[Row]:
    """k, what else is known of the pore, and how sure it is."""
    yield from entries("k", found.k, found.k_n, "123", found.axis_errors, "mm²")
    yield from entries("k_cell", found.k_cell, None, "123")
    yield from plainly(found, "hydraulic_diameter", unit="mm")
    yield from plainly(found, "area_per_volume", unit="1/mm")
    yield from plainly(found, "porosity", "tortuosity", "kozeny", "error", "fraction", "n", "residual", "pore_nodes")


def plainly(found: Found, *figures: str, unit: str = "") -> Iterator[Row]:
    """Figures that are one number."""
    for name in figures:
        yield Row(name, getattr(found, name), unit)


def matrix(rows: Sequence[Sequence[float]], names: Sequence[str]) -> list[str]:
    """A matrix in lines, its entries to six digits of the largest."""
    largest = max(abs(v) for row in rows for v in row) or 1.0
    texts = [[figure(v, 1e-6 * largest) for v in row] for row in rows]
    wide = max(len(text) for row in texts for text in row)
    return ["    " + " ".join(name.rjust(wide) for name in names)] + [
        f"{name:>3} " + " ".join(text.rjust(wide) for text in row) for name, row in zip(names, texts, strict=True)
    ]


def ranged(bounds: Sequence[float] | None) -> str:
    """Bounds in words."""
    return "" if bounds is None else f" (Hashin-Shtrikman {figure(bounds[0])} to {figure(bounds[1])})"


def accuracy(found: Found, size: str) -> list[str]:
    """How the figures were found, and how sure they are."""
    grids = ", ".join(" x ".join(map(str, g.shape)) for g in found.grids)
    if isinstance(found, PermeabilityReport):
        walls = "" if found.pore_nodes is None else f"; {found.pore_nodes:.3g} steps across the hydraulic diameter"
    else:
        walls = "" if found.wall_voxels is None else f"; {found.wall_voxels:.3g} voxels across the thinnest wall"
    single = ""
    if isinstance(found, StiffnessReport) and found.E_error and found.G_error:
        single = f", E up to {100 * max(found.E_error):.2g} %, G up to {100 * max(found.G_error):.2g} %"
    elif isinstance(found, ConductivityReport | PermeabilityReport):
        single = f", along an axis up to {100 * max(found.axis_errors):.2g} %"
    return [
        f"fraction   {found.fraction:.6f}",
        f"accuracy   at n = {found.n} {size} is {100 * found.error:.2g} % off the limit given{single}; grids of {grids}",
        f"solved     to a relative residual of {found.residual:.1e} in at most {found.iterations} iterations{walls}",
    ]


def lines_of_stiffness(found: StiffnessReport) -> list[str]:
    """The figures for people."""
    lines = ["C, Voigt's order 11 22 33 23 13 12, engineering shears:", *matrix(found.C, AXES)]

    def three(word: str, values: Sequence[float] | None, axes: Sequence[str]) -> None:
        if values is not None:
            lines.append(f"{word:<11}" + "  ".join(f"{a}: {figure(v)}" for a, v in zip(axes, values, strict=True)))

    three("E", found.E, ("1", "2", "3"))
    three("G", found.G, AXES[3:])
    three("nu", found.nu, AXES[3:])
    rest: list[tuple[str, float | None, str]] = [
        ("bulk", found.bulk, ranged(found.bulk_bounds)),
        ("shear", found.shear, ", mean over orientations" + ranged(found.shear_bounds)),
        ("zener", found.zener, ""),
        ("anisotropy", found.anisotropy, ", universal; 0 is isotropic"),
    ]
    lines += [f"{word:<11}{figure(v)}{more}" for word, v, more in rest if v is not None]
    return lines + accuracy(found, "C")


def lines_of_conductivity(found: ConductivityReport) -> list[str]:
    """The figures for people."""
    mean = sum(found.k[i][i] for i in range(3)) / 3
    lines = ["k, relative to the solid's:", *matrix(found.k, "123")]
    return [*lines, f"mean       {figure(mean)}{ranged(found.bounds)}", *accuracy(found, "k")]


def lines_of_permeability(found: PermeabilityReport) -> list[str]:
    """The figures for people."""
    of = "" if found.side is None else f" of the {found.side} side"
    lines = [f"k{of}, mm²:", *matrix(found.k, "123")]
    rest: list[tuple[str, float | None, str]] = [
        ("k / cell²", None if found.k_cell is None else sum(found.k_cell[i][i] for i in range(3)) / 3, ", mean of the axes"),
        ("diameter", found.hydraulic_diameter, " mm, hydraulic: 4 volume / area"),
        ("area", found.area_per_volume, " mm² of wall a mm³ of the cell"),
        ("porosity", found.porosity, ""),
        ("tortuosity", found.tortuosity, ", porosity / conductivity of the pore"),
        ("kozeny", found.kozeny, ", porosity³ / (k area²)"),
    ]
    lines += [f"{word:<11}{figure(v)}{more}" for word, v, more in rest if v is not None]
    return lines + accuracy(found, "k")


#: Columns of a law that are printed; all are written.
PRINTED = ("fraction", "E", "G", "nu", "zener", "k", "K", "tortuosity", "area")


def lines_of_law(found: Law) -> list[str]:
    """The figures for people."""
    shown = [name for name in PRINTED if name in found.columns]
    rows = [[figure(v, 0) for v in row] for row in zip(*(found.columns[name] for name in shown), strict=True)]
    wide = max(len(text) for row in [shown, *rows] for text in row)
    lines = [" ".join(text.rjust(wide) for text in row) for row in [shown, *rows]]
    for name, fit in found.fits.items():
        size = f"{fit['coefficient']:.4g} fraction^{fit['exponent']:.4g}"
        lines.append(f"{name:<5}= {size}, at most {100 * fit['residual']:.2g} % off these")
    errors = [float(v.max()) for key, v in found.columns.items() if key.endswith("_error") and (v == v).all()]
    if errors:
        lines.append(f"accuracy: at n = {found.n} at most {100 * max(errors):.2g} % off the limits given")
    return lines


#: What a command prints of a report.
LINES: dict[str, Callable[..., list[str]]] = {
    "stiffness": lines_of_stiffness,
    "conductivity": lines_of_conductivity,
    "permeability": lines_of_permeability,
}
