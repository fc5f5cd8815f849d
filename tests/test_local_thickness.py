"""Local thickness, quality and what else is measured, through Python and the command."""

import json
import math
import subprocess
import sys
from xml.etree import ElementTree

import pytest
import trabecula as lt


def run(*words, cwd, status=0):
    """The command by this interpreter."""
    done = subprocess.run([sys.executable, "-m", "trabecula", *map(str, words)], capture_output=True, text=True, cwd=cwd)
    assert done.returncode == status, done.stderr
    return done


def box(path, low=(0, 0, 0), high=(8, 8, 1), faces=12, shift=0):
    """A box as an OBJ file of twelve triangles, or fewer."""
    corners = [[(low, high)[i >> a & 1][a] + shift for a in range(3)] for i in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))][:faces]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def solid():
    core = lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.3))
    return lt.Design(region=lt.region.box(size=[8, 8, 8]), lattice={"core": core}).build()


def test_a_design(solid):
    """Walls and pores of a sheet, and the figures that follow from areas and volumes."""
    made = solid.thickness(step=0.1)
    wall, pore = made.wall, made.pore
    assert made.step == wall["step"] == pore["step"] == 0.1
    for it in (wall, pore):
        assert 0 < it["min"] <= it["mean"] <= it["max"] and 0 < it["p05"] < it["mean"]
        assert len(it["histogram"]["edges"]) == len(it["histogram"]["share"]) + 1
        assert math.isclose(sum(it["histogram"]["share"]), 1)
    mesh = solid.mesh()
    figures = mesh.measure()
    # A wall's volume over half its area, but for rims and curvature: a hundredth.
    estimate = 2 * figures["volume"] / figures["area_lattice"]
    assert abs(wall["mean"] - estimate) < wall["accuracy"] + 0.01 * estimate
    surface = figures["specific_surface"]
    assert math.isclose(surface["area_of_solid"], figures["area"] / figures["volume"])
    assert math.isclose(surface["area_of_region"], figures["area"] / 512)
    assert math.isclose(surface["lattice_of_region"], figures["area_lattice"] / 512)
    assert math.isclose(figures["hydraulic_diameter"], 4 * (512 - figures["volume"]) / figures["area_lattice"])
    assert made.measure() == mesh.thickness(0.1, threads=1).measure() == {"wall_thickness": wall, "pore_size": pore}
    assert "walls" in repr(made) and made._repr_svg_() == made.svg()


def test_a_bare_mesh(tmp_path):
    """Walls alone, exact for planes; bodies apart from each other count together."""
    mesh = lt.Mesh.read(box(tmp_path / "slab.obj"))
    made = mesh.thickness(0.25)
    with pytest.warns(lt.DesignWarning, match="more than half the mean wall"):
        mesh.thickness(2.5)
    assert made.pore is None and abs(made.wall["max"] - 1) < 1e-5 and abs(made.wall["min"] - 1) < 1e-5
    assert mesh.measure()["hydraulic_diameter"] is None
    assert mesh.measure()["specific_surface"] == {
        "area_of_solid": 160 / 64,
        "area_of_region": None,
        "lattice_of_region": None,
    }
    assert 0.05 < mesh.thickness().step < 0.25


def test_quality_and_defects(tmp_path):
    """What is wrong is said in words."""
    good = lt.Mesh.read(box(tmp_path / "good.obj", high=(1, 1, 1)))
    assert good.quality["smallest_angle"] == pytest.approx(45) == good.quality["smallest_angle_p05"]
    assert good.quality["largest_aspect"] == pytest.approx(math.sqrt(2) / (math.sqrt(12) * (1 - math.sqrt(0.5))))
    assert (good.self_intersections, good.defects) == (0, [])
    open_ = lt.Mesh.read(box(tmp_path / "open.obj", faces=11))
    assert open_.defects == ["3 edges with one triangle"]
    two = (tmp_path / "good.obj").read_text()
    other = box(tmp_path / "b.obj", high=(1, 1, 1), shift=0.5).read_text()
    moved = [
        "f " + " ".join(str(int(n) + 8) for n in line.split()[1:]) if line[0] == "f" else line for line in other.splitlines()
    ]
    (tmp_path / "two.obj").write_text(two + "\n".join(moved) + "\n")
    crossing = lt.Mesh.read(tmp_path / "two.obj")
    assert crossing.self_intersections > 0 and any("cross" in d for d in crossing.defects)
    # What is inside either is solid: the union's thickness, no thinner than a cube's.
    assert crossing.thickness(0.05).wall["max"] >= 1


