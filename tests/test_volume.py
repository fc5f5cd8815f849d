"""Volume meshes: angles, volume, conformity, sets, domains, periodic pairs."""

import re
import warnings

import numpy as np
import parts
import pytest
import trabecula as lt
from finite_elements import CORNERS, area_of, faces_of, solid, volumes


@pytest.mark.parametrize(
    "cell, part, fraction",
    [("gyroid", "sheet", 0.1), ("diamond", "sheet", 0.3), ("primitive", "lower", 0.3), ("iwp", "sheet", 0.6)],
)
def test_named_cells_have_angles_of_fifteen_to_150_degrees_and_their_volume(cell, part, fraction):
    figures = solid(cell, part, fraction).volume_mesh(per_cell=32, periodic=True).report()
    assert figures.min_angle >= 15 and figures.max_angle <= 150
    # At 32 edges a cell the chords' error, balanced, is below a tenth of this.
    assert abs(figures.volume / (64 * fraction) - 1) < 1e-4


def test_elements_are_positive_and_faces_are_shared_by_two_or_on_the_boundary(sheet):
    tets = sheet.elements
    assert (volumes(sheet.nodes, tets) > 0).all()
    faces = np.sort(np.concatenate([tets[:, f] for f in CORNERS]), axis=1)
    _, counts = np.unique(faces, axis=0, return_counts=True)
    on = np.concatenate([sheet.sets[name].faces for name in ("CUT", "LATTICE")])
    assert set(counts) == {1, 2} and (counts == 1).sum() == len(on)
    closed = sheet.boundary()
    assert closed.closed and abs(closed.volume - sheet.volume) < 1e-9


@pytest.mark.parametrize(
    "cell, part, fraction, radius, edges",
    [
        ("diamond", "upper", 0.2757973616695506, 3.6772081179549656, 10),
        ("iwp", "upper", 0.39225185201957147, 2.824133242340237, 10),
    ],
)
def test_boundaries_of_coarse_meshes_are_manifold(cell, part, fraction, radius, edges):
    """A collapse would join two edges of the boundary without a common face: found among random designs."""
    made = coarse(cell, part, fraction, radius).volume_mesh(per_cell=edges)
    assert made.boundary().defects == []


def test_flat_tetrahedra_at_sharp_edges_are_shelled_off():
    """Where lattice and ball meet at a sharp angle there were angles of 4.7 and 173 degrees; a few tetrahedra are left out."""
    made = coarse("frd", "upper", 0.425050775134174, 3.953704026284279).volume_mesh(per_cell=10)
    figures = made.report()
    assert figures.min_angle > 14 and figures.max_angle < 160 and made.boundary().defects == []
    assert 0 < figures.dropped < 10 * figures.volume / figures.elements


