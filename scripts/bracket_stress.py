"""A bracket under load, and what turning and grading its lattice along the stress does for it.

Solves linear elasticity on voxels: of the full bracket, for examples/results/bracket_stress.vtu, along which the lattice of
examples/stress_bracket.toml is laid; and, with --compare, of that lattice and of others of the same mass, uniform, only turned
and only graded, for docs/generated/bracket.md.

Elements are trilinear cubes of one material (E = 1, ν = 0.3), so all share one stiffness matrix and none is assembled. The
equations are solved by conjugate gradients with the diagonal as preconditioner.
"""

import argparse
import base64
import itertools
import zlib
from pathlib import Path

import numpy as np
import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
DESIGN = ROOT / "examples" / "stress_bracket.toml"
RESULT = ROOT / "examples" / "results" / "bracket_stress.vtu"
TABLE = ROOT / "docs" / "generated" / "bracket.md"

#: The bracket (mm): a gusset, held at the wall x = 0, pulled down at its end; from there its height grows towards the wall.
LENGTH, HEIGHT, DEPTH, END = 60.0, 60.0, 12.0, 24.0
POISSON = 0.3
#: Corners of an element, x fastest, and the order in which VTK numbers those of a hexahedron.
CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))[:, ::-1]
HEXAHEDRON = [0, 1, 3, 2, 4, 5, 7, 6]


def elasticity():
    """Stress from strain in Voigt order 11 22 33 23 13 12, shears as angles."""
    lame, shear = POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), 0.5 / (1 + POISSON)
    matrix = np.diag([2 * shear] * 3 + [shear] * 3)
    matrix[:3, :3] += lame
    return matrix


def strain(at):
    """Strain (6) from the displacements of an element's corners (24) at a point of the unit cube."""
    slope = np.empty((8, 3))
    for a in range(3):
        factors = np.where(CORNERS == 1, at, 1 - np.asarray(at))
        factors[:, a] = 2 * CORNERS[:, a] - 1
        slope[:, a] = factors.prod(axis=1)
    matrix = np.zeros((6, 8, 3))
    for a in range(3):
        matrix[a, :, a] = slope[:, a]
    for row, (a, b) in zip((3, 4, 5), ((1, 2), (0, 2), (0, 1)), strict=True):
        matrix[row, :, a], matrix[row, :, b] = slope[:, b], slope[:, a]
    return matrix.reshape(6, 24)


def stiffness():
    """The stiffness matrix of an element of edge 1, by Gauss points, two along each axis."""
    gauss = (0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5)
    points = [strain(p) for p in itertools.product(gauss, repeat=3)]
    return sum(b.T @ elasticity() @ b for b in points) / 8


class Model:
    """Elasticity on the solid voxels (x, y, z) of edge ``step`` of a bracket that starts at the origin."""

    def __init__(self, solid, step):
        self.step = step
        shape = np.array(solid.shape) + 1
        cells = np.argwhere(solid)
        corners = np.ravel_multi_index(tuple((cells[:, None, :] + CORNERS).transpose(2, 0, 1)), shape)
        self.used, numbers = np.unique(corners, return_inverse=True)
        self.corners = numbers.reshape(-1, 8)
        self.cells = cells
        self.nodes = np.stack(np.unravel_index(self.used, shape), axis=1) * step
        held = np.repeat(self.nodes[:, 0] < step / 2, 3)
        self.free = ~held
        tip = self.nodes[:, 0] > LENGTH - step / 2
        self.load = np.zeros(3 * len(self.nodes))
        # One newton in all, spread over the faces of the elements at the end.
        shares = np.bincount(self.corners.ravel(), minlength=len(self.nodes)) * tip
        self.load[1::3] = -shares / shares.sum()

    def forces(self, matrix, moves):
        """The forces (N) at the nodes that hold these displacements (mm)."""
        local = moves.reshape(-1, 3)[self.corners].reshape(-1, 24) @ matrix
        local = local.reshape(-1, 8, 3)
        sums = [np.bincount(self.corners.ravel(), local[:, :, a].ravel(), len(self.nodes)) for a in range(3)]
        return np.stack(sums, axis=1).ravel()

    def solve(self, tolerance=1e-6):
        """Displacements (mm) under the load, for E = 1 MPa."""
        matrix = stiffness() * self.step
        each = [np.tile(np.diag(matrix)[a::3], len(self.cells)) for a in range(3)]
        sums = [np.bincount(self.corners.ravel(), e, len(self.nodes)) for e in each]
        diagonal = np.stack(sums, axis=1).ravel()
        moves, rest = np.zeros_like(self.load), self.load * self.free
        limit = tolerance * np.linalg.norm(rest)
        scaled = rest / diagonal
        way, product = scaled.copy(), rest @ scaled
        while np.linalg.norm(rest) > limit:
            answer = self.forces(matrix, way) * self.free
            length = product / (way @ answer)
            moves += length * way
            rest -= length * answer
            scaled = rest / diagonal
            product, last = rest @ scaled, product
            way = scaled + product / last * way
        return moves

    def sag(self, moves):
        """How far the load goes down (mm): the work of one newton."""
        return float(self.load @ moves)

    def stresses(self, moves):
        """Stress (MPa) in the middle of each element, Voigt order 11 22 33 23 13 12."""
        local = moves.reshape(-1, 3)[self.corners].reshape(-1, 24)
        return local @ (elasticity() @ strain((0.5, 0.5, 0.5))).T / self.step


