"""The commands. What one needs is imported before its work begins."""

from __future__ import annotations

import json
import os
import time
import warnings
from difflib import get_close_matches

from . import _core, beams, cell
from .design import load
from .errors import DesignError, DesignWarning
from .input import read_text
from .machine import fits
from .mesh import READS, Mesh
from .output import check_place, whole_file
from .solid import Solid
from .starter import STARTER
from .transition import off
from .words import Progress, figure, say, span

__all__ = ["Refused", "cells", "check", "measure", "mesh", "new", "render", "simplify", "tets", "voxels"]

DESIGNS = ("toml", "json")
#: How far a solved map is from what was asked for: names on the scale of a picture.
SHOWN = {"angle": "angle off, degrees", "spacing": "spacing off, ratio", "density": "cells for each one wanted"}


class Refused(Exception):
    """A file or a request that cannot be served: one line, exit status 1."""


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


def tell_beams(name: str, it: dict) -> None:
    """What a graph of beams is."""
    least, most = it["hub_radius"]
    if "repeats" in it:
        times = " × ".join(map(str, it["repeats"]))
        print(f"beams {name}: a pattern of {times}, {it['hubs']:.9g} hubs of {it['kinds']} kinds, {it['beams']:.9g} beams")
        print(f"  thickness  {figure(it['thickness'])} mm (thinnest beam)")
        print(f"  hubs       radius {span(least if least == most else [least, most])} mm")
        print(f"  fraction   {it['fraction']:.4f}, porosity {it['porosity']:.4f} of the part (sampled)")
        return
    print(f"beams {name}: {it['cell'] or 'nodes and struts'}, {it['hubs']} hubs, {it['beams']} beams")
    low, high = it["length"]
    print(f"  length     {span(low if low == high else [low, high])} mm, {figure(it['total_length'])} mm in all")
    print(f"  thickness  {figure(it['thickness'])} mm (thinnest beam)")
    print(f"  hubs       radius {span(least if least == most else [least, most])} mm")
    if it["fillet_radius"]:
        tight, wide = it["fillet_radius"]
        print(f"  fillets    radius {span(tight if tight == wide else [tight, wide])} mm in the tightest places")
    print(f"  valence    {', '.join(f'{n} of {v}' for v, n in it['valence'].items())}")
    if it["smallest_angle"] is not None:
        x, y, z = map(figure, it["smallest_angle_at"])
        print(f"  angle      {it['smallest_angle']:.1f}° at least, at ({x}, {y}, {z}) mm")
    print(f"  fraction   {it['fraction']:.4f}, porosity {it['porosity']:.4f} of the part (sampled)")
    done = {"cleaned": it["cleaned"], "trimmed": it["trimmed"]}
    for what, counts in done.items():
        told = [f"{n} {word.replace('_', ' ')}" for word, n in counts.items() if n]
        if told:
            print(f"  {what}    {', '.join(told)}")
    print(f"  pieces     {it['pieces']}; {it['dangling']} nodes with a free end")


def tell_tiling(t: dict) -> None:
    """The mesh under a tetrahedral lattice, its walls and its creases."""
    print(f"  mesh       {t['count']} tetrahedra, edges {figure(t['edge'])} mm on average, {figure(t['volume'])} mm³")
    for zone, it in (t["zones"] or {}).items():
        print(f"  zone {zone}     {it['cell']} in {it['count']} tetrahedra; solid fraction {it['solid_fraction']:.4f}")
    if t["ports"] is not None:
        ports = "1 port" if t["ports"] == 1 else f"{t['ports']} ports"
        print(f"  faces      {ports} on each; solid fraction of the part {t['solid_fraction']:.4f}")
    if t["thickness"]:
        w = t["thickness"]
        print(f"  walls      {figure(w['mean'])} mm on average, 90 % between {figure(w['low'])} and {figure(w['high'])} mm")
    if t["creases"]:
        c = t["creases"]
        smooth = " (before smoothing)" if t["overlap"] else ""
        print(f"  creases    {c['mean']:.0f}° on average, {c['max']:.0f}° at most at the faces of tetrahedra{smooth}")


