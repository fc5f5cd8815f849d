"""Pictures of meshes: shaded, in colours, as line drawings; and the mesh to turn."""

from __future__ import annotations

import math
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property

from ..base.files import extension, write_bytes
from ..base.given import check_keywords, named, number, parameters, positive, whole
from ..base.transforms import vector_of
from ..errors import warn_caller
from .camera import BACKGROUNDS, NO_SCALE, PROJECTIONS, section_plane, towards

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import TypedDict, Unpack

    from .. import _core
    from .._core import Cut, Eye, Inside, Lines, Shares, Tint
    from ..mesh import Mesh
    from ..solid import Solid
    from .viewer import View

    #: Numbers, or shares by name, at points (n, 3) in mm.
    At = Callable[[NDArray], Any]
    #: A plane by its unit normal and offset.
    Plane = tuple[tuple[float, float, float], float]

    class Style(TypedDict, total=False):
        """How pictures and drawings look: the keywords that ``Mesh.png`` and ``Mesh.svg`` have in common."""

        color: ArrayLike | At | str | None
        label: str
        span: tuple[float, float] | None
        shares: Mapping[str, ArrayLike] | None
        lines: Mapping[str, Iterable[ArrayLike]] | None
        width: float | None
        section: str | None
        dpi: float | None
        projection: str
        scale_bar: bool
        axes: bool
        solid: Solid | None
        inside: At | None
        up: Sequence[float]

    class Look(Style, total=False):
        """How a picture looks: the keywords of ``Mesh.png``."""

        background: str


__all__ = ["NO_VALUE", "OVERHANG", "WALL", "Drawn", "Picture", "numbers", "scale_of", "scale_over"]

#: What colours say that are computed; and what they say where there is no finite number.
WALL, OVERHANG, NO_VALUE = "wall thickness, mm", "overhang, degrees to the layers (grey: none)", "grey: no value"
#: Points along the longer side of a section at which its colours are computed.
ACROSS = 240


class Picture:
    """Things that show themselves as a picture in a notebook."""

    #: The mesh that it shows.
    _picture: Callable[[], Mesh]

    @cached_property
    def _png(self) -> bytes:
        return self._picture().png((640, 480))

    def _repr_png_(self) -> bytes:
        return self._png


