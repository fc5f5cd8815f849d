"""The commands. What one needs is imported before its work begins."""

from __future__ import annotations

import os
import time
import warnings

from . import _core, cell
from .errors import DesignError, DesignWarning, Refused
from .input import read_text
from .listings import cells, known_cell
from .machine import fits
from .mesh import READS, Mesh
from .output import check_place, whole_file
from .solid import Solid
from .starter import STARTER
from .telling import (
    ABSENT,
    counted,
    flaws,
    listed,
    tell_beams,
    tell_blend,
    tell_distortion,
    tell_json,
    tell_tets,
    tell_tiling,
    tell_transitions,
    tell_voids,
)
from .words import Progress, figure, say, span

__all__ = ["Refused", "cells", "check", "measure", "mesh", "new", "render", "simplify", "slice", "tets", "voxels"]

DESIGNS = ("toml", "json")
#: How far a solved map is from what was asked for: names on the scale of a picture.
SHOWN = {"angle": "angle off, degrees", "spacing": "spacing off, ratio", "density": "cells for each one wanted"}


def new(args) -> None:
    """``trabecula new``."""
    known_cell(args.cell, cell.names())
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
    if report.get("blend"):
        found = solid.transitions()
        report["blend"]["transitions"] = list(found)
        if args.transitions is not None:
            check_place(args.transitions)
            found.render(args.transitions)
    elif args.transitions is not None:
        raise Refused("--transitions is for designs with a blend; this one has none")
    if args.json:
        return tell_json(report)
    low, high = report["region"]["bounds"]
    about = "" if report["region"]["volume_exact"] else "about "
    extent = " × ".join(figure(b - a) for a, b in zip(low, high, strict=True))
    print(f"region  {extent} mm, {about}{figure(report['region']['volume'])} mm³")
    for name, it in report["lattices"].items():
        neck = "thinnest wall" if it["part"] == "sheet" else "narrowest neck"
        print(f"lattice {name}: {it['part']}, wavelength {figure(it['wavelength'])} mm")
        print(f"  iso        {span(it['iso'])}{'' if it.get('folding') is None else ' of a wall of levels with this fraction'}")
        print(f"  fraction   {span(it['fraction'])}")
        print(f"  porosity   {span(it['porosity'])}")
        print(f"  thickness  {span(it['thickness'])}{'' if it['thickness'] is None else f' mm ({neck})'}")
        if not (it.get("tets") and it["tets"]["zones"]):
            whole = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in it["connected_fraction"])
            print(f"  one piece  {'at fractions ' + whole if whole else 'at no fraction'}")
        if it.get("tets"):
            tell_tiling(it["tets"])
        if it.get("distortion"):
            tell_distortion(it["distortion"])
    for name, it in report["beams"].items():
        tell_beams(name, it)
    if report.get("blend"):
        tell_blend(report["blend"])


def mesh(args) -> None:
    """``trabecula mesh``."""
    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    options = resolved(args) | {"islands": args.islands}
    with Progress("meshing", args.progress) as progress:
        lighter = {"tolerance": args.tolerance, "triangles": args.triangles}
        streams = not (any(lighter.values()) or args.open)
        if args.chord is not None and kind_of(args.output) == "stl" and streams:
            made = solid.save_stl(args.output, threads=args.threads, **options) | {"chord": args.chord}
        elif args.chord is not None:
            surface = solid.mesh(threads=args.threads, progress=progress, **options)
            told = {"chord": args.chord, "chord_error": surface.chord_error}
            if any(lighter.values()):
                progress.clear()
                surface = simplified(surface, args)
            made = surface._summary() | told
            progress.clear()
            surface.write(args.output)
        elif kind_of(args.output) == "stl" and streams and not closes(solid, resolved(args)):
            made = solid.save_stl(args.output, threads=args.threads, progress=progress, **options)
            if made["cavities"]:
                progress.clear()
                say(
                    f"warning: {made['cavities']} closed void{'s' * (made['cavities'] > 1)}, from which powder or resin cannot "
                    f"drain; `trabecula measure {args.output}` tells where"
                )
        else:
            if not any(lighter.values()):
                solid._room(args.output, solid.spacing(**resolved(args)))
            surface = solid.mesh(threads=args.threads, progress=progress, **options)
            if any(lighter.values()):
                progress.clear()
                surface = simplified(surface, args)
            made = surface._summary() | {"voids": surface.voids}
            if surface.simplification:
                made["simplification"] = surface.simplification
            progress.clear()
            if args.open:
                surface = surface.uncapped()
                made |= {"triangles": surface.counts[1], "open": True}
                say("open at the region's boundary: volume and fraction are the closed part's")
            surface.write(args.output)
            tell_voids(made["voids"])
    edge = solid.spacing(args.edge, args.per_cell)
    made["solid_fraction"] = made["volume"] / region_volume(solid, edge)
    made["edge"] = None if args.chord is not None else edge
    made["bytes"] = os.path.getsize(args.output)
    made["seconds"] = round(time.perf_counter() - start, 3)
    left_out = made["islands"]
    if left_out and left_out["dropped"]:
        place = ", ".join(figure(v) for v in left_out["largest"]["place"])
        say(
            f"{counted(left_out['dropped'])} dropped: {left_out['volume']:.3g} mm³ in all, {left_out['border']} at the "
            f"region's boundary; the largest of {left_out['largest']['volume']:.3g} mm³ about ({place}) mm"
        )
    if args.json:
        return tell_json(made)
    size = f"edge {edge:g} mm" if args.chord is None else f"within {made['chord_error']:.3g} mm"
    say(
        f"{args.output}: {made['triangles']} triangles, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, area {figure(made['area'])} mm², {counted(made['pieces'])}; {size}, "
        f"{made['seconds']:.2f} s"
    )


