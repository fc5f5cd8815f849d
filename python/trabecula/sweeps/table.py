"""Sweeps: many designs of one, as a table with a row for each, that goes on where it was when it was stopped."""

from __future__ import annotations

import csv
import inspect
import itertools
import json
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any

from .. import _core
from ..base.files import check_place, extension, special, whole_file
from ..base.formats import MESH_WRITES, SWEEP_WRITES
from ..base.given import whole
from ..base.keys import nearest
from ..base.varying import overlapping
from ..design import Design, load
from ..errors import Refused
from ..io.bridges import package
from ..jobs.sent import digests
from ..jobs.unfinished import alone, differences
from ..simulated import Simulated
from .remote import rows_by_cluster
from .rows import LAST, PROPERTIES, TEXTS, Job, check_paths, columns_of_job, is_made, named, row_of, unit_of_column
from .study import Study
from .workers import rows_by_processes, rows_here

__all__ = ["FEW", "Journal", "cell", "columns_of", "objective", "run", "sweep", "units_of", "write_table"]

#: More designs than these are asked about.
FEW = 1_000_000


def sweep(
    study: Design | dict | str | os.PathLike[str],
    jobs: int = 1,
    edge: float | None = None,
    per_cell: float | None = None,
    properties: Mapping[str, Mapping[str, Any]] | Iterable[str] = (),
    meshes: str | None = None,
    pictures: str | None = None,
    cluster: str | None = None,
    progress: Callable[[int, int], Any] | None = None,
) -> dict[str, list]:
    """A table of all designs of a study, {column: values}, which ``pandas.DataFrame`` and ``polars.DataFrame`` take as it is.

    The study is a design with ``sweep``: {path of a key: list of values, or {"from", "to", "count"}} and ``sampling``,
    ``count``, ``seed``, ``where``; or the path of its file. A row has the number of the design, the values by path,
    ``fraction_asked`` (of the cell), ``wall_mm`` and ``pore_mm`` (the least), and as measured at ``edge`` (mm) or
    ``per_cell`` ``solid_fraction``, ``volume_mm3``, ``area_mm2``, ``pieces``; then ``warnings`` (of design, mesh, properties),
    ``error`` (why there is no such design, or None), ``seconds``, ``sha256`` of the design's text, ``version``.
    ``properties`` names what else is computed, with settings: {"stiffness": {"n": 48}}; each figure has its relative error
    next to it. ``meshes`` and ``pictures`` are names of files to write, with ``{design}`` for the number. ``jobs`` processes
    share the work, or the workers of a Dask ``cluster`` ("local:N" or an address). Rows are in order, and apart from
    ``seconds`` the same for any number of processes.

    Raises DesignError for a study that is none, ValueError where no design keeps the conditions. One that cannot be made is a
    row with its error.
    """
    job, points = prepared(study, edge, per_cell, properties, meshes, pictures)
    rows = []
    with closing(run(job, list(enumerate(points)), jobs, cluster)) as made:
        for row in made:
            rows.append(row)
            if progress:
                progress(len(rows), len(points))
    return columns_of(sorted(rows, key=lambda row: row["design"]))


def objective(
    template: Design | dict | str | os.PathLike[str],
    parameters: Iterable[str],
    outputs: Iterable[str],
    edge: float | None = None,
    per_cell: float | None = None,
    properties: Mapping[str, Mapping[str, Any]] | Iterable[str] = (),
) -> Callable[[Mapping[str, Any]], dict[str, float]]:
    """A function of {path: value} that gives {column: value}, for optimisers: of the design with these values the ``outputs``,
    names of columns of ``sweep``. It raises ValueError where there is no such design, and can be pickled for other processes.

    Raises ValueError for parameters that are no keys of the design, and outputs that are no columns.
    """
    paths, wanted = _names("parameters", parameters), _names("outputs", outputs)
    design = design_of(template)
    if design.folder is None:
        design = replace(design, folder=os.getcwd())  # files that it names are found from other processes too
    job = Job(design, edge, per_cell, properties=settings_of(properties))
    for path in paths:
        if not isinstance(path, str):
            raise TypeError(f"expected paths of keys as text, found {path!r}")
    check_paths(design, paths)
    if both := overlapping(paths):
        raise ValueError(f"{both[1]} lies in {both[0]}, which is a parameter too; take one of them")
    known = columns_of_job(job, paths)
    for name in wanted:
        if name not in known:
            raise ValueError(f'unknown output "{name}"; {nearest(name, known)}')
    return Objective(job, tuple(paths), tuple(wanted))


