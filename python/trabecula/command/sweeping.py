"""What ``trabecula sweep`` does: a sweep that takes up the rows of an earlier run, and drawings of its table."""

from __future__ import annotations

import csv
import io
import os
from argparse import Namespace
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any

from .. import _core
from ..base.files import read_text, special, write_svg
from ..base.formats import kind_of
from ..base.keys import nearest
from ..base.terminal import Progress, left, say
from ..design import Design
from ..errors import Refused, WrongUsage
from ..io.bridges import package
from ..sweeps.rows import TEXTS, Job, columns_of_job, digest_of, is_made, named
from ..sweeps.scatter import scatter, without_place
from ..sweeps.study import Study
from ..sweeps.table import FEW, Journal, cell, columns_of, prepared, run, units_of, write_table

__all__ = ["draw", "table_of", "units_of"]


def table_of(design: Design, args: Namespace) -> dict[str, Any]:
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
    if args.n is not None and not args.properties:
        raise WrongUsage("--n is of --properties; name some, or leave it out")
    for option, pattern in (("--meshes", args.meshes), ("--pictures", args.pictures)):
        if pattern and size > 1 and named(pattern, 0) == named(pattern, 1):
            raise WrongUsage(f"{option}: {pattern} names one file for all designs; write {{design}} where the number goes")
    properties = {name: {} if args.n is None else {"n": args.n} for name in args.properties or ()}
    job, points = prepared(design, args.edge, args.per_cell, properties, args.meshes, args.pictures)
    check_plot(job, points, args.plot or ())
    journal = Journal(args.output, job)
    with journal.writing(args.new) as add:
        resumed = len(journal.rows)
        if not (args.new or resumed):
            check_finished(args.output, job, points)
        if resumed:
            say(f"{resumed} of {len(points)} rows are there already ({journal.path})")
        make(job, points, journal, add, args)
        made = [journal.rows[number] for number in range(len(points))]
        failed = [row for row in made if row["error"]]
        if not any(map(is_made, made)):
            journal.end()
            reasons = list(dict.fromkeys(row["error"] for row in failed))[:3]
            raise Refused(f"none of {len(made)} designs can be made; the first reasons: " + "; ".join(reasons))
        write_table(args.output, columns_of(made))
        journal.end()
    return {"rows": len(made), "failed": len(failed), "resumed": resumed}


def check_finished(name: str, job: Job, points: list[dict[str, Any]]) -> None:
    """Refuses to overwrite a finished table of other designs, with what differs. What is no table of a sweep is an output like
    others.
    """
    if special(name) or not os.path.isfile(name) or not os.path.getsize(name):
        return
    try:
        found = columns_of_table(name)
    except (Refused, ValueError):
        return
    if "design" in found and "sha256" in found and (changed := changes(found, job, points)):
        raise Refused(
            f"{name} is the finished table of another sweep: changed since are {', '.join(changed[:6])}; name another "
            "output, or overwrite it with --new"
        )


def changes(table: dict[str, list], job: Job, points: list[dict[str, Any]]) -> list[str]:
    """What differs between a finished table and one of these points, where the table shows it."""
    known = columns_of_job(job, points[0])
    if apart := [column for column in dict.fromkeys([*table, *known]) if (column in table) != (column in known)]:
        more = f" and {len(apart) - 3} more" if len(apart) > 3 else ""
        return [f"columns ({', '.join(apart[:3])}{more})"]
    count = len(table["design"])
    if count != len(points):
        return [f"the number of designs ({count}, now {len(points)})"]
    changed = []
    for path in points[0]:
        pairs = zip(table[path], (point[path] for point in points), strict=True)
        if other := next(((old, new) for old, new in pairs if plain(old) != plain(new)), None):
            changed.append(f"{path} ({plain(other[0])!s:.40}, now {plain(other[1])!s:.40})")
    if changed:
        return changed
    if version := next((of for of in table["version"] if of and of != _core.__version__), None):
        return [f"the version ({version}, now {_core.__version__})"]
    # Values are the same, so that of the designs either all or none are.
    made = next(((digest, point) for digest, point in zip(table["sha256"], points, strict=True) if digest), None)
    same = made is None or made[0] == digest_of(job.design, made[1])
    return [] if same else ["keys of the design that do not vary (its sha256 differs)"]


def plain(value: Any) -> float | str:
    """A value as a table in CSV gives it back."""
    return number_of(str(cell(value)))


def make(
    job: Job, points: list[dict[str, Any]], journal: Journal, add: Callable[[dict[str, Any]], None], args: Namespace
) -> None:
    """Makes the rows that are not there yet; after any other end says where those are that are."""
    tasks = [(number, point) for number, point in enumerate(points) if number not in journal.rows]
    try:
        made = run(job, tasks, args.jobs or os.cpu_count() or 1, args.cluster)
        with Progress("designs", args.progress) as progress, closing(made) as rows:
            for row in rows:
                add(row)
                progress(len(journal.rows), len(points))
    except BaseException:
        if done := len(journal.rows):
            left.append(f"{done} of {len(points)} rows stand in {journal.path}; the same command goes on from there")
        raise


def check_plot(job: Job, points: list[dict[str, Any]], wanted: Sequence[str]) -> None:
    """Refuses columns to draw that the table will not have, before it is made."""
    known = columns_of_job(job, points[0])
    for name in wanted:
        if name not in known:
            raise Refused(f'--plot: there is no column "{name}"; {nearest(name, known)}')
    for name in wanted[:2]:
        if name in TEXTS or not any(isinstance(point.get(name, 0), int | float) for point in points):
            raise Refused(f'--plot: the column "{name}" holds no numbers and has no place on an axis; it can be the colour')


def draw(table: str, args: Namespace, drawing: str) -> None:
    """Draws two columns of a table, or three, and says so."""
    columns = columns_of_table(table)
    try:
        write_svg(drawing, lambda: scatter(columns, *args.plot, front=args.front))
    except ValueError as error:
        raise Refused(f"{table}: {error}") from None
    out = without_place(columns, *args.plot)
    say(f"{drawing}: written" + (f"; {out}" if out else ""))


def columns_of_table(name: str) -> dict[str, list]:
    """The columns of a table that is written, numbers as numbers."""
    if kind_of(name) == "parquet":
        try:
            return package("pyarrow.parquet").read_table(name).to_pydict()
        except ImportError:
            raise Refused(f"{name} is read by pyarrow, which is missing: pip install 'trabecula[scale]'") from None
        except ValueError as error:  # what it says of files that are damaged
            raise Refused(f"{name}: no table in Parquet ({error!s:.80})") from None
    try:
        rows = list(csv.reader(io.StringIO(read_text(name), newline="")))
    except csv.Error as error:
        raise Refused(f"{name}: no table in CSV ({error})") from None
    if not rows:
        raise Refused(f"{name} is empty")
    return {column: [number_of(row[i]) if i < len(row) else None for row in rows[1:]] for i, column in enumerate(rows[0])}


def number_of(text: str) -> float | str:
    """A number, or the text as it is."""
    try:
        return float(text)
    except ValueError:
        return text