def full(step):
    """The voxels of the whole bracket: those whose middles are in it."""
    n = [round(v / step) for v in (LENGTH, HEIGHT, DEPTH)]
    x, y, _ = (step * (i + 0.5) for i in np.indices(n))
    return y >= x * (HEIGHT - END) / LENGTH


def von_mises(s):
    """The equivalent stress of a tensor in Voigt order."""
    normal = (s[:, 0] - s[:, 1]) ** 2 + (s[:, 1] - s[:, 2]) ** 2 + (s[:, 2] - s[:, 0]) ** 2
    return np.sqrt(0.5 * normal + 3 * (s[:, 3:] ** 2).sum(axis=1))


def write_vtu(path, nodes, cells, data):
    """A VTU of hexahedra with arrays per cell, compressed."""

    def array(name, values):
        kind = {"f": "Float32", "i": "Int32", "u": "UInt8"}[values.dtype.kind]
        raw = np.ascontiguousarray(values).tobytes()
        packed = zlib.compress(raw, 9)
        head = np.array([1, len(raw), 0, len(packed)], dtype="<u4").tobytes()
        text = (base64.b64encode(head) + base64.b64encode(packed)).decode()
        width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        return f'<DataArray type="{kind}" Name="{name}"{width} format="binary">{text}</DataArray>'

    count = len(cells)
    text = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32"'
        ' compressor="vtkZLibDataCompressor"><UnstructuredGrid>',
        f'<Piece NumberOfPoints="{len(nodes)}" NumberOfCells="{count}">',
        f"<Points>{array('Points', nodes.astype('<f4'))}</Points>",
        "<Cells>",
        array("connectivity", cells.astype("<i4").ravel()),
        array("offsets", np.arange(8, 8 * count + 8, 8, dtype="<i4")),
        array("types", np.full(count, 12, dtype="u1")),
        "</Cells><CellData>",
        *(array(name, values.astype("<f4")) for name, values in data.items()),
        "</CellData></Piece></UnstructuredGrid></VTKFile>",
    ]
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(text) + "\n", encoding="ascii", newline="\n")


def in_plane(model, stress):
    """The stress as a plane one, the mean over the depth: loads are in the plane, and cells keep to it."""
    _, column = np.unique(model.cells[:, :2], axis=0, return_inverse=True)
    column = column.ravel()
    mean = np.zeros_like(stress)
    for c in (0, 1, 5):
        mean[:, c] = (np.bincount(column, stress[:, c]) / np.bincount(column))[column]
    return mean


