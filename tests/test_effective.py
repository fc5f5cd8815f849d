"""Stiffness and conductivity of cells: published values, another discretisation, closed forms, bounds, files and mistakes."""

import csv
import itertools
import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
import trabecula as lt
from conftest import command, in_process
from trabecula import level, map, region
from trabecula.command.moduli import modulus, sphere, surface
from trabecula.io.cards import abaqus, ansys, nastran

#: Where the benchmark is that has another program solve the same cells.
BENCH = Path(__file__).parent.parent / "bench"
#: Homogenised at E = 1, nu = 0.3 by an independent program: C11, C12, C44.
TABLE = [
    ("gyroid", "sheet", 0.2, (0.1009, 0.0473, 0.0298)),
    ("gyroid", "sheet", 0.3, (0.1620, 0.0722, 0.0511)),
    ("diamond", "sheet", 0.3, (0.1765, 0.0657, 0.0460)),
    ("primitive", "sheet", 0.3, (0.1462, 0.0819, 0.0651)),
    ("gyroid", "lower", 0.3, (0.1041, 0.0516, 0.0432)),
    ("diamond", "lower", 0.4, (0.1658, 0.0774, 0.0829)),
]


def solid(cell: str = "gyroid", part: str = "sheet", fraction: float = 0.3, **more) -> lt.Solid:
    lattice = lt.Lattice(cell, part, map.affine(**({"wavelength": 4} | more)), level.fraction(fraction))
    return lt.Design(region.box(size=[8, 8, 8]), lattice).build()


@pytest.mark.parametrize(("cell", "part", "fraction", "wanted"), TABLE)
def test_cells_are_as_stiff_as_an_independent_program_found(cell: str, part: str, fraction: float, wanted: tuple):
    found = solid(cell, part, fraction).stiffness(n=48)
    values = found.C[0][0], found.C[0][1], found.C[3][3]
    # The table has four digits of a computation of its own, good to about a hundredth.
    assert values == pytest.approx(wanted, rel=0.02)
    # The estimate is greatest for the diamond sheet, whose shears the coarser grids do not resolve.
    assert found.error < 0.02 and found.fraction == fraction
    assert found.zener == pytest.approx(2 * values[2] / (values[0] - values[1]), rel=1e-6)
    assert found.bulk_bounds[0] <= found.bulk <= found.bulk_bounds[1]


def test_a_cell_that_the_coarsest_grid_takes_apart_is_found_on_the_others():
    found = solid("diamond", "lower", 0.5).stiffness(n=16, voxels=True)
    assert [g.shape[0] for g in found.grids] == [16, 8]
    # Plain voxels are off by the first power of their edge, here some hundredths, which the estimate covers.
    assert abs(found.E[0] / solid("diamond", "lower", 0.5).stiffness(n=32).E[0] - 1) < 2 * found.E_error[0]


def blended(weight, cells: tuple = ("gyroid", "gyroid"), wavelengths: tuple = (4, 4)) -> lt.Solid:
    lattices = {
        name: lt.Lattice(cell, "sheet", map.affine(wavelength=w), level.fraction(0.3))
        for name, cell, w in zip("ab", cells, wavelengths, strict=True)
    }
    return lt.Design(region.box(size=[8, 8, 8]), lattices, blend=lt.blend.between("a", "b", weight)).build()


def test_a_blend_of_alike_cells_in_constant_shares_has_a_cell():
    whole = solid().stiffness(n=16)
    # A cell blended with itself is itself, to the table of its levels.
    assert np.allclose(blended(0.4).stiffness(n=16).C, whole.C, rtol=0, atol=1e-3 * whole.C[0][0])
    found = blended(0.5, ("gyroid", "diamond")).stiffness(n=24)
    c = np.array(found.C)
    # Both are cubic, about axes in common: what the blend keeps of that are the three rotations about the diagonal.
    assert c[0][0] == pytest.approx(c[1][1], rel=1e-6) == pytest.approx(c[2][2], rel=1e-6)
    # Blends keep fractions within 0.0025.
    assert found.grids[0].fraction == pytest.approx(0.3, abs=0.0025)
    for made in (blended(lt.grade.linear([1, 0, 0], {-4: 0, 4: 1})), blended(0.5, wavelengths=(4, 5))):
        with pytest.raises(lt.DesignError, match="the cells of this blend differ from place to place"):
            made.stiffness(n=16)


