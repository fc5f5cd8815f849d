"""Exact queries of beams through Python and the command: slices, nearest places, rays, the faces of hubs."""

import json
import math
import subprocess
import sys
import warnings

import numpy as np
import pytest
import trabecula as lt

BOX = lt.region.box(min=[0, 0, 0], max=[10, 10, 10])


@pytest.fixture(scope="module")
def octet():
    """A filleted octet cell, with the beams that reach out of the box."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        beams = lt.Beams(cell="octet", map=lt.map.affine(wavelength=10), radius=0.6, fillet={"radius": 0.2})
        return lt.Design(region=BOX, beams=beams).build()


@pytest.fixture(scope="module")
def quadors(octet):
    """Its beams."""
    return octet.quadors()


def samples(slice_, n=400):
    """Places of a slice's plane, one at random in each of n² squares round its loops, and the area of a square."""
    corners = np.concatenate(slice_.polygons(0.01))
    low, high = corners.min(axis=0) - 0.01, corners.max(axis=0) + 0.01
    at = np.arange(n) / n
    uv = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1).reshape(-1, 2)
    uv = low + (uv + np.random.default_rng(5).uniform(0, 1 / n, uv.shape)) * (high - low)
    plane = {k: np.array(v) for k, v in slice_.plane.items()}
    return plane["origin"] + uv[:, :1] * plane["u"] + uv[:, 1:] * plane["v"], np.prod((high - low) / n)


@pytest.mark.parametrize("fillet, asked", [({"radius": 0.4}, (0.4, None)), ({"alpha": 0.4}, (None, 0.36 / 1.64))])
def test_hubs_with_less_than_asked_for_are_listed(fillet, asked):
    """The same of a report, in words, and of all hubs as arrays; tau = (1 - 4 alpha²) / (1 + 4 alpha²)."""
    nodes = [[0, 0, 0], [12, 0, 0], [11, 5, 0], [-12, -0.5, 0], [0, 0, 40]]
    beams = lt.Beams(nodes=nodes, struts=[[0, 1], [0, 2], [0, 3], [1, 4]], radius=0.5, fillet=fillet)
    with pytest.warns(lt.DesignWarning, match="only the largest that fits"):
        solid = lt.Design(region=lt.region.box(size=[30, 30, 30]), beams=beams).build()
    report, all_ = solid.report(), solid.quadors().fillets()
    [first, *others] = report.beams["core"].fillet_shortfalls
    assert first.hub == 0 and first.position == [0, 0, 0] and first.crotches == 3
    assert (first.asked_radius, first.asked_tau) == (asked[0], pytest.approx(asked[1]) if asked[1] else None)
    assert all_["short"][0] == first.short > 0 and all_["crotches"].tolist() == [3, 1, 0, 0, 0]
    assert all_["radius"][0].tolist() == first.radius and all_["tau"][0].tolist() == first.tau
    assert first.radius[0] < first.radius[1] and first.tau[1] > first.tau[0]
    assert np.all(np.isnan(all_["tau"][2])) and np.all(np.isinf(all_["radius"][2]))
    # Hubs outside of the region are not in the report.
    assert [it.hub for it in [first, *others]] == [i for i in np.flatnonzero(all_["short"]) if abs(nodes[i][2]) <= 15]
    listed = [line for line in str(report).splitlines() if " crotches short" in line]
    assert len(listed) == min(3, 1 + len(others)) and listed[0].lstrip().startswith("hub 0 at (0, 0, 0) mm: radius ")


@pytest.mark.parametrize("cut", [{"z": 2.3}, {"z": 5}, {"point": [5, 5, 5], "normal": [1, 2, 0.5]}])
def test_the_area_of_a_slice_is_that_of_its_points(quadors, cut):
    """A square on the outline errs by chance, half its area at most; four deviations of as many as there are."""
    found = quadors.slice(**cut)
    places, square = samples(found)
    length = sum(np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1).sum() for p in found.polygons(0.001))
    slack = 4 * 0.5 * square * math.sqrt(2 * length / math.sqrt(square))
    assert np.count_nonzero(quadors.contains(places)) * square == pytest.approx(found.area, abs=slack)
    assert found.moved == 0
    assert 0 < found.hubs <= len(quadors)


