"""Words on the command line: what each may be, and what it becomes."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable
from typing import NamedTuple

from ..base.formats import STDIN, dotted, kind_of
from ..base.given import cluster_name
from ..parts import check_parts

__all__ = [
    *("ANGLE", "COUNT", "DPI", "ELEVATION", "FRACTION", "FRAMES", "GIGABYTES", "LENGTH", "MODULUS", "NUMBER", "POINTS"),
    *("POISSON", "PORT", "PROPERTIES", "SAMPLES", "SECONDS", "SHARE", "TRIANGLES", "VOXELS", "Ending", "cluster", "direction"),
    *("exposure", "front", "load", "names", "number", "parts", "pixels", "properties", "size"),
]

#: What a sweep computes besides.
PROPERTIES = ("conductivity", "permeability", "stiffness")


def number(
    what: str, ok: Callable[[float], bool] = lambda v: True, allowed: str = "", kind: type = float
) -> Callable[[str], float]:
    """A check of numbers on the command line: ``what`` names one, ``allowed`` says which are ``ok``."""

    def check(text: str) -> float:
        shown = text if len(text) <= 40 else f"{text[:37]}..."
        try:
            value = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"expected {what}, found {shown!r}") from None
        # A whole number of any length is below infinity.
        if not (-math.inf < value < math.inf and ok(value)):
            raise argparse.ArgumentTypeError(f"expected {what}{allowed}, found {shown}")
        return value

    return check


LENGTH = number("a length in mm", lambda v: v > 0, " greater than 0")
SAMPLES = number("a number", lambda v: v >= 2, " of at least 2")
ANGLE = number("degrees")
ELEVATION = number("degrees", lambda v: -90 <= v <= 90, " from -90 to 90")
COUNT = number("a whole number", lambda v: 1 <= v <= 4096, " from 1 to 4096", int)
MODULUS = number("Young's modulus", lambda v: v > 0, " greater than 0")
NUMBER = number("a number")
POISSON = number(
    "Poisson's ratio", lambda v: -1 < v < 0.5, " greater than -1 and less than 0.5 (of an incompressible solid take 0.49)"
)
FRACTION = number("a fraction", lambda v: 0 < v < 1, " between 0 and 1")
POINTS = number("a whole number", lambda v: 2 <= v <= 1000, " from 2 to 1000", int)
SHARE = number("a conductivity", lambda v: v >= 0, " of at least 0")
VOXELS = number("a whole number", lambda v: 8 <= v <= 4096, " from 8 to 4096", int)
DPI = number("pixels an inch", lambda v: 1 <= v <= 10000, " from 1 to 10000")
FRAMES = number("a whole number", lambda v: 2 <= v <= 720, " from 2 to 720", int)
PORT = number("a port", lambda v: 0 <= v <= 65535, " from 0 to 65535", int)
SECONDS = number("a time in s", lambda v: v > 0, " greater than 0")
GIGABYTES = number("a size in GB", lambda v: 0.001 <= v <= 1e6, " from 0.001 to 1000000")
#: A closed mesh has at least 4 triangles.
TRIANGLES = number("a whole number", lambda v: 4 <= v <= 2**32, " from 4 to 4294967296", int)


def pixels(text: str, otherwise: str = "") -> tuple[int, int]:
    """WIDTHxHEIGHT in pixels; ``otherwise`` is what else is allowed."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isdigit() and 1 <= int(p) <= 16384 for p in parts):
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, each from 1 to 16384{otherwise}, found {text!r}")
    return int(parts[0]), int(parts[1])


def size(text: str) -> tuple[float, float, str]:
    """WIDTHxHEIGHT in pixels, or with mm behind it in mm, where the height is three quarters of the width unless given."""
    small = text.lower()
    if not small.endswith("mm"):
        return *pixels(text, ", or WIDTHmm"), "px"
    parts = small.removesuffix("mm").split("x")
    try:
        wide, high = [float(p) for p in parts] if len(parts) == 2 else (float(parts[0]), 0.75 * float(parts[0]))
    except ValueError:
        wide = high = 0.0
    if len(parts) > 2 or not (0 < wide <= 5000 and 0 < high <= 5000):
        raise argparse.ArgumentTypeError(f"expected WIDTHmm or WIDTHxHEIGHTmm, each up to 5000 mm, found {text!r}")
    return wide, high, "mm"


def exposure(text: str) -> tuple[float, float]:
    """Two times by a comma, s."""
    try:
        layer, first = map(float, text.split(","))
    except ValueError:
        layer = first = 0.0
    if not (0 < layer < math.inf and 0 < first < math.inf):
        raise argparse.ArgumentTypeError(f"expected two times in s by a comma, such as 8,35, found {text!r}")
    return layer, first


def direction(text: str) -> list[float]:
    """A direction by its three parts."""
    try:
        found = [float(v) for v in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3 or not all(map(math.isfinite, found)) or not any(found):
        raise argparse.ArgumentTypeError(f"expected a direction, such as 0,0,1, found {text!r}")
    return found


def parts(text: str) -> list[str]:
    """Names of parts by commas."""
    try:
        return check_parts([name.strip() for name in text.split(",")])
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def load(text: str) -> tuple[str, list[float] | float]:
    """A set and a force or a pressure: NAME=FX,FY,FZ or NAME=P."""
    name, equals, given = text.partition("=")
    try:
        found = [float(v) for v in given.split(",")]
    except ValueError:
        found = []
    if not (name.strip() and equals and len(found) in (1, 3) and all(map(math.isfinite, found))):
        raise argparse.ArgumentTypeError(
            f"expected a set and a force in N, such as X1=0,0,-100, or a pressure in MPa, such as BORE=5, found {text!r}"
        )
    return name.strip(), found if len(found) == 3 else found[0]


def names(text: str) -> list[str]:
    """Names by commas."""
    found = [name.strip() for name in text.split(",")]
    if not all(found):
        raise argparse.ArgumentTypeError(f"expected names by commas, such as X0,LATTICE, found {text!r}")
    return found


def properties(text: str) -> list[str]:
    """Names of properties by commas."""
    found = names(text)
    for name in found:
        if name not in PROPERTIES:
            from difflib import get_close_matches

            near = get_close_matches(name, PROPERTIES, 1)
            hint = f"; did you mean {near[0]}?" if near else "."
            raise argparse.ArgumentTypeError(f'unknown property "{name}"{hint} There are {", ".join(PROPERTIES)}')
    return found


def cluster(text: str) -> str:
    """A Dask cluster."""
    try:
        return cluster_name(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error).removeprefix("cluster: ")) from None


def front(text: str) -> tuple[str, str]:
    """Which of two columns is better where it is small, and which where it is large."""
    ways = tuple(text.split(","))
    if len(ways) != 2 or not {*ways} <= {"min", "max"}:
        raise argparse.ArgumentTypeError(f"expected min or max of X and of Y, such as min,max, found {text!r}")
    return ways[0], ways[1]


class Ending(NamedTuple):
    """A check of file names: one of these suffixes, by which shells complete it, or ``-`` for standard input."""

    suffixes: tuple[str, ...]
    stdin: bool = False

    def __call__(self, text: str) -> str:
        if kind_of(text) not in self.suffixes and not (self.stdin and text == STDIN):
            found = os.path.basename(text)
            raise argparse.ArgumentTypeError(f"the name must end in {dotted(self.suffixes)}; found {found!r}")
        return text
