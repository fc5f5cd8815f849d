#!/usr/bin/env python3
"""Writes docs/generated/cells.md: what the core knows of each named cell, by `trabecula cells` and `trabecula.iso`."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import trabecula

ROOT = Path(__file__).resolve().parent.parent
FRACTIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
PARTS = {"sheet": "|f| ≤ t", "lower": "f ≤ t", "upper": "f ≥ t"}


def main():
    """Write the page."""
    command = [sys.executable, "-m", "trabecula", "cells", "--json"]
    cells = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    lines = ["<!-- Made by scripts/cell_tables.py; do not edit. -->", "# The named cells in numbers", ""]
    lines += ["| cell | | group | least f | greatest f | source |", "|---|---|---|---|---|---|"]
    for cell in cells:
        low, high = cell["range"]
        row = [f"`{cell['name']}`", cell["title"], cell["group"], f"{low:.6g}", f"{high:.6g}", cell["source"]]
        lines.append("| " + " | ".join(row) + " |")
    names = [cell["name"] for cell in cells if cell["name"] != "gyroid_mirrored"]
    lines += ["", "The two gyroids differ by a mirror and share their levels.", ""]
    for part, meaning in PARTS.items():
        lines += [f"## Level t for a fraction, `{part}`: {meaning.replace('|', chr(92) + '|')}", ""]
        lines += ["| fraction | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
        columns = [trabecula.iso(name, np.array(FRACTIONS), part=part) for name in names]
        for v, levels in zip(FRACTIONS, zip(*columns, strict=True), strict=True):
            lines.append(f"| {v} | " + " | ".join(f"{t:.6f}" for t in levels) + " |")
        lines.append("")
    lines += ["## Fractions in which the periodic solid is one piece", "", "| cell | sheet | lower | upper |"]
    lines.append("|---|---|---|---|")
    for cell in cells:
        whole = [cell["connected_fraction"][part] for part in PARTS]
        text = [", ".join(f"{a:.4f} to {b:.4f}" for a, b in each) or "never" for each in whole]
        lines.append(f"| `{cell['name']}` | " + " | ".join(text) + " |")
    target = ROOT / "docs" / "generated" / "cells.md"
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(target)


if __name__ == "__main__":
    main()
