"""The files that a design reads, by their content: as they are sent to workers of a cluster, and their checksums."""

from __future__ import annotations

import glob
import hashlib
import os
from collections.abc import Iterable, Iterator

from ..base import memory
from ..base.paths import data_of, files_in

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Any

    from ..base.resolution import Resolution

__all__ = ["contents", "digest_of", "digests", "files_of", "put_files"]


def files_of(solid: Resolution) -> dict[str, dict[str, bytes]]:
    """The files of a solid's design, as ``contents`` gives them."""
    return contents(data_of(solid._core.design), solid._folder)


def contents(data: Any, folder: str) -> dict[str, dict[str, bytes]]:
    """The files of a design by the names that its ``data`` have for them: a name is that of one, a pattern or a folder."""
    return {name: dict(_contents(name, folder)) for name in files_in(data)}


def digests(data: Any, folder: str) -> dict[str, str]:
    """The SHA-256 of each file that a design's ``data`` names; of a pattern or a folder, that of all its files."""
    return {name: digest_of(_contents(name, folder)) for name in files_in(data)}


def digest_of(files: Iterable[tuple[str, bytes]]) -> str:
    """The SHA-256 of files with their names."""
    digest = hashlib.sha256()
    for name, content in files:
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def put_files(given: dict[str, dict[str, bytes]], folder: str) -> dict[str, str]:
    """Writes such files to a folder; their names there by those that the design has for them."""
    places = {}
    for n, (name, files) in enumerate(given.items()):
        places[name] = f"{n}/{os.path.basename(memory.file_name(name).rstrip('/'))}"
        for inner, content in files.items():
            at = os.path.join(folder, str(n), inner)
            os.makedirs(os.path.dirname(at), exist_ok=True)
            with open(at, "wb") as file:
                file.write(content)
    return places


def _contents(name: str, folder: str) -> Iterator[tuple[str, bytes]]:
    """The files behind a name in a design with their bytes."""
    if name.startswith(memory.IN_MEMORY):
        yield memory.file_name(name), memory.content(name)
        return
    for inner, path in _paths(name, folder):
        with open(path, "rb") as file:
            yield inner, file.read()


def _paths(name: str, folder: str) -> list[tuple[str, str]]:
    """The files behind a name in a design: their names, with / between folders, and their paths."""
    path = os.path.join(folder, name)
    if os.path.isdir(path):
        found = [os.path.join(at, one) for at, _, files in os.walk(path) for one in files]
    else:
        found = glob.glob(glob.escape(path).replace("[*]", "*"))
    base = os.path.dirname(path.rstrip("/"))
    return [(os.path.relpath(one, base).replace(os.sep, "/"), one) for one in sorted(found)]
