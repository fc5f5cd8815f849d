"""Cells that turn, from Python: builders, files made by NumPy, the report, and what is refused."""

import struct
import warnings
import zlib

import numpy as np
import pytest
import trabecula as lt


def design(map, level=None, part="sheet", size=12):
    core = lt.Lattice(cell=lt.cell.gyroid(), part=part, map=map, level=level or lt.level.fraction(0.3))
    return lt.Design(region=lt.region.box(min=[0, 0, 0], max=[size] * 3), lattice={"core": core})


def test_a_turned_and_graded_part_is_one_closed_piece():
    turn = lt.grade.linear(along=[1, 0, 0], stops={0: 0, 12: 20})
    ask = lt.level.fraction(lt.grade.radial(center=[6, 6, 6], stops={0: 0.5, 8: 0.3}))
    solid = design(lt.map.phase(wavelength=[3, 3, lt.grade.formula("3 + 0.05*x")], rotate_z=turn), ask).build()
    mesh = solid.mesh(edge=0.25, islands="drop")
    assert mesh.closed and mesh.pieces == 1
    report = solid.report()["lattices"]["core"]
    assert report["fraction"][0] >= 0.29 and report["distortion"]["density"][0] > 0.7
    assert 2 < report["distortion"]["turn"] < 20


def test_files_made_by_numpy_are_read(tmp_path):
    i, j, _ = np.indices((7, 7, 7))
    np.save(tmp_path / "field.npy", (0.2 + 0.02 * i + 0.01 * j).astype(np.float32))
    grid = lt.grade.grid(str(tmp_path / "field.npy"), origin=[0, 0, 0], step=2, remap={0: 0, 1: 1})
    report = design(lt.map.affine(wavelength=3), lt.level.fraction(grid)).build().report()
    assert report["lattices"]["core"]["fraction"] == pytest.approx([0.2, 0.38], abs=1e-6)
    with pytest.raises(lt.DesignError, match="does not cover"):
        design(lt.map.affine(wavelength=3), lt.level.fraction({"grid": {**grid["grid"], "step": 1}})).build()


@pytest.mark.parametrize("step", [0.2, 1.6])
def test_an_image_that_leaves_some_of_the_region_out_is_refused(tmp_path, step):
    """As a mesh or a grid is: beyond it there would be the numbers at its edge. Such as of a file in cm."""
    values = " ".join("0.3" for _ in range(7**3))
    (tmp_path / "field.vti").write_text(
        f'<VTKFile type="ImageData"><ImageData WholeExtent="0 6 0 6 0 6" Origin="0 0 0" Spacing="{step} {step} {step}">'
        '<Piece Extent="0 6 0 6 0 6"><PointData><DataArray type="Float64" Name="f" format="ascii">'
        f"{values}</DataArray></PointData></Piece></ImageData></VTKFile>"
    )
    field = lt.grade.field(str(tmp_path / "field.vti"), array="f")
    with pytest.raises(lt.DesignError, match=r"the grid does not cover .* of the region; .* give another as unit"):
        design(lt.map.affine(wavelength=3), lt.level.fraction(field)).build()
    whole = {"field": {**field["field"], "unit": "cm"}}
    assert design(lt.map.affine(wavelength=3), lt.level.fraction(whole)).build().report()["lattices"]["core"]["fraction"] == 0.3


def test_a_map_that_folds_is_refused_and_can_be_allowed():
    turn = lt.grade.formula("170*tanh(2*(x-6))")
    with pytest.raises(lt.DesignError, match="folds at"):
        design(lt.map.phase(wavelength=3, rotate_z=turn)).build()
    with pytest.warns(lt.DesignWarning, match="degrees a cell"):
        design(lt.map.phase(wavelength=3, rotate_z=turn, folds=True)).build()


def test_tubes_and_balls_close():
    assert lt.map.cylinder(wavelength=[3, 4], around=12) == {"cylinder": {"wavelength": [3, 4], "around": 12}}
    solid = design(lt.map.sphere(wavelength=3, around=12, center=[0, 0, 0], axis=[1, 1, 1])).build()
    # On both sides of the seam.
    n = np.array([1, 1, 1]) / np.sqrt(3)
    seam = np.array([0, 1, -1]) / np.sqrt(2)
    across = np.cross(n, seam)
    at = np.array([6.0 * n + 4 * (np.cos(t) * seam + np.sin(t) * across) for t in np.linspace(0, 2 * np.pi, 721)])
    values = solid.field(at)
    assert np.abs(np.diff(values)).max() < 0.2


