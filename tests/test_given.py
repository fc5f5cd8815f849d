"""What Python callers give and keep: nothing follows later changes of it, wrong kinds are named, and forked processes work."""

import copy
import dataclasses
import multiprocessing
import pickle
import warnings

import numpy as np
import pytest
import trabecula as lt

BOX = lt.region.box([8, 8, 8])


def gyroid(fraction=0.3):
    return lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(fraction))


def volume(design):
    return design.build().report().region.volume


@pytest.fixture(scope="module")
def solid():
    return lt.Design(BOX, gyroid()).build()


def test_designs_keep_copies_of_what_they_are_given():
    size, designs = [8.0, 8.0, 8.0], []
    for height in (8.0, 12.0, 16.0):
        size[2] = height
        designs.append(lt.Design(lt.region.box(size), gyroid()))
    assert [volume(d) for d in designs] == pytest.approx([512, 768, 1024])
    region, keep = {"box": {"size": [8, 8, 8]}}, {"a": lt.region.sphere(radius=1)}
    design = lt.Design(region, {"core": gyroid()}, keep=keep)
    before = hash(design)
    region["box"]["size"][0], keep["b"] = 4, lt.region.sphere(radius=2)
    assert volume(design) == pytest.approx(512) and list(design.keep) == ["a"] and hash(design) == before
    nodes = np.array([[0.0, 0, 0], [5, 0, 0]])
    beams = lt.Beams(nodes=nodes, struts=[[0, 1]], radius=0.5)
    nodes *= 2
    assert lt.Design(lt.region.box([40, 40, 40]), beams=beams).build().quadors().volume() == pytest.approx(
        np.pi * 0.25 * 5 + 4 / 3 * np.pi * 0.125
    )


def test_designs_keep_copies_of_lattices_and_beams():
    lattice = gyroid()
    design = lt.Design(BOX, {"core": lattice})
    before = hash(design)
    lattice.map["affine"]["wavelength"] = 2
    assert hash(design) == before
    start = [0.0, 0, 0]
    beams = lt.Beams(nodes=(start, [5, 0, 0]), struts=((0, 1),), radius=0.5)
    start[0] = 3
    assert beams.to_dict()["nodes"][0] == [0, 0, 0]


def test_a_design_of_a_file_that_is_changed_is_what_it_says(tmp_path):
    file = tmp_path / "a.toml"
    lt.Design(BOX, gyroid()).save(file)
    design = lt.load(file)
    assert volume(design) == pytest.approx(512)
    design.region["box"]["size"][0] = 4.0
    assert volume(design) == volume(copy.copy(design)) == volume(pickle.loads(pickle.dumps(design))) == pytest.approx(256)
    assert "4.0" in design.to_toml() and design != lt.load(file)
    assert dataclasses.asdict(lt.load(file))["units"] == "mm"
    with pytest.raises(lt.DesignError, match="regoin"):
        file.write_text("schema = 1\nregoin = 3\n")
        lt.load(file)


def test_zones_have_their_numbers():
    number = next(iter(np.arange(1, 2)))
    half = lt.region.halfspace(point=[0, 0, 0], normal=[-1, 0, 0])
    built = {"cell": lt.cell.tet(zones={0: "p43m", number: "f43m"}), "map": lt.map.tets(size=3, zones={number: half})}
    plain = {"cell": {"tet": {"zones": {0: "p43m", number: "f43m"}}}, "map": {"tets": {"size": 3, "zones": {number: half}}}}
    more = {"part": "lower", "level": {"fraction": 0.3}}
    first, second = (lt.Design(BOX, {"core": given | more}) for given in (built, plain))
    assert first == second and set(second.lattice["core"]["cell"]["tet"]["zones"]) == {"0", "1"}
    assert second.build().report().lattices["core"].tets.zones
    for name in (None, 1.5, True):
        with pytest.raises(lt.DesignError, match="is no text"):
            lt.cell.tet(zones={name: "p43m"})


@pytest.mark.parametrize("name", [1, None, 1.5, True, (1, 2)])
def test_names_that_are_no_text_are_refused(name):
    with pytest.raises(lt.DesignError, match="is no text"):
        lt.Design(BOX, {name: gyroid()})


