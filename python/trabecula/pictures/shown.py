"""What pictures of a solid show besides form: fractions and stiffness, deviations, axes and singular lines of a solved map,
lattices of a blend.
"""

from __future__ import annotations

import math

from ..errors import warn_caller
from .local_fields import fields_at
from .trajectories import trajectories

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from numpy.typing import NDArray

    from ..mesh import Mesh
    from .seen import Seen

    #: Of a mesh of the solid and the direction to the eye: the arguments of ``Mesh.png`` that show it.
    Look = Callable[[Mesh, tuple[float, float, float]], dict[str, Any]]

__all__ = ["SHOWN", "look"]

#: Places of axes, and trajectories, along the diagonal of the part.
PLACES, LINES = 24, 30
#: Length and width of the bars of axes, in distances between places; widths of trajectories and singular lines, in diagonals.
LONG, THICK, THIN, STRONG = 0.78, 0.1, 0.005, 0.013
#: Voxels along a cell whose law is told in a picture, as many as `law` takes; by what share edges of a cube may differ.
VOXELS, CUBE = 48, 0.05


def _number(at: Callable[[NDArray], NDArray], label: str) -> Look:
    """The look that shows a number at points."""
    return lambda *_: {"color": at, "label": label}


def _error(key: str, label: str) -> Callable[[Seen], Look]:
    def prepared(solid: Seen) -> Look:
        name = solid._solved(None)
        return _number(lambda points: solid.map_error(points, name)[key], label)

    return prepared


def _fraction(solid: Seen) -> Look:
    def at(points: NDArray) -> NDArray:
        return fields_at(solid, ["fraction"], points)["solid_fraction"]

    _lattices_of(solid, "fraction")
    at(_corner(solid))
    return _number(at, "solid fraction of the cell")


def _stiffness(solid: Seen, threads: int | None = None) -> Look:
    """Young's modulus by the law of the cell: of cubes, told by their fraction alone."""
    import numpy as np

    from ..base.paths import data_of

    names = _lattices_of(solid, "stiffness")
    if len(names) > 1:
        raise ValueError(f"stiffness is that of one lattice; the design has {', '.join(names)}")
    (name,) = names
    given = data_of(solid._core.design)["lattice"][name]
    if not isinstance(given["cell"], str):
        raise ValueError(f"stiffness is by the law of a cell with a name; lattice.{name}.cell has none")
    _check_cubes(solid, name)
    low, high = np.broadcast_to(solid.report().lattices[name].fraction, 2)
    # Fractions a twentieth apart: between them the law is a monotone cubic. One alone has another close by.
    start, stop = (float(low), float(high)) if high > 1.01 * low else (0.99 * float(low), min(1.01 * float(high), 0.999))
    count = 2 + int(20 * (stop - start))
    found = solid._law(given["cell"], given["part"], start, stop, count, VOXELS, properties=["stiffness"], threads=threads)
    found.at("E", start)  # a ValueError where it falls apart
    error = 100 * float(np.nanmax(found.columns["E_error"]))
    for fraction, (said, *_) in list(found.notes.items())[:1]:
        words = (
            f"stiffness at a fraction of {fraction:.3g}: {said.removeprefix('stiffness: ')} of `law`, a picture has {VOXELS}"
        )
        warn_caller(words, f"lattice.{name}")

    def at(points: NDArray) -> NDArray:
        known = fields_at(solid, ["fraction"], points)["solid_fraction"]
        return found.at("E", np.clip(known, start, stop))

    return _number(at, f"E along the cell's axes over the solid's (error {error:.2g} %)")


def _check_cubes(solid: Seen, name: str) -> None:
    """Raises ValueError where cells are no cubes."""
    import numpy as np

    low, high = np.asarray(solid.bounds)
    shares = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = solid.cell_at(low + shares * (high - low), name)
    long, axes = cells["wavelength"], cells["axes"]
    stretch = float(np.nanmax(long.max(axis=1) / long.min(axis=1))) - 1
    skew = max(float(np.nanmax(np.abs((axes[:, i] * axes[:, (i + 1) % 3]).sum(axis=1)))) for i in range(3))
    if max(stretch, skew) > CUBE:
        found = f"edges differ by up to {stretch:.0%}" if stretch > CUBE else "their axes are not at right angles"
        raise ValueError(f"stiffness is by the law of cubic cells; the cells of lattice.{name} are none: {found}")


def _lattices_of(solid: Seen, what: str) -> list[str]:
    names = list(solid.report().lattices)
    if not names:
        raise ValueError(f"{what} is that of a lattice's cell; the design has no lattice")
    return names


def _corner(solid: Seen) -> NDArray:
    import numpy as np

    return np.array([solid.bounds[0]])


def _lattices(solid: Seen) -> Look:
    solid.shares(_corner(solid))
    return lambda mesh, _: {
        "shares": solid.shares(mesh.vertices),
        "inside": solid.shares,
        "label": "which lattice is where",
    }


def _singularities(solid: Seen) -> Look:
    solid._solved(None)
    found = [line for it in solid.report().lattices.values() for line in it.singular or []]
    turns = sorted({line.turn for line in found})
    lines = {f"axes turned by {turn:.0f}°": [_eased(it.points) for it in found if it.turn == turn] for turn in turns}
    total = sum(line.length for line in found)
    word = "line" if len(found) == 1 else "lines"
    caption = f"{len(found)} singular {word}, {total:.1f} mm" if found else "no singular lines"
    return lambda *_: {"lines": lines, "label": caption, "width": STRONG * _diagonal(solid)}


