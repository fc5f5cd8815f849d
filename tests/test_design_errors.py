"""Bad designs: each gets one error with the place, the line, the number found and the cure."""

import pytest
import trabecula as lt
from conftest import CUBE

LEVEL = "lattice.core.level"
MAP = "lattice.core.map.affine"
SHELL = "cell = 'gyroid'\npart = 'sheet'\nmap.affine.wavelength = 4\nlevel.iso = 0.3"

# (line of the good design, what stands there instead, path, parts of the message)
CASES = [
    # misspelt words
    ("[region.box]", "[regoin.box]", "regoin", ["unknown key", 'did you mean "region"']),
    ("[region.box]", "[region.boxx]", "region.boxx", ["unknown region", 'did you mean "box"']),
    (
        "size = [8, 8, 8]",
        "sise = [8, 8, 8]",
        "region.box.sise",
        ['did you mean "size"', "Allowed: size, center, min, max"],
    ),
    ('cell = "gyroid"', 'cell = "gyriod"', "lattice.core.cell", ['did you mean "gyroid"', "diamond"]),
    ('part = "sheet"', 'part = "sheets"', "lattice.core.part", ['did you mean "sheet"']),
    ("wavelength = 4.0", "wavelenght = 4.0", f"{MAP}.wavelenght", ['did you mean "wavelength"']),
    ("fraction = 0.3", "fracton = 0.3", f"{LEVEL}.fracton", ['did you mean "fraction"']),
    ('units = "mm"', 'units = "inch"', "units", ["mm", '"inch"']),
    ("schema = 1", "schema = 7", "schema", ["schema 1", "7"]),
    # what cannot be, and why
    ('cell = "gyroid"', 'cell.tet.name = "gyroid"', "lattice.core.cell.tet.name", ["no point of full tetrahedral symmetry"]),
    (
        "wavelength = 4.0",
        'wavelength = { formula = "4 + x" }',
        f"{MAP}.wavelength",
        ["use map.phase for a wavelength or an orientation that varies"],
    ),
    # amounts
    (
        "fraction = 0.3",
        "fraction = 0.3\niso = 0.2",
        LEVEL,
        ["found fraction and iso", "exactly one of thickness, pore, fraction"],
    ),
    ("fraction = 0.3", 'of = "part"', LEVEL, ["exactly one of thickness, pore, fraction"]),
    ("fraction = 0.3", "porosity = 0", f"{LEVEL}.porosity", ["porosity is 0", "greater than 0 and less than 1"]),
    ("fraction = 0.3", "porosity = 1", f"{LEVEL}.porosity", ["porosity is 1", "less than 1"]),
    ("fraction = 0.3", "porosity = 1.2", f"{LEVEL}.porosity", ["porosity is 1.2"]),
    ("fraction = 0.3", "porosity = -1", f"{LEVEL}.porosity", ["porosity is -1"]),
    ("fraction = 0.3", "porosity = nan", f"{LEVEL}.porosity", ["porosity is NaN"]),
    ("fraction = 0.3", "porosity = 70", f"{LEVEL}.porosity", ["porosity is 70", "write 0.7"]),
    ("fraction = 0.3", "fraction = inf", f"{LEVEL}.fraction", ["fraction is inf"]),
    ("fraction = 0.3", "iso = nan", f"{LEVEL}.iso", ["finite", "NaN"]),
    ("fraction = 0.3", "iso = 9", f"{LEVEL}.iso", ["solid everywhere", "-1.5", "1.5"]),
    ("fraction = 0.3", "iso = -1", f"{LEVEL}.iso", ["nothing is solid"]),
    ("fraction = 0.3", 'fraction = "much"', f"{LEVEL}.fraction", ["expected a number", '"much"']),
    ("fraction = 0.3", "thickness = 0", f"{LEVEL}.thickness", ["thickness is 0 mm", "greater than 0"]),
    ("fraction = 0.3", "thickness = -0.5", f"{LEVEL}.thickness", ["thickness is -0.5 mm", "greater than 0"]),
    ("fraction = 0.3", "thickness = nan", f"{LEVEL}.thickness", ["thickness is NaN", "greater than 0"]),
    ("fraction = 0.3", "thickness = 5", f"{LEVEL}.thickness", ["at most 4 mm, the wavelength"]),
    ("fraction = 0.3", "thickness = 3", f"{LEVEL}.thickness", ["solid everywhere", "half the thickness is 1.5"]),
    ("fraction = 0.3", 'thickness = 1\nof = "part"', f"{LEVEL}.of", ["fraction or porosity", "found thickness"]),
    (
        "fraction = 0.3",
        'thickness = { formula = "1 - x" }',
        f"{LEVEL}.thickness.formula",
        ["thickness is -", "at (", "greater than 0"],
    ),
    (
        "fraction = 0.3",
        "thickness = { linear = { along = [0, 0, 1], stops = [[0, 0.3], [4, 0]] } }",
        f"{LEVEL}.thickness.linear.stops[1]",
        ["thickness is 0 mm at position 4"],
    ),
    ("fraction = 0.3", "fraction = 0.3\nmid = 2", f"{LEVEL}.mid", ["mid is 2", "-1.5", "1.5"]),
    ("fraction = 0.3", "fraction = 0.3\nmid = nan", f"{LEVEL}.mid", ["finite", "NaN"]),
    ("fraction = 0.3", 'fraction = 0.3\nfit = "spartan"', f"{LEVEL}.fit", ["part lower"]),
    ("fraction = 0.3", 'iso = 0.3\nof = "part"', f"{LEVEL}.of", ["fraction or porosity"]),
    # grades
    (
        "fraction = 0.3",
        "fraction = { linear = { along = [0, 0, 1], stops = [[0, 0.3], [4, 1.0]] } }",
        f"{LEVEL}.fraction.linear.stops[1]",
        ["fraction is 1 at position 4"],
    ),
    (
        "fraction = 0.3",
        "fraction = { depth = { stops = [[3, 0.3], [1, 0.2]] } }",
        f"{LEVEL}.fraction.depth.stops[1]",
        ["rise", "1 after 3"],
    ),
    (
        "fraction = 0.3",
        "fraction = { linear = { along = [0, 0, 0], stops = [[0, 0.3]] } }",
        f"{LEVEL}.fraction.linear.along",
        ["direction is zero"],
    ),
    (
        "fraction = 0.3",
        'fraction = { formula = "0.9 + 0.1*x" }',
        f"{LEVEL}.fraction.formula",
        ["fraction is 1.3", "mm"],
    ),
    ("fraction = 0.3", 'fraction = { formula = "import os" }', f"{LEVEL}.fraction.formula", []),
    ("fraction = 0.3", "fraction = { radial = {} }", f"{LEVEL}.fraction.radial", ['"stops" is missing']),
    ("fraction = 0.3", 'fraction = { grid = { path = "no.npy" } }', f"{LEVEL}.fraction.grid.path", ["no.npy"]),
    ("fraction = 0.3", 'fraction = { field = { path = "a.vtu" } }', f"{LEVEL}.fraction.field", ['"array" is missing']),
    ("fraction = 0.3", "fraction = { liner = {} }", f"{LEVEL}.fraction.liner", ['did you mean "linear"']),
    # maps
    ("wavelength = 4.0", "wavelength = 0", f"{MAP}.wavelength", ["wavelength is 0", "greater than 0"]),
    ("wavelength = 4.0", "wavelength = -4", f"{MAP}.wavelength", ["wavelength is -4"]),
    ("wavelength = 4.0", "wavelength = inf", f"{MAP}.wavelength", ["wavelength is inf"]),
    ("wavelength = 4.0", "wavelength = [4, 0, 4]", f"{MAP}.wavelength[1]", ["wavelength is 0"]),
    ("wavelength = 4.0", "wavelength = [4, 4]", f"{MAP}.wavelength", ["2 values"]),
    ("wavelength = 4.0", "wavelength = 4\nrotate = 30", f"{MAP}.rotate", ["three numbers"]),
    ("wavelength = 4.0", "wavelength = 4\nskew = { xz = 90 }", f"{MAP}.skew.xz", ["90"]),
    ("map.affine]", "map.cylinder]", "lattice.core.map.cylinder", ['"around" is missing']),
    ("map.affine]", "map.cylinder]\naround = 2.5", "lattice.core.map.cylinder.around", ["2.5", "whole number"]),
    (
        "map.affine]",
        "map.phase]\nrotate_z = 3\nstress = [1, 2, 3, 0, 0, 0]",
        f"{MAP[:-6]}phase.rotate_z",
        ["found stress and rotate_z"],
    ),
    ("map.affine]", "map.phase]\nstep = 1e-4", f"{MAP[:-6]}phase.step", ["use a step above"]),
    # cells
    ('cell = "gyroid"', "cell.series = { terms = [] }", "lattice.core.cell.series", []),
    (
        'cell = "gyroid"',
        "cell.series = { group = 231, terms = [{ hkl = [1, 0, 0] }] }",
        "lattice.core.cell.series.group",
        ["1 to 230"],
    ),
    (
        'cell = "gyroid"',
        'cell.series = { group = "Fd3x", terms = [{ hkl = [1, 0, 0] }] }',
        "lattice.core.cell.series.group",
        ["Fd3x"],
    ),
    (
        'cell = "gyroid"',
        "cell.series = { group = 1.5, terms = [{ hkl = [1, 0, 0] }] }",
        "lattice.core.cell.series.group",
        ["1.5"],
    ),
    (
        'cell = "gyroid"',
        "cell.series = { group = 229, terms = [{ hkl = [1, 0, 0] }] }",
        "lattice.core.cell.series.terms[0].hkl",
        ["absent in Im-3m"],
    ),
    (
        'cell = "gyroid"',
        'cell.series = { group = 221, terms = [{ hkl = [1, 0, 0], component = "im" }] }',
        "lattice.core.cell.series.terms[0].hkl",
        ["imaginary part", 'component = "re"'],
    ),
    (
        'cell = "gyroid"',
        "cell.series = { terms = [{ hkl = [1, 0.5, 0] }] }",
        "lattice.core.cell.series.terms[0].hkl",
        ["a whole number"],
    ),
    # regions
    ("size = [8, 8, 8]", "size = [8, 8]", "region.box.size", ["three numbers", "2 values"]),
    ("size = [8, 8, 8]", "size = [8, 8, 0]", "region.box.size", ["0"]),
    ("size = [8, 8, 8]", "size = [8, 8, -8]", "region.box.size", ["-8"]),
    ("size = [8, 8, 8]", "size = [8, nan, 8]", "region.box.size", ["NaN"]),
    ("size = [8, 8, 8]", "size = [8, 8, 8]\nmin = [0, 0, 0]", "region.box.min", ["found size and min"]),
    ("[region.box]\nsize = [8, 8, 8]", "[region.sphere]\nradius = -2", "region.sphere.radius", ["-2"]),
    ("[region.box]\nsize = [8, 8, 8]", "[region.mesh]\npath = 'none.stl'", "region.mesh.path", ["does not exist"]),
    ("[region.box]\nsize = [8, 8, 8]", "[region.mesh]\npath = 'a.x_t'", "region.mesh.path", ["stl"]),
    (
        "[region.box]\nsize = [8, 8, 8]",
        "[region.mesh]\npath = 'a.stl'\nunit = 'inches'",
        "region.mesh.unit",
        ['"inch"'],
    ),
    (
        "[region.box]\nsize = [8, 8, 8]",
        "[region.mesh]\npath = 'a.stl'\nrepair = 'fix'",
        "region.mesh.repair",
        ["auto", "refuse"],
    ),
    (
        "[region.box]\nsize = [8, 8, 8]",
        "[region.halfspace]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]",
        "region",
        ["has no end", "intersect"],
    ),
    (
        "[region.box]\nsize = [8, 8, 8]",
        "[region]\nintersection = [{ sphere = { radius = 1 } }, { sphere = { radius = 1, center = [9, 0, 0] } }]",
        "region",
        ["empty"],
    ),
    # more than there can be
    (
        "[lattice.core.level]",
        "[blend]\nbetween = ['core', 'b']\nweight = 0.5\n[lattice.core.level]",
        "blend.between[1]",
        ["b", "core"],
    ),
    ('units = "mm"', "beams.a.radius = 1", "beams.a", ["exactly one of cell with map, nodes with struts"]),
    ("fraction = 0.3", f"fraction = 0.3\n[lattice.shell]\n{SHELL}", "lattice.shell", ["blend", "between"]),
    ("fraction = 0.3", "fraction = = 0.3", "", ["TOML"]),
]