def test_sheets_that_nearly_touch_are_not_shifted_through_each_other():
    """8 pairs of boundary triangles crossed, of which a warning said so."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*boundary triangles cross", category=lt.DesignWarning)
        coarse("gyroid", "lower", 0.31719099926265243, 3.2541060728788698).volume_mesh(per_cell=10)


@pytest.mark.parametrize("zones", [41, 42])
def test_more_surfaces_than_a_node_can_know_are_refused(tmp_path, zones):
    """Of a mesh with feature edges, too, whose patches are surfaces as well."""
    parts.write(tmp_path / "block.obj", parts.box())
    keep = {
        f"k{i}": lt.region.cylinder(base=[-5 + i % 7 * 1.6, -5 + i // 7 * 1.6, -7], radius=0.3, height=14) for i in range(zones)
    }
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=12), lt.level.fraction(0.5))
    design = lt.Design(region=lt.region.mesh(path=str(tmp_path / "block.obj")), lattice=core, keep=keep)
    if zones == 42:
        with pytest.raises(ValueError, match="the design has 129 surfaces; a volume mesh takes at most 127"):
            design.build().volume_mesh(edge=1.2)
    else:
        assert design.build().volume_mesh(edge=1.2).volume > 0


def coarse(cell, part, fraction, radius):
    """A ball whose lattice is turned and grows denser."""
    dense = lt.grade.linear(along=[0, 0, 1], stops=[[-3, fraction], [3, min(0.7, 1.8 * fraction)]])
    turned = lt.map.affine(wavelength=4, rotate=[10, 20, 30])
    lattice = lt.Lattice(cell, part, turned, lt.level.fraction(dense))
    return lt.Design(region=lt.region.sphere(radius=radius), lattice={"core": lattice}).build()


def test_the_boundary_is_as_far_from_the_surface_as_reported():
    made = solid()
    mesh = made.volume_mesh(per_cell=24)
    at = mesh.nodes[faces_of(mesh, mesh.sets["LATTICE"].faces)].mean(axis=1)
    step = 1e-5
    slope = [(made.field(at + step * e) - made.field(at - step * e)) / (2 * step) for e in np.eye(3)]
    distance = np.abs(made.field(at)) / np.linalg.norm(slope, axis=0)
    # The core's distance has exact gradients, this one central differences.
    assert distance.max() <= mesh.report().deviation * 1.001 and mesh.report().deviation < 0.05 * 4 / 24


def test_planes_are_exact_and_their_sets_are_whole(sheet):
    for axis, name in enumerate("XYZ"):
        for side, at in (("0", 0.0), ("1", 4.0)):
            members = sheet.sets[name + side]
            assert (sheet.nodes[members.nodes, axis] == at).all()
            assert set(np.unique(faces_of(sheet, members.faces))) == set(members.nodes)
            assert set(members.elements) == set(members.faces[:, 0])
    area = {n: area_of(sheet, n) for n in ("X0", "X1")}
    assert area["X0"] == pytest.approx(area["X1"], rel=1e-12) and area["X0"] > 1


def test_periodic_pairs_agree_in_every_bit(sheet):
    node, image, along = sheet.pairs[:, 0], sheet.pairs[:, 1], sheet.pairs[:, 2:].astype(bool)
    assert len(set(node)) == len(node) and not set(node) & set(image)
    here, there = sheet.nodes[node], sheet.nodes[image]
    assert (here[~along] == there[~along]).all()
    assert (here[along] == 4).all() and (there[along] == 0).all()
    upper = np.unique(np.concatenate([sheet.sets[n].nodes for n in ("X1", "Y1", "Z1")]))
    assert set(upper) == set(node)
    to = dict(zip(node.tolist(), image.tolist(), strict=True))
    for axis in "XYZ":
        low, high = (faces_of(sheet, sheet.sets[axis + side].faces) for side in "01")

        def named(faces):
            return {tuple(sorted(to.get(n, n) for n in f)) for f in faces.tolist()}

        assert named(low) == named(high)


def test_quadratic_elements_follow_the_surface():
    figures = {order: solid().volume_mesh(per_cell=16, order=order).report() for order in (1, 2)}
    assert figures[2].deviation < figures[1].deviation / 10
    mesh = solid().volume_mesh(per_cell=16, order=2, periodic=True)
    assert mesh.elements.shape[1] == 10 and mesh.report().straight < 0.01 * mesh.report().elements
    # Nodes of faces have the true surface: the volume converges as the fourth power of the edge.
    assert abs(mesh.volume / 19.2 - 1) < 1e-4
    assert set(mesh.pairs[:, 0]) == set(np.concatenate([mesh.sets[n].nodes for n in ("X1", "Y1", "Z1")]))


def test_wall_and_both_fluids_fill_the_region_with_common_nodes():
    mesh = solid().volume_mesh(per_cell=16, of="all")
    assert mesh.domains == ["WALL", "LOWER", "UPPER"] and abs(mesh.volume - 64) < 1e-9
    figures = mesh.report()
    assert figures.domains["LOWER"].volume == pytest.approx(figures.domains["UPPER"].volume, rel=1e-3)
    made = solid()
    for name, sign in (("WALL", -1), ("LOWER", 1), ("UPPER", 1)):
        assert np.sign(made.field([figures.domains[name].inside])[0]) == sign
    tets = mesh.elements
    faces = np.sort(np.concatenate([tets[:, f] for f in CORNERS]), axis=1)
    domain = np.tile(mesh.domain, 4)
    _, place = np.unique(faces, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    same = place.ravel()[order][1:] == place.ravel()[order][:-1]
    pairs = np.stack([domain[order][:-1][same], domain[order][1:][same]], axis=1)
    # A sheet lies between the two fluids: they never touch.
    assert not ({(1, 2), (2, 1)} & {tuple(p) for p in np.unique(pairs, axis=0).tolist()})
    assert (pairs[:, 0] != pairs[:, 1]).sum() == len(mesh.sets["LATTICE"].faces)


def test_the_pore_of_a_part_with_a_skin_has_its_wall_in_a_set(tmp_path):
    made = solid(region=lt.region.cylinder(base=[0, 0, -2], radius=3, height=4), skin=lt.skin(0.5, open=["+z"]))
    mesh = made.volume_mesh(edge=0.25, of="pore")
    on = np.concatenate([mesh.sets[name].faces for name in ("CUT", "LATTICE", "SKIN")])
    tets = np.sort(np.concatenate([mesh.elements[:, f] for f in CORNERS]), axis=1)
    _, counts = np.unique(tets, axis=0, return_counts=True)
    assert len(np.unique(on, axis=0)) == (counts == 1).sum()
    inner = mesh.nodes[mesh.sets["SKIN"].nodes]
    radius = np.hypot(inner[:, 0], inner[:, 1])
    # Nodes of curved surfaces are shifted by about half the distance of a chord, h² / 16 r.
    assert (np.isclose(radius, 2.5, atol=0.25**2 / 8 / 2.5) | np.isclose(inner[:, 2], -1.5)).all()
    mesh.write(tmp_path / "case.foam")
    assert "REST" not in (tmp_path / "constant" / "polyMesh" / "boundary").read_text()


@pytest.mark.parametrize("of", ["pore", "lower", "upper"])
def test_one_side_alone(of):
    mesh = solid().volume_mesh(per_cell=16, of=of)
    share = 0.7 if of == "pore" else 0.35
    assert mesh.volume == pytest.approx(64 * share, rel=1e-3)


def test_curved_regions_skins_and_keep_zones():
    keep = {"boss": lt.region.cylinder(base=[0, 0, -2], axis=[0, 0, 1], radius=1, height=4)}
    made = solid(region=lt.region.cylinder(base=[0, 0, -2], radius=3, height=4), skin=lt.skin(0.5), keep=keep)
    mesh = made.volume_mesh(edge=0.25)
    figures = mesh.report()
    assert figures.min_angle >= 12 and figures.max_angle <= 160 and mesh.boundary().closed
    expected = made.mesh(edge=0.1).volume
    assert mesh.volume == pytest.approx(expected, rel=1e-3)
    boss = mesh.sets["KEEP_boss"]
    middle = mesh.nodes[mesh.elements[boss.elements]].mean(axis=1)
    assert np.hypot(middle[:, 0], middle[:, 1]).max() < 1 and {"SKIN", "Z0", "Z1", "CUT", "LATTICE"} <= set(mesh.sets)


def test_flat_faces_of_a_mesh_at_its_bounds_are_sets(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box([8, 8, 8]).export(tmp_path / "block.obj")
    region = lt.region.mesh(str(tmp_path / "block.obj"))
    part = lt.Lattice("primitive", "lower", lt.map.affine(4), lt.level.fraction(0.5))
    mesh = lt.Design(region=region, lattice=part).build().volume_mesh(edge=0.8)
    own = solid("primitive", "lower", 0.5, lt.region.box([8, 8, 8])).volume_mesh(edge=0.8)
    for axis in range(3):
        for side, at in (("0", -4), ("1", 4)):
            name = "XYZ"[axis] + side
            assert np.allclose(mesh.nodes[faces_of(mesh, mesh.sets[name].faces)][..., axis], at, atol=1e-5)
            # The cut of the lattice by the plane is that of a box, within the squares of chords.
            assert area_of(mesh, name) == pytest.approx(area_of(own, name), rel=0.03)


def test_what_is_left_out_and_far_from_the_surface_is_warned_of(tmp_path):
    text = """
        schema = 1
        [region]
        difference = [
          { cylinder = { base = [0, 0, 0], radius = 8, height = 4 } },
          { cylinder = { base = [0, 0, -1], radius = 4, height = 6 } },
        ]
        [lattice.a]
        part = "lower"
        cell.tet.name = "iwp"
        map.tets.size = 4
        level.fraction = 0.3
    """
    (tmp_path / "ring.toml").write_text(text)
    part = lt.load(tmp_path / "ring.toml").build()
    with pytest.warns(lt.DesignWarning) as found:
        mesh = part.volume_mesh(edge=0.4)
    words = " ".join(str(w.message) for w in found)
    assert (
        mesh.report().dropped > 0.005 * mesh.report().volume and "is left out where the solid is thinner than an edge" in words
    )
    assert "mm off the surface" in words


def test_what_no_tetrahedron_has_seen_is_left_out_too():
    # Struts thinner than an edge: nearly half of them lie between the nodes.
    region = lt.region.box([8, 8, 8])
    part = lt.Lattice(cell=lt.cell.tet("pn3m_dual"), part="lower", map=lt.map.tets(size=4), level=lt.level.fraction(0.2))
    made = lt.Design(region=region, lattice=part).build()
    with pytest.warns(lt.DesignWarning) as found:
        mesh = made.volume_mesh(edge=0.8)
    (words,) = [str(w.message) for w in found if "left out" in str(w.message)]
    stated = float(words.split(" ", 1)[0])
    assert mesh.report().dropped < stated
    # Within the deviation of the sample.
    assert stated == pytest.approx(0.2 * 8**3 - mesh.volume, abs=0.02 * 0.2 * 8**3)


def test_a_size_that_nobody_gave_is_bounded(monkeypatch):
    part = solid("gyroid", "sheet", 0.3, lt.region.box([8, 8, 8]))
    full = part.volume_mesh()
    monkeypatch.setattr("trabecula.simulated.MOST_TETS", 2e4)
    with pytest.warns(lt.DesignWarning, match=r"an edge of .* mm is used: two edges through the thinnest wall .* give an edge"):
        fewer = part.volume_mesh()
    assert len(fewer.elements) < 0.6 * len(full.elements)


def test_the_same_bytes_for_any_number_of_threads():
    one, two = (solid(region=lt.region.sphere(radius=2.5)).volume_mesh(edge=0.25, threads=n) for n in (1, 3))
    assert one.nodes.tobytes() == two.nodes.tobytes() and one.elements.tobytes() == two.elements.tobytes()


@pytest.mark.parametrize(
    "asked, words",
    [
        ({"edge": 1.0}, "less than one tetrahedron through the thinnest wall"),
        ({"edge": 0.1, "wall": 2}, "give one of edge, per_cell and wall"),
        ({"edge": 1e-4}, "tetrahedra"),
        ({"order": 3}, "order is 3"),
        ({"of": "shell"}, 'of is "shell"'),
    ],
)
def test_refused_requests(asked, words):
    with pytest.raises(ValueError, match=words):
        solid().volume_mesh(**asked)


@pytest.mark.parametrize(
    ("part", "fraction", "wavelength", "region", "at"),
    [
        ("sheet", "0.15 + 0.002*((x - 1)^2 + (y + 2)^2 + z^2)", 4.0, lt.region.box([12, 12, 12]), (1, -2, 0)),
        # Outside the region it would be thinner still.
        ("lower", "0.45 + 0.02*x", 4.0, lt.region.sphere(radius=6), (-6, 0, 0)),
        ("upper", "0.5 - 0.02*z", 4.0, lt.region.box([20, 8, 8]), (0, 0, 4)),
    ],
)
def test_a_size_too_coarse_says_where_the_wall_is_thinnest(part, fraction, wavelength, region, at):
    """To the spacing of the places that are looked at, and the middle of those that are as thin but for 2 %."""
    level = lt.level.fraction(lt.grade.formula(fraction))
    made = lt.Design(region=region, lattice=lt.Lattice("gyroid", part, lt.map.affine(wavelength), level)).build()
    with pytest.raises(ValueError, match=r"at lattice\.core about \(.*\) mm; use") as refused:
        made.volume_mesh(edge=2.5)
    found = [float(v) for v in re.search(r"about \((.*)\) mm", str(refused.value))[1].split(", ")]
    assert found == pytest.approx(at, abs=1.0)


def test_a_wall_of_one_thickness_has_no_thinnest_place():
    with pytest.raises(ValueError, match=r"at lattice\.core; use"):
        solid().volume_mesh(edge=2.0)


def test_a_mesh_beyond_memory_says_how_much_and_a_size_that_fits(monkeypatch):
    """The same above the most tetrahedra that are possible; where memory is boundless that number is said."""
    part = solid("gyroid", "sheet", 0.3, lt.region.box([8, 8, 8]))
    monkeypatch.setattr("trabecula._core.free_memory", lambda: 1e9)
    said = r"needs about .* of memory for about .* tetrahedra, and 1 GB is free; try edge"
    for edge in (0.02, 0.001):
        with pytest.raises(ValueError, match=said) as no:
            part.volume_mesh(edge=edge)
        better = float(str(no.value).split()[-2])
        with pytest.raises(ValueError, match="needs about"):
            part.volume_mesh(edge=better / 1.2)
    monkeypatch.setattr("trabecula._core.free_memory", lambda: 1.0)
    with pytest.raises(ValueError, match="even the coarsest useful edge needs more: take a smaller part"):
        part.volume_mesh(edge=0.02)
    monkeypatch.setattr("trabecula._core.free_memory", lambda: None)
    with pytest.raises(ValueError, match=r"makes about .* tetrahedra; at most 3e\+08 are possible; try edge 0\.0"):
        part.volume_mesh(edge=0.001)


def test_periodic_is_refused_where_the_solid_is_not():
    with pytest.raises(ValueError, match="differs between X0 and X1"):
        solid(region=lt.region.box(min=[0, 0, 0], max=[3, 4, 4])).volume_mesh(per_cell=16, periodic=True)
    with pytest.raises(ValueError, match="a box"):
        solid(region=lt.region.sphere(radius=3)).volume_mesh(per_cell=16, periodic=True)
    with pytest.raises(ValueError, match="only sheets"):
        solid("primitive", "lower").volume_mesh(per_cell=16, of="upper")


# --- sets of the design, loads ----------------------------------------------------------------------------------------


def test_domains_of_order_2_have_the_volume_of_their_curved_elements():
    mesh = solid().volume_mesh(per_cell=12, order=2, periodic=True, of="all")
    figures = mesh.report()
    assert sum(d.volume for d in figures.domains.values()) == pytest.approx(figures.volume, rel=1e-12)
    wall = figures.domains["WALL"].volume
    straight = volumes(mesh.nodes, mesh.elements[mesh.domain == list(figures.domains).index("WALL"), :4]).sum()
    assert abs(wall / (0.3 * 64) - 1) < 0.1 * abs(straight / (0.3 * 64) - 1)  # curved edges: of higher order


def test_loose_components_are_dropped_or_refused():
    growing = lt.level.fraction(lt.grade.linear(along=[1, 0, 0], stops=[[-6, 0.15], [6, 0.55]]))
    cut = lt.Design(lt.region.box(size=[12, 8, 8]), lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=4), growing)).build()
    with pytest.warns(lt.DesignWarning, match="do not touch.*--islands drop"):
        all_of_it = cut.volume_mesh(per_cell=24)
    whole = cut.volume_mesh(per_cell=24, islands="drop")
    figures = whole.report()
    assert figures.pieces == 1 and figures.loose > 0
    assert whole.volume + figures.loose == pytest.approx(all_of_it.volume, abs=0.1 * figures.loose)  # chords, balanced or not
    with pytest.raises(ValueError, match="components that do not touch"):
        cut.volume_mesh(per_cell=24, islands="error")
    with pytest.raises(ValueError, match='islands is "drop"; of a periodic cell'):
        solid().volume_mesh(per_cell=12, periodic=True, islands="drop")


def test_keep_zones_are_walls_of_a_flow(tmp_path):
    design = lt.Design(
        lt.region.box(size=[8, 8, 8]),
        lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=4), lt.level.fraction(0.3)),
        keep={"bolt": lt.region.cylinder(base=[0, 0, -4], radius=1.5, height=8)},
    )
    design.build().volume_mesh(per_cell=12, of="pore").write(tmp_path / "case.foam")
    patches = (tmp_path / "constant" / "polyMesh" / "boundary").read_text()
    kinds = {
        name: patches.split(f"    {name}\n")[1].split("type")[1].split(";")[0].strip()
        for name in ("KEEP_bolt", "LATTICE", "X0")
    }
    assert kinds == {"KEEP_bolt": "wall", "LATTICE": "wall", "X0": "patch"}


@pytest.mark.parametrize("of", ["pore", "all"])
def test_all_of_a_keep_zones_wall_is_in_its_set(tmp_path, of):
    """The wall of a fluid at a round bolt that runs through the part: what the lattice leaves of the bolt's surface."""
    radius, height = 1.5, 8
    bolt = lt.region.cylinder(base=[0, 0, 0], radius=radius, height=height)
    design = lt.Design(
        lt.region.cylinder(base=[0, 0, 0], radius=5, height=height),
        lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=4), lt.level.fraction(0.3)),
        keep={"bolt": bolt},
    )
    solid = design.build()
    mesh = solid.volume_mesh(per_cell=12, of=of)
    faces = mesh.sets["KEEP_bolt"].faces
    walls = np.array([mesh.elements[e][[c for c in range(4) if c != k]] for e, k in faces])
    # Nodes are on the bolt but for what balances chords, far less than an edge of 4 / 12 mm.
    on = (np.abs(np.hypot(*np.moveaxis(mesh.nodes[walls], 2, 0)[:2]) - radius) < 0.1 * 4 / 12).all(axis=1)
    assert on.all() if of == "pore" else on.any()
    a, b, c = np.moveaxis(mesh.nodes[walls[on]], 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    turn, z = np.meshgrid((np.arange(720) + 0.5) * np.pi / 360, (np.arange(400) + 0.5) * height / 400)
    lattice = lt.Design(lt.region.cylinder(base=[0, 0, 0], radius=5, height=height), design.lattice).build()
    at = np.stack([1.0001 * radius * np.cos(turn), 1.0001 * radius * np.sin(turn), z], axis=-1)
    free = (lattice.field(at.reshape(-1, 3)) > 0).mean()
    assert area == pytest.approx(free * 2 * np.pi * radius * height, rel=0.01)
    if of == "pore":
        mesh.write(tmp_path / "case.foam")
        assert "REST" not in (tmp_path / "constant" / "polyMesh" / "boundary").read_text()