class Drawn(Picture, ABC):
    """Meshes as they are drawn."""

    _core: _core.Mesh

    thickness_at_vertices: Callable[[], NDArray[np.float64]]

    @property
    @abstractmethod
    def counts(self) -> tuple[int, int]:
        """Numbers of vertices and triangles."""

    @property
    @abstractmethod
    def bounds(self) -> list[list[float]]:
        """Lower and upper corner, mm."""

    @property
    @abstractmethod
    def vertices(self) -> NDArray[np.float64]:
        """Vertex positions, (n, 3), mm."""

    @named
    def png(
        self,
        size: tuple[int, int] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
        color: ArrayLike | At | str | None = None,
        label: str = "",
        span: tuple[float, float] | None = None,
        shares: Mapping[str, ArrayLike] | None = None,
        lines: Mapping[str, Iterable[ArrayLike]] | None = None,
        width: float | None = None,
        section: str | None = None,
        background: str = "shaded",
        dpi: float | None = None,
        projection: str = "perspective",
        scale_bar: bool = False,
        axes: bool = False,
        solid: Solid | None = None,
        inside: At | None = None,
        up: Sequence[float] = (0, 0, 1),
    ) -> bytes:
        """A picture as the bytes of a PNG file; the camera looks from ``azimuth`` about +z and ``elevation``, degrees.

        ``color`` is a number for each vertex, or a function of points (n, 3) in mm that gives such numbers, shown on a scale
        that says ``label`` and goes over ``span``, or from the least to the greatest (one value alone is in the middle of a
        scale from 0); triangles with a corner that has no finite number are grey. Or it is ``"thickness"``, see
        ``thickness_at_vertices``; or ``"overhang"``, the angle (degrees) between the surface and layers stacked along ``up``,
        where it faces down and the angle is less than the end of ``span``, 90 unless given. ``shares`` are instead numbers from
        0 to 1 for each vertex by a name: each name has a colour, shares mix them. ``lines`` are polylines, points (n, 3) in mm,
        by a name; they are ``width`` mm wide (1/100 of the diagonal unless given) and are seen through the surface, which is
        pale unless it has colours. ``label`` is what colours say, or else lines. ``section`` is what is kept of a closed
        surface, ``"z<10"``, ``"z>10"`` (mm), or by ``"z=10"`` what is farther from the eye; the solid that is cut is hatched,
        and coloured where ``color`` is a function, or by ``inside``, a function of points that gives ``color`` or ``shares``
        there. ``background`` is ``"shaded"``, ``"white"`` or ``"transparent"``, ``dpi`` says how many pixels are an inch in
        print. ``projection`` is ``"perspective"``, by a lens, or ``"orthographic"``, by parallel rays: lengths across the view
        are then to scale at any depth, and ``scale_bar`` draws a bar of a round length. ``axes`` draws the directions of x, y
        and z. ``solid``, of which this is the mesh, gives the normals that the surface is shaded by: its facets do not show
        then. ValueError for what cannot be drawn; a DesignWarning where the picture is too small for legend, bar or axes.
        """
        if background not in BACKGROUNDS:
            raise ValueError(f"background is {background!r}; it must be one of {', '.join(BACKGROUNDS)}")
        seen, cut = self._camera(size, azimuth, elevation, section, projection, scale_bar, axes)
        inch = None if dpi is None else positive("dpi", dpi)
        colours = self._colours(cut[0], color, label, span, shares, lines, width, inside, up)
        made, fits_foot = self._core.png(seen, cut, None if solid is None else solid._core, *colours, background, inch)
        if not fits_foot:
            _warn_small(seen, "legend, scale bar or axes" if scale_bar or axes else "its legend")
        return made

    @named
    def svg(
        self,
        size: tuple[float, float] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
        section: str | None = None,
        dpi: float | None = None,
        projection: str = "perspective",
        scale_bar: bool = False,
        axes: bool = False,
        solid: Solid | None = None,
        color: ArrayLike | At | str | None = None,
        label: str = "",
        span: tuple[float, float] | None = None,
        shares: Mapping[str, ArrayLike] | None = None,
        lines: Mapping[str, Iterable[ArrayLike]] | None = None,
        width: float | None = None,
        inside: At | None = None,
        up: Sequence[float] = (0, 0, 1),
        line_width: float | None = None,
    ) -> str:
        """A line drawing as the text of an SVG file, for papers: contours, where the surface turns away from the eye; edges,
        where its faces meet at more than 35°, where it ends, and between the lattice and the faces that the region cut;
        without hidden lines. A ``section`` is hatched; camera, section, scale bar, axes and solid as for ``png``. ``size`` is
        in pixels, parts of one included, ``dpi`` of them an inch: the drawing then has its size in mm. Contours, edges,
        section, hatching and scale_bar are a path each, by these names. Contours are ``line_width`` wide (mm with ``dpi``,
        pixels else; 1/340 of the width of the drawing unless given), other lines thinner in proportion. With ``color``,
        ``shares`` or ``lines``, as for ``png``, a picture of as many pixels lies behind the lines, and a legend in lines and
        words below. ValueError for what cannot be drawn.
        """
        wide, high = (positive("size", v) for v in size)
        pixels = max(round(wide), 1), max(round(high), 1)
        seen, cut = self._camera(pixels, azimuth, elevation, section, projection, scale_bar, axes)
        colours = self._colours(cut[0], color, label, span, shares, lines, width, inside, up)
        stroke = None if line_width is None else positive("line_width", line_width)
        page, of_solid = (*_paper((wide, high), dpi), stroke), None if solid is None else solid._core
        made, fits_foot = self._core.svg(seen, cut, page, of_solid, *colours)
        if not fits_foot:
            _warn_small(seen, "legend, scale bar or axes")
        return made

    def render(
        self,
        path: str | os.PathLike[str],
        size: tuple[float, float] = (1600, 1200),
        azimuth: float = 30,
        elevation: float = 25,
        background: str = "shaded",
        line_width: float | None = None,
        **look: Unpack[Style],
    ) -> None:
        """Writes a picture to a .png file, see ``png``, whose keywords ``look`` are; or a line drawing to an .svg file, see
        ``svg``, without a background, its lines ``line_width`` wide.

        Raises ValueError for another suffix, and for what cannot be drawn.
        """
        check_keywords("render", look, [*parameters(Drawn.render), *parameters(Drawn.png)])
        if extension(path, ("png", "svg")) == "svg":
            made = self.svg(size, azimuth, elevation, line_width=line_width, **look).encode()
        elif line_width is not None:
            raise ValueError("line_width is for an .svg; a .png has no lines of its own")
        else:
            made = self.png(pixels_of(size), azimuth, elevation, background=background, **look)
        write_bytes(path, made)

    def view(self, values: ArrayLike | At | str | None = None, label: str = "", **look: Any) -> View:
        """The mesh to turn, in a notebook or, by ``save(path)``, in a page of its own: see ``View``. ``values`` are a number
        for each vertex by which it is coloured, or a function of points that gives such numbers, ``label`` says what they are,
        with their unit; or ``"thickness"``. Keywords are how it is seen at first, such as ``section="z<4"``. Raises ValueError
        for any other number of values.
        """
        from .viewer import View

        return View(self._picture(), values, label, **look)

    def _camera(
        self,
        size: tuple[int, int],
        azimuth: float,
        elevation: float,
        section: str | None,
        projection: str,
        scale_bar: bool,
        axes: bool,
    ) -> tuple[Eye, Cut]:
        """How a picture is seen, as pixels, angles and whether by parallel rays; the plane of its section, and its marks."""
        wide, high = pixels_of(size)
        angles = number("azimuth", azimuth), number("elevation", elevation)
        if not all(map(math.isfinite, angles)):
            raise ValueError(f"azimuth and elevation are {angles}; they must be finite, degrees")
        if abs(angles[1]) > 90:
            raise ValueError(f"elevation is {angles[1]:g}; it must be from -90 to 90 degrees above the xy plane")
        if projection not in PROJECTIONS:
            raise ValueError(f"projection is {projection!r}; it must be one of {', '.join(PROJECTIONS)}")
        parallel = projection == "orthographic"
        if scale_bar and not parallel:
            raise ValueError(f"scale_bar needs an orthographic projection: {NO_SCALE}")
        plane = None if section is None else self._plane(section, towards(*angles))
        return (wide, high, *angles, parallel), (plane, bool(scale_bar), bool(axes))

    def _plane(self, section: str, eye: tuple[float, float, float], ends: bool = False) -> Plane:
        """The plane of a section; a ValueError where it leaves nothing, or all because it lies outside. With ``ends`` it may be
        that of an end, as when a user moves it there.
        """
        normal, offset = section_plane(section, eye)
        axis = [abs(n) for n in normal].index(1)
        low, high = (end[axis] for end in self.bounds)
        place, slack = normal[axis] * offset, 1e-6 * max(math.dist(*self.bounds), abs(low), abs(high))
        nothing, outside = min(normal[axis] * low, normal[axis] * high) >= offset, not low - slack <= place <= high + slack
        if outside or (nothing and not ends):
            what = "leaves nothing" if nothing else "cuts nothing off"
            raise ValueError(f'section "{section}" {what}: the mesh lies from {low:.6g} to {high:.6g} mm along {"xyz"[axis]}')
        return normal, offset

    def _colours(
        self,
        plane: Plane | None,
        color: ArrayLike | At | str | None,
        label: str,
        span: tuple[float, float] | None,
        shares: Mapping[str, ArrayLike] | None,
        lines: Mapping[str, Iterable[ArrayLike]] | None,
        width: float | None,
        inside: At | None,
        up: Sequence[float],
    ) -> tuple[Tint | None, Shares | None, Lines | None, Inside | None]:
        """A scale, shares, named lines and the colours of a section, as the core takes them; None for what there is not."""
        import numpy as np

        if color is not None and shares is not None:
            raise ValueError("give color or shares, not both")
        at = inside or (color if callable(color) else None)
        tint = None if color is None else self._tint(color, label, span, up)
        mixed = None if shares is None else self._shares(shares, label)
        drawn = None if lines is None else self._lines(lines, "" if tint or mixed else label, width)
        if plane is None or at is None or not (tint or mixed):
            return tint, mixed, drawn, None
        places, grid = self._on(plane)
        found, many = at(places), (len(places), "point")
        if shares is None:
            return tint, mixed, drawn, (*grid, numbers("what inside gives", found, many).tolist())
        if missing := [name for name in shares if name not in found]:
            raise ValueError(f"inside gives no share of {missing[0]}; it must give one of each of {', '.join(shares)}")
        values = np.stack([numbers(f"inside[{name!r}]", found[name], many) for name in shares], axis=1)
        return tint, mixed, drawn, (*grid, values.ravel().tolist())

    def _on(self, plane: Plane) -> tuple[NDArray[np.float64], tuple[list[float], list[list[float]], list[int]]]:
        """Points of a grid in a plane across the bounds; the first point, the steps along and across rows, and the counts."""
        import numpy as np

        normal, offset = plane
        axis = int(np.argmax(np.abs(normal)))
        low, high = np.array(self.bounds)
        origin = low.copy()
        origin[axis] = np.clip(normal[axis] * offset, low[axis], high[axis])
        others = [k for k in range(3) if k != axis]
        most = max(high[k] - low[k] for k in others) or 1.0
        counts = [2 + int(ACROSS * (high[k] - low[k]) / most) for k in others]
        steps = np.zeros((2, 3))
        for step, k, count in zip(steps, others, counts, strict=True):
            step[k] = max(high[k] - low[k], 1e-9 * most) / (count - 1)
        rows, columns = np.arange(counts[1])[:, None, None], np.arange(counts[0])[None, :, None]
        places = np.clip((origin + rows * steps[1] + columns * steps[0]).reshape(-1, 3), low, high)
        return places, (origin.tolist(), steps.tolist(), counts)

    def _tint(self, color: ArrayLike | At | str, label: str, span: tuple[float, float] | None, up: Sequence[float]) -> Tint:
        import numpy as np

        direction, values = None, np.zeros(0)
        if isinstance(color, str):
            if color not in ("thickness", "overhang"):
                words = 'numbers, one for each vertex, a function of points, "thickness" or "overhang"'
                raise ValueError(f'color is "{color}"; it must be {words}')
            if color == "thickness":
                color, label = self.thickness_at_vertices(), label or WALL
        if isinstance(color, str):
            length = math.hypot(*vector_of("up", up))
            if length == 0:
                raise ValueError("up is [0, 0, 0]; it must be a direction")
            direction, label, span = [v / length for v in vector_of("up", up)], label or OVERHANG, span or (0.0, 90.0)
        else:
            values = numbers("color", color(self.vertices) if callable(color) else color, (self.counts[0], "vertex"))
            if not np.isfinite(values).all():
                label = f"{label} ({NO_VALUE})" if label else NO_VALUE
        low, high = (number("span", v) for v in (scale_of("color", values) if span is None else span))
        if not -math.inf < low <= high < math.inf:
            raise ValueError(f"span is {span}; it must be two finite numbers, the lower first")
        return label, values.tolist(), scale_over(low, high), direction

    def _shares(self, shares: Mapping[str, ArrayLike], label: str) -> Shares:
        import numpy as np

        if not shares:
            raise ValueError("shares has no names; give numbers for each vertex by at least one")
        of_vertices = (self.counts[0], "vertex")
        values = np.stack([numbers(f"shares[{name!r}]", of, of_vertices) for name, of in shares.items()], axis=1)
        return label, list(shares), values.ravel().tolist()

    def _lines(self, lines: Mapping[str, Iterable[ArrayLike]], label: str, width: float | None) -> Lines:
        import numpy as np

        found = []
        if not isinstance(lines, Mapping):
            raise TypeError(f"lines must be polylines by name, {{name: [points (n, 3), …]}}, found {lines!r:.80}")
        for kind, (name, some) in enumerate(lines.items()):
            for line in some:
                points = np.asarray(line, dtype=np.float64)
                if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
                    raise ValueError(f"lines[{name!r}] must be arrays (n, 3) of finite numbers, found shape {points.shape}")
                found.append((kind, points.tolist()))
        wide = math.dist(*self.bounds) / 100 if width is None else positive("width", width)
        return label, list(lines), found, wide / 2


