"""Results of finite elements in formats of other programs, as fields and as stresses."""

import sys

import numpy as np
import pytest
import trabecula as lt
from trabecula.io import gmsh, results

#: A cube of 8 mm as six tetrahedra, and two triangles of its surface.
CORNERS = np.array([[x, y, z] for z in (0.0, 8.0) for y in (0.0, 8.0) for x in (0.0, 8.0)])
TETS = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
SKIN = np.array([[0, 1, 3], [0, 3, 2]])
#: A stress at the corners, linear in the position, by its components 11, 22, 33, 12, 23, 13.
X, Y, Z = CORNERS.T
STRESS = np.column_stack([10 + 0.05 * X, 2 - 0.05 * Y, np.full(8, -4.0), 0.1 * Z, 0.02 * X, np.full(8, 0.1)])
#: A density of each tetrahedron.
RHO = np.arange(6) / 10 + 0.2


def full(six):
    """Nine components, row by row."""
    xx, yy, zz, xy, yz, xz = six.T
    return np.column_stack([xx, xy, xz, xy, yy, yz, xz, yz, zz])


def write_med(path):
    """As Code_Aster does: steps, a field on volumes alone, two points of integration, components 11, 22, 33, 12, 13, 23."""
    h5py = pytest.importorskip("h5py")
    file = h5py.File(path, "w")
    mesh = file.create_group("ENS_MAA/mesh")
    mesh.attrs.update(ESP=3, DIM=3)
    step = mesh.create_group("-0000000000000000001-0000000000000000001")
    points = step.create_dataset("NOE/COO", data=CORNERS.T.ravel())
    points.attrs["NBR"] = 8
    for kind, cells in (("TR3", SKIN), ("TE4", TETS)):
        nodes = step.create_dataset(f"MAI/{kind}/NOD", data=cells.T.ravel() + 1)
        nodes.attrs["NBR"] = len(cells)
    names = b"".join(name.ljust(16) for name in (b"SIXX", b"SIYY", b"SIZZ", b"SIXY", b"SIXZ", b"SIYZ"))

    def field(name, number, support, rows, names, profile="MED_NO_PROFILE_INTERNAL"):
        # Component by component, in these item by item, in these point by point.
        group = file.require_group(f"CHA/{name}")
        group.attrs.update(NCO=rows.shape[-1], NOM=names)
        at = group.create_group(f"{number:020d}-0000000000000000001")
        at.attrs.update(NDT=number, NOR=-1)
        at.create_group(f"{support}/{profile}").create_dataset("CO", data=np.moveaxis(rows, -1, 0).ravel())

    aster = STRESS[:, [0, 1, 2, 3, 5, 4]]
    field("S", 2, "NOE", aster / 2, names)
    field("S", 10, "NOE", aster, names)
    field("rho", 1, "MAI.TE4", np.stack([RHO - 0.1, RHO + 0.1], axis=1)[:, :, None], b"RHO".ljust(16))
    file.create_dataset("PROFILS/two/PFL", data=[2, 5])
    field("part", 1, "MAI.TE4", np.array([[0.4], [0.7]]), b"RHO".ljust(16), "two")
    field("skin", 1, "MAI.TR3", np.zeros((2, 1)), b"P".ljust(16))
    file.close()


def write_exodus(path):
    """As Sierra and MOOSE do: a variable for each component, steps, two blocks of which one is a surface."""
    netcdf = pytest.importorskip("netCDF4")
    file = netcdf.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET")
    sizes = {"len_name": 33, "time_step": None, "num_dim": 3, "num_nodes": 8, "num_el_blk": 2}
    for name, size in (sizes | {"four": 4, "three": 3, "tets": 6, "tris": 2, "num_nod_var": 7, "num_elem_var": 1}).items():
        file.createDimension(name, size)
    for a, axis in enumerate("xyz"):
        file.createVariable(f"coord{axis}", "f8", ("num_nodes",))[:] = CORNERS[:, a]
    for block, (kind, cells, sized) in enumerate((("TRI3", SKIN, ("tris", "three")), ("TETRA4", TETS, ("tets", "four")))):
        connect = file.createVariable(f"connect{block + 1}", "i4", sized)
        connect[:] = cells + 1
        connect.elem_type = kind

    def named(key, size, names):
        variable = file.createVariable(key, "S1", (size, "len_name"))
        for i, name in enumerate(names):
            variable[i, : len(name)] = list(name)

    named("name_nod_var", "num_nod_var", ["S_xx", "S_xy", "S_xz", "S_yy", "S_yz", "S_zz", "temperature"])
    for i, column in enumerate([0, 3, 5, 1, 4, 2]):
        values = file.createVariable(f"vals_nod_var{i + 1}", "f8", ("time_step", "num_nodes"))
        values[:] = [0 * STRESS[:, column], STRESS[:, column] / 2, STRESS[:, column]]
    file.createVariable("vals_nod_var7", "f8", ("time_step", "num_nodes"))[:] = np.zeros((3, 8))
    named("name_elem_var", "num_elem_var", ["rho"])
    # No such variable on the surface.
    file.createVariable("vals_elem_var1eb2", "f8", ("time_step", "tets"))[:] = [0 * RHO, RHO / 2, RHO]
    file.close()


