"""The commands, over the public names of the package. What one needs is imported before its work begins."""

from __future__ import annotations

import os
import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from .. import _core, cell
from .. import beams as unit_cells
from ..base.files import check_place, read_text, write_text
from ..base.formats import (
    BEAM_ELEMENT_WRITES,
    DESIGNS,
    PART_READS,
    SHELL_WRITES,
    STDIN,
    SWEEP_WRITES,
    VOXEL_ELEMENT_WRITES,
    dotted,
    kind_of,
)
from ..base.given import shard_bytes
from ..base.terminal import Progress, figure, put_json, say, settle, warned
from ..base.texts import counted
from ..carrier import Carrier
from ..errors import DesignError, Refused, WrongUsage
from ..finite_elements import FiniteElements, check_steps
from ..mesh import region_of_file
from ..pictures.local_fields import fields_at
from ..volumes import check_case, check_order, check_solver
from ..voxels import fits_file
from .catalogue import cell_facts, cell_words, tet_cell_words, unit_cell_words
from .drawing import render
from .inputs import build, design_of, keep_file, keep_inputs, meshed, resolution, stdin_text
from .measuring import draw, measure, transitions
from .meshing import mesh, simplify
from .slicing import slice
from .starter import starter

# fmt: off
__all__ = [
    "cells", "check", "conductivity", "doctor", "faces", "law", "measure", "mesh", "new", "permeability", "render", "report",
    "schema", "simplify", "slice", "stiffness", "studio", "sweep", "tets", "view", "volume", "voxels",
]
# fmt: on

#: Characters of a word that are repeated in a message.
LONGEST = 80
#: The JSON Schema beside a new design.
SCHEMA_FILE = "design-schema.json"


def new(args: Namespace) -> None:
    """``trabecula new``."""
    known_cell(args.cell, cell.names())
    if args.beams:
        known_cell(args.beams, unit_cells.names())
    beside = os.path.join(os.path.dirname(args.file), SCHEMA_FILE) if args.schema else None
    for name in filter(None, (args.file, beside)):
        if os.path.isfile(name) and not args.force and not (name == beside and holds(name, _core.schema())):
            raise Refused(f"{name} exists; choose another name or folder, or replace it with --force")
        check_place(name)
    part = None
    if args.part:
        low, high = region_of_file(args.part).bounds
        path = os.path.relpath(os.path.abspath(args.part), os.path.dirname(os.path.abspath(args.file)))
        part = (path.replace(os.sep, "/"), [b - a for a, b in zip(low, high, strict=True)])
    meshes = "/".join(PART_READS).upper()
    named = SCHEMA_FILE if args.schema else None
    texts = [(args.file, starter(os.path.basename(args.file), args.cell, args.beams, part, args.skin, meshes, named))]
    texts += [(beside, _core.schema())] if beside else []
    for name, text in texts:
        write_text(name, text)
    say(f"{args.file} written; next: trabecula check {args.file}")


def holds(name: str, text: str) -> bool:
    """Whether a file holds this text."""
    with open(name, "rb") as file:
        return file.read() == text.encode()


def check(args: Namespace) -> None:
    """``trabecula check``."""
    solid = build(args.design, tell=not args.json)
    report = solid.report()
    error = solid.volume_error(report.spacing) if report.chord is None else None
    found = transitions(solid, args.transitions, tell=not args.json)
    draw(found, args.transitions)
    if args.json:
        figures = report.to_dict() | {"volume_error": error}
        if report.blend:
            figures["blend"]["transitions"] = [t.to_dict() for t in found]
            figures["warnings"] += found.warnings
        return put_json(figures)
    expect = [] if error is None else [f"        volume error to expect of a mesh at that spacing {error:.1g}"]
    if report.chord is None and (coarser := solid.spacing()) > report.spacing:
        expect.append(f"        mesh takes {coarser:.3g} mm, or there would be more than 20 million triangles")
    print("\n".join(map(str, [report, *expect, *found])))


