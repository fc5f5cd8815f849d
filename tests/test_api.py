"""The Python door."""

import copy
import pickle
import warnings

import numpy as np
import pytest
import trabecula as lt
from conftest import CUBE, in_process

CORNER = "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


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


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: lt.map.affine(wavelenght=4), "affine has no argument wavelenght; did you mean wavelength? It takes"),
        (lambda: lt.region.box(sise=[1, 1, 1]), "did you mean size?"),
        (lambda: lt.grade.linear(along=[0, 0, 1], stop=[[0, 1]]), "did you mean stops?"),
        (lambda: lt.cell.series(term=[]), "did you mean terms?"),
        (lambda: lt.level.fraction(0.3, thicknes=1), "did you mean thickness?"),
        (lambda: lt.blend.between("a", "b", wieght=0.5), "did you mean weight?"),
        (lambda: lt.Lattice(cell="gyroid", prat="sheet"), "Lattice has no argument prat; did you mean part?"),
        (lambda: lt.Beams(cell="octet", radius=1, filet="auto"), "did you mean fillet?"),
        (lambda: lt.Design(region={}, latice={}), "did you mean lattice?"),
        (lambda: lt.skin(zzz=1), r"skin has no argument zzz\. It takes thickness, open"),
    ],
)
def test_a_misspelt_argument_names_the_nearest(call, words):
    with pytest.raises(TypeError, match=words.replace("?", r"\?")):
        call()


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
    (tmp_path / "parts" / "a.obj").write_text(CORNER)
    block = lt.Design(region=lt.region.mesh("parts/a.obj"), lattice=cube().lattice, folder=str(tmp_path))
    block.save(tmp_path / "designs" / "a.toml")
    assert lt.load(tmp_path / "designs" / "a.toml").region["mesh"]["path"] == "../parts/a.obj"


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


def test_meshes_of_arrays():
    """A mesh goes to arrays and back; what is no mesh is refused."""
    first = cube().build().mesh(edge=0.5)
    again = lt.Mesh.of(first.vertices, first.triangles)
    assert again.volume == first.volume and again.closed and again.solid_fraction is None
    half = again.within(lt.region.box(size=[8, 8, 8]))
    assert half.solid_fraction == pytest.approx(first.solid_fraction, rel=1e-12)
    for vertices, triangles, words in (
        ([[0, 0, 0]], [[0, 0, 1]], "indices of 1 vertices"),
        ([[0, 0, float("nan")]], [[0, 0, 0]], "finite"),
        ([[0, 0]], [[0, 0, 0]], "vertices \\(n, 3\\)"),
        ([[0, 0, 0]], [[0.0, 0.0, 0.0]], "whole numbers"),
    ):
        with pytest.raises(ValueError, match=words):
            lt.Mesh.of(vertices, triangles)
    with pytest.raises(TypeError, match=r"Mesh\.of"):
        lt.Mesh(first.vertices, first.triangles)


def test_pickles_and_copies():
    """For sweeps in several processes: designs, solids and meshes come out as they went in."""
    design = cube()
    solid = design.build()
    mesh = solid.mesh(edge=0.5)
    assert copy.deepcopy(mesh) is mesh and copy.copy(solid) is solid
    again = pickle.loads(pickle.dumps(mesh))
    assert again.measure() == mesh.measure() and (again.cut == mesh.cut).all()
    rebuilt = pickle.loads(pickle.dumps(solid))
    assert rebuilt.report() == solid.report() and pickle.loads(pickle.dumps(design)) == design


#: What is made of a solid or of beams, and the arrays and figures of it.
PLANNED = {
    "Layers": (lambda of: of.layers(layer=1.0), lambda it: [it.heights, *([at.z, at.area, *at.loops] for at in it)]),
    "ShellMesh": (lambda of: of.shell_mesh(edge=0.5), lambda it: [it.nodes, it.elements, it.thickness, it.report()]),
    "VolumeMesh": (lambda of: of.volume_mesh(edge=0.35, of="all"), lambda it: [it.nodes, it.elements, it.domain, it.report()]),
    "VoxelElements": (lambda of: of.voxel_elements(step=0.5), lambda it: [it.nodes, it.elements, it.fraction, it.report()]),
    "Voxels": (lambda of: of.voxels(step=0.25).moved((1, 2, 3)).scaled(0.7), lambda it: [it.origin, it.step, it.solid]),
    "BeamMesh": (lambda of: of.beam_mesh(), lambda it: [it.nodes, it.elements, it.radii, it.report()]),
    "Quadors": (lambda of: of.quadors(), lambda it: [it.volume(), it.whole, *it.fillets().values()]),
    "Slice": (lambda of: of.quadors().slice(z=0.1), lambda it: [it.area, it.hubs, *it.polygons(0.01)]),
}


