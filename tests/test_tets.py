"""Tetrahedral meshes: made, read, written, judged; other people's formats and meshers."""

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest
import trabecula as lt
from trabecula.io import children, elements, meshers

BALL = {"region": {"sphere": {"radius": 5.0}}, "lattice": {"core": {"map": lt.map.tets(size=1.5)}}}

DESIGN = """\
schema = 1
[region.sphere]
radius = 5
[lattice.core.cell.tet]
name = "left alone here"
[lattice.core.map.tets]
size = 1.5
"""


def command(*words, expected=0):
    """Runs the command; gives stdout and stderr."""
    done = subprocess.run([sys.executable, "-m", "trabecula", *map(str, words)], capture_output=True, text=True, timeout=300)
    assert done.returncode == expected, f"{words}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout, done.stderr


def volumes(nodes, tets):
    a, b, c, d = (nodes[tets[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def faces_of(tets):
    """How often each face is there."""
    sides = np.concatenate([np.delete(tets, i, axis=1) for i in range(4)])
    return np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)[1]


def test_a_ball_is_meshed_face_to_face():
    mesh = lt.TetMesh.of(BALL)
    report = mesh.report()
    of = volumes(mesh.nodes, mesh.tets)
    assert (of > 0).all() and set(faces_of(mesh.tets)) == {1, 2}
    assert np.isclose(of.sum(), mesh.volume, rtol=1e-12)
    boundary = mesh.boundary()
    assert boundary.closed and np.isclose(boundary.volume, of.sum(), rtol=1e-12)
    # Boundary nodes are outside of the surface by what chords between them are inside, at most size² / 8R and some.
    off = np.linalg.norm(boundary.vertices, axis=1) - 5
    assert off.min() > -1e-6 and off.mean() > 0 and off.max() < 1.5**2 / 16
    assert not report["warnings"] and mesh.volume == pytest.approx(report["region_volume"], rel=5e-4)
    assert np.isclose(report["region_volume"], 4 / 3 * np.pi * 5**3, rtol=1e-12)
    assert report["fit"]["to_part"]["max"] < 1.5**2 / 8
    assert np.isclose(mesh.least_dihedral.min(), report["quality"]["dihedral"]["min"])
    assert np.allclose(mesh.sizes, np.cbrt(72**0.5 * of))


def test_meshes_are_pickled_and_copied(tmp_path):
    """Of data, of files, of a part in memory, as they are and moved: once and again the same in every array and figure."""
    (tmp_path / "ball.toml").write_text(DESIGN)
    ball = lt.TetMesh.of(BALL)
    ball.write(tmp_path / "ball.vtu")
    made = [ball, lt.TetMesh.of(tmp_path / "ball.toml", "core"), lt.TetMesh.read(tmp_path / "ball.vtu", unit="cm")]
    made += [lt.TetMesh.of(lt.Design(lt.region.mesh(ball.boundary()), BALL["lattice"]))]
    made += [ball.scaled([-1, 2, 3]).rotated("z", 30).moved([0.1, 0, 7])]
    for mesh in made:
        again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(mesh))))
        assert copy.deepcopy(mesh) is mesh is copy.copy(mesh) and repr(again) == repr(mesh)
        assert again.report() == mesh.report() and again.zone_names == mesh.zone_names
        for of in ("nodes", "tets", "zones", "sizes"):
            np.testing.assert_array_equal(getattr(again, of), getattr(mesh, of))


def test_the_command_tells_and_writes(tmp_path):
    design = tmp_path / "ball.toml"
    design.write_text(DESIGN)
    out, _ = command("tets", design, "-o", tmp_path / "ball.vtu", "--json")
    report = json.loads(out)
    assert report["mesher"] == "background" and report["quality"]["inverted"] == 0
    out, _ = command("tets", tmp_path / "ball.vtu")
    assert "dihedral" in out and f"tetrahedra  {report['quality']['tets']}" in out
    read = lt.TetMesh.read(tmp_path / "ball.vtu")
    assert read.report()["quality"] == report["quality"] and read.report()["fit"] is None
    assert "no lattice of the design" in command("tets", design, "--lattice", "other", expected=1)[1]
    assert "--unit and --split belong" in command("tets", design, "--split", expected=2)[1]
    same = command("tets", tmp_path / "ball.vtu", "-o", tmp_path / "ball.vtu", expected=1)[1]
    assert "name another output" in same
    command("tets", design, "-o", tmp_path / "ball.stl", expected=2)


