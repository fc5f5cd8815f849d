"""The Python door."""

import warnings

import numpy as np
import pytest
import trabecula as lt
from conftest import CUBE


def cube(part="sheet", level=None, size=8, cell="gyroid", **map_settings):
    """A small design."""
    core = lt.Lattice(
        cell=cell,
        part=part,
        map=lt.map.affine(**{"wavelength": 4.0, **map_settings}),
        level=level or lt.level.fraction(0.3),
    )
    return lt.Design(region=lt.region.box(size=[size] * 3), lattice={"core": core})


def test_builders_return_plain_data():
    """What the builders give is what stands in a file."""
    assert lt.cell.gyroid() == "gyroid"
    assert lt.cell.series([lt.cell.term([1, 0, 0], 2.0, -0.25)]) == {
        "series": {"terms": [{"hkl": [1, 0, 0], "amplitude": 2.0, "phase": -0.25}]}
    }
    assert lt.map.affine(4, rotate=(0, 0, 45), skew={"xz": 20}) == {
        "affine": {"wavelength": 4, "rotate": [0, 0, 45], "skew": {"xz": 20}}
    }
    assert lt.grade.depth({5: 0.2, 0: 0.55}) == {"depth": {"stops": [[0, 0.55], [5, 0.2]]}}
    assert lt.grade.linear(np.array([0, 0, 1]), np.array([[0, 0.2], [1, 0.3]]))["linear"]["along"] == [0, 0, 1]
    assert lt.level.porosity(0.7, of="part") == {"porosity": 0.7, "of": "part"}
    assert lt.region.difference(lt.region.box([1, 1, 1]), lt.region.sphere(0.4)) == {
        "difference": [{"box": {"size": [1, 1, 1]}}, {"sphere": {"radius": 0.4}}]
    }
    with pytest.raises(AttributeError, match="did you mean gyroid"):
        lt.cell.gyriod()


def test_a_design_is_saved_and_loaded(tmp_path):
    """Same data through TOML and JSON, and the same solid."""
    design = cube(level=lt.level.fraction(lt.grade.linear([0, 0, 1], {-4: 0.2, 4: 0.4})))
    points = np.random.default_rng(1).uniform(-5, 5, (1000, 3))
    for name in ("a.toml", "b.json"):
        design.save(tmp_path / name)
        again = lt.load(tmp_path / name)
        assert again == lt.load(tmp_path / "a.toml")
        assert np.array_equal(again.build().field(points), design.build().field(points))


