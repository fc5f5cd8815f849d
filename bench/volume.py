"""Tetrahedra a second of volume meshes, angles and volume; seconds and bytes of their files.

  python bench/volume.py [--cells 2] [--per-cell 32] [--threads 2]

A periodic gyroid sheet (30 %) of cells of 4 mm. The peak of memory is that of the process, the interpreter included.
"""

import argparse
import os
import pathlib
import resource
import tempfile
import time

import trabecula as lt


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--cells", type=int, default=2)
    ask.add_argument("--per-cell", type=float, default=32)
    ask.add_argument("--threads", type=int, default=2)
    asked = ask.parse_args()
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(4), lt.level.fraction(0.3))
    size = 4.0 * asked.cells
    solid = lt.Design(region=lt.region.box(min=[0, 0, 0], max=[size] * 3), lattice=core).build()
    for periodic in (False, True):
        start = time.perf_counter()
        made = solid.volume_mesh(per_cell=asked.per_cell, periodic=periodic, threads=asked.threads)
        seconds = time.perf_counter() - start
        figures = made.report()
        off = figures.volume / (0.3 * size**3) - 1
        print(
            f"{'periodic' if periodic else 'cut'}: {figures.elements} tetrahedra, {seconds:.2f} s, "
            f"{figures.elements / seconds:.0f} a second; angles {figures.min_angle:.1f} to {figures.max_angle:.1f}, "
            f"volume {off:+.1e}"
        )
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")
    with tempfile.TemporaryDirectory() as scratch:
        for suffix in ("inp", "msh", "vtu", "bdf"):
            path = pathlib.Path(scratch) / f"part.{suffix}"
            start = time.perf_counter()
            made.write(path)
            print(f".{suffix}: {time.perf_counter() - start:.2f} s, {os.path.getsize(path) / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
