"""Parts from CAD systems (STEP, IGES) as closed triangle meshes with named faces: through OCP, in the extra ``cad``."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from functools import lru_cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

from ..base.given import positive
from . import children

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Part", "read"]

#: Bytes of memory that reading takes at most: of the interpreter with OCP, and for each byte of the file.
BASE, PER_BYTE = 6e9, 2000.0

#: The chord error unless one is asked for, as a share of the diagonal of the part's bounds; and the greatest angle (degrees)
#: between the normals of a surface within a triangle, or along an edge.
CHORD, ANGLE = 2e-4, 15.0

#: Gaps (share of the diagonal) that are sewn where a file has faces but no solids.
SEWN = 1e-5

#: What systems call a face that has no name; OCCT calls a component "=>" and a number then.
NAMELESS = ("none", "unknown")


class Part(NamedTuple):
    """A part from a CAD system, mm."""

    #: Vertices (n, 3) and triangles (m, 3); each solid is closed by itself.
    points: NDArray
    triangles: NDArray
    #: The face of each triangle, from 0.
    faces: NDArray
    #: Name, colour ("#rrggbb") and area (mm²) of each face; empty texts where there is none.
    labels: list[tuple[str, str, float]]
    #: Names of the solids that were read.
    solids: list[str]
    #: Chord error (mm) and angle (degrees) that were asked for.
    chord: float
    angle: float
    #: Volume (mm³) within the exact faces; None where faces were sewn.
    volume: float | None


def read(
    path: str | os.PathLike[str],
    chord: float | None = None,
    angle: float | None = None,
    solid: str | None = None,
    limit: float | None = None,
) -> Part:
    """The solids of a STEP or IGES file as triangles, in mm whatever the file's unit: all of them, or those named ``solid``.

    Triangles are within ``chord`` mm of their faces (a five-thousandth of the diagonal of the bounds unless given) and turn by
    at most ``angle`` degrees (15 unless given); vertices on an edge are those of both its faces, so that each solid is closed.
    Read in a process of its own, of at most ``limit`` seconds (60 and 20 for each MB, unless given) and of bounded memory.
    Raises ValueError for what cannot be read, holds no solid, or none of that name.
    """
    name = os.path.abspath(os.fsdecode(path))
    if not os.path.isfile(name):
        raise ValueError(f"{os.fsdecode(path)} does not exist" if not os.path.exists(name) else f"{path} is no file")
    about = os.stat(name)
    turn = ANGLE if angle is None else positive("angle", angle)
    if turn > 90:
        raise ValueError(f"angle is {turn:g}; it must be at most 90 degrees")
    if not (solid is None or isinstance(solid, str)):
        raise TypeError(f"solid is {solid!r}; it must be a name")
    chord = None if chord is None else positive("chord", chord)
    return _read(name, os.fsdecode(path), (about.st_size, about.st_mtime_ns), chord, turn, solid, limit)


@lru_cache(4)
def _read(
    name: str, shown: str, about: tuple, chord: float | None, angle: float, solid: str | None, limit: float | None
) -> Part:
    """As ``read``; a design names a file several times."""
    if find_spec("OCP") is None:
        raise ValueError(
            f"{shown}: STEP and IGES are read by OCP, which is not installed: pip install 'trabecula[cad]' "
            "(or export the part as stl or 3mf)"
        )
    size = about[0]
    seconds = 60 + 2e-5 * size if limit is None else limit
    given = json.dumps({"path": name, "chord": chord, "angle": angle, "solid": solid})
    arrays = children.arrays("cad", [given], shown, "OCP", BASE + PER_BYTE * size, seconds)
    points, triangles, faces, facts = arrays
    said = json.loads(facts.tobytes().decode())
    return Part(points, triangles, faces, **said | {"labels": [tuple(label) for label in said["labels"]]})


class Refused(ValueError):
    """What cannot be used, in words."""


class Key:
    """A shape as a key: the same geometry at the same place, in either orientation."""

    def __init__(self, shape: Any) -> None:
        self.shape = shape

    def __hash__(self) -> int:
        return hash(self.shape)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Key) and self.shape.IsSame(other.shape)


class Solid(NamedTuple):
    """A solid where it stands in the assembly, with the names that it goes by."""

    shape: Any
    #: The label of the shape in which it is.
    label: Any
    names: tuple[str, ...]


def child(given: str, made: str, memory: str) -> None:
    """Reads a file within ``memory`` bytes and writes its arrays; what is wrong with it is the last line of the words."""
    children.bound(float(memory))
    import numpy as np

    # OCCT prints.
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, sys.stdout.fileno())
    try:
        arrays = tessellated(**json.loads(given))
    except MemoryError:
        sys.exit(f"it takes more than {float(memory) / 1e9:.1f} GB of memory")
    except Refused as error:
        sys.exit(str(error))
    except Exception as error:
        words = " ".join(str(error).split())[:200]
        sys.exit(f"OCP does not read it ({type(error).__name__}: {words}); is it damaged?")
    np.savez(made, *arrays)


def tessellated(path: str, chord: float | None, angle: float, solid: str | None) -> tuple[NDArray, ...]:
    """The arrays of a file."""
    import math

    import numpy as np
    from OCP.BRepMesh import BRepMesh_IncrementalMesh

    document = Document(path)
    solids, whole = document.solids(), True
    if not solids:
        solids, whole = document.sewn(), False
    if solid is not None:
        known = sorted({n for s in solids for n in s.names if n})
        solids = [s for s in solids if solid in s.names]
        if not solids:
            raise Refused(f'no solid is named "{solid}"; there are: {", ".join(known) or "none with a name"}')
    together = compound([s.shape for s in solids])
    size = diagonal(together)
    if not (0.0 < size < math.inf):
        raise Refused("its solids have no extent")
    # OCCT's bounds are those of control points, and looser by tolerances.
    chord = float(f"{CHORD * size:.2g}") if chord is None else chord
    # In one thread, and as lengths: the same triangles each time.
    BRepMesh_IncrementalMesh(together, chord, False, math.radians(angle), False)
    mesh = Mesh()
    for one in solids:
        mesh.add(one, document)
    if not mesh.triangles:
        raise Refused("its faces could not be divided into triangles")
    if not whole and len(mesh.triangles) < 4:
        raise Refused("it holds no solid, only open faces; save the part as a solid in the program it came from")
    facts = {
        "labels": mesh.labels,
        "solids": [s.names[0] if s.names else "" for s in solids],
        "chord": chord,
        "angle": angle,
        "volume": sum(volume(s.shape) for s in solids) if whole else None,
    }
    points, triangles, faces = mesh.arrays()
    return points, triangles, faces, np.frombuffer(json.dumps(facts).encode(), np.uint8)


def compound(shapes: list[Any]) -> Any:
    """Shapes as one."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    out, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(out)
    for shape in shapes:
        builder.Add(out, shape)
    return out


