#!/usr/bin/env python3
"""Writes the STEP files of the examples and the corpus, with named faces; needs the extra `cad`.

    python scripts/step_parts.py

Next to the corpus's file stand its triangles, for the core's own tests, which have no reader of STEP.
"""

import json
import re
from pathlib import Path

from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.BRepTools import BRepTools
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool
from trabecula.io import cad

ROOT = Path(__file__).resolve().parent.parent


def box(low, high):
    return BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()


def rod(base, axis, radius, height):
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*base), gp_Dir(*axis)), radius, height).Shape()


def middle(of):
    """The middle of a face or an edge by its parameters, as numbers."""
    surface = BRepAdaptor_Surface(of)
    low_u, high_u, low_v, high_v = BRepTools.UVBounds_s(of)
    p = surface.Value((low_u + high_u) / 2, (low_v + high_v) / 2)
    return p.X(), p.Y(), p.Z()


def radius(face):
    """The radius of a cylindrical face, else None."""
    surface = BRepAdaptor_Surface(face)
    return surface.Cylinder().Radius() if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Cylinder else None


def bracket():
    """A plate of 60 x 40 x 8 mm with four bolt holes of 6 mm, and an upright of 8 mm with a bore of 20 mm, the corner between
    them filleted by 6 mm."""
    body = BRepAlgoAPI_Fuse(box((0, 0, 0), (60, 40, 8)), box((0, 0, 0), (8, 40, 45))).Shape()
    whole = ShapeUpgrade_UnifySameDomain(body)
    whole.Build()
    body = whole.Shape()
    fillet = BRepFilletAPI_MakeFillet(body)
    for edge in cad.parts(body, "edge"):
        ends = [BRep_Tool.Pnt_s(v) for v in vertices(edge)]
        if all(abs(p.X() - 8) < 1e-6 and abs(p.Z() - 8) < 1e-6 for p in ends):
            fillet.Add(6.0, edge)
    body = fillet.Shape()
    for x in (22, 52):
        for y in (8, 32):
            body = BRepAlgoAPI_Cut(body, rod((x, y, -1), (0, 0, 1), 3, 10)).Shape()
    return BRepAlgoAPI_Cut(body, rod((-1, 20, 30), (1, 0, 0), 10, 10)).Shape()


def vertices(edge):
    from OCP.TopExp import TopExp

    return TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)


def bracket_label(face):
    if radius(face) == 3:
        return "BOLT", None
    if radius(face) == 10:
        return "BORE", (1.0, 0.0, 0.0)
    return ("SEAT", None) if middle(face)[2] == 0 else ("", None)


def box_label(face):
    x, _, z = middle(face)
    return ("TOP", None) if z == 5 else ("", (0.0, 0.0, 1.0)) if x == -5 else ("", None)


def write(shape, name, path, label):
    """Writes a shape with names and colours of faces; the same bytes each time."""
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    shapes, colours = (tool(document.Main()) for tool in (XCAFDoc_DocumentTool.ShapeTool_s, XCAFDoc_DocumentTool.ColorTool_s))
    whole = shapes.AddShape(shape, False)
    TDataStd_Name.Set_s(whole, TCollection_ExtendedString(name))
    for face in cad.parts(shape, "face"):
        title, colour = label(face)
        if title or colour:
            sub = shapes.AddSubShape(whole, face)
            if title:
                TDataStd_Name.Set_s(sub, TCollection_ExtendedString(title))
            if colour:
                as_colour = Quantity_Color(*colour, Quantity_TypeOfColor.Quantity_TOC_sRGB)
                colours.SetColor(sub, as_colour, XCAFDoc_ColorType.XCAFDoc_ColorSurf)
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    writer.SetColorMode(True)
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    writer.Transfer(document)
    writer.Write(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"FILE_NAME\('[^']*','[^']*'", f"FILE_NAME('{name}','2026-01-01T00:00:00'", text, count=1))


def main():
    write(bracket(), "bracket", ROOT / "examples/parts/bracket.step", bracket_label)
    path = ROOT / "corpus/designs/files/box.step"
    write(box((-5, -5, -5), (5, 5, 5)), "box", path, box_label)
    part = cad.read(path)
    made = {
        "points": part.points.tolist(),
        "triangles": part.triangles.tolist(),
        "faces": part.faces.tolist(),
        "labels": [row[:2] for row in part.labels],
        "volume": part.volume,
    }
    path.with_suffix(".json").write_text(json.dumps(made) + "\n")


if __name__ == "__main__":
    main()