def write_gmsh(path):
    """As solvers do that read Gmsh's meshes: numbers of nodes are not their places, and data come in another order."""
    tag = [7 * i % 8 + 3 for i in range(8)]
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Nodes", "1 8 3 10", "3 1 0 8", *map(str, tag)]
    lines += [" ".join(map(repr, map(float, p))) for p in CORNERS]
    lines += ["$EndNodes", "$Elements", "2 8 1 8", "2 1 2 2"]
    lines += [" ".join(map(str, [i + 1, *(tag[n] for n in t)])) for i, t in enumerate(SKIN)] + ["3 1 4 6"]
    lines += [" ".join(map(str, [i + 3, *(tag[n] for n in t)])) for i, t in enumerate(TETS)] + ["$EndElements"]
    for step, factor in ((1, 0.5), (2, 1.0)):
        lines += ["$NodeData", "1", '"S"', "1", f"{step}.0", "3", str(step), "9", "8"]
        lines += [" ".join([str(tag[n]), *(repr(float(v)) for v in factor * full(STRESS)[n])]) for n in reversed(range(8))]
        lines += ["$EndNodeData"]
    lines += ["$ElementData", "1", '"rho"', "1", "0.0", "3", "0", "1", "6"]
    lines += [f"{i + 3} {float(RHO[i])!r}" for i in reversed(range(6))] + ["$EndElementData", ""]
    path.write_text("\n".join(lines))


def by_meshio(path, **keys):
    """One step, written by meshio."""
    meshio = pytest.importorskip("meshio")
    if path.suffix == ".xdmf":
        pytest.importorskip("h5py")
    cells = [("triangle", SKIN), ("tetra", TETS)]
    data = {"rho": [np.zeros(2), RHO]} if path.suffix == ".xdmf" else {"rho": [RHO]}
    meshio.write(path, meshio.Mesh(CORNERS, cells[-len(data["rho"]) :], point_data={"S": STRESS}, cell_data=data), **keys)


def write_series(path):
    """Three steps in XDMF, as FEniCS writes them."""
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    with meshio.xdmf.TimeSeriesWriter(path) as series:
        series.write_points_cells(CORNERS, [("tetra", TETS)])
        for step, factor in enumerate((0.0, 0.5, 1.0)):
            series.write_data(step, point_data={"S": factor * STRESS}, cell_data={"rho": [factor * RHO]})


WRITERS = {
    "part.med": write_med,
    "part.rmed": write_med,
    "part.e": write_exodus,
    "part.exo": write_exodus,
    "part.msh": write_gmsh,
    "part.xdmf": by_meshio,
    "series.xdmf": write_series,
    "part.avs": lambda path: by_meshio(path, file_format="avsucd"),
}
#: The label of the step of half the last one's values.
HALF = {"part.med": "2", "part.rmed": "2", "part.e": "2", "part.exo": "2", "part.msh": "1", "series.xdmf": "2"}


@pytest.mark.parametrize("name", WRITERS)
def test_each_format_gives_the_stress_of_its_last_step(tmp_path, name, monkeypatch):
    """In VTK's order or all nine, and a number of each volume; "S@step" is that of another step."""
    monkeypatch.chdir(tmp_path)  # where meshio writes the numbers of a series
    path = tmp_path / name
    WRITERS[name](path)
    half = HALF.get(name)
    for asked, factor in [("S", 1.0)] + ([(f"S@{half}", 0.5)] if half else []):
        points, connectivity, ends, kinds, arrays, chosen, values = results.read(path, asked)
        assert np.array_equal(points, CORNERS) and set(kinds) == {10} and np.array_equal(ends, 4 * np.arange(1, 7))
        assert np.array_equal(connectivity.reshape(-1, 4), TETS)
        title, of_cells, components = arrays[chosen]
        assert (
            title == asked
            and not of_cells
            and (asked.split("@")[0], False, components) in [(a[0].split("@")[0], *a[1:]) for a in arrays]
        )
        want = factor * (full(STRESS) if components == 9 else STRESS)
        # Text of meshio has 16 digits.
        assert np.abs(values.reshape(8, components) - want).max() < 1e-13
    *_, arrays, chosen, values = results.read(path, "rho")
    assert arrays[chosen] == ("rho", True, 1) and np.abs(values - RHO).max() < 1e-14
    *_, arrays, chosen, values = results.read(path, "S@77")
    assert chosen is None and not len(values) and ("S", False) in [a[:2] for a in arrays]


def test_what_is_given_for_some_cells_has_no_numbers_elsewhere(tmp_path):
    """A field of MED with a profile: the core refuses it where a lattice needs it."""
    write_med(tmp_path / "part.med")
    *_, arrays, chosen, values = results.read(tmp_path / "part.med", "part")
    assert arrays[chosen] == ("part", True, 1) and "skin" not in [a[0] for a in arrays]
    assert np.array_equal(values, [np.nan, 0.4, np.nan, np.nan, 0.7, np.nan], equal_nan=True)
    grade = lt.grade.field(str(tmp_path / "part.med"), array="part")
    lattice = lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=4), lt.level.fraction(grade))
    with pytest.raises(lt.DesignError, match=r'4 of 6 numbers of the array "part" are not finite, the first at cell 0'):
        lt.Design(region=lt.region.box(min=[0, 0, 0], max=[8, 8, 8]), lattice={"a": lattice}).build()


