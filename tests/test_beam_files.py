"""Files of beams, judged by lib3mf, the consortium's own reader, and by parsers written from the formats' specifications."""

import json
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trabecula as lt
from trabecula.design import parsed

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
B = "{http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02}"
B2 = "{http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07}"

CUT = """
[region.box]
size = [12, 12, 12]
[beams.core]
cell = "bcc"
radius = 0.6
[beams.core.map.affine]
wavelength = 5
"""
WAISTED = """
[region.box]
size = [60, 60, 60]
[beams.rods]
nodes = [[-10, 0, 0], [10, 0, 0], [0, 15, 0]]
struts = [[0, 1], [1, 2]]
radius = 0.5
hub = 2
"""


def built(text):
    return parsed("schema = 1\n" + text, False, "test", ".").build()


def lattice(path):
    """The lattice of a 3MF: its element, nodes, frusta (v1, v2, r1, r2), balls."""
    root = ET.fromstring(zipfile.ZipFile(path).read("3D/3dmodel.model"))
    held = next(o for o in root.iter(f"{CORE}object") if o.find(f"{CORE}mesh/{B}beamlattice") is not None)
    nodes = [[float(v.get(a)) for a in "xyz"] for v in held.iter(f"{CORE}vertex")]
    of = held.find(f"{CORE}mesh/{B}beamlattice")
    usual = of.get("radius")
    rows = []
    for beam in of.iter(f"{B}beam"):
        r1 = beam.get("r1", usual)  # old samples have r2 alone
        rows.append([int(beam.get("v1")), int(beam.get("v2")), float(r1), float(beam.get("r2", r1))])
    balls = [[int(b.get("vindex")), float(b.get("r"))] for b in of.iter(f"{B2}ball")]
    return root, of, np.array(nodes), np.array(rows), np.array(balls)


def strict(path):
    """The model as lib3mf reads it in strict mode, without a warning."""
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0, reader.GetWarning(0)
    found = []
    objects = model.GetMeshObjects()
    while objects.MoveNext():
        found.append(objects.GetCurrentMeshObject())
    return found


def test_beams_that_the_region_cuts_have_its_mesh_and_one_to_show(tmp_path):
    made = built(CUT).save_beams(tmp_path / "a.3mf")
    assert (made.split, made.clipped) == (0, True) and made.error < 1e-12  # cylinders, but for rounding
    root, of, nodes, rows, balls = lattice(tmp_path / "a.3mf")
    assert len(rows) == made.beams and len(nodes) == made.nodes and len(balls) == 0
    assert (rows[:, 2:] == np.float32(0.6)).all() or (rows[:, 2:] == 0.6).all()
    assert root.get("requiredextensions") == "b" and of.get("clippingmode") == "inside"
    clip = next(o for o in root.iter(f"{CORE}object") if o.get("id") == of.get("clippingmesh"))
    corners = np.array([[float(v.get(a)) for a in "xyz"] for v in clip.iter(f"{CORE}vertex")])
    assert sorted(map(tuple, corners)) == [(x, y, z) for x in (-6, 6) for y in (-6, 6) for z in (-6, 6)]
    # Every beam is in the set of all; those in the other reach within a radius of the box's faces.
    sets = {s.get("name"): [int(r.get("index")) for r in s.iter(f"{B}ref")] for s in of.iter(f"{B}beamset")}
    assert sets["core"] == list(range(len(rows)))
    far = np.abs(nodes[rows[:, :2].astype(int)]).max(axis=(1, 2)) + 0.6 > 6
    assert sets["core cut"] == np.flatnonzero(far).tolist()
    clip, shown, held = strict(tmp_path / "a.3mf")
    assert held.BeamLattice().GetBeamCount() == made.beams and held.BeamLattice().GetBeamSetCount() == 2
    assert clip.GetTriangleCount() == 12 and shown.IsManifoldAndOriented()
    built(CUT).save_beams(tmp_path / "b.3mf", mesh=False)
    assert len(strict(tmp_path / "b.3mf")) == 2


