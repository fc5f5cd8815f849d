"""A study of a small cell, and tables, for the tests of sweeps."""

import csv
from pathlib import Path

BASE = """
schema = 1
units = "mm"
region.box.size = [4, 4, 4]
[lattice.a]
cell = "gyroid"
part = "sheet"
map.affine.wavelength = 4
level.fraction = 0.3
"""
#: Two designs.
TWO = '"lattice.a.level.fraction" = [0.2, 0.3]'


def written(folder: Path, sweep: str, name: str = "study.toml") -> Path:
    path = folder / name
    path.write_text(BASE + "[sweep]\n" + sweep)
    return path


def table(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)]