@pytest.mark.parametrize("kind", ["vtu", "msh", "inp", "mesh", "med"])
def test_formats_of_finite_elements(tmp_path, kind):
    meshio = pytest.importorskip("meshio")
    if kind == "med":
        pytest.importorskip("h5py")
    mesh = lt.TetMesh.of(BALL)
    path = tmp_path / f"ball.{kind}"
    mesh.write(path)
    other = meshio.read(path)
    tets = np.concatenate([c.data for c in other.cells if c.type == "tetra"])
    # The formats of text keep all digits but a few.
    assert np.isclose(volumes(other.points, tets).sum(), mesh.volume, rtol=1e-9)
    again = lt.TetMesh.read(path)
    assert again.counts == mesh.counts and np.isclose(again.volume, mesh.volume, rtol=1e-9)
    assert (again.tets == mesh.tets).all() and np.allclose(again.nodes, mesh.nodes, atol=1e-9)


#: Other formats of meshio that hold tetrahedra: extension, its name, keywords, digits kept.
OTHERS = [
    ("vtk", "vtk", {"binary": True}, 1e-12),
    ("vtu", "vtu", {"binary": False}, 1e-9),
    ("msh", "gmsh22", {"binary": False}, 1e-9),
    ("msh", "gmsh", {"binary": True}, 1e-12),
    ("meshb", "medit", {}, 1e-12),
    ("bdf", "nastran", {}, 1e-3),
    ("avs", "avsucd", {}, 1e-9),
    ("su2", "su2", {}, 1e-9),
    ("xdmf", "xdmf", {"data_format": "XML"}, 1e-9),
]


@pytest.mark.parametrize(("kind", "form", "keys", "digits"), OTHERS, ids=[f"{f}-{k}" for k, f, *_ in OTHERS])
def test_formats_that_others_write(tmp_path, kind, form, keys, digits):
    """Hand-made by meshio, as another program would: two zones where the format has them."""
    meshio = pytest.importorskip("meshio")
    if form == "xdmf":
        pytest.importorskip("h5py")
    corner = np.array([[x, y, z] for z in (0.0, 2.0) for y in (0.0, 2.0) for x in (0.0, 2.0)])
    tets = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
    zones = np.array([1, 1, 1, 2, 2, 2], dtype=np.int32)
    # meshio writes no zones to version 4 of gmsh's.
    names = {"gmsh22": "gmsh:physical", "medit": "medit:ref", "vtk": "zone", "vtu": "zone"}
    data = {names[form]: [zones]} if form in names else {}
    if form == "gmsh22":
        data["gmsh:geometrical"] = [zones]
    path = tmp_path / f"cube.{kind}"
    meshio.write(path, meshio.Mesh(corner, [("tetra", tets)], cell_data=data), file_format=form, **keys)
    mesh = lt.TetMesh.read(path)
    assert mesh.counts == (8, 6) and np.isclose(mesh.volume, 8, rtol=digits)
    if form in names:
        assert mesh.zones.tolist() == zones.tolist()


def test_formats_without_their_package_are_named(tmp_path, monkeypatch):
    """MED is HDF5: without h5py there is one sentence that says so."""
    pytest.importorskip("meshio")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ValueError, match=r"\.med files need h5py.*pip install h5py"):
        lt.TetMesh.of(BALL).write(tmp_path / "ball.med")
    assert not (tmp_path / "ball.med").exists()
    (tmp_path / "some.med").write_bytes(b"\x89HDF")
    with pytest.raises(ValueError, match=r"\.med files need h5py.*pip install h5py"):
        lt.TetMesh.read(tmp_path / "some.med")


