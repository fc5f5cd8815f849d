"""Surfaces in ranges of tiles: by any number of runs and workers, killed or not, the file is that of one process."""

import contextlib
import errno
import hashlib
import io
import json
import os
import random
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest
import trabecula as lt
from trabecula import cli, clusters, ranges, shared_file, unfinished
from trabecula.errors import Refused
from trabecula.shared_file import Written
from trabecula.unfinished import Unfinished

CORPUS = Path(__file__).parents[1] / "corpus" / "designs"

#: A network of which the region's boundary cuts pieces off: dozens are dropped from the file at its end.
NETWORK = """
schema = 1
units = "mm"
region.sphere.radius = 5
[lattice.a]
cell = "diamond"
part = "lower"
map.affine.wavelength = 1.3
map.affine.rotate = [5, 15, 25]
level.fraction = 0.1
"""
EDGE = 0.07
#: Kills in a campaign.
KILLS = 50 if os.environ.get("TRABECULA_CAMPAIGN") else 4


def built(text: str = NETWORK) -> lt.Design:
    """A solid of a text, without warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return lt.design.parsed(text, False, "design", str(CORPUS)).build()


def quietly(save, *words, **more):
    """The report of a surface, whose islands are not warned of."""
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        return save(*words, **more).to_dict()


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> tuple[bytes, dict]:
    """The file of the network by one process, and its report."""
    path = tmp_path_factory.mktemp("whole") / "whole.stl"
    report = quietly(built().save, path, edge=EDGE, islands="drop")
    assert report["islands"]["dropped"] > 20
    return path.read_bytes(), report


def again(path: Path, size: int = 1, **more) -> dict:
    """The network in ranges of this many tiles."""
    return quietly(ranges.save, built(), str(path), EDGE, "drop", size=size, **more)


def left_alone(path: Path) -> None:
    """Nothing but the output is left."""
    assert [p.name for p in path.parent.iterdir()] == [path.name]


# --- the same bytes --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        *(
            "gyroid_sheet_30",
            "mesh_bracket",
            "skin_and_boss",
            "blend_of_three",
            "bcc_block",
            "tet_on_grid",
            "primitive_cavities",
        ),
        *("cell_of_a_mesh", "aligned_with_surface", "scattered_points", "spokes_of_table"),
    ],
)
@pytest.mark.parametrize("size", [1, 4, 1000])
def test_ranges_of_any_size_give_the_file_of_one_run(tmp_path: Path, name: str, size: int):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solid = lt.load(CORPUS / f"{name}.toml").build()
    low, high = solid.bounds
    edge = max(b - a for a, b in zip(low, high, strict=True)) / 130
    a, b = tmp_path / "a" / "part.stl", tmp_path / "b" / "part.stl"
    a.parent.mkdir()
    b.parent.mkdir()
    report = quietly(solid.save, a, edge=edge)
    assert quietly(ranges.save, solid, str(b), edge, "drop-small", size=size) == report
    assert a.read_bytes() == b.read_bytes()
    left_alone(b)


def test_what_is_dropped_is_that_of_one_run(tmp_path: Path, whole):
    for size in (1, 5, 1000):
        path = tmp_path / f"{size}" / "part.stl"
        path.parent.mkdir()
        assert again(path, size) == whole[1]
        assert path.read_bytes() == whole[0]
        left_alone(path)


def test_the_command_says_the_same(tmp_path: Path, whole):
    design = tmp_path / "network.toml"
    design.write_text(NETWORK)
    said = []
    for name, more in (("a.stl", ()), ("b.stl", ("--resume",))):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            words = ("mesh", design, "-o", tmp_path / name, "--edge", EDGE, "--islands", "drop", "--json", *more)
            assert cli.main([str(word) for word in words]) == 0
        said.append(json.loads(out.getvalue()) | {"seconds": None})
    assert said[0] == said[1] and (tmp_path / "a.stl").read_bytes() == (tmp_path / "b.stl").read_bytes() == whole[0]
    assert not (tmp_path / "b.stl.parts").exists()


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("name", ["gyroid_sheet_30", "primitive_cavities", "mesh_bracket"])
def test_figures_in_ranges_are_those_of_one_run(name: str, size: int):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solid = lt.load(CORPUS / f"{name}.toml").build()
    low, high = solid.bounds
    edge = max(b - a for a, b in zip(low, high, strict=True)) / 130
    made, quality, islands = ranges.measure(solid, edge, 100.0, size=size)
    whole = solid._core.measure(edge, 100.0)
    assert (made.to_dict(), quality.to_dict(), islands.to_dict()) == tuple(part.to_dict() for part in whole)


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("kind", ["npy", "vti"])
def test_voxels_in_ranges_are_those_of_one_run(tmp_path: Path, kind: str, size: int):
    solid, a, b = built(), tmp_path / f"a.{kind}", tmp_path / f"b.{kind}"
    whole = solid.voxels(step=0.11)
    whole.write(a)
    made = ranges.save_voxels(solid, str(b), kind, 0.11, size=size)
    assert made == {"shape": list(whole.shape), "step": 0.11, "origin": whole.origin, "volume": whole.volume}
    assert a.read_bytes() == b.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == [a.name, b.name]


def test_figures_and_voxels_go_on_where_they_were(tmp_path: Path):
    design, out = tmp_path / "network.toml", tmp_path / "part.npy"
    design.write_text(NETWORK)
    solid = lt.load(design).build()
    figures = {"design_file": str(design), "size": 1}
    voxels = {"size": 3}
    for work, more in ((ranges.measure, (solid, 0.1, 100.0)), (ranges.save_voxels, (solid, str(out), "npy", 0.1))):
        settings = figures if work is ranges.measure else voxels
        whole = work(*more, **settings)
        content = out.read_bytes() if out.exists() else b""

        def stop(done: int, total: int) -> None:
            if done == 4:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            work(*more, **settings, progress=stop)
        begun = []
        again = work(*more, **settings, progress=lambda n, total, begun=begun: begun.append(n))
        assert begun[0] == 5 and repr(again) == repr(whole)
        assert (out.read_bytes() if out.exists() else b"") == content
    assert sorted(p.name for p in tmp_path.iterdir()) == [design.name, out.name]


# --- stopped, killed, damaged ----------------------------------------------------------------------------------------

KILLED = """
import sys, warnings
warnings.simplefilter("ignore")
import trabecula as lt
from trabecula import ranges, unfinished
unfinished.CHUNK = 1_000_000  # many moves
design = lt.load(sys.argv[1]).build()
print("built", flush=True)
ranges.save(design, sys.argv[2], float(sys.argv[3]), "drop", size=1)
"""


@pytest.mark.parametrize("seed", [1])
def test_killed_at_random_moments_it_goes_on_to_the_same_file(tmp_path: Path, whole, seed: int):
    design, path = tmp_path / "network.toml", tmp_path / "part.stl"
    design.write_text(NETWORK)
    moments, kills, ended = random.Random(seed), 0, 0
    while kills < KILLS:
        process = subprocess.Popen(
            [sys.executable, "-c", KILLED, design, path, str(EDGE)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        process.stdout.readline()
        time.sleep(moments.choice((0.3, 1.2)) * moments.random())
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            kills += 1
        if process.wait() == 0:
            ended += 1
            assert path.read_bytes() == whole[0]
            path.unlink()
    assert again(path) == whole[1] and path.read_bytes() == whole[0]


@pytest.mark.parametrize("room", [True, False])
@pytest.mark.parametrize("at", [0, 1, 2, 5, 9])
def test_killed_while_bytes_are_copied_it_goes_on_to_the_same_file(tmp_path: Path, whole, monkeypatch, at: int, room: bool):
    monkeypatch.setattr(unfinished, "CHUNK", 300_000)
    monkeypatch.setattr(unfinished.shutil, "disk_usage", lambda folder: SimpleNamespace(free=10**12 if room else 10**5))
    path, copied, write, full = tmp_path / "part.stl", 0, unfinished.write, 0
    parts = tmp_path / "part.stl.parts"

    def torn(file, place, chunk):
        nonlocal copied, full
        if str(file.name).isdigit():  # the file of what is kept
            copied += 1
            full = full or os.path.getsize(parts / "data")
            if copied > at:  # half of it is written
                write(file, place, chunk[: len(chunk) // 2])
                raise KeyboardInterrupt
        write(file, place, chunk)

    monkeypatch.setattr(unfinished, "write", torn)
    with pytest.raises(KeyboardInterrupt):
        again(path, 5)
    assert not path.exists()
    if room:
        assert os.path.getsize(parts / "data") == full
    elif hasattr(os.stat(parts), "st_blocks"):
        # The disk holds a part twice at most; what is not written of a file takes no room but for its blocks.
        held = sum(512 * os.stat(parts / name).st_blocks for name in ("data", "whole"))
        assert held <= full + unfinished.CHUNK + 4 * 4096, held
    monkeypatch.setattr(unfinished, "write", write)
    assert again(path, 5) == whole[1] and path.read_bytes() == whole[0]
    left_alone(path)


def stopped(path: Path, after: int, size: int = 1) -> None:
    """The network, stopped after some ranges."""

    def stop(done: int, total: int) -> None:
        if done == after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        again(path, size, progress=stop)


def test_it_goes_on_from_the_last_range(tmp_path: Path, whole):
    path, done = tmp_path / "part.stl", []
    stopped(path, 7)
    assert again(path, progress=lambda n, total: done.append(n)) == whole[1]
    assert done[0] == 8 and path.read_bytes() == whole[0]


@pytest.mark.parametrize("of", ["data", "partials", "lines"])
@pytest.mark.parametrize("where", [0.02, 0.6, 1.0])
def test_what_is_damaged_is_made_again(tmp_path: Path, whole, of: str, where: float):
    path, folder = tmp_path / "part.stl", tmp_path / "part.stl.parts"
    stopped(path, 20)
    content = bytearray((folder / of).read_bytes())
    at = 84 + int(where * (len(content) - 90))
    content[at] ^= 0x10
    (folder / of).write_bytes(content)
    if of == "lines" and where < 0.1:  # what the run is of
        with pytest.raises(Refused, match=r"part\.stl\.parts .*begin anew with --new"):
            again(path)
        assert again(path, new=True) == whole[1]
        return
    assert again(path) == whole[1]
    assert path.read_bytes() == whole[0]


def test_what_is_cut_off_is_made_again(tmp_path: Path, whole):
    for of in ("data", "partials", "lines"):
        path, folder = tmp_path / "part.stl", tmp_path / "part.stl.parts"
        stopped(path, 20)
        os.truncate(folder / of, os.path.getsize(folder / of) // 2)
        assert again(path) == whole[1] and path.read_bytes() == whole[0]


def test_another_run_is_not_mixed_in(tmp_path: Path, whole):
    path = tmp_path / "part.stl"
    stopped(path, 3)
    cases = {"design": (built(NETWORK.replace("1.3", "1.2")), EDGE, 1), "edge": (built(), 0.08, 1), "range": (built(), EDGE, 2)}
    for key, (solid, edge, size) in cases.items():
        with pytest.raises(Refused, match=f"changed since are .*{key}.*; take that back, or begin anew with --new"):
            ranges.save(solid, str(path), edge, "drop", size=size)
    assert again(path, 2, new=True) == whole[1] and path.read_bytes() == whole[0]


def test_a_changed_file_of_the_design_is_told_by_its_name(tmp_path: Path):
    text = (CORPUS / "mesh_bracket.toml").read_text()
    design = lt.design.parsed(text, False, "design", str(CORPUS))
    name = lt.design.files_in(design.to_dict())[0]
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    content = (CORPUS / name).read_bytes()
    (tmp_path / name).write_bytes(content)
    (tmp_path / "design.toml").write_text(text)
    path = tmp_path / "part.stl"

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ranges.save(lt.load(tmp_path / "design.toml").build(), str(path), 0.3, "drop", size=1, progress=stop)
    (tmp_path / name).write_bytes(content[:-1] + b"\1")  # the attribute of the last triangle
    with pytest.raises(Refused, match=f"changed since are files.{name}"):
        ranges.save(lt.load(tmp_path / "design.toml").build(), str(path), 0.3, "drop", size=1)


def test_two_processes_do_not_work_in_one_folder(tmp_path: Path):
    pytest.importorskip("fcntl")
    path = tmp_path / "part.stl"

    def second(done: int, total: int) -> None:
        with pytest.raises(Refused, match="another process works in"):
            again(path)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        again(path, progress=second)


def test_a_full_disk_keeps_what_is_done(tmp_path: Path, whole, monkeypatch):
    path, note, room = tmp_path / "part.stl", Unfinished._note, 5

    def full(self, line):
        nonlocal room
        room -= 1
        if room < 0:
            self._lines.write(b'{"number"')
            self._lines.flush()
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        note(self, line)

    monkeypatch.setattr(Unfinished, "_note", full)
    with pytest.raises(
        OSError, match=r"part.stl.parts: No space left on device; free some space, and the same command goes on"
    ):
        again(path)
    monkeypatch.setattr(Unfinished, "_note", note)
    begun = []
    assert again(path, progress=lambda n, total: begun.append(n)) == whole[1]
    assert begun[0] == 5 and path.read_bytes() == whole[0]


# --- shards ----------------------------------------------------------------------------------------------------------


def joined(folder: Path) -> bytes:
    """The records of all shards, in order, held against the manifest."""
    made = json.loads((folder / "manifest.json").read_text())
    files = [folder / shard["file"] for shard in made["shards"]]
    assert sorted(p.name for p in folder.iterdir()) == sorted([p.name for p in files] + ["manifest.json"]) and len(files) > 4
    for path, shard in zip(files, made["shards"], strict=True):
        content = path.read_bytes()
        assert (hashlib.sha256(content).hexdigest(), len(content)) == (shard["sha256"], shard["bytes"])
        assert int.from_bytes(content[80:84], "little") == shard["triangles"] == (len(content) - 84) // 50
    return b"".join(path.read_bytes()[84:] for path in files)


def test_shards_are_the_file_in_pieces(tmp_path: Path, whole):
    assert again(tmp_path / "part", shards=4_000_000) == whole[1]
    assert joined(tmp_path / "part") == whole[0][84:]
    left_alone(tmp_path / "part")


@pytest.mark.parametrize("at", [0, 3])
def test_killed_while_shards_are_written_it_goes_on(tmp_path: Path, whole, monkeypatch, at: int):
    staged, written = Unfinished._staged, 0

    def torn(self, line):
        nonlocal written
        written += 1
        if written > at:
            raise KeyboardInterrupt
        staged(self, line)

    monkeypatch.setattr(Unfinished, "_staged", torn)
    with pytest.raises(KeyboardInterrupt):
        again(tmp_path / "part", shards=4_000_000)
    monkeypatch.setattr(Unfinished, "_staged", staged)
    assert again(tmp_path / "part", shards=4_000_000) == whole[1]
    assert joined(tmp_path / "part") == whole[0][84:]


# --- clusters --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cluster():
    """Two workers, and their address."""
    distributed = pytest.importorskip("distributed")
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1000}),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made,
    ):
        yield made


@pytest.mark.parametrize("size", [2, 9])
def test_a_cluster_gives_the_same_file(tmp_path: Path, whole, cluster, size: int):
    path = tmp_path / "part.stl"
    assert again(path, size, cluster=cluster.scheduler_address) == whole[1]
    assert path.read_bytes() == whole[0]
    left_alone(path)


def test_a_cluster_measures_and_samples_the_same(tmp_path: Path, cluster):
    solid, a, b = built(), tmp_path / "a.vti", tmp_path / "b.vti"
    assert solid.measure(edge=0.1, cluster=cluster.scheduler_address).to_dict() == solid.measure(edge=0.1).to_dict()
    solid.voxels(step=0.1).write(a)
    solid.save_voxels(b, step=0.1, cluster=cluster.scheduler_address)
    assert a.read_bytes() == b.read_bytes()


@pytest.mark.parametrize("count", [1, 3])
def test_any_number_of_workers_gives_the_same_file(tmp_path: Path, count: int):
    pytest.importorskip("distributed")
    design, a, b = CORPUS / "mesh_bracket.toml", tmp_path / "a.stl", tmp_path / "b.stl"
    solid = lt.load(design).build()
    edge = 0.2
    report = quietly(solid.save, a, edge=edge)
    assert quietly(ranges.save, solid, str(b), edge, "drop-small", size=3, cluster=f"local:{count}") == report
    assert a.read_bytes() == b.read_bytes()


def test_workers_that_are_killed_and_join_change_nothing(tmp_path: Path, whole, cluster):
    path, moments = tmp_path / "part.stl", random.Random(3)
    from distributed import Client

    with Client(cluster.scheduler_address) as client:

        def kill(done: int, total: int) -> None:
            if done in (3, 10, 17):
                workers = client.run(os.getpid)
                os.kill(moments.choice(sorted(workers.values())), signal.SIGKILL)
            if done == 14:
                cluster.scale(3)

        assert again(path, cluster=cluster.scheduler_address, progress=kill) == whole[1]
    assert path.read_bytes() == whole[0]


@contextlib.contextmanager
def changed(cluster, code: str):
    """Workers in which the module ``shared_file`` is changed by this code."""
    from distributed import Client

    with Client(cluster.scheduler_address) as client:
        client.run(exec, f"import trabecula.shared_file as it\nit.before = dict(vars(it))\n{code}", {})
        try:
            yield
        finally:  # a worker that was started in between is as it was
            restored = "before = vars(it).get('before', dict(vars(it)))\nvars(it).clear()\nvars(it).update(before)"
            client.run(exec, f"import trabecula.shared_file as it\n{restored}", {}, on_error="ignore")


@pytest.fixture
def added(monkeypatch) -> list:
    """What is added to a folder: bytes that are sent, or what stands there already."""
    seen, add = [], Unfinished.add

    def noted(self, number, data, partial):
        seen.append(data)
        add(self, number, data, partial)

    monkeypatch.setattr(Unfinished, "add", noted)
    return seen


def test_workers_here_write_to_the_file_themselves(tmp_path: Path, whole, cluster, added: list):
    path = tmp_path / "part.stl"
    assert again(path, cluster=cluster.scheduler_address) == whole[1]
    assert path.read_bytes() == whole[0] and added and all(isinstance(data, Written) for data in added)
    left_alone(path)


#: What a worker of another machine finds, and one of this machine in a container.
ELSEWHERE = [
    "import types\nit.platform = types.SimpleNamespace(node=lambda: 'elsewhere')",
    "def none(*words, **more):\n raise FileNotFoundError\nit.open = none",
]


@pytest.mark.parametrize("code", ELSEWHERE)
def test_workers_that_do_not_see_the_file_send_what_they_make(tmp_path: Path, whole, cluster, added: list, code: str):
    path = tmp_path / "part.stl"
    with changed(cluster, code):
        assert again(path, cluster=cluster.scheduler_address) == whole[1]
    assert path.read_bytes() == whole[0] and added and all(isinstance(data, bytes) for data in added)


def test_a_file_system_without_second_names_has_ranges_sent(tmp_path: Path, whole, cluster, added: list, monkeypatch):
    def none(*names):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(shared_file.os, "link", none)
    path = tmp_path / "part.stl"
    assert again(path, cluster=cluster.scheduler_address) == whole[1]
    assert path.read_bytes() == whole[0] and all(isinstance(data, bytes) for data in added)


#: A worker writes half of a range and kills itself, unless one has done so before.
KILLS_ITSELF = """
import os, signal
write = it.write
def torn(file, place, piece):
    write(file, place, piece[: len(piece) // 2])
    try:
        os.close(os.open({mark!r}, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return write(file, place, piece)
    os.kill(os.getpid(), signal.SIGKILL)
it.write = torn
"""


def test_a_worker_killed_while_it_writes_changes_nothing(tmp_path: Path, whole, cluster):
    path, mark = tmp_path / "part.stl", tmp_path / "mark"
    with changed(cluster, KILLS_ITSELF.format(mark=str(mark))):
        assert again(path, cluster=cluster.scheduler_address) == whole[1]
    assert mark.exists() and path.read_bytes() == whole[0]


def test_a_disk_that_is_full_where_workers_write_keeps_what_is_done(tmp_path: Path, whole, cluster):
    path = tmp_path / "part.stl"
    code = "def full(*words):\n raise OSError(28, 'No space left on device')\nit.write = full"
    with changed(cluster, code), pytest.raises(OSError, match=r"part.stl.parts: No space left on device; free some space"):
        again(path, cluster=cluster.scheduler_address)
    assert again(path, cluster=cluster.scheduler_address) == whole[1] and path.read_bytes() == whole[0]


def test_a_file_is_written_to_for_as_long_as_it_is_shared(tmp_path: Path, monkeypatch):
    path = tmp_path / "data"
    path.write_bytes(bytes(8))
    with shared_file.shared(str(path)) as to:
        assert shared_file.write_at(to, 2, [b"ab", b"", b"cde"]) == [
            Written(len(part), hashlib.sha256(part).hexdigest()) for part in (b"ab", b"", b"cde")
        ]
        assert shared_file.write_at(to | {"machine": "another"}, 0, [b"x"]) is None
        assert shared_file.write_at(to | {"file": (0, 0)}, 0, [b"x"]) is None
    assert shared_file.write_at(to, 0, [b"x"]) is None
    with shared_file.shared(str(path)) as to:  # its owner is killed, and begins anew while another process writes
        monkeypatch.setattr(shared_file, "PIECE", 2)
        write = shared_file.write

        def begin_anew(file, place, piece):
            write(file, place, piece)
            shared_file.withdraw(str(path))

        monkeypatch.setattr(shared_file, "write", begin_anew)
        assert shared_file.write_at(to, 0, [b"xyz"]) is None
    assert path.read_bytes() == b"xyabcde\0"
    left_alone(path)


def test_killed_with_its_cluster_it_goes_on_without(tmp_path: Path, whole, cluster):
    path = tmp_path / "part.stl"

    def stop(done: int, total: int) -> None:
        if done == 12:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        again(path, cluster=cluster.scheduler_address, progress=stop)
    begun = []
    assert again(path, progress=lambda n, total: begun.append(n)) == whole[1]
    assert begun[0] == 13 and path.read_bytes() == whole[0]


def test_workers_of_another_version_are_refused(tmp_path: Path, cluster, monkeypatch):
    with monkeypatch.context() as changed:
        changed.setattr(clusters._core, "__version__", "9.9.9")
        with pytest.raises(ValueError, match=r"workers have version .*, here it is 9\.9\.9"):
            again(tmp_path / "part.stl", cluster=cluster.scheduler_address)
    job = {"version": "9.9.9"}
    with pytest.raises(ValueError, match=r"a worker has version .*, the job is of 9\.9\.9"):
        ranges.made_of(job, 0, 1, 1)


def test_a_cluster_that_does_not_answer_is_named_in_bounded_time(tmp_path: Path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "PATIENCE", 2)
    start = time.monotonic()
    with pytest.raises(ValueError, match=r"cluster tcp://127\.0\.0\.1:1 does not answer within 2 s"):
        again(tmp_path / "part.stl", cluster="tcp://127.0.0.1:1")
    assert time.monotonic() - start < 20 and not list(tmp_path.iterdir())
    for address in ("local:none", "nowhere"):
        with pytest.raises(ValueError, match="expected local:N"):
            again(tmp_path / "part.stl", cluster=address)


def test_a_cluster_that_loses_all_workers_is_told_of(tmp_path: Path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "PATIENCE", 3)
    path = tmp_path / "part.stl"
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made:

        def leave(done: int, total: int) -> None:
            if done == 2:
                made.scale(0)

        with pytest.raises(ValueError, match="the cluster has had no workers for 3 s"):
            again(path, cluster=made.scheduler_address, progress=leave)
    assert len((tmp_path / "part.stl.parts" / "lines").read_text().splitlines()) >= 3


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "output", "more", "status", "message"),
    [
        ("tet_ball", "part.stl", ("--edge", "1"), 1, "a lattice over tetrahedra is meshed tetrahedron by tetrahedron"),
        ("ell_auto", "part.stl", (), 1, "beams alone are meshed by their own patches"),
        ("gyroid_half", "part.3mf", (), 2, "part.3mf: --resume"),
        ("gyroid_half", "part.stl", ("--smooth",), 2, "as it is: leave out --smooth"),
        ("gyroid_half", "part.stl", ("--parts", "wall,lower"), 2, "--resume, --cluster and --shards do not go with --parts"),
    ],
)
def test_what_is_not_made_in_ranges_is_refused_by_name(
    tmp_path: Path, name: str, output: str, more: tuple, status: int, message: str
):
    said = io.StringIO()
    with contextlib.redirect_stderr(said):
        found = cli.main(["mesh", str(CORPUS / f"{name}.toml"), "-o", str(tmp_path / output), "--resume", *more])
    assert found == status and message in said.getvalue(), said.getvalue()
    assert list(tmp_path.iterdir()) == []
