"""The command ``trabecula``: thin, over the public Python names. Results on stdout, words on stderr."""

from __future__ import annotations

import argparse
import math
import os
import sys

from .formats import DESIGNS, MESH_READS, MESH_WRITES, MESHES, TET_READS, TET_WRITES, VOXEL_WRITES, dotted, kind_of
from .terminal import interrupts_leave, interrupts_raise, outcome, say

__all__ = ["main"]

EPILOG = """\
examples:
  trabecula new first.toml --cell gyroid         write a commented design to start from
  trabecula check first.toml                     level, fraction, wall thickness, warnings; no mesh
  trabecula mesh first.toml -o first.3mf --edge 0.25
  trabecula measure first.toml --json
  trabecula render first.toml -o first.png

exit status: 0 done, 1 the design or a file is wrong, 2 wrong usage.
Set TRABECULA_DEBUG=1 for the traceback of an internal error.
"""
SHOWN = ("angle", "spacing", "density")
UNITS = ("mm", "micron", "cm", "m", "inch", "foot")


class Parser(argparse.ArgumentParser):
    """argparse with errors of one line."""

    def error(self, message: str):
        """Leaves with status 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


# --- words on the command line ---------------------------------------------------------------------------------------


def number(text: str, what: str, ok, allowed: str = "", kind: type = float):
    """A number on the command line; ``what`` names it, ``allowed`` says which numbers are ``ok``."""
    try:
        value = kind(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected {what}, found {text!r}") from None
    if not (math.isfinite(value) and ok(value)):
        raise argparse.ArgumentTypeError(f"expected {what}{allowed}, found {text}")
    return value


def length(text: str) -> float:
    """A length in mm."""
    return number(text, "a length in mm", lambda v: v > 0, " greater than 0")


def height(text: str) -> float:
    """A height in mm."""
    return number(text, "a height in mm", lambda v: True)


def samples(text: str) -> float:
    """Samples on a wavelength."""
    return number(text, "a number", lambda v: v >= 2, " of at least 2")


def angle(text: str) -> float:
    """An angle in degrees."""
    return number(text, "degrees", lambda v: True)


def count(text: str) -> int:
    """A number of threads."""
    return number(text, "a whole number", lambda v: 1 <= v <= 4096, " from 1 to 4096", int)


def triangles(text: str) -> int:
    """A number of triangles: a closed mesh has at least 4."""
    return number(text, "a whole number", lambda v: 4 <= v <= 2**32, " from 4 to 4294967296", int)


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT in pixels."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdigit() and 1 <= int(p) <= 16384 for p in parts):
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, each from 1 to 16384, found {text!r}")
    return int(parts[0]), int(parts[1])


def ending(known: tuple[str, ...]):
    """A file name that ends in one of the known extensions."""

    def check(text: str) -> str:
        if kind_of(text) not in known:
            found = os.path.basename(text)
            raise argparse.ArgumentTypeError(f"the name must end in {dotted(known)}; found {found!r}")
        return text

    return check


#: The mesh formats that are written, each with what is particular to it.
WRITTEN = ", ".join(
    f".{suffix}" + (f" ({', '.join(words)})" if (words := [w for w in ("binary", "streams") if getattr(row, w)]) else "")
    for suffix, row in MESHES.items()
    if row.writes
)
DESIGN = "a design file (.toml or .json)"
JSON = "print the figures as JSON on stdout"
THREADS = "threads (default: all); the result is the same for any number"


def command(commands, name: str, line: str, more: str) -> argparse.ArgumentParser:
    """A command with its help."""
    plain = argparse.RawDescriptionHelpFormatter
    return commands.add_parser(name, help=line, description=line, epilog=more, formatter_class=plain)


def design_in(p: argparse.ArgumentParser, text: str = DESIGN) -> None:
    """The design that a command reads."""
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help=text)


def file_in(p: argparse.ArgumentParser) -> None:
    """The design or mesh that a command reads."""
    p.add_argument("file", type=ending((*DESIGNS, *MESH_READS)), metavar="FILE", help="a design or a mesh file")


def output(p: argparse.ArgumentParser, known: tuple[str, ...], text: str, needed: bool = True) -> None:
    """The file that a command writes."""
    p.add_argument("-o", "--output", required=needed, type=ending(known), metavar="OUT", help=text)


def json_out(p: argparse.ArgumentParser) -> None:
    """JSON on stdout."""
    p.add_argument("--json", action="store_true", help=JSON)


def threads(p: argparse.ArgumentParser) -> None:
    """The number of threads."""
    p.add_argument("--threads", type=count, metavar="N", help=THREADS)


def progress(p: argparse.ArgumentParser) -> None:
    """Progress on stderr."""
    text = "show progress on stderr (default: if it is a terminal)"
    p.add_argument("--progress", action=argparse.BooleanOptionalAction, default=None, help=text)


def resolution(p: argparse.ArgumentParser, word: str = "--edge", chord: bool = False) -> None:
    """Grid spacing, threads, progress."""
    either = p.add_mutually_exclusive_group()
    either.add_argument(word, type=length, metavar="MM", dest="edge", help="grid spacing in mm")
    text = "grid spacing as the smallest wavelength / N (default: 32)"
    either.add_argument("--per-cell", type=samples, metavar="N", help=text)
    if chord:
        text = "mesh uncut beams without a grid, triangles within this distance of the surface, mm"
        either.add_argument("--chord", type=length, metavar="MM", help=text)
    threads(p)
    progress(p)


def lighter(p: argparse.ArgumentParser) -> None:
    """Simplification."""
    p.add_argument("--tolerance", type=length, metavar="MM", help="fewer triangles, the surface moved by at most this, mm")
    p.add_argument("--triangles", type=triangles, metavar="N", help="fewer triangles, down to this number")


def drawn_transitions(p: argparse.ArgumentParser) -> None:
    """A drawing of the transitions of a blend."""
    text = "draw the solid fraction along the transitions of a blend to OUT.svg"
    p.add_argument("--transitions", metavar="OUT.svg", type=ending(("svg",)), help=text)


def add_new(p: argparse.ArgumentParser) -> None:
    """Options of ``new``."""
    p.add_argument("file", type=ending(("toml",)), metavar="FILE", help="the design file to write (.toml)")
    p.add_argument("--cell", default="gyroid", metavar="NAME", help="a named cell; see `trabecula cells`")
    p.add_argument("--force", action="store_true", help="replace the file if it exists")


def add_check(p: argparse.ArgumentParser) -> None:
    """Options of ``check``."""
    design_in(p)
    json_out(p)
    drawn_transitions(p)


def add_mesh(p: argparse.ArgumentParser) -> None:
    """Options of ``mesh``."""
    design_in(p)
    output(p, MESH_WRITES, "the mesh to write")
    resolution(p, chord=True)
    text = "connected components other than the largest: keep them with a warning (default), drop them, or refuse"
    p.add_argument("--islands", choices=("keep", "drop", "error"), default="keep", help=text)
    lighter(p)
    p.add_argument("--open", action="store_true", help="write the lattice's own surface alone, open at the region's boundary")
    json_out(p)


def add_simplify(p: argparse.ArgumentParser) -> None:
    """Options of ``simplify``."""
    p.add_argument("file", type=ending(MESH_READS), metavar="FILE", help="a mesh file, mm")
    output(p, MESH_WRITES, "the mesh to write")
    lighter(p)
    progress(p)
    json_out(p)


def add_voxels(p: argparse.ArgumentParser) -> None:
    """Options of ``voxels``."""
    design_in(p)
    output(p, VOXEL_WRITES, "the voxels to write")
    resolution(p, "--step")
    json_out(p)


def add_tets(p: argparse.ArgumentParser) -> None:
    """Options of ``tets``."""
    p.add_argument("file", type=ending((*DESIGNS, *TET_READS)), metavar="FILE", help="a design or a file of tetrahedra")
    output(p, TET_WRITES, f"the mesh to write ({dotted(TET_WRITES)})", needed=False)
    p.add_argument("--lattice", metavar="NAME", help="the lattice whose mesh is made (default: the first that has one)")
    p.add_argument("--unit", choices=UNITS, help="unit of a file's coordinates (default: mm)")
    p.add_argument("--split", action="store_true", help="split a file's hexahedra, wedges and pyramids into tetrahedra")
    threads(p)
    json_out(p)


def add_slice(p: argparse.ArgumentParser) -> None:
    """Options of ``slice``."""
    design_in(p, DESIGN + " with beams")
    p.add_argument("--z", type=height, required=True, metavar="MM", help="height of the plane, mm")
    p.add_argument("--beams", metavar="NAME", help="the beams to slice (needed only if there are several)")
    output(p, ("svg",), "the drawing to write (.svg)", needed=False)
    text = "chord error of the drawing, mm (default: 0.01)"
    p.add_argument("--chord", type=length, default=0.01, metavar="MM", help=text)
    json_out(p)


def add_measure(p: argparse.ArgumentParser) -> None:
    """Options of ``measure``."""
    file_in(p)
    text = "region of the solid fraction: a design, a file with a [region] alone, or a closed mesh in mm"
    p.add_argument("--region", type=ending((*DESIGNS, *MESH_READS)), metavar="R", help=text)
    resolution(p)
    p.add_argument("--thickness", action="store_true", help="also distributions of wall thickness and pore size")
    text = "voxel edge for the thickness, mm (default: an eighth of the mean wall)"
    p.add_argument("--step", type=length, metavar="MM", help=text)
    text = "draw the distributions (with --thickness)"
    p.add_argument("--histogram", type=ending(("svg",)), metavar="OUT.svg", help=text)
    text = "also weakly attached fragments of a design: necks under half the lattice's narrowest"
    p.add_argument("--dangling", action="store_true", help=text)
    drawn_transitions(p)
    json_out(p)


def add_cells(p: argparse.ArgumentParser) -> None:
    """Options of ``cells``."""
    p.add_argument("name", nargs="?", metavar="NAME", help="one cell only")
    p.add_argument("--tet", action="store_true", help="the ready tetrahedral cells instead, for maps over tetrahedra")
    p.add_argument("--beams", action="store_true", help="the unit cells of beams instead: group, nodes, valence, Maxwell count")
    json_out(p)


def add_render(p: argparse.ArgumentParser) -> None:
    """Options of ``render``."""
    file_in(p)
    output(p, ("png",), "the picture (.png)")
    p.add_argument("--size", type=size, default=(1600, 1200), metavar="WxH", help="pixels (default: 1600x1200)")
    p.add_argument("--azimuth", type=angle, default=30.0, metavar="DEG", help="camera about +z (default: 30)")
    p.add_argument("--elevation", type=angle, default=25.0, metavar="DEG", help="camera above xy (default: 25)")
    p.add_argument("--show", choices=SHOWN, help="colour by the deviation of a solved map from the one asked for")
    resolution(p)


#: For each command: its options, one line, examples and more.
COMMANDS = {
    "new": (add_new, "Write a commented design to start from.", "example:\n  trabecula new first.toml --cell diamond"),
    "check": (
        add_check,
        "Build a design and print its level, fraction, wall thickness and warnings, without meshing.",
        "example:\n  trabecula check part.toml --json",
    ),
    "mesh": (
        add_mesh,
        "Mesh a design: closed, oriented, free of self-intersection.",
        f"The name of OUT decides the format: {WRITTEN}. A file that streams needs bounded memory.\n"
        "With --tolerance or --triangles the mesh is held in memory and simplified, whatever the format. --open leaves out\n"
        "the faces on the region's boundary: the lattice's own surface, for shells; not a solid, and not to be printed.\n\n"
        "examples:\n  trabecula mesh part.toml -o part.3mf --edge 0.25\n"
        "  trabecula mesh part.toml -o part.stl --per-cell 48 --threads 4\n"
        "  trabecula mesh part.toml -o part.stl --edge 0.1 --tolerance 0.01\n"
        "  trabecula mesh beams.toml -o beams.stl --chord 0.01",
    ),
    "simplify": (
        add_simplify,
        "Make a mesh file lighter: fewer triangles, every guarantee, sharp edges and the volume kept.",
        "The distance between the two surfaces is at most the tolerance; with --triangles it is printed.\n"
        "The mesh must be closed and free of self-intersection.\n\n"
        "examples:\n  trabecula simplify part.stl -o light.stl --tolerance 0.02\n"
        "  trabecula simplify part.3mf -o light.3mf --triangles 200000",
    ),
    "voxels": (
        add_voxels,
        "Write the solid as cubic voxels.",
        "The name of OUT decides the format: .npy (indexed [x, y, z], 1 is solid) or .vti (for ParaView).\n\n"
        "example:\n  trabecula voxels part.toml -o part.vti --step 0.2",
    ),
    "tets": (
        add_tets,
        "Make or check the tetrahedral mesh that carries a lattice; print its quality; write it.",
        "FILE is a design with [lattice.NAME.map.tets], of which only the region and that table are read, or a file of\n"
        "tetrahedra: vtu, vtk, or with the extra fe (pip install 'trabecula[fe]') msh, inp, med, mesh and others.\n\n"
        "examples:\n  trabecula tets part.toml --json\n  trabecula tets part.toml -o part.vtu\n"
        "  trabecula tets bracket.inp --unit m -o bracket.vtu",
    ),
    "slice": (
        add_slice,
        "Slice the beams of a design at a height: loops of conic arcs, exact area, drawing.",
        "The beams are sliced uncut: without the region that cuts them, and without a skin.\n\n"
        "examples:\n  trabecula slice part.toml --z 5\n  trabecula slice part.toml --z 5 -o layer.svg --chord 0.005",
    ),
    "measure": (
        add_measure,
        "Measure a design or a mesh file: volume, areas, solid fraction, Euler number, pieces, closedness, quality.",
        "A design is meshed in memory first. A mesh file has a solid fraction and pores only against a region.\n"
        "For a design with a blend the transitions are printed too: pieces, loose and weakly attached components, necks.\n"
        "Local thickness is the diameter of the largest ball that fits in and covers a point (Hildebrand, Rueegsegger).\n\n"
        "examples:\n  trabecula measure part.toml --edge 0.25 --json\n"
        "  trabecula measure part.stl --region part.toml\n  trabecula measure part.stl --region hull.stl --json\n"
        "  trabecula measure part.toml --thickness --step 0.05 --histogram part.svg",
    ),
    "cells": (
        add_cells,
        "List the named cells: formula, space group, range, fractions in one piece, source.",
        "In a formula s = sin 2πx and c = cos 2πx; s2x = sin 4πx. x, y, z are phases in turns.\n\n"
        "examples:\n  trabecula cells\n  trabecula cells gyroid --json\n  trabecula cells --tet\n  trabecula cells --beams",
    ),
    "render": (
        add_render,
        "Draw a design or a mesh file as PNG.",
        "example:\n  trabecula render part.toml -o part.png --size 1600x1200 --azimuth 30 --elevation 25",
    ),
}


def parser() -> argparse.ArgumentParser:
    """Everything that the command understands."""
    top = Parser(
        prog="trabecula",
        description="Lattice design: a design file in, a closed and measured solid out.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="store_true", help="print the version and leave")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")
    for name, (add, line, more) in COMMANDS.items():
        add(command(commands, name, line, more))
    return top


# --- the door --------------------------------------------------------------------------------------------------------


def main(argv: list[str] | None = None) -> int:
    """Runs the command; gives its exit status."""
    for name in ("stdout", "stderr"):  # streams that were closed before the start
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    interrupts_leave()
    try:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # a narrow terminal still gets the figures
        try:
            return serve(argv)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        say(outcome())
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    finally:
        interrupts_leave()  # what is left to do is to leave


def serve(argv: list[str] | None) -> int:
    """Reads the command line and runs the command."""
    import warnings

    top = parser()
    args = top.parse_args(argv)
    if args.version:
        from . import __version__

        print(f"trabecula {__version__}")
        return 0
    if args.command == "simplify" and args.tolerance is None and args.triangles is None:
        top.error("simplify needs --tolerance MM, --triangles N, or both")
    if args.command is None:
        top.print_help(sys.stderr)
        return 2
    warnings.showwarning = lambda message, *rest, **more: say(f"warning: {message}")
    try:
        from . import commands

        interrupts_raise()
        getattr(commands, args.command)(args)
        return 0
    except BrokenPipeError:
        raise
    except Exception as error:
        if os.environ.get("TRABECULA_DEBUG"):
            raise
        say("trabecula: " + words_of(error))
        return 1


def words_of(error: Exception) -> str:
    """An error in one line."""
    from .errors import Refused

    if isinstance(error, OSError) and error.filename:
        return f"{os.fsdecode(error.filename)}: {error.strerror}"
    if isinstance(error, OSError) and error.strerror:
        return f"the output could not be written: {error.strerror}"
    text = " ".join(str(error).split("\n"))
    if isinstance(error, (Refused, ValueError, OverflowError, OSError, MemoryError)):
        return text or type(error).__name__
    return f"internal error ({type(error).__name__}: {text}); please report it with the design and the command"
