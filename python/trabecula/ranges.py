"""Surfaces range by range of the grid's tiles: by the workers of a cluster, or by runs that go on where the last one ended. The
file is that of one process to the last byte.
"""

from __future__ import annotations

import glob
import hashlib
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from typing import Any

from . import _core, terminal
from .clusters import connected, in_order
from .design import _files, _moved, parsed
from .given import thread_count
from .unfinished import Unfinished

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from .islands import Islands
    from .reports import SurfaceReport
    from .solid import Solid

__all__ = ["save"]

#: Bytes of a range's triangles, about: what a worker holds, and sends, at a time.
WANTED = 1 << 24
#: Bytes of the header and of a triangle of a binary STL.
HEADER, RECORD = 84, 50
#: Most triangles of a binary STL.
MOST = 2**32 - 1


def save(
    solid: Solid,
    path: str,
    spacing: float,
    islands: Islands,
    threads: int | None = None,
    progress: Callable[[int, int], Any] | None = None,
    cluster: str | None = None,
    new: bool = False,
    size: int | None = None,
    accept: Callable[[SurfaceReport, str], Any] = lambda made, words: None,
) -> SurfaceReport:
    """Writes the surface of a solid as binary STL by way of the folder ``path``.parts, in which ranges of ``size`` tiles stand as soon as
    they are made; goes on from one that is there, unless a ``new`` run is wanted. ``accept`` is told of the surface before it gets
    its name. Gives its report.

    Raises ValueError for a solid that is not meshed on a grid and for a cluster that cannot be used, Refused for the folder of another
    run, OSError for a disk that is full.
    """
    tiles = _core.TileRanges.of(solid._core, spacing)
    if size is None:
        bytes_of_tile = solid.estimate(spacing).stl / tiles.tiles
        size = int(min(max(WANTED / bytes_of_tile, 1), 4096))
    inputs = _inputs(solid)
    head = {
        "of": "surface",
        "version": _core.__version__,
        "design": hashlib.sha256(solid._core.design.encode()).hexdigest(),
        "files": {name: _digest(files) for name, files in inputs.items()},
        "edge": spacing,
        "islands": islands,
        "tiles": tiles.tiles,
        "range": size,
    }
    unfinished = Unfinished(path, head, HEADER)
    job = {"version": _core.__version__, "design": solid._core.design, "files": inputs, "edge": spacing}
    job["key"] = hashlib.sha256(repr(sorted(head.items())).encode()).hexdigest()
    work = _Work(tiles, size, unfinished, job, threads, progress or (lambda done, total: None))
    try:
        with unfinished.opened(new):
            joined = work.done(cluster)
            report, words, kept, _ = joined.finish(spacing, islands)
            accept(report, words)
            unfinished.keep(kept, RECORD, _core.stl_header(report.triangles))
    except BaseException:
        if unfinished.ranges:
            terminal.left.append(
                f"{len(unfinished.ranges)} of {work.count} ranges of tiles stand in {unfinished.folder}; the same command goes on from there"
            )
        raise
    unfinished.finish()
    return report