def tell_blend(blend: dict) -> None:
    """A blend and its transitions."""
    phases = f", phases {blend['phases']}" if blend["phases"] else ""
    print(f"blend of {', '.join(blend['lattices'])} by {blend['by']}{phases}")
    for it in blend["rbf"]:
        print(f"  {it['path']}: {it['points']} points, delta {figure(it['delta'])} mm, condition {it['condition']:.2g}")
    tell_transitions(blend["transitions"])


def tell_transitions(found) -> None:
    """How lattices pass into each other."""
    for it in found:
        print(f"transition {it['between'][0]} to {it['between'][1]}: {figure(it['volume'])} mm³")
        rows = it["fractions"]
        worst = off(it)
        told = "" if worst is None else f", off by {worst:+.4f} at most"
        print(f"  fraction   {span([min(r['found'] for r in rows), max(r['found'] for r in rows)])}{told}")
        print(f"  pieces     {it['pieces']}")
        neck = it["neck"]
        text = "none: no way leads across"
        if neck:
            text = (
                f"{neck['diameter']:.3g} mm at ({', '.join(figure(v) for v in neck['place'])}) mm, the widest way's narrowest"
            )
        print(f"  neck       {text}")
        for word in ("loose", "dangling"):
            text = f"{it[word]['bodies']}" + (f", {figure(it[word]['volume'])} mm³" if it[word]["bodies"] else "")
            print(f"  {word:10} {text}")


