"""The command ``trabecula``: thin, over the public Python names. Results on stdout, words on stderr."""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import sys
import time

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


class Parser(argparse.ArgumentParser):
    """argparse, saying what is wrong in one line."""

    def error(self, message: str):
        """Leaves with status 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


class Refused(Exception):
    """A file or a request that cannot be served: one line, exit status 1."""


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


def kind_of(path: str) -> str:
    """The extension in small letters."""
    return os.path.splitext(path)[1].lower().lstrip(".")


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

    def command(name: str, run, line: str, more: str) -> argparse.ArgumentParser:
        made = commands.add_parser(
            name, help=line, description=line, epilog=more, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        made.set_defaults(run=run)
        return made

    def resolution(p: argparse.ArgumentParser, word: str = "--edge") -> None:
        either = p.add_mutually_exclusive_group()
        either.add_argument(word, type=length, metavar="MM", dest="edge", help="grid spacing in mm")
        either.add_argument(
            "--per-cell", type=samples, metavar="N", help="grid spacing as the smallest wavelength / N (default: 32)"
        )
        p.add_argument("--threads", type=count, metavar="N", help="threads (default: all); the result is the same")
        p.add_argument(
            "--progress",
            action=argparse.BooleanOptionalAction,
            default=None,
            help="show progress on stderr (default: if it is a terminal)",
        )

    p = command(
        "new",
        new,
        "Write a commented design to start from.",
        "example:\n  trabecula new first.toml --cell diamond",
    )
    p.add_argument("file", type=ending(("toml",)), metavar="FILE", help="the design file to write (.toml)")
    p.add_argument("--cell", default="gyroid", metavar="NAME", help="a named cell; see `trabecula cells`")
    p.add_argument("--force", action="store_true", help="replace the file if it exists")

    p = command(
        "check",
        check,
        "Read and build a design; print its level, fraction, wall thickness and warnings. Meshes nothing.",
        "example:\n  trabecula check part.toml --json",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json)")
    p.add_argument("--json", action="store_true", help="print the report as JSON")

    p = command(
        "mesh",
        mesh,
        "Mesh a design: closed, oriented, free of self-intersection.",
        "The name of OUT decides the format: .stl (binary, streamed: memory stays bounded), .3mf, .ply, .obj.\n\n"
        "examples:\n  trabecula mesh part.toml -o part.3mf --edge 0.25\n"
        "  trabecula mesh part.toml -o part.stl --per-cell 48 --threads 4",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json)")
    p.add_argument("-o", "--output", required=True, type=ending(MESH_OUT), metavar="OUT", help="the mesh to write")
    resolution(p)
    p.add_argument("--json", action="store_true", help="print the summary as JSON on stdout")

    p = command(
        "voxels",
        voxels,
        "Write the solid as cubic voxels.",
        "The name of OUT decides the format: .npy (indexed [x, y, z], 1 is solid) or .vti (for ParaView).\n\n"
        "example:\n  trabecula voxels part.toml -o part.vti --step 0.2",
    )
    p.add_argument("design", type=ending(DESIGNS), metavar="DESIGN", help="a design file (.toml or .json)")
    p.add_argument("-o", "--output", required=True, type=ending(VOXELS_OUT), metavar="OUT", help="the voxels to write")
    resolution(p, "--step")
    p.add_argument("--json", action="store_true", help="print the summary as JSON on stdout")

    p = command(
        "measure",
        measure,
        "Measure a design or a mesh file: volume, areas, solid fraction, Euler number, pieces, closedness.",
        "A design is meshed in memory first. A mesh file has a solid fraction only against a region.\n\n"
        "examples:\n  trabecula measure part.toml --edge 0.25 --json\n"
        "  trabecula measure part.stl --region part.toml\n  trabecula measure part.stl --region hull.stl --json",
    )
    p.add_argument("file", type=ending((*DESIGNS, *MESH_IN)), metavar="FILE", help="a design or a mesh file")
    p.add_argument(
        "--region",
        type=ending((*DESIGNS, *MESH_IN)),
        metavar="R",
        help="what the solid fraction is of: a design, a file with a [region] alone, or a closed mesh in mm",
    )
    resolution(p)
    p.add_argument("--json", action="store_true", help="print the measures as JSON")

    p = command(
        "cells",
        cells,
        "List the named cells: formula, space group, range, fractions in one piece, source.",
        "In a formula s = sin 2πx and c = cos 2πx; s2x = sin 4πx. x, y, z are phases in turns.\n\n"
        "examples:\n  trabecula cells\n  trabecula cells gyroid --json",
    )
    p.add_argument("name", nargs="?", metavar="NAME", help="one cell only, with all that is known of it")
    p.add_argument("--json", action="store_true", help="print as JSON")

    p = command(
        "render",
        render,
        "Draw a design or a mesh file as PNG.",
        "example:\n  trabecula render part.toml -o part.png --size 1600x1200 --azimuth 30 --elevation 25",
    )
    p.add_argument("file", type=ending((*DESIGNS, *MESH_IN)), metavar="FILE", help="a design or a mesh file")
    p.add_argument("-o", "--output", required=True, type=ending(("png",)), metavar="OUT", help="the picture (.png)")
    p.add_argument("--size", type=size, default=(1600, 1200), metavar="WxH", help="pixels (default: 1600x1200)")
    p.add_argument("--azimuth", type=angle, default=30.0, metavar="DEG", help="camera about +z (default: 30)")
    p.add_argument("--elevation", type=angle, default=25.0, metavar="DEG", help="camera above xy (default: 25)")
    resolution(p)
    return top


# --- the commands ----------------------------------------------------------------------------------------------------


def new(args) -> None:
    """``trabecula new``."""
    from . import cell
    from .output import check_place, whole_file

    known = cell.names()
    if args.cell not in known:
        from difflib import get_close_matches

        near = get_close_matches(args.cell, known, 1)
        hint = f'; did you mean "{near[0]}"?' if near else "."
        raise Refused(f'no cell is named "{args.cell}"{hint} There are: {", ".join(known)}')
    if os.path.exists(args.file) and not args.force and not os.path.isdir(args.file):
        raise Refused(f"{args.file} exists; choose another name, or replace it with --force")
    check_place(args.file)
    with whole_file(args.file) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as out:
        out.write(STARTER.format(cell=args.cell, file=os.path.basename(args.file)))
    say(f"{args.file} written; next: trabecula check {args.file}")


def check(args) -> None:
    """``trabecula check``."""
    solid = build(args.design, tell=not args.json)
    report = solid.report()
    if args.json:
        return print(json.dumps(report, indent=2))
    low, high = report["region"]["bounds"]
    about = "" if report["region"]["volume_exact"] else "about "
    extent = " × ".join(figure(b - a) for a, b in zip(low, high, strict=True))
    print(f"region  {extent} mm, {about}{figure(report['region']['volume'])} mm³")
    for name, it in report["lattices"].items():
        neck = "thinnest wall" if it["part"] == "sheet" else "narrowest neck"
        print(f"lattice {name}: {it['part']}, wavelength {figure(it['wavelength'])} mm")
        print(f"  iso        {span(it['iso'])}")
        print(f"  fraction   {span(it['fraction'])}")
        print(f"  porosity   {span(it['porosity'])}")
        print(f"  thickness  {span(it['thickness'])}{'' if it['thickness'] is None else f' mm ({neck})'}")
        whole = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in it["connected_fraction"])
        print(f"  one piece  {'at fractions ' + whole if whole else 'at no fraction'}")


def mesh(args) -> None:
    """``trabecula mesh``."""
    from .output import check_place

    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    options = resolved(args)
    with Progress("meshing", args.progress) as progress:
        if kind_of(args.output) == "stl":
            made = solid.save_stl(args.output, threads=args.threads, progress=progress, **options)
        else:
            surface = solid.mesh(threads=args.threads, progress=progress, **options)
            progress.clear()
            surface.write(args.output)
            figures = surface.measure()
            keys = ("volume", "area", "area_lattice", "area_cut")
            made = {"triangles": len(surface.triangles), **{k: figures[k] for k in keys}}
    edge = solid.spacing(**options)
    made["solid_fraction"] = made["volume"] / region_volume(solid, edge)
    made["edge"] = edge
    made["bytes"] = os.path.getsize(args.output)
    made["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return print(json.dumps(made, indent=2))
    say(
        f"{args.output}: {made['triangles']} triangles, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, area {figure(made['area'])} mm²; edge {edge:g} mm, {made['seconds']:.2f} s"
    )


def voxels(args) -> None:
    """``trabecula voxels``."""
    import numpy  # noqa: F401  before the work: an interrupt during a late import is not clean

    from .output import check_place

    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    options = {"step" if k == "edge" else k: v for k, v in resolved(args).items()}
    with Progress("sampling", args.progress) as progress:
        grid = solid.voxels(threads=args.threads, progress=progress, **options)
    grid.write(args.output)
    made = {"shape": list(grid.shape), "step": grid.step, "origin": grid.origin, "volume": grid.volume}
    made["solid_fraction"] = made["volume"] / region_volume(solid, grid.step)
    made["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return print(json.dumps(made, indent=2))
    shape = " × ".join(map(str, grid.shape))
    say(
        f"{args.output}: {shape} voxels of {grid.step:g} mm, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, {made['seconds']:.2f} s"
    )


def measure(args) -> None:
    """``trabecula measure``."""
    made = surface(args)
    if args.region:
        made = made.within(region(args.region))
    figures = made.measure()
    if (figures["solid_fraction"] or 0) > 1.01:
        say(f"warning: {args.file} holds more than the region does; they may not be in the same place or unit")
    if not figures["closed"]:
        say(f"warning: {args.file} is not closed, so its volume and what follows from it mean little")
    if args.json:
        return print(json.dumps(figures, indent=2))
    units = {"volume": " mm³", "area": " mm²", "area_lattice": " mm²", "area_cut": " mm²"}
    for key, value in figures.items():
        if key == "bounds":
            text = " to ".join("(" + ", ".join(figure(v) for v in corner) + ")" for corner in value) + " mm"
        elif value is None:
            text = "needs a region (--region)"
        elif isinstance(value, bool):
            text = "yes" if value else "no"
        else:
            text = (f"{value:.6g}" if isinstance(value, float) else str(value)) + units.get(key, "")
        print(f"{key:15} {text}")


def cells(args) -> None:
    """``trabecula cells``."""
    from . import _core

    listed = _core.cells()
    if args.name:
        names = [c[0] for c in listed]
        if args.name not in names:
            from difflib import get_close_matches

            near = get_close_matches(args.name, names, 1)
            hint = f'; did you mean "{near[0]}"?' if near else "."
            raise Refused(f'no cell is named "{args.name}"{hint} There are: {", ".join(names)}')
        listed = [c for c in listed if c[0] == args.name]
    facts = []
    for name, title, formula, group, source in listed:
        span_, parts = _core.cell_facts(name)
        facts.append(
            {
                "name": name,
                "title": title,
                "formula": formula,
                "group": group,
                "range": list(span_),
                "connected_fraction": {part: [list(w) for w in whole] for part, whole in parts},
                "source": source,
            }
        )
    if args.json:
        return print(json.dumps(facts[0] if args.name else facts, indent=2, ensure_ascii=False))
    for it in facts:
        print(f"{it['name']}  ({it['title']})")
        print(f"  f       {it['formula']}")
        print(f"  group   {it['group']}")
        print(f"  range   {it['range'][0]:.6g} to {it['range'][1]:.6g}")
        for part, whole in it["connected_fraction"].items():
            text = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in whole) or "never"
            print(f"  {part:7} in one piece at fractions {text}")
        print(f"  source  {it['source']}")


def render(args) -> None:
    """``trabecula render``."""
    from .output import check_place

    check_place(args.output)
    surface(args).render(args.output, args.size, args.azimuth, args.elevation)
    say(f"{args.output}: {args.size[0]} × {args.size[1]} pixels")


# --- what they share -------------------------------------------------------------------------------------------------


def files_of(tree) -> list[str]:
    """The files that a region names."""
    if isinstance(tree, dict):
        own = [tree["path"]] if isinstance(tree.get("path"), str) else []
        return own + [name for branch in tree.values() for name in files_of(branch)]
    return [name for branch in tree for name in files_of(branch)] if isinstance(tree, list) else []


def keep_inputs(design: str, output: str) -> None:
    """Refuses an output that is the design, or a file that the design reads."""
    from .design import load

    folder = os.path.dirname(os.path.abspath(design))
    for name in [design, *(os.path.join(folder, f) for f in files_of(load(design).to_dict().get("region")))]:
        if os.path.exists(name) and os.path.exists(output) and os.path.samefile(name, output):
            raise Refused(f"{output} is read by this design; name another output")


def build(path: str, tell: bool = True):
    """The solid of a design file; its warnings go to stderr."""
    import warnings

    from .design import load
    from .errors import DesignError, DesignWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DesignWarning)
        try:
            solid = load(path).build()
        except DesignError as error:
            raise Refused(str(error)) from None
    if tell:
        for warning in solid.warnings:
            say(f"warning: {warning['path']}: {warning['message']}")
    return solid


def resolved(args) -> dict:
    """The resolution that was asked for."""
    if args.edge is not None:
        return {"edge": args.edge}
    return {"per_cell": 32 if args.per_cell is None else args.per_cell}


def surface(args):
    """The mesh of a design or a mesh file."""
    from .mesh import Mesh

    if kind_of(args.file) in DESIGNS:
        solid = build(args.file)
        with Progress("meshing", args.progress) as progress:
            return solid.mesh(threads=args.threads, progress=progress, **resolved(args))
    if args.edge is not None or args.per_cell is not None:
        raise Refused(f"{args.file} is a mesh already; --edge and --per-cell are for designs")
    return Mesh.read(args.file)


def region(path: str):
    """The region of a design, of a file with a region alone, or of a mesh file."""
    from . import _core
    from .errors import DesignError

    folder = os.path.dirname(os.path.abspath(path))
    try:
        if kind_of(path) in MESH_IN:
            made = {"region": {"mesh": {"path": os.path.abspath(path)}}}
            return _core.Region.from_data(made, folder)
        if os.path.isdir(path):
            raise Refused(f"{path} is a directory, not a region")
        try:
            with open(path, encoding="utf-8-sig") as file:
                text = file.read()
        except FileNotFoundError:
            raise Refused(f"{path} does not exist") from None
        except UnicodeDecodeError:
            raise Refused(f"{path} is not text in UTF-8") from None
        return _core.Region.from_text(text, kind_of(path) == "json", path, folder)
    except DesignError as error:
        raise Refused(str(error)) from None


def region_volume(solid, edge: float) -> float:
    """The region's volume for a summary: exact, or of a surface that is quick to make."""
    low, high = solid.bounds
    return solid._core.region.volume(max(edge, max(b - a for a, b in zip(low, high, strict=True)) / 200))


