#!/usr/bin/env python3
"""Writes docs/images/shown: the pictures of docs/guide/see-it.md, made by the designs and the commands on that page."""

import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE, PICTURES = ROOT / "docs" / "guide" / "see-it.md", ROOT / "docs" / "images" / "shown"


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


if __name__ == "__main__":
    main()
