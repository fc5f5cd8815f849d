"""Shells: triangles on the mid-surface of sheets, thickness at nodes, sets, files."""

import re
import shutil
import subprocess
import warnings

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process

meshio = pytest.importorskip("meshio")


def plate(thickness=0.5, order=2, edge=0.8, **more):
    """One plate at x = 2, 10 mm long along y and 2 mm wide."""
    wave = lt.cell.series(terms=[lt.cell.term([1, 0, 0], 1.0)])
    core = lt.Lattice(cell=wave, part="sheet", map=lt.map.affine(wavelength=8), level=lt.level.thickness(thickness))
    solid = lt.Design(region=lt.region.box(min=[0, 0, 0], max=[4, 10, 2]), lattice={"core": core}, **more).build()
    return solid.shell_mesh(edge=edge, order=order)


def gyroid(level, region=None, **more):
    core = lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=4), level=level)
    region = region or lt.region.box(min=[0, 0, 0], max=[6, 4, 4])
    return lt.Design(region=region, lattice={"core": core}, **more).build()


def areas(mesh):
    p = mesh.nodes[mesh.elements[:, :3]]
    return np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2


def angles(mesh):
    """The smallest angle of each triangle, degrees."""
    p = mesh.nodes[mesh.elements[:, :3]]
    sides = [p[:, (k + 1) % 3] - p[:, k] for k in range(3)]
    unit = [s / np.linalg.norm(s, axis=1)[:, None] for s in sides]
    cosines = [-(unit[k] * unit[k - 1]).sum(axis=1) for k in range(3)]
    return np.degrees(np.arccos(np.clip(cosines, -1, 1))).min(axis=0)


@pytest.mark.parametrize("order", [1, 2])
def test_a_plate_is_exact(order):
    mesh = plate(order=order)
    report = mesh.report()
    assert report.order == order and mesh.elements.shape[1] == 3 * order
    assert np.abs(mesh.nodes[:, 0] - 2).max() < 1e-9
    # The distance to the mid-surface comes from a table.
    assert mesh.thickness == pytest.approx(0.5, rel=1e-5)
    assert (report.area, report.volume, mesh.volume) == pytest.approx((20, 10, 10), rel=1e-5)
    assert report.straight == 0 and set(report.sets) == {"Y0", "Y1", "Z0", "Z1", "BORDER"}
    nodes = mesh.nodes[mesh.sets["Y1"].nodes]
    assert np.abs(nodes[:, 1] - 10).max() < 1e-6 and {nodes[:, 2].min(), nodes[:, 2].max()} == {0, 2}
    nodes, forces = mesh.forces("Y1", [0, 3, -1])
    assert forces.sum(axis=0) == pytest.approx([0, 3, -1]) and set(nodes) == set(mesh.sets["Y1"].nodes)
    # A linear moment is right, too: that of the edge's middle.
    assert (mesh.nodes[nodes, 2] * forces[:, 1]).sum() == pytest.approx(3 * 1.0)


def test_walls_of_a_thickness_have_it_everywhere():
    solid = gyroid(lt.level.thickness(0.3))
    mesh = solid.shell_mesh(per_cell=24)
    # The distance to the mid-surface comes from a table of the cell.
    assert np.abs(mesh.thickness / 0.3 - 1).max() < 0.01
    # Triangles that the box cuts off are merged: next to none is a sliver.
    found = angles(mesh)
    assert found.min() == pytest.approx(mesh.report().min_angle) and found.min() > 1 and (found < 15).mean() < 0.005
    # ∫ t dA and the share t² K / 12 that bending takes of it: K is -1.6 to 0 in units of (2π / wavelength)² here.
    exact = solid.mesh(per_cell=48).volume
    assert mesh.volume == pytest.approx(exact, rel=0.3**2 / 12 * 1.6 * (2 * np.pi / 4) ** 2)
    # Twice the area of the mid-surface is what the faces have, to the same order.
    assert areas(mesh).sum() == pytest.approx(mesh.report().area)


def test_area_converges_with_the_square_of_the_edge():
    solid = gyroid(lt.level.fraction(0.2))
    area = [solid.shell_mesh(per_cell=n).report().area for n in (12, 24, 48)]
    assert 2.5 < (area[1] - area[0]) / (area[2] - area[1]) < 6, area


