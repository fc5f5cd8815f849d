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
import tempfile
import threading
import time
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
import trabecula as lt
from hypothesis import given, settings
from hypothesis import strategies as st
from trabecula.base.paths import files_in
from trabecula.command import cli
from trabecula.errors import Refused
from trabecula.jobs import clusters, ranges, shared_file, unfinished
from trabecula.jobs.shared_file import Written
from trabecula.jobs.unfinished import Unfinished

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
#: Kills, and runs whose workers are killed, in a campaign and else.
KILLS, RUNS = (50, 50) if os.environ.get("TRABECULA_CAMPAIGN") else (4, 3)


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
from trabecula.jobs import ranges, unfinished
unfinished.CHUNK = 1_000_000  # many lines
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


@pytest.mark.parametrize("lost", [True, False])
@pytest.mark.parametrize("at", [0, 1, 5, 30])
def test_killed_while_bytes_move_it_goes_on_to_the_same_file(tmp_path: Path, whole, monkeypatch, at: int, lost: bool):
    monkeypatch.setattr(unfinished, "CHUNK", 3_000_000)
    path, move, staged, moves, since, sizes = tmp_path / "part.stl", unfinished.move, Unfinished._staged, 0, None, set()

    def torn(file, source, place, length):
        nonlocal moves, since
        moves, since = moves + 1, place if since is None else since
        sizes.add(os.path.getsize(tmp_path / "part.stl.parts" / "data"))
        if moves <= at:
            return move(file, source, place, length)
        move(file, source, place, length // 2)
        if lost:  # as if the power had failed: of what moved since the last line nothing is on the disk
            unfinished.write(file, since, bytes(place + length // 2 - since))
        raise KeyboardInterrupt

    def noted(self, line):
        nonlocal since
        staged(self, line)
        since = None

    monkeypatch.setattr(unfinished, "move", torn)
    monkeypatch.setattr(Unfinished, "_staged", noted)
    with pytest.raises(KeyboardInterrupt):
        again(path, 1)
    assert not path.exists() and len(sizes) == 1  # the disk holds the part once
    monkeypatch.setattr(unfinished, "move", move)
    assert again(path, 1) == whole[1] and path.read_bytes() == whole[0]
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
        with pytest.raises(Refused, match=f"changed since are .*{key}.*; take that back, or begin anew with --new") as said:
            ranges.save(solid, str(path), edge, "drop", size=size)
        assert "count" not in str(said.value)  # of ranges, which follows from the edge
    assert again(path, 2, new=True) == whole[1] and path.read_bytes() == whole[0]


def test_a_changed_file_of_the_design_is_told_by_its_name(tmp_path: Path):
    text = (CORPUS / "mesh_bracket.toml").read_text()
    design = lt.design.parsed(text, False, "design", str(CORPUS))
    name = files_in(design.to_dict())[0]
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


@pytest.mark.parametrize("kind", ["vti", "npy"])
@pytest.mark.parametrize("stop", [None, 0, 2])
def test_bricks_are_the_voxels_in_pieces(tmp_path: Path, monkeypatch, kind: str, stop: int | None):
    solid = built()
    voxels = solid.voxels(step=0.11)
    layer = voxels.shape[0] * voxels.shape[1]
    more = {"size": 3, "shards": 7 * layer}
    if stop is not None:  # killed after so many files
        staged, left = Unfinished._staged, [stop]

        def torn(self, line):
            if not left[0]:
                raise KeyboardInterrupt
            left[0] -= 1
            staged(self, line)

        with monkeypatch.context() as killed, pytest.raises(KeyboardInterrupt):
            killed.setattr(Unfinished, "_staged", torn)
            ranges.save_voxels(solid, str(tmp_path / "part"), kind, 0.11, **more)
    made = ranges.save_voxels(solid, str(tmp_path / "part"), kind, 0.11, **more)
    assert (made["shape"], made["volume"]) == (list(voxels.shape), voxels.volume)
    manifest = json.loads((tmp_path / "part" / "manifest.json").read_text())
    assert manifest["voxels"] == made and len(manifest["shards"]) > 4
    index, ends = ["all.pvti"] * (kind == "vti"), [0]
    for brick in manifest["shards"]:
        content = (tmp_path / "part" / brick["file"]).read_bytes()
        assert (hashlib.sha256(content).hexdigest(), len(content)) == (brick["sha256"], brick["bytes"])
        first, end = brick["layers"]
        assert first == ends[-1]
        ends.append(end)
        wanted = voxels.solid[:, :, first:end].tobytes("F")
        if kind == "npy":
            array = np.load(tmp_path / "part" / brick["file"])
            assert array.shape == (*voxels.shape[:2], end - first) and array.tobytes("F") == wanted
        else:
            assert (
                wanted in content and f'WholeExtent="0 {voxels.shape[0]} 0 {voxels.shape[1]} {first} {end}"'.encode() in content
            )
    assert ends[-1] == voxels.shape[2]
    files = [brick["file"] for brick in manifest["shards"]]
    assert sorted(p.name for p in (tmp_path / "part").iterdir()) == sorted([*files, *index, "manifest.json"])
    left_alone(tmp_path / "part")


def test_another_program_reads_bricks_as_one(tmp_path: Path):
    pyvista = pytest.importorskip("pyvista")
    solid = built()
    voxels = solid.voxels(step=0.2)
    solid.save_voxels(tmp_path / "part.vti", step=0.2, shards=3e-5)
    found = pyvista.read(tmp_path / "part" / "all.pvti")
    assert found.dimensions == tuple(n + 1 for n in voxels.shape) and len(list((tmp_path / "part").glob("*.vti"))) > 2
    assert np.allclose(found.bounds[::2], voxels.origin) and (found["solid"] == voxels.solid.ravel("F")).all()


def test_the_command_writes_bricks_to_a_new_folder(tmp_path: Path):
    design = tmp_path / "network.toml"
    design.write_text(NETWORK)
    words = ["voxels", str(design), "-o", str(tmp_path / "part.vti"), "--step", "0.08", "--shards", "0.001", "--json"]
    out, said = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        assert cli.main(words) == 0
        assert cli.main(words) == 1
    made = json.loads((tmp_path / "part" / "manifest.json").read_text())
    assert json.loads(out.getvalue())["volume"] == made["voxels"]["volume"]
    assert len(made["shards"]) == 2 and f"{tmp_path / 'part'} exists; shards go to a new folder" in said.getvalue()


def test_a_new_run_has_no_file_of_the_one_before(tmp_path: Path, monkeypatch):
    staged = Unfinished._staged

    def torn(self, line):
        staged(self, line)
        raise KeyboardInterrupt

    with monkeypatch.context() as killed, pytest.raises(KeyboardInterrupt):
        killed.setattr(Unfinished, "_staged", torn)
        again(tmp_path / "part", shards=1_000_000)
    again(tmp_path / "part", shards=4_000_000, new=True)
    joined(tmp_path / "part")  # all files are in the manifest


# --- layers for machines ---------------------------------------------------------------------------------------------

#: Files of layers: the end of the name and what else is asked for.
SLICED = [("cli", {}), ("cli", {"binary": True}), ("svg", {}), ("3mf", {})]
SLICED += [(kind, {"pixel": 0.13}) for kind in ("zip", "sl1", "tif", "npy")]


def layers_of(tmp_path: Path, kind: str, more: dict, apart: dict, **plan) -> tuple[dict, bytes]:
    """The figures and the file of the network's layers."""
    folder = tmp_path / ("apart" if apart else "whole")
    folder.mkdir(exist_ok=True)
    report = built().layers(**{"layer": 0.3, "tolerance": 0.01} | plan).save(folder / f"part.{kind}", **more, **apart)
    left_alone(folder / f"part.{kind}")
    return report.to_dict(), (folder / f"part.{kind}").read_bytes()


@pytest.mark.parametrize("size", [1, 5, 1000])
@pytest.mark.parametrize(("kind", "more"), SLICED)
def test_layers_in_ranges_are_the_file_of_one_run(tmp_path: Path, monkeypatch, kind: str, more: dict, size: int):
    monkeypatch.setattr(ranges, "LAYERS", size)
    assert layers_of(tmp_path, kind, more, {"resume": True}) == layers_of(tmp_path, kind, more, {})


@settings(max_examples=100 if os.environ.get("TRABECULA_CAMPAIGN") else 5, deadline=None)
@given(
    layer=st.floats(0.2, 2),
    ends=st.tuples(st.floats(-6, -1), st.floats(1, 6)),
    adaptive=st.none() | st.floats(0.05, 0.5),
    size=st.integers(1, 9),
)
def test_any_layers_are_those_of_one_run(layer: float, ends: tuple, adaptive: float | None, size: int):
    with tempfile.TemporaryDirectory() as scratch, pytest.MonkeyPatch.context() as patched:
        patched.setattr(ranges, "LAYERS", size)
        plan = {"layer": layer, "start": ends[0], "stop": ends[1], "adaptive": adaptive}
        made = [layers_of(Path(scratch), "3mf", {}, apart, **plan) for apart in ({}, {"resume": True})]
        assert made[0] == made[1]


def test_layers_go_on_where_they_were_and_not_with_others(tmp_path: Path):
    design, out = tmp_path / "network.toml", tmp_path / "part.cli"
    design.write_text(NETWORK)
    layers, begun = lt.load(design).build().layers(0.1, 0.01), []
    layers.save(out)
    whole = out.read_bytes()

    def stop(done: int, total: int) -> None:
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        layers.save(out, resume=True, progress=stop)
    with pytest.raises(Refused, match=r"changed since are .*plan\.layer; take that back"):
        lt.load(design).build().layers(0.2, 0.01).save(out, resume=True)
    layers.save(out, resume=True, progress=lambda n, total: begun.append(n))
    assert begun[0] == 5 and out.read_bytes() == whole
    assert sorted(p.name for p in tmp_path.iterdir()) == [design.name, out.name]


def test_a_damaged_range_of_layers_is_made_again(tmp_path: Path):
    layers, out = built().layers(0.1, 0.01), tmp_path / "part.3mf"
    layers.save(out)
    whole = out.read_bytes()
    for of in ("data", "partials", "lines"):

        def stop(done: int, total: int) -> None:
            if done == 12:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            layers.save(out, resume=True, progress=stop)
        path = tmp_path / "part.3mf.parts" / of
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 4
        path.write_bytes(content)
        layers.save(out, resume=True)
        assert out.read_bytes() == whole


def test_the_command_slices_in_ranges(tmp_path: Path):
    design = tmp_path / "network.toml"
    design.write_text(NETWORK)
    said = []
    for folder, more in (("a", ()), ("b", ("--resume",))):
        (tmp_path / folder).mkdir()
        out = io.StringIO()
        words = ("slice", design, "-o", tmp_path / folder / "part.cli", "--layer", "0.2", "--binary", "--json", *more)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            assert cli.main([str(word) for word in words]) == 0
        said.append(json.loads(out.getvalue()) | {"seconds": None})
    assert said[0] == said[1] and (tmp_path / "a/part.cli").read_bytes() == (tmp_path / "b/part.cli").read_bytes()
    err = io.StringIO()
    with contextlib.redirect_stderr(err):
        assert cli.main(["slice", str(design), "--z", "0", "--cluster", "local:2"]) == 2
    assert "--cluster belongs to --layer; leave it out" in err.getvalue()


# --- clusters --------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def two_workers():
    """A cluster of two processes, which are started again when they are killed."""
    distributed = pytest.importorskip("distributed")
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1000}),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made,
    ):
        yield made


