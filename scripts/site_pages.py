"""Assembles build/pages, from which ``make site`` makes the site: docs/, and copies of what its pages link to elsewhere."""

import re
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = ROOT / "build" / "pages"
#: The target of a link or picture that leaves the folder of its page.
LINK = re.compile(r"(?<=\]\()(\.\./[^)\s#]*)")
#: Where links to folders lead.
FOLDERS = {"examples": "gallery.md"}


def within(page: Path, link: str) -> tuple[str, Path | None]:
    """A link of a page as the site has it, and what it leads to if that lies outside docs/."""
    found = (page.parent / link).resolve()
    if found.is_relative_to(DOCS) or not found.is_relative_to(ROOT):
        return link, None
    name = found.relative_to(ROOT).as_posix()
    up = "../" * (len(page.relative_to(DOCS).parts) - 1)
    return up + FOLDERS.get(name, name), None if name in FOLDERS else found


def main() -> None:
    """Writes the folder anew."""
    shutil.rmtree(PAGES, ignore_errors=True)
    shutil.copytree(DOCS, PAGES)
    shutil.copytree(ROOT / "examples", PAGES / "examples")
    for page in DOCS.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        for _, file in (within(page, link) for link in LINK.findall(text)):
            if file is not None:
                copy = PAGES / file.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, copy)
        made = LINK.sub(lambda link, page=page: within(page, link[0])[0], text)
        (PAGES / page.relative_to(DOCS)).write_text(made, encoding="utf-8")


if __name__ == "__main__":
    main()
