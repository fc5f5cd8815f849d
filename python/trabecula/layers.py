"""Layers of a solid from its field: contours as arrays, and files for machines."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from . import _core
from .base.files import check_place, extension, special, whole_file, write_svg, write_text
from .base.formats import LAYER_WRITES, LAYERS
from .base.given import number, positive, whole
from .base.machine import fits
from .base.reproducible import Reproducible
from .pictures.outlines import outlines_svg

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any, NoReturn, TypedDict, overload

    import numpy as np
    from numpy.typing import NDArray

    from ._core import Raster
    from .reports import LayersReport
    from .solid import Solid

    Progress = Callable[[int, int], Any]

    class LayerFile(TypedDict):
        """What a file of layers is: the arguments of ``_core.LayerRanges.of``."""

        suffix: str
        title: str
        binary: bool
        pixel: Raster | None
        exposure: list[float]


__all__ = ["Layer", "Layers"]

#: Layers that are made at once while a sequence is gone through.
AHEAD = 8
#: Most pixels along an edge of a picture.
MOST_PIXELS = 1 << 20


@dataclass(frozen=True, eq=False)
class Layer:
    """The cross-section of a part in one layer."""

    #: Height of the section, in the middle of the layer, mm.
    z: float
    #: Lower face of the layer, mm.
    bottom: float
    #: Upper face, mm.
    top: float
    #: Closed contours (n, 2), mm, the first point repeated at the end: simple polygons that do not meet, outer ones
    #: counter-clockwise, holes clockwise.
    loops: list[NDArray[np.float64]]
    #: Area of the section, mm².
    area: float

    @property
    def height(self) -> float:
        """Thickness of the layer, mm."""
        return self.top - self.bottom

    def svg(self) -> str:
        """A drawing in mm, y upwards, the solid filled."""
        return outlines_svg([loop[:-1] for loop in self.loops])

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the drawing (.svg)."""
        write_svg(path, self.svg)

    def __repr__(self) -> str:
        return f"<trabecula.Layer at z = {self.z:g} mm: {len(self.loops)} contours, {self.area:.6g} mm²>"


