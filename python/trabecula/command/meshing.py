"""``trabecula mesh`` and ``trabecula simplify``: surfaces, and files that need none."""

from __future__ import annotations

import os
import time
from argparse import Namespace
from collections.abc import Callable, Sequence

from ..base.files import check_place, extension
from ..base.formats import MESH_WRITES, STEP_PROTOCOLS, STEP_WRITES, dotted, kind_of
from ..base.given import shard_bytes
from ..base.machine import file_size, fits
from ..base.terminal import Progress, figure, put_json, say, settle, warn, warned
from ..base.texts import counted, voids
from ..errors import Refused, WrongUsage
from ..mesh import Mesh
from ..parts import part_files, write_parts
from ..saved import OPEN_IN_RANGES
from ..solid import Solid
from .inputs import build, closes, design_of, keep_inputs, resolution, same_file

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Literal

    from ..reports import SimplifyReport, SurfaceReport

__all__ = ["mesh", "simplify"]


def mesh(args: Namespace) -> None:
    """``trabecula mesh``."""
    if args.beams:
        return mesh_beams(args)
    if args.implicit:
        return mesh_implicit(args)
    if args.no_mesh:
        raise WrongUsage("--no-mesh belongs to --beams; add it")
    if kind_of(args.output) in STEP_WRITES:
        return mesh_step(args)
    for name in ("protocol", "assembly"):
        if getattr(args, name) is not None:
            raise WrongUsage(f"--{name} is of STEP files, and {args.output} is none; leave it out, or write a .step")
    if kind_of(args.output) not in MESH_WRITES:
        if not design_of(args.design).beams:
            raise Refused(
                f"a .{kind_of(args.output)} holds beams, and {args.design} has none; name another output: "
                f"{dotted((*MESH_WRITES, *STEP_WRITES))}"
            )
        raise WrongUsage(f"a .{kind_of(args.output)} holds beams, not their surface: add --beams")
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
    written = os.path.splitext(args.output)[0] if args.shards else args.output
    made["bytes"] = sum(map(os.path.getsize, files_in(written)))
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
        f"{written}: {made['triangles']} triangles, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, area {figure(made['area'])} mm², {counted(made['pieces'])}; {size}, "
        f"{made['seconds']:.2f} s"
    )


def mesh_step(args: Namespace) -> None:
    """``trabecula mesh -o OUT.step``."""
    names = ("parts", "open", "smooth", "chord", "edge", "per_cell", "triangles")
    why = "a STEP file: it has smooth faces, and all components"
    refuse_others(args, names, ("drop-small", "keep"), why)

    def words(made: dict) -> str:
        near = "exact"
        if made["angle"] is not None:
            near = f"within {made['deviation']:.2g} mm, normals within {made['angle']:.2g} degrees"
        whole = counted(made["solids"], "solid")
        if made["parts"] is not None:
            whole = f"an assembly of {counted(made['parts'], 'distinct part')}, {whole} in all"
        return f"{made['faces']} faces, {made['edges']} edges, volume {figure(made['volume'])} mm³, {whole}; {near}"

    def save(solid: Solid) -> dict:
        with Progress("fitting patches", args.progress) as progress:
            protocol = args.protocol or STEP_PROTOCOLS[0]
            return solid.save_step(args.output, args.tolerance, args.threads, progress, protocol, args.assembly).to_dict()

    without_mesh(args, save, words)


def mesh_beams(args: Namespace) -> None:
    """``trabecula mesh --beams``."""
    kind = kind_of(args.output)
    names = ["implicit", "parts", "open", "smooth", "edge", "per_cell", "tolerance", "triangles", "protocol", "assembly"]
    names += [] if kind == "3mf" else ["chord", "no_mesh"]
    refuse_others(args, names, ("drop-small",), f"--beams and a .{kind}: it has beams, not their surface")

    def words(made: dict) -> str:
        within = "" if made["error"] is None else f"; radii within {made['error']:.2g} mm"
        balls = f", {counted(made['balls'], 'ball')}" if made["balls"] else ""
        return f"{counted(made['beams'], 'beam')}{balls}, {counted(made['nodes'], 'node')}{within}, {made['bytes']} bytes"

    def save(solid: Solid) -> dict:
        return solid.save_beams(args.output, args.chord, not args.no_mesh, args.threads).to_dict()

    without_mesh(args, save, words)


