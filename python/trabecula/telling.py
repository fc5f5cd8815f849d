"""Reports in words: what ``check``, ``mesh``, ``measure`` and ``tets`` print."""

from __future__ import annotations

from .mesh import Mesh
from .transition import off
from .words import figure, say, span


def tell_json(figures: dict) -> None:
    """Figures as JSON on stdout."""
    import json

    print(json.dumps(figures, indent=2))


def tell_share(it: dict) -> None:
    """The solid share of a part of beams."""
    how = "exact" if it["fraction_exact"] else "sampled"
    print(f"  fraction   {it['fraction']:.4f}, porosity {it['porosity']:.4f} of the part ({how})")


def tell_beams(name: str, it: dict) -> None:
    """What a graph of beams is."""
    least, most = it["hub_radius"]
    if "repeats" in it:
        times = " × ".join(map(str, it["repeats"]))
        print(f"beams {name}: a pattern of {times}, {it['hubs']:.9g} hubs of {it['kinds']} kinds, {it['beams']:.9g} beams")
        print(f"  thickness  {figure(it['thickness'])} mm (thinnest beam)")
        print(f"  hubs       radius {span(least if least == most else [least, most])} mm")
        tell_share(it)
        return
    print(f"beams {name}: {it['cell'] or 'nodes and struts'}, {counted(it['hubs'], 'hub')}, {counted(it['beams'], 'beam')}")
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
    tell_share(it)
    if it["volume"] is not None:
        print(f"  exactly    {figure(it['volume'])} mm³, {figure(it['area'])} mm² of surface")
    done = {"cleaned": it["cleaned"], "trimmed": it["trimmed"]}
    for what, counts in done.items():
        told = [f"{n} {word.replace('_', ' ')}" for word, n in counts.items() if n]
        if told:
            print(f"  {what}    {', '.join(told)}")
    print(f"  pieces     {it['pieces']}; {counted(it['dangling'], 'node')} with a free end")


def tell_tiling(t: dict) -> None:
    """The mesh under a tetrahedral lattice, its walls and its creases."""
    print(f"  mesh       {t['count']} tetrahedra, edges {figure(t['edge'])} mm on average, {figure(t['volume'])} mm³")
    for zone, it in (t["zones"] or {}).items():
        print(f"  zone {zone}     {it['cell']} in {it['count']} tetrahedra; solid fraction {it['solid_fraction']:.4f}")
    for join in t["joins"] or []:
        a, b = join["zones"]
        state = "join" if join["joined"] else "do not join"
        passed = f"solid passes {join['open']} of {join['faces']} faces"
        print(f"  zones {a}, {b} {state}: {passed}; their ports share {100 * join['ports']:.1f} % of a face")
    if t["pieces"] is not None:
        print(f"  pieces     {t['pieces']}, by ports")
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
        f"  spacing    {farthest['mean']:.2f} of what was asked for on average, off by a factor of {farthest['max']:.2f} at "
        f"most; {100 * d['outside']:.1f} % outside 1/1.5 to 1.5"
    )
    print(f"  turn       {d['turn']:.1f}° per cell at most")


#: What is said where a figure is missing for another reason than that there is no region.
ABSENT = {"dangling.largest": "none", "quality": "no triangles", "quality.largest_aspect": "a triangle has no area"}


def listed(figures: dict) -> list[tuple]:
    """The figures line by line: those of a group under its name, without histograms."""
    lines: list[tuple] = []
    for key, value in figures.items():
        if key == "voids":
            continue
        group = value.items() if isinstance(value, dict) else None
        lines += [(f"{key}.{k}", v) for k, v in group if k != "histogram"] if group else [(key, value)]
    return lines


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
        off = f"95 % within {fit['deviation_p95']:.2g} mm, {fit['deviation']:.2g} mm at most"
        print(f"fit         {fit['deviation_mean']:.2g} mm off the surface on average, {off}")
        print(f"left out    {100 * fit['lost']:.2g} % of the region, up to {fit['lost_depth']:.2g} mm deep")


def counted(n: int, what: str = "piece") -> str:
    """A number of things."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"
