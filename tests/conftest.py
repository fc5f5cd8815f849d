"""Designs that several tests use."""

import pytest

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