class Layers(Reproducible, Sequence["Layer"]):
    """The layers of a solid, made when they are asked for. Made by ``Solid.layers``."""

    _make = staticmethod(_core.Layers.of)
    _core: _core.Layers
    _solid: Solid

    def __init__(self, solid: Solid, plan: dict[str, Any], threads: int | None = None):
        super().__init__(solid, plan)
        self._threads = threads
        #: Where layers begin, and the end of the last one, mm.
        self.heights: list[float] = self._core.heights

    def __repr__(self) -> str:
        return f"<trabecula.Layers: {len(self)} from {self.heights[0]:g} to {self.heights[-1]:g} mm>"

    def __len__(self) -> int:
        return len(self.heights) - 1

    if TYPE_CHECKING:

        @overload
        def __getitem__(self, index: int) -> Layer: ...
        @overload
        def __getitem__(self, index: slice) -> list[Layer]: ...

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        try:
            index = operator.index(index)
        except TypeError:
            raise TypeError(f"layer must be a whole number, found {index!r}") from None
        at = index + len(self) if index < 0 else index
        if not 0 <= at < len(self):
            raise IndexError(f"layer {index} of {len(self)}")
        return _layer(self._core.some(at, 1, self._threads)[0])

    def __iter__(self) -> Iterator[Layer]:
        for first in range(0, len(self), AHEAD):
            yield from map(_layer, self._core.some(first, AHEAD, self._threads))

    def at(self, z: float) -> Layer:
        """The section at a height ``z`` (mm): a layer without thickness."""
        height = number("z", z)
        if not math.isfinite(height):
            raise ValueError(f"z is {height}; it must be a finite number, mm")
        return _layer(self._core.at(height))

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        binary: bool = False,
        pixel: float | None = None,
        size: tuple[int, int] | None = None,
        exposure: tuple[float, float] | None = None,
        progress: Progress | None = None,
        resume: bool = False,
        cluster: str | None = None,
        new: bool = False,
    ) -> LayersReport:
        """Writes all layers to a file and gives its figures; a few layers are held in memory at a time.

        ``path`` ends in .cli (``binary`` or text), .svg, .3mf (slices), or for pictures in .zip (PNG and a manifest), .sl1
        (resin printers), .tif or .npy (uint8, indexed [x, y, layer]). Pictures need ``pixel``, the edge of a pixel in mm; grey
        is the exact area fraction of the pixel. ``size`` is their width and height in pixels, the part in the middle; without
        it they are as large as the region. ``exposure`` (s, of layers and of the first ones; 8 and 35 unless given) is for
        .sl1.

        With ``resume`` layers stand in the folder ``path``.parts as soon as they are made, and after any end the same call goes
        on there, unless a ``new`` run is wanted. With ``cluster`` they are made by the workers of a Dask cluster, an address or
        "local:N" (extra ``scale``). The file is put together at the end, the same to the last byte.
        """
        kind = extension(path, LAYER_WRITES)
        row = LAYERS[kind]
        if binary and kind != "cli":
            raise ValueError(f"binary is for .cli; {os.fsdecode(path)} has one form only")
        steps = [b - a for a, b in zip(self.heights, self.heights[1:], strict=False)]
        if row.uniform and any(abs(step - steps[0]) > 1e-9 * steps[0] for step in steps[1:-1]):
            raise ValueError(f"a .{kind} has layers of one thickness; write adaptive layers as .cli, .svg, .3mf or .zip")
        raster = None
        if row.pictures:
            raster = self._raster(kind, pixel, size)
        elif pixel is not None or size is not None:
            pictures = ", ".join(f".{name}" for name, of in LAYERS.items() if of.pictures)
            raise ValueError(f"pixel and size are for pictures ({pictures}); a .{kind} holds contours")
        if exposure is not None and kind != "sl1":
            raise ValueError(f"exposure is for .sl1; a .{kind} holds no times")
        times = [positive("exposure", t) for t in exposure or (8.0, 35.0)]
        check_place(path)
        if special(os.fsdecode(path)):
            raise ValueError(f"{os.fsdecode(path)} is a device or a pipe; layers are written to a file")
        title = os.path.splitext(os.path.basename(os.fsdecode(path)))[0]
        if raster:
            self._check_room(kind, path, raster[1], raster[0])
        file: LayerFile = {"suffix": kind, "title": title, "binary": binary, "pixel": raster, "exposure": times}
        if resume or cluster or new:
            from .jobs import ranges

            return ranges.save_layers(self, os.fsdecode(path), file, self._threads, progress, cluster, new)
        with whole_file(path) as temporary:
            return _core.LayerRanges.of(self._core, **file).save(temporary, self._threads, progress)

    def save_each(self, path: str | os.PathLike[str], progress: Progress | None = None) -> LayersReport:
        """Writes each layer to a drawing of its own and gives their figures; a few layers are held in memory at a time.

        ``path`` ends in .svg. The drawings stand in a new folder with the name of ``path`` without that, which appears when all
        are there; their names are the numbers of the layers from 0. All are as large as the region's bounds, in mm, so that
        they lie on each other. Raises ValueError for another suffix, and where there is such a folder.
        """
        import tempfile

        import numpy as np

        from .reports import LayersReport

        extension(path, ("svg",))
        folder = os.path.splitext(check_place(path))[0]
        if os.path.lexists(folder):
            raise ValueError(f"{folder} exists; drawings of layers go to a new folder of this name")
        frame, digits = np.array(self._solid.bounds)[:, :2], len(str(len(self) - 1))
        contours, areas, volumes, points = [], [], [], 0
        with tempfile.TemporaryDirectory(prefix=f"{os.path.basename(folder)}.", dir=os.path.dirname(folder)) as temporary:
            unfinished = os.path.join(temporary, "layers")
            os.mkdir(unfinished)
            for index, layer in enumerate(self):
                loops = [loop[:-1] for loop in layer.loops]
                write_text(os.path.join(unfinished, f"{index:0{digits}}.svg"), outlines_svg(loops, frame))
                contours.append(len(loops))
                areas.append(layer.area)
                volumes.append(layer.area * layer.height)
                points += sum(map(len, loops))
                if progress is not None:
                    progress(index + 1, len(self))
            os.rename(unfinished, folder)
        figures = {"contours": sum(contours), "empty": contours.count(0), "largest": max(areas), "layers": len(self)}
        return LayersReport(figures | {"points": points, "volume": math.fsum(volumes)})

    def _raster(self, kind: str, pixel: float | None, size: tuple[int, int] | None) -> Raster:
        """Edge of a pixel, numbers of pixels and the lower left corner of pictures."""
        if pixel is None:
            raise ValueError(f"a .{kind} holds pictures: give pixel, the edge of a pixel in mm")
        edge = positive("pixel", pixel)
        low, high = self._solid.bounds
        extents = [high[a] - low[a] for a in (0, 1)]
        needed = [max(1, math.ceil(e / edge - 1e-9)) for e in extents]
        if size is not None and len(size) != 2:
            raise ValueError(f"size is the width and height of a picture in pixels, found {len(size)} numbers")
        asked = needed if size is None else size
        pixels = [whole("size", n, 1, MOST_PIXELS) if n <= MOST_PIXELS else _too_many(n, edge) for n in asked]
        if any(n < m for n, m in zip(pixels, needed, strict=True)):
            raise ValueError(
                f"pictures of {pixels[0]} x {pixels[1]} pixels of {edge:g} mm are smaller than the part: it needs "
                f"{needed[0]} x {needed[1]}; use a larger pixel, or turn or divide the part"
            )
        origin = [low[a] - 0.5 * (pixels[a] * edge - extents[a]) for a in (0, 1)]
        return edge, pixels, origin

    def _check_room(self, kind: str, path: str | os.PathLike[str], size: list[int], pixel: float) -> None:
        """Refuses pictures that neither memory nor disk can hold."""
        count = size[0] * size[1]
        threads = self._threads or os.cpu_count() or 1
        held = 2.0 * threads * count if kind == "npy" else 0.1 * threads * count
        fits(held, f"pictures of {size[0]} x {size[1]} pixels", edge=pixel, power=2, word="pixel")
        if kind == "npy":
            fits(float(count) * len(self), f"{len(self)} pictures of {size[0]} x {size[1]} pixels", path, pixel, 2, "pixel")


def _too_many(count: int, edge: float) -> NoReturn:
    raise ValueError(f"pixel {edge:g} mm makes {count:.3g} pixels along an edge; at most {MOST_PIXELS} are possible")


def _layer(made: _core.Section) -> Layer:
    return Layer(*made)