def test_hexahedra_are_offered_a_split(tmp_path):
    meshio = pytest.importorskip("meshio")
    x, y, z = np.meshgrid(range(4), range(3), range(3), indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(float)
    at = np.arange(len(points)).reshape(4, 3, 3)
    lower, upper = at[:-1, :-1, :-1].ravel(), at[1:, 1:, 1:].ravel()
    corners = [lower, at[1:, :-1, :-1].ravel(), at[1:, 1:, :-1].ravel(), at[:-1, 1:, :-1].ravel()]
    corners += [at[:-1, :-1, 1:].ravel(), at[1:, :-1, 1:].ravel(), upper, at[:-1, 1:, 1:].ravel()]
    path = tmp_path / "bricks.inp"
    meshio.write(path, meshio.Mesh(points, [("hexahedron", np.stack(corners, axis=1))]))
    with pytest.raises(ValueError, match="12 hexahedra and 0 tetrahedra; give split = true"):
        lt.TetMesh.read(path)
    mesh = lt.TetMesh.read(path, split=True)
    assert mesh.counts[1] == 12 * 12 and np.isclose(mesh.volume, 12) and mesh.boundary().closed
    # The same brick in metres is a thousand times as long.
    assert np.isclose(lt.TetMesh.read(path, unit="m", split=True).volume, 12e9)


def test_broken_files_are_refused(tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = lt.TetMesh.of(BALL)
    nodes, tets = np.array(mesh.nodes), np.array(mesh.tets).astype(int)

    def refused(nodes, tets, words, kind="msh"):
        path = tmp_path / f"broken.{kind}"
        meshio.write(path, meshio.Mesh(nodes, [("tetra", tets)]), **({"file_format": "gmsh22"} if kind == "msh" else {}))
        with pytest.raises(ValueError, match=words):
            lt.TetMesh.read(path)

    some = tets.copy()
    some[5, [0, 1]] = some[5, [1, 0]]
    refused(nodes, some, "1 of .* tetrahedra are inverted .* the first number 5 at")
    apart = np.vstack([nodes, nodes[tets[7, 0]]])
    slit = tets.copy()
    slit[7, 0] = len(nodes)
    refused(apart, slit, "in one place")
    refused(nodes, np.vstack([tets, tets[3]]), "overlap|shared by")
    middle = nodes[tets[0]].mean(axis=0)
    inner = next(i for i in range(len(tets)) if np.linalg.norm(nodes[tets[i]], axis=1).max() < 3)
    a, b, c, d = tets[inner]
    hung = np.vstack([nodes, (nodes[a] + nodes[b]) / 2])
    two = [[len(nodes), b, c, d], [a, len(nodes), c, d]]
    refused(hung, np.vstack([np.delete(tets, inner, axis=0), two]), "hanging")
    with pytest.warns(lt.DesignWarning, match="numbered the other way round"):
        meshio.write(tmp_path / "turned.msh", meshio.Mesh(nodes, [("tetra", tets[:, [0, 1, 3, 2]])]), file_format="gmsh22")
        turned = lt.TetMesh.read(tmp_path / "turned.msh")
    assert np.isclose(turned.volume, mesh.volume) and len(middle) == 3
    (tmp_path / "nothing.msh").write_text("not a mesh")
    with pytest.raises(ValueError, match=r"nothing\.msh cannot be read"):
        lt.TetMesh.read(tmp_path / "nothing.msh")
    with pytest.raises(ValueError, match="does not exist"):
        lt.TetMesh.read(tmp_path / "missing.inp")


def test_what_is_not_installed_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(ValueError, match=r"pip install 'trabecula\[fe\]'"):
        elements.needed()
    monkeypatch.setattr(meshers, "installed", lambda: "pytetwild")
    data = {**BALL, "lattice": {"core": {"map": lt.map.tets(size=1.5, mesher="ftetwild")}}}
    with pytest.raises(lt.DesignError, match=r"needs pytetwild, not installed here: pip install 'trabecula\[tets\]'"):
        lt.TetMesh.of(data)


def test_a_mesher_that_hangs_or_falls_is_stopped(tmp_path):
    def reported(program, limit):
        return children.run([sys.executable, "-c", program], str(tmp_path), limit)

    assert reported("pass", 60) is None
    assert reported("import time; time.sleep(60)", 0.5) == "did not finish within 0.5 s and was stopped"
    assert reported("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", 60) == "was ended by signal 9"
    assert reported("raise SystemExit('no inside')", 60) == "failed: no inside"


STAND_IN = {
    "answers": """
import numpy as np
def tetrahedralize(points, triangles, edge_length_abs, **keys):
    assert edge_length_abs == 3 and keys["epsilon"] <= 1e-3, keys
    box = np.array([[x, y, z] for z in (0., 10.) for y in (0., 10.) for x in (0., 10.)])
    tets = [[0, 1, 3, 7], [3, 0, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]
    return box, np.array(tets)
""",
    "hangs": "import time\ndef tetrahedralize(*given, **keys):\n    time.sleep(600)\n",
    "falls": "import os\ndef tetrahedralize(*given, **keys):\n    os.abort()\n",
    "says no": "def tetrahedralize(*given, **keys):\n    raise RuntimeError('no inside to be found')\n",
    "finds nothing": "import numpy as np\ndef tetrahedralize(*given, **keys):\n    return np.zeros((0, 3)), np.zeros((0, 4))\n",
}


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("answers", None),
        ("hangs", "did not finish within 2 s and was stopped; try a greater size"),
        ("falls", "was ended by signal 6"),
        ("says no", "failed: RuntimeError: no inside to be found"),
        ("finds nothing", "found no inside: is the surface closed"),
    ],
)
def test_the_road_of_soups(tmp_path, monkeypatch, how, words):
    """The whole road, with a stand-in for the mesher's package in the child process."""
    packages = tmp_path / "packages"
    packages.mkdir()
    (packages / "pytetwild.py").write_text(STAND_IN[how])
    (packages / "pyvista.py").write_text("")
    monkeypatch.setenv("PYTHONPATH", str(packages), prepend=os.pathsep)
    monkeypatch.syspath_prepend(str(packages))
    soup = tmp_path / "soup.stl"
    corners = "".join(f"vertex {x} {y} {z}\n" for x, y, z in [(0, 0, 0), (10, 0, 0), (0, 10, 10)])
    # A triangle bounds nothing, so it is no region; the mesher gets it as it is.
    soup.write_text(f"solid s\nfacet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\nendsolid s\n")
    tets = lt.map.tets(size=3, mesher="ftetwild", limit=60 if how == "answers" else 2)
    design = {"region": {"mesh": {"path": str(soup)}}, "lattice": {"core": {"map": tets}}}
    if words is None:
        with pytest.warns(lt.DesignWarning, match="no region, so the boundary of the tetrahedra is taken for one"):
            mesh = lt.TetMesh.of(design)
        # One of them was numbered the other way round, and was turned.
        assert np.isclose(mesh.volume, 1000) and (volumes(mesh.nodes, mesh.tets) > 0).all()
        # And on to the part, of which the tetrahedra are the region.
        design["lattice"]["core"] |= {"part": "lower", "cell": {"tet": {"name": "diamond"}}, "level": {"fraction": 0.3}}
        with pytest.warns(lt.DesignWarning, match="no region"):
            part = lt.Design(**design).build()
        assert part.report()["region"]["volume"] == pytest.approx(1000, rel=1e-6)
        surface = part.mesh(edge=0.5)
        # Its fraction is the tetrahedra's, whichever of the sides of cubes they have: no regular ones, and few.
        assert surface.closed and surface.solid_fraction == pytest.approx(0.3, abs=0.02)
        return
    started = time.monotonic()
    with pytest.raises(lt.DesignError, match=words):
        lt.TetMesh.of(design)
    assert time.monotonic() - started < 60