def tell_distortion(d: dict) -> None:
    """How far a solved map is from what was asked for: three axes' angles and spacings, mean and greatest."""
    worst = max(d["angle"], key=lambda a: a["max"])
    print(f"  angle      off by {worst['mean']:.1f}° on average, {worst['max']:.1f}° at most, along the worst axis")
    farthest = max(d["spacing"], key=lambda s: abs(s["max"] - 1))
    print(
        f"  spacing    {farthest['mean']:.2f} of what was asked for on average, up to {farthest['max']:.2f}; "
        f"{100 * d['outside']:.1f} % outside 1/1.5 to 1.5"
    )
    print(f"  turn       {d['turn']:.1f}° per cell at most")


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
        if kind_of(args.output) == "stl" and streams and not closes(solid, resolved(args)):
            made = solid.save_stl(args.output, threads=args.threads, progress=progress, **options)
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
    edge = solid.spacing(**resolved(args))
    made["solid_fraction"] = made["volume"] / region_volume(solid, edge)
    made["edge"] = edge
    made["bytes"] = os.path.getsize(args.output)
    made["seconds"] = round(time.perf_counter() - start, 3)
    left_out = made["islands"]
    if left_out["dropped"]:
        place = ", ".join(figure(v) for v in left_out["largest"]["place"])
        say(
            f"{counted(left_out['dropped'])} dropped: {left_out['volume']:.3g} mm³ in all, {left_out['border']} at the "
            f"region's boundary; the largest of {left_out['largest']['volume']:.3g} mm³ about ({place}) mm"
        )
    if args.json:
        return print(json.dumps(made, indent=2))
    say(
        f"{args.output}: {made['triangles']} triangles, volume {figure(made['volume'])} mm³, solid fraction "
        f"{made['solid_fraction']:.4f}, area {figure(made['area'])} mm², {counted(made['pieces'])}; edge {edge:g} mm, "
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
        print(json.dumps(report, indent=2))


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
        return print(json.dumps(made, indent=2))
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
    figures |= {"self_intersections": made.self_intersections, "quality": made.quality, "defects": made.defects}
    if args.thickness:
        with Progress("fitting balls", args.progress) as progress:
            balls = made.thickness(args.step, args.threads, progress)
        figures |= balls.measure()
        if args.histogram is not None:
            balls.render(args.histogram)
    if args.json:
        if found:
            figures["transitions"] = list(found)
        return print(json.dumps(figures, indent=2))
    units = {"volume": " mm³", "area": " mm²", "area_lattice": " mm²", "area_cut": " mm²", "hydraulic_diameter": " mm"}
    lines = listed(figures)
    width = max(15, *(len(key) for key, _ in lines))
    for key, value in lines:
        if key == "bounds":
            text = " to ".join("(" + ", ".join(figure(v) for v in corner) + ")" for corner in value) + " mm"
        elif value is None:
            text = ABSENT.get(key, "needs a region (--region)")
        elif isinstance(value, list):
            text = ", ".join(value) or "none"
        elif isinstance(value, bool):
            text = "yes, but inside out" if value and inverted else "yes" if value else "no"
        else:
            text = (f"{value:.6g}" if isinstance(value, float) else str(value)) + units.get(key, "")
        print(f"{key:{width}} {text}")
    tell_transitions(found)
    if figures["closed"] and not inverted:
        tell_voids(figures["voids"])


#: What is said where a figure is missing for another reason than that there is no region.
ABSENT = {"quality": "no triangles", "quality.largest_aspect": "a triangle has no area"}


def listed(figures: dict) -> list[tuple]:
    """The figures line by line: those of a group under its name, without histograms."""
    lines: list[tuple] = []
    for key, value in figures.items():
        if key == "voids":
            continue
        group = value.items() if isinstance(value, dict) else None
        lines += [(f"{key}.{k}", v) for k, v in group if k != "histogram"] if group else [(key, value)]
    return lines


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


#: Voids that are told one by one.
LISTED = 20


def tell_voids(voids: list[dict]) -> None:
    """Warns of closed voids: powder and resin stay in them."""
    if not voids:
        return

    def place(void: dict) -> str:
        return "(" + ", ".join(figure(v) for v in void["point"]) + ") mm"

    total = figure(sum(v["volume"] for v in voids))
    if len(voids) == 1:
        return say(f"warning: one closed void of {total} mm³ at {place(voids[0])}: powder or resin cannot drain from it")
    listed = ", ".join(f"{figure(v['volume'])} mm³ at {place(v)}" for v in voids[:LISTED])
    more = f", and {len(voids) - LISTED} smaller ones" if len(voids) > LISTED else ""
    say(
        f"warning: {len(voids)} closed voids of {total} mm³ in all: powder or resin cannot drain from them. "
        f"Largest first: {listed}{more}"
    )


def flaws(mesh: Mesh) -> str:
    """What keeps a mesh from being closed."""
    kinds = ("with one triangle", "with more than two", "with two of the same direction")
    found = [f"{n} edge{'s' if n > 1 else ''} {kind}" for n, kind in zip(mesh._core.flaws(), kinds, strict=True) if n]
    return ", ".join(found) or "triangles with a corner twice"


def cells(args) -> None:
    """``trabecula cells``."""
    if args.tet:
        return tet_cells(args)
    if args.beams:
        return beam_cells(args)
    listed = _core.cells()
    if args.name:
        known_cell(args.name, [c[0] for c in listed])
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


def tet_cells(args) -> None:
    """``trabecula cells --tet``."""
    names = _core.tet_cells()
    if args.name:
        known_cell(args.name, names)
        names = [args.name]
    facts = [cell.tet_facts(name) for name in names]
    if args.json:
        return print(json.dumps(facts[0] if args.name else facts, indent=2, ensure_ascii=False))
    for it in facts:
        terms = ", ".join(
            f"{t['amplitude']:g} {t['component'].title()} ({' '.join(str(h) for h in t['hkl'])})" for t in it["terms"]
        )
        dual = ", dual" if it["dual"] else ""
        print(f"{it['name']}  ({it['title']})")
        print(f"  series  group {it['group']}: {terms}")
        print(f"  tetrahedron of edge {it['edge']:.4f} cells about {it['site'][0]:g} {it['site'][1]:g} {it['site'][2]:g}{dual}")
        print(f"  part    {it['part']} at fraction {it['fraction']:g} (iso {it['iso']:.4f})")
        ports = "1 port" if it["ports"] == 1 else f"{it['ports']} ports"
        print(f"  faces   {ports} on each, {100 * it['face_fraction']:.1f} % of it")
        for part, whole in it["connected_fraction"].items():
            text = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in whole) or "never"
            print(f"  {part:7} in one piece that reaches all faces at fractions {text}")


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
        return print(json.dumps(report, indent=2))
    tell_tets(report)
    if args.output:
        say(f"{args.output}: {report['quality']['tets']} tetrahedra, {report['seconds']:.2f} s")


