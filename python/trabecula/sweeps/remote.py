"""Rows of a sweep by the workers of a Dask cluster."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Generator, Iterable
from contextlib import suppress
from itertools import islice
from typing import Any

from .. import _core
from ..jobs.clusters import TRIES, WAITING, connected, lost, result, same, waited
from ..jobs.sent import contents, put_files
from .rows import Job, row_of

__all__ = ["rows_by_cluster"]


def rows_by_cluster(job: Job, tasks: Iterable[tuple[int, dict[str, Any]]], cluster: str) -> Generator[dict[str, Any]]:
    """The rows of numbered points of a sweep as they are done. Files that the design reads go by their content once to each
    worker.

    A row whose worker dies is made by another. Raises ValueError as ``connected``, for a worker of another version that has
    joined since, and for a cluster that has lost its workers for longer than ``PATIENCE``.
    """
    with connected(cluster) as client:
        files = contents(job.design.to_dict(), job.design.folder or os.getcwd())
        data = job.to_dict() | {"threads": 1, "files": files, "key": os.urandom(16)}
        given = client.submit(same, data, pure=False)
        waiting = iter(tasks)
        #: The task of each row that is asked for, and how often it has been.
        asked: dict[Any, tuple[tuple[int, dict[str, Any]], int]] = {}

        def ask(task: tuple[int, dict[str, Any]], tries: int = 1) -> None:
            asked[client.submit(_row, given, *task, pure=False)] = task, tries

        for task in islice(waiting, WAITING * max(sum(client.nthreads().values()), 1)):
            ask(task)
        while asked:
            for future in waited(client, lambda: _done(asked)):
                task, tries = asked.pop(future)
                try:
                    row = result(client, future)
                except lost():
                    if tries < TRIES:
                        given = client.submit(same, data, pure=False)
                        ask(task, tries + 1)
                        continue
                    error = f"its worker died {TRIES} times; out of memory?"
                    row = {"design": task[0], **task[1], "error": error, "version": _core.__version__}
                if row["version"] != _core.__version__:  # workers may have joined since they were asked
                    raise ValueError(
                        f"cluster {cluster}: a worker of version {row['version']} has joined, here it is {_core.__version__}; "
                        "its rows are not taken. End it, and the same command goes on"
                    )
                for task in islice(waiting, 1):
                    ask(task)
                yield row


def _done(asked: Iterable[Any]) -> list[Any]:
    """Futures that are done, at least one. Raises TimeoutError where there is none for some seconds."""
    from distributed import wait

    futures = list(asked)
    with suppress(*lost()):
        wait(futures, timeout=5, return_when="FIRST_COMPLETED")
    return [future for future in futures if future.done()]


#: The last job of this process, by its key.
_last: tuple[bytes, Job] | None = None
_lock = threading.Lock()


def _row(data: dict[str, Any], number: int, values: dict[str, Any]) -> dict[str, Any]:
    """A row, where a worker makes it."""
    global _last
    with _lock:
        if _last is None or _last[0] != data["key"]:
            from distributed import get_worker

            given = {key: value for key, value in data.items() if key not in ("key", "files")}
            if data["files"]:
                # In a folder that goes with the worker.
                folder = tempfile.mkdtemp(prefix="trabecula-", dir=get_worker().local_directory)
                given["sent"] = folder, put_files(data["files"], folder)
            _last = data["key"], Job.of(given)
        job = _last[1]
    return row_of(job, number, values)
