"""The command ``trabecula``: thin, over the public Python names. Results on stdout, words on stderr."""

from __future__ import annotations

import argparse
import math
import os
import sys

from . import interrupt
from .words import say

__all__ = ["main"]

EPILOG = """\
examples:
  trabecula new first.toml --cell gyroid         write a commented design to start from
  trabecula check first.toml                     level, fraction, wall thickness, warnings; meshes nothing
  trabecula mesh first.toml -o first.3mf --edge 0.25
  trabecula measure first.toml --json
  trabecula render first.toml -o first.png

exit status: 0 done, 1 the design or a file is wrong, 2 wrong usage.
Set TRABECULA_DEBUG=1 for the traceback of an internal error.
"""
DESIGNS = ("toml", "json")
MESH_OUT = ("stl", "3mf", "ply", "obj")
MESH_IN = (*MESH_OUT, "off")
VOXELS_OUT = ("npy", "vti")
SHOWN = ("angle", "spacing", "density")
TETS_OUT = ("vtu", "msh", "inp", "med", "mesh")
TETS_IN = (*TETS_OUT, "vtk", "meshb", "bdf", "nas", "fem", "e", "exo", "xdmf", "cgns", "ugrid", "su2", "avs")
UNITS = ("mm", "micron", "cm", "m", "inch", "foot")


class Parser(argparse.ArgumentParser):
    """argparse, saying what is wrong in one line."""

    def error(self, message: str):
        """Leaves with status 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


# --- words on the command line ---------------------------------------------------------------------------------------


def length(text: str) -> float:
    """A length in mm."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a length in mm, found {text!r}") from None
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"expected a length in mm greater than 0, found {text}")
    return value


def height(text: str) -> float:
    """A height in mm."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"expected a height in mm, found {text!r}")
    return value


def samples(text: str) -> float:
    """Samples on a wavelength."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number, found {text!r}") from None
    if not (math.isfinite(value) and value >= 2):
        raise argparse.ArgumentTypeError(f"expected a number of at least 2, found {text}")
    return value


def count(text: str) -> int:
    """A number of threads."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number, found {text!r}") from None
    if not 1 <= value <= 4096:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1 to 4096, found {text}")
    return value


def triangles(text: str) -> int:
    """A number of triangles."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a whole number, found {text!r}") from None
    if not 4 <= value <= 2**32:
        raise argparse.ArgumentTypeError(f"a closed mesh has at least 4 triangles, found {text}")
    return value


