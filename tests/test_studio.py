"""The studio: its server, and in a browser the page itself: what it shows, meshes and saves is what the command does."""

import contextlib
import difflib
import hashlib
import json
import subprocess
import sys
import threading
import urllib.error
import urllib.request
import zipfile
from pathlib import Path

import pytest
import trabecula as lt
from conftest import in_process
from test_viewer import chromium
from trabecula.command import studio
from trabecula.errors import Refused

#: Small, with what a control of each kind is for.
BOX = """# kept
schema = 1
region.box.size = [6, 6, 6] # kept too
[lattice.core]
cell = "gyroid"
part = "sheet"
map.affine = { wavelength = 6 }
level.fraction = 0.3
"""


def corner():
    """A part with edges and slanted faces."""
    return lt.Mesh.of([[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


@contextlib.contextmanager
def served(design=None):
    """The address of a server while it runs."""
    with studio.Studio(None if design is None else str(design)) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield server.url
        finally:
            server.shutdown()
            thread.join()


def got(url, host=None):
    """Status and bytes of what is at an address."""
    request = urllib.request.Request(url, headers={"Host": host} if host else {})
    try:
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, b""


# --- the command and the server --------------------------------------------------------------------------------------


@pytest.fixture
def a_page(tmp_path, monkeypatch):
    """A page in the package, whether one was built or not."""
    (tmp_path / "studio.html").write_text("a page")
    monkeypatch.setattr(studio, "files", lambda _: tmp_path)


def test_a_package_without_the_page_says_what_to_do(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(studio, "files", lambda _: tmp_path)
    with pytest.raises(Refused, match=r"`make studio` there .* next `pip install \.`.* report DESIGN -o part\.html"):
        studio.page()
    assert in_process("studio", "--no-open", status=1) == ""


def test_wheels_to_hand_out_have_the_page(tmp_path):
    script = Path(__file__).parent.parent / "scripts/check_wheels.py"

    def checked(*wheels):
        return subprocess.run([sys.executable, script, *wheels], capture_output=True, text=True)

    whole, bare = tmp_path / "whole.whl", tmp_path / "bare.whl"
    for wheel, names in ((whole, ["__init__.py", "command/studio.html"]), (bare, ["__init__.py"])):
        with zipfile.ZipFile(wheel, "w") as file:
            for name in names:
                file.writestr(f"trabecula/{name}", "")
    assert checked(whole).returncode == 0
    refused = checked(whole, bare)
    assert refused.returncode == 1 and refused.stderr.startswith(f"{bare}: no trabecula/command/studio.html; `make studio`")
    assert checked().returncode == 1


def test_a_design_is_served_with_the_files_that_it_names_and_nothing_else(a_page, tmp_path):
    (tmp_path / "parts").mkdir()
    corner().write(tmp_path / "parts/corner.stl")
    design = tmp_path / "corner.toml"
    design.write_text(BOX.replace("region.box.size = [6, 6, 6]", 'region.mesh.path = "parts/corner.stl"'))
    with served(design) as url:
        home = url.removesuffix("?design")
        assert got(url) == (200, b"a page")
        reported = json.loads(got(home + "design.json")[1])
        assert reported == {
            "name": "corner",
            "text": design.read_text(),
            "files": [{"name": "parts/corner.stl", "url": "files/0"}],
        }
        assert got(home + "files/0") == (200, (tmp_path / "parts/corner.stl").read_bytes())
        for other in ("files/1", "files/-1", "files/../corner.toml", "corner.toml", "files/"):
            assert got(home + other)[0] == 404, other
        # Another site whose name leads to this machine gets nothing.
        assert got(home + "design.json", "example.org")[0] == 403
        # A design with an error is shown with it.
        design.write_text("schema = ")
        assert json.loads(got(home + "design.json")[1]) == {"name": "corner", "text": "schema = ", "files": []}
    with served() as url:
        assert got(url) == (200, b"a page") and got(url + "design.json")[0] == 404


def test_what_cannot_be_served_is_one_sentence(a_page, tmp_path):
    with served() as url:
        port = int(url.rstrip("/").rpartition(":")[2])
        with pytest.raises(Refused, match=f"port {port} cannot be had"):
            studio.Studio(None, port)
    with pytest.raises(FileNotFoundError):
        studio.Studio(str(tmp_path / "none.toml"))
    in_process("studio", tmp_path / "none.toml", "--no-open", status=1)
    in_process("view", tmp_path / "none.toml", "--no-open", status=1)
    for words in (["studio", "part.stl"], ["view"]):
        with pytest.raises(SystemExit):
            in_process(*words)
    with pytest.raises(SystemExit):
        in_process("studio", "--port", "70000")


# --- the page --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser():
    """A browser, and the page as it was built."""
    try:
        studio.page()
    except Refused:
        pytest.skip("no studio page: `make studio`")
    sync = pytest.importorskip("playwright.sync_api")
    if chromium() is None:
        pytest.skip("no Chromium")
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        yield browser
        browser.close()


@contextlib.contextmanager
def opened(browser, url):
    """The page at an address, once its picture and figures are there; nothing may be broken in it."""
    wrong = []
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(url)
    settled(page)
    yield page
    page.close()
    assert not wrong, wrong


def settled(page):
    """Waits until all that the text asks for is shown."""
    page.wait_for_function("state.opened && !state.busy && !state.stale", timeout=60_000)


def write(page, text):
    """Puts a text into the editor as a user does."""
    page.fill("#text", text)
    settled(page)


def ask(page, **request):
    """An answer of the core in the page's worker; of bytes their SHA-256."""
    return page.evaluate(
        """async (request) => { const { head, body } = await core.ask(request);
        const sum = await crypto.subtle.digest("SHA-256", body);
        return { ...head, sum: [...new Uint8Array(sum)].map((b) => b.toString(16).padStart(2, "0")).join("") }; }""",
        {"do": request.pop("do_"), **request},
    )


def close(found, known):
    """The same figures. Exponentials and angles are the platform's, whose last bit may be another; a pore, a saddle that is
    found by iteration, has some thousand times that.
    """
    if isinstance(known, dict):
        assert found.keys() == known.keys()
        for key in known:
            close(found[key], known[key])
    elif isinstance(known, list):
        assert len(found) == len(known)
        for pair in zip(found, known, strict=True):
            close(*pair)
    else:
        assert found == (pytest.approx(known, rel=2.3e-13) if isinstance(known, float) else known)


def sum_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_page_designs_meshes_and_saves_what_the_command_does(browser, tmp_path):
    (tmp_path / "box.toml").write_text(BOX)
    with served(tmp_path / "box.toml") as url, opened(browser, url) as page:
        assert page.input_value("#text") == BOX
        assert int(page.get_attribute("figure.viewer", "data-drawn")) > 1000
        # A slider changes its value and nothing else in the text; the picture follows.
        before = page.evaluate("+document.body.dataset.pictures")
        page.focus("#amount")
        for _ in range(4):
            page.keyboard.press("ArrowRight")
        page.wait_for_function("text.value.includes('0.32')", timeout=20_000)
        settled(page)
        changed = BOX.replace("0.3\n", "0.32\n")
        assert page.input_value("#text") == changed
        assert page.evaluate("+document.body.dataset.pictures") > before
        # Its figures are those of `check`.
        (tmp_path / "box.toml").write_text(changed)
        known = json.loads(in_process("check", tmp_path / "box.toml", "--json"))
        figures = {k: v for k, v in ask(page, do_="figures").items() if k != "sum"}
        close(figures, known)
        # Its files are those of `mesh`.
        page.click("#mesh")
        page.wait_for_selector("#made:not([hidden])", timeout=60_000)
        for button, kind in (("#stl", "stl"), ("#three", "3mf")):
            with page.expect_download() as waiting:
                page.click(button)
            assert waiting.value.suggested_filename == f"box.{kind}"
            waiting.value.save_as(tmp_path / f"page.{kind}")
            made = json.loads(in_process("mesh", tmp_path / "box.toml", "-o", tmp_path / f"command.{kind}", "--json"))
            assert sum_of(tmp_path / f"page.{kind}") == sum_of(tmp_path / f"command.{kind}")
        assert int(page.get_attribute("figure.viewer", "data-drawn")) == made["triangles"]
        # Its walls are coloured by their thickness, until the design changes.
        thick = "[name=colours] [value='2']"
        page.select_option("[name=colours]", "2")
        page.wait_for_function("state.shown[0].span", timeout=60_000)
        least, most = page.evaluate("state.shown[0].span")
        assert 0 < least < figures["lattices"]["core"]["thickness"] < most < 1.5
        assert page.inner_text("[data-part=legend]").split()[-2:] == [f"{most:.3g}", "mm"] and page.is_enabled(thick)
        # The address holds the design.
        page.wait_for_function("location.hash.startsWith('#d=')", timeout=5_000)
        page.wait_for_timeout(400)
        address = page.evaluate("location.hash")
        with opened(browser, url.removesuffix("?design") + address) as other:
            assert other.input_value("#text") == changed


MORE = {
    "graded ball": """schema = 1
region.sphere.radius = 4
[lattice.a]
cell = "diamond"
part = "lower"
map.affine = { wavelength = [5, 4, 4], rotate = [10, 20, 30] }
level.fraction = { radial = { center = [0, 0, 0], stops = [[0, 0.6], [4, 0.25]] } }
""",
    "formula and skin": """schema = 1
region.cylinder = { base = [0, 0, 0], radius = 4, height = 5 }
[lattice.a]
cell = "iwp"
part = "sheet"
map.affine = { wavelength = 5 }
level.fraction = { formula = "0.25 + 0.1*sin(x)*exp(-y/9) + 0.02*abs(z)^1.3" }
[skin]
thickness = 0.5
""",
    "radial basis functions": """schema = 1
region.box.size = [10, 8, 6]
[lattice.a]
cell = "gyroid"
part = "sheet"
map.affine = { wavelength = 4 }
[lattice.a.level.fraction.rbf]
points = [[-5, -4, -3], [-4, 3, 2], [0, 0, 0], [1, -3, 2], [3, 3, -2], [5, -4, 3]]
values = [0.2, 0.5, 0.3, 0.45, 0.25, 0.4]
delta = 7
""",
    "beams": """schema = 1
region.box.size = [8, 8, 8]
[beams.a]
cell = "octet"
radius = 0.4
fillet = "auto"
map.affine.wavelength = 5
""",
    "part": """schema = 1
region.mesh.path = "part.stl"
[lattice.a]
cell = "primitive"
part = "sheet"
map.affine = { wavelength = 4 }
level.thickness = 0.6
""",
}


@pytest.mark.parametrize("name", MORE)
def test_other_designs_have_the_bytes_of_the_command(browser, tmp_path, name):
    design = tmp_path / "design.toml"
    design.write_text(MORE[name])
    corner().write(tmp_path / "part.stl")
    in_process("mesh", design, "-o", tmp_path / "command.stl")
    with served(design) as url, opened(browser, url) as page:
        found = ask(page, do_="mesh", edge=None, per_cell=None)
        assert "error" not in found, found
        assert ask(page, do_="write", suffix="stl")["sum"] == sum_of(tmp_path / "command.stl")


#: Designs through which a graphics card marches: maps that are affine, that vary, and whose phases jump; levels of each kind.
MARCHED = {
    "box": BOX,
    "graded ball": MORE["graded ball"],
    "part": MORE["part"],
    "wrapped": """schema = 1
[region]
difference = [
  { cylinder = { base = [0, 0, 0], radius = 8, height = 8 } },
  { cylinder = { base = [0, 0, -1], radius = 4, height = 10 } },
]
[lattice.a]
cell = "gyroid"
part = "sheet"
map.cylinder = { around = 8, wavelength = 4 }
level.thickness = 0.5
""",
    "solved": """schema = 1
region.box.size = [14, 14, 6]
[lattice.a]
cell = "primitive"
part = "upper"
map.phase = { wavelength = 4, rotate = [0, 0, { formula = "4*x" }] }
level.fraction = { linear = { along = [1, 0, 0], stops = [[-7, 0.25], [7, 0.5]] } }
""",
}


def by_rays(page):
    """Has the design drawn by rays, as where there is a graphics card."""
    page.select_option("#by", "rays")
    settled(page)
    assert page.inner_text("#status").startswith("picture by rays")


#: Colours of the canvas, as the design is drawn by rays and by its mesh.
DRAWN = """async (view) => {
    screen_.look(view);
    const pixels = async () => {
        await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        rays.painter.finish();
        const gl = screen_.gl, [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], bytes = new Uint8Array(4 * w * h);
        gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        return bytes;
    };
    const byRays = await pixels();
    await picture(600000, false);
    const meshed = await pixels();
    await marched(controls.data);
    let either = 0, both = 0, alike = 0;
    for (let i = 0; i < byRays.length; i += 4) {
        const [a, b] = [byRays[i + 3] > 127, meshed[i + 3] > 127];
        either += a || b;
        both += a && b;
        alike += a && b && [0, 1, 2].every((c) => Math.abs(byRays[i + c] - meshed[i + c]) < 32);
    }
    return [either, both / either, alike / either];
}"""


@pytest.mark.parametrize("name", MARCHED)
def test_rays_show_what_the_mesh_is(browser, tmp_path, name):
    design = tmp_path / "design.toml"
    design.write_text(MARCHED[name])
    corner().write(tmp_path / "part.stl")
    with served(design) as url, opened(browser, url) as page:
        by_rays(page)
        bounds = ask(page, do_="rays", cell=False, region=False)["bounds"]
        middle = 0.5 * (bounds[0][1] + bounds[1][1]) + 0.3
        cut = {"azimuth": -50, "elevation": 40, "section": f"y<{middle}", "color": "overhang"}
        for view in ({"azimuth": 30, "elevation": 25}, cut):
            either, covered, alike = page.evaluate(DRAWN, view)
            # Along the edges of what is seen the pixels of a mesh of 32 steps a wavelength, or fewer, are others.
            assert either > 20_000 and covered > 0.97 and alike > 0.93, (view, either, covered, alike)


def test_solids_with_more_than_a_lattice_are_meshed_for_their_picture(browser, tmp_path):
    design = tmp_path / "design.toml"
    for name in ("formula and skin", "beams"):
        design.write_text(MORE[name])
        with served(design) as url, opened(browser, url) as page:
            page.select_option("#by", "rays")
            settled(page)
            assert ask(page, do_="rays", cell=True, region=True).get("none")
            assert int(page.get_attribute("figure.viewer", "data-drawn")) > 1000


def test_a_graded_lattice_is_coloured_by_its_fraction(browser, tmp_path):
    design = tmp_path / "design.toml"
    design.write_text(MARCHED["solved"])
    with served(design) as url, opened(browser, url) as page:
        by_rays(page)
        page.select_option("[name=colours]", "3")
        low, high = page.inner_text("[data-part=legend]").split()
        # Levels in the middles of voxels: the ends are half a voxel of 48 off.
        assert 0.25 <= float(low) < 0.26 and 0.49 < float(high) <= 0.5
        write(page, MARCHED["box"])
        assert page.inner_text("#status").startswith("picture by rays")
        assert page.input_value("[name=colours]") == "0" and page.is_disabled("[name=colours] [value='3']")


def test_a_part_is_coloured_by_its_depth(browser):
    with served() as url, opened(browser, url) as page:
        by_rays(page)
        write(page, BOX)
        half = min(ask(page, do_="rays", cell=True, region=True)["bounds"][1])
        picture = page.locator("canvas").screenshot()
        page.select_option("[name=colours]", "4")
        low, high, unit = page.inner_text("[data-part=legend]").split()
        # The distance is sampled: the deepest sample is within a step of the middle.
        assert float(low) == 0 and 0.9 * half < float(high) <= half and unit == "mm"
        assert page.locator("canvas").screenshot() != picture


#: What is changed, and what the text then is; "+" and "-" are lines that come and go.
EDITS = {
    "a number with its comment": (
        [(["region", "box", "size"], [7, 6, 5.5])],
        "-region.box.size = [6, 6, 6] # kept too +region.box.size = [7, 6, 5.5] # kept too",
    ),
    "in braces": (
        [(["lattice", "core", "map", "affine", "wavelength"], 4.25)],
        "-map.affine = { wavelength = 6 } +map.affine = { wavelength = 4.25 }",
    ),
    "another amount": (
        [(["lattice", "core", "level", "fraction"], None), (["lattice", "core", "level", "thickness"], 0.5)],
        "-level.fraction = 0.3 +level.thickness = 0.5",
    ),
    "a grade": (
        [(["lattice", "core", "level", "fraction"], {"linear": {"along": [0, 0, 1], "stops": [[-3, 0.2], [3, 0.4]]}})],
        "-level.fraction = 0.3 +level.fraction = { linear = { along = [0, 0, 1], stops = [[-3, 0.2], [3, 0.4]] } }",
    ),
    "a new table": ([(["skin"], {"thickness": 0.5})], "+ +[skin] +thickness = 0.5"),
}


def test_a_change_leaves_all_else_in_the_text_as_it_is(browser):
    with served() as url, opened(browser, url) as page:
        for name, (changes, difference) in EDITS.items():
            listed = [{"path": path, "value": value, "heading": True} for path, value in changes]
            made = ask(page, do_="edit", text=BOX, changes=listed)
            lines = [d for d in difflib.ndiff(BOX.splitlines(), made["text"].splitlines()) if d[0] in "+-"]
            assert " ".join(d[0] + d[2:] for d in lines) == difference, name
            assert "error" not in ask(page, do_="open", text=made["text"]), name
        refused = ask(page, do_="edit", text=BOX, changes=[{"path": ["schema", "a", "b"], "value": 1}])
        assert refused["error"]["text"] == "a is in the way: what holds it is no table"


def test_mistakes_stand_at_their_line_and_files_are_dropped_in(browser, tmp_path):
    (tmp_path / "bad.stl").write_text("not a mesh")
    with served() as url, opened(browser, url) as page:
        good = page.input_value("#text")
        page.fill("#text", good.replace('"gyroid"', '"gyriod"'))
        page.wait_for_selector("#error:not([hidden])", timeout=20_000)
        settled(page)
        line = good[: good.index('"gyroid"')].count("\n") + 1
        assert page.inner_text("#error").startswith(f"line {line}: lattice.core.cell: unknown cell")
        assert page.inner_text("#lines .wrong") == str(line)
        assert page.is_disabled("#mesh") and page.get_attribute("#text", "aria-invalid") == "true"
        write(page, good)
        assert page.is_hidden("#error") and page.is_enabled("#mesh")
        # A part that is none: the sentence of the core, at the line that names it.
        drop = """async ([name, bytes]) => { const data = new DataTransfer();
            data.items.add(new File([new Uint8Array(bytes)], name));
            document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true })); }"""
        page.evaluate(drop, ["bad.stl", list((tmp_path / "bad.stl").read_bytes())])
        page.wait_for_selector("#error:not([hidden])", timeout=20_000)
        settled(page)
        assert "region.mesh.path" in page.inner_text("#error") and "[region.mesh]" in page.input_value("#text")
        # A good one of the same name mends it.
        corner().write(tmp_path / "good.stl")
        page.evaluate(drop, ["bad.stl", list((tmp_path / "good.stl").read_bytes())])
        page.wait_for_selector("#error", state="hidden", timeout=20_000)
        settled(page)
        assert page.inner_text("#mesh-name") == "bad.stl"
        # A design that is dropped takes the place of the one that is there.
        page.evaluate(drop, ["other.toml", list(BOX.encode())])
        page.wait_for_function("text.value.startsWith('# kept')", timeout=20_000)
        settled(page)
        assert page.is_hidden("#error")


def test_the_picture_follows_a_slider_that_does_not_rest(browser):
    """Changes come faster than pictures: none is queued, pictures go on, and the last change is what stays."""
    move = """async () => {
        const slider = document.getElementById("amount"), before = +document.body.dataset.pictures;
        for (let i = 0; i < 60; i++) {
            slider.value = 0.2 + 0.005 * i;
            slider.dispatchEvent(new Event("input", { bubbles: true }));
            await new Promise((done) => setTimeout(done, 25));
        }
        return +document.body.dataset.pictures - before; }"""
    with served() as url, opened(browser, url) as page:
        assert page.evaluate(move) >= 1
        settled(page)
        assert "fraction = 0.495\n" in page.input_value("#text")
        assert page.evaluate("pending.size") == 0


def test_of_a_large_part_the_middle_is_shown_while_it_changes(browser):
    with served() as url, opened(browser, url) as page:
        large = page.input_value("#text").replace("[18, 18, 18]", "[90, 90, 90]")
        assert "error" not in ask(page, do_="open", text=large)
        found = ask(page, do_="picture", cells=12000, part=True)
        # 12 steps of 0.5 mm on the wavelength, and a box of as many of them as were asked for, from the middle out.
        assert found["part"] and found["edge"] == 0.5
        half = 45 * (12000 / 181**3) ** (1 / 3)
        assert found["bounds"] == [pytest.approx([-half] * 3), pytest.approx([half] * 3)]
        assert found["triangles"] > 1000
        # At rest too, where the whole has too many triangles; the page stays in hand.
        write(page, large.replace("[90, 90, 90]", "[900, 900, 900]"))
        assert page.inner_text("#status").startswith("the middle (")
        page.click("#mesh")
        page.wait_for_selector("#error:not([hidden])", timeout=60_000)
        assert "million triangles do not fit into the memory of a page" in page.inner_text("#error")


def test_a_change_takes_the_colours_of_thickness_away(browser):
    with served() as url, opened(browser, url) as page:
        write(page, BOX)
        page.click("#mesh")
        page.wait_for_selector("#made:not([hidden])", timeout=60_000)
        page.select_option("[name=colours]", "2")
        page.wait_for_function("state.shown[0].span", timeout=60_000)
        write(page, BOX.replace("0.3", "0.31"))
        assert page.input_value("[name=colours]") == "0" and page.is_disabled("[name=colours] [value='2']")


def test_a_mesh_is_cancelled_and_the_page_goes_on(browser):
    with served() as url, opened(browser, url) as page:
        page.fill("#edge", "0.06")
        page.click("#mesh")
        page.wait_for_function("!document.getElementById('cancel').hidden", timeout=20_000)
        page.wait_for_function("document.getElementById('progress').value > 0", timeout=60_000)
        page.keyboard.press("Escape")
        page.wait_for_selector("#mesh", state="visible", timeout=20_000)
        settled(page)
        assert page.is_hidden("#made") and page.is_hidden("#error")
        page.fill("#edge", "0.5")
        page.click("#mesh")
        page.wait_for_selector("#made:not([hidden])", timeout=60_000)


def test_a_phone_has_no_sideways_scroll_and_all_controls_have_names(browser):
    with served() as url, opened(browser, url) as page:
        unnamed = """[...document.querySelectorAll("button, input:not([hidden]), select, textarea")]
            .filter((e) => ![e.ariaLabel, e.closest("label")?.textContent, e.textContent].some((t) => t?.trim()))
            .map((e) => e.outerHTML)"""
        assert page.evaluate(unnamed) == []
        page.set_viewport_size({"width": 390, "height": 800})
        page.wait_for_timeout(200)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        # The picture comes first.
        assert page.evaluate("document.getElementById('scene').getBoundingClientRect().top") < 200