def test_waists_are_frusta_within_the_stated_error_and_hubs_are_balls(tmp_path):
    solid = built(WAISTED)
    made = solid.save_beams(tmp_path / "a.3mf", chord=0.004)
    root, _, nodes, rows, balls = lattice(tmp_path / "a.3mf")
    assert root.get("requiredextensions") == "b b2" and made.split == 2 and made.error <= 0.004
    assert sorted(map(tuple, balls)) == [(0, 2.0), (1, 2.0), (2, 2.0)]
    strict(tmp_path / "a.3mf")
    # The union of frusta and balls against the solid's own function, along rays from points of the axes.
    rng = np.random.default_rng(1)
    a, b = nodes[rows[:, 0].astype(int)], nodes[rows[:, 1].astype(int)]
    t, axis = rng.random(len(rows)), b - a
    across = np.cross(axis, rng.normal(size=axis.shape))
    across /= np.linalg.norm(across, axis=1)[:, None]
    radius = rows[:, 2] + t * (rows[:, 3] - rows[:, 2])
    centers = a + t[:, None] * axis
    ball = np.linalg.norm(centers[:, None] - nodes[balls[:, 0].astype(int)], axis=2) - balls[:, 1]
    free = ball.min(axis=1) > 1.0
    assert free.sum() > 10
    # What is within the error of the frustum's radius has both signs of the function on its sides; single precision is 1e-6.
    margin = made.error + 1e-5
    outside = solid.field(centers + (radius + margin)[:, None] * across)
    inside = solid.field(centers + (radius - margin)[:, None] * across)
    assert (outside[free] > 0).all() and (inside[free] < 0).all()


@pytest.mark.parametrize("radius", ["0.4", "{ linear = { along = [0, 0, 1], stops = [[-6, 0.3], [6, 0.6]] } }"])
def test_chains_of_frusta_read_back_are_the_quadrics_that_they_were(tmp_path, radius):
    box = "[region.box]\nsize = [12, 12, 12]\n[beams.core]\n"
    solid = built(box + f'cell = "kelvin"\nradius = {radius}\nhub = 0.7\nmap.affine.wavelength = 6\n')
    made = solid.save_beams(tmp_path / "a.3mf")
    count = len(solid.beams["core"]["struts"])
    assert made.split == count
    with pytest.warns(lt.DesignWarning, match=f"frusta in chains that represent quadrics read as {count} beams"):
        again = built(box + f"path = '{tmp_path / 'a.3mf'}'")
    assert all(len(again.beams["core"][key]) == len(solid.beams["core"][key]) for key in ("struts", "radii"))
    points = np.random.default_rng(1).uniform(-6, 6, (20000, 3))
    # Positions have seven digits of 12 mm; a contact circle's is divided by its distance from the radical plane for λ.
    assert abs(again.field(points) - solid.field(points)).max() < 1e-4
    assert not [w for w in again.warnings if "without a common node" in str(w)]


def test_what_no_file_of_beams_holds_is_refused(tmp_path):
    skin = CUT + "[skin]\nthickness = 1\n"
    with pytest.raises(ValueError, match=r"skin or a kept zone.*mesh its surface"):
        built(skin).save_beams(tmp_path / "a.3mf")
    with pytest.raises(ValueError, match="not one graph of beams"):
        design = lt.spartan("gyroid", wavelength=5, porosity=0.7, region=lt.region.box([10, 10, 10]))
        design.build().save_beams(tmp_path / "a.3mf")
    with pytest.raises(ValueError, match="must end in"):
        built(CUT).save_beams(tmp_path / "a.stl")
    assert not list(tmp_path.iterdir())


def test_fillets_are_left_out_with_a_warning(tmp_path):
    with pytest.warns(lt.DesignWarning, match="hubs with fillets"):
        made = built(CUT.replace("radius = 0.6", 'radius = 0.6\nfillet = "auto"')).save_beams(tmp_path / "a.3mf")
    assert len(made.lost) == 1


#: Samples of the 3MF Consortium, from 3mf-samples and the tests of lib3mf; see LICENSE there.
SAMPLES = Path(__file__).parent / "consortium"


@pytest.mark.parametrize("name", ["pyramid", "variable-voronoi", "Box_Simple", "Box_Attributes_Positive", "BeamSet_Unique"])
def test_samples_that_must_pass_are_read_as_another_parser_reads_them(name):
    file = SAMPLES / f"{name}.3mf"
    made = lt.beams.read(file)
    _, _, nodes, rows, _ = lattice(file)
    ends = made["nodes"][made["beams"]]
    assert len(ends) == len(rows)
    # The order of beams stays; vertices without beams are left out. Positions are held in single precision.
    assert np.allclose(ends, nodes[rows[:, :2].astype(int)], rtol=1e-7, atol=0)
    assert np.array_equal(made["beam_radii"], rows[:, 2:])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Box_Attributes_Negative_1", "clippingmesh is 2; no object before this one has that id"),
        ("Box_Attributes_Negative_2", 'the object\'s type is "support"; it must be model or solidsupport'),
        ("BeamSet_Not_Unique", 'two beam sets have the identifier "ASDF"'),
    ],
)
def test_samples_that_must_fail_are_refused(name, expected):
    with pytest.raises(ValueError, match=f"byte .*{expected}"):
        lt.beams.read(SAMPLES / f"{name}.3mf")


