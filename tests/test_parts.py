"""Lattices in real parts, whole and damaged, before outside judges.

TRABECULA_PARTS names a folder of parts to be judged as well; TRABECULA_CAMPAIGN has every damage done to every part.
"""

import functools
import os
import tempfile
from itertools import product
from pathlib import Path

import judges
import numpy as np
import parts
import pytest
import trabecula as lt
from trabecula.base.formats import MESH_READS, kind_of

EVERYTHING = "TRABECULA_CAMPAIGN" in os.environ
WAVELENGTH = 3.6
LATTICES = {"gyroid": "sheet", "diamond": "lower"}
FRACTION = 0.5
SKIN = 0.7
STEP = 0.36
ROUGH = 0.45
quiet = pytest.mark.filterwarnings("ignore::trabecula.DesignWarning")


def solid(folder, part, cell, skin, wavelength=WAVELENGTH):
    """A lattice in a part, with or without a skin."""
    core = lt.Lattice(cell, LATTICES[cell], lt.map.affine(wavelength, (10, 20, 30)), lt.level.fraction(FRACTION))
    if not isinstance(part, (str, Path)):
        parts.write(folder / "part.obj", part)
        part = "part.obj"
    more = {"skin": lt.skin(SKIN * wavelength / WAVELENGTH)} if skin else {}
    return lt.Design(region=lt.region.mesh(str(part)), lattice={"core": core}, folder=str(folder), **more).build()


def lattice_value(cell, points):
    """The cell's function in numpy, for the map of `solid`: u = Rᵀ x / wavelength."""

    def turn(axis, degrees):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        m = np.eye(3)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        m[i, i], m[i, j], m[j, i], m[j, j] = c, -s, s, c
        return m

    rotation = turn(0, 10) @ turn(1, 20) @ turn(2, 30)
    phase = 2 * np.pi * (points @ rotation) / WAVELENGTH
    (sx, sy, sz), (cx, cy, cz) = np.sin(phase).T, np.cos(phase).T
    if cell == "gyroid":
        return np.abs(sx * cy + sy * cz + sz * cx)
    return sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz


