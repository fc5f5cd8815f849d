"""Blends through the doors: what a design says, what is refused, what transitions tell."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trabecula as lt

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"

BAR = """schema = 1
[region.box]
size = [24, 8, 8]
[lattice.a]
cell = "primitive"
part = "upper"
level = { fraction = 0.30 }
map = { affine = { wavelength = 4.0 } }
[lattice.b]
cell = "gyroid"
part = "upper"
level = { fraction = 0.30 }
map = { affine = { wavelength = 4.0 } }
[blend]
between = ["a", "b"]
weight = { linear = { along = [1, 0, 0], stops = [[-6, 0], [6, 1]] } }
"""


def bar(tmp_path, *changes):
    text = BAR
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = tmp_path / "bar.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_blend_survives_reading_and_writing(tmp_path):
    design = lt.load(bar(tmp_path))
    made = lt.Design(
        region=lt.region.box(size=[24, 8, 8]),
        lattice={
            "a": lt.Lattice("primitive", "upper", lt.map.affine(wavelength=4.0), lt.level.fraction(0.3)),
            "b": lt.Lattice("gyroid", "upper", lt.map.affine(wavelength=4.0), lt.level.fraction(0.3)),
        },
        blend=lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {-6: 0, 6: 1})),
    )
    assert design == made
    made.save(tmp_path / "again.toml")
    assert lt.load(tmp_path / "again.toml") == made


def test_the_mesh_is_whole_and_has_the_fraction(tmp_path):
    solid = lt.load(bar(tmp_path)).build()
    mesh = solid.mesh(per_cell=20)
    assert mesh.closed and mesh.self_intersections == 0
    # Whole cells at both ends and a transition in the middle: the sum over it is held, too.
    assert abs(mesh.measure()["solid_fraction"] - 0.30) < 0.01
    by_value = lt.load(bar(tmp_path, ("[blend]", '[blend]\nby = "value"'))).build().mesh(per_cell=20)
    assert by_value.measure()["solid_fraction"] < 0.28


def test_threads_change_no_bit(tmp_path):
    solid = lt.load(bar(tmp_path)).build()
    one, two = (solid.mesh(per_cell=12, threads=n) for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices) and np.array_equal(one.triangles, two.triangles)


def test_transitions_tell_the_fraction_and_the_neck(tmp_path):
    solid = lt.load(bar(tmp_path)).build()
    assert solid.report()["blend"]["phases"] == "locked"
    (it,) = solid.transitions()
    assert it["between"] == ["a", "b"] and abs(it["volume"] - 12 * 64) < 12
    for row in it["fractions"]:
        assert abs(row["asked"] - 0.3) < 1e-6
    # Slices a third of a cell thick are not whole cells; all together they are.
    assert abs(np.mean([row["found"] for row in it["fractions"]]) - 0.3) < 0.01
    neck = it["neck"]
    assert 0.3 < neck["diameter"] < 2.5 and -6.5 < neck["place"][0] < 6.5


def test_lattices_that_do_not_meet_have_no_neck(tmp_path):
    """Loose balls on either side: no way leads across, and all of them are loose or a side's own."""
    file = bar(tmp_path, ("fraction = 0.30", "fraction = 0.10"), ('cell = "gyroid"', 'cell = "primitive"'))
    solid = lt.load(file)
    with pytest.warns(lt.DesignWarning):
        (it,) = solid.build().transitions()
    assert it["neck"] is None and it["loose"]["bodies"] > 0 and it["pieces"] >= it["loose"]["bodies"]


