"""The type stubs say what the compiled module has."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import trabecula
from test_docs import PAGES, ROOT, blocks
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


#: A mistake where a comment names mypy's code of it, else none.
TYPED = """
import numpy as np
import trabecula as lt

lt.Lattice(cell="gyroyd", part="sheet", map=lt.map.affine(wavelength=5.0), level=lt.level.fraction(0.3))  # arg-type
lt.Lattice(cell="gyroid", part="shet", map=lt.map.affine(wavelength=5.0), level=lt.level.fraction(0.3))  # arg-type
lt.Beams(cell="octett", map=lt.map.affine(wavelength=5.0))  # arg-type
lt.map.affine(wavelengh=5.0)  # call-arg
lt.region.box(size="10")  # arg-type
lt.grade.depth({"0": 0.6})  # arg-type
lt.level.fraction(0.3, of="prat")  # arg-type

lt.map.affine(wavelength=np.array([5, 5, 6]), rotate=np.zeros(3))
lt.map.phase(wavelength=4.0, rotate=[0, lt.grade.depth({0: 0.60, 4: 0.25}), 45])
lt.grade.depth([[0, 0.6], (4, 0.25)])
lt.grade.depth(np.array([[0, 0.6], [4, 0.25]]))
lt.grade.depth({0: 1, 4.5: 2})
lt.grade.distance(np.zeros((4, 3)))
lt.grade.grid(np.zeros((2, 2, 2)), origin=np.zeros(3), step=1.0)
lt.grade.points([[0, 0, 0, 0.3]])
lt.region.mesh((np.zeros((3, 3)), [[0, 1, 2]]))
lt.skin(1.0, open=["-z", lt.region.halfspace(point=np.zeros(3), normal=[0, 0, 1])])
for name in lt.cell.names():
    lt.Lattice(cell=name, part="sheet", map=lt.map.affine(wavelength=5.0), level=lt.level.fraction(0.3))

def shown(layers: lt.Layers) -> float:
    return layers[0].area + sum(layer.z for layer in layers[2:4]) + layers[0].colour  # attr-defined
"""


def test_code_has_the_types_that_it_should(tmp_path):
    """mypy finds the mistakes in the text above, and none in pages and examples: prose need not say that a figure is there, or
    keep a name for one type.
    """
    pytest.importorskip("mypy")
    for page in PAGES:
        code = "\n".join(text for language, text, _ in blocks(page) if language == "python")
        name = "_".join(page.relative_to(ROOT).with_suffix("").parts).replace("-", "_")
        (tmp_path / f"{name}.py").write_text(code, encoding="utf-8")
    for example in (ROOT / "examples").glob("*.py"):
        shutil.copy(example, tmp_path)
    (tmp_path / "mistakes.py").write_text(TYPED)
    words = ["--no-strict-optional", "--allow-redefinition", "--ignore-missing-imports", "."]
    done = subprocess.run([sys.executable, "-m", "mypy", *words], capture_output=True, text=True, cwd=tmp_path)
    assert not done.stderr
    errors = [line for line in done.stdout.splitlines() if ": error: " in line]
    assert [line for line in errors if not line.startswith("mistakes.py")] == []
    found = [(int(line.split(":")[1]), line.rpartition("[")[2].rstrip("]")) for line in errors]
    assert found == [(n, line.rpartition("# ")[2]) for n, line in enumerate(TYPED.splitlines(), 1) if "# " in line]


def test_package_has_the_types_that_it_says(tmp_path):
    """mypy finds nothing in the package itself, by its settings in pyproject.toml."""
    pytest.importorskip("mypy")
    words = ["--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(tmp_path)]
    done = subprocess.run([sys.executable, "-m", "mypy", *words], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_report_classes_are_those_of_the_core():
    """python/trabecula/reports.py is what scripts/report_classes.py makes."""
    script = Path(__file__).parent.parent / "scripts" / "report_classes.py"
    done = subprocess.run([sys.executable, str(script), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, f"run {script}\n{done.stderr}"