def test_the_middles_of_edges_lie_on_the_surface():
    solid = gyroid(lt.level.fraction(0.25), lt.region.sphere(radius=5))
    linear, mesh = solid.shell_mesh(per_cell=10), solid.shell_mesh(per_cell=10, order=2)
    count = len(linear.nodes)
    assert np.array_equal(mesh.nodes[:count], linear.nodes) and np.array_equal(mesh.elements[:, :3], linear.elements)
    # On the mid-surface the field, |u| - t, is least; within the ball the region has no say.
    field = solid.field(mesh.nodes[np.linalg.norm(mesh.nodes, axis=1) < 4])
    assert len(field) > 1000 and np.ptp(field) < 1e-9
    # The border of a ball is no plane: its edges are straight.
    assert mesh.report().straight >= len(mesh.sets["BORDER"].faces) > 0


def test_sets_of_the_design_are_triangles_within_their_region():
    end = lt.region.box(min=[5, -1, -1], max=[7, 5, 5])
    mesh = gyroid(lt.level.fraction(0.2), set={"end": end}).shell_mesh(per_cell=12)
    found = mesh.sets["end"]
    middles = mesh.nodes[mesh.elements].mean(axis=1)
    assert set(found.elements) == set(np.flatnonzero(middles[:, 0] >= 5 - 1e-6))
    assert set(found.nodes) == set(mesh.elements[found.elements].ravel())


def test_sharp_triangles_are_warned_of():
    """Where a mesh has angles below twelve degrees the warning says how many triangles and where."""
    level = lt.level.thickness(lt.grade.linear([0, 0, 1], {-4: 0.2, 4: 0.4}))
    solid = gyroid(level, region=lt.region.box(size=[8, 8, 8]))
    sharp = 0
    for per_cell in (8, 12, 16):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            mesh = solid.shell_mesh(per_cell=per_cell)
        words = [str(w.message) for w in found if "have an angle below 12 degrees" in str(w.message)]
        least = angles(mesh)
        if least.min() >= 12:
            assert not words
            continue
        sharp += 1
        count, of, smallest, place = re.match(
            r"(\d+) triangles? of (\d+) have .* the least is ([\d.e-]+) at \((.*)\) mm", words[0]
        ).groups()
        assert (int(count), int(of)) == ((least < 12).sum(), len(least))
        assert float(smallest) == pytest.approx(least.min(), rel=0.06)
        middle = mesh.nodes[mesh.elements[least.argmin(), :3]].mean(axis=0)
        assert np.allclose([float(v) for v in place.split(",")], middle, atol=1e-3)
    assert sharp


def test_blends_of_sheets_have_shells():
    core = {
        name: lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(amount))
        for name, amount in {"a": 0.1, "b": 0.25}.items()
    }
    blend = lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {2: 0, 10: 1}))
    region = lt.region.box(min=[0, 0, 0], max=[12, 4, 4])
    solid = lt.Design(region=region, lattice=core, blend=blend).build()
    mesh = solid.shell_mesh(per_cell=16)
    assert mesh.volume == pytest.approx(solid.mesh(per_cell=32).volume, rel=0.03)
    first, last = (mesh.thickness[near].mean() for near in (mesh.nodes[:, 0] < 1, mesh.nodes[:, 0] > 11))
    assert last / first == pytest.approx(2.5, rel=0.05)


@pytest.mark.parametrize(("suffix", "order"), [(s, n) for s in ("inp", "bdf", "vtu") for n in (1, 2)])
def test_files_are_read_by_others(tmp_path, suffix, order):
    mesh = gyroid(lt.level.fraction(0.2)).shell_mesh(per_cell=8, order=order)
    path = tmp_path / f"shell.{suffix}"
    mesh.write(path, E=70000, nu=0.33)
    if suffix == "bdf":
        rows = re.findall(r"^CTRIA[36]  (.*)\+\n\+(.*)", path.read_text(), re.M)
        assert len(rows) == len(mesh.elements)
        assert [int(v) for v in rows[0][0].split()] == [1, 1, *(mesh.elements[0] + 1)]
        assert len(rows[0][0]) == 64 and rows[0][1][:23].isspace()
        assert [float(v) for v in rows[0][1].split()] == pytest.approx(mesh.thickness[mesh.elements[0, :3]], abs=1e-5)
        return
    if (suffix, order) == ("inp", 2):  # meshio knows no S6
        rows = path.read_text().split("*ELEMENT, TYPE=S6, ELSET=SHELL\n")[1].split("\n*")[0].splitlines()
        assert np.array_equal(np.array([row.split(",") for row in rows], int)[:, 1:] - 1, mesh.elements)
        return
    read = meshio.read(path)
    kind = "triangle" if order == 1 else "triangle6"
    assert np.array_equal(read.cells_dict[kind], mesh.elements)
    assert read.points == pytest.approx(mesh.nodes, abs=1e-9)
    if suffix == "vtu":
        assert np.array_equal(read.point_data["thickness"].ravel(), mesh.thickness)
    else:
        text = path.read_text()
        assert "NODAL THICKNESS" in text and "*SURFACE" not in text
        assert set(read.point_sets) >= {"X0", "BORDER"}