def test_grades_of_boundaries(tmp_path):
    """Each is a number like any other: a level shows what it is."""

    def value(grade, points):
        core = lt.Lattice("primitive", "lower", lt.map.affine(wavelength=4.0), lt.level.iso(grade))
        # So wide that the region's own distance is nowhere the greater.
        design = lt.Design(region=lt.region.box(size=[400, 400, 400]), lattice={"a": core})
        x, y, z = np.asarray(points, dtype=float).T
        f = np.cos(np.pi * x / 2) + np.cos(np.pi * y / 2) + np.cos(np.pi * z / 2)
        return f - design.build().field(points)

    points = [[0.0, 0.0, 3.0], [3.0, 0.0, 0.0], [7.0, 1.0, 2.0], [1.0, 6.0, -4.0]]
    r = np.linalg.norm(points, axis=1)
    line = lt.grade.distance([[0, 0, 0], [0, 0, 1]], axis=None)
    exact = [2.0, 3.0, np.sqrt(51), np.sqrt(1 + 36 + 16)]
    assert np.allclose(value(line, points), exact)
    inside = value(lt.grade.region(lt.region.sphere(radius=3), width=4), points)
    assert np.allclose(inside[:2], 0.5) and inside[2] == pytest.approx(0.0, abs=1e-12)
    ball = value(lt.grade.rbf([[0, 0, 0]], delta=5.0), points)
    assert np.allclose(ball, np.exp(-(r**2) / 25))
    step = value(lt.grade.sigmoid(lt.grade.formula("x"), at=3, width=8), points)
    assert step[1] == pytest.approx(0.5) and step[2] == pytest.approx(1.0) and 0 < step[0] < step[3] < 0.5
    (tmp_path / "points.csv").write_text("x,y,z,value\n0,0,0,2\n4,0,0,1\n")
    table = lt.Design(
        region=lt.region.box(size=[400, 400, 400]),
        lattice={
            "a": lt.Lattice(
                "primitive",
                "lower",
                lt.map.affine(wavelength=4.0),
                lt.level.iso(lt.grade.rbf("points.csv", delta=3)),
            )
        },
        folder=str(tmp_path),
    )
    assert np.allclose(3 - table.build().field([[0, 0, 0], [4, 0, 0]]), [2, 1])


@pytest.mark.parametrize(
    ("change", "path", "words"),
    [
        (('between = ["a", "b"]', 'between = ["a", "bb"]'), "blend.between[1]", ["bb", '"b"']),
        (('between = ["a", "b"]', 'between = ["a", "a"]'), "blend.between[1]", ["twice"]),
        (('between = ["a", "b"]', 'between = ["a"]'), "blend.between", ["two", "1 value"]),
        (("weight = {", "wieght = {"), "blend.wieght", ["weight"]),
        (("[blend]", '[blend]\nby = "volume"'), "blend.by", ["fraction", "value"]),
        (("fraction = 0.30 }\nmap", 'fraction = 0.30, of = "part" }\nmap'), "lattice.a.level.of", ["blend"]),
    ],
)
def test_slips_are_told_where_they_are(tmp_path, change, path, words):
    with pytest.raises(lt.DesignError) as e:
        lt.load(bar(tmp_path, change)).build()
    assert e.value.path == path
    for word in words:
        assert word in str(e.value), str(e.value)


@pytest.mark.parametrize(
    ("blend", "path", "words"),
    [
        # all zero beyond x = 0
        ("of = { a = { formula = 'max(-x, 0)' }, b = 0 }", "blend.of", ["all weights are 0 at", "mm"]),
        ("of = { a = 1 }", "blend.of", ["at least 2"]),
        ("of = { a = 1, c = 1 }", "blend.of.c", ["c", "lattice"]),
        ("between = ['a', 'b']", "blend", ["weight"]),
        ("between = ['a', 'b']\nweight = 0.5\nof = { a = 1, b = 1 }", "blend.of", ["found between and of"]),
        (
            "between = ['a', 'b']\nweight = { rbf = { points = [[0, 0, 0], [3, 0, 0], [0, 0, 0]] } }",
            "blend.weight.rbf.points",
            ["0 and 2 coincide"],
        ),
        (
            "between = ['a', 'b']\nweight = { rbf = { points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], delta = 100 } }",
            "blend.weight.rbf.delta",
            ["singular", "1.5 mm"],
        ),
        (
            "between = ['a', 'b']\nweight = { distance = { points = [[0, 0, 0]] } }",
            "blend.weight.distance.points",
            ["at least 2"],
        ),
        (
            "between = ['a', 'b']\nweight = { sigmoid = { of = { formula = 'x' }, width = 0 } }",
            "blend.weight.sigmoid.width",
            ["0"],
        ),
    ],
)
def test_weights_that_cannot_be_are_refused(tmp_path, blend, path, words):
    text = BAR[: BAR.index("[blend]")] + "[blend]\n" + blend + "\n"
    file = tmp_path / "bar.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(lt.DesignError) as e:
        lt.load(file).build()
    assert e.value.path == path, str(e.value)
    for word in words:
        assert word in str(e.value), str(e.value)


