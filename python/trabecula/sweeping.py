"""What ``trabecula sweep`` does: a sweep that takes up the rows of an earlier run, and drawings of its table."""

from __future__ import annotations

import csv
import os
from contextlib import closing
from typing import Any

from .bridges import package
from .design import Design
from .errors import Refused, WrongUsage
from .files import write_svg
from .formats import kind_of
from .scatter import scatter
from .study import Study
from .sweeps import FEW, Journal, columns_of, prepared, run, write_table
from .terminal import Progress, left, say

__all__ = ["draw", "table_of"]


def table_of(design: Design, args) -> dict[str, Any]:
    """Makes the table and writes it; the numbers of rows, of failed ones and of those from an earlier run."""
    if kind_of(args.output) == "svg":
        raise Refused(f"{args.output} is a drawing; name a table (.csv or .parquet), the drawing gets its name")
    if kind_of(args.output) == "parquet":
        try:
            package("pyarrow")
        except ImportError:
            words = "is written by pyarrow, which is missing: pip install 'trabecula[scale]', or name a table in .csv"
            raise Refused(f"{args.output} {words}") from None
    size = Study(design).size()
    if size > FEW and not args.yes:
        raise Refused(f"the sweep has {size} designs; more than {FEW} are made with --yes only")
    names = [name.strip() for name in args.properties.split(",")] if args.properties else []
    if args.n is not None and not names:
        raise WrongUsage("--n is of --properties; name some, or leave it out")
    properties = {name: {} if args.n is None else {"n": args.n} for name in names}
    job, points = prepared(design, args.edge, args.per_cell, properties, args.meshes, args.pictures)
    journal = Journal(args.output, job)
    resumed = journal.resume(args.new)
    tasks = [(number, point) for number, point in enumerate(points) if number not in journal.rows]
    jobs = args.jobs or os.cpu_count() or 1
    try:
        with journal.writing() as add, Progress("designs", args.progress) as progress:
            if resumed:
                say(f"{resumed} of {len(points)} rows are there already ({journal.path})")
            with closing(run(job, tasks, jobs, args.cluster)) as rows:
                for row in rows:
                    add(row)
                    progress(len(journal.rows), len(points))
    except BaseException:
        left.append(f"{len(journal.rows)} of {len(points)} rows stand in {journal.path}; the same command goes on from there")
        raise
    made = [journal.rows[number] for number in range(len(points))]
    failed = [row for row in made if row["error"]]
    if len(failed) == len(made):
        reasons = list(dict.fromkeys(row["error"] for row in failed))[:3]
        raise Refused(f"none of {len(made)} designs can be made; the first reasons: " + "; ".join(reasons))
    write_table(args.output, columns_of(made))
    journal.end()
    return {"rows": len(made), "failed": len(failed), "resumed": resumed}


def draw(table: str, args, drawing: str) -> None:
    """Draws two columns of a table, or three."""
    if not 2 <= len(args.plot) <= 3:
        raise WrongUsage(f"--plot takes two columns, or three: X Y COLOUR; found {len(args.plot)}")
    columns = columns_of_table(table)
    try:
        write_svg(drawing, lambda: scatter(columns, *args.plot, front=args.front))
    except ValueError as error:
        raise Refused(f"{table}: {error}") from None


def columns_of_table(name: str) -> dict[str, list]:
    """The columns of a table that is written, numbers as numbers."""
    if kind_of(name) == "parquet":
        from .bridges import package

        return package("pyarrow.parquet").read_table(name).to_pydict()
    with open(name, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    if not rows:
        raise Refused(f"{name} is empty")
    return {column: [number_of(row[i]) if i < len(row) else None for row in rows[1:]] for i, column in enumerate(rows[0])}


def number_of(text: str) -> float | str:
    """A number, or the text as it is."""
    try:
        return float(text)
    except ValueError:
        return text
