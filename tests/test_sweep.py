"""Sweeps: which designs, what is in the table, and that stopping, killing and sharing the work change no row."""

import csv
import itertools
import json
import math
import multiprocessing
import os
import pickle
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest
import trabecula as lt
from conftest import run_in_process as command
from hypothesis import given
from hypothesis import strategies as st
from studies import BASE, TWO, table, written
from trabecula.command import arguments, cli
from trabecula.jobs.sent import digests
from trabecula.sweeps import workers
from trabecula.sweeps.conditions import condition
from trabecula.sweeps.rows import PROPERTIES, Job, columns_of_job, row_of
from trabecula.sweeps.sampling import DIMENSIONS, latin, sobol
from trabecula.sweeps.scatter import front_of, scatter
from trabecula.sweeps.study import Study
from trabecula.sweeps.table import Journal


def started(study: Path, out: Path, jobs: int, **more) -> subprocess.Popen:
    """The command in a process of its own."""
    words = ("sweep", study, "-o", out, "--jobs", jobs, "--per-cell", 8)
    return subprocess.Popen([sys.executable, "-m", "trabecula", *map(str, words)], **more)


# --- which designs ----------------------------------------------------------------------------------------------------


@given(st.integers(1, 60), st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_a_latin_hypercube_has_one_value_in_each_part_of_each_coordinate(count: int, dimensions: int, seed: int):
    points = list(latin(count, dimensions, seed))
    assert points == list(latin(count, dimensions, seed))
    for column in zip(*points, strict=True):
        assert sorted(int(v * count) for v in column) == list(range(count))


@given(st.integers(1, 7), st.integers(1, DIMENSIONS), st.integers(0, 2**32 - 1))
def test_a_sobol_sequence_is_a_net_in_every_coordinate(power: int, dimensions: int, seed: int):
    points = list(sobol(2**power, dimensions, seed))
    for column in zip(*points, strict=True):
        assert sorted(int(v * 2**power) for v in column) == list(range(2**power))


@given(st.integers(0, 2**32 - 1))
def test_two_coordinates_of_a_sobol_sequence_are_a_net_too(seed: int):
    # The first two dimensions are a (0, 2)-sequence: every elementary box of 64 points has one.
    points = list(sobol(64, 2, seed))
    for k in range(7):
        boxes = {(int(x * 2**k), int(y * 2 ** (6 - k))) for x, y in points}
        assert len(boxes) == 64


def test_sobol_equals_scipy():
    qmc = pytest.importorskip("scipy.stats").qmc
    theirs = qmc.Sobol(DIMENSIONS, scramble=False, bits=32).random(256)
    assert [tuple(p) for p in theirs] == list(sobol(256, DIMENSIONS, 0))


def test_a_grid_is_every_combination_and_conditions_leave_out(tmp_path: Path):
    text = """
    "lattice.a.level.fraction" = [0.2, 0.3]
    lattice.a.map.affine.wavelength = { from = 3, to = 5, count = 3 }
    "region.box.size[0]" = [4, 8]
    where = ["region.box.size[0] > lattice.a.map.affine.wavelength", "region.box.size[1] == 4"]
    """
    points = list(Study(lt.load(written(tmp_path, text))).points())
    paths = ("lattice.a.level.fraction", "lattice.a.map.affine.wavelength", "region.box.size[0]")
    wanted = [dict(zip(paths, p, strict=True)) for p in itertools.product([0.2, 0.3], [3.0, 4.0, 5.0], [4, 8]) if p[2] > p[1]]
    assert points == wanted


def test_equal_ratios_and_lists_in_random_designs(tmp_path: Path):
    text = """
    "lattice.a.map.affine.wavelength" = { from = 1, to = 100, scale = "log" }
    "lattice.a.cell" = ["gyroid", "diamond"]
    sampling = "latin"
    count = 40
    """
    points = list(Study(lt.load(written(tmp_path, text))).points())
    assert len(points) == 40
    assert sum(p["lattice.a.cell"] == "gyroid" for p in points) == 20
    assert sum(p["lattice.a.map.affine.wavelength"] < 10 for p in points) == 20  # the middle in ratios


def test_random_designs_that_miss_the_conditions_are_replaced(tmp_path: Path):
    text = '"lattice.a.level.fraction" = { from = 0.1, to = 0.5 }\nsampling = "sobol"\ncount = 30\n'
    points = list(Study(lt.load(written(tmp_path, text + 'where = ["lattice.a.level.fraction > 0.4"]'))).points())
    assert len(points) == 30 and all(0.4 < p["lattice.a.level.fraction"] <= 0.5 for p in points)
    rare = Study(lt.load(written(tmp_path, text + 'where = ["lattice.a.level.fraction > 0.4999"]')))
    with pytest.raises(ValueError, match=r"sweep.where: \d+ of 30000 random designs keep the conditions, 30 are asked for"):
        list(rare.points())


@pytest.mark.parametrize(
    ("text", "values", "wanted"),
    [("a.b[0] + 2 * c < 4", {"a.b[0]": 1, "c": 1}, True), ("not a < 1 or max(a, b) ** 2 == 4", {"a": 0, "b": 2}, True)],
)
def test_conditions(text: str, values: dict, wanted: bool):
    assert condition(text)(values) is wanted


@pytest.mark.parametrize("text", ["a <", "__import__('os').system('true')", "a.q > 1", "1 / 0 > a", "lambda: 1", "a.upper()"])
def test_what_is_no_condition_is_refused(text: str):
    with pytest.raises(ValueError, match=r"condition|names a\.q|has no value"):
        condition(text)({"a": 1})


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=1, max_size=40))
def test_nothing_beats_a_design_on_the_pareto_front(points: list[tuple[int, int]]):
    front = front_of(points, ("min", "max"))
    assert front
    for i in front:
        x, y = points[i]
        assert not any(a <= x and b >= y and (a, b) != (x, y) for a, b in points)
    best = {points[i] for i in front}
    assert all(any(a <= x and b >= y for a, b in best) for x, y in points)


