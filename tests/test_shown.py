"""What pictures show beside the form: axes and singular lines of solved maps, the lattices of a blend."""

import zlib

import hypothesis
import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from hypothesis import strategies as st
from test_viewer import unpacked
from trabecula.command.drawing import resolution
from trabecula.command.parser import parser
from trabecula.pictures.camera import towards
from trabecula.pictures.drawn import _paper
from trabecula.pictures.shown import SHOWN, look
from trabecula.pictures.trajectories import trajectories

EYE = (30, 40)
BOX_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
BOX_FACES = np.concatenate([BOX_FACES[:, [0, 1, 2]], BOX_FACES[:, [0, 2, 3]]])


def solid(map=None, region=None, **more):
    core = lt.Lattice(cell="gyroid", part="sheet", map=map or lt.map.affine(wavelength=4), level=lt.level.fraction(0.3))
    region = region or lt.region.box(min=[0, 0, 0], max=[12, 10, 8])
    return lt.Design(region=region, lattice={"core": core, **more.pop("lattice", {})}, **more).build()


def half_disclination():
    """The stress x, -x, y of a half disclination at (5.3, 4.6), along z."""
    stress = [lt.grade.formula(f) for f in ("x - 5.3", "5.3 - x", "-20", "0", "0", "y - 4.6")]
    with pytest.warns(lt.DesignWarning):
        return solid(lt.map.phase(wavelength=3, stress=stress, folds=True))


def blended():
    rim = lt.Lattice(cell="primitive", part="upper", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.3))
    ramp = lt.grade.formula("(x - 3)/6")
    return solid(lattice={"rim": rim}, blend=lt.blend.between("core", "rim", ramp))