@pytest.mark.parametrize(("line", "instead", "path", "parts"), CASES, ids=[c[1].split("\n")[-1][:40] for c in CASES])
def test_bad_design(tmp_path, line, instead, path, parts):
    """The error names the file, the line, the path, and says what was found."""
    assert CUBE.count(line) == 1
    file = tmp_path / "bad.toml"
    file.write_text(CUBE.replace(line, instead))
    with pytest.raises(lt.DesignError) as caught:
        lt.load(file).build()
    error = caught.value
    assert isinstance(error, ValueError)
    assert error.path.startswith(path), error
    for part in parts:
        assert part in error.message, error
    assert error.line is not None
    first = CUBE[: CUBE.index(line)].count("\n") + 1
    last = first + instead.count("\n") + 1
    assert first <= error.line <= last or path == LEVEL, error
    assert str(error).startswith(f"{file}:{error.line}: "), error
    assert "\n" not in str(error)


def test_the_same_errors_from_python():
    """A design made in Python is refused with the same path and message, without a line."""
    core = lt.Lattice(cell="gyriod", part="sheet", map=lt.map.affine(4), level=lt.level.fraction(0.3))
    with pytest.raises(lt.DesignError) as caught:
        lt.Design(region=lt.region.box([8, 8, 8]), lattice={"core": core}).build()
    assert (caught.value.path, caught.value.nearest, caught.value.line) == ("lattice.core.cell", "gyroid", None)

    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(4), level={"fraction": object()})
    with pytest.raises(lt.DesignError, match="of type object"):
        lt.Design(region=lt.region.box([8, 8, 8]), lattice=core).build()


