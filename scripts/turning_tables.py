"""Writes docs/generated/turning.md: the examples with cells that turn, what was asked for and what they are."""

from pathlib import Path

import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "generated" / "turning.md"
EXAMPLES = ("primitive_cells", "oriented_block", "oriented_vortex", "wrapped_tube")


def row(name):
    solid = lt.load(ROOT / "examples" / f"{name}.toml").build()
    (it,) = solid.report()["lattices"].values()
    mesh = solid.mesh(per_cell=24)
    found = mesh.measure()
    low, high = it["fraction"] if isinstance(it["fraction"], list) else (it["fraction"],) * 2
    asked = f"{low:.3f}" if high - low < 5e-4 else f"{low:.3f} to {high:.3f}"
    d = it.get("distortion")
    angle = {key: max(a[key] for a in d["angle"]) for key in ("mean", "max")} if d else None
    spacing = [s["max"] for s in d["spacing"]] if d else None
    cells = [
        f"[{name}](../../examples/{name}.toml)",
        asked,
        f"{found['solid_fraction']:.4f}",
        str(found["pieces"]),
        f"{angle['mean']:.1f}°, {angle['max']:.1f}°" if d else "",
        f"{max(spacing):.2f}" if d else "",
        f"{d['turn']:.1f}°" if d else "",
    ]
    return f"| {' | '.join(cells)} |"


def main():
    head = (
        "| example | fraction of the cell | solid fraction of the part | pieces | angle off, mean and greatest | widest "
        "spacing | turn per cell |",
        "|---|---|---|---|---|---|---|",
    )
    about = (
        "# Cells that turn, by numbers",
        "",
        "Written by `scripts/turning_tables.py`, at 24 samples a cell. Angles and spacings are those of solved maps, each of",
        "the axis where it is greatest; see [cells that turn](../concepts/phase.md). A part holds few whole cells, so its",
        "solid fraction need not be its cells'.",
        "",
    )
    OUT.write_text("\n".join([*about, *head, *map(row, EXAMPLES)]) + "\n", encoding="utf-8", newline="\n")
    print(OUT)


if __name__ == "__main__":
    main()