@pytest.mark.parametrize(
    "hole, words", [(None, "the axis lies in the region: cells shrink to nothing at (0, 0, "), (0.5, "cells are only 0.1")]
)
def test_cells_pinched_round_an_axis_are_warned_of(hole, words):
    """Twenty cells round a hole of 0.5 mm are 2 pi 0.5 / 20 = 0.157 mm wide there; round one of 5 mm all is well."""

    def reported(hole):
        rod = lt.region.cylinder(base=[0, 0, 0], radius=8, height=8)
        bored = rod if hole is None else lt.region.difference(rod, lt.region.cylinder(base=[0, 0, -1], radius=hole, height=10))
        core = lt.Lattice("gyroid", "sheet", lt.map.cylinder(wavelength=3, around=20), lt.level.fraction(0.3))
        return lt.Design(region=bored, lattice={"core": core}).build().warnings

    (warning,) = reported(hole)
    assert warning["path"] == "lattice.core.map.cylinder.around" and words in warning["message"]
    assert reported(5) == []


def test_faults_of_angles_name_the_key_that_was_given():
    with pytest.raises(lt.DesignError) as e:
        design(lt.map.phase(wavelength=4, rotate_z=lt.grade.formula("30*sin(40*x)"), step=1.0)).build()
    assert e.value.path == "lattice.core.map.phase.rotate_z"


def test_a_cell_meshed_once_comes_back_as_a_series(tmp_path):
    """One period of a primitive network as a mesh, then as a cell: the same solid, but for the waves left out."""
    network = lt.Lattice(cell=lt.cell.primitive(), part="upper", map=lt.map.affine(wavelength=6), level=lt.level.fraction(0.5))
    one = lt.Design(region=lt.region.box(min=[0, 0, 0], max=[6] * 3), lattice={"a": network}).build()
    one.mesh(edge=0.2).write(tmp_path / "cell.stl")
    wide = lt.region.box(min=[0, 0, 0], max=[18] * 3)
    named = lt.Design(region=wide, lattice={"a": network}).build()
    points = np.random.default_rng(5).uniform(0.1, 17.9, (20_000, 3))
    inside = named.field(points) <= 0

    def read(terms):
        again = lt.Lattice(
            cell=lt.cell.file(str(tmp_path / "cell.stl"), terms=terms),
            part="upper",
            map=lt.map.affine(wavelength=6),
            level=lt.level.fraction(0.5),
        )
        solid = lt.Design(region=wide, lattice={"a": again}).build()
        lost = solid.report()["lattices"]["a"]["truncation"]
        return lost, np.mean(inside != (solid.field(points) <= 0))

    few, many = read(12), read(150)
    # A distance bends and does not jump: what N waves leave out falls as N to the -1/2 in the root mean square.
    assert many[0] < few[0] / (150 / 12) ** 0.5 and many[1] < few[1]
    # A layer of a two-hundredth of a cell on a surface of 2.35 cells² in a cell is a share of 0.012: half of it on each side.
    assert many[1] < 0.006