# --- the table --------------------------------------------------------------------------------------------------------


def test_rows_are_what_the_commands_say_of_each_design(tmp_path: Path):
    columns = lt.sweep(
        written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.4]\n"lattice.a.cell" = ["gyroid", "diamond"]'), per_cell=16
    )
    assert columns["design"] == [0, 1, 2, 3] and columns["error"] == [None] * 4
    for i in range(4):
        design = lt.load(tmp_path / "study.toml").to_dict()
        design.pop("sweep")
        design["lattice"]["a"]["cell"] = columns["lattice.a.cell"][i]
        design["lattice"]["a"]["level"]["fraction"] = columns["lattice.a.level.fraction"][i]
        solid = lt.Design(**design).build()
        measured = solid.measure(per_cell=16)
        found = {name: columns[name][i] for name in ("solid_fraction", "volume_mm3", "area_mm2", "pieces")}
        assert list(found.values()) == [measured.solid_fraction, measured.volume, measured.area, measured.pieces]
        assert columns["wall_mm"][i] == solid.report().lattices["a"].thickness


def test_a_design_that_cannot_be_made_is_a_row_with_its_reason(tmp_path: Path):
    columns = lt.sweep(written(tmp_path, '"lattice.a.level.fraction" = [0.3, 1.5]'), per_cell=8)
    assert columns["error"][0] is None and "fraction is 1.5" in columns["error"][1]
    assert columns["volume_mm3"][1] is None and columns["volume_mm3"][0] > 0


def test_if_no_design_can_be_made_the_reasons_are_said_and_nothing_is_written(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = [1.5, 2]')
    done = command("sweep", study, "-o", tmp_path / "out.csv", "--per-cell", 8)
    assert done.returncode == 1 and "none of 2 designs can be made; the first reasons: " in done.stderr
    assert not (tmp_path / "out.csv").exists()


def test_any_number_of_processes_gives_the_same_table(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 7 }')
    tables = []
    for jobs in (1, 3):
        out = tmp_path / f"out{jobs}.csv"
        assert command("sweep", study, "-o", out, "--jobs", jobs, "--per-cell", 8).returncode == 0
        tables.append(table(out))
    assert tables[0] == tables[1] and len(tables[0]) == 7
    assert not list(tmp_path.glob("*.rows"))


def test_meshes_and_pictures_are_written_on_request(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3]')
    names = ("--meshes", tmp_path / "parts" / "{design}.stl", "--pictures", tmp_path / "parts" / "{design}.png")
    done = command("sweep", study, "-o", tmp_path / "out.csv", "--per-cell", 8, "--jobs", 1, *names)
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in (tmp_path / "parts").iterdir()) == ["000000.png", "000000.stl", "000001.png", "000001.stl"]
    volumes = [float(row["volume_mm3"]) for row in table(tmp_path / "out.csv")]
    assert [lt.Mesh.read(tmp_path / "parts" / f"00000{i}.stl").volume for i in (0, 1)] == pytest.approx(volumes, rel=1e-6)


def test_parquet_has_the_same_numbers_and_the_units(tmp_path: Path):
    parquet = pytest.importorskip("pyarrow.parquet")
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3, 1.5]')
    for name in ("out.csv", "out.parquet"):
        done = command("sweep", study, "-o", tmp_path / name, "--per-cell", 8)
        assert done.returncode == 0, done.stderr
    read = parquet.read_table(tmp_path / "out.parquet")
    texts = [row["volume_mm3"] for row in table(tmp_path / "out.csv")]
    assert [None if t == "" else float(t) for t in texts] == read["volume_mm3"].to_pylist()
    assert read.schema.field("volume_mm3").metadata == {b"unit": "mm³".encode()}
    study = written(tmp_path, '"lattice.a.map.affine.wavelength" = [4, 5]\n"lattice.a.map.affine.rotate" = [[0, 0, 0]]')
    for name in ("with.csv", "with.parquet"):
        assert command("sweep", study, "-o", tmp_path / name, "--per-cell", 8).returncode == 0
    schema = parquet.read_schema(tmp_path / "with.parquet")
    assert schema.field("lattice.a.map.affine.wavelength").metadata == {b"unit": b"mm"}
    assert schema.field("lattice.a.map.affine.rotate").metadata == {b"unit": "°".encode()}
    assert [str(schema.field(name).type) for name in ("error", "warnings", "version")] == ["string"] * 3
    # A table in CSV has plain headings, and the same units in a table of their own.
    units = {row["column"]: row["unit"] for row in csv.DictReader((tmp_path / "with.units.csv").open(encoding="utf-8"))}
    assert list(units) == schema.names == (tmp_path / "with.csv").read_text().partition("\n")[0].split(",")
    assert set(units.values()) == {"mm", "°", "mm²", "mm³", "s", ""}
    assert units == {name: (schema.field(name).metadata or {b"unit": b""})[b"unit"].decode() for name in schema.names}


