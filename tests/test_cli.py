"""The command: what it prints, its exit status, and that nothing is left behind."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import trabecula as lt
from conftest import CUBE

COMMAND = [sys.executable, "-m", "trabecula"]


def run(*words, cwd, status=0):
    """Runs the command and checks its exit status; gives what it printed."""
    done = subprocess.run([*COMMAND, *map(str, words)], cwd=cwd, capture_output=True, text=True, timeout=300)
    assert done.returncode == status, f"{words}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    assert "Traceback" not in done.stderr
    return done


def names(folder):
    """The files in a folder."""
    return sorted(p.name for p in folder.iterdir())


def test_help_is_light(tmp_path):
    """Help starts without numpy."""
    code = "import sys, trabecula.command.cli as c\ntry: c.main(['--help'])\nexcept SystemExit: pass\n"
    code += "assert 'numpy' not in sys.modules, sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    for command in ("new", "check", "mesh", "voxels", "measure", "cells", "render"):
        assert "example" in run(command, "--help", cwd=tmp_path).stdout


def test_starter_meshes_at_once(tmp_path):
    """`new` writes a design that the other commands take."""
    run("new", "a.toml", "--cell", "diamond", cwd=tmp_path)
    report = json.loads(run("check", "a.toml", "--json", cwd=tmp_path).stdout)
    assert abs(report["lattices"]["core"]["fraction"] - 0.3) < 1e-12
    run("mesh", "a.toml", "-o", "a.STL", "--edge", "0.25", cwd=tmp_path)
    figures = json.loads(run("measure", "a.STL", "--region", "a.toml", "--json", cwd=tmp_path).stdout)
    assert figures["closed"] and abs(figures["solid_fraction"] - 0.3) < 2e-3
    assert "exists" in run("new", "a.toml", cwd=tmp_path, status=1).stderr
    run("new", "a.toml", "--force", cwd=tmp_path)
    assert '"gyroid"' in run("new", "b.toml", "--cell", "gyriod", cwd=tmp_path, status=1).stderr
    run("new", "c/c.toml", "--schema", cwd=tmp_path, status=1)
    (tmp_path / "c").mkdir()
    run("new", "c/c.toml", "--schema", cwd=tmp_path)
    assert (tmp_path / "c" / "c.toml").read_text().startswith("#:schema ./design-schema.json\n")
    assert (tmp_path / "c" / "design-schema.json").read_text() == run("schema", cwd=tmp_path).stdout
    run("check", "c/c.toml", cwd=tmp_path)
    assert names(tmp_path) == ["a.STL", "a.toml", "c"]


@pytest.mark.parametrize("words", [(), ("--cell", "diamond"), ("--beams", "octet"), ("--beams", "bcc", "--skin", "0.8")])
def test_starter_fills_a_part(words, tmp_path):
    """The part is found from the design's folder, wherever the command runs; at least four cells go through it."""
    corners = np.array([[x, y, z] for x in (0, 30) for y in (0, 12) for z in (0, 20)], float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    lt.Mesh.of(corners, [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]).write(tmp_path / 'it\'s "a part".stl')
    (tmp_path / "designs").mkdir()
    run("new", "designs/a.toml", "--part", 'it\'s "a part".stl', *words, cwd=tmp_path)
    report = json.loads(run("check", "designs/a.toml", "--json", cwd=tmp_path).stdout)
    assert np.allclose(np.ptp(report["region"]["bounds"], axis=0), [30, 12, 20], atol=0.01)
    made = lt.load(tmp_path / "designs" / "a.toml")
    assert (made.beams if "--beams" in words else made.lattice)["core"].map["affine"]["wavelength"] == 3
    assert (made.skin is not None) == ("--skin" in words)


def test_starter_refuses_what_is_no_part(tmp_path):
    (tmp_path / "bad.stl").write_text("nothing")
    assert "bad.stl: 7 bytes" in run("new", "a.toml", "--part", "bad.stl", cwd=tmp_path, status=1).stderr
    assert "does not exist" in run("new", "a.toml", "--part", "none.stl", cwd=tmp_path, status=1).stderr
    assert 'did you mean "octet"' in run("new", "a.toml", "--beams", "octett", cwd=tmp_path, status=1).stderr
    assert "greater than 0" in run("new", "a.toml", "--skin", "-1", cwd=tmp_path, status=2).stderr
    assert names(tmp_path) == ["bad.stl"]


def test_check_prints_the_figures(tmp_path, cube):
    """The keys of the report."""
    report = json.loads(run("check", cube, "--json", cwd=tmp_path).stdout)
    it = report["lattices"]["core"]
    assert {"iso", "fraction", "porosity", "thickness", "connected_fraction"} <= set(it)
    assert abs(it["iso"] - 0.463951958) < 1e-4
    assert abs(it["fraction"] + it["porosity"] - 1) < 1e-12
    assert 0.3 < it["thickness"] < 0.8
    assert report["warnings"] == []
    text = run("check", cube, cwd=tmp_path)
    assert "iso" in text.stdout and text.stderr == ""


def test_a_network_that_falls_apart_is_warned_of(tmp_path, cube):
    """A primitive network at 20 % is loose pieces: its limit is 0.2133."""
    cube.write_text(CUBE.replace("gyroid", "primitive").replace("sheet", "lower").replace("0.3", "0.2"))
    done = run("check", cube, "--json", cwd=tmp_path)
    (warning,) = json.loads(done.stdout)["warnings"]
    assert warning["path"] == "lattice.core.level.fraction"
    assert "0.2133" in warning["message"]
    assert "warning" in run("mesh", cube, "-o", "a.stl", "--edge", "0.5", cwd=tmp_path).stderr


def test_a_varying_level_is_reported_as_a_range(tmp_path, cube):
    """[min, max] where it varies."""
    cube.write_text(
        CUBE.replace("fraction = 0.3", "fraction = { linear = { along = [0, 0, 1], stops = [[-4, 0.2], [4, 0.4]] } }")
    )
    it = json.loads(run("check", cube, "--json", cwd=tmp_path).stdout)["lattices"]["core"]
    for key, low, high in (("fraction", 0.2, 0.4), ("porosity", 0.6, 0.8), ("iso", 0.31, 0.62)):
        assert abs(it[key][0] - low) < 0.005 and abs(it[key][1] - high) < 0.005, (key, it[key])
    assert it["thickness"][0] < it["thickness"][1]


@pytest.mark.parametrize("name", ["a.stl", "a.3MF", "a.ply", "a.Obj"])
def test_formats_agree(tmp_path, cube, name):
    """Each format, read back, has the same figures; every figure is there."""
    summary = json.loads(run("mesh", cube, "-o", name, "--edge", "0.4", "--json", cwd=tmp_path).stdout)
    figures = json.loads(run("measure", name, "--json", cwd=tmp_path).stdout)
    keys = "volume area area_lattice area_cut solid_fraction porosity euler pieces cavities voids closed bounds"
    keys += " specific_surface hydraulic_diameter self_intersections quality defects warnings"
    assert list(figures) == keys.split()
    assert figures["porosity"] is None and figures["solid_fraction"] is None
    assert figures["closed"] and figures["cavities"] == 0
    assert abs(figures["volume"] / summary["volume"] - 1) < 1e-5
    design = json.loads(run("measure", cube, "--edge", "0.4", "--json", cwd=tmp_path).stdout)
    assert (design["euler"], design["pieces"]) == (figures["euler"], figures["pieces"])
    assert abs(design["solid_fraction"] - design["volume"] / 512) < 1e-9
    assert abs(design["area_lattice"] + design["area_cut"] - design["area"]) < 1e-6 * design["area"]
    within = json.loads(run("measure", name, "--region", cube, "--json", cwd=tmp_path).stdout)
    assert abs(within["area_cut"] / design["area_cut"] - 1) < 1e-3
    assert abs(within["solid_fraction"] / design["solid_fraction"] - 1) < 1e-5
    assert names(tmp_path) == sorted([name, "cube.toml"])


def test_threads_do_not_change_a_byte(tmp_path, cube):
    """Same design, same bytes."""
    for name in ("one", "three"):
        threads = {"one": 1, "three": 3}[name]
        run("mesh", cube, "-o", f"{name}.stl", "--edge", "0.3", "--threads", threads, cwd=tmp_path)
    assert (tmp_path / "one.stl").read_bytes() == (tmp_path / "three.stl").read_bytes()


def test_an_open_mesh_has_the_area_of_its_file(tmp_path, cube):
    reported = json.loads(run("mesh", "cube.toml", "-o", "a.stl", "--edge", "0.5", "--open", "--json", cwd=tmp_path).stdout)
    assert reported["open"] and reported["area"] == pytest.approx(lt.Mesh.read(tmp_path / "a.stl").area, rel=1e-5)


def test_voxels_and_pictures(tmp_path, cube):
    """NPY, VTI and PNG."""
    import numpy as np

    # A step that does not divide the cell, so that voxels do not meet every cell at the same few places.
    summary = json.loads(run("voxels", cube, "-o", "a.npy", "--step", "0.13", "--json", cwd=tmp_path).stdout)
    grid = np.load(tmp_path / "a.npy")
    assert list(grid.shape) == summary["shape"] == [62, 62, 62]
    assert abs(grid.mean() - 0.3) < 0.01
    run("voxels", cube, "-o", "a.vti", "--step", "0.5", cwd=tmp_path)
    assert (tmp_path / "a.vti").read_bytes().startswith(b"<?xml")
    run("render", cube, "-o", "a.png", "--size", "160x120", "--edge", "0.5", cwd=tmp_path)
    head = (tmp_path / "a.png").read_bytes()[:24]
    assert head.startswith(b"\x89PNG") and int.from_bytes(head[16:20], "big") == 160


def test_cells(tmp_path):
    """The list and one cell."""
    listed = json.loads(run("cells", "--json", cwd=tmp_path).stdout)
    assert {"gyroid", "gyroid_mirrored", "diamond", "primitive", "iwp", "neovius", "frd"} <= {c["name"] for c in listed}
    one = json.loads(run("cells", "gyroid", "--json", cwd=tmp_path).stdout)
    assert abs(one["range"][1] - 1.5) < 1e-9
    assert "gyroid" in run("cells", cwd=tmp_path).stdout
    assert '"diamond"' in run("cells", "diamnd", cwd=tmp_path, status=1).stderr


@pytest.mark.parametrize(
    ("words", "status", "part"),
    [
        (["mesh", "cube.toml"], 2, "-o"),
        (["mesh", "cube.toml", "-o", "a.xyz"], 2, ".stl, .3mf, .ply, .obj"),
        (["mesh", "cube.toml", "-o", "a"], 2, ".stl"),
        (["mesh", "cube.toml", "-o", "a.stl", "--edge", "nan"], 2, "nan"),
        (["mesh", "cube.toml", "-o", "a.stl", "--edge", "-1"], 2, "-1"),
        (["mesh", "cube.toml", "-o", "a.stl", "--edge", "0"], 2, "greater than 0"),
        (["mesh", "cube.toml", "-o", "a.stl", "--edge", "inf"], 2, "inf"),
        (["mesh", "cube.toml", "-o", "a.stl", "--per-cell", "0"], 2, "at least 2"),
        (["mesh", "cube.toml", "-o", "a.stl", "--per-cell", "32", "--edge", "1"], 2, "not allowed with"),
        (["mesh", "cube.toml", "-o", "a.stl", "--threads", "0"], 2, "1 to 4096"),
        (["mesh", "cube.toml", "-o", "a.stl", "--threads", "1.5"], 2, "whole number"),
        (["mesh", "cube.toml", "-o", "a.stl", "--threads", "9" * 400], 2, "from 1 to 4096, found 999"),
        (["volume", "cube.toml", "-o", "a.inp", "--edge", "1e-120"], 1, "edge 1e-120 mm makes about inf tetrahedra"),
        (["volume", "cube.toml", "-o", "a.inp", "--voxels", "1e-300"], 1, "step 1e-300 mm needs about inf TB"),
        (["volume", "cube.toml", "-o", "a.inp", "--voxels", "1", "--least", "0"], 1, "greater than 0"),
        (["render", "cube.toml", "-o", "a.png", "--section", "z>100"], 1, "leaves nothing"),
        (["render", "cube.toml", "-o", "a.png", "--section", "z=100"], 1, "cuts nothing off"),
        (["render", "cube.toml", "-o", "a.png", "--elevation", "200"], 2, "from -90 to 90"),
        (["render", "cube.toml", "-o", "a.png", "--seconds", "3"], 2, "give --turn too"),
        (["render", "cube.toml", "-o", "a.png", "--scale-bar"], 2, "needs --projection orthographic"),
        (["mesh", "cube.stl", "-o", "a.stl"], 2, ".toml, .json"),
        (["mesh", "none.toml", "-o", "a.stl"], 1, "does not exist"),
        (["mesh", "folder.toml", "-o", "a.stl"], 1, "is a directory"),
        (["mesh", "cube.toml", "-o", "folder.stl"], 1, "is a directory"),
        (["mesh", "cube.toml", "-o", "none/a.stl"], 1, "does not exist"),
        (["mesh", "cube.toml", "-o", "a.stl", "--edge", "1e-9"], 1, "1e-09"),
        (["mesh", "cube.toml", "-o", "a.3mf", "--edge", "2e-4"], 1, "try edge"),
        (["measure", "empty.stl"], 1, "empty.stl"),
        (["measure", "garbage.stl"], 1, "garbage.stl"),
        (["measure", "garbage.ply"], 1, "garbage.ply"),
        (["measure", "none.stl"], 1, "does not exist"),
        (["measure", "folder.stl"], 1, "is a directory"),
        (["measure", "cube.toml", "--region", "none.toml"], 1, "does not exist"),
        (["voxels", "cube.toml", "-o", "a.raw"], 2, ".npy, .vti"),
        (["voxels", "cube.toml", "-o", "a.npy", "--step", "1e-5"], 1, "try step"),
        (["render", "cube.toml", "-o", "a.jpg"], 2, ".png"),
        (["render", "cube.toml", "-o", "a.png", "--size", "0x5"], 2, "WIDTHxHEIGHT"),
        (["new", "cube.txt"], 2, ".toml"),
        (["new", "none/a.toml"], 1, "does not exist"),
        (["moosh"], 2, "no command is named moosh; did you mean mesh?"),
        (["--quiet", "xyz"], 2, "There are: new, check, mesh"),
        ([], 2, "usage"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, list) else None,
)
def test_bad_requests(tmp_path, cube, words, status, part):
    """One clear line, the right status, nothing left behind."""
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "empty.stl").write_bytes(b"")
    (tmp_path / "garbage.stl").write_bytes(bytes(range(256)) * 3)
    (tmp_path / "garbage.ply").write_bytes(b"ply\nnonsense")
    before = names(tmp_path)
    done = run(*words, cwd=tmp_path, status=status)
    assert part in done.stderr, done.stderr
    assert done.stdout == ""
    assert words == [] or len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert names(tmp_path) == before


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(tmp_path, cube):
    """Said before any work."""
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o555)
    done = run("mesh", cube, "-o", locked / "a.stl", cwd=tmp_path, status=1)
    assert "cannot be written" in done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk(tmp_path, cube):
    """An error of the system while writing is one line."""
    code = (
        "import os, sys, trabecula.base.files as o, trabecula.command.cli as c, contextlib\n"
        "@contextlib.contextmanager\n"
        "def full(path):\n    yield '/dev/full'\n"
        "import trabecula.saved as m; m.whole_file = full\n"
        f"sys.exit(c.main(['mesh', {str(cube)!r}, '-o', 'a.ply', '--edge', '0.5']))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "No space left" in done.stderr and "Traceback" not in done.stderr, done.stderr


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", ["a.stl", "a.ply"])
def test_interrupted(tmp_path, cube, which, name):
    """Ctrl-C in the middle: a quick end, no file, no half file; an older file stays as it was."""
    cube.write_text(CUBE.replace("[8, 8, 8]", "[40, 40, 40]"))
    (tmp_path / name).write_text("older")
    words = [*COMMAND, "mesh", str(cube), "-o", name, "--edge", "0.06", "--progress"]
    # A shell that starts tests in the background has them ignore Ctrl-C, and children inherit that.
    default = lambda: signal.signal(signal.SIGINT, signal.default_int_handler)  # noqa: E731
    child = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True, preexec_fn=default)
    assert "meshing" in child.stderr.readline()  # it is in the middle
    start = time.perf_counter()
    child.send_signal(which)
    rest = child.stderr.read()
    assert child.wait(timeout=60) == 130
    assert time.perf_counter() - start < 10
    assert "stopped" in rest and "Traceback" not in rest
    assert names(tmp_path) == sorted([name, "cube.toml"])
    assert (tmp_path / name).read_text() == "older"


