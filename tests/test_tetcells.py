"""Tetrahedral cells through the Python door and the command."""

import json
import subprocess
import sys
import warnings

import numpy as np
import pytest
import trabecula as lt


def design(cell=None, part="lower", level=None, region=None, **keys):
    lattice = lt.Lattice(
        cell=cell or lt.cell.tet("diamond"),
        part=part,
        map=lt.map.tets(**({"size": 4} | keys)),
        level=level or lt.level.fraction(0.25),
    )
    return lt.Design(region=region or lt.region.sphere(radius=8), lattice={"a": lattice})


def test_a_part_is_closed_whole_and_as_full_as_asked():
    solid = design().build()
    report = solid.report()
    ball = 4 / 3 * np.pi * 8**3
    assert report["region"]["volume"] == pytest.approx(ball, rel=1e-12)
    # Flat tetrahedra leave out a tenth; bent onto the ball they fill it, and the level makes up for what that changes.
    lattice = report["lattices"]["a"]
    assert lattice["tets"]["volume"] < 0.95 * ball and lattice["fraction"] == pytest.approx(0.25, abs=5e-4)
    mesh = solid.mesh(edge=0.25)
    assert mesh.closed and mesh.pieces == 1
    # Whatever the steps: sampling the level costs 2e-3, chords of the ball (edge / 2R)² = 6e-4 at most.
    for edge in (0.25, 0.4):
        assert solid.mesh(edge=edge).volume == pytest.approx(0.25 * ball, rel=3e-3)
    # Caps have their corners between points of the ball, less than twice an edge apart: (2 · edge)² / 8R.
    ends = np.unique(mesh.triangles[mesh.cut])
    assert np.abs(np.linalg.norm(mesh.vertices[ends], axis=1) - 8).max() < 0.5**2 / 64
    assert solid.field(np.array([[20.0, 0, 0]]))[0] > 0


def test_the_stream_is_the_same_surface(tmp_path):
    solid = design(level=lt.level.fraction(lt.grade.linear([0, 0, 1], {-8: 0.15, 8: 0.4}))).build()
    reported = solid.save(tmp_path / "a.stl", edge=0.4)
    mesh = solid.mesh(edge=0.4)
    back = lt.Mesh.read(tmp_path / "a.stl")
    assert reported["triangles"] == len(mesh.triangles) == len(back.triangles)
    assert back.closed and back.pieces == mesh.pieces == reported["pieces"]
    assert reported["volume"] == pytest.approx(mesh.volume, rel=1e-12)


def test_overlapping_cells_are_told_as_they_are_made():
    """A fraction within 0.002, the pieces, and creases before and after; by both methods one solid."""
    cell, keys = lt.cell.tet("primitive"), {"level": lt.level.fraction(0.5), "overlap": 0.2}
    solid = design(cell, **keys).build()
    reported = solid.report().lattices["a"]
    mesh, grid = solid.mesh(edge=reported.tets.edge / 24), design(cell, method="implicit", **keys).build()
    by_grid = grid.report().lattices["a"].tets
    assert (reported.tets.method, by_grid.method) == ("explicit", "implicit")
    assert reported.tets.pieces == mesh.pieces == by_grid.pieces == 1
    assert reported.fraction == pytest.approx(0.5, abs=0.002)
    # Second order in 24 steps.
    assert mesh.solid_fraction == pytest.approx(0.5, abs=0.005)
    assert grid.mesh(edge=reported.tets.edge / 16).volume == pytest.approx(mesh.volume, rel=0.02)
    assert reported.tets.creases.mean > 10 > 0.05 > reported.tets.creases.smoothed


def test_crumbs_between_lattice_and_skin_are_closed():
    """Voids smaller than a grid cell, where struts nearly touch the skin, are filled and counted unless all is kept."""
    lattice = lt.Lattice(cell=lt.cell.tet("diamond"), part="lower", map=lt.map.tets(size=5), level=lt.level.fraction(0.25))
    solid = lt.Design(region=lt.region.sphere(radius=12), lattice={"a": lattice}, skin=lt.skin(0.8)).build()
    edge = 0.35
    kept, mesh = solid.mesh(edge=edge, islands="keep"), solid.mesh(edge=edge)
    crumbs = [v.volume for v in kept.voids if v.volume < edge**3]
    assert len(crumbs) == mesh.islands.filled > 0 and kept.islands.filled == 0
    assert mesh.islands.filled_volume == pytest.approx(sum(crumbs), rel=1e-6)
    assert mesh.cavities == kept.cavities - len(crumbs) == 1 and mesh.closed
    assert mesh.volume == pytest.approx(kept.volume + sum(crumbs), rel=1e-9)


