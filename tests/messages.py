"""Rows of corpus/errors: designs and commands that are wrong in one way, and what is said of each.

A row is a table named by what is wrong. Its design is the good one below with other pieces (`region = ...`; an empty text
leaves a piece out), or a whole text (`design`, `json`, `bytes` in hexadecimal). `run` is evaluated with the solid that it
builds, `python` instead of building it, `command` is a command line. `files` are written into its folder, and of `MADE` those
that the row names.

The expected texts come last: `error` (line of the file, path of the key: sentence), `warnings`, and for a command its `status`
and its stderr (`says`). `scripts/snapshot_messages.py` writes these four.
"""

import contextlib
import io
import json
import os
import re
import struct
import sys
import warnings
import zlib
from pathlib import Path

import numpy as np
import trabecula as lt

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

CORPUS = Path(__file__).parent.parent / "corpus" / "errors"
SAID = ("error", "warnings", "status", "says")
GOOD = {
    "head": "schema = 1",
    "region": "{ box = { size = [8, 8, 8] } }",
    "cell": '"gyroid"',
    "part": '"sheet"',
    "map": "{ affine = { wavelength = 4 } }",
    "level": "{ fraction = 0.3 }",
    "more": "",
}


def rows():
    """File name, row name and row, of all."""
    for file in sorted(CORPUS.glob("*.toml")):
        for name, row in tomllib.loads(file.read_text(encoding="utf-8")).items():
            yield file.name, name, row


def design_text(row):
    """The design of a row as TOML."""
    if "design" in row:
        return row["design"] + "\n"
    of = GOOD | {k: v for k, v in row.items() if k in GOOD}
    lines = [of["head"]]
    for key in ("region", "cell", "part", "map", "level"):
        if key == "cell":
            lines.append("[lattice.core]")
        if of[key]:
            lines.append(f"{key} = {of[key]}")
    return "\n".join([*lines, of["more"]]) + "\n"


def off(vertices, triangles):
    """An OFF file."""
    lines = ["OFF", f"{len(vertices)} {len(triangles)} 0"]
    lines += [" ".join(map(str, v)) for v in vertices] + ["3 " + " ".join(map(str, t)) for t in triangles]
    return "\n".join(lines).encode()


CORNERS = [[x, y, z] for z in (-4, 4) for y in (-4, 4) for x in (-4, 4)]
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
CUBE = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]


def moved(by, scale=1.0):
    """The cube elsewhere."""
    return [[scale * v + s for v, s in zip(p, by, strict=True)] for p in CORNERS]


def two(first, second):
    """Two bodies in one file."""
    return off([*first, *second], CUBE + [[i + 8 for i in t] for t in CUBE])


def grid_mesh(n, missing=()):
    """A cube whose faces are n by n squares, with some triangles missing."""
    index, vertices, triangles = {}, [], []
    for a, b, _, d in QUADS:
        p, u, v = (np.array(CORNERS[i], float) for i in (a, b, d))
        at = lambda i, j: tuple(p + (u - p) * i / n + (v - p) * j / n)  # noqa: B023, E731
        for i in range(n):
            for j in range(n):
                square = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
                ids = [index.setdefault(q, len(index)) for q in square]
                triangles += [ids[:3], [ids[0], ids[2], ids[3]]]
    vertices = [list(q) for q in index]
    return off(vertices, [t for k, t in enumerate(triangles) if k not in missing])


def ball(n=12):
    """A ball of radius 3."""
    ring = [[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in np.pi * np.arange(1, n) / n
            for p in 2 * np.pi * np.arange(2 * n) / (2 * n)]  # fmt: skip
    vertices = [[3 * round(float(c), 6) for c in v] for v in [[0, 0, 1], *ring, [0, 0, -1]]]
    m, last = 2 * n, len(vertices) - 1
    node = lambda i, j: 1 + i * m + j % m  # noqa: E731
    triangles = [[0, node(0, j), node(0, j + 1)] for j in range(m)]
    for i in range(n - 2):
        for j in range(m):
            triangles += [[node(i, j), node(i + 1, j), node(i + 1, j + 1)], [node(i, j), node(i + 1, j + 1), node(i, j + 1)]]
    return off(vertices, triangles + [[last, node(n - 2, j + 1), node(n - 2, j)] for j in range(m)])


TETS = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]


def vtk(points, cells, kind=10, more=""):
    """A VTK file of cells of one kind."""
    lines = ["# vtk DataFile Version 3.0", "made", "ASCII", "DATASET UNSTRUCTURED_GRID", f"POINTS {len(points)} double"]
    lines += [" ".join(map(str, p)) for p in points]
    lines += [f"CELLS {len(cells)} {sum(len(c) + 1 for c in cells)}"] + [" ".join(map(str, [len(c), *c])) for c in cells]
    lines += [f"CELL_TYPES {len(cells)}", " ".join([str(kind)] * len(cells)), more]
    return "\n".join(lines).encode()


