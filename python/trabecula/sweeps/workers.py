"""Worker processes that make rows of a sweep: each reads designs and writes rows, a line of JSON each, and ends with its input.

They are commands rather than forks: nothing of the parent is in them, a script needs no guard against running twice, and one
that dies (killed, out of memory) costs its row another try.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Generator, Iterable
from typing import Any

from .rows import Job, row_of

__all__ = ["rows_by_processes", "serve"]

#: How often a row is tried whose worker dies.
TRIES = 3


def serve() -> None:
    """What a worker does: rows of the designs on standard input, to standard output."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal goes to all; the parent ends its workers itself
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n")
    os.dup2(2, 1)  # whatever else is printed
    job = Job.of(json.loads(sys.stdin.readline()))
    for line in sys.stdin:
        number, values = json.loads(line)
        try:
            answers.write(json.dumps(row_of(job, number, values)) + "\n")
            answers.flush()
        except BrokenPipeError:
            os._exit(0)  # whoever asked is gone, and there is nobody to tell


class _Worker:
    """A process, started when it is first needed and again when it has died."""

    def __init__(self, job: Job, ended: threading.Event):
        self.job = json.dumps(job.to_dict())
        self.ended = ended
        self.process: subprocess.Popen | None = None

    def row(self, number: int, values: dict[str, Any]) -> dict[str, Any] | None:
        """The row of a design; None if the worker died over it."""
        try:
            if self.process is None:
                self.process = self._started()
            # Whoever ends all workers may have come by before this one had a process.
            if self.ended.is_set():
                self.end()
                return None
            assert self.process.stdin and self.process.stdout
            self.process.stdin.write(json.dumps([number, values]) + "\n")
            self.process.stdin.flush()
            return json.loads(self.process.stdout.readline())
        except (OSError, ValueError):  # a closed pipe, or half a line
            self.end()
            return None

    def _started(self) -> subprocess.Popen:
        path = f"import sys; sys.path[:] = {sys.path!r}; from trabecula.sweeps.workers import serve; serve()"
        environment = os.environ | {"RAYON_NUM_THREADS": "1"}
        pipe = subprocess.PIPE
        process = subprocess.Popen([sys.executable, "-c", path], stdin=pipe, stdout=pipe, env=environment, text=True)
        assert process.stdin
        process.stdin.write(self.job + "\n")
        return process

    def end(self) -> None:
        """Ends the process at once."""
        process, self.process = self.process, None
        if process is not None:
            process.kill()
            for pipe in filter(None, (process.stdin, process.stdout)):
                with contextlib.suppress(OSError):
                    pipe.close()
            process.wait()


def rows_by_processes(job: Job, tasks: Iterable[tuple[int, dict[str, Any]]], jobs: int) -> Generator[dict[str, Any]]:
    """The rows of numbered points as they are done, by this many processes of one thread each.

    A generator that is closed or thrown into ends its workers at once.
    """
    waiting, lock = iter(tasks), threading.Lock()
    done: queue.Queue = queue.Queue()
    ended = threading.Event()
    workers = [_Worker(job, ended) for _ in range(jobs)]

    def feed(worker: _Worker) -> None:
        try:
            while not ended.is_set():
                with lock:
                    task = next(waiting, None)
                if task is None:
                    break
                made = None
                for _ in range(TRIES):
                    made = made or (None if ended.is_set() else worker.row(*task))
                lost = {"design": task[0], **task[1], "error": f"its process died {TRIES} times; out of memory?"}
                done.put(made or lost)
            done.put(None)
        except BaseException as error:  # handed on to the one who reads
            done.put(error)

    threads = [threading.Thread(target=feed, args=(w,), daemon=True) for w in workers]
    try:
        for thread in threads:
            thread.start()
        left = jobs
        while left:
            row = done.get()
            if isinstance(row, BaseException):
                raise row
            if row is None:
                left -= 1
            else:
                yield row
    finally:
        ended.set()
        for worker in workers:
            worker.end()


def rows_here(job: Job, tasks: Iterable[tuple[int, dict[str, Any]]]) -> Generator[dict[str, Any]]:
    """The same in this process, one after the other."""
    for number, values in tasks:
        yield row_of(job, number, values)
