"""Volume meshes and voxels in solvers: sets of a design, loads, files read by other programs."""

import json
import math
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from finite_elements import area_of, faces_of, solid
from trabecula.io.file_sets import of_vtu
from trabecula.io.quadratic import curved
from trabecula.pictures.local_fields import FIELDS, fields_at


def slab(**more):
    """A flat bar, 10 × 2.5 × 2 mm along x: one slab of a lattice of slabs."""
    slabs = lt.Lattice(
        cell=lt.cell.series(terms=[lt.cell.term([0, 1, 0], 1.0)]),
        part="upper",
        map=lt.map.affine(wavelength=5),
        level=lt.level.iso(0),
    )
    region = lt.region.box(min=[0, -2.5, 0], max=[10, 2.5, 2])
    return lt.Design(region=region, lattice={"slabs": slabs}, **more).build()


def test_sets_of_a_design_are_the_surface_within_their_regions(tmp_path):
    # A face may end on the plane of the half-space, within a millionth of the part.
    sets = {
        "grip": lt.region.halfspace(point=[2, 0, 0], normal=[1, 0, 0]),
        "Top_2": lt.region.box(min=[4, -3, 1.99], max=[6, 3, 9]),
    }
    made = slab(set=sets)
    mesh = made.volume_mesh(edge=0.5)
    middles = mesh.nodes[faces_of(mesh, mesh.sets["grip"].faces)].mean(axis=1)
    near = 2 + 2e-5
    assert len(middles) and (middles[:, 0] < near).all()
    on = np.concatenate([mesh.sets[name].faces for name in ("CUT", "LATTICE")])
    all_middles = mesh.nodes[faces_of(mesh, on)].mean(axis=1)
    assert (all_middles[:, 0] < near).sum() == len(middles)
    top = mesh.sets["Top_2"]
    assert (mesh.nodes[top.nodes, 2] == 2).all() and set(top.elements) == set(top.faces[:, 0])
    assert mesh.report().sets["Top_2"].faces == len(top.faces)
    mesh.write(tmp_path / "part.inp")
    assert "*SURFACE, NAME=Top_2, TYPE=ELEMENT" in (tmp_path / "part.inp").read_text()


def test_an_empty_set_is_refused_by_name_where_it_is_of_the_solid():
    made = slab(set={"hole": lt.region.sphere(center=[5, 0, 1], radius=0.4)})
    with pytest.raises(ValueError, match=r"set\.hole.* is empty"):
        made.volume_mesh(edge=0.5)
    assert "hole" not in made.volume_mesh(edge=0.5, of="pore").sets


def test_a_bore_is_caught_by_its_own_cylinder():
    """Faces are chords of the bore, with nodes moved off it so that they balance: their middles are inside and outside."""
    bore = lt.region.cylinder(base=[0, 0, 0], radius=2, height=3)
    ring = lt.region.cylinder(base=[0, 0, 0], radius=3, height=3)
    plate = lt.region.difference(lt.region.box(min=[-5, -4, 0], max=[5, 4, 3]), lt.region.cylinder([0, 0, -1], 2, 5))
    core = lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.4))
    mesh = lt.Design(region=plate, lattice=core, keep={"ring": ring}, set={"bore": bore}).build().volume_mesh(edge=0.5)
    faces = mesh.sets["CUT"].faces
    corners = mesh.nodes[faces_of(mesh, faces)]
    near = np.hypot(corners[..., 0], corners[..., 1]).max(axis=1) < 2.2
    level = np.ptp(corners[..., 2], axis=1) < 1e-6
    assert set(map(tuple, mesh.sets["bore"].faces)) == set(map(tuple, faces[near & ~level]))


@pytest.mark.parametrize("order", [1, 2])
def test_forces_at_nodes_have_the_resultant_and_act_at_the_centroid(order):
    mesh = slab().volume_mesh(edge=0.5, order=order)
    nodes, forces = mesh.forces("X1", (3, -2, 0))
    assert set(nodes) <= set(mesh.sets["X1"].nodes)
    # Sums of some hundred shares.
    np.testing.assert_allclose(forces.sum(axis=0), [3, -2, 0], atol=1e-13)
    corners = mesh.nodes[faces_of(mesh, mesh.sets["X1"].faces)]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    centroid = (corners.mean(axis=1) * areas[:, None]).sum(axis=0) / areas.sum()
    np.testing.assert_allclose(forces[:, 0] @ mesh.nodes[nodes] / 3, centroid, atol=1e-12)


def test_a_pressure_all_round_is_in_equilibrium_with_a_uniform_stress():
    """−p ∮ Nᵢ n dA = −p ∫ ∇Nᵢ dV: what a stress of −p in all directions does to the nodes, whatever the mesh."""
    mesh = slab().volume_mesh(edge=0.5)
    pushed = np.zeros_like(mesh.nodes)
    for name in ("CUT", "LATTICE"):
        nodes, forces = mesh.forces(name, 2.5)
        pushed[nodes] += forces
    corners = mesh.nodes[mesh.elements]
    edges = corners[:, 1:] - corners[:, :1]
    slopes = np.linalg.inv(edges).transpose(0, 2, 1)
    slopes = np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1)
    stressed = np.zeros_like(mesh.nodes)
    np.add.at(stressed, mesh.elements, -2.5 * (np.linalg.det(edges) / 6)[:, None, None] * slopes)
    np.testing.assert_allclose(pushed, stressed, atol=1e-12)


