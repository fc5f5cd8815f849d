"""The commands, over the public names of the package. What one needs is imported before its work begins."""

from __future__ import annotations

import os
import time

from . import _core, cell
from . import beams as unit_cells
from .camera import VIEWS, section_plane, towards
from .catalogue import cell_facts, cell_words, tet_cell_words, unit_cell_words
from .errors import Refused
from .files import check_place, read_text, whole_file
from .formats import (
    DESIGNS,
    MESH_READS,
    MESH_WRITES,
    STDIN,
    STEP_WRITES,
    VOLUME_READS,
    VOXEL_ELEMENT_WRITES,
    dotted,
    is_design,
    kind_of,
)
from .inputs import build, closes, design_of, keep_file, keep_inputs, meshed, resolution, same_file, stdin_text, surface
from .mesh import Mesh, region_of_file
from .parts import part_files, write_parts
from .shown import look
from .solid import Solid
from .starter import starter
from .terminal import Progress, figure, put_json, say, settle, warn, warned
from .texts import counted, table, voids

__all__ = [
    *("cells", "check", "conductivity", "doctor", "law", "measure", "mesh", "new"),
    *(
        "permeability",
        "render",
        "report",
        "schema",
        "simplify",
        "slice",
        "stiffness",
        "studio",
        "sweep",
        "tets",
        "volume",
        "voxels",
    ),
]


#: The JSON Schema beside a new design.
SCHEMA_FILE = "design-schema.json"


def new(args) -> None:
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
    meshes = "/".join(MESH_READS).upper()
    named = SCHEMA_FILE if args.schema else None
    texts = [(args.file, starter(os.path.basename(args.file), args.cell, args.beams, part, args.skin, meshes, named))]
    texts += [(beside, _core.schema())] if beside else []
    for name, text in texts:
        with whole_file(name) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as out:
            out.write(text)
    say(f"{args.file} written; next: trabecula check {args.file}")


def holds(name: str, text: str) -> bool:
    """Whether a file holds this text."""
    with open(name, "rb") as file:
        return file.read() == text.encode()


def check(args) -> None:
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


def mesh(args) -> None:
    """``trabecula mesh``."""
    if args.beams:
        return mesh_beams(args)
    if args.implicit:
        return mesh_implicit(args)
    if args.no_mesh:
        raise Refused("--no-mesh belongs to --beams; add it")
    if kind_of(args.output) in STEP_WRITES:
        return mesh_step(args)
    if kind_of(args.output) not in MESH_WRITES:
        raise Refused(f"a .{kind_of(args.output)} holds beams, not their surface: add --beams")
    if args.parts:
        return mesh_parts(args)
    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    if not (args.smooth or args.open or args.tolerance is not None or args.triangles is not None):
        args.chord = solid._chord_of(args.chord, args.edge, args.per_cell, args.islands)
    with Progress("meshing", args.progress) as progress:
        made = meshed_file(solid, args, progress)
    edge = solid.spacing(args.edge, args.per_cell)
    made["solid_fraction"] = made["volume"] / solid.region_volume(edge)
    made["edge"] = None if args.chord is not None else edge
    made["bytes"] = os.path.getsize(args.output)
    made["seconds"] = round(time.perf_counter() - start, 3)
    others = made["islands"]
    if others and others["dropped"]:
        pieces = counted(others["dropped"], "small piece" if args.islands == "drop-small" else "piece")
        say(f"{pieces} dropped: {others['dropped_volume']:.3g} mm³ in all")
    if others and others["filled"]:
        filled = counted(others["filled"], "closed void")
        say(f"{filled} smaller than a grid cell filled: {others['filled_volume']:.3g} mm³ in all")
    if args.json:
        return put_json(made | {"warnings": warned()})
    size = f"edge {edge:g} mm" if args.chord is None else f"within {made['chord_error']:.3g} mm"
    say(
        f"{args.output}: {made['triangles']} triangles, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, area {figure(made['area'])} mm², {counted(made['pieces'])}; {size}, "
        f"{made['seconds']:.2f} s"
    )


