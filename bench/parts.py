"""Seconds of real parts: the command on all designs of examples/, and on one gyroid in a box, a sphere and a mesh.

  python bench/parts.py --trabecula .venv/bin/trabecula [--also NAME=COMMAND ...] [--rounds 3] [--only WORD]

All in turn, so that they share the machine's pace; medians; a first round is thrown away. CPU time is the one to compare.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

EXAMPLES = pathlib.Path(__file__).parent.parent / "examples"
STEM = f'[region.mesh]\npath = "{EXAMPLES / "parts" / "hip_stem.stl"}"\n'
BOX = "[region.box]\nsize = [29.25, 29.25, 27]\n"
BALL = "[region.sphere]\nradius = 17.7\n"
GYROID = '[lattice.core]\ncell = "gyroid"\npart = "sheet"\nmap.affine.wavelength = 5.0\nlevel.'
SAME = "fraction = 0.35\n"
DEPTH = "fraction = { depth = { stops = [[0, 0.60], [4, 0.25]] } }\n"
# A box, a sphere and a stem of one volume.
MADE = {
    "gyroid in a box": BOX + GYROID + SAME,
    "in a sphere": BALL + GYROID + SAME,
    "in the stem": STEM + GYROID + SAME,
    "in the stem, by depth": STEM + GYROID + DEPTH,
}
NAMED = sorted(path.stem for path in EXAMPLES.glob("*.toml"))


def timed(command):
    """Wall and CPU seconds and the peak memory (MB) of a command."""
    start = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    said = child.stderr.read()
    _, status, use = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)}: {said[-300:]}")
    peak = use.ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2)
    return time.perf_counter() - start, use.ru_utime + use.ru_stime, peak


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--trabecula", required=True)
    ask.add_argument("--also", action="append", default=[], metavar="NAME=COMMAND", help="another build to compare with")
    ask.add_argument("--rounds", type=int, default=3)
    ask.add_argument("--only", default="", help="rows with this word")
    asked = ask.parse_args()
    commands = {"this": asked.trabecula, **dict(also.split("=", 1) for also in asked.also)}
    with tempfile.TemporaryDirectory() as scratch:
        out = pathlib.Path(scratch) / "part.stl"
        designs = {name: (EXAMPLES / f"{name}.toml", []) for name in NAMED}
        for name, text in MADE.items():
            path = pathlib.Path(scratch) / f"{name}.toml"
            path.write_text('schema = 1\nunits = "mm"\n' + text)
            designs[name] = (path, ["--edge", "0.15625"])
        rows = {
            (name, who): [command, "mesh", str(path), "-o", str(out), *options]
            for name, (path, options) in designs.items()
            for who, command in commands.items()
            if asked.only in name
        }
        found = {row: [] for row in rows}
        for round_ in range(asked.rounds + 1):
            for row, command in rows.items():
                figures = (*timed(command), (out.stat().st_size - 84) // 50)
                out.unlink()
                if round_:
                    found[row].append(figures)
    print(f"{'design':24s} {'build':8s} {'wall s':>8s} {'CPU s':>8s} {'MB':>6s} {'triangles':>11s} {'µs CPU each':>12s}")
    for (name, who), runs in found.items():
        wall, cpu, peak, triangles = (statistics.median(of) for of in zip(*runs, strict=True))
        print(f"{name:24s} {who:8s} {wall:8.2f} {cpu:8.2f} {peak:6.0f} {triangles:11.0f} {1e6 * cpu / triangles:12.2f}")


main()
