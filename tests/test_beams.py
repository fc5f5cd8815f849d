"""Beams through every door: the catalogue, graphs, radii, trimming, patterns, and what is refused."""

import json
import math
import subprocess
import sys
import warnings

import numpy as np
import pytest
import trabecula as lt

BOX = lt.region.box(min=[0, 0, 0], max=[10, 10, 10])
SQUARE = [[1, 1, 5], [9, 1, 5], [9, 9, 5], [1, 9, 5]]
RING = [[0, 1], [1, 2], [2, 3], [3, 0]]


def built(region=BOX, **beams):
    """The solid of beams in a region, its warnings kept in it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return lt.Design(region=region, beams=lt.Beams(**beams)).build()


def reported(solid):
    """The report of the beams named core."""
    return solid.report()["beams"]["core"]


def share(solid, n=60):
    """The solid share of the box, by a sample anywhere in each of n³ cubes."""
    low, high = map(np.array, solid.bounds)
    at = np.arange(n) / n
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(7).uniform(0, 1 / n, points.shape)
    return np.count_nonzero(solid.field(low + points * (high - low)) <= 0) / n**3


# For equal cylinders of radius x in a cell of edge 1: fraction = π x² ΣL − c x³, c by integrating the start of each cylinder
# round its rim (a polygon's perimeter for each), as long as no two overlap at mid length.
CLOSED = {
    "sc": 8 * math.sqrt(2),
    "bcc": 16 * math.sqrt(6),
    "octet": 64 * (1 + math.sqrt(2)),
    "diamond": 16 * math.sqrt(6),
    "kelvin": 12 * 5.0283148884,
    "rhombic_dodecahedron": 48 * math.sqrt(6),
}


@pytest.mark.parametrize("cell", CLOSED)
def test_fractions_are_those_of_the_closed_form(cell):
    """A cube on the surface is in or out by chance, and there are thousands: ours is good to a few parts in a thousand."""
    total = lt.beams.cell(cell)["length"]
    for x in (0.05, 0.08, 0.12):
        found = share(built(cell=cell, map=lt.map.affine(wavelength=10), radius=10 * x))
        assert found == pytest.approx(math.pi * total * x**2 - CLOSED[cell] * x**3, rel=0.01), x


def test_the_closed_form_of_equal_cylinders_is_met():
    """V = π x² ΣL − c x³; a mesh of 50 steps a cell is good to a few parts in a thousand."""
    solid = built(cell="octet", map=lt.map.affine(wavelength=10), radius=0.5)
    mesh = solid.mesh(edge=0.2)
    x = 0.05
    exact = 12 * math.sqrt(2) * math.pi * x**2 - 64 * (1 + math.sqrt(2)) * x**3
    assert mesh.volume / 1000 == pytest.approx(exact, rel=5e-3)
    assert mesh.closed and mesh.self_intersections == 0 and mesh.pieces == 1


@pytest.mark.parametrize("cell", [it["name"] for it in lt.beams.cells()])
def test_every_cell_fills_a_region(cell):
    """Nodes well inside have the valence of the cell, the field is solid on beams and open in the middle of nothing."""
    wave = [4 * v for v in lt.beams.cell(cell)["aspect"]]
    solid = built(cell=cell, map=lt.map.affine(wavelength=wave, rotate=[5, 6, 7]), radius=0.12)
    report = reported(solid)
    known = lt.beams.cell(cell)["valence"]
    assert set(report["valence"]) <= {str(v) for v in known}
    assert 0.001 < report["fraction"] < 0.3
    graph = solid.beams["core"]
    ends = graph["centers"][graph["struts"]]
    middles = ends.mean(axis=1)
    inside = np.all((middles > 0.1) & (middles < 9.9), axis=1)
    assert np.all(solid.field(middles[inside]) < 0)


def test_a_fraction_gives_the_radius_for_which_it_is_known():
    """Equal cylinders along the edges of a cube: 3 pi r² a - 8 sqrt(2) r³; and the share of a region that cuts a frame."""
    a, r = 5, 0.7
    fraction = (3 * np.pi * r**2 * a - 8 * np.sqrt(2) * r**3) / a**3
    solid = built(cell="sc", map=lt.map.affine(wavelength=a), fraction=fraction)
    assert reported(solid)["solved_radius"] == pytest.approx(r, rel=1e-9)
    frame = built(nodes=SQUARE, struts=RING, fraction=0.03, fillet="auto")
    again = built(nodes=SQUARE, struts=RING, radius=reported(frame)["solved_radius"], fillet="auto")
    assert reported(again)["fraction"] == pytest.approx(0.03, rel=1e-9) and reported(again)["solved_radius"] is None
    # One that the region cuts, by 50 000 points: four deviations of as many chances.
    cut = [[-5, 5, 5], [5, 5, 5], [5, 5, 15], [5, 15, 5]]
    part = built(nodes=cut, struts=[[0, 1], [1, 2], [1, 3]], fraction=0.1)
    points = np.random.default_rng(3).uniform(0, 10, (100_000, 3))
    deviation = np.sqrt(0.1 * 0.9 * (1 / 50_000 + 1 / 100_000))
    assert np.mean(part.field(points) < 0) == pytest.approx(0.1, abs=4 * deviation)


def test_fillets_add_only_where_beams_meet():
    """A filleted lattice holds the sharp one; at mid length nothing is added."""
    args = {"cell": "bcc", "map": lt.map.affine(wavelength=10), "radius": 0.6}
    sharp, round_ = built(**args), built(**args, fillet={"radius": 0.2})
    points = np.random.default_rng(1).uniform(0, 10, (20000, 3))
    a, b = sharp.field(points), round_.field(points)
    assert np.all(b[a < 0] < 0)
    assert np.count_nonzero(b < 0) > np.count_nonzero(a < 0)
    assert reported(round_)["fillet_radius"][0] == pytest.approx(0.2, rel=1e-6)
    mesh = round_.mesh(edge=0.3)
    assert mesh.closed and mesh.pieces == 1


@pytest.mark.parametrize("map_", ["cylinder", "sphere", "phase"])
def test_other_maps_carry_nodes(map_):
    """Round an axis, about a centre, turned by a solved map: nodes have the phases of nodes."""
    maps = {
        "cylinder": lt.map.cylinder(wavelength=2.5, around=12, center=[5, 5, 0]),
        "sphere": lt.map.sphere(wavelength=2.5, around=12, center=[5, 5, 5]),
        "phase": lt.map.phase(wavelength=4, rotate_z={"linear": {"along": [0, 0, 1], "stops": [[0, 0], [10, 30]]}}),
    }
    solid = built(cell="bcc", map=maps[map_], radius=0.2)
    assert reported(solid)["valence"].get("8", 0) > 10
    assert solid.mesh(edge=0.25).closed
    graph = solid.beams["core"]
    if map_ == "cylinder":
        off = np.hypot(graph["centers"][:, 0] - 5, graph["centers"][:, 1] - 5) / 1.25
        assert np.allclose(off, np.round(off), atol=1e-9)


def test_tables_rows_and_arrays_are_one(tmp_path):
    """The same graph from CSV, from lists, from arrays; saved and loaded again."""
    (tmp_path / "n.csv").write_text("id,x,y,z,r\n" + "".join(f"n{i},{x},{y},{z},0.9\n" for i, (x, y, z) in enumerate(SQUARE)))
    (tmp_path / "s.csv").write_text("".join(f"n{a};n{b}\n" for a, b in RING))
    rows = built(nodes=[[*p, 0.9] for p in SQUARE], struts=RING, radius=0.5)
    arrays = built(nodes=np.column_stack([SQUARE, [0.9] * 4]), struts=np.array(RING), radius=0.5)
    design = lt.Design(region=BOX, beams=lt.Beams(nodes="n.csv", struts="s.csv", radius=0.5), folder=str(tmp_path))
    (tmp_path / "below").mkdir()
    design.save(tmp_path / "below" / "d.toml")
    points = np.random.default_rng(2).uniform(0, 10, (2000, 3))
    for other in (arrays, design.build(), lt.load(tmp_path / "below" / "d.toml").build()):
        assert np.array_equal(rows.field(points), other.field(points))
        assert np.array_equal(rows.beams["core"]["radii"], np.full(4, 0.9))


def test_radii_vary_with_place():
    """A grade is taken at mid length; hubs are as large as the largest beam that meets there."""
    thick = {"linear": {"along": [0, 0, 1], "stops": [[0, 0.2], [10, 0.6]]}}
    solid = built(cell="sc", map=lt.map.affine(wavelength=2.5), radius=thick)
    graph = solid.beams["core"]
    z = graph["centers"][:, 2]
    inner = np.all((graph["centers"] > -1e-9) & (graph["centers"] < 10 + 1e-9), axis=1) & (z < 9.9)
    assert np.allclose(graph["radii"][inner], 0.2 + 0.04 * np.minimum(z[inner] + 1.25, 10))
    assert reported(solid)["thickness"] == pytest.approx(0.4, abs=0.02)
    waisted = built(cell="sc", map=lt.map.affine(wavelength=5), radius=0.3, hub=0.8)
    assert reported(waisted)["thickness"] == pytest.approx(0.6, rel=1e-9)
    on, off = waisted.field([[2.5, 0.01, 0.29], [2.5, 0.01, 0.31]])
    assert on < 0 < off


@pytest.mark.parametrize("trim", ["cut", "drop", "snap"])
def test_what_leaves_the_region(trim):
    """Cut: solid up to the surface. Drop: no beam leaves. Snap: free ends lie on the surface."""
    ball = lt.region.sphere(radius=6)
    solid = built(ball, cell="bcc", map=lt.map.affine(wavelength=4), radius=0.3, trim=trim)
    graph, report = solid.beams["core"], reported(solid)
    far = np.linalg.norm(graph["centers"], axis=1)
    assert solid.mesh(edge=0.2).closed
    if trim == "cut":
        assert far.max() > 6 and report["trimmed"]["outside"] > 0
    else:
        assert far.max() <= 6 + 1e-9 and report["trimmed"]["dropped" if trim == "drop" else "snapped"] > 0
    if trim == "snap":
        valence = np.bincount(graph["struts"].ravel(), minlength=len(far))
        assert np.all(np.abs(far[valence == 1] - 6) < 1e-7)
        assert report["dangling"] == 0


def test_what_begins_on_the_surface_is_outside_when_ends_are_snapped():
    """Whole cells in a box: struts go out from nodes on its faces."""
    box = lt.region.box(min=[0, 0, 0], max=[12, 12, 12])
    solid = built(box, cell="octet", map=lt.map.affine(wavelength=6), radius=0.4, trim="snap")
    graph = solid.beams["core"]
    assert np.all((graph["centers"] > -1e-9) & (graph["centers"] < 12 + 1e-9)) and reported(solid)["trimmed"]["snapped"] == 0


def test_a_grid_too_coarse_for_beams_is_warned_of():
    """Beams of a little more than two steps across lose a sixth of their volume."""
    solid = built(lt.region.box(size=[16, 16, 16]), cell="octet", map=lt.map.affine(wavelength=8), radius=0.55)
    with pytest.warns(lt.DesignWarning, match="the grid is too coarse: the result has a solid fraction of 0"):
        solid.mesh(edge=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        solid.mesh(edge=0.15)


def test_what_chords_cost_of_beams_is_expected_and_warned_of():
    """Against the exact volume of beams that the region holds."""
    cell = {"cell": "octet", "map": lt.map.affine(wavelength=12), "radius": 0.7, "fillet": {"radius": 0.4}, "trim": "drop"}
    solid = built(lt.region.box(min=[-2, -2, -2], max=[26, 26, 26]), **cell)
    exact = solid.report().beams["core"].volume
    for edge in (0.9, 0.45, 0.23):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            lost = 1 - solid.mesh(edge=edge).volume / exact
        expected = solid.volume_error(edge)
        assert expected / 3 < lost < 3 * expected, (edge, lost, expected)
        assert any("chords cost" in str(w.message) for w in said) == (expected > 0.05)
    assert solid.volume_error(0.9) > 0.05 > solid.volume_error(0.45)


def test_loose_ends_are_told_and_dropped():
    """A ring with a tail of two beams."""
    nodes = [*SQUARE, [5, 5, 5], [5, 5, 8]]
    tail = [*RING, [0, 4], [4, 5]]
    with pytest.warns(lt.DesignWarning, match="1 node inside the region with a single beam"):
        kept = lt.Design(region=BOX, beams=lt.Beams(nodes=nodes, struts=tail, radius=0.5)).build()
    assert reported(kept)["dangling"] == 1
    dropped = reported(built(nodes=nodes, struts=tail, radius=0.5, dangling="drop"))
    assert dropped["dangling"] == 0 and dropped["beams"] == 4 and dropped["cleaned"]["dangling"] == 2


def test_what_is_twice_is_reported():
    """Merged nodes, beams of no length, beams that are there already, nodes without beams; beams within others."""
    nodes = [*SQUARE, [1, 1, 5], [2, 2, 2]]
    with pytest.warns(lt.DesignWarning, match="1 node merged .* 1 strut of no length .* 1 strut left out .* 1 node left out"):
        lt.Design(region=BOX, beams=lt.Beams(nodes=nodes, struts=[*RING, [1, 4], [0, 4]], radius=0.5)).build()
    nodes = [*SQUARE, [5, 1, 5]]
    with pytest.warns(lt.DesignWarning, match="1 beam lies within another one .* about"):
        lt.Design(region=BOX, beams=lt.Beams(nodes=nodes, struts=[*RING, [0, 4], [4, 2]], radius=0.5)).build()
    with pytest.warns(lt.DesignWarning, match="cannot have a fillet of 9 mm, only the largest that fits; the tightest has"):
        lt.Design(region=BOX, beams=lt.Beams(nodes=SQUARE, struts=RING, radius=0.5, fillet={"radius": 9})).build()


def test_skin_keep_and_islands_work_on_beams():
    """What stands beside a lattice stands beside beams."""
    beams = lt.Beams(cell="octet", map=lt.map.affine(wavelength=5), radius=0.35)
    design = lt.Design(
        region=BOX, beams=beams, skin=lt.skin(0.5, open=["-z"]), keep={"boss": lt.region.sphere(center=[5, 5, 5], radius=2)}
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solid = design.build()
        mesh = solid.mesh(edge=0.2, islands="drop")
    assert mesh.closed and mesh.pieces == 1
    assert np.all(solid.field([[5, 5, 5], [0.2, 5, 5]]) < 0)
    assert solid.voxels(step=0.1).volume == pytest.approx(mesh.volume, rel=0.03)


SWIRL = {
    "nodes": [[9, 0, 0, 0.5]],
    "struts": [[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1]],
    "repeat": [
        {"count": 12, "rotate": [0, 0, 25]},
        {"count": 5, "scale": 0.85, "rotate": [0, 0, 10]},
        {"count": 3, "by": [0, 0, 2.5]},
    ],
}


@pytest.mark.parametrize("fillet", ["none", {"tau": 0.8}])
def test_a_pattern_is_the_graph_that_it_stands_for(fillet):
    """Written out and built as nodes and struts, beams are the same."""
    region = lt.region.box(min=[-10, -10, -1], max=[10, 10, 6])
    laid = built(region, pattern=SWIRL, profile="cone", fillet=fillet)
    graph = laid.beams["core"]
    nodes = np.column_stack([graph["centers"], graph["radii"]])
    assert (len(nodes), reported(laid)["hubs"], reported(laid)["beams"]) == (180, 180, len(graph["struts"]))
    whole = built(region, nodes=nodes, struts=graph["struts"], profile="cone", fillet=fillet)
    points = np.random.default_rng(3).uniform([-10, -10, -1], [10, 10, 6], (20000, 3))
    a, b = laid.field(points), whole.field(points)
    assert np.array_equal(a < 0, b < 0)
    mesh = laid.mesh(edge=0.35)
    assert mesh.closed and mesh.volume == pytest.approx(whole.mesh(edge=0.35).volume, rel=5e-3)


def test_the_exact_volume_of_a_pattern_is_that_of_its_graph():
    """Of one hub of each kind with geometric sums, against all hubs one by one, and against a mesh."""
    steps = [{"count": 4, "by": [3, 0, 0]}, {"count": 5, "by": [0.5, 3, 0]}, {"count": 3, "scale": 1.1, "about": [0, 0, -20]}]
    pattern = {"nodes": [[0, 0, 0, 0.4]], "struts": [[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1]], "repeat": steps}
    region = lt.region.box(min=[-6, -6, -8], max=[20, 24, 14])
    sharp = built(region, pattern=pattern, profile="cone")
    graph = sharp.beams["core"]
    nodes = np.column_stack([graph["centers"], graph["radii"]])
    whole = built(region, nodes=nodes, struts=graph["struts"], profile="cone")
    assert reported(sharp)["volume"] == pytest.approx(reported(whole)["volume"], rel=1e-9)
    # Steps of 0.2 mm, so that surfaces run along grid edges.
    rounded = built(region, pattern=pattern, profile="cone", fillet="auto").mesh(edge=0.2)
    assert rounded.closed and rounded.volume > reported(sharp)["volume"]


def test_beams_are_blended_with_a_lattice():
    """Octet beams pass into a network of the same cells; each is itself where it is alone."""
    network = lt.Lattice(cell="gyroid", part="upper", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.3))
    struts = lt.Beams(cell="octet", map=lt.map.affine(wavelength=5), radius=0.6)
    region = lt.region.box(min=[0, 0, 0], max=[40, 10, 10])
    weight = lt.grade.linear(along=[1, 0, 0], stops={12: 0, 28: 1})
    both = lt.Design(region, {"core": network}, beams={"rim": struts}, blend=lt.blend.between("core", "rim", weight)).build()
    mesh = both.mesh(edge=0.4, islands="drop")
    assert mesh.closed and mesh.pieces == 1
    points = np.random.default_rng(3).uniform([0, 0, 0], [40, 10, 10], (4000, 3))
    alone = [lt.Design(region, network).build(), lt.Design(region, beams=struts).build()]
    for solid, where in zip(alone, (points[:, 0] < 11.9, points[:, 0] > 28.1), strict=True):
        assert ((solid.field(points[where]) < 0) == (both.field(points[where]) < 0)).all()


def test_a_thousand_million_hubs_are_checked_at_once():
    """A pattern is not written out; a graph of that size is refused before it is made."""
    steps = [{"count": 1000, "by": by} for by in ([1, 0, 0], [0, 1, 0], [0, 0, 1])]
    pattern = {"nodes": [[0, 0, 0]], "struts": [[0, 0, 1, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0, 1]], "repeat": steps}
    report = reported(built(pattern=pattern, radius=0.2))
    assert (report["hubs"], report["beams"], report["kinds"]) == (1e9, 3 * 1000 * 1000 * 999, 27)
    # Equal cylinders of radius x on a simple cubic graph: π x² ΣL − 8√2 x³ for each node, but for the ends.
    exact = 1e9 * (3 * math.pi * 0.2**2 - 8 * math.sqrt(2) * 0.2**3)
    assert report["volume"] == pytest.approx(exact, rel=2e-3)
    with pytest.raises(lt.DesignError, match="beams are needed to fill the region's bounds; the maximum is 10000000"):
        built(lt.region.box(size=[1000, 1000, 1000]), cell="sc", map=lt.map.affine(wavelength=1), radius=0.2)


GOOD = {"cell": "octet", "map": {"affine": {"wavelength": 5}}, "radius": 0.4}
OWN = {"nodes": SQUARE, "struts": RING, "radius": 0.5}
PATTERN = {"pattern": SWIRL, "radius": 0.3}


def but(of, **change):
    """The same with some keys changed, or left out where None."""
    return {k: v for k, v in (of | change).items() if v is not None}


CASES = [
    (but(GOOD, cell="octett"), "cell", ['did you mean "octet"']),
    (but(GOOD, cell="gyroid"), "cell", ["gyroid is a surface"]),
    (but(GOOD, cell="fluorite"), "cell", ['"rhombic_dodecahedron"']),
    (but(GOOD, cel="octet"), "cel", ['did you mean "cell"']),
    (but(GOOD, map=None), "", ['"map" is missing']),
    (but(GOOD, radius=None), "", ['"radius" is missing']),
    (but(GOOD, radius=0), "radius", ["radius is 0 mm", "greater than 0"]),
    (but(GOOD, radius=math.nan), "radius", ["radius is NaN"]),
    (but(GOOD, radius=-1), "radius", ["radius is -1"]),
    (but(GOOD, radius=2.4), "radius", ["solid everywhere"]),
    (but(GOOD, radius=9), "radius", ["radius is 9 mm", "at most the wavelength, 5 mm"]),
    (but(GOOD, radius={"formula": "x - 5"}), "radius.formula", ["radius is -", "greater than 0"]),
    (but(GOOD, nodes=SQUARE), "nodes", ["found cell and nodes"]),
    (but(GOOD, fillet=0.3), "fillet", ["fillet = { radius = 0.5 }"]),
    (but(GOOD, fillet={"radius": -1}), "fillet.radius", ["radius is -1 mm", "greater than 0"]),
    (but(GOOD, fillet={"tau": 1}), "fillet.tau", ["tau is 1", "at least 0 and less than 1"]),
    (but(GOOD, fillet="round"), "fillet", ["unknown fillet", "none, auto"]),
    (but(GOOD, profile="tube"), "profile", ["unknown profile"]),
    (but(GOOD, profile={"waist": 2}), "profile", ["must be more than", "the beam from"]),
    (but(GOOD, merge=-1), "merge", ["at least 0"]),
    (but(GOOD, trim="clip"), "trim", ["unknown trim", "cut, drop, snap"]),
    (but(GOOD, map={"affine": {"wavelength": 0.001}}, radius=0.0001), "map", ["the maximum is 10000000"]),
    (
        but(GOOD, map={"affine": {"wavelength": 500, "offset": [100, 100, 100]}}, radius=1),
        "map",
        ["no beam lies in the region"],
    ),
    (but(OWN, struts=[[0, 9]]), "struts[0]", ["there is no node 9; there are 4 nodes"]),
    (but(OWN, struts=[[0, -1]]), "struts[0]", ["there is no node -1; there are 4 nodes, their numbers are 0 to 3"]),
    (but(OWN, struts=[[0, 0]]), "struts", ["two different ends"]),
    (but(OWN, struts=[[0, 1.5]]), "struts[0][1]", ["whole number", "1.5"]),
    (but(OWN, struts=None), "", ['"struts" is missing']),
    (but(OWN, nodes=[[0, 0]]), "nodes[0]", ["x, y, z"]),
    (but(OWN, nodes=[[0, 0, math.inf]]), "nodes[0][2]", ["finite", "inf"]),
    (but(OWN, nodes=[[1, 1, 5, 0], *SQUARE[1:]]), "nodes[0]", ["radius is 0"]),
    (but(OWN, radius=None), "", ["no node has one"]),
    (but(OWN, map=GOOD["map"]), "map", ["found nodes and map"]),
    (but(OWN, nodes="missing.csv"), "nodes", ["missing.csv"]),
    (
        but(OWN, nodes=[[1, 1, 5, 4], [2, 1, 5, 0.5], *SQUARE[2:]], radius=0.4),
        "radius",
        ["the beam from", "contains the other hub"],
    ),
    (but(OWN, profile="cylinder", hub={"formula": "0.5 + x/20"}), "profile", ["cylinder needs hubs of equal radius"]),
    (but(OWN, nodes=[[x + 50, y, z] for x, y, z in SQUARE]), "trim", ["no beam lies in the region"]),
    (but(PATTERN, trim="drop"), "trim", ["found pattern and trim"]),
    (but(PATTERN, radius={"formula": "1 + x"}), "radius", ["one number"]),
    (but(PATTERN, pattern=SWIRL | {"struts": [[0, 1, 0, 0, 0]]}), "pattern.struts[0]", ["unknown node 1"]),
    (but(PATTERN, pattern=SWIRL | {"struts": [[0, 0, 40]]}), "pattern.struts", ["no strut has both ends"]),
    (but(PATTERN, pattern=SWIRL | {"repeat": []}), "pattern.repeat", ["at least 1 item"]),
    (but(PATTERN, pattern=SWIRL | {"repeat": [{"count": 0}]}), "pattern.repeat[0].count", ["at least 1"]),
    (but(PATTERN, pattern=SWIRL | {"repeat": [{"count": 200, "scale": 0.5}]}), "pattern.repeat[0].scale", ["times as large"]),
    ({}, "", ["exactly one of cell with map, nodes with struts, path, pattern"]),
]


@pytest.mark.parametrize(("beams", "place", "parts"), CASES, ids=[f"{i}-{c[1]}" for i, c in enumerate(CASES)])
def test_each_slip_gets_one_error(beams, place, parts):
    """The place, what was found, what is allowed."""
    with pytest.raises(lt.DesignError) as caught:
        lt.Design(region=BOX, beams={"core": beams}).build()
    assert caught.value.path == ".".join(filter(None, ["beams.core", place])), caught.value
    for part in parts:
        assert part in str(caught.value), str(caught.value)


def test_a_lattice_and_beams_need_a_blend():
    """And a lattice whose cell is one of beams is said to belong elsewhere."""
    lattice = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.3))
    with pytest.raises(lt.DesignError, match="blend"):
        lt.Design(region=BOX, lattice=lattice, beams={"frame": lt.Beams(**GOOD)}).build()
    with pytest.raises(lt.DesignError, match="another name"):
        lt.Design(region=BOX, lattice=lattice, beams=lt.Beams(**GOOD)).build()
    lattice = lt.Lattice(cell="octet", part="sheet", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.3))
    with pytest.raises(lt.DesignError, match="octet is a cell of beams"):
        lt.Design(region=BOX, lattice=lattice).build()
    with pytest.raises(lt.DesignError, match=r"such as .*or \[beams.core\]"):
        lt.Design(region=BOX).build()


def run(*words):
    """The command's exit status, output and words."""
    done = subprocess.run([sys.executable, "-m", "trabecula", *map(str, words)], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def test_the_command(tmp_path):
    """cells --beams, check, mesh."""
    status, out, _ = run("cells", "--beams", "--json")
    cells = json.loads(out)
    assert status == 0 and len(cells) == len(lt.beams.names()) and cells[0]["name"] == "sc"
    status, out, _ = run("cells", "octet", "--beams")
    assert status == 0 and "4 of 12" in out and "Maxwell  +12" in out
    status, _, words = run("cells", "octed", "--beams")
    assert status == 1 and 'did you mean "octet"' in words
    file = tmp_path / "d.toml"
    lt.Design(region=BOX, beams=lt.Beams(**GOOD)).save(file)
    status, out, _ = run("check", file)
    assert status == 0 and "beams core: octet" in out and "of 12" in out
    status, out, _ = run("check", file, "--json")
    assert json.loads(out)["beams"]["core"]["smallest_angle"] == pytest.approx(60)
    status, out, _ = run("mesh", file, "-o", tmp_path / "d.stl", "--edge", 0.3, "--json")
    assert status == 0 and json.loads(out)["pieces"] == 1


def whole(**beams):
    """Octet beams in a box that does not cut them."""
    box = lt.region.box(min=[-1, -1, -1], max=[21, 21, 21])
    given = {"cell": "octet", "radius": 0.6, "fillet": "auto", "trim": "drop", "map": lt.map.affine(wavelength=10)}
    return built(region=box, **(given | beams))


def test_exact_figures_are_those_of_the_mesh_and_of_the_grid():
    """Both methods come to the exact volume: the patches at any chord error."""
    import judges

    solid = whole()
    exact = reported(solid)
    assert np.allclose(exact["centroid"], [10, 10, 10], atol=1e-9)
    inertia = np.array(exact["inertia"])
    # A cube's symmetry leaves one number.
    assert np.allclose(inertia, inertia[0, 0] * np.eye(3), atol=1e-8 * inertia[0, 0])
    for chord in (0.05, 0.02):
        mesh = solid.mesh(chord=chord)
        assert mesh.closed and mesh.pieces == 1 and mesh.self_intersections == 0
        assert abs(judges.sound(mesh) / mesh.volume - 1) < 1e-6
        assert mesh.chord_error <= chord
        # The closed form is known to 1e-10.
        assert abs(mesh.volume / exact["volume"] - 1) < 1e-9
    grid = solid.mesh(edge=0.15)
    # A radius is four steps of the grid, whose volume is of fourth order or, over seams of fillets, of third.
    assert abs(grid.volume / exact["volume"] - 1) < 2e-3


def test_whole_beams_are_meshed_from_their_patches_unless_a_grid_is_asked_for(tmp_path):
    """At a fiftieth of the radius: mesh, stream and the command. Beams that the region cuts, and islands, need a grid."""
    solid = whole(fillet="none")
    chord, exact = solid.report().chord, reported(solid)["volume"]
    assert chord == pytest.approx(0.6 / 50, rel=1e-9) and f"{chord:.3g} mm off at most" in str(solid.report())
    mesh = solid.mesh()
    assert np.array_equal(mesh.vertices, solid.mesh(chord=chord).vertices) and 0 < mesh.chord_error <= chord
    assert abs(mesh.volume / exact - 1) < 1e-9
    assert solid.save(tmp_path / "a.stl").triangles == mesh.counts[1]
    assert solid.mesh(edge=0.4).chord_error is None and solid.mesh(per_cell=24, islands="drop").chord_error is None
    cut = built(**GOOD)
    assert cut.report().chord is None and "grid " in str(cut.report()) and cut.mesh(edge=0.4).chord_error is None
    design = tmp_path / "d.json"
    small = lt.Beams(cell="bcc", radius=0.6, trim="drop", map=lt.map.affine(wavelength=10))
    lt.Design(region=lt.region.box(min=[-1, -1, -1], max=[11, 11, 11]), beams=small).save(design)
    for command in (
        ["mesh", design, "-o", tmp_path / "b.stl"],
        ["mesh", design, "-o", tmp_path / "b.3mf"],
        ["measure", design],
    ):
        status, out, _ = run(*command, "--json")
        made = json.loads(out)
        assert status == 0 and made["edge"] is None and made["chord_error"] <= 0.6 / 50 and made["pieces"] == 1


GYROID = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=4.0), level=lt.level.fraction(0.3))
FRAME = {"nodes": SQUARE, "struts": RING, "radius": 0.5}