def test_json_has_the_same_errors(tmp_path):
    """JSON goes the same road."""
    file = tmp_path / "bad.json"
    file.write_text('{"schema": 1, "regoin": {}}')
    with pytest.raises(lt.DesignError, match="region"):
        lt.load(file)
    file.write_text('{"schema": 1,')
    with pytest.raises(lt.DesignError, match="JSON"):
        lt.load(file)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"\x00" * 64, b"solid nothing", b"[[[[", b"a = 1\nb = \xe9"])
def test_garbage(tmp_path, content):
    """Whatever the bytes, one DesignError."""
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    with pytest.raises(lt.DesignError):
        lt.load(file)


def test_errors_travel(tmp_path):
    """An error survives pickling, so that worker processes can raise it."""
    import pickle

    error = lt.DesignError("a.toml:3: x: wrong", "x", 3, "wrong", "y", "z")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.path, again.line, again.nearest) == (str(error), "x", 3, "z")


def test_keys_given_twice(tmp_path):
    """In JSON too, with the path and the line."""
    file = tmp_path / "bad.json"
    file.write_text('{"schema": 1,\n "region": {"box":\n  {"size": [8, 8, 8],\n   "size": [9, 9, 9]}}}')
    with pytest.raises(lt.DesignError, match="given twice") as caught:
        lt.load(file)
    assert (caught.value.path, caught.value.line) == ("region.box.size", 4)
    file = tmp_path / "bad.toml"
    file.write_text(CUBE.replace("size = [8, 8, 8]", "size = [8, 8, 8]\nsize = [9, 9, 9]"))
    with pytest.raises(lt.DesignError, match="duplicate") as caught:
        lt.load(file)
    assert caught.value.line == 5


