"""The code in the README, the docs and the examples runs and does what it says.

In a page's order, in one folder that holds `examples/`: a `toml` block that begins with `# file: NAME` is saved under
that name and checked; another that has `schema` is checked as it stands; the rest must parse. Lines of a `sh` block are
commands. `python` blocks of a page share their names. A block below `<!-- needs: PACKAGE -->` is left out
where that is missing.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path

import pytest
import trabecula

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip("tomli")

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"(?:^<!-- needs: (?P<needs>\w+) -->\n)?^```(?P<in>\w+)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]*))?\)")


def blocks(page):
    """(language, text, line) of each fenced block whose package is there."""
    text = page.read_text(encoding="utf-8")
    found = [m for m in BLOCK.finditer(text) if m["needs"] is None or find_spec(m["needs"])]
    return [(m["in"], m["text"], text.count("\n", 0, m.start("in")) + 1) for m in found]


def named(page):
    return str(page.relative_to(ROOT))


def test_every_page_is_in_the_site():
    pages = set(re.findall(r"^ +- (?:\w+: )?(\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    assert pages == {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder with the examples in it, and the working directory there."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(words, expected=0):
    """Runs `trabecula ...` by this interpreter."""
    done = subprocess.run([sys.executable, "-m", "trabecula", *words], capture_output=True, text=True, timeout=600)
    assert done.returncode == expected, f"{words}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def run_toml(text, line):
    data = tomllib.loads(text)
    name = re.match(r"# file: (\S+)\n", text)
    if name or "schema" in data:
        path = Path(name[1] if name else f"line{line}.toml")
        path.write_text(text, encoding="utf-8")
        command(["check", str(path)])


def run_shell(text):
    for row in text.splitlines():
        words = shlex.split(row)
        assert words[0] == "trabecula", f"only the command itself may stand in a sh block: {row}"
        command(words[1:])


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p)], ids=named)
def test_code_of_a_page_runs(page, place):
    names = {"__name__": "__docs__"}
    for language, text, line in blocks(page):
        if language == "toml":
            run_toml(text, line)
        elif language == "sh":
            run_shell(text)
        elif language == "python":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", trabecula.DesignWarning)
                exec(compile("\n" * line + text, str(page), "exec"), names)
        else:
            assert language == "text", f"{named(page)}:{line}: a block in {language} is never run"


@pytest.mark.parametrize("page", [*PAGES, *ROOT.glob("*.md")], ids=named)
def test_links_between_pages_lead_somewhere(page):
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    made_later = ("docs/images/", "docs/generated/")
    for target, anchor in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        path = page if not target else (page.parent / target).resolve()
        if not path.exists() and str(path.relative_to(ROOT)).replace(os.sep, "/").startswith(made_later):
            continue
        assert path.exists(), f"{named(page)}: no {target}"
        if anchor and path.suffix == ".md" and path.parent.name != "generated":
            assert f'id="{anchor}"' in path.read_text(encoding="utf-8"), f"{named(page)}: no #{anchor} in {target}"


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda p: p.name)
def test_example_designs_check(path):
    command(["check", str(path)])


#: What examples need besides the package, and what makes them quick.
NEEDS = {"stiffest_gyroid.py": ("scipy", "12")}


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.name)
def test_example_programs_run(path, place):
    package, *words = NEEDS.get(path.name, ("numpy",))
    pytest.importorskip(package)
    program = [sys.executable, str(place / "examples" / path.name), *words]
    done = subprocess.run(program, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