class Progress:
    """Share done and time left, on stderr, a few times a second."""

    def __init__(self, word: str, wanted: bool | None):
        self.word = word
        self.terminal = sys.stderr.isatty()
        self.shown = self.terminal if wanted is None else wanted
        self.start = self.last = time.monotonic()
        self.tenth = 0
        self.width = 0

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_) -> None:
        self.clear()

    def __call__(self, done: int, total: int) -> None:
        """``done`` of ``total`` steps."""
        now = time.monotonic()
        if not self.shown or not total:
            return
        share = done / total
        left = (now - self.start) * (1 - share) / share if share > 0 else math.inf
        text = f"{self.word}: {100 * share:3.0f} %" + (f", {duration(left)} left" if math.isfinite(left) else "")
        if self.terminal:
            if now - self.last >= 0.1:
                self.last = now
                with contextlib.suppress(OSError, ValueError):
                    sys.stderr.write("\r" + text.ljust(self.width))
                    sys.stderr.flush()
                self.width = len(text)
        elif int(10 * share) > self.tenth:
            self.tenth = int(10 * share)
            say(text)

    def clear(self) -> None:
        """Takes the line away."""
        if self.width:
            with contextlib.suppress(OSError, ValueError):
                sys.stderr.write("\r" + " " * self.width + "\r")
                sys.stderr.flush()
            self.width = 0


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes} min {seconds} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def figure(v: float) -> str:
    """A number with six digits."""
    return f"{v:.6g}"


