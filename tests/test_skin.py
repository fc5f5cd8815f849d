"""Skins, openings, keep zones and closed voids, through every door."""

import json
import math
import subprocess
import sys
import warnings

import numpy as np
import pytest
import trabecula as lt
from conftest import CUBE
from trabecula import _core


def design(**more):
    """A gyroid in a box of 12 mm."""
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.25))
    return lt.Design(region=lt.region.box(size=[12, 12, 12]), lattice=core, **more)


def command(*words):
    """What the command says."""
    return subprocess.run([sys.executable, "-m", "trabecula", *map(str, words)], capture_output=True, text=True, timeout=600)


def refused(more, text=CUBE):
    """The error of the small cube (8 mm) with more lines."""
    with pytest.raises(lt.DesignError) as caught:
        _core.Design.from_text(text + more, False, None).build(".")
    return caught.value


CASES = [
    ("[skin]\nthickness = 0\n", "skin.thickness", ["thickness is 0 mm", "greater than 0"]),
    ("[skin]\nthickness = -1\n", "skin.thickness", ["thickness is -1 mm"]),
    ("[skin]\nthickness = nan\n", "skin.thickness", ["thickness is NaN mm"]),
    ("[skin]\nthickness = inf\n", "skin.thickness", ["thickness is inf mm"]),
    ("[skin]\nthickness = 4\n", "skin.thickness", ["a skin of 4.0000 mm", "the part would be solid", "below its surface"]),
    ("[skin]\nthickness = 1e9\n", "skin.thickness", ["the part would be solid"]),
    ('[skin]\nthickness = { formula = "1 - x" }\n', "skin.thickness.formula", ["thickness is -", "at ("]),
    (
        "[skin]\nthickness = { linear = { along = [0, 0, 1], stops = [[0, 1], [4, 0]] } }\n",
        "skin.thickness.linear.stops[1]",
        ["thickness is 0 mm at position 4"],
    ),
    ('[skin]\nthickness = "thick"\n', "skin.thickness", ["expected a number"]),
    ('[skin]\nthickness = 1\nopen = ["z"]\n', "skin.open[0]", ["unknown side", "-x, +x, -y, +y, -z, +z"]),
    ('[skin]\nthickness = 1\nopen = ["top"]\n', "skin.open[0]", ['did you mean "+z"']),
    ("[skin]\nthickness = 1\nopen = [3]\n", "skin.open[0]", ["half-space"]),
    (
        "[skin]\nthickness = 1\nopen = [{ point = [0, 0, 3], normal = [0, 0, 1] }]\n",
        "skin.open[0]",
        ["no flat face", "(0, 0, 3) mm", "(0, 0, 1)"],
    ),
    ("[skin]\nthickness = 1\nopen = [{ point = [0, 0, 4], normal = [0, 0, 0] }]\n", "skin.open[0].normal", ["direction"]),
    (
        "[skin]\nthickness = 1\nopen = [{ point = [0, 0, nan], normal = [0, 0, 1] }]\n",
        "skin.open[0].point[2]",
        ["finite", "NaN"],
    ),
    ('[skin]\nthickness = 1\nopen = ["-x", "+x", "-y", "+y", "-z", "+z"]\n', "skin.open", ["no skin"]),
    ("[keep.boss.sphere]\nradius = 1\ncenter = [9, 0, 0]\n", "keep.boss", ["outside the region", "(8, -1, -1)", "(4, 4, 4)"]),
    ("[keep.boss.sphere]\nradius = 20\n", "keep.boss", ["the whole region", "the part would be solid"]),
    ("[keep.boss.sphere]\nradius = 0\n", "keep.boss.sphere.radius", ["radius is 0"]),
    (
        "[keep.boss]\nintersection = [{ sphere = { radius = 1 } }, { box = { min = [2, 2, 2], max = [3, 3, 3] } }]\n",
        "keep.boss",
        ["it is empty"],
    ),
    ("[keep.boss.sphere]\nraduis = 1\n", "keep.boss.sphere.raduis", ['did you mean "radius"']),
    ("[keep.boss.mesh]\npath = 'none.stl'\n", "keep.boss.mesh.path", ["does not exist"]),
    (
        "[keep.low.halfspace]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n"
        "[keep.high.halfspace]\npoint = [0, 0, -1]\nnormal = [0, 0, -1]\n",
        "keep",
        ["fill the whole region"],
    ),
    ("[skin]\nthickness = 2\n[keep.heart.sphere]\nradius = 3.9\n", "skin", ["the skin and the keep zones fill"]),
]