def test_an_older_file_survives_a_refusal(tmp_path, cube):
    """Files are replaced when the new one is whole."""
    (tmp_path / "a.stl").write_text("older")
    cube.write_text(CUBE.replace("0.3", "1.3"))
    run("mesh", cube, "-o", "a.stl", cwd=tmp_path, status=1)
    assert (tmp_path / "a.stl").read_text() == "older"


def test_what_a_design_reads_is_kept(tmp_path, cube):
    """No output takes the place of a file that the design is made from, wherever it is named."""
    run("mesh", cube, "-o", "cell.stl", "--edge", "1", cwd=tmp_path)
    made = (tmp_path / "cell.stl").read_bytes()
    text = 'schema = 1\n[region.box]\nsize = [8, 8, 8]\n[lattice.a]\ncell.file.path = "cell.stl"\npart = "lower"\n'
    (tmp_path / "a.toml").write_text(text + "map.affine.wavelength = 4\nlevel.fraction = 0.3\n")
    reported = run("mesh", "a.toml", "-o", "cell.stl", "--edge", "1", cwd=tmp_path, status=1).stderr
    assert "read by this design" in reported and (tmp_path / "cell.stl").read_bytes() == made


def test_output_can_be_closed_early(tmp_path):
    """A pipe that ends is no mistake."""
    done = subprocess.run(f"{' '.join(COMMAND)} cells | head -n 1", shell=True, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout and "Traceback" not in done.stderr and "rror" not in done.stderr


def test_version_is_quiet_where_nobody_reads(tmp_path):
    """`trabecula --version >&-`, and into a pipe that ends."""
    words = " ".join(COMMAND)
    for line in (f"{words} --version >&-", f"{words} --version | true", f"{words} --help | true"):
        done = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True)
        assert done.stderr == "", line