def span(v) -> str:
    """A number, a range, or none."""
    if v is None:
        return "none"
    return f"{v:.4f}" if isinstance(v, (int, float)) else f"{v[0]:.4f} to {v[1]:.4f}"


def say(text: str) -> None:
    """Words go to stderr; where nobody reads it, they are lost and the work goes on."""
    with contextlib.suppress(OSError, ValueError):
        print(text, file=sys.stderr, flush=True)


STARTER = """\
# A lattice part. Lengths are mm, angles degrees.
#
#   trabecula check {file}
#   trabecula mesh {file} -o part.3mf --edge 0.25
schema = 1
units  = "mm"

# Where the part may be. Other regions: cylinder, sphere, mesh (a closed STL, OBJ, PLY, OFF or 3MF file),
# union, intersection, difference, offset. For a part of your own:
#   [region.mesh]
#   path = "part.stl"
[region.box]
size = [20, 20, 20]         # about the origin, unless `center` says otherwise

[lattice.core]
cell = "{cell}"             # `trabecula cells` lists the others
part = "sheet"              # sheet |f| <= t, lower f <= t, upper f >= t

[lattice.core.map.affine]
wavelength = 5.0            # the cell's edge; or three: [5, 5, 8]
# rotate = [0, 0, 45]       # turns the lattice about x, y, z
# offset = [0, 0, 0]        # moves it

# How much is solid: exactly one of iso, fraction, porosity. Each may vary in space:
#   fraction = {{ linear = {{ along = [0, 0, 1], stops = [[-10, 0.20], [10, 0.45]] }} }}
#   fraction = {{ depth = {{ stops = [[0, 0.60], [4, 0.25]] }} }}
#   fraction = {{ formula = "0.3 + 0.1*sin(x/5)" }}
[lattice.core.level]
fraction = 0.30             # of the cell; porosity = 0.70 says the same
"""