@pytest.mark.parametrize(
    ("design", "why"),
    [
        (lambda: built(cell="octet", radius=0.3, map=lt.map.affine(wavelength=4)), "the region cuts some"),
        (lambda: lt.Design(region=BOX, beams=lt.Beams(**FRAME), skin={"thickness": 0.5}).build(), "a skin or a kept zone"),
        (lambda: lt.Design(region=BOX, lattice={"core": GYROID}).build(), "not one graph of beams"),
    ],
)
def test_a_chord_error_is_for_uncut_beams_alone(design, why):
    """What cannot be had is refused with the reason and the other method."""
    with pytest.raises(ValueError, match=why):
        design().mesh(chord=0.01)


@pytest.mark.parametrize("fillet", ["auto", "none"])
def test_a_stream_is_the_mesh(tmp_path, fillet):
    """Hub by hub to a file: the figures of the mesh, and as it is read back closed, in one piece and free of crossings."""
    solid = whole(fillet=fillet)
    mesh, path = solid.mesh(chord=0.05), tmp_path / "beams.stl"
    told_of = solid.save(path, chord=0.05)
    for key in ("triangles", "volume", "area", "euler", "pieces", "cavities"):
        assert told_of[key] == pytest.approx(mesh.summary()[key], rel=1e-11), key
    assert told_of["chord_error"] == mesh.chord_error
    read = lt.Mesh.read(path)
    assert read.counts[1] == mesh.counts[1] and read.defects == [] and read.pieces == 1
    with pytest.raises(ValueError, match="chord"):
        solid.save(path, edge=0.1, chord=0.05)