def data(values, count, where="CELL_DATA"):
    """Numbers on cells or points."""
    return f"{where} {count}\nSCALARS {'zone' if where == 'CELL_DATA' else 'a'} double 1\nLOOKUP_TABLE default\n{values}\n"


def array(name, components, values):
    """An array of a VTI file."""
    of = f'NumberOfComponents="{components}"'
    return f'<DataArray type="Float64" Name="{name}" {of} format="ascii">{" ".join(map(str, values))}</DataArray>'


def png(width, height, colour):
    """A picture, grey or in colours."""
    row = b"\0" + bytes(range(1, 1 + width * (3 if colour else 1)))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 2 if colour else 0, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(row * height)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def npy(values):
    """An NPY file."""
    out = io.BytesIO()
    np.save(out, np.asarray(values, float))
    return out.getvalue()


def wave(n=8):
    """cos 2πx + cos 4πy on a cell."""
    x = (np.arange(n) + 0.5) / n
    return np.round(np.cos(2 * np.pi * x)[:, None, None] + np.cos(4 * np.pi * x)[None, :, None] + 0 * x, 12)


def by_core(name, vertices, triangles):
    """A mesh as the package writes it."""
    lt.Mesh.of(np.array(vertices, float), np.array(triangles)).write(name)
    return Path(name).read_bytes()


def with_nan(values):
    """The first of them not a number."""
    values = np.array(values, float)
    values.flat[0] = np.nan
    return values


LINE = np.linspace(0.2, 0.4, 27).reshape(3, 3, 3)
IMAGE = (
    '<?xml version="1.0"?>\n<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian">\n'
    '<ImageData WholeExtent="0 1 0 1 0 1" Origin="-5 -5 -5" Spacing="10 10 10"><Piece Extent="0 1 0 1 0 1"><PointData>\n'
    f"{array('one', 1, [0.3] * 8)}\n{array('three', 3, [0, 0, 1] * 8)}\n{array('six', 6, [1, 2, 3, 0, 0, 0] * 8)}\n"
    "</PointData></Piece></ImageData></VTKFile>\n"
)
SPLIT = [*CORNERS, [0, 0, 0]]
MADE = {
    "cube.stl": lambda name: by_core(name, CORNERS, CUBE),
    "cube.3mf": lambda name: by_core(name, CORNERS, CUBE),
    "small.stl": lambda name: by_core(name, moved([0, 0, 0], 0.001), CUBE),
    "three.off": lambda _: off(CORNERS[:3], [[0, 1, 2]] * 3),
    "flat.off": lambda _: off([[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0]], [[0, 1, 2], [1, 3, 2], [0, 2, 1], [1, 2, 3]]),
    "open.off": lambda _: off(CORNERS, CUBE[2:]),
    "pierced.off": lambda _: grid_mesh(6, {20}),
    "turned.off": lambda _: off(CORNERS, [t[::-1] for t in CUBE]),
    "one_turned.off": lambda _: off(CORNERS, [CUBE[0][::-1], *CUBE[1:]]),
    "double.off": lambda _: off(CORNERS, [*CUBE, CUBE[0]]),
    "crossing.off": lambda _: two(CORNERS, moved([3, 3, 3])),
    "nested.off": lambda _: two(CORNERS, moved([0, 0, 0], 0.5)),
    "gaps.off": lambda _: off([*CORNERS, [-4.0000001, -4, -4]], [(8, *CUBE[0][1:]), *CUBE[1:]]),
    "needles.off": lambda _: off([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], [[0, 1, 2], [1, 2, 3], [0, 1, 3], [0, 2, 3]]),
    "ball.off": lambda _: ball(),
    "cell.npy": lambda _: npy(wave()),
    "flat.npy": lambda _: npy(np.ones((3, 3))),
    "few.npy": lambda _: npy(np.ones((2, 2, 2))),
    "ones.npy": lambda _: npy(np.ones((8, 8, 8))),
    "nan.npy": lambda _: npy(with_nan(np.full((4, 4, 4), 0.3))),
    "grid.npy": lambda _: npy(LINE),
    "high.npy": lambda _: npy(LINE + 1),
    "image.vti": lambda _: IMAGE.encode(),
    "image.vtk": lambda _: (
        b"# vtk DataFile Version 3.0\nmade\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN -5 -5 -5\n"
        b"SPACING 10 10 10\nPOINT_DATA 8\nSCALARS a double 1\nLOOKUP_TABLE default\n1 1 1 1 1 1 1 1\n"
    ),
    "tets.vtk": lambda _: vtk(moved([0, 0, 0], 0.5), TETS, more=data("1 1 1 2 2 2", 6)),
    "nan.vtk": lambda _: vtk(CORNERS, TETS, more=data("nan 0 0 0 0 0 0 0", 8, "POINT_DATA")),
    "empty.vtk": lambda _: vtk(CORNERS, TETS, more="POINT_DATA 8\nFIELD f 1\na 0 8 double\n"),
    "hex.vtk": lambda _: vtk(CORNERS, [[0, 1, 3, 2, 4, 5, 7, 6]], 12),
    "triangles.vtk": lambda _: vtk(CORNERS, CUBE, 5),
    "inverted.vtk": lambda _: vtk(CORNERS, [[1, 0, 3, 7], *TETS[1:]]),
    "all_turned.vtk": lambda _: vtk(CORNERS, [[b, a, c, d] for a, b, c, d in TETS]),
    "flat.vtk": lambda _: vtk(CORNERS, [*TETS, [0, 1, 2, 3]]),
    "three.vtk": lambda _: vtk([*CORNERS, [-8, 0, 8]], [*TETS, [0, 3, 7, 8], [0, 7, 3, 8]]),
    "overlap.vtk": lambda _: vtk([*CORNERS, [3, -3.5, -3]], [*TETS, [0, 3, 7, 8]]),
    "hanging.vtk": lambda _: vtk(SPLIT, [*TETS[:5], [0, 5, 1, 8], [8, 5, 1, 7]]),
    "double.vtk": lambda _: vtk([*CORNERS, CORNERS[0]], [[8, *TETS[0][1:]], *TETS[1:]]),
    "pieces.vtk": lambda _: vtk([*moved([-2, 0, 0], 0.4), *moved([2, 0, 0], 0.4)], TETS + [[i + 8 for i in t] for t in TETS]),
    "beyond.vtk": lambda _: vtk(CORNERS, [[0, 1, 3, 70], *TETS[1:]]),
    "infinite.vtk": lambda _: vtk([["inf", 0, 0], *CORNERS[1:]], TETS),
    "points.csv": lambda _: b"x,y,z,v\n0,0,0,0.3\n1,1,1,0.4\n",
    "mesh.vtu": lambda name: lt.TetMesh.read(made("tets.vtk")).write(name) or Path(name).read_bytes(),
    "grey.png": lambda _: png(3, 3, False),
    "grey2.png": lambda _: png(4, 3, False),
    "colour.png": lambda _: png(3, 3, True),
}