def test_a_sheet_conducts_as_an_independent_program_found():
    found = solid().conductivity(n=48)
    assert found.k[0][0] == pytest.approx(0.2078, rel=0.01)
    assert found.bounds[1] == pytest.approx(2 * 0.3 / 2.7, rel=1e-4) and found.k[0][0] < found.bounds[1]
    both = solid().conductivity(n=32, pore=1.0)
    assert np.allclose(both.k, np.eye(3), atol=1e-9)


def by_elements(fractions: np.ndarray, conductivity: bool = False) -> np.ndarray:
    """The effective tensor of a cube of voxels by assembled trilinear elements with 2 x 2 x 2 Gauss points, solved directly."""
    sparse = pytest.importorskip("scipy.sparse")
    from scipy.sparse.linalg import spsolve

    n, h = fractions.shape[0], 1 / fractions.shape[0]
    corners = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    gauss = (np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 3**0.5 + 1) / 2
    law = np.zeros((6, 6))
    law[:3, :3] = 0.3 / (1.3 * 0.4)
    law += np.diag([1 / 1.3] * 3 + [0.5 / 1.3] * 3)
    parts = 1 if conductivity else 3
    size = 3 if conductivity else 6
    law = np.eye(3) if conductivity else law
    element, load = np.zeros((8 * parts, 8 * parts)), np.zeros((8 * parts, size))
    for g in gauss:
        slopes = np.empty((8, 3))
        for c, corner in enumerate(corners):
            factors = np.where(corner == 1, g, 1 - g)
            slopes[c] = [np.prod(np.delete(factors, a)) * (1 if corner[a] else -1) / h for a in range(3)]
        b = np.zeros((size, 8 * parts))
        for c, (x, y, z) in enumerate(slopes):
            if conductivity:
                b[:, c] = x, y, z
            else:
                b[:, 3 * c : 3 * c + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0]]
        element += b.T @ law @ b * h**3 / 8
        load += b.T @ law * h**3 / 8
    places = np.argwhere(fractions > 0)
    nodes = (places[:, None, :] + corners[None]) % n
    numbers = nodes @ [n * n, n, 1]
    used = np.unique(numbers)
    numbers = np.searchsorted(used, numbers)
    unknowns = (parts * numbers[:, :, None] + np.arange(parts)).reshape(len(places), -1)
    weights = fractions[tuple(places.T)]
    rows, columns = np.repeat(unknowns, 8 * parts, axis=1), np.tile(unknowns, (1, 8 * parts))
    values = weights[:, None] * element.ravel()
    stiff = sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(parts * len(used),) * 2)
    force = np.zeros((parts * len(used), size))
    for column in range(size):
        np.add.at(force[:, column], unknowns, weights[:, None] * load[:, column])
    free = slice(parts, None)  # a node held: the mean moves nothing
    answer = np.zeros_like(force)
    answer[free] = spsolve(stiff[free, free].tocsc(), -force[free])
    return law * weights.sum() * h**3 + force.T @ answer


def field_of(cell: str, part: str, fraction: float, n: int) -> np.ndarray:
    """The field at the centres of a cell's voxels."""
    middles = (np.arange(n) + 0.5) / n * 4
    points = np.stack(np.meshgrid(middles, middles, middles, indexing="ij"), axis=-1).reshape(-1, 3)
    lattice = lt.Lattice(cell, part, map.affine(wavelength=4), level.fraction(fraction))
    far = lt.Design(region.box(min=[-4, -4, -4], max=[8, 8, 8]), lattice).build()
    return far.field(points).reshape(n, n, n)


def voxels_of(cell: str, part: str, fraction: float, n: int) -> np.ndarray:
    """Voxels of the cell whose centres are solid, as floats, by the field itself."""
    return (field_of(cell, part, fraction, n) <= 0).astype(float)


def test_plain_voxels_are_as_stiff_as_assembled_elements_say():
    fractions = voxels_of("gyroid", "sheet", 0.4, 12)
    found = solid("gyroid", "sheet", 0.4).stiffness(n=12, voxels=True)
    wanted = by_elements(fractions)
    # Residuals of 1e-8 and energies that are quadratic in them.
    assert np.allclose(found.C_n, wanted, atol=1e-8)
    k = solid("gyroid", "sheet", 0.4).conductivity(n=12, voxels=True)
    assert np.allclose(k.k_n, by_elements(fractions, True), atol=1e-8)