def test_loops_are_closed_curves_on_their_conics(quadors):
    """Each curve begins where the one before ended, and lies on the conic that is reported with it."""
    found = quadors.slice(point=[5, 5, 5], normal=[1, 2, 0.5])
    for loop in found.loops:
        points, w = loop["points"], loop["weights"][:, None]
        assert np.array_equal(points[:, 0], np.roll(points[:, 2], 1, axis=0))
        middle = (points[:, 0] + 2 * w * points[:, 1] + points[:, 2]) / (2 + 2 * w) - loop["about"]
        u, v = middle.T
        a, b, c, d, e, f = loop["conics"].T
        assert np.abs(a * u * u + 2 * b * u * v + c * v * v + 2 * (d * u + e * v) + f).max() < 1e-9


def test_nearest_places_are_on_the_surface_and_none_is_nearer(quadors):
    """Against the first hits of rays, which are on the surface."""
    rng = np.random.default_rng(8)
    points = rng.uniform(1, 9, (400, 3))
    found = quadors.closest(points)
    assert np.array_equal(found["distance"] < 0, quadors.contains(points))
    gap = points - found["points"] - found["distance"][:, None] * found["normals"]
    assert np.linalg.norm(gap, axis=1).max() < 1e-7
    rng = np.random.default_rng(9)
    origins, ways = rng.uniform(1, 9, (20000, 3)), rng.normal(size=(20000, 3))
    hits = quadors.rays(origins, ways)
    hit = np.isfinite(hits["distance"])
    cloud = origins[hit] + hits["distance"][hit, None] * ways[hit]
    for p, d in zip(points, np.abs(found["distance"]), strict=True):
        assert d <= np.linalg.norm(cloud - p, axis=1).min() + 1e-9


def test_a_hub_is_faces_arcs_and_vertices(quadors):
    """Euler's formula with rims filled, each arc between two faces, sides of patches on their quadric."""
    hub = next(h for h in map(quadors.hub, range(len(quadors))) if len(h["faces"]) == 74)
    loops = sum(2 - len(f["loops"]) for f in hub["faces"])
    assert len(hub["vertices"]) - len(hub["arcs"]) + loops == 2
    sides = [f for a in hub["arcs"] for f in a["faces"]]
    walked = [i for i, f in enumerate(hub["faces"]) for loop in f["loops"] for _ in loop]
    assert sorted(sides) == sorted(walked) and -1 not in sides
    assert sorted({len(f["beams"]) for f in hub["faces"]}) == [1, 2, 3, 4]
    assert hub["unpatched"] == 0
    for patch in hub["patches"]:
        quadric = hub["faces"][patch["face"]]["quadric"]
        for loop in patch["loops"]:
            w = loop["weights"][:, None]
            middle = (loop["points"][:, 0] + 2 * w * loop["points"][:, 1] + loop["points"][:, 2]) / (2 + 2 * w)
            at = np.column_stack([middle, np.ones(len(middle))])
            assert np.abs(np.einsum("ni,ij,nj->n", at, quadric, at)).max() < 1e-8


def test_planes_and_points_that_are_none_are_refused(octet, quadors):
    """One clear line each."""
    for arguments, words in [
        ({}, "give z"),
        ({"z": 1, "point": [0, 0, 0]}, "not both"),
        ({"z": math.nan}, "position"),
        ({"point": [0, 0, 0], "normal": [0, 0, 0]}, "not all zero"),
    ]:
        with pytest.raises(ValueError, match=words):
            quadors.slice(**arguments)
    with pytest.raises(ValueError, match="shape"):
        quadors.closest([[1, 2]])
    with pytest.raises(ValueError, match="from 0 to"):
        quadors.hub(len(quadors))
    with pytest.raises(ValueError, match="no beams named"):
        octet.quadors("other")
    gyroid = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.3))
    with pytest.raises(ValueError, match="the design has no beams"):
        lt.Design(region=BOX, lattice=gyroid).build().quadors()