def diagonal(shape: Any) -> float:
    """The diagonal of a shape's bounds, mm, or a little more."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box, False)
    if box.IsVoid():
        return 0.0
    low, high = box.CornerMin(), box.CornerMax()
    return float(low.Distance(high))


def volume(shape: Any) -> float:
    """The volume within the exact faces of a solid, mm³."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    of = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, of)
    return abs(float(of.Mass()))


def parts(shape: Any, kind: str) -> Iterator[Any]:
    """The faces, edges or solids of a shape, in its order, each as often as it is used."""
    from OCP import TopAbs
    from OCP.TopExp import TopExp_Explorer

    cast = {"face": face_of, "edge": edge_of}.get(kind, lambda shape: shape)
    explorer = TopExp_Explorer(shape, getattr(TopAbs, f"TopAbs_{kind.upper()}"))
    while explorer.More():
        yield cast(explorer.Current())
        explorer.Next()


def face_of(shape: Any) -> Any:
    """A shape as the face that it is."""
    from OCP.TopoDS import TopoDS

    return (getattr(TopoDS, "Face_s", None) or TopoDS.Face)(shape)


def edge_of(shape: Any) -> Any:
    """A shape as the edge that it is."""
    from OCP.TopoDS import TopoDS

    return (getattr(TopoDS, "Edge_s", None) or TopoDS.Edge)(shape)


def unplaced(shape: Any) -> Any:
    """A shape without the place that it has in an assembly."""
    from OCP.TopLoc import TopLoc_Location

    return shape.Located(TopLoc_Location())