MODEL = """<?xml version="1.0"?><model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" unit="inch"
xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
xmlns:b2="http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07" requiredextensions="b b2"><resources>
<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="2" z="0"/></vertices>
<b:beamlattice radius="0.1" minlength="0.01" b2:ballmode="mixed" b2:ballradius="0.3"><b:beams><b:beam v1="0" v2="1"/>
<b:beam v1="1" v2="2" r1="0.2" r2="0.25"/></b:beams><b:beamsets><b:beamset identifier="a"><b:ref index="1"/></b:beamset>
</b:beamsets><b2:balls><b2:ball vindex="0"/></b2:balls></b:beamlattice></mesh></object></resources>
<build><item objectid="1" transform="0 2 0 -2 0 0 0 0 2 10 0 0"/></build></model>"""

#: What the specification forbids, by what is replaced in a model that is right.
WRONG = [
    ('radius="0.1" ', "", "radius of beamlattice is missing"),
    ('minlength="0.01" ', "", "minlength of beamlattice is missing"),
    ('radius="0.1"', 'radius="0"', "radius = 0; it must be greater than 0"),
    ('radius="0.1"', 'radius="-1"', "radius = -1"),
    ('v1="1" v2="2"', 'v1="1" v2="3"', "beam 1 joins vertices .1, 3., but there are 3"),
    ('v1="1" v2="2"', 'v1="1" v2="1"', "both ends of beam 1 are vertex 1"),
    ('r1="0.2"', 'r1="x"', "r1 = .*not a number"),
    (' b2:ballradius="0.3"', "", "ballradius is needed"),
    ('"mixed"', '"some"', "it must be one of none, mixed, all"),
    ('vindex="0"', 'vindex="3"', "ball 0 is at vertex 3, at which no beam ends"),
    ('ref index="1"', 'ref index="2"', "a set names beam 2"),
    ("<b:beam v1", '<b:beam cap1="round" v1', "it must be sphere, hemisphere or butt"),
    ("<b:beam v1", '<b:beam p1="0" v1', "needs pid and pindex"),
    ('radius="0.1"', 'radius="0.1" clippingmode="inside"', "clippingmesh is needed"),
    ('radius="0.1"', 'radius="0.1" clippingmesh="1"', "clippingmesh is 1; no object before"),
    ('radius="0.1"', 'radius="0.1" representationmesh="7"', "representationmesh is 7; no object"),
    ('<object id="1">', '<object id="1" type="other">', "type is .other."),
    ("0 2 0 -2 0 0", "0 2 0 -3 0 0", "no similarity"),
    ("</b:beamlattice>", "", "damaged"),
]


def packed(path, model):
    with zipfile.ZipFile(path, "w") as out:
        out.writestr("3D/3dmodel.model", model)
    return path


def test_a_placed_lattice_is_read_in_mm(tmp_path):
    made = lt.beams.read(packed(tmp_path / "a.3mf", MODEL))
    # Twice as large, turned by 90 degrees about z, moved by 10 inches.
    assert np.allclose(made["nodes"], 25.4 * np.array([[10, 0, 0], [10, 2, 0], [6, 0, 0]]), rtol=1e-12)
    assert np.allclose(made["beam_radii"], 50.8 * np.array([[0.1, 0.1], [0.2, 0.25]]), rtol=1e-12)
    assert np.allclose(made["radii"], [15.24, np.nan, np.nan], equal_nan=True, rtol=1e-12)


@pytest.mark.parametrize(("old", "new", "expected"), WRONG)
def test_what_the_extension_forbids_is_refused(tmp_path, old, new, expected):
    assert old in MODEL
    with pytest.raises(ValueError, match=expected):
        lt.beams.read(packed(tmp_path / "a.3mf", MODEL.replace(old, new, 1)))


TAPERED = """
[region.box]
size = [60, 60, 60]
[beams.rods]
nodes = [[-10.1, 0, 0.3, 1.25], [10, 0.7, 0, 1], [0, 15, 0, 0.75], [0, 3, 13.0, 1.0]]
struts = [[0, 1], [1, 2], [2, 3], [3, 0], [1, 3]]
profile = "cone"
"""


@pytest.mark.parametrize("suffix", ["3mf", "ltcx", "json", "vtu"])
def test_a_graph_comes_back_as_the_same_solid(tmp_path, suffix):
    solid = built(TAPERED)
    solid.save_beams(tmp_path / f"a.{suffix}", chord=1)
    back = parsed(
        f'schema = 1\n[region.box]\nsize = [60, 60, 60]\n[beams.rods]\npath = "a.{suffix}"\n', False, "test", str(tmp_path)
    ).build()
    points = np.random.default_rng(2).uniform(-12, 16, (3000, 3))
    # A 3MF has numbers in single precision, the others the same decimals.
    assert np.allclose(solid.field(points), back.field(points), rtol=0, atol=1e-5 if suffix == "3mf" else 0)