def test_each_figure_has_its_error_and_each_row_what_reports_warn_of(tmp_path: Path):
    path, settings = written(tmp_path, '"lattice.a.level.fraction" = [0.2]'), {"n": 16}
    names = ("stiffness", "conductivity", "permeability")
    columns = lt.sweep(path, per_cell=8, properties=dict.fromkeys(names, settings))
    data = lt.load(path).to_dict()
    del data["sweep"]
    data["lattice"]["a"]["level"]["fraction"] = 0.2
    solid = lt.Design(**data).build()
    stiffness, conductivity, permeability = (getattr(solid, name)(**settings) for name in names)
    for i, (axis, plane) in enumerate((("1", "23"), ("2", "13"), ("3", "12"))):
        assert columns[f"E{axis}"] == [stiffness.E[i]] and columns[f"E{axis}_error"] == [stiffness.E_error[i]]
        assert columns[f"G{plane}"] == [stiffness.G[i]] and columns[f"G{plane}_error"] == [stiffness.G_error[i]]
        assert columns[f"k{axis}{axis}_error"] == [conductivity.axis_errors[i]]
    assert columns["permeability_error"] == [permeability.error]
    said = columns["warnings"][0].split(" | ")
    reports = zip(names, (stiffness, conductivity, permeability), strict=True)
    wanted = [f"{name}: {warning.path}: {warning.message}" for name, found in reports for warning in found.warnings]
    assert len(wanted) > 2 and [words for words in said if words.partition(":")[0] in names] == wanted
    assert any("grid steps" in words for words in said), said  # of the mesh
    # Those that are known before are those that are made.
    job = Job(lt.load(path), per_cell=8, properties=dict.fromkeys(names, settings))
    assert list(columns) == columns_of_job(job, ["lattice.a.level.fraction"])


def test_warnings_of_a_row_say_what_they_are_of(tmp_path: Path):
    """Of two lattices the primitive network of a fraction below 0.21 falls apart."""
    sweep = '"lattice.b.level.fraction" = [0.1, 0.3]\n'
    other = 'lattice.b = { cell = "primitive", part = "lower", map.affine.wavelength = 4, level.fraction = 0.3 }\n'
    blend = 'blend = { between = ["a", "b"], weight = { linear = { along = [1, 0, 0], stops = [[-2, 0], [2, 1]] } } }\n'
    (tmp_path / "two.toml").write_text(blend + other + BASE + "[sweep]\n" + sweep)
    columns = lt.sweep(tmp_path / "two.toml", per_cell=8)
    data = lt.load(tmp_path / "two.toml").to_dict()
    del data["sweep"]
    for row, fraction in enumerate((0.1, 0.3)):
        data["lattice"]["b"]["level"]["fraction"] = fraction
        wanted = [f"{w['path']}: {w['message']}" for w in lt.Design(**data).build().warnings]
        assert columns["warnings"][row].split(" | ")[: len(wanted)] == wanted
        assert any(words.startswith("lattice.b.level.fraction: ") for words in wanted) == (fraction < 0.2)


# --- stopped and started again ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("jobs", [1, 2])
def test_killed_at_random_moments_and_started_again_it_ends_with_the_same_table(tmp_path: Path, jobs: int):
    study = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 24 }')
    whole, out = tmp_path / "whole.csv", tmp_path / "out.csv"
    assert command("sweep", study, "-o", whole, "--jobs", 2, "--per-cell", 8).returncode == 0
    moments = random.Random(jobs)
    for _ in range(3):
        process = started(study, out, jobs, stderr=subprocess.DEVNULL)
        time.sleep(0.4 + moments.random())
        process.send_signal(signal.SIGKILL)
        if process.wait() == 0:
            break
        with open(f"{out}.rows", "a") as file:  # as if it had been killed while it wrote
            file.write('{"design": 3, "lattice.a.lev')
    assert command("sweep", study, "-o", out, "--jobs", jobs, "--per-cell", 8).returncode == 0
    assert table(out) == table(whole)
    assert not os.path.exists(f"{out}.rows")