@pytest.mark.filterwarnings("ignore::trabecula.DesignWarning")
@pytest.mark.parametrize("kind", PLANNED)
def test_what_solids_make_is_pickled_and_copied(kind):
    """Once and again, the same in every array and figure."""
    beams = lt.Design(region=lt.region.box(size=[6] * 3), beams=lt.Beams("bcc", lt.map.affine(wavelength=3), radius=0.2))
    make, parts = PLANNED[kind]
    made = make((beams if kind in ("BeamMesh", "Quadors", "Slice") else cube()).build())
    again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(made))))
    assert type(made) is type(again) and type(made).__name__ == kind and copy.deepcopy(made) is made is copy.copy(made)
    assert repr(again) == repr(made)
    np.testing.assert_equal(parts(again), parts(made))


def test_corners_that_single_precision_parts_are_one(tmp_path):
    """Triangles of an STL whose corners differ in the last place are read as neighbours."""
    mesh = cube().build().mesh(edge=1.0)
    corners = mesh.vertices[mesh.triangles] + 1e-7 * np.random.default_rng(1).uniform(-1, 1, (len(mesh.triangles), 3, 3))
    lines = ["solid s"]
    for t in corners:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x!r} {y!r} {z!r}" for x, y, z in t.tolist())]
        lines += ["endloop", "endfacet"]
    (tmp_path / "parted.stl").write_text("\n".join([*lines, "endsolid s\n"]))
    read = lt.Mesh.read(tmp_path / "parted.stl")
    assert read.closed and read.counts == mesh.counts and read.volume == pytest.approx(mesh.volume, rel=1e-6)


def test_bodies_that_do_not_touch_are_warned_of():
    apart = lt.region.union(lt.region.box(size=[4, 4, 4]), lt.region.sphere(radius=2, center=[9, 0, 0]))
    design = cube()
    with pytest.warns(lt.DesignWarning, match="2 bodies that do not touch"):
        lt.Design(region=apart, lattice=design.lattice).build()


def test_metres_taken_for_millimetres_are_asked_about():
    with pytest.raises(lt.DesignError, match=r"0\.008 mm across, less than a wavelength, 4 mm: are the units right"):
        cube(size=0.008).build()


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
    summary = solid.save(tmp_path / "a.stl", edge=0.3)
    mesh = solid.mesh(edge=0.3)
    assert abs(summary["volume"] / mesh.volume - 1) < 1e-6
    assert abs(summary["area"] / mesh.area - 1) < 1e-6
    assert abs(lt.Mesh.read(tmp_path / "a.stl").volume / mesh.volume - 1) < 1e-5


@pytest.mark.parametrize("kind", ["stl", "3mf", "ply", "obj"])
def test_streamed_files_are_those_of_the_mesh(tmp_path, kind):
    """Byte by byte, whatever is dropped; nothing else is left, not even when the work is stopped on its way."""
    solid = cube().build()
    for islands in ("keep", "drop"):
        reported = solid.save(tmp_path / f"a.{kind}", per_cell=9, islands=islands)
        made = solid.mesh(per_cell=9, islands=islands)
        made.write(tmp_path / f"b.{kind}")
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
        assert reported.triangles == made.counts[1]

    class Enough(Exception):
        pass

    def stop(done, total):
        raise Enough

    before = sorted(tmp_path.iterdir())
    with pytest.raises(Enough):
        solid.save(tmp_path / f"c.{kind}", edge=0.03, progress=stop)
    assert sorted(tmp_path.iterdir()) == before


