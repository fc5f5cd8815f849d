"""Parts from CAD systems: what OCCT writes, read as closed triangles with named faces. In most tests in this process, as OCP is
slow to start."""

import json
import math
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from trabecula.io import cad

pytest.importorskip("OCP")
ROOT = Path(__file__).resolve().parent.parent
BRACKET = ROOT / "examples" / "parts" / "bracket.step"
#: Plate, upright and fillet less four bolt holes and the bore.
VOLUME = 60 * 40 * 8 + 8 * 40 * 37 + (1 - math.pi / 4) * 36 * 40 - 4 * math.pi * 9 * 8 - math.pi * 100 * 8


def placed(shape, angle, move):
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 2, 3)), angle)
    shift.SetTranslation(gp_Vec(*move))
    return BRepBuilderAPI_Transform(shape, shift.Multiplied(turn), True).Shape()


def write(shape, path, unit="MM"):
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    return path


def tessellated(path, chord=None, solid=None, angle=cad.ANGLE):
    points, triangles, faces, facts = cad.tessellated(str(path), chord, angle, solid)
    return cad.Part(points, triangles, faces, **json.loads(facts.tobytes()))


def filleted():
    """A box of 12 x 8 x 5 mm with all edges filleted by 1 mm: balls at its corners, faces that are periodic."""
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    box = BRepPrimAPI_MakeBox(12, 8, 5).Shape()
    made = BRepFilletAPI_MakeFillet(box)
    for edge in cad.parts(box, "edge"):
        made.Add(1.0, edge)
    return made.Shape()


def tiny_step():
    """A block with a step of 2 µm on its top, so that a face is as narrow."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    return BRepAlgoAPI_Fuse(BRepPrimAPI_MakeBox(10, 10, 5).Shape(), BRepPrimAPI_MakeBox(5, 10, 5.002).Shape()).Shape()


def shapes():
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import (
        BRepPrimAPI_MakeBox,
        BRepPrimAPI_MakeCone,
        BRepPrimAPI_MakeCylinder,
        BRepPrimAPI_MakeSphere,
        BRepPrimAPI_MakeTorus,
    )

    r = math.pi
    tube = BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(5, 9).Shape(), BRepPrimAPI_MakeCylinder(3, 9).Shape()).Shape()
    inside = 10 * 6 * 3
    return {
        "box": (BRepPrimAPI_MakeBox(3, 4, 5).Shape(), 60.0, 94.0),
        "torus": (BRepPrimAPI_MakeTorus(10, 3).Shape(), 2 * r**2 * 10 * 9, 4 * r**2 * 30),
        "apex": (BRepPrimAPI_MakeCone(5, 0, 12).Shape(), r * 25 * 4, r * 25 + r * 5 * 13),
        "ball": (BRepPrimAPI_MakeSphere(7).Shape(), 4 / 3 * r * 343, 4 * r * 49),
        "tube": (tube, r * 16 * 9, 2 * r * 16 + 2 * r * 8 * 9),
        "fillets": (filleted(), inside + 2 * (60 + 30 + 18) + r * (10 + 6 + 3) + 4 / 3 * r, 216 + 2 * r * 19 + 4 * r),
        "tiny face": (tiny_step(), 500.1, 400 + 0.002 * 30),
    }


@pytest.mark.parametrize("name", ["box", "torus", "apex", "ball", "tube", "fillets", "tiny face"])
def test_solids_are_closed_and_near_their_faces(name, tmp_path):
    """The volume between the faces and triangles within a chord of them is at most their area times the chord; and it falls
    with the chord."""
    shape, volume, area = shapes()[name]
    path = write(placed(shape, 0.7, (20, -5, 3)), tmp_path / "part.step")
    errors = []
    for chord in (0.1, 0.02):
        # The angle of 15 degrees would be finer than the first chord.
        part = tessellated(path, chord, angle=60.0)
        mesh = lt.Mesh.of(part.points, part.triangles)
        assert mesh.closed and mesh.pieces == 1 and mesh.self_intersections == 0
        assert abs(part.volume / volume - 1) < 1e-6
        # Of first order: two thirds of the chord, on average, over a face of one curvature.
        assert abs(mesh.volume - volume) <= area * chord + 1e-9 * volume
        errors.append(abs(mesh.volume - volume))
        assert sum(row[2] for row in part.labels) == pytest.approx(area, rel=1e-5)
    assert errors[1] <= max(0.5 * errors[0], 1e-6 * volume)


def test_meshes_are_closed_by_another_judge():
    manifold = pytest.importorskip("manifold3d")
    part = tessellated(BRACKET)
    given = manifold.Mesh(part.points.astype(np.float32), part.triangles)
    made = manifold.Manifold(given)
    assert made.status() == manifold.Error.NoError and made.genus() == 5
    assert made.volume() == pytest.approx(VOLUME, rel=1e-3)


def test_points_of_triangles_are_near_their_faces():
    """OCCT's own distance from middles of triangles and edges to the shape."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    chord = 0.05
    part = tessellated(BRACKET, chord)
    shape = cad.compound([s.shape for s in cad.Document(str(BRACKET)).solids()])
    shell = next(cad.parts(shape, "shell"))
    rng = np.random.default_rng(1)
    corners = part.points[part.triangles[rng.choice(len(part.triangles), 60)]]
    for p in np.concatenate([corners.mean(axis=1), corners[:, :2].mean(axis=1)]):
        assert BRepExtrema_DistShapeShape(BRepBuilderAPI_MakeVertex(gp_Pnt(*map(float, p))).Vertex(), shell).Value() <= chord


