#!/usr/bin/env python3
"""Beams from their own quadrics beside beams on a grid, in one run: time, triangles, error of the volume.

python bench/beams.py --trabecula .venv/bin/trabecula

The design is a block of filleted octet cells that its region does not cut, so its volume is known in closed form (`check`). The
surface is made from the patches to a chord error, and on a grid with about as many triangles.

Before that, exact queries by processor time: the volume of hubs of which no two are equal, and nearest places; then membership,
field values and slices of some 100 000 beams of octet cells.
"""

import argparse
import json
import shutil
import subprocess
import sys
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


#: Prints processor seconds of one call, by another interpreter that has the package.
QUERIES = """
import sys, time, warnings
import numpy as np
import trabecula as lt

cell, n, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
warnings.simplefilter("ignore")
unit = [[0, 0, 0]] if cell == "sc" else [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]
ways = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] if cell == "sc" else [
    [0.5, 0.5, 0], [0.5, -0.5, 0], [0.5, 0, 0.5], [0.5, 0, -0.5], [0, 0.5, 0.5], [0, 0.5, -0.5]]
grid = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
nodes = np.round((grid + np.array(unit)).reshape(-1, 3) * 2).astype(int)
number = {tuple(p): i for i, p in enumerate(nodes)}
steps = np.round(np.array(ways) * 2).astype(int)
struts = [[i, number[tuple(p + s)]] for i, p in enumerate(nodes) for s in steps if tuple(p + s) in number]
random = np.random.default_rng(1)
places = 5.0 * nodes + random.uniform(-0.4, 0.4, nodes.shape)
radii = random.uniform(0.5, 0.6, len(nodes))
beams = lt.Beams(nodes=np.column_stack([places, radii]).tolist(), struts=struts, radius=0.45, fillet="auto")
size = 10.0 * n + 10
quadors = lt.Design(region=lt.region.box(min=[-10] * 3, max=[size] * 3), beams=beams).build().quadors()
start = time.process_time()
volume = quadors.volume()
taken = time.process_time() - start
print(len(quadors), 2 * len(struts) / len(quadors), taken)
points = random.uniform(0, 10 * n, (count, 3))
quadors.closest(points)
start = time.process_time()
quadors.closest(points)
print(count, 0, time.process_time() - start)
"""

#: Prints processor seconds of queries of many equal cells, by another interpreter that has the package.
MANY = """
import sys, time, warnings
import numpy as np
import trabecula as lt

fillet, cells, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
warnings.simplefilter("ignore")
beams = lt.Beams(cell="octet", map=lt.map.affine(wavelength=10), radius=0.5, fillet=fillet)
size = 10.0 * cells
solid = lt.Design(region=lt.region.box(min=[0] * 3, max=[size] * 3), beams=beams).build()
quadors = solid.quadors()
points = np.random.default_rng(1).uniform(0, size, (count, 3))

def seconds(query):
    query()
    start = time.process_time()
    query()
    return time.process_time() - start

slices = lambda: [quadors.slice(z=size * part) for part in (0.21, 0.47, 0.73)]
held, field = (lambda: quadors.contains(points)), (lambda: solid.field(points))
print(solid.report().beams["core"].beams, *map(seconds, (held, field, slices)))
"""


def many(python, fillet, cells=16, count=500_000):
    """Prints the rates of queries of many equal cells."""
    command = [python, "-c", MANY, fillet, str(cells), str(count)]
    beams, *taken = map(float, subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())
    held, field, slices = taken
    rates = f"membership {count / held / 1e6:.2f} and field values {count / field / 1e6:.2f} million/s on one processor"
    print(f"{fillet:14} {beams:7.0f} beams: {rates}, slices {1e3 * slices / 3:.0f} ms each")


def queries(python, cell, n):
    """Prints the rates of one kind of hubs."""
    told = subprocess.run([python, "-c", QUERIES, cell, str(n), "20000"], capture_output=True, text=True, check=True).stdout
    (hubs, valence, seconds), (points, _, near) = [map(float, line.split()) for line in told.splitlines()]
    print(
        f"{'volume':14} {seconds:7.2f} s  of {hubs:.0f} distinct hubs, valence {valence:.1f} in the mean: "
        f"{1e6 * seconds / hubs:.0f} µs each on one processor, {2 * hubs / seconds:.0f}/s on two"
    )
    print(f"{'nearest':14} {near:7.2f} s  of {points:.0f} points: {1e6 * near / points:.1f} µs each on one processor")


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
    python = shutil.which("python", path=str(Path(a.trabecula).resolve().parent)) or sys.executable
    for cell, n in [("sc", 20), ("fcc", 10)]:
        queries(python, cell, n)
    for fillet in ("none", "auto"):
        many(python, fillet)
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
            # Triangles to a chord error enclose the volume of the closed form, which is known to 1e-10.
            most = 1e-9 if road == "chord" else 0.05
            assert abs(error) < most, f"{road} {size}: the volume is off by {error:.1e}"


if __name__ == "__main__":
    main()
