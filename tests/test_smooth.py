"""Better triangles, by the command and by Python."""

import json
import pickle

import numpy as np
import pytest
import trabecula as lt
from conftest import command


def angles(mesh):
    """The smallest angle of each triangle, degrees, by the law of cosines."""
    p = mesh.vertices[mesh.triangles]
    a, b, c = (np.linalg.norm(p[:, k] - p[:, (k + 1) % 3], axis=1) for k in range(3))
    cosines = [(y**2 + z**2 - x**2) / (2 * y * z) for x, y, z in ((a, b, c), (b, c, a), (c, a, b))]
    return np.degrees(np.arccos(np.clip(cosines, -1, 1))).min(axis=0)


def test_triangles_are_better_and_all_else_stays(block):
    plain, better = block.mesh(per_cell=24), block.mesh(per_cell=24, smooth=True)
    assert plain.smoothing is None
    report, found = better.smoothing, angles(better)
    assert np.percentile(found, 5) > 15 > np.percentile(angles(plain), 5)
    assert report["smallest_angle"] == pytest.approx(found.min(), abs=1e-6)
    assert report["smallest_angle_p05"] == pytest.approx(better.quality.smallest_angle_p05)
    assert (report["triangles_before"], report["triangles"]) == (plain.counts[1], better.counts[1])
    assert not better.defects and (better.euler, better.pieces) == (plain.euler, plain.pieces)
    assert better.volume == pytest.approx(plain.volume, rel=1e-4)  # the promise of the grid itself
    assert better.bounds == plain.bounds and better.solid_fraction == pytest.approx(plain.solid_fraction, rel=1e-4)
    assert np.array_equal(better.vertices, better.vertices.astype(np.float32))
    assert pickle.loads(pickle.dumps(better)).smoothing == report


def test_any_number_of_threads_gives_the_same(block):
    one, two = (block.mesh(per_cell=12, smooth=True, threads=n) for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices) and np.array_equal(one.triangles, two.triangles)


def test_an_interrupt_is_heard(block):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        block.mesh(per_cell=24)._core.smoothed(stop)


def test_the_command(tmp_path, block):
    design = tmp_path / "cube.toml"
    design.write_text(block._core.design)
    out = tmp_path / "cube.stl"
    done = command("mesh", design, "-o", out, "--per-cell", 16, "--smooth", "--json")
    assert done.returncode == 0, done.stderr
    made, read = json.loads(done.stdout), lt.Mesh.read(out)
    assert made["triangles"] == read.counts[1] == made["smoothing"]["triangles"]
    assert made["smoothing"]["smallest_angle_p05"] > 15 and np.percentile(angles(read), 5) > 15
    assert read.closed and not read.defects
    done = command("mesh", design, "-o", out, "--per-cell", 16, "--smooth")
    assert "19 in 20 triangles" in done.stderr


@pytest.mark.parametrize("more", [["--tolerance", "0.1"], ["--triangles", "100"], ["--chord", "0.1"]])
def test_what_does_not_go_together(tmp_path, more):
    done = command("mesh", tmp_path / "cube.toml", "-o", tmp_path / "cube.stl", "--smooth", *more)
    assert done.returncode == 2 and "--smooth" in done.stderr


def test_not_for_beams_without_a_grid(block):
    with pytest.raises(ValueError, match="smooth"):
        block.mesh(chord=0.1, smooth=True)