def phases(stress, **keys):
    """What a lattice along a stress makes of some points."""
    lattice = lt.Lattice("gyroid", "sheet", lt.map.phase(wavelength=4, stress=stress, **keys), lt.level.fraction(0.3))
    box = lt.region.box(min=[0, 0, 0], max=[8, 8, 8])
    places = np.random.default_rng(1).uniform(0, 8, (200, 3))
    return lt.Design(region=box, lattice={"a": lattice}).build().field(places)


def field(path, array="S"):
    """The tensors of a file."""
    return {"field": lt.grade.field(str(path), array=array)["field"]}


@pytest.mark.parametrize("name", ["part.med", "part.e", "part.msh"])
def test_cells_follow_the_stress_of_a_file(tmp_path, name):
    """As they follow the same stress in a file that the core reads."""
    path = tmp_path / name
    WRITERS[name](path)
    vtu = tmp_path / "part.vtu"
    arrays = "\n".join(" ".join(map(repr, map(float, row))) for row in STRESS)
    numbers = {"points": CORNERS, "connectivity": TETS}
    text = {key: "\n".join(" ".join(map(str, row)) for row in rows.tolist()) for key, rows in numbers.items()}
    vtu.write_text(
        '<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="6"><PointData>'
        f'<DataArray type="Float64" Name="S" NumberOfComponents="6" format="ascii">{arrays}</DataArray></PointData>'
        f'<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{text["points"]}</DataArray></Points><Cells>'
        f'<DataArray type="Int64" Name="connectivity" format="ascii">{text["connectivity"]}</DataArray>'
        '<DataArray type="Int64" Name="offsets" format="ascii">4 8 12 16 20 24</DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii">10 10 10 10 10 10</DataArray></Cells>'
        "</Piece></UnstructuredGrid></VTKFile>"
    )
    assert np.abs(phases(field(path)) - phases(field(vtu))).max() < 1e-9
    # One load case is the load, and so are the step before and the last, of which one is half of the other.
    both = {"cases": [field(path), field(path, f"S@{HALF[name]}")]}
    assert np.array_equal(phases({"cases": [field(path)]}), phases(field(path)))
    assert np.abs(phases(both) - phases(field(path))).max() < 1e-6


def test_results_that_cannot_be_read_are_refused(tmp_path, monkeypatch):
    """One sentence, without what stands in the file."""

    def says(name, words, array="S"):
        with pytest.raises(ValueError, match=words) as error:
            results.read(tmp_path / name, array)
        assert "secret" not in str(error.value) and "\n" not in str(error.value)

    says("job.odb", r"must end in \.vtu, .*\.avs; found \.odb\. Save it as vtu.*export a table")
    says("gone.msh", "does not exist")
    (tmp_path / "part.msh").write_text("root:secret:0:0\n")
    says("part.msh", r"it has no \$Nodes")
    write_gmsh(tmp_path / "part.msh")
    text = (tmp_path / "part.msh").read_text()
    (tmp_path / "part.msh").write_text(text.replace("4.1 0 8", "4.0 0 8"))
    says("part.msh", r"version 4\.0 of the format; save it as 4\.1")
    for cut in range(20, text.find("$EndElements"), 101):
        (tmp_path / "cut.msh").write_text(text[:cut])
        with pytest.raises(ValueError, match=r"."):
            results.taken(gmsh.read(str(tmp_path / "cut.msh"), "S"), "S")
    for name, package in (("part.med", "h5py"), ("part.e", "netCDF4")):
        WRITERS[name](tmp_path / name)
        data = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(data[: len(data) // 2])
        says(name, "cannot be read")
        monkeypatch.setitem(sys.modules, package, None)
        says(name, rf"read by {package}, which is not installed: pip install {package}")


def test_a_mesh_in_single_precision_covers_its_region(tmp_path):
    """The last corner is short of the region by a rounding."""
    meshio = pytest.importorskip("meshio")
    size = np.array([20.1, 16.3, 12.2])
    points = (CORNERS / 8 * size).astype("f4")
    meshio.write(tmp_path / "single.vtu", meshio.Mesh(points, [("tetra", TETS)], point_data={"s": np.full(8, 0.35)}))
    level = lt.level.fraction(lt.grade.field(str(tmp_path / "single.vtu"), "s"))

    def built(longer):
        region = lt.region.box(min=[0, 0, 0], max=list(size * longer))
        return lt.Design(region=region, lattice=lt.Lattice("primitive", "upper", lt.map.affine(4), level)).build()

    for longer in (1, 1 + 1e-10):
        assert built(longer).report().lattices["core"].fraction == pytest.approx(0.35, abs=1e-6)
    with pytest.raises(lt.DesignError, match=r"does not cover .* of the region"):
        built(1.6)