@quiet
@pytest.mark.parametrize("name", parts.PARTS)
def test_parts_are_filled(tmp_path, name):
    """Closed and uncrossed by outside judges, the fraction that was asked for, and the volume of a count of our own."""
    part = parts.PARTS[name]()
    whole = judges.volume(*part)
    # One place in each cell of a grid: the count errs by the cells that the surface passes, each by half of one at most.
    side = (whole / 2_000) ** (1 / 3)
    low, high = part[0].min(axis=0), part[0].max(axis=0)
    axes = [np.arange(a, b, side) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(1).uniform(0, side, points.shape)
    depth = -judges.distance(*part, points)
    for cell in LATTICES:
        bare, skinned = (solid(tmp_path, part, cell, skin) for skin in (False, True))
        assert bare.report()["region"]["volume"] == pytest.approx(whole, rel=1e-12)
        iso = bare.report()["lattices"]["core"]["iso"]
        volumes = []
        for made in (bare, skinned):
            mesh = made.mesh(edge=STEP)
            volumes.append(judges.sound(mesh))
            assert volumes[-1] == pytest.approx(mesh.volume, rel=1e-6)
            inside = depth > 0
            filled = lattice_value(cell, points) <= iso
            if made is skinned:
                filled |= depth <= SKIN
            count = (inside & filled).sum() * side**3
            # Five standard deviations; the surface passes through at most (area / side² + …) cells, twice for slants.
            spread = 5 * 0.5 * side**3 * np.sqrt(2 * mesh.area / side**2)
            assert abs(volumes[-1] - count) < spread, (cell, made is skinned, volumes[-1], count, spread)
        assert volumes[0] / whole == pytest.approx(FRACTION, abs=0.01)
        assert volumes[1] > volumes[0]


def streams_whole(made, folder, **spacing):
    """A part that many tiles make, each by itself, is closed and has the volume that was reported."""
    reported = made.save(folder / "part.stl", **spacing)
    mesh = judges.of_stl(folder / "part.stl")
    assert len(mesh[1]) == reported["triangles"]
    assert judges.status(*mesh) == judges.manifold3d.Error.NoError
    assert judges.volume(*mesh) == pytest.approx(reported["volume"], rel=1e-6)


@quiet
@pytest.mark.parametrize(("name", "cell", "skin"), [(*c, i % 3 > 0) for i, c in enumerate(product(parts.PARTS, LATTICES))])
def test_parts_are_streamed_whole(tmp_path, name, cell, skin):
    """Over several tiles along each axis."""
    streams_whole(solid(tmp_path, parts.PARTS[name](), cell, skin), tmp_path, edge=STEP / 2)


def slack(name, part, damaged):
    """By how much a repair of this damage may miss the volume: caps of single triangles, and nothing else, guess."""
    if name != "holes":
        return 1e-9 * judges.volume(*part)
    # A cap over a gap of this area, which is some triangles wide, is off by less than its width.
    gone = judges.area(*part) - judges.area(*damaged)
    widest = np.sqrt(gone)
    return gone * widest


def redrawn(name, part, damaged):
    """By how much lattices may differ where damage puts more corners on edges of the part: a cell on either side of each is
    fitted to other pieces of the same edge, which moves its surface, about a square step, by less than a tenth of a step:
    but for few places edges are within a twentieth (`tests/laws/crease.rs`).
    """
    more = len(damaged[0]) - len(part[0]) if name == "t_junctions" else 0
    return more * 2 * 0.1 * ROUGH**3


KINDS = [(cell, skin) for cell in LATTICES for skin in (False, True)]
CASES = [(p, d, *k) for p in parts.PARTS for d in parts.DAMAGES for k in KINDS]
if not EVERYTHING:
    # Every damage, part and kind of lattice a few times, not all with all.
    CASES = [
        (list(parts.PARTS)[(i + j) % 4], d, *KINDS[(i + 3 * j) % 4]) for i, d in enumerate(parts.DAMAGES) for j in range(2)
    ]


@functools.cache
def whole(name):
    """A part and what it becomes, by lattice and skin."""
    part = parts.refined(parts.PARTS[name]())
    with tempfile.TemporaryDirectory() as folder:
        return part, {kind: solid(Path(folder), part, *kind).mesh(edge=ROUGH).volume for kind in KINDS}


@quiet
@pytest.mark.parametrize(("name", "damage", "cell", "skin"), CASES)
def test_damaged_parts_are_filled_alike(tmp_path, name, damage, cell, skin):
    """A damaged part comes out as the whole one does, and the repair is reported."""
    part, volumes = whole(name)
    damaged = parts.DAMAGES[damage](part, np.random.default_rng(5))
    made = solid(tmp_path, damaged, cell, skin)
    assert any(w["path"] == "region.mesh" for w in made.warnings)
    off = slack(damage, part, damaged)
    assert abs(made.report()["region"]["volume"] - judges.volume(*part)) <= off
    # Where a cap bends another way than the surface did the skin goes with it, on both its sides.
    more = redrawn(damage, part, damaged)
    assert abs(judges.sound(made.mesh(edge=ROUGH)) - volumes[cell, skin]) <= 2 * off + more + 1e-6 * volumes[cell, skin]


FOLDER = Path(os.environ["TRABECULA_PARTS"]) if "TRABECULA_PARTS" in os.environ else None
FILES = sorted(p for p in FOLDER.iterdir() if kind_of(p) in MESH_READS) if FOLDER else []


@quiet
@pytest.mark.parametrize("path", FILES, ids=[p.name for p in FILES])
def test_given_parts_are_filled_or_refused(path, tmp_path):
    """Every file of a folder of the user's: judged alike, or refused with numbers."""
    try:
        region = lt.Design(lt.region.mesh(str(path)), solid_core(1.0)).build().report()["region"]
    except lt.DesignError as error:
        assert any(c.isdigit() for c in str(error)), str(error)
        return
    low, high = np.array(region["bounds"])
    assert region["volume"] > 0
    # Cells so small that some hundred lie in the part.
    wavelength = (region["volume"] / 150) ** (1 / 3)
    for cell in LATTICES:
        volumes = []
        for skin in (False, True):
            made = solid(path.parent, path.name, cell, skin, wavelength)
            volumes.append(judges.sound(made.mesh(per_cell=10)))
            streams_whole(made, tmp_path, per_cell=24)
        assert volumes[0] / region["volume"] == pytest.approx(FRACTION, abs=0.01)
        assert volumes[0] < volumes[1] < region["volume"]
    assert (low < high).all()


def solid_core(wavelength):
    """Any lattice."""
    return lt.Lattice("gyroid", "sheet", lt.map.affine(wavelength), lt.level.fraction(FRACTION))


def test_the_judge_of_crossings_sees_them():
    """Bodies that pass through each other, and a flap folded flat, are found; bodies that touch are not."""
    cube = parts.arrays(parts.manifold3d.Manifold.cube((1, 1, 1)))

    def both(by):
        return np.concatenate([cube[0], cube[0] + by]), np.concatenate([cube[1], cube[1] + 8])

    assert judges.crossings(*cube) == 0
    assert judges.crossings(*both([0.3, 0.4, 0.6])) > 0
    assert judges.crossings(*both([2.0, 0.4, 0.6])) == 0
    assert judges.crossings(*both([1.0, 0.0, 0.0])) == 0
    for part in (parts.ball(), parts.bracket()):
        assert judges.crossings(*part) == 0
        bent = part[0].copy()
        bent[3] -= 2.5 * (bent[3] - bent.mean(axis=0))
        assert judges.crossings(bent, part[1]) > 0
    folded = np.array([[0, 0, 0], [1, 0, 0], [0.3, 1, 0], [0.4, 0.8, 0]], dtype=float)
    assert judges.crossings(folded, np.array([[0, 1, 2], [1, 0, 3]])) == 1
