"""``trabecula slice``: layers of a design for a machine, or one section."""

from __future__ import annotations

import os
import time
from argparse import Namespace

from ..base.files import check_place
from ..base.formats import LAYERS, kind_of
from ..base.terminal import Progress, figure, put_json, say
from ..base.texts import counted
from ..errors import Refused, WrongUsage
from ..solid import Solid
from .inputs import build, keep_file

__all__ = ["slice"]

#: What belongs to layers alone, how these are made apart, and the words of those that are others on the command line.
LAYERED = ("start", "stop", "adaptive", "least", "binary", "pixel", "size", "exposure", "each", "resume", "cluster", "new")
APART = ("resume", "cluster", "new")
WORDS = {"start": "from", "stop": "to"}


def slice(args: Namespace) -> None:
    """``trabecula slice``: layers, or one section."""
    import numpy  # noqa: F401  wanted by drawings; see `terminal` for why no import waits until then

    others = ("beams", "chord") if args.layer is not None else LAYERED
    for name in (name for name in others if getattr(args, name) is not None and getattr(args, name) is not False):
        raise WrongUsage(f"--{WORDS.get(name, name)} belongs to --{'layer' if args.layer is None else 'z'}; leave it out")
    if args.least is not None and args.adaptive is None:
        raise WrongUsage("--least is for adaptive layers; add --adaptive MM, the greatest height of steps on the surface")
    if args.layer is not None and args.output and LAYERS[kind_of(args.output)].pictures and args.pixel is None:
        raise WrongUsage(f"{args.output} holds pictures; add --pixel MM, the edge of a pixel")
    if args.each and kind_of(args.output or "") != "svg":
        raise WrongUsage("--each writes an .svg for each layer; name one with -o")
    if args.each and any(getattr(args, name) for name in APART):
        raise WrongUsage("--each writes its layers in one run; leave --resume, --cluster and --new out")
    if args.output:
        if args.z is not None and kind_of(args.output) != "svg":
            raise WrongUsage(f"{args.output}: a section is drawn as .svg; other formats take --layer")
        check_place(args.output)
        keep_file(args.design, args.output)
    solid = build(args.design, tell=not args.json)
    if args.layer is not None:
        return layers(solid, args)
    if args.beams or args.chord or any(solid.quadors(name).whole for name in solid.beams):
        return arcs(solid, args)
    section(solid, args)


def layers(solid: Solid, args: Namespace) -> None:
    """``trabecula slice --layer``."""
    start = time.perf_counter()
    wanted = (args.layer, args.tolerance, args.start, args.stop, args.step, args.threads, args.adaptive, args.least)
    made = solid.layers(*wanted)
    with Progress("slicing", args.progress) as progress:
        options = ("binary", "pixel", "size", "exposure", "resume", "cluster", "new")
        given = {name: getattr(args, name) for name in options}
        report = made.save_each(args.output, progress) if args.each else made.save(args.output, progress=progress, **given)
    written = os.path.splitext(args.output)[0] if args.each else args.output
    seconds = round(time.perf_counter() - start, 3)
    if args.json:
        return put_json(report.to_dict() | {"seconds": seconds})
    of = f"at most {args.layer:g} mm" if args.adaptive else f"{args.layer:g} mm"
    print(f"layers    {counted(report.layers, 'layer')} of {of}" + (f", {report.empty} empty" if report.empty else ""))
    print(f"volume    {figure(report.volume)} mm³, sections in the middle of layers")
    print(f"contours  {report.contours}, of {report.points} points")
    say(f"{written}: written in {seconds:g} s")


def section(solid: Solid, args: Namespace) -> None:
    """``trabecula slice --z`` of any design."""
    low, high = solid.bounds
    if not low[2] <= args.z <= high[2]:
        raise Refused(f"--z {args.z:g} mm is outside the part, which lies from {low[2]:g} to {high[2]:g} mm")
    start = time.perf_counter()
    made = solid.layers(high[2] - low[2], args.tolerance, step=args.step).at(args.z)
    seconds = round(time.perf_counter() - start, 3)
    points = sum(len(loop) - 1 for loop in made.loops)
    if args.output:
        made.write(args.output)
    if args.json:
        return put_json({"z": args.z, "area": made.area, "loops": len(made.loops), "points": points, "seconds": seconds})
    print(f"area   {figure(made.area)} mm²")
    print(f"loops  {len(made.loops)}, of {points} points")
    if args.output:
        say(f"{args.output}: written, {args.tolerance:g} mm off at most")


def arcs(solid: Solid, args: Namespace) -> None:
    """``trabecula slice --z`` of beams, exactly."""
    quadors = solid.quadors(args.beams)
    chord = args.chord or 0.01
    start = time.perf_counter()
    cut = quadors.slice(args.z)
    seconds = round(time.perf_counter() - start, 3)
    if args.output:
        cut.write(args.output, chord)
    curves = sum(len(it["weights"]) for it in cut.loops)
    figures = {"z": args.z, "area": cut.area, "loops": len(cut.loops), "curves": curves, "hubs": cut.hubs}
    figures |= {"whole": quadors.whole, "moved": cut.moved, "seconds": seconds}
    if not quadors.whole:
        say("the slice is of the beams alone, uncut: the design's region cuts them, or more is added to them")
    if args.json:
        return put_json(figures)
    print(f"area   {figure(cut.area)} mm², exact")
    print(f"loops  {len(cut.loops)}, of {curves} conic arcs; the plane reaches {cut.hubs} of {len(quadors)} hubs")
    if cut.moved:
        print(f"moved  by {cut.moved:g} mm: the plane would touch the surface without cutting it")
    if args.output:
        say(f"{args.output}: written, {chord:g} mm off at most")