def test_graphs_are_what_other_programs_read(tmp_path):
    solid = built(CUT)
    with pytest.warns(lt.DesignWarning, match="the region cuts some beams"):
        made = solid.save_beams(tmp_path / "a.csv")
    table = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    graph = solid.beams["core"]
    nodes, ends = (np.asarray(graph[k]) for k in ("centers", "struts"))
    assert len(table) == made.beams == len(ends)
    assert np.array_equal(table[:, :6].reshape(-1, 2, 3), nodes[ends]) and (table[:, 6:] == 0.6).all()
    for suffix in ("json", "obj", "inp", "bdf", "vtu", "ltcx"):
        with pytest.warns(lt.DesignWarning):
            solid.save_beams(tmp_path / f"a.{suffix}")
    found = json.loads((tmp_path / "a.json").read_text())
    assert np.array_equal(np.array(found["nodes"])[:, :3], nodes) and len(found["beams"]) == len(ends)
    root = ET.parse(tmp_path / "a.ltcx").getroot()
    assert [[int(b.get("n1")), int(b.get("n2"))] for b in root.iter("beam")] == ends.tolist()
    meshio = pytest.importorskip("meshio")
    for suffix in ("vtu", "inp", "bdf"):
        other = meshio.read(tmp_path / f"a.{suffix}")
        lines = np.concatenate([c.data for c in other.cells if c.type == "line"])
        assert np.allclose(other.points[lines], nodes[ends], rtol=0, atol=1e-12), suffix


@pytest.mark.filterwarnings("ignore::trabecula.DesignWarning")
@pytest.mark.parametrize("cell", ["octet", "kelvin", "bcc"])
@pytest.mark.parametrize("suffix", ["csv", "json", "3mf"])
def test_fillets_add_no_beams_to_a_file(tmp_path, cell, suffix):
    """Neighbours outside the region shape the fillets in it; nothing of them is in it."""

    def made(fillet):
        text = f'[region.box]\nmin = [-1, -1, -1]\nmax = [25, 25, 25]\n[beams.core]\ncell = "{cell}"\nradius = 0.5\n'
        solid = built(f'{text}fillet = "{fillet}"\nmap.affine.wavelength = 12\n')
        file = solid.save_beams(tmp_path / f"{fillet}.{suffix}", mesh=False)
        back = lt.beams.read(tmp_path / f"{fillet}.{suffix}")
        ends = back["nodes"][back["beams"]]
        core = solid.report().beams["core"]
        assert (core.beams, file.beams) == (len(ends), len(ends))
        assert abs(core.total_length / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() - 1) < 1e-6
        along = ends[:, :1] + np.linspace(0, 1, 101)[:, None] * (ends[:, 1:] - ends[:, :1])
        outside = np.maximum(np.maximum(-1 - along, along - 25), 0)
        assert np.linalg.norm(outside, axis=2).min(axis=1).max() < 0.5
        return len(ends)

    assert made("auto") == made("none")


def test_what_a_format_cannot_hold_is_warned_of(tmp_path):
    solid = built(WAISTED)
    for suffix, expected in [("ltcx", "2 beams unlike the hubs"), ("csv", "the balls of 3 hubs"), ("obj", "no radii")]:
        with pytest.warns(lt.DesignWarning, match=expected):
            solid.save_beams(tmp_path / f"a.{suffix}")
    with pytest.warns(lt.DesignWarning, match="the taper of 4 beams"):
        built(TAPERED).save_beams(tmp_path / "a.inp")


def test_beams_of_a_file_that_cross_without_a_node_are_named(tmp_path):
    (tmp_path / "a.csv").write_text("-3,0,0,3,0,0,0.4\n0,-3,0,0,3,0,0.4\n")
    text = 'schema = 1\nregion.box.size = [8, 8, 8]\n[beams.core]\npath = "a.csv"'
    warned = parsed(text, False, "test", str(tmp_path)).build().warnings
    assert any("1 pair of beams run into" in w["message"] and "(0, 0, 0) mm" in w["message"] for w in warned)


@pytest.mark.filterwarnings("error::trabecula.DesignWarning")
def test_a_warning_that_is_an_error_leaves_no_file(tmp_path):
    with pytest.raises(lt.DesignWarning, match="the region cuts some beams"):
        built(CUT).save_beams(tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())
