"""A file that other processes on this machine write to, each at the place it is given, for as long as its owner lets them."""

from __future__ import annotations

import os
import platform
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, NamedTuple

__all__ = ["Written", "shared", "withdraw", "write", "write_at"]

#: Bytes that are written at once: systems take several times as long for pieces that do not fit into the processor's cache.
PIECE = 1 << 18


class Written(NamedTuple):
    """Bytes that stand at their place: how many, and their CRC-32."""

    bytes: int
    crc32: int


@contextmanager
def shared(path: str) -> Iterator[dict[str, Any] | None]:
    """What other processes need to write to a file: a second name of it, which is taken away at the end, and how they know that
    it is this file. None if the file system gives no second names.
    """
    name = f"{os.path.abspath(path)}-{os.urandom(8).hex()}"
    try:
        os.link(path, name)
    except OSError:
        yield None
        return
    try:
        found = os.stat(name)
        yield {"name": name, "machine": platform.node(), "file": (found.st_dev, found.st_ino)}
    finally:
        with suppress(FileNotFoundError):
            os.remove(name)


def withdraw(path: str) -> None:
    """Takes the second names away that a killed process has left: no other one writes to the file from now on."""
    folder, start = os.path.dirname(path), os.path.basename(path) + "-"
    for name in os.listdir(folder):
        if name.startswith(start):
            os.remove(os.path.join(folder, name))


def write_at(to: dict[str, Any], place: int, contents: list[bytes]) -> list[Written] | None:
    """Writes contents one after the other to a file that another process shares. None if it is not seen from here, or is no
    longer shared.

    Raises OSError for a disk that is full.
    """
    if to["machine"] != platform.node():
        return None
    with ExitStack() as opened:
        try:
            file = opened.enter_context(open(to["name"], "r+b", buffering=0))
        except OSError:
            return None
        found, made = os.fstat(file.fileno()), []
        if (found.st_dev, found.st_ino) != tuple(to["file"]):
            return None
        for content in contents:
            crc = 0
            for piece in pieces(content):
                if not os.path.exists(to["name"]):
                    return None
                crc = zlib.crc32(piece, crc)
                write(file, place, piece)
                place += len(piece)
            made.append(Written(len(content), crc))
        return made


def write(file: Any, place: int, content: bytes | memoryview) -> None:
    """Writes bytes at their place in a file without a buffer, which may take them in parts."""
    file.seek(place)
    for piece in pieces(content):
        while piece:
            piece = piece[file.write(piece) :]


def pieces(content: bytes | memoryview) -> Iterator[memoryview]:
    """Bytes, piece by piece."""
    whole = memoryview(content)
    for at in range(0, len(whole), PIECE):
        yield whole[at : at + PIECE]
