#!/usr/bin/env python3
"""A lattice over tetrahedra by the explicit road: the mesher, then the surface to binary STL. CPU and wall time, peak memory.

python bench/tets.py --trabecula .venv/bin/trabecula

The domain is a ball in about 100 000 tetrahedra (more with a smaller --size). The surface's time is what `mesh` takes beyond
`tets`, which makes the same tetrahedra. Processor time is user and system, of all threads.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

DESIGN = """schema = 1
[region.sphere]
radius = 10
[lattice.a]
part = "{part}"
cell.tet.name = "{cell}"
map.tets = {{ size = {size} }}
level.fraction = {fraction}
"""

# name: (cell, part, fraction); the last has a level for every node, so that nothing can be placed from a store.
LATTICES = {
    "network": ("diamond", "lower", "0.25"),
    "sheet": ("diamond_sheet", "sheet", "0.22"),
    "graded": ("diamond", "lower", "{ linear = { along = [0, 0, 1], stops = [[-10, 0.2], [10, 0.4]] } }"),
}


def ran(command):
    """(wall s, processor s, peak MB, what it printed) of a command."""
    with tempfile.TemporaryFile("w+") as said:
        start = time.perf_counter()
        child = subprocess.Popen(command, stdout=said)
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.perf_counter() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            raise SystemExit(f"{command}: {child.returncode}")
        said.seek(0)
        return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, said.read()


def main():
    """Run and print."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--trabecula", default="trabecula", help="the command")
    options.add_argument("--size", type=float, default=0.7, help="of the tetrahedra, mm")
    options.add_argument("--steps", type=int, nargs="+", default=[8, 11], help="along the edge of a tetrahedron")
    options.add_argument("--lattices", nargs="+", default=list(LATTICES), choices=list(LATTICES))
    a = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        design, out = Path(folder) / "ball.toml", Path(folder) / "ball.stl"
        for name in a.lattices:
            cell, part, fraction = LATTICES[name]
            design.write_text(DESIGN.format(cell=cell, part=part, fraction=fraction, size=a.size))
            wall, cpu, peak, told = ran([a.trabecula, "tets", str(design), "--json"])
            quality = json.loads(told)["quality"]
            print(f"{name:8} mesher      {wall:6.2f} s, cpu {cpu:6.2f} s, {peak:6.0f} MB: {quality['tets']} tetrahedra")
            for steps in a.steps:
                edge = quality["edge"]["mean"] / steps
                command = [a.trabecula, "mesh", str(design), "-o", str(out), "--edge", repr(edge), "--json"]
                all_wall, all_cpu, peak, told = ran(command)
                triangles = json.loads(told)["triangles"]
                rate = triangles / (all_cpu - cpu) / 1e6
                each = triangles / quality["tets"]
                took = f"{all_wall:6.2f} s, cpu {all_cpu:6.2f} s, {peak:6.0f} MB"
                print(
                    f"{name:8} {steps:3} steps   {took}: {triangles} triangles, {each:.0f} a tetrahedron; "
                    f"{rate:.2f} million a cpu second"
                )


if __name__ == "__main__":
    main()