UNIX = pytest.mark.skipif(os.name == "nt", reason="signals and links of Unix")


@UNIX
def test_interrupted_while_it_starts(tmp_path, cube):
    """Ctrl-C during the imports: one line, whatever was being imported."""
    code = (
        "import os, signal, sys\n"
        "which = sys.argv[1]\n"
        "class Now:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == which: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Now())\n"
        f"sys.argv[1:] = [sys.argv[2], {str(cube)!r}, '-o', sys.argv[3]]\n"
        "from trabecula.__main__ import main\n"
        "sys.exit(main())"
    )
    default = lambda: signal.signal(signal.SIGINT, signal.default_int_handler)  # noqa: E731
    mesh = ("mesh", "a.stl")
    starts = {"argparse": mesh, "trabecula._core": mesh, "trabecula.mesh": mesh, "trabecula.solid": mesh}
    for name, rest in {**starts, "numpy": ("voxels", "a.npy")}.items():
        words = [sys.executable, "-c", code, name, *rest]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, preexec_fn=default)
        assert (done.returncode, done.stderr) == (130, "stopped; nothing was left behind\n"), name
    assert names(tmp_path) == ["cube.toml"]


@UNIX
def test_interrupted_after_the_file_is_whole(tmp_path, cube):
    """Then it is said to be there."""
    code = (
        "import sys, os, signal, trabecula.base.files as o, trabecula.command.cli as c\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "usual = os.replace\n"
        "def replace(*names):\n    usual(*names); os.kill(os.getpid(), signal.SIGINT)\n"
        "os.replace = replace\n"
        f"sys.exit(c.main(['mesh', {str(cube)!r}, '-o', 'a.ply', '--edge', '0.2']))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (130, "stopped; a.ply is written")
    assert names(tmp_path) == ["a.ply", "cube.toml"]


@UNIX
def test_a_killed_run_leaves_no_output(tmp_path, cube):
    """Nothing under the final name: an older file stays as it was."""
    cube.write_text(CUBE.replace("[8, 8, 8]", "[60, 60, 60]"))
    (tmp_path / "a.stl").write_text("older")
    words = [*COMMAND, "mesh", str(cube), "-o", "a.stl", "--edge", "0.1", "--progress"]
    child = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    assert "meshing" in child.stderr.readline()
    child.kill()
    child.wait()
    assert (tmp_path / "a.stl").read_text() == "older"


@UNIX
def test_links_permissions_and_devices(tmp_path, cube):
    """An output keeps being what it was."""
    (tmp_path / "deep").mkdir()
    target, link = tmp_path / "deep" / "real.stl", tmp_path / "a.stl"
    target.write_text("older")
    target.chmod(0o640)
    link.symlink_to("deep/real.stl")
    run("mesh", cube, "-o", "a.stl", "--edge", "0.5", cwd=tmp_path)
    assert link.is_symlink() and target.stat().st_size > 1000 and target.stat().st_mode & 0o777 == 0o640
    target.unlink()
    run("mesh", cube, "-o", "a.stl", "--edge", "0.5", cwd=tmp_path)
    assert link.is_symlink() and target.stat().st_size > 1000
    size = target.stat().st_size
    target.chmod(0o444)
    assert "read-only" in run("mesh", cube, "-o", "a.stl", "--edge", "0.4", cwd=tmp_path, status=1).stderr
    assert target.stat().st_size == size
    link.unlink()
    link.symlink_to("a.stl")
    assert "leads nowhere" in run("mesh", cube, "-o", "a.stl", cwd=tmp_path, status=1).stderr
    for device in ("null", "stdout"):
        for kind in ("stl", "ply", "npy"):
            name = tmp_path / f"{device}.{kind}"
            name.symlink_to(f"/dev/{device}")
            words = ["voxels" if kind == "npy" else "mesh", str(cube), "-o", name.name]
            words += ["--step" if kind == "npy" else "--edge", "0.5"]
            done = subprocess.run([*COMMAND, *words], cwd=tmp_path, capture_output=True)
            assert done.returncode == 0 and name.is_symlink(), done.stderr
            assert (len(done.stdout) > 1000) == (device == "stdout")
    assert names(tmp_path / "deep") == ["real.stl"]


@UNIX
def test_names_that_are_no_unicode(tmp_path, cube):
    """Bytes that are no UTF-8, in every format."""
    for kind in (b"stl", b"3mf", b"ply", b"obj"):
        out = os.fsencode(tmp_path) + b"/\xff\xe4." + kind
        words = [*map(os.fsencode, COMMAND), b"mesh", os.fsencode(cube), b"-o", out, b"--edge", b"0.5"]
        done = subprocess.run(words, capture_output=True)
        assert done.returncode == 0 and os.path.getsize(out) > 1000, done.stderr


@UNIX
def test_what_has_no_end_is_not_read(tmp_path, cube):
    """Devices, pipes, directories, as a mesh, a design and a region's file: one line, at once."""
    os.mkfifo(tmp_path / "pipe.stl")
    (tmp_path / "zero.stl").symlink_to("/dev/zero")
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    with (tmp_path / "sparse.stl").open("wb") as file:
        file.truncate(1 << 42)
    for name in ("pipe.stl", "zero.stl", "folder.stl", "sparse.stl"):
        cube.write_text(CUBE.replace("[region.box]\nsize = [8, 8, 8]", f"[region.mesh]\npath = '{name}'"))
        for words in (["measure", name], ["check", cube], ["measure", name, "--region", name]):
            done = run(*words, cwd=tmp_path, status=1)
            assert len(done.stderr.splitlines()) == 1 and name in done.stderr
    assert "device" in run("check", "zero.toml", cwd=tmp_path, status=1).stderr


def test_memory_that_a_limit_leaves(tmp_path, cube):
    """`ulimit -v`: refused with the edge to use, not killed half-way."""
    resource = pytest.importorskip("resource")
    if not os.path.exists("/proc/self/limits"):
        pytest.skip("the system does not tell")
    cube.write_text(CUBE.replace("[8, 8, 8]", "[60, 60, 60]"))
    limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))  # noqa: E731
    # Smoothing holds the mesh.
    words = [*COMMAND, "mesh", str(cube), "-o", "a.ply", "--edge", "0.08", "--threads", "1", "--smooth"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, preexec_fn=limit)
    assert done.returncode == 1 and "of memory" in done.stderr and "try edge" in done.stderr, done.stderr