def test_ftetwild_takes_a_soup(tmp_path):
    pytest.importorskip("pytetwild")
    pytest.importorskip("pyvista")
    box = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = []
    # Two boxes that overlap, every triangle on its own.
    for at, size in ((0.0, 10.0), (6.0, 8.0)):
        for q in quads:
            for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3])):
                lines += ["facet normal 0 0 0", "outer loop"]
                lines += [f"vertex {at + size * box[i][0]} {at + size * box[i][1]} {at + size * box[i][2]}" for i in t]
                lines += ["endloop", "endfacet"]
    (tmp_path / "soup.stl").write_text("solid s\n" + "\n".join(lines) + "\nendsolid s\n")
    region = {"mesh": {"path": str(tmp_path / "soup.stl")}}
    mesh = lt.TetMesh.of({"region": region, "lattice": {"core": {"map": lt.map.tets(size=3, mesher="ftetwild")}}})
    # The union; the envelope is a thousandth of the diagonal or less.
    assert mesh.volume == pytest.approx(1000 + 512 - 64, rel=0.02)
    assert mesh.report()["mesher"] == "ftetwild" and (volumes(mesh.nodes, mesh.tets) > 0).all()


def test_paths_of_tetrahedra_go_with_their_design():
    from trabecula.base.paths import moved

    data = lt.Design(lt.region.sphere(radius=1), {"core": {"map": lt.map.tets(path="part.vtu")}}).to_dict()
    assert moved(data, lambda path: "../" + path)["lattice"]["core"]["map"]["tets"]["path"] == "../part.vtu"


