"""Work of many hours in a folder next to its output: what is done stands there with checksums, and the same command goes on."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import zlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict, dataclass
from typing import Any

from .errors import Refused
from .files import replace_file
from .shared_file import Written, shared, withdraw, write

__all__ = ["Range", "Unfinished", "alone"]

#: Bytes of which the disk holds two copies while the output is put together and has no room for more.
CHUNK = 1 << 26
#: Bytes that are read at once.
PIECE = 1 << 20


@dataclass(frozen=True)
class Range:
    """A range of tiles that is done: its number, and length and SHA-256 of its bytes and of its partial result."""

    number: int
    bytes: int
    sha256: str
    partial: int
    partial_sha256: str


class Unfinished:
    """The folder of an output: its bytes so far (``data``, after ``first`` bytes of a header), partial results (``partials``),
    and a line of JSON for each range, after one that says what it is of (``lines``), each after its CRC-32.

    Ranges are added in order. A line is written after its bytes; what has no line is not there, and what does not have the
    checksum of its line is made again.
    """

    def __init__(self, output: str, head: dict[str, Any], first: int):
        self.output = output
        self.folder = f"{output}.parts"
        self.head = json.loads(json.dumps(head))
        self.first = first
        self.ranges: list[Range] = []
        #: What is done besides: the lines of the last stage.
        self.stage: list[dict[str, Any]] = []

    def name(self, of: str) -> str:
        """The path of a file in the folder."""
        return os.path.join(self.folder, of)

    @contextmanager
    def opened(self, new: bool = False) -> Iterator[None]:
        """Makes the folder, or takes it up unless a ``new`` run is wanted; ``ranges`` are then those of an earlier run.

        Raises Refused for a folder of another design or version, with what differs, and for one that another process works in;
        OSError for a disk that is full, here or where a worker writes.
        """
        os.makedirs(self.folder, exist_ok=True)
        name = self.name("lines")
        with open(name, "a+b") as self._lines:
            alone(self._lines, self.folder)
            withdraw(self.name("data"))
            self._lines.seek(0)
            raw = self._lines.read()
            read, length = _lines_of(raw)
            if b"\n" in raw and not read and not new:
                raise Refused(f"lines in {self.folder} is damaged: it does not say what it is of; begin anew with --new")
            self._lines.truncate(length)
            if new or not read:
                self._lines.truncate(0)
                read = []
                for name in ("data", "partials", "whole"):
                    with suppress(FileNotFoundError):
                        os.remove(self.name(name))
            else:
                self._same(read[0])
            self.ranges = [Range(**line) for line in read[1:] if "number" in line]
            self.stage = [line for line in read[1:] if "number" not in line]
            if not read:
                self._note(self.head)
            with open(self.name("partials"), "a+b"), open(self.name("data"), "a+b"):
                pass
            # Without buffers, which would hide what workers write.
            with open(self.name("data"), "r+b", 0) as self._data, open(self.name("partials"), "r+b", 0) as self._partials:
                if not self.stage:
                    self._data.truncate(self.place(len(self.ranges)))
                self._partials.truncate(self.partial_place(len(self.ranges)))
                #: Where the next range begins, in both.
                self._end = self.place(len(self.ranges)), self.partial_place(len(self.ranges))
                try:
                    yield
                except OSError as error:
                    if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                        raise
                    again = "free some space, and the same command goes on"
                    raise OSError(f"{self.folder}: {os.strerror(error.errno)}; {again}") from error

    def _same(self, old: dict[str, Any]) -> None:
        from .sweeps import differences

        changed = differences(old, self.head)
        if changed:
            raise Refused(
                f"{self.folder} holds a part of another run: changed since are {', '.join(changed[:6])}; take that back, or "
                "begin anew with --new"
            )

    def place(self, number: int) -> int:
        """Where a range begins in ``data``."""
        return self.first + sum(r.bytes for r in self.ranges[:number])

    @property
    def length(self) -> int:
        """Bytes in ``data``."""
        return self._end[0]

    def partial_place(self, number: int) -> int:
        """Where a range begins in ``partials``."""
        return sum(r.partial for r in self.ranges[:number])

    def damaged(self) -> list[int]:
        """The numbers of the ranges that are not what their checksums say."""
        wrong = []
        place, partial_place = self.first, 0
        for r in self.ranges:
            whole = _digest(self._data, place, r.bytes) == r.sha256
            if not whole or _digest(self._partials, partial_place, r.partial) != r.partial_sha256:
                wrong.append(r.number)
            place, partial_place = place + r.bytes, partial_place + r.partial
        return wrong

    def partials(self) -> Iterator[bytes]:
        """The partial results so far, in order."""
        self._partials.seek(0)
        for r in self.ranges:
            yield self._partials.read(r.partial)

    def shared(self) -> AbstractContextManager[dict[str, Any] | None]:
        """``data`` as other processes on this machine may write to it."""
        return shared(self.name("data"))

    def add(self, number: int, data: bytes | Written, partial: bytes) -> None:
        """Adds the next range, or writes one again that was damaged. Its bytes may stand at their place already."""
        written = data if isinstance(data, Written) else Written(len(data), _sha256(data))
        made = Range(number, written.bytes, written.sha256, len(partial), _sha256(partial))
        if number < len(self.ranges):
            if made != self.ranges[number]:
                raise Refused(f"{self.folder}: range {number} is made anew with other bytes than before; begin anew with --new")
        elif number != len(self.ranges):
            raise ValueError(f"range {number} does not follow {len(self.ranges)} ranges")
        places = self._end if number == len(self.ranges) else (self.place(number), self.partial_place(number))
        if not isinstance(data, Written):
            write(self._data, places[0], data)
        write(self._partials, places[1], partial)
        if number == len(self.ranges):
            self._note(asdict(made))
            self.ranges.append(made)
            self._end = (places[0] + made.bytes, places[1] + made.partial)

    def _note(self, line: dict[str, Any]) -> None:
        text = json.dumps(line).encode()
        self._lines.write(b"%08x %s\n" % (zlib.crc32(text), text))
        self._lines.flush()

    def _staged(self, line: dict[str, Any]) -> None:
        self._note(line)
        self.stage.append(line)

    def keep(self, kept: list[tuple[int, int]], size: int, header: bytes, tail: bytes = b"") -> None:
        """Makes the output of the ``kept`` ranges of records of ``size`` bytes, by their numbers, and of what comes before and
        after them: of ``data`` itself if these are all, else in the file ``whole``.

        From the last one to the first: when the disk has no room for both files, what is written is cut off ``data``. Killed at
        any point, it goes on from there.
        """
        if self.stage and "done" in self.stage[-1]:
            return
        count = (self.length - self.first) // size
        end = self.first + size * sum(b - a for a, b in kept)
        name = "data" if end == self.length else "whole"
        if name == "whole":
            # The parts of an earlier run are gone on with as they were divided.
            most = self.stage[0]["most"] if self.stage else max(CHUNK // size, 1)
            bounds = [*range(0, count, most), count]
            self._copy(_cut(kept, bounds), bounds, size, end)
        with open(self.name(name), "r+b", 0) as file:
            file.truncate(end)
            write(file, 0, header)
            write(file, end, tail)
            os.fsync(file.fileno())  # what it was made of goes next
        self._staged({"done": name})

    def _copy(self, parts: list[list[tuple[int, int]]], bounds: list[int], size: int, end: int) -> None:
        """Writes records, those of each part between two bounds, to the file ``whole`` so that the last one is at its end."""
        begin = self.stage[-1]["part"] if self.stage else len(parts)
        with open(os.open(self.name("whole"), os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666), "r+b", 0) as whole:
            for n in range(len(parts) - 1, -1, -1):
                place = end = end - size * sum(b - a for a, b in parts[n])
                if n >= begin:  # it is there
                    continue
                for a, b in parts[n]:
                    for chunk in _chunks(self._data, self.first + a * size, (b - a) * size):
                        write(whole, place, chunk)
                        place += len(chunk)
                if shutil.disk_usage(self.folder).free < end + 2 * CHUNK:
                    os.fsync(whole.fileno())
                    self._staged({"part": n, "most": bounds[1]})
                    self._data.truncate(self.first + bounds[n] * size)

    def split(
        self, kept: list[tuple[int, int]], size: int, header: Callable[[int], bytes], most: int, about: dict[str, Any]
    ) -> None:
        """Writes the ``kept`` ranges of records of ``size`` bytes to files of about ``most`` bytes, each of whole ranges and
        with the ``header`` of its number of records, and ``manifest.json`` with ``about`` and the name, records, bytes
        and SHA-256 of each, all in the folder ``shards``.

        From the last one to the first: what is written is cut off ``data``, so that the disk holds it once. Killed at any
        point, it goes on from there.
        """
        if self.stage and "done" in self.stage[-1]:
            return
        os.makedirs(self.name("shards"), exist_ok=True)
        bounds, at = [0], 0
        for r in self.ranges:
            at += r.bytes
            if at - bounds[-1] >= most:
                bounds.append(at)
        bounds += [at] if at > bounds[-1] else []
        parts = _cut(kept, [bound // size for bound in bounds])
        for n in range(len(parts) - 1 - len(self.stage), -1, -1):
            own = parts[n]
            count = sum(b - a for a, b in own)
            name = f"{n:05d}.stl"
            digest = hashlib.sha256(header(count))
            with open(os.path.join(self.name("shards"), name), "wb") as file:
                file.write(header(count))
                for a, b in own:
                    for chunk in _chunks(self._data, self.first + a * size, (b - a) * size):
                        digest.update(chunk)
                        file.write(chunk)
                file.flush()
                os.fsync(file.fileno())
            length = len(header(count)) + count * size
            self._staged({"file": name, "triangles": count, "bytes": length, "sha256": digest.hexdigest()})
            self._data.truncate(self.first + bounds[n])
        manifest = about | {"shards": self.stage[::-1]}
        with open(os.path.join(self.name("shards"), "manifest.json"), "w", encoding="utf-8", newline="\n") as file:
            file.write(json.dumps(manifest, indent=2) + "\n")
        self._staged({"done": "shards"})

    def finish(self) -> None:
        """Gives what is made the name of the output, and takes the folder away."""
        made = self.name(self.stage[-1]["done"]) if self.stage else ""
        if os.path.isdir(made):
            os.replace(made, self.output)
        elif os.path.isfile(made) and os.path.getsize(made):  # else it has its name already
            replace_file(made, os.path.realpath(self.output))
        os.remove(self.name("lines"))  # without it there is nothing to go on from
        shutil.rmtree(self.folder)


def _cut(ranges: list[tuple[int, int]], bounds: list[int]) -> list[list[tuple[int, int]]]:
    """Ascending ranges of numbers as they are divided between bounds."""
    parts: list[list[tuple[int, int]]] = [[] for _ in bounds[1:]]
    n = 0
    for at, end in ranges:
        while at < end:
            while bounds[n + 1] <= at:
                n += 1
            parts[n].append((at, min(end, bounds[n + 1])))
            at = parts[n][-1][1]
    return parts


def _lines_of(raw: bytes) -> tuple[list[dict[str, Any]], int]:
    """Lines of JSON, each after its CRC-32, up to one that is not whole; and their length."""
    read, length = [], 0
    for line in raw.split(b"\n")[:-1]:
        if line[:9] != b"%08x " % zlib.crc32(line[9:]):
            break
        read.append(json.loads(line[9:]))
        length += len(line) + 1
    return read, length


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _digest(file: Any, place: int, length: int) -> str:
    """The SHA-256 of a part of a file; of less if it ends before."""
    digest = hashlib.sha256()
    for chunk in _chunks(file, place, length):
        digest.update(chunk)
    return digest.hexdigest()


def _chunks(file: Any, place: int, length: int) -> Iterator[bytes]:
    """A part of a file, piece by piece; less if it ends before."""
    file.seek(place)
    while length > 0:
        chunk = file.read(min(length, PIECE))
        if not chunk:
            return
        yield chunk
        length -= len(chunk)


def alone(file: Any, place: str) -> None:
    """Refuses a file, or the folder that it is of, in which another process works."""
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise Refused(f"another process works in {place}; wait for it, or end it") from None
