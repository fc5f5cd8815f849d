"""The type stubs say what the compiled module has."""

import ast
import subprocess
import sys
from pathlib import Path

import trabecula
from trabecula import _core


def public(names):
    """Names without underscores, the version kept."""
    return {n for n in names if not n.startswith("_") or n == "__version__"}


def test_stubs_match():
    """Same names, same members, same parameters."""
    tree = ast.parse((Path(trabecula.__file__).parent / "_core.pyi").read_text())
    functions = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}
    classes = {n.name: n for n in tree.body if isinstance(n, ast.ClassDef)}
    constants = {n.target.id for n in tree.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}
    assert set(functions) | set(classes) | constants == public(vars(_core))
    for name, stub in functions.items():
        check(stub, getattr(_core, name), skip=0)
    for name, stub in classes.items():
        members = {n.name: n for n in stub.body if isinstance(n, ast.FunctionDef)}
        assert set(members) == public(vars(getattr(_core, name))), name
        for member, node in members.items():
            words = {d.id for d in node.decorator_list if isinstance(d, ast.Name)}
            if "property" not in words:
                check(node, getattr(getattr(_core, name), member), skip=0)


def check(stub, real, skip):
    """The parameters, by the module's own signature."""
    want = [a.arg for a in stub.args.args][skip:]
    signature = real.__text_signature__ or ""
    found = [w.strip().split("=")[0].lstrip("$") for w in signature.strip("()").split(",")]
    assert [w for w in found if w not in ("", "/")] == want, f"{stub.name}: {signature}"


def test_public_names():
    """Every public name can be fetched and is documented."""
    for name in trabecula.__all__:
        thing = getattr(trabecula, name)
        assert name == "__version__" or thing.__doc__, name


def test_report_classes_are_those_of_the_core():
    """python/trabecula/reports.py is what scripts/report_classes.py makes."""
    script = Path(__file__).parent.parent / "scripts" / "report_classes.py"
    done = subprocess.run([sys.executable, str(script), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, f"run {script}\n{done.stderr}"