# --- the door --------------------------------------------------------------------------------------------------------


def main(argv: list[str] | None = None) -> int:
    """Runs the command; gives its exit status."""
    import signal
    import warnings

    for name in ("stdout", "stderr"):  # a door that was closed before we came
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    warnings.showwarning = lambda message, *rest, **more: say(f"warning: {message}")
    top = parser()
    args = top.parse_args(argv)
    if args.version:
        from . import _core

        print(f"trabecula {_core.__version__}")
        return 0
    if args.command is None:
        top.print_help(sys.stderr)
        return 2
    with contextlib.suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGTERM, _terminated)
        if hasattr(signal, "SIGHUP"):  # the terminal was closed
            signal.signal(signal.SIGHUP, _terminated)
    try:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # a narrow terminal still gets the figures
        args.run(args)
        sys.stdout.flush()
        return 0
    except KeyboardInterrupt:
        say("stopped; nothing was left behind")
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (Refused, ValueError, OverflowError, OSError, MemoryError) as error:
        if os.environ.get("TRABECULA_DEBUG"):
            raise
        text = str(error) or type(error).__name__
        if isinstance(error, OSError) and error.filename:
            text = f"{error.filename}: {error.strerror}"
        say("trabecula: " + " ".join(text.split("\n")))
        return 1
    except Exception as error:
        if os.environ.get("TRABECULA_DEBUG"):
            raise
        say(
            f"trabecula: internal error ({type(error).__name__}: {' '.join(str(error).split())}); this is a mistake of "
            "ours: please report it with the design and the command"
        )
        return 1


def _terminated(*_) -> None:
    raise KeyboardInterrupt
