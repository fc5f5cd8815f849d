"""3MF with the volumetric and implicit extensions (drafts of 2022-01 and 2023-12): a part as a function of position.

The function is the solid's own field, max(region, lattice), written out in the nodes that the implicit extension has. Source:
3MF Consortium, Volumetric Extension 0.8.0, implicit.xsd and volumetric.xsd.
"""

from __future__ import annotations

import itertools
import math
import os
import zipfile
from typing import Any
from xml.sax.saxutils import quoteattr

from .. import _core
from ..base.files import extension, whole_file
from ..base.paths import data_of
from .beam_files import region_mesh

__all__ = ["Expressions", "save_implicit"]

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..base.resolution import Resolution

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
VOLUMETRIC = "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01"
IMPLICIT = "http://schemas.3mf.io/3dmanufacturing/implicit/2023/12"
FILES = {
    "[Content_Types].xml": '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n',
    "_rels/.rels": '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="rel0" Target="/3D/3dmodel.model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n',
}
#: Names of a formula's functions of one number, and those of the extension's nodes.
FUNCTIONS = {
    **{name: name for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "abs")},
    **{"asin": "arcsin", "acos": "arccos", "atan": "arctan", "floor": "floor", "ceil": "ceil", "sign": "sign"},
}
#: Operations on two values that have a node of their own.
PAIRS = {
    **{"+": "addition", "-": "subtraction", "*": "multiplication", "/": "division"},
    **{"min": "min", "max": "max", "atan2": "arctan2"},
}


class Unsupported(ValueError):
    """What the extension cannot say."""

    def __init__(self, what: str) -> None:
        super().__init__(f"an implicit 3MF cannot hold {what}; write a mesh (3mf, stl) instead")


class Expressions:
    """The nodes of a function, each once. A value is the reference of a scalar or of a vector: ``node.output``."""

    POSITION = "inputs.pos"

    def __init__(self) -> None:
        self.nodes: list[str] = []
        self.known: dict[str, str] = {}

    def node(self, kind: str, inputs: Sequence[tuple[str, str, str]], output: str, more: str = "") -> str:
        """A node of some kind with inputs (type, name, reference) and one output (type); the reference of that."""
        name = {"constant": "value", "constvec": "vector", "mesh": "distance"}.get(kind, "result")
        body = "".join(f'<i:{of}ref identifier="{key}" ref="{ref}"/>' for of, key, ref in inputs)
        body = (f"<i:in>{body}</i:in>" if inputs else "") + f'<i:out><i:{output} identifier="{name}"/></i:out>'
        key = kind + more + body
        if key not in self.known:
            identifier = f"n{len(self.nodes)}"
            self.nodes.append(f'<i:{kind} identifier="{identifier}"{more}>{body}</i:{kind}>\n')
            self.known[key] = f"{identifier}.{name}"
        return self.known[key]

    def constant(self, v: float) -> str:
        """A number."""
        return self.node("constant", (), "scalar", f' value="{float(v)!r}"')

    def vector(self, v: Sequence[float]) -> str:
        """A constant vector."""
        x, y, z = (repr(float(c)) for c in v)
        return self.node("constvec", (), "vector", f' x="{x}" y="{y}" z="{z}"')

    def one(self, kind: str, a: str, of: str = "scalar", to: str = "scalar") -> str:
        """A function of one value."""
        return self.node(kind, [(of, "A", a)], to)

    def two(self, kind: str, a: str, b: str, of: str = "scalar", to: str = "scalar") -> str:
        """A function of two values."""
        return self.node(kind, [(of, "A", a), (of, "B", b)], to)

    def dot(self, v: Sequence[float]) -> str:
        """v · position."""
        return self.two("dot", self.POSITION, self.vector(v), "vector")

    def component(self, vector: str, axis: int) -> str:
        """A coordinate of a vector."""
        body = f'<i:in><i:vectorref identifier="A" ref="{vector}"/></i:in><i:out>'
        body += "".join(f'<i:scalar identifier="{a}"/>' for a in "xyz") + "</i:out>"
        key = "decomposevector" + body
        if key not in self.known:
            identifier = f"n{len(self.nodes)}"
            self.nodes.append(f'<i:decomposevector identifier="{identifier}">{body}</i:decomposevector>\n')
            self.known[key] = identifier
        return f"{self.known[key]}.{'xyz'[axis]}"

    def sum(self, terms: Sequence[str]) -> str:
        """The sum of some values."""
        total = terms[0]
        for term in terms[1:]:
            total = self.two("addition", total, term)
        return total

    def negative(self, a: str) -> str:
        """-a."""
        return self.two("subtraction", self.constant(0.0), a)

    def clamp(self, a: str, low: float | str, high: float | str) -> str:
        """a, at least low and at most high."""
        low, high = (v if isinstance(v, str) else self.constant(v) for v in (low, high))
        return self.two("max", low, self.two("min", a, high))

    def text(self, identifier: int, output: str) -> str:
        """The function as an element."""
        return (
            f'<i:implicitfunction id="{identifier}" displayname="part">\n<i:in><i:vector identifier="pos"/></i:in>\n'
            + "".join(self.nodes)
            + f'<i:out><i:scalarref identifier="shape" ref="{output}"/></i:out>\n</i:implicitfunction>\n'
        )


