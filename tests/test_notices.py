"""Warnings of the command: on stderr, in the figures, left out or refused, whatever the environment says."""

import io
import json
import os
import subprocess
import sys
import warnings
from dataclasses import replace

import pytest
import trabecula as lt
from conftest import CUBE
from test_cli import COMMAND, names, run
from test_islands import BALLS

#: A sheet of walls 0.37 mm thick; a step of 0.5 mm is too coarse for it, as the warning says.
COARSE = ("--edge", "0.5")
LATTICE = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=4), level=lt.level.fraction(0.3))
DESIGN = lt.Design(region=lt.region.box(size=[7.9, 7.9, 7.9]), lattice=LATTICE)
SOLID = DESIGN.build()


def piped(text, *words, cwd, status=0, env=None):
    """The command with this on its standard input."""
    done = subprocess.run(
        [*COMMAND, *words], cwd=cwd, input=text, capture_output=True, text=True, timeout=300, env={**os.environ, **(env or {})}
    )
    assert done.returncode == status, done.stderr
    return done


@pytest.mark.parametrize(
    "words",
    [
        ("mesh", "-o", "a.stl", *COARSE),
        ("mesh", "-o", "a.3mf", *COARSE),
        ("measure", *COARSE),
        ("voxels", "-o", "a.npy", "--step", "0.5"),
    ],
    ids=" ".join,
)
def test_figures_have_the_warnings_of_the_grid(tmp_path, cube, words):
    """Thin walls are warned of in the JSON, with the path of the lattice, and on stderr; `--quiet` leaves the figures only."""
    command, *more = words
    done = run(command, cube, *more, "--json", cwd=tmp_path)
    (thin,) = [w for w in json.loads(done.stdout)["warnings"] if "thinnest wall" in w["message"]]
    assert thin["path"] == "lattice.core" and not thin["message"].startswith("lattice")
    assert f"warning: lattice.core: {thin['message']}\n" in done.stderr
    quiet = run(command, cube, *more, "--json", "--quiet", "--progress", cwd=tmp_path)
    assert quiet.stderr == ""
    assert json.loads(quiet.stdout)["warnings"] == json.loads(done.stdout)["warnings"]


def test_figures_have_the_warnings_of_design_and_islands(tmp_path):
    """A network below its limit, in pieces: both are reported, the design's with the path of the key."""
    (tmp_path / "balls.toml").write_text(BALLS)
    for name in ("a.stl", "a.3mf"):
        found = json.loads(run("mesh", "balls.toml", "-o", name, "--edge", "0.3", "--json", cwd=tmp_path).stdout)["warnings"]
        assert any("fraction" in w["path"] for w in found), found
        assert any(w["path"] == "" and "not in one piece" in w["message"] for w in found), found


@pytest.mark.parametrize("name", ["a.stl", "a.3mf"])
def test_strict_refuses_a_warning_and_writes_nothing(tmp_path, cube, name):
    """Warnings of the design before meshing, of the grid and of islands after it; an older file stays as it was."""
    (tmp_path / "balls.toml").write_text(BALLS)
    clean = BALLS.replace("fraction = 0.1", "fraction = 0.4")
    assert clean != BALLS
    (tmp_path / "clean.toml").write_text(clean)
    before = names(tmp_path)
    for words in (
        ("mesh", cube, "-o", name, *COARSE),
        ("mesh", "balls.toml", "-o", name),
        ("voxels", cube, "-o", "a.npy", "--step", "0.5"),
    ):
        done = run(*words, "--strict", "--quiet", cwd=tmp_path, status=1)
        assert "warning: " in done.stderr and "refused by --strict" in done.stderr.splitlines()[-1]
        assert names(tmp_path) == before
    (tmp_path / name).write_text("older")
    run("mesh", cube, "-o", name, *COARSE, "--strict", cwd=tmp_path, status=1)
    assert (tmp_path / name).read_text() == "older"
    run("mesh", "clean.toml", "-o", name, "--strict", "--islands", "drop", cwd=tmp_path)
    assert (tmp_path / name).read_bytes()[:5] != b"older"
    assert run("check", "balls.toml", "--strict", cwd=tmp_path, status=1).stdout == ""
    run("render", cube, "-o", "a.png", "--size", "60x50", *COARSE, "--strict", cwd=tmp_path, status=1)
    assert "a.png" not in names(tmp_path)


@pytest.mark.parametrize("asked", ["ignore", "error"])
def test_the_environment_does_not_silence_warnings(tmp_path, cube, asked):
    """PYTHONWARNINGS is for Python's own."""
    done = piped(None, "mesh", str(cube), "-o", "a.3mf", *COARSE, cwd=tmp_path, env={"PYTHONWARNINGS": asked})
    assert "warning: lattice.core: its thinnest wall" in done.stderr


