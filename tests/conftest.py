"""Designs that several tests use."""

import contextlib
import io
import signal
import subprocess
import sys
import warnings

import pytest
import trabecula as lt
from finite_elements import solid
from trabecula.command import cli

# What runs in the background may begin with interrupts ignored, and so would the programs that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

CUBE = """schema = 1
units = "mm"
[region.box]
size = [8, 8, 8]
[lattice.core]
cell = "gyroid"
part = "sheet"
[lattice.core.map.affine]
wavelength = 4.0
[lattice.core.level]
fraction = 0.3
"""


@pytest.fixture
def cube(tmp_path):
    """A small gyroid cube in a file."""
    path = tmp_path / "cube.toml"
    path.write_text(CUBE)
    return path


@pytest.fixture(scope="session")
def block():
    """A cube of 10 mm with eight cells of a gyroid sheet."""
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=5), level=lt.level.fraction(0.3))
    return lt.Design(region=lt.region.box(size=[10, 10, 10]), lattice={"core": core}).build()


@pytest.fixture(scope="session")
def sheet():
    """A periodic volume mesh of one cell of a gyroid sheet, 16 edges along it."""
    return solid().volume_mesh(per_cell=16, periodic=True)


def command(*words):
    """The command in a process of its own: its status and what it prints."""
    return subprocess.run([sys.executable, "-m", "trabecula", *map(str, words)], capture_output=True, text=True, timeout=300)


def run_in_process(*words):
    """The command in this process, without the start of another: its status and what it prints."""
    signals = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    handlers = {which: signal.getsignal(which) for which in signals}
    out, err = io.StringIO(), io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = cli.main([str(word) for word in words])
    finally:
        for which, handler in handlers.items():
            signal.signal(which, handler)
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def in_process(*words, status=0):
    """What the command prints, in this process."""
    done = run_in_process(*words)
    assert done.returncode == status, done.stderr
    return done.stdout
