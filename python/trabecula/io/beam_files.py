"""Files of beams: 3MF beam lattices with the meshes that go with them, graphs."""

from __future__ import annotations

import os

from .. import _core
from ..base.files import extension, whole_file
from ..base.formats import BEAM_WRITES
from ..errors import warn_caller

__all__ = ["save_beams"]

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..base.resolution import Resolution
    from ..reports import BeamsFileReport

#: Most triangles of the mesh that stands for beams in programs that cannot show them.
MOST_SHOWN = 300_000
#: Chord errors of that mesh in the one of a usual mesh, a fiftieth of the thinnest beam's radius.
COARSER = (5, 10, 20)
#: Steps of its grid, where it needs one, on the thinnest beam's diameter.
BEAM_STEPS = (2.5, 1.6)
#: Steps of the grid on which the region's mesh is made, along its diagonal, and its greatest error in diagonals.
CLIP_STEPS, CLIP_ERROR = 64, 2e-5


def save_beams(
    solid: Resolution, path: str | os.PathLike[str], chord: float | None, mesh: bool, threads: int | None
) -> BeamsFileReport:
    """As ``Solid.save_beams``."""
    kind = extension(path, BEAM_WRITES)
    core = solid._core
    if kind != "3mf":
        with whole_file(path) as temporary:
            return warned(_core.write_graph(core, temporary, kind))
    clip = region_mesh(core) if core.cuts_beams() else None
    shown = shown_mesh(core, threads) if mesh else None
    if mesh and shown is None:
        warn_caller(
            f"there are too many beams for a mesh of {MOST_SHOWN} triangles: programs that do not know the beam lattice "
            "extension show nothing of the file",
        )
    title = os.path.splitext(os.path.basename(os.fsdecode(path)))[0]
    with whole_file(path) as temporary:
        return warned(_core.write_beam_lattice(core, temporary, title, chord, clip, shown, threads))


def warned(made: BeamsFileReport) -> BeamsFileReport:
    """Warns of what the format cannot hold, before the file has its name: a warning may be an error."""
    for sentence in made.lost:
        warn_caller(sentence)
    return made


def region_mesh(core: _core.Solid) -> _core.Mesh:
    """The region's boundary, flat faces with few triangles."""
    low, high = core.bounds
    size = sum((b - a) ** 2 for a, b in zip(low, high, strict=True)) ** 0.5
    made = core.region.mesh(size / CLIP_STEPS)
    return made.simplified(tolerance=CLIP_ERROR * size)[0]


def shown_mesh(core: _core.Solid, threads: int | None) -> _core.Mesh | None:
    """A coarse mesh of the solid, if one of at most ``MOST_SHOWN`` triangles shows all beams."""
    usual = core.default_chord
    if usual is not None:
        for times in COARSER:
            if core.expected_beams(times * usual)[0] <= MOST_SHOWN:
                return core.mesh_beams(times * usual, threads)[0]
        return None
    report = core.report()
    (beams,) = report.beams.values()
    thin, volume = beams.thickness, beams.fraction * report.region.volume
    for steps in BEAM_STEPS:
        # Two triangles for each square of a step on the surface of cylinders of this diameter and volume, 4 V / d.
        if 8 * volume * steps**2 <= MOST_SHOWN * thin**3:
            return core.mesh(thin / steps, threads, None, "keep")[0]
    return None
