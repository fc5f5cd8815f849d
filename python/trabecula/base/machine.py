"""Requests that fit the machine: memory, room on the disk."""

from __future__ import annotations

import math
import os

from .. import _core
from .files import check_place, special
from .formats import MESHES

__all__ = ["fewer_threads", "file_size", "fits", "rounded_down", "rounded_up"]

#: Address space of a command, and of each of its threads (stack, the allocator's reserve, tiles in flight), bytes: several
#: times what they take, since an allocation that fails ends the process on the spot.
COMMAND, THREAD = 384e6, 128e6


def file_size(kind: str, triangles: float, vertices: float | None = None) -> float:
    """Bytes of a mesh file. A closed surface has half as many vertices as triangles."""
    per_triangle, per_vertex = MESHES[kind].bytes
    return 1000 + per_triangle * triangles + per_vertex * (triangles / 2 if vertices is None else vertices)


def free_disk(folder: str) -> float:
    """Bytes that may still be written there."""
    if hasattr(os, "statvfs"):
        disk = os.statvfs(folder)
        return float(disk.f_bavail * disk.f_frsize)
    import shutil  # slow to import, and so left to systems that need it

    return float(shutil.disk_usage(folder).free)


def fewer_threads(threads: int | None) -> None:
    """Sees to it that a command fits the limit of its address space (``ulimit -v``), if there is one: with as many threads as
    do, unless their number is given. A ValueError where it does not fit.
    """
    try:
        import resource  # not on every system
    except ImportError:
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY:
        return
    fit = int((limit - COMMAND) // THREAD)
    if fit < (threads or 1):
        number = "one thread" if (threads or 1) == 1 else f"{threads} threads"
        advice = f", or use --threads {fit}" if fit > 0 else ""
        raise ValueError(
            f"the limit of address space (ulimit -v) is {_bytes(limit)}, and a command with {number} needs "
            f"{_bytes(COMMAND + THREAD * (threads or 1))}; raise the limit{advice}"
        )
    # The core's threads, as many as processors by default.
    os.environ["RAYON_NUM_THREADS"] = str(min(fit, threads or os.cpu_count() or 1))


def fits(
    need: float,
    what: str,
    path: str | os.PathLike[str] | None = None,
    edge: float | None = None,
    power: int = 2,
    word: str = "edge",
    coarsest: float = math.inf,
) -> None:
    """Refuses a request for ``need`` bytes of memory, or of disk for the file ``path``, that the machine does not have.

    The need grows as the grid's ``edge`` to the minus ``power``, which gives the edge to suggest, unless that is beyond
    ``coarsest``.
    """
    if path is None:
        have = _core.free_memory()
    elif special(os.fsdecode(path)):
        return
    else:
        have = free_disk(os.path.dirname(check_place(path)))
    if have is None or need <= 0.9 * have:
        return
    kind = "memory" if path is None else "disk space"
    request, advice = "this", ""
    if edge is not None and not math.isfinite(need):
        request = f"{word} {edge:g} mm"
    elif edge is not None:
        better = edge * (need / (0.8 * max(have, 1.0))) ** (1 / power)
        request = f"{word} {edge:g} mm"
        advice = f"; try {word} {rounded_up(better):g} mm"
        if rounded_up(better) > coarsest:
            place = " or another disk" if path else ""
            advice = f"; even the coarsest useful {word} needs more: take a smaller part{place}"
    raise ValueError(f"{request} needs about {_bytes(need)} of {kind} for {what}, and {_bytes(have)} is free{advice}")


def _bytes(n: float) -> str:
    for unit in ("bytes", "kB", "MB", "GB", "TB"):
        if n < 1000 or unit == "TB":
            return f"{n:.3g} {unit}"
        n /= 1000
    return ""


def rounded_up(v: float) -> float:
    """v, rounded up to two digits."""
    unit = 10.0 ** (math.floor(math.log10(v)) - 1)
    return round(math.ceil(v / unit) * unit, 12)


def rounded_down(v: float) -> float:
    """v, rounded down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(v)) - 1)
    return round(math.floor(v / unit) * unit, 12)
