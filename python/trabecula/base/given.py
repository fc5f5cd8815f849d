"""What Python callers give: numbers of any kind, and plain data. What is no such thing gets a TypeError or ValueError."""

from __future__ import annotations

import functools
import math
import operator
import os
from collections.abc import Iterable, Mapping, Sequence, Set
from numbers import Integral

from ..errors import DesignError

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, ParamSpec, TypeAlias, TypeVar, overload

    import meshio
    import numpy as np
    import pyvista
    import trimesh
    from numpy.typing import ArrayLike, NDArray

    from ..mesh import Mesh

    #: Numbers in order.
    Vector = Sequence[float] | NDArray[Any]
    #: Positions and the values taken there: {position: value}, or pairs.
    Stops = Mapping[int, float] | Mapping[float, float] | Iterable[Vector]
    #: Points [x, y, z], or the path of a table of them.
    Points = Iterable[Vector] | str | os.PathLike[str]

    #: A mesh in memory: ours, one of another package, or vertices and triangles.
    MeshLike: TypeAlias = Mesh | trimesh.Trimesh | pyvista.PolyData | meshio.Mesh | tuple[ArrayLike, ArrayLike]

    P = ParamSpec("P")
    Made = TypeVar("Made")

__all__ = [
    "QUEUES",
    "check_data",
    "check_keywords",
    "cluster_name",
    "control",
    "copied",
    "fixed",
    "flag",
    "named",
    "number",
    "pairs",
    "parameters",
    "plain",
    "poisson",
    "positions",
    "positive",
    "settings",
    "shard_bytes",
    "thread_count",
    "three",
    "whole",
]

#: How deep a design may nest; the core has the same limit.
DEPTH = 64


if TYPE_CHECKING:

    @overload
    def named(builder: type[Made]) -> type[Made]: ...
    @overload
    def named(builder: Callable[P, Made]) -> Callable[P, Made]: ...


def named(builder: Any) -> Any:
    """The function or data class; a keyword that it does not have is refused with the nearest that it has."""
    of_class = isinstance(builder, type)
    function = vars(builder)["__init__"] if of_class else builder
    known = parameters(function)

    @functools.wraps(function)
    def call(*args: Any, **given: Any) -> Any:
        check_keywords(builder.__name__, given, known)
        return function(*args, **given)

    if of_class:
        builder.__init__ = call
        return builder
    return call


def parameters(function: Callable[..., Any]) -> list[str]:
    """The names of the parameters of a function or method, without those that take any keyword."""
    code = getattr(function, "__wrapped__", function).__code__
    return [name for name in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount] if name != "self"]


def check_keywords(function: str, given: Iterable[str], known: Sequence[str]) -> None:
    """Refuses keywords that a function does not have, with the nearest that it has."""
    for name in given:
        if name not in known:
            import difflib  # where it is wanted only

            near = difflib.get_close_matches(name, known, 1)
            hint = f"; did you mean {near[0]}?" if near else "."
            raise TypeError(f"{function} has no argument {name}{hint} It takes {', '.join(dict.fromkeys(known))}")


def number(name: str, value: Any) -> float:
    """A number of any kind (Python's, NumPy's) as a float."""
    if isinstance(value, (bool, str, bytes)) or not hasattr(type(value), "__float__"):
        raise TypeError(f"{name} must be a number, found {value!r}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name} is beyond 1e308") from None
    except TypeError:
        raise TypeError(f"{name} must be one number, found {value!r}") from None


def positive(name: str, value: Any) -> float:
    """A finite number greater than 0."""
    found = number(name, value)
    if not (math.isfinite(found) and found > 0):
        raise ValueError(f"{name} is {found:g}; it must be a finite number greater than 0")
    return found


def whole(name: str, value: Any, least: int, most: int) -> int:
    """A whole number of any kind, from ``least`` to ``most``."""
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, found {value!r}") from None
    if isinstance(value, bool):
        raise TypeError(f"{name} must be a whole number, found {value!r}")
    if not least <= found <= most:
        raise ValueError(f"{name} is {found if abs(found) < 10**15 else 'out of range'}; it must be from {least} to {most}")
    return found


def flag(name: str, value: Any) -> bool:
    """True or False, Python's or NumPy's."""
    if not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
        raise TypeError(f"{name} must be True or False, found {value!r}")
    return bool(value)


def positions(name: str, value: Any) -> NDArray[np.float64]:
    """Points (n, 3) of real numbers, or one point; of a masked array, only where nothing is masked."""
    import numpy as np

    given = np.asanyarray(value)
    if np.iscomplexobj(given):
        raise TypeError(f"{name} must be real numbers, found complex ones")
    if np.ma.is_masked(given):
        raise TypeError(f"{name} must have no masked values; leave these points out")
    made = np.asarray(given, dtype=np.float64)
    if made.ndim == 0 or made.shape[-1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), found {made.shape}")
    return made


