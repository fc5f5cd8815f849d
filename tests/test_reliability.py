"""Requests without end, interrupts, and what must not be shown."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
import trabecula as lt

#: A part whose surface is a thin shell of a ball of 14 m.
HUGE = """
schema = 1
units = "mm"
region.sphere.radius = 7000
[lattice.a]
cell = "primitive"
part = "sheet"
map.affine.wavelength = 5
level.iso = { depth = { stops = [[0, 0.9], [4, 300]] } }
"""

#: A solve for a map on 30 million nodes.
SOLVED = """
schema = 1
units = "mm"
region.box.size = [60, 60, 60]
[lattice.a]
cell = "gyroid"
part = "sheet"
map.phase = { wavelength = { linear = { along = [1, 0, 0], stops = [[-30, 2.0], [30, 4.0]] } }, step = 0.2 }
level.fraction = 0.3
"""


def test_a_grid_without_end_is_refused(tmp_path):
    """By its cells, though hardly any tile that is looked at holds a surface."""
    (tmp_path / "huge.toml").write_text(HUGE)
    solid = lt.load(tmp_path / "huge.toml").build()
    with pytest.raises(ValueError, match=r"cells, 1\.1e13, and at most 2e12 are possible; use an edge of 1\.\d+ mm or more"):
        solid.mesh(per_cell=8)


@pytest.mark.parametrize("edge", [1e-300, 5e-324, 1e-7])
def test_spacings_beyond_any_grid(edge):
    """One line with the place and what to use."""
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.4))
    solid = lt.Design(region=lt.region.box([8] * 3), lattice={"core": core}).build()
    with pytest.raises(ValueError, match=r"grid spacing .* cuts the region's 8 mm into more than 4e\+06 steps; use 0.00064 mm"):
        solid.mesh(edge=edge)


@pytest.mark.parametrize("words", [("check",), ("mesh", "-o", "out.stl")])
def test_an_interrupt_ends_a_solve(tmp_path, words):
    """The command ends while the map is being solved for, long before it is solved."""
    (tmp_path / "solved.toml").write_text(SOLVED)
    command = [sys.executable, "-m", "trabecula", words[0], "solved.toml", *words[1:]]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    # Under way when it has used a second of processor time more than its start takes.
    tick = os.sysconf("SC_CLK_TCK")
    while run.poll() is None:
        with open(f"/proc/{run.pid}/stat") as file:
            used = file.read().rsplit(")", 1)[1].split()
        if (int(used[11]) + int(used[12])) / tick > 2.5:
            break
        time.sleep(0.02)
    assert run.poll() is None, run.stderr.read()
    run.send_signal(signal.SIGINT)
    run.wait(10)  # the solve takes minutes
    assert run.returncode in (130, -signal.SIGINT) and not (tmp_path / "out.stl").exists()


@pytest.mark.parametrize(
    ("wavelength", "work"),
    [(2, "solid.volume_mesh(edge=0.15)"), (0.25, "list(solid.layers(layer=1.0))")],
    ids=["volume", "layers"],
)
def test_an_interrupt_ends_a_stage(wavelength, work):
    """In the middle of a stage, not at its end."""
    script = f"""
        import os, signal, sys, threading, time
        import trabecula as lt

        core = lt.Lattice("gyroid", "sheet", lt.map.affine({wavelength}), lt.level.fraction(0.3))
        solid = lt.Design(region=lt.region.box([20, 20, 20]), lattice=core).build()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        timer = threading.Timer(3.0, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        try:
            {work}
            print("it was made before the interrupt", file=sys.stderr)
        except KeyboardInterrupt:
            print("interrupted")
    """
    start = time.monotonic()
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=300)
    assert done.stdout == "interrupted\n", done.stderr
    assert time.monotonic() - start < 3 + 20  # either is made in more than a minute of processor time


@pytest.mark.parametrize("kind", ["obj", "off", "ply"])
def test_contents_of_other_files_are_not_shown(tmp_path, kind):
    """A path may lead to a file that is nobody's business."""
    path = tmp_path / f"part.{kind}"
    path.write_text("root:secret:0:0:Charlie &:/root:/bin/csh\ndaemon:*:1:1:Owner:/root:/bin/sh\n")
    with pytest.raises(ValueError, match="part") as error:
        lt.Mesh.read(path)
    assert not any(word in str(error.value) for word in ("root:", "secret", "Charlie", "daemon:"))


def test_messages_shorten_what_was_found():
    """An unknown cell of 40 000 characters does not come back whole."""
    core = lt.Lattice("x" * 40_000, "sheet", lt.map.affine(4), lt.level.fraction(0.4))
    with pytest.raises(lt.DesignError, match=r'unknown cell "x{79}…"') as error:
        lt.Design(region=lt.region.box([8] * 3), lattice={"core": core}).build()
    assert len(str(error.value)) < 1400 and len(error.value.message) < 1400


def test_an_interrupt_ends_the_work_itself(tmp_path):
    """Of a session that goes on, such as a notebook: no processor time is used up after Ctrl-C in a build."""
    script = """
        import os, signal, sys, threading, time
        import trabecula as lt

        turn = lt.map.phase(2.0, rotate_z=lt.grade.formula("40*sin(x/9)*cos(y/7)"), step=0.3)
        core = lt.Lattice(cell="gyroid", part="sheet", map=turn, level=lt.level.fraction(0.3))
        design = lt.Design(region=lt.region.box([60, 60, 60]), lattice=core)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            design.build()
            sys.exit("it was built before the interrupt")
        except KeyboardInterrupt:
            for _ in range(10):  # the round that was under way may end
                before = time.process_time()
                time.sleep(1.0)
                if time.process_time() - before < 0.1:
                    sys.exit()
            sys.exit("the work went on")
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "formula", ["0.2 + 0.05*sqrt(z)", "0.2 + 0.05*sqrt(abs(x - 6))", "0.2 + 0.03*acos(z/12)", "0.3 + 0.02*atan2(y - 6, x - 6)"]
)
def test_a_formula_with_an_infinite_slope_gives_a_mesh(tmp_path, formula):
    """Its values are finite everywhere, so its vertices are too."""
    level = lt.level.fraction(lt.grade.formula(formula))
    box = lt.region.box(min=[0, 0, 0], max=[12, 12, 12])
    solid = lt.Design(region=box, lattice=lt.Lattice("gyroid", "sheet", lt.map.affine(4), level)).build()
    mesh = solid.mesh(edge=0.2, islands="keep")
    assert np.isfinite(mesh.vertices).all() and mesh.closed
    assert solid.layers(0.1).save(tmp_path / "a.cli").volume == pytest.approx(mesh.volume, rel=5e-3)


def test_a_transition_narrower_than_an_estimate_is_meshed():
    """The number of triangles is counted on a grid that resolves it."""
    lattices = {"a": lt.Lattice("primitive", "upper", lt.map.affine(12), lt.level.fraction(0.25))}
    lattices["b"] = lt.Lattice("gyroid", "upper", lt.map.affine(3), lt.level.fraction(0.5))
    blend = lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {0: 0, 0.15: 1}))
    with pytest.warns(lt.DesignWarning, match=r"the transition between .* is 0\.15 mm wide"):
        solid = lt.Design(region=lt.region.box(size=[6, 6, 6]), lattice=lattices, blend=blend).build()
    assert solid.mesh(edge=0.1, islands="keep").closed


def test_points_that_lie_elsewhere_are_refused(tmp_path):
    table = tmp_path / "far.csv"
    np.savetxt(table, np.random.default_rng(1).uniform(200, 201, (50, 4)), delimiter=",")
    level = lt.level.fraction(lt.grade.points(str(table)))
    with pytest.raises(lt.DesignError, match=r"the points reach from .* are they in mm"):
        lt.Design(
            region=lt.region.box(size=[10, 10, 10]), lattice=lt.Lattice("gyroid", "sheet", lt.map.affine(4), level)
        ).build()


def test_what_is_full_in_places_is_in_one_piece_there():
    level = lt.level.thickness(lt.grade.linear([0, 0, 1], {-10: 0.5, 10: 4}))
    lattice = lt.Lattice("gyroid", "sheet", lt.map.affine(4), level)
    with pytest.warns(lt.DesignWarning) as found:
        lt.Design(region=lt.region.box(size=[20, 20, 20]), lattice=lattice).build()
    assert all("above the folding limit" in str(warning.message) for warning in found)