def mesh_implicit(args: Namespace) -> None:
    """``trabecula mesh --implicit``."""
    names = ["no_mesh", "parts", "open", "smooth", "edge", "per_cell", "tolerance", "triangles", "chord"]
    names += ["protocol", "assembly"]
    refuse_others(args, names, ("drop-small",), "--implicit: the file has a function, and no triangles")

    def words(made: dict) -> str:
        return f"a function of {counted(made['nodes'], 'node')}, {made['bytes']} bytes"

    without_mesh(args, lambda solid: solid.save_implicit(args.output), words)


def refuse_others(args: Namespace, names: Sequence[str], islands: Sequence[str], why: str) -> None:
    """Refuses options that do not go with a file without triangles; ``islands`` are what --islands may be."""
    names = [*names, "resume", "cluster", "new", "shards"]
    given = ["--" + name.replace("_", "-") for name in names if getattr(args, name)]
    given += ["--no-assembly"] if "assembly" in names and args.assembly is False else []
    given += [] if args.islands in islands else [f"--islands {args.islands}"]
    if given:
        raise WrongUsage(f"{given[0]} does not go with {why}; leave it out")


def without_mesh(args: Namespace, save: Callable[[Solid], dict], words: Callable[[dict], str]) -> None:
    """Saves a solid to a file that has no triangles; ``words`` puts its figures into words."""
    check_place(args.output)
    start = time.perf_counter()
    solid = build(args.design)
    keep_inputs(args.design, args.output)
    settle()
    made = save(solid)
    made |= {"bytes": os.path.getsize(args.output), "seconds": round(time.perf_counter() - start, 3)}
    if args.json:
        return put_json(made | {"warnings": warned()})
    say(f"{args.output}: {words(made)}, {made['seconds']:.2f} s")


def mesh_parts(args: Namespace) -> None:
    """``trabecula mesh --parts``."""
    others = {
        "--open": args.open,
        "--smooth": args.smooth,
        "--chord": args.chord,
        "--tolerance": args.tolerance,
        "--triangles": args.triangles,
    }
    if alone := [name for name, value in others.items() if value]:
        raise WrongUsage(f"{alone[0]} does not go with --parts: the parts have to keep their common triangles; leave it out")
    if apart_of(args) is not None:
        raise WrongUsage("--resume, --cluster and --shards do not go with --parts: these are held in memory; leave one out")
    if args.islands == "drop":
        raise WrongUsage("--islands drop does not go with --parts: a dropped piece leaves a gap between them; leave it out")
    files = part_files(args.output, args.parts)
    start = time.perf_counter()
    for name in files.values():
        check_place(name)
    solid = build(args.design)
    for name in files.values():
        keep_inputs(args.design, name)
    islands: Literal["keep", "error"] = "error" if args.islands == "error" else "keep"
    with Progress("meshing", args.progress) as progress:
        parts = solid.parts(args.edge, args.per_cell, args.parts, args.threads, progress, islands)
    if "wall" in parts and parts["wall"].voids:
        warn(f"wall: {voids(parts['wall'].voids)}")
    settle()
    write_parts(args.output, parts)
    edge = solid.spacing(args.edge, args.per_cell)
    region = solid.region_volume(edge)
    made = {
        name: it.summary().to_dict() | {"solid_fraction": it.volume / region, "file": files[name]} for name, it in parts.items()
    }
    seconds = round(time.perf_counter() - start, 3)
    if args.json:
        figures = {"parts": made, "edge": edge, "region_volume": region, "seconds": seconds}
        return put_json(figures | {"warnings": warned()})
    for name, it in made.items():
        say(
            f"{name}: {it['triangles']} triangles, volume {figure(it['volume'])} mm³, {it['solid_fraction']:.4f} of the "
            f"region, area {figure(it['area'])} mm², {counted(it['pieces'])}; {it['file']}"
        )
    say(f"edge {edge:g} mm, {seconds:.2f} s")


