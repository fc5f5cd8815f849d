"""Open CASCADE as an outside judge of STEP files: nothing of Trabecula is asked here."""

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve2d
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepClass import BRepClass_FaceClassifier
from OCP.BRepGProp import BRepGProp
from OCP.gp import gp_Pnt2d
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_FreeBounds
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_IN, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

EDGE, FACE = (getattr(TopoDS, name + "_s", None) or getattr(TopoDS, name) for name in ("Edge", "Face"))


def parts(shape, kind):
    """The parts of a shape of a kind, each as often as it is used."""
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def inner(face):
    """The place of a face's surface in the middle of its boundary, or none if that is not on the face."""
    at = []
    for edge in parts(face, TopAbs_EDGE):
        curve = BRepAdaptor_Curve2d(EDGE(edge), face)
        middle = curve.Value((curve.FirstParameter() + curve.LastParameter()) / 2)
        at.append([middle.X(), middle.Y()])
    u, v = np.mean(at, axis=0)
    if BRepClass_FaceClassifier(face, gp_Pnt2d(u, v), 1e-9).State() != TopAbs_IN:
        return []
    place = BRep_Tool.Surface_s(face).Value(u, v)
    return [[place.X(), place.Y(), place.Z()]]


def step_solid(path):
    """What is in a file: whether all is valid, numbers of solids, faces, free edges, the volume to 1e-9 (mm³), and a place in
    nearly each face (n, 3)."""
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    free = ShapeAnalysis_FreeBounds(shape, 1e-6, False, False)
    properties = GProp_GProps()
    BRepGProp.VolumePropertiesGK_s(shape, properties, 1e-9, False, True, False, False, False)
    faces = [FACE(face) for face in parts(shape, TopAbs_FACE)]
    return {
        "valid": BRepCheck_Analyzer(shape).IsValid(),
        "solids": sum(1 for _ in parts(shape, TopAbs_SOLID)),
        "faces": len(faces),
        "free_edges": sum(1 for wires in (free.GetClosedWires(), free.GetOpenWires()) for _ in parts(wires, TopAbs_EDGE)),
        "volume": properties.Mass(),
        "points": np.array([place for face in faces for place in inner(face)]),
    }
