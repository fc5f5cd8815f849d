"""``trabecula stiffness``, ``conductivity``, ``permeability``, ``law``: what a periodic cell does, printed and written."""

from __future__ import annotations

import csv
from argparse import Namespace
from collections.abc import Callable, Sequence

from ..base.files import check_place, write_text
from ..base.formats import kind_of
from ..base.terminal import Progress, figure, say, warn
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
    solid = placed(args)
    with Progress("stiffness", args.progress) as progress:
        found = solid.stiffness(args.n, args.E, args.nu, None, args.voxels, args.threads, progress)
    for name in args.output or ():
        kind = kind_of(name)
        if kind in SURFACE_WRITES:
            write_surface(name, found.C)
        else:
            title = (
                f"effective stiffness of {args.design}, solid E = {args.E:g}, nu = {args.nu:g}, fraction {found.fraction:.6g}"
            )
            write_text(name, CARDS[kind](found, title) if kind in CARDS else table(found.C, AXES, found.C_n))
    say_found(found, args)
    return found


def conductivity(args: Namespace) -> ConductivityReport:
    """The conductivity that is asked for; written where a file is named."""
    solid = placed(args)
    with Progress("conductivity", args.progress) as progress:
        found = solid.conductivity(args.n, args.pore, args.voxels, args.threads, progress)
    for name in args.output or ():
        write_text(name, table(found.k, "123", found.k_n))
    say_found(found, args)
    return found


def permeability(args: Namespace) -> PermeabilityReport:
    """The permeability that is asked for; written where a file is named."""
    solid = placed(args)
    with Progress("permeability", args.progress) as progress:
        found = solid.permeability(args.n, args.side, args.threads, progress)
    for name in args.output or ():
        write_text(name, table(found.k, "123", found.k_n))
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
        keep_file(args.design, name)
    return build(args.design, tell=not args.json)


def say_found(found: Found, args: Namespace) -> None:
    """Says warnings and what was written."""
    for warning in found.warnings:
        warn(warning["message"], warning["path"], not args.json)
    for name in args.output or ():
        say(f"{name}: written")


def table(limit: Sequence[Sequence[float]], names: Sequence[str], finest: Sequence[Sequence[float]]) -> str:
    """The tensor and that of the finest grid as CSV: a row for each entry."""
    import io

    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["row", "column", "limit", "at_n"])
    for i, a in enumerate(names):
        writer.writerows([a, b, limit[i][j], finest[i][j]] for j, b in enumerate(names))
    return out.getvalue()


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