@pytest.fixture(scope="module")
def cluster():
    """Two workers, and their address."""
    with two_workers() as made:
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


@pytest.mark.parametrize(("kind", "more"), SLICED)
def test_a_cluster_slices_the_same(tmp_path: Path, cluster, kind: str, more: dict):
    address = {"cluster": cluster.scheduler_address}
    assert layers_of(tmp_path, kind, more, address) == layers_of(tmp_path, kind, more, {})


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


class Killer(threading.Thread):
    """Kills workers of a cluster one by one at random moments, until it is ended. One that is only being started is left
    alone, since Dask does not start it again, and so is the last one, since a busy machine takes long to start another.
    """

    def __init__(self, cluster, moments: random.Random):
        super().__init__(daemon=True)
        self.cluster, self.moments = cluster, moments
        self.kills, self.ended = 0, threading.Event()

    def run(self):
        while not self.ended.wait(self.moments.choice((0.3, 3)) * self.moments.random()):
            nannies = [it for it in list(self.cluster.workers.values()) if it.process and it.process.status.name == "running"]
            running = [nanny.pid for nanny in nannies if nanny.pid]
            with contextlib.suppress(ProcessLookupError):
                if len(running) > 1:
                    os.kill(self.moments.choice(running), signal.SIGKILL)
                    self.kills += 1

    def __enter__(self):
        self.start()

    def __exit__(self, *_):
        self.ended.set()
        self.join()