def made(name):
    """Writes the file of this name."""
    Path(name).write_bytes(MADE[name](name))
    return name


def lay_out(row):
    """Writes the design of a row and the files that it names into the current folder; gives the design's name."""
    text = repr(row)
    for name in (n for n in MADE if n in text):
        made(name)
    for name in re.findall(r"folder\.\w+", text):
        Path(name).mkdir(exist_ok=True)
    for name, content in row.get("files", {}).items():
        Path(name).write_text(content, encoding="utf-8")
    name = "design.json" if "json" in row else "design.toml"
    if "bytes" in row:
        Path(name).write_bytes(bytes.fromhex(row["bytes"]))
    else:
        Path(name).write_text(row["json"] if "json" in row else design_text(row), encoding="utf-8")
    return name


def plain(text, name="design.toml"):
    """The text without the names of folders and of the design's file."""
    here = os.getcwd()
    text = text.replace(os.path.realpath(here) + os.sep, "").replace(here + os.sep, "").replace(os.path.realpath(here), ".")
    text = re.sub(r"and \S+ \w+ is free; try (\w+) \S+ mm", r"and … is free; try \1 … mm", text)
    return re.sub(rf"^{re.escape(name)}:(?=\d| )", "", text).strip()


def said(row):
    """What is said of a row; it is run in the current folder, which is empty."""
    name = lay_out(row)
    if "command" in row:
        return of_command(row["command"])
    found = {}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        names = {"lt": lt, "np": np}
        try:
            if "python" in row:
                eval(row["python"], names)
            else:
                names["solid"] = lt.load(name).build()
                eval(row.get("run", "None"), names)
        except (lt.DesignError, ValueError, TypeError, OSError) as error:
            kind = "" if isinstance(error, (lt.DesignError)) else type(error).__name__ + ": "
            found["error"] = kind + plain(str(error), name)
    if caught:
        found["warnings"] = [plain(str(w.message)) for w in caught]
    return found


def of_command(words):
    """The exit status of a command and what it writes on stderr, without times."""
    from trabecula.command import cli

    err, out = io.StringIO(), io.StringIO()
    with contextlib.redirect_stderr(err), contextlib.redirect_stdout(out):
        shown = warnings.showwarning
        try:
            status = cli.main(words)
        except SystemExit as leave:
            status = leave.code
        finally:
            warnings.showwarning = shown
    text = re.sub(r"\d+\.\d+ s\b", "… s", err.getvalue())
    return {"status": status, "says": [plain(line) for line in text.splitlines()]}


def written(found):
    """What is said, as TOML."""
    lines = []
    for key, value in found.items():
        if isinstance(value, list) and value:
            lines += [f"{key} = [", *(f"    {json.dumps(v, ensure_ascii=False)}," for v in value), "]"]
        else:
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit("run scripts/snapshot_messages.py")