@pytest.mark.parametrize("limit", [60, 100, 200, 300, 700])
@pytest.mark.parametrize("name", ["a.stl", "a.3mf"])
def test_a_limit_of_address_space(tmp_path, cube, limit, name):
    """`ulimit -v`: a mesh, or one sentence and status 1; never an abort, nor a file that is left."""
    resource = pytest.importorskip("resource")
    most = lambda: resource.setrlimit(resource.RLIMIT_AS, (limit * 10**6, limit * 10**6))  # noqa: E731
    words = [*COMMAND, "mesh", str(cube), "-o", name, "--edge", "0.2"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, preexec_fn=most)
    if limit >= 512:  # for one thread that is enough
        assert done.returncode == 0 and (tmp_path / name).exists(), done.stderr
        return
    assert done.returncode == 1 and "address space" in done.stderr, done.stderr
    assert len(done.stderr.splitlines()) == 1 and names(tmp_path) == ["cube.toml"]


def test_a_design_is_measured_as_its_mesh_is(tmp_path, cube):
    """Tile by tile: the figures of the file; what is not looked for is named."""
    run("mesh", cube, "-o", "a.ply", "--edge", "0.2", cwd=tmp_path)
    found = json.loads(run("measure", cube, "--edge", "0.2", "--json", cwd=tmp_path).stdout)
    file = json.loads(run("measure", "a.ply", "--region", cube, "--json", cwd=tmp_path).stdout)
    assert found["by_construction"] == ["self_intersections", "defects"]
    assert [file[key] for key in found["by_construction"]] == [found[key] for key in found["by_construction"]] == [0, []]
    for key in ("euler", "pieces", "cavities", "closed"):
        assert found[key] == file[key]
    # The file has single precision.
    assert abs(found["volume"] / file["volume"] - 1) < 1e-6 and abs(found["area"] / file["area"] - 1) < 1e-6
    assert abs(found["volume"] / (0.3 * 512) - 1) < 3 * found["volume_error"] + 1e-5


