#!/usr/bin/env python3
"""Says in a few lines what `make demo` made: reads FOLDER/report.json and lists the files beside it."""

import json
import sys
from pathlib import Path

FILES = {
    "hip_stem.3mf": "the part, for a slicer",
    "hip_stem.stl": "the same surface as binary STL",
    "report.json": "every measure",
    "hip_stem.png": "a picture",
}


def main():
    """Print the summary."""
    folder = Path(sys.argv[1])
    report = json.loads((folder / "report.json").read_text())
    print()
    print(
        f"A hip stem with a lattice: {report['volume']:.1f} mm3 of solid, "
        f"{100 * report['solid_fraction']:.2f} % of the part ({100 * report['porosity']:.2f} % porosity)."
    )
    print(
        f"{'Closed' if report['closed'] else 'NOT CLOSED'}, {report['pieces']} piece(s), "
        f"{report['cavities']} cavities, area {report['area']:.1f} mm2, Euler number {report['euler']}."
    )
    print()
    for name, what in FILES.items():
        print(f"  {folder / name}  {what}")
    print("\nNext: a part of your own, docs/guide/fill-a-part.md")


if __name__ == "__main__":
    main()