def test_a_pressure_is_written_as_forces_at_nodes(tmp_path):
    mesh = slab().volume_mesh(edge=0.5)
    mesh.write(tmp_path / "a.inp", hold=["X0"], load={"X1": 3})
    text = (tmp_path / "a.inp").read_text()
    assert "** on X1: a pressure of 3.0 MPa\n" in text
    rows = text.split("*CLOAD\n")[1].split("*")[0].splitlines()
    along = [float(row.split(",")[2]) for row in rows if row.split(",")[1].strip() == "1"]
    corners = mesh.nodes[faces_of(mesh, mesh.sets["X1"].faces)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    # A number has nine digits in the file.
    assert sum(along) == pytest.approx(-3 * area, rel=1e-7)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"hold": ["X0"], "load": {"X1": 0}}, "a pressure is a finite number, not 0"),
        ({"hold": ["X0"], "load": {"X1": math.nan}}, "a pressure is a finite number, not 0"),
        ({"load": {"X1": (0, 0, 1)}}, "both hold and load"),
        ({"hold": ["X0"]}, "both hold and load"),
        ({"hold": ["X0"], "load": {"X1": (0, 0, 0)}}, "not all 0"),
        ({"hold": ["X0"], "load": {"X1": (0, 1)}}, "three finite numbers"),
        ({"hold": ["A"], "load": {"X1": (0, 0, 1)}}, "hold: the mesh has no set A"),
    ],
)
def test_loads_that_make_no_step_are_refused(given, words, tmp_path):
    mesh = slab().volume_mesh(edge=0.5)
    with pytest.raises(ValueError, match=words):
        mesh.write(tmp_path / "a.inp", **given)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["linear", "quadratic", "voxels"])