class Document:
    """A file with its assembly, names and colours."""

    def __init__(self, path: str):
        from OCP.IFSelect import IFSelect_ReturnStatus
        from OCP.Interface import Interface_Static
        from OCP.TCollection import TCollection_ExtendedString
        from OCP.TDocStd import TDocStd_Document
        from OCP.XCAFDoc import XCAFDoc_DocumentTool

        self.step = path.lower().endswith((".step", ".stp"))
        reader = self.reader()
        reader.SetNameMode(True)
        reader.SetColorMode(True)
        Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
        Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1)
        if reader.ReadFile(path) != IFSelect_ReturnStatus.IFSelect_RetDone:
            raise Refused(f"it is not {'a STEP' if self.step else 'an IGES'} file, or damaged")
        document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
        if not reader.Transfer(document):
            raise Refused("it holds no shape, or damaged ones")
        self.document = document
        self.shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        self.colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())

    def reader(self) -> Any:
        """OCCT's reader of the format."""
        if self.step:
            from OCP.STEPCAFControl import STEPCAFControl_Reader

            return STEPCAFControl_Reader()
        from OCP.IGESCAFControl import IGESCAFControl_Reader

        return IGESCAFControl_Reader()

    def name(self, label: Any, shape: Any) -> str:
        """The name of a face or a solid of the shape of a label; empty if it has none."""
        from OCP.TDF import TDF_Label

        found = TDF_Label()
        return title(found) if self.shapes.FindSubShape(label, unplaced(shape), found) else ""

    def face(self, label: Any, face: Any) -> tuple[str, str]:
        """Name and colour of a face of the shape of a label."""
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorType

        name, colour = self.name(label, face), Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
            if self.colours.GetColor(unplaced(face), kind, colour):
                return name, hexadecimal(colour)
        return name, ""

    def solids(self) -> list[Solid]:
        """All solids, each where it stands, in the file's order."""
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        roots = [label for label in inner(self.shapes.Label()) if XCAFDoc_ShapeTool.IsFree_s(label)]
        return list(self.below(roots, None, ()))

    def below(self, labels: list[Any], place: Any, names: tuple[str, ...]) -> Iterator[Solid]:
        """The solids of labels: of components those of what they refer to, at their places."""
        from OCP.TDF import TDF_Label
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        for label in labels:
            known, here, of = (title(label), *names), place, label
            if XCAFDoc_ShapeTool.IsReference_s(label):
                of = TDF_Label()
                XCAFDoc_ShapeTool.GetReferredShape_s(label, of)
                own = XCAFDoc_ShapeTool.GetLocation_s(label)
                here = own if place is None else place.Multiplied(own)
                known = (title(of), *known)
            if XCAFDoc_ShapeTool.IsAssembly_s(of):
                yield from self.below(inner(of), here, known)
                continue
            shape = XCAFDoc_ShapeTool.GetShape_s(of)
            for solid in parts(shape, "solid"):
                goes_by = tuple(dict.fromkeys(n for n in (self.name(of, solid), *known) if n))
                yield Solid(solid if here is None else solid.Moved(here), of, goes_by)

    def sewn(self) -> list[Solid]:
        """The shells that the faces of a file without solids make, once they are sewn together."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        labels = [label for label in inner(self.shapes.Label()) if XCAFDoc_ShapeTool.IsFree_s(label)]
        together = compound([XCAFDoc_ShapeTool.GetShape_s(label) for label in labels])
        if next(parts(together, "face"), None) is None:
            raise Refused("it holds neither solids nor faces")
        sewing = BRepBuilderAPI_Sewing(SEWN * diagonal(together))
        sewing.Add(together)
        sewing.Perform()
        return [Solid(sewing.SewedShape(), labels[0], ())]


def inner(label: Any) -> list[Any]:
    """The labels right below a label."""
    from OCP.TDF import TDF_ChildIterator

    out, at = [], TDF_ChildIterator(label, False)
    while at.More():
        out.append(at.Value())
        at.Next()
    return out


def title(label: Any) -> str:
    """The name of a label; empty if it has none."""
    from OCP.TDataStd import TDataStd_Name

    name, kind = TDataStd_Name(), TDataStd_Name.GetID_s()
    # OCP crashes where there is none to be found.
    if not (label.IsAttribute(kind) and label.FindAttribute(kind, name)):
        return ""
    found = name.Get().ToExtString().strip()
    return "" if found.lower() in NAMELESS or found.startswith("=>") else found


def hexadecimal(colour: Any) -> str:
    """A colour as #rrggbb of sRGB, as drawing programs name it."""
    from OCP.Quantity import Quantity_TypeOfColor

    return "#" + "".join(f"{round(255 * v):02x}" for v in colour.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB))