def test_rows_that_are_there_are_taken_up_unless_the_study_has_changed(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3]')
    out = tmp_path / "out.csv"
    words = ("sweep", study, "-o", out, "--per-cell", 8, "--jobs", 1)
    job = Job(lt.load(study), per_cell=8.0)
    journal = Journal(str(out), job)
    with journal.writing() as add:
        add(row_of(job, 0, {"lattice.a.level.fraction": 0.2}) | {"pieces": 77})
    study.write_text(study.read_text().replace("wavelength = 4", "wavelength = 5"))
    done = command(*words)
    assert (
        done.returncode == 1 and "changed since are lattice.a.map.affine.wavelength" in done.stderr and "--new" in done.stderr
    )
    assert os.path.exists(journal.path) and not out.exists()
    study.write_text(study.read_text().replace("wavelength = 5", "wavelength = 4"))
    done = command(*words, "--json")
    assert done.returncode == 0 and json.loads(done.stdout)["resumed"] == 1
    assert [row["pieces"] for row in table(out)] == ["77", "1"]

    assert command(*words, "--new").returncode == 0
    assert [row["pieces"] for row in table(out)] == ["1", "1"]


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_finished_table_of_another_study_is_kept(tmp_path: Path, kind: str):
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    out = tmp_path / f"out.{kind}"
    sweep = '"lattice.a.level.fraction" = [0.2, 1.5]\n"lattice.a.cell" = ["gyroid", "diamond"]\n'
    words = ("sweep", written(tmp_path, sweep), "-o", out, "--per-cell", 8, "--jobs", 1)
    assert command(*words).returncode == 0
    finished = out.read_bytes()
    text = (tmp_path / "study.toml").read_text()
    for old, new, said in (
        ("1.5", "0.3", "lattice.a.level.fraction (1.5, now 0.3)"),
        ('"diamond"]', '"iwp"]', "lattice.a.cell (diamond, now iwp)"),
        ("[0.2, 1.5]", "[0.2]", "the number of designs (4, now 2)"),
        ('"lattice.a.cell" = ["gyroid", "diamond"]', "", "columns (lattice.a.cell)"),
        ('part = "sheet"', 'part = "lower"', "keys of the design that do not vary (its sha256 differs)"),
        ("[4, 4, 4]", "[4, 4, 5]", "keys of the design that do not vary (its sha256 differs)"),
    ):
        assert old in text
        (tmp_path / "study.toml").write_text(text.replace(old, new))
        done = command(*words)
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        assert f"{out} is the finished table of another sweep: changed since are {said}" in done.stderr, done.stderr
        assert done.stderr.endswith("; name another output, or overwrite it with --new\n")
        assert out.read_bytes() == finished and not Path(f"{out}.rows").exists()
    done = command(*words, "--properties", "conductivity", "--n", 8)
    assert done.returncode == 1 and "changed since are columns (k11, k12, k13 and " in done.stderr, done.stderr
    done = command(*words, "--new")
    assert done.returncode == 0 and out.read_bytes() != finished
    # The same study is made again, however its values are written.
    (tmp_path / "study.toml").write_text((tmp_path / "study.toml").read_text().replace("[4, 4, 5]", "[4.0, 4, 5e0]"))
    done = command(*words, "--json")
    assert done.returncode == 0 and json.loads(done.stdout)["resumed"] == 0, done.stderr


def test_a_table_of_another_version_is_kept_and_what_is_no_table_is_not(tmp_path: Path):
    study, out = written(tmp_path, TWO), tmp_path / "out.csv"
    words = ("sweep", study, "-o", out, "--per-cell", 8, "--jobs", 1)
    assert command(*words).returncode == 0
    out.write_text(out.read_text().replace(lt.__version__, "0.0.9"))
    done = command(*words)
    assert done.returncode == 1 and f"changed since are the version (0.0.9, now {lt.__version__})" in done.stderr, done.stderr
    # Rows of this study have been made since the table was: they are gone on with.
    journal_of(study, out, row_of(Job(lt.load(study), per_cell=8.0), 0, {"lattice.a.level.fraction": 0.2}))
    done = command(*words, "--json")
    assert done.returncode == 0 and json.loads(done.stdout)["resumed"] == 1, done.stderr
    for other in (b"", b"a,b\n1,2\n", b"\xff\xfe\x00"):
        out.write_bytes(other)
        assert command(*words).returncode == 0 and len(table(out)) == 2


def journal_of(study: Path, out: Path, *rows: dict) -> Path:
    """The rows so far of a sweep, as the command leaves them when it is killed."""
    journal = Journal(str(out), Job(lt.load(study), per_cell=8.0))
    with journal.writing() as add:
        for row in rows:
            add(row)
    return Path(journal.path)


def test_what_has_made_no_design_leaves_nothing_and_stops_no_other_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study, out = written(tmp_path, '"lattice.a.level.fraction" = [1.5, 2]'), tmp_path / "out.csv"
    words = ("sweep", study, "-o", out, "--per-cell", 8, "--jobs", 1)
    assert command(*words).returncode == 1 and os.listdir(tmp_path) == ["study.toml"]
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "distributed", None)
        done = command(*words, "--cluster", "local:1")
    assert done.returncode == 1 and "needs the extra scale" in done.stderr and os.listdir(tmp_path) == ["study.toml"]
    # Killed when it had failures only: the corrected study begins.
    left = journal_of(study, out, {"design": 0, "error": "fraction is 1.5"})
    assert left.exists()
    written(tmp_path, TWO)
    done = command(*words)
    assert done.returncode == 0 and len(table(out)) == 2 and not left.exists()