def test_calculix_solves_a_bar_under_tension(kind, tmp_path):
    """Without Poisson's ratio the stress of a clamped bar is the same everywhere, which all elements have exactly."""
    ccx = shutil.which("ccx")
    if ccx is None:
        pytest.skip("CalculiX is not installed")
    made = slab()
    order = 1 + (kind == "quadratic")
    mesh = made.voxel_elements(step=0.25) if kind == "voxels" else made.volume_mesh(edge=0.5, order=order)
    mesh.write(tmp_path / "bar.inp", E=1000, nu=0, hold=["X0"], load={"X1": (50, 0, 0)})
    done = subprocess.run([ccx, "bar"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout[-2000:]
    text = (tmp_path / "bar.dat").read_text()
    reaction = [float(v) for v in re.search(r"total force .*?\n\n(.*?)\n", text).group(1).split()]
    energy = float(re.search(r"total internal energy .*?\n\n(.*?)\n", text).group(1))
    area = 5 if kind == "voxels" else area_of(mesh, "X1")
    # The solver prints seven digits.
    np.testing.assert_allclose(reaction, [-50, 0, 0], atol=1e-4)
    assert energy == pytest.approx(50**2 * 10 / (2 * 1000 * area), rel=1e-6)


# --- voxels -----------------------------------------------------------------------------------------------------------


def test_voxels_have_their_exact_fraction_and_are_one_piece():
    made = solid()
    voxels = made.voxel_elements(step=0.25)
    figures = voxels.report()
    assert figures.step == [0.25] * 3 and voxels.elements.shape == (figures.elements, 8)
    # A voxel's fraction is right to second order: 16 voxels along a cell of curvature 1 / mm or less.
    assert voxels.volume + figures.dropped == pytest.approx(19.2, rel=1e-3) and figures.least >= 0.01
    a, b, d, e = (voxels.nodes[voxels.elements[:, k]] for k in (0, 1, 3, 4))
    np.testing.assert_allclose(np.einsum("ij,ij->i", np.cross(b - a, d - a), e - a), 0.25**3, rtol=1e-12)
    # Every face of the boundary is in one of the sets of the grid, and as many face up as down.
    faces = np.concatenate([voxels.sets[name].faces for name in ("X0", "X1", "Y0", "Y1", "Z0", "Z1", "SURFACE")])
    assert len(np.unique(faces, axis=0)) == len(faces)
    z0, z1, y0, x1, y1, x0 = np.bincount(faces[:, 1])
    assert (x0, y0, z0) == (x1, y1, z1)
    corners = np.sort(voxels.elements[:, [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]])
    _, counts = np.unique(corners.reshape(-1, 4), axis=0, return_counts=True)
    assert (counts == 1).sum() == len(faces) and set(counts) == {1, 2}
    small = made.voxel_elements(step=0.25, least=0.5)
    assert (small.fraction >= 0.5).all() and len(small.elements) < len(voxels.elements)
    alone = slab().voxel_elements(step=0.25)
    assert (alone.fraction == 1).all() and alone.volume == pytest.approx(50, rel=1e-12)


@pytest.mark.parametrize("suffix", ["inp", "vtu"])
def test_meshio_reads_voxels(suffix, tmp_path):
    meshio = pytest.importorskip("meshio")
    # With eight sets meshio takes one array of a VTU for another: it looks for offsets among those it has replaced.
    sets = {"corner": lt.region.sphere(radius=1.5)} if suffix == "inp" else None
    voxels = solid(set=sets).voxel_elements(step=0.5)
    voxels.write(tmp_path / f"v.{suffix}")
    read = meshio.read(tmp_path / f"v.{suffix}")
    cells = np.concatenate([c.data for c in read.cells if c.type == "hexahedron"])
    np.testing.assert_allclose(read.points, voxels.nodes, atol=0)
    assert {tuple(c) for c in cells.tolist()} == {tuple(c) for c in voxels.elements.tolist()}
    if suffix == "vtu":
        assert (read.cell_data["fraction"][0].ravel() == voxels.fraction).all()
    if suffix == "inp":
        assert set(read.point_sets["corner"]) == set(voxels.sets["corner"].nodes)


def test_gmsh_reads_voxels(tmp_path):
    gmsh = pytest.importorskip("gmsh")
    voxels = solid(set={"corner": lt.region.sphere(radius=1.5)}).voxel_elements(step=0.5)
    voxels.write(tmp_path / "v.msh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "v.msh"))
        tags, _ = gmsh.model.mesh.getElementsByType(5)
        assert len(tags) == len(voxels.elements) and min(gmsh.model.mesh.getElementQualities(tags, "minDetJac")) > 0
        _, of, values, *_ = gmsh.view.getModelData(gmsh.view.getTags()[0], 0)
        found = dict(zip(of, (v[0] for v in values), strict=True))
        assert [found[t] for t in tags] == voxels.fraction.tolist()
        names = {gmsh.model.getPhysicalName(*g) for g in gmsh.model.getPhysicalGroups()}
        assert names == {*voxels.sets, "SOLID"}
    finally:
        gmsh.finalize()


@pytest.mark.parametrize(
    "asked, words",
    [({"step": 1e-5}, "voxels"), ({"step": 0.5, "least": 0}, "greater than 0 and at most 1"), ({"step": -1}, "step is -1")],
)
def test_refused_voxels(asked, words):
    with pytest.raises(ValueError, match=words):
        solid().voxel_elements(**asked)


def test_fields_at_nodes_and_in_elements(tmp_path):
    meshio = pytest.importorskip("meshio")
    made = solid()
    for mesh in (made.volume_mesh(per_cell=12), made.voxel_elements(step=0.5)):
        depth = made.field(mesh.nodes)
        axes = np.arange(3.0 * len(mesh.elements)).reshape(-1, 3)
        mesh.write(tmp_path / "a.vtu", fields={"depth": depth, "axes": axes})
        read = meshio.read(tmp_path / "a.vtu")
        assert (read.point_data["depth"].ravel() == depth).all() and (read.cell_data["axes"][0] == axes).all()
        with pytest.raises(ValueError, match="row for each of"):
            mesh.write(tmp_path / "b.vtu", fields={"depth": depth[1:]})
        with pytest.raises(ValueError, match=r"not \.inp"):
            mesh.write(tmp_path / "b.inp", fields={"depth": depth})


def test_meshio_reads_xdmf(tmp_path):
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    made = solid()
    for mesh, kind in (
        (made.volume_mesh(per_cell=12, of="all"), "tetra"),
        (made.volume_mesh(per_cell=12, order=2), "tetra10"),
        (made.voxel_elements(step=0.5), "hexahedron"),
    ):
        depth = made.field(mesh.nodes)
        mesh.write(tmp_path / "a.xdmf", fields={"depth": depth})
        read = meshio.read(tmp_path / "a.xdmf")
        assert read.cells[0].type == kind and (read.cells[0].data == mesh.elements).all()
        assert (read.points == mesh.nodes).all() and (read.point_data["depth"] == depth).all()
        assert set(np.flatnonzero(read.point_data["X0"])) == set(mesh.sets["X0"].nodes)
        assert set(np.flatnonzero(read.cell_data["X0"][0])) == set(mesh.sets["X0"].elements)
        own = mesh.fraction if kind == "hexahedron" else mesh.domain
        assert (read.cell_data["fraction" if kind == "hexahedron" else "domain"][0] == own).all()


# --- files ------------------------------------------------------------------------------------------------------------


def test_an_input_file_has_sixteen_numbers_a_line_and_every_set(sheet, tmp_path):
    path = tmp_path / "rve.inp"
    sheet.write(path, E=2.0)
    lines = path.read_text().splitlines()
    assert max(len(line.split(",")) for line in lines if not line.startswith("*")) <= 16
    words = [line for line in lines if line.startswith("*")]
    for name in sheet.sets:
        for word in ("*NSET, NSET=", "*ELSET, ELSET="):
            assert word + name in words
        assert f"*SURFACE, NAME={name}, TYPE=ELEMENT" in words
    assert words.count("*STEP") == words.count("*END STEP") == 6 and words.count("*EQUATION") == 3 * len(sheet.pairs)
    assert "2.0, 0.3" in lines
    # No degree of freedom is dependent twice.
    first = [lines[i + 2].split(",")[:2] for i, line in enumerate(lines) if line == "*EQUATION"]
    assert len({tuple(f) for f in first}) == len(first)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("suffix", ["inp", "msh", "vtu", "bdf"])
def test_meshio_agrees_on_counts_and_sets(suffix, order, tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = solid().volume_mesh(per_cell=12, order=order)
    path = tmp_path / f"part.{suffix}"
    mesh.write(path)
    read = meshio.read(path)
    kind = "tetra" if order == 1 else "tetra10"
    cells = np.concatenate([c.data for c in read.cells if c.type == kind])
    assert len(read.points) == len(mesh.nodes) and cells.shape == mesh.elements.shape
    # Nastran's fields have sixteen characters.
    np.testing.assert_allclose(read.points, mesh.nodes, rtol=0, atol=1e-9 if suffix == "bdf" else 0)
    assert (cells == mesh.elements).all()
    if suffix == "inp":
        assert set(mesh.sets) <= set(read.point_sets) and set(read.point_sets["X0"]) == set(mesh.sets["X0"].nodes)
    if suffix == "msh":
        assert set(read.field_data) == {*mesh.sets, "SOLID"}


def read_foam(path):
    """The numbers of an OpenFOAM list, each item on a line."""
    text = path.read_text()
    body = text[text.index("(\n") + 2 : text.rindex(")")]
    rows = [re.findall(r"[-+.0-9e]+", line.split("(", 1)[-1]) for line in body.splitlines()]
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("of, periodic", [("pore", False), ("all", False), ("solid", True)])
def test_openfoam_has_closed_cells_and_faces_in_order(of, periodic, tmp_path):
    mesh = solid().volume_mesh(per_cell=12, of=of, periodic=periodic)
    mesh.write(tmp_path / "case.foam")
    folder = tmp_path / "constant" / "polyMesh"
    points, faces = read_foam(folder / "points"), read_foam(folder / "faces").astype(int)
    owner, neighbour = (read_foam(folder / name).astype(int).ravel() for name in ("owner", "neighbour"))
    np.testing.assert_allclose(points, mesh.nodes / 1000, rtol=1e-15)
    inner = len(neighbour)
    assert len(owner) == len(faces) and (owner[:inner] < neighbour).all()
    # Upper triangular order.
    assert (np.lexsort((neighbour, owner[:inner])) == np.arange(inner)).all()
    a, b, c = (points[faces[:, k]] for k in range(3))
    area, middle = np.cross(b - a, c - a) / 2, (a + b + c) / 3
    cells = len(mesh.elements)
    closed, volume, size = np.zeros((cells, 3)), np.zeros(cells), np.zeros(cells)
    for of_face, sign, some in ((owner, 1, slice(None)), (neighbour, -1, slice(inner))):
        np.add.at(closed, of_face, sign * area[some])
        np.add.at(volume, of_face, sign * np.einsum("ij,ij->i", area[some], middle[some]) / 3)
        np.add.at(size, of_face, np.linalg.norm(area[some], axis=1))
    # Rounding of products of coordinates of some mm.
    assert (np.linalg.norm(closed, axis=1) < 1e-10 * size).all() and (volume > 0).all()
    assert volume.sum() == pytest.approx(mesh.volume * 1e-9, rel=1e-12)
    entry = r"(\w+)\s*\{\s*type\s+(\w+);\s*nFaces\s+(\d+);\s*startFace\s+(\d+);"
    patches = {m[0]: (m[1], int(m[2]), int(m[3])) for m in re.findall(entry, (folder / "boundary").read_text())}
    assert sum(p[1] for p in patches.values()) == len(faces) - inner and "REST" not in patches
    for name in ("X0", "Y1") if of != "all" else ("LOWER_X0", "UPPER_Y1", "WALL_Z0"):
        kind, count, start = patches[name]
        assert count == len(mesh.sets[name].faces) and kind == ("cyclic" if periodic else "patch")
        if periodic:
            _, _, other = patches[name.translate(str.maketrans("01", "10"))]
            shift = (points[faces[other : other + count]] - points[faces[start : start + count]][:, [0, 2, 1]]) * 1000
            along = "XYZ".index(name[0])
            assert np.ptp(shift[:, :, along]) == 0 and (np.delete(shift, along, axis=2) == 0).all()
    if of == "pore":
        assert patches["LATTICE"][0] == "wall"
    zones = re.findall(r"(\w+)\s*\{\s*type cellZone", (folder / "cellZones").read_text())
    assert zones == mesh.domains


CONTROL = """FoamFile { version 2.0; format ascii; class dictionary; object %s; }
application checkMesh; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeInterval 1;
writeControl timeStep;
ddtSchemes {} gradSchemes {} divSchemes {} laplacianSchemes {} interpolationSchemes {} snGradSchemes {}
"""


@pytest.mark.parametrize("of, periodic", [("pore", False), ("all", False), ("pore", True)])
def test_openfoam_says_mesh_ok(of, periodic, tmp_path):
    checker = shutil.which("checkMesh")
    if checker is None:
        pytest.skip("OpenFOAM is not installed")
    (tmp_path / "system").mkdir()
    for name in ("controlDict", "fvSchemes", "fvSolution"):
        (tmp_path / "system" / name).write_text(CONTROL % name)
    solid().volume_mesh(per_cell=16, of=of, periodic=periodic).write(tmp_path / "case.foam")
    home = {"WM_PROJECT_DIR": "/usr/share/openfoam"} | os.environ  # where Debian has it
    done = subprocess.run([checker, "-allTopology"], cwd=tmp_path, env=home, capture_output=True, text=True, timeout=100)
    assert "Mesh OK." in done.stdout, done.stdout[-3000:]


@pytest.mark.parametrize("order, suffix", [(1, "msh"), (2, "msh"), (1, "msh2"), (2, "msh2"), (1, "mesh")])
def test_gmsh_reads_without_a_warning(order, suffix, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    mesh = solid().volume_mesh(per_cell=12, order=order)
    path = tmp_path / f"part.{suffix}"
    mesh.write(path)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.logger.start()
        earlier = len(gmsh.logger.get())
        gmsh.open(str(path))
        said = gmsh.logger.get()[earlier:]
        gmsh.logger.stop()
        assert not [line for line in said if line.startswith(("Warning", "Error"))]
        tags, _ = gmsh.model.mesh.getElementsByType(4 if order == 1 else 11)
        least = gmsh.model.mesh.getElementQualities(tags, "minDetJac")
        assert len(tags) == len(mesh.elements) and min(least) > 0
        points, weights = gmsh.model.mesh.getIntegrationPoints(4 if order == 1 else 11, "Gauss4")
        _, determinants, _ = gmsh.model.mesh.getJacobians(4 if order == 1 else 11, points)
        # Degree four integrates det J exactly; the weights have thirteen digits.
        assert np.sum(np.reshape(determinants, (-1, len(weights))) @ weights) == pytest.approx(mesh.volume, rel=1e-10)
        names = {gmsh.model.getPhysicalName(*g) for g in gmsh.model.getPhysicalGroups()}
        # Of version 2.2 each face has one group, so all of CUT is in X0 and others; Medit has no names.
        assert names == {"msh": {*mesh.sets, "SOLID"}, "msh2": {*mesh.sets, "SOLID"} - {"CUT"}, "mesh": set()}[suffix]
    finally:
        gmsh.finalize()


def test_a_patch_test_to_rounding(tmp_path):
    """Displacements that are linear on the boundary are linear inside: the mesh conforms."""
    skfem = pytest.importorskip("skfem")
    from skfem.models.poisson import laplace

    mesh = solid(region=lt.region.sphere(radius=2.2)).volume_mesh(edge=0.25)
    tets = skfem.MeshTet(np.ascontiguousarray(mesh.nodes.T), np.ascontiguousarray(mesh.elements.T.astype(np.int64)))
    basis = skfem.Basis(tets, skfem.ElementTetP1())
    exact = tets.p[0] - 2 * tets.p[1] + 0.5 * tets.p[2]
    fixed = tets.boundary_nodes()
    found = skfem.solve(
        *skfem.condense(laplace.assemble(basis), x=np.where(np.isin(np.arange(tets.nvertices), fixed), exact, 0), D=fixed)
    )
    # A direct solver loses the logarithm of the condition, about three digits.
    assert np.abs(found - exact).max() < 1e-11


def test_the_command(tmp_path):
    design, out = tmp_path / "part.toml", tmp_path / "part.msh"
    lt.Design(
        region=lt.region.box(size=[4, 4, 4]),
        lattice={
            "core": lt.Lattice(
                cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.3)
            )
        },
    ).save(design)

    def run(*words):
        return subprocess.run([sys.executable, "-m", "trabecula", "volume", *map(str, words)], capture_output=True, text=True)

    done = run(design, "-o", out, "--per-cell", 12, "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert {"elements", "nodes", "volume", "min_angle", "max_angle", "pairs", "sets"} <= set(figures)
    assert out.exists() and figures["sets"]["X0"]["faces"] > 0
    # The folder of a case may be new, not those above it.
    assert run(design, "-o", tmp_path / "case" / "part.foam", "--per-cell", 12).returncode == 0
    assert (tmp_path / "case" / "part.foam").exists() and (tmp_path / "case" / "constant" / "polyMesh" / "points").exists()
    deep = run(design, "-o", tmp_path / "no" / "case" / "part.foam", "--per-cell", 12)
    assert deep.returncode == 1 and "no does not exist" in deep.stderr and not (tmp_path / "no").exists()
    empty = run(design, "-o", tmp_path / "no.inp", "--per-cell", 12, "--sets", "X0,SKIN")
    assert empty.returncode == 1 and "SKIN is empty" in empty.stderr and not (tmp_path / "no.inp").exists()


def test_calculix_runs_a_periodic_cell_as_it_is(tmp_path):
    ccx = shutil.which("ccx")
    if ccx is None:
        pytest.skip("CalculiX is not installed")
    made = solid()
    made.volume_mesh(per_cell=14, periodic=True).write(tmp_path / "rve.inp")
    done = subprocess.run([ccx, "rve"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout[-2000:]
    text = (tmp_path / "rve.dat").read_text()
    forces = [
        [float(v) for v in m.group(1).split()] for m in re.finditer(r"total force .*?\n\n(.*?)\n", text)
    ]  # X1, Y1, Z1 of each step
    stress = np.array(forces).reshape(6, 3, 3) / 16
    voigt = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    C = np.array([[s[i, j] for i, j in voigt] for s in stress]) / 1e-3
    # The solver prints seven digits.
    np.testing.assert_allclose(C, C.T, atol=2e-6 * C.max())
    energies = [float(m.group(1)) for m in re.finditer(r"total internal energy .*?\n\n(.*?)\n", text)]
    np.testing.assert_allclose(energies, 0.5 * np.diag(C) * 1e-6 * 64, rtol=1e-5)
    # Displacements of finite elements are an upper bound of the energy; linear ones at this size are 6 % off.
    limit = np.diag(made.stiffness(n=32).C)
    assert (np.diag(C) > limit).all() and (np.diag(C) < 1.12 * limit).all()


def measured(path):
    """What `measure` gives of a file."""
    words = [sys.executable, "-m", "trabecula", "measure", str(path), "--json"]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


def test_a_file_of_tetrahedra_is_measured(tmp_path):
    pytest.importorskip("meshio")
    mesh = solid().volume_mesh(per_cell=12)
    mesh.write(tmp_path / "part.inp")
    words = [sys.executable, "-m", "trabecula", "measure", str(tmp_path / "part.inp"), "--json"]
    figures = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    report = mesh.report()
    assert figures["elements"] == report.elements and figures["volume"] == pytest.approx(report.volume, rel=1e-12)
    assert figures["min_angle"] == pytest.approx(report.min_angle, abs=1e-6)
    assert {name: of["elements"] for name, of in figures["sets"].items()} == {
        "SOLID": report.elements,
        **{name: of.elements for name, of in report.sets.items()},
    }


@pytest.mark.parametrize("kind", ["inp", "msh", "msh2", "vtu", "xdmf", "bdf", "mesh"])
def test_sets_are_measured_as_far_as_a_format_has_them(tmp_path, kind):
    pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    bolt = {"bolt": {"cylinder": {"base": [0, 0, -2], "radius": 0.5, "height": 4}}}
    mesh = solid(set={"Top_2": lt.region.halfspace(point=[0, 0, 1], normal=[0, 0, -1])}, keep=bolt).volume_mesh(
        per_cell=12, of="all"
    )
    mesh.write(tmp_path / f"part.{kind}")
    found = measured(tmp_path / f"part.{kind}")["sets"]
    of = {name: {what: len(getattr(one, what)) for what in one._fields} for name, one in mesh.sets.items()}
    has = {"inp": ["nodes", "elements", "faces"], "xdmf": ["nodes", "elements"], "vtu": ["nodes"], "bdf": ["nodes"]}
    domains = {name: {"elements": int((mesh.domain == number).sum())} for number, name in enumerate(mesh.domains)}
    assert {name: found.pop(name) for name in mesh.domains} == domains
    # A keep zone is a part of the solid, so that its elements are a group of volumes of Gmsh and an array of a VTU.
    bulk = {"msh": ["faces", "elements"], "vtu": ["nodes", "elements"]}
    wanted = {name: (bulk if name == "KEEP_bolt" else has).get(kind, has.get(kind, ["faces"])) for name in of}
    expected = {name: {what: counts[what] for what in wanted[name] if counts[what]} for name, counts in of.items()}
    if kind in ("msh2", "mesh"):  # there a face is in the smallest of its sets
        assert found["LOWER_X0"] == expected["LOWER_X0"] and set(found) <= set(expected)
        every = np.concatenate([one.faces for one in mesh.sets.values()])
        assert sum(one["faces"] for one in found.values()) == len(np.unique(every, axis=0))
    else:
        assert found == expected


def test_sets_of_other_programs_are_measured(tmp_path):
    """Binary files of Gmsh, where one name may be of a surface and of a volume; nothing is said of what is not understood."""
    gmsh = pytest.importorskip("gmsh")
    pytest.importorskip("meshio")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [1, 2], name="ends")
        gmsh.model.addPhysicalGroup(2, [2], name="one")
        gmsh.model.addPhysicalGroup(3, [1], name="ends")
        gmsh.model.mesh.generate(3)
        (_, tets) = gmsh.model.mesh.getElementsByType(4)
        faces = [len(gmsh.model.mesh.getElements(2, side)[1][0]) for side in (1, 2)]
        for version in (2.2, 4.1):
            for binary in (0, 1):
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.option.setNumber("Mesh.Binary", binary)
                path = tmp_path / f"v{version}-{binary}.msh"
                gmsh.write(str(path))
                found = measured(path)["sets"]
                assert found["ends"] == {"faces": sum(faces), "elements": len(tets) // 4}, (version, binary, found)
                assert found["one"] == {"faces": faces[1]}
    finally:
        gmsh.finalize()
    (tmp_path / "damaged.vtu").write_bytes(b'<VTKFile header_type="UInt64"><AppendedData encoding="raw">_')
    assert of_vtu(str(tmp_path / "damaged.vtu")) == {}


@pytest.mark.parametrize("kind", ["inp", "msh", "msh2", "vtu", "xdmf", "bdf"])
def test_quadratic_tetrahedra_are_measured_as_they_are(tmp_path, kind):
    pytest.importorskip("meshio")
    mesh = solid().volume_mesh(per_cell=12, order=2)
    mesh.write(tmp_path / f"part.{kind}")
    report, figures = mesh.report(), measured(tmp_path / f"part.{kind}")
    assert (figures["order"], figures["elements"], figures["nodes"]) == (2, report.elements, report.nodes)
    assert figures["volume"] == pytest.approx(report.volume, rel=1e-9 if kind != "bdf" else 1e-6)


def test_the_volume_of_a_curved_tetrahedron_is_exact():
    """That of x → x + bump, whose Jacobian is known in full."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    edges = [0.5 * (corners[a] + corners[b]) for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    x, y, z = np.vstack([corners, edges]).T
    # (x + y²/2 + z²/3, y + z²/2, z + 1.5 x²): a determinant 1 - 3 x (2 z / 3 - y z).
    nodes = np.stack([x + y * y / 2 + z * z / 3, y + z * z / 2, z + 1.5 * x * x], axis=-1)
    # Integrals over the tetrahedron: 1/6, x z 1/120, x y z 1/720.
    assert curved(nodes[None])[0] == pytest.approx(1 / 6 - 2 / 120 + 3 / 720, rel=1e-13)


def test_a_file_in_two_components_is_not_taken_for_a_lattice(tmp_path):
    mesh = lt.TetMesh.read(two_tetrahedra(tmp_path / "two.vtu"), split=True)
    assert mesh.report().quality.pieces == 2
    words = [sys.executable, "-m", "trabecula", "measure", str(tmp_path / "two.vtu")]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stderr
    assert said == "warning: the tetrahedra are 2 pieces that share no faces\n"


def two_tetrahedra(path):
    """A file of two tetrahedra that do not touch."""
    points = "0 0 0 1 0 0 0 1 0 0 0 1 5 0 0 6 0 0 5 1 0 5 0 1"
    arrays = f'<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray></Points><Cells>'
    for name, numbers in (("connectivity", "0 1 2 3 4 5 6 7"), ("offsets", "4 8"), ("types", "10 10")):
        arrays += f'<DataArray type="Int64" Name="{name}" format="ascii">{numbers}</DataArray>'
    head = '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>'
    piece = f'<Piece NumberOfPoints="8" NumberOfCells="2">{arrays}</Cells></Piece>'
    path.write_text(f"{head}{piece}</UnstructuredGrid></VTKFile>")
    return path


def test_a_periodic_mesh_with_reference_nodes_is_measured(tmp_path):
    pytest.importorskip("meshio")
    mesh = solid().volume_mesh(per_cell=14, periodic=True)
    mesh.write(tmp_path / "rve.inp")
    assert (tmp_path / "rve.inp").read_text().count("*NODE, ") == 2
    report, figures = mesh.report(), measured(tmp_path / "rve.inp")
    assert (figures["elements"], figures["nodes"]) == (report.elements, report.nodes)
    assert figures["volume"] == pytest.approx(report.volume, rel=1e-12)
    assert {"SOLID", "X0", "LATTICE"} <= set(figures["sets"])


@pytest.mark.parametrize("order, suffix", [(1, "msh"), (2, "msh"), (1, "msh2")])
def test_gmsh_is_told_which_surfaces_are_periodic(order, suffix, tmp_path):
    meshio = pytest.importorskip("meshio")
    # A set on X1 alone parts that plane in two, each with its images on X0.
    part = {"part": lt.region.box(min=[1.5, -3, 0], max=[3, 3, 3])}
    mesh = solid(set=part).volume_mesh(per_cell=14, periodic=True, order=order)
    mesh.write(tmp_path / f"rve.{suffix}")
    assert "part" in measured(tmp_path / f"rve.{suffix}")["sets"]
    links = meshio.gmsh.read(tmp_path / f"rve.{suffix}").gmsh_periodic
    along, period = np.zeros((3, len(mesh.nodes)), dtype=bool), np.ptp(mesh.nodes, axis=0)
    for dimension, (own, master), transform, nodes in links:
        shift = np.reshape([float(v) for v in transform if np.ndim(v) == 0][-16:], (4, 4))[:3, 3]
        (axis,) = np.flatnonzero(shift)
        a, b = mesh.nodes[nodes[:, 0]], mesh.nodes[nodes[:, 1]]
        assert dimension == 2 and own != master
        assert (np.delete(a, axis, 1) == np.delete(b, axis, 1)).all()
        assert (a[:, axis] - b[:, axis] == period[axis]).all() and shift[axis] == period[axis]
        along[axis, nodes[:, 0]] = True
    for axis, name in enumerate(("X1", "Y1", "Z1")):
        assert (np.flatnonzero(along[axis]) == mesh.sets[name].nodes).all()
    # Of version 2.2 each face is in its smallest set alone, which here is a plane.
    assert len(links) == 3 if suffix == "msh2" else len(links) > 3


def test_nodes_in_several_blocks_are_read_and_parts_are_not_mixed_up(tmp_path):
    pytest.importorskip("meshio")
    first = "*NODE\n1, 0, 0, 0\n2, 3, 0, 0\n*NODE, NSET=MORE\n3, 0, 3, 0\n4, 0, 0, 3\n"
    tet = "*ELEMENT, TYPE=C3D4, ELSET=ALL\n1, 1, 2, 3, 4\n"
    (tmp_path / "a.inp").write_text(first + tet + "*NODE, NSET=REF\n1, 9, 9, 9\n")
    figures = measured(tmp_path / "a.inp")
    assert figures["nodes"] == 4 and figures["volume"] == pytest.approx(4.5, rel=1e-12)
    (tmp_path / "b.inp").write_text("*PART, NAME=A\n" + first + tet + "*END PART\n*PART, NAME=B\n" + first + tet)
    with pytest.raises(ValueError, match="its parts have nodes of the same numbers"):
        lt.TetMesh.read(tmp_path / "b.inp")


def test_fields_say_what_the_design_does_at_nodes(tmp_path):
    """A cell twice as long along y, turned by 30 degrees about z, of a fraction that rises with z."""
    design = tmp_path / "part.toml"
    design.write_text(
        'schema = 1\nunits = "mm"\nregion.box.size = [8, 8, 8]\n[lattice.core]\ncell = "gyroid"\npart = "sheet"\n'
        "map.affine = { wavelength = [4, 8, 4], rotate = [0, 0, 30] }\n"
        "level.fraction.linear = { along = [0, 0, 1], stops = [[-4, 0.2], [4, 0.4]] }\n"
    )
    out = tmp_path / "part.vtu"
    in_process("volume", design, "-o", out, "--per-cell", "16", "--fields", "fraction,share,orientation,wavelength")
    names = re.findall(rb'Name="(\w+)"', out.read_bytes())
    assert {b"solid_fraction", b"share_core", b"axis_1", b"axis_2", b"axis_3", b"wavelength"} <= set(names)
    points = np.random.default_rng(1).uniform(-4, 4, (100, 3))
    data, z = fields_at(lt.load(design).build(), FIELDS, points), points[:, 2]
    np.testing.assert_allclose(data["solid_fraction"], 0.3 + z / 40, rtol=1e-12)
    assert (data["share_core"] == 1).all()
    np.testing.assert_allclose(data["wavelength"], np.broadcast_to([4, 8, 4], (len(z), 3)), rtol=1e-12)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    for name, axis in {"axis_1": [c, s, 0], "axis_2": [-s, c, 0], "axis_3": [0, 0, 1]}.items():
        np.testing.assert_allclose(data[name], np.broadcast_to(axis, (len(z), 3)), atol=1e-12)
    in_process("volume", design, "-o", tmp_path / "c.vtu", "--per-cell", "16", "--fields", "colour", status=1)
    in_process("volume", design, "-o", tmp_path / "c.inp", "--per-cell", "16", "--fields", "fraction", status=2)
    assert not (tmp_path / "c.inp").exists() and not (tmp_path / "c.vtu").exists()


def test_fields_of_a_blend_follow_its_shares():
    core = {
        name: lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=w), level=lt.level.fraction(f))
        for name, w, f in (("a", 4, 0.2), ("b", 6, 0.4))
    }
    blend = lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {-6: 0, 6: 1}))
    made = lt.Design(region=lt.region.box(size=[16, 4, 4]), lattice=core, blend=blend).build()
    points = np.array([[-7.0, 0, 0], [-1, 0, 0], [1, 0, 0], [7, 0, 0]])
    share = made.shares(points)["b"]
    found = fields_at(made, ["fraction", "wavelength"], points)
    np.testing.assert_allclose(found["solid_fraction"], 0.2 + 0.2 * share, rtol=1e-12)
    np.testing.assert_allclose(found["wavelength"][:, 0], [4, 4, 6, 6], rtol=1e-12)
