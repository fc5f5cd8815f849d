"""Beams as finite elements: axes within a region, mean sections, sets; a solver's answers where closed forms are known."""

import re
import shutil
import subprocess

import numpy as np
import pytest
import trabecula as lt
from finite_elements import solid as lattice
from hypothesis import given, settings
from hypothesis import strategies as st
from trabecula import _core
from trabecula.design import parsed


def built(text):
    return parsed("schema = 1\n" + text, False, "test", ".").build()


def wireframe(nodes, struts, more="radius = 0.2", region="box = { size = [100, 100, 100] }"):
    """Beams between given nodes."""
    return built(f"region.{region}\n[beams.rods]\nnodes = {np.asarray(nodes).tolist()}\nstruts = {struts}\n{more}\n")


def cubic(count, region=None, radius=0.15):
    """Cubes of 3 mm, ``count`` along each axis."""
    region = region or f"box = {{ min = [0, 0, 0], max = [{3 * count}, {3 * count}, {3 * count}] }}"
    return built(f'region.{region}\n[beams.core]\ncell = "sc"\nradius = {radius}\nmap.affine.wavelength = 3\n')


def lengths(mesh):
    ends = mesh.nodes[mesh.elements[:, :2]]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.3, 30), st.sampled_from([1, 2]))
def test_elements_make_up_the_beams(seed, edge, order):
    """Random trees of cylinders: length, volume and joints are those of the graph, whatever the size of elements."""
    random = np.random.default_rng(seed)
    nodes = [np.zeros(3)]
    while len(nodes) < 7:
        p = random.uniform(-20, 20, 3)
        if min(np.linalg.norm(p - q) for q in nodes) > 3:
            nodes.append(p)
    struts = [[int(random.integers(0, i)), i] for i in range(1, 7)]
    mesh = wireframe(nodes, struts).beam_mesh(edge=edge, order=order)
    axes = [np.linalg.norm(nodes[a] - nodes[b]) for a, b in struts]
    figures = mesh.report()
    assert figures.length == pytest.approx(sum(axes), rel=1e-12)
    assert mesh.volume == pytest.approx(np.pi * 0.04 * sum(axes), rel=1e-9)  # designs are written with ten digits or more
    assert (figures.beams, figures.cut, figures.pieces) == (6, 0, 1)
    assert figures.elements == sum(int(np.ceil(a / edge - 1e-9)) for a in axes)
    # A tree has one node more than elements.
    assert figures.nodes == figures.elements * order + 1
    assert lengths(mesh).max() <= edge * (1 + 1e-12)
    if order == 2:
        middle = mesh.nodes[mesh.elements[:, :2]].mean(axis=1)
        np.testing.assert_allclose(mesh.nodes[mesh.elements[:, 2]], middle, atol=1e-12)


def test_sections_are_means_of_the_beam():
    """∫ρ² along a cone and along a beam with a waist: Simpson's rule over any division is exact, so that all agree."""
    for more in ("radius.formula = '0.4 + 0.02 * abs(x)'", "radius = 0.3\nhub = 1"):
        solid = wireframe([[0, 0, 0], [12, 3, 1]], [[0, 1]], more)
        volumes = [solid.beam_mesh(edge=edge).volume for edge in (50, 3, 0.7)]
        np.testing.assert_allclose(volumes, volumes[0], rtol=1e-12)
        fine = solid.beam_mesh(edge=0.05)
        assert fine.report().thinnest < fine.report().thickest


@pytest.mark.parametrize("region", ["sphere.radius = 7", "cylinder = { base = [0, 0, -6], radius = 5.5, height = 12 }"])
def test_beams_end_where_the_region_does(region):
    solid = built(f'region.{region}\n[beams.core]\ncell = "bcc"\nradius = 0.2\nmap.affine.wavelength = 3\n')
    mesh = solid.beam_mesh(edge=0.5, order=1)
    figures = mesh.report()
    assert 0 < figures.cut < figures.beams
    number = np.bincount(mesh.elements.ravel(), minlength=len(mesh.nodes))
    ends = mesh.nodes[number == 1]
    x, y, z = mesh.nodes.T
    depth = np.linalg.norm(mesh.nodes, axis=1) - 7 if "sphere" in region else np.maximum(np.hypot(x, y) - 5.5, abs(z) - 6)
    assert depth.max() < 1e-9 and len(ends) > 50
    assert abs(depth[number == 1]).max() < 1e-9


def test_sets_loads_and_components(tmp_path):
    solid = cubic(2)
    mesh = solid.beam_mesh(edge=1, order=1)
    assert set(mesh.sets) == {"X0", "X1", "Y0", "Y1", "Z0", "Z1"}
    top = mesh.sets["Z1"]
    assert (mesh.nodes[top.nodes, 2] == 6).all() and len(top.faces) == 9
    # Nine columns come up to it; the beams in the plane are its elements.
    assert len(top.elements) == 36
    _, forces = mesh.forces("Z1", (0, 0, -9))
    np.testing.assert_allclose(forces, np.tile([0, 0, -1], (9, 1)), atol=1e-12)
    apart = wireframe([[0, 0, 0], [9, 0, 0], [0, 5, 0], [2, 5, 0]], [[0, 1], [2, 3]])
    with pytest.warns(lt.DesignWarning, match="2 components"):
        assert apart.beam_mesh().report().pieces == 2
    alone = apart.beam_mesh(islands="drop").report()
    assert (alone.pieces, alone.length, alone.loose) == (1, 9, 2)
    with pytest.raises(ValueError, match="2 components"):
        apart.beam_mesh(islands="error")
    with pytest.raises(ValueError, match="nothing else, and this design is not one graph of beams"):
        lattice().beam_mesh()
    for asked, words in (({"edge": 0}, "edge is 0"), ({"order": 3}, "order is 3"), ({"edge": 1e-9}, "at most")):
        with pytest.raises(ValueError, match=words):
            solid.beam_mesh(**asked)
    for asked, words in (
        ({"solver": "nastran"}, "calculix"),
        ({"hold": ["X0"]}, "both hold and load"),
        ({"hold": ["SKIN"], "load": {"X1": (1, 0, 0)}}, "no set SKIN"),
    ):
        with pytest.raises(ValueError, match=words):
            solid.beam_mesh().write(tmp_path / "a.inp", **asked)
    with pytest.raises(ValueError, match="order 1"):
        solid.beam_mesh().write(tmp_path / "a.bdf")
    with pytest.raises(ValueError, match="order 2"):
        mesh.write(tmp_path / "a.inp")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix, solver, order", [("inp", "abaqus", 1), ("inp", "calculix", 2), ("bdf", "calculix", 1)])