def test_arrays_and_sets_of_meshes_do_not_change(solid):
    made = [solid.volume_mesh(edge=0.35), solid.shell_mesh(edge=0.5), solid.voxel_elements(1.0)]
    for mesh in made:
        for array in (mesh.nodes, mesh.elements, getattr(mesh, "domain", mesh.nodes), next(iter(mesh.sets.values())).nodes):
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0
        with pytest.raises((TypeError, AttributeError)):
            mesh.sets.clear()
    law = lt.law("gyroid", "sheet", start=0.2, stop=0.3, count=2, n=8, properties=["area"])
    with pytest.raises(ValueError, match="read-only"):
        law.columns["area"][:] = 0


def test_reports_layers_and_laws_compare_and_print(solid):
    assert "bounds" in str(solid.conductivity(n=8))
    law = lt.law("gyroid", "sheet", start=0.2, stop=0.3, count=2, n=8, properties=["area"])
    assert law == law and law in [law] and law != 3
    layers = solid.layers(layer=1.0)
    one = layers[2]
    assert one == one and one in [one] and one != layers[3] and isinstance(hash(one), int)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.stiffness(n=8, C=np.eye(6), E=5), "give one of them"),
        (lambda s: s.mesh(edge=0.5, smooth="no"), "smooth must be True or False"),
        (lambda s: s.volume_mesh(periodic="no"), "periodic must be True or False"),
        (lambda s: s.volume_mesh(order=True), "order is True"),
        (lambda s: s.shell_mesh(order=True), "order is True"),
        (lambda s: s.field(np.array([[0, 0, 1j]])), "points must be real numbers"),
        (lambda s: s.field(np.ma.array([[0.0, 0, 0]], mask=[[1, 0, 0]])), "masked"),
        (lambda s: s.cell_at([[0, 0, 0]], lattice=0), "lattice must be the name"),
        (lambda s: s.layers(layer=1.0)["a"], "layer must be a whole number"),
        (lambda s: s.layers(layer=1.0).save("x.zip", pixel=0.1, size=(500, 500, 3)), "width and height"),
        (lambda s: s.voxels(step=0), "step is 0"),
        (lambda s: s.mesh(edge=0.5).png(lines=[[0, 0, 0]]), "lines must be polylines by name"),
        (lambda s: lt.write_parts("p.3mf", s.mesh(edge=0.5)), "parts must be meshes by name"),
        (lambda s: lt.write_parts("p.3mf", {"a": 3}), "parts must be meshes by name"),
        (
            lambda s: lt.objective(lt.Design(BOX, gyroid()), ["lattice.core.level.fraction"], ["volume_mm3"])([0.3]),
            "path: value",
        ),
        (lambda s: lt.objective(lt.Design(BOX, gyroid()), [], [], properties={"stiffness": {"q": 1}}), 'no setting "q"'),
    ],
)
def test_wrong_kinds_are_named(call, words, solid):
    with pytest.raises((TypeError, ValueError), match=words):
        call(solid)


def meshed(fraction):
    return lt.Design(BOX, gyroid(fraction)).build().mesh(edge=0.5).volume, lt.iso("gyroid", fraction)


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no forks here")
def test_forked_processes_have_threads_of_their_own(solid):
    expected = [meshed(0.2), meshed(0.3)]
    context = multiprocessing.get_context("fork")
    with context.Pool(2) as pool:
        assert pool.map_async(meshed, [0.2, 0.3]).get(timeout=60) == expected


def test_voxels_beyond_plane_faces_are_warned_of(solid):
    with pytest.warns(
        lt.DesignWarning, match=r"voxels of 0.17 mm reach beyond .*6.1 % too large; use a step .* such as 0.166667 mm"
    ):
        coarse = solid.voxels(step=0.17)
    assert coarse.volume > 1.04 * 0.3 * 512
    wide = lt.Design(lt.region.box([8, 8, 10.1]), gyroid()).build()
    with pytest.warns(lt.DesignWarning, match=r"10.5 mm along one of 10.1 mm: .* use a smaller step"):
        wide.voxels(step=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wide.voxels()
        # Sampled at places that are alike in every cell: 2 % off, by chance either way.
        assert solid.voxels(step=8 / 48).volume == pytest.approx(0.3 * 512, rel=0.03)