def test_hubs_and_a_profile_are_enough():
    """A waist or a λ needs no radius of beams: the balls and it say all."""
    box = lt.region.box(min=[-1, -1, -1], max=[21, 21, 21])
    given = {"cell": "bcc", "hub": 0.7, "trim": "drop", "map": lt.map.affine(wavelength=10)}
    assert reported(built(region=box, **given, profile={"waist": 0.3}))["thickness"] == pytest.approx(0.6, rel=1e-9)
    assert reported(built(region=box, **given))["thickness"] == pytest.approx(1.4, rel=1e-9)


def test_the_fraction_is_exact_where_nothing_cuts():
    """Of uncut beams in a box the volume over the box's; of cut ones, or with a skin, by points."""
    solid = whole()
    report = reported(solid)
    assert report["fraction_exact"] and report["fraction"] == pytest.approx(report["volume"] / 22**3, rel=1e-12)
    assert solid.quadors().whole
    box = lt.region.box(min=[-1, -1, -1], max=[21, 21, 21])
    beams = lt.Beams(cell="octet", radius=0.6, trim="drop", map=lt.map.affine(wavelength=10))
    skinned = lt.Design(region=box, beams=beams, skin={"thickness": 0.3}).build()
    for cut in (built(cell="octet", radius=0.3, map=lt.map.affine(wavelength=4)), skinned):
        assert not reported(cut)["fraction_exact"] and not cut.quadors().whole
        assert "uncut" in repr(cut.quadors())