def test_a_scan_is_a_cell(tmp_path):
    """Grey pictures with a threshold, by a pattern and by their folder: the solid that the pictures show."""
    n, radius = 24, 0.35
    at = np.arange(n) / n - 0.5
    x, y, z = np.meshgrid(at, at, at, indexing="ij")
    numbers = np.where(x * x + y * y + z * z < radius**2, 200, 30)
    (tmp_path / "scan").mkdir()
    for k in range(n):
        (tmp_path / "scan" / f"{k}.png").write_bytes(grey_png(numbers[:, :, k].T.tolist()))

    def solid(path, **keys):
        cell = lt.cell.file(path, **{"threshold": 128, "step": 0.25} | keys)
        lattice = lt.Lattice(cell, "upper", lt.map.affine(wavelength=6), lt.level.iso(0))
        return lt.Design(region=lt.region.box(min=[0, 0, 0], max=[12] * 3), lattice=lattice, folder=str(tmp_path)).build()

    points = np.random.default_rng(6).uniform(0.1, 11.9, (20_000, 3))
    field = solid("scan/*.png").field(points)
    assert np.array_equal(field, solid("scan/").field(points))
    # The first picture's middle is phase zero, so the ball's centre is at the middle of the cell: half the voxels along.
    away = (points / 6) % 1 - 0.5
    inside = np.linalg.norm(away, axis=1) < radius
    # The boundary of voxels is off by at most half a step's diagonal: a layer of 0.036 cells on 1.54 cells².
    clear = np.abs(np.linalg.norm(away, axis=1) - radius) > 3**0.5 / 2 / n
    assert np.array_equal((field <= 0)[clear], inside[clear])
    with pytest.raises(lt.DesignError, match="one side of 250"):
        solid("scan/", threshold=250)
    with pytest.raises(lt.DesignError, match="period is for a mesh"):
        solid("scan/", period=6)
    with pytest.raises(lt.DesignError, match="does not exist"):
        solid("empty/")


def test_the_distortion_is_seen_and_had_by_the_point():
    turn = lt.grade.formula("25*sin(pi*x/12)*cos(pi*y/12)")
    solid = design(lt.map.phase(wavelength=3, rotate_z=turn)).build()
    d = solid.report()["lattices"]["core"]["distortion"]
    mesh = solid.mesh(per_cell=16)
    found = solid.map_error(mesh.vertices)
    # Points between nodes are not far beyond what the nodes have.
    assert found["angle"].max() < 1.2 * max(a["max"] for a in d["angle"])
    assert found["angle"].max() > 0.8 * max(a["max"] for a in d["angle"])
    assert found["density"].min() > 0
    plain = mesh.png((320, 240))
    coloured = mesh.png((320, 240), color=found["angle"], label="angle off")
    assert plain != coloured
    with pytest.raises(ValueError, match="one for each vertex"):
        mesh.png(color=found["angle"][1:])
    with pytest.raises(ValueError, match="span"):
        mesh.png(color=found["angle"], span=(2, 1))
    still = design(lt.map.affine(wavelength=3)).build()
    with pytest.raises(ValueError, match="solved for"):
        still.map_error(mesh.vertices)


def test_cells_follow_a_line_and_folds_are_refused(tmp_path):
    line = [[x, 3 * np.sin(x / 5), 0] for x in np.linspace(0, 24, 9)]
    box = lt.region.box(min=[0, -4, -2], max=[24, 4, 2])

    def swept(points, **keys):
        core = lt.Lattice("primitive", "sheet", lt.map.sweep(3, points, **keys), lt.level.fraction(0.3))
        return lt.Design(region=box, lattice={"a": core}, folder=str(tmp_path))

    solid = swept(line, normal=[0, 0, 1]).build()
    mesh = solid.mesh(edge=0.2)
    assert mesh.closed and mesh.self_intersections == 0
    # What is asked for holds, since cells that shrink inside a bend grow outside it.
    assert abs(mesh.measure()["solid_fraction"] - 0.3) < 0.03
    np.savetxt(tmp_path / "line.csv", line, delimiter=",", header="x,y,z", comments="")
    same = swept("line.csv", normal=[0, 0, 1]).build()
    points = np.random.default_rng(3).uniform([1, -3, -1], [23, 3, 1], (200, 3))
    assert np.allclose(solid.field(points), same.field(points))
    with pytest.raises(lt.DesignError, match=r"folds at|tears at") as e:
        swept([[8, -3, 0], [12, 3, 0], [16, -3, 0]]).build()
    assert e.value.path == "lattice.a.map.sweep.points"
    with pytest.raises(lt.DesignError, match="coincide"):
        swept([[8, -3, 0], [8, -3, 0]]).build()


def test_angles_are_bought_with_spacings():
    turn = lt.grade.linear(along=[1, 0, 0], stops={0: 0, 12: 40})

    def off(weight):
        map = lt.map.phase(wavelength=3, rotate_z=turn, angle_weight=weight)
        return design(map).build().report()["lattices"]["core"]["distortion"]["angle"][0]["mean"]

    assert off(20) < off(1) < off(0.05)
    with pytest.raises(lt.DesignError, match=r"0\.001"):
        off(0)