def test_json_has_lines(tmp_path):
    """An error in JSON says where."""
    file = tmp_path / "bad.json"
    file.write_text('{"schema": 1,\n"region": {"box": {"size": [8, 8, 8]}},\n"lattice": {"a": {\n"cell": "gyriod"}}}')
    with pytest.raises(lt.DesignError, match='unknown cell "gyriod"; did you mean "gyroid"') as caught:
        lt.load(file)
    assert caught.value.line == 4


@pytest.mark.parametrize(
    ("word", "right"),
    [("walls", "sheet"), ("wall", "sheet"), ("shell", "sheet"), ("network", "lower"), ("struts", "lower"), ("uper", "upper")],
)
def test_what_others_call_the_parts(tmp_path, word, right):
    """The right word is named."""
    file = tmp_path / "bad.toml"
    file.write_text(CUBE.replace("sheet", word))
    with pytest.raises(lt.DesignError, match=f'unknown part "{word}"; did you mean "{right}"') as caught:
        lt.load(file)
    assert caught.value.nearest == right


@pytest.mark.parametrize("code", ["utf-16", "utf-16-be", "utf-8-sig"])
def test_other_encodings(tmp_path, code):
    """A byte order mark is passed over; UTF-16 gets a hint."""
    for name, text in (("a.toml", CUBE), ("a.json", '{"schema": 1}')):
        file = tmp_path / name
        file.write_bytes((b"\xfe\xff" if code == "utf-16-be" else b"") + text.encode(code))
        if code == "utf-8-sig" and name == "a.toml":
            lt.load(file).build()
            continue
        with pytest.raises(lt.DesignError, match='"region" is missing' if code == "utf-8-sig" else "UTF-16; save it as UTF-8"):
            lt.load(file)