class _Work:
    """The ranges of a surface that are to be made."""

    def __init__(
        self,
        tiles: _core.TileRanges,
        size: int,
        unfinished: Unfinished,
        job: dict[str, Any],
        threads: int | None,
        progress: Callable[[int, int], Any],
    ):
        self.tiles = tiles
        self.size = size
        self.unfinished = unfinished
        self.job = job
        self.threads = thread_count(threads)
        self.progress = progress
        self.count = -(-tiles.tiles // size)

    def done(self, cluster: str | None) -> _core.Joined:
        """Makes what is missing or damaged; all partial results, joined."""
        unfinished = self.unfinished
        begun = len(unfinished.ranges)
        damaged = [] if unfinished.stage else unfinished.damaged()
        if begun:
            again = f", {len(damaged)} of them damaged and made again" if damaged else ""
            terminal.say(f"{begun} of {self.count} ranges of tiles are there already ({unfinished.folder}){again}")
        missing = [*damaged, *range(begun, self.count)]
        joined = _core.Joined()

        def join() -> None:
            for partial in unfinished.partials():
                joined.add(partial)

        if not damaged:
            join()

        def take(number: int, records: bytes, partial: bytes) -> None:
            unfinished.add(number, records, partial)
            if unfinished.length > HEADER + RECORD * MOST:
                raise ValueError("more than 2^32 triangles, the most an STL can count; use a larger edge")
            if number >= begun:
                joined.add(partial)
            elif number == damaged[-1]:
                join()
            self.progress(len(unfinished.ranges), self.count)

        if missing and cluster:
            self._by_cluster(missing, cluster, take)
        elif missing:
            self._here(missing, take)
        return joined

    def _here(self, missing: list[int], take: Callable[[int, bytes, bytes], None]) -> None:
        """By this process: ranges in a row are made without a pause between them."""
        for first, end in _rows(missing):

            def taken(start: int, _: int, records: bytes, partial: bytes) -> None:
                take(start // self.size, records, partial)

            self.tiles.each(first * self.size, end * self.size, self.size, taken, self.threads)

    def _by_cluster(self, missing: list[int], cluster: str, take: Callable[[int, bytes, bytes], None]) -> None:
        with connected(cluster) as client:
            tasks = [(n * self.size, min((n + 1) * self.size, self.tiles.tiles), self.size) for n in missing]
            made = in_order(client, range_of, self.job, tasks)
            for number, (records, partial) in zip(missing, made, strict=True):
                take(number, records, partial)


def _rows(numbers: list[int]) -> Iterator[tuple[int, int]]:
    """Ascending numbers as ranges."""
    first = None
    for n, number in enumerate(numbers):
        first = number if first is None else first
        if n + 1 == len(numbers) or numbers[n + 1] != number + 1:
            yield first, number + 1
            first = None


# --- workers ---------------------------------------------------------------------------------------------------------

#: The tiles of the last job of this process.
_last: tuple[str, _core.TileRanges] | None = None
_lock = threading.Lock()


def range_of(job: dict[str, Any], start: int, end: int, size: int) -> tuple[bytes, bytes]:
    """A range of tiles of a job: triangles and partial result. Workers of clusters call it.

    Raises ValueError for a job of another version.
    """
    if job["version"] != _core.__version__:
        raise ValueError(f"a worker has version {_core.__version__}, the job is of {job['version']}")
    made: list[tuple[bytes, bytes]] = []
    _tiles_of(job).each(start, end, size, lambda _, __, records, partial: made.append((records, partial)), 1)
    return made[0]


def _tiles_of(job: dict[str, Any]) -> _core.TileRanges:
    global _last
    with _lock:
        if _last is None or _last[0] != job["key"]:
            with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
                _last = job["key"], _core.TileRanges.of(_built(job, folder), job["edge"])
        return _last[1]


def _built(job: dict[str, Any], folder: str) -> _core.Solid:
    """The solid of a job, whose files are put into a folder."""
    if not job["files"]:
        return _core.Design.from_text(job["design"]).build(folder)
    places = {}
    for n, (name, files) in enumerate(job["files"].items()):
        places[name] = f"{n}/{os.path.basename(name)}"
        for inner, content in files.items():
            at = os.path.join(folder, str(n), inner)
            os.makedirs(os.path.dirname(at), exist_ok=True)
            with open(at, "wb") as file:
                file.write(content)
    data = parsed(job["design"], False, "<design>", folder).to_dict()
    return _core.Design.from_data(_moved(data, lambda name: places.get(name, name))).build(folder)


def _inputs(solid: Solid) -> dict[str, dict[str, bytes]]:
    """The files that a design reads, by the names it has for them: each by its own name, or those of a pattern or a folder."""
    data = parsed(solid._core.design, False, "<design>", solid._folder).to_dict()
    made = {}
    for name in _files(data):
        path = os.path.join(solid._folder, name)
        if os.path.isdir(path):
            inner = [os.path.join(at, one) for at, _, files in os.walk(path) for one in files]
            base = os.path.dirname(path.rstrip(os.sep))
        else:
            inner, base = sorted(glob.glob(glob.escape(path).replace("[*]", "*"))), os.path.dirname(path)
        made[name] = {os.path.relpath(one, base): _content(one) for one in sorted(inner)}
    return made


def _content(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


def _digest(files: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name, content in files.items():
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()