def test_patterns_are_looked_through_for_beams_that_collide():
    """Two diagonals, one above the other, by more or less than they are thick."""
    steps = [{"count": 20, "by": [3, 0, 0]}, {"count": 20, "by": [0, 3, 0]}]
    pattern = {"nodes": [[0, 0, 0], [0, 0, 0.5]], "struts": [[0, 0, 1, 1, 0], [1, 1, 1, -1, 0]], "repeat": steps}
    region = lt.region.box(min=[-2, -2, -2], max=[62, 62, 2])
    clear = lt.Design(region=region, beams=lt.Beams(pattern=pattern, radius=0.24)).build()
    report = reported(clear)
    assert report["collisions"] == 0 and report["fraction_exact"]
    assert report["fraction"] == pytest.approx(report["volume"] / (64 * 64 * 4), rel=1e-12)
    with pytest.warns(lt.DesignWarning, match="run into each other without a common node"):
        joined = lt.Design(region=region, beams=lt.Beams(pattern=pattern, radius=0.26)).build()
    report = reported(joined)
    assert report["collisions"] > 0 and report["volume"] is None and not report["fraction_exact"]


def test_a_mesh_that_memory_has_no_room_for_is_refused_beforehand():
    """At a hundred-thousandth of the radius a block of some hundred beams is of thousands of millions of triangles."""
    with pytest.raises(ValueError, match=r"chord 1e-08 mm needs about .* of memory for .* triangles.*try chord"):
        whole().mesh(chord=1e-8)


