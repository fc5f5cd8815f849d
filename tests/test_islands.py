"""Components besides the largest: kept with a warning, dropped, or refused, through both doors."""

import json
import warnings

import pytest
import trabecula as lt
from test_cli import names, run

#: A network far below its limit falls apart into balls; the box cuts some of them.
BALLS = """\
schema = 1
units = "mm"
[region.box]
size = [8, 8, 8]
center = [0.5, 0.3, 0.2]
[lattice.a]
cell = "primitive"
part = "lower"
[lattice.a.map.affine]
wavelength = 4
rotate = [10, 20, 30]
[lattice.a.level]
fraction = 0.1
"""
#: A hollow ball beside a small one: its cavity is no piece and stays with it.
HOLLOW = """\
schema = 1
units = "mm"
[[region.union]]
difference = [{ sphere = { radius = 4 } }, { sphere = { radius = 3 } }]
[[region.union]]
sphere = { center = [6, 0, 0], radius = 1.5 }
[lattice.a]
cell = "gyroid"
part = "upper"
[lattice.a.map.affine]
wavelength = 4
[lattice.a.level]
fraction = 0.98
"""
BALL = """\
[region.sphere]
radius = 2
[lattice.a]
cell = "gyroid"
part = "lower"
[lattice.a.map.affine]
wavelength = 4
[lattice.a.level]
fraction = 0.6
"""


@pytest.fixture
def balls(tmp_path):
    """A part in many pieces, as a file."""
    (tmp_path / "balls.toml").write_text(BALLS)
    return tmp_path / "balls.toml"


@pytest.mark.parametrize("name", ["a.stl", "a.3mf", "a.ply", "a.obj"])
def test_the_command_keeps_drops_and_refuses(tmp_path, balls, name):
    """Every format: the same figures as `measure` of the file, before and after; nothing is left by a refusal."""
    made = {}
    for islands in ("keep", "drop"):
        done = run("mesh", balls, "-o", name, "--edge", 0.25, "--islands", islands, "--json", cwd=tmp_path)
        made[islands] = json.loads(done.stdout)
        measured = json.loads(run("measure", name, "--json", cwd=tmp_path).stdout)
        for key in ("pieces", "cavities", "euler"):
            assert made[islands][key] == measured[key]
        # Single precision, or fewer digits, in a file.
        assert made[islands]["volume"] == pytest.approx(measured["volume"], rel=1e-5)
        assert "not in one piece" in done.stderr if islands == "keep" else "pieces dropped" in done.stderr
    kept, one = made["keep"]["islands"], made["drop"]["islands"]
    assert (kept["dropped"], one["dropped"]) == (0, made["keep"]["pieces"] - 1)
    assert (kept["dropped_volume"], one["dropped_volume"]) == (0, one["volume"])
    same = kept.keys() - {"dropped", "dropped_volume", "filled", "filled_volume"}
    assert {k: kept[k] for k in same} == {k: one[k] for k in same}
    assert 0 < kept["border"] < kept["found"]
    assert made["keep"]["volume"] == pytest.approx(made["drop"]["volume"] + kept["volume"])
    assert kept["share"] == pytest.approx(made["drop"]["volume"] / made["keep"]["volume"])
    assert made["drop"]["pieces"] == 1
    low, high = kept["largest"]["bounds"]
    middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
    assert kept["largest"]["place"] == pytest.approx(middle) and kept["largest"]["volume"] <= kept["volume"]
    (tmp_path / name).unlink()
    done = run("mesh", balls, "-o", name, "--edge", 0.25, "--islands", "error", cwd=tmp_path, status=1)
    last = done.stderr.splitlines()[-1]
    assert last.startswith("trabecula: islands: ") and f"{kept['found']} connected components besides the largest" in last
    assert names(tmp_path) == ["balls.toml"]