def mesh_step(args) -> None:
    """``trabecula mesh -o OUT.step``."""
    names = ("parts", "open", "smooth", "chord", "edge", "per_cell", "tolerance", "triangles")
    given = ["--" + name.replace("_", "-") for name in names if getattr(args, name)]
    given += [f"--islands {args.islands}"] if args.islands in ("drop", "error") else []
    if given:
        raise Refused(f"{given[0]} does not go with a STEP file: it has the exact surface, and no triangles; leave it out")
    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    settle()
    made = solid.save_step(args.output).to_dict()
    made |= {"bytes": os.path.getsize(args.output), "seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        return put_json(made | {"warnings": warned()})
    say(
        f"{args.output}: {made['faces']} faces, {made['edges']} edges, volume {figure(made['volume'])} mm³, "
        f"{counted(made['solids'], 'solid')}; exact, {made['seconds']:.2f} s"
    )


def mesh_beams(args) -> None:
    """``trabecula mesh --beams``."""
    kind = kind_of(args.output)
    names = ["implicit", "parts", "open", "smooth", "edge", "per_cell", "tolerance", "triangles"]
    names += [] if kind == "3mf" else ["chord", "no_mesh"]
    given = ["--" + name.replace("_", "-") for name in names if getattr(args, name)]
    given += [f"--islands {args.islands}"] if args.islands != "drop-small" else []
    if given:
        raise Refused(f"{given[0]} does not go with --beams and a .{kind}: it has beams, not their surface; leave it out")
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    settle()
    made = solid.save_beams(args.output, args.chord, not args.no_mesh, args.threads).to_dict()
    made |= {"bytes": os.path.getsize(args.output), "seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        return put_json(made | {"warnings": warned()})
    within = "" if made["error"] is None else f"; radii within {made['error']:.2g} mm"
    balls = f", {counted(made['balls'], 'ball')}" if made["balls"] else ""
    say(
        f"{args.output}: {counted(made['beams'], 'beam')}{balls}, {counted(made['nodes'], 'node')}{within}, "
        f"{made['bytes']} bytes, {made['seconds']:.2f} s"
    )


def mesh_implicit(args) -> None:
    """``trabecula mesh --implicit``."""
    names = ("no_mesh", "parts", "open", "smooth", "edge", "per_cell", "tolerance", "triangles", "chord")
    given = ["--" + name.replace("_", "-") for name in names if getattr(args, name)]
    given += [f"--islands {args.islands}"] if args.islands != "drop-small" else []
    if given:
        raise Refused(f"{given[0]} does not go with --implicit: the file has a function, and no triangles; leave it out")
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    settle()
    made = solid.save_implicit(args.output) | {"seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        return put_json(made | {"warnings": warned()})
    say(f"{args.output}: a function of {counted(made['nodes'], 'node')}, {made['bytes']} bytes, {made['seconds']:.2f} s")


def mesh_parts(args) -> None:
    """``trabecula mesh --parts``."""
    others = {
        "--open": args.open,
        "--smooth": args.smooth,
        "--chord": args.chord,
        "--tolerance": args.tolerance,
        "--triangles": args.triangles,
    }
    if alone := [name for name, value in others.items() if value]:
        raise Refused(f"{alone[0]} does not go with --parts: the parts have to keep their common triangles; leave it out")
    if args.islands == "drop":
        raise Refused("--islands drop does not go with --parts: a dropped piece would leave a gap between them; leave it out")
    files = part_files(args.output, args.parts)
    start = time.perf_counter()
    for name in files.values():
        check_place(name)
    solid = build(args.design)
    for name in files.values():
        keep_inputs(args.design, name)
    islands = "error" if args.islands == "error" else "keep"
    with Progress("meshing", args.progress) as progress:
        parts = solid.parts(args.edge, args.per_cell, args.parts, args.threads, progress, islands)
    settle()
    write_parts(args.output, parts)
    edge = solid.spacing(args.edge, args.per_cell)
    made = {"parts": {}, "edge": edge, "region_volume": solid.region_volume(edge)}
    for name, mesh in parts.items():
        share = {"solid_fraction": mesh.volume / made["region_volume"], "file": files[name]}
        made["parts"][name] = mesh.summary().to_dict() | share
    made["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return put_json(made | {"warnings": warned()})
    for name, it in made["parts"].items():
        say(
            f"{name}: {it['triangles']} triangles, volume {figure(it['volume'])} mm³, {it['solid_fraction']:.4f} of the "
            f"region, area {figure(it['area'])} mm², {counted(it['pieces'])}; {it['file']}"
        )
    say(f"edge {edge:g} mm, {made['seconds']:.2f} s")


def meshed_file(solid: Solid, args, progress: Progress) -> dict:
    """Meshes a solid into a file, streamed where it can be; gives the figures."""
    lighter = args.tolerance is not None or args.triangles is not None
    options = {**resolution(args), "threads": args.threads, "progress": progress, "islands": args.islands}
    options |= {"smooth": True} if args.smooth else {}
    asked = {} if args.chord is None else {"chord": args.chord}
    is_open = args.open or solid.open_ends
    whole = lighter or args.smooth or is_open
    if not whole and (kind_of(args.output) == "stl" if asked else not closes(solid, resolution(args))):
        given = {"edge": None, "per_cell": None, "chord": None} | options

        def accept(found) -> None:
            if found.cavities:
                warn(
                    f"{counted(found.cavities, 'closed void')}, from which powder or resin cannot drain; "
                    f"`trabecula measure {args.output}` tells where"
                )
            settle()

        return solid._save(args.output, **given, accept=accept).to_dict() | asked
    if not lighter and not asked:
        solid.check_room(args.output, **resolution(args))
    surface = solid.mesh(**options)
    progress.clear()
    error = {"chord_error": surface.chord_error} if asked else {}
    if it := surface.smoothing:
        say(
            f"smoothed: the smallest angle of 19 in 20 triangles is {it.smallest_angle_p05:.3g}° or more, before "
            f"{it.smallest_angle_p05_before:.3g}°; of all {it.smallest_angle:.2g}°, before {it.smallest_angle_before:.2g}°"
        )
    surface = simplified(surface, args) if lighter else surface
    made = surface.summary().to_dict() | asked | error
    if not asked:
        made["voids"] = [v.to_dict() for v in surface.voids]
        if surface.simplification:
            made["simplification"] = surface.simplification.to_dict()
        if surface.smoothing:
            made["smoothing"] = surface.smoothing.to_dict()
        if surface.voids:
            warn(voids(surface.voids))
    settle()
    if is_open:
        surface = surface.uncapped()
        made |= {"triangles": surface.counts[1], "open": True}
        say("open at the region's boundary: volume and fraction are the closed part's")
    surface.write(args.output)
    return made


def simplify(args) -> None:
    """``trabecula simplify``."""
    check_place(args.output)
    start = time.perf_counter()
    if same_file(args.file, args.output):
        raise Refused(f"{args.output} is what is simplified; name another output")
    made = simplified(Mesh.read(args.file), args)
    made.write(args.output)
    if args.json:
        put_json(made.simplification.to_dict() | {"seconds": round(time.perf_counter() - start, 3)})


def simplified(mesh: Mesh, args) -> Mesh:
    """The lighter mesh, and a message on what was done."""
    with Progress("simplifying", args.progress) as progress:
        made = mesh.simplified(args.tolerance, args.triangles, progress)
    it = made.simplification
    if args.triangles and it.triangles_before <= args.triangles:
        say(f"{it.triangles} triangles are no more than {args.triangles} already: left as they are")
        return made
    if args.triangles and not args.tolerance and it.triangles > args.triangles:
        warn(f"{it.triangles} triangles are the fewest that keep the surface whole; {args.triangles} were asked for")
    change = 100 * (it.volume / it.volume_before - 1)
    say(
        f"simplified from {it.triangles_before} to {it.triangles} triangles, nowhere farther than "
        f"{it.deviation:.2g} mm from the first; volume {change:+.2g} %"
    )
    return made


def voxels(args) -> None:
    """``trabecula voxels``."""
    import numpy  # noqa: F401  wanted in the end; see `terminal` for why no import waits until then

    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    options = {"step" if k == "edge" else k: v for k, v in resolution(args).items()}
    with Progress("sampling", args.progress) as progress:
        grid = solid.voxels(threads=args.threads, progress=progress, **options)
    settle()
    grid.write(args.output)
    made = {"shape": list(grid.shape), "step": grid.step, "origin": grid.origin, "volume": grid.volume}
    made["solid_fraction"] = made["volume"] / solid.region_volume(grid.step)
    made["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return put_json(made | {"warnings": warned()})
    shape = " × ".join(map(str, grid.shape))
    say(
        f"{args.output}: {shape} voxels of {grid.step:g} mm, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, {made['seconds']:.2f} s"
    )


def volume(args) -> None:
    """``trabecula volume``."""
    check_place(args.output)
    keep_file(args.design, args.output)
    check_voxels(args)
    solid = build(args.design, tell=not args.json)
    start = time.perf_counter()
    with Progress("meshing", args.progress) as progress:
        if args.voxels is not None:
            made = solid.voxel_elements(args.voxels, args.least or 0.01, args.threads, progress)
        else:
            size = args.edge, args.per_cell, args.wall
            made = solid.volume_mesh(*size, args.order, args.of, args.periodic, args.threads, progress)
    missing = [name for name in args.sets or () if name not in made.report().sets]
    if missing:
        raise Refused(f"--sets: {missing[0]} is empty; the mesh has {', '.join(made.report().sets)}")
    settle()
    made.write(args.output, args.E, args.nu, args.hold or (), dict(args.load or ()))
    figures = made.report().to_dict() | {"seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        return put_json(figures | {"warnings": warned()})
    what, quality = "tetrahedra", ""
    if args.voxels is None:
        quality = f", dihedral angles {figures['min_angle']:.1f} to {figures['max_angle']:.1f} degrees"
    else:
        what = "hexahedra"
    say(
        f"{args.output}: {figures['elements']} {what}, {figures['nodes']} nodes, volume {figure(made.volume)} mm³{quality}; "
        f"sets {', '.join(figures['sets'])}; {figures['seconds']:.2f} s"
    )


def check_voxels(args) -> None:
    """Refuses options of ``volume`` that do not go together, before any work is done."""
    if args.voxels is None:
        if args.least is not None:
            raise Refused("--least belongs to --voxels; add it")
        return
    given = {"--order": args.order != 1, "--of": args.of != "solid", "--periodic": args.periodic}
    for name in (name for name, is_given in given.items() if is_given):
        raise Refused(f"{name} is for tetrahedra; leave it out, or --voxels")
    if kind_of(args.output) not in VOXEL_ELEMENT_WRITES:
        raise Refused(f"{args.output}: the name of voxels must end in {dotted(VOXEL_ELEMENT_WRITES)}")


def measure(args) -> None:
    """``trabecula measure``."""
    check_measure(args)
    if kind_of(args.file) in VOLUME_READS:
        return measure_tets(args)
    solid = build(args.file) if is_design(args.file) else None
    if args.dangling and solid is None:
        raise Refused("--dangling is for designs: the narrowest neck of the lattice is not known for a mesh file")
    if solid is None and args.transitions is not None:
        raise Refused("--transitions is for designs with a blend; this is a mesh")
    found = () if solid is None else transitions(solid, args.transitions, args.file)
    held, figures = None, None
    if solid is None or args.region or args.thickness or closely(solid, args):
        held = surface(args) if solid is None else meshed(solid, args)
        if args.region:
            held = held.within(args.region)
        figures = held.measure().to_dict()
        figures |= {"self_intersections": held.self_intersections, "quality": held.quality, "defects": held.defects}
    else:
        with Progress("measuring", args.progress) as progress:
            made, quality = solid._measured(args.edge, args.per_cell, args.threads, progress)
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
    if args.thickness:
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


def measure_tets(args) -> None:
    """``trabecula measure`` of a file of tetrahedra: volume, dihedral angles, sets of elements."""
    import numpy as np

    from .tets import TetMesh

    if args.region or args.thickness or args.dangling or args.transitions or args.edge or args.per_cell:
        raise Refused(f"{args.file} holds tetrahedra: of the options --json alone applies")
    made = TetMesh.read(args.file, split=True)
    quality = made.report().quality
    zones = np.asarray(made.zones)
    sets = {name: {"elements": int(np.isin(zones, numbers).sum())} for name, numbers in made.zone_names.items()}
    figures = {
        "elements": quality.tets,
        "nodes": quality.nodes,
        "volume": quality.volume,
        "min_angle": quality.dihedral.min,
        "max_angle": quality.dihedral.max,
        "pieces": quality.pieces,
        "bounds": quality.bounds,
        "sets": sets,
    }
    settle()
    if args.json:
        return put_json(figures | {"warnings": warned()})
    print(f"{quality.tets} tetrahedra, {quality.nodes} nodes, volume {figure(quality.volume)} mm³")
    print(f"dihedral angles {quality.dihedral.min:.2f} to {quality.dihedral.max:.2f} degrees, pieces {quality.pieces}")
    for name, of in sets.items():
        print(f"set {name}: {of['elements']} elements")


def check_measure(args) -> None:
    """Refuses options of ``measure`` that do not go together, before any work is done."""
    if not args.thickness and (args.step is not None or args.histogram is not None):
        raise Refused("--step and --histogram belong to --thickness; add it")
    if args.region is not None and not os.path.exists(args.region):
        raise Refused(f"{args.region} does not exist")
    if args.histogram is not None:
        check_place(args.histogram)
        if any(same_file(name, args.histogram) for name in filter(None, (args.file, args.region))):
            raise Refused(f"{args.histogram} is read by this command; name another picture")


def closely(solid: Solid, args) -> bool:
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


def sweep(args) -> None:
    """``trabecula sweep``."""
    from .sweeping import draw, table_of

    drawing = os.path.splitext(args.output)[0] + ".svg" if args.plot else None
    for name in filter(None, (args.output, drawing)):
        check_place(name)
        keep_file(args.study, name)
    if kind_of(args.study) == "csv":
        if not args.plot:
            raise Refused(f"{args.study} is a table already; say with --plot X Y what to draw of it")
        draw(args.study, args, drawing)
        return say(f"{drawing}: written")
    start = time.perf_counter()
    figures = table_of(design_of(args.study), args)
    if args.plot:
        draw(args.output, args, drawing)
    figures["seconds"] = round(time.perf_counter() - start, 3)
    if args.json:
        return put_json(figures)
    failed = f", {figures['failed']} of them without a solid (see the column error)" if figures["failed"] else ""
    taken = f"; {figures['resumed']} from an earlier run" if figures["resumed"] else ""
    say(f"{args.output}: {counted(figures['rows'], 'design')}{failed}{taken}, {figures['seconds']:g} s")


def slice(args) -> None:
    """``trabecula slice``."""
    from .slicing import sliced

    sliced(args)


def tets(args) -> None:
    """``trabecula tets``."""
    import numpy  # noqa: F401  wanted by all but vtu; see `terminal` for why no import waits until then

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


def render(args) -> None:
    """``trabecula render``."""
    check_place(args.output)
    angles = camera(args)
    if args.show is None:
        made, shown = surface(args), {}
    elif not is_design(args.file):
        raise Refused(f"{args.file} is a mesh; --show is for a design with a solved map (map.phase) or a blend")
    else:
        solid = build(args.file)
        try:
            seen = look(solid, args.show)
        except ValueError as error:
            raise Refused(f"{args.file}: {error}") from None
        made = meshed(solid, args)
        shown = seen(made, towards(*angles))
    settle()
    if args.turn is None:
        made.render(args.output, args.size, *angles, section=args.section, **shown)
    else:
        turning(made, args, angles, shown)
    say(f"{args.output}: {args.size[0]} × {args.size[1]} pixels" + (f", {args.turn} pictures" if args.turn else ""))


def camera(args) -> tuple[float, float]:
    """Azimuth and elevation; the section with the side that is kept, refused if it cannot be read."""
    if args.view and (args.azimuth is not None or args.elevation is not None):
        raise Refused("--view says from where; leave out --azimuth and --elevation")
    azimuth, elevation = VIEWS[args.view] if args.view else (30.0, 25.0)
    azimuth = azimuth if args.azimuth is None else args.azimuth
    elevation = elevation if args.elevation is None else args.elevation
    if args.section is not None:
        try:
            (normal, offset) = section_plane(args.section, towards(azimuth, elevation))
        except ValueError as error:
            raise Refused(str(error)) from None
        side = sum(normal)
        # The same side in all pictures of a turn.
        args.section = f"{'xyz'[[abs(v) for v in normal].index(1)]}{'<' if side > 0 else '>'}{side * offset!r}"
    return azimuth, elevation


def turning(made: Mesh, args, angles: tuple[float, float], shown: dict) -> None:
    """Pictures from all round as one that is animated."""
    from .turntable import animated

    frames = []
    with Progress("drawing", args.progress) as progress:
        for i in range(args.turn):
            azimuth = angles[0] + 360 * i / args.turn
            frames.append(made.png(args.size, azimuth, angles[1], section=args.section, **shown))
            progress(i + 1, args.turn)
    with whole_file(args.output) as temporary, open(temporary, "wb") as out:
        out.write(animated(frames, args.seconds))


def report(args) -> None:
    """``trabecula report``."""
    from .part_page import part_page
    from .viewer import write_page

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


def schema(args) -> None:
    """``trabecula schema``."""
    print(_core.schema().rstrip("\n"))


def cells(args) -> None:
    """``trabecula cells``."""
    tet, beams = args.tet, args.beams
    if args.name and not (tet or beams) and args.name not in cell.names():
        # A name of one of the other lists says itself which is meant.
        tet = args.name in cell.tet_names()
        beams = not tet and args.name in {it["name"] for it in unit_cells.cells()}
    if tet:
        names, facts, words = cell.tet_names(), cell.tet_facts, tet_cell_words
    elif beams:
        found = {it["name"]: it for it in unit_cells.cells()}
        names, facts, words = list(found), found.__getitem__, unit_cell_words
    else:
        names, facts, words = cell.names(), cell_facts, cell_words
    if args.name:
        known_cell(args.name, names)
        names = [args.name]
    made = [facts(name) for name in names]
    if args.json:
        return put_json(made[0] if args.name else made)
    for it in made:
        print(f"{it['name']}  ({it['title']})")
        print("\n".join(f"  {line}" for line in words(it)))


# --- what they share -------------------------------------------------------------------------------------------------


def stiffness(args) -> None:
    """``trabecula stiffness``."""
    of_cell(args)


def conductivity(args) -> None:
    """``trabecula conductivity``."""
    of_cell(args)


def permeability(args) -> None:
    """``trabecula permeability``."""
    of_cell(args)


def law(args) -> None:
    """``trabecula law``."""
    import numpy  # noqa: F401  wanted later; see `terminal` for why no import waits until then

    from . import effective

    found = effective.law(args)
    if args.json:
        return put_json(found.to_dict())
    print("\n".join(effective.lines_of_law(found)))


def of_cell(args) -> None:
    """A figure of the periodic cell, by the name of the command."""
    import numpy  # noqa: F401  wanted later; see `terminal` for why no import waits until then

    from . import effective

    found = getattr(effective, args.command)(args)
    if args.json:
        return put_json(found.to_dict())
    print("\n".join(effective.LINES[args.command](found)))


def studio(args) -> None:
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


def doctor(args) -> None:
    """``trabecula doctor``."""
    from .doctor import state, words

    found = state()
    if args.json:
        return put_json(found)
    print("\n".join(words(found)))


def known_cell(name: str, known: list[str]) -> None:
    """Refuses the name of no cell."""
    if name not in known:
        from difflib import get_close_matches

        near = get_close_matches(name, known, 1)
        hint = f'; did you mean "{near[0]}"?' if near else "."
        raise Refused(f'no cell is named "{name}"{hint} There are: {", ".join(known)}')


def transitions(solid: Solid, picture: str | None, design: str | None = None, tell: bool = True):
    """The transitions of a blend, if one is asked for with a picture that can be written."""
    found = solid.transitions()
    for warning in found.warnings:
        warn(warning["message"], warning["path"], tell)
    settle()
    if picture is not None:
        if not found:
            raise Refused("--transitions is for designs with a blend; this one has none")
        check_place(picture)
        if design is not None:
            keep_inputs(design, picture)
    return found


def draw(found, picture: str | None) -> None:
    """Draws the transitions to ``picture`` if one is asked for."""
    if picture is not None:
        found.render(picture)
