"""The table of mesh formats: Python, the command and the texts name its rows, and no others."""

import re
from pathlib import Path

import pytest
import trabecula as lt
from trabecula import _core
from trabecula.base import formats
from trabecula.command.parser import parser

READS = ", ".join(formats.MESH_READS)
ROOT = Path(__file__).parent.parent


def test_texts_name_the_formats_of_the_table():
    assert f"({READS};" in lt.Mesh.read.__doc__
    assert f"({READS})" in lt.region.mesh.__doc__
    assert _core.schema().count(f"({READS})") == 3
    assert f"({READS.upper()})" in (ROOT / "docs/reference/features.md").read_text(encoding="utf-8")
    assert f"({READS.upper()};" in (ROOT / "crates/geometry/src/lib.rs").read_text(encoding="utf-8")
    assert re.findall(r"\.(\w+) ", lt.Mesh.write.__doc__.replace(",", " ")) == list(formats.MESH_WRITES)
    assert f"({formats.dotted(formats.TET_WRITES)})" in parser()._subparsers._group_actions[0].choices["tets"].format_help()


@pytest.mark.parametrize("suffix", formats.MESH_WRITES)
def test_a_written_file_has_the_size_of_the_table(suffix, tmp_path):
    """Room on the disk is found from it: exact for numbers as bytes, within a third for text."""
    design = lt.Design(
        region=lt.region.sphere(radius=20),
        lattice={"a": lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength=10), lt.level.fraction(0.3))},
    )
    mesh = design.build().mesh(edge=0.5)
    vertices, triangles = mesh.counts
    path = tmp_path / f"a.{suffix}"
    mesh.write(path)
    row = formats.MESHES[suffix]
    expected = row.bytes[0] * triangles + row.bytes[1] * vertices
    assert path.stat().st_size == pytest.approx(expected, rel=1e-3 if row.binary else 1 / 3)
    assert lt.Mesh.read(path).volume == pytest.approx(mesh.volume, rel=1e-6)
