"""Writes docs/generated/blend.md: the figures of the hybrid paper as designs, with what their transitions hold."""

import warnings
from pathlib import Path

import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "generated" / "blend.md"
BORDERS = ("hybrid_rbf_gyroid", "hybrid_distance_gyroid", "hybrid_rbf_iwp", "hybrid_distance_iwp")
LAMINATES = ("laminate_skew", "laminate_phase")


def built(name, by=None):
    """The solid of an example, its blend by another rule if asked for."""
    design = lt.load(ROOT / "examples" / f"{name}.toml")
    data = design.to_dict()
    if by is not None:
        data["blend"]["by"] = by
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        return lt.Design(**data, folder=str(ROOT / "examples")).build()


def border(name, by):
    solid = built(name, by)
    (it,) = solid.transitions()
    rows = it["fractions"]
    least = min(r["found"] for r in rows)
    neck = it["neck"]
    made = [
        f"[{name}](../../examples/{name}.toml)",
        by,
        f"{least:.3f}",
        f"{max((r['found'] - r['asked'] for r in rows), key=abs):+.3f}",
        f"{neck['diameter']:.2f}" if neck else "none",
        f"{it['loose']['bodies']} ({it['loose']['volume']:.2f})",
        f"{it['dangling']['bodies']} ({it['dangling']['volume']:.2f})",
        f"{it['volume']:.0f}",
    ]
    return f"| {' | '.join(made)} |"


def holds(name, fraction):
    """The share of the solid in the largest piece of a laminate at this fraction."""
    data = lt.load(ROOT / "examples" / f"{name}.toml").to_dict()
    for lattice in data["lattice"].values():
        lattice["level"] = {"fraction": fraction}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        solid = lt.Design(**data).build()
        mesh = solid.mesh(per_cell=12, islands="drop")
    lost = mesh.islands["volume"] if mesh.islands["dropped"] else 0.0
    return mesh.volume / (mesh.volume + lost)


def apart(name):
    """The fraction below which less than nine tenths of the solid hang together, to 0.005."""
    low, high = 0.10, 0.50
    while high - low > 0.005:
        middle = (low + high) / 2
        low, high = (low, middle) if holds(name, middle) >= 0.9 else (middle, high)
    return high


def main():
    text = [
        "# The hybrid paper's figures, by numbers",
        "",
        "Written by `scripts/blend_tables.py`. See [blends](../concepts/blend.md).",
        "",
        "## Figures 5 and 6: one border by radial basis functions and by distance",
        "",
        "Cells of 3 mm, 30 % asked for everywhere. The widest way's narrowest neck in mm, bodies with their volume in mm³.",
        "",
        "| example | by | least fraction | most off, in a tenth of the weights | neck | loose | dangling | volume, mm³ |",
        "|---|---|---|---|---|---|---|---|",
        *(border(name, by) for name in BORDERS for by in ("value", "fraction")),
        "",
        "## Figure 4: a laminate by skews and by one map",
        "",
        "| example | less than nine tenths hang together below a fraction of |",
        "|---|---|",
        *(f"| [{name}](../../examples/{name}.toml) | {apart(name):.3f} |" for name in LAMINATES),
    ]
    OUT.write_text("\n".join(text) + "\n", encoding="utf-8", newline="\n")
    print(OUT)


if __name__ == "__main__":
    main()