def angle(text: str) -> float:
    """An angle in degrees."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected degrees, found {text!r}") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"expected degrees, found {text}")
    return value


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT in pixels."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdigit() and 1 <= int(p) <= 16384 for p in parts):
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, each from 1 to 16384, found {text!r}")
    return int(parts[0]), int(parts[1])


def ending(known: tuple[str, ...]):
    """A file name that ends in one of the known extensions."""

    def check(text: str) -> str:
        ext = os.path.splitext(text)[1].lower().lstrip(".")
        if ext not in known:
            listed = ", ".join("." + k for k in known)
            raise argparse.ArgumentTypeError(f"the name must end in {listed}; found {os.path.basename(text)!r}")
        return text

    return check


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

    def command(name: str, line: str, more: str) -> argparse.ArgumentParser:
        made = commands.add_parser(
            name, help=line, description=line, epilog=more, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        return made

    def resolution(p: argparse.ArgumentParser, word: str = "--edge", chord: bool = False) -> None:
        either = p.add_mutually_exclusive_group()
        either.add_argument(word, type=length, metavar="MM", dest="edge", help="grid spacing in mm")
        either.add_argument(
            "--per-cell", type=samples, metavar="N", help="grid spacing as the smallest wavelength / N (default: 32)"
        )
        if chord:
            either.add_argument(
                "--chord", type=length, metavar="MM", help="no grid: how far triangles may be from uncut beams alone, in mm"
            )
        p.add_argument("--threads", type=count, metavar="N", help="threads (default: all); the result is the same")
        progress(p)

    def progress(p: argparse.ArgumentParser) -> None:
        p.add_argument(
            "--progress",
            action=argparse.BooleanOptionalAction,
            default=None,
            help="show progress on stderr (default: if it is a terminal)",
        )

    def lighter(p: argparse.ArgumentParser) -> None:
        p.add_argument("--tolerance", type=length, metavar="MM", help="fewer triangles, the surface nowhere farther off")
        p.add_argument("--triangles", type=triangles, metavar="N", help="fewer triangles, down to this number")

    p = command(
        "new",
        "Write a commented design to start from.",
        "example:\n  trabecula new first.toml --cell diamond",
    )
    p.add_argument("file", type=ending(("toml",)), metavar="FILE", help="the design file to write (.toml)")
    p.add_argument("--cell", default="gyroid", metavar="NAME", help="a named cell; see `trabecula cells`")
    p.add_argument("--force", action="store_true", help="replace the file if it exists")

    p = command(
        "check",
        "Read and build a design; print its level, fraction, wall thickness and warnings. Meshes nothing.",
        "example:\n  trabecula check part.toml --json",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json)")
    p.add_argument("--json", action="store_true", help="print the report as JSON")
    p.add_argument(
        "--transitions",
        metavar="OUT",
        type=ending(("png",)),
        help="draw the fraction along the transitions of a blend to OUT.png",
    )

    p = command(
        "mesh",
        "Mesh a design: closed, oriented, free of self-intersection.",
        "The name of OUT decides the format: .stl (binary, streamed: memory stays bounded), .3mf, .ply, .obj.\n"
        "With --tolerance or --triangles the mesh is held in memory and simplified, whatever the format. --open leaves out\n"
        "what lies on the region's boundary: the lattice's own surface, for shells; no solid, and not to be printed.\n\n"
        "examples:\n  trabecula mesh part.toml -o part.3mf --edge 0.25\n"
        "  trabecula mesh part.toml -o part.stl --per-cell 48 --threads 4\n"
        "  trabecula mesh part.toml -o part.stl --edge 0.1 --tolerance 0.01\n"
        "  trabecula mesh beams.toml -o beams.stl --chord 0.01",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json)")
    p.add_argument("-o", "--output", required=True, type=ending(MESH_OUT), metavar="OUT", help="the mesh to write")
    resolution(p, chord=True)
    p.add_argument(
        "--islands",
        choices=("keep", "drop", "error"),
        default="keep",
        help="pieces beside the largest: keep them with a warning (default), drop them, or refuse",
    )
    lighter(p)
    p.add_argument("--open", action="store_true", help="write the lattice's own surface alone, open at the region's boundary")
    p.add_argument("--json", action="store_true", help="print the summary as JSON on stdout")

    p = command(
        "simplify",
        "Make a mesh file lighter: fewer triangles, every guarantee, sharp edges and the volume kept.",
        "Nowhere are the two surfaces farther apart than the tolerance; --triangles takes what is needed and says how much\n"
        "that was. The mesh must be closed and free of self-intersection.\n\n"
        "examples:\n  trabecula simplify part.stl -o light.stl --tolerance 0.02\n"
        "  trabecula simplify part.3mf -o light.3mf --triangles 200000",
    )
    p.add_argument("file", type=ending(MESH_IN), metavar="FILE", help="a mesh file, mm")
    p.add_argument("-o", "--output", required=True, type=ending(MESH_OUT), metavar="OUT", help="the mesh to write")
    lighter(p)
    progress(p)
    p.add_argument("--json", action="store_true", help="print what was done as JSON on stdout")

    p = command(
        "voxels",
        "Write the solid as cubic voxels.",
        "The name of OUT decides the format: .npy (indexed [x, y, z], 1 is solid) or .vti (for ParaView).\n\n"
        "example:\n  trabecula voxels part.toml -o part.vti --step 0.2",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json)")
    p.add_argument("-o", "--output", required=True, type=ending(VOXELS_OUT), metavar="OUT", help="the voxels to write")
    resolution(p, "--step")
    p.add_argument("--json", action="store_true", help="print the summary as JSON on stdout")

    p = command(
        "tets",
        "Make or check the tetrahedral mesh that carries a lattice; print its quality; write it.",
        "FILE is a design with [lattice.NAME.map.tets], of which only the region and that table are read, or a file of\n"
        "tetrahedra: vtu, vtk, or with the extra fe (pip install 'trabecula[fe]') msh, inp, med, mesh and others.\n\n"
        "examples:\n  trabecula tets part.toml --json\n  trabecula tets part.toml -o part.vtu\n"
        "  trabecula tets bracket.inp --unit m -o bracket.vtu",
    )
    p.add_argument("file", type=ending((*DESIGNS, *TETS_IN)), metavar="FILE", help="a design or a file of tetrahedra")
    p.add_argument(
        "-o", "--output", type=ending(TETS_OUT), metavar="OUT", help="the mesh to write (.vtu, .msh, .inp, .med, .mesh)"
    )
    p.add_argument("--lattice", metavar="NAME", help="the lattice whose mesh is meant (default: the first that has one)")
    p.add_argument("--unit", choices=UNITS, help="the unit of a file's coordinates (default: mm)")
    p.add_argument("--split", action="store_true", help="cut a file's hexahedra, wedges and pyramids into tetrahedra")
    p.add_argument("--threads", type=count, metavar="N", help="threads (default: all); the result is the same")
    p.add_argument("--json", action="store_true", help="print the figures as JSON on stdout")

    p = command(
        "slice",
        "Slice the beams of a design at a height: loops of conic arcs, their exact area, a drawing.",
        "The beams alone are sliced, as far as they reach: without the region that cuts them, and without a skin.\n\n"
        "examples:\n  trabecula slice part.toml --z 5\n  trabecula slice part.toml --z 5 -o layer.svg --chord 0.005",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json) with beams")
    p.add_argument("--z", type=height, required=True, metavar="MM", help="the height of the plane, mm")
    p.add_argument("--beams", metavar="NAME", help="the beams that are meant (needed only if there are several)")
    p.add_argument("-o", "--output", type=ending(("svg",)), metavar="OUT", help="the drawing to write (.svg)")
    p.add_argument("--chord", type=length, default=0.01, metavar="MM", help="how far the drawing may be off (default: 0.01)")
    p.add_argument("--json", action="store_true", help="print the figures as JSON on stdout")

    p = command(
        "measure",
        "Measure a design or a mesh file: volume, areas, solid fraction, Euler number, pieces, closedness, quality.",
        "A design is meshed in memory first. A mesh file has a solid fraction and pores only against a region.\n"
        "Of a design with a blend the transitions are told too: pieces, what is loose or dangles, the narrowest neck.\n"
        "Local thickness is the diameter of the largest ball that fits in and covers a point (Hildebrand, Rueegsegger).\n\n"
        "examples:\n  trabecula measure part.toml --edge 0.25 --json\n"
        "  trabecula measure part.stl --region part.toml\n  trabecula measure part.stl --region hull.stl --json\n"
        "  trabecula measure part.toml --thickness --step 0.05 --histogram part.png",
    )
    p.add_argument("file", type=ending((*DESIGNS, *MESH_IN)), metavar="FILE", help="a design or a mesh file")
    p.add_argument(
        "--region",
        type=ending((*DESIGNS, *MESH_IN)),
        metavar="R",
        help="what the solid fraction is of: a design, a file with a [region] alone, or a closed mesh in mm",
    )
    resolution(p)
    p.add_argument("--thickness", action="store_true", help="also distributions of wall thickness and pore size")
    p.add_argument(
        "--step", type=length, metavar="MM", help="voxels for the thickness, mm (default: an eighth of the mean wall)"
    )
    p.add_argument("--histogram", type=ending(("png",)), metavar="OUT.png", help="draw the distributions (with --thickness)")
    p.add_argument(
        "--dangling", action="store_true", help="also bits of a design that hang by less than half the lattice's narrowest neck"
    )
    p.add_argument(
        "--transitions",
        metavar="OUT.png",
        type=ending(("png",)),
        help="draw the fraction along the transitions of a blend",
    )
    p.add_argument("--json", action="store_true", help="print the measures as JSON")

    p = command(
        "cells",
        "List the named cells: formula, space group, range, fractions in one piece, source.",
        "In a formula s = sin 2πx and c = cos 2πx; s2x = sin 4πx. x, y, z are phases in turns.\n\n"
        "examples:\n  trabecula cells\n  trabecula cells gyroid --json\n  trabecula cells --tet\n  trabecula cells --beams",
    )
    p.add_argument("name", nargs="?", metavar="NAME", help="one cell only, with all that is known of it")
    p.add_argument("--tet", action="store_true", help="the ready tetrahedral cells instead, for maps over tetrahedra")
    p.add_argument("--beams", action="store_true", help="the unit cells of beams: group, nodes, valence, Maxwell's count")
    p.add_argument("--json", action="store_true", help="print as JSON")

    p = command(
        "render",
        "Draw a design or a mesh file as PNG.",
        "example:\n  trabecula render part.toml -o part.png --size 1600x1200 --azimuth 30 --elevation 25",
    )
    p.add_argument("file", type=ending((*DESIGNS, *MESH_IN)), metavar="FILE", help="a design or a mesh file")
    p.add_argument("-o", "--output", required=True, type=ending(("png",)), metavar="OUT", help="the picture (.png)")
    p.add_argument("--size", type=size, default=(1600, 1200), metavar="WxH", help="pixels (default: 1600x1200)")
    p.add_argument("--azimuth", type=angle, default=30.0, metavar="DEG", help="camera about +z (default: 30)")
    p.add_argument("--elevation", type=angle, default=25.0, metavar="DEG", help="camera above xy (default: 25)")
    p.add_argument("--show", choices=SHOWN, help="colour by how far a solved map is from what was asked for")
    resolution(p)
    return top


# --- the door --------------------------------------------------------------------------------------------------------


def main(argv: list[str] | None = None) -> int:
    """Runs the command; gives its exit status."""
    for name in ("stdout", "stderr"):  # a door that was closed before we came
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    interrupt.at_once()
    try:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # a narrow terminal still gets the figures
        try:
            return serve(argv)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        say(interrupt.outcome())
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    finally:
        interrupt.at_once()  # what is left to do is to leave


def serve(argv: list[str] | None) -> int:
    """Reads the words and runs what they ask for."""
    import warnings

    top = parser()
    args = top.parse_args(argv)
    if args.version:
        from . import _core

        print(f"trabecula {_core.__version__}")
        return 0
    if args.command == "simplify" and args.tolerance is None and args.triangles is None:
        top.error("simplify needs --tolerance MM, --triangles N, or both")
    if args.command is None:
        top.print_help(sys.stderr)
        return 2
    warnings.showwarning = lambda message, *rest, **more: say(f"warning: {message}")
    try:
        from . import commands

        interrupt.as_exception()
        getattr(commands, args.command)(args)
        return 0
    except BrokenPipeError:
        raise
    except Exception as error:
        if os.environ.get("TRABECULA_DEBUG"):
            raise
        say("trabecula: " + told(error))
        return 1


def told(error: Exception) -> str:
    """What is said of an error, in one line."""
    from .errors import Refused

    if isinstance(error, OSError) and error.filename:
        return f"{os.fsdecode(error.filename)}: {error.strerror}"
    if isinstance(error, OSError) and error.strerror:
        return f"the output could not be written: {error.strerror}"
    text = " ".join(str(error).split("\n"))
    if isinstance(error, (Refused, ValueError, OverflowError, OSError, MemoryError)):
        return text or type(error).__name__
    return (
        f"internal error ({type(error).__name__}: {text}); this is a mistake of ours: please report it with the design and "
        "the command"
    )
