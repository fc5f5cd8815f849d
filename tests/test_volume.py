"""Volume meshes: angles, volume, conformity, sets, domains, periodic pairs, files read by other programs."""

import json
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
import trabecula as lt

CORNERS = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]


def solid(cell="gyroid", part="sheet", fraction=0.3, region=None, **more):
    core = lt.Lattice(
        cell=getattr(lt.cell, cell)(), part=part, map=lt.map.affine(wavelength=4), level=lt.level.fraction(fraction)
    )
    region = lt.region.box(min=[0, 0, 0], max=[4, 4, 4]) if region is None else region
    return lt.Design(region=region, lattice={"core": core}, **more).build()


def volumes(nodes, tets):
    a, b, c, d = (nodes[tets[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def faces_of(mesh, faces):
    tets = mesh.elements[:, :4]
    return tets[faces[:, 0][:, None], np.array(CORNERS)[faces[:, 1]]]


@pytest.fixture(scope="module")
def sheet():
    return solid().volume_mesh(per_cell=16, periodic=True)


@pytest.mark.parametrize(
    "cell, part, fraction",
    [("gyroid", "sheet", 0.1), ("diamond", "sheet", 0.3), ("primitive", "lower", 0.3), ("iwp", "sheet", 0.6)],
)
def test_named_cells_have_angles_of_fifteen_to_150_degrees_and_their_volume(cell, part, fraction):
    figures = solid(cell, part, fraction).volume_mesh(per_cell=32, periodic=True).report()
    assert figures.min_angle >= 15 and figures.max_angle <= 150
    # At 32 edges a cell the chords' error, balanced, is below a tenth of this.
    assert abs(figures.volume / (64 * fraction) - 1) < 1e-4


def test_elements_are_positive_and_faces_are_shared_by_two_or_on_the_boundary(sheet):
    tets = sheet.elements
    assert (volumes(sheet.nodes, tets) > 0).all()
    faces = np.sort(np.concatenate([tets[:, f] for f in CORNERS]), axis=1)
    _, counts = np.unique(faces, axis=0, return_counts=True)
    on = np.concatenate([sheet.sets[name].faces for name in ("CUT", "LATTICE")])
    assert set(counts) == {1, 2} and (counts == 1).sum() == len(on)
    closed = sheet.boundary()
    assert closed.closed and abs(closed.volume - sheet.volume) < 1e-9


@pytest.mark.parametrize(
    "cell, part, fraction, radius, edges",
    [
        ("diamond", "upper", 0.2757973616695506, 3.6772081179549656, 10),
        ("iwp", "upper", 0.39225185201957147, 2.824133242340237, 10),
    ],
)
def test_boundaries_of_coarse_meshes_are_manifold(cell, part, fraction, radius, edges):
    """A collapse would join two edges of the boundary without a common face: found among random designs."""
    made = coarse(cell, part, fraction, radius).volume_mesh(per_cell=edges)
    assert made.boundary().defects == []


def test_surfaces_that_cross_are_warned_of():
    with pytest.warns(lt.DesignWarning, match="8 pairs of boundary triangles cross"):
        coarse("gyroid", "lower", 0.31719099926265243, 3.2541060728788698).volume_mesh(per_cell=10)


def coarse(cell, part, fraction, radius):
    """A ball whose lattice is turned and grows denser."""
    dense = lt.grade.linear(along=[0, 0, 1], stops=[[-3, fraction], [3, min(0.7, 1.8 * fraction)]])
    turned = lt.map.affine(wavelength=4, rotate=[10, 20, 30])
    lattice = lt.Lattice(cell, part, turned, lt.level.fraction(dense))
    return lt.Design(region=lt.region.sphere(radius=radius), lattice={"core": lattice}).build()


def test_the_boundary_is_as_far_from_the_surface_as_reported():
    made = solid()
    mesh = made.volume_mesh(per_cell=24)
    at = mesh.nodes[faces_of(mesh, mesh.sets["LATTICE"].faces)].mean(axis=1)
    step = 1e-5
    slope = [(made.field(at + step * e) - made.field(at - step * e)) / (2 * step) for e in np.eye(3)]
    distance = np.abs(made.field(at)) / np.linalg.norm(slope, axis=0)
    # The core's distance has exact gradients, this one central differences.
    assert distance.max() <= mesh.report().deviation * 1.001 and mesh.report().deviation < 0.05 * 4 / 24


def test_planes_are_exact_and_their_sets_are_whole(sheet):
    for axis, name in enumerate("XYZ"):
        for side, at in (("0", 0.0), ("1", 4.0)):
            members = sheet.sets[name + side]
            assert (sheet.nodes[members.nodes, axis] == at).all()
            assert set(np.unique(faces_of(sheet, members.faces))) == set(members.nodes)
            assert set(members.elements) == set(members.faces[:, 0])
    area = {n: _area(sheet, n) for n in ("X0", "X1")}
    assert area["X0"] == pytest.approx(area["X1"], rel=1e-12) and area["X0"] > 1


def _area(mesh, name):
    p = mesh.nodes[faces_of(mesh, mesh.sets[name].faces)]
    return np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2


def test_periodic_pairs_agree_in_every_bit(sheet):
    node, image, along = sheet.pairs[:, 0], sheet.pairs[:, 1], sheet.pairs[:, 2:].astype(bool)
    assert len(set(node)) == len(node) and not set(node) & set(image)
    here, there = sheet.nodes[node], sheet.nodes[image]
    assert (here[~along] == there[~along]).all()
    assert (here[along] == 4).all() and (there[along] == 0).all()
    upper = np.unique(np.concatenate([sheet.sets[n].nodes for n in ("X1", "Y1", "Z1")]))
    assert set(upper) == set(node)
    to = dict(zip(node.tolist(), image.tolist(), strict=True))
    for axis in "XYZ":
        low, high = (faces_of(sheet, sheet.sets[axis + side].faces) for side in "01")

        def named(faces):
            return {tuple(sorted(to.get(n, n) for n in f)) for f in faces.tolist()}

        assert named(low) == named(high)


def test_quadratic_elements_follow_the_surface():
    figures = {order: solid().volume_mesh(per_cell=16, order=order).report() for order in (1, 2)}
    assert figures[2].deviation < figures[1].deviation / 10
    mesh = solid().volume_mesh(per_cell=16, order=2, periodic=True)
    assert mesh.elements.shape[1] == 10 and mesh.report().straight < 0.01 * mesh.report().elements
    # Nodes of faces have the true surface: the volume converges as the fourth power of the edge.
    assert abs(mesh.volume / 19.2 - 1) < 1e-4
    assert set(mesh.pairs[:, 0]) == set(np.concatenate([mesh.sets[n].nodes for n in ("X1", "Y1", "Z1")]))


def test_wall_and_both_fluids_fill_the_region_with_common_nodes():
    mesh = solid().volume_mesh(per_cell=16, of="all")
    assert mesh.domains == ["WALL", "LOWER", "UPPER"] and abs(mesh.volume - 64) < 1e-9
    figures = mesh.report()
    assert figures.domains["LOWER"].volume == pytest.approx(figures.domains["UPPER"].volume, rel=1e-3)
    made = solid()
    for name, sign in (("WALL", -1), ("LOWER", 1), ("UPPER", 1)):
        assert np.sign(made.field([figures.domains[name].inside])[0]) == sign
    tets = mesh.elements
    faces = np.sort(np.concatenate([tets[:, f] for f in CORNERS]), axis=1)
    domain = np.tile(mesh.domain, 4)
    _, place = np.unique(faces, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    same = place.ravel()[order][1:] == place.ravel()[order][:-1]
    pairs = np.stack([domain[order][:-1][same], domain[order][1:][same]], axis=1)
    # A sheet lies between the two fluids: they never touch.
    assert not ({(1, 2), (2, 1)} & {tuple(p) for p in np.unique(pairs, axis=0).tolist()})
    assert (pairs[:, 0] != pairs[:, 1]).sum() == len(mesh.sets["LATTICE"].faces)


@pytest.mark.parametrize("of", ["pore", "lower", "upper"])
def test_one_side_alone(of):
    mesh = solid().volume_mesh(per_cell=16, of=of)
    share = 0.7 if of == "pore" else 0.35
    assert mesh.volume == pytest.approx(64 * share, rel=1e-3)


def test_curved_regions_skins_and_keep_zones():
    keep = {"boss": lt.region.cylinder(base=[0, 0, -2], axis=[0, 0, 1], radius=1, height=4)}
    made = solid(region=lt.region.cylinder(base=[0, 0, -2], radius=3, height=4), skin=lt.skin(0.5), keep=keep)
    mesh = made.volume_mesh(edge=0.25)
    figures = mesh.report()
    assert figures.min_angle >= 12 and figures.max_angle <= 160 and mesh.boundary().closed
    expected = made.mesh(edge=0.1).volume
    assert mesh.volume == pytest.approx(expected, rel=1e-3)
    boss = mesh.sets["KEEP_boss"]
    middle = mesh.nodes[mesh.elements[boss.elements]].mean(axis=1)
    assert np.hypot(middle[:, 0], middle[:, 1]).max() < 1 and {"SKIN", "Z0", "Z1", "CUT", "LATTICE"} <= set(mesh.sets)


def test_the_same_bytes_for_any_number_of_threads():
    one, two = (solid(region=lt.region.sphere(radius=2.5)).volume_mesh(edge=0.25, threads=n) for n in (1, 3))
    assert one.nodes.tobytes() == two.nodes.tobytes() and one.elements.tobytes() == two.elements.tobytes()


@pytest.mark.parametrize(
    "asked, words",
    [
        ({"edge": 1.0}, "less than one tetrahedron through the thinnest wall"),
        ({"edge": 0.1, "wall": 2}, "give one of edge, per_cell and wall"),
        ({"edge": 1e-4}, "tetrahedra"),
        ({"order": 3}, "order is 3"),
        ({"of": "shell"}, 'of is "shell"'),
    ],
)
def test_refused_requests(asked, words):
    with pytest.raises(ValueError, match=words):
        solid().volume_mesh(**asked)


def test_periodic_is_refused_where_the_solid_is_not():
    with pytest.raises(ValueError, match="differs between X0 and X1"):
        solid(region=lt.region.box(min=[0, 0, 0], max=[3, 4, 4])).volume_mesh(per_cell=16, periodic=True)
    with pytest.raises(ValueError, match="a box"):
        solid(region=lt.region.sphere(radius=3)).volume_mesh(per_cell=16, periodic=True)
    with pytest.raises(ValueError, match="only sheets"):
        solid("primitive", "lower").volume_mesh(per_cell=16, of="upper")


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


@pytest.mark.parametrize("order", [1, 2])
def test_gmsh_reads_without_a_warning(order, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    mesh = solid().volume_mesh(per_cell=12, order=order)
    path = tmp_path / "part.msh"
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
        assert names == {*mesh.sets, "SOLID"}
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
