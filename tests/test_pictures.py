"""Pictures for papers: transparent backgrounds, sizes in mm, line drawings."""

import base64
import re
import struct
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from test_camera import read
from test_viewer import BOX, box
from trabecula.design import parsed

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def mesh():
    return box().mesh(per_cell=16)


def header(png):
    """Width, height, colour type and pixels a metre of a PNG."""
    width, height, _, colour = struct.unpack(">IIBB", png[16:26])
    at = png.find(b"pHYs")
    return width, height, colour, struct.unpack(">II", png[at + 4 : at + 12]) if at > 0 else None


def paths(svg):
    """The polylines (n, 2) of a drawing by the names of its paths; width and height as they are written."""
    root = ElementTree.fromstring(svg)
    found = {}
    for path in root.iter(f"{SVG}path"):
        lines = [re.split(r"[ L]", part.rstrip("Z")) for part in path.get("d").split("M") if part]
        found[path.get("id")] = [np.array(line, float).reshape(-1, 2) for line in lines]
    return found, root.get("width"), root.get("height"), [float(v) for v in root.get("viewBox").split()]


def test_a_picture_has_a_background_or_none_and_its_size_in_print(mesh):
    assert header(mesh.png((80, 60))) == (80, 60, 2, None)
    assert header(mesh.png((80, 60), background="transparent", dpi=600)) == (80, 60, 6, (23622, 23622))
    assert len({mesh.png((80, 60), background=name) for name in ("shaded", "white", "transparent")}) == 3
    with pytest.raises(ValueError, match="background is 'grey'; it must be one of shaded, white, transparent"):
        mesh.png(background="grey")
    with pytest.raises(ValueError, match="dpi"):
        mesh.png((80, 60), dpi=0)


def test_a_line_drawing_is_small_within_its_size_and_hatched_where_it_is_cut(mesh):
    svg = mesh.svg((850, 600), 40, 30, section="z=4", dpi=254)
    found, width, height, view = paths(svg)
    assert (width, height, view) == ("85mm", "60mm", [0, 0, 85, 60])
    assert set(found) == {"contours", "edges", "section", "hatching"}
    for lines in found.values():
        points = np.concatenate(lines)
        assert (points >= 0).all() and (points <= [85, 60]).all()
    # Hatching is within the section's outlines: as many crossings of each line with them are on either side of its middle.
    outlines = found["section"]
    for line in found["hatching"][::20]:
        x, y = line.mean(axis=0)
        crossings = 0
        for loop in outlines:
            a, b = loop, np.roll(loop, -1, axis=0)
            over = (a[:, 1] > y) != (b[:, 1] > y)
            with np.errstate(divide="ignore", invalid="ignore"):
                at = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
            crossings += (over & (at > x)).sum()
        assert crossings % 2 == 1, line
    assert len(svg) < 250_000
    assert mesh.svg((850, 600), 40, 30, section="z=4", dpi=254) == svg
    thin = mesh.svg((850, 600), 40, 30, section="z=4", dpi=254, line_width=0.1)
    widths = [[float(w) for w in re.findall(r'stroke-width="([\d.]+)"', text)] for text in (svg, thin)]
    assert max(widths[0]) == pytest.approx(85 / 340, abs=1e-3) and max(widths[1]) == 0.1
    assert np.divide(*widths) == pytest.approx(2.5, rel=0.02)
    with pytest.raises(ValueError, match="line_width"):
        mesh.svg(line_width=0)