def pixels_of(size: tuple[float, float]) -> tuple[int, int]:
    """The width and height of a picture, whole numbers."""
    wide, high = (whole("size", v, 1, 16384) for v in size)
    return wide, high


def numbers(what: str, given: ArrayLike, many: tuple[int, str]) -> NDArray[np.float64]:
    """Numbers, as ``many`` as there are points of a kind, such as (8, "vertex"); a ValueError for anything else."""
    import numpy as np

    values = np.asarray(given, dtype=np.float64)
    if values.shape != (many[0],):
        raise ValueError(f"{what} must be {many[0]} numbers, one for each {many[1]}, found shape {values.shape}")
    return values


def scale_of(what: str, values: NDArray[np.float64]) -> tuple[float, float]:
    """The ends of the scale that shows these values; a ValueError where none of them is a finite number."""
    import numpy as np

    finite = values[np.isfinite(values)]
    if values.size and not finite.size:
        raise ValueError(f"{what} has no finite number, so there is nothing to show")
    return scale_over(float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)


def scale_over(low: float, high: float) -> tuple[float, float]:
    """The ends of a scale over these numbers: one value alone is in the middle of a scale from 0, and 0 the end of 0 to 1."""
    if high - low > 1e-9 * max(abs(low), abs(high)):
        return low, high
    return (min(0.0, 2 * high), max(0.0, 2 * high)) if high else (0.0, 1.0)


def _paper(pixels: tuple[float, float], dpi: float | None) -> tuple[list[float], str]:
    """The size of a drawing, and its unit: mm where pixels are so many an inch."""
    if dpi is None:
        return list(pixels), "px"
    wide, high = (round(25.4 * v / positive("dpi", dpi), 2) for v in pixels)
    if not 0.1 <= wide <= 1e5:
        raise ValueError(f"dpi is {dpi:g}, by which {pixels[0]:g} pixels are {wide:g} mm; a drawing is 0.1 to 1e5 mm wide")
    return [wide, max(high, 0.01)], "mm"


def _warn_small(seen: Eye, what: str) -> None:
    words = f"a picture of {seen[0]} × {seen[1]} pixels is too small for {what}: none is drawn"
    warn_caller(words)
