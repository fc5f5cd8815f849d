"""Parts as functions in 3MF, evaluated by an interpreter written from the extension's specification, and read by lib3mf."""

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import numpy as np
import pytest
from trabecula.design import parsed

I = "{http://schemas.3mf.io/3dmanufacturing/implicit/2023/12}"  # noqa: E741  its usual prefix
V = "{http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01}"
BOX = "[region.box]\nsize = [20, 16, 12]\ncenter = [1, 0, 2]\n"

#: Nodes of the specification that are functions of A, or of A and B, component by component.
FUNCTIONS = {
    **{"addition": np.add, "subtraction": np.subtract, "multiplication": np.multiply, "division": np.divide},
    **{"sin": np.sin, "cos": np.cos, "tan": np.tan, "arcsin": np.arcsin, "arccos": np.arccos, "arctan": np.arctan},
    **{"sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "exp": np.exp, "log": np.log, "log10": np.log10},
    **{"sqrt": np.sqrt, "abs": np.abs, "min": np.minimum, "max": np.maximum, "pow": np.power, "arctan2": np.arctan2},
    **{"floor": np.floor, "ceil": np.ceil, "sign": np.sign, "fmod": np.fmod},
}


def evaluate(path, points):
    """The level set's function at points (n, 3)."""
    root = ET.fromstring(zipfile.ZipFile(path).read("3D/3dmodel.model"))
    assert root.get("requiredextensions").split() == ["v", "i"]
    level = next(root.iter(f"{V}levelset"))
    function = next(f for f in root.iter(f"{I}implicitfunction") if f.get("id") == level.get("functionid"))
    values = {"inputs.pos": points.T}
    for node in function:
        kind, name = node.tag.removeprefix(I), node.get("identifier")
        if kind in ("in", "out"):
            continue
        given = {ref.get("identifier"): values[ref.get("ref")] for ref in node.find(f"{I}in") or ()}
        (output, *more) = (o.get("identifier") for o in node.find(f"{I}out"))
        if kind == "constant":
            result = np.full(len(points), float(node.get("value")))
        elif kind == "constvec":
            result = np.repeat([[float(node.get(a))] for a in "xyz"], len(points), axis=1)
        elif kind == "decomposevector":
            assert [output, *more] == ["x", "y", "z"]
            values |= {f"{name}.{a}": row for a, row in zip("xyz", given["A"], strict=True)}
            continue
        elif kind == "dot":
            result = (given["A"] * given["B"]).sum(axis=0)
        elif kind == "cross":
            result = np.cross(given["A"], given["B"], axis=0)
        elif kind == "length":
            result = np.sqrt((given["A"] ** 2).sum(axis=0))
        else:
            result = FUNCTIONS[kind](given["A"], *([given["B"]] if "B" in given else []))
        values[f"{name}.{output}"] = result
    channel = next(o for o in function.find(f"{I}out") if o.get("identifier") == level.get("channel"))
    return values[channel.get("ref")]


def solid(region, lattice):
    return parsed(f"schema = 1\n{region}[lattice.core]\n{lattice}", False, "test", ".").build()


PLAIN = 'cell = "gyroid"\npart = "sheet"\nlevel.fraction = 0.3\nmap.affine = { wavelength = 4 }\n'
CASES = {
    "gyroid": (BOX, PLAIN),
    "turned": (
        BOX,
        'cell = "split_p"\npart = "upper"\nlevel.iso = 0.2\n'
        "map.affine = { wavelength = [4, 5, 6], rotate = [10, 20, 30], offset = [1, 2, 3], skew = { xz = 20 } }\n",
    ),
    "spartan": (
        BOX,
        'cell = "diamond"\npart = "lower"\nlevel.fraction = 0.4\nmap.spartan = { wavelength = 5, rotate = [0, 0, 45] }\n',
    ),
    "linear": (
        "[region.cylinder]\nbase = [0, 0, -5]\naxis = [1, 2, 2]\nradius = 7\nheight = 14\n",
        PLAIN.replace(
            "level.fraction = 0.3", "level.iso.linear = { along = [0, 0, 1], stops = [[-4, 0.2], [0, 0.5], [6, 0.3]] }"
        ),
    ),
    "formula": (
        "[[region.difference]]\nsphere = { radius = 9 }\n[[region.difference]]\nbox = { min = [0, 0, 0], max = [9, 9, 9] }\n",
        PLAIN.replace(
            "level.fraction = 0.3", 'level.iso.formula = "0.3 + 0.1*sin(x/5) + 0.05*clamp(z, -1, 2)^2 - min(0, y)/90"'
        ),
    ),
    "steps": (
        BOX,
        PLAIN.replace(
            "level.fraction = 0.3",
            'level.iso.formula = " 0.3 + 0.05*step(1, x) + 0.1*smoothstep(-2, 3, y) -'
            ' 0.05*mod(-z, 3)^3/27 + clamp(x, 2, -1)/99"',
        ),
    ),
    "combined": (
        "[region.offset]\nby = -0.5\n[[region.offset.of.intersection]]\nsphere = { center = [1, 0, 0], radius = 9 }\n"
        "[[region.offset.of.intersection]]\nhalfspace = { point = [0, 0, 3], normal = [0, 1, 1] }\n",
        PLAIN,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_function_is_the_field(tmp_path, name):
    made = solid(*CASES[name])
    found = made.save_implicit(tmp_path / "a.3mf")
    low, high = np.array(made.bounds)
    points = np.random.default_rng(3).uniform(low - 1, high + 1, (100_000 if name == "gyroid" else 20_000, 3))
    # Arguments of a few hundred radians lose some 1e-13; amplitudes are of the order of one.
    assert np.abs(evaluate(tmp_path / "a.3mf", points) - made.field(points)).max() < 1e-9
    assert found["bytes"] < 10_000
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(tmp_path / "a.3mf"))
    assert reader.GetWarningCount() == 0, reader.GetWarning(0)
    assert model.GetLevelSets().Count() == 1 and model.GetFunctions().Count() == 1


def test_a_mesh_region_is_a_node_of_its_mesh(tmp_path):
    text = f"schema = 1\n[region.mesh]\npath = 'octahedron.stl'\n[lattice.core]\n{PLAIN}"
    files = Path(__file__).parent.parent / "corpus" / "designs" / "files"
    made = parsed(text, False, "test", str(files)).build().save_implicit(tmp_path / "a.3mf")
    root = ET.fromstring(zipfile.ZipFile(tmp_path / "a.3mf").read("3D/3dmodel.model"))
    level, node = next(root.iter(f"{V}levelset")), next(root.iter(f"{I}mesh"))
    assert level.get("meshbboxonly") is None and node.find(f"{I}in/{I}resourceref").get("ref") == "region.value"
    assert made["triangles"] == 8 and next(root.iter(f"{I}constresourceid")).get("value") == level.get("meshid")


@pytest.mark.parametrize(
    ("region", "lattice", "expected"),
    [
        (BOX, PLAIN + "[skin]\nthickness = 1\n", "a skin"),
        (BOX, PLAIN.replace("fraction = 0.3", "thickness = 0.5"), "a thickness"),
        (BOX, PLAIN.replace("affine = { wavelength = 4 }", "cylinder = { wavelength = [4, 4], around = 12 }"), "map.cylinder"),
        (
            BOX,
            PLAIN.replace("0.3", "{ linear = { along = [0, 0, 1], stops = [[0, 0.2], [5, 0.3]] } }"),
            "fraction that varies",
        ),
        ("[region.capsule]\nstart = [0, 0, 0]\nend = [9, 0, 0]\nradius = 5\n", PLAIN, "region.capsule"),
        ("[region.moved]\nof.sphere.radius = 5\nby = [1, 0, 0]\n", PLAIN, "region.moved"),
        ("[region.repeated]\nof.sphere.radius = 5\nalong = [{ by = [8, 0, 0], count = 2 }]\n", PLAIN, "region.repeated"),
        (
            BOX,
            PLAIN.replace("fraction = 0.3", "iso.radial = { center = [0, 0, 0], stops = [[0, 0.3], [5, 0.5]] }"),
            "radial",
        ),
    ],
)
def test_what_it_cannot_hold_is_refused(tmp_path, region, lattice, expected):
    with pytest.raises(ValueError, match=f"an implicit 3MF cannot hold .*{expected}.*write a mesh"):
        solid(region, lattice).save_implicit(tmp_path / "a.3mf")
    assert not list(tmp_path.iterdir())