def meshed_file(solid: Solid, args: Namespace, progress: Progress) -> dict:
    """Meshes a solid into a file, streamed where it can be; gives the figures."""
    lighter = args.tolerance is not None or args.triangles is not None
    options = {**resolution(args), "threads": args.threads, "progress": progress, "islands": args.islands}
    options |= {"smooth": True} if args.smooth else {}
    asked = {} if args.chord is None else {"chord": args.chord}
    is_open = args.open or solid.open_ends
    whole = lighter or args.smooth or is_open
    apart = apart_of(args)
    if apart is not None:
        if whole:
            if out := given_of(args):
                why = "--resume, --cluster and --shards make a surface in ranges of tiles, as it is"
                raise WrongUsage(f"{why}: leave out {out}")
            raise Refused(OPEN_IN_RANGES)
        if kind_of(args.output) != "stl":
            raise WrongUsage(f"{args.output}: --resume, --cluster and --shards write .stl only; name one, or leave them out")
    streams = kind_of(args.output) == "stl" if asked else apart is not None or not closes(solid, resolution(args))
    if streams and not whole:
        given = {"edge": None, "per_cell": None, "chord": None} | options

        def accept(found: SurfaceReport) -> None:
            if found.cavities:
                warn(
                    f"{counted(found.cavities, 'closed void')}, from which powder or resin cannot drain; "
                    f"`trabecula measure {args.output}` tells where"
                )
            settle()

        return solid._save(args.output, **given, accept=accept, apart=apart).to_dict() | asked
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
    surface = simplified(surface, args)[0] if lighter else surface
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
        made |= {"triangles": surface.counts[1], "area": surface.area, "open": True}
        say("open at the region's boundary: volume and fraction are the closed part's")
    surface.write(args.output)
    return made


def files_in(name: str) -> list[str]:
    """The file of this name, or those of the folder."""
    return [os.path.join(name, one) for one in os.listdir(name)] if os.path.isdir(name) else [name]


def apart_of(args: Namespace) -> dict | None:
    """How a surface is to be made in ranges of tiles, if it is."""
    shards = shard_bytes(args.shards)
    apart = args.resume or args.cluster or args.new or shards
    return {"cluster": args.cluster, "new": args.new, "shards": shards} if apart else None


def given_of(args: Namespace) -> str:
    """The options by which a surface is held in memory as a whole."""
    names = {"--tolerance": args.tolerance, "--triangles": args.triangles, "--smooth": args.smooth, "--open": args.open}
    return ", ".join(name for name, value in names.items() if value)


def simplify(args: Namespace) -> None:
    """``trabecula simplify``."""
    check_place(args.output)
    start = time.perf_counter()
    if same_file(args.file, args.output):
        raise Refused(f"{args.output} is what is simplified; name another output")
    mesh = Mesh.read(args.file)
    if args.triangles:
        # Of a tolerance the triangles are not known before they are made.
        triangles = min(args.triangles, len(mesh.triangles))
        fits(file_size(extension(args.output, MESH_WRITES), triangles), f"{triangles:.3g} triangles", args.output)
    made, found = simplified(mesh, args)
    made.write(args.output)
    if args.json:
        put_json(found.to_dict() | {"seconds": round(time.perf_counter() - start, 3)})


def simplified(mesh: Mesh, args: Namespace) -> tuple[Mesh, SimplifyReport]:
    """The lighter mesh and its figures, and a message on what was done."""
    with Progress("simplifying", args.progress) as progress:
        made = mesh.simplified(args.tolerance, args.triangles, progress)
    it = made.simplification
    assert it is not None  # it was made lighter
    if args.triangles and it.triangles_before <= args.triangles:
        say(f"{it.triangles} triangles are no more than {args.triangles} already: left as they are")
        return made, it
    if args.triangles and not args.tolerance and it.triangles > args.triangles:
        warn(f"{it.triangles} triangles are the fewest that keep the surface whole; {args.triangles} were asked for")
    change = 100 * (it.volume / it.volume_before - 1)
    say(
        f"simplified from {it.triangles_before} to {it.triangles} triangles, nowhere farther than "
        f"{it.deviation:.2g} mm from the first; volume {change:+.2g} %"
    )
    return made, it
