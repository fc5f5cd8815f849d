"""Sweeps on clusters: the same rows, whatever becomes of the workers; and addresses where no cluster answers."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import types
from pathlib import Path

import pytest
import trabecula as lt
from conftest import run_in_process as command
from studies import BASE, TWO, table, written
from trabecula.jobs import clusters
from trabecula.sweeps.remote import rows_by_cluster
from trabecula.sweeps.rows import Job, row_of
from trabecula.sweeps.study import Study


def test_a_dask_cluster_gives_the_same_table(tmp_path: Path):
    pytest.importorskip("distributed")
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3, 0.4, 1.5]')
    for name, more in (("here.csv", ()), ("there.csv", ("--cluster", "local:2"))):
        done = command("sweep", study, "-o", tmp_path / name, "--per-cell", 8, *more)
        assert done.returncode == 0, done.stderr
    assert table(tmp_path / "here.csv") == table(tmp_path / "there.csv")


def test_files_of_a_design_go_with_it_to_the_workers_of_a_cluster(tmp_path: Path):
    pytest.importorskip("distributed")
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        (folder / "parts").mkdir(parents=True)
    for name, size in (("a", 4), ("b", 5)):
        lattice = lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.9))
        part = lt.Design(lt.region.box(size=[size] * 3), {"a": lattice}).build()
        part.mesh(edge=0.4).write(here / "parts" / f"{name}.stl")
    (here / "parts" / "bad.stl").write_text("solid\n")
    text = BASE.replace("region.box.size = [4, 4, 4]", 'region.mesh.path = "parts/a.stl"')
    names = ", ".join(f'"parts/{name}.stl"' for name in ("a", "b", "bad", "missing"))
    study = here / "study.toml"
    study.write_text(f'{text}[sweep]\n"region.mesh.path" = [{names}]')
    design = lt.load(study)
    job, points = Job(design, per_cell=8.0), list(enumerate(Study(design).points()))
    plain = [row_of(job, *point) for point in points]
    assert [bool(row["error"]) for row in plain] == [False, False, True, True]
    with clusters.connected("local:2") as client:

        def sent(self, *words, **more):
            os.rename(here, there / "gone")  # what was read is gone before a worker begins
            monkey.undo()
            return client.submit(*words, **more)

        with pytest.MonkeyPatch.context() as monkey:
            monkey.setattr(type(client), "submit", sent)
            monkey.setattr(clusters, "connected", lambda name: contextlib.nullcontext(client))
            rows = sorted(rows_by_cluster(job, points, "local:2"), key=lambda row: row["design"])
    assert [row | {"seconds": 0} for row in rows] == [row | {"seconds": 0} for row in plain]


@pytest.mark.parametrize("kind", ["slurm", "pbs"])
def test_jobs_of_a_queue_are_workers(monkeypatch: pytest.MonkeyPatch, kind: str):
    distributed = pytest.importorskip("distributed")
    asked = []

    class Queue(distributed.LocalCluster):
        """Stands for the clusters of dask-jobqueue."""

        def __init__(self):
            super().__init__(n_workers=0, threads_per_worker=1, dashboard_address=None, silence_logs=50)

        def adapt(self, *, minimum_jobs: int, maximum_jobs: int):
            asked.append((minimum_jobs, maximum_jobs))
            self.scale(minimum_jobs)

    def unknown():
        raise ValueError("You must specify how many cores to use per job like ``cores=8``")

    queues = types.SimpleNamespace(SLURMCluster=Queue, PBSCluster=Queue, SGECluster=unknown)
    monkeypatch.setitem(sys.modules, "dask_jobqueue", queues)
    with clusters.connected(f"{kind}:2") as client:
        assert client.submit(sum, [1, 2]).result() == 3
    assert asked == [(2, 2)]
    with pytest.raises(ValueError, match=r"cluster sge:1: You must .*cores=8.*\(jobqueue\.sge of Dask's configuration"):
        clusters.connected("sge:1").__enter__()
    monkeypatch.setitem(sys.modules, "dask_jobqueue", None)
    with pytest.raises(ValueError, match="cluster slurm:2: jobs of queues need dask-jobqueue: pip install dask-jobqueue"):
        clusters.connected("slurm:2").__enter__()
    with pytest.raises(ValueError, match="expected slurm:N with N from 1 to 4096, found slurm:0"):
        clusters.connected("slurm:0").__enter__()


def test_rows_of_a_worker_of_another_version_are_not_taken(tmp_path: Path):
    distributed = pytest.importorskip("distributed")
    study, rows = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 12 }'), []
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made:
        address = made.scheduler_address
        job, points = Job(lt.load(study), per_cell=8.0), list(enumerate(Study(lt.load(study)).points()))
        said = r"a worker of version 9\.9\.9 has joined, here it is .*; its rows are not taken"
        with distributed.Client(address) as client, pytest.raises(ValueError, match=said):
            for row in rows_by_cluster(job, points, address):
                rows.append(row)
                # The worker goes, and one with another version comes.
                client.run(exec, "import trabecula._core as it; it.__version__ = '9.9.9'", {})
    assert 0 < len(rows) < 12 and {row["version"] for row in rows} == {lt.__version__}


#: The command in a process in which a cluster has a second to answer.
IMPATIENT = """
import sys
from trabecula.command import cli
from trabecula.jobs import clusters
clusters.PATIENCE = 1
sys.exit(cli.main(sys.argv[1:]))
"""


@contextlib.contextmanager
def listening(reply: bytes):
    """The address of a port that accepts whoever comes and sends this at once."""
    with socket.create_server(("127.0.0.1", 0)) as server, contextlib.ExitStack() as kept:

        def serve() -> None:
            with contextlib.suppress(OSError):
                while True:
                    kept.enter_context(server.accept()[0]).sendall(reply)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)  # which ends the wait for the next one
        thread.join()


def refused_by_cluster(tmp_path: Path, address: str) -> str:
    """The one line that the command ends with, which names the cluster, within its patience, and writes nothing."""
    study, begun = written(tmp_path, TWO), time.monotonic()
    words = [sys.executable, "-c", IMPATIENT, "sweep", study, "-o", tmp_path / "out.csv", "--cluster", address]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1 and done.stderr.startswith(f"trabecula: cluster {address}"), done.stderr
    assert done.stderr.count("\n") == 1 and time.monotonic() - begun < 20
    assert os.listdir(tmp_path) == ["study.toml"]
    return done.stderr


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        (b"", "there is a connection, but no Dask scheduler answers within 1 s"),
        (b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n", "what answers there is no Dask scheduler"),
        (b"SSH-2.0-OpenSSH_9.2p1\r\n", "what answers there is no Dask scheduler"),
        (bytes(8), "no Dask scheduler answers there"),
    ],
)
def test_a_port_of_something_else_than_a_cluster_is_named_with_what_may_be_wrong(tmp_path: Path, reply: bytes, said: str):
    pytest.importorskip("distributed")
    with listening(reply) as address:
        found = refused_by_cluster(tmp_path, address)
    assert said in found and "8787 is usually the port of its dashboard" in found and "Unable to allocate" not in found


def test_ports_of_a_cluster_that_are_not_its_schedulers_are_distinguished_from_it(tmp_path: Path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50) as made:
        (worker,) = made.scheduler.workers
        assert "a worker of Dask answers there, not a scheduler" in refused_by_cluster(tmp_path, worker)
        dashboard = f"tcp://127.0.0.1:{made.scheduler.http_server.port}"
        assert "no Dask scheduler answers" in refused_by_cluster(tmp_path, dashboard)


def test_workers_of_a_cluster_that_are_killed_all_at_once_cost_no_row(tmp_path: Path):
    distributed = pytest.importorskip("distributed")
    design = lt.load(written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 12 }'))
    job, points, rows = Job(design, per_cell=8.0), list(enumerate(Study(design).points())), []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made:
        address = made.scheduler_address
        with distributed.Client(address) as client:
            for row in rows_by_cluster(job, points, address):
                rows.append(row)
                if len(rows) == 2:
                    for process in client.run(os.getpid).values():
                        os.kill(process, signal.SIGKILL)
    assert sorted(row["design"] for row in rows) == list(range(12)) and not any(row["error"] for row in rows)


def test_a_sweep_whose_cluster_loses_all_workers_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "PATIENCE", 3)
    design = lt.load(written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 12 }'))
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made:
        rows = rows_by_cluster(Job(design, per_cell=8.0), list(enumerate(Study(design).points())), made.scheduler_address)
        next(rows)
        made.scale(0)
        with pytest.raises(ValueError, match="the cluster has had no workers for 3 s"):
            list(rows)


def test_a_cluster_whose_processes_are_killed_while_they_start_is_started_again(monkeypatch: pytest.MonkeyPatch):
    distributed = pytest.importorskip("distributed")
    begin, left = distributed.Nanny.instantiate, [2]

    async def killed(self):
        if left[0]:
            left[0] -= 1
            self.auto_restart = False
            raise RuntimeError("Nanny failed to start.")
        return await begin(self)

    monkeypatch.setattr(distributed.Nanny, "instantiate", killed)
    with clusters.connected("local:1") as client:
        assert client.submit(sum, [1, 2]).result() == 3
    left[0] = 99
    with (
        pytest.raises(ValueError, match=r"cluster local:1: its processes ended 3 times before they had started"),
        clusters.connected("local:1"),
    ):
        pass