@pytest.mark.parametrize(("cell", "part", "fraction"), [("gyroid", "sheet", 0.4), ("gyroid", "lower", 0.5)])
def test_plain_voxels_are_as_stiff_as_mugrid_finds(cell: str, part: str, fraction: float):
    pytest.importorskip("muGrid")
    wanted = runpy.run_path(str(BENCH / "stiffness.py"))["by_mugrid"](voxels_of(cell, part, fraction, 16), 2.0, 0.2)
    found = solid(cell, part, fraction).stiffness(n=16, E=2.0, nu=0.2, voxels=True)
    # Residuals of 1e-8, in which energies are quadratic and muGrid's mean stress is linear.
    assert np.allclose(found.C_n, wanted, atol=1e-7)


def test_thin_struts_and_their_stiffness_tend_to_the_closed_form():
    # A simple cubic frame of fraction r: E along the axes is r/3 as r goes to 0; joints add a share of the order of its root.
    ratios = []
    for radius in (0.24, 0.12):
        beams = lt.Beams(cell="sc", map=map.affine(wavelength=4), radius=radius, hub=radius * 1.01, profile="cylinder")
        made = lt.Design(region.box(size=[8, 8, 8]), beams=beams).build()
        found = made.stiffness(n=96 if radius < 0.2 else 48)
        ratios.append(found.E[0] / (found.fraction / 3))
    assert 1.0 < ratios[1] < ratios[0] < 1.15 and ratios[1] < 1.06


def test_a_turned_cell_has_the_turned_stiffness_and_a_skewed_one_is_symmetric():
    plain = np.array(solid(n := "diamond").stiffness(n=32).C)
    turned = np.array(solid(n, rotate=[0, 0, 90]).stiffness(n=32).C)
    swap = [1, 0, 2, 4, 3, 5]
    assert np.allclose(turned, plain[np.ix_(swap, swap)], atol=1e-7)
    long = np.array(solid("gyroid", wavelength=[4, 4, 8]).stiffness(n=32).C)
    assert np.allclose(long, long.T, atol=1e-9) and long[2, 2] > long[0, 0]


def test_threads_change_no_bit():
    one, two = (solid().stiffness(n=24, threads=t).to_dict() for t in (1, 2))
    assert one == two


def test_a_material_of_its_own_stiffness_gives_the_same_as_its_constants():
    isotropic = solid().stiffness(n=24, E=2.0, nu=0.25)
    c = np.zeros((6, 6))
    c[:3, :3] = 2.0 * 0.25 / (1.25 * 0.5)
    c += np.diag([1.6] * 3 + [0.8] * 3)
    general = solid().stiffness(n=24, C=c)
    assert np.allclose(general.C, isotropic.C, atol=1e-9) and general.bulk_bounds is None


# --- files ------------------------------------------------------------------------------------------------------------


def test_the_modulus_along_an_axis_is_that_of_the_compliance():
    found = solid("primitive").stiffness(n=24)
    assert modulus(found.C, np.eye(3)) == pytest.approx(found.E, rel=1e-12)
    directions, triangles = sphere(3)
    assert len(directions) == 10 * 4**3 + 2 and len(triangles) == 20 * 4**3
    mesh, along = surface(found.C)
    assert mesh.closed and mesh.volume > 0 and np.allclose(np.linalg.norm(mesh.vertices, axis=1), along)
    assert along.max() == pytest.approx(modulus(found.C, np.full((1, 3), 3**-0.5))[0], rel=1e-3)  # along the diagonal


@pytest.mark.parametrize(("cell", "radius"), [("kelvin", 0.16), ("bcc", 0.16)])
def test_soft_moduli_are_within_their_errors(cell: str, radius: float):
    """Beams that bend: twice as fine voxels stay within about the error stated, many times that of the whole tensor. It is an
    estimate from three grids: the order that these show may be off by a half, and the error then by a factor of two."""
    beams = lt.Beams(cell=cell, radius=radius, map=map.affine(wavelength=4))
    thin = lt.Design(region.box(size=[4, 4, 4]), beams=beams).build()
    coarse, fine = thin.stiffness(n=48), thin.stiffness(n=96)
    for found, error, true in zip(coarse.E + coarse.G, coarse.E_error + coarse.G_error, fine.E + fine.G, strict=True):
        assert abs(found - true) < 2 * error * found
    assert max(coarse.E_error) > 3 * coarse.error