def test_skins_join_by_the_implicit_method():
    lattice = lt.Lattice(cell=lt.cell.tet("diamond"), part="lower", map=lt.map.tets(size=6), level=lt.level.fraction(0.25))
    plain = lt.Design(region=lt.region.sphere(radius=6), lattice={"a": lattice}).build()
    skinned = lt.Design(region=lt.region.sphere(radius=6), lattice={"a": lattice}, skin=lt.skin(0.8)).build()
    edge = 0.3
    thin, thick = plain.mesh(edge=edge), skinned.mesh(edge=edge)
    assert thick.closed and thick.pieces == 1
    # The skin alone has the share 1 - (1 - 0.8 / 6)^3 of a ball, 0.35.
    assert thick.volume > thin.volume + 0.2 * plain.report()["lattices"]["a"]["tets"]["volume"]


def test_own_cells_equal_the_ready_ones():
    facts = lt.cell.tet_facts("f43m")
    terms = [lt.cell.term(t["hkl"], t["amplitude"], component=t["component"]) for t in facts["terms"]]
    mine = lt.cell.tet(group=216, terms=terms, site=facts["site"], dual=True, edge=facts["edge"])
    ready = design(lt.cell.tet("f43m")).build().report()["lattices"]["a"]
    own = design(mine).build().report()["lattices"]["a"]
    assert own["iso"] == pytest.approx(ready["iso"], abs=1e-12)


@pytest.mark.parametrize(
    ("cell", "word"),
    [
        (lt.cell.tet(group=214, terms=[lt.cell.term([1, 1, 0])], edge=1), "chiral"),
        (lt.cell.tet(group=230, terms=[lt.cell.term([2, 1, 1])], edge=1), "glides"),
        (lt.cell.tet(group=221, terms=[lt.cell.term([1, 0, 0])], site=[0.25, 0.25, 0.25], edge=1), "no point of full"),
        (lt.cell.tet(group="227:2", terms=[lt.cell.term([1, 0, 0])], edge=1), "absent"),
        (lt.cell.tet(group=221, terms=[lt.cell.term([1, 0, 0])], edge=0), "edge of the tetrahedron"),
        ("gyroid", "tetrahedral"),
        (lt.cell.tet("diamnd"), "diamond"),
        (lt.cell.tet(zones={1: "diamond"}), "its zones are 0"),
    ],
)
def test_cells_that_do_not_fit_are_refused_with_the_reason(cell, word):
    with pytest.raises(lt.DesignError) as error:
        design(cell).build()
    assert word in str(error.value)


def test_a_cell_that_falls_apart_is_warned_of():
    solid = design(lt.cell.tet("primitive"), part="sheet", level=lt.level.iso(0.6)).build()
    assert any("4 pieces" in w["message"] and "3 ports" in w["message"] for w in solid.report()["warnings"])