def test_beams_that_cross_without_a_node_are_reported():
    """One solid on a grid, but without exact figures: what is shared would count twice."""
    apart = {"nodes": [[1, 5, 5], [9, 5, 5], [5, 1, 5.9], [5, 9, 5.9]], "struts": [[0, 1], [2, 3]], "radius": 0.5}
    with pytest.warns(lt.DesignWarning, match=r"1 pair of beams run into or touch each other .* at \(5, 5, 5.45\) mm"):
        solid = lt.Design(region=BOX, beams=lt.Beams(**apart)).build()
    report = reported(solid)
    assert report["collisions"] == 1 and report["volume"] is None
    with pytest.raises(ValueError, match="intersects beam 1"):
        solid.quadors().volume()
    with pytest.raises(ValueError, match="without a common node"):
        solid.mesh(chord=0.05)
    assert solid.mesh(edge=0.1).pieces == 1
    clear = built(**(apart | {"radius": 0.44}))
    assert reported(clear)["collisions"] == 0
    assert clear.quadors().volume() == pytest.approx(reported(clear)["volume"], rel=1e-12)


def test_a_chord_error_takes_the_place_of_a_spacing():
    """One resolution, a length, and pieces that are not looked for."""
    solid = whole()
    for given in ({"edge": 0.1}, {"per_cell": 20}, {"islands": "drop"}):
        with pytest.raises(ValueError, match="chord"):
            solid.mesh(chord=0.01, **given)
    for chord in (0, -1, float("nan")):
        with pytest.raises(ValueError, match="chord"):
            solid.mesh(chord=chord)