def test_a_default_spacing_is_one_that_a_mesh_can_hold(tmp_path):
    """Before anything is made, and not if a spacing is given."""
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.4))
    solid = lt.Design(region=lt.region.box([60] * 3), lattice={"core": core}).build()
    wanted = solid.report().spacing
    assert solid.spacing() > 1.2 * wanted and solid.spacing(edge=wanted) == wanted
    assert solid.estimate().triangles == pytest.approx(20e6, rel=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        with pytest.raises(lt.DesignWarning, match=r"which the walls need, makes about .* triangles; .* mm is used"):
            solid.save(tmp_path / "a.3mf")
    assert not list(tmp_path.iterdir())


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


def test_voxels_are_an_array_for_numpy():
    """Without a copy and read-only unless another type or a copy is asked for."""
    grid = cube().build().voxels(step=0.5)
    seen = np.asarray(grid)
    assert seen.dtype == np.uint8 and seen.shape == grid.shape
    assert np.shares_memory(seen, grid.solid) and not seen.flags.writeable
    assert np.mean(grid) == pytest.approx(grid.volume / 8**3)
    for made in (np.array(grid), np.asarray(grid, dtype=float), np.array(grid, dtype=bool)):
        assert not np.shares_memory(made, grid.solid) and made.flags.writeable and np.array_equal(made, grid.solid)
    assert np.shares_memory(np.asarray(grid, dtype="uint8"), grid.solid)
    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        assert np.shares_memory(np.array(grid, copy=False), grid.solid)
        with pytest.raises(ValueError, match="voxels are uint8; as float64 they are a copy, which copy=False does not allow"):
            np.array(grid, dtype=np.float64, copy=False)


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
    """Progress is reported on the calling thread; what it raises stops the work and comes out."""
    solid = cube(size=16).build()
    reported = []
    solid.mesh(edge=0.08, progress=lambda done, total: reported.append(done / total))
    assert reported and sorted(reported) == reported and reported[-1] <= 1

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
    # A notebook stores every form that there is: the picture once.
    for shown in (solid, solid.mesh(edge=0.5)):
        assert [name for name in dir(shown) if name.startswith("_repr_")] == ["_repr_png_"]
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


def test_a_design_that_cannot_be_built_is_not_saved(tmp_path):
    """Nothing is written."""
    bad = [
        cube(level=lt.level.fraction(1.5)),
        cube(wavelength=-1),
        cube(cell="gyriod"),
        lt.Design(region=lt.region.mesh("none.stl"), lattice=cube().lattice),
    ]
    for design in bad:
        with pytest.raises(lt.DesignError):
            design.save(tmp_path / "a.toml")
    assert not list(tmp_path.iterdir())


def test_a_saved_design_is_equal(tmp_path):
    """Also where defaults were written out, numbers are of another kind, and paths start elsewhere."""
    (tmp_path / "sub").mkdir()
    (tmp_path / "part.obj").write_text(CORNER)
    level = lt.level.fraction(lt.grade.linear((0, 0, 1), {-4: 0.2, 4: np.float32(0.375)}), of="cell")
    waves = lt.cell.series([lt.cell.term(np.array(h), 1.0, component="im") for h in np.eye(3, dtype=int)])
    designs = [
        cube(level=level, rotate=(0, 0, 0), offset=np.zeros(3)),
        lt.Design(region=lt.region.box((8, 8, 8), center=[0, 0, 0]), lattice=cube(cell=waves).lattice["core"]),
        lt.Design(region=lt.region.mesh("part.obj", scale=1), lattice=cube().lattice, folder=str(tmp_path)),
        lt.spartan("diamond"),
    ]
    for design in designs:
        for name in ("a.toml", "sub/b.json"):
            design.save(tmp_path / name)
            again = lt.load(tmp_path / name)
            assert again == design and hash(again) == hash(design)
        assert design != cube("upper")


def test_sines_and_cosines():
    """component = "im" is the sine: the same surface as the cosine a quarter turn on."""
    axes = np.eye(3, dtype=int)
    sine = cube("lower", cell=lt.cell.series([lt.cell.term(h, component="im") for h in axes]))
    shifted = cube("lower", cell=lt.cell.series([lt.cell.term(h, phase=-0.25) for h in axes]))
    points = np.random.default_rng(1).uniform(-4, 4, (100, 3))
    assert np.array_equal(sine.build().field(points), shifted.build().field(points))
    assert sine != shifted
    with pytest.raises(lt.DesignError, match=r'component "img"; did you mean "im"'):
        cube(cell=lt.cell.series([lt.cell.term([1, 0, 0], component="img")])).build()


def nested(depth):
    """A region in a region in a region."""
    region = lt.region.box([8, 8, 8])
    for _ in range(depth):
        region = lt.region.union(region)
    return region


def holds_itself():
    """A region that holds itself."""
    region = lt.region.union()
    region["union"].append(region)
    return region


SOLID = cube(level=lt.level.fraction(0.6)).build()
MESH = SOLID.mesh(edge=0.25)


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda: lt.Design(nested(5000), cube().lattice).build(), "64 levels deep"),
        (lambda: lt.Design(holds_itself(), cube().lattice).build(), "hold itself"),
        (lambda: lt.Design(holds_itself(), cube().lattice).save("a.toml"), "hold itself"),
        (lambda: lt.Design(3, cube().lattice).build(), "region"),
        (lambda: lt.Design(lt.region.box([8, 8, 10**400]), cube().lattice).build(), "beyond 1e308"),
        (lambda: lt.Design(lt.region.box([1e300] * 3), cube().lattice).build(), "reaches to 5e299 mm"),
        (lambda: lt.Design(lt.region.box([8, 8, 8], center=[1e30, 0, 0]), cube().lattice).build(), "1e30 to 1e30 mm"),
        (lambda: cube(cell="\udcff").build(), "unknown cell"),
        (lambda: cube(cell=lt.cell.series([lt.cell.term([float("inf"), 0, 0])])).build(), "a whole number"),
        (lambda: cube(cell=lt.cell.series([lt.cell.term("abc")])).build(), "whole numbers"),
        (lambda: cube(level=lt.level.fraction(lt.grade.linear([0, 0, 1], [1, 2]))).build(), "stops"),
        (lambda: MESH.within(3), "within takes a Solid, a region or a path, found 3"),
        (lambda: MESH.within(MESH), "within takes a Solid"),
        (lambda: MESH.png((10**30, 10)), "size is out of range"),
        (lambda: MESH.png((80.5, 60)), "size must be a whole number"),
        (lambda: MESH.png((80, 60), azimuth=float("nan")), "must be finite"),
        (lambda: SOLID.mesh(edge="0.5"), "edge must be a number, found '0.5'"),
        (lambda: SOLID.mesh(edge=10**400), "edge is beyond"),
        (lambda: SOLID.mesh(edge=np.array([1, 2])), "edge must be one number"),
        (lambda: SOLID.mesh(edge=0.5, threads=10**9), "threads is 1000000000; it must be from 1 to 4096"),
        (lambda: SOLID.mesh(edge=0.5, threads=10**30), "threads is out of range"),
        (lambda: SOLID.mesh(edge=0.5, threads=0), "threads is 0"),
        (lambda: SOLID.mesh(edge=0.5, threads=-1), "threads is -1"),
        (lambda: SOLID.mesh(edge=0.5, threads=2.0), "threads must be a whole number"),
        (lambda: SOLID.mesh(edge=0.5, threads=True), "threads must be a whole number"),
        (lambda: SOLID.field("abc"), "could not convert"),
        (lambda: lt.iso("gyroid", None), "must be a number"),
        (lambda: lt.iso("gyroid", 10**400), "beyond 1e308"),
        (lambda: lt.spartan("diamond", wavelength=[1, 2]), "one number or three, found 2"),
        (lambda: lt.spartan("diamond", wavelength="4"), "must be a number"),
    ],
)
def test_wrong_arguments(call, error):
    """A TypeError or ValueError that says what was wrong, whatever was given."""
    with pytest.raises((TypeError, ValueError), match=error):
        call()