def test_the_command_lists_them():
    def run(*args):
        done = subprocess.run([sys.executable, "-m", "trabecula", "cells", "--tet", *args], capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    code, out, _ = run("--json")
    cells = json.loads(out)
    assert code == 0 and len(cells) >= 14
    assert {str(c["group"]).split(":")[0] for c in cells} == {"215", "216", "217", "221", "224", "225", "227", "229"}
    assert {c["part"] for c in cells} == {"sheet", "lower"}
    for c in cells:
        assert any(a < c["fraction"] < b for a, b in c["connected_fraction"][c["part"]]), c["name"]
        assert c["ports"] > 0
    assert "one piece that reaches all faces" in run("diamond")[1]
    code, _, words = run("dimond")
    assert code == 1 and "diamond" in words


def test_zones_pass_into_each_other_and_keep_the_fraction():
    """Zones by region on the background mesh: distinguished, one piece, and as full as asked, also between them."""
    half = lt.region.halfspace(point=[0, 0, 0], normal=[1, 0, 0])
    solid = design(lt.cell.tet(zones={0: "p43m", 1: "f43m"}), level=lt.level.fraction(0.3), zones={1: half}).build()
    report = solid.report()["lattices"]["a"]
    zones = report["tets"]["zones"]
    assert [z["cell"] for z in zones.values()] == ["p43m", "f43m"]
    assert sum(z["count"] for z in zones.values()) == report["tets"]["count"]
    # Levels settle until the tetrahedra about each node are within 0.001.
    assert report["fraction"] == pytest.approx(0.3, abs=2e-3)
    for zone in zones.values():
        assert zone["finished_fraction"] == pytest.approx(0.3, abs=0.01)
    mesh = solid.mesh(edge=0.2)
    assert mesh.closed and mesh.pieces == 1
    # Second order in the steps of the surface, of which there are twenty to an edge.
    assert mesh.solid_fraction == pytest.approx(0.3, rel=0.02)
    far = lt.region.box(size=[1, 1, 1], center=[50, 0, 0])
    with pytest.raises(lt.DesignError, match="no tetrahedron's middle"):
        design(lt.cell.tet(zones={0: "iwp", 1: "diamond"}), zones={1: far}).build()
    with pytest.raises(lt.DesignError, match="which has no cell"):
        design(lt.cell.tet(zones={0: "iwp"}), zones={1: half}).build()


def test_zones_that_do_not_join_are_told_before_a_surface_is_made():
    half = lt.region.halfspace(point=[0, 0, 0], normal=[1, 0, 0])

    def built(one, other):
        return design(lt.cell.tet(zones={0: one, 1: other}), level=lt.level.fraction(0.3), zones={1: half}).build()

    solid = built("p43m", "f43m")
    tets = solid.report()["lattices"]["a"]["tets"]
    (join,) = tets["joins"]
    assert join["zones"] == [0, 1] and join["joined"] and 0 < join["open"] <= join["faces"] and join["ports"] > 0
    # As many steps as the pieces are counted in.
    assert tets["pieces"] == solid.mesh(edge=tets["edge"] / 16).pieces == 1
    with pytest.warns(lt.DesignWarning, match=r"zones 0 \(pn3m\) and 1 \(diamond\) do not join"):
        solid = built("pn3m", "diamond")
    tets = solid.report()["lattices"]["a"]["tets"]
    # Several pieces are counted again in finer steps.
    assert not tets["joins"][0]["joined"] and tets["pieces"] > 1
    assert tets["pieces"] == solid.mesh(edge=tets["edge"] / 48).pieces
    # Without zones the pieces are reported too.
    assert design().build().report()["lattices"]["a"]["tets"]["pieces"] == 1


def test_a_single_tetrahedron_sharp_or_smooth():
    """Equation 9 of the paper with unit normals draws back from edges and corners, so it takes some of the volume."""
    corners = [[5, 5, 5], [5, -5, -5], [-5, 5, -5], [-5, -5, 5]]

    def volume(**keys):
        region = lt.region.tetrahedron(corners, **keys)
        return lt.TetMesh.of({"region": region, "lattice": {"a": {"map": lt.map.tets(size=0.8)}}}).volume

    exact = 10**3 / 3
    # What the mesh may miss at edges and corners, as it does with the angles of any region.
    assert volume() == pytest.approx(exact, rel=5e-3)
    assert 0.5 * exact < volume(sharpness=1.0) < volume(sharpness=4.0) < exact
    cell = lt.Lattice(cell="gyroid", part="lower", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.5))
    solid = lt.Design(region=lt.region.tetrahedron(corners, sharpness=4.0), lattice={"a": cell}).build()
    # An edge's middle is on two planes, ln(2)/k outside the smooth one, and the other two are as good as nowhere.
    assert solid.field([[5.0, 0.0, 0.0]])[0] == pytest.approx(np.log(2) / 4, rel=1e-9)
    assert solid.mesh(edge=0.4).closed
    with pytest.raises(lt.DesignError, match="nothing is left"):
        volume(sharpness=0.1)
    with pytest.raises(lt.DesignError, match="corners: expected a list of four"):
        lt.Design(region=lt.region.tetrahedron(corners[:3]), lattice={"a": cell}).build()