@pytest.mark.parametrize(
    ("number", "damage", "said"),
    [
        (1, b"{", "does not say what sweep the rows are of; begin anew with --new"),
        (2, b'{"design": 0, "lattice', "does not say a row; take it out to have its design made again, or begin anew"),
        (2, b"\xff\xfe", "does not say a row"),
        (2, b"[]", "does not say a row"),
    ],
)
def test_a_damaged_line_is_named(tmp_path: Path, number: int, damage: bytes, said: str):
    study, out = written(tmp_path, TWO), tmp_path / "out.csv"
    job = Job(lt.load(study), per_cell=8.0)
    path = journal_of(study, out, *(row_of(job, i, {"lattice.a.level.fraction": v}) for i, v in enumerate((0.2, 0.3))))
    lines = path.read_bytes().split(b"\n")
    lines[number - 1] = damage
    path.write_bytes(b"\n".join(lines))
    words = ("sweep", study, "-o", out, "--per-cell", 8, "--jobs", 1)
    done = command(*words)
    assert done.returncode == 1 and f"{path}:{number}: the line is damaged, it {said}" in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1 and path.read_bytes() == b"\n".join(lines)
    if number > 1:
        path.write_bytes(b"\n".join(lines[:1] + lines[2:]))
        assert json.loads(command(*words, "--json").stdout)["resumed"] == 1
    else:
        assert command(*words, "--new").returncode == 0
    assert len(table(out)) == 2


def test_two_sweeps_on_one_output_at_a_time_are_refused(tmp_path: Path):
    pytest.importorskip("fcntl")
    study, out = written(tmp_path, TWO), tmp_path / "out.csv"
    job = Job(lt.load(study), per_cell=8.0)
    with Journal(str(out), job).writing() as add:
        add(row_of(job, 0, {"lattice.a.level.fraction": 0.2}))
        before = Path(f"{out}.rows").read_bytes()
        for more in ((), ("--new",)):
            done = command("sweep", study, "-o", out, "--per-cell", 8, *more)
            assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
            assert f"another process works in {out}.rows; wait for it, or end it" in done.stderr
        assert Path(f"{out}.rows").read_bytes() == before
    assert command("sweep", study, "-o", out, "--per-cell", 8).returncode == 0


