"""Parts that outgrow one process or one run, range by range: surfaces and their figures by tiles of the grid, voxels and layers
for machines by layers.

Ranges are made by threads here or by the workers of a cluster, and stand in a folder as soon as they are made: a run goes on
where the last one ended. The result is that of one process to the last byte.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from .. import _core
from ..base import terminal
from ..base.files import whole_file
from ..base.given import thread_count
from ..base.paths import data_of, moved
from .clusters import connected, in_order
from .sent import digest_of, files_of, put_files
from .shared_file import Written, write_at
from .unfinished import Shards, Unfinished

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..base.islands import Islands
    from ..base.resolution import Resolution
    from ..layers import LayerFile, Layers
    from ..reports import IslandsReport, LayersReport, MeshReport, QualityReport, SurfaceReport

    Progress = Callable[[int, int], Any]

__all__ = ["measure", "save", "save_layers", "save_voxels"]

#: Bytes of a range, about: few enough that its memory is used again by the next one rather than given back to the system.
WANTED = 1 << 23
#: The most ranges that a worker makes at a time, when they stay on this machine and when they may be sent: a task costs Dask
#: about as much time as a range, and one result at a time is in the memory of this process.
AT_ONCE, SENT_AT_ONCE = 16, 4
#: The fewest tasks of a part, so that all workers have some.
TASKS = 16
#: Layers for machines in a range, and the most ranges of them.
LAYERS, LAYER_RANGES = 4, 1 << 12
#: Bytes of the header and of a triangle of a binary STL, and the most triangles that it counts.
HEADER, RECORD, MOST = _core.STL_HEADER, _core.STL_RECORD, 2**32 - 1

#: For each kind of work what gives its ranges, of a solid and settings.
KINDS: dict[str, Callable[..., Any]] = {
    "surface": lambda solid, edge, moved=None: _core.TileRanges.of(solid, edge, False, moved),
    "figures": lambda solid, edge, moved=None: _core.TileRanges.of(solid, edge, True, moved),
    "voxels": lambda solid, edge: _core.VoxelRanges.of(solid, edge),
    "layers": lambda solid, plan, **file: _core.LayerRanges.of(_core.Layers.of(solid, **plan), **file),
}


def save(
    solid: Resolution,
    path: str,
    spacing: float,
    islands: Islands,
    threads: int | None = None,
    progress: Progress | None = None,
    cluster: str | None = None,
    new: bool = False,
    size: int | None = None,
    shards: int | None = None,
    accept: Callable[[SurfaceReport, str], Any] = lambda made, words: None,
) -> SurfaceReport:
    """Writes the surface of a solid at a grid ``spacing`` (mm) as binary STL, in ranges of ``size`` tiles; gives its report.
    ``accept`` is called with the report and one sentence on its components before the file gets its name. With ``shards``
    ``path`` is a folder of files of about this number of bytes.

    Raises ValueError for a solid that is not meshed on a grid and for a cluster that cannot be used, Refused for the folder of
    another run, OSError for a disk that is full.
    """
    more = {"islands": islands} | ({"shards": shards} if shards else {})
    work = _Work("surface", solid, {"edge": spacing}, path, HEADER, more, size or _tiles_at_once(solid, spacing, shards))
    with work.opened(new):
        joined = _core.Joined()
        work.make(joined.add, cluster, threads, progress)
        report, words, kept, _ = joined.finish(spacing, islands)
        accept(report, words)
        if shards:
            about = work.folder.head | {"design": solid._core.design, "surface": report.to_dict()}
            files = Shards("stl", shards, lambda a, b: (_core.stl_header(b - a), b""), lambda a, b: {"triangles": b - a})
            work.folder.split(kept, RECORD, files, about)
        else:
            work.folder.keep(kept, RECORD, _core.stl_header(report.triangles))
    work.folder.finish()
    return report


def measure(
    solid: Resolution,
    spacing: float,
    region: float,
    threads: int | None = None,
    progress: Progress | None = None,
    cluster: str | None = None,
    new: bool = False,
    design_file: str | None = None,
    size: int | None = None,
) -> tuple[MeshReport, QualityReport | None, IslandsReport]:
    """What is measured of the surface at a grid ``spacing`` (mm), in a ``region`` of this volume (mm³), in ranges of ``size``
    tiles: its figures, the quality of its triangles, its other connected components. With ``design_file``, its path, what is
    done is kept next to it for a later run; else nothing is kept.

    Raises as ``save``.
    """
    with tempfile.TemporaryDirectory(prefix="trabecula-") as scratch:
        output = f"{design_file}.figures" if design_file else os.path.join(scratch, "figures")
        work = _Work("figures", solid, {"edge": spacing}, output, 0, {}, size or _tiles_at_once(solid, spacing))
        with work.opened(new):
            joined = _core.Joined()
            work.make(joined.add, cluster, threads, progress)
            made = joined.measured(spacing, region)
        work.folder.finish()
    return made


def save_voxels(
    solid: Resolution,
    path: str,
    kind: str,
    step: float,
    threads: int | None = None,
    progress: Progress | None = None,
    cluster: str | None = None,
    new: bool = False,
    size: int | None = None,
    shards: int | None = None,
    accept: Callable[[float], Any] = lambda volume: None,
) -> dict[str, Any]:
    """Writes a solid as voxels of edge ``step`` (mm) to a file of a ``kind`` ("npy", "vti"), in ranges of ``size`` layers.
    ``accept`` is called with the volume (mm³) before the file gets its name. With ``shards`` ``path`` is a folder of files of
    about this number of bytes, whole layers each. Gives ``shape``, ``step``, ``origin`` (mm) and ``volume``.

    Raises as ``save``.
    """
    grid = _core.VoxelRanges.of(solid._core, step)
    nx, ny, nz = grid.shape
    head, tail = grid.frame(kind, 0, nz)
    more = {"kind": kind} | ({"shards": shards} if shards else {})
    size = size or max(min(WANTED, shards or WANTED) // (nx * ny), 1)
    work = _Work("voxels", solid, {"edge": step}, path, len(head), more, size, size * nx * ny)
    with work.opened(new):
        counts: list[int] = []
        work.make(lambda partial: counts.append(int.from_bytes(partial, "little")), cluster, threads, progress)
        volume = float(sum(counts)) * step**3
        accept(volume)
        made = {"shape": [nx, ny, nz], "step": step, "origin": list(grid.origin), "volume": volume}
        if shards:
            files = Shards(kind, shards, lambda a, b: grid.frame(kind, a, b), lambda a, b: {"layers": [a, b]})
            about = work.folder.head | {"design": solid._core.design, "voxels": made}
            bricks = work.folder.split([(0, nz)], nx * ny, files, about)
            if kind == "vti":
                with open(os.path.join(work.folder.name("shards"), "all.pvti"), "w", encoding="utf-8", newline="\n") as index:
                    index.write(grid.index([(brick["file"], *brick["layers"]) for brick in bricks]))
        else:
            work.folder.keep([(0, nz)], nx * ny, head, tail)
    work.folder.finish()
    return made


def save_layers(
    layers: Layers,
    path: str,
    file: LayerFile,
    threads: int | None = None,
    progress: Progress | None = None,
    cluster: str | None = None,
    new: bool = False,
    size: int | None = None,
) -> LayersReport:
    """Writes layers for machines, in ranges of ``size`` layers; ``file`` says what ``_core.LayerRanges.of`` takes besides them.
    Gives their figures.

    Raises as ``save``.
    """
    pixels = file["pixel"][1] if file["pixel"] else (1, 1)
    most = max(-(-len(layers) // LAYER_RANGES), LAYERS)
    size = size or max(min(most, WANTED // (pixels[0] * pixels[1])), 1)
    settings = {"plan": layers._plan, **file}
    work = _Work("layers", layers._solid, settings, path, 0, {}, size, size * pixels[0] * pixels[1])
    with work.opened(new):
        partials: list[bytes] = []
        work.make(partials.append, cluster, threads, progress)
        with whole_file(path) as temporary:
            made = work.ranges.join(temporary, work.folder.name("data"), partials)
    work.folder.finish()
    return made


def _tiles_at_once(solid: Resolution, spacing: float, most: int | None = None) -> int:
    """The number of tiles whose triangles take about as many bytes as are wanted, and no more than ``most``."""
    made = solid._core.estimate(spacing, spacing)
    tiles = 1.0
    for n in made.cells:
        tiles *= -(-n // _core.TILE)
    return int(min(max(min(WANTED, most or WANTED) * tiles / made.stl, 1), 4096))


class _Work:
    """Ranges of ``size`` tiles or layers, about ``heavy`` bytes each, that are to be made of a solid, and the folder in which
    they stand.
    """

    def __init__(
        self,
        kind: str,
        solid: Resolution,
        settings: dict[str, Any],
        output: str,
        first: int,
        more: dict[str, Any],
        size: int,
        heavy: int = WANTED,
    ):
        self.ranges = KINDS[kind](solid._core, **settings)
        self.size = size
        #: By how much fewer ranges a worker makes at a time, since these are large.
        self.share = min(1.0, WANTED / heavy)
        self.count = -(-self.ranges.count // size)
        files = files_of(solid)
        text = solid._core.design
        head = {
            "of": kind,
            "version": _core.__version__,
            "design": hashlib.sha256(text.encode()).hexdigest(),
            "files": {name: digest_of(content.items()) for name, content in files.items()},
            **settings,
            **more,
            "count": self.ranges.count,
            "range": size,
        }
        self.folder = Unfinished(output, head, first)
        self.limit = HEADER + RECORD * MOST if kind == "surface" and "shards" not in more else None
        key = hashlib.sha256(repr(sorted(head.items())).encode()).hexdigest()
        # What was found by measuring the solid is not found again by each worker.
        known = {"moved": self.ranges.moved} if "edge" in settings and kind != "voxels" else {}
        about = {"key": key, "of": kind, "version": _core.__version__, "settings": settings | known}
        self.job = about | {"design": text, "files": files}

    @contextmanager
    def opened(self, new: bool) -> Iterator[None]:
        """The folder, while it is worked in. After any other end says what stands there; a folder without a range goes."""
        try:
            with self.folder.opened(new):
                try:
                    yield
                except BaseException:
                    if not self.folder.ranges:
                        shutil.rmtree(self.folder.folder, ignore_errors=True)
                    raise
        except BaseException:
            if done := len(self.folder.ranges):
                where = f"{done} of {self.count} ranges stand in {self.folder.folder}"
                terminal.left.append(f"{where}; the same command goes on from there")
            raise

    def make(self, join: Callable[[bytes], Any], cluster: str | None, threads: int | None, progress: Progress | None) -> None:
        """Makes what is missing or damaged, and calls ``join`` with the partial results of all ranges in order."""
        folder = self.folder
        begun = len(folder.ranges)
        damaged = folder.damaged()
        if begun:
            again = f", {len(damaged)} of them damaged and made again" if damaged else ""
            terminal.say(f"{begun} of {self.count} ranges are there already ({folder.folder}){again}")

        def put(number: int, data: bytes | Written, partial: bytes) -> None:
            folder.add(number, data, partial)
            if self.limit and folder.length > self.limit:
                raise ValueError("more than 2^32 triangles, the most an STL can count; use a larger edge")
            if number >= begun:
                join(partial)
            if progress:
                progress(len(folder.ranges), self.count)

        self._make(damaged, cluster, threads, put)
        for partial in folder.partials():
            join(partial)
        self._make(list(range(begun, self.count)), cluster, threads, put)

    def _make(
        self,
        missing: list[int],
        cluster: str | None,
        threads: int | None,
        put: Callable[[int, bytes | Written, bytes], None],
    ) -> None:
        """Makes ranges by their numbers, and calls ``put`` with each, in order."""
        if missing and cluster:
            self._make_by(cluster, missing, put)
            return
        for first, end in _rows(missing):  # ranges in a row are made without a pause between them
            self.ranges.each(
                first * self.size,
                end * self.size,
                self.size,
                lambda start, _, data, partial: put(start // self.size, data, partial),
                thread_count(threads),
            )

    def _make_by(self, cluster: str, missing: list[int], put: Callable[[int, bytes | Written, bytes], None]) -> None:
        """As ``_make``, by a cluster. Workers on this machine write what follows the ranges so far to its place."""
        last = self.ranges.count
        most = AT_ONCE if cluster.startswith("local:") else SENT_AT_ONCE
        most = max(min(int(most * self.share), len(missing) // TASKS), 1)
        rows = [(n, min(n + most, end)) for first, end in _rows(missing) for n in range(first, end, most)]
        tasks = [(first * self.size, min(end * self.size, last), self.size) for first, end in rows]
        follow = missing[0] == len(self.folder.ranges)
        place = self.folder.length
        with connected(cluster) as client, self.folder.shared() as file:

            def put_of(lengths: list[int]) -> tuple:
                nonlocal place
                at, place = place, place + sum(lengths)
                return put_made, file if follow else None, at

            made = in_order(client, made_of, self.job, tasks, lengths_of, put_of)
            for (first, _), ranges in zip(rows, made, strict=True):
                for number, (data, partial) in enumerate(ranges, first):
                    put(number, data, partial)


def _rows(numbers: list[int]) -> Iterator[tuple[int, int]]:
    """Ascending numbers as ranges."""
    first = None
    for n, number in enumerate(numbers):
        first = number if first is None else first
        if n + 1 == len(numbers) or numbers[n + 1] != number + 1:
            yield first, number + 1
            first = None


# --- workers ---------------------------------------------------------------------------------------------------------

#: What gives the ranges of the last job of this process.
_last: tuple[str, Any] | None = None
_lock = threading.Lock()


def made_of(job: dict[str, Any], start: int, end: int, size: int) -> list[tuple[bytes, bytes]]:
    """Ranges of a job: of each its bytes and its partial result. Workers of clusters call it.

    Raises ValueError for a job of another version.
    """
    if job["version"] != _core.__version__:
        raise ValueError(f"a worker has version {_core.__version__}, the job is of {job['version']}")
    made: list[tuple[bytes, bytes]] = []
    _ranges_of(job).each(start, end, size, lambda _, __, data, partial: made.append((data, partial)), 1)
    return made


def lengths_of(made: list[tuple[bytes, bytes]]) -> list[int]:
    """The numbers of bytes of ranges."""
    return [len(data) for data, _ in made]


def put_made(made: list[tuple[bytes, bytes]], file: dict[str, Any] | None, place: int) -> list[tuple[bytes | Written, bytes]]:
    """Ranges as they go to the process that asks: as what stands at their place in its file, if it is seen from here; else
    themselves.
    """
    written = file and write_at(file, place, [data for data, _ in made])
    return [(at, partial) for at, (_, partial) in zip(written, made, strict=True)] if written else list(made)


def _ranges_of(job: dict[str, Any]) -> Any:
    global _last
    with _lock:
        if _last is None or _last[0] != job["key"]:
            with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
                places = put_files(job["files"], folder)
                data = moved(data_of(job["design"]), lambda name: places.get(name, name))
                built = _core.Design.from_data(data).build(folder)
            _last = job["key"], KINDS[job["of"]](built, **job["settings"])
        return _last[1]