@pytest.mark.parametrize("surface", ["net", "rounded"])
def test_ends_at_the_surface_count_in_the_fraction(surface):
    plain, solid = design().build(), design(surface=surface).build()
    reported = solid.report().lattices["a"]
    # On a grid chords cost of second order in its twenty steps, some per cent of the walls.
    mesh = solid.mesh(edge=reported.tets.edge / 20)
    assert mesh.closed and mesh.pieces == 1
    assert reported.fraction == pytest.approx(0.25, abs=1e-3) and mesh.solid_fraction == pytest.approx(0.25, abs=5e-3)
    assert reported.tets.surface == surface and 0.1 < min(reported.tets.end_radius) < max(reported.tets.end_radius) < 2
    # Every triangle has one port of the cell, and what the rods leave open is less than the largest of them.
    net = reported.tets.net
    assert (
        net is None if surface == "rounded" else net.ports == reported.tets.mesh.quality.boundary_triangles and net.untied == 0
    )
    cut = mesh.measure()["area_cut"] / plain.mesh(edge=reported.tets.edge / 20).measure()["area_cut"]
    # Of half balls nothing but points is on the surface; a net covers more of it than the ports that it ties.
    assert cut < 0.05 if surface == "rounded" else cut > 2


def test_a_net_may_be_on_a_part_of_the_surface():
    above = lt.region.halfspace(point=[0, 0, 0], normal=[0, 0, -1])
    solid = design(surface="net", net={"radius": 0.5, "on": above}).build()
    assert solid.report().lattices["a"].tets.end_radius == 0.5
    mesh = solid.mesh(edge=0.25)
    middles = mesh.vertices[mesh.triangles[mesh.cut]].mean(axis=1)[:, 2]
    corners = mesh.vertices[mesh.triangles[mesh.cut]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas[middles > 1].sum() > 2 * areas[middles < -1].sum()
    for keys, words in (
        ({"surface": "rounded", "net": {"radius": 1}}, 'a net needs surface = "net", found "rounded"'),
        ({"surface": "net", "net": {"on": lt.region.sphere(radius=2)}}, "no triangle of the mesh's boundary has its middle"),
        ({"surface": "net", "net": {"radius": 6}}, "make up"),
        ({"surface": "nets"}, 'did you mean "net"'),
    ):
        with pytest.raises(lt.DesignError, match=words):
            design(**keys).build()


def test_open_ends_are_open_in_files(tmp_path):
    solid = design(surface="open").build()
    assert solid.open_ends and not design().build().open_ends and solid.mesh(edge=0.4).closed
    (tmp_path / "a.toml").write_text(design(surface="open").to_toml())
    run = [sys.executable, "-m", "trabecula", "mesh", tmp_path / "a.toml", "-o", tmp_path / "a.stl", "--edge", "0.4", "--json"]
    reported = json.loads(subprocess.run(run, capture_output=True, text=True, check=True).stdout)
    assert reported["open"] and not lt.Mesh.read(tmp_path / "a.stl").closed
    made = solid.save(tmp_path / "b.stl", edge=0.4)
    assert (tmp_path / "b.stl").read_bytes() == (tmp_path / "a.stl").read_bytes() and made.volume == reported["volume"]
    with pytest.raises(ValueError, match="ends are open"):
        solid.save(tmp_path / "c.stl", edge=0.4, resume=True)
    with pytest.raises(ValueError, match="a lattice over tetrahedra"):
        solid.save_implicit(tmp_path / "c.3mf")
    assert not (tmp_path / "c.3mf").exists()


def test_a_region_cuts_a_mesh_that_is_not_one_of_it(tmp_path):
    """Tetrahedra of a box about a ball: the ball cuts them; of the ball itself they are bent onto it."""
    block = lt.Design(region=lt.region.box(size=[20, 20, 20]), lattice=design().lattice)
    lt.TetMesh.of(block).write(tmp_path / "box.vtu")
    lt.TetMesh.of(design()).write(tmp_path / "ball.vtu")
    ball = 4 / 3 * np.pi * 8**3
    for name, whole in (("box", False), ("ball", True)):
        cell, level = lt.cell.tet("diamond"), lt.level.fraction(0.25)
        lattice = lt.Lattice(cell=cell, part="lower", map=lt.map.tets(path=str(tmp_path / f"{name}.vtu")), level=level)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            solid = lt.Design(region=lt.region.sphere(radius=8), lattice={"a": lattice}).build()
            report = solid.report()
        assert any("is not a mesh of this region" in w["message"] for w in report["warnings"]) != whole, said
        assert report["region"]["volume"] == pytest.approx(ball, rel=1e-9)
        mesh = solid.mesh(edge=0.3)
        # Cells that are cut have another share than whole ones, some per cent on the whole.
        assert mesh.solid_fraction == pytest.approx(0.25, rel=0.02 if whole else 0.1)


def test_the_boundary_may_be_left_open(tmp_path):
    mesh = design().build().mesh(edge=0.4)
    opened = mesh.uncapped()
    assert mesh.closed and not opened.closed
    assert opened.area == pytest.approx(mesh.measure()["area_lattice"], rel=1e-12)
    # Every open edge is one of a cap.
    caps = mesh.triangles[mesh.cut]
    corners = {tuple(p) for p in mesh.vertices[caps.ravel()].tolist()}
    edges = np.sort(opened.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    found, times = np.unique(edges, axis=0, return_counts=True)
    assert (times == 1).any() and times.max() == 2
    assert all(tuple(p) in corners for p in opened.vertices[found[times == 1].ravel()].tolist())
    mesh.write(tmp_path / "a.stl")
    with pytest.raises(ValueError, match="within"):
        lt.Mesh.read(tmp_path / "a.stl").uncapped()


@pytest.mark.parametrize("edge", [0.5, 0.3])
@pytest.mark.parametrize("surface", ["net", "rounded"])
@pytest.mark.parametrize(
    "width, turned, at, leaning, tilted, sloped",
    [
        (0.3, 7, 5, 20, 10, 14),
        # Both surfaces of the sheet cross grid edges just where an edge of the groove does.
        (0.424031748758227, 19.69035475438495, 4.180124258059419, 15.1586283666785, 4.007582171979511, 7.584921587243051),
    ],
)
def test_tiny_tetrahedra_at_fine_features_break_no_guarantee(
    tmp_path, surface, edge, width, turned, at, leaning, tilted, sloped
):
    """A groove far finer than the cells: some tetrahedra are fifty times as steep as most, on grids that resolve neither."""
    manifold3d = pytest.importorskip("manifold3d")
    block = manifold3d.Manifold.cube((20, 14, 8))
    block -= manifold3d.Manifold.cube((30, width, 0.4)).rotate((0, 0, turned)).translate((-2, at, 7.7))
    block -= manifold3d.Manifold.cylinder(20, 1.2, 1.2, 24).rotate((leaning, tilted, 0)).translate((12, 7, -5))
    block -= manifold3d.Manifold.cube((30, 30, 10)).rotate((0, sloped, 0)).translate((-3, -3, 7.5))
    made = block.to_mesh()
    lt.Mesh.of(made.vert_properties[:, :3], made.tri_verts).write(tmp_path / "block.stl")
    cell, part, fraction = ("diamond", "lower", 0.25) if surface == "net" else ("diamond_sheet", "sheet", 0.12)
    core = lt.Lattice(lt.cell.tet(cell), part, lt.map.tets(size=4, surface=surface), {"fraction": fraction})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        mesh = lt.Design(lt.region.mesh(tmp_path / "block.stl"), core).build().mesh(edge=edge)
    assert mesh.closed and not mesh.defects and np.isfinite(mesh.vertices).all()


def test_layers_and_the_surface_have_one_fraction(tmp_path):
    """On few, much bent tetrahedra, where the surface is made in each by itself, and everything else by position."""
    asked = 0.25 * 4 / 3 * np.pi * 10**3
    for size in (10, 6):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", lt.DesignWarning)
            solid = design(region=lt.region.sphere(radius=10), size=size).build()
            surface, layers = solid.mesh(edge=0.2).volume, solid.layers(0.25).save(tmp_path / "a.cli").volume
        # Levels are solved for by samples, to 0.001 of the part, and layers of 0.25 mm to a thousandth.
        assert surface == pytest.approx(asked, rel=5e-3) and layers == pytest.approx(asked, rel=8e-3)


def test_a_grid_too_coarse_for_the_fraction_is_warned_of():
    solid = design(region=lt.region.sphere(radius=10), size=5, method="implicit").build()
    # How many pieces finer steps leave is not known, so none is named.
    with pytest.warns(lt.DesignWarning, match=r"steps of 0\.6 mm are too coarse: .* piece; finer ones may join the pieces"):
        solid.mesh(edge=0.6)
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        assert solid.mesh(edge=0.2).volume == pytest.approx(0.25 * 4 / 3 * np.pi * 10**3, rel=0.01)


def test_the_spacing_resolves_walls_that_are_meshed_on_a_grid():
    solid = design(lt.cell.tet("diamond_sheet"), "sheet", region=lt.region.sphere(radius=10), size=6, surface="rounded").build()
    report = solid.report()
    assert report.spacing <= min(report.lattices["a"].thickness) / 2 * (1 + 1e-9)
