"""STEP files of beams: what they have, what is refused, and what a CAD kernel makes of them where one can be imported."""

import json
import math
import re
import warnings
from importlib.util import find_spec

import pytest
import trabecula as lt

ROOM = lt.region.box(size=[60, 60, 60])
#: A ring of three beams with tapered radii, and one apart.
NODES = [[0, 0, 0], [10, 0, 0], [4, 9, 2], [20, 0, 0], [20, 8, 0]]
STRUTS = [[0, 1], [1, 2], [2, 0], [3, 4]]


def solid(**more):
    """Beams alone, uncut."""
    beams = lt.Beams(**({"nodes": NODES, "struts": STRUTS, "radius": 0.8, "fillet": {"radius": 0.4}} | more))
    return lt.Design(region=ROOM, beams=beams).build()


def entities(path):
    """The entities of a STEP file by number."""
    return {int(n): text for n, text in re.findall(r"^#(\d+)=(.*);$", path.read_text("ascii"), re.M)}


def count(found, name):
    """How many entities have this name."""
    return sum(text.startswith(name + "(") for text in found.values())


def test_a_file_has_what_the_report_says(tmp_path):
    path = tmp_path / "ring's.step"
    made = solid().save_step(path)
    found = entities(path)
    assert made.solids == count(found, "MANIFOLD_SOLID_BREP") == 2
    names = {"faces": "ADVANCED_FACE", "edges": "EDGE_CURVE", "vertices": "VERTEX_POINT"}
    assert {key: count(found, name) for key, name in names.items()} == {key: made[key] for key in names}
    assert count(found, "CYLINDRICAL_SURFACE") > 0 and "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))" in found.values()
    # A ring has one hole, a rod none: V - E + F is 0 and 2.
    assert made.vertices - made.edges + made.faces == 2
    assert made.volume == pytest.approx(solid().quadors().volume(), rel=1e-12)
    assert any(text.startswith("PRODUCT('ring''s'") for text in found.values())
    assert path.read_bytes() == (solid().save_step(path), path.read_bytes())[1]


