"""Files of beams, judged by lib3mf, the consortium's own reader, and by parsers written from the formats' specifications."""

import xml.etree.ElementTree as ET
import zipfile

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
        r1 = beam.get("r1", usual)
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


def test_what_no_file_of_beams_holds_is_refused(tmp_path):
    skin = CUT + "[skin]\nthickness = 1\n"
    with pytest.raises(ValueError, match=r"skin or a kept zone.*write a mesh"):
        built(skin).save_beams(tmp_path / "a.3mf")
    with pytest.raises(ValueError, match="not one graph of beams"):
        design = lt.spartan("gyroid", wavelength=5, porosity=0.7, region=lt.region.box([10, 10, 10]))
        design.build().save_beams(tmp_path / "a.3mf")
    with pytest.raises(ValueError, match="must end in"):
        built(CUT).save_beams(tmp_path / "a.stl")
    assert not list(tmp_path.iterdir())


def test_fillets_are_left_out_with_a_warning(tmp_path):
    with pytest.warns(lt.DesignWarning, match="hubs have fillets"):
        made = built(CUT.replace("radius = 0.6", 'radius = 0.6\nfillet = "auto"')).save_beams(tmp_path / "a.3mf")
    assert made.filleted > 0
