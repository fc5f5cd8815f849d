"""Meshes of other packages: there and back the same, and what is no triangle mesh refused."""

import numpy as np
import pytest
import trabecula as lt
from trabecula import level, map, region


@pytest.fixture(scope="module")
def ball() -> lt.Mesh:
    lattice = lt.Lattice("gyroid", "sheet", map.affine(wavelength=4), level.fraction(0.3))
    return lt.Design(region.sphere(radius=4), lattice).build().mesh(edge=0.5)


@pytest.mark.parametrize("name", ["trimesh", "pyvista", "meshio"])
def test_a_mesh_goes_to_another_package_and_comes_back_the_same(ball: lt.Mesh, name: str):
    pytest.importorskip(name)
    theirs = getattr(ball, f"to_{name}")()
    back = lt.Mesh.of(theirs)
    assert np.array_equal(back.vertices, ball.vertices)
    assert np.array_equal(back.triangles, ball.triangles)
    assert back.volume == ball.volume


def test_trimesh_and_pyvista_measure_the_same_volume_and_know_the_cut_faces(ball: lt.Mesh):
    trimesh = pytest.importorskip("trimesh")
    theirs = ball.to_trimesh()
    assert isinstance(theirs, trimesh.Trimesh) and theirs.is_watertight
    assert theirs.volume == pytest.approx(ball.volume, rel=1e-12)
    assert np.array_equal(theirs.face_attributes["cut"], ball.cut) and ball.cut.any()
    assert ball.to_meshio().cell_data["cut"][0].sum() == ball.cut.sum()
    pytest.importorskip("pyvista")
    theirs = ball.to_pyvista()
    assert theirs.volume == pytest.approx(ball.volume, rel=1e-5)  # VTK sums in single precision
    assert np.array_equal(theirs.cell_data["cut"], ball.cut)


def test_arrays_given_away_may_be_changed(ball: lt.Mesh):
    trimesh = pytest.importorskip("trimesh")
    before = ball.vertices.copy()
    theirs = ball.to_trimesh()
    assert isinstance(theirs, trimesh.Trimesh)
    theirs.vertices[:] += 1.0
    assert np.array_equal(ball.vertices, before)


def test_larger_polygons_are_cut_into_triangles():
    meshio = pytest.importorskip("meshio")
    corners = np.array([[x, y, z] for z in (0, 2) for y in (0, 2) for x in (0, 2)], float)
    sides = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    made = lt.Mesh.of(meshio.Mesh(corners, [("quad", sides), ("line", np.array([[0, 1]]))]))
    assert made.counts == (8, 12) and made.closed and made.volume == 8.0
    pyvista = pytest.importorskip("pyvista")
    made = lt.Mesh.of(pyvista.PolyData(corners, np.insert(sides, 0, 4, axis=1).ravel()))
    assert made.counts == (8, 12) and made.closed and made.volume == 8.0


def test_what_is_no_triangle_mesh_is_refused():
    meshio = pytest.importorskip("meshio")
    with pytest.raises(TypeError, match=r"expected vertices and triangles, or a trimesh\.Trimesh.*found builtins\.dict"):
        lt.Mesh.of({"vertices": []})
    points = np.eye(4, 3)
    with pytest.raises(ValueError, match="expected triangles, quads or polygons, found elements of type tetra"):
        lt.Mesh.of(meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))]))
    pyvista = pytest.importorskip("pyvista")
    with pytest.raises(TypeError, match=r"found pyvista.*UnstructuredGrid"):
        lt.Mesh.of(pyvista.UnstructuredGrid({10: np.array([[0, 1, 2, 3]])}, points))


def test_a_missing_package_is_named(ball: lt.Mesh, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    with pytest.raises(ImportError, match="pyvista is not installed: pip install pyvista"):
        ball.to_pyvista()


def elements_of(kind: str):
    """A mesh of elements of each class."""
    if kind == "TetMesh":
        return lt.TetMesh.of({"region": region.box(size=[4, 4, 4]), "lattice": {"core": {"map": map.tets(size=2)}}})
    box = region.box(size=[6, 6, 6])
    if kind == "BeamMesh":
        beams = lt.Beams("bcc", map.affine(wavelength=3), radius=0.2)
        return lt.Design(box, beams=beams, set={"foot": region.box(size=[6, 6, 1], center=[0, 0, -3])}).build().beam_mesh()
    core = lt.Lattice("gyroid", "sheet", map.affine(wavelength=3), level.fraction(0.4))
    solid = lt.Design(box, core, skin=None if kind == "ShellMesh" else lt.skin(0.5)).build()
    made = {
        "VolumeMesh": lambda: solid.volume_mesh(edge=0.35, order=2, of="all"),
        "ShellMesh": lambda: solid.shell_mesh(edge=0.4, order=2),
        # meshio 5.3 confuses arrays of other sizes, such as steps of 0.5 mm make.
        "VoxelElements": lambda: solid.voxel_elements(step=0.6),
    }
    return made[kind]()


@pytest.mark.filterwarnings("ignore::trabecula.DesignWarning")
@pytest.mark.parametrize("kind", ["VolumeMesh", "ShellMesh", "VoxelElements", "BeamMesh", "TetMesh"])
def test_elements_go_to_other_packages_as_their_file_has_them(tmp_path, kind: str):
    """A .vtu has sets of elements only where these are not those of faces."""
    meshio = pytest.importorskip("meshio")
    mesh = elements_of(kind)
    assert type(mesh).__name__ == kind
    mesh.write(tmp_path / "a.vtu")
    file, made = meshio.read(tmp_path / "a.vtu"), mesh.to_meshio()
    assert np.array_equal(made.points, file.points)
    ((one, other),) = zip(made.cells, file.cells, strict=True)
    assert one.type == other.type and np.array_equal(one.data, other.data)
    assert set(made.cell_data) == set(file.cell_data) - set(made.cell_sets)
    assert set(made.point_data) == set(file.point_data) - set(made.point_sets)
    for name, (values,) in made.cell_data.items():
        assert np.array_equal(values, file.cell_data[name][0].reshape(values.shape))
    for name in set(made.cell_sets) & set(file.cell_data):
        assert np.array_equal(np.flatnonzero(file.cell_data[name][0]), made.cell_sets[name][0])
    for name, nodes in made.point_sets.items():
        assert np.array_equal(np.flatnonzero(file.point_data[name]), nodes)
    assert list(made.field_data) == (["WALL", "LOWER", "UPPER"] if kind == "VolumeMesh" else [])
    pyvista = pytest.importorskip("pyvista")
    theirs, back = mesh.to_pyvista(), pyvista.read(tmp_path / "a.vtu")
    assert np.array_equal(theirs.points, back.points) and np.array_equal(theirs.cells, back.cells)
    assert np.array_equal(theirs.celltypes, back.celltypes)
    for one, other in ((theirs.point_data, back.point_data), (theirs.cell_data, back.cell_data)):
        assert set(other) <= set(one) <= set(other) | set(made.cell_sets)
        assert all(np.array_equal(one[name], other[name]) for name in other)
