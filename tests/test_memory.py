"""Arrays, tables and meshes in memory where a design has the path of a file: the same as from the file, to the last bit."""

import copy
import multiprocessing
import os
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import trabecula as lt

BOX = lt.region.box(size=[8, 8, 8])
POINTS = np.random.default_rng(3).uniform(-4, 4, (64, 3))
#: What the grid has at the points, and what its file has.
NUMBERS = np.random.default_rng(1).uniform(0.2, 0.5, (5, 6, 7))
PLACED = {"origin": [-4, -4, -4], "step": [2.0, 1.6, 8 / 6]}


def design(amount, region=BOX):
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(amount))
    return lt.Design(region=region, lattice=core)


def field(made):
    return made.build().field(POINTS)


def volume(given):
    """In another process."""
    return given.build().mesh(edge=0.4).volume


def test_a_grid_is_an_array(tmp_path):
    np.save(tmp_path / "grid.npy", NUMBERS)
    made = design(lt.grade.grid(NUMBERS, **PLACED))
    expected = field(design(lt.grade.grid(tmp_path / "grid.npy", **PLACED)))
    assert np.array_equal(field(made), expected)
    assert np.array_equal(field(design(lt.grade.grid(np.asfortranarray(NUMBERS).tolist(), **PLACED))), expected)
    assert made == design(lt.grade.grid(NUMBERS.copy(), **PLACED)) != design(lt.grade.grid(NUMBERS + 0.01, **PLACED))
    assert hash(made) == hash(copy.deepcopy(made)) == hash(pickle.loads(pickle.dumps(made)))


def test_points_are_an_array_or_a_data_frame(tmp_path):
    rows = np.column_stack([POINTS, np.linspace(0.2, 0.5, len(POINTS))])
    (tmp_path / "points.csv").write_text("".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()))
    expected = field(design(lt.grade.points(tmp_path / "points.csv")))
    assert np.array_equal(field(design(lt.grade.points(rows))), expected)
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(rows, columns=["x", "y", "z", "fraction"])
    assert np.array_equal(field(design(lt.grade.points(frame))), expected)
    assert np.array_equal(field(design(lt.grade.points(frame[["fraction", "z", "y", "x"]]))), expected)
    nodes, struts = frame[["x", "y", "z"]], pandas.DataFrame([[0, 1], [1, 2]])
    assert lt.Beams(nodes=nodes, struts=struts, radius=0.5) == lt.Beams(nodes=POINTS, struts=[[0, 1], [1, 2]], radius=0.5)


def test_a_region_is_a_mesh(tmp_path):
    ball = lt.Design(lt.region.sphere(radius=4), design(0.3).lattice).build().mesh(edge=0.5)
    ball.write(tmp_path / "ball.ply")
    expected = field(design(0.4, lt.region.mesh(tmp_path / "ball.ply")))
    for given in (ball, (ball.vertices, ball.triangles), *(getattr(ball, f"to_{name}")() for name in there())):
        assert np.array_equal(field(design(0.4, lt.region.mesh(given))), expected)


def there():
    """The packages of meshes that are installed."""
    for name in ("trimesh", "pyvista", "meshio"):
        try:
            __import__(name)
        except ImportError:
            continue
        yield name


def test_what_is_saved_has_its_data_as_files(tmp_path, monkeypatch):
    made = design(lt.grade.grid(NUMBERS, **PLACED))
    made.save(tmp_path / "a.toml")
    (file,) = tmp_path.glob("*.npy")
    assert np.array_equal(np.load(file), NUMBERS) and file.name in (tmp_path / "a.toml").read_text()
    monkeypatch.chdir(os.sep)
    assert np.array_equal(field(lt.load(tmp_path / "a.toml")), field(made))
    made.save(tmp_path / "b.json")
    assert np.array_equal(field(lt.load(tmp_path / "b.json")), field(made)) and made.files() == []


@pytest.mark.parametrize("how", ["fork", "spawn"])
def test_other_processes_have_the_data(how):
    if how not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {how} here")
    made = design(lt.grade.grid(NUMBERS, **PLACED))
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context(how)) as pool:
        found = list(pool.map(volume, [made], timeout=120))
    assert found == [volume(made)]


def test_solids_sweeps_and_ranges_have_the_data(tmp_path):
    made = design(lt.grade.grid(NUMBERS, **PLACED))
    solid, expected = made.build(), volume(made)
    again = pickle.loads(pickle.dumps(solid))
    text = solid._core.design
    swept = replace(made, sweep={"lattice.core.map.affine.wavelength": [4.0, 5.0]})
    assert lt.sweep(swept, edge=0.4, jobs=2)["volume_mm3"][0] == pytest.approx(expected, rel=1e-9)
    del made, swept
    assert again.mesh(edge=0.4).volume == expected == solid.mesh(edge=0.4).volume
    assert solid.save(tmp_path / "a.stl", edge=0.4, resume=True).volume == pytest.approx(expected, rel=1e-9)
    del solid, again
    with pytest.raises(lt.DesignError, match=r"memory:[0-9a-f]{64}\.npy is data that no design in this process holds"):
        lt.Design(**__import__("json").loads(lt._core.Design.from_text(text).to_json())).build()


def test_what_is_no_data_is_refused():
    with pytest.raises(TypeError, match=r"not code; found the function .*lambda.*grade\.formula.*grade\.grid"):
        design(lambda points: 0.3 + 0 * points[:, 0])
    with pytest.raises(TypeError, match=r"not code; found the function .*grade\.grid"):
        lt.grade.grid(lambda points: 0.3)
    with pytest.raises(TypeError, match="the grid: expected the path of a file or an array of numbers, found dict"):
        lt.grade.grid({"a": 1})
    with pytest.raises(ValueError, match=r"the grid must be real numbers in 3 dimensions, found float64 of shape \(4,\)"):
        lt.grade.grid([1.0, 2, 3, 4])
    with pytest.raises(lt.DesignError, match="four numbers x, y, z, value"):
        design(lt.grade.points(POINTS)).build()
    with pytest.raises(TypeError, match="expected vertices and triangles, or a trimesh"):
        lt.region.mesh(5)