def faces(args: Namespace) -> None:
    """``trabecula faces``."""
    from ..io.cad import read

    part = read(args.file, solid=args.solid)
    settle()
    if args.json:
        listed = [{"number": i, "name": name, "color": color, "area": a} for i, (name, color, a) in enumerate(part.labels, 1)]
        return put_json({"solids": part.solids, "volume": part.volume, "faces": listed})
    print(f"{'face':>5}  {'name':20} {'colour':8} {'area (mm²)':>12}")
    for i, (name, color, area) in enumerate(part.labels, 1):
        print(f"{i:5}  {name or '-':20} {color or '-':8} {figure(area):>12}")
    within = "" if part.volume is None else f", volume {figure(part.volume)} mm³"
    print(f"{counted(len(part.solids), 'solid')}: {', '.join(name or '-' for name in part.solids)}{within}")


def voxels(args: Namespace) -> None:
    """``trabecula voxels``."""
    import numpy  # noqa: F401  wanted in the end; see `terminal` for why no import waits until then

    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    options = {"step" if k == "edge" else k: v for k, v in resolution(args).items()}
    with Progress("sampling", args.progress) as progress:
        if args.resume or args.cluster or args.new or args.shards:
            apart = {"cluster": args.cluster, "new": args.new, "shards": shard_bytes(args.shards)}
            size = options.get("step"), options.get("per_cell")
            made = solid._save_voxels(args.output, *size, args.threads, progress, apart, settle)
        else:
            spacing, count = solid._voxel_grid(options.get("step"), options.get("per_cell"))
            fits_file(args.output, count, spacing)
            grid = solid.voxels(threads=args.threads, progress=progress, **options)
            settle()
            grid.write(args.output)
            made = {"shape": list(grid.shape), "step": grid.step, "origin": grid.origin, "volume": grid.volume}
    made["solid_fraction"] = made["volume"] / solid.region_volume(made["step"])
    made["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return put_json(made | {"warnings": warned()})
    shape = " × ".join(map(str, made["shape"]))
    say(
        f"{args.output}: {shape} voxels of {made['step']:g} mm, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, {made['seconds']:.2f} s"
    )


def volume(args: Namespace) -> None:
    """``trabecula volume``."""
    import numpy as np

    (check_case if kind_of(args.output) == "foam" else check_place)(args.output)
    keep_file(args.design, args.output)
    if args.order is None:
        args.order = 2 if args.of == "beams" and kind_of(args.output) != "bdf" else 1
    check_elements(args)
    check_sets(args)
    solid = build(args.design, tell=not args.json)
    carried = args.of == "carrier"
    named = [name for name in args.fields or () if not (carried and name == "stiffness")]
    try:
        fields_at(solid, named, np.array(solid.bounds))
    except ValueError as error:
        raise Refused(f"--fields: {error}") from None
    start = time.perf_counter()
    made: FiniteElements
    with Progress("meshing", args.progress) as progress:
        if args.voxels is not None:
            share = {} if args.least is None else {"least": args.least}
            made = solid.voxel_elements(args.voxels, threads=args.threads, progress=progress, **share)
        elif carried:
            made = solid.carrier(args.order, args.threads)
        elif args.of == "beams":
            made = solid.beam_mesh(args.edge, args.order, args.islands, args.threads)
        elif args.of == "shell":
            made = solid.shell_mesh(args.edge, args.per_cell, args.order, args.threads, progress)
        else:
            size = args.edge, args.per_cell, args.wall
            made = solid.volume_mesh(*size, args.order, args.of, args.periodic, args.threads, progress, args.islands)
    missing = [name for name in args.sets or () if name not in made.report().sets]
    if missing:
        raise Refused(f"--sets: {missing[0]} is empty; the mesh has {', '.join(made.report().sets)}")
    fields = fields_at(solid, named, made.nodes)
    if isinstance(made, Carrier) and "stiffness" in (args.fields or ()):
        with Progress("stiffness", args.progress) as progress:
            fields |= made.materials(args.nu, kind_of(args.output), args.threads, progress)
    settle()
    solver = {"solver": args.solver or "calculix"} if args.of == "beams" else {"oriented": True} if args.oriented else {}
    made.write(args.output, args.E, args.nu, args.hold or (), dict(args.load or ()), fields, **solver)
    figures = made.report().to_dict() | {"seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        return put_json(figures | {"warnings": warned()})
    what, quality = "hexahedra", ""
    if args.of == "shell":
        what, quality = "triangles", f", thickness {figures['thinnest']:.4g} to {figures['thickest']:.4g} mm"
    elif args.of == "beams":
        what, quality = "elements", f", radius {figures['thinnest']:.4g} to {figures['thickest']:.4g} mm"
    elif args.voxels is None:
        what = "tetrahedra"
        quality = f", dihedral angles {figures['min_angle']:.1f} to {figures['max_angle']:.1f} degrees"
    if figures.get("dropped", 0) > 1e-6 * made.volume:
        quality += f", {figures['dropped']:.2g} mm³ dropped"
    say(
        f"{args.output}: {figures['elements']} {what}, {figures['nodes']} nodes, volume {figure(made.volume)} mm³{quality}; "
        f"sets {', '.join(figures['sets'])}; {figures['seconds']:.2f} s"
    )


def check_elements(args: Namespace) -> None:
    """Refuses options of ``volume`` that do not go together, before any work is done."""
    kind = kind_of(args.output)
    if args.fields and kind not in ("vtu", "xdmf") and (kind != "msh" or args.voxels is not None):
        of = ".vtu and .xdmf" if args.voxels is not None else ".vtu, .xdmf and .msh"
        raise WrongUsage(f"--fields is for {of}, not {args.output}")
    if args.oriented and (args.of != "carrier" or kind != "inp"):
        raise WrongUsage("--oriented is for --of carrier in an .inp; leave it out")
    check_steps(kind, args.hold or (), dict(args.load or ()))
    if args.hold and args.periodic:
        raise WrongUsage("a periodic mesh has steps of its own; leave out --hold and --load")
    if args.hold and args.of not in ("solid", "shell", "beams", "carrier"):
        raise WrongUsage(f"--hold and --load are for --of solid, shell, beams or carrier, not {args.of}")
    if args.solver and args.of != "beams":
        raise WrongUsage("--solver belongs to --of beams; other .inp files are the same for both")
    whole = args.voxels is not None or args.of in ("shell", "carrier")
    if args.islands != "keep" and (whole or args.periodic or args.of == "all"):
        raise WrongUsage("--islands is for beams, and tetrahedra of one domain that is not periodic; leave it out")
    if args.voxels is None:
        if args.least is not None:
            raise WrongUsage("--least belongs to --voxels; add it")
        check_order(kind, args.order)
        if args.of == "carrier":
            sized = {"--edge": args.edge, "--per-cell": args.per_cell, "--wall": args.wall, "--periodic": args.periodic}
            for name in (name for name, given in sized.items() if given):
                raise WrongUsage(f"{name} is for other meshes than --of carrier, of the design's own tetrahedra; leave it out")
        if args.of in ("shell", "beams"):
            sized = {"--wall": args.wall, "--periodic": args.periodic}
            sized |= {"--per-cell": args.per_cell} if args.of == "beams" else {}
            for name in (name for name, given in sized.items() if given):
                raise WrongUsage(f"{name} is for other meshes than --of {args.of}; leave it out")
            writes = SHELL_WRITES if args.of == "shell" else BEAM_ELEMENT_WRITES
            if kind not in writes:
                raise Refused(f"{args.output}: the name of {args.of.removesuffix('s')}s must end in {dotted(writes)}")
        if args.of == "beams":
            try:
                check_solver(kind, args.solver, args.order)
            except ValueError as error:
                raise Refused(f"{args.output}: {error}") from None
        return
    given = {"--order": args.order != 1, "--of": args.of != "solid", "--periodic": args.periodic}
    for name in (name for name, is_given in given.items() if is_given):
        raise WrongUsage(f"{name} is for tetrahedra; leave it out, or --voxels")
    if kind_of(args.output) not in VOXEL_ELEMENT_WRITES:
        raise Refused(f"{args.output}: the name of voxels must end in {dotted(VOXEL_ELEMENT_WRITES)}")


def check_sets(args: Namespace) -> None:
    """Refuses names of sets to hold or to load that no mesh of this design has."""
    named = [("--hold", name) for name in args.hold or ()] + [("--load", name) for name, _ in args.load or ()]
    if not named:
        return
    design = design_of(args.design)
    surface = args.voxels is not None or args.of == "carrier"
    own = ("SURFACE",) if surface else {"shell": ("BORDER",), "beams": ()}.get(args.of, ("CUT", "LATTICE"))
    known = [*own, "X0", "X1", "Y0", "Y1", "Z0", "Z1", *(design.set or ())]
    if not surface and args.of not in ("shell", "beams"):
        known += ["SKIN"] if design.skin else []
        known += ["NET"] if any("tets" in it["map"] for it in design.to_dict().get("lattice", {}).values()) else []
        known += [f"KEEP_{name}" for name in design.keep or ()]
    for option, name in named:
        if name not in known and not name.startswith("CORE_"):
            raise Refused(f"{option}: no mesh of this design has a set {name}; it may have {', '.join(known)}")


def sweep(args: Namespace) -> None:
    """``trabecula sweep``."""
    from .sweeping import draw, table_of, units_of

    if args.plot and not 2 <= len(args.plot) <= 3:
        raise WrongUsage(f"--plot takes two columns, or three: X Y COLOUR; found {len(args.plot)}")
    if args.front and not args.plot:
        raise WrongUsage("--front is of --plot; name columns, or leave it out")
    drawing = os.path.splitext(args.output)[0] + ".svg" if args.plot else None
    of_table = kind_of(args.study) in SWEEP_WRITES
    for name in filter(None, (args.output, drawing, None if of_table else units_of(args.output))):
        check_place(name)
        keep_file(args.study, name)
    if of_table:
        if not drawing:
            raise Refused(f"{args.study} is a table already; say with --plot X Y what to draw of it")
        return draw(args.study, args, drawing)
    start = time.perf_counter()
    figures = table_of(design_of(args.study), args)
    if drawing:
        draw(args.output, args, drawing)
    figures["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return put_json(figures)
    failed = f", {figures['failed']} of them with an error (see that column)" if figures["failed"] else ""
    taken = f"; {figures['resumed']} from an earlier run" if figures["resumed"] else ""
    say(f"{args.output}: {counted(figures['rows'], 'design')}{failed}{taken}, {figures['seconds']:g} s")


def tets(args: Namespace) -> None:
    """``trabecula tets``."""
    import numpy  # noqa: F401  wanted by all but vtu; see `terminal` for why no import waits until then

    from ..tets import TetMesh

    of_file = kind_of(args.file) not in DESIGNS
    if of_file and args.lattice:
        raise WrongUsage("--lattice belongs to a design; a file of tetrahedra has none")
    if not of_file and (args.unit or args.split):
        raise WrongUsage("--unit and --split belong to a file of tetrahedra; in a design they stand under map.tets")
    if args.output:
        check_place(args.output)
        keep_file(args.file, args.output)
    start = time.perf_counter()
    made = TetMesh.read(args.file, args.unit, args.split) if of_file else TetMesh.of(args.file, args.lattice, args.threads)
    report = made.report()
    seconds = round(time.perf_counter() - start, 3)
    if args.output:
        keep_file(os.path.join(os.path.dirname(os.path.abspath(args.file)), report.mesher), args.output)
        made.write(args.output)
    if args.json:
        return put_json(report.to_dict() | {"seconds": seconds})
    print(report)
    if args.output:
        say(f"{args.output}: {report.quality.tets} tetrahedra, {seconds:.2f} s")


def report(args: Namespace) -> None:
    """``trabecula report``."""
    from ..pictures.part_page import part_page
    from ..pictures.viewer import write_page

    check_place(args.output)
    keep_inputs(args.design, args.output)
    solid = build(args.design)
    made = meshed(solid, args)
    balls = None
    if args.thickness:
        with Progress("fitting balls", args.progress) as progress:
            balls = made.thickness(None, args.threads, progress)
    name = os.path.splitext(os.path.basename(args.design))[0] if args.design != STDIN else "part"
    title = args.title or name.replace("_", " ").capitalize()
    text = stdin_text() if args.design == STDIN else read_text(args.design)
    settle()
    with Progress("lightening", args.progress) as progress:
        page = part_page(solid, made, text, title, balls, warned(), progress)
    write_page(args.output, page)
    say(f"{args.output}: {os.path.getsize(args.output) / 1e6:.2g} MB, {made.counts[1]} triangles measured")


def schema(args: Namespace) -> None:
    """``trabecula schema``."""
    print(_core.schema().rstrip("\n"))


def cells(args: Namespace) -> None:
    """``trabecula cells``."""
    names: Sequence[str]
    facts: Callable[[str], dict[str, Any]]
    words: Callable[[dict], Iterator[str]]
    tet, beams = args.tet, args.beams
    others: dict[str, str] = {}
    if args.name and not (tet or beams) and args.name not in cell.names():
        # A name of one of the other lists says itself which is meant.
        tet = args.name in cell.tet_names()
        beams = not tet and args.name in unit_cells.names()
        others = dict.fromkeys(unit_cells.names(), "of beams") | dict.fromkeys(cell.tet_names(), "of tetrahedra")
    if tet:
        names, facts, words = cell.tet_names(), cell.tet_facts, tet_cell_words
    elif beams:
        found = {it["name"]: it for it in unit_cells.cells()}
        names, facts, words = list(found), found.__getitem__, unit_cell_words
    else:
        names, facts, words = cell.names(), cell_facts, cell_words
    if args.name:
        known_cell(args.name, names, others)
        names = [args.name]
    made = [facts(name) for name in names]
    if args.json:
        return put_json(made[0] if args.name else made)
    for it in made:
        print(f"{it['name']}  ({it['title']})")
        print("\n".join(f"  {line}" for line in words(it)))


def stiffness(args: Namespace) -> None:
    """``trabecula stiffness``."""
    of_cell(args)


def conductivity(args: Namespace) -> None:
    """``trabecula conductivity``."""
    of_cell(args)


def permeability(args: Namespace) -> None:
    """``trabecula permeability``."""
    of_cell(args)


def law(args: Namespace) -> None:
    """``trabecula law``."""
    import numpy  # noqa: F401  wanted later; see `terminal` for why no import waits until then

    from . import effective

    found = effective.law(args)
    if args.json:
        return put_json(found.to_dict())
    print("\n".join(effective.lines_of_law(found)))


def of_cell(args: Namespace) -> None:
    """A figure of the periodic cell, by the name of the command."""
    import numpy  # noqa: F401  wanted later; see `terminal` for why no import waits until then

    from . import effective

    found = getattr(effective, args.command)(args)
    if args.json:
        return put_json(found.to_dict())
    print("\n".join(effective.LINES[args.command](found)))


def studio(args: Namespace) -> None:
    """``trabecula studio``."""
    import webbrowser

    from .studio import Studio

    with Studio(args.design, args.port) as server:
        print(server.url, flush=True)
        say("the studio is served at this address, to this machine alone; Ctrl-C ends it")
        if args.open:
            webbrowser.open(server.url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            say("ended")


def view(args: Namespace) -> None:
    """``trabecula view``: the studio with a design."""
    studio(args)


def doctor(args: Namespace) -> None:
    """``trabecula doctor``."""
    from .doctor import state, words

    found = state()
    if args.json:
        return put_json(found)
    print("\n".join(words(found)))


def known_cell(name: str, known: Sequence[str], others: Mapping[str, str] | None = None) -> None:
    """Refuses the name of no cell. ``others`` says which kind other names that it may have meant are of."""
    if name not in known:
        from difflib import get_close_matches

        kinds = {**(others or {}), **dict.fromkeys(known, "")}
        near = get_close_matches(name[:LONGEST], kinds, 1)
        meant = f'"{near[0]}" {kinds[near[0]]}'.rstrip() if near else ""
        hint = _other_name(name) or (f"; did you mean {meant}?" if near else ".")
        more = "; --beams and --tet list others" if others else ""
        raise Refused(f'no cell is named "{name:.{LONGEST}}"{hint} There are: {", ".join(known)}{more}')


def _other_name(name: str) -> str:
    """What the core says of a surface's name elsewhere, if it knows it."""
    cell = {"cell": name, "part": "lower", "map": {"affine": {"wavelength": 1}}, "level": {"iso": 0}}
    try:
        _core.Design.from_data({"schema": 1, "region": {"box": {"size": [1, 1, 1]}}, "lattice": {"core": cell}})
    except DesignError as error:
        said = error.message.partition(".")[0]
        return f": {said}." if " is called " in said else ""
    return ""