@dataclass(frozen=True)
class Objective:
    """What ``objective`` gives."""

    job: Job
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]

    def __call__(self, values: Mapping[str, Any]) -> dict[str, float]:
        """The outputs of the design with these values."""
        if not isinstance(values, Mapping):
            raise TypeError(f"expected {{path: value}}, found {values!r:.80}")
        if set(values) != set(self.parameters):
            raise ValueError(f"expected values of {', '.join(self.parameters)}, found {', '.join(values) or 'none'}")
        row = row_of(self.job, 0, {path: values[path] for path in self.parameters})
        if row["error"]:
            raise ValueError(row["error"])
        return {name: row[name] for name in self.outputs}


def design_of(given: Design | dict | str | os.PathLike[str]) -> Design:
    """A design as it is, of plain data, or of a file."""
    if isinstance(given, Design):
        return given
    return Design(**given) if isinstance(given, dict) else load(given)


def settings_of(properties: Mapping[str, Mapping[str, Any]] | Iterable[str]) -> dict[str, dict[str, Any]]:
    """Properties by name, each with its settings. A ValueError for an unknown one."""
    given = dict(properties) if isinstance(properties, Mapping) else {name: {} for name in _names("properties", properties)}
    for name in given:
        if name not in PROPERTIES:
            raise ValueError(f'unknown property "{name}"; {nearest(str(name), PROPERTIES)}')
        taken = list(inspect.signature(getattr(Simulated, name)).parameters)[1:]
        known = [setting for setting in taken if setting not in ("threads", "progress")]
        for setting in given[name]:
            if setting not in known:
                raise ValueError(f'{name} has no setting "{setting}"; {nearest(str(setting), known)}')
    return {name: dict(settings) for name, settings in given.items()}


def _names(what: str, given: Iterable[str]) -> list[str]:
    """Names in a list. A TypeError for one text, of which letters would be names."""
    if isinstance(given, (str, bytes)):
        raise TypeError(f"{what} must be a list of names, such as [{given!r}], found {given!r}")
    return list(given)


def prepared(
    study: Design | dict | str | os.PathLike[str],
    edge: float | None,
    per_cell: float | None,
    properties: Mapping[str, Mapping[str, Any]] | Iterable[str],
    meshes: str | None,
    pictures: str | None,
) -> tuple[Job, list[dict[str, Any]]]:
    """What is to be done, and all points."""
    given = Study(design_of(study))
    points = list(given.points())
    for pattern, word, kinds in ((meshes, "meshes", MESH_WRITES), (pictures, "pictures", ("png",))):
        if not pattern:
            continue
        if len(points) > 1 and named(pattern, 0) == named(pattern, 1):
            raise ValueError(f"{word}: {pattern} names one file for all designs; write {{design}} where the number goes")
        extension(pattern, kinds)
        os.makedirs(os.path.dirname(pattern) or ".", exist_ok=True)
        check_place(named(pattern, 0))
    return Job(given.design, edge, per_cell, meshes, pictures, settings_of(properties)), points


def run(job: Job, tasks: list[tuple[int, dict[str, Any]]], jobs: int, cluster: str | None = None) -> Generator[dict[str, Any]]:
    """The rows of numbered points, as they are done."""
    jobs = min(whole("jobs", jobs, 1, 4096), max(len(tasks), 1))
    if cluster:
        return rows_by_cluster(job, tasks, cluster)
    return rows_by_processes(job, tasks, jobs) if jobs > 1 else rows_here(job, tasks)


def columns_of(rows: list[dict[str, Any]]) -> dict[str, list]:
    """Rows as columns: those of all rows, None where a row has none; bookkeeping last."""
    names = dict.fromkeys(itertools.chain.from_iterable(rows))
    order = [*(n for n in names if n not in LAST), *(n for n in LAST if n in names)]
    return {name: [row.get(name) for row in rows] for name in order}