@pytest.mark.parametrize(("unit", "count"), [("INCH", 1), ("M", 1)])
def test_units_of_files_become_mm(unit, count, tmp_path):
    shape, volume, _ = shapes()["box"]
    part = tessellated(write(shape, tmp_path / "part.step", unit))
    assert lt.Mesh.of(part.points, part.triangles).volume == pytest.approx(volume, rel=1e-9)
    assert len(part.solids) == count


def assembly(path):
    """A block, and a pin twice: as it is, and turned to lie along x."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())

    def named(label, name):
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        return label

    block = named(tool.AddShape(BRepPrimAPI_MakeBox(10, 10, 10).Shape(), False), "block")
    pin = named(tool.AddShape(BRepPrimAPI_MakeCylinder(1, 5).Shape(), False), "pin")
    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 1, 0)), math.pi / 2)
    shift.SetTranslation(gp_Vec(30, 0, 0))
    whole = named(tool.NewShape(), "whole")
    tool.AddComponent(whole, block, TopLoc_Location())
    named(tool.AddComponent(whole, pin, TopLoc_Location(shift)), "upright")
    named(tool.AddComponent(whole, pin, TopLoc_Location(shift.Multiplied(shift).Multiplied(turn))), "lying")
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    writer.Transfer(document)
    writer.Write(str(path))
    return path


def test_solids_of_an_assembly_by_name(tmp_path):
    path = assembly(tmp_path / "whole.stp")
    every = tessellated(path, 0.01)
    mesh = lt.Mesh.of(every.points, every.triangles)
    assert mesh.pieces == 3 and mesh.volume == pytest.approx(1000 + 10 * math.pi, rel=1e-3)
    assert len(every.solids) == 3 and len(every.labels) == 12
    low, high = tessellated(path, solid="pin").points.min(axis=0), tessellated(path, solid="pin").points.max(axis=0)
    assert np.allclose([low, high], [[29, -1, -1], [65, 1, 5]], atol=0.02)
    lying = tessellated(path, solid="lying").points
    assert np.allclose([lying.min(axis=0), lying.max(axis=0)], [[60, -1, -1], [65, 1, 1]], atol=0.02)
    with pytest.raises(ValueError, match='no solid is named "bolt"; there are: block, lying, pin, upright, whole'):
        tessellated(path, solid="bolt")


def test_faces_without_solids_are_sewn(tmp_path):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    box = BRepPrimAPI_MakeBox(3, 4, 5).Shape()
    part = tessellated(write(cad.compound(list(cad.parts(box, "face"))), tmp_path / "faces.step"))
    mesh = lt.Mesh.of(part.points, part.triangles)
    assert part.volume is None and mesh.closed and abs(mesh.volume) == pytest.approx(60)
    with pytest.raises(ValueError, match="it holds no solid, only open faces; save the part as a solid"):
        tessellated(write(next(cad.parts(box, "face")), tmp_path / "face.step"))


def test_iges(tmp_path):
    from OCP.IGESControl import IGESControl_Writer

    writer = IGESControl_Writer()
    writer.AddShape(shapes()["tube"][0])
    writer.Write(str(tmp_path / "tube.igs"))
    part = tessellated(tmp_path / "tube.igs", 0.01)
    mesh = lt.Mesh.of(part.points, part.triangles)
    assert mesh.closed and abs(mesh.volume) == pytest.approx(shapes()["tube"][1], rel=3e-3)


def test_the_same_triangles_each_time():
    parts = [tessellated(BRACKET) for _ in range(2)]
    cad._read.cache_clear()
    parts.append(cad.read(BRACKET))
    for a in ("points", "triangles", "faces"):
        first, *others = (getattr(part, a) for part in parts)
        assert all(first.tobytes() == other.tobytes() for other in others)
    assert [tuple(label) for label in parts[0].labels] == parts[2].labels


def test_triangles_of_the_corpus():
    """Those that the core's own tests take are OCCT's."""
    files = ROOT / "corpus" / "designs" / "files"
    part, kept = tessellated(files / "box.step"), json.loads((files / "box.json").read_text())
    assert np.allclose(part.points, kept["points"], rtol=0, atol=1e-12)
    assert part.triangles.tolist() == kept["triangles"] and part.faces.tolist() == kept["faces"]
    assert [list(row[:2]) for row in part.labels] == kept["labels"]


DESIGN = """
schema = 1
units = "mm"
[region.mesh]
path = "bracket.step"
[lattice.a]
cell = "gyroid"
part = "sheet"
map.affine.wavelength = 14.0
level.fraction = 0.5
[skin]
thickness = 2.0
open = [{ faces = ["SEAT"] }]
[keep.bolts.faces]
named = ["BOLT"]
within = 3.0
[set.BORE.faces]
named = ["#ff0000"]
within = 0.03
"""


def test_a_bracket_with_open_and_solid_faces(tmp_path):
    shutil.copy(BRACKET, tmp_path)
    (tmp_path / "part.toml").write_text(DESIGN)
    solid = lt.load(tmp_path / "part.toml").build()
    (report,) = solid.report().region.tessellated
    assert report.path == "bracket.step" and report.faces == 14 and report.volume == pytest.approx(VOLUME, rel=1e-9)
    assert abs(report.volume_error) < 1e-3
    assert "triangles within 0.017 mm of 14 faces, its volume to +0.027 %" in str(solid.report())
    # Solid: round a bolt hole, in the skin of the top; empty somewhere on the seat, in a plane of the skin that is not there.
    around = [[22 + 5.5 * math.cos(t), 8 + 5.5 * math.sin(t), z] for t in np.linspace(0, 6, 20) for z in (0.2, 4.0, 7.5)]
    assert (solid.field(np.array(around)) < 0).all()
    x, y = np.meshgrid(np.linspace(30, 44, 40), np.linspace(14, 26, 30))
    plane = [np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3) for z in (0.5, 7.5)]
    assert (solid.field(plane[1]) < 0).all() and 0.1 < (solid.field(plane[0]) < 0).mean() < 0.6
    made = solid.mesh(edge=1.0)
    assert made.closed and made.pieces == 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        tets = solid.volume_mesh(edge=2.0)
    bore = tets.nodes[tets.sets["BORE"].nodes]
    off = np.hypot(bore[:, 1] - 20, bore[:, 2] - 30) - 10
    # The triangles are 0.017 mm off the bore at most; nodes are off these by the mean distance of chords of 2 mm, two thirds
    # of the sagitta, which balances the volume.
    off_most = 0.017 + 2 / 3 * 2**2 / (8 * 10)
    assert len(bore) > 200 and np.abs(off).max() < off_most and np.ptp(bore[:, 0]) == pytest.approx(8.0)


def test_commands_take_step(tmp_path, monkeypatch):
    shutil.copy(BRACKET, tmp_path / "b.STEP")
    monkeypatch.chdir(tmp_path)
    listed = json.loads(in_process("faces", "b.STEP", "--json"))
    names = [row["name"] for row in listed["faces"]]
    assert names.count("BOLT") == 4 and listed["volume"] == pytest.approx(VOLUME)
    assert [row["color"] for row in listed["faces"] if row["name"] == "BORE"] == ["#ff0000"]
    measured = json.loads(in_process("measure", "b.STEP", "--json"))
    assert measured["closed"] and measured["volume"] == pytest.approx(VOLUME, rel=1e-3)
    in_process("new", "new.toml", "--part", "b.STEP")
    assert 'path = "b.STEP"' in (tmp_path / "new.toml").read_text()


def test_tetrahedra_follow_a_part_from_a_file():
    region = lt.region.mesh(path=str(BRACKET))
    mesh = lt.TetMesh.of({"region": region, "lattice": {"a": {"map": lt.map.tets(size=8)}}})
    # Chords on holes of radius 3 and 10, at most as long as the radius.
    assert mesh.volume == pytest.approx(VOLUME, rel=0.02) and mesh.report()["quality"]["pieces"] == 1


@pytest.mark.parametrize("wrong", [{"chord": -1}, {"chord": float("nan")}, {"angle": 0}, {"angle": 100}, {"solid": 3}])
def test_accuracy_is_checked(wrong):
    (key,) = wrong
    with pytest.raises((ValueError, TypeError), match=rf"^{key} is .* must be"):
        cad.read(BRACKET, **wrong)


def test_damaged_files_are_refused_in_one_sentence(tmp_path):
    text = BRACKET.read_text()
    hollow = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    for name, content, words in (("other.step", "solid\n" * 9, "it is not a STEP file"), ("hollow.step", hollow, "holds")):
        (tmp_path / name).write_text(content)
        with pytest.raises(cad.Refused, match=words):
            tessellated(tmp_path / name)
    (tmp_path / "cut.step").write_text(text[: len(text) // 3])
    with pytest.raises(ValueError, match=r"cut\.step cannot be read: ") as found:
        cad.read(tmp_path / "cut.step")
    assert "\n" not in str(found.value) and "Traceback" not in str(found.value)
    with pytest.raises(ValueError, match=r"OCP did not finish within 0\.01 s"):
        cad.read(BRACKET, limit=0.01)


def test_without_the_extra(monkeypatch):
    monkeypatch.setattr(cad, "find_spec", lambda name: None)
    cad._read.cache_clear()
    with pytest.raises(ValueError, match=r"pip install 'trabecula\[cad\]'"):
        lt.Mesh.read(BRACKET)