def test_runs_whose_workers_are_killed_at_random_moments_give_equal_files(tmp_path: Path, whole):
    solid = built()
    layers = solid.layers(0.2, 0.01)
    solid.voxels(step=0.05).write(tmp_path / "whole.npy")
    layers.save(tmp_path / "part.cli")
    wanted = {"stl": whole[0], "npy": (tmp_path / "whole.npy").read_bytes(), "cli": (tmp_path / "part.cli").read_bytes()}
    ways = {
        "stl": lambda path, address: again(path, 1, cluster=address),
        "npy": lambda path, address: solid.save_voxels(path, step=0.05, cluster=address),
        "cli": lambda path, address: layers.save(path, cluster=address),
    }
    kills, equal = [], 0
    for run in range(RUNS):
        kind = list(ways)[run % len(ways)]
        path = tmp_path / f"{run}" / f"part.{kind}"
        path.parent.mkdir()
        with two_workers() as cluster:  # killed often, a worker may not be started again
            killer = Killer(cluster, random.Random(run))
            with killer:
                ways[kind](path, cluster.scheduler_address)
        kills.append(killer.kills)
        equal += path.read_bytes() == wanted[kind]
        left_alone(path)
        path.unlink()
    print(f"{equal} of {RUNS} files equal, {sum(kills)} workers killed, in {sum(map(bool, kills))} of the runs")
    assert equal == RUNS
    # How many are killed depends on the machine where runs are few.
    assert RUNS < 10 or sum(kills) > RUNS / 2


@contextlib.contextmanager
def changed(cluster, code: str):
    """Workers in which the module ``shared_file`` is changed by this code."""
    from distributed import Client

    with Client(cluster.scheduler_address) as client:
        client.run(exec, f"import trabecula.jobs.shared_file as it\nit.before = dict(vars(it))\n{code}", {})
        try:
            yield
        finally:  # a worker that was started in between is as it was
            restored = "before = vars(it).get('before', dict(vars(it)))\nvars(it).clear()\nvars(it).update(before)"
            client.run(exec, f"import trabecula.jobs.shared_file as it\n{restored}", {}, on_error="ignore")


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
            Written(len(part), zlib.crc32(part)) for part in (b"ab", b"", b"cde")
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
