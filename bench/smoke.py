#!/usr/bin/env python3
"""Every workload once, small, by the command alone: is the volume right? Times are printed, never judged.

python bench/smoke.py --trabecula .venv/bin/trabecula
"""

import argparse
import tempfile
from pathlib import Path

import workloads as w
from peers import timed


def main():
    """Run and print."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--trabecula", default="trabecula", help="the command")
    options.add_argument("--n", type=int, default=129, help="samples along each axis")
    a = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for work, (_, _, exact) in w.WORKLOADS.items():
            design, out = Path(folder) / f"{work}.toml", Path(folder) / f"{work}.stl"
            design.write_text(w.design(work))
            seconds, peak = timed([a.trabecula, "mesh", str(design), "-o", str(out), "--edge", repr(w.spacing(a.n))])
            triangles, volume = w.read_volume(out)
            error = volume / exact - 1
            print(f"{work:10} n = {a.n}: {seconds:.3f} s, {peak:.0f} MB, {triangles} triangles, volume error {error:.1e}")
            # 32 samples for each cell: a sheet is within 1e-4 of its volume.
            assert abs(error) < 1e-4, f"{work}: the volume is off by {error:.1e}"


if __name__ == "__main__":
    main()