def grey_png(rows):
    """A grey picture of 8 bits."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    packed = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def test_a_stack_of_pictures_is_a_grid(tmp_path):
    """The same numbers as an array and as pictures, whose names sort as people count."""
    i, j, k = np.indices((13, 9, 12))
    numbers = (5 * i + 7 * j + 3 * k).astype(np.uint8)
    np.save(tmp_path / "all.npy", numbers.astype(np.float64))
    for z in range(12):
        (tmp_path / f"slice{z}.png").write_bytes(grey_png(numbers[:, :, z].T.tolist()))
    box = lt.region.box(min=[0, 0, 0], max=[12, 8, 11])

    def solid(path, **keys):
        grid = lt.grade.grid(path, **{"origin": [0, 0, 0], "step": 1, "remap": {0: 0.2, 160: 0.5}} | keys)
        core = lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=3), lt.level.fraction(grid))
        return lt.Design(region=box, lattice={"a": core}, folder=str(tmp_path)).build()

    points = np.random.default_rng(4).uniform([0, 0, 0], [12, 8, 11], (300, 3))
    assert np.allclose(solid("slice*.png").field(points), solid("all.npy").field(points))
    for path, keys, words in [
        ("none*.png", {}, "no file is named"),
        ("slice*.png", {"origin": None}, "pictures do not say"),
        ("all.png", {}, "all.png"),
    ]:
        with pytest.raises(lt.DesignError, match=words):
            solid(path, **keys)
    (tmp_path / "slice3.png").write_bytes(grey_png([[1, 2], [3, 4]]))
    with pytest.raises(lt.DesignError, match="2 × 2 pixels among those of 13 × 9"):
        solid("slice*.png")


def test_walls_of_given_thickness_have_the_fraction_of_each_place():
    grow = lt.grade.linear(along=[1, 0, 0], stops={0: 2.5, 12: 5})
    solid = design(lt.map.phase(wavelength=grow), lt.level.thickness(0.3)).build()
    points = np.random.default_rng(1).uniform(0.5, 11.5, (200, 3))
    cell = solid.cell_at(points)
    # Of a thin wall the fraction is its area times the thickness: one over the cells' size.
    ratio = cell["fraction"] / (1 / cell["wavelength"]).mean(axis=1)
    assert ratio.max() / ratio.min() < 1.05 and cell["fraction"].max() / cell["fraction"].min() > 1.2
    core = solid.report().lattices["core"]
    low, high = core.fraction
    assert low - 0.01 < cell["fraction"].min() and cell["fraction"].max() < high + 0.01
    assert core.wavelengths == pytest.approx([2.5, 5], rel=1e-6)
    assert "wavelength 2.5 to 5 mm" in str(solid.report())


def test_cells_along_a_cylinder_are_no_cubes(tmp_path):
    """On the axis of the map there is no cell: its lengths are not a number, and nothing fails."""
    ring = lt.region.difference(lt.region.cylinder([0, 0, 0], 8, 6), lt.region.cylinder([0, 0, -1], 5, 8))
    solid = lt.Design(ring, lt.Lattice("gyroid", "sheet", lt.map.cylinder([1.5, 2], 20), lt.level.fraction(0.3))).build()
    cell = solid.cell_at([[0, 0, 3], [6, 0, 3]])
    assert np.isnan(cell["wavelength"][0]).all() and cell["wavelength"][1] == pytest.approx([1.5, 2 * np.pi * 6 / 20, 2])
    with pytest.raises(ValueError, match=r"cells of lattice\.core are none: edges differ"):
        solid.render(tmp_path / "ring.png", show="stiffness")


def test_what_a_map_misses_is_said_of_the_worst_axes():
    slab = lt.region.box(min=[-5, 0, 0], max=[5, 14, 12])
    ends = [lt.region.box(min=[x - 0.1, -1, -1], max=[x + 0.1, 15, 13]) for x in (-5, 5)]
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.phase(wavelength=3, fix=ends), level=lt.level.fraction(0.3))
    fixed = lt.Design(region=slab, lattice={"core": core}).build().report()
    assert "cells per mm 0.90 of what was asked for" in str(fixed)  # three in 10 mm
    off = fixed.lattices["core"].distortion
    spread = type(off.angle[0])
    few, far = (spread({"mean": mean, "p95": mean, "max": most}) for mean, most in ((8.72, 60.0), (6.1, 70.0)))
    worst = type(off)(dict(off) | {"angle": [few, few, far]})
    assert "off by 8.7° on average, 70.0° at most" in str(worst)


def test_a_range_of_stretch_makes_no_map_worse():
    """Where the map without a range keeps to it, that is the map; where none does, it is the one that comes nearest."""
    ring = lt.region.difference(lt.region.cylinder([0, 0, 0], 11, 4.5), lt.region.cylinder([0, 0, -1], 5.5, 8))

    def stretch(**keys):
        map = lt.map.phase(wavelength=3, align="surface", **keys)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", lt.DesignWarning)
            built = lt.Design(region=ring, lattice=lt.Lattice("gyroid", "sheet", map, lt.level.fraction(0.3))).build()
        return built.report().lattices["core"].distortion.stretch

    free = stretch()
    assert stretch(stretch=[0.6, 1.7]) == free and free[0] > 0.6 and free[1] < 1.7
    held = stretch(stretch=[0.9, 1.1])
    assert max(0.9 / held[0], held[1] / 1.1) <= max(0.9 / free[0], free[1] / 1.1) * (1 + 1e-12)


@pytest.mark.parametrize("inner", [None, 7])
def test_flat_ends_of_cylinders_are_fixed_by_boxes_about_them(inner):
    """The rims lie in the boxes too, and are no faces of their own."""
    region = lt.region.cylinder([0, 0, 0], 14, 8)
    if inner:
        region = lt.region.difference(region, lt.region.cylinder([0, 0, -1], inner, 12))
    ends = [lt.region.box(min=[-15, -15, z - 0.1], max=[15, 15, z + 0.1]) for z in (0, 8)]
    map = lt.map.phase(wavelength=3, fix=ends)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        solid = lt.Design(region=region, lattice=lt.Lattice("gyroid", "sheet", map, lt.level.fraction(0.3))).build()
    # Three cells in 8 mm, where 2.67 would be, nearly all over.
    spacing = solid.report().lattices["core"].distortion.spacing[2]
    assert spacing.mean == pytest.approx(9 / 8, abs=0.01) and spacing.p95 == pytest.approx(9 / 8, abs=0.01)


@pytest.mark.parametrize("times", [2, 4, 8])
def test_an_orientation_with_the_period_of_the_nodes_is_warned_of(times):
    """At the nodes, and halfway between them, it is zero."""
    turned = lt.map.phase(wavelength=4, rotate_z={"formula": f"30*sin({times}*pi*x)"})
    lattice = lt.Lattice("gyroid", "sheet", turned, lt.level.fraction(0.3))
    with pytest.warns(lt.DesignWarning, match="the orientation turns by .* nodes of the phase grid are 1 mm apart"):
        lt.Design(lt.region.box(min=[0, 0, 0], max=[40, 6, 6]), lattice).build()


def test_points_of_a_table_are_found_by_its_headings(tmp_path):
    table = tmp_path / "points.csv"
    fractions = []
    for text in (
        "x,y,z,value\n1,2,0.45,0.3\n3,1,0.5,0.4\n",
        "value,x,y,z\n0.3,1,2,0.45\n0.4,3,1,0.5\n",
        "the value, x, y, z\n0.3,1,2,0.45\n0.4,3,1,0.5\n",
    ):
        table.write_text(text)
        level = lt.level.fraction(lt.grade.points(table))
        lattice = lt.Lattice("gyroid", "sheet", lt.map.affine(2), level)
        fractions.append(lt.Design(lt.region.box([6, 6, 6]), lattice).build().report().lattices["core"].fraction)
    assert fractions[0] == fractions[1] == fractions[2] and 0.3 <= fractions[1][0] < fractions[1][1] <= 0.4
