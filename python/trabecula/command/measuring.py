"""``trabecula measure``, and the transitions of blends."""

from __future__ import annotations

import json
import os
import re
import warnings
from argparse import Namespace

from .. import _core
from ..base.files import check_place
from ..base.formats import STDIN, VOLUME_READS, is_design, kind_of
from ..base.terminal import Progress, figure, put_json, settle, warn, warned
from ..base.texts import table, voids
from ..errors import DesignWarning, Refused, WrongUsage
from ..solid import Solid
from ..transition import Transitions
from .inputs import build, keep_inputs, meshed, same_file, surface

__all__ = ["draw", "measure", "transitions"]

#: Where the volume of quadratic elements is known.
NEEDS = "that of curved ones is known of tetrahedra alone, of a .vtu with meshio: pip install 'trabecula[fe]'"


def measure(args: Namespace) -> None:
    """``trabecula measure``."""
    check_measure(args)
    if kind_of(args.file) in VOLUME_READS:
        return measure_tets(args)
    if args.solid is not None and is_design(args.file):
        raise WrongUsage("--solid names an object of a 3MF or a solid of a file from a CAD system; a design has none")
    solid = build(args.file) if is_design(args.file) else None
    if args.dangling and solid is None:
        raise WrongUsage("--dangling is for designs: the narrowest neck of the lattice is not known for a mesh file")
    if solid is None and args.transitions is not None:
        raise WrongUsage("--transitions is for designs with a blend; this is a mesh")
    found = Transitions([]) if solid is None else transitions(solid, args.transitions, args.file)
    held, figures = None, None
    apart = apart_of(args)
    if solid is None or args.region or args.thickness or closely(solid, args):
        if apart is not None:
            raise WrongUsage(
                "--resume and --cluster measure a design on a grid, tile by tile; mesh files, --region, --thickness and "
                "beams without --edge need the whole surface in memory: leave out one or the other"
            )
        held = surface(args) if solid is None else meshed(solid, args)
        if args.solid is None and not held.closed and kind_of(args.file) == "3mf" and len(names := objects_of(args.file)) > 1:
            warn(
                f"{args.file} holds {len(names)} objects ({', '.join(map(repr, names))}), measured as one mesh; --solid NAME "
                "measures one of them"
            )
        if args.region:
            held = held.within(args.region)
        figures = held.measure().to_dict()
        figures |= {"self_intersections": held.self_intersections, "quality": held.quality, "defects": held.defects}
    else:
        with Progress("measuring", args.progress) as progress:
            made, quality = solid._measured(args.edge, args.per_cell, args.threads, progress, apart)
        figures = made.to_dict() | {"self_intersections": 0, "quality": quality, "defects": []}
        # What the method excludes is not looked for.
        figures["by_construction"] = ["self_intersections", "defects"]
    warn_measured("the design" if args.file == STDIN else args.file, figures)
    if solid is not None:
        off = None if held is None else held.chord_error
        edge = solid.spacing(args.edge, args.per_cell)
        figures |= (
            {"edge": edge, "volume_error": solid.volume_error(edge)} if off is None else {"edge": None, "chord_error": off}
        )
        if args.dangling:
            with Progress("looking for fragments", args.progress) as progress:
                figures["dangling"] = solid.dangling(threads=args.threads, progress=progress)
    settle()
    draw(found, args.transitions)
    if held is not None and args.thickness:
        with Progress("fitting balls", args.progress) as progress:
            balls = held.thickness(args.step, args.threads, progress)
        figures |= balls.measure()
        if args.histogram is not None:
            balls.render(args.histogram)
    if found:
        figures["transitions"] = list(found)
    if args.json:
        return put_json(figures | {"warnings": warned()})
    bare = solid is None and not args.region
    inverted = figures["closed"] and figures["volume"] < 0
    shown = figures | ({"closed": "yes, but inside out"} if inverted else {})
    print(table(shown, "needs a region (--region)" if bare else "none: all of it is the region's own surface"))
    for transition in found:
        print(transition)


def objects_of(file: str) -> list[str]:
    """The names of a 3MF's objects."""
    return _core.Mesh.objects(_core.read_file(file))


def apart_of(args: Namespace) -> dict | None:
    """How the figures are to be taken in ranges, if they are."""
    if not (args.resume or args.cluster or args.new):
        return None
    if args.file == STDIN and (args.resume or args.new):
        raise WrongUsage("--resume keeps what is done beside the design; name a file")
    return {"cluster": args.cluster, "new": args.new, "design_file": args.file if args.resume or args.new else None}


