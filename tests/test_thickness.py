"""Walls of a given thickness, through every door."""

import json
import subprocess
import sys
import warnings

import numpy as np
import pytest
import trabecula as lt
from conftest import CUBE

WALL = CUBE.replace("fraction = 0.3", "thickness = 0.4")


def wall(level, cell="gyroid", size=8, **map_settings):
    core = lt.Lattice(cell=cell, part="sheet", map=lt.map.affine(**{"wavelength": 4.0, **map_settings}), level=level)
    return lt.Design(region=lt.region.box(size=[size] * 3), lattice={"core": core})


def figures(level, **settings):
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        return wall(level, **settings).build().report()["lattices"]["core"]


def test_every_door_gives_the_same(tmp_path):
    """Builder, TOML, JSON and the command."""
    assert lt.level.thickness(0.4) == {"thickness": 0.4}
    assert lt.level.thickness(0.4, mid=0.2) == {"thickness": 0.4, "mid": 0.2}
    built = wall(lt.level.thickness(0.4)).build()
    file = tmp_path / "wall.toml"
    file.write_text(WALL)
    points = np.random.default_rng(1).uniform(-5, 5, (1000, 3))
    assert np.array_equal(lt.load(file).build().field(points), built.field(points))
    wall(lt.level.thickness(0.4)).save(tmp_path / "wall.json")
    assert np.array_equal(lt.load(tmp_path / "wall.json").build().field(points), built.field(points))
    words = [sys.executable, "-m", "trabecula", "check", str(file)]
    report = json.loads(subprocess.run([*words, "--json"], capture_output=True, text=True, check=True).stdout)
    assert report.pop("volume_error") == built.volume_error()
    assert report == built.report()
    text = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert "constant-level sheet of equal fraction" in text and "thickness  0.4000 mm" in text


def test_the_report():
    """What a wall of even thickness is, in numbers."""
    it = figures(lt.level.thickness(0.4))
    assert it["thickness"] == 0.4
    assert it["iso"] == pytest.approx(lt.iso("gyroid", it["fraction"], "sheet"), rel=1e-9)
    # Steiner's formula about the minimal gyroid, w = 0.1 of the cell; f = 0 is within 1e-4 of it.
    assert it["fraction"] == pytest.approx(3.091444 * 0.1 - 4.18879e-3, rel=5e-4)
    assert it["fraction"] + it["porosity"] == pytest.approx(1)
    # Conventions: folding at about 0.37 of the cell.
    assert it["folding"] == pytest.approx(0.37 * 4, abs=0.02)
    assert it["connected_fraction"][0][0] < 1e-3
    graded = figures(lt.level.thickness(lt.grade.linear([0, 0, 1], {-4: 0.2, 4: 0.4})))
    assert graded["thickness"] == pytest.approx([0.2, 0.4])
    assert graded["fraction"][1] == pytest.approx(it["fraction"], rel=1e-6)
    assert figures(lt.level.fraction(0.3))["folding"] is None


def test_the_field_is_half_the_thickness_from_the_surface():
    """On f = 0 the field is minus half the thickness, in mm; its slope in space is one, stretched or not."""
    solid = wall(lt.level.thickness(0.4), wavelength=[3.0, 4.0, 6.0]).build()
    on = np.array([[0.0, 0.0, 0.0], [1.5, 2.0, 3.0], [0.75, 1.0, 1.5]])
    x, y, z = (2 * np.pi * on / [3, 4, 6]).T
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    assert np.abs(f).max() < 1e-9
    assert solid.field(on) == pytest.approx(-0.2, abs=1e-3)
    normal = np.array([1 / 3, 1 / 4, 1 / 6])
    normal /= np.linalg.norm(normal)
    assert solid.field(on[:1] + 0.1 * normal) == pytest.approx(-0.1, abs=1e-3)


def test_folding_is_warned_of():
    """Above twice the least radius of curvature, with the limit."""
    with pytest.warns(lt.DesignWarning, match=r"lattice.core.level.thickness: .*folding limit, 0\.83"):
        wall(lt.level.thickness(0.9), cell="iwp").build()
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        wall(lt.level.thickness(0.8), cell="iwp").build()


