"""Rows of a sweep by the workers of a Dask cluster: one machine, many, or those of a queue. In the extra "scale"."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from . import _core
from .rows import Job, row_of

__all__ = ["rows_by_cluster"]

#: Seconds that a cluster has to answer.
PATIENCE = 30
#: Designs that wait at each thread of a worker: enough to keep it busy, few enough for the scheduler's memory.
WAITING = 2


def rows_by_cluster(job: Job, tasks: Iterable[tuple[int, dict[str, Any]]], cluster: str) -> Iterator[dict[str, Any]]:
    """The rows of numbered points as they are done, by the workers at an address such as "tcp://head:8786", or by as many
    processes here as "local:N" says. Files that the design reads are read by workers under the same names.

    Raises ValueError for a cluster that does not answer, and one with workers of another version.
    """
    from .bridges import package

    try:
        dask = package("distributed")
    except ImportError:
        raise ValueError("--cluster needs the extra scale: pip install 'trabecula[scale]'") from None
    with _client(dask, cluster) as client:
        versions = set(client.run(_version).values())
        if versions - {_core.__version__}:
            other = ", ".join(sorted(versions - {_core.__version__}))
            raise ValueError(f"cluster {cluster}: workers have version {other}, here it is {_core.__version__}")
        data = client.scatter(job.to_dict() | {"threads": 1}, broadcast=True)
        waiting = iter(tasks)
        room = WAITING * max(sum(client.nthreads().values()), 1)

        def submitted(count: int) -> list:
            return [client.submit(_row, data, number, values, pure=False) for number, values in islice(waiting, count)]

        pending = dask.as_completed(submitted(room), with_results=True)
        for _, row in pending:
            pending.update(submitted(1))
            yield row


def _client(dask: Any, cluster: str) -> Any:
    if cluster.startswith("local:"):
        count = cluster.removeprefix("local:")
        if not count.isdigit() or not 1 <= int(count) <= 4096:
            raise ValueError(f"cluster: expected local:N with N from 1 to 4096, found {cluster}")
        return dask.Client(n_workers=int(count), threads_per_worker=1, dashboard_address=None, silence_logs=50)
    try:
        client = dask.Client(cluster, timeout=PATIENCE)
        client.wait_for_workers(1, timeout=PATIENCE)
        return client
    except (OSError, TimeoutError, ValueError) as error:
        raise ValueError(f"cluster {cluster} does not answer within {PATIENCE} s: {error}") from None


def _version() -> str:
    return _core.__version__


def _row(job: dict[str, Any], number: int, values: dict[str, Any]) -> dict[str, Any]:
    return row_of(Job.of(job), number, values)
