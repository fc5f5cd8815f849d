#!/usr/bin/env python3
"""Writes docs/images/shown: the pictures of docs/guide/see-it.md, made by the designs and the commands on that page; and those
of the front page and of the page on beams, of examples.
"""

import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE, PICTURES = ROOT / "docs" / "guide" / "see-it.md", ROOT / "docs" / "images" / "shown"
#: Pictures of examples, beside those of the gallery: the example, and how it is drawn.
EXAMPLES = {
    "hip_stem.png": "hip_stem.toml --edge 0.18 --size 900x1080 --azimuth 240 --elevation 12",
    "beams.png": "diamond_cylinder.toml --per-cell 64 --size 720x720",
}


def main():
    text = PAGE.read_text(encoding="utf-8")
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(ROOT / "examples")
        for name, design in re.findall(r"^```toml\n# file: (\S+)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            (Path(folder) / name).write_text(design, encoding="utf-8")
        for words in re.findall(r"^trabecula (render .*)$", text, re.MULTILINE):
            subprocess.run([sys.executable, "-m", "trabecula", *shlex.split(words), "--quiet"], cwd=folder, check=True)
        for name in sorted(set(re.findall(r"images/shown/([\w.]+)", text))):
            shutil.copy(Path(folder) / name, PICTURES)
            print(PICTURES / name)
        for name, words in EXAMPLES.items():
            picture = PICTURES.parent / name
            to_scale = ("--projection", "orthographic", "--scale-bar", "--quiet", "-o", str(picture))
            command = (sys.executable, "-m", "trabecula", "render", *shlex.split(words), *to_scale)
            subprocess.run(command, cwd=ROOT / "examples", check=True)
            print(picture)


if __name__ == "__main__":
    main()