def layers(hkl: list[int], fraction: float = 0.41) -> lt.Solid:
    slabs = lt.Lattice(lt.cell.series(terms=[{"hkl": hkl}]), "lower", map.affine(wavelength=4), level.fraction(fraction))
    return lt.Design(region.box(size=[4, 4, 4]), slabs).build()


def of_layers(hkl: list[int], pore: float, fraction: float = 0.41) -> np.ndarray:
    """The harmonic mean across, the mean along."""
    n = np.array(hkl) / np.linalg.norm(hkl)
    mean, harmonic = fraction + (1 - fraction) * pore, 1 / (fraction + (1 - fraction) / pore)
    return mean * np.eye(3) + (harmonic - mean) * np.outer(n, n)


@pytest.mark.parametrize("pore", [1e-3, 0.1, 30])
def test_layers_whose_faces_cut_voxels_are_exact(pore: float):
    found = layers([0, 0, 1]).conductivity(n=24, pore=pore)
    # To the accuracy of the solver, of the share of solid that the voxels have; which is within 1e-4 of the one asked for.
    assert np.allclose(found.k_n, of_layers([0, 0, 1], pore, found.grids[0].fraction), rtol=1e-6, atol=1e-9)
    assert np.allclose(found.k, of_layers([0, 0, 1], pore), rtol=5e-4, atol=1e-9) and max(found.axis_errors) < 1e-3


@pytest.mark.parametrize("hkl", [[1, 0, 1], [1, 0, 3], [1, 2, 1]])
@pytest.mark.parametrize("pore", [0.01, 10])
def test_slanted_layers_tend_to_their_closed_form(hkl: list[int], pore: float):
    """Cut voxels that conduct by their shares alone are off by tenths across such layers, at 32 voxels and any contrast."""
    found = layers(hkl).conductivity(n=32, pore=pore)
    exact, across = of_layers(hkl, pore), np.array(hkl) / np.linalg.norm(hkl)
    assert np.abs(found.k - exact).max() < 5e-3 * exact.max()
    assert across @ np.array(found.k_n) @ across == pytest.approx(across @ exact @ across, rel=0.02)


def test_each_direction_of_a_laminate_has_its_error():
    """Across layers that lean towards an axis the pore tells, along them the solid: within their own errors."""
    hkl = [1, 0, 3]
    found = layers(hkl).conductivity(n=32, pore=0.01)
    exact = of_layers(hkl, 0.01)
    for axis in range(3):
        # The share of solid in voxels that the crests of a cosine pass is off by 1e-4.
        assert abs(found.k[axis][axis] - exact[axis, axis]) <= max(2 * found.axis_errors[axis], 3e-4) * found.k[axis][axis]
    assert found.axis_errors[2] > 10 * found.axis_errors[1]


def by_volumes(field: np.ndarray, pore: float) -> float:
    """k along x of a cube by finite volumes about points of a grid, where the field is negative in the solid: the flux from
    point to point is that of the piece of line in each phase, in series."""
    sparse = pytest.importorskip("scipy.sparse")
    from scipy.sparse.linalg import cg

    number = np.arange(field.size).reshape(field.shape)
    rows, columns, values, force, total = [], [], [], np.zeros(field.size), 0.0
    for axis in range(3):
        next_field = np.roll(field, -1, axis)
        low, high = np.minimum(field, next_field), np.maximum(field, next_field)
        inside = np.where(high <= 0, 1.0, np.where(low >= 0, 0.0, low / np.where(low < high, low - high, 1.0)))
        k = (1 / (inside + (1 - inside) / pore)).ravel()
        a, b = number.ravel(), np.roll(number, -1, axis).ravel()
        rows += [a, b, a, b]
        columns += [a, b, b, a]
        values += [k, k, -k, -k]
        if axis == 0:
            total = k.sum()
            np.add.at(force, a, k)
            np.add.at(force, b, -k)
    places = np.concatenate(rows), np.concatenate(columns)
    matrix = sparse.csr_matrix((np.concatenate(values), places), shape=(field.size,) * 2)
    answer, info = cg(matrix, force, rtol=1e-7, M=sparse.diags(1 / matrix.diagonal()))
    assert info == 0
    return (total - force @ answer) / field.size


