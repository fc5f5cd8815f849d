"""Reports in words: what ``str(report)`` gives and ``check``, ``measure`` and ``tets`` print."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from .record import Report
from .terminal import figure, span

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..reports import (
        BlendReport,
        DesignReport,
        DistortionReport,
        FitReport,
        LatticeReport,
        PeriodReport,
        PropertyReport,
        SingularLineReport,
        TetMeshReport,
        TilingReport,
        TransitionReport,
        ZoneReport,
    )

__all__ = ["counted", "intervals", "point", "table", "text", "voids"]

#: Number of hubs listed that cannot have the fillets asked for; the report has all of them.
FEW = 3
#: Number of features listed that tetrahedra do not keep; the report has all of them.
SHOWN = 6


def text(report: Report) -> str:
    """A report in words, line by line."""
    writers: dict[str, Callable[[Any], Iterator[str]]] = {
        "BeamsReport": _beams,
        "BlendReport": _blend,
        "DesignReport": _design,
        "DistortionReport": _distortion,
        "LatticeReport": _lattice,
        "TetMeshReport": _tet_mesh,
        "TilingReport": _tiling,
        "TransitionReport": _transition,
    }
    write = writers.get(type(report).__name__)
    return "\n".join(write(report)) if write else table(report, "none")


def counted(n: int, what: str = "piece") -> str:
    """A number of things."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def point(p: list[float]) -> str:
    """A position."""
    return "(" + ", ".join(figure(v) for v in p) + ")"


def _range(v: list[float]) -> str:
    return span(v[0] if v[0] == v[1] else v)


def intervals(of: list[list[float]]) -> str:
    """Intervals of fractions; empty if there is none."""
    return " and ".join(f"{a:.4f} to {b:.4f}" for a, b in of)


def _design(it: DesignReport) -> Iterator[str]:
    low, high = it.region.bounds
    extent = " × ".join(figure(b - a) for a, b in zip(low, high, strict=True))
    about = "" if it.region.volume_exact else "about "
    volume, described = it.region.volume, it.region.described_volume
    if described is None or it.region.volume_exact or abs(volume / described - 1) < 1e-6:
        yield f"region  {extent} mm, {about}{figure(volume)} mm³"
    else:
        off = 100 * (volume / described - 1)
        yield f"region  {extent} mm, {figure(described)} mm³, of which tetrahedra have {figure(volume)} mm³ ({off:+.1f} %)"
    for part in it.region.tessellated or ():
        error = "" if part.volume_error is None else f", its volume to {100 * part.volume_error:+.2g} %"
        name = os.path.basename(part.path)
        yield f"  {name}: {part.triangles} triangles within {figure(part.chord)} mm of {part.faces} faces{error}"
    for name, lattice in it.lattices.items():
        ends = dict.fromkeys(figure(w) for w in lattice.wavelengths or [lattice.wavelength])
        yield f"lattice {name}: {lattice.part}, wavelength {' to '.join(ends)} mm"
        yield from _lattice(lattice)
    for name, beams in it.beams.items():
        yield f"beams {name}: {_beams_title(beams)}"
        yield from _beams(beams)
    if it.blend:
        yield from _blend(it.blend)
    if it.chord is not None:
        yield f"mesh    of the beams' own patches, {it.chord:.3g} mm off at most, unless a resolution is asked for"
    else:
        yield f"grid    spacing {it.spacing:.3g} mm unless another is asked for"


def _lattice(it: LatticeReport) -> Iterator[str]:
    neck = "thinnest wall" if it.part == "sheet" else "narrowest neck"
    yield f"  iso        {span(it.iso)}{'' if it.folding is None else ' (constant-level sheet of equal fraction)'}"
    yield f"  fraction   {span(it.fraction)}"
    yield f"  porosity   {span(it.porosity)}"
    yield f"  thickness  {span(it.thickness)}{'' if it.thickness is None else f' mm ({neck})'}"
    if it.pore is not None:
        side = " on the narrower side" if it.part == "sheet" else ""
        narrowest = it.pore if isinstance(it.pore, (int, float)) else min(it.pore)
        closed = "" if narrowest else "; 0: closed in every cell"
        yield f"  pore       {span(it.pore)} mm (largest ball that passes{side}{closed})"
    if it.property is not None:
        yield f"  {it.property.name:<10} {_property(it.property)}"
    if not (it.tets and it.tets.zones):
        whole = intervals(it.connected_fraction)
        yield f"  one piece  {'at fractions ' + whole if whole else 'at no fraction'}"
    if it.tets:
        yield from _tiling(it.tets)
    if it.fit:
        yield from (f"  {line}" for line in _fit(it.fit))
    if it.distortion:
        yield from _distortion(it.distortion)
    yield from _singular(it.singular or [])
    for period in it.periods or []:
        yield _period(period)


