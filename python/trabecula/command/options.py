"""Options of the commands: how one is written, and those that several have."""

from __future__ import annotations

import argparse
from typing import Any

from ..base.formats import DESIGNS, MESHES, PART_READS, VOLUME_READS, dotted
from .arguments import COUNT, GIGABYTES, LENGTH, PORT, SAMPLES, TRIANGLES, VOXELS, Ending, cluster

__all__ = [
    *("APART", "DESIGN", "DESIGN_OR_MESH", "JSON", "LIGHTER", "MEASURED", "NOTICES", "PLAIN", "PROGRESS", "SERVED"),
    *("THREADS", "TRANSITIONS", "WRITTEN", "Option", "command", "file", "of_cell", "option", "output", "shards", "spacing"),
]

#: What ``add_argument`` takes.
Option = tuple[tuple[str, ...], dict[str, Any]]


def option(*names: str, **more: Any) -> Option:
    """What ``add_argument`` takes."""
    return names, more


def command(line: str, more: str, *options: Option | list[Option]) -> tuple[str, str, tuple[Option | list[Option], ...]]:
    """A command: its line of help, what follows its options there, and these; of those in a list one at most."""
    return line, more, options


def file(name: str, known: tuple[str, ...], text: str, metavar: str = "FILE", stdin: bool = False, **more: Any) -> Option:
    """A file by its position on the command line, or after an option."""
    return option(*name.split(), type=Ending(known, stdin), metavar=metavar, help=text, **more)


def output(known: tuple[str, ...], text: str, required: bool = True) -> Option:
    """The file that a command writes."""
    return file("-o --output", known, text, "OUT", required=required)


def spacing(word: str = "--edge", *more: Option) -> list[Option]:
    """The spacing of the grid; of these options one at most."""
    edge = option(
        word, type=LENGTH, metavar="MM", dest="edge", help="grid spacing in mm; without it what the walls need, as `check` says"
    )
    text = "grid spacing as the smallest wavelength / N"
    return [edge, option("--per-cell", type=SAMPLES, metavar="N", help=text), *more]


def of_cell(known: tuple[str, ...]) -> tuple[Option, ...]:
    """The options of what is found of a periodic cell."""
    return (
        file("-o --output", known, f"files to write ({dotted(known)})", "OUT", nargs="+", action="extend"),
        option("--n", type=VOXELS, default=64, metavar="N", help="voxels along the cell's edge (default: 64)"),
        *(THREADS, PROGRESS, JSON, *NOTICES),
    )


#: Without the fractions of voxels.
PLAIN = option("--voxels", action="store_true", help="plain voxels: solid if the centre is, without fractions")


#: The mesh formats that are written, each with what is particular to it.
WRITTEN = ", ".join(f".{suffix}" + (" (binary)" if row.binary else "") for suffix, row in MESHES.items() if row.writes)
DESIGN = file("design", DESIGNS, "a design file (.toml or .json), or - for standard input", "DESIGN", True)
DESIGN_OR_MESH = file("file", (*DESIGNS, *PART_READS), "a design or a mesh file; - is a design on standard input", stdin=True)
MEASURED = file(
    "file",
    (*DESIGNS, *PART_READS, *VOLUME_READS),
    "a design, a mesh or a file of tetrahedra; - is a design on standard input",
    stdin=True,
)
JSON = option("--json", action="store_true", help="print the figures as JSON on stdout")
#: How the studio is served.
SERVED = (
    option("--port", type=PORT, default=0, metavar="N", help="port to serve it at (default: any that is free)"),
    option("--no-open", dest="open", action="store_false", help="open no browser: print the address alone"),
)
THREADS = option("--threads", type=COUNT, metavar="N", help="threads (default: all); the result is the same for any number")
PROGRESS = option(
    "--progress",
    action=argparse.BooleanOptionalAction,
    default=None,
    help="show progress on stderr (default: if it is a terminal)",
)
NOTICES = (
    option("--quiet", action="store_true", help="errors only: no warnings, progress or summary on stderr"),
    option("--strict", action="store_true", help="a warning is an error: exit status 1, and no file is written"),
)
LIGHTER = (
    option("--tolerance", type=LENGTH, metavar="MM", help="simplify, the surface moved by at most this, mm"),
    option("--triangles", type=TRIANGLES, metavar="N", help="simplify to this number of triangles"),
)
#: Surfaces that outgrow one process or one run.
APART = (
    option(
        "--resume",
        action="store_true",
        help="keep what is done in a folder beside the output, with checksums; after any end the same command goes on",
    ),
    option(
        "--cluster",
        type=cluster,
        metavar="ADDRESS",
        help="by a Dask cluster at this address, local:N processes, or slurm:N jobs; needs the extra scale",
    ),
    option("--new", action="store_true", help="begin anew: the folder of an earlier run is not taken up"),
)


def shards(folder: str, more: str) -> Option:
    """Several files instead of one."""
    text = f"a folder with the name of OUT {folder}, of files of about this size and a manifest: as --resume{more}"
    return option("--shards", type=GIGABYTES, metavar="GB", help=text)


TRANSITIONS = file("--transitions", ("svg",), "draw the solid fraction along the transitions of a blend to OUT.svg", "OUT.svg")