def simplify(args) -> None:
    """``trabecula simplify``."""
    check_place(args.output)
    start = time.perf_counter()
    if os.path.exists(args.output) and os.path.samefile(args.file, args.output):
        raise Refused(f"{args.output} is what is simplified; name another output")
    made = simplified(Mesh.read(args.file), args)
    made.write(args.output)
    report = {**made.simplification, "seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        tell_json(report)


def simplified(mesh: Mesh, args) -> Mesh:
    """The lighter mesh, and words on what was done."""
    with Progress("simplifying", args.progress) as progress:
        made = mesh.simplified(args.tolerance, args.triangles, progress)
    it = made.simplification
    if args.triangles and it["triangles_before"] <= args.triangles:
        say(f"{it['triangles']} triangles are no more than {args.triangles} already: left as they are")
        return made
    if args.triangles and not args.tolerance and it["triangles"] > args.triangles:
        say(f"warning: {it['triangles']} triangles are the fewest that keep the surface whole; {args.triangles} were asked for")
    change = 100 * (it["volume"] / it["volume_before"] - 1)
    say(
        f"simplified from {it['triangles_before']} to {it['triangles']} triangles, nowhere farther than "
        f"{it['deviation']:.2g} mm from the first; volume {change:+.2g} %"
    )
    return made


def voxels(args) -> None:
    """``trabecula voxels``."""
    import numpy  # noqa: F401  wanted in the end; see `interrupt` for why no import waits until then

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
        return tell_json(made)
    shape = " × ".join(map(str, grid.shape))
    say(
        f"{args.output}: {shape} voxels of {grid.step:g} mm, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, {made['seconds']:.2f} s"
    )


def measure(args) -> None:
    """``trabecula measure``."""
    if not args.thickness and (args.step is not None or args.histogram is not None):
        raise Refused("--step and --histogram belong to --thickness; add it")
    if args.region is not None and not os.path.exists(args.region):
        raise Refused(f"{args.region} does not exist")
    if args.histogram is not None:
        check_place(args.histogram)
        keep_measured(args)
    solid = build(args.file) if kind_of(args.file) in DESIGNS else None
    found = solid.transitions() if solid is not None else ()
    if args.transitions is not None:
        if not found:
            raise Refused("--transitions is for designs with a blend, in which lattices pass into each other; this has none")
        check_place(args.transitions)
        keep_inputs(args.file, args.transitions)
        found.render(args.transitions)
    made = surface(args) if solid is None else meshed(solid, args)
    if args.region:
        made = made.within(region(args.region))
    figures = made.measure()
    if (figures["solid_fraction"] or 0) > 1.01:
        say(f"warning: {args.file} holds more than the region does; they may not be in the same place or unit")
    inverted = figures["closed"] and figures["volume"] < 0
    if inverted:
        say(
            f"warning: {args.file} is closed but inside out (its triangles run clockwise seen from outside), so its volume "
            "is negative and its solids count as cavities"
        )
    if not figures["closed"]:
        say(f"warning: {args.file} is not closed ({flaws(made)}), so its volume and what follows from it mean little")
    if figures["closed"] and made.self_intersections:
        say(
            f"warning: the surface of {args.file} crosses itself, so what is within several of its bodies is counted as "
            "often; taken as a region (region.mesh) they are united"
        )
    figures |= {"self_intersections": made.self_intersections, "quality": made.quality, "defects": made.defects}
    if args.dangling:
        if solid is None:
            raise Refused("--dangling is for designs: a mesh file does not tell the lattice's narrowest neck")
        with Progress("looking for bits", args.progress) as progress:
            figures["dangling"] = solid.dangling(threads=args.threads, progress=progress)
    if args.thickness:
        with Progress("fitting balls", args.progress) as progress:
            balls = made.thickness(args.step, args.threads, progress)
        figures |= balls.measure()
        if args.histogram is not None:
            balls.render(args.histogram)
    if args.json:
        if found:
            figures["transitions"] = list(found)
        return tell_json(figures)
    units = {"dangling.volume": " mm³", "dangling.neck": " mm", "dangling.step": " mm"}
    units |= {"volume": " mm³", "area": " mm²", "area_lattice": " mm²", "area_cut": " mm²", "hydraulic_diameter": " mm"}
    lines = listed(figures)
    width = max(15, *(len(key) for key, _ in lines))
    for key, value in lines:
        if key == "bounds":
            text = " to ".join("(" + ", ".join(figure(v) for v in corner) + ")" for corner in value) + " mm"
        elif value is None:
            needed = (
                "needs a region (--region)"
                if solid is None and not args.region
                else "none: all of it is the region's own surface"
            )
            text = ABSENT.get(key, needed)
        elif key == "dangling.largest":
            text = f"{figure(value['volume'])} mm³ at ({', '.join(figure(v) for v in value['place'])}) mm"
        elif isinstance(value, list):
            text = ", ".join(value) or "none"
        elif isinstance(value, bool):
            text = "yes, but inside out" if value and inverted else "yes" if value else "no"
        else:
            text = (figure(value) if isinstance(value, float) else str(value)) + units.get(key, "")
        print(f"{key:{width}} {text}")
    tell_transitions(found)
    if figures["closed"] and not inverted:
        tell_voids(figures["voids"])


def keep_measured(args) -> None:
    """Refuses a histogram that would replace what is measured."""
    for name in filter(None, (args.file, args.region)):
        if os.path.exists(name) and os.path.exists(args.histogram) and os.path.samefile(name, args.histogram):
            raise Refused(f"{args.histogram} is read by this command; name another picture")


def closes(solid: Solid, options: dict) -> bool:
    """Whether the surface is to be held in memory to look for closed voids: where a skin can close them, if it fits."""
    if solid.skin is None:
        return False
    try:
        fits(2 * solid.estimate(**options)["memory"], "the surface")
    except ValueError:
        say("warning: the surface does not fit into memory and is streamed; closed voids are not looked for")
        return False
    return True


def slice(args) -> None:
    """``trabecula slice``."""
    import numpy  # noqa: F401  wanted by drawings; see `interrupt` for why no import waits until then

    if args.output:
        check_place(args.output)
        keep_file(args.design, args.output)
    quadors = build(args.design, tell=not args.json).quadors(args.beams)
    start = time.perf_counter()
    cut = quadors.slice(args.z)
    seconds = round(time.perf_counter() - start, 3)
    if args.output:
        cut.write(args.output, args.chord)
    curves = sum(len(it["weights"]) for it in cut.loops)
    figures = {"z": args.z, "area": cut.area, "loops": len(cut.loops), "curves": curves, "hubs": cut.hubs}
    figures |= {"whole": quadors.whole, "moved": cut.moved, "seconds": seconds}
    if not quadors.whole:
        say("the slice is of the beams alone, uncut: the design's region cuts them, or more is added to them")
    if args.json:
        return tell_json(figures)
    print(f"area   {figure(cut.area)} mm², exact")
    print(f"loops  {len(cut.loops)}, of {curves} arcs of conics; {cut.hubs} of {len(quadors)} hubs looked at")
    if cut.moved:
        print(f"moved  by {cut.moved:g} mm: the plane would touch the surface without cutting it")
    if args.output:
        say(f"{args.output}: written, {args.chord:g} mm off at most")


def tets(args) -> None:
    """``trabecula tets``."""
    import numpy  # noqa: F401  wanted by all but vtu; see `interrupt` for why no import waits until then

    from .tets import TetMesh

    of_file = kind_of(args.file) not in DESIGNS
    if of_file and args.lattice:
        raise Refused("--lattice belongs to a design; a file of tetrahedra has none")
    if not of_file and (args.unit or args.split):
        raise Refused("--unit and --split belong to a file of tetrahedra; in a design they stand under map.tets")
    if args.output:
        check_place(args.output)
        keep_file(args.file, args.output)
    start = time.perf_counter()
    made = TetMesh.read(args.file, args.unit, args.split) if of_file else TetMesh.of(args.file, args.lattice, args.threads)
    report = made.report() | {"seconds": round(time.perf_counter() - start, 3)}
    if args.output:
        keep_file(os.path.join(os.path.dirname(os.path.abspath(args.file)), report["mesher"]), args.output)
        made.write(args.output)
    if args.json:
        return tell_json(report)
    tell_tets(report)
    if args.output:
        say(f"{args.output}: {report['quality']['tets']} tetrahedra, {report['seconds']:.2f} s")


def render(args) -> None:
    """``trabecula render``."""
    check_place(args.output)
    view = args.size, args.azimuth, args.elevation
    if args.show is None:
        surface(args).render(args.output, *view)
    elif kind_of(args.file) not in DESIGNS:
        raise Refused(f"{args.file} is a mesh; --show is for a design with a map that is solved for")
    else:
        solid = build(args.file)
        made = meshed(solid, args)
        try:
            found = solid.misfits(made.vertices)
        except ValueError as error:
            raise Refused(f"{args.file}: {error}") from None
        made.render(args.output, *view, found[args.show], SHOWN[args.show])
    say(f"{args.output}: {args.size[0]} × {args.size[1]} pixels")


# --- what they share -------------------------------------------------------------------------------------------------


def kind_of(path: str) -> str:
    """The extension in small letters."""
    return os.path.splitext(path)[1].lower().lstrip(".")


def files_of(tree) -> list[str]:
    """The files that a design names: what stands under ``path``, or as a table of beams."""
    if isinstance(tree, dict):
        own = [tree[k] for k in ("path", "nodes", "struts") if isinstance(tree.get(k), str)]
        return own + [name for branch in tree.values() for name in files_of(branch)]
    return [name for branch in tree for name in files_of(branch)] if isinstance(tree, list) else []


def keep_inputs(design: str, output: str) -> None:
    """Refuses an output that is the design, or a file that the design reads."""
    if not os.path.exists(output):
        return
    from .design import load

    folder = os.path.dirname(os.path.abspath(design))
    for name in [design, *(os.path.join(folder, f) for f in files_of(load(design).to_dict()))]:
        keep_file(name, output)


def keep_file(name: str, output: str) -> None:
    """Refuses an output that is this file, which is read."""
    if os.path.exists(name) and os.path.exists(output) and os.path.samefile(name, output):
        raise Refused(f"{output} is read by this design; name another output")


def build(path: str, tell: bool = True) -> Solid:
    """The solid of a design file; its warnings go to stderr."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DesignWarning)
        try:
            read = _core.Design.from_text(read_text(path), kind_of(path) == "json", path)
            folder = os.path.dirname(os.path.abspath(path))
            solid = Solid(read.build(folder), folder)
        except DesignError as error:
            raise Refused(str(error)) from None
    if tell:
        for warning in solid.warnings:
            say(f"warning: {warning['path']}: {warning['message']}")
    return solid


def resolved(args) -> dict:
    """The resolution that was asked for."""
    if getattr(args, "chord", None) is not None:
        return {"chord": args.chord}
    if args.edge is not None:
        return {"edge": args.edge}
    return {"per_cell": 32 if args.per_cell is None else args.per_cell}


def surface(args):
    """The mesh of a design or a mesh file."""
    if kind_of(args.file) in DESIGNS:
        return meshed(build(args.file), args)
    if args.edge is not None or args.per_cell is not None:
        raise Refused(f"{args.file} is a mesh already; --edge and --per-cell are for designs")
    return Mesh.read(args.file)


def meshed(solid: Solid, args) -> Mesh:
    """The mesh of a solid, to be measured or seen."""
    with Progress("meshing", args.progress) as progress, warnings.catch_warnings():
        # Measures count the pieces and a picture shows them; nothing is made that somebody would print.
        warnings.filterwarnings("ignore", "the result is not in one piece", DesignWarning)
        return solid.mesh(threads=args.threads, progress=progress, **resolved(args))


def region(path: str):
    """The region of a design, of a file with a region alone, or of a mesh file."""
    folder = os.path.dirname(os.path.abspath(path))
    try:
        if kind_of(path) in READS:
            made = {"region": {"mesh": {"path": os.path.abspath(path)}}}
            return _core.Region.from_data(made, folder)
        return _core.Region.from_text(read_text(path), kind_of(path) == "json", path, folder)
    except DesignError as error:
        raise Refused(str(error)) from None


def region_volume(solid: Solid, edge: float) -> float:
    """The region's volume for a summary: exact, or of a surface that is quick to make."""
    low, high = solid.bounds
    return solid._core.region.volume(max(edge, max(b - a for a, b in zip(low, high, strict=True)) / 200))
