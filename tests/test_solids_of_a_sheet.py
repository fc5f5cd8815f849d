"""The wall of a sheet and the spaces adjacent to it, through both doors, and their files as others read them."""

import json
from pathlib import Path

import lib3mf
import numpy as np
import pytest
import trabecula as lt
from judges import status, volume
from test_cli import run

EXCHANGER = Path(__file__).parent.parent / "examples" / "heat_exchanger.toml"
BLOCK = """\
schema = 1
units = "mm"
[region.box]
size = [8, 6, 6]
[lattice.a]
cell = "gyroid"
part = "sheet"
map.affine.wavelength = 4
level.fraction = { linear = { along = [1, 0, 0], stops = [[-4, 0.2], [4, 0.4]] } }
"""


@pytest.fixture
def block(tmp_path):
    """A graded sheet in a box, as a file."""
    (tmp_path / "block.toml").write_text(BLOCK)
    return tmp_path / "block.toml"


def words(design, output, parts):
    """A command that meshes parts."""
    return ["mesh", design, "-o", output, "--edge", "0.4", "--parts", parts, "--json"]


def common(a, b):
    """The number of triangles of a that b has as well, turned round, with the same coordinates."""
    corners = (m.vertices[m.triangles] for m in (a, b))
    first, second = ({tuple(sorted(map(tuple, t))) for t in c.tolist()} for c in corners)
    return len(first & second)


def test_a_graded_block(block):
    """Three closed solids that add up to the box, with all of their lattice's triangles in common with the wall."""
    parts = lt.load(block).build().parts(edge=0.2)
    assert list(parts) == ["wall", "lower", "upper"]
    for mesh in parts.values():
        assert mesh.closed and str(status(mesh.vertices, mesh.triangles)) == "Error.NoError"
    # Sums of some ten thousand terms.
    assert sum(m.volume for m in parts.values()) == pytest.approx(8 * 6 * 6, rel=1e-9)
    wall, lower, upper = parts.values()
    assert common(lower, upper) == 0
    assert common(wall, lower) > 1000 < common(wall, upper)
    for mesh, sign in (lower, -1), (upper, 1):
        center = mesh.vertices[mesh.triangles].mean(axis=1)
        u = 2 * np.pi * center / 4
        f = sum(np.sin(u[:, k]) * np.cos(u[:, (k + 1) % 3]) for k in range(3))
        assert (sign * f > 0).all()


def test_one_object_of_a_3mf_is_read_by_its_name(block, tmp_path):
    out = tmp_path / "all.3mf"
    solid = lt.load(block).build()
    parts = solid.parts(edge=0.4)
    lt.write_parts(out, parts)
    for name, part in parts.items():
        again = lt.Mesh.read(out, solid=name)
        assert again.closed and again.counts == part.counts and again.volume == pytest.approx(part.volume, rel=1e-5)
    with pytest.raises(ValueError, match='no object is named "walls"; there are wall, lower, upper'):
        lt.Mesh.read(out, solid="walls")
    assert "3 objects ('wall', 'lower', 'upper'), measured as one mesh" in run("measure", out, cwd=tmp_path).stderr
    assert "closed" in run("measure", out, "--solid", "wall", cwd=tmp_path).stdout
    solid.layers(0.5).save(tmp_path / "slices.3mf")
    with pytest.raises(ValueError, match="the file holds slices"):
        lt.Mesh.read(tmp_path / "slices.3mf")


def test_one_3mf_holds_all(block, tmp_path):
    """An object each, named, in the build, each of them a valid solid; lib3mf reads them without a warning."""
    made = json.loads(run(*words(block, "a.3mf", "wall,lower,upper"), cwd=tmp_path).stdout)
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(tmp_path / "a.3mf"))
    assert reader.GetWarningCount() == 0
    found, built = {}, 0
    items = model.GetBuildItems()
    while items.MoveNext():
        built += 1
    objects = model.GetMeshObjects()
    while objects.MoveNext():
        it = objects.GetCurrentMeshObject()
        assert it.IsManifoldAndOriented()
        points = np.array([list(v.Coordinates) for v in it.GetVertices()])
        corners = np.array([list(t.Indices) for t in it.GetTriangleIndices()])
        found[it.GetName()] = volume(points, corners)
    assert built == 3 and list(found) == ["wall", "lower", "upper"]
    for name, it in made["parts"].items():
        # The file has single precision: 24 bits of a coordinate of 4 mm.
        assert found[name] == pytest.approx(it["volume"], rel=1e-5)
        assert it["pieces"] >= 1 and it["file"].endswith("a.3mf")
    assert sum(it["solid_fraction"] for it in made["parts"].values()) == pytest.approx(1, rel=1e-9)
    assert lt.Mesh.read(tmp_path / "a.3mf").volume == pytest.approx(288, rel=1e-5)


def test_other_formats_have_a_file_each(block, tmp_path):
    """Some of the parts, in the order asked for, are the same solids."""
    made = json.loads(run(*words(block, "a.stl", "upper,lower"), cwd=tmp_path).stdout)
    assert list(made["parts"]) == ["upper", "lower"]
    assert sorted(p.name for p in tmp_path.glob("*.stl")) == ["a-lower.stl", "a-upper.stl"]
    parts = lt.load(block).build().parts(edge=0.4, names=["lower"])
    assert lt.Mesh.read(tmp_path / "a-lower.stl").volume == pytest.approx(parts["lower"].volume, rel=1e-5)
    files = lt.write_parts(tmp_path / "b.ply", parts)
    assert files == {"lower": str(tmp_path / "b-lower.ply")}


@pytest.mark.filterwarnings("ignore::trabecula.DesignWarning")
def test_closed_voids_of_the_wall_are_warned_of(block, tmp_path):
    """As they are where the wall alone is meshed."""
    block.write_text(BLOCK + "[skin]\nthickness = 0.8\n")
    said = run(*words("block.toml", "out.stl", "upper,wall"), cwd=tmp_path)
    wall = json.loads(said.stdout)["parts"]["wall"]
    assert wall["cavities"] > 0 and "warning: wall: " in said.stderr and "powder or resin cannot drain" in said.stderr
    assert any("cannot drain" in it["message"] if isinstance(it, dict) else it for it in json.loads(said.stdout)["warnings"])


def test_the_heat_exchanger_does_not_leak():
    """Each fluid is one piece that reaches the outside at its own two ports, and wall alone is between them."""
    parts = lt.load(EXCHANGER).build().parts(edge=0.8)
    wall, lower, upper = parts.values()
    assert common(lower, upper) == 0
    for mesh, axis in (lower, 0), (upper, 2):
        assert mesh.closed and mesh.pieces == 1
        outside = {tuple(sorted(map(tuple, t))) for t in mesh.vertices[mesh.triangles].tolist()}
        outside -= {tuple(sorted(map(tuple, t))) for t in wall.vertices[wall.triangles].tolist()}
        # Cuts keep a ten-millionth of a grid step away from nodes.
        ends = {round(corner[axis], 6) for triangle in outside for corner in triangle}
        assert ends == {-30.0, 30.0}
    assert wall.closed and wall.pieces == 1
