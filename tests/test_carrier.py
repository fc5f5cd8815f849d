"""The carrier of a lattice over tetrahedra as finite elements: fractions, sets, materials, files."""

import dataclasses
import re
import shutil
import subprocess

import numpy as np
import pytest
import trabecula as lt

pytestmark = pytest.mark.filterwarnings("ignore::trabecula.DesignWarning")


def design(level, cell="diamond", part="lower", region=None, **keys):
    """A lattice over tetrahedra."""
    core = lt.Lattice(lt.cell.tet(cell), part, lt.map.tets(size=3, **keys), level)
    return lt.Design(region or lt.region.box(min=[0, 0, 0], max=[10, 8, 8]), core)


def volumes(mesh):
    """Volumes of the tetrahedra between corners."""
    return np.linalg.det(np.diff(mesh.nodes[mesh.elements[:, :4]], axis=1)) / 6


GRADED = {"fraction": lt.grade.linear(along=[1, 0, 0], stops=[[0, 0.15], [10, 0.4]])}


def test_fractions_are_those_of_the_solid():
    """Their mean is the solid fraction of the part's mesh, whose error is of second order in the step."""
    solid = design(GRADED).build()
    carrier = solid.carrier()
    own = volumes(carrier)
    assert own.min() > 0 and own.sum() == pytest.approx(640, rel=1e-12) and carrier.volume == pytest.approx(640, rel=1e-12)
    assert (carrier.fraction * own).sum() / 640 == pytest.approx(solid.mesh(per_cell=24).solid_fraction, abs=1e-3)
    # Every tetrahedron is in the class of its fraction.
    upper = np.array([int(name.removeprefix("FRACTION_")) for name in carrier.domains])[carrier.domain] / 100
    assert (carrier.fraction <= upper).all() and (carrier.fraction > upper - 0.05).all()
    assert (np.diff(carrier.domain.astype(int)) >= 0).all()


def test_sets_are_the_boundary_the_planes_and_those_of_the_design():
    end = lt.region.halfspace(point=[9.5, 0, 0], normal=[-1, 0, 0])
    made = dataclasses.replace(design({"fraction": 0.25}), set={"end": end})
    for order, each in ((1, 3), (2, 6)):
        carrier = made.build().carrier(order=order)
        assert set(carrier.sets) == {"SURFACE", "X0", "X1", "Y0", "Y1", "Z0", "Z1", "end"}
        planes = sum(len(carrier.sets[name].faces) for name in ("X0", "X1", "Y0", "Y1", "Z0", "Z1"))
        assert planes == len(carrier.sets["SURFACE"].faces)
        assert set(map(tuple, carrier.sets["X1"].faces)) <= set(map(tuple, carrier.sets["end"].faces))
        assert (carrier.nodes[carrier.sets["X1"].nodes][:, 0] == 10).all()
        nodes, forces = carrier.forces("X1", (0, 0, -5))
        assert set(nodes) <= set(carrier.sets["X1"].nodes) and np.allclose(forces.sum(axis=0), [0, 0, -5])
        assert carrier.report().order == order and carrier.elements.shape[1] == {3: 4, 6: 10}[each]


def test_quadratic_tetrahedra_fill_the_ball():
    """Chords lose a share of second order, quadratic edges on the surface one of fourth."""
    ball = design({"fraction": 0.3}, region=lt.region.sphere(radius=6)).build()
    exact = 4 / 3 * np.pi * 6**3
    flat, bent = (abs(ball.carrier(order=order).volume / exact - 1) for order in (1, 2))
    assert flat > 0.01 and bent < flat**2


def test_a_material_is_the_mean_of_the_cell_over_all_directions():
    """Hill's mean of the stiffness that the cell has by itself; between, nearly a power of the fraction."""
    solid = design({"fraction": 0.3}).build()
    found = solid.carrier().moduli(nu=0.3, n=16)
    c = np.array(solid.stiffness(n=16, nu=0.3).C)
    c11, c12, c44 = c[0, 0], c[0, 1], c[3, 3]
    bulk, slant = (c11 + 2 * c12) / 3, c11 - c12
    shear = ((slant + 3 * c44) / 5 + 5 * slant * c44 / (4 * c44 + 3 * slant)) / 2
    assert found["young"] == pytest.approx(9 * bulk * shear / (3 * bulk + shear), rel=1e-6)
    assert found["poisson"] == pytest.approx((3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)), rel=1e-6)
    graded = design(GRADED).build().carrier()
    young = graded.moduli(n=16)["young"]
    assert (np.diff(young) >= 0).all() and (young < graded.fraction + 0.03).all()


