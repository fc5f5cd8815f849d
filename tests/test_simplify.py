"""Lighter meshes, by the command and by Python."""

import json
import math

import numpy as np
import pytest
import trabecula as lt
from conftest import command


def test_a_tolerance_and_a_number(block):
    mesh = block.mesh(per_cell=24)
    light = mesh.simplified(tolerance=0.05)
    report = light.simplification
    assert report["triangles_before"] == mesh.counts[1] and report["triangles"] == light.counts[1] < mesh.counts[1] / 2
    assert 0 < report["deviation"] <= 0.05
    assert light.closed and light.euler == mesh.euler and light.pieces == mesh.pieces
    assert math.isclose(light.volume, mesh.volume, rel_tol=2e-3)
    assert report["volume"] == pytest.approx(light.volume) and report["area_before"] == pytest.approx(mesh.area)
    # Cuts are carried over, and with them the split of the area; so is the region.
    assert light.measure()["area_cut"] == pytest.approx(mesh.measure()["area_cut"], rel=0.01)
    assert light.solid_fraction == pytest.approx(mesh.solid_fraction, rel=2e-3)
    half = mesh.simplified(triangles=mesh.counts[1] // 2)
    assert mesh.counts[1] // 2 - 2 < half.counts[1] <= mesh.counts[1] // 2
    same = mesh.simplified(triangles=10**9)
    assert same.counts == mesh.counts and same.simplification["deviation"] == 0
    assert mesh.simplification is None
    again = mesh.simplified(tolerance=0.05)
    assert np.array_equal(again.vertices, light.vertices) and np.array_equal(again.triangles, light.triangles)


@pytest.mark.parametrize("goal", [{}, {"tolerance": 0}, {"tolerance": -1.0}, {"tolerance": math.nan}, {"triangles": 3}])
def test_a_goal_that_is_none(block, goal):
    with pytest.raises(ValueError, match=r"tolerance|triangles"):
        block.mesh(per_cell=8).simplified(**goal)


def test_progress_is_told_and_stops(block):
    mesh = block.mesh(per_cell=24)
    reported = []
    mesh.simplified(tolerance=0.02, progress=lambda done, total: reported.append((done, total)))
    assert reported and all(0 < done <= total for done, total in reported)

    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh.simplified(tolerance=0.02, progress=stop)


def test_the_command(cube, tmp_path):
    full, light, again = (tmp_path / name for name in ("full.stl", "light.stl", "again.ply"))
    assert command("mesh", cube, "-o", full).returncode == 0
    done = command("mesh", cube, "-o", light, "--tolerance", 0.02, "--json")
    assert done.returncode == 0, done.stderr
    made = json.loads(done.stdout)
    assert made["simplification"]["triangles"] == made["triangles"] == lt.Mesh.read(light).counts[1]
    assert "nowhere farther than" in done.stderr
    done = command("simplify", full, "-o", again, "--triangles", 20000, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["triangles"] <= 20000
    mesh = lt.Mesh.read(again)
    assert mesh.closed and math.isclose(mesh.volume, lt.Mesh.read(full).volume, rel_tol=1e-3)


def test_the_command_refuses(cube, tmp_path):
    full = tmp_path / "full.stl"
    assert command("mesh", cube, "-o", full, "--per-cell", 8).returncode == 0
    done = command("simplify", full, "-o", tmp_path / "x.stl")
    assert done.returncode == 2 and "--tolerance" in done.stderr
    for words in (["--tolerance", "0"], ["--tolerance", "nan"], ["--triangles", "3"]):
        assert command("simplify", full, "-o", tmp_path / "x.stl", *words).returncode == 2
    done = command("simplify", full, "-o", full, "--tolerance", "0.1")
    assert done.returncode == 1 and "another output" in done.stderr
    # One triangle less.
    data = bytearray(full.read_bytes()[:-50])
    data[80:84] = (int.from_bytes(data[80:84], "little") - 1).to_bytes(4, "little")
    (tmp_path / "open.stl").write_bytes(data)
    done = command("simplify", tmp_path / "open.stl", "-o", tmp_path / "x.stl", "--tolerance", "0.1")
    assert done.returncode == 1 and "3 edges with one triangle" in done.stderr
    assert not (tmp_path / "x.stl").exists()