def test_numbers_of_any_kind():
    """NumPy's numbers are numbers."""
    assert lt.spartan("diamond", wavelength=np.float32(4)) == lt.spartan("diamond", wavelength=4)
    assert lt.spartan("diamond", wavelength=np.array([4, 4, 4])) == lt.spartan("diamond")
    assert SOLID.mesh(edge=np.float32(0.25), threads=np.int64(2)).counts == MESH.counts
    assert lt.iso("gyroid", np.float64(0.3)) == lt.iso("gyroid", 0.3)


def test_the_edge_is_told_where_the_grid_is_too_coarse():
    """And it is right: with it the fraction is the design's."""
    solid = cube(level=lt.level.fraction(0.5)).build()
    with pytest.warns(lt.DesignWarning, match="too coarse") as reported:
        solid.mesh(edge=1)
    (text,) = [str(w.message) for w in reported if "too coarse" in str(w.message)]
    edge = float(text.split("edge of ")[1].split()[0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Without the crumbs in the box's corners, which are warned of too.
        assert abs(solid.mesh(edge=edge, islands="drop").solid_fraction - 0.5) < 0.02


def test_uniform_levels_are_exact():
    """The realised fraction of whole cells is the asked one to the mesh's own error, which falls quickly."""
    for part, cell in (("lower", "gyroid"), ("sheet", "primitive")):
        solid = cube(part, lt.level.fraction(0.3), cell=cell).build()
        # Exact levels of the closed form, to 1e-9.
        exact = {"lower": -0.616271908, "sheet": None}[part]
        found = solid.report()["lattices"]["core"]["iso"]
        assert exact is None or abs(found - exact) < 5e-7
        assert abs(solid.mesh(edge=0.04).solid_fraction - 0.3) < 2e-6


def test_memory_of_control_groups(tmp_path):
    """Version 1 and 2, every group above counted, caches given back; without files nothing is reported."""
    free = lt._core.free_memory

    def put(name, text):
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    assert free(tmp_path) is None
    put("proc/meminfo", "MemTotal: 9 kB\nMemAvailable:  8000 kB\n")
    assert free(tmp_path) == 8000 * 1024
    put("proc/self/cgroup", "0::/a/b\n")
    put("sys/fs/cgroup/a/memory.max", "5000000\n")
    put("sys/fs/cgroup/a/memory.current", "2000000\n")
    put("sys/fs/cgroup/a/memory.stat", "anon 1\ninactive_file 500000\n")
    put("sys/fs/cgroup/a/b/memory.max", "max\n")
    put("sys/fs/cgroup/a/b/memory.current", "2000000\n")
    assert free(tmp_path) == 3500000
    put("proc/self/cgroup", "5:cpu:/a\n4:memory:/x/y\n0::/none\n")
    put("sys/fs/cgroup/memory/memory.limit_in_bytes", "3000000\n")
    put("sys/fs/cgroup/memory/memory.usage_in_bytes", "1000000\n")
    assert free(tmp_path) == 2000000
    put("proc/self/limits", "Limit  Soft  Hard  Units\nMax address space         1500000  unlimited  bytes\n")
    put("proc/self/status", "VmPeak: 99 kB\nVmSize:  1000 kB\n")
    assert free(tmp_path) == 1500000 - 1024000


@pytest.mark.parametrize("name", ["a.stl", "a.3mf", "a.ply", "a.obj", "a.npy", "a.vti"])
def test_a_disk_without_room(tmp_path, monkeypatch, name):
    """Every format is refused before it is written."""
    from trabecula.base import machine

    monkeypatch.setattr(machine, "free_disk", lambda folder: 5000.0)
    voxels = name.endswith(("npy", "vti"))
    made = SOLID.voxels(step=0.25) if voxels else MESH
    with pytest.raises(ValueError, match="of disk space"):
        made.write(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_disk_without_room_is_known_before_the_work(tmp_path, monkeypatch):
    from trabecula.base import machine

    (tmp_path / "cube.toml").write_text(
        'schema = 1\nregion.box.size = [8, 8, 8]\n[lattice.a]\ncell = "gyroid"\npart = "sheet"\n'
        "map.affine.wavelength = 4\nlevel.fraction = 0.3\n"
    )
    MESH.write(tmp_path / "whole.stl")
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(machine, "free_disk", lambda folder: 500.0)
    worked = []
    monkeypatch.setattr(lt.Solid, "voxels", lambda *_, **__: worked.append("voxels"))
    monkeypatch.setattr(lt.Mesh, "simplified", lambda *_, **__: worked.append("simplified"))
    for words in (["voxels", "cube.toml", "-o", "a.vti"], ["simplify", "whole.stl", "-o", "a.stl", "--triangles", "100"]):
        in_process(*(tmp_path / w if "." in w else w for w in words), status=1)
    assert not worked and sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("kind", ["stl", "3mf", "ply", "obj"])
def test_sizes_of_files(tmp_path, kind):
    """The estimate is right to a third, and seldom too small."""
    from trabecula.base.machine import file_size

    mesh = SOLID.mesh(edge=0.2)
    mesh.write(tmp_path / f"a.{kind}")
    vertices, triangles = mesh.counts
    share = (tmp_path / f"a.{kind}").stat().st_size / file_size(kind, triangles, vertices)
    assert 0.6 < share < 1.05, share