def test_measures_of_odd_meshes(tmp_path):
    """Inside out, touching in a vertex or an edge, open: said in words."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    quads = ((1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6))

    def cube_at(shift=(0, 0, 0), first=0, turn=1, faces=6):
        points = "".join(f"v {x + shift[0]} {y + shift[1]} {z + shift[2]}\n" for x, y, z in corners)
        return points + "".join(f"f {' '.join(str(v + first) for v in q[::turn])}\n" for q in quads[:faces])

    def measured(text):
        (tmp_path / "a.obj").write_text(text)
        done = run("measure", "a.obj", "--json", cwd=tmp_path)
        return json.loads(done.stdout), done.stderr

    made, words = measured(cube_at(turn=-1))
    assert (made["volume"], made["closed"], made["pieces"], made["cavities"]) == (-1, True, 0, 1)
    assert "inside out" in words
    assert "inside out" in run("measure", "a.obj", cwd=tmp_path).stdout
    made, words = measured(cube_at() + cube_at((1, 1, 1), 8))
    assert (made["volume"], made["closed"], made["pieces"], made["euler"], words) == (2, True, 2, 3, "")
    made, words = measured(cube_at() + cube_at((1, 1, 0), 8))
    assert (made["volume"], made["closed"], made["pieces"]) == (2, False, 2)
    assert "1 edge with more than two" in words
    made, words = measured(cube_at(faces=5))
    assert not made["closed"] and "4 edges with one triangle" in words
    for name, content in {"e.obj": "", "e.off": "OFF\n0 0 0\n", "e.ply": "", "e.toml": "", "e.obj ": "v 0 0 0\n"}.items():
        (tmp_path / name.strip()).write_text(content)
        run("measure", name.strip(), cwd=tmp_path, status=1)


def test_voxels_and_meshes_that_are_too_coarse(tmp_path, cube):
    """Thin walls, and a result that has little to do with the design, are reported with the step to use."""
    cube.write_text(CUBE.replace("0.3", "0.05"))
    done = run("voxels", cube, "-o", "a.npy", "--step", "0.5", cwd=tmp_path)
    assert "thinnest wall" in done.stderr and "use a step of" in done.stderr
    cube.write_text(CUBE.replace("0.3", "0.5"))
    for words in (["a.stl", "--edge", "1"], ["a.ply", "--edge", "1"]):
        done = run("mesh", cube, "-o", *words, cwd=tmp_path)
        assert "the grid is too coarse" in done.stderr and "use an edge of" in done.stderr
    assert "coarse" not in run("mesh", cube, "-o", "a.stl", "--edge", "0.2", cwd=tmp_path).stderr


def test_check_tells_how_far_cells_are_from_what_was_asked_for(tmp_path):
    turning = {"phase": {"wavelength": 4, "rotate_z": {"linear": {"along": [1, 0, 0], "stops": [[0, 0], [16, 30]]}}}}
    lattice = {"cell": "gyroid", "part": "sheet", "map": turning, "level": {"fraction": 0.3}}
    design = {"schema": 1, "region": {"box": {"min": [0, 0, 0], "max": [16, 16, 16]}}, "lattice": {"a": lattice}}
    (tmp_path / "a.json").write_text(json.dumps(design))
    report = json.loads(run("check", "a.json", "--json", cwd=tmp_path).stdout)["lattices"]["a"]["distortion"]
    text = run("check", "a.json", cwd=tmp_path).stdout
    worst = max(a["max"] for a in report["angle"])
    assert 1 < worst < 20 and f"{worst:.1f}° at most" in text
    # 30 degrees over 16 mm are 7.5 in a cell of 4 mm.
    assert abs(report["turn"] - 7.5) < 0.5 and f"{report['turn']:.1f}° per cell" in text


@pytest.mark.parametrize("kind", ["many", "fine"])
def test_long_series_are_checked(tmp_path, kind):
    """Many terms, or high indices."""
    import random

    pick = random.Random(3)
    top = {"many": 6, "fine": 48}[kind]
    hkl = [[pick.randint(-top, top) or 1 for _ in range(3)] for _ in range({"many": 500, "fine": 6}[kind])]
    terms = [{"hkl": h, "amplitude": pick.uniform(-1, 1), "phase": pick.random()} for h in hkl]
    lattice = {"cell": {"series": {"terms": terms}}, "part": "sheet", "map": {"affine": {"wavelength": 4}}}
    design = {"schema": 1, "region": {"box": {"size": [8, 8, 8]}}, "lattice": {"a": {**lattice, "level": {"fraction": 0.3}}}}
    (tmp_path / "a.json").write_text(json.dumps(design))
    report = json.loads(run("check", "a.json", "--json", cwd=tmp_path).stdout)
    reported = [w["message"] for w in report["warnings"] if "rough" in w["message"]]
    assert bool(reported) == (kind == "fine")


def test_cells_of_every_list_are_found_by_name(tmp_path):
    """`cells NAME` says the same with and without the option that names the list."""
    shown = run("cells", "octet", "--json", cwd=tmp_path).stdout
    assert shown == run("cells", "octet", "--beams", "--json", cwd=tmp_path).stdout and json.loads(shown)["name"] == "octet"

    for name in sorted(set(lt.cell.tet_names()) - set(lt.cell.names()))[:1]:  # a name of both lists is the periodic cell's
        assert run("cells", name, cwd=tmp_path).stdout == run("cells", name, "--tet", cwd=tmp_path).stdout
