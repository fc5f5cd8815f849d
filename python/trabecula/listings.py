"""``trabecula cells``: the cells that there are."""

from __future__ import annotations

from . import _core, beams, cell
from .errors import Refused
from .telling import tell_json
from .words import figure


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
        return tell_json(facts[0] if args.name else facts)
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
        return tell_json(facts[0] if args.name else facts)
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


def beam_cells(args) -> None:
    """``trabecula cells --beams``."""
    facts = beams.cells()
    if args.name:
        known_cell(args.name, [it["name"] for it in facts])
        facts = [it for it in facts if it["name"] == args.name]
    if args.json:
        return tell_json(facts[0] if args.name else facts)
    for it in facts:
        print(f"{it['name']}  ({it['title']})")
        print(f"  group    {it['group']}")
        print(f"  cell     {len(it['nodes'])} nodes, {len(it['struts'])} beams of {figure(it['length'])} edges in all")
        print(f"  valence  {', '.join(f'{n} of {v}' for v, n in it['valence'].items())}")
        print(f"  Maxwell  {it['maxwell']:+d}")
        if it["aspect"] != [1.0, 1.0, 1.0]:
            print(f"  edges    in the ratio {' : '.join(figure(v) for v in it['aspect'])} for its usual shape")


def known_cell(name: str, known: list[str]) -> None:
    """Refuses the name of no cell."""
    if name not in known:
        from difflib import get_close_matches

        near = get_close_matches(name, known, 1)
        hint = f'; did you mean "{near[0]}"?' if near else "."
        raise Refused(f'no cell is named "{name}"{hint} There are: {", ".join(known)}')