@pytest.mark.parametrize(("more", "path", "parts"), CASES, ids=[f"{i}-{c[1]}" for i, c in enumerate(CASES)])
def test_bad_skins_and_zones(more, path, parts):
    """One error with the place, the number found and the cure."""
    error = refused(more)
    assert error.path == path, str(error)
    assert error.line is not None and error.line >= 12
    for part in parts:
        assert part in str(error), str(error)


def test_regions_that_do_not_touch():
    """Two regions without a common point are no region."""
    text = CUBE.replace(
        "[region.box]\nsize = [8, 8, 8]",
        "[region]\nintersection = [{ sphere = { radius = 1 } }, { sphere = { radius = 1, center = [5, 0, 0] } }]",
    )
    error = refused("[skin]\nthickness = 1\n", text)
    assert error.path == "region" and "empty" in str(error)


def test_a_ball_has_no_flat_face():
    """A curved region cannot be opened; the message says how to."""
    text = CUBE.replace("[region.box]\nsize = [8, 8, 8]", "[region.sphere]\nradius = 5")
    error = refused('[skin]\nthickness = 1\nopen = ["-z"]\n', text)
    assert error.path == "skin.open[0]" and "cut it there with a half-space" in str(error)


def test_builders_and_files_agree(tmp_path):
    """The builders write what the file says, and all doors give one field."""
    made = design(
        skin=lt.skin(0.8, open=["-z", lt.region.halfspace([6, 0, 0], [1, 0, 0])]),
        keep={"boss": lt.region.cylinder([0, 0, -6], 2, 12)},
    )
    made.save(tmp_path / "a.toml")
    made.save(tmp_path / "a.json")
    text = (tmp_path / "a.toml").read_text()
    assert "[skin]" in text and "[keep.boss.cylinder]" in text
    points = np.random.default_rng(3).uniform(-7, 7, (4000, 3))
    field = made.build().field(points)
    for name in ("a.toml", "a.json"):
        read = lt.load(tmp_path / name)
        assert read == made and hash(read) == hash(made)
        assert (read.build().field(points) == field).all()
    assert design() != made and "skin" not in design().to_dict()
    # Membership by logic of its own.
    x, y, z = points.T
    region = np.abs(points).max(axis=1) <= 6
    skin = (np.minimum.reduce([x + 6, 6 - y, y + 6, 6 - z]) <= 0.8) & region
    boss = np.hypot(x, y) <= 2
    lattice = design().build().field(points) <= 0
    assert ((field <= 0) == (region & (skin | boss | lattice))).all()
    assert made.build().skin == 0.8 and design().build().skin is None


def test_paths_of_zones_move_with_the_file(tmp_path):
    """A mesh kept solid is found from wherever the design is written."""
    lt.Design(region=lt.region.sphere(2), lattice=design().lattice).build().mesh(edge=0.4).write(tmp_path / "zone.stl")
    solid = lt.load(write(tmp_path / "d.toml", CUBE + "[keep.a.mesh]\npath = 'zone.stl'\n"))
    (tmp_path / "sub").mkdir()
    solid.save(tmp_path / "sub" / "e.toml")
    assert "../zone.stl" in (tmp_path / "sub" / "e.toml").read_text()
    assert lt.load(tmp_path / "sub" / "e.toml") == solid
    done = command("mesh", tmp_path / "d.toml", "-o", tmp_path / "zone.stl")
    assert done.returncode == 1 and "read by this design" in done.stderr


def write(path, text):
    """A file of some text."""
    path.write_text(text)
    return path


def test_voxels_see_the_skin():
    """Voxels, the mesh and the field are of one solid."""
    solid = design(skin=lt.skin(1.0, open=["+z"])).build()
    grid = solid.voxels(step=0.1)
    assert grid.solid[:10].all() and grid.solid[:, :, :10].all() and not grid.solid[:, :, -1].all()
    volume = solid.mesh(edge=0.1).volume
    assert grid.volume == pytest.approx(volume, rel=5e-3)


@pytest.mark.parametrize("of", ["part", "cell"])
def test_the_fraction_of_the_part_counts_the_skin(of):
    """of = "part" is the finished part's own figure, skin and bosses included."""
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.6, of=of))
    more = {"skin": lt.skin(1.0, open=["-z"]), "keep": {"boss": lt.region.cylinder([0, 0, -6], 1.5, 12)}}
    made = lt.Design(lt.region.box(size=[12, 12, 12]), core, **more).build()
    found = made.mesh(edge=0.1).solid_fraction
    if of == "part":
        assert found == pytest.approx(0.6, abs=1e-3)
    else:
        share = 1 - 100 * 11 / 1728
        assert found > share + 0.5 * (1 - share)