def test_mesh_paths_follow_the_file(tmp_path):
    """A design saved elsewhere still finds its mesh."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "designs").mkdir()
    cube(level=lt.level.fraction(0.5)).build().mesh(edge=1)
    block = lt.Design(region=lt.region.mesh("parts/a.stl"), lattice=cube().lattice, folder=str(tmp_path))
    block.save(tmp_path / "designs" / "a.toml")
    assert lt.load(tmp_path / "designs" / "a.toml").region["mesh"]["path"] == "../parts/a.stl"


def test_the_field_is_negative_in_the_solid():
    """Sheet |f| − t, lower f − t, upper t − f; outside the region positive; any leading shape."""
    points = np.random.default_rng(2).uniform(-3.9, 3.9, (500, 3))
    x, y, z = (2 * np.pi * points / 4).T
    f = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    for part, want in (("sheet", np.abs(f) - 0.2), ("lower", f - 0.2), ("upper", 0.2 - f)):
        found = cube(part, lt.level.iso(0.2)).build().field(points)
        assert np.array_equal(found < 0, want < 0)
    solid = cube().build()
    assert (solid.field([[5.0, 0, 0], [0, 9, 0]]) > 0).all()
    assert solid.field(points.reshape(20, 25, 3)).shape == (20, 25)
    assert solid.field(points[0]).shape == ()
    with pytest.raises(ValueError, match=r"shape \(n, 3\)"):
        solid.field(np.zeros((4, 2)))


def test_a_mesh_has_its_figures():
    """Arrays of the promised kinds; volume near the fraction; Euler number of closed cells."""
    mesh = cube().build().mesh(per_cell=24)
    assert mesh.vertices.dtype == np.float64 and mesh.vertices.shape[1] == 3
    assert mesh.triangles.dtype == np.uint32 and mesh.triangles.shape[1] == 3
    assert mesh.cut.shape == (len(mesh.triangles),) and mesh.cut.any() and not mesh.cut.all()
    assert mesh.closed and mesh.pieces >= 1 and mesh.cavities == 0
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert abs(np.einsum("ij,ij->", a, np.cross(b, c)) / 6 - mesh.volume) < 1e-8 * mesh.volume
    assert abs(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 - mesh.area) < 1e-8 * mesh.area
    assert abs(mesh.solid_fraction - 0.3) < 1e-3
    assert abs(mesh.porosity + mesh.solid_fraction - 1) < 1e-12
    edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert mesh.euler == len(mesh.vertices) - len(np.unique(edges, axis=0)) + len(mesh.triangles)


def test_files_round_trip(tmp_path):
    """Every format, in any letter case."""
    mesh = cube().build().mesh(edge=0.4)
    for name in ("a.stl", "b.3MF", "c.Ply", "d.obj"):
        mesh.write(tmp_path / name)
        again = lt.Mesh.read(tmp_path / name)
        assert abs(again.volume / mesh.volume - 1) < 1e-5 and again.euler == mesh.euler and again.closed
    with pytest.raises(ValueError, match=r"must end in .*\.3mf"):
        mesh.write(tmp_path / "e.step")
    with pytest.raises(OSError, match="does not exist"):
        mesh.write(tmp_path / "none" / "a.stl")
    assert len(list(tmp_path.iterdir())) == 4


def test_streaming_agrees_with_memory(tmp_path):
    """The streamed STL is the mesh."""
    solid = cube().build()
    summary = solid.save_stl(tmp_path / "a.stl", edge=0.3)
    mesh = solid.mesh(edge=0.3)
    assert abs(summary["volume"] / mesh.volume - 1) < 1e-6
    assert abs(summary["area"] / mesh.area - 1) < 1e-6
    assert abs(lt.Mesh.read(tmp_path / "a.stl").volume / mesh.volume - 1) < 1e-5


def test_voxels(tmp_path):
    """Voxels are the sign of the field at their centres."""
    solid = cube().build()
    grid = solid.voxels(step=0.25)
    assert grid.shape == (32, 32, 32) == grid.solid.shape
    axes = [grid.origin[a] + grid.step * (np.arange(32) + 0.5) for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    assert np.array_equal(grid.solid == 1, solid.field(points) < 0)
    grid.write(tmp_path / "a.npy")
    assert np.array_equal(np.load(tmp_path / "a.npy"), grid.solid)


def test_spartan_is_seed_form():
    """The seven variables: phase rotation, the note's own hand, solid where f ≤ t."""
    three, angles, p = (4.0, 5.0, 6.0), (20.0, 35.0, 50.0), 0.7
    turn = np.radians(angles)
    c, s = np.cos(turn), np.sin(turn)
    rx = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    ry = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    rz = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    points = np.random.default_rng(3).uniform(-7, 7, (2000, 3))
    x, y, z = ((points * (2 * np.pi / np.array(three))) @ rx @ ry @ rz).T
    sx, sy, sz, cx, cy, cz = np.sin(x), np.sin(y), np.sin(z), np.cos(x), np.cos(y), np.cos(z)
    forms = {
        "gyroid": (cx * sy + cy * sz + cz * sx, -0.616271908),
        "diamond": (sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz, -0.486154728),
    }
    for name, (f, t) in forms.items():
        design = lt.spartan(name, wavelength=three, rotate=angles, porosity=p)
        found = design.build().field(points)
        sure = np.abs(f - t) > 1e-4
        assert np.array_equal((found < 0)[sure], (f < t)[sure]), name
    with pytest.raises(ValueError, match="gyroid"):
        lt.spartan("primitive")