def test_a_design_on_standard_input(tmp_path, cube):
    """TOML or JSON; the same figures as from a file, errors with a line, files relative to the working directory."""
    import trabecula as lt

    figures = piped(cube.read_text(), "check", "-", "--json", cwd=tmp_path).stdout
    assert figures == run("check", cube, "--json", cwd=tmp_path).stdout
    data = json.dumps(lt.load(cube).to_dict())
    assert figures == piped("\n" + data, "check", "-", "--json", cwd=tmp_path).stdout
    piped(cube.read_text(), "mesh", "-", "-o", "a.stl", "--edge", "0.4", cwd=tmp_path)
    piped(cube.read_text(), "mesh", "-", "-o", "a.stl", "--edge", "0.4", cwd=tmp_path)  # where the file exists
    piped(cube.read_text(), "measure", "-", "--edge", "0.4", "--json", cwd=tmp_path)
    part = CUBE.replace(CUBE[CUBE.index("[region.box]") : CUBE.index("[lattice")], '[region.mesh]\npath = "a.stl"\n')
    piped(part, "check", "-", cwd=tmp_path)
    assert "<stdin>:" in piped(CUBE.replace("gyroid", "gyriod"), "check", "-", cwd=tmp_path, status=1).stderr
    assert "UTF-8" in subprocess.run([*COMMAND, "check", "-"], input=b"\xff", capture_output=True, cwd=tmp_path).stderr.decode()


@pytest.mark.parametrize("start", [0.0, 3.0, 30.0])
def test_what_comes_before_the_first_step_does_not_count_in_the_time_left(monkeypatch, start):
    """Steps of equal length after a start of some seconds: from the second on, half of what is done tells their length."""
    from trabecula.base import terminal

    now = 0.0
    monkeypatch.setattr(sys, "stderr", screen := io.StringIO())
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now)
    terminal.listen(quiet=False, strict=False)
    with terminal.Progress("meshing", True) as progress:
        for done in range(1, 101):
            now = start + 0.5 * done
            progress(done, 100)
    left = [int(line.split(", ")[1].split()[0]) for line in screen.getvalue().splitlines() if "left" in line]
    assert left == [45, 40, 35, 30, 25, 20, 15, 10, 5, 0]


def test_a_warning_has_a_line_of_its_own(monkeypatch):
    """On a terminal the progress line is taken away before a message."""
    from itertools import count

    from trabecula.base import terminal

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr(sys, "stderr", screen := Terminal())
    monkeypatch.setattr(terminal.time, "monotonic", count().__next__)  # a second passes between any two calls
    terminal.listen(quiet=False, strict=False)
    with terminal.Progress("meshing", None) as progress:
        for done in range(1, 6):
            progress(done, 10)
            if done == 3:
                terminal.warn("a wall is thin", "lattice.a")
    # What a terminal shows of a line is what comes after the last return to its beginning.
    shown = [line.rstrip("\r").rsplit("\r", 1)[-1] for line in screen.getvalue().split("\n")]
    assert shown[0] == "warning: lattice.a: a wall is thin"
    assert screen.getvalue().count("meshing:") == 5
    assert shown[1].strip() == "", "nothing of the progress line is left at the end"


@pytest.mark.parametrize(
    "call",
    [
        lambda solid, place: solid.mesh(edge=0.5),
        lambda solid, place: solid.measure(edge=0.5),
        lambda solid, place: solid.parts(edge=0.5),
        lambda solid, place: solid.thickness(edge=0.5),
        lambda solid, place: solid.voxels(step=0.5),
        lambda solid, place: solid.save(place / "a.stl", edge=0.5),
        lambda solid, place: solid.save(place / "a.3mf", edge=0.5),
        lambda solid, place: solid.save(place / "b.stl", edge=0.5, resume=True),
        lambda solid, place: solid.save_voxels(place / "a.npy", step=0.5),
        lambda solid, place: solid.render(place / "a.png", size=(80, 60), edge=0.5),
        lambda solid, place: solid.view(edge=0.5),
        lambda solid, place: solid.shell_mesh(edge=0.15),
        lambda solid, place: replace(DESIGN, lattice=replace(LATTICE, level=lt.level.thickness(1.6))).build(),
    ],
)
def test_a_warning_is_of_the_line_that_asks(tmp_path, call):
    """Not of one in the package, by which nobody finds the call."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        call(SOLID, tmp_path)
    assert {(found.filename, found.lineno) for found in heard} == {(__file__, call.__code__.co_firstlineno)}