@pytest.mark.parametrize(
    ("design", "why"),
    [
        (
            lambda: lt.Design(
                region=lt.region.sphere(radius=8), beams=lt.Beams(cell="bcc", radius=0.4, map=lt.map.affine(wavelength=4))
            ),
            r"write a mesh .* exact surface of beams alone, and the region cuts some along other surfaces than those of a box",
        ),
        (
            lambda: lt.Design(
                region=ROOM,
                lattice={"a": lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=20), lt.level.fraction(0.3))},
                beams={"b": lt.Beams(cell="octet", radius=2, map=lt.map.affine(wavelength=20))},
                blend=lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {-6: 0, 6: 1})),
            ),
            "a STEP file has beams alone.*or a lattice in a box.*this design has both; write a mesh",
        ),
        (
            lambda: lt.Design(region=ROOM, beams=lt.Beams(nodes=NODES, struts=STRUTS, radius=0.8), skin={"thickness": 1.0}),
            "write a mesh .* exact surface of beams alone, and .*a skin or a kept zone",
        ),
        (lambda: cells("gyroid", "sheet", region=lt.region.sphere(radius=6)), "region is no box; write a mesh"),
        (lambda: cells("gyroid", "sheet", skin={"thickness": 1.0}), "a skin or keep zones; write a mesh"),
    ],
)
def test_what_a_file_cannot_have_is_refused(design, why, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        built = design().build()
    with pytest.raises(ValueError, match=why):
        built.save_step(tmp_path / "no.step")
    with pytest.raises(ValueError, match=r"must end in \.step, \.stp; found \.stl"):
        built.save_step(tmp_path / "no.stl")
    assert not list(tmp_path.iterdir())


def judged(path):
    """What Open CASCADE finds in a file, where it can be imported."""
    if find_spec("OCP") is None:
        return None
    from step_judge import step_solid

    return step_solid(path)


BLOCK = lt.region.box(min=[0, 0, 0], max=[8, 8, 8])
SLANTED = lt.region.halfspace(point=[4, 4, 4], normal=[1, 2, 3])


@pytest.mark.parametrize("fillet", [None, "auto"])
@pytest.mark.parametrize("cell", ["sc", "bcc", "octet", "diamond", "kelvin"])
def test_cuts_along_planes_are_exact(cell, fillet, tmp_path):
    """Through nodes and along axes, where the seams of hubs lie in the planes; and slanted, where hubs beyond
    the slanted plane have lost beams. Both halves of a block make the whole."""
    beams = lt.Beams(cell=cell, map=lt.map.affine(wavelength=8), radius=0.5, **({"fillet": fillet} if fillet else {}))
    halves = [lt.region.intersection(BLOCK, SLANTED), lt.region.difference(BLOCK, SLANTED)]
    found = []
    for region in (BLOCK, *halves):
        built = lt.Design(region=region, beams=beams).build()
        path = tmp_path / "cut.step"
        made = built.save_step(path)
        planes = count(entities(path), "PLANE")
        assert planes > 0 and made.faces > planes
        found.append(made.volume)
        if (judge := judged(path)) is not None:
            assert judge["valid"] and judge["free_edges"] == 0 and judge["solids"] == made.solids
            assert judge["volume"] == pytest.approx(made.volume, rel=1e-9)
    assert found[1] + found[2] == pytest.approx(found[0], rel=1e-8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        measured = lt.Design(region=BLOCK, beams=beams).build().mesh(edge=0.1).measure()
    # Of second order in a tenth of the beams' diameter.
    assert measured.volume == pytest.approx(found[0], rel=5e-3)


def test_graded_radii_give_finite_numbers(tmp_path):
    """Beams across the grade have equal radii but for rounding, and are cylinders."""
    radius = lt.grade.linear([0, 0, 1], {0: 0.4, 8: 0.9})
    beams = lt.Beams(cell="kelvin", map=lt.map.affine(wavelength=8), radius=radius, fillet="auto")
    region = lt.region.intersection(BLOCK, lt.region.halfspace(point=[5, 5, 5], normal=[1, 1, 1]))
    path = tmp_path / "graded.step"
    made = lt.Design(region=region, beams=beams).build().save_step(path)
    assert not re.search(r"nan|inf[,)]", path.read_text("ascii"), re.I) and count(entities(path), "CYLINDRICAL_SURFACE") > 0
    if (judge := judged(path)) is not None:
        assert judge["valid"] and judge["free_edges"] == 0 and judge["solids"] == made.solids
        assert judge["volume"] == pytest.approx(made.volume, rel=1e-9)


def test_a_box_that_touches_beams_does_not_cut_them(tmp_path):
    """Planes that are tangent to cylinders, and one that cuts."""
    beams = lt.Beams(nodes=[[0, 0, 0], [10, 0, 0]], struts=[[0, 1]], radius=1)
    made = (
        lt.Design(region=lt.region.box(min=[-5, -1, -1], max=[6, 1, 1]), beams=beams).build().save_step(tmp_path / "rod.step")
    )
    assert made.solids == 1 and made.volume == pytest.approx(math.pi * (6 + 2 / 3), rel=1e-9)


def cells(cell, part, fraction=0.3, region=None, wavelength=8.0, **more):
    """A lattice; in a box of a cell unless another region is given."""
    box = lt.region.box(min=[0, 0, 0], max=[8, 8, 8]) if region is None else region
    lattice = lt.Lattice(cell, part, lt.map.affine(wavelength, **more.pop("map", {})), lt.level.fraction(fraction))
    return lt.Design(region=box, lattice=lattice, **more)


def test_patches_are_as_near_as_the_report_says(tmp_path):
    path = tmp_path / "gyroid.step"
    built = cells("gyroid", "sheet", region=lt.region.box(size=[16, 16, 16])).build()
    made = built.save_step(path)
    found = entities(path)
    names = {"solids": "MANIFOLD_SOLID_BREP", "faces": "ADVANCED_FACE", "edges": "EDGE_CURVE", "vertices": "VERTEX_POINT"}
    assert {key: count(found, name) for key, name in names.items()} == {key: made[key] for key in names}
    # The default is a thousandth of the wavelength; eight whole cells are 0.3 solid.
    assert 0 < made.deviation <= 8e-3 and made.angle <= 1
    assert made.volume == pytest.approx(0.3 * 16**3, rel=1e-4)
    assert path.stat().st_size <= 2000 * made.faces
    finer = built.save_step(tmp_path / "finer.step", tolerance=2e-4, threads=1)
    assert finer.deviation <= 2e-4 and finer.faces > made.faces
    with pytest.raises(ValueError, match="a STEP file has at most 400000 faces, and this one would have more within 1e-9 mm"):
        built.save_step(tmp_path / "no.step", tolerance=1e-9)


def test_the_command_writes_files(tmp_path, capsys):
    from trabecula.command.cli import main

    design, path = tmp_path / "ring.toml", tmp_path / "ring.STP"
    beams = lt.Beams(nodes=NODES, struts=STRUTS, radius=0.8, fillet="auto")
    design.write_text(lt.Design(region=ROOM, beams=beams).to_toml())
    assert main(["mesh", str(design), "-o", str(path), "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert made["solids"] == 2 and made["bytes"] == path.stat().st_size and len(made["warnings"]) == 1
    assert main(["mesh", str(design), "-o", str(path)]) == 0
    assert "faces" in capsys.readouterr().err
    assert main(["mesh", str(design), "-o", str(path), "--tolerance", "0.1"]) == 1
    assert "a STEP file of beams is exact" in capsys.readouterr().err
    for option in (["--edge", "0.1"], ["--smooth"], ["--islands", "drop"], ["--parts", "wall"]):
        assert main(["mesh", str(design), "-o", str(path), *option]) == 2
        assert f"{' '.join(option[: 1 + (option[0] == '--islands')])} does not go with a STEP file" in capsys.readouterr().err


def test_both_protocols_have_the_same_solids(tmp_path, capsys):
    from trabecula.command.cli import main

    design, path, mesh = (tmp_path / name for name in ("ring.toml", "ring.step", "ring.stl"))
    design.write_text(lt.Design(region=ROOM, beams=lt.Beams(nodes=NODES, struts=STRUTS, radius=0.8)).to_toml())
    found = {}
    for protocol, schema in (("ap214", "AUTOMOTIVE_DESIGN"), ("ap242", "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF")):
        assert main(["mesh", str(design), "-o", str(path), "--protocol", protocol]) == 0
        assert f"FILE_SCHEMA(('{schema} {{ 1 0 10303 " in path.read_text("ascii")
        of = entities(path).values()
        found[protocol] = [text for text in of if not text.startswith(("APPLICATION_CONTEXT(", "APPLICATION_PROTOCOL_"))]
    assert len(found["ap214"]) == len(entities(path)) - 2 and found["ap214"] == found["ap242"]
    capsys.readouterr()
    assert main(["mesh", str(design), "-o", str(mesh), "--protocol", "ap242"]) == 2
    assert "--protocol is of STEP files" in capsys.readouterr().err and not mesh.exists()
    assert main(["mesh", str(design), "-o", str(mesh), "--no-assembly"]) == 2
    assert "--assembly is of STEP files" in capsys.readouterr().err and not mesh.exists()
    with pytest.raises(ValueError, match="protocol is ap203; it must be ap214 or ap242"):
        solid().save_step(path, protocol="ap203")


@pytest.mark.parametrize("fillet", [None, "auto"])
@pytest.mark.parametrize("cell", ["bcc", "octet", "kelvin"])
def test_a_cad_kernel_reads_closed_solids(cell, fillet, tmp_path):
    """Open CASCADE finds a valid solid without free edges, of the exact volume, whose faces are where they should be."""
    pytest.importorskip("OCP.STEPControl")
    from step_judge import step_solid

    beams = lt.Beams(cell=cell, map=lt.map.affine(wavelength=10), radius=0.7, **({"fillet": fillet} if fillet else {}))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        inner = lt.Design(region=lt.region.box(min=[-1, -1, -1], max=[11, 11, 11]), beams=beams).build()
    built = whole(inner, fillet)
    path = tmp_path / "cell.step"
    made = built.save_step(path, protocol="ap242" if cell == "octet" else "ap214")
    found = step_solid(path)
    assert found["valid"] and found["free_edges"] == 0
    assert (found["solids"], found["faces"]) == (made.solids, made.faces)
    # Quadrature of the kernel to 1e-9, and its surfaces to rounding.
    assert found["volume"] == pytest.approx(made.volume, rel=1e-9)
    assert len(found["points"]) > 0.9 * made.faces
    assert abs(built.quadors().closest(found["points"])["distance"]).max() < 1e-12


@pytest.mark.parametrize("part", ["sheet", "lower", "upper"])
@pytest.mark.parametrize("cell", lt.cell.names())
def test_a_cad_kernel_reads_closed_solids_of_cells(cell, part, tmp_path):
    """Open CASCADE finds valid solids without free edges, of the volume that is reported and nearly that of the mesh."""
    pytest.importorskip("OCP.STEPControl")
    from step_judge import step_solid

    built = cells(cell, part).build()
    path = tmp_path / "cell.step"
    made = built.save_step(path)
    found = step_solid(path)
    assert found["valid"] and found["free_edges"] == 0
    assert (found["solids"], found["faces"]) == (made.solids, made.faces)
    # Coordinates have nine decimals.
    assert found["volume"] == pytest.approx(made.volume, rel=1e-7)
    mesh = built.mesh(per_cell=64, islands="keep")
    assert abs(made.volume - mesh.volume) < made.deviation * mesh.area


@pytest.mark.parametrize("cell", ["gyroid", "diamond", "primitive", "iwp"])
def test_a_cad_kernel_reads_closed_solids_of_cut_cells(cell, tmp_path):
    pytest.importorskip("OCP.STEPControl")
    from step_judge import step_solid

    built = cells(cell, "sheet", region=lt.region.box(min=[3, 3, 3], max=[13.4, 13.4, 13.4])).build()
    made = built.save_step(tmp_path / "cut.step")
    found = step_solid(tmp_path / "cut.step")
    assert found["valid"] and found["free_edges"] == 0 and found["solids"] == made.solids
    assert found["volume"] == pytest.approx(made.volume, rel=1e-7)


def test_lattices_of_smooth_surfaces_are_no_assemblies(tmp_path):
    with pytest.raises(ValueError, match="assembly: the parts of an assembly are hubs with their beams"):
        cells("gyroid", "sheet").build().save_step(tmp_path / "no.step", assembly=True)


def test_a_cad_kernel_reads_closed_voids(tmp_path):
    pytest.importorskip("OCP.STEPControl")
    from step_judge import step_solid

    built = cells("primitive", "lower", 0.97, lt.region.box(size=[8, 8, 8])).build()
    made = built.save_step(tmp_path / "void.step")
    found = step_solid(tmp_path / "void.step")
    assert found["valid"] and found["free_edges"] == 0 and found["solids"] == made.solids == 1
    assert found["volume"] == pytest.approx(made.volume, rel=1e-7) == pytest.approx(0.97 * 512, rel=2e-4)


@pytest.mark.parametrize(("cut", "fillet"), [({}, None), ({"min": [-1, 2.5, 1], "max": [11, 10, 8.2]}, "auto")])
def test_a_cad_kernel_places_the_parts_of_an_assembly(cut, fillet, tmp_path):
    """Hub by hub the solids are those of the one shell: their volume, and where they are."""
    pytest.importorskip("OCP.STEPControl")
    from step_judge import step_solid

    region = lt.region.box(**(cut or {"min": [-1, -1, -1], "max": [11, 11, 11]}))
    beams = lt.Beams(cell="bcc", map=lt.map.affine(wavelength=5), radius=0.5, **({"fillet": fillet} if fillet else {}))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        inner = lt.Design(region=region, beams=beams).build()
    built = inner if cut else whole(inner, fillet)
    one, made = built.save_step(tmp_path / "one.step"), built.save_step(tmp_path / "all.step", assembly=True)
    found = step_solid(tmp_path / "all.step")
    assert one.parts is None and 0 < made.parts < made.solids
    assert found["valid"] and found["free_edges"] == 0 and found["solids"] == made.solids
    # Planes that coincide with the end of a half-beam are moved by two millionths of the radius.
    assert made.volume == pytest.approx(one.volume, rel=1e-6 if cut else 1e-10)
    assert found["volume"] == pytest.approx(made.volume, rel=1e-9)
    points = found["points"]
    caps = abs(built.field(points)) > 1e-9
    assert (built.field(points) < 1e-9).all() and 0 < caps.sum() < len(points) / 2


def test_large_lattices_of_equal_hubs_are_assemblies(tmp_path):
    """One part for each kind of hub, by its directions; where all differ it stays one shell."""
    n = 13
    nodes = [[2 * x, 2 * y, 2 * z] for x in range(n) for y in range(n) for z in range(n)]
    index = {tuple(p): i for i, p in enumerate(nodes)}
    steps = [(2, 0, 0), (0, 2, 0), (0, 0, 2)]
    struts = [[i, index[q]] for p, i in index.items() for s in steps if (q := tuple(map(sum, zip(p, s, strict=True)))) in index]
    beams = lt.Beams(nodes=nodes, struts=struts, radius=0.3, fillet="auto")
    built = lt.Design(region=ROOM, beams=beams).build()
    made = built.save_step(tmp_path / "sc.step")
    found = entities(tmp_path / "sc.step")
    # Corners, edges, faces and the inside of the block.
    assert (made.parts, made.solids) == (8 + 12 + 6 + 1, n**3)
    assert count(found, "NEXT_ASSEMBLY_USAGE_OCCURRENCE") == n**3 and count(found, "PRODUCT") == 1 + made.parts
    # Each product is in a space of its own, as ISO 10303-43 asks of transformations between them.
    assert sum("GEOMETRIC_REPRESENTATION_CONTEXT(3)" in text for text in found.values()) == 1 + made.parts
    assert len({text for text in found.values() if text.startswith("PRODUCT(")}) == 1 + made.parts
    assert made.volume == pytest.approx(built.quadors().volume(), rel=1e-10)
    assert (tmp_path / "sc.step").stat().st_size < 2200 * made.solids
    graded = lt.Beams(nodes=nodes, struts=struts, radius=lt.grade.linear([1, math.sqrt(2), math.pi], [[-1, 0.2], [140, 0.4]]))
    other = lt.Design(region=ROOM, beams=graded).build().save_step(tmp_path / "graded.step")
    assert (other.parts, other.solids) == (None, 1)


def test_parts_of_an_assembly_are_not_loose(tmp_path):
    """Half-beams touch end to end: nothing warns of solids that do not."""
    beams = lt.Beams(nodes=[[0, 0, 0], [6, 0, 0], [6, 6, 0]], struts=[[0, 1], [1, 2]], radius=0.5)
    built = lt.Design(region=ROOM, beams=beams).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        made = built.save_step(tmp_path / "all.step", assembly=True)
    assert made.parts == made.solids == 3
    assert made.volume == pytest.approx(built.save_step(tmp_path / "one.step").volume, rel=1e-6)


def test_other_maps_and_levels_have_patches(tmp_path):
    turned = cells("diamond", "sheet", map={"rotate": [10, 20, 30]})
    uneven = cells("gyroid", "lower", fraction=lt.grade.linear([1, 0, 0], [[0, 0.3], [10, 0.5]]), wavelength=[6, 8, 10])
    walls = lt.Design(
        region=lt.region.box(size=[12, 12, 12]),
        lattice=lt.Lattice("primitive", "sheet", lt.map.affine(8), lt.level.thickness(1.0)),
    )
    for design in (turned, uneven, walls):
        built = design.build()
        made = built.save_step(tmp_path / "map.step")
        mesh = built.mesh(per_cell=64, islands="keep")
        assert abs(made.volume - mesh.volume) < made.deviation * mesh.area


def whole(built, fillet):
    """The beams of a design as a graph of their own, which no region cuts."""
    graph = built.beams["core"]
    radius = float(graph["radii"].min())
    nodes = graph["centers"].tolist()
    more = {"fillet": fillet} if fillet else {}
    beams = lt.Beams(nodes=nodes, struts=graph["struts"].tolist(), radius=radius, **more)
    return lt.Design(region=lt.region.box(min=[-20, -20, -20], max=[30, 30, 30]), beams=beams).build()


def test_loose_components_of_a_lattice_are_warned_of(tmp_path):
    """Meshes drop what a cut leaves; a STEP file has it."""
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(8), lt.level.thickness(0.8))
    solid = lt.Design(region=lt.region.box(size=[16, 8, 8]), lattice=core).build()
    with pytest.warns(lt.DesignWarning, match="3 solids that do not touch"):
        assert solid.save_step(tmp_path / "a.step").solids == 3