def test_zones_have_their_own_domains_and_cells():
    halves = {1: lt.region.halfspace(point=[5, 0, 0], normal=[1, 0, 0])}
    core = lt.Lattice(lt.cell.tet(zones={0: "p43m", 1: "f43m"}), "lower", lt.map.tets(size=3, zones=halves), {"fraction": 0.3})
    solid = lt.Design(lt.region.box(min=[0, 0, 0], max=[10, 8, 8]), core).build()
    carrier = solid.carrier()
    assert {name[:7] for name in carrier.domains} == {"ZONE_0_", "ZONE_1_"}
    middles = carrier.nodes[carrier.elements].mean(axis=1)[:, 0]
    first = np.array([name.startswith("ZONE_0_") for name in carrier.domains])[carrier.domain]
    assert middles[first].min() > middles[~first].min() and middles[first].max() > middles[~first].max()
    young = carrier.moduli(n=16)["young"]
    alone = {cell: design({"fraction": 0.3}, cell).build().carrier().moduli(n=16)["young"][0] for cell in ("p43m", "f43m")}
    inner = np.abs(carrier.fraction - 0.3) < 1e-3
    assert young[first & inner] == pytest.approx(alone["p43m"], rel=0.05)
    assert young[~first & inner] == pytest.approx(alone["f43m"], rel=0.05)


@pytest.mark.parametrize("order", [1, 2])
def test_files_have_domains_materials_and_fractions(tmp_path, order):
    meshio = pytest.importorskip("meshio")
    carrier = design(GRADED).build().carrier(order=order)
    count = len(carrier.elements)
    carrier.write(tmp_path / "a.inp", E=1000)
    text = (tmp_path / "a.inp").read_text()
    assert text.count("*MATERIAL") == text.count("*SOLID SECTION") == len(carrier.domains) and "*STEP" not in text
    young = float(text.split(f"*MATERIAL, NAME={carrier.domains[-1]}\n*ELASTIC\n")[1].split(",")[0])
    assert young == pytest.approx(1000 * carrier.moduli()["young"][-1])
    read = meshio.read(tmp_path / "a.inp")
    assert sum(len(block.data) for block in read.cells if block.type.startswith("tetra")) == count
    carrier.write(tmp_path / "b.inp", hold=["X0"], load={"X1": (0, 0, -1)})
    assert "*STEP" in (tmp_path / "b.inp").read_text()
    carrier.write(tmp_path / "a.bdf")
    assert (tmp_path / "a.bdf").read_text().count("MAT1*") == len(carrier.domains)
    carrier.write(tmp_path / "a.vtu", fields=carrier.moduli())
    read = meshio.read(tmp_path / "a.vtu")
    assert np.array_equal(read.cell_data["fraction"][0].ravel(), carrier.fraction)
    assert np.array_equal(read.cell_data["young"][0].ravel(), carrier.moduli()["young"])
    if order == 1:
        carrier.write(tmp_path / "a.msh")
        read = meshio.read(tmp_path / "a.msh")
        tets = [v for block, v in zip(read.cells, read.cell_data["fraction"], strict=True) if block.type == "tetra"]
        assert np.array_equal(np.concatenate(tets).ravel(), carrier.fraction)


def turned(c, q):
    """A stiffness (6, 6) in turned axes, as a tensor of fourth order."""
    place = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
    full = np.einsum("ai,bj,ck,dl,ijkl->abcd", q, q, q, q, c[place[:, :, None, None], place[None, None]])
    at = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    return np.array([[full[i + j] for j in at] for i in at])