def test_counts_and_numbers_are_words(tmp_path):
    """Plurals, and numbers with few digits."""
    for line, instead, part in [
        ("size = [8, 8, 8]", "size = [8]", "found 1 value"),
        ("size = [8, 8, 8]", "size = [8, 8, -1e300]", "size is -1e300 mm;"),
        ("fraction = 0.3", "porosity = -0.00000012345678901234567", "porosity is -1.23457e-7;"),
        ("[region.box]\nsize = [8, 8, 8]", "[region]\nunion = []", "at least 1 item, found 0"),
        ("wavelength = 4.0", "wavelength = 12.000000000000002", "wavelength, 12 mm, is more than"),
    ]:
        file = tmp_path / "bad.toml"
        file.write_text(CUBE.replace(line, instead))
        if "more than" in part:
            assert part in lt.load(file).build().warnings[0]["message"]
            continue
        with pytest.raises(lt.DesignError) as caught:
            lt.load(file).build()
        assert part in str(caught.value) + ";", caught.value


def test_a_graded_network_says_where_it_falls_apart(tmp_path):
    """The part of the range that is in pieces, and only where there is one."""
    text = CUBE.replace("gyroid", "primitive").replace("sheet", "lower")
    grade = "fraction = { linear = { along = [0, 0, 1], stops = [[-4, LOW], [4, 0.4]] } }"
    file = tmp_path / "a.toml"
    file.write_text(text.replace("fraction = 0.3", grade.replace("LOW", "0.1")))
    (warning,) = lt.load(file).build().warnings
    assert "the solid fraction is 0.1000 to 0.4000 over the region, and at 0.1000 to 0.2133 the" in warning["message"]
    file.write_text(text.replace("fraction = 0.3", grade.replace("LOW", "0.22")))
    assert lt.load(file).build().warnings == []