def _property(it: PropertyReport) -> str:
    unit = " mm²" if it.name == "permeability" else " of the solid's E"
    value = " to ".join(figure(v) for v in ([it.value] if isinstance(it.value, (int, float)) else it.value))
    return f"{value}{unit}, within about {100 * it.error:.2g} % (extrapolated from {it.n} voxels along the cell)"


def _beams_title(it: Report) -> str:
    if it.repeats:
        times = " × ".join(map(str, it.repeats))
        return f"a pattern of {times}, {it.hubs:.9g} hubs of {it.kinds} kinds, {it.beams:.9g} beams"
    return f"{it.cell or 'nodes and struts'}, {counted(it.hubs, 'hub')}, {counted(it.beams, 'beam')}"


def _beams(it: Report) -> Iterator[str]:
    if it.length:
        yield f"  length     {_range(it.length)} mm, {figure(it.total_length)} mm in all"
    if it.solved_radius is not None:
        yield f"  radius     {figure(it.solved_radius)} mm, from the fraction asked for"
    yield f"  thickness  {figure(it.thickness)} mm (thinnest beam)"
    yield f"  hubs       radius {_range(it.hub_radius)} mm"
    if it.fillet_radius:
        yield f"  fillets    radius {_range(it.fillet_radius)} mm at the tightest places"
    if it.fillet_shortfalls:
        yield from _shortfalls(it.fillet_shortfalls)
    if it.valence:
        yield f"  valence    {', '.join(f'{n} of {v}' for v, n in sorted(it.valence.items(), key=lambda of: int(of[0])))}"
    if it.smallest_angle is not None:
        yield f"  angle      {it.smallest_angle:.1f}° at least, at {point(it.smallest_angle_at)} mm"
    how = "exact" if it.fraction_exact else "sampled"
    yield f"  fraction   {it.fraction:.4f}, porosity {it.porosity:.4f} of the part ({how})"
    if it.repeats:
        return
    if it.volume is not None:
        yield f"  exactly    {figure(it.volume)} mm³, surface {figure(it.area)} mm²"
    for what, counts in (("cleaned", it.cleaned), ("trimmed", it.trimmed)):
        done = [f"{n} {word.replace('_', ' ')}" for word, n in counts.items() if n]
        if done:
            yield f"  {what}    {', '.join(done)}"
    yield f"  pieces     {it.pieces}; {counted(it.dangling, 'node')} with a free end"


def _shortfalls(them: list[Report]) -> Iterator[str]:
    """The first few hubs that cannot have the fillets asked for."""
    asked = them[0].asked_radius
    what = f"{figure(asked)} mm" if asked is not None else f"tau {figure(them[0].asked_tau)}"
    yield f"  asked for  {what}, which {counted(len(them), 'hub')} cannot have in all crotches; the tightest:"
    for it in them[:FEW]:
        radius = "" if it.radius is None else f"radius {_range(it.radius)} mm, "
        got = f"{radius}tau {_range(it.tau)}; {it.short} of {it.crotches} crotches short"
        yield f"             hub {it.hub} at {point(it.position)} mm: {got}"


def _finished(it: ZoneReport | TilingReport) -> str:
    """The solid fraction of the finished part where that is not the one of flat tetrahedra alone, and this."""
    if it.finished_fraction is None:
        return f"{it.solid_fraction:.4f}"
    return f"{it.finished_fraction:.4f} finished, {it.solid_fraction:.4f} in flat tetrahedra without ends"


