#!/usr/bin/env python3
"""Writes the pictures of docs/images: of `shown` those that pages show, each made by the command on its page that writes a file
of that name; of `cells` the cells with a name; and those of the front page and of the page on beams, of examples.

    python scripts/pictures.py [PAGE ...]
"""

import json
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
DOCS, IMAGES = ROOT / "docs", ROOT / "docs" / "images"
#: Pictures of examples, beside those of the gallery: the example, and how it is drawn.
EXAMPLES = {
    "hip_stem.png": "hip_stem.toml --edge 0.18 --size 900x1080 --azimuth 240 --elevation 12",
    "beams.png": "diamond_cylinder.toml --per-cell 64 --size 720x720",
}
#: Solid fractions of the cells, and the pixels of their pictures.
FRACTIONS, PIXELS = {"sheet": 0.25, "lower": 0.35}, (240, 240)


def written(words):
    """The files that a command writes."""
    if words[0] == "new":
        return {words[1]}
    # What follows a flag that names files.
    found, names_files = set(), False
    for word in words:
        names_files = word in ("-o", "--histogram") or (names_files and not word.startswith("-"))
        found |= {word} if names_files else set()
    return found


def shown(page):
    """Makes the pictures of a page by its designs, its Python and those of its commands that they need."""
    text = page.read_text(encoding="utf-8")
    pictures = set(re.findall(r"images/shown/([\w.]+)", text))
    wanted, commands = set(pictures), []
    for words in reversed([shlex.split(line) for line in re.findall(r"^trabecula (.*)$", text, re.MULTILINE)]):
        if wanted & written(words):
            commands.insert(0, words)
            wanted |= set(words)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(ROOT / "examples")
        for name, design in re.findall(r"^```toml\n# file: (\S+)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            (Path(folder) / name).write_text(design, encoding="utf-8")
        # A design may need an array that Python makes.
        for code in re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            if "np.save(" in code:
                subprocess.run([sys.executable, "-c", code], cwd=folder, check=True)
        for words in commands:
            subprocess.run([sys.executable, "-m", "trabecula", *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        for name in sorted(pictures):
            shutil.copy(Path(folder) / name, IMAGES / "shown")
            print(IMAGES / "shown" / name)


def cells():
    """Makes a picture of one period of each cell, as a sheet and as a network."""
    (IMAGES / "cells").mkdir(exist_ok=True)
    command = [sys.executable, "-m", "trabecula", "cells", "--json"]
    known = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    for name in [cell["name"] for cell in known if cell["name"] != "gyroid_mirrored"]:
        for part, fraction in FRACTIONS.items():
            core = lt.Lattice(cell=name, part=part, map=lt.map.affine(10), level=lt.level.fraction(fraction))
            solid = lt.Design(region=lt.region.box(size=[10, 10, 10]), lattice=core).build()
            mesh = solid.mesh(per_cell=64, islands="drop")
            picture = IMAGES / "cells" / f"{name}_{part}.png"
            mesh.render(picture, PIXELS)
            print(picture)


def examples():
    """Makes the pictures of examples."""
    for name, words in EXAMPLES.items():
        picture = IMAGES / name
        to_scale = ("--projection", "orthographic", "--scale-bar", "--quiet", "-o", str(picture))
        command = (sys.executable, "-m", "trabecula", "render", *shlex.split(words), *to_scale)
        subprocess.run(command, cwd=ROOT / "examples", check=True)
        print(picture)


def main():
    (IMAGES / "shown").mkdir(parents=True, exist_ok=True)
    pages = [Path(page).resolve() for page in sys.argv[1:]] or sorted(DOCS.rglob("*.md"))
    for page in pages:
        if "images/shown/" in page.read_text(encoding="utf-8"):
            shown(page)
    if not sys.argv[1:]:
        cells()
        examples()


if __name__ == "__main__":
    main()
