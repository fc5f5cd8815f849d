#!/usr/bin/env python3
"""Beams from their own quadrics beside beams on a grid, in one run: time, triangles, error of the volume.

python bench/beams.py --trabecula .venv/bin/trabecula

The design is a block of filleted octet cells that its region does not cut, so its volume is known in closed form (`check`). The
surface is made from the patches to a chord error, and on a grid with about as many triangles.
"""

import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path

DESIGN = """schema = 1
[region.box]
min = [-1, -1, -1]
max = [{end}, {end}, {end}]
[beams.core]
cell = "octet"
radius = 0.5
fillet = "auto"
trim = "drop"
map.affine.wavelength = 10
"""


def ran(command):
    """(seconds, what it printed) of a command."""
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return time.perf_counter() - start, done.stdout


def main():
    """Run and print."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--trabecula", default="trabecula", help="the command")
    options.add_argument("--cells", type=int, default=4, help="cells along each edge")
    options.add_argument("--chord", type=float, nargs="+", default=[0.02, 0.005], help="chord errors, mm")
    options.add_argument("--edge", type=float, nargs="+", default=[0.2, 0.1], help="spacings of the grid, mm")
    a = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        design, out = Path(folder) / "octet.toml", Path(folder) / "octet.stl"
        design.write_text(DESIGN.format(end=10 * a.cells + 1))
        seconds, told = ran([a.trabecula, "check", str(design), "--json"])
        core = json.loads(told)["beams"]["core"]
        exact = core["volume"]
        print(f"{'exact':14} {seconds:7.2f} s  {core['hubs']} hubs, {core['beams']} beams, {exact:.9g} mm³")
        roads = [("chord", c) for c in a.chord] + [("edge", e) for e in a.edge]
        for road, size in roads:
            command = [a.trabecula, "mesh", str(design), "-o", str(out), f"--{road}", repr(size), "--json"]
            seconds, told = ran(command)
            made = json.loads(told)
            error = made["volume"] / exact - 1
            rate = made["triangles"] / seconds / 1e6
            print(
                f"{road:5} {size:5g} mm {seconds:7.2f} s  {made['triangles']:9} triangles ({rate:.2f} million/s), "
                f"volume error {error:+.1e}"
            )
            # A chord error of a hundredth of the radius is a hundredth of the volume at most.
            assert abs(error) < 0.05, f"{road} {size}: the volume is off by {error:.1e}"


if __name__ == "__main__":
    main()
