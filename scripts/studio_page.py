"""Puts the studio together: one page with nothing outside it, from its sources in studio/, the viewer and the core as wasm.

python scripts/studio_page.py CORE.wasm PAGE.html...
"""

import base64
import sys
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STUDIO, PACKAGE = ROOT / "studio", ROOT / "python" / "trabecula"
#: In the order in which they are run.
SCRIPTS = (
    PACKAGE / "pictures" / "viewer.js",
    STUDIO / "rays.js",
    STUDIO / "core.js",
    STUDIO / "controls.js",
    STUDIO / "studio.js",
)
AXES = "".join(
    f'<g data-part="{name}"><line stroke="{colour}" stroke-width="2"/><text text-anchor="middle" dy=".35em" '
    f'fill="currentColor">{name}</text></g>'
    for name, colour in (("x", "#d1483c"), ("y", "#3c9d4e"), ("z", "#3a72d8"))
)


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def page(core: bytes) -> str:
    """The page."""
    parts = {
        "style": text(PACKAGE / "pictures" / "viewer.css") + text(STUDIO / "studio.css"),
        "axes": AXES,
        "worker": text(STUDIO / "worker.js"),
        "script": "\n".join(map(text, SCRIPTS)),
        "core": base64.b64encode(zlib.compress(core, 9)).decode(),
    }
    for name in ("worker", "script"):
        assert "</script" not in parts[name], f"{name} would end its own element"
    made = text(STUDIO / "page.html")
    for name, words in parts.items():
        made = made.replace("{{" + name + "}}", words)
    return made


def main() -> None:
    core, *outputs = sys.argv[1:]
    made = page(Path(core).read_bytes())
    for output in map(Path, outputs):
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_text(made, encoding="utf-8", newline="\n")
    size = len(zlib.compress(made.encode(), 9))
    print(f"{outputs[0]}: {len(made) / 1e6:.2f} MB, {size / 1e6:.2f} MB as a server sends it")


if __name__ == "__main__":
    main()