def _axes(solid: Seen) -> Look:
    import numpy as np

    name = solid._solved(None)

    def drawn(_: Mesh, eye: tuple[float, float, float]) -> dict[str, Any]:
        step = _diagonal(solid) / PLACES
        places = _seen(solid, eye, step)
        asked = solid.map_asked(places, name) if len(places) else np.zeros((0, 3, 3))
        half = 0.5 * LONG * step * asked / np.linalg.norm(asked, axis=2, keepdims=True)
        bars = {"xyz"[i]: [np.stack([p - h, p + h]) for p, h in zip(places, half[:, i], strict=True)] for i in range(3)}
        return {"lines": bars, "label": "axes asked for", "width": THICK * step}

    return drawn


def _trajectories(solid: Seen) -> Look:
    import numpy as np

    name, region, (low, high) = solid._solved(None), solid._core.region, solid.bounds

    def axes(points: NDArray) -> NDArray:
        # Steps and differences may reach a little beyond the bounds, where there is no map.
        asked = solid.map_asked(np.clip(points, low, high), name)
        return asked / np.linalg.norm(asked, axis=2, keepdims=True)

    def drawn(_: Mesh, eye: tuple[float, float, float]) -> dict[str, Any]:
        step = _diagonal(solid) / LINES
        found = trajectories(_seen(solid, eye, 0.5 * step), step, axes, region.distance, eye)
        lines = dict(zip("xyz", found, strict=True))
        return {"lines": lines, "label": "trajectories of the axes asked for", "width": THIN * _diagonal(solid)}

    return drawn


def _of_mesh(drawn: dict[str, Any]) -> Callable[[Seen], Look]:
    return lambda _: lambda *_: drawn


#: What a mesh shows without its design.
OF_MESH: dict[str, dict[str, Any]] = {"thickness": {"color": "thickness"}, "overhang": {"color": "overhang"}}

#: What can be shown: of a solid (a ValueError where it has none) the look of its meshes.
SHOWN: dict[str, Callable[[Seen], Look]] = {
    "fraction": _fraction,
    "stiffness": _stiffness,
    "angle": _error("angle", "angle off, degrees"),
    "spacing": _error("spacing", "spacing off, ratio"),
    "density": _error("density", "cells for each one asked for"),
    "axes": _axes,
    "trajectories": _trajectories,
    "singularities": _singularities,
    "lattice": _lattices,
    **{name: _of_mesh(drawn) for name, drawn in OF_MESH.items()},
}


def look(solid: Seen, show: str, threads: int | None = None) -> Look:
    """The look of meshes of a solid that shows ``show``, found by ``threads``; a ValueError where the solid has none, or
    there is no such thing.
    """
    if show not in SHOWN:
        raise ValueError(f'show is "{show}"; it must be one of {", ".join(SHOWN)}')
    return _stiffness(solid, threads) if show == "stiffness" else SHOWN[show](solid)


def _diagonal(solid: Seen) -> float:
    return math.dist(*solid.bounds)


def _seen(solid: Seen, eye: tuple[float, float, float], step: float) -> NDArray:
    """Places on the region's surface that the eye sees, ``step`` (mm) apart in the picture, by sphere tracing."""
    import numpy as np

    low, high = np.asarray(solid.bounds)
    out = np.asarray(eye)
    right = np.cross([0.0, 0.0, 1.0], out) if abs(out[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(out, right)
    reach = 0.5 * _diagonal(solid)
    count = math.ceil(2 * reach / step)
    ticks = (np.arange(count) + 0.5 - count / 2) * step
    across, above = (v.ravel() for v in np.meshgrid(ticks, ticks))
    rays = (low + high) / 2 + reach * out + across[:, None] * right + above[:, None] * up
    passed, close = np.zeros(len(rays)), 1e-4 * reach
    running = np.arange(len(rays))
    # The distance never exceeds the true one: no step passes the surface.
    for _ in range(400):
        if not len(running):
            break
        distance = solid._core.region.distance(rays[running] - passed[running, None] * out)
        passed[running] += np.maximum(distance, 0.0)
        running = running[(distance > close) & (passed[running] < 2 * reach)]
    places = rays - passed[:, None] * out
    inside = np.all((places >= low - close) & (places <= high + close), axis=1) & (passed < 2 * reach)
    return np.clip(places[inside], low, high)


def _eased(points: list[list[float]]) -> NDArray:
    """A line through faces of a grid without the grid's stairs: the mean of neighbours, some times; ends stay."""
    import numpy as np

    line = np.asarray(points)
    closed = len(line) > 2 and np.array_equal(line[0], line[-1])
    for _ in range(6):
        ends = (line[-2:-1], line[1:2]) if closed else (line[:1], line[-1:])
        around = np.concatenate([ends[0], line, ends[1]])
        eased = 0.25 * around[:-2] + 0.5 * around[1:-1] + 0.25 * around[2:]
        line = eased if closed else np.concatenate([line[:1], eased[1:-1], line[-1:]])
    return line
