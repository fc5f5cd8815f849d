"""What commands are given: designs, solids and meshes, by their names on the command line; and what may be written over."""

from __future__ import annotations

import os
import sys
import warnings
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from ..base.formats import STDIN, is_design
from ..base.machine import fits
from ..base.terminal import Progress, settle, warn
from ..design import Design, load, parsed
from ..errors import DesignWarning, IslandsWarning, Refused, WrongUsage
from ..mesh import Mesh
from ..solid import Solid

__all__ = [
    "build",
    "closes",
    "design_of",
    "keep_file",
    "keep_inputs",
    "meshed",
    "quietly",
    "resolution",
    "same_file",
    "stdin_text",
    "surface",
]


def same_file(a: str, b: str) -> bool:
    """Whether both names are one file that exists."""
    return os.path.exists(a) and os.path.exists(b) and os.path.samefile(a, b)


def keep_file(name: str, output: str) -> None:
    """Refuses an output that is this file, which is read."""
    if same_file(name, output):
        raise Refused(f"{output} is read by this design; name another output")


def keep_inputs(design: str, output: str) -> None:
    """Refuses an output that is the design, or a file that the design reads."""
    for name in [design, *design_of(design).files()] if os.path.exists(output) else ():
        keep_file(name, output)


@contextmanager
def quietly(category: type[Warning]) -> Iterator[None]:
    """Without warnings of this category."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", category)
        yield


def design_of(path: str) -> Design:
    """The design of a file, or of standard input: JSON if it begins with a brace, else TOML."""
    if path != STDIN:
        return load(path)
    text = stdin_text()
    return parsed(text, text.lstrip().startswith("{"), "<stdin>", os.getcwd())


@cache
def stdin_text() -> str:
    """Standard input, which can be read once only in a command."""
    try:
        return sys.stdin.buffer.read().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Refused(f"<stdin>: not text in UTF-8 (byte {error.start})") from None


def build(path: str, tell: bool = True) -> Solid:
    """The solid of a design; warns on stderr, and refuses with --strict, before more work is done."""
    with quietly(DesignWarning):
        solid = design_of(path).build()
    for warning in solid.warnings:
        warn(warning["message"], warning["path"], tell)
    settle()
    return solid


def resolution(args: Namespace) -> dict:
    """The resolution that was asked for."""
    if getattr(args, "chord", None) is not None:
        return {"chord": args.chord}
    if args.edge is not None:
        return {"edge": args.edge}
    return {"per_cell": args.per_cell}


def surface(args: Namespace) -> Mesh:
    """The mesh of a design or a mesh file."""
    if is_design(args.file):
        return meshed(build(args.file), args)
    if args.edge is not None or args.per_cell is not None:
        raise WrongUsage(f"{args.file} is a mesh already; --edge and --per-cell are for designs")
    return Mesh.read(args.file, solid=getattr(args, "solid", None))


def meshed(solid: Solid, args: Namespace) -> Mesh:
    """The mesh of a solid, to be measured or drawn: its connected components are in the result, so nothing warns of them."""
    with Progress("meshing", args.progress) as progress, quietly(IslandsWarning):
        return solid.mesh(threads=args.threads, progress=progress, **resolution(args))


def closes(solid: Solid, options: dict) -> bool:
    """Whether the surface is to be held in memory to look for closed voids: where a skin can close them, if it fits."""
    if solid.skin is None:
        return False
    try:
        fits(2 * solid.estimate(**options).memory, "the surface")
    except ValueError:
        warn("the surface does not fit into memory and is streamed; closed voids are not looked for")
        return False
    return True