@pytest.mark.parametrize("pore", [0.01, 10])
def test_two_phases_conduct_as_finite_volumes_find(pore: float):
    found = solid("gyroid", "lower", 0.3).conductivity(n=48, pore=pore)
    assert found.bounds[0] <= found.k[0][0] <= found.bounds[1] and found.bounds[0] <= found.k_n[0][0] <= found.bounds[1]
    coarse, fine = (by_volumes(field_of("gyroid", "lower", 0.3, n), pore) for n in (16, 32))
    # Of the first order, and irregular: their own limit is good to a fiftieth.
    assert found.k[0][0] == pytest.approx(2 * fine - coarse, rel=0.02)
    assert found.error < 0.02


def test_engineering_constants_are_of_orthotropic_cells_alone():
    skewed = lt.Lattice("primitive", "sheet", map.affine(wavelength=4, skew={"xz": 20}), level.fraction(0.3))
    leaning = lt.Design(region.box(size=[4, 4, 4]), skewed).build().stiffness(n=16)
    assert abs(leaning.C[0][4]) > 0.05 * leaning.C[0][0]
    assert "ENGINEERING" not in abaqus(leaning, "x") and "ENGINEERING" in abaqus(solid().stiffness(n=16), "x")


def test_cards_give_the_stiffness_back_in_each_programs_order():
    found = solid(rotate=[10, 20, 30]).stiffness(n=16)
    c = np.array(found.C)

    def numbers(text: str) -> list[float]:
        return [float(v) for v in re.findall(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?", text)]

    lines = abaqus(found, "x").split("*ELASTIC, TYPE=ANISOTROPIC\n")[1].split("\n")[:3]
    order = [0, 1, 2, 5, 4, 3]
    assert [len(line.split(",")) for line in lines] == [8, 8, 5]
    assert numbers(",".join(lines)) == pytest.approx([c[order[i], order[j]] for j in range(6) for i in range(j + 1)], rel=1e-8)
    order = [0, 1, 2, 5, 3, 4]
    rows = [c[order[i], order[j]] for i in range(6) for j in range(i, 6)]
    card = nastran(found, "x").split("\n")[1:-1]
    assert all(len(line) <= 72 for line in card)
    fields = [float(line[8 + 16 * i : 24 + 16 * i]) for line in card for i in range((len(line) - 8) // 16)]
    assert fields[0] == 1 and fields[1:] == pytest.approx(rows, rel=1e-8)
    data = [line.split(",", 2)[2] for line in ansys(found, "x").split("\n") if line.startswith("TBDATA")]
    assert numbers(",".join(data)) == pytest.approx(rows, rel=1e-8)


def test_the_commands_print_and_write(cube, tmp_path):
    names = [tmp_path / f"cell.{suffix}" for suffix in ("csv", "png", "ply", "vtu", "inp", "bdf", "mac")]
    report = json.loads(in_process("stiffness", cube, "--n", 16, "--json", "--E", 1000, "-o", *names[:4], "-o", *names[4:]))
    assert all(name.stat().st_size > 100 for name in names)
    keys = {"C", "C_n", "n", "error", "residual", "E", "G", "nu", "zener", "anisotropy", "bulk_bounds", "fraction", "warnings"}
    assert keys <= set(report) and report["n"] == 16
    meshio = pytest.importorskip("meshio")
    read = meshio.read(tmp_path / "cell.vtu")
    assert np.allclose(np.linalg.norm(read.points, axis=1), read.point_data["E"], rtol=1e-6)
    trimesh = pytest.importorskip("trimesh")
    assert trimesh.load(tmp_path / "cell.ply", process=False).is_watertight
    text = in_process("stiffness", cube, "--n", 16)
    assert "Hashin-Shtrikman" in text and "accuracy" in text
    report = json.loads(in_process("conductivity", cube, "--n", 16, "--json", "--pore", 0.1))
    assert {"k", "k_n", "error", "bounds"} <= set(report)
    assert "k, relative to the solid's" in in_process("conductivity", cube, "--n", 16)


def rows_of(path: Path) -> dict[tuple[str, str, str], dict[str, str]]:
    """A table of figures by their names, rows and columns."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found = {(row["figure"], row["row"], row["column"]): row for row in rows}
    assert len(found) == len(rows)
    return found


def test_a_table_has_all_figures_of_the_report_with_what_is_known_of_each(cube, tmp_path):
    out, axes = tmp_path / "cell.csv", ["11", "22", "33", "23", "13", "12"]
    it = json.loads(in_process("stiffness", cube, "--n", 16, "--json", "-o", out))
    rows = rows_of(out)
    for i, j in itertools.product(range(6), range(6)):
        row = rows["C", axes[i], axes[j]]
        assert (float(row["value"]), float(row["at_n"])) == (it["C"][i][j], it["C_n"][i][j])
    for name, of in (("E", "123"), ("G", axes[3:]), ("nu", axes[3:])):
        assert [float(rows[name, a, ""]["value"]) for a in of] == it[name]
        assert [rows[name, a, ""]["error"] for a in of] == [str(e) for e in it.get(f"{name}_error") or [""] * 3]
    for name in ("bulk", "shear"):
        bounds = [float(rows[name, "", ""][f"{which}_bound"]) for which in ("lower", "upper")]
        assert bounds == it[f"{name}_bounds"] and float(rows[name, "", ""]["value"]) == it[name]
    for name in ("zener", "anisotropy", "error", "fraction", "n", "residual", "wall_voxels"):
        assert float(rows[name, "", ""]["value"]) == it[name]
    assert len(rows) == 36 + 9 + 2 + 7

    it = json.loads(in_process("conductivity", cube, "--n", 16, "--json", "-o", out))
    rows = rows_of(out)
    assert [float(rows["k", a, a]["error"]) for a in "123"] == it["axis_errors"]
    assert [float(rows["mean", "", ""][f"{which}_bound"]) for which in ("lower", "upper")] == it["bounds"]

    it = json.loads(in_process("permeability", cube, "--n", 16, "--json", "-o", out))
    rows = rows_of(out)
    assert [float(rows["k", "1", a]["value"]) for a in "123"] == it["k"][0] and rows["k", "1", "1"]["unit"] == "mm²"
    # Of cells that are cubes of 4 mm.
    assert float(rows["k_cell", "1", "1"]["value"]) == pytest.approx(it["k"][0][0] / 16, rel=1e-12)
    for name in (
        "hydraulic_diameter",
        "area_per_volume",
        "porosity",
        "tortuosity",
        "kozeny",
        "error",
        "fraction",
        "pore_nodes",
    ):
        assert float(rows[name, "", ""]["value"]) == it[name]


def test_the_command_takes_a_solid_of_any_stiffness(cube, tmp_path):
    """Cubic, and of rows by commas, semicolons and spaces: that of Python; and of a cell that is all solid it is its own."""
    c = np.diag([2.0, 2, 2, 0.5, 0.5, 0.5])
    c[:3, :3] += 1 - np.eye(3)
    path = tmp_path / "solid.csv"
    lines = [sign.join(str(v) for v in row) for sign, row in zip([",", "; ", " ", "\t", " , ", "  "], c.tolist(), strict=True)]
    path.write_text("\ufeff# cubic\n" + "\r\n".join(lines) + " # the last\n\n", encoding="utf-8")
    out = tmp_path / "cell.inp"
    it = json.loads(in_process("stiffness", cube, "--n", 16, "--json", "--C", path, "-o", out))
    assert it["C"] == lt.load(cube).build().stiffness(n=16, C=c).C and it["bulk_bounds"] is None
    assert f"solid of the stiffness in {path}" in out.read_text()


SPD = [[2.0 if i == j else 0.25 for j in range(6)] for i in range(6)]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([*SPD[:5], [0.25, 0.5, 0.25, 0.25, 0.25, 2.0]], "entries 62 and 26 are 0.5 and 0.25; a stiffness is symmetric"),
        (
            [[2.0 if i == j else 2.5 for j in range(6)] for i in range(6)],
            "its least eigenvalue is -0.5; a stiffness is positive",
        ),
        ([*SPD[:5], [0.25] * 5 + ["nan"]], "an entry is not a finite number; give 6 x 6 numbers"),
        (SPD[:5], "expected 6 lines of 6 numbers, in Voigt's order 11 22 33 23 13 12, found 5"),
        ([*SPD[:2], SPD[2][:5], *SPD[3:]], ":3: expected 6 numbers, found 5"),
        ([["C11", *SPD[0][1:]], *SPD[1:]], ":1: expected 6 numbers, found 'C11,0.25"),
    ],
)
def test_a_file_that_holds_no_stiffness_is_named(cube, tmp_path, rows: list, said: str):
    path = tmp_path / "solid.csv"
    path.write_text("\n".join(",".join(str(v) for v in row) for row in rows))
    done = command("stiffness", cube, "--n", 8, "--C", path, "-o", tmp_path / "cell.csv")
    assert done.returncode == 1 and f"trabecula: {path}:" in done.stderr and said in done.stderr, done.stderr
    assert done.stderr.splitlines()[-1].startswith("trabecula: ") and not (tmp_path / "cell.csv").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--E", "0"), "argument --E: expected Young's modulus greater than 0, found 0"),
        (("--nu", "0.5"), "argument --nu: expected Poisson's ratio greater than -1 and less than 0.5 (of an incompressible"),
        (("--nu", "-1"), "argument --nu: expected Poisson's ratio greater than -1"),
        (("--nu", "soft"), "argument --nu: expected Poisson's ratio, found 'soft'"),
        (("--C", "solid.csv", "--E", "2"), "--C is the stiffness of a solid, --E and --nu are those of an isotropic one"),
        (("--C", "solid.csv", "--nu", "0.3"), "--C is the stiffness of a solid, --E and --nu are those of an isotropic one"),
        (("--C", "solid.stl"), "argument --C: the name must end in .csv, .txt, .dat; found 'solid.stl'"),
    ],
)
def test_solids_that_are_none_are_wrong_usage(cube, words: tuple, said: str):
    done = command("stiffness", cube, *words)
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr


@pytest.mark.parametrize("words", [("law", "gyroid"), ("volume", "cell.toml", "-o", "cell.inp")])
def test_poissons_ratio_is_checked_by_all_commands(words: tuple):
    done = command(*words, "--nu", "0.5")
    assert done.returncode == 2 and "argument --nu: expected Poisson's ratio greater than -1" in done.stderr, done.stderr


def test_a_sweep_has_the_properties_that_are_asked_for(cube):
    study = lt.load(cube).to_dict() | {"sweep": {"lattice.core.level.fraction": [0.2, 0.3]}}
    columns = lt.sweep(study, per_cell=8, properties={"stiffness": {"n": 16}, "conductivity": {"n": 16}})
    assert columns["error"] == [None, None]
    direct = [solid(fraction=f).stiffness(n=16).C[0][0] for f in (0.2, 0.3)]
    assert columns["C11"] == direct and columns["k11"][1] > columns["k11"][0]


# --- mistakes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("fraction = { linear = { along = [1, 0, 0], stops = [[-4, 0.2], [4, 0.4]] } }", (), "no cell is periodic"),
        ("fraction = 0.3", ("--n", 4096), "of memory for 4096 x 4096 x 4096 voxels"),
    ],
)
def test_what_has_no_stiffness_is_refused(tmp_path, text: str, words: tuple, said: str):
    path = tmp_path / "it.toml"
    cell = '[lattice.a]\ncell = "gyroid"\npart = "sheet"\nmap.affine.wavelength = 4\n'
    path.write_text(f'schema = 1\nunits = "mm"\nregion.box.size = [8, 8, 8]\n{cell}level.{text}\n')
    done = command("stiffness", path, *words)
    assert done.returncode == 1 and said in done.stderr and done.stderr.count("\n") == 1


def test_a_network_that_falls_apart_is_refused_with_where_it_holds():
    with pytest.raises(ValueError, match=r"falls apart and carries no load; it is one piece from 0\.21"):
        solid("primitive", "lower", 0.15).stiffness(n=16)


def test_thin_walls_are_warned_of():
    found = solid(fraction=0.05).stiffness(n=16)
    assert any("voxels across" in w["message"] for w in found.warnings)


def test_a_stiffness_that_is_none_is_refused():
    with pytest.raises(ValueError, match="positive definite"):
        solid().stiffness(n=8, C=-np.eye(6))
    with pytest.raises(ValueError, match=r"expected C of shape \(6, 6\)"):
        solid().stiffness(n=8, C=np.eye(3))
