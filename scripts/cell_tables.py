#!/usr/bin/env python3
"""Writes docs/generated/cells.md: what the core knows of each named cell, by its public Python names."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import trabecula

ROOT = Path(__file__).resolve().parent.parent
CELLS = ["gyroid", "diamond", "primitive", "iwp", "neovius", "frd", "fischer_koch_s", "lidinoid", "split_p"]
FRACTIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
PARTS = ("sheet", "lower", "upper")
DESIGN = """schema = 1
units = "mm"
region.box.size = [1, 1, 1]
[lattice.a]
cell = "{cell}"
part = "{part}"
map.affine.wavelength = 1.0
level.fraction = 0.5
"""


def limits(cell, part):
    """The intervals of fraction in which the periodic solid is one piece, from `trabecula check --json`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.toml"
        path.write_text(DESIGN.format(cell=cell, part=part))
        command = [sys.executable, "-m", "trabecula", "check", str(path), "--json"]
        report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return report["lattices"]["a"]["connected_fraction"]


def main():
    """Write the page."""
    lines = ["<!-- Made by scripts/cell_tables.py; do not edit. -->", "# The named cells in numbers", ""]
    lines += ["The two gyroids differ by a mirror and share their numbers.", ""]
    for part, meaning in zip(PARTS, ("|f| ≤ t", "f ≤ t", "f ≥ t"), strict=True):
        lines += [f"## Level t for a fraction, `{part}`: {meaning}", ""]
        lines += ["| fraction | " + " | ".join(CELLS) + " |", "|---" * (len(CELLS) + 1) + "|"]
        for v in FRACTIONS:
            lines.append(f"| {v} | " + " | ".join(f"{trabecula.iso(c, v, part=part):.6f}" for c in CELLS) + " |")
        lines.append("")
    lines += [
        "## Fractions in which the periodic solid is one piece",
        "",
        "| cell | sheet | lower | upper |",
        "|---|---|---|---|",
    ]
    for cell in CELLS:
        cells = [", ".join(f"{a:.4f} to {b:.4f}" for a, b in limits(cell, part)) or "none" for part in PARTS]
        lines.append(f"| {cell} | " + " | ".join(cells) + " |")
    target = ROOT / "docs" / "generated" / "cells.md"
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(target)


if __name__ == "__main__":
    main()
