"""Writes docs/generated/tetcells.md and docs/images/tetcells/: the ready tetrahedral cells, with pictures and numbers."""

from pathlib import Path

import trabecula as lt
from trabecula import _core

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "generated" / "tetcells.md"
IMAGES = ROOT / "docs" / "images" / "tetcells"
STEPS = 60


def spans(ranges):
    return " and ".join(f"{a:.3f} to {b:.3f}" for a, b in ranges) or "never"


def entry(name):
    it = lt.cell.tet_facts(name)
    lt.Mesh(_core.tet_cell_mesh(name, STEPS)).render(IMAGES / f"{name}.png", (320, 320), 30, 20)
    terms = ", ".join(f"{t['amplitude']:g} {t['component'].title()} {tuple(t['hkl'])}" for t in it["terms"])
    ports = "1 port" if it["ports"] == 1 else f"{it['ports']} ports"
    whole = it["connected_fraction"]
    return [
        f"## {name}",
        "",
        f"![{name}](../images/tetcells/{name}.png)",
        "",
        f"{it['title'][0].upper() + it['title'][1:]}. Made for part `{it['part']}` at fraction {it['fraction']:g} "
        f"(iso {it['iso']:.4f}), where each face has {ports}, {100 * it['face_fraction']:.1f} % of it.",
        "",
        f"- Group {it['group']}: {terms}; values from {it['range'][0]:.4f} to {it['range'][1]:.4f}",
        f"- Tetrahedron of edge {it['edge']:.4f} cells about ({', '.join(f'{c:g}' for c in it['site'])})"
        f"{', the dual one' if it['dual'] else ''}",
        f"- One piece that reaches all faces at fractions: sheet {spans(whole['sheet'])}; lower {spans(whole['lower'])}; upper "
        f"{spans(whole['upper'])}",
        "",
    ]


def main():
    IMAGES.mkdir(parents=True, exist_ok=True)
    names = lt.cell.tet_names()
    head = [
        "# The ready tetrahedral cells",
        "",
        "Written by `scripts/tetcell_tables.py`; what they are: [tetrahedral cells](../concepts/tetcells.md). Each is",
        f"shown in a regular tetrahedron, its faces capped, in {STEPS} steps to the edge.",
        "",
    ]
    text = "\n".join(head + [line for name in names for line in entry(name)])
    OUT.write_text(text.rstrip() + "\n", encoding="utf-8", newline="\n")
    print(OUT)


if __name__ == "__main__":
    main()