@pytest.mark.parametrize("part", ["lower", "upper"])
@pytest.mark.parametrize(("level", "key"), [(lt.level.thickness(0.4), "thickness"), (lt.level.fraction(0.3, mid=0.2), "mid")])
def test_networks_have_no_wall(part, level, key):
    lattice = lt.Lattice(cell="gyroid", part=part, map=lt.map.affine(4), level=level)
    with pytest.raises(lt.DesignError, match=f'{key} goes with part = "sheet"') as error:
        lt.Design(region=lt.region.box(size=[8, 8, 8]), lattice={"core": lattice}).build()
    assert error.value.path == f"lattice.core.level.{key}"


def test_off_centre_sheets():
    """|f - mid| ≤ t, by its own distribution; and the wall about f = mid."""
    solid = wall(lt.level.iso(0.2, mid=0.5)).build()
    points = np.random.default_rng(2).uniform(-3.9, 3.9, (1000, 3))
    x, y, z = (2 * np.pi * points / 4).T
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    inside = np.abs(points).max(axis=1) < 3.5
    assert np.allclose(solid.field(points)[inside], np.maximum(np.abs(f - 0.5) - 0.2, np.abs(points).max(axis=1) - 4)[inside])
    share = lt.fraction("gyroid", 0.7, part="lower") - lt.fraction("gyroid", 0.3, part="lower")
    assert figures(lt.level.iso(0.2, mid=0.5))["fraction"] == pytest.approx(share, abs=1e-4)
    assert figures(lt.level.fraction(share, mid=0.5))["iso"] == pytest.approx(0.2, abs=1e-3)
    mesh = wall(lt.level.thickness(0.4, mid=0.5)).build().mesh(per_cell=32)
    assert mesh.closed
    assert mesh.solid_fraction == pytest.approx(figures(lt.level.thickness(0.4, mid=0.5))["fraction"], rel=2e-3)


@pytest.mark.parametrize("cell", ["diamond", "primitive", "iwp"])
def test_the_part_weighs_what_the_report_says(cell):
    """Whole cells, unequal wavelengths: volume of the mesh over the box is the fraction by quadrature of the distance."""
    core = lt.Lattice(cell=cell, part="sheet", map=lt.map.affine([3, 4, 6]), level=lt.level.thickness(0.35))
    solid = lt.Design(region=lt.region.box(min=[0, 0, 0], max=[3, 4, 6]), lattice=core).build()
    mesh = solid.mesh(per_cell=32)
    assert mesh.closed
    assert mesh.solid_fraction == pytest.approx(solid.report()["lattices"]["core"]["fraction"], rel=2e-3)


def test_bits_that_dangle(tmp_path):
    """A block with balls on posts, kept solid but for its foot: those on thin posts dangle."""
    balls = [lt.region.box(min=[-10, -10, -10], max=[10, 10, 0])]
    for i, thick in enumerate((0.3, 0.4, 0.8, 1.2)):
        balls.append(lt.region.cylinder(base=[4 * i - 6, 0, -1], radius=thick / 2, height=2))
        balls.append(lt.region.sphere(radius=1, center=[4 * i - 6, 0, 1.5]))
    whole = lt.region.union(*balls)
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=8), level=lt.level.fraction(0.5))
    design = lt.Design(
        region=whole, lattice={"core": core}, keep={"upper": lt.region.box(min=[-20, -20, -9], max=[20, 20, 20])}
    )
    found = design.build().dangling(neck=1.0)
    assert found["count"] == 2 and found["neck"] == 0.5
    assert found["largest"]["place"][2] > 0.5
    assert found["volume"] == pytest.approx(2 * 4 / 3 * np.pi, rel=0.1)
    design.save(tmp_path / "balls.toml")
    words = [
        sys.executable,
        "-m",
        "trabecula",
        "measure",
        str(tmp_path / "balls.toml"),
        "--edge",
        "0.5",
        "--dangling",
        "--json",
    ]
    reported = json.loads(subprocess.run([*words, "--json"], capture_output=True, text=True, check=True).stdout)["dangling"]
    assert set(reported) == {"count", "volume", "largest", "neck", "step"}
    with pytest.raises(ValueError, match="neck is 0"):
        design.build().dangling(neck=0)
