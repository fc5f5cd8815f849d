"""Work of many hours in a folder next to its output: what is done stands there with checksums, and the same command goes on."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict, dataclass
from itertools import accumulate
from typing import Any, NamedTuple

from ..base.files import replace_file
from ..errors import Refused
from .shared_file import PIECE, Written, shared, withdraw, write

__all__ = ["Range", "Shards", "Unfinished", "alone"]

#: Bytes that move while the output is put together before a line says so: no more are made again after a kill.
CHUNK = 1 << 28


@dataclass(frozen=True)
class Range:
    """A range of tiles that is done: its number, and length and CRC-32 of its bytes and of its partial result. What they are to
    tell is damage, and a SHA-256 would take a fifth of the time of the work.
    """

    number: int
    bytes: int
    crc32: int
    partial: int
    partial_crc32: int


class Shards(NamedTuple):
    """Files in which an output is divided. Of each the first of its records and the one after its last are given."""

    #: End of their names, and about how many bytes each has.
    kind: str
    most: int
    #: What precedes and what follows the records, and what the manifest says of them.
    frame: Callable[[int, int], Sequence[bytes]]
    of: Callable[[int, int], dict[str, Any]]


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
                for name in ("data", "partials"):
                    with suppress(FileNotFoundError):
                        os.remove(self.name(name))
                shutil.rmtree(self.name("shards"), ignore_errors=True)
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
        changed = differences(old, self.head)
        if len(changed) > 1:
            changed = [name for name in changed if name != "count"]  # of ranges: it follows from the others
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

    @property
    def moved(self) -> int:
        """The number of ranges that have left their place in ``data`` for that in the output."""
        return self.stage[-1].get("moved", len(self.ranges)) if self.stage else 0

    def damaged(self) -> list[int]:
        """The numbers of the ranges, of those that have not moved, that are not what their checksums say."""
        wrong = []
        place, partial_place = self.place(self.moved), self.partial_place(self.moved)
        for r in self.ranges[self.moved :]:
            whole = _checksum(self._data, place, r.bytes) == (r.bytes, r.crc32)
            if not whole or _checksum(self._partials, partial_place, r.partial) != (r.partial, r.partial_crc32):
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
        written = data if isinstance(data, Written) else Written(len(data), zlib.crc32(data))
        made = Range(number, written.bytes, written.crc32, len(partial), zlib.crc32(partial))
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
        """Makes the output of ``data``: the ``kept`` ranges of records of ``size`` bytes, by their numbers, in a row, and
        what comes before and after them.

        What stays moves to its place in ``data`` itself, first record first, so that the disk holds it once. Killed at any
        point, it goes on from the last line that says how far it was: what stood where others have moved to since is damaged,
        and made again.
        """
        if self.stage and "done" in self.stage[-1]:
            return
        end = self._move(kept, size)
        self._data.truncate(end)
        write(self._data, 0, header)
        write(self._data, end, tail)
        os.fsync(self._data.fileno())  # what it was made of goes next
        self._staged({"done": "data"})

    def _move(self, kept: list[tuple[int, int]], size: int) -> int:
        """Moves the records that stay to their place, and gives the end of the last one."""
        bounds = list(accumulate((r.bytes // size for r in self.ranges), initial=0))
        place, begin, since = self.first, self.moved, 0
        for n, own in enumerate(_cut(kept, bounds)):
            for a, b in own:
                source, length = self.first + a * size, (b - a) * size
                if n >= begin and source != place:
                    move(self._data, source, place, length)
                    since += length
                place += length
            last = n + 1 == len(self.ranges)
            if since >= CHUNK or (last and since):
                os.fsync(self._data.fileno())  # before the line
                self._staged({"moved": n + 1})
                since = 0
        return place

    def split(self, kept: list[tuple[int, int]], size: int, shards: Shards, about: dict[str, Any]) -> list[dict[str, Any]]:
        """Writes the ``kept`` ranges of records of ``size`` bytes to files, each of whole ranges, and ``manifest.json`` with
        ``about`` and the name, records, bytes and SHA-256 of each, all in the folder ``shards``; gives what it says of each.

        From the last one to the first: what is written is cut off ``data``, so that the disk holds it once. Killed at any
        point, it goes on from there.
        """
        if not (self.stage and "done" in self.stage[-1]):
            os.makedirs(self.name("shards"), exist_ok=True)
            bounds, at = [0], 0
            for r in self.ranges:
                at += r.bytes
                if at - bounds[-1] >= shards.most:
                    bounds.append(at)
            bounds += [at] if at > bounds[-1] else []
            parts = _cut(kept, [bound // size for bound in bounds])
            first = list(accumulate((sum(b - a for a, b in own) for own in parts), initial=0))
            for n in range(len(parts) - 1 - len(self.stage), -1, -1):
                self._staged(self._shard(f"{n:05d}.{shards.kind}", parts[n], size, shards, first[n : n + 2]))
                self._data.truncate(self.first + bounds[n])
            manifest = about | {"shards": self.stage[::-1]}
            with open(os.path.join(self.name("shards"), "manifest.json"), "w", encoding="utf-8", newline="\n") as file:
                file.write(json.dumps(manifest, indent=2) + "\n")
            self._staged({"done": "shards"})
        return self.stage[-2::-1]

    def _shard(self, name: str, own: list[tuple[int, int]], size: int, shards: Shards, ends: list[int]) -> dict[str, Any]:
        """Writes one of the files; what the manifest says of it."""
        head, tail = shards.frame(*ends)
        digest, length = hashlib.sha256(), 0
        with open(os.path.join(self.name("shards"), name), "wb") as file:

            def put(content: bytes | memoryview) -> None:
                nonlocal length
                digest.update(content)
                length += file.write(content)

            put(head)
            for a, b in own:
                for piece in _pieces(self._data, self.first + a * size, (b - a) * size):
                    put(piece)
            put(tail)
            file.flush()
            os.fsync(file.fileno())
        return {"file": name, **shards.of(*ends), "bytes": length, "sha256": digest.hexdigest()}

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


def _checksum(file: Any, place: int, length: int) -> Written:
    """Length and CRC-32 of a part of a file; of less if it ends before."""
    found, crc = 0, 0
    for piece in _pieces(file, place, length):
        found, crc = found + len(piece), zlib.crc32(piece, crc)
    return Written(found, crc)


def _pieces(file: Any, place: int, length: int) -> Iterator[memoryview]:
    """A part of a file, piece by piece, each good until the next one; less if it ends before."""
    buffer = memoryview(bytearray(min(length, PIECE)))
    end = place + length
    while place < end:
        file.seek(place)  # whoever takes a piece may have moved it
        count = file.readinto(buffer[: end - place])
        if not count:
            return
        yield buffer[:count]
        place += count


def move(file: Any, source: int, place: int, length: int) -> None:
    """Moves a part of a file to a place before it."""
    for piece in _pieces(file, source, length):
        write(file, place, piece)
        place += len(piece)


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


def differences(old: Any, new: Any, path: str = "") -> list[str]:
    """Paths at which two trees of plain data differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        keys = sorted({*old, *new})
        return [d for k in keys for d in differences(old.get(k), new.get(k), f"{path}.{k}" if path else k)]
    return [] if old == new else [path.removeprefix("design.")]