def test_calculix_bends_a_plate_as_a_beam(tmp_path):
    if (ccx := shutil.which("ccx")) is None:
        pytest.skip("ccx is missing")
    mesh = plate(thickness=0.25, edge=0.5)
    for name, force in {"pull": (0, 100, 0), "bend": (1, 0, 0)}.items():
        mesh.write(tmp_path / f"{name}.inp", E=200000, nu=0.0, hold=["Y0"], load={"Y1": force})
        done = subprocess.run([ccx, name], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert "Job finished" in done.stdout, done.stdout[-2000:]
    area, inertia, long = 2 * 0.25, 2 * 0.25**3 / 12, 10
    # Work of the loads is twice the internal energy.
    work = {n: 2 * energy(tmp_path / f"{n}.dat") for n in ("pull", "bend")}
    assert work["pull"] / 100 == pytest.approx(100 * long / (200000 * area), rel=1e-3)
    assert work["bend"] / 1 == pytest.approx(long**3 / (3 * 200000 * inertia), rel=0.01)


def energy(path):
    """The total internal energy that CalculiX printed, N mm."""
    found = re.findall(r"total internal energy.*\n\s*\n\s*(\S+)", path.read_text())
    return float(found[-1].split()[-1])


def test_what_has_no_shells_is_refused(tmp_path):
    network = lt.Lattice(cell=lt.cell.gyroid(), part="lower", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.3))
    box = lt.region.box(size=[4, 4, 4])
    with pytest.raises(ValueError, match="shells are made of sheets"):
        lt.Design(region=box, lattice={"core": network}).build().shell_mesh()
    with pytest.raises(ValueError, match="leave out skin"):
        gyroid(lt.level.fraction(0.3), skin=lt.skin(thickness=0.5)).shell_mesh()
    with pytest.raises(ValueError, match="order is 3"):
        gyroid(lt.level.fraction(0.3)).shell_mesh(order=3)
    with pytest.warns(lt.DesignWarning, match="thicker than two edges"):
        gyroid(lt.level.thickness(0.9)).shell_mesh(per_cell=20)
    mesh = gyroid(lt.level.fraction(0.2)).shell_mesh(per_cell=8)
    with pytest.raises(ValueError, match=r"\.inp, \.bdf"):
        mesh.write(tmp_path / "a.msh")
    with pytest.raises(ValueError, match="has no set X9"):
        mesh.forces("X9", [1, 0, 0])


def test_the_command_makes_shells(tmp_path, capsys):
    design = tmp_path / "part.toml"
    design.write_text(
        'schema = 1\nunits = "mm"\nregion.box.size = [8, 8, 8]\n[lattice.core]\ncell = "gyroid"\npart = "sheet"\n'
        "map.affine.wavelength = 4\nlevel.thickness = 0.2\n"
    )
    in_process("volume", design, "-o", tmp_path / "shell.inp", "--of", "shell", "--order", "2", "--per-cell", "10")
    assert (tmp_path / "shell.inp").read_text().count("TYPE=S6") == 1
    for wrong in (["--wall", "3"], ["--periodic"]):
        in_process("volume", design, "-o", tmp_path / "b.inp", "--of", "shell", *wrong, status=2)
    in_process("volume", design, "-o", tmp_path / "b.msh", "--of", "shell", status=1)
    assert not (tmp_path / "b.inp").exists() and not (tmp_path / "b.msh").exists()