def test_files_are_known_by_their_own_paths_and_folders_by_all_they_hold(tmp_path: Path):
    for name in ("a/x.csv", "b/x.csv", "scan/1.png", "scan/2.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    data = {"grade": [{"path": "a/x.csv"}, {"path": "b/x.csv"}], "cell": {"path": "scan/*.png"}, "zone": {"path": "scan/"}}
    before = digests(data, str(tmp_path))
    assert list(before) == ["a/x.csv", "b/x.csv", "scan/*.png", "scan/"] and before["a/x.csv"] != before["b/x.csv"]
    swept = {"sweep": {"region.mesh.path": ["a/x.csv", "b/x.csv"], "region.mesh.repair": ["a"]}}
    assert list(digests(swept, str(tmp_path))) == ["a/x.csv", "b/x.csv"]
    (tmp_path / "scan/2.png").write_text("another")
    after = digests(data, str(tmp_path))
    assert [name for name in before if before[name] != after[name]] == ["scan/*.png", "scan/"]


def test_a_worker_that_is_killed_costs_no_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 12 }')
    alive = []
    start = workers._Worker._started
    monkeypatch.setattr(workers._Worker, "_started", lambda self: alive.append(start(self)) or alive[-1])
    rows = []
    for row in workers.rows_by_processes(Job(lt.load(study), per_cell=8.0), enumerate(Study(lt.load(study)).points()), 2):
        rows.append(row)
        if len(rows) in (1, 4):
            alive[-1].kill()
    assert len(alive) > 2
    assert sorted(row["design"] for row in rows) == list(range(12)) and not any(row["error"] for row in rows)


def test_a_row_whose_process_dies_each_time_is_a_row_with_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2]')
    monkeypatch.setattr(workers._Worker, "row", lambda *_: None)
    (row,) = workers.rows_by_processes(Job(lt.load(study)), [(0, {"lattice.a.level.fraction": 0.2})], 1)
    assert row["design"] == 0 and "its process died 3 times" in row["error"]


def test_workers_of_a_killed_sweep_end_without_a_word(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 200 }')
    process = started(study, tmp_path / "out.csv", 2, stderr=subprocess.PIPE, text=True)
    rows = tmp_path / "out.csv.rows"
    while process.poll() is None and (not rows.exists() or rows.read_text().count("\n") < 3):
        time.sleep(0.05)
    process.kill()
    assert process.communicate(timeout=60)[1] == ""  # its workers have the same stderr: it ends with the last of them


def test_an_interrupt_says_where_the_rows_are(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 200 }')
    process = started(study, tmp_path / "out.csv", 2, stderr=subprocess.PIPE, text=True)
    rows = tmp_path / "out.csv.rows"
    while process.poll() is None and (not rows.exists() or rows.read_text().count("\n") < 3):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    said = process.communicate()[1]
    assert process.returncode == 130 and "of 200 rows stand in" in said and "Traceback" not in said


#: The command in a process whose files may have so many bytes, as on a disk that is full.
FULL = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
from trabecula.command import cli
sys.exit(cli.main(sys.argv[2:]))
"""


def test_a_disk_that_is_full_keeps_the_rows_so_far(tmp_path: Path):
    pytest.importorskip("resource")
    study, out = written(tmp_path, '"lattice.a.level.fraction" = { from = 0.1, to = 0.6, count = 12 }'), tmp_path / "out.csv"
    words = ("sweep", study, "-o", out, "--per-cell", 8, "--jobs", 1)
    done = subprocess.run([sys.executable, "-c", FULL, "4000", *map(str, words)], capture_output=True, text=True, check=False)
    rows = Path(f"{out}.rows")
    begun = rows.read_bytes().count(b"\n") - 1
    said = f"{rows}: File too large; {begun} rows are safe; free some space, and the same command goes on"
    assert done.returncode == 1 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert 0 < begun < 12
    again = command(*words, "--json")
    assert again.returncode == 0 and json.loads(again.stdout)["resumed"] == begun
    assert command(*words[:3], tmp_path / "whole.csv", *words[4:]).returncode == 0
    assert table(out) == table(tmp_path / "whole.csv")


# --- drawings, objectives, mistakes -----------------------------------------------------------------------------------


def test_the_table_is_drawn_with_its_pareto_front(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3, 0.4]')
    plot = ("--plot", "solid_fraction", "area_mm2", "wall_mm", "--front", "min,max")
    done = command("sweep", study, "-o", tmp_path / "out.csv", "--per-cell", 8, *plot)
    assert done.returncode == 0, done.stderr
    drawing = (tmp_path / "out.svg").read_text()
    assert drawing.count("<circle") == 3 and "Pareto front: solid_fraction min, area_mm2 max" in drawing
    again = command("sweep", tmp_path / "out.csv", "-o", tmp_path / "again.svg", *plot)
    assert again.returncode == 0 and (tmp_path / "again.svg").read_text() == drawing
    wrong = command("sweep", tmp_path / "out.csv", "-o", tmp_path / "no.svg", "--plot", "solid_fraction", "colour")
    assert wrong.returncode == 1 and 'there is no column "colour"; with numbers there are design, ' in wrong.stderr


def test_texts_are_colours_and_units_stand_at_the_axes(tmp_path: Path):
    pytest.importorskip("pyarrow")
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3, 1.5]\n"lattice.a.cell" = ["gyroid", "diamond"]')
    plot = ("--plot", "pore_mm", "area_mm2", "lattice.a.cell")
    done = command("sweep", study, "-o", tmp_path / "out.csv", "--per-cell", 8, *plot)
    assert done.returncode == 0 and "out.svg: written; 2 of 6 designs left out, which lack a number" in done.stderr
    drawing = (tmp_path / "out.svg").read_text()
    marks = [line for line in drawing.splitlines() if line.startswith("<circle")]
    colours = {text: {line.split('fill="')[1][:7] for line in marks if text in line} for text in ("gyroid", "diamond")}
    assert (
        len(marks) == 4 + 2 and all(len(found) == 1 for found in colours.values()) and colours["gyroid"] != colours["diamond"]
    )
    for words in ("pore (mm)", "area (mm²)", "gyroid", "diamond", "lattice.a.cell", "2 of 6 designs left out"):
        assert f">{words}" in drawing, words
    assert command("sweep", study, "-o", tmp_path / "out.parquet", "--per-cell", 8).returncode == 0
    assert command("sweep", tmp_path / "out.parquet", "-o", tmp_path / "two.svg", *plot).returncode == 0
    assert (tmp_path / "two.svg").read_text() == drawing


def test_more_texts_than_colours_are_others():
    texts = [f"kind {i}" for i in range(11)]
    drawing = scatter({"x": list(range(11)), "y": list(range(11)), "of": texts}, "x", "y", "of")
    assert "3 others" in drawing and drawing.count("<circle") == 11 + 9


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", b"PK\x03\x04\xff\xfe", "a.csv:1: not text in UTF-8"),
        ("a.csv", b"x,y\n1,\0\n", "a.csv: "),
        ("a.csv", b"", "a.csv is empty"),
        ("a.parquet", b"x,y\n1,2\n", "a.parquet: no table in Parquet"),
    ],
)
def test_what_is_no_table_is_named(tmp_path: Path, name: str, content: bytes, said: str):
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    (tmp_path / name).write_bytes(content)
    done = command("sweep", tmp_path / name, "-o", tmp_path / "out.svg", "--plot", "x", "y")
    assert done.returncode == 1 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_an_objective_is_a_plain_function():
    design = {
        "region": lt.region.box(size=[4, 4, 4]),
        "lattice": {"a": lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.3))},
    }
    path = "lattice.a.level.fraction"
    of = lt.objective(design, [path], ["solid_fraction", "volume_mm3"], per_cell=16)
    made = of({path: 0.25})
    assert made["volume_mm3"] == 64 * made["solid_fraction"] and list(made) == ["solid_fraction", "volume_mm3"]
    with pytest.raises(ValueError, match=r"fraction is 1\.5"):
        of({path: 1.5})
    other = "lattice.c.level.fraction"
    with pytest.raises(ValueError, match=r"^lattice\.c\.level\.fraction: there is no lattice\.c; did you mean lattice\.a\?"):
        lt.objective(design, [other], ["solid_fraction"])
    with pytest.raises(ValueError, match=r"there is no beams\.b; the design has no beams$"):
        lt.objective(design, ["beams.b.radius"], ["solid_fraction"])
    with pytest.raises(ValueError, match=r"^lattice\.a\.level\.fraction lies in lattice\.a\.level, which is a parameter too"):
        lt.objective(design, [path, "lattice.a.level"], ["solid_fraction"])
    with pytest.raises(ValueError, match=r'unknown output "volume"; did you mean "volume_mm3"\?'):
        lt.objective(design, [path], ["volume"])
    with pytest.raises(ValueError, match=r'unknown property "stifness"; did you mean "stiffness"\?'):
        lt.objective(design, [path], ["E1"], properties=["stifness"])
    with pytest.raises(ValueError, match=r"expected values of lattice\.a\.level\.fraction, found none"):
        of({})


def test_an_objective_goes_to_other_processes(tmp_path: Path, monkeypatch):
    """As pools of optimisers have it; a file of the design is found from any folder, errors come back."""
    monkeypatch.chdir(tmp_path)
    Path("box.toml").write_text(BASE)
    lt.load("box.toml").build().mesh(per_cell=8).write("part.stl")
    path, core = "lattice.a.level.fraction", lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.3))
    for design in ("box.toml", lt.Design(region=lt.region.mesh("part.stl"), lattice={"a": core})):
        monkeypatch.chdir(tmp_path)
        of = lt.objective(design, [path], ["volume_mm3", "wall_mm"], per_cell=8)
        made = of({path: 0.3})
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            assert pool.submit(of, {path: 0.3}).result() == made
            with pytest.raises(ValueError, match=r"fraction is 1\.5"):
                pool.submit(of, {path: 1.5}).result()
        monkeypatch.chdir("/")
        assert pickle.loads(pickle.dumps(of))({path: 0.3}) == made


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        ('"lattice.a.levl.fraction" = [0.2]', 'unknown key "levl"; did you mean "level"?'),
        ('"latice.a.level.fraction" = [0.2]', 'unknown key "latice"; did you mean "lattice"?'),
        ('"lattice.a.cell" = ["gyroid", "gyriod"]', 'unknown cell "gyriod"; did you mean "gyroid"?'),
        ('"lattice.a.level.fraction" = []', "at least one value needed, found none"),
        ('"lattice.a.level.fraction" = 0.3', "a list"),
        ('"lattice.a.level.fraction" = { from = 0.1, to = 0.3 }', "count is missing"),
        ('"lattice.a.level.fraction" = { from = 0.1, to = 0.3 }\nsampling = "latin"', "the number of designs is missing"),
        ('"lattice.a.level.fraction" = { from = 0, to = 0.3, count = 3, scale = "log" }', "both ends greater than 0"),
        ('"lattice.a.level.fraction" = [0.2]\nsampling = "lhs"', 'did you mean "latin"?'),
        ('"lattice.a.level.fraction" = [0.2, 0.3]\ncount = 1', "a grid is every combination of the values"),
        ('"region.box.size[7]" = [1]', "there is no item [7] in the list"),
        ("", "nothing varies"),
        ('"lattice.b.level.fraction" = [0.2]', "there is no lattice.b; did you mean lattice.a?"),
        ("lattice.b.level.fraction = [0.2]", "there is no lattice.b; did you mean lattice.a?"),
        ('"region.box.sise[0]" = [4]', 'unknown key "sise"; did you mean "size"?'),
        ('"lattice.a.map.affine.offset[0]" = [1]', "lattice.a.map.affine.offset is none in the design"),
        ('"lattice.a.level.fraction" = [0.2, nan]', "value 2 is nan, which no key can have; give a finite number"),
        ('"lattice.a.level.fraction" = { from = 0.1, to = 0.3, count = 3 }\nsampling = "sobol"\ncount = 4', "is of a grid"),
        (
            '"lattice.a.level" = [{ fraction = 0.3 }]\n"lattice.a.level.fraction" = [0.2]',
            "sweep.lattice.a.level.fraction: it lies in lattice.a.level, which varies too; vary one of them",
        ),
        ('"region.box.size" = [[4, 4, 4]]\n"region.box.size[0]" = [3]', "it lies in region.box.size, which varies too"),
    ],
)
def test_a_sweep_that_is_none_is_refused_with_its_line(tmp_path: Path, sweep: str, said: str):
    done = command("sweep", written(tmp_path, sweep), "-o", tmp_path / "out.csv")
    assert done.returncode == 1 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert "study.toml:" in done.stderr


@pytest.mark.parametrize(
    ("sweep", "more", "said"),
    [
        ('"lattice.a.level.fraction" = [0.2]\nwhere = ["lattice.a.level.fraction > 1"]', (), "no design keeps the conditions"),
        ('"lattice.a.level.fraction" = [0.2]\nwhere = ["fraction > 1"]', (), "names fraction, which is no key"),
        ('"lattice.a.level.fraction" = { from = 0.1, to = 0.3, count = 1000001 }', (), "made with --yes only"),
        (TWO, ("--plot", "solid_fraction", "area"), '--plot: there is no column "area"; did you mean "area_mm2"?'),
        (TWO, ("--plot", "solid_fraction", "error"), '--plot: the column "error" holds no numbers'),
    ],
)
def test_what_cannot_be_swept_is_refused(tmp_path: Path, sweep: str, more: tuple, said: str):
    done = command("sweep", written(tmp_path, sweep), "-o", tmp_path / "out.csv", *more)
    assert done.returncode == 1 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--meshes", "one.stl"), "write {design} where the number goes"),
        (("--meshes", "{design}.stp"), "the name must end in"),
        (("--properties", "stifness"), 'unknown property "stifness"; did you mean stiffness?'),
        (("--cluster", "nonsense"), "expected local:N, slurm:N or an address such as tcp://head:8786, found nonsense"),
        (("--cluster", "local:0"), "expected local:N with N from 1 to 4096, found local:0"),
        (("--front", "min,max"), "--front is of --plot"),
        (("--plot", "solid_fraction"), "--plot takes two columns, or three"),
    ],
)
def test_options_that_are_none_are_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture, more: tuple, said: str):
    words = ["sweep", str(written(tmp_path, TWO)), "-o", str(tmp_path / "out.csv"), *more]
    try:
        status = cli.main(words)
    except SystemExit as left:
        status = left.code
    reported = capsys.readouterr().err
    assert status == 2 and said in reported and reported.count("\n") == 1, reported
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_the_command_knows_the_properties_that_there_are():
    assert tuple(PROPERTIES) == arguments.PROPERTIES


@pytest.mark.parametrize(
    ("path", "values", "said"),
    [
        ("lattice.a.level.fraction", [0.2, math.nan], "value 2 is nan, which no key can have"),
        ("lattice.a.level.fraction", [None], "value 1 is None"),
        ("lattice.a.level.thickness", [{"linear": {"along": [0, 0, 1], "stops": [[0, 0.3], [1, math.inf]]}}], "value 1 is inf"),
        ("lattice.b.level.fraction", [0.2], r"there is no lattice\.b; did you mean lattice\.a\?"),
        ("region.box.sise[0]", [4], 'unknown key "sise"; did you mean "size"?'),
    ],
)
def test_a_study_made_in_python_is_refused_as_its_file_is(tmp_path: Path, path: str, values: list, said: str):
    design = lt.load(written(tmp_path, TWO)).to_dict() | {"sweep": {path: values}}
    with pytest.raises(lt.DesignError, match=said):
        lt.sweep(design)


def test_a_design_without_a_sweep_is_refused(tmp_path: Path):
    (tmp_path / "plain.toml").write_text(BASE)
    done = command("sweep", tmp_path / "plain.toml", "-o", tmp_path / "out.csv")
    assert done.returncode == 1 and "the design has no [sweep]" in done.stderr


def test_a_sweep_changes_nothing_for_other_commands(tmp_path: Path):
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.1]')
    (tmp_path / "plain.toml").write_text(BASE)
    reports = [command("check", path, "--json").stdout for path in (study, tmp_path / "plain.toml")]
    assert reports[0] == reports[1] and reports[0]
    assert lt.load(study).to_dict()["sweep"] == {"lattice.a.level.fraction": [0.1]}
    lt.load(study).save(tmp_path / "saved.toml")
    assert lt.load(tmp_path / "saved.toml") == lt.load(study)


def test_a_parquet_table_without_pyarrow_is_refused_before_any_design(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    study = written(tmp_path, '"lattice.a.level.fraction" = [0.2, 0.3]')
    done = command("sweep", study, "-o", tmp_path / "table.parquet")
    assert done.returncode == 1
    assert "is written by pyarrow, which is missing: pip install 'trabecula[scale]'" in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["study.toml"]


def test_a_property_that_fails_leaves_the_rest_of_its_row():
    """Loose balls carry nothing, but conduct through the pore."""
    lattice = {"cell": "primitive", "part": "lower", "map": {"affine": {"wavelength": 4}}, "level": {"fraction": 0.1}}
    study = {
        "region": {"box": {"size": [4, 4, 4]}},
        "lattice": {"core": lattice},
        "sweep": {"lattice.core.level.fraction": [0.1]},
    }
    table = lt.sweep(study, per_cell=16, properties={"stiffness": {"n": 16}, "conductivity": {"n": 16, "pore": 0.5}})
    assert table["volume_mm3"][0] == pytest.approx(6.4, rel=0.05) and table["k11"][0] > 0.5
    assert table["C11"][0] is None and table["error"][0].startswith("stiffness: ")


def test_the_command_keeps_rows_whose_property_fails(tmp_path):
    base = BASE.replace('cell = "gyroid"', 'cell = "primitive"').replace('part = "sheet"', 'part = "lower"')
    (tmp_path / "balls.toml").write_text(base + '[sweep]\n"lattice.a.level.fraction" = [0.1, 0.12]')
    words = ("--per-cell", 12, "--properties", "stiffness", "--n", 16)
    done = command("sweep", tmp_path / "balls.toml", "-o", tmp_path / "balls.csv", *words)
    assert done.returncode == 0 and "2 of them with an error" in done.stderr
    rows = table(tmp_path / "balls.csv")
    assert all(float(row["volume_mm3"]) > 5 and row["error"].startswith("stiffness: ") for row in rows)