def test_the_command_draws_a_slice(tmp_path):
    """Nine discs halfway along the cells, their area in closed form; a drawing with as many loops; four in the part."""
    design = tmp_path / "sc.toml"
    design.write_text(
        'schema = 1\n[region.box]\nmin = [0, 0, 0]\nmax = [20, 20, 20]\n[beams.core]\ncell = "sc"\nradius = 1\n'
        'hub = 1\nprofile = "cylinder"\nmap.affine.wavelength = 10\n'
    )
    words = [sys.executable, "-m", "trabecula", "slice", str(design), "--z", "5", "-o", str(tmp_path / "o.svg"), "--json"]
    part = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    assert part["area"] == pytest.approx(4 * math.pi, rel=1e-5) and part["loops"] == 9  # those on the sides are cut
    words += ["--beams", "core"]  # whole
    ran = subprocess.run(words, capture_output=True, text=True, check=True)
    reported = json.loads(ran.stdout)
    assert reported["area"] == pytest.approx(reported["loops"] * math.pi, rel=1e-12) and reported["loops"] >= 9
    drawn = (tmp_path / "o.svg").read_text()
    assert drawn.count("M ") == reported["loops"] and drawn.startswith("<svg")
    words[words.index("--z") + 1] = "high"
    assert subprocess.run(words, capture_output=True).returncode == 2


def test_a_pattern_answers_as_the_graph_that_it_stands_for():
    """Repeats that turn and shrink, in a region that holds them: slices, volume and nearest places."""
    steps = [{"count": 8, "rotate": [0, 0, 45]}, {"count": 3, "scale": 0.8, "by": [0, 0, 3]}]
    struts = [[0, 0, 1, 0, 0], [0, 0, 0, 1, 0]]
    given = {"nodes": [[8, 0, 0, 0.6]], "struts": struts, "repeat": steps}
    region = lt.region.box(min=[-10, -10, -2], max=[10, 10, 12])
    pattern = lt.Design(region=region, beams=lt.Beams(pattern=given, profile="cone", fillet="auto")).build()
    graph = pattern.beams["core"]
    nodes = np.column_stack([graph["centers"], graph["radii"]]).tolist()
    beams = lt.Beams(nodes=nodes, struts=graph["struts"].tolist(), profile="cone", fillet="auto")
    truss = lt.Design(region=region, beams=beams).build()
    ours, theirs = pattern.quadors(), truss.quadors()
    assert ours.slice(z=1.5).area == pytest.approx(theirs.slice(z=1.5).area, rel=1e-10)
    # Of the program, kind by kind, and of every hub.
    volume = pattern.report()["beams"]["core"]["volume"]
    assert ours.volume() == pytest.approx(volume, rel=1e-9) == theirs.volume()
    points = np.random.default_rng(3).uniform([-10, -10, -2], [10, 10, 12], (50, 3))
    assert np.allclose(ours.closest(points)["distance"], theirs.closest(points)["distance"], atol=1e-9)


def test_a_pattern_is_meshed_from_its_patches():
    """With the exact volume, which is known to 1e-10."""
    steps = [{"count": 3, "by": way} for way in ([4, 0, 0], [0, 4, 0], [0, 0, 4])]
    struts = [[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1]]
    given = {"nodes": [[1, 1, 1, 0.6]], "struts": struts, "repeat": steps}
    solid = lt.Design(region=BOX, beams=lt.Beams(pattern=given, profile="cone", fillet="none")).build()
    mesh = solid.mesh(chord=0.02)
    assert mesh.closed and mesh.pieces == 1 and mesh.self_intersections == 0
    assert abs(mesh.volume / solid.quadors().volume() - 1) < 1e-9


def test_a_pattern_too_large_to_be_written_out_is_refused():
    """Its field answers still."""
    steps = [{"count": 1000, "by": [1, 0, 0]}, {"count": 1000, "by": [0, 1, 0]}, {"count": 1000, "by": [0, 0, 1]}]
    given = {"nodes": [[0, 0, 0]], "struts": [[0, 0, 1, 0, 0], [0, 0, 0, 1, 0]], "repeat": steps}
    solid = lt.Design(region=BOX, beams=lt.Beams(pattern=given, radius=0.2)).build()
    for ask in (lambda: solid.quadors("core"), lambda: solid.mesh(chord=0.01)):
        with pytest.raises(ValueError, match="expand it hub by hub, up to"):
            ask()
    assert solid.field([[5, 5, 5]]) < 0