def tell_tets(report: dict) -> None:
    """The figures of a tetrahedral mesh."""
    q, fit = report["quality"], report["fit"]
    extent = " × ".join(figure(b - a) for a, b in zip(*q["bounds"], strict=True))
    size, angles, aspect = q["size"], q["dihedral"], q["aspect"]
    print(f"tetrahedra  {q['tets']}, {q['nodes']} nodes, {counted(q['pieces'])}, by {report['mesher']}")
    print(f"extent      {extent} mm, {figure(q['volume'])} mm³")
    print(f"size        {figure(size['mean'])} mm on average, {figure(size['min'])} to {figure(size['max'])} mm")
    inner = f"9 in 10 tetrahedra lie between {angles['min_p05']:.1f}° and {angles['max_p95']:.1f}°"
    print(f"dihedral    {angles['min']:.1f}° to {angles['max']:.1f}°; {inner}")
    print(f"aspect      {aspect['mean']:.2f} on average, {aspect['max']:.2f} at most (1 is regular)")
    print(f"slivers     {q['slivers']} below 10° or above 170°; {q['inverted']} inverted")
    if fit:
        print(f"fit         {fit['deviation_mean']:.2g} mm off the surface on average, {fit['deviation']:.2g} mm at most")
        print(f"left out    {100 * fit['lost']:.2g} % of the region, up to {fit['lost_depth']:.2g} mm deep")


def beam_cells(args) -> None:
    """``trabecula cells --beams``."""
    facts = beams.cells()
    if args.name:
        known_cell(args.name, [it["name"] for it in facts])
        facts = [it for it in facts if it["name"] == args.name]
    if args.json:
        return print(json.dumps(facts[0] if args.name else facts, indent=2, ensure_ascii=False))
    for it in facts:
        print(f"{it['name']}  ({it['title']})")
        print(f"  group    {it['group']}")
        print(f"  cell     {len(it['nodes'])} nodes, {len(it['struts'])} beams of {figure(it['length'])} edges in all")
        print(f"  valence  {', '.join(f'{n} of {v}' for v, n in it['valence'].items())}")
        print(f"  Maxwell  {it['maxwell']:+d}")
        if it["aspect"] != [1.0, 1.0, 1.0]:
            print(f"  edges    in the ratio {' : '.join(figure(v) for v in it['aspect'])} for its usual shape")


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


def known_cell(name: str, known: list[str]) -> None:
    """Refuses the name of no cell."""
    if name not in known:
        near = get_close_matches(name, known, 1)
        hint = f'; did you mean "{near[0]}"?' if near else "."
        raise Refused(f'no cell is named "{name}"{hint} There are: {", ".join(known)}')


def counted(pieces: int) -> str:
    """A number of pieces."""
    return "1 piece" if pieces == 1 else f"{pieces} pieces"


def kind_of(path: str) -> str:
    """The extension in small letters."""
    return os.path.splitext(path)[1].lower().lstrip(".")


def files_of(tree) -> list[str]:
    """The files that a region names."""
    if isinstance(tree, dict):
        own = [tree["path"]] if isinstance(tree.get("path"), str) else []
        return own + [name for branch in tree.values() for name in files_of(branch)]
    return [name for branch in tree for name in files_of(branch)] if isinstance(tree, list) else []


def read_by(design: str) -> list[str]:
    """The files that a design reads."""
    data = load(design).to_dict()
    tables = [b[k] for b in (data.get("beams") or {}).values() for k in ("nodes", "struts") if isinstance(b.get(k), str)]
    regions = [data.get("region"), data.get("blend") or {}, *(data.get("keep") or {}).values()]
    return files_of(regions) + tables


def keep_inputs(design: str, output: str) -> None:
    """Refuses an output that is the design, or a file that the design reads."""
    folder = os.path.dirname(os.path.abspath(design))
    for name in [design, *(os.path.join(folder, f) for f in read_by(design))]:
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