def _tiling(it: TilingReport) -> Iterator[str]:
    yield f"  method     {it.method}, " + (
        "in each tetrahedron apart" if it.method == "explicit" else f"on a grid over the part: {it.method_reason}"
    )
    size, volume = figure(it.edge), figure(it.volume)
    yield f"  mesh       {it.count} tetrahedra, edges {size} mm on average, {volume} mm³ in flat tetrahedra"
    for zone, z in (it.zones or {}).items():
        yield f"  zone {zone}     {z.cell} in {z.count} tetrahedra; solid fraction {_finished(z)}"
    for join in it.joins or []:
        a, b = join.zones
        state = "join" if join.joined else "do not join"
        passed = f"solid passes through {join.open} of {join.faces} faces"
        yield f"  zones {a}, {b} {state}: {passed}; their ports share {100 * join.ports:.1f} % of a face"
    if it.pieces is not None:
        yield f"  pieces     {it.pieces}, predicted from ports"
    if it.ports is not None:
        yield f"  faces      {counted(it.ports, 'port')} on each; solid fraction {_finished(it)}"
    if it.thickness:
        w = it.thickness
        yield f"  walls      {figure(w.mean)} mm on average, 90 % between {figure(w.low)} and {figure(w.high)} mm"
    if it.end_radius is not None:
        what = "net of rods of radius" if it.surface == "net" else "rounded to"
        yield f"  ends       {what} {span(it.end_radius)} mm at the surface"
    if it.net:
        untied = f", {it.net.untied} of them without a rod" if it.net.untied else ""
        yield f"  net        ties {counted(it.net.ports, 'port')}{untied}; openings of up to {figure(it.net.opening)} mm"
    if it.creases:
        smooth = " (before smoothing)" if it.overlap else ""
        yield f"  creases    {it.creases.mean:.0f}° on average, {it.creases.max:.0f}° at most at faces of tetrahedra{smooth}"


def _distortion(it: DistortionReport) -> Iterator[str]:
    mean, most = max(a.mean for a in it.angle), max(a.max for a in it.angle)
    where = "at the points sampled, each of the axis where that is greatest"
    yield f"  angle      off by {mean:.1f}° on average, {most:.1f}° at most {where}"
    ratio = max((s.mean for s in it.spacing), key=lambda mean: max(mean, 1 / mean))
    farthest = max(s.max for s in it.spacing)
    yield (
        f"  spacing    cells per mm {ratio:.2f} of what was asked for on average, off by a factor of "
        f"{farthest:.2f} at most of these; {100 * it.outside:.1f} % outside 1/1.5 to 1.5"
    )
    yield f"  turn       {it.turn:.1f}° per cell at most"


def _singular(lines: list[SingularLineReport]) -> Iterator[str]:
    for line in lines[:3]:
        a, b = line.points[0], line.points[-1]
        place = f"from {point(a)} to {point(b)} mm" if a != b else f"closed, through {point(a)} mm"
        core = f", in a {line.core} core of {line.core_radius:.4g} mm" if line.core else ""
        yield f"  singular   {line.length:.1f} mm, axes turned by {line.turn:.0f}° once round it, {place}{core}"
    if more := lines[3:]:
        yield f"             and {counted(len(more), 'shorter one')}"


def _period(it: PeriodReport) -> str:
    axes = zip(("first", "second", "third"), it.cells, it.asked, strict=True)
    round_it = [f"{n} cells along the {axis} axis ({asked:.2f} asked for)" for axis, n, asked in axes if n or abs(asked) > 0.05]
    return f"  hole       at {point(it.at)} mm along {point(it.along)}: {', '.join(round_it) or 'no cells go round'}"


def _blend(it: BlendReport) -> Iterator[str]:
    phases = f", phases {it.phases}" if it.phases else ""
    yield f"blend of {', '.join(it.lattices)} by {it.by}{phases}"
    for f in it.rbf:
        yield f"  {f.path}: {f.points} points, delta {figure(f.delta)} mm, condition {f.condition:.2g}"


def off(transition: TransitionReport) -> float | None:
    """The greatest difference between the fraction found and the one asked for; None where that is not known."""
    each = [r.found - r.asked for r in transition.fractions if r.asked is not None]
    return max(each, key=abs, default=None)


def _transition(it: TransitionReport) -> Iterator[str]:
    yield f"transition {it.between[0]} to {it.between[1]}: {figure(it.volume)} mm³"
    worst = off(it)
    error = "" if worst is None else f", off by {worst:+.4f} at most"
    fractions = [row.found for row in it.fractions]
    yield f"  fraction   {span([min(fractions), max(fractions)])}{error}"
    sure = it.resolved or it.pieces == 1
    unknown = f"not known: walls are thinner than two steps of a grid of {it.step:.3g} mm; a mesh counts them"
    yield f"  pieces     {f'{it.pieces} on a grid of {it.step:.3g} mm' if sure else unknown}"
    neck = "none: not connected across the transition"
    if it.neck:
        found = f"{it.neck.diameter:.3g} mm to within {it.step:.3g} mm"
        neck = f"{found}, at {point(it.neck.place)} mm, the narrowest of the widest path across"
    yield f"  neck       {neck}"
    for word, bodies in (("loose", it.loose), ("dangling", it.dangling)) if sure else ():
        yield f"  {word:10} {bodies.bodies}" + (f", {figure(bodies.volume)} mm³" if bodies.bodies else "")