def poisson(name: str, value: Any) -> float:
    """Poisson's ratio: greater than -1 and less than 0.5."""
    found = number(name, value)
    if not -1 < found < 0.5:
        raise ValueError(
            f"{name} is {found:g}; Poisson's ratio must be greater than -1 and less than 0.5 (of an incompressible solid take "
            "0.49)"
        )
    return found


def three(name: str, value: Any) -> list[float]:
    """Three numbers, given as three or as one for all. A TypeError for a set, which has no order."""
    if isinstance(value, (Set, Mapping)):
        raise TypeError(f"{name} must be one number or three in order, found {value!r:.80}")
    try:
        items = [value] * 3 if isinstance(value, (str, bytes)) else list(value)
    except TypeError:
        items = [value] * 3
    if len(items) != 3:
        raise ValueError(f"{name} must be one number or three, found {len(items)}")
    return [number(name, v) for v in items]


def fixed(array: NDArray) -> NDArray:
    """The array, read-only: what it is a copy of would not follow a change."""
    array.flags.writeable = False
    return array


def plain(value: Any) -> Any:
    """Arrays, data frames, tuples and ranges as lists."""
    value = value.to_numpy() if hasattr(value, "to_numpy") else value
    if hasattr(value, "tolist"):
        return value.tolist()
    return list(value) if isinstance(value, (tuple, range)) else value


def settings(**given: Any) -> dict:
    """Copies of the settings that were given."""
    return copied({k: v for k, v in given.items() if v is not None})


def copied(data: Any, depth: int = 0) -> Any:
    """A copy of data in lists and dictionaries, arrays, tuples, ranges as lists. Numbers of zones become text, as in TOML; a
    DesignError for any other name that is no text.
    """
    if depth > DEPTH:
        raise DesignError(f"a design is at most {DEPTH} levels deep; does it hold itself?")
    check_data(data)
    data = plain(data)
    if isinstance(data, Mapping):
        for name in data:
            if not isinstance(name, str):
                raise DesignError(f"the name {name!r} is no text; names of a design's keys, lattices and regions are")
        return {k: copied(zones(v) if k == "zones" else v, depth + 1) for k, v in data.items()}
    return [copied(v, depth + 1) for v in data] if isinstance(data, list) else data


def check_data(given: Any) -> None:
    """Refuses functions: a design is data."""
    if callable(given) and not hasattr(given, "tolist"):
        raise TypeError(
            f"a design is data, which files can hold, and not code; found the function {getattr(given, '__name__', given)}: "
            'give grade.formula("0.3 + 0.1*sin(x/5)"), or grade.grid(values, origin, step) of what it gives on a grid'
        )


def zones(given: Any) -> Any:
    """The table of zones with their numbers as text; what is no table as it is."""
    if not isinstance(given, Mapping):
        return given
    made = {str(k) if isinstance(k, Integral) and not isinstance(k, bool) else k: v for k, v in given.items()}
    if len(made) < len(given):
        raise DesignError(f"zones has a number twice, as a number and as text; it has {', '.join(map(repr, given))}")
    return made


def pairs(given: Stops | None) -> list | None:
    """Stops as a list of pairs, positions rising if they are keys."""
    if given is None:
        return None
    return copied(sorted(given.items()) if isinstance(given, Mapping) else given if hasattr(given, "tolist") else list(given))


def control(points: Points) -> dict:
    """Control points under the key that they have: points, or the path of a table."""
    if isinstance(points, (str, os.PathLike)):
        return {"path": os.fspath(points)}
    return {"points": copied(points if hasattr(points, "tolist") else [list(p) for p in points])}


#: Queues whose jobs can be workers, and what dask-jobqueue calls them.
QUEUES = {
    "htcondor": "HTCondorCluster",
    "lsf": "LSFCluster",
    "moab": "MoabCluster",
    "oar": "OARCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "slurm": "SLURMCluster",
}


def cluster_name(text: str) -> str:
    """The name of a Dask cluster: local:N, or slurm:N and other queues, N from 1 to 4096; or an address such as
    tcp://head:8786. ValueError for others.
    """
    kind, _, count = text.partition(":")
    if kind == "local" or kind in QUEUES:
        if not (count.isascii() and count.isdigit()) or not 1 <= int(count[:5]) <= 4096 or len(count) > 4:
            raise ValueError(f"cluster: expected {kind}:N with N from 1 to 4096, found {text:.80}")
    elif ":" not in text:
        raise ValueError(f"cluster: expected local:N, slurm:N or an address such as tcp://head:8786, found {text:.80}")
    return text


def thread_count(threads: int | None) -> int | None:
    """A number of threads, 1 to 4096, or None for as many as there are processors. ValueError for others."""
    return None if threads is None else whole("threads", threads, 1, 4096)


def shard_bytes(shards: float | None) -> int | None:
    """Gigabytes of a file of several as bytes, one at least; None of none. A ValueError for what is no positive number."""
    return None if shards is None else max(int(1e9 * positive("shards", shards)), 1)