def pixels(png):
    """The colours (rows, columns, 3) of a PNG of 8 bits, RGB."""
    at, packed = 8, b""
    while at < len(png):
        size, kind = int.from_bytes(png[at : at + 4], "big"), png[at + 4 : at + 8]
        if kind == b"IHDR":
            wide, high = (int.from_bytes(png[at + 8 + i : at + 12 + i], "big") for i in (0, 4))
        packed += png[at + 8 : at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(high, 1 + 3 * wide)
    made = np.zeros((high + 1, wide + 1, 3), int)
    for y, (kind, *row) in enumerate(rows.tolist(), 1):
        given = np.reshape(row, (wide, 3))
        for x in range(1, wide + 1):
            left, above, corner = made[y, x - 1], made[y - 1, x], made[y - 1, x - 1]
            guess = left + above - corner
            off = np.abs([guess - left, guess - above, guess - corner])
            nearest = np.where((off[0] <= off[1]) & (off[0] <= off[2]), left, np.where(off[1] <= off[2], above, corner))
            base = (0, left, above, (left + above) // 2, nearest)[kind]
            made[y, x] = (given[x - 1] + base) % 256
    return made[1:, 1:]


def shown(solid, name, per_cell=8, angles=EYE):
    """The arguments that show a thing, and the mesh."""
    mesh = solid.mesh(per_cell=per_cell, islands="keep")
    return look(solid, name)(mesh, towards(*angles)), mesh


def test_a_singular_line_is_drawn_where_it_is(tmp_path):
    part = half_disclination()
    (line,) = part.report().lattices["core"].singular
    assert line.turn == 180 and line.length == pytest.approx(8, abs=1e-9)
    given, mesh = shown(part, "singularities")
    assert list(given["lines"]) == ["axes turned by 180°"] and given["label"] == "1 singular line, 8.0 mm"
    (drawn,) = given["lines"]["axes turned by 180°"]
    # To a step of the map's grid, a quarter of the wavelength.
    assert np.abs(drawn[:, :2] - [5.3, 4.6]).max() < 0.75
    assert sorted(drawn[[0, -1], 2]) == pytest.approx([0, 8])

    # The picture differs from one without it, red against pale, in one place: where a line of our own at that place is.
    draw = {"size": (240, 200), "azimuth": EYE[0], "elevation": EYE[1]}
    bare = pixels(mesh.png(**draw, lines={}))[:140]
    seen = pixels(mesh.png(**draw, **given | {"label": ""} | {"lines": {"": given["lines"]["axes turned by 180°"]}}))
    bare_there = pixels(mesh.png(**draw, lines={"": [[[5.3, 4.6, 0], [5.3, 4.6, 8]]]}, width=given["width"]))
    red = [(p[:140, :, 0] - p[:140, :, 1] > 40) for p in (seen, bare_there)]
    assert red[0].sum() > 30 and not (bare[:, :, 0] - bare[:, :, 1] > 40).any()
    # Within that step, a few pixels.
    middles = [np.argwhere(r).mean(axis=0) for r in red]
    assert np.abs(middles[0] - middles[1]).max() < 0.75 * 240 / 12

    part.render(tmp_path / "seen.png", (120, 90), show="singularities", per_cell=8)
    assert (tmp_path / "seen.png").read_bytes().startswith(b"\x89PNG")


def test_without_a_singular_line_the_picture_says_so():
    straight = solid(lt.map.phase(wavelength=3, rotate_z=30))
    assert straight.report().lattices["core"].singular == []
    given, _ = shown(straight, "singularities")
    assert given["lines"] == {} and given["label"] == "no singular lines"
    assert solid().report().lattices["core"].singular is None


@pytest.mark.parametrize("angles", [EYE, (0, 90), (200, -35)])
def test_axes_are_those_asked_for_on_the_side_that_is_seen(angles):
    ball = lt.region.sphere(center=[1, 2, 3], radius=6)
    part = solid(lt.map.phase(wavelength=[3, 4, 5], rotate_z=30), ball)
    given, _ = shown(part, "axes", angles=angles)
    bars = {name: np.array(of) for name, of in given["lines"].items()}
    assert list(bars) == ["x", "y", "z"]
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    for name, axis in zip("xyz", ([c, s, 0], [-s, c, 0], [0, 0, 1]), strict=True):
        way = bars[name][:, 1] - bars[name][:, 0]
        length = np.linalg.norm(way, axis=1)
        assert np.allclose(length, length[0]) and np.allclose(way / length[:, None], axis)
    places = bars["x"].mean(axis=1)
    out = (places - [1, 2, 3]) / 6
    eye = np.array(towards(*angles))
    # On the ball, to the tolerance of sphere tracing, and turned to the eye.
    assert np.allclose(np.linalg.norm(out, axis=1), 1, atol=1e-3) and (out @ eye > -1e-3).all()
    # A regular grid in the picture: it fills a disc of this area.
    across = places - np.outer(places @ eye, eye)
    near = np.linalg.norm(across[:, None] - across[None], axis=2) + 1e9 * np.eye(len(places))
    step = near.min()
    assert np.allclose(near.min(axis=1), step, rtol=1e-2)
    assert len(places) * step**2 == pytest.approx(np.pi * 36, rel=0.1)


def test_trajectories_of_hoops_and_spokes_are_circles_and_rays():
    """On a ring, axes whose signs and order are arbitrary: hoops, spokes, the normal."""
    rng = np.random.default_rng(3)

    def axes(points):
        angle = np.arctan2(points[:, 1], points[:, 0])
        c, s, zero = np.cos(angle), np.sin(angle), np.zeros(len(angle))
        rows = np.stack([np.stack(r, axis=1) for r in ((-s, c, zero), (c, s, zero), (zero, zero, zero + 1))], axis=1)
        # In order where lines begin, so that they are of two kinds.
        swap = (rng.random(len(points)) < 0.5) & (points[:, 0] % 0.5 != 0.25)
        rows[swap] = rows[swap][:, [1, 0, 2]]
        return rows * rng.choice([-1.0, 1.0], (len(points), 3, 1))

    def distance(points):
        off = np.stack([np.hypot(points[:, 0], points[:, 1]) - 10, 2 - np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
        return off.max(axis=0)

    x, y = (v.ravel() for v in np.meshgrid(*[np.arange(-9.75, 10, 0.5)] * 2))
    places = np.stack([x, y, 0 * x], axis=1)[(np.hypot(x, y) < 9.9) & (np.hypot(x, y) > 2.1)]
    lines = [line for some in trajectories(places, 1.0, axes, distance, [0, 0, 1]) for line in some]
    hoops, spokes = 0, []
    for line in lines:
        assert np.abs(line[:, 2]).max() < 1e-9
        radius, angle = np.hypot(line[:, 0], line[:, 1]), np.unwrap(np.arctan2(line[:, 1], line[:, 0]))
        if np.ptp(angle) > 1e-6:
            # Midpoint steps h = 1/4 at a radius r of 2 or more: r (h/r)^4 / 8 off in each, r/h steps a radian.
            assert np.ptp(radius) < 2 * np.pi * 8 * (1 / 8) ** 4 / 8 * 2
            hoops += 1
        else:
            spokes.append(np.ptp(radius))
    assert hoops > 10 and len(spokes) > 10
    # The longest rays go from edge to edge, to a step.
    assert max(spokes) > 8 - 2 * 0.25
    # Lines of a kind do not come nearer than half a distance: neighbouring cells of that size are free.
    for kind in trajectories(places, 1.0, lambda p: np.broadcast_to(np.eye(3), (len(p), 3, 3)), distance, [0, 0, 1]):
        for i, one in enumerate(kind):
            for other in kind[:i]:
                assert np.linalg.norm(one[:, None] - other[None], axis=2).min() > 0.5
    assert trajectories(places, 1.0, axes, distance, [0, 0, -1]) == [[], [], []]


def test_trajectories_lie_on_the_surface_that_is_seen():
    ball = lt.region.sphere(center=[1, 2, 3], radius=6)
    part = solid(lt.map.phase(wavelength=[3, 4, 5], rotate_z=30), ball)
    given, _ = shown(part, "trajectories")
    assert list(given["lines"]) == ["x", "y", "z"] and all(len(some) > 5 for some in given["lines"].values())
    for line in (line for some in given["lines"].values() for line in some):
        out = (line - [1, 2, 3]) / 6
        assert np.allclose(np.linalg.norm(out, axis=1), 1, atol=1e-3) and (out @ towards(*EYE) > -0.05).all()


def test_directions_asked_for_are_rows_of_the_target():
    part = solid(lt.map.phase(wavelength=[3, 4, 5], rotate_z=lt.grade.formula("3*x")))
    points = np.random.default_rng(5).uniform(1, 7, (50, 3))
    asked = part.map_asked(points)
    angle = np.radians(3 * points[:, 0])
    zero = np.zeros(50)
    rows = [[np.cos(angle), np.sin(angle), zero], [-np.sin(angle), np.cos(angle), zero], [zero, zero, zero + 1]]
    for i, (row, edge) in enumerate(zip(rows, (3, 4, 5), strict=True)):
        assert np.allclose(asked[:, i], np.stack(row, axis=1) / edge, atol=1e-12)


def test_lattices_of_a_blend_have_their_colours():
    part = blended()
    given, mesh = shown(part, "lattice")
    ramp = np.clip((mesh.vertices[:, 0] - 3) / 6, 0, 1)
    assert list(given["shares"]) == ["core", "rim"]
    # Shares up to a millionth become 0.
    assert np.allclose(given["shares"]["rim"], ramp, atol=1e-5)
    assert np.allclose(sum(given["shares"].values()), 1)
    # Seen along -y, x runs from left to right: blue on one side, orange on the other, and in between neither.
    picture = pixels(mesh.png((240, 200), azimuth=270, elevation=0, **given))[:140]
    blue, orange = picture[:, :, 2] - picture[:, :, 0] > 60, picture[:, :, 0] - picture[:, :, 2] > 60
    columns = [np.flatnonzero(c.any(axis=0)) for c in (blue, orange)]
    assert blue.sum() > 500 and orange.sum() > 500 and columns[0].max() < columns[1].min()
    # One lattice alone is of one colour.
    alone = {"core": np.ones(len(ramp)), "rim": np.zeros(len(ramp))}
    picture = pixels(mesh.png((240, 200), shares=alone))[:140]
    assert not (picture[:, :, 0] - picture[:, :, 2] > 10).any()


def graded(**more):
    """A gyroid whose fraction rises along x, from 0.2 to 0.5."""
    level = lt.level.fraction(lt.grade.linear(along=[1, 0, 0], stops=[[0, 0.2], [12, 0.5]]))
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(**{"wavelength": 4} | more), level=level)
    return lt.Design(region=lt.region.box(min=[0, 0, 0], max=[12, 10, 8]), lattice=core).build()


def test_a_fraction_is_a_colour_on_the_surface_and_in_a_section():
    part = graded()
    given, mesh = shown(part, "fraction")
    assert given["label"] == "solid fraction of the cell"
    assert np.allclose(given["color"](mesh.vertices), 0.2 + 0.025 * mesh.vertices[:, 0], atol=1e-6)
    draw = {"size": (160, 130), "azimuth": -90, "elevation": 90, "section": "z=4", "projection": "orthographic"}
    seen = pixels(mesh.png(**draw, **given, span=(0.2, 0.5)))
    # Seen from above with x to the right, 92 % of the width: what is cut has the colour of the fraction in its column.
    for share in (0.25, 0.5, 0.75):
        column = round(80 + 0.92 * 160 * (share - 0.5))
        here = 0.2 + 0.3 * share
        alone = pixels(mesh.png(**draw, color=lambda points, here=here: np.full(len(points), here), span=(0.2, 0.5)))
        bare = pixels(mesh.png(**draw, color=np.full(len(mesh.vertices), here), span=(0.2, 0.5)))
        cut = (np.abs(alone[:, column] - bare[:, column]).max(axis=1) > 40).nonzero()[0]
        assert len(cut) > 10
        assert np.abs(seen[cut, column] - alone[cut, column]).max() <= 8


@pytest.mark.parametrize("show", ["fraction", "overhang", "thickness"])
def test_a_picture_that_turns_has_the_colours_too(tmp_path, show):
    design = tmp_path / "a.toml"
    design.write_text(graded()._core.design)
    words = ("render", design, "-o", tmp_path / "a.png", "--show", show, "--size", "120x90", "--per-cell", 6)
    in_process(*words)
    still = (tmp_path / "a.png").stat().st_size
    in_process(*words, "--turn", 2)
    assert (tmp_path / "a.png").stat().st_size > 1.5 * still


def test_stiffness_is_by_the_law_of_the_cell():
    part = graded()
    with pytest.warns(lt.DesignWarning, match=r"core: stiffness at a fraction of 0\.2: .* n = \d+ of `law`, a picture has 48$"):
        given, mesh = shown(part, "stiffness", per_cell=4)
    known = lt.law("gyroid", "sheet", 0.2, 0.5, 4, properties=["stiffness"])
    at = np.clip(0.2 + 0.025 * mesh.vertices[:, 0], 0.2, 0.5)
    # Both are cubics through points of the law: 8 and 4 of them.
    assert np.allclose(given["color"](mesh.vertices), known.at("E", at), rtol=0.02)
    words, error = given["label"].split(" (error ")
    assert words == "E along the cell's axes over the solid's"
    # That of the worst of the fractions, of which both laws have the ends.
    assert 100 * known.columns["E_error"][[0, -1]].max() <= float(error.removesuffix(" %)")) * 1.01 < 10
    even = solid()
    constant, mesh = shown(even, "stiffness", per_cell=4)
    assert np.ptp(constant["color"](mesh.vertices)) < 1e-9
    for wrong, words in (
        (graded(wavelength=[4, 4, 5]), "edges differ by up to 25%"),
        (graded(skew={"xz": 20}), "the cells of lattice.core are none"),
        (blended(), "that of one lattice; the design has core, rim"),
    ):
        with pytest.raises(ValueError, match=words):
            look(wrong, "stiffness")
    beams = lt.Design(
        region=lt.region.box(size=[8, 8, 8]), beams=lt.Beams("octet", lt.map.affine(wavelength=4), radius=0.4)
    ).build()
    for name in ("fraction", "stiffness"):
        with pytest.raises(ValueError, match="the design has no lattice"):
            look(beams, name)


def test_overhang_is_told_by_the_build_direction(tmp_path):
    """A box from below: its lower face hangs over, by 0 degrees to the layers; no other face faces down."""
    box = lt.Mesh.of([[x, y, z] for z in (0, 2) for y in (0, 3) for x in (0, 4)], BOX_FACES)
    draw = {"size": (160, 130), "azimuth": 30, "elevation": -40, "background": "white"}
    grey = pixels(box.png(**draw, color=np.full(8, np.nan), span=(0, 90)))
    for up, count in (((0, 0, 1), 1), ((0, 0, 5), 1), ((0, 0, -1), 0), ((-1, 0, 0), 1), ((0, 1, -1e-9), 0)):
        seen = pixels(box.png(**draw, color="overhang", up=up))
        lower = (np.abs(seen - grey).max(axis=2) > 30) & (seen[:, :, 1] < 90)
        assert (lower.sum() > 500) == bool(count), up
    for up, words in (((0, 0, 0), "it must be a direction"), ((0, 1), "three numbers"), ("z", "three numbers")):
        with pytest.raises(ValueError, match=words):
            box.png((60, 50), color="overhang", up=up)
    box.write(tmp_path / "box.stl")
    command = ("render", tmp_path / "box.stl", "-o", tmp_path / "a.png", "--size", "200x160", "--elevation", -40)
    in_process(*command, "--show", "overhang")
    assert (tmp_path / "a.png").read_bytes() == lt.Mesh.read(tmp_path / "box.stl").png((200, 160), 30, -40, color="overhang")
    in_process(*command, "--show", "overhang", "--up", "0,0,-1")
    assert (tmp_path / "a.png").read_bytes() != lt.Mesh.read(tmp_path / "box.stl").png((200, 160), 30, -40, color="overhang")
    in_process(*command, "--up", "0,0,1", status=2)
    for wrong in ("0,0,0", "1,2", "z"):
        with pytest.raises(SystemExit):
            in_process(*command, "--show", "overhang", "--up", wrong)
    in_process(*command, "--show", "fraction", status=2)


@pytest.mark.parametrize(
    ("value", "ends"), [(0.3, (0, 0.6)), (-2.0, (-4, 0)), (0.0, (0, 1)), (5e-324, (0, 1e-323)), (7e12, (0, 1.4e13))]
)
def test_one_value_is_in_the_middle_of_its_scale_in_pictures_and_pages(value, ends):
    mesh = lt.Mesh.of([[x, y, z] for z in (0, 2) for y in (0, 3) for x in (0, 4)], BOX_FACES)
    values = np.full(8, value)
    assert mesh._tint(values, "", None, (0, 0, 1))[2] == mesh.view(values)._span == ends
    assert f"{ends[0]:.4g}<i></i>{ends[1]:.4g}" in mesh.view(values).figure()
    head = unpacked(mesh.view(values).packed)[0]
    assert tuple(head["span"]) == ends and not head["missing"]
    # A constant to rounding is one value.
    if value:
        assert np.allclose(mesh.view(values * (1 + 1e-13 * np.arange(8)))._span, ends, rtol=1e-9, atol=0)


def test_a_keyword_that_is_none_is_refused_by_the_name_that_was_called(tmp_path):
    part = solid()
    mesh = part.mesh(edge=1, islands="keep")
    for thing, name in ((mesh, "render"), (part, "render"), (mesh, "png"), (mesh, "svg")):
        file = (tmp_path / "a.png",) if name == "render" else ()
        with pytest.raises(TypeError, match=rf"^{name} has no argument view\. It takes .*size, azimuth, .*projection"):
            getattr(thing, name)(*file, view="up")
        with pytest.raises(TypeError, match=rf"^{name} has no argument sections; did you mean section\?"):
            getattr(thing, name)(*file, sections="z=1")


@hypothesis.given(st.integers(10, 30000), st.integers(10, 30000), st.sampled_from([None, 96, 300, 1200.0]))
def test_a_drawing_has_the_size_on_paper_that_is_asked_for(wide, high, dpi):
    """In hundredths of a mm, which no whole number of pixels may be."""
    size = f"{wide / 100:g}x{high / 100:g}mm"
    args = parser().parse_args(["render", "a.stl", "-o", "a.svg", "--size", size, *(["--dpi", str(dpi)] if dpi else [])])
    assert _paper(*resolution(args)) == ([wide / 100, high / 100], "mm")


def test_what_has_no_value_is_grey_and_the_scale_says_so():
    mesh = lt.Mesh.of([[x, y, z] for z in (0, 2) for y in (0, 3) for x in (0, 4)], BOX_FACES)
    values = np.arange(8.0)
    for hole in (np.nan, np.inf, -np.inf):
        some = np.where(values == 6, hole, values)
        assert mesh._tint(some, "T, K", None, (0, 0, 1))[::2] == ("T, K (grey: no value)", (0.0, 7.0))
        assert mesh._tint(some, "", None, (0, 0, 1))[0] == "grey: no value"
        none = np.full(8, hole)
        for wrong in (lambda none=none: mesh.png((60, 50), color=none), lambda none=none: mesh.view(none)):
            with pytest.raises(ValueError, match="has no finite number, so there is nothing to show"):
                wrong()
        with pytest.raises(ValueError, match="values has no finite number"):
            _ = mesh.view(lambda points, hole=hole: np.full(len(points), hole)).packed
        with pytest.warns(lt.DesignWarning, match="too small"):
            assert mesh.png((60, 50), color=none, span=(0, 1))  # the scale is given
    assert mesh._tint(values, "T, K", None, (0, 0, 1))[0] == "T, K"


def test_a_view_of_a_solid_is_saved_as_it_is_rendered(tmp_path):
    part = graded()
    mesh = part.mesh(per_cell=8)
    view = lt.view(part, "fraction", per_cell=8, section="z=4")
    assert view.label == "solid fraction of the cell" and view.color == "values"
    assert np.allclose(view.values, 0.2 + 0.025 * view._light.vertices[:, 0], atol=1e-6)
    given = look(part, "fraction")(mesh, (0, 0, 1))
    view.save(tmp_path / "a.png", size=(200, 160))
    assert (tmp_path / "a.png").read_bytes() == mesh.png((200, 160), section="z=4", solid=part, **given)
    view.color, view.overhang = "overhang", 60
    view.save(tmp_path / "a.png", size=(200, 160))
    wanted = mesh.png((200, 160), section="z=4", solid=part, color="overhang", span=(0, 60))
    assert (tmp_path / "a.png").read_bytes() == wanted != mesh.png((200, 160), section="z=4", color="overhang", span=(0, 60))
    view.save(tmp_path / "a.svg", size=(200, 160))
    assert "overhang, degrees" in (tmp_path / "a.svg").read_text()
    with pytest.raises(ValueError, match="no number at points"):
        lt.view(blended(), "lattice", per_cell=4)
    height = mesh.view(lambda points: points[:, 2], "height, mm")
    assert np.array_equal(height.values, height._light.vertices[:, 2])


def test_what_there_is_not_is_refused():
    plain = solid()
    for name in set(SHOWN) - {"thickness", "overhang", "fraction", "stiffness"}:  # every lattice has these
        with pytest.raises(ValueError, match="no blend" if name == "lattice" else "solved for"):
            look(plain, name)
    with pytest.raises(ValueError, match=f"one of {', '.join(SHOWN)}"):
        look(plain, "stress")
    mesh = plain.mesh(edge=1)
    n = len(mesh.vertices)
    for given, error in (
        ({"color": np.zeros(n), "shares": {"a": np.zeros(n)}}, "not both"),
        ({"shares": {}}, "no names"),
        ({"shares": {"a": [1.0]}}, "one for each vertex"),
        ({"lines": {"a": [[0, 0, 1]]}}, r"lines\['a'\] must be arrays"),
        ({"lines": {"a": [[[0, 0, np.nan]]]}}, "finite"),
        ({"lines": {"a": []}, "width": 0}, "width"),
    ):
        with pytest.raises(ValueError, match=error):
            mesh.png((60, 50), **given)
