#!/usr/bin/env python3
"""Writes docs/gallery.md and its pictures: the example designs, each meshed and seen, with what came out."""

import sys
import warnings
from pathlib import Path

import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES, PICTURES = ROOT / "examples", ROOT / "docs" / "images" / "gallery"
STAMP = "<!-- Made by scripts/gallery.py; do not edit. -->"
#: Pixels of a picture; of one of a tall part, and of a long one.
WIDE, TALL, LONG = (800, 640), (560, 800), (800, 480)
#: Example, samples on the smallest wavelength (none: the usual mesh, of beams alone finer), azimuth and elevation of the
#: camera (degrees), pixels.
SHOWN = (
    ("hybrid_stem", 20, 70, 12, TALL),
    ("kelvin_stem", None, 240, 12, TALL),
    ("stress_bracket", 20, 300, 20, LONG),
    ("heat_exchanger", 24, 30, 35, WIDE),
    ("helmet_liner", 24, 30, -20, WIDE),
    ("hip_cup", 24, 30, 40, WIDE),
    ("shoe_sole", 28, 300, 35, LONG),
    ("octet_filleted", None, 30, 25, WIDE),
    ("diamond_cylinder", None, 30, 25, WIDE),
    ("swirl", 16, 30, 25, WIDE),
    ("hybrid_bar", 24, 290, 25, LONG),
    ("hybrid_rbf_gyroid", 16, 270, 55, WIDE),
    ("oriented_vortex", 20, 270, 55, WIDE),
    ("pressure_tube", 24, 30, 50, WIDE),
    ("swept_beam", 20, 280, 40, LONG),
    ("wrapped_tube", 24, 30, 35, WIDE),
    ("wavy_panel", 24, 300, 35, LONG),
    ("bracket", 24, 40, -30, WIDE),
    ("user_series", 32, 30, 25, WIDE),
)


def about(path):
    """The comment at the head of a design, in one paragraph."""
    lines = []
    for line in path.read_text(encoding="utf-8").removeprefix("#:schema ../schema/design.json\n\n").splitlines():
        words = line.removeprefix("#").strip()
        if not line.startswith("#") or not words:
            break
        lines.append(words)
    return " ".join(lines)


def entry(name, per_cell, azimuth, elevation, size):
    """A section: what it is, its picture, what came out. The picture is made on the way."""
    path = EXAMPLES / f"{name}.toml"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        solid = lt.load(path).build()
        mesh = solid.mesh(per_cell=per_cell)
    to_scale = {"projection": "orthographic", "scale_bar": True}
    mesh.render(PICTURES / f"{name}.png", size, azimuth, elevation, solid=solid, **to_scale)
    pieces = "one piece" if mesh.pieces == 1 else f"{mesh.pieces} pieces"
    count = f"{mesh.counts[1]:,}".replace(",", " ")
    figures = f"{count} triangles, {mesh.volume:.4g} mm³, solid fraction {mesh.solid_fraction:.3f}, {pieces}"
    fine = f"{per_cell} samples on the smallest wavelength" if per_cell else f"a grid of {solid.spacing():.2g} mm"
    return [
        f"## [{name}.toml](../examples/{name}.toml)",
        "",
        about(path),
        "",
        f"![{name}](images/gallery/{name}.png)",
        "",
        f"{figures}; {fine}.",
        "",
    ]


def main():
    PICTURES.mkdir(parents=True, exist_ok=True)
    lines = [STAMP, "# Gallery", "", "What the [examples](../examples) make.", ""]
    for shown in SHOWN:
        print(shown[0], file=sys.stderr, flush=True)
        lines += entry(*shown)
    (ROOT / "docs" / "gallery.md").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
