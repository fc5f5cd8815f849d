"""Work by a Dask cluster: processes of one machine, workers of many, or jobs of a queue. In the extra "scale".

Workers run functions of this package, which they have installed in the same version, on plain data: no design is code.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from typing import Any

from .. import _core
from ..base.given import QUEUES, cluster_name

__all__ = ["PATIENCE", "TRIES", "WAITING", "connected", "in_order", "lost", "result", "same", "waited"]

#: Seconds that a cluster has to answer, and to have a worker again when it has lost the last one.
PATIENCE = 30
#: The same of jobs in a queue, which may be long.
QUEUED = 24 * 3600
#: Tasks that wait at each thread of a worker: enough to keep it busy, few enough for the memory of both.
WAITING = 2
#: Environment of workers here: freed memory is used again rather than given back at once, which costs as much as the work.
MEMORY = {"MALLOC_TRIM_THRESHOLD_": 1 << 28, "MALLOC_MMAP_THRESHOLD_": 1 << 25, "MALLOC_ARENA_MAX": 1}
MEMORY |= {"OMP_NUM_THREADS": 1, "OPENBLAS_NUM_THREADS": 1}
#: Settings of Dask for workers here. It looks at itself many times a second, which takes time from the work.
HERE = {
    "distributed.scheduler.allowed-failures": 1000,  # a worker that is killed is started again: its task is not to blame
    "distributed.nanny.pre-spawn-environ": MEMORY,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.scheduler.work-stealing-interval": "1s",
}
#: How often a task is tried that ends with its worker, and how often a cluster here is started whose processes end at once.
TRIES, STARTS = 20, 3


@contextmanager
def connected(cluster: str) -> Iterator[Any]:
    """A client of the Dask cluster at an address such as "tcp://head:8786", of as many processes here as "local:N" says, or of
    as many jobs as "slurm:N" does, each as Dask's configuration has them.

    Raises ValueError for a cluster that does not answer, and one with workers of another version.
    """
    from ..io.bridges import package

    try:
        dask = package("distributed")
    except ImportError:
        raise ValueError("--cluster needs the extra scale: pip install 'trabecula[scale]'") from None
    with warnings.catch_warnings():
        # Of Dask, on ports, slow disks and large inputs: none is about the part.
        warnings.filterwarnings("ignore", category=UserWarning, module="distributed|dask")
        with ExitStack() as opened:
            client = _client(dask, cluster_name(cluster), opened)
            _same_version(client, cluster)
            yield client


def _client(dask: Any, cluster: str, opened: ExitStack) -> Any:
    """A client, which is closed with what has been ``opened``."""
    if cluster.startswith("local:"):
        here = _started(dask, int(cluster.removeprefix("local:")), opened)
        # Results do not go by way of the scheduler, which is in this process.
        return opened.enter_context(dask.Client(here, direct_to_workers=True))
    queued = cluster.partition(":")[0] in QUEUES
    at, patience = (_queued(cluster, opened), QUEUED) if queued else (cluster, PATIENCE)
    if not queued:
        _check_scheduler(cluster)
    try:
        client = opened.enter_context(dask.Client(at, timeout=PATIENCE))
        client.patience = patience
        client.wait_for_workers(1, timeout=patience)
        return client
    except (OSError, TimeoutError, ValueError) as error:
        raise ValueError(f"cluster {cluster} does not answer within {patience} s: {error}") from None


def _check_scheduler(address: str) -> None:
    """Refuses an address where no Dask scheduler answers within ``PATIENCE``. A client of Dask waits for ever for an answer to
    its greeting, and leaves threads and messages where that is none.
    """
    found: list[str | Exception] = []

    def ask() -> None:
        try:
            # A second more than the connection has, so that silence after it is distinguished from none.
            found.append(asyncio.run(asyncio.wait_for(_kind(address), PATIENCE + 1)))
        except Exception as error:  # whatever the bytes of something else than Dask end in
            found.append(error)

    # A thread has an event loop of its own, also in notebooks, and one that is a daemon keeps no interrupt waiting.
    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    asking.join()
    (said,) = found
    if said == "Scheduler":
        return
    if isinstance(said, ConnectionError):
        words = f"does not answer within {PATIENCE} s; does a Dask scheduler run there, and does a firewall let it through?"
        raise ValueError(f"cluster {address} {words}")
    if isinstance(said, str):
        words = f"a {said.lower()} of Dask answers there, not a scheduler"
    elif isinstance(said, (TimeoutError, asyncio.TimeoutError)):
        words = f"there is a connection, but no Dask scheduler answers within {PATIENCE} s"
    elif isinstance(said, MemoryError):  # the first bytes of HTTP or SSH, read as the length of a message
        words = "what answers there is no Dask scheduler"
    else:
        words = f"no Dask scheduler answers there ({' '.join(str(said).split()) or type(said).__name__:.200})"
    raise ValueError(
        f"cluster {address}: {words}; take the address that the scheduler prints, such as tcp://head:8786 (8787 is usually the "
        "port of its dashboard)"
    )


async def _kind(address: str) -> str:
    """What of Dask answers at an address: "Scheduler", "Worker", "Nanny". ConnectionError where nothing can be connected to."""
    from distributed import Security
    from distributed.comm import CommClosedError
    from distributed.core import connect

    try:
        comm = await connect(address, PATIENCE, **Security().get_connection_args("client"))
    except (CommClosedError, TimeoutError, asyncio.TimeoutError):
        raise
    except OSError as error:
        raise ConnectionError(str(error)) from error
    try:
        await comm.write({"op": "identity", "reply": True})
        return (await comm.read())["type"]
    finally:
        comm.abort()


def _started(dask: Any, count: int, opened: ExitStack) -> Any:
    """This many processes here. They are started again where one ends before it has started."""
    opened.enter_context(_settings(HERE))
    opened.enter_context(_unlogged())
    last: Exception | None = None
    for _ in range(STARTS):
        try:
            local = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
            return opened.enter_context(dask.LocalCluster(n_workers=count, **local))
        except (OSError, RuntimeError, TimeoutError) as error:
            last = error
    words = f"its processes ended {STARTS} times before they had started; were they killed, or is memory short?"
    raise ValueError(f"cluster local:{count}: {words} ({last})")


def _queued(cluster: str, opened: ExitStack) -> Any:
    """The scheduler here of as many jobs of a queue. Those that end are replaced."""
    from ..io.bridges import package

    kind, _, count = cluster.partition(":")
    try:
        queues = package("dask_jobqueue")
    except ImportError:
        raise ValueError(f"cluster {cluster}: jobs of queues need dask-jobqueue: pip install dask-jobqueue") from None
    try:
        made = opened.enter_context(getattr(queues, QUEUES[kind])())
    except (OSError, RuntimeError, ValueError) as error:
        words = " ".join(str(error).split())
        raise ValueError(f"cluster {cluster}: {words} (jobqueue.{kind} of Dask's configuration says what a job is)") from None
    made.adapt(minimum_jobs=int(count), maximum_jobs=int(count))
    return made


def _same_version(client: Any, cluster: str) -> None:
    """Refuses workers of another version, or without this package."""
    found = client.run(version, on_error="return").values()
    wrong = [value for value in found if not isinstance(value, OSError) and value != _core.__version__]  # an OSError has ended
    if any(isinstance(value, ImportError) for value in wrong):
        need = f"pip install 'trabecula[scale]=={_core.__version__}'"
        raise ValueError(f"cluster {cluster}: workers have no trabecula; there too: {need}")
    if wrong:
        other = ", ".join(sorted({str(value) for value in wrong}))
        raise ValueError(f"cluster {cluster}: workers have version {other}, here it is {_core.__version__}")


@contextmanager
def _unlogged() -> Iterator[None]:
    """Without what Dask logs of processes here that end and are started again."""
    handlers = [(handler, handler.level) for handler in logging.getLogger("distributed").handlers]
    try:
        for handler, _ in handlers:
            handler.setLevel(logging.CRITICAL)
        yield
    finally:
        for handler, level in handlers:
            handler.setLevel(level)


def _settings(values: dict[str, Any]) -> Any:
    from ..io.bridges import package

    return package("dask").config.set(values)


def version() -> str:
    """The version of this package, where it is called."""
    return _core.__version__


def in_order(
    client: Any,
    work: Callable,
    inputs: dict[str, Any],
    tasks: Iterable[tuple],
    about: Callable[[Any], Any],
    then: Callable[[Any], tuple],
) -> Iterator[Any]:
    """Of each task, in order, what is wanted of its result: ``work(inputs, *task)``, which stays at the worker that made it.

    There ``about(result)`` is asked first; what ``then`` gives for the answer here, a function and more arguments, is called
    there with the result next, and what that returns comes here, one at a time. Tasks are begun ``WAITING`` a thread ahead.
    A task whose worker dies is given to another.

    ``inputs``, plain data, goes once to each worker. Raises what the functions do, and ValueError for a cluster that has lost
    its workers for longer than ``PATIENCE``.
    """
    given = client.submit(same, inputs, pure=False)
    waiting = iter(tasks)
    asked: deque[list] = deque()
    wanted: deque[list] = deque()

    def ask(made: Any, question: tuple) -> Any:
        return client.submit(question[0], made, *question[1:], pure=False, priority=1)  # before work that waits

    def begin() -> None:
        room = WAITING * max(sum(client.nthreads().values()), 1)
        for task in islice(waiting, max(room - len(asked) - len(wanted), 0)):
            made = client.submit(work, given, *task, pure=False)
            asked.append([task, made, (about,), ask(made, (about,))])

    def answer(begun: list) -> Any:
        """What a task is asked, waited for; it is begun again if its worker has died."""
        nonlocal given
        task, _, question, future = begun
        for attempt in range(TRIES):
            try:
                return result(client, future)
            except lost() as error:
                if attempt + 1 == TRIES:
                    raise ValueError(f"a task of the cluster ended {TRIES} workers; are they out of memory? {error}") from None
                given = client.submit(same, inputs, pure=False)
                begun[1] = client.submit(work, given, *task, pure=False)
                begun[3] = future = ask(begun[1], question)

    begin()
    while asked or wanted:
        if asked:
            begun = asked.popleft()
            begun[2] = then(answer(begun))
            begun[3] = ask(begun[1], begun[2])
            wanted.append(begun)
        if len(wanted) > 1 or not asked:  # while one is asked about, the one before it does what is wanted
            made = answer(wanted.popleft())
            begin()
            yield made


def lost() -> tuple[type[BaseException], ...]:
    """What is raised for tasks that ended with their workers."""
    from concurrent.futures import CancelledError

    from distributed import scheduler
    from distributed.client import FutureCancelledError

    return scheduler.KilledWorker, CancelledError, FutureCancelledError


def result(client: Any, future: Any) -> Any:
    """The result of a task, waited for as long as there are workers, or may be again soon."""
    return waited(client, lambda: future.result(timeout=5))


def waited(client: Any, attempt: Callable[[], Any]) -> Any:
    """What an attempt gives that may raise TimeoutError, made as long as there are workers, or may be again soon."""
    last, patience = time.monotonic(), getattr(client, "patience", PATIENCE)
    while True:
        try:
            return attempt()
        except (TimeoutError, asyncio.TimeoutError):  # one from Python 3.11 on
            with suppress(OSError, TimeoutError):
                if client.nthreads():
                    last = time.monotonic()
            if time.monotonic() - last > patience:
                raise ValueError(f"the cluster has had no workers for {patience} s") from None


def same(inputs: dict[str, Any]) -> dict[str, Any]:
    """Plain data, which goes once to each worker as the result of a task."""
    return inputs