class Journal:
    """The rows of a sweep so far, in a file of JSON lines beside its output, and what sweep they are of.

    Rows stand there as soon as they are made. What was being written when a process was killed is half a line, and left out.
    """

    def __init__(self, output: str, job: Job):
        self.path = f"{output}.rows"
        inputs = digests(job.design.to_dict(), job.design.folder or os.getcwd())
        head = job.to_dict() | {"version": _core.__version__, "inputs": inputs}
        for changing in ("folder", "threads"):
            head.pop(changing)
        self.head = json.loads(json.dumps(head))
        self.rows: dict[int, dict[str, Any]] = {}
        self.ended = False

    @contextmanager
    def writing(self, new: bool = False) -> Iterator[Callable[[dict[str, Any]], None]]:
        """Takes up the rows of an earlier run, unless a ``new`` one is wanted, and gives a function that adds one.

        Raises Refused if they are of another sweep, with the keys that differ, if one is damaged, and while another process
        writes to them. A file without a row goes at the end.
        """
        with open(self.path, "a+b", 0) as file:
            alone(file, self.path)
            file.seek(0)
            begun = 0 if new else self._read(file.read())
            file.truncate(begun)

            def write(line: dict[str, Any]) -> None:
                left = memoryview(json.dumps(line).encode() + b"\n")
                try:
                    while left:  # a disk that fills takes a part, and then none with an error
                        left = left[file.write(left) or 0 :]
                except OSError as error:
                    safe = f"{len(self.rows)} rows are safe; free some space, and the same command goes on"
                    raise OSError(f"{self.path}: {os.strerror(error.errno or 0)}; {safe}") from error

            def add(row: dict[str, Any]) -> None:
                write(row)
                self.rows[row["design"]] = row

            if not begun:
                write(self.head)
            try:
                yield add
            except BaseException:
                self.ended = self.ended or not self.rows
                raise
            finally:
                if self.ended:
                    # While it is locked, where a file that is open can be removed.
                    if os.name == "nt":
                        file.close()
                    with suppress(FileNotFoundError):
                        os.remove(self.path)

    def _read(self, raw: bytes) -> int:
        """Takes up the rows of a file; the length of what is taken up, nothing of another sweep that has made no design."""
        whole = raw[: raw.rfind(b"\n") + 1]
        read = [self._line(n, line) for n, line in enumerate(whole.split(b"\n"), 1) if line.strip()]
        if not read:
            return 0
        changed = differences(read[0], self.head)
        if changed and any(map(is_made, read[1:])):
            raise Refused(
                f"{self.path} holds {len(read) - 1} rows of another sweep: changed since are {', '.join(changed[:6])}; "
                "take that back, or begin anew with --new"
            )
        if changed:
            return 0
        self.rows = {row["design"]: row for row in read[1:]}
        return len(whole)

    def _line(self, number: int, line: bytes) -> dict[str, Any]:
        """What a line says: the first one what sweep it is of, the others a row each."""
        try:
            read = json.loads(line)
        except ValueError:
            read = None
        head = number == 1
        if isinstance(read, dict) and isinstance(read.get("design"), dict if head else int) and (head or "error" in read):
            return read
        advice = "" if head else "take it out to have its design made again, or "
        what = "what sweep the rows are of" if head else "a row"
        raise Refused(f"{self.path}:{number}: the line is damaged, it does not say {what}; {advice}begin anew with --new")

    def end(self) -> None:
        """Lets the file go: its rows stand in the output, or are good for nothing."""
        self.ended = True


def units_of(path: str) -> str | None:
    """The name of the table of units next to a table in CSV; None of others, which carry them, and of what is no file."""
    stem, dot = os.path.splitext(path)
    return f"{stem}.units{dot}" if dot.lower() == ".csv" and not special(path) else None


def write_table(path: str, columns: dict[str, list]) -> None:
    """Writes a table, Parquet (with pyarrow), whose columns carry their units, or CSV, with a table of units next to it."""
    if extension(path, SWEEP_WRITES) == "csv":
        if units := units_of(path):
            _write_csv(units, ["column", "unit"], ((name, unit_of_column(name)) for name in columns))
        _write_csv(path, columns, zip(*(map(cell, column) for column in columns.values()), strict=True))
        return
    arrow = package("pyarrow")
    parquet = package("pyarrow.parquet")
    fields, arrays = [], []
    for name, column in columns.items():
        plain = [json.dumps(v) if isinstance(v, list | dict) else v for v in column]
        kinds = {type(v) for v in plain if v is not None}
        if name in TEXTS or (len(kinds - {int, float}) and len(kinds) > 1):  # texts and numbers in one column
            plain, kinds = [None if v is None else str(v) for v in plain], {str}
        numbers = not kinds or kinds == {int, float}
        array = arrow.array(plain, arrow.float64() if numbers else arrow.string() if kinds == {str} else None)
        unit = unit_of_column(name)
        fields.append(arrow.field(name, array.type, metadata={"unit": unit} if unit else None))
        arrays.append(array)
    with whole_file(path) as temporary:
        parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), temporary)


def _write_csv(path: str, head: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    with whole_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)


def cell(value: Any) -> Any:
    """A value as it stands in a table of text: lists as JSON, nothing for None."""
    if isinstance(value, list | tuple | dict):
        return json.dumps(value)
    return "" if value is None else value