def test_small_ones_are_dropped_by_default_and_one_piece_says_nothing(tmp_path, balls):
    """Those under eight grid cells at the region's boundary; dropping nothing changes no byte."""
    made = {}
    for name, words in {"default": (), "drop-small": ("--islands", "drop-small"), "keep": ("--islands", "keep")}.items():
        done = run("mesh", balls, "-o", f"{name}.stl", "--edge", 0.25, "--json", *words, cwd=tmp_path)
        made[name] = json.loads(done.stdout)
    assert (tmp_path / "default.stl").read_bytes() == (tmp_path / "drop-small.stl").read_bytes()
    small, kept = made["default"]["islands"], made["keep"]["islands"]
    assert small["dropped"] <= small["border"] and small["dropped_volume"] <= small["dropped"] * 8 * 0.25**3
    assert made["default"]["pieces"] == made["keep"]["pieces"] - small["dropped"]
    assert made["default"]["volume"] == pytest.approx(made["keep"]["volume"] - small["dropped_volume"])
    assert (small["found"], kept["dropped"]) == (kept["found"], 0)
    # The cube of the README: its boundary cuts a crumb of 0.009 mm³ off at two corners.
    cube = (
        BALLS.replace("[8, 8, 8]\ncenter = [0.5, 0.3, 0.2]", "[20, 20, 20]")
        .replace("primitive", "gyroid")
        .replace("lower", "sheet")
    )
    cube = cube.replace("wavelength = 4\nrotate = [10, 20, 30]", "wavelength = 5").replace("0.1", "0.3")
    (tmp_path / "cube.toml").write_text(cube)
    done = json.loads(run("mesh", "cube.toml", "-o", "cube.stl", "--edge", 0.25, "--json", cwd=tmp_path).stdout)
    assert (done["pieces"], done["islands"]["dropped"]) == (1, 2)
    (tmp_path / "ball.toml").write_text(HOLLOW.split("[[region")[0] + BALL)
    files = set()
    for islands in ("keep", "drop-small", "drop", "error"):
        done = run("mesh", "ball.toml", "-o", "c.stl", "--edge", 0.1, "--islands", islands, "--threads", 2, cwd=tmp_path)
        assert "1 piece;" in done.stderr and "warning" not in done.stderr
        files.add((tmp_path / "c.stl").read_bytes())
    assert len(files) == 1


def test_python(tmp_path, balls):
    """`Solid.mesh` and `Solid.save` give the same figures; a mesh from a file knows of none."""
    with pytest.warns(lt.DesignWarning, match="periodic solid is not one piece"):
        solid = lt.load(balls).build()
    with pytest.warns(lt.DesignWarning, match="not in one piece: .* at the region's boundary"):
        mesh = solid.mesh(edge=0.25, islands="keep")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = solid.mesh(edge=0.25, islands="drop")
        reported = solid.save(tmp_path / "a.stl", edge=0.25, islands="drop")
    assert reported["islands"] == one.islands
    assert one.islands["dropped"] == mesh.pieces - 1 == mesh.islands["found"] and mesh.islands["dropped"] == 0
    assert one.pieces == reported["pieces"] == 1 and one.closed
    assert one.volume == pytest.approx(reported["volume"]) == pytest.approx(mesh.volume - mesh.islands["volume"])
    assert len(one.cut) == len(one.triangles) and one.triangles.max() + 1 == len(one.vertices)
    assert lt.Mesh.read(tmp_path / "a.stl").islands is None
    assert one.within(solid).islands == one.islands
    for make in (solid.mesh, lambda **k: solid.save(tmp_path / "b.stl", **k)):
        with pytest.raises(ValueError, match="not in one piece"):
            make(edge=0.25, islands="error")
    assert names(tmp_path) == ["a.stl", "balls.toml"]


def test_a_cavity_stays_with_its_piece(tmp_path):
    """What lies in the largest piece is neither dropped nor counted as a piece."""
    (tmp_path / "hollow.toml").write_text(HOLLOW)
    solid = lt.load(tmp_path / "hollow.toml").build()
    one = solid.mesh(edge=0.2, islands="drop")
    with pytest.warns(lt.DesignWarning, match="1 connected component besides the largest"):
        both = solid.mesh(edge=0.2)
    assert (both.pieces, one.pieces, one.islands["dropped"]) == (2, 1, 1)
    # The cell's voids in the wall and in the small ball are smaller than a grid cell: filled, unless all is kept.
    kept = solid.mesh(edge=0.2, islands="keep")
    assert (one.cavities, both.cavities) == (0, 0) and kept.cavities == both.islands["filled"] >= one.islands["filled"] >= 1
    # 2 % of the cell are void; the walls are under two cells.
    assert one.volume == pytest.approx(0.98 * 4 / 3 * 3.141592653589793 * (4**3 - 3**3), rel=0.02)


@pytest.mark.parametrize("islands", ["Keep", "", "largest", None, 1, True, ["keep"]])
def test_other_words_are_refused(tmp_path, balls, islands):
    """Before any work is done."""
    solid = lt.load(balls).build()
    for make in (solid.mesh, lambda **k: solid.save(tmp_path / "b.stl", **k)):
        with pytest.raises(ValueError, match=r'islands is .*; it must be "keep", "drop-small", "drop" or "error"'):
            make(edge=0.25, islands=islands)
    words = ["mesh", balls, "-o", "b.stl", "--islands", "some"]
    assert "--islands" in run(*words, cwd=tmp_path, status=2).stderr
    assert names(tmp_path) == ["balls.toml"]
