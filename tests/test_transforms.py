"""Meshes, tetrahedra and voxels never change; moved, scaled and rotated ones are new."""

import math

import numpy as np
import pytest
import trabecula as lt
from hypothesis import given, settings
from hypothesis import strategies as st
from trabecula import region

SIZES = st.floats(0.1, 10.0)
FACTOR = st.tuples(SIZES, st.sampled_from([-1.0, 1.0])).map(math.prod)
#: f64 rounds each coordinate and each of the sums over a few hundred triangles; the sizes are at most 200 mm.
TIGHT = {"rel": 1e-12}


#: A lattice in a box away from the origin.
SOLID = lt.Design(
    region=region.box([5, 4, 4], center=[7, 1, -2]),
    lattice={"core": lt.Lattice("gyroid", "lower", lt.map.affine(4), lt.level.fraction(0.5))},
).build()
#: Its mesh, which knows its cuts and its region.
PART = SOLID.mesh(per_cell=10)
TETS = lt.TetMesh.of(
    {
        "region": {"sphere": {"radius": 5}},
        "lattice": {"core": {"cell": {"tet": {"name": "diamond"}}, "map": {"tets": {"size": 2}}}},
    }
)


def test_arrays_are_read_only():
    """An array is a copy: a change of it would be seen by nobody else."""
    voxels = SOLID.voxels(step=0.5)
    arrays = [PART.vertices, PART.triangles, PART.cut, voxels.solid]
    arrays += [TETS.nodes, TETS.tets, TETS.zones, TETS.least_dihedral, TETS.sizes]
    for array in arrays:
        assert not array.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    assert voxels.moved([1, 2, 3]).origin == [a + b for a, b in zip(voxels.origin, (1, 2, 3), strict=True)]
    twice = voxels.scaled(2, center=voxels.origin)
    assert (twice.origin, twice.step, twice.volume) == (voxels.origin, 1.0, 8 * voxels.volume)
    with pytest.raises(ValueError, match="factor is -2; it must be"):
        voxels.scaled(-2)


@settings(max_examples=25, deadline=None)
@given(st.lists(FACTOR, min_size=3, max_size=3))
def test_scaled(factors):
    """Volume times the product of the factors, outwards for any sign; the region's volume too."""
    made, product = PART.scaled(factors), abs(math.prod(factors))
    assert made.volume == pytest.approx(product * PART.volume, **TIGHT)
    assert made.porosity == pytest.approx(PART.porosity, **TIGHT)
    assert made.closed and not made.defects and made.euler == PART.euler and made.pieces == PART.pieces
    assert np.array_equal(made.vertices, PART.vertices * factors) and np.array_equal(made.cut, PART.cut)
    tets = TETS.scaled(factors)
    assert tets.volume == pytest.approx(product * TETS.volume, **TIGHT)
    assert tets.report().quality.inverted == 0 and tets.boundary().closed and tets.boundary().volume > 0


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3), st.floats(-400, 400))
def test_rotated(axis, degrees):
    """Lengths, areas and volumes stay; back again is where it was; the axis stands still."""
    if max(map(abs, axis)) < 1e-3:
        axis = [0, 0, 1]
    center = np.array([1.0, -2.0, 3.0])
    made = PART.rotated(axis, degrees, center)
    assert made.area == pytest.approx(PART.area, **TIGHT) and made.volume == pytest.approx(PART.volume, **TIGHT)
    assert made.closed and np.array_equal(made.triangles, PART.triangles)
    back = made.rotated(axis, -degrees, center)
    assert np.allclose(back.vertices, PART.vertices, rtol=0, atol=1e-13)
    on = lt.Mesh.of([center + axis, center, center - axis], [[0, 1, 2]])
    assert np.allclose(on.rotated(axis, degrees, center).vertices, on.vertices, rtol=0, atol=1e-14)


def test_quarter_turns_and_moves_are_exact():
    """x goes to y about z: the right-hand rule. A move is a sum."""
    x, y, z = PART.vertices.T
    assert np.array_equal(PART.rotated("z", 90).vertices, np.stack([-y, x, z], 1))
    assert np.array_equal(PART.rotated("x", -270).vertices, np.stack([x, -z, y], 1))
    assert np.array_equal(PART.moved([1, 2.5, -3]).vertices, PART.vertices + np.array([1, 2.5, -3]))


def test_transformed_meshes_are_written_as_they_are(tmp_path):
    """File and measures agree, which edits of arrays could not do."""
    made = PART.scaled([-1, 2, 1]).moved([5, 0, 0])
    made.write(tmp_path / "made.ply")
    again = lt.Mesh.read(tmp_path / "made.ply")
    assert again.closed and again.volume == pytest.approx(made.volume, rel=1e-6)  # single precision
    assert np.allclose(again.bounds, made.bounds, rtol=1e-6)
    TETS.moved([1, 2, 3]).write(tmp_path / "made.vtu")
    assert np.allclose(lt.TetMesh.read(tmp_path / "made.vtu").nodes, TETS.nodes + np.array([1, 2, 3]), rtol=1e-15)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: m.scaled(0), "factor is 0; it must be a finite number other than 0"),
        (lambda m: m.scaled([1, math.nan, 1]), "factor is nan; it must be a finite number other than 0"),
        (lambda m: m.scaled([1, 2]), "factor must be one number or three, found 2"),
        (lambda m: m.moved(3), "vector must be three numbers, found 3"),
        (lambda m: m.moved([0, math.inf, 0]), "vector is .*; it must be three finite numbers"),
        (lambda m: m.moved([1e12, 0, 0]), "f64 rounds its shape; move it less"),
        (lambda m: m.rotated("w", 3), 'axis is "w"; it must be "x", "y", "z" or a direction'),
        (lambda m: m.rotated([0, 0, 0], 3), "a direction has a length greater than 0"),
        (lambda m: m.rotated("x", math.nan), "degrees is nan"),
    ],
)
def test_wrong_transforms_are_refused(call, words):
    """One line that says what is allowed."""
    for mesh in (PART, TETS):
        with pytest.raises(ValueError, match=words) as error:
            call(mesh)
        assert "\n" not in str(error.value)