def rotation(rng):
    """A random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def test_axes_are_those_of_the_body_centred_lattice():
    """Orthonormal everywhere; inside a background mesh, whose tetrahedra are of that lattice, those of the world."""
    solid = design({"fraction": 0.3}, region=lt.region.box(min=[0, 0, 0], max=[15, 15, 15])).build()
    carrier = solid.carrier()
    axes = carrier.axes
    assert np.allclose(np.einsum("eij,ekj->eik", axes, axes), np.eye(3), atol=1e-12) and (np.linalg.det(axes) > 0).all()
    middles = carrier.nodes[carrier.elements].mean(axis=1)
    inner = (np.abs(middles - 7.5) < 4).all(axis=1)
    largest = np.abs(axes[inner]).max(axis=2)
    assert inner.sum() > 50 and largest == pytest.approx(1, abs=1e-6)
    own = np.array(solid.stiffness(n=16, nu=0.3).C)
    assert np.allclose(carrier.stiffness(n=16)[inner], own, atol=1e-3 * own.max())


def test_the_mean_of_oriented_stiffness_is_between_the_bounds_of_the_isotropic_one():
    """Over all directions the mean of the stiffness is Voigt's, above Hill's, and traces are invariant."""
    carrier = design(GRADED).build().carrier()
    c, moduli = carrier.stiffness(n=16), carrier.moduli(n=16)
    bulk = c[:, :3, :3].sum(axis=(1, 2)) / 9
    assert bulk == pytest.approx(moduli["young"] / (3 * (1 - 2 * moduli["poisson"])), rel=1e-9)
    voigt = (np.trace(c[:, :3, :3], axis1=1, axis2=2) - 3 * bulk) / 10 + np.trace(c[:, 3:, 3:], axis1=1, axis2=2) / 5
    assert (np.linalg.eigvalsh(c) > 0).all()
    assert (voigt >= moduli["young"] / (2 * (1 + moduli["poisson"])) * (1 - 1e-9)).all()


@pytest.mark.parametrize("seed", range(2))
def test_axes_and_stiffness_turn_with_the_mesh(seed, tmp_path):
    meshio = pytest.importorskip("meshio")
    rng = np.random.default_rng(seed)
    q = rotation(rng)
    mesh = lt.TetMesh.of(design({"fraction": 0.3}))
    nodes = mesh.nodes + rng.normal(scale=0.1, size=mesh.nodes.shape)
    found = []
    for name, places in (("as_it_is", nodes), ("turned", nodes @ q.T)):
        meshio.write_points_cells(tmp_path / f"{name}.vtu", places, [("tetra", mesh.tets)])
        core = lt.Lattice(lt.cell.tet("diamond"), "lower", lt.map.tets(path=str(tmp_path / f"{name}.vtu")), {"fraction": 0.3})
        found.append(lt.Design(lt.region.sphere(radius=16), core).build().carrier().stiffness(n=8))
    assert max(np.abs(turned(a, q) - b).max() for a, b in zip(*found, strict=True)) < 1e-9


def solved(carrier, stiffness, held, load):
    """The internal energy of linear tetrahedra under a load, by a solver of our own."""
    nodes, tets = carrier.nodes, carrier.elements
    k = np.zeros((3 * len(nodes), 3 * len(nodes)))
    for t, c in zip(tets, stiffness, strict=True):
        p = nodes[t]
        slopes = np.linalg.inv(np.vstack([np.ones(4), p.T]))[:, 1:]
        b = np.zeros((6, 12))
        for i, (x, y, z) in enumerate(slopes):
            b[:, 3 * i : 3 * i + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0]]
        dofs = (3 * t[:, None] + np.arange(3)).ravel()
        k[np.ix_(dofs, dofs)] += abs(np.linalg.det(np.diff(p, axis=0))) / 6 * b.T @ c @ b
    f = np.zeros(3 * len(nodes))
    at, forces = carrier.forces(*load)
    f.reshape(-1, 3)[at] = forces
    free = np.ones(len(f), dtype=bool)
    free.reshape(-1, 3)[carrier.sets[held].nodes] = False
    return f[free] @ np.linalg.solve(k[np.ix_(free, free)], f[free]) / 2


def test_calculix_solves_a_cantilever_of_oriented_elements(tmp_path):
    """To the digits that it prints the energy is that of the stiffness of each element, which differs from that of its mean."""
    ccx = shutil.which("ccx")
    if ccx is None:
        pytest.skip("CalculiX is not installed")
    graded = {"fraction": lt.grade.linear(along=[1, 0, 0], stops=[[0, 0.4], [16, 0.2]])}
    made = design(graded, region=lt.region.box(size=[16, 5, 5]))
    carrier = made.build().carrier()
    load = ("X1", (0, 0, -5))
    energies = {}
    for oriented in (True, False):
        carrier.write(tmp_path / "beam.inp", E=1000, hold=["X0"], load=dict([load]), oriented=oriented)
        done = subprocess.run([ccx, "beam"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout[-2000:]
        text = (tmp_path / "beam.dat").read_text()
        energies[oriented] = sum(float(v) for v in re.findall(r"total internal energy .*?\n\n(.*?)\n", text))
    assert energies[True] == pytest.approx(solved(carrier, 1000 * carrier.stiffness(), "X0", load), rel=2e-6)
    assert abs(energies[True] / energies[False] - 1) > 0.01


def test_files_have_orientation_and_stiffness(tmp_path):
    meshio = pytest.importorskip("meshio")
    carrier = design(GRADED).build().carrier()
    fields = carrier.materials(0.3, "msh")
    carrier.write(tmp_path / "a.msh", fields=fields | {"height": carrier.nodes[:, 2]})
    read = meshio.read(tmp_path / "a.msh")
    own = {"orientation": carrier.axes.reshape(-1, 9), **fields}
    for name, wanted in own.items():
        tets = [v for block, v in zip(read.cells, read.cell_data[name], strict=True) if block.type == "tetra"]
        assert np.array_equal(np.concatenate(tets).ravel(), wanted.ravel())
    assert np.array_equal(read.point_data["height"].ravel(), carrier.nodes[:, 2])
    carrier.write(tmp_path / "a.vtu", fields=carrier.materials(0.3, "vtu"))
    read = meshio.read(tmp_path / "a.vtu")
    assert np.array_equal(read.cell_data["orientation"][0], carrier.axes.reshape(-1, 9))
    assert np.array_equal(read.cell_data["stiffness"][0].reshape(-1, 6, 6), carrier.stiffness())
    with pytest.raises(ValueError, match=r"oriented materials are for \.inp"):
        carrier.write(tmp_path / "a.bdf", oriented=True)
    with pytest.raises(ValueError, match="1, 3 or 9"):
        carrier.write(tmp_path / "b.msh", fields={"C": carrier.stiffness().reshape(-1, 36)})


def test_a_result_comes_back_as_a_level(tmp_path):
    """The numbers of elements are a grade, as a solver's results are."""
    carrier = design({"fraction": 0.25}).build().carrier()
    middles = carrier.nodes[carrier.elements].mean(axis=1)
    carrier.write(tmp_path / "result.vtu", fields={"asked": 0.2 + 0.02 * middles[:, 0]})
    grade = lt.grade.field(path=str(tmp_path / "result.vtu"), array="asked")
    again = design({"fraction": grade}).build().carrier()
    own = again.nodes[again.elements].mean(axis=1)[:, 0]
    inner = (own > 2) & (own < 8)
    assert np.abs(again.fraction - (0.2 + 0.02 * own))[inner].max() < 0.02