def _tet_mesh(it: TetMeshReport) -> Iterator[str]:
    q, fit, angles = it.quality, it.fit, it.quality.dihedral
    extent = " × ".join(figure(b - a) for a, b in zip(*q.bounds, strict=True))
    yield f"tetrahedra  {q.tets}, {q.nodes} nodes, {counted(q.pieces)}, by {it.mesher}"
    yield f"extent      {extent} mm, {figure(q.volume)} mm³"
    yield f"size        {figure(q.size.mean)} mm on average, {figure(q.size.min)} to {figure(q.size.max)} mm"
    inner = f"9 in 10 tetrahedra lie between {angles.min_p05:.1f}° and {angles.max_p95:.1f}°"
    yield f"dihedral    {angles.min:.1f}° to {angles.max:.1f}°; {inner}"
    yield f"aspect      {q.aspect.mean:.2f} on average, {q.aspect.max:.2f} at most (1 is regular)"
    yield f"slivers     {q.slivers} below 10° or above 170°; {q.inverted} inverted"
    if layers := it.layers:
        yield f"layers      {layers.prisms} prisms, {100 * layers.mean:.0f} % of the height asked for on average,"
        low = f"less than nine tenths of it on {100 * layers.lower:.0f} % of their area"
        yield f"            {low}, {100 * layers.least:.0f} % at {point(layers.at)} mm"
    if fit:
        yield from _fit(fit)


def _fit(it: FitReport) -> Iterator[str]:
    for word, off in (("to part", it.to_part), ("from part", it.from_part)):
        yield f"{word:10} {off.mean:.2g} mm on average, 99 % within {off.p99:.2g} mm, {off.max:.2g} mm at most"
    yield f"left out   {100 * it.uncovered:.2g} % of the region, up to {it.uncovered_depth:.2g} mm deep"
    for lost in it.lost[:SHOWN]:
        yield f"not kept   a {lost.kind} of {lost.size:.2g} mm at {point(lost.at)} mm, {lost.depth:.2g} mm off"
    if len(it.lost) > SHOWN:
        yield f"           {len(it.lost) - SHOWN} more in the JSON report"


#: Units of the figures of a mesh.
UNITS = {
    "volume": " mm³",
    "area": " mm²",
    "area_lattice": " mm²",
    "area_cut": " mm²",
    "hydraulic_diameter": " mm",
    "dangling.volume": " mm³",
    "dangling.neck": " mm",
    "dangling.step": " mm",
    "edge": " mm",
}
#: What stands for a figure that is missing.
ABSENT = {
    "dangling.largest": "none",
    "edge": "none: made without a grid",
    "quality": "no triangles",
    "quality.largest_aspect": "a triangle has no area",
    "volume_error": "not known: no lattice or beams on a grid",
}


def table(figures: Mapping[str, Any], absent: str = "needs a region") -> str:
    """Figures one a line, those of a group under its name; ``absent`` stands for those that are None."""
    lines: list[tuple[str, Any]] = []
    for key, value in figures.items():
        if key in ("voids", "transitions"):
            continue
        group = value.items() if isinstance(value, Mapping) else None
        lines += [(f"{key}.{k}", v) for k, v in group if k != "histogram"] if group else [(key, value)]
    width = max(15, *(len(key) for key, _ in lines))
    return "\n".join(f"{key:{width}} {_cell(key, value, absent)}" for key, value in lines)


def _cell(key: str, value: Any, absent: str) -> str:
    if value is None:
        return ABSENT.get(key, absent)
    if key == "bounds" and isinstance(value[0], list):
        return " to ".join(map(point, value)) + " mm"
    if key == "dangling.largest":
        return f"{figure(value['volume'])} mm³ at {point(value['place'])} mm"
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (figure(value) if isinstance(value, float) else str(value)) + UNITS.get(key, "")


#: Voids that are listed one by one.
LISTED = 5


def voids(found: list) -> str:
    """What is warned of closed voids: powder and resin stay in them."""
    total = figure(sum(v["volume"] for v in found))
    if len(found) == 1:
        return f"one closed void of {total} mm³ at {point(found[0]['point'])} mm: powder or resin cannot drain from it"
    listed = ", ".join(f"{figure(v['volume'])} mm³ at {point(v['point'])} mm" for v in found[:LISTED])
    more = f", and {len(found) - LISTED} smaller ones" if len(found) > LISTED else ""
    return (
        f"{len(found)} closed voids of {total} mm³ in all: powder or resin cannot drain from them. "
        f"Largest first: {listed}{more}"
    )