#: A section of an ANSYS file whose bracket never closes: its reader looks for the end beyond the end of the file.
UNCLOSED = '(0 "made by hand")\n(2 3)\n(37 (1 2 3\n'


def test_a_reader_that_hangs_is_stopped(tmp_path):
    """Within a limit, in one line that names the file."""
    pytest.importorskip("meshio")
    path = tmp_path / "part.msh"
    path.write_text(UNCLOSED)
    with pytest.raises(
        ValueError, match=r"part\.msh cannot be read: meshio did not finish within 3 s and was stopped"
    ) as error:
        elements.read(path, limit=3)
    assert "\n" not in str(error.value)


def test_an_interrupt_ends_the_reader(tmp_path):
    """A signal to the command alone, as `kill -INT` sends it, ends the process that reads too."""
    pytest.importorskip("meshio")
    path = tmp_path / "part.msh"
    path.write_text(UNCLOSED)
    code = "import sys, trabecula as lt; print('ready', flush=True); lt.TetMesh.read(sys.argv[1])"
    words = [sys.executable, "-c", code, str(path)]
    run = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    assert run.stdout.readline() == b"ready\n"

    def readers():
        found = []
        for entry in os.listdir("/proc"):
            try:
                with open(f"/proc/{entry}/cmdline", "rb") as file:
                    line = file.read()
            except OSError:
                continue
            if b"trabecula.io.elements" in line and os.fsencode(path) in line:
                found.append(entry)
        return found

    while not readers() and run.poll() is None:
        time.sleep(0.02)
    run.send_signal(signal.SIGINT)
    run.wait(15)  # the limit of the reader is 20 s
    assert b"KeyboardInterrupt" in run.stderr.read() and not readers()


@pytest.mark.parametrize("kind", ["inp", "msh", "mesh", "bdf", "avs", "su2"])
def test_contents_of_other_files_are_not_shown(tmp_path, kind):
    """A path may lead to a file that is nobody's business."""
    pytest.importorskip("meshio")
    path = tmp_path / f"part.{kind}"
    path.write_text("root:secret:0:0:Charlie &:/root:/bin/csh\ndaemon:*:1:1:Owner:/root:/bin/sh\n")
    with pytest.raises(ValueError, match="cannot be read") as error:
        lt.TetMesh.read(path)
    assert not any(word in str(error.value) for word in ("secret", "Charlie", "daemon"))


def test_readers_have_bounded_memory(tmp_path):
    """One line where a file would take more: here a header that claims a thousand million nodes, for which the reader makes
    room at once."""
    pytest.importorskip("meshio")
    pytest.importorskip("resource")
    path = tmp_path / "part.msh"
    head = b"$MeshFormat\n2.2 1 8\n" + (1).to_bytes(4, sys.byteorder) + b"\n$EndMeshFormat\n"
    path.write_bytes(head + b"$Nodes\n1000000000\n" + bytes(280) + b"\n$EndNodes\n")
    with pytest.raises(ValueError, match=r"part\.msh cannot be read: it takes more than 3\.0 GB of memory$"):
        lt.TetMesh.read(path)


def halves():
    """The six tetrahedra of a cube of 8 mm, split by number: the first three and the last three."""
    corner = np.array([[x, y, z] for z in (0.0, 8.0) for y in (0.0, 8.0) for x in (0.0, 8.0)])
    tets = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
    return corner, [("tetra", tets)]


def zoned(path, zones):
    """The report on the zones of a lattice over the tetrahedra of a file."""
    lattice = lt.Lattice(
        cell=lt.cell.tet(zones=zones), part="lower", map=lt.map.tets(path=os.fspath(path)), level=lt.level.fraction(0.3)
    )
    region = lt.region.box(min=[0, 0, 0], max=[8, 8, 8])
    return lt.Design(region=region, lattice={"a": lattice}).build().report().lattices["a"].tets.zones