def test_spartan_polynomial():
    """The published polynomial can be asked for by name: ninth order, within 0.0031 of the porosity."""
    printed = [
        -1.40181203e03, 6.31442849e03, -1.20734024e04, 1.27714436e04, -8.16588099e03,
        3.23757850e03, -7.84778926e02, 1.09747587e02, -1.01136257e01, 1.39501223e00,
    ]  # fmt: skip
    report = lt.spartan("diamond", porosity=0.6, fit="spartan").build().report()
    it = report["lattices"]["diamond"]
    assert abs(it["iso"] - np.polyval(printed, 0.6)) < 1e-12
    assert 1e-6 < abs(it["porosity"] - 0.6) < 0.0031
    assert abs(lt.spartan("diamond", porosity=0.6).build().report()["lattices"]["diamond"]["porosity"] - 0.6) < 1e-9


def test_levels_without_a_design():
    """fraction ↔ iso, numbers and arrays; literature values."""
    assert abs(lt.iso("gyroid", 0.3) - 0.463951958) < 1e-4
    assert abs(lt.iso("primitive", 0.3, part="lower") + 0.699339635) < 1e-4
    shares = np.linspace(0.02, 0.98, 25)
    for part in ("sheet", "lower", "upper"):
        assert np.abs(lt.fraction("iwp", lt.iso("iwp", shares, part=part), part=part) - shares).max() < 1e-6
    own = lt.cell.series([lt.cell.term(h) for h in np.eye(3, dtype=int).tolist()])
    assert abs(lt.iso(own, 0.3) - lt.iso("primitive", 0.3)) < 1e-6
    with pytest.raises(ValueError, match=r"fraction is 1\.5"):
        lt.iso("gyroid", 1.5)
    with pytest.raises(ValueError, match="did you mean"):
        lt.iso("gyriod", 0.5)


def test_of_part_is_met():
    """`of = "part"`: the finished part has the fraction that was asked for, cut cells and all."""
    design = cube("lower", lt.level.fraction(0.35, of="part"), size=5.3, rotate=[0, 0, 30])
    assert abs(design.build().mesh(edge=0.1).solid_fraction - 0.35) < 1e-3
    assert abs(cube("lower", size=5.3).build().mesh(edge=0.1).solid_fraction - 0.3) > 2e-3


def test_warnings_are_python_warnings():
    """Loose pieces: one DesignWarning, and the same on the solid."""
    design = cube("lower", lt.level.fraction(0.15), cell="primitive")
    with pytest.warns(lt.DesignWarning, match=r"0\.2133"):
        solid = design.build()
    assert len(solid.warnings) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cube().build()


def test_progress_and_interruption():
    """Progress is told on the calling thread; what it raises stops the work and comes out."""
    solid = cube(size=16).build()
    told = []
    solid.mesh(edge=0.08, progress=lambda done, total: told.append(done / total))
    assert told and sorted(told) == told and told[-1] <= 1

    def stop(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        solid.mesh(edge=0.05, progress=stop)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ({"edge": 0}, "edge is 0"),
        ({"edge": -1}, "edge is -1"),
        ({"edge": float("nan")}, "edge is nan"),
        ({"per_cell": 0}, "per_cell is 0"),
        ({"edge": 1, "per_cell": 32}, "not both"),
        ({"edge": 1, "threads": 0}, "threads is 0"),
        ({"edge": 1e-4}, "try edge"),
    ],
)
def test_bad_requests(words, error):
    """Refused before any work."""
    with pytest.raises(ValueError, match=error):
        cube().build().mesh(**words)


def test_pictures():
    """A mesh and a solid show themselves in a notebook."""
    solid = cube().build()
    assert solid._repr_png_().startswith(b"\x89PNG")
    assert "data:image/png;base64," in solid.mesh(edge=0.5)._repr_html_()
    assert "trabecula.Solid" in repr(solid) and "triangles" in repr(solid.mesh(edge=0.5))


def test_designs_are_data():
    """Frozen, comparable, and changing a copy leaves the rest."""
    design = cube()
    assert design == cube() and design != cube("lower")
    with pytest.raises(AttributeError):
        design.units = "inch"
    made = design.to_dict()
    made["region"]["box"]["size"][0] = 99
    assert design == cube()
    assert "wavelength" in design.to_toml()
    assert lt._core.Design.from_text(CUBE).to_json() == lt._core.Design.from_text(CUBE).to_json()