def test_what_has_no_carrier_is_refused():
    box = lt.Design(
        lt.region.box(size=[8, 8, 8]), lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=4), {"fraction": 0.3})
    )
    with pytest.raises(ValueError, match=r"map\.tets"):
        box.build().carrier()
    with pytest.raises(ValueError, match="order is 3"):
        design({"fraction": 0.3}).build().carrier(order=3)
    skinned = dataclasses.replace(design({"fraction": 0.3}), skin=lt.skin(0.5)).build()
    with pytest.warns(lt.DesignWarning, match="SKIN: no part of the carrier"):
        skinned.carrier()
    # Spheres alone, which carry nothing.
    apart = design({"fraction": 0.05}, "diamond").build().carrier()
    with pytest.raises(ValueError, match=r"falls apart|in pieces"):
        apart.moduli(n=16)


def test_laws_of_tetrahedral_cells():
    """The stiffness of each fraction is that of a design; lengths are in edges of a regular tetrahedron."""
    law = lt.law("diamond", start=0.2, stop=0.3, count=2, n=16, properties=["stiffness", "area"], tet=True)
    assert law.part == "lower" and law.tet and law.to_dict()["tet"]
    own = design({"fraction": 0.2}).build()
    found = own.stiffness(n=16)
    assert law.columns["C11"][0] == pytest.approx(found.C[0][0], rel=1e-6)
    # The area of the wall of a mesh in tetrahedra of size s, times s: of long tetrahedra it is greater.
    size = (own.carrier().volume / len(own.carrier().elements) * 6 * np.sqrt(2)) ** (1 / 3)
    area = own.mesh(per_cell=24).uncapped().area / own.carrier().volume * size
    assert law.columns["area"][0] == pytest.approx(area, rel=0.1)
    with pytest.raises(ValueError, match="no tetrahedral cell"):
        lt.law("gyroid", tet=True)
    with pytest.raises(ValueError, match="part of a tetrahedral cell"):
        lt.law("diamond", "beams", tet=True)