def test_a_part_fraction_below_the_skin_is_refused():
    """What the skin holds already cannot be had with less."""
    text = CUBE.replace("fraction = 0.3", 'fraction = 0.3\nof = "part"')
    error = refused("[skin]\nthickness = 1\n", text)
    assert error.path == "lattice.core.level.fraction"
    # 1 - (6/8)^3
    assert "0.578" in str(error) and "too little" in str(error)


def test_a_closed_skin_traps_powder(tmp_path):
    """A sheet in a closed skin: two labyrinths and the pockets of two corners, reported with volume and place; an open face
    drains all but one."""
    closed = write(tmp_path / "closed.toml", CUBE + "[skin]\nthickness = 0.5\n")
    for name in ("a.stl", "a.ply"):
        done = command("mesh", closed, "-o", tmp_path / name, "--json")
        made = json.loads(done.stdout)
        assert made["cavities"] == len(made["voids"]) == 4
        assert "4 closed voids" in done.stderr and "cannot drain" in done.stderr
        hollow = sum(v["volume"] for v in made["voids"])
        assert hollow + made["volume"] == pytest.approx(512, rel=1e-9)
    solid = lt.load(closed).build()
    mesh = solid.mesh(per_cell=32)
    assert [v["volume"] for v in mesh.voids] == sorted((v["volume"] for v in mesh.voids), reverse=True)
    assert (solid.field([v["point"] for v in mesh.voids]) > 0).all()
    assert mesh.voids[1]["volume"] > 100 > 1 > mesh.voids[2]["volume"]
    for void in mesh.voids:
        low, high = np.array(void["bounds"])
        assert (low < void["point"]).all() and (void["point"] < high).all()
        assert (np.abs([low, high]) <= 3.51).all()
    figures = command("measure", tmp_path / "a.stl")
    assert "4 closed voids" in figures.stderr and figures.returncode == 0
    drained = write(tmp_path / "open.toml", CUBE + '[skin]\nthickness = 0.5\nopen = ["-z"]\n')
    done = command("mesh", drained, "-o", tmp_path / "b.stl", "--json")
    left = json.loads(done.stdout)["voids"]  # the pocket of the upper corner
    assert len(left) == 1 and left[0]["volume"] < 0.3 and "one closed void of 0.26" in done.stderr


def test_the_same_bytes_by_either_method(tmp_path):
    """A part with a skin is held in memory to look for voids; the file is the one that streaming writes."""
    file = write(tmp_path / "a.toml", CUBE + '[skin]\nthickness = 0.5\nopen = ["-z"]\n')
    command("mesh", file, "-o", tmp_path / "a.stl", "--edge", 0.2)
    lt.load(file).build().save(tmp_path / "b.stl", edge=0.2)
    assert (tmp_path / "a.stl").read_bytes() == (tmp_path / "b.stl").read_bytes()


def test_a_void_has_its_volume_and_centre():
    """A ball's void in a box."""
    shell = lt.region.difference(lt.region.box(size=[8, 8, 8]), lt.region.sphere(2, center=[1, 0.5, -1]))
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.9))
    filled = lt.Design(shell, core, keep={"all": lt.region.box(min=[-2, -3, -4], max=[4, 4, 2])}).build()
    void = filled.mesh(edge=0.1).voids[0]
    assert void["volume"] == pytest.approx(4 / 3 * math.pi * 8, rel=1e-3)
    assert void["point"] == pytest.approx([1, 0.5, -1], abs=0.05)
    assert np.array(void["bounds"]) == pytest.approx(np.array([[-1, -1.5, -3], [3, 2.5, 1]]), abs=0.02)


def test_thin_skins_are_warned_of():
    """Less than a step thick: kept closed, and reported."""
    solid = design(skin=lt.skin(0.05)).build()
    with pytest.warns(lt.DesignWarning, match="skin: at its thinnest, 0.05 mm"):
        mesh = solid.mesh(edge=0.2)
    assert mesh.closed
    with warnings.catch_warnings():
        warnings.simplefilter("error", lt.DesignWarning)
        design(skin=lt.skin(0.5)).build().mesh(edge=0.14)


def test_the_report_keeps_its_keys(tmp_path):
    """check --json says of the lattice what it says without a skin."""
    plain = json.loads(command("check", write(tmp_path / "a.toml", CUBE), "--json").stdout)
    skin = json.loads(command("check", write(tmp_path / "b.toml", CUBE + "[skin]\nthickness = 1\n"), "--json").stdout)
    assert plain == skin
