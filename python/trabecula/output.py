"""Files that appear whole or not at all, and requests that fit the machine."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator

__all__ = ["extension", "fits", "whole_file"]


def extension(path: str | os.PathLike[str], known: tuple[str, ...]) -> str:
    """The file name's extension in small letters; one that is not in ``known`` is refused."""
    name = os.fspath(path)
    ext = os.path.splitext(name)[1].lower().lstrip(".")
    if ext not in known:
        found = f"found .{ext}" if ext else "found none"
        raise ValueError(f"{name}: the name must end in {', '.join('.' + k for k in known)}; {found}")
    return ext


def check_place(path: str | os.PathLike[str]) -> None:
    """Refuses an output that cannot be written, before any work is done."""
    name = os.fspath(path)
    folder = os.path.dirname(os.path.abspath(name))
    if os.path.isdir(name):
        raise OSError(f"{name} is a directory; name a file in it")
    if not os.path.isdir(folder):
        raise OSError(f"{name}: the directory {folder} does not exist")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OSError(f"{name}: the directory {folder} cannot be written to")


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[str]:
    """Gives a temporary name beside ``path``; what is written there becomes ``path`` at the end, or vanishes on any error."""
    check_place(path)
    name = os.path.abspath(os.fspath(path))
    if not os.path.isfile(name) and os.path.exists(name):  # a device or a pipe is written as it is
        yield name
        return
    handle, temporary = tempfile.mkstemp(dir=os.path.dirname(name), prefix=".trabecula-", suffix=".part")
    os.close(handle)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, name)
    except BaseException as error:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        if isinstance(error, OSError) and error.filename in (None, temporary):
            reason = error.strerror or str(error)
            raise OSError(f"{os.fspath(path)} cannot be written: {reason}") from error
        raise


def free_memory() -> float | None:
    """Bytes that a program may take without swapping, where the system tells."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return float(line.split()[1]) * 1024
    except OSError:
        pass
    return None


def fits(need: float, what: str, edge: float, power: int, path: str | None = None, word: str = "edge") -> None:
    """Refuses a request for ``need`` bytes of memory, or of disk at ``path``, that the machine does not have.

    The need grows as edge to the minus ``power``, which gives the edge to suggest.
    """
    have = free_memory() if path is None else float(shutil.disk_usage(os.path.dirname(os.path.abspath(path))).free)
    if have is None or need <= 0.9 * have:
        return
    better = edge * (need / (0.8 * max(have, 1.0))) ** (1 / power)
    kind = "memory" if path is None else "disk space"
    raise ValueError(
        f"{word} {edge:g} mm needs about {_bytes(need)} of {kind} for {what}, and {_bytes(have)} is free; "
        f"try {word} {_up(better):g} mm"
    )


def _bytes(n: float) -> str:
    for unit in ("bytes", "kB", "MB", "GB", "TB"):
        if n < 1000 or unit == "TB":
            return f"{n:.3g} {unit}"
        n /= 1000
    return ""


def _up(v: float) -> float:
    """v, rounded up to two digits."""
    import math

    unit = 10.0 ** (math.floor(math.log10(v)) - 1)
    return round(math.ceil(v / unit) * unit, 12)