def test_files_have_the_sections(suffix, solver, order, tmp_path):
    """Read back as graphs: Abaqus and Nastran take radii, CalculiX diameters."""
    solid = wireframe([[0, 0, 0], [12, 3, 1], [5, 5, 9]], [[0, 1], [1, 2]], "radius.formula = '0.4 + 0.02 * abs(x)'")
    mesh = solid.beam_mesh(edge=1, order=order)
    mesh.write(tmp_path / f"a.{suffix}", E=2000, nu=0.25, solver=solver)
    read = _core.read_graph((tmp_path / f"a.{suffix}").read_bytes(), suffix)[3]
    times = 2 if solver == "calculix" and suffix == "inp" else 1
    assert len(read) == len(mesh.elements)
    # Five digits.
    np.testing.assert_allclose(np.sort(read[:, 0]), np.sort(times * mesh.radii), rtol=5.1e-5)
    text = (tmp_path / f"a.{suffix}").read_text()
    assert ("*ELASTIC\n2000.0, 0.25" if suffix == "inp" else "MAT1") in text


def solved(folder, name):
    ccx = shutil.which("ccx")
    if ccx is None:
        pytest.skip("CalculiX is not installed")
    done = subprocess.run([ccx, name], cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout[-2000:]
    text = (folder / f"{name}.dat").read_text()
    reaction = [float(v) for v in re.search(r"total force .*?\n\n(.*?)\n", text).group(1).split()]
    return reaction, float(re.search(r"total internal energy .*?\n\n(.*?)\n", text).group(1))


def test_calculix_bends_a_cantilever(tmp_path):
    """Half the load times the deflection F L³ / 3 E I + F L / k G A: the internal energy.

    Sections of the solver have eight nodes and four points: 1 % less area than a circle, 2 % less moment of inertia. (With a
    Poisson's ratio a clamp holds their width, too.)
    """
    solid = wireframe([[0, 0, 0], [12, 9, 20]], [[0, 1]], "radius = 0.5")
    E, nu, L, F = 1000.0, 0.0, 25.0, np.array([0.3, -0.4, 0])
    assert abs(np.dot(F, [12, 9, 20])) < 1e-12
    solid.beam_mesh().write(tmp_path / "a.inp", E=E, nu=nu, hold=["Z0"], load={"Z1": F})
    reaction, energy = solved(tmp_path, "a")
    np.testing.assert_allclose(reaction, -F, atol=1e-5)
    inertia, area, G = np.pi * 0.5**4 / 4, np.pi * 0.25, E / (2 * (1 + nu))
    force = 0.5
    exact = force * (force * L**3 / (3 * E * inertia) + force * L / (0.9 * G * area)) / 2
    assert energy == pytest.approx(exact, rel=0.03)


def test_calculix_presses_columns(tmp_path):
    """Nine columns of a cubic lattice carry the load alone: F² L / 2 E Σ A, with sections as above."""
    cubic(2, radius=0.1).beam_mesh().write(tmp_path / "a.inp", E=1000, nu=0, hold=["Z0"], load={"Z1": (0, 0, -9)})
    reaction, energy = solved(tmp_path, "a")
    np.testing.assert_allclose(reaction, [0, 0, 9], atol=1e-4)
    assert energy == pytest.approx(81 * 6 / (2 * 1000 * 9 * np.pi * 0.01), rel=0.02)


def test_meshio_reads_beams(tmp_path):
    meshio = pytest.importorskip("meshio")
    for order, kind in ((1, "line"), (2, "line3")):
        mesh = cubic(1).beam_mesh(order=order)
        mesh.write(tmp_path / "a.vtu", fields={"number": np.arange(len(mesh.elements))})
        read = meshio.read(tmp_path / "a.vtu")
        assert (read.cells_dict[kind] == mesh.elements).all() and (read.points == mesh.nodes).all()
        assert (read.cell_data["radius"][0].ravel() == mesh.radii).all()


def test_a_force_on_what_is_held_is_refused(tmp_path):
    """A flat frame has the same nodes least and farthest along z."""
    flat = wireframe([[0, 0, 0], [9, 0, 0], [9, 9, 0]], [[0, 1], [1, 2]])
    with pytest.raises(ValueError, match="all nodes of Z1, which is loaded, are held by Z0"):
        flat.beam_mesh().write(tmp_path / "a.inp", hold=["Z0"], load={"Z1": (0, 0, 1)})
    flat.beam_mesh().write(tmp_path / "a.inp", hold=["X0"], load={"Z1": (0, 0, 1)})