def test_what_lies_behind_is_not_drawn():
    """A small box before a large one, and the same behind it."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    triangles = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])

    def pair(x):
        large, small = 4 * corners - [0, 2, 2], corners + np.array([x, -0.5, -0.5])
        return lt.Mesh.of(np.concatenate([large, small]), np.concatenate([triangles, triangles + 8]))

    drawn = {x: len(paths(pair(x).svg((400, 400), 0, 0))[0]["edges"]) for x in (8, -8)}
    alone = len(paths(lt.Mesh.of(4 * corners, triangles).svg((400, 400), 0, 0))[0]["edges"])
    assert drawn[8] > drawn[-8] == alone


def test_a_drawing_by_parallel_rays_has_a_bar_of_its_scale(mesh):
    low, high = (np.asarray(end) for end in mesh.bounds)
    svg = mesh.svg((800, 600), -90, 0, dpi=254, projection="orthographic", scale_bar=True, axes=True)
    root = ElementTree.fromstring(svg)
    lines = {name: np.concatenate(found) for name, found in paths(svg)[0].items() if name}
    drawn = np.concatenate([lines[name] for name in ("edges", "contours") if name in lines])
    scale = np.ptp(drawn[:, 0]) / (high - low)[0]
    # Contours are judged by samples of 80 mm / 3600.
    assert abs(np.ptp(drawn[:, 1]) - scale * (high - low)[2]) < 0.1
    (words,) = (t.text for t in root.iter(f"{SVG}text") if t.text.endswith(" mm"))
    assert abs(np.ptp(lines["scale_bar"][:, 0]) - scale * float(words.removesuffix(" mm"))) < 0.05
    assert {t.text for t in root.iter(f"{SVG}text")} == {"x", "y", "z", words}
    assert lines["scale_bar"].max() < 80 and (lines["scale_bar"][:, 1].min() > drawn[:, 1].max())


def test_a_beam_is_shaded_alike_along_itself(tmp_path):
    """By the normals of its field a cylinder is as light all along, by those of its mesh it is not."""
    (tmp_path / "n.csv").write_text("id,x,y,z\n0,-5,-2,0\n1,5,2,0\n")
    (tmp_path / "s.csv").write_text("0,1\n")
    text = 'schema = 1\nregion.box.size = [6, 6, 4]\nbeams.b = { nodes = "n.csv", struts = "s.csv", radius = 1 }\n'
    solid = parsed(text, False, "beam.toml", str(tmp_path)).build()
    mesh = solid.mesh(edge=0.3)
    # It runs oblique to the grid of the mesh, and is seen from the side.
    along, rough = np.degrees(np.arctan2(2, 5)), []
    for of in (solid, None):
        png = mesh.png((300, 200), along - 90, 0, projection="orthographic", background="white", solid=of)
        _, (rows,) = read(png)
        middle = rows[:, 90:210].astype(float)
        inside = (middle.max(axis=(1, 2)) < 250).nonzero()[0][4:-4]
        rough.append(middle[inside].std(axis=1).mean())
    assert rough[0] < rough[1] / 2


def test_colours_lie_behind_the_lines_of_a_drawing_with_their_legend(mesh):
    height = mesh.vertices[:, 2]
    given = {"color": height, "label": "height, mm", "section": "z=4", "projection": "orthographic"}
    svg = mesh.svg((425, 300), 40, 30, dpi=127, scale_bar=True, **given)
    found, width, _, view = paths(svg)
    root = ElementTree.fromstring(svg)
    (picture,) = root.iter(f"{SVG}image")
    png = base64.b64decode(picture.get("{http://www.w3.org/1999/xlink}href").removeprefix("data:image/png;base64,"))
    assert header(png)[:3] == (425, 300, 6) and float(picture.get("width")) == view[2] == 85
    # The part is where its lines are: its pixels end at the outermost of them, to a pixel and a half.
    _, (seen,) = read(png, channels=4)
    rows, columns = (seen[..., 3] > 127).nonzero()
    lines = np.concatenate([np.concatenate(found[name]) for name in ("contours", "edges", "section") if name in found])
    edge = 0.2 * np.array([[columns.min(), rows.min()], [columns.max() + 1, rows.max() + 1]])
    assert np.abs(edge - [lines.min(axis=0), lines.max(axis=0)]).max() < 0.3
    # The section is hatched in lines, and the scale says what is what.
    assert {"hatching", "scale", "scale_bar"} <= set(found)
    words = [text.text for text in root.iter(f"{SVG}text")]
    assert {"height, mm", "0", "8"} <= set(words)
    stops = [stop.get("stop-color") for stop in root.iter(f"{SVG}stop")]
    assert (stops[0], stops[-1]) == ("#440154", "#fde725") and len(set(stops)) == len(stops)
    bar = np.concatenate(found["scale"])
    assert bar[:, 1].min() > lines[:, 1].max() and (bar <= [85, 60]).all()
    names = mesh.svg((425, 300), shares={"below & above": np.ones(len(height))})
    assert "below &amp; above" in names and "<image" in names and width == "85mm"
    assert "<image" not in mesh.svg((425, 300))


def test_the_command_draws_at_a_size_in_print(mesh, tmp_path):
    (tmp_path / "box.toml").write_text(BOX)
    mesh.write(tmp_path / "box.stl")
    in_process("render", tmp_path / "box.stl", "-o", tmp_path / "a.svg", "--size", "85mm", "--section", "x=6")
    assert paths((tmp_path / "a.svg").read_text())[1:3] == ("85mm", "63.75mm")
    in_process("render", tmp_path / "box.stl", "-o", tmp_path / "a.png", "--size", "8x6mm", "--background", "transparent")
    assert header((tmp_path / "a.png").read_bytes()) == (94, 71, 6, (11811, 11811))
    in_process("render", tmp_path / "box.stl", "-o", tmp_path / "t.png", "--size", "80x60", "--show", "thickness")
    assert header((tmp_path / "t.png").read_bytes()) == (80, 60, 2, None)
    for wrong in (["--up", "0,0,1"], ["--turn", "4"], ["--background", "white"]):
        in_process("render", tmp_path / "box.stl", "-o", tmp_path / "b.svg", *wrong, status=2)
    in_process("render", tmp_path / "box.stl", "-o", tmp_path / "b.png", "--size", "900mm", "--dpi", 600, status=1)
    assert not (tmp_path / "b.svg").exists() and not (tmp_path / "b.png").exists()
    # Lines have no pixels to run out of.
    in_process("render", tmp_path / "box.stl", "-o", tmp_path / "wide.svg", "--size", "1800x900mm")
    assert paths((tmp_path / "wide.svg").read_text())[1:3] == ("1800mm", "900mm")
    for dpi in (1e300, 1e-3):
        with pytest.raises(ValueError, match=r"a drawing is 0\.1 to 1e5 mm wide"):
            mesh.svg(dpi=dpi)
    with pytest.raises(ValueError, match='section is "4"'):
        mesh.view(section=4)
    seen = mesh.view("thickness", section="z=4")
    seen.save(tmp_path / "seen.svg", size=(400, 300))
    assert "hatching" in (tmp_path / "seen.svg").read_text()