def measure_tets(args: Namespace) -> None:
    """``trabecula measure`` of a file of tetrahedra: volume, dihedral angles, sets."""
    import numpy as np

    from ..io import elements
    from ..io.file_sets import merged, of_vtu
    from ..io.quadratic import found_in
    from ..tets import TetMesh

    others = ("region", "solid", "thickness", "dangling", "transitions", "edge", "per_cell", "step", "resume", "cluster", "new")
    if any(getattr(args, name) for name in others):
        raise WrongUsage(f"{args.file} holds tetrahedra: of the options --json alone applies")
    with warnings.catch_warnings(record=True) as heard, elements.keeping() as arrays:
        warnings.simplefilter("always", DesignWarning)
        made = TetMesh.read(args.file, split=True)
    quality = made.report().quality
    for it in heard:
        # What tetrahedra that carry a lattice are warned of says what becomes of the lattice.
        if isinstance(it.message, DesignWarning):
            warn(re.sub(r": (the lattice will fall apart|cells are squashed) there$", "", it.message.message))
    full = found_in(args.file, quality.nodes, arrays)
    if full is not None and full.volume is None:
        warn(
            f"{args.file} has elements with nodes beside their corners, {full.nodes} nodes in all: the volume is that "
            f"between corners; {NEEDS}"
        )
    volume = quality.volume if full is None or full.volume is None else full.volume
    zones = np.asarray(made.zones)
    # A number beside the name of the same zones is no set.
    named = [numbers for name, numbers in made.zone_names.items() if not name.isdigit()]
    own = {name: it for name, it in made.zone_names.items() if not (name.isdigit() and it in named)}
    counts = {name: int(np.isin(zones, numbers).sum()) for name, numbers in own.items()}
    elements_of = {name: {"elements": count} for name, count in counts.items() if count}
    sets = merged(json.loads(str(arrays[-1])) if arrays else of_vtu(args.file), elements_of)
    figures = {
        "elements": quality.tets,
        "order": 1 if full is None else 2,
        "nodes": quality.nodes if full is None else full.nodes,
        "volume": volume,
        "min_angle": quality.dihedral.min,
        "max_angle": quality.dihedral.max,
        "pieces": quality.pieces,
        "bounds": quality.bounds,
        "sets": sets,
    }
    settle()
    if args.json:
        return put_json(figures | {"warnings": warned()})
    kind, between = ("", "") if full is None else ("quadratic ", " between corners")
    print(f"{quality.tets} {kind}tetrahedra, {figures['nodes']} nodes, volume {figure(volume)} mm³")
    print(f"dihedral angles{between} {quality.dihedral.min:.2f} to {quality.dihedral.max:.2f} degrees, pieces {quality.pieces}")
    for name, of in sets.items():
        print(f"set {name}: {', '.join(f'{of[what]} {what}' for what in ('nodes', 'elements', 'faces') if what in of)}")


def check_measure(args: Namespace) -> None:
    """Refuses options of ``measure`` that do not go together, before any work is done."""
    if not args.thickness and (args.step is not None or args.histogram is not None):
        raise WrongUsage("--step and --histogram belong to --thickness; add it")
    if args.region is not None and not os.path.exists(args.region):
        raise Refused(f"{args.region} does not exist")
    if args.histogram is not None:
        check_place(args.histogram)
        if any(same_file(name, args.histogram) for name in filter(None, (args.file, args.region))):
            raise Refused(f"{args.histogram} is read by this command; name another picture")


def closely(solid: Solid, args: Namespace) -> bool:
    """Whether a design is beams alone that are meshed without a grid."""
    return solid._chord_of(None, args.edge, args.per_cell, "drop-small") is not None


def warn_measured(name: str, figures: dict) -> None:
    """Warns of figures that may mislead, and of closed voids."""
    if (figures["solid_fraction"] or 0) > 1.01:
        warn(f"{name} holds more than the region does; they may not be in the same place or unit")
    if not figures["closed"]:
        flaws = [d for d in figures["defects"] if d.split(" ", 1)[1].startswith("edge")]
        why = ", ".join(flaws) or "triangles with a corner twice"
        return warn(f"{name} is not closed ({why}), so its volume and what follows from it mean little")
    if figures["volume"] < 0:
        warn(
            f"{name} is closed but inside out (its triangles run clockwise seen from outside), so its volume "
            "is negative and its solids count as cavities"
        )
    if figures["self_intersections"]:
        warn(
            f"the surface of {name} crosses itself, so volume in several of its bodies is counted "
            "several times; taken as a region (region.mesh) they are united"
        )
    if figures["volume"] >= 0 and figures["voids"]:
        warn(voids(figures["voids"]))


def transitions(solid: Solid, picture: str | None, design: str | None = None, tell: bool = True) -> Transitions:
    """The transitions of a blend, if one is asked for with a picture that can be written."""
    found = solid.transitions()
    for warning in found.warnings:
        warn(warning["message"], warning["path"], tell)
    settle()
    if picture is not None:
        if not found:
            raise WrongUsage("--transitions is for designs with a blend; this one has none")
        check_place(picture)
        if design is not None:
            keep_inputs(design, picture)
    return found


def draw(found: Transitions, picture: str | None) -> None:
    """Draws the transitions to ``picture`` if one is asked for."""
    if picture is not None:
        found.render(picture)