def result(step=2.0):
    """Writes the stress of the full bracket; the equivalent stress is a share of what 95 % of the bracket stays below."""
    model = Model(full(step), step)
    stress = in_plane(model, model.stresses(model.solve()))
    equivalent = von_mises(stress)
    # VTK's order of a symmetric tensor: 11 22 33 12 23 13.
    data = {"stress": stress[:, [0, 1, 2, 5, 3, 4]], "load": equivalent / np.quantile(equivalent, 0.95)}
    write_vtu(RESULT, model.nodes, model.corners[:, HEXAHEDRON], data)
    print(f"{RESULT}: {len(model.cells)} elements, {RESULT.stat().st_size / 1e3:.0f} kB")


def laid(design, step):
    """The voxels of a design."""
    return design.build().voxels(step=step).solid.astype(bool)


def variant(turned, fraction):
    """The example with cells turned along the stress or along the axes, and this fraction: a number or a grade."""
    core = lt.load(DESIGN).to_dict()["lattice"]["core"]
    place = core["map"] if turned else lt.map.affine(wavelength=core["map"]["phase"]["wavelength"])
    core |= {"map": place, "level": lt.level.fraction(fraction)}
    return lt.Design(region=lt.load(DESIGN).to_dict()["region"], lattice={"core": core}, folder=str(DESIGN.parent))


def graded(scale):
    """The example's fraction, times a number."""
    fraction = lt.load(DESIGN).to_dict()["lattice"]["core"]["level"]["fraction"]
    field = fraction["field"]
    return {"field": field | {"remap": [[load, value * scale] for load, value in field["remap"]]}}


def of_mass(count, step, low, high, design):
    """The voxels of ``design(x)`` of which as many as ``count`` are solid, within one in 500; x makes them more."""
    while True:
        middle = 0.5 * (low + high)
        solid = laid(design(middle), step)
        if abs(solid.sum() / count - 1) < 2e-3 or high - low < 1e-4:
            return solid
        low, high = (middle, high) if solid.sum() < count else (low, middle)


def compare(step):
    """Writes the table: the lattices, all of one mass, and the full bracket, on the same voxels."""
    both = laid(lt.load(DESIGN), step)
    count = both.sum()
    rows = {
        "full": full(step),
        "uniform": of_mass(count, step, 0.3, 0.6, lambda x: variant(False, x)),
        "turned along the stress": of_mass(count, step, 0.3, 0.6, lambda x: variant(True, x)),
        "graded by the stress": of_mass(count, step, 0.8, 1.2, lambda x: variant(False, graded(x))),
        "turned and graded": both,
    }
    sags, lines = {}, []
    for name, solid in rows.items():
        model = Model(solid, step)
        moves = model.solve(1e-4)
        sags[name] = model.sag(moves)
        share = solid.sum() / rows["full"].sum()
        worst = np.quantile(von_mises(model.stresses(moves)), 0.99)
        gain = f"{sags['uniform'] / sags[name]:.2f}" if "uniform" in sags else ""
        lines.append(f"| {name} | {share:.3f} | {sags[name]:.2f} | {gain} | {worst:.3f} |")
        print(lines[-1], flush=True)
    text = [
        "# A bracket along its stress, by numbers",
        "",
        f"Written by `scripts/bracket_stress.py --compare`, on voxels of {step:.3g} mm, for a pull of 1 N and E = 1 MPa,",
        "ν = 0.3: [stress_bracket](../../examples/stress_bracket.toml), whose cells are turned along the stress and graded by",
        "it, beside lattices of the same cells and mass that are turned only, graded only, or neither. The sag is the",
        "compliance: the work of one newton.",
        "",
        "| bracket | solid fraction | sag (mm) | times as stiff as uniform | equivalent stress, 99th percentile (MPa) |",
        "|---|---|---|---|---|",
        *lines,
    ]
    TABLE.write_text("\n".join(text) + "\n", encoding="utf-8", newline="\n")
    print(TABLE)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--compare", action="store_true", help="write the table of the lattices instead of the stress")
    about = "edge of the voxels, mm (2 for the stress; 6/13 for the table, which does not divide a cell)"
    parser.add_argument("--step", type=float, help=about)
    args = parser.parse_args()
    compare(args.step or DEPTH / 26) if args.compare else result(args.step or 2.0)


if __name__ == "__main__":
    main()
