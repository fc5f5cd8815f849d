"""Work of many hours in a folder next to its output: what is done stands there with checksums, and the same command goes on."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from typing import Any

from .errors import Refused
from .files import replace_file

__all__ = ["Range", "Unfinished"]

#: Bytes that are moved or checked at once.
CHUNK = 1 << 25
#: Bytes that are written at once.
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

        Raises Refused for a folder of another design or version, with what differs, and for one that another process works in.
        """
        os.makedirs(self.folder, exist_ok=True)
        name = self.name("lines")
        with open(name, "a+b") as self._lines:
            _alone(self._lines, self.folder)
            self._lines.seek(0)
            raw = self._lines.read()
            read, length = _lines_of(raw)
            if b"\n" in raw and not read and not new:
                raise Refused(f"lines in {self.folder} is damaged: it does not say what it is of; begin anew with --new")
            self._lines.truncate(length)
            if new or not read:
                self._lines.truncate(0)
                read = []
                for name in ("data", "partials", "moving"):
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
            with open(self.name("data"), "r+b") as self._data, open(self.name("partials"), "r+b") as self._partials:
                if not self.stage:
                    self._data.truncate(self.place(len(self.ranges)))
                self._partials.truncate(self.partial_place(len(self.ranges)))
                #: Where the next range begins, in both.
                self._end = self.place(len(self.ranges)), self.partial_place(len(self.ranges))
                yield

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

    def add(self, number: int, data: bytes, partial: bytes) -> None:
        """Adds the next range, or writes one again that was damaged."""
        made = Range(number, len(data), _sha256(data), len(partial), _sha256(partial))
        if number < len(self.ranges):
            if made != self.ranges[number]:
                raise Refused(f"{self.folder}: range {number} is made anew with other bytes than before; begin anew with --new")
        elif number != len(self.ranges):
            raise ValueError(f"range {number} does not follow {len(self.ranges)} ranges")
        places = self._end if number == len(self.ranges) else (self.place(number), self.partial_place(number))
        try:
            for file, place, content in zip((self._data, self._partials), places, (data, partial), strict=True):
                file.seek(place)
                _write(file, content)
                file.flush()
            if number == len(self.ranges):
                self._note(asdict(made))
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            raise OSError(f"{self.folder}: {error.strerror}; free some space, and the same command goes on") from error
        if number == len(self.ranges):
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
        """Takes all records of ``size`` bytes but the ``kept`` ranges of their numbers out of ``data``, in place, and writes
        what comes before and after them.

        Killed at any point, it goes on from there: what is moved stands in a file of its own while it is.
        """
        if self.stage and "done" in self.stage[-1]:
            return
        # The moves of an earlier run are gone on with as they were divided.
        moves, to, most = [], self.first, self.stage[0]["most"] if self.stage else CHUNK
        for start, end in kept:
            at, last = self.first + start * size, self.first + end * size
            while at < last and at != to:
                length = min(last - at, most)
                moves.append((at, to, length))
                at, to = at + length, to + length
            to += last - at
        begin = 0
        if self.stage:
            last = self.stage[-1]
            begin = last["move"] + 1
            with open(self.name("moving"), "rb") as file:
                chunk = file.read()
            if _sha256(chunk) == last["sha256"]:  # else the next one was being put there
                self._put(moves[last["move"]][1], chunk)
        for n in range(begin, len(moves)):
            at, place, length = moves[n]
            self._data.seek(at)
            chunk = self._data.read(length)
            with open(self.name("moving"), "wb") as file:
                _write(file, chunk)
                file.flush()
                os.fsync(file.fileno())
            self._staged({"move": n, "most": most, "sha256": _sha256(chunk)})
            self._put(place, chunk)
        self._data.truncate(to)
        for at, content in ((0, header), (to, tail)):
            self._data.seek(at)
            self._data.write(content)
        self._data.flush()
        self._staged({"done": True})

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
        for n in range(len(bounds) - 2 - len(self.stage), -1, -1):
            first, last = bounds[n] // size, bounds[n + 1] // size
            own = [(max(a, first), min(b, last)) for a, b in kept if a < last and b > first]
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
        self._staged({"done": True})

    def _put(self, place: int, chunk: bytes) -> None:
        self._data.seek(place)
        _write(self._data, chunk)
        self._data.flush()
        os.fsync(self._data.fileno())

    def finish(self) -> None:
        """Gives ``data``, or the folder of its shards, the name of the output, and takes the folder away."""
        if os.path.isdir(self.name("shards")):
            os.replace(self.name("shards"), self.output)
        elif os.path.getsize(self.name("data")) and not os.path.isdir(self.output):  # else it has its name already
            replace_file(self.name("data"), os.path.realpath(self.output))
        os.remove(self.name("lines"))  # without it there is nothing to go on from
        shutil.rmtree(self.folder)


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


def _write(file: Any, content: bytes) -> None:
    """Writes bytes piece by piece: systems take several times as long for pieces that do not fit into the processor's cache."""
    whole = memoryview(content)
    for at in range(0, len(content), PIECE):
        file.write(whole[at : at + PIECE])


def _chunks(file: Any, place: int, length: int) -> Iterator[bytes]:
    """A part of a file, piece by piece; less if it ends before."""
    file.seek(place)
    while length > 0:
        chunk = file.read(min(length, CHUNK))
        if not chunk:
            return
        yield chunk
        length -= len(chunk)


def _alone(file: Any, folder: str) -> None:
    """Refuses a folder that another process works in."""
    try:
        import fcntl
    except ImportError:  # no such locks on this system
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise Refused(f"another process works in {folder}; wait for it, or end it") from None
