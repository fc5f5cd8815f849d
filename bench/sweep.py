"""A sweep of gyroid and diamond designs: seconds and processor seconds of all and of a design.

  python bench/sweep.py [--designs 1000] [--per-cell 32] [--jobs 2] [--cells 1] --python .venv/bin/python
    [--against OTHER/python]

Sheets of 0.1 to 0.4 of solid in a box of some cells along an edge; volume, area, wall and pieces of each. With ``--against``
the interpreter of another installation has a sweep of its own after each one, so that what else the machine does is the same
for both. Processor seconds are those of the command and all its processes; the start is that of a sweep of one design.
"""

import argparse
import csv
import pathlib
import resource
import subprocess
import tempfile
import time

TEXT = """schema = 1
units = "mm"
region.box.size = [{size}, {size}, {size}]
[lattice.core]
cell = "gyroid"
part = "sheet"
map.affine.wavelength = 4
level.fraction = 0.3
[sweep]
"lattice.core.cell" = ["gyroid", "diamond"]
"lattice.core.level.fraction" = {{ from = 0.1, to = 0.4, count = {count} }}
"""


def run(python, folder, count, asked):
    """Seconds and processor seconds of a sweep of twice as many designs, and how many have an error."""
    study, table = folder / "study.toml", folder / "table.csv"
    study.write_text(TEXT.format(size=4 * asked.cells, count=count))
    words = ["-m", "trabecula", "sweep", study, "-o", table, "--per-cell", asked.per_cell, "--jobs", asked.jobs, "--quiet"]
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([python, *map(str, words)], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    seconds = time.perf_counter() - start
    with open(table, newline="") as file:
        failed = sum(bool(row["error"]) for row in csv.DictReader(file))
    table.unlink()
    return seconds, busy, failed


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--designs", type=int, default=1000)
    ask.add_argument("--per-cell", type=int, default=32)
    ask.add_argument("--cells", type=int, default=1, help="cells along an edge of the box")
    ask.add_argument("--jobs", type=int, default=2)
    ask.add_argument("--rounds", type=int, default=1)
    ask.add_argument("--python", required=True)
    ask.add_argument("--against")
    asked = ask.parse_args()
    pythons = [asked.python, *([asked.against] if asked.against else [])]
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        start = {python: run(python, folder, 2, asked)[:2] for python in pythons}
        print(f"{asked.designs} designs, {asked.per_cell} a cell, {asked.cells}³ cells, {asked.jobs} processes")
        for python in pythons * asked.rounds:
            seconds, busy, failed = run(python, folder, asked.designs // 2, asked)
            net = (busy - start[python][1]) / max(asked.designs - 4, 1)
            print(
                f"{seconds:8.1f} s  {busy:8.1f} CPU s  {1e3 * net:7.1f} CPU ms a design  {failed} failed  {python}", flush=True
            )


if __name__ == "__main__":
    main()
