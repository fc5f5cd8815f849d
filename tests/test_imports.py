"""Imports between the parts of the package go one way, those within functions too; what is for type checkers alone is free."""

import ast
import importlib
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "python" / "trabecula"

#: From the lowest to the highest: subpackages, and files next to them. What stands in a line imports from lines above alone.
LAYERS = """
errors
base
reports
io
pictures
jobs
beams blend cell finite_elements grade layers level levels map quadors thickness transition voxels
mesh
parts region volumes
carrier
saved simulated
solid
design
laws tets
sweeps
command
"""
#: Both doors import whatever is asked for.
DOORS = ("__init__", "__main__")
#: A solid shows its stiffness by the law of its cell, for which designs are built.
UPWARDS = {("solid", "laws")}


def layers():
    """The number of the line of each part."""
    return {name: n for n, line in enumerate(LAYERS.split("\n")) for name in line.split()}


def parts():
    """The files of each part of the package."""
    found = {path.stem: [path] for path in PACKAGE.glob("*.py") if path.stem not in DOORS}
    return found | {at.parent.name: sorted(at.parent.glob("*.py")) for at in PACKAGE.glob("*/__init__.py")}


def imported(text, depth):
    """The parts of the package that a file imports, ``depth`` folders below it; "" stands for the package's own names."""
    found, waiting = set(), [ast.parse(text)]
    while waiting:
        node = waiting.pop()
        names = []
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            waiting += node.orelse
            continue
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            here = "trabecula" + ".inner" * (depth + 1 - node.level) if node.level else ""
            base = ".".join(filter(None, (here, node.module)))
            names = [f"{base}.{alias.name}" for alias in node.names]
        found |= {name.split(".")[1] if "." in name else "" for name in names if name.split(".")[0] == "trabecula"}
        waiting += ast.iter_child_nodes(node)
    return found - {"inner", "_core"}


def wrong(imports, height):
    """The imports, each of a part by another, that go up or stay at their height."""
    return {(of, to) for of, to in imports if height.get(to, len(LAYERS)) >= height[of]}


def test_layers_hold():
    """Every part has a layer, and imports from lower ones; the exceptions are needed."""
    height = layers()
    assert set(parts()) == set(height)
    imports = {
        (name, to)
        for name, files in parts().items()
        for path in files
        for to in imported(path.read_text(encoding="utf-8"), len(path.relative_to(PACKAGE).parts) - 1)
    }
    assert len(imports) > 100
    # A name of the package itself, such as its version, is that of a module.
    assert {to for _, to in imports} <= set(height)
    assert wrong({(of, to) for of, to in imports if of != to}, height) == UPWARDS


@pytest.mark.parametrize(
    ("text", "depth", "found"),
    [
        ("from . import solid, _core", 0, {"solid"}),
        ("from .base.files import whole_file", 0, {"base"}),
        ("def f():\n    from ..mesh import Mesh", 1, {"mesh"}),
        ("from .seen import Seen\nfrom . import seen", 1, set()),
        ("from .. import __version__", 1, {"__version__"}),
        ("import trabecula.jobs.ranges as r, os", 1, {"jobs"}),
        ("from trabecula import laws\nfrom os import path", 1, {"laws"}),
        ("import trabecula", 1, {""}),
        ("if TYPE_CHECKING:\n    from .solid import Solid\nelse:\n    from .mesh import Mesh", 0, {"mesh"}),
        ("if other:\n    from .solid import Solid", 0, {"solid"}),
    ],
)
def test_imports_are_found(text, depth, found):
    """Whatever way they are written."""
    assert imported(text, depth) == found


def test_what_goes_up_is_found():
    """Imports of a higher layer, of a neighbour, and of what has no layer."""
    given = {("io", "base"), ("base", "io"), ("cell", "map"), ("solid", "other")}
    assert wrong(given, layers()) == given - {("io", "base")}


#: In the core's sources: a module of the package, and a name of it where that is written out.
CALLED = re.compile(r'py\.import\("(trabecula[^"]*)"\)\?(?:\.(?:getattr|call_method0)\("(\w+)"\))?')


def test_what_the_core_calls_is_there():
    """The compiled module calls functions of the package by their names."""
    sources = PACKAGE.parent.parent / "crates" / "trabecula-py" / "src"
    called = {found for path in sources.glob("*.rs") for found in CALLED.findall(path.read_text(encoding="utf-8"))}
    assert ("trabecula.io.children", "stop") in called and len(called) >= 9
    for module, name in called:
        assert hasattr(importlib.import_module(module), name or "__name__"), f"{module}.{name}"
