"""The widget of notebooks: its state in Python, in a browser, and what is shown where there is none."""

import sys

import numpy as np
import pytest
import trabecula as lt
from test_viewer import box, chromium
from trabecula.design import parsed
from trabecula.pictures.viewer import NAMES

anywidget = pytest.importorskip("anywidget")


@pytest.fixture(scope="module")
def mesh():
    return box().mesh(per_cell=16)


def test_a_view_and_its_widget_are_of_one_mind(mesh):
    seen = lt.view(mesh, section="z=4", color="overhang")
    assert seen.section == "z<4" and seen.widget.section == "z<4" and seen.widget.color == "overhang"
    seen.section, seen.azimuth = "x>2.5", 100
    assert (seen.widget.section, seen.widget.azimuth) == ("x>2.5", 100)
    heard = []
    seen.widget.observe(lambda change: heard.append(change["new"]), "elevation")
    seen.widget.elevation = -30.0  # as when the user turns it
    assert heard == [-30.0] and seen.elevation == -30
    # The side that is kept is the one away from the eye, which is below now.
    seen.widget.section = "z=4"
    assert seen.section == "z>4"


def test_a_look_that_cannot_be_is_refused_and_changes_nothing(mesh):
    seen = mesh.view()
    for name, value, words in (
        ("section", "w<3", 'section is "w<3"; it must be x, y or z'),
        ("color", "values", "color is 'values'; it must be one of faces, overhang"),
        ("elevation", 91, "elevation is 91; it must be from -90 to 90"),
        ("zoom", float("nan"), "zoom is nan; it must be from 0.2 to 200"),
    ):
        before = dict(seen.look)
        for target in (seen, seen.widget):
            with pytest.raises(ValueError, match=words):
                setattr(target, name, value)
        assert seen.look == before and getattr(seen.widget, name) == before[name]
    with pytest.raises(TypeError, match="a view has no 'colour'; it has section, azimuth"):
        mesh.view(colour="faces")
    with pytest.raises(ValueError, match='values is "thick"; it must be numbers'):
        mesh.view("thick")
    with pytest.raises(TypeError, match="view takes a Mesh or a Solid, found dict"):
        lt.view({})
    with pytest.raises(ValueError, match="edge and per_cell are for a solid"):
        lt.view(mesh, edge=0.2)


def test_notebooks_show_the_widget_or_else_a_page(mesh, monkeypatch):
    data, _ = mesh.view()._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in data and "image/png" in data
    assert mesh.view()._repr_html_() is None
    format_of = pytest.importorskip("IPython.core.formatters").DisplayFormatter().format
    assert "application/vnd.jupyter.widget-view+json" in format_of(mesh.view())[0]
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "trabecula.pictures.widget", raising=False)
    assert set(format_of(mesh.view())[0]) == {"text/plain", "text/html"}
    with pytest.raises(ImportError, match=r"pip install 'trabecula\[notebook\]'"):
        _ = mesh.view().widget


def test_walls_are_coloured_by_their_thickness():
    """A plate of 2 mm with a bar of 6 mm: away from edges and from where they meet each has its own."""
    part = """schema = 1
    region.union = [{ box = { min = [0, 0, 0], max = [20, 20, 2] } }, { box = { min = [7, 7, 0], max = [13, 13, 20] } }]
    lattice.a = { cell = "gyroid", part = "sheet", map.affine.wavelength = 6, level.fraction = 0.3 }
    keep.most.box = { min = [3, -1, -1], max = [21, 21, 21] }
    """
    made = parsed(part, False, "part.toml", ".").build().mesh(edge=0.5)
    found = made.thickness_at_vertices(step=0.25)
    x, y, z = made.vertices.T
    corner = np.minimum(20 - x, np.minimum(y, 20 - y))
    thin = (np.abs(z - 2) < 1e-6) & (corner > 2) & (x > 16)
    side = (np.abs(x - 13) < 1e-6) & (np.abs(y - 10) < 0.5) & (np.abs(z - 12) < 3)
    # The error of a mean is a fifth of a step; a vertex may have that of a voxel at the edge of its ball.
    assert thin.sum() > 50 and np.abs(found[thin] - 2).max() < 0.25
    assert side.sum() > 10 and np.abs(found[side] - 6).max() < 0.25
    seen = made.view("thickness")
    assert seen.color == "values" and seen._span is not None and "wall thickness, mm" in seen.figure()


SHOWN = """async ([esm, traits, bytes]) => {
  const it = (await import(URL.createObjectURL(new Blob([esm], { type: "text/javascript" })))).default;
  const raw = Uint8Array.from(atob(bytes), (c) => c.charCodeAt(0));
  traits._mesh = new DataView(raw.buffer);
  const heard = {};
  window.model = {
    saved: 0,
    get: (name) => traits[name],
    set: (name, value) => {
      if (traits[name] === value) return;
      traits[name] = value;
      (heard["change:" + name] || []).forEach((f) => f());
    },
    on: (name, f) => { (heard[name] ||= []).push(f); },
    off: (name, f) => { heard[name] = heard[name].filter((g) => g !== f); },
    save_changes() { this.saved++; },
  };
  const el = document.body.appendChild(document.createElement("div"));
  window.ended = await it.render({ model, el });
  return +el.querySelector("figure").dataset.drawn;
}"""
HATCHED = """async () => {
  await new Promise(requestAnimationFrame); await new Promise(requestAnimationFrame);
  const c = document.querySelector("canvas"), gl = c.getContext("webgl2"), p = new Uint8Array(4 * c.width * c.height);
  gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
  let n = 0;
  for (let i = 0; i < p.length; i += 4) if (p[i] > 1.6 * p[i + 1] && p[i + 3] > 250) n++;
  return n;
}"""


def test_a_browser_draws_the_widget_and_both_sides_hear_of_changes(mesh):
    sync = pytest.importorskip("playwright.sync_api")
    if chromium() is None:
        pytest.skip("no Chromium")
    import base64

    widget = mesh.view(elevation=90).widget
    traits = {name: getattr(widget, name) for name in ("_markup", *NAMES)}
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 800, "height": 700})
        wrong = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.add_style_tag(content=widget._css if isinstance(widget._css, str) else str(widget._css))
        stream = base64.b64encode(widget._mesh).decode()
        assert page.evaluate(SHOWN, [str(widget._esm), traits, stream]) == mesh.counts[1]
        nothing = page.evaluate(HATCHED)  # but for pixels at silhouettes
        assert nothing < 100
        # Python moves the section.
        page.evaluate("model.set('section', 'z<4')")
        assert page.evaluate(HATCHED) > 100 * max(nothing, 50)
        assert page.inner_text("[data-part=at]") == "z = 4.000 mm" and page.evaluate("model.saved") == 0
        page.evaluate("model.set('color', 'overhang')")
        assert page.input_value("[name=colours]") == "1"
        # The user turns the part and takes the other side.
        page.focus("canvas")
        page.keyboard.press("ArrowRight")
        page.check("[name=flip]")
        page.evaluate(HATCHED)
        assert page.evaluate("[model.get('azimuth'), model.get('section'), model.saved > 0]") == [20, "z>4", True]
        page.evaluate("ended()")
        browser.close()
    assert not wrong