def test_a_lattice_nobody_uses_is_refused(tmp_path):
    more = (
        '[lattice.c]\ncell = "iwp"\npart = "upper"\nlevel = { fraction = 0.3 }\nmap = { affine = { wavelength = 4 } }\n[blend]'
    )
    with pytest.raises(lt.DesignError) as e:
        lt.load(bar(tmp_path, ("[blend]", more))).build()
    assert e.value.path == "lattice.c" and "a, b" in str(e.value)


def test_a_transition_finer_than_the_grid_is_refused_and_a_narrow_one_told(tmp_path):
    design = lt.load(bar(tmp_path, ("[[-6, 0], [6, 1]]", "[[-0.1, 0], [0.1, 1]]")))
    with pytest.warns(lt.DesignWarning, match="0.2 mm wide"):
        solid = design.build()
    with pytest.raises(ValueError, match="transition"):
        solid.mesh(edge=0.25)


def test_check_warns_where_no_solid_leads_across(tmp_path):
    """Half a diagonal away primitive cells are their own negative: both are warned of, the cancelling and the gap."""
    second = 'cell = "gyroid"\npart = "upper"\nlevel = { fraction = 0.30 }\nmap = { affine = { wavelength = 4.0 } }'
    opposite = second.replace("gyroid", "primitive").replace("4.0", "4.0, offset = [2, 2, 2]")
    file = bar(tmp_path, (second, opposite))
    run = [sys.executable, "-m", "trabecula", "check", str(file)]
    done = subprocess.run(run, capture_output=True, text=True, check=True)
    assert "cancel at (0, " in done.stderr and 'no solid leads from "a" to "b"' in done.stderr
    report = json.loads(subprocess.run([*run, "--json"], capture_output=True, text=True, check=True).stdout)
    (reported,) = report["blend"]["transitions"]
    assert [w["path"] for w in report["warnings"]] == ["blend", "blend"]
    # A lattice's solid ends within a cell of where the other takes over.
    assert reported["neck"] is None and abs(reported["gap"][0]) < 4


@pytest.mark.parametrize(
    "weight, path, words",
    [
        ('{ formula = "x/3" }', "blend.weight", "the weight is -4 to 4, "),
        ("{ distance = { points = [[-9, -3, 0], [9, 3, 0], [9, -3, 0], [-9, 3, 0]], closed = true, axis = [0, 0, 1] } }",
         "blend.weight.distance", "crosses itself at (0, 0, 0) mm, where its segments 0 and 2"),
    ],
)  # fmt: skip
def test_weights_that_may_not_be_meant_are_warned_of(tmp_path, weight, path, words):
    ramp = "{ linear = { along = [1, 0, 0], stops = [[-6, 0], [6, 1]] } }"
    reported = lt.load(bar(tmp_path, (ramp, weight))).build().warnings
    assert any(w["path"] == path and words in w["message"] for w in reported), reported
    sound = lt.load(bar(tmp_path, (ramp, '{ formula = "0.5 + x/24" }'))).build()
    assert sound.warnings == []


def test_check_tells_and_draws_the_transitions(tmp_path):
    file = bar(tmp_path)
    run = [sys.executable, "-m", "trabecula", "check", str(file)]
    reported = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    assert "transition a to b" in reported and "neck" in reported and "phases locked" in reported
    picture = tmp_path / "bar.svg"
    run += ["--json", "--transitions", str(picture)]
    report = json.loads(subprocess.run(run, capture_output=True, text=True, check=True).stdout)
    assert report["blend"]["transitions"][0]["between"] == ["a", "b"]
    assert "Transition from a to b" in picture.read_text(encoding="utf-8")
    run = [sys.executable, "-m", "trabecula", "measure", str(file), "--per-cell", "10"]
    reported = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    assert "transition a to b" in reported and "pieces" in reported and "dangling" in reported
    drawn = tmp_path / "measured.svg"
    run += ["--json", "--transitions", str(drawn)]
    figures = json.loads(subprocess.run(run, capture_output=True, text=True, check=True).stdout)
    # The same grid is looked at, whatever the mesh.
    assert figures["transitions"] == report["blend"]["transitions"] and figures["transitions"][0]["pieces"] == 1
    assert drawn.read_bytes() == picture.read_bytes()
    alone = subprocess.run(
        [sys.executable, "-m", "trabecula", "check", str(EXAMPLES / "gyroid_cube.toml"), "--transitions", str(picture)],
        capture_output=True,
        text=True,
    )
    assert alone.returncode == 2 and "blend" in alone.stderr


