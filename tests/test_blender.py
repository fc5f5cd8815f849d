"""The Blender extension, in Blender as a Python module (``pip install bpy``) without a window."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import trabecula as lt

bpy = pytest.importorskip("bpy")
FOLDER = Path(__file__).resolve().parent.parent / "blender"


@pytest.fixture
def settings():
    spec = importlib.util.spec_from_file_location("trabecula_blender", FOLDER / "__init__.py")
    extension = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(extension)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    extension.register()
    yield bpy.context.scene.trabecula
    extension.unregister()


def mesh_of(made):
    mesh = made.data
    vertices = np.array([v.co for v in mesh.vertices], dtype=float)
    return lt.Mesh.of(vertices, np.array([p.vertices for p in mesh.polygons]))


def fill():
    assert bpy.ops.object.trabecula_fill() == {"FINISHED"}
    return bpy.context.object


def test_a_scaled_cube_with_a_modifier(settings):
    """The part is the object as it is seen: 8 × 10 × 12 mm, moved and mirrored."""
    bpy.ops.mesh.primitive_cube_add(size=2, location=(5, 0, 0))
    part = bpy.context.object
    part.scale = (4, 5, -6)
    part.modifiers.new("Edges", "BEVEL").width = 0.01
    settings.cell, settings.wavelength, settings.fraction, settings.samples = "diamond", 4, 0.4, 24
    lattice = fill()
    assert lattice.name == f"{part.name} lattice" and part.hide_get()
    made = mesh_of(lattice)
    assert made.closed and np.allclose(made.bounds, ([1, -5, -6], [9, 5, 6]), atol=0.02)
    # Whole cells along x and z, and half of one along y, which half turns of the group take to the other half.
    assert made.volume / 960 == pytest.approx(0.4, abs=0.005)


def test_units_of_the_scene(settings):
    """A cube of 10 mm in a scene whose unit is a metre."""
    bpy.ops.mesh.primitive_cube_add(size=0.01)
    settings.unit, settings.samples, settings.skin = "scene", 24, 0.5
    made = mesh_of(fill())
    assert np.allclose(np.ptp(made.bounds, axis=0), 0.01, rtol=1e-4)
    shell = 10**3 - 9**3
    assert made.volume * 1e9 == pytest.approx(shell + 0.3 * 9**3, rel=0.03)


def test_beams(settings):
    bpy.ops.mesh.primitive_cube_add(size=10)
    settings.cell, settings.fraction, settings.samples = "beams:octet", 0.2, 24
    assert mesh_of(fill()).volume / 1000 == pytest.approx(0.2, abs=0.02)


def test_an_open_part_is_refused(settings):
    """A plane has no inside: one line, and nothing is made or hidden."""
    bpy.ops.mesh.primitive_plane_add(size=10)
    part, before = bpy.context.object, set(bpy.data.objects)
    with pytest.raises(RuntimeError, match=r"Trabecula: region\.mesh"):
        bpy.ops.object.trabecula_fill()
    assert set(bpy.data.objects) == before and not part.hide_get()