@pytest.mark.parametrize(("cell", "wavelength", "more"), [
    ("diamond", 8, {"fillet": {"radius": 0.2}, "radius": lt.grade.linear([0, 0, 1], {0: 0.2, 16: 0.4})}),
    ("kelvin", [8, 8, 16], {
        "fillet": "auto",
        "radius": lt.grade.linear([0, 0, 1], {0: 0.3, 16: 0.7}),
        "hub": lt.grade.formula("0.45+0.03*z"),
    }),
])  # fmt: skip
def test_filleted_beams_of_many_sizes_are_meshed_within_any_chord_error(cell, wavelength, more):
    """A triangulation that fails at one chord error is found at a smaller one."""
    box = lt.region.box(min=[-1, -1, -1], max=[17, 17, 17])
    solid = built(box, cell=cell, map=lt.map.affine(wavelength=wavelength), trim="drop", dangling="drop", **more)
    for chord in (None, 0.004, 0.005, 0.01, 0.02):
        mesh = solid.mesh(chord=chord)
        assert mesh.closed and mesh.volume == pytest.approx(reported(solid).volume, rel=1e-6)


def test_beams_may_be_called_as_one_of_their_keys_is(tmp_path):
    beams = lt.Beams(cell="bcc", map=lt.map.affine(wavelength=5), radius=0.4)
    assert list(lt.Design(region=BOX, beams={"struts": beams}).build().beams) == ["struts"]
    (tmp_path / "a.toml").write_text("schema = 1\nregion.box.size = [9, 9, 9]\nbeams.struts = [[0, 1]]\n")
    with pytest.raises(lt.DesignError, match=r"a name comes first, such as \[beams.core\] with struts"):
        lt.load(tmp_path / "a.toml")