def save_implicit(solid: Resolution, path: str | os.PathLike[str]) -> dict[str, Any]:
    """As ``Solid.save_implicit``."""
    extension(path, ("3mf",))
    design = data_of(solid._core.design)
    for key, what in [("blend", "a blend"), ("skin", "a skin"), ("keep", "keep zones"), ("beams", "beams")]:
        if design.get(key):
            more = "" if key != "beams" else ": save_beams writes them as such"
            raise Unsupported(what + more)
    write = Expressions()
    (name, lattice), *_ = design["lattice"].items()
    inside = lattice_value(write, solid, name, lattice)
    shape, whole = region_value(write, design["region"])
    vertices, triangles = bounding(solid._core.bounds)
    if whole:
        mesh = region_mesh(solid._core)
        vertices, triangles = mesh.vertices.tolist(), mesh.triangles.tolist()
    result = write.two("max", shape, inside)
    title = os.path.splitext(os.path.basename(os.fsdecode(path)))[0]
    model = model_text(title, write.text(2, result), vertices, triangles, boxed=not whole)
    with whole_file(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as out:
        for file, text in (*FILES.items(), ("3D/3dmodel.model", model)):
            # A fixed date: the bytes depend on the content alone.
            out.writestr(zipfile.ZipInfo(file, (1980, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED, 9)
    return {"nodes": len(write.nodes), "triangles": len(triangles), "bytes": os.path.getsize(path)}


def lattice_value(write: Expressions, solid: Resolution, name: str, lattice: dict) -> str:
    """The lattice's own field: negative in it."""
    (kind,) = lattice["map"]
    if kind == "tets":
        raise Unsupported(f"lattice.{name}: a lattice over tetrahedra (map.tets)")
    terms = _core.lattice_terms(solid._core, name)
    if terms.affine is None:
        raise Unsupported(f"lattice.{name}: map.{kind}, which is not affine")
    if terms.distance:
        raise Unsupported(f"lattice.{name}: a thickness, for which the field is a tabulated distance; give its iso or fraction")
    matrix, shift = terms.affine
    waves = []
    for hkl, amplitude, phase in terms.waves:
        # cos 2π(h·(M x + b) + phase) = cos(k·x + φ), the phase reduced to one turn.
        k = [2 * math.pi * sum(h * row[a] for h, row in zip(hkl, matrix, strict=True)) for a in range(3)]
        turns = sum(h * b for h, b in zip(hkl, shift, strict=True)) + phase
        angle = 2 * math.pi * math.remainder(turns, 1.0)
        at = write.dot(k) if angle == 0.0 else write.two("addition", write.dot(k), write.constant(angle))
        waves.append(write.two("multiplication", write.constant(amplitude), write.one("cos", at)))
    f = write.sum(waves)
    t = write.constant(terms.level) if terms.level is not None else graded_level(write, name, lattice["level"])
    if terms.part == "sheet":
        return write.two("subtraction", write.one("abs", f), t)
    return write.two("subtraction", f, t) if terms.part == "lower" else write.two("subtraction", t, f)


def graded_level(write: Expressions, name: str, level: dict) -> str:
    """A level that varies: an iso that is linear or a formula."""
    (kind,) = level
    if kind != "iso":
        raise Unsupported(f"lattice.{name}: a {kind} that varies, whose level is tabulated; give its iso as a grade")
    (grade,) = level["iso"]
    of = level["iso"][grade]
    if grade == "formula":
        return formula(write, of)
    if grade != "linear":
        raise Unsupported(f"lattice.{name}: the grade {grade}; linear and formula can be written")
    s = write.dot(of["along"])
    stops = of["stops"]
    parts = [write.constant(stops[0][1])]
    for (a, va), (b, vb) in itertools.pairwise(stops):
        share = write.two("division", write.two("subtraction", s, write.constant(a)), write.constant(b - a))
        parts.append(write.two("multiplication", write.constant(vb - va), write.clamp(share, 0.0, 1.0)))
    return write.sum(parts)


def formula(write: Expressions, text: str) -> str:
    """A formula in x, y and z, by the program that the core runs."""
    stack: list[str] = []
    # The number that a reference stands for, if it is one.
    numbers: dict[str, float] = {}
    for word, number in _core.formula_terms(text):
        if word == "number":
            stack.append(write.constant(number))
            numbers[stack[-1]] = number
        elif word in ("x", "y", "z"):
            stack.append(write.component(write.POSITION, "xyz".index(word)))
        elif word in ("clamp", "smoothstep"):
            a, b, c = [stack.pop() for _ in range(3)][::-1]
            stack.append(_three(write, word, a, b, c))
        elif word == "negate":
            stack.append(write.negative(stack.pop()))
        elif word in FUNCTIONS:
            stack.append(write.one(FUNCTIONS[word], stack.pop()))
        else:
            b, a = stack.pop(), stack.pop()
            stack.append(_two(write, word, a, b, numbers.get(b)))
    return stack[0]


def _two(write: Expressions, word: str, a: str, b: str, number: float | None) -> str:
    """An operation on two values; ``number`` is the second if it is one."""
    if word in PAIRS:
        return write.two(PAIRS[word], a, b)
    if word == "^":
        if number not in (2, 3):
            return write.two("pow", a, b)
        square = write.two("multiplication", a, a)
        return square if number == 2 else write.two("multiplication", square, a)
    if word == "hypot":
        return write.one("sqrt", write.sum([write.two("multiplication", v, v) for v in (a, b)]))
    if word == "mod":
        whole = write.one("floor", write.two("division", a, b))
        return write.two("subtraction", a, write.two("multiplication", b, whole))
    assert word == "step", word
    # 1 from the edge on: sign is 1 below it, 0 at it.
    below = write.two("max", write.constant(0.0), write.one("sign", write.two("subtraction", a, b)))
    return write.two("subtraction", write.constant(1.0), below)


def _three(write: Expressions, word: str, a: str, b: str, c: str) -> str:
    """``clamp(a, low, high)`` or ``smoothstep(from, to, c)``."""
    if word == "clamp":
        return write.two("min", write.two("max", a, b), c)
    if a == b:
        return _two(write, "step", a, c, None)
    share = write.two("division", write.two("subtraction", c, a), write.two("subtraction", b, a))
    t = write.clamp(share, 0.0, 1.0)
    steep = write.two("subtraction", write.constant(3.0), write.two("multiplication", write.constant(2.0), t))
    return write.two("multiplication", write.two("multiplication", t, t), steep)


def region_value(write: Expressions, region: dict) -> tuple[str, bool]:
    """The region's signed distance; whether it is taken from the mesh in the file."""
    (kind,) = region
    of = region[kind]
    if kind in ("union", "intersection", "difference"):
        parts = [region_value(write, r) for r in of]
        total = parts[0][0]
        for value, _ in parts[1:]:
            other = write.negative(value) if kind == "difference" else value
            total = write.two("min" if kind == "union" else "max", total, other)
        if any(whole for _, whole in parts):
            raise Unsupported(f"a {kind} of meshes; combine them to one mesh first")
        return total, False
    if kind == "offset":
        value, whole = region_value(write, of["of"])
        return write.two("subtraction", value, write.constant(of["by"])), whole
    if kind == "mesh":
        write.nodes.append(
            '<i:constresourceid identifier="region" value="1"><i:out><i:resourceid identifier="value"/></i:out>'
            '</i:constresourceid>\n<i:mesh identifier="distance"><i:in><i:vectorref identifier="pos" ref="inputs.pos"/>'
            '<i:resourceref identifier="mesh" ref="region.value"/></i:in><i:out><i:scalar identifier="distance"/></i:out>'
            "</i:mesh>\n"
        )
        return "distance.distance", True
    shapes = {"box": box, "sphere": sphere, "halfspace": halfspace, "cylinder": cylinder}
    if kind not in shapes:
        raise Unsupported(f"region.{kind}; {', '.join(shapes)}, mesh and their combinations can be written")
    return shapes[kind](write, of), False


def from_point(write: Expressions, center: Sequence[float]) -> str:
    """Position − centre."""
    return write.two("subtraction", write.POSITION, write.vector(center), "vector", "vector")


def outside_and_inside(write: Expressions, q: Sequence[str]) -> str:
    """|max(q, 0)| + min(max q, 0): the signed distance of a product of intervals."""
    zero = write.constant(0.0)
    out = [write.two("max", c, zero) for c in q]
    length = write.one("sqrt", write.sum([write.two("multiplication", c, c) for c in out]))
    most = q[0]
    for c in q[1:]:
        most = write.two("max", most, c)
    return write.two("addition", length, write.two("min", most, zero))


def box(write: Expressions, of: dict) -> str:
    """Signed distance of a box."""
    if "size" in of:
        center, half = of.get("center", [0.0] * 3), [0.5 * s for s in of["size"]]
    else:
        pairs = list(zip(of["min"], of["max"], strict=True))
        center, half = [0.5 * (a + b) for a, b in pairs], [0.5 * (b - a) for a, b in pairs]
    p = from_point(write, center)
    q = [write.two("subtraction", write.one("abs", write.component(p, a)), write.constant(half[a])) for a in range(3)]
    return outside_and_inside(write, q)


def sphere(write: Expressions, of: dict) -> str:
    """Signed distance of a ball."""
    length = write.one("length", from_point(write, of.get("center", [0.0] * 3)), "vector")
    return write.two("subtraction", length, write.constant(of["radius"]))


def halfspace(write: Expressions, of: dict) -> str:
    """Signed distance of a half-space."""
    size = math.hypot(*of["normal"])
    normal = [c / size for c in of["normal"]]
    return write.two("dot", from_point(write, of["point"]), write.vector(normal), "vector")


def cylinder(write: Expressions, of: dict) -> str:
    """Signed distance of a cylinder."""
    axis = of.get("axis", [0.0, 0.0, 1.0])
    size = math.hypot(*axis)
    axis = [c / size for c in axis]
    middle = [b + 0.5 * of["height"] * a for a, b in zip(axis, of["base"], strict=True)]
    p = from_point(write, middle)
    along = write.two("dot", p, write.vector(axis), "vector")
    # The cross product with a unit vector is as long as the distance from the axis, and exact near it.
    across = write.one("length", write.two("cross", p, write.vector(axis), "vector", "vector"), "vector")
    q = [
        write.two("subtraction", across, write.constant(of["radius"])),
        write.two("subtraction", write.one("abs", along), write.constant(0.5 * of["height"])),
    ]
    return outside_and_inside(write, q)


def model_text(title: str, function: str, vertices: Sequence, triangles: Sequence, boxed: bool) -> str:
    """The model: the region's mesh or its bounds, the function, and the object that they make."""
    points = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n' for x, y, z in vertices)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in triangles)
    only = ' meshbboxonly="true"' if boxed else ""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xml:lang="en-US" xmlns="{CORE}" '
        f'xmlns:v="{VOLUMETRIC}" xmlns:i="{IMPLICIT}" requiredextensions="v i">\n'
        f'<metadata name="Title">{quoteattr(title)[1:-1]}</metadata>\n'
        f'<metadata name="Application">Trabecula {_core.__version__}</metadata>\n<resources>\n'
        f'<object id="1" type="model" name="region">\n<mesh>\n<vertices>\n{points}</vertices>\n<triangles>\n{faces}'
        f"</triangles>\n</mesh>\n</object>\n{function}"
        f'<object id="3" type="model" name={quoteattr(title)}>\n<v:levelset functionid="2" channel="shape" meshid="1"{only}/>\n'
        "</object>\n</resources>\n"
        '<build>\n<item objectid="3"/>\n</build>\n</model>\n'
    )


#: The triangles of a box whose corners are numbered by the bits of x, y, z.
BOX = [
    *((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4)),
    *((2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)),
]


def bounding(bounds: Sequence[Sequence[float]]) -> tuple[list, list]:
    """The box of these bounds as a mesh."""
    return [[float(bounds[i >> a & 1][a]) for a in range(3)] for i in range(8)], BOX
