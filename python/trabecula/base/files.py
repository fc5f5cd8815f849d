"""Files: text that is read whole, outputs that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import stat
from collections.abc import Callable, Iterator

from .. import _core
from ..errors import DesignError
from . import terminal
from .formats import dotted, kind_of

__all__ = [
    *("check_place", "extension", "read_text", "replace_file", "special", "whole_file"),
    *("write_bytes", "write_svg", "write_text"),
]

#: Names of what is open already.
OPEN = re.compile(r"/dev/(std(out|err)|fd/\d+)|/proc/[^/]+/fd/\d+")


def extension(path: str | os.PathLike[str], known: tuple[str, ...]) -> str:
    """The file name's extension in small letters; one that is not in ``known`` is refused."""
    name = os.fsdecode(path)
    kind = kind_of(name)
    if kind not in known:
        found = f"found .{kind}" if kind else "found none"
        raise ValueError(f"{name}: the name must end in {dotted(known)}; {found}")
    return kind


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file in UTF-8, a byte order mark left out.

    Raises OSError for what is no file or cannot be read, DesignError for what is not such text.
    """
    name = os.fsdecode(path)
    raw = _core.read_file(name)
    try:
        if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
            line, message = 1, "text in UTF-16; save it as UTF-8"
        else:
            return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        message = f"not text in UTF-8 (byte {error.start}); save it as UTF-8"
    raise DesignError(f"{name}:{line}: {message}", "", line, message)


def special(name: str) -> bool:
    """Whether this is a device, a pipe or what is open already, or a link to one: it is written as it is."""
    if os.path.exists(name) and not os.path.isfile(name) and not os.path.isdir(name):
        return True
    for _ in range(40):
        if OPEN.fullmatch(os.path.abspath(name)):
            return True
        if not os.path.islink(name):
            return False
        name = os.path.join(os.path.dirname(name), os.readlink(name))
    return False


def check_place(path: str | os.PathLike[str]) -> str:
    """Refuses an output that cannot be written, before any work is done. Gives its name with links followed."""
    name = os.fsdecode(path)
    if special(name):
        return name
    real = os.path.realpath(name)
    folder = os.path.dirname(real)
    if os.path.isdir(real):
        raise OSError(f"{name} is a directory; name a file in it")
    if os.path.islink(real):
        raise OSError(f"{name} is a link that leads nowhere")
    if not os.path.isdir(folder):
        raise OSError(f"{name}: the directory {folder} does not exist")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OSError(f"{name}: the directory {folder} cannot be written to")
    # The administrator may write to it all the same; a read-only file is kept.
    if os.path.exists(real) and not (os.access(real, os.W_OK) and os.stat(real).st_mode & 0o222):
        raise OSError(f"{name} is read-only; make it writable, or name another output")
    return real


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[str]:
    """Gives a temporary name in the folder of ``path``; what is written there becomes ``path`` at the end, or is removed on
    any error or interrupt.

    A link stays and its target is replaced; permissions stay as they were. A device or a pipe is written as it is.
    """
    shown = os.fsdecode(path)
    real = check_place(path)
    if special(shown):
        try:
            yield shown
        except BaseException:
            terminal.left.append(f"{shown} was written in part")
            raise
        terminal.left.append(f"{shown} is written")
        return
    folder, name = os.path.split(real)
    temporary = os.path.join(folder, f".{name[:100]}-{os.urandom(6).hex()}.part")
    os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    try:
        yield temporary
        replace_file(temporary, real)
        terminal.left.append(f"{shown} is written")
    except BaseException as error:
        try:
            os.unlink(temporary)
        except FileNotFoundError:  # it has its own name already
            terminal.left.append(f"{shown} is written")
        except OSError:
            pass
        if isinstance(error, OSError) and error.filename in (None, temporary):
            reason = error.strerror or str(error)
            raise OSError(f"{shown} cannot be written: {reason}") from error
        raise


def replace_file(new: str, real: str) -> None:
    """Gives a file the name, the owner and the permissions of another, or those of any new file."""
    _permissions(new, real)
    os.replace(new, real)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Writes a text in UTF-8, its lines ended by line feeds."""
    write_bytes(path, text.encode())


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Writes a file that appears whole or not at all."""
    with whole_file(path) as temporary, open(temporary, "wb") as out:
        out.write(data)


def write_svg(path: str | os.PathLike[str], drawing: Callable[[], str]) -> None:
    """Writes a drawing to a .svg file."""
    extension(path, ("svg",))
    write_text(path, drawing())


def _permissions(temporary: str, real: str) -> None:
    """Gives the new file the owner and permissions of the old one, or those of any new file."""
    try:
        old = os.stat(real)
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        return
    with contextlib.suppress(OSError, AttributeError):
        os.chown(temporary, old.st_uid, old.st_gid)
    os.chmod(temporary, stat.S_IMODE(old.st_mode))
