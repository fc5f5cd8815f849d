"""Broken meshes as regions: repaired with a warning, or refused with counts."""

import json

import numpy as np
import pytest
import trabecula as lt

CORNERS = np.array([[x, y, z] for x in (0, 8) for y in (0, 8) for z in (0, 8)], dtype=float)
FACES = [
    *[[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]],
    *[[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]],
]


def design(folder, vertices, faces, wavelength=4, **keys):
    """A gyroid in the mesh of these triangles."""
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    (folder / "part.obj").write_text("\n".join(lines))
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=wavelength), level=lt.level.fraction(0.3))
    return lt.Design(region=lt.region.mesh("part.obj", **keys), lattice={"core": core}, folder=str(folder))


def volume(solid):
    return solid.report()["region"]["volume"]


def test_a_clean_mesh_has_nothing_to_tell(tmp_path):
    solid = design(tmp_path, CORNERS, FACES, repair="refuse").build()
    assert volume(solid) == pytest.approx(512, rel=1e-14)
    assert not any(solid.repairs["region.mesh"].values())
    assert solid.warnings == []


@pytest.mark.parametrize(
    ("faces", "key", "count", "words"),
    [
        (FACES[1:], "holes", 1, "1 hole capped"),
        ([FACES[0][::-1], *FACES[1:]], "turned", 1, "1 flipped triangle"),
        ([*FACES, FACES[4]], "duplicates", 1, "1 duplicate"),
        ([f[::-1] for f in FACES], "bodies_turned", 1, "inside out"),
    ],
)
def test_damage_is_repaired_and_reported(tmp_path, faces, key, count, words):
    built = design(tmp_path, CORNERS, faces)
    solid = built.build()
    assert volume(solid) == pytest.approx(512, rel=1e-12)
    assert solid.repairs["region.mesh"][key] == count
    [warning] = [w for w in solid.warnings if w["path"] == "region.mesh"]
    assert words in warning["message"]
    assert warning in json.loads(json.dumps(solid.report()))["warnings"]
    with pytest.raises(lt.DesignError) as e:
        design(tmp_path, CORNERS, faces, repair="refuse").build()
    assert e.value.path == "region.mesh.path"


def test_overlapping_bodies_are_one(tmp_path):
    both = np.vstack([CORNERS, CORNERS + np.array([4, 1, 2])])
    solid = design(tmp_path, both, FACES + [[v + 8 for v in f] for f in FACES]).build()
    assert volume(solid) == pytest.approx(2 * 512 - 4 * 7 * 6, rel=1e-9)
    assert solid.repairs["region.mesh"]["crossings"] > 0
    mesh = solid.mesh(edge=0.5)
    assert mesh.closed


def test_a_soup_is_refused_with_its_share(tmp_path):
    points = np.random.default_rng(3).uniform(0, 10, (60, 3))
    with pytest.raises(lt.DesignError, match=r"20 holes .* 50.0 %"):
        design(tmp_path, points, np.arange(60).reshape(20, 3)).build()


def test_metres_are_asked_about(tmp_path):
    small = design(tmp_path, CORNERS / 1000, FACES, wavelength=0.004).build()
    assert any("metre" in w["message"] and w["path"] == "region.mesh" for w in small.warnings)
    assert not any("unit" in w["message"] for w in design(tmp_path, CORNERS / 1000, FACES, unit="m").build().warnings)


def refused(folder, vertices, faces):
    """What is said of a mesh that is no part."""
    with pytest.raises(lt.DesignError) as error:
        design(folder, vertices, faces).build()
    assert error.value.path == "region.mesh.path"
    return str(error.value)


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf", "1e999"])
def test_numbers_that_are_none(tmp_path, bad):
    """A corner that is nowhere is reported by its line."""
    vertices = [list(map(str, v)) for v in CORNERS]
    vertices[5][1] = bad
    assert "line 6: coordinate" in refused(tmp_path, vertices, FACES) and "not finite" in refused(tmp_path, vertices, FACES)


def test_nothing_but_degenerate_faces(tmp_path):
    """Triangles without area are left out; a mesh of nothing else, or without volume, is refused with its numbers."""
    corners = np.vstack([CORNERS, [[0, 0, 4]]])
    line = [[0, 1, 8], [8, 0, 1]]
    solid = design(tmp_path, corners, FACES + line).build()
    assert volume(solid) == pytest.approx(512, rel=1e-12)
    assert "2 triangles without area" in next(w["message"] for w in solid.warnings if w["path"] == "region.mesh")
    said = [
        refused(tmp_path, corners, line),
        # A sheet from both sides, and a box pressed flat.
        refused(tmp_path, CORNERS, [FACES[0], FACES[0][::-1]]),
        refused(tmp_path, CORNERS * [1, 1, 0], FACES),
    ]
    assert all("2 triangles; a solid has at least 4" in s for s in said[:2])
    assert "holds no solid" in said[2] and "8 degenerate triangles" in said[2]


def test_more_faces_than_a_block_holds():
    """Eighty long rods in a row are too many smooth faces for a coarse grid, and not for the finer one advised: bodies of one
    make count as one only where they are far apart by their lengths.
    """
    rods = [lt.region.capsule([i / 2, -30, 0], [i / 2, 30, 0], radius=0.6) for i in range(80)]
    core = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=2), level=lt.level.fraction(0.3))
    solid = lt.Design(region=lt.region.union(*rods), lattice={"core": core}).build()
    with pytest.raises(ValueError, match=r"\d\d smooth faces meet in a block of 61 grid steps, and 64 are possible") as error:
        solid.mesh(edge=0.7)
    assert "use a smaller edge, or a mesh for the region" in str(error.value)
    assert solid.mesh(edge=0.3).closed