def test_refused(solid, tmp_path):
    """Steps that are none, too fine, and meshes without an inside."""
    mesh = lt.Mesh.read(box(tmp_path / "slab.obj"))
    for thing in (mesh, solid):
        for step in (0, -1, math.nan, math.inf):
            with pytest.raises(ValueError, match="step"):
                thing.thickness(step=step)
        with pytest.raises(TypeError, match="step"):
            thing.thickness(step="fine")
    with pytest.raises(ValueError, match="step"):
        mesh.thickness(step=1e-5)
    with pytest.raises(ValueError, match=r"try step|use a step"):
        mesh.thickness(step=0.0002)
    with pytest.raises(ValueError, match="not closed"):
        lt.Mesh.read(box(tmp_path / "open.obj", faces=11)).thickness(0.25)
    with pytest.raises(ValueError, match="threads"):
        mesh.thickness(0.25, threads=0)
    with pytest.raises(ValueError, match="smaller step"):
        lt.Mesh.read(box(tmp_path / "thin.obj", low=(0, 0, 0.01), high=(8, 8, 0.02))).within(
            lt.Design(region=lt.region.box(min=[0, 0, 0], max=[8, 8, 8]), lattice={"a": lattice()}).build()
        ).thickness(1.0)
    reported = []
    mesh.thickness(0.05, progress=lambda done, total: reported.append(done / total))
    assert all(0 <= share <= 1 for share in reported)


def lattice():
    return lt.Lattice(cell=lt.cell.gyroid(), part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.3))


def test_the_command(cube, tmp_path):
    """New keys beside the old ones; a picture of two histograms."""
    words = ("measure", cube, "--per-cell", "20", "--thickness", "--step", "0.15", "--json", "--histogram", "out.svg")
    figures = json.loads(run(*words, cwd=tmp_path).stdout)
    assert list(figures)[:12] == [
        *("volume", "area", "area_lattice", "area_cut", "solid_fraction", "porosity", "euler", "pieces"),
        *("cavities", "voids", "closed", "bounds"),
    ]
    assert figures["wall_thickness"]["step"] == figures["pore_size"]["step"] == 0.15
    assert figures["self_intersections"] == 0 and figures["defects"] == []
    assert set(figures["quality"]) == {"smallest_angle", "smallest_angle_p05", "largest_aspect"}
    texts = [t.text for t in ElementTree.parse(tmp_path / "out.svg").iter("{http://www.w3.org/2000/svg}text")]
    wall = figures["wall_thickness"]
    assert {"Wall thickness", "Pore size", "pore size, mm", f"mean {wall['mean']:.3g} mm"} <= set(texts)
    plain = run("measure", box(tmp_path / "slab.obj"), "--thickness", cwd=tmp_path).stdout
    assert "wall_thickness.mean" in plain and "quality.smallest_angle" in plain and "needs a region" in plain
    for bad, word, status in (
        (("--step", "0.1"), "--thickness", 2),
        (("--histogram", "a.svg"), "--thickness", 2),
        (("--thickness", "--step", "1e-6"), "step", 1),
    ):
        assert word in run("measure", "slab.obj", *bad, cwd=tmp_path, status=status).stderr
    for bad in (("--thickness", "--step", "0"), ("--thickness", "--step", "nan"), ("--thickness", "--histogram", "a.jpg")):
        run("measure", "slab.obj", *bad, cwd=tmp_path, status=2)