def test_a_lattice_over_tetrahedra_takes_part():
    """Walls in tetrahedra pass into a network; without a blend they stand alone."""
    lattices = {
        "a": lt.Lattice(lt.cell.tet("primitive"), "upper", lt.map.tets(size=5), lt.level.fraction(0.45)),
        "b": lt.Lattice("gyroid", "upper", lt.map.affine(wavelength=4.0), lt.level.fraction(0.3)),
    }
    box = lt.region.box(size=[32, 12, 12])
    blend = lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {-8: 0, 8: 1}))
    solid = lt.Design(region=box, lattice=lattices, blend=blend).build()
    (it,) = solid.transitions()
    assert it["neck"] is not None
    # In tenths of the weight, by windows that the region cuts short; what tetrahedra have where they end is not the cell's own.
    for row in it["fractions"]:
        assert abs(row["found"] - (0.45 - 0.15 * row["share"])) < 0.02
    mesh = solid.mesh(edge=0.4)
    assert mesh.closed and mesh.self_intersections == 0
    with pytest.raises(lt.DesignError, match="blend") as e:
        lt.Design(region=box, lattice=lattices).build()
    assert e.value.path == "lattice.b"


def test_beams_take_part_with_the_fraction_they_have():
    """The fraction asked for of beams is what they have there; the sheet's second side stays until it sinks in."""
    beams = lt.Beams("octet", lt.map.affine(wavelength=5.0), radius=0.45)
    sheet = lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=4.0), lt.level.fraction(0.3))
    blend = lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {-10: 0, 10: 1}))
    design = lt.Design(region=lt.region.box(size=[40, 20, 20]), lattice={"a": sheet}, beams={"b": beams}, blend=blend)
    (it,) = design.build().transitions()
    assert all(row["asked"] is not None for row in it["fractions"])
    assert max(abs(row["found"] - row["asked"]) for row in it["fractions"]) < 0.01


BEAMS = """schema = 1
[region.box]
size = [24, 12, 12]
[beams.a]
cell = "octet"
radius = 0.4
map.affine.wavelength = 6
"""


def test_beams_in_a_blend_have_a_fraction_of_their_own(tmp_path):
    file = tmp_path / "beams.toml"
    file.write_text(BEAMS, encoding="utf-8")
    alone = lt.load(file).build().report()["beams"]["a"]["fraction"]
    lattice = BAR[BAR.index("[lattice.b]") : BAR.index("[blend]")]
    blend = '[blend]\nbetween = ["a", "b"]\nweight.linear = { along = [1, 0, 0], stops = [[-12, 0], [12, 1]] }\n'
    file.write_text(BEAMS + lattice + blend, encoding="utf-8")
    # The same beams, looked at in some thousands of places.
    assert lt.load(file).build().report()["beams"]["a"]["fraction"] == pytest.approx(alone, abs=0.01)


def test_where_no_lattice_is_alone_not_all_is_loose(tmp_path):
    ramp = "weight = { linear = { along = [1, 0, 0], stops = [[-6, 0], [6, 1]] } }"
    slow = "weight = { linear = { along = [1, 0, 0], stops = [[-12, 0.2], [12, 0.8]] } }"
    for weight, crosses in ((slow, True), ("weight = 0.5", False)):
        (reported,) = lt.load(bar(tmp_path, (ramp, weight))).build().transitions()
        assert (reported["neck"] is not None) == crosses
        # Crumbs that the sides of the bar cut off, of some 460 mm³ of solid.
        assert reported["loose"]["volume"] < 5
