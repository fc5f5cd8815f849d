"""Pages with the part to turn: the mesh in them, what a browser draws of it, and the report of a part."""

import base64
import json
import os
import re
import shutil
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from hypothesis import given
from hypothesis import strategies as st
from trabecula.design import parsed
from trabecula.pictures.nearest_vertex import OTHER_SIDE, _normals, nearest_vertices

BOX = """schema = 1
region.box = { min = [0, 0, 0], max = [12, 10, 8] }
lattice.a = { cell = "gyroid", part = "sheet", map.affine.wavelength = 6, level.fraction = 0.3 }
"""
#: Elements of HTML without an end tag.
VOID = {"input", "img", "meta", "br"}


def box():
    return parsed(BOX, False, "box.toml", ".").build()


@pytest.fixture(scope="module")
def mesh():
    return box().mesh(per_cell=16)


class Balance(HTMLParser):
    """Elements that are open, and all that a page asks for outside itself."""

    def __init__(self):
        super().__init__()
        self.open, self.outside = [], []

    def handle_starttag(self, tag, attributes):
        self.outside += [v for k, v in attributes if k in ("src", "href") and not v.startswith("data:")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def unpacked(text):
    raw = zlib.decompress(base64.b64decode(text))
    head, data = raw.split(b"\n", 1)
    head = json.loads(head)
    places = np.frombuffer(data, "<u2", 3 * head["vertices"]).reshape(-1, 3)
    triangles = np.frombuffer(data, "<u4", 3 * head["triangles"], places.nbytes).reshape(-1, 3)
    rest = data[places.nbytes + triangles.nbytes :]
    low, high = np.array(head["min"]), np.array(head["max"])
    return head, low + places / 65535 * (high - low), triangles, rest


def test_the_page_has_the_mesh_to_half_a_step_of_16_bits(mesh):
    head, vertices, triangles, rest = unpacked(mesh.view().packed)
    assert (head["vertices"], head["triangles"]) == mesh.counts and head["span"] is None
    assert np.array_equal(triangles, mesh.triangles)
    extent = np.subtract(*mesh.bounds[::-1])
    assert (np.abs(vertices - mesh.vertices) <= extent / 65535 / 2 * (1 + 1e-9)).all()
    assert np.array_equal(np.frombuffer(rest, "u1"), mesh.cut)


def test_values_come_with_their_span(mesh):
    z = mesh.vertices[:, 2]
    head, _, _, rest = unpacked(mesh.view(z, "height, mm").packed)
    found = np.frombuffer(rest[head["triangles"] :], "<u2") / 65535 * (head["span"][1] - head["span"][0]) + head["span"][0]
    assert head["span"] == [z.min(), z.max()] and np.abs(found - z).max() <= np.ptp(z) / 65535 / 2 * (1 + 1e-9)
    with pytest.raises(ValueError, match=r"values must be .* numbers, one for each vertex"):
        mesh.view([1.0, 2.0])


def test_a_large_mesh_is_shown_lighter_and_a_broken_one_as_it_is():
    fine = box().mesh(per_cell=60)
    assert fine.counts[1] > 150_000
    light = fine.view()._light
    assert light.counts[1] <= 150_000 and light.closed and abs(light.volume / fine.volume - 1) < 1e-3
    torn = lt.Mesh.of(fine.vertices, fine.triangles[1:])
    assert torn.view()._light is torn
    # Values of one's own come along, from the nearest vertices on the same side of the wall.
    seen = fine.view(np.where(fine.vertices[:, 0] > 6, np.nan, fine.vertices[:, 1]), "y, mm")
    x, y, _ = seen._light.vertices.T
    assert seen._light.counts == light.counts and unpacked(seen.packed)[0]["triangles"] <= 150_000
    spacing = 6 / 60
    known = np.isfinite(seen.values)
    assert np.array_equal(known, x <= 6) or np.abs(x[known != (x <= 6)] - 6).max() < spacing
    assert np.abs(seen.values - y)[known].max() < spacing


def test_values_come_from_the_same_side_of_a_thin_wall():
    """A plate of 0.2 mm, its faces in squares of 1 mm, moved against each other: amid a square the other face is nearer."""
    n = 12
    plate, light = lt.Mesh.of(*grid(n, 0.2, 0.5)), lt.Mesh.of(*grid(n, 0.2))
    fine = nearest_vertices(plate, light)
    inner = light.vertices[:, 0] > 0.4
    bare = ((plate.vertices - light.vertices[:, None]) ** 2).sum(axis=2).argmin(axis=1)
    upper = plate.vertices[:, 2] > 0.1
    assert np.array_equal(upper[fine], np.repeat([False, True], (n + 1) ** 2)) and not upper[bare[inner]].any()


@given(st.integers(0, 2**32 - 1), st.floats(0.01, 100))
def test_the_nearest_vertex_is_the_nearest_of_all(seed, far):
    """Of any two meshes, also where one lies apart from the other."""
    random = np.random.default_rng(seed)
    meshes = [
        lt.Mesh.of(random.normal(size=(n, 3)) + shift, random.integers(0, n, (60, 3))) for n, shift in ((40, 0), (25, far))
    ]
    (ours, normals), (theirs, facing) = ((mesh.vertices, _normals(mesh)) for mesh in meshes)
    squared = ((ours - theirs[:, None]) ** 2).sum(axis=2) * np.where(facing @ normals.T < 0, OTHER_SIDE**2, 1)
    found = nearest_vertices(*meshes)
    assert np.allclose(squared[np.arange(25), found], squared.min(axis=1), rtol=1e-12)


def grid(n, thick, shift=0.0):
    """The two faces of a plate in squares of 1 mm, as vertices and triangles."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0)))
    faces = [np.stack([x + shift * side, y, np.full(len(x), thick * side)], axis=1) for side in (0, 1)]
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (v.ravel() for v in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    up = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.concatenate(faces), np.concatenate([up[:, ::-1], up + (n + 1) ** 2])


def test_a_section_outside_of_the_part_is_refused_by_a_view(mesh):
    """By all doors as by that of pictures; a plane at an end is where a user may move it."""
    seen = mesh.view()
    for section, words in (("z=300", "cuts nothing off"), ("z<-1", "leaves nothing"), ("x>13", "leaves nothing")):
        with pytest.raises(ValueError, match=f'section "{section}" {words}: the mesh lies from 0 to'):
            mesh.view(section=section)
        with pytest.raises(ValueError, match=words):
            seen.section = section
    for section in ("z<8", "z<0", "x>12", "y=10"):
        seen.section = section
    far = mesh.moved([1234.5678, 0, 0])
    for x in (far.bounds[0][0], far.bounds[1][0]):
        far.view(section=f"x<{x:.7g}")  # as the viewer rounds it


def test_vertices_without_a_value_are_marked_in_the_page(mesh):
    x = mesh.vertices[:, 0]
    for hole in (np.nan, np.inf):
        seen = mesh.view(np.where(x > 6, hole, x), "x, mm")
        head, _, _, rest = unpacked(seen.packed)
        n = head["triangles"], head["triangles"] + 2 * head["vertices"]
        assert head["missing"] and np.array_equal(np.frombuffer(rest[n[1] :], "u1"), x > 6)
        found = np.frombuffer(rest[n[0] : n[1]], "<u2") / 65535 * (head["span"][1] - head["span"][0]) + head["span"][0]
        assert np.abs(found - x)[x <= 6].max() < 1e-4 and "(grey: no value)" in seen.figure()


def test_a_page_is_whole_and_asks_for_nothing_outside(mesh, tmp_path, monkeypatch):
    monkeypatch.setattr("trabecula.pictures.viewer.has_widgets", lambda: False)
    mesh.view().save(tmp_path / "part.html", title='<"A & B">')
    text = (tmp_path / "part.html").read_text()
    page = Balance()
    page.feed(text)
    assert page.open == [] and page.outside == []
    assert "<title>&lt;&quot;A &amp; B&quot;&gt;</title>" in text
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", text)
    notebook = mesh.view()._repr_html_()
    assert notebook.startswith('<iframe srcdoc="&lt;!doctype html') and 'sandbox="allow-scripts"' in notebook
    with pytest.raises(ValueError, match=r"must end in \.html"):
        mesh.view().save(tmp_path / "part.htm")


def test_the_command_reports_what_measure_says(tmp_path):
    (tmp_path / "box.toml").write_text(BOX + '# </pre><script>alert("x")</script>\n')
    in_process("report", tmp_path / "box.toml", "-o", tmp_path / "box.html", "--per-cell", 16, "--title", "A box")
    text = (tmp_path / "box.html").read_text()
    page = Balance()
    page.feed(text)
    assert page.open == [] and page.outside == [] and "<h1>A box</h1>" in text
    figures = json.loads(in_process("measure", tmp_path / "box.toml", "--per-cell", 16, "--json"))
    for key in ("volume", "area", "hydraulic_diameter"):
        assert f"{figures[key]:.6g}" in text, key
    assert text.count('<li class="good">') == 5 and "<h2>Walls and pores</h2>" in text
    # What a design says cannot become a part of the page.
    assert "&lt;/pre&gt;&lt;script&gt;" in text and "alert(&quot;" in text
    with pytest.raises(SystemExit):
        in_process("report", tmp_path / "box.toml", "-o", tmp_path / "box.toml")


def test_a_part_that_is_not_sound_is_said_to_be_so(tmp_path):
    # Below a fraction of 0.2 the primitive cell's network is separate drops.
    gap = BOX.replace('"gyroid", part = "sheet"', '"primitive", part = "lower"').replace("0.3", "0.1")
    (tmp_path / "thin.toml").write_text(gap)
    in_process("report", tmp_path / "thin.toml", "-o", tmp_path / "thin.html", "--per-cell", 16, "--no-thickness")
    text = (tmp_path / "thin.html").read_text()
    pieces = json.loads(in_process("measure", tmp_path / "thin.toml", "--per-cell", 16, "--json"))["pieces"]
    assert pieces > 1 and f'<li class="bad">{pieces} pieces' in text
    assert "<h2>Walls and pores</h2>" not in text


def chromium():
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def test_a_browser_draws_the_part_and_its_section(mesh, tmp_path):
    """The section halfway up is seen from above: as much of the picture has the colour of cuts as the section has area."""
    sync = pytest.importorskip("playwright.sync_api")
    if chromium() is None:
        pytest.skip("no Chromium")
    mesh.view().save(tmp_path / "part.html")
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 800, "height": 700})
        wrong = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto((tmp_path / "part.html").as_uri())
        page.wait_for_selector("figure.viewer.live", timeout=30_000)
        assert page.eval_on_selector("figure.viewer", "f => +f.dataset.drawn") == mesh.counts[1]
        page.focus("canvas")
        for _ in range(7):
            page.keyboard.press("ArrowUp")
        page.select_option("[name=axis]", "z")
        page.wait_for_timeout(300)
        count = """() => { const c = document.querySelector("canvas"), gl = c.getContext("webgl2");
            const p = new Uint8Array(4 * c.width * c.height);
            gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
            let n = 0;
            for (let i = 0; i < p.length; i += 4) if (p[i] > 1.6 * p[i + 1] && p[i + 3] > 250) n++;
            return [n, Math.min(c.clientWidth, c.clientHeight)]; }"""
        pixels, side = page.evaluate(count)
        assert page.inner_text("[data-part=at]") == "z = 4.000 mm" and not wrong
        browser.close()
    # The side of the picture is the diagonal of the bounds.
    mm = np.linalg.norm(np.subtract(*mesh.bounds)) / side
    area = box().layers(layer=8.0)[0].area
    edge = 4 * np.sqrt(area * 30)  # about as long as the contours are; they are drawn to half a pixel
    assert abs(pixels * mm**2 - area) < 0.5 * mm * edge
    assert os.path.getsize(tmp_path / "part.html") < 3e6


def test_a_browser_draws_what_has_no_value_in_the_grey_of_pictures(tmp_path):
    """A plate from above, half of it without values: in the page as in the picture it is of no colour."""
    sync = pytest.importorskip("playwright.sync_api")
    if chromium() is None:
        pytest.skip("no Chromium")
    plate = lt.Mesh.of(*grid(12, 0.2))
    x = plate.vertices[:, 0]
    for hole in (np.nan, np.inf):
        seen = plate.view(np.where(x > 6, hole, x), "x, mm", elevation=90, azimuth=-90)
        seen.save(tmp_path / "part.html")
        with sync.sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 800, "height": 700})
            page.goto((tmp_path / "part.html").as_uri())
            page.wait_for_selector("figure.viewer.live", timeout=30_000)
            page.wait_for_timeout(300)
            grey, coloured = page.evaluate("""() => { const c = document.querySelector("canvas"), gl = c.getContext("webgl2");
                const p = new Uint8Array(4 * c.width * c.height), n = [0, 0];
                gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
                for (let i = 0; i < p.length; i += 4) if (p[i + 3] > 250)
                    n[Math.max(p[i], p[i + 1], p[i + 2]) - Math.min(p[i], p[i + 1], p[i + 2]) > 3 ? 1 : 0]++;
                return n; }""")
            browser.close()
        # The squares between x = 6 and 7 have corners without a value.
        assert grey > 10_000 and abs(grey / (grey + coloured) - 0.5) < 0.02
