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
from trabecula.design import parsed

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


def test_a_page_is_whole_and_asks_for_nothing_outside(mesh, tmp_path, monkeypatch):
    monkeypatch.setattr("trabecula.viewer.has_widgets", lambda: False)
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
