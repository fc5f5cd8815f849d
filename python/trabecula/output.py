"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import zlib
from collections.abc import Iterator

from . import interrupt

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

__all__ = ["check_place", "extension", "special", "whole_file"]

#: Names of what is open already.
OPEN = re.compile(r"/dev/(std(out|err)|fd/\d+)|/proc/[^/]+/fd/\d+")


def extension(path: str | os.PathLike[str], known: tuple[str, ...]) -> str:
    """The file name's extension in small letters; one that is not in ``known`` is refused."""
    name = os.fsdecode(path)
    ext = os.path.splitext(name)[1].lower().lstrip(".")
    if ext not in known:
        found = f"found .{ext}" if ext else "found none"
        raise ValueError(f"{name}: the name must end in {', '.join('.' + k for k in known)}; {found}")
    return ext


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
    # The administrator may write to it all the same, but that is not what was meant.
    if os.path.exists(real) and not (os.access(real, os.W_OK) and os.stat(real).st_mode & 0o222):
        raise OSError(f"{name} is read-only; make it writable, or name another output")
    return real


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[str]:
    """Gives a temporary name beside ``path``; what is written there becomes ``path`` at the end, or vanishes on any error.

    A link stays and its target is replaced; permissions stay as they were. A device or a pipe is written as it is.
    """
    shown = os.fsdecode(path)
    real = check_place(path)
    if special(shown):
        try:
            yield shown
        except BaseException:
            interrupt.left.append(f"{shown} was written in part")
            raise
        interrupt.left.append(f"{shown} is written")
        return
    temporary, lock = _temporary(real)
    try:
        yield temporary
        _permissions(temporary, real)
        if fcntl is None:  # Windows moves no open file
            lock = _closed(lock)
        os.replace(temporary, real)
        interrupt.left.append(f"{shown} is written")
    except BaseException as error:
        try:
            os.unlink(temporary)
        except FileNotFoundError:  # it has its own name already
            interrupt.left.append(f"{shown} is written")
        except OSError:
            pass
        if isinstance(error, OSError) and error.filename in (None, temporary):
            reason = error.strerror or str(error)
            raise OSError(f"{shown} cannot be written: {reason}") from error
        raise
    finally:
        _closed(lock)


def _temporary(real: str) -> tuple[str, int | None]:
    """A new file beside ``real``, locked for as long as it is written; those that nobody writes any more are removed."""
    folder, name = os.path.split(real)
    prefix, suffix = f".trabecula-{zlib.crc32(os.fsencode(name)):08x}-", ".part"
    if fcntl is not None:
        for other in os.listdir(folder):
            if other.startswith(prefix) and other.endswith(suffix):
                with contextlib.suppress(OSError):
                    _remove_stale(os.path.join(folder, other))
    while True:
        temporary = os.path.join(folder, f"{prefix}{os.urandom(6).hex()}{suffix}")
        try:
            handle = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            continue
        if fcntl is not None:
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(handle, fcntl.LOCK_EX)
        if os.path.exists(temporary):  # nobody took it for stale before it was locked
            return temporary, handle
        os.close(handle)


def _remove_stale(name: str) -> None:
    """Removes the temporary file of a run that was killed: no process holds its lock."""
    handle = os.open(name, os.O_RDWR)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.unlink(name)
    finally:
        os.close(handle)


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


def _closed(handle: int | None) -> None:
    if handle is not None:
        os.close(handle)