class Mesh:
    """Triangles of solids: nodes of faces, joined where faces share an edge or a corner."""

    def __init__(self) -> None:
        self.points: list[tuple[float, float, float]] = []
        self.triangles: list[tuple[int, int, int]] = []
        self.faces: list[int] = []
        self.labels: list[tuple[str, str, float]] = []
        #: The node that each is joined to, at most itself.
        self.joined: list[int] = []

    def root(self, i: int) -> int:
        """The first of the nodes that node ``i`` is joined with."""
        while self.joined[i] != i:
            self.joined[i] = i = self.joined[self.joined[i]]
        return i

    def join(self, a: int, b: int) -> None:
        """Makes two nodes one."""
        a, b = self.root(a), self.root(b)
        self.joined[max(a, b)] = min(a, b)

    def add(self, solid: Solid, document: Document) -> None:
        """Adds a solid. Its own faces alone are joined: what touches it is another body."""
        from OCP.BRep import BRep_Tool
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps
        from OCP.TopAbs import TopAbs_Orientation
        from OCP.TopLoc import TopLoc_Location

        ends = Ends(self)
        for face in parts(solid.shape, "face"):
            area = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, area)
            number = len(self.labels)
            self.labels.append((*document.face(solid.label, face), abs(float(area.Mass()))))
            place = TopLoc_Location()
            divided = BRep_Tool.Triangulation_s(face, place)
            if divided is None:
                continue
            base = len(self.points)
            moved = place.Transformation()
            for i in range(1, divided.NbNodes() + 1):
                p = divided.Node(i).Transformed(moved)
                self.points.append((p.X(), p.Y(), p.Z()))
            self.joined.extend(range(base, len(self.points)))
            # A mirrored instance of a part is turned inside out.
            turned = (face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED) != moved.IsNegative()
            for i in range(1, divided.NbTriangles() + 1):
                a, b, c = (base - 1 + n for n in divided.Triangle(i).Get())
                self.triangles.append((a, c, b) if turned else (a, b, c))
                self.faces.append(number)
            for edge in parts(face, "edge"):
                polygon = BRep_Tool.PolygonOnTriangulation_s(edge, divided, place)
                if polygon is not None:
                    ends.meet(edge, [base - 1 + polygon.Node(i) for i in range(1, polygon.NbNodes() + 1)])

    def arrays(self) -> tuple[NDArray, ...]:
        """Points, triangles without those that joining made flat, and the face of each."""
        import numpy as np

        roots = np.array([self.root(i) for i in range(len(self.points))], dtype=np.int64)
        triangles = roots[np.array(self.triangles, dtype=np.int64)]
        a, b, c = triangles.T
        kept = (a != b) & (b != c) & (c != a)
        used, triangles = np.unique(triangles[kept], return_inverse=True)
        points = np.array(self.points, dtype=np.float64)[used]
        return points, triangles.reshape(-1, 3).astype(np.uint32), np.array(self.faces, dtype=np.uint32)[kept]


class Ends:
    """The nodes on the edges and corners of a solid."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.edges: dict[Key, list[int]] = {}
        self.corners: dict[Key, int] = {}

    def meet(self, edge: Any, nodes: list[int]) -> None:
        """Joins the nodes of a face along an edge with those of the face before it; the ends with those of other edges."""
        from OCP.TopAbs import TopAbs_Orientation
        from OCP.TopExp import TopExp

        before = self.edges.setdefault(Key(edge), nodes)
        if len(before) == len(nodes):
            for a, b in zip(before, nodes, strict=True):
                self.mesh.join(a, b)
        # Nodes follow the edge's parameter, whichever way a face uses it.
        forward = edge_of(edge.Oriented(TopAbs_Orientation.TopAbs_FORWARD))
        for corner, node in ((TopExp.FirstVertex_s(forward), nodes[0]), (TopExp.LastVertex_s(forward), nodes[-1])):
            if not corner.IsNull():
                self.mesh.join(self.corners.setdefault(Key(corner), node), node)


if __name__ == "__main__":
    child(*sys.argv[1:])