def test_element_sets_are_zones(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, cells = halves()
    path = tmp_path / "cube.inp"
    sets = {"core": [np.arange(3)], "rim": [np.arange(3, 6)], "last": [np.array([5])]}
    meshio.write(path, meshio.Mesh(points, cells, cell_sets=sets))
    mesh = lt.TetMesh.read(path)
    (core,) = mesh.zone_names["core"]
    (last,) = mesh.zone_names["last"]
    assert len(mesh.zone_names["rim"]) == 2 and last in mesh.zone_names["rim"]
    assert mesh.zones[:3].tolist() == [core] * 3 and mesh.zones[5] == last
    found = zoned(path, {"core": "p43m", "rim": "f43m"})
    assert {name: zone.count for name, zone in found.items()} == {"core": 3, "rim": 3}
    assert sorted(found["rim"].numbers) == sorted(mesh.zone_names["rim"])
    with pytest.raises(lt.DesignError, match=r"zone hull; its zones are 1 \(core\), .*last"):
        zoned(path, {"core": "p43m", "hull": "f43m"})
    with pytest.raises(lt.DesignError, match=r"are in both last and rim|are in both rim and last"):
        zoned(path, {"core": "p43m", "rim": "f43m", "last": "f43m"})


@pytest.mark.parametrize("kind", ["vtu", "msh", "inp", "mesh", "med"])
def test_zones_come_back_from_what_is_written(tmp_path, kind):
    """Their numbers from all formats, their names from those that have a place for them, with a warning from others."""
    meshio = pytest.importorskip("meshio")
    if kind == "med":
        pytest.importorskip("h5py")
    half = lt.region.halfspace(point=[0, 0, 0], normal=[-1, 0, 0])
    made = lt.TetMesh.of(
        {"schema": 1, "region": BALL["region"], "lattice": {"a": {"map": lt.map.tets(size=1.5, zones={3: half})}}}
    )
    assert set(made.zones) == {0, 3}
    made.write(tmp_path / f"numbers.{kind}")
    again = lt.TetMesh.read(tmp_path / f"numbers.{kind}")
    assert (again.zones == made.zones).all() and again.zone_names == {}

    points, cells = halves()
    sets = {"core": [np.arange(3)], "rim": [np.arange(3, 6)], "last": [np.array([5])]}
    meshio.write(tmp_path / "cube.inp", meshio.Mesh(points, cells, cell_sets=sets))
    tags = [np.array([-6, -6, -6, -7, -7, -7])]
    cube = meshio.Mesh(points, cells, cell_data={"cell_tags": tags})
    cube.cell_tags = {-6: ["core"], -7: ["rim", "outside"]}
    for mesh in [cube] * (kind == "med"):
        meshio.med.write(tmp_path / "cube.med", mesh)
    for name in ["cube.inp"] + ["cube.med"] * (kind == "med"):
        named = lt.TetMesh.read(tmp_path / name)
        lost = {"vtu": {"core", "last", "rim"}, "mesh": {"core", "last", "rim"}, "msh": {"rim"}}.get(kind, set())
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            named.write(tmp_path / f"named.{kind}")
        assert [name for name in ("core", "last", "rim") if any(name in str(w.message) for w in heard)] == sorted(lost)
        again = lt.TetMesh.read(tmp_path / f"named.{kind}")
        assert again.zones.tolist() == named.zones.tolist()
        assert again.zone_names == {name: of for name, of in named.zone_names.items() if name not in lost}


def test_names_of_zones_that_no_format_takes_are_written_otherwise(tmp_path):
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    points, cells = halves()
    mesh = meshio.Mesh(points, cells, cell_data={"cell_tags": [np.array([-1, -1, -1, -2, -2, -2])]})
    mesh.cell_tags = {-1: ["a,b=1"], -2: ["ZONE_9", "rim"]}
    meshio.med.write(tmp_path / "cube.med", mesh)
    read = lt.TetMesh.read(tmp_path / "cube.med")
    assert read.zones.tolist() == [-1, -1, -1, 9, 9, 9] and read.zone_names == {"a,b=1": [-1], "rim": [9]}
    for kind in ("inp", "msh", "med"):
        with pytest.warns(lt.DesignWarning, match="cannot hold the name a,b=1 of zones as it is"):
            read.write(tmp_path / f"out.{kind}")
        assert lt.TetMesh.read(tmp_path / f"out.{kind}").zone_names == {"a-b-1": [-1], "rim": [9]}


def test_families_are_zones_by_number_and_by_name(tmp_path):
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("h5py")
    points, cells = halves()
    path = tmp_path / "cube.med"
    mesh = meshio.Mesh(points, cells, cell_data={"cell_tags": [np.array([-1, -1, -1, -2, -2, -2])]})
    mesh.cell_tags = {-1: ["core"], -2: ["rim", "outside"]}
    meshio.med.write(path, mesh)
    read = lt.TetMesh.read(path)
    assert read.zones.tolist() == [-1, -1, -1, -2, -2, -2]
    assert read.zone_names == {"core": [-1], "rim": [-2], "outside": [-2]}
    for zones in ({-1: "p43m", -2: "f43m"}, {"core": "p43m", "outside": "f43m"}, {"core": "p43m", -2: "f43m"}):
        found = zoned(path, zones)
        assert [(z.count, z.numbers) for z in (found[str(k)] for k in zones)] == [(3, [-1]), (3, [-2])]
    with pytest.raises(lt.DesignError, match=r"the mesh has a zone -2 \(rim, outside\), which has no cell; give it one"):
        zoned(path, {"core": "p43m"})


def test_families_that_were_read_keep_their_signs_and_names():
    """As the reader of MED leaves them; without the package that opens the file."""
    meshio = pytest.importorskip("meshio")
    points, cells = halves()
    mesh = meshio.Mesh(points, cells, cell_data={"cell_tags": [np.array([-1, -1, -1, -2, -2, -2])]})
    mesh.cell_tags = {-1: ["core"], -2: ["rim", "outside"]}
    zones, names = elements.zones_of(mesh, [0])
    assert zones.tolist() == [-1, -1, -1, -2, -2, -2] and names == [(-1, "core"), (-2, "rim"), (-2, "outside")]
    # A set across the families: what it has of one gets a number of its own, under the family's names too.
    mesh.cell_sets = {"top": [np.array([0, 5])]}
    zones, names = elements.zones_of(mesh, [0])
    of = {name: {n for n, other in names if other == name} for _, name in names}
    for name, wanted in {"core": [0, 1, 2], "-1": [0, 1, 2], "rim": [3, 4, 5], "outside": [3, 4, 5], "top": [0, 5]}.items():
        assert np.flatnonzero(np.isin(zones, list(of[name]))).tolist() == wanted, (name, zones, names)


def test_physical_groups_are_zones_by_name(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, cells = halves()
    path = tmp_path / "cube.msh"
    tags = [np.array([4, 4, 4, 7, 7, 7])]
    groups = {"core": np.array([4, 3]), "rim": np.array([7, 3]), "face": np.array([4, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(path, meshio.Mesh(points, cells, cell_data=data, field_data=groups), file_format="gmsh22", binary=False)
    assert lt.TetMesh.read(path).zone_names == {"core": [4], "rim": [7]}
    assert [z.count for z in zoned(path, {"core": "p43m", 7: "f43m"}).values()] == [3, 3]


def test_a_skin_is_no_share_of_the_lattice():
    """What is solid anyway does not make steps too coarse."""
    lattice = lt.Lattice(cell=lt.cell.tet("diamond"), part="lower", map=lt.map.tets(size=5), level=lt.level.fraction(0.25))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(tetrahedra|void|powder)")
        solid = lt.Design(region=lt.region.sphere(radius=8), lattice={"a": lattice}, skin=lt.skin(0.8)).build()
        solid.mesh(edge=0.3)


def test_coarse_steps_are_warned_of_with_the_step_that_suffices():
    """A network that falls apart between the steps of its tetrahedra, and is whole and as full as asked at the step named."""
    lattice = lt.Lattice(cell=lt.cell.tet("diamond"), part="lower", map=lt.map.tets(size=3), level=lt.level.fraction(0.25))
    solid = lt.Design(region=lt.region.box(size=[9, 9, 9]), lattice={"a": lattice}).build()
    with pytest.warns(lt.DesignWarning, match="too coarse") as found:
        coarse = solid.mesh(edge=0.7)
    (words,) = (str(w.message) for w in found if "too coarse" in str(w.message))
    whole = 9**3
    off = coarse.volume / whole / 0.25 - 1
    assert f"({100 * off:+.1f} %)" in words
    enough = float(words.split("use an edge of ")[1].split()[0])
    assert enough > 0.15
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine = solid.mesh(edge=enough)
    assert fine.islands.found == 0 and abs(fine.volume / whole / 0.25 - 1) < 0.01


def test_layers_lie_along_the_face_that_they_are_asked_for_on(tmp_path):
    top = lt.region.box(min=[-9, -9, 3.9], max=[9, 9, 4.1])
    layers = {"count": 2, "height": 1.2, "growth": 1.25, "on": top}
    made = {"region": lt.region.box(size=[12, 12, 8]), "lattice": {"core": {"map": lt.map.tets(size=4, layers=layers)}}}
    mesh = lt.TetMesh.of(made)
    found = mesh.report()["layers"]
    assert found["least"] == found["mean"] == 1.0 and found["prisms"] > 0
    z = mesh.nodes[:, 2]
    for depth in (0, 1.2, 2.7):  # as many nodes at the end of each layer as on the face
        assert (abs(z - (4 - depth)) < 1e-9).sum() == (z == 4).sum()
    thin = lt.TetMesh.of(
        made
        | {"region": lt.region.box(size=[12, 12, 3])}
        | {"lattice": {"core": {"map": lt.map.tets(size=4, layers={"count": 2, "height": 1.2})}}}
    )
    assert any("leave no more room" in w["message"] for w in thin.report()["warnings"])
    design = tmp_path / "design.toml"
    design.write_text(DESIGN + 'mesher = "ftetwild"\nlayers = { count = 1, height = 0.3 }\n')
    assert 'layers go with mesher = "background"' in command("tets", design, expected=1)[1]
    design.write_text(DESIGN + "layers = { count = 1, height = 0.3, on = { box = { min = [8, 8, 8], max = [9, 9, 9] } } }\n")
    assert "no triangle of the boundary has its middle in this region" in command("tets", design, expected=1)[1]


@pytest.mark.parametrize("hole", [0, 6])
def test_layers_all_over_a_part_with_edges_have_no_flat_tetrahedra(hole):
    """Columns that meet at a sharp edge are tilted and shortened, and it is said on which share of the area they are lower."""
    region = lt.region.cylinder(base=[0, 0, 0], radius=12, height=20)
    if hole:
        region = lt.region.difference(region, lt.region.cylinder(base=[0, 0, -1], radius=hole, height=22))
    tets = {"region": region, "lattice": {"core": {"map": lt.map.tets(size=3, layers={"count": 2, "height": 1.0})}}}
    report = lt.TetMesh.of(tets).report()
    angles, found = report["quality"]["dihedral"], report["layers"]
    assert angles["min"] > 8 and angles["max"] < 164
    assert 0 < found["least"] < found["mean"] < 1 and found["mean"] > 0.75 and 0.05 < found["lower"] < 0.6
    said = [w["message"] for w in report["warnings"] if w["path"].endswith("layers")]
    assert len(said) == 1 and f"on {100 * found['lower']:.0f} % of their area" in said[0]


def test_triangles_within_a_part_are_no_surface_to_be_near(tmp_path):
    """Two boxes that overlap, in one file: the fit is that of their union."""
    trimesh = pytest.importorskip("trimesh")
    boxes = [trimesh.creation.box([10, 10, 10]), trimesh.creation.box([10, 10, 10])]
    boxes[1].apply_translation([5, 4, 3])
    trimesh.util.concatenate(boxes).export(tmp_path / "two.stl")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lt.DesignWarning)
        part = lt.region.mesh(str(tmp_path / "two.stl"))
        found = lt.TetMesh.of({"region": part, "lattice": {"core": {"map": lt.map.tets(size=4)}}}).report()
    assert found["fit"]["from_part"]["max"] < 4 / 8 and found["fit"]["lost"] == []  # less than what counts as lost
